/* `caustica study` from outside: what is rendered and what is kept, what is refused and where, and the analysis to
 * the last digit. The page is for test_study_page.sh. */
#define _POSIX_C_SOURCE 200809L
#include "support/program_test.h"

#include <math.h>
#include <stdlib.h>

/* Two scenarios of the ball in `ball.xml`; each line stands for itself in the errors. */
static const char study_text[] =
    "{\n"
    "  \"title\": \"balls\",\n"
    "  \"question\": \"Was there a difference?\",\n"
    "  \"seconds\": 0.5,\n"
    "  \"image\": { \"spp\": 1 },\n"
    "  \"reference\": { \"integrator\": \"path:max_depth=3\", \"spp\": 2, \"seed\": 3 },\n"
    "  \"scenarios\": [\n"
    "    { \"name\": \"seen\", \"scene\": \"ball.xml\", \"light\": \"visible\", \"pair\": \"p\" },\n"
    "    { \"name\": \"hidden\", \"scene\": \"ball.xml\", \"light\": \"occluded\", \"pair\": \"p\", \"define\": { "
    "\"albedo\": \"0.3\" } }\n"
    "  ]\n"
    "}\n";

/* The text with the first `from` replaced. */
static void write_changed(void **state, const char *name, const char *text, const char *from, const char *to)
{
    static char changed[16384];
    const char *at = strstr(text, from);
    if (!at) fail_msg("no \"%s\" to change", from);
    snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, to, at + strlen(from));
    write_text(folder_of(state), name, changed);
}

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

static const char *const images[] = {"images/seen-image.exr", "images/seen-reference.exr", "images/hidden-image.exr",
                                     "images/hidden-reference.exr"};

/* Runs the study; bit i: image i was rendered, not kept. */
static int rendered(void **state)
{
    ca_program_result r;
    int bits = 0;
    RUN(&r, "study", "study.json", "-o", "out");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_says(r.output, "wrote out/index.html");
    for (int i = 0; i < 4; i++) {
        char done[128], kept[128];
        snprintf(done, sizeof done, "rendered out/%s", images[i]);
        snprintf(kept, sizeof kept, "there is out/%s", images[i]);
        if (!strstr(r.output, done) == !strstr(r.output, kept))
            fail_msg("%s: rendered or kept?\n%s", images[i], r.output);
        bits |= (strstr(r.output, done) != NULL) << i;
    }
    return bits;
}

/* What an image will lack is said with its name. */
static void test_warnings(void **state)
{
    ca_program_result r;
    write_changed(state, "study.json", study_text, "\"spp\": 1", "\"integrator\": \"bdpm:radius=1000\", \"spp\": 1");
    RUN(&r, "study", "study.json", "-o", "out");
    assert_exit(&r, 0);
    assert_says(r.errors, "caustica: warning: out/images/seen-image.exr: a merge radius of 1000 reaches beyond the");
    assert_says(r.errors, "caustica: warning: out/images/hidden-image.exr: a merge radius of 1000 reaches beyond");
    if (strstr(r.errors, "reference.exr")) fail_msg("%s", r.errors);
}

static void test_renders_what_is_missing(void **state)
{
    char path[256];
    write_text(folder_of(state), "study.json", study_text);
    assert_int_equal(rendered(state), 15);
    assert_int_equal(rendered(state), 0);
    snprintf(path, sizeof path, "%s/out/images/seen-image.exr", folder_of(state));
    assert_int_equal(remove(path), 0);
    assert_int_equal(rendered(state), 1);
    write_text(folder_of(state), "out/images/hidden-image.exr", "no image");
    assert_int_equal(rendered(state), 4);
    write_changed(state, "study.json", study_text, "\"seed\": 3", "\"seed\": 4");
    assert_int_equal(rendered(state), 2 + 8);
    write_changed(state, "study.json", study_text, "\"seed\": 3", "\"seed\": 4, \"sampler\": \"halton\"");
    assert_int_equal(rendered(state), 2 + 8);
    write_changed(state, "study.json", study_text, "\"spp\": 1", "\"spp\": 4");
    assert_int_equal(rendered(state), 15);
    write_changed(state, "ball.xml", scene_text, "radius\" value=\"3\"",
                  "radius\" value=\"2\""); /* the scene counts too */
    assert_int_equal(rendered(state), 15);
}

