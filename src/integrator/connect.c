/* Connections: edges between vertices of a camera path and of its paired light path. From a matte vertex to matte
 * ones eight edges at a time, all others one by one; then all questions for visibility at once. */
#include "integrator/batch_lanes.h"
#include "integrator/bidirectional.h"

/* ---- Light vertices -------------------------------------------------------------------------------------------- */

/* A matte vertex into the columns. */
static void set_matte(ca_light_ends *ends, uint32_t end, const ca_matte_shape *shape, const ca_light_vertex *v)
{
    const ca_surface_point *p = &v->point;
    const float cos_in = ca_dot(p->ng, v->wi), side = ca_matte_side(shape, cos_in);
    const ca_rgb color = ca_rgb_mul(v->throughput, ca_rgb_scale(shape->reflectance[side < 0.0f], CA_INV_PI));
    ends->position.x[end] = p->position.x, ends->position.y[end] = p->position.y,
    ends->position.z[end] = p->position.z;
    ends->ng.x[end] = p->ng.x, ends->ng.y[end] = p->ng.y, ends->ng.z[end] = p->ng.z;
    ends->color.x[end] = color.r, ends->color.y[end] = color.g, ends->color.z[end] = color.b;
    ends->error[end] = p->position_error;
    ends->side[end] = side;
    ends->cos_in[end] = fabsf(cos_in);
    ends->lit[end] = cos_in * side > CA_GRAZING_COS ? UINT32_MAX : 0;
}

/* The vertices of the paired light path are made once for all camera vertices, as far as they are needed. */
static void make_ready(ca_camera_walk *walk, const ca_light_path *path, uint32_t vertex)
{
    const ca_scene *scene = walk->b->input.scene;
    ca_light_ends *ends = walk->scratch->light_ends;
    const ca_path_vertex *densities = ca_light_density_at(&walk->b->store, path->first);
    for (uint32_t i = walk->light_ready + 1; i <= vertex; i++) {
        const ca_light_vertex *v = ca_light_vertex_at(&walk->b->store, path->first + i);
        const uint32_t end = walk->light_first + i;
        const ca_matte_shape *shape = &scene->mattes[v->point.shape];
        walk->light_ready = i;
        ends->tail[end] =
            ca_mis_light_tail(&walk->b->rules, densities, i, i > 1 ? ends->tail[end - 1] : 0.0);
        ends->lit[end] = 0;
        ends->matte[end] = shape->is_matte;
        if (!v->capable) continue;
        if (shape->is_matte)
            set_matte(ends, end, shape, v);
        else
            ca_vertex_from_point(&ends->vertices[end], scene, &v->point, v->wi);
    }
}

/* ---- Answers --------------------------------------------------------------------------------------------------- */

