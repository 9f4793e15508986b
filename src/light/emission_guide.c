#include "light/emission_guide.h"

#include "base/memory.h"
#include "light/guide_balls.h"
#include "light/light_kinds.h"
#include "sampling/warp.h"

#include <stdlib.h>

/* Of a light's rays: through the ball around all surfaces that its light meets; what the disk and this ball leave is
 * for the clusters. */
#define WHOLE_SHARE 0.15f

/* So many samples of a light tell enough of it. */
#define SAMPLES_OF_LIGHT 8.0

/* A ball is at least this part of the scene's radius, and of how far from it rays come: else the rounding of a ray's
 * direction, or of its origin, is no small part of a ball's radius (INNER). */
#define LEAST_RADIUS 1e-3f
#define LEAST_ANGLE 0x1p-13f

static bool can_be_aimed(const ca_light *light)
{
    return ca_light_is_infinite(light) || ca_light_can_be_aimed(light);
}

bool ca_emission_can_be_guided(const ca_light *lights, uint32_t count)
{
    return count > 1 || (count == 1 && can_be_aimed(&lights[0]));
}

/* ---- The choice of the light ----------------------------------------------------------------------------------- */

/* With few samples for many lights their numbers are chance: they count the less. */
static double trust(const double *light, const double *squares, uint32_t lights)
{
    double sum = 0.0, sum_squares = 0.0;
    for (uint32_t i = 0; i < lights; i++) sum += light[i], sum_squares += squares[i];
    if (!(sum_squares > 0.0)) return 0.0;
    const double samples = sum * sum / sum_squares;
    return (1.0 - (double)CA_GUIDE_USUAL) * samples / (samples + SAMPLES_OF_LIGHT * lights) / sum;
}

/* Sums of each light's samples, and of their squares. */
static void add_up(const ca_guide_sample *samples, size_t count, double *light, double *squares)
{
    for (size_t i = 0; i < count; i++) {
        const double weight = (double)samples[i].weight;
        light[samples[i].light] += weight;
        squares[samples[i].light] += weight * weight;
    }
}

static ca_status create_choice(ca_emission_guide *guide, const ca_light_choice *choice,
                               const ca_guide_sample *samples, size_t count, ca_error *error)
{
    const uint32_t lights = guide->light_count;
    double *light = ca_alloc_zeroed(lights, sizeof *light), *squares = ca_alloc_zeroed(lights, sizeof *squares);
    float *weights = ca_alloc(lights, sizeof *weights);
    ca_status status = light && squares && weights ? CA_OK : ca_fail_memory(error, "the guide of emission");
    if (status == CA_OK) {
        add_up(samples, count, light, squares);
        const double scale = trust(light, squares, lights);
        double guided = 0.0;
        for (uint32_t i = 0; i < lights; i++) guided += scale * light[i];
        for (uint32_t i = 0; i < lights; i++)
            weights[i] = (float)((1.0 - guided) * (double)ca_light_choice_probability(choice, i) + scale * light[i]);
        status = ca_distribution_1d_create(&guide->choice, weights, lights, error);
    }
    ca_free(weights);
    ca_free(squares);
    ca_free(light);
    return status;
}

/* ---- Aims ------------------------------------------------------------------------------------------------------ */

static int compare_places(const ca_guide_sample *x, const ca_guide_sample *y)
{
    const ca_vec3 p = x->position, q = y->position;
    if (x->light != y->light) return x->light < y->light ? -1 : 1;
    if (p.x != q.x) return p.x < q.x ? -1 : 1;
    if (p.y != q.y) return p.y < q.y ? -1 : 1;
    return (p.z > q.z) - (p.z < q.z);
}

/* By light, by place, and by weight, so that sums do not depend on how a library sorts. */
static int compare(const void *a, const void *b)
{
    const ca_guide_sample *x = a, *y = b;
    const int places = compare_places(x, y);
    return places != 0 ? places : (x->weight > y->weight) - (x->weight < y->weight);
}

/* A photon that many camera paths merge with tells of one place only: samples of the same place become one, with the
 * sum of their weights. Returns how many are left, in order. */
