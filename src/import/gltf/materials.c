/* Materials: metallic-roughness and its extensions as principled, specular-glossiness as two of these, thin-walled
 * transmission beside it, coverage as a mask, emission as an area light. docs/gltf.md says what of them is kept. */
#include "import/gltf/reader.h"

#include <math.h>
#include <string.h>

/* What one material is made of. */
typedef struct maker {
    ca_gltf *g;
    const ca_gltf_value *material, *pbr; /* either may be NULL; likewise: */
    const ca_gltf_value *glossy;         /* specular-glossiness, which goes before metallic-roughness */
    const char *id;                      /* of the outermost BSDF */
    bool colored;                        /* colours at the corners of the mesh */
    double base[4];
    uint32_t uv_set;
} maker;

static ca_xml_node *add_bsdf(maker *m, ca_xml_node *parent, const char *type)
{
    const bool outermost = parent == ca_tree_root(&m->g->tree);
    return ca_tree_named_object(&m->g->tree, parent, "bsdf", type, NULL, outermost ? m->id : NULL);
}

/* ---- Parameters ------------------------------------------------------------------------------------------------ */

static const ca_gltf_value *specular_glossiness(ca_gltf *g, const ca_gltf_value *material)
{
    return ca_gltf_extension(g, material, "KHR_materials_pbrSpecularGlossiness");
}

/* Factors in [0, 1], all of them 1 where there are none. */
static void read_factors(ca_gltf *g, const ca_gltf_value *object, const char *key, double *factors, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) factors[i] = 1.0;
    if (!ca_gltf_numbers(g, object, key, factors, count)) return;
    for (uint32_t i = 0; i < count; i++)
        if (!(factors[i] >= 0.0 && factors[i] <= 1.0))
            ca_gltf_fail(g, ca_gltf_member(g, object, key), "must lie in [0, 1]");
}

void ca_gltf_base_color(ca_gltf *g, const ca_gltf_value *material, double rgba[4])
{
    const ca_gltf_value *glossy = specular_glossiness(g, material);
    if (glossy)
        read_factors(g, glossy, "diffuseFactor", rgba, 4);
    else
        read_factors(g, ca_gltf_object(g, material, "pbrMetallicRoughness"), "baseColorFactor", rgba, 4);
}

static const ca_gltf_value *base_texture(maker *m)
{
    return m->glossy ? ca_gltf_object(m->g, m->glossy, "diffuseTexture")
                     : ca_gltf_object(m->g, m->pbr, "baseColorTexture");
}

/* A colour: three factors, times a texture in sRGB. */
static void put_color(maker *m, ca_xml_node *object, const char *name, const double rgb[3], const ca_gltf_value *info)
{
    const ca_gltf_bake bake = {.pixels = CA_GLTF_COLOR, .factors = {rgb[0], rgb[1], rgb[2]}};
    if (info)
        ca_gltf_texture(m->g, info, &bake, object, name, NULL, &m->uv_set);
    else
        ca_tree_rgb(&m->g->tree, object, name, rgb);
}

/* A number: by a texture, or a constant where there is none. */
static void put_baked(maker *m, ca_xml_node *object, const char *name, const ca_gltf_value *info,
                      const ca_gltf_bake *bake, double constant)
{
    if (info)
        ca_gltf_texture(m->g, info, bake, object, name, NULL, &m->uv_set);
    else
        ca_tree_float(&m->g->tree, object, name, constant);
}

/* A factor, times a channel of a linear texture. */
static void put_number(maker *m, ca_xml_node *object, const char *name, double factor, const ca_gltf_value *info,
                       uint32_t channel)
{
    const ca_gltf_bake bake = {.pixels = CA_GLTF_CHANNEL, .channel = channel, .factors = {factor, 0.0, 0.0}};
    put_baked(m, object, name, factor != 0.0 ? info : NULL, &bake, factor);
}

