#include "integrator/radius_pilot.h"

#include "base/memory.h"
#include "base/stop.h"
#include "path/merge_surface.h"

#include <string.h>

/* Photons that a query looks at, and weights, at most: a weight takes the more time. */
enum { MOST_MERGES = 320, MOST_WEIGHED = 8 };

/* A camera path of each pixel: the index-th, with photons of a set. */
typedef struct pilot_round {
    uint32_t set, index;
    const ca_walk_hooks *hooks;
    bool lighting; /* what the paths bring is a pixel's light */
} pilot_round;

/* A batch on its way. */
typedef struct pilot_batch {
    ca_radius_probe *pilot;
    uint32_t set, first; /* cell of the first path */
    const ca_camera_path *paths;
    float shown[CA_WALKS]; /* light up to the first query, with what was asked there; negative: there was none */
} pilot_batch;

static uint32_t cell_of(const ca_camera_walk *walk)
{
    const pilot_batch *batch = walk->user;
    return batch->first + (uint32_t)(walk->path - batch->paths);
}

static bool is_first_query(const ca_camera_walk *walk)
{
    return walk->walk.densities[walk->walk.vertex - 1].connectable_count == 0;
}

static void note_queries(ca_camera_walk *const *walks, uint32_t count)
{
    ca_radius_probe *p = ((const pilot_batch *)walks[0]->user)->pilot;
    for (uint32_t i = 0; i < count; i++)
        if (ca_vertex_is_smooth(&walks[i]->walk.last) && is_first_query(walks[i]) &&
            p->query_count < p->columns * p->rows)
            p->queries[p->query_count++] = walks[i]->walk.last.position;
}

static uint32_t find(ca_radius_probe *p, const ca_photon_level *level, ca_vec3 position)
{
    uint32_t count = 0, batch;
    ca_photon_query query;
    uint32_t next[CA_PHOTON_BATCH];
    ca_photon_query_start(&query, level->grid, position);
    while ((batch = ca_photon_query_next(&query, next)) > 0) {
        uint32_t *found = ca_array_grow(p->found, &p->found_capacity, count + batch, sizeof *found);
        if (!found) {
            p->out_of_memory = true;
            return 0;
        }
        p->found = found;
        memcpy(found + count, next, batch * sizeof *next);
        count += batch;
    }
    return count;
}

/* What a merge with the photon brings, without the disk's area; 0: nothing. */
static float photon_light(const ca_camera_walk *walk, const ca_light_record *photon, ca_bsdf_value *value)
{
    const ca_merge_surface surface = ca_merge_surface_of(walk->b->input.scene, &walk->walk.last);
    if (walk->walk.vertex + photon->index > walk->b->max_depth || !ca_merge_is_on_surface(&surface, photon))
        return 0.0f;
    *value = ca_vertex_eval(&walk->walk.last, photon->wi, CA_FROM_CAMERA);
    const float light = ca_luminance(ca_rgb_mul(ca_rgb_mul(walk->walk.throughput, value->f), photon->throughput));
    return light > 0.0f && light < INFINITY ? light : 0.0f;
}

/* What photons straight from lights bring to a camera path's first query. */
typedef struct direct_photons {
    float light, squares; /* sums, unweighted */
} direct_photons;

/* What the photons of a query change: what they bring, less four times that of those within half the radius, whose
 * disk has a quarter of the area. */
typedef struct query_change {
    double all;              /* of all that are looked at, unweighted */
    double some, some_light; /* of those that are weighted; and what these bring */
    double weighted, weighted_light; /* times their weights */
} query_change;

/* With the mean weight for all, and what weights differ by from it for those whose weights are known, each of which
 * stands for `stride` of them: where weights are alike, there is no noise but that of all photons. */
static double change_of(const query_change *query, double stride)
{
    if (!(query->some_light > 0.0)) return 0.0;
    const double mean = query->weighted_light / query->some_light;
    return mean * query->all + stride * (query->weighted - mean * query->some);
}

/* One photon that brings `light`, as a density per light path; it stands for `scale` of them. */
static void add_weighted(const ca_camera_walk *walk, const ca_light_record *photon, float scale, float light,
                         float weight, ca_path_sums *sums, uint32_t k, direct_photons *direct)
{
    const bool straight = walk->b->rules.next_event && photon->index == 1 && is_first_query(walk);
    sums->square[k] += scale * ca_sqr(light) * weight * (straight ? weight : 1.0f);
    if (!straight) return;
    sums->direct[k] += scale * light;
    sums->weighted[k] += scale * light * weight;
    direct->light += light;
    direct->squares += ca_sqr(light);
}

