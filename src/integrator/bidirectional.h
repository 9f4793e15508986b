/* The bidirectional engine behind light, bdpt, ppm, bdpm, vcm and its kin. Internal to this folder.
 *
 * A pass traces N_F light paths and keeps their vertices; then every pixel traces N_B camera paths, which gather
 * light in up to five ways (path/technique.h):
 *
 *     technique    where           estimates                                                  divided by
 *     hit          camera_walk.c   throughput_camera L_e                                      1
 *     next event   camera_walk.c   throughput_camera f |cos| L_e / pdf                        1
 *     connect      join.c          throughput_camera f G f throughput_light                   1   (with one light
 * path) merge        join.c          throughput_camera f throughput_light / (pi r^2)            N_F (with all of
 * them) splat        light_walk.c    throughput_light f |cos| W_e / pdf                         N_F (onto any pixel)
 *
 * each times its weight (path/mis.h). An algorithm is a set of ca_mis_rules; algorithms.c has the table.
 *
 * Chunks: light paths are kept in chunks of a fixed number, each with a photon grid of its own. A camera path's light
 * is summed for each chunk apart and the sums are added in order, so that it does not matter how many chunks are in
 * memory at a time (rounds, integrator.h).
 *
 * Pairs: where input.pairs wants them, all that the techniques bring is also summed for every pair of a light and a
 * camera path (pairs.c), which reads what the image gets and changes nothing of it. */
#ifndef CA_INTEGRATOR_BIDIRECTIONAL_H
#define CA_INTEGRATOR_BIDIRECTIONAL_H

#include "film/pair_splats.h"
#include "film/splats.h"
#include "integrator/integrator.h"
#include "path/light_store.h"
#include "path/mis.h"
#include "path/subpath.h"
#include "photon/photon_grid.h"

/* Photons farther than 60 degrees from the surface's tilt belong to another surface. */
#define CA_MERGE_MIN_COS 0.5f

/* Light paths of pilots are numbered from here: no pass gets so far. */
#define CA_PILOT_NUMBER (UINT64_C(1) << 62)

enum {
    CA_CHUNK_PATHS = 1 << 18,
    CA_BLOCK_PATHS = 512, /* light paths of one task */
};

/* What a worker needs for a camera path. */
typedef struct ca_bidirectional_scratch {
    ca_path_vertex camera[CA_PATH_MAX_VERTICES];
    ca_bsdf light_bsdfs[CA_PATH_MAX_VERTICES]; /* of the light path it connects to, ... */
    ca_surface light_surfaces[CA_PATH_MAX_VERTICES];
    uint32_t light_ready;                      /* ... made up to this vertex */
    ca_pair_sums *pairs; /* owned: of the pixel; NULL: not wanted */
    bool pairing;        /* between begin_pixel and end_pixel */
    ca_rgb *chunk_light; /* owned: gathered with each chunk in memory; behind them what ca_camera_walk.connect_slot
                            says */
} ca_bidirectional_scratch;

/* Photons and splats of a block of light paths. */
typedef struct ca_light_block {
    ca_photon *photons; /* owned */
    size_t photon_count, photon_capacity;
    ca_splat_list splats;
} ca_light_block;

/* What a merge reads of a photon: one cache line. */
typedef struct ca_merge_photon {
    ca_vec3 wi;        /* as the light vertex has them */
    ca_rgb throughput;
    ca_vec3 ng;
    ca_pdf_area pdf_forward;
    float to_previous, distance, sqrt_area, sqrt_omega;
    uint32_t first; /* number of its path's v[0] ... */
    uint32_t index : 14; /* ... and its own in the path */
    uint32_t path : 18;  /* number of its path in the chunk, where pairs are wanted */
} ca_merge_photon;

_Static_assert(sizeof(ca_merge_photon) == 64, "a cache line");
_Static_assert(CA_PATH_MAX_VERTICES < 1 << 14 && CA_CHUNK_PATHS <= 1 << 18,
               "they fit the records of photons and splats");

typedef struct ca_light_chunk {
    uint32_t count; /* light paths */
    ca_light_store store;
    ca_photon_grid *grid;     /* NULL where nothing is merged */
    ca_merge_photon *photons; /* owned; in the grid's places */
    size_t photon_capacity;
} ca_light_chunk;

