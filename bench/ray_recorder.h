/* Records the rays that a render hands to Embree and replays them raw: the yardstick for everything a renderer does
 * around its rays. The bench programs are linked so that rtcIntersect1 and rtcOccluded1 pass through here
 * (ld --wrap); without recording that costs one predictable branch. One thread only while recording. */
#ifndef CA_BENCH_RAY_RECORDER_H
#define CA_BENCH_RAY_RECORDER_H

#include <stdbool.h>
#include <stddef.h>

/* Starts a new recording of at most `capacity` rays; false when out of memory. */
bool ray_recorder_start(size_t capacity);
/* Stops; returns how many rays there were (more than the capacity: the rest was not kept). */
size_t ray_recorder_stop(void);
/* Hands the kept rays to Embree again, in their order, same scene, flags and calls; returns the seconds it took. */
double ray_recorder_replay(void);
/* How many of the replayed rays met something, nearest-hit and visibility rays together: to be the same as recorded. */
size_t ray_recorder_hits(void);
size_t ray_recorder_recorded_hits(void);
void ray_recorder_free(void);

#endif
