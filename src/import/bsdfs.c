/* BSDFs that scatter by themselves, and the table of all. Result of each: ca_material. Those that hold others are in
 * bsdf_nodes.c. */
#include "import/bsdf_plugins.h"

#include "base/text.h"
#include "material/conductor_data.h"

#include <string.h>

/* ---- Indices of refraction ------------------------------------------------------------------------------------- */

typedef struct named_index {
    const char *name;
    double value;
} named_index;

/* At about 589 nm and 0 to 20 degrees Celsius; the list of Mitsuba 3 (include/mitsuba/render/ior.h), which has most
 * of them from Hecht, "Optics". */
static const named_index named_indices[] = {
    {"vacuum", 1.0},      {"helium", 1.000036},        {"hydrogen", 1.000132},
    {"air", 1.000277},    {"carbon dioxide", 1.00045}, {"water", 1.3330},
    {"acetone", 1.36},    {"ethanol", 1.361},          {"carbon tetrachloride", 1.461},
    {"glycerol", 1.4729}, {"benzene", 1.501},          {"silicone oil", 1.52045},
    {"bromine", 1.661},   {"water ice", 1.31},         {"fused quartz", 1.458},
    {"pyrex", 1.470},     {"acrylic glass", 1.49},     {"polypropylene", 1.49},
    {"bk7", 1.5046},      {"sodium chloride", 1.544},  {"amber", 1.55},
    {"pet", 1.5750},      {"diamond", 2.419},
};

/* No number, which is refused as for any other parameter. */
static bool is_name(const ca_xml_node *node)
{
    double number;
    return strcmp(node->tag, "string") == 0 && !ca_parse_double(ca_xml_attribute_value(node, "value"), &number);
}

double ca_import_index_of_refraction(ca_props *props, const char *name, double fallback)
{
    const ca_xml_node *node = ca_props_find(props, name);
    if (!node || !is_name(node)) return ca_props_number_in(props, name, fallback, 0.001, 1000.0);
    const char *names[CA_COUNT(named_indices)];
    for (size_t i = 0; i < CA_COUNT(named_indices); i++) names[i] = named_indices[i].name;
    return named_indices[ca_props_choice(props, name, names, CA_COUNT(names), 0)].value;
}

static const double air = 1.000277, bk7 = 1.5046, polypropylene = 1.49;

/* Interior over exterior index. */
static float relative_index(ca_props *props, double interior)
{
    return (float)(ca_import_index_of_refraction(props, "int_ior", interior) /
                   ca_import_index_of_refraction(props, "ext_ior", air));
}

float ca_import_glass_index(ca_props *props) { return relative_index(props, bk7); }

/* ---- Microfacets ----------------------------------------------------------------------------------------------- */

/* Plugins of some 0.6 versions have the distribution in their name; 0.6 has powers of cosines, too. */
static void import_facets(ca_props *props, ca_material_facets *facets)
{
    static const char *const distributions[] = {"beckmann", "ggx", "phong", "as"};
    const size_t length = strlen(props->type), otherwise = length > 3 && strcmp(props->type + length - 3, "GGX") == 0;
    const size_t chosen = ca_props_choice(props, "distribution", distributions, CA_COUNT(distributions), otherwise);
    facets->distribution = chosen == 1 ? CA_MICROFACET_GGX : CA_MICROFACET_BECKMANN;
    if (chosen > 1)
        ca_import_note(props->importer, &props->node->where,
                       "distribution \"%s\" is read as \"beckmann\", which it resembles", distributions[chosen]);
    facets->sample_visible = ca_props_boolean(props, "sample_visible", true);
}

/* alpha, or alpha_u and alpha_v. */
static void import_alphas(ca_props *props, ca_material_facets *facets)
{
    const bool along_u = ca_props_find(props, "alpha_u"), along_v = ca_props_find(props, "alpha_v");
    if (!along_u && !along_v) {
        facets->alpha_u = facets->alpha_v = ca_props_texture(props, "alpha", 0.1f, CA_COLOR_INDEX);
        return;
    }
    if (!along_u || !along_v) ca_props_fail(props, along_u ? "alpha_u" : "alpha_v", "needs its other half");
    if (ca_props_find(props, "alpha")) ca_props_fail(props, "alpha", "excludes alpha_u and alpha_v");
    facets->alpha_u = ca_props_texture(props, "alpha_u", 0.1f, CA_COLOR_INDEX);
    facets->alpha_v = ca_props_texture(props, "alpha_v", 0.1f, CA_COLOR_INDEX);
}

static void import_roughness(ca_props *props, ca_material_facets *facets)
{
    import_facets(props, facets);
    import_alphas(props, facets);
}

