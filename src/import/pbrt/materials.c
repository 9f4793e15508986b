/* Materials of version 4, and what all materials share. Those that only reflect do so on both sides, as in pbrt. */
#include "import/pbrt/materials.h"

#include "base/text.h"
#include "material/material.h"

#include <string.h>

/* ---- The tree around a BSDF ------------------------------------------------------------------------------------ */

typedef struct frame {
    ca_xml_node *parent;
    const char *id; /* of the next object, or NULL once it is taken */
} frame;

static ca_xml_node *wrap(ca_pbrt *p, frame *at, const char *type)
{
    ca_xml_node *node = ca_tree_named_object(&p->tree, at->parent, "bsdf", type, NULL, at->id);
    at->id = NULL;
    at->parent = node;
    return node;
}

/* "texture displacement", version 3's "texture bumpmap", and the picture "normalmap". */
static void wrap_normals(ca_pbrt *p, frame *at)
{
    const char *height = ca_pbrt_find(&p->params, "bumpmap") ? "bumpmap" : "displacement";
    const ca_pbrt_value value = ca_pbrt_number_value(p, height, 0.0);
    if (value.id) ca_tree_ref(&p->tree, wrap(p, at, "bumpmap"), "height", value.id);
    const char *normals = ca_pbrt_string(&p->params, "normalmap", NULL);
    if (!normals || !normals[0]) return;
    p->has_pictures = true;
    ca_pbrt_add_bitmap(p, wrap(p, at, "normalmap"), "normals", normals, true);
}

ca_xml_node *ca_pbrt_begin_bsdf(ca_pbrt *p, const char *id, const char *type, bool two_sided,
                                const ca_pbrt_value *opacity)
{
    frame at = {.parent = ca_tree_root(&p->tree), .id = id};
    if (opacity && !ca_pbrt_is(opacity, 1.0)) ca_pbrt_put_color(p, wrap(p, &at, "mask"), "opacity", opacity);
    if (two_sided) wrap(p, &at, "twosided");
    wrap_normals(p, &at);
    return wrap(p, &at, type);
}

/* ---- Roughness ------------------------------------------------------------------------------------------------- */

static double remap(double roughness) { return sqrt(fmax(0.0, roughness)); }

/* Perceptual roughness to alpha (Burley): version 3's fit of the slope's logarithm. */
double ca_pbrt_old_alpha(double roughness)
{
    const double x = log(fmax(roughness, 1e-3));
    return 1.62142 + 0.819955 * x + 0.1734 * x * x + 0.0171201 * x * x * x + 0.000640711 * x * x * x * x;
}

static bool is_same(const ca_pbrt_value *a, const ca_pbrt_value *b)
{
    return a->id == b->id && a->rgb[0] == b->rgb[0];
}

/* Version 3's fit as a power of the roughness: within 2.8 % of it from 0.01 to 1. */
static ca_pbrt_value old_alpha_of_texture(ca_pbrt *p, const ca_pbrt_value *texture)
{
    const ca_pbrt_value power = ca_pbrt_power(p, texture, 0.536);
    ca_import_note(p->importer, &p->params.where, "a texture of roughness r is remapped to 1.595 r^0.536");
    return ca_pbrt_scaled(p, &power, 1.595);
}

static void remap_value(ca_pbrt *p, ca_pbrt_value *value, double (*to_alpha)(double))
{
    for (int i = 0; i < 3; i++) value->rgb[i] = to_alpha(value->rgb[i]);
    if (value->id) *value = to_alpha == remap ? ca_pbrt_power(p, value, 0.5) : old_alpha_of_texture(p, value);
}

