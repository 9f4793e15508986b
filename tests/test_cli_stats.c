/* What --stats says of a render: how it was made and what it took; null for what is not known. */
#include "base/processors.h"
#include "support/program_test.h"

static const char *json_text(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    if (!json_is_string(value)) fail_msg("no text \"%s\"", key);
    return json_string_value(value);
}

static void assert_unknown(const json_t *object, const char *key)
{
    if (!json_is_null(json_object_get(object, key))) fail_msg("\"%s\" is not null", key);
}

/* The parameters are those that the image's own record has, one by one. */
static void assert_parameters(json_t *parameters, const char *record)
{
    size_t count = 0;
    const char *key;
    json_t *value;
    json_object_foreach(parameters, key, value)
    {
        char text[160];
        if (json_is_string(value))
            snprintf(text, sizeof text, "%s=%s", key, json_string_value(value));
        else if (json_is_boolean(value))
            snprintf(text, sizeof text, "%s=%s", key, json_is_true(value) ? "true" : "false");
        else
            snprintf(text, sizeof text, "%s=%.9g", key, json_number_value(value));
        assert_says(record, text);
        count++;
    }
    for (; *record; record++) count -= *record == '=';
    assert_int_equal(count, 0);
}

/* Those of the command line, of the scene and the defaults. */
static void test_how_it_was_made(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "a.exr", "--stats=a.json", "-i", "ovcm:alpha=0.25,heuristic=power", "--spp=2",
        "--radius=0.125", "--seed=7", "--threads=2", "--sampler=halton", "--resolution=48x32", "--crop=8,4,29,9");
    assert_exit(&r, 0);
    json_t *stats = load_json(folder_of(state), "a.json");
    ca_image_layers *image = read_image(state, "a.exr");
    assert_string_equal(json_text(stats, "version"), ca_version());
    assert_string_equal(json_text(stats, "scene"), "ball.xml");
    assert_string_equal(json_text(stats, "sampler"), "halton");
    assert_int_equal((int)json_number(stats, "seed"), 7);
    assert_int_equal((int)json_number(stats, "threads"), 2);
    assert_int_equal((int)json_number(stats, "width"), 21);
    assert_int_equal((int)json_number(stats, "height"), 5);
    const json_t *integrator = json_object_get(stats, "integrator");
    json_t *parameters = json_object_get(integrator, "parameters");
    assert_string_equal(json_text(integrator, "name"), "ovcm");
    assert_int_equal((int)json_number(parameters, "max_depth"), 4); /* of the scene */
    assert_int_equal((int)json_number(parameters, "rr_depth"), 3);  /* default */
    assert_true(json_number(parameters, "alpha") == 0.25 && json_number(parameters, "radius") == 0.125);
    assert_string_equal(json_text(parameters, "heuristic"), "power");
    assert_true(json_is_false(json_object_get(parameters, "hide_emitters")));
    assert_parameters(parameters, ca_layers_attribute(image, "caustica.integrator")->text);
    ca_image_release(image);
    json_decref(stats);
}

/* A seed comes back with all its digits. */
/* What is read otherwise than written is said once on standard error, and in the statistics. */
static void test_notes(void **state)
{
    ca_program_result r;
    static const char scene[] =
        "<scene version=\"3.0.0\">\n<integrator type=\"volpath\"/><sensor type=\"perspective\">\n"
        "<sampler type=\"ldsampler\"/><film type=\"hdrfilm\"><integer name=\"width\" value=\"4\"/>"
        "<integer name=\"height\" value=\"4\"/></film></sensor><shape type=\"sphere\"/></scene>";
    static const char *const notes[] = {"noted.xml:3:1: sampler \"ldsampler\" is read as \"sobol\"",
                                        "noted.xml:2:1: integrator \"volpath\" is read as \"path\": there are no "
                                        "media"};
    write_text(folder_of(state), "noted.xml", scene);
    RUN(&r, "render", "noted.xml", "-o", "noted.exr", "--stats=noted.json", "--quiet");
    assert_exit(&r, 0);
    json_t *stats = load_json(folder_of(state), "noted.json");
    assert_int_equal(json_array_size(json_object_get(stats, "notes")), 2);
    for (size_t i = 0; i < 2; i++) {
        bool found = false;
        assert_says(r.errors, notes[i]);
        for (size_t k = 0; k < 2; k++)
            found |= strcmp(json_string_value(json_array_get(json_object_get(stats, "notes"), k)), notes[i]) == 0;
        assert_true(found);
    }
    json_decref(stats);
    RUN(&r, "info", "noted.xml");
    assert_exit(&r, 0);
    assert_says(r.errors, notes[0]);
}

