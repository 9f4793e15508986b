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
    ca_test_all.materials[id] = ca_material_of_kind(kind);
    return &ca_test_all.materials[id];
}

static ca_material_facets facets(uint32_t alpha_u, uint32_t alpha_v)
{
    return (ca_material_facets){CA_MICROFACET_GGX, true, alpha_u, alpha_v};
}

static void set_leaves(void)
{
    set(DIFFUSE, CA_MATERIAL_DIFFUSE)->as.diffuse.reflectance = GREY;
    set(RED_DIFFUSE, CA_MATERIAL_DIFFUSE)->as.diffuse.reflectance = RED;
    set(DIELECTRIC, CA_MATERIAL_DIELECTRIC)->as.dielectric.eta = 1.5f;
    set(THIN, CA_MATERIAL_THIN_DIELECTRIC)->as.thin_dielectric.eta = 1.5f;
    ca_material *glass = set(ROUGH_GLASS, CA_MATERIAL_ROUGH_DIELECTRIC);
    glass->as.rough_dielectric.eta = 1.5f;
    glass->as.rough_dielectric.facets = facets(ROUGH_04, ROUGH_04);
    set(MIRROR, CA_MATERIAL_CONDUCTOR);
    ca_material *metal = set(METAL, CA_MATERIAL_ROUGH_CONDUCTOR);
    metal->as.rough_conductor.eta = METAL_ETA;
    metal->as.rough_conductor.k = METAL_K;
    metal->as.rough_conductor.facets = facets(ROUGH_02, ROUGH_04);
    const ca_material_plastic layers = {.diffuse = RED, .specular = CA_NONE, .eta = 1.5f};
    set(PLASTIC, CA_MATERIAL_PLASTIC)->as.plastic = layers;
    ca_material *rough_plastic = set(ROUGH_PLASTIC, CA_MATERIAL_ROUGH_PLASTIC);
    rough_plastic->as.rough_plastic.layers = layers;
    rough_plastic->as.rough_plastic.facets = facets(ROUGH_04, ROUGH_04);
    ca_material *clay = set(CLAY, CA_MATERIAL_ROUGH_DIFFUSE);
    clay->as.rough_diffuse.reflectance = RED;
    clay->as.rough_diffuse.alpha = HALF;
    ca_material *phong = set(OLD_PLASTIC, CA_MATERIAL_PHONG);
    phong->as.phong.diffuse = RED;
    phong->as.phong.specular = HALF;
    phong->as.phong.exponent = ONE;
    ca_material *ward = set(OLD_METAL, CA_MATERIAL_WARD);
    ward->as.ward.diffuse = RED;
    ward->as.ward.specular = HALF;
    ward->as.ward.alpha_u = ROUGH_02;
    ward->as.ward.alpha_v = ROUGH_04;
    ca_material *sheet = set(LEAF, CA_MATERIAL_PRINCIPLED_THIN);
    sheet->as.principled_thin.base_color = RED;
    sheet->as.principled_thin.roughness = sheet->as.principled_thin.sheen = HALF;
    sheet->as.principled_thin.spec_trans = sheet->as.principled_thin.anisotropic = THIRD;
    sheet->as.principled_thin.diff_trans = GREY;
    sheet->as.principled_thin.eta = 1.5f;
    set(NOTHING, CA_MATERIAL_NULL);
}

static void set_principled(void)
{
    ca_material *opaque = set(PRINCIPLED, CA_MATERIAL_PRINCIPLED), *glassy = set(GLASSY, CA_MATERIAL_PRINCIPLED);
    opaque->as.principled.base_color = glassy->as.principled.base_color = RED;
    opaque->as.principled.roughness = glassy->as.principled.roughness = HALF;
    opaque->as.principled.eta = glassy->as.principled.eta = 1.5f;
    opaque->as.principled.clearcoat = opaque->as.principled.sheen = HALF;
    opaque->as.principled.clearcoat_gloss = opaque->as.principled.metallic = THIRD;
    glassy->as.principled.spec_trans = HALF;
}

static void set_twosided(uint32_t id, ca_material_id front, ca_material_id back)
{
    ca_material *material = set(id, CA_MATERIAL_TWOSIDED);
    material->as.twosided.front = front;
    material->as.twosided.back = back;
}

static void set_blend(uint32_t id, ca_material_id first, ca_material_id second, ca_texture_id weight)
{
    ca_material *material = set(id, CA_MATERIAL_BLEND);
    material->as.blend.first = first;
    material->as.blend.second = second;
    material->as.blend.weight = weight;
}

static void set_bump(uint32_t id, ca_material_id child)
{
    ca_material *material = set(id, CA_MATERIAL_BUMP);
    material->as.bump.child = child;
    material->as.bump.height = HEIGHT;
}

static void set_nodes(void)
{
    set_twosided(TWOSIDED, DIFFUSE, CA_NONE);
    set_twosided(TWO_COLORS, DIFFUSE, RED_DIFFUSE);
    ca_material *masked = set(MASKED, CA_MATERIAL_MASK);
    masked->as.mask.child = TWO_COLORS;
    masked->as.mask.opacity = THIRD;
    set_blend(METAL_PAINT, METAL, DIFFUSE, THIRD);
    set_blend(GLASS_PAINT, ROUGH_GLASS, TWOSIDED_BUMP, HALF);
    set_bump(BUMPED_METAL, METAL);
    ca_material *mapped = set(MAPPED_GLASS, CA_MATERIAL_NORMAL_MAP);
    mapped->as.normal_map.child = ROUGH_GLASS;
    mapped->as.normal_map.normals = NORMALS;
    set_twosided(TWOSIDED_BUMP, BUMPED_METAL, RED_DIFFUSE);
    set_bump(BUMPED_TWOSIDED, TWO_COLORS);
    set_blend(PATCHWORK, MASKED, GLASS_PAINT, HALF);
    set_bump(BUMPED_PAINT, RED_DIFFUSE);
    ca_material *mirror = set(MAPPED_MIRROR, CA_MATERIAL_NORMAL_MAP);
    mirror->as.normal_map.child = MIRROR;
    mirror->as.normal_map.normals = NORMALS;
    ca_material *coat = set(COATED_PAINT, CA_MATERIAL_COATING);
    coat->as.coating.child = METAL_PAINT;
    coat->as.coating.sigma_a = RED;
    coat->as.coating.thickness = 0.5f;
    coat->as.coating.eta = 1.5f;
    coat = set(COATED_METALS, CA_MATERIAL_COATING);
    coat->as.coating.child = MIRROR_METAL;
    coat->as.coating.eta = 1.4f;
    coat->as.coating.facets = facets(ROUGH_04, ROUGH_04);
    set_blend(MIRROR_METAL, MIRROR, METAL, HALF);
    set_bump(TEXTBOOK_BUMP, RED_DIFFUSE);
    ca_test_all.materials[TEXTBOOK_BUMP].as.bump.rules = (ca_material_perturbed){false, false};
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
    set_leaves();
    set_principled();
    set_nodes();
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
