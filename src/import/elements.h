/* The elements of the scene language: which attributes each has, and what may stand inside what. */
#ifndef CA_IMPORT_ELEMENTS_H
#define CA_IMPORT_ELEMENTS_H

#include "import/xml_tree.h"

typedef enum ca_element_kind {
    CA_ELEMENT_PARAMETER,      /* float, rgb, ... and transform: a named value of the object around it */
    CA_ELEMENT_TRANSFORM_STEP, /* translate, ...: only inside transform */
    CA_ELEMENT_OBJECT,         /* shape, bsdf, ...: has a type and parameters */
    CA_ELEMENT_REFERENCE,      /* ref: stands for an object with an id */
    CA_ELEMENT_DIRECTIVE,      /* default, include, alias, path: gone once the file is read */
} ca_element_kind;

/* Brings 0.6 spellings to those of Mitsuba 3: <lookAt> to <lookat>, the value of a `name` attribute from camelCase to
 * snake_case (but for <default>, whose names are the user's). False when out of memory. */
bool ca_element_upgrade(ca_xml_node *node, ca_arena *arena);

/* Is this element known, may it stand inside `parent` (NULL: the root), has it all attributes it needs and no others?
 * The error names the nearest known element or attribute. */
ca_status ca_element_check(const ca_xml_node *node, const ca_xml_node *parent, ca_element_kind *kind,
                           ca_error *error);

#endif
