/* Light paths: vertices for connections, photons, and splats to the lens. */
#include "integrator/bidirectional.h"
#include "integrator/walk.h"

#include "base/memory.h"

typedef struct light_walk {
    const ca_bidirectional *b;
    ca_worker *worker;
    ca_light_block *block;
    ca_stream stream;
    uint32_t path;               /* its number in the chunk */
    uint32_t first;              /* number of v[0] in the store */
    ca_path_vertex *densities;   /* of the path, v[0] first */
    ca_light_vertex *vertices;
    uint32_t vertex;             /* number of the last vertex, = segments so far */
    uint32_t light_index;
    const ca_light *light;
    ca_vec3 origin, direction;
    ca_flight flight;
    ca_rgb throughput;           /* flux, W */
    float start;                 /* largest component of the flux that was emitted */
    ca_vec3 wi;
    ca_surface surface;
    ca_bsdf bsdf;
} light_walk;

/* Chooses a light and lets it emit. */
static bool emit(light_walk *walk)
{
    const ca_bidirectional *b = walk->b;
    const ca_scene *scene = b->input.scene;
    float choice;
    const uint32_t index =
        ca_light_choice_sample(&scene->light_choice, ca_sample_1d(&walk->stream, CA_DIM_LIGHT_CHOICE), &choice);
    if (index == CA_NONE) return false;
    walk->light_index = index;
    walk->light = &scene->lights[index];
    ca_light_emission e;
    if (!ca_light_sample_emission(walk->light, ca_sample_2d(&walk->stream, CA_DIM_LIGHT_POSITION),
                                  ca_sample_2d(&walk->stream, CA_DIM_LIGHT_DIRECTION), &e))
        return false;
    const float pdf = choice * e.pdf_position.v * e.pdf_direction.v;
    walk->throughput = ca_rgb_scale(e.radiance, e.cos_light / pdf);
    walk->start = ca_rgb_max(walk->throughput);
    if (!(walk->start > 0.0f) || !ca_rgb_is_finite(walk->throughput)) return false;
    walk->flight = ca_light_end(walk->light, choice, e.pdf_position, e.pdf_direction, e.cos_light, &b->rules.reuse,
                                &walk->densities[0]);
    walk->vertices[0].point = (ca_surface_point){.position = e.origin, .ng = e.ng};
    walk->origin = ca_offset_origin(e.origin, e.origin_error, e.ng, e.direction);
    walk->direction = e.direction;
    return true;
}

/* How next event from v[1] would choose light and v[0]. */
static float next_event_ratio_of_start(const light_walk *walk)
{
    const ca_surface_point *start = &walk->vertices[0].point;
    const ca_light_receiver receiver = ca_walk_receiver(&walk->surface, &walk->bsdf, walk->wi);
    return ca_light_next_event_ratio(walk->light, walk->surface.position, start->position, start->ng) *
           ca_light_choice_ratio(&walk->b->input.scene->light_choice, &receiver, walk->light_index);
}

/* Follows the ray to the next surface; false where it leaves the scene. */
static bool advance(light_walk *walk)
{
    const ca_scene *scene = walk->b->input.scene;
    ca_hit hit;
    walk->worker->counters.rays++;
    if (!ca_accel_intersect(scene->accel, walk->origin, walk->direction, 0.0f, INFINITY, &hit)) return false;
    ca_accel_surface(scene->accel, walk->origin, walk->direction, &hit, &walk->surface);
    walk->wi = ca_neg(walk->direction);
    const float cos_in = ca_abs_dot(walk->surface.ng, walk->wi);
    if (!(cos_in > 0.0f) || !(hit.t > 0.0f)) return false; /* along the surface: no measure */
    const uint32_t k = ++walk->vertex;
    ca_path_vertex_arrive(&walk->densities[k], &walk->densities[k - 1], &walk->flight, hit.t, cos_in,
                          ca_bidirectional_density(walk->b, walk->surface.position));
    ca_bsdf_init(&walk->bsdf, scene->materials, scene->desc.textures.items, &walk->surface, walk->wi);
    if (k == 1) walk->densities[0].next_event_ratio = next_event_ratio_of_start(walk);
    return true;
}

