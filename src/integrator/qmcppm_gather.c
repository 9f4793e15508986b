/* What a block of pairs brings to a pixel: every camera path of the pixel in the block with every light path of the
 * block. */
#include "integrator/qmcppm.h"

#include <string.h>

/* A vertex of a camera path that looks for photons. The walk has what merges read: the path's densities where merges
 * are weighted, and, made when the first photon is found, surface and BSDF. */
typedef struct gather {
    const ca_qmcppm *q;
    const ca_gather_vertex *vertex;
    ca_camera_walk walk;
    ca_pair_covariances *pairs; /* of the pixel; NULL: not wanted */
    float filter_weight;
    bool made;
    float radius;
    ca_rgb sum;       /* over the block's light paths */
    ca_vec3 gradient; /* of irradiance, luminance; over the block's light paths */
} gather;

/* ---- Merges ---------------------------------------------------------------------------------------------------- */

static void make_vertex(gather *g)
{
    const ca_scene *scene = g->q->input.scene;
    if (g->made) return;
    ca_vertex_from_point(&g->walk.walk.last, scene, &g->vertex->point, g->vertex->wi);
    g->made = true;
}

/* Was there a Dirac event between the light and the photon? */
static bool photon_met_dirac(const ca_light_store *store, const ca_light_vertex *photon)
{
    const ca_path_vertex *before = ca_light_density_at(store, photon->first + photon->index - 1);
    return before->connectable_count < photon->index - 1;
}

static bool may_merge(const gather *g, const ca_light_store *store, const ca_light_vertex *photon)
{
    const ca_qmcppm *q = g->q;
    if (g->vertex->vertex + photon->index > q->engine->max_depth) return false;
    if (ca_dot(photon->point.ng, g->vertex->point.ng) < CA_MERGE_MIN_COS) return false;
    if (photon->index == 1 && !q->direct_photons) return false;
    return q->transport == CA_TRANSPORT_ALL ||
           ca_qmcppm_shows(q, g->vertex->dirac != 0 || photon_met_dirac(store, photon));
}

/* How fast the irradiance changes, on the side from which the surface is seen. */
static void add_gradient(gather *g, const ca_light_vertex *photon, ca_vec3 offset)
{
    const ca_vec3 ng = g->vertex->point.ng;
    if (ca_dot(ng, photon->wi) * ca_dot(ng, g->vertex->wi) <= 0.0f) return;
    const ca_vec3 gradient = ca_kernel_gradient(g->q->kernel, offset, g->radius);
    g->gradient = ca_madd(g->gradient, ca_luminance(photon->throughput), gradient);
}

/* What the pair of the current camera path and the photon's light path gets, as the image does. */
static void add_pair(gather *g, uint32_t chunk, const ca_light_vertex *photon, ca_rgb contribution)
{
    ca_pair_covariances_add(g->pairs, chunk * (uint32_t)CA_CHUNK_PATHS + photon->path,
                            (double)ca_luminance(contribution) * (double)g->filter_weight);
}

static void merge(gather *g, uint32_t number)
{
    const ca_qmcppm *q = g->q;
    const ca_light_store *store = &q->engine->store;
    const ca_light_vertex *photon = ca_light_vertex_at(store, number);
    if (!may_merge(g, store, photon)) return;
    float t = 0.0f; /* squared distance over squared radius; the disk does not ask */
    if (ca_kernel_is_smooth(q->kernel)) {
        const ca_vec3 offset = ca_sub(photon->point.position, g->vertex->point.position);
        t = ca_length2(offset) / ca_sqr(g->radius);
        if (q->gradients) add_gradient(g, photon, offset);
    }
    make_vertex(g);
    const ca_bsdf_value value = ca_vertex_eval(&g->walk.walk.last, photon->wi, CA_FROM_CAMERA);
    const float kernel = ca_kernel_value(q->kernel, t) / ca_sqr(g->radius);
    ca_rgb contribution =
        ca_rgb_scale(ca_rgb_mul(ca_rgb_mul(g->vertex->throughput, value.f), photon->throughput), kernel);
    if (ca_rgb_is_black(contribution)) return;
    g->walk.worker->counters.merges++;
    if (q->weighted)
        contribution = ca_rgb_scale(contribution, ca_merge_weight(&g->walk, store, photon, &value));
    if (!ca_rgb_is_finite(contribution) || contribution.r < 0.0f || contribution.g < 0.0f || contribution.b < 0.0f) {
        g->walk.worker->counters.non_finite[CA_TECHNIQUE_MERGE]++;
        return;
    }
    g->sum = ca_rgb_add(g->sum, contribution);
    if (g->pairs) add_pair(g, ca_light_chunk_of(store, number), photon, contribution);
}

static void merge_all(gather *g)
{
    const ca_bidirectional *engine = g->q->engine;
    uint32_t found[CA_PHOTON_BATCH], count;
    ca_photon_query query;
    ca_photon_query_start_within(&query, engine->grid, g->vertex->point.position, g->radius);
    while ((count = ca_photon_query_next(&query, found)) > 0) {
        for (uint32_t i = 0; i < count; i++) __builtin_prefetch(ca_light_vertex_at(&engine->store, found[i]));
        for (uint32_t i = 0; i < count; i++) merge(g, found[i]);
    }
    g->walk.worker->counters.photons_tested += query.tested;
}

/* A kept camera path with all photons of the block. The gradient is that at the first vertex that looks for
 * photons. */
