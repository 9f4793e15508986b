/* Unidirectional path tracing with next event estimation: a path from the camera finds light by hitting emitters and
 * by asking one light at every vertex, and each way is weighted by multiple importance sampling (Veach 1997, chapter
 * 9).
 *
 * max_depth, rr_depth and hide_emitters mean what Mitsuba 3's `path` means by them: a depth of 1 sees emitters only;
 * the roulette may end a path after vertex rr_depth, surviving with min(0.95, largest throughput * eta^2). */
#include "base/memory.h"
#include "integrator/integrator.h"
#include "integrator/walk.h"

#include "math/numeric.h"

enum { MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS, HEURISTIC, NEXT_EVENT };

static const ca_parameter_spec path_parameters[] = {
    [MAX_DEPTH] = {"max_depth", CA_SPEC_INTEGER, .minimum = -1, .number = -1},
    [RR_DEPTH] = {"rr_depth", CA_SPEC_INTEGER, .minimum = 1, .number = 5},
    [HIDE_EMITTERS] = {"hide_emitters", CA_SPEC_BOOLEAN, .number = 0},
    [HEURISTIC] = {"heuristic", CA_SPEC_CHOICE, .choices = "balance|power", .number = 1},
    [NEXT_EVENT] = {"next_event", CA_SPEC_BOOLEAN, .number = 1},
    {.name = NULL},
};

typedef struct path_state {
    const ca_scene *scene;
    const ca_camera *camera;
    const ca_sampler *sampler;
    const ca_filter *filter;
    uint32_t max_depth, rr_depth;
    bool hide_emitters, power_heuristic, next_event;
    ca_technique_images *images; /* NULL: not wanted */
} path_state;

/* A path that is being traced. */
typedef struct path_walk {
    ca_vec3 origin, direction;
    float t_min, t_max;
    ca_rgb throughput; /* f |cos| / pdf of all vertices so far */
    ca_rgb radiance;   /* found so far */
    float eta2;        /* square of the product of relative indices: what refraction took from the throughput */
    ca_light_receiver previous; /* the last vertex, and how the direction away from it was sampled: */
    ca_pdf_solid_angle pdf;
    bool dirac;
    uint32_t depth; /* edges so far */
    uint32_t x, y;  /* the pixel, and the weight of the sample in it: */
    float filter_weight;
} path_walk;

/* Weight of a technique with density a against another with density b for the same path. */
static inline float mis_weight(const path_state *state, float a, float b)
{
    if (state->power_heuristic) a *= a, b *= b;
    return a > 0.0f ? a / (a + b) : 0.0f;
}

/* Adds what a technique found with a full path of s camera and t light vertices, already times its weight; a value
 * that is not finite or is negative is a defect of the technique: counted and dropped. */
static inline void contribute(const path_state *state, path_walk *walk, ca_technique technique, uint32_t s,
                              ca_rgb contribution, float weight, ca_counters *counters)
{
    const bool valid = contribution.r >= 0.0f && contribution.g >= 0.0f && contribution.b >= 0.0f;
    if (!valid || !ca_rgb_is_finite(contribution)) {
        counters->non_finite[technique]++;
        return;
    }
    walk->radiance = ca_rgb_add(walk->radiance, contribution);
    if (!state->images || !(weight > 0.0f)) return;
    ca_technique_images_add(state->images, technique, s, technique == CA_TECHNIQUE_HIT ? 0 : 1, walk->x, walk->y,
                            ca_rgb_scale(contribution, walk->filter_weight / weight), weight);
}

/* The path hit an emitter (surface NULL: left the scene for the environment). */
static void add_emission(const path_state *state, path_walk *walk, uint32_t light_index, const ca_surface *surface,
                         ca_counters *counters)
{
    if (walk->depth == 0 && state->hide_emitters) return;
    const ca_light *light = &state->scene->lights[light_index];
    const ca_vec3 out = ca_neg(walk->direction);
    const uint32_t vertices = walk->depth + 2;
    if (walk->dirac || !state->next_event) { /* next event could not have found it */
        const ca_rgb radiance = ca_light_radiance(light, surface, out);
        contribute(state, walk, CA_TECHNIQUE_HIT, vertices, ca_rgb_mul(walk->throughput, radiance), 1.0f, counters);
        return;
    }
    const ca_light_hit hit = ca_light_eval_hit(light, walk->previous.position, surface, out);
    const float pdf_choice =
        ca_light_choice_direct_probability(&state->scene->light_choice, &walk->previous, light_index);
    const float weight = mis_weight(state, walk->pdf.v, pdf_choice * hit.pdf_direct.v);
    contribute(state, walk, CA_TECHNIQUE_HIT, vertices,
               ca_rgb_scale(ca_rgb_mul(walk->throughput, hit.radiance), weight), weight, counters);
}

