#define _DEFAULT_SOURCE /* usleep */
/* Integrator `auto` from outside: what is said of its choice, and that the choice can be used again. */
#include "base/clock.h"
#include "support/live_client.h"
#include "support/program_test.h"

#include <math.h>
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
        const char *tried = json_string_value(json_object_get(trial, "integrator"));
        const bool has_none = tried && (strcmp(tried, "path") == 0 || strcmp(tried, "ppm") == 0);
        const json_t *splats = json_object_get(trial, "splats");
        assert_true(has_none ? json_is_null(splats) : json_is_boolean(splats) || strcmp(tried, "bdpm") == 0);
    }
    json_decref(stats);
}

/* Does the reason tell what a user would set to have the method again, and nothing else? */
static void assert_tells_settings(const json_t *stats)
{
    const json_t *parameters = json_object_get(json_object_get(stats, "integrator"), "parameters");
    const char *reason = json_string_value(json_object_get(json_object_get(stats, "method"), "reason"));
    const json_t *radius = json_object_get(parameters, "radius");
    const json_t *camera_paths = json_object_get(parameters, "camera_paths");
    char words[64];
    assert_non_null(reason);
    if ((strstr(reason, ", merge radius ") != NULL) != (radius != NULL)) fail_msg("%s", reason);
    snprintf(words, sizeof words, ", merge radius %.4g, ", radius ? json_number_value(radius) : 0.0);
    if (radius) assert_says(reason, words);
    const double count = camera_paths ? json_number_value(camera_paths) : 1.0;
    if ((strstr(reason, "camera paths") != NULL) != (count > 1.0)) fail_msg("%s", reason);
    snprintf(words, sizeof words, " light paths and %.0f camera paths per pixel a pass", count);
    if (count > 1.0) assert_says(reason, words);
    if (camera_paths) assert_says(reason, " a pass");
    assert_null(strchr(reason, '\n'));
}

/* Once, and where nothing else is said, too. */
static void test_warns_of_dots(void **state)
{
    static const char begins[] = "caustica: warning: about ";
    ca_program_result r;
    RUN(&r, "render", CA_SOURCE_DIR "/scenes/paper-000/water-caustic.xml", "-i", "auto:radius=1e-6", "--spp=3",
        "--resolution=24x16", "-o", "a.pfm", "--quiet");
    assert_exit(&r, 0);
    if (strncmp(r.errors, begins, strlen(begins)) != 0) fail_msg("it says: %s", r.errors);
    assert_says(r.errors, "of the light will be dots");
    assert_true(strchr(r.errors, '\n') == r.errors + strlen(r.errors) - 1); /* one line */
}

/* Only merges find light under the slab; a bare ball is anybody's. */
static void test_tells_radius_and_camera_paths(void **state)
{
    static const char *const integrators[] = {"auto", "auto:camera_paths=3", "auto:radius=0.125"};
    const char *const slab = CA_SOURCE_DIR "/scenes/glass-slab/glass-slab.xml";
    write_scene(state);
    for (size_t i = 0; i < 6; i++) {
        ca_program_result r;
        const char *const name = i < 3 ? slab : "any.xml", *const integrator = integrators[i % 3];
        RUN(&r, "render", name, "-i", integrator, "--spp=3", "--resolution=24x16", "-o", "a.pfm", "--stats",
            "a.json");
        assert_exit(&r, 0);
        json_t *stats = load_json(folder_of(state), "a.json");
        assert_tells_settings(stats);
        if (i < 3) assert_says(r.errors, ", merge radius ");
        if (i == 1) assert_says(r.errors, " light paths and 3 camera paths per pixel a pass, merge radius ");
        if (i == 2) assert_says(r.errors, ", merge radius 0.125, ");
        json_decref(stats);
    }
}

/* ---- What ends it, and what it knows of its noise -------------------------------------------------------------- */

static const char *const caustics = CA_SOURCE_DIR "/scenes/caustics/caustics.xml";

/* The time is that of choosing and of rendering: of one thread, which takes long to choose. On a machine that has
 * other work all takes longer. */
