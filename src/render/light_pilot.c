#include "render/light_pilot.h"

#include "base/memory.h"
#include "base/stop.h"
#include "sampling/owen.h"

#include <math.h>
#include <stdlib.h>

/* A batch's camera paths are traced in groups, the first ones small: they tell early of too many merges. No render
 * numbers its paths from here. */
enum { GROUP = 256, FIRST_GROUP = 4 };
#define CAMERA_INDEX UINT32_C(0xf0000000)
#define LIGHT_NUMBER (UINT64_C(1) << 61)

/* Light is lost by a method if it is in a render of so many camera paths, at least. */
#define CAMERA_PATHS_TO_LOSE 0x1p20

/* The merge radius is a part of the picture's side, the smaller the more light paths there are, and a smaller one
 * where a batch has too many merges: where a lens or a mirror lets all of the picture see a place of that size, in
 * the light. */
enum { RADII_OF_SIDE = 64, SMALLER = 4, SMALLEST = 1 << 20, BATCH_MERGES = 1 << 16 };

enum {
    BATCH_CAMERA_PATHS = CA_PILOT_CAMERA_PATHS / CA_LIGHT_BATCHES,
    BATCH_LIGHT_PATHS = CA_PILOT_LIGHT_PATHS / CA_LIGHT_BATCHES
};
_Static_assert((BATCH_CAMERA_PATHS & (BATCH_CAMERA_PATHS - 1)) == 0, "strips in the order of reversed bits");

/* A photon that a camera path merged with. */
typedef struct photon {
    const ca_surface_point *path; /* one address a path of the group */
    uint32_t vertex, number;      /* where the camera path merged; how many photons were merged before */
    double merged;                /* light that the render finds by merging */
} photon;

/* The observer's. */
typedef struct pilot_run {
    ca_light_pilot *pilot;
    const ca_mis_rules *counts; /* of each method of the render, per camera path */
    uint32_t effort, batch;
    double weight, expected[CA_PILOT_METHODS]; /* of the path that was seen last */
    bool shown;     /* likewise: a light that is seen at once or by Dirac events alone */
    double own_share; /* how much of its light a render with the first method finds in the very same way */
    photon seen;             /* if it is a merge; `path` NULL: it is none */
    photon *photons;         /* owned; of the group */
    size_t photon_count, photon_capacity;
    bool out_of_memory, crowded;
} pilot_run;

/* ---- Looking at paths ------------------------------------------------------------------------------------------ */

static void see(void *user, const ca_observed_path *observed)
{
    pilot_run *r = user;
    const ca_mis_path *path = observed->path;
    const double here = ca_mis_total(observed->rules, path, observed->technique, NULL);
    r->pilot->merge_area = (double)observed->rules->merge_area;
    r->weight = (double)observed->weight;
    for (uint32_t m = r->pilot->methods; m-- > 0;) {
        double own;
        const double all = ca_mis_total(&r->counts[m], path, observed->technique, &own);
        r->expected[m] = r->pilot->scale * all / here;
        r->own_share = all > 0.0 ? own / all : 0.0;
    }
    r->shown = observed->technique == CA_TECHNIQUE_HIT &&
               path->camera.vertices[path->camera.count - 2].connectable_count == 0;
    r->seen = (photon){.path = observed->technique == CA_TECHNIQUE_MERGE ? observed->camera : NULL,
                       .vertex = path->camera.count};
}

static bool keep_photon(pilot_run *r, double merged)
{
    photon *photons = ca_array_grow(r->photons, &r->photon_capacity, r->photon_count + 1, sizeof *photons);
    if (!photons) return false;
    r->photons = photons;
    r->seen.number = (uint32_t)r->photon_count;
    r->seen.merged = merged;
    photons[r->photon_count++] = r->seen;
    return true;
}

/* Of each method. */
static bool keep_samples(pilot_run *r, ca_light_sample sample)
{
    ca_light_pilot *pilot = r->pilot;
    for (uint32_t m = 0; m < pilot->methods; m++) {
        ca_light_sample *samples =
            ca_array_grow(pilot->samples[m], &pilot->capacity[m], pilot->count + 1, sizeof *samples);
        if (!samples) return false;
        pilot->samples[m] = samples;
        sample.expected = r->expected[m];
        samples[pilot->count] = sample;
    }
    pilot->count++;
    return true;
}

/* All merges of the pilot are those of the render, but for their number: with the render's weight they estimate what
 * it finds by them. */
