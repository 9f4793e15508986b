/* `caustica converge` from outside: what it writes, what it does not render twice, what it refuses, and how it ends
 * early. */
#define _XOPEN_SOURCE 700
#include "support/program_test.h"

#include <dirent.h>
#include <expat.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define CONVERGE "converge", "ball.xml", "--reference=ref.exr", "-o", "out"

static int set_up_reference(void **state)
{
    if (set_up(state) != 0) return -1;
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "--quiet", "--spp=64", "--seed=77", "-o", "ref.exr");
    return r.exit_status;
}

#define REFERENCE_TEST(function) cmocka_unit_test_setup_teardown(function, set_up_reference, tear_down)

/* ---- Looking at files ------------------------------------------------------------------------------------------ */

static char *read_text(void **state, const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder_of(state), name);
    FILE *file = fopen(path, "rb");
    if (!file) fail_msg("no file %s", name);
    char *text = calloc(1, 1 << 20);
    assert_non_null(text);
    assert_true(fread(text, 1, (1 << 20) - 1, file) > 0);
    assert_int_equal(fclose(file), 0);
    return text;
}

static void assert_file_says(void **state, const char *name, const char *words)
{
    char *text = read_text(state, name);
    assert_says(text, words);
    free(text);
}

static void assert_svg(void **state, const char *name)
{
    char *text = read_text(state, name);
    XML_Parser parser = XML_ParserCreate("UTF-8");
    if (XML_Parse(parser, text, (int)strlen(text), 1) != XML_STATUS_OK)
        fail_msg("%s: %s", name, XML_ErrorString(XML_GetErrorCode(parser)));
    XML_ParserFree(parser);
    assert_says(text, "slope ");
    if (strstr(text, "nan")) fail_msg("%s has a place that is no number", name);
    free(text);
}

/* Files in out/renders with these letters in their names; the newest change of any of them, in nanoseconds. */
static int count_renders(void **state, const char *letters, double *newest)
{
    char path[600];
    int count = 0;
    snprintf(path, sizeof path, "%s/out/renders", folder_of(state));
    DIR *folder = opendir(path);
    *newest = 0.0;
    for (struct dirent *e; folder && (e = readdir(folder)) != NULL;) {
        struct stat info;
        if (e->d_name[0] == '.' || !strstr(e->d_name, letters)) continue;
        snprintf(path, sizeof path, "%s/out/renders/%.255s", folder_of(state), e->d_name);
        if (stat(path, &info) != 0) continue;
        *newest = fmax(*newest, 1e9 * (double)info.st_mtim.tv_sec + (double)info.st_mtim.tv_nsec);
        count++;
    }
    if (folder) closedir(folder);
    return count;
}

static int count_words(const char *text, const char *words)
{
    int count = 0;
    for (; (text = strstr(text, words)) != NULL; text += strlen(words)) count++;
    return count;
}

static const json_t *render_of(const json_t *root, size_t i)
{
    return json_array_get(json_object_get(root, "renders"), i);
}

static const char *text_of(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    if (!text) fail_msg("no text \"%s\"", key);
    return text;
}

/* ---- What comes out -------------------------------------------------------------------------------------------- */

static void test_writes_results(void **state)
{
    ca_program_result r;
    RUN(&r, CONVERGE, "-i", "path;bdpt:max_depth=3,rr_depth=4", "--spp=1:4", "--repeats=2", "--closeup=2,3,10,12",
        "--threads=1");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_says(r.output, "12 of 12: bdpt:max_depth=3,rr_depth=4, 4 spp, repeat 2: ");
    assert_says(r.output, "wrote out/index.html\n");
    static const char *const pictures[] = {"out/pictures/reference.png", "out/pictures/path-1.png",
                                           "out/pictures/path-deviation.png", "out/pictures/path-deviation-1.png",
                                           "out/images.html"};
    for (size_t i = 0; i < sizeof pictures / sizeof pictures[0]; i++)
        if (!exists(folder_of(state), pictures[i])) fail_msg("no %s", pictures[i]);
    ca_image_layers *closeup = read_image(state, "out/pictures/path-1.png");
    assert_true(closeup->width == 8 && closeup->height == 9);
    ca_layers_destroy(closeup);
    assert_svg(state, "out/error-time.svg");
    assert_svg(state, "out/error-samples.svg");
    assert_file_says(state, "out/index.html", "bdpt:max_depth=3,rr_depth=4");
    char *csv = read_text(state, "out/renders.csv");
    assert_int_equal(count_words(csv, "\n"), 13);
    assert_int_equal(count_words(csv, "\"bdpt:max_depth=3,rr_depth=4\",4,"), 2);
    free(csv);
}

