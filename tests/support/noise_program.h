/* What tests of `caustica noise` from outside share: its room, and what it says of times and recommended numbers.
 * Included by the test programs only. */
#ifndef CA_TEST_NOISE_PROGRAM_H
#define CA_TEST_NOISE_PROGRAM_H

#include "image/layers.h"
#include "noise/ray_map.h"
#include "support/named_layer.h"
#include "support/program_room.h"
#include "support/scene_text.h"

#include <math.h>

/* Its integrator and sampler are not what the law wants. */
static const char *const room_text =
    ROOM_TEXT("  <default name=\"power\" value=\"40\"/>\n"
              "  <default name=\"integrator\" value=\"path\"/>\n"
              "  <default name=\"sampler\" value=\"sobol\"/>\n"
              "  <integrator type=\"$integrator\"><integer name=\"max_depth\" value=\"4\"/></integrator>\n",
              "$sampler", "3", "$power");

#define COUNTS(light, camera, iterations)                                                                            \
    "--light-paths=" #light, "--camera-paths=" #camera, "--iterations=" #iterations
#define ROOM "room.xml", "--radius=0.5", "--threads=2"

static inline int set_up_room(void **state)
{
    const int status = set_up(state);
    if (status == 0) write_text(folder_of(state), "room.xml", room_text);
    return status;
}

static inline void assert_near(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s is %.9g, not %.9g +- %.2g", what, value, expected, tolerance);
}

#define ROOM_TEST(function) cmocka_unit_test_setup_teardown(function, set_up_room, tear_down)

/* A time is told where it is above its standard error, printed and in --stats; gives back how many are not. */
static inline int assert_times(const json_t *times, const char *output)
{
    static const char *const rows[4][2] = {{"iteration", "\n  iteration "},
                                           {"light_path", "\n  light path "},
                                           {"camera_path", "\n  camera path "},
                                           {"candidate", "\n  merge candidate "}};
    int unknown = 0;
    for (int i = 0; i < 4; i++) {
        char key[32], row[128];
        const char *begin = strstr(output, rows[i][1]);
        if (!begin) fail_msg("there is no row \"%s\" in:\n%s", rows[i][1], output);
        snprintf(row, sizeof row, "%.*s", (int)strcspn(begin + 1, "\n"), begin + 1);
        snprintf(key, sizeof key, "%s_error", rows[i][0]);
        assert_true(json_number(times, key) > 0.0);
        if (json_is_null(json_object_get(times, rows[i][0]))) {
            assert_says(row, "not measurable");
            unknown++;
            continue;
        }
        assert_true(json_number(times, rows[i][0]) > json_number(times, key));
        assert_says(row, " +- ");
        assert_null(strstr(row, "not measurable"));
    }
    return unknown;
}

/* The recommendation of --stats against the map of the .exr, and itself. */
static inline void assert_recommendation(const json_t *root, const ca_image_layers *image, const char *objective,
                                         const char *output)
{
    const json_t *r = json_object_get(root, "recommendation"), *best = json_object_get(r, "best"),
                 *uniform = json_object_get(r, "uniform"), *given = json_object_get(r, "given");
    const json_t *times = json_object_get(root, "times");
    const float *map = named_layer(image, CA_RAY_MAP_LAYER);
    double mean = 0.0, fewest = 1e9, most = 0.0;
    for (int i = 0; i < PIXELS; i++) {
        mean += (double)map[i] / PIXELS;
        fewest = fmin(fewest, (double)map[i]);
        most = fmax(most, (double)map[i]);
    }
    assert_string_equal(json_string_value(json_object_get(r, "objective")), objective);
    assert_near("the mean of the map", json_number(best, "camera_paths"), mean, 1e-6 * mean);
    assert_true(json_number(r, "fewest_camera_paths") == fewest && json_number(r, "most_camera_paths") == most &&
                fewest >= 1.0);
    const double cost = json_number(best, "variance") * json_number(best, "seconds");
    const double gain = json_number(given, "variance") * json_number(given, "seconds") / cost;
    assert_near("the gain", json_number(r, "gain_over_given"), gain, 1e-6 * gain);
    const double uniform_gain = json_number(uniform, "variance") * json_number(uniform, "seconds") / cost;
    assert_near("the gain over uniform numbers", json_number(r, "gain_over_uniform"), uniform_gain,
                1e-6 * uniform_gain);
    assert_times(times, output);
    assert_true(json_number(times, "candidates_per_pair") > 0.0);
    char light_paths[32];
    snprintf(light_paths, sizeof light_paths, "%.0f", json_number(best, "light_paths"));
    assert_string_equal(attribute_text(image, CA_RAY_MAP_LIGHT_PATHS), light_paths);
}

#endif
