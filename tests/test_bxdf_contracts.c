/* What bxdf.h promises of every model, checked point by point: sampling, evaluation and both densities agree; reverse
 * densities, reciprocity and adjoints; finite and non-negative numbers in every corner. */
#include "math/numeric.h"
#include "support/bxdf_cases.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static ca_vec3 random_direction(ca_test_random *random)
{
    const float z = 2.0f * ca_test_random_float(random) - 1.0f;
    return ca_test_direction(z, CA_TWO_PI * ca_test_random_float(random));
}

/* |a - b| within a relative tolerance of the larger. */
static bool is_near(float a, float b, float relative, float absolute)
{
    return fabsf(a - b) <= relative * fmaxf(fabsf(a), fabsf(b)) + absolute;
}

static void expect_near(const ca_bxdf_case *entry, const char *what, float a, float b, float relative, float absolute,
                        ca_vec3 wi, ca_vec3 wo)
{
    if (is_near(a, b, relative, absolute)) return;
    fail_msg("%s: %s: %.8g and %.8g differ; wi (%.9g %.9g %.9g), wo (%.9g %.9g %.9g)", entry->name, what, (double)a,
             (double)b, (double)wi.x, (double)wi.y, (double)wi.z, (double)wo.x, (double)wo.y, (double)wo.z);
}

static float index_seen_from(const ca_bxdf *bxdf, float cosine)
{
    float eta = 1.0f;
    if (bxdf->kind == CA_BXDF_DIELECTRIC) eta = bxdf->as.dielectric.eta;
    if (bxdf->kind == CA_BXDF_ROUGH_DIELECTRIC) eta = bxdf->as.rough_dielectric.eta;
    if (bxdf->kind == CA_BXDF_PRINCIPLED) eta = bxdf->as.principled.eta == 1.0f ? 1.001f : bxdf->as.principled.eta;
    return cosine > 0.0f ? eta : 1.0f / eta;
}

/* Narrow lobes, and refraction at nearly equal indices, magnify the rounding of directions. */
static float tolerance_for(const ca_bxdf *bxdf)
{
    if (bxdf->kind == CA_BXDF_PRINCIPLED && bxdf->as.principled.eta == 1.0f) return 0.05f;
    return 4e-3f;
}

/* ---- Sampling and evaluation ----------------------------------------------------------------------------------- */

static void check_smooth_sample(const ca_bxdf_case *entry, ca_vec3 wi, ca_from from, const ca_bxdf_sample *s)
{
    const ca_bxdf_value value = ca_bxdf_eval(&entry->bxdf, wi, s->wo_local, from);
    const float cosine = fabsf(s->wo_local.z), tolerance = tolerance_for(&entry->bxdf);
    expect_near(entry, "pdf", s->pdf.v, value.pdf.v, tolerance, 1e-6f, wi, s->wo_local);
    expect_near(entry, "pdf_reverse", s->pdf_reverse.v, value.pdf_reverse.v, tolerance, 1e-6f, wi, s->wo_local);
    expect_near(entry, "weight pdf = f |cos|, red", s->weight.r * s->pdf.v, value.f.r * cosine, tolerance, 1e-6f, wi,
                s->wo_local);
    expect_near(entry, "weight pdf = f |cos|, blue", s->weight.b * s->pdf.v, value.f.b * cosine, tolerance, 1e-6f, wi,
                s->wo_local);
}

/* A Dirac event and its reversal: the other way round the sampler finds the same pair of directions, and its
 * probability there is the reverse probability here. */
