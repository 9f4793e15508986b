#include "noise/ray_map.h"

#include <stdio.h>
#include <string.h>

ca_status ca_ray_map_add(ca_image_layers *image, uint32_t light_paths, const uint32_t *camera_paths, ca_error *error)
{
    float *data;
    char text[16];
    CA_TRY(ca_layers_add(image, CA_RAY_MAP_LAYER, &data, error));
    for (size_t p = 0; p < (size_t)image->width * image->height; p++) data[p] = (float)camera_paths[p];
    snprintf(text, sizeof text, "%u", light_paths);
    return ca_layers_set_text(image, CA_RAY_MAP_LIGHT_PATHS, text, error);
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

static ca_status check_place(const ca_image_layers *image, const char *path, const ca_ray_map_place *place,
                             ca_error *error)
{
    const uint32_t *c = place->crop;
    const bool same_film = image->full_width == place->full_width && image->full_height == place->full_height;
    const bool same_part = image->x0 == (int32_t)c[0] && image->y0 == (int32_t)c[1] && image->width == c[2] - c[0] &&
                           image->height == c[3] - c[1];
    if (same_film && same_part) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "%s: its numbers of rays are for the part %d,%d,%lld,%lld of a film of %u x %u pixels, not for "
                   "%u,%u,%u,%u of "
                   "%u x %u",
                   path, image->x0, image->y0, (long long)image->x0 + image->width,
                   (long long)image->y0 + image->height, image->full_width, image->full_height, c[0], c[1], c[2],
                   c[3], place->full_width, place->full_height);
}

/* The whole number from 1 to `most` that the text has, in digits only; 0: it has none. */
static uint32_t count_of(const char *text, uint32_t most)
{
    uint64_t count = 0;
    if (!*text) return 0;
    for (const char *c = text; *c; c++) {
        if (*c < '0' || *c > '9') return 0;
        count = 10 * count + (uint64_t)(*c - '0');
        if (count > most) return 0;
    }
    return (uint32_t)count;
}

static ca_status light_paths_of(const ca_image_layers *image, const char *path, uint32_t *light_paths,
                                ca_error *error)
{
    const ca_attribute *attribute = ca_layers_attribute(image, CA_RAY_MAP_LIGHT_PATHS);
    if (!attribute)
        return ca_fail(error, CA_ERROR_FORMAT, NULL,
                       "%s: there is no attribute \"%s\": numbers of rays come from `caustica noise -o x.exr` or "
                       "from a render with --rays",
                       path, CA_RAY_MAP_LIGHT_PATHS);
    *light_paths = attribute->text ? count_of(attribute->text, CA_RAY_MAP_MOST_LIGHT_PATHS) : 0;
    if (*light_paths > 0) return CA_OK;
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: the attribute \"%s\" is no number of 1 to %d light paths", path,
                   CA_RAY_MAP_LIGHT_PATHS, CA_RAY_MAP_MOST_LIGHT_PATHS);
}

static ca_status camera_paths_of(const ca_image_layers *image, const char *path, const float *data, uint32_t *counts,
                                 ca_error *error)
{
    for (size_t p = 0; p < (size_t)image->width * image->height; p++) {
        /* The range first: beyond it the conversion is not defined. */
        const bool in_range = data[p] >= 1.0f && data[p] <= (float)CA_RAY_MAP_MOST_CAMERA_PATHS;
        counts[p] = in_range ? (uint32_t)data[p] : 0;
        if (!in_range || (float)counts[p] != data[p])
            return ca_fail(error, CA_ERROR_FORMAT, NULL,
                           "%s: \"%s\" has %g at pixel %u,%u, which is no number of 1 to %d camera paths", path,
                           CA_RAY_MAP_LAYER, (double)data[p], (uint32_t)(p % image->width),
                           (uint32_t)(p / image->width), CA_RAY_MAP_MOST_CAMERA_PATHS);
    }
    return CA_OK;
}

ca_status ca_ray_map_of(const ca_image_layers *image, const char *path, const ca_ray_map_place *place,
                        uint32_t *light_paths, uint32_t **camera_paths, ca_error *error)
{
    *camera_paths = NULL;
    const float *data = ca_layers_find(image, CA_RAY_MAP_LAYER);
    if (!data)
        return ca_fail(error, CA_ERROR_FORMAT, NULL,
                       "%s: there is no layer \"%s\": numbers of rays come from `caustica noise -o x.exr` or from a "
                       "render with --rays",
                       path, CA_RAY_MAP_LAYER);
    CA_TRY(check_place(image, path, place, error));
    CA_TRY(light_paths_of(image, path, light_paths, error));
    uint32_t *counts = ca_alloc((size_t)image->width * image->height, sizeof *counts);
    if (!counts) return ca_fail_memory(error, "the numbers of rays");
    const ca_status status = camera_paths_of(image, path, data, counts, error);
    if (status == CA_OK)
        *camera_paths = counts;
    else
        ca_free(counts);
    return status;
}
