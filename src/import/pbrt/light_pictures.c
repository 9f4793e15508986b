/* Lights that are pictures: the sky, projections and goniometric diagrams. Pictures of version 4 cover the sphere by
 * an equal-area map of the octahedron (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD");
 * those of version 3 are latitude and longitude, as ours are. What has no light of its own in the scene language is
 * made of the pictures of others. */
#include "import/pbrt/reader.h"

#include "base/text.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

/* The pixel at (u, v), v downwards, both in [0, 1]. */
static ca_rgb pixel_at(const ca_image *image, double u, double v)
{
    const double x = fmin(fmax(u * image->width, 0.0), image->width - 1.0);
    const double y = fmin(fmax(v * image->height, 0.0), image->height - 1.0);
    return ca_image_rgb(image, (uint32_t)x, (uint32_t)y);
}

/* Clarberg's square of a unit direction. */
static void square_of(const double d[3], double uv[2])
{
    const double r = sqrt(fmax(0.0, 1.0 - fabs(d[2])));
    const double phi = d[0] == 0.0 && d[1] == 0.0 ? 0.0 : atan2(fabs(d[1]), fabs(d[0])) * (2.0 / pi);
    const double across = phi * r, along = r - across;
    const double x = d[2] < 0.0 ? 1.0 - across : along, y = d[2] < 0.0 ? 1.0 - along : across;
    uv[0] = 0.5 * (copysign(x, d[0]) + 1.0);
    uv[1] = 0.5 * (copysign(y, d[1]) + 1.0);
}

static ca_rgb towards(const ca_image *image, const double d[3])
{
    double uv[2];
    square_of(d, uv);
    return pixel_at(image, uv[0], uv[1]);
}

static bool is_square(ca_pbrt *p, const ca_image *image)
{
    if (image->width == image->height) return true;
    ca_import_fail(p->importer, &p->params.where,
                   "a picture of all directions is square in version 4, and this one is of %u x %u pixels",
                   image->width, image->height);
    return false;
}

/* ---- The sky --------------------------------------------------------------------------------------------------- */

/* From the frame of envmap, whose y is up, to pbrt's, whose z is. */
static const ca_matrix from_envmap = {{{0, 0, -1, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}};

static ca_xml_node *add_sky(ca_pbrt *p, const double factor[3])
{
    ca_matrix ctm = p->state.ctm;
    for (int i = 0; i < 3; i++) ctm.m[i][3] = 0.0;
    const ca_matrix to_world = ca_matrix_multiply(&ctm, &from_envmap);
    ca_xml_node *emitter = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "emitter", "envmap");
    ca_tree_transform(&p->tree, emitter, "to_world", &to_world);
    ca_tree_rgb(&p->tree, emitter, "scale", factor);
    return emitter;
}

/* The mean of a picture's pixels around a direction: cells are sampled 4 x 4, so that small lights are not lost. */
static void resample(const ca_image *image, uint32_t width, uint32_t height, uint32_t x, uint32_t y, float rgb[3])
{
    enum { GRID = 4 };
    double sum[3] = {0.0, 0.0, 0.0}, weights = 0.0;
    for (int i = 0; i < GRID * GRID; i++) {
        const double phi = 2.0 * pi * (x + (i % GRID + 0.5) / GRID) / width;
        const double theta = pi * (y - 0.5 + (i / GRID + 0.5) / (double)GRID) / (height - 1.0);
        if (theta < 0.0 || theta > pi) continue;
        const double d[3] = {cos(phi) * sin(theta), sin(phi) * sin(theta), cos(theta)}, weight = sin(theta);
        const ca_rgb pixel = towards(image, d);
        sum[0] += weight * (double)pixel.r, sum[1] += weight * (double)pixel.g, sum[2] += weight * (double)pixel.b;
        weights += weight;
    }
    for (int i = 0; i < 3; i++) rgb[i] = (float)(sum[i] / weights);
}

