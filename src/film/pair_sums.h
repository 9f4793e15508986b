/* What the pairs of one pixel contribute in one iteration, and the estimators of the noise components made of it (Ershov,
 * Birukov, Voloboy, Galaktionov 2020, "Calculation of Noise Components for Bidirectional Path Tracing with Photon Maps",
 * equations 2, 3 and 5).
 *
 * C_ij is the *whole* contribution of light path i to the pixel's luminance along camera path j: several merges of the two are one
 * pair, summed before it is squared; and what camera path j finds alone is a part of C_ij for every i. The pixel's value in the
 * iteration is the mean of C_ij over all N_F N_B pairs. Halves are by parity of the indices.
 *
 *     ca_pair_sums_begin(sums, light_paths);
 *     for each camera path: ca_pair_sums_next_path(sums); add, add_alone ...
 *     moments = ca_pair_sums_finish(sums);
 *
 * A table of the light paths that contribute to the pixel, by hashing; order of additions matters to the last bits, so they
 * come in the order of camera paths and photons. A pixel's end costs what it found. State: 40 bytes a light path that contributes,
 * twice that at most. Threads: one each. */
#ifndef CA_FILM_PAIR_SUMS_H
#define CA_FILM_PAIR_SUMS_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* One iteration's value and estimators, W sr^-1 m^-2 and its square. */
typedef struct ca_pair_moments {
    double value;  /* mean of C */
    double pair;   /* (2): mean of C^2 */
    double camera; /* (3): mean over camera paths of the product of the two halves' means over light paths */
    double light;  /* (5): the other way round */
} ca_pair_moments;

typedef struct ca_pair_sums ca_pair_sums;

ca_status ca_pair_sums_create(ca_pair_sums **sums, ca_error *error);
void ca_pair_sums_destroy(ca_pair_sums *sums); /* NULL is allowed */

/* A new pixel, in an iteration of so many light paths (>= 2). */
void ca_pair_sums_begin(ca_pair_sums *sums, uint32_t light_paths);
void ca_pair_sums_next_path(ca_pair_sums *sums);
/* To the pair of the current camera path and a light path, numbered from 0 within the iteration. */
void ca_pair_sums_add(ca_pair_sums *sums, uint32_t light_path, double luminance);
/* To all pairs of the current camera path. */
void ca_pair_sums_add_alone(ca_pair_sums *sums, double luminance);
/* With one camera path there are no two halves of them: `light` is NAN. */
ca_pair_moments ca_pair_sums_finish(ca_pair_sums *sums);

/* false after memory ran out since creation: then all moments are worthless. */
bool ca_pair_sums_complete(const ca_pair_sums *sums);

#endif
