/* Camera paths: how they start, what they hit, and the stages that a batch of them goes through. */
#include "integrator/bidirectional.h"

#include "base/stop.h"

/* How many photons count as one sample at the last vertex (the density rule). */
static float crowd(const ca_camera_walk *walk)
{
    return ca_max(1.0f, walk->b->rules.merge_area * ca_camera_walk_vertex(walk)->photon_density);
}

bool ca_camera_walk_add(ca_camera_walk *walk, uint32_t chunk, ca_technique technique, uint32_t s, uint32_t t,
                        ca_rgb unweighted, float weight)
{
    const ca_rgb value = ca_rgb_scale(unweighted, weight);
    if (!(ca_rgb_is_finite(value) && value.r >= 0.0f && value.g >= 0.0f && value.b >= 0.0f)) {
        walk->worker->counters.non_finite[technique]++;
        return false;
    }
    walk->light[chunk] = ca_rgb_add(walk->light[chunk], value);
    walk->light_used[chunk / 64] |= UINT64_C(1) << chunk % 64;
    if (walk->b->tally)
        ca_technique_tally_add(walk->b->tally, walk->path->x, walk->path->y, technique, s, t, walk->light_class,
                               technique == CA_TECHNIQUE_MERGE ? crowd(walk) : 1.0f, unweighted, weight);
    const ca_path_observer *observer = walk->b->input.observer;
    if (observer && observer->take) observer->take(observer->user, walk->path->x, walk->path->y, unweighted);
    ca_technique_images *images = walk->b->input.technique_images;
    if (images)
        ca_technique_images_add(
            images, technique, s, t, walk->path->x, walk->path->y,
            ca_rgb_scale(unweighted, walk->path->sample->filter_weight / (float)walk->b->camera_paths), weight);
    return true;
}

/* Only one round gathers what needs no light paths. */
static inline bool gathers_own_light(const ca_bidirectional *b) { return b->first_chunk == 0; }

/* Keeps the last vertex' point where somebody observes. */
static inline void keep_point(ca_camera_walk *walk, ca_surface_point point)
{
    if (walk->points) walk->points[walk->walk.vertex] = point;
}

/* ---- Hit ------------------------------------------------------------------------------------------------------- */

static float hit_weight(const ca_camera_walk *walk, uint32_t light_index, const ca_light_hit *hit,
                        const ca_surface *surface)
{
    const ca_scene *scene = walk->b->input.scene;
    const ca_light *light = &scene->lights[light_index];
    const ca_emission_guide *guide = walk->b->guide;
    const float choice = ca_emission_probability(guide, &scene->light_choice, light_index);
    const ca_walk *w = &walk->walk;
    const ca_emitted_ray ray = {.origin = surface ? surface->position : w->origin,
                                .ng = surface ? surface->ng : (ca_vec3){0},
                                .direction = ca_neg(w->direction)};
    const ca_emission_pdf pdf = ca_emission_ray_pdf(guide, light_index, &ray,
                                                    (ca_emission_pdf){hit->pdf_position, hit->pdf_direction});
    const float distance = ca_camera_walk_vertex(walk)->distance;
    const float cos_light = surface ? ca_abs_dot(surface->ng, w->direction) : 1.0f;
    ca_path_vertex end;
    const ca_pdf_solid_angle pdf_direction = walk->b->paper ? CA_PAPER_PDF : pdf.direction;
    const ca_flight flight =
        ca_light_end(light, choice, pdf.position, pdf_direction, cos_light, &walk->b->rules.reuse, &end);
    end.light_class = ca_factor_light(light_index);
    if (!walk->b->paper)
        end.next_event_ratio =
            hit->next_event_ratio * ca_emission_ratio(guide, &scene->light_choice, &w->receiver, light_index);
    const float to_light = surface ? distance : ca_light_disk_distance(light, ca_neg(w->direction), w->origin);
    const ca_pdf_area pdf_before = {ca_flight_density(&flight, to_light, w->flight.cos_out)};
    const ca_mis_path path = ca_join(ca_join_hit(w->densities, w->vertex + 1, &end, &flight, pdf_before),
                                     (ca_mis_side){0}, &end, w->densities[1].distance, walk->factors);
    return ca_bidirectional_weight(walk->b, walk->scratch, CA_TECHNIQUE_HIT, &path, walk->points, NULL);
}

