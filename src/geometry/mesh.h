/* Triangle meshes in world space (or in the space of their shape group).
 *
 * Layout: positions[3 v + i], normals likewise or NULL, uvs[2 v + i] or NULL; indices[3 t + k] < vertex_count.
 * Attributes are further per-vertex or per-face values ("vertex_color", "face_color"), read by textures.
 * State: 12 bytes per triangle for indices, 12 per vertex for positions, 12 for normals, 8 for uvs; about half as
 * many vertices as triangles in a closed mesh. Owner: whoever created it or was given a share; Embree borrows
 * positions and indices. Arrays may also be a program's (ca_mesh_lender), which keeps them as they are.
 *
 * What goes through all vertices or triangles of a large mesh does so on all processors; no bit depends on how many
 * there are. */
#ifndef CA_GEOMETRY_MESH_H
#define CA_GEOMETRY_MESH_H

#include "base/status.h"
#include "math/transform.h"

#include <stdatomic.h>
#include <stddef.h>

typedef struct ca_mesh_attribute {
    char *name;          /* owned; "vertex_..." or "face_..." */
    uint32_t components; /* 1 to 4 */
    bool per_face;
    float *values; /* owned; components * (vertices or triangles) */
} ca_mesh_attribute;

/* A program whose arrays are used in place. It is told when the last of its users is gone. */
typedef struct ca_mesh_lender {
    atomic_uint users;
    void (*release)(void *user);
    void *user;
} ca_mesh_lender;

/* Arrays that are lent, as bits. */
enum { CA_MESH_POSITIONS = 1, CA_MESH_UVS = 2, CA_MESH_INDICES = 4 };

typedef struct ca_mesh_owners {
    atomic_uint count;
    ca_mesh_lender *lender; /* a user's share of it; NULL: nothing is lent */
    unsigned lent;
} ca_mesh_owners;

typedef struct ca_mesh {
    uint32_t vertex_count, triangle_count;
    float *positions; /* 3 floats a vertex, and one float of padding at the very end: Embree reads 16 bytes */
    float *normals;   /* unit, or zero where the file's are; NULL: the faces' own normals */
    float *uvs;       /* NULL: barycentric coordinates */
    uint32_t *indices;
    ca_mesh_attribute *attributes;
    uint32_t attribute_count;
    uint64_t content_hash; /* of the file it was read from; 0: none */
    ca_mesh_owners *owners; /* of all arrays */
    /* Of a mesh that lies where its scene has it: what it was made of, that is file or arrays, parameters and place
     * (0: not told), its area and its bounds. */
    bool placed;
    uint64_t made_of;
    double area;
    ca_vec3 low, high;
} ca_mesh;

/* Allocates zeroed positions and indices, and normals and uvs where asked. Limits: 2^31 - 1 vertices, 2^30
 * triangles. */
ca_status ca_mesh_create(ca_mesh *mesh, size_t vertex_count, size_t triangle_count, bool normals, bool uvs,
                         ca_error *error);
/* Nothing but owners, of a mesh whose arrays are then set one by one; the same limits. */
ca_status ca_mesh_begin(ca_mesh *mesh, size_t vertex_count, size_t triangle_count, ca_error *error);
void ca_mesh_destroy(ca_mesh *mesh);
/* Another owner of the same arrays, which never change from then on. */
ca_mesh ca_mesh_share(const ca_mesh *mesh);

/* With one user. NULL when out of memory. */
ca_mesh_lender *ca_mesh_lender_create(void (*release)(void *user), void *user);
void ca_mesh_lender_drop(ca_mesh_lender *lender); /* a user less; NULL is allowed */
/* Notes that these arrays of a new mesh are the lender's. */
void ca_mesh_borrow(ca_mesh *mesh, ca_mesh_lender *lender, unsigned lent);

/* The mesh's own arrays of these become lent ones that its copies can share, and are freed with the last user. One
 * that has a lender stays as it is. */
