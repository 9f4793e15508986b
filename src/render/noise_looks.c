#include "render/noise_looks.h"

#include <math.h>

/* The smallest distance between two looks, relative to the passes so far. A render may exceed its target by as
 * much. */
static const double smallest_step = 1.0 / 32.0;

/* Without light: samples of the picture, and of a pixel. */
static const double most_in_vain = 0x1p24, least_of_pixel = 64.0, most_of_pixel = 4096.0;

ca_noise_looks ca_noise_looks_start(double target, double first, double patience)
{
    return (ca_noise_looks){.target = target, .patience = patience, .next = first, .noise = -1.0};
}

double ca_noise_looks_patience(double pixels, bool has_light)
{
    return has_light ? fmin(fmax(most_in_vain / pixels, least_of_pixel), most_of_pixel) : 0.0;
}

static bool is_hopeless(const ca_noise_looks *looks, double passes)
{
    return looks->target > 0.0 && looks->noise < 0.0 && passes >= looks->patience;
}

static void predict(ca_noise_looks *looks, double whole_seconds, double seconds)
{
    looks->seconds_predicted = whole_seconds;
    if (looks->first_predicted_seconds > 0.0) return;
    looks->first_predicted_seconds = whole_seconds;
    looks->first_predicted_at = seconds;
}

void ca_noise_looks_take(ca_noise_looks *looks, double passes, double noise, double seconds, double seconds_per_pass)
{
    looks->next = 2.0 * passes;
    looks->noise = isnan(noise) ? -1.0 : noise;
    looks->given_up = looks->noise < 0.0 && (looks->given_up || is_hopeless(looks, passes));
    if (looks->target <= 0.0 || isnan(noise)) return;
    const double ratio = noise / looks->target, needed = passes * ratio * ratio;
    predict(looks, seconds + fmax(0.0, needed - passes) * seconds_per_pass, seconds);
    /* The next look is where the noise is expected to be just below the target. */
    looks->next = fmin(looks->next, fmax(needed * (1.0 + 0.25 * smallest_step), passes * (1.0 + smallest_step)));
}

void ca_noise_looks_recall(ca_noise_looks *looks, double noise, double next)
{
    looks->noise = noise;
    looks->next = next;
    looks->given_up = is_hopeless(looks, 0.5 * next); /* after a black look it is at twice the passes */
}
