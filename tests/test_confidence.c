/* Error bars: Student's quantile against tables, moments against computations in two passes, intervals by hand, the
 * rules for marks; and their calibration: how many intervals of made-up distributions hold the expectation. Renders:
 * test_error_bars.c. */
#include "film/confidence.h"
#include "film/film.h"
#include "image/layers.h"
#include "support/interval_tally.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static ca_test_random random_source;

static double uniform(void) { return ((double)ca_test_random_u32(&random_source) + 0.5) * 0x1p-32; }
static double normal(void) { return sqrt(-2.0 * log(uniform())) * cos(6.283185307179586 * uniform()); }

static void expect_near(double got, double expected, double relative)
{
    if (!(fabs(got - expected) <= relative * fabs(expected))) fail_msg("%.12g is not %.12g", got, expected);
}

/* ---- Student's quantile ---------------------------------------------------------------------------------------- */

/* Upper critical values, as in the tables of bookdown.org/pingapang9/linear_models_bookdown, appendix B. */
static void test_quantiles_of_tables(void **state)
{
    (void)state;
    static const struct {
        double degrees, alpha, t;
    } table[] = {
        {1, 0.2, 3.078},   {1, 0.001, 636.619}, {3, 0.05, 3.182},  {4, 0.01, 4.604},  {5, 0.05, 2.571},
        {7, 0.05, 2.365},  {10, 0.1, 1.812},    {12, 0.02, 2.681}, {17, 0.05, 2.110}, {25, 0.001, 3.725},
        {28, 0.05, 2.048}, {1e9, 0.05, 1.960},  {1e9, 0.01, 2.576},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        const double t = ca_student_two_sided_quantile(table[i].alpha, table[i].degrees);
        if (!(fabs(t - table[i].t) <= 0.00051)) fail_msg("%g degrees, %g: %.5f", table[i].degrees, table[i].alpha, t);
    }
}

/* With 1, 2 and 4 degrees the distribution has a simple inverse. */
static void test_quantiles_in_closed_form(void **state)
{
    (void)state;
    static const double alphas[] = {0.5, 0.1, 0.05, 0.01, 1e-4};
    for (int i = 0; i < 5; i++) {
        const double inside = 1.0 - alphas[i], q = alphas[i] * (2.0 - alphas[i]); /* 4 p (1 - p) */
        expect_near(ca_student_two_sided_quantile(alphas[i], 1), tan(0.5 * 3.141592653589793 * inside), 1e-10);
        expect_near(ca_student_two_sided_quantile(alphas[i], 2), inside * sqrt(2.0 / (1.0 - inside * inside)), 1e-10);
        const double root = cos(acos(sqrt(q)) / 3.0) / sqrt(q);
        expect_near(ca_student_two_sided_quantile(alphas[i], 4), 2.0 * sqrt(root - 1.0), 1e-9);
    }
}

/* ---- Moments --------------------------------------------------------------------------------------------------- */

static ca_moments moments_of_values(const double *values, uint32_t count)
{
    double sum = 0.0, squares = 0.0, cubes = 0.0;
    for (uint32_t i = 0; i < count; i++) {
        sum += values[i];
        squares += values[i] * values[i];
        cubes += values[i] * values[i] * values[i];
    }
    return ca_moments_of(sum, squares, cubes, count);
}

static void test_moments(void **state)
{
    (void)state;
    enum { COUNT = 100 };
    double values[COUNT], mean = 0.0, variance = 0.0, third = 0.0;
    for (int i = 0; i < COUNT; i++) values[i] = 2.0 - 5.0 * log(uniform());
    for (int i = 0; i < COUNT; i++) mean += values[i] / COUNT;
    for (int i = 0; i < COUNT; i++) {
        const double d = values[i] - mean;
        variance += d * d / (COUNT - 1.0);
        third += d * d * d * COUNT / ((COUNT - 1.0) * (COUNT - 2.0));
    }
    const ca_moments m = moments_of_values(values, COUNT);
    assert_int_equal(m.replicates, COUNT);
    expect_near(m.mean, mean, 1e-12);
    expect_near(m.variance, variance, 1e-11);
    expect_near(m.third, third, 1e-10);
}