/* One result that cannot be written does not keep the others from it. */
static void test_writes_the_others(void **state)
{
    static const char *const results[] = {"out/renders.csv", "out/converge.json", "out/index.html"};
    ca_program_result r;
    char path[600];
    RUN(&r, CONVERGE, "-i", "path", "--spp=1:2", "--threads=1");
    assert_exit(&r, 0);
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder_of(state), results[i]);
        assert_int_equal(unlink(path), 0);
    }
    snprintf(path, sizeof path, "%s/out/pictures/reference.png", folder_of(state));
    assert_true(unlink(path) == 0 && mkdir(path, 0700) == 0); /* a file cannot replace a folder */
    RUN(&r, CONVERGE, "-i", "path", "--spp=1:2", "--threads=1");
    assert_exit(&r, 1);
    assert_says(r.errors, "out/pictures/reference.png: cannot write");
    for (int i = 0; i < 3; i++)
        if (!exists(folder_of(state), results[i])) fail_msg("no %s", results[i]);
}

/* What is read is not written over. */
static void test_reference_among_the_pictures(void **state)
{
    ca_program_result r;
    char folder[160];
    snprintf(folder, sizeof folder, "%s/over", folder_of(state));
    assert_int_equal(mkdir(folder, 0777), 0);
    snprintf(folder, sizeof folder, "%s/over/pictures", folder_of(state));
    assert_int_equal(mkdir(folder, 0777), 0);
    RUN(&r, "render", "ball.xml", "-o", "over/pictures/reference.png", "--quiet");
    assert_exit(&r, 0);
    RUN(&r, "converge", "ball.xml", "-i", "path", "--spp=1", "-r", "over/pictures/reference.png", "-o", "over");
    assert_int_equal(r.exit_status, 2);
    assert_says(r.errors, "over/pictures/reference.png");
    assert_false(exists(folder_of(state), "over/index.html"));
}

/* What `auto` took is told wherever its renders are, and again when they are there already. */
static void test_tells_what_auto_took(void **state)
{
    ca_program_result r;
    RUN(&r, CONVERGE, "-i", "auto;path", "--spp=2,4");
    assert_exit(&r, 0);
    json_t *root = load_json(folder_of(state), "out/converge.json");
    char words[160], name[16] = "";
    const char *method = text_of(render_of(root, 0), "method");
    snprintf(name, sizeof name, "%.*s", (int)strcspn(method, ":"), method);
    assert_string_not_equal(name, "auto");
    assert_int_equal(strncmp(text_of(render_of(root, 1), "method"), "path:", 5), 0);
    snprintf(words, sizeof words, ", by %s\n", name);
    assert_says(r.output, words);
    assert_int_equal(count_words(r.output, ", by "), 2); /* not of path */
    char *csv = read_text(state, "out/renders.csv");
    snprintf(words, sizeof words, "auto-2spp-1.exr,\"%s:", name);
    assert_says(csv, words);
    free(csv);
    snprintf(words, sizeof words, "<p><b>auto</b> took %s in ", name);
    assert_file_says(state, "out/index.html", words);
    RUN(&r, CONVERGE, "-i", "auto;path", "--spp=2,4");
    snprintf(words, sizeof words, ", by %s (kept)\n", name);
    assert_says(r.output, words);
    json_decref(root);
}

