/* The film of blocks: means against plain sums in double precision, the same bits for any order and any split, the
 * gate, what its fixed point resolves, windows of a crop, bytes, failures of memory. */
#include "base/memory.h"
#include "film/block_film.h"
#include "film/confidence.h"
#include "support/named_layer.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum {
    FULL_WIDTH = 11,
    FULL_HEIGHT = 9,
    X0 = 2,
    Y0 = 3,
    WIDTH = 6,
    HEIGHT = 4,
    PIXELS = WIDTH * HEIGHT,
    BLOCKS = 60
};
static const float extent = 700.0f;
static ca_test_random random_source;

static float between(float low, float high) { return low + (high - low) * ca_test_random_float(&random_source); }

static ca_block_film_desc desc_with(bool extras, float largest)
{
    return (ca_block_film_desc){.full_width = FULL_WIDTH,
                                .full_height = FULL_HEIGHT,
                                .crop = {X0, Y0, X0 + WIDTH, Y0 + HEIGHT},
                                .gradients = extras,
                                .error_bars = extras,
                                .extent = largest};
}

/* With gradients and error bars, or without. */
static ca_block_film *create(bool extras)
{
    const ca_block_film_desc desc = desc_with(extras, extent);
    ca_block_film *film;
    assert_int_equal(ca_block_film_create(&film, &desc, NULL), CA_OK);
    return film;
}

static ca_image_layers *develop(const ca_block_film *film)
{
    ca_image_layers *layers;
    assert_int_equal(ca_block_film_develop(film, 2, &layers, NULL), CA_OK);
    return layers;
}

static uint64_t developed_hash(const ca_block_film *film)
{
    ca_image_layers *layers = develop(film);
    const uint64_t hash = image_hash(layers);
    ca_layers_destroy(layers);
    return hash;
}

static ca_vec3 random_vector(float size, float paths)
{
    return (ca_vec3){paths * between(-size, size), paths * between(-size, size), paths * between(-size, size)};
}

/* A block's sums for a pixel; of very different sizes, so that sums of floats would depend on the order. */
static ca_block_sample random_sample(void)
{
    const float scale = ldexpf(1.0f, (int)(ca_test_random_u32(&random_source) % 60) - 30);
    ca_block_sample s = {.radiance = {scale * between(-0.1f, 1), scale * between(0, 2), between(3, 4)},
                         .pairs = ca_test_random_u32(&random_source) % 1000,
                         .paths = ca_test_random_u32(&random_source) % 4};
    const float paths = (float)s.paths;
    s.irradiance_gradient = random_vector(scale, 1.0f);
    s.albedo = (ca_rgb){paths * between(0, 1), paths * between(0, 1), paths * between(0, 1)};
    s.normal = random_vector(1.0f, paths);
    s.position = random_vector(extent, paths);
    s.covariance =
        (ca_pair_covariance){(double)(scale * between(0, 1)), (double)between(-0.1f, 1), (double)scale, 2.0};
    return s;
}

typedef struct block_sums {
    ca_block_sample samples[BLOCKS][PIXELS];
} block_sums;

static void fill(block_sums *sums)
{
    for (int b = 0; b < BLOCKS; b++)
        for (int p = 0; p < PIXELS; p++) {
            sums->samples[b][p] = random_sample();
            sums->samples[b][p].visits_camera =
                (uint64_t)(b / 7); /* as in columns of 7: the first block is the first */
            sums->samples[b][p].visits_light = (uint64_t)(b % 7);
        }
}

static void add_block(ca_block_film *film, const block_sums *sums, int block)
{
    for (uint32_t p = 0; p < PIXELS; p++)
        assert_true(ca_block_film_add(film, X0 + p % WIDTH, Y0 + p / WIDTH, &sums->samples[block][p]));
}

/* ---- Values ---------------------------------------------------------------------------------------------------- */

