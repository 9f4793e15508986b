/* Properties and preparation of material trees. */
#include "base/memory.h"
#include "material/fresnel.h"
#include "material/material.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum {
    SMOOTH_REFLECTION = CA_SCATTER_SMOOTH | CA_SCATTER_REFLECTION,
    NULL_EVENT = CA_SCATTER_NULL | CA_SCATTER_DIRAC
};

static ca_material leaf(ca_material_kind kind) { return ca_material_of_kind(kind); }

static ca_material node(ca_material_kind kind, ca_material_id first, ca_material_id second)
{
    ca_material material = ca_material_of_kind(kind);
    if (kind == CA_MATERIAL_MASK) material.as.mask.child = first;
    if (kind == CA_MATERIAL_BUMP) material.as.bump.child = first;
    if (kind == CA_MATERIAL_NORMAL_MAP) material.as.normal_map.child = first;
    if (kind == CA_MATERIAL_COATING) material.as.coating.child = first;
    if (kind == CA_MATERIAL_TWOSIDED) material.as.twosided.front = first;
    if (kind == CA_MATERIAL_TWOSIDED) material.as.twosided.back = second;
    if (kind == CA_MATERIAL_BLEND) material.as.blend.first = first;
    if (kind == CA_MATERIAL_BLEND) material.as.blend.second = second;
    return material;
}

/* Whatever the kind: no texture but CA_NONE, no child, and a leaf or not as it should be. */
static void a_new_material_refers_to_nothing(void **state)
{
    (void)state;
    for (int k = 0; k < CA_MATERIAL_KIND_COUNT; ++k) {
        const ca_material m = ca_material_of_kind((ca_material_kind)k);
        assert_int_equal(m.kind, k);
        ca_material_id children[2];
        const uint32_t count = ca_material_children(&m, children);
        assert_true(children[0] == CA_NONE && children[1] == CA_NONE);
        assert_int_equal(count > 0 || k == CA_MATERIAL_NULL, !ca_material_is_leaf(m.kind));
    }
    const ca_material_facets none = {.sample_visible = true, .alpha_u = CA_NONE, .alpha_v = CA_NONE};
    const ca_material rough = ca_material_of_kind(CA_MATERIAL_ROUGH_CONDUCTOR);
    const ca_material coated = ca_material_of_kind(CA_MATERIAL_ROUGH_PLASTIC);
    const ca_material principled = ca_material_of_kind(CA_MATERIAL_PRINCIPLED);
    assert_memory_equal(&rough.as.rough_conductor.facets, &none, sizeof none);
    assert_memory_equal(&coated.as.rough_plastic.facets, &none, sizeof none);
    assert_true(rough.as.rough_conductor.eta == CA_NONE && rough.as.rough_conductor.reflectance == CA_NONE);
    assert_true(coated.as.rough_plastic.layers.diffuse == CA_NONE && !coated.as.rough_plastic.transmittance);
    assert_true(principled.as.principled.base_color == CA_NONE && principled.as.principled.anisotropic == CA_NONE);
    assert_true(principled.as.principled.clearcoat_gloss == CA_NONE && principled.as.principled.eta == 1.0f);
    assert_true(ca_material_of_kind(CA_MATERIAL_BUMP).as.bump.scale == 1.0f);
}

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
        {CA_MATERIAL_PRINCIPLED_THIN, SMOOTH_REFLECTION | CA_SCATTER_TRANSMISSION},
        {CA_MATERIAL_WARD, SMOOTH_REFLECTION},
        {CA_MATERIAL_NULL, NULL_EVENT},
    };
    for (size_t i = 0; i < sizeof expected / sizeof *expected; ++i) {
        const ca_material material = leaf(expected[i].kind);
        assert_int_equal(ca_material_scatter(&material, 0), expected[i].scatter);
        assert_int_equal(ca_material_leaf_count(&material, 0), 1);
        assert_false(ca_material_needs_tangents(&material, 0));
    }
    ca_material glassy = leaf(CA_MATERIAL_PRINCIPLED);
    glassy.as.principled.spec_trans = 0;
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
        node(CA_MATERIAL_COATING, 0, CA_NONE),    /* 10 */
    };
    const uint32_t leaves[] = {1, 1, 2, 2, 2, 4, 1, 1, 1, 1, 1};
    for (uint32_t i = 0; i < 11; ++i) {
        assert_int_equal(ca_material_leaf_count(table, i), leaves[i]);
        assert_int_equal(ca_material_needs_tangents(table, i), i == 6 || i == 7 || i == 9);
    }
    assert_int_equal(ca_material_scatter(table, 3), SMOOTH_REFLECTION | CA_SCATTER_DIRAC);
    assert_int_equal(ca_material_scatter(table, 5), SMOOTH_REFLECTION | NULL_EVENT);
    assert_int_equal(ca_material_scatter(table, 6), SMOOTH_REFLECTION);
    assert_int_equal(ca_material_scatter(table, 8), CA_SCATTER_REFLECTION | CA_SCATTER_DIRAC);
    assert_int_equal(ca_material_scatter(table, 10), SMOOTH_REFLECTION | CA_SCATTER_DIRAC);
}