/* The colours at corners, which have the factor in them; times the texture, where there is one. */
static void put_corner_colors(maker *m, ca_xml_node *object, const char *name, const char *id)
{
    static const ca_gltf_bake as_it_is = {.pixels = CA_GLTF_COLOR, .factors = {1.0, 1.0, 1.0}};
    ca_tree *tree = &m->g->tree;
    const ca_gltf_value *info = base_texture(m);
    if (info) {
        object = ca_tree_named_object(tree, object, "texture", "scale", name, id);
        ca_gltf_texture(m->g, info, &as_it_is, object, NULL, NULL, &m->uv_set);
        name = "scale";
        id = NULL;
    }
    ca_xml_node *node = ca_tree_named_object(tree, object, "texture", "mesh_attribute", name, id);
    ca_tree_string(tree, node, "name", "vertex_color");
}

static void put_base_color(maker *m, ca_xml_node *object, const char *name)
{
    if (m->colored)
        put_corner_colors(m, object, name, NULL);
    else
        put_color(m, object, name, m->base, base_texture(m));
}

/* ---- Extensions ------------------------------------------------------------------------------------------------ */

static double largest(const double rgb[3]) { return fmax(rgb[0], fmax(rgb[1], rgb[2])); }

static bool is_grey(const double rgb[3]) { return rgb[0] == rgb[1] && rgb[1] == rgb[2]; }

static double index_of_refraction(maker *m)
{
    const ca_gltf_value *ior = ca_gltf_extension(m->g, m->material, "KHR_materials_ior");
    const double n = ca_gltf_number(m->g, ior, "ior", 1.5, 0.0, 1000.0);
    if (n > 0.0 && n < 1.0) ca_gltf_fail(m->g, ior, "ior is %g, and must be 0 or at least 1", n);
    return n == 0.0 ? 1000.0 : n; /* 0 stands for an infinite one: all is reflected */
}

/* The index of refraction of what reflects so much straight on. */
static double index_of(double straight_on)
{
    const double root = sqrt(straight_on);
    return (1.0 + root) / (1.0 - root);
}

/* The index whose reflectance straight on is that of KHR_materials_specular; refraction keeps its own. */
static double reflecting_index(maker *m, bool transmits)
{
    const ca_gltf_value *specular = ca_gltf_extension(m->g, m->material, "KHR_materials_specular");
    const double n = index_of_refraction(m);
    double color[3] = {1.0, 1.0, 1.0};
    if (!specular) return n;
    const double factor = ca_gltf_number(m->g, specular, "specularFactor", 1.0, 0.0, 1.0);
    ca_gltf_numbers(m->g, specular, "specularColorFactor", color, 3);
    if (ca_gltf_member(m->g, specular, "specularTexture") || ca_gltf_member(m->g, specular, "specularColorTexture"))
        ca_gltf_note(m->g, specular, "textures of KHR_materials_specular are not read, only its factors");
    if (!is_grey(color))
        ca_gltf_note(m->g, specular, "specularColorFactor is read as grey, by its largest component");
    if (transmits && (factor != 1.0 || largest(color) != 1.0))
        ca_gltf_note(m->g, specular, "KHR_materials_specular has no effect on solid glass");
    if (transmits) return n;
    const double root = (n - 1.0) / (n + 1.0);
    return index_of(fmin(root * root * factor * fmax(largest(color), 0.0), 0.99));
}

static void put_clearcoat(maker *m, ca_xml_node *bsdf)
{
    const ca_gltf_value *coat = ca_gltf_extension(m->g, m->material, "KHR_materials_clearcoat");
    const double factor = ca_gltf_number(m->g, coat, "clearcoatFactor", 0.0, 0.0, 1.0);
    if (factor == 0.0) return;
    put_number(m, bsdf, "clearcoat", factor, ca_gltf_object(m->g, coat, "clearcoatTexture"), 0);
    const double roughness = ca_gltf_number(m->g, coat, "clearcoatRoughnessFactor", 0.0, 0.0, 1.0);
    const ca_gltf_value *info = ca_gltf_object(m->g, coat, "clearcoatRoughnessTexture");
    const ca_gltf_bake bake = {.pixels = CA_GLTF_GLOSS, .channel = 1, .factors = {roughness, 0.0, 0.0}};
    put_baked(m, bsdf, "clearcoat_gloss", info, &bake, ca_gltf_gloss(roughness));
    if (ca_gltf_member(m->g, coat, "clearcoatNormalTexture"))
        ca_gltf_note(m->g, coat, "a clearcoat has the normals of what is below: clearcoatNormalTexture is not read");
}

