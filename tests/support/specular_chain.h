/* A row of mirrors and refracting surfaces in double precision, through which a ray is traced: planes and spheres,
 * nothing else. How the map from the first direction to the last point stretches is found by finite differences, with
 * no formula for it. */
#ifndef CA_TEST_SPECULAR_CHAIN_H
#define CA_TEST_SPECULAR_CHAIN_H

#include "support/double_vec.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct chain_surface {
    bool sphere;
    double_vec place;  /* a point of the plane, or the sphere's centre */
    double_vec normal; /* of the plane, unit */
    double radius;
    double_vec met; /* where the path meets it: of a sphere's two points the one nearer to this */
    /* What happens there; of no concern at the last surface. */
    bool reflects;
    double eta; /* refraction: index of the side where the ray goes over that of the side where it came from */
} chain_surface;

/* Square metres of the last surface for a steradian at `origin`, for rays that start near `direction`. */
double chain_area_per_solid_angle(const chain_surface *chain, uint32_t count, double_vec origin,
                                 double_vec direction);

#endif
