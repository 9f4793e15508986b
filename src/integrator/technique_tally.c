#include "integrator/technique_tally.h"

#include "base/memory.h"
#include "sampling/sampler.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

enum {
    MOST_CELLS = 9000,
    CELL_PIXELS = 16, /* of a cell at least */
    REGION = 4        /* cells of a region's side */
};
/* Of the light of a class that hits are left with at least, about. */
#define LEAST_SHARE 0.1
/* How much noisier a group may be together with all than by itself. */
#define MOST_NOISIER 8.0

/* Bins are in the order of ca_technique_factors. */
enum {
    NEXT_EVENTS = CA_FACTOR_VERTICES * CA_FACTOR_LIGHTS,
    CONNECTIONS = NEXT_EVENTS + CA_FACTOR_VERTICES * CA_FACTOR_LIGHTS,
    MERGES = CONNECTIONS + CA_FACTOR_VERTICES * CA_FACTOR_VERTICES,
    BINS = MERGES + CA_FACTOR_VERTICES * CA_FACTOR_VERTICES
};
_Static_assert(sizeof(ca_technique_factors) == BINS * sizeof(float), "a factor for every bin");

/* What a class of techniques has brought to a cell. */
typedef struct bin {
    float now;               /* sum of this iteration */
    float sum, sum_squares;  /* of those sums */
    float sum_products;      /* of them and of all that they come with */
    float squares;           /* of single contributions */
    float weighted;          /* sum of this iteration, of weighted contributions ... */
    float weighted_sum, weighted_squares, weighted_products; /* ... of these sums, and with those of all bins */
} bin;

struct ca_technique_tally {
    uint32_t width, height, side; /* side of a cell, in pixels */
    uint32_t columns, rows;
    bin *bins; /* owned; [rows][columns][BINS]; splits first */
};

struct ca_factor_map {
    uint32_t columns, rows;
    float per_pixel;               /* regions */
    ca_technique_factors *factors; /* owned; [rows][columns] */
};

/* ---- Cells ----------------------------------------------------------------------------------------------------- */

static uint32_t parts(uint32_t whole, uint32_t side) { return (whole + side - 1) / side; }

ca_status ca_technique_tally_create(ca_technique_tally **tally, uint32_t width, uint32_t height, ca_error *error)
{
    uint32_t side = 1;
    while (side * side < CELL_PIXELS || (uint64_t)parts(width, side) * parts(height, side) > MOST_CELLS) side++;
    ca_technique_tally *created = ca_alloc(1, sizeof *created);
    *tally = created;
    if (!created) return ca_fail_memory(error, "the pilot of techniques");
    *created = (ca_technique_tally){width, height, side, parts(width, side), parts(height, side), NULL};
    created->bins = ca_alloc_zeroed((size_t)ca_technique_tally_cells(created) * BINS, sizeof *created->bins);
    return created->bins ? CA_OK : ca_fail_memory(error, "the pilot of techniques");
}

void ca_technique_tally_destroy(ca_technique_tally *tally)
{
    if (!tally) return;
    ca_free(tally->bins);
    ca_free(tally);
}

uint32_t ca_technique_tally_cells(const ca_technique_tally *tally) { return tally->columns * tally->rows; }

/* Anywhere in the cell, so that no pattern of the image goes unseen. */
void ca_technique_tally_pixel(const ca_technique_tally *tally, uint32_t cell, uint32_t *x, uint32_t *y)
{
    const uint64_t random = ca_pcg_permute(cell);
    const uint32_t in_x = (uint32_t)(random >> 8) % tally->side, in_y = (uint32_t)(random >> 36) % tally->side;
    *x = ca_min_u32(cell % tally->columns * tally->side + in_x, tally->width - 1);
    *y = ca_min_u32(cell / tally->columns * tally->side + in_y, tally->height - 1);
}

static bin *bins_of(const ca_technique_tally *tally, uint32_t cell) { return tally->bins + (size_t)cell * BINS; }

