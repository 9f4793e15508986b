/* What the sections of paper 004's figures share (Keller, Grünschloß, Droske, "Quasi-Monte Carlo Progressive Photon
 * Mapping"): renders, and statistics over repeated renders. All of it dies on errors with a message. */
#ifndef CA_BENCH_PAPER_004_H
#define CA_BENCH_PAPER_004_H

#include "paper_plot.h"
#include "paper_report.h"

enum { PAPER_THREADS = 2 };

/* ---- Renders --------------------------------------------------------------------------------------------------- */

typedef struct paper_job {
    const ca_scene *scene;
    const char *integrator, *sampler;
    uint32_t samples; /* per pixel; 0: the scene's */
    double seconds;   /* > 0: ... or until so much time is gone */
    uint64_t seed;
    uint32_t width, height; /* 0: the scene's */
    const uint32_t *crop;   /* NULL: all */
    uint32_t threads;       /* 0: PAPER_THREADS */
} paper_job;

typedef struct paper_picture {
    uint32_t width, height;
    double *luminance;       /* owned, row by row */
    ca_image_layers *layers; /* owned */
    ca_render_statistics statistics;
} paper_picture;

paper_picture paper_render(const paper_job *job);
void paper_release(paper_picture *picture);
/* Keeps a copy as PICTURES/name, if there is a folder. */
void paper_save(const paper_report *report, const paper_picture *picture, const char *name);

/* ---- Statistics ------------------------------------------------------------------------------------------------ */

/* Errors of repeated renders with different random numbers against a truth, over all pixels, relative to the truth's
 * mean. */
typedef struct paper_errors {
    double rmse; /* of a single render: root of bias^2 + deviation^2 */
    double bias; /* r.m.s. of the mean over all random numbers, less what noise adds to it; negative: the estimate of
                  * its square is */
    double bias_floor; /* a bias below it could be noise */
    double deviation;  /* r.m.s. over the pixels of the standard deviation */
} paper_errors;

/* Sums over repeats, pixel by pixel. */
typedef struct paper_repeats {
    size_t pixels;
    int count;
    double *sum, *sum_of_squares; /* owned */
} paper_repeats;

paper_repeats paper_repeats_start(size_t pixels);
void paper_repeats_add(paper_repeats *repeats, const double *luminance);
void paper_repeats_release(paper_repeats *repeats);
/* `noise`: standard deviation of the truth itself, r.m.s. over pixels, in its unit. `truth` NULL: the deviation
 * only. */
paper_errors paper_repeats_errors(const paper_repeats *repeats, const double *truth, double noise);

/* A picture's truth, as far as it is known. */
typedef struct paper_reference {
    double *luminance; /* owned */
    double noise;      /* its standard deviation, r.m.s. over pixels, from two halves */
    uint32_t width, height;
    size_t pixels;
} paper_reference;

/* The mean of two renders that differ in their seeds; job.samples: of each. */
paper_reference paper_render_reference(const paper_job *job);
/* Root of the mean square error of a render, less the truth's own noise, over the truth's mean. */
double paper_reference_error(const paper_reference *truth, const double *luminance);

/* log y = a + b log x by least squares, over the points with y > 0. */
typedef struct paper_fit {
    double offset, exponent;
    double error; /* standard error of the exponent */
} paper_fit;
paper_fit paper_fit_power(const double *x, const double *y, int count);

/* ---- Sections -------------------------------------------------------------------------------------------------- */

void paper_transport(paper_report *report);        /* figure 2 */
void paper_counter_examples(paper_report *report); /* figure 3, section 5 */
void paper_convergence(paper_report *report);
void paper_alpha(paper_report *report);         /* section 3.1 */
void paper_recomputation(paper_report *report); /* figure 4 */
void paper_samples_saved(paper_report *report);
void paper_balance(paper_report *report); /* sections 3.1 and 3.2: alpha and the first radius */
void paper_ratio(paper_report *report);   /* section 4.1: m_b : n_b */

#endif
