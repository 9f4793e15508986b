/* Photons belong to the surface that they lie on. Where it is thin or meets another at an edge, others are within the
 * merge radius too: of single scattering their light is known to be none, exactly, and each view has a counterpart
 * with light in it. How a surface's triangles are wound changes nothing. */
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#define RADIUS "0.1"

static const char *const integrators[] = {
    "ppm:max_depth=2,radius=" RADIUS,
    "bdpm:max_depth=2,radius=" RADIUS,
    "vcm:max_depth=2,radius=" RADIUS,
    "ovcm:max_depth=2,radius=" RADIUS,
    "qmcppm:max_depth=2,radius=" RADIUS ",direct=photons",
};
enum { INTEGRATORS = sizeof integrators / sizeof integrators[0] };

/* The sum over all pixels. */
static double light_in(const char *sensor, const char *content, const char *integrator)
{
    char text[4096];
    const int length = snprintf(text, sizeof text, "<scene version='3.0.0'>%s%s</scene>", sensor, content);
    assert_true(length > 0 && (size_t)length < sizeof text);
    ca_scene *scene = scene_from_text(text);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = 2;
    settings.light_paths = 2000;
    ca_image_layers *image = render_scene(scene, &settings);
    const float *green = ca_image_channel(image, "G");
    uint32_t width, height;
    ca_image_size(image, &width, &height);
    double sum = 0.0;
    for (size_t i = 0; i < (size_t)width * height; i++) sum += (double)green[i];
    ca_image_release(image);
    ca_scene_release(scene);
    return sum;
}

static void check_dark_and_lit(const char *dark_view, const char *dark, const char *lit_view, const char *lit)
{
    for (int i = 0; i < INTEGRATORS; i++) {
        const double none = light_in(dark_view, dark, integrators[i]), some = light_in(lit_view, lit, integrators[i]);
        if (none != 0.0) fail_msg("%s: %g where no light comes", integrators[i], none);
        if (!(some > 1.0)) fail_msg("%s: %g where light comes", integrators[i], some);
    }
}

/* Parallel views of squares of twice `half`. */
#define VIEW(origin, target, half)                                                                                   \
    "<sensor type='orthographic'><transform name='to_world'><scale value='" half "'/><lookat origin='" origin        \
    "' target='" target "' up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' value='8'/>"           \
    "<integer name='height' value='8'/><rfilter type='box'/></film></sensor>"
#define FROM_ABOVE VIEW("0,1,0", "0,0,0", "0.3")
#define FROM_BELOW VIEW("0,-1,0", "0,0,0", "0.3")

#define SHAPE(type, steps, bsdf)                                                                                     \
    "<shape type='" type "'><transform name='to_world'>" steps "</transform>" bsdf "</shape>"
#define LEVEL "<rotate x='1' angle='-90'/>"
#define MATT "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>"
#define ROUGH_GLASS "<bsdf type='roughdielectric'><float name='alpha' value='0.5'/></bsdf>"
#define LAMP_OF(cutoff)                                                                                              \
    "<emitter type='spot'><rgb name='intensity' value='5'/><float name='cutoff_angle' value='" cutoff "'/>"          \
    "<transform name='to_world'><lookat origin='0,1.5,0' target='0,0,0' up='0,0,1'/></transform></emitter>"
#define LAMP LAMP_OF("30")

/* Both sides of a rectangle have the same photons, and its material lets none through. */
static void test_leaf(void **state)
{
    (void)state;
    static const char leaf[] = SHAPE("rectangle", LEVEL, MATT) LAMP;
    check_dark_and_lit(FROM_BELOW, leaf, FROM_ABOVE, leaf);
}

/* A pane of rough glass, thinner than the radius by a hundred times: light must pass two surfaces, which takes three
 * edges, but the material of either would take photons of the other as light from its own other side. */
static void test_pane(void **state)
{
    (void)state;
    static const char pane[] =
        SHAPE("cube", "<scale x='1' y='0.0005' z='1'/>", ROUGH_GLASS) LAMP;
    check_dark_and_lit(FROM_BELOW, pane, FROM_ABOVE, pane);
}

/* A wall that is lit down to its foot, where the floor lies in the shadow of a step. */
#define FLOOR_AND_WALL                                                                                               \
    SHAPE("rectangle", LEVEL, MATT)                                                                                  \
    SHAPE("rectangle", "<rotate y='1' angle='90'/>", MATT)                                                           \
    "<emitter type='directional'><vector name='direction' value='-1,-0.39,0'/></emitter>"
#define STEP SHAPE("cube", "<scale x='0.01' y='0.4' z='2'/><translate x='0.9'/>", MATT)

static void test_edge(void **state)
{
    (void)state;
    static const char foot[] = VIEW("0.15,1,0", "0.15,0,0", "0.14");
    check_dark_and_lit(foot, FLOOR_AND_WALL STEP, foot, FLOOR_AND_WALL);
}

/* A plate of rough glass over a table, as its lower face: what is lit of it ends 2 cm from what is seen of the table,
 * on which no light falls. The two are wound apart, but light comes to both from above. */
static void test_plate_over_table(void **state)
{
    (void)state;
    static const char beside[] = VIEW("0.36,1,0", "0.36,0,0", "0.04"), lit[] = VIEW("0.2,1,0", "0.2,0,0", "0.04");
#define TABLE SHAPE("rectangle", LEVEL, MATT) LAMP_OF("11.3")
#define LOWER_FACE                                                                                                   \
    SHAPE("rectangle", "<scale x='0.31'/><rotate x='1' angle='90'/><translate y='0.001'/>", ROUGH_GLASS)
    check_dark_and_lit(beside, TABLE LOWER_FACE, lit, TABLE);
}

/* A floor of two halves; the seam lies in the middle of the view, and most of it within the radius of the seam. */
#define HALF(middle, turn, bsdf)                                                                                     \
    SHAPE("rectangle", "<rotate x='1' angle='" turn "'/><scale x='0.5'/><translate x='" middle "'/>", bsdf)
#define HALVES(turn, bsdf) HALF("-0.5", "-90", bsdf) HALF("0.5", turn, bsdf) LAMP

static void test_winding_changes(void **state)
{
    (void)state;
    static const char seam[] = VIEW("0,1,0", "0,0,0", "0.1");
    for (int i = 0; i < INTEGRATORS; i++) {
        const double one = light_in(seam, HALVES("-90", MATT), integrators[i]);
        const double other = light_in(seam, HALVES("90", MATT), integrators[i]);
        if (!(one > 1.0 && fabs(other - one) < 1e-3 * one))
            fail_msg("%s: %g where the winding changes, %g where it does not", integrators[i], other, one);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_leaf),
        cmocka_unit_test(test_pane),
        cmocka_unit_test(test_edge),
        cmocka_unit_test(test_plate_over_table),
        cmocka_unit_test(test_winding_changes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