static float weight_of(const ca_connection *c)
{
    const ca_camera_walk *walk = c->walk;
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_path_vertex *light = ca_light_density_at(&walk->b->store, c->vertex->first);
    const uint32_t t = c->vertex->index;
    const float ratio_camera = c->cos_camera / walk->walk.last.cos_in;
    const float ratio_light = c->cos_light / c->cos_light_in;
    const ca_flight from_camera =
        ca_flight_towards(ca_camera_walk_vertex(walk), c->camera.pdf, c->cos_camera, ratio_camera, reuse);
    const ca_flight from_light = ca_flight_towards(&light[t], c->light.pdf, c->cos_light, ratio_light, reuse);
    const ca_mis_path path =
        ca_join(ca_join_scattering(walk->walk.densities, walk->walk.vertex + 1,
                                   ca_arrive(&from_light, c->distance, c->cos_camera), c->camera.pdf_reverse,
                                   ratio_camera, reuse, walk->walk.tail),
                ca_join_scattering(light, t + 1, ca_arrive(&from_camera, c->distance, c->cos_light),
                                   c->light.pdf_reverse, ratio_light, reuse,
                                   walk->scratch->light_ends->tail[walk->light_first + t]),
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

/* The ray of the connection that the scratch has at *asked. A full batch is answered before the next one comes. */
static void ask(ca_camera_walk *walk, ca_vec3 origin, ca_vec3 direction, uint32_t *asked)
{
    ca_walk_rays_set(walk->scratch->rays, (*asked)++, origin, direction, 0.0f, ca_visible_t_max);
    walk->worker->counters.shadow_rays++;
    walk->path->segments++;
    if (*asked == CA_RAY_BATCH) answer(walk->scratch, asked);
}

/* ---- One edge -------------------------------------------------------------------------------------------------- */

/* false: nothing goes along the edge. */
static bool make_edge(ca_camera_walk *walk, const ca_light_vertex *vertex, const ca_vertex *end, ca_connection *c)
{
    const ca_vertex *last = &walk->walk.last;
    const ca_vec3 segment = ca_sub(end->position, last->position);
    const float distance2 = ca_length2(segment);
    if (!(distance2 > 0.0f)) return false;
    c->walk = walk;
    c->vertex = vertex;
    c->distance = sqrtf(distance2);
    const ca_vec3 to_light = ca_mul(segment, 1.0f / c->distance);
    const ca_bsdf_value camera = ca_vertex_eval(last, to_light, CA_FROM_CAMERA);
    if (ca_rgb_is_black(camera.f)) return false;
    const ca_bsdf_value light = ca_vertex_eval(end, ca_neg(to_light), CA_FROM_LIGHT);
    if (ca_rgb_is_black(light.f)) return false;
    c->camera = (ca_pdf_pair){camera.pdf, camera.pdf_reverse};
    c->light = (ca_pdf_pair){light.pdf, light.pdf_reverse};
    c->cos_camera = ca_abs_dot(last->ng, to_light);
    c->cos_light = ca_abs_dot(end->ng, to_light);
    c->cos_light_in = end->cos_in;
    const float geometry = c->cos_camera * c->cos_light / distance2;
    c->unweighted = ca_rgb_scale(
        ca_rgb_mul(ca_rgb_mul(walk->walk.throughput, camera.f), ca_rgb_mul(vertex->throughput, light.f)), geometry);
    return !ca_rgb_is_black(c->unweighted);
}

static void connect_one(ca_camera_walk *walk, const ca_light_vertex *vertex, const ca_vertex *end, uint32_t *asked)
{
    const ca_vertex *last = &walk->walk.last;
    if (!make_edge(walk, vertex, end, &walk->scratch->connections[*asked])) return;
    const ca_segment ray = ca_segment_between(last->position, last->position_error, last->ng, end->position,
                                              end->position_error, end->ng);
    ask(walk, ray.origin, ray.direction, asked);
}

/* ---- Eight edges ----------------------------------------------------------------------------------------------- */

static inline ca_v8 load_column(const ca_end_column *column, uint32_t i)
{
    return (ca_v8){ca_load8_anywhere(column->x + i), ca_load8_anywhere(column->y + i),
                   ca_load8_anywhere(column->z + i)};
}

/* Edges from one matte vertex to eight. */
typedef struct edges8 {
    ca_m8 lit;
    ca_f8 distance, cos_camera, cos_light;
    ca_v8 light, origin, ray; /* light: before the weight */
} edges8;

/* make_edge and ca_segment_between for light vertices `end` to `end` + 7. */
static edges8 make_edges(const ca_walk *walk, const ca_light_ends *ends, uint32_t end)
{
    const ca_vertex *last = &walk->last;
    const ca_rgb color = ca_rgb_mul(walk->throughput, ca_rgb_scale(last->reflectance, CA_INV_PI));
    const ca_v8 position = ca_v8_all(last->position), ng = ca_v8_all(last->ng);
    const ca_v8 target = load_column(&ends->position, end), other = load_column(&ends->ng, end);
    const ca_v8 arrives = load_column(&ends->color, end);
    const ca_f8 grazing = ca_f8_all(CA_GRAZING_COS);
    const ca_v8 segment = ca_sub_v8(target, position);
    const ca_f8 distance2 = ca_dot_v8(segment, segment), distance = ca_sqrt8(distance2);
    const ca_v8 to_light = ca_mul_v8(segment, 1.0f / distance);
    const ca_f8 cos_camera = ca_dot_v8(ng, to_light) * last->side;
    const ca_f8 cos_light = -ca_dot_v8(other, to_light) * ca_load8_anywhere(ends->side + end);
    const ca_f8 geometry = cos_camera * cos_light / distance2;
    edges8 e = {.distance = distance, .cos_camera = cos_camera, .cos_light = cos_light};
    e.light = (ca_v8){color.r * arrives.x * geometry, color.g * arrives.y * geometry, color.b * arrives.z * geometry};
    e.lit = (ca_m8)ca_load8_anywhere((const float *)(ends->lit + end)) & (distance2 > 0.0f) &
            (cos_camera > grazing) & (cos_light > grazing) &
            ~((e.light.x == 0.0f) & (e.light.y == 0.0f) & (e.light.z == 0.0f));
    e.origin = ca_offset_origin8(position, ca_f8_all(last->position_error.x), ng, segment);
    const ca_v8 there =
        ca_offset_origin8(target, ca_load8_anywhere(ends->error + end), other, ca_neg_v8(segment));
    e.ray = ca_sub_v8(there, e.origin);
    return e;
}

static inline ca_vec3 lane_of(const ca_v8 *v, int lane) { return (ca_vec3){v->x[lane], v->y[lane], v->z[lane]}; }

static void ask_edge(ca_camera_walk *walk, const ca_light_vertex *vertex, float cos_in, const edges8 *e, int lane,
                     uint32_t *asked)
{
    ca_connection *c = &walk->scratch->connections[*asked];
    c->walk = walk;
    c->vertex = vertex;
    c->distance = e->distance[lane];
    c->cos_camera = e->cos_camera[lane];
    c->cos_light = e->cos_light[lane];
    c->cos_light_in = cos_in;
    c->camera.pdf.v = c->cos_camera * CA_INV_PI, c->camera.pdf_reverse.v = walk->walk.last.cos_in * CA_INV_PI;
    c->light.pdf.v = c->cos_light * CA_INV_PI, c->light.pdf_reverse.v = cos_in * CA_INV_PI;
    c->unweighted.r = e->light.x[lane], c->unweighted.g = e->light.y[lane], c->unweighted.b = e->light.z[lane];
    ask(walk, lane_of(&e->origin, lane), lane_of(&e->ray, lane), asked);
}

/* ---- Walks ----------------------------------------------------------------------------------------------------- */

/* The edge to vertex i of the light path, of which the lanes do not know. */
static void connect_other(ca_camera_walk *walk, const ca_light_path *path, uint32_t i, uint32_t *asked)
{
    ca_light_ends *ends = walk->scratch->light_ends;
    const uint32_t end = walk->light_first + i;
    const ca_light_vertex *vertex = ca_light_vertex_at(&walk->b->store, path->first + i);
    if (!vertex->capable) return;
    if (ends->matte[end])
        ca_vertex_from_point(&ends->vertices[end], walk->b->input.scene, &vertex->point, vertex->wi);
    connect_one(walk, vertex, &ends->vertices[end], asked);
}

/* Edges to vertices [first, last] of the light path, eight at most, from a matte vertex. */
static void connect_group(ca_camera_walk *walk, const ca_light_path *path, uint32_t first, uint32_t last,
                          uint32_t *asked)
{
    const ca_light_ends *ends = walk->scratch->light_ends;
    const edges8 edges = make_edges(&walk->walk, ends, walk->light_first + first);
    const uint32_t lit = ca_mask_bits(edges.lit);
    for (uint32_t i = first; i <= last; i++) {
        const uint32_t end = walk->light_first + i;
        if (!ends->matte[end])
            connect_other(walk, path, i, asked);
        else if (lit >> (i - first) & 1)
            ask_edge(walk, ca_light_vertex_at(&walk->b->store, path->first + i), ends->cos_in[end], &edges,
                     (int)(i - first), asked);
    }
}

/* Edges of one walk. */
static void connect_walk(ca_camera_walk *walk, uint32_t *asked)
{
    const ca_light_path *path = &walk->b->store.paths[walk->paired];
    const ca_vertex *vertex = &walk->walk.last;
    if (path->count < 2) return;
    /* Segments: walk->vertex, the edge, and i. */
    const uint32_t last = ca_min_u32(path->count - 1, walk->b->max_depth - walk->walk.vertex - 1);
    make_ready(walk, path, last);
    if (!vertex->matte)
        for (uint32_t i = 1; i <= last; i++) connect_other(walk, path, i, asked);
    else if (ca_dot(vertex->ng, vertex->wi) * vertex->side > CA_GRAZING_COS)
        for (uint32_t i = 1; i <= last; i += CA_LANES)
            connect_group(walk, path, i, ca_min_u32(i + CA_LANES - 1, last), asked);
}

void ca_connect_all(ca_camera_walk *const *walks, uint32_t count)
{
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++)
        if (walks[i]->has_paired && ca_vertex_is_smooth(&walks[i]->walk.last)) connect_walk(walks[i], &asked);
    if (count > 0) answer(walks[0]->scratch, &asked);
}