/* Did the path see the light at once or by Dirac events alone? */
static bool is_shown(const ca_walk *w) { return w->densities[w->vertex - 1].connectable_count == 0; }

/* The path's last vertex lies on the light; surface NULL: at infinity. */
static void add_hit(ca_camera_walk *walk, uint32_t light_index, const ca_surface *surface)
{
    const ca_bidirectional *b = walk->b;
    const ca_walk *w = &walk->walk;
    if (!gathers_own_light(b) || (w->vertex == 1 && b->hide_emitters)) return;
    if (walk->hooks && walk->hooks->shows_light && !walk->hooks->shows_light(walk)) return;
    const ca_light *light = &b->input.scene->lights[light_index];
    const ca_light_hit hit = ca_light_eval_hit(light, w->origin, surface, ca_neg(w->direction));
    const ca_rgb unweighted = ca_rgb_mul(w->throughput, hit.radiance);
    if (ca_rgb_is_black(unweighted)) return;
    const float weight = hit_weight(walk, light_index, &hit, surface);
    walk->light_class = ca_factor_light(light_index);
    if (!ca_camera_walk_add(walk, 0, CA_TECHNIQUE_HIT, w->vertex + 1, 0, unweighted, weight)) return;
    if (b->input.tells_shown && is_shown(w)) walk->path->shown += weight * ca_luminance(unweighted);
    if (walk->scratch->pairing) ca_pairs_add_alone(walk, unweighted, weight);
}

/* The path left the scene: its last vertex is a direction. */
static void add_environment(ca_camera_walk *walk)
{
    const ca_scene *scene = walk->b->input.scene;
    ca_walk *w = &walk->walk;
    if (scene->environment == CA_NONE) return;
    ca_path_vertex *v = &w->densities[++w->vertex];
    const ca_light *light = &scene->lights[scene->environment];
    *v = (ca_path_vertex){.pdf_forward = {w->flight.pdf},
                          .distance = ca_light_disk_distance(light, ca_neg(w->direction), w->origin),
                          .cos_ratio = 1.0f,
                          .connectable_count = (v - 1)->connectable_count};
    const ca_vec3 far_point = ca_madd(w->origin, 4.0f * light->scene_radius, w->direction);
    keep_point(walk, (ca_surface_point){.position = far_point, .shape = CA_NONE});
    add_hit(walk, scene->environment, NULL);
}

/* ---- Start ----------------------------------------------------------------------------------------------------- */

/* Which light path this camera path connects to. Over the passes a pixel meets them all: it must not stay with one
 * part of a low-discrepancy sequence. */
static void pair(ca_camera_walk *walk)
{
    const ca_bidirectional *b = walk->b;
    if (!b->rules.connect) return;
    const ca_camera_path *path = walk->path;
    const uint64_t pixel = (uint64_t)path->y * b->input.camera->width + path->x;
    const uint32_t of_pixel = ca_bidirectional_camera_paths_of(b, path->x, path->y);
    const uint64_t number =
        (pixel * b->camera_paths + path->index % of_pixel + b->pairing_shift) % b->light_paths;
    const uint64_t chunk = number / CA_CHUNK_PATHS;
    walk->paired_number = number;
    if (chunk < b->first_chunk || chunk >= b->first_chunk + b->chunks_now) return;
    walk->connect_slot = (uint32_t)(chunk - b->first_chunk);
    walk->has_paired = true;
    walk->paired = (uint32_t)(number - (uint64_t)b->first_chunk * CA_CHUNK_PATHS);
}

