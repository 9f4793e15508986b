#include "ray_recorder.h"

#include "base/clock.h"

#include <embree3/rtcore.h>
#include <stdint.h>
#include <stdlib.h>

typedef struct recorded_ray {
    struct RTCRay ray;
    bool occlusion;
} recorded_ray;

static struct {
    bool on;
    RTCScene scene;
    recorded_ray *rays;
    size_t count, capacity, recorded_hits, hits;
} recorder;

void __real_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRayHit *rayhit);
void __real_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *ray);
void __wrap_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRayHit *rayhit);
void __wrap_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *ray);

static void record(RTCScene scene, const struct RTCRay *ray, bool occlusion)
{
    recorder.scene = scene;
    if (recorder.count < recorder.capacity)
        recorder.rays[recorder.count] = (recorded_ray){.ray = *ray, .occlusion = occlusion};
    recorder.count++;
}

void __wrap_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRayHit *rayhit)
{
    if (recorder.on) record(scene, &rayhit->ray, false);
    __real_rtcIntersect1(scene, context, rayhit);
    if (recorder.on && recorder.count <= recorder.capacity)
        recorder.recorded_hits += rayhit->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

void __wrap_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *ray)
{
    if (recorder.on) record(scene, ray, true);
    __real_rtcOccluded1(scene, context, ray);
    if (recorder.on && recorder.count <= recorder.capacity) recorder.recorded_hits += ray->tfar < 0.0f;
}

bool ray_recorder_start(size_t capacity)
{
    ray_recorder_free();
    recorder.rays = malloc(capacity * sizeof *recorder.rays);
    recorder.capacity = recorder.rays ? capacity : 0;
    recorder.on = recorder.rays != NULL;
    return recorder.on;
}

size_t ray_recorder_stop(void)
{
    recorder.on = false;
    return recorder.count;
}

double ray_recorder_replay(void)
{
    const size_t count = recorder.count < recorder.capacity ? recorder.count : recorder.capacity;
    const double start = ca_clock_seconds();
    size_t hits = 0;
    for (size_t i = 0; i < count; i++) {
        struct RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        if (recorder.rays[i].occlusion) {
            struct RTCRay ray = recorder.rays[i].ray;
            __real_rtcOccluded1(recorder.scene, &context, &ray);
            hits += ray.tfar < 0.0f;
        } else {
            struct RTCRayHit rayhit;
            rayhit.ray = recorder.rays[i].ray;
            rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            __real_rtcIntersect1(recorder.scene, &context, &rayhit);
            hits += rayhit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
    }
    recorder.hits = hits;
    return ca_clock_seconds() - start;
}

size_t ray_recorder_hits(void) { return recorder.hits; }
size_t ray_recorder_recorded_hits(void) { return recorder.recorded_hits; }

void ray_recorder_free(void)
{
    free(recorder.rays);
    recorder.rays = NULL;
    recorder.count = recorder.capacity = recorder.recorded_hits = recorder.hits = 0;
    recorder.on = false;
}
