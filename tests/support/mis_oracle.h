/* The weights of a full path by brute force: every technique's density is written out on its own, in double
 * precision, from the whole path. Nothing is shared with src/path. */
#ifndef CA_TEST_MIS_ORACLE_H
#define CA_TEST_MIS_ORACLE_H

#include "support/random_paths.h"

/* Effective count of a merge at each vertex, [n]; 0 where none can be. */
void ca_oracle_reuse(const ca_reuse_rules *rules, const ca_full_path *path, double *reuse);

/* D_k: the first k vertices sampled from the camera, the others from the light. */
double ca_oracle_density(const ca_full_path *path, uint32_t k);

/* count * density of every technique; 0 where it is not allowed or impossible. splits [n + 1], merges [n]. */
void ca_oracle_techniques(const ca_mis_rules *rules, const ca_full_path *path, double *splits, double *merges);

/* (value)^beta over the sum of all of them. */
double ca_oracle_weight(const ca_mis_rules *rules, uint32_t n, const double *splits, const double *merges,
                        double value);

#endif