static void check_dirac_sample(const ca_bxdf_case *entry, ca_vec3 wi, ca_from from, const ca_bxdf_sample *s)
{
    if ((ca_bxdf_scatter(&entry->bxdf) & CA_SCATTER_SMOOTH) == 0) {
        const ca_bxdf_value value = ca_bxdf_eval(&entry->bxdf, wi, s->wo_local, from);
        assert_true(value.pdf.v == 0.0f && value.pdf_reverse.v == 0.0f && ca_rgb_is_black(value.f));
    }
    if (fabsf(s->wo_local.z) < 2e-2f || fabsf(wi.z) < 2e-2f)
        return; /* grazing: Fresnel terms magnify the rounding of the direction */
    const bool passes = (s->scatter & CA_SCATTER_TRANSMISSION) != 0;
    const ca_vec2 u = {0.5f, 0.5f};
    ca_bxdf_sample back;
    assert_true(
        ca_bxdf_sample_direction(&entry->bxdf, s->wo_local, passes ? CA_ONE_MINUS_EPSILON : 0.0f, u, from, &back));
    assert_int_equal(back.scatter, s->scatter);
    expect_near(entry, "way back", ca_dot(back.wo_local, wi), 1.0f, 1e-5f, 0.0f, wi, s->wo_local);
    expect_near(entry, "reverse probability", s->pdf_reverse.v, back.pdf.v, 1e-3f, 1e-5f, wi, s->wo_local);
    /* f(wi, wo, camera) = f(wo, wi, light). Of a Dirac event f is value / |cos_o| times a Dirac density in wo, and
     * the densities in wo and in wi differ by n_o^2 |cos_o| : n_i^2 |cos_i|: so the camera's value times eta^2 is the
     * light's. A value is weight times probability. */
    ca_bxdf_sample adjoint;
    assert_true(ca_bxdf_sample_direction(&entry->bxdf, s->wo_local, passes ? CA_ONE_MINUS_EPSILON : 0.0f, u,
                                         from == CA_FROM_CAMERA ? CA_FROM_LIGHT : CA_FROM_CAMERA, &adjoint));
    const float here = s->weight.g * s->pdf.v * (from == CA_FROM_CAMERA ? s->eta * s->eta : 1.0f);
    const float there =
        adjoint.weight.g * adjoint.pdf.v * (from == CA_FROM_CAMERA ? 1.0f : adjoint.eta * adjoint.eta);
    expect_near(entry, "adjoint of a Dirac event", here, there, 1e-3f, 1e-5f, wi, s->wo_local);
}

static void check_flags(const ca_bxdf_case *entry, ca_vec3 wi, const ca_bxdf_sample *s)
{
    const bool passes = wi.z * s->wo_local.z < 0.0f;
    const uint32_t kinds = s->scatter & (CA_SCATTER_DIRAC | CA_SCATTER_SMOOTH);
    assert_true(kinds == CA_SCATTER_DIRAC || kinds == CA_SCATTER_SMOOTH);
    assert_int_equal((s->scatter & CA_SCATTER_TRANSMISSION) != 0, passes);
    assert_int_equal((s->scatter & CA_SCATTER_REFLECTION) != 0, !passes);
    assert_true((s->scatter & ~ca_bxdf_scatter(&entry->bxdf)) == 0);
    const bool refracts = passes && entry->bxdf.kind != CA_BXDF_THIN_DIELECTRIC;
    expect_near(entry, "eta", s->eta, refracts ? index_seen_from(&entry->bxdf, wi.z) : 1.0f, 1e-6f, 0.0f, wi,
                s->wo_local);
}

static void test_samples_agree_with_evaluation(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(11);
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        const ca_bxdf_case *entry = &ca_test_bxdfs.cases[i];
        uint32_t accepted = 0;
        for (uint32_t k = 0; k < 4000; ++k) {
            ca_vec3 wi = random_direction(&random);
            if (!entry->two_sided) wi.z = fabsf(wi.z);
            if (fabsf(wi.z) < 1e-3f) continue; /* the corners have their own test */
            const ca_from from = k & 1 ? CA_FROM_LIGHT : CA_FROM_CAMERA;
            const float u_lobe = ca_test_random_float(&random);
            const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
            ca_bxdf_sample s;
            if (!ca_bxdf_sample_direction(&entry->bxdf, wi, u_lobe, u, from, &s)) continue;
            ++accepted;
            expect_near(entry, "length of wo", ca_length(s.wo_local), 1.0f, 2e-6f, 0.0f, wi, s.wo_local);
            check_flags(entry, wi, &s);
            if (s.scatter & CA_SCATTER_DIRAC)
                check_dirac_sample(entry, wi, from, &s);
            else
                check_smooth_sample(entry, wi, from, &s);
        }
        assert_true(accepted > 1000);
    }
}

