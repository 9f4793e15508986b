/* Layers of what camera rays meet first, by names of the scene: against what is known of a square in front of the
 * eye, and against the layers that every picture has. */
#include "base/clock.h"
#include "base/memory.h"
#include "image/layers.h"
#include "render/aov_layers.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 8, PIXELS = SIDE * SIDE };

/* A square of half side 2 at z = 0, seen from a distance of 5; the eye begins to see at 1. Another shape before it in
 * the file is out of sight. */
static const char scene_text[] =
    "<scene version=\"3.0.0\"><integrator type=\"aov\"><string name=\"aovs\" value=\"d.y:depth,p:position,t:uv,"
    "g:geo_normal,s:sh_normal,du:dp_du,dv:dp_dv,tri:prim_index,shp:shape_index,a:albedo,N:sh_normal\"/>"
    "<integrator type=\"path\"><integer name=\"max_depth\" value=\"2\"/></integrator></integrator>"
    "<sensor type=\"perspective\"><float name=\"fov\" value=\"30\"/><float name=\"near_clip\" value=\"1\"/>"
    "<transform name=\"to_world\"><lookat origin=\"0,0,5\" target=\"0,0,0\" up=\"0,1,0\"/></transform>"
    "<film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/><integer name=\"height\" value=\"8\"/>"
    "<rfilter type=\"box\"/></film></sensor>"
    "<shape type=\"sphere\"><point name=\"center\" value=\"0,0,50\"/></shape>"
    "<shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"2\" y=\"2\"/></transform>"
    "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.2, 0.3, 0.4\"/></bsdf></shape>"
    "<emitter type=\"point\"><point name=\"position\" value=\"0,0,5\"/></emitter></scene>";

static ca_image_layers *picture(const char *text, uint32_t threads, uint32_t samples)
{
    ca_scene *scene = scene_from_text(text);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.samples_per_pixel = samples;
    settings.threads = threads;
    ca_image_layers *image = render_scene(scene, &settings);
    ca_scene_release(scene);
    return image;
}

static double at(const ca_image_layers *image, const char *name, uint32_t i)
{
    const float *data = ca_layers_find(image, name);
    if (!data) fail_msg("there is no layer %s", name);
    return data ? (double)data[i] : 0.0;
}

static void assert_near(double got, double expected, double tolerance)
{
    if (!(fabs(got - expected) <= tolerance)) fail_msg("%.9g instead of %.9g", got, expected);
}

/* Position is linear in the picture, coordinates in the position; depth is 4/5 of the distance. */
static void layers_show_the_square(void **state)
{
    (void)state;
    ca_image_layers *image = picture(scene_text, 1, 16);
    for (uint32_t i = 0; i < PIXELS; i++) {
        const double x = at(image, "p.X", i), y = at(image, "p.Y", i), z = at(image, "p.Z", i);
        const double half = 5.0 * tan(15.0 * 3.14159265358979 / 180.0);
        assert_near(x, half * (2.0 * (i % SIDE + 0.5) / SIDE - 1.0), 0.08);
        assert_near(y, half * (1.0 - 2.0 * (i / SIDE + 0.5) / SIDE), 0.08);
        assert_near(z, 0.0, 1e-5);
        assert_near(at(image, "t.U", i), 0.5 + x / 4.0, 1e-5);
        assert_near(at(image, "t.V", i), 0.5 + y / 4.0, 1e-5);
        assert_near(at(image, "d.y.T", i), 0.8 * sqrt(x * x + y * y + 25.0), 5e-3);
        assert_near(at(image, "g.Z", i), 1.0, 1e-6);
        assert_near(at(image, "s.X", i), 0.0, 1e-6);
        assert_near(at(image, "du.X", i), 4.0, 1e-5);
        assert_near(at(image, "du.Y", i), 0.0, 1e-5);
        assert_near(at(image, "dv.Y", i), 4.0, 1e-5);
        assert_near(at(image, "shp.I", i), 1.0, 0.0);
        assert_true(at(image, "tri.I", i) >= 0.0 && at(image, "tri.I", i) <= 1.0);
        assert_near(at(image, "a.G", i), 0.3, 1e-6);
    }
    ca_image_release(image);
}

