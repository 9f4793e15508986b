/* What light paths, camera paths and merge candidates cost, measured while they are traced.
 *
 * Seconds of one processor (threads' clocks, summed; not those in which threads wait): what else the machine does is
 * not in them. A segment is a ray of a camera path with what follows it, a look at the photons around its end
 * included; a candidate is a photon in reach whose merge is weighed (ca_counters.merges). An iteration of N_F light
 * paths and N_B(p) camera paths is taken to cost
 *
 *     T = t_0 + N_F t_F + sum_p N_B(p) (t_B(p) + N_F t_M(p)),
 *
 * docs/papers/000.md (D1): t_B(p) in proportion to the segments of the pixel's camera paths, t_M(p) to the candidates
 * that one light path brings to one of its camera paths. The two factors come from the times of tiles, in which
 * segments and candidates differ: least squares that interrupts do not move (cost_fit.h). Passes of different N_F
 * separate them better than tiles do. t_0 and t_F come from passes of different N_F; where all had the same, t_0 is
 * 0.
 *
 * Photons that are looked at in vain (most of ca_counters.photons_tested) do not count: eight are tested at once, and
 * as long as photons are few their number hardly depends on N_F (photon_grid.h: what shares a bucket), so that they
 * are a part of the segments.
 *
 * The law is a tangent. A candidate costs more where it comes alone, and where the photons have outgrown the caches.
 * Costs are those of the N_F that were measured, and should be
 * measured again for numbers far from them.
 *
 * A candidate costs more where pairs are gathered (film/pair_sums.h). Tiles of such passes are kept apart, and count
 * only where there are no others.
 *
 * State: 24 bytes a pixel, 80 KiB a worker: where there are more tiles than fit, an even choice of them is kept.
 * Threads: ca_ray_times_pixel and _tile by different workers at once, for different pixels; all else by one thread.
 * The image does not depend on it. */
#ifndef CA_RENDER_RAY_TIMES_H
#define CA_RENDER_RAY_TIMES_H

#include "film/part_exchange.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct ca_ray_times ca_ray_times;

enum { CA_RAY_TIMES_PIXEL_BYTES = 24 };

/* Seconds; NAN: not measured. Each with the standard error that the scatter of tiles and passes suggests, about as
 * large as the value itself where two costs cannot be separated. */
typedef struct ca_ray_costs {
    double iteration, light_path;             /* t_0, t_F */
    double iteration_error, light_path_error;
    double segment, candidate;                /* NAN where there were none */
    double segment_error, candidate_error;
    double camera_path, camera_path_error;    /* t_B, mean over camera paths */
    double merge;                             /* t_M, likewise; 0 where there were no candidates */
    double segments_per_camera_path;          /* means over camera paths */
    double candidates_per_pair;               /* of a light path with a camera path */
    bool with_pairs; /* measured where pairs were gathered: candidates look too expensive for a render */
} ca_ray_costs;

/* For a film part of width x height pixels. */
ca_status ca_ray_times_create(ca_ray_times **times, uint32_t width, uint32_t height, uint32_t workers,
                              ca_error *error);
void ca_ray_times_destroy(ca_ray_times *times); /* NULL is allowed */

/* Discards measured times, but keeps what pixels did. Of each worker's tiles and of the light paths an even choice of
 * up to `most` samples stays; 0 discards all, to measure the costs of other numbers. Where some stay and times of
 * another N_F are measured next, costs follow the secant between the two: this separates the cost of candidates from
 * that of segments, which tiles of one N_F hardly do. */
void ca_ray_times_thin(ca_ray_times *times, size_t most);

/* Adds what `other` has measured, of the same pixels and with as many workers. Of times, where both together do not
 * fit, an even choice of each. */
void ca_ray_times_pool(ca_ray_times *times, const ca_ray_times *other);

/* Writes all that was measured to a part file, or reads it into times of as many pixels without any. Other numbers of
 * workers may read it than wrote it. */
void ca_ray_times_exchange(ca_ray_times *times, ca_part_exchange *x);

/* The light paths of a pass took so long, all threads together. A round of a pass that has several counts as a pass
 * of its own. */
void ca_ray_times_light(ca_ray_times *times, uint64_t light_paths, double seconds);
/* What a pixel's camera paths did in a pass. */
void ca_ray_times_pixel(ca_ray_times *times, uint32_t x, uint32_t y, uint64_t light_paths, uint32_t camera_paths,
                        uint64_t segments, uint64_t candidates);
/* How long a worker took for a tile, and what was done there; with_pairs: pairs were gathered. */
void ca_ray_times_tile(ca_ray_times *times, uint32_t worker, bool with_pairs, uint64_t segments, uint64_t candidates,
                       double seconds);

ca_ray_costs ca_ray_times_costs(const ca_ray_times *times);
/* t_B > 0 and t_M >= 0 of a pixel, for ca_ray_pixel (noise/ray_numbers.h). A pixel that has no camera paths yet gets
 * the means. What pixels did is kept when the costs are those of another ca_ray_times. */
void ca_ray_times_of_pixel(const ca_ray_times *times, const ca_ray_costs *costs, uint32_t x, uint32_t y,
                           double *camera_time, double *merge_time);

#endif