ca_status ca_mesh_lend(ca_mesh *mesh, unsigned lent, ca_error *error);
/* A new mesh of the same values. Arrays in `shared` that `from` borrows are borrowed again, the others are copied. */
ca_status ca_mesh_copy(const ca_mesh *from, unsigned shared, ca_mesh *mesh, ca_error *error);

/* The array itself where it is lent; else a copy of its `count` numbers of four bytes with one of 0 behind them,
 * made on all processors. NULL where `values` is, or when out of memory. Numbers are missing once loading is not
 * wanted any more (base/loading.h), which is to be asked. */
void *ca_mesh_take_array(const void *values, size_t count, bool lent);

/* Adds a zeroed attribute; *values is borrowed from the mesh. */
ca_status ca_mesh_add_attribute(ca_mesh *mesh, const char *name, uint32_t components, bool per_face, float **values,
                                ca_error *error);
/* Texture coordinates of the corners, uvs[2 (3 t + k) + i]: a vertex whose corners have several is split, normals and
 * attributes with it; new vertices come last. Indices must be in range. A mesh that fails can only be destroyed. */
ca_status ca_mesh_set_corner_uvs(ca_mesh *mesh, const float *uvs, ca_error *error);

/* NULL where there is none of that name. */
const ca_mesh_attribute *ca_mesh_find_attribute(const ca_mesh *mesh, const char *name);

/* Maps positions and normals; a map that mirrors swaps two corners of every triangle, so that the outside stays
 * outside. The identity only makes normals unit, and so leaves arrays alone that are lent. */
void ca_mesh_transform(ca_mesh *mesh, const ca_affine *map);
void ca_mesh_flip_normals(ca_mesh *mesh);
void ca_mesh_normalize_normals(ca_mesh *mesh); /* to unit length; zero stays zero */
void ca_mesh_drop_normals(ca_mesh *mesh); /* face_normals */
/* Are all vertex normals those of the faces, up to the rounding of normals and corners? */
bool ca_mesh_normals_are_flat(const ca_mesh *mesh);

/* Smooth normals for files that carry none: at each vertex the faces' unit normals weighted by their angle there, as
 * Mitsuba does (Thürmer and Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets"); zero where only faces
 * without area meet. By so many threads, 0: one per processor; the bits do not depend on it. CA_ERROR_MEMORY: the
 * mesh has no normals then. */
ca_status ca_mesh_compute_normals(ca_mesh *mesh, uint32_t threads, ca_error *error);

double ca_mesh_triangle_area(const ca_mesh *mesh, uint32_t triangle);
/* Of all vertices, as they are now. Incomplete once loading is not wanted any more; likewise: */
void ca_mesh_bounds(const ca_mesh *mesh, ca_vec3 *low, ca_vec3 *high);
/* Sets the area and the bounds. */
void ca_mesh_measure(ca_mesh *mesh);
size_t ca_mesh_bytes(const ca_mesh *mesh);

/* Checks what every other part relies on: indices in range, all numbers finite. `path` names the file in errors.
 * CA_ERROR_INTERRUPTED: loading is not wanted any more, and not all was checked. */
ca_status ca_mesh_validate(const ca_mesh *mesh, const char *path, ca_error *error);

/* Mitsuba's unit shapes: the square [-1, 1]^2 in z = 0 facing +z with uv over [0, 1]^2, and the cube [-1, 1]^3 with
 * face normals and the same uv on each face. */
ca_status ca_mesh_create_rectangle(ca_mesh *mesh, ca_error *error);
ca_status ca_mesh_create_cube(ca_mesh *mesh, ca_error *error);
/* Round shapes where an exact one will not do, with smooth normals and the uv of the exact ones; the mesh's corners
 * lie on the surface. 128 segments around, and for a sphere 64 from pole to pole: radii are short by 3e-4 at most. */
ca_status ca_mesh_create_sphere(ca_mesh *mesh, const double center[3], float radius, ca_error *error);
/* The side of the unit cylinder, radius 1 around z from 0 to 1, mapped by the frame. */
ca_status ca_mesh_create_cylinder(ca_mesh *mesh, const ca_matrix *frame, ca_error *error);

#endif
