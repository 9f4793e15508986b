/* pbrt's scenes: what each thing becomes, by values worked out by hand, and mistakes with their places. */
#include "support/import_text.h"
#include "support/scene_text.h"

#include "base/memory.h"
#include "geometry/curve.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static ca_scene_desc desc;

static ca_status run(const char *text, ca_error *error)
{
    char path[128];
    snprintf(path, sizeof path, "%s/test.pbrt", import_folder());
    return ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, error);
}

static void import(const char *text)
{
    ca_error error;
    if (run(text, &error) != CA_OK) fail_msg("%s", error.message);
}

static void done(void) { ca_scene_desc_destroy(&desc); }

static void expect_error(const char *text, const char *expected)
{
    ca_error error;
    char full[1400];
    snprintf(full, sizeof full, "%s/test.pbrt:%s", import_folder(), expected);
    if (run(text, &error) == CA_OK) {
        done();
        fail_msg("imported, but expected the error %s", expected);
    }
    assert_string_equal(error.message, full);
}

static void near(double actual, double expected)
{
    if (!(fabs(actual - expected) <= 1e-5 * fmax(1.0, fabs(expected))))
        fail_msg("%.9g, expected %.9g", actual, expected);
}

static void is_rgb(ca_rgb c, double r, double g, double b)
{
    near((double)c.r, r);
    near((double)c.g, g);
    near((double)c.b, b);
}

#define FIRST "WorldBegin\n"

/* ---- Mistakes -------------------------------------------------------------------------------------------------- */

typedef struct mistake {
    const char *text, *message;
} mistake;

