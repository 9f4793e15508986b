/* Meshes: primitives become arrays once, and shapes wherever a node shows them; what several nodes show is instanced,
 * but for what shines, which only shapes of their own can. */
#include "import/gltf/reader.h"

#include "base/hash.h"

#include <math.h>
#include <string.h>

/* ---- Corners and triangles ------------------------------------------------------------------------------------- */

/* The attribute of a primitive, which must have as many elements as its positions; NULL: it has none. */
static const ca_gltf_value *attribute_of(ca_gltf *g, const ca_gltf_value *primitive, const char *name, size_t count)
{
    const ca_gltf_value *attributes = ca_gltf_object(g, primitive, "attributes");
    const ca_gltf_value *accessor = ca_gltf_reference(g, attributes, name, "accessors");
    if (!accessor) return NULL;
    if (ca_gltf_extension(g, primitive, "KHR_draco_mesh_compression") && !ca_gltf_member(g, accessor, "bufferView"))
        ca_gltf_fail(g, primitive, "meshes packed by Draco (KHR_draco_mesh_compression) are not read");
    const size_t found = ca_gltf_element_count(g, accessor);
    if (count > 0 && found > 0 && found != count)
        ca_gltf_fail(g, accessor, "has %zu elements, and the positions have %zu", found, count);
    return ca_import_good(g->importer) ? accessor : NULL;
}

typedef enum primitive_mode { TRIANGLES = 4, STRIP = 5, FAN = 6 } primitive_mode;

static size_t triangle_count(primitive_mode mode, size_t corners)
{
    if (mode == TRIANGLES) return corners / 3;
    return corners < 3 ? 0 : corners - 2;
}

/* Corner k of triangle t among the corners of a strip or fan: all triangles turn the same way. */
static size_t corner_of(primitive_mode mode, size_t t, size_t k)
{
    if (mode == TRIANGLES) return 3 * t + k;
    if (mode == FAN) return k == 2 ? 0 : t + 1 + k;
    return k == 0 ? t : t + (k == 1 ? 1 + t % 2 : 2 - t % 2);
}

/* The order of corners; NULL after failing. */
static uint32_t *read_order(ca_gltf *g, const ca_gltf_value *accessor, size_t corners, size_t vertices)
{
    uint32_t *order = ca_alloc(corners, sizeof *order);
    if (!order) {
        ca_import_fail_memory(g->importer, "meshes");
        return NULL;
    }
    for (size_t i = 0; i < corners && !accessor; i++) order[i] = (uint32_t)i;
    if (!accessor || ca_gltf_read_indices(g, accessor, vertices, order)) return order;
    ca_free(order);
    return NULL;
}

/* What is read of a primitive. */
typedef struct mesh_parts {
    const ca_gltf_value *positions, *normals, *uvs, *colors, *indices;
    primitive_mode mode;
    size_t vertices, corners, triangles;
} mesh_parts;

static void fill_indices(ca_gltf *g, const mesh_parts *parts, ca_mesh *mesh)
{
    uint32_t *order = read_order(g, parts->indices, parts->corners, parts->vertices);
    if (!order) return;
    for (size_t t = 0; t < parts->triangles; t++)
        for (size_t k = 0; k < 3; k++) mesh->indices[3 * t + k] = order[corner_of(parts->mode, t, k)];
    ca_free(order);
}

/* ---- Colours --------------------------------------------------------------------------------------------------- */

/* Red, green, blue and alpha of each vertex; NULL after failing. */
static float *read_colors(ca_gltf *g, const mesh_parts *parts)
{
    float *colors = ca_alloc(4 * parts->vertices, sizeof *colors);
    if (!colors) ca_import_fail_memory(g->importer, "meshes");
    if (colors && ca_gltf_read_floats(g, parts->colors, 4, colors)) return colors;
    ca_free(colors);
    return NULL;
}

static bool are_white(const float *colors, size_t vertices)
{
    for (size_t i = 0; i < 4 * vertices; i++)
        if (i % 4 != 3 && colors[i] != 1.0f) return false;
    return true;
}

static bool are_opaque(const float *colors, size_t vertices)
{
    for (size_t i = 0; i < vertices; i++)
        if (colors[4 * i + 3] < 1.0f) return false;
    return true;
}

/* Times the factor of the material. */
static void add_colors(ca_gltf *g, const ca_gltf_value *primitive, const float *colors, ca_mesh *mesh)
{
    float *values;
    ca_error reason;
    double base[4];
    ca_gltf_base_color(g, ca_gltf_reference(g, primitive, "material", "materials"), base);
    if (ca_mesh_add_attribute(mesh, "vertex_color", 3, false, &values, &reason) != CA_OK) {
        ca_import_fail_memory(g->importer, "meshes");
        return;
    }
    for (size_t i = 0; i < mesh->vertex_count; i++)
        for (size_t c = 0; c < 3; c++) {
            const double value = (double)colors[4 * i + c] * base[c];
            values[3 * i + c] = (float)fmin(fmax(value, 0.0), 1.0);
        }
}

