/* `caustica noise` from outside: layers, averages and counts that fit together, predictions against other
 * measurements, what it refuses. Recommended numbers: test_cli_noise_recommend.c. */
#include "support/noise_program.h"

/* ---- What comes out -------------------------------------------------------------------------------------------- */

static const struct term {
    const char *layer, *rms, *variance, *negative;
} terms[] = {
    {"Noise.Camera", "camera", "camera_variance", "camera"},
    {"Noise.Light", "light", "light_variance", "light"},
    {"Noise.Pair", "pair", "pair_variance", "pair"},
    {"Noise.Predicted", "predicted_rms", "predicted_variance", "predicted"},
    {"Noise.Measured", "measured_rms", "measured_variance", "measured"},
};

/* The averages of --stats over a region against those of the layers. */
static void assert_averages(const json_t *averages, const ca_image_layers *image, const uint32_t region[4])
{
    const double count = (region[2] - region[0]) * (region[3] - region[1]);
    assert_true(json_number(averages, "pixels") == count);
    for (size_t t = 0; t < sizeof terms / sizeof terms[0]; t++) {
        const float *data = named_layer(image, terms[t].layer);
        double sum = 0.0, roots = 0.0, negative = 0.0;
        for (uint32_t y = region[1]; y < region[3]; y++)
            for (uint32_t x = region[0]; x < region[2]; x++) {
                const double v = (double)data[y * WIDTH + x];
                sum += v / count;
                roots += sqrt(fmax(0.0, v)) / count;
                negative += v < 0.0;
            }
        assert_near(terms[t].variance, json_number(averages, terms[t].variance), sum, 1e-6 * fabs(sum) + 1e-12);
        assert_near(terms[t].rms, json_number(averages, terms[t].rms), roots, 1e-6 * roots);
        assert_true(json_number(json_object_get(averages, "negative"), terms[t].negative) == negative);
    }
}

static void assert_layers(const ca_image_layers *image)
{
    const float *camera = named_layer(image, "Noise.Camera"), *light = named_layer(image, "Noise.Light"),
                *pair = named_layer(image, "Noise.Pair"), *predicted = named_layer(image, "Noise.Predicted"),
                *measured = named_layer(image, "Noise.Measured"),
                *deviation = named_layer(image, "StandardDeviation.Y");
    double most_negative = 0.0;
    for (int i = 0; i < PIXELS; i++) {
        const double sum = (double)camera[i] + (double)light[i] + (double)pair[i];
        assert_near("the sum of the terms", (double)predicted[i], sum, 1e-5 * fabs(sum));
        /* The film, in single precision, has seen the same iterations. */
        const double film = (double)deviation[i] * (double)deviation[i];
        assert_near("the film's variance", (double)measured[i], film, 1e-4 * film);
        most_negative = fmin(most_negative, (double)camera[i]);
    }
    assert_true(most_negative < 0.0);
    for (size_t t = 0; t < sizeof terms / sizeof terms[0]; t++) {
        char name[64];
        snprintf(name, sizeof name, "%s.StdErr", terms[t].layer);
        const float *error = named_layer(image, name);
        for (int i = 0; i < PIXELS; i++) assert_true(isfinite(error[i]) && error[i] > 0.0f);
    }
}

/* Red, green and blue of the picture against the roots of the layers: only what is brighter than full is cut off. */
static void assert_picture(const ca_image_layers *image, const ca_image_layers *picture, double scale)
{
    static const char *const channels[] = {"R", "G", "B"}, *const layers[] = {"Noise.Pair", "Noise.Camera",
                                                                              "Noise.Light"};
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < PIXELS; i++) {
            const double root = sqrt(fmax(0.0, (double)named_layer(image, layers[c])[i])) / scale;
            assert_near(channels[c], (double)named_layer(picture, channels[c])[i], fmin(1.0, root), 0.01);
        }
}

