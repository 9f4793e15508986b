/* The program from outside: exit statuses, messages, files. */
#define _POSIX_C_SOURCE 200809L
#include "image/layers.h"
#include "integrator/integrator.h"
#include "support/program_test.h"
#include "support/scene_text.h"

#include <stdlib.h>
#include <sys/wait.h>

/* ---- Words ----------------------------------------------------------------------------------------------------- */

static void test_help_and_version(void **state)
{
    ca_program_result r;
    RUN(&r, "--version");
    assert_exit(&r, 0);
    assert_true(strncmp(r.output, "caustica ", 9) == 0);
    RUN(&r, "--help");
    assert_exit(&r, 0);
    assert_says(r.output, "Example");
    static const char *const commands[] = {"render", "noise", "compare", "converge",
                                           "merge",  "study", "convert", "info"};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        assert_says(r.output, commands[i]);
        ca_program_result own;
        RUN(&own, commands[i], "--help");
        assert_exit(&own, 0);
        assert_says(own.output, "Example");
        assert_string_equal(own.errors, "");
    }
}

/* Words that say the same as options. */
static void test_help_and_version_as_words(void **state)
{
    static const char *const same[][2][2] = {
        {{"help", NULL}, {"--help", NULL}},          {{"version", NULL}, {"--version", NULL}},
        {{"help", "render"}, {"render", "--help"}},  {{"help", "noise"}, {"noise", "--help"}},
        {{"help", "compare"}, {"compare", "--help"}}, {{"help", "converge"}, {"converge", "--help"}},
        {{"help", "merge"}, {"merge", "--help"}},    {{"help", "study"}, {"study", "--help"}},
        {{"help", "info"}, {"info", "--help"}},      {{"help", "help"}, {"--help", NULL}},
    };
    for (size_t i = 0; i < sizeof same / sizeof same[0]; i++) {
        ca_program_result a, b;
        RUN(&a, same[i][0][0], same[i][0][1]);
        RUN(&b, same[i][1][0], same[i][1][1]);
        assert_exit(&a, 0);
        assert_exit(&b, 0);
        assert_string_equal(a.output, b.output);
        assert_string_equal(a.errors, "");
        assert_true(strlen(a.output) > 0);
    }
}

/* One is no plural. */
static void test_one_is_singular(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--spp=1");
    assert_says(r.output, " 1 sample per pixel,");
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--spp=2");
    assert_says(r.output, " 2 samples per pixel,");
    RUN(&r, "render", "ball.xml", "-i", "qmcppm", "--blocks=0:1", "-oa.part");
    assert_says(r.output, " 1 sample per pixel,");
    RUN(&r, "merge", "a.part", "-o", "b.part");
    assert_says(r.output, "1 part, blocks 0:1, 1 sample per pixel,");
    RUN(&r, "noise", "ball.xml", "-i", "ppm", "--light-paths=20", "--iterations=2", "--resolution=1x1");
    assert_says(r.output, "2 iterations of 20 light paths and 1 camera path per pixel, 1 pixel, ");
    write_text(folder_of(state), "one.xml",
               "<scene version=\"3.0.0\"><sensor type=\"perspective\"><sampler type=\"independent\">"
               "<integer name=\"sample_count\" value=\"1\"/></sampler></sensor></scene>\n");
    RUN(&r, "info", "one.xml");
    assert_says(r.output, "independent, 1 sample per pixel,");
}

