/* Materials of every kind, alone and in trees, and random surfaces to put them on: for tests of whole BSDFs. */
#ifndef CA_TEST_MATERIAL_COLLECTION_H
#define CA_TEST_MATERIAL_COLLECTION_H

#include "material/bsdf.h"
#include "support/test_random.h"

/* Textures: greys 0.6, 0.5, 1/3, 0, 1 and roughnesses 0.2, 0.4; a red; the optical constants of a metal; a bump map
 * and a normal map of 4 x 4 random texels. */
enum {
    GREY, RED, HALF, ROUGH_02, ROUGH_04, METAL_ETA, METAL_K, THIRD, HEIGHT, NORMALS, ZERO, ONE, TEXTURE_COUNT
};
enum {
    DIFFUSE, RED_DIFFUSE, DIELECTRIC, THIN, ROUGH_GLASS, MIRROR, METAL, PLASTIC, ROUGH_PLASTIC, PRINCIPLED, GLASSY,
    NOTHING, TWOSIDED, TWO_COLORS, MASKED, METAL_PAINT, GLASS_PAINT, BUMPED_METAL, MAPPED_GLASS, TWOSIDED_BUMP,
    BUMPED_TWOSIDED, PATCHWORK, BUMPED_PAINT, MAPPED_MIRROR, TEXTBOOK_BUMP, CLAY, OLD_PLASTIC,
    OLD_METAL, LEAF, COATED_PAINT, COATED_METALS, MIRROR_METAL,
    MATERIAL_COUNT
};


typedef struct ca_test_collection {
    ca_texture textures[TEXTURE_COUNT];
    ca_material materials[MATERIAL_COUNT];
    float heights[16], normals[48];
    ca_image height_image, normal_image;
} ca_test_collection;

/* Tests may change it for a while. */
extern ca_test_collection ca_test_all;

/* For cmocka's group. */
int ca_test_make_collection(void **state);
int ca_test_release_collection(void **state);

/* Uniform over the sphere. */
ca_vec3 ca_test_random_direction(ca_test_random *random);
/* `tilt` 0: ns = ng; 1: ns up to 45 degrees off. The id of the material is its index above. */
ca_surface ca_test_random_surface(ca_test_random *random, uint32_t material, float tilt);
/* In z = 0, facing +z, dpdu and dpdv along x and y. */
ca_surface ca_test_flat_surface(uint32_t material);

ca_bsdf ca_test_bsdf_at(const ca_surface *surface, ca_vec3 wi);
bool ca_test_sample(const ca_bsdf *bsdf, ca_vec3 wi, ca_test_random *random, ca_from from, ca_bsdf_sample *result);

/* Fail the cmocka test beyond a relative error. Tails far below any image lose digits by cancellation: the tolerance
 * has a floor of that part of 0.01. */
void ca_test_assert_close(const char *what, uint32_t material, float value, float expected, float relative);
void ca_test_assert_close_rgb(const char *what, uint32_t material, ca_rgb value, ca_rgb expected, float relative);

#endif
