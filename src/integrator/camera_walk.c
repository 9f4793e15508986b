/* Camera paths: hits and next event here, the joins with light paths in join.c. */
#include "integrator/bidirectional.h"
#include "integrator/walk.h"

bool ca_camera_walk_add(ca_camera_walk *walk, uint32_t chunk, ca_technique technique, uint32_t s, uint32_t t,
                        ca_rgb unweighted, float weight)
{
    const ca_rgb value = ca_rgb_scale(unweighted, weight);
    if (!(ca_rgb_is_finite(value) && value.r >= 0.0f && value.g >= 0.0f && value.b >= 0.0f)) {
        walk->worker->counters.non_finite[technique]++;
        return false;
    }
    ca_rgb *sum = &walk->scratch->chunk_light[chunk];
    *sum = ca_rgb_add(*sum, value);
    ca_technique_images *images = walk->b->input.technique_images;
    if (images)
        ca_technique_images_add(images, technique, s, t, walk->x, walk->y,
                                ca_rgb_scale(unweighted, walk->sample->filter_weight / (float)walk->b->camera_paths),
                                weight);
    return true;
}

/* Only one round gathers what needs no light paths. */
static inline bool gathers_own_light(const ca_camera_walk *walk) { return walk->b->first_chunk == 0; }

static inline ca_path_vertex *last_vertex(const ca_camera_walk *walk) { return &walk->scratch->camera[walk->vertex]; }

/* ---- Hit ------------------------------------------------------------------------------------------------------- */

/* The path's last vertex lies on the light; surface NULL: at infinity. */
static void add_hit(ca_camera_walk *walk, uint32_t light_index, const ca_surface *surface)
{
    const ca_bidirectional *b = walk->b;
    if (!gathers_own_light(walk) || (walk->vertex == 1 && b->hide_emitters)) return;
    if (walk->hooks && walk->hooks->shows_light && !walk->hooks->shows_light(walk)) return;
    const ca_scene *scene = b->input.scene;
    const ca_light *light = &scene->lights[light_index];
    const ca_path_vertex *v = last_vertex(walk);
    const ca_light_hit hit = ca_light_eval_hit(light, walk->origin, surface, ca_neg(walk->direction));
    const ca_rgb unweighted = ca_rgb_mul(walk->throughput, hit.radiance);
    if (ca_rgb_is_black(unweighted)) return;

    const float choice = ca_light_choice_probability(&scene->light_choice, light_index);
    const float cos_light = surface ? ca_abs_dot(surface->ng, walk->direction) : 1.0f;
    ca_path_vertex end;
    const ca_flight flight =
        ca_light_end(light, choice, hit.pdf_position, hit.pdf_direction, cos_light, &b->rules.reuse, &end);
    const float to_light =
        surface ? v->distance : ca_light_disk_distance(light, ca_neg(walk->direction), walk->origin);
    const ca_mis_path path = {
        .camera = {.vertices = walk->scratch->camera,
                   .count = walk->vertex + 1,
                   .pdf_last = end.pdf_forward,
                   .pdf_before = {ca_flight_density(&flight, to_light, walk->flight.cos_out)},
                   .sqrt_area = end.sqrt_area,
                   .spread = flight.sqrt_omega,
                   .cos_ratio = 1.0f},
        .next_event_ratio =
            hit.next_event_ratio * ca_light_choice_ratio(&scene->light_choice, &walk->receiver, light_index),
        .light_choice = choice,
        .light_infinite = ca_light_is_infinite(light),
        .camera_distance = walk->scratch->camera[1].distance,
    };
    const float weight = ca_mis_weight(&b->rules, &path, CA_TECHNIQUE_HIT);
    if (ca_camera_walk_add(walk, 0, CA_TECHNIQUE_HIT, walk->vertex + 1, 0, unweighted, weight) &&
        walk->scratch->pairing)
        ca_pairs_add_alone(walk, unweighted, weight);
}

