#include "geometry/quadric.h"

#include "geometry/dvec.h"
#include "math/arc_tangent.h"

/* Roots of a t^2 - 2 b t + c = 0, the stable way (no cancellation between b and the root). */
static bool solve_quadratic(double a, double b, double c, double discriminant, double roots[2])
{
    if (!(discriminant >= 0.0) || a == 0.0) return false;
    const double q = b + copysign(sqrt(discriminant), b);
    const double r0 = q / a, r1 = q != 0.0 ? c / q : r0;
    roots[0] = fmin(r0, r1);
    roots[1] = fmax(r0, r1);
    return true;
}

/* The discriminant b^2 - a c is taken from the distance between the ray's line and the centre: for a sphere far away
 * the naive difference cancels (Haines, Günther and Akenine-Möller 2019, "Precision improvements for ray/sphere
 * intersection"). `offset` goes from the ray's origin to the centre; for cylinders both are across the axis. */
static bool round_roots(dvec offset, dvec direction, double radius, double roots[2])
{
    const double a = ddot(direction, direction);
    if (a == 0.0) return false;
    const double b = ddot(offset, direction);
    const dvec nearest = dmadd(offset, -b / a, direction);
    const double discriminant = a * (radius * radius - ddot(nearest, nearest));
    return solve_quadratic(a, b, ddot(offset, offset) - radius * radius, discriminant, roots);
}

static bool pick(double candidate, float t_min, float t_max, float *t)
{
    const float rounded = (float)candidate;
    if (!(candidate > (double)t_min && rounded > t_min && rounded < t_max)) return false;
    *t = rounded;
    return true;
}

static bool intersect_sphere(const ca_shape *shape, dvec o, dvec d, float t_min, float t_max, float *t)
{
    double roots[2];
    const dvec center = dvec_of(shape->as.sphere.center);
    if (!round_roots(dsub(center, o), d, (double)shape->as.sphere.radius, roots)) return false;
    return pick(roots[0], t_min, t_max, t) || pick(roots[1], t_min, t_max, t);
}

/* The disk is the image of the unit disk: centre + x s + y t with x^2 + y^2 <= 1 (an ellipse if s and t differ). */
static bool intersect_disk(const ca_shape *shape, dvec o, dvec d, float t_min, float t_max, float *t)
{
    const dvec s_axis = dvec_column(shape->as.disk.map.to, 0), t_axis = dvec_column(shape->as.disk.map.to, 1);
    const dvec center = dvec_column(shape->as.disk.map.to, 3), n = dcross(s_axis, t_axis);
    const double denominator = ddot(n, d);
    if (denominator == 0.0) return false;
    const double hit = ddot(n, dsub(center, o)) / denominator;
    const dvec p = dsub(dmadd(o, hit, d), center);
    const double area2 = ddot(n, n);
    const double x = ddot(dcross(p, t_axis), n) / area2, y = ddot(dcross(s_axis, p), n) / area2;
    return x * x + y * y <= 1.0 && pick(hit, t_min, t_max, t);
}

static bool intersect_cylinder(const ca_shape *shape, dvec o, dvec d, float t_min, float t_max, float *t)
{
    const dvec z_axis = dvec_column(shape->as.cylinder.map.to, 2), base = dvec_column(shape->as.cylinder.map.to, 3);
    const double length2 = ddot(z_axis, z_axis);
    const dvec offset = dsub(base, o);
    const dvec d_across = dmadd(d, -ddot(d, z_axis) / length2, z_axis);
    const dvec offset_across = dmadd(offset, -ddot(offset, z_axis) / length2, z_axis);
    double roots[2];
    if (!round_roots(offset_across, d_across, (double)shape->as.cylinder.radius, roots)) return false;
    for (int i = 0; i < 2; i++) {
        const double height = ddot(dsub(dmadd(o, roots[i], d), base), z_axis) / length2;
        if (height >= 0.0 && height <= 1.0 && pick(roots[i], t_min, t_max, t)) return true;
    }
    return false;
}