/* The help says which integrators there are, with the parameters that the documentation has. */
static void test_help_lists_the_integrators(void **state)
{
    ca_program_result help, r;
    RUN(&help, "render", "--help");
    RUN(&r, "render", "ball.xml", "-i", "nothing like it");
    assert_exit(&r, 2);
    char *name = strstr(r.errors, "there are: ");
    assert_non_null(name);
    name += strlen("there are: ");
    *strchr(name, ')') = '\0';
    int count = 0; /* of rows of the table */
    for (name = strtok(name, ", "); name; name = strtok(NULL, ", "), count++) {
        char line[64];
        snprintf(line, sizeof line, "\n  %s:max_depth=-1,rr_depth=3,hide_emitters=false", name);
        assert_says(help.output, line);
    }
    assert_true(count > 0 && ca_integrator_at((size_t)count - 1) && !ca_integrator_at((size_t)count));
    assert_says(help.output, "\nIntegrators with --rays: bdpt, ppm, bdpm, vcm, ovcm, vavcm, auto\n");
    RUN(&help, "noise", "--help");
    assert_says(help.output, "an iteration of ppm or bdpm has three terms");
    assert_says(help.output, "That of bdpt, vcm, ovcm or vavcm has a fourth");
    assert_says(help.output, "(default: one per processor)");
}

typedef struct usage_case {
    const char *words[8]; /* ended by NULL */
    const char *says;
} usage_case;

