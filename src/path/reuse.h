/* How much is a merge worth? N_F light paths are reused by every merge, but the variance of the path falls by that
 * much only if it comes from the light's side. The rules below fill one number per vertex of a full path, the
 * effective count of the merge there; everything else about a weight is the same for all of them.
 *
 *     full        n = N_F (Georgiev et al. 2012)
 *     density     n = N_F / max(1, pi r^2 times the density of photons there)
 *     normalised  the same, rescaled so that the mean over the path's mergeable vertices is N_F
 *                 with `author`, as in Mufflon (cpu_ivcm.cpp, VCMPlus and VCMStar) by the author of both: where a
 *                 merge was made the density is the mean of its two vertices', and the mean n is over all of the
 *                 path's interior vertices, mirrors too (which have no photons here: n = N_F)
 *     footprint   Jendersie 2019, equations 8a to 8c: in [1, N_F]
 *     correlation n = N_F c / (c + l - c l), for the chances c and l that other camera paths and light paths come
 *                 along the same way to the vertex; N_F at x[1] (correlation-aware MIS, Grittmann et al. 2021, as the
 *                 authors' renderer SeeSharp has it: VertexConnectionAndMerging.cs, CorrelAwareRatios)
 *
 * docs/decisions/007-reuse-rules.md tells what the sources leave open.
 */
#ifndef CA_PATH_REUSE_H
#define CA_PATH_REUSE_H

#include "path/mis_path.h"

#include <math.h>

typedef enum ca_reuse_kind {
    CA_REUSE_FULL,
    CA_REUSE_DENSITY,
    CA_REUSE_NORMALISED,
    CA_REUSE_FOOTPRINT,
    CA_REUSE_CORRELATION,
    CA_REUSE_KIND_COUNT
} ca_reuse_kind;

typedef struct ca_reuse_rules {
    ca_reuse_kind kind;
    float light_paths; /* N_F */
    float merge_area;  /* pi r^2 */
    float epsilon;     /* of 8a */
    float c;           /* of 8c */
    bool author;       /* density and normalised as their author's renderer has them, below */
    bool projected;    /* footprints follow the surface's tilt (Jendersie 2019, section 2.2), else A_out = A_in */
} ca_reuse_rules;

/* Fills camera[j] for x[j], 1 <= j < path->camera.count, and light[i] for the light's vertex i, 1 <= i <
 * path->light.count; entries of vertices that are not connectable are not defined. camera_last, light_last: is that
 * side's last vertex? */
void ca_reuse_fill(const ca_reuse_rules *rules, const ca_mis_path *path, bool camera_last, bool light_last,
                   float *camera, float *light);

/* 1 / (epsilon + sqrt p), what a scattering event adds to sqrt(Omega) (8a). */
static inline float ca_footprint_spread(float epsilon, ca_pdf_solid_angle pdf)
{
    return 1.0f / (epsilon + sqrtf(pdf.v));
}

#endif
