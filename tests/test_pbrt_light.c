/* What is seen of pbrt's scenes: which side things appear on, and the light of each direction, by closed forms. */
#include "support/import_text.h"
#include "support/scene_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

typedef struct color {
    double r, g, b;
} color;

/* Renders the scene and gives back the mean of the pixels with x0 <= x < x1 and y0 <= y < y1. */
static color mean_of(const char *text, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1)
{
    char path[128];
    ca_scene *scene;
    ca_error error;
    uint32_t width, height;
    color sum = {0.0, 0.0, 0.0};
    snprintf(path, sizeof path, "%s/seen.pbrt", import_folder());
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path};
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    const ca_render_settings settings = {.threads = 1};
    ca_image_layers *image = render_scene(scene, &settings);
    ca_image_size(image, &width, &height);
    assert_true(x1 <= width && y1 <= height);
    const float *r = ca_image_channel(image, "R"), *g = ca_image_channel(image, "G"),
                *b = ca_image_channel(image, "B");
    for (uint32_t y = y0; y < y1; y++)
        for (uint32_t x = x0; x < x1; x++) {
            sum.r += (double)r[y * width + x];
            sum.g += (double)g[y * width + x];
            sum.b += (double)b[y * width + x];
        }
    ca_image_release(image);
    ca_scene_release(scene);
    const double count = (double)(x1 - x0) * (double)(y1 - y0);
    return (color){sum.r / count, sum.g / count, sum.b / count};
}

static void is_near(double actual, double expected, double relative)
{
    if (!(fabs(actual - expected) <= relative * fmax(fabs(expected), 1e-3)))
        fail_msg("%.6g, expected %.6g", actual, expected);
}

#define SIZE(width, height)                                                                                          \
    "Film \"rgb\" \"integer xresolution\" " #width " \"integer yresolution\" " #height "\n"                          \
    "PixelFilter \"box\"\n"                                                                                          \
    "Sampler \"independent\" \"integer pixelsamples\" 16\nIntegrator \"path\" \"integer maxdepth\" 1\n"
/* From the origin along z, y up. */
#define AHEAD SIZE(16, 16) "Camera \"perspective\" \"float fov\" 90\n"
#define LAMP_BALL "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"

/* ---- Sides ----------------------------------------------------------------------------------------------------- */

/* pbrt's x is to the right of what its camera sees along z with y up. */
static void x_is_to_the_right(void **state)
{
    (void)state;
    const char *text = AHEAD "WorldBegin\n" LAMP_BALL "Translate 5 0 10 Shape \"sphere\" \"float radius\" 2\n";
    is_near(mean_of(text, 0, 8, 0, 16).g, 0.0, 1e-6);
    assert_true(mean_of(text, 8, 16, 0, 16).g > 0.05);
    const char *turned =
        "Scale -1 1 1\n" AHEAD "WorldBegin\n" LAMP_BALL "Translate 5 0 10 Shape \"sphere\" \"float radius\" 2\n";
    is_near(mean_of(turned, 8, 16, 0, 16).g, 0.0, 1e-6);
    assert_true(mean_of(turned, 0, 8, 0, 16).g > 0.05);
}

/* A window from -1 to 0.6 and from -0.2 to 1 has the middle of the scene at 5/8 from the left, 5/6 from above. */
static void windows_are_off_the_axis(void **state)
{
    (void)state;
    const char *text = SIZE(
        32,
        24) "Camera \"perspective\" \"float fov\" 90 \"float screenwindow\" [-1 0.6 -0.2 1]\nWorldBegin\n" LAMP_BALL
            "Translate 0 0 10 Shape \"sphere\" \"float radius\" 0.5\n";
    assert_true(mean_of(text, 19, 21, 19, 21).g > 0.3);
    is_near(mean_of(text, 0, 32, 0, 18).g, 0.0, 1e-6);
    is_near(mean_of(text, 0, 18, 0, 24).g, 0.0, 1e-6);
}

