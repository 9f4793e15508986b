/* Random numbers, points and directions of a test program, all from one stream, which it seeds first. */
#ifndef CA_TEST_RANDOM_GEOMETRY_H
#define CA_TEST_RANDOM_GEOMETRY_H

#include "sampling/warp.h"
#include "support/test_random.h"

static ca_test_random numbers;

static inline float uniform(void) { return ca_test_random_float(&numbers); }
static inline float between(float low, float high) { return low + (high - low) * uniform(); }
static inline uint32_t below(uint32_t count) { return ca_test_random_u32(&numbers) % count; }
static inline ca_vec3 random_direction(void) { return ca_warp_sphere((ca_vec2){uniform(), uniform()}); }
static inline ca_vec3 random_point(float half)
{
    return ca_vec3_make(between(-half, half), between(-half, half), between(-half, half));
}

#endif
