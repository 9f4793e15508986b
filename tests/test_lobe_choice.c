/* Which part of a layered material is sampled: each one where light comes from it, however dark it is elsewhere or in
 * other colours. Else few samples with large weights carry its light, or none do. */
#include "material/bsdf.h"

#include "math/numeric.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { WHITE, BLACK, SPECK, PATCHES, CLEAR_PATCHES, GREEN_ONLY, MINUS_ONE, CHANGES_SIGN, ROUGHNESS, TEXTURES };
enum { PAINT, SPECKLED_PLASTIC, SPECKLED_ROUGH_PLASTIC, SIGNED_PLASTIC, GREEN_COAT, PATCHED_COAT, MATERIALS };

enum { SPECK_SIZE = 32 };
static float speck[SPECK_SIZE * SPECK_SIZE * 3];
static ca_image speck_image = {.width = SPECK_SIZE, .height = SPECK_SIZE, .channels = 3, .data = speck};
static ca_texture textures[TEXTURES];
static ca_material materials[MATERIALS];

static ca_texture checkerboard(ca_texture_id first, ca_texture_id second)
{
    ca_texture texture = ca_texture_constant(ca_rgb_grey(0.0f));
    texture.kind = CA_TEXTURE_CHECKERBOARD;
    texture.as.checkerboard.color0 = first;
    texture.as.checkerboard.color1 = second;
    return texture;
}

static int make(void **state)
{
    (void)state;
    float *const first_texel = speck + (SPECK_SIZE - 1) * SPECK_SIZE * 3; /* of 1024 that at (0, 0) */
    for (int i = 0; i < 3; i++) first_texel[i] = 1.0f;
    textures[WHITE] = ca_texture_constant(ca_rgb_grey(0.9f));
    textures[BLACK] = ca_texture_constant(ca_rgb_grey(0.0f));
    textures[SPECK] = ca_texture_constant(ca_rgb_grey(0.0f));
    textures[SPECK].kind = CA_TEXTURE_BITMAP;
    textures[SPECK].as.bitmap.image = &speck_image;
    textures[SPECK].as.bitmap.filter = CA_FILTER_NEAREST;
    textures[SPECK].as.bitmap.wrap = CA_WRAP_CLAMP;
    textures[PATCHES] = checkerboard(WHITE, BLACK);
    textures[GREEN_ONLY] = ca_texture_constant((ca_rgb){12.0f, 0.0f, 12.0f}); /* passes green */
    textures[CLEAR_PATCHES] = checkerboard(BLACK, GREEN_ONLY);
    textures[MINUS_ONE] = ca_texture_constant(ca_rgb_grey(-0.45f));
    textures[CHANGES_SIGN] = textures[BLACK]; /* half of -0.45 and of 0.9 or 0: none on average */
    textures[CHANGES_SIGN].kind = CA_TEXTURE_MIX;
    textures[CHANGES_SIGN].as.mix.color0 = MINUS_ONE;
    textures[CHANGES_SIGN].as.mix.color1 = PATCHES;
    textures[CHANGES_SIGN].as.mix.weight = ROUGHNESS;
    textures[ROUGHNESS] = ca_texture_constant(ca_rgb_grey(0.5f));

    for (int i = 0; i < MATERIALS; i++)
        materials[i] = ca_material_of_kind(i == PAINT                     ? CA_MATERIAL_DIFFUSE
                                           : i == SPECKLED_ROUGH_PLASTIC ? CA_MATERIAL_ROUGH_PLASTIC
                                           : i >= GREEN_COAT              ? CA_MATERIAL_COATING
                                                                          : CA_MATERIAL_PLASTIC);
    materials[PAINT].as.diffuse.reflectance = WHITE;
    materials[SPECKLED_PLASTIC].as.plastic.diffuse = SPECK;
    materials[SIGNED_PLASTIC].as.plastic.diffuse = CHANGES_SIGN;
    materials[SPECKLED_PLASTIC].as.plastic.eta = materials[SIGNED_PLASTIC].as.plastic.eta = 1.5f;
    materials[SPECKLED_ROUGH_PLASTIC].as.rough_plastic.layers.diffuse = SPECK;
    materials[SPECKLED_ROUGH_PLASTIC].as.rough_plastic.layers.eta = 1.5f;
    materials[SPECKLED_ROUGH_PLASTIC].as.rough_plastic.facets.alpha_u = ROUGHNESS;
    for (int i = GREEN_COAT; i <= PATCHED_COAT; i++) {
        materials[i].as.coating.child = PAINT;
        materials[i].as.coating.eta = 1.5f;
        materials[i].as.coating.thickness = 1.0f;
        materials[i].as.coating.sigma_a = i == GREEN_COAT ? GREEN_ONLY : CLEAR_PATCHES;
    }
    for (int i = 0; i < MATERIALS; i++)
        if (ca_material_prepare(&materials[i], textures, NULL) != CA_OK) return -1;
    return 0;
}