/* The picture's upper left is red, where (s, t) = (0, 1). */
static void pictures_are_upright(void **state)
{
    (void)state;
    const char *text = AHEAD
        "WorldBegin\nLightSource \"infinite\"\n"
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"picture.pfm\" \"string filter\" \"point\" "
        "\"float scale\" 0.5\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n"
        "Shape \"trianglemesh\" \"point3 P\" [-9 -9 9 9 -9 9 9 9 9 -9 9 9] \"point2 uv\" [0 0 1 0 1 1 0 1] "
        "\"integer indices\" [0 1 2 0 2 3]\n";
    import_write_picture();
    const color upper_left = mean_of(text, 1, 7, 1, 7), upper_right = mean_of(text, 9, 15, 1, 7),
                lower_left = mean_of(text, 1, 7, 9, 15);
    is_near(upper_left.r, 0.5, 3e-2);
    is_near(upper_left.g, 0.0, 3e-2);
    is_near(upper_right.g, 0.5, 3e-2);
    is_near(lower_left.b, 0.5, 3e-2);
}

/* With vscale 2 and vdelta 0.25, the lowest eighth has t from 0.25 to 0.5, and above it the upper row begins. */
static void coordinates_are_scaled_from_below(void **state)
{
    (void)state;
    const char *text = AHEAD
        "WorldBegin\nLightSource \"infinite\"\n"
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"picture.pfm\" \"string filter\" \"point\" "
        "\"float scale\" 0.5 \"float vscale\" 2 \"float vdelta\" 0.25\n"
        "Material \"diffuse\" \"texture reflectance\" \"t\"\n"
        "Shape \"trianglemesh\" \"point3 P\" [-9 -9 9 9 -9 9 9 9 9 -9 9 9] \"point2 uv\" [0 0 1 0 1 1 0 1] "
        "\"integer indices\" [0 1 2 0 2 3]\n";
    import_write_picture();
    is_near(mean_of(text, 1, 7, 11, 13).r, 0.5, 3e-2);
    is_near(mean_of(text, 1, 7, 14, 16).b, 0.5, 3e-2);
}

/* tex1 lies at the origin of (s, t). */
static void checkers_begin_below(void **state)
{
    (void)state;
    const char *text = AHEAD
        "WorldBegin\nLightSource \"infinite\"\n"
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.8 0 0] \"rgb tex2\" [0 .8 0] \"float uscale\" 2 "
        "\"float vscale\" 4\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n"
        "Shape \"trianglemesh\" \"point3 P\" [-9 -9 9 9 -9 9 9 9 9 -9 9 9] \"point2 uv\" [0 0 1 0 1 1 0 1] "
        "\"integer indices\" [0 1 2 0 2 3]\n";
    is_near(mean_of(text, 1, 7, 13, 15).r, 0.8, 3e-2);
    is_near(mean_of(text, 9, 15, 13, 15).g, 0.8, 3e-2);
    is_near(mean_of(text, 1, 7, 9, 11).g, 0.8, 3e-2);
}

