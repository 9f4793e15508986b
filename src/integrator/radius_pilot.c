/* The default merge radius: a pilot measures how variance and blur of merges depend on the radius, and
 * photon/radius_choice.h makes of it the radius of least error.
 *
 * Two sets of light paths, and for either camera paths of each of many pixels all over the film, which look for
 * photons of their set by radii that double from level to level. What a radius changes against half of it, as the one
 * set sees it, times what the other sees, is on average the square of what it changes in the pixel, without noise;
 * blur within a pixel is not seen and does not count.
 * Photons count by the weights that they would have in the render with that radius, those within half of it, too:
 * weights alone change nothing. The sum of weights times the squares of what photons bring tells the second moment:
 * of merges, and by the balance heuristic also of all that takes their place where their weights are small.
 *
 * Next event at a camera path's first query may be nearly without noise, where a second moment is no variance. So
 * for light that comes straight to that query merges have the noise of their photons, and next event has the variance
 * that it was seen to have among the camera paths of a pixel, for the part of the light that merges leave it. What
 * camera paths differ by in the light that they meet (pairs of photons tell it, without photons' noise) stays of it
 * whatever merges take, and so does the noise of lights that are seen themselves.
 *
 * Both are told in parts of the pixel's own light, and most of the error lies in dark pixels beside bright ones. So
 * a pixel's light must not be blurred itself: other camera paths find it by next event, and photons stand only for
 * what came through mirrors and lenses alone, which next event cannot find.
 *
 * Levels lie around the distance of the NEAREST-th photon at the median query that finds light. Photons of the larger
 * ones are thinned, so that all levels cost about the same. The error is relative as that of metrics/compare.h is.
 *
 * Two methods stand for all: `bdpm` for those with photons alone, `ovcm` for `vcm` and its kin, which so have one
 * radius for one scene. All is a function of scene, settings and seed over the whole film, never of the crop, of
 * threads or of rounds: one thread traces, with random numbers of its own. The image's mean stays what it is. */
#include "integrator/bidirectional.h"

#include "base/memory.h"
#include "base/stop.h"
#include "photon/radius_choice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    SIDE = 52,              /* of the lattice of pixels */
    BLOCK = 4,              /* of its cells, whose camera paths may find the same photons */
    MERGING = 3 * SIDE * SIDE,     /* camera paths for either set; where merges have weights, which cost: */
    MERGING_WEIGHED = SIDE * SIDE,
    LIGHTING = 4 * SIDE * SIDE,    /* likewise, that tell the light of pixels */
    FEW_LIGHT_PATHS = 1024, /* tell how many make so many photons as are wanted, in each set: */
    PHOTONS = 49152,
    MOST_LIGHT_PATHS = 1 << 17,
    MAX_DEPTH = 64,
    LATEST_ROULETTE = 16,
    NEAREST = 12,   /* photons within the middle level's radius */
    BELOW = 2,      /* levels below that */
    PAIRS = BELOW,  /* level at which pairs of photons are looked for */
    FULL = 4,       /* levels up to this one have all photons */
    LENS_LEVELS = BELOW + 1, /* at which photons are looked for that tell a pixel's light */
    MOST_MERGES = 64, /* of a query */
    MOST_WEIGHED = 24, /* where each has a weight to be computed */
};

/* Set apart from the render's. */
#define PILOT_SEED UINT64_C(0x726164697573)

/* The error is that of metrics/compare.h: relative to the square of light, plus this. */
#define LEAST_SQUARE 0.01

/* The radius lies between this part of a pixel's footprint and that of the scene. */
#define LEAST_OF_PIXEL 0.25f
#define MOST_OF_SCENE 0.1f

/* Photons of a pass that the median lit query merges with at most. With more of them merging takes most of the
 * time, and a time is better spent on more passes with a smaller radius: as many photons are merged, and less is
 * blurred. */
#define MOST_PHOTONS 48.0

