/* White furnace: how much of the light a BSDF gets it gives back, by its sampler and by quadrature of its value.
 * Carried light is counted as flux (from the light), which refraction does not scale. */
#include "base/memory.h"
#include "material/fresnel.h"
#include "material/microfacet.h"
#include "material/rough_transmittance.h"
#include "math/numeric.h"
#include "support/bxdf_cases.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* The mean weight of `root`^3 samples, one in each cell of the unit cube, and its standard error (bounded by that of
 * unstratified samples). The components differ only in colour: all three are kept. */
typedef struct furnace {
    double mean[3], error;
} furnace;

static furnace sampled_albedo(const ca_bxdf *bxdf, ca_vec3 wi, uint32_t root, uint64_t seed, uint32_t scatter_mask)
{
    ca_test_random random = ca_test_random_seed(seed);
    double sum[3] = {0.0, 0.0, 0.0}, square = 0.0;
    const uint32_t count = root * root * root;
    for (uint32_t i = 0; i < count; ++i) {
        const float cell = 1.0f / (float)root;
        const float x = ((float)(i % root) + ca_test_random_float(&random)) * cell;
        const float y = ((float)(i / root % root) + ca_test_random_float(&random)) * cell;
        const float z = ((float)(i / root / root) + ca_test_random_float(&random)) * cell;
        const ca_vec2 u = {fminf(x, CA_ONE_MINUS_EPSILON), fminf(y, CA_ONE_MINUS_EPSILON)};
        ca_bxdf_sample s;
        if (!ca_bxdf_sample_direction(bxdf, wi, fminf(z, CA_ONE_MINUS_EPSILON), u, CA_FROM_LIGHT, &s)) continue;
        if ((s.scatter & scatter_mask) == 0) continue;
        sum[0] += (double)s.weight.r;
        sum[1] += (double)s.weight.g;
        sum[2] += (double)s.weight.b;
        square += (double)(s.weight.r * s.weight.r);
    }
    furnace result = {.mean = {sum[0] / count, sum[1] / count, sum[2] / count}};
    result.error = sqrt(fmax(0.0, square / count - result.mean[0] * result.mean[0]) / count);
    return result;
}

static furnace whole_albedo(const ca_bxdf *bxdf, ca_vec3 wi, uint32_t root, uint64_t seed)
{
    return sampled_albedo(bxdf, wi, root, seed, ~0u);
}

/* Integral of f |cos| over the sphere: midpoints in the sine (which resolves lobes near the poles) and the azimuth of
 * each hemisphere. For wide lobes. */
static double quadrature_albedo(const ca_bxdf *bxdf, ca_vec3 wi)
{
    enum { ELEVATIONS = 400, AZIMUTHS = 200 };
    double sum = 0.0;
    for (int side = 0; side < 2; ++side) {
        for (int i = 0; i < ELEVATIONS; ++i) {
            const float s = ((float)i + 0.5f) / ELEVATIONS, c = sqrtf(1.0f - s * s);
            for (int j = 0; j < AZIMUTHS; ++j) {
                const ca_vec3 wo = ca_test_direction(side ? -c : c, CA_TWO_PI * ((float)j + 0.5f) / AZIMUTHS);
                sum += (double)(s * ca_bxdf_eval(bxdf, wi, wo, CA_FROM_LIGHT).f.r);
            }
        }
    }
    return sum * 2.0 * CA_PI_D / (ELEVATIONS * AZIMUTHS); /* |cos| dw = s ds dphi */
}

static void test_lossless_models_give_all_back(void **state)
{
    (void)state;
    uint32_t tested = 0;
    double worst = 0.0;
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        const ca_bxdf_case *entry = &ca_test_bxdfs.cases[i];
        if (!entry->lossless) continue;
        for (uint32_t k = 0; k < 2 * CA_TEST_INCIDENCE_COUNT; ++k) {
            const bool below = k >= CA_TEST_INCIDENCE_COUNT;
            if (below && !entry->two_sided) continue;
            const ca_vec3 wi = ca_test_incidence(k % CA_TEST_INCIDENCE_COUNT, below);
            const furnace f = whole_albedo(&entry->bxdf, wi, 50, k);
            worst = fmax(worst, fabs(f.mean[1] - 1.0));
            if (fabs(f.mean[1] - 1.0) > 0.005)
                fail_msg("%s, cos %.2f: albedo %.5f is not 1", entry->name, (double)wi.z, f.mean[1]);
            const ca_rgb albedo = ca_bxdf_albedo(&entry->bxdf, wi);
            assert_true(fabsf(albedo.g - 1.0f) < 0.005f);
            ++tested;
        }
    }
    assert_true(tested > 60);
    print_message("white furnace: %u cases, largest deviation %.2e\n", tested, worst);
}

