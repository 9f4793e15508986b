/* From a tree of materials to the flat list of lobes at one point. */
#include "material/bsdf.h"

#include "math/numeric.h"

#include <assert.h>

/* A node on its way down, and what its ancestors say about it. */
typedef struct tree_branch {
    ca_material_id id;
    float weight;
    bool flipped;
    ca_material_perturbed rules; /* of the maps above it */
    ca_frame frame;
    ca_material_id coat; /* the coating above it, or CA_NONE */
} tree_branch;

/* ---- Leaves ---------------------------------------------------------------------------------------------------- */

typedef struct lookup {
    const ca_texture *textures;
    const ca_surface *surface;
} lookup;

static inline ca_rgb color_or(lookup at, ca_texture_id id, float fallback)
{
    return id == CA_NONE ? ca_rgb_grey(fallback) : ca_texture_eval(at.textures, id, at.surface);
}

static inline float scalar_or(lookup at, ca_texture_id id, float fallback)
{
    return id == CA_NONE ? fallback : ca_texture_eval_scalar(at.textures, id, at.surface);
}

static ca_microfacet facets_at(const ca_material_facets *facets, lookup at)
{
    const float alpha_u = ca_max(scalar_or(at, facets->alpha_u, 0.0f), CA_MATERIAL_MIN_ALPHA);
    const bool isotropic = facets->alpha_v == facets->alpha_u || facets->alpha_v == CA_NONE;
    const float alpha_v =
        isotropic ? alpha_u : ca_max(scalar_or(at, facets->alpha_v, 0.0f), CA_MATERIAL_MIN_ALPHA);
    return (ca_microfacet){facets->distribution, alpha_u, alpha_v, facets->sample_visible};
}

static void init_principled(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.principled.base_color = color_or(at, leaf->as.principled.base_color, 0.5f);
    bxdf->as.principled.roughness = scalar_or(at, leaf->as.principled.roughness, 0.0f);
    bxdf->as.principled.anisotropic = scalar_or(at, leaf->as.principled.anisotropic, 0.0f);
    bxdf->as.principled.metallic = scalar_or(at, leaf->as.principled.metallic, 0.0f);
    bxdf->as.principled.spec_trans = scalar_or(at, leaf->as.principled.spec_trans, 0.0f);
    bxdf->as.principled.eta = leaf->as.principled.eta;
    bxdf->as.principled.spec_tint = scalar_or(at, leaf->as.principled.spec_tint, 0.0f);
    bxdf->as.principled.sheen = scalar_or(at, leaf->as.principled.sheen, 0.0f);
    bxdf->as.principled.sheen_tint = scalar_or(at, leaf->as.principled.sheen_tint, 0.0f);
    bxdf->as.principled.flatness = scalar_or(at, leaf->as.principled.flatness, 0.0f);
    bxdf->as.principled.clearcoat = scalar_or(at, leaf->as.principled.clearcoat, 0.0f);
    bxdf->as.principled.clearcoat_gloss = scalar_or(at, leaf->as.principled.clearcoat_gloss, 0.0f);
    bxdf->as.principled.diffuse_rate = leaf->as.principled.diffuse_rate;
    bxdf->as.principled.specular_rate = leaf->as.principled.specular_rate;
    bxdf->as.principled.clearcoat_rate = leaf->as.principled.clearcoat_rate;
}

/* The share of samples, before Fresnel, for a boundary's reflection, by how much comes from there and from below it:
 * at this point, since a mean over a texture may be next to nothing where there is a lot. */
static float boundary_share(float boundary, float below)
{
    return boundary + below > 0.0f ? boundary / (boundary + below) : 0.5f;
}

static void init_plastic(ca_bxdf *bxdf, const ca_material_plastic *plastic, lookup at)
{
    bxdf->as.plastic.diffuse = color_or(at, plastic->diffuse, 0.5f);
    bxdf->as.plastic.specular = color_or(at, plastic->specular, 1.0f);
    bxdf->as.plastic.eta = plastic->eta;
    bxdf->as.plastic.internal_transmittance = plastic->internal_transmittance;
    bxdf->as.plastic.specular_weight =
        boundary_share(ca_luminance(bxdf->as.plastic.specular), ca_luminance(bxdf->as.plastic.diffuse));
    bxdf->as.plastic.nonlinear = plastic->nonlinear;
}

