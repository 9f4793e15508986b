#include "geometry/curve.h"

#include "base/memory.h"
#include "geometry/dvec.h"
#include "math/arc_tangent.h"
#include "math/numeric.h"

#include <string.h>

/* ---- Owning ---------------------------------------------------------------------------------------------------- */

static const size_t max_points = (size_t)1 << 30;

ca_status ca_curve_create(ca_curve_degree degree, size_t point_count, size_t segment_count, ca_curve **curve,
                          ca_error *error)
{
    *curve = NULL;
    if (point_count > max_points || segment_count > max_points)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "curves of %zu points are over the limit of %zu",
                       point_count, max_points);
    ca_curve *created = ca_alloc_zeroed(1, sizeof *created);
    if (!created) return ca_fail_memory(error, "curves");
    atomic_init(&created->owners, 1);
    created->degree = degree;
    created->point_count = (uint32_t)point_count;
    created->segment_count = (uint32_t)segment_count;
    created->points = ca_alloc_zeroed(4 * point_count, sizeof *created->points);
    created->segments = ca_alloc_zeroed(segment_count, sizeof *created->segments);
    if (!created->points || !created->segments) {
        ca_curve_destroy(created);
        return ca_fail_memory(error, "curves");
    }
    *curve = created;
    return CA_OK;
}

ca_curve *ca_curve_share(const ca_curve *curve)
{
    ca_curve *shared = (ca_curve *)(uintptr_t)curve; /* only the count of owners changes */
    atomic_fetch_add(&shared->owners, 1);
    return shared;
}

void ca_curve_destroy(ca_curve *curve)
{
    if (!curve || atomic_fetch_sub(&curve->owners, 1) != 1) return;
    ca_free(curve->points);
    ca_free(curve->segments);
    ca_free(curve);
}

size_t ca_curve_bytes(const ca_curve *curve)
{
    return 4 * sizeof(float) * curve->point_count + sizeof(uint32_t) * curve->segment_count;
}

bool ca_curve_equal(const ca_curve *a, const ca_curve *b)
{
    return a->degree == b->degree && a->point_count == b->point_count && a->segment_count == b->segment_count &&
           memcmp(a->points, b->points, 4 * sizeof(float) * a->point_count) == 0 &&
           memcmp(a->segments, b->segments, sizeof(uint32_t) * a->segment_count) == 0;
}

static ca_vec3 point_at(const ca_curve *curve, size_t point)
{
    const float *p = curve->points + 4 * point;
    return (ca_vec3){p[0], p[1], p[2]};
}

/* Both kinds of tube lie in the hull of the spheres at their control points. */
bool ca_curve_place(ca_curve *curve, const ca_affine *map)
{
    curve->low = (ca_vec3){INFINITY, INFINITY, INFINITY};
    curve->high = ca_neg(curve->low);
    for (size_t i = 0; i < curve->point_count; i++) {
        float *p = curve->points + 4 * i;
        const ca_vec3 center = ca_map_point(map->to, point_at(curve, i));
        const float r = fabsf(p[3]);
        const ca_vec3 radius = {r, r, r};
        p[0] = center.x, p[1] = center.y, p[2] = center.z;
        curve->low = ca_min_vec3(curve->low, ca_sub(center, radius));
        curve->high = ca_max_vec3(curve->high, ca_add(center, radius));
        if (!isfinite(ca_length2(center)) || !isfinite(p[3])) return false;
    }
    curve->placed = true;
    return true;
}

/* ---- Surfaces -------------------------------------------------------------------------------------------------- */

/* A segment at one place: the point, its first two derivatives, the radius and its derivative. */
typedef struct axis_point {
    dvec c, c1, c2;
    double r, r1;
} axis_point;

static axis_point weighted_sum(const ca_curve *curve, uint32_t segment, const double weights[][4])
{
    axis_point a = {.r = 0.0};
    for (uint32_t k = 0; k <= (uint32_t)curve->degree; k++) {
        const size_t point = (size_t)curve->segments[segment] + k;
        const dvec p = dvec_of(point_at(curve, point));
        const double radius = (double)curve->points[4 * point + 3];
        a.c = dmadd(a.c, weights[0][k], p);
        a.c1 = dmadd(a.c1, weights[1][k], p);
        a.c2 = dmadd(a.c2, weights[2][k], p);
        a.r += weights[0][k] * radius;
        a.r1 += weights[1][k] * radius;
    }
    return a;
}