static void put_sheen(maker *m, ca_xml_node *bsdf)
{
    const ca_gltf_value *sheen = ca_gltf_extension(m->g, m->material, "KHR_materials_sheen");
    double color[3] = {0.0, 0.0, 0.0};
    ca_gltf_numbers(m->g, sheen, "sheenColorFactor", color, 3);
    if (!(largest(color) > 0.0)) return;
    const ca_gltf_value *info = ca_gltf_object(m->g, sheen, "sheenColorTexture");
    const ca_gltf_bake bake = {.pixels = CA_GLTF_LARGEST, .factors = {color[0], color[1], color[2]}};
    put_baked(m, bsdf, "sheen", info, &bake, fmin(largest(color), 1.0));
    if (!is_grey(color)) ca_tree_float(&m->g->tree, bsdf, "sheen_tint", 1.0);
    ca_gltf_note(m->g, sheen, "KHR_materials_sheen is read as the sheen of principled, whose roughness is fixed and "
                              "whose hue is white or the base colour's");
}

/* ---- Transmission ---------------------------------------------------------------------------------------------- */

typedef struct transmission {
    double factor;
    const ca_gltf_value *info; /* texture, in its red channel */
    bool solid;                /* light is bent; else the walls are thin */
} transmission;

static transmission find_transmission(maker *m)
{
    const ca_gltf_value *object = ca_gltf_extension(m->g, m->material, "KHR_materials_transmission");
    const ca_gltf_value *volume = ca_gltf_extension(m->g, m->material, "KHR_materials_volume");
    transmission t = {.factor = ca_gltf_number(m->g, object, "transmissionFactor", 0.0, 0.0, 1.0),
                      .info = ca_gltf_object(m->g, object, "transmissionTexture"),
                      .solid = ca_gltf_number(m->g, volume, "thicknessFactor", 0.0, 0.0, 1e30) > 0.0};
    double color[3] = {1.0, 1.0, 1.0};
    ca_gltf_numbers(m->g, volume, "attenuationColor", color, 3);
    const bool white = color[0] == 1.0 && color[1] == 1.0 && color[2] == 1.0;
    if (t.factor > 0.0 && t.solid && ca_gltf_member(m->g, volume, "attenuationDistance") && !white)
        ca_gltf_fail(m->g, volume, "volumes that absorb light are not supported");
    return t;
}

/* ---- The BSDF -------------------------------------------------------------------------------------------------- */

static void put_principled(maker *m, ca_xml_node *parent, const transmission *t)
{
    ca_gltf *g = m->g;
    ca_xml_node *bsdf = add_bsdf(m, parent, "principled");
    const ca_gltf_value *info = ca_gltf_object(g, m->pbr, "metallicRoughnessTexture");
    put_base_color(m, bsdf, "base_color");
    put_number(m, bsdf, "roughness", ca_gltf_number(g, m->pbr, "roughnessFactor", 1.0, 0.0, 1.0), info, 1);
    put_number(m, bsdf, "metallic", ca_gltf_number(g, m->pbr, "metallicFactor", 1.0, 0.0, 1.0), info, 2);
    double eta = reflecting_index(m, t->solid && t->factor > 0.0);
    if (t->solid && t->factor > 0.0) {
        put_number(m, bsdf, "spec_trans", t->factor, t->info, 0);
        if (eta == 1.0) eta = 1.001;
    }
    ca_tree_float(&g->tree, bsdf, "eta", eta);
    put_clearcoat(m, bsdf);
    put_sheen(m, bsdf);
}

/* ---- Specular-glossiness --------------------------------------------------------------------------------------- */

