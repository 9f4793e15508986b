#include "render/ray_file.h"

#include "base/memory.h"
#include "base/text.h"
#include "image/layers.h"
#include "noise/ray_map.h"

#include <math.h>
#include <stdio.h>

static size_t pixels_of(const ca_render_plan *plan) { return (size_t)ca_render_plan_pixels(plan); }

static ca_status read_map(const ca_render_plan *plan, uint32_t *light_paths, uint32_t **camera_paths,
                          ca_error *error)
{
    const char *path = plan->settings->rays;
    const ca_ray_map_place place = {.full_width = plan->camera.width,
                                    .full_height = plan->camera.height,
                                    .crop = {plan->crop[0], plan->crop[1], plan->crop[2], plan->crop[3]}};
    ca_image_layers *image;
    CA_TRY(ca_layers_read(path, &image, error));
    const ca_status status = ca_ray_map_of(image, path, &place, light_paths, camera_paths, error);
    ca_layers_destroy(image);
    return status;
}

/* Where paths connect, weights contain the numbers of camera paths. */
static ca_status fit_connections(const ca_ray_file *file, ca_render_plan *plan, ca_error *error)
{
    if (!ca_integrator_has(plan->type, CA_ABILITY_CONNECTION_NOISE)) return CA_OK;
    plan->input.camera_paths = file->camera_paths;
    return ca_render_plan_set_camera_paths(plan, file->counts.most, error);
}

/* Given counts replace the integrator's own number of camera paths. */
static ca_status fit_plan(const ca_ray_file *file, ca_render_plan *plan, ca_error *error)
{
    CA_TRY(ca_render_plan_set_light_paths(plan, file->light_paths, error));
    CA_TRY(fit_connections(file, plan, error));
    plan->camera_paths = file->counts.most;
    plan->samples_per_pass = file->mean;
    CA_TRY(ca_render_plan_count_passes(plan, file->counts.most, error));
    return ca_render_plan_take_range(plan, error);
}

ca_status ca_ray_file_take(ca_ray_file *file, uint32_t light_paths, uint32_t *camera_paths, ca_render_plan *plan,
                           ca_error *error)
{
    double sum = 0.0;
    uint32_t most = 1;
    *file = (ca_ray_file){.light_paths = light_paths, .camera_paths = camera_paths};
    file->first = ca_alloc_zeroed(pixels_of(plan), sizeof *file->first);
    if (!file->first) {
        ca_ray_file_destroy(file);
        return ca_fail_memory(error, "the numbers of rays");
    }
    for (size_t p = 0; p < pixels_of(plan); p++) {
        sum += file->camera_paths[p];
        if (file->camera_paths[p] > most) most = file->camera_paths[p];
    }
    file->mean = sum / (double)pixels_of(plan);
    file->counts = (ca_pass_counts){.camera_paths = file->camera_paths, .first = file->first, .most = most};
    const ca_status status = fit_plan(file, plan, error);
    if (status != CA_OK) ca_ray_file_destroy(file);
    return status;
}

ca_status ca_ray_file_read(ca_ray_file *file, ca_render_plan *plan, ca_error *error)
{
    uint32_t light_paths, *camera_paths;
    *file = (ca_ray_file){0};
    CA_TRY(read_map(plan, &light_paths, &camera_paths, error));
    return ca_ray_file_take(file, light_paths, camera_paths, plan, error);
}

ca_ray_file ca_ray_file_of(uint32_t light_paths, uint32_t *camera_paths, size_t pixels)
{
    double sum = 0.0;
    for (size_t p = 0; light_paths > 0 && p < pixels; p++) sum += camera_paths[p];
    return (ca_ray_file){.camera_paths = camera_paths, .light_paths = light_paths, .mean = sum / (double)pixels};
}

ca_rays_statistics ca_ray_file_statistics(const ca_ray_file *file)
{
    return (ca_rays_statistics){.light_paths = file->light_paths,
                                .camera_paths = file->mean,
                                .predicted_gain = (double)NAN,
                                .iteration_seconds = (double)NAN,
                                .light_path_seconds = (double)NAN,
                                .camera_path_seconds = (double)NAN,
                                .candidate_seconds = (double)NAN};
}

void ca_ray_file_destroy(ca_ray_file *file)
{
    ca_free(file->camera_paths);
    ca_free(file->first);
    *file = (ca_ray_file){0};
}

ca_status ca_ray_file_add_layers(const ca_ray_file *file, uint32_t passes, ca_image_layers *image, ca_error *error)
{
    float *camera;
    char text[128];
    CA_TRY(ca_layers_add(image, "Rays.Camera", &camera, error));
    for (size_t p = 0; p < (size_t)image->width * image->height; p++)
        camera[p] = (float)((double)passes * file->camera_paths[p]);
    CA_TRY(ca_ray_map_add(image, file->light_paths, file->camera_paths, error));
    snprintf(text, sizeof text, "in each pass: %u %s and %.4g %s per pixel", file->light_paths,
             ca_noun(file->light_paths, "light path", "light paths"), file->mean,
             ca_noun(file->mean, "camera path", "camera paths"));
    return ca_layers_set_text(image, "caustica.rays", text, error);
}