/* Next event: ask one light. */
static void add_next_event(const path_state *state, path_walk *walk, const ca_surface *surface, const ca_bsdf *bsdf,
                           const ca_stream *stream, ca_counters *counters)
{
    const uint32_t dimension = ca_vertex_dimension(walk->depth);
    float pdf_choice;
    const ca_light_receiver receiver = ca_walk_receiver(surface, bsdf, ca_neg(walk->direction));
    const uint32_t index =
        ca_light_choice_sample_direct(&state->scene->light_choice, &receiver,
                                      ca_sample_1d(stream, dimension + CA_DIM_NEXT_LIGHT), &pdf_choice);
    if (index == CA_NONE) return;
    const ca_light *light = &state->scene->lights[index];
    ca_light_direct direct;
    if (!ca_light_sample_direct(light, surface->position, ca_sample_2d(stream, dimension + CA_DIM_NEXT_EVENT),
                                &direct))
        return;
    const ca_bsdf_value value = ca_bsdf_eval(bsdf, ca_neg(walk->direction), direct.to_light, CA_FROM_CAMERA);
    const float pdf_light = pdf_choice * direct.pdf_direct.v;
    const bool only_technique = ca_light_has_dirac_position(light) || ca_light_has_dirac_direction(light);
    const float weight = only_technique ? 1.0f : mis_weight(state, pdf_light, value.pdf.v);
    const float factor = weight * ca_abs_dot(surface->ng, direct.to_light) / pdf_light;
    const ca_rgb contribution =
        ca_rgb_scale(ca_rgb_mul(ca_rgb_mul(walk->throughput, value.f), direct.radiance), factor);
    if (ca_rgb_is_black(contribution)) return;
    counters->shadow_rays++;
    if (!ca_walk_light_is_visible(state->scene->accel, surface, &direct)) return;
    contribute(state, walk, CA_TECHNIQUE_NEXT_EVENT, walk->depth + 2, contribution, weight, counters);
}

/* Continues the path by the BSDF; false where it ends. */
static bool scatter(const path_state *state, path_walk *walk, const ca_surface *surface, const ca_bsdf *bsdf,
                    const ca_stream *stream)
{
    const uint32_t dimension = ca_vertex_dimension(walk->depth);
    const ca_vec2 u_lobe_roulette = ca_sample_2d(stream, dimension + CA_DIM_BSDF_LOBE);
    ca_bsdf_sample sample;
    if (!ca_bsdf_sample_direction(bsdf, ca_neg(walk->direction), u_lobe_roulette.x,
                                  ca_sample_2d(stream, dimension + CA_DIM_BSDF_DIRECTION), CA_FROM_CAMERA, &sample))
        return false;
    walk->throughput = ca_rgb_mul(walk->throughput, sample.weight);
    walk->eta2 *= ca_sqr(sample.eta);
    walk->previous = ca_walk_receiver(surface, bsdf, ca_neg(walk->direction));
    walk->origin =
        ca_offset_origin(surface->position, surface->position_error, surface->ng, sample.wo_world);
    walk->direction = sample.wo_world;
    walk->t_min = 0.0f;
    walk->t_max = INFINITY;
    walk->pdf = sample.pdf;
    walk->dirac = (sample.scatter & CA_SCATTER_DIRAC) != 0;
    walk->depth++;
    return ca_walk_survives(walk->depth, state->rr_depth, walk->eta2, u_lobe_roulette.y, &walk->throughput);
}