/* What the camera paths of a pixel find, by levels, as densities per light path. */
typedef struct path_sums {
    float change[CA_RADIUS_LEVELS]; /* weighted light, minus what half the radius makes of the same weights */
    float square[CA_RADIUS_LEVELS]; /* weights times squares of light; of direct light the weights' squares */
    float direct[CA_RADIUS_LEVELS], weighted[CA_RADIUS_LEVELS]; /* light that next event finds at first queries, */
                                                                 /* and what merges have of it */
    float pairs;                    /* of photons of such light at level PAIRS: products of what either brings */
    float alone;                    /* what these bring */
} path_sums;

/* What other camera paths tell of a pixel's light. */
typedef struct light_sums {
    float asked;             /* lights that they see or ask */
    /* Sums, and of squares: what they find by asking at their first query, and that with lights that they see. */
    double direct, direct_squares, shown, shown_squares;
    float lens[LENS_LEVELS]; /* photons of light that met Dirac events only, as densities */
    uint32_t found[LENS_LEVELS]; /* how many */
} light_sums;

typedef struct photon_level {
    ca_photon_grid *grid; /* owned */
    ca_photon *photons;   /* owned */
    uint32_t count, paths; /* paths: whose photons these are */
    float radius;
} photon_level;

typedef struct radius_pilot {
    ca_bidirectional *engine; /* owned */
    ca_worker worker;
    uint32_t light_paths; /* of a set */
    uint32_t columns, rows;
    photon_level levels[CA_RADIUS_LEVELS];
    photon_level lens[LENS_LEVELS]; /* photons of light that met Dirac events only */
    uint32_t level_count;
    float scale; /* distance of the NEAREST-th photon at the median lit query; 0: there is no light */
    bool merging_alone;  /* finds light */
    uint32_t merging, lighting; /* camera paths of a pixel for a set, that merge and that tell the pixel's light */
    path_sums *sums[2];  /* owned; of pixels, for either set */
    light_sums *lights;  /* owned; of pixels */
    ca_vec3 *queries;    /* owned; where first paths look for photons first */
    uint32_t query_count;
    uint32_t *found;     /* owned; photons of a query */
    size_t found_capacity;
    bool out_of_memory;
} radius_pilot;

static ca_parallel alone(const ca_bidirectional *b) { return (ca_parallel){.workers = 1, .stop = b->input.stop}; }

/* ---- Camera paths ---------------------------------------------------------------------------------------------- */

/* A camera path of each pixel: the index-th, with photons of a set. */
typedef struct pilot_round {
    uint32_t set, index;
    const ca_walk_hooks *hooks;
    bool lighting; /* what the paths bring is a pixel's light */
} pilot_round;

/* A batch on its way. */
typedef struct pilot_batch {
    radius_pilot *pilot;
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
    radius_pilot *p = ((const pilot_batch *)walks[0]->user)->pilot;
    for (uint32_t i = 0; i < count; i++)
        if (ca_vertex_is_smooth(&walks[i]->walk.last) && is_first_query(walks[i]) &&
            p->query_count < p->columns * p->rows)
            p->queries[p->query_count++] = walks[i]->walk.last.position;
}

static uint32_t find(radius_pilot *p, const photon_level *level, ca_vec3 position)
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
    if (walk->walk.vertex + photon->index > walk->b->max_depth ||
        ca_dot(photon->ng, walk->walk.last.ng) < CA_MERGE_MIN_COS)
        return 0.0f;
    *value = ca_vertex_eval(&walk->walk.last, photon->wi, CA_FROM_CAMERA);
    const float light = ca_luminance(ca_rgb_mul(ca_rgb_mul(walk->walk.throughput, value->f), photon->throughput));
    return light > 0.0f && light < INFINITY ? light : 0.0f;
}

/* What photons straight from lights bring to a camera path's first query. */
typedef struct direct_photons {
    float light, squares; /* sums, unweighted */
} direct_photons;

