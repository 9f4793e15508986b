#include "material/texture.h"

#include "math/numeric.h"
#include "math/transform.h"

#include <assert.h>

ca_texture ca_texture_constant(ca_rgb value)
{
    return (ca_texture){.kind = CA_TEXTURE_CONSTANT,
                        .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                        .as.constant = value};
}

static ca_vec2 texture_uv(const ca_texture *texture, ca_vec2 uv)
{
    const float(*m)[3] = texture->to_uv;
    return (ca_vec2){m[0][0] * uv.x + m[0][1] * uv.y + m[0][2], m[1][0] * uv.x + m[1][1] * uv.y + m[1][2]};
}

/* ---- Bitmaps --------------------------------------------------------------------------------------------------- */

/* A coordinate brought into one period of the wrap mode, [0, 1) or (mirror) [0, 2), before it is scaled by the size,
 * so that a large coordinate keeps its digits and the index below fits an integer. The upper ends are open because a
 * tiny negative coordinate would round to them and belongs to the last texel. One that overflowed reads as 0. */
static float wrap_coordinate(float u, ca_texture_wrap wrap)
{
    float periodic = u;
    if (wrap == CA_WRAP_ZERO) return isfinite(u) ? ca_clamp(u, -1.0f, 2.0f) : -1.0f; /* still outside */
    switch (wrap) {
    case CA_WRAP_REPEAT: periodic = u - floorf(u); break;
    case CA_WRAP_MIRROR: periodic = u - 2.0f * floorf(0.5f * u); break;
    case CA_WRAP_CLAMP:
    case CA_WRAP_ZERO: break;
    }
    const float end = wrap == CA_WRAP_MIRROR ? 2.0f * CA_ONE_MINUS_EPSILON : CA_ONE_MINUS_EPSILON;
    return isfinite(periodic) ? ca_clamp(periodic, 0.0f, end) : 0.0f;
}

/* A texel index, at most one outside of the period that wrap_coordinate leaves, brought into [0, size); CA_NONE where
 * there is none. */
static uint32_t wrap_index(int32_t index, uint32_t size, ca_texture_wrap wrap)
{
    const int32_t n = (int32_t)size;
    switch (wrap) {
    case CA_WRAP_REPEAT: return (uint32_t)(index < 0 ? index + n : index >= n ? index - n : index);
    case CA_WRAP_MIRROR:
        if (index < 0 || index >= 2 * n) return 0;
        return (uint32_t)(index < n ? index : 2 * n - 1 - index);
    case CA_WRAP_ZERO: return index < 0 || index >= n ? CA_NONE : (uint32_t)index;
    case CA_WRAP_CLAMP: break;
    }
    return (uint32_t)(index < 0 ? 0 : index >= n ? n - 1 : index);
}

/* The two texels along one axis around a coordinate, and the share of the second. */
typedef struct texel_pair {
    uint32_t i0, i1;
    float w1;
} texel_pair;

static texel_pair bilinear_texels(float coordinate, uint32_t size, ca_texture_wrap wrap)
{
    const float x = wrap_coordinate(coordinate, wrap) * (float)size - 0.5f;
    const float x0 = floorf(x);
    const int32_t i0 = (int32_t)x0;
    return (texel_pair){wrap_index(i0, size, wrap), wrap_index(i0 + 1, size, wrap), x - x0};
}

static uint32_t nearest_texel(float coordinate, uint32_t size, ca_texture_wrap wrap)
{
    return wrap_index((int32_t)floorf(wrap_coordinate(coordinate, wrap) * (float)size), size, wrap);
}

static ca_rgb texel(const ca_image *image, uint32_t x, uint32_t y)
{
    return x == CA_NONE || y == CA_NONE ? (ca_rgb){0.0f, 0.0f, 0.0f} : ca_image_rgb(image, x, y);
}

