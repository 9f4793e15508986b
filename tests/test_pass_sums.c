/* Sums of passes that add up in any order and grouping: against exact sums of the same values, any permutation and
 * any partition to the bit, films with groups, bytes. */
#include "film/exact_sum.h"
#include "film/film.h"
#include "support/named_layer.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SAMPLES = 60, PARTS = 5 };

static ca_test_random random_source;

static float between(float low, float high) { return low + (high - low) * ca_test_random_float(&random_source); }
static uint32_t below(uint32_t count) { return (uint32_t)between(0.0f, (float)count - 0.001f); }

/* Of very different sizes, and of both signs. */
static double any_value(int spread)
{
    const float sign = between(-1.0f, 1.0f);
    return ldexp((double)between(1.0f, 2.0f), (int)between((float)-spread, (float)spread)) *
           (sign < 0.0f ? -1.0 : 1.0);
}

/* ---- One pixel ------------------------------------------------------------------------------------------------- */

static void add(ca_pass_sums *sums, const double value[4])
{
    ca_pass_sums_add(sums, value, true);
    sums->samples++;
}

static double value_of(const ca_pass_sums *sums, int i)
{
    double values[CA_PASS_SUMS];
    ca_pass_sums_values(sums, NULL, values);
    return values[i];
}

/* Doubles that are floats, so that there are exact sums of them. */
static void test_values(void **state)
{
    (void)state;
    for (int round = 0; round < 200; round++) {
        ca_pass_sums sums = {.samples = 0};
        ca_exact_sum exact[3] = {0};
        double largest[3] = {0.0};
        const int spread = 1 + round % 60;
        for (int i = 0; i < SAMPLES; i++) {
            double value[4] = {0.0};
            for (int c = 0; c < 3; c++) {
                value[c] = (double)(float)any_value(spread);
                ca_exact_sum_add(&exact[c], (float)value[c]);
                largest[c] = fmax(largest[c], fabs(value[c]));
            }
            add(&sums, value);
        }
        for (int c = 0; c < 3; c++) {
            const double got = value_of(&sums, CA_PASS_VALUES + c);
            const double sum = ca_exact_sum_value(&exact[c]);
            if (!(fabs(got - sum) <= SAMPLES * 0x1p-48 * largest[c] + 0x1p-52 * fabs(sum)))
                fail_msg("round %d: %.17g instead of %.17g", round, got, sum);
        }
    }
}

/* Values of about one size, as most pixels have them, are summed without any error, and so are their squares: equal
 * ones have no variance. */
static void test_equal_values(void **state)
{
    (void)state;
    for (int round = 0; round < 1000; round++) {
        ca_pass_sums sums = {.samples = 0};
        const double v = (double)(float)any_value(60), value[4] = {v, v, v, v};
        for (int i = 0; i < 8; i++) add(&sums, value);
        assert_true(value_of(&sums, CA_PASS_VALUES) == 8.0 * v);
        assert_true(value_of(&sums, CA_PASS_SQUARES + 3) == 8.0 * v * v);
        const double cubes = value_of(&sums, CA_PASS_CUBES + 3);
        assert_true(fabs(cubes - 8.0 * v * v * v) <= 8.0 * 0x1.01p-48 * fabs(v * v * v));
    }
}

/* The largest and the smallest float there is, and nothing. */
static void test_extremes(void **state)
{
    (void)state;
    ca_pass_sums sums = {.samples = 0};
    const double most = 0x1.fffffep127, least = 0x1p-149;
    const double large[4] = {most, -most, 0.0, most}, small[4] = {least, least, -least, 0.0};
    add(&sums, small);
    assert_true(value_of(&sums, CA_PASS_VALUES) == least);
    assert_true(value_of(&sums, CA_PASS_SQUARES + 2) == 0x1p-298);
    assert_true(value_of(&sums, CA_PASS_CUBES + 2) == -0x1p-447);
    add(&sums, large);
    assert_true(value_of(&sums, CA_PASS_VALUES + 1) == -most);
    assert_true(fabs(value_of(&sums, CA_PASS_CUBES) / (most * most * most) - 1.0) < 0x1p-47);
}

static void shuffle(int *order, int count)
{
    for (int i = count - 1; i > 0; i--) {
        const int j = (int)below((uint32_t)i + 1), kept = order[i];
        order[i] = order[j];
        order[j] = kept;
    }
}

