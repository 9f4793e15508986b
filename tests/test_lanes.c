/* Eight lanes at a time against their scalar twins, bit for bit, for every number that a sampler gives. */
#include "geometry/shape.h"
#include "integrator/batch_lanes.h"
#include "math/arc_tangent.h"
#include "math/exponential.h"
#include "sampling/warp.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

enum { TRIALS = 200000 };

static ca_test_random numbers;
static float uniform(void) { return ca_test_random_float(&numbers); }

static void check_bits(float got, float expected, const char *what)
{
    const bool both_nan = isnan(got) && isnan(expected);
    if (!both_nan && ca_float_bits(got) != ca_float_bits(expected))
        fail_msg("%s: %a, should be %a", what, (double)got, (double)expected);
}

static void check_lane(const ca_v8 *got, int k, ca_vec3 expected, const char *what)
{
    check_bits(got->x[k], expected.x, what);
    check_bits(got->y[k], expected.y, what);
    check_bits(got->z[k], expected.z, what);
}

/* ---- Single numbers -------------------------------------------------------------------------------------------- */

static const float special[] = {0.0f,      -0.0f,     1.0f,           -1.0f,      0x1p-149f, -0x1p-149f,
                                0x1p-126f, 0.1f,      CA_PI,          -1e30f,     FLT_MAX,   -FLT_MAX,
                                INFINITY,  -INFINITY, 0x1.fffffep-1f, 0x1.8p-130f};
enum { SPECIAL = sizeof special / sizeof special[0] };

static float any_number(void)
{
    const uint32_t kind = ca_test_random_u32(&numbers) % 4;
    if (kind == 0) return special[ca_test_random_u32(&numbers) % SPECIAL];
    if (kind == 1) return NAN;
    const float x = ca_bits_float(ca_test_random_u32(&numbers));
    return kind == 2 ? x : 2.0f * uniform() - 1.0f;
}

static void test_choices_and_signs(void **state)
{
    (void)state;
    for (int trial = 0; trial < TRIALS; trial++) {
        ca_f8 a, b;
        for (int k = 0; k < CA_LANES; k++) a[k] = any_number(), b[k] = any_number();
        const ca_f8 low = ca_min8(a, b), high = ca_max8(a, b), size = ca_abs8(a), signed_a = ca_copysign8(a, b),
                    root = ca_sqrt8(a), chosen = ca_select8(a < b, a, b), below = ca_floor8(a), near = ca_rint8(a);
        const uint32_t bits = ca_mask_bits(a < b);
        for (int k = 0; k < CA_LANES; k++) {
            check_bits(low[k], ca_min(a[k], b[k]), "min");
            check_bits(high[k], ca_max(a[k], b[k]), "max");
            check_bits(size[k], fabsf(a[k]), "abs");
            check_bits(signed_a[k], copysignf(a[k], b[k]), "copysign");
            check_bits(root[k], sqrtf(a[k]), "sqrt");
            check_bits(below[k], floorf(a[k]), "floor");
            check_bits(near[k], rintf(a[k]), "rint");
            check_bits(chosen[k], a[k] < b[k] ? a[k] : b[k], "select");
            assert_int_equal(bits >> k & 1, a[k] < b[k]);
        }
        assert_int_equal(bits >> CA_LANES, 0);
    }
}

/* A sign is taken from a NaN too, and a NaN keeps its bits but the sign. */
static void test_signs_of_nan(void **state)
{
    (void)state;
    const ca_f8 nan = ca_f8_all(ca_bits_float(0x7fc12345)), one = ca_f8_all(1.0f);
    for (int k = 0; k < CA_LANES; k++) {
        assert_int_equal(ca_float_bits(ca_copysign8(one, -nan)[k]), ca_float_bits(-1.0f));
        assert_int_equal(ca_float_bits(ca_copysign8(nan, -one)[k]), 0xffc12345);
        assert_int_equal(ca_float_bits(ca_abs8(-nan)[k]), 0x7fc12345);
        assert_int_equal(ca_float_bits(ca_min8(nan, one)[k]), ca_float_bits(1.0f));
        assert_int_equal(ca_float_bits(ca_max8(one, nan)[k]), 0x7fc12345);
    }
}

