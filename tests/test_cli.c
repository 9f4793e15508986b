/* The program from outside: exit statuses, messages, files, signals, the progress line. */
#define _GNU_SOURCE
#include "support/run_program.h"

#include <fcntl.h>
#include <math.h>
#include <pty.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>

/* A sphere of a given albedo in light of radiance 1 from everywhere. */
static const char scene_text[] =
    "<scene version=\"3.0.0\">\n"
    "  <default name=\"albedo\" value=\"0.5\"/>\n"
    "  <integrator type=\"path\"><integer name=\"max_depth\" value=\"4\"/></integrator>\n"
    "  <sensor type=\"perspective\">\n"
    "    <float name=\"fov\" value=\"20\"/>\n"
    "    <transform name=\"to_world\"><lookat origin=\"0,0,9\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\n"
    "    <sampler type=\"independent\"><integer name=\"sample_count\" value=\"4\"/></sampler>\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"24\"/><integer name=\"height\" value=\"16\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"sphere\"><float name=\"radius\" value=\"3\"/>\n"
    "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"$albedo\"/></bsdf></shape>\n"
    "  <emitter type=\"constant\"><rgb name=\"radiance\" value=\"1\"/></emitter>\n"
    "</scene>\n";

#define RUN(result, ...) ca_program_run(folder_of(state), (const char *const[]){__VA_ARGS__, NULL}, result)

static char *folder_of(void **state) { return *state; }

static void write_text(const char *folder, const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    assert_int_equal(fclose(file), 0);
}

static bool exists(const char *folder, const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, F_OK) == 0;
}

static int set_up(void **state)
{
    if (!ca_program_path()) {
        print_message("SKIPPED: no program caustica: set CAUSTICA_PROGRAM or build the target caustica\n");
        skip();
    }
    *state = ca_program_folder_create();
    write_text(*state, "ball.xml", scene_text);
    return 0;
}

static int tear_down(void **state)
{
    if (*state) ca_program_folder_remove(*state);
    return 0;
}

static void assert_says(const char *text, const char *words)
{
    if (!strstr(text, words)) fail_msg("\"%s\" is not said in:\n%s", words, text);
}

static void assert_exit(const ca_program_result *result, int expected)
{
    if (result->exit_status != expected)
        fail_msg("exit status %d (signal %d) instead of %d:\n%s%s", result->exit_status, result->signal, expected,
                 result->output, result->errors);
}

static json_t *load_json(const char *folder, const char *name)
{
    char path[256];
    json_error_t error;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    json_t *root = json_load_file(path, 0, &error);
    if (!root) fail_msg("%s: %s", name, error.text);
    return root;
}

static double json_number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    if (!json_is_number(value)) fail_msg("no number \"%s\"", key);
    return json_number_value(value);
}

/* ---- Words ------------------------------------------------------------------------------------------------------ */

static void test_help_and_version(void **state)
{
    ca_program_result r;
    RUN(&r, "--version");
    assert_exit(&r, 0);
    assert_true(strncmp(r.output, "caustica ", 9) == 0);
    RUN(&r, "--help");
    assert_exit(&r, 0);
    assert_says(r.output, "Example");
    static const char *const commands[] = {"render", "compare", "info"};
    for (int i = 0; i < 3; i++) {
        assert_says(r.output, commands[i]);
        ca_program_result own;
        RUN(&own, commands[i], "--help");
        assert_exit(&own, 0);
        assert_says(own.output, "Example");
        assert_string_equal(own.errors, "");
    }
}

typedef struct usage_case {
    const char *words[6];
    const char *says;
} usage_case;

