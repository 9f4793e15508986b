/* Every call that can fail does, in one run of the program after another (support/torture.h): over all commands that
 * read or write files, and all integrators.
 *
 * As a fast test it tries a few calls of each kind. CA_TORTURE_MINUTES (make torture): for so long, finding them
 * included, the first 500 calls of each kind in each command and one call of each call stack beyond them; what is
 * left out then is told. CA_TORTURE_ONLY=NAME:KIND:N:STAYS: one run, as a failure names it; CA_TORTURE_ONLY=NAME: a
 * few calls of each kind in that command. */
#include "base/clock.h"
#include "support/program_test.h"
#include "support/sample_files.h"
#include "support/torture.h"

#include <stdlib.h>

/* A ball of glass over a mesh with a picture on it: all techniques, and files of three formats. */
static const char room[] =
    "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0.5,1,4' target='0.5,0.3,0' up='0,1,0'/></transform><float name='fov' value='40'/>"
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='6'/></film></sensor>"
    "<shape type='ply'><string name='filename' value='mesh.ply'/><bsdf type='twosided'><bsdf type='diffuse'>"
    "<texture name='reflectance' type='bitmap'><string name='filename' value='colours.png'/></texture></bsdf></bsdf>"
    "</shape>"
    "<shape type='sphere'><point name='center' x='0.5' y='0.5' z='1'/><float name='radius' value='0.2'/>"
    "<bsdf type='dielectric'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.5'/><rotate x='1' angle='90'/>"
    "<translate y='2'/></transform><emitter type='area'/></shape>"
    "<emitter type='envmap'><string name='filename' value='sky.exr'/></emitter></scene>";

#define RENDER(method)                                                                                               \
    {                                                                                                                \
        .name = "render-" method,                                                                                    \
        .words = {"render", "room.xml", "-i",    method, "--threads=2", "--spp=2", "--quiet", "--max-depth=5", "-o", \
                  "o.exr",  "-o",       "o.pfm", "-o",   "o.png",       "-o",      "o.part",  "--stats=o.json"},     \
        .outputs = {                                                                                                 \
            "o.exr",                                                                                                 \
            "o.pfm",                                                                                                 \
            "o.png",                                                                                                 \
            "o.part",                                                                                                \
            "o.json"                                                                                                 \
        }                                                                                                            \
    }

