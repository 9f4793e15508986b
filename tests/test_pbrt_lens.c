/* pbrt's camera "realistic": the same bits as our sensor at the place that pbrt's own formulas give, as bright as its
 * own pictures; what it says of stops; mistakes; and its way through convert. */
#include "support/import_text.h"
#include "support/scene_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define FILM "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16 \"float diagonal\" 30\n"
#define SAMPLES "Sampler \"independent\" \"integer pixelsamples\" 16\nIntegrator \"path\" \"integer maxdepth\" 2\n"
#define CAMERA(rest) "Camera \"realistic\" \"string lensfile\" \"lens.dat\" \"float aperturediameter\" 8 " rest "\n"
#define LOOK "LookAt 0 1 -3  0 1 0  0 1 0\n"
#define WORLD                                                                                                        \
    "WorldBegin\nLightSource \"infinite\" \"rgb L\" [.5 .6 .7]\n"                                                    \
    "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 2 1]\n"                                                 \
    "Translate 0.3 1.4 0 Shape \"sphere\" \"float radius\" 0.2 AttributeEnd\n"                                       \
    "Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\n"                                                          \
    "Translate -0.3 0.8 0 Shape \"sphere\" \"float radius\" 0.3\n"

static const double radii[] = {61.0, -45.0, -131.0, 0.0}, thicknesses[] = {6.0, 2.5, 1.5, 40.0};
static const double indices[] = {1.517, 1.62, 1.0, 1.0};

static void write_lenses(void)
{
    import_write_text("lens.dat", "# radius thickness eta diameter\n61 6 1.517 25\n-45 2.5 1.62 25\n-131 1.5 1 25\n"
                                  "0 40 0 16\n");
    import_write_text("open.dat", "61 6 1.517 25\n-45 2.5 1.62 25\n-131 40 1 25\n");
    import_write_text("stops.dat", "0 1 0 20\n61 6 1.517 25\n-45 2.5 1.62 25\n-131 1.5 1 25\n0 40 0 16\n");
    import_write_text("spread.dat", "-61 6 1.517 25\n0 40 0 16\n45 1 1 25\n");
    import_write_text("broken.dat", "61 6 1.517\n");
    import_write_text("dark.dat", "61 0 1.5 25\n-61 1.5 1 25\n0 40 0 16\n");
}

static ca_status run(const char *text, ca_scene_desc *desc, ca_error *error)
{
    char path[128];
    snprintf(path, sizeof path, "%s/test.pbrt", import_folder());
    return ca_import_scene_text(text, strlen(text), path, NULL, 0, desc, error);
}

static ca_scene_desc import(const char *text)
{
    ca_scene_desc desc;
    ca_error error;
    if (run(text, &desc, &error) != CA_OK) fail_msg("%s", error.message);
    return desc;
}

static bool notes(const ca_scene_desc *desc, const char *part)
{
    for (size_t i = 0; i < desc->notes.count; i++)
        if (strstr(desc->notes.items[i], part)) return true;
    return false;
}

/* ---- By pbrt's formulas ---------------------------------------------------------------------------------------- */

/* A paraxial ray's height and slope behind the lens, from one of slope 0; reversed: from the film's side. */
static void cardinal_points(bool reversed, double *principal, double *focal)
{
    double height = 1.0, slope = 0.0, index = 1.0;
    for (int k = 0; k < 4; k++) {
        const int i = reversed ? 3 - k : k;
        const double behind = reversed ? (i > 0 ? indices[i - 1] : 1.0) : indices[i];
        const double radius = reversed ? -radii[i] : radii[i];
        slope = (index * slope - (radius != 0.0 ? (behind - index) / radius * height : 0.0)) / behind;
        index = behind;
        const int gap = reversed ? i - 1 : i;
        if (k < 3) height += thicknesses[gap] * slope;
    }
    *focal = -height / slope; /* behind the last vertex that is passed */
    *principal = (1.0 - height) / slope;
}

/* RealisticCamera::FocusThickLens: z is 0 at the film, and positive in front of it. */
static double focus_thick_lens(double film, double focus_distance)
{
    double principal[2], focal[2];
    cardinal_points(false, &principal[0], &focal[0]);
    cardinal_points(true, &principal[1], &focal[1]);
    const double pz[2] = {-(film - principal[0]), -(film + 10.0 + principal[1])}, f = focal[0] - principal[0];
    const double z = -focus_distance, c = (pz[1] - z - pz[0]) * (pz[1] - z - 4.0 * f - pz[0]);
    return film + 0.5 * (pz[1] - z + pz[0] - sqrt(c));
}

