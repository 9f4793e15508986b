/* The pilot of guided emission (light/emission_guide.h): which lights bring light to the picture, and where that
 * light meets a surface first.
 *
 * The engine of ca_integrator_pilot, which finds all light there is, traces a few paths of the rendered part of the
 * film, twice: the second time its light paths are guided by what the first one found. Where that is too little to
 * aim at, as behind a keyhole, there is a round of more light paths between them. A path counts by its light
 * relative to that of its part of the picture, and by the share of it that the method leaves to light paths: where
 * next event finds light as well, fewer of them are needed. That share is the one of a light path per pixel of the
 * film and a radius of RADIUS_PIXELS.
 *
 * All is a function of scene, settings, seed and the crop, never of threads, memory or numbers of paths: one thread
 * traces, with random numbers of its own. The image's mean stays what it is. */
#include "integrator/bidirectional.h"

#include "base/memory.h"
#include "sampling/owen.h"

#include <math.h>
#include <string.h>

enum {
    LIGHT_PATHS = 8192, /* of a round; likewise: */
    CAMERA_PATHS = 2048,
    MANY_LIGHT_PATHS = 8 * LIGHT_PATHS, /* where these find too little */
    FIRST_GROUP = 4, /* camera paths that are traced together, and the most of them */
    GROUP = 128,
    MOST_MERGES = 1 << 15, /* with so many a round ends; and if that is before this camera path: */
    LEAST_PATHS = 512,     /* again, with a smaller radius */
    RADII = 6,             /* tried at most; each a part of the one before: */
    SMALLER = 4,
    RADII_OF_SIDE = 32, /* the first one, of the picture's side */
    PARTS = 8,          /* of the picture, across and down */
};
#define RADIUS_PIXELS 2.0f

/* Set apart from the render's. */
#define PILOT_SEED UINT64_C(0x6775696465)

/* Light of a part of the picture counts as so much at least: darker ones have little part in the error
 * (metrics/compare.h). */
#define LEAST_LIGHT 0.1

/* No sample counts more than so many average ones. */
#define MOST_OF_MEAN 16.0

/* Numbers of paths no render arrives at. */
#define CAMERA_INDEX UINT32_C(0xe0000000)

typedef struct guide_pilot {
    const ca_integrator_input *from;
    ca_mis_rules all, alone; /* with and without light paths */
    ca_guide_sample *samples; /* owned */
    uint16_t *parts;          /* owned; of the picture, of each sample */
    size_t count, sample_capacity, part_capacity;
    double light[PARTS * PARTS];
    uint32_t paths[PARTS * PARTS];
    ca_guide_sample seen; /* the path that was seen last; its weight counts that of the technique, too: */
    double weight;        /* the technique's alone */
    bool out_of_memory;
} guide_pilot;

typedef struct guide_round {
    uint32_t number, light_paths;
    const ca_emission_guide *guide; /* borrowed; of its light paths; NULL: none */
} guide_round;

/* ---- Looking at paths ------------------------------------------------------------------------------------------ */

/* The light of a path, and the vertex before it. Of a path that sees a light there is none: weight 0. */
static ca_guide_sample start_of(const ca_scene *scene, const ca_observed_path *observed)
{
    const uint32_t s = observed->path->camera.count, t = observed->path->light.count;
    if (observed->technique == CA_TECHNIQUE_HIT) {
        const uint32_t shape = observed->camera[s - 1].shape;
        return (ca_guide_sample){.position = observed->camera[s - 2].position,
                                 .light = shape == CA_NONE ? scene->environment : scene->shapes[shape].light,
                                 .weight = s > 2 ? 1.0f : 0.0f};
    }
    const bool is_merge = observed->technique == CA_TECHNIQUE_MERGE;
    const ca_vec3 next =
        is_merge || t > 1 ? observed->light[1].point.position : observed->camera[s - 1].position;
    return (ca_guide_sample){.position = next, .light = observed->light[0].point.shape, .weight = 1.0f};
}

/* How much of the path's light the method leaves to light paths. */
static double share_of_light_paths(const guide_pilot *p, const ca_observed_path *observed)
{
    const double all = ca_mis_total(&p->all, observed->path, observed->technique, NULL);
    const double alone = ca_mis_total(&p->alone, observed->path, observed->technique, NULL);
    return all > 0.0 ? 1.0 - alone / all : 0.0;
}

static void see(void *user, const ca_observed_path *observed)
{
    guide_pilot *p = user;
    p->weight = (double)observed->weight;
    p->seen = start_of(p->from->scene, observed);
    if (p->seen.weight > 0.0f) p->seen.weight = (float)(p->weight * share_of_light_paths(p, observed));
}

static uint32_t part_of(const uint32_t crop[4], uint32_t x, uint32_t y)
{
    const uint32_t column = (uint32_t)((uint64_t)(x - crop[0]) * PARTS / (crop[2] - crop[0]));
    const uint32_t row = (uint32_t)((uint64_t)(y - crop[1]) * PARTS / (crop[3] - crop[1]));
    return row * PARTS + column;
}