static const usage_case usage_cases[] = {
    {{NULL}, "a command is missing"},
    {{"rendr"}, "did you mean \"render\"?"},
    {{"paint"}, "command \"paint\" is not known"},
    {{"inf"}, "did you mean \"info\"?"},
    {{"halp"}, "did you mean \"help\"?"},
    {{"versoin"}, "did you mean \"version\"?"},
    {{"conv"}, "did you mean \"converge\"?"},
    {{"help", "nois"}, "did you mean \"noise\"?"},
    {{"help", "paint"}, "command \"paint\" is not known"},
    {{"help", "render", "noise"}, "help is of one command, not of 2"},
    {{"version", "x"}, "version takes nothing more, but \"x\" is given"},
    {{"--version", "render"}, "version takes nothing more, but \"render\" is given"},
    {{"render"}, "a scene file is missing"},
    {{"render", "ball.xml", "ball.xml"}, "more than one scene"},
    {{"render", "ball.xml", "--ssp", "4"}, "did you mean --spp?"},
    {{"render", "ball.xml", "--resol", "4"}, "did you mean --resolution?"},
    {{"render", "ball.xml", "-x"}, "option -x is not known"},
    {{"render", "ball.xml", "--spp"}, "--spp needs a value: N"},
    {{"render", "ball.xml", "--spp", "--quiet"}, "--spp needs a value: N"},
    {{"render", "ball.xml", "--spp", "0"}, "--spp: \"0\""},
    {{"render", "ball.xml", "--spp", "4x"}, "--spp: \"4x\""},
    {{"render", "ball.xml", "--spp", "4294967296"},
     "--spp: \"4294967296\" is too large: the largest is 4294967295"},
    {{"render", "ball.xml", "--spp", "99999999999999999999"},
     "--spp: \"99999999999999999999\" is too large: the largest is 4294967295"},
    {{"render", "ball.xml", "--spp", "-99999999999"},
     "--spp: \"-99999999999\" is not a whole number of at least 1"},
    {{"noise", "ball.xml", "--light-paths", "4294967296"},
     "--light-paths: \"4294967296\" is too large: the largest is 4294967295"},
    {{"render", "ball.xml", "--spp=4", "--spp=5"}, "--spp is given twice"},
    {{"render", "ball.xml", "--spp=4", "--time=5"}, "only one of --spp, --time and --noise"},
    {{"render", "ball.xml", "--time", "-1"}, "--time: \"-1\""},
    {{"render", "ball.xml", "--time", "inf"}, "--time: \"inf\" is not a number above 0"},
    {{"render", "ball.xml", "--time", "1e400"},
     "--time: \"1e400\" is too large: the largest number is 1.798e+308"},
    {{"render", "ball.xml", "--time", "-1e400"}, "--time: \"-1e400\" is not a number above 0"},
    {{"render", "ball.xml", "--exposure", "-1e400"},
     "--exposure: \"-1e400\" is beyond the smallest number, -1.798e+308"},
    {{"render", "ball.xml", "--exposure", "1e400"},
     "--exposure: \"1e400\" is too large: the largest number is 1.798e+308"},
    {{"render", "ball.xml", "--max-depth", "2147483648"},
     "--max-depth: \"2147483648\" is too large: the largest is 2147483647"},
    {{"render", "ball.xml", "--resolution", "4294967296x8"},
     "--resolution: \"4294967296\" is too large: the largest is 4294967295"},
    {{"render", "ball.xml", "--crop", "0,0,4294967296,8"},
     "--crop: \"4294967296\" is too large: the largest is 4294967295"},
    {{"render", "ball.xml", "--crop", "0,0,4294967296x,8"}, "is not a region x0,y0,x1,y1"},
    {{"render", "ball.xml", "--noise", "0"}, "--noise: \"0\""},
    {{"render", "ball.xml", "--seed", "-1"}, "--seed: \"-1\" is not a whole number from 0 to 2^64 - 1"},
    {{"render", "ball.xml", "--max-depth", "-2"}, "--max-depth: \"-2\""},
    {{"render", "ball.xml", "--resolution", "10"}, "--resolution: \"10\""},
    {{"render", "ball.xml", "--resolution", "10x0"}, "--resolution: \"10x0\""},
    {{"render", "ball.xml", "--crop", "1,2,3"}, "--crop: \"1,2,3\""},
    {{"render", "ball.xml", "--crop", "4,0,4,8"}, "--crop: \"4,0,4,8\""},
    {{"render", "ball.xml", "--crop", "0,0,99,8"}, "99"},
    {{"render", "ball.xml", "-i", "ppm:radius=1e-16"}, "if not 0 at least 1e-15"},
    {{"render", "ball.xml", "-i", "auto:radius=1e16"}, "at most 1e+15"},
    {{"render", "ball.xml", "--exposure", "bright"}, "--exposure: \"bright\""},
    {{"render", "ball.xml", "--quiet=1"}, "--quiet takes no value"},
    {{"render", "ball.xml", "-D", "albedo"}, "\"albedo\" is not NAME=VALUE"},
    {{"render", "ball.xml", "-D", "a=1", "-Da=2"}, "--define: a is defined twice, as \"1\" and \"2\""},
    {{"render", "ball.xml", "--sensor=1", "--camera=left"}, "--sensor and --camera exclude each other"},
    {{"render", "ball.xml", "-o", "ball.jpeg"}, ".exr"},
    {{"render", "ball.xml", "-i", "pathh"}, "did you mean \"path\"?"},
    {{"render", "ball.xml", "--sampler", "hamilton"}, "halton"},
    /* What later versions may know must not be a silent no-op today. */
    {{"render", "ball.xml", "--beams", "auto"}, "option --beams is not known"},
    {{"render", "ball.xml", "--observe"}, "option --observe is not known"},
    /* Parameters of integrators. */
    {{"render", "ball.xml", "--radius", "0"}, "--radius: \"0\""},
    {{"render", "ball.xml", "--radius", "1"}, "integrator \"path\" has no merge radius"},
    {{"render", "ball.xml", "--alpha", "0.5"}, "integrator \"path\" has no merge radius to shrink"},
    {{"render", "ball.xml", "--light-paths", "0"}, "--light-paths: \"0\""},
    {{"render", "ball.xml", "--light-paths", "10"}, "integrator \"path\" has no light paths"},
    {{"render", "ball.xml", "--camera-paths", "2"}, "integrator \"path\" has no number of camera paths"},
    {{"render", "ball.xml", "--radius", "1", "-i", "bdpt"}, "integrator \"bdpt\" has no merge radius"},
    {{"render", "ball.xml", "--alpha", "1.5", "-i", "vcm"}, "\"alpha\" must be a number of at least 0 and at most 1"},
    {{"render", "ball.xml", "--radius=2", "-i", "vcm:radius=1"},
     "\"radius\" is 1 among the integrator's own parameters but 2"},
    {{"render", "ball.xml", "--max-depth=2", "-i", "path:max_depth=3"}, "\"max_depth\" is 3 among the"},
    {{"render", "ball.xml", "-i", "path:radius=1"}, "integrator \"path\" has no parameter \"radius\""},
    {{"render", "ball.xml", "-i", "vcm:radius=-1"}, "\"radius\" must be a number of at least 0"},
    {{"render", "ball.xml", "-i", "vcm:radius=1,radius=1"}, "\"radius\" of the integrator is given twice"},
    {{"render", "ball.xml", "--dump-strategies", "x", "--max-depth=14"}, "max_depth of at most 13"},
    {{"render", "ball.xml", "--dump-strategies", "x", "--max-depth=-1"}, "it is not limited"},
    {{"compare", "a.exr"}, "--reference is missing"},
    {{"compare", "--reference", "a.exr"}, "an image to compare is missing"},
    {{"compare", "a.exr", "--reference", "a.exr", "--block=0"}, "--block: \"0\""},
    /* Blocks of pairs, and their parts. */
    {{"render", "ball.xml", "--blocks", "0"}, "\"0\" is not a range A:B with A < B"},
    {{"render", "ball.xml", "--blocks", "3:3"}, "\"3:3\" is not a range"},
    {{"render", "ball.xml", "--blocks", "-1:3"}, "\"-1:3\" is not a range"},
    {{"render", "ball.xml", "--blocks", "0:3x"}, "\"0:3x\" is not a range"},
    {{"render", "ball.xml", "--blocks", "0:18446744073709551616"},
     "--blocks: \"18446744073709551616\" is too large: the largest is 18446744073709551615"},
    {{"render", "ball.xml", "--blocks", "0:3", "--spp=3"}, "--blocks cannot be combined with --spp or --noise"},
    {{"render", "ball.xml", "--blocks", "0:3"}, "integrator \"path\" does not render by blocks of pairs"},
    {{"render", "ball.xml", "--passes", "0:4", "-iqmcppm"}, "it has a range of blocks, not of passes"},
    {{"render", "ball.xml", "--passes", "0:4", "--spp=3"}, "--passes cannot be combined with --spp"},
    {{"render", "ball.xml", "--passes", "0:4", "--noise=3"}, "--passes cannot be combined with --blocks or --noise"},
    {{"render", "ball.xml", "--passes", "0:4", "--blocks=0:3"},
     "--passes cannot be combined with --blocks or --noise"},
    {{"render", "ball.xml", "--passes", "0:4", "-iauto", "-oa.part"}, "name the integrator"},
    {{"render", "ball.xml", "--passes", "0:16777216", "-oa.part"}, "there are no passes 0:16777216"},
    {{"render", "ball.xml", "--passes", "1:4"}, "an image needs all passes from 0"},
    {{"render", "ball.xml", "--checkpoint=a.exr"}, "the name must end in .part"},
    {{"render", "ball.xml", "-ibdpm", "--rays=b.part", "--checkpoint=a.part"}, "keeps no checkpoint"},
    {{"render", "ball.xml", "-ibdpm", "--rays=b.part", "--spp=4"}, "the samples are those of the record"},
    {{"render", "ball.xml", "-ibdpm", "--rays=auto", "-oa.part"}, "there is no part of such a render"},
    {{"render", "ball.xml", "-ibdpt:max_depth=3", "--dump-strategies=d", "--checkpoint=a.part"},
     "images of the strategies are not kept in a checkpoint"},
    {{"render", "ball.xml", "--blocks", "1:3", "-iqmcppm"}, "an image needs all blocks from 0"},
    {{"render", "ball.xml", "--blocks", "1:3", "-iqmcppm", "-oa.part", "-oa.exr"},
     "an image needs all blocks from 0"},
    {{"render", "ball.xml", "-oa.part", "-ob.part"}, "only one part file can be written: a.part or b.part"},
    {{"render", "ball.xml", "-iqmcppm", "--noise", "1"}, "does not know its noise"},
    {{"merge"}, "a part file to merge is missing"},
    {{"merge", "a.part"}, "option --output is missing"},
    {{"merge", "a.part", "-o", "a.jpeg"}, ".exr"},
    {{"merge", "a.part", "-o", "b.part", "-oc.part"}, "only one part file"},
    {{"info"}, "a scene file is missing"},
    {{"info", "ball.xml", "--spp", "1"}, "option --spp is not known"},
};