/* ---- Symmetries ------------------------------------------------------------------------------------------------ */

/* wo from the sampler half of the time, so that narrow lobes are hit, else anywhere. */
static bool choose_pair(const ca_bxdf_case *entry, ca_test_random *random, ca_vec3 *wi, ca_vec3 *wo)
{
    *wi = random_direction(random);
    *wo = random_direction(random);
    if (ca_test_random_u32(random) & 1) {
        ca_bxdf_sample s;
        const float u_lobe = ca_test_random_float(random);
        const ca_vec2 u = {ca_test_random_float(random), ca_test_random_float(random)};
        if (!ca_bxdf_sample_direction(&entry->bxdf, *wi, u_lobe, u, CA_FROM_CAMERA, &s)) return false;
        *wo = s.wo_local;
    }
    return fabsf(wi->z) > 1e-3f && fabsf(wo->z) > 1e-3f;
}

static void test_reverse_adjoint_and_reciprocal(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(12);
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        const ca_bxdf_case *entry = &ca_test_bxdfs.cases[i];
        if ((ca_bxdf_scatter(&entry->bxdf) & CA_SCATTER_SMOOTH) == 0) continue;
        const float tolerance = tolerance_for(&entry->bxdf);
        uint32_t non_zero = 0;
        for (uint32_t k = 0; k < 5000; ++k) {
            ca_vec3 wi, wo;
            if (!choose_pair(entry, &random, &wi, &wo)) continue;
            const ca_bxdf_value camera = ca_bxdf_eval(&entry->bxdf, wi, wo, CA_FROM_CAMERA);
            const ca_bxdf_value light = ca_bxdf_eval(&entry->bxdf, wo, wi, CA_FROM_LIGHT);
            const ca_bxdf_value back = ca_bxdf_eval(&entry->bxdf, wo, wi, CA_FROM_CAMERA);
            non_zero += camera.f.r > 0.0f;
            expect_near(entry, "reverse density", camera.pdf_reverse.v, light.pdf.v, tolerance, 1e-6f, wi, wo);
            expect_near(entry, "density", camera.pdf.v, light.pdf_reverse.v, tolerance, 1e-6f, wi, wo);
            expect_near(entry, "adjoint, red", camera.f.r, light.f.r, tolerance, 1e-6f, wi, wo);
            expect_near(entry, "adjoint, blue", camera.f.b, light.f.b, tolerance, 1e-6f, wi, wo);
            /* Thin principled sheets transmit by a rule of eye and light, which is not reciprocal. */
            if (entry->bxdf.kind == CA_BXDF_PRINCIPLED_THIN && wi.z * wo.z < 0.0f) continue;
            /* Radiance over the square of the index: f(wi, wo) n_o^2 = f(wo, wi) n_i^2. */
            const float ratio = wi.z * wo.z > 0.0f ? 1.0f : ca_sqr(index_seen_from(&entry->bxdf, wi.z));
            expect_near(entry, "reciprocity", camera.f.g * ratio, back.f.g, tolerance, 1e-6f, wi, wo);
        }
        assert_true(non_zero > 500);
    }
}

/* The pair that a facet refracts which is seen from the thinner side under `cosine`, nearly edge-on: from the denser
 * side it is near the critical angle. false where it lies on the wrong sides of the surface. */
static bool grazing_pair(float index, float cosine, ca_test_random *random, ca_vec3 *thin, ca_vec3 *dense)
{
    const double c = (double)cosine, n = (double)fmaxf(index, 1.0f / index);
    const ca_vec3 m = random_direction(random);
    const ca_vec3 t = ca_normalize(ca_cross(m, random_direction(random)));
    const double cos_dense = sqrt(1.0 - (1.0 - c * c) / (n * n)), sine = sqrt(1.0 - c * c);
    *thin = ca_madd(ca_mul(m, cosine), (float)sine, t);
    *dense = ca_madd(ca_mul(m, (float)-cos_dense), (float)(-sine / n), t);
    const float side = index > 1.0f ? 1.0f : -1.0f; /* of the thinner medium */
    return m.z * side > 0.1f && thin->z * side > 0.1f && dense->z * side < -0.1f;
}

