/* Tone curves: from light of any strength to what a display shows.
 *
 * A curve takes linear Rec. 709 values, multiplied by 2^exposure, to values proportional to the display's light. All
 * but CA_TONE_LINEAR give [0, 1]: negative values count as 0 first, and what the curve makes of the rest is clipped
 * at 1. In double precision inside, so that no float overflows.
 *
 *     srgb      clips only
 *     aces      (0.9036 x^2 + 0.018 x) / (0.8748 x^2 + 0.354 x + 0.14), a fit of the ACES curve
 *     hable     (0.231683 x^2 + 0.013791 x) / (0.18 x^2 + 0.3 x + 0.018)
 *     reinhard  x / (1 + Y) with the luminance Y of the pixel
 *     linear    leaves the value as it is
 * aces, hable and reinhard are those of HDR-FLIP, with the coefficients of its authors' program
 * (github.com/NVlabs/flip, cpp/FLIP.h). */
#ifndef CA_METRICS_TONE_H
#define CA_METRICS_TONE_H

#include "base/status.h"
#include "math/rgb.h"

typedef enum ca_tone_curve {
    CA_TONE_SRGB,
    CA_TONE_ACES,
    CA_TONE_HABLE,
    CA_TONE_REINHARD,
    CA_TONE_LINEAR,
    CA_TONE_CURVE_COUNT,
} ca_tone_curve;

const char *ca_tone_name(ca_tone_curve curve);
/* Errors: CA_ERROR_ARGUMENT, naming all curves. */
ca_status ca_tone_find(const char *name, ca_tone_curve *curve, ca_error *error);

/* Proportional to the display's light; `scale` is 2^exposure. */
ca_rgb ca_tone_map(ca_tone_curve curve, double scale, ca_rgb linear);
/* The value of a display's signal: sRGB encoded but for CA_TONE_LINEAR. */
ca_rgb ca_tone_signal(ca_tone_curve curve, double scale, ca_rgb linear);

/* The grey x that the curve takes to `shown` in (0, 1); not for CA_TONE_LINEAR, where it is x itself. */
double ca_tone_inverse(ca_tone_curve curve, double shown);

#endif
