/* A full path as the two subpaths that made it, and what the join of them adds: all that a weight depends on. */
#ifndef CA_PATH_MIS_PATH_H
#define CA_PATH_MIS_PATH_H

#include "path/path_vertex.h"
#include "path/technique_factors.h"

#define CA_MIS_NO_TAIL (-1.0)

/* One subpath of a split, and what its last vertex v[count-1] gets to know from the other side. */
typedef struct ca_mis_side {
    const ca_path_vertex *vertices;
    uint32_t count;
    ca_pdf_area pdf_last;   /* of the last vertex, as sampled from the other side */
    ca_pdf_area pdf_before; /* of the one before, likewise */
    float sqrt_area;        /* the other end's footprint on arrival at the last vertex */
    float sqrt_omega;
    float spread;           /* 1 / (epsilon + sqrt p) for the other side's going on to the vertex before */
    float cos_ratio;        /* |cos out| / |cos in| at the last vertex, as walked from *this* side's end; 1 at ends */
    double tail;            /* as mis.h has it; CA_MIS_NO_TAIL: not known */
} ca_mis_side;

/* A full path, split into x[0 .. camera.count-1] and the light's vertices in reverse. A merge is given as the split
 * behind the merged vertex: it is the camera's last and not among the light's. A hit has no light vertices. The
 * vertices next to the split must be connectable (or ends) for connect, next event and splat. */
typedef struct ca_mis_path {
    ca_mis_side camera, light;
    float next_event_ratio; /* density of choosing x[n-1] for x[n-2] over pdf_light[n-1] */
    float light_choice;     /* p_0 of the light */
    bool light_infinite;    /* x[n-1] is a direction */
    float camera_distance;  /* from x[0] to x[1], m */
    uint32_t light_class;   /* of the light, where there are factors */
    bool merged;            /* made by a merge, of a photon where the density of photons is ... */
    float merged_density;   /* ... so much */
    const ca_technique_factors *factors; /* of its place on the film; NULL: all are 1 */
} ca_mis_path;

#endif
