#include "film/pass_sums.h"

#include "base/little_endian.h"

#include <math.h>

_Static_assert(sizeof(ca_pass_sums) == 260 && sizeof(ca_group_sums) == 104 && sizeof(ca_pass_addend) == 40,
               "pass_sums.h promises so many bytes per pixel");

enum { ALL_BINS = CA_BINNED_BINS * CA_PASS_SUMS, GROUP_BINS = CA_BINNED_BINS * 4 };

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

static void move(ca_pass_sums *sums, int i, int power, uint8_t from, uint8_t to)
{
    ca_binned_move(sums->high + i, sums->low + i, CA_PASS_SUMS, power, from, to);
}

/* Makes the scale of channel c larger. */
static void rescale(ca_pass_sums *sums, int c, bool cubes, uint8_t to)
{
    move(sums, CA_PASS_SQUARES + c, 2, sums->scale[c], to);
    if (c < 3) move(sums, CA_PASS_VALUES + c, 1, sums->scale[c], to);
    if (cubes) move(sums, CA_PASS_CUBES + c, 3, sums->scale[c], to);
    sums->scale[c] = to;
}

static void rescale_group(ca_pass_sums *sums, ca_group_sums *group, int c, uint8_t to)
{
    move(sums, CA_PASS_CUBES + c, 3, group->scale[c], to);
    ca_binned_move(group->high + c, group->low + c, 4, 2, group->scale[c], to);
    group->scale[c] = to;
}

__attribute__((noinline, cold)) static void make_room(ca_pass_sums *sums, bool cubes, ca_binned_d4 value)
{
    for (int c = 0; c < 4; c++) rescale(sums, c, cubes, ca_binned_scale_of(sums->scale[c], value[c]));
}

/* Eleven sums are three times four: one is met twice, by the values with a 0. */
__attribute__((always_inline)) static inline void add_value(ca_pass_sums *sums, ca_binned_d4 v, bool cubes)
{
    const ca_binned_d4 rgb = {v[0], v[1], v[2], 0.0};
    ca_binned_i4 scales = ca_binned_scales(sums->scale);
    if (ca_binned_is_over(v, scales)) {
        make_room(sums, cubes, v);
        scales = ca_binned_scales(sums->scale);
    }
    const ca_binned_terms first = {v * v, ca_binned_units(scales, 2)}, second = {rgb, ca_binned_units(scales, 1)},
                          third = {v * v * v * (cubes ? 1.0 : 0.0), ca_binned_units(scales, 3)};
    ca_binned_add12(sums->high, sums->low, CA_PASS_SUMS, first, second, CA_PASS_CUBES, third);
}

void ca_pass_sums_add(ca_pass_sums *sums, const double value[4], bool cubes)
{
    const ca_binned_d4 v = {value[0], value[1], value[2], value[3]};
    add_value(sums, v, cubes);
}

static inline void add_features(ca_pass_sums *sums, const ca_pass_addend *addend)
{
    for (int i = 0; i < CA_PASS_FEATURES; i++) {
        const int32_t low = sums->feature_low[i] + addend->feature_low[i];
        sums->feature_high[i] += addend->feature_high[i] + (low >> 16);
        sums->feature_low[i] = (uint16_t)low;
    }
}

/* Begins to bring the sums of a pixel into the cache: most of them have left it when a pass comes back. */
static inline void fetch(const ca_pass_sums *sums)
{
    enum { LINE = 64 };
    for (size_t at = 0; at < sizeof *sums; at += LINE) __builtin_prefetch((const char *)sums + at, 1);
}

void ca_pass_sums_add_row(ca_pass_sums *sums, const ca_pass_addend *addends, size_t count, bool cubes)
{
    enum { AHEAD = 4 };
    for (size_t i = 0; i < count; i++) {
        if (i + AHEAD < count) {
            fetch(&sums[i + AHEAD]);
            __builtin_prefetch(&addends[i + AHEAD]);
        }
        const double r = (double)addends[i].value[0], g = (double)addends[i].value[1],
                     b = (double)addends[i].value[2];
        const ca_binned_d4 value = {r, g, b, ca_pass_luminance(r, g, b)};
        add_value(&sums[i], value, cubes);
        add_features(&sums[i], &addends[i]);
        sums[i].samples++;
    }
}