/* Of what a sample holds, in the order of the layers; NULL ends. */
static const struct term {
    const char *layer;
    size_t offset;
    bool over_pairs;
    double unit; /* of its fixed point */
} terms[] = {
    {"R", offsetof(ca_block_sample, radiance.r), true, 0.0},
    {"G", offsetof(ca_block_sample, radiance.g), true, 0.0},
    {"B", offsetof(ca_block_sample, radiance.b), true, 0.0},
    {"IrradianceGradient.X", offsetof(ca_block_sample, irradiance_gradient.x), true, 0.0},
    {"IrradianceGradient.Y", offsetof(ca_block_sample, irradiance_gradient.y), true, 0.0},
    {"IrradianceGradient.Z", offsetof(ca_block_sample, irradiance_gradient.z), true, 0.0},
    {"Albedo.R", offsetof(ca_block_sample, albedo.r), false, 0x1p-28},
    {"Albedo.G", offsetof(ca_block_sample, albedo.g), false, 0x1p-28},
    {"Albedo.B", offsetof(ca_block_sample, albedo.b), false, 0x1p-28},
    {"N.X", offsetof(ca_block_sample, normal.x), false, 0x1p-28},
    {"N.Y", offsetof(ca_block_sample, normal.y), false, 0x1p-28},
    {"N.Z", offsetof(ca_block_sample, normal.z), false, 0x1p-28},
    {"P.X", offsetof(ca_block_sample, position.x), false, 1024.0 * 0x1p-28},
    {"P.Y", offsetof(ca_block_sample, position.y), false, 1024.0 * 0x1p-28},
    {"P.Z", offsetof(ca_block_sample, position.z), false, 1024.0 * 0x1p-28},
};

static void expect_term(const ca_image_layers *layers, const block_sums *sums, const struct term *term, uint32_t p)
{
    double sum = 0.0, magnitude = 0.0, count = 0.0;
    for (int b = 0; b < BLOCKS; b++) {
        const ca_block_sample *s = &sums->samples[b][p];
        const double value = (double)*(const float *)((const char *)s + term->offset);
        sum += value;
        magnitude += fabs(value);
        count += term->over_pairs ? (double)s->pairs : (double)s->paths;
    }
    const double tolerance = (1e-14 * magnitude + 0.5 * BLOCKS * term->unit) / count + 1e-7 * fabs(sum / count);
    const double got = (double)layer_at(layers, term->layer, p);
    if (!(fabs(got - sum / count) <= tolerance))
        fail_msg("%s of pixel %u is %.9g, not %.9g", term->layer, p, got, sum / count);
}

static void test_values_are_means(void **state)
{
    (void)state;
    static block_sums sums;
    random_source = ca_test_random_seed(1);
    fill(&sums);
    ca_block_film *film = create(true);
    for (int b = 0; b < BLOCKS; b++) add_block(film, &sums, b);
    ca_image_layers *layers = develop(film);
    double luminance = 0.0;
    for (uint32_t p = 0; p < PIXELS; p++) {
        double pairs = 0.0, paths = 0.0;
        for (size_t t = 0; t < sizeof terms / sizeof terms[0]; t++) expect_term(layers, &sums, &terms[t], p);
        for (int b = 0; b < BLOCKS; b++) pairs += (double)sums.samples[b][p].pairs;
        for (int b = 0; b < BLOCKS; b++) paths += (double)sums.samples[b][p].paths;
        assert_true((double)layer_at(layers, "Pairs.Y", p) == pairs);
        assert_true((double)layer_at(layers, "Samples.Y", p) == paths);
        luminance += 0.2126 * (double)layer_at(layers, "R", p) + 0.7152 * (double)layer_at(layers, "G", p) +
                     0.0722 * (double)layer_at(layers, "B", p);
    }
    assert_true(fabs(ca_block_film_mean_luminance(film) / (luminance / PIXELS) - 1.0) < 1e-6);
    assert_int_equal(layers->channel_count, 21);
    assert_null(ca_layers_find(layers, "Variance.R"));
    assert_true(layers->width == WIDTH && layers->height == HEIGHT && layers->x0 == X0 && layers->y0 == Y0);
    assert_true(layers->full_width == FULL_WIDTH && layers->full_height == FULL_HEIGHT);
    ca_layers_destroy(layers);
    ca_block_film_destroy(film);
}