static const torture_command commands[] = {
    {.name = "info", .words = {"info", "room.xml"}},
    RENDER("path"),
    {.name = "compare",
     .words = {"compare", "b.exr", "--reference", "a.exr", "--html", "c.html", "--stats", "c.json"},
     .outputs = {"c.html", "c.json"},
     .is_exact = true},
    {.name = "merge",
     .words = {"merge", "p0.part", "p1.part", "-o", "m.pfm", "-o", "m.exr", "-o", "m.part"},
     .outputs = {"m.pfm", "m.exr", "m.part"}},
    {.name = "resume",
     .words = {"render", "room.xml", "-i", "bdpt", "--threads=2", "--spp=3", "--quiet", "--max-depth=5",
               "--checkpoint=k.part", "--resume", "--checkpoint-every=0.000001", "-o", "k.pfm"},
     .outputs = {"k.pfm", "k.part"},
     .kept = "k.part"},
    {.name = "noise",
     .words = {"noise", "room.xml", "-i", "bdpm", "--threads=2", "--iterations=2", "-o", "n.exr"},
     .outputs = {"n.exr"},
     .varies = true}, /* recommended numbers */
    RENDER("vcm"),
    RENDER("qmcppm"),
    RENDER("light"),
    RENDER("bdpt"),
    RENDER("ppm"),
    RENDER("bdpm"),
    RENDER("vcm-plus"),
    RENDER("vcm-star"),
    RENDER("ovcm"),
    RENDER("cavcm"),
    RENDER("vavcm"),
    {.name = "render-auto", /* which method it is depends on times, and so do the bits */
     .words = {"render", "room.xml", "-i", "auto", "--threads=2", "--spp=2", "--quiet", "-o", "o.exr"},
     .outputs = {"o.exr"},
     .varies = true},
    {.name = "rays", /* likewise */
     .words = {"render", "room.xml", "-i", "bdpm", "--threads=2", "--spp=48", "--quiet", "--rays=auto",
               "--checkpoint=q.part", "--resume", "--checkpoint-every=0.000001", "-o", "q.exr"},
     .outputs = {"q.exr", "q.part"},
     .kept = "q.part",
     .varies = true},
    {.name = "repeat",
     .words = {"render", "room.xml", "-i", "bdpm", "--threads=2", "--quiet", "--rays=r.part", "-o", "s.pfm"},
     .outputs = {"s.pfm"}},
    {.name = "compare-maps",
     .words = {"compare", "b.exr", "--reference", "a.exr", "--flip=both", "--maps", "maps.exr"},
     .outputs = {"maps.exr"}},
    {.name = "converge",
     .words = {"converge", "room.xml", "-ipath", "-ilight", "--spp=1,2", "--reference", "a.exr", "-o", "curves"},
     .outputs = {"curves/converge.json", "curves/index.html", "curves/images.html", "curves/renders/path-2spp-1.exr",
                 "curves/pictures/reference.png"}, /* of the others times decide which render they show */
     .folder = "curves"},
    {.name = "study",
     .words = {"study", "study.json", "-o", "seen"},
     .outputs = {"seen/index.html", "seen/images/ball-image.exr", "seen/images/ball-reference.exr"},
     .folder = "seen"},
    {.name = "study-answers",
     .words = {"study", "--analyse", "answers.json", "--stats", "a.json"},
     .outputs = {"a.json"},
     .is_exact = true},
    {.name = "merge-blocks",
     .words = {"merge", "b0.part", "b1.part", "-o", "u.pfm", "-o", "u.part", "--stats=u.json"},
     .outputs = {"u.pfm", "u.part", "u.json"}},
    {.name = "merge-gaps",
     .words = {"merge", "p0.part", "p3.part", "-o", "g.part", "--stats=g.json"},
     .outputs = {"g.part", "g.json"}},
    {.name = "noise-page",
     .words = {"noise", "room.xml", "-i", "bdpm", "--threads=2", "--iterations=4", "--predict", "50,2", "-o", "v.exr",
               "--stats=v.json"},
     .outputs = {"v.exr", "v.json"},
     .varies = true}, /* recommended numbers */
};
enum { COMMANDS = sizeof commands / sizeof commands[0], JOBS = COMMANDS * TORTURE_KINDS };

static const char study[] =
    "{ \"title\": \"balls\", \"question\": \"Was there a difference?\", \"image\": { \"spp\": 1 },\n"
    "  \"reference\": { \"integrator\": \"path:max_depth=3\", \"spp\": 2, \"seed\": 3 },\n"
    "  \"scenarios\": [{ \"name\": \"ball\", \"scene\": \"room.xml\" }] }\n";

static const char answers[] =
    "{ \"format\": \"caustica study answers\", \"version\": 1,\n"
    "  \"study\": { \"id\": \"s\", \"title\": \"T\", \"question\": \"Q?\", \"seconds\": 5, \"scenarios\": [\n"
    "    { \"name\": \"a\", \"light\": \"visible\", \"pair\": \"p\", \"flip\": 0.1 },\n"
    "    { \"name\": \"b\", \"light\": \"occluded\", \"pair\": \"p\", \"flip\": 0.2 }] },\n"
    "  \"sessions\": [{ \"subject\": \"one\", \"session\": \"of one\", \"finished\": true, \"trials\": [\n"
    "    { \"scenario\": \"a\", \"shown_ms\": 5000, \"disturbed\": \"\", \"difference\": true },\n"
    "    { \"scenario\": \"b\", \"shown_ms\": 5000, \"disturbed\": \"\", \"difference\": false }] }] }\n";

/* ---- The folder ------------------------------------------------------------------------------------------------ */

