/* Tone curves of the .png that `caustica render` and `caustica merge` write: what a display is told, against the
 * curves' formulas, from outside. */
#define _POSIX_C_SOURCE 200809L
#include "base/file.h"
#include "image/layers.h"
#include "support/program_test.h"

#include <math.h>
#include <stdlib.h>

/* A coloured ball in light that is over what a display shows. */
static const char *const bright_text =
    "<scene version=\"3.0.0\">\n"
    "  <sensor type=\"perspective\"><float name=\"fov\" value=\"20\"/>\n"
    "    <transform name=\"to_world\"><lookat origin=\"0,0,9\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\n"
    "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"24\"/>"
    "<integer name=\"height\" value=\"16\"/><rfilter type=\"box\"/></film>\n"
    "  </sensor>\n"
    "  <shape type=\"sphere\">\n"
    "    <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.02,0.2,0.7\"/></bsdf></shape>\n"
    "  <emitter type=\"constant\"><rgb name=\"radiance\" value=\"3,2,1.5\"/></emitter>\n"
    "</scene>\n";

#define RENDER(result, ...) RUN(result, "render", "bright.xml", "--spp=4", "--quiet", __VA_ARGS__)

static double encoded(double light)
{
    const double shown = fmin(fmax(light, 0.0), 1.0);
    return shown <= 0.0031308 ? 12.92 * shown : 1.055 * pow(shown, 1.0 / 2.4) - 0.055;
}

/* ---- The curves' formulas, of the light x of one channel and the pixel's luminance --------------------------- */

static double srgb(double x, double luminance)
{
    (void)luminance;
    return encoded(x);
}

static double aces(double x, double luminance)
{
    (void)luminance;
    return encoded((0.9036 * x * x + 0.018 * x) / (0.8748 * x * x + 0.354 * x + 0.14));
}

static double hable(double x, double luminance)
{
    (void)luminance;
    return encoded((0.231683 * x * x + 0.013791 * x) / (0.18 * x * x + 0.3 * x + 0.018));
}

static double reinhard(double x, double luminance) { return encoded(x / (1.0 + luminance)); }

static double linear(double x, double luminance)
{
    (void)luminance;
    return fmin(fmax(x, 0.0), 1.0);
}

static const struct {
    const char *name;
    double (*signal)(double x, double luminance);
} curves[] = {{"srgb", srgb}, {"aces", aces}, {"hable", hable}, {"reinhard", reinhard}, {"linear", linear}};
#define CURVES (sizeof curves / sizeof curves[0])

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static ca_bytes file_of(void **state, const char *name)
{
    char path[256];
    ca_bytes bytes;
    snprintf(path, sizeof path, "%s/%s", folder_of(state), name);
    assert_int_equal(ca_file_read(path, "image", (size_t)1 << 30, &bytes, NULL), CA_OK);
    return bytes;
}

static void assert_files_equal(void **state, const char *a, const char *b, bool equal)
{
    ca_bytes first = file_of(state, a), second = file_of(state, b);
    const bool same = first.size == second.size && memcmp(first.data, second.data, first.size) == 0;
    if (same != equal) fail_msg("%s and %s are %s", a, b, same ? "equal" : "not equal");
    ca_bytes_destroy(&first);
    ca_bytes_destroy(&second);
}

/* The codes of a .png are those of the light in the .exr under the curve, rounded. */
static void assert_shows(void **state, size_t curve, double exposure, const char *png, const char *exr)
{
    static const char *const names[3] = {"R", "G", "B"};
    ca_image_layers *picture = read_image(state, png), *light = read_image(state, exr);
    for (size_t i = 0; i < (size_t)picture->width * picture->height; i++) {
        double x[3];
        for (int c = 0; c < 3; c++) x[c] = exp2(exposure) * (double)ca_layers_find(light, names[c])[i];
        const double luminance = 0.2126 * x[0] + 0.7152 * x[1] + 0.0722 * x[2];
        for (int c = 0; c < 3; c++) {
            const double code = 255.0 * encoded((double)ca_layers_find(picture, names[c])[i]);
            const double wanted = 255.0 * curves[curve].signal(x[c], luminance);
            if (fabs(code - wanted) > 0.51)
                fail_msg("%s at %g stops shows %g as %g, not %g", curves[curve].name, exposure, x[c], code, wanted);
        }
    }
    ca_image_release(picture);
    ca_image_release(light);
}