/* Adds the light gathered with all chunks, in order; it is zero afterwards. */
static void take_light(const ca_camera_walk *walk, ca_rgb *sum)
{
    for (uint32_t w = 0; w < ca_chunk_words(walk->b); w++)
        for (; walk->light_used[w]; walk->light_used[w] &= walk->light_used[w] - 1) {
            ca_rgb *light = &walk->light[64 * w + (uint32_t)__builtin_ctzll(walk->light_used[w])];
            *sum = ca_rgb_add(*sum, *light);
            *light = (ca_rgb){0};
        }
}

/* The first segment, for an offset from the pixel's centre. */
static void start_ray(ca_camera_walk *walk, ca_vec2 offset)
{
    const ca_integrator_input *input = &walk->b->input;
    const ca_camera_path *path = walk->path;
    ca_walk *w = &walk->walk;
    const ca_camera_ray ray = ca_walk_camera_ray(input->camera, &w->stream, path->x, path->y, offset);
    const ca_vec2 film = {(float)path->x + 0.5f + offset.x, (float)path->y + 0.5f + offset.y};
    walk->factors = ca_bidirectional_factors(walk->b, film);
    w->from = CA_FROM_CAMERA;
    w->uniform = walk->b->paper;
    w->vertex = 0;
    w->receiver = (ca_light_receiver){.position = ray.origin};
    w->origin = ray.origin;
    w->direction = ray.direction;
    w->t_min = ray.t_min;
    w->t_max = ray.t_max;
    w->throughput = ray.weight;
    w->start = w->eta2 = 1.0f;
    w->tail = 0.0;
    w->flight = ca_camera_end(ray.camera, ray.pdf_position, ray.pdf_direction, &walk->b->rules.reuse,
                              &w->densities[0]);
    w->densities[0].splat_scale = ca_bidirectional_splat_scale(walk->b, film);
    keep_point(walk, (ca_surface_point){.position = ray.origin});
}

/* All but the first segment. */
static void prepare(ca_camera_walk *walk, const ca_bidirectional *b, ca_camera_path *path, uint32_t slot,
                    ca_worker *worker)
{
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    walk->b = b;
    walk->worker = worker;
    walk->scratch = scratch;
    walk->path = path;
    walk->has_paired = false;
    walk->light_first = 0;
    walk->light_ready = false;
    walk->hooks = NULL;
    walk->light = scratch->chunk_light + (size_t)slot * (b->resident + 1);
    walk->light_used = scratch->chunk_used + (size_t)slot * ca_chunk_words(b);
    walk->points = scratch->points ? scratch->points + (size_t)slot * scratch->row : NULL;
    walk->walk.densities = scratch->densities + (size_t)slot * scratch->row;
    walk->walk.stream =
        ca_stream_start(b->input.sampler, (uint64_t)path->y * b->input.camera->width + path->x, path->index);
    take_light(walk, &(ca_rgb){0}); /* of the path before, where nobody has */
}

void ca_camera_walk_start(ca_camera_walk *walk, const ca_bidirectional *b, ca_camera_path *path, uint32_t slot,
                          ca_worker *worker)
{
    prepare(walk, b, path, slot, worker);
    start_ray(walk, ca_filter_sample(b->input.filter, ca_sample_2d(&walk->walk.stream, CA_DIM_FILM),
                                     &path->sample->filter_weight));
}

/* ---- Stages ---------------------------------------------------------------------------------------------------- */

/* The walks of a batch that have not ended. */
typedef struct walk_list {
    ca_camera_walk *walks[CA_WALKS];
    uint32_t count;
} walk_list;

