/* Checkpoints from outside: kills at random times (200 of them are in long_kills), a second job, a full disk, a
 * texture that changes behind its name, names that are chosen, and parts that are merged. */
#define _POSIX_C_SOURCE 200809L
#include "support/program_test.h"
#include "support/random_kills.h"
#include "support/scene_text.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

static uint64_t hash_of(void **state, const char *name)
{
    ca_image_layers *image = read_image(state, name);
    const uint64_t hash = image_hash(image);
    ca_image_release(image);
    return hash;
}

static void test_kills(void **state)
{
    ca_test_random random = ca_test_random_seed(16);
    static const ca_kill_job jobs[] = {{"path", "--spp=64", 0.06, 3, false},
                                       {"bdpt", "--spp=32", 0.06, 2, false},
                                       {"qmcppm:radius=0.1,max_depth=3", "--spp=9", 0.1, 2, false},
                                       {"bdpm:radius=0.1", "--spp=300", 0.1, 4, true}};
    for (int i = 0; i < 4; i++) expect_kills_lose_nothing(*state, &jobs[i], &random);
}

/* Ctrl-C leaves picture and checkpoint; the same line goes on. A second job is refused meanwhile. */
static void test_signals_and_second_jobs(void **state)
{
    static const char *const words[] = {"render",
                                        "ball.xml",
                                        "--spp=100000",
                                        "--quiet",
                                        "--checkpoint=c.part",
                                        "--resume",
                                        "--checkpoint-every=0.001",
                                        "-o",
                                        "a.exr",
                                        "--stats=a.json",
                                        NULL};
    ca_program_result r, second;
    const pid_t process = ca_program_start(*state, words, -1);
    ca_program_wait_for(*state, "c.part");
    RUN(&second, "render", "ball.xml", "--spp=5", "--checkpoint=c.part", "--resume", "-o", "b.exr");
    assert_exit(&second, 1);
    assert_says(second.errors, "c.part: another render is at work with this checkpoint");
    assert_false(exists(folder_of(state), "b.exr"));
    char link[600];
    snprintf(link, sizeof link, "%s/link.part", folder_of(state));
    assert_int_equal(symlink("c.part", link), 0);
    RUN(&second, "render", "ball.xml", "--spp=5", "--checkpoint=link.part", "--resume", "-o", "b.exr");
    assert_exit(&second, 1);
    assert_says(second.errors, "link.part: another render is at work with this checkpoint");
    assert_int_equal(unlink(link), 0);
    kill(process, SIGTERM);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
    assert_true(exists(folder_of(state), "a.exr") && !exists(folder_of(state), "c.part.lock"));
    json_t *stats = load_json(folder_of(state), "a.json");
    const double passes = json_number(stats, "iterations");
    json_decref(stats);
    char spp[64];
    snprintf(spp, sizeof spp, "--spp=%.0f", passes + 2.0);
    RUN(&r, "render", "ball.xml", spp, "--checkpoint=c.part", "--resume", "-o", "b.exr", "--stats=b.json");
    assert_exit(&r, 0);
    assert_says(r.output, "resumed after");
    stats = load_json(folder_of(state), "b.json");
    assert_true(json_number(stats, "resumed") == passes);
    assert_true(json_integer_value(json_array_get(json_object_get(stats, "passes"), 1)) == (json_int_t)passes + 2);
    json_decref(stats);
    RUN(&r, "render", "ball.xml", spp, "--quiet", "-o", "c.exr");
    assert_exit(&r, 0);
    assert_true(hash_of(state, "b.exr") == hash_of(state, "c.exr"));
}

/* By itself nothing is kept of a short render; asked for often it is, and goes when the render has ended. One that is
 * there stays, and going on from it is offered. */
