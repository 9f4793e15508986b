/* Choosing one light among all: for emission in proportion to its power (emission_guide.h knows better), but lights
 * at a finite place and the others get an eighth at least where there are both; for next event by what it may
 * contribute at the point that asks.
 *
 * For next event the tree chooses among lights at a finite place (light_tree.h). Those that do not fall off with
 * distance (those at infinity, beams) are chosen by power among themselves, and against the tree by the irradiance
 * that both may bring to the point that asks. Power would not do: that of a sky grows with the square of the scene's
 * radius, and a lamp on a wide plain would never be asked. */
#ifndef CA_LIGHT_LIGHT_CHOICE_H
#define CA_LIGHT_LIGHT_CHOICE_H

#include "light/light_tree.h"

typedef struct ca_light_choice {
    ca_distribution_1d by_power;
    ca_light_tree tree; /* without nodes: next event chooses by power, too */
    uint32_t *others;   /* lights that are not in the tree; NULL where there are none, or no tree */
    ca_distribution_1d among_others;
} ca_light_choice;

/* For `count` prepared lights; none is allowed. */
ca_status ca_light_choice_create(ca_light_choice *choice, const ca_light *lights, uint32_t count, ca_error *error);
void ca_light_choice_destroy(ca_light_choice *choice);

/* Emission: index of a light and its probability; CA_NONE with 0 where there is no light. */
uint32_t ca_light_choice_sample(const ca_light_choice *choice, float u, float *probability);
float ca_light_choice_probability(const ca_light_choice *choice, uint32_t light);

/* Next event: likewise; CA_NONE with 0 also where no light can contribute. */
uint32_t ca_light_choice_sample_direct(const ca_light_choice *choice, const ca_light_receiver *receiver, float u,
                                       float *probability);
/* Many receivers that ask one light each, with the same answers to the bit: `light` and `probability` are set. */
void ca_light_choice_sample_direct_many(const ca_light_choice *choice, ca_light_query *queries, uint32_t count);
float ca_light_choice_direct_probability(const ca_light_choice *choice, const ca_light_receiver *receiver,
                                         uint32_t light);

/* The latter over the probability with which the light is chosen for emission: what ca_light_next_event_ratio leaves
 * out. */
float ca_light_choice_ratio(const ca_light_choice *choice, const ca_light_receiver *receiver, uint32_t light);

#endif
