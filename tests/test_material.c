/* Properties and preparation of material trees. */
#include "base/memory.h"
#include "material/fresnel.h"
#include "material/material.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum {
    SMOOTH_REFLECTION = CA_SCATTER_SMOOTH | CA_SCATTER_REFLECTION,
    NULL_EVENT = CA_SCATTER_NULL | CA_SCATTER_DIRAC
};

/* All texture ids CA_NONE. */
static ca_material node(ca_material_kind kind, ca_material_id first, ca_material_id second)
{
    ca_material material;
    memset(&material, 0xff, sizeof material);
    material.kind = kind;
    material.child[0] = first;
    material.child[1] = second;
    material.rough_transmittance = NULL;
    material.eta = 1.5f;
    material.distribution = CA_MICROFACET_GGX;
    material.sample_visible = true;
    material.nonlinear = false;
    return material;
}

static ca_material leaf(ca_material_kind kind) { return node(kind, CA_NONE, CA_NONE); }

static void leaves_have_their_models_properties(void **state)
{
    (void)state;
    const struct {
        ca_material_kind kind;
        uint32_t scatter;
    } expected[] = {
        {CA_MATERIAL_DIFFUSE, SMOOTH_REFLECTION},
        {CA_MATERIAL_CONDUCTOR, CA_SCATTER_DIRAC | CA_SCATTER_REFLECTION},
        {CA_MATERIAL_ROUGH_CONDUCTOR, SMOOTH_REFLECTION},
        {CA_MATERIAL_DIELECTRIC, CA_SCATTER_DIRAC | CA_SCATTER_REFLECTION | CA_SCATTER_TRANSMISSION},
        {CA_MATERIAL_ROUGH_DIELECTRIC, SMOOTH_REFLECTION | CA_SCATTER_TRANSMISSION},
        {CA_MATERIAL_PLASTIC, SMOOTH_REFLECTION | CA_SCATTER_DIRAC},
        {CA_MATERIAL_ROUGH_PLASTIC, SMOOTH_REFLECTION},
        {CA_MATERIAL_PRINCIPLED, SMOOTH_REFLECTION},
        {CA_MATERIAL_NULL, NULL_EVENT},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; ++i) {
        const ca_material material = leaf(expected[i].kind);
        assert_int_equal(ca_material_scatter(&material, 0), expected[i].scatter);
        assert_int_equal(ca_material_leaf_count(&material, 0), 1);
        assert_false(ca_material_needs_tangents(&material, 0));
    }
    ca_material glassy = leaf(CA_MATERIAL_PRINCIPLED);
    glassy.principled.spec_trans = 0;
    assert_int_equal(ca_material_scatter(&glassy, 0), SMOOTH_REFLECTION | CA_SCATTER_TRANSMISSION);
}

static void trees_add_up(void **state)
{
    (void)state;
    const ca_material table[] = {
        leaf(CA_MATERIAL_DIFFUSE),                /* 0 */
        leaf(CA_MATERIAL_CONDUCTOR),              /* 1 */
        node(CA_MATERIAL_BLEND, 0, 1),            /* 2: two */
        node(CA_MATERIAL_TWOSIDED, 2, 0),         /* 3: two or one */
        node(CA_MATERIAL_MASK, 3, CA_NONE),       /* 4 */
        node(CA_MATERIAL_BLEND, 4, 2),            /* 5: four */
        node(CA_MATERIAL_BUMP, 0, CA_NONE),       /* 6 */
        node(CA_MATERIAL_NORMAL_MAP, 1, CA_NONE), /* 7 */
        node(CA_MATERIAL_TWOSIDED, 1, CA_NONE),   /* 8 */
        node(CA_MATERIAL_TWOSIDED, 0, 6),         /* 9 */
    };
    const uint32_t leaves[] = {1, 1, 2, 2, 2, 4, 1, 1, 1, 1};
    for (uint32_t i = 0; i < 10; ++i) {
        assert_int_equal(ca_material_leaf_count(table, i), leaves[i]);
        assert_int_equal(ca_material_needs_tangents(table, i), i == 6 || i == 7 || i == 9);
    }
    assert_int_equal(ca_material_scatter(table, 3), SMOOTH_REFLECTION | CA_SCATTER_DIRAC);
    assert_int_equal(ca_material_scatter(table, 5), SMOOTH_REFLECTION | NULL_EVENT);
    assert_int_equal(ca_material_scatter(table, 6), SMOOTH_REFLECTION);
    assert_int_equal(ca_material_scatter(table, 8), CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC);
}

