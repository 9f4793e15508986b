#include "geometry/accel_embree.h"

#include "base/memory.h"
#include "base/stop.h"
#include "geometry/quadric.h"
#include "geometry/ray_reach.h"
#include "math/numeric.h"

#include <assert.h>
#include <stddef.h>
#include <stdio.h>

/* ---- Errors and memory of Embree ------------------------------------------------------------------------------- */

static ca_status fail_embree(ca_error *error, RTCDevice device, const char *what)
{
    const enum RTCError code = rtcGetDeviceError(device);
    if (code == RTC_ERROR_OUT_OF_MEMORY) return ca_fail_memory(error, what);
    if (code == RTC_ERROR_UNSUPPORTED_CPU)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "this processor lacks AVX2, which Caustica needs");
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "Embree failed in %s (its error code is %d)", what, (int)code);
}

static bool count_memory(void *user, ssize_t bytes, bool post)
{
    (void)post;
    ca_accel *accel = user;
    __atomic_add_fetch(&accel->bytes, (size_t)bytes, __ATOMIC_RELAXED);
    return true;
}

/* ---- Quadrics as Embree's user geometry ------------------------------------------------------------------------ */

static void quadric_bounds(const struct RTCBoundsFunctionArguments *arguments)
{
    ca_vec3 low, high;
    ca_shape_bounds(arguments->geometryUserPtr, &low, &high);
    struct RTCBounds *bounds = arguments->bounds_o;
    bounds->lower_x = low.x, bounds->lower_y = low.y, bounds->lower_z = low.z;
    bounds->upper_x = high.x, bounds->upper_y = high.y, bounds->upper_z = high.z;
}

/* Embree hands over any number of rays by components: the k-th value of a field of N rays lies at N times the field's
 * number in a single ray, plus k (Embree's API manual, RTCRayN and RTCHitN). */
#define RAY_FIELD(rays, n, k, field) (((float *)(rays))[offsetof(struct RTCRay, field) / 4 * (n) + (k)])
#define HIT_FIELD(hits, n, k, field) (((float *)(hits))[offsetof(struct RTCHit, field) / 4 * (n) + (k)])
#define HIT_NUMBER(hits, n, k, field) (((unsigned *)(hits))[offsetof(struct RTCHit, field) / 4 * (n) + (k)])

static bool meets_quadric(const ca_shape *shape, struct RTCRayN *rays, unsigned n, unsigned k, float *t)
{
    const ca_vec3 origin = {RAY_FIELD(rays, n, k, org_x), RAY_FIELD(rays, n, k, org_y), RAY_FIELD(rays, n, k, org_z)};
    const ca_vec3 direction = {RAY_FIELD(rays, n, k, dir_x), RAY_FIELD(rays, n, k, dir_y),
                               RAY_FIELD(rays, n, k, dir_z)};
    return ca_quadric_intersect(shape, origin, direction, RAY_FIELD(rays, n, k, tnear), RAY_FIELD(rays, n, k, tfar),
                                t);
}

static void quadric_intersect(const struct RTCIntersectFunctionNArguments *arguments)
{
    const unsigned n = arguments->N;
    struct RTCRayN *rays = (struct RTCRayN *)arguments->rayhit;
    struct RTCHitN *hits = (struct RTCHitN *)((float *)arguments->rayhit + sizeof(struct RTCRay) / 4 * n);
    for (unsigned k = 0; k < n; k++) {
        float t;
        if (!arguments->valid[k] || !meets_quadric(arguments->geometryUserPtr, rays, n, k, &t)) continue;
        RAY_FIELD(rays, n, k, tfar) = t;
        HIT_FIELD(hits, n, k, u) = HIT_FIELD(hits, n, k, v) = 0.0f;
        HIT_NUMBER(hits, n, k, geomID) = arguments->geomID;
        HIT_NUMBER(hits, n, k, primID) = arguments->primID;
        HIT_NUMBER(hits, n, k, instID[0]) = arguments->context->instID[0];
    }
}