/* Any order, any partition into parts, and these added in any order: the same bytes. */
static void test_order_and_grouping(void **state)
{
    (void)state;
    for (int round = 0; round < 400; round++) {
        double values[SAMPLES][4];
        int order[SAMPLES];
        const int spread = 1 + round % 62;
        for (int i = 0; i < SAMPLES; i++) {
            order[i] = i;
            for (int c = 0; c < 4; c++) values[i][c] = below(8) == 0 ? 0.0 : (double)(float)any_value(spread);
        }
        ca_pass_sums one = {.samples = 0}, parts[PARTS] = {0}, sum = {.samples = 0};
        for (int i = 0; i < SAMPLES; i++) add(&one, values[i]);
        shuffle(order, SAMPLES);
        for (int i = 0; i < SAMPLES; i++) add(&parts[below(PARTS)], values[order[i]]);
        int part_order[PARTS] = {0, 1, 2, 3, 4};
        shuffle(part_order, PARTS);
        ca_pass_sums_add_sums(&parts[part_order[1]], NULL, &parts[part_order[0]], NULL);
        for (int i = 1; i < PARTS; i++) ca_pass_sums_add_sums(&sum, NULL, &parts[part_order[i]], NULL);
        unsigned char a[CA_PASS_SUMS_BYTES], b[CA_PASS_SUMS_BYTES];
        ca_pass_sums_write(&one, a);
        ca_pass_sums_write(&sum, b);
        if (memcmp(a, b, sizeof a) != 0) fail_msg("round %d: another order, other sums", round);
    }
}

/* ---- Films ----------------------------------------------------------------------------------------------------- */

enum { WIDTH = 3, HEIGHT = 2, PIXELS = WIDTH * HEIGHT };

static ca_film create_film(uint32_t replicate_samples)
{
    static const uint32_t crop[4] = {1, 2, 1 + WIDTH, 2 + HEIGHT};
    ca_film film;
    assert_int_equal(ca_film_create(&film, 9, 8, crop, NULL), CA_OK);
    assert_int_equal(ca_film_add_up_in_parts(&film, 7.0f, NULL), CA_OK);
    assert_int_equal(ca_film_set_replicates(&film, replicate_samples, NULL), CA_OK);
    return film;
}

static ca_film_sample any_sample(void)
{
    return (ca_film_sample){.radiance = {between(0, 1), between(0, 9), between(0, 1e-4f)},
                            .filter_weight = between(0.5f, 1),
                            .splat = {between(0, 1e-3f), 0, between(0, 1e6f)},
                            .albedo = {between(0, 1), between(0, 1), 1},
                            .normal = {between(-1, 1), between(-1, 1), between(-1, 1)},
                            .position = {between(-7, 7), between(-7, 7), between(-7, 7)}};
}

/* Adds [begin, end) of the passes. */
static void add_passes(ca_film *film, ca_film_sample samples[][PIXELS], int begin, int end)
{
    for (int s = begin; s < end; s++)
        for (uint32_t p = 0; p < PIXELS; p++) assert_true(ca_film_add(film, p % WIDTH, p / WIDTH, &samples[s][p]));
}

static void add_film(ca_film *to, const ca_film *from, uint32_t samples, bool first)
{
    unsigned char *row = malloc(ca_film_row_bytes(from));
    assert_non_null(row);
    for (uint32_t y = 0; y < HEIGHT; y++) {
        ca_film_write_row(from, y, row);
        assert_true(ca_film_add_row(to, y, row, samples, first));
    }
    free(row);
}

static void expect_same_images(const ca_film *a, const ca_film *b)
{
    ca_image_layers *x, *y;
    assert_int_equal(ca_film_develop(a, 1, &x, NULL), CA_OK);
    assert_int_equal(ca_film_develop(b, 2, &y, NULL), CA_OK);
    assert_true(x->channel_count == y->channel_count);
    for (uint32_t l = 0; l < x->channel_count; l++) {
        const float *u = x->channels[l].data, *v = ca_layers_find(y, x->channels[l].name);
        if (!v || memcmp(u, v, PIXELS * sizeof *u) != 0) fail_msg("layer %s differs", x->channels[l].name);
    }
    ca_layers_destroy(x);
    ca_layers_destroy(y);
}

/* Replicates of one sample, of four, and none. */
static void test_films_of_parts(void **state)
{
    (void)state;
    static const int cuts[] = {0, 8, 12, 40, SAMPLES};
    static ca_film_sample samples[SAMPLES][PIXELS];
    for (int s = 0; s < SAMPLES; s++)
        for (int p = 0; p < PIXELS; p++) samples[s][p] = any_sample();
    static const uint32_t replicates[] = {1, 4, 0};
    for (int r = 0; r < 3; r++) {
        ca_film one = create_film(replicates[r]), sum = create_film(replicates[r]);
        add_passes(&one, samples, 0, SAMPLES);
        static const int order[4] = {2, 0, 3, 1};
        for (int i = 0; i < 4; i++) {
            ca_film part = create_film(replicates[r]);
            add_passes(&part, samples, cuts[order[i]], cuts[order[i] + 1]);
            add_film(&sum, &part, (uint32_t)(cuts[order[i] + 1] - cuts[order[i]]), i == 0);
            ca_film_destroy(&part);
        }
        expect_same_images(&one, &sum);
        ca_film_destroy(&one);
        ca_film_destroy(&sum);
    }
}

