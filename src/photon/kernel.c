/* Every kernel is a profile of q = 2 d / r or t = d^2 / r^2; its gradient follows from dk/dt:
 *
 *     grad_q k(|q - p|^2 / r^2) / r^2 = dk/dt * (-2 offset / r^2) / r^2,   offset = p - q. */
#include "photon/kernel.h"

#include "math/numeric.h"

/* Spline of half the support as its length h = r / 2: 10 / (7 pi h^2) makes its integral over the plane one
 * (Monaghan's M4 in two dimensions). Times r^2: */
#define SPH_SCALE (40.0f / 7.0f * CA_INV_PI)

/* 1 - 3/2 q^2 + 3/4 q^3 up to q = 1, 1/4 (2 - q)^3 from there to 2. */
static float sph_value(float t)
{
    const float q = 2.0f * sqrtf(t);
    if (q < 1.0f) return SPH_SCALE * (1.0f - q * q * (1.5f - 0.75f * q));
    const float u = 2.0f - q;
    return SPH_SCALE * 0.25f * u * u * u;
}

/* dk/dt = dk/dq * 2 / q, without a division where q may vanish. */
static float sph_slope(float t)
{
    const float q = 2.0f * sqrtf(t);
    if (q < 1.0f) return SPH_SCALE * 2.0f * (2.25f * q - 3.0f);
    return SPH_SCALE * -1.5f * ca_sqr(2.0f - q) / q;
}

float ca_kernel_value(ca_kernel kernel, float t)
{
    if (!(t <= 1.0f)) return 0.0f;
    switch (kernel) {
    case CA_KERNEL_EPANECHNIKOV: return 2.0f * CA_INV_PI * (1.0f - t);
    case CA_KERNEL_SPH: return sph_value(t);
    case CA_KERNEL_DISK:
    case CA_KERNEL_COUNT: break;
    }
    return CA_INV_PI;
}

ca_vec3 ca_kernel_gradient(ca_kernel kernel, ca_vec3 offset, float radius)
{
    const float radius2 = radius * radius, t = ca_length2(offset) / radius2;
    if (!ca_kernel_is_smooth(kernel) || !(t <= 1.0f)) return (ca_vec3){0.0f, 0.0f, 0.0f};
    const float slope = kernel == CA_KERNEL_SPH ? sph_slope(t) : -2.0f * CA_INV_PI;
    return ca_mul(offset, -2.0f * slope / radius2 / radius2);
}

float ca_kernel_roughness(ca_kernel kernel)
{
    switch (kernel) {
    case CA_KERNEL_EPANECHNIKOV: return 4.0f / 3.0f * CA_INV_PI;
    /* pi/2 scale^2 (779/4480 + 45/4480), from the spline's two pieces: */
    case CA_KERNEL_SPH: return 1030.0f / 343.0f * CA_INV_PI;
    case CA_KERNEL_DISK:
    case CA_KERNEL_COUNT: break;
    }
    return CA_INV_PI;
}