/* The uniform cubic B-spline. */
static axis_point cubic_point(const ca_curve *curve, uint32_t segment, double v)
{
    const double w = 1.0 - v;
    const double weights[3][4] = {
        {w * w * w / 6.0, (4.0 + v * v * (3.0 * v - 6.0)) / 6.0, (4.0 + w * w * (3.0 * w - 6.0)) / 6.0,
         v * v * v / 6.0},
        {-0.5 * w * w, 0.5 * v * (3.0 * v - 4.0), 0.5 * w * (4.0 - 3.0 * w), 0.5 * v * v},
        {w, 3.0 * v - 2.0, 3.0 * w - 2.0, v}};
    return weighted_sum(curve, segment, weights);
}

static axis_point linear_point(const ca_curve *curve, uint32_t segment, double v)
{
    const double weights[3][4] = {{1.0 - v, v}, {-1.0, 1.0}, {0.0, 0.0}};
    return weighted_sum(curve, segment, weights);
}

/* Whose sphere touches the hull at p, beyond [0, 1] where it is none of the segment's. The normal there leans by r'
 * against the axis: it is not across it. */
static double sphere_under(const ca_curve *curve, uint32_t segment, dvec p)
{
    const axis_point start = linear_point(curve, segment, 0.0);
    const double length2 = ddot(start.c1, start.c1), slope2 = length2 - start.r1 * start.r1;
    if (!(slope2 > 0.0)) return start.r1 > 0.0 ? 1.0 : 0.0; /* one of the spheres holds all others */
    return (ddot(dsub(p, start.c), start.c1) + start.r * start.r1) / slope2;
}

/* Is p farther away than the round end there? */
static bool is_beyond(const ca_curve *curve, uint32_t segment, double end, dvec p)
{
    const axis_point a = linear_point(curve, segment, end);
    const dvec d = dsub(p, a.c);
    return ddot(d, d) > 1.02 * a.r * a.r;
}

/* The segment of a polyline on which p lies. Embree often takes a hit for one of another segment in the same line,
 * whose cone goes on there; then p is beyond that one's round end. */
static uint32_t segment_under(const ca_curve *curve, uint32_t segment, dvec p)
{
    const uint32_t *first = curve->segments;
    for (uint32_t steps = 0; steps < curve->segment_count; steps++) {
        const double v = sphere_under(curve, segment, p);
        if (v < 0.0 && segment > 0 && first[segment - 1] + 1 == first[segment] && is_beyond(curve, segment, 0.0, p))
            segment--;
        else if (v > 1.0 && segment + 1 < curve->segment_count && first[segment] + 1 == first[segment + 1] &&
                 is_beyond(curve, segment, 1.0, p))
            segment++;
        else
            break;
    }
    return segment;
}

static dvec unit_or(dvec v, dvec fallback)
{
    const double length = sqrt(ddot(v, v));
    return length > 0.0 ? dscale(v, 1.0 / length) : fallback;
}

/* The two directions from which the angle around the tangent is measured, and their derivatives along the curve. */
typedef struct cross_frame {
    dvec tangent, z, y;
    dvec z1, y1;
} cross_frame;

static cross_frame cross_frame_at(const axis_point *a)
{
    static const dvec up = {0.0, 0.0, 1.0}, aside = {0.0, 1.0, 0.0};
    cross_frame f = {.tangent = unit_or(a->c1, (dvec){1.0, 0.0, 0.0})};
    const dvec t = f.tangent, across = dmadd(up, -t.z, t);
    const double speed = sqrt(ddot(a->c1, a->c1)), length = sqrt(ddot(across, across));
    f.z = length > 1e-12 ? dscale(across, 1.0 / length) : aside;
    f.y = dcross(f.z, t);
    if (!(length > 1e-12) || !(speed > 0.0)) return f;
    const dvec t1 = dscale(dmadd(a->c2, -ddot(t, a->c2), t), 1.0 / speed);
    const dvec across1 = dmadd(dscale(t1, -t.z), -t1.z, t);
    f.z1 = dscale(dmadd(across1, -ddot(f.z, across1), f.z), 1.0 / length);
    f.y1 = dadd(dcross(f.z1, t), dcross(f.z, t1));
    return f;
}

