#include "photon/radius.h"

#include <math.h>

float ca_progressive_radius(float r0, float alpha, uint32_t pass)
{
    return (float)((double)r0 * pow(1.0 + (double)pass, -0.5 * (double)alpha));
}