static uint32_t bin_number(ca_technique technique, uint32_t s, uint32_t t, uint32_t light)
{
    const uint32_t camera = ca_factor_vertices(s);
    switch (technique) {
    case CA_TECHNIQUE_HIT: return camera * CA_FACTOR_LIGHTS + light;
    case CA_TECHNIQUE_NEXT_EVENT: return NEXT_EVENTS + camera * CA_FACTOR_LIGHTS + light;
    case CA_TECHNIQUE_CONNECT: return CONNECTIONS + camera * CA_FACTOR_VERTICES + ca_factor_vertices(t);
    case CA_TECHNIQUE_MERGE: return MERGES + camera * CA_FACTOR_VERTICES + ca_factor_vertices(t - 1);
    case CA_TECHNIQUE_SPLAT:
    case CA_TECHNIQUE_COUNT: break;
    }
    return BINS;
}

void ca_technique_tally_add(ca_technique_tally *tally, uint32_t x, uint32_t y, ca_technique technique, uint32_t s,
                            uint32_t t, uint32_t light, float crowd, ca_rgb unweighted, float weight)
{
    const uint32_t number = bin_number(technique, s, t, light);
    if (number == BINS) return;
    bin *to = bins_of(tally, y / tally->side * tally->columns + x / tally->side) + number;
    const float value = (unweighted.r + unweighted.g + unweighted.b) / 3.0f;
    to->now += value;
    to->squares += crowd * ca_sqr(value);
    to->weighted += weight * value;
}

/* Classes come alone, but for next event's lights, of which it chooses one: they come together. */
static uint32_t classes_from(uint32_t first)
{
    return first >= NEXT_EVENTS && first < CONNECTIONS ? CA_FACTOR_LIGHTS : 1;
}

static void end_weighted(bin *bins)
{
    float all = 0.0f;
    for (uint32_t i = 0; i < BINS; i++) all += bins[i].weighted;
    for (uint32_t i = 0; i < BINS; i++) {
        bins[i].weighted_sum += bins[i].weighted;
        bins[i].weighted_squares += ca_sqr(bins[i].weighted);
        bins[i].weighted_products += bins[i].weighted * all;
        bins[i].weighted = 0.0f;
    }
}

void ca_technique_tally_end(ca_technique_tally *tally, uint32_t cell)
{
    bin *bins = bins_of(tally, cell);
    end_weighted(bins);
    for (uint32_t first = 0, count; first < BINS; first += count) {
        count = classes_from(first);
        float together = 0.0f;
        for (uint32_t i = first; i < first + count; i++) together += bins[i].now;
        for (uint32_t i = first; i < first + count; i++) {
            bins[i].sum += bins[i].now;
            bins[i].sum_squares += ca_sqr(bins[i].now);
            bins[i].sum_products += bins[i].now * together;
            bins[i].now = 0.0f;
        }
    }
}

/* ---- Factors --------------------------------------------------------------------------------------------------- */

/* Sums over cells, of moments relative to the square of the cell's light: of squares of single contributions, of
 * variances, of what a class has of the variance of all that it comes with (its covariance with them, which may be
 * negative); of weighted contributions, those of an iteration together: of their squares, of their variance, and of
 * their covariance with those of all classes; and the number of independent differences. */
typedef struct moments {
    double squares, variance, share, weighted_squares, weighted_variance, weighted_share, differences;
} moments;

/* A cell of which nothing is known. */
static bool is_dark(const bin *bins, double *light)
{
    *light = 0.0;
    for (uint32_t i = 0; i < BINS; i++) *light += (double)bins[i].weighted_sum;
    return !(*light > 0.0) || !isfinite(*light);
}

static double covariance(double products, double sum, double other, double n)
{
    return (products - sum * other / n) / (n - 1.0);
}

static void add_weighted(const bin *bins, double light, double n, moments *to)
{
    const double scale = pow(n / light, 2.0);
    for (uint32_t i = 0; i < BINS; i++) {
        const double sum = (double)bins[i].weighted_sum;
        to[i].weighted_squares += scale * (double)bins[i].weighted_squares / n;
        to[i].weighted_variance += scale * fmax(covariance((double)bins[i].weighted_squares, sum, sum, n), 0.0);
        to[i].weighted_share += scale * covariance((double)bins[i].weighted_products, sum, light, n);
    }
}

