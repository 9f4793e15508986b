/* Eight lanes of environment.c: the same operations in the same order. */
#include "light/environment_lanes.h"

#include "math/arc_tangent.h"
#include "sampling/distribution_lanes.h"
#include "sampling/warp_lanes.h"

/* ca_light_to_local and ca_light_to_world. */
static inline ca_v8 map_direction8(const float m[3][4], ca_v8 v)
{
    return ca_normalize_v8((ca_v8){m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
                                   m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                                   m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z});
}

/* ca_image_rgb at places of the picture. */
static inline ca_v8 texels8(const ca_image *image, ca_m8 place)
{
    const ca_m8 first = place * (int32_t)image->channels;
    const ca_f8 r = ca_gather8(image->data, first);
    if (image->channels < 3) return (ca_v8){r, r, r};
    return (ca_v8){r, ca_gather8(image->data + 1, first), ca_gather8(image->data + 2, first)};
}

static inline ca_v8 lerp_v8(ca_v8 a, ca_v8 b, ca_f8 t)
{
    return ca_add_v8(ca_mul_v8(a, 1.0f - t), ca_mul_v8(b, t));
}

/* Clamped as numbers with fractions, so that what is no number stays inside. */
static inline ca_m8 whole8(ca_f8 v, float last)
{
    return __builtin_convertvector(ca_min8(ca_max8(v, ca_f8_all(0.0f)), ca_f8_all(last)), ca_m8);
}

/* picture_cell: its pixels' places, its own, and where in it the point lies. */
typedef struct picture_cells8 {
    ca_m8 pixels[4]; /* upper left, upper right, lower left, lower right */
    ca_m8 column, row;
    ca_f8 x, y;
} picture_cells8;

static inline picture_cells8 cells_at8(const ca_image *image, ca_m8 x0, ca_m8 y0)
{
    const int32_t width = (int32_t)image->width, height = (int32_t)image->height;
    const ca_m8 x1 = (x0 + 1) & (x0 + 1 < width), y1 = y0 - (y0 + 1 < height);
    return (picture_cells8){.pixels = {y0 * width + x0, y0 * width + x1, y1 * width + x0, y1 * width + x1},
                            .column = x0,
                            .row = y0};
}

static inline picture_cells8 cells_of8(const ca_image *image, ca_f8 u, ca_f8 v)
{
    const int32_t width = (int32_t)image->width, height = (int32_t)image->height;
    const ca_f8 x = u * (float)width - 0.5f, y = v * (float)(height - 1);
    const ca_f8 column = ca_floor8(x), row = ca_min8(ca_floor8(y), ca_f8_all((float)height - 1.0f));
    const ca_m8 x0 = ca_select8_int(column < 0.0f, ca_m8_all(width - 1), whole8(column, (float)(width - 1)));
    picture_cells8 cells = cells_at8(image, x0, whole8(row, (float)(height - 1)));
    cells.x = x - column, cells.y = y - row;
    return cells;
}

/* ca_light_weight of a colour and a scale. */
static inline ca_f8 weight8(ca_rgb scale, ca_v8 texel)
{
    return 0.2126f * ca_abs8(scale.r * texel.x) + 0.7152f * ca_abs8(scale.g * texel.y) +
           0.0722f * ca_abs8(scale.b * texel.z);
}

static inline ca_f8 mix8(ca_f8 a, ca_f8 b, ca_f8 t) { return a * (1.0f - t) + b * t; }

/* density_in. */
static inline ca_f8 density_in8(const ca_light *light, const picture_cells8 *c, const ca_v8 texels[4])
{
    const ca_distribution_2d *cells = &light->as.envmap.cells;
    ca_f8 w[4];
    for (int k = 0; k < 4; k++) w[k] = weight8(light->as.envmap.scale, texels[k]);
    const ca_f8 mean = 0.25f * ((w[0] + w[1]) + (w[2] + w[3]));
    const ca_f8 weight = mix8(mix8(w[0], w[1], c->x), mix8(w[2], w[3], c->x), c->y);
    const ca_m8 last = ca_m8_all((int32_t)cells->height - 1);
    const ca_m8 row = ca_select8_int(c->row > last, last, c->row);
    const ca_f8 probability = ca_distribution_2d_bin_probability8(cells, c->column, row);
    const ca_f8 density = probability * ((float)cells->width * (float)cells->height) * (weight / mean);
    return ca_select8(mean > 0.0f, density, ca_f8_all(0.0f));
}

