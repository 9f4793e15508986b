/* Splats: vertices of light paths joined with points of the lens. */
#include "integrator/bidirectional.h"

#include "base/memory.h"

/* A vertex that is visible from the lens if the ray says so. */
typedef struct lens_join {
    ca_light_walk *walk;
    ca_camera_direct direct;
    ca_bsdf_value value;
    float cos_out;
    ca_rgb unweighted;
    bool touches; /* the lens itself: there is nothing in between */
} lens_join;

/* The weight of the path lens, this vertex, ..., light. */
static float weight_of(const ca_bidirectional *b, const lens_join *join, ca_bidirectional_scratch *scratch)
{
    const ca_light_walk *walk = join->walk;
    const ca_walk *w = &walk->walk;
    const ca_camera_direct *direct = &join->direct;
    ca_path_vertex lens;
    const ca_flight flight =
        ca_camera_end(direct->camera, direct->pdf_position, direct->pdf_direction, &b->rules.reuse, &lens);
    lens.splat_scale = ca_bidirectional_splat_scale(b, direct->film_position);
    const float cos_ratio = join->cos_out / w->last.cos_in;
    const ca_mis_path path =
        ca_join(ca_join_end(&lens, (ca_pdf_area){0.0f}),
                ca_join_scattering(w->densities, w->vertex + 1, ca_arrive(&flight, direct->distance, join->cos_out),
                                   join->value.pdf_reverse, cos_ratio, &b->rules.reuse, w->tail),
                w->densities, direct->distance, ca_bidirectional_factors(b, direct->film_position));
    const ca_surface_point lens_point = {.position = direct->position};
    return ca_bidirectional_weight(b, scratch, CA_TECHNIQUE_SPLAT, &path, &lens_point, walk->vertices);
}

/* false: nothing gets to the lens. */
static bool ask(const ca_bidirectional *b, ca_light_walk *walk, lens_join *join)
{
    const ca_integrator_input *input = &b->input;
    const ca_walk *w = &walk->walk;
    const ca_vec2 u_lens = ca_sample_2d(&w->stream, ca_vertex_dimension(w->vertex - 1) + CA_DIM_NEXT_EVENT);
    join->walk = walk;
    if (!ca_camera_sample_direct(input->camera, w->last.position, u_lens, input->filter->radius, &join->direct))
        return false;
    join->value = ca_vertex_eval(&w->last, join->direct.to_camera, CA_FROM_LIGHT);
    join->cos_out = ca_abs_dot(w->last.ng, join->direct.to_camera);
    const float factor = join->cos_out * join->direct.importance / join->direct.pdf_direct.v;
    join->unweighted = ca_rgb_scale(ca_rgb_mul(w->throughput, join->value.f), factor);
    join->touches = !(join->direct.t_near > 0.0f);
    return !ca_rgb_is_black(join->unweighted);
}

/* Adds to the batch's splats, behind those of the same walk; false when out of memory. */
static bool keep(ca_bidirectional_scratch *scratch, const ca_splat *record, ca_light_walk *walk)
{
    const uint32_t number = (uint32_t)scratch->splats.count;
    uint32_t *next = ca_array_grow(scratch->splat_next, &scratch->splat_next_capacity, number + 1u, sizeof *next);
    if (next) scratch->splat_next = next;
    if (!next || !ca_splat_list_add(&scratch->splats, record)) return false;
    scratch->splat_next[number] = CA_NONE;
    if (walk->first_splat == CA_NONE)
        walk->first_splat = number;
    else
        scratch->splat_next[walk->last_splat] = number;
    walk->last_splat = number;
    return true;
}

static bool take(const ca_bidirectional *b, const lens_join *join, ca_worker *worker)
{
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    ca_light_walk *walk = join->walk;
    const float weight = weight_of(b, join, scratch);
    if (weight == 0.0f) return true;
    const ca_splat record = {.film = join->direct.film_position,
                             .value = ca_rgb_scale(join->unweighted, weight),
                             .weight = weight,
                             .light_vertices = (walk->walk.vertex + 1) & 0x3fff,
                             .light_path = walk->path & (CA_CHUNK_PATHS - 1)};
    if (!ca_rgb_is_finite(record.value)) {
        worker->counters.non_finite[CA_TECHNIQUE_SPLAT]++;
        return true;
    }
    const uint32_t number = (uint32_t)scratch->splats.count;
    return keep(scratch, &record, walk) &&
           (b->other_count == 0 || ca_pairs_scale_splat(b, scratch, number, weight));
}

static uint32_t ask_all(const ca_bidirectional *b, ca_light_walk *const *walks, uint32_t count, lens_join *joins,
                        ca_walk_rays *rays)
{
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++) {
        const ca_walk *w = &walks[i]->walk;
        lens_join *join = &joins[asked];
        if (!ca_vertex_is_smooth(&w->last) || !ask(b, walks[i], join)) continue;
        const ca_vec3 to_camera = join->direct.to_camera;
        const ca_vec3 origin = ca_vertex_leave(&w->last, to_camera);
        ca_walk_rays_set(rays, asked++, origin, to_camera, 0.0f, join->touches ? 0.0f : join->direct.t_near);
    }
    return asked;
}

bool ca_splat_all(const ca_bidirectional *b, ca_light_walk *const *walks, uint32_t count, ca_worker *worker)
{
    lens_join joins[CA_WALKS];
    ca_walk_rays *rays = b->scratch[worker->index].rays;
    const uint32_t asked = ask_all(b, walks, count, joins, rays);
    worker->counters.shadow_rays += asked;
    ca_accel_occluded_batch(b->input.scene->accel, &rays->rays, asked, rays->occluded);
    for (uint32_t i = 0; i < asked; i++)
        if ((joins[i].touches || !rays->occluded[i]) && !take(b, &joins[i], worker)) return false;
    return true;
}