/* The image is the one that `caustica render` makes with these settings. */
static void test_renders_the_same(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "study.json", study_text);
    rendered(state);
    RUN(&r, "render", "ball.xml", "-o", "own.exr", "-i", "path:max_depth=3", "--spp=2", "--seed=3", "-D",
        "albedo=0.3", "--quiet");
    assert_exit(&r, 0);
    ca_image_layers *a = read_image(state, "own.exr"), *b = read_image(state, "out/images/hidden-reference.exr");
    for (const char *const *c = (const char *const[]){"R", "G", "B", NULL}; *c; c++)
        assert_memory_equal(ca_layers_find(a, *c), ca_layers_find(b, *c), a->width * a->height * sizeof(float));
    ca_layers_destroy(a);
    ca_layers_destroy(b);
}

/* ---- What is refused ------------------------------------------------------------------------------------------- */

typedef struct change {
    const char *from, *to, *says;
} change;

static void test_bad_configs(void **state)
{
    static const change cases[] = {
        {"\"title\": \"balls\",", "", "bad.json:1:1: a study needs \"title\""},
        {"\"question\"", "\"qestion\"", "bad.json:3:3: a study has no \"qestion\"; did you mean \"question\"?"},
        {"0.5", "0", "bad.json:4:14: \"seconds\": expected a number from 0.1 to 600"},
        {"0.5", "\"5\"", "bad.json:4:14: \"seconds\": expected a number from 0.1 to 600"},
        {"0.5", "0.5, \"seconds\": 5", "bad.json:4:"},
        {"0.5", "0.5, \"screens\": 1.0", "bad.json:4:30: \"screens\": expected a whole number from 1 to 2"},
        {"0.5", "0.5, \"width\": 4", "bad.json:4:28: a study has both \"width\" and \"height\""},
        {"0.5", "0.5, \"sides\": \"left\"", "bad.json:4:28: \"sides\": expected \"random\" or \"reference-left\""},
        {"0.5", "0.5, \"viewing_distance_m\": 0.05, \"magnify\": 16",
         "bad.json:4:41: expected a \"viewing_distance_m\""},
        {"\"spp\": 1 ", "\"spp\": true ", "bad.json:5:21: \"spp\": expected a whole number from 1 to 4294967295"},
        {"{ \"spp\": 1 }", "[1]", "bad.json:5:12: \"image\": expected an object"},
        {"path:", "pth:", "bad.json:6:32: \"integrator\": "},
        {"path:max_depth=3", "path:foo=1",
         "bad.json:6:32: \"integrator\": integrator \"path\" has no parameter \"foo\""},
        {"path:max_depth=3", "path:max_depth=-2", "bad.json:6:32: \"integrator\": \"max_depth\" must be"},
        {"\"albedo\"", "\"albedo\": \"0.2\", \"foo\"",
         "bad.json:9:116: \"foo\" of scenario hidden: the scene has no default of that name; the nearest is albedo"},
        {"\"albedo\"", "\"al bedo\"",
         "bad.json:9:103: \"al bedo\" of scenario hidden: a name has letters, digits and underscores only"},
        {"\"seed\": 3", "\"seed\": 0", "bad.json:6:70: \"seed\": expected another one"},
        {"\"seed\": 3", "\"sampler\": \"dice\"", "bad.json:6:73: \"sampler\": expected one of independent"},
        {"\"spp\": 2,", "", "bad.json:6:16: \"reference\" needs \"spp\""},
        {"\"hidden\"", "\"seen\"", "bad.json:9:15: \"name\": there is already a scenario \"seen\""},
        {"\"hidden\"", "\"a/b\"", "bad.json:9:15: \"name\": expected at most 64 letters"},
        {"\"occluded\"", "\"dark\"", "\"light\": expected \"visible\" or \"occluded\""},
        {"\"occluded\"", "\"visible\"", "\"pair\": scenario \"seen\" is already the visible one of pair \"p\""},
        {", \"pair\": \"p\" }", " }", "bad.json:8:53: a scenario has both \"light\" and \"pair\""},
        {"\"0.3\"", "0.3", "\"albedo\": expected a text in quotes"},
        {"{ \"name\": \"seen\"", "7, { \"name\": \"seen\"", "bad.json:8:5: expected a scenario: an object"},
        {"\"title\"", "\"t\\u00fc\": {\"\u00fc\": [] }, \"title\"", "bad.json:2:3: a study has no"},
        {"}\n", "", "bad.json:9:112: this is not JSON"},
        {"\"p\" },", "\"p\" }", "bad.json:9:5: this is not JSON"},
    };
    ca_program_result r;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        write_changed(state, "bad.json", study_text, cases[i].from, cases[i].to);
        RUN(&r, "study", "bad.json", "-o", "out");
        if (r.exit_status != 1) fail_msg("\"%s\": exit status %d\n%s", cases[i].to, r.exit_status, r.errors);
        assert_says(r.errors, cases[i].says);
        assert_false(exists(folder_of(state), "out"));
    }
    write_changed(state, "bad.json", study_text, "ball.xml", "missing.xml");
    RUN(&r, "study", "bad.json", "-o", "out");
    assert_exit(&r, 1);
    assert_says(r.errors, "missing.xml");
}