static void intersect(const walk_list *list)
{
    const ca_scene *scene = list->walks[0]->b->input.scene;
    ca_walk_rays *rays = list->walks[0]->scratch->rays;
    for (uint32_t i = 0; i < list->count; i++) {
        const ca_walk *w = &list->walks[i]->walk;
        ca_walk_rays_set(rays, i, w->origin, w->direction, w->t_min, w->t_max);
        list->walks[i]->path->segments++;
    }
    list->walks[0]->worker->counters.rays += list->count;
    ca_accel_intersect_batch(scene->accel, &rays->rays, list->count, &rays->hits);
}

/* From hits to vertices, with the light that the paths hit; false where a path ends. */
static bool arrive(ca_camera_walk *walk, const ca_hit *hit)
{
    const ca_bidirectional *b = walk->b;
    const ca_scene *scene = b->input.scene;
    ca_walk *w = &walk->walk;
    if (hit->shape == CA_NONE) {
        add_environment(walk);
        return false;
    }
    if (!ca_walk_arrive(w, scene, hit)) return false;
    w->tail = ca_mis_camera_tail(&b->rules, w->densities, w->vertex, w->tail);
    if (walk->points) keep_point(walk, ca_vertex_point(&w->last));
    if (w->last.light != CA_NONE) add_hit(walk, w->last.light, ca_vertex_surface(&w->last, scene));
    if (w->vertex > 1 && w->vertex >= b->max_depth) return false;
    ca_vertex_prepare(&w->last, scene);
    if (w->vertex > 1) return true;
    walk->path->sample->albedo = ca_vertex_albedo(&w->last);
    walk->path->sample->normal = w->last.matte ? w->last.ng : w->last.surface.ns;
    walk->path->sample->position = w->last.position;
    return w->vertex < b->max_depth;
}

static void arrive_all(walk_list *list)
{
    ca_walk *walks[CA_WALKS];
    const ca_hit_batch *hits = &list->walks[0]->scratch->rays->hits;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < list->count; i++) {
        const ca_hit hit = ca_hit_batch_at(hits, i);
        if (!arrive(list->walks[i], &hit)) continue;
        walks[kept] = &list->walks[i]->walk;
        list->walks[kept++] = list->walks[i];
    }
    list->count = kept;
    if (kept > 0) ca_bidirectional_densities(list->walks[0]->b, walks, kept);
}

/* Asks the lights and joins the last vertices with all that light paths offer, or what takes the place of that. */
static void gather_all(const walk_list *list)
{
    const ca_bidirectional *b = list->walks[0]->b;
    if (list->walks[0]->hooks) {
        list->walks[0]->hooks->at_vertices(list->walks, list->count);
        return;
    }
    if (b->rules.next_event && gathers_own_light(b)) ca_next_events(list->walks, list->count, true);
    if (b->rules.connect) ca_connect_all(list->walks, list->count);
    if (ca_bidirectional_merges(b)) ca_merge_all(list->walks, list->count);
}

/* Does the algorithm do nothing behind so many smooth events? */
static inline bool is_finished(const ca_mis_rules *rules, uint32_t smooth)
{
    return rules->hit == CA_HIT_DIRECT || (rules->hit == CA_HIT_UNMERGEABLE && smooth >= rules->merge_limit);
}

/* Surely finished, whatever its last vertex' event may be? */
static bool is_surely_finished(const ca_camera_walk *walk)
{
    const bool surely_smooth = !(walk->walk.last.scatter & CA_SCATTER_DIRAC);
    return is_finished(&walk->b->rules, ca_camera_walk_vertex(walk)->connectable_count + surely_smooth);
}

/* Samples events where the algorithm wants to know what lies behind them. */
static void scatter_all(walk_list *list)
{
    const ca_bidirectional *b = list->walks[0]->b;
    ca_walk *walks[CA_WALKS];
    bool goes_on[CA_WALKS];
    uint32_t wanted = 0, kept = 0;
    for (uint32_t i = 0; i < list->count; i++)
        if (!is_surely_finished(list->walks[i])) list->walks[wanted++] = list->walks[i];
    for (uint32_t i = 0; i < wanted; i++) walks[i] = &list->walks[i]->walk;
    ca_walks_scatter(walks, wanted, &b->rules.reuse, b->rr_depth, goes_on);
    for (uint32_t i = 0; i < wanted; i++) {
        const uint32_t smooth = ca_camera_walk_vertex(list->walks[i])->connectable_count;
        if (goes_on[i] && !is_finished(&b->rules, smooth) && walks[i]->vertex + 2 < CA_PATH_MAX_VERTICES)
            list->walks[kept++] = list->walks[i];
    }
    list->count = kept;
}

