#include "render/progress.h"

#include <math.h>

static double share_of(double seconds, double of) { return of > 0.0 ? seconds / of : 1.0; }

/* As if so many seconds were not part of the render. Where no time is predicted for the noise target: noise falls as
 * the root of the number of passes. */
static double fraction_without(const ca_render_progress *p, double lost)
{
    const double seconds = fmax(p->seconds - lost, 0.0);
    double fraction = -1.0;
    if (p->passes_total > 0) fraction = (double)p->passes_done / p->passes_total;
    if (p->seconds_total > 0.0) fraction = fmax(fraction, share_of(seconds, p->seconds_total - lost));
    if (p->seconds_predicted > 0.0) {
        fraction = fmax(fraction, share_of(seconds, p->seconds_predicted - lost));
    } else if (p->noise_target > 0.0 && p->noise_percent > 0.0) {
        const double ratio = p->noise_target / p->noise_percent;
        fraction = fmax(fraction, ratio * ratio);
    }
    return fmin(fraction, 1.0);
}

double ca_progress_fraction(const ca_render_progress *progress) { return fraction_without(progress, 0.0); }

/* No pass is made while something is chosen, and it is not chosen again. */
static double fraction_of_passes(const ca_render_progress *p) { return fraction_without(p, p->seconds_choosing); }

double ca_progress_seconds_left(const ca_render_progress *p)
{
    const double fraction = fraction_of_passes(p);
    return fraction > 0.0 ? (p->seconds - p->seconds_choosing) * (1.0 - fraction) / fraction : -1.0;
}

ca_render_progress ca_progress_at_noise(const ca_render_progress *progress)
{
    ca_render_progress then = *progress;
    then.passes_done = progress->noise_passes;
    then.seconds = progress->noise_seconds;
    return then;
}

double ca_progress_noise_at_end(const ca_render_progress *estimate)
{
    const double fraction = fraction_of_passes(estimate);
    return estimate->noise_percent >= 0.0 && fraction > 0.0 ? estimate->noise_percent * sqrt(fraction) : -1.0;
}

bool ca_progress_ran_out_of_passes(const ca_render_settings *settings, const ca_render_statistics *statistics)
{
    const bool by_time = settings->seconds > 0.0, by_noise = settings->noise_percent > 0.0;
    const bool by_number = settings->samples_per_pixel > 0 || settings->has_passes || statistics->blocks[1] > 0;
    const bool joined = statistics->passes[1] == 0 && statistics->numbers_of_rays.pilot_seconds > 0.0;
    if (by_number || statistics->interrupted || joined) return false;
    if (by_time && statistics->seconds >= settings->seconds) return false;
    if (by_noise && statistics->noise_percent < settings->noise_percent) return false;
    return by_time || by_noise;
}
