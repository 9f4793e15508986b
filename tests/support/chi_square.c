#include "support/chi_square.h"

#include "math/numeric.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/* ---- Distributions --------------------------------------------------------------------------------------------- */

/* Series for P(a, x), converges fast for x < a + 1. */
static double gamma_p_series(double a, double x)
{
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < 10000 && term > sum * 1e-15; ++n) {
        term *= x / (a + n);
        sum += term;
    }
    return sum * exp(-x + a * log(x) - lgamma(a));
}

/* Continued fraction for Q(a, x), x >= a + 1, by the modified Lentz method. */
static double gamma_q_fraction(double a, double x)
{
    const double tiny = 1e-300;
    double b = x + 1.0 - a, c = 1.0 / tiny, d = 1.0 / b, h = d;
    for (int n = 1; n < 10000; ++n) {
        const double numerator = -n * (n - a);
        b += 2.0;
        d = numerator * d + b;
        d = 1.0 / (fabs(d) < tiny ? tiny : d);
        c = b + numerator / c;
        c = fabs(c) < tiny ? tiny : c;
        const double factor = c * d;
        h *= factor;
        if (fabs(factor - 1.0) < 1e-15) break;
    }
    return h * exp(-x + a * log(x) - lgamma(a));
}

double ca_gamma_q(double a, double x)
{
    if (x <= 0.0) return 1.0;
    return x < a + 1.0 ? 1.0 - gamma_p_series(a, x) : gamma_q_fraction(a, x);
}

double ca_sidak_level(double significance, uint32_t test_count)
{
    return -expm1(log1p(-significance) / (test_count > 0 ? test_count : 1));
}

double ca_chi_square_counts(const double *observed, const double *expected, uint32_t count, double *statistic,
                            uint32_t *degrees_of_freedom)
{
    double sum = 0.0, pooled_observed = 0.0, pooled_expected = 0.0;
    uint32_t bins = 0;
    for (uint32_t i = 0; i < count; ++i) {
        if (expected[i] < 5.0) {
            pooled_observed += observed[i];
            pooled_expected += expected[i];
            continue;
        }
        const double difference = observed[i] - expected[i];
        sum += difference * difference / expected[i];
        ++bins;
    }
    /* What stays below 5 even together is compared only for what must not be: counts where next to none belong. */
    if (pooled_expected >= 5.0 || pooled_observed > 20.0) {
        const double difference = pooled_observed - pooled_expected;
        sum += difference * difference / fmax(pooled_expected, 1.0);
        ++bins;
    }
    const uint32_t freedom = bins > 1 ? bins - 1 : 0;
    if (statistic) *statistic = sum;
    if (degrees_of_freedom) *degrees_of_freedom = freedom;
    if (freedom == 0) return pooled_observed > 20.0 && pooled_expected < 5.0 ? 0.0 : 1.0;
    return ca_gamma_q(0.5 * freedom, 0.5 * sum);
}

/* ---- Bins of directions ---------------------------------------------------------------------------------------- */

typedef struct bin_grid {
    uint32_t rings, cuts;
    double s[3], t[3], n[3]; /* frame of the axis */
    double *theta_edges;     /* [rings + 1] from 0 to pi */
    double *phi_edges;       /* [rings * (cuts + 1)], each from -pi to pi */
} bin_grid;

typedef struct polar {
    double theta, phi;
} polar;

/* All in double precision, and not from arc cosines, so that narrow peaks around the axis keep their digits. */
static polar polar_of(const bin_grid *grid, ca_vec3 direction)
{
    const double d[3] = {(double)direction.x, (double)direction.y, (double)direction.z};
    double x = 0.0, y = 0.0, z = 0.0;
    for (int i = 0; i < 3; ++i) {
        x += grid->s[i] * d[i];
        y += grid->t[i] * d[i];
        z += grid->n[i] * d[i];
    }
    return (polar){atan2(hypot(x, y), z), atan2(y, x)};
}

static ca_vec3 direction_of(const bin_grid *grid, double x, double y, double z)
{
    double d[3];
    for (int i = 0; i < 3; ++i) d[i] = grid->s[i] * x + grid->t[i] * y + grid->n[i] * z;
    return (ca_vec3){(float)d[0], (float)d[1], (float)d[2]};
}

static void set_axis(bin_grid *grid, ca_vec3 axis)
{
    double n[3] = {(double)axis.x, (double)axis.y, (double)axis.z};
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; ++i) grid->n[i] = length > 0.0 ? n[i] / length : (i == 2);
    const double *a = grid->n;
    const int k = fabs(a[0]) < 0.6 ? 0 : 1; /* a coordinate axis well away from n */
    double dot = a[k], s[3];
    for (int i = 0; i < 3; ++i) s[i] = (i == k) - dot * a[i];
    const double scale = 1.0 / sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    for (int i = 0; i < 3; ++i) grid->s[i] = s[i] * scale;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        grid->t[i] = a[j] * grid->s[l] - a[l] * grid->s[j];
    }
}

