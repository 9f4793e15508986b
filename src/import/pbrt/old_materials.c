/* Materials of version 3, and what else is a sum of lobes: blends of BSDFs that each hold the share of one, so that
 * the sum is what the lobes reflect together. */
#include "import/pbrt/materials.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- Sums of lobes --------------------------------------------------------------------------------------------- */

typedef enum lobe_kind {
    DIFFUSE,  /* color */
    GLOSSY,   /* color times Fresnel's share of rough dielectric facets; what they let through is `other`'s color */
    SPECULAR, /* the same, smooth */
    THROUGH,  /* color, diffuse on the other side */
} lobe_kind;

typedef struct lobe {
    lobe_kind kind;
    ca_pbrt_value color, other;
} lobe;

enum { MAX_LOBES = 4 };

typedef struct lobes {
    lobe items[MAX_LOBES];
    size_t count;
    double index;
    ca_pbrt_roughness roughness;
} lobes;

static const ca_pbrt_value black = {.rgb = {0.0, 0.0, 0.0}};

/* Lobes without light are left out. Where there is no boundary facets reflect nothing. */
static void add_lobe(lobes *sum, lobe_kind kind, ca_pbrt_value color, ca_pbrt_value other)
{
    if ((kind == GLOSSY || kind == SPECULAR) && !ca_pbrt_is_boundary(sum->index)) color = black;
    if (!ca_pbrt_is(&color, 0.0) || !ca_pbrt_is(&other, 0.0))
        sum->items[sum->count++] = (lobe){.kind = kind, .color = color, .other = other};
}

/* A bound on what the value reflects. */
static double most_of(const ca_pbrt_value *value)
{
    return value->id ? 1.0 : fmax(value->rgb[0], fmax(value->rgb[1], value->rgb[2]));
}

static double share_of(const lobe *item) { return fmax(most_of(&item->color), most_of(&item->other)); }

static const char *type_of(const lobe *item)
{
    static const char *const types[] = {"diffuse", "roughdielectric", "dielectric", "difftrans"};
    return types[item->kind];
}

/* The value over the lobe's share. A constant above 1 is no reflectance by itself, but as a texture it is. */
static void put_share(ca_pbrt *p, ca_xml_node *bsdf, const char *name, const ca_pbrt_value *value, double weight)
{
    const ca_pbrt_value scaled = ca_pbrt_scaled(p, value, 1.0 / weight);
    if (scaled.id || most_of(&scaled) <= 1.0) {
        ca_pbrt_put_color(p, bsdf, name, &scaled);
        return;
    }
    ca_xml_node *texture = ca_tree_named_object(&p->tree, bsdf, "texture", "scale", name, NULL);
    ca_tree_rgb(&p->tree, texture, "scale", scaled.rgb);
    ca_tree_object(&p->tree, texture, "texture", "uniform");
}

static void fill_lobe(ca_pbrt *p, ca_xml_node *bsdf, const lobes *sum, const lobe *item, double weight)
{
    switch (item->kind) {
    case DIFFUSE: put_share(p, bsdf, "reflectance", &item->color, weight); return;
    case THROUGH: put_share(p, bsdf, "transmittance", &item->color, weight); return;
    case GLOSSY: ca_pbrt_put_alpha(p, bsdf, &sum->roughness); break;
    case SPECULAR: break;
    }
    ca_pbrt_put_index(p, bsdf, sum->index);
    put_share(p, bsdf, "specular_reflectance", &item->color, weight);
    put_share(p, bsdf, "specular_transmittance", &item->other, weight);
}

/* Lobes that only reflect do so on both sides. */
static bool only_reflects(const lobe *item)
{
    return item->kind == DIFFUSE || (item->kind != THROUGH && ca_pbrt_is(&item->other, 0.0));
}

static ca_xml_node *add_bsdf(ca_pbrt *p, ca_xml_node *parent, const lobe *item, bool inside_two_sided)
{
    const bool wraps = only_reflects(item) && !inside_two_sided;
    ca_xml_node *outer = wraps ? ca_tree_object(&p->tree, parent, "bsdf", "twosided") : parent;
    return ca_tree_object(&p->tree, outer, "bsdf", type_of(item));
}