static bool store_photon(light_walk *walk)
{
    ca_light_block *block = walk->block;
    if (!ca_array_reserve((void **)&block->photons, &block->photon_capacity, block->photon_count + 1,
                          sizeof *block->photons))
        return false;
    block->photons[block->photon_count++] =
        (ca_photon){.position = walk->surface.position, .vertex = walk->first + walk->vertex};
    walk->worker->counters.photons++;
    return true;
}

static bool store_vertex(light_walk *walk)
{
    const bool capable = (walk->bsdf.scatter & CA_SCATTER_SMOOTH) != 0;
    walk->vertices[walk->vertex] = (ca_light_vertex){.point = ca_surface_point_of(&walk->surface),
                                                     .wi = walk->wi,
                                                     .throughput = walk->throughput,
                                                     .first = walk->first,
                                                     .index = (uint16_t)walk->vertex,
                                                     .capable = capable};
    return !capable || !ca_bidirectional_merges(walk->b) || store_photon(walk);
}

/* ---- Splats ---------------------------------------------------------------------------------------------------- */

static bool camera_is_visible(const light_walk *walk, const ca_camera_direct *direct)
{
    const ca_surface *surface = &walk->surface;
    const ca_vec3 origin =
        ca_offset_origin(surface->position, surface->position_error, surface->ng, direct->to_camera);
    if (!(direct->t_near > 0.0f)) return true;
    return !ca_accel_occluded(walk->b->input.scene->accel, origin, direct->to_camera, 0.0f, direct->t_near);
}

/* The weight of the path lens, this vertex, ..., light. */
static float splat_weight(const light_walk *walk, const ca_camera_direct *direct, const ca_bsdf_value *value,
                          float cos_out)
{
    const ca_reuse_rules *reuse = &walk->b->rules.reuse;
    const ca_path_vertex *v = &walk->densities[walk->vertex];
    ca_path_vertex lens;
    const ca_flight flight =
        ca_camera_end(walk->b->input.camera, direct->pdf_position, direct->pdf_direction, reuse, &lens);
    const ca_mis_path path = {
        .camera = {.vertices = &lens, .count = 1, .cos_ratio = 1.0f},
        .light = {.vertices = walk->densities,
                  .count = walk->vertex + 1,
                  .pdf_last = {ca_flight_density(&flight, direct->distance, cos_out)},
                  .pdf_before = {value->pdf_reverse.v * v->to_previous},
                  .sqrt_area = ca_flight_sqrt_area(&flight, direct->distance),
                  .sqrt_omega = flight.sqrt_omega,
                  .spread = ca_footprint_spread(reuse->epsilon, value->pdf_reverse),
                  .cos_ratio = cos_out / ca_abs_dot(walk->surface.ng, walk->wi)},
        .next_event_ratio = walk->densities[0].next_event_ratio,
        .light_choice = walk->densities[0].light_choice,
        .light_infinite = walk->densities[0].at_infinity,
        .camera_distance = direct->distance,
    };
    return ca_mis_weight(&walk->b->rules, &path, CA_TECHNIQUE_SPLAT);
}

