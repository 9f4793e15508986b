#include "sampling/filter.h"

#include "math/exponential.h"

#include <stddef.h>

ca_filter ca_filter_default(ca_filter_kind kind)
{
    ca_filter filter = {.kind = kind};
    switch (kind) {
    case CA_RFILTER_BOX: filter.radius = 0.5f; break;
    case CA_RFILTER_TENT: filter.radius = 1.0f; break;
    case CA_RFILTER_GAUSSIAN:
        filter.stddev = 0.5f;
        filter.radius = 4.0f * filter.stddev;
        break;
    case CA_RFILTER_MITCHELL:
        filter.radius = 2.0f;
        filter.b = filter.c = 1.0f / 3.0f;
        break;
    case CA_RFILTER_CATMULL_ROM:
        filter.radius = 2.0f;
        filter.c = 0.5f;
        break;
    case CA_RFILTER_LANCZOS:
        filter.lobes = 3.0f;
        filter.radius = filter.lobes;
        break;
    }
    return filter;
}

/* Mitchell and Netravali's cubics with parameters B and C; Catmull-Rom is (0, 1/2). As Mitsuba 3's mitchell.cpp. */
static float cubic(float b, float c, float x)
{
    if (x < 1.0f)
        return (((12.0f - 9.0f * b - 6.0f * c) * x + (-18.0f + 12.0f * b + 6.0f * c)) * x * x + (6.0f - 2.0f * b)) /
               6.0f;
    return (((-b - 6.0f * c) * x + (6.0f * b + 30.0f * c)) * x * x + (-12.0f * b - 48.0f * c) * x +
            (8.0f * b + 24.0f * c)) /
           6.0f;
}

static float sinc(float x) { return fabsf(x) < 1e-4f ? 1.0f : sinf(CA_PI * x) / (CA_PI * x); }

static float gaussian(const ca_filter *filter, float x) { return ca_exp(-0.5f / ca_sqr(filter->stddev) * x * x); }

/* The filter as its formula says, x >= 0 and below the radius; formulae of Mitsuba 3's rfilters. */
static float shape_of(const ca_filter *filter, float x)
{
    switch (filter->kind) {
    case CA_RFILTER_BOX: return 1.0f;
    case CA_RFILTER_TENT: return 1.0f - x / filter->radius;
    case CA_RFILTER_GAUSSIAN: return ca_max(gaussian(filter, x) - filter->border, 0.0f);
    case CA_RFILTER_MITCHELL:
    case CA_RFILTER_CATMULL_ROM: return cubic(filter->b, filter->c, x * (2.0f / filter->radius));
    case CA_RFILTER_LANCZOS: return sinc(x) * sinc(x / filter->radius);
    }
    return 0.0f;
}

static float node_position(const ca_filter *filter, uint32_t node)
{
    return filter->radius * ((2.0f / CA_FILTER_TABLE) * (float)node - 1.0f);
}

/* Simpson's rule over half of the filter. */
static double integral_of(const ca_filter *filter)
{
    enum { INTERVALS = 1024 };
    const double width = (double)filter->radius / INTERVALS;
    double sum = 0.0;
    for (int i = 0; i <= INTERVALS; i++) {
        const double factor = i == 0 || i == INTERVALS ? 1.0 : (i & 1) ? 4.0 : 2.0;
        sum += factor * (double)shape_of(filter, (float)(i * width));
    }
    return 2.0 * sum * width / 3.0;
}

/* Mean of |f| around a node, weighted by a tent over its two intervals: of Lanczos, whose zeros may lie at
 * neighbouring nodes with a lobe between them that the values there know nothing of. */
static float mean_at(const ca_filter *filter, uint32_t node)
{
    enum { STEPS = 64 };
    const double x = (double)node_position(filter, node), width = 2.0 * (double)filter->radius / CA_FILTER_TABLE;
    double sum = 0.0;
    for (int i = 0; i < 2 * STEPS; i++) {
        const double offset = (i + 0.5) / STEPS - 1.0, distance = fabs(x + offset * width);
        if (distance < (double)filter->radius)
            sum += (1.0 - fabs(offset)) * (double)fabsf(shape_of(filter, (float)distance));
    }
    return (float)(sum / STEPS);
}