/* Rounded, a half away from 0; 0 where they are too large or no numbers. */
static inline ca_binned_i8 whole_numbers(ca_binned_f8 units)
{
    const ca_binned_f8 half = {0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f};
    const ca_binned_i8 sign = (ca_binned_i8)units & INT32_MIN;
    const ca_binned_f8 sum = units + (ca_binned_f8)((ca_binned_i8)half | sign),
                       size = (ca_binned_f8)((ca_binned_i8)sum & INT32_MAX);
    const ca_binned_i8 kept = (ca_binned_i8)sum & (ca_binned_i8)(size < (float)CA_BINNED_MOST_UNITS);
    return __builtin_convertvector((ca_binned_f8)kept, ca_binned_i8);
}

void ca_pass_addend_set_features(ca_pass_addend *addend, const float value[CA_PASS_FEATURES], const float scale[3])
{
    typedef int8_t b8 __attribute__((vector_size(8)));
    const ca_binned_f8 scales = {scale[0], scale[0], scale[0], scale[1], scale[1], scale[1], scale[2], scale[2]};
    const ca_binned_f8 last = {value[8] * scale[2]};
    ca_binned_f8 eight;
    memcpy(&eight, value, sizeof eight);
    const ca_binned_i8 units = whole_numbers(eight * scales);
    const ca_binned_h8 low = __builtin_convertvector(units, ca_binned_h8);
    const b8 high = __builtin_convertvector(units >> 16, b8);
    const int32_t ninth = whole_numbers(last)[0];
    memcpy(addend->feature_low, &low, sizeof low);
    memcpy(addend->feature_high, &high, sizeof high);
    addend->feature_low[8] = (uint16_t)ninth;
    addend->feature_high[8] = (int8_t)(ninth >> 16);
}

void ca_pass_sums_close_group(ca_pass_sums *sums, ca_group_sums *group, uint32_t samples)
{
    ca_binned_d4 value;
    for (int c = 0; c < 3; c++) {
        value[c] = group->open[c] / samples;
        group->open[c] = 0.0;
    }
    value[3] = ca_pass_luminance(value[0], value[1], value[2]);
    for (int c = 0; c < 4; c++) rescale_group(sums, group, c, ca_binned_scale_of(group->scale[c], value[c]));
    const ca_binned_i4 scales = ca_binned_scales(group->scale);
    const ca_binned_terms squares = {value * value, ca_binned_units(scales, 2)},
                          cubes = {value * value * value, ca_binned_units(scales, 3)};
    ca_binned_add4(sums->high + CA_PASS_CUBES, sums->low + CA_PASS_CUBES, CA_PASS_SUMS, cubes);
    ca_binned_add4(group->high, group->low, 4, squares);
}

/* To the larger scale of both. */
static void add_groups(ca_pass_sums *sums, ca_group_sums *group, ca_pass_sums *other, ca_group_sums *other_group)
{
    for (int c = 0; c < 4; c++) {
        const uint8_t a = group->scale[c], b = other_group->scale[c], to = a > b ? a : b;
        rescale_group(sums, group, c, to);
        rescale_group(other, other_group, c, to);
    }
    ca_binned_add(group->high, group->low, other_group->high, other_group->low, GROUP_BINS);
}

/* Of the same units. */
static void add_counts(ca_pass_sums *sums, const ca_pass_sums *other)
{
    ca_binned_add(sums->high, sums->low, other->high, other->low, ALL_BINS);
    ca_binned_add(sums->feature_high, sums->feature_low, other->feature_high, other->feature_low, CA_PASS_FEATURES);
    sums->samples += other->samples;
}

void ca_pass_sums_add_sums(ca_pass_sums *sums, ca_group_sums *group, const ca_pass_sums *other,
                           const ca_group_sums *other_group)
{
    if (!group && memcmp(sums->scale, other->scale, sizeof sums->scale) == 0) {
        add_counts(sums, other);
        return;
    }
    ca_pass_sums copy = *other;
    for (int c = 0; c < 4; c++) {
        const uint8_t a = sums->scale[c], b = copy.scale[c], to = a > b ? a : b;
        rescale(sums, c, !group, to);
        rescale(&copy, c, !group, to);
    }
    if (group) {
        ca_group_sums copied = *other_group;
        add_groups(sums, group, &copy, &copied);
    }
    add_counts(sums, &copy);
}

