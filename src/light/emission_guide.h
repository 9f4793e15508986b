/* Guided emission: light paths start where light reaches the picture, instead of in proportion to power and evenly.
 *
 * A guide is made from samples of light that reaches the picture: which light it came from, and where it met a
 * surface first. Two choices follow them:
 *     the light       in proportion to the light that it brings to the picture
 *     a ray's origin  of lights at infinity: rays go through balls that hold the surfaces that the light met first
 * Each is mixed with the usual choice, which has a share of CA_GUIDE_USUAL or more: what the samples do not show is
 * found four times less often at most, or sixteen times where it is both another light's and from elsewhere at
 * infinity, and never lost.
 *
 * The density of a ray's origin, per area across the ray, is a sum over the disk of light.h and the balls whose cross
 * section the ray goes through: a pure function of the line, known to all techniques from any point on it. Origins
 * lie in the plane of the usual disk. Directions are as without a guide.
 *
 * Everywhere `guide` may be NULL: emission as usual. A guide is immutable and shared by all threads; it borrows the
 * lights. */
#ifndef CA_LIGHT_EMISSION_GUIDE_H
#define CA_LIGHT_EMISSION_GUIDE_H

#include "light/light_choice.h"

/* The least share of the usual emission. */
#define CA_GUIDE_USUAL 0.25f

/* Light that reaches the picture. */
typedef struct ca_guide_sample {
    ca_vec3 position; /* where it met a surface first */
    uint32_t light;
    float weight; /* > 0: how much of it */
} ca_guide_sample;

/* Through it goes a share of a light's rays. */
typedef struct ca_guide_ball {
    ca_vec3 center;
    float radius, density; /* density: of a ray through it, share / (pi radius^2) */
} ca_guide_ball;

/* Where the rays of a light at infinity go. */
typedef struct ca_guide_aim {
    ca_guide_ball *balls; /* owned */
    uint32_t count;       /* 0: as usual */
    ca_distribution_1d parts; /* the disk, and the balls */
} ca_guide_aim;

typedef struct ca_emission_guide {
    const ca_light *lights;
    uint32_t light_count;
    ca_distribution_1d choice; /* among lights */
    ca_guide_aim *aims;        /* owned; [light_count] */
} ca_emission_guide;

/* Is there a choice among the lights, or one at infinity? */
bool ca_emission_can_be_guided(const ca_light *lights, uint32_t count);

/* From `count` samples, whose order changes. Deterministic. Errors: CA_ERROR_MEMORY. */
ca_status ca_emission_guide_create(ca_emission_guide **guide, const ca_light *lights, uint32_t light_count,
                                   const ca_light_choice *choice, ca_guide_sample *samples, size_t count,
                                   ca_error *error);
void ca_emission_guide_destroy(ca_emission_guide *guide);

/* ca_light_choice_sample, _probability and _ratio of emission. */
uint32_t ca_emission_choose(const ca_emission_guide *guide, const ca_light_choice *choice, float u,
                            float *probability);
float ca_emission_probability(const ca_emission_guide *guide, const ca_light_choice *choice, uint32_t light);
float ca_emission_ratio(const ca_emission_guide *guide, const ca_light_choice *choice,
                        const ca_light_receiver *receiver, uint32_t light);

/* ca_light_sample_emission of light number `light`. */
bool ca_emission_sample(const ca_emission_guide *guide, const ca_light *lights, uint32_t light, ca_vec2 u_position,
                        ca_vec2 u_direction, ca_light_emission *emission);
/* pdf_position of a ray of the light through `point`, along `direction`, which leaves the light; `usual`: without a
 * guide. */
ca_pdf_area ca_emission_pdf_position(const ca_emission_guide *guide, uint32_t light, ca_vec3 point, ca_vec3 direction,
                                     ca_pdf_area usual);

#endif
