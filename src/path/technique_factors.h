/* Factors of techniques: what the density of each is multiplied by before the weight is made of it, for all paths of
 * one place on the film (the idea of Grittmann, Georgiev, Slusallek and Křivánek 2019, "Variance-Aware Multiple
 * Importance Sampling", for techniques of one sample each). Any positive numbers leave the image's mean as it is, as
 * long as they do not depend on the paths that are weighted, and as all techniques of a path read the same ones. */
#ifndef CA_PATH_TECHNIQUE_FACTORS_H
#define CA_PATH_TECHNIQUE_FACTORS_H

#include <stdint.h>

/* Numbers of vertices from here on are one class; classes of lights. */
enum { CA_FACTOR_VERTICES = 6, CA_FACTOR_LIGHTS = 8 };

/* By the vertices that the camera's and the light's subpath bring, at most CA_FACTOR_VERTICES - 1 each; a merged
 * vertex is the camera's. Of hits and next events every class of lights has its own: a small lamp that is rarely hit
 * must not be taken for a sky that always is. Splats have none. */
typedef struct ca_technique_factors {
    float hits[CA_FACTOR_VERTICES][CA_FACTOR_LIGHTS], next_events[CA_FACTOR_VERTICES][CA_FACTOR_LIGHTS];
    float connections[CA_FACTOR_VERTICES][CA_FACTOR_VERTICES], merges[CA_FACTOR_VERTICES][CA_FACTOR_VERTICES];
} ca_technique_factors;

/* The class of so many vertices. */
static inline uint32_t ca_factor_vertices(uint32_t vertices)
{
    return vertices < CA_FACTOR_VERTICES ? vertices : CA_FACTOR_VERTICES - 1;
}

/* The class of a light of the scene: the first few have one each. */
static inline uint32_t ca_factor_light(uint32_t light) { return light % CA_FACTOR_LIGHTS; }

/* Of the split after so many camera vertices; `light`: the class of the path's light. */
static inline float ca_split_factor(const ca_technique_factors *factors, uint32_t camera_vertices,
                                    uint32_t light_vertices, uint32_t light)
{
    const uint32_t s = ca_factor_vertices(camera_vertices);
    if (!factors || s < 2) return 1.0f;
    return light_vertices == 0   ? factors->hits[s][light]
           : light_vertices == 1 ? factors->next_events[s][light]
                                 : factors->connections[s][ca_factor_vertices(light_vertices)];
}

static inline float ca_merge_factor(const ca_technique_factors *factors, uint32_t camera_vertices,
                                    uint32_t light_vertices)
{
    if (!factors) return 1.0f;
    return factors->merges[ca_factor_vertices(camera_vertices)][ca_factor_vertices(light_vertices)];
}

#endif