static size_t join_samples(ca_guide_sample *samples, size_t count)
{
    size_t kept = 0;
    if (count > 0) qsort(samples, count, sizeof *samples, compare);
    for (size_t i = 0; i < count; i++) {
        if (kept > 0 && compare_places(&samples[kept - 1], &samples[i]) == 0)
            samples[kept - 1].weight += samples[i].weight;
        else
            samples[kept++] = samples[i];
    }
    return kept;
}

/* Of coordinates where rays come from infinity, else of the light's distances from surfaces: no more than this. */
static float reach_of(const ca_light *light)
{
    ca_light_emission start = {.origin = {0.0f, 0.0f, 0.0f}};
    if (!ca_light_is_infinite(light)) ca_light_start_emission(light, (ca_vec2){0.5f, 0.5f}, &start);
    return ca_length(ca_sub(start.origin, light->scene_center)) + light->scene_radius;
}

static ca_status create_aim(ca_guide_aim *aim, const ca_light *light, ca_guide_sample *samples, size_t count,
                            ca_error *error)
{
    ca_guide_ball balls[CA_GUIDE_MOST_BALLS];
    float shares[CA_GUIDE_MOST_BALLS + 1];
    const float least = ca_max(LEAST_RADIUS * light->scene_radius, LEAST_ANGLE * reach_of(light));
    const uint32_t found = ca_guide_balls(samples, count, least, balls);
    if (found == 0) return CA_OK;
    aim->balls = ca_alloc(found, sizeof *aim->balls);
    if (!aim->balls) return ca_fail_memory(error, "the guide of emission");
    shares[0] = CA_GUIDE_USUAL;
    shares[1] = WHOLE_SHARE;
    for (uint32_t i = 1; i < found; i++) shares[i + 1] = (1.0f - CA_GUIDE_USUAL - WHOLE_SHARE) * balls[i].density;
    CA_TRY(ca_distribution_1d_create(&aim->parts, shares, found + 1, error));
    for (uint32_t i = 0; i < found; i++) {
        aim->balls[i] = balls[i];
        aim->balls[i].density =
            ca_distribution_1d_probability(&aim->parts, i + 1) * CA_INV_PI / ca_sqr(balls[i].radius);
    }
    aim->count = found;
    return CA_OK;
}

static ca_status create_aims(ca_emission_guide *guide, ca_guide_sample *samples, size_t count, ca_error *error)
{
    guide->aims = ca_alloc_zeroed(guide->light_count, sizeof *guide->aims);
    if (!guide->aims) return ca_fail_memory(error, "the guide of emission");
    const size_t places = join_samples(samples, count);
    for (size_t first = 0, end; first < places; first = end) {
        const uint32_t light = samples[first].light;
        for (end = first + 1; end < places && samples[end].light == light;) end++;
        if (can_be_aimed(&guide->lights[light]))
            CA_TRY(create_aim(&guide->aims[light], &guide->lights[light], samples + first, end - first, error));
    }
    return CA_OK;
}

ca_status ca_emission_guide_create(ca_emission_guide **guide, const ca_light *lights, uint32_t light_count,
                                   const ca_light_choice *choice, ca_guide_sample *samples, size_t count,
                                   ca_error *error)
{
    ca_emission_guide *g = ca_alloc_zeroed(1, sizeof *g);
    if (!g) return ca_fail_memory(error, "the guide of emission");
    g->lights = lights;
    g->light_count = light_count;
    ca_status status = create_choice(g, choice, samples, count, error);
    if (status == CA_OK) status = create_aims(g, samples, count, error);
    if (status == CA_OK)
        *guide = g;
    else
        ca_emission_guide_destroy(g);
    return status;
}

void ca_emission_guide_destroy(ca_emission_guide *guide)
{
    if (!guide) return;
    for (uint32_t i = 0; guide->aims && i < guide->light_count; i++) {
        ca_free(guide->aims[i].balls);
        ca_distribution_1d_destroy(&guide->aims[i].parts);
    }
    ca_free(guide->aims);
    ca_distribution_1d_destroy(&guide->choice);
    ca_free(guide);
}

/* ---- Use ------------------------------------------------------------------------------------------------------- */

