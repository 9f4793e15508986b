/* `caustica compare` from outside: metrics, their settings, JSON, files of maps, and what it refuses. */
#include "support/named_layer.h"
#include "support/program_test.h"

#include <math.h>

#define BALL "render", "ball.xml", "--quiet", "--resolution=48x32", "--spp=8"

/* a and ref: the same ball, other noise; b: a brighter one. */
static int set_up_images(void **state)
{
    if (set_up(state) != 0) return -1;
    ca_program_result r;
    RUN(&r, BALL, "--seed=1", "-o", "a.exr", "-o", "a.png");
    if (r.exit_status == 0) RUN(&r, BALL, "--seed=2", "-D", "albedo=0.6", "-o", "b.exr");
    if (r.exit_status == 0) RUN(&r, BALL, "--seed=3", "-o", "ref.exr", "-o", "ref.png");
    return r.exit_status;
}

#define IMAGES_TEST(function) cmocka_unit_test_setup_teardown(function, set_up_images, tear_down)

static const json_t *image_of(const json_t *root, size_t i)
{
    return json_array_get(json_object_get(root, "images"), i);
}

static void assert_null_number(const json_t *object, const char *key)
{
    if (!json_is_null(json_object_get(object, key))) fail_msg("\"%s\" is not null", key);
}

/* The mean of a layer, but `margin` pixels at the border. */
static double mean_of(const ca_image_layers *maps, const char *name, uint32_t margin)
{
    const float *map = named_layer(maps, name);
    double sum = 0.0, count = 0.0;
    for (uint32_t y = margin; y < maps->height - margin; y++)
        for (uint32_t x = margin; x < maps->width - margin; x++, count++) sum += (double)map[y * maps->width + x];
    return sum / count;
}

static void assert_near(const char *what, double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        fail_msg("%s is %.9g, not %.9g +- %.2g", what, value, expected, tolerance);
}

/* ---- What comes out -------------------------------------------------------------------------------------------- */

static void test_same_random_numbers(void **state)
{
    ca_program_result r;
    RUN(&r, BALL, "--seed=3", "-D", "albedo=0.6", "-o", "c.exr");
    RUN(&r, "compare", "a.exr", "c.exr", "--reference=ref.exr", "--flip=none");
    assert_exit(&r, 0);
    const char *second = strstr(r.output, "c.exr\n"), *note = strstr(r.output, "both have the seed 3: the test");
    assert_true(second && note > second);
}

static void test_numbers_and_maps(void **state)
{
    ca_program_result r;
    RUN(&r, "compare", "a.exr", "b.exr", "--reference", "ref.exr", "--stats=s.json", "--maps=m.exr");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    static const char *const lines[] = {"\n  SMAPE ",     "\n  SSIM  ",       "\n  FLIP LDR  ",
                                        "\n  FLIP HDR  ", " exposures from ", "\n  wrote               m-a.exr\n",
                                        "m-b.exr\n"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) assert_says(r.output, lines[i]);
    json_t *root = load_json(folder_of(state), "s.json");
    for (size_t i = 0; i < 2; i++) {
        const json_t *numbers = image_of(root, i);
        ca_image_layers *maps = read_image(state, i == 0 ? "m-a.exr" : "m-b.exr");
        assert_near("mae", json_number(numbers, "mae"), mean_of(maps, "Error.MAE", 0), 1e-6);
        assert_near("relmse", json_number(numbers, "relmse"), mean_of(maps, "Error.relMSE", 0), 1e-6);
        assert_near("smape", json_number(numbers, "smape"), mean_of(maps, "Error.SMAPE", 0), 1e-6);
        assert_near("ssim", json_number(numbers, "ssim"), mean_of(maps, "SSIM", 5), 1e-6);
        assert_near("flip_ldr", json_number(numbers, "flip_ldr"), mean_of(maps, "FLIP.LDR", 0), 1e-6);
        assert_near("flip_hdr", json_number(numbers, "flip_hdr"), mean_of(maps, "FLIP.HDR", 0), 1e-6);
        assert_true(json_number(numbers, "flip") == json_number(numbers, "flip_hdr"));
        const json_t *exposures = json_object_get(numbers, "flip_exposures");
        assert_true(json_number(exposures, "count") >= 2 &&
                    json_number(exposures, "start") < json_number(exposures, "stop"));
        ca_layers_destroy(maps);
    }
    /* b is the brighter ball. */
    assert_true(json_number(image_of(root, 0), "ssim") > json_number(image_of(root, 1), "ssim"));
    assert_true(json_number(image_of(root, 0), "flip") < json_number(image_of(root, 1), "flip"));
    const json_t *settings = json_object_get(root, "settings");
    assert_true(json_number(settings, "ssim_window") == 11 && json_number(settings, "ssim_sigma") == 1.5 &&
                json_number(settings, "ssim_range") == 1.0 && json_number(settings, "exposure") == 0.0);
    assert_near("flip_ppd", json_number(settings, "flip_ppd"), 67.02064, 1e-5);
    assert_string_equal(json_string_value(json_object_get(settings, "tone")), "srgb");
    assert_string_equal(json_string_value(json_object_get(settings, "flip_tone")), "aces");
    json_decref(root);
}