static void test_wrong_usage(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "study.json", study_text);
    RUN(&r, "study", "-o", "out");
    assert_wrong_usage(&r, "the study's file is missing");
    RUN(&r, "study", "study.json");
    assert_wrong_usage(&r, "--output is missing");
    RUN(&r, "study", "study.json", "-oout", "--stats=a.json");
    assert_wrong_usage(&r, "--stats needs --analyse");
    RUN(&r, "study", "--analyse");
    assert_wrong_usage(&r, "a file of answers is missing");
    RUN(&r, "study", "study.json", "-o", "study.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "this is not a folder");
    assert_int_equal(setenv("CAUSTICA_SCENE_MEMORY", "4G", 1), 0);
    RUN(&r, "study", "study.json", "-o", "out");
    assert_wrong_usage(&r, "CAUSTICA_SCENE_MEMORY in the environment (MiB): \"4G\" is not a number above 0");
    assert_int_equal(setenv("CAUSTICA_SCENE_MEMORY", "0.001", 1), 0);
    RUN(&r, "study", "study.json", "-o", "out");
    assert_int_equal(unsetenv("CAUSTICA_SCENE_MEMORY"), 0);
    assert_exit(&r, 1);
    assert_says(r.errors, "CAUSTICA_SCENE_MEMORY=MIB");
}

/* ---- Analysis -------------------------------------------------------------------------------------------------- */

enum { SCENARIOS = 4 };
static const char *const names[SCENARIOS] = {"va", "oa", "vb", "ob"};

/* Writes a file of answers. Each subject is a text: its name, a colon and a letter for each scenario: y, n; Y, N for
 * an answer of images that were shown too long; d for one that was disturbed; - for none. With a final ! the session
 * is not finished. */