static void mistakes_have_places(void **state)
{
    (void)state;
    static const mistake mistakes[] = {
        {"", " the scene has no WorldBegin"},
        {"Shape \"sphere\"", "1:1: Shape cannot stand before WorldBegin"},
        {FIRST "Camera \"perspective\"", "2:1: Camera cannot stand behind WorldBegin"},
        {FIRST "Shap \"sphere\"", "2:1: \"Shap\" is not a known directive; the nearest is \"Shape\""},
        {FIRST "\"sphere\"", "2:1: expected a directive, not \"sphere\""},
        {FIRST "  Shape \"sfere\"", "2:3: \"sfere\" is not a known shape; the nearest is \"sphere\""},
        {FIRST "Shape \"sphere\"\n  \"float radios\" 1",
         "3:3: unused parameter \"radios\" of Shape \"sphere\"; the nearest known one is \"radius\""},
        {FIRST "Shape \"sphere\" \"flaot radius\" 1",
         "2:16: \"flaot\" is not a known type; the nearest is \"float\""},
        {FIRST "Shape \"sphere\" \"radius\" 1", "2:16: \"radius\" is not the type and name of a parameter"},
        {FIRST "Shape \"sphere\" \"float radius\" \"big\"", "2:31: a value of \"float radius\" is not a number"},
        {FIRST "Shape \"sphere\" \"float radius\" [1 2]",
         "2:16: parameter \"radius\" of Shape \"sphere\" has 2 values, not 1"},
        {FIRST "Shape \"sphere\" \"float radius\" [1 2",
         "2:16: parameter \"radius\" has no value, or no closing bracket"},
        {FIRST "Shape \"sphere\" \"float radius\" 1e999", "2:31: \"1e999\" is no finite number"},
        {FIRST "Shape \"sphere\" \"float radius\" -1",
         "2:16: parameter \"radius\" of Shape \"sphere\" is -1, and must lie in [1e-30, 1e+30]"},
        {FIRST "Shape \"sphere\" \"float radius\" 1 \"float radius\" 2",
         "2:33: parameter \"radius\" of Shape \"sphere\" is given a second time"},
        {FIRST "Shape \"sphere\" \"integer radius\" 0.5", "2:33: \"0.5\" is no integer of 32 bits"},
        {FIRST "Shape \"nurbs\"", "2:1: shape \"nurbs\" is not supported"},
        {FIRST "Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [0 1 2]",
         "2:51: parameter \"Pz\" of Shape \"heightfield\" must have nu times nv numbers"},
        {FIRST "Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0]",
         "2:15: parameter \"P\" of Shape \"curve\" must have a point more than the degree, or more"},
        {FIRST "Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0 4 0 0]",
         "2:15: parameter \"P\" of Shape \"curve\" must have `degree` points more for each further segment"},
        {FIRST "Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"string type\" \"ribbon\"",
         "2:1: curves of type \"ribbon\" are not supported"},
        {FIRST "AreaLightSource \"diffuse\" Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]",
         "2:27: curves cannot emit light"},
        {FIRST "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]",
         "2:53: parameter \"indices\" of Shape \"trianglemesh\" has one that is no point's"},
        {FIRST "Material \"difuse\"", "2:1: \"difuse\" is not a known material; the nearest is \"diffuse\""},
        {FIRST "Material \"hair\"", "2:1: material \"hair\" is not supported"},
        {FIRST "MakeNamedMaterial \"gold\" \"string type\" \"conductor\"\nNamedMaterial \"glod\"",
         "3:1: there is no material \"glod\"; the nearest is \"gold\""},
        {FIRST "Material \"diffuse\" \"texture reflectance\" \"t\"", "2:20: there is no spectrum texture \"t\""},
        {FIRST "Texture \"t\" \"spectrum\" \"marble\"", "2:1: Texture \"marble\": this texture is not supported"},
        {FIRST "Material \"diffuse\" \"spectrum reflectance\" \"metal-Auu\"",
         "2:20: \"metal-Auu\" is neither the name of a spectrum nor a file that can be read; the nearest name is "
         "\"metal-Au\""},
        {FIRST "LightSource \"spott\"", "2:1: \"spott\" is not a known light; the nearest is \"spot\""},
        {FIRST "AttributeBegin\nTransformBegin\nAttributeEnd",
         "4:1: AttributeEnd, but the open block is the TransformBegin of line 3"},
        {FIRST "AttributeEnd", "2:1: AttributeEnd ends nothing that was begun"},
        {FIRST "AttributeBegin", "2:1: AttributeBegin has no end"},
        {FIRST "ObjectInstance \"tree\"", "2:1: there is no object \"tree\""},
        {FIRST "ObjectBegin \"a\" ObjectBegin \"b\"", "2:17: an object cannot hold another one"},
        {FIRST "CoordSysTransform \"camra\"",
         "2:1: there is no coordinate system \"camra\"; the nearest is \"world\""},
        {FIRST "Shape \"sphere", "2:7: this string has no end on its line"},
        {FIRST "Translate 1 2", "2:14: Translate needs 3 finite numbers, and there are 2"},
        {FIRST "Scale 0 1 1 Shape \"sphere\"", "2:13: this transform is singular, not affine or not finite"},
        {FIRST "MediumInterface \"fog\" \"\"", "2:1: MediumInterface: media are not supported"},
        {FIRST "MakeNamedMedium \"fog\"", "2:1: MakeNamedMedium \"fog\": media are not supported"},
        {"Film \"rgb\" \"integer xresolution\" 0\n" FIRST,
         "1:12: parameter \"xresolution\" of Film \"rgb\" is 0, and must lie in [1, 65536]"},
        {"Camera \"fisheye\"", "1:1: \"fisheye\" is not a known camera; the nearest is \"perspective\""},
        {"Camera \"perspective\" \"float frameaspectratio\" 2\n" FIRST,
         "1:1: the camera's window is not of the film's shape: pixels must be square"},
        {"Integrator \"pat\"", "1:1: \"pat\" is not a known integrator; the nearest is \"path\""},
        {"WorldBegin\nWorldEnd\nShape \"sphere\"", "3:1: Shape cannot stand behind WorldEnd"},
        {"Attribute \"shap\" \"float radius\" 1", "1:1: Attribute \"shap\" is not known; the nearest is \"shape\""},
    };
    for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; i++)
        expect_error(mistakes[i].text, mistakes[i].message);
}

static void definitions_have_no_meaning(void **state)
{
    (void)state;
    ca_error error;
    const ca_define define = {.name = "spp", .value = "4"};
    assert_int_equal(ca_import_scene_text(FIRST, strlen(FIRST), "a.pbrt", &define, 1, &desc, &error),
                     CA_ERROR_ARGUMENT);
    assert_string_equal(error.message, "-D spp=4: a scene of this format has no defaults");
}

