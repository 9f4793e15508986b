/* Materials as the scene holds them: a small tree of nodes in one table, children by index, parameters as textures.
 * ca_bsdf_init (bsdf.h) evaluates a tree at a point.
 *
 * A parameter that is CA_NONE has its usual value: reflectances and transmittances of the dielectrics, conductors and
 * plastics' coats 1, diffuse reflectances 0.5, conductors' eta 0 and k 1 (all is reflected), everything else 0.
 * Roughness is raised to at least CA_MATERIAL_MIN_ALPHA, opacities and blend weights are brought into [0, 1].
 *
 * Ownership: a material owns its rough_transmittance, nothing else. Threads: immutable once prepared. */
#ifndef CA_MATERIAL_MATERIAL_H
#define CA_MATERIAL_MATERIAL_H

#include "material/bxdf.h"
#include "material/texture.h"

typedef uint32_t ca_material_id;

/* Below this the microfacet models lose their digits. */
#define CA_MATERIAL_MIN_ALPHA 1e-4f

typedef enum ca_material_kind {
    CA_MATERIAL_DIFFUSE,
    CA_MATERIAL_DIELECTRIC,
    CA_MATERIAL_THIN_DIELECTRIC,
    CA_MATERIAL_ROUGH_DIELECTRIC,
    CA_MATERIAL_CONDUCTOR,
    CA_MATERIAL_ROUGH_CONDUCTOR,
    CA_MATERIAL_PLASTIC,
    CA_MATERIAL_ROUGH_PLASTIC,
    CA_MATERIAL_PRINCIPLED,
    CA_MATERIAL_NULL,
    /* those that hold others */
    CA_MATERIAL_TWOSIDED,
    CA_MATERIAL_MASK,
    CA_MATERIAL_BLEND,
    CA_MATERIAL_BUMP,
    CA_MATERIAL_NORMAL_MAP,
} ca_material_kind;

typedef struct ca_material {
    ca_material_kind kind;
    /* Leaves. Unused parameters are CA_NONE. */
    ca_texture_id reflectance;      /* diffuse: reflectance; plastic: diffuse_reflectance; principled: base_color */
    ca_texture_id specular;         /* specular_reflectance */
    ca_texture_id transmittance;    /* specular_transmittance */
    ca_texture_id alpha_u,
        alpha_v; /* roughness; isotropic: the same id, or no alpha_v. principled: roughness, anisotropic */
    ca_texture_id eta_rgb, k_rgb;   /* conductors: complex index of refraction over the outside's */
    float eta;                      /* dielectrics: interior over exterior index */
    ca_microfacet_kind distribution;
    bool sample_visible;
    bool nonlinear; /* plastics */
    struct {
        ca_texture_id metallic, spec_trans, spec_tint, sheen, sheen_tint, flatness, clearcoat, clearcoat_gloss;
        float diffuse_rate, specular_rate, clearcoat_rate;
    } principled;

    /* Nodes: twosided (front, back; CA_NONE: the back is the front again), mask (child), blend (a, b), bump and
     * normal map (child). */
    ca_material_id child[2];
    ca_texture_id
        modifier; /* mask: opacity; blend: weight of child[1]; bump: height; normal map: (n + 1) / 2 (raw) */
    float scale;            /* bump: factor on the height */

    /* Made by ca_material_prepare. */
    float internal_reflectance, specular_weight;
    struct ca_rough_transmittance *rough_transmittance; /* owned; rough plastic */
} ca_material;

/* Fills in what a node needs precomputed (for a rough plastic, for its mean roughness). The material must have a zero
 * rough_transmittance; CA_ERROR_MEMORY leaves nothing to release. */
ca_status ca_material_prepare(ca_material *material, const ca_texture *textures, ca_error *error);
void ca_material_release(ca_material *material);

/* CA_SCATTER_... bits of all that the tree can do. */
uint32_t ca_material_scatter(const ca_material *table, ca_material_id id);
/* Does the tree use dpdu and dpdv (bump or normal maps, anisotropy)? */
bool ca_material_needs_tangents(const ca_material *table, ca_material_id id);
/* Number of leaves that one evaluation can reach (both children of a blend, one of a twosided; null counts as one).
 * UINT32_MAX where the tree has more than CA_MATERIAL_MAX_DEPTH levels or CA_MATERIAL_MAX_NODES nodes (or a cycle):
 * the two above then speak of a part of it only, and such a tree is refused when a scene is compiled. */
enum { CA_MATERIAL_MAX_DEPTH = 32, CA_MATERIAL_MAX_NODES = 256 };
uint32_t ca_material_leaf_count(const ca_material *table, ca_material_id id);

#endif