/* ---- The plugins ----------------------------------------------------------------------------------------------- */

static void import_diffuse(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_DIFFUSE);
    /* 0.6 knew it as diffuseReflectance too. */
    const bool old = ca_props_find(props, "diffuse_reflectance") != NULL;
    if (old && ca_props_find(props, "reflectance"))
        ca_props_fail(props, "diffuse_reflectance", "repeats reflectance");
    m->as.diffuse.reflectance =
        ca_props_texture(props, old ? "diffuse_reflectance" : "reflectance", 0.5f, CA_COLOR_REFLECTANCE);
}

static ca_texture_id specular_reflectance(ca_props *props)
{
    return ca_props_texture(props, "specular_reflectance", 1.0f, CA_COLOR_REFLECTANCE);
}

static ca_texture_id specular_transmittance(ca_props *props)
{
    return ca_props_texture(props, "specular_transmittance", 1.0f, CA_COLOR_REFLECTANCE);
}

static void import_dielectric(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_DIELECTRIC);
    m->as.dielectric.eta = ca_import_glass_index(props);
    m->as.dielectric.reflectance = specular_reflectance(props);
    m->as.dielectric.transmittance = specular_transmittance(props);
}

static void import_thin_dielectric(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_THIN_DIELECTRIC);
    m->as.thin_dielectric.eta = ca_import_glass_index(props);
    m->as.thin_dielectric.reflectance = specular_reflectance(props);
    m->as.thin_dielectric.transmittance = specular_transmittance(props);
}

static void import_rough_dielectric(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_ROUGH_DIELECTRIC);
    m->as.rough_dielectric.eta = ca_import_glass_index(props);
    m->as.rough_dielectric.reflectance = specular_reflectance(props);
    m->as.rough_dielectric.transmittance = specular_transmittance(props);
    if (m->as.rough_dielectric.eta == 1.0f) ca_props_fail(props, "int_ior", "must differ from ext_ior");
    import_roughness(props, &m->as.rough_dielectric.facets);
}

static ca_texture_id constant(ca_props *props, ca_rgb value)
{
    const ca_texture_id id = ca_scene_desc_add_constant(props->importer->desc, value);
    if (id == CA_NONE) ca_import_fail_memory(props->importer, "textures");
    return id;
}

static const ca_conductor *named_conductor(ca_props *props)
{
    const char *name = ca_props_string(props, "material", "none");
    const ca_conductor *found = ca_conductor_find(name);
    if (found) return found;
    size_t count;
    const ca_conductor *table = ca_conductor_table(&count);
    const char *nearest = NULL;
    for (size_t i = 0; i < count; i++)
        nearest = ca_nearer_name(name, nearest, table[i].name);
    const ca_xml_node *node = ca_props_find(props, "material");
    ca_import_fail(props->importer, &node->where, "\"%s\" is not a known conductor; the nearest is \"%s\"", name,
                   nearest);
    return &table[0];
}

/* material, or eta and k; 0.6's ext_eta divides both. */
static void import_complex_index(ca_props *props, ca_texture_id *eta, ca_texture_id *k)
{
    const ca_conductor *named = named_conductor(props);
    const bool numbers = ca_props_find(props, "eta") || ca_props_find(props, "k");
    if (numbers && ca_props_find(props, "material")) ca_props_fail(props, "material", "excludes eta and k");
    if (numbers && !ca_props_find(props, "ext_eta")) {
        *eta = ca_props_texture(props, "eta", 0.0f, CA_COLOR_SIGNED);
        *k = ca_props_texture(props, "k", 1.0f, CA_COLOR_SIGNED);
        return;
    }
    const float inverse = (float)(1.0 / ca_import_index_of_refraction(props, "ext_eta", 1.0));
    *eta = constant(props, ca_rgb_scale(ca_props_color(props, "eta", named->eta, CA_COLOR_SIGNED), inverse));
    *k = constant(props, ca_rgb_scale(ca_props_color(props, "k", named->k, CA_COLOR_SIGNED), inverse));
}

static void import_conductor(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_CONDUCTOR);
    import_complex_index(props, &m->as.conductor.eta, &m->as.conductor.k);
    m->as.conductor.reflectance = specular_reflectance(props);
}

static void import_rough_conductor(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_ROUGH_CONDUCTOR);
    import_complex_index(props, &m->as.rough_conductor.eta, &m->as.rough_conductor.k);
    m->as.rough_conductor.reflectance = specular_reflectance(props);
    import_roughness(props, &m->as.rough_conductor.facets);
}

