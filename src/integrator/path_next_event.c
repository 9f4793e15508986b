/* Next event of `path`: each vertex asks one light. The environment is sampled eight times at a time; matte points
 * ask it and even lights in lanes, too, all others ask one by one; then all questions for visibility at once. */
#include "integrator/batch_lanes.h"
#include "integrator/path.h"
#include "light/environment_lanes.h"

#include <string.h>

/* Per place: the chosen light; for even lights at matte points the corners of what is sampled, too. */
typedef struct choice_batch {
    _Alignas(32) float probability[CA_COLUMN];
    uint32_t light[CA_COLUMN];     /* CA_NONE: none to ask */
    uint32_t even[CA_COLUMN];      /* all bits: even light and matte point; likewise: */
    uint32_t sky[CA_COLUMN];       /* the environment */
    uint32_t rectangle[CA_COLUMN]; /* all bits: the corners span a rectangle; 0: a triangle */
    ca_column3 corner[3], radiance;
    float pdf_area[CA_COLUMN];
    float pdf_seen[CA_COLUMN];    /* > 0: chosen by solid angle, with this density, for the light looks large */
    ca_column3 to_sky, far; /* sky only: the direction, and where paths are observed a point of it; likewise: */
    float pdf_sky[CA_COLUMN];
} choice_batch;

static bool scatters_smoothly(const ca_vertex_batch *v, uint32_t i)
{
    return v->matte[i] || (v->bsdfs[i].scatter & CA_SCATTER_SMOOTH);
}

static ca_light_receiver receiver_at(const ca_vertex_batch *v, uint32_t i)
{
    return ca_receiver_at(ca_column3_at(&v->position, i), ca_column3_at(&v->ng, i), ca_column3_at(&v->wi, i),
                          v->matte[i] ? CA_SCATTER_REFLECTION : v->bsdfs[i].scatter);
}

/* Where there is but one. */
static void choose_the_light(const ca_batch *batch, choice_batch *choices)
{
    for (uint32_t i = 0; i < batch->count; i++) {
        const bool asks = !ca_batch_left(batch, i) && scatters_smoothly(&batch->vertices, i);
        choices->light[i] = asks ? 0 : CA_NONE;
        choices->probability[i] = asks ? 1.0f : 0.0f;
    }
}

static void choose_lights(const path_state *state, const ca_batch *batch, const ca_number_batch *u,
                          choice_batch *choices)
{
    const ca_vertex_batch *v = &batch->vertices;
    ca_light_query queries[CA_BATCH];
    uint32_t place[CA_BATCH], count = 0;
    memset(choices->light, 0xff, sizeof choices->light); /* CA_NONE */
    memset(choices->even, 0, sizeof choices->even);
    memset(choices->sky, 0, sizeof choices->sky);
    memset(choices->probability, 0, sizeof choices->probability);
    if (state->scene->light_count == 1) {
        choose_the_light(batch, choices);
        return;
    }
    for (uint32_t i = 0; i < batch->count; i++) {
        if (ca_batch_left(batch, i) || !scatters_smoothly(v, i)) continue;
        queries[count] = (ca_light_query){.receiver = receiver_at(v, i), .u = u->x[i]};
        place[count++] = i;
    }
    ca_light_choice_sample_direct_many(&state->scene->light_choice, queries, count);
    for (uint32_t k = 0; k < count; k++) {
        choices->light[place[k]] = queries[k].light;
        choices->probability[place[k]] = queries[k].probability;
        if (queries[k].light == CA_NONE) continue;
        __builtin_prefetch(&state->scene->even_lights[queries[k].light]);
        if (!v->matte[place[k]]) __builtin_prefetch(&state->scene->lights[queries[k].light]);
    }
}

/* An even light at a matte point? What looks large from there must be a plain rectangle. */
static bool goes_in_lanes(const path_state *state, const ca_vertex_batch *v, uint32_t i, const choice_batch *choices)
{
    if (choices->light[i] == CA_NONE || !v->matte[i]) return false;
    const ca_scene *scene = state->scene;
    const ca_even_light *light = &scene->even_lights[choices->light[i]];
    const ca_vec3 reference = ca_column3_at(&v->position, i);
    if (!light->is_even || light->is_plain || !ca_even_light_is_near(light, reference)) return light->is_even;
    const ca_shape *shape = scene->lights[choices->light[i]].as.area.shape;
    return !ca_rectangle_may_look_large(&shape->as.mesh.rectangle, reference);
}

