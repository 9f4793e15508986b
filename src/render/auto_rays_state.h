/* What the pieces of a render with rays "auto" share: auto_rays.c (from beginning to end), auto_rays_settings.c,
 * auto_rays_pilot.c, auto_rays_run.c (a trial, the validation run, a phase), auto_rays_choice.c (from estimates to
 * numbers), auto_rays_batch.c (iterations), auto_rays_image.c (joining), auto_rays_keep.c (checkpoints). What is
 * decided is not in them: auto_pilot_plan.h, auto_plan.h. */
#ifndef CA_RENDER_AUTO_RAYS_STATE_H
#define CA_RENDER_AUTO_RAYS_STATE_H

#include "render/auto_known.h"
#include "render/auto_nodes.h"
#include "render/auto_pilot_plan.h"
#include "render/auto_plan.h"
#include "render/auto_rays.h"
#include "render/auto_record.h"
#include "render/checkpoint.h"
#include "render/pass.h"

/* Numbers of paths that iterations have. */
typedef struct ca_auto_numbers {
    uint32_t light_paths;   /* N_F */
    uint32_t *camera_paths; /* owned; N_B(p); where paths connect the same of all pixels */
    uint32_t most;          /* the largest N_B(p) */
    double mean;            /* of N_B(p) */
} ca_auto_numbers;

/* Where the next iteration's paths are numbered from: all paths of a render have numbers of their own. */
typedef struct ca_auto_numbering {
    uint64_t light_path;
    uint32_t *camera_path; /* owned; of each pixel */
    double largest;        /* that a camera path can have so far */
} ca_auto_numbering;

/* A trial, the validation run or a phase at work. */
typedef struct ca_auto_work_film {
    const ca_auto_run *run;
    ca_film film;                          /* its samples */
    ca_pair_film pairs;                    /* of runs that measure */
    double passes_before;                  /* precision of all before it, in its iterations, as PREDICT has told */
    uint32_t iterations, gathering, plain; /* so far; those that gathered pairs; those that were timed without */
    double seconds, plain_seconds;         /* of the clock: all iterations; plain ones */
} ca_auto_work_film;

/* What is made of one half's samples alone, in the pilot. */
typedef struct ca_auto_half {
    ca_film film;       /* of the group at work: the ramp, then ordinary iterations */
    ca_pair_film pairs; /* of ordinary iterations */
    ca_ray_times *times;
    double plain_seconds; /* of the clock, of ordinary iterations that gathered no pairs ... */
    uint32_t plain;       /* ... and how many these are */
    uint32_t gathering;   /* the others */
} ca_auto_half;

typedef struct ca_auto_pilot {
    ca_auto_half halves[CA_PILOT_HALVES];
    double seconds; /* of its last iteration */
} ca_auto_pilot;

/* Where a render is when it is kept: after whole iterations of the ramp, which come by twos, of the pilot's ordinary
 * ones or of a run. */
typedef enum ca_auto_stage { CA_AUTO_AT_RAMP, CA_AUTO_AT_ORDINARY, CA_AUTO_AT_RUN } ca_auto_stage;

typedef struct ca_auto_place {
    ca_auto_stage stage;
    ca_auto_pilot *pilot;      /* borrowed; of the first two stages */
    ca_auto_work_film *work;   /* borrowed; of the third */
    const ca_workers *workers; /* borrowed; whose counts are not in those of the render yet; NULL: nobody's */
} ca_auto_place;

/* What a checkpoint had when the render began, until the stage that it belongs to goes on with it. */
typedef struct ca_auto_resumed {
    ca_auto_stage stage;
    ca_auto_pilot pilot;
    ca_auto_work_film work;
} ca_auto_resumed;

typedef struct ca_auto_kept {
    ca_checkpoint checkpoint;
    char *settings, *choices; /* owned; what a file must have, too: of the image; of what decides */
    char *method;             /* owned; kept_method.h */
    ca_auto_resumed *resumed; /* owned; NULL: nothing is left to go on with */
    uint32_t iterations;      /* that were in the checkpoint */
} ca_auto_kept;

