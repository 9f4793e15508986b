/* A vertex of a path on a surface: where it lies, and how light scatters there.
 *
 * It comes from a ray's hit or from a point that was kept, and answers what all joins ask: f and both pdfs for a pair
 * of directions. The first of them, wi, is that of the path's own previous segment and stays. At a matte point
 * (scene/matte.h) a few numbers say it all; everywhere else the whole surface and its BSDF do, which are made only
 * there. Both give the same bits. */
#ifndef CA_PATH_VERTEX_H
#define CA_PATH_VERTEX_H

#include "geometry/surface_point.h"
#include "scene/scene.h"

typedef struct ca_vertex {
    ca_vec3 position, position_error; /* as ca_surface has them; likewise: */
    ca_vec3 ng;
    ca_vec3 wi;       /* unit, to the previous vertex */
    float cos_in;     /* |wi . ng| */
    uint32_t scatter; /* CA_SCATTER_... bits of the BSDF */
    bool matte;
    float side;       /* matte: -1 where the frame is mirrored, else 1 */
    ca_rgb reflectance; /* matte */
    uint32_t shape, primitive, instance, light; /* as ca_surface; likewise: */
    ca_vec2 barycentric;
    ca_surface surface; /* where it is not matte; likewise: */
    ca_bsdf bsdf;
} ca_vertex;

/* Where a ray along `direction` has met a shape. The BSDF is not there yet. */
void ca_vertex_from_hit(ca_vertex *vertex, const ca_scene *scene, ca_vec3 origin, ca_vec3 direction,
                        const ca_hit *hit);
/* Makes the BSDF. */
void ca_vertex_prepare(ca_vertex *vertex, const ca_scene *scene);
/* Both, at a point that was kept; wi as above. */
void ca_vertex_from_point(ca_vertex *vertex, const ca_scene *scene, const ca_surface_point *point, ca_vec3 wi);

/* The whole surface: of a matte point made now. */
const ca_surface *ca_vertex_surface(ca_vertex *vertex, const ca_scene *scene);
ca_rgb ca_vertex_albedo(const ca_vertex *vertex);
ca_surface_point ca_vertex_point(const ca_vertex *vertex);

static inline bool ca_vertex_is_smooth(const ca_vertex *vertex) { return vertex->scatter & CA_SCATTER_SMOOTH; }

/* eval_diffuse of material/bsdf.c for a matte point. */
static inline ca_bsdf_value ca_vertex_eval_matte(const ca_vertex *v, ca_vec3 wo)
{
    const float cos_i = ca_dot(v->ng, v->wi) * v->side, cos_o = ca_dot(v->ng, wo) * v->side;
    if (!(cos_i > CA_GRAZING_COS && cos_o > CA_GRAZING_COS)) return (ca_bsdf_value){0};
    return (ca_bsdf_value){.f = ca_rgb_scale(v->reflectance, CA_INV_PI),
                           .pdf = {cos_o * CA_INV_PI},
                           .pdf_reverse = {cos_i * CA_INV_PI}};
}

/* ca_bsdf_eval towards wo. */
static inline ca_bsdf_value ca_vertex_eval(const ca_vertex *vertex, ca_vec3 wo, ca_from from)
{
    return vertex->matte ? ca_vertex_eval_matte(vertex, wo) : ca_bsdf_eval(&vertex->bsdf, vertex->wi, wo, from);
}

/* Who asks for light at a point that scatters so: what lies behind a surface that only reflects cannot help. */
static inline ca_light_receiver ca_receiver_at(ca_vec3 position, ca_vec3 ng, ca_vec3 wi, uint32_t scatter)
{
    ca_light_receiver receiver = {.position = position};
    if (!(scatter & CA_SCATTER_TRANSMISSION)) receiver.normal = ca_dot(ng, wi) < 0.0f ? ca_neg(ng) : ng;
    return receiver;
}

static inline ca_light_receiver ca_vertex_receiver(const ca_vertex *vertex)
{
    return ca_receiver_at(vertex->position, vertex->ng, vertex->wi, vertex->scatter);
}

/* The origin of a ray that leaves along `direction`. */
static inline ca_vec3 ca_vertex_leave(const ca_vertex *vertex, ca_vec3 direction)
{
    return ca_offset_origin(vertex->position, vertex->position_error, vertex->ng, direction);
}

#endif