uint32_t ca_emission_choose(const ca_emission_guide *guide, const ca_light_choice *choice, float u,
                            float *probability)
{
    if (!guide) return ca_light_choice_sample(choice, u, probability);
    return ca_distribution_1d_sample(&guide->choice, u, probability, NULL);
}

float ca_emission_probability(const ca_emission_guide *guide, const ca_light_choice *choice, uint32_t light)
{
    return guide ? ca_distribution_1d_probability(&guide->choice, light) : ca_light_choice_probability(choice, light);
}

float ca_emission_ratio(const ca_emission_guide *guide, const ca_light_choice *choice,
                        const ca_light_receiver *receiver, uint32_t light)
{
    if (!guide) return ca_light_choice_ratio(choice, receiver, light);
    const float emission = ca_distribution_1d_probability(&guide->choice, light);
    return emission > 0.0f ? ca_light_choice_direct_probability(choice, receiver, light) / emission : 0.0f;
}

/* ---- Rays through balls ---------------------------------------------------------------------------------------- */

/* The distance is that of the line's nearest point: the square of it, from those of the other two sides of the
 * triangle, would have lost half of the digits. */
static bool goes_through(const ca_guide_ball *ball, ca_vec3 point, ca_vec3 direction)
{
    const ca_vec3 offset = ca_sub(point, ball->center);
    const ca_vec3 across = ca_madd(offset, -ca_dot(offset, direction), direction);
    return ca_length2(across) <= ca_sqr(ball->radius);
}

/* Of all rays. */
static float share_of(const ca_guide_ball *ball) { return ball->density * CA_PI * ca_sqr(ball->radius); }

/* Is there a cone of rays from the point to the ball? Not from within, nor behind the surface. */
static bool is_in_front(const ca_guide_ball *ball, ca_vec3 origin, ca_vec3 ng)
{
    const ca_vec3 offset = ca_sub(ball->center, origin);
    return ca_length2(offset) > ca_sqr(ball->radius) && ca_dot(offset, ng) > -ball->radius;
}

/* Of the half angle under which a ball is seen. */
static float cone_cos(float radius, float distance2) { return sqrtf(1.0f - ca_sqr(radius) / distance2); }

/* Of the cone's directions: share / (2 pi (1 - cos)), in which 1 - cos = radius^2 / (distance^2 (1 + cos)). */
static float cone_density(const ca_guide_ball *ball, ca_vec3 origin)
{
    const float distance2 = ca_length2(ca_sub(ball->center, origin));
    return 0.5f * ball->density * distance2 * (1.0f + cone_cos(ball->radius, distance2));
}

static ca_pdf_area guided_position(const ca_guide_aim *aim, const ca_emitted_ray *ray, ca_pdf_area usual)
{
    float pdf = ca_distribution_1d_probability(&aim->parts, 0) * usual.v;
    for (uint32_t i = 0; i < aim->count; i++)
        if (goes_through(&aim->balls[i], ray->origin, ray->direction)) pdf += aim->balls[i].density;
    return (ca_pdf_area){pdf};
}

static ca_pdf_solid_angle guided_direction(const ca_guide_aim *aim, const ca_emitted_ray *ray,
                                           ca_pdf_solid_angle usual)
{
    float of_usual = ca_distribution_1d_probability(&aim->parts, 0), of_cones = 0.0f;
    for (uint32_t i = 0; i < aim->count; i++) {
        const ca_guide_ball *ball = &aim->balls[i];
        const bool ahead = ca_dot(ca_sub(ball->center, ray->origin), ray->direction) > 0.0f;
        if (!is_in_front(ball, ray->origin, ray->ng))
            of_usual += share_of(ball);
        else if (ahead && goes_through(ball, ray->origin, ray->direction))
            of_cones += cone_density(ball, ray->origin);
    }
    return (ca_pdf_solid_angle){of_usual * usual.v + of_cones};
}

ca_emission_pdf ca_emission_ray_pdf(const ca_emission_guide *guide, uint32_t light, const ca_emitted_ray *ray,
                                    ca_emission_pdf usual)
{
    if (!guide || guide->aims[light].count == 0) return usual;
    if (ca_light_is_infinite(&guide->lights[light]))
        usual.position = guided_position(&guide->aims[light], ray, usual.position);
    else
        usual.direction = guided_direction(&guide->aims[light], ray, usual.direction);
    return usual;
}