/* The estimates have no bias: averaged over many samples of four, they are an exponential's 1, 1 and 2. */
static void test_moments_without_bias(void **state)
{
    (void)state;
    enum { TRIALS = 400000 };
    double mean = 0.0, variance = 0.0, third = 0.0;
    for (int t = 0; t < TRIALS; t++) {
        double values[4];
        for (int i = 0; i < 4; i++) values[i] = -log(uniform());
        const ca_moments m = moments_of_values(values, 4);
        mean += m.mean / TRIALS;
        variance += m.variance / TRIALS;
        third += m.third / TRIALS;
    }
    expect_near(mean, 1.0, 0.01);
    expect_near(variance, 1.0, 0.02);
    expect_near(third, 2.0, 0.10);
}

/* Equal values have neither variance nor skewness, whatever the sums were rounded to; nearly equal ones keep
 * theirs. */
static void test_moments_of_rounding(void **state)
{
    (void)state;
    enum { COUNT = 5000 };
    static double values[COUNT];
    for (int trial = 0; trial < 50; trial++) {
        const double value = exp(20.0 * uniform() - 10.0);
        for (int i = 0; i < COUNT; i++) values[i] = value;
        const ca_moments m = moments_of_values(values, COUNT);
        assert_true(m.variance == 0.0 && m.third == 0.0);
        for (int i = 0; i < COUNT; i++) values[i] = value * (1.0 + (i % 2 == 0 ? 1e-4 : -1e-4));
        expect_near(moments_of_values(values, COUNT).variance, 1e-8 * value * value, 0.001);
    }
}

/* ---- Intervals ------------------------------------------------------------------------------------------------- */

static void test_symmetric_interval_is_students(void **state)
{
    (void)state;
    const ca_moments m = {.mean = 5.0, .variance = 9.0, .third = 0.0, .replicates = 36};
    const ca_interval interval = ca_confidence_interval(&m, 2.03);
    expect_near(interval.low, 5.0 - 2.03 * 0.5, 1e-12);
    expect_near(interval.high, 5.0 + 2.03 * 0.5, 1e-12);
}

/* At the limit of the short tail's side the transformed statistic is the quantile, and the interval leans to where
 * the missing ones are. */
static void test_interval_inverts_the_transformation(void **state)
{
    (void)state;
    static const double thirds[] = {1e-9, 1e-5, 0.3, 4.0, 60.0, -0.3, -20.0};
    for (int i = 0; i < 7; i++) {
        const ca_moments m = {.mean = 3.0, .variance = 4.0, .third = thirds[i], .replicates = 25};
        const ca_interval interval = ca_confidence_interval(&m, 2.0);
        const bool right = thirds[i] > 0.0;
        const double a = thirds[i] / 8.0 / 5.0, t = (m.mean - (right ? interval.low : interval.high)) / (2.0 / 5.0);
        expect_near(t + a * t * t / 3.0 + a * a * t * t * t / 27.0 + a / 6.0, right ? 2.0 : -2.0, 1e-6);
        assert_true((interval.high - m.mean > m.mean - interval.low) == right);
    }
}

/* The probability of at most k where `expectation` are expected. */
static double poisson_cumulative(int k, double expectation)
{
    double term = exp(-expectation), sum = term;
    for (int i = 1; i <= k; i++) sum += term *= expectation / i;
    return sum;
}

/* k contributions of one size: beyond the limit as few as k would come with a probability of less than 2.5 %. */
static void test_long_tail_is_poissons(void **state)
{
    (void)state;
    const double size = 3.0, quantile = 1.9599639845400545;
    const uint32_t n = 1000000;
    for (int k = 1; k <= 400; k = k < 20 ? k + 1 : 2 * k) {
        const double p = (double)k / n;
        ca_moments m = {
            .mean = size * p, .variance = size * size * p, .third = size * size * size * p, .replicates = n};
        const double high = ca_confidence_interval(&m, quantile).high * n / size;
        const double beyond = poisson_cumulative(k, high);
        if (!(beyond > 0.0245 && beyond < 0.0255))
            fail_msg("%d contributions, at most %g expected: %.5f", k, high, beyond);
        m.third = -m.third; /* as many dark ones: the same downwards */
        expect_near(2.0 * m.mean - ca_confidence_interval(&m, quantile).low, high * size / n, 1e-12);
    }
}

