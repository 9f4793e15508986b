/* Fresnel reflectances against complex amplitudes in double precision; microfacet distributions against their
 * defining integrals; the sampler of normals against its density. */
#include "material/fresnel.h"
#include "material/microfacet.h"
#include "math/numeric.h"
#include "support/bxdf_cases.h"
#include "support/chi_square.h"

#include <complex.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* ---- Fresnel --------------------------------------------------------------------------------------------------- */

/* Straight from the amplitudes with a complex angle of refraction. */
static double reference_reflectance(double cosine, double complex n)
{
    const double sine2 = 1.0 - cosine * cosine;
    const double complex cos_t = csqrt(1.0 - sine2 / (n * n));
    const double complex s = (cosine - n * cos_t) / (cosine + n * cos_t);
    const double complex p = (n * cosine - cos_t) / (n * cosine + cos_t);
    return 0.5 * (cabs(s) * cabs(s) + cabs(p) * cabs(p));
}

static void test_dielectric_fresnel(void **state)
{
    (void)state;
    static const double eta[8] = {1.5, 1.33, 2.4, 1.001, 0.999, 0.75, 1.0 / 1.5, 0.4};
    for (int i = 0; i < 8; ++i) {
        const float n = (float)eta[i];
        for (int k = 1; k <= 2000; ++k) {
            const float c = (float)k / 2000.0f;
            float cos_far;
            const float f = ca_fresnel_dielectric(c, n, &cos_far);
            const double sine_far2 = (1.0 - (double)c * (double)c) / ((double)n * (double)n);
            if (fabs(sine_far2 - 1.0) < 1e-5) continue; /* the critical angle itself: infinite slope */
            assert_true(fabs((double)f - reference_reflectance((double)c, (double)n)) < 3e-5);
            assert_true(fabs((double)cos_far - sqrt(fmax(0.0, 1.0 - sine_far2))) < 2e-5);
            if (sine_far2 > 1.0) {
                assert_true(f == 1.0f && cos_far == 0.0f);
                continue;
            }
            const double through = (double)ca_fresnel_transmittance(c, cos_far, n);
            assert_true(fabs(through - (1.0 - (double)f)) < 3e-6);
            float cos_back;
            const float back = ca_fresnel_dielectric(cos_far, 1.0f / n, &cos_back);
            if (cos_far > 0.02f && c > 0.02f) assert_true(fabsf(back - f) < 1e-3f && fabsf(cos_back - c) < 1e-4f);
        }
    }
    float cos_far;
    assert_true(fabsf(ca_fresnel_dielectric(1.0f, 1.5f, &cos_far) - 0.04f) < 1e-7f);
    assert_true(ca_fresnel_dielectric(0.0f, 1.5f, &cos_far) == 1.0f);
    for (float c = 1e-4f; c <= 1.0f; c += 0.01f) {
        assert_true(ca_fresnel_dielectric(c, 1.0f, &cos_far) == 0.0f);
        assert_true(cos_far == c);
    }
    /* Brewster's angle, tan = n: only the s half is left, ((n^2 - 1) / (n^2 + 1))^2 / 2. */
    const float brewster = 1.0f / sqrtf(1.0f + 1.5f * 1.5f);
    const float s_only = 0.5f * ca_sqr((1.5f * 1.5f - 1.0f) / (1.5f * 1.5f + 1.0f));
    assert_true(fabsf(ca_fresnel_dielectric(brewster, 1.5f, &cos_far) - s_only) < 1e-6f);
}

static void test_conductor_fresnel(void **state)
{
    (void)state;
    static const double index[7][2] = {{0.14, 4.0}, {1.44, 1.6}, {2.76, 3.87}, {0.05, 0.2},
                                       {1.5, 0.0},  {1.0, 1e-3}, {5.0, 9.0}};
    for (int i = 0; i < 7; ++i) {
        const float eta = (float)index[i][0], k = (float)index[i][1];
        for (int j = 1; j <= 1000; ++j) {
            const float c = (float)j / 1000.0f;
            const double reference = reference_reflectance((double)c, (double)eta + (double)k * (double complex)I);
            assert_true(fabs((double)ca_fresnel_conductor(c, eta, k) - reference) < 2e-5);
        }
        const double at_normal = ((index[i][0] - 1.0) * (index[i][0] - 1.0) + index[i][1] * index[i][1]) /
                                 ((index[i][0] + 1.0) * (index[i][0] + 1.0) + index[i][1] * index[i][1]);
        assert_true(fabs((double)ca_fresnel_conductor(1.0f, eta, k) - at_normal) < 1e-6);
        assert_true(ca_fresnel_conductor(0.0f, eta, k) == 1.0f);
    }
}

