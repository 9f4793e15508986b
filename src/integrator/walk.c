#include "integrator/walk.h"

bool ca_walk_arrive(ca_walk *walk, const ca_scene *scene, const ca_hit *hit)
{
    ca_vertex_from_hit(&walk->last, scene, walk->origin, walk->direction, hit);
    if (!(walk->last.cos_in > 0.0f) || !(hit->t > 0.0f)) return false;
    ca_path_vertex *v = &walk->densities[++walk->vertex];
    ca_path_vertex_arrive(v, v - 1, &walk->flight, hit->t, walk->last.cos_in, 0.0f);
    return true;
}

static bool survives(ca_walk *walk, uint32_t rr_depth, float u)
{
    const ca_rgb left = ca_rgb_scale(walk->throughput, 1.0f / walk->start);
    const float largest = ca_rgb_max(left);
    if (!(largest > 0.0f)) return false;
    walk->throughput = ca_rgb_scale(left, walk->start);
    if (walk->vertex + 1 < rr_depth) return true;
    const float survival = ca_min(CA_ROULETTE_MOST, largest * walk->eta2);
    if (u >= survival) return false;
    walk->throughput = ca_rgb_scale(ca_rgb_scale(left, 1.0f / survival), walk->start);
    return true;
}

/* Numbers that choose the lobe and play roulette; zeros where nobody looks at them. */
static ca_vec2 lobe_and_roulette(const ca_walk *walk, uint32_t dimension, uint32_t rr_depth)
{
    if (walk->last.matte && walk->vertex + 1 < rr_depth) return (ca_vec2){0};
    return ca_sample_2d(&walk->stream, dimension + CA_DIM_BSDF_LOBE);
}

bool ca_walk_scatter(ca_walk *walk, const ca_reuse_rules *rules, uint32_t rr_depth)
{
    const uint32_t dimension = ca_vertex_dimension(walk->vertex - 1);
    const ca_vec2 u_lobe_roulette = lobe_and_roulette(walk, dimension, rr_depth);
    const ca_vertex *last = &walk->last;
    ca_bsdf_sample event;
    if (!ca_vertex_sample(last, u_lobe_roulette.x, ca_sample_2d(&walk->stream, dimension + CA_DIM_BSDF_DIRECTION),
                          walk->from, &event))
        return false;
    ca_path_vertex *v = &walk->densities[walk->vertex];
    walk->flight = ca_path_vertex_scatter(v, v - 1, last->wi, last->ng, &event, rules);
    walk->throughput = ca_rgb_mul(walk->throughput, event.weight);
    if (walk->from == CA_FROM_CAMERA) {
        walk->eta2 *= ca_sqr(event.eta);
        walk->receiver = ca_vertex_receiver(last);
    }
    walk->origin = ca_vertex_leave(last, event.wo_world);
    walk->direction = event.wo_world;
    walk->t_min = 0.0f;
    walk->t_max = INFINITY;
    return survives(walk, rr_depth, u_lobe_roulette.y);
}
