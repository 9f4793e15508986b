/* How many light paths and how many camera paths a pixel: what gives the least noise after a given time (the last
 * paragraph of section 3 of Ershov, Birukov, Voloboy, Galaktionov 2020, "Calculation of Noise Components for
 * Bidirectional Path Tracing with Photon Maps"; derived in docs/papers/000.md). Pure functions of estimates; nothing
 * is rendered.
 *
 * What is minimised is the variance of an iteration times its time, since iterations average:
 *
 *     sum_p w_p V_p x T,   V_p = Q_p / (N_F N_B(p)) + B_p / N_B(p) + F_p / N_F,
 *                          T   = t_0 + N_F t_F + sum_p N_B(p) (t_B(p) + N_F t_M(p)),
 *
 * the law of noise/components.h with its coefficients sorted: B_p = B - L^2 and F_p = F - L^2 are the variances of
 * what camera paths and light paths contribute each on their own, Q_p = C - B - F + L^2 that of their interaction.
 * Since none of the three can be negative the problem is convex in the logarithms of the numbers: it has one minimum,
 * and that is found.
 *
 * Noisy estimates. Q_p, B_p, F_p are averaged over boxes of `smoothing` pixels to each side (cut at the image's
 * border). One that is not positive then gets the average of the smaller box of 3 x 3 and 5 x 5 of these that is
 * positive; 0 where neither is. As this takes negative noise away, all of the image's are then scaled down to the sum
 * that the given ones had, which has no bias (to 0 where that is not positive). Positive estimates with `smoothing` 0
 * are taken as they are.
 *
 * Objectives, w_p:
 *     mean           1 / P, P the number of pixels
 *     relative       1 / P / (L^2 + delta), delta a hundredth of the image's mean L^2; L^2 smoothed like the others
 *     worst decile   1 / P' for the P' = ceil(P / 10) pixels with the largest V_p, 0 for the rest. Which these are
 *                    depends on the numbers: the weights are iterated (Frank and Wolfe's steps towards the largest
 *                    minimum), the best numbers met are kept. Real numbers come within some tenths of a percent of
 *                    the best; integers of a handful of pixels may lose a few percent.
 *
 * Where all L^2 are estimated as 0 or less, the relative objective has the weights of the mean.
 *
 * Integers: for a fixed N_F the best integer N_B(p) is the smallest n with n (n + 1) >= kappa^2 w_p a_p / tau_p for
 * some kappa, a_p = Q_p / N_F + B_p, tau_p = t_B + N_F t_M; kappa and N_F are improved in turns until neither
 * changes. 1 <= N_B <= max_camera_paths always.
 *
 * Units: V of luminance squared, W^2 sr^-2 m^-4; times in seconds of one processor or of the clock, all alike. */
#ifndef CA_NOISE_RAY_NUMBERS_H
#define CA_NOISE_RAY_NUMBERS_H

#include "base/status.h"

enum {
    CA_RAY_MOST_LIGHT_PATHS = 1 << 30,    /* of an iteration */
    CA_RAY_MOST_LIGHT_PATHS_HELD = 1 << 22, /* if no limit of memory is set: all are in memory at once */
    CA_RAY_MOST_CAMERA_PATHS = 4096,      /* of a pixel in an iteration: the default */
    CA_RAY_CHOICE_PIXEL_BYTES = 108,      /* what ca_ray_numbers_choose allocates for each pixel */
};

/* delta of the relative objective, over the image's mean L^2. */
#define CA_RAYS_RELATIVE_DELTA 0.01

/* Estimates of a pixel: noisy, negative where small. */
typedef struct ca_ray_pixel {
    double pair, camera, light, luminance2; /* C, B, F, L^2 */
    double camera_time; /* t_B > 0: of a camera path without its merges */
    double merge_time;  /* t_M >= 0: that a light path adds to a camera path */
} ca_ray_pixel;

typedef struct ca_ray_image {
    uint32_t width, height;
    const ca_ray_pixel *pixels; /* borrowed */
    double fixed_time;          /* t_0 >= 0: of an iteration */
    double light_time;          /* t_F > 0: of a light path, with sorting its photons */
} ca_ray_image;

typedef enum ca_ray_objective { CA_RAYS_MEAN, CA_RAYS_RELATIVE, CA_RAYS_WORST_DECILE } ca_ray_objective;

/* Their names; NULL behind the last one. */
const char *ca_ray_objective_name(size_t i);
/* "mean" (or NULL), "relative", "worst-decile"; else CA_ERROR_ARGUMENT. */
ca_status ca_ray_objective_find(const char *name, ca_ray_objective *objective, ca_error *error);

typedef struct ca_ray_settings {
    ca_ray_objective objective;
    uint32_t smoothing;                        /* pixels to each side; 0: none */
    uint32_t min_light_paths, max_light_paths; /* 0: 1 and CA_RAY_MOST_LIGHT_PATHS */
    uint32_t max_camera_paths; /* of a pixel; 0: CA_RAY_MOST_CAMERA_PATHS. 1 for ppm: N_F alone is chosen */
    uint32_t given_light_paths, given_camera_paths; /* the numbers that the gain compares with; 0: none */
} ca_ray_settings;

/* Numbers of rays and what is to be expected of an iteration with them. */
typedef struct ca_ray_choice {
    double light_paths;  /* N_F */
    double camera_paths; /* N_B, the mean over pixels */
    double variance;     /* sum_p w_p V_p */
    double time;         /* T, s */
} ca_ray_choice;

typedef struct ca_ray_numbers {
    uint32_t *camera_paths; /* owned; N_B(p), [width * height] */
    ca_ray_choice best;     /* with this map; N_F is an integer */
    ca_ray_choice relaxed;  /* the minimum over real numbers >= 1: no integers are better */
    ca_ray_choice uniform;  /* the best integers of one N_B for all pixels */
    ca_ray_choice given;    /* 0 without given numbers */
    double gain_over_given, gain_over_uniform; /* variance x time there over that of `best`; 1 where nothing is noisy,
                                                  NAN without given numbers */
} ca_ray_numbers;

/* Errors: CA_ERROR_ARGUMENT (no pixels, an estimate or a time that is not finite, a time out of its range, limits
 * that exclude all numbers), CA_ERROR_MEMORY. Cost: some ten sweeps over the image, some hundreds for the worst
 * decile (a tenth of a second and five seconds for 512 x 512 pixels). */
ca_status ca_ray_numbers_choose(ca_ray_numbers *numbers, const ca_ray_image *image, const ca_ray_settings *settings,
                                ca_error *error);
/* w_p from estimates of L^2 of [width * height] pixels, which are smoothed in place; of the worst decile those of the
 * mean. `weights` is as long and another array. */
void ca_ray_weights(uint32_t width, uint32_t height, uint32_t smoothing, ca_ray_objective objective,
                    double *luminance2, double *weights);
/* Makes these the best numbers: the same camera paths for so many pixels. Errors: CA_ERROR_MEMORY. */
ca_status ca_ray_numbers_use_uniform(ca_ray_numbers *numbers, const ca_ray_choice *uniform, size_t pixels,
                                     ca_error *error);
void ca_ray_numbers_destroy(ca_ray_numbers *numbers);

#endif
