#include "material/fresnel.h"

/* With q = a + i b and s^2 = 1 - c^2:
 *     |r_s|^2 = (c^2 + a^2 + b^2 - 2 a c) / (c^2 + a^2 + b^2 + 2 a c)
 *     |r_p|^2 = |r_s|^2 (c^2 (a^2 + b^2) + s^4 - 2 a c s^2) / (c^2 (a^2 + b^2) + s^4 + 2 a c s^2)
 * where a^2 + b^2 = |n^2 - s^2| and 2 a^2 = |n^2 - s^2| + Re(n^2 - s^2). The second holds since n^2 = q^2 + s^2 makes
 * r_p = -r_s (q c - s^2) / (q c + s^2). */
float ca_fresnel_conductor(float cos_near, float eta, float k)
{
    const float c2 = cos_near * cos_near, s2 = c2 < 1.0f ? 1.0f - c2 : 0.0f;
    const float real = eta * eta - k * k - s2, imaginary = 2.0f * eta * k;
    const float modulus = sqrtf(real * real + imaginary * imaginary);
    const float a = ca_sqrt0(0.5f * (modulus + real));
    const float sum = modulus + c2, cross = 2.0f * a * cos_near;
    if (!(sum + cross > 0.0f)) return 0.0f; /* index 1 at grazing angle: nothing to reflect from */
    const float r_s = (sum - cross) / (sum + cross);
    const float sum_p = modulus * c2 + s2 * s2, cross_p = cross * s2;
    const float r_p = sum_p + cross_p > 0.0f ? r_s * (sum_p - cross_p) / (sum_p + cross_p) : r_s;
    return ca_clamp(0.5f * (r_s + r_p), 0.0f, 1.0f);
}

ca_rgb ca_fresnel_conductor_rgb(float cos_near, ca_rgb eta, ca_rgb k)
{
    return (ca_rgb){ca_fresnel_conductor(cos_near, eta.r, k.r), ca_fresnel_conductor(cos_near, eta.g, k.g),
                    ca_fresnel_conductor(cos_near, eta.b, k.b)};
}

/* From the thinner side the integrand is smooth in c: composite 4-point Gauss-Legendre. From the denser side, with
 * total reflection, the share that passes is that of the thinner side over the square of the index, since the
 * boundary passes the same radiance over n^2 both ways. */
float ca_fresnel_diffuse_transmittance(float eta)
{
    static const double node[4] = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813,
                                   0.93056815579702629};
    static const double weight[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                     0.17392742256872693};
    enum { PANELS = 64 };
    const double n = eta >= 1.0f ? (double)eta : 1.0 / (double)eta;
    double sum = 0.0;
    for (int i = 0; i < PANELS; ++i) {
        for (int j = 0; j < 4; ++j) {
            const double c = (i + node[j]) / PANELS, q = sqrt(n * n - 1.0 + c * c);
            const double s = c + q, p = n * n * c + q;
            sum += weight[j] * 4.0 * c * q * (1.0 / (s * s) + n * n / (p * p)) * c;
        }
    }
    const double outside = sum / PANELS;
    return (float)(eta >= 1.0f ? outside : outside / (n * n));
}