/* A film that has seen nothing, and one without gradients. */
static void test_empty_and_without_gradients(void **state)
{
    (void)state;
    ca_block_film *film = create(false);
    ca_image_layers *layers = develop(film);
    assert_int_equal(layers->channel_count, 14);
    assert_null(ca_layers_find(layers, "IrradianceGradient.X"));
    assert_null(ca_layers_find(layers, "ConfidenceLow.Y"));
    for (size_t c = 0; c < layers->channel_count; c++)
        for (uint32_t p = 0; p < PIXELS; p++) assert_true(layers->channels[c].data[p] == 0.0f);
    ca_layers_destroy(layers);
    const ca_block_sample sample = {
        .pairs = 1, .paths = 1, .irradiance_gradient = {NAN, 0, 0}}; /* nobody looks at it */
    assert_true(ca_block_film_add(film, X0, Y0, &sample));
    const ca_block_film_desc with = desc_with(true, extent), without = desc_with(false, extent);
    assert_true(ca_block_film_bytes(&with) == 528.0 * PIXELS && ca_block_film_bytes(&without) == 208.0 * PIXELS);
    ca_block_film_destroy(film);
}

/* ---- Order ----------------------------------------------------------------------------------------------------- */

static void shuffle(int order[BLOCKS])
{
    for (int i = BLOCKS; i-- > 1;) {
        const uint32_t j = ca_test_random_u32(&random_source) % (uint32_t)(i + 1);
        const int swapped = order[i];
        order[i] = order[j];
        order[j] = swapped;
    }
}

static void test_order_and_films_do_not_matter(void **state)
{
    (void)state;
    static block_sums sums;
    random_source = ca_test_random_seed(2);
    fill(&sums);
    ca_block_film *first = create(true);
    int order[BLOCKS];
    for (int b = 0; b < BLOCKS; b++) {
        add_block(first, &sums, b);
        order[b] = b;
    }
    const uint64_t expected = developed_hash(first);
    for (int round = 0; round < 20; round++) {
        ca_block_film *films[3] = {create(true), create(true), create(true)};
        shuffle(order);
        for (int b = 0; b < BLOCKS; b++) add_block(films[ca_test_random_u32(&random_source) % 3], &sums, order[b]);
        ca_block_film_add_film(films[1], films[round % 2 ? 0 : 2]);
        ca_block_film_add_film(films[1], films[round % 2 ? 2 : 0]);
        assert_true(developed_hash(films[1]) == expected);
        for (int f = 0; f < 3; f++) ca_block_film_destroy(films[f]);
    }
    ca_block_film_destroy(first);
}

static void test_bytes_bring_everything_back(void **state)
{
    (void)state;
    static block_sums sums;
    random_source = ca_test_random_seed(3);
    fill(&sums);
    for (int extras = 0; extras < 2; extras++) {
        ca_block_film *film = create(extras), *copy = create(extras);
        const ca_block_film_desc *desc = ca_block_film_described(film);
        for (int b = 0; b < BLOCKS; b++) add_block(film, &sums, b);
        add_block(copy, &sums, 7); /* what was there before is replaced */
        const size_t row_bytes = ca_block_film_row_bytes(desc);
        assert_int_equal(row_bytes, WIDTH * (extras ? 528 : 208));
        unsigned char row[WIDTH * 528];
        for (uint32_t y = 0; y < HEIGHT; y++) {
            ca_block_film_write_row(film, y, row);
            ca_block_film_read_row(copy, y, row);
        }
        assert_true(developed_hash(copy) == developed_hash(film));
        /* Not only to the eye: what is added later adds up in the same way. */
        add_block(film, &sums, 1);
        add_block(copy, &sums, 1);
        assert_true(developed_hash(copy) == developed_hash(film));
        ca_block_film_destroy(film);
        ca_block_film_destroy(copy);
    }
}

/* ---- The gate and the fixed point ------------------------------------------------------------------------------ */

