/* Makes the tree of a scene that is not written in XML, with the elements and parameters that XML would have
 * (elements.h, docs/scenes.md); the importer of XML scenes then reads it, with all its checks.
 *
 * A reader of a format is a function that fills importer->document: it sets `where` of the tree to the place in its
 * file and makes the nodes of what is said there. Failures are sticky and kept in the importer; after one the
 * functions here still return nodes, which lead nowhere. Numbers are written so that they are read again to the bit.
 * All memory is the document's or, of arrays, the importer's, and is gone when the scene is imported. */
#ifndef CA_IMPORT_TREE_BUILD_H
#define CA_IMPORT_TREE_BUILD_H

#include "import/importer.h"

typedef struct ca_tree {
    ca_importer *importer;
    ca_location where; /* of the nodes that are made */
    size_t elements;   /* how many may still be made */
    ca_xml_node lost;  /* stands for the nodes that there is no room for */
} ca_tree;

/* Starts with an empty <scene>; ca_tree_end checks all elements and finds their ids. */
void ca_tree_begin(ca_tree *tree, ca_importer *importer);
void ca_tree_end(ca_tree *tree);
/* <scene>. */
ca_xml_node *ca_tree_root(const ca_tree *tree);

/* An object, the last one in `parent` (NULL: in nothing yet). Of `name` and `id` either may be NULL. */
ca_xml_node *ca_tree_object(ca_tree *tree, ca_xml_node *parent, const char *tag, const char *type);
ca_xml_node *ca_tree_named_object(ca_tree *tree, ca_xml_node *parent, const char *tag, const char *type,
                                  const char *name, const char *id);
/* Appends an object that is in nothing yet. */
void ca_tree_append(ca_tree *tree, ca_xml_node *parent, ca_xml_node *child);
/* Sets an attribute that the node does not have. */
void ca_tree_set(ca_tree *tree, ca_xml_node *node, const char *attribute, const char *value);

/* Parameters of an object. */
void ca_tree_float(ca_tree *tree, ca_xml_node *object, const char *name, double value);
void ca_tree_integer(ca_tree *tree, ca_xml_node *object, const char *name, int64_t value);
void ca_tree_boolean(ca_tree *tree, ca_xml_node *object, const char *name, bool value);
void ca_tree_string(ca_tree *tree, ca_xml_node *object, const char *name, const char *value);
void ca_tree_rgb(ca_tree *tree, ca_xml_node *object, const char *name, const double rgb[3]);
void ca_tree_point(ca_tree *tree, ca_xml_node *object, const char *name, const double xyz[3]);
void ca_tree_transform(ca_tree *tree, ca_xml_node *object, const char *name, const ca_matrix *matrix);
/* A <ref>, with a name where it is not NULL. */
void ca_tree_ref(ca_tree *tree, ca_xml_node *object, const char *name, const char *id);

/* Meshes and pixels for `data` to name. False, with nothing made, after failing; *name then is not set.
 *
 * ca_tree_add_mesh makes a zeroed mesh (ca_mesh_create) for the reader to fill at once: the pointer is good until
 * the next is made. ca_tree_take_mesh takes over one that exists; it is gone also on failure. Any number of shapes
 * may name a mesh, all with the same face_normals and flip_tex_coords: they share it. */
bool ca_tree_add_mesh(ca_tree *tree, size_t vertex_count, size_t triangle_count, bool normals, bool uvs,
                      const char **name, ca_mesh **mesh);
bool ca_tree_take_mesh(ca_tree *tree, ca_mesh *mesh, const char **name);
/* Takes curves over, also on failure; one shape may name them. */
bool ca_tree_take_curve(ca_tree *tree, ca_curve *curve, const char **name);

typedef struct ca_tree_bitmap {
    const char *name;
    float *pixels; /* as ca_bitmap_data, zeroed, for the reader to fill */
} ca_tree_bitmap;

bool ca_tree_add_bitmap(ca_tree *tree, uint32_t width, uint32_t height, uint32_t channels, ca_tree_bitmap *bitmap);

#endif
