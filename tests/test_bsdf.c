/* The BSDF at a point: trees become lobes; sides; perturbed normals; the cosines of f̄. */
#include "math/numeric.h"
#include "support/material_collection.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

/* ---- Trees ----------------------------------------------------------------------------------------------------- */

static void trees_become_weighted_lobes(void **state)
{
    (void)state;
    const ca_vec3 above = {0.6f, 0.0f, 0.8f}, below = {0.6f, 0.0f, -0.8f};
    ca_surface surface = ca_test_flat_surface(PATCHWORK);
    ca_bsdf bsdf = ca_test_bsdf_at(&surface, above);
    assert_int_equal(bsdf.lobe_count, 3);
    assert_float_equal(bsdf.null_weight, 1.0f / 3.0f, 1e-6f);
    assert_int_equal(bsdf.lobes[0].bxdf.kind, CA_BXDF_DIFFUSE);
    assert_float_equal(bsdf.lobes[0].weight, 1.0f / 6.0f, 1e-6f);
    assert_float_equal(bsdf.lobes[0].bxdf.as.diffuse.reflectance.g, 0.6f, 0.0f);
    assert_int_equal(bsdf.lobes[1].bxdf.kind, CA_BXDF_ROUGH_DIELECTRIC);
    assert_float_equal(bsdf.lobes[1].weight, 0.25f, 1e-6f);
    assert_int_equal(bsdf.lobes[2].bxdf.kind, CA_BXDF_ROUGH_CONDUCTOR);
    assert_false(bsdf.lobes[0].flipped || bsdf.lobes[1].flipped || bsdf.lobes[2].flipped);
    assert_int_equal(bsdf.scatter, CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION | CA_SCATTER_SMOOTH |
                                       CA_SCATTER_NULL | CA_SCATTER_DIRAC);

    bsdf = ca_test_bsdf_at(&surface, below);
    assert_int_equal(bsdf.lobe_count, 3);
    assert_float_equal(bsdf.lobes[0].bxdf.as.diffuse.reflectance.g, 0.2f, 0.0f);
    assert_int_equal(bsdf.lobes[2].bxdf.kind, CA_BXDF_DIFFUSE);
    assert_true(bsdf.lobes[0].flipped && !bsdf.lobes[1].flipped && bsdf.lobes[2].flipped);
}

/* A blend or mask that leaves nothing of a child leaves its lobe out. */
static void weightless_children_are_left_out(void **state)
{
    (void)state;
    const ca_vec3 wi = {0.0f, 0.0f, 1.0f};
    ca_material *blend = &ca_test_all.materials[METAL_PAINT], *mask = &ca_test_all.materials[MASKED];
    const ca_surface blended = ca_test_flat_surface(METAL_PAINT), masked = ca_test_flat_surface(MASKED);
    blend->as.blend.weight = ZERO;
    ca_bsdf bsdf = ca_test_bsdf_at(&blended, wi);
    assert_int_equal(bsdf.lobe_count, 1);
    assert_int_equal(bsdf.lobes[0].bxdf.kind, CA_BXDF_ROUGH_CONDUCTOR);
    blend->as.blend.weight = ONE;
    bsdf = ca_test_bsdf_at(&blended, wi);
    assert_int_equal(bsdf.lobe_count, 1);
    assert_int_equal(bsdf.lobes[0].bxdf.kind, CA_BXDF_DIFFUSE);
    mask->as.mask.opacity = ZERO;
    bsdf = ca_test_bsdf_at(&masked, wi);
    assert_int_equal(bsdf.lobe_count, 0);
    assert_true(bsdf.null_weight == 1.0f);
    mask->as.mask.opacity = ONE;
    bsdf = ca_test_bsdf_at(&masked, wi);
    assert_int_equal(bsdf.lobe_count, 1);
    assert_true(bsdf.null_weight == 0.0f && bsdf.scatter == (CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH));
    blend->as.blend.weight = mask->as.mask.opacity = THIRD;
}