static void test_what_comes_out(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", ROOM, COUNTS(60, 5, 40), "--roi=3,4,9,8", "--predict=600,5", "--predict", "60,50", "-o", "a.exr",
        "-oa.png", "--stats=a.json");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_says(r.output, "sampler: independent instead of the scene's sobol");
    assert_says(r.output, "integrator: bdpm instead of the scene's path");
    assert_says(r.output, "40 iterations of 60 light paths and 5 camera paths per pixel, 96 pixels");
    assert_says(r.output, "  with 600,5: image r.m.s. ");
    assert_says(r.output, "  with 60,50: image r.m.s. ");
    assert_says(r.output, "wrote a.exr\nwrote a.png (full red");
    ca_image_layers *image = read_image(state, "a.exr"), *picture = read_image(state, "a.png");
    assert_layers(image);
    double scale = 0.0;
    assert_int_equal(sscanf(strstr(r.output, "term of r.m.s. "), "term of r.m.s. %lf", &scale), 1);
    assert_picture(image, picture, scale);
    json_t *root = load_json(folder_of(state), "a.json");
    const json_t *predict = json_object_get(root, "predict");
    assert_averages(json_object_get(root, "image"), image, (const uint32_t[]){0, 0, WIDTH, HEIGHT});
    assert_averages(json_object_get(root, "roi"), image, (const uint32_t[]){3, 4, 9, 8});
    assert_true(json_number(root, "iterations") == 40 && json_number(root, "light_paths") == 40 * 60 &&
                json_number(root, "camera_paths") == 40 * 5 * PIXELS &&
                json_number(root, "samples_per_pixel") == 200);
    assert_true(json_number(json_object_get(root, "per_iteration"), "light_paths") == 60 &&
                json_number(json_object_get(root, "per_iteration"), "camera_paths") == 5);
    assert_int_equal(json_array_size(predict), 2);
    assert_recommendation(root, image, "mean", r.output);
    const json_t *given = json_object_get(json_object_get(root, "recommendation"), "given");
    const double predicted = json_number(json_object_get(root, "image"), "predicted_variance");
    assert_true(json_number(given, "light_paths") == 60 && json_number(given, "camera_paths") == 5);
    /* What choosing makes of estimates below zero moves it a little. */
    assert_near("the variance given", json_number(given, "variance"), predicted, 0.1 * predicted);
    const json_t *second = json_array_get(predict, 1);
    assert_true(json_number(second, "light_paths") == 60 && json_number(second, "camera_paths") == 50);
    /* Ten times the camera paths: a tenth of the pair and camera terms. */
    for (int t = 0; t < 3; t += 2)
        assert_near(terms[t].variance, json_number(json_object_get(second, "roi"), terms[t].variance),
                    json_number(json_object_get(root, "roi"), terms[t].variance) / 10, 1e-9);
    json_decref(root);
    ca_image_release(image);
    ca_image_release(picture);
}

static void test_threads_and_quiet(void **state)
{
    ca_program_result r;
    static const char *const threads[] = {"--threads=1", "--threads=3"}, *const files[] = {"1.exr", "3.exr"};
    ca_image_layers *images[2];
    for (int i = 0; i < 2; i++) {
        RUN(&r, "noise", "room.xml", "--radius=0.5", COUNTS(50, 3, 6), threads[i], "--quiet", "-o", files[i]);
        assert_exit(&r, 0);
        assert_string_equal(r.output, "");
        images[i] = read_image(state, files[i]);
    }
    assert_int_equal(images[0]->channel_count, images[1]->channel_count);
    for (size_t c = 0; c < images[0]->channel_count; c++)
        if (strcmp(images[0]->channels[c].name, CA_RAY_MAP_LAYER) != 0) /* that depends on times */
            assert_memory_equal(images[0]->channels[c].data, images[1]->channels[c].data, PIXELS * sizeof(float));
    ca_image_release(images[0]);
    ca_image_release(images[1]);
}

/* ---- The law --------------------------------------------------------------------------------------------------- */

/* Of every pixel, and of the averages: one run's scatter of these is 0.7 %. */
static void assert_law_holds(void **state, const char *integrator)
{
    ca_program_result r;
    RUN(&r, "noise", ROOM, COUNTS(400, 4, 400), "-i", integrator, "--quiet", "-o", "a.exr", "--stats=a.json");
    assert_exit(&r, 0);
    ca_image_layers *image = read_image(state, "a.exr");
    const float *predicted = named_layer(image, "Noise.Predicted"), *measured = named_layer(image, "Noise.Measured");
    const float *error = named_layer(image, "Noise.Predicted.StdErr"),
                *error2 = named_layer(image, "Noise.Measured.StdErr");
    for (int i = 0; i < PIXELS; i++)
        assert_near(integrator, (double)predicted[i], (double)measured[i],
                    4.5 * hypot((double)error[i], (double)error2[i]));
    ca_image_release(image);
    json_t *root = load_json(folder_of(state), "a.json");
    const json_t *averages = json_object_get(root, "image");
    const double rms = json_number(averages, "measured_rms");
    assert_near(integrator, json_number(averages, "predicted_rms"), rms, 0.03 * rms);
    json_decref(root);
}

static void test_law_holds(void **state)
{
    static const char *const integrators[] = {"bdpm", "bdpm:merges=last", "bdpm:camera_diffuse_depth=0", "ppm"};
    for (int i = 0; i < 4; i++) assert_law_holds(state, integrators[i]);
}

