/* Every BSDF's sampler against its density: models x roughness x incidence, from above and below. */
#include "support/bxdf_cases.h"
#include "support/chi_square.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

typedef struct bxdf_context {
    const ca_bxdf *bxdf;
    ca_vec3 wi;
} bxdf_context;

static bool draw(const void *context, const float u[3], ca_vec3 *direction)
{
    const bxdf_context *c = context;
    ca_bxdf_sample sample;
    const ca_vec2 u_direction = {u[1], u[2]};
    if (!ca_bxdf_sample_direction(c->bxdf, c->wi, u[0], u_direction, CA_FROM_CAMERA, &sample)) return false;
    *direction = sample.wo_local;
    return (sample.scatter & CA_SCATTER_DIRAC) == 0;
}

static float density(const void *context, ca_vec3 direction)
{
    const bxdf_context *c = context;
    return ca_bxdf_eval(c->bxdf, c->wi, direction, CA_FROM_CAMERA).pdf.v;
}

/* Where a lobe is narrow it lies around the mirror direction. */
static ca_vec3 mirror_of(ca_vec3 w) { return (ca_vec3){-w.x, -w.y, w.z}; }

/* Transmission goes by the refracted direction, so that both lobes are looked at closely. */
static ca_vec3 refracted_of(ca_vec3 w, float eta)
{
    const float scale = 1.0f / (w.z > 0.0f ? eta : 1.0f / eta);
    const float z2 = 1.0f - scale * scale * (1.0f - w.z * w.z);
    return z2 > 0.0f ? (ca_vec3){-scale * w.x, -scale * w.y, w.z > 0.0f ? -sqrtf(z2) : sqrtf(z2)} : mirror_of(w);
}

static uint32_t for_each_test(const ca_bxdf_cases *list, uint32_t test_count)
{
    uint32_t number = 0;
    for (uint32_t i = 0; i < list->count; ++i) {
        const ca_bxdf_case *entry = &list->cases[i];
        if ((ca_bxdf_scatter(&entry->bxdf) & CA_SCATTER_SMOOTH) == 0) continue;
        for (uint32_t k = 0; k < 2 * CA_TEST_INCIDENCE_COUNT; ++k) {
            const bool below = k >= CA_TEST_INCIDENCE_COUNT;
            if (below && !entry->two_sided) continue;
            ++number;
            if (test_count == 0) continue; /* only counting */
            const bxdf_context context = {&entry->bxdf, ca_test_incidence(k % CA_TEST_INCIDENCE_COUNT, below)};
            const bool refracts = entry->bxdf.kind == CA_BXDF_ROUGH_DIELECTRIC;
            char name[120];
            snprintf(name, sizeof name, "%s, cos %.2f", entry->name, (double)context.wi.z);
            ca_chi_square_assert(
                &(ca_chi_square_test){.name = name,
                                      .sample = draw,
                                      .pdf = density,
                                      .context = &context,
                                      .axis = refracts ? refracted_of(context.wi, entry->bxdf.as.rough_dielectric.eta)
                                                       : mirror_of(context.wi),
                                      .sample_count = 30000,
                                      .ring_count = 20,
                                      .cut_count = 10,
                                      .seed = number,
                                      .test_count = test_count});
        }
    }
    return number;
}

static void test_samplers_match_densities(void **state)
{
    (void)state;
    ca_bxdf_cases list = ca_bxdf_cases_create();
    const uint32_t count = for_each_test(&list, 0);
    assert_true(count > 150);
    for_each_test(&list, count);
    ca_bxdf_cases_destroy(&list);
}

/* The harness itself: it accepts what is right and rejects a density tilted by a tenth. */
static bool draw_uniform(const void *context, const float u[3], ca_vec3 *direction)
{
    (void)context;
    const float z = 1.0f - 2.0f * u[0], r = sqrtf(fmaxf(0.0f, 1.0f - z * z));
    *direction = (ca_vec3){r * cosf(6.2831853f * u[1]), r * sinf(6.2831853f * u[1]), z};
    return true;
}
static float density_uniform(const void *context, ca_vec3 direction)
{
    const float *tilt = context;
    return 0.0795774715f * (1.0f + *tilt * direction.x);
}

static void test_harness_sees_small_errors(void **state)
{
    (void)state;
    const float exact = 0.0f, tilted = 0.1f;
    ca_chi_square_test test = {.sample = draw_uniform, .pdf = density_uniform, .context = &exact, .seed = 1};
    ca_chi_square_result result = ca_chi_square_run(&test);
    assert_true(result.p_value > 0.001);
    assert_true(fabs(result.pdf_integral - 1.0) < 1e-5);
    test.context = &tilted;
    result = ca_chi_square_run(&test);
    assert_true(result.p_value < 1e-3);
    /* Known values of Q(a, x): e^-1 and erfc(1), and the chi-square table's 5 % for 10 degrees of freedom. */
    assert_true(fabs(ca_gamma_q(1.0, 1.0) - 0.36787944117144233) < 1e-12);
    assert_true(fabs(ca_gamma_q(0.5, 1.0) - 0.15729920705028513) < 1e-12);
    assert_true(fabs(ca_gamma_q(5.0, 0.5 * 18.307038053275146) - 0.05) < 1e-9);
    assert_true(fabs(ca_sidak_level(0.01, 1) - 0.01) < 1e-15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_harness_sees_small_errors),
        cmocka_unit_test(test_samplers_match_densities),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
