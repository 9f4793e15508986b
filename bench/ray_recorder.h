/* Records the rays that a render hands to Embree and replays them raw: the yardstick for everything a renderer does
 * around its rays. The bench programs are linked so that rtcIntersect1 and rtcOccluded1 pass through here (ld
 * --wrap); without recording that costs one predictable branch.
 *
 * Threads: a render may have several while recording, each keeps its own rays in its own order. start, stop, replay
 * and free are for one thread while no render runs. State: 48 bytes a ray. */
#ifndef CA_BENCH_RAY_RECORDER_H
#define CA_BENCH_RAY_RECORDER_H

#include <stdbool.h>
#include <stddef.h>

typedef struct ray_counts {
    size_t rays, shadow_rays; /* nearest-hit and visibility queries */
    size_t hits;              /* how many of them, together, met something */
} ray_counts;

/* Starts a new recording; the last one is forgotten. */
void ray_recorder_start(void);
/* Stops; false when there was not memory for all rays. */
bool ray_recorder_stop(ray_counts *recorded);
/* Hands the rays to Embree again, same scene, flags and calls. With one thread in their order, with more each takes
 * runs of some thousand neighbours as it comes free. Returns the seconds it took; `replayed` should be what was
 * recorded. */
double ray_recorder_replay(int threads, ray_counts *replayed);
void ray_recorder_free(void);

#endif