/* One photon; it stands for `scale` of them, as a density per light path. */
static void add_photon(const ca_camera_walk *walk, const ca_light_record *photon, float scale, float density,
                       path_sums *sums, uint32_t k, direct_photons *direct)
{
    const ca_bidirectional *b = walk->b;
    ca_bsdf_value value;
    const float light = density * photon_light(walk, photon, &value);
    if (!(light > 0.0f)) return;
    const float weight = ca_merge_weight(walk, &b->store, photon, &value);
    const ca_vec3 offset = ca_sub(photon->position, walk->walk.last.position);
    const bool inner = 4.0f * ca_length2(offset) <= ca_sqr(b->radius);
    const bool straight = b->rules.next_event && photon->index == 1 && is_first_query(walk);
    sums->change[k] += scale * light * weight * (inner ? -3.0f : 1.0f); /* 1 - 4, as the area is a quarter */
    sums->square[k] += scale * ca_sqr(light) * weight * (straight ? weight : 1.0f);
    if (!straight) return;
    sums->direct[k] += scale * light;
    sums->weighted[k] += scale * light * weight;
    direct->light += light;
    direct->squares += ca_sqr(light);
}

/* Of `looked` photons of `count`, from so many light paths. */
static void add_pairs(const direct_photons *direct, uint32_t looked, uint32_t count, uint32_t paths, path_sums *sums)
{
    if (looked == 0) return;
    const float single = (float)count / ((float)looked * (float)paths);
    sums->alone += single * direct->light;
    if (looked == 1) return;
    const float pair = single * (float)(count - 1) / ((float)(looked - 1) * (float)paths);
    sums->pairs += pair * (ca_sqr(direct->light) - direct->squares);
}

static void gather(radius_pilot *p, uint32_t k, const ca_camera_walk *walk, path_sums *sums)
{
    const photon_level *level = &p->levels[k];
    const uint32_t count = find(p, level, walk->walk.last.position);
    const uint32_t stride = count / (p->engine->weighs_merges ? MOST_WEIGHED : MOST_MERGES) + 1;
    const float density = 1.0f / p->engine->rules.merge_area;
    const float scale = (float)stride / (float)level->paths;
    direct_photons direct = {0};
    for (uint32_t i = 0; i < count; i += stride)
        add_photon(walk, ca_light_record_at(&p->engine->store, p->found[i]), scale, density, sums, k, &direct);
    if (k == PAIRS) add_pairs(&direct, (count + stride - 1) / stride, count, level->paths, sums);
}

static void gather_all(ca_camera_walk *const *walks, uint32_t count)
{
    const pilot_batch *batch = walks[0]->user;
    radius_pilot *p = batch->pilot;
    for (uint32_t k = 0; k < p->level_count; k++) {
        ca_bidirectional_set_radius(p->engine, p->levels[k].radius);
        for (uint32_t i = 0; i < count; i++)
            if (ca_vertex_is_smooth(&walks[i]->walk.last))
                gather(p, k, walks[i], &p->sums[batch->set][cell_of(walks[i])]);
    }
}

static void gather_lens(radius_pilot *p, uint32_t k, const ca_camera_walk *walk, light_sums *sums)
{
    const photon_level *level = &p->lens[k];
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
        light_sums *sums = &batch->pilot->lights[cell];
        const float shown = batch->shown[cell - batch->first] = ca_luminance(walks[i]->light[0]);
        const double found = (double)shown - (double)before[i];
        sums->direct += found;
        sums->direct_squares += found * found;
    }
}

static void light_all(ca_camera_walk *const *walks, uint32_t count)
{
    pilot_batch *batch = walks[0]->user;
    radius_pilot *p = batch->pilot;
    ask_all(batch, walks, count);
    for (uint32_t k = 0; k < LENS_LEVELS && p->lens[k].count > 0; k++)
        for (uint32_t i = 0; i < count; i++)
            if (ca_vertex_is_smooth(&walks[i]->walk.last))
                gather_lens(p, k, walks[i], &p->lights[cell_of(walks[i])]);
}

/* Pixels lie in the middles of the lattice's cells. */
static void place(const radius_pilot *p, uint32_t cell, uint32_t index, ca_camera_path *path)
{
    const ca_camera *camera = p->engine->input.camera;
    path->x = ca_middle_of_part(cell % p->columns, p->columns, camera->width);
    path->y = ca_middle_of_part(cell / p->columns, p->rows, camera->height);
    path->index = index;
}

