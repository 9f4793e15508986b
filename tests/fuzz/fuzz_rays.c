/* Fuzzer of numbers of rays that come with an image (--rays FILE.exr). */
#include "base/memory.h"
#include "image/format.h"
#include "noise/ray_map.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void read_map(const ca_image_layers *image)
{
    const ca_ray_map_place place = {.full_width = image->full_width,
                                    .full_height = image->full_height,
                                    .crop = {(uint32_t)image->x0, (uint32_t)image->y0,
                                             (uint32_t)image->x0 + image->width,
                                             (uint32_t)image->y0 + image->height}};
    uint32_t light_paths, *camera_paths = NULL;
    ca_error error = {{0}};
    const ca_status status = ca_ray_map_of(image, "fuzz.exr", &place, &light_paths, &camera_paths, &error);
    if (status != CA_OK && (!error.message[0] || camera_paths)) abort();
    for (size_t i = 0; status == CA_OK && i < (size_t)image->width * image->height; i++)
        if (camera_paths[i] < 1 || camera_paths[i] > CA_RAY_MAP_MOST_CAMERA_PATHS) abort();
    ca_free(camera_paths);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    ca_bytes bytes = {.data = malloc(size + 1), .size = size};
    if (!bytes.data) return 0;
    memcpy(bytes.data, data, size);
    bytes.data[size] = 0;
    ca_image_layers *image;
    ca_error error = {{0}};
    if (ca_exr_is(&bytes) && ca_exr_read_layers("fuzz.exr", &bytes, &image, &error) == CA_OK) {
        read_map(image);
        ca_layers_destroy(image);
    }
    free(bytes.data);
    return 0;
}
