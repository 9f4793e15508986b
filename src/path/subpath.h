/* Extending a subpath: the densities and footprints of its vertices, as it goes.
 *
 * A segment under way is a ca_flight; arriving somewhere turns it into a vertex, scattering there into the next
 * flight. Both ends of a path start by the same two functions whether a subpath begins there (emission, camera ray)
 * or the end is met by the other side's means (next event, hit, splat): so all techniques agree on what a path's
 * densities are. Measures and formulas: path_vertex.h. */
#ifndef CA_PATH_SUBPATH_H
#define CA_PATH_SUBPATH_H

#include "camera/camera.h"
#include "light/light.h"
#include "material/bsdf.h"
#include "math/numeric.h"
#include "path/reuse.h"

/* A segment that has left a vertex. */
typedef struct ca_flight {
    float pdf;         /* per solid angle; a Dirac event's probability; parallel: per area across the direction */
    bool parallel;     /* from a light at infinity or an orthographic camera: distance does not thin it out */
    bool reversible;   /* can the vertex it left be met by chance from the other side? */
    bool from_infinity;
    float cos_out;     /* |cos| with the normal at the vertex it left */
    float sqrt_area;   /* footprint as it leaves */
    float sqrt_omega;  /* and its spread, sr^1/2 */
} ca_flight;

/* Area density at a point at `distance` whose normal makes |cos| = cos_in with the segment. */
static inline float ca_flight_density(const ca_flight *flight, float distance, float cos_in)
{
    return flight->parallel ? flight->pdf * cos_in : flight->pdf * cos_in / ca_sqr(distance);
}

/* sqrt(A) on arrival (8b). */
static inline float ca_flight_sqrt_area(const ca_flight *flight, float distance)
{
    return flight->sqrt_area + distance * flight->sqrt_omega;
}

/* The light's end of a path: fills its vertex and gives the segment that leaves it. pdf_position, pdf_direction,
 * cos_light as in light.h, `choice` the probability of choosing the light. */
ca_flight ca_light_end(const ca_light *light, float choice, ca_pdf_area pdf_position,
                       ca_pdf_solid_angle pdf_direction, float cos_light, const ca_reuse_rules *rules,
                       ca_path_vertex *vertex);

/* The camera's end, likewise. */
ca_flight ca_camera_end(const ca_camera *camera, ca_pdf_area pdf_position, ca_pdf_solid_angle pdf_direction,
                        const ca_reuse_rules *rules, ca_path_vertex *vertex);

/* How far a point is from the disk from which a light at infinity emits along `direction`. */
static inline float ca_light_disk_distance(const ca_light *light, ca_vec3 direction, ca_vec3 position)
{
    return ca_dot(ca_sub(position, light->scene_center), direction) + light->scene_radius;
}

/* Fills `vertex`, where the flight meets a surface; `previous` is the vertex it left. Until it scatters the vertex
 * counts as not connectable. */
static inline void ca_path_vertex_arrive(ca_path_vertex *vertex, const ca_path_vertex *previous,
                                         const ca_flight *flight, float distance, float cos_in, float photon_density)
{
    vertex->pdf_forward.v = ca_flight_density(flight, distance, cos_in);
    vertex->pdf_reverse.v = 0.0f;
    vertex->to_previous = !flight->reversible     ? 0.0f
                          : flight->from_infinity ? 1.0f
                                                  : flight->cos_out / ca_sqr(distance);
    vertex->distance = distance;
    vertex->sqrt_area = ca_flight_sqrt_area(flight, distance);
    vertex->sqrt_omega = flight->sqrt_omega;
    vertex->spread_reverse = 0.0f;
    vertex->cos_ratio = 1.0f;
    vertex->photon_density = photon_density;
    vertex->connectable = 0;
    vertex->connectable_count = previous->connectable_count;
}

/* d(omega out) / d(omega in) of a Dirac event: refraction stretches solid angles, eta_i^2 cos_i d(omega_i) = eta_o^2
 * cos_o d(omega_o), with cosines to the normal that Snell's law was applied to, which is along wi + eta wo. */
static inline float ca_dirac_jacobian(ca_vec3 wi, ca_vec3 wo, float eta)
{
    if (eta == 1.0f) return 1.0f;
    const ca_vec3 normal = ca_madd(wi, eta, wo);
    return ca_abs_dot(normal, wi) / (ca_sqr(eta) * ca_abs_dot(normal, wo));
}

/* sqrt(A) as the path leaves a vertex: as it arrived, or as the surface's tilt turns it. */
static inline float ca_sqrt_area_out(const ca_reuse_rules *rules, float sqrt_area, float cos_ratio)
{
    return rules->projected ? sqrt_area * sqrtf(cos_ratio) : sqrt_area;
}

/* A sampled event at `vertex`: fills what depends on it there and at `previous`, and gives the next segment. */
static inline ca_flight ca_path_vertex_scatter(ca_path_vertex *vertex, ca_path_vertex *previous, ca_vec3 wi,
                                               ca_vec3 ng, const ca_bsdf_sample *event, const ca_reuse_rules *rules)
{
    const bool dirac = (event->scatter & CA_SCATTER_DIRAC) != 0;
    const float cos_in = ca_abs_dot(ng, wi), cos_out = ca_abs_dot(ng, event->wo_world);
    const float reverse = dirac ? event->pdf_reverse.v * ca_dirac_jacobian(wi, event->wo_world, event->eta)
                                : event->pdf_reverse.v;
    previous->pdf_reverse.v = reverse * vertex->to_previous;
    vertex->connectable = !dirac;
    vertex->connectable_count = (uint16_t)(previous->connectable_count + !dirac);
    vertex->spread_reverse = dirac ? 0.0f : ca_footprint_spread(rules->epsilon, event->pdf_reverse);
    vertex->cos_ratio = cos_out / cos_in;
    return (ca_flight){
        .pdf = event->pdf.v,
        .reversible = true,
        .cos_out = cos_out,
        .sqrt_area = ca_sqrt_area_out(rules, vertex->sqrt_area, vertex->cos_ratio),
        .sqrt_omega = vertex->sqrt_omega + (dirac ? 0.0f : ca_footprint_spread(rules->epsilon, event->pdf)),
    };
}

#endif