static void set_corners(choice_batch *choices, uint32_t i, ca_vec3 a, ca_vec3 b, ca_vec3 c)
{
    ca_column3_set(&choices->corner[0], i, a);
    ca_column3_set(&choices->corner[1], i, b);
    ca_column3_set(&choices->corner[2], i, c);
}

/* The triangle, where there is one to choose: u->x then becomes the number within its share. */
static void choose_triangle(const ca_shape *shape, ca_number_batch *u, uint32_t i, choice_batch *choices)
{
    float probability;
    const uint32_t primitive = ca_distribution_1d_sample(&shape->as.mesh.triangles, u->x[i], &probability, &u->x[i]);
    const ca_triangle triangle = ca_triangle_load(shape->as.mesh.mesh, primitive);
    set_corners(choices, i, triangle.p[0], triangle.p[1], triangle.p[2]);
}

/* A rectangle that looks large: the two numbers become the place in it, uniform by solid angle. */
static void choose_seen(const ca_shape *shape, ca_vec3 reference, ca_number_batch *u, uint32_t i,
                        choice_batch *choices)
{
    ca_spherical_rectangle seen;
    if (!ca_spherical_rectangle_from(&shape->as.mesh.rectangle, reference, &seen)) return;
    const ca_vec2 st = ca_spherical_rectangle_sample(&seen, (ca_vec2){u->x[i], u->y[i]});
    u->x[i] = st.x;
    u->y[i] = st.y;
    choices->pdf_seen[i] = (float)(1.0 / seen.solid_angle);
}

/* ca_shape_sample_seen up to the corners between which the point lies. */
static void choose_corners(const path_state *state, const ca_vertex_batch *v, ca_number_batch *u, uint32_t i,
                           choice_batch *choices)
{
    const ca_even_light *light = &state->scene->even_lights[choices->light[i]];
    const ca_light *rest = &state->scene->lights[choices->light[i]]; /* not read where `light` tells all */
    const ca_vec3 reference = ca_column3_at(&v->position, i);
    choices->rectangle[i] = light->is_plain ? UINT32_MAX : 0;
    choices->pdf_seen[i] = 0.0f;
    if (light->is_plain) {
        set_corners(choices, i, light->corner, light->end_x, light->end_y);
        if (ca_even_light_is_near(light, reference)) choose_seen(rest->as.area.shape, reference, u, i, choices);
    } else {
        choose_triangle(rest->as.area.shape, u, i, choices);
    }
    choices->pdf_area[i] = light->pdf_area;
    choices->radiance.x[i] = light->radiance.r;
    choices->radiance.y[i] = light->radiance.g;
    choices->radiance.z[i] = light->radiance.b;
}

/* A point on the light: ca_warp_triangle, ca_triangle_position and the normal; in a rectangle
 * (s, t) are the weights. */
typedef struct light_point8 {
    ca_v8 position, ng;
    ca_f8 error;
} light_point8;

static light_point8 point_on_light(const choice_batch *choices, const ca_number_batch *u, uint32_t i)
{
    const ca_v8 p0 = ca_column3_load(&choices->corner[0], i), p1 = ca_column3_load(&choices->corner[1], i),
                p2 = ca_column3_load(&choices->corner[2], i);
    const ca_m8 rectangle = ca_load8_u32(choices->rectangle, i);
    const ca_f8 s = ca_load8(u->x, i), t = ca_load8(u->y, i), root = ca_sqrt8(s);
    const ca_f8 bx = ca_select8(rectangle, s, root * (1.0f - t)), by = ca_select8(rectangle, t, root * t);
    const ca_f8 error = ca_select8(rectangle, ca_f8_all(CA_RECTANGLE_ERROR), ca_f8_all(1.0f));
    const ca_v8 extent = ca_max_v8(ca_abs_v8(p0), ca_max_v8(ca_abs_v8(p1), ca_abs_v8(p2)));
    return (light_point8){
        .position = ca_madd_v8(ca_madd_v8(ca_mul_v8(p0, 1.0f - bx - by), bx, p1), by, p2),
        .ng = ca_normalize_any_v8(ca_cross_v8(ca_sub_v8(p1, p0), ca_sub_v8(p2, p0))),
        .error = 2.0f * CA_GAMMA(7) * ca_max3_v8(extent) * error};
}