/* The path left the scene: its last vertex is a direction. */
static void add_environment(ca_camera_walk *walk)
{
    const ca_scene *scene = walk->b->input.scene;
    if (scene->environment == CA_NONE) return;
    ca_path_vertex *v = &walk->scratch->camera[++walk->vertex];
    const ca_light *light = &scene->lights[scene->environment];
    *v = (ca_path_vertex){.pdf_forward = {walk->flight.pdf},
                          .distance = ca_light_disk_distance(light, ca_neg(walk->direction), walk->origin),
                          .cos_ratio = 1.0f,
                          .connectable_count = (v - 1)->connectable_count};
    add_hit(walk, scene->environment, NULL);
}

/* ---- Next event ------------------------------------------------------------------------------------------------ */

/* `choice`: the probability of choosing the light here, which for emission is another. */
static float next_event_weight(const ca_camera_walk *walk, uint32_t light_index, float choice,
                               const ca_light_direct *direct, const ca_bsdf_value *value, float cos_out)
{
    const ca_scene *scene = walk->b->input.scene;
    const ca_light *light = &scene->lights[light_index];
    const float emission_choice = ca_light_choice_probability(&scene->light_choice, light_index);
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_path_vertex *v = last_vertex(walk);
    ca_path_vertex end;
    const ca_flight flight = ca_light_end(light, emission_choice, direct->pdf_position, direct->pdf_direction,
                                          direct->cos_light, reuse, &end);
    const bool infinite = ca_light_is_infinite(light);
    const float distance = infinite ? ca_light_disk_distance(light, ca_neg(direct->to_light), walk->surface.position)
                                    : direct->distance;
    /* Meeting the light by chance: not a Dirac one; one at infinity has a density of directions. */
    const float hit_factor = !flight.reversible ? 0.0f : infinite ? 1.0f : direct->cos_light / ca_sqr(distance);
    const ca_mis_path path = {
        .camera = {.vertices = walk->scratch->camera,
                   .count = walk->vertex + 1,
                   .pdf_last = {ca_flight_density(&flight, distance, cos_out)},
                   .pdf_before = {value->pdf_reverse.v * v->to_previous},
                   .sqrt_area = ca_flight_sqrt_area(&flight, distance),
                   .sqrt_omega = flight.sqrt_omega,
                   .spread = ca_footprint_spread(reuse->epsilon, value->pdf_reverse),
                   .cos_ratio = cos_out / ca_abs_dot(walk->surface.ng, walk->wi)},
        .light = {.vertices = &end, .count = 1, .pdf_last = {value->pdf.v * hit_factor}, .cos_ratio = 1.0f},
        .next_event_ratio = direct->next_event_ratio * (choice / emission_choice),
        .light_choice = emission_choice,
        .light_infinite = ca_light_is_infinite(light),
        .camera_distance = walk->scratch->camera[1].distance,
    };
    return ca_mis_weight(&walk->b->rules, &path, CA_TECHNIQUE_NEXT_EVENT);
}

void ca_camera_walk_next_event(ca_camera_walk *walk, bool weighted)
{
    const ca_bidirectional *b = walk->b;
    const ca_scene *scene = b->input.scene;
    const uint32_t dimension = ca_vertex_dimension(walk->vertex - 1);
    float choice;
    const ca_light_receiver receiver = ca_walk_receiver(&walk->surface, &walk->bsdf, walk->wi);
    const uint32_t index = ca_light_choice_sample_direct(
        &scene->light_choice, &receiver, ca_sample_1d(&walk->stream, dimension + CA_DIM_NEXT_LIGHT), &choice);
    if (index == CA_NONE) return;
    const ca_light *light = &scene->lights[index];
    ca_light_direct direct;
    if (!ca_light_sample_direct(light, walk->surface.position,
                                ca_sample_2d(&walk->stream, dimension + CA_DIM_NEXT_EVENT), &direct))
        return;
    const ca_bsdf_value value = ca_bsdf_eval(&walk->bsdf, walk->wi, direct.to_light, CA_FROM_CAMERA);
    const float cos_out = ca_abs_dot(walk->surface.ng, direct.to_light);
    const float factor = cos_out / (choice * direct.pdf_direct.v);
    const ca_rgb unweighted =
        ca_rgb_scale(ca_rgb_mul(ca_rgb_mul(walk->throughput, value.f), direct.radiance), factor);
    if (ca_rgb_is_black(unweighted)) return;
    walk->worker->counters.shadow_rays++;
    if (!ca_walk_light_is_visible(scene->accel, &walk->surface, &direct)) return;
    const float weight = weighted ? next_event_weight(walk, index, choice, &direct, &value, cos_out) : 1.0f;
    if (ca_camera_walk_add(walk, 0, CA_TECHNIQUE_NEXT_EVENT, walk->vertex + 1, 1, unweighted, weight) &&
        walk->scratch->pairing)
        ca_pairs_add_alone(walk, unweighted, weight);
}

