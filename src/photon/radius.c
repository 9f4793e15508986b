#include "photon/radius.h"

#include <math.h>

float ca_progressive_radius(float r0, float alpha, uint32_t pass)
{
    return (float)((double)r0 * pow(1.0 + (double)pass, -0.5 * (double)alpha));
}

/* Each term is the integral around it. */
double ca_progressive_mean_area(double alpha, double passes)
{
    const double last = passes + 0.5;
    const double sum =
        alpha == 1.0 ? log(last / 0.5) : (pow(last, 1.0 - alpha) - pow(0.5, 1.0 - alpha)) / (1.0 - alpha);
    return fmin(sum / passes, 1.0);
}