static ca_rgb bitmap_eval(const ca_texture *texture, ca_vec2 surface_uv)
{
    const ca_image *image = texture->as.bitmap.image;
    const ca_texture_wrap wrap = texture->as.bitmap.wrap;
    const ca_vec2 uv = texture_uv(texture, surface_uv);
    if (texture->as.bitmap.filter == CA_FILTER_NEAREST)
        return texel(image, nearest_texel(uv.x, image->width, wrap),
                     nearest_texel(1.0f - uv.y, image->height, wrap));

    const texel_pair x = bilinear_texels(uv.x, image->width, wrap);
    const texel_pair y = bilinear_texels(1.0f - uv.y, image->height, wrap);
    const ca_rgb row0 = ca_rgb_lerp(texel(image, x.i0, y.i0), texel(image, x.i1, y.i0), x.w1);
    const ca_rgb row1 = ca_rgb_lerp(texel(image, x.i0, y.i1), texel(image, x.i1, y.i1), x.w1);
    return ca_rgb_lerp(row0, row1, y.w1);
}

/* By the chain rule through to_uv, from the slopes of the bilinear patch. */
static ca_vec2 bitmap_gradient(const ca_texture *texture, ca_vec2 surface_uv)
{
    const ca_image *image = texture->as.bitmap.image;
    if (texture->as.bitmap.filter == CA_FILTER_NEAREST) return (ca_vec2){0.0f, 0.0f};
    const ca_texture_wrap wrap = texture->as.bitmap.wrap;
    const ca_vec2 uv = texture_uv(texture, surface_uv);
    const texel_pair x = bilinear_texels(uv.x, image->width, wrap);
    const texel_pair y = bilinear_texels(1.0f - uv.y, image->height, wrap);
    const float f00 = ca_texture_scalar_of(texel(image, x.i0, y.i0));
    const float f10 = ca_texture_scalar_of(texel(image, x.i1, y.i0));
    const float f01 = ca_texture_scalar_of(texel(image, x.i0, y.i1));
    const float f11 = ca_texture_scalar_of(texel(image, x.i1, y.i1));
    const float slope_x = (float)image->width * ca_lerp(f10 - f00, f11 - f01, y.w1);
    const float slope_y = -(float)image->height * ca_lerp(f01 - f00, f11 - f10, x.w1); /* rows run against v */
    const float(*m)[3] = texture->to_uv;
    return (ca_vec2){m[0][0] * slope_x + m[1][0] * slope_y, m[0][1] * slope_x + m[1][1] * slope_y};
}

static ca_rgb bitmap_mean(const ca_image *image)
{
    double sum[3] = {0.0, 0.0, 0.0};
    for (uint32_t y = 0; y < image->height; ++y)
        for (uint32_t x = 0; x < image->width; ++x) {
            const ca_rgb value = ca_image_rgb(image, x, y);
            sum[0] += (double)value.r;
            sum[1] += (double)value.g;
            sum[2] += (double)value.b;
        }
    const double scale = 1.0 / ((double)image->width * (double)image->height);
    return (ca_rgb){(float)(sum[0] * scale), (float)(sum[1] * scale), (float)(sum[2] * scale)};
}

static float bitmap_max(const ca_image *image)
{
    float max = -INFINITY;
    for (uint32_t y = 0; y < image->height; ++y)
        for (uint32_t x = 0; x < image->width; ++x) max = fmaxf(max, ca_rgb_max(ca_image_rgb(image, x, y)));
    return max;
}

/* ---- The others ------------------------------------------------------------------------------------------------ */

static ca_texture_id checkerboard_color(const ca_texture *texture, ca_vec2 surface_uv)
{
    const ca_vec2 uv = texture_uv(texture, surface_uv);
    const bool right = uv.x - floorf(uv.x) > 0.5f, lower = uv.y - floorf(uv.y) > 0.5f;
    return right == lower ? texture->as.checkerboard.color0 : texture->as.checkerboard.color1;
}

static ca_rgb attribute_value(const ca_mesh_attribute *attribute, uint32_t element)
{
    const float *p = attribute->values + (size_t)element * attribute->components;
    return attribute->components >= 3 ? (ca_rgb){p[0], p[1], p[2]} : (ca_rgb){p[0], p[0], p[0]};
}

static ca_rgb mesh_attribute_eval(const ca_texture *texture, const ca_surface *surface)
{
    const ca_mesh_attribute *attribute =
        surface->mesh ? ca_mesh_find_attribute(surface->mesh, texture->as.mesh_attribute.name) : NULL;
    if (!attribute) return (ca_rgb){0.0f, 0.0f, 0.0f};
    if (attribute->per_face) return attribute_value(attribute, surface->primitive);

    const uint32_t *corner = surface->mesh->indices + 3 * (size_t)surface->primitive;
    const float b1 = surface->barycentric.x, b2 = surface->barycentric.y;
    ca_rgb value = ca_rgb_scale(attribute_value(attribute, corner[0]), 1.0f - b1 - b2);
    value = ca_rgb_madd(value, b1, attribute_value(attribute, corner[1]));
    return ca_rgb_madd(value, b2, attribute_value(attribute, corner[2]));
}

