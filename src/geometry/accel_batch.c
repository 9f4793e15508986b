/* Batches of rays: first to the quadrics that lie apart, then through Embree, sorted and in packets of eight. */
#include "geometry/accel_embree.h"
#include "geometry/quadric.h"
#include "geometry/ray_batch.h"

#include <string.h>

/* ---- Order ----------------------------------------------------------------------------------------------------- */

/* Sorting pays from four packets on. */
enum { OCTANT_CELLS = 64, KEYS = 8 * OCTANT_CELLS, LEFT_OUT = KEYS, LEAST_SORTED = 4 * CA_LANES };

/* Which rays go together: by the octant of the direction, then by the place of the origin in a grid of 4 x 4 x 4
 * cells, in Z order. */
static ca_m8 sort_keys(const ca_accel *accel, ca_v8 origin, ca_v8 direction)
{
    const ca_f8 zero = ca_f8_all(0.0f), last = ca_f8_all(3.0f);
    const ca_v8 scale = ca_v8_all(accel->cells_per_meter), o = ca_sub_v8(origin, ca_v8_all(accel->low));
    const ca_m8 x = __builtin_convertvector(ca_min8(last, ca_max8(o.x * scale.x, zero)), ca_m8);
    const ca_m8 y = __builtin_convertvector(ca_min8(last, ca_max8(o.y * scale.y, zero)), ca_m8);
    const ca_m8 z = __builtin_convertvector(ca_min8(last, ca_max8(o.z * scale.z, zero)), ca_m8);
    const ca_m8 octant = ((direction.x < 0.0f) & 1) | ((direction.y < 0.0f) & 2) | ((direction.z < 0.0f) & 4);
    const ca_m8 cell = (x & 1) | (y & 1) << 1 | (z & 1) << 2 | (x & 2) << 2 | (y & 2) << 3 | (z & 2) << 4;
    return (octant << 6 | cell) & (KEYS - 1);
}

static inline bool asks_embree(const ca_accel *accel) { return accel->world_scene || accel->top_scene; }

/* For the world and for the instances. */
typedef struct ray_keys {
    _Alignas(32) uint32_t world[CA_COLUMN], top[CA_COLUMN];
} ray_keys;

static uint32_t rays_asked(const uint32_t *keys, uint32_t count, uint16_t *order)
{
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++) {
        order[asked] = (uint16_t)i;
        asked += keys[i] != LEFT_OUT;
    }
    return asked;
}

/* Those that are not left out, by a stable counting sort; returns how many they are. */
static uint32_t sort_rays(const uint32_t *keys, uint32_t count, uint16_t *order)
{
    uint16_t asked[CA_RAY_BATCH], starts[KEYS + 1] = {0};
    const uint32_t kept = rays_asked(keys, count, asked);
    if (kept < LEAST_SORTED) {
        memcpy(order, asked, kept * sizeof *order);
        return kept;
    }
    /* NOLINTNEXTLINE(clang-analyzer-core.uninitialized.ArraySubscript): as many are filled in as are kept */
    for (uint32_t k = 0; k < kept; k++) starts[keys[asked[k]] + 1]++;
    for (uint32_t k = 0; k + 1 < KEYS; k++) starts[k + 1] = (uint16_t)(starts[k + 1] + starts[k]);
    for (uint32_t k = 0; k < kept; k++) order[starts[keys[asked[k]]]++] = asked[k];
    return kept;
}

/* As ca_accel_ray_is_valid. */
static ca_m8 valid_rays(const ca_accel *accel, ca_v8 origin, ca_v8 direction, ca_f8 t_min, ca_f8 t_max)
{
    return (ca_dot_v8(origin, origin) < accel->origin_length2) &
           (ca_dot_v8(direction, direction) < accel->direction_length2) & (t_min >= 0.0f) & (t_max > t_min);
}

typedef struct ray_lanes {
    ca_v8 origin, direction;
    ca_f8 t_min, t_max;
    ca_m8 valid;
} ray_lanes;

/* Rays i to i + 7. Those behind the last one, which nobody has filled in, are zeros, and so not valid. */
static inline ray_lanes load_rays(const ca_accel *accel, const ca_ray_batch *rays, uint32_t i, uint32_t count)
{
    ray_lanes r = {.origin = ca_column3_load(&rays->origin, i),
                   .direction = ca_column3_load(&rays->direction, i),
                   .t_min = ca_load8(rays->t_min, i),
                   .t_max = ca_load8(rays->t_max, i)};
    if (count - i < CA_LANES) {
        const ca_m8 filled = (ca_m8){0, 1, 2, 3, 4, 5, 6, 7} < (int32_t)(count - i);
        const ca_f8 zero = ca_f8_all(0.0f);
        const ca_v8 zeros = {zero, zero, zero};
        r.origin = ca_select_v8(filled, r.origin, zeros);
        r.direction = ca_select_v8(filled, r.direction, zeros);
        r.t_min = ca_select8(filled, r.t_min, zero);
        r.t_max = ca_select8(filled, r.t_max, zero);
    }
    r.valid = valid_rays(accel, r.origin, r.direction, r.t_min, r.t_max);
    return r;
}

