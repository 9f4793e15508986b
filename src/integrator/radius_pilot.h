/* The default merge radius: a pilot measures how variance and blur of merges depend on the radius, and
 * photon/radius_choice.h makes of it the radius of least error.
 *
 * Two sets of light paths, and for either camera paths of each of many pixels all over the film, which look for
 * photons of their set by radii that double from level to level. What a radius changes against half of it, as the one
 * set sees it, times what the other sees, is on average the square of what it changes in the pixel, without noise;
 * blur within a pixel is not seen and does not count.
 * Photons count by the weights that they would have in the render with that radius, those within half of it, too:
 * weights alone change nothing. The sum of weights times the squares of what photons bring tells the second moment:
 * of merges, and by the balance heuristic also of all that takes their place where their weights are small.
 *
 * Next event at a camera path's first query may be nearly without noise, where a second moment is no variance. So
 * for light that comes straight to that query merges have the noise of their photons, and next event has the variance
 * that it was seen to have among the camera paths of a pixel, for the part of the light that merges leave it. What
 * camera paths differ by in the light that they meet (pairs of photons tell it, without photons' noise) stays of it
 * whatever merges take, and so does the noise of lights that are seen themselves.
 *
 * Both are told in parts of the pixel's own light, and most of the error lies in dark pixels beside bright ones. So
 * a pixel's light must not be blurred itself: other camera paths find it by next event, and photons stand only for
 * what came through mirrors and lenses alone, which next event cannot find. These are of one set: a pixel that has
 * few of its photons by chance passes for dark, but the other set knows nothing of it, and noise still is no blur.
 *
 * Levels lie around the distance of the NEAREST-th photon at the median query that finds light. Photons of the larger
 * ones are thinned, so that all levels cost about the same. The error is relative as that of metrics/compare.h is.
 *
 * Two methods stand for all: `bdpm` for those with photons alone, `ovcm` for `vcm` and its kin, which so have one
 * radius for one scene. All is a function of scene, settings and seed over the whole film, never of the crop, of
 * threads or of rounds: one thread traces, with random numbers of its own. The image's mean stays what it is.
 *
 * Internal to this folder.
 *
 *     step                          file
 *     sets of photons, by levels    radius_pilot.c
 *     camera paths that find them   radius_paths.c
 *     the curve                     radius_curve.c
 */
#ifndef CA_INTEGRATOR_RADIUS_PILOT_H
#define CA_INTEGRATOR_RADIUS_PILOT_H

#include "integrator/bidirectional.h"
#include "photon/radius_choice.h"

enum {
    CA_PILOT_BELOW = 2,                  /* levels below the middle one */
    CA_PILOT_PAIRS = CA_PILOT_BELOW,     /* level at which pairs of photons are looked for */
    CA_LENS_LEVELS = CA_PILOT_BELOW + 2, /* at which photons are looked for that tell a pixel's light */
};

/* What the camera paths of a pixel find, by levels, as densities per light path. */
typedef struct ca_path_sums {
    float change[CA_RADIUS_LEVELS]; /* weighted light, minus what half the radius makes of the same weights */
    float square[CA_RADIUS_LEVELS]; /* weights times squares of light; of direct light the weights' squares */
    float direct[CA_RADIUS_LEVELS], weighted[CA_RADIUS_LEVELS]; /* light that next event finds at first queries, */
                                                                 /* and what merges have of it */
    float pairs; /* of photons of such light at level CA_PILOT_PAIRS: products of what either brings */
    float alone; /* what these bring */
} ca_path_sums;

/* What other camera paths tell of a pixel's light. */
typedef struct ca_light_sums {
    double asked; /* lights that they see or ask */
    /* Sums, and of squares: what they find by asking at their first query, and that with lights that they see. */
    double direct, direct_squares, shown, shown_squares;
    float lens[CA_LENS_LEVELS]; /* photons of light that met Dirac events only, as densities */
    uint32_t found[CA_LENS_LEVELS]; /* how many */
} ca_light_sums;

typedef struct ca_photon_level {
    ca_photon_grid *grid; /* owned */
    ca_photon *photons;   /* owned */
    uint32_t count, paths; /* paths: whose photons these are */
    float radius;
} ca_photon_level;

typedef struct ca_radius_probe {
    ca_bidirectional *engine; /* owned */
    ca_worker worker;
    uint32_t light_paths; /* of a set */
    uint32_t columns, rows;
    ca_photon_level levels[CA_RADIUS_LEVELS];
    ca_photon_level lens[CA_LENS_LEVELS]; /* photons of light that met Dirac events only */
    uint32_t level_count;
    float scale; /* distance of the NEAREST-th photon at the median lit query; 0: there is no light */
    bool merging_alone;  /* finds light */
    uint32_t merging, lighting; /* camera paths of a pixel: those that merge, for either set; that tell its light */
    ca_path_sums *sums[2];  /* owned; of pixels, for either set */
    ca_light_sums *lights;  /* owned; of pixels */
    double *relative;       /* owned; what squares of a pixel's light count for */
    ca_vec3 *queries;    /* owned; where first paths look for photons first */
    uint32_t query_count;
    double merged, merging_queries; /* photons that queries find at the middle level; how many queries */
    uint32_t *found;     /* owned; photons of a query */
    size_t found_capacity;
    bool out_of_memory;
} ca_radius_probe;

/* Traces camera paths: each notes where it looks for photons first; those of a set that merge with the photons of the
 * levels; those that tell the light of pixels. Sets p->out_of_memory. */
void ca_radius_note_queries(ca_radius_probe *p);
void ca_radius_merge_set(ca_radius_probe *p, uint32_t set);
void ca_radius_light_pixels(ca_radius_probe *p);

/* What both sets tell; false: there is no light. */
bool ca_radius_make_curve(ca_radius_probe *p, ca_radius_curve *curve);

#endif
