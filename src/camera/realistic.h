/* The realistic camera: a lens of spherical surfaces (lens.h) in front of a film.
 *
 * The first surface's vertex is the camera's origin; the film lies behind the last one, and focusing moves the film.
 * Lengths are in mm, as `scale` of the scene's units each.
 *
 * Importance. Radiance does not change along a ray through the lens, and neither does etendue:
 *     dA_film cos_film dw_film = dA cos dw
 * for any plane across the axis in the scene's space. So a pixel's value is the integral over that plane and all
 * directions of We L cos, where We = 1 / (area of the pixel * Omega) is the same for all rays that get to the film.
 * Omega is the projected solid angle of the exit pupil as the film's centre sees it: a scene of the radiance 1 has
 * the value 1 there, and less elsewhere, by the fourth power of the cosine and by rims that stand in the way
 * (vignetting).
 *
 * Two ways to choose a ray:
 *     rays    a point of the film, then one of a box on the plane of the last surface's vertex. The box bounds the
 *             exit pupil as seen from the film's ring (a distance from the axis), and turns with the point.
 *     splats  a point of the entrance disk: of all disks around the axis, on planes that cut the lens, the smallest
 *             one that all rays of the film pass when they are produced straight from the scene into the lens. Then
 *             the line from the scene's point through it is traced to the film.
 * A ray's origin is its point of the entrance disk, which lies inside the lens: nothing of the scene is looked for
 * before the near clip plane. Boxes and disk are found by tracing; a ray outside of either is absorbed, whichever way
 * it was chosen, so that all estimators see the same lens.
 * A model of the kind of Kolb, Mitchell and Hanrahan 1995, "A Realistic Camera Model for Computer Graphics", with
 * boxes for the exit pupil as pbrt has them (Pharr, Jakob and Humphreys 2016). The entrance disk is ours. */
#ifndef CA_CAMERA_REALISTIC_H
#define CA_CAMERA_REALISTIC_H

#include "camera/lens.h"
#include "math/vec.h"

struct ca_camera;
struct ca_camera_ray;
struct ca_camera_direct;

/* Part of the last vertex' plane for a film point at (radius, 0): [low, high] along x, [-side, side] along y. Empty
 * where high < low. */
typedef struct ca_pupil_box {
    double low, high, side;
} ca_pupil_box;

enum { CA_PUPIL_RINGS = 32 };

typedef struct ca_realistic {
    ca_lens lens;
    double film_diagonal;
    double film_distance; /* behind the last surface's vertex */
    double scale;         /* the scene's length of a millimetre */

    /* Made by ca_realistic_prepare. */
    double last_w, film_w;      /* of the last surface's vertex and of the film */
    double disk_w, disk_radius; /* the entrance disk */
    double pupil_radius;        /* of the exit pupil on the last vertex' plane, as the film's centre sees it */
    double solid_angle;         /* Omega */
    double ring_width;
    ca_pupil_box rings[CA_PUPIL_RINGS]; /* by the film point's distance from the axis; the last one for all beyond */
} ca_realistic;

/* Omega, of what need not be prepared. */
double ca_realistic_solid_angle(const ca_realistic *camera);

/* Fills what is made; the camera's pixel_width, pixel_height, left and top are known. Some hundredths of a second. */
void ca_realistic_prepare(struct ca_camera *camera);

/* Does no light get through, from anywhere to any point of the film? Then the surface and the end there of rays next
 * to the axis. What is made need not be. Vertices are in their order on the axis, so that rays next to it pass where
 * any do; a pupil of less than 1e-5 of what the film's centre sees of the last surface is none: so wide do surfaces
 * touch that cross in their vertex. */
bool ca_realistic_is_dark(const ca_realistic *camera, uint32_t *surface, ca_lens_end *end);

/* As ca_camera_sample_ray. */
struct ca_camera_ray ca_realistic_ray(const struct ca_camera *camera, ca_vec2 film_position, ca_vec2 u_lens);

/* As ca_camera_sample_direct for a point in camera space, whatever the film's size; false: nothing gets through. */
bool ca_realistic_direct(const struct ca_camera *camera, ca_vec3 local, ca_vec2 u_lens,
                         struct ca_camera_direct *direct);

#endif
