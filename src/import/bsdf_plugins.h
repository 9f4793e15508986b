/* The table of all BSDF plugins, and those that hold others: ca_import_... (props, ca_material *). */
#ifndef CA_IMPORT_BSDF_PLUGINS_H
#define CA_IMPORT_BSDF_PLUGINS_H

#include "import/importer.h"

/* In bsdfs.c, beside those that scatter by themselves. */
const ca_plugin *ca_import_bsdf_plugins(size_t *count);

/* Interior over exterior index, by default of glass in air. */
float ca_import_glass_index(ca_props *props);
/* One roughness, a number: a table of transmittances is made for it. */
void ca_import_one_roughness(ca_props *props, ca_material_facets *facets);

void ca_import_twosided(ca_props *props, void *result);
void ca_import_mask(ca_props *props, void *result);
void ca_import_blend(ca_props *props, void *result);
void ca_import_mixture(ca_props *props, void *result);
void ca_import_bump(ca_props *props, void *result);
void ca_import_normal_map(ca_props *props, void *result);
void ca_import_coating(ca_props *props, void *result);
void ca_import_rough_coating(ca_props *props, void *result);

#endif
