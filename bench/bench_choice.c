/* Choosing among n triangles by one number of a sequence whose remainder says where in the triangle: inversion with a
 * guide table (src/sampling/distribution.h) against an alias table, which is only here. What a choice costs, and the
 * variance of a mean over 64 of them, for each sampler. Prints a table; decision 014 quotes it. */
#include "base/clock.h"
#include "base/memory.h"
#include "sampling/distribution.h"
#include "sampling/sampler.h"

#include <math.h>
#include <stdio.h>

enum { SAMPLES = 64, REPLICATES = 4000, DRAWS = 20000000 };

typedef struct alias_table {
    uint32_t count;
    float *keep; /* probability of the column's own bin */
    uint32_t *other;
} alias_table;

static uint32_t alias_sample(const alias_table *table, float u, float *remapped)
{
    const float scaled = u * (float)table->count;
    uint32_t column = (uint32_t)scaled;
    if (column >= table->count) column = table->count - 1;
    const float inside = scaled - (float)column, keep = table->keep[column];
    if (inside < keep) {
        *remapped = inside / keep;
        return column;
    }
    *remapped = (inside - keep) / (1.0f - keep);
    return table->other[column];
}

/* Columns below the mean are filled up from columns above it. */
static void alias_create(alias_table *table, const float *weights, uint32_t count)
{
    *table = (alias_table){count, ca_alloc(count, sizeof(float)), ca_alloc(count, sizeof(uint32_t))};
    double *share = ca_alloc(count, sizeof *share), sum = 0.0;
    uint32_t *small = ca_alloc(count, sizeof *small), *large = ca_alloc(count, sizeof *large), s = 0, l = 0;
    if (!table->keep || !table->other || !share || !small || !large) return;
    for (uint32_t i = 0; i < count; i++) sum += (double)weights[i];
    for (uint32_t i = 0; i < count; i++) {
        share[i] = (double)weights[i] * count / sum;
        if (share[i] < 1.0)
            small[s++] = i;
        else
            large[l++] = i;
    }
    while (s > 0 && l > 0) {
        const uint32_t a = small[--s], b = large[l - 1];
        table->keep[a] = (float)share[a];
        table->other[a] = b;
        share[b] -= 1.0 - share[a];
        if (share[b] < 1.0) small[s++] = b, l--;
    }
    while (l > 0) table->keep[large[--l]] = 1.0f;
    while (s > 0) table->keep[small[--s]] = 1.0f;
    ca_free(share);
    ca_free(small);
    ca_free(large);
}

typedef struct choices {
    ca_distribution_1d guided;
    alias_table alias;
} choices;

static uint32_t choose(const choices *c, bool by_alias, float u, float *remapped)
{
    float probability;
    return by_alias ? alias_sample(&c->alias, u, remapped)
                    : ca_distribution_1d_sample(&c->guided, u, &probability, remapped);
}

/* Light from a strip of triangles in a row, smaller towards one end: a smooth function of the place. */
static double mean_of_samples(const choices *c, bool by_alias, const ca_sampler *sampler, uint32_t replicate)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        const ca_stream stream = ca_stream_start(sampler, replicate, i);
        float inside;
        const ca_vec2 u = ca_sample_2d(&stream, ca_vertex_dimension(0) + CA_DIM_NEXT_EVENT);
        const uint32_t bin = choose(c, by_alias, u.x, &inside);
        const double start = (double)c->guided.cumulative[bin], end = (double)c->guided.cumulative[bin + 1];
        const double x = start + (double)inside * (end - start);
        sum += 1.0 / ((x - 0.3) * (x - 0.3) + 0.05 + 0.2 * (double)u.y);
    }
    return sum / SAMPLES;
}

static double variance(const choices *c, bool by_alias, const ca_sampler *sampler)
{
    double sum = 0.0, squares = 0.0;
    for (uint32_t r = 0; r < REPLICATES; r++) {
        const double mean = mean_of_samples(c, by_alias, sampler, r);
        sum += mean;
        squares += mean * mean;
    }
    return squares / REPLICATES - sum / REPLICATES * (sum / REPLICATES);
}

static double nanoseconds(const choices *c, bool by_alias)
{
    const double start = ca_clock_thread_seconds();
    uint32_t random = 1;
    float sum = 0.0f, inside;
    for (uint32_t i = 0; i < DRAWS; i++) {
        random = random * 747796405u + 2891336453u;
        sum += (float)choose(c, by_alias, (float)(random >> 8) * 0x1p-24f, &inside) + inside;
    }
    const double seconds = ca_clock_thread_seconds() - start;
    return sum < 0.0f ? 0.0 : 1e9 * seconds / DRAWS; /* the sum is used, so that the loop stays */
}

int main(void)
{
    static const ca_sampler_kind kinds[] = {CA_SAMPLER_INDEPENDENT, CA_SAMPLER_SOBOL, CA_SAMPLER_HALTON};
    printf("%10s %10s %12s %14s %14s %14s\n", "triangles", "table", "ns", "independent", "sobol", "halton");
    for (uint32_t count = 16; count <= 1u << 20; count *= 16) {
        choices c;
        float *weights = ca_alloc(count, sizeof *weights);
        if (!weights) return 1;
        for (uint32_t i = 0; i < count; i++) {
            const float x = (float)i / (float)count;
            weights[i] = 1.0f + 999.0f * x * x;
        }
        if (ca_distribution_1d_create(&c.guided, weights, count, NULL) != CA_OK) return 1;
        alias_create(&c.alias, weights, count);
        for (int alias = 0; alias < 2; alias++) {
            printf("%10u %10s %12.1f", count, alias ? "alias" : "guide", nanoseconds(&c, alias));
            for (int k = 0; k < 3; k++) {
                ca_sampler sampler = {.kind = kinds[k]};
                ca_sampler_prepare(&sampler, 64, 64);
                printf(" %14.3e", variance(&c, alias, &sampler));
            }
            printf("\n");
        }
        ca_distribution_1d_destroy(&c.guided);
        ca_free(c.alias.keep);
        ca_free(c.alias.other);
        ca_free(weights);
    }
    return 0;
}