/* A file that includes itself ends, and so does one that doubles. */
static void includes_are_limited(void **state)
{
    (void)state;
    ca_error error;
    import_write_text("self.pbrt", "Include \"self.pbrt\"\nInclude \"self.pbrt\"\n");
    assert_int_equal(run(FIRST "Include \"self.pbrt\"", &error), CA_ERROR_SCENE);
    assert_non_null(strstr(error.message, "self.pbrt:1:1: includes are nested more than 16 deep"));
}

/* ---- Values ---------------------------------------------------------------------------------------------------- */

/* Of both versions: what the file leaves out. */
static void defaults_are_those_of_the_version(void **state)
{
    (void)state;
    import(FIRST);
    assert_int_equal(desc.film.width, 1280);
    assert_int_equal(desc.film.height, 720);
    assert_int_equal(desc.film.filter.kind, CA_RFILTER_GAUSSIAN);
    assert_int_equal(desc.sampler.kind, CA_SAMPLER_ZSOBOL);
    assert_int_equal(desc.samples_per_pixel, 16);
    assert_string_equal(desc.integrator.name, "auto");
    near(desc.integrator.parameters.items[0].number, 6.0);
    near((double)desc.camera.camera.as.perspective.tan_half_x, 1280.0 / 720.0);
    done();
    import(FIRST "WorldEnd");
    assert_int_equal(desc.film.width, 640);
    assert_int_equal(desc.film.height, 480);
    assert_int_equal(desc.film.filter.kind, CA_RFILTER_BOX);
    assert_int_equal(desc.sampler.kind, CA_SAMPLER_HALTON);
    assert_string_equal(desc.integrator.name, "auto");
    near(desc.integrator.parameters.items[0].number, 6.0);
    done();
    import("Integrator \"path\"\n" FIRST);
    assert_string_equal(desc.integrator.name, "path");
    done();
}

typedef struct sampling {
    const char *options, *rest;
    ca_sampler_kind kind;
    uint32_t samples;
    uint64_t seed;
} sampling;

/* Integrator and Sampler may stand in any order: iterations are samples, and kind and seed are the sampler's. */
static void iterations_are_samples(void **state)
{
    (void)state;
#define SPPM "Integrator \"sppm\" \"integer iterations\" 5\n"
#define SEVEN "Sampler \"independent\" \"integer pixelsamples\" 12 \"integer seed\" 7\n"
    static const sampling cases[] = {
        {SPPM SEVEN, "", CA_SAMPLER_INDEPENDENT, 5, 7},
        {SEVEN SPPM, "", CA_SAMPLER_INDEPENDENT, 5, 7},
        {SPPM, "", CA_SAMPLER_HALTON, 5, 0},
        {SEVEN "Integrator \"sppm\"\n", "", CA_SAMPLER_INDEPENDENT, 12, 7},
        {"Integrator \"sppm\"\n" SEVEN, "", CA_SAMPLER_INDEPENDENT, 12, 7},
        {"Integrator \"sppm\"\n" SEVEN, "WorldEnd", CA_SAMPLER_INDEPENDENT, 64, 7},
        {SEVEN "Integrator \"sppm\"\n", "WorldEnd", CA_SAMPLER_INDEPENDENT, 64, 7},
        {SEVEN SPPM "Integrator \"path\"\n", "", CA_SAMPLER_INDEPENDENT, 12, 7},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[400];
        snprintf(text, sizeof text, "%s" FIRST "%s", cases[i].options, cases[i].rest);
        import(text);
        assert_int_equal(desc.sampler.kind, cases[i].kind);
        assert_int_equal(desc.samples_per_pixel, cases[i].samples);
        assert_int_equal(desc.sampler.seed, cases[i].seed);
        done();
    }
}

/* The field of view is that of the shorter side. */
static void the_field_of_view_is_the_shorter_sides(void **state)
{
    (void)state;
    import("Film \"rgb\" \"integer xresolution\" 300 \"integer yresolution\" 600\n"
           "Camera \"perspective\" \"float fov\" 60\n" FIRST);
    near((double)desc.camera.camera.as.perspective.tan_half_x, tan(pi / 6.0));
    done();
    import("Film \"rgb\" \"integer xresolution\" 600 \"integer yresolution\" 300\n"
           "Camera \"perspective\" \"float fov\" 60\n" FIRST);
    near((double)desc.camera.camera.as.perspective.tan_half_x, 2.0 * tan(pi / 6.0));
    done();
}