/* Sums of pairs, then of fours, then of all; of weights they never fall, and a weight of 0 adds nothing. */
static void test_sums(void **state)
{
    (void)state;
    for (int trial = 0; trial < TRIALS; trial++) {
        ca_f8 v;
        for (int k = 0; k < CA_LANES; k++)
            v[k] = ca_test_random_u32(&numbers) % 3 ? uniform() * ldexpf(1.0f, (int)(16.0f * uniform())) : 0.0f;
        const ca_f8 sums = ca_sums8(v);
        const float four = (v[3] + v[2]) + (v[1] + v[0]);
        check_bits(sums[0], v[0], "sum of one");
        check_bits(sums[2], v[2] + (v[1] + v[0]), "sum of three");
        check_bits(sums[5], (v[5] + v[4]) + four, "sum of six");
        check_bits(sums[7], ((v[7] + v[6]) + (v[5] + v[4])) + four, "sum of eight");
        for (int k = 1; k < CA_LANES; k++) assert_true(v[k] > 0.0f ? sums[k] >= sums[k - 1] : sums[k] == sums[k - 1]);
    }
}

static void test_rounding_up_to_groups(void **state)
{
    (void)state;
    static const uint32_t up[][2] = {{0, 0}, {1, 8}, {7, 8}, {8, 8}, {9, 16}, {511, 512}, {512, 512}};
    for (size_t i = 0; i < sizeof up / sizeof up[0]; i++) assert_int_equal(ca_lanes_up(up[i][0]), up[i][1]);
}

/* ---- Vectors --------------------------------------------------------------------------------------------------- */

static ca_vec3 some_vector(void)
{
    const float scale = powf(10.0f, 12.0f * uniform() - 6.0f);
    const ca_vec3 v = {scale * (2.0f * uniform() - 1.0f), scale * (2.0f * uniform() - 1.0f),
                       scale * (2.0f * uniform() - 1.0f)};
    return v;
}

static void fill(ca_v8 *lanes, ca_vec3 *scalar, ca_vec3 make(void))
{
    for (int k = 0; k < CA_LANES; k++) {
        scalar[k] = make();
        lanes->x[k] = scalar[k].x, lanes->y[k] = scalar[k].y, lanes->z[k] = scalar[k].z;
    }
}

static void test_vectors(void **state)
{
    (void)state;
    for (int trial = 0; trial < TRIALS; trial++) {
        ca_v8 a8, b8;
        ca_vec3 a[CA_LANES], b[CA_LANES];
        fill(&a8, a, some_vector), fill(&b8, b, some_vector);
        const float of_any_size = powf(10.0f, 60.0f * uniform() - 30.0f);
        const ca_v8 sized = ca_mul_v8(a8, ca_f8_all(of_any_size)), direction = ca_normalize_any_v8(sized);
        const ca_f8 s = a8.x;
        const ca_v8 sum = ca_add_v8(a8, b8), difference = ca_sub_v8(a8, b8), product = ca_mul_v8(b8, s),
                    more = ca_madd_v8(a8, s, b8), cross = ca_cross_v8(a8, b8), unit = ca_normalize_v8(a8),
                    size = ca_abs_v8(a8), high = ca_max_v8(a8, b8), back = ca_neg_v8(a8),
                    chosen = ca_select_v8(a8.y < b8.y, a8, b8);
        const ca_f8 dot = ca_dot_v8(a8, b8), largest = ca_max3_v8(a8);
        for (int k = 0; k < CA_LANES; k++) {
            check_lane(&sum, k, ca_add(a[k], b[k]), "add");
            check_lane(&difference, k, ca_sub(a[k], b[k]), "sub");
            check_lane(&product, k, ca_mul(b[k], a[k].x), "mul");
            check_lane(&more, k, ca_madd(a[k], a[k].x, b[k]), "madd");
            check_lane(&cross, k, ca_cross(a[k], b[k]), "cross");
            check_lane(&unit, k, ca_normalize(a[k]), "normalize");
            check_lane(&direction, k, ca_normalize_any(ca_mul(a[k], of_any_size)), "normalize_any");
            check_lane(&size, k, ca_abs3(a[k]), "abs of a vector");
            check_lane(&high, k, ca_max_vec3(a[k], b[k]), "max of vectors");
            check_lane(&back, k, ca_neg(a[k]), "neg");
            check_lane(&chosen, k, a[k].y < b[k].y ? a[k] : b[k], "select of vectors");
            check_bits(dot[k], ca_dot(a[k], b[k]), "dot");
            check_bits(largest[k], ca_max3(a[k]), "max3");
        }
    }
}

