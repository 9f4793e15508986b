/* `caustica noise` from outside: the numbers that it recommends, and when it recommends none. */
#define _GNU_SOURCE
#include "support/noise_program.h"

#include <pty.h>
#include <signal.h>

/* ---- Recommended numbers --------------------------------------------------------------------------------------- */

static void test_recommendation(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", ROOM, COUNTS(60, 5, 20), "--max-depth=3", "-Dpower=4, 1, 2", "--objective=relative", "-oa.exr",
        "--stats=a.json");
    assert_exit(&r, 0);
    assert_says(r.output, "microseconds of a processor, timed around ");
    assert_says(r.output, "least mean relative variance after a given time");
    assert_says(r.output, "\n  recommended ");
    assert_says(r.output, "\nnext: caustica render room.xml -i bdpm -D 'power=4, 1, 2' --max-depth 3 --radius 0.5 "
                          "--alpha 0 --rays a.exr\n");
    assert_says(r.output, "\n  or: caustica render room.xml -i bdpm -D 'power=4, 1, 2' --max-depth 3 --radius 0.5 "
                          "--alpha 0 --light-paths ");
    ca_image_layers *image = read_image(state, "a.exr");
    json_t *root = load_json(folder_of(state), "a.json");
    assert_recommendation(root, image, "relative", r.output);
    json_decref(root);
    ca_image_release(image);
    /* One camera path: a number of light paths is all there is to say. */
    RUN(&r, "noise", ROOM, "--light-paths=60", "-ippm:max_depth=3", "--iterations=20", "--crop=2,0,9,8",
        "--objective=worst-decile");
    assert_exit(&r, 0);
    assert_says(r.output, "20 iterations of 60 light paths and 1 camera path per pixel, 56 pixels");
    assert_says(r.output, "least variance in the noisiest tenth of the pixels after");
    assert_null(strstr(r.output, "\n  recommended "));
    assert_says(
        r.output,
        "\nnext: caustica render room.xml -i ppm:max_depth=3 --radius 0.5 --alpha 0 --crop 2,0,9,8 --light-paths ");
    assert_says(r.output, " --camera-paths 1\n");
    /* Of the integrator's own parameters those stay that are not recommended anew: each is said once. */
    RUN(&r, "noise", "room.xml", "-ibdpm:light_paths=60,radius=0.5,camera_paths=3,alpha=0.25", "--iterations=4");
    assert_exit(&r, 0);
    assert_says(r.output, "\nnext: caustica render room.xml -i bdpm:radius=0.5,alpha=0.25 --light-paths ");
    RUN(&r, "noise", ROOM, "-ippm:light_paths=60", "--iterations=4");
    assert_exit(&r, 0);
    assert_says(r.output, "\nnext: caustica render room.xml -i ppm --radius 0.5 --alpha 0 --light-paths ");
}

/* Of another sensor: what to type next names it. */
static void test_sensors(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "two.xml",
               ROOM_TEXT("<sensor type=\"perspective\"/><sensor type=\"perspective\" id=\"the side\">"
                         "<transform name=\"to_world\"><lookat origin=\"0,3,6\" target=\"0,0.5,0\" "
                         "up=\"0,1,0\"/></transform><film type=\"hdrfilm\"><integer name=\"width\" value=\"5\"/>"
                         "<integer name=\"height\" value=\"4\"/></film>"
                         "</sensor>\n",
                         "independent", "1", "40"));
    RUN(&r, "noise", "two.xml", "--radius=0.5", COUNTS(60, 3, 4), "--camera=the side");
    assert_exit(&r, 0);
    assert_says(r.output, "3 camera paths per pixel, 20 pixels");
    assert_says(r.output, "\nnext: caustica render two.xml -i bdpm --camera 'the side' --radius 0.5 ");
    RUN(&r, "noise", "two.xml", "--radius=0.5", COUNTS(60, 3, 4), "--sensor=2");
    assert_exit(&r, 0);
    assert_says(r.output, "3 camera paths per pixel, 96 pixels");
    assert_says(r.output, "\nnext: caustica render two.xml -i bdpm --sensor 2 --radius 0.5 ");
    RUN(&r, "noise", "two.xml", "--sensor=3");
    assert_exit(&r, 2);
    assert_says(r.errors, "there is no sensor 3");
}

