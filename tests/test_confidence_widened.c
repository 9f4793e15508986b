/* Widened intervals over many pictures: the limit for lone contributions against tables and exact probabilities, and
 * how many widened intervals hold the expectation, on average over pictures. One picture tells little of that: its
 * pixels learn from the same few contributions. */
#include "film/confidence.h"
#include "support/expect_near.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static ca_test_random random_source;

static double uniform(void) { return ca_test_random_open(&random_source); }
static double exponential(void) { return -log(uniform()); }

/* ---- The limit for lone contributions -------------------------------------------------------------------------- */

/* Upper 5 % points of F with 2 k + 2 and 2 k degrees of freedom, as in tables. */
static void test_limit_is_of_tables(void **state)
{
    (void)state;
    static const struct {
        double k, f, least, most;
    } table[] = {
        {1, 19.2468, 1.0, 1.29}, {2, 6.1631, 1.0, 1.03},   {3, 4.1468, 0.99, 1.01},
        {5, 2.9130, 0.99, 1.01}, {10, 2.1123, 0.99, 1.01}, {60, 1.3519, 0.99, 1.01},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        const double k = table[i].k, size = 0.7;
        const double ratio = ca_confidence_lone_limit(k * size, k * size * size) / (size * (k + 1.0) * table[i].f);
        if (!(ratio >= table[i].least && ratio <= table[i].most)) fail_msg("%g contributions: %.4f", k, ratio);
    }
}

static void test_limit_of_none_and_of_unequal_ones(void **state)
{
    (void)state;
    assert_true(ca_confidence_lone_limit(0.0, 0.0) == 0.0);
    const double of_equal_ones = ca_confidence_lone_limit(4.0, 4.0); /* four of size one; 2.5 and three of a half */
    assert_true(ca_confidence_lone_limit(4.0, 2.5 * 2.5 + 0.75) > 1.5 * of_equal_ones);
    /* Rounding of the squares does not make it less than one contribution. */
    const double of_one = ca_confidence_lone_limit(0.3, 0.3 * 0.3);
    expect_near(ca_confidence_lone_limit(0.3, 0.3 * 0.3 * (1.0 + 1e-15)), of_one, 1e-12);
}

/* Of those that have found any, the limit holds the expectation of 0.1 to 50 contributions in 95 %: of equal ones,
 * and of exponentially distributed ones. */
static void test_limit_holds(void **state)
{
    (void)state;
    enum { TRIALS = 20000 };
    for (double expected = 0.1; expected < 50.0; expected *= 1.5) {
        int found[2] = {0}, held[2] = {0};
        for (int t = 0; t < TRIALS; t++) {
            double sum[2] = {0.0}, squares[2] = {0.0};
            for (double time = exponential(); time < expected; time += exponential())
                for (int kind = 0; kind < 2; kind++) {
                    const double size = kind ? exponential() : 1.0;
                    sum[kind] += size;
                    squares[kind] += size * size;
                }
            for (int kind = 0; kind < 2; kind++) {
                found[kind] += sum[kind] > 0.0;
                held[kind] += sum[kind] > 0.0 && ca_confidence_lone_limit(sum[kind], squares[kind]) >= expected;
            }
        }
        for (int kind = 0; kind < 2; kind++)
            if (!(held[kind] > 0.95 * found[kind]))
                fail_msg("%g contributions, sizes %d: %d of %d", expected, kind, held[kind], found[kind]);
    }
}

/* ---- Calibration ----------------------------------------------------------------------------------------------- */

enum { SIDE = 64, PIXELS = SIDE * SIDE, SAMPLES = 64, PICTURES = 96 };

static double equal(void) { return 1.0; }
static double log_normal(void) /* of expectation 1 and a variance of 8.5: half of the light is one in fifteen's */
{
    const double normal = sqrt(-2.0 * log(uniform())) * cos(6.283185307179586 * uniform());
    return exp(1.5 * normal - 1.125);
}
static double pareto(void) { return 0.5 / sqrt(uniform()); } /* of expectation 1, without a variance */

/* Quiet light of two levels, in squares, and rare contributions, which bring a multiple of it. */
static const struct rare_light {
    double number, share; /* of contributions to a pixel; of their light, relative to the quiet one */
    const char *name;
    double (*size)(void); /* of expectation 1 */
    double scale, levels; /* negative: they are dark; the brighter level over the darker one */
} rare_lights[] = {
    {0.003, 0.3, "equal ones", equal, 1.0, 3.0},
    {0.003, 1.0, "exponential ones", exponential, 1.0, 3.0},
    {0.006, 0.3, "equal ones", equal, 1.0, 3.0},
    {0.006, 1.0, "exponential ones", exponential, 1.0, 3.0},
    {0.012, 0.3, "equal ones", equal, 1.0, 3.0},
    {0.012, 0.3, "equal ones", equal, -1.0, 3.0},
    {0.012, 0.3, "equal ones", equal, 1.0, 10.0},
    {0.012, 0.3, "exponential ones", exponential, 1.0, 3.0},
    {0.012, 1.0, "log-normal ones", log_normal, 1.0, 3.0},
    {0.025, 1.0, "exponential ones", exponential, 1.0, 3.0},
    {0.025, 1.0, "log-normal ones", log_normal, 1.0, 3.0},
    {0.025, 1.0, "Pareto's", pareto, 1.0, 3.0},
    {0.05, 1.0, "equal ones", equal, 1.0, 3.0},
    {0.05, 1.0, "exponential ones", exponential, 1.0, 3.0},
    {0.05, 1.0, "log-normal ones", log_normal, 1.0, 3.0},
    {0.1, 1.0, "exponential ones", exponential, 1.0, 3.0},
    {0.3, 0.5, "equal ones", equal, 1.0, 3.0},
    {0.3, 1.0, "log-normal ones", log_normal, 1.0, 3.0},
};