ca_pbrt_roughness ca_pbrt_read_roughness(ca_pbrt *p, const char *const names[3], double fallback,
                                         double (*to_alpha)(double))
{
    const ca_pbrt_value both = ca_pbrt_number_value(p, names[0], fallback);
    ca_pbrt_roughness roughness = {.u = both, .v = both};
    if (ca_pbrt_find(&p->params, names[1])) roughness.u = ca_pbrt_number_value(p, names[1], fallback);
    if (ca_pbrt_find(&p->params, names[2])) roughness.v = ca_pbrt_number_value(p, names[2], fallback);
    const bool zero = ca_pbrt_is(&roughness.u, 0.0) && ca_pbrt_is(&roughness.v, 0.0);
    if (ca_pbrt_boolean(&p->params, "remaproughness", true)) {
        const bool same = is_same(&roughness.u, &roughness.v);
        remap_value(p, &roughness.u, to_alpha);
        if (same)
            roughness.v = roughness.u;
        else
            remap_value(p, &roughness.v, to_alpha);
    }
    if (!is_same(&roughness.u, &roughness.v)) p->has_pictures = true;
    const bool constant = !roughness.u.id && !roughness.v.id;
    roughness.is_smooth =
        zero || (constant && to_alpha == remap && fmax(roughness.u.rgb[0], roughness.v.rgb[0]) < 1e-3);
    return roughness;
}

static ca_pbrt_roughness read_roughness(ca_pbrt *p)
{
    static const char *const names[3] = {"roughness", "uroughness", "vroughness"};
    return ca_pbrt_read_roughness(p, names, 0.0, remap);
}

void ca_pbrt_put_alpha(ca_pbrt *p, ca_xml_node *object, const ca_pbrt_roughness *roughness)
{
    ca_tree_string(&p->tree, object, "distribution", "ggx");
    if (is_same(&roughness->u, &roughness->v)) {
        ca_pbrt_put_number(p, object, "alpha", &roughness->u);
        return;
    }
    ca_pbrt_put_number(p, object, "alpha_u", &roughness->u);
    ca_pbrt_put_number(p, object, "alpha_v", &roughness->v);
}

void ca_pbrt_put_index(ca_pbrt *p, ca_xml_node *object, double index)
{
    ca_tree_float(&p->tree, object, "int_ior", index);
    ca_tree_float(&p->tree, object, "ext_ior", 1.0);
}

/* ---- The kinds ------------------------------------------------------------------------------------------------- */

static void read_diffuse(ca_pbrt *p, const char *id)
{
    const ca_pbrt_value reflectance = ca_pbrt_reflectance_value(p, "reflectance", 0.5);
    ca_pbrt_put_color(p, ca_pbrt_begin_bsdf(p, id, "diffuse", true, NULL), "reflectance", &reflectance);
}

static void read_dielectric(ca_pbrt *p, const char *id)
{
    const double index = ca_pbrt_index(p, "eta", 1.5);
    const ca_pbrt_roughness roughness = read_roughness(p);
    const bool is_boundary = ca_pbrt_is_boundary(index);
    const char *type = !is_boundary ? "null" : roughness.is_smooth ? "dielectric" : "roughdielectric";
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, type, false, NULL);
    if (!is_boundary) return;
    ca_pbrt_put_index(p, bsdf, index);
    if (!roughness.is_smooth) ca_pbrt_put_alpha(p, bsdf, &roughness);
}

static void read_thin_dielectric(ca_pbrt *p, const char *id)
{
    const double index = ca_pbrt_index(p, "eta", 1.5);
    ca_pbrt_put_index(p, ca_pbrt_begin_bsdf(p, id, "thindielectric", false, NULL), index);
}

/* A complex index of refraction: copper's where there is none. */
static void read_metal(ca_pbrt *p, const char *eta_name, const char *k_name, double eta[3], double k[3])
{
    ca_pbrt_copper(eta, k);
    ca_pbrt_color(p, eta_name, CA_COLOR_SIGNED, eta);
    ca_pbrt_color(p, k_name, CA_COLOR_SIGNED, k);
}

/* The index that reflects so much of light that falls straight on it. */
static void metal_of_reflectance(const double reflectance[3], double eta[3], double k[3])
{
    for (int i = 0; i < 3; i++) {
        const double r = fmin(fmax(reflectance[i], 0.0), 0.9999);
        eta[i] = 1.0;
        k[i] = 2.0 * sqrt(r) / sqrt(1.0 - r);
    }
}

typedef struct conductor_names {
    const char *eta, *k, *reflectance, *roughness[3];
} conductor_names;

