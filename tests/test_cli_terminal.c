/* The program on a terminal: the progress line, and what signals do. */
#define _GNU_SOURCE
#include "base/clock.h"
#include "support/program_test.h"

#include <fcntl.h>
#include <math.h>
#include <pty.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <time.h>

/* A terminal of that width: what is written to the slave can be read from the result. Where the machine has none to
 * give (a bare chroot without /dev/pts), the test is skipped, and says so. */
static int open_terminal(unsigned short columns, int *slave)
{
    int master;
    const struct winsize window = {.ws_row = 24, .ws_col = columns};
    if (openpty(&master, slave, NULL, NULL, &window) != 0) {
        print_message("SKIPPED: this machine gives out no pseudo-terminal (is /dev/pts mounted?)\n");
        skip();
    }
    return master;
}

/* Reads until `words` have come, or to the end where they are NULL; gives back how much was read. */
static size_t read_until(int master, const char *words, char *text, size_t size)
{
    size_t length = 0;
    text[0] = '\0';
    while (length + 1 < size && !(words && strstr(text, words))) {
        const ssize_t got = read(master, text + length, size - 1 - length);
        if (got <= 0) break;
        length += (size_t)got;
        text[length] = '\0';
    }
    if (words) assert_says(text, words);
    return length;
}

/* Starts the program with its errors on a terminal, which is the caller's to close. */
static pid_t start_on_terminal(void **state, unsigned short columns, const char *const words[], int *master)
{
    int slave;
    *master = open_terminal(columns, &slave);
    const pid_t process = ca_program_start(*state, words, slave);
    close(slave);
    return process;
}

/* Starts a render that goes on for minutes, and waits until it is on its way. */
static pid_t start_long_render(void **state, int *master)
{
    static const char *const words[] = {"render",     "ball.xml", "-o", "a.pfm", "--time=300", "--resolution=900x600",
                                        "--stats=a.json", NULL};
    char text[4096];
    const pid_t process = start_on_terminal(state, 80, words, master);
    read_until(*master, "pass", text, sizeof text);
    return process;
}

static void test_signal_ends_with_an_image(void **state)
{
    ca_program_result r;
    char text[4096];
    int master;
    const pid_t process = start_long_render(state, &master);
    kill(process, SIGINT);
    read_until(master, "finishing this pass", text, sizeof text);
    read_until(master, NULL, text, sizeof text);
    ca_program_finish(*state, process, &r);
    close(master);
    assert_exit(&r, 0);
    assert_says(r.output, "ended early by a signal");
    assert_true(exists(folder_of(state), "a.pfm"));
    json_t *stats = load_json(folder_of(state), "a.json");
    assert_true(json_is_true(json_object_get(stats, "interrupted")));
    assert_true(json_number(stats, "seconds") < 120.0);
    json_decref(stats);
}

/* Ctrl-C on `render ... 2>&1 | tee log` ends the reader first: the picture is written all the same. */
static void test_signal_without_a_reader(void **state)
{
    static const char *const words[] = {"render", "ball.xml",            "-o",     "a.pfm", "--time=300",
                                        "--checkpoint=c.part", "--checkpoint-every=0.01", NULL};
    ca_program_result r;
    int ends[2];
    signal(SIGPIPE, SIG_DFL); /* what the program inherits */
    assert_int_equal(pipe2(ends, O_CLOEXEC), 0);
    const pid_t process = ca_program_start(*state, words, ends[1]);
    ca_program_wait_for(*state, "c.part");
    close(ends[0]);
    close(ends[1]);
    kill(process, SIGINT);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
    assert_says(r.output, "ended early by a signal");
    assert_true(exists(folder_of(state), "a.pfm"));
}