static void write_sample(const char *name, sample_bytes bytes, void **state)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder_of(state), name);
    sample_write(path, bytes.data, bytes.size);
    sample_free(&bytes);
}

static void take_ending_off(void **state, const char *name)
{
    char from[256], to[256];
    snprintf(from, sizeof from, "%s/%s", folder_of(state), name);
    snprintf(to, sizeof to, "%.*s", (int)(strlen(from) - strlen(".part")), from);
    assert_int_equal(rename(from, to), 0);
}

static void prepare(void **state)
{
    ca_program_result result;
    write_text(folder_of(state), "room.xml", room);
    write_text(folder_of(state), "study.json", study);
    write_text(folder_of(state), "answers.json", answers);
    write_sample("mesh.ply", sample_ply(SAMPLE_PLY_ASCII), state);
    write_sample("colours.png", sample_png(8, 3, false), state);
    write_sample("sky.exr", sample_exr(3, false, false), state);
    RUN(&result, "render", "room.xml", "-i", "path", "--quiet", "--spp=4", "-o", "a.exr");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "path", "--quiet", "--spp=4", "--seed=2", "-o", "b.exr");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "path", "--quiet", "--passes=0:2", "-o", "p0.part");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "path", "--quiet", "--passes=2:4", "-o", "p1.part");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "path", "--quiet", "--passes=6:7", "-o", "p3.part");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "qmcppm", "--quiet", "--blocks=0:2", "-o", "b0.part");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "qmcppm", "--quiet", "--blocks=2:3", "-o", "b1.part");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "bdpt", "--quiet", "--max-depth=5", "--spp=2", "-o", "k.part.kept.part");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "bdpm", "--quiet", "--spp=32", "--rays=auto",
        "--checkpoint=q.part.kept.part", "-o", "r.exr");
    assert_exit(&result, 0);
    RUN(&result, "render", "room.xml", "-i", "bdpm", "--quiet", "--spp=32", "--rays=auto", "--checkpoint=r.part",
        "-o", "r.exr");
    assert_exit(&result, 0);
    take_ending_off(state, "k.part.kept.part");
    take_ending_off(state, "q.part.kept.part");
}

/* ---- Which runs ------------------------------------------------------------------------------------------------ */

typedef struct torture_tally {
    long runs, ended, sites;
    char site[64][256]; /* where libraries ended the process */
} torture_tally;

static void note_site(torture_tally *tally, const char *site)
{
    tally->ended++;
    for (long i = 0; i < tally->sites; i++)
        if (strcmp(tally->site[i], site) == 0) return;
    if (tally->sites < 64) strcpy(tally->site[tally->sites++], site);
}

static void run_both(void **state, const torture_calls *calls, size_t index, torture_tally *tally)
{
    char site[256];
    for (int stays = 0; stays < 2; stays++) {
        tally->runs++;
        if (torture_run(*state, calls->command, calls->kind, calls->numbers[index], stays, site))
            note_site(tally, site);
    }
}

/* What the time was too short for: of each command and kind the calls behind those that were tried. */
static void tell_what_is_left(const torture_calls jobs[JOBS], const size_t tried[JOBS])
{
    size_t left = 0;
    for (int j = 0; j < JOBS; j++) {
        left += jobs[j].count - tried[j];
        if (tried[j] < jobs[j].count)
            print_message("# left out: %s, %s: %zu of %zu calls\n", jobs[j].command->name,
                          torture_kind_name(jobs[j].kind), jobs[j].count - tried[j], jobs[j].count);
    }
    print_message("# %zu calls were left when the time was over\n", left);
}

/* In turns, so that no command waits for the end of another one where the time is short. */
static void run_in_turns(void **state, const torture_calls jobs[JOBS], double end, torture_tally *tally)
{
    static size_t tried[JOBS];
    bool more = true;
    for (size_t turn = 0; more && ca_clock_seconds() < end; turn++) {
        more = false;
        for (int j = 0; j < JOBS && ca_clock_seconds() < end; j++) {
            if (turn >= jobs[j].count) continue;
            more = true;
            run_both(state, &jobs[j], turn, tally);
            tried[j]++;
        }
        if (turn % 20 == 19) print_message("# %ld runs\n", tally->runs);
    }
    print_message("# %ld runs, in %ld a library ended the process\n", tally->runs, tally->ended);
    for (long i = 0; i < tally->sites; i++) print_message("# ended in %s\n", tally->site[i]);
    tell_what_is_left(jobs, tried);
}