static const usage_case usage_cases[] = {
    {{NULL}, "a command is missing"},
    {{"rendr"}, "did you mean \"render\"?"},
    {{"paint"}, "command \"paint\" is not known"},
    {{"render"}, "a scene file is missing"},
    {{"render", "ball.xml", "ball.xml"}, "more than one scene"},
    {{"render", "ball.xml", "--ssp", "4"}, "did you mean --spp?"},
    {{"render", "ball.xml", "--resol", "4"}, "did you mean --resolution?"},
    {{"render", "ball.xml", "-x"}, "option -x is not known"},
    {{"render", "ball.xml", "--spp"}, "--spp needs a value: N"},
    {{"render", "ball.xml", "--spp", "--quiet"}, "--spp needs a value: N"},
    {{"render", "ball.xml", "--spp", "0"}, "--spp: \"0\""},
    {{"render", "ball.xml", "--spp", "4x"}, "--spp: \"4x\""},
    {{"render", "ball.xml", "--spp", "4294967296"}, "--spp: \"4294967296\""},
    {{"render", "ball.xml", "--spp=4", "--spp=5"}, "--spp is given twice"},
    {{"render", "ball.xml", "--spp=4", "--time=5"}, "only one of --spp, --time and --noise"},
    {{"render", "ball.xml", "--time", "-1"}, "--time: \"-1\""},
    {{"render", "ball.xml", "--time", "inf"}, "--time: \"inf\""},
    {{"render", "ball.xml", "--noise", "0"}, "--noise: \"0\""},
    {{"render", "ball.xml", "--seed", "-1"}, "--seed: \"-1\""},
    {{"render", "ball.xml", "--max-depth", "-2"}, "--max-depth: \"-2\""},
    {{"render", "ball.xml", "--resolution", "10"}, "--resolution: \"10\""},
    {{"render", "ball.xml", "--resolution", "10x0"}, "--resolution: \"10x0\""},
    {{"render", "ball.xml", "--crop", "1,2,3"}, "--crop: \"1,2,3\""},
    {{"render", "ball.xml", "--crop", "4,0,4,8"}, "--crop: \"4,0,4,8\""},
    {{"render", "ball.xml", "--crop", "0,0,99,8"}, "99"},
    {{"render", "ball.xml", "--exposure", "bright"}, "--exposure: \"bright\""},
    {{"render", "ball.xml", "--quiet=1"}, "--quiet takes no value"},
    {{"render", "ball.xml", "-D", "albedo"}, "\"albedo\" is not NAME=VALUE"},
    {{"render", "ball.xml", "-o", "ball.jpeg"}, ".exr"},
    {{"render", "ball.xml", "-i", "pathh"}, "did you mean \"path\"?"},
    {{"render", "ball.xml", "--sampler", "halton"}, "sobol"},
    /* What later versions may know must not be a silent no-op today. */
    {{"render", "ball.xml", "--rays", "auto"}, "option --rays is not known"},
    {{"render", "ball.xml", "--serve"}, "option --serve is not known"},
    {{"render", "ball.xml", "--radius", "1"}, "option --radius is not known"},
    {{"render", "ball.xml", "--dump-strategies", "x"}, "option --dump-strategies is not known"},
    {{"compare", "a.exr"}, "--reference is missing"},
    {{"compare", "--reference", "a.exr"}, "an image to compare is missing"},
    {{"compare", "a.exr", "--reference", "a.exr", "--block=0"}, "--block: \"0\""},
    {{"info"}, "a scene file is missing"},
    {{"info", "ball.xml", "--spp", "1"}, "option --spp is not known"},
};

static void test_wrong_usage(void **state)
{
    for (size_t i = 0; i < sizeof usage_cases / sizeof usage_cases[0]; i++) {
        ca_program_result r;
        ca_program_run(*state, usage_cases[i].words, &r);
        assert_exit(&r, 2);
        assert_says(r.errors, usage_cases[i].says);
        assert_says(r.errors, "--help");
        assert_string_equal(r.output, "");
        assert_false(exists(*state, "ball.exr"));
    }
}

/* ---- Failures --------------------------------------------------------------------------------------------------- */