static void test_time(void **state)
{
    ca_program_result r;
    const double asked = 2.0, start = ca_clock_seconds();
    RUN(&r, "render", caustics, "-i", "auto", "--time=2", "--threads=1", "--resolution=48x32", "-o", "a.exr",
        "--stats", "a.json");
    const double whole = ca_clock_seconds() - start;
    assert_exit(&r, 0);
    json_t *stats = load_json(folder_of(state), "a.json");
    const double seconds = json_number(stats, "seconds");
    const double choosing = json_number(json_object_get(stats, "method"), "seconds");
    print_message("%.2f s, %.2f of them to choose, of %.2f s for all\n", seconds, choosing, whole);
    assert_true(choosing > 0.05 && choosing < seconds);
    assert_true(seconds >= asked && seconds < fmax(asked, choosing) + 1.0);
    assert_true(whole - seconds < 0.7 * choosing); /* reading the scene and writing; else choosing is not counted */
    assert_true(json_number(stats, "iterations") >= 1.0);
    json_decref(stats);
}

/* Every pixel has an interval with its value in it. */
static void assert_intervals(void **state, const char *name)
{
    ca_image_layers *image = read_image(state, name);
    static const char *const channels[][3] = {{"R", "ConfidenceLow.R", "ConfidenceHigh.R"},
                                              {"G", "ConfidenceLow.G", "ConfidenceHigh.G"}};
    for (size_t c = 0; c < 2; c++) {
        const float *value = ca_image_channel(image, channels[c][0]), *low = ca_image_channel(image, channels[c][1]);
        const float *high = ca_image_channel(image, channels[c][2]);
        double width = 0.0;
        assert_true(value && low && high);
        for (size_t p = 0; p < (size_t)image->width * image->height; p++) {
            assert_true(isfinite(low[p]) && isfinite(high[p]) && low[p] <= value[p] && value[p] <= high[p]);
            width += (double)high[p] - (double)low[p];
        }
        assert_true(width > 0.0);
    }
    ca_image_release(image);
}

static void test_noise(void **state)
{
    ca_program_result r;
    RUN(&r, "render", caustics, "-i", "auto", "--noise=20", "--resolution=48x32", "-o", "n.exr", "--stats", "n.json");
    assert_exit(&r, 0);
    json_t *stats = load_json(folder_of(state), "n.json");
    const double noise = json_number(stats, "noise_percent");
    assert_true(noise > 10.0 && noise <= 20.0);
    assert_true(json_is_false(json_object_get(stats, "interrupted")));
    assert_true(json_number(stats, "iterations") >= 8.0);
    assert_true(json_number(stats, "confidence_marked") == 0.0);
    json_decref(stats);
    assert_intervals(state, "n.exr");
}

/* The page is there before the method is; it shows the picture, and ends the render. */
static void test_serve(void **state)
{
    static char answer[65536];
    char output[128];
    ca_live_place place;
    const char *const words[] = {"render", caustics, "-i", "auto", "--time=100", "--serve", "--resolution=48x32",
                                 "-o", "s.exr", NULL};
    ca_program_result r;
    size_t size = 0;
    const double start = ca_clock_seconds();
    const pid_t process = ca_program_start(*state, words, -1);
    snprintf(output, sizeof output, "%s/.stdout", folder_of(state));
    assert_true(ca_live_wait_for_place(&place, output));
    for (int i = 0; i < 1200 && !strstr(answer, "\"names\":[\""); i++, usleep(50000)) {
        const int client = ca_live_open(&place, "GET", "layers");
        assert_true(client >= 0);
        size = ca_live_read(client, NULL, answer, sizeof answer);
        close(client);
    }
    const int client = ca_live_open(&place, "POST", "stop");
    assert_true(client >= 0);
    ca_live_read(client, NULL, answer + size, sizeof answer - size);
    close(client);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
    assert_says(answer, "\"names\":[\"R\"");
    assert_says(r.errors, "caustica: auto: ");
    assert_says(r.output, "(ended early by the live view)");
    assert_true(ca_clock_seconds() - start < 90.0);
    ca_image_release(read_image(state, "s.exr"));
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
        PROGRAM_TEST(test_warns_of_dots),
        PROGRAM_TEST(test_tells_radius_and_camera_paths),
        PROGRAM_TEST(test_time),
        PROGRAM_TEST(test_noise),
        PROGRAM_TEST(test_serve),
        PROGRAM_TEST(test_quiet_and_named),
        PROGRAM_TEST(test_choice_of_a_picture),
    };
    return run_program_tests("the program: auto", tests, sizeof tests / sizeof tests[0]);
}