/* The rays are the camera paths' own. */
static void they_are_the_picture_s_own(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {{"p.X", "P.X"}, {"p.Y", "P.Y"}, {"s.Z", "N.Z"}, {"a.B", "Albedo.B"}};
    ca_image_layers *image = picture(scene_text, 1, 16);
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++)
        for (uint32_t i = 0; i < PIXELS; i++)
            assert_near(at(image, pairs[k][0], i), at(image, pairs[k][1], i), 1e-5);
    size_t normals = 0; /* the layer that is there already is not made a second time */
    for (size_t c = 0; c < image->channel_count; c++) normals += strcmp(image->channels[c].name, "N.X") == 0;
    assert_int_equal(normals, 1);
    ca_image_release(image);
}

static void any_number_of_threads_makes_the_same(void **state)
{
    (void)state;
    ca_image_layers *one = picture(scene_text, 1, 3), *three = picture(scene_text, 3, 3);
    static const char *const names[] = {"d.y.T", "p.X", "t.V", "tri.I"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        assert_memory_equal(ca_layers_find(one, names[k]), ca_layers_find(three, names[k]), PIXELS * sizeof(float));
    ca_image_release(one);
    ca_image_release(three);
}

/* Asks for the end after some passes, as a signal does a second after it came: the work is then to end at once. */
typedef struct ending {
    uint32_t passes;
    int stop;
    double asked; /* when; by the clock */
} ending;

static bool end_after_passes(const ca_render_progress *progress, void *user)
{
    ending *end = user;
    if (progress->passes_done < end->passes) return true;
    end->asked = ca_clock_seconds();
    __atomic_store_n(&end->stop, 1, __ATOMIC_RELAXED);
    return false;
}

/* Returns the seconds from the stop to the end of the call. */
static double render_until(const char *text, ending *end, uint32_t side, ca_image_layers **image,
                           ca_render_statistics *statistics)
{
    ca_scene *scene = scene_from_text(text);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    ca_render_statistics_init(statistics);
    settings.samples_per_pixel = 1000;
    settings.threads = 1;
    settings.width = settings.height = side;
    settings.progress = end_after_passes;
    settings.progress_user = end;
    settings.stop = &end->stop;
    assert_int_equal(ca_render(scene, &settings, image, statistics, NULL), CA_OK);
    const double seconds = ca_clock_seconds() - end->asked;
    assert_true(statistics->interrupted && statistics->iterations == end->passes);
    assert_non_null(ca_layers_find(*image, "R"));
    ca_scene_release(scene);
    return seconds;
}

/* The stop that was set in the last pass does not end what begins after it. */
static void a_stop_leaves_them_time(void **state)
{
    (void)state;
    ending end = {.passes = 2};
    ca_image_layers *image;
    ca_render_statistics statistics;
    render_until(scene_text, &end, SIDE, &image, &statistics);
    assert_false(statistics.lacks_layers);
    for (uint32_t i = 0; i < PIXELS; i++) assert_near(at(image, "a.G", i), 0.3, 1e-6);
    assert_near(at(image, "shp.I", PIXELS - 1), 1.0, 0.0);
    ca_image_release(image);
}

/* Colours that take long to find: of a costly material, sixteen times. */
static const char slow_text[] =
    "<scene version=\"3.0.0\"><integrator type=\"aov\"><string name=\"aovs\" value=\"a0:albedo,a1:albedo,a2:albedo,"
    "a3:albedo,a4:albedo,a5:albedo,a6:albedo,a7:albedo,a8:albedo,a9:albedo,b0:albedo,b1:albedo,b2:albedo,b3:albedo,"
    "b4:albedo,b5:albedo\"/><integrator type=\"path\"><integer name=\"max_depth\" value=\"1\"/></integrator>"
    "</integrator><sensor type=\"perspective\"><float name=\"fov\" value=\"30\"/><transform name=\"to_world\">"
    "<lookat origin=\"0,0,5\" target=\"0,0,0\" up=\"0,1,0\"/></transform><film type=\"hdrfilm\">"
    "<rfilter type=\"box\"/></film></sensor><shape type=\"rectangle\"><transform name=\"to_world\">"
    "<scale x=\"2\" y=\"2\"/></transform><bsdf type=\"blendbsdf\"><float name=\"weight\" value=\"0.5\"/>"
    "<bsdf type=\"roughconductor\"/><bsdf type=\"principled\"/></bsdf></shape>"
    "<emitter type=\"constant\"/></scene>";

/* Who asks to stop waits for them a second, and then gets the picture of whole passes without them, and is told. */
static void a_stop_leaves_them_out(void **state)
{
    (void)state;
    ending end = {.passes = 10};
    ca_image_layers *image;
    ca_render_statistics statistics;
    const double seconds = render_until(slow_text, &end, 640, &image, &statistics);
    printf("without layers after %.3f s\n", seconds);
    assert_true(statistics.lacks_layers && seconds >= CA_AOV_SECONDS);
    assert_null(ca_layers_find(image, "a0.R"));
    ca_image_release(image);
}

/* Nobody wants the image any more: nothing of them is traced. */
static void they_are_discarded_at_once(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(slow_text);
    const int asked = 1;
    ca_render_settings settings;
    ca_render_plan plan;
    ca_image_layers *image;
    ca_render_settings_init(&settings);
    settings.threads = 1;
    settings.width = settings.height = 640;
    settings.discard = &asked;
    assert_int_equal(ca_render_plan_make(&plan, scene, &settings, NULL), CA_OK);
    assert_int_equal(ca_layers_create(&image, settings.width, settings.height, NULL), CA_OK);
    const double start = ca_clock_seconds();
    assert_int_equal(ca_aov_layers_add(&plan, CA_AOV_SAMPLES, image, NULL), CA_ERROR_INTERRUPTED);
    assert_true(image->channel_count == 0 && ca_clock_seconds() - start < CA_AOV_SECONDS);
    ca_layers_destroy(image);
    ca_scene_release(scene);
}

/* Their memory is kept back: where it ends on the way, whatever image there is has them. */
static void memory_is_kept_back_for_them(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.samples_per_pixel = 1;
    settings.threads = 1;
    settings.width = settings.height = 128; /* more than what else is kept back has room for */
    ca_status status = CA_ERROR_MEMORY;
    for (long allowed = 0; status != CA_OK; allowed++) {
        ca_image_layers *image;
        ca_render_statistics statistics = {.size = sizeof statistics};
        ca_error error = {""};
        ca_memory_fail_after(allowed);
        status = ca_render(scene, &settings, &image, &statistics, &error);
        ca_memory_fail_after(-1);
        if (status != CA_OK) assert_true(status == CA_ERROR_MEMORY && error.message[0]);
        if (!image) continue;
        const bool has_first = ca_layers_find(image, "d.y.T"), has_last = ca_layers_find(image, "a.B");
        assert_true(has_first && has_last && !statistics.lacks_layers);
        ca_image_release(image);
    }
    ca_scene_release(scene);
}

/* Mitsuba's integrator `depth`, before the empty sky and a square of half side 1. */
static void depth_is_a_layer(void **state)
{
    (void)state;
    ca_image_layers *image =
        picture("<scene version=\"3.0.0\"><integrator type=\"depth\"/><sensor type=\"orthographic\">"
                "<transform name=\"to_world\"><scale x=\"2\" y=\"2\"/><lookat origin=\"0,0,5\" target=\"0,0,0\" "
                "up=\"0,1,0\"/></transform><film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/>"
                "<integer name=\"height\" value=\"8\"/><rfilter type=\"box\"/></film></sensor>"
                "<shape type=\"rectangle\"/></scene>",
                1, 4);
    for (uint32_t i = 0; i < PIXELS; i++) {
        const bool inside = i % SIDE >= 2 && i % SIDE < 6 && i / SIDE >= 2 && i / SIDE < 6;
        assert_near(at(image, "depth.T", i), inside ? 5.0 - 0.01 : 0.0, 1e-4);
    }
    ca_image_release(image);
}

/* Coordinates of a sphere and of a square, where nothing else reads them. */
static void coordinates_of_quadrics_are_there(void **state)
{
    (void)state;
    ca_image_layers *image =
        picture("<scene version=\"3.0.0\"><integrator type=\"aov\"><string name=\"aovs\" value=\"t:uv\"/>"
                "</integrator><sensor type=\"perspective\"><float name=\"fov\" value=\"4\"/>"
                "<transform name=\"to_world\"><lookat origin=\"0,-5,0\" target=\"0,0,0\" up=\"0,0,1\"/></transform>"
                "<film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/><integer name=\"height\" value=\"8\"/>"
                "<rfilter type=\"box\"/></film></sensor><shape type=\"sphere\"/></scene>",
                1, 4);
    for (uint32_t i = 0; i < PIXELS; i++) {
        assert_near(at(image, "t.U", i), 0.75, 0.03); /* -y */
        assert_near(at(image, "t.V", i), 0.5, 0.06);
    }
    ca_image_release(image);
}

/* A square that fills the picture, with its normal along z, under an angle whose cosine is 0.8, from one side. */
static void assert_albedo(const char *bsdf, const char *eye, const double expected[3])
{
    char text[1024];
    const int length = snprintf(
        text, sizeof text,
        "<scene version=\"3.0.0\"><integrator type=\"aov\"><string name=\"aovs\" value=\"a:albedo\"/></integrator>"
        "<sensor type=\"orthographic\"><transform name=\"to_world\"><scale x=\"0.2\" y=\"0.2\"/>"
        "<lookat origin=\"%s\" target=\"0,0,0\" up=\"0,1,0\"/></transform><film type=\"hdrfilm\">"
        "<integer name=\"width\" value=\"8\"/><integer name=\"height\" value=\"8\"/><rfilter type=\"box\"/></film>"
        "</sensor><shape type=\"rectangle\">%s</shape></scene>",
        eye, bsdf);
    assert_in_range(length, 1, sizeof text - 1);
    ca_image_layers *image = picture(text, 1, 1);
    static const char *const names[] = {"a.R", "a.G", "a.B"};
    for (int c = 0; c < 3; c++) {
        const double got = at(image, names[c], 0);
        if (!(fabs(got - expected[c]) < 1e-4))
            fail_msg("%s of %s from %s: %.6g instead of %.6g", names[c], bsdf, eye, got, expected[c]);
    }
    ca_image_release(image);
}

#define BSDF(type, inside) "<bsdf type=\"" type "\">" inside "</bsdf>"
#define FLOAT(name, value) "<float name=\"" name "\" value=\"" value "\"/>"
#define COLOR(name, value) "<rgb name=\"" name "\" value=\"" value "\"/>"
#define DIFFUSE BSDF("diffuse", COLOR("reflectance", "0.2, 0.4, 0.6"))

/* The colours that Mitsuba 3.9.1 shows. */
static void albedo_is_mitsuba_s(void **state)
{
    (void)state;
    static const double base[3] = {0.2, 0.4, 0.6}, three_quarters[3] = {0.15, 0.3, 0.45}, black[3] = {0.0};
    static const double metal[3] = {1.11173, 0.76439, 0.49939}, glass[3] = {0.0403, 0.0403, 0.0403};
    const struct {
        const char *bsdf;
        const double *before, *behind;
    } cases[] = {
        {DIFFUSE, base, base},
        {BSDF("plastic", COLOR("diffuse_reflectance", "0.2, 0.4, 0.6")), base, base},
        {BSDF("roughplastic",
              "<boolean name=\"nonlinear\" value=\"true\"/>" COLOR("diffuse_reflectance", "0.2, 0.4, 0.6")),
         base, base},
        {BSDF("principled", COLOR("base_color", "0.2, 0.4, 0.6") FLOAT("metallic", "0.3") FLOAT("spec_trans", "0.2")),
         base, base},
        {BSDF("principledthin", COLOR("base_color", "0.2, 0.4, 0.6") FLOAT("diff_trans", "0.5")), base, base},
        {BSDF("conductor", ""), black, black},
        {BSDF("dielectric", ""), black, black},
        {BSDF("null", ""), black, black},
        {BSDF("roughconductor", COLOR("eta", "0.2, 0.9, 1.5") COLOR("k", "3, 2.5, 2") FLOAT("alpha", "0.4")), metal,
         black},
        {BSDF("roughdielectric", FLOAT("alpha", "0.5")), glass, black},
        {BSDF("mask", FLOAT("opacity", "0.4") DIFFUSE), base, base},
        {BSDF("blendbsdf", FLOAT("weight", "0.25") DIFFUSE BSDF("conductor", "")), three_quarters, three_quarters},
        {BSDF("twosided", DIFFUSE), base, base},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_albedo(cases[i].bsdf, "0,3,4", cases[i].before);
        assert_albedo(cases[i].bsdf, "0,3,-4", cases[i].behind);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_show_the_square),
        cmocka_unit_test(they_are_the_picture_s_own),
        cmocka_unit_test(any_number_of_threads_makes_the_same),
        cmocka_unit_test(a_stop_leaves_them_time),
        cmocka_unit_test(a_stop_leaves_them_out),
        cmocka_unit_test(they_are_discarded_at_once),
        cmocka_unit_test(memory_is_kept_back_for_them),
        cmocka_unit_test(depth_is_a_layer),
        cmocka_unit_test(albedo_is_mitsuba_s),
        cmocka_unit_test(coordinates_of_quadrics_are_there),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
