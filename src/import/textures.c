/* Textures: bitmap, checkerboard, mesh_attribute. Result of each: ca_texture. */
#include "import/importer.h"

#include <string.h>

/* Surface coordinates and texture coordinates, as a 3x3 in the upper left and the translation of the 4x4. */
static void set_to_uv(ca_texture *texture, const ca_matrix *m)
{
    for (int row = 0; row < 2; row++) {
        texture->to_uv[row][0] = (float)m->m[row][0];
        texture->to_uv[row][1] = (float)m->m[row][1];
        texture->to_uv[row][2] = (float)m->m[row][3];
    }
}

/* to_uv, or 0.6's uscale, vscale (applied first), uoffset, voffset. */
static ca_matrix import_to_uv(ca_props *props)
{
    const ca_matrix to_uv = ca_props_transform(props, "to_uv");
    const ca_matrix scale =
        ca_matrix_scale(ca_props_number(props, "uscale", 1.0), ca_props_number(props, "vscale", 1.0), 1.0);
    const ca_matrix offset =
        ca_matrix_translate(ca_props_number(props, "uoffset", 0.0), ca_props_number(props, "voffset", 0.0), 0.0);
    const ca_matrix old = ca_matrix_multiply(&offset, &scale);
    return ca_matrix_multiply(&to_uv, &old);
}

/* 0.6's filters over several texels are bilinear here: pixels average anyway. */
static ca_texture_filter import_filter_type(ca_props *props)
{
    static const char *const filters[] = {"nearest", "bilinear", "trilinear", "ewa"};
    const size_t filter = ca_props_choice(props, "filter_type", filters, CA_COUNT(filters), 1);
    if (filter > 1)
        ca_import_note(props->importer, &props->node->where, "texture filter \"%s\" is read as \"bilinear\"",
                       filters[filter]);
    ca_props_number(props, "max_anisotropy", 20.0); /* of ewa */
    ca_props_boolean(props, "cache", true);
    return filter == 0 ? CA_FILTER_NEAREST : CA_FILTER_BILINEAR;
}

/* wrap_mode, or 0.6's for each axis, which must be the same; "zero" is 0.6's. */
static ca_texture_wrap import_wrap_mode(ca_props *props)
{
    static const char *const wraps[] = {"repeat", "mirror", "clamp", "zero"};
    const size_t wrap = ca_props_choice(props, "wrap_mode", wraps, CA_COUNT(wraps), 0);
    const size_t u = ca_props_choice(props, "wrap_mode_u", wraps, CA_COUNT(wraps), wrap);
    if (ca_props_choice(props, "wrap_mode_v", wraps, CA_COUNT(wraps), wrap) != u)
        ca_props_fail(props, "wrap_mode_v", "must be that of the other axis");
    return (ca_texture_wrap)u;
}

/* raw, or 0.6's gamma: 1 is raw, negative or 0 what the file is for. */
static bool import_raw(ca_props *props)
{
    const bool raw = ca_props_boolean(props, "raw", false);
    const double gamma = ca_props_number(props, "gamma", 0.0);
    if (gamma > 0.0 && gamma != 1.0 && gamma != 2.2) ca_props_fail(props, "gamma", "must be 1, 2.2, or -1 for sRGB");
    if (gamma == 2.2) ca_import_note(props->importer, &props->node->where, "texture gamma 2.2 is read as sRGB");
    return raw || gamma == 1.0;
}

