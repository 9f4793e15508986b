/* What light paths, camera paths and merge candidates cost, measured while they are traced.
 *
 * Seconds of one processor (CLOCK_THREAD_CPUTIME_ID, summed over threads): what else the machine does is not in them. A
 * candidate is a photon that is tested for a merge (ca_counters.photons_tested). An iteration of N_F light paths and N_B(p) camera
 * paths is taken to cost
 *
 *     T = t_0 + N_F t_F + sum_p N_B(p) (t_B(p) + N_F t_M(p)),
 *
 * docs/papers/000.md (D1): t_B(p) in proportion to the segments of the pixel's camera paths, t_M(p) to the candidates that one
 * light path brings to one of its camera paths. The two factors come from the times of tiles, in which segments and
 * candidates differ: least squares. t_0 and t_F come from passes of different N_F; where all had the same, t_0 is 0.
 *
 * State: 16 bytes a pixel, some hundred bytes a thread. Threads: ca_ray_times_pixel and _tile by different workers at once, for
 * different pixels. */
#ifndef CA_RENDER_RAY_TIMES_H
#define CA_RENDER_RAY_TIMES_H

#include "base/status.h"

#include <stdint.h>

typedef struct ca_ray_times ca_ray_times;

/* Means over what was measured, seconds; NAN: not measured. Each with the standard error that the scatter of tiles and passes
 * suggests. */
typedef struct ca_ray_costs {
    double iteration, light_path, camera_path, candidate;                         /* t_0, t_F, mean t_B, t of a candidate */
    double iteration_error, light_path_error, camera_path_error, candidate_error;
} ca_ray_costs;

/* For a film part of width x height pixels. */
ca_status ca_ray_times_create(ca_ray_times **times, uint32_t width, uint32_t height, uint32_t workers, ca_error *error);
void ca_ray_times_destroy(ca_ray_times *times); /* NULL is allowed */

/* The light paths of a pass took so long, all threads together. */
void ca_ray_times_light(ca_ray_times *times, uint32_t light_paths, double seconds);
/* What a pixel's camera paths did in a pass. */
void ca_ray_times_pixel(ca_ray_times *times, uint32_t x, uint32_t y, uint32_t light_paths, uint32_t camera_paths, uint64_t segments,
                        uint64_t candidates);
/* How long a worker took for a tile, and what was done there. */
void ca_ray_times_tile(ca_ray_times *times, uint32_t worker, uint64_t camera_paths, uint64_t segments, uint64_t candidates,
                       double seconds);

ca_ray_costs ca_ray_times_costs(const ca_ray_times *times);
/* t_B > 0 and t_M >= 0 of a pixel, for ca_ray_pixel (noise/ray_numbers.h). */
void ca_ray_times_of_pixel(const ca_ray_times *times, const ca_ray_costs *costs, uint32_t x, uint32_t y, double *camera_time,
                           double *merge_time);

#endif
