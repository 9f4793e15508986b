/* Which photons a merge takes: those of the surface on which the camera path's vertex lies, and of the side that it
 * sees. A photon within the merge radius may belong to another surface: a wall at an edge, the other face of a pane.
 *
 * Opaque surfaces are compared by the sides that the two paths arrive on: a mesh's winding may change from one
 * triangle to the next, and says nothing of the light. Where either surface lets light through, winding tells its two
 * faces apart (what is inside of one is outside of the other), so the normals are compared as they are wound. At one
 * and the same point of a path both agree, so weights need not ask: they count a merge at each vertex that scatters
 * smoothly. */
#ifndef CA_PATH_MERGE_SURFACE_H
#define CA_PATH_MERGE_SURFACE_H

#include "path/light_record.h"
#include "path/vertex.h"

/* Photons farther than 60 degrees from the surface's tilt belong to another surface. */
#define CA_MERGE_MIN_COS 0.5f

/* Of a camera path's vertex. */
typedef struct ca_merge_surface {
    ca_vec3 ng; /* as wound */
    bool behind; /* the path arrives on the side away from ng */
    bool passes; /* light, in part: ca_matte_shape */
} ca_merge_surface;

/* wi: to the previous vertex. */
static inline ca_merge_surface ca_merge_surface_at(const ca_scene *scene, uint32_t shape, ca_vec3 ng, ca_vec3 wi)
{
    return (ca_merge_surface){.ng = ng, .behind = ca_dot(ng, wi) < 0.0f, .passes = scene->mattes[shape].passes};
}

static inline ca_merge_surface ca_merge_surface_of(const ca_scene *scene, const ca_vertex *vertex)
{
    return ca_merge_surface_at(scene, vertex->shape, vertex->ng, vertex->wi);
}

static inline bool ca_merge_is_on_surface(const ca_merge_surface *surface, const ca_light_record *photon)
{
    const float cosine = ca_dot(photon->ng, surface->ng);
    const bool as_wound = surface->passes || photon->passes;
    const bool behind = ca_dot(photon->ng, photon->wi) < 0.0f;
    return (as_wound || behind == surface->behind ? cosine : -cosine) >= CA_MERGE_MIN_COS;
}

#endif