/* What a path brought to its pixel's light. */
static void add_light(const pilot_batch *batch, uint32_t i, const ca_camera_walk *walk)
{
    light_sums *sums = &batch->pilot->lights[batch->first + i];
    const float all = ca_luminance(walk->light[0]);
    const double shown = (double)(batch->shown[i] >= 0.0f ? batch->shown[i] : all);
    sums->asked += all;
    sums->shown += shown;
    sums->shown_squares += shown * shown;
}

static void trace_batch(radius_pilot *p, uint32_t first, uint32_t count, const pilot_round *round)
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

static void trace_camera_paths(radius_pilot *p, pilot_round round)
{
    const uint32_t cells = p->columns * p->rows;
    if (p->engine->max_depth == 0) return;
    for (uint32_t first = 0; first < cells && !ca_stop_asked(p->engine->input.stop); first += CA_WALKS)
        trace_batch(p, first, ca_min_u32(CA_WALKS, cells - first), &round);
}

/* A set's camera paths have numbers of their own; those that noted queries had the first. */
static void merge_set(radius_pilot *p, uint32_t set)
{
    static const ca_walk_hooks hooks = {.at_vertices = gather_all};
    const uint32_t first = set * (p->merging + p->lighting);
    for (uint32_t i = 0; i < p->merging; i++)
        trace_camera_paths(p, (pilot_round){.set = set, .index = first + i, .hooks = &hooks});
}

/* Lights count where nothing but next event could have found them: seen by the camera, through mirrors and lenses at
 * most. Whatever the method does, paths go on. */
static void light_set(radius_pilot *p, uint32_t set)
{
    static const ca_walk_hooks hooks = {.at_vertices = light_all, .shows_light = is_first_query};
    const uint32_t first = set * (p->merging + p->lighting) + p->merging, limit = p->engine->rules.merge_limit;
    p->engine->rules.merge_limit = UINT32_MAX;
    for (uint32_t i = 0; i < p->lighting; i++)
        trace_camera_paths(p, (pilot_round){.set = set, .index = first + i, .hooks = &hooks, .lighting = true});
    p->engine->rules.merge_limit = limit;
}

/* ---- Photons --------------------------------------------------------------------------------------------------- */

static uint32_t read_photons(const void *user, uint32_t run, uint64_t *at, ca_photon *photons)
{
    const photon_level *level = user;
    (void)run;
    const uint32_t count = ca_min_u32(CA_PHOTON_BATCH, level->count - (uint32_t)*at);
    memcpy(photons, level->photons + *at, count * sizeof *photons);
    *at += count;
    return count;
}

static void collect(const ca_bidirectional *b, uint32_t path, uint32_t rank, photon_level *level)
{
    const uint32_t number = ca_light_record_number(&b->store, &b->store.paths[path], rank);
    level->photons[level->count++] =
        (ca_photon){.position = ca_light_record_at(&b->store, number)->position, .vertex = number};
}

/* The photons of every step-th light path. */
static void collect_all(const ca_bidirectional *b, uint32_t step, photon_level *level)
{
    level->paths = (b->paths_now + step - 1) / step;
    for (uint32_t path = 0; path < b->paths_now; path += step)
        for (uint32_t rank = 0; rank < b->store.paths[path].records; rank++) collect(b, path, rank, level);
}

/* Those that came through mirrors and lenses alone: the first records of their paths, though not of the first
 * vertices. */
static void collect_lens(const ca_bidirectional *b, photon_level *level)
{
    level->paths = b->paths_now;
    for (uint32_t path = 0; path < b->paths_now; path++) {
        const ca_light_path *own = &b->store.paths[path];
        if (own->records > 0 && ca_light_record_at(&b->store, ca_light_record_number(&b->store, own, 0))->index > 1)
            collect(b, path, 0, level);
    }
}

