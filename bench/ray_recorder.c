#include "ray_recorder.h"

#include "base/clock.h"
#include "base/parallel.h"
#include "bench_support.h"

#include <embree3/rtcore.h>
#include <stdint.h>
#include <stdlib.h>

/* Scenes: the one of the world's shapes, and the one of instances. */
enum { MAX_THREADS = 64, RUN = 4096, SCENES = 2 };

/* What a thread has recorded. Embree ignores a ray's id; here it tells the kind of query, and of which scene: */
typedef struct ray_tape {
    _Alignas(64) struct RTCRay *rays;
    size_t count, capacity, hits;
} ray_tape;

enum { NEAREST_HIT = 0, VISIBILITY = 1, SCENE_FACTOR = 2 };

static struct {
    bool on, failed;
    unsigned recording; /* number of this recording: a thread that has not met it yet takes a tape */
    int tape_count;
    RTCScene scenes[SCENES]; /* in the order of their first rays */
    ray_tape tapes[MAX_THREADS];
} recorder;

static _Thread_local struct {
    unsigned recording;
    ray_tape *tape;
} own;

void __real_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRayHit *rayhit);
void __real_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *ray);
void __wrap_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRayHit *rayhit);
void __wrap_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *ray);
void __real_rtcIntersect8(const int *valid, RTCScene scene, struct RTCIntersectContext *context,
                          struct RTCRayHit8 *rayhit);
void __real_rtcOccluded8(const int *valid, RTCScene scene, struct RTCIntersectContext *context, struct RTCRay8 *ray);
void __wrap_rtcIntersect8(const int *valid, RTCScene scene, struct RTCIntersectContext *context,
                          struct RTCRayHit8 *rayhit);
void __wrap_rtcOccluded8(const int *valid, RTCScene scene, struct RTCIntersectContext *context, struct RTCRay8 *ray);

static ray_tape *own_tape(void)
{
    if (own.recording == recorder.recording) return own.tape;
    const int number = __atomic_fetch_add(&recorder.tape_count, 1, __ATOMIC_RELAXED);
    own.recording = recorder.recording;
    own.tape = number < MAX_THREADS ? &recorder.tapes[number] : NULL;
    return own.tape;
}

/* The number of a scene, which is noted at its first ray; SCENES: there are too many. */
static unsigned scene_number(RTCScene scene)
{
    for (unsigned i = 0; i < SCENES; i++) {
        RTCScene there = NULL;
        if (__atomic_compare_exchange_n(&recorder.scenes[i], &there, scene, false, __ATOMIC_RELAXED,
                                        __ATOMIC_RELAXED) ||
            there == scene)
            return i;
    }
    return SCENES;
}

/* The thread's tape with the ray at its end, or NULL when there is no room: the recording is then not of use. */
static ray_tape *record(RTCScene scene, const struct RTCRay *ray, unsigned kind)
{
    ray_tape *tape = own_tape();
    if (tape && tape->count == tape->capacity) {
        const size_t capacity = tape->capacity ? 2 * tape->capacity : 1 << 16;
        struct RTCRay *rays = realloc(tape->rays, capacity * sizeof *rays);
        if (rays) tape->rays = rays, tape->capacity = capacity;
    }
    const unsigned number = scene_number(scene);
    if (!tape || tape->count == tape->capacity || number == SCENES) {
        __atomic_store_n(&recorder.failed, true, __ATOMIC_RELAXED);
        return NULL;
    }
    tape->rays[tape->count] = *ray;
    tape->rays[tape->count++].id = kind + SCENE_FACTOR * number;
    return tape;
}