/* Nothing but the scene. */
static void test_default_numbers(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", "room.xml", "--resolution=3x2");
    assert_exit(&r, 0);
    assert_says(r.output, "32 iterations of 30000 light paths and 4 camera paths per pixel, 6 pixels");
    assert_says(r.output, "(with -o FILE.exr the recommended map is written, for render's --rays)");
    RUN(&r, "noise", "room.xml", "--resolution=3x2", "-ibdpm:light_paths=50,camera_paths=3", "--iterations=2");
    assert_exit(&r, 0);
    assert_says(r.output, "2 iterations of 50 light paths and 3 camera paths per pixel, 6 pixels");
}

/* ---- Signals --------------------------------------------------------------------------------------------------- */

/* "pass 0 " of a number that is not known: paths are timed. */
static bool is_timing(const char *text) { return strstr(text, "pass 0 ") != NULL; }

/* "pass 2/9" or a later one: not every iteration is drawn. */
static bool has_two_iterations(const char *text)
{
    for (const char *at = text; (at = strstr(at, "pass ")) != NULL; at++) {
        char *end;
        if (strtol(at + 5, &end, 10) >= 2 && *end == '/') return true;
    }
    return false;
}

/* Waits until the program has drawn to its terminal what is waited for; false: it ended before. */
static bool has_drawn(int master, bool (*is_there)(const char *text))
{
    char text[1 << 14] = "";
    size_t length = 0;
    while (!is_there(text)) {
        if (length > sizeof text / 2) { /* what came last may be the beginning of it */
            memmove(text, text + length - 64, 65);
            length = 64;
        }
        const ssize_t got = read(master, text + length, sizeof text - 1 - length);
        if (got <= 0) return false;
        length += (size_t)got;
        text[length] = '\0';
    }
    return true;
}

/* Of a terminal that nobody looks at any more the program must not wait for. */
static void read_to_end(int master)
{
    char text[4096];
    while (read(master, text, sizeof text) > 0) continue;
}

/* What was measured is written, with no recommendation beside it. */
static void assert_signal_ends(void **state, const char *iterations, bool (*wait_for)(const char *text), int number)
{
    ca_program_result r;
    int master, slave;
    if (openpty(&master, &slave, NULL, NULL, &(const struct winsize){.ws_row = 24, .ws_col = 80}) != 0) {
        print_message("SKIPPED: this machine gives out no pseudo-terminal (is /dev/pts mounted?)\n");
        skip();
    }
    const pid_t process =
        ca_program_start(*state,
                         (const char *const[]){"noise", ROOM, "--light-paths=1000", "--camera-paths=4", iterations,
                                               "--resolution=240x160", "--predict=600,5", "-oa.exr", "-oa.png",
                                               "--stats=a.json", NULL},
                         slave);
    close(slave);
    assert_true(has_drawn(master, wait_for));
    kill(process, number);
    read_to_end(master);
    ca_program_finish(*state, process, &r);
    close(master);
    assert_exit(&r, 0);
    assert_says(r.output, "  with 600,5: image r.m.s. ");
    assert_says(r.output,
                "no numbers are recommended: a signal interrupted the timing of paths\nwrote a.exr\nwrote a.png");
    assert_null(strstr(r.output, "next: "));
    ca_image_layers *image = read_image(state, "a.exr");
    named_layer(image, "Noise.Predicted");
    assert_null(ca_layers_find(image, CA_RAY_MAP_LAYER));
    ca_image_release(image);
    json_t *root = load_json(folder_of(state), "a.json");
    assert_true(json_is_true(json_object_get(root, "interrupted")));
    assert_true(json_is_null(json_object_get(root, "times")) &&
                json_is_null(json_object_get(root, "recommendation")));
    assert_true(json_number(root, "iterations") >= 2.0 && json_number(root, "iterations") < 100000.0);
    assert_int_equal(json_array_size(json_object_get(root, "predict")), 1);
    json_decref(root);
}

