/* The scene of a file: its nodes, and what it needs of extensions. */
#include "import/gltf/gltf.h"
#include "import/gltf/reader.h"

#include <math.h>
#include <string.h>

enum { MAX_NODE_DEPTH = 1000 };

/* ---- Extensions ------------------------------------------------------------------------------------------------ */

static void check_required(ca_gltf *g)
{
    static const char *const known[] = {
        "KHR_lights_punctual",     "KHR_materials_transmission", "KHR_materials_emissive_strength",
        "KHR_materials_ior",       "KHR_materials_clearcoat",    "KHR_materials_specular",
        "KHR_materials_sheen",     "KHR_texture_transform",      "KHR_materials_unlit",
        "KHR_mesh_quantization",   "KHR_materials_volume",       "EXT_texture_webp",
        "EXT_mesh_gpu_instancing", "KHR_node_visibility",        "KHR_materials_pbrSpecularGlossiness",
    };
    const ca_gltf_value *list = ca_gltf_array(g, g->root, "extensionsRequired");
    for (uint32_t i = 0; list && i < list->count && ca_import_good(g->importer); i++) {
        const ca_gltf_value *name = list->items[i];
        bool found = false;
        for (size_t k = 0; k < CA_COUNT(known); k++)
            found |= name->kind == CA_GLTF_TEXT && strcmp(known[k], name->text) == 0;
        if (!found)
            ca_gltf_fail(g, name, "the file needs the extension %.60s, which is not supported",
                         name->kind == CA_GLTF_TEXT ? name->text : "");
    }
}

/* ---- Nodes ----------------------------------------------------------------------------------------------------- */

static ca_matrix matrix_of_columns(const double numbers[16])
{
    ca_matrix m;
    for (int i = 0; i < 16; i++) m.m[i % 4][i / 4] = numbers[i];
    return m;
}

/* Of a unit quaternion x, y, z, w. */
static ca_matrix matrix_of_rotation(const double q[4])
{
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    return (ca_matrix){{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 0},
                        {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0},
                        {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), 0},
                        {0, 0, 0, 1}}};
}

/* Scale, then rotation, then translation. */
static ca_matrix matrix_of_parts(ca_gltf *g, const ca_gltf_value *node, const double t[3], const double q[4],
                                 const double s[3])
{
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0.0) || !isfinite(length)) ca_gltf_fail(g, node, "its rotation is no quaternion");
    const double unit[4] = {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
    const ca_matrix scale = ca_matrix_scale(s[0], s[1], s[2]), rotation = matrix_of_rotation(unit);
    const ca_matrix translation = ca_matrix_translate(t[0], t[1], t[2]);
    const ca_matrix turned = ca_matrix_multiply(&rotation, &scale);
    return ca_matrix_multiply(&translation, &turned);
}

