/* A second ray tracer for lenses, in the camera's space (the film at negative z, mm): spheres by their centres,
 * Snell's law by angles. Of the camera's code it uses none. */
#ifndef CA_TEST_LENS_ORACLE_H
#define CA_TEST_LENS_ORACLE_H

#include "camera/camera.h"
#include "support/double_vec.h"

typedef struct oracle_ray {
    double_vec position, direction;
} oracle_ray;

/* Three lenses of this project's own: a biconvex one of 100 mm without a stop, a cemented doublet of crown and
 * flint, and the triplet of scenes/lens. */
enum { ORACLE_SINGLET, ORACLE_DOUBLET, ORACLE_TRIPLET, ORACLE_LENSES };
ca_lens lens_oracle_make(int which);

/* Through all surfaces, away from where it comes; false: absorbed or reflected. */
bool lens_oracle_trace(const ca_lens *lens, oracle_ray *ray);

/* The film's point (camera space, mm) of the ray that leaves the camera at a point of the world in a direction. */
bool lens_oracle_film_point(const ca_camera *camera, double_vec position, double_vec direction, double_vec *film,
                            double_vec *pupil);

/* Density of that ray per area (world) and solid angle, for a film position uniform in one pixel and a point of the
 * pupil's box uniform in that: by finite differences of the trace. */
double lens_oracle_density(const ca_camera *camera, double_vec position, double_vec direction);

/* Projected solid angle of all rays that get from a film point (x, 0) through the lens, on a grid of size^2 points of
 * the last vertex' plane. */
double lens_oracle_solid_angle(const ca_realistic *camera, double film_x, int size);

#endif
