#include "film/pair_covariances.h"

#include <assert.h>

ca_status ca_pair_covariances_create(ca_pair_covariances *c, ca_error *error)
{
    *c = (ca_pair_covariances){.sums = NULL};
    return ca_pair_sums_create(&c->sums, error);
}

void ca_pair_covariances_destroy(ca_pair_covariances *c)
{
    ca_pair_sums_destroy(c->sums);
    c->sums = NULL;
}

void ca_pair_covariances_begin(ca_pair_covariances *c, uint32_t light_paths)
{
    *c = (ca_pair_covariances){.sums = c->sums, .light_paths = light_paths};
    ca_pair_sums_begin(c->sums, light_paths);
}

void ca_pair_covariances_next_path(ca_pair_covariances *c)
{
    ca_pair_sums_next_path(c->sums);
    c->camera_paths++;
}

/* Halves are by parity, from 0 on, as in pair_sums. */
static uint32_t camera_half(const ca_pair_covariances *c) { return (c->camera_paths - 1) & 1; }

void ca_pair_covariances_add(ca_pair_covariances *c, uint32_t light_path, double luminance)
{
    ca_pair_sums_add(c->sums, light_path, luminance);
    c->light_halves[light_path & 1] += luminance;
    c->camera_halves[camera_half(c)] += luminance;
}

void ca_pair_covariances_add_alone(ca_pair_covariances *c, double luminance)
{
    ca_pair_sums_add_alone(c->sums, luminance);
    c->alone_halves[camera_half(c)] += luminance;
}

bool ca_pair_covariances_finish(ca_pair_covariances *c, ca_pair_covariance *result)
{
    assert(c->camera_paths >= 2);
    const ca_pair_moments moments = ca_pair_sums_finish(c->sums);
    const double n = c->light_paths, m = c->camera_paths;
    const double light_counts[2] = {c->light_paths - c->light_paths / 2, c->light_paths / 2};
    const double camera_counts[2] = {c->camera_paths - c->camera_paths / 2, c->camera_paths / 2};
    const double alone = (c->alone_halves[0] + c->alone_halves[1]) / m;
    double light_means[2], camera_means[2]; /* of the whole block's pairs in each half */
    for (int h = 0; h < 2; h++) {
        light_means[h] = c->light_halves[h] / (light_counts[h] * m) + alone;
        camera_means[h] = (c->camera_halves[h] / n + c->alone_halves[h]) / camera_counts[h];
    }
    result->camera = (moments.camera - light_means[0] * light_means[1]) * (m / (m - 1.0));
    result->light = (moments.light - camera_means[0] * camera_means[1]) * (n / (n - 1.0));
    result->pair = moments.pair - moments.light - result->camera;
    result->merged = (c->light_halves[0] + c->light_halves[1]) / (n * m);
    return ca_pair_sums_complete(c->sums);
}