static void as_many_leaves_as_allowed(void **state)
{
    (void)state;
    ca_material table[15];
    for (uint32_t i = 0; i < 7; ++i) {
        table[i] = ca_test_all.materials[METAL_PAINT];
        table[i].as.blend.weight = HALF;
        table[i].as.blend.first = 2 * i + 1;
        table[i].as.blend.second = 2 * i + 2;
    }
    for (uint32_t i = 7; i < 15; ++i) table[i] = ca_test_all.materials[DIFFUSE];
    assert_int_equal(ca_material_leaf_count(table, 0), CA_BSDF_MAX_LOBES);
    const ca_surface surface = ca_test_flat_surface(0);
    ca_bsdf bsdf;
    ca_bsdf_init(&bsdf, table, ca_test_all.textures, &surface, (ca_vec3){0.0f, 0.0f, 1.0f});
    assert_int_equal(bsdf.lobe_count, CA_BSDF_MAX_LOBES);
    float sum = 0.0f;
    for (uint32_t i = 0; i < bsdf.lobe_count; ++i) sum += bsdf.lobes[i].weight;
    assert_true(sum == 1.0f);
    /* Eight equal diffuse leaves are one. */
    const ca_vec3 wi = {0.6f, 0.0f, 0.8f}, wo = {0.0f, 0.8f, 0.6f};
    const ca_bsdf_value value = ca_bsdf_eval(&bsdf, wi, wo, CA_FROM_CAMERA);
    assert_float_equal(value.f.r, 0.6f * CA_INV_PI, 1e-6f);
    assert_float_equal(value.pdf.v, 0.6f * CA_INV_PI, 1e-6f);
    assert_float_equal(value.pdf_reverse.v, 0.8f * CA_INV_PI, 1e-6f);
}

static void null_goes_straight_on(void **state)
{
    (void)state;
    const ca_vec3 wi = {0.6f, 0.0f, -0.8f};
    const ca_surface surface = ca_test_flat_surface(NOTHING);
    const ca_bsdf bsdf = ca_test_bsdf_at(&surface, wi);
    assert_true(bsdf.null_weight == 1.0f && bsdf.lobe_count == 0);
    ca_bsdf_sample s;
    assert_true(ca_bsdf_sample_direction(&bsdf, wi, 0.999999f, (ca_vec2){0.5f, 0.5f}, CA_FROM_LIGHT, &s));
    assert_true(s.wo_world.x == -0.6f && s.wo_world.z == 0.8f && s.weight.r == 1.0f && s.eta == 1.0f);
    assert_true(s.pdf.v == 1.0f && s.pdf_reverse.v == 1.0f);
    assert_int_equal(s.scatter, CA_SCATTER_NULL | CA_SCATTER_DIRAC);
    assert_true(ca_rgb_is_black(ca_bsdf_eval(&bsdf, wi, s.wo_world, CA_FROM_CAMERA).f));
}

/* ---- Sides ----------------------------------------------------------------------------------------------------- */

static void twosided_shows_each_side_its_own(void **state)
{
    (void)state;
    const ca_vec3 above_i = {0.6f, 0.0f, 0.8f}, above_o = {0.0f, 0.6f, 0.8f};
    const ca_vec3 below_i = {0.6f, 0.0f, -0.8f}, below_o = {0.0f, 0.6f, -0.8f};
    const ca_surface surface = ca_test_flat_surface(TWO_COLORS);
    const ca_bsdf front = ca_test_bsdf_at(&surface, above_i), back = ca_test_bsdf_at(&surface, below_i);
    assert_float_equal(ca_bsdf_eval(&front, above_i, above_o, CA_FROM_CAMERA).f.r, 0.6f * CA_INV_PI, 1e-6f);
    assert_float_equal(ca_bsdf_eval(&back, below_i, below_o, CA_FROM_CAMERA).f.r, 0.7f * CA_INV_PI, 1e-6f);
    assert_true(ca_rgb_is_black(ca_bsdf_eval(&front, above_i, below_o, CA_FROM_CAMERA).f));
    assert_true(ca_rgb_is_black(ca_bsdf_eval(&back, below_i, above_o, CA_FROM_CAMERA).f));
    assert_float_equal(ca_bsdf_albedo(&back, below_i).r, 0.7f, 1e-6f);
    ca_test_random random = ca_test_random_seed(2);
    for (int i = 0; i < 100; ++i) {
        ca_bsdf_sample s;
        assert_true(!ca_test_sample(&back, below_i, &random, CA_FROM_CAMERA, &s) || s.wo_world.z < 0.0f);
    }

    const ca_surface bare = ca_test_flat_surface(DIFFUSE);
    const ca_bsdf bare_back = ca_test_bsdf_at(&bare, below_i);
    assert_true(ca_rgb_is_black(ca_bsdf_eval(&bare_back, below_i, below_o, CA_FROM_CAMERA).f));
    ca_bsdf_sample s;
    assert_false(ca_test_sample(&bare_back, below_i, &random, CA_FROM_CAMERA, &s));
}