static void add_cells(const ca_technique_tally *tally, uint32_t cell, uint32_t iterations, moments *to)
{
    const bin *bins = bins_of(tally, cell);
    const double n = iterations;
    double light;
    if (is_dark(bins, &light)) return;
    const double scale = pow(n / light, 2.0);
    add_weighted(bins, light, n, to);
    for (uint32_t first = 0, count; first < BINS; first += count) {
        count = classes_from(first);
        double together = 0.0;
        for (uint32_t i = first; i < first + count; i++) together += (double)bins[i].sum;
        for (uint32_t i = first; i < first + count; i++) {
            const double sum = (double)bins[i].sum;
            to[i].squares += scale * (double)bins[i].squares / n;
            to[i].variance += scale * fmax(covariance((double)bins[i].sum_squares, sum, sum, n), 0.0);
            to[i].share += scale * covariance((double)bins[i].sum_products, sum, together, n);
            to[i].differences += n - 1.0;
        }
    }
}

/* Of each region's cells. */
static void sum_regions(const ca_technique_tally *tally, uint32_t iterations, uint32_t columns, moments *regions)
{
    for (uint32_t y = 0; y < tally->rows; y++)
        for (uint32_t x = 0; x < tally->columns; x++) {
            const uint32_t region = y / REGION * columns + x / REGION;
            add_cells(tally, y * tally->columns + x, iterations, regions + (size_t)region * BINS);
        }
}

/* With the neighbours, which count half across, down, and half of that across corners. */
static moments smoothed(const ca_factor_map *map, const moments *regions, uint32_t column, uint32_t row, uint32_t i)
{
    moments sum = {0};
    for (uint32_t y = row > 0 ? row - 1 : 0; y <= row + 1 && y < map->rows; y++)
        for (uint32_t x = column > 0 ? column - 1 : 0; x <= column + 1 && x < map->columns; x++) {
            const double weight = (y == row ? 1.0 : 0.5) * (x == column ? 1.0 : 0.5);
            const moments *of = &regions[(size_t)(y * map->columns + x) * BINS + i];
            sum.squares += weight * of->squares;
            sum.variance += weight * of->variance;
            sum.share += weight * of->share;
            sum.weighted_squares += weight * of->weighted_squares;
            sum.weighted_variance += weight * of->weighted_variance;
            sum.weighted_share += weight * of->weighted_share;
            sum.differences += weight * of->differences;
        }
    return sum;
}

/* What is in doubt of a mean of so many squares. */
static double doubt(moments of) { return of.squares / of.differences; }

/* Sums that a float could not hold tell nothing. */
static float factor_of(moments of, double noise)
{
    if (!(of.squares > 0.0) || !isfinite(of.squares) || !isfinite(noise)) return 1.0f;
    return (float)fmin(of.squares / noise, (double)FLT_MAX);
}

/* The variance that stands for next event's of one class of lights, where hits of that class take part in its light.
 * Next event asks one light: where it finds one it finds no other, and their noise cancels. With a variance V and a
 * share C of that of all lights, beside hits of variance H, the noise of all is least where hits have C / (H + V) of
 * the class' light: as if next event had H C / (H + V - C) and came alone. */
static double next_event_noise(moments of, moments hits)
{
    const double v = of.variance + doubt(of), c = of.share + doubt(of);
    if (!(c < v)) return v;
    if (!(hits.squares > 0.0)) return fmax(c, LEAST_SHARE * v);
    const double h = hits.variance + doubt(hits);
    return fmax(h * c / (h + v - c), LEAST_SHARE * fmin(h, v));
}

/* The classes that come together with that of a bin: all hits, or a technique after so many camera vertices. */
static uint32_t group_of(uint32_t i, uint32_t *count)
{
    *count = i < NEXT_EVENTS ? NEXT_EVENTS : i < CONNECTIONS ? CA_FACTOR_LIGHTS : CA_FACTOR_VERTICES;
    return i < NEXT_EVENTS ? 0 : i - (i - NEXT_EVENTS) % *count;
}

