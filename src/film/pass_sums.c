#include "film/pass_sums.h"

#include "base/little_endian.h"

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

void ca_pass_sums_add(ca_pass_sums *sums, const double value[4], bool cubes)
{
    const ca_binned_sums to = binned(sums);
    double terms[CA_PASS_SUMS];
    for (int c = 0; c < 4; c++) terms[CA_PASS_SQUARES + c] = value[c] * value[c];
    for (int c = 0; c < 3; c++) terms[CA_PASS_VALUES + c] = value[c];
    for (int c = 0; c < 4; c++) terms[CA_PASS_CUBES + c] = cubes ? value[c] * value[c] * value[c] : 0.0;
    ca_binned_sums_add(&to, terms);
}

/* A double next to 1.5 * 2^52 has whole numbers as its last places. */
static inline int64_t nearest(double value)
{
    return (int64_t)(ca_double_bits(value + 0x1.8p52) - ca_double_bits(0x1.8p52));
}

void ca_pass_sums_add_features(ca_pass_sums *sums, const float value[CA_PASS_FEATURES], const double scale[3])
{
    for (int i = 0; i < CA_PASS_FEATURES; i++) {
        const double units = (double)value[i] * scale[i / 3];
        sums->features[i] += nearest(fabs(units) <= 0x1p32 ? units : 0.0);
    }
}

void ca_pass_sums_close_group(ca_pass_sums *sums, ca_group_sums *group, uint32_t samples)
{
    double value[4], squares[4], cubes[CA_PASS_SUMS] = {0.0};
    for (int c = 0; c < 3; c++) {
        value[c] = group->open[c] / samples;
        group->open[c] = 0.0;
    }
    value[3] = 0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2];
    for (int c = 0; c < 4; c++) {
        squares[c] = value[c] * value[c];
        cubes[CA_PASS_CUBES + c] = squares[c] * value[c];
    }
    const ca_binned_sums of_group = binned_group(group), of_pixel = binned(sums);
    ca_binned_sums_add(&of_group, squares);
    ca_binned_sums_add(&of_pixel, cubes);
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
    ca_pass_sums copy = *sums;
    const ca_binned_sums from = binned(&copy);
    return ca_binned_sums_value(&from, i);
}

double ca_group_sums_value(const ca_group_sums *sums, int i)
{
    ca_group_sums copy = *sums;
    const ca_binned_sums from = binned_group(&copy);
    return ca_binned_sums_value(&from, i);
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
static bool are_sums(const int64_t *values, int count, uint32_t terms, int64_t most)
{
    bool good = true;
    for (int i = 0; i < count; i++) good = good && values[i] <= terms * most && values[i] >= -(terms * most);
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