static void test_no_physical_model_makes_light(void **state)
{
    (void)state;
    double most = 0.0;
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        const ca_bxdf_case *entry = &ca_test_bxdfs.cases[i];
        if (!entry->is_physical) continue;
        for (uint32_t k = 0; k < 2 * CA_TEST_INCIDENCE_COUNT; ++k) {
            const ca_vec3 wi = ca_test_incidence(k % CA_TEST_INCIDENCE_COUNT, k >= CA_TEST_INCIDENCE_COUNT);
            const furnace f = whole_albedo(&entry->bxdf, wi, 24, 100 + k);
            for (int channel = 0; channel < 3; ++channel) {
                most = fmax(most, f.mean[channel] - 3.0 * f.error);
                if (f.mean[channel] > 1.0 + 1e-3 + 4.0 * f.error)
                    fail_msg("%s, cos %.2f: albedo %.5f +- %.5f is above 1", entry->name, (double)wi.z,
                             f.mean[channel], f.error);
            }
        }
    }
    print_message("largest albedo: %.5f\n", most);
}

/* Sampler and value must mean the same light. Only lobes that the grid of the quadrature resolves. */
static void test_sampled_albedo_is_the_integral_of_the_value(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        const ca_bxdf *bxdf = &ca_test_bxdfs.cases[i].bxdf;
        float alpha = 1.0f;
        if (bxdf->kind == CA_BXDF_ROUGH_CONDUCTOR) alpha = bxdf->as.rough_conductor.facets.alpha_x;
        if (bxdf->kind == CA_BXDF_ROUGH_DIELECTRIC) alpha = bxdf->as.rough_dielectric.facets.alpha_x;
        if (bxdf->kind == CA_BXDF_ROUGH_PLASTIC) alpha = bxdf->as.rough_plastic.facets.alpha_x;
        if (bxdf->kind == CA_BXDF_PRINCIPLED && bxdf->as.principled.eta == 1.0f) alpha = 0.0f;
        if (bxdf->kind == CA_BXDF_PRINCIPLED && bxdf->as.principled.clearcoat > 0.0f) alpha = 0.0f;
        if (bxdf->kind == CA_BXDF_WARD) alpha = bxdf->as.ward.alpha_x;
        if (bxdf->kind == CA_BXDF_PRINCIPLED_THIN) alpha = ca_sqr(bxdf->as.principled_thin.roughness);
        if (bxdf->kind == CA_BXDF_PRINCIPLED_THIN && bxdf->as.principled_thin.anisotropic > 0.0f) alpha = 0.0f;
        if (alpha < 0.3f || (ca_bxdf_scatter(bxdf) & CA_SCATTER_SMOOTH) == 0) continue;
        for (uint32_t k = 0; k < 3; ++k) {
            const ca_vec3 wi = ca_test_incidence(k, false);
            const furnace f = sampled_albedo(bxdf, wi, 30, 200 + k, CA_SCATTER_SMOOTH);
            const double integral = quadrature_albedo(bxdf, wi);
            if (fabs(f.mean[0] - integral) > 0.003 + 4.0 * f.error)
                fail_msg("%s, cos %.2f: sampled albedo %.5f +- %.5f, integral %.5f", ca_test_bxdfs.cases[i].name,
                         (double)wi.z, f.mean[0], f.error, integral);
        }
    }
}

