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

static inline ca_v8 bilinear8(const ca_image *image, ca_f8 u, ca_f8 v)
{
    const int32_t width = (int32_t)image->width, height = (int32_t)image->height;
    const ca_f8 x = u * (float)width - 0.5f, y = v * (float)(height - 1);
    const ca_f8 column = ca_floor8(x), row = ca_min8(ca_floor8(y), ca_f8_all((float)height - 1.0f));
    const ca_m8 x0 = ca_select8_int(column < 0.0f, ca_m8_all(width - 1), whole8(column, (float)(width - 1)));
    const ca_m8 x1 = (x0 + 1) & (x0 + 1 < width);
    const ca_m8 y0 = whole8(row, (float)(height - 1)), y1 = y0 - (y0 + 1 < height);
    const ca_f8 tx = x - column, ty = y - row;
    return lerp_v8(lerp_v8(texels8(image, y0 * width + x0), texels8(image, y0 * width + x1), tx),
                   lerp_v8(texels8(image, y1 * width + x0), texels8(image, y1 * width + x1), tx), ty);
}

/* place_of, radiance_at and pdf_at. */
static ca_environment8 picture_at8(const ca_light *light, ca_v8 to_light)
{
    const ca_rgb scale = light->as.envmap.scale;
    const ca_v8 local = map_direction8(light->as.envmap.map.from, to_light);
    const ca_f8 ring = ca_sqrt8(local.x * local.x + local.z * local.z);
    const ca_f8 u = ca_turn8(-local.z, local.x), v = ca_atan2_8(ring, local.y) * CA_INV_PI;
    const ca_v8 texel = bilinear8(light->as.envmap.image, u, v);
    const ca_f8 density = ca_distribution_2d_density8(&light->as.envmap.pixels, u, v);
    const ca_f8 pdf = density / (2.0f * CA_PI * CA_PI * ring);
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

ca_environment8 ca_light_environment_direct8(const ca_light *light, ca_f8 u, ca_f8 v)
{
    if (light->kind == CA_LIGHT_CONSTANT) return ca_light_environment_hit8(light, ca_sphere8(u, v));
    ca_distribution_2d_sample8(&light->as.envmap.pixels, &u, &v);
    return picture_at8(light, map_direction8(light->as.envmap.map.to, picture_direction8(u, v)));
}