static void init_rough_plastic(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    const ca_material_plastic *layers = &leaf->as.rough_plastic.layers;
    bxdf->as.rough_plastic.diffuse = color_or(at, layers->diffuse, 0.5f);
    bxdf->as.rough_plastic.specular = color_or(at, layers->specular, 1.0f);
    bxdf->as.rough_plastic.eta = layers->eta;
    bxdf->as.rough_plastic.internal_transmittance = layers->internal_transmittance;
    bxdf->as.rough_plastic.specular_weight =
        boundary_share(ca_luminance(bxdf->as.rough_plastic.specular), ca_luminance(bxdf->as.rough_plastic.diffuse));
    bxdf->as.rough_plastic.nonlinear = layers->nonlinear;
    bxdf->as.rough_plastic.facets = facets_at(&leaf->as.rough_plastic.facets, at);
    bxdf->as.rough_plastic.transmittance = leaf->as.rough_plastic.transmittance;
}

static void init_smooth_dielectric(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.dielectric.eta = leaf->as.dielectric.eta;
    bxdf->as.dielectric.reflectance = color_or(at, leaf->as.dielectric.reflectance, 1.0f);
    bxdf->as.dielectric.transmittance = color_or(at, leaf->as.dielectric.transmittance, 1.0f);
}

static void init_thin_dielectric(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.thin_dielectric.eta = leaf->as.thin_dielectric.eta;
    bxdf->as.thin_dielectric.reflectance = color_or(at, leaf->as.thin_dielectric.reflectance, 1.0f);
    bxdf->as.thin_dielectric.transmittance = color_or(at, leaf->as.thin_dielectric.transmittance, 1.0f);
}

static void init_rough_dielectric(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.rough_dielectric.eta = leaf->as.rough_dielectric.eta;
    bxdf->as.rough_dielectric.reflectance = color_or(at, leaf->as.rough_dielectric.reflectance, 1.0f);
    bxdf->as.rough_dielectric.transmittance = color_or(at, leaf->as.rough_dielectric.transmittance, 1.0f);
    bxdf->as.rough_dielectric.facets = facets_at(&leaf->as.rough_dielectric.facets, at);
}

static void init_smooth_conductor(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.conductor.eta = color_or(at, leaf->as.conductor.eta, 0.0f);
    bxdf->as.conductor.k = color_or(at, leaf->as.conductor.k, 1.0f);
    bxdf->as.conductor.reflectance = color_or(at, leaf->as.conductor.reflectance, 1.0f);
}

static void init_rough_conductor(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.rough_conductor.eta = color_or(at, leaf->as.rough_conductor.eta, 0.0f);
    bxdf->as.rough_conductor.k = color_or(at, leaf->as.rough_conductor.k, 1.0f);
    bxdf->as.rough_conductor.reflectance = color_or(at, leaf->as.rough_conductor.reflectance, 1.0f);
    bxdf->as.rough_conductor.facets = facets_at(&leaf->as.rough_conductor.facets, at);
}

/* 0.6's slopes: a root mean square of alpha in the plane is one of alpha / sqrt(2) along a line. */
static void init_rough_diffuse(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.rough_diffuse.reflectance = color_or(at, leaf->as.rough_diffuse.reflectance, 0.5f);
    bxdf->as.rough_diffuse.sigma = ca_max(0.0f, scalar_or(at, leaf->as.rough_diffuse.alpha, 0.0f)) * 0.70710678f;
}

/* Diffuse and specular reflectance together are at most 1, as 0.6 sees to it. Samples go where the light is: the
 * share of the specular part is returned. */
static float limit_reflectances(ca_rgb *diffuse, ca_rgb *specular)
{
    const float most = ca_rgb_max(ca_rgb_add(*diffuse, *specular)), scale = most > 1.0f ? 1.0f / most : 1.0f;
    const float s = ca_luminance(*specular), sum = s + ca_luminance(*diffuse);
    *diffuse = ca_rgb_scale(*diffuse, scale);
    *specular = ca_rgb_scale(*specular, scale);
    return sum > 0.0f ? s / sum : 0.0f;
}

