/* Unidirectional path tracing with next event estimation: a path from the camera finds light by hitting emitters and
 * by asking one light at every vertex, and each way is weighted by multiple importance sampling (Veach 1997, chapter
 * 9).
 *
 * max_depth, rr_depth and hide_emitters mean what Mitsuba 3's `path` means by them: a depth of 1 sees emitters only;
 * the roulette may end a path after vertex rr_depth. It begins earlier than Mitsuba's and ends fewer (walk.h). */
#include "integrator/path.h"

#include "base/memory.h"
#include "base/stop.h"
#include "light/environment_lanes.h"

enum { MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS, HEURISTIC, NEXT_EVENT };

static const ca_parameter_spec path_parameters[] = {
    [MAX_DEPTH] = {"max_depth", CA_SPEC_INTEGER, .minimum = -1, .number = -1},
    [RR_DEPTH] = {"rr_depth", CA_SPEC_INTEGER, .minimum = 1, .number = CA_ROULETTE_DEPTH},
    [HIDE_EMITTERS] = {"hide_emitters", CA_SPEC_BOOLEAN, .number = 0},
    [HEURISTIC] = {"heuristic", CA_SPEC_CHOICE, .choices = "balance|power", .number = 1},
    [NEXT_EVENT] = {"next_event", CA_SPEC_BOOLEAN, .number = 1},
    {.name = NULL},
};

void path_contribute(const path_state *state, ca_batch *batch, uint32_t slot, ca_technique technique, uint32_t s,
                     ca_rgb contribution, float weight, ca_counters *counters)
{
    const bool valid = contribution.r >= 0.0f && contribution.g >= 0.0f && contribution.b >= 0.0f;
    if (!valid || !ca_rgb_is_finite(contribution)) {
        counters->non_finite[technique]++;
        return;
    }
    batch->radiance[slot] = ca_rgb_add(batch->radiance[slot], contribution);
    if (state->input.tells_shown && technique == CA_TECHNIQUE_HIT && !batch->met_smooth[slot])
        batch->paths[slot].shown += ca_luminance(contribution);
    if (!state->images || !(weight > 0.0f)) return;
    const ca_camera_path *path = &batch->paths[slot];
    ca_technique_images_add(state->images, technique, s, technique == CA_TECHNIQUE_HIT ? 0 : 1, path->x, path->y,
                            ca_rgb_scale(contribution, path->sample->filter_weight / weight), weight);
}

/* ---- Observers ------------------------------------------------------------------------------------------------- */

static void keep_point(ca_batch *batch, uint32_t slot, ca_surface_point point)
{
    ca_surface_point *last = batch->points[slot];
    last[0] = last[1];
    last[1] = last[2];
    last[2] = point;
}

static void keep_starts(ca_batch *batch)
{
    for (uint32_t i = 0; i < batch->count; i++)
        keep_point(batch, batch->slot[i], (ca_surface_point){.position = ca_column3_at(&batch->rays.origin, i)});
}

static void keep_vertices(ca_batch *batch, const ca_scene *scene)
{
    for (uint32_t i = 0; i < batch->count; i++) {
        ca_surface_point point = {.shape = CA_NONE};
        const ca_vec3 origin = ca_column3_at(&batch->rays.origin, i), to = ca_column3_at(&batch->rays.direction, i);
        if (!ca_batch_left(batch, i)) {
            point = ca_surface_point_of(ca_batch_surface(batch, scene, i));
        } else if (scene->environment != CA_NONE) {
            point.position = ca_madd(origin, 4.0f * scene->radius, to);
        }
        keep_point(batch, batch->slot[i], point);
    }
}

void path_observe(const path_state *state, const ca_batch *batch, uint32_t slot, const ca_light_vertex *light,
                  float weight)
{
    const ca_surface_point *last = batch->points[slot];
    const ca_mis_rules rules = {.power = state->power_heuristic, .hit = CA_HIT_ALWAYS, .next_event = true};
    const ca_mis_path record = {.camera = {.count = light ? 2 : 3}, .light = {.count = light ? 1 : 0}};
    const ca_observed_path observed = {.rules = &rules,
                                       .technique = light ? CA_TECHNIQUE_NEXT_EVENT : CA_TECHNIQUE_HIT,
                                       .path = &record,
                                       .weight = weight,
                                       .camera = light ? &last[1] : last,
                                       .light = light};
    state->input.observer->see(state->input.observer->user, &observed);
}

/* ---- Hit ------------------------------------------------------------------------------------------------------- */

