/* Joins of a camera path with light paths: edges between vertices, and merges of vertices that are close. */
#include "integrator/bidirectional.h"

#include <stddef.h>

/* ---- Connect --------------------------------------------------------------------------------------------------- */

/* A vertex of the paired light path, with its surface and BSDF. */
typedef struct light_end {
    const ca_path_vertex *densities; /* of the path, from the light on */
    const ca_light_vertex *vertex;
    const ca_surface *surface;
    const ca_bsdf *bsdf;
    uint32_t index; /* in the path */
} light_end;

/* Surfaces and BSDFs of the paired light path are made once for all camera vertices, as far as they are needed. */
static void make_ready(ca_camera_walk *walk, const ca_light_path *path, uint32_t vertex)
{
    const ca_scene *scene = walk->b->input.scene;
    ca_bidirectional_scratch *scratch = walk->scratch;
    for (uint32_t i = scratch->light_ready + 1; i <= vertex; i++) {
        const ca_light_vertex *v = ca_light_vertex_at(&walk->b->store, path->first + i);
        scratch->light_ready = i;
        if (!v->capable) continue;
        ca_accel_surface_at(scene->accel, &v->point, &scratch->light_surfaces[i]);
        ca_bsdf_init(&scratch->light_bsdfs[i], scene->materials, scene->desc.textures.items,
                     &scratch->light_surfaces[i], v->wi);
    }
}

/* The edge between the camera path's last vertex and a light vertex. */
typedef struct edge {
    ca_vec3 to_light; /* unit */
    float distance;
    float cos_camera, cos_light;
    ca_bsdf_value camera, light;
} edge;

static float connect_weight(const ca_camera_walk *walk, const light_end *end, const edge *e)
{
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_path_vertex *c = &walk->scratch->camera[walk->vertex], *l = &end->densities[end->index];
    const float inverse2 = 1.0f / ca_sqr(e->distance);
    const float ratio_camera = e->cos_camera / ca_abs_dot(walk->surface.ng, walk->wi);
    const float ratio_light = e->cos_light / ca_abs_dot(end->surface->ng, end->vertex->wi);
    const float area_camera = ca_sqrt_area_out(reuse, c->sqrt_area, ratio_camera);
    const float area_light = ca_sqrt_area_out(reuse, l->sqrt_area, ratio_light);
    const float omega_camera = c->sqrt_omega + ca_footprint_spread(reuse->epsilon, e->camera.pdf);
    const float omega_light = l->sqrt_omega + ca_footprint_spread(reuse->epsilon, e->light.pdf);
    const ca_mis_path path = {
        .camera = {.vertices = walk->scratch->camera,
                   .count = walk->vertex + 1,
                   .pdf_last = {e->light.pdf.v * e->cos_camera * inverse2},
                   .pdf_before = {e->camera.pdf_reverse.v * c->to_previous},
                   .sqrt_area = area_light + e->distance * omega_light,
                   .sqrt_omega = omega_light,
                   .spread = ca_footprint_spread(reuse->epsilon, e->camera.pdf_reverse),
                   .cos_ratio = ratio_camera},
        .light = {.vertices = end->densities,
                  .count = end->index + 1,
                  .pdf_last = {e->camera.pdf.v * e->cos_light * inverse2},
                  .pdf_before = {e->light.pdf_reverse.v * l->to_previous},
                  .sqrt_area = area_camera + e->distance * omega_camera,
                  .sqrt_omega = omega_camera,
                  .spread = ca_footprint_spread(reuse->epsilon, e->light.pdf_reverse),
                  .cos_ratio = ratio_light},
        .next_event_ratio = end->densities->next_event_ratio,
        .light_choice = end->densities->light_choice,
        .light_infinite = end->densities->at_infinity,
        .camera_distance = walk->scratch->camera[1].distance,
    };
    return ca_bidirectional_weight(walk->b, CA_TECHNIQUE_CONNECT, &path, walk->scratch->points,
                                   end->vertex - end->index);
}

