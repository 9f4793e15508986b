#include "material/material.h"

#include "material/fresnel.h"
#include "material/rough_transmittance.h"

#include <assert.h>

/* ---- Kinds ----------------------------------------------------------------------------------------------------- */

/* What an initialiser leaves out is 0, which is a texture: every id is named. */
#define NO_FACETS {.sample_visible = true, .alpha_u = CA_NONE, .alpha_v = CA_NONE}
#define NO_PLASTIC {.diffuse = CA_NONE, .specular = CA_NONE, .eta = 1.0f}
#define NO_PRINCIPLED                                                                                                \
    {CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, 1, 1, 1, 1}

ca_material ca_material_of_kind(ca_material_kind kind)
{
    static const ca_material of_kind[] = {
        [CA_MATERIAL_DIFFUSE] = {.as.diffuse = {CA_NONE}},
        [CA_MATERIAL_DIELECTRIC] = {.as.dielectric = {1.0f, CA_NONE, CA_NONE}},
        [CA_MATERIAL_THIN_DIELECTRIC] = {.as.thin_dielectric = {1.0f, CA_NONE, CA_NONE}},
        [CA_MATERIAL_ROUGH_DIELECTRIC] = {.as.rough_dielectric = {1.0f, CA_NONE, CA_NONE, NO_FACETS}},
        [CA_MATERIAL_CONDUCTOR] = {.as.conductor = {CA_NONE, CA_NONE, CA_NONE}},
        [CA_MATERIAL_ROUGH_CONDUCTOR] = {.as.rough_conductor = {CA_NONE, CA_NONE, CA_NONE, NO_FACETS}},
        [CA_MATERIAL_PLASTIC] = {.as.plastic = NO_PLASTIC},
        [CA_MATERIAL_ROUGH_PLASTIC] = {.as.rough_plastic = {NO_PLASTIC, NO_FACETS, NULL}},
        [CA_MATERIAL_PRINCIPLED] = {.as.principled = NO_PRINCIPLED},
        [CA_MATERIAL_NULL] = {.kind = CA_MATERIAL_NULL},
        [CA_MATERIAL_TWOSIDED] = {.as.twosided = {CA_NONE, CA_NONE}},
        [CA_MATERIAL_MASK] = {.as.mask = {CA_NONE, CA_NONE}},
        [CA_MATERIAL_BLEND] = {.as.blend = {CA_NONE, CA_NONE, CA_NONE}},
        [CA_MATERIAL_BUMP] = {.as.bump = {CA_NONE, CA_NONE, 1.0f}},
        [CA_MATERIAL_NORMAL_MAP] = {.as.normal_map = {CA_NONE, CA_NONE}},
    };
    _Static_assert(sizeof of_kind / sizeof *of_kind == CA_MATERIAL_KIND_COUNT, "every kind has its row");
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
    case CA_MATERIAL_DIFFUSE:
    case CA_MATERIAL_DIELECTRIC:
    case CA_MATERIAL_THIN_DIELECTRIC:
    case CA_MATERIAL_ROUGH_DIELECTRIC:
    case CA_MATERIAL_CONDUCTOR:
    case CA_MATERIAL_ROUGH_CONDUCTOR:
    case CA_MATERIAL_PLASTIC:
    case CA_MATERIAL_ROUGH_PLASTIC:
    case CA_MATERIAL_PRINCIPLED:
    case CA_MATERIAL_NULL:
    case CA_MATERIAL_KIND_COUNT: break;
    }
    return 0;
}

/* ---- Preparation ----------------------------------------------------------------------------------------------- */

static float mean_luminance_or(const ca_texture *textures, ca_texture_id id, float fallback)
{
    return id == CA_NONE ? fallback : ca_luminance(ca_texture_mean(textures, id));
}