/* No light where a direction lies on different sides of the two normals. */
static void sides_must_agree(void **state)
{
    (void)state;
    ca_surface surface = ca_test_flat_surface(DIFFUSE);
    surface.ns = (ca_vec3){0.6f, 0.0f, 0.8f};
    const ca_vec3 good = {0.0f, 0.0f, 1.0f};
    const ca_vec3 above_ng_only = ca_normalize((ca_vec3){-0.9f, 0.0f, 0.3f});
    const ca_vec3 above_ns_only = ca_normalize((ca_vec3){0.9f, 0.0f, -0.2f});
    const ca_bsdf bsdf = ca_test_bsdf_at(&surface, good);
    assert_true(ca_bsdf_eval(&bsdf, good, good, CA_FROM_CAMERA).pdf.v > 0.0f);
    const ca_vec3 bad[] = {above_ng_only, above_ns_only};
    for (int i = 0; i < 2; ++i) {
        const ca_bsdf_value value = ca_bsdf_eval(&bsdf, good, bad[i], CA_FROM_CAMERA);
        assert_true(ca_rgb_is_black(value.f) && value.pdf.v == 0.0f && value.pdf_reverse.v == 0.0f);
        const ca_bsdf from_bad = ca_test_bsdf_at(&surface, bad[i]);
        assert_true(ca_rgb_is_black(ca_bsdf_eval(&from_bad, bad[i], good, CA_FROM_CAMERA).f));
        ca_bsdf_sample s;
        assert_false(ca_bsdf_sample_direction(&from_bad, bad[i], 0.5f, (ca_vec2){0.5f, 0.5f}, CA_FROM_CAMERA, &s));
    }
}

/* In the plane of a normal the side is a matter of rounding, and f̄ has no bound. */
static void the_plane_counts_as_dark(void **state)
{
    (void)state;
    const float heights[] = {0.0f, 1e-42f, 1e-20f, 5e-7f};
    const uint32_t materials[] = {DIFFUSE, METAL, METAL_PAINT};
    for (int m = 0; m < 3; ++m) {
        ca_surface surface = ca_test_flat_surface(materials[m]);
        surface.ns = (ca_vec3){0.6f, 0.0f, 0.8f};
        const ca_vec3 good = {0.0f, 0.0f, 1.0f}, low = {1.0f, 0.0f, 1e-5f};
        const ca_bsdf bsdf = ca_test_bsdf_at(&surface, good);
        assert_true(ca_bsdf_eval(&bsdf, good, low, CA_FROM_CAMERA).f.r > 0.0f);
        for (int i = 0; i < 4; ++i) {
            const ca_vec3 flat = {1.0f, 0.0f, heights[i]};
            const ca_bsdf_value value = ca_bsdf_eval(&bsdf, good, flat, CA_FROM_CAMERA);
            assert_true(ca_rgb_is_black(value.f) && value.pdf.v == 0.0f && value.pdf_reverse.v == 0.0f);
            const ca_bsdf from_flat = ca_test_bsdf_at(&surface, flat);
            ca_bsdf_sample s;
            assert_false(ca_bsdf_sample_direction(&from_flat, flat, 0.5f, (ca_vec2){0.5f, 0.5f}, CA_FROM_LIGHT, &s));
        }
    }
}