static void connect_to(ca_camera_walk *walk, const light_end *end)
{
    const ca_surface *surface = &walk->surface, *other = end->surface;
    const ca_vec3 segment = ca_sub(end->vertex->point.position, surface->position);
    const float distance2 = ca_length2(segment);
    if (!(distance2 > 0.0f)) return;
    edge e = {.distance = sqrtf(distance2)};
    e.to_light = ca_mul(segment, 1.0f / e.distance);
    e.camera = ca_bsdf_eval(&walk->bsdf, walk->wi, e.to_light, CA_FROM_CAMERA);
    if (ca_rgb_is_black(e.camera.f)) return;
    e.light = ca_bsdf_eval(end->bsdf, end->vertex->wi, ca_neg(e.to_light), CA_FROM_LIGHT);
    if (ca_rgb_is_black(e.light.f)) return;
    e.cos_camera = ca_abs_dot(surface->ng, e.to_light);
    e.cos_light = ca_abs_dot(other->ng, e.to_light);
    const float geometry = e.cos_camera * e.cos_light / distance2;
    const ca_rgb unweighted = ca_rgb_scale(ca_rgb_mul(ca_rgb_mul(walk->throughput, e.camera.f),
                                                      ca_rgb_mul(end->vertex->throughput, e.light.f)),
                                           geometry);
    if (ca_rgb_is_black(unweighted)) return;
    walk->worker->counters.shadow_rays++;
    if (!ca_accel_visible(walk->b->input.scene->accel, surface->position, surface->position_error, surface->ng,
                          other->position, other->position_error, other->ng))
        return;
    const float weight = connect_weight(walk, end, &e);
    if (ca_camera_walk_add(walk, walk->connect_slot, CA_TECHNIQUE_CONNECT, walk->vertex + 1, end->index + 1,
                           unweighted, weight) &&
        walk->scratch->pairing)
        ca_pairs_add_connection(walk, unweighted, weight);
}

void ca_join_connect(ca_camera_walk *walk)
{
    const ca_light_store *store = &walk->b->store;
    const ca_light_path *path = &store->paths[walk->paired];
    if (path->count < 2) return;
    const ca_path_vertex *densities = ca_light_density_at(store, path->first);
    /* Segments: walk->vertex, the edge, and i. */
    const uint32_t last = ca_min_u32(path->count - 1, walk->b->max_depth - walk->vertex - 1);
    make_ready(walk, path, last);
    for (uint32_t i = 1; i <= last; i++) {
        const ca_light_vertex *vertex = ca_light_vertex_at(store, path->first + i);
        if (!vertex->capable) continue;
        connect_to(walk, &(light_end){.densities = densities,
                                      .vertex = vertex,
                                      .surface = &walk->scratch->light_surfaces[i],
                                      .bsdf = &walk->scratch->light_bsdfs[i],
                                      .index = i});
    }
}

/* ---- Merge ----------------------------------------------------------------------------------------------------- */

/* The path whose split lies behind the merged vertex, which is the camera's. Its light's last vertex is the photon's
 * previous one. */
float ca_join_merge_weight(const ca_camera_walk *walk, const ca_light_store *store, const ca_light_vertex *photon,
                           const ca_bsdf_value *value)
{
    const ca_path_vertex *densities = ca_light_density_at(store, photon->first);
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_path_vertex *c = &walk->scratch->camera[walk->vertex];
    const float cos_in = ca_abs_dot(walk->surface.ng, walk->wi), cos_out = ca_abs_dot(walk->surface.ng, photon->wi);
    const float ratio = cos_out / cos_in;
    const float omega_camera = c->sqrt_omega + ca_footprint_spread(reuse->epsilon, value->pdf);
    const float area_camera = ca_sqrt_area_out(reuse, c->sqrt_area, ratio);
    const uint32_t t = photon->index; /* vertices before the photon */
    const ca_path_vertex *l = &densities[t];
    const ca_mis_path path = {
        .camera = {.vertices = walk->scratch->camera,
                   .count = walk->vertex + 1,
                   .pdf_last = l->pdf_forward,
                   .pdf_before = {value->pdf_reverse.v * c->to_previous},
                   .sqrt_area = l->sqrt_area,
                   .sqrt_omega = l->sqrt_omega,
                   .spread = ca_footprint_spread(reuse->epsilon, value->pdf_reverse),
                   .cos_ratio = ratio},
        .light = {.vertices = densities,
                  .count = t,
                  .pdf_last = {value->pdf.v * l->to_previous},
                  .pdf_before = t > 1 ? densities[t - 2].pdf_reverse : (ca_pdf_area){0.0f},
                  .sqrt_area = area_camera + l->distance * omega_camera,
                  .sqrt_omega = omega_camera,
                  .spread = densities[t - 1].spread_reverse,
                  .cos_ratio = densities[t - 1].cos_ratio},
        .next_event_ratio = densities->next_event_ratio,
        .light_choice = densities->light_choice,
        .light_infinite = densities->at_infinity,
        .camera_distance = walk->scratch->camera[1].distance,
    };
    return ca_bidirectional_weight(walk->b, CA_TECHNIQUE_MERGE, &path, walk->scratch->points,
                                   ca_light_vertex_at(store, photon->first));
}

