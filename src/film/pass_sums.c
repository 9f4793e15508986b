#include "film/pass_sums.h"

#include "base/little_endian.h"

#include <math.h>
#include <string.h>

_Static_assert(sizeof(ca_pass_sums) == 296 && sizeof(ca_group_sums) == 128,
               "pass_sums.h promises so many bytes per pixel");

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

static inline ca_binned_sums binned(ca_pass_sums *s)
{
    return (ca_binned_sums){s->high, s->middle, s->low, s->bin, CA_PASS_SUMS, CA_PASS_VALUES};
}

static inline ca_binned_sums binned_group(ca_group_sums *s)
{
    return (ca_binned_sums){s->high, s->middle, s->low, s->bin, 4, 4};
}

/* What is added to the sums. */
typedef struct terms {
    ca_binned_d4 squares, values, cubes; /* values: R, G, B, and 0 for the first of the cubes */
} terms;

static void raise_for(ca_pass_sums *sums, const terms *t)
{
    const ca_binned_sums to = binned(sums);
    const double all[CA_PASS_SUMS] = {t->squares[0], t->squares[1], t->squares[2], t->squares[3],
                                      t->values[0],  t->values[1],  t->values[2],  t->cubes[0],
                                      t->cubes[1],   t->cubes[2],   t->cubes[3]};
    ca_binned_sums_raise(&to, all);
}

/* Eleven sums are three times four: one is met twice, the first time with a 0. */
static inline void add_terms(ca_pass_sums *sums, const terms *t)
{
    const uint8_t *bin = sums->bin;
    ca_binned_u4 squares = ca_binned_raised(bin), values = ca_binned_raised(bin + 4),
                 cubes = ca_binned_raised(bin + 7);
    const ca_binned_u4 over =
        ca_binned_over(t->squares, squares) | ca_binned_over(t->values, values) | ca_binned_over(t->cubes, cubes);
    if (ca_binned_is_any(over)) {
        raise_for(sums, t);
        squares = ca_binned_raised(bin);
        values = ca_binned_raised(bin + 4);
        cubes = ca_binned_raised(bin + 7);
    }
    ca_binned_add4(sums->high, sums->middle, sums->low, t->squares, squares);
    ca_binned_add4(sums->high + 4, sums->middle + 4, NULL, t->values, values);
    ca_binned_add4(sums->high + 7, sums->middle + 7, NULL, t->cubes, cubes);
}

void ca_pass_sums_add(ca_pass_sums *sums, const double value[4], bool cubes)
{
    const ca_binned_d4 v = {value[0], value[1], value[2], value[3]}, rgb = {value[0], value[1], value[2], 0.0};
    const terms t = {.squares = v * v, .values = rgb, .cubes = v * v * v * (cubes ? 1.0 : 0.0)};
    add_terms(sums, &t);
}

/* Units in a double next to 1.5 * 2^52 are its last places. */
static inline ca_binned_u4 whole_numbers(ca_binned_d4 units)
{
    const ca_binned_u4 size = (ca_binned_u4)units & ~(UINT64_C(1) << 63);
    const ca_binned_u4 within = (ca_binned_u4)((ca_binned_d4)size <= 0x1p32);
    const ca_binned_d4 kept = (ca_binned_d4)((ca_binned_u4)units & within);
    return (ca_binned_u4)(kept + 0x1.8p52) - CA_BINNED_EXPONENT(52) - (UINT64_C(1) << 51);
}

void ca_pass_sums_add_features(ca_pass_sums *sums, const float value[CA_PASS_FEATURES], const double scale[3])
{
    double units[CA_PASS_FEATURES];
    for (int i = 0; i < CA_PASS_FEATURES; i++) units[i] = (double)value[i] * scale[i / 3];
    const ca_binned_d4 first = {units[0], units[1], units[2], units[3]},
                       second = {units[4], units[5], units[6], units[7]}, last = {units[8]};
    int64_t *to = sums->features;
    ca_binned_store(to, ca_binned_load(to) + whole_numbers(first));
    ca_binned_store(to + 4, ca_binned_load(to + 4) + whole_numbers(second));
    to[8] += (int64_t)whole_numbers(last)[0];
}

void ca_pass_sums_close_group(ca_pass_sums *sums, ca_group_sums *group, uint32_t samples)
{
    ca_binned_d4 value;
    for (int c = 0; c < 3; c++) {
        value[c] = group->open[c] / samples;
        group->open[c] = 0.0;
    }
    value[3] = 0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2];
    const terms t = {.cubes = value * value * value};
    const double squares[4] = {value[0] * value[0], value[1] * value[1], value[2] * value[2], value[3] * value[3]};
    const ca_binned_sums of_group = binned_group(group);
    add_terms(sums, &t);
    ca_binned_sums_raise(&of_group, squares);
    ca_binned_add4(group->high, group->middle, group->low, value * value, ca_binned_raised(group->bin));
}

void ca_pass_sums_add_sums(ca_pass_sums *sums, const ca_pass_sums *other)
{
    ca_pass_sums copy = *other;
    const ca_binned_sums to = binned(sums), from = binned(&copy);
    ca_binned_sums_add_sums(&to, &from);
    for (int i = 0; i < CA_PASS_FEATURES; i++) sums->features[i] += other->features[i];
    sums->samples += other->samples;
}

