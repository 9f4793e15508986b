/* The weight of a technique for a full path: one pure function of the path's densities, Dirac flags and reuse
 * factors, for every algorithm (Veach 1997, chapter 9; with merges Georgiev et al. 2012, "Light Transport Simulation
 * with Vertex Connection and Merging").
 *
 * A path comes as the two subpaths that made it and what the join adds. The split after s camera vertices has the
 * density D_s = product of pdf_camera[0 .. s-1] times product of pdf_light[s .. n-1], and every technique's density
 * is one of these times a factor:
 *
 *     connect, hit   D_s                            count 1
 *     next event     D_(n-1) next_event_ratio       count 1
 *     splat          D_1                            count N_F / N_B
 *     merge at x[m]  D_(m+1) pdf_light[m] pi r^2    count reuse[m] (N_F, or what the reuse rule makes of it)
 *
 * per camera path, for N_F light paths and N_B camera paths per pixel. N_B may differ from pixel to pixel: it is that
 * of the pixel where the path enters the picture, whichever pixels it is summed into: all techniques of a path read
 * the same one (path_vertex.h, splat_scale). Where the path has factors (technique_factors.h) the count is multiplied
 * by the technique's. The weight is its (count * density)^beta over
 * the sum of all that the rules allow; beta = 1 is the balance heuristic, 2 the power heuristic. Not available are: a
 * connection next to a vertex that is not connectable, a merge at one; paths of a single segment are only hit. */
#ifndef CA_PATH_MIS_H
#define CA_PATH_MIS_H

#include "path/mis_path.h"
#include "path/reuse.h"
#include "path/technique.h"

/* Which paths may be found by hitting the light. */
typedef enum ca_hit_rule {
    CA_HIT_ALWAYS,
    CA_HIT_DIRECT,      /* emitters seen directly only */
    CA_HIT_UNMERGEABLE, /* paths without a connectable vertex, which photons cannot make */
} ca_hit_rule;

/* At which of a camera path's connectable vertices merges are made. */
typedef enum ca_merge_rule {
    CA_MERGE_NONE,
    CA_MERGE_ALL,   /* up to the limit */
    CA_MERGE_LAST,  /* at the limit, or at the path's last connectable vertex if there are fewer */
} ca_merge_rule;

typedef struct ca_mis_rules {
    bool power;   /* beta = 2 */
    bool factors; /* paths come with factors of techniques */
    ca_hit_rule hit;
    bool next_event, connect, splat;
    ca_merge_rule merge;
    uint32_t merge_limit; /* merges at the first so many connectable vertices from the camera; UINT32_MAX: all */
    bool has_tails;       /* ca_mis_has_tails; may be false where it is true */
    bool photon_sums;     /* photons keep ca_photon_sums, and merges are weighted by these; with tails only */
    float splat_count;    /* N_F / N_B; where N_B is a map, of any one N_B, which splat_scale is relative to; over the
                           * number of cameras, one of which a splat chooses */
    float merge_area;     /* pi r^2, m^2 */
    ca_reuse_rules reuse;
} ca_mis_rules;

/* Weight in [0, 1] of `technique` at the path's split. The vertices that the technique joins count as connectable,
 * whatever their records say: those tell which event was sampled there, which is not used. */
float ca_mis_weight(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique);

/* How many samples of the path all techniques together make, over the density D_s of the given split: the sum of
 * (count * density), whatever the heuristic. Of two rules the ratio tells how many samples the one makes for each of
 * the other. *own: what of it `technique` makes; NULL: not wanted. */
double ca_mis_total(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique, double *own);

/* Tails. Under the balance heuristic without factors, with merges that count the same everywhere, the techniques
 * whose split or merge lies before a side's last two vertices bring to the sum of all densities a number times what
 * those two bring. That number, the tail, follows from the subpath alone: it grows with the path, and a weight then
 * costs the same whatever the path's length (Georgiev 2012, "Implementing Vertex Connection and Merging", has such
 * sums). Weights are those of the sum over all vertices but for rounding. */
bool ca_mis_has_tails(const ca_mis_rules *rules);
/* Of a camera's or a light's subpath whose last vertex is v[last], last >= 1, from that of the subpath without it; 0
 * where last < 3 (camera) or < 2 (light). Where the rules have no tails, CA_MIS_NO_TAIL. */
double ca_mis_camera_tail(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t last, double before);
double ca_mis_light_tail(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t last, double before);

/* What a photon at a light path's v[i], i >= 1, knows of its path, so that a merge's weight costs the same whatever
 * the path's length: three numbers, as the dVCM, dVC and dVM of Georgiev 2012. */
typedef struct ca_photon_sums {
    float pdf_forward;
    float split;   /* what the split before the photon counts: next event, or a connection with v[i-1] */
    float towards; /* all techniques nearer to the light, over the density per solid angle of going on to v[i-1] */
} ca_photon_sums;
/* tail: ca_mis_light_tail of v[last]. */
ca_photon_sums ca_mis_photon_sums(const ca_mis_rules *rules, const ca_path_vertex *vertices, uint32_t last,
                                  double tail);
/* Of the merge of the camera's last vertex with a photon; pdf: per solid angle, of the camera path's going on along
 * the photon's path. */
float ca_mis_merge_weight(const ca_mis_rules *rules, const ca_mis_side *camera, const ca_photon_sums *photon,
                          float pdf);

/* Have the paths that these rules find one technique each? Its weight is then 1, but for hits. */
bool ca_mis_has_one_technique(const ca_mis_rules *rules);

/* The (count * density) of every technique relative to D_s of the given split, before the exponent; NULL entries are
 * skipped. `splits` has n + 1 entries, [k]: the technique of k camera vertices (0 where not allowed), `merges` n. For
 * tests and for explaining a weight. */
void ca_mis_densities(const ca_mis_rules *rules, const ca_mis_path *path, ca_technique technique, double *splits,
                      double *merges);

#endif
