/* Integrator `auto` from outside: what is said of its choice, and that the choice can be used again. */
#include "support/program_test.h"

#include <stdlib.h>

/* The scene without its integrator. */
static void write_scene(void **state)
{
    char text[sizeof scene_text];
    memcpy(text, scene_text, sizeof scene_text);
    char *begin = strstr(text, "<integrator"), *end = strstr(text, "</integrator>");
    assert_true(begin && end);
    memset(begin, ' ', (size_t)(end - begin) + strlen("</integrator>"));
    write_text(folder_of(state), "any.xml", text);
}

static void test_says_what_it_chose(void **state)
{
    ca_program_result r;
    write_scene(state);
    RUN(&r, "render", "any.xml", "-o", "a.exr", "--stats", "a.json");
    assert_exit(&r, 0);
    if (strncmp(r.errors, "caustica: auto: ", 16) != 0) fail_msg("it says: %s", r.errors);
    assert_says(r.errors, " tried in ");
    assert_true(strchr(r.errors, '\n') == r.errors + strlen(r.errors) - 1); /* one line */
    json_t *stats = load_json(folder_of(state), "a.json");
    const json_t *method = json_object_get(stats, "method"), *trials = json_object_get(method, "trials");
    const char *name = json_string_value(json_object_get(json_object_get(stats, "integrator"), "name"));
    const char *reason = json_string_value(json_object_get(method, "reason"));
    assert_true(name && reason && strncmp(reason, "auto: ", 6) == 0);
    assert_memory_equal(reason + 6, name, strlen(name));
    assert_true(json_number(method, "seconds") > 0.0 &&
                json_number(method, "seconds") < json_number(stats, "seconds"));
    assert_true(json_array_size(trials) > 3);
    for (size_t i = 0; i < json_array_size(trials); i++) {
        const json_t *trial = json_array_get(trials, i);
        assert_true(json_number(trial, "iterations") >= 2.0 && json_number(trial, "seconds") > 0.0);
        assert_true(json_number(trial, "variance") >= 0.0 && json_number(trial, "dot_variance") >= 0.0);
    }
    json_decref(stats);
}

static void test_quiet_and_named(void **state)
{
    ca_program_result r;
    write_scene(state);
    RUN(&r, "render", "any.xml", "-o", "a.pfm", "--quiet");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    RUN(&r, "render", "any.xml", "-ipath", "-o", "a.pfm", "--stats", "a.json");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    json_t *stats = load_json(folder_of(state), "a.json");
    assert_true(json_is_null(json_object_get(stats, "method")));
    json_decref(stats);
    RUN(&r, "info", "any.xml");
    assert_exit(&r, 0);
    assert_says(r.output, "integrator  auto\n");
}

/* The same picture, to the bit, on whatever machine. */
static void test_choice_of_a_picture(void **state)
{
    ca_program_result r;
    write_scene(state);
    RUN(&r, "render", "any.xml", "-i", "auto:max_depth=3", "--seed=7", "-o", "a.exr", "-o", "a.pfm", "--quiet");
    assert_exit(&r, 0);
    RUN(&r, "render", "any.xml", "--rays", "a.exr", "--seed=7", "--threads=1", "-o", "b.pfm");
    assert_exit(&r, 0);
    assert_says(r.errors, ", as a.exr says\n");
    RUN(&r, "compare", "b.pfm", "--reference", "a.pfm");
    assert_exit(&r, 0);
    assert_says(r.output, "RMSE                0\n");
    RUN(&r, "render", "any.xml", "--rays", "b.pfm", "-o", "c.pfm");
    assert_exit(&r, 1);
    assert_says(r.errors, "b.pfm: the picture does not say which method it was made with");
    assert_false(exists(folder_of(state), "c.pfm"));
    RUN(&r, "noise", "any.xml", "-i", "auto", "--iterations=2");
    assert_exit(&r, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_says_what_it_chose),
        PROGRAM_TEST(test_quiet_and_named),
        PROGRAM_TEST(test_choice_of_a_picture),
    };
    return run_program_tests("the program: auto", tests, sizeof tests / sizeof tests[0]);
}
