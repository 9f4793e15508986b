/* Next event of the bidirectional engine: each vertex asks one light. */
#include "integrator/bidirectional.h"

static float weight_of(const ca_next_event *event)
{
    const ca_camera_walk *walk = event->walk;
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_light_direct *direct = &event->direct;
    const ca_light *light = event->light;
    ca_path_vertex end;
    /* Emission chooses the light with another probability. */
    const uint32_t number = (uint32_t)(light - walk->b->input.scene->lights);
    const ca_emission_guide *guide = walk->b->guide;
    const float choice = ca_emission_probability(guide, &walk->b->input.scene->light_choice, number);
    const bool infinite = ca_light_is_infinite(light);
    const ca_emitted_ray ray = {.origin = infinite ? walk->walk.last.position : direct->position,
                                .ng = direct->ng,
                                .direction = ca_neg(direct->to_light)};
    const ca_emission_pdf pdf = ca_emission_ray_pdf(guide, number, &ray,
                                                    (ca_emission_pdf){direct->pdf_position, direct->pdf_direction});
    const ca_flight flight =
        ca_light_end(light, choice, pdf.position, pdf.direction, direct->cos_light, reuse, &end);
    end.light_class = ca_factor_light(number);
    end.next_event_ratio = direct->next_event_ratio * (event->choice / choice);
    const float distance =
        infinite ? ca_light_disk_distance(light, ca_neg(direct->to_light), walk->walk.last.position)
                 : direct->distance;
    /* Meeting the light by chance: not a Dirac one; one at infinity has a density of directions. */
    const float hit_factor = !flight.reversible ? 0.0f : infinite ? 1.0f : direct->cos_light / ca_sqr(distance);
    const float cos_ratio = event->cos_out / walk->walk.last.cos_in;
    const ca_mis_path path =
        ca_join(ca_join_scattering(walk->walk.densities, walk->walk.vertex + 1,
                                   ca_arrive(&flight, distance, event->cos_out), event->value.pdf_reverse, cos_ratio,
                                   reuse, walk->walk.tail),
                ca_join_end(&end, (ca_pdf_area){event->value.pdf.v * hit_factor}), &end,
                walk->walk.densities[1].distance, walk->factors);
    const ca_light_vertex start = {.point = {.position = direct->position, .ng = direct->ng, .shape = number}};
    return ca_bidirectional_weight(walk->b, walk->scratch, CA_TECHNIQUE_NEXT_EVENT, &path, walk->points, &start);
}

/* Chooses a light and a point of it; false: there is none. */
static bool choose(const ca_camera_walk *walk, ca_next_event *event)
{
    const ca_scene *scene = walk->b->input.scene;
    const ca_walk *w = &walk->walk;
    const uint32_t dimension = ca_vertex_dimension(w->vertex - 1);
    const ca_light_receiver receiver = ca_vertex_receiver(&w->last);
    const uint32_t index =
        ca_light_choice_sample_direct(&scene->light_choice, &receiver,
                                      ca_sample_1d(&w->stream, dimension + CA_DIM_NEXT_LIGHT), &event->choice);
    if (index == CA_NONE) return false;
    event->light = &scene->lights[index];
    return ca_even_light_sample_direct(&scene->even_lights[index], event->light, w->last.position,
                                       ca_sample_2d(&w->stream, dimension + CA_DIM_NEXT_EVENT), &event->direct);
}

/* The same as paper 003 has it. */
static bool choose_paired(const ca_camera_walk *walk, ca_next_event *event)
{
    uint32_t index;
    if (!ca_paper_direct(walk, &index, &event->choice, &event->direct)) return false;
    event->light = &walk->b->input.scene->lights[index];
    return true;
}

/* false: there is nothing to ask. */
static bool ask(ca_camera_walk *walk, ca_next_event *event)
{
    const ca_walk *w = &walk->walk;
    event->walk = walk;
    if (!(walk->b->paper ? choose_paired(walk, event) : choose(walk, event))) return false;
    const ca_light_direct *direct = &event->direct;
    event->value = ca_vertex_eval(&w->last, direct->to_light, CA_FROM_CAMERA);
    if (walk->b->paper) event->value = ca_paper_value(event->value);
    event->cos_out = ca_abs_dot(w->last.ng, direct->to_light);
    const float factor = event->cos_out / (event->choice * direct->pdf_direct.v);
    event->unweighted =
        ca_rgb_scale(ca_rgb_mul(ca_rgb_mul(w->throughput, event->value.f), direct->radiance), factor);
    return !ca_rgb_is_black(event->unweighted);
}

static ca_next_event_ray ray_of(const ca_next_event *event)
{
    const ca_vertex *last = &event->walk->walk.last;
    return ca_walk_next_event_ray(last->position, last->position_error, last->ng, &event->direct);
}

static void count_ray(ca_camera_walk *walk)
{
    walk->worker->counters.shadow_rays++;
    walk->path->segments++;
}

static void take(const ca_next_event *event, bool weighted)
{
    ca_camera_walk *walk = event->walk;
    const float weight = weighted ? weight_of(event) : 1.0f;
    walk->light_class = ca_factor_light((uint32_t)(event->light - walk->b->input.scene->lights));
    if (ca_camera_walk_add(walk, 0, CA_TECHNIQUE_NEXT_EVENT, walk->walk.vertex + 1, 1, event->unweighted, weight) &&
        walk->scratch->pairing)
        ca_pairs_add_alone(walk, event->unweighted, weight);
}

void ca_next_events(ca_camera_walk *const *walks, uint32_t count, bool weighted)
{
    if (count == 0) return;
    ca_bidirectional_scratch *scratch = walks[0]->scratch;
    const ca_accel *accel = walks[0]->b->input.scene->accel;
    uint32_t asked = 0;
    for (uint32_t i = 0; i < count; i++) {
        ca_next_event *event = &scratch->next_events[asked];
        if (!ca_vertex_is_smooth(&walks[i]->walk.last) || !ask(walks[i], event)) continue;
        const ca_next_event_ray ray = ray_of(event);
        ca_walk_rays_set(scratch->rays, asked++, ray.origin, ray.direction, 0.0f, ray.t_max);
        count_ray(walks[i]);
    }
    ca_accel_occluded_batch(accel, &scratch->rays->rays, asked, scratch->rays->occluded);
    for (uint32_t i = 0; i < asked; i++)
        if (!scratch->rays->occluded[i]) take(&scratch->next_events[i], weighted);
}