/* Keys of rays i to i + 7, of those among `asked` that do not end at t_max before anything Embree knows. */
static inline void set_keys(const ca_accel *accel, const ray_lanes *r, ca_f8 t_max, ca_m8 asked, ray_keys *keys,
                            uint32_t i)
{
    if (!asks_embree(accel)) return;
    const ca_m8 left_out = ca_m8_all(LEFT_OUT), key = sort_keys(accel, r->origin, r->direction);
    const ca_m8 world =
        asked & ca_accel_boxes_meet8(&accel->world_boxes, r->origin, r->direction, r->t_min, t_max);
    const ca_m8 top = asked & ca_accel_boxes_meet8(&accel->top_boxes, r->origin, r->direction, r->t_min, t_max);
    ca_store8_u32(keys->world, i, ca_select8_int(world, key, left_out));
    ca_store8_u32(keys->top, i, ca_select8_int(top, key, left_out));
}

/* ---- Packets --------------------------------------------------------------------------------------------------- */

static uint32_t lanes_for(uint32_t left) { return left < CA_LANES ? left : CA_LANES; }

/* Rays that end at t_max[]. A lane that takes no part keeps a ray of another. */
static void pack_rays(const ca_ray_batch *rays, const float *t_max, const uint16_t *order, uint32_t lanes,
                      struct RTCRay8 *packet, int *valid)
{
    for (uint32_t lane = 0; lane < CA_LANES; lane++) {
        const uint32_t i = order[lane < lanes ? lane : 0];
        const ca_vec3 origin = ca_column3_at(&rays->origin, i), direction = ca_column3_at(&rays->direction, i);
        valid[lane] = lane < lanes ? -1 : 0;
        packet->org_x[lane] = origin.x, packet->org_y[lane] = origin.y, packet->org_z[lane] = origin.z;
        packet->dir_x[lane] = direction.x, packet->dir_y[lane] = direction.y, packet->dir_z[lane] = direction.z;
        packet->tnear[lane] = rays->t_min[i], packet->tfar[lane] = t_max[i];
        packet->time[lane] = 0.0f;
        packet->mask[lane] = UINT32_MAX, packet->id[lane] = 0, packet->flags[lane] = 0;
    }
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

/* Where Embree met something of the world. */
static void unpack_hit(const struct RTCRayHit8 *packet, uint32_t lane, uint32_t i, ca_hit_batch *hits)
{
    const uint32_t geometry = packet->hit.geomID[lane];
    if (geometry == RTC_INVALID_GEOMETRY_ID) return;
    hits->t[i] = packet->ray.tfar[lane];
    hits->u[i] = packet->hit.u[lane];
    hits->v[i] = packet->hit.v[lane];
    hits->ng.x[i] = packet->hit.Ng_x[lane];
    hits->ng.y[i] = packet->hit.Ng_y[lane];
    hits->ng.z[i] = packet->hit.Ng_z[lane];
    hits->primitive[i] = packet->hit.primID[lane];
    hits->shape[i] = geometry;
}

/* ---- Nearest hits ---------------------------------------------------------------------------------------------- */

/* What the rays meet of quadrics and flat pieces that lie apart, and the rays' keys. */
static void meet_apart(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, ca_hit_batch *hits,
                       ray_keys *keys)
{
    for (uint32_t i = 0; i < count; i += CA_LANES) {
        const ray_lanes r = load_rays(accel, rays, i, count);
        ca_f8 t = r.t_max;
        ca_m8 shape = ca_m8_all((int32_t)CA_NONE);
        for (uint32_t k = 0; k < accel->apart_count; k++) {
            const ca_shape *quadric = &accel->shapes[accel->apart[k]];
            const ca_f8 nearer = ca_quadric_intersect8(quadric, r.origin, r.direction, r.t_min, t);
            const ca_m8 met = r.valid & (nearer < t);
            shape = (met & (int32_t)accel->apart[k]) | (~met & shape);
            t = ca_select8(met, nearer, t);
        }
        ca_facet_hits met = {.t = t, .shape = shape};
        ca_facets_intersect8(&accel->facets, r.origin, r.direction, r.t_min, r.valid, &met);
        ca_store8(hits->t, i, met.t), ca_store8(hits->u, i, met.u), ca_store8(hits->v, i, met.v);
        ca_column3_store(&hits->ng, i, met.ng);
        ca_store8_u32(hits->shape, i, met.shape);
        ca_store8_u32(hits->primitive, i, met.primitive);
        ca_store8_u32(hits->instance, i, ca_m8_all((int32_t)CA_NONE));
        set_keys(accel, &r, met.t, r.valid, keys, i);
    }
}

typedef bool meet_function(const ca_accel *accel, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit);

static inline void intersect_one_by_one(const ca_accel *accel, meet_function *meet, const ca_ray_batch *rays,
                                        uint32_t count, const uint16_t *order, ca_hit_batch *hits)
{
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t i = order[k];
        ca_hit hit = {.t = hits->t[i]};
        if (!meet(accel, ca_column3_at(&rays->origin, i), ca_column3_at(&rays->direction, i), rays->t_min[i], &hit))
            continue;
        hits->t[i] = hit.t;
        hits->u[i] = hit.u;
        hits->v[i] = hit.v;
        ca_column3_set(&hits->ng, i, hit.ng);
        hits->shape[i] = hit.shape;
        hits->primitive[i] = hit.primitive;
        hits->instance[i] = hit.instance;
    }
}

