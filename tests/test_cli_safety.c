/* Nothing is lost to a mistake at the command line: outputs that fail alone, outputs that are inputs, the rights and
 * links of files that are replaced. */
#define _GNU_SOURCE
#include "support/program_test.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

/* Runs a line of shell in the test's folder; $P is the program. Gives back the exit status; what was said on standard
 * error goes to `errors`. */
static int run_shell(void **state, const char *line, char *errors, size_t size)
{
    char command[2048], path[256];
    assert_int_equal(setenv("P", ((const ca_program *)*state)->path, 1), 0);
    snprintf(command, sizeof command, "cd '%s' && { %s\n} > said.out 2> said.err", folder_of(state), line);
    const int status = system(command);
    assert_true(WIFEXITED(status));
    snprintf(path, sizeof path, "%s/said.err", folder_of(state));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    errors[fread(errors, 1, size - 1, file)] = '\0';
    fclose(file);
    return WEXITSTATUS(status);
}

static void assert_shell(void **state, int expected, const char *line)
{
    char errors[4096];
    const int status = run_shell(state, line, errors, sizeof errors);
    if (status != expected) fail_msg("exit status %d instead of %d:\n%s\n%s", status, expected, line, errors);
}

static void assert_image(void **state, const char *name, uint32_t width, uint32_t height)
{
    ca_image_layers *image = read_image(state, name);
    assert_true(image->width == width && image->height == height);
    ca_layers_destroy(image);
}

/* ---- One output fails ------------------------------------------------------------------------------------------ */

/* Files of more than 16 KiB stand for those that a full disk does not take: a .pfm of 48 KiB fails, compressed ones
 * of an even picture go on. ThreadSanitizer's runtime keeps its shadow memory in files and does not start under such
 * a limit. */
#define ON_A_FULL_DISK "ulimit -f 32; "

static void skip_without_limits(void **state)
{
    char errors[4096];
    if (run_shell(state, ON_A_FULL_DISK "$P --version", errors, sizeof errors) != 0) skip();
}

/* Nothing but light of radiance 1: all pixels are the same. */
static const char even_scene[] =
    "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"max_depth\" value=\"3\"/></integrator>\n"
    "  <sensor type=\"perspective\"><film type=\"hdrfilm\"><rfilter type=\"box\"/>\n"
    "    <integer name=\"width\" value=\"64\"/><integer name=\"height\" value=\"64\"/></film></sensor>\n"
    "  <emitter type=\"constant\"/></scene>\n";

static void test_others_are_written_when_one_fails(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    write_text(folder_of(state), "even.xml", even_scene);
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P render even.xml -o a.pfm -o b.pfm -o c.exr -o d.png --stats e.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: a.pfm: cannot write");
    assert_says(errors, "caustica: b.pfm: cannot write");
    assert_false(exists(folder_of(state), "a.pfm") || exists(folder_of(state), "b.pfm"));
    assert_image(state, "c.exr", 64, 64);
    assert_image(state, "d.png", 64, 64);
    json_t *stats = load_json(folder_of(state), "e.json");
    assert_true(json_number(stats, "iterations") == 4.0);
    json_decref(stats);
}

static void test_images_are_written_when_statistics_fail(void **state)
{
    char errors[4096];
    assert_shell(state, 0, "mkdir gone");
    const char *const words[] = {"render",      "ball.xml", "-o",      "a.exr", "--stats",
                                 "gone/a.json", "--time=3", "--serve", NULL};
    ca_program_result r;
    const pid_t process = ca_program_start(*state, words, -1);
    /* The address is told once all places are checked. */
    assert_int_equal(run_shell(state,
                               "for i in $(seq 600); do grep -q 'live view' .stdout && break; sleep 0.05; done; "
                               "rmdir gone",
                               errors, sizeof errors),
                     0);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 1);
    assert_says(r.errors, "caustica: gone/a.json: cannot write");
    assert_image(state, "a.exr", 24, 16);
}

static void test_image_is_written_when_strategies_fail(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P render ball.xml --resolution 96x64 -o a.png --stats a.json "
                                              "--dump-strategies full",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: full/");
    assert_says(errors, "cannot write");
    assert_image(state, "a.png", 96, 64);
    assert_true(exists(folder_of(state), "a.json"));
}

static void test_image_is_written_when_a_part_fails(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_shell(state, 0, "$P render ball.xml --resolution 96x64 -i qmcppm --blocks 0:1 -o whole.part");
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P render ball.xml --resolution 96x64 -i qmcppm --blocks 0:1 "
                                              "-o a.part -o a.png -o a.pfm --stats a.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: a.part: cannot write");
    assert_says(errors, "caustica: a.pfm: cannot write");
    assert_image(state, "a.png", 96, 64);
    assert_true(exists(folder_of(state), "a.json"));
    assert_int_equal(run_shell(state, ON_A_FULL_DISK "$P merge whole.part -o b.part -o b.pfm -o b.png --stats b.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: b.part: cannot write");
    assert_says(errors, "caustica: b.pfm: cannot write");
    assert_shell(state, 0, "cmp a.png b.png && test -e b.json && test ! -e b.part");
}

static void test_noise_writes_the_others(void **state)
{
    char errors[4096];
    skip_without_limits(state);
    assert_int_equal(run_shell(state,
                               ON_A_FULL_DISK "$P noise ball.xml --resolution 48x32 --iterations 2 "
                                              "--light-paths 100 -o a.exr -o a.png --stats a.json",
                               errors, sizeof errors),
                     1);
    assert_says(errors, "caustica: a.exr: cannot write");
    assert_image(state, "a.png", 48, 32);
    assert_true(exists(folder_of(state), "a.json"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_others_are_written_when_one_fails),
        PROGRAM_TEST(test_images_are_written_when_statistics_fail),
        PROGRAM_TEST(test_image_is_written_when_strategies_fail),
        PROGRAM_TEST(test_image_is_written_when_a_part_fails),
        PROGRAM_TEST(test_noise_writes_the_others),
    };
    return run_program_tests("cli_safety", tests, sizeof tests / sizeof tests[0]);
}