static void test_failures_of_the_world(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "nowhere.xml");
    assert_exit(&r, 1);
    assert_says(r.errors, "nowhere.xml");
    assert_false(exists(*state, "nowhere.exr"));

    /* Found before the scene is looked at, let alone rendered. */
    RUN(&r, "render", "nowhere.xml", "-o", "no/such/folder.exr");
    assert_exit(&r, 1);
    assert_says(r.errors, "no/such/folder.exr");
    RUN(&r, "render", "nowhere.xml", "-o", "a.exr", "--stats", "no/such/folder.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "no/such/folder.json");
    assert_false(exists(*state, "a.exr"));

    write_text(*state, "odd.xml", "<scene version=\"3.0.0\">\n  <shape type=\"sphear\"/>\n</scene>\n");
    RUN(&r, "info", "odd.xml");
    assert_exit(&r, 1);
    assert_says(r.errors, "odd.xml:2:");
    assert_says(r.errors, "sphere");
    RUN(&r, "compare", "ball.xml", "--reference", "ball.xml");
    assert_exit(&r, 1);
    assert_says(r.errors, "ball.xml");
}

static void test_full_disk_of_standard_output(void **state)
{
    (void)state;
    char command[1024];
    snprintf(command, sizeof command, "'%s' --help > /dev/full 2> /dev/null", ca_program_path());
    const int status = system(command);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 1);
}

/* ---- Rendering -------------------------------------------------------------------------------------------------- */

static void test_default_outputs(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml");
    assert_exit(&r, 0);
    assert_true(exists(*state, "ball.exr") && exists(*state, "ball.png"));
    assert_says(r.output, "24 x 16 pixels, 4 samples per pixel");
    assert_says(r.output, "wrote ball.exr\nwrote ball.png\n");
    assert_string_equal(r.errors, ""); /* no progress line without a terminal */
}

static void test_statistics_and_quiet(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "-oa.exr", "--spp", "8", "-D", "albedo=0.25", "--stats", "a.json",
        "--quiet");
    assert_exit(&r, 0);
    assert_string_equal(r.output, "");
    assert_string_equal(r.errors, "");
    assert_true(exists(*state, "a.pfm") && exists(*state, "a.exr"));
    json_t *stats = load_json(*state, "a.json");
    static const char *const keys[] = {"seconds",        "rays",   "shadow_rays",       "photons",
                                       "photons_tested", "merges", "peak_memory_bytes", "mean_standard_deviation",
                                       "light_paths"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) json_number(stats, keys[i]);
    assert_int_equal((int)json_number(stats, "iterations"), 8);
    assert_int_equal((int)json_number(stats, "camera_paths"), 8 * 24 * 16);
    assert_int_equal((int)json_number(stats, "non_finite"), 0);
    const double luminance = json_number(stats, "mean_luminance");
    assert_true(luminance > 0.24 && luminance < 0.4); /* the ball nearly fills the picture */
    json_decref(stats);
}

static void test_file_of_crop_and_resolution(void **state)
{
    ca_program_result r;
    char header[16] = "";
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--resolution", "48x32", "--crop", "10,4,31,9", "--seed=7",
        "--sampler=sobol", "--threads=2", "--max-depth", "-1", "--memory", "100", "-i", "path:rr_depth=3");
    assert_exit(&r, 0);
    char path[256];
    snprintf(path, sizeof path, "%s/a.pfm", (char *)*state);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fread(header, 1, 8, file), 8);
    fclose(file);
    assert_string_equal(header, "PF\n21 5\n");
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--resolution", "4000x4000", "--memory", "1");
    assert_true(r.exit_status != 0);
}

static void test_ends_by_noise_and_time(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--noise", "5", "--stats", "a.json");
    assert_exit(&r, 0);
    json_t *stats = load_json(*state, "a.json");
    assert_true(json_number(stats, "noise_percent") < 5.0);
    json_decref(stats);
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--time", "0.2", "--stats", "a.json");
    assert_exit(&r, 0);
    stats = load_json(*state, "a.json");
    assert_true(json_number(stats, "seconds") >= 0.2);
    assert_true(json_number(stats, "seconds") < 20.0);
    json_decref(stats);
}

/* ---- Comparing and looking -------------------------------------------------------------------------------------- */