static void test_names_of_maps(void **state)
{
    ca_program_result r;
    RUN(&r, "compare", "a.exr", "--reference", "ref.exr", "--maps=one.EXR", "--flip=none");
    assert_exit(&r, 0);
    assert_says(r.output, "wrote               one.EXR\n");
    /* Two of the same name. */
    RUN(&r, "compare", "a.exr", "./a.png", "--reference=ref.exr", "--maps=./two.exr", "--flip=none");
    assert_exit(&r, 0);
    assert_true(exists(folder_of(state), "two-1-a.exr") && exists(folder_of(state), "two-2-a.exr"));
    RUN(&r, "compare", "a.exr", "--reference=ref.exr", "--maps=ref.exr");
    assert_wrong_usage(&r, "--maps would overwrite ref.exr, which is to be compared");
    RUN(&r, "compare", "a.exr", "b.exr", "--reference=ref.exr", "--maps=m.png");
    assert_wrong_usage(&r, "only an .exr file can hold the maps");
    RUN(&r, "compare", "a.exr", "--reference=ref.exr", "--maps=no/where.exr");
    assert_exit(&r, 1);
    assert_says(r.errors, "no/where.exr");
}

/* ---- Settings -------------------------------------------------------------------------------------------------- */

enum { SSIM, FLIP_LDR, FLIP_HDR, FLIP, NUMBERS };

/* What compare says of a.exr with up to two words more; NAN where it is null. */
static void numbers_with(void **state, const char *word, const char *second, double numbers[NUMBERS])
{
    static const char *const keys[NUMBERS] = {"ssim", "flip_ldr", "flip_hdr", "flip"};
    ca_program_result r;
    RUN(&r, "compare", "a.exr", "-rref.exr", "--stats=s.json", word, second);
    assert_exit(&r, 0);
    json_t *root = load_json(folder_of(state), "s.json");
    for (int k = 0; k < NUMBERS; k++) {
        const json_t *value = json_object_get(image_of(root, 0), keys[k]);
        assert_non_null(value);
        numbers[k] = json_is_null(value) ? (double)NAN : json_number_value(value);
    }
    json_decref(root);
}

/* Each option changes the numbers it is for, and no others. */
static void test_options_reach_their_metrics(void **state)
{
    static const struct {
        const char *words[2];
        bool changes[3]; /* SSIM, FLIP LDR, FLIP HDR */
    } cases[] = {
        {{"--tone=reinhard", NULL}, {true, true, false}},       {{"--exposure=-1.5", NULL}, {true, true, false}},
        {{"--tone=aces", "--exposure=1"}, {true, true, false}}, {{"--ssim-window=7", NULL}, {true, false, false}},
        {{"--ssim-sigma=3", NULL}, {true, false, false}},       {{"--ssim-range=2", NULL}, {true, false, false}},
        {{"--ssim-k1=0.1", NULL}, {true, false, false}},        {{"--ssim-k2=0.1", NULL}, {true, false, false}},
        {{"--flip-ppd=30", NULL}, {false, true, true}},         {{"--flip-tone=srgb", NULL}, {false, false, true}},
        {{"--flip-start=0", NULL}, {false, false, true}},       {{"--flip-stop=2", NULL}, {false, false, true}},
        {{"--flip-exposures=1", NULL}, {false, false, true}},   {{"--threads=3", NULL}, {false, false, false}},
    };
    double plain[NUMBERS], numbers[NUMBERS];
    numbers_with(state, NULL, NULL, plain);
    assert_true(plain[FLIP] == plain[FLIP_HDR]);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        numbers_with(state, cases[i].words[0], cases[i].words[1], numbers);
        for (int k = 0; k < FLIP; k++)
            if ((numbers[k] != plain[k]) != cases[i].changes[k])
                fail_msg("number %d with %s: %.9g, without %.9g", k, cases[i].words[0], numbers[k], plain[k]);
    }
}