/* What was printed for nobody is a failure, not the end by a signal. */
static void test_output_without_a_reader(void **state)
{
    char line[256];
    signal(SIGPIPE, SIG_DFL);
    setenv("P", ((const ca_program *)*state)->path, 1);
    snprintf(line, sizeof line, "cd '%s' && { sleep 0.3; $P help 2>said; echo $? >status; } | true",
             folder_of(state));
    assert_int_equal(system(line), 0);
    snprintf(line, sizeof line,
             "cd '%s' && grep -qx 1 status && grep -qx 'caustica: standard output cannot be written' said",
             folder_of(state));
    assert_int_equal(system(line), 0);
}

/* Of a render by blocks, what is done is kept in a part file: as many blocks as it says. */
static void test_signal_ends_with_a_part(void **state)
{
    ca_program_result r;
    char text[4096];
    int master;
    static const char *const words[] = {"render",   "ball.xml", "-iqmcppm:max_depth=3", "--blocks=0:1000000",
                                        "-oa.part", "-oa.pfm",  "--stats=a.json",       NULL};
    const pid_t process = start_on_terminal(state, 80, words, &master);
    read_until(master, "block 1", text, sizeof text);
    kill(process, SIGINT);
    read_until(master, NULL, text, sizeof text);
    ca_program_finish(*state, process, &r);
    close(master);
    assert_exit(&r, 0);
    assert_says(r.output, "ended early by a signal");
    json_t *stats = load_json(folder_of(state), "a.json");
    const json_int_t done = json_integer_value(json_array_get(json_object_get(stats, "blocks"), 1));
    assert_true(done >= 1 && done < 1000000 && (double)done == json_number(stats, "iterations"));
    json_decref(stats);
    RUN(&r, "merge", "a.part", "-o", "b.pfm");
    assert_exit(&r, 0);
    snprintf(text, sizeof text, "1 part, blocks 0:%lld,", (long long)done);
    assert_says(r.output, text);
    snprintf(text, sizeof text, "cd '%s' && cmp a.pfm b.pfm", folder_of(state));
    assert_int_equal(system(text), 0);
}

static void test_second_signal_kills(void **state)
{
    ca_program_result r;
    char text[4096];
    int master;
    const pid_t process = start_long_render(state, &master);
    kill(process, SIGINT);
    read_until(master, "finishing this pass", text, sizeof text);
    kill(process, SIGTERM);
    ca_program_finish(*state, process, &r);
    close(master);
    assert_int_equal(r.signal, SIGTERM);
    assert_string_equal(r.output, "");
}

/* A pass that takes minutes is given up soon; the picture is of the passes before it, and here there are none. */
static void test_term_in_a_long_pass(void **state)
{
    static const char *const words[] = {"render", "ball.xml", "-i", "vcm:radius=2,light_paths=300000",
                                        "-o", "a.pfm", "--resolution=600x400", "--spp=3", NULL};
    ca_program_result r;
    char text[4096];
    int master;
    const pid_t process = start_on_terminal(state, 80, words, &master);
    const struct timespec pause = {.tv_sec = 1};
    nanosleep(&pause, NULL);
    const double start = ca_clock_seconds();
    kill(process, SIGTERM);
    read_until(master, NULL, text, sizeof text);
    ca_program_finish(*state, process, &r);
    const double seconds = ca_clock_seconds() - start;
    close(master);
    assert_exit(&r, 1);
    assert_says(text, "ended before the first pass was complete: there is no image");
    assert_false(exists(folder_of(state), "a.pfm"));
    if (seconds > 4.0) fail_msg("it took %g s", seconds);
}

/* The system may send these again, and means nothing more by it (a shell that ends tells its jobs, too; SIGXCPU comes
 * every second), and a batch system SIGTERM behind them: it does not end the render without an image. */
static void test_system_signals_end_with_an_image(void **state)
{
    static const int numbers[] = {SIGHUP, SIGXCPU, SIGUSR2};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        ca_program_result r;
        char text[4096];
        int master;
        const pid_t process = start_long_render(state, &master);
        kill(process, numbers[i]);
        read_until(master, "finishing this pass", text, sizeof text);
        kill(process, numbers[i]);
        kill(process, SIGTERM);
        read_until(master, NULL, text, sizeof text);
        ca_program_finish(*state, process, &r);
        close(master);
        assert_exit(&r, 0);
        assert_says(r.output, "ended early by a signal");
        snprintf(text, sizeof text, "cd '%s' && rm a.pfm a.json", folder_of(state));
        assert_int_equal(system(text), 0);
    }
}