static void test_wrong_usage(void **state)
{
    for (size_t i = 0; i < sizeof usage_cases / sizeof usage_cases[0]; i++) {
        ca_program_result r;
        ca_program_run(*state, usage_cases[i].words, &r);
        assert_wrong_usage(&r, usage_cases[i].says);
        assert_says(r.errors, "--help");
        assert_string_equal(r.output, "");
        assert_false(exists(folder_of(state), "ball.exr"));
    }
}

/* `--stats "$UNSET"`: refused before the work. */
static void test_empty_names(void **state)
{
    static const char *const options[] = {"--stats", "--dump-strategies", "-o"};
    for (int i = 0; i < 3; i++) {
        ca_program_result r;
        RUN(&r, "render", "ball.xml", "-i", "bdpt:max_depth=3", options[i], "");
        assert_int_equal(r.exit_status, 2);
        assert_false(exists(folder_of(state), "ball.exr"));
    }
}

/* Numbers in the environment are checked as those of options are: what a launcher of several processes tells. */
static void test_wrong_numbers_in_the_environment(void **state)
{
    static const char *const cases[][3] = {
        {"OMPI_COMM_WORLD_SIZE", "two", "\"two\" is not a whole number of at least 1"},
        {"OMPI_COMM_WORLD_SIZE", "99999999999", "\"99999999999\" is too large: the largest is 2147483647"},
        {"PMI_SIZE", "0", "\"0\" is not a whole number of at least 1"},
        {"PMI_RANK", "-1", "\"-1\" is not a whole number of at least 0"},
        {"PMIX_RANK", "1x", "\"1x\" is not a whole number of at least 0"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_program_result r;
        char says[256];
        snprintf(says, sizeof says, "caustica: %s in the environment: %s", cases[i][0], cases[i][2]);
        assert_int_equal(setenv(cases[i][0], cases[i][1], 1), 0);
        RUN(&r, "version");
        assert_int_equal(unsetenv(cases[i][0]), 0);
        assert_wrong_usage(&r, says);
        assert_string_equal(r.output, "");
    }
}

/* ---- Failures -------------------------------------------------------------------------------------------------- */

static void test_failures_of_the_world(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "nowhere.xml");
    assert_exit(&r, 1);
    assert_says(r.errors, "nowhere.xml");
    assert_false(exists(folder_of(state), "nowhere.exr"));

    /* Found before the scene is looked at, let alone rendered. */
    RUN(&r, "render", "nowhere.xml", "-o", "no/such/folder.exr");
    assert_exit(&r, 1);
    assert_says(r.errors, "no/such/folder.exr");
    RUN(&r, "render", "nowhere.xml", "-o", "a.exr", "--stats", "no/such/folder.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "no/such/folder.json");
    assert_false(exists(folder_of(state), "a.exr"));

    write_text(folder_of(state), "odd.xml", "<scene version=\"3.0.0\">\n  <shape type=\"sphear\"/>\n</scene>\n");
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
    char command[1024];
    snprintf(command, sizeof command, "'%s' --help > /dev/full 2> /dev/null", ((const ca_program *)*state)->path);
    const int status = system(command);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 1);
}

