/* Confidence intervals for the expectations of pixels, from independent replicates (docs/decisions/011).
 *
 * A channel of a pixel comes as the moments of its n replicates: single samples, or means of several. Its 95 %
 * interval is Student's with n - 1 degrees of freedom, corrected for skewness: on the short tail's side by Hall's
 * transformation, on the long tail's by the exact limit of as many equal Poisson contributions as have this skewness.
 * Such an interval is called ordinary, and holds its expectation in 95 of 100 pixels.
 *
 * Where the replicates are too skewed for it to be trusted, it is widened by what the pixel's neighbourhood tells,
 * since the samples of one pixel do not know what they have missed: it holds its expectation in 93 of 100 pixels at
 * least, mostly in more; on average over renders, since pixels near each other learn from the same contributions.
 * Where nobody can tell, the pixel is marked: its interval is everything, from -infinity to infinity. No interval, of
 * no kind, says anything of light that none of the samples nearby has found.
 *
 * All functions are pure and in double precision. */
#ifndef CA_FILM_CONFIDENCE_H
#define CA_FILM_CONFIDENCE_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    CA_CONFIDENCE_MIN_REPLICATES = 8, /* with fewer, skewness cannot be estimated: all is marked */
    CA_CONFIDENCE_REACH = 2,          /* pixels to each side that are pooled: 5 x 5 without the one in the middle */
    CA_CONFIDENCE_FAR_REACH = 7,      /* and that are searched for lone contributions: 15 x 15 */
    CA_CONFIDENCE_CONTRIBUTIONS = 4,  /* so many rare contributions to a pixel are enough */
    CA_CONFIDENCE_UNCERTAIN = 12,     /* one in so many uncertain variances nearby is too many */
};

/* Mean, and unbiased estimates of the central moments, of one channel's replicates. */
typedef struct ca_moments {
    double mean, variance, third;
    uint32_t replicates;
    bool uncertain; /* too little is known of the variance for an ordinary interval; 0: nothing */
} ca_moments;

/* From the sums of values, squares and cubes. Of what may be nothing but the rounding of these sums, variance and
 * third are 0. */
ca_moments ca_moments_of(double sum, double sum_squares, double sum_cubes, uint32_t replicates);

typedef struct ca_interval {
    double low, high;
} ca_interval;

/* The t with P(|T| > t) = alpha, for Student's T of `degrees` > 0 degrees of freedom and alpha in (0, 1). */
double ca_student_two_sided_quantile(double alpha, double degrees);

/* The interval for the expectation, from at least CA_CONFIDENCE_MIN_REPLICATES replicates; `quantile` is Student's
 * for these. It reaches 2^-21 of the mean to either side at least, which is what rounding in the samples may amount
 * to. */
ca_interval ca_confidence_interval(const ca_moments *moments, double quantile);

/* As floats, rounded outwards: what a float cannot hold does not make the interval smaller. */
void ca_interval_round(ca_interval interval, float *low, float *high);

typedef enum ca_interval_kind { CA_INTERVAL_ORDINARY, CA_INTERVAL_WIDENED, CA_INTERVAL_MARKED } ca_interval_kind;

enum { CA_BELOW, CA_ABOVE }; /* the sides of a mean */

/* What a pixel's neighbourhood says of its interval. */
typedef struct ca_verdict {
    ca_interval_kind kind;
    double variance[2]; /* of a replicate's scatter to either side, averaged over the pixels near this one */
    double lone[2];     /* at most what lone contributions further around bring to each pixel there, on either side */
} ca_verdict;

/* The upper 95 % limit for what rare contributions bring in expectation, from the sum of those found and the sum of
 * their squares; 0 where there are none.
 *
 * The number k of those found is a Poisson variable, whose expectation has as its exact upper limit the gamma
 * quantile of shape k + 1 (Garwood 1936). Neither is their size known: the sum of k that are exponentially
 * distributed is their expectation times a gamma variable of shape k. So the limit is the sum times the 95 % quantile
 * of a gamma variable of shape k + 1 over one of shape k, (k + 1) / k F(2 k + 2, 2 k): 49 times for one contribution,
 * 9.5 for two, 2.3 for ten, by Paulson's approximation, too large by 28 % for one, by 3 % for two, within 1 % from
 * three on. Sizes that differ count as k = sum^2 / squares equal ones, so that a larger one among them makes the
 * limit higher. */
double ca_confidence_lone_limit(double sum, double squares);

/* Pixels of row y from x0 to before x1. */
typedef struct ca_pixel_run {
    uint32_t y, x0, x1;
} ca_pixel_run;

enum { CA_CONFIDENCE_MOST_CHANNELS = 4 };

/* A picture whose moments are made where they are needed, for some pixels several times, and of which no verdict is
 * kept. Both functions are called by several threads at a time; `worker` is under the number of threads. */
typedef struct ca_confidence_pixels {
    uint32_t width, height, channels;
    /* to[c][i]: of channel c of the i-th pixel. */
    void (*moments)(const void *user, const ca_pixel_run *run, ca_moments *const *to);
    /* One channel's. */
    void (*take)(void *user, const ca_pixel_run *run, uint32_t channel, const ca_moments *moments,
                 const ca_verdict *verdicts, uint32_t worker);
    void *user;
} ca_confidence_pixels;

/* Judges the pixels of a picture, each channel for itself. By so many threads, on which no bit depends. Memory: 450
 * KiB of each thread's stack. CA_ERROR_INTERRUPTED: nobody wants the calling thread's work any more (base/loading.h).
 *
 * Contributions are counted as if all scatter came from equal ones of probability p: their number n p is then n /
 * skewness^2, and variance^2 / |third| what they bring to the mean (a negative skewness stands for rare dark ones). A
 * pixel's interval is not ordinary where
 * - it has fewer than CA_CONFIDENCE_MIN_REPLICATES replicates;
 * - its variance is uncertain, or that of more than one in CA_CONFIDENCE_UNCERTAIN of those near it: where variances
 * are seldom found, those that seem certain have only missed what the others found;
 * - its replicates are all equal but those of a pixel near it are not;
 * - the pixels near it have less than CA_CONFIDENCE_CONTRIBUTIONS contributions each, which bring more than half a
 * standard error: by variances and third moments averaged over them, relative to powers of each one's mean; the
 * pixel itself counts only where all others are black; or
 * - the lone contributions (less than two) of pixels further around bring more than that, averaged over all there.
 * The standard error is the pixel's, or the average of those near it that have one, relative to the means, where that
 * is smaller.
 *
 * Such a pixel is marked where it has too few replicates, all others near it are black, or its variance is uncertain
 * and half of the others show none; else its interval is widened. */
ca_status ca_confidence_judge_pixels(ca_confidence_pixels *pixels, uint32_t threads, ca_error *error);

/* The same of one channel in arrays of width x height elements. */
ca_status ca_confidence_judge(const ca_moments *moments, uint32_t width, uint32_t height, uint32_t threads,
                              ca_verdict *verdicts, ca_error *error);
/* What these arrays take for a pixel, and a number beside them. */
enum { CA_CONFIDENCE_ARRAY_BYTES = sizeof(ca_moments) + sizeof(ca_verdict) + sizeof(double) };

/* The interval by the verdict. A widened one reaches as far as the root of the sum of the squares of two reaches: the
 * ordinary one's, and `quantile` standard errors by the verdict's variance of that side. What lone
 * contributions may bring is added. */
ca_interval ca_confidence_judged_interval(const ca_moments *moments, const ca_verdict *verdict, double quantile);

#endif
