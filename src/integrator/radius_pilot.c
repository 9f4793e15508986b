#include "integrator/radius_pilot.h"

#include "base/memory.h"
#include "base/stop.h"
#include "photon/radius.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    SIDE = 52,                  /* of the lattice of pixels */
    MERGING = 3 * SIDE * SIDE,  /* camera paths for either set */
    LIGHTING = 8 * SIDE * SIDE, /* likewise, that tell the light of pixels */
    FEW_LIGHT_PATHS = 1024,     /* tell how many make so many photons as are wanted */
    MOST_LIGHT_PATHS = 1 << 20,
    NEAREST = 12, /* photons within the middle level's radius */
    FULL = 5,     /* levels up to this one have all photons */
};

/* A set has so many photons for each light path of a pass, but for so many of these only; and light paths, where few
 * of them make photons. What the pilot tells is as true as it has photons: with a quarter of them half the radii are
 * off. */
#define PHOTONS_OF_LIGHT_PATH 3.0
#define MOST_OF_LIGHT_PATH 8.0
#define LEAST_PASS 0x1p14
#define MOST_PASS 0x1p17
#define MOST_EFFORT 0x1p18

/* Set apart from the render's. */
#define PILOT_SEED UINT64_C(0x726164697573)

/* The radius lies between this part of a pixel's footprint and that of the scene. */
#define LEAST_OF_PIXEL 0.25f
#define MOST_OF_SCENE 0.1f

/* Photons of a pass that the median lit query merges with at most, or the mean one of all; in the mean over the
 * passes of a render, whose radii shrink. With more of them merging takes most of the time, and a time is better
 * spent on more passes with a smaller radius: as many photons are merged, and less is blurred. */
#define MOST_PHOTONS 48.0

static ca_parallel alone(const ca_bidirectional *b) { return (ca_parallel){.workers = 1, .stop = b->input.stop}; }

/* ---- Photons --------------------------------------------------------------------------------------------------- */

static uint32_t read_photons(const void *user, uint32_t run, uint64_t *at, ca_photon *photons)
{
    const ca_photon_level *level = user;
    (void)run;
    const uint32_t count = ca_min_u32(CA_PHOTON_BATCH, level->count - (uint32_t)*at);
    memcpy(photons, level->photons + *at, count * sizeof *photons);
    *at += count;
    return count;
}

static void collect(const ca_bidirectional *b, uint32_t path, uint32_t rank, ca_photon_level *level)
{
    const uint32_t number = ca_light_record_number(&b->store, &b->store.paths[path], rank);
    level->photons[level->count++] =
        (ca_photon){.position = ca_light_record_at(&b->store, number)->position, .vertex = number};
}

/* The photons of every step-th light path. */
static void collect_all(const ca_bidirectional *b, uint32_t step, ca_photon_level *level)
{
    level->paths = (b->paths_now + step - 1) / step;
    for (uint32_t path = 0; path < b->paths_now; path += step)
        for (uint32_t rank = 0; rank < b->store.paths[path].records; rank++) collect(b, path, rank, level);
}

/* Those that came through mirrors and lenses alone: the first records of their paths, though not of the first
 * vertices. */
static void collect_lens(const ca_bidirectional *b, ca_photon_level *level)
{
    level->paths = b->paths_now;
    for (uint32_t path = 0; path < b->paths_now; path++) {
        const ca_light_path *own = &b->store.paths[path];
        if (own->records > 0 && ca_light_record_at(&b->store, ca_light_record_number(&b->store, own, 0))->index > 1)
            collect(b, path, 0, level);
    }
}

/* step 0: photons of light that met Dirac events only. */
static ca_status build_level(const ca_bidirectional *b, uint32_t step, ca_photon_level *level, ca_error *error)
{
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
    const ca_status status = ca_photon_grid_build(level->grid, &source, &bounds, level->radius, &parallel, error);
    ca_free(level->photons);
    level->photons = NULL;
    return status;
}

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* How many queries have NEAREST photons within the grid's radius; *median: the median of their distances. */
static uint32_t look_around(const ca_radius_probe *p, float *distances, float *median)
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