/* What such a pair's density keeps of its digits is the same whichever end asks: about those of its cosine. */
static void test_reverse_at_the_critical_angle(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(17);
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        const ca_bxdf_case *entry = &ca_test_bxdfs.cases[i];
        const float index = index_seen_from(&entry->bxdf, 1.0f);
        const uint32_t needed = CA_SCATTER_SMOOTH | CA_SCATTER_TRANSMISSION;
        if ((ca_bxdf_scatter(&entry->bxdf) & needed) != needed || index == 1.0f) continue;
        for (uint32_t k = 0; k < 5000; ++k) {
            const float cosine = powf(10.0f, -1.0f - 2.0f * ca_test_random_float(&random));
            ca_vec3 wi, wo;
            if (!grazing_pair(index, cosine, &random, &wi, &wo)) continue;
            const ca_bxdf_value there = ca_bxdf_eval(&entry->bxdf, wi, wo, CA_FROM_CAMERA);
            const ca_bxdf_value back = ca_bxdf_eval(&entry->bxdf, wo, wi, CA_FROM_LIGHT);
            const float tolerance = tolerance_for(&entry->bxdf) + 2e-6f / cosine;
            expect_near(entry, "reverse density", there.pdf_reverse.v, back.pdf.v, tolerance, 0.0f, wi, wo);
            expect_near(entry, "density", there.pdf.v, back.pdf_reverse.v, tolerance, 0.0f, wi, wo);
        }
    }
}

/* Dirac events by hand: glass of index 1.5 at normal incidence reflects 4 %, refracts by Snell's law, and a camera
 * path carries 1/1.5^2 of the radiance in and 1.5^2 of it out, a light path all of its flux; a thin sheet reflects R
 * + T^2 R + T^2 R^3 + ... */
static void test_known_dirac_events(void **state)
{
    (void)state;
    const ca_rgb white = {1.0f, 1.0f, 1.0f};
    const ca_bxdf glass = {.kind = CA_BXDF_DIELECTRIC, .as.dielectric = {1.5f, white, white}};
    const ca_bxdf sheet = {.kind = CA_BXDF_THIN_DIELECTRIC, .as.thin_dielectric = {1.5f, white, white}};
    const ca_vec3 down = {0.0f, 0.0f, 1.0f}, up = {0.0f, 0.0f, -1.0f}, slanted = {0.6f, 0.0f, 0.8f};
    const ca_vec2 u = {0.5f, 0.5f};
    ca_bxdf_sample s;
    assert_true(ca_bxdf_sample_direction(&glass, down, 0.039f, u, CA_FROM_CAMERA, &s));
    assert_true(s.wo_local.z == 1.0f && fabsf(s.pdf.v - 0.04f) < 1e-6f && s.weight.r == 1.0f && s.eta == 1.0f);
    assert_true(ca_bxdf_sample_direction(&glass, down, 0.041f, u, CA_FROM_CAMERA, &s));
    assert_true(s.wo_local.z == -1.0f && fabsf(s.weight.r - 1.0f / 2.25f) < 1e-6f && s.eta == 1.5f);
    assert_true(ca_bxdf_sample_direction(&glass, up, 0.041f, u, CA_FROM_CAMERA, &s));
    assert_true(s.wo_local.z == 1.0f && fabsf(s.weight.r - 2.25f) < 1e-6f && fabsf(s.eta - 1.0f / 1.5f) < 1e-6f);
    assert_true(ca_bxdf_sample_direction(&glass, up, 0.041f, u, CA_FROM_LIGHT, &s) && s.weight.r == 1.0f);
    assert_true(ca_bxdf_sample_direction(&glass, slanted, 0.9f, u, CA_FROM_LIGHT, &s));
    assert_true(fabsf(s.wo_local.x + 0.4f) < 1e-6f && fabsf(s.wo_local.z + sqrtf(0.84f)) < 1e-6f);
    /* Beyond the critical angle, sin > 1/1.5, all is reflected, whatever the number. */
    const ca_vec3 below = {0.8f, 0.0f, -0.6f};
    assert_true(ca_bxdf_sample_direction(&glass, below, CA_ONE_MINUS_EPSILON, u, CA_FROM_CAMERA, &s));
    assert_true(s.wo_local.x == -0.8f && s.wo_local.z == -0.6f && s.pdf.v == 1.0f && s.eta == 1.0f);

    float series = 0.04f, inside = 0.96f * 0.96f * 0.04f;
    for (int i = 0; i < 20; ++i, inside *= 0.04f * 0.04f) series += inside;
    assert_true(ca_bxdf_sample_direction(&sheet, down, 0.0f, u, CA_FROM_CAMERA, &s));
    assert_true(fabsf(s.pdf.v - series) < 1e-6f && s.weight.r == 1.0f);
    assert_true(ca_bxdf_sample_direction(&sheet, slanted, 0.9f, u, CA_FROM_CAMERA, &s));
    assert_true(s.wo_local.x == -0.6f && s.wo_local.z == -0.8f && s.weight.r == 1.0f && s.eta == 1.0f);
}

