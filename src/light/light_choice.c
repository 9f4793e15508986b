#include "light/light_choice.h"

#include "base/memory.h"

static ca_status create_by_power(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error)
{
    float *powers = ca_alloc(count, sizeof *powers);
    if (!powers) return ca_fail_memory(error, "the choice among lights");
    ca_status status = CA_OK;
    for (uint32_t i = 0; i < count && status == CA_OK; i++) {
        powers[i] = lights[i].power;
        if (!isfinite(powers[i]))
            status =
                ca_fail(error, CA_ERROR_SCENE, NULL, "the power of light number %u is not a finite number", i + 1);
    }
    if (status == CA_OK) status = ca_distribution_1d_create(&choice->by_power, powers, count, error);
    ca_free(powers);
    return status;
}

/* Weights of the parts: [0] the power of all lights in the tree, then that of each of the others. */
static ca_status create_parts(ca_light_choice *choice, const ca_light *lights, uint32_t count,
                              uint32_t other_count, ca_error *error)
{
    float *powers = ca_alloc((size_t)other_count + 1, sizeof *powers);
    choice->others = ca_alloc((size_t)other_count + 1, sizeof *choice->others);
    if (!powers || !choice->others) {
        ca_free(powers);
        return ca_fail_memory(error, "the choice among lights");
    }
    double finite = 0.0;
    uint32_t next = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (ca_light_falls_off(&lights[i])) {
            finite += (double)lights[i].power;
            continue;
        }
        choice->others[next++] = i;
        powers[next] = lights[i].power;
    }
    powers[0] = (float)fmin(finite, (double)FLT_MAX);
    const ca_status status = ca_distribution_1d_create(&choice->parts, powers, other_count + 1, error);
    ca_free(powers);
    return status;
}

static ca_status create_tree(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error)
{
    uint32_t other_count = 0;
    for (uint32_t i = 0; i < count; i++) other_count += !ca_light_falls_off(&lights[i]);
    if (count - other_count < CA_LIGHT_CHOICE_TREE_LIGHTS) return CA_OK;
    CA_TRY(create_parts(choice, lights, count, other_count, error));
    return ca_light_tree_create(&choice->tree, lights, count, error);
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
    ca_distribution_1d_destroy(&choice->parts);
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

/* A light at infinity and its probability, or CA_NONE with that of the tree; *u becomes the number within the
 * share. */
static uint32_t choose_part(const ca_light_choice *choice, float *u, float *probability)
{
    *probability = 1.0f;
    if (choice->parts.count == 1) return CA_NONE;
    const uint32_t part = ca_distribution_1d_sample(&choice->parts, *u, probability, u);
    return part > 0 ? choice->others[part - 1] : CA_NONE;
}

uint32_t ca_light_choice_sample_direct(const ca_light_choice *choice, const ca_light_receiver *receiver, float u,
                                       float *probability)
{
    if (choice->tree.node_count == 0) return ca_light_choice_sample(choice, u, probability);
    uint32_t light = choose_part(choice, &u, probability);
    if (light != CA_NONE) return light;
    float of_light;
    light = ca_light_tree_sample(&choice->tree, receiver, u, &of_light);
    *probability *= of_light;
    return light;
}

void ca_light_choice_sample_direct_many(const ca_light_choice *choice, ca_light_query *queries, uint32_t count)
{
    const bool by_power = choice->tree.node_count == 0;
    for (uint32_t i = 0; i < count; i++) {
        ca_light_query *q = &queries[i];
        q->light = by_power ? ca_light_choice_sample(choice, q->u, &q->probability)
                            : choose_part(choice, &q->u, &q->probability);
    }
    if (!by_power) ca_light_tree_sample_many(&choice->tree, queries, count);
}

float ca_light_choice_direct_probability(const ca_light_choice *choice, const ca_light_receiver *receiver,
                                         uint32_t light)
{
    if (choice->tree.node_count == 0) return ca_light_choice_probability(choice, light);
    for (uint32_t part = 1; part < choice->parts.count; part++)
        if (choice->others[part - 1] == light) return ca_distribution_1d_probability(&choice->parts, part);
    return ca_distribution_1d_probability(&choice->parts, 0) *
           ca_light_tree_probability(&choice->tree, receiver, light);
}

float ca_light_choice_ratio(const ca_light_choice *choice, const ca_light_receiver *receiver, uint32_t light)
{
    if (choice->tree.node_count == 0) return 1.0f;
    const float emission = ca_light_choice_probability(choice, light);
    return emission > 0.0f ? ca_light_choice_direct_probability(choice, receiver, light) / emission : 0.0f;
}