/* A file over the size limit must not end the program by a signal, nor leave something behind. */
static void test_file_size_limit(void **state)
{
    const ca_program *program = *state;
    char command[1024];
    /* ThreadSanitizer's runtime keeps its shadow memory in files and does not start under such a limit. */
    snprintf(command, sizeof command, "ulimit -f 8; '%s' --version > /dev/null 2>&1", program->path);
    if (system(command) != 0) skip();
    snprintf(command, sizeof command,
             "ulimit -f 8; cd '%s' && mkdir small && '%s' render ball.xml --resolution 128x128 --spp 1 --quiet -o "
             "small/a.pfm "
             "2> /dev/null",
             program->folder, program->path);
    const int status = system(command);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 1);
    snprintf(command, sizeof command, "rmdir '%s/small'", program->folder);
    assert_int_equal(system(command), 0);
}

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

static void test_default_outputs(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml");
    assert_exit(&r, 0);
    assert_true(exists(folder_of(state), "ball.exr") && exists(folder_of(state), "ball.png"));
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
    assert_true(exists(folder_of(state), "a.pfm") && exists(folder_of(state), "a.exr"));
    json_t *stats = load_json(folder_of(state), "a.json");
    static const char *const keys[] = {"seconds",        "rays",   "shadow_rays",       "photons",
                                       "photons_tested", "merges", "peak_memory_bytes", "mean_standard_deviation",
                                       "light_paths",    "confidence_marked",       "confidence_widened"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) json_number(stats, keys[i]);
    assert_int_equal((int)json_number(stats, "iterations"), 8);
    assert_int_equal((int)json_number(stats, "camera_paths"), 8 * 24 * 16);
    const json_t *non_finite = json_object_get(stats, "non_finite");
    static const char *const sources[] = {"hit", "next_event", "connect", "splat", "merge", "film"};
    for (size_t i = 0; i < sizeof sources / sizeof sources[0]; i++)
        assert_int_equal((int)json_number(non_finite, sources[i]), 0);
    assert_int_equal(json_object_size(non_finite), sizeof sources / sizeof sources[0]);
    assert_int_equal((int)json_number(stats, "samples_per_pixel"), 8);
    const double luminance = json_number(stats, "mean_luminance");
    assert_true(luminance > 0.24 && luminance < 0.4); /* the ball nearly fills the picture */
    json_decref(stats);
}

