/* Surfaces where a signed distance, sampled on a grid, is zero.
 *
 * The samples lie on a regular grid over the unit cube, the first and the last of an axis on its faces. In a voxel, a
 * box between eight samples, the distance is their trilinear interpolant: a ray meets the surface at a root of a
 * cubic. The outside is where the distance is positive; the surface ends at the cube's faces.
 *
 * Layout: values[(z ny + y) nx + x]. Space: the map goes from grid coordinates, in which samples are 1 apart, to the
 * world, or a group's space. Source: Mitsuba 3's sdfgrid, whose hits and normals are the measure here. */
#ifndef CA_GEOMETRY_SDF_GRID_H
#define CA_GEOMETRY_SDF_GRID_H

#include "geometry/shape.h"

#include <stdatomic.h>
#include <stddef.h>

struct ca_sdf_grid {
    atomic_uint owners;
    uint32_t count[3];     /* samples along x, y and z, at least 2 */
    float *values;
    uint32_t *voxels;      /* those that hold some of the surface, by x first */
    uint32_t voxel_count;
    bool smooth;           /* shading normals are blended between voxels, else those of the voxel itself */
    uint64_t content_hash; /* of the file it was read from; 0: none */
    bool placed;
    double to[3][4], from[3][4]; /* of a placed one: the map and its inverse */
    ca_vec3 low, high;
};

/* Zeroed samples, with one owner. Errors: CA_ERROR_MEMORY, CA_ERROR_UNSUPPORTED beyond 2^30 samples. */
ca_status ca_sdf_grid_create(const uint32_t count[3], ca_sdf_grid **grid, ca_error *error);
/* Lists the voxels, once the samples are there. Errors: CA_ERROR_MEMORY, CA_ERROR_FORMAT where there are none. */
ca_status ca_sdf_grid_finish(ca_sdf_grid *grid, ca_error *error);
ca_sdf_grid *ca_sdf_grid_share(const ca_sdf_grid *grid); /* one owner more */
void ca_sdf_grid_destroy(ca_sdf_grid *grid);             /* an owner less; NULL is allowed */

/* Sets the map from the unit cube to the world. False: it has no inverse, or leads too far away. */
bool ca_sdf_grid_place(ca_sdf_grid *grid, const ca_matrix *to_world);
size_t ca_sdf_grid_bytes(const ca_sdf_grid *grid);
bool ca_sdf_grid_equal(const ca_sdf_grid *a, const ca_sdf_grid *b); /* to rays, to the bit */

/* World bounds of a voxel, by its place in `voxels`. */
void ca_sdf_grid_voxel_bounds(const ca_sdf_grid *grid, uint32_t listed, ca_vec3 *low, ca_vec3 *high);
/* Nearest t in (t_min, t_max) at which the ray meets the surface in a voxel, by its place in `voxels`. */
bool ca_sdf_grid_intersect(const ca_sdf_grid *grid, uint32_t listed, ca_vec3 origin, ca_vec3 direction, float t_min,
                           float t_max, float *t);
/* The surface point nearest to `position`, which is on the surface but for rounding, in a voxel, by its place in
 * `voxels`. Fills position, position_error, ng, ns, uv (0, as in Mitsuba), and dpdu, dpdv across ns where the shape
 * needs them. */
void ca_sdf_grid_surface(const ca_shape *shape, uint32_t listed, ca_vec3 position, ca_surface *surface);

#endif
