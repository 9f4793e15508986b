/* One light fixture for a whole test program: made before its tests, released after them. */
#ifndef CA_TEST_SHARED_LIGHT_FIXTURE_H
#define CA_TEST_SHARED_LIGHT_FIXTURE_H

#include "support/light_fixture.h"

extern ca_light_fixture fixture;

/* For cmocka_run_group_tests. */
int set_up(void **state);
int tear_down(void **state);

#endif
