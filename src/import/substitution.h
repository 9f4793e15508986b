/* The values behind $names: what -D says, else what the first <default> of that name says. */
#ifndef CA_IMPORT_SUBSTITUTION_H
#define CA_IMPORT_SUBSTITUTION_H

#include "import/document.h"

typedef struct ca_definition {
    const char *name, *value;
    bool known; /* the scene has a <default> for it or uses it */
} ca_definition;

typedef struct ca_definitions {
    ca_definition items[CA_DOCUMENT_MAX_DEFAULTS];
    size_t count;
} ca_definitions;

/* From the command line. */
ca_status ca_definitions_start(ca_definitions *definitions, const ca_define *defines, size_t count, ca_error *error);
/* From a <default>, whose attributes are already substituted. */
ca_status ca_definitions_add_default(ca_definitions *definitions, const ca_xml_node *node, ca_error *error);
/* An error where the command line defines what the scene does not know. */
ca_status ca_definitions_check_known(const ca_definitions *definitions, ca_error *error);

/* Replaces $name in all attributes of the element; \$ stands for a $. New text goes to the arena. */
ca_status ca_definitions_substitute(ca_definitions *definitions, ca_xml_node *node, ca_arena *arena, ca_error *error);

#endif
