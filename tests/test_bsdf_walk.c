/* Walks through BSDFs: sampling against values and densities, both directions of a path, robustness. */
#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/material_collection.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

/* The mean weight of one step of a walk, over the events asked for: the part of the light that goes their way. */
static void check_energy(const ca_bsdf *bsdf, ca_vec3 wi, uint32_t scatter, ca_rgb expected)
{
    ca_test_random random = ca_test_random_seed(11);
    const uint32_t count = 200000;
    double sum[3] = {0.0, 0.0, 0.0};
    for (uint32_t i = 0; i < count; ++i) {
        ca_bsdf_sample s;
        if (!ca_test_sample(bsdf, wi, &random, CA_FROM_CAMERA, &s) || !(s.scatter & scatter)) continue;
        sum[0] += (double)s.weight.r;
        sum[1] += (double)s.weight.g;
        sum[2] += (double)s.weight.b;
    }
    const ca_rgb mean = {(float)(sum[0] / count), (float)(sum[1] / count), (float)(sum[2] / count)};
    ca_test_assert_close_rgb("energy", 0, mean, expected, 1e-2f);
}

/* ---- Mixtures -------------------------------------------------------------------------------------------------- */

/* A smooth sample carries what evaluation says; every direction's two pdfs are those of the two walks through it. */
static void samples_and_values_agree(void **state)
{
    (void)state;
    for (uint32_t material = 0; material < MATERIAL_COUNT; ++material) {
        ca_test_random random = ca_test_random_seed(100 + material);
        int smooth = 0;
        for (int i = 0; i < 4000; ++i) {
            const ca_surface surface = ca_test_random_surface(&random, material, (float)(i % 2));
            const ca_vec3 wi = ca_test_random_direction(&random);
            const ca_from from = i % 4 < 2 ? CA_FROM_CAMERA : CA_FROM_LIGHT;
            const ca_bsdf bsdf = ca_test_bsdf_at(&surface, wi);
            ca_bsdf_sample s;
            if (!ca_test_sample(&bsdf, wi, &random, from, &s)) continue;
            ca_test_assert_close("length of wo", material, ca_length(s.wo_world), 1.0f, 1e-5f);
            assert_true((s.scatter & ~bsdf.scatter) == 0);
            if (s.scatter & CA_SCATTER_DIRAC) {
                assert_true(s.pdf.v > 0.0f && s.pdf.v <= 1.000001f);
                continue;
            }
            ++smooth;
            const ca_bsdf_value value = ca_bsdf_eval(&bsdf, wi, s.wo_world, from);
            ca_test_assert_close("pdf", material, s.pdf.v, value.pdf.v, 5e-3f);
            ca_test_assert_close("pdf_reverse", material, s.pdf_reverse.v, value.pdf_reverse.v, 5e-3f);
            const float cos_ng = ca_abs_dot(s.wo_world, surface.ng);
            ca_test_assert_close_rgb("weight", material, s.weight, ca_rgb_scale(value.f, cos_ng / value.pdf.v),
                                     5e-3f);
            const ca_bsdf back = ca_test_bsdf_at(&surface, s.wo_world);
            const ca_from other = from == CA_FROM_CAMERA ? CA_FROM_LIGHT : CA_FROM_CAMERA;
            const ca_bsdf_value reverse = ca_bsdf_eval(&back, s.wo_world, wi, other);
            ca_test_assert_close("reverse of pdf", material, reverse.pdf_reverse.v, value.pdf.v, 5e-3f);
            ca_test_assert_close("reverse of pdf_reverse", material, reverse.pdf.v, value.pdf_reverse.v, 5e-3f);
        }
        const uint32_t can = ca_material_scatter(ca_test_all.materials, material);
        assert_true((smooth > 500) == ((can & CA_SCATTER_SMOOTH) != 0));
    }
}

