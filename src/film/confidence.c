#include "film/confidence.h"

#include "base/loading.h"
#include "base/parallel.h"
#include "math/numeric.h"
#include "metrics/significance.h"

#include <math.h>
#include <string.h>

/* ---- Moments --------------------------------------------------------------------------------------------------- */

ca_moments ca_moments_of(double sum, double sum_squares, double sum_cubes, uint32_t replicates)
{
    const double n = replicates;
    ca_moments m = {.replicates = replicates};
    if (replicates == 0) return m;
    m.mean = sum / n;
    if (replicates < 3) {
        m.variance = replicates < 2 ? 0.0 : fmax(0.0, (sum_squares - sum * m.mean) / (n - 1.0));
        return m;
    }
    const double squares = sum_squares / n - m.mean * m.mean;
    const double cubes = sum_cubes / n - 3.0 * m.mean * sum_squares / n + 2.0 * m.mean * m.mean * m.mean;
    /* A sum of n terms is rounded n times, by 2^-53 of it at most; the differences above hold up to six of them. Or
     * each term is, by 2^-48 (binned_sum.h). */
    const double rounding = fmax(n * 0x1p-50, 0x1p-45), size = fabs(m.mean);
    if (squares > rounding * size * size) m.variance = squares * n / (n - 1.0);
    if (m.variance > 0.0 && fabs(cubes) > rounding * size * size * size)
        m.third = cubes * n * n / ((n - 1.0) * (n - 2.0));
    return m;
}

/* ---- Intervals ------------------------------------------------------------------------------------------------- */

