/* Connections: edges between vertices of a camera path and of its paired light path. */
#include "integrator/bidirectional.h"

/* Surfaces and BSDFs of the paired light path are made once for all camera vertices, as far as they are needed. */
static void make_ready(ca_camera_walk *walk, const ca_light_path *path, uint32_t vertex)
{
    const ca_scene *scene = walk->b->input.scene;
    ca_bidirectional_scratch *scratch = walk->scratch;
    for (uint32_t i = walk->light_ready + 1; i <= vertex; i++) {
        const ca_light_vertex *v = ca_light_vertex_at(&walk->b->store, path->first + i);
        const uint32_t end = walk->light_first + i;
        walk->light_ready = i;
        if (!v->capable) continue;
        ca_accel_surface_at(scene->accel, &v->point, &scratch->light_surfaces[end]);
        ca_bsdf_init(&scratch->light_bsdfs[end], scene->materials, scene->desc.textures.items,
                     &scratch->light_surfaces[end], v->wi);
    }
}

static float weight_of(const ca_connection *c)
{
    const ca_camera_walk *walk = c->walk;
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_path_vertex *light = ca_light_density_at(&walk->b->store, c->vertex->first);
    const uint32_t t = c->vertex->index;
    const float ratio_camera = c->cos_camera / ca_abs_dot(walk->walk.surface.ng, walk->walk.wi);
    const float ratio_light = c->cos_light / c->cos_light_in;
    const ca_flight from_camera =
        ca_flight_towards(ca_camera_walk_vertex(walk), c->camera.pdf, c->cos_camera, ratio_camera, reuse);
    const ca_flight from_light = ca_flight_towards(&light[t], c->light.pdf, c->cos_light, ratio_light, reuse);
    const ca_mis_path path =
        ca_join(ca_join_scattering(walk->walk.densities, walk->walk.vertex + 1,
                                   ca_arrive(&from_light, c->distance, c->cos_camera), c->camera.pdf_reverse,
                                   ratio_camera, reuse),
                ca_join_scattering(light, t + 1, ca_arrive(&from_camera, c->distance, c->cos_light),
                                   c->light.pdf_reverse, ratio_light, reuse),
                light, walk->walk.densities[1].distance);
    return ca_bidirectional_weight(walk->b, CA_TECHNIQUE_CONNECT, &path, walk->points, c->vertex - t);
}

static void take(const ca_connection *c)
{
    ca_camera_walk *walk = c->walk;
    const float weight = weight_of(c);
    if (ca_camera_walk_add(walk, walk->connect_slot, CA_TECHNIQUE_CONNECT, walk->walk.vertex + 1,
                           c->vertex->index + 1u, c->unweighted, weight) &&
        walk->scratch->pairing)
        ca_pairs_add_connection(walk, c->unweighted, weight);
}

/* Asks for all rays, and takes what the free ones bring. */
static void answer(ca_bidirectional_scratch *scratch, uint32_t *asked)
{
    if (*asked == 0) return;
    ca_accel_occluded_batch(scratch->connections[0].walk->b->input.scene->accel, &scratch->rays->rays, *asked,
                            scratch->rays->occluded);
    for (uint32_t i = 0; i < *asked; i++)
        if (!scratch->rays->occluded[i]) take(&scratch->connections[i]);
    *asked = 0;
}

/* false: nothing goes along the edge. */
static bool make_edge(ca_camera_walk *walk, const ca_light_vertex *vertex, const ca_bsdf *light_bsdf,
                      ca_connection *c)
{
    const ca_surface *surface = &walk->walk.surface;
    const ca_vec3 segment = ca_sub(vertex->point.position, surface->position);
    const float distance2 = ca_length2(segment);
    if (!(distance2 > 0.0f)) return false;
    c->walk = walk;
    c->vertex = vertex;
    c->distance = sqrtf(distance2);
    const ca_vec3 to_light = ca_mul(segment, 1.0f / c->distance);
    c->camera = ca_bsdf_eval(&walk->walk.bsdf, walk->walk.wi, to_light, CA_FROM_CAMERA);
    if (ca_rgb_is_black(c->camera.f)) return false;
    c->light = ca_bsdf_eval(light_bsdf, vertex->wi, ca_neg(to_light), CA_FROM_LIGHT);
    if (ca_rgb_is_black(c->light.f)) return false;
    c->cos_camera = ca_abs_dot(surface->ng, to_light);
    c->cos_light = ca_abs_dot(vertex->point.ng, to_light);
    c->cos_light_in = ca_abs_dot(vertex->point.ng, vertex->wi);
    const float geometry = c->cos_camera * c->cos_light / distance2;
    c->unweighted = ca_rgb_scale(ca_rgb_mul(ca_rgb_mul(walk->walk.throughput, c->camera.f),
                                            ca_rgb_mul(vertex->throughput, c->light.f)),
                                 geometry);
    return !ca_rgb_is_black(c->unweighted);
}

/* Edges of one walk; full batches of rays are answered on the way. */
static void connect_walk(ca_camera_walk *walk, uint32_t *asked)
{
    ca_bidirectional_scratch *scratch = walk->scratch;
    const ca_light_store *store = &walk->b->store;
    const ca_light_path *path = &store->paths[walk->paired];
    const ca_surface *surface = &walk->walk.surface;
    if (path->count < 2) return;
    /* Segments: walk->vertex, the edge, and i. */
    const uint32_t last = ca_min_u32(path->count - 1, walk->b->max_depth - walk->walk.vertex - 1);
    make_ready(walk, path, last);
    for (uint32_t i = 1; i <= last; i++) {
        const ca_light_vertex *vertex = ca_light_vertex_at(store, path->first + i);
        const uint32_t end = walk->light_first + i;
        if (!vertex->capable || !make_edge(walk, vertex, &scratch->light_bsdfs[end], &scratch->connections[*asked]))
            continue;
        const ca_surface *other = &scratch->light_surfaces[end];
        const ca_segment ray = ca_segment_between(surface->position, surface->position_error, surface->ng,
                                                  other->position, other->position_error, other->ng);
        ca_walk_rays_set(scratch->rays, (*asked)++, ray.origin, ray.direction, 0.0f, ca_visible_t_max);
        walk->worker->counters.shadow_rays++;
        walk->path->segments++;
        if (*asked == CA_RAY_BATCH) answer(scratch, asked);
    }
}

void ca_connect_all(ca_camera_walk *const *walks, uint32_t count)
{
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++)
        if (walks[i]->has_paired && (walks[i]->walk.bsdf.scatter & CA_SCATTER_SMOOTH)) connect_walk(walks[i], &asked);
    if (count > 0) answer(walks[0]->scratch, &asked);
}
