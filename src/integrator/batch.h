/* A batch of paths on their way: the state of hundreds of them as structures of arrays, which the stages of an
 * integrator go through one after the other. All paths of a batch have as many segments so far. Internal to this
 * folder.
 *
 * A path sits at two numbers: its *slot* is where it was handed in, and stays; its *place* in the arrays changes when
 * paths before it end, for the arrays are kept dense. What must not move (sums, streams of numbers) lies by slot.
 *
 * What a path finds depends on its own address alone, never on its neighbours: so the size of batches changes no
 * bit. */
#ifndef CA_INTEGRATOR_BATCH_H
#define CA_INTEGRATOR_BATCH_H

#include "geometry/ray_batch.h"
#include "integrator/integrator.h"
#include "math/numeric.h"
#include "path/light_store.h"

enum { CA_BATCH = CA_RAY_BATCH };

/* The vertices where the paths have arrived, by place. */
typedef struct ca_vertex_batch {
    ca_column3 position, ng, ns, wi; /* wi: unit, to the previous vertex */
    float error[CA_COLUMN];          /* bound on the rounding of each coordinate of the position; matte only */
    uint32_t matte[CA_COLUMN];       /* all bits: a diffuse point (scene/matte.h); 0: `surfaces` and `bsdfs` tell */
    uint32_t light[CA_COLUMN];       /* of the shape, or CA_NONE */
    ca_column3 reflectance;          /* matte only; likewise: */
    float side[CA_COLUMN];           /* -1 where the frame is mirrored, else 1 */
    ca_surface surfaces[CA_BATCH];   /* not matte only; likewise: */
    ca_bsdf bsdfs[CA_BATCH];
} ca_vertex_batch;

/* Questions for visibility, and what a path gets where the answer is yes. */
typedef struct ca_visibility_batch {
    uint32_t count;
    ca_ray_batch rays;
    ca_column3 contribution;
    float weight[CA_COLUMN]; /* that is in the contribution */
    uint32_t slot[CA_COLUMN];
    uint8_t occluded[CA_BATCH];
    ca_light_vertex lights[CA_BATCH]; /* the point asked for; only where the paths are observed */
} ca_visibility_batch;

/* The numbers of a decision, for each place. */
typedef struct ca_number_batch {
    _Alignas(32) float x[CA_COLUMN];
    float y[CA_COLUMN];
} ca_number_batch;

typedef struct ca_batch {
    uint32_t count;    /* paths on their way: places [0, count) */
    uint32_t segments; /* that each has behind it */
    /* The next segment, by place, and what the path carries. */
    ca_ray_batch rays;
    ca_column3 throughput;  /* f |cos| / pdf of all vertices so far */
    float eta2[CA_COLUMN];  /* square of the product of relative indices: what refraction took from the throughput */
    ca_column3 previous, previous_normal; /* the vertex that the segment leaves, as it asked for light; and how the
                                             direction was sampled: */
    float pdf[CA_COLUMN];   /* per solid angle; a Dirac event's probability */
    uint32_t dirac[CA_COLUMN];
    uint32_t key_low[CA_COLUMN], key_high[CA_COLUMN]; /* of the independent sampler's stream */
    uint32_t slot[CA_COLUMN];

    ca_hit_batch hits;
    ca_vertex_batch vertices;
    ca_visibility_batch visibility;
    ca_number_batch numbers[3]; /* of the stage at work */

    /* By slot. */
    ca_stream streams[CA_BATCH];
    ca_rgb radiance[CA_BATCH];
    bool met_smooth[CA_BATCH]; /* an event that is no Dirac one; only where input.tells_shown is set */
    uint32_t work[CA_COLUMN]; /* segments traced, those that asked for visibility too */
    ca_camera_path *paths; /* borrowed: as handed in */
    ca_surface_point (*points)[3]; /* borrowed: each path's last vertices, where they are observed; else NULL */
} ca_batch;

/* Numbers `dimension` and `dimension + 1` of each path. */
void ca_batch_sample_2d(const ca_batch *batch, uint32_t dimension, ca_number_batch *numbers);
/* Number `dimension`, in numbers->x. */
void ca_batch_sample_1d(const ca_batch *batch, uint32_t dimension, ca_number_batch *numbers);

/* Camera paths [0, count): streams and first rays; samples get their filter's weights. Those that the lens lets
 * nothing through for end at once. */
void ca_batch_start_camera(ca_batch *batch, const ca_integrator_input *input, ca_camera_path *paths, uint32_t count);

/* Follows the segments: `hits`. */
void ca_batch_intersect(ca_batch *batch, const ca_scene *scene, ca_worker *worker);
/* From hits to `vertices`: surfaces and BSDFs. Paths that left the scene keep light = CA_NONE and are not looked at;
 * where `wants_bsdf` is false only surfaces are made. */
void ca_batch_arrive(ca_batch *batch, const ca_scene *scene, bool wants_bsdf);
/* The whole surface at a place: where the point is matte it is made now. */
const ca_surface *ca_batch_surface(ca_batch *batch, const ca_scene *scene, uint32_t i);

/* What the film's first-hit layers show. */
void ca_batch_record_primary(ca_batch *batch);

/* Samples directions at the vertices and ends paths by absorption and roulette (from rr_depth segments on): the batch
 * then holds the paths that go on, with their next segments. */
void ca_batch_scatter(ca_batch *batch, uint32_t rr_depth);

/* Did the path leave the scene? */
static inline bool ca_batch_left(const ca_batch *batch, uint32_t i) { return batch->hits.shape[i] == CA_NONE; }

#endif