static int compare_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int compare_theta(const void *a, const void *b)
{
    return compare_double(&((const polar *)a)->theta, &((const polar *)b)->theta);
}

/* Edges between `low` and `high` at the quantiles of sorted values. The first and the last bin begin well outside of
 * all values, so that no tail of a narrow peak shares a bin with a wide empty range that quadrature would step
 * over. */
static void quantile_edges(const double *sorted, uint32_t count, double low, double high, uint32_t bins,
                           double *edges)
{
    edges[0] = low;
    edges[bins] = high;
    for (uint32_t i = 1; i < bins; ++i) {
        const double even = low + (high - low) * i / bins;
        edges[i] = count >= bins ? sorted[(uint64_t)(count - 1) * (i - 1) / (bins - 2)] : even;
    }
    if (count < bins) return;
    const uint32_t eighth = count / 8;
    edges[1] = fmax(low, 2.0 * sorted[0] - sorted[eighth]);
    edges[bins - 1] = fmin(high, 2.0 * sorted[count - 1] - sorted[count - 1 - eighth]);
}

/* Rings and cuts of equal numbers of pilot samples. `samples` gets sorted. */
static void make_edges(bin_grid *grid, polar *samples, uint32_t count)
{
    double *values = malloc((count + 1) * sizeof *values);
    assert_non_null(values);
    qsort(samples, count, sizeof *samples, compare_theta);
    for (uint32_t i = 0; i < count; ++i) values[i] = samples[i].theta;
    quantile_edges(values, count, 0.0, CA_PI_D, grid->rings, grid->theta_edges);

    uint32_t first = 0;
    for (uint32_t ring = 0; ring < grid->rings; ++ring) {
        uint32_t inside = 0;
        while (first + inside < count &&
               (ring + 1 == grid->rings || samples[first + inside].theta < grid->theta_edges[ring + 1])) {
            values[inside] = samples[first + inside].phi;
            ++inside;
        }
        qsort(values, inside, sizeof *values, compare_double);
        quantile_edges(values, inside, -CA_PI_D, CA_PI_D, grid->cuts, grid->phi_edges + ring * (grid->cuts + 1));
        first += inside;
    }
    free(values);
}

