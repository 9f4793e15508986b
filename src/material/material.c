#include "material/material.h"

#include "material/fresnel.h"
#include "material/rough_transmittance.h"

#include <assert.h>

/* ---- Preparation ----------------------------------------------------------------------------------------------- */

static float mean_luminance_or(const ca_texture *textures, ca_texture_id id, float fallback)
{
    return id == CA_NONE ? fallback : ca_luminance(ca_texture_mean(textures, id));
}

/* Share of a plastic's samples for its coat, before Fresnel: by the brightness of coat and base. */
static float plastic_specular_weight(const ca_material *material, const ca_texture *textures)
{
    const float specular = mean_luminance_or(textures, material->specular, 1.0f);
    const float diffuse = mean_luminance_or(textures, material->reflectance, 0.5f);
    return specular + diffuse > 0.0f ? specular / (specular + diffuse) : 0.5f;
}

/* The table is for one roughness: the mean, where it varies. */
static ca_status prepare_rough_plastic(ca_material *material, const ca_texture *textures, ca_error *error)
{
    const float alpha = fmaxf(mean_luminance_or(textures, material->alpha_u, 0.0f), CA_MATERIAL_MIN_ALPHA);
    material->rough_transmittance = ca_rough_transmittance_create(material->distribution, alpha, material->eta);
    if (!material->rough_transmittance) return ca_fail_memory(error, "a rough plastic's transmittance");
    material->specular_weight = plastic_specular_weight(material, textures);
    material->internal_reflectance = ca_rough_transmittance_internal_reflectance(material->rough_transmittance);
    return CA_OK;
}

ca_status ca_material_prepare(ca_material *material, const ca_texture *textures, ca_error *error)
{
    switch (material->kind) {
    case CA_MATERIAL_PLASTIC:
        material->specular_weight = plastic_specular_weight(material, textures);
        material->internal_reflectance = ca_fresnel_diffuse_reflectance(1.0f / material->eta);
        return CA_OK;
    case CA_MATERIAL_ROUGH_PLASTIC: return prepare_rough_plastic(material, textures, error);
    default: return CA_OK;
    }
}

void ca_material_release(ca_material *material)
{
    ca_rough_transmittance_destroy(material->rough_transmittance);
    material->rough_transmittance = NULL;
}

/* ---- Properties of trees --------------------------------------------------------------------------------------- */

/* What a walk over a tree finds. */
typedef struct tree_summary {
    uint32_t leaves; /* that one evaluation can reach; UINT32_MAX: too much of a tree */
    uint32_t scatter;
    bool tangents;
} tree_summary;

static ca_bxdf_kind leaf_bxdf_kind(ca_material_kind kind)
{
    switch (kind) {
    case CA_MATERIAL_DIFFUSE: return CA_BXDF_DIFFUSE;
    case CA_MATERIAL_DIELECTRIC: return CA_BXDF_DIELECTRIC;
    case CA_MATERIAL_THIN_DIELECTRIC: return CA_BXDF_THIN_DIELECTRIC;
    case CA_MATERIAL_ROUGH_DIELECTRIC: return CA_BXDF_ROUGH_DIELECTRIC;
    case CA_MATERIAL_CONDUCTOR: return CA_BXDF_CONDUCTOR;
    case CA_MATERIAL_ROUGH_CONDUCTOR: return CA_BXDF_ROUGH_CONDUCTOR;
    case CA_MATERIAL_PLASTIC: return CA_BXDF_PLASTIC;
    case CA_MATERIAL_ROUGH_PLASTIC: return CA_BXDF_ROUGH_PLASTIC;
    case CA_MATERIAL_PRINCIPLED: return CA_BXDF_PRINCIPLED;
    default: break;
    }
    assert(!"a material that is no leaf");
    return CA_BXDF_DIFFUSE;
}

static bool leaf_is_anisotropic(const ca_material *leaf)
{
    switch (leaf->kind) {
    case CA_MATERIAL_ROUGH_DIELECTRIC:
    case CA_MATERIAL_ROUGH_CONDUCTOR:
    case CA_MATERIAL_ROUGH_PLASTIC: return leaf->alpha_v != CA_NONE && leaf->alpha_v != leaf->alpha_u;
    case CA_MATERIAL_PRINCIPLED: return leaf->alpha_v != CA_NONE; /* its anisotropy */
    default: return false;
    }
}

/* What a leaf can do wherever its textures are looked up: all that a set parameter switches on counts as on. */
static tree_summary leaf_summary(const ca_material *leaf)
{
    if (leaf->kind == CA_MATERIAL_NULL)
        return (tree_summary){.leaves = 1, .scatter = CA_SCATTER_NULL | CA_SCATTER_DIRAC};
    ca_bxdf bxdf = {.kind = leaf_bxdf_kind(leaf->kind)};
    if (leaf->kind == CA_MATERIAL_PRINCIPLED)
        bxdf.as.principled.spec_trans = leaf->principled.spec_trans == CA_NONE ? 0.0f : 1.0f;
    return (tree_summary){.leaves = 1,
                          .scatter = ca_bxdf_scatter(&bxdf),
                          .tangents = leaf_is_anisotropic(leaf)};
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
    if (node->kind < CA_MATERIAL_TWOSIDED) return leaf_summary(node);

    tree_summary summary = summarize(table, node->child[0], depth + 1, budget);
    switch (node->kind) {
    case CA_MATERIAL_MASK: summary.scatter |= CA_SCATTER_NULL | CA_SCATTER_DIRAC; break;
    case CA_MATERIAL_BUMP:
    case CA_MATERIAL_NORMAL_MAP: summary.tangents = true; break;
    default: {
        if (node->kind == CA_MATERIAL_TWOSIDED && (node->child[1] == CA_NONE || node->child[1] == node->child[0]))
            break;
        const tree_summary other = summarize(table, node->child[1], depth + 1, budget);
        summary.leaves = node->kind == CA_MATERIAL_BLEND
                             ? saturating_add(summary.leaves, other.leaves)
                             : (summary.leaves > other.leaves ? summary.leaves : other.leaves);
        summary.scatter |= other.scatter;
        summary.tangents |= other.tangents;
        break;
    }
    }
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