static void quadric_occluded(const struct RTCOccludedFunctionNArguments *arguments)
{
    const unsigned n = arguments->N;
    for (unsigned k = 0; k < n; k++) {
        float t;
        if (arguments->valid[k] && meets_quadric(arguments->geometryUserPtr, arguments->ray, n, k, &t))
            RAY_FIELD(arguments->ray, n, k, tfar) = -INFINITY;
    }
}

/* ---- Building -------------------------------------------------------------------------------------------------- */

static RTCGeometry new_geometry(RTCDevice device, const ca_shape *shape)
{
    if (shape->kind == CA_SHAPE_MESH) {
        const ca_mesh *mesh = shape->as.mesh.mesh;
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh->positions, 0,
                                   3 * sizeof(float), mesh->vertex_count);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh->indices, 0,
                                   3 * sizeof(uint32_t), mesh->triangle_count);
        return geometry;
    }
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, 1);
    rtcSetGeometryUserData(geometry, (void *)(uintptr_t)shape); /* not const, but Embree only hands it back */
    rtcSetGeometryBoundsFunction(geometry, quadric_bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, quadric_intersect);
    rtcSetGeometryOccludedFunction(geometry, quadric_occluded);
    return geometry;
}

/* Embree asks now and then while it builds; false cancels that. */
static bool goes_on(void *user, double done)
{
    (void)done;
    const ca_accel *accel = user;
    return !ca_stop_asked(accel->stop);
}

static RTCScene new_scene(ca_accel *accel)
{
    RTCScene scene = rtcNewScene(accel->device);
    rtcSetSceneProgressMonitorFunction(scene, goes_on, accel);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    return scene;
}

static void attach_shape(RTCDevice device, RTCScene scene, const ca_shape *shape, uint32_t id)
{
    RTCGeometry geometry = new_geometry(device, shape);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
}

/* The world's quadrics, unless they are too many. */
static void set_quadrics_apart(ca_accel *accel)
{
    accel->apart_count = 0;
    for (uint32_t i = 0; i < accel->world_count; i++) {
        if (accel->shapes[i].kind == CA_SHAPE_MESH) continue;
        if (accel->apart_count == CA_QUADRICS_APART) {
            accel->apart_count = 0;
            return;
        }
        accel->apart[accel->apart_count++] = i;
    }
}

/* Shapes that are not apart, each as the geometry of its own number. */
static void attach_world(ca_accel *accel)
{
    accel->only_meshes = accel->instance_count == 0;
    for (uint32_t i = 0; i < accel->world_count; i++) {
        const bool quadric = accel->shapes[i].kind != CA_SHAPE_MESH;
        if (quadric && accel->apart_count > 0) continue;
        accel->only_meshes = accel->only_meshes && !quadric;
        attach_shape(accel->device, accel->scene, &accel->shapes[i], i);
    }
}

static void attach_instance(ca_accel *accel, uint32_t index)
{
    const ca_accel_instance *instance = &accel->instances[index];
    RTCScene *group = &accel->group_scenes[instance->first_shape];
    if (!*group) {
        *group = new_scene(accel);
        for (uint32_t i = 0; i < instance->shape_count; i++)
            attach_shape(accel->device, *group, &accel->shapes[instance->first_shape + i], i);
        rtcCommitScene(*group);
    }
    float columns[12];
    for (int column = 0; column < 4; column++)
        for (int row = 0; row < 3; row++) columns[3 * column + row] = instance->map.to[row][column];
    RTCGeometry geometry = rtcNewGeometry(accel->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, *group);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(accel->scene, geometry, accel->world_count + index);
    rtcReleaseGeometry(geometry);
}

