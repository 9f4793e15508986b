/* Joining two subpaths: the record that the weight of a full path is computed from (mis_path.h), for every technique
 * from the same few pieces.
 *
 *     technique    camera side                          light side
 *     hit          ca_join_hit                          none
 *     next event   ca_join_scattering                   ca_join_end
 *     connect      ca_join_scattering                   ca_join_scattering
 *     splat        ca_join_end                          ca_join_scattering
 *     merge        ca_join_scattering (the photon's     ca_join_scattered
 *                  segment arrives at the vertex)
 *
 * Each side is told what the segment brings that comes from the other one (ca_arrival): the density with which the
 * other end would have sampled this vertex, and its footprint (Jendersie 2019, equations 8a and 8b). Measures:
 * path_vertex.h. */
#ifndef CA_PATH_JOIN_H
#define CA_PATH_JOIN_H

#include "path/mis_path.h"
#include "path/subpath.h"

/* What a segment brings to the vertex where it arrives. */
typedef struct ca_arrival {
    ca_pdf_area pdf;
    float sqrt_area, sqrt_omega;
} ca_arrival;

static inline ca_arrival ca_arrive(const ca_flight *flight, float distance, float cos_in)
{
    return (ca_arrival){.pdf = {ca_flight_density(flight, distance, cos_in)},
                        .sqrt_area = ca_flight_sqrt_area(flight, distance),
                        .sqrt_omega = flight->sqrt_omega};
}

/* The segment that leaves a vertex in a direction that was not sampled there; pdf: that of sampling it. cos_ratio:
 * |cos out| / |cos in| at the vertex. */
static inline ca_flight ca_flight_towards(const ca_path_vertex *vertex, ca_pdf_solid_angle pdf, float cos_out,
                                          float cos_ratio, const ca_reuse_rules *rules)
{
    return (ca_flight){.pdf = pdf.v,
                       .reversible = true,
                       .cos_out = cos_out,
                       .sqrt_area = ca_sqrt_area_out(rules, vertex->sqrt_area, cos_ratio),
                       .sqrt_omega = vertex->sqrt_omega + ca_footprint_spread(rules->epsilon, pdf)};
}

/* A side whose last vertex scatters what arrives from the other one; pdf_reverse: of going on to the vertex
 * before; tail: as mis.h has it. */
static inline ca_mis_side ca_join_scattering(const ca_path_vertex *vertices, uint32_t count, ca_arrival arrival,
                                             ca_pdf_solid_angle pdf_reverse, float cos_ratio,
                                             const ca_reuse_rules *rules, double tail)
{
    return (ca_mis_side){.vertices = vertices,
                         .count = count,
                         .pdf_last = arrival.pdf,
                         .pdf_before = {pdf_reverse.v * vertices[count - 1].to_previous},
                         .sqrt_area = arrival.sqrt_area,
                         .sqrt_omega = arrival.sqrt_omega,
                         .spread = ca_footprint_spread(rules->epsilon, pdf_reverse),
                         .cos_ratio = cos_ratio,
                         .tail = tail};
}

/* A side whose last vertex has scattered towards the other one: its record tells what would go on. */
static inline ca_mis_side ca_join_scattered(const ca_path_vertex *vertices, uint32_t count, ca_arrival arrival)
{
    const ca_path_vertex *last = &vertices[count - 1];
    return (ca_mis_side){.vertices = vertices,
                         .count = count,
                         .pdf_last = arrival.pdf,
                         .pdf_before = count > 1 ? vertices[count - 2].pdf_reverse : (ca_pdf_area){0.0f},
                         .sqrt_area = arrival.sqrt_area,
                         .sqrt_omega = arrival.sqrt_omega,
                         .spread = last->spread_reverse,
                         .cos_ratio = last->cos_ratio,
                         .tail = CA_MIS_NO_TAIL};
}

/* A side that is an end only: the lens, or a point of a light. pdf_last: of meeting it by chance. */
static inline ca_mis_side ca_join_end(const ca_path_vertex *end, ca_pdf_area pdf_last)
{
    return (ca_mis_side){.vertices = end, .count = 1, .pdf_last = pdf_last, .cos_ratio = 1.0f};
}

/* The camera's side where its last vertex lies on a light: `end` and `flight` as the light would start there,
 * pdf_before: the density with which it would have sampled the vertex before. */
static inline ca_mis_side ca_join_hit(const ca_path_vertex *vertices, uint32_t count, const ca_path_vertex *end,
                                      const ca_flight *flight, ca_pdf_area pdf_before)
{
    return (ca_mis_side){.vertices = vertices,
                         .count = count,
                         .pdf_last = end->pdf_forward,
                         .pdf_before = pdf_before,
                         .sqrt_area = end->sqrt_area,
                         .spread = flight->sqrt_omega,
                         .cos_ratio = 1.0f,
                         .tail = CA_MIS_NO_TAIL};
}

/* The whole path. light_start: v[0] of the light path, or what ca_light_end made of the light's point, with its
 * next_event_ratio. camera_distance: from the lens to the first vertex. factors: as ca_mis_path has them. */
static inline ca_mis_path ca_join(ca_mis_side camera, ca_mis_side light, const ca_path_vertex *light_start,
                                  float camera_distance, const ca_technique_factors *factors)
{
    return (ca_mis_path){.camera = camera,
                         .light = light,
                         .next_event_ratio = light_start->next_event_ratio,
                         .light_choice = light_start->light_choice,
                         .light_infinite = light_start->at_infinity,
                         .camera_distance = camera_distance,
                         .light_class = light_start->light_class,
                         .factors = factors};
}

#endif