static void test_interval_without_scatter(void **state)
{
    (void)state;
    const ca_moments m = {.mean = -0.8, .replicates = 64};
    const ca_interval interval = ca_confidence_interval(&m, 2.0);
    assert_true(interval.low < -0.8 && interval.low > -0.800001);
    assert_true(interval.high > -0.8 && interval.high < -0.799999);
    const ca_moments black = {.replicates = 64};
    const ca_interval nothing = ca_confidence_interval(&black, 2.0);
    assert_true(nothing.low == 0.0 && nothing.high == 0.0);
}

/* Limits between two floats go outwards, to the nearest one; those that are floats stay. */
static void test_limits_are_rounded_outwards(void **state)
{
    (void)state;
    static const double values[] = {1.0 + 0x1p-30, 1.0 - 0x1p-30, 0.1, 0.3, 1e-44, 1e-50, 3.0e38, 0.0, 7.5};
    for (int i = 0; i < 9; i++)
        for (int sign = -1; sign <= 1; sign += 2) {
            const double value = sign * values[i];
            float low, high;
            ca_interval_round((ca_interval){value, value}, &low, &high);
            assert_true((double)low <= value && (double)high >= value);
            if ((double)(float)value == value)
                assert_true((double)low == value && (double)high == value);
            else
                assert_true(nextafterf(low, INFINITY) == high);
        }
}

/* ---- Marks ----------------------------------------------------------------------------------------------------- */

enum { SIDE = 64, PIXELS = SIDE * SIDE };

static ca_film film_of(uint32_t width, uint32_t height)
{
    ca_film film;
    const uint32_t crop[4] = {0, 0, width, height};
    assert_int_equal(ca_film_create(&film, width, height, crop, NULL), CA_OK);
    return film;
}

static void add(ca_film *film, uint32_t pixel, double value)
{
    const ca_film_sample sample = {.filter_weight = 1.0f, .splat = ca_rgb_grey((float)value)};
    assert_true(ca_film_add(film, pixel % film->width, pixel / film->width, &sample));
}

static ca_image_layers *develop(const ca_film *film)
{
    ca_image_layers *layers;
    assert_int_equal(ca_film_develop(film, &layers, NULL), CA_OK);
    return layers;
}

static bool is_marked(const ca_image_layers *layers, uint32_t pixel)
{
    const float low = ca_layers_find(layers, "ConfidenceLow.Y")[pixel],
                high = ca_layers_find(layers, "ConfidenceHigh.Y")[pixel];
    assert_true((low == -HUGE_VALF) == (high == HUGE_VALF) && low <= high);
    return low == -HUGE_VALF;
}

/* Under eight replicates all is marked; with eight of a symmetric distribution hardly anything is. */
static void test_too_few_replicates(void **state)
{
    (void)state;
    for (int samples = 0; samples <= CA_CONFIDENCE_MIN_REPLICATES; samples++) {
        ca_film film = film_of(SIDE, SIDE);
        for (uint32_t i = 0; i < PIXELS; i++)
            for (int k = 0; k < samples; k++) add(&film, i, 5.0 + normal());
        ca_image_layers *layers = develop(&film);
        double marked;
        assert_true(ca_film_confidence_marked(layers, &marked));
        if (samples < CA_CONFIDENCE_MIN_REPLICATES) assert_true(marked == 1.0);
        else assert_true(marked < 0.02);
        ca_layers_destroy(layers);
        ca_film_destroy(&film);
    }
}