/* A light's picture has no surface: 0. */
static float facing_scalar(const ca_texture *texture, const ca_surface *surface)
{
    return fminf(fabsf(ca_dot(texture->as.facing.direction, surface->ng)), 1.0f);
}

static ca_surface moved_surface(const ca_texture *texture, const ca_surface *surface)
{
    ca_surface moved = *surface;
    moved.uv = texture_uv(texture, surface->uv);
    return moved;
}

/* Parts of scaled and mixed textures keep their signs; a value that leaves this file is not negative. */
static ca_rgb signed_value(const ca_texture *table, ca_texture_id id, const ca_surface *surface);
static float signed_scalar(const ca_texture *table, ca_texture_id id, const ca_surface *surface);

static ca_rgb scale_eval(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const ca_surface moved = moved_surface(texture, surface);
    const ca_rgb value =
        ca_rgb_mul(texture->as.scale.factor, signed_value(table, texture->as.scale.child, &moved));
    if (!texture->as.scale.varies) return value;
    return ca_rgb_mul(value, signed_value(table, texture->as.scale.by, surface));
}

static float scale_scalar(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const ca_surface moved = moved_surface(texture, surface);
    const float value = ca_texture_scalar_of(texture->as.scale.factor) *
                        signed_scalar(table, texture->as.scale.child, &moved);
    if (!texture->as.scale.varies) return value;
    return value * signed_scalar(table, texture->as.scale.by, surface);
}

/* By the product rule. */
static ca_vec2 scale_gradient(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const ca_surface moved = moved_surface(texture, surface);
    const ca_vec2 g = ca_texture_gradient(table, texture->as.scale.child, &moved);
    const float factor = ca_texture_scalar_of(texture->as.scale.factor);
    const float(*m)[3] = texture->to_uv;
    const ca_vec2 slope = {factor * (m[0][0] * g.x + m[1][0] * g.y), factor * (m[0][1] * g.x + m[1][1] * g.y)};
    const ca_texture_id by = texture->as.scale.by;
    if (!texture->as.scale.varies) return slope;
    const float value = factor * signed_scalar(table, texture->as.scale.child, &moved);
    const float times = signed_scalar(table, by, surface);
    const ca_vec2 more = ca_texture_gradient(table, by, surface);
    return (ca_vec2){times * slope.x + value * more.x, times * slope.y + value * more.y};
}

static ca_rgb mix_eval(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const float weight = ca_texture_eval_scalar(table, texture->as.mix.weight, surface);
    const ca_rgb a = signed_value(table, texture->as.mix.color0, surface);
    const ca_rgb b = signed_value(table, texture->as.mix.color1, surface);
    return ca_rgb_madd(ca_rgb_scale(a, 1.0f - weight), weight, b);
}

static float mix_scalar(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const float weight = ca_texture_eval_scalar(table, texture->as.mix.weight, surface);
    const float a = signed_scalar(table, texture->as.mix.color0, surface);
    const float b = signed_scalar(table, texture->as.mix.color1, surface);
    return (1.0f - weight) * a + weight * b;
}

/* Of (1 - w) a + w b: that of both, weighted, and (b - a) times that of w. */
static ca_vec2 mix_gradient(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const ca_texture_id color0 = texture->as.mix.color0, color1 = texture->as.mix.color1;
    const float weight = ca_texture_eval_scalar(table, texture->as.mix.weight, surface);
    const float rise = signed_scalar(table, color1, surface) - signed_scalar(table, color0, surface);
    const ca_vec2 a = ca_texture_gradient(table, color0, surface), b = ca_texture_gradient(table, color1, surface);
    const ca_vec2 w = ca_texture_gradient(table, texture->as.mix.weight, surface);
    return (ca_vec2){(1.0f - weight) * a.x + weight * b.x + rise * w.x,
                     (1.0f - weight) * a.y + weight * b.y + rise * w.y};
}

static float power_scalar(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    return powf(fmaxf(ca_texture_eval_scalar(table, texture->as.power.child, surface), 0.0f),
                texture->as.power.exponent);
}

