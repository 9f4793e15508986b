/* What one block of pairs, of m camera paths of a pixel with n light paths, tells of the noise of an image made of
 * many such blocks: estimates without bias of the three variances in the law of all pairs (Ershov, Birukov, Voloboy,
 * Galaktionov 2020, "Calculation of Noise Components for Bidirectional Path Tracing with Photon Maps", equations 2, 3
 * and 5; docs/papers/000.md, "All pairs").
 *
 * C of a light path X and a camera path Y is L + f(X) + g(Y) + h(X, Y), parts that are not correlated. With the
 * estimators of pair_sums.h, of whose halves' means products estimate L^2:
 *
 *     camera   Var(g) = B - L^2   covariance, over camera paths, of the means over the two halves of the light paths
 *     light    Var(f) = F - L^2   covariance, over light paths, of the means over the two halves of the camera paths
 *     pair     Var(h)             C - F - Var(g)
 *
 * L^2 comes from the same halves, so that what the block's light paths happen to bring does not make the camera's
 * covariance noisy.
 *
 * Cost and state: those of pair_sums.h, as are the calls. Threads: one each. */
#ifndef CA_FILM_PAIR_COVARIANCES_H
#define CA_FILM_PAIR_COVARIANCES_H

#include "film/pair_sums.h"

/* W^2 sr^-2 m^-4; any of them may come out negative. And the part of C's mean, W sr^-1 m^-2, that light paths bring:
 * the rest camera paths find alone. */
typedef struct ca_pair_covariance {
    double camera, light, pair;
    double merged;
} ca_pair_covariance;

typedef struct ca_pair_covariances {
    ca_pair_sums *sums; /* owned */
    uint32_t light_paths, camera_paths;
    double light_halves[2], camera_halves[2]; /* of what merged: sums over the pairs of each half of either side */
    double alone_halves[2];                   /* of what camera paths found alone: over those of each half */
    uint8_t apart[64];                        /* workers' lie in an array, and write into no common cache line */
} ca_pair_covariances;

ca_status ca_pair_covariances_create(ca_pair_covariances *c, ca_error *error);
void ca_pair_covariances_destroy(ca_pair_covariances *c); /* zeroed is allowed */

/* A new block of a pixel, of so many light paths (>= 2). */
void ca_pair_covariances_begin(ca_pair_covariances *c, uint32_t light_paths);
void ca_pair_covariances_next_path(ca_pair_covariances *c);
void ca_pair_covariances_add(ca_pair_covariances *c, uint32_t light_path, double luminance);
void ca_pair_covariances_add_alone(ca_pair_covariances *c, double luminance);
/* Of two camera paths or more. false: memory ran out, and the estimates are worthless. */
bool ca_pair_covariances_finish(ca_pair_covariances *c, ca_pair_covariance *result);

#endif