/* A chain of blends, the first lobe with all the others, and so on. Each lobe weighs its share of all. */
static void put_chain(ca_pbrt *p, ca_xml_node *blend, const lobes *sum, bool two_sided, double whole)
{
    double rest = whole;
    for (size_t i = 0; i < sum->count; i++) {
        const lobe *item = &sum->items[i];
        const double share = share_of(item);
        if (i + 1 < sum->count) ca_tree_float(&p->tree, blend, "weight", 1.0 - share / rest);
        fill_lobe(p, add_bsdf(p, blend, item, two_sided), sum, item, share / whole);
        rest -= share;
        if (i + 2 < sum->count) blend = ca_tree_object(&p->tree, blend, "bsdf", "blendbsdf");
    }
}

static void put_lobes(ca_pbrt *p, const char *id, const lobes *sum, bool two_sided, const ca_pbrt_value *opacity)
{
    double whole = 0.0;
    for (size_t i = 0; i < sum->count; i++) whole += share_of(&sum->items[i]);
    if (sum->count == 0) {
        ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, "diffuse", two_sided, opacity);
        ca_pbrt_put_color(p, bsdf, "reflectance", &black);
    } else if (sum->count == 1) {
        const bool both = two_sided || only_reflects(&sum->items[0]);
        ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, type_of(&sum->items[0]), both, opacity);
        fill_lobe(p, bsdf, sum, &sum->items[0], 1.0);
    } else {
        put_chain(p, ca_pbrt_begin_bsdf(p, id, "blendbsdf", two_sided, opacity), sum, two_sided, whole);
    }
}

/* ---- The kinds ------------------------------------------------------------------------------------------------- */

static ca_pbrt_roughness read_roughness(ca_pbrt *p, double fallback)
{
    static const char *const names[3] = {"roughness", "uroughness", "vroughness"};
    return ca_pbrt_read_roughness(p, names, fallback, ca_pbrt_old_alpha);
}

/* sigma is an angle; roughdiffuse takes the slope, sqrt(2) times it. */
static void read_matte(ca_pbrt *p, const char *id)
{
    const ca_pbrt_value kd = ca_pbrt_reflectance_value(p, "Kd", 0.5);
    ca_pbrt_value sigma = ca_pbrt_number_value(p, "sigma", 0.0);
    const bool smooth = ca_pbrt_is(&sigma, 0.0);
    sigma.rgb[0] = fmin(fmax(sigma.rgb[0], 0.0), 90.0);
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, smooth ? "diffuse" : "roughdiffuse", true, NULL);
    ca_pbrt_put_color(p, bsdf, "reflectance", &kd);
    if (smooth) return;
    const ca_pbrt_value slope = ca_pbrt_scaled(p, &sigma, (pi / 180.0) * sqrt(2.0));
    ca_pbrt_put_number(p, bsdf, "alpha", &slope);
    ca_tree_boolean(&p->tree, bsdf, "use_fast_approx", true);
}

static double read_index(ca_pbrt *p)
{
    return ca_pbrt_index(p, ca_pbrt_find(&p->params, "eta") ? "eta" : "index", 1.5);
}

static void read_glass(ca_pbrt *p, const char *id)
{
    const ca_pbrt_value kr = ca_pbrt_reflectance_value(p, "Kr", 1.0), kt = ca_pbrt_reflectance_value(p, "Kt", 1.0);
    const ca_pbrt_roughness roughness = read_roughness(p, 0.0);
    const double index = read_index(p);
    const bool smooth = roughness.is_smooth || !ca_pbrt_is_boundary(index);
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, smooth ? "dielectric" : "roughdielectric", false, NULL);
    ca_pbrt_put_index(p, bsdf, index);
    ca_pbrt_put_color(p, bsdf, "specular_reflectance", &kr);
    ca_pbrt_put_color(p, bsdf, "specular_transmittance", &kt);
    if (!smooth) ca_pbrt_put_alpha(p, bsdf, &roughness);
}

static void read_mirror(ca_pbrt *p, const char *id)
{
    const ca_pbrt_value kr = ca_pbrt_reflectance_value(p, "Kr", 0.9);
    ca_pbrt_put_color(p, ca_pbrt_begin_bsdf(p, id, "conductor", true, NULL), "specular_reflectance", &kr);
}