/* The numbers are those of other commands for the same image; random numbers are those of the render. */
static void test_numbers(void **state)
{
    char file[128], seed[64];
    ca_program_result r;
    RUN(&r, CONVERGE, "-ipath", "-i", "bdpt", "--spp=2,3,8", "--quiet", "--roi=2,2,22,14", "--mask=5,5,7,7");
    assert_exit(&r, 0);
    assert_string_equal(r.output, "");
    json_t *root = load_json(folder_of(state), "out/converge.json");
    assert_int_equal(json_array_size(json_object_get(root, "renders")), 6);
    const json_t *last = render_of(root, 4);
    assert_string_equal(text_of(last, "integrator"), "path");
    assert_true(json_number(last, "step") == 8 && json_number(last, "samples_per_pixel") == 8);
    snprintf(file, sizeof file, "out/%s", text_of(last, "file"));
    RUN(&r, "compare", file, "-rref.exr", "--stats=c.json", "--roi=2,2,22,14", "--mask=5,5,7,7");
    assert_exit(&r, 0);
    json_t *compared = load_json(folder_of(state), "c.json");
    static const char *const keys[] = {"rmse", "mae",      "relmse",   "smape",
                                       "ssim", "flip_ldr", "flip_hdr", "mean_luminance"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++)
        assert_true(json_number(json_array_get(json_object_get(compared, "images"), 0), keys[i]) ==
                    json_number(last, keys[i]));
    json_decref(compared);
    snprintf(seed, sizeof seed, "--seed=%.0f", json_number(last, "seed"));
    RUN(&r, "render", "ball.xml", "-ipath", "--spp=8", seed, "-o", "same.exr", "--stats=s.json", "--quiet");
    assert_exit(&r, 0);
    ca_image_layers *a = read_image(state, file), *b = read_image(state, "same.exr");
    assert_memory_equal(ca_layers_find(a, "R"), ca_layers_find(b, "R"), sizeof(float) * a->width * a->height);
    json_t *stats = load_json(folder_of(state), "s.json");
    assert_true(fabs(json_number(stats, "mean_standard_deviation") - json_number(last, "mean_standard_deviation")) <
                1e-6);
    assert_true(json_number(last, "seed") != json_number(render_of(root, 0), "seed")); /* of another step */
    assert_true(json_number(last, "seed") == json_number(render_of(root, 5), "seed")); /* of another integrator */
    json_decref(stats);
    ca_layers_destroy(a);
    ca_layers_destroy(b);
    json_decref(root);
}

/* Slopes are those of the renders' numbers. */
static void test_slopes(void **state)
{
    ca_program_result r;
    RUN(&r, CONVERGE, "-ipath", "--spp=1:64:4", "--quiet");
    assert_exit(&r, 0);
    json_t *root = load_json(folder_of(state), "out/converge.json");
    double n = 4.0, sx = 0.0, sy = 0.0, xx = 0.0, xy = 0.0;
    for (size_t i = 0; i < 4; i++) {
        const double x = log(json_number(render_of(root, i), "samples_per_pixel")),
                     y = log(json_number(render_of(root, i), "relmse"));
        sx += x, sy += y, xx += x * x, xy += x * y;
    }
    const double slope = (n * xy - sx * sy) / (n * xx - sx * sx);
    const json_t *slopes = json_object_get(json_array_get(json_object_get(root, "integrators"), 0), "slopes");
    const json_t *fit = json_object_get(json_object_get(slopes, "relmse"), "samples");
    assert_true(fabs(json_number(fit, "exponent") - slope) < 1e-9);
    assert_true(json_number(fit, "low") < slope && slope < json_number(fit, "high"));
    assert_true(slope < -0.5 && slope > -1.5);
    json_decref(root);
}

/* ---- Not rendered again ---------------------------------------------------------------------------------------- */

/* Runs again; how many renders were taken as they were, of how many. */
static int run_again(void **state, const char *word, const char *second, const char *third, int *all)
{
    ca_program_result r;
    RUN(&r, CONVERGE, "-ipath;bdpt", word, second, third);
    assert_exit(&r, 0);
    *all = count_words(r.output, ", relMSE ");
    return count_words(r.output, " (kept)\n");
}

