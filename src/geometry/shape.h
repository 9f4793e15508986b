/* Shapes as the renderer sees them: triangle meshes; spheres, disks and cylinders that are exact, not tessellated
 * (quadrics); round curves; where a distance sampled on a grid is zero.
 *
 * Frame: world, or the shape group's space for the members of a group. Normals: the mesh's winding (corner order
 * counter-clockwise seen from outside); spheres, cylinders, curves and grids outward; disks +z; all but
 * curves' reversed by `flip_normals`.
 * Shapes are immutable once compiled and shared by all threads. */
#ifndef CA_GEOMETRY_SHAPE_H
#define CA_GEOMETRY_SHAPE_H

#include "geometry/mesh.h"
#include "geometry/rectangle.h"
#include "math/frame.h"
#include "math/measure.h"
#include "sampling/distribution.h"

#define CA_NONE UINT32_MAX

typedef enum ca_shape_kind {
    CA_SHAPE_MESH,
    CA_SHAPE_SPHERE,
    CA_SHAPE_DISK,
    CA_SHAPE_CYLINDER,
    CA_SHAPE_CURVE,
    CA_SHAPE_SDF_GRID,
    CA_SHAPE_KIND_COUNT
} ca_shape_kind;

typedef struct ca_curve ca_curve;       /* curve.h */
typedef struct ca_sdf_grid ca_sdf_grid; /* sdf_grid.h */

typedef struct ca_shape {
    ca_shape_kind kind;
    bool flip_normals;   /* quadrics and grids; a mesh is flipped when it is compiled */
    bool needs_tangents; /* its material uses dpdu, dpdv */
    bool skips_uv;       /* shapes that need no tangents and are no mesh: nobody asks for uv, which stays 0 */
    uint32_t material;   /* index in the scene's materials */
    uint32_t light;      /* index in the scene's lights, or CA_NONE */
    float area;          /* m^2 */
    union {              /* the member of the kind's name */
        struct {
            const ca_mesh *mesh;          /* borrowed */
            float extent;                 /* largest absolute value of a coordinate */
            ca_distribution_1d triangles; /* by area; this and the next only for meshes that emit */
            ca_rectangle rectangle;
        } mesh;
        struct {
            ca_affine map; /* from the unit sphere; scales uniformly */
            ca_vec3 center;
            float radius;
        } sphere;
        struct {
            ca_affine map; /* from the unit disk in z = 0 */
        } disk;
        struct {
            ca_affine map; /* from the cylinder of radius 1 around z from z = 0 to 1; one radius, one length */
            float radius;
            float length;
        } cylinder;
        struct {
            const ca_curve *curve; /* borrowed; curves emit no light */
        } curve;
        struct {
            const ca_sdf_grid *grid; /* borrowed; grids emit no light */
        } sdf;
    } as;
} ca_shape;

/* A point of a surface, with what is needed to leave it and to shade it. World space. */
typedef struct ca_surface {
    ca_vec3 position;
    ca_vec3 position_error; /* bound on the rounding error of each coordinate */
    ca_vec3 ng;             /* geometric normal, unit, on the side of ns; the shape's outside unless ns disagrees */
    ca_vec3 ns;             /* shading normal, unit */
    ca_vec3 dpdu, dpdv;     /* only where shape.needs_tangents; zero elsewhere */
    ca_vec2 uv;             /* zero where shape.skips_uv */
    ca_vec2 barycentric; /* of corners 1 and 2 (meshes); the place along a curve's segment, and 0 */
    const ca_mesh *mesh; /* NULL for other shapes */
    uint32_t shape, primitive, instance; /* instance: CA_NONE outside of instances */
    uint32_t material, light;            /* as the shape's */
} ca_surface;

/* A ray origin that is off the surface on the side of `direction` by the rounding error of the position, so that a
 * ray from it never meets the surface it starts on. No epsilon: the distance follows from position_error. */
ca_vec3 ca_offset_origin(ca_vec3 position, ca_vec3 position_error, ca_vec3 ng, ca_vec3 direction);

/* A point uniform by area over a shape, in the shape's own space; fills position, position_error, ng, ns, uv,
 * barycentric, primitive (instance CA_NONE) and returns its density 1/area. */
ca_pdf_area ca_shape_sample_area(const ca_shape *shape, ca_vec2 u, ca_surface *surface);

/* A point seen from `reference`, uniform in the solid angle where the shape allows that and it is worth while
 * (spheres from outside: the cone; rectangles that are not too small), else by area. *by_solid_angle gets the density
 * of the first, and 0 says that it was the second, with the density 1/area. */
void ca_shape_sample_seen(const ca_shape *shape, ca_vec3 reference, ca_vec2 u, ca_surface *surface,
                          ca_pdf_solid_angle *by_solid_angle);
/* The same density without a sample: a function of shape and reference, the same for all points that are seen. */
ca_pdf_solid_angle ca_shape_pdf_seen(const ca_shape *shape, ca_vec3 reference);

/* The same with the density at `reference` in either case, 0 where there is none. Agrees with ca_shape_pdf_direct for
 * the same point. */
ca_pdf_solid_angle ca_shape_sample_direct(const ca_shape *shape, ca_vec3 reference, ca_vec2 u, ca_surface *surface);
/* The density with which ca_shape_sample_direct picks `position` (on the shape, geometric normal ng) from
 * reference. */
ca_pdf_solid_angle ca_shape_pdf_direct(const ca_shape *shape, ca_vec3 reference, ca_vec3 position, ca_vec3 ng);

/* Flat ones, that do not look curved either: disks, and rectangles that emit and have no other normals at their
 * corners. */
bool ca_shape_is_flat(const ca_shape *shape);
/* The point of a flat shape from which a perpendicular goes to `reference`; false where there is none. */
bool ca_shape_foot(const ca_shape *shape, ca_vec3 reference, ca_surface *surface);

/* World bounds (of the group's space). */
void ca_shape_bounds(const ca_shape *shape, ca_vec3 *low, ca_vec3 *high);

#endif