static void test_diffuse_reflectance(void **state)
{
    (void)state;
    static const double eta[6] = {1.001, 1.3, 1.5, 2.5, 1.0 / 1.5, 0.4};
    for (int i = 0; i < 6; ++i) {
        enum { STEPS = 200000 };
        double sum = 0.0;
        for (int k = 0; k < STEPS; ++k) {
            const double c = (k + 0.5) / STEPS;
            sum += 2.0 * c * reference_reflectance(c, eta[i]) / STEPS;
        }
        assert_true(fabs(1.0 - (double)ca_fresnel_diffuse_transmittance((float)eta[i]) - sum) < 1e-5);
    }
    assert_true(fabsf(ca_fresnel_diffuse_transmittance(1.0f) - 1.0f) < 1e-6f);
}

/* ---- Microfacets ----------------------------------------------------------------------------------------------- */

static const float alphas[5][2] = {{0.02f, 0.02f}, {0.2f, 0.2f}, {0.7f, 0.7f}, {1.0f, 1.0f}, {0.1f, 0.6f}};

/* Integrates over slopes (x, y) = -m.xy / m.z stretched by alpha, where every distribution is a fixed bump: r = slope
 * length from 0 to infinity as r = q / (1 - q). dm = dslope m.z^3. */
static void integrate_normals(const ca_microfacet *facets, ca_vec3 v, double *projected, double *visible)
{
    enum { RADII = 400, AZIMUTHS = 200 };
    const float masking = ca_microfacet_masking_over_cos(facets, v);
    *projected = *visible = 0.0;
    for (int i = 0; i < RADII; ++i) {
        const double q = (i + 0.5) / RADII, r = q / (1.0 - q), dr = 1.0 / (RADII * (1.0 - q) * (1.0 - q));
        for (int j = 0; j < AZIMUTHS; ++j) {
            const double phi = 2.0 * CA_PI_D * (j + 0.5) / AZIMUTHS;
            const double x = (double)facets->alpha_x * r * cos(phi), y = (double)facets->alpha_y * r * sin(phi);
            const double z = 1.0 / sqrt(1.0 + x * x + y * y);
            const double area = r * dr * (2.0 * CA_PI_D / AZIMUTHS) * (double)(facets->alpha_x * facets->alpha_y);
            const ca_vec3 m = {(float)(-x * z), (float)(-y * z), (float)z};
            const double dm = area * z * z * z, density = (double)ca_microfacet_density(facets, m);
            *projected += density * z * dm;
            *visible += density * (double)(masking * fmaxf(0.0f, ca_dot(v, m))) * dm;
        }
    }
}

static void test_normalisations(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 10; ++i) {
        const ca_microfacet facets =
            ca_microfacet_make((ca_microfacet_kind)(i % 2), alphas[i / 2][0], alphas[i / 2][1], true);
        for (uint32_t k = 0; k < CA_TEST_INCIDENCE_COUNT; ++k) {
            double projected, visible;
            integrate_normals(&facets, ca_test_incidence(k, false), &projected, &visible);
            if (fabs(projected - 1.0) > 3e-3 || fabs(visible - 1.0) > 3e-3)
                fail_msg("distribution %u, alpha %.2f %.2f, incidence %u: integral of D cos is %.5f, of D_v %.5f",
                         i % 2, (double)facets.alpha_x, (double)facets.alpha_y, k, projected, visible);
        }
    }
}

