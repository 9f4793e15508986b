/* Reflection at smooth boundaries: exact, unpolarised Fresnel reflectances.
 *
 * Cosines are those of the angle to the normal on the side the light comes from, in [0, 1]. For dielectrics `eta` is
 * the index of refraction of the *far* side over that of the side the light comes from; for a path on the inside of a
 * boundary that is the reciprocal of the boundary's own index. Reflectances do not depend on the direction of travel:
 * F(cos_near, eta) = F(cos_far, 1/eta).
 *
 * Amplitudes, with s and p for the two polarisations: r_s = (c - q) / (c + q), r_p = (n^2 c - q) / (n^2 c + q), where
 * c is the near cosine, n the relative index, real or complex, and q = sqrt(n^2 - sin^2); unpolarised light reflects
 * (|r_s|^2 + |r_p|^2) / 2. */
#ifndef CA_MATERIAL_FRESNEL_H
#define CA_MATERIAL_FRESNEL_H

#include "math/numeric.h"
#include "math/rgb.h"
#include "math/vec.h"

/* Reflectance; *cos_far is the cosine on the far side, 0 at total internal reflection (and the reflectance 1).
 * 1 - sin^2 is written (eta - 1)(eta + 1) + cos^2 so that it is exact for eta = 1 and keeps its digits near it. */
static inline float ca_fresnel_dielectric(float cos_near, float eta, float *cos_far)
{
    const float scaled2 = (eta - 1.0f) * (eta + 1.0f) + cos_near * cos_near; /* (eta cos_far)^2 */
    if (!(scaled2 > 0.0f)) {
        *cos_far = 0.0f;
        return 1.0f;
    }
    const float scaled = sqrtf(scaled2), ratio = scaled / eta, far = ratio < 1.0f ? ratio : 1.0f;
    *cos_far = far;
    const float s = (cos_near - scaled) / (cos_near + scaled);
    const float p = (far - eta * cos_near) / (far + eta * cos_near);
    const float reflected = 0.5f * (s * s + p * p);
    return reflected < 1.0f ? reflected : 1.0f;
}

/* 1 - reflectance where both cosines are known: no difference is taken, so it keeps its digits at the critical angle,
 * and is the same to rounding when it is asked for from the other side. */
static inline float ca_fresnel_transmittance(float cos_near, float cos_far, float eta)
{
    const float s = cos_near + eta * cos_far, p = cos_far + eta * cos_near;
    return ca_min(2.0f * eta * cos_near * cos_far * (1.0f / (s * s) + 1.0f / (p * p)), 1.0f);
}

/* Reflectance of a metal of complex relative index eta + i k, seen from the outside. */
float ca_fresnel_conductor(float cos_near, float eta, float k);
ca_rgb ca_fresnel_conductor_rgb(float cos_near, ca_rgb eta, ca_rgb k);

/* Share of diffuse light that passes: 2 * integral of (1 - F(c, eta)) c dc over [0, 1]. By quadrature, to about 1e-6
 * of it, however small it is; for preparing materials, not for hot paths. A plastic's `internal_transmittance` is
 * that of 1/eta. */
float ca_fresnel_diffuse_transmittance(float eta);

/* Mirror direction of a local direction about the normal (0, 0, 1). */
static inline ca_vec3 ca_reflect_local(ca_vec3 w) { return (ca_vec3){-w.x, -w.y, w.z}; }

#endif
