#include "support/shared_light_fixture.h"

ca_light_fixture fixture;

int set_up(void **state)
{
    (void)state;
    ca_light_fixture_create(&fixture);
    return 0;
}

int tear_down(void **state)
{
    (void)state;
    ca_light_fixture_destroy(&fixture);
    return 0;
}
