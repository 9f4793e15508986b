/* Round curves: points, coordinates and tangents against definitions of their own, hits and the rays that leave them,
 * what Mitsuba 3 says of a few rays, degenerate segments, reading. */
#include "geometry/accel.h"
#include "geometry/curve.h"
#include "import/import.h"
#include "math/numeric.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static ca_test_random source;

static float between(float low, float high) { return low + (high - low) * ca_test_random_float(&source); }
static ca_vec3 random_point(float half)
{
    return ca_vec3_make(between(-half, half), between(-half, half), between(-half, half));
}
static ca_vec3 random_direction(void)
{
    for (;;) {
        const ca_vec3 p = random_point(1.0f);
        if (ca_length2(p) > 0.01f && ca_length2(p) < 1.0f) return ca_normalize(p);
    }
}

/* One curve of these points, four numbers each. */
static ca_curve *make_curve(ca_curve_degree degree, const float *points, uint32_t count)
{
    static const ca_affine identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}},
                                       {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    ca_curve *curve;
    assert_int_equal(ca_curve_create(degree, count, count - (uint32_t)degree, &curve, NULL), CA_OK);
    memcpy(curve->points, points, 4 * sizeof(float) * count);
    for (uint32_t i = 0; i < curve->segment_count; i++) curve->segments[i] = i;
    assert_true(ca_curve_place(curve, &identity));
    return curve;
}

static ca_shape shape_of(const ca_curve *curve)
{
    return (ca_shape){.kind = CA_SHAPE_CURVE, .light = CA_NONE, .needs_tangents = true, .as.curve.curve = curve};
}

static ca_accel *build(const ca_shape *shape)
{
    ca_accel *accel = NULL;
    assert_int_equal(ca_accel_create(shape, 1, 1, NULL, 0, 1, NULL, &accel, NULL), CA_OK);
    return accel;
}

/* ---- The parametrisation --------------------------------------------------------------------------------------- */

typedef struct point3 {
    double x[3];
} point3;

/* De Boor's algorithm with knots at the integers: x, y, z and the radius. */
static void spline_at(const float (*points)[4], double v, double out[4])
{
    for (int c = 0; c < 4; c++) {
        double d[4];
        for (int k = 0; k < 4; k++) d[k] = (double)points[k][c];
        for (int level = 1; level <= 3; level++)
            for (int k = 3; k >= level; k--) {
                const double alpha = (v + 3.0 - k) / (4.0 - level);
                d[k] = (1.0 - alpha) * d[k - 1] + alpha * d[k];
            }
        out[c] = d[3];
    }
}

static void axis_at(ca_curve_degree degree, const float (*points)[4], double v, double out[4])
{
    if (degree == CA_CURVE_CUBIC) {
        spline_at(points, v, out);
        return;
    }
    for (int c = 0; c < 4; c++) out[c] = (1.0 - v) * (double)points[0][c] + v * (double)points[1][c];
}

static void unit(double a[3])
{
    const double length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (int c = 0; c < 3; c++) a[c] /= length;
}

/* The tube's point at u turns around the axis and at v along the segment. */
static point3 tube_at(ca_curve_degree degree, const float (*points)[4], double u, double v)
{
    const double step = 1e-4;
    double a[4], before[4], after[4], t[3], z[3], lean = 0.0;
    axis_at(degree, points, v, a);
    axis_at(degree, points, v - step, before);
    axis_at(degree, points, v + step, after);
    for (int c = 0; c < 3; c++) t[c] = (after[c] - before[c]) / (2.0 * step);
    const double speed = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    if (degree == CA_CURVE_LINEAR) lean = -(after[3] - before[3]) / (2.0 * step) / speed;
    unit(t);
    for (int c = 0; c < 3; c++) z[c] = (c == 2) - t[2] * t[c];
    unit(z);
    const double y[3] = {z[1] * t[2] - z[2] * t[1], z[2] * t[0] - z[0] * t[2], z[0] * t[1] - z[1] * t[0]};
    point3 p;
    for (int c = 0; c < 3; c++) {
        const double across = cos(2.0 * CA_PI_D * u) * y[c] + sin(2.0 * CA_PI_D * u) * z[c];
        p.x[c] = a[c] + a[3] * (lean * t[c] + sqrt(1.0 - lean * lean) * across);
    }
    return p;
}