/* Luminance of a light's colour: of version 4 that of a spectrum is 1 times the scale, of version 3 it is the
 * spectrum's own. */
static void spectra_of_lights(void **state)
{
    (void)state;
    import(FIRST "LightSource \"point\" \"blackbody I\" 3200 \"float scale\" 7\n"
                 "LightSource \"point\" \"spectrum I\" [300 2 900 2]\n"
                 "LightSource \"point\" \"spectrum I\" \"stdillum-A\"\n"
                 "LightSource \"point\" \"rgb I\" [1 2 3] \"float scale\" 2\n");
    near((double)ca_luminance(desc.lights.items[0].as.point.intensity), 7.0);
    assert_true(desc.lights.items[0].as.point.intensity.r > 2.0f * desc.lights.items[0].as.point.intensity.b);
    near((double)ca_luminance(desc.lights.items[1].as.point.intensity), 1.0);
    near((double)ca_luminance(desc.lights.items[2].as.point.intensity), 1.0);
    /* 3.2405 X - 1.5371 Y - 0.4985 Z of x = 0.44757, y = 0.40745. */
    assert_true(fabs((double)desc.lights.items[2].as.point.intensity.r - 1.845) < 1e-3);
    is_rgb(desc.lights.items[3].as.point.intensity, 2.0, 4.0, 6.0);
    done();
    import(FIRST "LightSource \"point\" \"spectrum I\" [300 2 900 2]\nWorldEnd");
    assert_true(fabs((double)ca_luminance(desc.lights.items[0].as.point.intensity) - 2.0) < 1e-4);
    done();
}

/* power over what a light of 1 emits. */
static void powers_of_lights(void **state)
{
    (void)state;
    import(FIRST "LightSource \"point\" \"float power\" 100\n"
                 "LightSource \"distant\" \"float illuminance\" 5 \"point to\" [0 -1 0]\n"
                 "LightSource \"infinite\" \"float illuminance\" 5\n"
                 "LightSource \"spot\" \"float power\" 10 \"float coneangle\" 60 \"float conedeltaangle\" 60\n"
                 "AreaLightSource \"diffuse\" \"float power\" 10\nScale 2 2 2 Shape \"disk\"\n"
                 "Shape \"sphere\" \"float radius\" 0.5\n");
    is_rgb(desc.lights.items[0].as.point.intensity, 25.0 / pi, 25.0 / pi, 25.0 / pi);
    is_rgb(desc.lights.items[1].as.directional.irradiance, 5.0, 5.0, 5.0);
    near(desc.lights.items[1].as.directional.direction[1], -1.0);
    is_rgb(desc.lights.items[2].as.constant.radiance, 5.0 / pi, 5.0 / pi, 5.0 / pi);
    near((double)desc.lights.items[3].as.spot.intensity.g, 10.0 / (2.0 * pi * 0.25));
    near((double)desc.textures.items[desc.lights.items[4].as.area.radiance].as.constant.g, 10.0 / (pi * 4.0 * pi));
    near((double)desc.textures.items[desc.lights.items[5].as.area.radiance].as.constant.g, 10.0 / (pi * 4.0 * pi));
    done();
}

/* A picture's own illuminance: constant, it is pi times the value. */
static void film_scales_all_light(void **state)
{
    (void)state;
    import("Film \"rgb\" \"float iso\" 400 \"float exposuretime\" 0.5\n" FIRST
           "LightSource \"point\"\nLightSource \"infinite\"\nAreaLightSource \"diffuse\"\nShape \"sphere\"\n");
    near((double)desc.lights.items[0].as.point.intensity.g, 2.0);
    near((double)desc.lights.items[1].as.constant.radiance.g, 2.0);
    near((double)desc.textures.items[desc.lights.items[2].as.area.radiance].as.constant.g, 2.0);
    done();
}

/* Rec. 2020's red in Rec. 709 (ITU-R BT.2087): 1.6605, -0.1246, -0.0182; white is white. */
static void color_spaces(void **state)
{
    (void)state;
    import(FIRST "ColorSpace \"rec2020\"\nLightSource \"point\" \"rgb I\" [1 0 0]\n"
                 "LightSource \"point\" \"rgb I\" [1 1 1]\nColorSpace \"aces2065-1\"\n"
                 "LightSource \"point\" \"rgb I\" [1 1 1]\n");
    const ca_rgb red = desc.lights.items[0].as.point.intensity;
    assert_true(fabs((double)red.r - 1.6605) < 1e-3 && red.g == 0.0f && red.b == 0.0f);
    is_rgb(desc.lights.items[1].as.point.intensity, 1.0, 1.0, 1.0);
    is_rgb(desc.lights.items[2].as.point.intensity, 1.0, 1.0, 1.0);
    done();
}