static void read_metal(ca_pbrt *p, const char *id)
{
    double eta[3], k[3];
    ca_pbrt_copper(eta, k);
    ca_pbrt_color(p, "eta", CA_COLOR_SIGNED, eta);
    ca_pbrt_color(p, "k", CA_COLOR_SIGNED, k);
    const ca_pbrt_roughness roughness = read_roughness(p, 0.01);
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, "roughconductor", true, NULL);
    ca_tree_rgb(&p->tree, bsdf, "eta", eta);
    ca_tree_rgb(&p->tree, bsdf, "k", k);
    ca_pbrt_put_alpha(p, bsdf, &roughness);
}

/* pbrt hands Fresnel's equations of the coat its indices the wrong way round (1.5 outside of 1): read as it is meant.
 */
static void read_plastic(ca_pbrt *p, const char *id)
{
    lobes sum = {.index = 1.5};
    add_lobe(&sum, DIFFUSE, ca_pbrt_reflectance_value(p, "Kd", 0.25), black);
    add_lobe(&sum, GLOSSY, ca_pbrt_reflectance_value(p, "Ks", 0.25), black);
    sum.roughness = read_roughness(p, 0.1);
    put_lobes(p, id, &sum, true, NULL);
}

static void read_uber(ca_pbrt *p, const char *id)
{
    lobes sum = {.index = read_index(p)};
    const ca_pbrt_value kt = ca_pbrt_reflectance_value(p, "Kt", 0.0);
    const ca_pbrt_value opacity = ca_pbrt_color_value(p, "opacity", 1.0);
    add_lobe(&sum, DIFFUSE, ca_pbrt_reflectance_value(p, "Kd", 0.25), black);
    add_lobe(&sum, GLOSSY, ca_pbrt_reflectance_value(p, "Ks", 0.25), black);
    add_lobe(&sum, SPECULAR, ca_pbrt_reflectance_value(p, "Kr", 0.0), kt);
    sum.roughness = read_roughness(p, 0.1);
    put_lobes(p, id, &sum, ca_pbrt_is(&kt, 0.0), &opacity);
}

static ca_pbrt_value product(ca_pbrt *p, const ca_pbrt_value *a, const ca_pbrt_value *b)
{
    ca_pbrt_value result = black;
    if (a->id || b->id)
        ca_import_fail(p->importer, &p->params.where,
                       "%s: reflect and transmit must be numbers where Kd or Ks is a "
                       "texture, and grey",
                       p->params.what);
    for (int i = 0; i < 3; i++) result.rgb[i] = a->rgb[i] * b->rgb[i];
    return result;
}

static ca_pbrt_value times(ca_pbrt *p, const ca_pbrt_value *color, const ca_pbrt_value *factor)
{
    const bool grey = !factor->id && factor->rgb[0] == factor->rgb[1] && factor->rgb[1] == factor->rgb[2];
    return grey ? ca_pbrt_scaled(p, color, factor->rgb[0]) : product(p, color, factor);
}

static void read_translucent(ca_pbrt *p, const char *id)
{
    lobes sum = {.index = 1.5};
    const ca_pbrt_value kd = ca_pbrt_reflectance_value(p, "Kd", 0.25), ks = ca_pbrt_reflectance_value(p, "Ks", 0.25);
    const ca_pbrt_value reflect = ca_pbrt_color_value(p, "reflect", 0.5);
    const ca_pbrt_value transmit = ca_pbrt_color_value(p, "transmit", 0.5);
    add_lobe(&sum, DIFFUSE, times(p, &kd, &reflect), black);
    add_lobe(&sum, THROUGH, times(p, &kd, &transmit), black);
    add_lobe(&sum, GLOSSY, times(p, &ks, &reflect), times(p, &ks, &transmit));
    sum.roughness = read_roughness(p, 0.1);
    put_lobes(p, id, &sum, false, NULL);
}

/* Version 4's. */
static void read_diffuse_transmission(ca_pbrt *p, const char *id)
{
    lobes sum = {.index = 1.5};
    const double scale = ca_pbrt_number_in(&p->params, "scale", 1.0, 0.0, 1e6);
    const ca_pbrt_value reflected = ca_pbrt_reflectance_value(p, "reflectance", 0.25);
    const ca_pbrt_value passed = ca_pbrt_reflectance_value(p, "transmittance", 0.25);
    add_lobe(&sum, DIFFUSE, ca_pbrt_scaled(p, &reflected, scale), black);
    add_lobe(&sum, THROUGH, ca_pbrt_scaled(p, &passed, scale), black);
    put_lobes(p, id, &sum, false, NULL);
}