/* ---- The tests ------------------------------------------------------------------------------------------------- */

static void test_curves(void **state)
{
    static const char *const exposures[] = {"0", "1.5", "-3"};
    ca_program_result r;
    write_text(folder_of(state), "bright.xml", bright_text);
    for (size_t curve = 0; curve < CURVES; curve++)
        for (size_t e = 0; e < sizeof exposures / sizeof exposures[0]; e++) {
            RENDER(&r, "--tone", curves[curve].name, "--exposure", exposures[e], "-o", "a.png", "-o", "a.exr");
            assert_exit(&r, 0);
            assert_string_equal(r.errors, "");
            assert_shows(state, curve, atof(exposures[e]), "a.png", "a.exr");
        }
}

/* Without the option, values are clipped; files that hold light are not touched by it. */
static void test_only_pictures_are_toned(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "bright.xml", bright_text);
    RENDER(&r, "-o", "plain.png", "-o", "plain.exr", "-o", "plain.pfm");
    assert_exit(&r, 0);
    assert_shows(state, 0, 0.0, "plain.png", "plain.exr");
    RENDER(&r, "--tone=srgb", "-o", "srgb.png");
    assert_exit(&r, 0);
    assert_files_equal(state, "plain.png", "srgb.png", true);
    RENDER(&r, "--tone=aces", "-o", "aces.PNG", "-o", "aces.exr", "-o", "aces.pfm");
    assert_exit(&r, 0);
    assert_files_equal(state, "plain.png", "aces.PNG", false);
    assert_files_equal(state, "plain.pfm", "aces.pfm", true);
    ca_image_layers *plain = read_image(state, "plain.exr"), *aces_light = read_image(state, "aces.exr");
    for (size_t c = 0; c < plain->channel_count; c++)
        assert_memory_equal(plain->channels[c].data, ca_layers_find(aces_light, plain->channels[c].name),
                            sizeof(float) * plain->width * plain->height);
    ca_image_release(plain);
    ca_image_release(aces_light);
}

/* A picture of merged parts is that of one render. */
static void test_merged_parts(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "bright.xml", bright_text);
    RENDER(&r, "-iqmcppm:max_depth=3", "-o", "a.part", "-o", "one.png", "--tone=hable", "--exposure=-0.5");
    assert_exit(&r, 0);
    RUN(&r, "merge", "a.part", "--quiet", "-o", "merged.png", "--tone=hable", "--exposure=-0.5");
    assert_exit(&r, 0);
    assert_files_equal(state, "one.png", "merged.png", true);
    RUN(&r, "merge", "a.part", "--quiet", "-o", "plain.png", "--exposure=-0.5");
    assert_exit(&r, 0);
    assert_files_equal(state, "one.png", "plain.png", false);
}

static void test_wrong_names(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "bright.xml", bright_text);
    RENDER(&r, "--tone", "filmic", "-o", "never.png");
    assert_wrong_usage(&r, "--tone: \"filmic\" is not a tone curve: srgb, aces, hable, reinhard, linear");
    RUN(&r, "merge", "a.part", "--tone=filmic", "-o", "never.png");
    assert_wrong_usage(&r, "--tone: \"filmic\" is not a tone curve");
    assert_false(exists(folder_of(state), "never.png"));
}

/* What only .png shows is refused where none is written. */
static void test_no_png(void **state)
{
    ca_program_result r;
    write_text(folder_of(state), "bright.xml", bright_text);
    RENDER(&r, "--tone", "aces", "-o", "never.exr");
    assert_wrong_usage(&r, "--tone: only .png has a look, and none is written");
    RENDER(&r, "--exposure", "1", "-o", "never.exr", "-o", "never.pfm");
    assert_wrong_usage(&r, "--exposure: only .png has a look, and none is written");
    RUN(&r, "merge", "a.part", "--exposure=1", "-o", "never.exr");
    assert_wrong_usage(&r, "--exposure: only .png has a look, and none is written");
    assert_false(exists(folder_of(state), "never.exr"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_curves),
        PROGRAM_TEST(test_only_pictures_are_toned),
        PROGRAM_TEST(test_merged_parts),
        PROGRAM_TEST(test_wrong_names),
        PROGRAM_TEST(test_no_png),
    };
    return run_program_tests("tone curves of pictures", tests, sizeof tests / sizeof tests[0]);
}