/* Of light from above on a level plane. */
static double illuminance_of(const ca_image *image)
{
    enum { ROWS = 256, COLUMNS = 512 };
    double sum = 0.0;
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        const double cosine = (i / COLUMNS + 0.5) / ROWS, phi = 2.0 * pi * (i % COLUMNS + 0.5) / COLUMNS;
        const double sine = sqrt(1.0 - cosine * cosine), d[3] = {cos(phi) * sine, sin(phi) * sine, cosine};
        sum += cosine * (double)ca_luminance(towards(image, d));
    }
    return 2.0 * pi * sum / (ROWS * COLUMNS);
}

static void put_square_sky(ca_pbrt *p, const ca_image *image, const double factor[3])
{
    ca_tree_bitmap bitmap;
    double scaled[3];
    const double wanted = ca_pbrt_number(&p->params, "illuminance", -1.0);
    const double has = wanted > 0.0 ? illuminance_of(image) : 0.0;
    for (int i = 0; i < 3; i++) scaled[i] = factor[i] * (wanted > 0.0 && has > 0.0 ? wanted / has : 1.0);
    const uint32_t height = image->height < 8 ? 8 : image->height, width = 2 * height;
    if (!is_square(p, image)) return;
    if (width > CA_IMAGE_MAX_SIDE) {
        ca_import_fail(p->importer, &p->params.where, "the picture is too large");
        return;
    }
    if (!ca_tree_add_bitmap(&p->tree, width, height, 3, &bitmap)) return;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            resample(image, width, height, x, y, bitmap.pixels + 3 * ((size_t)y * width + x));
    ca_tree_string(&p->tree, add_sky(p, scaled), "data", bitmap.name);
}

void ca_pbrt_read_sky(ca_pbrt *p, const char *file, const double factor[3])
{
    ca_image image;
    if (p->version == 3) {
        ca_tree_string(&p->tree, add_sky(p, factor), "filename", file);
        return;
    }
    if (!ca_pbrt_read_picture(p, file, CA_ENCODING_SRGB, &image)) return;
    put_square_sky(p, &image, factor);
    ca_image_destroy(&image);
}

/* ---- Projectors ------------------------------------------------------------------------------------------------ */

/* The current transform without its scale. */
static ca_matrix rigid_frame(ca_pbrt *p)
{
    ca_matrix frame = p->state.ctm;
    const double scale = cbrt(fabs(ca_matrix_determinant3(&frame)));
    if (!ca_import_is_similarity(&frame) || !(scale > 0.0))
        ca_import_fail(p->importer, &p->params.where, "the transform of this light cannot stretch it");
    for (int i = 0; i < 9; i++) frame.m[i / 3][i % 3] /= scale;
    return frame;
}

/* A projector whose picture spans tan_x and tan_y from its axis; its pixels are given as `bitmap`. */
static void add_projector(ca_pbrt *p, const ca_matrix *to_world, double tan_x, const ca_tree_bitmap *bitmap,
                          const double factor[3])
{
    ca_xml_node *emitter = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "emitter", "projector");
    ca_tree_transform(&p->tree, emitter, "to_world", to_world);
    ca_tree_float(&p->tree, emitter, "fov", 2.0 * atan(tan_x) * (180.0 / pi));
    ca_tree_string(&p->tree, emitter, "fov_axis", "x");
    ca_xml_node *scale = ca_tree_named_object(&p->tree, emitter, "texture", "scale", "irradiance", NULL);
    ca_tree_rgb(&p->tree, scale, "scale", factor);
    ca_xml_node *picture = ca_tree_object(&p->tree, scale, "texture", "bitmap");
    ca_tree_string(&p->tree, picture, "data", bitmap->name);
    ca_tree_string(&p->tree, picture, "wrap_mode", "clamp");
}

/* The plane's point at z = 1 under a pixel of a projector's picture: x to the left, y upwards. */
static void plane_of(uint32_t x, uint32_t y, uint32_t width, uint32_t height, double tan_x, double tan_y,
                     double plane[2])
{
    plane[0] = tan_x * (1.0 - 2.0 * (x + 0.5) / width);
    plane[1] = tan_y * (1.0 - 2.0 * (y + 0.5) / height);
}