static ca_matrix local_matrix(ca_gltf *g, const ca_gltf_value *node)
{
    double columns[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (ca_gltf_numbers(g, node, "matrix", columns, 16)) {
        const bool affine = columns[3] == 0.0 && columns[7] == 0.0 && columns[11] == 0.0 && columns[15] == 1.0;
        if (!affine) ca_gltf_fail(g, node, "the last row of its matrix is not 0 0 0 1");
        return matrix_of_columns(columns);
    }
    ca_gltf_numbers(g, node, "translation", t, 3);
    ca_gltf_numbers(g, node, "rotation", q, 4);
    ca_gltf_numbers(g, node, "scale", s, 3);
    return matrix_of_parts(g, node, t, q, s);
}

/* ---- Where a node shows its mesh ------------------------------------------------------------------------------- */

/* EXT_mesh_gpu_instancing: an array for each part, of `count` elements; NULL where the part is left out. */
typedef struct node_places {
    const ca_gltf_value *part[3];
    size_t count; /* 1 without the extension */
} node_places;

enum { PLACE_TRANSLATION, PLACE_ROTATION, PLACE_SCALE, PLACE_PARTS };

static node_places places_of(ca_gltf *g, const ca_gltf_value *node)
{
    static const char *const names[PLACE_PARTS] = {"TRANSLATION", "ROTATION", "SCALE"};
    const ca_gltf_value *extension = ca_gltf_extension(g, node, "EXT_mesh_gpu_instancing");
    const ca_gltf_value *attributes = ca_gltf_object(g, extension, "attributes");
    node_places places = {.count = 1};
    bool first = true;
    for (int i = 0; i < PLACE_PARTS; i++) {
        places.part[i] = ca_gltf_reference(g, attributes, names[i], "accessors");
        if (!places.part[i]) continue;
        const size_t count = ca_gltf_element_count(g, places.part[i]);
        if (!first && count != places.count)
            ca_gltf_fail(g, places.part[i], "has %zu elements, and another part of the instances %zu", count,
                         places.count);
        places.count = count;
        first = false;
    }
    return places;
}

static void show_at(ca_gltf *g, const ca_gltf_value *node, const ca_gltf_value *mesh, const ca_matrix *to_world)
{
    ca_affine affine;
    if (ca_affine_from_matrix(to_world, &affine))
        ca_gltf_show_mesh(g, mesh, to_world);
    else
        ca_gltf_note(g, node, "a node whose matrix flattens what it shows is left out");
}

static void show_at_places(ca_gltf *g, const ca_gltf_value *node, const ca_gltf_value *mesh,
                           const node_places *places, const ca_matrix *to_world)
{
    static const uint32_t sizes[PLACE_PARTS] = {3, 4, 3};
    float *values[PLACE_PARTS] = {NULL};
    for (int k = 0; k < PLACE_PARTS; k++) {
        if (!places->part[k]) continue;
        values[k] = ca_gltf_alloc(g, places->count, sizes[k] * sizeof *values[k]);
        if (!values[k] || !ca_gltf_read_floats(g, places->part[k], sizes[k], values[k])) return;
    }
    for (size_t i = 0; i < places->count && ca_import_good(g->importer); i++) {
        double parts[PLACE_PARTS][4] = {{0, 0, 0}, {0, 0, 0, 1}, {1, 1, 1}};
        for (int k = 0; k < PLACE_PARTS; k++)
            for (uint32_t c = 0; values[k] && c < sizes[k]; c++) parts[k][c] = (double)values[k][i * sizes[k] + c];
        const ca_matrix local = matrix_of_parts(g, node, parts[PLACE_TRANSLATION], parts[PLACE_ROTATION],
                                                parts[PLACE_SCALE]);
        const ca_matrix placed = ca_matrix_multiply(to_world, &local);
        show_at(g, node, mesh, &placed);
    }
}

static void show_node_mesh(ca_gltf *g, const ca_gltf_value *node, const ca_matrix *to_world)
{
    const ca_gltf_value *mesh = ca_gltf_reference(g, node, "mesh", "meshes");
    if (!mesh) return;
    if (ca_gltf_member(g, node, "skin")) ca_gltf_fail(g, node, "skins are not supported");
    ca_gltf_at(g, node);
    const node_places places = places_of(g, node);
    show_at_places(g, node, mesh, &places, to_world);
}

/* Goes through the nodes below one; `visit` NULL: only counts which meshes are shown. */
typedef struct node_walk {
    ca_gltf *g;
    bool counts;
    bool has_camera;
} node_walk;

static void walk_node(node_walk *walk, const ca_gltf_value *node, const ca_matrix *parent, int depth);

static void walk_list(node_walk *walk, const ca_gltf_value *list, const ca_matrix *parent, int depth)
{
    ca_gltf *g = walk->g;
    const ca_gltf_value *nodes = ca_gltf_table_of(g, "nodes");
    for (uint32_t i = 0; list && i < list->count && ca_import_good(g->importer); i++) {
        const ca_gltf_value *item = list->items[i];
        const bool good = nodes && item->kind == CA_GLTF_NUMBER && item->number >= 0.0 &&
                          item->number < nodes->count && item->number == floor(item->number);
        if (good)
            walk_node(walk, nodes->items[(uint32_t)item->number], parent, depth);
        else
            ca_gltf_fail(g, item, "is no node of the %u that there are", nodes ? nodes->count : 0);
    }
}

/* What is hidden hides what is below it. */
static bool is_hidden(ca_gltf *g, const ca_gltf_value *node)
{
    return !ca_gltf_boolean(g, ca_gltf_extension(g, node, "KHR_node_visibility"), "visible", true);
}

static void walk_node(node_walk *walk, const ca_gltf_value *node, const ca_matrix *parent, int depth)
{
    ca_gltf *g = walk->g;
    if (is_hidden(g, node)) return;
    if (walk->counts && g->seen[node->index])
        ca_gltf_fail(g, node, "this node is in the tree of nodes twice, or in itself");
    if (depth == MAX_NODE_DEPTH) ca_gltf_fail(g, node, "nodes are nested more than %d deep", MAX_NODE_DEPTH);
    g->seen[node->index] = true;
    const ca_matrix local = local_matrix(g, node), to_world = ca_matrix_multiply(parent, &local);
    const ca_gltf_value *mesh = walk->counts ? ca_gltf_reference(g, node, "mesh", "meshes") : NULL;
    if (mesh) g->meshes[mesh->index].users += (uint32_t)places_of(g, node).count;
    if (!walk->counts && ca_import_good(g->importer)) {
        show_node_mesh(g, node, &to_world);
        ca_gltf_add_light(g, node, &to_world);
        walk->has_camera |= ca_gltf_member(g, node, "camera") != NULL;
        ca_gltf_add_camera(g, node, &to_world);
    }
    if (ca_import_good(g->importer)) walk_list(walk, ca_gltf_array(g, node, "children"), &to_world, depth + 1);
}

/* ---- The scene ------------------------------------------------------------------------------------------------- */

/* The nodes of the scene that the file names, or of its first. */
static const ca_gltf_value *scene_nodes(ca_gltf *g)
{
    const ca_gltf_value *scene = ca_gltf_reference(g, g->root, "scene", "scenes");
    const ca_gltf_value *scenes = ca_gltf_array(g, g->root, "scenes");
    if (!scene && scenes && scenes->count > 0) scene = scenes->items[0];
    if (!scene && ca_import_good(g->importer)) ca_gltf_fail(g, g->root, "the file has no scenes");
    return scene ? ca_gltf_array(g, scene, "nodes") : NULL;
}

void ca_gltf_read_scene(ca_gltf *g)
{
    const ca_matrix identity = ca_matrix_identity();
    node_walk walk = {.g = g, .counts = true};
    check_required(g);
    g->meshes = ca_gltf_alloc(g, ca_gltf_table_size(g, "meshes"), sizeof *g->meshes);
    g->seen = ca_gltf_alloc(g, ca_gltf_table_size(g, "nodes"), sizeof *g->seen);
    for (int i = 0; i < 3; i++) g->low[i] = (double)INFINITY, g->high[i] = (double)-INFINITY;
    const ca_gltf_value *nodes = ca_import_good(g->importer) ? scene_nodes(g) : NULL;
    if (ca_gltf_array(g, g->root, "animations"))
        ca_gltf_note(g, g->root, "animations are not played: nodes are where the file puts them");
    if (ca_import_good(g->importer)) walk_list(&walk, nodes, &identity, 0);
    walk.counts = false;
    if (ca_import_good(g->importer)) walk_list(&walk, nodes, &identity, 0);
    if (ca_import_good(g->importer)) ca_gltf_add_defaults(g, walk.has_camera);
}

void ca_read_gltf(ca_importer *importer)
{
    ca_gltf g = {.importer = importer};
    ca_tree_begin(&g.tree, importer);
    if (ca_import_good(importer)) ca_gltf_open(&g);
    if (ca_import_good(importer)) ca_gltf_read_scene(&g);
    ca_tree_end(&g.tree);
    for (size_t i = 0; i < g.owned.count; i++) ca_bytes_destroy(&g.owned.items[i]);
    ca_free(g.owned.items);
    ca_free(g.baked.items);
    ca_free(g.arrays.items);
    ca_key_table_destroy(&g.known_arrays);
    ca_bytes_destroy(&g.file);
}