/* Shapes that shine do so on one side, the one their normal is on, however they are turned or mirrored. */
static void lights_have_sides(void **state)
{
    (void)state;
    static const struct {
        const char *shape;
        double seen;
    } cases[] = {
        {"Translate 0 0 2 Shape \"disk\" \"float radius\" 9\n", 0.0},
        {"Translate 0 0 2 ReverseOrientation Shape \"disk\" \"float radius\" 9\n", 1.0},
        {"Translate 0 0 2 Rotate 180 0 1 0 Shape \"disk\" \"float radius\" 9\n", 1.0},
        {"Translate 0 0 2 Scale -1 1 1 Rotate 180 0 1 0 Shape \"disk\" \"float radius\" 9\n", 1.0},
        {"Translate 0 0 2 Scale 1 1 -1 Shape \"disk\" \"float radius\" 9\n", 1.0},
        {"Scale 9 9 2 Shape \"trianglemesh\" \"point3 P\" [-1 -1 1 1 -1 1 1 1 1 -1 1 1] \"integer indices\" "
         "[0 1 2 0 2 3]\n",
         0.0},
        {"Scale 9 9 2 Shape \"trianglemesh\" \"point3 P\" [-1 -1 1 1 -1 1 1 1 1 -1 1 1] \"integer indices\" "
         "[0 2 1 0 3 2]\n",
         1.0},
        {"Scale -9 9 2 Shape \"trianglemesh\" \"point3 P\" [-1 -1 1 1 -1 1 1 1 1 -1 1 1] \"integer indices\" "
         "[0 2 1 0 3 2]\n",
         1.0},
        {"Scale 9 9 2 Shape \"trianglemesh\" \"point3 P\" [-1 -1 1 1 -1 1 1 1 1 -1 1 1] \"integer indices\" "
         "[0 1 2 0 2 3] \"normal N\" [0 0 -1 0 0 -1 0 0 -1 0 0 -1]\n",
         1.0},
        {"Shape \"sphere\" \"float radius\" 9\n", 0.0},
        {"ReverseOrientation Shape \"sphere\" \"float radius\" 9\n", 1.0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[1024];
        snprintf(text, sizeof text, "%sWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n%s%s", AHEAD,
                 LAMP_BALL, cases[i].shape);
        const double seen = mean_of(text, 2, 14, 2, 14).g;
        if (!(fabs(seen - cases[i].seen) < 1e-4)) fail_msg("case %zu: %g, expected %g", i, seen, cases[i].seen);
    }
}

/* Lights with two sides are seen from both, inside and outside. */
static void lights_with_two_sides(void **state)
{
    (void)state;
    static const char *const shapes[] = {
        "Translate 0 0 2 Shape \"disk\" \"float radius\" 9\n",
        "Translate 0 0 2 ReverseOrientation Shape \"disk\" \"float radius\" 9\n",
        "Shape \"sphere\" \"float radius\" 9\n",
        "Translate 0 0 9 Shape \"sphere\" \"float radius\" 8\n",
        "ReverseOrientation Shape \"sphere\" \"float radius\" 9\n",
        "Scale 9 9 2 Shape \"trianglemesh\" \"point3 P\" [-1 -1 1 1 -1 1 1 1 1 -1 1 1] \"integer indices\" "
        "[0 2 1 0 3 2]\n",
        "Scale 9 9 2 Shape \"trianglemesh\" \"point3 P\" [-1 -1 1 1 -1 1 1 1 1 -1 1 1] \"integer indices\" "
        "[0 1 2 0 2 3]\n",
        "Scale 9 9 2 ReverseOrientation Shape \"trianglemesh\" \"point3 P\" [-1 -1 1 1 -1 1 1 1 1 -1 1 1] "
        "\"integer indices\" [0 1 2 0 2 3]\n",
        "Translate 0 0 9 Shape \"cylinder\" \"float radius\" 4 \"float zmin\" -6 \"float zmax\" 6\n",
    };
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "%sWorldBegin\nAreaLightSource \"diffuse\" \"bool twosided\" true\nMaterial \"diffuse\" \"rgb "
                 "reflectance\" [0 0 0]\n%s",
                 AHEAD, shapes[i]);
        const bool hollow = strstr(shapes[i], "cylinder") != NULL;
        const double seen = hollow ? mean_of(text, 0, 2, 4, 12).g : mean_of(text, 4, 12, 4, 12).g;
        if (!(fabs(seen - 1.0) < 1e-4)) fail_msg("shape %zu: %g", i, seen);
    }
}

/* ---- The sky --------------------------------------------------------------------------------------------------- */

/* Only one pixel, that looks along the direction. */
static color sky_towards(const char *light, double x, double y, double z)
{
    char text[2048];
    snprintf(text, sizeof text,
             "%sLookAt 0 0 0 %.9g %.9g %.9g %g %g %g\nCamera \"perspective\" \"float fov\" 0.1\nWorldBegin\n%s",
             SIZE(1, 1), x, y, z, fabs(z) > 0.9 ? 1.0 : 0.0, 0.0, fabs(z) > 0.9 ? 0.0 : 1.0, light);
    return mean_of(text, 0, 1, 0, 1);
}

