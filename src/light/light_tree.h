/* A tree over all lights that are at a finite place, to choose one for next event by what it may contribute at a
 * point: intensity over squared distance, by how the light and the receiver face each other.
 *
 * From the root down, the child is chosen in proportion to a bound of that over the child's lights (Conty Estevez and
 * Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", without their splitting). One number
 * serves all levels by inversion: numbers that are near each other choose lights that are. A node has eight children,
 * so that 10,000 lights are five or six levels, and their bounds lie component by component, to be computed together.
 *
 * Memory: 256 bytes a node, four cache lines; at most one node a light, mostly one for five. Immutable once made. */
#ifndef CA_LIGHT_LIGHT_TREE_H
#define CA_LIGHT_LIGHT_TREE_H

#include "light/light.h"

/* Who asks. */
typedef struct ca_light_receiver {
    ca_vec3 position;
    ca_vec3 normal; /* unit: light from behind it counts for nothing; zero: light from everywhere counts */
} ca_light_receiver;

enum { CA_LIGHT_TREE_WIDTH = 8 };

/* Two numbers in 32 bits are the upper halves of floats, the first in the upper bits, rounded so that the bound stays
 * one.
 *     radius   of the sphere around the child's box
 *     reach    least cosine to the axis with which there is light, seen from far away
 *     axis     of all normals
 *     spread   how much their angle to the axis may add to the cosine */
typedef struct ca_light_tree_node {
    _Alignas(64) float x[CA_LIGHT_TREE_WIDTH];
    float y[CA_LIGHT_TREE_WIDTH], z[CA_LIGHT_TREE_WIDTH]; /* middle of the child's box */
    float intensity[CA_LIGHT_TREE_WIDTH];                 /* 0: no child */
    uint32_t radius_reach[CA_LIGHT_TREE_WIDTH];
    uint32_t axis_xy[CA_LIGHT_TREE_WIDTH], axis_z_spread[CA_LIGHT_TREE_WIDTH];
    uint32_t child[CA_LIGHT_TREE_WIDTH]; /* node, or CA_LIGHT_TREE_LEAF + light */
} ca_light_tree_node;

#define CA_LIGHT_TREE_LEAF 0x80000000u

/* Where either can contribute, the tree's lights and those outside of it are asked with this probability at least:
 * nobody knows what is hidden. */
#define CA_LIGHT_LEAST_SHARE 0.125f

/* Instead of a light: one that is not in the tree. */
#define CA_LIGHT_TREE_OUTSIDE 0xfffffffeu

/* A child's place: CA_LIGHT_TREE_WIDTH * node + slot. */
typedef struct ca_light_tree {
    ca_light_tree_node *nodes; /* the root first */
    uint32_t node_count;
    uint32_t *parent; /* [node_count]: the place of each node; the root's is CA_NONE */
    uint32_t *leaf;   /* [lights]: the place of each light, or CA_NONE for one that is not in the tree */
    float outside;    /* irradiance, W m^-2, luminance, by the lights outside of the tree, about; 0: there are none.
                         Their share is this over the sum with what the tree's may bring. light_choice sets it */
} ca_light_tree;

/* Over those of `count` prepared lights (less than 2^31) that are at a finite place. */
ca_status ca_light_tree_create(ca_light_tree *tree, const ca_light *lights, uint32_t count, ca_error *error);
void ca_light_tree_destroy(ca_light_tree *tree);

/* A light and its probability; CA_LIGHT_TREE_OUTSIDE with that of all outside, and *u is the number within their
 * share; CA_NONE with 0 where none of them can contribute. */
uint32_t ca_light_tree_sample(const ca_light_tree *tree, const ca_light_receiver *receiver, float *u,
                              float *probability);

/* Many receivers that ask one light each. */
typedef struct ca_light_query {
    ca_light_receiver receiver;
    float u, probability;
    uint32_t light;
} ca_light_query;

/* The same, to the bit, for `count` queries. They go down together: the nodes of some are fetched while others are
 * computed. */
void ca_light_tree_sample_many(const ca_light_tree *tree, ca_light_query *queries, uint32_t count);

/* That the light is outside of the tree. */
float ca_light_tree_outside_probability(const ca_light_tree *tree, const ca_light_receiver *receiver);

/* Of one that is in the tree; 0 for others. Agrees with the above but for rounding. */
float ca_light_tree_probability(const ca_light_tree *tree, const ca_light_receiver *receiver, uint32_t light);

#endif