/* ---- Shapes ---------------------------------------------------------------------------------------------------- */

/* All corners of an icosahedron go to 0.7236 of their distance, however often it is divided: with five neighbours and
 * the weight 0.1 of each, 1/2 + 0.1 sqrt(5). */
static void subdivision_goes_to_the_limit(void **state)
{
    (void)state;
    for (int levels = 0; levels <= 3; levels++) {
        char text[1024];
        snprintf(text, sizeof text,
                 FIRST
                 "Shape \"loopsubdiv\" \"integer levels\" %d \"integer indices\" [0 11 5 0 5 1 0 1 7 0 7 10 0 10 "
                 "11 1 5 9 5 11 4 11 10 2 10 7 6 7 1 8 3 9 4 3 4 2 3 2 6 3 6 8 3 8 9 4 9 5 2 4 11 6 2 10 8 6 7 "
                 "9 8 1] \"point3 P\" [-1 1.618033988749895 0 1 1.618033988749895 0 -1 -1.618033988749895 0 1 "
                 "-1.618033988749895 0 0 -1 1.618033988749895 0 1 1.618033988749895 0 -1 -1.618033988749895 0 1 "
                 "-1.618033988749895 1.618033988749895 0 -1 1.618033988749895 0 1 -1.618033988749895 0 -1 "
                 "-1.618033988749895 0 1]",
                 levels);
        import(text);
        const ca_mesh *mesh = &desc.meshes.items[0];
        assert_int_equal(mesh->triangle_count, 20 << (2 * levels));
        assert_int_equal(mesh->vertex_count, mesh->triangle_count / 2 + 2);
        for (size_t v = 0; v < 12; v++) {
            const float *x = mesh->positions + 3 * v;
            near(sqrt((double)(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])),
                 (0.5 + 0.1 * sqrt(5.0)) * sqrt(1.0 + 1.618033988749895 * 1.618033988749895));
        }
        assert_non_null(mesh->normals);
        done();
    }
}

/* A boundary stays in its plane, and its straight parts are straight. */
static void subdivision_of_a_plane(void **state)
{
    (void)state;
    import(FIRST "Shape \"loopsubdiv\" \"integer levels\" 2 \"integer indices\" [0 1 3 1 4 3 1 2 4 2 5 4] "
                 "\"point3 P\" [0 0 2 1 0 2 2 0 2 0 1 2 1 1 2 2 1 2]");
    const ca_mesh *mesh = &desc.meshes.items[0];
    assert_int_equal(mesh->triangle_count, 64);
    for (size_t v = 0; v < mesh->vertex_count; v++) near((double)mesh->positions[3 * v + 2], 2.0);
    near((double)mesh->positions[3], 1.0); /* the middle of the lower side */
    near((double)mesh->positions[4], 0.0);
    done();
}

/* A vertex that no triangle uses stays where it is; all others do as without it. */
static void subdivision_with_a_lone_vertex(void **state)
{
    (void)state;
    for (int levels = 0; levels <= 2; levels++) {
        char text[400];
        snprintf(text, sizeof text,
                 FIRST "Shape \"loopsubdiv\" \"integer levels\" %d \"integer indices\" [0 1 2] "
                       "\"point3 P\" [0 0 2 1 0 2 0 1 2 7 8 9]",
                 levels);
        import(text);
        const ca_mesh *mesh = &desc.meshes.items[0];
        assert_int_equal(mesh->triangle_count, 1 << (2 * levels));
        for (size_t v = 0; v < mesh->vertex_count; v++)
            if (v != 3) near((double)mesh->positions[3 * v + 2], 2.0);
        for (size_t i = 0; i < 3; i++) near((double)mesh->positions[9 + i], 7.0 + (double)i);
        done();
    }
}

static double area_of(const ca_mesh *mesh)
{
    double area = 0.0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) area += ca_mesh_triangle_area(mesh, t);
    return area;
}