/* The short way of the single diffuse leaf is the elementary model. */
static void the_diffuse_path_is_the_diffuse_model(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(6);
    for (int i = 0; i < 2000; ++i) {
        const ca_surface surface = ca_test_random_surface(&random, RED_DIFFUSE, 0.0f);
        ca_vec3 wi = ca_test_random_direction(&random);
        if (ca_dot(wi, surface.ng) < 0.0f) wi = ca_neg(wi);
        const ca_bsdf bsdf = ca_test_bsdf_at(&surface, wi);
        const ca_frame *frame = &bsdf.lobes[0].frame;
        const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
        ca_bsdf_sample s;
        ca_bxdf_sample local;
        const bool sampled = ca_bsdf_sample_direction(&bsdf, wi, 0.5f, u, CA_FROM_LIGHT, &s);
        const ca_vec3 wi_local = ca_to_local(frame, wi);
        assert_true(sampled ==
                    ca_bxdf_sample_direction(&bsdf.lobes[0].bxdf, wi_local, 0.5f, u, CA_FROM_LIGHT, &local));
        if (!sampled) continue;
        const ca_vec3 wo = ca_to_world(frame, local.wo_local);
        ca_test_assert_close("wo", RED_DIFFUSE, ca_length(ca_sub(wo, s.wo_world)), 0.0f, 1e-4f);
        ca_test_assert_close("pdf", RED_DIFFUSE, s.pdf.v, local.pdf.v, 1e-5f);
        ca_test_assert_close("pdf_reverse", RED_DIFFUSE, s.pdf_reverse.v, local.pdf_reverse.v, 1e-5f);
        assert_int_equal(s.scatter, local.scatter);
        const ca_bxdf_value value = ca_bxdf_eval(&bsdf.lobes[0].bxdf, wi_local, local.wo_local, CA_FROM_LIGHT);
        const ca_bsdf_value world = ca_bsdf_eval(&bsdf, wi, s.wo_world, CA_FROM_LIGHT);
        ca_test_assert_close_rgb("f", RED_DIFFUSE, world.f, value.f, 1e-3f);
        ca_test_assert_close("pdf", RED_DIFFUSE, world.pdf.v, value.pdf.v, 1e-5f);
    }
}

static void energy_goes_through_blends_and_masks(void **state)
{
    (void)state;
    const ca_vec3 above = {0.6f, 0.0f, 0.8f}, below = {0.6f, 0.0f, -0.8f};
    const ca_surface masked = ca_test_flat_surface(MASKED);
    const ca_bsdf front = ca_test_bsdf_at(&masked, above), back = ca_test_bsdf_at(&masked, below);
    /* a third of the surface is there */
    check_energy(&front, above, CA_SCATTER_NULL, ca_rgb_grey(2.0f / 3.0f));
    check_energy(&front, above, CA_SCATTER_SMOOTH, ca_rgb_grey(0.2f));
    check_energy(&back, below, CA_SCATTER_SMOOTH, (ca_rgb){0.7f / 3.0f, 0.2f / 3.0f, 0.1f / 3.0f});
    ca_test_assert_close("albedo", MASKED, ca_bsdf_albedo(&front, above).r, 2.0f / 3.0f + 0.2f, 1e-5f);

    ca_material *blend = &ca_test_all.materials[METAL_PAINT];
    const uint32_t metal = blend->as.blend.first;
    blend->as.blend.first = RED_DIFFUSE;
    const ca_surface blended = ca_test_flat_surface(METAL_PAINT);
    const ca_bsdf paint = ca_test_bsdf_at(&blended, above);
    const ca_rgb expected = ca_rgb_lerp((ca_rgb){0.7f, 0.2f, 0.1f}, ca_rgb_grey(0.6f), 1.0f / 3.0f);
    check_energy(&paint, above, CA_SCATTER_SMOOTH, expected);
    /* one metal with a mirror: the parts of a mixture of smooth and Dirac */
    blend->as.blend.first = MIRROR;
    const ca_bsdf half_mirror = ca_test_bsdf_at(&blended, above);
    check_energy(&half_mirror, above, CA_SCATTER_DIRAC, ca_rgb_grey(2.0f / 3.0f));
    check_energy(&half_mirror, above, CA_SCATTER_SMOOTH, ca_rgb_grey(0.2f));
    blend->as.blend.first = metal;
}

/* ---- Chi-square ------------------------------------------------------------------------------------------------ */

typedef struct walk {
    ca_bsdf bsdf;
    ca_vec3 wi;
    ca_from from;
} walk;

static bool draw(const void *context, const float u[3], ca_vec3 *direction)
{
    const walk *w = context;
    ca_bsdf_sample s;
    if (!ca_bsdf_sample_direction(&w->bsdf, w->wi, u[0], (ca_vec2){u[1], u[2]}, w->from, &s)) return false;
    *direction = s.wo_world;
    return !(s.scatter & CA_SCATTER_DIRAC);
}

static float density(const void *context, ca_vec3 direction)
{
    const walk *w = context;
    return ca_bsdf_eval(&w->bsdf, w->wi, direction, w->from).pdf.v;
}

