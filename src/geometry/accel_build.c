/* Building Embree's structures, and sharing those that a scene's previous version has. */
#include "geometry/accel_embree.h"

#include "base/loading.h"
#include "base/memory.h"
#include "base/stop.h"
#include "geometry/curve.h"
#include "geometry/quadric.h"
#include "geometry/ray_reach.h"
#include "geometry/sdf_grid.h"
#include "math/numeric.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* ---- The device ------------------------------------------------------------------------------------------------ */

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
    ca_accel_device *device = user;
    __atomic_add_fetch(&device->bytes, (size_t)bytes, __ATOMIC_RELAXED);
    return true;
}

static ca_status create_device(uint32_t threads, ca_accel_device **device, ca_error *error)
{
    char config[64];
    *device = NULL;
    ca_accel_device *created = ca_alloc_zeroed(1, sizeof *created);
    if (!created) return ca_fail_memory(error, "the acceleration structure");
    if (threads)
        snprintf(config, sizeof config, "isa=avx2,threads=%u", threads);
    else
        snprintf(config, sizeof config, "isa=avx2");
    atomic_init(&created->owners, 1);
    created->device = rtcNewDevice(config);
    if (!created->device) {
        ca_free(created);
        return fail_embree(error, NULL, "creating its device");
    }
    rtcSetDeviceMemoryMonitorFunction(created->device, count_memory, created);
    *device = created;
    return CA_OK;
}

static ca_accel_device *share_device(ca_accel_device *device)
{
    atomic_fetch_add(&device->owners, 1);
    return device;
}

static void release_device(ca_accel_device *device)
{
    if (!device || atomic_fetch_sub(&device->owners, 1) != 1) return;
    rtcReleaseDevice(device->device);
    ca_free(device);
}

/* ---- Quadrics and voxels as Embree's user geometry ------------------------------------------------------------- */

static void exact_bounds(const struct RTCBoundsFunctionArguments *arguments)
{
    const ca_shape *shape = arguments->geometryUserPtr;
    ca_vec3 low, high;
    if (shape->kind == CA_SHAPE_SDF_GRID)
        ca_sdf_grid_voxel_bounds(shape->as.sdf.grid, arguments->primID, &low, &high);
    else
        ca_shape_bounds(shape, &low, &high);
    struct RTCBounds *bounds = arguments->bounds_o;
    bounds->lower_x = low.x, bounds->lower_y = low.y, bounds->lower_z = low.z;
    bounds->upper_x = high.x, bounds->upper_y = high.y, bounds->upper_z = high.z;
}

/* Embree hands over any number of rays by components: the k-th value of a field of N rays lies at N times the field's
 * number in a single ray, plus k (Embree's API manual, RTCRayN and RTCHitN). */
#define RAY_FIELD(rays, n, k, field) (((float *)(rays))[offsetof(struct RTCRay, field) / 4 * (n) + (k)])
#define HIT_FIELD(hits, n, k, field) (((float *)(hits))[offsetof(struct RTCHit, field) / 4 * (n) + (k)])
#define HIT_NUMBER(hits, n, k, field) (((unsigned *)(hits))[offsetof(struct RTCHit, field) / 4 * (n) + (k)])

static bool meets_exact(const ca_shape *shape, unsigned primitive, struct RTCRayN *rays, unsigned n, unsigned k,
                        float *t)
{
    const ca_vec3 origin = {RAY_FIELD(rays, n, k, org_x), RAY_FIELD(rays, n, k, org_y), RAY_FIELD(rays, n, k, org_z)};
    const ca_vec3 direction = {RAY_FIELD(rays, n, k, dir_x), RAY_FIELD(rays, n, k, dir_y),
                               RAY_FIELD(rays, n, k, dir_z)};
    const float near = RAY_FIELD(rays, n, k, tnear), far = RAY_FIELD(rays, n, k, tfar);
    if (shape->kind == CA_SHAPE_SDF_GRID)
        return ca_sdf_grid_intersect(shape->as.sdf.grid, primitive, origin, direction, near, far, t);
    return ca_quadric_intersect(shape, origin, direction, near, far, t);
}

