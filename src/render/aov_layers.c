#include "render/aov_layers.h"

#include "base/clock.h"
#include "base/stop.h"
#include "image/layers.h"
#include "integrator/walk.h"
#include "render/workers.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* What is behind the name in a channel's, one letter for each number. */
static const char *const suffixes[CA_AOV_KIND_COUNT] = {
    [CA_AOV_DEPTH] = "T",        [CA_AOV_POSITION] = "XYZ", [CA_AOV_UV] = "UV",
    [CA_AOV_GEO_NORMAL] = "XYZ", [CA_AOV_SH_NORMAL] = "XYZ", [CA_AOV_DP_DU] = "XYZ",
    [CA_AOV_DP_DV] = "XYZ",      [CA_AOV_PRIM_INDEX] = "I", [CA_AOV_SHAPE_INDEX] = "I",
    [CA_AOV_ALBEDO] = "RGB",
};

typedef struct aov_job {
    const ca_render_plan *plan;
    uint32_t samples;
    ca_image_layers *image;
    float *channels[CA_MAX_AOVS][3]; /* NULL: there is one of that name already, or none */
    double limit;                    /* by the clock: from then on who asked to stop does not wait any longer */
    int over;                        /* atomic; once set, what is left is not traced */
} aov_job;

static void set3(double value[3], float a, float b, float c)
{
    value[0] = (double)a, value[1] = (double)b, value[2] = (double)c;
}

static void set_vector(double value[3], ca_vec3 v) { set3(value, v.x, v.y, v.z); }

static ca_rgb reflectance_at(const ca_scene *scene, const ca_surface *surface, ca_vec3 to_eye)
{
    ca_bsdf bsdf;
    ca_bsdf_init(&bsdf, scene->materials, scene->desc.textures.items, surface, to_eye);
    return ca_bsdf_diffuse_reflectance(&bsdf, to_eye);
}

/* Depth begins where the camera begins to see. */
static void value_of(ca_aov_kind kind, const ca_scene *scene, const ca_surface *surface, const ca_camera_ray *ray,
                     float t, double value[3])
{
    set3(value, 0.0f, 0.0f, 0.0f);
    switch (kind) {
    case CA_AOV_DEPTH: value[0] = (double)(t - ray->t_min); break;
    case CA_AOV_POSITION: set_vector(value, surface->position); break;
    case CA_AOV_UV: set3(value, surface->uv.x, surface->uv.y, 0.0f); break;
    case CA_AOV_GEO_NORMAL: set_vector(value, surface->ng); break;
    case CA_AOV_SH_NORMAL: set_vector(value, surface->ns); break;
    case CA_AOV_DP_DU: set_vector(value, surface->dpdu); break;
    case CA_AOV_DP_DV: set_vector(value, surface->dpdv); break;
    case CA_AOV_PRIM_INDEX: value[0] = surface->primitive; break;
    case CA_AOV_SHAPE_INDEX: value[0] = surface->shape; break;
    case CA_AOV_ALBEDO: {
        const ca_rgb color = reflectance_at(scene, surface, ca_neg(ray->direction));
        set3(value, color.r, color.g, color.b);
        break;
    }
    case CA_AOV_KIND_COUNT: break;
    }
}

/* Adds what one camera ray meets, times the filter's weight. */
static void add_ray(const aov_job *job, uint32_t x, uint32_t y, uint32_t index, double sums[CA_MAX_AOVS][3])
{
    const ca_integrator_input *input = &job->plan->input;
    const ca_scene *scene = input->scene;
    const uint64_t pixel = (uint64_t)y * input->camera->width + x;
    const ca_stream stream = ca_stream_start(input->sampler, pixel, index);
    float weight;
    const ca_vec2 offset = ca_filter_sample(input->filter, ca_sample_2d(&stream, CA_DIM_FILM), &weight);
    const ca_camera_ray ray = ca_walk_camera_ray(input->camera, &stream, x, y, offset);
    ca_hit hit;
    ca_surface surface;
    if (ca_rgb_is_black(ray.weight)) return;
    if (!ca_accel_intersect(scene->accel, ray.origin, ray.direction, ray.t_min, ray.t_max, &hit)) return;
    ca_accel_surface(scene->accel, ray.origin, ray.direction, &hit, &surface);
    for (size_t i = 0; i < scene->desc.integrator.aovs.count; i++) {
        double value[3];
        value_of(scene->desc.integrator.aovs.items[i].kind, scene, &surface, &ray, hit.t, value);
        for (int c = 0; c < 3; c++) sums[i][c] += (double)weight * value[c];
    }
}