/* step 0: photons of light that met Dirac events only. */
static ca_status build_level(const ca_bidirectional *b, uint32_t step, photon_level *level, ca_error *error)
{
    ca_free(level->photons);
    level->photons = ca_alloc(ca_max_u32((uint32_t)b->photons_now, 1), sizeof *level->photons);
    if (!level->photons) return ca_fail_memory(error, "the pilot of the merge radius");
    level->count = 0;
    if (step > 0)
        collect_all(b, step, level);
    else
        collect_lens(b, level);
    if (!level->grid) CA_TRY(ca_photon_grid_create(&level->grid, error));
    const ca_photon_bounds bounds = {b->input.scene->low, b->input.scene->high};
    const ca_photon_source source = {
        .user = level, .run_count = 1, .count = level->count, .read = read_photons};
    const ca_parallel parallel = alone(b);
    return ca_photon_grid_build(level->grid, &source, &bounds, level->radius, &parallel, error);
}

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* How many queries have NEAREST photons within the grid's radius; *median: the median of their distances. */
static uint32_t look_around(const radius_pilot *p, float *distances, float *median)
{
    uint32_t lit = 0;
    for (uint32_t i = 0; i < p->query_count; i++) {
        const float distance = ca_photon_grid_nearest(p->engine->grid, p->queries[i], NEAREST);
        if (distance < INFINITY) distances[lit++] = distance;
    }
    if (lit == 0) return 0;
    qsort(distances, lit, sizeof *distances, compare);
    *median = distances[lit / 2];
    return lit;
}

static ca_status find_scale(radius_pilot *p, float most, ca_error *error)
{
    ca_bidirectional *b = p->engine;
    const ca_parallel parallel = alone(b);
    p->scale = 0.0f;
    float *distances = ca_alloc(ca_max_u32(p->query_count, 1), sizeof *distances);
    if (!distances) return ca_fail_memory(error, "the pilot of the merge radius");
    ca_status status = CA_OK;
    for (;;) {
        const uint32_t lit = look_around(p, distances, &p->scale);
        if (2 * lit >= p->query_count || b->radius >= most) break;
        ca_bidirectional_set_radius(b, ca_min(most, 2.0f * b->radius));
        status = ca_light_photons_sort(b, b->grid, b->radius, &parallel, error);
        if (status != CA_OK) break;
    }
    ca_free(distances);
    return status;
}

static ca_status trace_light_paths(radius_pilot *p, uint64_t number, ca_error *error)
{
    const ca_parallel parallel = alone(p->engine);
    ca_mis_rules *rules = &p->engine->rules;
    const bool splat = rules->splat; /* it counts in weights; no picture is made */
    rules->splat = false;
    const ca_status status = ca_light_paths_prepare(p->engine, number, p->light_paths, &parallel, &p->worker, error);
    rules->splat = splat;
    return status;
}

/* Where few of a light's paths arrive anywhere, more are traced. */
static ca_status choose_light_paths(radius_pilot *p, ca_error *error)
{
    p->light_paths = FEW_LIGHT_PATHS;
    CA_TRY(trace_light_paths(p, CA_PILOT_NUMBER, error));
    const double photons = (double)p->engine->photons_now / FEW_LIGHT_PATHS;
    const double wanted = PHOTONS / fmax(photons, 1.0 / FEW_LIGHT_PATHS);
    p->light_paths = (uint32_t)fmin(fmax(wanted, FEW_LIGHT_PATHS), MOST_LIGHT_PATHS);
    return CA_OK;
}

static ca_status build_levels(radius_pilot *p, ca_error *error)
{
    for (uint32_t k = 0; k < p->level_count; k++)
        CA_TRY(build_level(p->engine, k > FULL ? 1u << 2 * (k - FULL) : 1, &p->levels[k], error));
    for (uint32_t k = 0; k < LENS_LEVELS; k++) {
        p->lens[k].radius = p->levels[k].radius;
        if (k < p->level_count) CA_TRY(build_level(p->engine, 0, &p->lens[k], error));
    }
    return CA_OK;
}

/* ---- The curve ------------------------------------------------------------------------------------------------- */

/* Of photons the least of what the levels say, with one photon more than they found: what lies near something bright
 * must not pass for bright. */
