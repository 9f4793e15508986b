#include "geometry/accel.h"

#include "base/memory.h"
#include "geometry/quadric.h"
#include "math/numeric.h"

#include <assert.h>
#include <stdio.h>

#if CA_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

struct ca_accel {
    RTCDevice device;
    RTCScene scene;
    RTCScene *group_scenes; /* [shape_count], at a group's first shape; NULL elsewhere */
    const ca_shape *shapes;
    uint32_t shape_count, world_count;
    const ca_accel_instance *instances; /* Embree's geometry ids world_count, world_count + 1, ... */
    uint32_t instance_count;
    size_t bytes;
};

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

static void quadric_intersect(const struct RTCIntersectFunctionNArguments *arguments)
{
    if (!arguments->valid[0]) return;
    assert(arguments->N == 1);
    struct RTCRayHit *rayhit = (struct RTCRayHit *)arguments->rayhit;
    struct RTCRay *ray = &rayhit->ray;
    float t;
    if (!ca_quadric_intersect(arguments->geometryUserPtr, (ca_vec3){ray->org_x, ray->org_y, ray->org_z},
                              (ca_vec3){ray->dir_x, ray->dir_y, ray->dir_z}, ray->tnear, ray->tfar, &t))
        return;
    ray->tfar = t;
    rayhit->hit.u = rayhit->hit.v = 0.0f;
    rayhit->hit.geomID = arguments->geomID;
    rayhit->hit.primID = arguments->primID;
    rayhit->hit.instID[0] = arguments->context->instID[0];
}

static void quadric_occluded(const struct RTCOccludedFunctionNArguments *arguments)
{
    if (!arguments->valid[0]) return;
    assert(arguments->N == 1);
    struct RTCRay *ray = (struct RTCRay *)arguments->ray;
    float t;
    if (ca_quadric_intersect(arguments->geometryUserPtr, (ca_vec3){ray->org_x, ray->org_y, ray->org_z},
                             (ca_vec3){ray->dir_x, ray->dir_y, ray->dir_z}, ray->tnear, ray->tfar, &t))
        ray->tfar = -INFINITY;
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
    rtcSetGeometryUserData(geometry, (void *)(uintptr_t)shape);
    rtcSetGeometryBoundsFunction(geometry, quadric_bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, quadric_intersect);
    rtcSetGeometryOccludedFunction(geometry, quadric_occluded);
    return geometry;
}

static RTCScene new_scene(RTCDevice device)
{
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    return scene;
}

/* Attaches shapes as geometries 0, 1, ... */
static void attach_shapes(RTCDevice device, RTCScene scene, const ca_shape *shapes, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        RTCGeometry geometry = new_geometry(device, &shapes[i]);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, i);
        rtcReleaseGeometry(geometry);
    }
}

static void attach_instance(ca_accel *accel, uint32_t index)
{
    const ca_accel_instance *instance = &accel->instances[index];
    RTCScene *group = &accel->group_scenes[instance->first_shape];
    if (!*group) {
        *group = new_scene(accel->device);
        attach_shapes(accel->device, *group, accel->shapes + instance->first_shape, instance->shape_count);
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

static ca_status build(ca_accel *accel, uint32_t threads, ca_error *error)
{
    char config[64];
    if (threads)
        snprintf(config, sizeof config, "isa=avx2,threads=%u", threads);
    else
        snprintf(config, sizeof config, "isa=avx2");
    accel->device = rtcNewDevice(config);
    if (!accel->device) return fail_embree(error, NULL, "creating its device");
    rtcSetDeviceMemoryMonitorFunction(accel->device, count_memory, accel);
    accel->scene = new_scene(accel->device);
    attach_shapes(accel->device, accel->scene, accel->shapes, accel->world_count);
    for (uint32_t i = 0; i < accel->instance_count; i++) attach_instance(accel, i);
    rtcCommitScene(accel->scene);
    const enum RTCError code = rtcGetDeviceError(accel->device);
    if (code == RTC_ERROR_NONE) return CA_OK;
    if (code == RTC_ERROR_OUT_OF_MEMORY) return ca_fail_memory(error, "the acceleration structure");
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "Embree cannot build the scene (its error code is %d)",
                   (int)code);
}

ca_status ca_accel_create(const ca_shape *shapes, uint32_t shape_count, uint32_t world_count,
                          const ca_accel_instance *instances, uint32_t instance_count, uint32_t threads,
                          ca_accel **accel, ca_error *error)
{
    *accel = NULL;
    ca_accel *created = ca_alloc_zeroed(1, sizeof *created);
    if (!created) return ca_fail_memory(error, "the acceleration structure");
    created->shapes = shapes;
    created->shape_count = shape_count;
    created->world_count = world_count;
    created->instances = instances;
    created->instance_count = instance_count;
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

/* Embree's asserts abort the process on rays that are not finite or start beyond 1e30: such a ray meets nothing. A
 * comparison with NaN is false, and squares overflow to infinity early enough. */
static inline bool ray_is_valid(ca_vec3 origin, ca_vec3 direction, float t_min, float t_max)
{
    return ca_length2(origin) < 1e36f && ca_length2(direction) < INFINITY && t_min >= 0.0f && t_max > t_min;
}

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

bool ca_accel_intersect(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max,
                        ca_hit *hit)
{
    hit->shape = CA_NONE;
    assert(ray_is_valid(origin, direction, t_min, t_max) || t_max <= t_min);
    if (!ray_is_valid(origin, direction, t_min, t_max)) return false;
    struct RTCRayHit rayhit;
    rayhit.ray = make_ray(origin, direction, t_min, t_max);
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

bool ca_accel_occluded(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max)
{
    assert(ray_is_valid(origin, direction, t_min, t_max) || t_max <= t_min);
    if (!ray_is_valid(origin, direction, t_min, t_max)) return false;
    struct RTCRay ray = make_ray(origin, direction, t_min, t_max);
    occluded1(accel->scene, &ray);
    return ray.tfar < 0.0f;
}

/* Beyond this the far end itself would be met: the far point has been moved towards the near one by its own rounding
 * error, what remains is the relative rounding of t inside the intersection (about a dozen operations). */
static const float visible_t_max = 1.0f - CA_GAMMA(16);

bool ca_accel_visible(const ca_accel *accel, ca_vec3 a, ca_vec3 a_error, ca_vec3 a_ng, ca_vec3 b, ca_vec3 b_error,
                      ca_vec3 b_ng)
{
    const ca_vec3 a_to_b = ca_sub(b, a);
    const ca_vec3 origin = ca_offset_origin(a, a_error, a_ng, a_to_b);
    const ca_vec3 target = ca_offset_origin(b, b_error, b_ng, ca_neg(a_to_b));
    return !ca_accel_occluded(accel, origin, ca_sub(target, origin), 0.0f, visible_t_max);
}

const ca_shape *ca_accel_shape(const ca_accel *accel, uint32_t shape) { return &accel->shapes[shape]; }

const ca_accel_instance *ca_accel_instance_at(const ca_accel *accel, uint32_t instance)
{
    return &accel->instances[instance];
}