/* Of `looked` photons of `count`, from so many light paths. */
static void add_pairs(const direct_photons *direct, uint32_t looked, uint32_t count, uint32_t paths,
                      ca_path_sums *sums)
{
    if (looked == 0) return;
    const float single = (float)count / ((float)looked * (float)paths);
    sums->alone += single * direct->light;
    if (looked == 1) return;
    const float pair = single * (float)(count - 1) / ((float)(looked - 1) * (float)paths);
    sums->pairs += pair * (ca_sqr(direct->light) - direct->squares);
}

static uint32_t stride_for(uint32_t count, uint32_t most) { return count / most + 1; }

/* Looks at every `fine`-th photon, and weights every `coarse`-th of these. */
static void gather(ca_radius_probe *p, uint32_t k, const ca_camera_walk *walk, ca_path_sums *sums)
{
    const ca_photon_level *level = &p->levels[k];
    const ca_bidirectional *b = p->engine;
    const uint32_t count = find(p, level, walk->walk.last.position), fine = stride_for(count, MOST_MERGES);
    const uint32_t first = walk->path->index % fine, looked = (count - first + fine - 1) / fine;
    const uint32_t coarse = b->weighs_merges ? stride_for(looked, MOST_WEIGHED) : 1;
    const float density = 1.0f / b->rules.merge_area, scale = (float)(fine * coarse) / (float)level->paths;
    direct_photons direct = {0};
    query_change change = {0};
    for (uint32_t i = 0; i < looked; i++) {
        const ca_light_record *photon = ca_light_record_at(&b->store, p->found[first + (size_t)i * fine]);
        ca_bsdf_value value;
        const float light = density * photon_light(walk, photon, &value);
        if (!(light > 0.0f)) continue;
        const ca_vec3 offset = ca_sub(photon->position, walk->walk.last.position);
        const float changed = light * (4.0f * ca_length2(offset) <= ca_sqr(b->radius) ? -3.0f : 1.0f);
        change.all += (double)changed;
        if (i % coarse != 0) continue;
        const float weight = ca_merge_weight(walk, &b->store, photon, &value);
        change.some += (double)changed, change.some_light += (double)light;
        change.weighted += (double)(weight * changed), change.weighted_light += (double)(weight * light);
        add_weighted(walk, photon, scale, light, weight, sums, k, &direct);
    }
    sums->change[k] += (float)(change_of(&change, coarse) * fine / level->paths);
    if (k == CA_PILOT_PAIRS) add_pairs(&direct, (looked + coarse - 1) / coarse, count, level->paths, sums);
    if (k != CA_PILOT_BELOW) return;
    p->merged += count;
    p->merging_queries++;
}

static void gather_all(ca_camera_walk *const *walks, uint32_t count)
{
    const pilot_batch *batch = walks[0]->user;
    ca_radius_probe *p = batch->pilot;
    for (uint32_t k = 0; k < p->level_count; k++) {
        ca_bidirectional_set_radius(p->engine, p->levels[k].radius);
        for (uint32_t i = 0; i < count; i++)
            if (ca_vertex_is_smooth(&walks[i]->walk.last))
                gather(p, k, walks[i], &p->sums[batch->set][cell_of(walks[i])]);
    }
}

static void gather_lens(ca_radius_probe *p, uint32_t k, const ca_camera_walk *walk, ca_light_sums *sums)
{
    const ca_photon_level *level = &p->lens[k];
    const uint32_t count = find(p, level, walk->walk.last.position);
    const float scale = 1.0f / (CA_PI * ca_sqr(level->radius) * (float)level->paths);
    for (uint32_t i = 0; i < count; i++) {
        const ca_light_record *photon = ca_light_record_at(&p->engine->store, p->found[i]);
        ca_bsdf_value value;
        const float light = scale * photon_light(walk, photon, &value);
        if (!(light > 0.0f)) continue;
        sums->lens[k] += light;
        sums->found[k]++;
    }
}

/* Next event, and what it finds at first queries. */
static void ask_all(pilot_batch *batch, ca_camera_walk *const *walks, uint32_t count)
{
    float before[CA_WALKS];
    for (uint32_t i = 0; i < count; i++) before[i] = ca_luminance(walks[i]->light[0]);
    ca_next_events(walks, count, false);
    for (uint32_t i = 0; i < count; i++) {
        if (!is_first_query(walks[i])) continue;
        const uint32_t cell = cell_of(walks[i]);
        ca_light_sums *sums = &batch->pilot->lights[cell];
        const float shown = batch->shown[cell - batch->first] = ca_luminance(walks[i]->light[0]);
        const double found = (double)shown - (double)before[i];
        sums->direct += found;
        sums->direct_squares += found * found;
    }
}

