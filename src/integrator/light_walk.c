/* Light paths: emission, and the stages that a batch of them goes through. Their vertices serve connections, merges
 * and splats. */
#include "integrator/bidirectional.h"

#include "base/stop.h"

#include <float.h>

/* ---- Start ----------------------------------------------------------------------------------------------------- */

bool ca_light_start_path(const ca_bidirectional *b, const ca_stream *stream, ca_light_start *start)
{
    const ca_scene *scene = b->input.scene;
    const ca_vec2 u_direction = ca_sample_2d(stream, CA_DIM_LIGHT_DIRECTION);
    start->light = ca_emission_choose(b->guide, &scene->light_choice, ca_sample_1d(stream, CA_DIM_LIGHT_CHOICE),
                                      &start->choice);
    return start->light != CA_NONE &&
           ca_emission_sample(b->guide, scene->lights, start->light, ca_sample_2d(stream, CA_DIM_LIGHT_POSITION),
                              u_direction, &start->emission) &&
           (!b->paper || ca_paper_emission(u_direction, &start->emission));
}

static bool emit(const ca_bidirectional *b, ca_light_walk *walk)
{
    ca_walk *w = &walk->walk;
    ca_light_start start;
    if (!ca_light_start_path(b, &w->stream, &start)) return false;
    const ca_light_emission e = start.emission;
    const float choice = start.choice;
    const uint32_t index = start.light;
    walk->light = &b->input.scene->lights[index];
    const float pdf = choice * e.pdf_position.v * e.pdf_direction.v;
    w->throughput = ca_rgb_scale(e.radiance, e.cos_light / pdf);
    const float flux = ca_rgb_max(w->throughput);
    if (!(flux > 0.0f) || !ca_rgb_is_finite(w->throughput)) return false;
    w->start = ca_max(flux, FLT_MIN); /* the roulette looks at what is left, not at watts; it takes the reciprocal */
    w->flight = ca_light_end(walk->light, choice, e.pdf_position, e.pdf_direction, e.cos_light, &b->rules.reuse,
                             &w->densities[0]);
    w->densities[0].light_class = ca_factor_light(index);
    walk->vertices[0].point = (ca_surface_point){.position = e.origin, .ng = e.ng, .shape = index};
    w->origin = ca_offset_origin(e.origin, e.origin_error, e.ng, e.direction);
    w->direction = e.direction;
    w->t_min = 0.0f;
    w->t_max = INFINITY;
    return true;
}

static bool start(const ca_bidirectional *b, ca_light_walk *walk, uint32_t slot, uint32_t path, uint64_t number,
                  ca_worker *worker)
{
    const ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    walk->path = path;
    walk->first_splat = walk->last_splat = CA_NONE;
    walk->vertices = scratch->vertices + (size_t)slot * scratch->row;
    walk->walk.densities = scratch->densities + (size_t)slot * scratch->row;
    walk->walk.from = CA_FROM_LIGHT;
    walk->walk.uniform = b->paper;
    walk->walk.vertex = 0;
    walk->walk.eta2 = 1.0f;
    walk->walk.tail = 0.0;
    walk->walk.stream = ca_stream_start(b->input.sampler, CA_SEQUENCE_LIGHT, number);
    worker->counters.light_paths++;
    return b->max_depth > 1 && emit(b, walk);
}

/* ---- Stages ---------------------------------------------------------------------------------------------------- */

typedef struct walk_list {
    ca_light_walk *walks[CA_WALKS];
    uint32_t count;
} walk_list;

static void intersect(const ca_bidirectional *b, const walk_list *list, ca_worker *worker)
{
    ca_walk_rays *rays = b->scratch[worker->index].rays;
    for (uint32_t i = 0; i < list->count; i++) {
        const ca_walk *w = &list->walks[i]->walk;
        ca_walk_rays_set(rays, i, w->origin, w->direction, w->t_min, w->t_max);
    }
    worker->counters.rays += list->count;
    ca_accel_intersect_batch(b->input.scene->accel, &rays->rays, list->count, &rays->hits);
}

/* How next event from v[1] would choose the light and v[0]. */
static float next_event_ratio_of_start(const ca_bidirectional *b, const ca_light_walk *walk)
{
    const ca_walk *w = &walk->walk;
    const ca_surface_point *point = &walk->vertices[0].point;
    const ca_light_receiver receiver = ca_vertex_receiver(&w->last);
    return ca_light_next_event_ratio(walk->light, w->last.position, point->position, point->ng) *
           ca_emission_ratio(b->guide, &b->input.scene->light_choice, &receiver, point->shape);
}

/* An event tells nothing of its own vertex' sums, so they are known on arrival. */
static void store_vertex(const ca_bidirectional *b, ca_light_walk *walk, ca_light_block *block, ca_worker *worker)
{
    const ca_walk *w = &walk->walk;
    const bool capable = ca_vertex_is_smooth(&w->last);
    const ca_matte_shape *shape = &b->input.scene->mattes[w->last.shape];
    walk->vertices[w->vertex] = (ca_light_vertex){.wi = w->last.wi,
                                                  .throughput = w->throughput,
                                                  .capable = capable,
                                                  .matte = shape->is_matte,
                                                  .passes = shape->passes,
                                                  .point = ca_vertex_point(&w->last)};
    if (!capable || !ca_bidirectional_merges(b)) return;
    if (b->rules.photon_sums)
        walk->vertices[w->vertex].sums = ca_mis_photon_sums(&b->rules, w->densities, w->vertex, w->tail);
    block->photons++;
    worker->counters.photons++;
}