static void test_names_by_itself(void **state)
{
    ca_program_result r;
    const char *folder = folder_of(state);
    RUN(&r, "render", "ball.xml", "-o", "a.exr");
    assert_exit(&r, 0);
    assert_false(exists(folder, "a.exr.checkpoint.part") || exists(folder, "a.exr.checkpoint.part.lock"));
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--checkpoint-every=1e-6");
    assert_exit(&r, 0);
    assert_false(exists(folder, "a.exr.checkpoint.part"));
    RUN(&r, "render", "ball.xml", "--spp=3", "-o", "b.exr", "--checkpoint=a.exr.checkpoint.part");
    assert_exit(&r, 0);
    const uint64_t three = hash_of(state, "b.exr");
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--checkpoint-every=1e-6");
    assert_exit(&r, 0);
    assert_says(r.errors, "a.exr.checkpoint.part is there already, of a render that did not end or is at work: "
                          "--resume goes on from it; this render keeps ");
    assert_says(r.errors, "a.exr.checkpoint-2.part\n");
    RUN(&r, "render", "ball.xml", "--spp=5", "-o", "b.exr", "--checkpoint=a.exr.checkpoint.part");
    assert_exit(&r, 2); /* a name that was asked for is used or refused, and gets no number */
    assert_says(r.errors, "a.exr.checkpoint.part: there is a checkpoint already: resume from it, remove it");
    assert_true(hash_of(state, "b.exr") == three);
    assert_true(exists(folder, "a.exr.checkpoint.part") && !exists(folder, "a.exr.checkpoint-2.part"));
    RUN(&r, "render", "ball.xml", "--spp=3", "-o", "a.exr", "--resume");
    assert_exit(&r, 0);
    assert_says(r.output, "resumed after 3 passes");
    assert_true(hash_of(state, "a.exr") == three && !exists(folder, "a.exr.checkpoint.part"));
    RUN(&r, "render", "ball.xml", "--spp=3", "-o", "a.exr", "--resume"); /* there is none: it starts anew */
    assert_exit(&r, 0);
    assert_says(r.errors, "caustica: there is no a.exr.checkpoint.part: the render begins anew (--checkpoint tells");
    assert_true(hash_of(state, "a.exr") == three);
}

static void set_age(void **state, const char *name, time_t seconds)
{
    char path[256];
    struct timespec times[2] = {{.tv_nsec = UTIME_OMIT}};
    snprintf(path, sizeof path, "%s/%s", folder_of(state), name);
    clock_gettime(CLOCK_REALTIME, &times[1]);
    times[1].tv_sec -= seconds;
    assert_int_equal(utimensat(AT_FDCWD, path, times, 0), 0);
}

/* --resume alone takes the newest of those that are there, whatever their numbers, and says so. */
static void test_newest_number(void **state)
{
    static const char *const names[] = {"a.exr.checkpoint.part", "a.exr.checkpoint-2.part",
                                        "a.exr.checkpoint-4.part"};
    static const char *const samples[] = {"--spp=2", "--spp=3", "--spp=1"};
    const char *folder = folder_of(state);
    ca_program_result r;
    for (int i = 0; i < 3; i++) {
        char option[64];
        snprintf(option, sizeof option, "--checkpoint=%s", names[i]);
        RUN(&r, "render", "ball.xml", samples[i], "-o", "b.exr", "--quiet", option);
        assert_exit(&r, 0);
    }
    set_age(state, names[0], 100);
    set_age(state, names[1], 10);
    set_age(state, names[2], 1000);
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--checkpoint-every=1e-6");
    assert_exit(&r, 0);
    assert_says(r.errors, "a.exr.checkpoint-2.part is there already");
    assert_says(r.errors, "this render keeps a.exr.checkpoint-3.part\n");
    RUN(&r, "render", "ball.xml", "--spp=6", "-o", "a.exr", "--resume");
    assert_exit(&r, 0);
    assert_says(r.output, "resumed after 3 passes");
    assert_string_equal(r.errors, "caustica: goes on from a.exr.checkpoint-2.part, the newest; older ones stay: "
                                  "a.exr.checkpoint.part, a.exr.checkpoint-4.part\n");
    assert_true(exists(folder, names[0]) && !exists(folder, names[1]) && exists(folder, names[2]));
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, names[0]);
    assert_int_equal(unlink(path), 0);
    RUN(&r, "render", "ball.xml", "--spp=6", "-o", "a.exr", "--resume");
    assert_exit(&r, 0);
    assert_says(r.output, "resumed after 1 pass,");
    assert_string_equal(r.errors, "caustica: goes on from a.exr.checkpoint-4.part\n");
}

/* What a kill left of a checkpoint that nobody asked for is named, too, of each number. */
static void test_leftovers_of_numbers(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "a.exr.checkpoint.part.~abc123", "");
    write_text(folder_of(state), "a.exr.checkpoint-2.part.~abc123", "");
    RUN(&r, "render", "ball.xml", "-o", "a.exr");
    assert_exit(&r, 0);
    assert_says(r.errors, "a.exr.checkpoint.part.~abc123 was left by a program that was killed");
    RUN(&r, "render", "ball.xml", "--spp=1", "-o", "b.exr", "--checkpoint=a.exr.checkpoint.part");
    assert_exit(&r, 0);
    RUN(&r, "render", "ball.xml", "--spp=2", "-o", "a.exr", "--resume");
    assert_exit(&r, 0);
    assert_says(r.errors, "a.exr.checkpoint-2.part.~abc123 was left by a program that was killed");
}

/* A render that ends after four seconds leaves the checkpoint of one that began a second later and died, though both
 * have one name for theirs. */