/* ---- Sampling -------------------------------------------------------------------------------------------------- */

/* Of the balls' radii: so near to the edge a ray may seem to miss the ball by rounding. Then the density would be far
 * too low. */
#define INNER 0.999f

/* A point of the ball's cross section, in the plane of the light's disk. */
static ca_vec3 origin_towards(const ca_guide_ball *ball, const ca_light *light, ca_vec3 direction, ca_vec2 disk)
{
    const ca_frame frame = ca_frame_from_normal(direction);
    const ca_vec3 target =
        ca_madd(ball->center, ball->radius, ca_to_world(&frame, (ca_vec3){disk.x, disk.y, 0.0f}));
    const float depth = ca_dot(ca_sub(target, light->scene_center), direction) + light->scene_radius;
    return ca_madd(target, -depth, direction);
}

static void aim_origin(const ca_guide_ball *ball, const ca_light *light, ca_vec2 u, ca_light_emission *emission)
{
    const ca_vec2 disk = ca_warp_disk(u);
    emission->origin = origin_towards(ball, light, emission->direction, disk);
    if (!goes_through(ball, emission->origin, emission->direction))
        emission->origin =
            origin_towards(ball, light, emission->direction, (ca_vec2){INNER * disk.x, INNER * disk.y});
}

static ca_vec3 direction_towards(const ca_guide_ball *ball, ca_vec3 origin, ca_vec2 u, float radius)
{
    const ca_vec3 offset = ca_sub(ball->center, origin);
    const float distance2 = ca_length2(offset);
    const float one_minus_cos = ca_sqr(radius) / distance2 / (1.0f + cone_cos(radius, distance2));
    const ca_frame frame = ca_frame_from_normal(ca_normalize(offset));
    return ca_normalize(ca_to_world(&frame, ca_warp_cone(u, one_minus_cos)));
}

static bool sample_infinite(const ca_guide_aim *aim, const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                            ca_light_emission *emission)
{
    float probability;
    const uint32_t part = ca_distribution_1d_sample(&aim->parts, u_position.x, &probability, &u_position.x);
    if (!ca_light_sample_emission(light, u_position, u_direction, emission)) return false;
    if (part > 0) aim_origin(&aim->balls[part - 1], light, u_position, emission);
    return true;
}

static bool sample_finite(const ca_guide_aim *aim, const ca_light *light, ca_vec2 u_position, ca_vec2 u_direction,
                          ca_light_emission *emission)
{
    float probability;
    const uint32_t part = ca_distribution_1d_sample(&aim->parts, u_direction.x, &probability, &u_direction.x);
    const ca_guide_ball *ball = part > 0 ? &aim->balls[part - 1] : NULL;
    if (ball) ca_light_start_emission(light, u_position, emission);
    if (!ball || !is_in_front(ball, emission->origin, emission->ng))
        return ca_light_sample_emission(light, u_position, u_direction, emission);
    ca_vec3 direction = direction_towards(ball, emission->origin, u_direction, ball->radius);
    if (!goes_through(ball, emission->origin, direction))
        direction = direction_towards(ball, emission->origin, u_direction, INNER * ball->radius);
    return ca_light_emission_towards(light, direction, emission);
}

bool ca_emission_sample(const ca_emission_guide *guide, const ca_light *lights, uint32_t light, ca_vec2 u_position,
                        ca_vec2 u_direction, ca_light_emission *emission)
{
    if (!guide || guide->aims[light].count == 0)
        return ca_light_sample_emission(&lights[light], u_position, u_direction, emission);
    const bool infinite = ca_light_is_infinite(&lights[light]);
    if (!(infinite ? sample_infinite : sample_finite)(&guide->aims[light], &lights[light], u_position, u_direction,
                                                      emission))
        return false;
    const ca_emitted_ray ray = {emission->origin, emission->ng, emission->direction};
    const ca_emission_pdf pdf = ca_emission_ray_pdf(
        guide, light, &ray, (ca_emission_pdf){emission->pdf_position, emission->pdf_direction});
    emission->pdf_position = pdf.position;
    emission->pdf_direction = pdf.direction;
    return true;
}