/* A part of the surface: the dielectric with the diffuse colour below it, or the metal. */
static ca_xml_node *put_glossy_part(maker *m, ca_xml_node *parent, bool metal, double eta)
{
    const double glossiness = ca_gltf_number(m->g, m->glossy, "glossinessFactor", 1.0, 0.0, 1.0);
    const ca_gltf_value *info = ca_gltf_object(m->g, m->glossy, "specularGlossinessTexture");
    const ca_gltf_bake bake = {.pixels = CA_GLTF_REST, .channel = 3, .factors = {glossiness, 0.0, 0.0}};
    ca_xml_node *bsdf = add_bsdf(m, parent, "principled");
    put_baked(m, bsdf, "roughness", info, &bake, 1.0 - glossiness);
    ca_tree_float(&m->g->tree, bsdf, "metallic", metal ? 1.0 : 0.0);
    ca_tree_float(&m->g->tree, bsdf, "eta", eta);
    return bsdf;
}

/* What is reflected straight on comes of a dielectric as far as that reaches, the rest of a metal of the same hue,
 * which takes its share of the surface: what is left for the diffuse colour is what the extension leaves it. */
static void put_specular_glossiness(maker *m, ca_xml_node *parent)
{
    ca_gltf *g = m->g;
    double specular[3], hue[3];
    read_factors(g, m->glossy, "specularFactor", specular, 3);
    const ca_gltf_value *info = ca_gltf_object(g, m->glossy, "specularGlossinessTexture");
    const double straight_on = largest(specular), share = ca_gltf_metal_share(straight_on);
    const double eta = index_of(info ? CA_GLTF_DIELECTRIC : fmin(straight_on, CA_GLTF_DIELECTRIC));
    for (int c = 0; c < 3; c++) hue[c] = straight_on > 0.0 ? specular[c] / straight_on : 0.0;
    const ca_gltf_bake color = {.pixels = CA_GLTF_HUE, .factors = {specular[0], specular[1], specular[2]}},
                       weight = {.pixels = CA_GLTF_METAL, .factors = {specular[0], specular[1], specular[2]}};
    if (share == 0.0) {
        put_base_color(m, put_glossy_part(m, parent, false, eta), "base_color");
        return;
    }
    ca_xml_node *blend = add_bsdf(m, parent, "blendbsdf");
    put_baked(m, blend, "weight", info, &weight, share);
    put_base_color(m, put_glossy_part(m, blend, false, eta), "base_color");
    ca_xml_node *metal = put_glossy_part(m, blend, true, eta);
    if (info)
        ca_gltf_texture(g, info, &color, metal, "base_color", NULL, &m->uv_set);
    else
        ca_tree_rgb(&g->tree, metal, "base_color", hue);
}

/* ---- Around it ------------------------------------------------------------------------------------------------- */

static void put_material(maker *m, ca_xml_node *parent, const transmission *t)
{
    if (m->glossy)
        put_specular_glossiness(m, parent);
    else
        put_principled(m, parent, t);
}

/* Inside of a normal map, where there is one. */
static void put_shaded(maker *m, ca_xml_node *parent, const transmission *t)
{
    const ca_gltf_value *info = ca_gltf_object(m->g, m->material, "normalTexture");
    if (!info) {
        put_material(m, parent, t);
        return;
    }
    const double scale = ca_gltf_number(m->g, info, "scale", 1.0, -1e3, 1e3);
    const ca_gltf_bake bake = {.pixels = CA_GLTF_NORMAL, .factors = {scale, 0.0, 0.0}};
    ca_xml_node *map = add_bsdf(m, parent, "normalmap");
    ca_gltf_texture(m->g, info, &bake, map, "normalmap", NULL, &m->uv_set);
    ca_tree_boolean(&m->g->tree, map, "against_v", true);
    put_material(m, map, t);
}

/* Both sides look the same, but for glass that bends light. */
static void put_surface(maker *m, ca_xml_node *parent, const transmission *t)
{
    put_shaded(m, t->solid && t->factor > 0.0 ? parent : add_bsdf(m, parent, "twosided"), t);
}