static ca_rgb raised(ca_rgb value, float exponent)
{
    return (ca_rgb){powf(fmaxf(value.r, 0.0f), exponent), powf(fmaxf(value.g, 0.0f), exponent),
                    powf(fmaxf(value.b, 0.0f), exponent)};
}

static ca_vec2 power_gradient(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const float value = ca_texture_eval_scalar(table, texture->as.power.child, surface);
    const ca_vec2 g = ca_texture_gradient(table, texture->as.power.child, surface);
    const float exponent = texture->as.power.exponent;
    const float steepness = value > 0.0f ? exponent * powf(value, exponent - 1.0f) : 0.0f;
    return (ca_vec2){steepness * g.x, steepness * g.y};
}

static float cut_scalar(float value) { return fminf(fmaxf(value, 0.0f), 1.0f); }

static ca_rgb cut(ca_rgb value) { return (ca_rgb){cut_scalar(value.r), cut_scalar(value.g), cut_scalar(value.b)}; }

static ca_vec2 clamp_gradient(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const ca_texture_id child = texture->as.clamp.child;
    const float value = ca_texture_eval_scalar(table, child, surface);
    if (value < 0.0f || value > 1.0f) return (ca_vec2){0.0f, 0.0f};
    return ca_texture_gradient(table, child, surface);
}

/* ---- Mapped by position ---------------------------------------------------------------------------------------- */

static ca_surface mapped_surface(const ca_texture *texture, const ca_surface *surface)
{
    ca_surface mapped = *surface;
    mapped.uv = ca_texture_mapping_at(texture->as.mapped.mapping,
                                      ca_map_point(texture->as.mapped.to_texture, surface->position));
    return mapped;
}

/* By the chain rule: from (s, t) to the position, and from there to the surface's u and v. */
static ca_vec2 mapped_gradient(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    const float(*m)[4] = texture->as.mapped.to_texture;
    const ca_texture_mapping mapping = texture->as.mapped.mapping;
    const ca_surface mapped = mapped_surface(texture, surface);
    const ca_vec2 g = ca_texture_gradient(table, texture->as.mapped.child, &mapped);
    const ca_vec3 q = ca_map_point(m, surface->position);
    const ca_vec2 along_u = ca_texture_mapping_slope(mapping, q, ca_map_vector(m, surface->dpdu));
    const ca_vec2 along_v = ca_texture_mapping_slope(mapping, q, ca_map_vector(m, surface->dpdv));
    return (ca_vec2){g.x * along_u.x + g.y * along_u.y, g.x * along_v.x + g.y * along_v.y};
}

/* ---- Bounds ---------------------------------------------------------------------------------------------------- */

/* The largest size lies at the least weight, 0 or more, or at the largest. */
static float mix_max(const ca_texture *table, const ca_image *images, const ca_texture *texture)
{
    const float a = ca_texture_bound(table, images, texture->as.mix.color0);
    const float b = ca_texture_bound(table, images, texture->as.mix.color1);
    const float weight = ca_texture_bound(table, images, texture->as.mix.weight);
    return fmaxf(a, fmaxf(1.0f - weight, 0.0f) * a + weight * b);
}

/* ---- All kinds ------------------------------------------------------------------------------------------------- */

static ca_rgb not_negative(ca_rgb value)
{
    return (ca_rgb){fmaxf(value.r, 0.0f), fmaxf(value.g, 0.0f), fmaxf(value.b, 0.0f)};
}

ca_rgb ca_texture_eval_varying(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    switch (texture->kind) {
    case CA_TEXTURE_CONSTANT: return texture->as.constant;
    case CA_TEXTURE_BITMAP: return bitmap_eval(texture, surface->uv);
    case CA_TEXTURE_CHECKERBOARD: return ca_texture_eval(table, checkerboard_color(texture, surface->uv), surface);
    case CA_TEXTURE_MESH_ATTRIBUTE: return mesh_attribute_eval(texture, surface);
    case CA_TEXTURE_FACING: return ca_rgb_grey(facing_scalar(texture, surface));
    case CA_TEXTURE_SCALE: return not_negative(scale_eval(table, texture, surface));
    case CA_TEXTURE_MIX: return not_negative(mix_eval(table, texture, surface));
    case CA_TEXTURE_POWER:
        return raised(ca_texture_eval(table, texture->as.power.child, surface), texture->as.power.exponent);
    case CA_TEXTURE_CLAMP: return cut(ca_texture_eval(table, texture->as.clamp.child, surface));
    case CA_TEXTURE_MAPPED: {
        const ca_surface mapped = mapped_surface(texture, surface);
        return ca_texture_eval(table, texture->as.mapped.child, &mapped);
    }
    case CA_TEXTURE_KIND_COUNT: break;
    }
    assert(false && "a texture of no kind");
    return (ca_rgb){0.0f, 0.0f, 0.0f};
}