static void exact_intersect(const struct RTCIntersectFunctionNArguments *arguments)
{
    const unsigned n = arguments->N, primitive = arguments->primID;
    const ca_shape *shape = arguments->geometryUserPtr;
    struct RTCRayN *rays = (struct RTCRayN *)arguments->rayhit;
    struct RTCHitN *hits = (struct RTCHitN *)((float *)arguments->rayhit + sizeof(struct RTCRay) / 4 * n);
    for (unsigned k = 0; k < n; k++) {
        float t;
        if (!arguments->valid[k] || !meets_exact(shape, primitive, rays, n, k, &t)) continue;
        RAY_FIELD(rays, n, k, tfar) = t;
        HIT_FIELD(hits, n, k, u) = HIT_FIELD(hits, n, k, v) = 0.0f;
        HIT_NUMBER(hits, n, k, geomID) = arguments->geomID;
        HIT_NUMBER(hits, n, k, primID) = primitive;
        HIT_NUMBER(hits, n, k, instID[0]) = arguments->context->instID[0];
    }
}

static void exact_occluded(const struct RTCOccludedFunctionNArguments *arguments)
{
    const unsigned n = arguments->N;
    for (unsigned k = 0; k < n; k++) {
        float t;
        if (arguments->valid[k] &&
            meets_exact(arguments->geometryUserPtr, arguments->primID, arguments->ray, n, k, &t))
            RAY_FIELD(arguments->ray, n, k, tfar) = -INFINITY;
    }
}

/* ---- Curves ---------------------------------------------------------------------------------------------------- */

/* Curves are met from outside only, as in Mitsuba 3: ends of cubic ones are open. */
static void curve_filter(const struct RTCFilterFunctionNArguments *arguments)
{
    const unsigned n = arguments->N;
    struct RTCRayN *rays = arguments->ray;
    struct RTCHitN *hits = arguments->hit;
    for (unsigned k = 0; k < n; k++) {
        const float cosine = RAY_FIELD(rays, n, k, dir_x) * HIT_FIELD(hits, n, k, Ng_x) +
                             RAY_FIELD(rays, n, k, dir_y) * HIT_FIELD(hits, n, k, Ng_y) +
                             RAY_FIELD(rays, n, k, dir_z) * HIT_FIELD(hits, n, k, Ng_z);
        if (cosine > 0.0f) arguments->valid[k] = 0;
    }
}

/* ---- Structures ------------------------------------------------------------------------------------------------ */

static void release_part(ca_accel_part *part)
{
    if (!part || atomic_fetch_sub(&part->owners, 1) != 1) return;
    if (part->scene) rtcReleaseScene(part->scene);
    for (uint32_t i = 0; part->meshes && i < part->count; i++) ca_mesh_destroy(&part->meshes[i]);
    for (uint32_t i = 0; part->curves && i < part->count; i++) ca_curve_destroy(part->curves[i]);
    for (uint32_t i = 0; part->grids && i < part->count; i++) ca_sdf_grid_destroy(part->grids[i]);
    ca_free(part->meshes);
    ca_free(part->curves);
    ca_free(part->grids);
    ca_free(part->shapes);
    release_device(part->device);
    ca_free(part);
}

static ca_accel_part *share_part(ca_accel_part *part)
{
    atomic_fetch_add(&part->owners, 1);
    return part;
}

/* Embree asks now and then while it builds; false cancels that. */
static bool goes_on(void *user, double done)
{
    const ca_accel *accel = user;
    ca_loading_tell(done);
    return !ca_stop_asked(accel->stop);
}

