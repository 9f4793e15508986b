/* Choosing one light among all, in proportion to its power. */
#ifndef CA_LIGHT_LIGHT_CHOICE_H
#define CA_LIGHT_LIGHT_CHOICE_H

#include "light/light.h"

typedef struct ca_light_choice {
    ca_distribution_1d by_power;
} ca_light_choice;

/* For `count` prepared lights; none is allowed. */
ca_status ca_light_choice_create(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error);
void ca_light_choice_destroy(ca_light_choice *choice);
/* Index of a light and its probability; CA_NONE with 0 where there is no light. */
uint32_t ca_light_choice_sample(const ca_light_choice *choice, float u, float *probability);
float ca_light_choice_probability(const ca_light_choice *choice, uint32_t light);

#endif