/* ---- The walk -------------------------------------------------------------------------------------------------- */

/* Follows the ray to the next vertex; false where the path ends. */
static bool advance(ca_camera_walk *walk)
{
    const ca_scene *scene = walk->b->input.scene;
    ca_hit hit;
    walk->worker->counters.rays++;
    if (!ca_accel_intersect(scene->accel, walk->origin, walk->direction, walk->t_min, walk->t_max, &hit)) {
        add_environment(walk);
        return false;
    }
    ca_accel_surface(scene->accel, walk->origin, walk->direction, &hit, &walk->surface);
    walk->wi = ca_neg(walk->direction);
    const float cos_in = ca_abs_dot(walk->surface.ng, walk->wi);
    if (!(cos_in > 0.0f) || !(hit.t > 0.0f)) return false;
    const uint32_t k = ++walk->vertex;
    ca_path_vertex *v = &walk->scratch->camera[k];
    ca_path_vertex_arrive(v, v - 1, &walk->flight, hit.t, cos_in,
                          ca_bidirectional_density(walk->b, walk->surface.position));
    if (walk->surface.light != CA_NONE) add_hit(walk, walk->surface.light, &walk->surface);
    return k == 1 || k < walk->b->max_depth;
}

/* Asks the lights and joins the last vertex with all that light paths offer. */
static void gather(ca_camera_walk *walk)
{
    const ca_mis_rules *rules = &walk->b->rules;
    const bool merges = ca_bidirectional_merges(walk->b);
    ca_photon_query query;
    if (!(walk->bsdf.scatter & CA_SCATTER_SMOOTH)) return;
    if (walk->hooks) {
        walk->hooks->at_vertex(walk);
        return;
    }
    if (merges) ca_photon_grid_prefetch(walk->b->chunks[0].grid, walk->surface.position);
    if (rules->next_event && gathers_own_light(walk)) ca_camera_walk_next_event(walk, true);
    if (merges) ca_join_merge_start(walk, &query);
    if (rules->connect && walk->paired_chunk) ca_join_connect(walk);
    if (merges) ca_join_merge(walk, &query);
}

/* Does the algorithm do nothing behind the last vertex' event? */
static bool is_finished(const ca_camera_walk *walk)
{
    const ca_mis_rules *rules = &walk->b->rules;
    if (rules->hit == CA_HIT_DIRECT) return true;
    return rules->hit == CA_HIT_UNMERGEABLE && last_vertex(walk)->connectable_count >= rules->merge_limit;
}

static bool scatter(ca_camera_walk *walk)
{
    const uint32_t dimension = ca_vertex_dimension(walk->vertex - 1);
    const ca_vec2 u_lobe_roulette = ca_sample_2d(&walk->stream, dimension + CA_DIM_BSDF_LOBE);
    ca_bsdf_sample event;
    if (!ca_bsdf_sample_direction(&walk->bsdf, walk->wi, u_lobe_roulette.x,
                                  ca_sample_2d(&walk->stream, dimension + CA_DIM_BSDF_DIRECTION), CA_FROM_CAMERA,
                                  &event))
        return false;
    ca_path_vertex *v = last_vertex(walk);
    walk->flight = ca_path_vertex_scatter(v, v - 1, walk->wi, walk->surface.ng, &event, &walk->b->rules.reuse);
    if (is_finished(walk)) return false;
    walk->throughput = ca_rgb_mul(walk->throughput, event.weight);
    walk->eta2 *= ca_sqr(event.eta);
    walk->receiver = ca_walk_receiver(&walk->surface, &walk->bsdf, walk->wi);
    walk->origin =
        ca_offset_origin(walk->surface.position, walk->surface.position_error, walk->surface.ng, event.wo_world);
    walk->direction = event.wo_world;
    walk->t_min = 0.0f;
    walk->t_max = INFINITY;
    return ca_walk_survives(walk->vertex + 1, walk->b->rr_depth, walk->eta2, u_lobe_roulette.y, &walk->throughput);
}

