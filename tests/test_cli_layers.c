/* Which layers `caustica render` and `caustica merge` write, and with how many bits, from outside. */
#define _POSIX_C_SOURCE 200809L
#include "image/layers.h"
#include "support/program_test.h"

#include <math.h>
#include <stdlib.h>

/* A ball in light of a given radiance from everywhere. */
static const char *const glow_text =
    "<scene version=\"3.0.0\">\n"
    "  <default name=\"light\" value=\"1\"/><default name=\"radius\" value=\"1\"/>\n"
    "  <sensor type=\"perspective\"><float name=\"fov\" value=\"20\"/>\n"
    "    <transform name=\"to_world\"><lookat origin=\"0,0,9\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"24\"/>"
    "<integer name=\"height\" value=\"16\"/><rfilter type=\"box\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"sphere\"><float name=\"radius\" value=\"$radius\"/>\n"
    "    <point name=\"center\" value=\"0.3,0.2,0\"/>\n"
    "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.3,0.5,0.7\"/></bsdf></shape>\n"
    "  <emitter type=\"constant\"><rgb name=\"radiance\" value=\"$light\"/></emitter>\n"
    "</scene>\n";

/* The channels of a file in its order (that of EXR: by name); those of halves are followed by a colon. */
static const char *channels(void **state, const char *name)
{
    static char text[1024];
    size_t used = 0;
    ca_image_layers *image = read_image(state, name);
    text[0] = '\0';
    for (size_t c = 0; c < image->channel_count; c++)
        used += (size_t)snprintf(text + used, sizeof text - used, "%s%s%s", c ? " " : "", image->channels[c].name,
                                 image->channels[c].half ? ":" : "");
    ca_image_release(image);
    return text;
}

static int set_up_glow(void **state)
{
    const int status = set_up(state);
    if (status == 0) write_text(folder_of(state), "glow.xml", glow_text);
    return status;
}

#define RENDER(result, ...) RUN(result, "render", "glow.xml", "-ipath:max_depth=3", "--quiet", __VA_ARGS__)

/* The program has written this file, with these channels. */
static void assert_channels(void **state, const ca_program_result *result, const char *name, const char *expected)
{
    assert_exit(result, 0);
    assert_string_equal(channels(state, name), expected);
}

static long file_bytes(void **state, const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder_of(state), name);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    const long bytes = ftell(file);
    fclose(file);
    return bytes;
}

/* ---- Which layers ---------------------------------------------------------------------------------------------- */

static void test_chosen_layers(void **state)
{
    ca_program_result r;
    RENDER(&r, "--spp=4", "-o", "a.exr", "--layers=Albedo,Variance.G,N.Z", "-o", "a.png");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_string_equal(channels(state, "a.exr"), "Albedo.B Albedo.G Albedo.R B G N.Z R Variance.G");
    RENDER(&r, "--spp=4", "-o", "b.exr", "--layers", "none");
    assert_channels(state, &r, "b.exr", "B G R");
    RENDER(&r, "--spp=4", "-o", "c.exr");
    assert_exit(&r, 0);
    RENDER(&r, "--spp=4", "-o", "d.exr", "--layers=all");
    assert_exit(&r, 0);
    assert_true(file_bytes(state, "b.exr") < file_bytes(state, "a.exr"));
    assert_true(file_bytes(state, "a.exr") < file_bytes(state, "c.exr"));
    /* What is chosen is the same to the bit. */
    ca_image_layers *some = read_image(state, "a.exr"), *all = read_image(state, "d.exr");
    for (size_t c = 0; c < some->channel_count; c++)
        assert_memory_equal(some->channels[c].data, ca_layers_find(all, some->channels[c].name),
                            sizeof(float) * 24 * 16);
    ca_image_release(some);
    ca_image_release(all);
}

static void test_wrong_names(void **state)
{
    ca_program_result r;
    RENDER(&r, "-o", "a.exr", "--layers=N,Albdo");
    assert_wrong_usage(&r, "there is no layer \"Albdo\"; did you mean \"Albedo\"?");
    RENDER(&r, "-o", "a.exr", "--layers=Variance.Z");
    assert_wrong_usage(&r, "did you mean \"Variance.");
    RENDER(&r, "-o", "a.exr", "--layers=");
    assert_exit(&r, 2);
    assert_false(exists(folder_of(state), "a.exr"));
    RENDER(&r, "-o", "a.png", "--layers=N");
    assert_wrong_usage(&r, "--layers: only .exr has layers");
    RENDER(&r, "-o", "a.png", "--half");
    assert_wrong_usage(&r, "--half: only .exr has layers");
    /* A name that this render does not fill is known, and told. */
    RENDER(&r, "--spp=4", "-o", "a.exr", "--layers=N,Noise.Camera");
    assert_exit(&r, 0);
    assert_says(r.errors, "warning: --layers: this image has no layer Noise.Camera");
    assert_string_equal(channels(state, "a.exr"), "B G N.X N.Y N.Z R");
}