static void test_kinds_of_flip(void **state)
{
    double both[NUMBERS], numbers[NUMBERS];
    numbers_with(state, "--flip=both", NULL, both);
    assert_true(both[FLIP_LDR] != both[FLIP_HDR] && both[FLIP] == both[FLIP_HDR]);
    numbers_with(state, "--flip=ldr", NULL, numbers);
    assert_true(numbers[FLIP] == both[FLIP_LDR] && numbers[FLIP_LDR] == both[FLIP_LDR] && isnan(numbers[FLIP_HDR]));
    numbers_with(state, "--flip=hdr", NULL, numbers);
    assert_true(numbers[FLIP] == both[FLIP_HDR] && numbers[FLIP_HDR] == both[FLIP_HDR] && isnan(numbers[FLIP_LDR]));
    numbers_with(state, "--flip=none", NULL, numbers);
    assert_true(isnan(numbers[FLIP]) && numbers[SSIM] == both[SSIM]);
    /* 8 bit files show nothing brighter than a display. */
    ca_program_result r;
    RUN(&r, "compare", "a.png", "--reference=ref.png", "--stats=p.json");
    assert_exit(&r, 0);
    assert_null(strstr(r.output, "HDR"));
    json_t *root = load_json(folder_of(state), "p.json");
    assert_true(json_number(image_of(root, 0), "flip") == json_number(image_of(root, 0), "flip_ldr"));
    assert_null_number(image_of(root, 0), "flip_hdr");
    assert_null_number(image_of(root, 0), "flip_exposures");
    assert_near("flip of 8 bits", json_number(image_of(root, 0), "flip"), both[FLIP_LDR], 0.01);
    json_decref(root);
    RUN(&r, "compare", "a.png", "--reference=ref.png", "--flip=hdr");
    assert_exit(&r, 0);
    assert_says(r.output, "FLIP HDR");
}

static void test_region_and_masks(void **state)
{
    ca_program_result r;
    RUN(&r, "compare", "a.exr", "--reference=ref.exr", "--roi=0,0,30,20", "--mask=0,0,30,19", "--maps=m.exr",
        "--stats=s.json");
    assert_exit(&r, 0);
    ca_image_layers *maps = read_image(state, "m.exr");
    double ssim = 0.0, flip = 0.0;
    for (uint32_t x = 0; x < 30; x++) {
        flip += (double)ca_layers_find(maps, "FLIP.HDR")[19 * 48 + x] / 30.0;
        if (x >= 5) ssim += (double)ca_layers_find(maps, "SSIM")[19 * 48 + x] / 25.0;
    }
    json_t *root = load_json(folder_of(state), "s.json");
    assert_near("flip", json_number(image_of(root, 0), "flip"), flip, 1e-9);
    assert_near("ssim", json_number(image_of(root, 0), "ssim"), ssim, 1e-9);
    json_decref(root);
    ca_layers_destroy(maps);
    /* All of it is nearer than half a window to the border. */
    RUN(&r, "compare", "a.exr", "--reference=ref.exr", "--roi=0,0,5,32", "--stats=s.json");
    assert_exit(&r, 0);
    assert_says(r.output, "SSIM                not done");
    root = load_json(folder_of(state), "s.json");
    assert_null_number(image_of(root, 0), "ssim");
    json_decref(root);
}