void ca_camera_walk_trace(ca_camera_walk *walk)
{
    const ca_scene *scene = walk->b->input.scene;
    const uint32_t max_depth = walk->b->max_depth;
    while (walk->vertex + 2 < CA_PATH_MAX_VERTICES) {
        if (!advance(walk)) return;
        ca_bsdf_init(&walk->bsdf, scene->materials, scene->desc.textures.items, &walk->surface, walk->wi);
        if (walk->vertex == 1) ca_walk_record_primary_hit(&walk->surface, &walk->bsdf, walk->wi, walk->sample);
        if (walk->vertex >= max_depth) return;
        gather(walk);
        if (!scatter(walk)) return;
    }
}

static void start(ca_camera_walk *walk, uint32_t index)
{
    const ca_integrator_input *input = &walk->b->input;
    walk->stream = ca_stream_start(input->sampler, (uint64_t)walk->y * input->camera->width + walk->x, index);
    const ca_camera_ray ray = ca_walk_camera_ray(input->camera, input->filter, &walk->stream, walk->x, walk->y,
                                                 &walk->sample->filter_weight);
    walk->receiver = (ca_light_receiver){.position = ray.origin};
    walk->origin = ray.origin;
    walk->direction = ray.direction;
    walk->t_min = ray.t_min;
    walk->t_max = ray.t_max;
    walk->throughput = ray.weight;
    walk->eta2 = 1.0f;
    walk->flight = ca_camera_end(input->camera, ray.pdf_position, ray.pdf_direction, &walk->b->rules.reuse,
                                 &walk->scratch->camera[0]);
}

/* Which light path this camera path connects to. Over the passes a pixel meets them all: it must not stay with one
 * part of a low-discrepancy sequence. */
static void pair(ca_camera_walk *walk, uint32_t index)
{
    const ca_bidirectional *b = walk->b;
    if (!b->rules.connect) return;
    const uint64_t pixel = (uint64_t)walk->y * b->input.camera->width + walk->x;
    const uint64_t number = (pixel * b->camera_paths + index % b->camera_paths + b->pairing_shift) % b->light_paths;
    const uint64_t chunk = number / CA_CHUNK_PATHS;
    if (chunk < b->first_chunk || chunk >= b->first_chunk + b->chunks_now) return;
    walk->connect_slot = (uint32_t)(chunk - b->first_chunk);
    walk->paired_chunk = &b->chunks[walk->connect_slot];
    walk->paired = (uint32_t)(number % CA_CHUNK_PATHS);
    walk->scratch->light_ready = 0;
}

void ca_camera_walk_start(ca_camera_walk *walk, const ca_bidirectional *b, uint32_t x, uint32_t y, uint32_t index,
                          ca_film_sample *sample, ca_worker *worker)
{
    walk->b = b;
    walk->worker = worker;
    walk->scratch = &b->scratch[worker->index];
    walk->sample = sample;
    walk->x = x;
    walk->y = y;
    walk->vertex = 0;
    walk->paired_chunk = NULL;
    walk->hooks = NULL;
    start(walk, index);
    for (uint32_t c = 0; c <= b->chunks_now; c++) walk->scratch->chunk_light[c] = (ca_rgb){0};
}

void ca_bidirectional_camera_path(const void *state, uint32_t x, uint32_t y, uint32_t index, uint32_t round,
                                  ca_film_sample *sample, ca_worker *worker)
{
    const ca_bidirectional *b = state;
    ca_camera_walk walk;
    ca_camera_walk_start(&walk, b, x, y, index, sample, worker);
    pair(&walk, index);
    if (round == 0) worker->counters.camera_paths++;
    if (walk.scratch->pairing) ca_pair_sums_next_path(walk.scratch->pairs);
    if (b->max_depth > 0) ca_camera_walk_trace(&walk);
    for (uint32_t c = 0; c < b->chunks_now; c++)
        sample->radiance = ca_rgb_add(sample->radiance, walk.scratch->chunk_light[c]);
}