static void test_large_seeds(void **state)
{
    static const char *const seeds[] = {"9007199254740992", "9007199254740993", "18446744073709551615"};
    for (int i = 0; i < 6; i++) {
        ca_program_result r;
        char seed[64];
        const char *const digits = seeds[i % 3], *const integrator = i < 3 ? "path" : "qmcppm";
        snprintf(seed, sizeof seed, "--seed=%s", digits);
        RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--stats=a.json", "--spp=1", seed, "-i", integrator);
        assert_exit(&r, 0);
        json_t *stats = load_json(folder_of(state), "a.json");
        if (i % 3 == 0)
            assert_true(json_integer_value(json_object_get(stats, "seed")) == 9007199254740992);
        else
            assert_string_equal(json_text(stats, "seed"), digits);
        json_decref(stats);
    }
}

static void test_nothing_is_made_up(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--stats=a.json", "--spp=1");
    assert_exit(&r, 0);
    json_t *stats = load_json(folder_of(state), "a.json");
    static const char *const unknown[] = {"mean_standard_deviation", "noise_percent", "blocks", "first_prediction",
                                          "numbers_of_rays"};
    for (size_t i = 0; i < sizeof unknown / sizeof unknown[0]; i++) assert_unknown(stats, unknown[i]);
    assert_int_equal((int)json_number(stats, "threads"), (int)ca_processors());
    json_decref(stats);
    RUN(&r, "render", "ball.xml", "-o", "a.pfm", "--stats=a.json", "--spp=2");
    assert_exit(&r, 0);
    stats = load_json(folder_of(state), "a.json");
    assert_true(json_number(stats, "mean_standard_deviation") > 0.0 && json_number(stats, "noise_percent") > 0.0);
    json_decref(stats);
}

/* Parts know how they were made; their sum as well, where there is an image. */
static void test_parts(void **state)
{
    static const char *const keys[] = {"version", "scene", "integrator", "sampler", "threads", "width", "height"};
    ca_program_result r;
    RUN(&r, "render", "ball.xml", "-i", "qmcppm", "--blocks=0:1", "-oa.part", "--seed=5", "--threads=1");
    assert_exit(&r, 0);
    RUN(&r, "render", "ball.xml", "-i", "qmcppm", "--blocks=1:3", "-ob.part", "--seed=5", "--stats=b.json");
    assert_exit(&r, 0);
    RUN(&r, "merge", "a.part", "b.part", "-o", "c.part", "-o", "c.pfm", "--stats=c.json");
    assert_exit(&r, 0);
    static const char *const files[] = {"b.json", "c.json"};
    for (int i = 0; i < 2; i++) {
        json_t *stats = load_json(folder_of(state), files[i]);
        assert_string_equal(json_text(json_object_get(stats, "integrator"), "name"), "qmcppm");
        assert_string_equal(json_text(stats, "sampler"), "halton");
        assert_int_equal((int)json_number(stats, "seed"), 5);
        assert_int_equal((int)json_number(stats, "width"), 24);
        if (i == 1) assert_int_equal((int)json_number(stats, "threads"), 1);
        json_decref(stats);
    }
    RUN(&r, "merge", "a.part", "b.part", "-o", "d.part", "--stats=d.json");
    assert_exit(&r, 0);
    json_t *stats = load_json(folder_of(state), "d.json");
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) assert_unknown(stats, keys[i]);
    assert_int_equal((int)json_number(stats, "seed"), 5);
    json_decref(stats);
}

/* What `noise` writes begins like what `render` writes. */
static void test_noise(void **state)
{
    ca_program_result r;
    RUN(&r, "noise", "ball.xml", "--light-paths=50", "--camera-paths=2", "--iterations=3", "--seed=3",
        "--stats=a.json");
    assert_exit(&r, 0);
    json_t *stats = load_json(folder_of(state), "a.json");
    const json_t *integrator = json_object_get(stats, "integrator");
    assert_string_equal(json_text(integrator, "name"), "bdpm");
    assert_int_equal((int)json_number(json_object_get(integrator, "parameters"), "light_paths"), 50);
    assert_string_equal(json_text(stats, "sampler"), "independent");
    assert_int_equal((int)json_number(stats, "seed"), 3);
    json_decref(stats);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_how_it_was_made), PROGRAM_TEST(test_large_seeds), PROGRAM_TEST(test_nothing_is_made_up),
        PROGRAM_TEST(test_parts),           PROGRAM_TEST(test_noise),       PROGRAM_TEST(test_notes),
    };
    return run_program_tests("command line: statistics", tests, sizeof tests / sizeof tests[0]);
}