static void import_bitmap(ca_props *props, void *result)
{
    ca_texture *texture = result;
    static const char *const formats[] = {"auto", "variant", "fp16"};
    texture->kind = CA_TEXTURE_BITMAP;
    texture->as.bitmap.filter = import_filter_type(props);
    texture->as.bitmap.wrap = import_wrap_mode(props);
    ca_props_choice(props, "format", formats, CA_COUNT(formats), 0);
    ca_props_boolean(props, "accel", true);
    const bool raw = import_raw(props);
    /* Mitsuba's v runs downwards in a bitmap (row 0 at v = 0), ours upwards. */
    const ca_matrix to_uv = import_to_uv(props), flip = {{{1, 0, 0, 0}, {0, -1, 0, 1}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    const ca_matrix flipped = ca_matrix_multiply(&flip, &to_uv);
    set_to_uv(texture, &flipped);
    texture->as.bitmap.image_index = ca_import_picture(props, raw ? CA_ENCODING_RAW : CA_ENCODING_SRGB);
}

static void import_checkerboard(ca_props *props, void *result)
{
    ca_texture *texture = result;
    texture->kind = CA_TEXTURE_CHECKERBOARD;
    const ca_matrix to_uv = import_to_uv(props);
    set_to_uv(texture, &to_uv);
    texture->as.checkerboard.color0 = ca_props_texture(props, "color0", 0.4f, CA_COLOR_INDEX);
    texture->as.checkerboard.color1 = ca_props_texture(props, "color1", 0.2f, CA_COLOR_INDEX);
}

static void set_attribute(ca_props *props, ca_texture *texture, const char *name)
{
    texture->kind = CA_TEXTURE_MESH_ATTRIBUTE;
    const ca_matrix identity = ca_matrix_identity();
    set_to_uv(texture, &identity);
    texture->as.mesh_attribute.name = ca_arena_strdup(&props->importer->desc->strings, name);
    if (!texture->as.mesh_attribute.name || !CA_TABLE_ADD(&props->importer->attributes)) {
        ca_import_fail_memory(props->importer, "textures");
        return;
    }
    props->importer->attributes.items[props->importer->attributes.count - 1] =
        (ca_import_attribute){texture->as.mesh_attribute.name, props->node->where};
}

static void import_mesh_attribute(ca_props *props, void *result)
{
    const char *name = ca_props_string(props, "name", "");
    if (strncmp(name, "vertex_", 7) != 0 && strncmp(name, "face_", 5) != 0)
        ca_props_fail(props, "name", "must begin with \"vertex_\" or \"face_\"");
    set_attribute(props, result, name);
}

/* 0.6. */
static void import_vertex_colors(ca_props *props, void *result) { set_attribute(props, result, "vertex_color"); }

static bool has_name(const ca_xml_node *node, const char *wanted)
{
    const char *name = ca_xml_attribute_value(node, "name");
    return name && strcmp(name, wanted) == 0;
}

/* A number or colour, or a texture that varies. */
static void import_factor(ca_props *props, ca_texture *texture)
{
    const ca_texture_id id = ca_props_texture(props, "scale", 1.0f, CA_COLOR_SIGNED);
    texture->as.scale.factor = ca_rgb_grey(1.0f);
    if (!ca_import_good(props->importer)) return;
    const ca_texture *factor = &props->importer->desc->textures.items[id];
    texture->as.scale.varies = factor->kind != CA_TEXTURE_CONSTANT;
    texture->as.scale.by = id;
    if (!texture->as.scale.varies) texture->as.scale.factor = factor->as.constant;
}

/* 0.6: another texture times a number or colour; here also times a texture. */
static void import_scale(ca_props *props, void *result)
{
    ca_texture *texture = result;
    ca_xml_node *cursor = NULL;
    const ca_matrix identity = ca_matrix_identity();
    texture->kind = CA_TEXTURE_SCALE;
    set_to_uv(texture, &identity);
    import_factor(props, texture);
    ca_xml_node *child;
    do
        child = ca_props_next_object(props, "texture", true, &cursor);
    while (child && has_name(cursor, "scale"));
    if (!child) {
        ca_import_fail(props->importer, &props->node->where, "scale needs a nested <texture>");
        return;
    }
    texture->as.scale.child = ca_import_texture(props->importer, child);
}

/* Ours: what pbrt has by that name. */
static void import_mix(ca_props *props, void *result)
{
    ca_texture *texture = result;
    const ca_matrix identity = ca_matrix_identity();
    texture->kind = CA_TEXTURE_MIX;
    set_to_uv(texture, &identity);
    texture->as.mix.color0 = ca_props_texture(props, "color0", 0.0f, CA_COLOR_SIGNED);
    texture->as.mix.color1 = ca_props_texture(props, "color1", 1.0f, CA_COLOR_SIGNED);
    texture->as.mix.weight = ca_props_texture(props, "weight", 0.5f, CA_COLOR_INDEX);
}

static ca_texture_id nested_texture(ca_props *props, const char *of)
{
    ca_xml_node *cursor = NULL;
    ca_xml_node *child = ca_props_next_object(props, "texture", true, &cursor);
    if (child) return ca_import_texture(props->importer, child);
    ca_import_fail(props->importer, &props->node->where, "%s needs a nested <texture>", of);
    return 0;
}

/* Ours: pbrt's roughness is the square of the distribution's parameter. */
static void import_power(ca_props *props, void *result)
{
    ca_texture *texture = result;
    const ca_matrix identity = ca_matrix_identity();
    texture->kind = CA_TEXTURE_POWER;
    set_to_uv(texture, &identity);
    texture->as.power.exponent = (float)ca_props_positive(props, "exponent", 1.0);
    texture->as.power.child = nested_texture(props, "power");
}

/* Ours: what pbrt does to reflectances. */
static void import_clamp(ca_props *props, void *result)
{
    ca_texture *texture = result;
    const ca_matrix identity = ca_matrix_identity();
    texture->kind = CA_TEXTURE_CLAMP;
    set_to_uv(texture, &identity);
    texture->as.clamp.child = nested_texture(props, "clamp");
}

/* Ours: pbrt's mappings. */
static void import_mapped(ca_props *props, void *result)
{
    static const char *const mappings[] = {"planar", "cylindrical", "spherical"};
    ca_texture *texture = result;
    const ca_matrix identity = ca_matrix_identity(), m = ca_props_transform(props, "to_texture");
    texture->kind = CA_TEXTURE_MAPPED;
    set_to_uv(texture, &identity);
    texture->as.mapped.mapping =
        (ca_texture_mapping)ca_props_choice(props, "mapping", mappings, CA_COUNT(mappings), 0);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            texture->as.mapped.to_texture[row][column] = (float)m.m[row][column];
    texture->as.mapped.child = nested_texture(props, "mapped");
}

/* Ours: how pbrt mixes by direction. */
static void import_facing(ca_props *props, void *result)
{
    ca_texture *texture = result;
    const ca_matrix identity = ca_matrix_identity();
    double d[3] = {0.0, 1.0, 0.0};
    ca_props_point(props, "direction", d);
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    texture->kind = CA_TEXTURE_FACING;
    set_to_uv(texture, &identity);
    if (!(length > 0.0)) ca_props_fail(props, "direction", "must have a length over 0");
    texture->as.facing.direction =
        (ca_vec3){(float)(d[0] / length), (float)(d[1] / length), (float)(d[2] / length)};
}

static const ca_plugin plugins[] = {
    {"bitmap", import_bitmap},
    {"mix", import_mix},
    {"power", import_power},
    {"clamp", import_clamp},
    {"mapped", import_mapped},
    {"facing", import_facing},
    {"scale", import_scale},
    {"checkerboard", import_checkerboard},
    {"mesh_attribute", import_mesh_attribute},
    {"vertexcolors", import_vertex_colors},
};

/* The nearest name of a wrong one may be a spectrum's. */
static const ca_plugin *find_plugin(ca_importer *importer, const ca_xml_node *node)
{
    ca_plugin all[CA_COUNT(plugins) + CA_IMPORT_SPECTRUM_COUNT];
    memcpy(all, plugins, sizeof plugins);
    for (size_t i = 0; i < CA_IMPORT_SPECTRUM_COUNT; i++)
        all[CA_COUNT(plugins) + i] = (ca_plugin){ca_import_spectrum_names[i], NULL};
    const ca_plugin *found = ca_import_find_plugin(importer, node, all, CA_COUNT(all));
    return found ? &plugins[found - all] : NULL;
}

static ca_texture import_any(ca_importer *importer, ca_xml_node *node)
{
    ca_texture texture = {0};
    if (ca_import_is_spectrum(node))
        return ca_texture_constant(ca_import_spectrum(importer, node, CA_COLOR_INDEX));
    const ca_plugin *plugin = find_plugin(importer, node);
    if (!plugin) return texture;
    ca_props props;
    ca_props_begin(&props, importer, node);
    plugin->import(&props, &texture);
    ca_props_end(&props);
    return texture;
}

ca_texture_id ca_import_add_texture(ca_importer *importer, const ca_texture *texture)
{
    if (!CA_TABLE_ADD(&importer->desc->textures)) {
        ca_import_fail_memory(importer, "textures");
        return CA_NONE;
    }
    const ca_texture_id id = (ca_texture_id)(importer->desc->textures.count - 1);
    importer->desc->textures.items[id] = *texture;
    return id;
}

static ca_texture_id build(ca_importer *importer, ca_xml_node *node)
{
    const ca_texture texture = import_any(importer, node);
    return ca_import_good(importer) ? ca_import_add_texture(importer, &texture) : CA_NONE;
}

ca_texture_id ca_import_texture(ca_importer *importer, ca_xml_node *node)
{
    if (node->progress == CA_NODE_DONE) return node->result;
    if (!ca_import_enter(importer, node)) return CA_NONE;
    const ca_texture_id id = build(importer, node);
    if (id != CA_NONE) ca_import_limit_texture(importer, id, &node->where);
    ca_import_leave(importer, node, id);
    return id;
}