static void init_phong(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.phong.diffuse = color_or(at, leaf->as.phong.diffuse, 0.5f);
    bxdf->as.phong.specular = color_or(at, leaf->as.phong.specular, 0.0f);
    bxdf->as.phong.exponent = ca_max(0.0f, scalar_or(at, leaf->as.phong.exponent, 0.0f));
    bxdf->as.phong.specular_weight = limit_reflectances(&bxdf->as.phong.diffuse, &bxdf->as.phong.specular);
}

static void init_ward(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    const ca_material_facets roughness = {.alpha_u = leaf->as.ward.alpha_u, .alpha_v = leaf->as.ward.alpha_v};
    const ca_microfacet facets = facets_at(&roughness, at);
    bxdf->as.ward.diffuse = color_or(at, leaf->as.ward.diffuse, 0.5f);
    bxdf->as.ward.specular = color_or(at, leaf->as.ward.specular, 0.0f);
    bxdf->as.ward.alpha_x = facets.alpha_x;
    bxdf->as.ward.alpha_y = facets.alpha_y;
    bxdf->as.ward.variant = leaf->as.ward.variant;
    bxdf->as.ward.specular_weight = limit_reflectances(&bxdf->as.ward.diffuse, &bxdf->as.ward.specular);
}

static void init_principled_thin(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->as.principled_thin.base_color = color_or(at, leaf->as.principled_thin.base_color, 0.5f);
    bxdf->as.principled_thin.roughness = scalar_or(at, leaf->as.principled_thin.roughness, 0.0f);
    bxdf->as.principled_thin.anisotropic = scalar_or(at, leaf->as.principled_thin.anisotropic, 0.0f);
    bxdf->as.principled_thin.spec_trans =
        ca_clamp(scalar_or(at, leaf->as.principled_thin.spec_trans, 0.0f), 0.0f, 1.0f);
    bxdf->as.principled_thin.eta = leaf->as.principled_thin.eta;
    bxdf->as.principled_thin.spec_tint = scalar_or(at, leaf->as.principled_thin.spec_tint, 0.0f);
    bxdf->as.principled_thin.sheen = scalar_or(at, leaf->as.principled_thin.sheen, 0.0f);
    bxdf->as.principled_thin.sheen_tint = scalar_or(at, leaf->as.principled_thin.sheen_tint, 0.0f);
    bxdf->as.principled_thin.flatness = scalar_or(at, leaf->as.principled_thin.flatness, 0.0f);
    bxdf->as.principled_thin.diff_trans =
        ca_clamp(0.5f * scalar_or(at, leaf->as.principled_thin.diff_trans, 0.0f), 0.0f, 1.0f);
}

static void init_coat(ca_coat *coat, const ca_material *node, lookup at)
{
    const ca_rgb sigma_a = color_or(at, node->as.coating.sigma_a, 0.0f);
    coat->eta = node->as.coating.eta;
    coat->specular = color_or(at, node->as.coating.specular, 1.0f);
    coat->absorption = ca_rgb_scale(sigma_a, node->as.coating.thickness);
    /* The colour that absorption leaves most of: what lies below may be bright in it. */
    const float least = ca_min(coat->absorption.r, ca_min(coat->absorption.g, coat->absorption.b));
    coat->specular_weight = boundary_share(ca_rgb_max(coat->specular), expf(-2.0f * least));
    coat->transmittance = node->as.coating.transmittance;
    if (coat->transmittance) coat->facets = facets_at(&node->as.coating.facets, at);
}

