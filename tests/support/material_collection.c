#include "support/material_collection.h"

#include "math/numeric.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

ca_test_collection ca_test_all;

static ca_material *set(uint32_t id, ca_material_kind kind)
{
    ca_material *material = &ca_test_all.materials[id];
    memset(material, 0xff, sizeof *material); /* every parameter CA_NONE */
    material->kind = kind;
    material->rough_transmittance = NULL;
    material->eta = 1.5f;
    material->scale = 1.0f;
    material->distribution = CA_MICROFACET_GGX;
    material->sample_visible = true;
    material->nonlinear = false;
    material->principled.diffuse_rate = material->principled.specular_rate = material->principled.clearcoat_rate =
        1.0f;
    return material;
}

static void set_node(uint32_t id, ca_material_kind kind, uint32_t first, uint32_t second, uint32_t modifier)
{
    ca_material *material = set(id, kind);
    material->child[0] = first;
    material->child[1] = second;
    material->modifier = modifier;
}

static void set_rough(uint32_t id, ca_material_kind kind, uint32_t alpha_u, uint32_t alpha_v)
{
    ca_material *material = set(id, kind);
    material->alpha_u = alpha_u;
    material->alpha_v = alpha_v;
    material->reflectance = RED;
    material->eta_rgb = kind == CA_MATERIAL_ROUGH_CONDUCTOR ? METAL_ETA : CA_NONE;
    material->k_rgb = kind == CA_MATERIAL_ROUGH_CONDUCTOR ? METAL_K : CA_NONE;
}

static ca_texture picture(const ca_image *image)
{
    return (ca_texture){.kind = CA_TEXTURE_BITMAP,
                        .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                        .as.bitmap = {.image = image, .filter = CA_FILTER_BILINEAR, .wrap = CA_WRAP_REPEAT}};
}

static void make_textures(void)
{
    ca_test_random random = ca_test_random_seed(1);
    for (int i = 0; i < 16; ++i) ca_test_all.heights[i] = 0.3f * ca_test_random_float(&random);
    for (int i = 0; i < 16; ++i) {
        ca_test_all.normals[3 * i] = 0.3f + 0.4f * ca_test_random_float(&random);
        ca_test_all.normals[3 * i + 1] = 0.3f + 0.4f * ca_test_random_float(&random);
        ca_test_all.normals[3 * i + 2] = 0.9f;
    }
    ca_test_all.height_image = (ca_image){.width = 4, .height = 4, .channels = 1, .data = ca_test_all.heights};
    ca_test_all.normal_image = (ca_image){.width = 4, .height = 4, .channels = 3, .data = ca_test_all.normals};
    const float grey[TEXTURE_COUNT] = {[GREY] = 0.6f, [HALF] = 0.5f, [ROUGH_02] = 0.2f, [ROUGH_04] = 0.4f,
                                       [THIRD] = 1.0f / 3.0f, [ONE] = 1.0f};
    for (int i = 0; i < TEXTURE_COUNT; ++i) ca_test_all.textures[i] = ca_texture_constant(ca_rgb_grey(grey[i]));
    ca_test_all.textures[RED] = ca_texture_constant((ca_rgb){0.7f, 0.2f, 0.1f});
    ca_test_all.textures[METAL_ETA] = ca_texture_constant((ca_rgb){0.2f, 0.9f, 1.3f});
    ca_test_all.textures[METAL_K] = ca_texture_constant((ca_rgb){3.9f, 2.4f, 2.1f});
    ca_test_all.textures[HEIGHT] = picture(&ca_test_all.height_image);
    ca_test_all.textures[NORMALS] = picture(&ca_test_all.normal_image);
}

