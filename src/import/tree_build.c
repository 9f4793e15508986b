#include "import/tree_build.h"

#include "base/text.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { MAX_ATTRIBUTES = 4, NUMBER_TEXT = 32 };

/* ---- Nodes ----------------------------------------------------------------------------------------------------- */

static ca_arena *arena_of(ca_tree *tree) { return &tree->importer->document.arena; }

static const char *keep(ca_tree *tree, const char *text)
{
    const char *kept = ca_arena_strdup(arena_of(tree), text);
    if (!kept) ca_import_fail_memory(tree->importer, "the scene's elements");
    return kept;
}

static ca_xml_node *make_node(ca_tree *tree, const char *tag)
{
    if (tree->elements == 0) ca_import_fail(tree->importer, &tree->where, "the scene has too many elements");
    tree->lost = (ca_xml_node){.tag = tag, .where = tree->where};
    if (!ca_import_good(tree->importer)) return &tree->lost;
    ca_xml_node *node = ca_arena_alloc(arena_of(tree), 1, sizeof *node);
    ca_xml_attribute *attributes = ca_arena_alloc(arena_of(tree), MAX_ATTRIBUTES, sizeof *attributes);
    if (!node || !attributes) {
        ca_import_fail_memory(tree->importer, "the scene's elements");
        return &tree->lost;
    }
    tree->elements--;
    *node = (ca_xml_node){.tag = tag, .attributes = attributes, .where = tree->where};
    return node;
}

void ca_tree_set(ca_tree *tree, ca_xml_node *node, const char *attribute, const char *value)
{
    const char *kept = node != &tree->lost ? keep(tree, value) : NULL;
    if (!kept) return;
    assert(node->attribute_count < MAX_ATTRIBUTES);
    node->attributes[node->attribute_count++] = (ca_xml_attribute){.name = attribute, .value = kept};
}

void ca_tree_append(ca_tree *tree, ca_xml_node *parent, ca_xml_node *child)
{
    if (parent == &tree->lost || child == &tree->lost) return;
    if (parent->last_child)
        parent->last_child->next = child;
    else
        parent->first_child = child;
    parent->last_child = child;
}

ca_xml_node *ca_tree_root(const ca_tree *tree) { return tree->importer->document.root; }

ca_xml_node *ca_tree_named_object(ca_tree *tree, ca_xml_node *parent, const char *tag, const char *type,
                                  const char *name, const char *id)
{
    ca_xml_node *node = make_node(tree, tag);
    ca_tree_set(tree, node, "type", type);
    if (name) ca_tree_set(tree, node, "name", name);
    if (id) ca_tree_set(tree, node, "id", id);
    if (parent) ca_tree_append(tree, parent, node);
    return node;
}

ca_xml_node *ca_tree_object(ca_tree *tree, ca_xml_node *parent, const char *tag, const char *type)
{
    return ca_tree_named_object(tree, parent, tag, type, NULL, NULL);
}

/* ---- Parameters ------------------------------------------------------------------------------------------------ */

/* With a point in every locale. */
static void print_digits(char text[NUMBER_TEXT], int digits, double value)
{
    snprintf(text, NUMBER_TEXT, "%.*g", digits, value);
    for (char *c = text; *c; c++)
        if (!strchr("+-0123456789einfa", *c)) *c = '.';
}

/* Nine digits, or 17 where those are another number. */
static void print_number(char text[NUMBER_TEXT], double value)
{
    double again;
    print_digits(text, 9, value);
    if (!ca_parse_double(text, &again) || again != value) print_digits(text, 17, value);
}

static void add_parameter(ca_tree *tree, ca_xml_node *object, const char *tag, const char *name, const char *value)
{
    ca_xml_node *node = make_node(tree, tag);
    ca_tree_set(tree, node, "name", name);
    if (value) ca_tree_set(tree, node, "value", value);
    ca_tree_append(tree, object, node);
}

/* Numbers in a list. */
static void print_numbers(char *text, const double *numbers, size_t count)
{
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
        if (i > 0) text[used++] = ' ';
        print_number(text + used, numbers[i]);
        used += strlen(text + used);
    }
}

void ca_tree_float(ca_tree *tree, ca_xml_node *object, const char *name, double value)
{
    char text[NUMBER_TEXT];
    print_number(text, value);
    add_parameter(tree, object, "float", name, text);
}

void ca_tree_integer(ca_tree *tree, ca_xml_node *object, const char *name, int64_t value)
{
    char text[NUMBER_TEXT];
    snprintf(text, sizeof text, "%lld", (long long)value);
    add_parameter(tree, object, "integer", name, text);
}

void ca_tree_boolean(ca_tree *tree, ca_xml_node *object, const char *name, bool value)
{
    add_parameter(tree, object, "boolean", name, value ? "true" : "false");
}

void ca_tree_string(ca_tree *tree, ca_xml_node *object, const char *name, const char *value)
{
    add_parameter(tree, object, "string", name, value);
}

void ca_tree_rgb(ca_tree *tree, ca_xml_node *object, const char *name, const double rgb[3])
{
    char text[3 * NUMBER_TEXT];
    print_numbers(text, rgb, 3);
    add_parameter(tree, object, "rgb", name, text);
}

void ca_tree_point(ca_tree *tree, ca_xml_node *object, const char *name, const double xyz[3])
{
    char text[3 * NUMBER_TEXT];
    print_numbers(text, xyz, 3);
    add_parameter(tree, object, "point", name, text);
}