/* `over` is the index of what lies above the metal. */
static void read_conductor_named(ca_pbrt *p, const char *id, const conductor_names *names, double over)
{
    double eta[3], k[3];
    const bool reflects = ca_pbrt_find(&p->params, names->reflectance) != NULL;
    const ca_pbrt_value reflectance = ca_pbrt_reflectance_value(p, names->reflectance, 1.0);
    const ca_pbrt_roughness roughness = ca_pbrt_read_roughness(p, names->roughness, 0.0, remap);
    read_metal(p, names->eta, names->k, eta, k);
    if (reflects && (ca_pbrt_find(&p->params, names->eta) || ca_pbrt_find(&p->params, names->k)))
        ca_pbrt_fail(&p->params, names->reflectance, "excludes eta and k");
    if (reflects) metal_of_reflectance(reflectance.rgb, eta, k);
    for (int i = 0; i < 3; i++) eta[i] /= over, k[i] /= over;
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, roughness.is_smooth ? "conductor" : "roughconductor", true, NULL);
    if (!roughness.is_smooth) ca_pbrt_put_alpha(p, bsdf, &roughness);
    if (reflectance.id) {
        ca_pbrt_put_color(p, bsdf, "specular_reflectance", &reflectance);
        ca_import_note(p->importer, &p->params.where,
                       "a conductor's texture of reflectance is that of all directions");
        return;
    }
    ca_tree_rgb(&p->tree, bsdf, "eta", eta);
    ca_tree_rgb(&p->tree, bsdf, "k", k);
}

static void read_conductor(ca_pbrt *p, const char *id)
{
    static const conductor_names names = {"eta", "k", "reflectance", {"roughness", "uroughness", "vroughness"}};
    read_conductor_named(p, id, &names, 1.0);
}

/* What fills the layer, and how its light is found. */
static void read_layer(ca_pbrt *p)
{
    static const char *const without_effect[] = {"thickness", "g", "maxdepth", "nsamples", "twosided"};
    const ca_pbrt_value albedo = ca_pbrt_color_value(p, "albedo", 0.0);
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    if (!ca_pbrt_is(&albedo, 0.0)) ca_pbrt_fail(&p->params, "albedo", "must be 0: media are not supported");
}

void ca_pbrt_put_coat_alpha(ca_pbrt *p, ca_xml_node *bsdf, const ca_pbrt_roughness *roughness)
{
    const bool same = is_same(&roughness->u, &roughness->v), varies = roughness->u.id || roughness->v.id;
    ca_pbrt_value alpha = roughness->u.id ? roughness->u : roughness->v;
    const double least = (double)CA_MATERIAL_MIN_ALPHA;
    if (!varies) alpha.rgb[0] = sqrt(fmax(roughness->u.rgb[0], least) * fmax(roughness->v.rgb[0], least));
    if (!same)
        ca_import_note(p->importer, &p->params.where, "the roughness of a coat is %s",
                       varies ? "that of one direction, which is a texture" : "the geometric mean of both");
    ca_tree_string(&p->tree, bsdf, "distribution", "ggx");
    ca_pbrt_put_number(p, bsdf, "alpha", &alpha);
}

static void read_coated_diffuse(ca_pbrt *p, const char *id)
{
    const ca_pbrt_value reflectance = ca_pbrt_reflectance_value(p, "reflectance", 0.5);
    const double index = ca_pbrt_index(p, "eta", 1.5);
    const ca_pbrt_roughness roughness = read_roughness(p);
    read_layer(p);
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, roughness.is_smooth ? "plastic" : "roughplastic", true, NULL);
    ca_pbrt_put_color(p, bsdf, "diffuse_reflectance", &reflectance);
    ca_pbrt_put_index(p, bsdf, index);
    ca_tree_boolean(&p->tree, bsdf, "nonlinear", true);
    if (roughness.is_smooth) return;
    ca_pbrt_put_coat_alpha(p, bsdf, &roughness);
}

/* Of the two layers the metal, seen from inside of the coat. */
static void read_coated_conductor(ca_pbrt *p, const char *id)
{
    static const conductor_names names = {"conductor.eta",
                                          "conductor.k",
                                          "reflectance",
                                          {"conductor.roughness", "conductor.uroughness", "conductor.vroughness"}};
    static const char *const coat[] = {"interface.roughness", "interface.uroughness", "interface.vroughness"};
    const double index = ca_pbrt_index(p, "interface.eta", 1.5);
    ca_pbrt_ignore(&p->params, coat, CA_COUNT(coat));
    read_layer(p);
    ca_import_note(p->importer, &p->params.where, "coatedconductor is the conductor; the coat reflects nothing");
    read_conductor_named(p, id, &names, index);
}

