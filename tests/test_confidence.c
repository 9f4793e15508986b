/* Error bars from samples: moments against computations in two passes, the rules for widened and marked intervals;
 * and their calibration: how many intervals of made-up distributions hold the expectation. One pixel's interval:
 * test_confidence_interval.c. Many pictures: test_confidence_widened.c. Renders: test_error_bars.c. */
#include "film/film.h"
#include "film/interval_layers.h"
#include "image/layers.h"
#include "support/expect_near.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static ca_test_random random_source;

static double uniform(void) { return ca_test_random_open(&random_source); }
static double normal(void) { return sqrt(-2.0 * log(uniform())) * cos(6.283185307179586 * uniform()); }

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

/* ---- Verdicts -------------------------------------------------------------------------------------------------- */

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
    assert_int_equal(ca_film_develop(film, 2, &layers, NULL), CA_OK);
    return layers;
}

static ca_interval_kind kind_of(const ca_image_layers *layers, uint32_t pixel)
{
    const float low = ca_layers_find(layers, "ConfidenceLow.Y")[pixel],
                high = ca_layers_find(layers, "ConfidenceHigh.Y")[pixel],
                widened = ca_layers_find(layers, "ConfidenceWidened.Y")[pixel];
    assert_true((low == -HUGE_VALF) == (high == HUGE_VALF) && low <= high);
    assert_true(widened == 0.0f || (widened == 1.0f && low > -HUGE_VALF));
    if (low == -HUGE_VALF) return CA_INTERVAL_MARKED;
    return widened == 1.0f ? CA_INTERVAL_WIDENED : CA_INTERVAL_ORDINARY;
}

static bool is_ordinary(const ca_image_layers *layers, uint32_t pixel)
{
    return kind_of(layers, pixel) == CA_INTERVAL_ORDINARY;
}

/* Under eight replicates all is marked; with eight of a symmetric distribution hardly anything is not ordinary. */
static void test_too_few_replicates(void **state)
{
    (void)state;
    for (int samples = 0; samples <= CA_CONFIDENCE_MIN_REPLICATES; samples++) {
        ca_film film = film_of(SIDE, SIDE);
        for (uint32_t i = 0; i < PIXELS; i++)
            for (int k = 0; k < samples; k++) add(&film, i, 5.0 + normal());
        ca_image_layers *layers = develop(&film);
        double marked, widened;
        assert_true(ca_interval_layers_shares(layers, &marked, &widened));
        if (samples < CA_CONFIDENCE_MIN_REPLICATES) assert_true(marked == 1.0 && widened == 0.0);
        else assert_true(marked + widened < 0.02);
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
        const bool beside = x < SIDE / 2 && x + CA_CONFIDENCE_REACH >= SIDE / 2;
        assert_int_equal(kind_of(layers, i), beside ? CA_INTERVAL_WIDENED : CA_INTERVAL_ORDINARY);
        if (x + CA_CONFIDENCE_REACH >= SIDE / 2) continue;
        assert_true((double)ca_layers_find(layers, "ConfidenceLow.G")[i] <= (double)0.7f);
        assert_true((double)ca_layers_find(layers, "ConfidenceHigh.G")[i] >= (double)0.7f);
        assert_true((double)ca_layers_find(layers, "ConfidenceHigh.G")[i] < 0.700001);
    }
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* One sample in four hundred holds two thirds of the light, the rest is quiet: most pixels never saw it in their 64,
 * and look as if all were well. Their neighbours tell. Beyond the fireflies' region and the reach all is ordinary. */
static void test_fireflies_that_most_pixels_miss(void **state)
{
    (void)state;
    ca_film film = film_of(SIDE, SIDE);
    for (uint32_t i = 0; i < PIXELS; i++)
        for (int k = 0; k < 64; k++)
            add(&film, i, 1.0 + 0.1 * normal() + (i / SIDE < SIDE / 2 && uniform() < 1.0 / 400.0 ? 800.0 : 0.0));
    ca_image_layers *layers = develop(&film);
    uint32_t ordinary = 0, missed = 0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        const uint32_t y = i / SIDE;
        missed += y < SIDE / 2 && ca_layers_find(layers, "R")[i] < 2.0f;
        if (y < SIDE / 2 - CA_CONFIDENCE_REACH)
            ordinary += is_ordinary(layers, i) && ca_layers_find(layers, "R")[i] < 2.0f;
        if (y >= SIDE / 2 + CA_CONFIDENCE_FAR_REACH) assert_true(is_ordinary(layers, i));
    }
    assert_true(missed > PIXELS / 2 * 0.8);
    if (ordinary * 20 > missed) fail_msg("%u of %u pixels that miss the fireflies are ordinary", ordinary, missed);
    ca_layers_destroy(layers);
    ca_film_destroy(&film);
}

