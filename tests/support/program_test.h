/* What tests of the program from outside share: a scene, looking at files and messages, and a main that skips, and
 * says so, where there is no program. Included by the test programs only; *state is the ca_program. */
#ifndef CA_TEST_PROGRAM_TEST_H
#define CA_TEST_PROGRAM_TEST_H

#include "image/layers.h"
#include "support/run_program.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>

#ifndef CA_PROGRAM
#define CA_PROGRAM "" /* this build makes none */
#endif

/* A sphere of a given albedo in light of radiance 1 from everywhere. */
static const char scene_text[] =
    "<scene version=\"3.0.0\">\n"
    "  <default name=\"albedo\" value=\"0.5\"/>\n"
    "  <integrator type=\"path\"><integer name=\"max_depth\" value=\"4\"/></integrator>\n"
    "  <sensor type=\"perspective\">\n"
    "    <float name=\"fov\" value=\"20\"/>\n"
    "    <transform name=\"to_world\"><lookat origin=\"0,0,9\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\n"
    "    <sampler type=\"independent\"><integer name=\"sample_count\" value=\"4\"/></sampler>\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"24\"/><integer name=\"height\" "
    "value=\"16\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"sphere\"><float name=\"radius\" value=\"3\"/>\n"
    "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"$albedo\"/></bsdf></shape>\n"
    "  <emitter type=\"constant\"><rgb name=\"radiance\" value=\"1\"/></emitter>\n"
    "</scene>\n";

#define RUN(result, ...) ca_program_run(*state, (const char *const[]){__VA_ARGS__, NULL}, result)

static inline const char *folder_of(void **state) { return ((const ca_program *)*state)->folder; }

static inline void write_text(const char *folder, const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    assert_int_equal(fclose(file), 0);
}

static inline bool exists(const char *folder, const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, F_OK) == 0;
}

static inline void assert_says(const char *text, const char *words)
{
    if (!strstr(text, words)) fail_msg("\"%s\" is not said in:\n%s", words, text);
}

static inline void assert_exit(const ca_program_result *result, int expected)
{
    if (result->exit_status != expected)
        fail_msg("exit status %d (signal %d) instead of %d:\n%s%s", result->exit_status, result->signal, expected,
                 result->output, result->errors);
}

/* The words of the command line are refused, and the message says so. */
static inline void assert_wrong_usage(const ca_program_result *result, const char *words)
{
    assert_exit(result, 2);
    assert_says(result->errors, words);
}

static inline ca_image_layers *read_image(void **state, const char *name)
{
    char path[256];
    ca_image_layers *image;
    ca_error error = {""};
    snprintf(path, sizeof path, "%s/%s", folder_of(state), name);
    if (ca_layers_read(path, &image, &error) != CA_OK) fail_msg("%s", error.message);
    return image;
}

static inline json_t *load_json(const char *folder, const char *name)
{
    char path[256];
    json_error_t error;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    json_t *root = json_load_file(path, 0, &error);
    if (!root) fail_msg("%s: %s", name, error.text);
    return root;
}

static inline double json_number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    if (!json_is_number(value)) fail_msg("no number \"%s\"", key);
    return json_number_value(value);
}

static inline int set_up(void **state)
{
    static ca_program opened;
    if (!ca_program_open(&opened, CA_PROGRAM)) return -1;
    *state = &opened;
    write_text(opened.folder, "ball.xml", scene_text);
    return 0;
}

static inline int tear_down(void **state)
{
    if (*state) ca_program_close(*state);
    return 0;
}

/* Stands for all others where there is nothing to test. */
static inline void test_program_is_there(void **state)
{
    (void)state;
    print_message("SKIPPED: no program caustica: set CAUSTICA_PROGRAM or build the target caustica\n");
    skip();
}

static inline int run_program_tests(const char *name, const struct CMUnitTest *tests, size_t count)
{
    ca_program program;
    const struct CMUnitTest missing[] = {cmocka_unit_test(test_program_is_there)};
    if (!ca_program_open(&program, CA_PROGRAM)) return _cmocka_run_group_tests(name, missing, 1, NULL, NULL);
    ca_program_close(&program);
    return _cmocka_run_group_tests(name, tests, count, NULL, NULL);
}

#define PROGRAM_TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)

#endif