typedef struct ca_auto_rays {
    ca_render_plan *plan;
    const ca_auto_observer *observer;
    ca_film frame; /* size and place of all films here; no pixels */
    ca_auto_goal goal;
    ca_auto_progress progress;
    uint32_t look_iterations; /* done when progress.looks.noise was estimated */
    double look_seconds;      /* then */
    double start; /* by the clock; time in which the caller is told does not count */
    bool chooses_only; /* the numbers are all that is wanted (ca_auto_rays_choose), for: */
    double samples_wanted; /* all still to be made; 0: their number does not end the render */
    bool interrupted;
    bool ended_early;  /* an iteration failed or was stopped: the image is of those before it */
    ca_status failure; /* of it; CA_OK: stopped */

    ca_auto_numbers numbers; /* in use */
    ca_auto_numbering next;
    uint32_t iterations, render_iterations, runs; /* so far; beside the pilot's; trials, validation, phases */
    ca_render_statistics counts;                  /* of workers that are gone */

    /* The pilot: from its settings, and what is left of it. */
    ca_pilot_numbers pilot_settings;
    bool given; /* did the user give these? */
    ca_pilot_group ramp, ordinary;
    ca_halved_film pilot;
    ca_pilot_verdict verdicts[CA_PILOT_HALVES];
    double pilot_seconds, pilot_work;

    /* What is known, from the pilot's end on. */
    ca_auto_known *known;  /* owned; of each pixel; NULL where paths connect */
    ca_auto_nodes nodes;   /* owned; where paths connect */
    ca_ray_times *times;   /* owned */
    double plain_seconds;  /* of the clock, of an iteration with the numbers in use that gathers no pairs */
    ca_ray_costs costs;    /* that the last choice was made with */
    double predicted_gain; /* of the numbers in use over the pilot's */

    ca_emission_guide *guide; /* owned; of all iterations; NULL: light paths are not guided */
    ca_auto_situation situation; /* before the step at work, which is: */
    ca_auto_decision decision;
    ca_joined_film render;   /* sum of runs that are done, each times its share */
    double shares;           /* sum of these */
    ca_auto_work_film *work; /* borrowed; NULL: no run is at work */

    ca_auto_kept kept;
    ca_auto_record record; /* of this render; of a render that is kept alone */
    ca_auto_record script; /* that decides instead of the planners; empty: they do */
    uint32_t script_next;  /* its next group */
} ca_auto_rays;

static inline size_t ca_auto_pixels(const ca_auto_rays *a) { return (size_t)a->frame.width * a->frame.height; }
/* Do weights contain the numbers of paths? All pixels then have the same N_B. */
static inline bool ca_auto_connects(const ca_auto_rays *a)
{
    return ca_integrator_has(a->plan->type, CA_ABILITY_CONNECTION_NOISE);
}
static inline bool ca_auto_one_camera_path(const ca_auto_rays *a) { return a->pilot_settings.camera_paths == 1; }
static inline bool ca_auto_is_kept(const ca_auto_rays *a) { return a->kept.checkpoint.path != NULL; }

/* Of a render that repeats a record: its group at work or to come; NULL: it decides for itself, or there is none. */
static inline const ca_auto_group *ca_auto_script_group(const ca_auto_rays *a)
{
    return a->script_next < a->script.count ? &a->script.groups[a->script_next] : NULL;
}
static inline bool ca_auto_repeats(const ca_auto_rays *a) { return a->script.count > 0; }

/* ---- Settings -------------------------------------------------------------------------------------------------- */

/* The goal and the pilot's numbers; refuses what cannot be, before any work. */
ca_status ca_auto_read_settings(ca_auto_rays *a, ca_error *error);

/* ---- Iterations ------------------------------------------------------------------------------------------------ */

