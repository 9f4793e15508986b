/* Rectangles: meshes of two triangles that form one, and points of them by solid angle as seen from a point.
 *
 * Seen from somewhere a rectangle is a spherical rectangle. ca_spherical_rectangle_sample maps the unit square to it
 * so that equal areas go to equal solid angles, without rejection and continuously: stratified numbers stay
 * stratified. The map is that of Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical
 * Rectangles".
 *
 * In double precision: the solid angle is an excess over 2 pi, and of a small one little else would be left. Pure
 * functions. */
#ifndef CA_GEOMETRY_RECTANGLE_H
#define CA_GEOMETRY_RECTANGLE_H

#include "geometry/mesh.h"

#include <stdbool.h>

typedef struct ca_rectangle {
    bool exists;
    uint8_t right_angle[2]; /* which corner of triangle 0 and of triangle 1 is not on the diagonal */
    ca_vec3 corner;         /* that of triangle 0 */
    ca_vec3 x, y, n;        /* unit, from `corner` along both sides, and x cross y */
    float width, height;    /* along x and y */
    ca_vec3 center;
    float large_distance2;  /* from the centre: seen from farther away it is sampled by area */
} ca_rectangle;

/* Does not exist where the mesh is anything else, or misses being one by more than 1e-5 of its sides. */
ca_rectangle ca_rectangle_from_mesh(const ca_mesh *mesh);

/* The triangle and its barycentric coordinates (of corners 1 and 2) at (s, t) in [0, 1]^2 along x and y. */
uint32_t ca_rectangle_triangle(const ca_rectangle *rectangle, ca_vec2 st, ca_vec2 *barycentric);

/* The rectangle in the frame (x, y, away) of a reference, on the plane z = -distance. */
typedef struct ca_spherical_rectangle {
    double x0, x1, y0, y1, distance;
    double solid_angle; /* sr */
    double b0, b1, k;   /* of the map, as the paper names them */
} ca_spherical_rectangle;

/* false: seen so small or so nearly edge-on that points uniform by area do as well, or that the map would lose its
 * digits. A function of the rectangle and the reference alone. */
bool ca_spherical_rectangle_from(const ca_rectangle *rectangle, ca_vec3 reference, ca_spherical_rectangle *seen);

/* false where the former is false for sure: a quick look from far away. */
static inline bool ca_rectangle_may_look_large(const ca_rectangle *rectangle, ca_vec3 reference)
{
    return rectangle->exists && ca_length2(ca_sub(reference, rectangle->center)) < rectangle->large_distance2;
}

/* (s, t) in [0, 1]^2, uniform by solid angle. */
ca_vec2 ca_spherical_rectangle_sample(const ca_spherical_rectangle *seen, ca_vec2 u);

#endif