void __wrap_rtcIntersect1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRayHit *rayhit)
{
    ray_tape *tape = recorder.on ? record(scene, &rayhit->ray, NEAREST_HIT) : NULL;
    __real_rtcIntersect1(scene, context, rayhit);
    if (tape) tape->hits += rayhit->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

void __wrap_rtcOccluded1(RTCScene scene, struct RTCIntersectContext *context, struct RTCRay *ray)
{
    ray_tape *tape = recorder.on ? record(scene, ray, VISIBILITY) : NULL;
    __real_rtcOccluded1(scene, context, ray);
    if (tape) tape->hits += ray->tfar < 0.0f;
}

/* A packet's rays are recorded one by one: what is replayed are single rays. */
static ray_tape *record_lane(RTCScene scene, const struct RTCRay8 *rays, int lane, unsigned kind)
{
    const struct RTCRay ray = {.org_x = rays->org_x[lane],
                               .org_y = rays->org_y[lane],
                               .org_z = rays->org_z[lane],
                               .tnear = rays->tnear[lane],
                               .dir_x = rays->dir_x[lane],
                               .dir_y = rays->dir_y[lane],
                               .dir_z = rays->dir_z[lane],
                               .tfar = rays->tfar[lane],
                               .mask = rays->mask[lane]};
    return record(scene, &ray, kind);
}

void __wrap_rtcIntersect8(const int *valid, RTCScene scene, struct RTCIntersectContext *context,
                          struct RTCRayHit8 *rayhit)
{
    ray_tape *tape = NULL;
    for (int lane = 0; recorder.on && lane < 8; lane++)
        if (valid[lane]) tape = record_lane(scene, &rayhit->ray, lane, NEAREST_HIT);
    __real_rtcIntersect8(valid, scene, context, rayhit);
    for (int lane = 0; tape && lane < 8; lane++)
        tape->hits += valid[lane] && rayhit->hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
}

void __wrap_rtcOccluded8(const int *valid, RTCScene scene, struct RTCIntersectContext *context, struct RTCRay8 *ray)
{
    ray_tape *tape = NULL;
    for (int lane = 0; recorder.on && lane < 8; lane++)
        if (valid[lane]) tape = record_lane(scene, ray, lane, VISIBILITY);
    __real_rtcOccluded8(valid, scene, context, ray);
    for (int lane = 0; tape && lane < 8; lane++) tape->hits += valid[lane] && ray->tfar[lane] < 0.0f;
}

void ray_recorder_start(void)
{
    ray_recorder_free();
    recorder.recording++;
    recorder.on = true;
}

static int tape_count(void) { return recorder.tape_count < MAX_THREADS ? recorder.tape_count : MAX_THREADS; }

bool ray_recorder_stop(ray_counts *recorded)
{
    recorder.on = false;
    *recorded = (ray_counts){0};
    for (int i = 0; i < tape_count(); i++) {
        const ray_tape *tape = &recorder.tapes[i];
        for (size_t k = 0; k < tape->count; k++) recorded->shadow_rays += tape->rays[k].id % SCENE_FACTOR == VISIBILITY;
        recorded->rays += tape->count;
        recorded->hits += tape->hits;
    }
    recorded->rays -= recorded->shadow_rays;
    return !recorder.failed;
}

static ray_counts replay_run(const struct RTCRay *rays, size_t count)
{
    ray_counts done = {0};
    for (size_t i = 0; i < count; i++) {
        struct RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCScene scene = recorder.scenes[rays[i].id / SCENE_FACTOR];
        if (rays[i].id % SCENE_FACTOR == VISIBILITY) {
            struct RTCRay ray = rays[i];
            __real_rtcOccluded1(scene, &context, &ray);
            done.hits += ray.tfar < 0.0f;
            done.shadow_rays++;
        } else {
            struct RTCRayHit rayhit;
            rayhit.ray = rays[i];
            rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            __real_rtcIntersect1(scene, &context, &rayhit);
            done.hits += rayhit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
    }
    done.rays = count - done.shadow_rays;
    return done;
}

static uint32_t runs_of(const ray_tape *tape) { return (uint32_t)((tape->count + RUN - 1) / RUN); }

static void add_counts(ray_counts *counts, const ray_counts *more)
{
    counts->rays += more->rays;
    counts->shadow_rays += more->shadow_rays;
    counts->hits += more->hits;
}

/* Runs are numbered through all tapes. `user`: the counts of each worker. */
static void replay(void *user, uint32_t run, uint32_t worker)
{
    ray_counts *counts = user;
    const ray_tape *tape = recorder.tapes;
    for (; run >= runs_of(tape); tape++) run -= runs_of(tape);
    const size_t first = (size_t)run * RUN, left = tape->count - first;
    const ray_counts done = replay_run(tape->rays + first, left < RUN ? left : RUN);
    add_counts(&counts[worker], &done);
}

double ray_recorder_replay(int threads, ray_counts *replayed)
{
    const double start = ca_clock_seconds();
    const ca_parallel parallel = {.workers = (uint32_t)threads};
    ray_counts counts[MAX_THREADS] = {{0}};
    uint32_t runs = 0;
    ca_error error;
    for (int i = 0; i < tape_count(); i++) runs += runs_of(&recorder.tapes[i]);
    if (ca_parallel_for(&parallel, runs, replay, counts, &error) != CA_OK) bench_die("replaying rays", &error);
    *replayed = (ray_counts){0};
    for (int i = 0; i < threads; i++) add_counts(replayed, &counts[i]);
    return ca_clock_seconds() - start;
}

void ray_recorder_free(void)
{
    for (int i = 0; i < tape_count(); i++) {
        free(recorder.tapes[i].rays);
        recorder.tapes[i] = (ray_tape){0};
    }
    for (int i = 0; i < SCENES; i++) recorder.scenes[i] = NULL;
    recorder.tape_count = 0;
    recorder.on = recorder.failed = false;
}