static void fill_pixel(const aov_job *job, uint32_t column, uint32_t row)
{
    double sums[CA_MAX_AOVS][3] = {{0.0}};
    const ca_image_layers *image = job->image;
    const uint32_t x = column + (uint32_t)image->x0, y = row + (uint32_t)image->y0;
    for (uint32_t index = 0; index < job->samples; index++) add_ray(job, x, y, index, sums);
    for (size_t i = 0; i < job->plan->scene->desc.integrator.aovs.count; i++)
        for (int c = 0; c < 3; c++)
            if (job->channels[i][c])
                job->channels[i][c][(size_t)row * image->width + column] = (float)(sums[i][c] / job->samples);
}

/* The stop may have been set long before, in the last pass: so it ends the layers only when they have had their time.
 * One who wants no image any more does not wait for that. */
static bool is_over(const aov_job *job)
{
    const ca_render_settings *settings = job->plan->settings;
    if (ca_stop_asked(settings->discard)) return true;
    return ca_stop_asked(settings->stop) && ca_clock_seconds() >= job->limit;
}

static void fill_tile(void *user, const ca_tile *tile, uint32_t worker)
{
    aov_job *job = user;
    (void)worker;
    for (uint32_t y = tile->y0; y < tile->y1 && !ca_stop_asked(&job->over); y++) {
        if (is_over(job))
            __atomic_store_n(&job->over, 1, __ATOMIC_RELAXED);
        else
            for (uint32_t x = tile->x0; x < tile->x1; x++) fill_pixel(job, x, y);
    }
}

static ca_status add_channels(aov_job *job, ca_error *error)
{
    const ca_integrator_desc *desc = &job->plan->scene->desc.integrator;
    for (size_t i = 0; i < desc->aovs.count; i++) {
        const char *letters = suffixes[desc->aovs.items[i].kind];
        for (int c = 0; letters[c]; c++) {
            char name[CA_AOV_NAME_SIZE + 2];
            snprintf(name, sizeof name, "%s.%c", desc->aovs.items[i].name, letters[c]);
            if (!ca_layers_find(job->image, name))
                CA_TRY(ca_layers_add(job->image, name, &job->channels[i][c], error));
        }
    }
    return CA_OK;
}

size_t ca_aov_layers_bytes(const ca_scene *scene)
{
    const ca_integrator_desc *desc = &scene->desc.integrator;
    size_t channels = 0;
    for (size_t i = 0; i < desc->aovs.count; i++) channels += strlen(suffixes[desc->aovs.items[i].kind]);
    return channels * sizeof(float);
}

ca_status ca_aov_layers_add(const ca_render_plan *plan, double samples, ca_image_layers *image, ca_error *error)
{
    if (plan->scene->desc.integrator.aovs.count == 0) return CA_OK;
    const double rays = samples < CA_AOV_SAMPLES ? ceil(samples) : CA_AOV_SAMPLES;
    const size_t channels_before = image->channel_count;
    aov_job job = {.plan = plan,
                   .samples = rays > 1.0 ? (uint32_t)rays : 1,
                   .image = image,
                   .limit = ca_clock_seconds() + CA_AOV_SECONDS};
    const ca_parallel parallel = {.workers = plan->threads, .stop = &job.over};
    ca_status status = add_channels(&job, error);
    if (status == CA_OK)
        status = ca_for_each_tile(&parallel, image->width, image->height, fill_tile, &job, error);
    if (status != CA_OK) ca_layers_cut(image, channels_before);
    return status;
}
