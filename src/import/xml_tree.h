/* One XML file as a tree of elements that know their place. Reading is by expat.
 *
 * Refused, besides what is no XML: document type declarations (so there are no entities to expand), processing
 * instructions, text between elements, more than CA_XML_MAX_DEPTH levels, more bytes or elements than the budget has.
 * All memory lies in the caller's arena and is given back with it. */
#ifndef CA_IMPORT_XML_TREE_H
#define CA_IMPORT_XML_TREE_H

#include "base/file.h"
#include "base/memory.h"

enum {
    CA_XML_MAX_DEPTH = 64,
    CA_XML_MAX_FILE_BYTES = 64 << 20,
    /* in all files of a scene together */
    CA_XML_MAX_TOTAL_BYTES = 256 << 20,
    CA_XML_MAX_ELEMENTS = 4 << 20,
};

typedef struct ca_xml_attribute {
    const char *name, *value;
} ca_xml_attribute;

typedef struct ca_xml_node {
    const char *tag;
    ca_xml_attribute *attributes;
    uint32_t attribute_count;
    ca_location where;
    struct ca_xml_node *first_child, *last_child, *next;
    /* What the importer made of it. */
    bool used; /* an importer has read this parameter or object */
    enum { CA_NODE_UNTOUCHED, CA_NODE_BEGUN, CA_NODE_DONE } progress;
    uint32_t result; /* index in the description's table, once done */
} ca_xml_node;

/* What is left to spend, over all files of a scene. */
typedef struct ca_xml_budget {
    size_t bytes, elements;
} ca_xml_budget;

/* `file_name` is what locations say; it must live as long as they do. */
ca_status ca_xml_parse(const char *text, size_t size, const char *file_name, ca_arena *arena, ca_xml_budget *budget,
                       ca_xml_node **root, ca_error *error);

/* NULL where the element has no such attribute. */
const char *ca_xml_attribute_value(const ca_xml_node *node, const char *name);

#endif