/* A film that is read goes on where it was, in the middle of a group, too. */
static void test_going_on(void **state)
{
    (void)state;
    static ca_film_sample samples[SAMPLES][PIXELS];
    for (int s = 0; s < SAMPLES; s++)
        for (int p = 0; p < PIXELS; p++) samples[s][p] = any_sample();
    ca_film one = create_film(4), half = create_film(4), rest = create_film(4);
    add_passes(&one, samples, 0, SAMPLES);
    add_passes(&half, samples, 0, 21);
    add_film(&rest, &half, 21, true);
    add_passes(&rest, samples, 21, SAMPLES);
    expect_same_images(&one, &rest);
    unsigned char *row = malloc(ca_film_row_bytes(&half));
    assert_non_null(row);
    ca_film_write_row(&half, 0, row);
    assert_false(ca_film_add_row(&rest, 0, row, 21, false)); /* a group is open */
    ca_film_write_row(&one, 0, row);
    assert_false(ca_film_add_row(&rest, 0, row, SAMPLES - 1, true)); /* another number of samples */
    free(row);
    ca_film_destroy(&one);
    ca_film_destroy(&half);
    ca_film_destroy(&rest);
}

/* The same image as that of sums in double precision, to a few units of a float's last place; of groups, the last of
 * which is not complete, too. */
static void expect_same_as_doubles(uint32_t replicate_samples)
{
    static const uint32_t crop[4] = {1, 2, 1 + WIDTH, 2 + HEIGHT};
    ca_film parts = create_film(replicate_samples), doubles;
    assert_int_equal(ca_film_create(&doubles, 9, 8, crop, NULL), CA_OK);
    assert_int_equal(ca_film_set_replicates(&doubles, replicate_samples, NULL), CA_OK);
    for (int s = 0; s < SAMPLES + 2; s++)
        for (uint32_t p = 0; p < PIXELS; p++) {
            const ca_film_sample sample = any_sample();
            assert_true(ca_film_add(&parts, p % WIDTH, p / WIDTH, &sample));
            assert_true(ca_film_add(&doubles, p % WIDTH, p / WIDTH, &sample));
        }
    ca_image_layers *x, *y;
    assert_int_equal(ca_film_develop(&parts, 2, &x, NULL), CA_OK);
    assert_int_equal(ca_film_develop(&doubles, 1, &y, NULL), CA_OK);
    for (uint32_t l = 0; l < x->channel_count; l++)
        for (int p = 0; p < PIXELS; p++) {
            const double u = (double)x->channels[l].data[p], v = (double)ca_layers_find(y, x->channels[l].name)[p];
            if (!(fabs(u - v) <= 4e-6 * fabs(v) + 1e-6)) fail_msg("%s: %.9g and %.9g", x->channels[l].name, u, v);
        }
    ca_layers_destroy(x);
    ca_layers_destroy(y);
    ca_film_destroy(&parts);
    ca_film_destroy(&doubles);
}

static void test_same_as_doubles(void **state)
{
    (void)state;
    expect_same_as_doubles(1);
    expect_same_as_doubles(4);
}

/* Equal samples have no variance at all, in no channel, of one sample or of groups. */
static void test_equal_samples(void **state)
{
    (void)state;
    static const char *const names[] = {"Variance.R", "Variance.G", "Variance.B", "StandardDeviation.Y"};
    for (uint32_t each = 1; each <= 4; each += 3) {
        ca_film film = create_film(each);
        ca_image_layers *image;
        for (uint32_t p = 0; p < PIXELS; p++) {
            const ca_film_sample sample = any_sample();
            for (int i = 0; i < SAMPLES; i++) assert_true(ca_film_add(&film, p % WIDTH, p / WIDTH, &sample));
        }
        assert_int_equal(ca_film_develop(&film, 2, &image, NULL), CA_OK);
        for (int l = 0; l < 4; l++)
            for (uint32_t p = 0; p < PIXELS; p++) assert_true(layer_at(image, names[l], p) == 0.0f);
        for (uint32_t p = 0; p < PIXELS; p++) {
            const float mean = layer_at(image, "G", p), high = layer_at(image, "ConfidenceHigh.G", p);
            assert_true(high - mean <= 0x1.8p-21f * mean); /* what rounding may do */
        }
        ca_layers_destroy(image);
        ca_film_destroy(&film);
    }
}