static void test_compare(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--spp=32", "--seed=1", "--quiet", "--resolution=48x32");
    assert_exit(&r, 0);
    RUN(&r, "render", "ball.xml", "-o", "b.exr", "--spp=32", "--seed=2", "--quiet", "--resolution=48x32");
    assert_exit(&r, 0);
    RUN(&r, "render", "ball.xml", "-o", "c.exr", "--spp=32", "--seed=3", "--quiet", "--resolution=48x32", "-D",
        "albedo=0.6");
    assert_exit(&r, 0);
    RUN(&r, "compare", "a.exr", "b.exr", "c.exr", "--reference", "a.exr", "--stats", "a.json", "--mask", "0,0,4,4",
        "--mask=40,0,48,4");
    assert_exit(&r, 0);
    assert_says(r.output, "blocks that differ  0 of 6");
    assert_says(r.output, "would detect");
    json_t *root = load_json(*state, "a.json");
    const json_t *images = json_object_get(root, "images");
    assert_int_equal(json_array_size(images), 3);
    const json_t *a = json_array_get(images, 0), *b = json_array_get(images, 1), *c = json_array_get(images, 2);
    assert_true(json_number(a, "rmse") == 0.0);
    assert_true(json_number(b, "rmse") > 0.0 && json_number(b, "rmse") < json_number(c, "rmse"));
    assert_true(json_number(c, "relmse") > 0.0);
    assert_int_equal((int)json_number(b, "masked"), 16 + 32);
    assert_true(json_number(json_object_get(c, "block_test"), "rejected") > 0.0);
    json_decref(root);
}

static void test_compare_sizes(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "small.exr", "-o", "small.pfm", "--quiet", "--spp=16");
    assert_exit(&r, 0);
    RUN(&r, "render", "ball.xml", "-o", "large.exr", "--quiet", "--resolution=72x48", "--spp=16");
    assert_exit(&r, 0);
    RUN(&r, "compare", "small.exr", "--reference", "large.exr");
    assert_exit(&r, 1);
    assert_says(r.errors, "small.exr: the image has 24 x 16 pixels, the reference 72 x 48");
    RUN(&r, "compare", "large.exr", "--reference", "small.exr", "--resample-reference");
    assert_exit(&r, 1);
    assert_says(r.errors, "no multiple");
    RUN(&r, "compare", "small.exr", "--reference", "large.exr", "--resample-reference", "--roi=8,0,24,16");
    assert_exit(&r, 0);
    assert_says(r.output, "median of 1 blocks");
    /* A PFM tells no variance. */
    RUN(&r, "compare", "small.exr", "--reference", "small.pfm");
    assert_exit(&r, 0);
    assert_says(r.output, "taken as exact");
    RUN(&r, "compare", "small.pfm", "--reference", "small.exr");
    assert_exit(&r, 0);
    assert_says(r.output, "not done");
}

static void test_info(void **state)
{
    ca_program_result r;
    RUN(&r, "info", "ball.xml");
    assert_exit(&r, 0);
    static const char *const lines[] = {"1 sphere", "1 constant", "1 diffuse", "24 x 16", "perspective",
                                        "path, max_depth = 4", "independent, 4 samples", "(-3, -3, -3) to (3, 3, 3)"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) assert_says(r.output, lines[i]);
}

static void test_bundled_scenes(void **state)
{
    static const char *const names[] = {"cornell-box", "furnace", "caustics", "mis", "textured"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char path[512];
        ca_program_result r;
        snprintf(path, sizeof path, "%s/scenes/%s/%s.xml", CA_SOURCE_DIR, names[i], names[i]);
        RUN(&r, "info", path);
        assert_exit(&r, 0);
        RUN(&r, "render", path, "--resolution", "24x16", "--spp", "2", "-o", "a.pfm", "--stats", "a.json");
        assert_exit(&r, 0);
        assert_string_equal(r.errors, "");
        json_t *stats = load_json(*state, "a.json");
        assert_true(json_number(stats, "mean_luminance") > 0.01);
        json_decref(stats);
    }
}

/* ---- Terminal and signals --------------------------------------------------------------------------------------- */

static void wait_milliseconds(long milliseconds)
{
    nanosleep(&(struct timespec){.tv_sec = milliseconds / 1000, .tv_nsec = milliseconds % 1000 * 1000000}, NULL);
}