static ca_status find_scale(ca_radius_probe *p, float most, ca_error *error)
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

static ca_status trace_light_paths(ca_radius_probe *p, uint64_t number, ca_error *error)
{
    const ca_parallel parallel = alone(p->engine);
    ca_mis_rules *rules = &p->engine->rules;
    const bool splat = rules->splat; /* it counts in weights; no picture is made */
    rules->splat = false;
    const ca_status status = ca_light_paths_prepare(p->engine, number, p->light_paths, &parallel, &p->worker, error);
    rules->splat = splat;
    return status;
}

/* As many as make the photons that are wanted, for so many light paths of a pass; where few arrive anywhere, more. */
static ca_status choose_light_paths(ca_radius_probe *p, double of_pass, ca_error *error)
{
    p->light_paths = FEW_LIGHT_PATHS;
    CA_TRY(trace_light_paths(p, CA_PILOT_NUMBER, error));
    const double photons = (double)p->engine->photons_now / FEW_LIGHT_PATHS;
    const double wanted = PHOTONS_OF_LIGHT_PATH * of_pass / fmax(photons, 1.0 / FEW_LIGHT_PATHS);
    const double most = fmin(MOST_OF_LIGHT_PATH * of_pass, MOST_LIGHT_PATHS);
    p->light_paths = (uint32_t)fmin(fmax(wanted, FEW_LIGHT_PATHS), most);
    return CA_OK;
}

static ca_status build_levels(ca_radius_probe *p, ca_error *error)
{
    for (uint32_t k = 0; k < p->level_count; k++)
        CA_TRY(build_level(p->engine, k > FULL ? 1u << 2 * (k - FULL) : 1, &p->levels[k], error));
    return CA_OK;
}

static ca_status build_lens_levels(ca_radius_probe *p, ca_error *error)
{
    for (uint32_t k = 0; k < ca_min_u32(CA_LENS_LEVELS, p->level_count); k++) {
        p->lens[k].radius = p->levels[k].radius;
        CA_TRY(build_level(p->engine, 0, &p->lens[k], error));
    }
    return CA_OK;
}

/* ---- The pilot ------------------------------------------------------------------------------------------------- */

static void set_levels(ca_radius_probe *p, float scale, float most)
{
    p->level_count = 0;
    for (uint32_t k = 0; k < CA_RADIUS_LEVELS; k++) {
        const float radius = ldexpf(scale, (int)k - CA_PILOT_BELOW);
        if (k > 0 && radius > most) break;
        p->levels[p->level_count++].radius = radius;
    }
}

/* *lit: is there a curve? */
static ca_status measure(ca_radius_probe *p, double of_pass, float most, ca_radius_curve *curve, bool *lit,
                         ca_error *error)
{
    *lit = false;
    CA_TRY(choose_light_paths(p, of_pass, error));
    CA_TRY(trace_light_paths(p, 0, error));
    ca_radius_note_queries(p);
    CA_TRY(find_scale(p, most, error));
    if (!(p->scale > 0.0f)) return CA_OK;
    set_levels(p, p->scale, most);
    for (uint32_t set = 0; set < 2; set++) {
        if (set > 0) CA_TRY(trace_light_paths(p, p->light_paths, error));
        CA_TRY(build_levels(p, error));
        ca_radius_merge_set(p, set);
    }
    CA_TRY(build_lens_levels(p, error));
    ca_radius_light_pixels(p);
    if (p->out_of_memory) return ca_fail_memory(error, "the pilot of the merge radius");
    *lit = ca_radius_make_curve(p, curve);
    return CA_OK;
}

/* The radius at which the median lit query, or the mean one, merges with MOST_PHOTONS of so many light paths. */
static double most_merged(const ca_radius_probe *p, double light_paths, double alpha)
{
    const double most = MOST_PHOTONS / ca_progressive_mean_area(alpha, CA_RADIUS_PASSES);
    const double mean = p->merging_queries > 0.0 ? p->merged / p->merging_queries : NEAREST;
    const double photons = fmax(fmin(mean, NEAREST), 1.0);
    return (double)p->scale * sqrt(most / photons * p->light_paths / light_paths);
}