/* Without geometries yet, and with copies of the shapes. NULL when out of memory. */
static ca_accel_part *new_part(ca_accel *accel, const ca_shape *shapes, uint32_t count)
{
    ca_accel_part *part = ca_alloc_zeroed(1, sizeof *part);
    if (!part) return NULL;
    atomic_init(&part->owners, 1);
    part->device = share_device(accel->device);
    part->count = count;
    part->shapes = ca_alloc(count, sizeof *part->shapes);
    part->meshes = ca_alloc_zeroed(count, sizeof *part->meshes);
    part->curves = ca_alloc_zeroed(count, sizeof(ca_curve *));
    part->grids = ca_alloc_zeroed(count, sizeof(ca_sdf_grid *));
    part->scene = rtcNewScene(accel->device->device);
    if (!part->shapes || !part->meshes || !part->curves || !part->grids || !part->scene) {
        release_part(part);
        return NULL;
    }
    if (count) memcpy(part->shapes, shapes, count * sizeof *shapes);
    for (uint32_t i = 0; i < count; i++) {
        if (shapes[i].kind == CA_SHAPE_CURVE)
            part->shapes[i].as.curve.curve = part->curves[i] = ca_curve_share(shapes[i].as.curve.curve);
        if (shapes[i].kind == CA_SHAPE_SDF_GRID)
            part->shapes[i].as.sdf.grid = part->grids[i] = ca_sdf_grid_share(shapes[i].as.sdf.grid);
        if (shapes[i].kind != CA_SHAPE_MESH) continue;
        part->meshes[i] = ca_mesh_share(shapes[i].as.mesh.mesh);
        part->shapes[i].as.mesh.mesh = &part->meshes[i];
    }
    rtcSetSceneProgressMonitorFunction(part->scene, goes_on, accel);
    rtcSetSceneFlags(part->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(part->scene, RTC_BUILD_QUALITY_MEDIUM);
    return part;
}

static void build_part(ca_accel *accel, ca_accel_part *part)
{
    rtcCommitScene(part->scene);
    rtcSetSceneProgressMonitorFunction(part->scene, NULL, NULL); /* it outlives `accel` */
    accel->builds++;
}

static RTCGeometry new_curve(RTCDevice device, const ca_curve *curve)
{
    RTCGeometry geometry = rtcNewGeometry(device, curve->degree == CA_CURVE_CUBIC
                                                      ? RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE
                                                      : RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, curve->points, 0,
                               4 * sizeof(float), curve->point_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, curve->segments, 0,
                               sizeof(uint32_t), curve->segment_count);
    rtcSetGeometryIntersectFilterFunction(geometry, curve_filter);
    rtcSetGeometryOccludedFilterFunction(geometry, curve_filter);
    return geometry;
}

static RTCGeometry new_geometry(RTCDevice device, const ca_shape *shape)
{
    if (shape->kind == CA_SHAPE_CURVE) return new_curve(device, shape->as.curve.curve);
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
    rtcSetGeometryUserPrimitiveCount(geometry,
                                     shape->kind == CA_SHAPE_SDF_GRID ? shape->as.sdf.grid->voxel_count : 1);
    rtcSetGeometryUserData(geometry, (void *)(uintptr_t)shape); /* not const, but Embree only hands it back */
    rtcSetGeometryBoundsFunction(geometry, exact_bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, exact_intersect);
    rtcSetGeometryOccludedFunction(geometry, exact_occluded);
    return geometry;
}

static void attach_shape(ca_accel_part *part, uint32_t index)
{
    RTCGeometry geometry = new_geometry(part->device->device, &part->shapes[index]);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(part->scene, geometry, index);
    rtcReleaseGeometry(geometry);
}

/* ---- What is the same ------------------------------------------------------------------------------------------ */

static bool same_bytes(const void *a, const void *b, size_t size) { return a == b || memcmp(a, b, size) == 0; }

static bool same_mesh(const ca_mesh *a, const ca_mesh *b)
{
    return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
           same_bytes(a->positions, b->positions, 3 * sizeof(float) * a->vertex_count) &&
           same_bytes(a->indices, b->indices, 3 * sizeof(uint32_t) * a->triangle_count);
}

/* Is it, to the bit, the same to rays? */
static bool same_shape(const ca_shape *a, const ca_shape *b)
{
    if (a->kind != b->kind) return false;
    switch (a->kind) {
    case CA_SHAPE_MESH: return same_mesh(a->as.mesh.mesh, b->as.mesh.mesh);
    case CA_SHAPE_SPHERE: return same_bytes(&a->as.sphere, &b->as.sphere, sizeof a->as.sphere);
    case CA_SHAPE_DISK: return same_bytes(&a->as.disk, &b->as.disk, sizeof a->as.disk);
    case CA_SHAPE_CYLINDER: return same_bytes(&a->as.cylinder, &b->as.cylinder, sizeof a->as.cylinder);
    case CA_SHAPE_CURVE: return ca_curve_equal(a->as.curve.curve, b->as.curve.curve);
    case CA_SHAPE_SDF_GRID: return ca_sdf_grid_equal(a->as.sdf.grid, b->as.sdf.grid);
    case CA_SHAPE_KIND_COUNT: break;
    }
    return false;
}

static bool same_shapes(const ca_accel_part *part, const ca_shape *shapes, uint32_t count)
{
    bool same = part->count == count;
    for (uint32_t i = 0; i < count && same; i++) same = same_shape(&part->shapes[i], &shapes[i]);
    return same;
}

/* ---- The world ------------------------------------------------------------------------------------------------- */

static bool keeps_apart = true;

void ca_accel_keep_apart(bool keep) { keeps_apart = keep; }

static bool is_quadric(const ca_shape *shape)
{
    return shape->kind == CA_SHAPE_SPHERE || shape->kind == CA_SHAPE_DISK || shape->kind == CA_SHAPE_CYLINDER;
}

/* The world's quadrics, unless they are too many. */
static void set_quadrics_apart(ca_accel *accel)
{
    accel->apart_count = 0;
    for (uint32_t i = 0; i < accel->world_count; i++) {
        if (!is_quadric(&accel->shapes[i])) continue;
        if (accel->apart_count == CA_QUADRICS_APART) {
            accel->apart_count = 0;
            return;
        }
        accel->apart[accel->apart_count++] = i;
    }
}

static bool is_embrees(const ca_accel *accel, uint32_t shape)
{
    if (accel->shapes[shape].kind == CA_SHAPE_MESH) return !ca_facets_have(&accel->facets, shape);
    return !is_quadric(&accel->shapes[shape]) || accel->apart_count == 0;
}

/* Shapes that are apart may be others. */
static bool same_world(const ca_accel *accel, const ca_accel *previous)
{
    bool same = previous->world && previous->world_count == accel->world_count;
    for (uint32_t i = 0; i < accel->world_count && same; i++) {
        same = is_embrees(accel, i) == is_embrees(previous, i);
        if (same && is_embrees(accel, i)) same = same_shape(&previous->world->shapes[i], &accel->shapes[i]);
    }
    return same;
}

/* Shapes that are not apart, each as the geometry of its own number. */
static bool build_world(ca_accel *accel, const ca_accel *previous)
{
    bool any = false;
    accel->world_meshes = true;
    for (uint32_t i = 0; i < accel->world_count; i++) {
        if (!is_embrees(accel, i)) continue;
        any = true;
        accel->world_meshes = accel->world_meshes && accel->shapes[i].kind == CA_SHAPE_MESH;
    }
    if (!any) return true;
    if (previous && same_world(accel, previous)) {
        accel->world = share_part(previous->world);
    } else {
        accel->world = new_part(accel, accel->shapes, accel->world_count);
        if (!accel->world) return false;
        for (uint32_t i = 0; i < accel->world_count; i++)
            if (is_embrees(accel, i)) attach_shape(accel->world, i);
        build_part(accel, accel->world);
    }
    accel->world_scene = accel->world->scene;
    return true;
}

/* ---- Groups and instances -------------------------------------------------------------------------------------- */

/* Of a group of the same shapes; NULL: there is none. Where it was before is where it is looked for first. */
static ca_accel_part *find_group(const ca_accel *previous, const ca_shape *shapes, uint32_t first, uint32_t count)
{
    const uint32_t groups = previous ? previous->shape_count : 0;
    for (uint32_t i = 0; i < groups; i++) {
        ca_accel_part *group = previous->groups[(first + i) % groups];
        if (group && same_shapes(group, shapes, count)) return group;
    }
    return NULL;
}

static bool build_group(ca_accel *accel, const ca_accel *previous, const ca_accel_instance *instance)
{
    const ca_shape *shapes = &accel->shapes[instance->first_shape];
    ca_accel_part **group = &accel->groups[instance->first_shape];
    if (*group) return true;
    ca_accel_part *found = find_group(previous, shapes, instance->first_shape, instance->shape_count);
    if (found) {
        *group = share_part(found);
        return true;
    }
    *group = new_part(accel, shapes, instance->shape_count);
    if (!*group) return false;
    for (uint32_t i = 0; i < instance->shape_count; i++) attach_shape(*group, i);
    build_part(accel, *group);
    return true;
}

static ca_accel_part *group_of(const ca_accel *accel, uint32_t instance)
{
    return accel->groups[accel->instances[instance].first_shape];
}

static void attach_instance(ca_accel *accel, uint32_t index)
{
    const ca_affine *map = &accel->instances[index].map;
    float columns[12];
    for (int column = 0; column < 4; column++)
        for (int row = 0; row < 3; row++) columns[3 * column + row] = map->to[row][column];
    RTCGeometry geometry = rtcNewGeometry(accel->device->device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, group_of(accel, index)->scene);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(accel->top->scene, geometry, index);
    rtcReleaseGeometry(geometry);
}

/* Once the groups are known. */
static bool same_instances(const ca_accel *accel, const ca_accel *previous)
{
    bool same = previous->instance_count == accel->instance_count;
    for (uint32_t i = 0; i < accel->instance_count && same; i++)
        same = group_of(accel, i) == group_of(previous, i) &&
               same_bytes(&accel->instances[i].map, &previous->instances[i].map, sizeof previous->instances[i].map);
    return same;
}

static bool build_top(ca_accel *accel, const ca_accel *previous)
{
    if (accel->instance_count == 0) return true;
    if (previous && same_instances(accel, previous)) {
        accel->top = share_part(previous->top);
    } else {
        accel->top = new_part(accel, NULL, 0);
        if (!accel->top) return false;
        for (uint32_t i = 0; i < accel->instance_count; i++) attach_instance(accel, i);
        build_part(accel, accel->top);
    }
    accel->top_scene = accel->top->scene;
    return true;
}

/* ---- The whole ------------------------------------------------------------------------------------------------- */

static void add_bounds(RTCScene scene, ca_vec3 *low, ca_vec3 *high)
{
    struct RTCBounds bounds;
    if (!scene) return;
    rtcGetSceneBounds(scene, &bounds);
    *low = ca_min_vec3(*low, (ca_vec3){bounds.lower_x, bounds.lower_y, bounds.lower_z});
    *high = ca_max_vec3(*high, (ca_vec3){bounds.upper_x, bounds.upper_y, bounds.upper_z});
}

static void set_cells(ca_accel *accel)
{
    enum { CELLS = 4 };
    ca_vec3 high = {-INFINITY, -INFINITY, -INFINITY};
    accel->low = ca_neg(high);
    add_bounds(accel->world_scene, &accel->low, &high);
    add_bounds(accel->top_scene, &accel->low, &high);
    for (uint32_t i = 0; i < accel->world_count; i++) {
        if (is_embrees(accel, i)) continue;
        ca_vec3 shape_low, shape_high;
        ca_shape_bounds(&accel->shapes[i], &shape_low, &shape_high);
        accel->low = ca_min_vec3(accel->low, shape_low);
        high = ca_max_vec3(high, shape_high);
    }
    const ca_vec3 size = ca_sub(high, accel->low);
    accel->cells_per_meter = (ca_vec3){CELLS / size.x, CELLS / size.y, CELLS / size.z};
}

/* Of instances that are too many their common bounds. */
static void set_boxes(ca_accel *accel)
{
    const bool few = accel->instance_count <= CA_ACCEL_BOXES;
    struct RTCBounds b;
    accel->world_boxes.all = accel->world_scene && !keeps_apart;
    accel->top_boxes.all = accel->top_scene && !keeps_apart;
    if (accel->world_scene) {
        rtcGetSceneBounds(accel->world_scene, &b);
        ca_accel_boxes_add(&accel->world_boxes, (ca_vec3){b.lower_x, b.lower_y, b.lower_z},
                           (ca_vec3){b.upper_x, b.upper_y, b.upper_z}, NULL);
    }
    for (uint32_t i = 0; i < (few ? accel->instance_count : 1) && accel->top_scene; i++) {
        rtcGetSceneBounds(few ? group_of(accel, i)->scene : accel->top_scene, &b);
        ca_accel_boxes_add(&accel->top_boxes, (ca_vec3){b.lower_x, b.lower_y, b.lower_z},
                           (ca_vec3){b.upper_x, b.upper_y, b.upper_z}, few ? &accel->instances[i].map : NULL);
    }
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

/* In an order in which each finds what it borrows. */
static ca_status build_parts(ca_accel *accel, const ca_accel *previous, ca_error *error)
{
    const size_t instances = accel->instance_count, steps = instances > 0 ? instances + 2 : 1;
    ca_loading_step("building", 0, steps);
    bool good = build_world(accel, previous);
    for (uint32_t i = 0; i < instances && good && goes_on(accel, 0.0); i++) {
        ca_loading_step("building", i + 1, steps);
        good = build_group(accel, previous, &accel->instances[i]);
    }
    CA_TRY(ca_stop_check(accel->stop, error));
    if (instances > 0) ca_loading_step("building", instances + 1, steps);
    if (good) good = build_top(accel, previous);
    CA_TRY(ca_stop_check(accel->stop, error));
    return good ? CA_OK : ca_fail_memory(error, "the acceleration structure");
}

static ca_status build(ca_accel *accel, const ca_accel *previous, uint32_t threads, ca_error *error)
{
    CA_TRY(set_reach(accel, error));
    if (previous)
        accel->device = share_device(previous->device);
    else
        CA_TRY(create_device(threads, &accel->device, error));
    if (keeps_apart) {
        set_quadrics_apart(accel);
        if (!ca_facets_fill(&accel->facets, accel->shapes, accel->world_count))
            return ca_fail_memory(error, "the acceleration structure");
    }
    CA_TRY(build_parts(accel, previous, error));
    set_cells(accel);
    set_boxes(accel);
    const enum RTCError code = rtcGetDeviceError(accel->device->device);
    if (code == RTC_ERROR_NONE) return CA_OK;
    if (code == RTC_ERROR_OUT_OF_MEMORY) return ca_fail_memory(error, "the acceleration structure");
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "Embree cannot build the scene (its error code is %d)",
                   (int)code);
}

ca_status ca_accel_create(const ca_shape *shapes, uint32_t shape_count, uint32_t world_count,
                          const ca_accel_instance *instances, uint32_t instance_count, uint32_t threads,
                          const int *stop, ca_accel **accel, ca_error *error)
{
    return ca_accel_create_after(NULL, shapes, shape_count, world_count, instances, instance_count, threads, stop,
                                 accel, error);
}

ca_status ca_accel_create_after(const ca_accel *previous, const ca_shape *shapes, uint32_t shape_count,
                                uint32_t world_count, const ca_accel_instance *instances, uint32_t instance_count,
                                uint32_t threads, const int *stop, ca_accel **accel, ca_error *error)
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
    created->groups = ca_alloc_zeroed(shape_count, sizeof *created->groups);
    const ca_status status = created->groups ? build(created, previous, threads, error)
                                             : ca_fail_memory(error, "the acceleration structure");
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
    release_part(accel->top);
    release_part(accel->world);
    for (uint32_t i = 0; accel->groups && i < accel->shape_count; i++) release_part(accel->groups[i]);
    release_device(accel->device);
    ca_free(accel->groups);
    ca_free(accel);
}

size_t ca_accel_bytes(const ca_accel *accel) { return __atomic_load_n(&accel->device->bytes, __ATOMIC_RELAXED); }

uint32_t ca_accel_builds(const ca_accel *accel) { return accel->builds; }