static void anisotropy_needs_tangents(void **state)
{
    (void)state;
    ca_material metal = leaf(CA_MATERIAL_ROUGH_CONDUCTOR);
    metal.as.rough_conductor.facets.alpha_u = 3;
    assert_false(ca_material_needs_tangents(&metal, 0)); /* no alpha_v: isotropic */
    metal.as.rough_conductor.facets.alpha_v = 3;
    assert_false(ca_material_needs_tangents(&metal, 0));
    metal.as.rough_conductor.facets.alpha_v = 4;
    assert_true(ca_material_needs_tangents(&metal, 0));
    ca_material principled = leaf(CA_MATERIAL_PRINCIPLED);
    principled.as.principled.roughness = 3;
    assert_false(ca_material_needs_tangents(&principled, 0));
    principled.as.principled.anisotropic = 3;
    assert_true(ca_material_needs_tangents(&principled, 0));
    ca_material sheet = leaf(CA_MATERIAL_PRINCIPLED_THIN), ward = leaf(CA_MATERIAL_WARD);
    assert_false(ca_material_needs_tangents(&sheet, 0));
    sheet.as.principled_thin.anisotropic = 3;
    assert_true(ca_material_needs_tangents(&sheet, 0));
    ward.as.ward.alpha_u = ward.as.ward.alpha_v = 3;
    assert_false(ca_material_needs_tangents(&ward, 0));
    ward.as.ward.alpha_v = 4;
    assert_true(ca_material_needs_tangents(&ward, 0));
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
    plastic.as.plastic.eta = 1.5f;
    plastic.as.plastic.diffuse = 0;
    assert_int_equal(ca_material_prepare(&plastic, textures, NULL), CA_OK);
    /* 0.5963 from inside glass of index 1.5 (Egan and Hilgeman 1973's fit gives 0.597). */
    assert_float_equal(1.0f - plastic.as.plastic.internal_transmittance, 0.5963f, 1e-3f);
    ca_material_release(&plastic);

    ca_material rough = leaf(CA_MATERIAL_ROUGH_PLASTIC);
    rough.as.rough_plastic.layers.eta = 1.5f;
    rough.as.rough_plastic.layers.diffuse = 0;
    rough.as.rough_plastic.facets.alpha_u = rough.as.rough_plastic.facets.alpha_v = 2;
    assert_int_equal(ca_material_prepare(&rough, textures, NULL), CA_OK);
    assert_non_null(rough.as.rough_plastic.transmittance);
    const float internal = 1.0f - rough.as.rough_plastic.layers.internal_transmittance;
    assert_true(internal > 0.4f && internal < 0.8f);
    ca_material_release(&rough);
    assert_null(rough.as.rough_plastic.transmittance);

    ca_memory_fail_after(0);
    ca_error error = {""};
    assert_int_equal(ca_material_prepare(&rough, textures, &error), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
    assert_null(rough.as.rough_plastic.transmittance);
    assert_string_not_equal(error.message, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_material_refers_to_nothing),
        cmocka_unit_test(leaves_have_their_models_properties),
        cmocka_unit_test(trees_add_up),
        cmocka_unit_test(anisotropy_needs_tangents),
        cmocka_unit_test(monstrous_trees_are_refused),
        cmocka_unit_test(plastics_are_prepared),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