bool ca_quadric_intersect(const ca_shape *shape, ca_vec3 origin, ca_vec3 direction, float t_min, float t_max,
                          float *t)
{
    const dvec o = dvec_of(origin), d = dvec_of(direction);
    switch (shape->kind) {
    case CA_SHAPE_SPHERE: return intersect_sphere(shape, o, d, t_min, t_max, t);
    case CA_SHAPE_DISK: return intersect_disk(shape, o, d, t_min, t_max, t);
    case CA_SHAPE_CYLINDER: return intersect_cylinder(shape, o, d, t_min, t_max, t);
    case CA_SHAPE_MESH:
    case CA_SHAPE_CURVE:
    case CA_SHAPE_SDF_GRID:
    case CA_SHAPE_KIND_COUNT: break;
    }
    return false;
}

/* ---- Eight rays at a time -------------------------------------------------------------------------------------- */

typedef double d4 __attribute__((vector_size(32), may_alias));
typedef float f4 __attribute__((vector_size(16), may_alias));
typedef int32_t m4 __attribute__((vector_size(16), may_alias));
typedef int64_t l4 __attribute__((vector_size(32), may_alias));

typedef struct dvec4 {
    d4 x, y, z;
} dvec4;

static f4 half_of(ca_f8 v, bool high)
{
    return high ? __builtin_shufflevector(v, v, 4, 5, 6, 7) : __builtin_shufflevector(v, v, 0, 1, 2, 3);
}
static d4 double_half(ca_f8 v, bool high) { return __builtin_convertvector(half_of(v, high), d4); }
static dvec4 dvec4_of(ca_v8 v, bool high)
{
    return (dvec4){double_half(v.x, high), double_half(v.y, high), double_half(v.z, high)};
}
static d4 d4_all(double v) { return (d4){v, v, v, v}; }
static d4 ddot4(dvec4 a, dvec4 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static d4 sqrt4(d4 v)
{
#ifdef __AVX__
    return (d4)_mm256_sqrt_pd((__m256d)v);
#else
    for (int i = 0; i < 4; i++) v[i] = sqrt(v[i]);
    return v;
#endif
}

static d4 copysign4(d4 v, d4 sign)
{
    const l4 sign_bits = (l4)d4_all(-0.0);
    return (d4)(((l4)v & ~sign_bits) | ((l4)sign & sign_bits));
}
static d4 select4(l4 mask, d4 a, d4 b) { return (d4)((mask & (l4)a) | (~mask & (l4)b)); }
static bool any4(m4 mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

/* The candidate where pick() takes it, else t_max. */
static f4 pick4(d4 candidate, f4 t_min, f4 t_max)
{
    const f4 rounded = __builtin_convertvector(candidate, f4);
    const m4 after = __builtin_convertvector(candidate > __builtin_convertvector(t_min, d4), m4);
    const m4 picked = after & (rounded > t_min) & (rounded < t_max);
    return (f4)((picked & (m4)rounded) | (~picked & (m4)t_max));
}

/* As intersect_sphere(), operation for operation; a smallest root before t_max hides the other. */
static f4 intersect_sphere4(const ca_shape *shape, dvec4 o, dvec4 d, f4 t_min, f4 t_max)
{
    const dvec center = dvec_of(shape->as.sphere.center);
    const d4 radius2 = d4_all((double)shape->as.sphere.radius * (double)shape->as.sphere.radius);
    const dvec4 offset = {center.x - o.x, center.y - o.y, center.z - o.z};
    const d4 a = ddot4(d, d), b = ddot4(offset, d), s = -b / a;
    const dvec4 nearest = {offset.x + s * d.x, offset.y + s * d.y, offset.z + s * d.z};
    const d4 discriminant = a * (radius2 - ddot4(nearest, nearest));
    const m4 met = __builtin_convertvector((discriminant >= 0.0) & (a != 0.0), m4);
    if (!any4(met)) return t_max;
    const d4 q = b + copysign4(sqrt4(discriminant), b);
    const d4 r0 = q / a, r1 = select4(q != 0.0, (ddot4(offset, offset) - radius2) / q, r0);
    const l4 in_order = r0 < r1;
    const f4 near = pick4(select4(in_order, r0, r1), t_min, t_max);
    const f4 far = pick4(select4(in_order, r1, r0), t_min, t_max);
    const m4 takes_near = met & (near < t_max), takes_far = met & ~takes_near;
    return (f4)((takes_near & (m4)near) | (takes_far & (m4)far) | (~met & (m4)t_max));
}

/* Whether none of eight rays meets the sphere, by single precision alone: false where that cannot tell. The line
 * passes the centre at a distance whose square is |offset|^2 - b^2 / a; an origin outside has the sphere behind it if
 * b < 0. Rounding errors are below 2^-20 |offset|^2, those of underflow below FLT_MIN for the lengths of `d` asked
 * for. */
static bool all_pass_sphere8(const ca_shape *shape, ca_v8 o, ca_v8 d, ca_f8 t_min)
{
    const float margin = 0x1p-18f, radius2 = ca_sqr(shape->as.sphere.radius) * (1.0f + margin) + FLT_MIN;
    const ca_v8 offset = ca_sub_v8(ca_v8_all(shape->as.sphere.center), o);
    const ca_f8 a = ca_dot_v8(d, d), b = ca_dot_v8(offset, d);
    const ca_f8 distance2 = ca_dot_v8(offset, offset) * (1.0f - margin), passes_at = distance2 * a;
    const ca_m8 beside = (passes_at <= FLT_MAX) & (passes_at > b * b + radius2 * a);
    const ca_m8 behind = (distance2 > radius2) & (b < 0.0f);
    const ca_m8 known = (a > 0x1p-20f) & (a < 0x1p20f) & (t_min >= 0.0f);
    return ca_mask_bits(known & (beside | behind)) == 0xff;
}

static ca_f8 intersect_sphere8(const ca_shape *shape, ca_v8 o, ca_v8 d, ca_f8 t_min, ca_f8 t_max)
{
    if (all_pass_sphere8(shape, o, d, t_min)) return t_max;
    f4 t[2];
    for (int high = 0; high < 2; high++)
        t[high] = intersect_sphere4(shape, dvec4_of(o, high), dvec4_of(d, high), half_of(t_min, high),
                                    half_of(t_max, high));
    return __builtin_shufflevector(t[0], t[1], 0, 1, 2, 3, 4, 5, 6, 7);
}

ca_f8 ca_quadric_intersect8(const ca_shape *shape, ca_v8 origin, ca_v8 direction, ca_f8 t_min, ca_f8 t_max)
{
    if (shape->kind == CA_SHAPE_SPHERE) return intersect_sphere8(shape, origin, direction, t_min, t_max);
    for (int i = 0; i < CA_LANES; i++) {
        const ca_vec3 o = {origin.x[i], origin.y[i], origin.z[i]};
        const ca_vec3 d = {direction.x[i], direction.y[i], direction.z[i]};
        float t;
        if (ca_quadric_intersect(shape, o, d, t_min[i], t_max[i], &t)) t_max[i] = t;
    }
    return t_max;
}

/* ---- Surfaces -------------------------------------------------------------------------------------------------- */

/* Rounding a point computed in double precision costs half an ulp of each coordinate; a second one covers that the
 * double precision value itself comes from rounded input. */
static ca_vec3 rounding_error(ca_vec3 p)
{
    return (ca_vec3){2.0f * CA_GAMMA(1) * fabsf(p.x) + FLT_MIN, 2.0f * CA_GAMMA(1) * fabsf(p.y) + FLT_MIN,
                     2.0f * CA_GAMMA(1) * fabsf(p.z) + FLT_MIN};
}

static void set_tangents(const ca_affine *map, ca_vec3 dpdu_local, ca_vec3 dpdv_local, ca_surface *surface)
{
    surface->dpdu = ca_map_vector(map->to, dpdu_local);
    surface->dpdv = ca_map_vector(map->to, dpdv_local);
}

static void sphere_surface(const ca_shape *shape, ca_vec3 position, ca_surface *surface)
{
    const dvec center = dvec_of(shape->as.sphere.center);
    const dvec from_center = dsub(dvec_of(position), center);
    const double scale = 1.0 / sqrt(ddot(from_center, from_center));
    surface->position = dround(dmadd(center, (double)shape->as.sphere.radius * scale, from_center));
    surface->ng = dround(dscale(from_center, scale));
    if (shape->skips_uv) return;
    const ca_vec3 local = ca_normalize(ca_map_vector(shape->as.sphere.map.from, surface->ng));
    const float ring = sqrtf(ca_sqr(local.x) + ca_sqr(local.y));
    surface->uv = (ca_vec2){ca_turn(local.x, local.y), ca_atan2(ring, local.z) * CA_INV_PI};
    if (!shape->needs_tangents) return;
    const ca_vec3 outward = ring > 0.0f ? (ca_vec3){local.x / ring, local.y / ring, 0.0f} : (ca_vec3){1, 0, 0};
    set_tangents(&shape->as.sphere.map, (ca_vec3){-CA_TWO_PI * ring * outward.y, CA_TWO_PI * ring * outward.x, 0.0f},
                 (ca_vec3){CA_PI * local.z * outward.x, CA_PI * local.z * outward.y, -CA_PI * ring}, surface);
}

static void disk_surface(const ca_shape *shape, ca_vec3 position, ca_surface *surface)
{
    const dvec s_axis = dvec_column(shape->as.disk.map.to, 0), t_axis = dvec_column(shape->as.disk.map.to, 1);
    const dvec center = dvec_column(shape->as.disk.map.to, 3), n = dcross(s_axis, t_axis);
    const double area2 = ddot(n, n);
    const dvec p = dsub(dvec_of(position), center);
    const double x = ddot(dcross(p, t_axis), n) / area2, y = ddot(dcross(s_axis, p), n) / area2;
    surface->position = dround(dmadd(dmadd(center, x, s_axis), y, t_axis));
    surface->ng = dround(dscale(n, 1.0 / sqrt(area2)));
    if (shape->skips_uv) return;
    const float radius = (float)sqrt(x * x + y * y);
    surface->uv = (ca_vec2){fminf(radius, 1.0f), ca_turn((float)x, (float)y)};
    if (!shape->needs_tangents) return;
    const ca_vec3 outward =
        radius > 0.0f ? (ca_vec3){(float)x / radius, (float)y / radius, 0.0f} : (ca_vec3){1, 0, 0};
    set_tangents(&shape->as.disk.map, outward,
                 (ca_vec3){-CA_TWO_PI * radius * outward.y, CA_TWO_PI * radius * outward.x, 0.0f}, surface);
}

static void cylinder_surface(const ca_shape *shape, ca_vec3 position, ca_surface *surface)
{
    const dvec z_axis = dvec_column(shape->as.cylinder.map.to, 2), base = dvec_column(shape->as.cylinder.map.to, 3);
    const dvec p = dsub(dvec_of(position), base);
    const double height = ddot(p, z_axis) / ddot(z_axis, z_axis);
    const dvec across = dmadd(p, -height, z_axis);
    const double scale = 1.0 / sqrt(ddot(across, across));
    surface->position = dround(dmadd(dmadd(base, height, z_axis), (double)shape->as.cylinder.radius * scale, across));
    surface->ng = dround(dscale(across, scale));
    if (shape->skips_uv) return;
    const ca_vec3 local = ca_map_vector(shape->as.cylinder.map.from, surface->ng);
    const float ring = sqrtf(ca_sqr(local.x) + ca_sqr(local.y));
    surface->uv = (ca_vec2){ca_turn(local.x, local.y), (float)height};
    if (!shape->needs_tangents) return;
    set_tangents(&shape->as.cylinder.map, (ca_vec3){-CA_TWO_PI * local.y / ring, CA_TWO_PI * local.x / ring, 0.0f},
                 (ca_vec3){0.0f, 0.0f, 1.0f}, surface);
}

void ca_quadric_surface(const ca_shape *shape, ca_vec3 position, ca_surface *surface)
{
    surface->dpdu = surface->dpdv = (ca_vec3){0};
    surface->uv = (ca_vec2){0};
    switch (shape->kind) {
    case CA_SHAPE_SPHERE: sphere_surface(shape, position, surface); break;
    case CA_SHAPE_DISK: disk_surface(shape, position, surface); break;
    case CA_SHAPE_CYLINDER: cylinder_surface(shape, position, surface); break;
    case CA_SHAPE_MESH:
    case CA_SHAPE_CURVE:
    case CA_SHAPE_SDF_GRID:
    case CA_SHAPE_KIND_COUNT: break;
    }
    if (shape->flip_normals) surface->ng = ca_neg(surface->ng);
    surface->ns = surface->ng;
    surface->position_error = rounding_error(surface->position);
}