static void test_signals(void **state)
{
    assert_signal_ends(state, "--iterations=2", is_timing, SIGINT);
    assert_signal_ends(state, "--iterations=100000", has_two_iterations, SIGTERM);
}

/* Of few and short passes some times are lost in the scatter, and some are not. */
static void test_times_that_cannot_be_measured(void **state)
{
    enum { MOST_TRIES = 40 };
    int unknown = 0, all = 0;
    for (int i = 0; i < MOST_TRIES && (unknown == 0 || unknown == all); i++) {
        ca_program_result r;
        char seed[32];
        snprintf(seed, sizeof seed, "--seed=%d", i);
        RUN(&r, "noise", ROOM, COUNTS(20, 2, 3), seed, "--stats=a.json");
        assert_exit(&r, 0);
        json_t *root = load_json(folder_of(state), "a.json");
        unknown += assert_times(json_object_get(root, "times"), r.output);
        all += 4;
        json_decref(root);
    }
    assert_true(unknown > 0 && unknown < all);
}

/* Without light there is nothing to recommend. */
static void test_black_image(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "dark.xml", "<scene version='3.0.0'><sensor type='perspective'/></scene>");
    RUN(&r, "noise", "dark.xml", "--resolution=8x8", COUNTS(20, 2, 3), "--radius=0.5");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "caustica: warning: the scene has no light: there is no noise\n");
    assert_says(r.output, "no numbers are recommended: no light was found\n");
    RUN(&r, "noise", ROOM, COUNTS(20, 2, 3), "-Dpower=0", "-oa.exr", "-oa.png", "--stats=a.json");
    assert_exit(&r, 0);
    assert_says(r.output, "no numbers are recommended: no light was found\nwrote a.exr\n");
    assert_null(strstr(r.output, "-nan"));
    assert_null(strstr(r.output, "next: "));
    ca_image_layers *image = read_image(state, "a.exr");
    assert_null(ca_layers_find(image, CA_RAY_MAP_LAYER));
    ca_image_release(image);
    json_t *root = load_json(folder_of(state), "a.json");
    assert_true(json_is_false(json_object_get(root, "interrupted")) &&
                json_is_null(json_object_get(root, "recommendation")));
    json_decref(root);
}

/* What was allowed to the measurement is not exceeded by timing more light paths than fit, nor by what is
 * recommended. */
static void test_memory_limit(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", ROOM, COUNTS(2000, 2, 4), "--memory=1.5", "-oa.exr", "--stats=a.json");
    assert_exit(&r, 0);
    assert_says(r.output, " --memory 1.5 --rays a.exr\n");
    json_t *root = load_json(folder_of(state), "a.json");
    const json_t *recommendation = json_object_get(root, "recommendation");
    /* About 7,500 fit a MiB beside the film. */
    assert_true(json_number(json_object_get(recommendation, "best"), "light_paths") < 20000.0);
    assert_true(json_number(json_object_get(root, "times"), "light_paths") < 20000.0);
    json_decref(root);
    RUN(&r, "render", ROOM, "-ibdpm", "--alpha=0", "--memory=1.5", "--rays=a.exr", "--spp=2", "-ob.exr");
    assert_exit(&r, 0);
    RUN(&r, "noise", ROOM, COUNTS(2000, 2, 4), "--memory=0.1", "-oc.exr");
    assert_exit(&r, 2);
    assert_says(r.errors, "2000 light paths need about");
    assert_false(exists(folder_of(state), "c.exr"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        ROOM_TEST(test_recommendation),
        ROOM_TEST(test_sensors),
        ROOM_TEST(test_default_numbers),
        ROOM_TEST(test_signals),
        ROOM_TEST(test_times_that_cannot_be_measured),
        ROOM_TEST(test_black_image),
        ROOM_TEST(test_memory_limit),
    };
    return run_program_tests("the program: recommended numbers", tests, sizeof tests / sizeof tests[0]);
}
