/* Connections: edges between vertices of a camera path and of its paired light path. From a matte vertex to matte
 * ones eight edges at a time, all others one by one; then all questions for visibility at once. */
#include "integrator/batch_lanes.h"
#include "integrator/bidirectional.h"

/* ---- Light vertices -------------------------------------------------------------------------------------------- */

/* A matte vertex into the columns. */
static void set_matte(ca_light_ends *ends, uint32_t end, const ca_matte_shape *shape, const ca_light_record *v)
{
    const float cos_in = ca_dot(v->ng, v->wi), side = ca_matte_side(shape, cos_in);
    const ca_rgb color = ca_rgb_mul(v->throughput, ca_rgb_scale(shape->reflectance[side < 0.0f], CA_INV_PI));
    ends->position.x[end] = v->position.x, ends->position.y[end] = v->position.y,
    ends->position.z[end] = v->position.z;
    ends->ng.x[end] = v->ng.x, ends->ng.y[end] = v->ng.y, ends->ng.z[end] = v->ng.z;
    ends->color.x[end] = color.r, ends->color.y[end] = color.g, ends->color.z[end] = color.b;
    ends->error[end] = ca_light_record_error(v);
    ends->side[end] = side;
    ends->cos_in[end] = fabsf(cos_in);
    ends->lit[end] = cos_in * side > CA_GRAZING_COS ? UINT32_MAX : 0;
}

/* The paired light path's record, and its number in it. */
static inline const ca_light_record *record_at(const ca_camera_walk *walk, uint32_t rank)
{
    const ca_light_store *store = &walk->b->store;
    return ca_light_record_at(store, ca_light_record_number(store, &store->paths[walk->paired], rank));
}

static void unpack_densities(const ca_camera_walk *walk, const ca_light_path *path)
{
    const ca_light_store *store = &walk->b->store;
    ca_light_ends *ends = walk->scratch->light_ends;
    ca_path_vertex *densities = &ends->densities[walk->light_first];
    double *tail = &ends->tail[walk->light_first];
    ca_light_unpack(&store->layout, ca_light_words_at(store, path->first), path->count, densities);
    for (uint32_t i = 1; i < path->count; i++)
        tail[i] =
            ca_mis_light_tail(&walk->b->rules, densities, i, i > 1 ? tail[i - 1] : 0.0);
}

/* The paired light path is unpacked once for all camera vertices. */
static void make_ready(ca_camera_walk *walk, const ca_light_path *path)
{
    const ca_scene *scene = walk->b->input.scene;
    const ca_light_store *store = &walk->b->store;
    ca_light_ends *ends = walk->scratch->light_ends;
    if (walk->light_ready) return;
    walk->light_ready = true;
    unpack_densities(walk, path);
    const float *place =
        ca_light_words_at(store, path->first) + (size_t)path->records * store->layout.record_words;
    for (uint32_t rank = 0; rank < path->records; rank++) {
        const ca_light_record *record = record_at(walk, rank);
        const uint32_t end = walk->light_first + rank;
        const ca_matte_shape *shape = &scene->mattes[ca_light_record_shape(&store->layout, record)];
        ends->lit[end] = 0;
        ends->matte[end] = shape->is_matte;
        if (shape->is_matte) {
            set_matte(ends, end, shape, record);
            continue;
        }
        const ca_surface_point point = ca_light_record_point(&store->layout, record, place);
        ca_vertex_from_point(&ends->vertices[end], scene, &point, record->wi);
        place += CA_LIGHT_PLACE_WORDS;
    }
}

/* ---- Answers --------------------------------------------------------------------------------------------------- */