static void intersect_packets(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, const uint16_t *order,
                              ca_hit_batch *hits)
{
    _Alignas(32) int valid[CA_LANES];
    struct RTCRayHit8 packet;
    memset(&packet.hit, 0, sizeof packet.hit);
    for (uint32_t first = 0; first < count; first += CA_LANES) {
        const uint32_t lanes = lanes_for(count - first);
        pack_rays(rays, hits->t, order + first, lanes, &packet.ray, valid);
        memset(packet.hit.geomID, 0xff, sizeof packet.hit.geomID);
        memset(packet.hit.instID, 0xff, sizeof packet.hit.instID);
        intersect8(valid, accel->world_scene, &packet);
        for (uint32_t lane = 0; lane < lanes; lane++) unpack_hit(&packet, lane, order[first + lane], hits);
    }
}

/* Of coincident quadrics or instances a packet's other rays decide which one is hit: there rays go alone, though
 * sorted, which gains a part of what packets do. */
void ca_accel_intersect_batch(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, ca_hit_batch *hits)
{
    ray_keys keys;
    uint16_t order[CA_RAY_BATCH];
    meet_apart(accel, rays, count, hits, &keys);
    if (accel->world_scene) {
        const uint32_t asked = sort_rays(keys.world, count, order);
        if (accel->world_meshes)
            intersect_packets(accel, rays, asked, order, hits);
        else
            intersect_one_by_one(accel, ca_accel_meet_world, rays, asked, order, hits);
    }
    if (!accel->top_scene) return;
    const uint32_t asked = sort_rays(keys.top, count, order);
    intersect_one_by_one(accel, ca_accel_meet_instances, rays, asked, order, hits);
}

/* ---- Visibility ------------------------------------------------------------------------------------------------ */

/* Keys of the rays that are valid and end at nothing that lies apart; the others are answered. */
static void hide_behind_apart(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, uint8_t *occluded,
                              ray_keys *keys)
{
    for (uint32_t i = 0; i < count; i += CA_LANES) {
        const ray_lanes r = load_rays(accel, rays, i, count);
        ca_m8 hidden = ca_facets_occlude8(&accel->facets, r.origin, r.direction, r.t_min, r.t_max);
        for (uint32_t k = 0; k < accel->apart_count; k++) {
            const ca_shape *quadric = &accel->shapes[accel->apart[k]];
            hidden |= ca_quadric_intersect8(quadric, r.origin, r.direction, r.t_min, r.t_max) < r.t_max;
        }
        const uint32_t bits = ca_mask_bits(r.valid & hidden);
        for (uint32_t lane = 0; lane < CA_LANES && i + lane < count; lane++) occluded[i + lane] = bits >> lane & 1;
        set_keys(accel, &r, r.t_max, r.valid & ~hidden, keys, i);
    }
}

/* Rays that have keys and meet something of `scene` are answered. */
static void hide_in_scene(RTCScene scene, const ca_ray_batch *rays, const uint32_t *keys, uint32_t count,
                          uint8_t *occluded)
{
    uint16_t order[CA_RAY_BATCH];
    _Alignas(32) int valid[CA_LANES];
    struct RTCRay8 packet;
    const uint32_t asked = sort_rays(keys, count, order);
    for (uint32_t first = 0; first < asked; first += CA_LANES) {
        const uint32_t lanes = lanes_for(asked - first);
        pack_rays(rays, rays->t_max, order + first, lanes, &packet, valid);
        occluded8(valid, scene, &packet);
        for (uint32_t lane = 0; lane < lanes; lane++) occluded[order[first + lane]] = packet.tfar[lane] < 0.0f;
    }
}

/* Instances hide what the world does not. */
void ca_accel_occluded_batch(const ca_accel *accel, const ca_ray_batch *rays, uint32_t count, uint8_t *occluded)
{
    ray_keys keys;
    hide_behind_apart(accel, rays, count, occluded, &keys);
    if (accel->world_scene) hide_in_scene(accel->world_scene, rays, keys.world, count, occluded);
    if (!accel->top_scene) return;
    for (uint32_t i = 0; i < count; i++)
        if (occluded[i]) keys.top[i] = LEFT_OUT;
    hide_in_scene(accel->top_scene, rays, keys.top, count, occluded);
}
