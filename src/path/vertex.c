#include "path/vertex.h"

#include "geometry/triangle.h"

/* ---- Matte points ---------------------------------------------------------------------------------------------- */

/* mesh_surface of geometry/surface.c for a flat mesh of the world. false: the ray is so long that the triangle's
 * corners give a better bound. */
static bool place_matte(ca_vertex *v, float extent, ca_vec3 origin, ca_vec3 direction, const ca_hit *hit)
{
    if (!ca_ray_position(extent, origin, direction, hit->t, &v->position, &v->position_error)) return false;
    v->ng = ca_normalize_any(hit->ng);
    v->barycentric = (ca_vec2){hit->u, hit->v};
    return true;
}

static void color_matte(ca_vertex *v, const ca_matte_shape *matte)
{
    v->side = ca_matte_side(matte, ca_dot(v->wi, v->ng));
    v->reflectance = matte->reflectance[v->side < 0.0f];
    v->scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
}

/* ---- All points ------------------------------------------------------------------------------------------------ */

static void copy_place(ca_vertex *v, const ca_surface *surface)
{
    v->position = surface->position;
    v->position_error = surface->position_error;
    v->ng = surface->ng;
    v->barycentric = surface->barycentric;
}

void ca_vertex_from_hit(ca_vertex *v, const ca_scene *scene, ca_vec3 origin, ca_vec3 direction, const ca_hit *hit)
{
    const ca_matte_shape *matte = &scene->mattes[hit->shape];
    v->shape = hit->shape;
    v->primitive = hit->primitive;
    v->instance = hit->instance;
    v->light = matte->light;
    v->wi = ca_neg(direction);
    v->matte = matte->is_matte && place_matte(v, matte->extent, origin, direction, hit);
    if (!v->matte) {
        ca_accel_surface(scene->accel, origin, direction, hit, &v->surface);
        copy_place(v, &v->surface);
    }
    v->cos_in = ca_abs_dot(v->ng, v->wi);
}

void ca_vertex_prepare(ca_vertex *v, const ca_scene *scene)
{
    if (v->matte) {
        color_matte(v, &scene->mattes[v->shape]);
        return;
    }
    ca_bsdf_init(&v->bsdf, scene->materials, scene->desc.textures.items, &v->surface, v->wi);
    v->scatter = v->bsdf.scatter;
}

void ca_vertex_from_point(ca_vertex *v, const ca_scene *scene, const ca_surface_point *point, ca_vec3 wi)
{
    v->shape = point->shape;
    v->primitive = point->primitive;
    v->instance = point->instance;
    v->light = scene->mattes[point->shape].light;
    v->wi = wi;
    v->matte = scene->mattes[point->shape].is_matte;
    v->position = point->position;
    v->position_error = (ca_vec3){point->position_error, point->position_error, point->position_error};
    v->ng = point->ng;
    v->barycentric = point->barycentric;
    v->cos_in = ca_abs_dot(v->ng, v->wi);
    if (!v->matte) ca_accel_surface_at(scene->accel, point, &v->surface);
    ca_vertex_prepare(v, scene);
}

const ca_surface *ca_vertex_surface(ca_vertex *v, const ca_scene *scene)
{
    if (v->matte) {
        const ca_surface_point point = ca_vertex_point(v);
        ca_accel_surface_at(scene->accel, &point, &v->surface);
    }
    return &v->surface;
}

ca_rgb ca_vertex_albedo(const ca_vertex *v)
{
    if (!v->matte) return ca_bsdf_albedo(&v->bsdf, v->wi);
    return ca_dot(v->ng, v->wi) * v->side > 0.0f ? v->reflectance : ca_rgb_grey(0.0f);
}

ca_surface_point ca_vertex_point(const ca_vertex *v)
{
    return (ca_surface_point){.ng = v->ng,
                              .position = v->position,
                              .position_error = ca_max3(v->position_error),
                              .barycentric = v->barycentric,
                              .shape = v->shape,
                              .primitive = v->primitive,
                              .instance = v->instance};
}