/* What the picture will lack is said in any case, apart from what is printed. */
static void test_warnings(void **state)
{
    static const char water[] =
        "<scene version='3.0.0'><default name='irradiance' value='1'/><sensor type='perspective'><transform "
        "name='to_world'><lookat origin='0,4,0' target='0,0,0' up='0,0,1'/></transform><film type='hdrfilm'><integer "
        "name='width' value='8'/><integer name='height' value='8'/></film></sensor>"
        "<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/></transform>"
        "</shape><shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/>"
        "<translate y='1'/></transform><bsdf type='dielectric'/></shape>"
        "<emitter type='directional'><vector name='direction' value='0,-1,0'/><rgb name='irradiance' "
        "value='$irradiance'/></emitter></scene>";
    ca_program_result r;
    write_text(folder_of(state), "water.xml", water);
    RUN(&r, "render", "water.xml", "-ipath", "--quiet", "-o", "a.pfm");
    assert_exit(&r, 0);
    assert_string_equal(r.output, "");
    assert_string_equal(r.errors, "caustica: warning: \"path\" will find none or too little of about 100 % of the "
                                  "light, such as light through glass seen through glass; -i auto finds it\n");
    RUN(&r, "render", "water.xml", "-i", "ovcm", "--radius=0.2", "--light-paths=50000", "-oa.pfm");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    write_text(folder_of(state), "dark.xml", "<scene version='3.0.0'><sensor type='perspective'/></scene>");
    RUN(&r, "render", "dark.xml", "-o", "a.pfm", "--resolution", "8x8");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "caustica: warning: the scene has no light: the picture will be black\n");
}