static double pixel_light(const radius_pilot *p, uint32_t cell)
{
    const light_sums *sums = &p->lights[cell];
    double least = (double)INFINITY;
    for (uint32_t k = 0; k < LENS_LEVELS; k++)
        if (sums->found[k] > 0) least = fmin(least, (double)sums->lens[k] * (1.0 + 1.0 / sums->found[k]));
    return ((isfinite(least) ? least : 0.0) + (double)sums->asked) / (2.0 * p->lighting);
}

/* Of what a pixel shows, as a camera path that merges nothing finds it: the variance of direct light that merges can
 * take, and that which stays: what camera paths differ by in direct light, and lights that they see. Without bias. */
typedef struct shown_noise {
    double taken, staying;
} shown_noise;

static double variance_of(double sum, double squares, double n) { return (squares - sum * sum / n) / (n - 1.0); }

static shown_noise noise_of(const radius_pilot *p, uint32_t cell)
{
    const path_sums *a = &p->sums[0][cell], *b = &p->sums[1][cell];
    const light_sums *lights = &p->lights[cell];
    const double n = 2.0 * p->lighting, merging = p->merging;
    const double shown = variance_of(lights->shown, lights->shown_squares, n);
    const double direct = variance_of(lights->direct, lights->direct_squares, n);
    const double camera = 0.5 * ((double)a->pairs + (double)b->pairs) / merging -
                          (double)a->alone * (double)b->alone / (merging * merging);
    return (shown_noise){.taken = direct - camera, .staying = shown - direct + camera};
}

/* What of direct light merges leave to others. */
static double left(const path_sums *a, const path_sums *b, uint32_t k)
{
    const double direct = (double)a->direct[k] + (double)b->direct[k];
    return direct > 0.0 ? 1.0 - ((double)a->weighted[k] + (double)b->weighted[k]) / direct : 1.0;
}

/* What a pixel's squares count for: they are of `merging` camera paths. */
static double relative_of(const radius_pilot *p, uint32_t cell)
{
    const double light = pixel_light(p, cell), cells = (double)p->columns * p->rows;
    return 1.0 / ((light * light + LEAST_SQUARE) * cells * p->merging);
}

/* Of all that is shown, but for what photons that are merged with bring; a camera path's counts as of the light paths
 * that it has. */
static double shown_variance(const radius_pilot *p, uint32_t k)
{
    double sum = 0.0;
    for (uint32_t cell = 0; cell < p->columns * p->rows; cell++) {
        const shown_noise noise = noise_of(p, cell);
        const double share = left(&p->sums[0][cell], &p->sums[1][cell], k);
        sum += relative_of(p, cell) * (share * share * noise.taken + noise.staying);
    }
    return fmax(sum, 0.0) * p->merging * (double)p->engine->rules.splat_count;
}

static void add_cell(const radius_pilot *p, uint32_t cell, ca_radius_curve *curve, double *changes)
{
    const path_sums *a = &p->sums[0][cell], *b = &p->sums[1][cell];
    const double relative = relative_of(p, cell);
    for (uint32_t k = 0; k < p->level_count; k++) {
        curve->variance[k] += 0.5 * ((double)a->square[k] + (double)b->square[k]) * relative;
        changes[k] += (double)a->change[k] * (double)b->change[k] * relative / p->merging;
    }
}

/* A photon may be found from many cells, so that the noise of these is common: blocks of them tell the error. */
static void add_block(const radius_pilot *p, uint32_t left, uint32_t top, ca_radius_curve *curve)
{
    double changes[CA_RADIUS_LEVELS] = {0.0};
    for (uint32_t y = top; y < ca_min_u32(top + BLOCK, p->rows); y++)
        for (uint32_t x = left; x < ca_min_u32(left + BLOCK, p->columns); x++)
            add_cell(p, y * p->columns + x, curve, changes);
    for (uint32_t k = 0; k < p->level_count; k++) {
        curve->change[k] += changes[k];
        curve->change_error[k] += changes[k] * changes[k];
    }
}

