/* Textures: colours and numbers that vary over a surface.
 *
 * A texture-valued parameter is a ca_texture_id into the scene's table; a constant is a texture too. Values are
 * linear Rec. 709. uv (0, 0) is the lower left corner of a bitmap: v runs upwards, rows run downwards; pixel (x, y)
 * is centred on ((x + 0.5) / width, 1 - (y + 0.5) / height). In Mitsuba 3 (src/textures/bitmap.cpp) row 0 lies at v =
 * 0: its scene files get a to_uv that turns v around. Nothing here allocates; all functions are pure. */
#ifndef CA_MATERIAL_TEXTURE_H
#define CA_MATERIAL_TEXTURE_H

#include "geometry/shape.h"
#include "image/image.h"
#include "material/texture_mapping.h"
#include "math/rgb.h"

typedef uint32_t ca_texture_id; /* CA_NONE: the parameter is not set */

typedef enum ca_texture_kind {
    CA_TEXTURE_CONSTANT,
    CA_TEXTURE_BITMAP,
    CA_TEXTURE_CHECKERBOARD,
    CA_TEXTURE_MESH_ATTRIBUTE,
    CA_TEXTURE_SCALE,
    CA_TEXTURE_MIX,
    CA_TEXTURE_POWER,
    CA_TEXTURE_CLAMP,
    CA_TEXTURE_MAPPED,
    CA_TEXTURE_FACING,
    CA_TEXTURE_KIND_COUNT
} ca_texture_kind;

typedef enum ca_texture_filter { CA_FILTER_NEAREST, CA_FILTER_BILINEAR } ca_texture_filter;
/* The last one: outside of the picture all texels are 0. */
typedef enum ca_texture_wrap { CA_WRAP_REPEAT, CA_WRAP_MIRROR, CA_WRAP_CLAMP, CA_WRAP_ZERO } ca_texture_wrap;

typedef struct ca_texture {
    ca_texture_kind kind;
    float to_uv[2][3]; /* texture coordinates from the surface's: (u', v') = M (u, v, 1) */
    union {
        ca_rgb constant;
        struct {
            uint32_t image_index;  /* in the scene's images */
            const ca_image *image; /* borrowed from the scene, set when it is compiled; alpha does not matter */
            ca_texture_filter filter;
            ca_texture_wrap wrap;
        } bitmap;
        struct {
            /* color0 where the fractional parts of u' and v' are both above 1/2 or both not. Each is looked up at
             * the surface's own coordinates. No cycles. */
            ca_texture_id color0, color1;
        } checkerboard;
        struct {
            ca_texture_id child; /* looked up at (u', v'). No cycles */
            ca_rgb factor; /* may be negative: of a height, or of a part of a mix; else the value is 0 */
            bool varies;      /* it is also multiplied by ... */
            ca_texture_id by; /* ... this, at the surface's own coordinates */
        } scale;
        struct {
            /* (1 - weight) color0 + weight color1, 0 where that is negative. The weight is a number; all are looked
             * up at the surface's own coordinates. No cycles. */
            ca_texture_id color0, color1, weight;
        } mix;
        struct {
            ca_texture_id child; /* looked up at the surface's own coordinates. No cycles */
            float exponent;      /* of each component; positive */
        } power;
        struct {
            ca_texture_id child; /* looked up at the surface's own coordinates, and cut to [0, 1]. No cycles */
        } clamp;
        struct {
            ca_texture_id child; /* looked up at the coordinates that follow from the position. No cycles */
            ca_texture_mapping mapping;
            float to_texture[3][4]; /* from the world to the texture's space */
        } mapped;
        struct {
            ca_vec3 direction; /* unit, of the world; grey: the cosine between it and the line of ng */
        } facing;
        struct {
            /* "vertex_..." or "face_..."; of less than three components: grey of the first; black where the mesh has
             * none of that name. */
            const char *name;
            float most;    /* the largest size of a value, of all meshes; 0: not known, and 1 is taken */
            bool negative; /* some value is */
        } mesh_attribute;
    } as;
} ca_texture;

ca_texture ca_texture_constant(ca_rgb value);

/* Does its value depend on the surface's uv? */
static inline bool ca_texture_reads_uv(const ca_texture *texture)
{
    return texture->kind != CA_TEXTURE_CONSTANT && texture->kind != CA_TEXTURE_MESH_ATTRIBUTE &&
           texture->kind != CA_TEXTURE_FACING;
}

/* What the two below do for everything but constants. */
ca_rgb ca_texture_eval_varying(const ca_texture *table, const ca_texture *texture, const ca_surface *surface);
/* The value itself of a grey colour (which its luminance is not, to the last bit), else the luminance. */
static inline float ca_texture_scalar_of(ca_rgb value)
{
    return value.r == value.g && value.g == value.b ? value.r : ca_luminance(value);
}

/* Most textures of most scenes are constants, and a material looks up one or more at every vertex. */
static inline ca_rgb ca_texture_eval(const ca_texture *table, ca_texture_id id, const ca_surface *surface)
{
    const ca_texture *texture = &table[id];
    return texture->kind == CA_TEXTURE_CONSTANT ? texture->as.constant
                                                : ca_texture_eval_varying(table, texture, surface);
}

/* Luminance of the colour; of a grey texture the value itself. As a number a checkerboard has its two colours
 * exchanged, which is Mitsuba 3's way (3.9.1, by its pictures and its textures' answers); scaled and mixed numbers
 * are made of numbers. */
float ca_texture_scalar_varying(const ca_texture *table, const ca_texture *texture, const ca_surface *surface);

static inline float ca_texture_eval_scalar(const ca_texture *table, ca_texture_id id, const ca_surface *surface)
{
    const ca_texture *texture = &table[id];
    return texture->kind == CA_TEXTURE_CONSTANT ? ca_texture_scalar_of(texture->as.constant)
                                                : ca_texture_scalar_varying(table, texture, surface);
}

/* Derivatives of the scalar by the surface's u and v: exact for constants, bilinear bitmaps and what is made of them,
 * 0 for the others; 0, too, of a power whose value is 0 and of what is clamped. */
ca_vec2 ca_texture_gradient(const ca_texture *table, ca_texture_id id, const ca_surface *surface);

/* Mean, and an upper bound of the components' size, over the unit square of a texture's own coordinates: for powers
 * and for choosing lobes.
 * The mean of a mesh attribute is (1, 1, 1), of a cosine a mean over all directions. Cost: one pass over a bitmap's
 * pixels. */
ca_rgb ca_texture_mean(const ca_texture *table, ca_texture_id id);
float ca_texture_max(const ca_texture *table, ca_texture_id id);
/* The same of textures that do not know their pictures yet: `images` of the scene; NULL: they do. */
float ca_texture_bound(const ca_texture *table, const ca_image *images, ca_texture_id id);
/* The textures that a texture is made of; how many. */
int ca_texture_parts(const ca_texture *texture, ca_texture_id parts[3]);

#endif
