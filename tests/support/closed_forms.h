/* Scenes whose picture is known in closed form: furnaces, a sphere lit from its centre, form factors, a caustic through a
 * slab of glass. The mean over the picture is the number to find.
 *
 * Irradiance is constant in all of the closed cavities, so merging has no bias there, at any radius: on a sphere the photons
 * within the distance r of a point come from a cap whose area is exactly pi r^2. */
#ifndef CA_TEST_CLOSED_FORMS_H
#define CA_TEST_CLOSED_FORMS_H

#include "caustica.h"

#include <stdbool.h>
#include <stddef.h>

/* What an algorithm must be able to do to find all the light of a scene. */
enum {
    NEEDS_SPECULAR_VIEW = 1, /* see light through a mirror or glass: camera paths that scatter */
    NEEDS_CAUSTICS = 2,      /* a Dirac light through glass onto a diffuse surface: light paths seen by splats or merges */
    NEEDS_NARROW_VIEW = 4,   /* look at so small a place that light paths hardly ever get there */
    NEEDS_SDS = 8,           /* see such a caustic through glass: merges */
};

typedef struct closed_form {
    const char *name;
    const char *depth;   /* the scene's integrator element: a limit to path length */
    const char *sensor;  /* NULL: each of the three general ones */
    const char *content; /* shapes and lights */
    double expected;     /* mean radiance */
    double (*expect)(void); /* if not NULL: computes it instead */
    unsigned needs;
} closed_form;

size_t closed_form_count(void);
const closed_form *closed_form_at(size_t index);
double closed_form_expected(const closed_form *form);

enum { GENERAL_SENSORS = 3 };
const char *general_sensor_name(size_t sensor);

/* The scene, seen by general sensor number `sensor` unless it has its own. */
ca_scene *closed_form_scene(const closed_form *form, size_t sensor);

/* An integrator with its parameters, and what it cannot do (a set of NEEDS_...). */
typedef struct integrator_variant {
    const char *text;
    unsigned cannot;
} integrator_variant;

/* All integrators there are, with the variants whose weights differ. Merging radii suit the scenes here. */
size_t integrator_variant_count(void);
const integrator_variant *integrator_variant_at(size_t index);

#endif
