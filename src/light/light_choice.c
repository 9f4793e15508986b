#include "light/light_choice.h"

#include "base/memory.h"

ca_status ca_light_choice_create(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error)
{
    *choice = (ca_light_choice){0};
    if (count == 0) return CA_OK;
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

void ca_light_choice_destroy(ca_light_choice *choice) { ca_distribution_1d_destroy(&choice->by_power); }

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
