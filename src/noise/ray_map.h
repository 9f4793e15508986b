/* Numbers of rays that travel with a picture: N_F as an attribute, the map N_B(p) as a layer.
 *
 *     Rays.Numbers          camera paths of each pixel in one iteration, N_B(p) >= 1
 *     caustica.lightPaths   light paths of that iteration, N_F, as text: decimal digits
 *
 * `caustica noise` and renders with --rays write them; `caustica render --rays FILE.exr` renders with them. */
#ifndef CA_NOISE_RAY_MAP_H
#define CA_NOISE_RAY_MAP_H

#include "image/layers.h"
#include "noise/ray_numbers.h"

#define CA_RAY_MAP_LAYER "Rays.Numbers"
#define CA_RAY_MAP_LIGHT_PATHS "caustica.lightPaths"

enum {
    CA_RAY_MAP_MOST_CAMERA_PATHS = 1 << 16, /* of a pixel; exact as a float */
    CA_RAY_MAP_MOST_LIGHT_PATHS = CA_RAY_MOST_LIGHT_PATHS,
};

/* Adds the two to an image of the map's size; camera_paths: N_B(p) row by row. Errors: CA_ERROR_MEMORY. */
ca_status ca_ray_map_add(ca_image_layers *image, uint32_t light_paths, const uint32_t *camera_paths, ca_error *error);

/* What is to be rendered: a map for anything else does not fit. */
typedef struct ca_ray_map_place {
    uint32_t full_width, full_height; /* of the film */
    uint32_t crop[4];                 /* x0, y0, x1, y1 */
} ca_ray_map_place;

/* Reads the two back; *camera_paths is the caller's, to be released with ca_free. `path` is for messages. Errors, all
 * with nothing allocated: CA_ERROR_FORMAT (an image without the layer or the attribute, numbers that are none),
 * CA_ERROR_ARGUMENT (a map of another part of a film or of another film), CA_ERROR_MEMORY. */
ca_status ca_ray_map_of(const ca_image_layers *image, const char *path, const ca_ray_map_place *place,
                        uint32_t *light_paths, uint32_t **camera_paths, ca_error *error);

#endif