/* ---- The environment ------------------------------------------------------------------------------------------- */

/* Where eight points look for it, and what is there. */
static void sample_sky(const ca_light *light, const ca_number_batch *u, ca_m8 sky, choice_batch *choices, uint32_t i)
{
    const ca_f8 zero = ca_f8_all(0.0f), x = ca_load8(u->x, i), y = ca_load8(u->y, i);
    const ca_environment8 sample =
        ca_light_environment_direct8(light, ca_select8(sky, x, zero), ca_select8(sky, y, zero));
    const ca_v8 radiance = ca_column3_load(&choices->radiance, i);
    ca_column3_store(&choices->radiance, i, ca_select_v8(sky, sample.radiance, radiance));
    ca_column3_store(&choices->to_sky, i, sample.to_light);
    ca_store8(choices->pdf_sky, i, sample.pdf_direct);
    ca_store8_u32(choices->sky, i, sky);
}

/* ca_light_far_point. */
static void keep_far(const ca_light *light, const ca_vertex_batch *v, choice_batch *choices, uint32_t i)
{
    const ca_v8 reference = ca_column3_load(&v->position, i);
    const ca_v8 offset = ca_sub_v8(reference, ca_v8_all(light->scene_center));
    const ca_f8 reach = 2.0f * (light->scene_radius + ca_sqrt8(ca_dot_v8(offset, offset)));
    ca_column3_store(&choices->far, i, ca_madd_v8(reference, reach, ca_column3_load(&choices->to_sky, i)));
}

static void sample_skies(const path_state *state, const ca_batch *batch, const ca_number_batch *u,
                         choice_batch *choices)
{
    if (state->scene->environment == CA_NONE) return;
    const ca_light *light = &state->scene->lights[state->scene->environment];
    for (uint32_t i = 0; i < batch->count; i += CA_LANES) {
        const ca_m8 sky = ca_load8_u32(choices->light, i) == ca_m8_all((int32_t)state->scene->environment);
        if (!ca_mask_bits(sky)) continue;
        sample_sky(light, u, sky, choices, i);
        if (batch->points) keep_far(light, &batch->vertices, choices, i);
    }
}

/* ---- Questions ------------------------------------------------------------------------------------------------- */

/* A question for visibility: the segment between two points, both moved off their surfaces. */
static void ask(ca_batch *batch, uint32_t i, ca_vec3 origin, ca_vec3 direction, float t_max, ca_rgb contribution,
                float weight)
{
    ca_visibility_batch *visibility = &batch->visibility;
    const uint32_t k = visibility->count++;
    ca_column3_set(&visibility->rays.origin, k, origin);
    ca_column3_set(&visibility->rays.direction, k, direction);
    visibility->rays.t_min[k] = 0.0f;
    visibility->rays.t_max[k] = t_max;
    visibility->contribution.x[k] = contribution.r;
    visibility->contribution.y[k] = contribution.g;
    visibility->contribution.z[k] = contribution.b;
    visibility->weight[k] = weight;
    visibility->slot[k] = batch->slot[i];
}

/* What eight paths ask, and for which points. */
typedef struct questions8 {
    ca_v8 origin, direction, contribution, position, ng;
    ca_f8 weight, t_max;
} questions8;

/* For the observer: the point that question `k` asks for. */
static void keep_light(ca_batch *batch, uint32_t k, ca_vec3 position, ca_vec3 ng, uint32_t light)
{
    batch->visibility.lights[k] = (ca_light_vertex){.point = {.position = position, .ng = ng, .shape = light}};
}

