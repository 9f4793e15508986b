/* A record that the engine hands to the weight function against the path's points: the densities of all techniques,
 * one relative to the other, and the weight. They must agree to CHECK_TOLERANCE, or to what rounding may have done to
 * the points where a path is badly conditioned (near mirrors' directions, at grazing angles). */
#ifndef CA_TEST_RECORD_CHECK_H
#define CA_TEST_RECORD_CHECK_H

#include "support/traced_path.h"

#define CHECK_TOLERANCE 1e-4

/* What was checked. */
typedef struct record_tally {
    uint64_t checked[CA_TECHNIQUE_COUNT];
    uint64_t loose[CA_TECHNIQUE_COUNT]; /* agreed only within their conditioning */
    uint64_t dirac[CA_TECHNIQUE_COUNT]; /* with a Dirac event, and more than one technique to tell apart */
    double loosest[CA_TECHNIQUE_COUNT];
    uint64_t of_light[CA_LIGHT_ENVMAP + 1], of_camera[CA_CAMERA_KIND_COUNT];
} record_tally;

typedef struct record_check {
    const char *scene_name, *integrator; /* for messages */
    const ca_scene *scene;
    const ca_camera *camera;
    float (*density)(const void *user, ca_vec3 position); /* photons per m^2, for rules that ask; NULL: 0 */
    const void *density_user;
    const ca_emission_guide *guide; /* NULL: none */
    bool by_differences; /* traced_path.h */
    bool uniform;        /* likewise */
    bool weight_alone;   /* records have no vertices */
    record_tally *tally;
    uint32_t failures;   /* so far; the first ones are told */
} record_check;

void check_record(record_check *check, const ca_observed_path *observed);

#endif
