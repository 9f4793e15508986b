/* A lens of spherical surfaces: rays through it, and where it forms images.
 *
 * Frame: all lengths in mm. The axis is the w axis; light travels from the scene at negative w through the first
 * surface, whose vertex is w = 0, towards the film at positive w. x and y are those of the camera's space
 * (camera.h), so that camera space's z is -w. A radius is positive where the centre of curvature lies on the film's
 * side.
 *
 * The trace is that of Feder 1951, "Optical Calculations with Automatic Computing Machinery": each surface is met
 * from its vertex' plane, by the one formula for planes and spheres. It is in double precision: a pixel is some
 * thousandths of a millimetre, behind radii of hundreds. There are no reflections and there is no dispersion: every
 * surface lets all light through, and has one index of refraction. Light that falls on a surface outside of its
 * aperture is absorbed, and so is light where surfaces cross: where it would have to go back to the next one.
 * Surfaces may touch, in a point or everywhere. */
#ifndef CA_CAMERA_LENS_H
#define CA_CAMERA_LENS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct ca_lens_surface {
    double radius;    /* of curvature; 0: a plane */
    double thickness; /* to the next surface's vertex along the axis, >= 0; of the last one it means nothing */
    double index;     /* of refraction, behind the surface; that of a stop is the index before it */
    double aperture;  /* radius of the part that lets light through, at most |radius| */
} ca_lens_surface;

enum { CA_LENS_MAX_SURFACES = 64 };

typedef struct ca_lens {
    ca_lens_surface surfaces[CA_LENS_MAX_SURFACES]; /* [0]: towards the scene; air before it and behind the last */
    uint32_t count;
} ca_lens;

typedef struct ca_lens_ray {
    double x, y, w;    /* a point of the ray */
    double dx, dy, dw; /* direction, unit */
} ca_lens_ray;

/* How far the surface's rim lies behind its vertex. */
double ca_lens_sag(const ca_lens_surface *surface);

/* From the first surface's vertex to the last one's. */
double ca_lens_length(const ca_lens *lens);

/* A ray that starts before the lens, on the film's side (dw < 0) or the scene's (dw > 0), through all surfaces: it
 * then starts at the one it left last. false, with the ray undefined: absorbed, or reflected totally. Both directions
 * take the same ways: what comes out, sent back, comes out where the ray began. */
bool ca_lens_trace(const ca_lens *lens, ca_lens_ray *ray);

/* What becomes of a ray at a surface. */
typedef enum ca_lens_end {
    CA_LENS_PASSED,
    CA_LENS_BESIDE,   /* it does not meet the surface, or outside of the aperture */
    CA_LENS_CROSSED,  /* the surface crosses the one that the ray comes from: it lies behind the ray there */
    CA_LENS_REFLECTED /* totally, or it runs back from the surface */
} ca_lens_end;

/* The same, and at which surface the ray ends, or which it passed last. */
ca_lens_end ca_lens_trace_to_end(const ca_lens *lens, ca_lens_ray *ray, uint32_t *surface);

/* Paraxial optics: rays that stay close to the axis. */
typedef struct ca_lens_image {
    double distance;      /* of the image, behind the last surface's vertex; infinite where rays leave parallel */
    double magnification; /* of the image, negative where it is upside down; 0 for an object at infinity */
} ca_lens_image;

/* Of a point of the axis at `distance` > 0 before the first surface, or at infinity. */
ca_lens_image ca_lens_image_of(const ca_lens *lens, double distance);

/* Points of the axis that are farther from the first surface have an image behind a lens that collects light. */
double ca_lens_nearest(const ca_lens *lens);

/* Positive where the lens collects light; infinite where it has no power. */
double ca_lens_focal_length(const ca_lens *lens);

#endif
