/* The scene's own length for merges: how large a pixel is where camera paths first meet something that photons can be
 * merged on. */
#include "integrator/bidirectional.h"

#include <stdlib.h>

enum { SIDE = 64, MAX_EVENTS = 32 };

static int compare(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Follows one camera path through Dirac events; the distance to the first smooth surface, or a negative number. */
static float distance_to_smooth(const ca_integrator_input *input, const ca_camera_ray *ray, const ca_stream *stream)
{
    const ca_scene *scene = input->scene;
    ca_vec3 origin = ray->origin, direction = ray->direction;
    float t_min = ray->t_min, t_max = ray->t_max, distance = 0.0f;
    for (uint32_t depth = 0; depth < MAX_EVENTS; depth++) {
        ca_hit hit;
        if (!ca_accel_intersect(scene->accel, origin, direction, t_min, t_max, &hit)) return -1.0f;
        ca_surface surface;
        ca_bsdf bsdf;
        ca_accel_surface(scene->accel, origin, direction, &hit, &surface);
        distance += hit.t;
        const ca_vec3 wi = ca_neg(direction);
        ca_bsdf_init(&bsdf, scene->materials, scene->desc.textures.items, &surface, wi);
        if (bsdf.scatter & CA_SCATTER_SMOOTH) return distance;
        ca_bsdf_sample event;
        const uint32_t dimension = ca_vertex_dimension(depth);
        if (!ca_bsdf_sample_direction(&bsdf, wi, ca_sample_1d(stream, dimension + CA_DIM_BSDF_LOBE),
                                      ca_sample_2d(stream, dimension + CA_DIM_BSDF_DIRECTION), CA_FROM_CAMERA,
                                      &event))
            return -1.0f;
        origin = ca_offset_origin(surface.position, surface.position_error, surface.ng, event.wo_world);
        direction = event.wo_world;
        t_min = 0.0f;
        t_max = INFINITY;
    }
    return -1.0f;
}

float ca_median_pixel_footprint(const ca_integrator_input *input)
{
    const ca_camera *camera = input->camera;
    const ca_sampler sampler = {.kind = CA_SAMPLER_INDEPENDENT};
    float sides[SIDE * SIDE];
    size_t count = 0;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        const ca_stream stream = ca_stream_start(&sampler, i, 0);
        const ca_vec2 film = {((float)(i % SIDE) + 0.5f) / SIDE * (float)camera->width,
                              ((float)(i / SIDE) + 0.5f) / SIDE * (float)camera->height};
        const ca_camera_ray ray = ca_camera_sample_ray(camera, film, (ca_vec2){0.5f, 0.5f});
        if (ca_rgb_is_black(ray.weight)) continue;
        const float distance = distance_to_smooth(input, &ray, &stream);
        if (distance < 0.0f) continue;
        const bool parallel = ca_camera_has_dirac_direction(ray.camera);
        sides[count++] = parallel ? sqrtf(1.0f / ray.pdf_position.v) : distance * sqrtf(1.0f / ray.pdf_direction.v);
    }
    if (count == 0) return 1e-3f * ca_max(input->scene->radius, 1e-6f);
    qsort(sides, count, sizeof *sides, compare);
    return sides[count / 2];
}