/* A thin wall lets the share of light through that is not reflected, tinted by the base colour; a metal none. */
static void put_thin_wall(maker *m, ca_xml_node *parent, const transmission *t)
{
    ca_gltf *g = m->g;
    const double metallic = ca_gltf_number(g, m->pbr, "metallicFactor", 1.0, 0.0, 1.0);
    const ca_gltf_value *info = ca_gltf_object(g, m->pbr, "metallicRoughnessTexture");
    if (info && metallic > 0.0)
        ca_gltf_note(g, m->material, "of a metal by texture as much light is let through as of its metallicFactor 0");
    const double share = t->factor * (info ? 1.0 : 1.0 - metallic);
    if (ca_gltf_number(g, m->pbr, "roughnessFactor", 1.0, 0.0, 1.0) > 0.0)
        ca_gltf_note(g, m->material, "a thin wall of a rough surface is seen through clearly: transmission without "
                                     "KHR_materials_volume is not blurred");
    ca_xml_node *blend = add_bsdf(m, parent, "blendbsdf");
    put_number(m, blend, "weight", share, t->info, 0);
    put_surface(m, blend, &(transmission){0});
    ca_xml_node *thin = add_bsdf(m, blend, "thindielectric");
    ca_tree_float(&g->tree, thin, "int_ior", index_of_refraction(m));
    ca_tree_float(&g->tree, thin, "ext_ior", 1.0);
    put_base_color(m, thin, "specular_transmittance");
}

/* Alpha as coverage. What of it is 1 everywhere needs no mask; the parent of the rest. */
static ca_xml_node *put_mask(maker *m, ca_xml_node *parent)
{
    ca_gltf *g = m->g;
    const char *mode = ca_gltf_text(g, m->material, "alphaMode", "OPAQUE");
    const bool cuts = strcmp(mode, "MASK") == 0;
    if (!cuts && strcmp(mode, "BLEND") != 0) {
        if (strcmp(mode, "OPAQUE") != 0) ca_gltf_fail(g, m->material, "alphaMode \"%.20s\" is not known", mode);
        return parent;
    }
    const double cutoff = ca_gltf_number(g, m->material, "alphaCutoff", 0.5, 0.0, 1e30);
    const ca_gltf_value *info = base_texture(m);
    const double alpha = m->base[3], constant = cuts ? (alpha >= cutoff ? 1.0 : 0.0) : alpha;
    if (!info && constant == 1.0) return parent;
    ca_xml_node *mask = add_bsdf(m, parent, "mask");
    const ca_gltf_bake bake = {.pixels = cuts ? CA_GLTF_CUT : CA_GLTF_CHANNEL, .channel = 3,
                               .factors = {alpha, cutoff, 0.0}};
    if (info)
        ca_gltf_texture(g, info, &bake, mask, "opacity", NULL, &m->uv_set);
    else
        ca_tree_float(&g->tree, mask, "opacity", constant);
    return mask;
}

/* ---- Emission -------------------------------------------------------------------------------------------------- */

static void note_one_side(maker *m)
{
    if (ca_gltf_boolean(m->g, m->material, "doubleSided", false))
        ca_gltf_note(m->g, m->material, "materials that are double-sided shine on their front only");
}

static void note_alpha(maker *m)
{
    if (strcmp(ca_gltf_text(m->g, m->material, "alphaMode", "OPAQUE"), "OPAQUE") != 0)
        ca_gltf_note(m->g, m->material, "materials with alpha shine where they are transparent, too");
}

static void set_emission(maker *m, ca_gltf_material *made, const double rgb[3], const ca_gltf_value *info)
{
    made->shines = largest(rgb) > 0.0;
    if (made->shines) note_one_side(m), note_alpha(m);
    memcpy(made->emission, rgb, sizeof made->emission);
    if (!made->shines || !info) return;
    made->radiance = ca_gltf_format(m->g, "radiance of %s", made->id);
    const ca_gltf_bake bake = {.pixels = CA_GLTF_COLOR, .factors = {rgb[0], rgb[1], rgb[2]}};
    ca_gltf_texture(m->g, info, &bake, ca_tree_root(&m->g->tree), NULL, made->radiance, &m->uv_set);
}

static void read_emission(maker *m, ca_gltf_material *made)
{
    const ca_gltf_value *strength = ca_gltf_extension(m->g, m->material, "KHR_materials_emissive_strength");
    const double scale = ca_gltf_number(m->g, strength, "emissiveStrength", 1.0, 0.0, 1e30);
    double rgb[3] = {0.0, 0.0, 0.0};
    ca_gltf_numbers(m->g, m->material, "emissiveFactor", rgb, 3);
    for (int i = 0; i < 3; i++) {
        if (!(rgb[i] >= 0.0 && rgb[i] <= 1e30)) ca_gltf_fail(m->g, m->material, "emissiveFactor is below 0");
        rgb[i] *= scale;
    }
    set_emission(m, made, rgb, ca_gltf_object(m->g, m->material, "emissiveTexture"));
}

