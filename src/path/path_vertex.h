/* What a vertex of a camera path or a light path keeps for weighting: its densities from both ends and its
 * footprints.
 *
 * "Own end" is the end at which the subpath began (the lens, the light), v[0] the vertex there. All densities leave
 * out Russian roulette. Measures: area densities m^-2 at the vertex. Exceptions, where no area is to be had:
 *   - a point (pinhole; point, spot and projector light): 1, times the probability of choosing the light;
 *   - a light at infinity: v[0] is a direction and its density is per solid angle (directional light: 1); v[1] then
 *     has the density of the emitting disk, projected: pdf_disk |cos|. Likewise the orthographic camera.
 *   - a Dirac event at v[i]: the discrete probability stands for the density per solid angle in v[i+1].pdf_forward
 *     and v[i-1].pdf_reverse. The reverse one carries the Jacobian of the refracted solid angle,
 *     d(omega forward) / d(omega reverse), so that ratios of densities compare the same measure on paths.
 *
 * Footprints are those of Jendersie 2019, "Variance Reduction via Footprint Estimation in the Presence of Path
 * Reuse", equations 8a and 8b, as square roots (m and sr^1/2).
 *
 * 40 bytes. */
#ifndef CA_PATH_PATH_VERTEX_H
#define CA_PATH_PATH_VERTEX_H

#include "math/measure.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct ca_path_vertex {
    ca_pdf_area pdf_forward; /* as its own end sampled it */
    ca_pdf_area pdf_reverse; /* as the next vertex would sample it, coming from the one after that; known once the
                                next vertex has scattered */
    float to_previous;       /* turns a density per solid angle here into an area density at the previous vertex:
                                |cos there| / distance^2; 1 where that is a light at infinity, 0 where it cannot be
                                met by chance (a Dirac light, the camera) */
    union {
        float distance;         /* to the previous vertex; from the emitting disk for a light at infinity */
        float next_event_ratio; /* v[0] of a light path: density of choosing it by next event from v[1], over
                                   pdf_forward */
    };
    float sqrt_area;         /* sqrt(A) on arrival, from its own end (8b) */
    float sqrt_omega;        /* sqrt(Omega) of the segment that arrives (8a) */
    union {
        float
            spread_reverse; /* 1 / (epsilon + sqrt p) for leaving towards the previous vertex; 0 for a Dirac event */
        float light_choice;   /* v[0] of a light path: probability of the light */
    };
    float cos_ratio;         /* |cos out| / |cos in| as walked from its own end; 1 at the ends */
    union {
        float photon_density; /* photons per m^2 around here, where the reuse rule asks for it; else 0 */
        uint32_t light_class; /* v[0] of a light path: of the light (technique_factors.h) */
        float splat_scale;    /* v[0] of a camera path: the count of splats where the path enters the picture, over
                                 that of the rules (mis.h) */
    };
    union {
        uint16_t
            connectable; /* 1: an interior vertex that scatters smoothly, where edges and merges may be made. Of a
                        subpath's interior vertex: the event that happened; of its last: what it is capable of */
        uint16_t at_infinity; /* v[0] of a light path: it is a direction, of parallel light */
    };
    uint16_t connectable_count; /* how many of v[1] to this one are */
} ca_path_vertex;

_Static_assert(sizeof(ca_path_vertex) == 40, "path_vertex.h promises 40 bytes");

/* Subpaths end here. The roulette, which is on long before, makes reaching it less likely than 1e-20. */
enum { CA_PATH_MAX_VERTICES = 1024 };

#endif