/* Where all others are black, a pixel has no one but itself to be judged by, and nobody to say how wide is enough. */
static void test_lonely_pixel(void **state)
{
    (void)state;
    ca_moments moments[81] = {{0}};
    ca_verdict verdicts[81];
    for (int i = 0; i < 81; i++) moments[i].replicates = 64;
    for (int rare = 0; rare < 2; rare++) {
        const ca_interval_kind expected = rare ? CA_INTERVAL_MARKED : CA_INTERVAL_ORDINARY;
        moments[40] = (ca_moments){.mean = 1.0, .variance = 1.0, .third = rare ? 7.0 : 1.0, .replicates = 64};
        assert_int_equal(ca_confidence_judge(moments, 9, 9, 1, verdicts, NULL), CA_OK);
        assert_int_equal(verdicts[40].kind, expected);
        assert_int_equal(verdicts[30].kind, CA_INTERVAL_WIDENED);
        expect_near(verdicts[30].variance[CA_ABOVE], 1.0 / 24.0, 1e-12);
        assert_int_equal(ca_confidence_judge(&moments[40], 1, 1, 2, verdicts, NULL), CA_OK);
        assert_int_equal(verdicts[0].kind, expected);
    }
}

/* Sums over pixels around one, for the rule written once more. */
typedef struct neighbourhood {
    double variance, third, error, count;       /* relative; of those that are not black */
    double varying, uncertain, all, scatter[2]; /* of all */
    double lone[2], squares[2], far;
} neighbourhood;

static void add_neighbour(neighbourhood *sum, const ca_moments *m)
{
    sum->all++;
    sum->varying += m->variance > 0.0;
    sum->uncertain += m->uncertain;
    if (m->third >= 0.0) sum->scatter[CA_ABOVE] += m->variance;
    if (m->third <= 0.0) sum->scatter[CA_BELOW] += m->variance;
    if (m->mean == 0.0) return;
    sum->variance += m->variance / pow(m->mean, 2.0);
    sum->third += m->third / pow(fabs(m->mean), 3.0);
    sum->error += sqrt(m->variance / m->replicates) / fabs(m->mean);
    sum->count++;
}

static void add_lone(neighbourhood *sum, const ca_moments *m)
{
    sum->far++;
    if (m->variance == 0.0 || m->replicates * pow(m->variance, 3.0) >= 2.0 * m->third * m->third) return;
    const double part = m->variance * m->variance / fabs(m->third);
    sum->lone[m->third > 0.0 ? CA_ABOVE : CA_BELOW] += part;
    sum->squares[m->third > 0.0 ? CA_ABOVE : CA_BELOW] += part * part;
}

static neighbourhood neighbourhood_of(const ca_moments *moments, int width, int height, int x, int y)
{
    neighbourhood sum = {0};
    for (int v = y - 7; v <= y + 7; v++)
        for (int u = x - 7; u <= x + 7; u++) {
            if (u < 0 || v < 0 || u >= width || v >= height) continue;
            const ca_moments *m = &moments[v * width + u];
            if (abs(u - x) <= 2 && abs(v - y) <= 2 && (u != x || v != y)) add_neighbour(&sum, m);
            add_lone(&sum, m);
        }
    return sum;
}

