/* Rays and the flat pieces that lie apart from the tree. */
#include "geometry/facets.h"

/* ---- What lanes do --------------------------------------------------------------------------------------------- */

/* Pieces and rays, eight of the one kind and eight times the same of the other. */
typedef struct facet_lanes {
    ca_v8 center, a, b, normal;
    ca_f8 half, error, longest;
} facet_lanes;

typedef struct facet_rays {
    ca_v8 origin, direction;
    ca_f8 t_min, reach; /* largest component of d */
    ca_f8 error;        /* of the origin's distance from any piece by rounding, as a length, times reach */
} facet_rays;

/* x and y, t, all times n.d. */
typedef struct facet_point {
    ca_f8 x, y, t, scale;
} facet_point;

static inline facet_rays facet_rays_of(ca_v8 origin, ca_v8 direction, ca_f8 t_min)
{
    const ca_f8 reach = ca_max3_v8(ca_abs_v8(direction));
    return (facet_rays){origin, direction, t_min, reach,
                        CA_FACET_ROUNDING * reach * ca_max3_v8(ca_abs_v8(origin))};
}

static inline ca_v8 all_of(const ca_facet_vectors *v, uint32_t k)
{
    return (ca_v8){ca_f8_all(v->x[k]), ca_f8_all(v->y[k]), ca_f8_all(v->z[k])};
}
static inline facet_lanes same_facet(const ca_facets *facets, uint32_t k)
{
    return (facet_lanes){all_of(&facets->center, k),  all_of(&facets->side[0], k), all_of(&facets->side[1], k),
                         all_of(&facets->normal, k), ca_f8_all(facets->half[k]),  ca_f8_all(facets->error[k]),
                         ca_f8_all(facets->longest[k])};
}

static inline ca_v8 eight_of(const ca_facet_vectors *v, uint32_t k)
{
    return (ca_v8){ca_load8_anywhere(v->x + k), ca_load8_anywhere(v->y + k), ca_load8_anywhere(v->z + k)};
}
static inline facet_lanes eight_facets(const ca_facets *facets, uint32_t k)
{
    return (facet_lanes){eight_of(&facets->center, k),          eight_of(&facets->side[0], k),
                         eight_of(&facets->side[1], k),         eight_of(&facets->normal, k),
                         ca_load8_anywhere(facets->half + k),   ca_load8_anywhere(facets->error + k),
                         ca_load8_anywhere(facets->longest + k)};
}

static inline ca_f8 dot(ca_v8 a, ca_v8 b) { return ca_fma8(a.x, b.x, ca_fma8(a.y, b.y, a.z * b.z)); }
static inline ca_v8 cross(ca_v8 a, ca_v8 b)
{
    return (ca_v8){ca_fma8(a.y, b.z, -(a.z * b.y)), ca_fma8(a.z, b.x, -(a.x * b.z)),
                   ca_fma8(a.x, b.y, -(a.y * b.x))};
}

/* Where the ray's line meets the piece's plane, and whether that is within the piece. `any_half`: there may be
 * triangles. A ray in the plane meets nothing: its t is no number. */
static inline ca_m8 meet(const facet_lanes *f, const facet_rays *rays, bool any_half, facet_point *p)
{
    const ca_v8 r = ca_sub_v8(f->center, rays->origin), q = cross(r, rays->direction);
    *p = (facet_point){.x = dot(q, f->b), .y = -dot(q, f->a), .t = dot(f->normal, r),
                       .scale = dot(f->normal, rays->direction)};
    const ca_f8 slack = ca_fma8(rays->reach, f->error, rays->error) * f->longest;
    const ca_f8 limit = ca_fma8(ca_f8_all(0.5f), ca_abs8(p->scale), slack);
    const ca_m8 inside = ca_max8(ca_abs8(p->x), ca_abs8(p->y)) <= limit;
    if (!any_half) return inside;
    return inside & (f->half * ca_copysign8(ca_f8_all(1.0f), p->scale) * (p->x + p->y) <= slack);
}

/* Which piece was met, and where. */
typedef struct facet_met {
    ca_m8 facet; /* -1: none */
    ca_f8 x, y, scale;
} facet_met;

/* Barycentric coordinates, normal and names of what was met. The corners of a triangle weigh, from its first on,
 * 1 - x - y, x and y with x and y in [0, 1]; those of the one across the common side x + y - 1, 1 - x and 1 - y. */
