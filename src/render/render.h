/* Rendering: passes or blocks over tiles, threads, time, noise and stopping. The only place that knows them.
 *
 * A pass (iteration) adds one sample to every pixel: the mean of a number of camera paths, and what light paths
 * bring. Tiles are handed to threads as they come free; each pixel's sums are written by one thread at a time in the
 * order of passes, so the image is a function of (scene, settings, number of passes) and not of threads. Integrators
 * that have begin_block render blocks of pairs instead (blocks.h). The public face is in caustica.h (ca_render). */
#ifndef CA_RENDER_RENDER_H
#define CA_RENDER_RENDER_H

#include "base/reserve.h"
#include "film/film.h"
#include "integrator/integrator.h"
#include "noise/ray_numbers.h"
#include "render/ranks.h"

/* Where the numbers of light paths and camera paths come from. AUTO: chosen again and again (auto_rays.h); AUTO_ONCE:
 * before the first pass (rays_once.h); OF_RECORD: a file tells all that was decided in a render with AUTO
 * (auto_record.h). */
typedef enum ca_rays_source {
    CA_RAYS_OF_SETTINGS,
    CA_RAYS_AUTO,
    CA_RAYS_AUTO_ONCE,
    CA_RAYS_OF_FILE,
    CA_RAYS_OF_RECORD
} ca_rays_source;

/* Everything a render needs, resolved from scene and settings. */
typedef struct ca_render_plan {
    const ca_scene *scene;
    const ca_render_settings *settings;
    ca_camera camera;
    ca_filter filter;
    ca_sampler sampler;
    const ca_integrator_type *type;
    ca_integrator_input input; /* points into this plan: a plan is not copied */
    uint32_t crop[4];          /* x0, y0, x1, y1 */
    uint32_t camera_paths;     /* of a pixel in a pass, N_B */
    ca_rays_source rays;
    ca_method_statistics method; /* of integrator `auto`, once its method is chosen */
    char method_warning[CA_PREFLIGHT_WARNING_SIZE]; /* what is wrong with that; "": nothing is known */
    char *asked;                 /* owned while ca_render_plan_run runs: the settings before that; NULL: not `auto` */
    bool ended; /* the render was ended while that, or numbers of rays, were chosen: one pass is made, and not kept */
    ca_ray_objective objective; /* of numbers that are chosen */
    uint32_t first_pass; /* > 0: of a part that begins there */
    uint32_t pass_limit; /* the number of the pass to end before */
    bool open_ended; /* ends by time or noise; pass_limit is then the largest number that can be counted */
    uint32_t passes_per_replicate; /* 0: no number of replicates was asked for */
    uint64_t seed;                 /* as given; the sampler's changes from replicate to replicate */
    double
        samples_per_pass; /* what --spp counts: camera paths of a pixel; `light`: light paths per pixel of the film */
    uint32_t threads;
    ca_reserve *reserve; /* owned while ca_render_plan_run runs: for the image; opened after the last pass or block */

    /* Of integrators that render by blocks, instead of limits on passes. */
    uint64_t blocks[2];     /* half open; up to UINT64_MAX: no range was given */
    uint32_t block_samples; /* > 0: camera paths of a pixel after which to stop */
    ca_block_film_desc block_film;
} ca_render_plan;

/* Checks every setting, before any work. Errors: CA_ERROR_ARGUMENT, CA_ERROR_SCENE, CA_ERROR_UNSUPPORTED. */
ca_status ca_render_plan_make(ca_render_plan *plan, const ca_scene *scene, const ca_render_settings *settings,
                              ca_error *error);

/* Are there several films, which are joined with weights (auto_rays.h)? */
static inline bool ca_render_plan_joins(const ca_render_plan *plan)
{
    return plan->rays == CA_RAYS_AUTO || plan->rays == CA_RAYS_OF_RECORD;
}

/* Are numbers of rays chosen for this render? */
static inline bool ca_render_plan_chooses_rays(const ca_render_plan *plan)
{
    return plan->rays == CA_RAYS_AUTO || plan->rays == CA_RAYS_AUTO_ONCE;
}

static inline bool ca_render_plan_by_blocks(const ca_render_plan *plan) { return plan->type->begin_block != NULL; }

/* Of all ranks. */
static inline double ca_render_plan_threads(const ca_render_plan *plan)
{
    return (double)plan->threads * (plan->settings->ranks ? plan->settings->ranks->count : 1);
}

/* No coordinate of the scene is larger; > 0. */
float ca_render_plan_extent(const ca_render_plan *plan);