static void test_gate(void **state)
{
    (void)state;
    const ca_block_sample good = {
        .radiance = {1, -2, 3}, .pairs = 4, .paths = 2, .albedo = {1, 1, 1}, .position = {1, 2, 3}};
    static const size_t fields[] = {offsetof(ca_block_sample, radiance.r),
                                    offsetof(ca_block_sample, radiance.g),
                                    offsetof(ca_block_sample, radiance.b),
                                    offsetof(ca_block_sample, irradiance_gradient.x),
                                    offsetof(ca_block_sample, irradiance_gradient.y),
                                    offsetof(ca_block_sample, irradiance_gradient.z),
                                    offsetof(ca_block_sample, albedo.r),
                                    offsetof(ca_block_sample, albedo.b),
                                    offsetof(ca_block_sample, normal.y),
                                    offsetof(ca_block_sample, position.x),
                                    offsetof(ca_block_sample, position.z)};
    static const float bad_values[] = {NAN, INFINITY, -INFINITY};
    ca_block_film *film = create(true);
    assert_true(ca_block_film_add(film, X0, Y0, &good));
    uint32_t bad = 0;
    for (size_t f = 0; f < sizeof fields / sizeof fields[0]; f++)
        for (int v = 0; v < 3; v++, bad++) {
            ca_block_sample sample = good;
            memcpy((char *)&sample + fields[f], &bad_values[v], sizeof(float));
            assert_false(ca_block_film_add(film, X0, Y0, &sample));
        }
    ca_image_layers *layers = develop(film);
    assert_true(layer_at(layers, "Pairs.Y", 0) == 4.0f * (float)(bad + 1));
    assert_true(layer_at(layers, "Samples.Y", 0) == 2.0f * (float)(bad + 1));
    assert_true(layer_at(layers, "R", 0) == 1.0f / (4.0f * (float)(bad + 1)));
    assert_true(layer_at(layers, "G", 0) == -2.0f / (4.0f * (float)(bad + 1)));
    assert_true(layer_at(layers, "Albedo.G", 0) == 1.0f / (2.0f * (float)(bad + 1)));
    ca_layers_destroy(layers);

    /* Sixteen times their bound a path is the end of albedos, normals and positions. */
    ca_block_sample sample = good;
    sample.albedo.r = 32.0f;
    sample.normal.z = -32.0f;
    sample.position.y = -32.0f * 1024.0f;
    sample.albedo.g = 0x1.8p-29f; /* three quarters of the fixed point's unit: rounded, not cut */
    assert_true(ca_block_film_add(film, X0 + 1, Y0, &sample));
    layers = develop(film);
    assert_true(layer_at(layers, "Albedo.R", 1) == 16.0f && layer_at(layers, "Albedo.G", 1) == 0x1p-29f);
    assert_true(layer_at(layers, "P.Y", 1) == -16.0f * 1024.0f);
    ca_layers_destroy(layers);
    sample.albedo.r = 32.1f;
    assert_false(ca_block_film_add(film, X0 + 1, Y0, &sample));
    sample.albedo.r = 0.0f;
    sample.position.y = 32.1f * 1024.0f;
    assert_false(ca_block_film_add(film, X0 + 1, Y0, &sample));
    ca_block_film_destroy(film);
}

/* Positions lose no more than a sixteenth of what a float resolves at the extent, wherever in the range of floats
 * that is. */
static void test_positions_of_any_size(void **state)
{
    (void)state;
    static const float sizes[] = {FLT_MIN, 1e-20f, 0.3f, 1.0f, 1.0000001f, 6e5f, 1e30f, FLT_MAX};
    random_source = ca_test_random_seed(4);
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        const ca_block_film_desc desc = desc_with(false, sizes[i]);
        ca_block_film *film;
        assert_int_equal(ca_block_film_create(&film, &desc, NULL), CA_OK);
        const float kept = ca_block_film_described(film)->extent;
        assert_true(kept >= sizes[i] * 0.5f && (kept >= sizes[i] || sizes[i] > 0x1p127f) && kept < 2.0f * sizes[i]);
        int exponent;
        assert_true(frexpf(kept, &exponent) == 0.5f);
        double sum = 0.0;
        for (int b = 0; b < 100; b++) {
            const ca_block_sample sample = {.paths = 1, .position = {sizes[i] * between(-1, 1), sizes[i], 0}};
            sum += (double)sample.position.x;
            assert_true(ca_block_film_add(film, X0, Y0, &sample));
        }
        ca_image_layers *layers = develop(film);
        assert_true(fabs((double)layer_at(layers, "P.X", 0) - sum / 100.0) <= 0x1p-24 * (double)sizes[i]);
        assert_true(layer_at(layers, "P.Y", 0) == sizes[i]);
        ca_layers_destroy(layers);
        ca_block_film_destroy(film);
    }
}

