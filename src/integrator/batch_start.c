/* Batches: their numbers, and how camera paths start. */
#include "camera/camera_lanes.h"
#include "integrator/batch.h"
#include "integrator/walk.h"

#include <string.h>

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

static bool is_independent(const ca_batch *batch) { return batch->streams[0].kind == CA_SAMPLER_INDEPENDENT; }

void ca_batch_sample_2d(const ca_batch *batch, uint32_t dimension, ca_number_batch *numbers)
{
    const uint32_t pair = dimension >> 1;
    if (!is_independent(batch)) {
        for (uint32_t i = 0; i < batch->count; i++) {
            const ca_vec2 u = ca_sample_2d(&batch->streams[batch->slot[i]], dimension);
            numbers->x[i] = u.x, numbers->y[i] = u.y;
        }
        return;
    }
    for (uint32_t i = 0; i < batch->count; i++) {
        const uint64_t key = (uint64_t)batch->key_high[i] << 32 | batch->key_low[i];
        const uint64_t bits = ca_independent_pair(key, pair);
        numbers->x[i] = ca_unit_float(bits, 40), numbers->y[i] = ca_unit_float(bits, 8);
    }
}

void ca_batch_sample_1d(const ca_batch *batch, uint32_t dimension, ca_number_batch *numbers)
{
    for (uint32_t i = 0; i < batch->count; i++)
        numbers->x[i] = ca_sample_1d(&batch->streams[batch->slot[i]], dimension);
}

/* ---- Camera paths ---------------------------------------------------------------------------------------------- */

static void start_streams(ca_batch *batch, const ca_integrator_input *input)
{
    for (uint32_t i = 0; i < batch->count; i++) {
        const ca_camera_path *path = &batch->paths[i];
        const uint64_t pixel = (uint64_t)path->y * input->camera->width + path->x;
        batch->streams[i] = ca_stream_start(input->sampler, pixel, path->index);
        batch->key_low[i] = (uint32_t)batch->streams[i].key;
        batch->key_high[i] = (uint32_t)(batch->streams[i].key >> 32);
        batch->slot[i] = i;
    }
}

/* Starts the path of a slot at place i, which is not behind its slot; false where the lens lets nothing through. */
static bool start_one(ca_batch *batch, const ca_camera *camera, ca_vec2 offset, uint32_t slot, uint32_t i)
{
    const ca_camera_path *path = &batch->paths[slot];
    const ca_camera_ray ray = ca_walk_camera_ray(camera, &batch->streams[slot], path->x, path->y, offset);
    batch->radiance[slot] = (ca_rgb){0};
    batch->work[slot] = 0;
    if (ca_rgb_is_black(ray.weight)) return false;
    batch->slot[i] = slot;
    batch->key_low[i] = batch->key_low[slot];
    batch->key_high[i] = batch->key_high[slot];
    ca_column3_set(&batch->rays.origin, i, ray.origin);
    ca_column3_set(&batch->rays.direction, i, ray.direction);
    batch->rays.t_min[i] = ray.t_min;
    batch->rays.t_max[i] = ray.t_max;
    ca_column3_set(&batch->previous, i, ray.origin);
    ca_column3_set(&batch->previous_normal, i, (ca_vec3){0});
    batch->throughput.x[i] = ray.weight.r, batch->throughput.y[i] = ray.weight.g,
    batch->throughput.z[i] = ray.weight.b;
    batch->eta2[i] = 1.0f;
    batch->pdf[i] = 0.0f;
    batch->dirac[i] = UINT32_MAX; /* no next event could find what is seen directly */
    return true;
}

/* All paths at once; rays from eight film positions at a time. */
static void start_lanes(ca_batch *batch, const ca_camera *camera, const ca_number_batch *offset)
{
    ca_number_batch *lens = &batch->numbers[2];
    const ca_f8 zero = ca_f8_all(0.0f), one = ca_f8_all(1.0f);
    memset(batch->work, 0, sizeof batch->work);
    if (ca_camera_has_lens(camera)) ca_batch_sample_2d(batch, CA_DIM_LENS, lens);
    for (uint32_t i = 0; i < batch->count; i += CA_LANES) {
        ca_f8 film[2] = {zero, zero};
        for (uint32_t k = 0; k < CA_LANES && i + k < batch->count; k++) {
            film[0][k] = (float)batch->paths[i + k].x, film[1][k] = (float)batch->paths[i + k].y;
            batch->radiance[i + k] = (ca_rgb){0};
        }
        film[0] = film[0] + 0.5f + ca_load8(offset->x, i);
        film[1] = film[1] + 0.5f + ca_load8(offset->y, i);
        const ca_f8 u_lens[2] = {ca_load8(lens->x, i), ca_load8(lens->y, i)};
        ca_camera_rays8 rays;
        ca_camera_sample_rays8(camera, film, u_lens, &rays);
        ca_column3_store(&batch->rays.origin, i, rays.origin);
        ca_column3_store(&batch->rays.direction, i, rays.direction);
        ca_store8(batch->rays.t_min, i, rays.t_min);
        ca_store8(batch->rays.t_max, i, rays.t_max);
        ca_column3_store(&batch->previous, i, rays.origin);
        ca_column3_store(&batch->previous_normal, i, (ca_v8){zero, zero, zero});
        ca_column3_store(&batch->throughput, i, (ca_v8){one, one, one});
        ca_store8(batch->eta2, i, one);
        ca_store8(batch->pdf, i, zero);
        ca_store8_u32(batch->dirac, i, ca_m8_all(-1)); /* no next event could find what is seen directly */
    }
}

void ca_batch_start_camera(ca_batch *batch, const ca_integrator_input *input, ca_camera_path *paths, uint32_t count)
{
    ca_number_batch *offset = &batch->numbers[0], *weight = &batch->numbers[1];
    batch->paths = paths;
    batch->count = count;
    batch->segments = 0;
    start_streams(batch, input);
    ca_batch_sample_2d(batch, CA_DIM_FILM, offset);
    ca_filter_sample_axis(input->filter, count, offset->x, weight->x);
    ca_filter_sample_axis(input->filter, count, offset->y, weight->y);
    for (uint32_t i = 0; i < count; i++) paths[i].sample->filter_weight = weight->x[i] * weight->y[i];
    if (ca_camera_has_lanes(input->camera)) {
        start_lanes(batch, input->camera, offset);
        return;
    }
    uint32_t started = 0;
    for (uint32_t i = 0; i < count; i++)
        started += start_one(batch, input->camera, (ca_vec2){offset->x[i], offset->y[i]}, i, started);
    batch->count = started;
}

void ca_batch_intersect(ca_batch *batch, const ca_scene *scene, ca_worker *worker)
{
    worker->counters.rays += batch->count;
    for (uint32_t i = 0; i < batch->count; i++) batch->work[batch->slot[i]]++;
    ca_accel_intersect_batch(scene->accel, &batch->rays, batch->count, &batch->hits);
    batch->segments++;
}