/* Share of a plastic's samples for its coat, before Fresnel: by the brightness of coat and base. */
static float plastic_specular_weight(const ca_material_plastic *plastic, const ca_texture *textures)
{
    const float specular = mean_luminance_or(textures, plastic->specular, 1.0f);
    const float diffuse = mean_luminance_or(textures, plastic->diffuse, 0.5f);
    return specular + diffuse > 0.0f ? specular / (specular + diffuse) : 0.5f;
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
    layers->specular_weight = plastic_specular_weight(layers, textures);
    layers->internal_reflectance = ca_rough_transmittance_internal_reflectance(table);
    return CA_OK;
}

ca_status ca_material_prepare(ca_material *material, const ca_texture *textures, ca_error *error)
{
    if (material->kind == CA_MATERIAL_ROUGH_PLASTIC) return prepare_rough_plastic(material, textures, error);
    if (material->kind != CA_MATERIAL_PLASTIC) return CA_OK;
    ca_material_plastic *plastic = &material->as.plastic;
    plastic->specular_weight = plastic_specular_weight(plastic, textures);
    plastic->internal_reflectance = ca_fresnel_diffuse_reflectance(1.0f / plastic->eta);
    return CA_OK;
}

void ca_material_release(ca_material *material)
{
    if (material->kind != CA_MATERIAL_ROUGH_PLASTIC) return;
    ca_rough_transmittance_destroy(material->as.rough_plastic.transmittance);
    material->as.rough_plastic.transmittance = NULL;
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

/* What a material that holds no others can do wherever its textures are looked up: all that a set parameter switches
 * on counts as on. */
static tree_summary summary_without_children(const ca_material *leaf)
{
    ca_bxdf bxdf = {.kind = CA_BXDF_DIFFUSE};
    bool tangents = false;
    switch (leaf->kind) {
    case CA_MATERIAL_DIFFUSE: break;
    case CA_MATERIAL_DIELECTRIC: bxdf.kind = CA_BXDF_DIELECTRIC; break;
    case CA_MATERIAL_THIN_DIELECTRIC: bxdf.kind = CA_BXDF_THIN_DIELECTRIC; break;
    case CA_MATERIAL_ROUGH_DIELECTRIC:
        bxdf.kind = CA_BXDF_ROUGH_DIELECTRIC;
        tangents = facets_are_anisotropic(&leaf->as.rough_dielectric.facets);
        break;
    case CA_MATERIAL_CONDUCTOR: bxdf.kind = CA_BXDF_CONDUCTOR; break;
    case CA_MATERIAL_ROUGH_CONDUCTOR:
        bxdf.kind = CA_BXDF_ROUGH_CONDUCTOR;
        tangents = facets_are_anisotropic(&leaf->as.rough_conductor.facets);
        break;
    case CA_MATERIAL_PLASTIC: bxdf.kind = CA_BXDF_PLASTIC; break;
    case CA_MATERIAL_ROUGH_PLASTIC:
        bxdf.kind = CA_BXDF_ROUGH_PLASTIC;
        tangents = facets_are_anisotropic(&leaf->as.rough_plastic.facets);
        break;
    case CA_MATERIAL_PRINCIPLED:
        bxdf.kind = CA_BXDF_PRINCIPLED;
        bxdf.as.principled.spec_trans = leaf->as.principled.spec_trans == CA_NONE ? 0.0f : 1.0f;
        tangents = leaf->as.principled.anisotropic != CA_NONE;
        break;
    case CA_MATERIAL_NULL: return (tree_summary){.leaves = 1, .scatter = CA_SCATTER_NULL | CA_SCATTER_DIRAC};
    case CA_MATERIAL_TWOSIDED:
    case CA_MATERIAL_MASK:
    case CA_MATERIAL_BLEND:
    case CA_MATERIAL_BUMP:
    case CA_MATERIAL_NORMAL_MAP:
    case CA_MATERIAL_KIND_COUNT: assert(!"a material that is no leaf");
    }
    return (tree_summary){.leaves = 1, .scatter = ca_bxdf_scatter(&bxdf), .tangents = tangents};
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