/* ---- Primitives ------------------------------------------------------------------------------------------------ */

static bool find_parts(ca_gltf *g, const ca_gltf_value *primitive, mesh_parts *parts)
{
    const uint64_t mode = ca_gltf_count(g, primitive, "mode", TRIANGLES);
    if (ca_gltf_member(g, primitive, "targets")) ca_gltf_fail(g, primitive, "morph targets are not supported");
    if (mode > FAN) ca_gltf_fail(g, primitive, "mode must be from 0 to 6");
    if (mode < TRIANGLES) ca_gltf_note(g, primitive, "points and lines are not drawn");
    *parts = (mesh_parts){.mode = (primitive_mode)mode, .positions = attribute_of(g, primitive, "POSITION", 0)};
    if (!parts->positions || mode < TRIANGLES) return false;
    parts->vertices = ca_gltf_element_count(g, parts->positions);
    parts->normals = attribute_of(g, primitive, "NORMAL", parts->vertices);
    parts->colors = attribute_of(g, primitive, "COLOR_0", parts->vertices);
    parts->indices = ca_gltf_reference(g, primitive, "indices", "accessors");
    parts->corners = parts->indices ? ca_gltf_element_count(g, parts->indices) : parts->vertices;
    parts->triangles = triangle_count(parts->mode, parts->corners);
    return ca_import_good(g->importer) && parts->triangles > 0;
}

/* The texture coordinates that the material wants. */
static bool find_uvs(ca_gltf *g, const ca_gltf_value *primitive, uint32_t set, mesh_parts *parts)
{
    if (set == CA_NONE) return ca_import_good(g->importer);
    parts->uvs = attribute_of(g, primitive, ca_gltf_format(g, "TEXCOORD_%u", set), parts->vertices);
    if (!parts->uvs) ca_gltf_fail(g, primitive, "has no TEXCOORD_%u, which its material needs", set);
    return ca_import_good(g->importer);
}

static void find_bounds(const ca_mesh *mesh, ca_gltf_primitive *made)
{
    for (int i = 0; i < 3; i++) made->low[i] = (double)INFINITY, made->high[i] = (double)-INFINITY;
    for (size_t v = 0; v < (size_t)3 * mesh->vertex_count; v++) {
        made->low[v % 3] = fmin(made->low[v % 3], (double)mesh->positions[v]);
        made->high[v % 3] = fmax(made->high[v % 3], (double)mesh->positions[v]);
    }
}

static void fill_mesh(ca_gltf *g, const ca_gltf_value *primitive, const mesh_parts *parts, const float *colors,
                      ca_mesh *mesh)
{
    ca_gltf_read_floats(g, parts->positions, 3, mesh->positions);
    if (parts->normals) ca_gltf_read_floats(g, parts->normals, 3, mesh->normals);
    if (parts->uvs) ca_gltf_read_floats(g, parts->uvs, 2, mesh->uvs);
    if (ca_import_good(g->importer)) fill_indices(g, parts, mesh);
    if (colors && ca_import_good(g->importer)) add_colors(g, primitive, colors, mesh);
}

/* Of the accessors; 0 where there are colours, which also depend on the material. */
static uint64_t key_of(const mesh_parts *parts, bool colored)
{
    const ca_gltf_value *accessors[] = {parts->positions, parts->normals, parts->uvs, parts->indices};
    uint64_t key = ca_hash_add(CA_HASH_START, parts->mode);
    for (size_t i = 0; i < CA_COUNT(accessors); i++)
        key = ca_hash_add(key, accessors[i] ? accessors[i]->index + 1 : 0);
    return colored ? 0 : key | 1;
}

/* The array that another primitive made of the same accessors. */
static bool share_array(const ca_gltf *g, uint64_t key, ca_gltf_primitive *made)
{
    uint32_t index;
    if (!ca_key_table_find(&g->known_arrays, key, &index)) return false;
    *made = *g->arrays.items[index];
    return true;
}

static void note_array(ca_gltf *g, uint64_t key, const ca_gltf_primitive *made)
{
    if (key == 0) return;
    if (CA_TABLE_ADD(&g->arrays) && ca_key_table_add(&g->known_arrays, key, (uint32_t)(g->arrays.count - 1)))
        g->arrays.items[g->arrays.count - 1] = made;
    else
        ca_import_fail_memory(g->importer, "meshes");
}

/* `colors` NULL: there are none, or they are white. */
static void make_array(ca_gltf *g, const ca_gltf_value *primitive, mesh_parts *parts, const float *colors,
                       ca_gltf_primitive *made)
{
    const ca_gltf_material *material = ca_gltf_material_of(g, primitive, colors != NULL);
    const char *name;
    ca_mesh *mesh;
    ca_gltf_at(g, primitive);
    if (!material || !find_uvs(g, primitive, material->uv_set, parts)) return;
    const uint64_t key = key_of(parts, colors != NULL);
    const bool shared = share_array(g, key, made);
    made->material = material;
    if (shared) return;
    if (!ca_tree_add_mesh(&g->tree, parts->vertices, parts->triangles, parts->normals, parts->uvs, &name, &mesh))
        return;
    fill_mesh(g, primitive, parts, colors, mesh);
    if (!ca_import_good(g->importer)) return;
    find_bounds(mesh, made);
    made->array = name;
    made->flat = !parts->normals;
    note_array(g, key, made);
}