static ca_rgb signed_value(const ca_texture *table, ca_texture_id id, const ca_surface *surface)
{
    const ca_texture *texture = &table[id];
    if (texture->kind == CA_TEXTURE_SCALE) return scale_eval(table, texture, surface);
    return texture->kind == CA_TEXTURE_MIX ? mix_eval(table, texture, surface) : ca_texture_eval(table, id, surface);
}

float ca_texture_scalar_varying(const ca_texture *table, const ca_texture *texture, const ca_surface *surface)
{
    if (texture->kind == CA_TEXTURE_SCALE) return fmaxf(scale_scalar(table, texture, surface), 0.0f);
    if (texture->kind == CA_TEXTURE_MIX) return fmaxf(mix_scalar(table, texture, surface), 0.0f);
    if (texture->kind == CA_TEXTURE_POWER) return power_scalar(table, texture, surface);
    if (texture->kind == CA_TEXTURE_MAPPED) {
        const ca_surface mapped = mapped_surface(texture, surface);
        return ca_texture_eval_scalar(table, texture->as.mapped.child, &mapped);
    }
    if (texture->kind == CA_TEXTURE_CLAMP)
        return cut_scalar(ca_texture_eval_scalar(table, texture->as.clamp.child, surface));
    if (texture->kind != CA_TEXTURE_CHECKERBOARD)
        return ca_texture_scalar_of(ca_texture_eval_varying(table, texture, surface));
    const bool first = checkerboard_color(texture, surface->uv) == texture->as.checkerboard.color0;
    return ca_texture_eval_scalar(table, first ? texture->as.checkerboard.color1 : texture->as.checkerboard.color0,
                                  surface);
}

static float signed_scalar(const ca_texture *table, ca_texture_id id, const ca_surface *surface)
{
    const ca_texture *texture = &table[id];
    if (texture->kind == CA_TEXTURE_SCALE) return scale_scalar(table, texture, surface);
    if (texture->kind == CA_TEXTURE_MIX) return mix_scalar(table, texture, surface);
    return ca_texture_eval_scalar(table, id, surface);
}

ca_vec2 ca_texture_gradient(const ca_texture *table, ca_texture_id id, const ca_surface *surface)
{
    const ca_texture *texture = &table[id];
    if (texture->kind == CA_TEXTURE_SCALE) return scale_gradient(table, texture, surface);
    if (texture->kind == CA_TEXTURE_MIX) return mix_gradient(table, texture, surface);
    if (texture->kind == CA_TEXTURE_POWER) return power_gradient(table, texture, surface);
    if (texture->kind == CA_TEXTURE_CLAMP) return clamp_gradient(table, texture, surface);
    if (texture->kind == CA_TEXTURE_MAPPED) return mapped_gradient(table, texture, surface);
    return texture->kind == CA_TEXTURE_BITMAP ? bitmap_gradient(texture, surface->uv) : (ca_vec2){0.0f, 0.0f};
}

/* As if factors that vary did so without regard to each other; likewise of a mix. */
static ca_rgb signed_mean(const ca_texture *table, ca_texture_id id)
{
    const ca_texture *texture = &table[id];
    if (texture->kind == CA_TEXTURE_MIX)
        return ca_rgb_lerp(signed_mean(table, texture->as.mix.color0), signed_mean(table, texture->as.mix.color1),
                           ca_texture_scalar_of(ca_texture_mean(table, texture->as.mix.weight)));
    if (texture->kind != CA_TEXTURE_SCALE) return ca_texture_mean(table, id);
    const ca_rgb mean = ca_rgb_mul(texture->as.scale.factor, signed_mean(table, texture->as.scale.child));
    return texture->as.scale.varies ? ca_rgb_mul(mean, signed_mean(table, texture->as.scale.by)) : mean;
}

