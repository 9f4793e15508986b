/* Looking at weighted paths: for each weight that is computed, the record it was computed from and the points of the
 * path that the record stands for. For tests that hold the one against the other, and for pilots that ask what
 * another method would make of a path; a render has no observer, and an observer changes nothing of the image.
 *
 * The record's subpaths and the points have the same numbers: camera[i] belongs to path->camera.vertices[i], light[i]
 * to path->light.vertices[i]. The integrator `path` weighs two techniques, for which the last three vertices are all
 * that counts: its records have counts and no vertices, and its camera[0] is the third vertex from the light, which
 * may be a surface. Threads: called by whichever thread traces. Everything pointed to is the engine's, and lasts for
 * the call. */
#ifndef CA_PATH_PATH_OBSERVER_H
#define CA_PATH_PATH_OBSERVER_H

#include "path/light_store.h"
#include "path/mis.h"

typedef struct ca_observed_path {
    const ca_mis_rules *rules;
    ca_technique technique;
    const ca_mis_path *path;
    float weight;
    /* path->camera.count of them. [0]: the position is the lens point, nothing else is set. Of a hit the last is on
     * the light; at infinity its position is a point in the light's direction as seen from the vertex before, and its
     * shape is CA_NONE. */
    const ca_surface_point *camera;
    /* path->light.count of them, of a merge one more: the photon, which the record takes for the camera's last
     * vertex. The points count, and of [0] position, ng (zero: no surface) and shape, which is the light's number in
     * the scene. At infinity: as above, or a point where the light path began. */
    const ca_light_vertex *light;
} ca_observed_path;

typedef struct ca_path_observer {
    void (*see)(void *user, const ca_observed_path *observed);
    void *user;
    /* What the camera path through pixel (x, y) of the full film gets for the path that the thread saw last, before
     * its weight and the filter's. Not told are what is dropped as a defect, splats, and paths of the integrator
     * `path`. NULL: not wanted. */
    void (*take)(void *user, uint32_t x, uint32_t y, ca_rgb unweighted);
} ca_path_observer;

/* The weight of the path, shown to the observer if there is one. */
static inline float ca_observed_weight(const ca_path_observer *observer, const ca_mis_rules *rules,
                                       ca_technique technique, const ca_mis_path *path,
                                       const ca_surface_point *camera, const ca_light_vertex *light)
{
    const float weight = ca_mis_weight(rules, path, technique);
    if (observer)
        observer->see(observer->user,
                      &(ca_observed_path){.rules = rules,
                                          .technique = technique,
                                          .path = path,
                                          .weight = weight,
                                          .camera = camera,
                                          .light = light});
    return weight;
}

#endif