static void make_primitive(ca_gltf *g, const ca_gltf_value *primitive, ca_gltf_primitive *made)
{
    mesh_parts parts;
    float *colors = NULL;
    if (!find_parts(g, primitive, &parts)) return;
    if (parts.colors) {
        colors = read_colors(g, &parts);
        if (colors && !are_opaque(colors, parts.vertices))
            ca_gltf_note(g, primitive, "the alpha of colours at the corners (COLOR_0) is not read");
    }
    const bool white = !colors || are_white(colors, parts.vertices);
    if (ca_import_good(g->importer)) make_array(g, primitive, &parts, white ? NULL : colors, made);
    ca_free(colors);
}

/* ---- Shapes ---------------------------------------------------------------------------------------------------- */

static void put_emitter(ca_gltf *g, const ca_gltf_material *material, ca_xml_node *shape)
{
    if (!material->shines) return;
    ca_xml_node *light = ca_tree_object(&g->tree, shape, "emitter", "area");
    if (material->radiance)
        ca_tree_ref(&g->tree, light, "radiance", material->radiance);
    else
        ca_tree_rgb(&g->tree, light, "radiance", material->emission);
    g->lit = true;
}

/* `to_world` NULL: in a group. */
static void put_shape(ca_gltf *g, const ca_gltf_primitive *primitive, ca_xml_node *parent, const ca_matrix *to_world)
{
    ca_xml_node *shape = ca_tree_object(&g->tree, parent, "shape", "mesh");
    ca_tree_string(&g->tree, shape, "data", primitive->array);
    if (primitive->flat) ca_tree_boolean(&g->tree, shape, "face_normals", true);
    if (to_world) ca_tree_transform(&g->tree, shape, "to_world", to_world);
    ca_tree_ref(&g->tree, shape, NULL, primitive->material->id);
    put_emitter(g, primitive->material, shape);
}

static void make_mesh(ca_gltf *g, const ca_gltf_value *mesh, ca_gltf_mesh *made)
{
    const ca_gltf_value *list = ca_gltf_array(g, mesh, "primitives");
    if (!list && ca_import_good(g->importer)) ca_gltf_fail(g, mesh, "has no primitives");
    made->count = list ? list->count : 0;
    made->primitives = ca_gltf_alloc(g, made->count, sizeof *made->primitives);
    bool grouped = false;
    for (uint32_t i = 0; i < made->count && ca_import_good(g->importer); i++) {
        make_primitive(g, list->items[i], &made->primitives[i]);
        grouped |= made->primitives[i].array && !made->primitives[i].material->shines;
    }
    if (!grouped || made->users < 2 || !ca_import_good(g->importer)) return;
    made->group = ca_gltf_format(g, "mesh %u", mesh->index);
    ca_gltf_at(g, mesh);
    ca_xml_node *group =
        ca_tree_named_object(&g->tree, ca_tree_root(&g->tree), "shape", "shapegroup", NULL, made->group);
    for (uint32_t i = 0; i < made->count; i++)
        if (made->primitives[i].array && !made->primitives[i].material->shines)
            put_shape(g, &made->primitives[i], group, NULL);
}

static void widen_bounds(ca_gltf *g, const ca_gltf_primitive *primitive, const ca_matrix *m)
{
    for (int corner = 0; corner < 8; corner++)
        for (int i = 0; i < 3; i++) {
            double x = m->m[i][3];
            for (int k = 0; k < 3; k++) x += m->m[i][k] * (corner >> k & 1 ? primitive->high[k] : primitive->low[k]);
            g->low[i] = fmin(g->low[i], x);
            g->high[i] = fmax(g->high[i], x);
        }
}

void ca_gltf_show_mesh(ca_gltf *g, const ca_gltf_value *mesh, const ca_matrix *to_world)
{
    ca_gltf_mesh *made = &g->meshes[mesh->index];
    ca_xml_node *root = ca_tree_root(&g->tree);
    const ca_location where = g->tree.where;
    if (!made->primitives) make_mesh(g, mesh, made);
    g->tree.where = where;
    for (uint32_t i = 0; i < made->count && ca_import_good(g->importer); i++) {
        const ca_gltf_primitive *primitive = &made->primitives[i];
        if (!primitive->array) continue;
        widen_bounds(g, primitive, to_world);
        if (made->group && !primitive->material->shines) continue;
        put_shape(g, primitive, root, to_world);
    }
    if (!made->group || !ca_import_good(g->importer)) return;
    ca_xml_node *instance = ca_tree_object(&g->tree, root, "shape", "instance");
    ca_tree_transform(&g->tree, instance, "to_world", to_world);
    ca_tree_ref(&g->tree, instance, NULL, made->group);
}
