/* What a block of pairs brings to a pixel: every camera path of the pixel in the block with every light path of the
 * block. */
#include "integrator/qmcppm.h"

#include "base/stop.h"
#include "path/merge_surface.h"

#include <string.h>

/* A kept camera path that looks for photons, vertex by vertex. The walk has what merges read: the path's densities
 * where merges are weighted, and, made when the first photon is found, surface and BSDF. */
typedef struct gather {
    const ca_qmcppm *q;
    const ca_camera_record *record;
    const ca_gather_vertex *vertices; /* of the record */
    const ca_gather_vertex *vertex;   /* that looks now */
    ca_merge_surface surface;         /* there */
    ca_camera_walk walk;
    ca_pair_covariances *pairs; /* of the pixel; NULL: not wanted */
    ca_block_sample *pixel;
    bool made;
    float radius;
    ca_rgb sum;       /* over the block's light paths */
    ca_vec3 gradient; /* of irradiance, luminance, at the first vertex; over the block's light paths */
    ca_photon_query query;
    uint32_t found[CA_PHOTON_BATCH], found_count;
} gather;

/* Photons lie all over the memory: several camera paths look for them together, as in merge.c. Where covariances of
 * a pixel are wanted, which are told pairs path by path, they look one after the other. */
enum { GATHERS = 8 };

typedef struct gather_group {
    const ca_qmcppm *q;
    ca_worker *worker;
    uint32_t count;
    gather gathers[GATHERS];
} gather_group;

/* ---- Merges ---------------------------------------------------------------------------------------------------- */

static void make_vertex(gather *g)
{
    const ca_scene *scene = g->q->input.scene;
    if (g->made) return;
    ca_vertex_from_point(&g->walk.walk.last, scene, &g->vertex->point, g->vertex->wi);
    g->made = true;
}

/* Was there a Dirac event between the light and the photon? */
static bool photon_met_dirac(const ca_light_store *store, const ca_light_record *photon)
{
    return ca_light_met_dirac(&store->layout, ca_light_record_start(&store->layout, photon), photon->index - 1u);
}

static bool may_merge(const gather *g, const ca_light_store *store, const ca_light_record *photon)
{
    const ca_qmcppm *q = g->q;
    if (g->vertex->vertex + photon->index > q->engine->max_depth) return false;
    if (!ca_merge_is_on_surface(&g->surface, photon)) return false;
    if (photon->index == 1 && !q->direct_photons) return false;
    return q->transport == CA_TRANSPORT_ALL ||
           ca_qmcppm_shows(q, g->vertex->dirac != 0 || photon_met_dirac(store, photon));
}

/* How fast the irradiance changes, on the side from which the surface is seen. */
static void add_gradient(gather *g, const ca_light_record *photon, ca_vec3 offset)
{
    const ca_vec3 ng = g->vertex->point.ng;
    if (ca_dot(ng, photon->wi) * ca_dot(ng, g->vertex->wi) <= 0.0f) return;
    const ca_vec3 gradient = ca_kernel_gradient(g->q->kernel, offset, g->radius);
    g->gradient = ca_madd(g->gradient, ca_luminance(photon->throughput), gradient);
}

/* What the pair of the current camera path and the photon's light path gets, as the image does. */
static void add_pair(gather *g, uint32_t chunk, const ca_light_record *photon, ca_rgb contribution)
{
    const uint32_t path = ca_light_record_path(&g->q->engine->store.layout, photon);
    ca_pair_covariances_add(g->pairs, chunk * (uint32_t)CA_CHUNK_PATHS + path,
                            (double)ca_luminance(contribution) * (double)g->record->sample.filter_weight);
}

