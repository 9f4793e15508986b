/* How many confidence intervals of repeated renders hold the expectation. */
#ifndef CA_TEST_INTERVAL_TALLY_H
#define CA_TEST_INTERVAL_TALLY_H

#include "caustica.h"

typedef struct interval_tally {
    uint64_t pixels, marked;
    uint64_t widened, widened_held; /* widened intervals, and those of them that hold the expectation */
    uint64_t constant; /* without noise: nothing to calibrate; such a one that differs from the expectation is in
                          `below` */
    uint64_t held, below, above; /* of the ordinary ones: the expectation is in the interval, below it, above it */
} interval_tally;

enum { INTERVAL_TALLY_RENDERS = 16 };

/* Renders `renders` (2 to INTERVAL_TALLY_RENDERS) times with the seeds settings->seed, + 1, ..., and asks the
 * intervals of each (ConfidenceLow.CHANNEL, ...) for the mean of all others. That mean has an error too: the
 * difference of the two has 1 + 1 / (renders - 1) times the variance of one, so the intervals are made wider by the
 * root of that. Fails the test on errors. `channel` is R, G or B. */
interval_tally tally_intervals(const ca_scene *scene, const ca_render_settings *settings, int renders,
                               const char *channel);

/* Of the ordinary ones that are not without noise, the fraction that is held; NAN: there are none. */
double tally_fraction(const interval_tally *tally);
/* Of the widened ones; NAN: there are none. */
double tally_widened_fraction(const interval_tally *tally);

#endif