/* Those of the last questions, which lanes with a bit asked. */
static void keep_lights(ca_batch *batch, uint32_t bits, const questions8 *q, const uint32_t *lights)
{
    uint32_t question = batch->visibility.count - (uint32_t)__builtin_popcount(bits);
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        keep_light(batch, question++, (ca_vec3){q->position.x[k], q->position.y[k], q->position.z[k]},
                   (ca_vec3){q->ng.x[k], q->ng.y[k], q->ng.z[k]}, lights[k]);
    }
}

/* Those of the eight paths from `i` on that have a bit ask likewise. */
static void ask_together(ca_batch *batch, uint32_t i, uint32_t bits, const questions8 *q, const uint32_t *lights)
{
    ca_visibility_batch *visibility = &batch->visibility;
    const uint32_t k = visibility->count;
    const ca_m8 places = ca_places_of_bits(bits);
    ca_column3_store_anywhere(&visibility->rays.origin, k, ca_permute_v8(q->origin, places));
    ca_column3_store_anywhere(&visibility->rays.direction, k, ca_permute_v8(q->direction, places));
    ca_store8_anywhere(visibility->rays.t_min + k, ca_f8_all(0.0f));
    ca_store8_anywhere(visibility->rays.t_max + k, ca_permute8(q->t_max, places));
    ca_column3_store_anywhere(&visibility->contribution, k, ca_permute_v8(q->contribution, places));
    ca_store8_anywhere(visibility->weight + k, ca_permute8(q->weight, places));
    const ca_f8 slots = (ca_f8)ca_load8_u32(batch->slot, i);
    ca_store8_anywhere((float *)(void *)(visibility->slot + k), ca_permute8(slots, places));
    visibility->count += (uint32_t)__builtin_popcount(bits);
    if (batch->points) keep_lights(batch, bits, q, lights);
}

/* ---- Matte points ---------------------------------------------------------------------------------------------- */

/* Eight even lights: ca_light_area_direct, but for the radiance. Lanes in which there is such a light, and which it
 * faces. */
static ca_m8 look_at_even(const ca_batch *batch, const ca_number_batch *u, const choice_batch *choices, uint32_t i,
                          questions8 *q, ca_v8 *to_light, ca_f8 *pdf_direct)
{
    const ca_vertex_batch *v = &batch->vertices;
    const ca_v8 reference = ca_column3_load(&v->position, i), n = ca_column3_load(&v->ns, i);
    const light_point8 point = point_on_light(choices, u, i);
    const ca_v8 segment = ca_sub_v8(point.position, reference);
    const ca_f8 distance2 = ca_dot_v8(segment, segment), inverse = 1.0f / ca_sqrt8(distance2);
    const ca_f8 cos_light = -ca_dot_v8(segment, point.ng) * inverse;
    *to_light = ca_mul_v8(segment, inverse);
    const ca_f8 seen = ca_load8(choices->pdf_seen, i);
    *pdf_direct = ca_select8(seen > 0.0f, seen, ca_load8(choices->pdf_area, i) * distance2 / cos_light);
    const ca_v8 target = ca_offset_origin8(point.position, point.error, point.ng, ca_neg_v8(segment));
    q->origin = ca_offset_origin8(reference, ca_load8(v->error, i), n, segment);
    q->direction = ca_sub_v8(target, q->origin);
    q->position = point.position;
    q->ng = point.ng;
    q->t_max = ca_f8_all(ca_visible_t_max);
    return ca_load8_u32(choices->even, i) & (cos_light > 0.0f) & (distance2 > 0.0f);
}

/* In the lanes of `sky` the environment takes the place of what is there. */
static void look_at_sky(const ca_batch *batch, const choice_batch *choices, ca_m8 sky, uint32_t i, questions8 *q,
                        ca_v8 *to_light, ca_f8 *pdf_direct)
{
    const ca_vertex_batch *v = &batch->vertices;
    const ca_f8 zero = ca_f8_all(0.0f);
    const ca_v8 to_sky = ca_column3_load(&choices->to_sky, i);
    const ca_v8 origin = ca_offset_origin8(ca_column3_load(&v->position, i), ca_load8(v->error, i),
                                           ca_column3_load(&v->ns, i), to_sky);
    *to_light = ca_select_v8(sky, to_sky, *to_light);
    *pdf_direct = ca_select8(sky, ca_load8(choices->pdf_sky, i), *pdf_direct);
    q->origin = ca_select_v8(sky, origin, q->origin);
    q->direction = ca_select_v8(sky, to_sky, q->direction);
    q->t_max = ca_select8(sky, ca_f8_all(INFINITY), q->t_max);
    if (!batch->points) return;
    q->position = ca_select_v8(sky, ca_column3_load(&choices->far, i), q->position);
    q->ng = ca_select_v8(sky, (ca_v8){zero, zero, zero}, q->ng);
}