/* ---- Error bars ------------------------------------------------------------------------------------------------ */

/* Rows of 2 camera paths, columns of 2 light paths, each path one of three things; blocks of an L, as a render that
 * ends within a shell leaves them. Going through all that may happen, the mean of the estimated variance is the
 * variance of the value. */
enum { KINDS = 3, SIDE = 2, L_BLOCKS = 3, PATHS = 2 * SIDE * 2 };
static const double merged[KINDS][KINDS] = {{0, 2, 5}, {1, 0, 0.5}, {3, 0, 7}}, alone[KINDS] = {0, 4, 1};
static const uint32_t l_shape[L_BLOCKS][2] = {{0, 0}, {1, 0}, {1, 1}}; /* row, column */
static const uint64_t l_visits[L_BLOCKS][2] = {{0, 0}, {0, 1}, {1, 0}};

static ca_block_sample l_block(ca_pair_covariances *c, const uint32_t *kinds, int block)
{
    const uint32_t *camera = kinds + 2 * l_shape[block][0], *light = kinds + 2 * SIDE + 2 * l_shape[block][1];
    ca_block_sample sample = {
        .pairs = 4, .paths = 2, .visits_camera = l_visits[block][0], .visits_light = l_visits[block][1]};
    ca_pair_covariances_begin(c, 2);
    for (int j = 0; j < 2; j++) {
        ca_pair_covariances_next_path(c);
        ca_pair_covariances_add_alone(c, alone[camera[j]]);
        for (uint32_t i = 0; i < 2; i++) {
            ca_pair_covariances_add(c, i, merged[light[i]][camera[j]]);
            sample.radiance.g += (float)(alone[camera[j]] + merged[light[i]][camera[j]]);
        }
    }
    assert_true(ca_pair_covariances_finish(c, &sample.covariance));
    return sample;
}

static void test_unfinished_rectangles_have_no_bias(void **state)
{
    (void)state;
    const ca_block_film_desc desc = {
        .full_width = 1, .full_height = 1, .crop = {0, 0, 1, 1}, .error_bars = true, .extent = 1.0f};
    ca_pair_covariances c;
    double outcomes = 0.0, sum = 0.0, squares = 0.0, estimates = 0.0;
    assert_int_equal(ca_pair_covariances_create(&c, NULL), CA_OK);
    for (uint32_t outcome = 0; outcome < 6561; outcome++, outcomes++) { /* 3^8 */
        uint32_t kinds[PATHS], rest = outcome;
        for (int p = 0; p < PATHS; p++, rest /= KINDS) kinds[p] = rest % KINDS;
        ca_block_film *film;
        assert_int_equal(ca_block_film_create(&film, &desc, NULL), CA_OK);
        for (int b = 0; b < L_BLOCKS; b++) {
            const ca_block_sample sample = l_block(&c, kinds, b);
            assert_true(ca_block_film_add(film, 0, 0, &sample));
        }
        ca_image_layers *layers = develop(film);
        const double value = (double)layer_at(layers, "G", 0);
        sum += value;
        squares += value * value;
        estimates += (double)layer_at(layers, "ValueVariance.Y", 0);
        ca_layers_destroy(layers);
        ca_block_film_destroy(film);
    }
    const double variance = squares / outcomes - pow(sum / outcomes, 2.0);
    assert_true(variance > 0.5);
    assert_true(fabs(estimates / outcomes / variance - 1.0) < 1e-5);
    ca_pair_covariances_destroy(&c);
}