/* From a hit to a vertex that is kept; false where the path ends. */
static bool arrive(const ca_bidirectional *b, ca_light_walk *walk, const ca_hit *hit, ca_light_block *block,
                   ca_worker *worker)
{
    const ca_scene *scene = b->input.scene;
    ca_walk *w = &walk->walk;
    if (hit->shape == CA_NONE || !ca_walk_arrive(w, scene, hit)) return false;
    w->tail = ca_mis_light_tail(&b->rules, w->densities, w->vertex, w->tail);
    ca_vertex_prepare(&w->last, scene);
    if (w->vertex == 1 && !b->paper) w->densities[0].next_event_ratio = next_event_ratio_of_start(b, walk);
    store_vertex(b, walk, block, worker);
    return true;
}

static void arrive_all(const ca_bidirectional *b, walk_list *list, ca_light_block *block, ca_worker *worker)
{
    const ca_hit_batch *hits = &b->scratch[worker->index].rays->hits;
    ca_walk *walks[CA_WALKS];
    uint32_t kept = 0;
    for (uint32_t i = 0; i < list->count; i++) {
        const ca_hit hit = ca_hit_batch_at(hits, i);
        if (!arrive(b, list->walks[i], &hit, block, worker)) continue;
        walks[kept] = &list->walks[i]->walk;
        list->walks[kept++] = list->walks[i];
    }
    list->count = kept;
    ca_bidirectional_densities(b, walks, kept);
}

static void scatter_all(const ca_bidirectional *b, walk_list *list)
{
    ca_walk *walks[CA_WALKS];
    bool goes_on[CA_WALKS];
    uint32_t kept = 0;
    for (uint32_t i = 0; i < list->count; i++) walks[i] = &list->walks[i]->walk;
    ca_walks_scatter(walks, list->count, &b->rules.reuse, b->rr_depth, goes_on);
    for (uint32_t i = 0; i < list->count; i++)
        if (goes_on[i] && walks[i]->vertex + 1 < CA_PATH_MAX_VERTICES && walks[i]->vertex + 1 < b->max_depth)
            list->walks[kept++] = list->walks[i];
    list->count = kept;
}

/* false when out of memory. */
static bool trace(const ca_bidirectional *b, walk_list *list, ca_light_block *block, ca_worker *worker)
{
    while (list->count > 0 && !ca_stop_asked(b->input.stop)) {
        intersect(b, list, worker);
        arrive_all(b, list, block, worker);
        if (b->rules.splat && !ca_splat_all(b, list->walks, list->count, worker)) return false;
        scatter_all(b, list);
    }
    return true;
}

/* ---- What is kept ---------------------------------------------------------------------------------------------- */

/* A path into the store; false when out of memory. */
static bool keep_path(const ca_light_walk *walk, ca_light_store *store, ca_light_block *block, uint32_t worker)
{
    const ca_walk *w = &walk->walk;
    size_t bytes;
    if (!ca_light_store_add(store, worker, walk->path, w->densities, walk->vertices, w->vertex + 1, &bytes))
        return false;
    block->bytes += bytes;
    return true;
}

/* The batch's splats, walk by walk, each walk's in the order in which they were made; false when out of memory. */
static bool keep_splats(const ca_bidirectional *b, ca_bidirectional_scratch *scratch, uint32_t walks,
                        ca_light_block *block)
{
    for (uint32_t walk = 0; walk < walks; walk++)
        for (uint32_t i = scratch->light_walks[walk].first_splat; i != CA_NONE; i = scratch->splat_next[i])
            if (!ca_splat_list_add(&block->splats, &scratch->splats.items[i]) ||
                (b->other_count > 0 && !ca_pairs_keep_scales(b, scratch, i, block)))
                return false;
    scratch->splats.count = 0;
    return true;
}

void ca_light_walks(const ca_bidirectional *b, ca_light_store *store, uint32_t first, uint32_t count, uint64_t number,
                    ca_light_block *block, ca_worker *worker)
{
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    for (uint32_t begin = 0; begin < count; begin += CA_WALKS) {
        const uint32_t size = ca_min_u32(CA_WALKS, count - begin);
        walk_list list = {.count = 0};
        for (uint32_t i = 0; i < size; i++) {
            ca_light_walk *walk = &scratch->light_walks[i];
            if (start(b, walk, i, first + begin + i, number + begin + i, worker)) list.walks[list.count++] = walk;
        }
        bool fits = trace(b, &list, block, worker) && keep_splats(b, scratch, size, block);
        for (uint32_t i = 0; i < size && fits && ca_bidirectional_keeps(b); i++)
            fits = keep_path(&scratch->light_walks[i], store, block, worker->index);
        if (!fits) {
            scratch->splats.count = 0;
            ca_light_store_fail(store);
            return;
        }
    }
}