/* Constant pixels are known exactly, but near others that vary they may only have missed what varies. */
static void test_constant_pixels(void **state)
{
    (void)state;
    ca_film film = film_of(SIDE, SIDE);
    for (uint32_t i = 0; i < PIXELS; i++)
        for (int k = 0; k < 64; k++) add(&film, i, i % SIDE < SIDE / 2 ? 0.7 : 0.7 + 0.1 * normal());
    ca_image_layers *layers = develop(&film);
    for (uint32_t i = 0; i < PIXELS; i++) {
        const uint32_t x = i % SIDE;
        assert_true(is_marked(layers, i) == (x < SIDE / 2 && x + CA_CONFIDENCE_REACH >= SIDE / 2));
        if (x + CA_CONFIDENCE_REACH >= SIDE / 2) continue;
        assert_true((double)ca_layers_find(layers, "ConfidenceLow.G")[i] <= (double)0.7f);
        assert_true((double)ca_layers_find(layers, "ConfidenceHigh.G")[i] >= (double)0.7f);
        assert_true((double)ca_layers_find(layers, "ConfidenceHigh.G")[i] < 0.700001);
    }
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* One sample in four hundred holds two thirds of the light, the rest is quiet: most pixels never saw it in their 64,
 * and look as if all were well. Their neighbours tell. Beyond the fireflies' region and the reach nothing is
 * marked. */
static void test_fireflies_that_most_pixels_miss(void **state)
{
    (void)state;
    ca_film film = film_of(SIDE, SIDE);
    for (uint32_t i = 0; i < PIXELS; i++)
        for (int k = 0; k < 64; k++)
            add(&film, i, 1.0 + 0.1 * normal() + (i / SIDE < SIDE / 2 && uniform() < 1.0 / 400.0 ? 800.0 : 0.0));
    ca_image_layers *layers = develop(&film);
    uint32_t unmarked = 0, missed = 0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        const uint32_t y = i / SIDE;
        missed += y < SIDE / 2 && ca_layers_find(layers, "R")[i] < 2.0f;
        if (y < SIDE / 2 - CA_CONFIDENCE_REACH)
            unmarked += !is_marked(layers, i) && ca_layers_find(layers, "R")[i] < 2.0f;
        if (y >= SIDE / 2 + CA_CONFIDENCE_FAR_REACH) assert_false(is_marked(layers, i));
    }
    assert_true(missed > PIXELS / 2 * 0.8);
    if (unmarked * 20 > missed) fail_msg("%u of %u pixels that miss the fireflies are not marked", unmarked, missed);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* Where all others are black, a pixel has no one but itself to be judged by. */
static void test_lonely_pixel(void **state)
{
    (void)state;
    ca_moments moments[81] = {{0}};
    bool marked[81];
    for (int i = 0; i < 81; i++) moments[i].replicates = 64;
    for (int rare = 0; rare < 2; rare++) {
        moments[40] = (ca_moments){.mean = 1.0, .variance = 1.0, .third = rare ? 7.0 : 1.0, .replicates = 64};
        assert_int_equal(ca_confidence_mark(moments, 9, 9, marked, NULL), CA_OK);
        assert_true(marked[40] == (rare == 1));
        assert_int_equal(ca_confidence_mark(&moments[40], 1, 1, marked, NULL), CA_OK);
        assert_true(marked[0] == (rare == 1));
    }
}

/* Any moments against the rule, written once more. */
static bool should_be_marked(const ca_moments *moments, int width, int height, int x, int y)
{
    const ca_moments *own = &moments[y * width + x];
    double variance = 0.0, third = 0.0, count = 0.0;
    bool varies = false;
    for (int v = y - 2; v <= y + 2; v++)
        for (int u = x - 2; u <= x + 2; u++) {
            if (u < 0 || v < 0 || u >= width || v >= height || (u == x && v == y)) continue;
            const ca_moments *m = &moments[v * width + u];
            varies |= m->variance > 0.0;
            if (m->mean == 0.0) continue;
            variance += m->variance / pow(m->mean, 2.0);
            third += m->third / pow(fabs(m->mean), 3.0);
            count++;
        }
    double lone = 0.0, far = 0.0;
    for (int v = y - 7; v <= y + 7; v++)
        for (int u = x - 7; u <= x + 7; u++) {
            if (u < 0 || v < 0 || u >= width || v >= height) continue;
            const ca_moments *m = &moments[v * width + u];
            far++;
            if (m->mean == 0.0 || m->variance == 0.0 ||
                m->replicates * pow(m->variance, 3.0) >= 2.0 * m->third * m->third)
                continue;
            lone += m->variance * m->variance / fabs(m->third) / fabs(m->mean);
        }
    if (own->replicates < 8) return true;
    if (own->variance == 0.0) return varies;
    if (own->mean == 0.0) return false;
    if (count == 0.0) { /* nobody else can tell */
        variance = own->variance / pow(own->mean, 2.0);
        third = own->third / pow(fabs(own->mean), 3.0);
        count = 1.0;
    }
    const double half_error = 0.5 * sqrt(own->variance / own->replicates) / fabs(own->mean);
    variance /= count;
    third /= count;
    const double contributions = own->replicates * pow(variance, 3.0) / (third * third);
    return (contributions < 4.0 && variance * variance / fabs(third) > half_error) || lone / far > half_error;
}

static void test_rule(void **state)
{
    (void)state;
    enum { WIDTH = 37, HEIGHT = 23, COUNT = WIDTH * HEIGHT };
    static ca_moments moments[COUNT];
    static bool marked[COUNT];
    uint32_t marks = 0;
    for (int i = 0; i < COUNT; i++) {
        ca_moments *m = &moments[i];
        *m = (ca_moments){.mean = 0.2 + uniform(), .replicates = uniform() < 0.02 ? 7 : 64};
        m->variance = uniform() < 0.05 ? 0.0 : 0.01 + uniform();
        m->third = m->variance == 0.0 ? 0.0 : (2.0 + 7.0 * normal()) * pow(m->variance, 1.5);
        if (uniform() < 0.05) m->mean = 0.0;
        if (uniform() < 0.05) m->mean = -m->mean;
    }
    assert_int_equal(ca_confidence_mark(moments, WIDTH, HEIGHT, marked, NULL), CA_OK);
    for (int i = 0; i < COUNT; i++) {
        assert_true(marked[i] == should_be_marked(moments, WIDTH, HEIGHT, i % WIDTH, i / WIDTH));
        marks += marked[i];
    }
    assert_true(marks > COUNT / 8 && marks < COUNT * 7 / 8);
}

/* ---- Calibration of made-up distributions ---------------------------------------------------------------------- */

static double draw_normal(void) { return 3.0 + normal(); }
static double draw_uniform(void) { return uniform(); }
static double draw_exponential(void) { return -log(uniform()); }
static double draw_log_normal(void) { return exp(normal()); }
static double draw_two_values(void) { return uniform() < 0.3 ? 1.0 : 0.0; }
static double draw_mostly_one(void) { return uniform() < 0.9 ? 1.0 : 0.0; }
static double draw_few_contributions(void) { return uniform() < 9.0 / 512.0 ? 2.0 : 0.0; } /* 9 a pixel */
static double draw_fireflies(void) { return 1.0 + 0.3 * normal() + (uniform() < 0.1 ? 30.0 : 0.0); }

static const struct distribution {
    const char *name;
    double (*draw)(void);
    double expectation;
    uint32_t samples;
    double most_marked;
} distributions[] = {
    {"normal", draw_normal, 3.0, 64, 0.0},
    {"normal, eight", draw_normal, 3.0, 8, 0.02},
    {"uniform", draw_uniform, 0.5, 64, 0.0},
    {"exponential", draw_exponential, 1.0, 64, 0.02},
    {"exponential, sixteen", draw_exponential, 1.0, 16, 0.6},
    {"log-normal", draw_log_normal, 1.6487212707001282, 256, 0.2},
    {"two values", draw_two_values, 0.3, 64, 0.0},
    {"mostly one", draw_mostly_one, 0.9, 256, 0.02},
    {"nine contributions", draw_few_contributions, 18.0 / 512.0, 512, 0.5},
    {"frequent fireflies", draw_fireflies, 4.0, 256, 0.02},
};

/* Fraction of pixels without a mark whose interval holds the expectation. */
static double calibrate(const struct distribution *d, uint32_t group, double *marked)
{
    ca_film film = film_of(SIDE, SIDE);
    assert_int_equal(ca_film_set_replicates(&film, group, NULL), CA_OK);
    for (uint32_t i = 0; i < PIXELS; i++)
        for (uint32_t k = 0; k < d->samples * group; k++) add(&film, i, d->draw());
    ca_image_layers *layers = develop(&film);
    uint32_t good = 0, held = 0;
    const float *low = ca_layers_find(layers, "ConfidenceLow.Y"), *high = ca_layers_find(layers, "ConfidenceHigh.Y");
    for (uint32_t i = 0; i < PIXELS; i++) {
        if (is_marked(layers, i)) continue;
        good++;
        held += (double)low[i] <= d->expectation && d->expectation <= (double)high[i];
    }
    assert_true(ca_film_confidence_marked(layers, marked));
    assert_true(fabs(*marked - 1.0 + (double)good / PIXELS) < 1e-9);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
    return (double)held / good;
}

static void test_calibration(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof distributions / sizeof distributions[0]; i++) {
        double marked;
        const double held = calibrate(&distributions[i], 1, &marked);
        printf("    %-22s %.2f %% held, %.1f %% marked\n", distributions[i].name, 100.0 * held, 100.0 * marked);
        /* The fraction itself scatters by 0.34 %. */
        if (!(held > 0.93 && held < 0.97)) fail_msg("%s: %.4f", distributions[i].name, held);
        if (marked > distributions[i].most_marked) fail_msg("%s: %.4f marked", distributions[i].name, marked);
    }
}

