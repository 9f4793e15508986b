/* A method tried on a small picture of the same scene: what its iterations take, and how noisy they are.
 *
 * The trial's picture is the plan's, rendered part included, with about CA_TRIAL_PIXELS pixels at most, and 16
 * times as many of the film. Light paths are fewer and the merge radius is larger by the same factor, so that a
 * merge finds as many photons and each technique has the same weight; the radius is the mean one of the whole
 * render. Camera paths start from a part of a pixel that is as large as a pixel of the render, since what changes
 * within a pixel is noise. The trial's random numbers are its own: no sample of the render has any part in the
 * choice of its method. */
#ifndef CA_RENDER_METHOD_TRIAL_H
#define CA_RENDER_METHOD_TRIAL_H

#include "render/method_choice.h"
#include "render/pass.h"

enum { CA_TRIAL_PIXELS = 4096 };

typedef struct ca_method_trial {
    ca_method method;
    ca_render_settings settings; /* the trial's plan points to it */
    ca_render_plan plan;
    void *integrator; /* owned */
    ca_film film;
    ca_pass_runner runner;
    uint32_t iterations;
    double seconds; /* of a processor, of the fastest but the first, which warms up */
} ca_method_trial;

/* N_F in a pass of the render. */
double ca_method_light_paths(const ca_method *method, const ca_render_plan *plan);

/* Puts the method to use, with the parameters that the settings of `auto`, plan->type, name, as far as it has them.
 * `*chosen`: where plan->input.values would go; plan itself stays as it is. */
ca_status ca_method_configure(const ca_method *method, const ca_render_plan *plan, ca_integrator_input *chosen,
                              ca_error *error);

/* A trial has one thread, and is not copied. After an error nothing is left to destroy. */
ca_status ca_method_trial_create(ca_method_trial *trial, const ca_render_plan *plan, const ca_method *method,
                                 ca_error *error);
void ca_method_trial_destroy(ca_method_trial *trial);
/* One more iteration. */
ca_status ca_method_trial_run(ca_method_trial *trial, ca_error *error);

/* A place of the plan's film in the trial's, by pixels of the rendered part. */
size_t ca_method_trial_pixel(const ca_method_trial *trial, const ca_render_plan *plan, uint32_t x, uint32_t y);

/* Adds the sums of the trial's luminance, pixel by pixel. */
void ca_method_trial_add_sums(const ca_method_trial *trial, double *sums);
/* The mean over pixels of weights[pixel] times the variance of an iteration's luminance; needs two iterations. */
double ca_method_trial_variance(const ca_method_trial *trial, const double *weights);

#endif