static void set_cells(ca_accel *accel)
{
    enum { CELLS = 4 };
    struct RTCBounds bounds;
    rtcGetSceneBounds(accel->scene, &bounds);
    accel->low = (ca_vec3){bounds.lower_x, bounds.lower_y, bounds.lower_z};
    ca_vec3 high = {bounds.upper_x, bounds.upper_y, bounds.upper_z};
    for (uint32_t i = 0; i < accel->apart_count; i++) {
        ca_vec3 quadric_low, quadric_high;
        ca_shape_bounds(&accel->shapes[accel->apart[i]], &quadric_low, &quadric_high);
        accel->low = ca_min_vec3(accel->low, quadric_low);
        high = ca_max_vec3(high, quadric_high);
    }
    const ca_vec3 size = ca_sub(high, accel->low);
    accel->cells_per_meter = (ca_vec3){CELLS / size.x, CELLS / size.y, CELLS / size.z};
}

static ca_status set_reach(ca_accel *accel, ca_error *error)
{
    ca_ray_reach reach = CA_RAY_REACH;
    for (uint32_t i = 0; i < accel->instance_count; i++)
        if (!ca_ray_reach_limit(&reach, &accel->instances[i].map))
            return ca_fail(error, CA_ERROR_SCENE, NULL, "an instance's map has no inverse in single precision");
    accel->origin_length2 = reach.origin * reach.origin;
    accel->direction_length2 = reach.direction * reach.direction;
    return CA_OK;
}

static ca_status build(ca_accel *accel, uint32_t threads, ca_error *error)
{
    char config[64];
    CA_TRY(set_reach(accel, error));
    if (threads)
        snprintf(config, sizeof config, "isa=avx2,threads=%u", threads);
    else
        snprintf(config, sizeof config, "isa=avx2");
    accel->device = rtcNewDevice(config);
    if (!accel->device) return fail_embree(error, NULL, "creating its device");
    rtcSetDeviceMemoryMonitorFunction(accel->device, count_memory, accel);
    accel->scene = new_scene(accel);
    set_quadrics_apart(accel);
    attach_world(accel);
    for (uint32_t i = 0; i < accel->instance_count && goes_on(accel, 0.0); i++) attach_instance(accel, i);
    if (goes_on(accel, 0.0)) rtcCommitScene(accel->scene);
    CA_TRY(ca_stop_check(accel->stop, error));
    set_cells(accel);
    const enum RTCError code = rtcGetDeviceError(accel->device);
    if (code == RTC_ERROR_NONE) return CA_OK;
    if (code == RTC_ERROR_OUT_OF_MEMORY) return ca_fail_memory(error, "the acceleration structure");
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "Embree cannot build the scene (its error code is %d)",
                   (int)code);
}

ca_status ca_accel_create(const ca_shape *shapes, uint32_t shape_count, uint32_t world_count,
                          const ca_accel_instance *instances, uint32_t instance_count, uint32_t threads,
                          const int *stop, ca_accel **accel, ca_error *error)
{
    *accel = NULL;
    ca_accel *created = ca_alloc_zeroed(1, sizeof *created);
    if (!created) return ca_fail_memory(error, "the acceleration structure");
    created->shapes = shapes;
    created->shape_count = shape_count;
    created->world_count = world_count;
    created->instances = instances;
    created->instance_count = instance_count;
    created->stop = stop;
    created->group_scenes = ca_alloc_zeroed(shape_count, sizeof *created->group_scenes);
    const ca_status status =
        created->group_scenes ? build(created, threads, error) : ca_fail_memory(error, "the acceleration structure");
    if (status != CA_OK) {
        ca_accel_destroy(created);
        return status;
    }
    *accel = created;
    return CA_OK;
}

void ca_accel_destroy(ca_accel *accel)
{
    if (!accel) return;
    if (accel->scene) rtcReleaseScene(accel->scene);
    if (accel->group_scenes)
        for (uint32_t i = 0; i < accel->shape_count; i++)
            if (accel->group_scenes[i]) rtcReleaseScene(accel->group_scenes[i]);
    if (accel->device) rtcReleaseDevice(accel->device);
    ca_free(accel->group_scenes);
    ca_free(accel);
}

