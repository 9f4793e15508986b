/* Reconstruction filters: integrals, weights, and samples distributed as |f|. */
#include "sampling/filter.h"

#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { KINDS = 6 };

static ca_filter prepared(int kind)
{
    ca_filter filter = ca_filter_default((ca_filter_kind)kind);
    ca_filter_prepare(&filter);
    return filter;
}

/* Midpoint sum of f, or |f|, over [from, to]. */
static double integrate(const ca_filter *filter, double from, double to, bool absolute)
{
    enum { STEPS = 2000 };
    double sum = 0.0;
    for (int i = 0; i < STEPS; i++) {
        const double value = (double)ca_filter_eval(filter, (float)(from + (to - from) * (i + 0.5) / STEPS));
        sum += absolute ? fabs(value) : value;
    }
    return sum * (to - from) / STEPS;
}

static void test_eval(void **state)
{
    (void)state;
    static const float radii[KINDS] = {0.5f, 1.0f, 2.0f, 2.0f, 2.0f, 3.0f};
    for (int kind = 0; kind < KINDS; kind++) {
        const ca_filter filter = prepared(kind);
        assert_true(filter.radius == radii[kind]);
        const double radius = (double)filter.radius;
        assert_true(fabs(integrate(&filter, -radius, radius, false) - 1.0) < 1e-4);
        assert_true(ca_filter_eval(&filter, filter.radius) == 0.0f);
        assert_true(ca_filter_eval(&filter, -filter.radius - 1.0f) == 0.0f);
        for (float x = 0.0f; x < filter.radius; x += 0.1f)
            assert_true(ca_filter_eval(&filter, x) == ca_filter_eval(&filter, -x));
    }
}

/* Values from the formulae by hand, times the integral. */
static void test_values(void **state)
{
    (void)state;
    static const struct {
        ca_filter_kind kind;
        float x, value;
    } cases[] = {
        {CA_RFILTER_BOX, 0.3f, 1.0f},
        {CA_RFILTER_TENT, 0.25f, 0.75f},
        {CA_RFILTER_GAUSSIAN, 0.0f, 0.99966454f}, /* 1 - exp(-8) */
        {CA_RFILTER_GAUSSIAN, 0.5f, 0.6061952f},  /* exp(-1/2) - exp(-8) */
        {CA_RFILTER_MITCHELL, 0.0f, 8.0f / 9.0f},
        {CA_RFILTER_MITCHELL, 1.0f, 1.0f / 18.0f},
        {CA_RFILTER_MITCHELL, 1.5f, -5.0f / 144.0f},
        {CA_RFILTER_CATMULL_ROM, 0.0f, 1.0f},
        {CA_RFILTER_CATMULL_ROM, 0.5f, 0.5625f},
        {CA_RFILTER_CATMULL_ROM, 1.5f, -0.0625f},
        {CA_RFILTER_LANCZOS, 0.0f, 1.0f},
        {CA_RFILTER_LANCZOS, 0.5f, 0.6079271f}, /* (2 / pi) (3 / pi) */
        {CA_RFILTER_LANCZOS, 1.0f, 0.0f},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const ca_filter filter = prepared((int)cases[i].kind);
        const float value = ca_filter_eval(&filter, cases[i].x) * filter.integral;
        if (fabsf(value - cases[i].value) > 2e-6f)
            fail_msg("%s(%g) = %.7g, not %.7g", ca_filter_name(cases[i].kind), (double)cases[i].x, (double)value,
                     (double)cases[i].value);
    }
}

static void test_weights(void **state)
{
    (void)state;
    enum { COUNT = 400000 };
    for (int kind = 0; kind < KINDS; kind++) {
        const ca_filter filter = prepared(kind);
        ca_test_random random = ca_test_random_seed((uint64_t)kind);
        double sum = 0.0, squares = 0.0, moment = 0.0;
        for (int i = 0; i < COUNT; i++) {
            float weight;
            const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
            const ca_vec2 offset = ca_filter_sample(&filter, u, &weight);
            assert_true(fabsf(offset.x) <= filter.radius && fabsf(offset.y) <= filter.radius);
            sum += (double)weight;
            squares += (double)weight * (double)weight;
            moment += (double)(weight * offset.x);
        }
        const double mean = sum / COUNT, sd = sqrt(fmax(squares / COUNT - mean * mean, 0.0));
        assert_true(fabs(mean - 1.0) < 4.0 * sd / sqrt(COUNT) + 1e-6);
        assert_true(fabs(moment / COUNT) < 4.0 * 3.0 * (1.0 + sd) / sqrt(COUNT));
        /* Positive filters lose next to nothing to uneven weights. */
        if (kind <= CA_RFILTER_GAUSSIAN) assert_true(sd < 0.005);
    }
}