/* Four at a time: the values are three, and what is written behind them is the first cube's place. */
void ca_pass_sums_values(const ca_pass_sums *sums, const ca_group_sums *group, double values[CA_PASS_SUMS])
{
    enum { S = CA_PASS_SQUARES, V = CA_PASS_VALUES, C = CA_PASS_CUBES };
    const uint8_t *scale = sums->scale, *cubes = group ? group->scale : scale;
    ca_binned_values4(sums->high + S, sums->low + S, CA_PASS_SUMS, 2, scale, values + S);
    ca_binned_values4(sums->high + V, sums->low + V, CA_PASS_SUMS, 1, scale, values + V);
    ca_binned_values4(sums->high + C, sums->low + C, CA_PASS_SUMS, 3, cubes, values + C);
}

void ca_group_sums_values(const ca_group_sums *sums, double values[4])
{
    ca_binned_values4(sums->high, sums->low, 4, 2, sums->scale, values);
}

double ca_pass_sums_feature(const ca_pass_sums *sums, int i)
{
    return (double)sums->feature_high[i] * 0x1p16 + sums->feature_low[i];
}

/* ---- Bytes ----------------------------------------------------------------------------------------------------- */

static unsigned char *put_all(unsigned char *bytes, const int32_t *high, const uint16_t *low, int count)
{
    for (int i = 0; i < count; i++, bytes += 6) {
        ca_put_bytes(bytes, low[i], 2);
        ca_put_bytes(bytes + 2, (uint32_t)high[i], 4);
    }
    return bytes;
}

/* No sum of so many terms, each of `most` units at most, is larger: or *good is false. */
static const unsigned char *get_all(const unsigned char *bytes, int32_t *high, uint16_t *low, int count,
                                    uint32_t samples, int64_t most, bool *good)
{
    const int64_t limit = samples * most;
    for (int i = 0; i < count; i++, bytes += 6) {
        low[i] = (uint16_t)ca_get_bytes(bytes, 2);
        high[i] = (int32_t)ca_get_bytes(bytes + 2, 4);
        const int64_t value = (int64_t)high[i] * 65536 + low[i];
        *good = *good && value <= limit && value >= -limit;
    }
    return bytes;
}

static void get_scales(const unsigned char *bytes, uint8_t scale[4], bool *good)
{
    memcpy(scale, bytes, 4);
    for (int c = 0; c < 4; c++) *good = *good && scale[c] < CA_BINNED_SCALES;
}

void ca_pass_sums_write(const ca_pass_sums *sums, unsigned char bytes[CA_PASS_SUMS_BYTES])
{
    ca_put_bytes(bytes, sums->samples, 4);
    memcpy(bytes + 4, sums->scale, 4);
    bytes = put_all(bytes + 8, sums->high, sums->low, ALL_BINS);
    put_all(bytes, sums->feature_high, sums->feature_low, CA_PASS_FEATURES);
}

bool ca_pass_sums_read(ca_pass_sums *sums, const unsigned char bytes[CA_PASS_SUMS_BYTES])
{
    const uint32_t samples = (uint32_t)ca_get_bytes(bytes, 4);
    bool good = samples <= CA_BINNED_SUM_MOST_VALUES;
    get_scales(bytes + 4, sums->scale, &good);
    sums->samples = samples;
    bytes = get_all(bytes + 8, sums->high, sums->low, ALL_BINS, samples, CA_BINNED_MOST_UNITS, &good);
    get_all(bytes, sums->feature_high, sums->feature_low, CA_PASS_FEATURES, samples, CA_BINNED_MOST_UNITS - 1,
            &good);
    return good;
}

void ca_group_sums_write(const ca_group_sums *sums, unsigned char bytes[CA_GROUP_SUMS_BYTES])
{
    for (int c = 0; c < 3; c++, bytes += 8) ca_put_u64(bytes, ca_double_bits(sums->open[c]));
    memcpy(bytes, sums->scale, 4);
    put_all(bytes + 4, sums->high, sums->low, GROUP_BINS);
}

bool ca_group_sums_read(ca_group_sums *sums, uint32_t samples, const unsigned char bytes[CA_GROUP_SUMS_BYTES])
{
    bool good = true;
    for (int c = 0; c < 3; c++, bytes += 8) {
        sums->open[c] = ca_bits_double(ca_get_u64(bytes));
        good = good && isfinite(sums->open[c]);
    }
    get_scales(bytes, sums->scale, &good);
    get_all(bytes + 4, sums->high, sums->low, GROUP_BINS, samples, CA_BINNED_MOST_UNITS, &good);
    return good;
}