/* A projector's irradiance at z = 1, over pi, of an intensity of 1. */
static double irradiance_of_one(const double plane[2])
{
    return pow(1.0 + plane[0] * plane[0] + plane[1] * plane[1], -1.5) / pi;
}

/* pbrt's picture is an intensity; in version 3 it stands upside down where y is up. Its flux at scale 1 is added to
 * *power. */
static void fill_projection(const ca_image *image, uint32_t version, uint32_t copies, double tan_x, double tan_y,
                            float *pixels, double *power)
{
    const uint32_t width = image->width * copies, height = image->height * copies;
    const double cell = 4.0 * tan_x * tan_y / ((double)width * height);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++, pixels += 3) {
            double plane[2];
            plane_of(x, y, width, height, tan_x, tan_y, plane);
            const uint32_t row = version == 3 ? height - 1 - y : y;
            const ca_rgb pixel = ca_image_rgb(image, (width - 1 - x) / copies, row / copies);
            const float factor = (float)irradiance_of_one(plane);
            pixels[0] = pixel.r * factor, pixels[1] = pixel.g * factor, pixels[2] = pixel.b * factor;
            *power += (double)ca_luminance(pixel) * irradiance_of_one(plane) * pi * cell;
        }
}

static void put_projection(ca_pbrt *p, const ca_image *image, double degrees, double factor[3])
{
    enum { SMALL = 256 };
    const double tangent = tan(0.5 * degrees * (pi / 180.0)), aspect = (double)image->width / image->height;
    const double tan_x = aspect > 1.0 ? tangent * aspect : tangent, tan_y = tan_x / aspect;
    const uint32_t side = image->width < image->height ? image->width : image->height;
    const uint32_t copies = side < SMALL ? (SMALL + side - 1) / side : 1;
    const double wanted = ca_pbrt_number(&p->params, "power", -1.0);
    double has = 0.0;
    ca_tree_bitmap bitmap;
    if ((uint64_t)image->width * copies > CA_IMAGE_MAX_SIDE || (uint64_t)image->height * copies > CA_IMAGE_MAX_SIDE) {
        ca_import_fail(p->importer, &p->params.where, "the picture is too long for its height");
        return;
    }
    if (!ca_tree_add_bitmap(&p->tree, image->width * copies, image->height * copies, 3, &bitmap)) return;
    fill_projection(image, p->version, copies, tan_x, tan_y, bitmap.pixels, &has);
    for (int i = 0; i < 3 && wanted > 0.0 && has > 0.0; i++) factor[i] *= wanted / has;
    const ca_matrix frame = rigid_frame(p);
    add_projector(p, &frame, tan_x, &bitmap, factor);
}

/* I (version 3) times scale times the film's exposure. */
static void read_intensity(ca_pbrt *p, double factor[3])
{
    double scale[3] = {1.0, 1.0, 1.0};
    factor[0] = factor[1] = factor[2] = 1.0;
    ca_pbrt_light_color(p, "I", factor);
    ca_pbrt_color(p, "scale", CA_COLOR_EMISSION, scale);
    for (int i = 0; i < 3; i++) factor[i] *= scale[i] * p->exposure;
}

static const char *picture_name(ca_pbrt *p)
{
    return ca_pbrt_string(&p->params, ca_pbrt_find(&p->params, "mapname") ? "mapname" : "filename", "");
}

void ca_pbrt_read_projection(ca_pbrt *p)
{
    double factor[3];
    ca_image image;
    const char *file = picture_name(p);
    const double degrees = ca_pbrt_number_in(&p->params, "fov", p->version == 3 ? 45.0 : 90.0, 0.01, 179.0);
    read_intensity(p, factor);
    if (!file[0]) ca_pbrt_fail(&p->params, "filename", "is missing");
    if (!ca_import_good(p->importer) || !ca_pbrt_read_picture(p, file, CA_ENCODING_SRGB, &image)) return;
    put_projection(p, &image, degrees, factor);
    ca_image_destroy(&image);
}