/* The path hit an emitter. */
static void add_emission(const path_state *state, ca_batch *batch, uint32_t i, uint32_t light_index,
                         const ca_surface *surface, ca_counters *counters)
{
    const ca_light *light = &state->scene->lights[light_index];
    const ca_vec3 out = ca_neg(ca_column3_at(&batch->rays.direction, i));
    const ca_rgb throughput = {batch->throughput.x[i], batch->throughput.y[i], batch->throughput.z[i]};
    const uint32_t vertices = batch->segments + 1, slot = batch->slot[i];
    if (batch->dirac[i] || !state->next_event) { /* next event could not have found it */
        const ca_rgb radiance = ca_light_radiance(light, surface, out);
        path_contribute(state, batch, slot, CA_TECHNIQUE_HIT, vertices, ca_rgb_mul(throughput, radiance), 1.0f,
                        counters);
        return;
    }
    const ca_light_receiver receiver = {ca_column3_at(&batch->previous, i),
                                        ca_column3_at(&batch->previous_normal, i)};
    const ca_light_hit hit = ca_light_eval_hit(light, receiver.position, surface, out);
    const float pdf_choice = ca_light_choice_direct_probability(&state->scene->light_choice, &receiver, light_index);
    const float weight = path_mis_weight(state, batch->pdf[i], pdf_choice * hit.pdf_direct.v);
    if (batch->points && !ca_rgb_is_black(hit.radiance)) path_observe(state, batch, slot, NULL, weight);
    path_contribute(state, batch, slot, CA_TECHNIQUE_HIT, vertices,
                    ca_rgb_scale(ca_rgb_mul(throughput, hit.radiance), weight), weight, counters);
}

/* What a light reads of the surface that was hit: of an even one at a matte point, place and normal alone. */
static const ca_surface *emitting_surface(const path_state *state, ca_batch *batch, uint32_t i)
{
    ca_vertex_batch *v = &batch->vertices;
    if (!v->matte[i] || !state->scene->even_lights[v->light[i]].is_even)
        return ca_batch_surface(batch, state->scene, i);
    v->surfaces[i].position = ca_column3_at(&v->position, i);
    v->surfaces[i].ng = ca_column3_at(&v->ng, i);
    return &v->surfaces[i];
}

/* The probabilities with which next event chose the environment, for those of the eight paths that have a bit. */
static ca_f8 choice_of_sky(const path_state *state, const ca_batch *batch, uint32_t i, uint32_t bits)
{
    _Alignas(32) float choice[CA_LANES] = {0.0f};
    for (; bits; bits &= bits - 1) {
        const uint32_t k = (uint32_t)__builtin_ctz(bits);
        const ca_light_receiver receiver = {ca_column3_at(&batch->previous, i + k),
                                            ca_column3_at(&batch->previous_normal, i + k)};
        choice[k] =
            ca_light_choice_direct_probability(&state->scene->light_choice, &receiver, state->scene->environment);
    }
    return ca_load8(choice, 0);
}

/* add_emission for those of the eight paths from `i` on that have a bit: they have left the scene. */
static void add_sky(const path_state *state, ca_batch *batch, uint32_t i, uint32_t bits, ca_counters *counters)
{
    const uint32_t environment = state->scene->environment, vertices = batch->segments + 1;
    const ca_f8 choice = choice_of_sky(state, batch, i, bits);
    const ca_environment8 sky = ca_light_environment_hit8(&state->scene->lights[environment],
                                                          ca_column3_load(&batch->rays.direction, i));
    const ca_f8 weight = path_mis_weight8(state, ca_load8(batch->pdf, i), choice * sky.pdf_direct);
    const ca_v8 throughput = ca_column3_load(&batch->throughput, i);
    const ca_v8 light = {throughput.x * sky.radiance.x, throughput.y * sky.radiance.y, throughput.z * sky.radiance.z};
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const uint32_t slot = batch->slot[i + (uint32_t)k];
        const bool only_technique = batch->dirac[i + (uint32_t)k] || !state->next_event;
        const float share = only_technique ? 1.0f : weight[k];
        const ca_rgb found = {light.x[k], light.y[k], light.z[k]};
        if (batch->points && !only_technique && !ca_rgb_is_black(found))
            path_observe(state, batch, slot, NULL, share);
        path_contribute(state, batch, slot, CA_TECHNIQUE_HIT, vertices, ca_rgb_scale(found, share), share, counters);
    }
}

static void add_emissions(const path_state *state, ca_batch *batch, ca_counters *counters)
{
    if (batch->segments == 1 && state->hide_emitters) return;
    const ca_m8 none = ca_m8_all((int32_t)CA_NONE);
    const bool has_sky = state->scene->environment != CA_NONE;
    for (uint32_t first = 0; first < batch->count; first += CA_LANES) {
        const ca_m8 left = ca_load8_u32(batch->hits.shape, first) == none;
        const ca_m8 lit = ~left & (ca_load8_u32(batch->vertices.light, first) != none);
        const uint32_t sky = has_sky ? ca_mask_bits_below(left, batch->count - first) : 0;
        if (sky) add_sky(state, batch, first, sky, counters);
        for (uint32_t bits = ca_mask_bits_below(lit, batch->count - first); bits; bits &= bits - 1) {
            const uint32_t i = first + (uint32_t)__builtin_ctz(bits);
            add_emission(state, batch, i, batch->vertices.light[i], emitting_surface(state, batch, i), counters);
        }
    }
}

