#include "photon/radius.h"

#include <math.h>

float ca_progressive_radius(float r0, float alpha, uint32_t pass)
{
    return (float)((double)r0 * pow(1.0 + (double)pass, -0.5 * (double)alpha));
}

/* Of pass^power; each term is the integral around it. */
static double mean_of_powers(double power, double passes)
{
    const double last = passes + 0.5, p = power + 1.0;
    return (p == 0.0 ? log(last / 0.5) : (pow(last, p) - pow(0.5, p)) / p) / passes;
}

double ca_progressive_mean_area(double alpha, double passes) { return fmin(mean_of_powers(-alpha, passes), 1.0); }

double ca_progressive_mean_density(double alpha, double passes) { return fmax(mean_of_powers(alpha, passes), 1.0); }