/* File names may be any bytes, JSON not: what is no UTF-8 is replaced. */
static void test_names_that_are_no_utf8(void **state)
{
    ca_program_result r;
    RUN(&r, BALL, "-o", "M\xfcller \xc3\xa4.exr");
    assert_exit(&r, 0);
    RUN(&r, "compare", "M\xfcller \xc3\xa4.exr", "--reference=M\xfcller \xc3\xa4.exr", "--stats=s.json",
        "--flip=none");
    assert_exit(&r, 0);
    json_t *root = load_json(folder_of(state), "s.json");
    const char *expected = "M\xef\xbf\xbdller \xc3\xa4.exr";
    assert_string_equal(json_string_value(json_object_get(root, "reference")), expected);
    assert_string_equal(json_string_value(json_object_get(image_of(root, 0), "path")), expected);
    json_decref(root);
}

/* A reference that is mostly black has no exposure that shows its median. */
static void test_a_dark_reference(void **state)
{
    ca_program_result r;
    RUN(&r, BALL, "-D", "albedo=0", "-o", "dark.exr");
    assert_exit(&r, 0);
    RUN(&r, "compare", "a.exr", "--reference=dark.exr", "--stats=s.json");
    assert_exit(&r, 0);
    assert_says(r.output, "FLIP HDR            not done");
    assert_says(r.output, "  would detect        light where the reference is black, as it is in a typical block (");
    json_t *root = load_json(folder_of(state), "s.json");
    assert_null_number(image_of(root, 0), "flip");
    assert_true(json_number(image_of(root, 0), "flip_ldr") > 0.0);
    json_decref(root);
    RUN(&r, "compare", "a.exr", "--reference=dark.exr", "--flip-start=-1", "--flip-stop=2");
    assert_exit(&r, 0);
    assert_says(r.output, "(3 exposures from -1 to 2 stops)");
    RUN(&r, "compare", "a.exr", "--reference=dark.exr", "--roi=23,15,25,17", "--flip=none");
    assert_exit(&r, 0);
    assert_says(r.output, ", of the reference 0\n");
}

static void test_refusals(void **state)
{
    static const struct {
        const char *word, *second, *says;
    } cases[] = {
        {"--tone=filmic", NULL, "--tone: \"filmic\" is not a tone curve: srgb, aces, hable, reinhard, linear"},
        {"--flip-tone=x", NULL, "--flip-tone: \"x\" is not a tone curve"},
        {"--flip-tone=linear", NULL, "--flip-tone: no exposure can be chosen for linear"},
        {"--flip=sdr", NULL, "--flip: \"sdr\" is not one of ldr, hdr, both, none"},
        {"--ssim-window=10", NULL, "--ssim-window: 10 is not odd"},
        {"--ssim-window=0", NULL, "--ssim-window: \"0\" is not a whole number"},
        {"--ssim-sigma=0", NULL, "--ssim-sigma"},
        {"--flip-ppd=0.5", NULL, "--flip-ppd: 0.5 is not from 1 to 10000"},
        {"--flip-start=3", "--flip-stop=2", "--flip-start 3 is after --flip-stop 2"},
        {"--flip-start=-1e300", NULL, "--flip-start: -1e+300 is not from -300 to 300"},
        {"--exposure=301", NULL, "--exposure: 301 is not from -300 to 300"},
        {"--stats=./ref.exr", NULL, "--stats would overwrite ./ref.exr, which is to be compared"},
        {"--html=a.exr", NULL, "--html would overwrite a.exr, which is to be compared"},
        {"--threads=2000", NULL, "2000 threads are over the limit"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_program_result r;
        RUN(&r, "compare", "a.exr", "--reference=ref.exr", cases[i].word, cases[i].second);
        assert_wrong_usage(&r, cases[i].says);
        assert_string_equal(r.output, "");
    }
    ca_program_result r;
    RUN(&r, "compare", "a.exr", "--reference=ref.exr", "--flip-start=40");
    assert_exit(&r, 1);
    assert_says(r.errors, "a.exr: FLIP's exposures start at 40 stops, after their stop at");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        IMAGES_TEST(test_numbers_and_maps), IMAGES_TEST(test_same_random_numbers),  IMAGES_TEST(test_names_of_maps),
        IMAGES_TEST(test_options_reach_their_metrics), IMAGES_TEST(test_kinds_of_flip),
        IMAGES_TEST(test_region_and_masks),  IMAGES_TEST(test_names_that_are_no_utf8),
        IMAGES_TEST(test_a_dark_reference),
        IMAGES_TEST(test_refusals),
    };
    return run_program_tests("compare", tests, sizeof tests / sizeof tests[0]);
}