static void take(void *user, uint32_t x, uint32_t y, ca_rgb unweighted)
{
    pilot_run *r = user;
    const double luminance = (double)ca_luminance(unweighted), light = r->weight * luminance;
    const double merged = r->seen.path ? r->own_share * luminance : 0.0;
    const ca_light_sample sample = {.light = light, .shown = r->shown, .batch = r->batch, .x = x, .y = y};
    r->pilot->light[r->batch] += light;
    if (light > 0.0 && !keep_samples(r, sample)) r->out_of_memory = true;
    if (merged > 0.0 && !keep_photon(r, merged)) r->out_of_memory = true;
}

/* ---- Photons of a merge ---------------------------------------------------------------------------------------- */

/* By merges; within one in the order in which they came. Paths of a group lie in one array. */
static int compare_photons(const void *left, const void *right)
{
    const photon *a = left, *b = right;
    if (a->path != b->path) return a->path < b->path ? -1 : 1;
    if (a->vertex != b->vertex) return a->vertex < b->vertex ? -1 : 1;
    return (a->number > b->number) - (a->number < b->number);
}

/* Adds up the merges of a group. Of the photons that a merge found each meets the others: how many there are where
 * light was found is then not estimated too high because light was found. */
static void finish_group(pilot_run *r)
{
    if (r->photon_count > 0) qsort(r->photons, r->photon_count, sizeof *r->photons, compare_photons);
    for (size_t first = 0, end; first < r->photon_count; first = end) {
        const photon *p = &r->photons[first];
        double merged = 0.0;
        for (end = first; end < r->photon_count && r->photons[end].path == p->path &&
                          r->photons[end].vertex == p->vertex;
             end++)
            merged += r->photons[end].merged;
        r->pilot->merged[r->batch] += merged;
        r->pilot->merged_photons[r->batch] += merged * (double)(end - first - 1);
    }
    r->pilot->merges += r->photon_count;
    r->photon_count = 0;
}

/* ---- Paths ----------------------------------------------------------------------------------------------------- */

/* The pixel of the batch's path `i`: anywhere in its one of as many strips of equal size. The first paths are spread
 * over the picture, as all are. */
static void place(const ca_render_plan *plan, uint32_t batch, uint32_t i, uint32_t paths, ca_camera_path *path)
{
    const uint32_t strip = (uint32_t)((uint64_t)ca_reverse_bits(i) * paths >> 32);
    const uint32_t *c = plan->crop;
    const uint64_t width = c[2] - c[0], pixels = width * (c[3] - c[1]);
    const uint64_t bits = ca_pcg_permute(plan->seed + ca_pcg_permute((uint64_t)batch * paths + strip));
    const double along = (strip + (double)ca_unit_float(bits, 40)) / paths;
    const uint64_t pixel = (uint64_t)(along * (double)pixels);
    path->x = c[0] + (uint32_t)(pixel % width);
    path->y = c[1] + (uint32_t)(pixel / width);
    path->index = CAMERA_INDEX + batch * paths + strip;
}

static void trace_group(pilot_run *r, const ca_render_plan *plan, void *state, uint32_t first, uint32_t count,
                        ca_worker *worker)
{
    ca_film_sample samples[GROUP];
    ca_camera_path paths[GROUP];
    for (uint32_t i = 0; i < count; i++) {
        samples[i] = (ca_film_sample){0};
        paths[i] = (ca_camera_path){.sample = &samples[i]};
        place(plan, r->batch, first + i, r->effort * BATCH_CAMERA_PATHS, &paths[i]);
    }
    ca_integrator_pilot.camera_paths(state, paths, count, 0, worker);
    finish_group(r);
}

static ca_status trace(pilot_run *r, const ca_render_plan *plan, void *state, ca_error *error)
{
    const ca_parallel parallel = {.workers = 1, .stop = plan->input.stop};
    ca_worker worker = {.index = 0};
    for (r->batch = 0; r->batch < CA_LIGHT_BATCHES && !r->crowded; r->batch++) {
        CA_TRY(ca_integrator_pilot.begin_round(state, r->batch, 0, &parallel, &worker, error));
        for (uint32_t first = 0, count; first < r->effort * BATCH_CAMERA_PATHS && !r->crowded; first += count) {
            count = ca_min_u32(GROUP, ca_max_u32(FIRST_GROUP, first));
            CA_TRY(ca_stop_check(plan->input.stop, error));
            trace_group(r, plan, state, first, count, &worker);
            r->crowded = worker.counters.merges > (uint64_t)BATCH_MERGES * r->effort * (r->batch + 1);
        }
        if (r->out_of_memory) return ca_fail_memory(error, "the pilot's paths");
    }
    r->pilot->counters = worker.counters;
    return CA_OK;
}