static void write_pfm(const char *name, uint32_t width, uint32_t height, const float *rows_from_above)
{
    static unsigned char bytes[1 << 16];
    const int header = snprintf((char *)bytes, sizeof bytes, "PF\n%u %u\n-1.0\n", width, height);
    assert_true(header > 0 && (size_t)header + 12 * (size_t)width * height <= sizeof bytes);
    for (uint32_t y = 0; y < height; y++)
        memcpy(bytes + header + 12 * (size_t)(height - 1 - y) * width, rows_from_above + 3 * (size_t)y * width,
               12 * (size_t)width);
    import_write(name, bytes, (size_t)header + 12 * (size_t)width * height);
}

/* Version 3: longitude from x towards y, the first row at z. */
static void skies_of_version_3(void **state)
{
    (void)state;
    static const char light[] = "LightSource \"infinite\" \"string mapname\" \"sky3.pfm\"\nWorldEnd\n";
    float pixels[3 * 8 * 5];
    for (int i = 0; i < 8 * 5; i++) {
        pixels[3 * i] = (float)(i % 8);
        pixels[3 * i + 1] = (float)(i / 8);
        pixels[3 * i + 2] = 1.0f;
    }
    write_pfm("sky3.pfm", 8, 5, pixels);
    for (int column = 0; column < 8; column++) {
        const double phi = 2.0 * pi * (column + 0.5) / 8.0;
        const color seen = sky_towards(light, cos(phi), sin(phi), 0.0);
        assert_true(fabs(seen.r - column) < 0.02 && fabs(seen.g - 2.0) < 0.02);
    }
    assert_true(sky_towards(light, 0.0, 0.0, 1.0).g < 0.1);
    assert_true(sky_towards(light, 0.0, 0.0, -1.0).g > 3.9);
    const color turned = sky_towards("Rotate 90 0 0 1\nLightSource \"infinite\" \"string mapname\" \"sky3.pfm\"\n"
                                     "WorldEnd\n",
                                     -sin(pi / 8.0), cos(pi / 8.0), 0.0);
    assert_true(fabs(turned.r) < 0.02); /* what was at 22.5 degrees is at 112.5 */
}

/* The direction behind a place of the equal-area square, both coordinates in [-1, 1]: the inner square is the upper
 * half sphere; |z| = 1 - r^2 with r the distance from the middle, or from the corner, in the norm |u| + |v|. */
static void direction_of(double u, double v, double d[3])
{
    const double from_middle = fabs(u) + fabs(v), r = 1.0 - fabs(1.0 - from_middle);
    const double along = from_middle <= 1.0 ? fabs(v) : 1.0 - fabs(u);
    const double phi = r > 0.0 ? along / r * pi / 2.0 : 0.0, across = r * sqrt(2.0 - r * r);
    d[0] = copysign(cos(phi) * across, u);
    d[1] = copysign(sin(phi) * across, v);
    d[2] = from_middle <= 1.0 ? 1.0 - r * r : r * r - 1.0;
}

enum { SIDE = 64 };

/* Each pixel has its direction for a colour, (d + 1) / 2. */
static void write_directions(const char *name)
{
    static float pixels[3 * SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) {
        double d[3];
        direction_of(2.0 * (i % SIDE + 0.5) / SIDE - 1.0, 2.0 * (i / SIDE + 0.5) / SIDE - 1.0, d);
        for (int k = 0; k < 3; k++) pixels[3 * i + k] = (float)(0.5 * d[k] + 0.5);
    }
    write_pfm(name, SIDE, SIDE, pixels);
}

static const double directions[][3] = {{1, 0, 0},      {0, 1, 0},     {0, 0, 1},      {-1, 0, 0},    {0, -1, 0},
                                       {0, 0, -1},     {1, 2, 3},     {-3, 1, 2},     {2, -3, -1},   {-1, -0.8, -0.7},
                                       {1, -0.2, 0.3}, {-1, 2, -1.5}, {0.1, 0.2, -1}, {0.4, -1, 0.8}};
enum { DIRECTION_COUNT = sizeof directions / sizeof *directions };