/* A few calls that lie apart. */
static void run_some(void **state, const torture_command *command, torture_kind kinds, torture_tally *tally)
{
    enum { CALLS = 3 };
    torture_keep_reference(*state, command);
    for (int k = 0; k < (int)kinds; k++) {
        torture_calls calls;
        torture_calls_find(&calls, *state, command, (torture_kind)k, 0);
        for (size_t i = 0; i < CALLS && i < calls.count; i++)
            run_both(state, &calls, (2 * i + 1) * calls.count / (2 * CALLS) % calls.count, tally);
        torture_calls_free(&calls);
    }
}

/* "NAME:KIND:N:STAYS", or "NAME": a few calls of all kinds. */
static void run_one(void **state, const char *only)
{
    static torture_tally tally;
    char name[64], kind[64], site[256];
    long at;
    int stays;
    const int words = sscanf(only, "%63[^:]:%63[^:]:%ld:%d", name, kind, &at, &stays);
    bool found = false;
    if (words != 1 && words != 4) fail_msg("CA_TORTURE_ONLY: %s", only);
    for (int c = 0; c < COMMANDS; c++) {
        if (strcmp(name, commands[c].name) != 0) continue;
        found = true;
        if (words == 1) run_some(state, &commands[c], TORTURE_KINDS, &tally);
        for (int k = 0; words == 4 && k < TORTURE_KINDS; k++) {
            if (strcmp(kind, torture_kind_name((torture_kind)k)) != 0) continue;
            torture_keep_reference(*state, &commands[c]);
            torture_run(*state, &commands[c], (torture_kind)k, at, stays, site);
        }
    }
    if (!found) fail_msg("CA_TORTURE_ONLY: there is no command %s", name);
    if (words == 1) print_message("# %ld runs\n", tally.runs);
}

static void run_long(void **state, double minutes)
{
    static torture_calls jobs[JOBS];
    static torture_tally tally;
    const double end = ca_clock_seconds() + 60.0 * minutes;
    for (int c = 0; c < COMMANDS; c++) {
        torture_keep_reference(*state, &commands[c]);
        for (int k = 0; k < TORTURE_KINDS; k++)
            torture_calls_find(&jobs[c * TORTURE_KINDS + k], *state, &commands[c], (torture_kind)k, 500);
    }
    print_message("# the calls are found, %.0f s are left\n", end - ca_clock_seconds());
    run_in_turns(state, jobs, end, &tally);
    for (int j = 0; j < JOBS; j++) torture_calls_free(&jobs[j]);
}

/* Of the first commands. */
static void run_short(void **state)
{
    enum { SHORT_COMMANDS = 5 };
    static torture_tally tally;
    for (int c = 0; c < SHORT_COMMANDS; c++) run_some(state, &commands[c], TORTURE_FOREIGN_MEMORY, &tally);
    print_message("# %ld runs\n", tally.runs);
}

static void test_no_call_loses_anything(void **state)
{
    const char *minutes = getenv("CA_TORTURE_MINUTES"), *only = getenv("CA_TORTURE_ONLY");
    if (access(CA_BUILD_DIR "/tests/libcaustica-faults.so", R_OK) != 0) {
        print_message("SKIPPED: this build has no library of faults (with sanitizers it cannot be preloaded)\n");
        skip();
    }
    prepare(state);
    if (only)
        run_one(state, only);
    else if (minutes)
        run_long(state, atof(minutes));
    else
        run_short(state);
    assert_int_equal(torture_failures(), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {PROGRAM_TEST(test_no_call_loses_anything)};
    return run_program_tests("torture", tests, sizeof tests / sizeof tests[0]);
}