static ca_vec3 rounded(point3 p) { return (ca_vec3){(float)p.x[0], (float)p.x[1], (float)p.x[2]}; }

static ca_vec3 difference(point3 a, point3 b, double step)
{
    return (ca_vec3){(float)((b.x[0] - a.x[0]) / step), (float)((b.x[1] - a.x[1]) / step),
                     (float)((b.x[2] - a.x[2]) / step)};
}

static void assert_near(ca_vec3 got, ca_vec3 expected, float tolerance, const char *what)
{
    if (!(ca_length(ca_sub(got, expected)) <= tolerance * ca_max(1.0f, ca_length(expected))))
        fail_msg("%s is (%g, %g, %g) instead of (%g, %g, %g)", what, (double)got.x, (double)got.y, (double)got.z,
                 (double)expected.x, (double)expected.y, (double)expected.z);
}

/* A bent tube of several segments whose radius changes, and a place on it. */
static const float bent[7][4] = {{-2.0f, 0.0f, 0.1f, 0.2f}, {-1.0f, 0.3f, 0.0f, 0.25f}, {0.0f, 0.5f, 0.6f, 0.3f},
                                 {1.0f, 0.2f, 0.4f, 0.2f},  {2.0f, 0.9f, 0.0f, 0.15f},  {2.5f, 2.0f, -0.5f, 0.1f},
                                 {3.0f, 3.0f, 0.2f, 0.05f}};

static void check_parameters(ca_curve_degree degree)
{
    const double step = 1e-3;
    ca_curve *curve = make_curve(degree, bent[0], 7);
    const ca_shape shape = shape_of(curve);
    for (int i = 0; i < 2000; i++) {
        const uint32_t segment = ca_test_random_u32(&source) % curve->segment_count;
        const float (*points)[4] = bent + segment;
        const double u = (double)between(0.01f, 0.99f), v = (double)between(0.01f, 0.99f);
        const point3 p = tube_at(degree, points, u, v);
        ca_surface s;
        ca_curve_surface(&shape, segment, (float)v, rounded(p), &s);
        assert_near(s.position, rounded(p), 2e-6f, "the position");
        assert_true(fabsf(s.uv.x - (float)u) < 1e-5f);
        assert_true(fabsf(s.uv.y * (float)curve->segment_count - (float)segment - (float)v) < 1e-5f);
        const ca_vec3 dpdu = difference(tube_at(degree, points, u - step, v), tube_at(degree, points, u + step, v),
                                        2.0 * step);
        const ca_vec3 dpdv = difference(tube_at(degree, points, u, v - step), tube_at(degree, points, u, v + step),
                                        2.0 * step / (double)curve->segment_count);
        assert_near(s.dpdu, dpdu, 1e-3f, "dpdu");
        assert_near(s.dpdv, dpdv, 1e-3f, "dpdv");
        assert_near(s.ng, ca_normalize(ca_cross(dpdu, dpdv)), 1e-3f, "the normal");
        assert_true(s.ns.x == s.ng.x && s.ns.y == s.ng.y && s.ns.z == s.ng.z);
    }
    ca_curve_destroy(curve);
}

static void test_points_of_b_splines(void **state)
{
    (void)state;
    source = ca_test_random_seed(1);
    check_parameters(CA_CURVE_CUBIC);
}