/* The options that set an integrator's parameters, as they are recorded and as they count. */
static void test_options_of_integrators(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--stats", "a.json", "-i", "ovcm:alpha=0.25", "--alpha=0.25",
        "--radius", "0.125", "--light-paths", "50", "--camera-paths", "3", "--spp", "7");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_says(r.output, "24 x 16 pixels, 9 samples per pixel");
    json_t *stats = load_json(folder_of(state), "a.json");
    assert_int_equal((int)json_number(stats, "iterations"), 3);
    assert_int_equal((int)json_number(stats, "samples_per_pixel"), 9);
    assert_int_equal((int)json_number(stats, "camera_paths"), 9 * 24 * 16);
    assert_true(json_number(stats, "light_paths") >= 150.0);
    assert_true(json_number(stats, "photons") > 0.0 && json_number(stats, "merges") > 0.0);
    json_decref(stats);
    char path[256];
    snprintf(path, sizeof path, "%s/a.exr", folder_of(state));
    ca_image_layers *image = NULL;
    assert_int_equal(ca_layers_read(path, &image, NULL), CA_OK);
    const char *integrator = attribute_text(image, "caustica.integrator");
    assert_says(integrator, "ovcm:max_depth=4,");
    assert_says(integrator, "light_paths=50,camera_paths=3,radius=0.125,alpha=0.25,");
    ca_image_release(image);
    /* Of `light`, samples are light paths. */
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "-i", "light", "--light-paths=192", "--spp", "3");
    assert_exit(&r, 0);
    assert_says(r.output, "24 x 16 pixels, 3 samples per pixel");
}

static void test_strategies(void **state)
{
    ca_program_result r;
    static const char *const folders[] = {"new", "new", "slash/"}; /* made, there already, made */
    for (int i = 0; i < 3; i++) {
        RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--dump-strategies", folders[i], "--max-depth=3");
        assert_exit(&r, 0);
        assert_says(r.output, "wrote ");
        assert_says(r.output, folders[i]);
        static const char *const names[] = {"index.html", "hit_s3_t0_weighted.exr", "next_event_s2_t1_unweighted.exr",
                                            "next_event_s2_t1_weight.exr"};
        for (size_t n = 0; n < sizeof names / sizeof names[0]; n++) {
            char path[128];
            snprintf(path, sizeof path, "%s/%s", folders[i], names[n]);
            assert_true(exists(folder_of(state), path));
        }
    }
    /* Found out before the scene is looked at. */
    RUN(&r, "render", "nowhere.xml", "-o", "a.pfm", "--dump-strategies", "ball.xml", "--max-depth=3");
    assert_exit(&r, 1);
    assert_says(r.errors, "ball.xml: this is not a folder");
    RUN(&r, "render", "nowhere.xml", "-o", "a.pfm", "--dump-strategies", "no/such", "--max-depth=3");
    assert_exit(&r, 1);
    assert_says(r.errors, "no/such");
}

static void test_file_of_crop_and_resolution(void **state)
{
    ca_program_result r;
    char header[16] = "";
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--resolution", "48x32", "--crop", "10,4,31,9", "--seed=7",
        "--sampler=sobol", "--threads=2", "--max-depth", "-1", "--memory", "100", "-i", "path:rr_depth=3");
    assert_exit(&r, 0);
    char path[256];
    snprintf(path, sizeof path, "%s/a.pfm", folder_of(state));
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
    json_t *stats = load_json(folder_of(state), "a.json");
    assert_true(json_number(stats, "noise_percent") < 5.0);
    json_decref(stats);
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--time", "0.2", "--stats", "a.json");
    assert_exit(&r, 0);
    stats = load_json(folder_of(state), "a.json");
    assert_true(json_number(stats, "seconds") >= 0.2);
    assert_true(json_number(stats, "seconds") < 20.0);
    json_decref(stats);
}

