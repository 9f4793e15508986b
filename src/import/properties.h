/* The parameters of one object, asked for by name and type. Asking marks a parameter as used; ca_props_end fails at
 * one that was never asked for, and names the nearest of those that were. Every getter returns its default where the
 * parameter is missing, and also after a failure (see importer.h). */
#ifndef CA_IMPORT_PROPERTIES_H
#define CA_IMPORT_PROPERTIES_H

#include "import/import.h"
#include "import/xml_tree.h"

struct ca_importer;

enum { CA_PROPS_MAX_ASKED = 64 };

typedef struct ca_props {
    struct ca_importer *importer;
    ca_xml_node *node;
    const char *type; /* of the plugin */
    const char *asked[CA_PROPS_MAX_ASKED];
    size_t asked_count;
} ca_props;

/* How a colour is understood. Spectra become RGB by spectrum.h: reflectances and indices under D65, emission as it
 * is. Reflectances lie in [0, 1]; nothing may be negative but optical constants, whose RGB values may lie outside of
 * Rec. 709. */
typedef enum ca_color_role {
    CA_COLOR_REFLECTANCE,
    CA_COLOR_EMISSION,
    CA_COLOR_INDEX,
    CA_COLOR_SIGNED
} ca_color_role;

void ca_props_begin(ca_props *props, struct ca_importer *importer, ca_xml_node *node);
void ca_props_end(ca_props *props);

/* The parameter or named object; NULL where there is none. */
ca_xml_node *ca_props_find(ca_props *props, const char *name);

double ca_props_number(ca_props *props, const char *name, double fallback);
double ca_props_number_in(ca_props *props, const char *name, double fallback, double low, double high);
double ca_props_positive(ca_props *props, const char *name, double fallback);
int64_t ca_props_integer_in(ca_props *props, const char *name, int64_t fallback, int64_t low, int64_t high);
bool ca_props_boolean(ca_props *props, const char *name, bool fallback);
const char *ca_props_string(ca_props *props, const char *name, const char *fallback);
/* Index of the string among `choices`, letter case ignored. */
size_t ca_props_choice(ca_props *props, const char *name, const char *const *choices, size_t count, size_t fallback);
/* <point> or <vector>; false where it is missing. */
bool ca_props_point(ca_props *props, const char *name, double point[3]);
/* The identity where it is missing. */
ca_matrix ca_props_transform(ca_props *props, const char *name);
ca_rgb ca_props_color(ca_props *props, const char *name, ca_rgb fallback, ca_color_role role);
/* A colour, number, texture or reference to one. A missing parameter makes a constant of `fallback`. */
ca_texture_id ca_props_texture(ca_props *props, const char *name, float fallback, ca_color_role role);

/* The next object of this element (or one that a <ref> stands for) with the given tag, marked as used; *cursor starts
 * as NULL. NULL at the end. With a name only if `any_name`. */
ca_xml_node *ca_props_next_object(ca_props *props, const char *tag, bool any_name, ca_xml_node **cursor);

/* A failure at the parameter, or at the object where it is missing. */
void ca_props_fail(ca_props *props, const char *name, const char *message);

#endif
