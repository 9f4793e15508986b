/* Numbers of paths where they connect: from a measurement with the weights of several numbers of light paths to the
 * numbers with the least variance x time (noise/connected_numbers.h). */
#include "base/memory.h"
#include "noise/connected_numbers.h"
#include "render/noise.h"
#include "render/noise_plan.h"

#include <math.h>

/* Light paths to choose from, over those measured with: from 1 / GRID_STEP^GRID_REACH to its inverse. */
enum { GRID_STEP = 4, GRID_REACH = 2 };

uint32_t ca_noise_grid(uint32_t light_paths, uint32_t camera_paths, ca_noise_counts counts[CA_NOISE_GRID])
{
    uint32_t count = 0;
    double factor = 1.0 / GRID_STEP / GRID_STEP;
    for (int k = -GRID_REACH; k <= GRID_REACH; k++, factor *= GRID_STEP) {
        const double number = round(light_paths * factor);
        if (k == 0 || number < camera_paths || number < 2.0 || number > CA_RAY_MOST_LIGHT_PATHS_HELD) continue;
        counts[count++] = (ca_noise_counts){(uint32_t)number, camera_paths};
    }
    return count;
}

/* Numbers of light paths whose weights are known: those measured with, and others with as many camera paths. */
static uint32_t find_nodes(const ca_pair_film *film, ca_connected_node nodes[1 + CA_NOISE_MOST_OTHERS],
                           const ca_pair_film *others[1 + CA_NOISE_MOST_OTHERS])
{
    uint32_t count = 1;
    nodes[0].light_paths = film->light_paths;
    others[0] = NULL;
    for (uint32_t i = 0; i < film->other_count; i++) {
        const ca_pair_film *other = &film->others[i];
        if (other->camera_paths != film->camera_paths) continue;
        uint32_t at = count++;
        for (; at > 0 && nodes[at - 1].light_paths > other->light_paths; at--) {
            nodes[at] = nodes[at - 1];
            others[at] = others[at - 1];
        }
        nodes[at].light_paths = other->light_paths;
        others[at] = other;
    }
    return count;
}

/* With the objective's weights. */
static ca_status sum_nodes(const ca_pair_film *film, ca_ray_objective objective, const ca_pair_film *const *others,
                           ca_connected_node *nodes, uint32_t count, ca_error *error)
{
    const size_t pixels = (size_t)film->width * film->height;
    double *luminance2 = ca_alloc(2 * pixels, sizeof *luminance2);
    if (!luminance2) return ca_fail_memory(error, "the numbers of rays");
    double *weights = luminance2 + pixels;
    for (size_t p = 0; p < pixels; p++) luminance2[p] = ca_noise_components_of(&film->pixels[p]).luminance2.value;
    ca_ray_weights(film->width, film->height, CA_NOISE_SMOOTHING, objective, luminance2, weights);
    for (uint32_t i = 0; i < count; i++) {
        nodes[i].sums = (ca_noise_coefficients){0};
        for (size_t p = 0; p < pixels; p++) {
            const ca_noise_coefficients c = ca_noise_coefficients_at(film, others[i], p);
            ca_noise_coefficients_add(&nodes[i].sums, &c, weights[p]);
        }
    }
    ca_free(luminance2);
    return CA_OK;
}

ca_status ca_noise_choose_connected(const ca_pair_film *film, const ca_ray_times *times, const ca_ray_costs *costs,
                                    ca_ray_objective objective, uint32_t most, ca_ray_numbers *numbers,
                                    ca_error *error)
{
    ca_connected_node nodes[1 + CA_NOISE_MOST_OTHERS];
    const ca_pair_film *others[1 + CA_NOISE_MOST_OTHERS];
    ca_connected_image image = {.nodes = nodes,
                                .node_count = find_nodes(film, nodes, others),
                                .fixed_time = fmax(costs->iteration, 0.0),
                                .light_time = fmax(costs->light_path, CA_NOISE_SHORTEST_SECONDS)};
    CA_TRY(sum_nodes(film, objective, others, nodes, (uint32_t)image.node_count, error));
    for (uint32_t y = 0; y < film->height; y++)
        for (uint32_t x = 0; x < film->width; x++) {
            double camera_time, merge_time;
            ca_ray_times_of_pixel(times, costs, x, y, &camera_time, &merge_time);
            image.camera_time += fmax(camera_time, CA_NOISE_SHORTEST_SECONDS);
            image.merge_time += fmax(merge_time, 0.0);
        }
    const ca_ray_settings settings = {.max_light_paths = most,
                                      .max_camera_paths = CA_CONNECTED_MOST_CAMERA_PATHS,
                                      .given_light_paths = film->light_paths,
                                      .given_camera_paths = film->camera_paths};
    return ca_connected_numbers(&image, &settings, (size_t)film->width * film->height, numbers, error);
}

ca_status ca_noise_check_connected(const ca_pair_film *film, ca_ray_objective objective, ca_error *error)
{
    if (!film->connections) return CA_OK;
    if (film->other_count == 0)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "where paths are connected their weights change with the numbers of paths: none are "
                       "recommended that were not measured for");
    if (objective == CA_RAYS_WORST_DECILE)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "where paths are connected numbers are chosen for the mean or the relative variance, not for "
                       "the worst decile");
    if (film->camera_paths > 1) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "from one camera path per pixel and iteration the noise of connected paths is not known: measure "
                   "with at least 2");
}