/* Of the rendered part. */
static inline double ca_render_plan_pixels(const ca_render_plan *plan)
{
    return (double)(plan->crop[2] - plan->crop[0]) * (double)(plan->crop[3] - plan->crop[1]);
}

/* Sets pass_limit and open_ended: the passes that the requested samples take with plan->samples_per_pass in each.
 * `most`: the largest number of camera paths of a pixel in a pass, which are numbered in 32 bits. Errors:
 * CA_ERROR_ARGUMENT. */
ca_status ca_render_plan_count_passes(ca_render_plan *plan, uint32_t most, ca_error *error);

/* After that, and once it is known how replicates are made: the passes that were asked for by their numbers. Errors:
 * CA_ERROR_ARGUMENT. */
ca_status ca_render_plan_take_range(ca_render_plan *plan, ca_error *error);

/* A type that was chosen may have another number of camera paths than the one that chose it, for which passes were
 * counted: counts them anew. Errors: CA_ERROR_ARGUMENT. */
ca_status ca_render_plan_recount(ca_render_plan *plan, ca_error *error);

/* Light paths get the memory that the film leaves: again, where it is another film than was planned. Errors:
 * CA_ERROR_ARGUMENT. */
ca_status ca_render_plan_memory(ca_render_plan *plan, ca_error *error);

/* Images of the strategies, where they are wanted: again, with a method that was chosen. Errors:
 * CA_ERROR_ARGUMENT. */
ca_status ca_render_plan_check_strategies(const ca_render_plan *plan, ca_error *error);

/* The passes that the render will make, where samples limit it; else a guess from its time, rather too high. */
double ca_render_plan_expected_passes(const ca_render_plan *plan);

/* Light paths of a pass from now on. */
ca_status ca_render_plan_set_light_paths(ca_render_plan *plan, uint32_t light_paths, ca_error *error);
/* Likewise camera paths of every pixel. */
ca_status ca_render_plan_set_camera_paths(ca_render_plan *plan, uint32_t camera_paths, ca_error *error);
/* One radius for all passes: alpha 0, where there is such a parameter. */
ca_status ca_render_plan_keep_radius(ca_render_plan *plan, ca_error *error);
/* Sets light paths. *fits: all of them fit the memory that is allowed at once, in one round. */
ca_status ca_render_plan_fits(ca_render_plan *plan, uint32_t light_paths, bool *fits, ca_error *error);

/* Is a parameter set by the scene, or in the settings' text "name:a=1,b=2"? */
bool ca_render_is_set(const ca_scene *scene, const char *integrator, const char *parameter);
/* By that text or by a setting of its own? */
bool ca_render_plan_is_asked(const ca_render_plan *plan, const char *parameter);
/* By any of the three? */
bool ca_render_plan_is_set(const ca_render_plan *plan, const char *parameter);

/* The parameters behind an integrator's name, "a=1,b=2" of "name:a=1,b=2"; NULL where there are none. */
const char *ca_render_overrides(const char *integrator);
/* Do they set `name`? */
bool ca_render_overrides_mention(const char *integrator, const char *name);

/* Noise and luminance of the image; and the memory of the process. */
void ca_render_summarise(const ca_film_summary *summary, ca_render_statistics *statistics);

/* Settings and timings travel with the picture. */
ca_status ca_render_attach_record(const ca_render_plan *plan, const ca_render_statistics *statistics,
                                  ca_image_layers *layers, ca_error *error);

/* Calls the progress callback, if there is one; false where the render should end. Its time is no rendering time:
 * *start, when the render began, is moved on by it. */
bool ca_render_tell(const ca_render_plan *plan, const ca_render_progress *progress, double *start);

/* Likewise while something is chosen, and there is nothing to show. `seconds` of the render so far. */
bool ca_render_tell_choosing(const ca_render_plan *plan, double seconds, double *start);

/* What snapshots have in common: CA_ERROR_ARGUMENT where there is nothing to make a picture of, or no place for it.
 * */
ca_status ca_render_check_snapshot(const ca_render_progress *progress, ca_image_layers **image, ca_error *error);

/* Refuses what ca_render refuses before its first pass, with the same error: a plan is made, and its integrator.
 * Costs what making the integrator takes. */
ca_status ca_render_check(const ca_scene *scene, const ca_render_settings *settings, ca_error *error);

/* Renders a plan; ca_render is this after ca_render_plan_make. */
ca_status ca_render_plan_run(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                             ca_error *error);

#endif
