/* Materials as the scene holds them: a small tree of nodes in one table, children by index, parameters as textures.
 * ca_bsdf_init (bsdf.h) evaluates a tree at a point.
 *
 * A parameter that is CA_NONE has its usual value: reflectances and transmittances of the dielectrics, conductors and
 * plastics' coats 1, diffuse reflectances 0.5, conductors' eta 0 and k 1 (all is reflected), everything else 0.
 * Roughness is raised to at least CA_MATERIAL_MIN_ALPHA, opacities and blend weights are brought into [0, 1].
 *
 * Ownership: a rough plastic or coating owns its table of transmittances, others nothing. Threads: immutable once
 * prepared. */
#ifndef CA_MATERIAL_MATERIAL_H
#define CA_MATERIAL_MATERIAL_H

#include "material/bxdf.h"
#include "material/texture.h"

typedef uint32_t ca_material_id;

/* Below this the microfacet models lose their digits. */
#define CA_MATERIAL_MIN_ALPHA 1e-4f

/* What an initialiser leaves out is 0, which is a texture: every id is named. */
#define CA_NO_FACETS {.sample_visible = true, .alpha_u = CA_NONE, .alpha_v = CA_NONE}
#define CA_NO_PLASTIC {.diffuse = CA_NONE, .specular = CA_NONE, .eta = 1.0f}
#define CA_NO_PRINCIPLED                                                                                             \
    {CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, 1, 1, 1, 1}
#define CA_NO_PRINCIPLED_THIN                                                                                        \
    {CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_NONE, 1}

/* Leaves scatter by themselves, each by the model of its name (CA_BXDF_MODELS, in that order); nodes hold others.
 * ROW(KIND, name in scene files, value as ca_material_of_kind makes it). */
#define CA_MATERIAL_LEAVES(ROW)                                                                                      \
    ROW(DIFFUSE, "diffuse", .as.diffuse = {CA_NONE})                                                                 \
    ROW(DIELECTRIC, "dielectric", .as.dielectric = {1.0f, CA_NONE, CA_NONE})                                         \
    ROW(THIN_DIELECTRIC, "thindielectric", .as.thin_dielectric = {1.0f, CA_NONE, CA_NONE})                           \
    ROW(ROUGH_DIELECTRIC, "roughdielectric", .as.rough_dielectric = {1.0f, CA_NONE, CA_NONE, CA_NO_FACETS})          \
    ROW(CONDUCTOR, "conductor", .as.conductor = {CA_NONE, CA_NONE, CA_NONE})                                         \
    ROW(ROUGH_CONDUCTOR, "roughconductor", .as.rough_conductor = {CA_NONE, CA_NONE, CA_NONE, CA_NO_FACETS})          \
    ROW(PLASTIC, "plastic", .as.plastic = CA_NO_PLASTIC)                                                             \
    ROW(ROUGH_PLASTIC, "roughplastic", .as.rough_plastic = {CA_NO_PLASTIC, CA_NO_FACETS, NULL})                      \
    ROW(PRINCIPLED, "principled", .as.principled = CA_NO_PRINCIPLED)                                                 \
    ROW(ROUGH_DIFFUSE, "roughdiffuse", .as.rough_diffuse = {CA_NONE, CA_NONE})                                       \
    ROW(PHONG, "phong", .as.phong = {CA_NONE, CA_NONE, CA_NONE})                                                     \
    ROW(DIFFUSE_TRANSMITTER, "difftrans", .as.diffuse_transmitter = {CA_NONE})                                       \
    ROW(WARD, "ward", .as.ward = {CA_NONE, CA_NONE, CA_NONE, CA_NONE, CA_WARD_BALANCED})                             \
    ROW(PRINCIPLED_THIN, "principledthin", .as.principled_thin = CA_NO_PRINCIPLED_THIN)
#define CA_MATERIAL_NODES(ROW)                                                                                       \
    ROW(NULL, "null", .as.diffuse = {CA_NONE}) /* has no parameters */                                               \
    ROW(TWOSIDED, "twosided", .as.twosided = {CA_NONE, CA_NONE})                                                     \
    ROW(MASK, "mask", .as.mask = {CA_NONE, CA_NONE})                                                                 \
    ROW(BLEND, "blendbsdf", .as.blend = {CA_NONE, CA_NONE, CA_NONE})                                                 \
    ROW(BUMP, "bumpmap", .as.bump = {CA_NONE, CA_NONE, 1.0f, {true, true}})                                          \
    ROW(NORMAL_MAP, "normalmap", .as.normal_map = {CA_NONE, CA_NONE, {true, true}, false})                           \
    ROW(COATING, "coating", .as.coating = {CA_NONE, CA_NONE, CA_NONE, 1.0f, 1.0f, CA_NO_FACETS, NULL})

#define CA_MATERIAL_ENUMERATOR(KIND, ...) CA_MATERIAL_##KIND,
typedef enum ca_material_kind {
    CA_MATERIAL_LEAVES(CA_MATERIAL_ENUMERATOR) CA_MATERIAL_NODES(CA_MATERIAL_ENUMERATOR) CA_MATERIAL_KIND_COUNT
} ca_material_kind;