/* Unlit: the base colour is what is seen, whatever the light, so it shines and reflects nothing. */
static void make_unlit(maker *m, ca_gltf_material *made, ca_xml_node *parent)
{
    ca_xml_node *black = add_bsdf(m, put_mask(m, parent), "diffuse");
    ca_tree_float(&m->g->tree, black, "reflectance", 0.0);
    if (m->colored) {
        made->shines = true;
        note_one_side(m);
        made->radiance = ca_gltf_format(m->g, "radiance of %s", made->id);
        put_corner_colors(m, ca_tree_root(&m->g->tree), NULL, made->radiance);
        return;
    }
    set_emission(m, made, m->base, base_texture(m));
}

/* ---- Any material ---------------------------------------------------------------------------------------------- */

static bool is_among(const char *name, const char *const names[], size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(names[i], name) == 0) return true;
    return false;
}

/* Notes each extension once; of very many not each. */
static void note_unread(maker *m)
{
    static const char *const read[] = {"KHR_materials_clearcoat", "KHR_materials_emissive_strength",
                                       "KHR_materials_ior", "KHR_materials_pbrSpecularGlossiness",
                                       "KHR_materials_sheen", "KHR_materials_specular",
                                       "KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_volume"};
    ca_gltf *g = m->g;
    const ca_gltf_value *all = ca_gltf_object(g, m->material, "extensions");
    for (const ca_gltf_value *e = all ? all->first : NULL; e; e = e->next) {
        if (is_among(e->key, read, CA_COUNT(read)) || is_among(e->key, g->unread, g->unread_count)) continue;
        if (g->unread_count == CA_COUNT(g->unread)) {
            ca_gltf_note(g, e, "more than %zu material extensions are not read", CA_COUNT(g->unread));
            return;
        }
        g->unread[g->unread_count++] = e->key;
        ca_gltf_note(g, e, "the material extension %.100s is not read", e->key);
    }
}

static void make_material(maker *m, ca_gltf_material *made)
{
    ca_xml_node *root = ca_tree_root(&m->g->tree);
    const transmission t = find_transmission(m);
    note_unread(m);
    if (ca_gltf_extension(m->g, m->material, "KHR_materials_unlit")) {
        make_unlit(m, made, root);
    } else {
        ca_xml_node *parent = put_mask(m, root);
        if (t.factor > 0.0 && !t.solid)
            put_thin_wall(m, parent, &t);
        else
            put_surface(m, parent, &t);
        read_emission(m, made);
    }
}

const ca_gltf_material *ca_gltf_material_of(ca_gltf *g, const ca_gltf_value *primitive, bool colored)
{
    const ca_gltf_value *material = ca_gltf_reference(g, primitive, "material", "materials");
    const uint32_t count = ca_gltf_table_size(g, "materials"), index = material ? material->index : count;
    if (!g->materials[colored]) g->materials[colored] = ca_gltf_alloc(g, (size_t)count + 1, sizeof *g->materials[0]);
    if (!ca_import_good(g->importer)) return NULL;
    ca_gltf_material *made = &g->materials[colored][index];
    if (made->done) return made;
    maker m = {.g = g, .material = material, .colored = colored, .uv_set = CA_NONE,
               .pbr = ca_gltf_object(g, material, "pbrMetallicRoughness"),
               .glossy = specular_glossiness(g, material)};
    made->done = true;
    made->id = material ? ca_gltf_format(g, "material %u%s", index, colored ? " with colours" : "")
                        : ca_gltf_format(g, "default material%s", colored ? " with colours" : "");
    ca_gltf_base_color(g, material, m.base);
    m.id = made->id;
    ca_gltf_at(g, material);
    make_material(&m, made);
    made->uv_set = m.uv_set;
    return ca_import_good(g->importer) ? made : NULL;
}