static void destroy_level(ca_photon_level *level)
{
    ca_photon_grid_destroy(level->grid);
    ca_free(level->photons);
}

static void destroy_pilot(ca_radius_probe *p)
{
    for (uint32_t k = 0; k < CA_RADIUS_LEVELS; k++) destroy_level(&p->levels[k]);
    for (uint32_t k = 0; k < CA_LENS_LEVELS; k++) destroy_level(&p->lens[k]);
    for (int i = 0; i < 2; i++) ca_free(p->sums[i]);
    ca_free(p->lights);
    ca_free(p->relative);
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
    const double diffuse_depth = ca_integrator_value(type, from, "camera_diffuse_depth", 0.0);
    CA_TRY(ca_integrator_limit_pilot(pilot, type, from, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "light_paths", MOST_LIGHT_PATHS, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "camera_paths", 1.0, input, error));
    if (pilot == &ca_integrator_bdpm)
        CA_TRY(ca_integrator_set_number(pilot, "camera_diffuse_depth", diffuse_depth, input, error));
    return ca_integrator_set_number(pilot, "radius", (double)radius, input, error);
}

static ca_status create_engine(ca_radius_probe *p, const ca_integrator_type *type, const ca_integrator_input *from,
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

static ca_status create_arrays(ca_radius_probe *p, ca_error *error)
{
    const uint32_t cells = p->columns * p->rows;
    p->merging = MERGING / cells;
    p->lighting = LIGHTING / cells;
    for (int i = 0; i < 2; i++) p->sums[i] = ca_alloc_zeroed(cells, sizeof *p->sums[i]);
    p->lights = ca_alloc_zeroed(cells, sizeof *p->lights);
    p->relative = ca_alloc(cells, sizeof *p->relative);
    p->queries = ca_alloc(cells, sizeof *p->queries);
    const bool all = p->sums[0] && p->sums[1] && p->lights && p->relative && p->queries;
    return all ? CA_OK : ca_fail_memory(error, "the pilot of the merge radius");
}

ca_status ca_radius_pilot(const ca_integrator_type *type, const ca_integrator_input *input, double effort,
                          float *radius, ca_radius_blur *blur, ca_error *error)
{
    const float pixel = ca_median_pixel_footprint(input), most = MOST_OF_SCENE * input->scene->radius;
    const double light_paths = ca_light_paths_of_pass(type, input);
    ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT, .seed = ca_pcg_permute(input->sampler->seed ^ PILOT_SEED)};
    ca_sampler_prepare(&sampler, input->camera->width, input->camera->height);
    *radius = pixel; /* where the pilot finds no light */
    if (blur) *blur = (ca_radius_blur){.power = 1.0, .end = (double)INFINITY};
    if (input->scene->light_count == 0) return CA_OK;
    ca_radius_probe pilot = {.columns = ca_min_u32(SIDE, input->camera->width),
                          .rows = ca_min_u32(SIDE, input->camera->height)};
    ca_radius_curve curve;
    bool lit = false;
    ca_status status = create_engine(&pilot, type, input, &sampler, pixel, error);
    if (status == CA_OK) status = create_arrays(&pilot, error);
    const double of_pass = effort > 0.0 ? fmin(fmax(effort, LEAST_PASS), MOST_EFFORT)
                                        : fmin(fmax(light_paths, LEAST_PASS), MOST_PASS);
    if (status == CA_OK) status = measure(&pilot, of_pass, most, &curve, &lit, error);
    if (status == CA_OK) status = ca_stop_check(input->stop, error);
    destroy_pilot(&pilot);
    if (status != CA_OK || !lit) return status;
    if (blur) *blur = ca_radius_blur_of(&curve);
    const double alpha = ca_integrator_value(type, input, "alpha", 0.0);
    const double end = fmin((double)most, most_merged(&pilot, light_paths, alpha));
    const double least = fmin((double)(LEAST_OF_PIXEL * pixel), end);
    *radius = (float)ca_radius_choose(&curve, alpha, light_paths, least, end);
    return CA_OK;
}