static void mixtures_are_sampled_by_their_density(void **state)
{
    (void)state;
    const uint32_t materials[] = {TWO_COLORS,   MASKED,       METAL_PAINT, GLASS_PAINT,
                                  BUMPED_METAL, MAPPED_GLASS, PATCHWORK,   BUMPED_PAINT, TEXTBOOK_BUMP,
                                  COATED_PAINT, COATED_METALS, OLD_METAL,   LEAF};
    const ca_vec3 incidences[] = {{0.1f, 0.2f, 0.9f}, {-0.7f, 0.3f, 0.5f}, {0.5f, -0.2f, -0.7f}};
    enum { MATERIALS = sizeof materials / sizeof *materials, INCIDENCES = sizeof incidences / sizeof *incidences };
    ca_test_random random = ca_test_random_seed(8);
    for (uint32_t i = 0; i < MATERIALS * INCIDENCES; ++i) {
        ca_surface surface = ca_test_flat_surface(materials[i / INCIDENCES]);
        surface.ns = ca_normalize((ca_vec3){0.3f, -0.2f, 1.0f});
        surface.uv = (ca_vec2){ca_test_random_float(&random), ca_test_random_float(&random)};
        walk w = {.wi = ca_normalize(incidences[i % INCIDENCES]), .from = i % 2 ? CA_FROM_LIGHT : CA_FROM_CAMERA};
        ca_bsdf_init(&w.bsdf, ca_test_all.materials, ca_test_all.textures, &surface, w.wi);
        char name[64];
        snprintf(name, sizeof name, "material %u, incidence %u", materials[i / INCIDENCES], i % INCIDENCES);
        ca_chi_square_assert(&(ca_chi_square_test){.name = name, .sample = draw, .pdf = density, .context = &w,
                                                   .test_count = MATERIALS * INCIDENCES, .seed = i});
    }
}

/* ---- Adjoints -------------------------------------------------------------------------------------------------- */

/* A path has one contribution, whichever end it is walked from. */
static void both_ends_see_the_same(void **state)
{
    (void)state;
    for (uint32_t material = 0; material < MATERIAL_COUNT; ++material) {
        ca_test_random random = ca_test_random_seed(200 + material);
        int lit = 0;
        for (int i = 0; i < 20000; ++i) {
            const ca_surface surface = ca_test_random_surface(&random, material, 1.0f);
            const ca_vec3 to_eye = ca_test_random_direction(&random), to_light = ca_test_random_direction(&random);
            const ca_bsdf from_eye = ca_test_bsdf_at(&surface, to_eye);
            const ca_bsdf from_light = ca_test_bsdf_at(&surface, to_light);
            const ca_bsdf_value a = ca_bsdf_eval(&from_eye, to_eye, to_light, CA_FROM_CAMERA);
            const ca_bsdf_value b = ca_bsdf_eval(&from_light, to_light, to_eye, CA_FROM_LIGHT);
            ca_test_assert_close_rgb("adjoint", material, a.f, b.f, 2e-3f);
            ca_test_assert_close("pdf", material, a.pdf.v, b.pdf_reverse.v, 2e-3f);
            ca_test_assert_close("pdf_reverse", material, a.pdf_reverse.v, b.pdf.v, 2e-3f);
            lit += a.pdf.v > 0.0f;
        }
        const uint32_t can = ca_material_scatter(ca_test_all.materials, material);
        assert_true((lit > 1000) == ((can & CA_SCATTER_SMOOTH) != 0));
    }
}

/* Light from a lopsided sky, seen by a lopsided eye, by walks from one end: mean and its squared error. */
static void carried_light(uint32_t material, ca_from from, double *mean, double *error2)
{
    const ca_vec3 bright = ca_normalize((ca_vec3){0.6f, -0.5f, 0.4f});
    const ca_vec3 seen = ca_normalize((ca_vec3){-0.3f, 0.8f, 0.2f});
    ca_test_random random = ca_test_random_seed(300 + 2 * material + (from == CA_FROM_LIGHT));
    const uint32_t count = 80000;
    double sum = 0.0, squares = 0.0;
    for (uint32_t i = 0; i < count; i++) {
        ca_surface surface = ca_test_flat_surface(material);
        surface.ns = ca_normalize((ca_vec3){0.2f, -0.1f, 1.0f});
        surface.uv = (ca_vec2){ca_test_random_float(&random), ca_test_random_float(&random)};
        const ca_vec3 wi = ca_test_random_direction(&random);
        const ca_bsdf bsdf = ca_test_bsdf_at(&surface, wi);
        ca_bsdf_sample s;
        if (!ca_test_sample(&bsdf, wi, &random, from, &s)) continue;
        const ca_vec3 eye = from == CA_FROM_CAMERA ? wi : s.wo_world;
        const ca_vec3 light = from == CA_FROM_CAMERA ? s.wo_world : wi;
        const float sky = 1.0f + ca_dot(light, bright), view = 1.0f + ca_dot(eye, seen);
        const double value = (double)(ca_luminance(s.weight) * ca_abs_dot(wi, surface.ng) * sky * view);
        sum += value;
        squares += value * value;
    }
    *mean = sum / count;
    *error2 = (squares / count - *mean * *mean) / count;
}