static uint64_t passes_saved(void **state)
{
    json_t *stats = load_json(folder_of(state), "a.json");
    assert_false(json_is_true(json_object_get(stats, "interrupted")));
    const uint64_t passes = (uint64_t)json_number(stats, "iterations");
    json_decref(stats);
    return passes;
}

/* Each SIGUSR1 has the picture so far written, once. */
static void test_signal_saves(void **state)
{
    ca_program_result r;
    char text[16384], path[256];
    int master;
    const pid_t process = start_long_render(state, &master);
    snprintf(path, sizeof path, "%s/a.pfm", folder_of(state));
    assert_false(exists(folder_of(state), "a.pfm"));
    kill(process, SIGUSR1);
    read_until(master, "caustica: saved a.pfm, a.json with ", text, sizeof text);
    ca_image_layers *image = read_image(state, "a.pfm");
    assert_true(image->width == 900 && image->height == 600);
    ca_layers_destroy(image);
    const uint64_t first = passes_saved(state);
    assert_int_equal(unlink(path), 0);
    for (int drawn = 0; drawn < 4; drawn++) read_until(master, "pass ", text, sizeof text);
    assert_false(exists(folder_of(state), "a.pfm"));
    kill(process, SIGUSR1);
    read_until(master, "caustica: saved a.pfm, a.json with ", text, sizeof text);
    assert_true(exists(folder_of(state), "a.pfm"));
    assert_true(passes_saved(state) > first);
    kill(process, SIGTERM);
    read_until(master, NULL, text, sizeof text);
    ca_program_finish(*state, process, &r);
    close(master);
    assert_exit(&r, 0);
}

/* A range of passes that begins later has no picture: that is said, each time, also where little is printed. */
static void test_signal_without_a_picture(void **state)
{
    static const char *const words[][9] = {
        {"render", "ball.xml", "-o", "a.part", "--passes=4:1000000", "--time=300", "--checkpoint=c.part",
         "--checkpoint-every=0.01", NULL},
        {"render", "ball.xml", "-oa.part", "-iqmcppm", "--blocks=1:1000000", "--quiet", "--checkpoint=d.part",
         "--checkpoint-every=0.01", NULL},
    };
    static const char *const checkpoints[] = {"c.part", "d.part"}, *const kinds[] = {"passes", "blocks"};
    for (int i = 0; i < 2; i++) {
        ca_program_result r;
        char text[16384], says[128];
        int master;
        snprintf(says, sizeof says, "warning: SIGUSR1 has nothing to write: an image needs all %s from 0", kinds[i]);
        const pid_t process = start_on_terminal(state, 200, words[i], &master);
        ca_program_wait_for(*state, checkpoints[i]);
        for (int sent = 0; sent < 2; sent++) {
            kill(process, SIGUSR1);
            read_until(master, says, text, sizeof text);
        }
        kill(process, SIGTERM);
        read_until(master, NULL, text, sizeof text);
        ca_program_finish(*state, process, &r);
        close(master);
        assert_exit(&r, 0);
        assert_true(exists(folder_of(state), "a.part"));
    }
}

/* Everything the program writes to a terminal of this width. */
static size_t read_terminal(void **state, unsigned short columns, const char *end, const char *value, char *text,
                            size_t size)
{
    int master;
    const char *const words[] = {"render", "ball.xml", "-o", "a.pfm", "--threads=1", end, value, NULL};
    const pid_t process = start_on_terminal(state, columns, words, &master);
    const size_t length = read_until(master, NULL, text, size);
    close(master);
    ca_program_result r;
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
    return length;
}

