/* One light of each kind (several of the area kind), prepared in a scene of radius 10 around (1, 0, -1), with the
 * shapes to trace rays to, for the tests of lights and of sampling shapes. */
#ifndef CA_TEST_LIGHT_FIXTURE_H
#define CA_TEST_LIGHT_FIXTURE_H

#include "geometry/accel.h"
#include "light/light.h"

enum {
    LIGHT_SPHERE,     /* at (0, 3, 0), radius 0.7, shines outward */
    LIGHT_SPHERE_IN,  /* around the origin, radius 6, shines inward */
    LIGHT_DISK,       /* an ellipse at (-2, 3, 1) */
    LIGHT_CYLINDER,   /* near (2, 3, 1) */
    LIGHT_QUADRANGLE, /* a mesh of two triangles at y = 4, facing down, with a bitmap; no rectangle */
    LIGHT_RECTANGLE,  /* a mesh of two triangles, tilted, 2 x 1.5, around (-1, 3, 0.5) */
    LIGHT_POINT,      /* at (0.5, 4, 0.2) */
    LIGHT_SPOT,       /* at (0.3, 5, 0.1), down, 50 and 30 degrees */
    LIGHT_SPOT_SLIDE, /* the same with a bitmap */
    LIGHT_DIRECTIONAL,
    LIGHT_PROJECTOR, /* at (-0.2, 5, 0.3), down, with a bitmap that has black pixels */
    LIGHT_CONSTANT,
    LIGHT_ENVMAP, /* turned, with a few bright pixels on black */
    LIGHT_BEAM,   /* the rectangle again */
    LIGHT_COUNT,
    LIGHT_SHAPES = LIGHT_RECTANGLE + 1,
};

extern const char *const ca_test_light_names[LIGHT_COUNT];

typedef struct ca_light_fixture {
    ca_mesh meshes[2]; /* of the quadrangle and the rectangle */
    ca_image picture, environment;
    ca_texture textures[3];
    ca_shape shapes[LIGHT_SHAPES];
    ca_accel *accels[LIGHT_SHAPES]; /* each shape alone */
    ca_light lights[LIGHT_COUNT];
} ca_light_fixture;

/* Asserts on failure. */
void ca_light_fixture_create(ca_light_fixture *fixture);
void ca_light_fixture_destroy(ca_light_fixture *fixture);

/* A place that the light shines on (in front of it, or inside). */
ca_vec3 ca_light_fixture_reference(int light);

/* Where the ray meets the shape first at t > t_min, or false. */
bool ca_light_fixture_trace(const ca_light_fixture *fixture, int shape, ca_vec3 origin, ca_vec3 direction,
                            float t_min, float *t, ca_surface *surface);

#endif
