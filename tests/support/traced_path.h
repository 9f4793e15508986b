/* A path that the engine traced, as nothing but its points, and all of its densities recomputed from them: in double
 * precision, by asking the scene's camera, lights and BSDFs at these points. Of the engine's own record nothing is
 * used. */
#ifndef CA_TEST_TRACED_PATH_H
#define CA_TEST_TRACED_PATH_H

#include "path/path_observer.h"
#include "light/emission_guide.h"
#include "scene/scene.h"
#include "support/double_vec.h"
#include "support/random_paths.h"

/* x[0] (lens) to x[n-1] (light). A merged vertex has two places: segments towards the camera end at the camera path's
 * vertex, where the BSDF is, those towards the light at the photon. */
typedef struct traced_path {
    const ca_scene *scene;
    const ca_camera *camera;
    const ca_light *light;
    double light_choice;
    double disk_density; /* of the ray's origin, where the light is at infinity or a beam */
    const ca_guide_aim *aim; /* NULL: directions from the light are as usual */
    const ca_technique_factors *factors; /* as the record has them; NULL: none */
    uint32_t n;
    uint32_t split;  /* vertices of the camera's side; of a merge with the merged one */
    uint32_t merged; /* 0: none */
    ca_surface_point points[CA_FULL_PATH_MAX]; /* [1 .. n-2] whole, x[0] position, x[n-1] position and ng */
    double_vec facing_camera[CA_FULL_PATH_MAX], facing_light[CA_FULL_PATH_MAX];
    double_vec ng[CA_FULL_PATH_MAX]; /* where densities per area count: of the photon where merged */
    double photon_density[CA_FULL_PATH_MAX];
    bool dirac[CA_FULL_PATH_MAX];
    /* How Dirac events stretch densities: from finite differences of the whole map from smooth vertex to smooth
     * vertex, instead of event by event. For spheres and flat surfaces, perspective cameras and lights that are not
     * at infinity. */
    bool by_differences;
    /* Directions are uniform over the hemisphere, and next event chooses lights and points as emission does. */
    bool uniform;
} traced_path;

/* Reads the points. false: more vertices than there is room for. `guide`: of emission; NULL: none. `density` gives
 * photons per m^2; NULL: 0. */
bool traced_path_read(const ca_observed_path *observed, const ca_scene *scene, const ca_camera *camera,
                      const ca_emission_guide *guide, float (*density)(const void *user, ca_vec3 position),
                      const void *user, traced_path *path);

/* Which events are Dirac, by comparing directions with those in which the material has one; vertices that `technique`
 * joins are not. false, with what is wrong in *complaint, where a vertex can do neither. */
bool traced_path_find_events(traced_path *path, ca_technique technique, const char **complaint);

/* All densities, cosines and distances. */
void traced_path_recompute(const traced_path *path, ca_full_path *full);

/* A bound on how far the engine's arithmetic may have displaced vertex i, m. */
double traced_path_uncertainty(const traced_path *path, uint32_t i);

#endif