/* The back of a twosided material is its front in a mirror: a bump is a bump from both sides. */
static void the_back_is_the_front_mirrored(void **state)
{
    (void)state;
    ca_material *node = &ca_test_all.materials[TWOSIDED_BUMP];
    node->as.twosided.back = CA_NONE;
    ca_test_random random = ca_test_random_seed(3);
    for (int i = 0; i < 1000; ++i) {
        ca_surface surface = ca_test_flat_surface(TWOSIDED_BUMP);
        surface.uv = (ca_vec2){ca_test_random_float(&random), ca_test_random_float(&random)};
        const ca_vec3 wi = ca_test_random_direction(&random), wo = ca_test_random_direction(&random);
        const ca_vec3 wi_mirrored = {wi.x, wi.y, -wi.z}, wo_mirrored = {wo.x, wo.y, -wo.z};
        const ca_bsdf bsdf = ca_test_bsdf_at(&surface, wi), mirrored = ca_test_bsdf_at(&surface, wi_mirrored);
        const ca_bsdf_value value = ca_bsdf_eval(&bsdf, wi, wo, CA_FROM_CAMERA);
        const ca_bsdf_value other = ca_bsdf_eval(&mirrored, wi_mirrored, wo_mirrored, CA_FROM_CAMERA);
        ca_test_assert_close_rgb("mirrored f", TWOSIDED_BUMP, other.f, value.f, 1e-3f);
        ca_test_assert_close("mirrored pdf", TWOSIDED_BUMP, other.pdf.v, value.pdf.v, 1e-3f);
    }
    node->as.twosided.back = RED_DIFFUSE;
}

/* ---- Bump and normal maps -------------------------------------------------------------------------------------- */

/* A height that rises with u leans the normal against dpdu; the slope is per length of dpdu. */
static void bumps_lean_the_normal(void **state)
{
    (void)state;
    float ramp[] = {0.0f, 1.0f, 2.0f, 3.0f};
    const ca_image image = {.width = 4, .height = 1, .channels = 1, .data = ramp};
    ca_texture textures[TEXTURE_COUNT];
    memcpy(textures, ca_test_all.textures, sizeof textures);
    textures[HEIGHT].as.bitmap.image = &image;
    ca_material table[2] = {ca_test_all.materials[BUMPED_METAL], ca_test_all.materials[DIFFUSE]};
    table[0].as.bump.child = 1;
    table[0].as.bump.scale = 0.5f;
    ca_surface surface = ca_test_flat_surface(0);
    surface.dpdu = (ca_vec3){8.0f, 0.0f, 0.0f}; /* u runs over 8 m: 4 texels rise by 4, halved, over 8 m */
    surface.uv = (ca_vec2){0.5f, 0.5f};
    ca_bsdf bsdf;
    ca_bsdf_init(&bsdf, table, textures, &surface, (ca_vec3){0.0f, 0.0f, 1.0f});
    const ca_vec3 n = bsdf.lobes[0].frame.n, expected = ca_normalize((ca_vec3){-0.25f, 0.0f, 1.0f});
    assert_float_equal(n.x, expected.x, 1e-6f);
    assert_float_equal(n.y, 0.0f, 1e-6f);
    assert_float_equal(n.z, expected.z, 1e-6f);
}

static void normal_maps_hold_normals(void **state)
{
    (void)state;
    ca_texture textures[TEXTURE_COUNT];
    memcpy(textures, ca_test_all.textures, sizeof textures);
    textures[NORMALS] = ca_texture_constant((ca_rgb){0.5f + 0.5f * 0.48f, 0.5f + 0.5f * 0.36f, 0.9f});
    ca_surface surface = ca_test_flat_surface(MAPPED_GLASS);
    surface.dpdu = (ca_vec3){0.0f, 3.0f, 0.0f}; /* s = y, t = -x */
    ca_bsdf bsdf;
    ca_bsdf_init(&bsdf, ca_test_all.materials, textures, &surface, (ca_vec3){0.0f, 0.0f, 1.0f});
    const ca_frame frame = bsdf.lobes[0].frame;
    assert_float_equal(frame.n.x, -0.36f, 1e-6f);
    assert_float_equal(frame.n.y, 0.48f, 1e-6f);
    assert_float_equal(frame.n.z, 0.8f, 1e-6f);
    assert_float_equal(ca_dot(frame.s, frame.n), 0.0f, 1e-6f);
    assert_true(frame.s.y > 0.5f);
    /* A map without a direction changes nothing. */
    textures[NORMALS] = textures[HALF];
    ca_bsdf_init(&bsdf, ca_test_all.materials, textures, &surface, (ca_vec3){0.0f, 0.0f, 1.0f});
    assert_true(bsdf.lobes[0].frame.n.z == 1.0f);
}

