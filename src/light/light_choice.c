#include "light/light_choice.h"

#include "base/memory.h"
#include "math/numeric.h"

/* What of the choice among the others is the same for all: nobody knows what is hidden. */
#define EVEN_SHARE 0.25f

static bool is_other(const ca_light *light) { return !ca_light_falls_off(light); }

/* By power among those at a finite place and among the others; `factor` of each group makes CA_LIGHT_LEAST_SHARE of
 * them at least, where there are both. */
static void balance(const ca_light *lights, uint32_t count, double factor[2])
{
    double power[2] = {0.0, 0.0};
    for (uint32_t i = 0; i < count; i++) power[is_other(&lights[i])] += (double)lights[i].power;
    const double sum = power[0] + power[1], least = (double)CA_LIGHT_LEAST_SHARE;
    for (int k = 0; k < 2; k++) {
        factor[k] = 1.0;
        if (power[0] > 0.0 && power[1] > 0.0)
            factor[k] = fmin(fmax(power[k] / sum, least), 1.0 - least) / power[k]; /* the shares sum up to 1 */
    }
}

static ca_status create_by_power(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error)
{
    float *powers = ca_alloc(count, sizeof *powers);
    if (!powers) return ca_fail_memory(error, "the choice among lights");
    ca_status status = CA_OK;
    double factor[2];
    balance(lights, count, factor);
    for (uint32_t i = 0; i < count && status == CA_OK; i++) {
        powers[i] = (float)(factor[is_other(&lights[i])] * (double)lights[i].power);
        if (!isfinite(lights[i].power))
            status =
                ca_fail(error, CA_ERROR_SCENE, NULL, "the power of light number %u is not a finite number", i + 1);
    }
    if (status == CA_OK) status = ca_distribution_1d_create(&choice->by_power, powers, count, error);
    ca_free(powers);
    return status;
}

/* By power, but for EVEN_SHARE. Their irradiance is the mean over all directions that a surface may have. */
static ca_status create_others(ca_light_choice *choice, const ca_light *lights, uint32_t count, uint32_t other_count,
                               ca_error *error)
{
    float *weights = ca_alloc(other_count, sizeof *weights);
    choice->others = ca_alloc(other_count, sizeof *choice->others);
    if (!weights || !choice->others) {
        ca_free(weights);
        return ca_fail_memory(error, "the choice among lights");
    }
    double power = 0.0;
    for (uint32_t i = 0, next = 0; i < count; i++) {
        if (!is_other(&lights[i])) continue;
        choice->others[next++] = i;
        power += (double)lights[i].power;
    }
    for (uint32_t i = 0; i < other_count; i++) {
        const double share = power > 0.0 ? (double)lights[choice->others[i]].power / power : 0.0;
        weights[i] = (1.0f - EVEN_SHARE) * (float)share + EVEN_SHARE / (float)other_count;
    }
    const ca_status status = ca_distribution_1d_create(&choice->among_others, weights, other_count, error);
    ca_free(weights);
    const double radius = (double)lights[choice->others[0]].scene_radius;
    choice->tree.outside = (float)fmin(power / (4.0 * CA_PI_D * radius * radius), (double)FLT_MAX);
    return status;
}

static ca_status create_tree(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error)
{
    uint32_t other_count = 0;
    for (uint32_t i = 0; i < count; i++) other_count += is_other(&lights[i]);
    if (count < 2 || other_count == count) return CA_OK;
    CA_TRY(ca_light_tree_create(&choice->tree, lights, count, error));
    return other_count > 0 ? create_others(choice, lights, count, other_count, error) : CA_OK;
}

ca_status ca_light_choice_create(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error)
{
    *choice = (ca_light_choice){0};
    if (count == 0) return CA_OK;
    ca_status status = create_by_power(choice, lights, count, error);
    if (status == CA_OK) status = create_tree(choice, lights, count, error);
    if (status != CA_OK) ca_light_choice_destroy(choice);
    return status;
}

void ca_light_choice_destroy(ca_light_choice *choice)
{
    ca_distribution_1d_destroy(&choice->by_power);
    ca_distribution_1d_destroy(&choice->among_others);
    ca_light_tree_destroy(&choice->tree);
    ca_free(choice->others);
    *choice = (ca_light_choice){0};
}

/* ---- Emission -------------------------------------------------------------------------------------------------- */

uint32_t ca_light_choice_sample(const ca_light_choice *choice, float u, float *probability)
{
    *probability = 0.0f;
    if (choice->by_power.count == 0) return CA_NONE;
    if (choice->by_power.count == 1) {
        *probability = 1.0f;
        return 0;
    }
    return ca_distribution_1d_sample(&choice->by_power, u, probability, NULL);
}

float ca_light_choice_probability(const ca_light_choice *choice, uint32_t light)
{
    return light < choice->by_power.count ? ca_distribution_1d_probability(&choice->by_power, light) : 0.0f;
}

/* ---- Next event ------------------------------------------------------------------------------------------------ */

/* One of the others, by the number within their share; *probability is that of all of them, and becomes its own. */
static uint32_t choose_other(const ca_light_choice *choice, float u, float *probability)
{
    float of_other;
    const uint32_t other = ca_distribution_1d_sample(&choice->among_others, u, &of_other, NULL);
    *probability *= of_other;
    return choice->others[other];
}

uint32_t ca_light_choice_sample_direct(const ca_light_choice *choice, const ca_light_receiver *receiver, float u,
                                       float *probability)
{
    if (choice->tree.node_count == 0) return ca_light_choice_sample(choice, u, probability);
    const uint32_t light = ca_light_tree_sample(&choice->tree, receiver, &u, probability);
    return light == CA_LIGHT_TREE_OUTSIDE ? choose_other(choice, u, probability) : light;
}

void ca_light_choice_sample_direct_many(const ca_light_choice *choice, ca_light_query *queries, uint32_t count)
{
    const bool by_power = choice->tree.node_count == 0;
    if (!by_power) ca_light_tree_sample_many(&choice->tree, queries, count);
    for (uint32_t i = 0; i < count; i++) {
        ca_light_query *q = &queries[i];
        if (by_power)
            q->light = ca_light_choice_sample(choice, q->u, &q->probability);
        else if (q->light == CA_LIGHT_TREE_OUTSIDE)
            q->light = choose_other(choice, q->u, &q->probability);
    }
}

float ca_light_choice_direct_probability(const ca_light_choice *choice, const ca_light_receiver *receiver,
                                         uint32_t light)
{
    if (choice->tree.node_count == 0) return ca_light_choice_probability(choice, light);
    for (uint32_t i = 0; i < choice->among_others.count; i++)
        if (choice->others[i] == light)
            return ca_light_tree_outside_probability(&choice->tree, receiver) *
                   ca_distribution_1d_probability(&choice->among_others, i);
    return ca_light_tree_probability(&choice->tree, receiver, light);
}

float ca_light_choice_ratio(const ca_light_choice *choice, const ca_light_receiver *receiver, uint32_t light)
{
    if (choice->tree.node_count == 0) return 1.0f;
    const float emission = ca_light_choice_probability(choice, light);
    return emission > 0.0f ? ca_light_choice_direct_probability(choice, receiver, light) / emission : 0.0f;
}