/* A leaf's kind is that of its model (material.c asserts it). */
static inline void init_leaf(ca_bxdf *bxdf, const ca_material *leaf, lookup at)
{
    bxdf->kind = (ca_bxdf_kind)leaf->kind;
    switch (bxdf->kind) {
    case CA_BXDF_DIFFUSE:
        bxdf->as.diffuse.reflectance = color_or(at, leaf->as.diffuse.reflectance, 0.5f);
        break;
    case CA_BXDF_DIELECTRIC: init_smooth_dielectric(bxdf, leaf, at); break;
    case CA_BXDF_THIN_DIELECTRIC: init_thin_dielectric(bxdf, leaf, at); break;
    case CA_BXDF_ROUGH_DIELECTRIC: init_rough_dielectric(bxdf, leaf, at); break;
    case CA_BXDF_CONDUCTOR: init_smooth_conductor(bxdf, leaf, at); break;
    case CA_BXDF_ROUGH_CONDUCTOR: init_rough_conductor(bxdf, leaf, at); break;
    case CA_BXDF_PLASTIC: init_plastic(bxdf, &leaf->as.plastic, at); break;
    case CA_BXDF_ROUGH_PLASTIC: init_rough_plastic(bxdf, leaf, at); break;
    case CA_BXDF_PRINCIPLED: init_principled(bxdf, leaf, at); break;
    case CA_BXDF_ROUGH_DIFFUSE: init_rough_diffuse(bxdf, leaf, at); break;
    case CA_BXDF_PHONG: init_phong(bxdf, leaf, at); break;
    case CA_BXDF_DIFFUSE_TRANSMITTER:
        bxdf->as.diffuse_transmitter.transmittance = color_or(at, leaf->as.diffuse_transmitter.transmittance, 0.5f);
        break;
    case CA_BXDF_WARD: init_ward(bxdf, leaf, at); break;
    case CA_BXDF_PRINCIPLED_THIN: init_principled_thin(bxdf, leaf, at); break;
    case CA_BXDF_KIND_COUNT: assert(false && "a material that is no leaf");
    }
}

/* A lobe from a leaf; its frame is the caller's to fill in. */
static inline ca_bsdf_lobe *add_lobe(ca_bsdf *bsdf, const ca_material *leaf, lookup at, float weight, bool flipped)
{
    assert(bsdf->lobe_count < CA_BSDF_MAX_LOBES);
    ca_bsdf_lobe *lobe = &bsdf->lobes[bsdf->lobe_count++];
    lobe->weight = weight;
    lobe->flipped = flipped;
    lobe->turns = false;
    lobe->shadow = 0.0f;
    lobe->coated = false;
    init_leaf(&lobe->bxdf, leaf, at);
    bsdf->scatter |= ca_bxdf_scatter(&lobe->bxdf);
    return lobe;
}

static inline void add_null(ca_bsdf *bsdf, float weight)
{
    bsdf->null_weight += weight;
    if (weight > 0.0f) bsdf->scatter |= CA_SCATTER_NULL | CA_SCATTER_DIRAC;
}

typedef struct tree_walk {
    ca_bsdf *bsdf;
    const ca_material *materials;
    lookup at;
    bool wi_behind; /* wi lies on the back of the surface */
    tree_branch waiting[CA_BSDF_MAX_LOBES]; /* second children of blends: at most one for each leaf */
    uint32_t waiting_count;
} tree_walk;

/* ---- Frames ---------------------------------------------------------------------------------------------------- */

/* s follows dpdu where that is known (anisotropy, bump and normal maps); elsewhere any s will do. */
static inline ca_frame shading_frame(const ca_surface *surface)
{
    const ca_vec3 dpdu = surface->dpdu;
    if (dpdu.x == 0.0f && dpdu.y == 0.0f && dpdu.z == 0.0f) return ca_frame_from_normal(surface->ns);
    return ca_frame_from_tangent(surface->ns, dpdu);
}

/* The frame around a normal given in another frame, s as near to the other's s as can be. The back of a twosided
 * material is its front seen in a mirror that lies in the surface: what leans to the left still does, so the normal
 * of the mirrored frame leans the other way. */
static ca_frame perturbed_frame(const tree_branch *branch, ca_vec3 n_local)
{
    const float length = ca_length(n_local);
    if (!(length > 0.0f) || !isfinite(length)) return branch->frame;
    ca_vec3 n = ca_mul(n_local, 1.0f / length);
    if (branch->flipped) n = (ca_vec3){-n.x, -n.y, n.z};
    return ca_frame_from_tangent(ca_normalize(ca_to_world(&branch->frame, n)), branch->frame.s);
}