/* ---- Goniometric diagrams -------------------------------------------------------------------------------------- */

/* Version 4: the square map, whose axes y and z are the light's z and y; version 3: latitude and longitude around y.
 * One channel, the mean. */
static double diagram_towards(const ca_image *image, uint32_t version, const double d[3])
{
    ca_rgb pixel;
    if (version == 3) {
        const double phi = atan2(d[2], d[0]);
        pixel =
            pixel_at(image, (phi < 0.0 ? phi + 2.0 * pi : phi) / (2.0 * pi), acos(fmin(fmax(d[1], -1.0), 1.0)) / pi);
    } else {
        const double exchanged[3] = {d[0], d[2], d[1]};
        pixel = towards(image, exchanged);
    }
    return ((double)pixel.r + (double)pixel.g + (double)pixel.b) / 3.0;
}

/* One face of the cube around the light, whose axes are x (to the left), y and z. */
static void put_face(ca_pbrt *p, const ca_image *image, uint32_t face, uint32_t side, const double factor[3])
{
    static const double axes[6][3][3] = {
        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},   {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}}, {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}},
        {{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}}, {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}},   {{0, 0, -1}, {1, 0, 0}, {0, -1, 0}},
    };
    ca_matrix turn = ca_matrix_identity();
    ca_tree_bitmap bitmap;
    if (!ca_tree_add_bitmap(&p->tree, side, side, 1, &bitmap)) return;
    for (int row = 0; row < 3; row++)
        for (int axis = 0; axis < 3; axis++) turn.m[row][axis] = axes[face][axis][row];
    for (uint32_t i = 0; i < side * side; i++) {
        double plane[2], d[3], length2 = 0.0;
        plane_of(i % side, i / side, side, side, 1.0, 1.0, plane);
        for (int k = 0; k < 3; k++) {
            d[k] = turn.m[k][0] * plane[0] + turn.m[k][1] * plane[1] + turn.m[k][2];
            length2 += d[k] * d[k];
        }
        for (int k = 0; k < 3; k++) d[k] /= sqrt(length2);
        bitmap.pixels[i] = (float)(diagram_towards(image, p->version, d) * irradiance_of_one(plane));
    }
    const ca_matrix frame = rigid_frame(p), to_world = ca_matrix_multiply(&frame, &turn);
    add_projector(p, &to_world, 1.0, &bitmap, factor);
}

/* The flux of an intensity factor of 1. */
static double diagram_power(const ca_image *image, uint32_t version)
{
    enum { ROWS = 256, COLUMNS = 256 };
    double sum = 0.0;
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        const double z = 1.0 - 2.0 * (i / COLUMNS + 0.5) / ROWS, phi = 2.0 * pi * (i % COLUMNS + 0.5) / COLUMNS;
        const double sine = sqrt(1.0 - z * z), d[3] = {cos(phi) * sine, sin(phi) * sine, z};
        sum += diagram_towards(image, version, d);
    }
    return 4.0 * pi * sum / (ROWS * COLUMNS);
}

void ca_pbrt_read_goniometric(ca_pbrt *p)
{
    double factor[3];
    ca_image image;
    const char *file = picture_name(p);
    const double wanted = ca_pbrt_number(&p->params, "power", -1.0);
    read_intensity(p, factor);
    if (!file[0]) ca_pbrt_fail(&p->params, "filename", "is missing");
    if (!ca_import_good(p->importer) || !ca_pbrt_read_picture(p, file, CA_ENCODING_SRGB, &image)) return;
    const uint32_t side = image.height < 128 ? 128 : image.height > 1024 ? 1024 : image.height;
    const double has = wanted > 0.0 ? diagram_power(&image, p->version) : 0.0;
    for (int i = 0; i < 3 && wanted > 0.0 && has > 0.0; i++) factor[i] *= wanted / has;
    if (p->version == 3 || is_square(p, &image))
        for (uint32_t face = 0; face < 6; face++) put_face(p, &image, face, side, factor);
    ca_image_destroy(&image);
}