/* `normal` is that of the surface, `out` points from the axis to the surface. */
static void set_parameters(const ca_shape *shape, uint32_t segment, double along, const axis_point *a, dvec out,
                           dvec normal, ca_surface *surface)
{
    const double segments = (double)shape->as.curve.curve->segment_count;
    const cross_frame f = cross_frame_at(a);
    const double y = ddot(f.y, out), z = ddot(f.z, out);
    surface->uv = (ca_vec2){ca_turn((float)y, (float)z), (float)(((double)segment + along) / segments)};
    if (!shape->needs_tangents) return;
    const dvec around = dadd(dscale(f.y, -z), dscale(f.z, y));
    const dvec turning = dadd(dscale(f.y1, y), dscale(f.z1, z));
    dvec dpdv = dadd(dmadd(a->c1, a->r1, out), dscale(turning, a->r));
    dpdv = dmadd(dpdv, -ddot(normal, dpdv), normal); /* does nothing but at the round ends of a polyline's segments */
    surface->dpdu = dround(dscale(around, 2.0 * CA_PI_D * a->r));
    surface->dpdv = dround(dscale(dpdv, segments));
}

/* Circles across the axis: the part of the normal along it comes from the radius that changes, its length from the
 * curvature, which brings circles nearer to each other on the inner side. */
static dvec swept_normal(const axis_point *a, dvec out)
{
    const double stretch = ddot(a->c1, a->c1) - a->r * ddot(out, a->c2);
    const dvec normal = unit_or(dmadd(dscale(out, stretch), -a->r1, a->c1), out);
    return stretch < 0.0 ? dscale(normal, -1.0) : normal; /* where circles overlap, outwards all the same */
}

/* What Embree's own arithmetic on a segment may be off. */
static ca_vec3 intersection_error(const ca_curve *curve, uint32_t segment)
{
    float reach = 0.0f;
    for (uint32_t k = 0; k <= (uint32_t)curve->degree; k++) {
        const size_t point = (size_t)curve->segments[segment] + k;
        reach = ca_max(reach, ca_max3(ca_abs3(point_at(curve, point))) + fabsf(curve->points[4 * point + 3]));
    }
    const float bound = CA_GAMMA(256) * reach + FLT_MIN;
    return (ca_vec3){bound, bound, bound};
}

void ca_curve_surface(const ca_shape *shape, uint32_t segment, float along, ca_vec3 position, ca_surface *surface)
{
    static const dvec any = {0.0, 0.0, 1.0};
    const ca_curve *curve = shape->as.curve.curve;
    const bool cubic = curve->degree == CA_CURVE_CUBIC;
    const dvec p = dvec_of(position);
    if (!cubic) segment = segment_under(curve, segment, p);
    const double v = cubic ? (double)ca_clamp(along, 0.0f, 1.0f)
                           : fmin(fmax(sphere_under(curve, segment, p), 0.0), 1.0);
    const axis_point a = cubic ? cubic_point(curve, segment, v) : linear_point(curve, segment, v);
    dvec out = dsub(p, a.c);
    if (cubic && ddot(a.c1, a.c1) > 0.0) out = dmadd(out, -ddot(out, a.c1) / ddot(a.c1, a.c1), a.c1);
    out = unit_or(out, any);
    const dvec normal = cubic ? swept_normal(&a, out) : out;
    surface->position = dround(dmadd(a.c, a.r, out));
    surface->position_error = intersection_error(curve, segment);
    surface->ng = surface->ns = dround(normal);
    surface->barycentric = (ca_vec2){(float)v, 0.0f};
    surface->uv = (ca_vec2){0};
    surface->dpdu = surface->dpdv = (ca_vec3){0};
    if (!shape->skips_uv) set_parameters(shape, segment, v, &a, out, normal, surface);
}