/* Microfacets of a rough boundary. */
typedef struct ca_material_facets {
    ca_microfacet_kind distribution;
    bool sample_visible;
    ca_texture_id alpha_u, alpha_v; /* isotropic: the same id, or no alpha_v */
} ca_material_facets;

/* A diffuse base under a dielectric coat, smooth or rough. */
typedef struct ca_material_plastic {
    ca_texture_id diffuse, specular;
    float eta; /* interior over exterior index */
    bool nonlinear;
    float internal_transmittance; /* made by ca_material_prepare */
} ca_material_plastic;

/* What a bump or normal map does about normals that no real surface could have (bsdf.h). */
typedef struct ca_material_perturbed {
    bool flips;   /* a normal that faces away from the eye leans the other way */
    bool shadows; /* light fades where the perturbed surface would shadow itself */
} ca_material_perturbed;

typedef struct ca_material {
    ca_material_kind kind;
    union { /* the member of the kind's name; NULL has none */
        struct {
            ca_texture_id reflectance;
        } diffuse;
        struct {
            ca_texture_id reflectance, alpha; /* alpha: root mean square slope */
        } rough_diffuse;
        struct {
            ca_texture_id diffuse, specular, exponent;
        } phong;
        struct {
            ca_texture_id transmittance; /* 0.5 where it is not set */
        } diffuse_transmitter;
        struct {
            ca_texture_id diffuse, specular;
            ca_texture_id alpha_u, alpha_v; /* isotropic: the same id, or no alpha_v */
            ca_ward_variant variant;
        } ward;
        struct {
            float eta; /* interior over exterior index */
            ca_texture_id reflectance, transmittance;
        } dielectric, thin_dielectric;
        struct {
            float eta;
            ca_texture_id reflectance, transmittance;
            ca_material_facets facets;
        } rough_dielectric;
        struct {
            ca_texture_id eta, k; /* complex index of refraction over the outside's */
            ca_texture_id reflectance;
        } conductor;
        struct {
            ca_texture_id eta, k;
            ca_texture_id reflectance;
            ca_material_facets facets;
        } rough_conductor;
        ca_material_plastic plastic;
        struct {
            ca_material_plastic layers;
            ca_material_facets facets;
            struct ca_rough_transmittance *transmittance; /* owned; made by ca_material_prepare */
        } rough_plastic;
        struct {
            ca_texture_id base_color, roughness, anisotropic, metallic, spec_trans, spec_tint, sheen, sheen_tint,
                flatness, clearcoat, clearcoat_gloss;
            float eta;
            float diffuse_rate, specular_rate, clearcoat_rate;
        } principled;
        struct {
            ca_texture_id base_color, roughness, anisotropic, spec_trans, spec_tint, sheen, sheen_tint, flatness;
            ca_texture_id diff_trans; /* in [0, 2]: half of it is the share that passes */
            float eta;
        } principled_thin;
        struct {
            ca_material_id front, back; /* no back: the front again */
        } twosided;
        struct {
            ca_material_id child;
            ca_texture_id opacity;
        } mask;
        struct {
            ca_material_id first, second;
            ca_texture_id weight; /* of the second */
        } blend;
        struct {
            ca_material_id child;
            ca_texture_id height;
            float scale; /* factor on the height */
            ca_material_perturbed rules;
        } bump;
        struct {
            ca_material_id child;
            ca_texture_id normals; /* (n + 1) / 2, raw */
            ca_material_perturbed rules;
            bool against_v; /* the normals' y is against dpdv; else they are in a right-handed frame */
        } normal_map;
        struct {
            ca_material_id child;            /* of leaves that reflect, and blends, alone */
            ca_texture_id specular, sigma_a; /* factor on the reflection; absorption per length */
            float eta, thickness;            /* eta: interior over exterior index */
            ca_material_facets facets;       /* no alpha_u: a smooth coat */
            struct ca_rough_transmittance *transmittance; /* owned, by ca_material_prepare; NULL: a smooth coat */
        } coating;
    } as;
} ca_material;

/* A material of a kind, with no textures and no children; indices, scales and rates are 1. */
ca_material ca_material_of_kind(ca_material_kind kind);

/* As in scene files: "roughplastic". */
extern const char *const ca_material_kind_names[CA_MATERIAL_KIND_COUNT];

/* Is it one that scatters by itself, that holds no others and is not null? */
static inline bool ca_material_is_leaf(ca_material_kind kind) { return kind < CA_MATERIAL_NULL; }

/* The materials that it holds, at most two: how many. A twosided one whose back is its front holds one. */
uint32_t ca_material_children(const ca_material *material, ca_material_id children[2]);

/* Fills in what a node needs precomputed (for a rough plastic or coating, for its mean roughness, whose transmittance
 * must be NULL before); CA_ERROR_MEMORY leaves nothing to release. */
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
