#include "render/progress.h"

#include <math.h>

/* Where no time is predicted for the noise target: noise falls with the square root of the number of passes. */
double ca_progress_fraction(const ca_render_progress *p)
{
    double fraction = -1.0;
    if (p->passes_total > 0) fraction = (double)p->passes_done / p->passes_total;
    if (p->seconds_total > 0.0) fraction = fmax(fraction, p->seconds / p->seconds_total);
    if (p->seconds_predicted > 0.0) {
        fraction = fmax(fraction, p->seconds / p->seconds_predicted);
    } else if (p->noise_target > 0.0 && p->noise_percent > 0.0) {
        const double ratio = p->noise_target / p->noise_percent;
        fraction = fmax(fraction, ratio * ratio);
    }
    return fmin(fraction, 1.0);
}

double ca_progress_seconds_left(const ca_render_progress *p)
{
    const double fraction = ca_progress_fraction(p);
    return fraction > 0.0 ? p->seconds * (1.0 - fraction) / fraction : -1.0;
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
    const double fraction = ca_progress_fraction(estimate);
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