/* ---- Directions and origins ------------------------------------------------------------------------------------ */

/* Angles of any points but those that are no numbers; sines and cosines of a few turns; directions all around. */
static void test_angles(void **state)
{
    (void)state;
    for (int trial = 0; trial < TRIALS; trial++) {
        ca_f8 x, y, u, v, angle, sine, cosine;
        for (int k = 0; k < CA_LANES; k++) {
            do x[k] = any_number(), y[k] = any_number();
            while (!isfinite(x[k]) || !isfinite(y[k]));
            u[k] = uniform(), v[k] = uniform(), angle[k] = 40.0f * uniform() - 20.0f;
        }
        const ca_f8 angles = ca_atan2_8(y, x), turns = ca_turn8(x, y);
        if (trial == 0) u[0] = v[0] = 0.5f; /* the disk's middle */
        const ca_v8 directions = ca_sphere8(u, v);
        ca_f8 disk_x, disk_y;
        ca_disk8(u, v, &disk_x, &disk_y);
        ca_sincos8(angle, &sine, &cosine);
        for (int k = 0; k < CA_LANES; k++) {
            const ca_vec2 disk = ca_warp_disk((ca_vec2){u[k], v[k]});
            check_bits(disk_x[k], disk.x, "disk, x");
            check_bits(disk_y[k], disk.y, "disk, y");
            float s, c;
            ca_sincos(angle[k], &s, &c);
            check_bits(angles[k], ca_atan2(y[k], x[k]), "atan2");
            check_bits(turns[k], ca_turn(x[k], y[k]), "turn");
            check_bits(sine[k], s, "sine");
            check_bits(cosine[k], c, "cosine");
            check_lane(&directions, k, ca_warp_sphere((ca_vec2){u[k], v[k]}), "sphere");
        }
    }
}

/* The numbers number / 2^24: of `u` where it varies, else of `v`. */
static void check_hemisphere(bool u_varies, float fixed)
{
    for (uint32_t first = 0; first < 1u << 24; first += CA_LANES) {
        ca_f8 number;
        for (int k = 0; k < CA_LANES; k++) number[k] = (float)(first + (uint32_t)k) * 0x1p-24f;
        const ca_f8 other = ca_f8_all(fixed);
        const ca_v8 got = ca_cosine_hemisphere8(u_varies ? number : other, u_varies ? other : number);
        uint32_t differ = 0;
        ca_vec3 expected[CA_LANES];
        for (int k = 0; k < CA_LANES; k++) {
            expected[k] = ca_warp_cosine_hemisphere(u_varies ? (ca_vec2){number[k], fixed}
                                                             : (ca_vec2){fixed, number[k]});
            differ |= ca_float_bits(got.x[k]) ^ ca_float_bits(expected[k].x);
            differ |= ca_float_bits(got.y[k]) ^ ca_float_bits(expected[k].y);
            differ |= ca_float_bits(got.z[k]) ^ ca_float_bits(expected[k].z);
        }
        for (int k = 0; differ && k < CA_LANES; k++)
            check_lane(&got, k, expected[k], u_varies ? "hemisphere, u" : "hemisphere, v");
    }
}

static void test_hemisphere(void **state)
{
    (void)state;
    check_hemisphere(false, 0.7123f);
    check_hemisphere(true, 0.61803f);
    check_hemisphere(true, 0.1f);
}

/* Unit vectors, many of them along axes or in planes of them, with zeros of both signs. */
static ca_vec3 some_normal(void)
{
    ca_vec3 n = ca_warp_sphere((ca_vec2){uniform(), uniform()});
    const uint32_t kind = ca_test_random_u32(&numbers);
    if (kind & 1) return n;
    if (kind & 2) n.x = kind & 4 ? 0.0f : -0.0f;
    if (kind & 8) n.y = kind & 16 ? 0.0f : -0.0f;
    if (kind & 32) n.z = kind & 64 ? 0.0f : -0.0f;
    const float length = ca_length(n);
    return length > 0.0f ? ca_mul(n, 1.0f / length) : ca_vec3_make(-0.0f, 0.0f, kind & 128 ? 1.0f : -1.0f);
}