static float density_at(const ca_filter *filter, uint32_t node)
{
    if (filter->kind == CA_RFILTER_LANCZOS) return mean_at(filter, node);
    return fabsf(shape_of(filter, fabsf(node_position(filter, node))));
}

void ca_filter_prepare(ca_filter *filter)
{
    if (filter->kind == CA_RFILTER_LANCZOS) filter->radius = filter->lobes;
    filter->sampled_part = 1.0f;
    filter->border = filter->kind == CA_RFILTER_GAUSSIAN ? gaussian(filter, filter->radius) : 0.0f;
    filter->integral = (float)integral_of(filter);

    double cumulative[CA_FILTER_TABLE + 1] = {0.0};
    for (uint32_t i = 0; i <= CA_FILTER_TABLE; i++) filter->nodes[i] = density_at(filter, i);
    for (uint32_t i = 0; i < CA_FILTER_TABLE; i++)
        cumulative[i + 1] = cumulative[i] + (double)filter->nodes[i] + (double)filter->nodes[i + 1];
    const double total = cumulative[CA_FILTER_TABLE];
    const double density_scale = CA_FILTER_TABLE / (total * (double)filter->radius);
    for (uint32_t i = 0; i <= CA_FILTER_TABLE; i++) {
        filter->nodes[i] = (float)((double)filter->nodes[i] * density_scale);
        filter->cumulative[i] = (float)(cumulative[i] / total);
    }
    for (uint32_t cell = 0, i = 0; cell < CA_FILTER_GUIDE; cell++) {
        while (i + 1 < CA_FILTER_TABLE && filter->cumulative[i + 1] <= (float)cell / CA_FILTER_GUIDE) i++;
        filter->guide[cell] = (unsigned char)i;
    }
}

float ca_filter_eval(const ca_filter *filter, float x)
{
    const float distance = fabsf(x);
    return distance < filter->radius ? shape_of(filter, distance) / filter->integral : 0.0f;
}

/* ca_filter_eval of a gaussian, eight at a time. */
static ca_f8 eval_gaussian8(const ca_filter *filter, ca_f8 x)
{
    const ca_f8 distance = ca_abs8(x), zero = ca_f8_all(0.0f);
    const ca_f8 height = ca_exp8(-0.5f / ca_sqr(filter->stddev) * distance * distance) - filter->border;
    return ca_select8(distance < filter->radius, ca_max8(height, zero) / filter->integral, zero);
}

void ca_filter_eval_run(const ca_filter *filter, float x, uint32_t count, float *values)
{
    static const ca_f8 steps = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};
    if (filter->kind == CA_RFILTER_GAUSSIAN)
        for (uint32_t i = 0; i < count; i += CA_LANES)
            ca_store8_anywhere(values + i, eval_gaussian8(filter, (x - (float)i) - steps));
    else
        for (uint32_t i = 0; i < count; i++) values[i] = ca_filter_eval(filter, x - (float)i);
}

/* Interval of the table that holds u, from the one where u's cell of the guide begins. Few cells hold an
 * end of an interval, so the loop seldom takes a step, and the branch is predicted. */
static uint32_t find_interval(const ca_filter *filter, float u)
{
    uint32_t i = filter->guide[(uint32_t)(u * CA_FILTER_GUIDE)];
    while (i + 1 < CA_FILTER_TABLE && filter->cumulative[i + 1] <= u) i++;
    return i;
}

/* Inverts the integral of the piecewise-linear density: within an interval with densities a and b at its ends, the
 * mass up to t of it is proportional to a t + (b - a) t^2 / 2. The density used is |f| up to the curvature between
 * nodes (of Lanczos also up to its lobes, where these are as narrow as two intervals), so that weights are nearly +1
 * and -1 (times a constant), and their mean is exactly 1. */