static void film_and_lens(void **state)
{
    (void)state;
    write_lenses();
    static const double distances[] = {0.5, 2.0, 10.0, 1e4};
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
        char text[1024];
        snprintf(text, sizeof text, LOOK "%s" FILM "WorldBegin\n", CAMERA("\"float focusdistance\" %g"));
        char full[1024];
        snprintf(full, sizeof full, text, distances[i]);
        ca_scene_desc desc = import(full);
        const ca_camera *camera = &desc.camera.camera;
        const ca_realistic *r = &camera->as.realistic;
        const double expected = focus_thick_lens(40.0, 1e3 * distances[i]);
        if (!(fabs(r->film_distance - expected) < 1e-8 * expected))
            fail_msg("focused on %g: film at %.12g, in pbrt at %.12g", distances[i], r->film_distance, expected);
        /* The film's middle is where the camera stands, and the first vertex in front of it. */
        assert_true(fabs((double)camera->map.to[2][3] - (-3.0 + 1e-3 * (10.0 + r->film_distance))) < 1e-6);
        assert_true(r->scale == 1e-3 && r->film_diagonal == 30.0 && r->lens.surfaces[3].aperture == 4.0);
        assert_true(camera->far_clip == 1e10f && camera->near_clip == 1e-4f);
        ca_scene_desc_destroy(&desc);
    }
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

#define MATTE "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.5'/></bsdf></bsdf>"

/* Our sensor and lights, these times a factor. */
static ca_image_layers *render_twin(const ca_realistic *r, double factor, const char *rfilter)
{
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='3'/></integrator>"
        "<sensor type='realistic'><transform name='to_world'><translate z='%.17g'/><scale x='-1'/>"
        "<lookat origin='0,1,-3' target='0,1,0' up='0,1,0'/></transform><string name='filename' value='lens.dat'/>"
        "<float name='aperture_diameter' value='8'/><float name='film_distance' value='%.17g'/>"
        "<float name='film_diagonal' value='30'/><float name='near_clip' value='1e-4'/>"
        "<float name='far_clip' value='1e10'/><film type='hdrfilm'><integer name='width' value='24'/>"
        "<integer name='height' value='16'/><rfilter type='%s'/></film>"
        "<sampler type='independent'><integer name='sample_count' value='16'/></sampler></sensor>"
        "<emitter type='constant'><rgb name='radiance' value='%.17g %.17g %.17g'/></emitter>"
        "<shape type='sphere'><point name='center' x='.3' y='1.4' z='0'/><float name='radius' value='0.2'/>"
        "<emitter type='area'><rgb name='radiance' value='%.17g %.17g %.17g'/></emitter>" MATTE "</shape>"
        "<shape type='sphere'><point name='center' x='-.3' y='.8' z='0'/><float name='radius' value='0.3'/>"
        MATTE "</shape></scene>",
        1e-3 * (ca_lens_length(&r->lens) + r->film_distance), r->film_distance, rfilter, .5 * factor, .6 * factor,
        .7 * factor, 4.0 * factor, 2.0 * factor, factor);
    return import_render_text(xml, "twin.xml");
}

/* The exit pupil's solid angle from the film's middle: all rays up to the steepest one that gets through the stop,
 * the last surface. */
static double solid_angle(const ca_realistic *r)
{
    const double radius = 4.0;
    return 3.14159265358979324 * radius * radius / (radius * radius + r->film_distance * r->film_distance);
}

static void twins(void **state)
{
    (void)state;
    write_lenses();
#define SHUT "\"float focusdistance\" 3 \"float shutteropen\" 1 \"float shutterclose\" 1.5"
    static const struct {
        const char *text, *rfilter;
        double factor, tolerance; /* the factor beside the pupil's solid angle; 0: neither */
    } cases[] = {
        {LOOK CAMERA("\"float focusdistance\" 3") FILM SAMPLES "PixelFilter \"gaussian\"\n" WORLD "WorldEnd\n",
         "gaussian", 0.0, 0.0},
        {LOOK CAMERA(SHUT " \"bool simpleweighting\" \"true\"") FILM SAMPLES WORLD "WorldEnd\n", "box", 0.0, 0.0},
        {LOOK CAMERA(SHUT " \"bool simpleweighting\" \"false\"") FILM SAMPLES WORLD "WorldEnd\n", "box", 0.5, 1e-5},
        {LOOK CAMERA(SHUT) FILM SAMPLES WORLD, "gaussian", 1.0, 1e-5},
        {LOOK CAMERA(SHUT) "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16 \"float diagonal\" 30 "
                           "\"float iso\" 1600 \"float exposuretime\" 0.25\n" SAMPLES WORLD,
         "gaussian", 4.0, 1e-5},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        ca_scene_desc desc = import(cases[i].text);
        const ca_realistic *r = &desc.camera.camera.as.realistic;
        assert_int_equal(notes(&desc, "simpleweighting"), cases[i].factor == 0.0);
        ca_image_layers *a = import_render_text(cases[i].text, "test.pbrt");
        const double factor = cases[i].factor == 0.0 ? 1.0 : cases[i].factor * solid_angle(r);
        ca_image_layers *b = render_twin(r, factor, cases[i].rfilter);
        const double apart = picture_difference(a, b);
        if (!(apart <= cases[i].tolerance)) fail_msg("case %zu: pixels differ by %g", i, apart);
        ca_image_release(a);
        ca_image_release(b);
        ca_scene_desc_destroy(&desc);
    }
}