ca_rgb ca_texture_mean(const ca_texture *table, ca_texture_id id)
{
    const ca_texture *texture = &table[id];
    switch (texture->kind) {
    case CA_TEXTURE_CONSTANT: return texture->as.constant;
    case CA_TEXTURE_BITMAP: return bitmap_mean(texture->as.bitmap.image);
    case CA_TEXTURE_CHECKERBOARD:
        return ca_rgb_lerp(ca_texture_mean(table, texture->as.checkerboard.color0),
                           ca_texture_mean(table, texture->as.checkerboard.color1), 0.5f);
    case CA_TEXTURE_SCALE:
    case CA_TEXTURE_MIX: return not_negative(signed_mean(table, id));
    case CA_TEXTURE_POWER: /* as if the child were constant */
        return raised(ca_texture_mean(table, texture->as.power.child), texture->as.power.exponent);
    case CA_TEXTURE_CLAMP: return cut(ca_texture_mean(table, texture->as.clamp.child));
    case CA_TEXTURE_MAPPED: return ca_texture_mean(table, texture->as.mapped.child);
    case CA_TEXTURE_FACING: return ca_rgb_grey(0.5f);
    case CA_TEXTURE_MESH_ATTRIBUTE:
    case CA_TEXTURE_KIND_COUNT: break;
    }
    return (ca_rgb){1.0f, 1.0f, 1.0f};
}

static float largest_size(ca_rgb value) { return fmaxf(fabsf(value.r), fmaxf(fabsf(value.g), fabsf(value.b))); }

int ca_texture_parts(const ca_texture *t, ca_texture_id parts[3])
{
    switch (t->kind) {
    case CA_TEXTURE_CHECKERBOARD:
        parts[0] = t->as.checkerboard.color0, parts[1] = t->as.checkerboard.color1;
        return 2;
    case CA_TEXTURE_SCALE:
        parts[0] = t->as.scale.child, parts[1] = t->as.scale.by;
        return t->as.scale.varies ? 2 : 1;
    case CA_TEXTURE_MIX:
        parts[0] = t->as.mix.color0, parts[1] = t->as.mix.color1, parts[2] = t->as.mix.weight;
        return 3;
    case CA_TEXTURE_POWER: parts[0] = t->as.power.child; return 1;
    case CA_TEXTURE_CLAMP: parts[0] = t->as.clamp.child; return 1;
    case CA_TEXTURE_MAPPED: parts[0] = t->as.mapped.child; return 1;
    default: return 0;
    }
}

float ca_texture_bound(const ca_texture *table, const ca_image *images, ca_texture_id id)
{
    const ca_texture *texture = &table[id];
    switch (texture->kind) {
    case CA_TEXTURE_CONSTANT: return largest_size(texture->as.constant);
    case CA_TEXTURE_BITMAP:
        return bitmap_max(images ? &images[texture->as.bitmap.image_index] : texture->as.bitmap.image);
    case CA_TEXTURE_CHECKERBOARD:
        return fmaxf(ca_texture_bound(table, images, texture->as.checkerboard.color0),
                     ca_texture_bound(table, images, texture->as.checkerboard.color1));
    case CA_TEXTURE_SCALE: /* an upper bound where the factor is no grey */
        return largest_size(texture->as.scale.factor) * ca_texture_bound(table, images, texture->as.scale.child) *
               (texture->as.scale.varies ? ca_texture_bound(table, images, texture->as.scale.by) : 1.0f);
    case CA_TEXTURE_MIX: return mix_max(table, images, texture);
    case CA_TEXTURE_POWER:
        return powf(ca_texture_bound(table, images, texture->as.power.child), texture->as.power.exponent);
    case CA_TEXTURE_CLAMP: return fminf(ca_texture_bound(table, images, texture->as.clamp.child), 1.0f);
    case CA_TEXTURE_MAPPED: return ca_texture_bound(table, images, texture->as.mapped.child);
    case CA_TEXTURE_MESH_ATTRIBUTE:
        return texture->as.mesh_attribute.most > 0.0f ? texture->as.mesh_attribute.most : 1.0f;
    case CA_TEXTURE_FACING:
    case CA_TEXTURE_KIND_COUNT: break;
    }
    return 1.0f;
}

float ca_texture_max(const ca_texture *table, ca_texture_id id) { return ca_texture_bound(table, NULL, id); }