static void test_signal_ends_with_an_image(void **state)
{
    ca_program_result r;
    const pid_t process = ca_program_start(
        *state, (const char *const[]){"render", "ball.xml", "-o", "a.pfm", "--time", "120", "--stats=a.json", NULL}, -1);
    wait_milliseconds(1000);
    kill(process, SIGINT);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
    assert_says(r.errors, "finishing this pass");
    assert_says(r.output, "ended early by a signal");
    assert_true(exists(*state, "a.pfm"));
    json_t *stats = load_json(*state, "a.json");
    assert_true(json_is_true(json_object_get(stats, "interrupted")));
    assert_true(json_number(stats, "seconds") < 60.0);
    json_decref(stats);
}

static void test_second_signal_kills(void **state)
{
    ca_program_result r;
    /* One pass of this takes longer than the pause between the signals. */
    const pid_t process = ca_program_start(
        *state,
        (const char *const[]){"render", "ball.xml", "-o", "a.pfm", "--resolution=6000x6000", "--threads=1", NULL}, -1);
    wait_milliseconds(1000);
    kill(process, SIGINT);
    wait_milliseconds(50);
    kill(process, SIGTERM);
    ca_program_finish(*state, process, &r);
    assert_int_equal(r.signal, SIGTERM);
    assert_false(exists(*state, "a.pfm"));
}

/* Everything the program writes to a terminal of this width. */
static size_t read_terminal(const char *folder, unsigned short columns, char *text, size_t size)
{
    int master, slave;
    const struct winsize window = {.ws_row = 24, .ws_col = columns};
    assert_int_equal(openpty(&master, &slave, NULL, NULL, &window), 0);
    const pid_t process = ca_program_start(
        folder, (const char *const[]){"render", "ball.xml", "-o", "a.pfm", "--time", "1", NULL}, slave);
    close(slave);
    size_t length = 0;
    for (ssize_t got; length + 1 < size && (got = read(master, text + length, size - 1 - length)) > 0;)
        length += (size_t)got;
    text[length] = '\0';
    close(master);
    ca_program_result r;
    ca_program_finish(folder, process, &r);
    assert_exit(&r, 0);
    return length;
}

static void test_progress_line(void **state)
{
    static char text[1 << 16];
    static const unsigned short widths[] = {100, 40, 12, 3};
    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        const size_t length = read_terminal(*state, widths[i], text, sizeof text);
        assert_true(length > 0);
        assert_null(strchr(text, '\n'));
        size_t longest = 0;
        for (char *line = text; *line;) {
            line += strspn(line, "\r");
            const size_t shown = strcspn(line, "\r\033");
            longest = shown > longest ? shown : longest;
            line += shown;
            line += strcspn(line, "\r");
        }
        if (longest >= widths[i]) fail_msg("%zu columns on a terminal of %u", longest, widths[i]);
        if (widths[i] >= 40) {
            assert_true(longest > 20);
            assert_says(text, "left");
            assert_says(text, "pass");
        }
        if (widths[i] == 100) {
            assert_says(text, "[");
            assert_says(text, "noise");
        }
        /* Gone at the end. */
        assert_true(length >= 4 && strcmp(text + length - 4, "\r\033[K") == 0);
    }
}

#define CLI_TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        CLI_TEST(test_help_and_version),
        CLI_TEST(test_wrong_usage),
        CLI_TEST(test_failures_of_the_world),
        CLI_TEST(test_full_disk_of_standard_output),
        CLI_TEST(test_default_outputs),
        CLI_TEST(test_statistics_and_quiet),
        CLI_TEST(test_file_of_crop_and_resolution),
        CLI_TEST(test_ends_by_noise_and_time),
        CLI_TEST(test_compare),
        CLI_TEST(test_compare_sizes),
        CLI_TEST(test_info),
        CLI_TEST(test_bundled_scenes),
        CLI_TEST(test_signal_ends_with_an_image),
        CLI_TEST(test_second_signal_kills),
        CLI_TEST(test_progress_line),
    };
    return cmocka_run_group_tests_name("command line", tests, NULL, NULL);
}