static int release(void **state)
{
    (void)state;
    for (int i = 0; i < MATERIALS; i++) ca_material_release(&materials[i]);
    return 0;
}

/* Green that is reflected, but for a mirror's: by midpoints over the hemisphere. */
static double reflected_light(const ca_bsdf *bsdf, ca_vec3 wi)
{
    enum { RINGS = 200, SECTORS = 400 };
    double sum = 0.0;
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < SECTORS; k++) {
            const float z = ((float)i + 0.5f) / RINGS, r = sqrtf(1.0f - z * z);
            const float phi = CA_TWO_PI * ((float)k + 0.5f) / SECTORS;
            const ca_vec3 wo = {r * cosf(phi), r * sinf(phi), z};
            sum += (double)(ca_bsdf_eval(bsdf, wi, wo, CA_FROM_CAMERA).f.g * z);
        }
    return sum * 2.0 * CA_PI_D / (RINGS * SECTORS);
}

/* At a point where a lot of light comes from the base. */
static void test_base_is_sampled(void **state)
{
    (void)state;
    enum { COUNT = 40000 };
    for (uint32_t material = SPECKLED_PLASTIC; material < MATERIALS; material++) {
        const ca_vec3 up = {0.0f, 0.0f, 1.0f}, wi = {0.6f, 0.0f, 0.8f};
        const ca_surface surface = {.ng = up,
                                    .ns = up,
                                    .dpdu = {1.0f, 0.0f, 0.0f},
                                    .dpdv = {0.0f, 1.0f, 0.0f},
                                    .uv = {0.01f, 0.01f},
                                    .material = material};
        ca_test_random random = ca_test_random_seed(material);
        ca_bsdf bsdf;
        ca_bsdf_init(&bsdf, materials, textures, &surface, wi);
        const double expected = reflected_light(&bsdf, wi);
        double sum = 0.0;
        float largest = 0.0f;
        for (int i = 0; i < COUNT; i++) {
            const float u_lobe = ca_test_random_float(&random);
            const ca_vec2 u = {ca_test_random_float(&random), ca_test_random_float(&random)};
            ca_bsdf_sample sample;
            if (!ca_bsdf_sample_direction(&bsdf, wi, u_lobe, u, CA_FROM_CAMERA, &sample)) continue;
            largest = fmaxf(largest, ca_rgb_max(sample.weight));
            if (!(sample.scatter & CA_SCATTER_DIRAC)) sum += (double)sample.weight.g;
        }
        assert_true(expected > 0.1);
        if (!(largest < 2.0f)) fail_msg("material %u: a weight of %g", material, (double)largest);
        if (!(fabs(sum / COUNT - expected) < 0.02 * expected))
            fail_msg("material %u: %g reflected, not %g", material, sum / COUNT, expected);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_base_is_sampled)};
    return cmocka_run_group_tests(tests, make, release);
}