/* One uncertain variance is too many for (x, y) if pixel (3, 0) is one of fewer than 12 pixels near it. */
static bool is_too_near(int x, int y)
{
    int others = -1, near = 0;
    for (int v = y - 2; v <= y + 2; v++)
        for (int u = x - 2; u <= x + 2; u++) {
            if (u < 0 || v < 0 || u >= WIDTH || v >= HEIGHT) continue;
            others++;
            near += u == 3 && v == 0;
        }
    return near == 1 && others < CA_CONFIDENCE_UNCERTAIN;
}

/* A pixel of which a sample was lost, one without the first block, one whose covariance no float holds; the others
 * are not. One whose variance comes out negative, and the pixels near it, have widened intervals. */
static void test_marked_pixels(void **state)
{
    (void)state;
    ca_block_film *film = create(true);
    for (uint32_t p = 0; p < PIXELS; p++)
        for (uint64_t b = 0; b < 36; b++) {
            ca_block_sample sample = {.radiance = {4000, 4000, 4000}, .pairs = 4000, .paths = 4};
            sample.visits_camera = b % 6;
            sample.visits_light = b / 6;
            sample.covariance = (ca_pair_covariance){.camera = 0.1, .light = 0.2, .pair = 0.3, .merged = 1.0};
            if (p == 0 && b == 5) sample.radiance.r = NAN;
            if (p == 1 && b == 0) sample.visits_camera = 1;
            if (p == 2 && b == 7) sample.covariance.light = 1e60;
            if (p == 3 && b == 7) sample.covariance.camera = -100.0;
            assert_true(ca_block_film_add(film, X0 + p % WIDTH, Y0 + p / WIDTH, &sample) == !(p == 0 && b == 5));
        }
    ca_image_layers *layers = develop(film);
    const double variance = 0.1 / 24 + 0.2 / 6000 + 0.3 / (24 * 6000);
    for (uint32_t p = 0; p < PIXELS; p++) {
        const float low = layer_at(layers, "ConfidenceLow.Y", p), high = layer_at(layers, "ConfidenceHigh.Y", p);
        const double got = (double)layer_at(layers, "ValueVariance.Y", p);
        const float widened = layer_at(layers, "ConfidenceWidened.Y", p);
        if (p < 3) {
            assert_true(low == -INFINITY && high == INFINITY && isnan(got) && widened == 0.0f);
            continue;
        }
        assert_true(widened == (p == 3 || is_too_near((int)(p % WIDTH), (int)(p / WIDTH)) ? 1.0f : 0.0f));
        if (widened == 1.0f) {
            assert_true(low < 1.0f && high > 1.0f && isfinite(low) && isfinite(high) && (p != 3 || got < 0.0));
            continue;
        }
        /* 18 degrees of freedom: t = 2.101; a little less or more for the skewness. */
        assert_true(fabs(got / variance - 1.0) < 1e-6);
        assert_true(low < 1.0f && high > 1.0f &&
                    fabs(((double)high - (double)low) / sqrt(variance) / 2.0 / 2.101 - 1.0) < 0.03);
    }
    ca_layers_destroy(layers);
    ca_block_film_destroy(film);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static void test_out_of_memory(void **state)
{
    (void)state;
    const ca_block_film_desc desc = desc_with(true, extent);
    for (long i = 0; i < 4; i++) {
        ca_block_film *film;
        ca_error error = {""};
        ca_memory_fail_after(i);
        assert_int_equal(ca_block_film_create(&film, &desc, &error), CA_ERROR_MEMORY);
        ca_memory_fail_after(-1);
        assert_null(film);
        assert_non_null(strstr(error.message, "the film"));
    }
    ca_block_film *film = create(true);
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_image_layers *layers;
        ca_memory_fail_after(failures);
        status = ca_block_film_develop(film, 2, &layers, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        ca_layers_destroy(layers);
    }
    assert_true(failures > 23);
    ca_block_film_destroy(film);
    ca_block_film_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values_are_means),
        cmocka_unit_test(test_empty_and_without_gradients),
        cmocka_unit_test(test_order_and_films_do_not_matter),
        cmocka_unit_test(test_bytes_bring_everything_back),
        cmocka_unit_test(test_gate),
        cmocka_unit_test(test_positions_of_any_size),
        cmocka_unit_test(test_unfinished_rectangles_have_no_bias),
        cmocka_unit_test(test_marked_pixels),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
