/* How many light paths, and how many camera paths for every pixel, where paths connect: what gives the least noise
 * after a given time. Weights contain the numbers, so that the law's coefficients are known for a few numbers of
 * light paths (ca_pair_film_add_others), the nodes. Between two of them the variance is what the law says with the
 * coefficients of either, interpolated by logarithms: each is right at its own node, and little off half a way from
 * it. Pure functions; docs/papers/000.md, section C.
 *
 * One number of camera paths serves all pixels: a splat's weight contains that of the pixel that it falls on. */
#ifndef CA_NOISE_CONNECTED_NUMBERS_H
#define CA_NOISE_CONNECTED_NUMBERS_H

#include "noise/components.h"
#include "noise/ray_numbers.h"

enum { CA_CONNECTED_MOST_CAMERA_PATHS = 64 }; /* that are chosen */

typedef struct ca_connected_node {
    double light_paths;
    ca_noise_coefficients sums; /* over pixels, each times its weight in the objective */
} ca_connected_node;

typedef struct ca_connected_image {
    const ca_connected_node *nodes; /* by ascending numbers of light paths, at least one */
    size_t node_count;
    double fixed_time, light_time; /* t_0, t_F, as of ca_ray_image */
    double camera_time;            /* sum over pixels of t_B > 0 */
    double merge_time;             /* sum over pixels of t_M */
} ca_connected_image;

/* What is expected of an iteration with these numbers; beyond the nodes by the coefficients of the nearest. */
ca_ray_choice ca_connected_expect(const ca_connected_image *image, double light_paths, double camera_paths);

/* The numbers with the least variance x time, of light paths from the first node's to the last one's and at most
 * `most_light_paths`, in steps of a factor of the root of 2, and of camera paths up to `most_camera_paths`, no more
 * than light paths. Numbers with a variance that is not positive, by estimates with noise, are none; variance 0:
 * there are no others. */
ca_ray_choice ca_connected_choose(const ca_connected_image *image, uint32_t most_light_paths,
                                  uint32_t most_camera_paths);

/* The same as ca_ray_numbers_choose has it, for so many pixels: with the settings' largest and given numbers, both
 * set. Without a map, and all 0, where the given numbers or all others have no positive variance. Errors:
 * CA_ERROR_MEMORY. */
ca_status ca_connected_numbers(const ca_connected_image *image, const ca_ray_settings *settings, size_t pixels,
                               ca_ray_numbers *numbers, ca_error *error);

#endif