/* alpha -> 0: rough models become their smooth namesakes, event by event and in sum. */
static void test_rough_models_approach_smooth_ones(void **state)
{
    (void)state;
    const ca_rgb white = {1.0f, 1.0f, 1.0f};
    for (int kind = 0; kind < 2; ++kind) {
        const ca_microfacet facets = ca_microfacet_make((ca_microfacet_kind)kind, 0.0f, 0.0f, true);
        ca_rough_transmittance *table = ca_rough_transmittance_create((ca_microfacet_kind)kind, 0.0f, 1.5f);
        assert_non_null(table);
        const float inside = ca_fresnel_diffuse_transmittance(1.0f / 1.5f);
        assert_true(fabsf(ca_rough_transmittance_from_inside(table) - inside) < 5e-4f);
        const ca_bxdf rough[3] = {
            {.kind = CA_BXDF_ROUGH_DIELECTRIC, .as.rough_dielectric = {1.5f, white, white, facets}},
            {.kind = CA_BXDF_ROUGH_CONDUCTOR,
             .as.rough_conductor = {{0.2f, 0.9f, 1.4f}, {3.9f, 2.4f, 1.6f}, white, facets}},
            {.kind = CA_BXDF_ROUGH_PLASTIC,
             .as.rough_plastic = {white, white, 1.5f, ca_rough_transmittance_from_inside(table), 0.5f, false,
                                  facets, table}}};
        const ca_bxdf smooth[3] = {
            {.kind = CA_BXDF_DIELECTRIC, .as.dielectric = {1.5f, white, white}},
            {.kind = CA_BXDF_CONDUCTOR, .as.conductor = {{0.2f, 0.9f, 1.4f}, {3.9f, 2.4f, 1.6f}, white}},
            {.kind = CA_BXDF_PLASTIC, .as.plastic = {white, white, 1.5f, inside, 0.5f, false}}};
        for (int model = 0; model < 3; ++model) {
            for (uint32_t k = 0; k < CA_TEST_INCIDENCE_COUNT; ++k) {
                const ca_vec3 wi = ca_test_incidence(k, false);
                const furnace a = whole_albedo(&rough[model], wi, 30, 300 + k);
                const furnace b = whole_albedo(&smooth[model], wi, 30, 300 + k);
                for (int channel = 0; channel < 3; ++channel)
                    if (fabs(a.mean[channel] - b.mean[channel]) > 0.005)
                        fail_msg("model %d, distribution %d, cos %.2f: %.5f rough, %.5f smooth", model, kind,
                                 (double)wi.z, a.mean[channel], b.mean[channel]);
                ca_bxdf_sample s, t;
                const ca_vec2 u = {0.3f, 0.6f};
                if (model == 2) continue;
                assert_true(ca_bxdf_sample_direction(&rough[model], wi, 0.9f, u, CA_FROM_CAMERA, &s));
                assert_true(ca_bxdf_sample_direction(&smooth[model], wi, 0.9f, u, CA_FROM_CAMERA, &t));
                assert_true(ca_dot(s.wo_local, t.wo_local) > 1.0f - 1e-5f);
            }
        }
        ca_rough_transmittance_destroy(table);
    }
}

/* The table of a rough plastic against the rough dielectric it stands for. */
static void test_rough_transmittance_matches_rough_dielectric(void **state)
{
    (void)state;
    static const float alpha[3] = {0.05f, 0.3f, 0.9f};
    const ca_rgb white = {1.0f, 1.0f, 1.0f};
    for (uint32_t i = 0; i < 6; ++i) {
        const ca_microfacet facets =
            ca_microfacet_make((ca_microfacet_kind)(i % 2), alpha[i / 2], alpha[i / 2], true);
        ca_rough_transmittance *table = ca_rough_transmittance_create(facets.kind, facets.alpha_x, 1.49f);
        assert_non_null(table);
        const ca_bxdf glass = {.kind = CA_BXDF_ROUGH_DIELECTRIC,
                               .as.rough_dielectric = {1.49f, white, white, facets}};
        for (float cosine = 0.02f; cosine <= 1.0f; cosine += 0.089f) {
            const furnace f =
                sampled_albedo(&glass, ca_test_direction(cosine, 0.4f), 40, 400 + i, CA_SCATTER_TRANSMISSION);
            const double tabulated = (double)ca_rough_transmittance_eval(table, cosine);
            if (fabs(f.mean[0] - tabulated) > 0.003 + 4.0 * f.error)
                fail_msg("alpha %.2f, cos %.2f: %.5f tabulated, %.5f +- %.5f sampled", (double)facets.alpha_x,
                         (double)cosine, tabulated, f.mean[0], f.error);
        }
        double inside = 0.0;
        for (uint32_t k = 0; k < 40; ++k) {
            const ca_vec3 wi = ca_test_direction(-sqrtf(((float)k + 0.5f) / 40.0f), 0.4f);
            inside += sampled_albedo(&glass, wi, 20, 500 + k, CA_SCATTER_REFLECTION).mean[0] / 40.0;
        }
        assert_true(fabs(1.0 - inside - (double)ca_rough_transmittance_from_inside(table)) < 0.005);
        ca_rough_transmittance_destroy(table);
    }
}

static void test_table_reports_lack_of_memory(void **state)
{
    (void)state;
    ca_memory_fail_after(0);
    assert_null(ca_rough_transmittance_create(CA_MICROFACET_GGX, 0.2f, 1.5f));
    ca_memory_fail_after(-1);
    ca_rough_transmittance_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lossless_models_give_all_back),
        cmocka_unit_test(test_no_physical_model_makes_light),
        cmocka_unit_test(test_sampled_albedo_is_the_integral_of_the_value),
        cmocka_unit_test(test_rough_models_approach_smooth_ones),
        cmocka_unit_test(test_rough_transmittance_matches_rough_dielectric),
        cmocka_unit_test(test_table_reports_lack_of_memory),
    };
    return cmocka_run_group_tests(tests, ca_test_bxdfs_make, ca_test_bxdfs_free);
}