/* place_of, radiance_at and pdf_at. */
static ca_environment8 picture_at8(const ca_light *light, ca_v8 to_light)
{
    const ca_rgb scale = light->as.envmap.scale;
    const ca_image *image = light->as.envmap.image;
    const ca_v8 local = map_direction8(light->as.envmap.map.from, to_light);
    const ca_f8 ring = ca_sqrt8(local.x * local.x + local.z * local.z);
    const ca_f8 u = ca_turn8(-local.z, local.x), v = ca_atan2_8(ring, local.y) * CA_INV_PI;
    const picture_cells8 cells = cells_of8(image, u, v);
    ca_v8 t[4];
    for (int k = 0; k < 4; k++) t[k] = texels8(image, cells.pixels[k]);
    const ca_v8 texel = lerp_v8(lerp_v8(t[0], t[1], cells.x), lerp_v8(t[2], t[3], cells.x), cells.y);
    const ca_f8 pdf = density_in8(light, &cells, t) / (2.0f * CA_PI * CA_PI * ring);
    return (ca_environment8){.to_light = to_light,
                             .radiance = {scale.r * texel.x, scale.g * texel.y, scale.b * texel.z},
                             .pdf_direct = ca_select8(ring > 0.0f, pdf, ca_f8_all(0.0f))};
}

ca_environment8 ca_light_environment_hit8(const ca_light *light, ca_v8 to_light)
{
    if (light->kind == CA_LIGHT_ENVMAP) return picture_at8(light, to_light);
    const ca_rgb radiance = light->as.constant.radiance;
    return (ca_environment8){.to_light = to_light,
                             .radiance = {ca_f8_all(radiance.r), ca_f8_all(radiance.g), ca_f8_all(radiance.b)},
                             .pdf_direct = ca_f8_all(CA_INV_FOUR_PI)};
}

/* uv_to_direction. */
static inline ca_v8 picture_direction8(ca_f8 u, ca_f8 v)
{
    ca_f8 sin_phi, cos_phi, sin_theta, cos_theta;
    ca_sincos8(CA_TWO_PI * u, &sin_phi, &cos_phi);
    ca_sincos8(CA_PI * v, &sin_theta, &cos_theta);
    return (ca_v8){sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta};
}

/* sample_place. */
static inline void sample_places8(const ca_light *light, ca_f8 *u, ca_f8 *v)
{
    const ca_image *image = light->as.envmap.image;
    const ca_distribution_2d *table = &light->as.envmap.cells;
    const ca_bins_2d8 bins = ca_distribution_2d_sample_bins8(table, *u, *v);
    const picture_cells8 cells = cells_at8(image, bins.column, bins.row);
    ca_f8 w[4];
    for (int k = 0; k < 4; k++) w[k] = weight8(light->as.envmap.scale, texels8(image, cells.pixels[k]));
    const ca_f8 down = ca_linear8(bins.inside_y, w[0] + w[1], w[2] + w[3]);
    const ca_f8 across = ca_linear8(bins.inside_x, mix8(w[0], w[2], down), mix8(w[1], w[3], down));
    const ca_f8 column = __builtin_convertvector(bins.column, ca_f8), row = __builtin_convertvector(bins.row, ca_f8);
    const ca_f8 x = (column + across + 0.5f) / (float)table->width;
    *u = ca_select8(x < 1.0f, x, x - 1.0f);
    *v = ca_min8((row + down) / (float)table->height, ca_f8_all(CA_ONE_MINUS_EPSILON));
}

ca_environment8 ca_light_environment_direct8(const ca_light *light, ca_f8 u, ca_f8 v)
{
    if (light->kind == CA_LIGHT_CONSTANT) return ca_light_environment_hit8(light, ca_sphere8(u, v));
    sample_places8(light, &u, &v);
    return picture_at8(light, map_direction8(light->as.envmap.map.to, picture_direction8(u, v)));
}
