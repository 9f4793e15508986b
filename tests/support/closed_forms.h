/* Scenes whose picture is known in closed form: furnaces, a sphere lit from its centre, form factors, a caustic
 * through a slab of glass. The mean over the picture is the number to find. */
#ifndef CA_TEST_CLOSED_FORMS_H
#define CA_TEST_CLOSED_FORMS_H

#include "caustica.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What an algorithm must be able to do to find all the light of a scene. */
enum {
    NEEDS_SPECULAR_VIEW = 1, /* see light through a mirror or glass: camera paths that scatter */
    NEEDS_CAUSTICS = 2, /* a Dirac light through glass onto a diffuse surface: light paths seen by splats or merges */
    NEEDS_NARROW_VIEW = 4, /* look at so small a place that light paths hardly ever get there */
    NEEDS_SDS = 8,         /* see such a caustic through glass: merges */
    NEEDS_LIGHT_PATHS = 16, /* find direct light by light paths */
};

typedef struct closed_form {
    const char *name;
    const char *depth;   /* the scene's integrator element: a limit to path length */
    const char *sensor;  /* NULL: each of the three general ones */
    const char *content; /* shapes and lights */
    double expected;     /* mean radiance */
    double (*expect)(void); /* if not NULL: computes it instead */
    unsigned needs;
    float radius; /* of merges: without bias, or with one that does not matter */
} closed_form;

/* All integrators there are, with the variants whose weights differ; "%g" stands for the radius. */
typedef struct integrator_variant {
    const char *text;
    unsigned cannot; /* a set of NEEDS_... */
    uint32_t step;   /* samples per pixel are a multiple of it */
    bool in_turns;   /* sensors and samplers always take turns: all of them would take hours */
} integrator_variant;

size_t integrator_variant_count(void);
const integrator_variant *integrator_variant_at(size_t index);

size_t closed_form_count(void);
const closed_form *closed_form_at(size_t index);
const closed_form *closed_form_named(const char *name);
double closed_form_expected(const closed_form *form);

enum { GENERAL_SENSORS = 3 };
const char *general_sensor_name(size_t sensor);

/* The scene, seen by general sensor number `sensor` unless it has its own. */
ca_scene *closed_form_scene(const closed_form *form, size_t sensor);

/* What a variant has gone through. */
typedef struct closed_form_tally {
    uint32_t cases, failed;
    double largest_deviation, largest_error; /* relative */
} closed_form_tally;

typedef struct closed_form_effort {
    bool all_cases;       /* every sensor and sampler for each scene; or one of them in turn */
    double tolerance;     /* relative */
    uint32_t max_samples; /* per pixel of a batch */
} closed_form_effort;

/* One variant on all the scenes it can do. A case passes if its mean is within the tolerance of the known one, was
 * measured to better than two thirds of that (95 % confidence), and differs by no more than its noise explains (false
 * alarms in all cases of all variants together: 1 %). One that does not is measured again, twice as precisely and
 * with other seeds, and that counts. Prints a line, and one more for each failure. */
closed_form_tally check_closed_forms(size_t variant, const closed_form_effort *effort);

/* The main() of a test program: one test for each variant. An argument is a pattern: only variants of matching names
 * are tested. */
int run_closed_forms(int argc, char **argv, const closed_form_effort *effort);

#endif