/* The longest of the lines that are drawn over each other. */
static size_t longest_line(const char *text)
{
    size_t longest = 0;
    for (const char *line = text; *line;) {
        line += strspn(line, "\r");
        const size_t shown = strcspn(line, "\r\033");
        longest = shown > longest ? shown : longest;
        line += shown;
        line += strcspn(line, "\r");
    }
    return longest;
}

static void test_progress_line(void **state)
{
    static char text[1 << 16];
    static const unsigned short widths[] = {100, 40, 12, 3};
    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        const size_t length = read_terminal(state, widths[i], "--time", "1", text, sizeof text);
        assert_true(length > 0);
        assert_null(strchr(text, '\n'));
        const size_t longest = longest_line(text);
        if (longest >= widths[i]) fail_msg("%zu columns on a terminal of %u", longest, widths[i]);
        if (widths[i] >= 40) {
            assert_true(longest > 20);
            assert_says(text, "left");
            assert_says(text, "pass");
        }
        if (widths[i] == 100) {
            assert_says(text, "  [="); /* a bar that has begun to fill */
            assert_says(text, "noise");
        }
        /* Gone at the end. */
        assert_true(length >= 4 && strcmp(text + length - 4, "\r\033[K") == 0);
        assert_null(strstr(text, "gone  of ")); /* no noise target: nothing is predicted */
    }
}

/* The last line of `text` that holds `words`. */
static const char *last_line(const char *text, const char *words)
{
    const char *found = strstr(text, words);
    if (!found) fail_msg("\"%s\" is not said in:\n%s", words, text);
    for (const char *next; (next = strstr(found + 1, words)) != NULL;) found = next;
    while (found > text && found[-1] != '\r') found--;
    return found;
}

/* To a noise target: percentage, noise and bar fit every width from 40 columns on; no line wraps. */
static void test_noise_and_bar_fit(void **state)
{
    static char text[1 << 16];
    static const unsigned short widths[] = {40, 60, 80, 120};
    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        double percent, noise;
        read_terminal(state, widths[i], "--noise", "0.3", text, sizeof text);
        const size_t longest = longest_line(text);
        if (longest >= widths[i]) fail_msg("%zu columns on a terminal of %u", longest, widths[i]);
        assert_null(strchr(text, '\n'));
        char line[160];
        const char *found = last_line(text, "noise ");
        snprintf(line, sizeof line, "%.*s", (int)strcspn(found, "\r\033"), found);
        assert_int_equal(sscanf(line, " %lf %%", &percent), 1);
        assert_int_equal(sscanf(strstr(line, "noise "), "noise %lf %%", &noise), 1);
        if (!strstr(line, "  [=")) fail_msg("no bar on a terminal of %u columns: %s", widths[i], line);
        assert_int_equal(line[strlen(line) - 1], ']');
        if (widths[i] >= 60) assert_says(line, " left  ");
        if (widths[i] >= 80) assert_true(strstr(line, "pass ") && strstr(line, " gone  "));
    }
}

/* A dumb terminal gets a line now and then, and no control characters; what is no terminal gets nothing. */
static void test_plain_lines(void **state)
{
    ca_program_result r;
    char text[4096], *end;
    int slave;
    const pid_t silent = ca_program_start(
        *state, (const char *const[]){"render", "ball.xml", "-o", "b.pfm", "--threads=1", "--time=5.5", NULL}, -1);
    const int master = open_terminal(80, &slave);
    setenv("TERM", "dumb", 1);
    const pid_t process = ca_program_start(
        *state, (const char *const[]){"render", "ball.xml", "-o", "a.pfm", "--threads=1", "--time=5.5", NULL}, slave);
    unsetenv("TERM");
    close(slave);
    read_until(master, NULL, text, sizeof text);
    close(master);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
    ca_program_finish(*state, silent, &r);
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    unsigned percent, pass;
    double left, gone;
    if (sscanf(text, "caustica: %u %%  pass %u  %lf s left  %lf s gone", &percent, &pass, &left, &gone) != 4)
        fail_msg("this is no line of progress: %s", text);
    assert_true(percent >= 90 && percent < 100 && pass > 0 && left < 0.6 && gone >= 5.0 && gone <= 6.0);
    assert_non_null(end = strchr(text, '\n'));
    assert_string_equal(end, "\n"); /* one line; the terminal adds the carriage return before its end */
    *(end[-1] == '\r' ? end - 1 : end) = '\0';
    assert_null(strpbrk(text, "\r\033[="));
}

