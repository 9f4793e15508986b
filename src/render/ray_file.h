/* Numbers of rays that all passes have, from a file (ca_render_settings.rays) or chosen once (rays_once.h): with them
 * a render is the same to the bit whatever measured times were. */
#ifndef CA_RENDER_RAY_FILE_H
#define CA_RENDER_RAY_FILE_H

#include "render/pass.h"

typedef struct ca_ray_file {
    uint32_t *camera_paths, *first; /* owned: N_B(p), and zeros */
    uint32_t light_paths;           /* N_F; 0: there are none */
    double mean;                    /* of N_B(p) */
    ca_pass_counts counts;          /* points to the two */
} ca_ray_file;

/* Reads the file and fits the plan to it, whose input may point to the file from then on: light paths, samples of a
 * pass, number of passes. Errors: those of
 * ca_layers_read and of ca_ray_map_of (noise/ray_map.h); CA_ERROR_ARGUMENT. */
ca_status ca_ray_file_read(ca_ray_file *file, ca_render_plan *plan, ca_error *error);
/* Takes numbers that are known, and fits the plan to them; the map is the file's from then on, whatever fails.
 * Errors: CA_ERROR_ARGUMENT, CA_ERROR_MEMORY. */
ca_status ca_ray_file_take(ca_ray_file *file, uint32_t light_paths, uint32_t *camera_paths, ca_render_plan *plan,
                           ca_error *error);
void ca_ray_file_destroy(ca_ray_file *file);

/* Of numbers that are known, borrowed. */
ca_ray_file ca_ray_file_of(uint32_t light_paths, uint32_t *camera_paths, size_t pixels);
/* What is known of them; nothing was chosen. */
ca_rays_statistics ca_ray_file_statistics(const ca_ray_file *file);

/* Adds the layers Rays.Camera and Rays.Numbers and the attributes to an image of so many passes. */
ca_status ca_ray_file_add_layers(const ca_ray_file *file, uint32_t passes, ca_image_layers *image, ca_error *error);

#endif
