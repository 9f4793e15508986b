/* What iterations with rays "auto" have told of the noise where paths connect and weights contain N_F: sums over the
 * image of the law's coefficients (noise/components.h) with the weights of several numbers of light paths, the nodes
 * of noise/connected_numbers.h. Nodes are powers of 4 times the pilot's number, so that whatever a run gathers joins
 * those of the runs before: each weighs its paths anew for the nodes within a factor of 16 of its own number. Each
 * iteration counts for its N_F N_B pairs of paths.
 *
 * Weights with another N_B are taken as those that a run had: N_B is in the weights of splats only.
 *
 * A pixel's weight in the objective is fixed by the first that is added: nodes are sums with the same weights.
 *
 * State: 16 bytes a pixel. */
#ifndef CA_RENDER_AUTO_NODES_H
#define CA_RENDER_AUTO_NODES_H

#include "noise/connected_numbers.h"
#include "render/auto_known.h"

enum { CA_AUTO_MOST_NODES = 24, CA_AUTO_MOST_OTHERS = 4 };

typedef struct ca_auto_node {
    double light_paths, pairs; /* N_F; pairs of paths that its sums are made of */
    ca_noise_coefficients mean, objective;
} ca_auto_node;

typedef struct ca_auto_nodes {
    double first;    /* N_F of the pilot */
    size_t pixels;
    double *weights; /* owned; w_p, once something was added */
    double *plane;   /* owned; for making these */
    bool weighted;
    ca_auto_node items[CA_AUTO_MOST_NODES]; /* by ascending numbers of light paths */
    uint32_t count;
    double luminance, pairs; /* mean over the image; pairs of paths that it is made of */
} ca_auto_nodes;

ca_status ca_auto_nodes_create(ca_auto_nodes *nodes, size_t pixels, double first, ca_error *error);
void ca_auto_nodes_destroy(ca_auto_nodes *nodes);
/* Nothing is known any more. */
void ca_auto_nodes_clear(ca_auto_nodes *nodes);

/* The numbers, but for its own, that a run of these weighs its paths for; how many. */
uint32_t ca_auto_nodes_others(double first, uint32_t light_paths, uint32_t camera_paths,
                              ca_pair_numbers others[CA_AUTO_MOST_OTHERS]);

/* Adds what was gathered with others as these. A single iteration tells nothing, nor does a single camera path. */
void ca_auto_nodes_add(ca_auto_nodes *nodes, const ca_auto_gathered *gathered, ca_ray_objective objective);

/* As ca_connected_image has them, summed with the objective's weights or as means; how many. */
uint32_t ca_auto_nodes_list(const ca_auto_nodes *nodes, bool objective,
                            ca_connected_node list[CA_AUTO_MOST_NODES]);

/* The law's variance of an iteration, mean over pixels, over the squared mean luminance. NAN: nothing is known, or
 * the image is black. */
double ca_auto_nodes_relative_variance(const ca_auto_nodes *nodes, double light_paths, double camera_paths);

#endif