static float weight_of(const ca_connection *c)
{
    const ca_camera_walk *walk = c->walk;
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_light_layout *layout = &walk->b->store.layout;
    const ca_path_vertex *light = &walk->scratch->light_ends->densities[walk->light_first];
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
                light, walk->walk.densities[1].distance, walk->factors);
    if (walk->scratch->seen)
        ca_light_unpack_points(layout, ca_light_record_start(layout, c->vertex), t + 1, walk->scratch->seen);
    return ca_bidirectional_weight(walk->b, walk->scratch, CA_TECHNIQUE_CONNECT, &path, walk->points,
                                   walk->scratch->seen);
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
static bool make_edge(ca_camera_walk *walk, const ca_light_record *vertex, const ca_vertex *end, ca_connection *c)
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
    if (walk->b->paper) c->camera = c->light = (ca_pdf_pair){CA_PAPER_PDF, CA_PAPER_PDF};
    c->cos_camera = ca_abs_dot(last->ng, to_light);
    c->cos_light = ca_abs_dot(end->ng, to_light);
    c->cos_light_in = end->cos_in;
    const float geometry = c->cos_camera * c->cos_light / distance2;
    c->unweighted = ca_rgb_scale(
        ca_rgb_mul(ca_rgb_mul(walk->walk.throughput, camera.f), ca_rgb_mul(vertex->throughput, light.f)), geometry);
    return !ca_rgb_is_black(c->unweighted);
}

static void connect_one(ca_camera_walk *walk, const ca_light_record *vertex, const ca_vertex *end, uint32_t *asked)
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

static void ask_edge(ca_camera_walk *walk, const ca_light_record *vertex, float cos_in, const edges8 *e, int lane,
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

/* The edge to a record of the light path, of which the lanes do not know. */
static void connect_other(ca_camera_walk *walk, uint32_t rank, uint32_t *asked)
{
    ca_light_ends *ends = walk->scratch->light_ends;
    const uint32_t end = walk->light_first + rank;
    const ca_light_record *record = record_at(walk, rank);
    if (ends->matte[end]) {
        const ca_surface_point point = ca_light_record_point(&walk->b->store.layout, record, NULL);
        ca_vertex_from_point(&ends->vertices[end], walk->b->input.scene, &point, record->wi);
    }
    connect_one(walk, record, &ends->vertices[end], asked);
}

/* Edges to records [first, end) of the light path, eight at most, from a matte vertex. */
static void connect_group(ca_camera_walk *walk, uint32_t first, uint32_t end, uint32_t *asked)
{
    const ca_light_ends *ends = walk->scratch->light_ends;
    const edges8 edges = make_edges(&walk->walk, ends, walk->light_first + first);
    const uint32_t lit = ca_mask_bits(edges.lit);
    for (uint32_t rank = first; rank < end; rank++) {
        if (!ends->matte[walk->light_first + rank])
            connect_other(walk, rank, asked);
        else if (lit >> (rank - first) & 1)
            ask_edge(walk, record_at(walk, rank), ends->cos_in[walk->light_first + rank], &edges, (int)(rank - first),
                     asked);
    }
}

/* Records that do not make too long a path: walk->vertex segments, the edge, and the record's index. */
static uint32_t records_in_reach(const ca_camera_walk *walk, const ca_light_path *path)
{
    const uint32_t last = walk->b->max_depth - walk->walk.vertex - 1;
    uint32_t count = path->records;
    if (path->count > last)
        while (count > 0 && record_at(walk, count - 1)->index > last) count--;
    return count;
}

/* Edges of one walk. */
static void connect_walk(ca_camera_walk *walk, uint32_t *asked)
{
    const ca_light_path *path = &walk->b->store.paths[walk->paired];
    const ca_vertex *vertex = &walk->walk.last;
    if (path->records == 0) return;
    const uint32_t count = records_in_reach(walk, path);
    make_ready(walk, path);
    if (!vertex->matte || walk->b->paper)
        for (uint32_t rank = 0; rank < count; rank++) connect_other(walk, rank, asked);
    else if (ca_dot(vertex->ng, vertex->wi) * vertex->side > CA_GRAZING_COS)
        for (uint32_t rank = 0; rank < count; rank += CA_LANES)
            connect_group(walk, rank, ca_min_u32(rank + CA_LANES, count), asked);
}

void ca_connect_all(ca_camera_walk *const *walks, uint32_t count)
{
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++)
        if (walks[i]->has_paired && ca_vertex_is_smooth(&walks[i]->walk.last)) connect_walk(walks[i], &asked);
    if (count > 0) answer(walks[0]->scratch, &asked);
}
