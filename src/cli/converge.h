/* What the pieces of `caustica converge` share: the plan of its renders, what is known of those that are done, and
 * what is drawn from them.
 *
 * A render is one integrator at one step (samples per pixel, or seconds) and one repeat. Renders are made step by
 * step, all integrators at each, so that steps are complete when a run ends early; everything that is written is
 * about complete steps. Each render has random numbers of its own but for the integrator: errors of different steps
 * and repeats are independent.
 *
 * A render's EXR carries all that its image depends on (attribute caustica.converge), so it is its own record: where
 * the text is that of the present settings the file is taken, else it is rendered again. */
#ifndef CA_CLI_CONVERGE_H
#define CA_CLI_CONVERGE_H

#include "cli/options.h"
#include "cli/stats_json.h"
#include "report/power_fit.h"

#include <stdio.h>

/* ---- Metrics --------------------------------------------------------------------------------------------------- */

typedef enum ca_converge_metric {
    CA_CONVERGE_RMSE,
    CA_CONVERGE_MAE,
    CA_CONVERGE_RELMSE,
    CA_CONVERGE_SMAPE,
    CA_CONVERGE_SSIM,
    CA_CONVERGE_FLIP_LDR,
    CA_CONVERGE_FLIP_HDR,
    CA_CONVERGE_METRICS,
} ca_converge_metric;

typedef struct ca_converge_metric_text {
    const char *key;   /* as `compare --stats` calls it */
    const char *error; /* what falls when an image converges: the metric itself, or "1 - SSIM" */
    bool plotted;
} ca_converge_metric_text;

extern const ca_converge_metric_text ca_converge_metric_texts[CA_CONVERGE_METRICS];

/* ---- The plan -------------------------------------------------------------------------------------------------- */

typedef struct ca_converge_options {
    const char *scene, *reference, *folder, *spp, *time;
    ca_text_list integrators, defines;
    ca_render_settings settings; /* without integrator, samples, seconds */
    uint32_t resolution[2], roi[4], repeats;
    ca_rect_list masks, closeups;
    double exposure;
    bool has_roi, has_exposure, quiet, help;
} ca_converge_options;

typedef struct ca_converge_integrator {
    const char *text; /* "ovcm:max_depth=8" */
    const char *name; /* of its files: "ovcm-1f0a93c2", "path" */
    bool is_looked_at; /* what its pictures lack has been said */
    bool is_warned_of; /* that the light of what `auto` chose will be dots has been said */
} ca_converge_integrator;

typedef struct ca_converge_render {
    size_t integrator, step, repeat;
    uint64_t seed;
    const char *file; /* below the folder: "renders/path-16spp-1.exr" */
    const char *path;
    const char *key;  /* all that the image depends on, lines "name value" */
    bool kept;        /* not rendered by this run */
    const char *method; /* that made it, "vavcm:max_depth=8,...": what `auto` chose, or the integrator */
    double seconds, samples_per_pixel, iterations;
    double
        deviation; /* standard deviation of one iteration's pixel luminance, averaged over pixels; NAN: not known */
    double mean_luminance;
    double metrics[CA_CONVERGE_METRICS];
} ca_converge_render;

typedef struct ca_converge {
    const ca_converge_options *options;
    ca_scene *scene;
    ca_image_layers *reference;
    ca_converge_integrator *integrators;
    size_t integrator_count;
    double *steps;
    size_t step_count;
    bool by_time;              /* steps are seconds, not samples */
    size_t repeats;
    ca_compare_settings region;
    ca_metric_settings metrics;
    ca_pixel_rect *closeups;   /* one at least, once there are renders */
    size_t closeup_count;
    ca_converge_render *renders; /* [(step * integrators + integrator) * repeats + repeat] */
    size_t render_count;
    size_t renders_done;       /* the first ones */
    size_t steps_done;
    double *fit_x, *fit_y;     /* scratch for one integrator's renders */
    double reference_noise[2]; /* what the reference's own noise adds to RMSE (as its square's root) and relMSE; NAN:
                                  not known */
    ca_status written;         /* of renders whose files could not be written: the last one's failure */
    ca_error failure;
    ca_arena memory;           /* of all the above but scene and reference */
} ca_converge;