static bool should_be_ordinary(const ca_moments *own, neighbourhood near)
{
    if (own->replicates < 8 || own->uncertain || near.uncertain > near.all / 12.0) return false;
    if (own->variance == 0.0) return near.varying == 0.0;
    if (own->mean == 0.0) return true;
    if (near.count == 0.0) add_neighbour(&near, own); /* nobody else can tell */
    const double error = sqrt(own->variance / own->replicates) / fabs(own->mean);
    const double half = 0.5 * (near.varying > 0.0 ? fmin(error, near.error / near.varying) : error);
    const double variance = near.variance / near.count, third = near.third / near.count;
    const double contributions = own->replicates * pow(variance, 3.0) / (third * third);
    if ((near.lone[CA_BELOW] + near.lone[CA_ABOVE]) / near.far / fabs(own->mean) > half) return false;
    return contributions >= 4.0 || variance * variance / fabs(third) <= half;
}

static void expect_verdict(const ca_verdict *verdict, const ca_moments *own, const neighbourhood *near)
{
    if (should_be_ordinary(own, *near)) {
        assert_int_equal(verdict->kind, CA_INTERVAL_ORDINARY);
        return;
    }
    const bool marked = own->replicates < 8 || (near->count == 0.0 && own->mean != 0.0) ||
                        (own->uncertain && near->varying <= near->all / 2.0);
    assert_int_equal(verdict->kind, marked ? CA_INTERVAL_MARKED : CA_INTERVAL_WIDENED);
    for (int side = 0; side < 2 && !marked; side++) {
        expect_near(verdict->variance[side], near->scatter[side] / near->all, 1e-12);
        const double limit = ca_confidence_lone_limit(near->lone[side], near->squares[side]);
        expect_near(verdict->lone[side], limit / near->far, 1e-12);
    }
}

/* Where hardly any variance is certain, and where none is. */
static void test_uncertain_pixels(void **state)
{
    (void)state;
    ca_moments moments[49];
    ca_verdict verdicts[49];
    for (int varying = 0; varying < 2; varying++) {
        for (int i = 0; i < 49; i++)
            moments[i] = (ca_moments){.mean = 1.0, .variance = varying, .replicates = 8, .uncertain = true};
        assert_int_equal(ca_confidence_judge(moments, 7, 7, 2, verdicts, NULL), CA_OK);
        for (int i = 0; i < 49; i++)
            assert_int_equal(verdicts[i].kind, varying ? CA_INTERVAL_WIDENED : CA_INTERVAL_MARKED);
    }
    /* A picture of one black pixel has no neighbourhood. */
    moments[0].mean = moments[0].variance = 0.0;
    assert_int_equal(ca_confidence_judge(moments, 1, 1, 2, verdicts, NULL), CA_OK);
    assert_int_equal(verdicts[0].kind, CA_INTERVAL_MARKED);
}