/* The normal of the surface moved along its shading normal by scale times the height; the change of that normal over
 * the surface is neglected, as is usual (Blinn 1978; Mitsuba 3, src/bsdfs/bumpmap.cpp). */
static ca_vec3 bump_normal_local(const tree_branch *branch, const ca_material *node, lookup at)
{
    const ca_vec2 gradient = ca_texture_gradient(at.textures, node->as.bump.height, at.surface);
    const ca_vec3 n = branch->frame.n, dpdu = at.surface->dpdu, dpdv = at.surface->dpdv;
    const ca_vec3 moved_u = ca_madd(dpdu, node->as.bump.scale * gradient.x - ca_dot(n, dpdu), n);
    const ca_vec3 moved_v = ca_madd(dpdv, node->as.bump.scale * gradient.y - ca_dot(n, dpdv), n);
    const ca_vec3 normal = ca_cross(moved_u, moved_v);
    return ca_to_local(&branch->frame, ca_dot(at.surface->ng, normal) < 0.0f ? ca_neg(normal) : normal);
}

/* A right-handed frame around dpdu has its t against dpdv but where coordinates are mirrored. */
static ca_vec3 map_normal_local(const tree_branch *branch, const ca_material *node, lookup at)
{
    const ca_rgb c = ca_texture_eval(at.textures, node->as.normal_map.normals, at.surface);
    const ca_vec3 n = {2.0f * c.r - 1.0f, 2.0f * c.g - 1.0f, 2.0f * c.b - 1.0f};
    const bool mirrored = node->as.normal_map.against_v && ca_dot(branch->frame.t, at.surface->dpdv) > 0.0f;
    return mirrored ? (ca_vec3){n.x, -n.y, n.z} : n;
}

/* Squared roughness of a microfacet surface on which normals lean as far as n does from ns: tan^2 / 8, at most 1. */
static float shadowing_roughness2(ca_vec3 n, ca_vec3 ns)
{
    const float cosine = ca_dot(n, ns), cos2 = ca_clamp(cosine * cosine, 0.0f, 1.0f);
    return 1.0f - cos2 < 8.0f * cos2 ? (1.0f - cos2) / (8.0f * cos2) : 1.0f;
}

/* The lobe of a leaf below coats, and bump or normal maps. Where one of these lies in another, what counts is how far
 * the last normal leans from the surface's. */
static void add_lobe_below(tree_walk *walk, const ca_material *leaf, const tree_branch *branch)
{
    ca_bsdf *bsdf = walk->bsdf;
    const lookup at = walk->at;
    ca_bsdf_lobe *lobe = add_lobe(bsdf, leaf, at, branch->weight, branch->flipped);
    lobe->frame = branch->frame;
    if (branch->coat != CA_NONE) {
        lobe->coated = true;
        init_coat(&lobe->coat, &walk->materials[branch->coat], at);
        bsdf->scatter |= ca_coat_scatter(&lobe->coat, &lobe->bxdf);
    }
    if (!branch->rules.flips && !branch->rules.shadows) return;
    lobe->ns = at.surface->ns;
    lobe->turns = branch->rules.flips;
    if (branch->rules.shadows) lobe->shadow = shadowing_roughness2(lobe->frame.n, lobe->ns);
}

static void perturb(tree_branch *branch, ca_vec3 n_local, ca_material_perturbed rules, ca_material_id child)
{
    branch->frame = perturbed_frame(branch, n_local);
    branch->rules.flips |= rules.flips;
    branch->rules.shadows |= rules.shadows;
    branch->id = child;
}

/* ---- Trees ----------------------------------------------------------------------------------------------------- */

/* The child of a twosided material that faces wi. One that is seen from its back becomes a front by mirroring. */
static inline ca_material_id twosided_child(const ca_material *node, bool wi_behind, bool *flipped)
{
    const bool back = wi_behind != *flipped;
    if (!back) return node->as.twosided.front;
    *flipped = !*flipped;
    return node->as.twosided.back == CA_NONE ? node->as.twosided.front : node->as.twosided.back;
}