double ca_student_two_sided_quantile(double alpha, double degrees)
{
    double low = 0.0, high = 1.0;
    while (ca_student_two_sided_p(high, degrees) > alpha && high < 1e300) high *= 2.0;
    for (int i = 0; i < 200 && high - low > 1e-14 * high; i++) {
        const double middle = 0.5 * (low + high);
        if (ca_student_two_sided_p(middle, degrees) > alpha)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

/* With a = skewness / sqrt(n), the first term by which the distribution of T = sqrt(n) (mean - expectation) /
 * deviation differs from the normal one is a (2 T^2 + 1) / 6 (its Edgeworth expansion): T + a T^2 / 3 + a / 6 has
 * none of order a. One more term, of order a^2, completes the cube and makes it grow everywhere (Hall's
 * transformation): g(T) = T + a T^2 / 3 + a^2 T^3 / 27 + a / 6 = ((1 + a T / 3)^3 - 1) / a + a / 6. This is the
 * inverse. */
static double unskew(double quantile, double a)
{
    if (fabs(a) < 1e-6) return quantile - a * (quantile * quantile / 3.0 + 1.0 / 6.0);
    return 3.0 / a * (cbrt(1.0 + a * (quantile - a / 6.0)) - 1.0);
}

/* In standard errors, from the mean to the limit on the long tail's side, where g is of no use: its slope there falls
 * to 0, and with four contributions the limit is past that. k = 1 / a^2 equal rare contributions, whose number is
 * Poisson distributed, have this skewness; their expectation's exact limit is the gamma quantile of shape k + 1, by
 * Wilson and Hilferty's cube (k + 1) (1 + u)^3,  u = quantile / (3 sqrt(k + 1)) - 1 / (9 (k + 1)), of which k is
 * taken, and which is divided by sqrt(k); written so that nothing cancels where a is small. a >= 0. */
static double tail_reach(double quantile, double a)
{
    const double m = 1.0 + a * a, slope = quantile / (3.0 * sqrt(m)) - a / (9.0 * m), u = a * slope;
    return a + m * slope * (3.0 + u * (3.0 + u));
}

ca_interval ca_confidence_interval(const ca_moments *m, double quantile)
{
    const double rounding = 0x1p-21 * fabs(m->mean);
    if (m->variance == 0.0) return (ca_interval){m->mean - rounding, m->mean + rounding};
    const double n = m->replicates, deviation = sqrt(m->variance);
    const double standard_error = deviation / sqrt(n);
    const double skewness = m->third / (m->variance * deviation);
    const double a = fabs(skewness) / sqrt(n);
    const double tail = tail_reach(quantile, a) * standard_error, other = unskew(quantile, a) * standard_error;
    const double low = m->mean - (skewness < 0.0 ? tail : other), high = m->mean + (skewness < 0.0 ? other : tail);
    return (ca_interval){fmin(low, m->mean - rounding), fmax(high, m->mean + rounding)};
}

ca_interval ca_confidence_judged_interval(const ca_moments *m, const ca_verdict *verdict, double quantile)
{
    if (verdict->kind == CA_INTERVAL_MARKED) return (ca_interval){-HUGE_VAL, HUGE_VAL};
    ca_interval interval = ca_confidence_interval(m, quantile);
    if (verdict->kind == CA_INTERVAL_ORDINARY) return interval;
    double reach[2] = {m->mean - interval.low, interval.high - m->mean};
    for (int side = CA_BELOW; side <= CA_ABOVE; side++)
        reach[side] =
            hypot(reach[side], quantile * sqrt(verdict->variance[side] / m->replicates)) + verdict->lone[side];
    return (ca_interval){m->mean - reach[CA_BELOW], m->mean + reach[CA_ABOVE]};
}

/* With a = 1 / (9 (k + 1)) and b = 1 / (9 k), the cube roots of gamma variables of shapes k + 1 and k, each over its
 * shape, are nearly normal, with the means 1 - a and 1 - b and the variances a and b (Wilson and Hilferty). r^3 is
 * the quantile of their quotient where r (1 - b) - (1 - a) = z sqrt(a + r^2 b) (Paulson 1942), a quadratic equation;
 * (1 - b)^2 > z^2 b for each k >= 1. */
double ca_confidence_lone_limit(double sum, double squares)
{
    if (squares == 0.0) return 0.0;
    const double z = 1.6448536269514722, k = fmax(1.0, sum * (sum / squares));
    const double a = 1.0 / (9.0 * (k + 1.0)), b = 1.0 / (9.0 * k), p = 1.0 - a, q = 1.0 - b;
    const double r = (p * q + z * sqrt(q * q * a + p * p * b - z * z * a * b)) / (q * q - z * z * b);
    return sum * (k + 1.0) / k * (r * r * r);
}

static float round_down(double value)
{
    return (double)(float)value > value ? nextafterf((float)value, -INFINITY) : (float)value;
}

void ca_interval_round(ca_interval interval, float *low, float *high)
{
    *low = round_down(interval.low);
    *high = -round_down(-interval.high);
}

/* ---- Verdicts -------------------------------------------------------------------------------------------------- */

/* Sums over the pixels near one. Moments and standard errors are relative to each one's level; a black pixel has none
 * and is not lit. Scatter: variances by their side, not relative. */
enum { VARIANCE, THIRD, ERROR, SCATTER, LIT = SCATTER + 2, VARYING, UNCERTAIN, NEAR_SUMS };
/* Sums over those within the far reach: what lone contributions bring by their side, and the squares of that. */
enum { LONE, SQUARES = LONE + 2, FAR_SUMS = SQUARES + 2 };

static void pool_moments(double sums[NEAR_SUMS], const ca_moments *m)
{
    const double level = fabs(m->mean);
    sums[VARYING] += m->variance > 0.0;
    sums[UNCERTAIN] += m->uncertain;
    if (m->third <= 0.0) sums[SCATTER + CA_BELOW] += m->variance;
    if (m->third >= 0.0) sums[SCATTER + CA_ABOVE] += m->variance;
    sums[LIT] += level > 0.0;
    if (level == 0.0 || m->variance == 0.0) return;
    const double inverse = 1.0 / level, variance = m->variance * inverse * inverse;
    sums[VARIANCE] += variance;
    sums[THIRD] += m->third * inverse * inverse * inverse;
    if (m->replicates > 0) sums[ERROR] += sqrt(variance / m->replicates);
}

/* With third / variance for a contribution's size h, its probability is variance / h^2. */
static double contributions_of(double variance, double third, double replicates)
{
    const double inverse_size = variance / fabs(third);
    return replicates * variance * inverse_size * inverse_size;
}

/* What a pixel owes to less than two contributions. */
static double lone_part(const ca_moments *m)
{
    if (m->third == 0.0 || contributions_of(m->variance, m->third, m->replicates) >= 2.0) return 0.0;
    return m->variance * (m->variance / fabs(m->third));
}

static void pool_lone(double sums[FAR_SUMS], const ca_moments *m)
{
    const double lone = lone_part(m);
    const int side = m->third < 0.0 ? CA_BELOW : CA_ABOVE;
    sums[LONE + side] += lone;
    sums[SQUARES + side] += lone * lone;
}

/* First pixel within reach of `at`, and last one of `count`. */
static uint32_t reach_from(uint32_t at, uint32_t reach) { return at > reach ? at - reach : 0; }
static uint32_t reach_to(uint32_t at, uint32_t reach, uint32_t count)
{
    return at + reach < count ? at + reach : count - 1;
}

/* `others`: pixels near this one; `far`: those within the far reach, which bring `lone` together. */
static bool is_ordinary(const ca_moments *m, const double near[NEAR_SUMS], double others, double lone, double far)
{
    if (m->replicates < CA_CONFIDENCE_MIN_REPLICATES || m->uncertain) return false;
    if (near[UNCERTAIN] * CA_CONFIDENCE_UNCERTAIN > others) return false;
    if (m->variance == 0.0) return near[VARYING] == 0.0;
    if (m->mean == 0.0) return true;
    const double own_error = sqrt(m->variance / m->replicates) / fabs(m->mean);
    const double near_error = near[VARYING] > 0.0 ? near[ERROR] / near[VARYING] : own_error;
    const double harm = 0.5 * fmin(own_error, near_error);
    if (lone / far / fabs(m->mean) > harm) return false;
    if (near[THIRD] == 0.0) return true;
    const double variance = near[VARIANCE] / near[LIT], third = near[THIRD] / near[LIT];
    return contributions_of(variance, third, m->replicates) >= CA_CONFIDENCE_CONTRIBUTIONS ||
           variance * (variance / fabs(third)) <= harm;
}

/* Pixels of width x height within reach of (x, y), which is one of them. */
static double window_pixels(uint32_t width, uint32_t height, uint32_t x, uint32_t y, uint32_t reach)
{
    const uint32_t columns = 1 + reach_to(x, reach, width) - reach_from(x, reach),
                   rows = 1 + reach_to(y, reach, height) - reach_from(y, reach);
    return (double)columns * rows;
}

/* Of pixel (x, y), whose moments are `own`. near: without the pixel itself. */
static void judge(const ca_confidence_pixels *p, const ca_moments *own, double near[NEAR_SUMS],
                  const double far[FAR_SUMS], uint32_t x, uint32_t y, ca_verdict *verdict)
{
    const double others = window_pixels(p->width, p->height, x, y, CA_CONFIDENCE_REACH) - 1.0,
                 far_pixels = window_pixels(p->width, p->height, x, y, CA_CONFIDENCE_FAR_REACH);
    const bool alone = near[LIT] == 0.0 && own->mean != 0.0;
    if (near[LIT] == 0.0) pool_moments(near, own);
    *verdict = (ca_verdict){.kind = CA_INTERVAL_ORDINARY};
    if (is_ordinary(own, near, others, far[LONE + CA_BELOW] + far[LONE + CA_ABOVE], far_pixels)) return;
    verdict->kind = CA_INTERVAL_MARKED;
    if (alone || own->replicates < CA_CONFIDENCE_MIN_REPLICATES || (own->uncertain && near[VARYING] <= 0.5 * others))
        return;
    verdict->kind = CA_INTERVAL_WIDENED;
    for (int side = CA_BELOW; side <= CA_ABOVE; side++) {
        verdict->variance[side] = near[SCATTER + side] / others;
        verdict->lone[side] = ca_confidence_lone_limit(far[LONE + side], far[SQUARES + side]) / far_pixels;
    }
}

/* ---- Tiles ----------------------------------------------------------------------------------------------------- */

/* A tile is judged row by row, all channels of a row together. Of the rows around the one that is judged, moments and
 * sums along the row are kept in rings, each sum's for all columns together, so that they are added up for several
 * pixels at once. Tiles are narrow for the rings to be small, and high for few rows to be entered twice. */
enum {
    TILE = 64, /* columns */
    TILE_ROWS = 256,
    NEAR_ROWS = 2 * CA_CONFIDENCE_REACH + 1,
    FAR_ROWS = 2 * CA_CONFIDENCE_FAR_REACH + 1,
    NEAR_COLUMNS = TILE + 2 * CA_CONFIDENCE_REACH,
    FAR_COLUMNS = TILE + 2 * CA_CONFIDENCE_FAR_REACH,
    MOMENT_ROWS = CA_CONFIDENCE_FAR_REACH + 1 + CA_CONFIDENCE_REACH, /* a row is needed until the near ones have it */
};

/* Of one channel. Row y in place y % NEAR_ROWS, y % FAR_ROWS and y % MOMENT_ROWS. What is beside the image stays 0
 * in sums over one pixel. */
typedef struct tile_rows {
    double near_pixels[NEAR_ROWS][NEAR_SUMS][NEAR_COLUMNS], far_pixels[FAR_SUMS][FAR_COLUMNS];
    double near[NEAR_ROWS][NEAR_SUMS][TILE], far[FAR_ROWS][FAR_SUMS][TILE];
    bool has_lone[FAR_ROWS]; /* else the row's far sums are 0, and not written */
    ca_moments moments[MOMENT_ROWS][FAR_COLUMNS];
} tile_rows;

/* From x0, y0 to before x1, y1. */
typedef struct tile {
    uint32_t x0, y0, x1, y1;
} tile;

static uint32_t tile_columns(const ca_confidence_pixels *p) { return (p->width + TILE - 1) / TILE; }
static uint32_t tile_rows_of(const ca_confidence_pixels *p) { return (p->height + TILE_ROWS - 1) / TILE_ROWS; }

static tile tile_at(const ca_confidence_pixels *p, uint32_t task)
{
    const uint32_t columns = tile_columns(p), x0 = task % columns * TILE, y0 = task / columns * TILE_ROWS;
    return (tile){x0, y0, ca_min_u32(x0 + TILE, p->width), ca_min_u32(y0 + TILE_ROWS, p->height)};
}

/* Those of the pixel x of row y, which may lie beside the tile. */
static ca_moments *moments_at(tile_rows *rows, const tile *t, uint32_t x, uint32_t y)
{
    return &rows->moments[y % MOMENT_ROWS][x + CA_CONFIDENCE_FAR_REACH - t->x0];
}

/* sums[x] is the sum of row[x] over so many rows. A few columns at a time stay in registers. */
static void add_rows(double sums[TILE], const double *const *rows, int count)
{
    enum { COLUMNS = 16 };
    for (int x0 = 0; x0 < TILE; x0 += COLUMNS) {
        double sum[COLUMNS] = {0.0};
        for (int i = 0; i < count; i++)
            for (int x = 0; x < COLUMNS; x++) sum[x] += rows[i][x0 + x];
        memcpy(sums + x0, sum, sizeof sum);
    }
}

/* sums[x] is the sum of so many values from values[x] on. */
static void add_along_row(double sums[TILE], const double *values, int count)
{
    const double *rows[FAR_ROWS];
    for (int i = 0; i < count; i++) rows[i] = values + i;
    add_rows(sums, rows, count);
}

static void enter_near_row(tile_rows *rows, const ca_confidence_pixels *p, const tile *t, uint32_t y)
{
    const uint32_t place = y % NEAR_ROWS;
    const uint32_t last = reach_to(t->x1 - 1, CA_CONFIDENCE_REACH, p->width);
    for (uint32_t x = reach_from(t->x0, CA_CONFIDENCE_REACH); x <= last; x++) {
        double pixel[NEAR_SUMS] = {0.0};
        pool_moments(pixel, moments_at(rows, t, x, y));
        for (int k = 0; k < NEAR_SUMS; k++) rows->near_pixels[place][k][x + CA_CONFIDENCE_REACH - t->x0] = pixel[k];
    }
    for (int k = 0; k < NEAR_SUMS; k++) add_along_row(rows->near[place][k], rows->near_pixels[place][k], NEAR_ROWS);
}

static void enter_moments(tile_rows *channels, const ca_confidence_pixels *p, const tile *t, uint32_t y)
{
    const ca_pixel_run run = {.y = y,
                              .x0 = reach_from(t->x0, CA_CONFIDENCE_FAR_REACH),
                              .x1 = reach_to(t->x1 - 1, CA_CONFIDENCE_FAR_REACH, p->width) + 1};
    ca_moments *to[CA_CONFIDENCE_MOST_CHANNELS];
    for (uint32_t c = 0; c < p->channels; c++) to[c] = moments_at(&channels[c], t, run.x0, y);
    p->moments(p->user, &run, to);
}

static void enter_far_row(tile_rows *rows, const ca_confidence_pixels *p, const tile *t, uint32_t y)
{
    const uint32_t last = reach_to(t->x1 - 1, CA_CONFIDENCE_FAR_REACH, p->width);
    bool any = false;
    for (uint32_t x = reach_from(t->x0, CA_CONFIDENCE_FAR_REACH); x <= last; x++) {
        double pixel[FAR_SUMS] = {0.0};
        pool_lone(pixel, moments_at(rows, t, x, y));
        any = any || pixel[LONE + CA_BELOW] > 0.0 || pixel[LONE + CA_ABOVE] > 0.0;
        for (int k = 0; k < FAR_SUMS; k++) rows->far_pixels[k][x + CA_CONFIDENCE_FAR_REACH - t->x0] = pixel[k];
    }
    rows->has_lone[y % FAR_ROWS] = any;
    for (int k = 0; any && k < FAR_SUMS; k++)
        add_along_row(rows->far[y % FAR_ROWS][k], rows->far_pixels[k], FAR_ROWS);
}

/* Around each pixel of row y, without the pixel itself. */
static void sum_near(const tile_rows *rows, uint32_t height, uint32_t y, double sums[NEAR_SUMS][TILE])
{
    const uint32_t last = reach_to(y, CA_CONFIDENCE_REACH, height);
    for (int k = 0; k < NEAR_SUMS; k++) {
        const double *added[2 * NEAR_ROWS];
        int count = 0;
        for (uint32_t i = reach_from(y, CA_CONFIDENCE_REACH); i <= last; i++)
            if (i != y) added[count++] = rows->near[i % NEAR_ROWS][k];
        for (int i = 0; i < NEAR_ROWS; i++)
            if (i != CA_CONFIDENCE_REACH) added[count++] = rows->near_pixels[y % NEAR_ROWS][k] + i;
        add_rows(sums[k], added, count);
    }
}

static void sum_far(const tile_rows *rows, uint32_t height, uint32_t y, double sums[FAR_SUMS][TILE])
{
    const uint32_t last = reach_to(y, CA_CONFIDENCE_FAR_REACH, height);
    for (int k = 0; k < FAR_SUMS; k++) {
        const double *added[FAR_ROWS];
        int count = 0;
        for (uint32_t i = reach_from(y, CA_CONFIDENCE_FAR_REACH); i <= last; i++)
            if (rows->has_lone[i % FAR_ROWS]) added[count++] = rows->far[i % FAR_ROWS][k];
        add_rows(sums[k], added, count);
    }
}

static void judge_row(const ca_confidence_pixels *p, uint32_t channel, const tile *t, tile_rows *rows, uint32_t y,
                      uint32_t worker)
{
    const ca_pixel_run run = {.y = y, .x0 = t->x0, .x1 = t->x1};
    const ca_moments *own = moments_at(rows, t, t->x0, y);
    double near[NEAR_SUMS][TILE], far[FAR_SUMS][TILE];
    ca_verdict verdicts[TILE];
    sum_near(rows, p->height, y, near);
    sum_far(rows, p->height, y, far);
    for (uint32_t i = 0; i < run.x1 - run.x0; i++) {
        double near_pixel[NEAR_SUMS], far_pixel[FAR_SUMS];
        for (int k = 0; k < NEAR_SUMS; k++) near_pixel[k] = near[k][i];
        for (int k = 0; k < FAR_SUMS; k++) far_pixel[k] = far[k][i];
        judge(p, &own[i], near_pixel, far_pixel, run.x0 + i, y, &verdicts[i]);
    }
    p->take(p->user, &run, channel, own, verdicts, worker);
}

static void judge_tile(void *user, uint32_t task, uint32_t worker)
{
    const ca_confidence_pixels *p = user;
    const tile t = tile_at(p, task);
    uint32_t near_row = reach_from(t.y0, CA_CONFIDENCE_REACH), far_row = reach_from(t.y0, CA_CONFIDENCE_FAR_REACH);
    tile_rows channels[CA_CONFIDENCE_MOST_CHANNELS];
    memset(channels, 0, p->channels * sizeof *channels);
    for (uint32_t y = t.y0; y < t.y1; y++) {
        for (; far_row <= reach_to(y, CA_CONFIDENCE_FAR_REACH, p->height); far_row++) {
            enter_moments(channels, p, &t, far_row);
            for (uint32_t c = 0; c < p->channels; c++) enter_far_row(&channels[c], p, &t, far_row);
        }
        for (; near_row <= reach_to(y, CA_CONFIDENCE_REACH, p->height); near_row++)
            for (uint32_t c = 0; c < p->channels; c++) enter_near_row(&channels[c], p, &t, near_row);
        for (uint32_t c = 0; c < p->channels; c++) judge_row(p, c, &t, &channels[c], y, worker);
    }
}

ca_status ca_confidence_judge_pixels(ca_confidence_pixels *pixels, uint32_t threads, ca_error *error)
{
    ca_parallel_surely(threads, tile_columns(pixels) * tile_rows_of(pixels), judge_tile, pixels);
    return ca_loading_check(error);
}

/* ---- Arrays ---------------------------------------------------------------------------------------------------- */

typedef struct judged_arrays {
    const ca_moments *moments;
    ca_verdict *verdicts;
    uint32_t width;
} judged_arrays;

static void copy_moments(const void *user, const ca_pixel_run *run, ca_moments *const *to)
{
    const judged_arrays *arrays = user;
    memcpy(to[0], &arrays->moments[(size_t)run->y * arrays->width + run->x0], (run->x1 - run->x0) * sizeof **to);
}

static void copy_verdicts(void *user, const ca_pixel_run *run, uint32_t channel, const ca_moments *moments,
                          const ca_verdict *verdicts, uint32_t worker)
{
    (void)channel;
    (void)moments;
    (void)worker;
    const judged_arrays *arrays = user;
    memcpy(&arrays->verdicts[(size_t)run->y * arrays->width + run->x0], verdicts,
           (run->x1 - run->x0) * sizeof *verdicts);
}

ca_status ca_confidence_judge(const ca_moments *moments, uint32_t width, uint32_t height, uint32_t threads,
                              ca_verdict *verdicts, ca_error *error)
{
    judged_arrays arrays = {.moments = moments, .verdicts = verdicts, .width = width};
    ca_confidence_pixels pixels = {.width = width,
                                   .height = height,
                                   .channels = 1,
                                   .moments = copy_moments,
                                   .take = copy_verdicts,
                                   .user = &arrays};
    return ca_confidence_judge_pixels(&pixels, threads, error);
}