static void test_rule(void **state)
{
    (void)state;
    enum { WIDTH = 131, HEIGHT = 300, COUNT = WIDTH * HEIGHT }; /* of several tiles */
    static ca_moments moments[COUNT];
    static ca_verdict verdicts[COUNT];
    uint32_t kinds[3] = {0};
    for (int i = 0; i < COUNT; i++) {
        ca_moments *m = &moments[i];
        *m = (ca_moments){.mean = 0.2 + uniform(), .replicates = uniform() < 0.02 ? 7 : 64};
        m->variance = uniform() < 0.05 ? 0.0 : 0.01 + uniform();
        m->third = m->variance == 0.0 ? 0.0 : (2.0 + 7.0 * normal()) * pow(m->variance, 1.5);
        if (uniform() < 0.05) m->mean = 0.0;
        if (uniform() < 0.05) m->mean = -m->mean;
        m->uncertain = uniform() < 0.03;
    }
    assert_int_equal(ca_confidence_judge(moments, WIDTH, HEIGHT, 2, verdicts, NULL), CA_OK);
    for (int i = 0; i < COUNT; i++) {
        const neighbourhood near = neighbourhood_of(moments, WIDTH, HEIGHT, i % WIDTH, i / WIDTH);
        expect_verdict(&verdicts[i], &moments[i], &near);
        kinds[verdicts[i].kind]++;
    }
    assert_true(kinds[CA_INTERVAL_ORDINARY] > COUNT / 8 && kinds[CA_INTERVAL_WIDENED] > COUNT / 8);
    assert_true(kinds[CA_INTERVAL_MARKED] > 0);
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
    double most_widened;
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

typedef struct calibration {
    double counts[3], held[3]; /* by kind: pixels, and of these the fraction whose interval holds the expectation */
} calibration;

static calibration calibrate_film(const ca_film *film, const double expectations[PIXELS])
{
    calibration c = {0};
    double marked, widened;
    ca_image_layers *layers = develop(film);
    const float *low = ca_layers_find(layers, "ConfidenceLow.Y"), *high = ca_layers_find(layers, "ConfidenceHigh.Y");
    for (uint32_t i = 0; i < PIXELS; i++) {
        const ca_interval_kind kind = kind_of(layers, i);
        c.counts[kind]++;
        c.held[kind] += (double)low[i] <= expectations[i] && expectations[i] <= (double)high[i];
    }
    for (int kind = 0; kind < 3; kind++) c.held[kind] /= c.counts[kind];
    assert_true(ca_interval_layers_shares(layers, &marked, &widened));
    assert_true(fabs(marked - c.counts[CA_INTERVAL_MARKED] / PIXELS) < 1e-9);
    assert_true(fabs(widened - c.counts[CA_INTERVAL_WIDENED] / PIXELS) < 1e-9);
    ca_layers_destroy(layers);
    return c;
}

static calibration calibrate(const struct distribution *d, uint32_t group)
{
    static double expectations[PIXELS];
    ca_film film = film_of(SIDE, SIDE);
    assert_int_equal(ca_film_set_replicates(&film, group, NULL), CA_OK);
    for (uint32_t i = 0; i < PIXELS; i++) {
        expectations[i] = d->expectation;
        for (uint32_t k = 0; k < d->samples * group; k++) add(&film, i, d->draw());
    }
    const calibration c = calibrate_film(&film, expectations);
    ca_film_destroy(&film);
    return c;
}

static void test_calibration(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof distributions / sizeof distributions[0]; i++) {
        const calibration c = calibrate(&distributions[i], 1);
        const double held = c.held[CA_INTERVAL_ORDINARY], widened = c.counts[CA_INTERVAL_WIDENED] / PIXELS;
        printf("    %-22s %.2f %% held, %.1f %% widened\n", distributions[i].name, 100.0 * held, 100.0 * widened);
        /* The fraction itself scatters by 0.34 %. */
        if (!(held > 0.93 && held < 0.97)) fail_msg("%s: %.4f", distributions[i].name, held);
        if (widened > distributions[i].most_widened) fail_msg("%s: %.4f widened", distributions[i].name, widened);
        assert_true(c.counts[CA_INTERVAL_MARKED] == 0.0);
    }
}

/* Means of four: sixteen replicates of an exponential are less skewed then. */
static void test_calibration_of_groups(void **state)
{
    (void)state;
    const struct distribution d = {"exponential in fours", draw_exponential, 1.0, 16, 0.1};
    const calibration c = calibrate(&d, 4);
    assert_true(c.held[CA_INTERVAL_ORDINARY] > 0.93 && c.held[CA_INTERVAL_ORDINARY] < 0.97);
    assert_true(c.counts[CA_INTERVAL_WIDENED] < d.most_widened * PIXELS);
}

