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

static void import_bitmap(ca_props *props, void *result)
{
    ca_texture *texture = result;
    static const char *const filters[] = {"nearest", "bilinear"};
    static const char *const wraps[] = {"repeat", "mirror", "clamp"};
    static const char *const formats[] = {"auto", "variant", "fp16"};
    texture->kind = CA_TEXTURE_BITMAP;
    texture->as.bitmap.filter =
        (ca_texture_filter)ca_props_choice(props, "filter_type", filters, CA_COUNT(filters), 1);
    texture->as.bitmap.wrap = (ca_texture_wrap)ca_props_choice(props, "wrap_mode", wraps, CA_COUNT(wraps), 0);
    ca_props_choice(props, "format", formats, CA_COUNT(formats), 0);
    ca_props_boolean(props, "accel", true);
    const bool raw = ca_props_boolean(props, "raw", false);
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

static void import_mesh_attribute(ca_props *props, void *result)
{
    ca_texture *texture = result;
    texture->kind = CA_TEXTURE_MESH_ATTRIBUTE;
    const ca_matrix identity = ca_matrix_identity();
    set_to_uv(texture, &identity);
    const char *name = ca_props_string(props, "name", "");
    if (strncmp(name, "vertex_", 7) != 0 && strncmp(name, "face_", 5) != 0)
        ca_props_fail(props, "name", "must begin with \"vertex_\" or \"face_\"");
    texture->as.mesh_attribute.name = ca_arena_strdup(&props->importer->desc->strings, name);
    if (!texture->as.mesh_attribute.name) ca_import_fail_memory(props->importer, "textures");
}

static const ca_plugin plugins[] = {
    {"bitmap", import_bitmap},
    {"checkerboard", import_checkerboard},
    {"mesh_attribute", import_mesh_attribute},
};

static ca_texture_id build(ca_importer *importer, ca_xml_node *node)
{
    const ca_plugin *plugin = ca_import_find_plugin(importer, node, plugins, CA_COUNT(plugins));
    if (!plugin) return CA_NONE;
    ca_texture texture = {0};
    ca_props props;
    ca_props_begin(&props, importer, node);
    plugin->import(&props, &texture);
    ca_props_end(&props);
    if (!ca_import_good(importer)) return CA_NONE;
    if (!CA_TABLE_ADD(&importer->desc->textures)) {
        ca_import_fail_memory(importer, "textures");
        return CA_NONE;
    }
    importer->desc->textures.items[importer->desc->textures.count - 1] = texture;
    return (ca_texture_id)(importer->desc->textures.count - 1);
}

ca_texture_id ca_import_texture(ca_importer *importer, ca_xml_node *node)
{
    if (node->progress == CA_NODE_DONE) return node->result;
    if (!ca_import_enter(importer, node)) return CA_NONE;
    const ca_texture_id id = build(importer, node);
    ca_import_leave(importer, node, id);
    return id;
}