/* false: there is no light. */
static bool make_curve(const radius_pilot *p, ca_radius_curve *curve)
{
    *curve = (ca_radius_curve){.count = p->level_count, .merging_alone = p->merging_alone};
    for (uint32_t y = 0; y < p->rows; y += BLOCK)
        for (uint32_t x = 0; x < p->columns; x += BLOCK) add_block(p, x, y, curve);
    for (uint32_t k = 0; k < p->level_count; k++) {
        curve->radius[k] = (double)p->levels[k].radius;
        curve->change_error[k] = sqrt(curve->change_error[k]);
        if (p->engine->rules.next_event) curve->variance[k] += shown_variance(p, k);
    }
    return curve->variance[0] > 0.0;
}

/* ---- The pilot ------------------------------------------------------------------------------------------------- */

static void set_levels(radius_pilot *p, float scale, float most)
{
    p->level_count = 0;
    for (uint32_t k = 0; k < CA_RADIUS_LEVELS; k++) {
        const float radius = ldexpf(scale, (int)k - BELOW);
        if (k > 0 && radius > most) break;
        p->levels[p->level_count++].radius = radius;
    }
}

/* *lit: is there a curve? */
static ca_status measure(radius_pilot *p, float most, ca_radius_curve *curve, bool *lit, ca_error *error)
{
    static const ca_walk_hooks note = {.at_vertices = note_queries};
    *lit = false;
    CA_TRY(choose_light_paths(p, error));
    CA_TRY(trace_light_paths(p, 0, error));
    trace_camera_paths(p, (pilot_round){.hooks = &note});
    CA_TRY(find_scale(p, most, error));
    if (!(p->scale > 0.0f)) return CA_OK;
    set_levels(p, p->scale, most);
    for (uint32_t set = 0; set < 2; set++) {
        if (set > 0) CA_TRY(trace_light_paths(p, p->light_paths, error));
        CA_TRY(build_levels(p, error));
        merge_set(p, set);
        light_set(p, set);
        if (p->out_of_memory) return ca_fail_memory(error, "the pilot of the merge radius");
    }
    *lit = make_curve(p, curve);
    return CA_OK;
}

/* The radius at which the median lit query merges with MOST_PHOTONS of so many light paths. */
static double most_merged(const radius_pilot *p, double light_paths)
{
    return (double)p->scale * sqrt(MOST_PHOTONS / NEAREST * p->light_paths / light_paths);
}

static void destroy_level(photon_level *level)
{
    ca_photon_grid_destroy(level->grid);
    ca_free(level->photons);
}

static void destroy_pilot(radius_pilot *p)
{
    for (uint32_t k = 0; k < CA_RADIUS_LEVELS; k++) destroy_level(&p->levels[k]);
    for (uint32_t k = 0; k < LENS_LEVELS; k++) destroy_level(&p->lens[k]);
    for (int i = 0; i < 2; i++) ca_free(p->sums[i]);
    ca_free(p->lights);
    ca_free(p->queries);
    ca_free(p->found);
    if (p->engine) ca_bidirectional_destroy(p->engine);
}

/* The parameters of `type` that `pilot` has, too; others as their defaults, and what the pilot needs. */
static ca_status configure(const ca_integrator_type *pilot, const ca_integrator_type *type,
                           const ca_integrator_input *from, float radius, ca_integrator_input *input,
                           ca_error *error)
{
    for (int i = 0; pilot->parameters[i].name; i++) {
        const ca_parameter_spec *spec = &pilot->parameters[i];
        input->values[i] = ca_integrator_value(type, from, spec->name, spec->number);
    }
    const double max_depth = ca_integrator_value(type, from, "max_depth", -1.0);
    const double depth = max_depth < 0.0 ? MAX_DEPTH : fmin(max_depth, MAX_DEPTH);
    const double diffuse_depth = ca_integrator_value(type, from, "camera_diffuse_depth", 0.0);
    const double roulette = ca_integrator_value(type, from, "rr_depth", CA_ROULETTE_DEPTH);
    CA_TRY(ca_integrator_set_number(pilot, "max_depth", depth, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "rr_depth", fmin(roulette, LATEST_ROULETTE), input, error));
    CA_TRY(ca_integrator_set_number(pilot, "light_paths", MOST_LIGHT_PATHS, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "camera_paths", 1.0, input, error));
    if (pilot == &ca_integrator_bdpm)
        CA_TRY(ca_integrator_set_number(pilot, "camera_diffuse_depth", diffuse_depth, input, error));
    return ca_integrator_set_number(pilot, "radius", (double)radius, input, error);
}