/* How much noisier a bin's group is together with all that the camera paths bring than its classes are alone. */
static double noisier_together(const moments *bins, uint32_t i)
{
    uint32_t count;
    const uint32_t first = group_of(i, &count);
    double alone = 0.0, together = 0.0, in_doubt = 0.0;
    for (uint32_t j = first; j < first + count; j++) {
        alone += bins[j].weighted_variance;
        together += bins[j].weighted_share;
        if (bins[j].differences > 0.0) in_doubt += bins[j].weighted_squares / bins[j].differences;
    }
    const double ratio = (together + in_doubt) / (alone + in_doubt);
    return ratio > 1.0 ? fmin(ratio, MOST_NOISIER) : 1.0;
}

static double noise_in_bin(const moments *bins, uint32_t i)
{
    if (i < NEXT_EVENTS || i >= CONNECTIONS) return bins[i].variance + doubt(bins[i]);
    const uint32_t camera = (i - NEXT_EVENTS) / CA_FACTOR_LIGHTS, light = (i - NEXT_EVENTS) % CA_FACTOR_LIGHTS;
    return next_event_noise(bins[i], bins[bin_number(CA_TECHNIQUE_HIT, camera + 1, 0, light)]);
}

static float factor_in_bin(const moments *bins, uint32_t i)
{
    const float alone = factor_of(bins[i], noise_in_bin(bins, i));
    return (i >= MERGES ? ca_min(alone, 1.0f) : alone) / (float)noisier_together(bins, i);
}

static void fill(ca_factor_map *map, const moments *regions, uint32_t column, uint32_t row)
{
    ca_technique_factors *factors = &map->factors[row * map->columns + column];
    moments bins[BINS];
    float of_bins[BINS];
    for (uint32_t i = 0; i < BINS; i++) bins[i] = smoothed(map, regions, column, row, i);
    for (uint32_t i = 0; i < BINS; i++) of_bins[i] = factor_in_bin(bins, i);
    memcpy(factors, of_bins, sizeof of_bins);
}

ca_status ca_factor_map_create(ca_factor_map **map, const ca_technique_tally *tally, uint32_t iterations,
                               ca_error *error)
{
    const uint32_t columns = parts(tally->columns, REGION), rows = parts(tally->rows, REGION);
    const size_t count = (size_t)columns * rows;
    ca_factor_map *created = *map = ca_alloc_zeroed(1, sizeof *created);
    moments *regions = ca_alloc_zeroed(count * BINS, sizeof *regions);
    if (created) {
        const float per_pixel = 1.0f / (float)(REGION * tally->side);
        *created = (ca_factor_map){columns, rows, per_pixel, ca_alloc(count, sizeof *created->factors)};
    }
    const bool fits = created && created->factors && regions;
    if (fits) {
        sum_regions(tally, iterations, columns, regions);
        for (uint32_t i = 0; i < count; i++) fill(created, regions, i % columns, i / columns);
    }
    ca_free(regions);
    return fits ? CA_OK : ca_fail_memory(error, "the techniques' factors");
}

void ca_factor_map_destroy(ca_factor_map *map)
{
    if (!map) return;
    ca_free(map->factors);
    ca_free(map);
}

static uint32_t region_of(float position, float per_pixel, uint32_t count)
{
    const float region = position * per_pixel;
    return region > 0.0f ? ca_min_u32((uint32_t)region, count - 1) : 0;
}

const ca_technique_factors *ca_factor_map_at(const ca_factor_map *map, ca_vec2 film)
{
    const uint32_t column = region_of(film.x, map->per_pixel, map->columns);
    return &map->factors[region_of(film.y, map->per_pixel, map->rows) * map->columns + column];
}

const ca_technique_factors *ca_factor_map_same(const ca_factor_map *map, const ca_factor_map *other,
                                               const ca_technique_factors *factors)
{
    assert(map->columns == other->columns && map->rows == other->rows);
    return map->factors + (factors - other->factors);
}