static void test_resumes(void **state)
{
    int all;
    double first, second;
    assert_int_equal(run_again(state, "--spp=1,4", "--repeats=2", NULL, &all), 0);
    assert_int_equal(all, 8);
    char *before = read_text(state, "out/converge.json");
    assert_int_equal(count_renders(state, ".exr", &first), 8);
    assert_int_equal(run_again(state, "--spp=1,4", "--repeats=2", NULL, &all), 8);
    assert_int_equal(count_renders(state, ".exr", &second), 8);
    assert_true(first == second); /* untouched */
    char *after = read_text(state, "out/converge.json");
    assert_string_equal(before, after);
    free(before);
    /* A step between, one after, and another repeat: what was there stays. */
    assert_int_equal(run_again(state, "--spp=1:8", "--repeats=3", NULL, &all), 8);
    assert_int_equal(all, 24);
    /* Another reference: measured anew, not rendered. */
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "--quiet", "--spp=16", "--seed=5", "-o", "ref.exr");
    assert_exit(&r, 0);
    assert_int_equal(run_again(state, "--spp=1,4", "--repeats=2", NULL, &all), 8);
    char *other = read_text(state, "out/converge.json");
    assert_string_not_equal(after, other);
    free(after);
    free(other);
}

static void test_renders_what_changed(void **state)
{
    int all;
    char path[256];
    ca_program_result r;
    assert_int_equal(run_again(state, "--spp=1,4", NULL, NULL, &all), 0);
    assert_int_equal(run_again(state, "--spp=1,4", "--seed=9", NULL, &all), 0);
    assert_int_equal(run_again(state, "--spp=1,4", "--seed=9", "-Dalbedo=0.6", &all), 0);
    assert_int_equal(run_again(state, "--spp=1,4", "--seed=9", "-Dalbedo=0.6", &all), 4);
    write_text(folder_of(state), "ball.xml", scene_text); /* the same text: nothing changed */
    assert_int_equal(run_again(state, "--spp=1,4", "--seed=9", "-Dalbedo=0.6", &all), 4);
    char *edited = strdup(scene_text);
    memcpy(strstr(edited, "value=\"3\"/>\n    <bsdf"), "value=\"2\"", 9);
    write_text(folder_of(state), "ball.xml", edited);
    free(edited);
    RUN(&r, CONVERGE, "-ipath;bdpt", "--spp=1,4", "--seed=9", "-Dalbedo=0.6");
    assert_exit(&r, 0);
    assert_int_equal(count_words(r.output, " (kept)\n"), 0);
    assert_says(r.output, "path-1spp-1.exr: made with \"scene ");
    /* A damaged file, and one of somebody else. */
    snprintf(path, sizeof path, "%s/out/renders/path-1spp-1.exr", folder_of(state));
    assert_int_equal(truncate(path, 500), 0);
    snprintf(path, sizeof path, "cp %s/ref.exr %s/out/renders/bdpt-4spp-1.exr", folder_of(state), folder_of(state));
    assert_int_equal(system(path), 0);
    RUN(&r, CONVERGE, "-ipath;bdpt", "--spp=1,4", "--seed=9", "-Dalbedo=0.6");
    assert_exit(&r, 0);
    assert_int_equal(count_words(r.output, " (kept)\n"), 2);
    assert_says(r.output, "bdpt-4spp-1.exr: not of this command, rendered anew");
    assert_int_equal(count_words(r.output, "rendered anew"), 2);
}

/* However much of a file was written when the machine went down. */
static void test_half_written_files(void **state)
{
    ca_program_result r;
    char path[256], copy[300];
    struct stat info;
    RUN(&r, CONVERGE, "-ipath", "--spp=1,4");
    assert_exit(&r, 0);
    snprintf(path, sizeof path, "%s/out/renders/path-4spp-1.exr", folder_of(state));
    snprintf(copy, sizeof copy, "%s.Half42", path); /* as it is called while it is written */
    assert_int_equal(stat(path, &info), 0);
    for (int part = 0; part <= 4; part++) {
        assert_int_equal(part < 4 ? truncate(path, info.st_size * part / 4 - (part == 3)) : rename(path, copy), 0);
        RUN(&r, CONVERGE, "-ipath", "--spp=1,4");
        assert_exit(&r, 0);
        assert_int_equal(count_words(r.output, " (kept)\n"), 1);
        assert_int_equal(count_words(r.output, "rendered anew"), part < 4);
        RUN(&r, CONVERGE, "-ipath", "--spp=1,4");
        assert_int_equal(count_words(r.output, " (kept)\n"), 2);
    }
}