static ca_vec3 polar(double angle, double azimuth)
{
    return (ca_vec3){(float)(sin(angle) * cos(azimuth)), (float)(sin(angle) * sin(azimuth)), (float)cos(angle)};
}

/* f times the cosine of a white diffuse surface whose map has the normal (0.8, -0.2, 0.5), as Mitsuba 3.9.1 evaluates
 * it with the rules of the two flags; the second and third eye are behind the normal, so that it turns. */
static void perturbed_normals_turn_and_shadow(void **state)
{
    (void)state;
    static const struct {
        double eye[2], light[2];
        float textbook, turned, shadowed, both;
    } known[] = {
        {{0.3, 0.2}, {0.7, 1.0}, 0.18235f, 0.18235f, 0.17251f, 0.17251f},
        {{1.2, 3.0}, {0.6, 0.5}, 0.0f, 0.02323f, 0.0f, 0.02238f},
        {{1.2, 3.0}, {1.3, 2.5}, 0.0f, 0.28605f, 0.0f, 0.17200f},
        {{0.7, 1.0}, {0.3, 0.2}, 0.23027f, 0.23027f, 0.22842f, 0.22842f},
    };
    const float length = sqrtf(0.93f);
    const ca_rgb normal = {0.5f + 0.4f / length, 0.5f - 0.1f / length, 0.5f + 0.25f / length};
    const ca_texture textures[2] = {ca_texture_constant(normal), ca_texture_constant(ca_rgb_grey(1.0f))};
    ca_material table[2] = {ca_material_of_kind(CA_MATERIAL_NORMAL_MAP), ca_material_of_kind(CA_MATERIAL_DIFFUSE)};
    table[0].as.normal_map.child = 1;
    table[0].as.normal_map.normals = 0;
    table[1].as.diffuse.reflectance = 1;
    const ca_surface surface = ca_test_flat_surface(0);
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        for (unsigned flags = 0; flags < 4; flags++) {
            table[0].as.normal_map.rules = (ca_material_perturbed){flags & 1, flags & 2};
            const float values[4] = {known[i].textbook, known[i].turned, known[i].shadowed, known[i].both};
            const ca_vec3 eye = polar(known[i].eye[0], known[i].eye[1]);
            const ca_vec3 light = polar(known[i].light[0], known[i].light[1]);
            ca_bsdf bsdf;
            ca_bsdf_init(&bsdf, table, textures, &surface, eye);
            const ca_bsdf_value value = ca_bsdf_eval(&bsdf, eye, light, CA_FROM_CAMERA);
            assert_float_equal(value.f.g * light.z, values[flags], 2e-5f);
        }
}

/* f̄ itself, where the elementary f is known: a diffuse leaf under a tilted shading normal. */
static void the_cosine_is_the_lights(void **state)
{
    (void)state;
    ca_surface surface = ca_test_flat_surface(DIFFUSE);
    surface.ns = (ca_vec3){0.6f, 0.0f, 0.8f};
    const ca_vec3 to_eye = {0.0f, 0.6f, 0.8f}, to_light = {0.8f, 0.0f, 0.6f};
    const ca_bsdf bsdf = ca_test_bsdf_at(&surface, to_eye);
    const float expected = 0.6f * CA_INV_PI * (0.48f + 0.48f) / 0.6f;
    ca_test_assert_close("camera", DIFFUSE, ca_bsdf_eval(&bsdf, to_eye, to_light, CA_FROM_CAMERA).f.r, expected,
                         1e-5f);
    ca_test_assert_close("light", DIFFUSE, ca_bsdf_eval(&bsdf, to_light, to_eye, CA_FROM_LIGHT).f.r, expected, 1e-5f);
    /* A light that goes the other way has another cosine. */
    const float other = 0.6f * CA_INV_PI * 0.64f / 0.8f;
    ca_test_assert_close("light", DIFFUSE, ca_bsdf_eval(&bsdf, to_eye, to_light, CA_FROM_LIGHT).f.r, other, 1e-5f);
}

