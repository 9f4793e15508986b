/* BSDFs that hold others (twosided, mask, blendbsdf, bumpmap, normalmap, coating), and any BSDF. */
#include "base/text.h"
#include "import/bsdf_plugins.h"
#include "import/number.h"
#include "material/bsdf.h"

#include <string.h>

/* ---- Children -------------------------------------------------------------------------------------------------- */

/* Imports the nested BSDFs, at least `low` and at most `high` of them, and returns how many there are. */
static size_t import_children(ca_props *props, ca_material_id *children, size_t low, size_t high)
{
    ca_xml_node *cursor = NULL, *child;
    size_t count = 0;
    while ((child = ca_props_next_object(props, "bsdf", true, &cursor)) && ca_import_good(props->importer)) {
        if (count == high) {
            ca_import_fail(props->importer, &cursor->where, "%s holds %zu BSDF%s, not more", props->type, high,
                           ca_noun((double)high, "", "s"));
            break;
        }
        children[count++] = ca_import_bsdf(props->importer, child);
    }
    if (count < low)
        ca_import_fail(props->importer, &props->node->where, "%s needs %zu nested BSDF%s", props->type, low,
                       ca_noun((double)low, "", "s"));
    return count;
}

static bool is_zero_constant(const ca_scene_desc *desc, ca_texture_id id)
{
    if (id == CA_NONE) return true;
    const ca_texture *texture = &desc->textures.items[id];
    return texture->kind == CA_TEXTURE_CONSTANT && ca_rgb_is_black(texture->as.constant);
}

/* Can light get through to the other side? */
static bool transmits(const ca_scene_desc *desc, ca_material_id id)
{
    const ca_material *m = &desc->materials.items[id].material;
    if (m->kind == CA_MATERIAL_NULL || m->kind == CA_MATERIAL_MASK) return true;
    if (m->kind == CA_MATERIAL_PRINCIPLED) return !is_zero_constant(desc, m->as.principled.spec_trans);
    if (m->kind == CA_MATERIAL_DIELECTRIC && is_zero_constant(desc, m->as.dielectric.transmittance)) return false;
    if (m->kind == CA_MATERIAL_ROUGH_DIELECTRIC && is_zero_constant(desc, m->as.rough_dielectric.transmittance))
        return false;
    if (ca_material_is_leaf(m->kind)) return (ca_material_scatter(m, 0) & CA_SCATTER_TRANSMISSION) != 0;
    ca_material_id children[2];
    const uint32_t count = ca_material_children(m, children);
    for (uint32_t i = 0; i < count; i++)
        if (transmits(desc, children[i])) return true;
    return false;
}

/* ---- The plugins ----------------------------------------------------------------------------------------------- */

void ca_import_twosided(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_TWOSIDED);
    ca_material_id sides[2] = {CA_NONE, CA_NONE};
    const size_t count = import_children(props, sides, 1, 2);
    if (!ca_import_good(props->importer)) return;
    m->as.twosided.front = sides[0];
    m->as.twosided.back = count == 1 ? sides[0] : sides[1];
    for (size_t i = 0; i < count; i++) {
        if (!transmits(props->importer->desc, sides[i])) continue;
        ca_import_fail(props->importer, &props->node->where,
                       "twosided cannot hold a BSDF that transmits light, as the one at line %u does",
                       props->importer->desc->materials.items[sides[i]].where.line);
    }
}

void ca_import_mask(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_MASK);
    m->as.mask.opacity = ca_props_texture(props, "opacity", 0.5f, CA_COLOR_REFLECTANCE);
    import_children(props, &m->as.mask.child, 1, 1);
}

void ca_import_blend(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_BLEND);
    if (!ca_props_find(props, "weight")) ca_props_fail(props, "weight", "is missing");
    m->as.blend.weight = ca_props_texture(props, "weight", 0.5f, CA_COLOR_REFLECTANCE);
    ca_material_id children[2] = {CA_NONE, CA_NONE};
    import_children(props, children, 2, 2);
    m->as.blend.first = children[0];
    m->as.blend.second = children[1];
}

/* ---- Mixtures -------------------------------------------------------------------------------------------------- */

enum { MAX_MIXED = CA_BSDF_MAX_LOBES };