/* Iterations with the numbers in use. Not copied: the integrator points into it. */
typedef struct ca_auto_batch {
    void *integrator;
    ca_pass_runner runner;
    ca_pass_counts counts;
    ca_pair_film gathered; /* what the integrator fills; its means are those of the film that is given to it */
    ca_pair_moments *held[CA_AUTO_MOST_OTHERS]; /* owned; of an iteration, likewise gathered.made; NULL: not held */
    bool prepared; /* what is made once was made */
    uint32_t passes;
} ca_auto_batch;

/* `film` and `pairs`: any of those that it is run with; NULL: it gathers none. `done`: iterations of the batch that
 * were in a checkpoint. */
ca_status ca_auto_batch_begin(ca_auto_rays *a, ca_auto_batch *batch, ca_film *film, const ca_pair_film *pairs,
                              uint32_t done, ca_error *error);
/* One more iteration; `pairs` and `times` may be NULL. *seconds: of the clock. One that fails leaves film and counts
 * as they were; the pairs, from which nothing is learned any more, may be incomplete. */
ca_status ca_auto_batch_run(ca_auto_rays *a, ca_auto_batch *batch, ca_film *film, ca_pair_film *pairs,
                            ca_ray_times *times, double *seconds, ca_error *error);
/* The only iteration of the batch so far is not used: its numbers and paths do not count. */
void ca_auto_batch_drop(ca_auto_rays *a, ca_auto_batch *batch);
/* Also after an error in a call of the others. */
void ca_auto_batch_end(ca_auto_rays *a, ca_auto_batch *batch);

/* The render ends with what it has, since an iteration has failed: with this status, or it was stopped. */
void ca_auto_end_early(ca_auto_rays *a, ca_status status);
/* The same of a step between iterations, if there are enough of them for an image: else its status. */
ca_status ca_auto_survive(ca_auto_rays *a, ca_status status);

/* Tells the caller how far the render is; asks whether it goes on. */
void ca_auto_report(ca_auto_rays *a);

/* ---- What is known --------------------------------------------------------------------------------------------- */

/* A film of means for iterations with these numbers; where paths connect, with the weights of others, too. */
ca_status ca_auto_pairs_create(const ca_auto_rays *a, uint32_t light_paths, uint32_t camera_paths,
                               ca_pair_film *pairs, ca_error *error);
/* Nothing is known yet, at the pilot's end. */
ca_status ca_auto_known_create(ca_auto_rays *a, ca_error *error);
void ca_auto_forget(ca_auto_rays *a);
/* What iterations with the numbers in use have gathered. */
void ca_auto_learn(ca_auto_rays *a, const ca_pair_film *pairs, uint32_t iterations);

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

typedef struct ca_auto_choice {
    ca_ray_numbers numbers;
    ca_auto_candidate candidate;
    ca_ray_costs costs;
} ca_auto_choice;

/* What a choice is made from, beside a->known. */
typedef struct ca_auto_basis {
    const ca_ray_times *times;
    double plain_seconds;      /* of the clock, of an iteration with the numbers in use */
    ca_auto_progress progress; /* as far as the choice may know it */
} ca_auto_basis;

ca_status ca_auto_choose(ca_auto_rays *a, const ca_auto_basis *basis, const ca_auto_limits *limits,
                         ca_auto_choice *choice, ca_error *error);
void ca_auto_choice_destroy(ca_auto_choice *choice);
/* Puts a choice's numbers, given ones, or the same for all pixels, to use. */
void ca_auto_use(ca_auto_rays *a, const ca_auto_choice *choice);
void ca_auto_use_map(ca_auto_rays *a, uint32_t light_paths, const uint32_t *camera_paths);
void ca_auto_use_uniform(ca_auto_rays *a, ca_pilot_numbers numbers);
void ca_auto_use_group(ca_auto_rays *a, const ca_auto_group *group);

/* ---- Stages ---------------------------------------------------------------------------------------------------- */