/* Means of four: sixteen replicates of an exponential are less skewed then. */
static void test_calibration_of_groups(void **state)
{
    (void)state;
    const struct distribution d = {"exponential in fours", draw_exponential, 1.0, 16, 0.1};
    double marked;
    const double held = calibrate(&d, 4, &marked);
    assert_true(held > 0.93 && held < 0.97);
    assert_true(marked < d.most_marked);
}

/* Groups are what single samples of their means would be; samples that are left over do not count. */
static void test_groups(void **state)
{
    (void)state;
    ca_film grouped = film_of(8, 8), single = film_of(8, 8);
    assert_int_equal(ca_film_set_replicates(&grouped, 4, NULL), CA_OK);
    for (uint32_t i = 0; i < 64; i++)
        for (int k = 0; k < 12; k++) {
            double values[4];
            for (int j = 0; j < 4; j++) values[j] = floor(1024.0 * uniform()) / 256.0;
            for (int j = 0; j < 4; j++) add(&grouped, i, values[j]);
            add(&single, i, 0.25 * (values[0] + values[1] + values[2] + values[3]));
        }
    for (uint32_t i = 0; i < 64; i++)
        for (int k = 0; k < 3; k++) add(&grouped, i, 1000.0);
    ca_image_layers *a = develop(&grouped), *b = develop(&single);
    int compared = 0;
    for (size_t c = 0; c < b->channel_count; c++) {
        const char *name = b->channels[c].name;
        if (strncmp(name, "Confidence", 10) != 0) continue;
        compared++;
        for (uint32_t i = 0; i < 64; i++)
            expect_near((double)ca_layers_find(a, name)[i], (double)b->channels[c].data[i], 1e-6);
    }
    assert_int_equal(compared, 8); /* low and high of R, G, B, Y */
    ca_layers_destroy(a);
    ca_layers_destroy(b);
    ca_film_destroy(&grouped);
    ca_film_destroy(&single);
}