/* At normal incidence nothing is masked; near the horizon almost everything, in proportion to the cosine. */
static void test_masking_limits(void **state)
{
    (void)state;
    for (uint32_t kind = 0; kind < 2; ++kind) {
        const ca_microfacet facets = ca_microfacet_make((ca_microfacet_kind)kind, 0.5f, 0.5f, true);
        const float at_normal = ca_microfacet_masking_over_cos(&facets, ca_test_direction(1.0f, 0.0f));
        assert_true(at_normal == 1.0f);
        const float near_horizon = ca_microfacet_masking_over_cos(&facets, ca_test_direction(1e-6f, 0.0f));
        const float limit = kind == CA_MICROFACET_GGX ? 2.0f / 0.5f : 2.0f * sqrtf(CA_PI) / 0.5f;
        assert_true(fabsf(near_horizon / limit - 1.0f) < 1e-4f);
        const float from_below = ca_microfacet_masking_over_cos(&facets, ca_test_direction(-0.3f, 1.0f));
        assert_true(from_below == ca_microfacet_masking_over_cos(&facets, ca_test_direction(0.3f, 1.0f)));
    }
}

typedef struct normal_context {
    ca_microfacet facets;
    ca_vec3 v;
} normal_context;

static bool draw_normal(const void *context, const float u[3], ca_vec3 *direction)
{
    const normal_context *c = context;
    const ca_vec2 u2 = {u[0], u[1]};
    *direction = ca_microfacet_sample(&c->facets, c->v, u2);
    return true;
}

static float density_of_normal(const void *context, ca_vec3 m)
{
    const normal_context *c = context;
    const float cos_vm = ca_dot(c->v, m);
    if (!(m.z > 0.0f) || (c->facets.sample_visible && !(cos_vm > 0.0f))) return 0.0f;
    return ca_microfacet_pdf(&c->facets, ca_microfacet_density(&c->facets, m),
                             ca_microfacet_masking_over_cos(&c->facets, c->v), cos_vm, m.z);
}

static void test_normals_match_their_density(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < 20; ++i) {
        const float *alpha = alphas[i / 4];
        for (uint32_t k = 0; k < CA_TEST_INCIDENCE_COUNT; ++k) {
            const normal_context context = {
                ca_microfacet_make((ca_microfacet_kind)(i % 2), alpha[0], alpha[1], (i & 2) == 0),
                ca_test_incidence(k, false)};
            char name[120];
            snprintf(name, sizeof name, "%s normals, %s %.2f %.2f, cos %.2f", i & 2 ? "all" : "visible",
                     i % 2 ? "GGX" : "Beckmann", (double)alpha[0], (double)alpha[1], (double)context.v.z);
            ca_chi_square_assert(&(ca_chi_square_test){.name = name,
                                                       .sample = draw_normal,
                                                       .pdf = density_of_normal,
                                                       .context = &context,
                                                       .sample_count = 40000,
                                                       .ring_count = 20,
                                                       .cut_count = 12,
                                                       .seed = 1000 + 10 * i + k,
                                                       .test_count = 20 * CA_TEST_INCIDENCE_COUNT});
        }
    }
}

/* Neighbouring numbers give neighbouring normals: no jumps that would spoil stratified samples. */
static void test_visible_normals_are_continuous(void **state)
{
    (void)state;
    for (uint32_t kind = 0; kind < 2; ++kind) {
        const ca_microfacet facets = ca_microfacet_make((ca_microfacet_kind)kind, 0.3f, 0.3f, true);
        const ca_vec3 v = ca_test_incidence(2, false);
        for (uint32_t i = 1; i < 999; ++i) {
            const float u = (float)i / 1000.0f;
            for (uint32_t axis = 0; axis < 2; ++axis) {
                const ca_vec2 a = axis ? (ca_vec2){0.37f, u} : (ca_vec2){u, 0.37f};
                const ca_vec2 b = axis ? (ca_vec2){0.37f, u + 1e-3f} : (ca_vec2){u + 1e-3f, 0.37f};
                const ca_vec3 step = ca_sub(ca_microfacet_sample(&facets, v, a), ca_microfacet_sample(&facets, v, b));
                assert_true(ca_length(step) < 0.1f);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dielectric_fresnel),
        cmocka_unit_test(test_conductor_fresnel),
        cmocka_unit_test(test_diffuse_reflectance),
        cmocka_unit_test(test_normalisations),
        cmocka_unit_test(test_masking_limits),
        cmocka_unit_test(test_normals_match_their_density),
        cmocka_unit_test(test_visible_normals_are_continuous),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