static ca_moments draw_pixel(const struct rare_light *light, double level)
{
    const double p = light->number / SAMPLES, size = light->scale * light->share / p;
    double sum = 0.0, squares = 0.0, cubes = 0.0;
    for (int k = 0; k < SAMPLES; k++) {
        double value = level * (1.0 + 0.35 * (uniform() - 0.5));
        if (uniform() < p) value += level * size * light->size();
        sum += value;
        squares += value * value;
        cubes += value * value * value;
    }
    return ca_moments_of(sum, squares, cubes, SAMPLES);
}

typedef struct tally {
    double widened, widened_held, held; /* pixels; held: of all */
} tally;

/* Of one picture. */
static tally draw_picture(const struct rare_light *light, double quantile)
{
    static ca_moments moments[PIXELS];
    static ca_verdict verdicts[PIXELS];
    static double levels[PIXELS];
    tally t = {0.0, 0.0, 0.0};
    for (int i = 0; i < PIXELS; i++) {
        levels[i] = (i % SIDE / 8 + i / SIDE / 8) % 2 ? light->levels : 1.0;
        moments[i] = draw_pixel(light, levels[i]);
    }
    assert_int_equal(ca_confidence_judge(moments, SIDE, SIDE, 2, verdicts, NULL), CA_OK);
    for (int i = 0; i < PIXELS; i++) {
        const double expectation = levels[i] * (1.0 + light->scale * light->share);
        const ca_interval interval = ca_confidence_judged_interval(&moments[i], &verdicts[i], quantile);
        const bool held = interval.low <= expectation && expectation <= interval.high;
        assert_true(verdicts[i].kind != CA_INTERVAL_MARKED);
        t.widened += verdicts[i].kind == CA_INTERVAL_WIDENED;
        t.widened_held += verdicts[i].kind == CA_INTERVAL_WIDENED && held;
        t.held += held;
    }
    return t;
}

/* The mean over pictures of the fraction of widened intervals that hold, less twice its standard error, is 93 % or
 * more: rates from one contribution in 333 pixels to one in three. Where nothing has been found nearby (a half of the
 * pixels, at the smallest rate) intervals are ordinary, and lack that light. */
static void check_light(const struct rare_light *light, double quantile)
{
    double sum = 0.0, squares = 0.0, least = 1.0;
    tally all = {0.0, 0.0, 0.0};
    for (int picture = 0; picture < PICTURES; picture++) {
        const tally t = draw_picture(light, quantile);
        const double held = t.widened_held / t.widened;
        assert_true(t.widened > 0.0);
        all.widened += t.widened;
        all.held += t.held;
        sum += held;
        squares += held * held;
        least = fmin(least, held);
    }
    const double mean = sum / PICTURES, variance = fmax(0.0, squares / PICTURES - mean * mean);
    const double error = sqrt(variance / (PICTURES - 1.0));
    printf("    %5.3f %-16s bring %4.1f, levels 1 and %2.0f: %5.1f %% widened, %6.2f +- %.2f %% of these held, "
           "%5.1f %% at least; %5.1f %% of all pixels\n",
           light->number, light->name, light->scale * light->share, light->levels,
           100.0 * all.widened / (PICTURES * PIXELS), 100.0 * mean, 100.0 * error, 100.0 * least,
           100.0 * all.held / (PICTURES * PIXELS));
    if (!(mean - 2.0 * error > 0.93)) fail_msg("%g %s: %.4f", light->number, light->name, mean);
}

static void test_calibration_over_pictures(void **state)
{
    (void)state;
    const double quantile = ca_student_two_sided_quantile(0.05, SAMPLES - 1.0);
    for (size_t l = 0; l < sizeof rare_lights / sizeof rare_lights[0]; l++) check_light(&rare_lights[l], quantile);
}

int main(void)
{
    random_source = ca_test_random_seed(23);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_limit_is_of_tables),
        cmocka_unit_test(test_limit_of_none_and_of_unequal_ones),
        cmocka_unit_test(test_limit_holds),
        cmocka_unit_test(test_calibration_over_pictures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