static void merge(gather *g, uint32_t number)
{
    const ca_qmcppm *q = g->q;
    const ca_light_store *store = &q->engine->store;
    const ca_light_record *photon = ca_light_record_at(store, number);
    if (!may_merge(g, store, photon)) return;
    float t = 0.0f; /* squared distance over squared radius; the disk does not ask */
    if (ca_kernel_is_smooth(q->kernel)) {
        const ca_vec3 offset = ca_sub(photon->position, g->vertex->point.position);
        t = ca_length2(offset) / ca_sqr(g->radius);
        if (q->gradients && g->vertex == g->vertices) add_gradient(g, photon, offset);
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

/* ---- Queries --------------------------------------------------------------------------------------------------- */

static void start_query(gather *g, uint32_t vertex)
{
    g->vertex = &g->vertices[vertex];
    const ca_surface_point *point = &g->vertex->point;
    g->surface = ca_merge_surface_at(g->q->input.scene, point->shape, point->ng, g->vertex->wi);
    g->walk.walk.vertex = g->vertex->vertex;
    g->radius = g->vertex->radius0 * g->q->shrink;
    g->made = false;
    ca_photon_query_start_within(&g->query, g->q->engine->grid, point->position, g->radius);
}

static bool find(gather *g)
{
    g->found_count = ca_photon_query_next(&g->query, g->found);
    for (uint32_t i = 0; i < g->found_count; i++)
        ca_light_record_prefetch(&g->q->engine->store, g->found[i]);
    return g->found_count > 0;
}

static void merge_found(gather *g)
{
    for (uint32_t i = 0; i < g->found_count; i++) merge(g, g->found[i]);
}

/* All batches of photons that the queries find. */
static void answer(gather *const *asking, uint32_t count, const int *stop)
{
    bool more = true;
    while (more && !ca_stop_asked(stop)) {
        more = false;
        for (uint32_t i = 0; i < count; i++) more |= find(asking[i]);
        for (uint32_t i = 0; i < count; i++) merge_found(asking[i]);
    }
    for (uint32_t i = 0; i < count; i++) asking[i]->walk.worker->counters.photons_tested += asking[i]->query.tested;
}

/* ---- Camera paths ---------------------------------------------------------------------------------------------- */

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

/* Puts the block's number-th camera path, which is the pixel's, into the group. */
static void begin_gather(gather_group *group, uint64_t number, ca_block_sample *pixel)
{
    const ca_qmcppm *q = group->q;
    const ca_camera_record *record = &q->camera.records[number];
    const ca_camera_task *task = &q->camera.tasks[number / CA_CAMERA_TASK];
    ca_bidirectional_scratch *scratch = &q->engine->scratch[group->worker->index];
    const uint32_t slot = group->count++;
    gather *g = &group->gathers[slot];
    g->q = q;
    g->record = record;
    g->vertices = task->vertices + record->first;
    g->walk.b = q->engine;
    g->walk.factors = NULL;
    g->walk.worker = group->worker;
    g->walk.scratch = scratch;
    g->walk.points = NULL;
    g->walk.walk.densities = scratch->densities + (size_t)slot * scratch->row;
    g->pixel = pixel;
    g->sum = (ca_rgb){0};
    g->gradient = (ca_vec3){0};
    g->pairs = q->pairs ? &q->pairs[group->worker->index] : NULL;
    if (record->count > 0) ca_photon_grid_prefetch(q->engine->grid, g->vertices->point.position);
    if (q->weighted && record->count > 0) {
        const uint32_t last = g->vertices[record->count - 1].vertex;
        memcpy(g->walk.walk.densities, &task->densities[record->densities], (last + 1) * sizeof *task->densities);
    }
}

/* The group's paths with all photons of the block. */
static void look(gather_group *group)
{
    gather *asking[GATHERS];
    uint32_t count = group->count;
    for (uint32_t vertex = 0; count > 0; vertex++) {
        count = 0;
        for (uint32_t i = 0; i < group->count; i++) {
            if (group->gathers[i].record->count <= vertex) continue;
            start_query(&group->gathers[i], vertex);
            asking[count++] = &group->gathers[i];
        }
        answer(asking, count, group->q->input.stop);
    }
}

/* Adds the paths of a group to their pixels, with the covariances of the only one if they are wanted. */
static void finish_group(gather_group *group)
{
    for (uint32_t i = 0; i < group->count; i++) {
        const gather *g = &group->gathers[i];
        if (!g->pairs) continue;
        ca_pair_covariances_next_path(g->pairs);
        ca_pair_covariances_add_alone(g->pairs, (double)ca_luminance(g->record->own_light) *
                                                    (double)g->record->sample.filter_weight);
    }
    look(group);
    for (uint32_t i = 0; i < group->count; i++) {
        const gather *g = &group->gathers[i];
        const ca_film_sample *sample = &g->record->sample;
        add_path(group->q, sample, g->record->own_light, g->sum, g->pixel);
        g->pixel->irradiance_gradient =
            ca_madd(g->pixel->irradiance_gradient, sample->filter_weight, g->gradient);
    }
    group->count = 0;
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
    for (walk->paired = 0; walk->paired < b->paths_now && !ca_stop_asked(b->input.stop); walk->paired++) {
        walk->light_ready = false;
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

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

/* The number of a pixel's first camera path within the block; the next ones follow P apart. */
static uint64_t first_of_pixel(const ca_qmcppm *q, uint32_t x, uint32_t y)
{
    const uint32_t *crop = q->input.crop;
    const uint64_t pixel = (uint64_t)(y - crop[1]) * (crop[2] - crop[0]) + (x - crop[0]);
    return (pixel + q->pixels - q->camera.first % q->pixels) % q->pixels;
}

static void connect_pixel(const ca_qmcppm *q, uint32_t x, uint32_t y, ca_block_sample *sum, ca_worker *worker)
{
    for (uint64_t n = first_of_pixel(q, x, y); n < q->camera.count && !ca_stop_asked(q->input.stop); n += q->pixels) {
        ca_film_sample sample = {0};
        ca_rgb own_light;
        const uint32_t index = (uint32_t)((q->camera.first + n) / q->pixels);
        const ca_rgb joined = connect_path(q, x, y, index, &sample, &own_light, worker);
        add_path(q, &sample, own_light, joined, sum);
    }
}

/* false: there is a stop, and the block is given up. */
static bool gather_pixel(gather_group *group, uint32_t x, uint32_t y, ca_block_sample *sum)
{
    const ca_qmcppm *q = group->q;
    const uint32_t most = q->pairs ? 1 : GATHERS;
    for (uint64_t n = first_of_pixel(q, x, y); n < q->camera.count; n += q->pixels) {
        if (ca_stop_asked(q->input.stop)) return false;
        begin_gather(group, n, sum);
        if (group->count == most) finish_group(group);
    }
    return true;
}

static void gather_pixel_with_pairs(gather_group *group, uint32_t x, uint32_t y, ca_block_sample *sum)
{
    const ca_qmcppm *q = group->q;
    ca_pair_covariances *pairs = &q->pairs[group->worker->index];
    ca_pair_covariances_begin(pairs, (uint32_t)q->light_count);
    if (!gather_pixel(group, x, y, sum)) return;
    sum->out_of_memory = !ca_pair_covariances_finish(pairs, &sum->covariance);
    sum->visits_camera = q->visits.camera;
    sum->visits_light = q->visits.light;
}

void ca_qmcppm_block_pixels(const void *state, uint32_t x, uint32_t y, uint32_t count, ca_block_sample *sums,
                            ca_worker *worker)
{
    const ca_qmcppm *q = state;
    gather_group group;
    group.q = q;
    group.worker = worker;
    group.count = 0;
    for (uint32_t i = 0; i < count; i++)
        if (q->connect)
            connect_pixel(q, x + i, y, &sums[i], worker);
        else if (q->pairs)
            gather_pixel_with_pairs(&group, x + i, y, &sums[i]);
        else
            (void)gather_pixel(&group, x + i, y, &sums[i]);
    finish_group(&group);
}
