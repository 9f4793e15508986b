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

/* Below this, in sr, the density of points chosen by area varies by a tenth at most, and they cost much less. */
#define CA_SMALLEST_SOLID_ANGLE 0.2f

typedef struct ca_rectangle {
    bool exists;
    bool is_plain;          /* no vertex normals, and its corners are a parallelogram's but for their rounding */
    uint8_t right_angle[2]; /* which corner of triangle 0 and of triangle 1 is not on the diagonal */
    ca_vec3 corner;         /* that of triangle 0; likewise its others: */
    ca_vec3 end_x, end_y;
    ca_vec3 x, y, n;        /* unit, from `corner` along both sides, and x cross y */
    float width, height;    /* along x and y */
    ca_vec3 center;
    float half_diagonal;
    float large_distance2;  /* from the centre: seen from farther away it is sampled by area */
} ca_rectangle;

/* Bound on the rounding of each coordinate of a plain rectangle's point, over that of a triangle's points with the
 * same corners: the weights of the corners may add up to 3 and the fourth corner has a rounding of its own. */
#define CA_RECTANGLE_ERROR 4.0f

/* Does not exist where the mesh is anything else, or misses being one by more than 1e-5 of its sides, or 1e-4 where
 * that is the rounding of its coordinates. */
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

/* false where the former is false for sure, by an upper bound of the solid angle. */
static inline bool ca_rectangle_may_look_large(const ca_rectangle *rectangle, ca_vec3 reference)
{
    const ca_vec3 away = ca_sub(reference, rectangle->center);
    const float distance2 = ca_length2(away);
    if (!rectangle->exists || distance2 > rectangle->large_distance2) return false;
    /* width height |cos| / distance^2 for the nearest point that the rectangle can have, and a little more. */
    const float nearest = sqrtf(distance2) - rectangle->half_diagonal;
    if (!(nearest > 0.0f)) return true;
    return rectangle->width * rectangle->height * ca_abs_dot(rectangle->n, away) * 1.01f >
           CA_SMALLEST_SOLID_ANGLE * nearest * nearest * nearest;
}

/* (s, t) in [0, 1]^2, uniform by solid angle. */
ca_vec2 ca_spherical_rectangle_sample(const ca_spherical_rectangle *seen, ca_vec2 u);

#endif