int ca_test_make_collection(void **state)
{
    (void)state;
    make_textures();
    set(DIFFUSE, CA_MATERIAL_DIFFUSE)->reflectance = GREY;
    set(RED_DIFFUSE, CA_MATERIAL_DIFFUSE)->reflectance = RED;
    set(DIELECTRIC, CA_MATERIAL_DIELECTRIC);
    set(THIN, CA_MATERIAL_THIN_DIELECTRIC);
    set_rough(ROUGH_GLASS, CA_MATERIAL_ROUGH_DIELECTRIC, ROUGH_04, ROUGH_04);
    set(MIRROR, CA_MATERIAL_CONDUCTOR);
    set_rough(METAL, CA_MATERIAL_ROUGH_CONDUCTOR, ROUGH_02, ROUGH_04);
    set(PLASTIC, CA_MATERIAL_PLASTIC)->reflectance = RED;
    set_rough(ROUGH_PLASTIC, CA_MATERIAL_ROUGH_PLASTIC, ROUGH_04, ROUGH_04);
    set_rough(PRINCIPLED, CA_MATERIAL_PRINCIPLED, HALF, CA_NONE);
    ca_test_all.materials[PRINCIPLED].principled.clearcoat = ca_test_all.materials[PRINCIPLED].principled.sheen =
        HALF;
    ca_test_all.materials[PRINCIPLED].principled.clearcoat_gloss =
        ca_test_all.materials[PRINCIPLED].principled.metallic = THIRD;
    set_rough(GLASSY, CA_MATERIAL_PRINCIPLED, HALF, CA_NONE);
    ca_test_all.materials[GLASSY].principled.spec_trans = HALF;
    set(NOTHING, CA_MATERIAL_NULL);
    set_node(TWOSIDED, CA_MATERIAL_TWOSIDED, DIFFUSE, CA_NONE, CA_NONE);
    set_node(TWO_COLORS, CA_MATERIAL_TWOSIDED, DIFFUSE, RED_DIFFUSE, CA_NONE);
    set_node(MASKED, CA_MATERIAL_MASK, TWO_COLORS, CA_NONE, THIRD);
    set_node(METAL_PAINT, CA_MATERIAL_BLEND, METAL, DIFFUSE, THIRD);
    set_node(GLASS_PAINT, CA_MATERIAL_BLEND, ROUGH_GLASS, TWOSIDED_BUMP, HALF);
    set_node(BUMPED_METAL, CA_MATERIAL_BUMP, METAL, CA_NONE, HEIGHT);
    set_node(MAPPED_GLASS, CA_MATERIAL_NORMAL_MAP, ROUGH_GLASS, CA_NONE, NORMALS);
    set_node(TWOSIDED_BUMP, CA_MATERIAL_TWOSIDED, BUMPED_METAL, RED_DIFFUSE, CA_NONE);
    set_node(BUMPED_TWOSIDED, CA_MATERIAL_BUMP, TWO_COLORS, CA_NONE, HEIGHT);
    set_node(PATCHWORK, CA_MATERIAL_BLEND, MASKED, GLASS_PAINT, HALF);
    for (int i = 0; i < MATERIAL_COUNT; ++i)
        if (ca_material_prepare(&ca_test_all.materials[i], ca_test_all.textures, NULL) != CA_OK) return 1;
    return 0;
}

int ca_test_release_collection(void **state)
{
    (void)state;
    for (int i = 0; i < MATERIAL_COUNT; ++i) ca_material_release(&ca_test_all.materials[i]);
    return 0;
}

ca_vec3 ca_test_random_direction(ca_test_random *random)
{
    const float z = 2.0f * ca_test_random_float(random) - 1.0f, phi = CA_TWO_PI * ca_test_random_float(random);
    const float r = ca_sqrt0(1.0f - z * z);
    return (ca_vec3){r * cosf(phi), r * sinf(phi), z};
}

ca_surface ca_test_random_surface(ca_test_random *random, uint32_t material, float tilt)
{
    ca_surface surface = {.material = material, .ng = ca_test_random_direction(random)};
    const float lean = 0.7f * tilt * ca_test_random_float(random);
    surface.ns = ca_normalize(ca_madd(surface.ng, lean, ca_test_random_direction(random)));
    const ca_frame frame = ca_frame_from_normal(surface.ng);
    const float angle = CA_TWO_PI * ca_test_random_float(random);
    surface.dpdu = ca_add(ca_mul(frame.s, cosf(angle)), ca_mul(frame.t, sinf(angle)));
    surface.dpdv = ca_mul(ca_cross(surface.ng, surface.dpdu), 0.5f + ca_test_random_float(random));
    surface.uv = (ca_vec2){ca_test_random_float(random), ca_test_random_float(random)};
    return surface;
}

ca_surface ca_test_flat_surface(uint32_t material)
{
    return (ca_surface){.material = material,
                        .ng = {0.0f, 0.0f, 1.0f},
                        .ns = {0.0f, 0.0f, 1.0f},
                        .dpdu = {1.0f, 0.0f, 0.0f},
                        .dpdv = {0.0f, 1.0f, 0.0f},
                        .uv = {0.3f, 0.7f}};
}

ca_bsdf ca_test_bsdf_at(const ca_surface *surface, ca_vec3 wi)
{
    ca_bsdf bsdf;
    ca_bsdf_init(&bsdf, ca_test_all.materials, ca_test_all.textures, surface, wi);
    return bsdf;
}

bool ca_test_sample(const ca_bsdf *bsdf, ca_vec3 wi, ca_test_random *random, ca_from from, ca_bsdf_sample *result)
{
    const float u_lobe = ca_test_random_float(random), u0 = ca_test_random_float(random);
    return ca_bsdf_sample_direction(bsdf, wi, u_lobe, (ca_vec2){u0, ca_test_random_float(random)}, from, result);
}

void ca_test_assert_close(const char *what, uint32_t material, float value, float expected, float relative)
{
    if (!(fabsf(value - expected) <= relative * (fabsf(expected) + 1e-2f)))
        fail_msg("material %u: %s is %.7g, expected %.7g", material, what, (double)value, (double)expected);
}

void ca_test_assert_close_rgb(const char *what, uint32_t material, ca_rgb value, ca_rgb expected, float relative)
{
    ca_test_assert_close(what, material, value.r, expected.r, relative);
    ca_test_assert_close(what, material, value.g, expected.g, relative);
    ca_test_assert_close(what, material, value.b, expected.b, relative);
}