void ca_tree_transform(ca_tree *tree, ca_xml_node *object, const char *name, const ca_matrix *matrix)
{
    char text[16 * NUMBER_TEXT];
    double numbers[16];
    for (int i = 0; i < 16; i++) numbers[i] = matrix->m[i / 4][i % 4];
    print_numbers(text, numbers, 16);
    add_parameter(tree, object, "transform", name, NULL);
    ca_xml_node *step = make_node(tree, "matrix");
    ca_tree_set(tree, step, "value", text);
    if (ca_import_good(tree->importer)) ca_tree_append(tree, object->last_child, step);
}

void ca_tree_ref(ca_tree *tree, ca_xml_node *object, const char *name, const char *id)
{
    ca_xml_node *node = make_node(tree, "ref");
    ca_tree_set(tree, node, "id", id);
    if (name) ca_tree_set(tree, node, "name", name);
    ca_tree_append(tree, object, node);
}

/* ---- Begin and end --------------------------------------------------------------------------------------------- */

void ca_tree_begin(ca_tree *tree, ca_importer *importer)
{
    *tree =
        (ca_tree){.importer = importer, .where = {.file = importer->document.path}, .elements = CA_XML_MAX_ELEMENTS};
    ca_xml_node *root = make_node(tree, "scene");
    ca_tree_set(tree, root, "version", "3.0.0");
    importer->document.root = root;
}

void ca_tree_end(ca_tree *tree)
{
    ca_importer *importer = tree->importer;
    if (ca_import_good(importer)) importer->status = ca_document_finish(&importer->document, importer->error);
}

/* ---- Arrays ---------------------------------------------------------------------------------------------------- */

/* "mesh 7" */
static const char *name_array(ca_tree *tree, const char *what, size_t number)
{
    char name[64];
    snprintf(name, sizeof name, "%s %zu", what, number);
    return keep(tree, name);
}

static void fail_array(ca_tree *tree, ca_status status, const ca_error *reason)
{
    ca_import_fail_file(tree->importer, &tree->where, status, reason);
}

/* Takes the mesh over. */
static const char *keep_mesh(ca_tree *tree, const ca_mesh *mesh)
{
    ca_import_arrays *arrays = &tree->importer->arrays;
    if (!CA_TABLE_ADD(&arrays->meshes)) {
        ca_mesh gone = *mesh;
        ca_mesh_destroy(&gone);
        ca_import_fail_memory(tree->importer, "the scene's meshes");
        return NULL;
    }
    const size_t index = arrays->meshes.count - 1;
    arrays->meshes.items[index] = (ca_import_mesh){.name = name_array(tree, "mesh", index), .mesh = *mesh};
    if (!arrays->meshes.items[index].name) arrays->meshes.items[index].name = "";
    return arrays->meshes.items[index].name;
}

bool ca_tree_take_mesh(ca_tree *tree, ca_mesh *mesh, const char **name)
{
    const bool good = ca_import_good(tree->importer);
    if (good)
        *name = keep_mesh(tree, mesh);
    else
        ca_mesh_destroy(mesh);
    *mesh = (ca_mesh){0};
    return ca_import_good(tree->importer);
}

bool ca_tree_take_curve(ca_tree *tree, ca_curve *curve, const char **name)
{
    ca_import_arrays *arrays = &tree->importer->arrays;
    if (ca_import_good(tree->importer) && !CA_TABLE_ADD(&arrays->curves))
        ca_import_fail_memory(tree->importer, "the scene's curves");
    if (!ca_import_good(tree->importer)) {
        ca_curve_destroy(curve);
        return false;
    }
    const size_t index = arrays->curves.count - 1;
    const char *made = name_array(tree, "curve", index);
    arrays->curves.items[index] = (ca_import_curve){.name = made ? made : "", .curve = curve};
    *name = arrays->curves.items[index].name;
    return ca_import_good(tree->importer);
}

bool ca_tree_add_mesh(ca_tree *tree, size_t vertex_count, size_t triangle_count, bool normals, bool uvs,
                      const char **name, ca_mesh **mesh)
{
    ca_mesh made;
    ca_error reason;
    if (!ca_import_good(tree->importer)) return false;
    const ca_status status = ca_mesh_create(&made, vertex_count, triangle_count, normals, uvs, &reason);
    if (status != CA_OK) {
        fail_array(tree, status, &reason);
        return false;
    }
    *name = keep_mesh(tree, &made);
    if (!ca_import_good(tree->importer)) return false;
    *mesh = &tree->importer->arrays.meshes.items[tree->importer->arrays.meshes.count - 1].mesh;
    return true;
}

bool ca_tree_add_bitmap(ca_tree *tree, uint32_t width, uint32_t height, uint32_t channels, ca_tree_bitmap *bitmap)
{
    ca_importer *importer = tree->importer;
    if (!ca_import_good(importer)) return false;
    if (!CA_TABLE_ADD(&importer->arrays.bitmaps)) ca_import_fail_memory(importer, "the scene's arrays");
    if (!ca_import_good(importer)) return false;
    const size_t index = importer->arrays.bitmaps.count - 1;
    *bitmap = (ca_tree_bitmap){
        .name = name_array(tree, "bitmap", index),
        .pixels = ca_arena_alloc(&importer->arrays.arena, (size_t)width * height * channels, sizeof(float))};
    if (!bitmap->pixels) ca_import_fail_memory(importer, "the scene's pictures");
    if (!ca_import_good(importer)) importer->arrays.bitmaps.count--;
    if (!ca_import_good(importer)) return false;
    importer->arrays.bitmaps.items[index] = (ca_bitmap_data){
        .name = bitmap->name, .width = width, .height = height, .channels = channels, .pixels = bitmap->pixels};
    return true;
}