size_t ca_accel_bytes(const ca_accel *accel) { return __atomic_load_n(&accel->bytes, __ATOMIC_RELAXED); }

/* ---- Queries --------------------------------------------------------------------------------------------------- */

static inline struct RTCRay make_ray(ca_vec3 origin, ca_vec3 direction, float t_min, float t_max)
{
    return (struct RTCRay){.org_x = origin.x,
                           .org_y = origin.y,
                           .org_z = origin.z,
                           .tnear = t_min,
                           .dir_x = direction.x,
                           .dir_y = direction.y,
                           .dir_z = direction.z,
                           .tfar = t_max,
                           .mask = UINT32_MAX};
}

static inline void intersect1(RTCScene scene, struct RTCRayHit *rayhit)
{
#if CA_EMBREE_MAJOR >= 4
    rtcIntersect1(scene, rayhit, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, rayhit);
#endif
}

static inline void occluded1(RTCScene scene, struct RTCRay *ray)
{
#if CA_EMBREE_MAJOR >= 4
    rtcOccluded1(scene, ray, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, ray);
#endif
}

bool ca_accel_meet_embree(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit)
{
    struct RTCRayHit rayhit;
    rayhit.ray = make_ray(origin, direction, t_min, hit->t);
    rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    intersect1(accel->scene, &rayhit);
    if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    hit->t = rayhit.ray.tfar;
    hit->u = rayhit.hit.u;
    hit->v = rayhit.hit.v;
    hit->ng = (ca_vec3){rayhit.hit.Ng_x, rayhit.hit.Ng_y, rayhit.hit.Ng_z};
    hit->primitive = rayhit.hit.primID;
    hit->shape = rayhit.hit.geomID;
    hit->instance = CA_NONE;
    if (rayhit.hit.instID[0] != RTC_INVALID_GEOMETRY_ID) {
        hit->instance = rayhit.hit.instID[0] - accel->world_count;
        hit->shape += accel->instances[hit->instance].first_shape;
    }
    return true;
}

bool ca_accel_intersect(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max,
                        ca_hit *hit)
{
    *hit = (ca_hit){.t = t_max, .shape = CA_NONE, .instance = CA_NONE};
    assert(ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max) || t_max <= t_min);
    if (!ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max)) return false;
    for (uint32_t i = 0; i < accel->apart_count; i++) {
        const ca_shape *quadric = &accel->shapes[accel->apart[i]];
        if (ca_quadric_intersect(quadric, origin, direction, t_min, hit->t, &hit->t)) hit->shape = accel->apart[i];
    }
    return ca_accel_meet_embree(accel, origin, direction, t_min, hit) || hit->shape != CA_NONE;
}

bool ca_accel_occluded(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max)
{
    assert(ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max) || t_max <= t_min);
    if (!ca_accel_ray_is_valid(accel, origin, direction, t_min, t_max)) return false;
    for (uint32_t i = 0; i < accel->apart_count; i++) {
        float t;
        if (ca_quadric_intersect(&accel->shapes[accel->apart[i]], origin, direction, t_min, t_max, &t)) return true;
    }
    struct RTCRay ray = make_ray(origin, direction, t_min, t_max);
    occluded1(accel->scene, &ray);
    return ray.tfar < 0.0f;
}

bool ca_accel_visible(const ca_accel *accel, ca_vec3 a, ca_vec3 a_error, ca_vec3 a_ng, ca_vec3 b, ca_vec3 b_error,
                      ca_vec3 b_ng)
{
    const ca_segment segment = ca_segment_between(a, a_error, a_ng, b, b_error, b_ng);
    return !ca_accel_occluded(accel, segment.origin, segment.direction, 0.0f, ca_visible_t_max);
}

const ca_shape *ca_accel_shape(const ca_accel *accel, uint32_t shape) { return &accel->shapes[shape]; }

const ca_accel_instance *ca_accel_instance_at(const ca_accel *accel, uint32_t instance)
{
    return &accel->instances[instance];
}