/* The least cosine between a triangle that has an area and the normals at its corners. */
static double least_cosine(const ca_mesh *mesh)
{
    double least = 1.0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        if (!(ca_mesh_triangle_area(mesh, t) > 1e-7)) continue;
        const uint32_t *corners = mesh->indices + 3 * (size_t)t;
        double edges[2][3], across[3], length = 0.0;
        for (size_t e = 0; e < 2; e++)
            for (size_t i = 0; i < 3; i++)
                edges[e][i] = (double)mesh->positions[3 * (size_t)corners[e + 1] + i] -
                              (double)mesh->positions[3 * (size_t)corners[0] + i];
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            across[i] = edges[0][j] * edges[1][k] - edges[0][k] * edges[1][j];
            length += across[i] * across[i];
        }
        for (int v = 0; v < 3; v++) {
            const float *normal = mesh->normals + 3 * (size_t)corners[v];
            double cosine = 0.0;
            for (int i = 0; i < 3; i++) cosine += across[i] * (double)normal[i] / sqrt(length);
            least = fmin(least, cosine);
        }
    }
    return least;
}

/* Areas of parts of quadrics, up to what a grid lacks. */
static void parts_of_quadrics(void **state)
{
    (void)state;
    import(FIRST "Shape \"sphere\" \"float radius\" 2 \"float zmin\" 0 \"float zmax\" 1 \"float phimax\" 90\n"
                 "Shape \"disk\" \"float radius\" 2 \"float innerradius\" 1 \"float height\" 3\n"
                 "Shape \"cylinder\" \"float radius\" 2 \"float phimax\" 180 \"float zmin\" 1 \"float zmax\" 4\n"
                 "Shape \"cone\" \"float radius\" 3 \"float height\" 4 \"float phimax\" 180\n"
                 "Shape \"paraboloid\" \"float radius\" 2 \"float zmin\" 1 \"float zmax\" 4\n"
                 "Shape \"hyperboloid\" \"point p1\" [1 0 0] \"point p2\" [0 2 0]\n");
    /* Of the paraboloid x^2 + y^2 = z the integral of 2 pi r sqrt(1 + 4 r^2) from 1 to 2; the last is a flat ring
     * from the segment's distance, 2 / sqrt(5), with its nearer part swept twice. */
    const double expected[] = {2.0 * pi * 2.0 * 1.0 / 4.0, pi * 3.0, pi * 2.0 * 3.0, 0.5 * pi * 3.0 * 5.0,
                               pi / 6.0 * (pow(17.0, 1.5) - pow(5.0, 1.5)), pi * (1.0 - 0.8 + 4.0 - 0.8)};
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++)
        if (!(fabs(area_of(&desc.meshes.items[i]) / expected[i] - 1.0) < 1e-3)) fail_msg("part %zu", i);
    near((double)desc.meshes.items[1].positions[2], 3.0);
    for (size_t i = 0; i < 5; i++)
        if (!(least_cosine(&desc.meshes.items[i]) > 0.999)) fail_msg("part %zu", i);
    done();
}

static void waisted_hyperboloids(void **state)
{
    (void)state;
    import(FIRST "Shape \"hyperboloid\" \"point p1\" [1 -2 -2] \"point p2\" [1 2 2]\n");
    const ca_mesh *mesh = &desc.meshes.items[0];
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        const float *p = mesh->positions + 3 * v;
        near(hypot((double)p[0], (double)p[1]), hypot(1.0, (double)p[2]));
    }
    if (!(least_cosine(mesh) > 0.99)) fail();
    done();
}

static void height_fields(void **state)
{
    (void)state;
    import(FIRST "Shape \"heightfield\" \"integer nu\" 3 \"integer nv\" 2 \"float Pz\" [0 1 2  3 4 5.5]");
    const ca_mesh *mesh = &desc.meshes.items[0];
    static const double expected[6][3] = {{0, 0, 0}, {0.5, 0, 1}, {1, 0, 2}, {0, 1, 3}, {0.5, 1, 4}, {1, 1, 5.5}};
    static const uint32_t corners[12] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
    assert_int_equal(mesh->vertex_count, 6);
    assert_int_equal(mesh->triangle_count, 4);
    for (size_t v = 0; v < 6; v++) {
        for (size_t i = 0; i < 3; i++) near((double)mesh->positions[3 * v + i], expected[v][i]);
        near((double)mesh->uvs[2 * v], expected[v][0]);
        near((double)mesh->uvs[2 * v + 1], 1.0 - expected[v][1]);
    }
    assert_memory_equal(mesh->indices, corners, sizeof corners);
    done();
}

