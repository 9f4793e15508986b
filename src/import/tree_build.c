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
    *tree = (ca_tree){
        .importer = importer, .where = {.file = importer->document.path}, .elements = CA_XML_MAX_ELEMENTS};
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

static void *make_array(ca_tree *tree, size_t count, size_t size)
{
    void *array = ca_arena_alloc(&tree->importer->arrays.arena, count, size);
    if (!array) ca_import_fail_memory(tree->importer, "the scene's arrays");
    return array;
}

bool ca_tree_add_mesh(ca_tree *tree, size_t vertex_count, size_t triangle_count, bool normals, bool uvs,
                      ca_tree_mesh *mesh)
{
    ca_importer *importer = tree->importer;
    if (!ca_import_good(importer)) return false;
    if (vertex_count > INT32_MAX || triangle_count > (size_t)1 << 30)
        ca_import_fail(importer, &tree->where, "a mesh is over the limit of 2^31 - 1 vertices or 2^30 triangles");
    if (!CA_TABLE_ADD(&importer->arrays.meshes)) ca_import_fail_memory(importer, "the scene's arrays");
    if (!ca_import_good(importer)) return false;
    const size_t index = importer->arrays.meshes.count - 1;
    *mesh = (ca_tree_mesh){.name = name_array(tree, "mesh", index),
                           .positions = make_array(tree, 3 * vertex_count, sizeof(float)),
                           .normals = normals ? make_array(tree, 3 * vertex_count, sizeof(float)) : NULL,
                           .uvs = uvs ? make_array(tree, 2 * vertex_count, sizeof(float)) : NULL,
                           .indices = make_array(tree, 3 * triangle_count, sizeof(uint32_t))};
    importer->arrays.meshes.items[index] = (ca_mesh_data){.name = mesh->name,
                                                          .vertex_count = vertex_count,
                                                          .triangle_count = triangle_count,
                                                          .positions = mesh->positions,
                                                          .normals = mesh->normals,
                                                          .uvs = mesh->uvs,
                                                          .indices = mesh->indices};
    return ca_import_good(importer);
}

bool ca_tree_add_bitmap(ca_tree *tree, uint32_t width, uint32_t height, uint32_t channels, ca_tree_bitmap *bitmap)
{
    ca_importer *importer = tree->importer;
    if (!ca_import_good(importer)) return false;
    if (!CA_TABLE_ADD(&importer->arrays.bitmaps)) ca_import_fail_memory(importer, "the scene's arrays");
    if (!ca_import_good(importer)) return false;
    const size_t index = importer->arrays.bitmaps.count - 1;
    *bitmap = (ca_tree_bitmap){.name = name_array(tree, "bitmap", index),
                               .pixels = make_array(tree, (size_t)width * height * channels, sizeof(float))};
    importer->arrays.bitmaps.items[index] = (ca_bitmap_data){
        .name = bitmap->name, .width = width, .height = height, .channels = channels, .pixels = bitmap->pixels};
    return ca_import_good(importer);
}