/* A mirror gives all back to a camera; flux leaves it in proportion of the geometric cosines. */
static void mirrors_scale_flux_by_the_cosines(void **state)
{
    (void)state;
    ca_surface surface = ca_test_flat_surface(MIRROR);
    surface.ns = ca_normalize((ca_vec3){0.2f, 0.1f, 1.0f});
    ca_test_random random = ca_test_random_seed(9);
    int compared = 0;
    for (int i = 0; i < 1000; ++i) {
        const ca_vec3 wi = ca_test_random_direction(&random);
        const ca_bsdf bsdf = ca_test_bsdf_at(&surface, wi);
        ca_bsdf_sample camera, light;
        if (!ca_bsdf_sample_direction(&bsdf, wi, 0.5f, (ca_vec2){0.5f, 0.5f}, CA_FROM_CAMERA, &camera)) continue;
        assert_true(ca_bsdf_sample_direction(&bsdf, wi, 0.5f, (ca_vec2){0.5f, 0.5f}, CA_FROM_LIGHT, &light));
        ca_test_assert_close("camera", MIRROR, camera.weight.r, 1.0f, 1e-5f);
        ca_test_assert_close("light", MIRROR, light.weight.r, fabsf(light.wo_world.z / wi.z), 1e-3f);
        const ca_vec3 half = ca_add(wi, light.wo_world);
        assert_float_equal(ca_length(ca_cross(half, surface.ns)), 0.0f, 1e-5f);
        assert_true(camera.pdf.v == 1.0f && camera.eta == 1.0f);
        ++compared;
    }
    assert_true(compared > 300);
}

/* One number chooses among lobes and then within the lobe: of glass in a mixture, the Fresnel reflectance of its
 * samples are reflections, as of glass alone. */
static void the_choice_of_a_lobe_leaves_a_number_for_it(void **state)
{
    (void)state;
    enum { COUNT = 10000 };
    const ca_vec3 up = {0.0f, 0.0f, 1.0f};
    const ca_bxdf glass = {.kind = CA_BXDF_DIELECTRIC,
                           .as.dielectric = {.reflectance = {1, 1, 1}, .transmittance = {1, 1, 1}, .eta = 1.5f}};
    const ca_bxdf paint = {.kind = CA_BXDF_DIFFUSE, .as.diffuse = {.reflectance = {1, 1, 1}}};
    ca_bsdf bsdf = {.ng = up, .null_weight = 0.125f, .lobe_count = 3};
    for (int i = 0; i < 3; i++)
        bsdf.lobes[i] = (ca_bsdf_lobe){
            .frame = ca_frame_from_normal(up), .weight = i == 1 ? 0.375f : 0.25f, .bxdf = i == 1 ? paint : glass};
    bsdf.scatter = CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION | CA_SCATTER_SMOOTH | CA_SCATTER_DIRAC;
    uint32_t reflected = 0, refracted = 0, scattered = 0, straight = 0;
    for (int i = 0; i < COUNT; i++) {
        ca_bsdf_sample sample;
        const float u = ((float)i + 0.5f) / COUNT;
        assert_true(ca_bsdf_sample_direction(&bsdf, up, u, (ca_vec2){0.3f, 0.6f}, CA_FROM_CAMERA, &sample));
        if (sample.scatter & CA_SCATTER_NULL) straight++;
        else if (sample.scatter & CA_SCATTER_SMOOTH) scattered++;
        else if (sample.scatter & CA_SCATTER_REFLECTION) reflected++;
        else refracted++;
    }
    assert_in_range(straight, COUNT / 8 - 2, COUNT / 8 + 2);
    assert_in_range(scattered, 3 * COUNT / 8 - 2, 3 * COUNT / 8 + 2);
    assert_in_range(reflected, COUNT / 2 * 0.04 - 3, COUNT / 2 * 0.04 + 3); /* (0.5 / 2.5)^2 */
    assert_int_equal(straight + scattered + reflected + refracted, COUNT);
}