/* ---- Ending early ---------------------------------------------------------------------------------------------- */

static void wait_for_render(void **state, const char *letters)
{
    double newest;
    const struct timespec moment = {.tv_nsec = 5000000};
    for (int i = 0; i < 4000 && count_renders(state, letters, &newest) == 0; i++) nanosleep(&moment, NULL);
    assert_true(count_renders(state, letters, &newest) > 0);
}

static void test_ends_early_and_goes_on(void **state)
{
    ca_program_result r;
    double newest;
    const char *const words[] = {CONVERGE, "-ipath;bdpt", "--time=0.1:0.8", NULL};
    const pid_t process = ca_program_start(*state, words, -1);
    wait_for_render(state, "path-0.2s");
    assert_int_equal(kill(process, SIGINT), 0);
    ca_program_finish(*state, process, &r);
    assert_exit(&r, 1);
    assert_says(r.errors, "renders; the same command goes on from there");
    const int done = count_words(r.output, ", relMSE ");
    assert_true(done >= 3 && done < 8);
    assert_int_equal(count_renders(state, "", &newest), done); /* nothing half written */
    json_t *root = load_json(folder_of(state), "out/converge.json");
    assert_true(json_is_false(json_object_get(root, "complete")));
    assert_int_equal(json_array_size(json_object_get(root, "renders")), done / 2 * 2); /* complete steps */
    json_decref(root);
    RUN(&r, CONVERGE, "-ipath;bdpt", "--time=0.1:0.8");
    assert_exit(&r, 0);
    assert_int_equal(count_words(r.output, ", relMSE "), 8);
    assert_int_equal(count_words(r.output, " (kept)\n"), done);
    root = load_json(folder_of(state), "out/converge.json");
    assert_true(json_is_true(json_object_get(root, "complete")) && json_number(root, "equal_time_seconds") == 0.8);
    for (size_t i = 0; i < 8; i++) /* ends after the pass in which the time is reached */
        assert_true(json_number(render_of(root, i), "seconds") >= json_number(render_of(root, i), "step"));
    const json_t *path = json_array_get(json_object_get(root, "integrators"), 0);
    assert_string_equal(text_of(path, "equal_time"), "renders/path-0.8s-1.exr");
    json_decref(root);
}

/* ---- Refusals -------------------------------------------------------------------------------------------------- */