static void read_interface(ca_pbrt *p, const char *id) { ca_pbrt_begin_bsdf(p, id, "null", false, NULL); }

/* Version 4: two names and how much of the second; version 3: of the first. */
static void read_mix(ca_pbrt *p, const char *id)
{
    const ca_pbrt_parameter *both = ca_pbrt_find(&p->params, "materials");
    const char *names[2] = {both && both->count == 2 && both->texts ? both->texts[0] : NULL,
                            both && both->count == 2 && both->texts ? both->texts[1] : NULL};
    ca_pbrt_value amount = {.rgb = {0.5, 0.5, 0.5}};
    if (!both) {
        names[1] = ca_pbrt_string(&p->params, "namedmaterial1", NULL);
        names[0] = ca_pbrt_string(&p->params, "namedmaterial2", NULL);
        amount = ca_pbrt_color_value(p, "amount", 0.5);
        if (!amount.id && (amount.rgb[0] != amount.rgb[1] || amount.rgb[1] != amount.rgb[2]))
            ca_pbrt_fail(&p->params, "amount", "must be grey");
    } else {
        amount = ca_pbrt_number_value(p, "amount", 0.5);
    }
    amount = ca_pbrt_cut(p, &amount);
    if (!names[0] || !names[1]) {
        ca_pbrt_fail(&p->params, both ? "materials" : "namedmaterial1", "must name two materials with the other");
        return;
    }
    ca_xml_node *bsdf = ca_pbrt_begin_bsdf(p, id, "blendbsdf", false, NULL);
    ca_pbrt_put_number(p, bsdf, "weight", &amount);
    for (int i = 0; i < 2; i++) {
        const ca_pbrt_named *material = ca_pbrt_name(&p->materials, names[i]);
        if (material)
            ca_tree_ref(&p->tree, bsdf, NULL, material->id);
        else
            ca_pbrt_fail_name(p, &p->params.where, "material", names[i], &p->materials);
    }
}

static const ca_pbrt_material_kind kinds[] = {
    {"diffuse", read_diffuse},
    {"dielectric", read_dielectric},
    {"thindielectric", read_thin_dielectric},
    {"conductor", read_conductor},
    {"coateddiffuse", read_coated_diffuse},
    {"coatedconductor", read_coated_conductor},
    {"interface", read_interface},
    {"none", read_interface},
    {"", read_interface},
    {"mix", read_mix},
};

static const char *const unsupported[] = {"subsurface", "kdsubsurface", "hair", "measured", "fourier"};

static const ca_pbrt_material_kind *find_kind(ca_pbrt *p, const char *name)
{
    size_t count;
    const char *nearest = NULL;
    const ca_pbrt_material_kind *old = ca_pbrt_old_materials(&count);
    for (size_t i = 0; i < CA_COUNT(kinds) + count; i++) {
        const ca_pbrt_material_kind *kind = i < CA_COUNT(kinds) ? &kinds[i] : &old[i - CA_COUNT(kinds)];
        if (strcmp(kind->name, name) == 0) return kind;
        if (kind->name[0]) nearest = ca_nearer_name(name, nearest, kind->name);
    }
    for (size_t i = 0; i < CA_COUNT(unsupported); i++)
        if (strcmp(unsupported[i], name) == 0)
            ca_import_fail(p->importer, &p->params.where, "material \"%s\" is not supported", name);
    ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known material; the nearest is \"%s\"", name,
                   nearest);
    return NULL;
}

const char *ca_pbrt_read_material(ca_pbrt *p, const char *type, const char *name, bool *is_interface)
{
    const ca_pbrt_material_kind *kind = find_kind(p, type);
    if (!kind) return NULL;
    const char *id = ca_pbrt_new_id(p, "material", name);
    if (!id) return NULL;
    *is_interface = kind->read == read_interface;
    kind->read(p, id);
    return id;
}