static void test_points_of_polylines(void **state)
{
    (void)state;
    source = ca_test_random_seed(2);
    check_parameters(CA_CURVE_LINEAR);
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

typedef struct known_hit {
    ca_curve_degree degree;
    float x, y; /* of a ray from z = 5 downwards */
    float z;    /* where it ends */
    ca_vec3 n;
    ca_vec2 uv;
    uint32_t primitive;
} known_hit;

/* Mitsuba 3.9.1's hits of its bsplinecurve and linearcurve. */
static const known_hit known[] = {
    {CA_CURVE_CUBIC, -0.9f, 0.1f, 0.221739f, {-0.0412351f, -0.0596232f, 0.997369f}, {0.257287f, 0.0486267f}, 0},
    {CA_CURVE_CUBIC, -0.5f, 0.3f, 0.244701f, {-0.135796f, 0.20014f, 0.970311f}, {0.212803f, 0.25997f}, 0},
    {CA_CURVE_CUBIC, 0.2f, 0.1f, 0.183546f, {-0.150962f, -0.797008f, 0.584798f}, {0.400832f, 0.625995f}, 1},
    {CA_CURVE_CUBIC, 0.9f, 0.3f, 0.17988f, {0.325702f, 0.778553f, 0.536446f}, {0.0901526f, 0.924689f}, 1},
    {CA_CURVE_LINEAR, -1.1f, 0.1f, 0.141421f, {-0.5f, 0.5f, 0.707107f}, {0.12919f, 0.0f}, 0},
    {CA_CURVE_LINEAR, -0.9f, 0.1f, 0.208102f, {-0.173585f, 0.14717f, 0.97376f}, {0.21631f, 0.0685484f}, 0},
    {CA_CURVE_LINEAR, -0.2f, 0.3f, 0.26228f, {0.0637679f, -0.327536f, 0.942684f}, {0.302307f, 0.391129f}, 0},
    {CA_CURVE_LINEAR, 0.5f, 0.1f, 0.13606f, {-0.148936f, -0.697872f, 0.700566f}, {0.373883f, 0.764463f}, 1},
};

static void test_hits_are_mitsubas(void **state)
{
    (void)state;
    static const float spline[5][4] = {{-2.0f, 0.0f, 0.0f, 0.2f}, {-1.0f, 0.0f, 0.0f, 0.2f},
                                       {0.0f, 0.5f, 0.0f, 0.3f}, {1.0f, 0.0f, 0.1f, 0.2f},
                                       {2.0f, 0.0f, 0.0f, 0.1f}};
    static const float line[3][4] = {{-1.0f, 0.0f, 0.0f, 0.2f}, {0.0f, 0.5f, 0.0f, 0.3f}, {1.0f, 0.0f, 0.0f, 0.1f}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        const known_hit *k = &known[i];
        ca_curve *curve = k->degree == CA_CURVE_CUBIC ? make_curve(k->degree, spline[0], 5)
                                                      : make_curve(k->degree, line[0], 3);
        const ca_shape shape = shape_of(curve);
        ca_accel *accel = build(&shape);
        const ca_vec3 origin = {k->x, k->y, 5.0f}, down = {0.0f, 0.0f, -1.0f};
        ca_hit hit;
        ca_surface s;
        assert_true(ca_accel_intersect(accel, origin, down, 0.0f, INFINITY, &hit));
        ca_accel_surface(accel, origin, down, &hit, &s);
        assert_near(s.position, (ca_vec3){k->x, k->y, k->z}, 2e-5f, "the hit");
        assert_near(s.ng, k->n, 1e-4f, "the normal");
        assert_true(fabsf(s.uv.x - k->uv.x) < 1e-4f && fabsf(s.uv.y - k->uv.y) < 1e-4f);
        assert_int_equal(s.primitive, k->primitive);
        ca_accel_destroy(accel);
        ca_curve_destroy(curve);
    }
}

/* A curve that does not curve, whose radius is that everywhere or falls to a tip, anywhere and of any size. */
static ca_curve *straight_curve(ca_curve_degree degree, float scale, bool tip, ca_vec3 *axis)
{
    const ca_vec3 start = random_point(10.0f * scale);
    float points[6][4];
    *axis = random_direction();
    for (int i = 0; i < 6; i++) {
        const ca_vec3 p = ca_madd(start, scale * (float)i, *axis);
        points[i][0] = p.x, points[i][1] = p.y, points[i][2] = p.z;
        points[i][3] = 0.1f * scale * (tip ? 1.0f - 0.15f * (float)i : 1.0f);
    }
    return make_curve(degree, points[0], 6);
}

/* A ray to a point near the axis, from some way off. *off counts hits beyond a polyline's end, where Embree should
 * have cut it off. */
static bool hit_from_outside(const ca_accel *accel, const ca_curve *curve, float scale, ca_surface *s, uint32_t *off)
{
    const float *p = curve->points + 4 * (1 + ca_test_random_u32(&source) % (curve->point_count - 2));
    const ca_vec3 target = ca_add((ca_vec3){p[0], p[1], p[2]}, random_point(0.1f * scale));
    const ca_vec3 direction = random_direction(), origin = ca_madd(target, -between(1.0f, 20.0f) * scale, direction);
    ca_hit hit;
    if (!ca_accel_intersect(accel, origin, direction, 0.0f, INFINITY, &hit)) return false;
    ca_accel_surface(accel, origin, direction, &hit, s);
    const ca_vec3 met = ca_madd(origin, hit.t, direction);
    if (!(ca_length(ca_sub(met, s->position)) < 3e-3f * scale)) ++*off;
    return true;
}

/* Outwards a ray meets nothing more, and inwards neither, since curves are met from outside. Embree's iteration finds
 * a hit that is none for a few rays in 100,000, all within a few degrees of the surface. */
static void check_leaving(ca_curve_degree degree, bool tip)
{
    uint32_t again = 0, rays = 0, hits = 0, off = 0;
    float steepest = 0.0f;
    for (int exponent = -4; exponent <= 4; exponent++)
        for (int trial = 0; trial < 20; trial++) {
            const float scale = powf(10.0f, (float)exponent);
            ca_vec3 axis;
            ca_curve *curve = straight_curve(degree, scale, tip, &axis);
            const ca_shape shape = shape_of(curve);
            ca_accel *accel = build(&shape);
            for (int i = 0; i < 100; i++) {
                ca_surface s;
                ca_hit hit;
                if (!hit_from_outside(accel, curve, scale, &s, &off)) continue;
                hits++;
                for (int k = 0; k < 8; k++) {
                    const ca_vec3 out = random_direction();
                    const float side = ca_dot(out, s.ng);
                    const ca_vec3 origin = ca_offset_origin(s.position, s.position_error, s.ng, out);
                    const bool met = ca_accel_intersect(accel, origin, out, 0.0f, INFINITY, &hit);
                    again += met;
                    if (met) steepest = ca_max(steepest, fabsf(side));
                    rays++;
                }
            }
            ca_accel_destroy(accel);
            ca_curve_destroy(curve);
        }
    print_message("    degree %d%s: of %u rays that leave, %u meet the curve again (cosine up to %.3f); of %u hits "
                  "%u are off it\n",
                  (int)degree, tip ? ", with a tip" : "", rays, again, (double)steepest, hits, off);
    assert_true(rays > 10000);
    assert_true(again < rays / 10000);
    assert_true(steepest < 0.1f);
    assert_true(off <= hits / 2000);
}

static void test_rays_leave(void **state)
{
    (void)state;
    source = ca_test_random_seed(3);
    check_leaving(CA_CURVE_CUBIC, false);
    check_leaving(CA_CURVE_CUBIC, true);
    check_leaving(CA_CURVE_LINEAR, false);
    check_leaving(CA_CURVE_LINEAR, true);
}

static ca_status read_text(const char *text, ca_curve_degree degree, ca_curve **curve, ca_error *error)
{
    char path[64];
    snprintf(path, sizeof path, "/tmp/caustica-curves-%ld.txt", (long)getpid());
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    const ca_status status = ca_import_curves(path, degree, curve, error);
    remove(path);
    return status;
}

/* A radius that falls linearly to 0 where the curve ends needs a control point of negative radius behind it. Rays
 * across the axis meet the tube to within its radius, and no farther. */
static void test_tips(void **state)
{
    (void)state;
    static const char *const text = "-1 0 0 .2\n0 0 0 .1\n1 0 0 0\n2 0 0 -.1\n";
    ca_curve *curve;
    ca_error error;
    if (read_text(text, CA_CURVE_CUBIC, &curve, &error) != CA_OK) fail_msg("%s", error.message);
    static const ca_affine identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}},
                                       {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    assert_true(ca_curve_place(curve, &identity));
    assert_true(curve->high.x > 2.099f && curve->low.y < -0.199f); /* the hull of spheres, that one's too */
    const ca_shape shape = shape_of(curve);
    ca_accel *accel = build(&shape);
    for (int i = 1; i < 99; i++) {
        const float x = 0.01f * (float)i, radius = 0.1f * (1.0f - x);
        for (int side = -1; side <= 1; side += 2) {
            const ca_vec3 down = {0.0f, 0.0f, -1.0f}, inside = {x, 0.9f * radius * (float)side, 5.0f};
            const ca_vec3 outside = {x, 1.1f * radius * (float)side, 5.0f};
            ca_hit hit;
            ca_surface s;
            assert_true(ca_accel_intersect(accel, inside, down, 0.0f, INFINITY, &hit));
            assert_false(ca_accel_intersect(accel, outside, down, 0.0f, INFINITY, &hit) && hit.t > 0.0f);
            assert_true(ca_accel_intersect(accel, inside, down, 0.0f, INFINITY, &hit));
            ca_accel_surface(accel, inside, down, &hit, &s);
            const float r = sqrtf(s.position.y * s.position.y + s.position.z * s.position.z);
            if (!(fabsf(r - 0.1f * (1.0f - s.position.x)) < 1e-4f)) fail_msg("radius %g at %g", (double)r, (double)x);
        }
    }
    ca_accel_destroy(accel);
    ca_curve_destroy(curve);
}

