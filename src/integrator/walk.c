#include "integrator/bidirectional.h"

#include "integrator/batch_lanes.h"

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
    const float survival = ca_min(CA_ROULETTE_MOST, CA_ROULETTE_GAIN * largest * walk->eta2);
    if (u >= survival) return false;
    walk->throughput = ca_rgb_scale(ca_rgb_scale(left, 1.0f / survival), walk->start);
    return true;
}

/* ---- Scatter --------------------------------------------------------------------------------------------------- */

/* What a vertex sampled, and from where the next segment starts. */
typedef struct walk_event {
    bool goes_on; /* else the path is absorbed, or no light goes there */
    ca_bsdf_sample sample;
    ca_vec3 origin;
} walk_event;

static inline uint32_t dimension_of(const ca_walk *walk) { return ca_vertex_dimension(walk->vertex - 1); }

static void sample_one(const ca_walk *walk, walk_event *event)
{
    const ca_vec2 u_lobe = ca_sample_2d(&walk->stream, dimension_of(walk) + CA_DIM_BSDF_LOBE);
    const ca_vec2 u = ca_sample_2d(&walk->stream, dimension_of(walk) + CA_DIM_BSDF_DIRECTION);
    const ca_vertex *last = &walk->last;
    event->goes_on = walk->uniform
                         ? ca_paper_sample(last, u, walk->from, &event->sample)
                         : ca_bsdf_sample_direction(&last->bsdf, last->wi, u_lobe.x, u, walk->from, &event->sample);
    if (event->goes_on) event->origin = ca_vertex_leave(last, event->sample.wo_world);
}

/* Matte vertices by lanes. */
typedef struct matte8 {
    ca_v8 normal, position;
    ca_f8 error, side, u, v;
} matte8;

static void load_matte(const ca_walk *walk, matte8 *m, int lane)
{
    const ca_vertex *last = &walk->last;
    const ca_vec2 u = ca_sample_2d(&walk->stream, dimension_of(walk) + CA_DIM_BSDF_DIRECTION);
    m->normal.x[lane] = last->ng.x, m->normal.y[lane] = last->ng.y, m->normal.z[lane] = last->ng.z;
    m->position.x[lane] = last->position.x, m->position.y[lane] = last->position.y;
    m->position.z[lane] = last->position.z;
    m->error[lane] = last->position_error.x;
    m->side[lane] = last->side;
    m->u[lane] = u.x, m->v[lane] = u.y;
}

/* sample_diffuse of material/bsdf.c once the direction is drawn, where ng is the shading normal, too: cos_local is
 * the cosine as it was drawn, cos_out that with the normal in front. false where no light goes there. */
static bool finish_matte(const ca_vertex *v, float cos_local, float cos_out, ca_from from, ca_bsdf_sample *sample)
{
    const float cos_i = ca_dot(v->ng, v->wi) * v->side;
    if (!(cos_i > CA_GRAZING_COS && cos_local > CA_GRAZING_COS && cos_out > CA_GRAZING_COS)) return false;
    sample->weight = from == CA_FROM_CAMERA ? v->reflectance
                                            : ca_rgb_scale(v->reflectance, cos_i * cos_out / (cos_i * cos_local));
    sample->pdf.v = cos_local * CA_INV_PI;
    sample->pdf_reverse.v = cos_i * CA_INV_PI;
    sample->scatter = CA_SCATTER_REFLECTION | CA_SCATTER_SMOOTH;
    sample->eta = 1.0f;
    return true;
}

/* Up to eight matte vertices: the bits that their BSDFs would give. */
static void sample_matte8(ca_walk *const *walks, uint32_t count, walk_event *const *events)
{
    matte8 m = {.normal = ca_v8_all((ca_vec3){0.0f, 0.0f, 1.0f})};
    for (uint32_t k = 0; k < count; k++) load_matte(walks[k], &m, (int)k);
    ca_v8 local = ca_cosine_hemisphere8(m.u, m.v);
    const ca_f8 cos_local = local.z;
    local.z = local.z * m.side;
    const ca_v8 wo = ca_to_world8(m.normal, local);
    const ca_v8 origin = ca_offset_origin8(m.position, m.error, m.normal, wo);
    const ca_f8 cos_out = ca_dot_v8(m.normal, wo) * m.side;
    for (uint32_t k = 0; k < count; k++) {
        events[k]->sample.wo_world = (ca_vec3){wo.x[k], wo.y[k], wo.z[k]};
        events[k]->origin = (ca_vec3){origin.x[k], origin.y[k], origin.z[k]};
        events[k]->goes_on =
            finish_matte(&walks[k]->last, cos_local[k], cos_out[k], walks[k]->from, &events[k]->sample);
    }
}

/* Events at the last vertices of up to eight walks. */
static void sample_group(ca_walk *const *walks, uint32_t count, walk_event *events)
{
    ca_walk *matte[CA_LANES];
    walk_event *of_matte[CA_LANES];
    uint32_t matte_count = 0;
    for (uint32_t k = 0; k < count; k++) {
        if (!walks[k]->last.matte || walks[k]->uniform) {
            sample_one(walks[k], &events[k]);
            continue;
        }
        matte[matte_count] = walks[k];
        of_matte[matte_count++] = &events[k];
    }
    if (matte_count > 0) sample_matte8(matte, matte_count, of_matte);
}

/* Takes the walk along the event; false where roulette ends it. */
static bool go_on(ca_walk *walk, const walk_event *event, const ca_reuse_rules *rules, uint32_t rr_depth)
{
    const ca_vertex *last = &walk->last;
    ca_path_vertex *v = &walk->densities[walk->vertex];
    walk->flight = ca_path_vertex_scatter(v, v - 1, last->wi, last->ng, &event->sample, rules);
    walk->throughput = ca_rgb_mul(walk->throughput, event->sample.weight);
    if (walk->from == CA_FROM_CAMERA) {
        walk->eta2 *= ca_sqr(event->sample.eta);
        walk->receiver = ca_vertex_receiver(last);
    }
    walk->origin = event->origin;
    walk->direction = event->sample.wo_world;
    walk->t_min = 0.0f;
    walk->t_max = INFINITY;
    /* Nobody looks at the number before the roulette is on. */
    const bool plays = walk->vertex + 1 >= rr_depth;
    return survives(walk, rr_depth,
                    plays ? ca_sample_2d(&walk->stream, dimension_of(walk) + CA_DIM_BSDF_LOBE).y : 0.0f);
}

void ca_walks_scatter(ca_walk *const *walks, uint32_t count, const ca_reuse_rules *rules, uint32_t rr_depth,
                      bool *goes_on)
{
    walk_event events[CA_LANES];
    for (uint32_t first = 0; first < count; first += CA_LANES) {
        const uint32_t size = ca_min_u32(CA_LANES, count - first);
        sample_group(walks + first, size, events);
        for (uint32_t k = 0; k < size; k++)
            goes_on[first + k] = events[k].goes_on && go_on(walks[first + k], &events[k], rules, rr_depth);
    }
}
