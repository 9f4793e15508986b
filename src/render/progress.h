/* The fraction done and the time left, from the numbers of a progress callback. */
#ifndef CA_RENDER_PROGRESS_H
#define CA_RENDER_PROGRESS_H

#include "caustica.h"

/* The fraction of the work that is done, in [0, 1], by whichever limit is nearest. Negative: not known. */
double ca_progress_fraction(const ca_render_progress *progress);

/* Seconds until the end at the pace so far; negative: not known. */
double ca_progress_seconds_left(const ca_render_progress *progress);

/* The same render as it was when noise_percent was estimated, seen with today's limits. */
ca_render_progress ca_progress_at_noise(const ca_render_progress *progress);

/* The noise to expect at the end, in percent, where `estimate` is how far the render was when noise_percent was
 * estimated: it falls with the square root of the work. Negative: not known. */
double ca_progress_noise_at_end(const ca_render_progress *estimate);

/* Was a render by time or noise ended by the most passes that a render can have, before either was reached? A noise
 * that is not known has another message. Renders by blocks, and those that choose numbers of rays again and
 * again (auto_rays.h), have no such limit. */
bool ca_progress_ran_out_of_passes(const ca_render_settings *settings, const ca_render_statistics *statistics);

#endif