static ca_material_plastic import_layers(ca_props *props)
{
    ca_material_plastic plastic = {.eta = relative_index(props, polypropylene)};
    plastic.diffuse = ca_props_texture(props, "diffuse_reflectance", 0.5f, CA_COLOR_REFLECTANCE);
    plastic.specular = specular_reflectance(props);
    plastic.nonlinear = ca_props_boolean(props, "nonlinear", false);
    return plastic;
}

static void import_plastic(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_PLASTIC);
    m->as.plastic = import_layers(props);
}

void ca_import_one_roughness(ca_props *props, ca_material_facets *facets)
{
    import_facets(props, facets);
    const ca_xml_node *alpha = ca_props_find(props, "alpha");
    const bool varies = alpha && (strcmp(alpha->tag, "texture") == 0 || strcmp(alpha->tag, "ref") == 0);
    facets->alpha_v = facets->alpha_u =
        varies ? ca_props_texture(props, "alpha", 0.1f, CA_COLOR_INDEX)
               : constant(props, ca_rgb_grey((float)ca_props_number_in(props, "alpha", 0.1, 0.0, 1e30)));
}

static void import_rough_plastic(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_ROUGH_PLASTIC);
    m->as.rough_plastic.layers = import_layers(props);
    ca_import_one_roughness(props, &m->as.rough_plastic.facets);
}

/* eta, or `specular`, which stands for one: a reflectance of 0.08 specular at normal incidence. */
static float principled_index(ca_props *props, bool transmits)
{
    const bool has_eta = ca_props_find(props, "eta") != NULL;
    if (has_eta && ca_props_find(props, "specular")) ca_props_fail(props, "specular", "excludes eta");
    double eta;
    if (has_eta) {
        eta = ca_import_index_of_refraction(props, "eta", 1.5);
    } else {
        const double specular = ca_props_number_in(props, "specular", 0.5, 0.0, 1.0);
        eta = 2.0 / (1.0 - sqrt(0.08 * specular)) - 1.0;
    }
    if (transmits && eta == 1.0) ca_props_fail(props, has_eta ? "eta" : "specular", "needs a boundary to transmit");
    return (float)eta;
}

static void import_principled(ca_props *props, void *result)
{
    ca_material *m = result;
    const ca_color_role role = CA_COLOR_REFLECTANCE; /* all of them are shares in [0, 1] */
    *m = ca_material_of_kind(CA_MATERIAL_PRINCIPLED);
    m->as.principled.base_color = ca_props_texture(props, "base_color", 0.5f, role);
    m->as.principled.roughness = ca_props_texture(props, "roughness", 0.5f, role);
    m->as.principled.anisotropic = ca_props_texture(props, "anisotropic", 0.0f, role);
    m->as.principled.metallic = ca_props_texture(props, "metallic", 0.0f, role);
    m->as.principled.spec_trans = ca_props_texture(props, "spec_trans", 0.0f, role);
    m->as.principled.spec_tint = ca_props_texture(props, "spec_tint", 0.0f, role);
    m->as.principled.sheen = ca_props_texture(props, "sheen", 0.0f, role);
    m->as.principled.sheen_tint = ca_props_texture(props, "sheen_tint", 0.0f, role);
    m->as.principled.flatness = ca_props_texture(props, "flatness", 0.0f, role);
    m->as.principled.clearcoat = ca_props_texture(props, "clearcoat", 0.0f, role);
    m->as.principled.clearcoat_gloss = ca_props_texture(props, "clearcoat_gloss", 0.0f, role);
    m->as.principled.diffuse_rate =
        (float)ca_props_number_in(props, "diffuse_reflectance_sampling_rate", 1.0, 0.0, 1e6);
    m->as.principled.specular_rate =
        (float)ca_props_number_in(props, "main_specular_sampling_rate", 1.0, 0.0, 1e6);
    m->as.principled.clearcoat_rate = (float)ca_props_number_in(props, "clearcoat_sampling_rate", 1.0, 0.0, 1e6);
    m->as.principled.eta = principled_index(props, ca_props_find(props, "spec_trans") != NULL);
}

static void import_rough_diffuse(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_ROUGH_DIFFUSE);
    const bool old = ca_props_find(props, "diffuse_reflectance") != NULL;
    m->as.rough_diffuse.reflectance =
        ca_props_texture(props, old ? "diffuse_reflectance" : "reflectance", 0.5f, CA_COLOR_REFLECTANCE);
    m->as.rough_diffuse.alpha = ca_props_texture(props, "alpha", 0.2f, CA_COLOR_INDEX);
    if (!ca_props_boolean(props, "use_fast_approx", false))
        ca_import_note(props->importer, &props->node->where,
                       "roughdiffuse is the model's simplified form, without light between facets");
}

