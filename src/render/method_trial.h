/* A method tried on a small picture of the same scene: what its iterations take, and how noisy they are.
 *
 * The trial's picture is the plan's, rendered part included, with larger pixels. Light paths are fewer and the merge
 * radius is larger by the same factor, so that a merge finds as many photons and each technique has the same weight;
 * the radius is the mean one of the whole render. Camera paths are traced for CA_TRIAL_CELLS pixels at most, fewer
 * where each has very many, spread over the picture. They start from a part of a pixel that is as large as a pixel of
 * the render, since what changes within a pixel is noise. The trial's random numbers are its own: no sample of the
 * render has any part in the choice of its method.
 */
#ifndef CA_RENDER_METHOD_TRIAL_H
#define CA_RENDER_METHOD_TRIAL_H

#include "photon/radius_choice.h"
#include "render/method_choice.h"
#include "render/render.h"
#include "render/workers.h"

enum { CA_TRIAL_CELLS = 2048 };

/* The rendered part in cells, row by row, the same for all trials of a plan: a cell's camera paths go through the
 * pixel in its middle. */
typedef struct ca_trial_cells {
    uint32_t width, height;
} ca_trial_cells;

ca_trial_cells ca_trial_cells_of(const ca_render_plan *plan);
static inline size_t ca_trial_cell_count(const ca_trial_cells *cells) { return (size_t)cells->width * cells->height; }
/* The cell that has pixel (x, y) of the plan's full film. */
size_t ca_trial_cell_at(const ca_trial_cells *cells, const ca_render_plan *plan, uint32_t x, uint32_t y);

typedef struct ca_method_trial {
    ca_method method;
    ca_render_settings settings; /* the trial's plan points to it */
    ca_render_plan plan;
    double area, crop_pixels; /* of a pixel, in pixels of the render; the render's rendered part */
    double radius, alpha;     /* of the render's merges */
    ca_trial_cells cells;
    void *integrator; /* owned */
    ca_workers workers;
    /* Owned. Luminances without what is shown (ca_camera_path): of all cells in an iteration, one iteration after the
     * other; and the sums of what is shown, over iterations, of each cell. */
    float *samples;
    double *shown;
    size_t capacity;
    uint32_t iterations;
    double light_seconds, camera_seconds; /* of a processor, of the fastest but the first, which warms up */
} ca_method_trial;

/* N_F in a pass of the render. */
double ca_method_light_paths(const ca_method *method, const ca_render_plan *plan);

/* Methods that share a default merge radius. */
typedef enum ca_merging { CA_MERGING_PPM, CA_MERGING_BDPM, CA_MERGING_AND_CONNECTING, CA_MERGINGS } ca_merging;

/* Default merge radii of the render with the usual number of light paths (ca_integrator_resolve), and how merges blur
 * with these methods. */
typedef struct ca_method_radius {
    double radius;
    ca_radius_blur blur;
} ca_method_radius;

typedef struct ca_method_radii {
    ca_method_radius of[CA_MERGINGS];
} ca_method_radii;

/* Seconds that the whole render is expected to take; INFINITY: its passes end it. */
double ca_method_whole_seconds(const ca_render_plan *plan);
/* Of a processor, that the whole render is expected to take before it is known what an iteration takes. */
double ca_method_expected_seconds(const ca_render_plan *plan);
/* Iterations of the whole render, each of which takes so many seconds of a processor. */
double ca_method_passes(const ca_render_plan *plan, double seconds);

/* May light paths start where a guide says? Not where the settings say anything of it. */
bool ca_method_may_be_guided(const ca_render_plan *plan);

/* By the pilot of the radius, unless it is set. */
ca_status ca_method_find_radius(const ca_render_plan *plan, ca_merging merging, ca_method_radius *found,
                                ca_error *error);

/* Puts the method to use, with the parameters that the settings of `auto`, plan->type, name, as far as it has them.
 * `*chosen`: where plan->input.values would go; plan itself stays as it is. A radius that is not set is the same for
 * all numbers of light paths: methods that are compared blur alike. `radii` may be NULL: it is then left open.
 * Emission is guided where it may be, unless the method is unguided. */
ca_status ca_method_configure(const ca_method *method, const ca_render_plan *plan, const ca_method_radii *radii,
                              ca_integrator_input *chosen, ca_error *error);

/* A trial has one thread, and is not copied. `guide` outlives it, and serves where the method is guided; NULL: the
 * trial makes its own. After an error nothing is left to destroy. */
ca_status ca_method_trial_create(ca_method_trial *trial, const ca_render_plan *plan, const ca_method *method,
                                 const ca_method_radii *radii, const ca_emission_guide *guide, ca_error *error);
void ca_method_trial_destroy(ca_method_trial *trial);
/* One more iteration. */
ca_status ca_method_trial_run(ca_method_trial *trial, ca_error *error);

/* Of a processor, that an iteration of the render is expected to take; needs two iterations. */
double ca_method_trial_seconds(const ca_method_trial *trial);
/* Of a cell's luminance, over all iterations: of all light but what is shown, of its squares, and of what is
 * shown. */
double ca_method_trial_sum(const ca_method_trial *trial, size_t cell);
double ca_method_trial_squares(const ca_method_trial *trial, size_t cell);
double ca_method_trial_shown(const ca_method_trial *trial, size_t cell);
/* The mean over cells of weights[cell] times the variance of an iteration's luminance, without what is shown, which
 * all methods have (shown_light.h); needs two iterations. With a
 * `dot_square` values whose square times the weight is larger count as if it were that; INFINITY: none do. */
double ca_method_trial_variance(const ca_method_trial *trial, const double *weights, double dot_square);
/* A square times the weight that several values are over: of larger ones the trial has met too few to tell how often
 * they come. */
double ca_method_trial_dot_square(const ca_method_trial *trial, const double *weights);
/* Photons that the render's merges find in an iteration, of a pixel, in the mean; needs an iteration. */
double ca_method_trial_photons(const ca_method_trial *trial);
/* Where few were met there may have been so many: one more than the trial met. */
double ca_method_trial_most_photons(const ca_method_trial *trial);
/* The mean square of what the render's merges blur, relative to a pixel's light, in so many passes; 0: it does not
 * merge. Where connections find light, too, merges have weights, and blur no more than photons alone do. */
double ca_method_trial_blur(const ca_method_trial *trial, const ca_method_radii *radii, double passes);

#endif
