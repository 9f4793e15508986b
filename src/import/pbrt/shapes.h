/* What the files of pbrt's shapes share. */
#ifndef CA_IMPORT_PBRT_SHAPES_H
#define CA_IMPORT_PBRT_SHAPES_H

#include "import/pbrt/reader.h"

/* Lights that shine on both sides are two surfaces, so far apart in parts of their size. */
#define CA_PBRT_THICKNESS 2e-5

/* ---- What all shapes have (shapes.c) --------------------------------------------------------------------------- */

/* Does the area light that was said last shine on the shapes that follow? Version 4 has no lights on surfaces that
 * are nothing. */
bool ca_pbrt_shines(const ca_pbrt *p);
/* Does it, from both sides? That is then noted. */
bool ca_pbrt_is_two_sided(ca_pbrt *p);

/* A shape of the tree, in the world or in the object that is being defined, with material and light. `area` is that
 * of the shape in the world, where a light's power depends on it. */
ca_xml_node *ca_pbrt_add_shape(ca_pbrt *p, const char *type, const ca_matrix *to_world, bool flips, double area);

/* ---- Kinds, from the parameters of the directive --------------------------------------------------------------- */

/* mesh_shapes.c */
void ca_pbrt_read_triangles(ca_pbrt *p);
void ca_pbrt_read_patches(ca_pbrt *p);
void ca_pbrt_read_subdivision(ca_pbrt *p);
void ca_pbrt_read_heights(ca_pbrt *p);
void ca_pbrt_read_ply(ca_pbrt *p);
/* Takes the mesh over, as a shape under the current transform. */
void ca_pbrt_put_mesh_flipped(ca_pbrt *p, ca_mesh *mesh, bool flips);

/* quadrics.c */
void ca_pbrt_read_sphere(ca_pbrt *p);
void ca_pbrt_read_cylinder(ca_pbrt *p);
void ca_pbrt_read_disk(ca_pbrt *p);
void ca_pbrt_read_cone(ca_pbrt *p);
void ca_pbrt_read_paraboloid(ca_pbrt *p);
void ca_pbrt_read_hyperboloid(ca_pbrt *p);

#endif