/* Dirac events too: the light that reaches the eye through one surface is the same by walks from either end. */
static void both_walks_carry_the_same(void **state)
{
    (void)state;
    for (uint32_t material = 0; material < MATERIAL_COUNT; ++material) {
        double mean[2], error2[2];
        carried_light(material, CA_FROM_CAMERA, &mean[0], &error2[0]);
        carried_light(material, CA_FROM_LIGHT, &mean[1], &error2[1]);
        const double error = sqrt(error2[0] + error2[1]);
        if (!(fabs(mean[0] - mean[1]) <= 4.0 * error + 1e-5) || !(error <= 0.03 * mean[0]))
            fail_msg("material %u: %.6g from the camera, %.6g from the light, standard error %.3g", material, mean[0],
                     mean[1], error);
    }
}

/* ---- Robustness ------------------------------------------------------------------------------------------------ */

/* Directions in the plane, at the pole and nearly so; random numbers at the ends of their range. */
static ca_vec3 awkward_direction(ca_test_random *random, ca_vec3 normal)
{
    const ca_vec3 w = ca_test_random_direction(random);
    switch (ca_test_random_u32(random) % 8) {
    case 0: return normal;
    case 1: return ca_neg(normal);
    case 2: return ca_normalize(ca_madd(w, -ca_dot(w, normal), normal));
    case 3: return ca_normalize(ca_madd(w, 1e-5f * ca_test_random_float(random) - ca_dot(w, normal), normal));
    case 4: return ca_normalize(ca_madd(normal, 1e-4f, w));
    default: return w;
    }
}

static float awkward_number(ca_test_random *random)
{
    switch (ca_test_random_u32(random) % 8) {
    case 0: return 0.0f;
    case 1: return CA_ONE_MINUS_EPSILON;
    default: return ca_test_random_float(random);
    }
}

static bool is_good(ca_rgb f, float pdf, float pdf_reverse)
{
    return ca_rgb_is_finite(f) && f.r >= 0.0f && f.g >= 0.0f && f.b >= 0.0f && isfinite(pdf) && pdf >= 0.0f &&
           isfinite(pdf_reverse) && pdf_reverse >= 0.0f;
}

static void everything_is_finite(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(10);
    for (uint32_t i = 0; i < 1000000; ++i) {
        const uint32_t material = i % MATERIAL_COUNT;
        ca_surface surface = ca_test_random_surface(&random, material, (float)(ca_test_random_u32(&random) % 2));
        if (i % 5 == 0) surface.dpdu = surface.dpdv = (ca_vec3){0.0f, 0.0f, 0.0f};
        const ca_vec3 wi = awkward_direction(&random, surface.ng), wo = awkward_direction(&random, surface.ns);
        const ca_from from = i % 2 ? CA_FROM_LIGHT : CA_FROM_CAMERA;
        const ca_bsdf bsdf = ca_test_bsdf_at(&surface, wi);
        const ca_bsdf_value value = ca_bsdf_eval(&bsdf, wi, wo, from);
        if (!is_good(value.f, value.pdf.v, value.pdf_reverse.v))
            fail_msg("material %u, case %u: f %g %g %g, pdf %g, reverse %g", material, i, (double)value.f.r,
                     (double)value.f.g, (double)value.f.b, (double)value.pdf.v, (double)value.pdf_reverse.v);
        ca_bsdf_sample s;
        const ca_vec2 u = {awkward_number(&random), awkward_number(&random)};
        if (!ca_bsdf_sample_direction(&bsdf, wi, awkward_number(&random), u, from, &s)) continue;
        if (!is_good(s.weight, s.pdf.v, s.pdf_reverse.v) || !ca_is_finite3(s.wo_world) || !(s.pdf.v > 0.0f) ||
            !(s.eta > 0.0f))
            fail_msg("material %u, case %u: weight %g %g %g, pdf %g, reverse %g", material, i, (double)s.weight.r,
                     (double)s.weight.g, (double)s.weight.b, (double)s.pdf.v, (double)s.pdf_reverse.v);
        assert_true(ca_rgb_is_finite(ca_bsdf_albedo(&bsdf, wi)));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_and_values_agree),
        cmocka_unit_test(the_diffuse_path_is_the_diffuse_model),
        cmocka_unit_test(energy_goes_through_blends_and_masks),
        cmocka_unit_test(mixtures_are_sampled_by_their_density),
        cmocka_unit_test(both_ends_see_the_same),
        cmocka_unit_test(both_walks_carry_the_same),
        cmocka_unit_test(everything_is_finite),
    };
    return cmocka_run_group_tests(tests, ca_test_make_collection, ca_test_release_collection);
}