static inline void set_hits(const ca_facets *facets, const facet_met *met, ca_facet_hits *hits)
{
    const ca_f8 zero = ca_f8_all(0.0f), half = ca_f8_all(0.5f), one = ca_f8_all(1.0f);
    const ca_m8 any = met->facet >= 0, k = met->facet & any;
    const ca_m8 whole = ca_gather8(facets->half, k) == 0.0f;
    const ca_f8 x = ca_min8(ca_max8(met->x / met->scale + half, zero), one);
    const ca_f8 y = ca_min8(ca_max8(met->y / met->scale + half, zero), ca_select8(whole, one, one - x));
    const ca_m8 second = whole & (x + y > one), triangle = 2 * k - second;
    const ca_f8 opposite = (half - x) + (half - y);
    const ca_f8 weight[3] = {ca_select8(second, -opposite, opposite), ca_select8(second, one - x, x),
                             ca_select8(second, one - y, y)};
    const ca_m8 first = ca_gather8_u32(facets->first_corner, triangle);
    const ca_f8 u = ca_select8(first == 0, weight[1], ca_select8(first == 1, weight[0], weight[2]));
    const ca_f8 v = ca_select8(first == 0, weight[2], ca_select8(first == 1, weight[1], weight[0]));
    const ca_v8 normal = {ca_gather8(facets->normal.x, k), ca_gather8(facets->normal.y, k),
                          ca_gather8(facets->normal.z, k)};
    hits->u = ca_select8(any, u, hits->u);
    hits->v = ca_select8(any, v, hits->v);
    hits->ng = ca_select_v8(any, normal, hits->ng);
    hits->shape = ca_select8_int(any, ca_gather8_u32(facets->shape, k), hits->shape);
    hits->primitive = ca_select8_int(any, ca_gather8_u32(facets->primitive, triangle), hits->primitive);
}

/* ---- Eight rays ------------------------------------------------------------------------------------------------ */

void ca_facets_intersect8(const ca_facets *facets, ca_v8 origin, ca_v8 direction, ca_f8 t_min, ca_m8 valid,
                          ca_facet_hits *hits)
{
    const facet_rays rays = facet_rays_of(origin, direction, t_min);
    const ca_f8 one = ca_f8_all(1.0f);
    facet_met met = {ca_m8_all(-1), one, one, one};
    for (uint32_t k = 0; k < facets->count; k++) {
        const facet_lanes facet = same_facet(facets, k);
        facet_point p;
        const ca_m8 inside = meet(&facet, &rays, facets->half[k] != 0.0f, &p) & valid;
        const ca_f8 t = p.t / p.scale;
        const ca_m8 nearer = inside & (t > t_min) & (t < hits->t);
        hits->t = ca_select8(nearer, t, hits->t);
        met = (facet_met){ca_select8_int(nearer, ca_m8_all((int32_t)k), met.facet), ca_select8(nearer, p.x, met.x),
                          ca_select8(nearer, p.y, met.y), ca_select8(nearer, p.scale, met.scale)};
    }
    if (ca_mask_bits(met.facet >= 0)) set_hits(facets, &met, hits);
}

ca_m8 ca_facets_occlude8(const ca_facets *facets, ca_v8 origin, ca_v8 direction, ca_f8 t_min, ca_f8 t_max)
{
    const facet_rays rays = facet_rays_of(origin, direction, t_min);
    ca_m8 occluded = {0};
    for (uint32_t k = 0; k < facets->count; k++) {
        const facet_lanes facet = same_facet(facets, k);
        facet_point p;
        const ca_m8 met = meet(&facet, &rays, facets->half[k] != 0.0f, &p);
        const ca_f8 t = p.t / p.scale;
        occluded |= met & (t > t_min) & (t < t_max);
    }
    return occluded;
}

/* ---- One ray --------------------------------------------------------------------------------------------------- */

static facet_rays same_ray(ca_vec3 origin, ca_vec3 direction, float t_min)
{
    return facet_rays_of(ca_v8_all(origin), ca_v8_all(direction), ca_f8_all(t_min));
}

/* Of pieces at the same t the first is met. */
bool ca_facets_intersect(const ca_facets *facets, ca_vec3 origin, ca_vec3 direction, float t_min, ca_hit *hit)
{
    const facet_rays rays = same_ray(origin, direction, t_min);
    facet_met nearest = {.facet = ca_m8_all(-1)};
    for (uint32_t first = 0; first < facets->count; first += CA_LANES) {
        const facet_lanes eight = eight_facets(facets, first);
        facet_point p;
        const ca_m8 inside = meet(&eight, &rays, true, &p);
        const ca_f8 t = p.t / p.scale;
        const ca_m8 candidates = inside & (t > t_min) & (t < hit->t);
        for (uint32_t bits = ca_mask_bits_below(candidates, facets->count - first); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            if (!(t[i] < hit->t)) continue;
            hit->t = t[i];
            nearest = (facet_met){ca_m8_all((int32_t)first + i), ca_f8_all(p.x[i]), ca_f8_all(p.y[i]),
                                  ca_f8_all(p.scale[i])};
        }
    }
    if (nearest.facet[0] < 0) return false;
    ca_facet_hits hits = {0};
    set_hits(facets, &nearest, &hits);
    hit->u = hits.u[0], hit->v = hits.v[0];
    hit->ng = (ca_vec3){hits.ng.x[0], hits.ng.y[0], hits.ng.z[0]};
    hit->shape = (uint32_t)hits.shape[0];
    hit->primitive = (uint32_t)hits.primitive[0];
    return true;
}

bool ca_facets_occlude(const ca_facets *facets, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max)
{
    const facet_rays rays = same_ray(origin, direction, t_min);
    for (uint32_t first = 0; first < facets->count; first += CA_LANES) {
        const facet_lanes eight = eight_facets(facets, first);
        facet_point p;
        const ca_m8 met = meet(&eight, &rays, true, &p);
        const ca_f8 t = p.t / p.scale;
        const ca_m8 between = met & (t > t_min) & (t < t_max);
        if (ca_mask_bits_below(between, facets->count - first)) return true;
    }
    return false;
}
