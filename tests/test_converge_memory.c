/* `caustica converge` when memory runs out, at any allocation: it says so, leaves no file half written and keeps what
 * is done, and the same command goes on from there. Its sources are the program's, not the library's, so they are
 * compiled into this test. */
#define _GNU_SOURCE
#include "base/memory.h"

#include <glob.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#undef _DEFAULT_SOURCE
#include "cli/compare_page.c"
#define make_folder make_results_folder /* support/ has one of this name too */
#include "cli/converge_pictures.c"
#include "cli/converge_plan.c"
#include "cli/converge_runs.c"
#include "cli/layer_choice.c"
#include "cli/look_ahead.c"
#include "cli/options.c"
#include "cli/outputs.c"
#include "cli/places.c"
#include "cli/progress.c"
#include "cli/report.c"
#include "cli/say.c"
#include "cli/signals.c"
#define put_slopes put_slopes_of_page
#define read_list read_numbers
#include "cli/converge_page.c"
#undef put_slopes
#include "cli/converge_tables.c"
#include "cli/values.c"
#include "cli/json_values.c"
#define NAME_SIZE SETTINGS_NAME_SIZE
#define find find_attribute
#include "cli/settings_json.c"
#undef NAME_SIZE
#undef find
#include "cli/stats_json.c"
#include "cli/command_converge.c"
#undef make_folder
#include "support/sample_folder.h"

static const char scene_text[] =
    "<scene version=\"3.0.0\">\n"
    "  <integrator type=\"path\"><integer name=\"max_depth\" value=\"2\"/></integrator>\n"
    "  <sensor type=\"perspective\">\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"12\"/><integer name=\"height\" "
    "value=\"12\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"sphere\"><point name=\"center\" value=\"0,0,4\"/></shape>\n"
    "  <emitter type=\"constant\"/>\n"
    "</scene>\n";

/* Runs the command in the folder; what it says goes to files there. */
static int converge(char *spp)
{
    char *const words[] = {"scene.xml", "-ipath", spp, "--threads=1", "-rref.exr", "-oout"};
    return ca_command_converge(sizeof words / sizeof words[0], words);
}

static int count_files(const char *pattern)
{
    glob_t found;
    const int result = glob(pattern, 0, NULL, &found) == 0 ? (int)found.gl_pathc : 0;
    globfree(&found);
    return result;
}

static int prepare(void **unused)
{
    if (make_folder(unused) != 0 || chdir(folder) != 0) return -1;
    FILE *file = fopen("scene.xml", "wb");
    if (!file || fputs(scene_text, file) < 0 || fclose(file) != 0) return -1;
    ca_scene *scene = NULL;
    ca_image_layers *image = NULL;
    ca_render_settings settings;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_render_settings_init(&settings);
    ca_status status = ca_scene_load("scene.xml", NULL, 0, &scene, NULL);
    if (status == CA_OK) status = ca_render(scene, &settings, &image, &statistics, NULL);
    if (status == CA_OK) status = ca_layers_write(image, "ref.exr", 0.0f, NULL);
    ca_layers_destroy(image);
    ca_scene_destroy(scene);
    return status == CA_OK ? 0 : -1;
}

static int finish(void **unused)
{
    return chdir("/") == 0 ? remove_folder(unused) : -1;
}

/* The n-th allocation of a run fails, n growing faster and faster; now and then the same command goes on after it.
 * Over once eight runs in a row were complete. */
static void test_each_allocation_fails_once(void **state)
{
    (void)state;
    FILE *kept = fopen("said.txt", "w+b");
    const int output = dup(STDOUT_FILENO), errors = dup(STDERR_FILENO);
    assert_true(kept && output >= 0 && errors >= 0);
    fflush(stdout);
    dup2(fileno(kept), STDOUT_FILENO);
    dup2(fileno(kept), STDERR_FILENO);
    int runs = 0, failed = 0, wrong = 0, unsaid = 0, halves = 0, stuck = 0, exit_status = CA_EXIT_FAILED,
        complete = 0;
    for (long n = 0; complete < 8 && runs < 4000; n += 1 + n / 40, runs++) {
        char said[4096] = "";
        if (system("rm -rf out") != 0 || ftruncate(fileno(kept), 0) != 0) break;
        rewind(kept);
        ca_memory_fail_after(n);
        exit_status = converge("--spp=1,2");
        ca_memory_fail_after(-1);
        fflush(stdout);
        rewind(kept);
        (void)!fread(said, 1, sizeof said - 1, kept);
        complete = exit_status == CA_EXIT_DONE ? complete + 1 : 0;
        if (complete > 0) continue; /* what failed can be done without, or the run has no so many allocations */
        failed++;
        wrong += exit_status != CA_EXIT_FAILED;
        unsaid += !strstr(said, "memory");
        halves += count_files("out/*.*.*") +
                  count_files("out/*/*.*.*"); /* the name while it is written has a second ending */
        if (failed % 16 == 0) stuck += converge("--spp=1,2") != CA_EXIT_DONE || count_files("out/renders/*.exr") != 2;
    }
    fflush(stdout);
    dup2(output, STDOUT_FILENO);
    dup2(errors, STDERR_FILENO);
    close(output);
    close(errors);
    fclose(kept);
    print_message("%d runs failed for lack of memory before one was complete\n", failed);
    assert_int_equal(exit_status, CA_EXIT_DONE);
    assert_true(failed > 50);
    assert_int_equal(wrong, 0);
    assert_int_equal(unsaid, 0);
    assert_int_equal(halves, 0);
    assert_int_equal(stuck, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_each_allocation_fails_once)};
    return cmocka_run_group_tests_name("converge without memory", tests, prepare, finish);
}