typedef struct ca_bidirectional {
    ca_integrator_input input;
    uint32_t max_depth, rr_depth;
    bool hide_emitters;
    ca_mis_rules rules; /* of the pass */
    uint32_t light_paths, camera_paths; /* N_F, N_B */
    float radius0, alpha;      /* merge radius of the first pass; how fast it shrinks */
    float radius;              /* of this pass */

    uint32_t chunk_count, resident; /* chunks of a pass, and how many are in memory at a time */
    ca_light_chunk *chunks;         /* owned; [resident] */
    uint32_t first_chunk, chunks_now; /* of this round */
    uint64_t pairing_shift;         /* camera path i connects to light path (i + shift) mod N_F */
    ca_light_block *blocks;         /* owned; of one chunk */
    ca_splat_buffer splats;
    ca_pair_splats pair_splats;     /* empty where pairs or splats are not wanted */
    ca_photon_grid *pilot;          /* photons whose density the reuse rule asks for; else NULL, or not made yet */
    float pilot_scale;              /* N_F over the number of its light paths */
    ca_bidirectional_scratch *scratch; /* owned; [input.workers] */
} ca_bidirectional;

static inline bool ca_bidirectional_merges(const ca_bidirectional *b) { return b->rules.merge != CA_MERGE_NONE; }

/* Tasks that it takes to trace so many light paths. */
static inline uint32_t ca_light_block_count(uint32_t paths) { return (paths + CA_BLOCK_PATHS - 1) / CA_BLOCK_PATHS; }

/* Photons per m^2 around a vertex where the weights want to know, else 0. */
static inline float ca_bidirectional_density(const ca_bidirectional *b, ca_vec3 position)
{
    return b->pilot ? b->pilot_scale * ca_photon_grid_density(b->pilot, position) : 0.0f;
}

/* ---- The walks and joins --------------------------------------------------------------------------------------- */

/* Traces light path `path` of a chunk, the `number`-th of the whole render. */
void ca_light_walk(const ca_bidirectional *b, ca_light_chunk *chunk, uint32_t path, uint64_t number,
                   ca_light_block *block, ca_worker *worker);

/* A camera path at one of its vertices. */
typedef struct ca_camera_walk ca_camera_walk;
struct ca_camera_walk {
    const ca_bidirectional *b;
    ca_worker *worker;
    ca_bidirectional_scratch *scratch;
    ca_film_sample *sample;
    ca_stream stream;
    uint32_t x, y;         /* pixel */
    uint32_t vertex;       /* number of the last vertex, = segments so far */
    ca_vec3 origin, direction; /* of the next segment */
    ca_light_receiver receiver; /* the last vertex, as it asked for light */
    float t_min, t_max;
    ca_flight flight;
    ca_rgb throughput;
    float eta2;
    ca_vec3 wi;            /* from the last vertex to the one before */
    ca_surface surface;    /* of the last vertex */
    ca_bsdf bsdf;
    const ca_light_chunk *paired_chunk; /* of the light path to connect to; NULL: not in this round */
    uint32_t paired;       /* its number there */
    uint32_t connect_slot; /* where what connections bring is added: the chunk's number, or one behind the last */
    const struct ca_walk_hooks *hooks; /* NULL: gather */
    void *user;            /* of the hooks */
};

/* For algorithms that join paths in another order. */
typedef struct ca_walk_hooks {
    void (*at_vertex)(ca_camera_walk *walk); /* takes the place of gathering at a vertex that scatters smoothly */
    bool (*shows_light)(
        const ca_camera_walk *walk); /* does the light that the last vertex lies on count? NULL: yes */
} ca_walk_hooks;

/* Adds weight times `unweighted` to what the walk has gathered with a chunk; the gate for defects: false where it was
 * one, which is counted and left out. s and t as in technique.h. */
bool ca_camera_walk_add(ca_camera_walk *walk, uint32_t chunk, ca_technique technique, uint32_t s, uint32_t t,
                        ca_rgb unweighted, float weight);

/* The index-th camera path through a pixel, ready to be traced, and gathered light set to zero. The sample's
 * first-hit layers and filter weight are filled. */
void ca_camera_walk_start(ca_camera_walk *walk, const ca_bidirectional *b, uint32_t x, uint32_t y, uint32_t index,
                          ca_film_sample *sample, ca_worker *worker);
void ca_camera_walk_trace(ca_camera_walk *walk);
/* Next event at the last vertex; `weighted`: by all that the rules allow, else it counts in full. */
void ca_camera_walk_next_event(ca_camera_walk *walk, bool weighted);

/* Edges from the last vertex to all vertices of the paired light path but the one on the light. */
void ca_join_connect(ca_camera_walk *walk);
/* Photons of all chunks near the last vertex. The first chunk's query is started apart: what it asks of the memory
 * arrives while something else is done. */
void ca_join_merge_start(const ca_camera_walk *walk, ca_photon_query *query);
void ca_join_merge(ca_camera_walk *walk, ca_photon_query *first);

