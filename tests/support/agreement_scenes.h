/* Small scenes of mixed lights, materials, shapes and sensors on which integrators are compared with each other.
 * Among them are every emitter, every BSDF, every shape and every sensor that the importer knows. Where `path` is the
 * reference, its noise is finite: Dirac lights meet rough surfaces only, mirrors and glass see large lights. */
#ifndef CA_TEST_AGREEMENT_SCENES_H
#define CA_TEST_AGREEMENT_SCENES_H

#include "caustica.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct agreement_scene {
    const char *name;
    const char *sensor, *content;
    int max_depth;
    float radius;   /* m: so small that merging has no bias to speak of */
    unsigned needs; /* closed_forms.h */
    bool hide_emitters; /* a sky seen directly has no noise, and would pass for power that the test does not have */
    bool fast;          /* belongs to the fast subset */
} agreement_scene;

enum { AGREEMENT_BLOCK = 8 }; /* the pictures' sides are multiples of it */

size_t agreement_scene_count(void);
const agreement_scene *agreement_scene_at(size_t index);
ca_scene *agreement_scene_load(const agreement_scene *scene);

#endif