/* Its iterations; and, if the render goes on, what they tell: weights, times, a->known. */
ca_status ca_auto_pilot_run(ca_auto_rays *a, ca_error *error);

/* One that has nothing yet; one that is empty may be destroyed. */
ca_status ca_auto_pilot_create(const ca_auto_rays *a, ca_auto_pilot *pilot, ca_error *error);
/* For its ordinary iterations, whose numbers are known. */
ca_status ca_auto_pilot_create_pairs(const ca_auto_rays *a, ca_auto_pilot *pilot, ca_error *error);
void ca_auto_pilot_destroy(ca_auto_pilot *pilot);

/* The film of a run, and its pairs if it measures. */
ca_status ca_auto_work_create(const ca_auto_rays *a, ca_auto_work_film *work, ca_error *error);
void ca_auto_work_destroy(ca_auto_work_film *work);

/* A run with the numbers in use becomes a part of R, and what it gathered joins what is known. */
ca_status ca_auto_run_do(ca_auto_rays *a, const ca_auto_run *run, double passes_before, ca_auto_outcome *outcome,
                         ca_error *error);

/* ---- Checkpoints and records ----------------------------------------------------------------------------------- */

/* Locks the checkpoint, and reads what is in it where the render goes on; or the record that is repeated. */
ca_status ca_auto_keep_start(ca_auto_rays *a, ca_error *error);
void ca_auto_keep_end(ca_auto_rays *a);
/* A group of iterations with the numbers in use begins: notes it, if the render is kept. */
ca_status ca_auto_keep_group(ca_auto_rays *a, ca_auto_group_kind kind, bool measures, ca_error *error);
/* After so many iterations of the group: writes the checkpoint if it is due. */
void ca_auto_keep(ca_auto_rays *a, const ca_auto_place *place, uint32_t iterations);
/* The same before the last group is joined; `early`: the render was ended before its time. */
void ca_auto_keep_last(ca_auto_rays *a, const ca_auto_place *place, uint32_t iterations, bool early);

/* The file of a checkpoint (auto_file.c). The record's last group is the one at work; place->work or place->pilot,
 * which are empty, are filled when one is read. */
ca_status ca_auto_file_write(ca_auto_rays *a, const ca_auto_place *place, const char *path, ca_error *error);
ca_status ca_auto_file_read(ca_auto_rays *a, ca_auto_place *place, const char *path, ca_error *error);
/* Reads the record of a file alone, into a->script. Errors: CA_ERROR_FILE, CA_ERROR_FORMAT, CA_ERROR_MEMORY;
 * CA_ERROR_ARGUMENT where the settings differ or there is no image in it. */
ca_status ca_auto_script_read(ca_auto_rays *a, const char *path, ca_error *error);

/* w_A, w_B of auto_rays.h, as they are now. */
void ca_auto_weights(const ca_auto_rays *a, double weights[CA_PILOT_HALVES]);
/* The share in R of the run at work if it ended now. */
double ca_auto_share_at_work(const ca_auto_rays *a, const ca_auto_run *run);

/* ---- The image ------------------------------------------------------------------------------------------------- */

/* Looks at the noise of the image so far, for progress.looks, too: percent; NAN: not known. After the pilot. */
double ca_auto_look(ca_auto_rays *a);
/* The same in the pilot, from the ordinary iterations' films. */
double ca_auto_look_in_pilot(ca_auto_rays *a, const ca_film *films);

/* ca_render_progress.snapshot, while a run is at work. */
ca_status ca_auto_snapshot(const ca_render_progress *progress, ca_image_layers **image,
                           ca_render_statistics *statistics, ca_error *error);
/* The numbers in use, and how they were chosen. */
void ca_auto_tell_numbers(const ca_auto_rays *a, ca_rays_statistics *told);
/* The render's image; frees what it is made of. */
ca_status ca_auto_finish(ca_auto_rays *a, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error);

#endif
