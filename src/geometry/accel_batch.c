/* Batches of rays through Embree, sorted and in packets of eight. */
#include "geometry/accel_embree.h"
#include "geometry/ray_batch.h"

#include <string.h>

/* Sorting pays from two packets on. */
enum { OCTANT_CELLS = 64, KEYS = 8 * OCTANT_CELLS, LEAST_SORTED = 2 * CA_LANES };

/* Which rays go together: by the octant of the direction, then by the place of the origin in a grid of 4 x 4 x 4
 * cells, in Z order. */
static void sort_keys(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, uint32_t *keys)
{
    const ca_v8 low = ca_v8_all(accel->low), scale = ca_v8_all(accel->cells_per_meter);
    const ca_f8 zero = ca_f8_all(0.0f), last = ca_f8_all(3.0f);
    for (uint32_t i = 0; i < count; i += CA_LANES) {
        const ca_v8 o = ca_sub_v8(ca_column3_load(&rays->origin, i), low), d = ca_column3_load(&rays->direction, i);
        const ca_m8 x = __builtin_convertvector(ca_min8(last, ca_max8(o.x * scale.x, zero)), ca_m8);
        const ca_m8 y = __builtin_convertvector(ca_min8(last, ca_max8(o.y * scale.y, zero)), ca_m8);
        const ca_m8 z = __builtin_convertvector(ca_min8(last, ca_max8(o.z * scale.z, zero)), ca_m8);
        const ca_m8 octant = ((d.x < 0.0f) & 1) | ((d.y < 0.0f) & 2) | ((d.z < 0.0f) & 4);
        const ca_m8 cell =
            (x & 1) | (y & 1) << 1 | (z & 1) << 2 | (x & 2) << 2 | (y & 2) << 3 | (z & 2) << 4;
        ca_store8_u32(keys, i, (octant << 6 | cell) & (KEYS - 1));
    }
}

/* A stable counting sort. */
static void sort_rays(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, uint16_t *order)
{
    _Alignas(32) uint32_t keys[CA_RAY_BATCH];
    uint16_t starts[KEYS + 1] = {0};
    if (count < LEAST_SORTED) {
        for (uint32_t i = 0; i < count; i++) order[i] = (uint16_t)i;
        return;
    }
    sort_keys(accel, rays, count, keys);
    for (uint32_t i = 0; i < count; i++) starts[keys[i] + 1]++;
    for (uint32_t k = 0; k < KEYS; k++) starts[k + 1] = (uint16_t)(starts[k + 1] + starts[k]);
    for (uint32_t i = 0; i < count; i++) order[starts[keys[i]]++] = (uint16_t)i;
}

/* A lane that takes no part keeps a harmless ray. Which rays are valid: accel.c. */
static void pack_ray(const ca_ray_batch *rays, uint32_t i, uint32_t lane, struct RTCRay8 *packet, int *valid)
{
    const ca_vec3 origin = ca_column3_at(&rays->origin, i), direction = ca_column3_at(&rays->direction, i);
    const float t_min = rays->t_min[i], t_max = rays->t_max[i];
    valid[lane] = ca_accel_ray_is_valid(origin, direction, t_min, t_max) ? -1 : 0;
    packet->org_x[lane] = origin.x, packet->org_y[lane] = origin.y, packet->org_z[lane] = origin.z;
    packet->dir_x[lane] = direction.x, packet->dir_y[lane] = direction.y, packet->dir_z[lane] = direction.z;
    packet->tnear[lane] = t_min, packet->tfar[lane] = t_max;
    packet->time[lane] = 0.0f;
    packet->mask[lane] = UINT32_MAX, packet->id[lane] = 0, packet->flags[lane] = 0;
}

static uint32_t pack_rays(const ca_ray_batch *rays, const uint16_t *order, uint32_t left, struct RTCRay8 *packet,
                          int *valid)
{
    const uint32_t lanes = left < CA_LANES ? left : CA_LANES;
    for (uint32_t lane = 0; lane < lanes; lane++) pack_ray(rays, order[lane], lane, packet, valid);
    for (uint32_t lane = lanes; lane < CA_LANES; lane++) {
        pack_ray(rays, order[0], lane, packet, valid);
        valid[lane] = 0;
    }
    return lanes;
}

static inline void intersect8(const int *valid, RTCScene scene, struct RTCRayHit8 *rayhit)
{
#if CA_EMBREE_MAJOR >= 4
    rtcIntersect8(valid, scene, rayhit, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect8(valid, scene, &context, rayhit);
#endif
}

static inline void occluded8(const int *valid, RTCScene scene, struct RTCRay8 *ray)
{
#if CA_EMBREE_MAJOR >= 4
    rtcOccluded8(valid, scene, ray, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded8(valid, scene, &context, ray);
#endif
}

static void unpack_hit(const ca_accel *accel, const struct RTCRayHit8 *packet, uint32_t lane, uint32_t i,
                       ca_hit_batch *hits)
{
    hits->t[i] = packet->ray.tfar[lane];
    hits->u[i] = packet->hit.u[lane];
    hits->v[i] = packet->hit.v[lane];
    hits->ng.x[i] = packet->hit.Ng_x[lane];
    hits->ng.y[i] = packet->hit.Ng_y[lane];
    hits->ng.z[i] = packet->hit.Ng_z[lane];
    hits->primitive[i] = packet->hit.primID[lane];
    const uint32_t geometry = packet->hit.geomID[lane], instance = packet->hit.instID[0][lane];
    const bool instanced = geometry != RTC_INVALID_GEOMETRY_ID && instance != RTC_INVALID_GEOMETRY_ID;
    hits->instance[i] = instanced ? instance - accel->world_count : CA_NONE;
    hits->shape[i] = instanced ? geometry + accel->instances[hits->instance[i]].first_shape : geometry;
}

_Static_assert(RTC_INVALID_GEOMETRY_ID == CA_NONE, "what met nothing needs no translation");

void ca_accel_intersect_batch(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, ca_hit_batch *hits)
{
    uint16_t order[CA_RAY_BATCH];
    _Alignas(32) int valid[CA_LANES];
    struct RTCRayHit8 packet;
    memset(&packet.hit, 0, sizeof packet.hit);
    sort_rays(accel, rays, count, order);
    for (uint32_t first = 0; first < count; first += CA_LANES) {
        const uint32_t lanes = pack_rays(rays, order + first, count - first, &packet.ray, valid);
        memset(packet.hit.geomID, 0xff, sizeof packet.hit.geomID);
        memset(packet.hit.instID, 0xff, sizeof packet.hit.instID);
        intersect8(valid, accel->scene, &packet);
        for (uint32_t lane = 0; lane < lanes; lane++) unpack_hit(accel, &packet, lane, order[first + lane], hits);
    }
}

void ca_accel_occluded_batch(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, uint8_t *occluded)
{
    uint16_t order[CA_RAY_BATCH];
    _Alignas(32) int valid[CA_LANES];
    struct RTCRay8 packet;
    sort_rays(accel, rays, count, order);
    for (uint32_t first = 0; first < count; first += CA_LANES) {
        const uint32_t lanes = pack_rays(rays, order + first, count - first, &packet, valid);
        occluded8(valid, accel->scene, &packet);
        for (uint32_t lane = 0; lane < lanes; lane++)
            occluded[order[first + lane]] = valid[lane] != 0 && packet.tfar[lane] < 0.0f;
    }
}