/* ---- Comparing and looking ------------------------------------------------------------------------------------- */

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
    assert_says(r.output, "would detect        a bias of ");
    assert_says(r.output, " % in a typical block (5 % significance, 80 % power; ");
    json_t *root = load_json(folder_of(state), "a.json");
    const json_t *images = json_object_get(root, "images");
    assert_int_equal(json_array_size(images), 3);
    const json_t *a = json_array_get(images, 0), *b = json_array_get(images, 1), *c = json_array_get(images, 2);
    assert_true(json_number(a, "rmse") == 0.0);
    assert_true(json_number(b, "rmse") > 0.0 && json_number(b, "rmse") < json_number(c, "rmse"));
    assert_true(json_number(c, "relmse") > 0.0);
    assert_int_equal((int)json_number(b, "masked"), 16 + 32);
    assert_true(json_number(json_object_get(c, "block_test"), "rejected") > 0.0);
    assert_true(json_number(json_object_get(c, "block_test"), "blocks_with_noise") > 0.0);
    assert_true(json_number(json_object_get(c, "block_test"), "detectable_bias") > 0.0);
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
    assert_says(r.output, "median of 1 block)");
    /* Crops of films of other sizes: the same part, one that lies between pixels, and others. */
    RUN(&r, "render", "ball.xml", "-o", "part.exr", "--quiet", "--crop=4,4,12,12");
    assert_exit(&r, 0);
    RUN(&r, "render", "ball.xml", "-o", "good.exr", "--quiet", "--resolution=48x32", "--crop=8,8,24,24");
    RUN(&r, "render", "ball.xml", "-o", "odd.exr", "--quiet", "--resolution=48x32", "--crop=9,9,25,25");
    RUN(&r, "render", "ball.xml", "-o", "other.exr", "--quiet", "--resolution=48x32", "--crop=4,4,12,12");
    assert_exit(&r, 0);
    RUN(&r, "compare", "part.exr", "--reference", "good.exr", "--resample-reference");
    assert_exit(&r, 0);
    RUN(&r, "compare", "part.exr", "--reference", "odd.exr", "--resample-reference");
    assert_exit(&r, 1);
    assert_says(r.errors, "16 x 16 pixels from (9, 9) of a film of 48 x 32 cannot be averaged by 2 x 2");
    RUN(&r, "compare", "part.exr", "--reference", "other.exr");
    assert_exit(&r, 1);
    assert_says(r.errors, "part.exr: the image and the reference are different parts of the picture: 8 x 8 pixels "
                          "from (4, 4) of a film of 24 x 16, and from (4, 4) of one of 48 x 32");
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_help_and_version),
        PROGRAM_TEST(test_help_and_version_as_words),
        PROGRAM_TEST(test_one_is_singular),
        PROGRAM_TEST(test_help_lists_the_integrators),
        PROGRAM_TEST(test_wrong_usage),
        PROGRAM_TEST(test_empty_names),
        PROGRAM_TEST(test_wrong_numbers_in_the_environment),
        PROGRAM_TEST(test_failures_of_the_world),
        PROGRAM_TEST(test_full_disk_of_standard_output),
        PROGRAM_TEST(test_file_size_limit),
        PROGRAM_TEST(test_default_outputs),
        PROGRAM_TEST(test_statistics_and_quiet),
        PROGRAM_TEST(test_warnings),
        PROGRAM_TEST(test_options_of_integrators),
        PROGRAM_TEST(test_strategies),
        PROGRAM_TEST(test_file_of_crop_and_resolution),
        PROGRAM_TEST(test_ends_by_noise_and_time),
        PROGRAM_TEST(test_compare),
        PROGRAM_TEST(test_compare_sizes),
        PROGRAM_TEST(test_info),
    };
    return run_program_tests("command line", tests, sizeof tests / sizeof tests[0]);
}