/* The numbers of `weights`, one for each BSDF; their sum. */
static double import_weights(ca_props *props, double *weights, size_t count)
{
    const ca_xml_node *node = ca_props_find(props, "weights");
    const char *cursor = ca_props_string(props, "weights", NULL), *token;
    size_t found = 0;
    double sum = 0.0;
    if (!cursor) ca_props_fail(props, "weights", "is missing");
    for (size_t length; cursor && (length = ca_next_token(&cursor, &token)) > 0; found++) {
        double weight = -1.0;
        if (!ca_parse_number(token, length, &weight) || !(weight >= 0.0)) {
            ca_props_fail(props, "weights", "must be numbers of at least 0");
            return 0.0;
        }
        if (found < count) sum += weights[found] = weight;
    }
    if (cursor && found != count)
        ca_import_fail(props->importer, &node->where, "weights has %zu %s for %zu BSDFs", found,
                       ca_noun((double)found, "number", "numbers"), count);
    if (cursor && !(sum > 0.0)) ca_props_fail(props, "weights", "must not all be 0");
    return sum;
}

static ca_material_id add_material(ca_props *props, ca_material material)
{
    ca_scene_desc *desc = props->importer->desc;
    if (!CA_TABLE_ADD(&desc->materials)) {
        ca_import_fail_memory(props->importer, "materials");
        return CA_NONE;
    }
    const ca_material_id id = (ca_material_id)(desc->materials.count - 1);
    desc->materials.items[id] = (ca_material_desc){.material = material, .where = props->node->where};
    return id;
}

static ca_texture_id grey(ca_props *props, double value)
{
    const ca_texture_id id = ca_scene_desc_add_constant(props->importer->desc, ca_rgb_grey((float)value));
    if (id == CA_NONE) ca_import_fail_memory(props->importer, "textures");
    return id;
}

static ca_material blend_of(ca_props *props, ca_material_id first, ca_material_id second, double share_of_second)
{
    ca_material m = ca_material_of_kind(CA_MATERIAL_BLEND);
    m.as.blend.first = first;
    m.as.blend.second = second;
    m.as.blend.weight = grey(props, share_of_second);
    return m;
}

/* 0.6: a sum of BSDFs by their weights, as a chain of blends from the last one on. What the weights lack to 1 is
 * absorbed; more than 1 is scaled down. */
void ca_import_mixture(ca_props *props, void *result)
{
    ca_material_id children[MAX_MIXED] = {0};
    double weights[MAX_MIXED] = {0.0};
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_BLEND);
    const size_t count = import_children(props, children, 1, MAX_MIXED - 1);
    const double sum = import_weights(props, weights, count);
    if (!ca_import_good(props->importer)) return;
    if (sum > 1.0 + 1e-6)
        ca_import_note(props->importer, &props->node->where,
                       "weights of a mixturebsdf are scaled down to a sum of 1");
    ca_material black = ca_material_of_kind(CA_MATERIAL_DIFFUSE);
    black.as.diffuse.reflectance = grey(props, 0.0);
    ca_material_id rest = add_material(props, black);
    double rest_weight = sum < 1.0 ? 1.0 - sum : 0.0;
    for (size_t i = count; i-- > 0 && ca_import_good(props->importer);) {
        const double both = rest_weight + weights[i];
        *m = blend_of(props, children[i], rest, both > 0.0 ? rest_weight / both : 0.0);
        rest_weight = both;
        if (i > 0) rest = add_material(props, *m);
    }
}

/* The one nested texture, whatever its name. */
static ca_texture_id import_nested_texture(ca_props *props)
{
    ca_xml_node *cursor = NULL;
    ca_xml_node *texture = ca_props_next_object(props, "texture", true, &cursor);
    if (!texture) {
        ca_import_fail(props->importer, &props->node->where, "%s needs a nested <texture>", props->type);
        return CA_NONE;
    }
    return ca_import_texture(props->importer, texture);
}

static ca_material_perturbed import_rules(ca_props *props)
{
    return (ca_material_perturbed){.flips = ca_props_boolean(props, "flip_invalid_normals", true),
                                   .shadows = ca_props_boolean(props, "use_shadowing_function", true)};
}

/* Of one map in another Mitsuba applies the rules twice. */
static void note_nested(ca_props *props, ca_material_id child)
{
    if (!ca_import_good(props->importer)) return;
    const ca_material *m = &props->importer->desc->materials.items[child].material;
    if (m->kind == CA_MATERIAL_BUMP || m->kind == CA_MATERIAL_NORMAL_MAP)
        ca_import_note(props->importer, &props->node->where,
                       "of a bump or normal map in another one, flip_invalid_normals and use_shadowing_function "
                       "judge the last normal, not each in turn");
}

