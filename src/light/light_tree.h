/* A tree over all lights that are at a finite place, to choose one for next event by what it may contribute at a
 * point: intensity over squared distance, by how the light and the receiver face each other.
 *
 * From the root down, the child is chosen in proportion to a bound of that over the child's lights (Conty Estevez and
 * Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", without their splitting). One number
 * serves all levels by inversion: numbers that are near each other choose lights that are. A node has eight children,
 * so that 10,000 lights are five or six levels, and their bounds lie component by component, to be computed together.
 *
 * Memory: 392 bytes a node, at most one node a light, mostly one for five. Immutable once made. */
#ifndef CA_LIGHT_LIGHT_TREE_H
#define CA_LIGHT_LIGHT_TREE_H

#include "light/light.h"

/* Who asks. */
typedef struct ca_light_receiver {
    ca_vec3 position;
    ca_vec3 normal; /* unit: light from behind it counts for nothing; zero: light from everywhere counts */
} ca_light_receiver;

enum { CA_LIGHT_TREE_WIDTH = 8 };

typedef struct ca_light_tree_node {
    float x[CA_LIGHT_TREE_WIDTH], y[CA_LIGHT_TREE_WIDTH], z[CA_LIGHT_TREE_WIDTH]; /* middle of the child's box */
    float radius2[CA_LIGHT_TREE_WIDTH];                                           /* of the sphere around the box */
    float axis_x[CA_LIGHT_TREE_WIDTH], axis_y[CA_LIGHT_TREE_WIDTH], axis_z[CA_LIGHT_TREE_WIDTH];
    float cos_normal[CA_LIGHT_TREE_WIDTH], sin_normal[CA_LIGHT_TREE_WIDTH]; /* of the normals' angle */
    float cos_emission[CA_LIGHT_TREE_WIDTH];
    float intensity[CA_LIGHT_TREE_WIDTH]; /* 0: no child */
    uint32_t child[CA_LIGHT_TREE_WIDTH];  /* node, or CA_LIGHT_TREE_LEAF + light */
    uint32_t parent, slot;                /* which child it is of which node; the root's is CA_NONE */
} ca_light_tree_node;

#define CA_LIGHT_TREE_LEAF 0x80000000u

typedef struct ca_light_tree {
    ca_light_tree_node *nodes; /* the root first */
    uint32_t node_count;
    uint32_t *leaf; /* [lights]: CA_LIGHT_TREE_WIDTH * node + slot, or CA_NONE for one that is not in the tree */
} ca_light_tree;

/* Over those of `count` prepared lights (less than 2^31) that are at a finite place. */
ca_status ca_light_tree_create(ca_light_tree *tree, const ca_light *lights, uint32_t count, ca_error *error);
void ca_light_tree_destroy(ca_light_tree *tree);

/* A light and its probability; CA_NONE with 0 where none of them can contribute. */
uint32_t ca_light_tree_sample(const ca_light_tree *tree, const ca_light_receiver *receiver, float u,
                              float *probability);
/* Of one that is in the tree; 0 for others. Agrees with the above but for rounding. */
float ca_light_tree_probability(const ca_light_tree *tree, const ca_light_receiver *receiver, uint32_t light);

#endif