static void unit_direction(size_t i, double d[3])
{
    const double *a = directions[i], length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (int k = 0; k < 3; k++) d[k] = a[k] / length;
}

static void skies_of_version_4(void **state)
{
    (void)state;
    write_directions("sky4.pfm");
    for (size_t i = 0; i < DIRECTION_COUNT; i++) {
        double d[3];
        unit_direction(i, d);
        const color seen =
            sky_towards("LightSource \"infinite\" \"string filename\" \"sky4.pfm\"\n", d[0], d[1], d[2]);
        if (!(fabs(2.0 * seen.r - 1.0 - d[0]) < 0.05 && fabs(2.0 * seen.g - 1.0 - d[1]) < 0.05 &&
              fabs(2.0 * seen.b - 1.0 - d[2]) < 0.05))
            fail_msg("direction %zu: (%g, %g, %g)", i, 2 * seen.r - 1, 2 * seen.g - 1, 2 * seen.b - 1);
    }
}

/* ---- Lights in one point --------------------------------------------------------------------------------------- */

/* The intensity of a light at the origin towards d: a white plane at distance 2 across it has the radiance
 * I / (4 pi), seen from beside the light. */
static double intensity_in(uint32_t version, const char *light, const double d[3])
{
    char text[2048];
    const bool old = version == 3;
    snprintf(text, sizeof text,
             "%sLookAt 0 0 0 %.9g %.9g %.9g %g %g %g\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\n%s\n"
             "CoordSysTransform \"camera\"\nMaterial %s [1 1 1]\n"
             "Translate 0 0 2 Shape \"disk\" \"float radius\" 0.1\n%s",
             SIZE(8, 8), d[0], d[1], d[2], fabs(d[2]) > 0.9 ? 1.0 : 0.0, 0.0, fabs(d[2]) > 0.9 ? 0.0 : 1.0, light,
             old ? "\"matte\" \"rgb Kd\"" : "\"diffuse\" \"rgb reflectance\"", old ? "WorldEnd\n" : "");
    return mean_of(text, 0, 8, 0, 8).g * 4.0 * pi;
}

static double intensity_towards(const char *light, const double d[3]) { return intensity_in(4, light, d); }

static void spots_fall_off(void **state)
{
    (void)state;
    static const char new_spot[] = "LightSource \"spot\" \"point to\" [0 0 1] \"float coneangle\" 40 "
                                   "\"float conedeltaangle\" 30 \"rgb I\" [5 5 5]\n";
    char old_spot[400];
    snprintf(old_spot, sizeof old_spot, "%s", new_spot);
    for (int degrees = 0; degrees <= 45; degrees += 5) {
        const double angle = degrees * pi / 180.0, d[3] = {sin(angle), 0.0, cos(angle)};
        const double t = (cos(angle) - cos(40.0 * pi / 180.0)) / (cos(10.0 * pi / 180.0) - cos(40.0 * pi / 180.0));
        const double s = fmin(fmax(t, 0.0), 1.0);
        is_near(intensity_towards(new_spot, d), 5.0 * s * s * (3.0 - 2.0 * s), 1e-3);
    }
    const double angle = 25.0 * pi / 180.0;
    const double t = (cos(angle) - cos(40.0 * pi / 180.0)) / (cos(10.0 * pi / 180.0) - cos(40.0 * pi / 180.0));
    char text[2048];
    snprintf(text, sizeof text,
             "%sLookAt 0 0 0 %.9g 0 %.9g 0 1 0\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\n%s\n"
             "CoordSysTransform \"camera\"\nMaterial \"matte\" \"rgb Kd\" [1 1 1]\n"
             "Translate 0 0 2 Shape \"disk\" \"float radius\" 0.1\nWorldEnd\n",
             SIZE(1, 1), sin(angle), cos(angle), old_spot);
    is_near(mean_of(text, 0, 1, 0, 1).g * 4.0 * pi, 5.0 * t * t * t * t, 1e-3);
}

/* A diagram that is brighter to one side of its x, more so of its y and most of its z; the light's y is the map's
 * z. */