/* Ks is what is reflected of light that falls straight on the coat. */
static void read_substrate(ca_pbrt *p, const char *id)
{
    const ca_pbrt_value kd = ca_pbrt_reflectance_value(p, "Kd", 0.5), ks = ca_pbrt_reflectance_value(p, "Ks", 0.5);
    const ca_pbrt_roughness roughness = read_roughness(p, 0.1);
    if (ks.id) ca_pbrt_fail(&p->params, "Ks", "must be a constant colour");
    ca_import_note(p->importer, &p->params.where,
                   "substrate is roughplastic of the same reflectance at normal incidence");
    const double most = most_of(&ks), root = sqrt(fmin(most, 0.9));
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, most > 0.0 ? "roughplastic" : "diffuse", true, NULL);
    ca_pbrt_put_color(p, bsdf, most > 0.0 ? "diffuse_reflectance" : "reflectance", &kd);
    if (!(most > 0.0)) return;
    ca_pbrt_put_index(p, bsdf, (1.0 + root) / (1.0 - root));
    const ca_pbrt_value tint = ca_pbrt_scaled(p, &ks, 1.0 / most);
    ca_pbrt_put_color(p, bsdf, "specular_reflectance", &tint);
    ca_pbrt_put_coat_alpha(p, bsdf, &roughness);
}

static void read_disney(ca_pbrt *p, const char *id)
{
    static const char *const from[] = {"roughness", "anisotropic",  "metallic",  "spectrans", "sheen",
                                       "clearcoat", "speculartint", "sheentint", "flatness",  "clearcoatgloss"};
    static const char *const to[] = {"roughness", "anisotropic", "metallic",   "spec_trans", "sheen",
                                     "clearcoat", "spec_tint",   "sheen_tint", "flatness",   "clearcoat_gloss"};
    static const double fallbacks[] = {0.5, 0, 0, 0, 0, 0, 0, 0.5, 0, 1};
    const ca_pbrt_value color = ca_pbrt_reflectance_value(p, "color", 0.5);
    const ca_pbrt_value depth = ca_pbrt_color_value(p, "scatterdistance", 0.0);
    const ca_pbrt_value trans = ca_pbrt_number_value(p, "spectrans", 0.0);
    const double index = read_index(p);
    ca_pbrt_number(&p->params, "difftrans", 1.0); /* of thin ones only */
    if (!ca_pbrt_is(&depth, 0.0)) ca_pbrt_fail(&p->params, "scatterdistance", "must be 0: media are not supported");
    if (ca_pbrt_boolean(&p->params, "thin", false))
        ca_pbrt_fail(&p->params, "thin", "must be false: thin surfaces of this kind are not supported");
    const bool transmits = !ca_pbrt_is(&trans, 0.0);
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, "principled", !transmits, NULL);
    ca_pbrt_put_color(p, bsdf, "base_color", &color);
    /* What transmits needs a boundary: facets count an index of 1 as 1.001. */
    ca_tree_float(&p->tree, bsdf, "eta", transmits && !ca_pbrt_is_boundary(index) ? 1.001 : index);
    for (size_t i = 0; i < CA_COUNT(from); i++) {
        const ca_pbrt_value value = ca_pbrt_number_value(p, from[i], fallbacks[i]);
        if (!ca_pbrt_is(&value, 0.0)) ca_pbrt_put_number(p, bsdf, to[i], &value);
    }
}

static const ca_pbrt_material_kind kinds[] = {
    {"matte", read_matte},         {"glass", read_glass},
    {"mirror", read_mirror},       {"metal", read_metal},
    {"plastic", read_plastic},     {"uber", read_uber},
    {"disney", read_disney},       {"translucent", read_translucent},
    {"substrate", read_substrate}, {"diffusetransmission", read_diffuse_transmission},
};

const ca_pbrt_material_kind *ca_pbrt_old_materials(size_t *count)
{
    *count = CA_COUNT(kinds);
    return kinds;
}
