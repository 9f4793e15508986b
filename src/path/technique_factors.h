/* Factors of techniques: what the density of each is multiplied by before the weight is made of it, for all paths of
 * one place on the film (the idea of Grittmann, Georgiev, Slusallek and Křivánek 2019, "Variance-Aware Multiple
 * Importance Sampling", for techniques of one sample each). Any positive numbers leave the image's mean as it is, as
 * long as they do not depend on the paths that are weighted, and as all techniques of a path read the same ones. */
#ifndef CA_PATH_TECHNIQUE_FACTORS_H
#define CA_PATH_TECHNIQUE_FACTORS_H

#include <stdint.h>

/* Numbers of vertices from here on are one class. */
enum { CA_FACTOR_VERTICES = 6 };

/* By the vertices that the camera's and the light's subpath bring, at most CA_FACTOR_VERTICES - 1 each; a merged
 * vertex is the camera's. */
typedef struct ca_technique_factors {
    float splits[CA_FACTOR_VERTICES][CA_FACTOR_VERTICES]; /* hit, next event, connect, splat */
    float merges[CA_FACTOR_VERTICES][CA_FACTOR_VERTICES];
} ca_technique_factors;

/* The class of so many vertices. */
static inline uint32_t ca_factor_class(uint32_t vertices)
{
    return vertices < CA_FACTOR_VERTICES ? vertices : CA_FACTOR_VERTICES - 1;
}

static inline float ca_split_factor(const ca_technique_factors *factors, uint32_t camera, uint32_t light)
{
    return factors ? factors->splits[ca_factor_class(camera)][ca_factor_class(light)] : 1.0f;
}

static inline float ca_merge_factor(const ca_technique_factors *factors, uint32_t camera, uint32_t light)
{
    return factors ? factors->merges[ca_factor_class(camera)][ca_factor_class(light)] : 1.0f;
}

#endif