/* What is predicted for other numbers is measured with them. */
static void test_predictions(void **state)
{
    ca_program_result r;
    static const char *const counts[][2] = {{"--light-paths=2000", "--camera-paths=2"},
                                            {"--light-paths=100", "--camera-paths=20"},
                                            {"--light-paths=1000", "--camera-paths=1"}};
    RUN(&r, "noise", ROOM, COUNTS(400, 4, 1000), "--quiet", "--predict=2000,2", "--predict=100,20",
        "--predict=1000,1", "--stats=a.json");
    assert_exit(&r, 0);
    json_t *root = load_json(folder_of(state), "a.json");
    for (size_t i = 0; i < 3; i++) {
        RUN(&r, "noise", ROOM, counts[i][0], counts[i][1], "--iterations=400", "--seed=1", "--quiet",
            "--stats=b.json");
        assert_exit(&r, 0);
        json_t *other = load_json(folder_of(state), "b.json");
        const json_t *predicted = json_object_get(json_array_get(json_object_get(root, "predict"), i), "image");
        const double rms = json_number(json_object_get(other, "image"), "measured_rms");
        assert_near(counts[i][0], json_number(predicted, "predicted_rms"), rms, 0.04 * rms);
        json_decref(other);
    }
    json_decref(root);
}

static void test_one_camera_path(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", ROOM, COUNTS(100, 1, 20), "--predict=50,1", "-o", "a.exr", "--stats=a.json");
    assert_exit(&r, 0);
    ca_image_layers *image = read_image(state, "a.exr");
    for (int i = 0; i < PIXELS; i++) {
        assert_true(named_layer(image, "Noise.Light")[i] == 0.0f &&
                    named_layer(image, "Noise.Light.StdErr")[i] == 0.0f);
        assert_true(named_layer(image, "Noise.Predicted")[i] > 0.0f);
    }
    ca_image_release(image);
    RUN(&r, "noise", ROOM, COUNTS(100, 1, 20), "--predict=50,2");
    assert_exit(&r, 2);
    assert_says(r.errors,
                "--predict: from one camera path the noise of 2 cannot be predicted: measure with --camera-paths 2 "
                "or more");
}

/* ---- Settings -------------------------------------------------------------------------------------------------- */

static void assert_integrator(void **state, const char *words)
{
    ca_image_layers *image = read_image(state, "a.exr");
    assert_says(attribute_text(image, "caustica.integrator"), words);
    ca_image_release(image);
}

/* One radius unless it is asked for otherwise; the scene's depth, and its bdpm with what it sets, stay. */
static void test_integrator_and_alpha(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", ROOM, COUNTS(20, 2, 2), "-oa.exr");
    assert_exit(&r, 0);
    assert_integrator(state, "bdpm:max_depth=4,");
    assert_integrator(state, ",alpha=0,");
    RUN(&r, "noise", ROOM, COUNTS(20, 2, 2), "-oa.exr", "-ibdpm:alpha=0.25");
    assert_exit(&r, 0);
    assert_integrator(state, ",alpha=0.25,");
    RUN(&r, "noise", ROOM, COUNTS(20, 2, 2), "-oa.exr", "--alpha=0.75", "-Dintegrator=ppm", "-Dsampler=independent");
    assert_exit(&r, 0);
    assert_integrator(state, "ppm:max_depth=4,");
    assert_integrator(state, ",alpha=0.75");
    assert_null(strstr(r.output, "instead"));
    RUN(&r, "noise", ROOM, COUNTS(20, 2, 2), "-oa.exr", "--alpha=0.75", "-ibdpm:alpha=0.5");
    assert_exit(&r, 2);
}

static void test_crop(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", ROOM, COUNTS(20, 2, 3), "--resolution=24x16", "--crop=4,6,10,9", "--roi=5,6,10,9", "-oa.exr",
        "--stats=a.json");
    assert_exit(&r, 0);
    assert_says(r.output, "3 iterations of 20 light paths and 2 camera paths per pixel, 18 pixels");
    ca_image_layers *image = read_image(state, "a.exr");
    assert_true(image->width == 6 && image->height == 3 && image->x0 == 4 && image->y0 == 6);
    json_t *root = load_json(folder_of(state), "a.json");
    double sum = 0.0;
    for (int i = 0; i < 18; i++)
        if (i % 6 > 0) sum += (double)named_layer(image, "Noise.Predicted")[i] / 15;
    assert_near("predicted", json_number(json_object_get(root, "roi"), "predicted_variance"), sum, 1e-6 * fabs(sum));
    json_decref(root);
    ca_image_release(image);
}