/* Points that repeat, radii of 0, spheres within each other, points far away, in any mixture. */
static void test_degenerate_segments(void **state)
{
    (void)state;
    source = ca_test_random_seed(4);
    uint32_t hits = 0;
    for (int trial = 0; trial < 400; trial++) {
        const ca_curve_degree degree = trial & 1 ? CA_CURVE_CUBIC : CA_CURVE_LINEAR;
        float points[8][4];
        const float scale = powf(10.0f, between(-6.0f, 9.0f));
        for (int i = 0; i < 8; i++) {
            const ca_vec3 p = random_point(scale);
            points[i][0] = p.x, points[i][1] = p.y, points[i][2] = p.z, points[i][3] = between(0.0f, scale);
            const uint32_t what = ca_test_random_u32(&source) % 6;
            if (i > 0 && what < 2) memcpy(points[i], points[i - 1], what ? sizeof points[i] : 3 * sizeof(float));
            if (what == 2) points[i][3] = 0.0f;
            if (what == 3) points[i][0] = points[i][1] = 0.0f;
        }
        ca_curve *curve = make_curve(degree, points[0], 8);
        const ca_shape shape = shape_of(curve);
        ca_accel *accel = build(&shape);
        for (int i = 0; i < 200; i++) {
            const ca_vec3 origin = random_point(3.0f * scale);
            ca_vec3 direction = ca_sub(random_point(scale), origin);
            if (i % 5 == 0) direction.x = direction.y = 0.0f;
            ca_hit hit;
            ca_surface s;
            if (!ca_accel_intersect(accel, origin, direction, 0.0f, INFINITY, &hit)) continue;
            hits++;
            ca_accel_surface(accel, origin, direction, &hit, &s);
            assert_true(fabsf(ca_length(s.ng) - 1.0f) < 1e-4f && isfinite(ca_length2(s.position)));
            assert_true(isfinite(ca_length2(s.dpdu)) && isfinite(ca_length2(s.dpdv)));
            assert_true(s.uv.x >= 0.0f && s.uv.x <= 1.0f && s.uv.y >= 0.0f && s.uv.y <= 1.0f);
        }
        ca_accel_destroy(accel);
        ca_curve_destroy(curve);
    }
    print_message("    %u hits\n", hits);
    assert_true(hits > 10000);
}

