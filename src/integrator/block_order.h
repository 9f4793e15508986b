/* In which order all pairs (block of camera paths, block of light paths) are visited, with direct access from a
 * block's number (Keller, Grünschloß, Droske, "Quasi-Monte Carlo Progressive Photon Mapping", section 4.1 and figure
 * 4). Internal to this folder. */
#ifndef CA_INTEGRATOR_BLOCK_ORDER_H
#define CA_INTEGRATOR_BLOCK_ORDER_H

#include <stdbool.h>
#include <stdint.h>

typedef struct ca_block_pair {
    uint64_t camera, light; /* i and j */
} ca_block_pair;

typedef struct ca_block_order {
    bool diagonal;                     /* figure 4a, else the rectangular order 4b */
    uint64_t camera_limit, light_limit; /* pairs are of i < camera_limit, j < light_limit; UINT64_MAX: no limit */
} ca_block_order;

/* Rectangular: squares [0, k] x [0, k] grow by one shell of 2 k + 1 blocks at a time, back and forth, so that from
 * one block to the next either i or j changes and the other stays. Behind a limit on one side lines along that side
 * follow, likewise. Diagonal: i + j grows; both change from block to block. `number` must be below the number of
 * pairs. */
ca_block_pair ca_block_pair_at(const ca_block_order *order, uint64_t number);

/* How many of the pairs before this one, from the first on, have the same i (in .camera), and the same j (in
 * .light). */
ca_block_pair ca_block_visits(const ca_block_order *order, uint64_t number);

/* Pairs in all; UINT64_MAX: without end. */
uint64_t ca_block_count(const ca_block_order *order);

/* Pairs with i < k and j < k, which are the first ones in the rectangular order. */
uint64_t ca_block_square(const ca_block_order *order, uint64_t k);

#endif