static void goniometric_lights(void **state)
{
    (void)state;
    static const double slopes[3] = {0.1, 0.4, 0.8};
    float pixels[3 * SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) {
        double d[3];
        direction_of(2.0 * (i % SIDE + 0.5) / SIDE - 1.0, 2.0 * (i / SIDE + 0.5) / SIDE - 1.0, d);
        for (int k = 0; k < 3; k++) pixels[3 * i + k] = (float)(1.0 + slopes[k] * d[k]);
    }
    write_pfm("diagram.pfm", SIDE, SIDE, pixels);
    for (size_t i = 0; i < DIRECTION_COUNT; i++) {
        double d[3];
        unit_direction(i, d);
        const double expected = 3.0 + slopes[0] * d[0] + slopes[1] * d[2] + slopes[2] * d[1];
        const double seen = intensity_towards("LightSource \"goniometric\" \"string filename\" \"diagram.pfm\" "
                                              "\"float scale\" 3\n",
                                              d);
        if (!(fabs(seen - expected) < 0.08)) fail_msg("direction %zu: %g, expected %g", i, seen, expected);
    }
}

/* The picture is an intensity, whatever the angle. Where y is up its first row is above in version 4, below in
 * version 3: green is red's neighbour along x, blue along y. */
static void projections(void **state)
{
    (void)state;
    static const float pixels[] = {3, 1, 3, 3, 2, 3, 3, 4, 3, 3, 8, 3}; /* green: 1 2 / 4 8 */
    static const char light[] = "LightSource \"projection\" \"string filename\" \"slide.pfm\" \"float fov\" 80\n";
    static const char old_light[] = "LightSource \"projection\" \"string mapname\" \"slide.pfm\" \"float fov\" 80\n";
    write_pfm("slide.pfm", 2, 2, pixels);
    const double places[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}};
    const double expected[4] = {4, 8, 1, 2}, old_expected[4] = {1, 2, 4, 8};
    for (int i = 0; i < 4; i++)
        for (int far = 0; far < 2; far++) {
            const double reach = far ? 1.5 * 0.8390996 : 0.5; /* near the edge, and nearer to the middle */
            const double x = places[i][0] * reach, y = places[i][1] * reach, length = sqrt(x * x + y * y + 1.0);
            const double d[3] = {x / length, y / length, 1.0 / length};
            is_near(intensity_towards(light, d), expected[i], 1e-2);
            is_near(intensity_in(3, old_light, d), old_expected[i], 1e-2);
        }
    const double aside[3] = {0.8, 0.0, 0.6};
    is_near(intensity_towards(light, aside), 0.0, 1e-2);
}

/* The angle is that of the shorter side. */
static void wide_projections(void **state)
{
    (void)state;
    static const float pixels[] = {5, 5, 5, 5, 5, 5};
    static const char light[] = "LightSource \"projection\" \"string filename\" \"wide.pfm\" \"float fov\" 60\n";
    static const struct {
        double x, y;
        bool lit;
    } places[] = {{0.0, 0.55, true}, {0.0, 0.6, false}, {1.1, 0.0, true}, {1.2, 0.0, false}, {-1.1, -0.5, true}};
    write_pfm("wide.pfm", 2, 1, pixels);
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        const double x = places[i].x, y = places[i].y, length = sqrt(x * x + y * y + 1.0);
        const double d[3] = {x / length, y / length, 1.0 / length};
        is_near(intensity_towards(light, d), places[i].lit ? 5.0 : 0.0, 1e-2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(x_is_to_the_right),     cmocka_unit_test(windows_are_off_the_axis),
        cmocka_unit_test(pictures_are_upright),  cmocka_unit_test(coordinates_are_scaled_from_below),
        cmocka_unit_test(checkers_begin_below),  cmocka_unit_test(lights_have_sides),
        cmocka_unit_test(lights_with_two_sides), cmocka_unit_test(skies_of_version_3),
        cmocka_unit_test(skies_of_version_4),    cmocka_unit_test(spots_fall_off),
        cmocka_unit_test(goniometric_lights),    cmocka_unit_test(projections),
        cmocka_unit_test(wide_projections),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
