/* The three-term law of noise of bidirectional photon mapping (Ershov, Birukov, Voloboy, Galaktionov 2020,
 * "Calculation of Noise Components for Bidirectional Path Tracing with Photon Maps", equation 6):
 *
 *     V = (C - L^2) / (N_F N_B) + (1 - 1/N_F) (B - L^2) / N_B + (1 - 1/N_B) (F - L^2) / N_F
 *
 * is the variance of a pixel's luminance in one iteration of N_F light paths and N_B camera paths. C, B, F and L do
 * not depend on these numbers, so that they are estimated for some and predict the noise for any.
 *
 * Where camera paths of a pixel also connect to light paths of their own (docs/papers/000.md, section C), a fourth
 * term is added: the variance of what connections bring and twice its covariance with the rest. C, B and F are those
 * of the rest, without connections.
 *
 * Everything here is linear in the estimators and unbiased, L^2 too: it is estimated by products of different
 * iterations. So variances may come out negative where they are small; they stay so. Standard errors: by the delta
 * method, from the scatter of the iterations. Units: variances of luminance, W^2 sr^-2 m^-4. */
#ifndef CA_NOISE_COMPONENTS_H
#define CA_NOISE_COMPONENTS_H

#include "film/pair_film.h"

/* An estimate with its standard error. */
typedef struct ca_noise_value {
    double value, error;
} ca_noise_value;

/* What iterations measured at a pixel. */
typedef struct ca_noise_components {
    ca_noise_value luminance, luminance2; /* L, L^2 */
    ca_noise_value pair, camera, light;   /* C, B, F */
} ca_noise_components;

/* Of one iteration with some N_F, N_B: the law's terms, their sum; and, for the numbers that the iterations had, the
 * sample variance. */
typedef struct ca_noise_terms {
    ca_noise_value pair, camera, light; /* the first, second and third term */
    ca_noise_value predicted;           /* their sum */
    ca_noise_value measured;
    ca_noise_value connect; /* the fourth term, in `predicted` too; may be negative; 0 without connections */
} ca_noise_terms;

/* What the law multiplies C - L^2, B - L^2 and F - L^2 by. */
typedef struct ca_noise_factors {
    double pair, camera, light;
} ca_noise_factors;

ca_noise_factors ca_noise_factors_of(double light_paths, double camera_paths);

/* The law's coefficients alone, without errors; luminance and its square are L and L^2. */
typedef struct ca_noise_excess {
    double luminance, luminance2;
    double pair, camera, light; /* C - L^2, B - L^2, F - L^2 */
} ca_noise_excess;

/* From means over at least two iterations. */
ca_noise_excess ca_noise_excess_of(const ca_pair_means *means, uint32_t iterations);

/* From at least two iterations, without connections. */
ca_noise_components ca_noise_components_of(const ca_pair_pixel *pixel);
ca_noise_terms ca_noise_terms_of(const ca_pair_pixel *pixel, double light_paths, double camera_paths);
/* The same of a film's pixel, counted row by row, and its connections; these terms are NAN for more camera than light
 * paths. */
ca_noise_terms ca_noise_terms_at(const ca_pair_film *film, size_t pixel, double light_paths, double camera_paths);

/* Of a film of other numbers (ca_pair_film_add_others), for an iteration with these; without errors, which are NAN.
 * `measured` is that of the iterations that were made. */
ca_noise_terms ca_noise_terms_of_other(const ca_pair_film *film, uint32_t other, size_t pixel);

/* The law's coefficients where paths connect: the variance for any numbers is linear in them, and so are sums over
 * pixels. */
typedef struct ca_noise_coefficients {
    double pair, camera, light; /* C - L^2, B - L^2, F - L^2, of all that is not connected */
    double connected;           /* the variance of what one connection brings, */
    double connected_pair, connected_camera, connected_light; /* and its covariances with the rest */
} ca_noise_coefficients;

/* Of a film's pixel, by its own weights (`other` NULL) or those of one of its others. Two camera paths at least. */
ca_noise_coefficients ca_noise_coefficients_at(const ca_pair_film *film, const ca_pair_film *other, size_t pixel);
/* The same of a film of means, after at least two iterations, by its own weights. */
ca_noise_coefficients ca_noise_coefficients_of(const ca_pair_film *film, uint32_t iterations, size_t pixel);
/* sum += weight c; and sum moved by a share of the way to c. */
void ca_noise_coefficients_add(ca_noise_coefficients *sum, const ca_noise_coefficients *c, double weight);
void ca_noise_coefficients_mix(ca_noise_coefficients *sum, const ca_noise_coefficients *c, double share);
double ca_noise_variance(const ca_noise_coefficients *c, double light_paths, double camera_paths);

/* Averages over a rectangle of pixels of the full film, as the paper prints them: of the roots of variances, those
 * below zero taken as zero and their pixels counted; and of the variances themselves (ca_noise_summary of
 * caustica.h). What is not known is NAN. rect: x0, y0, x1, y1, within the film's part. */
ca_noise_summary ca_noise_summarise(const ca_pair_film *film, const uint32_t rect[4], double light_paths,
                                    double camera_paths);
ca_noise_summary ca_noise_summarise_other(const ca_pair_film *film, const uint32_t rect[4], uint32_t other);

#endif