static void test_frames_and_origins(void **state)
{
    (void)state;
    for (int trial = 0; trial < TRIALS; trial++) {
        ca_v8 n8, d8, p8;
        ca_vec3 n[CA_LANES], d[CA_LANES], p[CA_LANES];
        fill(&n8, n, some_normal), fill(&d8, d, some_normal), fill(&p8, p, some_vector);
        const ca_f8 error = ca_abs8(p8.y) * 1e-6f;
        const ca_v8 world = ca_to_world8(n8, d8), origin = ca_offset_origin8(p8, error, n8, d8);
        for (int k = 0; k < CA_LANES; k++) {
            const ca_frame frame = ca_frame_from_normal(n[k]);
            check_lane(&world, k, ca_to_world(&frame, d[k]), "to_world");
            const ca_vec3 bound = {error[k], error[k], error[k]};
            check_lane(&origin, k, ca_offset_origin(p[k], bound, n[k], d[k]), "offset_origin");
        }
    }
}

/* Every 61st of all floats, both signs, beyond the ends of the interval too. */
static void test_exponential(void **state)
{
    (void)state;
    enum { STEP = 61 };
    double worst = 0.0;
    for (uint64_t bits = 0; bits + 8 * STEP < UINT64_C(0xff800000); bits += 8 * STEP) {
        ca_f8 x;
        for (uint32_t k = 0; k < CA_LANES; k++) x[k] = ca_bits_float((uint32_t)bits + k * STEP);
        const ca_f8 got = ca_exp8(x);
        for (int k = 0; k < CA_LANES; k++) check_bits(got[k], ca_exp(x[k]), "exp");
        const double exact = exp((double)x[0]);
        if (x[0] >= -87.0f && x[0] <= 88.0f) worst = fmax(worst, fabs((double)got[0] / exact - 1.0));
    }
    printf("largest relative error %.3g\n", worst);
    assert_true(worst < 1.2e-7);
    check_bits(ca_exp(0.0f), 1.0f, "exp of 0");
    check_bits(ca_exp(-1e30f), ca_exp(-87.0f), "exp of what is far below");
}

/* ---- Places ---------------------------------------------------------------------------------------------------- */

/* The lanes of every mask close up in their order. */
static void test_places_of_bits(void **state)
{
    (void)state;
    const ca_f8 lanes = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    for (uint32_t bits = 0; bits < 256; bits++) {
        const ca_f8 closed = ca_permute8(lanes, ca_places_of_bits(bits));
        uint32_t count = 0;
        for (uint32_t k = 0; k < CA_LANES; k++)
            if (bits >> k & 1) check_bits(closed[count++], (float)k, "a lane that closes up");
    }
}

static void test_bits_below(void **state)
{
    (void)state;
    const ca_m8 mask = {-1, 0, -1, -1, 0, 0, -1, -1};
    static const uint32_t expected[] = {0x00, 0x01, 0x01, 0x05, 0x0d, 0x0d, 0x0d, 0x4d, 0xcd, 0xcd, 0xcd};
    for (uint32_t count = 0; count < sizeof expected / sizeof expected[0]; count++)
        assert_int_equal(ca_mask_bits_below(mask, count), expected[count]);
    assert_int_equal(ca_mask_bits_below(mask, UINT32_MAX), 0xcd);
}

int main(void)
{
    numbers = ca_test_random_seed(2);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_angles),
        cmocka_unit_test(test_choices_and_signs),     cmocka_unit_test(test_signs_of_nan),
        cmocka_unit_test(test_rounding_up_to_groups), cmocka_unit_test(test_vectors),
        cmocka_unit_test(test_hemisphere),            cmocka_unit_test(test_frames_and_origins),
        cmocka_unit_test(test_exponential),           cmocka_unit_test(test_sums),
        cmocka_unit_test(test_places_of_bits),        cmocka_unit_test(test_bits_below),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