/* A square of 2 * side^2 triangles. */
static void write_large_mesh(const char *folder, int side)
{
    char path[256];
    snprintf(path, sizeof path, "%s/large.ply", folder);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fprintf(file,
            "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            "element face %d\nproperty list uchar int vertex_indices\nend_header\n",
            (side + 1) * (side + 1), side * side);
    for (int i = 0; i < (side + 1) * (side + 1); i++) fprintf(file, "%d %d 0\n", i % (side + 1), i / (side + 1));
    for (int i = 0; i < side * side; i++) {
        const int corner = i / side * (side + 1) + i % side;
        fprintf(file, "4 %d %d %d %d\n", corner, corner + 1, corner + side + 2, corner + side + 1);
    }
    assert_int_equal(fclose(file), 0);
}

/* What the program says on a terminal if it is held for a second after a while: then there is something to tell. */
static void run_with_pause(void **state, const char *const words[], useconds_t wait, char *text, size_t size)
{
    ca_program_result r;
    int master;
    const pid_t process = start_on_terminal(state, 80, words, &master);
    usleep(wait);
    kill(process, SIGSTOP);
    usleep(1100000);
    kill(process, SIGCONT);
    read_until(master, NULL, text, size);
    close(master);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
}

/* From a second on it is told how far loading is, on one line, which is gone in the end; not with --quiet. */
static void test_loading(void **state)
{
    static char text[1 << 16];
    double percent = -1.0, gone = -1.0;
    char word[16] = "";
    write_large_mesh(folder_of(state), 500);
    write_text(folder_of(state), "large.xml",
               "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/>"
               "<shape type=\"ply\"><string name=\"filename\" value=\"large.ply\"/></shape></scene>");
    useconds_t wait = 50000; /* when it is in the middle of loading depends on the machine */
    static const char *const info[] = {"info", "large.xml", NULL};
    for (; wait < 700000 && !text[0]; wait += 100000) run_with_pause(state, info, wait, text, sizeof text);
    const char *line = strstr(text, " %  ");
    if (!line || line - text < 4 || sscanf(line - 3, "%lf %% %15s", &percent, word) != 2)
        fail_msg("nothing is told: %s", text);
    if (strcmp(word, "reading") == 0) assert_says(line, "reading large.ply  ");
    assert_true(strcmp(word, "reading") == 0 || strcmp(word, "placing") == 0 || strcmp(word, "building") == 0);
    assert_int_equal(sscanf(strstr(line, " s gone") - 3, "%lf s gone", &gone), 1);
    assert_true(percent >= 0.0 && percent <= 100.0 && gone >= 1.0 && gone < 60.0);
    assert_null(strchr(text, '\n'));
    assert_true(longest_line(text) < 80);
    assert_string_equal(text + strlen(text) - 4, "\r\033[K");
    static const char *const quiet[] = {"render",           "large.xml", "-ipath",    "--quiet", "--spp=1",
                                        "--resolution=8x8", "-o",        "large.pfm", NULL};
    run_with_pause(state, quiet, wait - 100000, text, sizeof text);
    assert_string_equal(text, "");
}