static void trace(const path_state *state, path_walk *walk, const ca_stream *stream, ca_film_sample *sample,
                  ca_counters *counters)
{
    const ca_scene *scene = state->scene;
    for (;;) {
        ca_hit hit;
        counters->rays++;
        if (!ca_accel_intersect(scene->accel, walk->origin, walk->direction, walk->t_min, walk->t_max, &hit)) {
            if (scene->environment != CA_NONE) add_emission(state, walk, scene->environment, NULL, counters);
            return;
        }
        ca_surface surface;
        ca_accel_surface(scene->accel, walk->origin, walk->direction, &hit, &surface);
        if (surface.light != CA_NONE) add_emission(state, walk, surface.light, &surface, counters);
        const bool last = walk->depth + 1 >= state->max_depth;
        if (last && walk->depth > 0) return;
        ca_bsdf bsdf;
        const ca_vec3 wi = ca_neg(walk->direction);
        ca_bsdf_init(&bsdf, scene->materials, scene->desc.textures.items, &surface, wi);
        if (walk->depth == 0) ca_walk_record_primary_hit(&surface, &bsdf, wi, sample);
        if (last) return;
        if (state->next_event && (bsdf.scatter & CA_SCATTER_SMOOTH))
            add_next_event(state, walk, &surface, &bsdf, stream, counters);
        if (!scatter(state, walk, &surface, &bsdf, stream)) return;
    }
}

static void path_camera_path(const void *opaque, uint32_t x, uint32_t y, uint32_t index, uint32_t round,
                             ca_film_sample *sample, ca_worker *worker)
{
    (void)round; /* always the first: there are no light paths */
    const path_state *state = opaque;
    const ca_stream stream = ca_stream_start(state->sampler, (uint64_t)y * state->camera->width + x, index);
    float filter_weight;
    const ca_camera_ray ray = ca_walk_camera_ray(state->camera, state->filter, &stream, x, y, &filter_weight);
    path_walk walk = {.origin = ray.origin,
                      .direction = ray.direction,
                      .t_min = ray.t_min,
                      .t_max = ray.t_max,
                      .throughput = ray.weight,
                      .eta2 = 1.0f,
                      .previous = {.position = ray.origin},
                      .dirac = true,
                      .x = x,
                      .y = y,
                      .filter_weight = filter_weight};
    sample->filter_weight = filter_weight;
    worker->counters.camera_paths++;
    if (state->max_depth > 0) trace(state, &walk, &stream, sample, &worker->counters);
    sample->radiance = walk.radiance;
}

static ca_status check_lights_can_be_hit(const ca_scene *scene, ca_error *error)
{
    for (uint32_t i = 0; i < scene->light_count; i++)
        if (ca_light_has_dirac_position(&scene->lights[i]) || ca_light_has_dirac_direction(&scene->lights[i]))
            return ca_fail(error, CA_ERROR_UNSUPPORTED, &scene->desc.lights.items[i].where,
                           "without next_event the integrator \"path\" cannot find this light: it has no extent");
    return CA_OK;
}

static ca_status path_create(const ca_integrator_input *input, void **state, ca_error *error)
{
    const bool next_event = input->values[NEXT_EVENT] != 0.0;
    if (!next_event) CA_TRY(check_lights_can_be_hit(input->scene, error));
    path_state *created = ca_alloc(1, sizeof *created);
    if (!created) return ca_fail_memory(error, "the integrator");
    *created =
        (path_state){.scene = input->scene,
                     .camera = input->camera,
                     .sampler = input->sampler,
                     .filter = input->filter,
                     .max_depth = input->values[MAX_DEPTH] < 0.0 ? UINT32_MAX : (uint32_t)input->values[MAX_DEPTH],
                     .rr_depth = (uint32_t)input->values[RR_DEPTH],
                     .hide_emitters = input->values[HIDE_EMITTERS] != 0.0,
                     .power_heuristic = input->values[HEURISTIC] != 0.0,
                     .next_event = next_event,
                     .images = input->technique_images};
    *state = created;
    return CA_OK;
}

const ca_integrator_type ca_integrator_path = {
    .name = "path",
    .parameters = path_parameters,
    .create = path_create,
    .destroy = ca_free,
    .camera_path = path_camera_path,
};
