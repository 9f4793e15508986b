#include "light/emission_guide.h"

#include "base/memory.h"
#include "light/guide_balls.h"
#include "light/light_kinds.h"
#include "sampling/warp.h"

/* Of a light's rays: through the ball around all surfaces that its light meets; what the disk and this ball leave is
 * for the clusters. */
#define WHOLE_SHARE 0.15f

/* So many samples of a light tell enough of it. */
#define SAMPLES_OF_LIGHT 8.0

/* A ball is at least this part of the scene's radius. */
#define LEAST_RADIUS 1e-3f

bool ca_emission_can_be_guided(const ca_light *lights, uint32_t count)
{
    return count > 1 || (count == 1 && ca_light_is_infinite(&lights[0]));
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

/* Moves the light's samples to the front; returns how many they are. */
static size_t gather_samples(uint32_t light, ca_guide_sample *samples, size_t count)
{
    size_t found = 0;
    for (size_t i = 0; i < count; i++) {
        if (samples[i].light != light) continue;
        const ca_guide_sample sample = samples[i];
        samples[i] = samples[found];
        samples[found++] = sample;
    }
    return found;
}

static ca_status create_aim(ca_guide_aim *aim, const ca_light *light, ca_guide_sample *samples, size_t count,
                            ca_error *error)
{
    ca_guide_ball balls[CA_GUIDE_MOST_BALLS];
    float shares[CA_GUIDE_MOST_BALLS + 1];
    const uint32_t found = ca_guide_balls(samples, count, LEAST_RADIUS * light->scene_radius, balls);
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
    for (uint32_t i = 0; i < guide->light_count; i++) {
        if (!ca_light_is_infinite(&guide->lights[i])) continue;
        const size_t found = gather_samples(i, samples, count);
        CA_TRY(create_aim(&guide->aims[i], &guide->lights[i], samples, found, error));
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

/* A point of the ball's cross section, in the plane of the light's disk. */
static ca_vec3 origin_towards(const ca_guide_ball *ball, const ca_light *light, ca_vec3 direction, ca_vec2 u)
{
    const ca_frame frame = ca_frame_from_normal(direction);
    const ca_vec2 disk = ca_warp_disk(u);
    const ca_vec3 target =
        ca_madd(ball->center, ball->radius, ca_to_world(&frame, (ca_vec3){disk.x, disk.y, 0.0f}));
    const float depth = ca_dot(ca_sub(target, light->scene_center), direction) + light->scene_radius;
    return ca_madd(target, -depth, direction);
}

bool ca_emission_sample(const ca_emission_guide *guide, const ca_light *lights, uint32_t light, ca_vec2 u_position,
                        ca_vec2 u_direction, ca_light_emission *emission)
{
    const ca_guide_aim *aim = guide && guide->aims[light].count > 0 ? &guide->aims[light] : NULL;
    float probability;
    uint32_t part = 0;
    if (aim) part = ca_distribution_1d_sample(&aim->parts, u_position.x, &probability, &u_position.x);
    if (!ca_light_sample_emission(&lights[light], u_position, u_direction, emission)) return false;
    if (part > 0)
        emission->origin = origin_towards(&aim->balls[part - 1], &lights[light], emission->direction, u_position);
    emission->pdf_position =
        ca_emission_pdf_position(guide, light, emission->origin, emission->direction, emission->pdf_position);
    return true;
}

/* The distance is that of the line's nearest point: the square of it, from those of the other two sides of the
 * triangle, would have lost half of the digits. */
ca_pdf_area ca_emission_pdf_position(const ca_emission_guide *guide, uint32_t light, ca_vec3 point, ca_vec3 direction,
                                     ca_pdf_area usual)
{
    if (!guide || guide->aims[light].count == 0) return usual;
    const ca_guide_aim *aim = &guide->aims[light];
    float pdf = ca_distribution_1d_probability(&aim->parts, 0) * usual.v;
    for (uint32_t i = 0; i < aim->count; i++) {
        const ca_vec3 offset = ca_sub(point, aim->balls[i].center);
        const ca_vec3 across = ca_madd(offset, -ca_dot(offset, direction), direction);
        if (ca_length2(across) <= ca_sqr(aim->balls[i].radius)) pdf += aim->balls[i].density;
    }
    return (ca_pdf_area){pdf};
}