/* First hits that are no numbers or far out of bounds add nothing; samples that are none, likewise. */
static void test_gate(void **state)
{
    (void)state;
    ca_film film = create_film(1);
    ca_film_sample sample = any_sample();
    sample.position = (ca_vec3){NAN, 1e30f, 3.0f};
    sample.albedo = (ca_rgb){INFINITY, 2.0f, 0.5f};
    sample.normal = (ca_vec3){-2.0f, -0x1.fffff8p0f, 0x1.fffff8p0f}; /* the last two are the largest ones */
    assert_true(ca_film_add(&film, 0, 0, &sample));
    const ca_film_pixel pixel = ca_film_pixel_at(&film, 0);
    assert_true(pixel.position[0] == 0.0f && pixel.position[1] == 0.0f && pixel.position[2] == 3.0f);
    assert_true(pixel.albedo[0] == 0.0f && pixel.albedo[1] == 0.0f && pixel.albedo[2] == 0.5f);
    assert_true(pixel.normal[0] == 0.0f && pixel.normal[1] == -0x1.fffff8p0f && pixel.normal[2] == 0x1.fffff8p0f);
    sample = any_sample();
    sample.radiance.g = 0x1p127f;
    sample.filter_weight = 4.0f; /* together they are no float */
    assert_false(ca_film_add(&film, 1, 0, &sample));
    assert_true(ca_film_pixel_at(&film, 1).sum[1] == 0.0 && ca_film_pixel_at(&film, 1).samples == 1);
    ca_film_destroy(&film);
}

/* ---- Bytes ----------------------------------------------------------------------------------------------------- */

/* Sums that so many samples cannot have, and bins that there are not. */
static void test_bytes_that_are_no_sums(void **state)
{
    (void)state;
    ca_pass_sums sums = {.samples = 3}, read;
    unsigned char bytes[CA_PASS_SUMS_BYTES];
    sums.high[4] = 3 << 7; /* in 2^16 units */
    ca_pass_sums_write(&sums, bytes);
    assert_true(ca_pass_sums_read(&read, bytes) && memcmp(&read, &sums, sizeof sums) == 0);
    sums.low[4]++;
    ca_pass_sums_write(&sums, bytes);
    assert_false(ca_pass_sums_read(&read, bytes));
    sums.low[4] = 0;
    sums.feature_high[8] = -(3 << 7);
    sums.feature_low[8] = 3;
    ca_pass_sums_write(&sums, bytes);
    assert_true(ca_pass_sums_read(&read, bytes) && ca_pass_sums_feature(&read, 8) == -3.0 * 0x7fffffp0);
    sums.feature_low[8]--;
    ca_pass_sums_write(&sums, bytes);
    assert_false(ca_pass_sums_read(&read, bytes));
    sums.feature_high[8] = sums.feature_low[8] = 0;
    sums.scale[3] = CA_BINNED_SCALES;
    ca_pass_sums_write(&sums, bytes);
    assert_false(ca_pass_sums_read(&read, bytes));
    sums.scale[3] = CA_BINNED_SCALES - 1;
    sums.samples = CA_BINNED_SUM_MOST_VALUES + 1;
    ca_pass_sums_write(&sums, bytes);
    assert_false(ca_pass_sums_read(&read, bytes));
}

/* The bins of as many of the largest terms as there may be: the last sum that fits. */
static void test_most_values(void **state)
{
    (void)state;
    ca_pass_sums sums = {.samples = 0};
    const double least = 0x1p-20, value[4] = {least, -least, least, 0x1p128};
    add(&sums, value);
    for (int i = 1; i < 24; i++) { /* 2^i - 1 */
        const ca_pass_sums before = sums;
        ca_pass_sums_add_sums(&sums, NULL, &before, NULL);
        add(&sums, value);
    }
    assert_int_equal(sums.samples, CA_BINNED_SUM_MOST_VALUES);
    const double n = CA_BINNED_SUM_MOST_VALUES;
    assert_true(value_of(&sums, CA_PASS_VALUES + 1) == -least * n);
    assert_true(value_of(&sums, CA_PASS_CUBES + 1) == -least * least * least * n);
    assert_true(value_of(&sums, CA_PASS_SQUARES + 3) == 0x1p256 * n);
    assert_true(value_of(&sums, CA_PASS_CUBES + 3) == 0x1p384 * n);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_equal_values),
        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_order_and_grouping),
        cmocka_unit_test(test_films_of_parts),
        cmocka_unit_test(test_going_on),
        cmocka_unit_test(test_same_as_doubles),
        cmocka_unit_test(test_equal_samples),
        cmocka_unit_test(test_gate),
        cmocka_unit_test(test_bytes_that_are_no_sums),
        cmocka_unit_test(test_most_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