void ca_group_sums_add_sums(ca_group_sums *sums, const ca_group_sums *other)
{
    ca_group_sums copy = *other;
    const ca_binned_sums to = binned_group(sums), from = binned_group(&copy);
    ca_binned_sums_add_sums(&to, &from);
}

double ca_pass_sums_value(const ca_pass_sums *sums, int i)
{
    return ca_binned_value(sums->bin[i], sums->high[i], sums->middle[i], i < CA_PASS_VALUES ? sums->low[i] : 0);
}

double ca_group_sums_value(const ca_group_sums *sums, int i)
{
    return ca_binned_value(sums->bin[i], sums->high[i], sums->middle[i], sums->low[i]);
}

/* ---- Bytes ----------------------------------------------------------------------------------------------------- */

static unsigned char *put_all(unsigned char *bytes, const int64_t *values, int count)
{
    for (int i = 0; i < count; i++, bytes += 8) ca_put_u64(bytes, (uint64_t)values[i]);
    return bytes;
}

static const unsigned char *get_all(const unsigned char *bytes, int64_t *values, int count)
{
    for (int i = 0; i < count; i++, bytes += 8) values[i] = (int64_t)ca_get_u64(bytes);
    return bytes;
}

/* No sum of so many terms, each of `most` units at most, is larger. */
static bool are_sums(const int64_t *values, int count, uint32_t samples, int64_t most)
{
    const int64_t limit = samples * most;
    bool good = true;
    for (int i = 0; i < count; i++) good = good && values[i] <= limit && values[i] >= -limit;
    return good;
}

static bool are_bins(const uint8_t *bin, int count)
{
    bool good = true;
    for (int i = 0; i < count; i++) good = good && bin[i] < CA_BINNED_SUM_BINS;
    return good;
}

static const int64_t most_units = INT64_C(1) << 39, most_feature_units = INT64_C(1) << 32;

/* The samples and four bins share eight bytes. */
void ca_pass_sums_write(const ca_pass_sums *sums, unsigned char bytes[CA_PASS_SUMS_BYTES])
{
    bytes = put_all(bytes, sums->high, CA_PASS_SUMS);
    bytes = put_all(bytes, sums->middle, CA_PASS_SUMS);
    bytes = put_all(bytes, sums->low, CA_PASS_VALUES);
    bytes = put_all(bytes, sums->features, CA_PASS_FEATURES);
    ca_put_u64(bytes, sums->samples);
    memcpy(bytes + 4, sums->bin, sizeof sums->bin);
}

bool ca_pass_sums_read(ca_pass_sums *sums, const unsigned char bytes[CA_PASS_SUMS_BYTES])
{
    bytes = get_all(bytes, sums->high, CA_PASS_SUMS);
    bytes = get_all(bytes, sums->middle, CA_PASS_SUMS);
    bytes = get_all(bytes, sums->low, CA_PASS_VALUES);
    bytes = get_all(bytes, sums->features, CA_PASS_FEATURES);
    sums->samples = (uint32_t)ca_get_u64(bytes);
    memcpy(sums->bin, bytes + 4, sizeof sums->bin);
    return sums->samples <= CA_BINNED_SUM_MOST_VALUES && are_bins(sums->bin, CA_PASS_SUMS) &&
           are_sums(sums->high, CA_PASS_SUMS, sums->samples, most_units) &&
           are_sums(sums->middle, CA_PASS_SUMS, sums->samples, most_units) &&
           are_sums(sums->low, CA_PASS_VALUES, sums->samples, most_units) &&
           are_sums(sums->features, CA_PASS_FEATURES, sums->samples, most_feature_units);
}

void ca_group_sums_write(const ca_group_sums *sums, unsigned char bytes[CA_GROUP_SUMS_BYTES])
{
    for (int c = 0; c < 3; c++, bytes += 8) ca_put_u64(bytes, ca_double_bits(sums->open[c]));
    bytes = put_all(bytes, sums->high, 4);
    bytes = put_all(bytes, sums->middle, 4);
    bytes = put_all(bytes, sums->low, 4);
    memcpy(bytes, sums->bin, sizeof sums->bin);
}

bool ca_group_sums_read(ca_group_sums *sums, uint32_t samples, const unsigned char bytes[CA_GROUP_SUMS_BYTES])
{
    bool good = true;
    for (int c = 0; c < 3; c++, bytes += 8) {
        sums->open[c] = ca_bits_double(ca_get_u64(bytes));
        good = good && isfinite(sums->open[c]);
    }
    bytes = get_all(bytes, sums->high, 4);
    bytes = get_all(bytes, sums->middle, 4);
    bytes = get_all(bytes, sums->low, 4);
    memcpy(sums->bin, bytes, sizeof sums->bin);
    return good && are_bins(sums->bin, 4) && are_sums(sums->high, 4, samples, most_units) &&
           are_sums(sums->middle, 4, samples, most_units) && are_sums(sums->low, 4, samples, most_units);
}