static void write_answers(void **state, const char *file, const char *id, const char *const *subjects)
{
    static char text[32768];
    size_t used = (size_t)snprintf(
        text, sizeof text,
        "{\"format\":\"caustica study answers\",\"version\":1,\"study\":{\"id\":\"%s\",\"title\":\"T\","
        "\"question\":\"Q?\",\"seconds\":5,\"scenarios\":[\n",
        id);
    for (int k = 0; k < SCENARIOS; k++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "%s{\"name\":\"%s\",\"light\":\"%s\",\"pair\":\"%c\",\"flip\":0.%d}", k ? ",\n" : "",
                                 names[k], names[k][0] == 'v' ? "visible" : "occluded", names[k][1], k + 1);
    used += (size_t)snprintf(text + used, sizeof text - used, "]},\"sessions\":[");
    for (size_t i = 0; subjects[i]; i++) {
        const char *letters = strchr(subjects[i], ':') + 1;
        const int length = (int)(letters - subjects[i]) - 1;
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "%s\n{\"subject\":\"%.*s\",\"session\":\"of %.*s\",\"finished\":%s,\"trials\":[",
                                 i ? "," : "", length, subjects[i], length, subjects[i],
                                 strchr(letters, '!') ? "false" : "true");
        const char *comma = "";
        for (int k = 0; k < SCENARIOS; k++) {
            if (letters[k] == '-') continue;
            used +=
                (size_t)snprintf(text + used, sizeof text - used,
                                 "%s\n{\"scenario\":\"%s\",\"shown_ms\":%s,\"disturbed\":\"%s\",\"difference\":%s}",
                                 comma, names[k], strchr("YN", letters[k]) ? "5050.01" : "5049.9",
                                 letters[k] == 'd' ? "hidden" : "", strchr("yY", letters[k]) ? "true" : "false");
            comma = ",";
        }
        used += (size_t)snprintf(text + used, sizeof text - used, "]}");
    }
    snprintf(text + used, sizeof text - used, "]}\n");
    write_text(folder_of(state), file, text);
}

static const json_t *item(const json_t *root, const char *list, size_t index)
{
    return json_array_get(json_object_get(root, list), index);
}

static void check_ratio(const json_t *root, size_t index, int yes, int total, int left_out, double low, double high)
{
    const json_t *s = item(root, "scenarios", index);
    assert_true(json_number(s, "yes") == yes && json_number(s, "answers") == total &&
                json_number(s, "left_out") == left_out);
    assert_true(json_number(s, "ratio") == (double)yes / total);
    assert_true(fabs(json_number(s, "low") - low) < 1e-6 && fabs(json_number(s, "high") - high) < 1e-6);
}

