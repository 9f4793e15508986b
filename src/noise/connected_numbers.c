#include "noise/connected_numbers.h"

#include <assert.h>
#include <math.h>

/* Of two variances; none where one is not positive. */
static double between(double low, double high, double share)
{
    if (!(low > 0.0 && high > 0.0)) return 0.0;
    return exp((1.0 - share) * log(low) + share * log(high));
}

/* 0 where nothing is known. */
static double variance_at(const ca_connected_image *image, double light_paths, double camera_paths)
{
    const ca_connected_node *nodes = image->nodes;
    size_t above = 0;
    if (image->node_count == 0) return 0.0;
    while (above < image->node_count && nodes[above].light_paths < light_paths) above++;
    const ca_connected_node *high = &nodes[above < image->node_count ? above : image->node_count - 1],
                            *low = above > 0 ? &nodes[above - 1] : high;
    const double of_high = ca_noise_variance(&high->sums, light_paths, camera_paths);
    if (low == high || !(high->light_paths > low->light_paths)) return fmax(of_high, 0.0);
    const double share = log(light_paths / low->light_paths) / log(high->light_paths / low->light_paths);
    return between(ca_noise_variance(&low->sums, light_paths, camera_paths), of_high, share);
}

ca_ray_choice ca_connected_expect(const ca_connected_image *image, double light_paths, double camera_paths)
{
    return (ca_ray_choice){.light_paths = light_paths,
                           .camera_paths = camera_paths,
                           .variance = variance_at(image, light_paths, camera_paths),
                           .time = image->fixed_time + light_paths * image->light_time +
                                   camera_paths * (image->camera_time + light_paths * image->merge_time)};
}

static bool is_better(const ca_ray_choice *a, const ca_ray_choice *b)
{
    return a->variance > 0.0 && (b->variance == 0.0 || a->variance * a->time < b->variance * b->time);
}

ca_ray_choice ca_connected_choose(const ca_connected_image *image, uint32_t most_light_paths,
                                  uint32_t most_camera_paths)
{
    assert(image->node_count > 0 && image->camera_time > 0.0);
    const double first = image->nodes[0].light_paths,
                 last = fmin(image->nodes[image->node_count - 1].light_paths, most_light_paths);
    ca_ray_choice best = {0};
    for (int step = 0;; step++) {
        const double light_paths = fmin(round(first * exp2(0.5 * step)), last);
        for (uint32_t camera_paths = 1; camera_paths <= most_camera_paths && camera_paths <= light_paths;
             camera_paths++) {
            const ca_ray_choice choice = ca_connected_expect(image, light_paths, camera_paths);
            if (is_better(&choice, &best)) best = choice;
        }
        if (light_paths >= last) return best;
    }
}

ca_status ca_connected_numbers(const ca_connected_image *image, const ca_ray_settings *settings, size_t pixels,
                               ca_ray_numbers *numbers, ca_error *error)
{
    const ca_ray_choice given = ca_connected_expect(image, settings->given_light_paths, settings->given_camera_paths);
    const ca_ray_choice best = ca_connected_choose(image, settings->max_light_paths, settings->max_camera_paths);
    *numbers = (ca_ray_numbers){0};
    if (!(best.variance > 0.0 && given.variance > 0.0)) return CA_OK;
    *numbers = (ca_ray_numbers){.best = best,
                                .relaxed = best,
                                .uniform = best,
                                .given = given,
                                .gain_over_given = given.variance * given.time / (best.variance * best.time),
                                .gain_over_uniform = 1.0};
    return ca_ray_numbers_use_uniform(numbers, &best, pixels, error);
}