static float share_at(ca_texture_id id, lookup at) { return ca_clamp(scalar_or(at, id, 0.5f), 0.0f, 1.0f); }

/* A mask's child goes on with its share, the rest is null. */
static void let_through(tree_walk *walk, const ca_material *node, tree_branch *branch)
{
    const float share = share_at(node->as.mask.opacity, walk->at);
    add_null(walk->bsdf, branch->weight * (1.0f - share));
    branch->weight *= share;
    branch->id = node->as.mask.child;
}

/* A blend's first child goes on with its share; the second waits. */
static void divide(tree_walk *walk, const ca_material *node, tree_branch *branch)
{
    const float share = share_at(node->as.blend.weight, walk->at);
    assert(walk->waiting_count < CA_BSDF_MAX_LOBES);
    tree_branch *second = &walk->waiting[walk->waiting_count++];
    *second = *branch;
    second->id = node->as.blend.second;
    second->weight *= share;
    branch->weight *= 1.0f - share;
    branch->id = node->as.blend.first;
}

/* One level down; false at a leaf, which becomes a lobe or a null part. */
static bool descend(tree_walk *walk, tree_branch *branch)
{
    const ca_material *node = &walk->materials[branch->id];
    if (ca_material_is_leaf(node->kind)) {
        add_lobe_below(walk, node, branch);
        return false;
    }
    switch (node->kind) {
    case CA_MATERIAL_TWOSIDED: branch->id = twosided_child(node, walk->wi_behind, &branch->flipped); return true;
    case CA_MATERIAL_MASK: let_through(walk, node, branch); return true;
    case CA_MATERIAL_BLEND: divide(walk, node, branch); return true;
    case CA_MATERIAL_BUMP:
        perturb(branch, bump_normal_local(branch, node, walk->at), node->as.bump.rules, node->as.bump.child);
        return true;
    case CA_MATERIAL_NORMAL_MAP:
        perturb(branch, map_normal_local(branch, node, walk->at), node->as.normal_map.rules,
                node->as.normal_map.child);
        return true;
    case CA_MATERIAL_COATING:
        branch->coat = branch->id;
        branch->id = node->as.coating.child;
        return true;
    case CA_MATERIAL_NULL: add_null(walk->bsdf, branch->weight); return false;
    default: break;
    }
    assert(false && "unknown kind of material");
    return false;
}

/* Depth first, first children first; what weighs nothing is left out. */
static void add_tree(tree_walk *walk, tree_branch branch)
{
    for (;;) {
        while (branch.weight != 0.0f && descend(walk, &branch)) {
        }
        if (walk->waiting_count == 0) return;
        branch = walk->waiting[--walk->waiting_count];
    }
}

void ca_bsdf_init(ca_bsdf *bsdf, const ca_material *materials, const ca_texture *textures, const ca_surface *surface,
                  ca_vec3 wi_world)
{
    bsdf->ng = surface->ng;
    bsdf->null_weight = 0.0f;
    bsdf->lobe_count = 0;
    bsdf->scatter = 0;

    const lookup at = {textures, surface};
    const bool wi_behind = ca_dot(wi_world, surface->ng) < 0.0f;
    bool flipped = false;
    ca_material_id id = surface->material;
    while (materials[id].kind == CA_MATERIAL_TWOSIDED) id = twosided_child(&materials[id], wi_behind, &flipped);

    /* The common case is a single leaf, twosided or not: no branches to copy. */
    if (ca_material_is_leaf(materials[id].kind)) {
        add_lobe(bsdf, &materials[id], at, 1.0f, flipped)->frame = shading_frame(surface);
        return;
    }
    tree_walk walk;
    walk.bsdf = bsdf;
    walk.materials = materials;
    walk.at = at;
    walk.wi_behind = wi_behind;
    walk.waiting_count = 0;
    add_tree(&walk, (tree_branch){id, 1.0f, flipped, {false, false}, shading_frame(surface), CA_NONE});
}