/* eval_diffuse, times throughput and radiance over the density; the lanes in which that is something. */
static ca_m8 reflect(const path_state *state, const ca_batch *batch, const choice_batch *choices, uint32_t i,
                     ca_v8 to_light, ca_f8 pdf_direct, questions8 *q)
{
    const ca_vertex_batch *v = &batch->vertices;
    const ca_v8 n = ca_column3_load(&v->ns, i);
    const ca_f8 side = ca_load8(v->side, i), grazing = ca_f8_all(CA_GRAZING_COS);
    const ca_f8 cos_i = ca_dot_v8(n, ca_column3_load(&v->wi, i)) * side, dot_o = ca_dot_v8(n, to_light);
    const ca_f8 cos_o = dot_o * side;
    const ca_f8 pdf_light = ca_load8(choices->probability, i) * pdf_direct;
    q->weight = path_mis_weight8(state, pdf_light, cos_o * CA_INV_PI);
    const ca_f8 factor = q->weight * ca_abs8(dot_o) / pdf_light;
    const ca_v8 throughput = ca_column3_load(&batch->throughput, i), color = ca_column3_load(&v->reflectance, i),
                radiance = ca_column3_load(&choices->radiance, i);
    const ca_v8 light = {throughput.x * (color.x * CA_INV_PI) * radiance.x * factor,
                         throughput.y * (color.y * CA_INV_PI) * radiance.y * factor,
                         throughput.z * (color.z * CA_INV_PI) * radiance.z * factor};
    q->contribution = light;
    return (pdf_direct > 0.0f) & (cos_i > grazing) & (cos_o > grazing) &
           ~((light.x == 0.0f) & (light.y == 0.0f) & (light.z == 0.0f));
}

/* Those of the eight points from `i` on that are matte. */
static void ask_lanes(const path_state *state, ca_batch *batch, const ca_number_batch *u, const choice_batch *choices,
                      uint32_t i)
{
    questions8 q = {0};
    ca_v8 to_light = {0};
    ca_f8 pdf_direct = {0};
    const ca_m8 even = ca_load8_u32(choices->even, i);
    const ca_m8 sky = ca_load8_u32(choices->sky, i) & ca_load8_u32(batch->vertices.matte, i);
    ca_m8 lit = sky;
    if (ca_mask_bits(even)) lit |= look_at_even(batch, u, choices, i, &q, &to_light, &pdf_direct);
    if (ca_mask_bits(sky)) look_at_sky(batch, choices, sky, i, &q, &to_light, &pdf_direct);
    if (!ca_mask_bits(lit)) return;
    lit &= reflect(state, batch, choices, i, to_light, pdf_direct, &q);
    ask_together(batch, i, ca_mask_bits(lit), &q, choices->light + i);
}

/* ---- One by one ------------------------------------------------------------------------------------------------ */

/* false: no light gets there. */
static bool sample_light(const path_state *state, const ca_batch *batch, ca_vec2 u, const choice_batch *choices,
                         uint32_t i, ca_light_direct *direct)
{
    if (!choices->sky[i]) {
        const uint32_t light = choices->light[i];
        return ca_even_light_sample_direct(&state->scene->even_lights[light], &state->scene->lights[light],
                                           ca_column3_at(&batch->vertices.position, i), u, direct);
    }
    direct->to_light = ca_column3_at(&choices->to_sky, i);
    direct->distance = CA_INFINITE_DISTANCE;
    direct->radiance = (ca_rgb){choices->radiance.x[i], choices->radiance.y[i], choices->radiance.z[i]};
    direct->pdf_direct.v = choices->pdf_sky[i];
    if (batch->points) direct->position = ca_column3_at(&choices->far, i);
    direct->ng = (ca_vec3){0};
    return direct->pdf_direct.v > 0.0f;
}