/* Of each path, whether it met an event that is no Dirac one. */
static void note_smooth(ca_batch *batch)
{
    for (uint32_t i = 0; i < batch->count; i++) batch->met_smooth[batch->slot[i]] |= !batch->dirac[i];
}

/* ---- The batch ------------------------------------------------------------------------------------------------- */

static void trace(const path_state *state, ca_batch *batch, ca_worker *worker)
{
    if (batch->points) keep_starts(batch);
    if (state->input.tells_shown) memset(batch->met_smooth, 0, sizeof batch->met_smooth);
    while (batch->count > 0 && !ca_stop_asked(state->input.stop)) {
        if (state->input.tells_shown) note_smooth(batch);
        ca_batch_intersect(batch, state->scene, worker);
        const bool last = batch->segments >= state->max_depth;
        const bool wants_bsdf = !last || batch->segments == 1;
        ca_batch_arrive(batch, state->scene, wants_bsdf);
        if (batch->points) keep_vertices(batch, state->scene);
        add_emissions(state, batch, &worker->counters);
        if (batch->segments == 1) ca_batch_record_primary(batch);
        if (last) return;
        if (state->next_event) path_add_next_event(state, batch, worker);
        ca_batch_scatter(batch, state->rr_depth);
    }
}

static void path_camera_paths(const void *opaque, ca_camera_path *paths, uint32_t count, uint32_t round,
                              ca_worker *worker)
{
    (void)round; /* always the first: there are no light paths */
    const path_state *state = opaque;
    ca_batch *batch = &state->batches[worker->index];
    batch->points = state->points ? state->points + (size_t)worker->index * CA_BATCH : NULL;
    for (uint32_t first = 0; first < count; first += CA_BATCH) {
        const uint32_t size = ca_min_u32(count - first, CA_BATCH);
        ca_batch_start_camera(batch, &state->input, paths + first, size);
        worker->counters.camera_paths += size;
        if (state->max_depth > 0) trace(state, batch, worker);
        for (uint32_t slot = 0; slot < size; slot++) {
            paths[first + slot].sample->radiance = batch->radiance[slot];
            paths[first + slot].segments += batch->work[slot];
        }
    }
}

static ca_status check_lights_can_be_hit(const ca_scene *scene, ca_error *error)
{
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const bool point = ca_light_has_dirac_position(&scene->lights[i]);
        if (point || ca_light_has_dirac_direction(&scene->lights[i]))
            return ca_fail(error, CA_ERROR_UNSUPPORTED, &scene->desc.lights.items[i].where,
                           "without next_event the integrator \"path\" cannot find this light: it %s",
                           point ? "has no extent" : "shines in one direction only");
    }
    return CA_OK;
}

static void path_destroy(void *opaque)
{
    path_state *state = opaque;
    ca_free(state->batches);
    ca_free(state->points);
    ca_free(state);
}

static ca_status path_create(const ca_integrator_input *input, void **state, ca_error *error)
{
    const bool next_event = input->values[NEXT_EVENT] != 0.0;
    if (!next_event) CA_TRY(check_lights_can_be_hit(input->scene, error));
    path_state *created = ca_alloc(1, sizeof *created);
    if (!created) return ca_fail_memory(error, "the integrator");
    *created =
        (path_state){.input = *input,
                     .scene = input->scene,
                     .max_depth = input->values[MAX_DEPTH] < 0.0 ? UINT32_MAX : (uint32_t)input->values[MAX_DEPTH],
                     .rr_depth = (uint32_t)input->values[RR_DEPTH],
                     .hide_emitters = input->values[HIDE_EMITTERS] != 0.0,
                     .power_heuristic = input->values[HEURISTIC] != 0.0,
                     .next_event = next_event,
                     .images = input->technique_images,
                     .batches = ca_alloc_large(input->workers, sizeof *created->batches)};
    if (input->observer)
        created->points = ca_alloc_zeroed((size_t)input->workers * CA_BATCH, sizeof *created->points);
    if (created->batches && (created->points || !input->observer)) {
        *state = created;
        return CA_OK;
    }
    path_destroy(created);
    return ca_fail_memory(error, "the integrator");
}

static const ca_mis_rules path_rules = {.hit = CA_HIT_ALWAYS, .next_event = true};

const ca_integrator_type ca_integrator_path = {
    .name = "path",
    .parameters = path_parameters,
    .rules = &path_rules,
    .create = path_create,
    .destroy = path_destroy,
    .camera_paths = path_camera_paths,
};
