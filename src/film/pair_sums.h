/* What the pairs of one pixel contribute in one iteration, and the estimators of the noise components made of it
 * (Ershov, Birukov, Voloboy, Galaktionov 2020, "Calculation of Noise Components for Bidirectional Path Tracing with
 * Photon Maps", equations 2, 3 and 5; for what one path finds alone and for connections docs/papers/000.md, sections
 * B and C).
 *
 * C_ij is the *whole* contribution of light path i to the pixel's luminance along camera path j: several merges of
 * the two are one pair, summed before it is squared; what camera path j finds alone is a part of C_ij for every i,
 * and what light path i brings alone a part of it for every j. Beside that camera path j may bring D_j by connections
 * to one light path of its own. The pixel's value in the iteration is the mean of C_ij over all N_F N_B pairs, plus
 * the mean of D_j. Halves are by parity of the indices.
 *
 *     ca_pair_sums_begin(sums, light_paths);
 *     for each camera path: ca_pair_sums_next_path(sums); add, add_alone, connect ...
 *     for each light path that has light alone: add_light_alone ...
 *     moments = ca_pair_sums_finish(sums);
 *
 * A table of the light paths that contribute to the pixel, by hashing; order of additions matters to the last bits,
 * so they come in the order of camera paths and photons. What is added waits in a short list while the memory fetches
 * its place in the table: 10 to 20 ns each. A pixel's end costs no more than its connections. State: 160 bytes for
 * each light path that contributes to the pixel with the most of them, at most, and 40 a camera path that connects.
 * Threads: one each. */
#ifndef CA_FILM_PAIR_SUMS_H
#define CA_FILM_PAIR_SUMS_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* One iteration's value and estimators, W sr^-1 m^-2 and its square. */
typedef struct ca_pair_moments {
    double value;  /* mean of C, plus mean of D */
    double pair;   /* (2): mean of C^2 */
    double camera; /* (3): mean over camera paths of the product of the two halves' means over light paths */
    double light;  /* (5): the other way round */
    /* Of connections, zero where there are none: */
    double connected;         /* mean of D */
    double connected_square;  /* mean of D^2 */
    double connected_pair;    /* mean over camera paths of D times C of the two that are connected */
    double connected_camera;  /* of D times the mean C of the camera path with all other light paths */
    double connected_light;   /* of D times the mean C of the connected light path with all other camera paths */
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
/* To D of the current camera path. It connects to one light path only, and no other of the pixel's connects to that
 * one. */
void ca_pair_sums_connect(ca_pair_sums *sums, uint32_t light_path, double luminance);
/* To all pairs of a light path, in any order; behind the last camera path. */
void ca_pair_sums_add_light_alone(ca_pair_sums *sums, uint32_t light_path, double luminance);
/* With one camera path there are no two halves of them, nor others: `light` is NAN, and `connected_light` too where
 * something is connected. */
ca_pair_moments ca_pair_sums_finish(ca_pair_sums *sums);

/* false after memory ran out since creation: then all moments are worthless. */
bool ca_pair_sums_complete(const ca_pair_sums *sums);

#endif