/* ---- Curves ---------------------------------------------------------------------------------------------------- */

/* A segment in its middle, x, y, z and the radius: the uniform cubic B-spline's weights there. */
static void expect_middle(uint32_t segment, double x, double y, double z, double radius)
{
    static const double weights[4] = {1.0 / 48.0, 23.0 / 48.0, 23.0 / 48.0, 1.0 / 48.0};
    const double expected[4] = {x, y, z, radius};
    const ca_curve *curve = desc.curves.items[0];
    for (size_t c = 0; c < 4; c++) {
        double at = 0.0;
        for (size_t k = 0; k < 4; k++)
            at += weights[k] * (double)curve->points[4 * ((size_t)curve->segments[segment] + k) + c];
        near(at, expected[c]);
    }
}

/* Where a segment begins. */
static void expect_begin(uint32_t segment, double x, double y, double z, double radius)
{
    const double expected[4] = {x, y, z, radius};
    const ca_curve *curve = desc.curves.items[0];
    const float *p = curve->points + 4 * (size_t)curve->segments[segment];
    for (int c = 0; c < 4; c++) near(((double)p[c] + 4.0 * (double)p[4 + c] + (double)p[8 + c]) / 6.0, expected[c]);
}

/* Middles of Bezier curves are (1 3 3 1) / 8 and (1 2 1) / 4 of their points, of B-splines (1 23 23 1) / 48 and
 * (1 6 1) / 8. */
static void curves_of_all_kinds(void **state)
{
    (void)state;
    import(FIRST "AttributeBegin Scale 2 2 2 Translate 0 0 1\n"
                 "Shape \"curve\" \"point3 P\" [0 0 0  1 2 0  3 1 1  4 0 8] \"float width0\" .2 \"float width1\" 0\n"
                 "AttributeEnd\n"
                 "Shape \"curve\" \"integer degree\" 2 \"point3 P\" [0 0 0  1 2 0  3 1 1  4 0 0  8 8 8]\n"
                 "Shape \"curve\" \"string basis\" \"bspline\" \"point3 P\" [48 0 0  0 48 0  0 0 48  48 0 0  0 0 0]\n"
                 "Shape \"curve\" \"string basis\" \"bspline\" \"integer degree\" 2\n"
                 "\"point3 P\" [8 0 0  0 8 0  0 0 8  8 8 8] \"float width\" 3\n");
    assert_int_equal(desc.curves.count, 1);
    assert_int_equal(desc.shapes.count, 1);
    assert_int_equal(desc.curves.items[0]->segment_count, 7);
    expect_begin(0, 0.0, 0.0, 2.0, 0.2);
    expect_middle(0, 4.0, 2.25, 4.75, 0.1);
    expect_middle(1, 1.25, 1.25, 0.25, 0.5);
    expect_begin(2, 3.0, 1.0, 1.0, 0.5);
    expect_middle(2, 4.75, 2.25, 2.25, 0.5);
    expect_middle(3, 2.0, 23.0, 23.0, 0.5);
    expect_middle(4, 23.0, 1.0, 23.0, 0.5);
    expect_middle(5, 1.0, 6.0, 1.0, 1.5);
    expect_begin(6, 0.0, 4.0, 4.0, 1.5);
    done();
}

/* Curves of one material, one after another, are one shape; an object's are its own. */
static void curves_are_gathered(void **state)
{
    (void)state;
#define HAIR "Shape \"curve\" \"point3 P\" [0 0 0  1 0 0  2 0 0  3 0 0] "
    import(FIRST "Material \"diffuse\"\n" HAIR HAIR "Material \"conductor\"\n" HAIR HAIR HAIR
                 "Shape \"sphere\" " HAIR "\"float alpha\" .5\n" HAIR
                 "ObjectBegin \"hairs\" " HAIR HAIR "ObjectEnd ObjectInstance \"hairs\"\n" HAIR);
    static const uint32_t expected[] = {2, 3, 1, 1, 1, 2};
    uint32_t seen[6] = {0}, total = 0;
    assert_int_equal(desc.curves.count, 6);
    for (size_t i = 0; i < 6; i++) {
        for (size_t k = 0; k < 6; k++) seen[k] += desc.curves.items[i]->segment_count == expected[k];
        total += desc.curves.items[i]->segment_count;
    }
    for (size_t k = 0; k < 6; k++) assert_true(seen[k] > 0);
    assert_int_equal(total, 10);
    done();
}