static void ask_one(const path_state *state, ca_batch *batch, ca_vec2 u, const choice_batch *choices, uint32_t i)
{
    const ca_scene *scene = state->scene;
    const ca_light *light = &scene->lights[choices->light[i]];
    ca_vertex_batch *v = &batch->vertices;
    ca_light_direct direct;
    if (!sample_light(state, batch, u, choices, i, &direct)) return;
    const ca_surface *surface = ca_batch_surface(batch, scene, i);
    if (v->matte[i])
        ca_bsdf_init(&v->bsdfs[i], scene->materials, scene->desc.textures.items, surface, ca_column3_at(&v->wi, i));
    const ca_bsdf_value value = ca_bsdf_eval(&v->bsdfs[i], ca_column3_at(&v->wi, i), direct.to_light, CA_FROM_CAMERA);
    const float pdf_light = choices->probability[i] * direct.pdf_direct.v;
    const bool only_technique = ca_light_has_dirac_position(light) || ca_light_has_dirac_direction(light);
    const float weight = only_technique ? 1.0f : path_mis_weight(state, pdf_light, value.pdf.v);
    const float factor = weight * ca_abs_dot(surface->ng, direct.to_light) / pdf_light;
    const ca_rgb throughput = {batch->throughput.x[i], batch->throughput.y[i], batch->throughput.z[i]};
    const ca_rgb contribution = ca_rgb_scale(ca_rgb_mul(ca_rgb_mul(throughput, value.f), direct.radiance), factor);
    if (ca_rgb_is_black(contribution)) return;
    const ca_next_event_ray ray =
        ca_walk_next_event_ray(surface->position, surface->position_error, surface->ng, &direct);
    ask(batch, i, ray.origin, ray.direction, ray.t_max, contribution, weight);
    if (batch->points)
        keep_light(batch, batch->visibility.count - 1, direct.position, direct.ng, choices->light[i]);
}

static void add_visible(const path_state *state, ca_batch *batch, ca_worker *worker)
{
    ca_visibility_batch *v = &batch->visibility;
    worker->counters.shadow_rays += v->count;
    ca_accel_occluded_batch(state->scene->accel, &v->rays, v->count, v->occluded);
    for (uint32_t k = 0; k < v->count; k++) {
        batch->work[v->slot[k]]++;
        if (v->occluded[k]) continue;
        if (batch->points) path_observe(state, batch, v->slot[k], &v->lights[k], v->weight[k]);
        const ca_rgb contribution = {v->contribution.x[k], v->contribution.y[k], v->contribution.z[k]};
        path_contribute(state, batch, v->slot[k], CA_TECHNIQUE_NEXT_EVENT, batch->segments + 1, contribution,
                        v->weight[k], &worker->counters);
    }
}

void path_add_next_event(const path_state *state, ca_batch *batch, ca_worker *worker)
{
    choice_batch choices;
    const uint32_t dimension = ca_vertex_dimension(batch->segments - 1);
    ca_number_batch *u = &batch->numbers[0], *u_choice = &batch->numbers[1];
    if (state->scene->light_count > 1) ca_batch_sample_1d(batch, dimension + CA_DIM_NEXT_LIGHT, u_choice);
    ca_batch_sample_2d(batch, dimension + CA_DIM_NEXT_EVENT, u);
    choose_lights(state, batch, u_choice, &choices);
    for (uint32_t i = 0; i < batch->count; i++) {
        if (!goes_in_lanes(state, &batch->vertices, i, &choices)) continue;
        choices.even[i] = UINT32_MAX;
        choose_corners(state, &batch->vertices, u, i, &choices);
    }
    sample_skies(state, batch, u, &choices);
    batch->visibility.count = 0;
    for (uint32_t i = 0; i < batch->count; i += CA_LANES) ask_lanes(state, batch, u, &choices, i);
    for (uint32_t i = 0; i < batch->count; i++)
        if (choices.light[i] != CA_NONE && !choices.even[i] && !(choices.sky[i] & batch->vertices.matte[i]))
            ask_one(state, batch, (ca_vec2){u->x[i], u->y[i]}, &choices, i);
    add_visible(state, batch, worker);
}