/* ---- Settings -------------------------------------------------------------------------------------------------- */

/* The parameters that say which light there is are the plan's, the others the pilot's own. */
static ca_status configure(ca_integrator_input *input, const ca_render_plan *plan, double light_paths,
                           double radii_of_side, ca_error *error)
{
    const ca_integrator_type *pilot = &ca_integrator_pilot;
    const ca_integrator_desc nothing_set = {.name = NULL};
    const double side = sqrt(ca_render_plan_pixels(plan));
    CA_TRY(ca_integrator_configure(pilot, &nothing_set, false, NULL, input, error));
    CA_TRY(ca_integrator_limit_pilot(pilot, plan->type, &plan->input, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "alpha", 0.0, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "light_paths", light_paths, input, error));
    return ca_integrator_set_number(pilot, "radius_pixels", side / radii_of_side, input, error);
}

/* One try with a radius. */
static ca_status run(pilot_run *r, const ca_render_plan *plan, double radii_of_side, ca_error *error)
{
    const ca_path_observer observer = {.see = see, .user = r, .take = take};
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT,
                                .seed = plan->seed,
                                .width = plan->camera.width,
                                .height = plan->camera.height};
    ca_integrator_input input = plan->input;
    input.sampler = &sampler;
    input.observer = &observer;
    input.workers = 1;
    input.memory_bytes = 0.0;
    input.first_light_path = LIGHT_NUMBER;
    void *state;
    CA_TRY(configure(&input, plan, r->pilot->light_paths, radii_of_side, error));
    CA_TRY(ca_integrator_pilot.create(&input, &state, error));
    const ca_status status = trace(r, plan, state, error);
    ca_integrator_pilot.destroy(state);
    ca_free(r->photons);
    return status;
}

/* Crowded with any radius: the camera paths that were traced stand for all. */
static void end_early(ca_light_pilot *pilot)
{
    const double factor = pilot->camera_paths / (double)pilot->counters.camera_paths;
    for (uint32_t m = 0; m < pilot->methods; m++)
        for (size_t i = 0; i < pilot->count; i++) pilot->samples[m][i].expected *= factor;
    pilot->camera_paths /= factor;
    pilot->scale *= factor;
}

ca_status ca_light_pilot_run(ca_light_pilot *pilot, const ca_render_plan *plan, const ca_light_question *question,
                             ca_error *error)
{
    const double paths = plan->camera_paths * question->iterations * ca_render_plan_pixels(plan);
    const uint32_t effort = ca_max_u32(question->effort, 1);
    const double camera_paths = (double)effort * CA_PILOT_CAMERA_PATHS;
    *pilot = (ca_light_pilot){.methods = question->methods};
    for (double radii = RADII_OF_SIDE * sqrt(effort);; radii *= SMALLER) {
        ca_light_pilot_destroy(pilot);
        *pilot = (ca_light_pilot){.methods = question->methods,
                                  .light_paths = (double)effort * BATCH_LIGHT_PATHS,
                                  .camera_paths = camera_paths,
                                  .scale = paths / camera_paths,
                                  .merges_in_vain = pilot->merges_in_vain + pilot->counters.merges};
        pilot_run r = {.pilot = pilot, .counts = question->counts, .effort = effort};
        const ca_status status = run(&r, plan, radii, error);
        if (status != CA_OK) {
            ca_light_pilot_destroy(pilot);
            return status;
        }
        if (r.crowded && radii < SMALLEST) continue;
        if (r.crowded) end_early(pilot);
        return CA_OK;
    }
}

void ca_light_pilot_destroy(ca_light_pilot *pilot)
{
    for (uint32_t m = 0; m < CA_PILOT_METHODS; m++) {
        ca_free(pilot->samples[m]);
        pilot->samples[m] = NULL;
        pilot->capacity[m] = 0;
    }
    pilot->count = 0;
}

double ca_light_pilot_passes(const ca_render_plan *plan, double passes)
{
    return fmax(passes, ceil(CAMERA_PATHS_TO_LOSE / (ca_render_plan_pixels(plan) * plan->camera_paths)));
}