/* 60 degrees outside of an index of 1.5 have a reflectance of 0.0891867 and a cosine of sqrt(2 / 3) inside. */
static void coats_reflect_refract_and_absorb(void **state)
{
    (void)state;
    const float cosine = 0.8164966f, reflected = 0.0891867f, passed = 1.0f - reflected;
    const ca_vec3 left = {-0.8660254f, 0.0f, 0.5f}, right = {0.8660254f, 0.0f, 0.5f}, below = {0.0f, 0.6f, -0.8f};
    const ca_coat coat = {
        .eta = 1.5f, .specular = {1, 0.5f, 1}, .absorption = {0.1f, 0.2f, 0.3f}, .specular_weight = 0.5f};
    const ca_bxdf paint = {.kind = CA_BXDF_DIFFUSE, .as.diffuse = {.reflectance = {0.5f, 0.5f, 0.5f}}};
    const ca_bxdf mirror = {.kind = CA_BXDF_CONDUCTOR, .as.conductor = {.k = {1, 1, 1}, .reflectance = {1, 1, 1}}};
    const ca_rgb f = ca_coat_eval(&coat, &paint, left, right, CA_FROM_CAMERA).f;
    const float base = passed * passed * 0.5f * CA_INV_PI / 2.25f;
    assert_float_equal(f.r, base * expf(-0.2f / cosine), 1e-6f);
    assert_float_equal(f.b, base * expf(-0.6f / cosine), 1e-6f);
    assert_true(ca_rgb_is_black(ca_coat_eval(&coat, &paint, below, right, CA_FROM_LIGHT).f));

    ca_bxdf_sample s;
    const ca_vec2 u = {0.3f, 0.6f};
    assert_true(ca_coat_sample(&coat, &paint, left, 0.999f * reflected, u, CA_FROM_CAMERA, &s));
    assert_int_equal(s.scatter, CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC);
    assert_float_equal(s.pdf.v, reflected, 1e-6f);
    assert_float_equal(s.weight.g, 0.5f, 1e-5f);
    assert_true(ca_coat_sample(&coat, &mirror, left, 1.001f * reflected, u, CA_FROM_CAMERA, &s));
    assert_float_equal(s.pdf.v, passed, 1e-6f);
    assert_float_equal(s.pdf_reverse.v, passed, 1e-6f);
    assert_float_equal(s.weight.g, passed * expf(-0.4f / cosine), 1e-5f);
    assert_float_equal(ca_dot(s.wo_local, right), 1.0f, 1e-5f);
    assert_false(ca_coat_sample(&coat, &mirror, below, 0.5f, u, CA_FROM_CAMERA, &s));
    assert_float_equal(ca_coat_albedo(&coat, &mirror, left).g,
                       0.5f * reflected + passed * passed * expf(-0.4f / cosine), 1e-5f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_choice_of_a_lobe_leaves_a_number_for_it),
        cmocka_unit_test(trees_become_weighted_lobes),
        cmocka_unit_test(coats_reflect_refract_and_absorb),
        cmocka_unit_test(weightless_children_are_left_out),
        cmocka_unit_test(as_many_leaves_as_allowed),
        cmocka_unit_test(null_goes_straight_on),
        cmocka_unit_test(twosided_shows_each_side_its_own),
        cmocka_unit_test(sides_must_agree),
        cmocka_unit_test(the_plane_counts_as_dark),
        cmocka_unit_test(the_back_is_the_front_mirrored),
        cmocka_unit_test(bumps_lean_the_normal),
        cmocka_unit_test(normal_maps_hold_normals),
        cmocka_unit_test(perturbed_normals_turn_and_shadow),
        cmocka_unit_test(the_cosine_is_the_lights),
        cmocka_unit_test(mirrors_scale_flux_by_the_cosines),
    };
    return cmocka_run_group_tests(tests, ca_test_make_collection, ca_test_release_collection);
}
