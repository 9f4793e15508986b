/* Merges of a camera path's vertex with photons, the vertices of all light paths, that are close. */
#include "integrator/bidirectional.h"

#include "base/stop.h"
#include "path/merge_surface.h"

/* ---- One merge ------------------------------------------------------------------------------------------------- */

/* Nothing of the photon's path is looked at. Rules whose paths have tails know no footprints. */
static float weight_by_sums(const ca_camera_walk *walk, const ca_light_store *store, const ca_light_record *photon,
                            const ca_bsdf_value *value)
{
    const ca_mis_rules *rules = &walk->b->rules;
    const ca_photon_sums *sums = ca_light_record_sums(&store->layout, photon);
    const ca_walk *w = &walk->walk;
    const ca_mis_side camera =
        ca_join_scattering(w->densities, w->vertex + 1, (ca_arrival){.pdf = {sums->pdf_forward}}, value->pdf_reverse,
                           1.0f, &rules->reuse, w->tail);
    return ca_mis_merge_weight(rules, &camera, sums, value->pdf.v);
}

/* The path whose split lies behind the merged vertex, which is the camera's. Its light's last vertex is the photon's
 * previous one. */
float ca_merge_weight(const ca_camera_walk *walk, const ca_light_store *store, const ca_light_record *photon,
                      const ca_bsdf_value *value)
{
    if (!walk->b->weighs_merges) return 1.0f;
    if (walk->b->rules.photon_sums) return weight_by_sums(walk, store, photon, value);
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const float *start = ca_light_record_start(&store->layout, photon);
    ca_path_vertex *light = walk->scratch->merged, *l = &light[photon->index];
    ca_light_unpack(&store->layout, start, photon->index + 1u, light);
    const ca_walk *w = &walk->walk;
    const float cos_out = ca_abs_dot(w->last.ng, photon->wi);
    const float ratio = cos_out / w->last.cos_in;
    const ca_arrival from_light = {.pdf = l->pdf_forward, .sqrt_area = l->sqrt_area, .sqrt_omega = l->sqrt_omega};
    const ca_flight flight = ca_flight_towards(ca_camera_walk_vertex(walk), value->pdf, cos_out, ratio, reuse);
    const ca_arrival from_camera = {.pdf = {value->pdf.v * l->to_previous},
                                    .sqrt_area = ca_flight_sqrt_area(&flight, l->distance),
                                    .sqrt_omega = flight.sqrt_omega};
    ca_mis_path path = ca_join(
        ca_join_scattering(w->densities, w->vertex + 1, from_light, value->pdf_reverse, ratio, reuse,
                           CA_MIS_NO_TAIL),
        ca_join_scattered(light, photon->index, from_camera), light, w->densities[1].distance,
        walk->factors);
    path.merged = true;
    path.merged_density = l->photon_density;
    if (walk->scratch->seen)
        ca_light_unpack_points(&store->layout, start, photon->index + 1u, walk->scratch->seen);
    return ca_bidirectional_weight(walk->b, walk->scratch, CA_TECHNIQUE_MERGE, &path, walk->points,
                                   walk->scratch->seen);
}

static void merge_with(ca_camera_walk *walk, uint32_t chunk, const ca_light_record *photon, float normalisation)
{
    const ca_bsdf_value value = ca_vertex_eval(&walk->walk.last, photon->wi, CA_FROM_CAMERA);
    const ca_rgb unweighted = ca_rgb_scale(
        ca_rgb_mul(ca_rgb_mul(walk->walk.throughput, value.f), photon->throughput), normalisation);
    if (ca_rgb_is_black(unweighted)) return;
    walk->worker->counters.merges++;
    walk->path->merges++;
    const float weight = ca_merge_weight(walk, &walk->b->store, photon, &value);
    if (ca_camera_walk_add(walk, chunk, CA_TECHNIQUE_MERGE, walk->walk.vertex + 1, photon->index + 1u, unweighted,
                           weight) &&
        walk->scratch->pairing)
        ca_pairs_add_merge(walk, chunk, photon, unweighted, weight);
}

/* ---- Queries --------------------------------------------------------------------------------------------------- */

/* Buckets, photons and the densities of their paths lie all over the memory. Several queries go through each
 * step together, which asks the memory for what the next step reads: so waiting overlaps, which would be most of what
 * a merge costs. */
enum { MERGE_QUERIES = 8 };

typedef struct merge_query {
    ca_camera_walk *walk;
    ca_merge_surface surface;
    ca_photon_query query;
    uint32_t found[CA_PHOTON_BATCH], count;
} merge_query;

static bool find(merge_query *m)
{
    m->count = ca_photon_query_next(&m->query, m->found);
    for (uint32_t i = 0; i < m->count; i++)
        ca_light_record_prefetch(&m->walk->b->store, m->found[i]);
    return m->count > 0;
}

/* Not too long a path, and on the same surface. */
static inline bool may_merge(const merge_query *m, const ca_light_record *photon)
{
    return m->walk->walk.vertex + photon->index <= m->walk->b->max_depth &&
           ca_merge_is_on_surface(&m->surface, photon);
}

static void select_photons(merge_query *m)
{
    const ca_light_store *store = &m->walk->b->store;
    const bool weighs = m->walk->b->weighs_merges, sums = m->walk->b->rules.photon_sums;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < m->count; i++) {
        const ca_light_record *photon = ca_light_record_at(store, m->found[i]);
        if (!may_merge(m, photon)) continue;
        m->found[kept++] = m->found[i];
        if (sums)
            __builtin_prefetch(ca_light_record_sums(&store->layout, photon));
        else if (weighs)
            ca_light_densities_prefetch(store, photon);
    }
    m->count = kept;
}

static void merge(const merge_query *m, float normalisation)
{
    const ca_light_store *store = &m->walk->b->store;
    for (uint32_t i = 0; i < m->count; i++)
        merge_with(m->walk, ca_light_chunk_of(store, m->found[i]), ca_light_record_at(store, m->found[i]),
                   normalisation);
}

/* All batches of photons that the queries find. */
static void answer(merge_query *queries, uint32_t count)
{
    const ca_bidirectional *b = queries[0].walk->b;
    const float normalisation = 1.0f / (b->rules.merge_area * (float)b->light_paths);
    bool more = true;
    while (more && !ca_stop_asked(b->input.stop)) {
        more = false;
        for (uint32_t i = 0; i < count; i++) more |= find(&queries[i]);
        for (uint32_t i = 0; i < count; i++) select_photons(&queries[i]);
        for (uint32_t i = 0; i < count; i++) merge(&queries[i], normalisation);
    }
    for (uint32_t i = 0; i < count; i++) queries[i].walk->worker->counters.photons_tested += queries[i].query.tested;
}

void ca_merge_all(ca_camera_walk *const *walks, uint32_t count)
{
    merge_query queries[MERGE_QUERIES];
    const ca_photon_grid *grid = walks[0]->b->grid;
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (i + MERGE_QUERIES < count) ca_photon_grid_prefetch(grid, walks[i + MERGE_QUERIES]->walk.last.position);
        if (!ca_vertex_is_smooth(&walks[i]->walk.last)) continue;
        queries[asked].walk = walks[i];
        queries[asked].surface = ca_merge_surface_of(walks[i]->b->input.scene, &walks[i]->walk.last);
        ca_photon_query_start(&queries[asked++].query, grid, walks[i]->walk.last.position);
        if (asked < MERGE_QUERIES) continue;
        answer(queries, asked);
        asked = 0;
    }
    if (asked > 0) answer(queries, asked);
}