/* Last i with edges[i] <= x, for x inside of the edges: never a bin of no width but at the upper end. */
static uint32_t find_bin(const double *edges, uint32_t bins, double x)
{
    uint32_t low = 0, high = bins;
    while (high - low > 1) {
        const uint32_t middle = (low + high) / 2;
        if (edges[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static uint32_t bin_of(const bin_grid *grid, polar p)
{
    const uint32_t ring = find_bin(grid->theta_edges, grid->rings, p.theta);
    return ring * grid->cuts + find_bin(grid->phi_edges + ring * (grid->cuts + 1), grid->cuts, p.phi);
}

/* ---- Integrals of the density ---------------------------------------------------------------------------------- */

typedef struct integrand {
    const ca_chi_square_test *test;
    const bin_grid *grid;
    uint32_t bad_count;
} integrand;

typedef struct cell {
    double theta0, theta1, phi0, phi1;
} cell;

/* 3 x 3 Gauss-Legendre points. */
static double integrate_once(integrand *f, const cell *c)
{
    static const double node[3] = {0.11270166537925831, 0.5, 0.88729833462074169};
    static const double weight[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    double sum = 0.0, cos_phi[3], sin_phi[3];
    for (int j = 0; j < 3; ++j) {
        const double phi = c->phi0 + (c->phi1 - c->phi0) * node[j];
        cos_phi[j] = cos(phi);
        sin_phi[j] = sin(phi);
    }
    for (int i = 0; i < 3; ++i) {
        const double theta = c->theta0 + (c->theta1 - c->theta0) * node[i];
        const double cosine = cos(theta), sine = sin(theta);
        for (int j = 0; j < 3; ++j) {
            const ca_vec3 direction = direction_of(f->grid, sine * cos_phi[j], sine * sin_phi[j], cosine);
            const double pdf = (double)f->test->pdf(f->test->context, direction);
            if (!isfinite(pdf) || pdf < 0.0) {
                ++f->bad_count;
                continue;
            }
            sum += weight[i] * weight[j] * sine * pdf;
        }
    }
    return sum * (c->theta1 - c->theta0) * (c->phi1 - c->phi0);
}

static double integrate_adaptively(integrand *f, const cell *c, double coarse, double tolerance, int depth)
{
    const double theta = 0.5 * (c->theta0 + c->theta1), phi = 0.5 * (c->phi0 + c->phi1);
    const cell parts[4] = {{c->theta0, theta, c->phi0, phi},
                           {c->theta0, theta, phi, c->phi1},
                           {theta, c->theta1, c->phi0, phi},
                           {theta, c->theta1, phi, c->phi1}};
    double fine[4], sum = 0.0;
    for (int i = 0; i < 4; ++i) {
        fine[i] = integrate_once(f, &parts[i]);
        sum += fine[i];
    }
    if (depth >= 10 || (fabs(sum - coarse) < tolerance && depth > 1)) return sum;
    sum = 0.0;
    for (int i = 0; i < 4; ++i) sum += integrate_adaptively(f, &parts[i], fine[i], 0.5 * tolerance, depth + 1);
    return sum;
}

static int compare_phi(const void *a, const void *b)
{
    return compare_double(&((const polar *)a)->phi, &((const polar *)b)->phi);
}

static double along(const polar *p, bool by_theta) { return by_theta ? p->theta : p->phi; }

/* Widest interval of [low, high] without samples, given sorted ones, less a margin of half the extent of the samples
 * on either side of it; *before counts those below it. false: no interval is wide enough to be worth cutting out. */
static bool find_gap(const polar *sorted, uint32_t count, bool by_theta, double low, double high, double gap[2],
                     uint32_t *before)
{
    double widest = 0.0, widest_gap[2] = {low, high};
    uint32_t i_widest = 0;
    for (uint32_t i = 0; i <= count; ++i) {
        const double start = i == 0 ? low : along(&sorted[i - 1], by_theta);
        const double end = i == count ? high : along(&sorted[i], by_theta);
        if (end - start <= widest) continue;
        widest = end - start;
        widest_gap[0] = start;
        widest_gap[1] = end;
        i_widest = i;
    }
    if (widest < 0.3 * (high - low)) return false;
    gap[0] = widest_gap[0];
    gap[1] = widest_gap[1];
    *before = i_widest;
    const uint32_t i = i_widest, after = count - i;
    const double third = widest / 3.0;
    if (i > 0) gap[0] += i < 3 ? third : fmin(third, 0.5 * (gap[0] - along(&sorted[0], by_theta)));
    if (after > 0) gap[1] -= after < 3 ? third : fmin(third, 0.5 * (along(&sorted[count - 1], by_theta) - gap[1]));
    return true;
}

/* `c` restricted to [low, high] in theta or phi. */
static cell part_of(const cell *c, bool by_theta, double low, double high)
{
    return by_theta ? (cell){low, high, c->phi0, c->phi1} : (cell){c->theta0, c->theta1, low, high};
}

/* Pilot samples lead the quadrature to the mass: wide gaps between them are cut out, then a cell is cut at their
 * median, by theta and phi in turn, until few are left in it. An empty cell may yet hide a sliver of mass in a
 * corner: it is always cut twice more. */
static double integrate_guided(integrand *f, const cell *c, polar *samples, uint32_t count, double tolerance,
                               bool by_theta)
{
    enum { FEW = 8 };
    const double low = by_theta ? c->theta0 : c->phi0, high = by_theta ? c->theta1 : c->phi1;
    if (!(c->theta1 > c->theta0) || !(c->phi1 > c->phi0)) return 0.0;
    if (count <= FEW || !(high - low > 1e-12))
        return integrate_adaptively(f, c, integrate_once(f, c), tolerance, count > 0 ? 2 : 0);
    qsort(samples, count, sizeof *samples, by_theta ? compare_theta : compare_phi);
    uint32_t before = count / 2;
    const double median = along(&samples[before], by_theta);
    double gap[2] = {median, median};
    find_gap(samples, count, by_theta, low, high, gap, &before);
    if (gap[1] < gap[0]) gap[1] = gap[0];
    const cell below = part_of(c, by_theta, low, gap[0]), between = part_of(c, by_theta, gap[0], gap[1]),
               above = part_of(c, by_theta, gap[1], high);
    return integrate_guided(f, &below, samples, before, 0.7 * tolerance, !by_theta) +
           integrate_guided(f, &between, NULL, 0, 0.7 * tolerance, !by_theta) +
           integrate_guided(f, &above, samples + before, count - before, 0.7 * tolerance, !by_theta);
}

/* A fifth of a count, in a bin whose standard deviation is ten, changes the statistic by 4e-4. `samples` are the
 * pilot samples sorted by ring. */
static void expected_counts(integrand *f, double sample_count, polar *samples, uint32_t count, double *expected)
{
    const bin_grid *grid = f->grid;
    uint32_t first = 0;
    for (uint32_t ring = 0; ring < grid->rings; ++ring) {
        const double *phi = grid->phi_edges + ring * (grid->cuts + 1);
        uint32_t end = first;
        while (end < count && (ring + 1 == grid->rings || samples[end].theta < grid->theta_edges[ring + 1])) ++end;
        qsort(samples + first, end - first, sizeof *samples, compare_phi);
        for (uint32_t cut = 0; cut < grid->cuts; ++cut) {
            uint32_t inside = 0;
            while (first + inside < end && (cut + 1 == grid->cuts || samples[first + inside].phi < phi[cut + 1]))
                ++inside;
            const cell c = {grid->theta_edges[ring], grid->theta_edges[ring + 1], phi[cut], phi[cut + 1]};
            expected[ring * grid->cuts + cut] =
                sample_count * integrate_guided(f, &c, samples + first, inside, 0.2 / sample_count, true);
            first += inside;
        }
    }
}

/* ---- The test -------------------------------------------------------------------------------------------------- */

/* Draws directions; gives the number of accepted ones. */
static uint32_t draw_samples(const ca_chi_square_test *test, const bin_grid *grid, ca_test_random *random,
                             uint32_t count, polar *samples, uint32_t *bad_count)
{
    uint32_t accepted = 0;
    for (uint32_t i = 0; i < count; ++i) {
        float u[3];
        for (int k = 0; k < 3; ++k) u[k] = ca_test_random_float(random);
        ca_vec3 direction = {0.0f, 0.0f, 0.0f};
        if (!test->sample(test->context, u, &direction)) continue;
        if (!(fabsf(ca_length2(direction) - 1.0f) < 1e-4f)) {
            ++*bad_count;
            continue;
        }
        samples[accepted++] = polar_of(grid, direction);
    }
    return accepted;
}

ca_chi_square_result ca_chi_square_run(const ca_chi_square_test *test)
{
    const uint32_t count = test->sample_count ? test->sample_count : 100000;
    bin_grid grid = {.rings = test->ring_count ? test->ring_count : 24,
                     .cuts = test->cut_count ? test->cut_count : 16};
    set_axis(&grid, test->axis);
    const uint32_t bins = grid.rings * grid.cuts;
    grid.theta_edges = calloc(grid.rings + 1, sizeof(double));
    grid.phi_edges = calloc((size_t)grid.rings * (grid.cuts + 1), sizeof(double));
    polar *samples = calloc(count, sizeof *samples);
    double *observed = calloc(bins + 1, sizeof(double)), *expected = calloc(bins + 1, sizeof(double));
    assert_true(grid.theta_edges && grid.phi_edges && samples && observed && expected);

    ca_chi_square_result result = {.p_value = 0.0};
    ca_test_random pilot = ca_test_random_seed(2 * test->seed), random = ca_test_random_seed(2 * test->seed + 1);
    const uint32_t pilot_count = draw_samples(test, &grid, &pilot, count / 2, samples, &result.bad_count);
    make_edges(&grid, samples, pilot_count);
    integrand f = {.test = test, .grid = &grid};
    expected_counts(&f, count, samples, pilot_count, expected);

    const uint32_t accepted = draw_samples(test, &grid, &random, count, samples, &result.bad_count);
    for (uint32_t i = 0; i < accepted; ++i) observed[bin_of(&grid, samples[i])] += 1.0;
    for (uint32_t i = 0; i < bins; ++i) result.pdf_integral += expected[i] / count;
    observed[bins] = (double)(count - accepted);
    expected[bins] = fmax(0.0, count * (1.0 - result.pdf_integral));

    result.bad_count += f.bad_count;
    result.accepted_rate = (double)accepted / count;
    result.p_value =
        ca_chi_square_counts(observed, expected, bins + 1, &result.statistic, &result.degrees_of_freedom);
    free(grid.theta_edges);
    free(grid.phi_edges);
    free(samples);
    free(observed);
    free(expected);
    return result;
}

ca_chi_square_result ca_chi_square_assert(const ca_chi_square_test *test)
{
    const ca_chi_square_result result = ca_chi_square_run(test);
    const double level = ca_sidak_level(0.01, test->test_count);
    if (!(result.p_value >= level) || result.bad_count > 0) {
        fail_msg(
            "%s: p = %.3g (must be above %.3g), chi^2 = %.6g with %u degrees of freedom; the density integrates to "
            "%.6f and %.6f of the samples were accepted; %u bad values",
            test->name ? test->name : "chi-square test", result.p_value, level, result.statistic,
            result.degrees_of_freedom, result.pdf_integral, result.accepted_rate, result.bad_count);
    }
    return result;
}