static void test_of_another_render(void **state)
{
    static const char *const first[] = {"render", "ball.xml", "--time=4", "--quiet", "-o", "k.exr", NULL},
                             *const second[] = {"render", "ball.xml", "--spp=1000000", "--quiet",
                                                "-o",     "k.exr",    "--checkpoint-every=2", NULL};
    ca_program_result r;
    const struct timespec second_later = {.tv_sec = 1};
    const pid_t ends = ca_program_start(*state, first, -1);
    nanosleep(&second_later, NULL);
    const pid_t dies = ca_program_start(*state, second, -1);
    ca_program_wait_for(*state, "k.exr.checkpoint.part");
    kill(dies, SIGKILL);
    ca_program_finish(*state, dies, &r);
    ca_program_finish(*state, ends, &r);
    assert_exit(&r, 0);
    assert_true(exists(folder_of(state), "k.exr.checkpoint.part"));
}

/* Renders of one first output at a time: each keeps a number of its own, also where none has written its file yet,
 * and removes that one alone. A number that is an output is left to it. */
static void test_one_name_at_a_time(void **state)
{
    static const char *const words[] = {"render", "ball.xml", "--spp=1000000",           "--quiet", "-o", "p.png",
                                        "-o",     "a.exr",    "--checkpoint-every=1000", NULL};
    ca_program_result first, r;
    const char *folder = folder_of(state);
    const pid_t process = ca_program_start(*state, words, -1);
    ca_program_wait_for(*state, "p.png.checkpoint.part.lock");
    RUN(&r, "render", "ball.xml", "--quiet", "-o", "p.png", "-o", "b.exr", "--checkpoint-every=1e-6");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "caustica: another render has taken the name of this one's checkpoint: "
                                  "this one keeps p.png.checkpoint-2.part\n");
    assert_true(exists(folder, "b.exr") && exists(folder, "p.png.checkpoint.part.lock"));
    assert_false(exists(folder, "p.png.checkpoint-2.part") || exists(folder, "p.png.checkpoint-2.part.lock"));
    RUN(&r, "render", "ball.xml", "--quiet", "-o", "p.png", "-o", "p.png.checkpoint-2.part", "--resume",
        "--checkpoint-every=1e-6");
    assert_exit(&r, 0);
    assert_says(r.errors, "keeps p.png.checkpoint-3.part\n");
    assert_true(exists(folder, "p.png.checkpoint-2.part") && !exists(folder, "p.png.checkpoint-3.part"));
    RUN(&r, "render", "ball.xml", "-o", "c.exr", "--checkpoint=p.png.checkpoint.part");
    assert_exit(&r, 1); /* a name that was asked for gets no number */
    assert_says(r.errors, "p.png.checkpoint.part: another render is at work with this checkpoint");
    kill(process, SIGTERM);
    ca_program_finish(*state, process, &first);
    assert_exit(&first, 0);
    assert_true(exists(folder, "p.png.checkpoint.part") && exists(folder, "a.exr"));
}

/* Every file is limited to fewer bytes than a checkpoint has, but not than the picture. */
static void test_full_disk(void **state)
{
    ca_program_result r;
    struct rlimit before, limited;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    limited = before;
    limited.rlim_cur = 60000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limited), 0);
    RUN(&r, "render", "ball.xml", "--checkpoint=c.part", "--checkpoint-every=1e-6", "-o", "a.png");
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_exit(&r, 1);
    assert_says(r.errors, "c.part: cannot write: File too large");
    assert_true(exists(folder_of(state), "a.png") && !exists(folder_of(state), "c.part"));
}

static const char *const textured =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='20'/>"
    "<transform name='to_world'><lookat origin='0,0,9' target='0,0,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='6'/></film></sensor>"
    "<shape type='sphere'><bsdf type='diffuse'><texture name='reflectance' type='bitmap'>"
    "<string name='filename' value='skin.pfm'/><boolean name='raw' value='true'/></texture></bsdf></shape>"
    "<emitter type='constant'/></scene>";

static void test_changed_texture(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "skin.xml", textured);
    write_text(folder_of(state), "skin.pfm", "PF\n1 1\n-1.0\nAAA>AAA>AAA>");
    RUN(&r, "render", "skin.xml", "-i", "path", "--spp=2", "--checkpoint=c.part", "-o", "a.exr");
    assert_exit(&r, 0);
    RUN(&r, "render", "skin.xml", "-i", "path", "--spp=3", "--checkpoint=c.part", "--resume", "-o", "a.exr");
    assert_exit(&r, 0);
    write_text(folder_of(state), "skin.pfm", "PF\n1 1\n-1.0\nAAA>AAB>AAA>");
    RUN(&r, "render", "skin.xml", "-i", "path", "--spp=4", "--checkpoint=c.part", "--resume", "-o", "a.exr");
    assert_wrong_usage(&r, "c.part was made with another scene");
}

