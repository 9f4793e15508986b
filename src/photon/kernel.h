/* Kernels of density estimation: how much a photon at some distance counts.
 *
 * A kernel of radius r is k(d^2 / r^2) / r^2 with an integral of one over the disk; "disk" is what plain photon
 * mapping has (Keller, Grünschloß, Droske, "Quasi-Monte Carlo Progressive Photon Mapping", equation 1), the smooth
 * ones follow its section 3. Units: m^-2. */
#ifndef CA_PHOTON_KERNEL_H
#define CA_PHOTON_KERNEL_H

#include "math/vec.h"

#include <stdbool.h>

typedef enum ca_kernel {
    CA_KERNEL_DISK,         /* 1 / pi */
    CA_KERNEL_EPANECHNIKOV, /* 2 / pi (1 - t), t = d^2 / r^2 */
    CA_KERNEL_SPH,          /* the cubic spline of smoothed particle hydrodynamics, in two dimensions, of support r */
    CA_KERNEL_COUNT
} ca_kernel;

/* k(t) for 0 <= t <= 1; 0 beyond. */
float ca_kernel_value(ca_kernel kernel, float t);

/* The gradient of k(|q - p|^2 / r^2) / r^2 with respect to the query point q, for offset = p - q, m^-3. Zero for the
 * disk, whose derivative lies on its rim. */
ca_vec3 ca_kernel_gradient(ca_kernel kernel, ca_vec3 offset, float radius);

/* Has it a derivative? */
static inline bool ca_kernel_is_smooth(ca_kernel kernel) { return kernel != CA_KERNEL_DISK; }

/* Integral of k(t)^2 over the unit disk: the variance of a smooth kernel's estimate over that of a density of one,
 * r^2 f. */
float ca_kernel_roughness(ca_kernel kernel);

#endif