/* Weighted histogram of one axis against the integral of f, unweighted against |f|. */
static void test_histogram(void **state)
{
    (void)state;
    enum { COUNT = 300000, BINS = 48 };
    for (int kind = 0; kind < KINDS; kind++) {
        const ca_filter filter = prepared(kind);
        const double radius = (double)filter.radius, total = integrate(&filter, -radius, radius, true);
        double observed[BINS] = {0}, expected[BINS], weighted[BINS] = {0};
        ca_test_random random = ca_test_random_seed(100 + (uint64_t)kind);
        for (int i = 0; i < COUNT; i++) {
            float weight;
            const ca_vec2 u = {0.5f, ca_test_random_float(&random)};
            float unit_weight;
            ca_filter_sample(&filter, (ca_vec2){0.5f, 0.5f}, &unit_weight);
            const ca_vec2 offset = ca_filter_sample(&filter, u, &weight);
            const double place = ((double)offset.y / radius + 1.0) * 0.5 * BINS;
            const int bin = (int)fmin(place, BINS - 1.0);
            observed[bin] += 1.0;
            weighted[bin] += (double)(weight / sqrtf(unit_weight));
        }
        for (int i = 0; i < BINS; i++) {
            const double from = radius * (2.0 * i / BINS - 1.0), to = radius * (2.0 * (i + 1) / BINS - 1.0);
            expected[i] = COUNT * integrate(&filter, from, to, true) / total;
            const double exact = integrate(&filter, from, to, false);
            assert_true(fabs(weighted[i] / COUNT - exact) < 5.0 * total * sqrt(expected[i] + 20.0) / COUNT);
        }
        /* |f| is sampled up to its curvature between the table's nodes: where it has kinks (at its zeros) a bin may
         * be off by a percent, so only filters without are held to the chi-square. */
        if (kind <= CA_RFILTER_GAUSSIAN) {
            const double p = ca_chi_square_counts(observed, expected, BINS, NULL, NULL);
            if (p < ca_sidak_level(0.01, 3)) fail_msg("%s: p = %g", ca_filter_name(filter.kind), p);
        }
        for (int i = 0; i < BINS; i++) assert_true(fabs(observed[i] - expected[i]) < 0.004 * COUNT);
    }
}

/* However many lobes there are, samples reach each of them: those between two nodes of the table with weights that
 * make the integral of f there, and none of which is large. */
static void test_lanczos_lobes(void **state)
{
    (void)state;
    enum { COUNT = 1 << 20 };
    for (int lobes = 1; lobes <= 32; lobes++) {
        ca_filter filter = ca_filter_default(CA_RFILTER_LANCZOS);
        filter.lobes = (float)lobes;
        ca_filter_prepare(&filter);
        double found[CA_FILTER_TABLE] = {0.0}, largest = 0.0;
        for (int i = 0; i < COUNT; i++) {
            float x = ((float)i + 0.5f) / COUNT, weight;
            ca_filter_sample_axis(&filter, 1, &x, &weight);
            const int cell = (int)((double)(x / filter.radius + 1.0f) * 0.5 * CA_FILTER_TABLE);
            found[cell < CA_FILTER_TABLE ? cell : CA_FILTER_TABLE - 1] += (double)weight / COUNT;
            largest = fmax(largest, fabs((double)weight));
        }
        const double width = 2.0 * lobes / CA_FILTER_TABLE;
        for (int i = 0; i < CA_FILTER_TABLE; i++) {
            const double exact = integrate(&filter, i * width - lobes, (i + 1) * width - lobes, false);
            if (!(fabs(found[i] - exact) < 1e-4))
                fail_msg("%d lobes, cell %d: %g, not %g", lobes, i, found[i], exact);
        }
        const double ideal = integrate(&filter, -lobes, lobes, true);
        if (!(largest < 1.75 * ideal)) fail_msg("%d lobes: a weight of %g, where %g do", lobes, largest, ideal);
    }
}

static void test_names(void **state)
{
    (void)state;
    assert_string_equal(ca_filter_name(CA_RFILTER_CATMULL_ROM), "catmullrom");
    assert_string_equal(ca_filter_name(CA_RFILTER_LANCZOS), "lanczos");
    assert_null(ca_filter_name((ca_filter_kind)6));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_eval),      cmocka_unit_test(test_values), cmocka_unit_test(test_weights),
        cmocka_unit_test(test_histogram), cmocka_unit_test(test_lanczos_lobes),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests_name("filter", tests, NULL, NULL);
}