static void test_parts(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "--spp=6", "-o", "one.exr");
    assert_exit(&r, 0);
    RUN(&r, "render", "ball.xml", "--passes=4:6", "-o", "b.part");
    assert_exit(&r, 0);
    assert_says(r.output, "passes 4:6");
    RUN(&r, "render", "ball.xml", "--passes=0:4", "-o", "a.part", "-o", "a.exr");
    assert_exit(&r, 0);
    RUN(&r, "merge", "b.part", "a.part", "-o", "two.exr", "--stats=two.json");
    assert_exit(&r, 0);
    assert_says(r.output, "2 parts, passes 0:6, 6 samples per pixel");
    assert_true(hash_of(state, "one.exr") == hash_of(state, "two.exr"));
    RUN(&r, "merge", "b.part", "-o", "two.exr");
    assert_exit(&r, 1);
    assert_says(r.errors, "an image needs all passes from 0, but b.part begins at pass 4");
    RUN(&r, "render", "ball.xml", "--spp=12", "--replicates=3", "--passes=4:12", "-o", "c.part");
    assert_exit(&r, 0);
    assert_true(r.errors[0] == '\0');
    static const char *const long_words[] = {
        "render", "ball.xml", "--spp=2000000", "--replicates=2", "--checkpoint=d.part", "--checkpoint-every=0.001",
        "-o",     "e.part",   NULL};
    const pid_t process = ca_program_start(*state, long_words, -1);
    ca_program_wait_for(*state, "d.part");
    kill(process, SIGINT);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 0);
    assert_says(r.errors, "warning: e.part with the passes 0:");
    assert_says(r.errors, " ends in the middle of a replicate of 1000000 passes: it adds up with no other part\n");
}

static json_t *stats_of_merge(void **state, const char *file)
{
    json_t *stats = load_json(folder_of(state), file), *gaps = json_incref(json_object_get(stats, "passes_missing"));
    json_decref(stats);
    return gaps;
}

static int64_t end_of_gap(const json_t *gaps, size_t gap, size_t end)
{
    return json_integer_value(json_array_get(json_array_get(gaps, gap), end));
}

/* A sum of some passes says which they are: not as if those between the first and the last one were all there. */
static void test_gaps(void **state)
{
    static const char *const ranges[] = {"0:1", "2:4", "5:6"}, *const files[] = {"0.part", "2.part", "5.part"};
    ca_program_result r;
    for (int i = 0; i < 3; i++) {
        RUN(&r, "render", "ball.xml", "--passes", ranges[i], "-o", files[i]);
        assert_exit(&r, 0);
    }
    RUN(&r, "merge", "5.part", "0.part", "2.part", "-o", "sum.part", "--stats=sum.json");
    assert_exit(&r, 0);
    assert_says(r.output, "3 parts, passes 0:1, 2:4 and 5:6 (missing between them: 1:2 and 4:5), 4 samples");
    json_t *gaps = stats_of_merge(state, "sum.json");
    assert_int_equal(json_array_size(gaps), 2);
    assert_true(end_of_gap(gaps, 0, 0) == 1 && end_of_gap(gaps, 0, 1) == 2);
    assert_true(end_of_gap(gaps, 1, 0) == 4 && end_of_gap(gaps, 1, 1) == 5);
    json_decref(gaps);
    RUN(&r, "render", "ball.xml", "--passes=1:2", "-o", "1.part");
    RUN(&r, "merge", "sum.part", "1.part", "-o", "most.part", "--stats=most.json");
    assert_exit(&r, 0);
    assert_says(r.output, "2 parts, passes 0:4 and 5:6 (missing between them: 4:5), 5 samples per pixel");
    RUN(&r, "render", "ball.xml", "--passes=4:5", "-o", "4.part");
    RUN(&r, "merge", "4.part", "most.part", "-o", "all.exr", "--stats=all.json");
    assert_exit(&r, 0);
    assert_says(r.output, "2 parts, passes 0:6, 6 samples per pixel");
    gaps = stats_of_merge(state, "all.json");
    assert_true(json_is_array(gaps) && json_array_size(gaps) == 0);
    json_decref(gaps);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_kills),     PROGRAM_TEST(test_signals_and_second_jobs), PROGRAM_TEST(test_names_by_itself),
        PROGRAM_TEST(test_full_disk), PROGRAM_TEST(test_changed_texture),         PROGRAM_TEST(test_parts),
        PROGRAM_TEST(test_of_another_render), PROGRAM_TEST(test_newest_number),
        PROGRAM_TEST(test_leftovers_of_numbers), PROGRAM_TEST(test_gaps), PROGRAM_TEST(test_one_name_at_a_time),
    };
    return run_program_tests("checkpoints", tests, sizeof tests / sizeof tests[0]);
}
