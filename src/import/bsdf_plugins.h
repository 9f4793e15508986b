/* The BSDF plugins, one function each: ca_import_... (props, ca_material *). */
#ifndef CA_IMPORT_BSDF_PLUGINS_H
#define CA_IMPORT_BSDF_PLUGINS_H

#include "import/importer.h"

void ca_import_diffuse(ca_props *props, void *result);
void ca_import_dielectric(ca_props *props, void *result);
void ca_import_thin_dielectric(ca_props *props, void *result);
void ca_import_rough_dielectric(ca_props *props, void *result);
void ca_import_conductor(ca_props *props, void *result);
void ca_import_rough_conductor(ca_props *props, void *result);
void ca_import_plastic(ca_props *props, void *result);
void ca_import_rough_plastic(ca_props *props, void *result);
void ca_import_principled(ca_props *props, void *result);
void ca_import_null(ca_props *props, void *result);

#endif