static void take(void *user, uint32_t x, uint32_t y, ca_rgb unweighted)
{
    guide_pilot *p = user;
    const uint32_t part = part_of(p->from->crop, x, y);
    const double luminance = (double)ca_luminance(unweighted);
    ca_guide_sample sample = p->seen;
    sample.weight = (float)(luminance * (double)sample.weight);
    p->light[part] += luminance * p->weight;
    if (!(sample.weight > 0.0f)) return;
    ca_guide_sample *samples = ca_array_grow(p->samples, &p->sample_capacity, p->count + 1, sizeof *samples);
    if (samples) p->samples = samples;
    uint16_t *parts = ca_array_grow(p->parts, &p->part_capacity, p->count + 1, sizeof *parts);
    if (parts) p->parts = parts;
    if (!samples || !parts) {
        p->out_of_memory = true;
        return;
    }
    p->samples[p->count] = sample;
    p->parts[p->count++] = (uint16_t)part;
}

/* ---- Tracing --------------------------------------------------------------------------------------------------- */

/* Path `i` of a round: in its one of as many strips of equal size, of which the first ones are spread over the
 * picture. */
static void place(guide_pilot *p, uint32_t round, uint32_t i, ca_camera_path *path)
{
    const uint32_t *c = p->from->crop;
    const uint32_t strip = (uint32_t)((uint64_t)ca_reverse_bits(i) * CAMERA_PATHS >> 32);
    const uint64_t number = (uint64_t)round * CAMERA_PATHS + strip;
    const uint64_t width = c[2] - c[0], pixels = width * (c[3] - c[1]);
    const uint64_t bits = ca_pcg_permute(p->from->sampler->seed + ca_pcg_permute(PILOT_SEED + number));
    const double along = (strip + (double)ca_unit_float(bits, 40)) / CAMERA_PATHS;
    const uint64_t pixel = (uint64_t)(along * (double)pixels);
    path->x = c[0] + (uint32_t)(pixel % width);
    path->y = c[1] + (uint32_t)(pixel / width);
    path->index = CAMERA_INDEX + (uint32_t)number;
    p->paths[part_of(c, path->x, path->y)]++;
}

static void trace_group(guide_pilot *p, const void *state, uint32_t round, uint32_t first, uint32_t count,
                        ca_worker *worker)
{
    ca_film_sample samples[GROUP];
    ca_camera_path paths[GROUP];
    for (uint32_t i = 0; i < count; i++) {
        samples[i] = (ca_film_sample){0};
        paths[i] = (ca_camera_path){.sample = &samples[i]};
        place(p, round, first + i, &paths[i]);
    }
    ca_integrator_pilot.camera_paths(state, paths, count, 0, worker);
}

/* *crowded: there were too many merges. Each camera path may have a merge with every photon: the first groups are
 * small. */
static ca_status trace(guide_pilot *p, void *state, uint32_t round, bool *crowded, ca_error *error)
{
    const ca_parallel parallel = {.workers = 1};
    ca_worker worker = {.index = 0};
    CA_TRY(ca_integrator_pilot.begin_round(state, round, 0, &parallel, &worker, error));
    uint32_t traced = 0, count;
    for (; traced < CAMERA_PATHS && worker.counters.merges <= MOST_MERGES; traced += count) {
        count = traced < FIRST_GROUP ? FIRST_GROUP : ca_min_u32(traced, GROUP);
        trace_group(p, state, round, traced, count, &worker);
        if (p->out_of_memory) return ca_fail_memory(error, "the pilot of emission");
    }
    *crowded = traced < LEAST_PATHS;
    return CA_OK;
}

/* The parameters that say which light there is are the method's. */
static ca_status configure(const ca_integrator_type *type, const ca_integrator_input *from, uint32_t light_paths,
                           double radius, ca_integrator_input *input, ca_error *error)
{
    const ca_integrator_type *pilot = &ca_integrator_pilot;
    for (int i = 0; pilot->parameters[i].name; i++) input->values[i] = pilot->parameters[i].number;
    CA_TRY(ca_integrator_limit_pilot(pilot, type, from, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "alpha", 0.0, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "light_paths", light_paths, input, error));
    return ca_integrator_set_number(pilot, "radius", radius, input, error);
}

/* One try with a radius. */
static ca_status try_radius(guide_pilot *p, const ca_integrator_type *type, const guide_round *round, double radius,
                            bool *crowded, ca_error *error)
{
    const ca_path_observer observer = {.see = see, .user = p, .take = take};
    ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT,
                          .seed = ca_pcg_permute(p->from->sampler->seed ^ PILOT_SEED)};
    ca_integrator_input input = *p->from;
    void *state;
    ca_sampler_prepare(&sampler, input.camera->width, input.camera->height);
    input.sampler = &sampler;
    input.observer = &observer;
    input.guide = round->guide;
    input.workers = 1;
    input.memory_bytes = 0.0;
    input.technique_images = NULL;
    input.camera_paths = NULL;
    input.pairs = NULL;
    input.first_light_path = 0;
    CA_TRY(configure(type, p->from, round->light_paths, radius, &input, error));
    CA_TRY(ca_integrator_pilot.create(&input, &state, error));
    const ca_status status = trace(p, state, round->number, crowded, error);
    ca_integrator_pilot.destroy(state);
    return status;
}