static const struct refusal {
    int exit_status;
    const char *words[9]; /* ended by NULL, after `noise` */
    const char *says;
} refusals[] = {
    {2,
     {"room.xml", COUNTS(20, 2, 3), "--objective=median"},
     "--objective: the objective \"median\" is not known; there are mean,"},
    {2,
     {"room.xml", "-ippm", "--predict=20,2"},
     "--predict: from one camera path the noise of 2 cannot be predicted: measure with"},
    {2, {COUNTS(20, 2, 3)}, "a scene file is missing"},
    {2, {"room.xml", "room.xml", COUNTS(20, 2, 3)}, "more than one scene file"},
    {2, {"room.xml", COUNTS(20, 2, 1)}, "--iterations: \"1\" is not a whole number of at least 2"},
    {2, {"room.xml", COUNTS(1, 2, 2)}, "--light-paths: \"1\" is not a whole number of at least 2"},
    {2, {"room.xml", COUNTS(20, 0, 2)}, "--camera-paths: \"0\" is not"},
    {2, {"room.xml", COUNTS(20, 1000000000, 5)}, "5 iterations of 1000000000 camera paths are over the limit of 4"},
    {2,
     {"room.xml", COUNTS(20, 2, 2), "--roi=4,0,13,8"},
     "--roi: the region 4,0,13,8 is empty or leaves the picture 0,0,12,8"},
    {2, {"room.xml", COUNTS(20, 2, 2), "--crop=2,2,8,8", "--roi=1,2,8,8"}, "leaves the picture 2,2,8,8"},
    {2, {"room.xml", COUNTS(20, 2, 2), "--predict=20"}, "--predict: \"20\" is not NF,NB"},
    {2, {"room.xml", COUNTS(20, 2, 2), "--predict=0,2"}, "--predict: \"0,2\" is not NF,NB"},
    {2, {"room.xml", COUNTS(20, 2, 2), "--predict=2,-1"}, "--predict: \"2,-1\" is not NF,NB"},
    {2,
     {"room.xml", COUNTS(20, 2, 2), "-i", "path"},
     "the integrator must be bdpt, ppm, bdpm, vcm, ovcm or vavcm, not path"},
    {2, {"room.xml", COUNTS(20, 2, 2), "-i", "bdmp"}, "bdmp"},
    {2, {"room.xml", COUNTS(20, 2, 2), "-i", "bdpm:light_paths=30"}, "\"light_paths\" is 30 among"},
    {2, {"room.xml", COUNTS(20, 2, 2), "--sampler=sobol"}, "option --sampler=sobol is not known"},
    {2, {"room.xml", COUNTS(20, 2, 2), "--memory=0.01"}, "more than the 0.0 MiB allowed"},
    {2,
     {"room.xml", COUNTS(20, 2, 2), "-oa.pfm"},
     "a.pfm: noise is written as .exr (all layers) or .png (the terms)"},
    {1, {"room.xml", COUNTS(20, 2, 2), "-ono/such/folder.exr"}, "no/such/folder.exr"},
    {1, {"room.xml", COUNTS(20, 2, 2), "--stats=no/such/folder.json"}, "no/such/folder.json"},
    {1, {"none.xml", COUNTS(20, 2, 2)}, "none.xml"},
};

static void test_refusals(void **state)
{
    for (size_t i = 0; i < sizeof refusals / sizeof refusals[0]; i++) {
        const struct refusal *c = &refusals[i];
        ca_program_result r;
        RUN(&r, "noise", c->words[0], c->words[1], c->words[2], c->words[3], c->words[4], c->words[5], c->words[6]);
        assert_exit(&r, c->exit_status);
        assert_says(r.errors, c->says);
        assert_string_equal(r.output, "");
    }
}

static void test_help(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", "--help");
    assert_exit(&r, 0);
    assert_says(r.output, "Example: caustica noise");
    assert_says(r.output, "--predict NF,NB");
    RUN(&r, "--help");
    assert_says(r.output, "  noise ");
}

static void test_warnings(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", "room.xml", "-i", "bdpm", "--radius=1000", "--iterations=2", "--quiet");
    assert_exit(&r, 0);
    assert_says(r.errors, "caustica: warning: a merge radius of 1000 reaches beyond the whole scene");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        ROOM_TEST(test_what_comes_out),
        ROOM_TEST(test_threads_and_quiet),
        ROOM_TEST(test_law_holds),
        ROOM_TEST(test_predictions),
        ROOM_TEST(test_one_camera_path),
        ROOM_TEST(test_integrator_and_alpha),
        ROOM_TEST(test_crop),
        ROOM_TEST(test_warnings),
        ROOM_TEST(test_refusals),
        ROOM_TEST(test_help),
    };
    return run_program_tests("the program: noise components", tests, sizeof tests / sizeof tests[0]);
}
