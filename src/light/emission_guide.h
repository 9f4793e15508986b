/* Guided emission: light paths start towards what brings light to the picture, instead of in proportion to power and
 * evenly.
 *
 * A guide is made from samples of light that reaches the picture: which light it came from, and where it met a
 * surface first. Three choices follow them:
 *     the light          in proportion to the light that it brings to the picture
 *     a ray's origin     of lights at infinity: rays go through balls that hold the surfaces that the light met first
 *     a ray's direction  of area lights, points and spots: rays go into the cones under which they see these balls
 * Each is mixed with the usual choice, which has a share of CA_GUIDE_USUAL or more: what the samples do not show is
 * found four times less often at most, or sixteen times where it is both another light's and elsewhere, and never
 * lost. Beams and projectors are chosen, but not aimed.
 *
 * Densities are pure functions of the ray, known to all techniques that make it:
 *     at infinity  that of the origin, per area across the ray, is a sum over the disk of light.h and the balls whose
 *                  cross section the ray goes through, the same from any point of the ray; origins lie in the plane
 *                  of the usual disk, and directions are as usual
 *     others       that of the direction is a sum over the usual one and the cones that hold it; cones are those of
 *                  balls in front of the ray's origin, and what other balls would have goes to the usual directions
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
    float radius, density; /* density: of parallel rays through it, share / (pi radius^2) */
} ca_guide_ball;

/* Where the rays of a light go. */
typedef struct ca_guide_aim {
    ca_guide_ball *balls; /* owned */
    uint32_t count;       /* 0: as usual */
    ca_distribution_1d parts; /* the usual rays, and the balls */
} ca_guide_aim;

typedef struct ca_emission_guide {
    const ca_light *lights;
    uint32_t light_count;
    ca_distribution_1d choice; /* among lights */
    ca_guide_aim *aims;        /* owned; [light_count] */
} ca_emission_guide;

/* Is there a choice among the lights, or one that can be aimed? */
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

/* A ray that leaves a light. */
typedef struct ca_emitted_ray {
    ca_vec3 origin, ng; /* on the light; ng zero where it has no surface. Of a light at infinity: any point, zero */
    ca_vec3 direction;
} ca_emitted_ray;

typedef struct ca_emission_pdf {
    ca_pdf_area position;
    ca_pdf_solid_angle direction;
} ca_emission_pdf;

/* pdf_position and pdf_direction of a ray; `usual`: without a guide. */
ca_emission_pdf ca_emission_ray_pdf(const ca_emission_guide *guide, uint32_t light, const ca_emitted_ray *ray,
                                    ca_emission_pdf usual);

#endif