/* Quiet light of two levels, in squares, and rare contributions, which bring a multiple of it: of one size or of
 * exponentially distributed sizes, from one in 80 pixels to three a pixel. Hardly any interval is ordinary, all are
 * finite, and wide enough, whether a pixel got some or not. */
static const struct rare_light {
    double number, share; /* of contributions to a pixel; of their light, relative to the quiet one */
    bool equal;
    double scale; /* negative: they are dark */
} rare_lights[] = {
    {0.012, 0.3, true, 1.0}, {0.05, 1.0, true, 1.0},   {0.05, 1.0, false, 1.0}, {0.3, 0.5, true, 1.0},
    {0.3, 3.0, false, 1.0},  {1.0, 0.3, true, 1.0},    {1.0, 10.0, true, 1.0},  {3.0, 1.0, true, 1.0},
    {3.0, 3.0, false, 1.0},  {0.3, 0.5, true, -1.0},
};

static void test_calibration_of_widened(void **state)
{
    (void)state;
    enum { SAMPLES = 64 };
    static double expectations[PIXELS];
    for (size_t l = 0; l < sizeof rare_lights / sizeof rare_lights[0]; l++) {
        const struct rare_light *light = &rare_lights[l];
        ca_film film = film_of(SIDE, SIDE);
        for (uint32_t i = 0; i < PIXELS; i++) {
            const double level = (i % SIDE / 8 + i / SIDE / 8) % 2 ? 3.0 : 1.0, p = light->number / SAMPLES;
            expectations[i] = level * (1.0 + light->scale * light->share);
            for (int k = 0; k < SAMPLES; k++) {
                const double size = light->equal ? 1.0 : draw_exponential();
                const double rare = uniform() < p ? light->scale * light->share / p * size : 0.0;
                add(&film, i, level * (1.0 + 0.1 * normal() + rare));
            }
        }
        const calibration c = calibrate_film(&film, expectations);
        const double widened = c.counts[CA_INTERVAL_WIDENED] / PIXELS, held = c.held[CA_INTERVAL_WIDENED];
        printf("    %5.3f %s bring %4.1f: %.2f %% held, %.1f %% widened\n", light->number,
               light->equal ? "equal ones  " : "of any sizes", light->scale * light->share, 100.0 * held,
               100.0 * widened);
        if (!(held > 0.93)) fail_msg("%g contributions: %.4f held", light->number, held);
        if (!(widened > 0.5)) fail_msg("%g contributions: %.4f widened", light->number, widened);
        assert_true(c.counts[CA_INTERVAL_MARKED] == 0.0);
        ca_film_destroy(&film);
    }
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
    assert_int_equal(compared, 12); /* low, high and which are widened, of R, G, B, Y */
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
    double marked, widened;
    assert_null(ca_layers_find(layers, "ConfidenceLow.Y"));
    assert_null(ca_layers_find(layers, "ConfidenceWidened.Y"));
    assert_false(ca_interval_layers_shares(layers, &marked, &widened));
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
        cmocka_unit_test(test_moments),
        cmocka_unit_test(test_moments_without_bias),
        cmocka_unit_test(test_moments_of_rounding),
        cmocka_unit_test(test_too_few_replicates),
        cmocka_unit_test(test_constant_pixels),
        cmocka_unit_test(test_fireflies_that_most_pixels_miss),
        cmocka_unit_test(test_lonely_pixel),
        cmocka_unit_test(test_uncertain_pixels),
        cmocka_unit_test(test_rule),
        cmocka_unit_test(test_calibration),
        cmocka_unit_test(test_calibration_of_groups),
        cmocka_unit_test(test_calibration_of_widened),
        cmocka_unit_test(test_groups),
        cmocka_unit_test(test_no_replicates),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