/* Adds a round's samples to those that there are. */
static ca_status run_round(guide_pilot *p, const ca_integrator_type *type, const guide_round *round, double pixel,
                           ca_error *error)
{
    const uint32_t *c = p->from->crop;
    const double pixels = (double)(c[2] - c[0]) * (c[3] - c[1]);
    double radius = pixel * sqrt(pixels) / RADII_OF_SIDE;
    const guide_pilot before = *p;
    bool crowded = true;
    for (int i = 0; i < RADII && crowded; i++, radius /= SMALLER) {
        p->count = before.count;
        memcpy(p->light, before.light, sizeof p->light);
        memcpy(p->paths, before.paths, sizeof p->paths);
        CA_TRY(try_radius(p, type, round, radius, &crowded, error));
    }
    return CA_OK;
}

/* ---- The guide ------------------------------------------------------------------------------------------------- */

/* Of what the samples count, relative to the light of their part of the picture. */
static double relative(const guide_pilot *p, size_t i)
{
    const uint32_t part = p->parts[i];
    return (double)p->samples[i].weight / (p->light[part] / p->paths[part] + LEAST_LIGHT);
}

static ca_status make_guide(const guide_pilot *p, const ca_scene *scene, ca_emission_guide **guide, ca_error *error)
{
    double sum = 0.0;
    if (p->count == 0) return CA_OK;
    ca_guide_sample *samples = ca_alloc(p->count, sizeof *samples);
    if (!samples) return ca_fail_memory(error, "the pilot of emission");
    for (size_t i = 0; i < p->count; i++) sum += relative(p, i);
    const double most = MOST_OF_MEAN * sum / (double)p->count;
    for (size_t i = 0; i < p->count; i++) {
        samples[i] = p->samples[i];
        samples[i].weight = (float)fmin(relative(p, i), most);
    }
    const ca_status status = ca_emission_guide_create(guide, scene->lights, scene->light_count, &scene->light_choice,
                                                      samples, p->count, error);
    ca_free(samples);
    return status;
}

/* Of all paths, whatever the numbers of light paths and the radius are that are chosen in the end. */
static void set_rules(guide_pilot *p, const ca_integrator_type *type, float pixel)
{
    const double pixels = (double)p->from->camera->width * p->from->camera->height;
    p->all = *type->rules;
    ca_rules_read(&p->all, type, p->from);
    p->all.factors = p->all.has_tails = false;
    p->all.reuse.kind = CA_REUSE_FULL;
    p->all.reuse.light_paths = p->all.splat_count = (float)pixels;
    p->all.merge_area = p->all.reuse.merge_area = CA_PI * ca_sqr(RADIUS_PIXELS * pixel);
    p->alone = p->all;
    p->alone.merge = CA_MERGE_NONE;
    p->alone.connect = p->alone.splat = false;
}

static bool is_aimed(const ca_emission_guide *guide)
{
    for (uint32_t i = 0; guide && i < guide->light_count; i++)
        if (guide->aims[i].count > 0) return true;
    return false;
}

/* A round, and the guide from what is known with it, in place of the one before. */
static ca_status run_and_learn(guide_pilot *p, const ca_integrator_type *type, const guide_round *round, double pixel,
                               ca_emission_guide **guide, ca_error *error)
{
    CA_TRY(run_round(p, type, round, pixel, error));
    ca_emission_guide_destroy(*guide);
    *guide = NULL;
    return make_guide(p, p->from->scene, guide, error);
}

static ca_status run(guide_pilot *p, const ca_integrator_type *type, ca_emission_guide **guide, ca_error *error)
{
    const float pixel = ca_median_pixel_footprint(p->from);
    guide_round round = {.light_paths = LIGHT_PATHS};
    set_rules(p, type, pixel);
    CA_TRY(run_and_learn(p, type, &round, (double)pixel, guide, error));
    if (!is_aimed(*guide)) {
        round = (guide_round){.number = 1, .light_paths = MANY_LIGHT_PATHS};
        CA_TRY(run_and_learn(p, type, &round, (double)pixel, guide, error));
    }
    round = (guide_round){.number = round.number + 1, .light_paths = LIGHT_PATHS, .guide = *guide};
    return run_and_learn(p, type, &round, (double)pixel, guide, error);
}

ca_status ca_integrator_make_guide(const ca_integrator_type *type, const ca_integrator_input *input,
                                   ca_emission_guide **guide, ca_error *error)
{
    guide_pilot pilot = {.from = input};
    *guide = NULL;
    if (ca_integrator_value(type, input, "guide", 0.0) == 0.0) return CA_OK;
    if (!ca_emission_can_be_guided(input->scene->lights, input->scene->light_count)) return CA_OK;
    const ca_status status = run(&pilot, type, guide, error);
    ca_free(pilot.samples);
    ca_free(pilot.parts);
    if (status == CA_OK) return CA_OK;
    ca_emission_guide_destroy(*guide);
    *guide = NULL;
    return status;
}