/* ---- Layers that say nothing ----------------------------------------------------------------------------------- */

static void test_empty_layers(void **state)
{
    ca_program_result r;
    /* The ball is too small to be seen, and a single sample has no variance. */
    RENDER(&r, "--spp=1", "-Dradius=1e-6", "-o", "a.exr", "-o", "a.pfm");
    assert_channels(state, &r, "a.exr", "B G R Samples.Y");
    RENDER(&r, "--spp=1", "-Dradius=1e-6", "-o", "b.exr", "--layers=N,StandardDeviation");
    assert_channels(state, &r, "b.exr", "B G N.X N.Y N.Z R StandardDeviation.Y");
    RENDER(&r, "--spp=1", "-Dradius=1e-6", "-o", "c.exr", "--layers=all");
    assert_exit(&r, 0);
    assert_says(channels(state, "c.exr"), "Variance.R");
    /* Two samples of the same sky: that there is no variance is said, and compare can use it. */
    RENDER(&r, "--spp=2", "-Dradius=1e-6", "-o", "d.exr");
    assert_exit(&r, 0);
    assert_string_equal(channels(state, "d.exr"),
                        "B G R RelativeVariance.B RelativeVariance.G RelativeVariance.R Samples.Y "
                        "StandardDeviation.Y Variance.B Variance.G Variance.R");
    RUN(&r, "compare", "d.exr", "--reference", "d.exr", "--flip=none");
    assert_exit(&r, 0);
    assert_says(r.output, "would detect        all that is more than rounding: no block has noise");
    /* Four replicates are too few for any interval. */
    RENDER(&r, "--spp=4", "--replicates=4", "-o", "e.exr");
    assert_exit(&r, 0);
    assert_null(strstr(channels(state, "e.exr"), "Confidence"));
    RENDER(&r, "--spp=32", "--replicates=32", "-o", "f.exr");
    assert_exit(&r, 0);
    assert_says(channels(state, "f.exr"), "ConfidenceLow.Y");
}

/* Every layer that a render has can be chosen by its name. */
static void test_all_names_are_known(void **state)
{
    ca_program_result r;
    const char *const renders[][3] = {
        {"-ipath", "--spp=32", "--replicates=16"},
        {"-ibdpm:max_depth=3", "--rays=auto", "--spp=64"},
        {"-iqmcppm:max_depth=3,kernel=sph,gradients=true", "--spp=4", "--sampler=halton"},
    };
    for (size_t i = 0; i < sizeof renders / sizeof renders[0]; i++) {
        RUN(&r, "render", "glow.xml", "--quiet", "-o", "a.exr", "--layers=all", renders[i][0], renders[i][1],
            renders[i][2]);
        assert_exit(&r, 0);
        char list[2048] = "--layers=";
        strcpy(list + strlen(list), channels(state, "a.exr"));
        for (char *at = list; *at; at++) *at = *at == ' ' ? ',' : *at;
        RENDER(&r, "--spp=1", "-o", "b.exr", list);
        if (r.exit_status != 0) fail_msg("%s: %s", list, r.errors);
    }
}

/* ---- Halves ---------------------------------------------------------------------------------------------------- */

static void test_halves(void **state)
{
    ca_program_result r;
    RENDER(&r, "--spp=4", "-o", "a.exr", "--half", "--layers=Albedo,N,P,Variance,Samples");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_string_equal(channels(state, "a.exr"), "Albedo.B: Albedo.G: Albedo.R: B: G: N.X: N.Y: N.Z: P.X P.Y P.Z R: "
                                                  "Samples.Y Variance.B Variance.G Variance.R");
    RENDER(&r, "--spp=4", "-o", "b.exr");
    assert_exit(&r, 0);
    ca_image_layers *half = read_image(state, "a.exr"), *full = read_image(state, "b.exr");
    for (size_t c = 0; c < half->channel_count; c++) {
        const float *wanted = ca_layers_find(full, half->channels[c].name);
        const float unit = half->channels[c].half ? 0x1p-11f : 0.0f;
        for (size_t i = 0; i < 24 * 16; i++)
            assert_true(fabsf(half->channels[c].data[i] - wanted[i]) <= unit * fmaxf(fabsf(wanted[i]), 0x1p-14f));
    }
    ca_image_release(half);
    ca_image_release(full);
    /* Rounding is no bias: the block test allows for it. */
    RUN(&r, "compare", "a.exr", "--reference", "b.exr", "--flip=none");
    assert_exit(&r, 0);
    assert_says(r.output, "blocks that differ  0 of");
}