static void test_analysis(void **state)
{
    ca_program_result r;
    write_answers(state, "1.json", "s",
                  (const char *const[]){"a:nyny", "b:nyyy", "c:nyyn", "d:ynny", "e:nn-y!", NULL});
    write_answers(state, "2.json", "s",
                  (const char *const[]){"f:nynn", "g:nydy", "h:nyYy", "c:nyyn", "e:---n!", "i:yynn", "j:nynn", NULL});
    RUN(&r, "study", "--analyse", "1.json", "2.json", "--stats", "a.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "2.json:"); /* e has answered otherwise */
    assert_says(r.errors, "this session has other answers in 1.json");
    write_answers(state, "2.json", "s",
                  (const char *const[]){"f:nynn", "g:nydy", "h:nyYy", "c:nyyn", "e:nn-y!", "i:yynn", "j:nynn", NULL});
    RUN(&r, "study", "--analyse", "1.json", "2.json", "--stats", "a.json");
    assert_exit(&r, 0);
    json_t *root = load_json(folder_of(state), "a.json");
    assert_true(json_number(root, "subjects") == 9 && json_number(root, "unfinished") == 1 &&
                json_number(root, "left_out") == 2);
    check_ratio(root, 0, 2, 9, 0, 0.02814497, 0.60009357); /* binom.test(2, 9) of R */
    check_ratio(root, 1, 8, 9, 0, 0.51750351, 0.99719086);
    check_ratio(root, 2, 2, 7, 2, 0.03669257, 0.70957914);
    check_ratio(root, 3, 5, 9, 0, 0.21200849, 0.86300343);
    const json_t *a = item(root, "pairs", 0), *b = item(root, "pairs", 1), *all = json_object_get(root, "all_pairs");
    assert_true(json_number(a, "only_occluded") == 7 && json_number(a, "only_visible") == 1 &&
                json_number(a, "both") == 1);
    assert_true(json_number(a, "neither") == 0);
    assert_true(fabs(json_number(a, "p_more") - 9.0 / 256.0) < 1e-12 &&
                fabs(json_number(a, "p_two_sided") - 18.0 / 256.0) < 1e-12);
    assert_true(json_number(b, "only_occluded") == 2 && json_number(b, "only_visible") == 1 &&
                json_number(b, "both") == 1);
    assert_true(json_number(b, "neither") == 3 && fabs(json_number(b, "p_more") - 0.5) < 1e-12);
    assert_true(json_number(all, "more") == 6 && json_number(all, "fewer") == 0 && json_number(all, "as_many") == 3);
    assert_true(fabs(json_number(all, "p_more") - 1.0 / 64.0) < 1e-12);
    assert_says(r.output, "oa        8 of 9            0.889  0.518 to 0.997  0.2000");
    assert_says(r.output, "Clopper-Pearson");
    assert_says(r.output, "left out: 1 session not finished");
    assert_says(r.output, "left out: 2 answers");
    json_decref(root);
}

static void test_bad_answers(void **state)
{
    ca_program_result r;
    write_answers(state, "1.json", "s", (const char *const[]){"a:nyny", NULL});
    write_answers(state, "2.json", "other", (const char *const[]){"b:nyny", NULL});
    RUN(&r, "study", "--analyse", "1.json", "2.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "2.json:1:56: these answers are of another study (other) than those of 1.json (s)");
    write_answers(state, "2.json", "s", (const char *const[]){"b:nyny", "b2:nnnn!", NULL});
    RUN(&r, "study", "--analyse", "2.json");
    assert_exit(&r, 0);
    write_answers(state, "2.json", "s", (const char *const[]){"b:nyny!", NULL});
    RUN(&r, "study", "--analyse", "2.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "there is no session that was finished");
    write_text(folder_of(state), "3.json",
               "{\"format\": \"answers\",\n \"version\": 1, \"study\": {}, \"sessions\": []}");
    RUN(&r, "study", "--analyse", "3.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "3.json:1:12: \"format\": expected \"caustica study answers\"");
    write_text(folder_of(state), "3.json", "[1,\n2,]");
    RUN(&r, "study", "--analyse", "3.json");
    assert_exit(&r, 1);
    assert_says(r.errors, "3.json:2:3: this is not JSON");
}

/* The bundled study is a good one: its scenes are there, and are read. */
static void test_bundled_study(void **state)
{
    static char text[8192];
    ca_program_result r;
    FILE *file = fopen(CA_SOURCE_DIR "/scenes/perceptual-study/study.json", "rb");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    char *spp = strstr(text, "\"spp\": 5000");
    assert_non_null(spp);
    memcpy(spp, "\"spp\": 2   ", strlen("\"spp\": 5000"));
    spp = strstr(text, "\"spp\": 75");
    memcpy(spp, "\"spp\": 1 ", strlen("\"spp\": 75"));
    char *magnify = strstr(text, "\"magnify\": 2,");
    static char small[8192];
    snprintf(small, sizeof small, "%.*s\"width\": 20, \"height\": 20, %s", (int)(magnify - text), text, magnify);
    char command[512];
    snprintf(command, sizeof command, "cp " CA_SOURCE_DIR "/scenes/perceptual-study/*.xml '%s'", folder_of(state));
    assert_int_equal(system(command), 0);
    write_text(folder_of(state), "study.json", small);
    RUN(&r, "study", "study.json", "-o", "out/", "--quiet");
    assert_exit(&r, 0);
    assert_string_equal(r.output, "");
    assert_true(exists(folder_of(state), "out/images/occluded-mixed-reference.exr"));
    assert_true(exists(folder_of(state), "out/index.html"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_warnings),
        PROGRAM_TEST(test_renders_what_is_missing),
        PROGRAM_TEST(test_renders_the_same),
        PROGRAM_TEST(test_bad_configs),
        PROGRAM_TEST(test_wrong_usage),
        PROGRAM_TEST(test_analysis),
        PROGRAM_TEST(test_bad_answers),
        PROGRAM_TEST(test_bundled_study),
    };
    return run_program_tests("cli_study", tests, sizeof tests / sizeof tests[0]);
}