void ca_camera_walks_trace(ca_camera_walk *const *walks, uint32_t count)
{
    walk_list list = {.count = 0};
    for (uint32_t i = 0; i < count; i++)
        if (!ca_rgb_is_black(walks[i]->walk.throughput))
            list.walks[list.count++] = walks[i]; /* the lens lets it in */
    const int *stop = walks[0]->b->input.stop;
    while (list.count > 0 && !ca_stop_asked(stop)) {
        intersect(&list);
        arrive_all(&list);
        if (list.count == 0) return;
        gather_all(&list);
        scatter_all(&list);
    }
}

/* ---- Batches --------------------------------------------------------------------------------------------------- */

/* Vertices of the light path that it connects to. */
static uint32_t light_ends(const ca_camera_walk *walk)
{
    return walk->has_paired ? walk->b->store.paths[walk->paired].count : 0;
}

static void start_rays(const ca_bidirectional *b, ca_camera_walk *const *walks, uint32_t count)
{
    float x[CA_WALKS], y[CA_WALKS], weight_x[CA_WALKS], weight_y[CA_WALKS];
    for (uint32_t i = 0; i < count; i++) {
        const ca_vec2 u = ca_sample_2d(&walks[i]->walk.stream, CA_DIM_FILM);
        x[i] = u.x, y[i] = u.y;
    }
    ca_filter_sample_axis(b->input.filter, count, x, weight_x);
    ca_filter_sample_axis(b->input.filter, count, y, weight_y);
    for (uint32_t i = 0; i < count; i++) {
        if (b->paper) x[i] = y[i] = 0.0f, weight_x[i] = weight_y[i] = 1.0f; /* the pixel's centre */
        walks[i]->path->sample->filter_weight = weight_x[i] * weight_y[i];
        start_ray(walks[i], (ca_vec2){x[i], y[i]});
    }
}

/* Starts walks until there are CA_WALKS of them or the light paths they connect to have no room; pairs are gathered
 * path by path. */
static uint32_t start_batch(const ca_bidirectional *b, ca_camera_path *paths, uint32_t count, ca_camera_walk **walks,
                            ca_worker *worker)
{
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    const uint32_t most = scratch->pairing ? 1 : ca_min_u32(count, CA_WALKS);
    uint32_t started = 0, ends = 0;
    while (started < most && ends + CA_PATH_MAX_VERTICES <= CA_LIGHT_ENDS) {
        ca_camera_walk *walk = walks[started] = &scratch->camera_walks[started];
        prepare(walk, b, &paths[started], started, worker);
        pair(walk);
        walk->light_first = ends;
        ends += light_ends(walk);
        started++;
    }
    start_rays(b, walks, started);
    return started;
}

void ca_bidirectional_camera_paths(const void *state, ca_camera_path *paths, uint32_t count, uint32_t round,
                                   ca_worker *worker)
{
    const ca_bidirectional *b = state;
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    ca_camera_walk *walks[CA_WALKS];
    if (round == 0) worker->counters.camera_paths += count;
    while (count > 0) {
        const uint32_t size = start_batch(b, paths, count, walks, worker);
        if (scratch->pairing) ca_pairs_next_path(b, scratch);
        if (b->max_depth > 0) ca_camera_walks_trace(walks, size);
        for (uint32_t i = 0; i < size; i++) take_light(walks[i], &paths[i].sample->radiance);
        paths += size;
        count -= size;
    }
}
