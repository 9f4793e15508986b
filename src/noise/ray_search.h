/* The numbers of rays with the least variance x time for fixed weights: the search behind ray_numbers.h. Internal to
 * this folder.
 *
 * For a fixed N_F a pixel has a_p = w_p (interaction / N_F + camera), tau_p = t_B + N_F t_M, and all have
 * b = sum_p w_p light / N_F, T_0 = t_0 + N_F t_F. The minimum over real N_B(p) in [1, max] has N_B(p) = kappa
 * sqrt(a_p / tau_p), cut to that range, where
 *
 *     kappa^2 = (T_0 + times of the pixels that were cut) / (b + variances of the pixels that were cut):
 *
 * kappa^2 times the denominator less the numerator grows with kappa, so there is one such kappa; Newton's method in
 * kappa^2 within a bracket. Over N_F: a golden section in log N_F, in which the minimum is convex. */
#ifndef CA_NOISE_RAY_SEARCH_H
#define CA_NOISE_RAY_SEARCH_H

#include <stddef.h>
#include <stdint.h>

typedef struct ca_ray_term {
    double interaction, camera, light; /* variances Q, B, F >= 0 */
    double camera_time, merge_time;    /* t_B > 0, t_M >= 0 */
    double weight;                     /* w >= 0 */
    double a, tau, root;               /* at the N_F last looked at; root = sqrt(a / tau) */
} ca_ray_term;

/* Pixels; or one term that stands for all, whose variances are weighted sums and whose times are sums: one N_B for
 * all of them. */
typedef struct ca_ray_search {
    ca_ray_term *terms; /* owned by the caller */
    size_t count;
    double fixed_time, light_time; /* t_0, t_F */
    double min_light_paths, max_light_paths, max_camera_paths;
} ca_ray_search;

/* A point of the search. N_B(p) are those that kappa gives with N_F = map_light_paths. */
typedef struct ca_ray_point {
    double light_paths, map_light_paths, kappa;
    double variance, time;
} ca_ray_point;

static inline double ca_ray_cost(const ca_ray_point *point) { return point->variance * point->time; }

/* Over real numbers, N_F between two that lie within the limits. */
ca_ray_point ca_ray_search_relaxed(const ca_ray_search *search, double low, double high);
/* Over integers, from the minimum over real numbers on. */
ca_ray_point ca_ray_search_integers(const ca_ray_search *search, const ca_ray_point *relaxed);

/* A term's N_B at a point: over real numbers and over integers. After ca_ray_search_set. */
void ca_ray_search_set(const ca_ray_search *search, double light_paths);
double ca_ray_real_paths(const ca_ray_search *search, const ca_ray_term *term, double kappa);
uint32_t ca_ray_integer_paths(const ca_ray_search *search, const ca_ray_term *term, double kappa);

#endif