static void merge_with(ca_camera_walk *walk, uint32_t chunk, const ca_light_vertex *photon, float normalisation)
{
    const ca_bsdf_value value = ca_bsdf_eval(&walk->bsdf, walk->wi, photon->wi, CA_FROM_CAMERA);
    const ca_rgb unweighted = ca_rgb_scale(
        ca_rgb_mul(ca_rgb_mul(walk->throughput, value.f), photon->throughput), normalisation);
    if (ca_rgb_is_black(unweighted)) return;
    walk->worker->counters.merges++;
    const float weight = ca_join_merge_weight(walk, &walk->b->store, photon, &value);
    if (ca_camera_walk_add(walk, chunk, CA_TECHNIQUE_MERGE, walk->vertex + 1, photon->index + 1u, unweighted,
                           weight) &&
        walk->scratch->pairing)
        ca_pairs_add_merge(walk, chunk, photon, unweighted, weight);
}

/* Not too long a path, and on the same surface. */
static inline bool may_merge(const ca_camera_walk *walk, const ca_light_vertex *photon)
{
    return walk->vertex + photon->index <= walk->b->max_depth &&
           ca_dot(photon->point.ng, walk->surface.ng) >= CA_MERGE_MIN_COS;
}

/* Light vertices and the densities of their paths lie all over the memory. Asking for those of a batch before using
 * the first overlaps the waiting, which would be most of what a merge costs. */
static void merge_batch(ca_camera_walk *walk, const uint32_t *found, uint32_t count, float normalisation)
{
    const ca_light_store *store = &walk->b->store;
    uint32_t kept[CA_PHOTON_BATCH], kept_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const char *photon = (const char *)ca_light_vertex_at(store, found[i]);
        __builtin_prefetch(photon);
        __builtin_prefetch(photon + offsetof(ca_light_vertex, point.position) - 1);
    }
    for (uint32_t i = 0; i < count; i++) {
        const ca_light_vertex *photon = ca_light_vertex_at(store, found[i]);
        if (!may_merge(walk, photon)) continue;
        kept[kept_count++] = found[i];
        const char *densities = (const char *)ca_light_density_at(store, photon->first);
        for (uint32_t at = 0; at < (photon->index + 1u) * sizeof(ca_path_vertex); at += 64)
            __builtin_prefetch(densities + at);
    }
    for (uint32_t i = 0; i < kept_count; i++)
        merge_with(walk, ca_light_chunk_of(store, kept[i]), ca_light_vertex_at(store, kept[i]), normalisation);
}

void ca_join_merge_start(const ca_camera_walk *walk, ca_photon_query *query)
{
    ca_photon_query_start(query, walk->b->grid, walk->surface.position);
}

void ca_join_merge(ca_camera_walk *walk, ca_photon_query *query)
{
    const ca_bidirectional *b = walk->b;
    const float normalisation = 1.0f / (b->rules.merge_area * (float)b->light_paths);
    uint32_t found[CA_PHOTON_BATCH], count;
    while ((count = ca_photon_query_next(query, found)) > 0) merge_batch(walk, found, count, normalisation);
    walk->worker->counters.photons_tested += query->tested;
}