static ca_status create_engine(radius_pilot *p, const ca_integrator_type *type, const ca_integrator_input *from,
                               const ca_sampler *sampler, float radius, ca_error *error)
{
    const bool photons_alone = !type->rules || type->rules->hit == CA_HIT_UNMERGEABLE;
    const ca_integrator_type *pilot = photons_alone ? &ca_integrator_bdpm : &ca_integrator_ovcm;
    ca_integrator_input input = *from;
    input.sampler = sampler;
    input.crop[0] = input.crop[1] = 0;
    input.crop[2] = input.camera->width, input.crop[3] = input.camera->height;
    input.workers = 1;
    input.memory_bytes = 0.0;
    input.technique_images = NULL;
    input.camera_paths = NULL;
    input.pairs = NULL;
    input.observer = NULL;
    input.first_light_path = 0;
    CA_TRY(configure(pilot, type, from, radius, &input, error));
    void *state;
    CA_TRY(pilot->create(&input, &state, error));
    p->engine = state;
    p->merging_alone = photons_alone;
    ca_bidirectional_set_radius(p->engine, radius);
    /* Weights are those of the render: of its numbers of paths. */
    p->engine->rules.has_tails = false; /* they belong to one radius */
    ca_rules_set_counts(&p->engine->rules, from->camera, ca_light_paths_of_pass(type, from),
                        ca_integrator_value(type, from, "camera_paths", 1.0));
    return CA_OK;
}

static ca_status create_arrays(radius_pilot *p, ca_error *error)
{
    const uint32_t cells = p->columns * p->rows;
    p->merging = (p->engine->weighs_merges ? MERGING_WEIGHED : MERGING) / cells;
    p->lighting = LIGHTING / cells;
    for (int i = 0; i < 2; i++) p->sums[i] = ca_alloc_zeroed(cells, sizeof *p->sums[i]);
    p->lights = ca_alloc_zeroed(cells, sizeof *p->lights);
    p->queries = ca_alloc(cells, sizeof *p->queries);
    const bool all = p->sums[0] && p->sums[1] && p->lights && p->queries;
    return all ? CA_OK : ca_fail_memory(error, "the pilot of the merge radius");
}

ca_status ca_radius_pilot(const ca_integrator_type *type, const ca_integrator_input *input, float *radius,
                          ca_radius_blur *blur, ca_error *error)
{
    const float pixel = ca_median_pixel_footprint(input), most = MOST_OF_SCENE * input->scene->radius;
    const double light_paths = ca_light_paths_of_pass(type, input);
    ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT, .seed = ca_pcg_permute(input->sampler->seed ^ PILOT_SEED)};
    ca_sampler_prepare(&sampler, input->camera->width, input->camera->height);
    *radius = pixel; /* where the pilot finds no light */
    if (blur) *blur = (ca_radius_blur){.power = 1.0, .end = (double)INFINITY};
    if (input->scene->light_count == 0) return CA_OK;
    radius_pilot pilot = {.columns = ca_min_u32(SIDE, input->camera->width),
                          .rows = ca_min_u32(SIDE, input->camera->height)};
    ca_radius_curve curve;
    bool lit = false;
    ca_status status = create_engine(&pilot, type, input, &sampler, pixel, error);
    if (status == CA_OK) status = create_arrays(&pilot, error);
    if (status == CA_OK) status = measure(&pilot, most, &curve, &lit, error);
    if (status == CA_OK) status = ca_stop_check(input->stop, error);
    destroy_pilot(&pilot);
    if (status != CA_OK || !lit) return status;
    if (blur) *blur = ca_radius_blur_of(&curve);
    const double end = fmin((double)most, most_merged(&pilot, light_paths));
    const double least = fmin((double)(LEAST_OF_PIXEL * pixel), end);
    *radius =
        (float)ca_radius_choose(&curve, ca_integrator_value(type, input, "alpha", 0.0), light_paths, least, end);
    return CA_OK;
}