/* ---- Stops ----------------------------------------------------------------------------------------------------- */

#define LENS(file, rest) "Camera \"realistic\" \"string lensfile\" \"" file "\" " rest "\nWorldBegin\n"

static void stops(void **state)
{
    (void)state;
    write_lenses();
    ca_scene_desc desc = import(LENS("lens.dat", ""));
    assert_true(desc.camera.camera.as.realistic.lens.surfaces[3].aperture == 0.5); /* pbrt's default */
    assert_int_equal(desc.notes.count, 0);
    ca_scene_desc_destroy(&desc);
    desc = import(LENS("lens.dat", "\"float aperturediameter\" 17"));
    assert_true(desc.camera.camera.as.realistic.lens.surfaces[3].aperture == 8.0);
    assert_true(notes(&desc, "the aperture of a realistic camera is no wider than the stop of its lens"));
    ca_scene_desc_destroy(&desc);
    desc = import(LENS("open.dat", ""));
    assert_int_equal(desc.notes.count, 0);
    ca_scene_desc_destroy(&desc);
    desc = import(LENS("open.dat", "\"float aperturediameter\" 3"));
    assert_true(notes(&desc, "aperturediameter has no effect on a realistic camera's lens that has no stop"));
    ca_scene_desc_destroy(&desc);
}

/* ---- Mistakes -------------------------------------------------------------------------------------------------- */

static void mistakes_have_places(void **state)
{
    (void)state;
    write_lenses();
#define NO_IMAGE                                                                                                     \
    "the lens makes no image on the film of what is focusdistance in front of the film; its focal length is "
    static const char *const mistakes[][2] = {
        {"\nCamera \"realistic\"\nWorldBegin\n",
         "test.pbrt:2:1: parameter \"lensfile\" of Camera \"realistic\" is missing"},
        {LENS("none.dat", ""), "test.pbrt:1:1: "},
        {LENS("broken.dat", ""), "broken.dat:1:1: surface 1 of the lens: expected the aperture's diameter in mm"},
        {LENS("dark.dat", ""),
         "test.pbrt:1:1: no light gets through the lens to the film: its surfaces 1 and 2 cross"},
        {LENS("spread.dat", ""), "test.pbrt:1:1: " NO_IMAGE "-"},
        {LENS("lens.dat", "\"float focusdistance\" 0.2"), "test.pbrt:1:1: " NO_IMAGE "9"},
        {LENS("stops.dat", ""), "test.pbrt:1:1: aperturediameter needs a lens with one stop, and this has 2"},
        {LENS("lens.dat", "\"string aperture\" \"star\""),
         "test.pbrt:1:49: parameter \"aperture\" of Camera \"realistic\" is not supported: stops are round"},
        {LENS("lens.dat", "\"float focus\" 2"), "test.pbrt:1:49: unused parameter \"focus\" of Camera \"realistic\""},
        {LENS("lens.dat", "\"bool simpleweighting\" \"false\"\n\"float shutterclose\" 0") "WorldEnd\n",
         "test.pbrt:2:1: parameter \"shutterclose\" of Camera \"realistic\" must be later than shutteropen"},
    };
    for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++) {
        char expected[256];
        ca_scene_desc desc;
        ca_error error;
        snprintf(expected, sizeof expected, "%s/%s", import_folder(), mistakes[i][1]);
        if (run(mistakes[i][0], &desc, &error) == CA_OK) fail_msg("imported, but expected %s", expected);
        if (strncmp(error.message, expected, strlen(expected)) != 0)
            fail_msg("\"%s\" instead of \"%s\"", error.message, expected);
    }
}

/* As Mitsuba XML it is the same picture, and its lens is copied. */
static void conversion(void **state)
{
    (void)state;
    write_lenses();
    char to[128];
    ca_scene_desc desc;
    ca_error error;
    ca_scene *scene;
    const char *path = import_write_text("way.pbrt", LOOK CAMERA(SHUT) FILM SAMPLES WORLD);
    snprintf(to, sizeof to, "%s/way.xml", import_folder());
    const ca_scene_source source = {.path = path};
    if (ca_import_convert(&source, to, &desc, &error) != CA_OK) fail_msg("%s", error.message);
    assert_true(notes(&desc, "Mitsuba 3 has no sensor \"realistic\"; it is written as it is"));
    ca_scene_desc_destroy(&desc);
    uint64_t hashes[2];
    for (int i = 0; i < 2; i++) {
        const ca_render_settings settings = {.threads = 1};
        if (ca_scene_load(i ? to : path, NULL, 0, &scene, &error) != CA_OK) fail_msg("%s", error.message);
        hashes[i] = rendered_hash(scene, &settings);
        ca_scene_release(scene);
    }
    assert_true(hashes[0] == hashes[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(film_and_lens), cmocka_unit_test(twins),      cmocka_unit_test(stops),
        cmocka_unit_test(mistakes_have_places), cmocka_unit_test(conversion),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