/* A film whose samples are not independent has no such layers. */
static void test_no_replicates(void **state)
{
    (void)state;
    ca_film film = film_of(8, 8);
    assert_int_equal(ca_film_set_replicates(&film, 0, NULL), CA_OK);
    for (uint32_t i = 0; i < 64; i++)
        for (int k = 0; k < 20; k++) add(&film, i, uniform());
    ca_image_layers *layers = develop(&film);
    double marked;
    assert_null(ca_layers_find(layers, "ConfidenceLow.Y"));
    assert_false(ca_film_confidence_marked(layers, &marked));
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

static void test_memory(void **state)
{
    (void)state;
    ca_film film = film_of(8, 8);
    ca_error error = {""};
    ca_memory_fail_after(0);
    assert_int_equal(ca_film_set_replicates(&film, 2, &error), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
    assert_non_null(strstr(error.message, "film"));
    ca_film_destroy(&film);
}

int main(void)
{
    random_source = ca_test_random_seed(11);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quantiles_of_tables),
        cmocka_unit_test(test_quantiles_in_closed_form),
        cmocka_unit_test(test_moments),
        cmocka_unit_test(test_moments_without_bias),
        cmocka_unit_test(test_moments_of_rounding),
        cmocka_unit_test(test_symmetric_interval_is_students),
        cmocka_unit_test(test_interval_inverts_the_transformation),
        cmocka_unit_test(test_long_tail_is_poissons),
        cmocka_unit_test(test_interval_without_scatter),
        cmocka_unit_test(test_limits_are_rounded_outwards),
        cmocka_unit_test(test_too_few_replicates),
        cmocka_unit_test(test_constant_pixels),
        cmocka_unit_test(test_fireflies_that_most_pixels_miss),
        cmocka_unit_test(test_lonely_pixel),
        cmocka_unit_test(test_rule),
        cmocka_unit_test(test_calibration),
        cmocka_unit_test(test_calibration_of_groups),
        cmocka_unit_test(test_groups),
        cmocka_unit_test(test_no_replicates),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