/* The weight of a merge of the last vertex with a photon, whose path has these densities; `value` of the BSDF for
 * it. */
float ca_join_merge_weight(const ca_camera_walk *walk, const ca_path_vertex *densities, const ca_merge_photon *photon,
                           const ca_bsdf_value *value);

/* Traces light paths [number, number + count) of the whole render into a chunk, and splats and sorts them as the
 * rules want. */
ca_status ca_light_chunk_prepare(ca_bidirectional *b, ca_light_chunk *chunk, uint64_t number, uint32_t count,
                                 const ca_parallel *parallel, ca_worker *workers, ca_error *error);
/* Traces light paths from `number` on into the first chunk until they take so many bytes: a multiple of a fixed step,
 * one step at least; *count of them. Not sorted. */
ca_status ca_light_chunk_fill(ca_bidirectional *b, uint64_t number, double bytes, uint32_t *count,
                              const ca_parallel *parallel, ca_worker *workers, ca_error *error);
/* Photons of light paths that no pass uses, in a grid of their own for queries of `radius`; the chunks' contents are
 * lost. */
ca_status ca_light_pilot(ca_bidirectional *b, float radius, ca_photon_grid **grid, uint32_t *paths,
                         const ca_parallel *parallel, ca_worker *workers, ca_error *error);
/* What light paths take in memory. */
static inline double ca_light_bytes(double paths, double vertices, double photons, double splats)
{
    return paths * sizeof(ca_light_path) + vertices * (sizeof(ca_path_vertex) + sizeof(ca_light_vertex)) +
           photons * (3 * sizeof(ca_photon) + sizeof(uint32_t) + sizeof(ca_merge_photon)) + splats * sizeof(ca_splat);
}

/* Sorts the blocks' photons into the chunk's grid, and what merges read into the same order. */
ca_status ca_light_chunk_sort(const ca_bidirectional *b, ca_light_chunk *chunk, const ca_parallel *parallel,
                              ca_error *error);
/* The blocks' photons of `paths` light paths into any grid. */
ca_status ca_light_blocks_sort(const ca_bidirectional *b, uint32_t paths, ca_photon_grid *grid, float radius,
                               const ca_parallel *parallel, ca_error *error);

/* One camera path; integrator.h. */
void ca_bidirectional_camera_path(const void *state, uint32_t x, uint32_t y, uint32_t index, uint32_t round,
                                  ca_film_sample *sample, ca_worker *worker);

/* ---- Pairs, where they are wanted ------------------------------------------------------------------------------ */

/* Refuses algorithms and settings of which the pixel's value is no mean over all pairs of independent paths. */
ca_status ca_pairs_check(const ca_bidirectional *b, const ca_integrator_type *type, ca_error *error);
/* Sums for each worker. */
ca_status ca_pairs_create(ca_bidirectional *b, ca_error *error);

/* integrator.h. */
void ca_pairs_begin_pixel(const void *state, ca_worker *worker);
void ca_pairs_end_pixel(const void *state, uint32_t x, uint32_t y, ca_worker *worker);
/* The walk found light alone, or by connecting to the paired light path, or merged with a photon of a chunk: what the
 * image gets for it before the filter's weight. */
void ca_pairs_add_alone(const ca_camera_walk *walk, ca_rgb unweighted, float weight);
void ca_pairs_add_connection(const ca_camera_walk *walk, ca_rgb unweighted, float weight);
void ca_pairs_add_merge(const ca_camera_walk *walk, uint32_t chunk, const ca_merge_photon *photon, ca_rgb unweighted,
                        float weight);

/* ---- The engine ------------------------------------------------------------------------------------------------ */

/* The median footprint of a pixel where camera paths first meet a smoothly scattering surface, m: the side of the
 * square that a pixel covers there. The scene's radius over 1000 where no camera path meets one. */
float ca_median_pixel_footprint(const ca_integrator_input *input);

/* `rules` say what the algorithm does; counts, radius and the parameters that `type` has are filled in. */
ca_status ca_bidirectional_create(const ca_integrator_type *type, const ca_mis_rules *rules,
                                  const ca_integrator_input *input, void **state, ca_error *error);
void ca_bidirectional_destroy(void *state);
uint32_t ca_bidirectional_rounds(const void *state);
void ca_bidirectional_set_radius(ca_bidirectional *b, float radius);
ca_status ca_bidirectional_begin_round(void *state, uint32_t pass, uint32_t round, const ca_parallel *parallel,
                                       ca_worker *workers, ca_error *error);
ca_rgb ca_bidirectional_splat(const void *state, uint32_t x, uint32_t y);

#endif