/* Everything but the work: reads scene and reference, and checks every setting of every render, so that no hour is
 * lost to a typing error. Makes the folders. To be destroyed also on failure. Errors: of the command line
 * CA_ERROR_ARGUMENT. */
ca_status ca_converge_open(ca_converge *c, const ca_converge_options *options, ca_error *error);
void ca_converge_destroy(ca_converge *c);

const ca_converge_render *ca_converge_at(const ca_converge *c, size_t step, size_t integrator, size_t repeat);
/* "16 spp", "0.5 s" */
void ca_converge_step_text(const ca_converge *c, size_t step, char *text, size_t size);
/* FOLDER/format...; in c->memory; NULL: out of memory. */
const char *ca_converge_path(ca_converge *c, const char *format, ...) CA_PRINTF(2, 3);
/* Likewise: the picture NAMEsuffix, or one of its close-ups, which are counted from 1; 0: the whole. */
const char *ca_converge_picture_path(ca_converge *c, const char *name, const char *suffix, size_t closeup);

/* Has `auto` chosen the method that made it? */
bool ca_converge_chosen(const ca_converge *c, const ca_converge_render *render);

/* The settings that this render has. */
ca_render_settings ca_converge_settings(const ca_converge *c, const ca_converge_render *render);

/* ---- The renders ----------------------------------------------------------------------------------------------- */

/* Makes what is missing and measures all. Ends after a render in which a signal came: renders_done then says how
 * far. */
ca_status ca_converge_render_all(ca_converge *c, ca_error *error);

/* ---- What comes of them: once a step is complete --------------------------------------------------------------- */

/* 0 for a perfect image. */
double ca_converge_error(const ca_converge_render *render, ca_converge_metric metric);

/* A mean over repeats with half of its 95 % interval, NAN where there is one repeat. */
typedef struct ca_converge_mean {
    double seconds, samples, error, half_width;
} ca_converge_mean;
ca_converge_mean ca_converge_mean_of(const ca_converge *c, size_t step, size_t integrator, ca_converge_metric metric);

/* Over all renders of an integrator; over seconds, or samples per pixel. */
ca_power_fit ca_converge_fit(const ca_converge *c, size_t integrator, ca_converge_metric metric, bool over_time);

/* The render nearest to equal time: the last step's by time, else the one nearest to where the fastest integrator
 * ends. */
const ca_converge_render *ca_converge_equal_time(const ca_converge *c, size_t integrator);
/* When that is. */
double ca_converge_equal_seconds(const ca_converge *c);

/* sigma of the last step's renders of an integrator, averaged over repeats; NAN: not known. */
double ca_converge_deviation(const ca_converge *c, size_t integrator, double *seconds_per_iteration);

/* Writes a text file below the folder, complete or not at all. */
typedef ca_status (*ca_converge_put)(const ca_converge *c, FILE *stream, ca_error *error);
ca_status ca_converge_write(ca_converge *c, const char *file, ca_converge_put put, ca_error *error);

ca_status ca_converge_put_csv(const ca_converge *c, FILE *stream, ca_error *error);
ca_status ca_converge_put_json(const ca_converge *c, FILE *stream, ca_error *error);
ca_status ca_converge_put_time_plot(const ca_converge *c, FILE *stream, ca_error *error);
ca_status ca_converge_put_samples_plot(const ca_converge *c, FILE *stream, ca_error *error);
ca_status ca_converge_put_page(const ca_converge *c, FILE *stream, ca_error *error); /* beside the pictures */

/* "-0.51 ± 0.03"; "" where there is no fit. */
void ca_converge_fit_text(const ca_power_fit *fit, char *text, size_t size);

/* Chooses a close-up where none was asked for; writes pictures/. */
ca_status ca_converge_write_pictures(ca_converge *c, ca_error *error);
/* The page of the comparison, images.html: the last step, and equal time where that is another one. */
ca_status ca_converge_write_images_page(ca_converge *c, ca_error *error);

#endif
