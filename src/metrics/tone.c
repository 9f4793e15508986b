#include "metrics/tone.h"

#include "image/image.h"

#include <string.h>

/* A curve of a grey x is (k[0] x^2 + k[1] x) / (k[2] x^2 + k[3] x + k[4]). Reinhard's is that of the luminance. */
static const struct {
    const char *name;
    double k[5];
} curves[CA_TONE_CURVE_COUNT] = {
    [CA_TONE_SRGB] = {"srgb", {0.0, 1.0, 0.0, 0.0, 1.0}},
    [CA_TONE_ACES] = {"aces", {0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14}},
    [CA_TONE_HABLE] = {"hable", {0.231683, 0.013791, 0.18, 0.3, 0.018}},
    [CA_TONE_REINHARD] = {"reinhard", {0.0, 1.0, 0.0, 1.0, 1.0}},
    [CA_TONE_LINEAR] = {"linear", {0.0, 1.0, 0.0, 0.0, 1.0}},
};

const char *ca_tone_name(ca_tone_curve curve) { return curves[curve].name; }

ca_status ca_tone_find(const char *name, ca_tone_curve *curve, ca_error *error)
{
    for (int i = 0; i < CA_TONE_CURVE_COUNT; i++)
        if (strcmp(name, curves[i].name) == 0) {
            *curve = (ca_tone_curve)i;
            return CA_OK;
        }
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "\"%.100s\" is not a tone curve: srgb, aces, hable, reinhard, linear", name);
}

static double rational(const double k[5], double x)
{
    return (k[0] * x + k[1]) * x / ((k[2] * x + k[3]) * x + k[4]);
}

static float clipped(double shown) { return (float)fmin(shown, 1.0); }

ca_rgb ca_tone_map(ca_tone_curve curve, double scale, ca_rgb linear)
{
    double x[3] = {scale * (double)linear.r, scale * (double)linear.g, scale * (double)linear.b};
    if (curve == CA_TONE_LINEAR) return (ca_rgb){(float)x[0], (float)x[1], (float)x[2]};
    for (int c = 0; c < 3; c++) x[c] = fmax(x[c], 0.0);
    if (curve == CA_TONE_REINHARD) {
        const double luminance = 0.2126 * x[0] + 0.7152 * x[1] + 0.0722 * x[2];
        for (int c = 0; c < 3; c++) x[c] /= 1.0 + luminance;
    } else if (curve != CA_TONE_SRGB) {
        for (int c = 0; c < 3; c++) x[c] = rational(curves[curve].k, x[c]);
    }
    return (ca_rgb){clipped(x[0]), clipped(x[1]), clipped(x[2])};
}

ca_rgb ca_tone_signal(ca_tone_curve curve, double scale, ca_rgb linear)
{
    const ca_rgb shown = ca_tone_map(curve, scale, linear);
    if (curve == CA_TONE_LINEAR) return shown;
    return (ca_rgb){ca_linear_to_srgb(shown.r), ca_linear_to_srgb(shown.g), ca_linear_to_srgb(shown.b)};
}

double ca_tone_inverse(ca_tone_curve curve, double shown)
{
    const double *k = curves[curve].k;
    const double a = k[0] - shown * k[2], b = k[1] - shown * k[3], c = -shown * k[4];
    if (a == 0.0) return -c / b;
    const double half = -0.5 * b / a;
    return half + sqrt(half * half - c / a); /* the curves rise through 0 at 0: the larger root is the positive one */
}