static ca_rgb gather_record(const ca_qmcppm *q, uint64_t number, ca_vec3 *gradient, ca_worker *worker)
{
    const ca_camera_record *record = &q->camera.records[number];
    const ca_camera_task *task = &q->camera.tasks[number / CA_CAMERA_TASK];
    gather g;
    g.q = q;
    g.walk.b = q->engine;
    g.walk.worker = worker;
    g.walk.scratch = &q->engine->scratch[worker->index];
    g.walk.points = NULL;
    g.walk.walk.densities = g.walk.scratch->densities;
    g.sum = (ca_rgb){0};
    g.pairs = q->pairs ? &q->pairs[worker->index] : NULL;
    g.filter_weight = record->sample.filter_weight;
    if (q->weighted && record->count > 0) {
        const uint32_t last = task->vertices[record->first + record->count - 1].vertex;
        memcpy(g.walk.walk.densities, &task->densities[record->densities], (last + 1) * sizeof *task->densities);
    }
    for (uint32_t i = 0; i < record->count; i++) {
        g.vertex = &task->vertices[record->first + i];
        g.walk.walk.vertex = g.vertex->vertex;
        g.radius = g.vertex->radius0 * q->shrink;
        g.gradient = (ca_vec3){0};
        g.made = false;
        merge_all(&g);
        if (i == 0) *gradient = g.gradient;
    }
    return g.sum;
}

/* ---- Shadow rays ----------------------------------------------------------------------------------------------- */

/* Joins the last vertex of the only walk with every light path of the block. */
static void connect_all(ca_camera_walk *const *walks, uint32_t count)
{
    ca_camera_walk *walk = walks[0];
    const ca_bidirectional *b = walk->b;
    if (!ca_vertex_is_smooth(&walk->walk.last)) return;
    ca_next_events(walks, count, true);
    walk->has_paired = true;
    walk->connect_slot = 1;
    for (walk->paired = 0; walk->paired < b->paths_now; walk->paired++) {
        walk->light_ready = 0;
        ca_connect_all(&walk, 1);
    }
}

/* A camera path, traced again, with all light paths of the block; *own_light is what it finds without them. */
static ca_rgb connect_path(const ca_qmcppm *q, uint32_t x, uint32_t y, uint32_t index, ca_film_sample *sample,
                           ca_rgb *own_light, ca_worker *worker)
{
    static const ca_walk_hooks hooks = {.at_vertices = connect_all};
    ca_camera_walk *walk = &q->engine->scratch[worker->index].camera_walks[0];
    ca_camera_path path = {.x = x, .y = y, .index = index, .sample = sample};
    ca_camera_walk_start(walk, q->engine, &path, 0, worker);
    walk->hooks = &hooks;
    worker->counters.camera_paths++;
    if (q->engine->max_depth > 0) ca_camera_walks_trace(&walk, 1);
    *own_light = walk->light[0];
    return walk->light[1];
}

/* ---- A pixel --------------------------------------------------------------------------------------------------- */

/* Adds a camera path: what it found alone counts for each of the block's pairs. */
static void add_path(const ca_qmcppm *q, const ca_film_sample *sample, ca_rgb own_light, ca_rgb joined,
                     ca_block_sample *sum)
{
    const ca_rgb light = ca_rgb_madd(joined, (float)q->light_count, own_light);
    sum->radiance = ca_rgb_madd(sum->radiance, sample->filter_weight, light);
    sum->albedo = ca_rgb_add(sum->albedo, sample->albedo);
    sum->normal = ca_add(sum->normal, sample->normal);
    sum->position = ca_add(sum->position, sample->position);
    sum->paths++;
    sum->pairs += q->light_count;
}

/* A kept camera path, with the covariances of the pixel if they are wanted. */
static void add_record(const ca_qmcppm *q, uint64_t number, ca_block_sample *sum, ca_worker *worker)
{
    const ca_camera_record *record = &q->camera.records[number];
    ca_pair_covariances *pairs = q->pairs ? &q->pairs[worker->index] : NULL;
    const float weight = record->sample.filter_weight;
    ca_vec3 gradient = {0};
    if (pairs) {
        ca_pair_covariances_next_path(pairs);
        ca_pair_covariances_add_alone(pairs, (double)ca_luminance(record->own_light) * (double)weight);
    }
    const ca_rgb joined = gather_record(q, number, &gradient, worker);
    add_path(q, &record->sample, record->own_light, joined, sum);
    sum->irradiance_gradient = ca_madd(sum->irradiance_gradient, weight, gradient);
}

void ca_qmcppm_block_pixel(const void *state, uint32_t x, uint32_t y, ca_block_sample *sum, ca_worker *worker)
{
    const ca_qmcppm *q = state;
    const uint32_t *crop = q->input.crop;
    const uint64_t pixel = (uint64_t)(y - crop[1]) * (crop[2] - crop[0]) + (x - crop[0]);
    /* Numbers of the pixel's camera paths within the block. */
    const uint64_t first = (pixel + q->pixels - q->camera.first % q->pixels) % q->pixels;
    if (q->pairs) ca_pair_covariances_begin(&q->pairs[worker->index], (uint32_t)q->light_count);
    for (uint64_t n = first; n < q->camera.count; n += q->pixels) {
        if (q->connect) {
            ca_film_sample sample = {0};
            ca_rgb own_light;
            const uint32_t index = (uint32_t)((q->camera.first + n) / q->pixels);
            const ca_rgb joined = connect_path(q, x, y, index, &sample, &own_light, worker);
            add_path(q, &sample, own_light, joined, sum);
        } else {
            add_record(q, n, sum, worker);
        }
    }
    if (!q->pairs) return;
    sum->out_of_memory = !ca_pair_covariances_finish(&q->pairs[worker->index], &sum->covariance);
    sum->visits_camera = q->visits.camera;
    sum->visits_light = q->visits.light;
}
