/* A pilot that finds all the light of an image, roughly and before the render, and asks of each path how many samples
 * the render's method will make of it.
 *
 * The pilot is ca_integrator_pilot (hits, next event, and merges of a generous radius) with a fixed number of light
 * paths and of camera paths, which are spread over the rendered part of the film, in CA_LIGHT_BATCHES batches. All
 * of its techniques together make T samples of a path per camera path, those of the render's method make Q
 * (ca_mis_total). A sample of the pilot, with its weight, then stands for
 *
 *     expected = Q / T * (camera paths of the render) / (camera paths of the pilot)
 *
 * samples of the render: their sum over the samples in a part of path space is an unbiased estimate of how many the
 * render makes there, as the sum of their light is one of the light there. (Densities leave out the roulette, by
 * which both lose about the same.) Several methods may be asked for at once.
 *
 * All is a function of the scene, the seed, the question and the settings that say which image is rendered and with
 * what; never of threads or of a clock: one thread traces the paths, numbered where no render arrives. Cost:
 * CA_PILOT_CAMERA_PATHS camera paths and CA_PILOT_LIGHT_PATHS light paths, and about a million merges at most, times
 * the effort. Where there would be more it begins again with a smaller radius, seven times at most. */
#ifndef CA_RENDER_LIGHT_PILOT_H
#define CA_RENDER_LIGHT_PILOT_H

#include "render/lost_light.h"
#include "render/render.h"

enum { CA_PILOT_CAMERA_PATHS = 1024 * CA_LIGHT_BATCHES, CA_PILOT_LIGHT_PATHS = 2048 * CA_LIGHT_BATCHES };

/* Methods that one pilot can be asked for. */
enum { CA_PILOT_METHODS = 4 };

typedef struct ca_light_question {
    const ca_mis_rules *counts; /* of each of so many methods, as ca_integrator_counts makes them */
    uint32_t methods;
    double iterations; /* passes of the render */
    uint32_t effort;   /* so many times the usual paths: a power of two; 0: 1 */
} ca_light_question;

typedef struct ca_light_pilot {
    uint32_t methods;
    ca_light_sample *samples[CA_PILOT_METHODS]; /* owned by the pilot; of each method: the same light */
    size_t count, capacity[CA_PILOT_METHODS];
    /* All light; what of it a render with the first method will find by merging; and that times the number of other
     * photons that the pilot's same merge found: of each batch. */
    double light[CA_LIGHT_BATCHES], merged[CA_LIGHT_BATCHES], merged_photons[CA_LIGHT_BATCHES];
    uint64_t merges;                /* photons that contributed to these */
    double camera_paths, scale;     /* of the pilot; the render's over these */
    double light_paths, merge_area; /* N_F of a batch, pi r^2 */
    ca_counters counters;           /* what it took */
    uint64_t merges_in_vain;        /* and before, with larger radii */
} ca_light_pilot;

/* Errors: CA_ERROR_MEMORY. */
ca_status ca_light_pilot_run(ca_light_pilot *pilot, const ca_render_plan *plan, const ca_light_question *question,
                             ca_error *error);
void ca_light_pilot_destroy(ca_light_pilot *pilot);

/* Of so many passes, as many as lost light is judged by: at least those of 2^20 camera paths. A picture of few paths
 * lacks light that is only noise: more of the same would find it. */
double ca_light_pilot_passes(const ca_render_plan *plan, double passes);

#endif
