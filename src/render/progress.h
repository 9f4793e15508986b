/* What the numbers of a progress callback come to. */
#ifndef CA_RENDER_PROGRESS_H
#define CA_RENDER_PROGRESS_H

#include "caustica.h"

/* How much of the work is done, in [0, 1]; the nearest of the ends that are set. Negative: nothing is known. */
double ca_progress_fraction(const ca_render_progress *progress);

/* Seconds until the end at the pace so far; negative: not known. */
double ca_progress_seconds_left(const ca_render_progress *progress);

#endif