/* A scene's next version shares the structure of equal curves, and outlives the first one. */
static void test_equal_curves_are_built_once(void **state)
{
    (void)state;
    ca_curve *first = make_curve(CA_CURVE_CUBIC, bent[0], 7), *second = make_curve(CA_CURVE_CUBIC, bent[0], 7);
    const ca_shape before = shape_of(first), after = shape_of(second);
    ca_accel *accel = build(&before), *next = NULL, *other = NULL;
    assert_int_equal(ca_accel_create_after(accel, &after, 1, 1, NULL, 0, 1, NULL, &next, NULL), CA_OK);
    assert_int_equal(ca_accel_builds(accel), 1);
    assert_int_equal(ca_accel_builds(next), 0);
    ca_accel_destroy(accel);
    ca_curve_destroy(first);
    ca_hit hit;
    assert_true(ca_accel_intersect(next, (ca_vec3){0.0f, 0.4f, 5.0f}, (ca_vec3){0, 0, -1}, 0.0f, INFINITY, &hit));
    second->points[4] += 0.5f;
    assert_int_equal(ca_accel_create_after(next, &after, 1, 1, NULL, 0, 1, NULL, &other, NULL), CA_OK);
    ca_accel_destroy(next);
    ca_accel_destroy(other);
    ca_curve_destroy(second);
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

static void test_curves_are_read(void **state)
{
    (void)state;
    ca_curve *curve;
    ca_error error;
    const char *text = "\n  \n0 0 0 1\n1 0 0 .5\r\n2 0 0 1e-1\n\n\n 4 0 0 1\n\t5 0 0 1";
    assert_int_equal(read_text(text, CA_CURVE_LINEAR, &curve, &error), CA_OK);
    assert_int_equal(curve->point_count, 5);
    assert_int_equal(curve->segment_count, 3);
    assert_int_equal(curve->segments[0], 0);
    assert_int_equal(curve->segments[1], 1);
    assert_int_equal(curve->segments[2], 3);
    assert_true(curve->points[4 * 1 + 3] == 0.5f && curve->points[4 * 4] == 5.0f);
    ca_curve_destroy(curve);
}

static void test_faulty_curves_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        ca_curve_degree degree;
        const char *message;
    } faulty[] = {
        {"", CA_CURVE_LINEAR, "the file has no curves"},
        {"0 0 0 1\n", CA_CURVE_LINEAR, ":2:1: this curve ends after 1 control points, but needs 2"},
        {"0 0 0 1\n1 0 0 1\n2 0 0 1\n\n3 0 0 1", CA_CURVE_CUBIC, ":4:1: this curve ends after 3 control points"},
        {"0 0 0 1\n1 0 0\n", CA_CURVE_LINEAR, ":2:6: expected a number for the radius"},
        {"0 0 0 1\n1 0 0 -1\n", CA_CURVE_LINEAR, ":2:7: a radius cannot be negative"},
        {"0 0 0 1\n1 0 0 1\n2 0 0 0\n3 0 0 -1\n4 0 0 -2\n", CA_CURVE_CUBIC,
         ":6:1: the radius of this curve is negative around its control point 3"},
        {"0 0 0 1 7\n1 0 0 1\n", CA_CURVE_LINEAR, ":1:9: expected the end of the line"},
        {"0 0 0 1\n1 nan 0 1\n", CA_CURVE_LINEAR, ":2:3: expected a number for y"},
        {"# hair\n0 0 0 1\n1 0 0 1\n", CA_CURVE_LINEAR, ":1:1: expected a number for x"},
    };
    for (size_t i = 0; i < sizeof faulty / sizeof *faulty; i++) {
        ca_curve *curve;
        ca_error error;
        assert_int_equal(read_text(faulty[i].text, faulty[i].degree, &curve, &error), CA_ERROR_FORMAT);
        assert_null(curve);
        if (!strstr(error.message, faulty[i].message)) fail_msg("\"%s\"", error.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_points_of_b_splines),
        cmocka_unit_test(test_points_of_polylines),
        cmocka_unit_test(test_hits_are_mitsubas),
        cmocka_unit_test(test_rays_leave),
        cmocka_unit_test(test_tips),
        cmocka_unit_test(test_degenerate_segments),
        cmocka_unit_test(test_equal_curves_are_built_once),
        cmocka_unit_test(test_curves_are_read),
        cmocka_unit_test(test_faulty_curves_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
