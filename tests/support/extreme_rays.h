/* Rays with huge, tiny and impossible numbers through instances with any maps: Debian's Embree ends the process where
 * one of its asserts fails. */
#ifndef CA_TEST_EXTREME_RAYS_H
#define CA_TEST_EXTREME_RAYS_H

#include <stdint.h>

/* What came of it. */
typedef struct extreme_rays {
    uint64_t worlds, refused; /* refused: with a map that no ray can go through */
    uint64_t rays, hits;
} extreme_rays;

/* Worlds of a few instances and shapes, each with so many rays, one by one and in batches. Hits must lie on the ray.
 * */
extreme_rays trace_extreme_rays(uint64_t seed, uint32_t worlds, uint32_t rays_of_world);

#endif
