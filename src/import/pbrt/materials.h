/* What the files of pbrt's materials share. */
#ifndef CA_IMPORT_PBRT_MATERIALS_H
#define CA_IMPORT_PBRT_MATERIALS_H

#include "import/pbrt/reader.h"

typedef struct ca_pbrt_material_kind {
    const char *name;
    void (*read)(ca_pbrt *p, const char *id); /* makes the BSDF of that id, from the directive's parameters */
} ca_pbrt_material_kind;

/* Version 3's. */
const ca_pbrt_material_kind *ca_pbrt_old_materials(size_t *count);

/* The BSDF in what is around it: a mask (of an opacity that is not NULL and not 1), both sides, the directive's bump
 * and normal maps. The outermost has the id. The BSDF's own node. */
ca_xml_node *ca_pbrt_begin_bsdf(ca_pbrt *p, const char *id, const char *type, bool two_sided,
                                const ca_pbrt_value *opacity);

/* Widths of GGX along u and v. */
typedef struct ca_pbrt_roughness {
    ca_pbrt_value u, v;
    bool is_smooth;
} ca_pbrt_roughness;

/* The parameters of these names: for both, u and v; `to_alpha` where remaproughness says so. */
ca_pbrt_roughness ca_pbrt_read_roughness(ca_pbrt *p, const char *const names[3], double fallback,
                                         double (*to_alpha)(double));
/* Version 3's. */
double ca_pbrt_old_alpha(double roughness);
void ca_pbrt_put_alpha(ca_pbrt *p, ca_xml_node *object, const ca_pbrt_roughness *roughness);
/* A coat has one roughness for both directions. */
void ca_pbrt_put_coat_alpha(ca_pbrt *p, ca_xml_node *bsdf, const ca_pbrt_roughness *roughness);
/* Does an index of refraction, in vacuum, make a boundary? Without one light goes straight on, however rough. */
static inline bool ca_pbrt_is_boundary(double index) { return (float)index != 1.0f; }
/* int_ior, in vacuum. */
void ca_pbrt_put_index(ca_pbrt *p, ca_xml_node *object, double index);
/* Of copper, the metal of materials that name none. */
void ca_pbrt_copper(double eta[3], double k[3]);

#endif