static void test_no_value_becomes_infinite(void **state)
{
    ca_program_result r;
    RENDER(&r, "--spp=4", "-Dlight=65505", "-o", "a.exr", "--half", "--layers=N");
    assert_exit(&r, 0);
    assert_says(r.errors, "warning: --half: R G B stay at 32 bits: their largest value is 65505, of 16 bits 65504");
    assert_string_equal(channels(state, "a.exr"), "B G N.X: N.Y: N.Z: R");
    ca_image_layers *image = read_image(state, "a.exr");
    assert_true(ca_layers_find(image, "R")[0] == 65505.0f);
    ca_image_release(image);
    RENDER(&r, "--spp=4", "-Dlight=65504", "-o", "a.exr", "--half", "--layers=none");
    assert_exit(&r, 0);
    assert_string_equal(r.errors, "");
    assert_string_equal(channels(state, "a.exr"), "B: G: R:");
    RENDER(&r, "--spp=4", "-Dlight=1e-6", "-o", "a.exr", "--half", "--layers=none");
    assert_exit(&r, 0);
    assert_says(r.errors, "is too small for 16 bits");
    assert_string_equal(channels(state, "a.exr"), "B G R");
}

static void test_merged_parts(void **state)
{
    ca_program_result r;
    RUN(&r, "render", "glow.xml", "-iqmcppm:max_depth=3", "--sampler=halton", "--spp=2", "--quiet", "-o", "a.part");
    assert_exit(&r, 0);
    RUN(&r, "merge", "a.part", "--quiet", "-o", "a.exr", "--half", "--layers=Samples");
    assert_channels(state, &r, "a.exr", "B: G: R: Samples.Y");
    RUN(&r, "merge", "a.part", "--quiet", "-o", "a.exr", "--layers=P"); /* not Pairs.Y */
    assert_channels(state, &r, "a.exr", "B G P.X P.Y P.Z R");
    RUN(&r, "merge", "a.part", "--quiet", "-o", "b.part", "--half");
    assert_exit(&r, 2);
    RUN(&r, "merge", "a.part", "--quiet", "-o", "a.exr", "--layers=Samplse");
    assert_wrong_usage(&r, "did you mean \"Samples\"?");
}

/* Layers that the scene's aov makes have the names that it gives them. */
static void test_aovs(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "aov.xml",
               "<scene version='3.0.0'><integrator type='aov'><string name='aovs' value='dd.y:depth,far:depth'/>"
               "<integrator type='path'/></integrator><sensor type='perspective'><film type='hdrfilm'>"
               "<integer name='width' value='4'/><integer name='height' value='4'/></film></sensor>"
               "<emitter type='constant'/></scene>");
    RUN(&r, "render", "aov.xml", "--quiet", "--spp=1", "-o", "a.exr", "--layers=dd.y.T");
    assert_exit(&r, 0);
    assert_string_equal(channels(state, "a.exr"), "B G R dd.y.T");
    RUN(&r, "render", "aov.xml", "--quiet", "--spp=1", "-o", "b.exr", "--layers=dd,far");
    assert_exit(&r, 0);
    assert_string_equal(channels(state, "b.exr"), "B G R dd.y.T far.T");
    RUN(&r, "render", "aov.xml", "--quiet", "--spp=1", "-o", "c.exr", "--layers=ddy.T");
    assert_exit(&r, 2);
    assert_false(exists(folder_of(state), "c.exr"));
}

#define GLOW_TEST(function) cmocka_unit_test_setup_teardown(function, set_up_glow, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        GLOW_TEST(test_chosen_layers), GLOW_TEST(test_wrong_names),
        GLOW_TEST(test_empty_layers),  GLOW_TEST(test_all_names_are_known),
        GLOW_TEST(test_halves),        GLOW_TEST(test_no_value_becomes_infinite),
        GLOW_TEST(test_merged_parts),  GLOW_TEST(test_aovs),
    };
    return run_program_tests("the program: layers of images", tests, sizeof tests / sizeof tests[0]);
}
