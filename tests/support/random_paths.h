/* Random full paths, all numbers and no scene, and their splits into subpaths as the engine would make them.
 *
 * A full path is x[0] (lens) to x[n-1] (light). Its densities are drawn log-uniformly, so they fit no geometry, but
 * every kind of light and camera that the measures of path_vertex.h tell apart occurs. */
#ifndef CA_TEST_RANDOM_PATHS_H
#define CA_TEST_RANDOM_PATHS_H

#include "path/mis.h"
#include "support/test_random.h"

enum { CA_FULL_PATH_MAX = 12 };

typedef struct ca_full_path {
    uint32_t n;
    float pdf_camera[CA_FULL_PATH_MAX]; /* of x[i] as sampled from the camera; 0 at a light that cannot be hit */
    float pdf_light[CA_FULL_PATH_MAX];  /* as sampled from the light; [0] is not used */
    bool dirac[CA_FULL_PATH_MAX];       /* interior vertices with a Dirac event */
    /* For footprints. */
    float distance[CA_FULL_PATH_MAX];      /* from x[i] to x[i+1]; from the emitting disk for a light at infinity */
    float pdf_to_light[CA_FULL_PATH_MAX];  /* per solid angle, of leaving x[i] for x[i+1] */
    float pdf_to_camera[CA_FULL_PATH_MAX]; /* for x[i-1], coming from x[i+1] */
    float cos_to_light[CA_FULL_PATH_MAX], cos_to_camera[CA_FULL_PATH_MAX]; /* at x[i] */
    float camera_area, light_area;         /* where the footprints start, m^2 */
    bool camera_parallel, light_parallel;  /* one direction only: a spread of 0 */
    bool light_infinite;
    float photon_density[CA_FULL_PATH_MAX];
    float next_event_ratio, light_choice;
    float splat_scale; /* of the place where the path enters the picture */
    ca_technique_factors factors; /* where the rules have some */
    uint32_t light_class;
} ca_full_path;

static inline bool ca_full_path_is_smooth(const ca_full_path *path, uint32_t i)
{
    return i >= 1 && i + 2 <= path->n && !path->dirac[i];
}

/* Half the rules are those of an algorithm, half any. */
ca_mis_rules ca_random_rules(ca_test_random *random);

ca_full_path ca_random_path(ca_test_random *random);

/* A split, with room for its vertices. */
typedef struct ca_split_path {
    ca_path_vertex camera[CA_FULL_PATH_MAX], light[CA_FULL_PATH_MAX];
    ca_mis_path path; /* points into the arrays: do not copy */
} ca_split_path;

/* The split after s camera vertices. What an engine could not know, since another event happened in the stored path
 * behind the split, is NaN or random. */
void ca_split(const ca_full_path *path, const ca_reuse_rules *rules, uint32_t s, ca_technique technique,
              ca_test_random *random, ca_split_path *split);

#endif
