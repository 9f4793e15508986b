/* The fraction done and the time left, from the numbers of a progress callback. */
#ifndef CA_RENDER_PROGRESS_H
#define CA_RENDER_PROGRESS_H

#include "caustica.h"

/* The fraction of the work that is done, in [0, 1], by whichever limit is nearest. Negative: not known. */
double ca_progress_fraction(const ca_render_progress *progress);

/* Seconds until the end at the pace so far; negative: not known. */
double ca_progress_seconds_left(const ca_render_progress *progress);

#endif
