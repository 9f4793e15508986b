#include "film/film_bars.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "film/confidence.h"
#include "film/interval_layers.h"

#include <string.h>

/* ---- Moments --------------------------------------------------------------------------------------------------- */

/* R, G, B, Y. */
enum { CHANNELS = 4 };

/* The last quantile that a thread has asked for: mostly all pixels have as many replicates. */
typedef struct known_quantile {
    uint32_t replicates;
    double quantile;
} known_quantile;

typedef struct bar_work {
    const ca_film *film;
    ca_interval_layers intervals[CHANNELS];
    known_quantile *known; /* of each thread */
} bar_work;

static size_t first_of(const ca_film *film, const ca_pixel_run *run)
{
    return (size_t)run->y * film->width + run->x0;
}

/* What the statistics of the channels are made of. */
typedef struct replicate_sums {
    double sum[CHANNELS], squares[CHANNELS], cubes[CHANNELS]; /* squares and cubes of one replicate */
    uint32_t replicates;
} replicate_sums;

static void set_sums(double sum[CHANNELS], const double rgb[3])
{
    memcpy(sum, rgb, 3 * sizeof *sum);
    sum[3] = ca_film_luminance(rgb);
}

static replicate_sums sums_of_parts(const ca_film *film, size_t i)
{
    const ca_pass_sums *from = &film->parts[i];
    const ca_group_sums *group = film->group_parts ? &film->group_parts[i] : NULL;
    replicate_sums to = {.replicates = from->samples};
    double values[CA_PASS_SUMS], *rgb = values + CA_PASS_VALUES;
    ca_pass_sums_values(from, group, values);
    memcpy(to.squares, values + CA_PASS_SQUARES, sizeof to.squares);
    memcpy(to.cubes, values + CA_PASS_CUBES, sizeof to.cubes);
    if (group) ca_group_sums_values(group, to.squares);
    for (int c = 0; group && c < 3; c++) rgb[c] -= group->open[c];
    set_sums(to.sum, rgb);
    return to;
}

static replicate_sums sums_of_pixel(const ca_film *film, size_t i)
{
    const ca_film_pixel *p = &film->pixels[i];
    const ca_film_groups *groups = film->groups ? &film->groups[i] : NULL;
    replicate_sums to = {.replicates = p->samples};
    set_sums(to.sum, groups ? groups->sum : p->sum);
    memcpy(to.squares, p->sum_squares, sizeof p->sum_squares);
    to.squares[3] = p->sum_squares_luminance;
    if (groups) memcpy(to.squares, groups->sum_squares, sizeof to.squares);
    memcpy(to.cubes, p->sum_cubes, sizeof to.cubes);
    return to;
}

/* Of groups, those that are complete: sums over their samples, squares and cubes of their means. */
static void find_moments(const void *user, const ca_pixel_run *run, ca_moments *const *to)
{
    const ca_film *film = ((const bar_work *)user)->film;
    const size_t first = first_of(film, run);
    const uint32_t each = film->replicate_samples;
    for (uint32_t i = 0; i < run->x1 - run->x0; i++) {
        const replicate_sums s = film->parts ? sums_of_parts(film, first + i) : sums_of_pixel(film, first + i);
        for (int c = 0; c < CHANNELS; c++)
            to[c][i] = ca_moments_of(s.sum[c] / each, s.squares[c], s.cubes[c], s.replicates / each);
    }
}

/* ---- Intervals ------------------------------------------------------------------------------------------------- */

static double quantile_of(known_quantile *known, uint32_t replicates)
{
    if (known->replicates != replicates)
        *known = (known_quantile){replicates, ca_student_two_sided_quantile(0.05, replicates - 1.0)};
    return known->quantile;
}

static void fill_intervals(void *user, const ca_pixel_run *run, uint32_t channel, const ca_moments *moments,
                           const ca_verdict *verdicts, uint32_t worker)
{
    const bar_work *work = user;
    const size_t first = first_of(work->film, run);
    for (uint32_t i = 0; i < run->x1 - run->x0; i++) {
        const bool marked = verdicts[i].kind == CA_INTERVAL_MARKED;
        const double quantile = marked ? 0.0 : quantile_of(&work->known[worker], moments[i].replicates);
        ca_interval_layers_set(&work->intervals[channel], first + i, &moments[i], &verdicts[i], quantile);
    }
}

/* Those of an early end: all of them are marked, whatever is near them. */
static bool have_too_few(const ca_film *film, size_t count)
{
    const uint32_t enough = CA_CONFIDENCE_MIN_REPLICATES * film->replicate_samples;
    size_t i = 0;
    while (i < count && (film->parts ? film->parts[i].samples : film->pixels[i].samples) < enough) i++;
    return i == count;
}

static void mark_all(const bar_work *work, size_t count)
{
    const ca_moments nothing = {0};
    const ca_verdict marked = {.kind = CA_INTERVAL_MARKED};
    for (int c = 0; c < CHANNELS; c++)
        for (size_t i = 0; i < count; i++) ca_interval_layers_set(&work->intervals[c], i, &nothing, &marked, 0.0);
}

static ca_status judge(bar_work *work, uint32_t threads, ca_error *error)
{
    const ca_film *film = work->film;
    ca_confidence_pixels pixels = {.width = film->width,
                                   .height = film->height,
                                   .channels = CHANNELS,
                                   .moments = find_moments,
                                   .take = fill_intervals,
                                   .user = work};
    work->known = ca_alloc_zeroed(threads, sizeof *work->known);
    if (!work->known) return ca_fail_memory(error, "the error bars");
    const ca_status status = ca_confidence_judge_pixels(&pixels, threads, error);
    ca_free(work->known);
    return status;
}

ca_status ca_film_bars_add(const ca_film *film, uint32_t threads, ca_image_layers *layers, ca_error *error)
{
    const size_t count = (size_t)film->width * film->height;
    bar_work work = {.film = film};
    if (film->replicate_samples == 0) return CA_OK;
    for (int c = 0; c < CHANNELS; c++)
        CA_TRY(ca_interval_layers_add(&work.intervals[c], layers, "RGBY"[c], error));
    if (!have_too_few(film, count)) return judge(&work, threads, error);
    mark_all(&work, count);
    return CA_OK;
}