/* To a noise target: how long the whole will take, once that is known; in the end that is about what it took. */
static void test_predicted_time(void **state)
{
    static char text[1 << 16];
    read_terminal(state, 120, "--noise", "0.25", text, sizeof text);
    const char *line = last_line(text, " s gone  of ");
    double percent, left, gone, whole;
    unsigned passes;
    if (sscanf(line, " %lf %% pass %u %lf s left %lf s gone of %lf s noise ", &percent, &passes, &left, &gone,
               &whole) != 5)
        fail_msg("not of its form: %.100s", line);
    assert_true(whole >= gone && whole <= 5.0 * gone + 0.1);
    /* Each is rounded to a tenth. */
    if (!(fabs(left + gone - whole) < 0.16)) fail_msg("%.100s", line);
    if (!(fabs(percent - 100.0 * gone / whole) < 1.0 + 10.0 / whole)) fail_msg("%.100s", line);
}

/* By passes: how many of how many, on all but the narrowest terminals; what does not fit is left out whole. */
static void test_counts_passes(void **state)
{
    static char text[1 << 16];
    unsigned percent, passes;
    read_terminal(state, 100, "--spp", "3000", text, sizeof text);
    assert_int_equal(sscanf(last_line(text, "/3000  "), " %u %% pass %u/3000 ", &percent, &passes), 2);
    assert_true(fabs(percent + 0.5 - passes / 30.0) <= 0.5 + 1e-9); /* rounded down */
    assert_says(text, " left  ");
    read_terminal(state, 22, "--spp", "3000", text, sizeof text);
    assert_says(text, " %  pass ");
    assert_null(strstr(text, "left"));
    assert_null(strstr(text, "[="));
}

/* What the program says on a terminal that it is started with, which is the end of it. */
static void read_failure(void **state, const char *const words[], char *text, size_t size)
{
    int master;
    ca_program_result r;
    const pid_t process = start_on_terminal(state, 80, words, &master);
    read_until(master, NULL, text, size);
    close(master);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 1);
}

/* Names and texts of others cannot give a terminal commands, nor begin a line of their own; letters stay. */
static void test_names_give_no_commands(void **state)
{
    static const char name[] = "\x1b]0;title\x07 \xc2\x9b"
                               "31m \x9b"
                               "1m \x7f\r\ncaustica: \xc3\xa9\t.xml";
    const char *const words[] = {"render", name, "-o", "a.pfm", NULL};
    char text[4096];
    read_failure(state, words, text, sizeof text);
    assert_says(
        text,
        "caustica: \\x1b]0;title\\x07 \\xc2\\x9b31m \\x9b1m \\x7f\\x0d\\x0acaustica: \xc3\xa9\t.xml: cannot open");
    ca_program_result r;
    ca_program_run(*state, words, &r);
    assert_exit(&r, 1);
    assert_says(r.errors, name); /* a program that reads it gets the name itself */

    write_text(folder_of(state), "odd.xml",
               "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape "
               "type=\"sph&#155;31mere\"/></scene>");
    const char *const odd[] = {"render", "odd.xml", "-o", "a.pfm", NULL};
    read_failure(state, odd, text, sizeof text);
    assert_says(text, "sph\\xc2\\x9b31mere");
    assert_null(strstr(text, "\xc2\x9b"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_signal_ends_with_an_image),
        PROGRAM_TEST(test_signal_without_a_reader),
        PROGRAM_TEST(test_output_without_a_reader),
        PROGRAM_TEST(test_signal_ends_with_a_part),
        PROGRAM_TEST(test_second_signal_kills),
        PROGRAM_TEST(test_term_in_a_long_pass),
        PROGRAM_TEST(test_system_signals_end_with_an_image),
        PROGRAM_TEST(test_signal_saves),
        PROGRAM_TEST(test_signal_without_a_picture),
        PROGRAM_TEST(test_progress_line),
        PROGRAM_TEST(test_noise_and_bar_fit),
        PROGRAM_TEST(test_loading),
        PROGRAM_TEST(test_plain_lines),
        PROGRAM_TEST(test_predicted_time),
        PROGRAM_TEST(test_counts_passes),
        PROGRAM_TEST(test_names_give_no_commands),
    };
    return run_program_tests("command line on a terminal", tests, sizeof tests / sizeof tests[0]);
}
