/* The table of integrators: finding a row, and parameters from the table, the scene and the command line. */
#include "integrator/integrator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { DEPTH, RADIUS, ALPHA, CAREFUL, RULE };

static const ca_parameter_spec specs[] = {
    [DEPTH] = {"depth", CA_SPEC_INTEGER, .minimum = -1, .number = 7},
    [RADIUS] = {"radius", CA_SPEC_REAL, .minimum = 0, .number = 0},
    [ALPHA] = {"alpha", CA_SPEC_REAL, .minimum = 0, .maximum = 1, .number = 0.5},
    [CAREFUL] = {"careful", CA_SPEC_BOOLEAN, .number = 1},
    [RULE] = {"rule", CA_SPEC_CHOICE, .choices = "balance|power", .number = 1},
    {.name = NULL},
};
static const ca_integrator_type type = {.name = "sample", .parameters = specs};

/* The scene's <float name="radius" value="0.1"/> and an option of the integrator "path". */
static ca_parameter scene_items[2];
static ca_integrator_desc scene_desc(void)
{
    scene_items[0] = (ca_parameter){.name = "radius",
                                    .kind = CA_PARAMETER_NUMBER,
                                    .number = 0.1,
                                    .where = {.file = "a.xml", .line = 3, .column = 5}};
    scene_items[1] = (ca_parameter){.name = "hide_emitters",
                                    .kind = CA_PARAMETER_BOOLEAN,
                                    .number = 1,
                                    .where = {.file = "a.xml", .line = 4, .column = 5}};
    ca_integrator_desc desc = {.name = "sample"};
    desc.parameters.items = scene_items;
    desc.parameters.count = 2;
    return desc;
}

static void test_defaults_scene_overrides(void **state)
{
    (void)state;
    ca_integrator_desc desc = scene_desc();
    ca_integrator_input input = {0};
    ca_error error;
    /* What the replaced integrator of the scene alone knew is left out ... */
    assert_int_equal(
        ca_integrator_configure(&type, &desc, true, "alpha=0.25,rule=balance,careful=false", &input, &error), CA_OK);
    assert_true(input.values[DEPTH] == 7.0 && input.values[RADIUS] == 0.1 && input.values[ALPHA] == 0.25);
    assert_true(input.values[CAREFUL] == 0.0 && input.values[RULE] == 0.0);
    assert_true(ca_integrator_value(&type, &input, "alpha", 9.0) == 0.25);
    assert_true(ca_integrator_value(&type, &input, "alphas", 9.0) == 9.0);
    /* ... but is a mistake where the scene names this one. */
    assert_int_equal(ca_integrator_configure(&type, &desc, false, NULL, &input, &error), CA_ERROR_SCENE);
    assert_non_null(strstr(error.message, "a.xml:4:5: integrator \"sample\" has no parameter \"hide_emitters\""));
}

static void test_description_has_all_values(void **state)
{
    (void)state;
    const ca_integrator_desc desc = {.name = NULL};
    ca_integrator_input input = {0};
    char text[256];
    assert_int_equal(ca_integrator_configure(&type, &desc, false, "radius=0.0123456789,depth=-1", &input, NULL),
                     CA_OK);
    ca_integrator_describe(&type, &input, text, sizeof text);
    assert_string_equal(text, "sample:depth=-1,radius=0.0123456789,alpha=0.5,careful=true,rule=power");
}

static void test_wrong_values(void **state)
{
    (void)state;
    static const struct {
        const char *overrides, *says;
    } cases[] = {
        {"depth=-2", "\"depth\" must be a whole number of at least -1"},
        {"depth=2.5", "\"depth\" must be a whole number"},
        {"depth=2000000000", "at most 1000000000"},
        {"radius=-0.5", "\"radius\" must be a number of at least 0"},
        {"radius=true", "\"radius\" must be a number"},
        {"radius=nan", "\"radius\" must be a number"},
        {"radius=1e999", "\"radius\" must be a number"},
        {"radius", "\"radius\" must be a number"},
        {"alpha=1.0001", "\"alpha\" must be a number of at least 0 and at most 1"},
        {"careful=1", "\"careful\" must be true or false"},
        {"rule=maximum", "\"rule\" must be one of balance|power"},
        {"rule=pow", "\"rule\" must be one of balance|power"},
        {"radios=1", "did you mean \"radius\"?"},
        {"radius=1,depth=2,radius=1", "parameter \"radius\" of the integrator is given twice"},
    };
    const ca_integrator_desc desc = {.name = NULL};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_integrator_input input = {0};
        ca_error error = {""};
        assert_int_equal(ca_integrator_configure(&type, &desc, false, cases[i].overrides, &input, &error),
                         CA_ERROR_ARGUMENT);
        if (!strstr(error.message, cases[i].says)) fail_msg("%s: %s", cases[i].overrides, error.message);
    }
}

/* Numbers that no text can make, from a caller's settings. */
static void test_numbers_that_are_none(void **state)
{
    (void)state;
    static const double wrong[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 3; i++) {
        ca_integrator_input input = {0};
        const ca_parameter radius = {.name = "radius", .kind = CA_PARAMETER_NUMBER, .number = wrong[i]};
        const ca_parameter depth = {.name = "depth", .kind = CA_PARAMETER_NUMBER, .number = wrong[i]};
        assert_int_equal(ca_integrator_set(&type, &radius, &input, NULL), CA_ERROR_ARGUMENT);
        assert_int_equal(ca_integrator_set(&type, &depth, &input, NULL), CA_ERROR_ARGUMENT);
    }
}

static void test_rows_of_the_table(void **state)
{
    (void)state;
    const ca_integrator_type *found = NULL;
    ca_error error;
    assert_int_equal(ca_integrator_find("path", NULL, &found, &error), CA_OK);
    assert_ptr_equal(found, &ca_integrator_path);
    assert_int_equal(ca_integrator_find("paht", NULL, &found, &error), CA_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "did you mean \"path\"?"));
    const ca_location where = {.file = "a.xml", .line = 2, .column = 1};
    assert_int_equal(ca_integrator_find("magic", &where, &found, &error), CA_ERROR_SCENE);
    assert_non_null(strstr(error.message, "a.xml:2:1: unknown integrator \"magic\" (there are: path"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults_scene_overrides),
        cmocka_unit_test(test_description_has_all_values),
        cmocka_unit_test(test_wrong_values),
        cmocka_unit_test(test_numbers_that_are_none),
        cmocka_unit_test(test_rows_of_the_table),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