static float sample_table(const ca_filter *filter, float u, float *weight)
{
    const uint32_t i = find_interval(filter, u);
    const float a = filter->nodes[i], b = filter->nodes[i + 1];
    const float inside = (u - filter->cumulative[i]) / (filter->cumulative[i + 1] - filter->cumulative[i]);
    const float mass = inside * (a + b);
    const float root = a + sqrtf(ca_sqr(a) + mass * (b - a));
    const float t = root > 0.0f ? ca_min(mass / root, 1.0f) : 0.0f;
    const float x = filter->radius * ((2.0f / CA_FILTER_TABLE) * ((float)i + t) - 1.0f);
    const float density = a + t * (b - a);
    *weight = density > 0.0f ? ca_filter_eval(filter, x) / density : 0.0f;
    return x;
}

static float sample_axis(const ca_filter *filter, float u, float *weight)
{
    *weight = 1.0f;
    switch (filter->kind) {
    case CA_RFILTER_BOX: return filter->radius * (2.0f * u - 1.0f);
    case CA_RFILTER_TENT:
        return u < 0.5f ? filter->radius * (sqrtf(2.0f * u) - 1.0f)
                        : filter->radius * (1.0f - sqrtf(2.0f - 2.0f * u));
    default: return sample_table(filter, u, weight);
    }
}

/* Eight entries of the table, from entry[k] + step on. */
static ca_f8 table8(const float *table, const uint32_t *entry, uint32_t step)
{
    ca_f8 v;
    for (int k = 0; k < CA_LANES; k++) v[k] = table[entry[k] + step];
    return v;
}

/* sample_table, eight at a time. */
static void sample_gaussian8(const ca_filter *filter, float *u, float *weight)
{
    uint32_t interval[CA_LANES];
    ca_f8 first;
    for (int k = 0; k < CA_LANES; k++) {
        interval[k] = find_interval(filter, u[k]);
        first[k] = (float)interval[k];
    }
    const ca_f8 a = table8(filter->nodes, interval, 0), b = table8(filter->nodes, interval, 1);
    const ca_f8 below = table8(filter->cumulative, interval, 0), above = table8(filter->cumulative, interval, 1);
    const ca_f8 inside = (ca_load8_anywhere(u) - below) / (above - below), zero = ca_f8_all(0.0f);
    const ca_f8 mass = inside * (a + b);
    const ca_f8 root = a + ca_sqrt8(a * a + mass * (b - a));
    const ca_f8 t = ca_select8(root > zero, ca_min8(mass / root, ca_f8_all(1.0f)), zero);
    const ca_f8 x = filter->radius * ((2.0f / CA_FILTER_TABLE) * (first + t) - 1.0f);
    const ca_f8 density = a + t * (b - a);
    ca_store8_anywhere(u, x);
    ca_store8_anywhere(weight, ca_select8(density > zero, eval_gaussian8(filter, x) / density, zero));
}

void ca_filter_sample_axis(const ca_filter *filter, uint32_t count, float *u, float *weight)
{
    uint32_t i = 0;
    if (filter->kind == CA_RFILTER_GAUSSIAN)
        for (; i + CA_LANES <= count; i += CA_LANES) sample_gaussian8(filter, u + i, weight + i);
    for (; i < count; i++) u[i] = sample_axis(filter, u[i], &weight[i]);
    for (i = 0; i < count; i++) u[i] *= filter->sampled_part;
}

ca_vec2 ca_filter_sample(const ca_filter *filter, ca_vec2 u, float *weight)
{
    float weight_x, weight_y;
    const ca_vec2 offset = {sample_axis(filter, u.x, &weight_x), sample_axis(filter, u.y, &weight_y)};
    *weight = weight_x * weight_y;
    return (ca_vec2){filter->sampled_part * offset.x, filter->sampled_part * offset.y};
}

const char *ca_filter_name(ca_filter_kind kind)
{
    static const char *const names[] = {
        [CA_RFILTER_BOX] = "box",
        [CA_RFILTER_TENT] = "tent",
        [CA_RFILTER_GAUSSIAN] = "gaussian",
        [CA_RFILTER_MITCHELL] = "mitchell",
        [CA_RFILTER_CATMULL_ROM] = "catmullrom",
        [CA_RFILTER_LANCZOS] = "lanczos",
    };
    return (size_t)kind < sizeof names / sizeof names[0] ? names[kind] : NULL;
}