/* Connects the last vertex to a point of the lens; false when out of memory. */
static bool splat(light_walk *walk)
{
    const ca_integrator_input *input = &walk->b->input;
    const ca_vec2 u_lens = ca_sample_2d(&walk->stream, ca_vertex_dimension(walk->vertex - 1) + CA_DIM_NEXT_EVENT);
    ca_camera_direct direct;
    if (!ca_camera_sample_direct(input->camera, walk->surface.position, u_lens, input->filter->radius, &direct))
        return true;
    const ca_bsdf_value value = ca_bsdf_eval(&walk->bsdf, walk->wi, direct.to_camera, CA_FROM_LIGHT);
    const float cos_out = ca_abs_dot(walk->surface.ng, direct.to_camera);
    const float factor = cos_out * direct.importance / direct.pdf_direct.v;
    const ca_rgb unweighted = ca_rgb_scale(ca_rgb_mul(walk->throughput, value.f), factor);
    if (ca_rgb_is_black(unweighted)) return true;
    walk->worker->counters.shadow_rays++;
    if (!camera_is_visible(walk, &direct)) return true;
    const float weight = splat_weight(walk, &direct, &value, cos_out);
    if (weight == 0.0f) return true;
    const ca_splat record = {.film = direct.film_position,
                             .value = ca_rgb_scale(unweighted, weight),
                             .weight = weight,
                             .light_vertices = (walk->vertex + 1) & 0x3fff,
                             .light_path = walk->path & (CA_CHUNK_PATHS - 1)};
    if (!ca_rgb_is_finite(record.value)) {
        walk->worker->counters.non_finite[CA_TECHNIQUE_SPLAT]++;
        return true;
    }
    return ca_splat_list_add(&walk->block->splats, &record);
}

/* ---- The walk -------------------------------------------------------------------------------------------------- */

static bool scatter(light_walk *walk)
{
    const uint32_t dimension = ca_vertex_dimension(walk->vertex - 1);
    const ca_vec2 u_lobe_roulette = ca_sample_2d(&walk->stream, dimension + CA_DIM_BSDF_LOBE);
    ca_bsdf_sample event;
    if (!ca_bsdf_sample_direction(&walk->bsdf, walk->wi, u_lobe_roulette.x,
                                  ca_sample_2d(&walk->stream, dimension + CA_DIM_BSDF_DIRECTION), CA_FROM_LIGHT,
                                  &event))
        return false;
    ca_path_vertex *v = &walk->densities[walk->vertex];
    walk->flight =
        ca_path_vertex_scatter(v, v - 1, walk->wi, walk->surface.ng, &event, &walk->b->rules.reuse);
    walk->throughput = ca_rgb_mul(walk->throughput, event.weight);
    walk->origin =
        ca_offset_origin(walk->surface.position, walk->surface.position_error, walk->surface.ng, event.wo_world);
    walk->direction = event.wo_world;
    const float relative = 1.0f / walk->start; /* the roulette looks at what is left, not at watts */
    ca_rgb left = ca_rgb_scale(walk->throughput, relative);
    if (!ca_walk_survives(walk->vertex + 1, walk->b->rr_depth, 1.0f, u_lobe_roulette.y, &left)) return false;
    walk->throughput = ca_rgb_scale(left, walk->start);
    return true;
}

/* Traces until the path ends; the number of vertices, 0 when out of memory. */
static uint32_t trace(light_walk *walk)
{
    const ca_bidirectional *b = walk->b;
    if (!emit(walk)) return 1;
    while (walk->vertex + 1 < CA_PATH_MAX_VERTICES && walk->vertex + 1 < b->max_depth) {
        if (!advance(walk)) break;
        const bool capable = (walk->bsdf.scatter & CA_SCATTER_SMOOTH) != 0;
        if (!store_vertex(walk)) return 0;
        if (b->rules.splat && capable && !splat(walk)) return 0;
        if (!scatter(walk)) break;
    }
    return walk->vertex + 1;
}

void ca_light_walk(const ca_bidirectional *b, ca_light_chunk *chunk, uint32_t path, uint64_t number,
                   ca_light_block *block, ca_worker *worker)
{
    ca_light_path *record = &chunk->store.paths[path];
    *record = (ca_light_path){0};
    light_walk walk = {.b = b, .worker = worker, .block = block, .path = path};
    if (!ca_light_store_path_begin(&chunk->store, worker->index, &walk.first, &walk.densities, &walk.vertices))
        return;
    walk.stream = ca_stream_start(b->input.sampler, CA_SEQUENCE_LIGHT, number);
    worker->counters.light_paths++;
    const uint32_t count = trace(&walk);
    if (count == 0) ca_light_store_fail(&chunk->store);
    walk.vertices[0].first = path;
    record->first = walk.first;
    record->count = count > 1 ? count : 0;
    ca_light_store_path_end(&chunk->store, worker->index, record->count);
}