static void test_refuses(void **state)
{
    static const struct {
        const char *words[4];
        const char *says;
    } cases[] = {
        {{"--spp=1"}, "integrators are missing"},
        {{"-ipath"}, "steps are missing: --spp or --time"},
        {{"-ipath", "--spp=1", "--time=1"}, "only one of --spp and --time"},
        {{"-ipath", "--spp=4,2"}, "--spp: \"4,2\" are no steps: rising whole numbers"},
        {{"-ipath", "--spp=1.5"}, "are no steps"},
        {{"-ipath", "--spp=0:4"}, "are no steps"},
        {{"-ipath", "--spp=1:8:1"}, "are no steps"},
        {{"-ipath", "--spp=1:2:3:4"}, "are no steps"},
        {{"-ipath", "--spp=8:1"}, "are no steps"},
        {{"-ipath", "--spp=1,"}, "are no steps"},
        {{"-ipath", "--spp=1:8:1.5"}, "are no steps"},
        {{"-ipath", "--time=1,1.0000000000001"}, "are no steps"},
        {{"-ipath", "--time=1:1.5:1.0001"}, "are more than 64 steps"},
        {{"-ipath;pat", "--spp=1"}, "--integrator: "},
        {{"-ipath;bdpt;path", "--spp=1"}, "\"path\" is there twice"},
        {{"-ipath:max_dept=3", "--spp=1"}, "max_depth"},
        {{"-ipath", "--spp=1", "--resolution=48x32"}, "ref.exr has 24 x 16 pixels, but 48 x 32 are rendered"},
        {{"-ipath", "--spp=1", "--crop=0,0,8,8"}, "but 8 x 8 are rendered"},
        {{"-ipath", "--spp=1", "--closeup=20,10,30,16"}, "--closeup 20,10,30,16 reaches out"},
        {{"-ipath", "--spp=1", "--roi=20,10,30,16"}, "reaches out of the 24 x 16 pixels"},
        {{"-ipath", "--spp=1", "--sampler=halton-plain", "--repeats=2"}, "all repeats would be equal"},
        {{"-ipath", "--spp=1", "--reprots=2"}, "did you mean --repeats"},
    };
    ca_program_result r;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *const *w = cases[i].words;
        RUN(&r, CONVERGE, w[0], w[1], w[2], w[3]);
        if (r.exit_status != 2) fail_msg("exit status %d with %s: %s", r.exit_status, w[1] ? w[1] : w[0], r.errors);
        assert_says(r.errors, cases[i].says);
        assert_string_equal(r.output, "");
        assert_false(exists(folder_of(state), "out")); /* found out before any work */
    }
    RUN(&r, "converge", "ball.xml", "-ipath", "--spp=1", "-oout");
    assert_wrong_usage(&r, "--reference is missing");
    RUN(&r, "converge", "ball.xml", "-ipath", "--spp=1", "-rref.exr");
    assert_wrong_usage(&r, "--output FOLDER");
    RUN(&r, "converge", "ball.xml", "-ipath", "--spp=1", "-rnone.exr", "-oout");
    assert_exit(&r, 1);
    assert_says(r.errors, "none.exr");
    RUN(&r, "converge", "ball.xml", "-ipath", "--spp=1", "-rref.exr", "-oball.xml");
    assert_exit(&r, 1);
    assert_says(r.errors, "ball.xml: this is not a folder");
    RUN(&r, "converge", "--help");
    assert_exit(&r, 0);
    assert_says(r.output, "Example: caustica converge ");
}

/* What the pictures of an integrator will lack is said once, however many there are. */
static void test_warnings(void **state)
{
    static const char text[] =
        "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'><lookat origin='0,4,0' "
        "target='0,0,0' up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' value='12'/><integer "
        "name='height' value='12'/></film></sensor><shape type='rectangle'><transform name='to_world'><rotate x='1' "
        "angle='-90'/></transform></shape><shape type='rectangle'><transform name='to_world'><scale value='9'/>"
        "<rotate x='1' angle='-90'/><translate y='1'/></transform><bsdf type='dielectric'/></shape><emitter "
        "type='directional'><vector name='direction' value='0,-1,0'/></emitter></scene>";
    ca_program_result r;
    write_text(folder_of(state), "water.xml", text);
    RUN(&r, "render", "water.xml", "-i", "ppm", "--quiet", "--spp=4", "-o", "water.exr");
    assert_int_equal(r.exit_status, 0);
    RUN(&r, "converge", "water.xml", "--reference=water.exr", "-o", "wet", "-i", "path", "-i", "ppm", "--spp=1,2",
        "--repeats=2");
    assert_int_equal(r.exit_status, 0);
    assert_int_equal(count_words(r.errors, "warning: path: \"path\" will find none or too little of"), 1);
    assert_int_equal(count_words(r.errors, "warning: ppm"), 0);
    RUN(&r, "converge", "water.xml", "--reference=water.exr", "-o", "wet", "-i", "path", "-i", "ppm", "--spp=1,2",
        "--repeats=2"); /* all of them are there */
    assert_int_equal(count_words(r.errors, "warning"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        REFERENCE_TEST(test_writes_results),
        REFERENCE_TEST(test_writes_the_others),
        REFERENCE_TEST(test_reference_among_the_pictures),
        REFERENCE_TEST(test_tells_what_auto_took),
        REFERENCE_TEST(test_numbers),
        REFERENCE_TEST(test_slopes),
        REFERENCE_TEST(test_resumes),
        REFERENCE_TEST(test_half_written_files),
        REFERENCE_TEST(test_renders_what_changed),
        REFERENCE_TEST(test_ends_early_and_goes_on),
        REFERENCE_TEST(test_refuses),
        PROGRAM_TEST(test_warnings),
    };
    return run_program_tests("cli_converge", tests, sizeof tests / sizeof tests[0]);
}