/* Light from below an opaque BSDF, and through it, is absorbed. */
static void test_one_sided_models_are_black_below(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(13);
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        const ca_bxdf_case *entry = &ca_test_bxdfs.cases[i];
        if (entry->two_sided) continue;
        for (uint32_t k = 0; k < 500; ++k) {
            const ca_vec3 wi = random_direction(&random), wo = random_direction(&random);
            if (wi.z > 0.0f && wo.z > 0.0f) continue;
            const ca_bxdf_value value = ca_bxdf_eval(&entry->bxdf, wi, wo, CA_FROM_CAMERA);
            assert_true(ca_rgb_is_black(value.f) && value.pdf.v == 0.0f && value.pdf_reverse.v == 0.0f);
            ca_bxdf_sample s;
            const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
            if (wi.z < 0.0f) assert_false(ca_bxdf_sample_direction(&entry->bxdf, wi, u.x, u, CA_FROM_LIGHT, &s));
        }
    }
}

/* ---- Corners --------------------------------------------------------------------------------------------------- */

static void expect_good_number(const ca_bxdf_case *entry, const char *what, float x, ca_vec3 wi, ca_vec3 wo)
{
    if (isfinite(x) && x >= 0.0f) return;
    fail_msg("%s: %s is %g; wi (%a %a %a), wo (%a %a %a)", entry->name, what, (double)x, (double)wi.x, (double)wi.y,
             (double)wi.z, (double)wo.x, (double)wo.y, (double)wo.z);
}

static void expect_good_value(const ca_bxdf_case *entry, ca_vec3 wi, ca_vec3 wo, ca_from from)
{
    const ca_bxdf_value value = ca_bxdf_eval(&entry->bxdf, wi, wo, from);
    expect_good_number(entry, "f red", value.f.r, wi, wo);
    expect_good_number(entry, "f green", value.f.g, wi, wo);
    expect_good_number(entry, "f blue", value.f.b, wi, wo);
    expect_good_number(entry, "pdf", value.pdf.v, wi, wo);
    expect_good_number(entry, "pdf_reverse", value.pdf_reverse.v, wi, wo);
}

static void expect_good_sample(const ca_bxdf_case *entry, ca_vec3 wi, float u_lobe, ca_vec2 u, ca_from from)
{
    ca_bxdf_sample s;
    if (!ca_bxdf_sample_direction(&entry->bxdf, wi, u_lobe, u, from, &s)) return;
    expect_good_number(entry, "weight red", s.weight.r, wi, s.wo_local);
    expect_good_number(entry, "weight green", s.weight.g, wi, s.wo_local);
    expect_good_number(entry, "weight blue", s.weight.b, wi, s.wo_local);
    expect_good_number(entry, "sampled pdf", s.pdf.v, wi, s.wo_local);
    expect_good_number(entry, "sampled pdf_reverse", s.pdf_reverse.v, wi, s.wo_local);
    if (!(s.pdf.v > 0.0f) || !(fabsf(ca_length(s.wo_local) - 1.0f) < 1e-5f) || s.wo_local.z == 0.0f)
        fail_msg("%s: a sample with pdf %g, wi (%a %a %a), wo (%a %a %a)", entry->name, (double)s.pdf.v, (double)wi.x,
                 (double)wi.y, (double)wi.z, (double)s.wo_local.x, (double)s.wo_local.y, (double)s.wo_local.z);
    const ca_rgb albedo = ca_bxdf_albedo(&entry->bxdf, wi);
    expect_good_number(entry, "albedo", albedo.r + albedo.g + albedo.b, wi, s.wo_local);
}

