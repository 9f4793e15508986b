/* Scenes of one feature against Mitsuba 3: tests/mitsuba/textures. */
#include "support/mitsuba_scenes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void scenes_agree(void **state)
{
    (void)state;
    compare_with_mitsuba("textures", false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(scenes_agree)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