/* Triangles follow their normals, and ReverseOrientation turns both, but in version 3 no given normals. */
static void normals_decide(void **state)
{
    (void)state;
    static const char mesh[] = FIRST "ReverseOrientation Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] "
                                     "\"normal N\" [0 0 -1 0 0 -1 0 0 -1]\n";
    char old[400];
    import(mesh);
    assert_int_equal(desc.meshes.items[0].indices[1], 2);
    assert_true(desc.shapes.items[0].flip_normals);
    done();
    snprintf(old, sizeof old, "%sWorldEnd", mesh);
    import(old);
    assert_false(desc.shapes.items[0].flip_normals);
    done();
}

/* Round shapes may not fill the memory. */
static void made_triangles_have_a_budget(void **state)
{
    (void)state;
    static char text[1 << 17];
    size_t used = (size_t)snprintf(text, sizeof text, FIRST);
    for (int i = 0; i < 1100; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, "Shape \"sphere\" \"float phimax\" 90\n");
    ca_error error;
    assert_int_equal(run(text, &error), CA_ERROR_SCENE);
    assert_non_null(strstr(error.message, ":1026:1: the scene's round and subdivided shapes are over the limit"));
}

/* What is read otherwise than written is said once. */
static void notes_are_said(void **state)
{
    (void)state;
    import("Sampler \"pmj02bn\"\nIntegrator \"volpath\"\n" FIRST
           "Material \"coatedconductor\"\nMaterial \"coatedconductor\"\n");
    assert_int_equal(desc.notes.count, 3);
    char expected[300];
    snprintf(expected, sizeof expected, "%s/test.pbrt:1:1: sampler \"pmj02bn\" is read as \"sobol\"",
             import_folder());
    assert_string_equal(desc.notes.items[0], expected);
    done();
}

/* With memory for some more allocations each time, until it suffices: before that the only failure is that of
 * memory. */
static void memory_may_run_out(void **state)
{
    (void)state;
    static const char *const scenes[] = {"language", "version3"};
    for (size_t i = 0; i < 2; i++) {
        char path[256];
        ca_error error;
        ca_status status = CA_ERROR_MEMORY;
        snprintf(path, sizeof path, CA_SOURCE_DIR "/tests/fuzz/pbrt/%s.pbrt", scenes[i]);
        for (long count = 0; status == CA_ERROR_MEMORY && count < 100000; count += 3) {
            ca_memory_fail_after(count);
            status = ca_import_scene(path, NULL, 0, &desc, &error);
            ca_memory_fail_after(-1);
        }
        if (status != CA_OK) fail_msg("%s", error.message);
        done();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mistakes_have_places),
        cmocka_unit_test(definitions_have_no_meaning),
        cmocka_unit_test(includes_are_limited),
        cmocka_unit_test(defaults_are_those_of_the_version),
        cmocka_unit_test(iterations_are_samples),
        cmocka_unit_test(the_field_of_view_is_the_shorter_sides),
        cmocka_unit_test(spectra_of_lights),
        cmocka_unit_test(powers_of_lights),
        cmocka_unit_test(film_scales_all_light),
        cmocka_unit_test(color_spaces),
        cmocka_unit_test(subdivision_goes_to_the_limit),
        cmocka_unit_test(subdivision_of_a_plane),
        cmocka_unit_test(subdivision_with_a_lone_vertex),
        cmocka_unit_test(curves_of_all_kinds),
        cmocka_unit_test(curves_are_gathered),
        cmocka_unit_test(parts_of_quadrics),
        cmocka_unit_test(waisted_hyperboloids),
        cmocka_unit_test(height_fields),
        cmocka_unit_test(normals_decide),
        cmocka_unit_test(made_triangles_have_a_budget),
        cmocka_unit_test(notes_are_said),
        cmocka_unit_test(memory_may_run_out),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