/* Cosines at which roots, quotients and total reflection have their edges, of both signs. */
static float corner_cosine(uint32_t index)
{
    static const float cosine[12] = {
        0.0f, 0x1p-149f,       1e-30f, 1e-15f, 1e-7f, 1e-4f, 0.01f, 0.5f, 0.7453559f /* critical for 1.5 */,
        0.7f, 1.0f - 0x1p-24f, 1.0f};
    return index < 12 ? cosine[index] : -cosine[index - 12];
}
enum { CORNER_COSINES = 24 };

static void test_corners_are_finite(void **state)
{
    (void)state;
    static const float edge[5] = {0.0f, 0x1p-24f, 0.5f, 1.0f - 0x1p-10f, CA_ONE_MINUS_EPSILON};
    for (uint32_t i = 0; i < ca_test_bxdfs.count; ++i) {
        for (uint32_t c = 0; c < 3 * CORNER_COSINES; ++c) {
            const ca_vec3 wi =
                ca_test_direction(corner_cosine(c % CORNER_COSINES), (float)(c / CORNER_COSINES) * 1.3f);
            for (uint32_t k = 0; k < 125; ++k) {
                const ca_vec2 u = {edge[k % 5], edge[k / 5 % 5]};
                expect_good_sample(&ca_test_bxdfs.cases[i], wi, edge[k / 25], u,
                                   k & 1 ? CA_FROM_LIGHT : CA_FROM_CAMERA);
            }
            for (uint32_t d = 0; d < 4 * CORNER_COSINES; ++d) {
                const float azimuth = (float)(c / CORNER_COSINES) * 1.3f + (float)(d / CORNER_COSINES) * 0.5f * CA_PI;
                const ca_vec3 wo = ca_test_direction(corner_cosine(d % CORNER_COSINES), azimuth);
                expect_good_value(&ca_test_bxdfs.cases[i], wi, wo, d & 1 ? CA_FROM_LIGHT : CA_FROM_CAMERA);
            }
            expect_good_value(&ca_test_bxdfs.cases[i], wi, ca_neg(wi), CA_FROM_CAMERA);
        }
    }
}

static void test_random_inputs_are_finite(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(14);
    for (uint32_t k = 0; k < 1000000; ++k) {
        const ca_bxdf_case *entry = &ca_test_bxdfs.cases[k % ca_test_bxdfs.count];
        ca_vec3 wi = random_direction(&random), wo = random_direction(&random);
        if (k % 7 == 0) wi = ca_test_direction(wi.z * wi.z * wi.z * 1e-3f, 6.0f * wi.x); /* grazing */
        const float u_lobe = ca_test_random_float(&random);
        const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
        expect_good_value(entry, wi, wo, (ca_from)(k & 1));
        expect_good_sample(entry, wi, u_lobe, u, (ca_from)(k & 1));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_samples_agree_with_evaluation),
        cmocka_unit_test(test_reverse_adjoint_and_reciprocal),
        cmocka_unit_test(test_reverse_at_the_critical_angle),
        cmocka_unit_test(test_known_dirac_events),
        cmocka_unit_test(test_one_sided_models_are_black_below),
        cmocka_unit_test(test_corners_are_finite),
        cmocka_unit_test(test_random_inputs_are_finite),
    };
    return cmocka_run_group_tests(tests, ca_test_bxdfs_make, ca_test_bxdfs_free);
}