static void import_phong(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_PHONG);
    m->as.phong.diffuse = ca_props_texture(props, "diffuse_reflectance", 0.5f, CA_COLOR_REFLECTANCE);
    m->as.phong.specular = ca_props_texture(props, "specular_reflectance", 0.2f, CA_COLOR_REFLECTANCE);
    m->as.phong.exponent = ca_props_texture(props, "exponent", 30.0f, CA_COLOR_INDEX);
}

static void import_diffuse_transmitter(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_DIFFUSE_TRANSMITTER);
    m->as.diffuse_transmitter.transmittance = ca_props_texture(props, "transmittance", 0.5f, CA_COLOR_REFLECTANCE);
}

/* 0.6 */
static void import_ward(ca_props *props, void *result)
{
    static const char *const variants[] = {"balanced", "ward-duer", "ward"};
    static const ca_ward_variant values[] = {CA_WARD_BALANCED, CA_WARD_DUER, CA_WARD_1992};
    ca_material *m = result;
    ca_material_facets roughness;
    *m = ca_material_of_kind(CA_MATERIAL_WARD);
    m->as.ward.diffuse = ca_props_texture(props, "diffuse_reflectance", 0.5f, CA_COLOR_REFLECTANCE);
    m->as.ward.specular = ca_props_texture(props, "specular_reflectance", 0.2f, CA_COLOR_REFLECTANCE);
    m->as.ward.variant = values[ca_props_choice(props, "variant", variants, CA_COUNT(variants), 0)];
    import_alphas(props, &roughness);
    m->as.ward.alpha_u = roughness.alpha_u;
    m->as.ward.alpha_v = roughness.alpha_v;
}

static void import_principled_thin(ca_props *props, void *result)
{
    static const char *const rates[] = {"diffuse_reflectance_sampling_rate", "diffuse_transmittance_sampling_rate",
                                        "specular_reflectance_sampling_rate", "specular_transmittance_sampling_rate"};
    ca_material *m = result;
    const ca_color_role role = CA_COLOR_REFLECTANCE;
    *m = ca_material_of_kind(CA_MATERIAL_PRINCIPLED_THIN);
    m->as.principled_thin.base_color = ca_props_texture(props, "base_color", 0.5f, role);
    m->as.principled_thin.roughness = ca_props_texture(props, "roughness", 0.5f, role);
    m->as.principled_thin.anisotropic = ca_props_texture(props, "anisotropic", 0.0f, role);
    m->as.principled_thin.spec_trans = ca_props_texture(props, "spec_trans", 0.0f, role);
    m->as.principled_thin.spec_tint = ca_props_texture(props, "spec_tint", 0.0f, role);
    m->as.principled_thin.sheen = ca_props_texture(props, "sheen", 0.0f, role);
    m->as.principled_thin.sheen_tint = ca_props_texture(props, "sheen_tint", 0.0f, role);
    m->as.principled_thin.flatness = ca_props_texture(props, "flatness", 0.0f, role);
    m->as.principled_thin.diff_trans = ca_props_texture(props, "diff_trans", 0.0f, CA_COLOR_INDEX);
    for (size_t i = 0; i < CA_COUNT(rates); i++) ca_props_number_in(props, rates[i], 1.0, 0.0, 1e6);
    m->as.principled_thin.eta = principled_index(props, false);
}

static void import_null(ca_props *props, void *result)
{
    ca_material *m = result;
    (void)props;
    *m = ca_material_of_kind(CA_MATERIAL_NULL);
}

static const ca_plugin plugins[] = {
    {"diffuse", import_diffuse},
    {"dielectric", import_dielectric},
    {"thindielectric", import_thin_dielectric},
    {"roughdielectric", import_rough_dielectric},
    {"roughdielectricGGX", import_rough_dielectric},
    {"conductor", import_conductor},
    {"roughconductor", import_rough_conductor},
    {"roughconductorGGX", import_rough_conductor},
    {"plastic", import_plastic},
    {"roughplastic", import_rough_plastic},
    {"principled", import_principled},
    {"roughdiffuse", import_rough_diffuse},
    {"phong", import_phong},
    {"difftrans", import_diffuse_transmitter},
    {"ward", import_ward},
    {"principledthin", import_principled_thin},
    {"null", import_null},
    {"twosided", ca_import_twosided},
    {"mask", ca_import_mask},
    {"blendbsdf", ca_import_blend},
    {"mixturebsdf", ca_import_mixture},
    {"bumpmap", ca_import_bump},
    {"normalmap", ca_import_normal_map},
    {"coating", ca_import_coating},
    {"roughcoating", ca_import_rough_coating},
};

const ca_plugin *ca_import_bsdf_plugins(size_t *count)
{
    *count = CA_COUNT(plugins);
    return plugins;
}