static void anisotropy_needs_tangents(void **state)
{
    (void)state;
    ca_material metal = leaf(CA_MATERIAL_ROUGH_CONDUCTOR);
    metal.alpha_u = 3;
    assert_false(ca_material_needs_tangents(&metal, 0)); /* no alpha_v: isotropic */
    metal.alpha_v = 3;
    assert_false(ca_material_needs_tangents(&metal, 0));
    metal.alpha_v = 4;
    assert_true(ca_material_needs_tangents(&metal, 0));
    ca_material principled = leaf(CA_MATERIAL_PRINCIPLED);
    principled.alpha_u = 3;
    assert_false(ca_material_needs_tangents(&principled, 0));
    principled.alpha_v = 3;
    assert_true(ca_material_needs_tangents(&principled, 0));
}

/* Deep, cyclic and exponentially large trees are told apart from good ones, in no time. */
static void monstrous_trees_are_refused(void **state)
{
    (void)state;
    const ca_material cycle[] = {node(CA_MATERIAL_MASK, 1, CA_NONE), node(CA_MATERIAL_TWOSIDED, 0, CA_NONE)};
    assert_int_equal(ca_material_leaf_count(cycle, 0), UINT32_MAX);

    ca_material chain[CA_MATERIAL_MAX_DEPTH + 1];
    for (uint32_t i = 0; i < CA_MATERIAL_MAX_DEPTH; ++i) chain[i] = node(CA_MATERIAL_MASK, i + 1, CA_NONE);
    chain[CA_MATERIAL_MAX_DEPTH] = leaf(CA_MATERIAL_DIFFUSE);
    assert_int_equal(ca_material_leaf_count(chain, 0), UINT32_MAX);
    assert_int_equal(ca_material_leaf_count(chain, 1), 1);

    for (uint32_t i = 0; i < CA_MATERIAL_MAX_DEPTH; ++i) chain[i] = node(CA_MATERIAL_BLEND, i + 1, i + 1);
    assert_int_equal(ca_material_leaf_count(chain, 1), UINT32_MAX);
    assert_int_equal(ca_material_leaf_count(chain, CA_MATERIAL_MAX_DEPTH - 3), 8);
    ca_material_scatter(chain, 0);
    ca_material_needs_tangents(chain, 0);
}

static void plastics_are_prepared(void **state)
{
    (void)state;
    const ca_texture textures[] = {ca_texture_constant((ca_rgb){0.25f, 0.25f, 0.25f}),
                                   ca_texture_constant((ca_rgb){0.0f, 0.0f, 0.0f}),
                                   ca_texture_constant((ca_rgb){0.3f, 0.3f, 0.3f})};
    ca_material plastic = leaf(CA_MATERIAL_PLASTIC);
    plastic.reflectance = 0;
    assert_int_equal(ca_material_prepare(&plastic, textures, NULL), CA_OK);
    assert_float_equal(plastic.specular_weight, 1.0f / 1.25f, 1e-6f);
    /* 0.5963 from inside glass of index 1.5 (Egan and Hilgeman 1973's fit gives 0.597). */
    assert_float_equal(plastic.internal_reflectance, 0.5963f, 1e-3f);
    plastic.reflectance = plastic.specular = 1;
    assert_int_equal(ca_material_prepare(&plastic, textures, NULL), CA_OK);
    assert_float_equal(plastic.specular_weight, 0.5f, 0.0f);
    ca_material_release(&plastic);

    ca_material rough = leaf(CA_MATERIAL_ROUGH_PLASTIC);
    rough.reflectance = 0;
    rough.alpha_u = rough.alpha_v = 2;
    assert_int_equal(ca_material_prepare(&rough, textures, NULL), CA_OK);
    assert_non_null(rough.rough_transmittance);
    assert_true(rough.internal_reflectance > 0.4f && rough.internal_reflectance < 0.8f);
    ca_material_release(&rough);
    assert_null(rough.rough_transmittance);

    ca_memory_fail_after(0);
    ca_error error = {""};
    assert_int_equal(ca_material_prepare(&rough, textures, &error), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
    assert_null(rough.rough_transmittance);
    assert_string_not_equal(error.message, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(leaves_have_their_models_properties),
        cmocka_unit_test(trees_add_up),
        cmocka_unit_test(anisotropy_needs_tangents),
        cmocka_unit_test(monstrous_trees_are_refused),
        cmocka_unit_test(plastics_are_prepared),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
