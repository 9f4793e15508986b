#include "render/auto_known.h"

#include "noise/components.h"

#include <math.h>

_Static_assert(sizeof(ca_auto_known) == 24, "auto_known.h promises 24 bytes a pixel");

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

static float mixed(float x, double y, double share) { return (float)((double)x + share * (y - (double)x)); }

static void add_pixel(ca_auto_known *known, const ca_noise_excess *more, double weight)
{
    const double sum = (double)known->weight + weight, share = weight / sum;
    known->luminance = mixed(known->luminance, more->luminance, share);
    known->luminance2 = mixed(known->luminance2, more->luminance2, share);
    known->pair = mixed(known->pair, more->pair, share);
    known->camera = mixed(known->camera, more->camera, share);
    known->light = mixed(known->light, more->light, share);
    known->weight = (float)sum;
}

void ca_auto_known_add(ca_auto_known *known, const ca_auto_gathered *g)
{
    if (g->iterations < 2) return;
    for (size_t p = 0; p < (size_t)g->pairs->width * g->pairs->height; p++) {
        if (g->camera_paths[p] == 1 && !g->one_camera_path) continue;
        ca_noise_excess more = ca_noise_excess_of(&g->pairs->means[p], g->iterations);
        if (g->one_camera_path) more.light = 0.0;
        add_pixel(&known[p], &more, (double)g->iterations * g->light_paths * g->camera_paths[p]);
    }
}

/* ---- The law --------------------------------------------------------------------------------------------------- */

ca_ray_pixel ca_auto_known_estimates(const ca_auto_known *known)
{
    const double luminance2 = (double)known->luminance2;
    return (ca_ray_pixel){.pair = (double)known->pair + luminance2,
                          .camera = (double)known->camera + luminance2,
                          .light = (double)known->light + luminance2,
                          .luminance2 = luminance2};
}

typedef struct noise_terms {
    double camera, light, pair;
} noise_terms;

static noise_terms terms_of(const ca_auto_known *known, double light_paths, double camera_paths)
{
    const ca_noise_factors factors = ca_noise_factors_of(light_paths, camera_paths);
    return (noise_terms){.camera = factors.camera * (double)known->camera,
                         .light = factors.light * (double)known->light,
                         .pair = factors.pair * (double)known->pair};
}

double ca_auto_known_relative_variance(const ca_auto_known *known, size_t count, double light_paths,
                                       const uint32_t *camera_paths)
{
    double variance = 0.0, luminance = 0.0;
    for (size_t p = 0; p < count; p++) {
        const noise_terms terms = terms_of(&known[p], light_paths, camera_paths[p]);
        variance += terms.camera + terms.light + terms.pair;
        luminance += (double)known[p].luminance;
    }
    return luminance > 0.0 ? variance * (double)count / (luminance * luminance) : (double)NAN;
}

ca_status ca_auto_known_add_layers(const ca_auto_known *known, double light_paths, const uint32_t *camera_paths,
                                   ca_image_layers *image, ca_error *error)
{
    float *camera, *light, *pair;
    if (!known || !(known[0].weight > 0.0f)) return CA_OK;
    CA_TRY(ca_layers_add(image, "Noise.Camera", &camera, error));
    CA_TRY(ca_layers_add(image, "Noise.Light", &light, error));
    CA_TRY(ca_layers_add(image, "Noise.Pair", &pair, error));
    for (size_t p = 0; p < (size_t)image->width * image->height; p++) {
        const noise_terms terms = terms_of(&known[p], light_paths, camera_paths[p]);
        camera[p] = (float)terms.camera;
        light[p] = (float)terms.light;
        pair[p] = (float)terms.pair;
    }
    return CA_OK;
}
