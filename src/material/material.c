#include "material/material.h"

#include "material/fresnel.h"
#include "material/rough_transmittance.h"

#include <assert.h>

/* ---- Kinds ----------------------------------------------------------------------------------------------------- */

#define SAME_KIND(KIND, name)                                                                                        \
    _Static_assert((int)CA_MATERIAL_##KIND == (int)CA_BXDF_##KIND, "leaves and models have the same order");
CA_BXDF_MODELS(SAME_KIND)
_Static_assert((int)CA_MATERIAL_NULL == (int)CA_BXDF_KIND_COUNT, "each leaf has its model");

#define NAME(KIND, name, ...) [CA_MATERIAL_##KIND] = name,
const char *const ca_material_kind_names[CA_MATERIAL_KIND_COUNT] = {CA_MATERIAL_LEAVES(NAME) CA_MATERIAL_NODES(NAME)};

ca_material ca_material_of_kind(ca_material_kind kind)
{
#define VALUE(KIND, name, ...) [CA_MATERIAL_##KIND] = {__VA_ARGS__},
    static const ca_material of_kind[] = {CA_MATERIAL_LEAVES(VALUE) CA_MATERIAL_NODES(VALUE)};
    ca_material material = of_kind[kind];
    material.kind = kind;
    return material;
}

uint32_t ca_material_children(const ca_material *material, ca_material_id children[2])
{
    children[0] = children[1] = CA_NONE;
    switch (material->kind) {
    case CA_MATERIAL_TWOSIDED:
        children[0] = material->as.twosided.front;
        children[1] = material->as.twosided.back;
        return children[1] == CA_NONE || children[1] == children[0] ? 1 : 2;
    case CA_MATERIAL_BLEND:
        children[0] = material->as.blend.first;
        children[1] = material->as.blend.second;
        return 2;
    case CA_MATERIAL_MASK: children[0] = material->as.mask.child; return 1;
    case CA_MATERIAL_BUMP: children[0] = material->as.bump.child; return 1;
    case CA_MATERIAL_NORMAL_MAP: children[0] = material->as.normal_map.child; return 1;
    case CA_MATERIAL_COATING: children[0] = material->as.coating.child; return 1;
    default: return 0; /* leaves and null */
    }
}

/* ---- Preparation ----------------------------------------------------------------------------------------------- */

static float mean_luminance_or(const ca_texture *textures, ca_texture_id id, float fallback)
{
    return id == CA_NONE ? fallback : ca_luminance(ca_texture_mean(textures, id));
}

/* The table is for one roughness: the mean, where it varies. */
static ca_status prepare_rough_plastic(ca_material *material, const ca_texture *textures, ca_error *error)
{
    const ca_material_facets *facets = &material->as.rough_plastic.facets;
    ca_material_plastic *layers = &material->as.rough_plastic.layers;
    const float alpha = fmaxf(mean_luminance_or(textures, facets->alpha_u, 0.0f), CA_MATERIAL_MIN_ALPHA);
    struct ca_rough_transmittance *table = ca_rough_transmittance_create(facets->distribution, alpha, layers->eta);
    if (!table) return ca_fail_memory(error, "a rough plastic's transmittance");
    material->as.rough_plastic.transmittance = table;
    layers->internal_transmittance = ca_rough_transmittance_from_inside(table);
    return CA_OK;
}

static ca_status prepare_coating(ca_material *material, const ca_texture *textures, ca_error *error)
{
    const ca_material_facets *facets = &material->as.coating.facets;
    if (facets->alpha_u == CA_NONE) return CA_OK;
    const float alpha = fmaxf(mean_luminance_or(textures, facets->alpha_u, 0.0f), CA_MATERIAL_MIN_ALPHA);
    material->as.coating.transmittance =
        ca_rough_transmittance_create(facets->distribution, alpha, material->as.coating.eta);
    return material->as.coating.transmittance ? CA_OK : ca_fail_memory(error, "a rough coating's transmittance");
}

ca_status ca_material_prepare(ca_material *material, const ca_texture *textures, ca_error *error)
{
    if (material->kind == CA_MATERIAL_COATING) return prepare_coating(material, textures, error);
    if (material->kind == CA_MATERIAL_ROUGH_PLASTIC) return prepare_rough_plastic(material, textures, error);
    if (material->kind != CA_MATERIAL_PLASTIC) return CA_OK;
    ca_material_plastic *plastic = &material->as.plastic;
    plastic->internal_transmittance = ca_fresnel_diffuse_transmittance(1.0f / plastic->eta);
    return CA_OK;
}

void ca_material_release(ca_material *material)
{
    struct ca_rough_transmittance **table = NULL;
    if (material->kind == CA_MATERIAL_ROUGH_PLASTIC) table = &material->as.rough_plastic.transmittance;
    if (material->kind == CA_MATERIAL_COATING) table = &material->as.coating.transmittance;
    if (!table) return;
    ca_rough_transmittance_destroy(*table);
    *table = NULL;
}

/* ---- Properties of trees --------------------------------------------------------------------------------------- */

/* What a walk over a tree finds. */
typedef struct tree_summary {
    uint32_t leaves; /* that one evaluation can reach; UINT32_MAX: too much of a tree */
    uint32_t scatter;
    bool tangents;
} tree_summary;

static bool facets_are_anisotropic(const ca_material_facets *facets)
{
    return facets->alpha_v != CA_NONE && facets->alpha_v != facets->alpha_u;
}

static bool is_anisotropic(const ca_material *leaf)
{
    switch (leaf->kind) {
    case CA_MATERIAL_ROUGH_DIELECTRIC: return facets_are_anisotropic(&leaf->as.rough_dielectric.facets);
    case CA_MATERIAL_ROUGH_CONDUCTOR: return facets_are_anisotropic(&leaf->as.rough_conductor.facets);
    case CA_MATERIAL_ROUGH_PLASTIC: return facets_are_anisotropic(&leaf->as.rough_plastic.facets);
    case CA_MATERIAL_PRINCIPLED: return leaf->as.principled.anisotropic != CA_NONE;
    case CA_MATERIAL_PRINCIPLED_THIN: return leaf->as.principled_thin.anisotropic != CA_NONE;
    case CA_MATERIAL_WARD: return leaf->as.ward.alpha_v != CA_NONE && leaf->as.ward.alpha_v != leaf->as.ward.alpha_u;
    default: return false;
    }
}

/* What a material that holds no others can do wherever its textures are looked up: all that a set parameter switches
 * on counts as on. */
static tree_summary summary_without_children(const ca_material *leaf)
{
    if (leaf->kind == CA_MATERIAL_NULL)
        return (tree_summary){.leaves = 1, .scatter = CA_SCATTER_NULL | CA_SCATTER_DIRAC};
    assert(ca_material_is_leaf(leaf->kind));
    ca_bxdf bxdf = {.kind = (ca_bxdf_kind)leaf->kind};
    if (leaf->kind == CA_MATERIAL_PRINCIPLED && leaf->as.principled.spec_trans != CA_NONE)
        bxdf.as.principled.spec_trans = 1.0f;
    return (tree_summary){.leaves = 1, .scatter = ca_bxdf_scatter(&bxdf), .tangents = is_anisotropic(leaf)};
}

static uint32_t saturating_add(uint32_t a, uint32_t b)
{
    return a > UINT32_MAX - b ? UINT32_MAX : a + b;
}

/* `budget` counts down the nodes visited: shared children make trees of exponential size out of few nodes. */
static tree_summary summarize(const ca_material *table, ca_material_id id, uint32_t depth, uint32_t *budget)
{
    if (depth == CA_MATERIAL_MAX_DEPTH || *budget == 0) return (tree_summary){.leaves = UINT32_MAX};
    --*budget;
    const ca_material *node = &table[id];
    ca_material_id children[2];
    const uint32_t count = ca_material_children(node, children);
    if (count == 0) return summary_without_children(node);

    tree_summary summary = summarize(table, children[0], depth + 1, budget);
    if (count == 2) {
        const tree_summary other = summarize(table, children[1], depth + 1, budget);
        summary.leaves = node->kind == CA_MATERIAL_BLEND
                             ? saturating_add(summary.leaves, other.leaves)
                             : (summary.leaves > other.leaves ? summary.leaves : other.leaves);
        summary.scatter |= other.scatter;
        summary.tangents |= other.tangents;
    }
    if (node->kind == CA_MATERIAL_MASK) summary.scatter |= CA_SCATTER_NULL | CA_SCATTER_DIRAC;
    if (node->kind == CA_MATERIAL_COATING)
        summary.scatter |= CA_SCATTER_REFLECTION |
                           (node->as.coating.facets.alpha_u == CA_NONE ? CA_SCATTER_DIRAC : CA_SCATTER_SMOOTH);
    if (node->kind == CA_MATERIAL_BUMP || node->kind == CA_MATERIAL_NORMAL_MAP) summary.tangents = true;
    return summary;
}

static tree_summary summarize_tree(const ca_material *table, ca_material_id id)
{
    uint32_t budget = CA_MATERIAL_MAX_NODES;
    return summarize(table, id, 0, &budget);
}

uint32_t ca_material_scatter(const ca_material *table, ca_material_id id)
{
    return summarize_tree(table, id).scatter;
}

bool ca_material_needs_tangents(const ca_material *table, ca_material_id id)
{
    return summarize_tree(table, id).tangents;
}

uint32_t ca_material_leaf_count(const ca_material *table, ca_material_id id)
{
    return summarize_tree(table, id).leaves;
}
