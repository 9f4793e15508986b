/* From hits to vertices: matte shapes eight at a time, all others one by one. */
#include "geometry/triangle.h"
#include "integrator/batch.h"

/* Per place: what the shapes say. */
typedef struct shape_columns {
    _Alignas(32) float extent[CA_COLUMN];
    uint32_t back_is_front[CA_COLUMN];
} shape_columns;

static void look_up_shapes(ca_batch *batch, const ca_scene *scene, shape_columns *shapes)
{
    static const ca_matte_shape nothing = {0};
    ca_vertex_batch *v = &batch->vertices;
    for (uint32_t i = 0; i < batch->count; i++) {
        const uint32_t shape = batch->hits.shape[i];
        const bool met = shape != CA_NONE;
        const ca_matte_shape *matte = met ? &scene->mattes[shape] : &nothing;
        v->light[i] = met ? scene->shapes[shape].light : CA_NONE;
        v->matte[i] = met && (matte->is_matte || matte->is_patterned) ? UINT32_MAX : 0;
        shapes->extent[i] = matte->extent;
        shapes->back_is_front[i] = matte->back_is_front ? UINT32_MAX : 0;
    }
}

/* Position, its error and the normal, as mesh_surface in geometry/surface.c makes them. A ray too long for that bound
 * makes the point one of the others. */
static void place_matte(ca_batch *batch, const shape_columns *shapes, uint32_t i)
{
    ca_vertex_batch *v = &batch->vertices;
    const ca_v8 origin = ca_column3_load(&batch->rays.origin, i);
    const ca_v8 direction = ca_column3_load(&batch->rays.direction, i);
    const ca_v8 ng = ca_normalize_any_v8(ca_column3_load(&batch->hits.ng, i));
    const ca_v8 segment = ca_mul_v8(direction, ca_load8(batch->hits.t, i));
    const ca_f8 extent = ca_load8(shapes->extent, i);
    const ca_f8 reach = ca_max3_v8(ca_abs_v8(segment)) + ca_max3_v8(ca_abs_v8(origin));
    const ca_m8 matte = ca_load8_u32(v->matte, i) & ~(reach > 4.0f * extent);
    const ca_v8 wi = ca_neg_v8(direction);
    ca_store8_u32(v->matte, i, matte);
    ca_column3_store(&v->position, i, ca_add_v8(origin, segment));
    ca_store8(v->error, i, CA_GAMMA(12) * (reach + extent));
    ca_column3_store(&v->ng, i, ng);
    ca_column3_store(&v->ns, i, ng);
    ca_column3_store(&v->wi, i, wi);
    const ca_m8 mirrored = (ca_dot_v8(wi, ng) < 0.0f) & ca_load8_u32(shapes->back_is_front, i);
    ca_store8(v->side, i, ca_select8(mirrored, ca_f8_all(-1.0f), ca_f8_all(1.0f)));
}

/* What textures read of a surface, as mesh_surface makes it. */
static const ca_surface *pattern_place(ca_batch *batch, const ca_scene *scene, uint32_t i)
{
    const ca_mesh *mesh = scene->shapes[batch->hits.shape[i]].as.mesh.mesh;
    ca_surface *surface = &batch->vertices.surfaces[i];
    surface->position = ca_column3_at(&batch->vertices.position, i);
    surface->ng = ca_column3_at(&batch->vertices.ng, i);
    surface->mesh = mesh;
    surface->primitive = batch->hits.primitive[i];
    surface->barycentric = surface->uv = (ca_vec2){batch->hits.u[i], batch->hits.v[i]};
    if (mesh->uvs) ca_triangle_attributes(mesh, surface->primitive, surface->barycentric, surface);
    return surface;
}

static void color_matte(ca_batch *batch, const ca_scene *scene, uint32_t i)
{
    ca_vertex_batch *v = &batch->vertices;
    const ca_matte_shape *matte = &scene->mattes[batch->hits.shape[i]];
    const bool back = v->side[i] < 0.0f;
    ca_rgb color = matte->reflectance[back];
    if (matte->is_patterned && matte->pattern[back] != CA_NONE)
        color = ca_texture_eval(scene->desc.textures.items, matte->pattern[back], pattern_place(batch, scene, i));
    v->reflectance.x[i] = color.r, v->reflectance.y[i] = color.g, v->reflectance.z[i] = color.b;
}

static const ca_surface *make_surface(ca_batch *batch, const ca_scene *scene, uint32_t i)
{
    ca_surface *surface = &batch->vertices.surfaces[i];
    const ca_hit hit = ca_hit_batch_at(&batch->hits, i);
    ca_accel_surface(scene->accel, ca_column3_at(&batch->rays.origin, i),
                     ca_column3_at(&batch->rays.direction, i), &hit, surface);
    return surface;
}

const ca_surface *ca_batch_surface(ca_batch *batch, const ca_scene *scene, uint32_t i)
{
    return batch->vertices.matte[i] ? make_surface(batch, scene, i) : &batch->vertices.surfaces[i];
}

static void arrive_one(ca_batch *batch, const ca_scene *scene, bool wants_bsdf, uint32_t i)
{
    ca_vertex_batch *v = &batch->vertices;
    const ca_surface *surface = make_surface(batch, scene, i);
    ca_column3_set(&v->position, i, surface->position);
    ca_column3_set(&v->ng, i, surface->ng);
    ca_column3_set(&v->ns, i, surface->ns);
    if (wants_bsdf)
        ca_bsdf_init(&v->bsdfs[i], scene->materials, scene->desc.textures.items, surface, ca_column3_at(&v->wi, i));
}

void ca_batch_arrive(ca_batch *batch, const ca_scene *scene, bool wants_bsdf)
{
    shape_columns shapes;
    look_up_shapes(batch, scene, &shapes);
    for (uint32_t i = 0; i < batch->count; i += CA_LANES) place_matte(batch, &shapes, i);
    for (uint32_t i = 0; i < batch->count; i++) {
        if (batch->vertices.matte[i])
            color_matte(batch, scene, i);
        else if (!ca_batch_left(batch, i))
            arrive_one(batch, scene, wants_bsdf, i);
    }
}

void ca_batch_record_primary(ca_batch *batch)
{
    const ca_vertex_batch *v = &batch->vertices;
    for (uint32_t i = 0; i < batch->count; i++) {
        if (ca_batch_left(batch, i)) continue;
        ca_film_sample *sample = batch->paths[batch->slot[i]].sample;
        const ca_vec3 wi = ca_column3_at(&v->wi, i), ns = ca_column3_at(&v->ns, i);
        const ca_rgb color = {v->reflectance.x[i], v->reflectance.y[i], v->reflectance.z[i]};
        if (!v->matte[i])
            sample->albedo = ca_bsdf_albedo(&v->bsdfs[i], wi);
        else
            sample->albedo = ca_dot(ns, wi) * v->side[i] > 0.0f ? color : ca_rgb_grey(0.0f);
        sample->normal = ns;
        sample->position = ca_column3_at(&v->position, i);
    }
}