void ca_import_bump(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_BUMP);
    m->as.bump.scale = (float)ca_props_number(props, "scale", 1.0);
    m->as.bump.rules = import_rules(props);
    m->as.bump.height = import_nested_texture(props);
    import_children(props, &m->as.bump.child, 1, 1);
    note_nested(props, m->as.bump.child);
}

void ca_import_normal_map(ca_props *props, void *result)
{
    ca_material *m = result;
    *m = ca_material_of_kind(CA_MATERIAL_NORMAL_MAP);
    m->as.normal_map.normals = import_nested_texture(props);
    m->as.normal_map.rules = import_rules(props);
    m->as.normal_map.against_v = ca_props_boolean(props, "against_v", false);
    import_children(props, &m->as.normal_map.child, 1, 1);
    note_nested(props, m->as.normal_map.child);
}

/* ---- Coats (0.6) ----------------------------------------------------------------------------------------------- */

/* Blends of BSDFs that only reflect, and these: what else there is goes around the coat, not into it. */
static bool can_be_coated(const ca_scene_desc *desc, ca_material_id id)
{
    const ca_material *m = &desc->materials.items[id].material;
    if (ca_material_is_leaf(m->kind)) return !transmits(desc, id);
    ca_material_id children[2];
    const uint32_t count = ca_material_children(m, children);
    for (uint32_t i = 0; i < count; i++)
        if (!can_be_coated(desc, children[i])) return false;
    return m->kind == CA_MATERIAL_BLEND;
}

static void import_coat(ca_props *props, ca_material *m)
{
    *m = ca_material_of_kind(CA_MATERIAL_COATING);
    m->as.coating.eta = ca_import_glass_index(props);
    m->as.coating.thickness = (float)ca_props_number_in(props, "thickness", 1.0, 0.0, 1e30);
    m->as.coating.sigma_a = ca_props_texture(props, "sigma_a", 0.0f, CA_COLOR_INDEX);
    m->as.coating.specular = ca_props_texture(props, "specular_reflectance", 1.0f, CA_COLOR_REFLECTANCE);
    import_children(props, &m->as.coating.child, 1, 1);
    if (!ca_import_good(props->importer) || can_be_coated(props->importer->desc, m->as.coating.child)) return;
    ca_import_fail(props->importer, &props->node->where,
                   "%s can only hold a BSDF that reflects, or a blend of such: %s goes around it", props->type,
                   ca_material_kind_names[props->importer->desc->materials.items[m->as.coating.child].material.kind]);
}

void ca_import_coating(ca_props *props, void *result) { import_coat(props, result); }

void ca_import_rough_coating(ca_props *props, void *result)
{
    ca_material *m = result;
    import_coat(props, m);
    ca_import_one_roughness(props, &m->as.coating.facets);
}

/* ---- Any BSDF -------------------------------------------------------------------------------------------------- */

static ca_material_id build(ca_importer *importer, ca_xml_node *node)
{
    size_t count;
    const ca_plugin *plugins = ca_import_bsdf_plugins(&count);
    const ca_plugin *plugin = ca_import_find_plugin(importer, node, plugins, count);
    if (!plugin) return CA_NONE;
    ca_material material = {0};
    ca_props props;
    ca_props_begin(&props, importer, node);
    plugin->import(&props, &material);
    ca_props_end(&props);
    if (!ca_import_good(importer)) return CA_NONE;
    const char *id = ca_xml_attribute_value(node, "id");
    const char *kept_id = id ? ca_arena_strdup(&importer->desc->strings, id) : NULL;
    if ((id && !kept_id) || !CA_TABLE_ADD(&importer->desc->materials)) {
        ca_import_fail_memory(importer, "materials");
        return CA_NONE;
    }
    const ca_material_id index = (ca_material_id)(importer->desc->materials.count - 1);
    importer->desc->materials.items[index] =
        (ca_material_desc){.material = material, .where = node->where, .id = kept_id};
    return index;
}

ca_material_id ca_import_bsdf(ca_importer *importer, ca_xml_node *node)
{
    if (node->progress == CA_NODE_DONE) return node->result;
    if (!ca_import_enter(importer, node)) return CA_NONE;
    const ca_material_id id = build(importer, node);
    if (id != CA_NONE) ca_import_limit_material(importer, id, &node->where);
    ca_import_leave(importer, node, id);
    return id;
}
