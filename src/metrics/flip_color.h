/* The colour spaces of FLIP, in double precision. Linear Rec. 709 RGB in [0, 1]; XYZ here are divided by those of the
 * white (1, 1, 1). The matrix is that of flip.h's source, cpp/FLIP.h, which takes it from the technical note on sRGB
 * and CIE XYZ of image-engineering.de; each row divided by its sum. */
#ifndef CA_METRICS_FLIP_COLOR_H
#define CA_METRICS_FLIP_COLOR_H

#include <math.h>

typedef struct ca_flip_color {
    double v[3]; /* R G B, X Y Z, Y Cx Cz or L* a* b* */
} ca_flip_color;

static inline ca_flip_color ca_flip_xyz(ca_flip_color rgb)
{
    const double *c = rgb.v;
    return (ca_flip_color){{
        (10135552.0 * c[0] + 8788810.0 * c[1] + 4435075.0 * c[2]) / 23359437.0,
        (2613072.0 * c[0] + 8788810.0 * c[1] + 887015.0 * c[2]) / 12288897.0,
        (1425312.0 * c[0] + 8788810.0 * c[1] + 70074185.0 * c[2]) / 80288307.0,
    }};
}

/* The inverse of ca_flip_xyz. */
static inline ca_flip_color ca_flip_rgb(ca_flip_color xyz)
{
    const double *c = xyz.v;
    return (ca_flip_color){{
        3.080341988280 * c[0] - 1.537398969489 * c[1] - 0.542943018792 * c[2],
        -0.921178396165 * c[0] + 1.875929983695 * c[1] + 0.045248412470 * c[2],
        0.052881292876 * c[0] - 0.204011206124 * c[1] + 1.151129913248 * c[2],
    }};
}

/* L* a* b* without their cube root: opponent colours that are linear in light. */
static inline ca_flip_color ca_flip_ycxcz(ca_flip_color rgb)
{
    const ca_flip_color n = ca_flip_xyz(rgb);
    return (ca_flip_color){{116.0 * n.v[1] - 16.0, 500.0 * (n.v[0] - n.v[1]), 200.0 * (n.v[1] - n.v[2])}};
}

static inline ca_flip_color ca_flip_rgb_of_ycxcz(ca_flip_color c)
{
    const double y = (c.v[0] + 16.0) / 116.0;
    return ca_flip_rgb((ca_flip_color){{y + c.v[1] / 500.0, y, y - c.v[2] / 200.0}});
}

static inline double ca_flip_lightness(double ratio)
{
    const double delta = 6.0 / 29.0;
    return ratio > delta * delta * delta ? cbrt(ratio) : ratio / (3.0 * delta * delta) + 4.0 / 29.0;
}

/* L* a* b* with a* and b* times L* / 100: the darker, the less colourful (Hunt). */
static inline ca_flip_color ca_flip_hunt_lab(ca_flip_color rgb)
{
    const ca_flip_color n = ca_flip_xyz(rgb);
    const double x = ca_flip_lightness(n.v[0]), y = ca_flip_lightness(n.v[1]), z = ca_flip_lightness(n.v[2]);
    const double lightness = 116.0 * y - 16.0;
    return (ca_flip_color){{lightness, 0.01 * lightness * (500.0 * (x - y)), 0.01 * lightness * (200.0 * (y - z))}};
}

/* City block distance in lightness, Euclidean in colour (HyAB). */
static inline double ca_flip_distance(ca_flip_color p, ca_flip_color q)
{
    const double a = p.v[1] - q.v[1], b = p.v[2] - q.v[2];
    return fabs(p.v[0] - q.v[0]) + sqrt(a * a + b * b);
}

#endif