static void light_all(ca_camera_walk *const *walks, uint32_t count)
{
    pilot_batch *batch = walks[0]->user;
    ca_radius_probe *p = batch->pilot;
    ask_all(batch, walks, count);
    for (uint32_t k = 0; k < CA_LENS_LEVELS && p->lens[k].count > 0; k++)
        for (uint32_t i = 0; i < count; i++)
            if (ca_vertex_is_smooth(&walks[i]->walk.last))
                gather_lens(p, k, walks[i], &p->lights[cell_of(walks[i])]);
}

/* Pixels lie in the middles of the lattice's cells. */
static void place(const ca_radius_probe *p, uint32_t cell, uint32_t index, ca_camera_path *path)
{
    const ca_camera *camera = p->engine->input.camera;
    path->x = ca_middle_of_part(cell % p->columns, p->columns, camera->width);
    path->y = ca_middle_of_part(cell / p->columns, p->rows, camera->height);
    path->index = index;
}

/* What a path brought to its pixel's light. */
static void add_light(const pilot_batch *batch, uint32_t i, const ca_camera_walk *walk)
{
    ca_light_sums *sums = &batch->pilot->lights[batch->first + i];
    const float all = ca_luminance(walk->light[0]);
    const double shown = (double)(batch->shown[i] >= 0.0f ? batch->shown[i] : all);
    sums->asked += (double)all;
    sums->shown += shown;
    sums->shown_squares += shown * shown;
}

static void trace_batch(ca_radius_probe *p, uint32_t first, uint32_t count, const pilot_round *round)
{
    ca_camera_path paths[CA_WALKS];
    ca_film_sample samples[CA_WALKS];
    ca_camera_walk *walks[CA_WALKS] = {NULL};
    pilot_batch batch = {.pilot = p, .set = round->set, .first = first, .paths = paths};
    for (uint32_t i = 0; i < count; i++) {
        samples[i] = (ca_film_sample){0};
        batch.shown[i] = -1.0f;
        paths[i] = (ca_camera_path){.sample = &samples[i]};
        place(p, first + i, round->index, &paths[i]);
        walks[i] = &p->engine->scratch[0].camera_walks[i];
        ca_camera_walk_start(walks[i], p->engine, &paths[i], i, &p->worker);
        walks[i]->hooks = round->hooks;
        walks[i]->user = &batch;
    }
    ca_camera_walks_trace(walks, count);
    for (uint32_t i = 0; i < count && round->lighting; i++) add_light(&batch, i, walks[i]);
}

static void trace_camera_paths(ca_radius_probe *p, pilot_round round)
{
    const uint32_t cells = p->columns * p->rows;
    if (p->engine->max_depth == 0) return;
    for (uint32_t first = 0; first < cells && !ca_stop_asked(p->engine->input.stop); first += CA_WALKS)
        trace_batch(p, first, ca_min_u32(CA_WALKS, cells - first), &round);
}

void ca_radius_note_queries(ca_radius_probe *p)
{
    static const ca_walk_hooks hooks = {.at_vertices = note_queries};
    trace_camera_paths(p, (pilot_round){.hooks = &hooks});
}

/* A set's camera paths have numbers of their own; those that noted queries had the first. */
void ca_radius_merge_set(ca_radius_probe *p, uint32_t set)
{
    static const ca_walk_hooks hooks = {.at_vertices = gather_all};
    const uint32_t first = set * p->merging;
    for (uint32_t i = 0; i < p->merging; i++)
        trace_camera_paths(p, (pilot_round){.set = set, .index = first + i, .hooks = &hooks});
}

/* Lights count where nothing but next event could have found them: seen by the camera, through mirrors and lenses at
 * most. Whatever the method does, paths go on. */
void ca_radius_light_pixels(ca_radius_probe *p)
{
    static const ca_walk_hooks hooks = {.at_vertices = light_all, .shows_light = is_first_query};
    const uint32_t first = 2 * p->merging, limit = p->engine->rules.merge_limit;
    p->engine->rules.merge_limit = UINT32_MAX;
    for (uint32_t i = 0; i < p->lighting; i++)
        trace_camera_paths(p, (pilot_round){.index = first + i, .hooks = &hooks, .lighting = true});
    p->engine->rules.merge_limit = limit;
}
