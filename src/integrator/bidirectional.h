/* The bidirectional engine behind light, bdpt, ppm, bdpm, vcm and its kin. Internal to this folder.
 *
 * A pass traces N_F light paths and keeps their vertices; then every pixel traces N_B camera paths, which gather
 * light in up to five ways (path/technique.h):
 *
 *     technique    where           estimates                                          divided by
 *     hit          camera_walk.c   throughput_camera L_e                              1
 *     next event   next_event.c    throughput_camera f |cos| L_e / pdf                1
 *     connect      connect.c       throughput_camera f G f throughput_light           1   (with one light path)
 *     merge        merge.c         throughput_camera f throughput_light / (pi r^2)    N_F (with all of them)
 *     splat        splat.c         throughput_light f |cos| W_e / pdf                 N_F (onto any pixel)
 *
 * each times its weight (path/mis.h). An algorithm is a set of ca_mis_rules; algorithms.c has the table.
 *
 * Walks from both ends go through their stages in batches (walk.h): intersect, arrive, hit, next event, connect,
 * merge, splat, scatter. Whatever needs a ray asks first and is answered when the batch's rays are: what it brings is
 * added in the order in which it asked, so that a path's sums do not depend on the batch.
 *
 * Chunks: light paths are traced in chunks of a fixed number, and all that are in memory share one photon grid. A
 * camera path's light is summed for each chunk apart and the sums are added in order; the grid's order does not
 * depend on what else is in it (photon_grid.h). So it does not matter how many chunks are in memory at a time
 * (rounds, integrator.h).
 *
 * Pairs: where input.pairs wants them, all that the techniques bring is also summed for every pair of a light and a
 * camera path (pairs.c), which reads what the image gets and changes nothing of it. */
#ifndef CA_INTEGRATOR_BIDIRECTIONAL_H
#define CA_INTEGRATOR_BIDIRECTIONAL_H

#include "film/pair_splats.h"
#include "film/splats.h"
#include "integrator/integrator.h"
#include "integrator/technique_tally.h"
#include "integrator/walk.h"
#include "path/light_store.h"
#include "path/join.h"
#include "path/mis.h"
#include "photon/photon_density.h"

/* Light paths of pilots are numbered from here: no pass gets so far. */
#define CA_PILOT_NUMBER (UINT64_C(1) << 62)

enum { CA_BLOCK_PATHS = 512 }; /* light paths of one task */

enum {
    CA_WALKS = 256,                                       /* of a batch */
    CA_LIGHT_ENDS = 4 * CA_WALKS + CA_PATH_MAX_VERTICES, /* vertices of light paths that a batch may connect to */
};

typedef struct ca_bidirectional ca_bidirectional;
typedef struct ca_camera_walk ca_camera_walk;
typedef struct ca_light_walk ca_light_walk;
typedef struct ca_next_event ca_next_event;
typedef struct ca_connection ca_connection;

/* Vectors of three by components, for groups of eight that begin anywhere. */
typedef struct ca_end_column {
    float x[CA_LIGHT_ENDS + CA_LANES], y[CA_LIGHT_ENDS + CA_LANES], z[CA_LIGHT_ENDS + CA_LANES];
} ca_end_column;

/* The light paths that are connected to: the densities of all their vertices, and those that have records: matte ones
 * by components, the others as they are. */
typedef struct ca_light_ends {
    ca_path_vertex densities[CA_LIGHT_ENDS];
    double tail[CA_LIGHT_ENDS]; /* of the light path up to a vertex (path/mis.h) */
    ca_vertex vertices[CA_LIGHT_ENDS]; /* of records, not matte; room for one that is, too; likewise: */
    bool matte[CA_LIGHT_ENDS];
    uint32_t lit[CA_LIGHT_ENDS + CA_LANES]; /* all bits: matte, and light leaves its front; else 0 */
    ca_end_column position, ng, color; /* color: flux times f */
    float error[CA_LIGHT_ENDS + CA_LANES], side[CA_LIGHT_ENDS + CA_LANES], cos_in[CA_LIGHT_ENDS + CA_LANES];
} ca_light_ends;

/* What a worker needs for a batch of paths. */
typedef struct ca_bidirectional_scratch {
    uint32_t row;                 /* vertices of a path that there is room for */
    ca_camera_walk *camera_walks; /* owned; [CA_WALKS] */
    ca_light_walk *light_walks;   /* owned; likewise */
    ca_path_vertex *densities;    /* owned; [CA_WALKS][row] */
    ca_light_vertex *vertices;    /* owned; of light paths, likewise */
    ca_surface_point *points;     /* owned; of camera paths, for the observer, likewise; NULL where there is none */
    ca_path_vertex *merged;       /* owned; of the light path that is merged with; [CA_PATH_MAX_VERTICES] */
    ca_light_vertex *seen;        /* owned; of a light path, for the observer, likewise; NULL where there is none */
    ca_splat_list splats;         /* of a batch */
    uint32_t *splat_next;         /* owned; number of the next one of the same walk, or CA_NONE */
    size_t splat_next_capacity;
    ca_light_ends *light_ends;    /* owned */
    ca_walk_rays *rays;           /* owned */
    ca_next_event *next_events;   /* owned; [CA_RAY_BATCH]; likewise: */
    ca_connection *connections;
    ca_rgb *chunk_light; /* owned; [CA_WALKS][resident + 1]: gathered with each chunk in memory; the last as
                            ca_camera_walk.connect_slot says. Zero where not in use: */
    uint64_t *chunk_used; /* owned; a bit for each; [CA_WALKS][ca_chunk_words] */
    ca_pair_sums *pairs;  /* owned: of the pixel; NULL: not wanted */
    ca_pair_sums **other_pairs; /* owned; [other_count]: with the weights of other numbers of paths ... */
    float *other_weights;       /* owned; likewise: of the path that was weighted last */
    float *splat_scales;        /* owned; of the batch's splats, as in ca_light_block */
    size_t splat_scale_capacity;
    bool pairing;         /* between begin_pixel and end_pixel */
} ca_bidirectional_scratch;

ca_status ca_bidirectional_scratch_create(ca_bidirectional_scratch *scratch, const ca_bidirectional *b,
                                          ca_error *error);
/* Room for what is gathered, once it is known how many chunks are in memory. */
ca_status ca_bidirectional_scratch_add_chunks(ca_bidirectional_scratch *scratch, const ca_bidirectional *b,
                                              ca_error *error);
void ca_bidirectional_scratch_destroy(ca_bidirectional_scratch *scratch);

/* What else a block of light paths has. */
typedef struct ca_light_block {
    ca_splat_list splats;
    float *scales; /* owned; [splats.count][other_count]: weights of other numbers of paths over the splat's own */
    size_t scale_capacity;
    uint32_t photons; /* how many */
    uint64_t bytes;   /* of what is kept of the paths */
} ca_light_block;

_Static_assert(CA_PATH_MAX_VERTICES < 1 << 13 && CA_CHUNK_PATHS <= 1 << 18, "they fit the records of splats");

/* How paths are weighted where an iteration has other numbers of them. */
typedef struct ca_other_weights {
    uint32_t light_paths, camera_paths; /* N_F, N_B */
    ca_mis_rules rules;
    ca_factor_map *factors; /* owned; NULL where the rules have none, or not made yet */
    ca_pair_splats splats;
} ca_other_weights;

struct ca_bidirectional {
    ca_integrator_input input;
    uint32_t max_depth, rr_depth;
    bool hide_emitters;
    bool paper;         /* the program of paper 003 (paper.c) */
    bool weighs_merges; /* else their weights are 1 and nobody looks at them */
    ca_mis_rules rules; /* of the pass */
    uint32_t light_paths, camera_paths; /* N_F; N_B, the largest where input.camera_paths is a map */
    float radius0, alpha;      /* merge radius of the first pass; how fast it shrinks */
    float radius;              /* of this pass */

    uint32_t chunk_count, resident; /* chunks of a pass, and how many are in memory at a time */
    uint32_t first_chunk, chunks_now; /* of this round */
    uint64_t first_number;            /* of the pass' light paths in the whole render */
    uint32_t paths_now;             /* light paths in memory: those of these chunks, one chunk after the other */
    ca_light_store store;
    uint64_t photons_now;           /* how many photons they have */
    uint64_t bytes_now;             /* and what is kept of them */
    ca_photon_grid *grid;           /* of these, which answers with vertex numbers; NULL where nothing is merged */
    uint64_t pairing_shift;         /* camera path i connects to light path (i + shift) mod N_F */
    ca_light_block *blocks;         /* owned; of one chunk */
    ca_splat_buffer splats;
    ca_pair_splats pair_splats;     /* empty where pairs or splats are not wanted */
    ca_other_weights *others;       /* owned; [others_created]: pairs are wanted with their weights, too */
    uint32_t other_count, others_created; /* of this pass: all of them, or none */
    ca_sampler pilot_sampler;       /* the render's as it was first, whichever pass or replicate asks for a pilot */
    ca_photon_density *pilot;       /* owned; of photons, where the reuse rule asks for it; NULL: not made yet, too */
    float pilot_scale;              /* N_F over the number of its light paths */
    const ca_emission_guide *guide; /* of light paths; NULL: none */
    ca_emission_guide *own_guide;   /* owned; that, where the input has none */
    ca_factor_map *factors;         /* owned; NULL where the rules have none, or not made yet */
    ca_technique_tally *tally;      /* NULL: nobody wants it */
    ca_bidirectional_scratch *scratch; /* owned; [input.workers] */
};

/* Of the pass at work. */
static inline bool ca_pairs_are_wanted(const ca_bidirectional *b) { return b->input.pairs && !b->input.pairs->idle; }

static inline bool ca_bidirectional_merges(const ca_bidirectional *b) { return b->rules.merge != CA_MERGE_NONE; }

/* Are light paths joined with camera paths, so that they must be kept? */
static inline bool ca_bidirectional_keeps(const ca_bidirectional *b)
{
    return b->rules.connect || ca_bidirectional_merges(b);
}

/* Tasks that it takes to trace so many light paths. */
static inline uint32_t ca_light_block_count(uint32_t paths) { return (paths + CA_BLOCK_PATHS - 1) / CA_BLOCK_PATHS; }

/* Words of a walk in ca_bidirectional_scratch.chunk_used. */
static inline uint32_t ca_chunk_words(const ca_bidirectional *b) { return b->resident / 64 + 1; }

/* Of the paths through a place on the film, in pixels. */
static inline const ca_technique_factors *ca_bidirectional_factors(const ca_bidirectional *b, ca_vec2 film)
{
    return b->factors ? ca_factor_map_at(b->factors, film) : NULL;
}

/* N_B of a pixel of the full film, within the crop. */
static inline uint32_t ca_bidirectional_camera_paths_of(const ca_bidirectional *b, uint32_t x, uint32_t y)
{
    const uint32_t *crop = b->input.crop, *map = b->input.camera_paths;
    return map ? map[(size_t)(y - crop[1]) * (crop[2] - crop[0]) + (x - crop[0])] : b->camera_paths;
}

/* How many splats count for a camera path through a place on the film, in pixels, over the rules' number. */
static inline float ca_bidirectional_splat_scale(const ca_bidirectional *b, ca_vec2 film)
{
    const uint32_t *crop = b->input.crop;
    if (!b->input.camera_paths) return 1.0f;
    const float x = ca_clamp(film.x, (float)crop[0], (float)crop[2] - 1.0f);
    const float y = ca_clamp(film.y, (float)crop[1], (float)crop[3] - 1.0f);
    return (float)b->camera_paths / (float)ca_bidirectional_camera_paths_of(b, (uint32_t)x, (uint32_t)y);
}

/* Weighs it with other numbers of paths, into scratch->other_weights. */
void ca_pairs_weigh_others(const ca_bidirectional *b, ca_bidirectional_scratch *scratch, ca_technique technique,
                           const ca_mis_path *path);

/* The weight of a full path; its points for the observer as in path_observer.h. */
static inline float ca_bidirectional_weight(const ca_bidirectional *b, ca_bidirectional_scratch *scratch,
                                            ca_technique technique, const ca_mis_path *path,
                                            const ca_surface_point *camera, const ca_light_vertex *light)
{
    if (b->other_count > 0) ca_pairs_weigh_others(b, scratch, technique, path);
    return ca_observed_weight(b->input.observer, &b->rules, technique, path, camera, light);
}

/* ---- Emission -------------------------------------------------------------------------------------------------- */

/* How a light path begins. */
typedef struct ca_light_start {
    uint32_t light;
    float choice; /* the light's probability */
    ca_light_emission emission;
} ca_light_start;

/* Chooses a light and lets it emit; false: nothing is emitted. */
bool ca_light_start_path(const ca_bidirectional *b, const ca_stream *stream, ca_light_start *start);

/* ---- The walks and joins --------------------------------------------------------------------------------------- */

/* Traces light paths [first, first + count) of those in memory, the `number`-th and those after it of the whole
 * render.
 */
void ca_light_walks(const ca_bidirectional *b, ca_light_store *store, uint32_t first, uint32_t count, uint64_t number,
                    ca_light_block *block, ca_worker *worker);

/* A camera path at one of its vertices. */
struct ca_camera_walk {
    ca_walk walk;
    const ca_bidirectional *b;
    ca_worker *worker;
    ca_bidirectional_scratch *scratch;
    ca_camera_path *path;
    const ca_technique_factors *factors; /* of its place on the film */
    uint32_t light_class; /* of the light that was hit or asked last, for the tally */
    ca_surface_point *points; /* where the path is observed; else NULL */
    ca_rgb *light;            /* gathered with each chunk; a bit of light_used for each */
    uint64_t *light_used;
    bool has_paired;       /* is the light path to connect to in memory? */
    uint32_t paired;       /* its number there */
    uint64_t paired_number; /* and in the pass, wherever it is */
    uint32_t connect_slot; /* where what connections bring is added: the chunk's number, or one behind the last */
    uint32_t light_first;  /* of its vertices and records in scratch->light_ends */
    bool light_ready;      /* are they made? */
    const struct ca_walk_hooks *hooks; /* NULL: gather */
    void *user;            /* of the hooks */
};

/* For algorithms that join paths in another order. */
typedef struct ca_walk_hooks {
    /* Takes the place of gathering, at the last vertices of all walks of a batch that are still on their way. */
    void (*at_vertices)(ca_camera_walk *const *walks, uint32_t count);
    bool (*shows_light)(
        const ca_camera_walk *walk); /* does the light that the last vertex lies on count? NULL: yes */
} ca_walk_hooks;

/* Adds weight times `unweighted` to what the walk has gathered with a chunk; the gate for defects: false where it was
 * one, which is counted and left out. s and t as in technique.h. */
bool ca_camera_walk_add(ca_camera_walk *walk, uint32_t chunk, ca_technique technique, uint32_t s, uint32_t t,
                        ca_rgb unweighted, float weight);

/* A camera path, ready to be traced, in a slot of the worker's scratch, and gathered light set to zero. The sample's
 * filter weight is filled; tracing fills its first-hit layers. */
void ca_camera_walk_start(ca_camera_walk *walk, const ca_bidirectional *b, ca_camera_path *path, uint32_t slot,
                          ca_worker *worker);
/* Traces walks of one worker, at most CA_WALKS. */
void ca_camera_walks_trace(ca_camera_walk *const *walks, uint32_t count);

static inline ca_path_vertex *ca_camera_walk_vertex(const ca_camera_walk *walk)
{
    return &walk->walk.densities[walk->walk.vertex];
}

/* ---- Next event ------------------------------------------------------------------------------------------------ */

/* A light that was asked, until the ray is answered. */
struct ca_next_event {
    ca_camera_walk *walk;
    const ca_light *light;
    float choice, cos_out;
    ca_light_direct direct;
    ca_bsdf_value value;
    ca_rgb unweighted;
};

/* At the last vertices of the walks that scatter smoothly; `weighted`: by all that the rules allow, else each counts
 * in full. */
void ca_next_events(ca_camera_walk *const *walks, uint32_t count, bool weighted);

/* ---- The program of paper 003 ---------------------------------------------------------------------------------- */

/* What bdpt does with `paper` (paper.c). Fails where the scene has what the paper's program does not: other surfaces
 * than Lambertian ones, other lights than areas, a camera with a lens. */
ca_status ca_paper_check(const ca_integrator_input *input, ca_error *error);

/* Uniform over the hemisphere: the densities of a pair of directions for which f is not zero ... */
ca_bsdf_value ca_paper_value(ca_bsdf_value value);
/* ... and a direction. false: no light goes there. */
bool ca_paper_sample(const ca_vertex *vertex, ca_vec2 u, ca_from from, ca_bsdf_sample *sample);
/* Turns the emission's direction likewise. */
bool ca_paper_emission(ca_vec2 u, ca_light_emission *emission);
/* The density of either. */
#define CA_PAPER_PDF ((ca_pdf_solid_angle){CA_INV_TWO_PI})

/* Next event from the last vertex to the first one of the paired light path; false: there is nothing to ask. */
bool ca_paper_direct(const ca_camera_walk *walk, uint32_t *light, float *choice, ca_light_direct *direct);

/* ---- Connect --------------------------------------------------------------------------------------------------- */

/* How a vertex samples the direction that leaves it, and the one that arrived. */
typedef struct ca_pdf_pair {
    ca_pdf_solid_angle pdf, pdf_reverse;
} ca_pdf_pair;

/* An edge between a camera path's last vertex and a light vertex, until the ray is answered. */
struct ca_connection {
    ca_camera_walk *walk;
    const ca_light_record *vertex;
    float distance, cos_camera, cos_light, cos_light_in; /* cos_light_in: of the light path's own segment */
    ca_pdf_pair camera, light;
    ca_rgb unweighted;
};

/* Edges from the last vertices of the walks to all vertices of their paired light paths but the one on the light. */
void ca_connect_all(ca_camera_walk *const *walks, uint32_t count);

/* ---- Merge ----------------------------------------------------------------------------------------------------- */

/* Photons near the last vertices of the walks that scatter smoothly. */
void ca_merge_all(ca_camera_walk *const *walks, uint32_t count);

/* The weight of a merge of the last vertex with a photon, whose path is in `store`; `value` of the BSDF for it. */
float ca_merge_weight(const ca_camera_walk *walk, const ca_light_store *store, const ca_light_record *photon,
                      const ca_bsdf_value *value);

/* ---- Light paths ----------------------------------------------------------------------------------------------- */

/* A light path at one of its vertices. */
struct ca_light_walk {
    ca_walk walk;
    uint32_t path;             /* its number in memory */
    const ca_light *light;
    ca_light_vertex *vertices; /* v[0] first */
    uint32_t first_splat, last_splat; /* in scratch->splats, or CA_NONE */
};

/* Connects the last vertices of the walks that scatter smoothly to points of the lens; false when out of memory. The
 * splats are kept in scratch->splats until the batch has ended. */
bool ca_splat_all(const ca_bidirectional *b, ca_light_walk *const *walks, uint32_t count, ca_worker *worker);

/* Traces light paths [number, number + count) of the whole render into the memory, and splats and sorts them as the
 * rules want. */
ca_status ca_light_paths_prepare(ca_bidirectional *b, uint64_t number, uint32_t count, const ca_parallel *parallel,
                                 ca_worker *workers, ca_error *error);
/* Traces light paths from `number` on until they take so many bytes or are a chunk: a multiple of a fixed step, one
 * step at least; *count of them. Not sorted. */
ca_status ca_light_chunk_fill(ca_bidirectional *b, uint64_t number, double bytes, uint32_t *count,
                              const ca_parallel *parallel, ca_worker *workers, ca_error *error);
/* Photons of so many light paths, at most a chunk's, that no pass uses, in a grid of their own for queries of
 * `radius`; the light paths in memory are lost. */
ca_status ca_light_pilot(ca_bidirectional *b, uint32_t paths, float radius, ca_photon_grid **grid,
                         const ca_parallel *parallel, ca_worker *workers, ca_error *error);
/* What light paths take in memory, of which `kept` bytes are kept; a photon has up to two buckets. */
static inline double ca_light_bytes(double paths, double kept, double photons)
{
    return paths * sizeof(ca_light_path) + kept + photons * (sizeof(ca_photon) + 2 * sizeof(uint32_t));
}

/* Asks how crowded with photons it is around the walks' last vertices, where the weights want to know. */
void ca_bidirectional_densities(const ca_bidirectional *b, ca_walk *const *walks, uint32_t count);

/* Sorts the photons of the light paths in memory into a grid. */
ca_status ca_light_photons_sort(const ca_bidirectional *b, ca_photon_grid *grid, float radius,
                                const ca_parallel *parallel, ca_error *error);

/* integrator.h. */
void ca_bidirectional_camera_paths(const void *state, ca_camera_path *paths, uint32_t count, uint32_t round,
                                   ca_worker *worker);

/* ---- Pairs, where they are wanted ------------------------------------------------------------------------------ */

/* Refuses algorithms and settings of which the pixel's value is no mean over all pairs of independent paths. */
ca_status ca_pairs_check(const ca_bidirectional *b, const ca_integrator_type *type, ca_error *error);
/* Sums for each worker. */
ca_status ca_pairs_create(ca_bidirectional *b, ca_error *error);
void ca_pairs_destroy(ca_bidirectional *b);
/* The merge area of a pass, for the weights of other numbers; and what those need of pilots, once. */
void ca_pairs_set_area(ca_bidirectional *b, float area);
ca_status ca_pairs_make_pilots(ca_bidirectional *b, const ca_parallel *parallel, ca_worker *workers, ca_error *error);
/* Before anything else of a pass: other numbers are weighted for where its pairs are wanted; splats of the pass
 * before are forgotten. */
void ca_pairs_begin_pass(ca_bidirectional *b);
/* Splats of a pass: those of the first `lists` blocks of light paths, which count from `first_light_path`, are added;
 * they are sorted. */
ca_status ca_pairs_add_splats(ca_bidirectional *b, const ca_splat_list *lists, uint32_t list_count,
                              uint32_t first_light_path, ca_error *error);
ca_status ca_pairs_sort_splats(ca_bidirectional *b, ca_error *error);
/* What the splat that was weighted last, which the image has with this weight, is to be multiplied by for other
 * weights: it is number `splat` of the batch; false when out of memory. Then that it is the block's next one. */
bool ca_pairs_scale_splat(const ca_bidirectional *b, ca_bidirectional_scratch *scratch, uint32_t splat, float weight);
bool ca_pairs_keep_scales(const ca_bidirectional *b, const ca_bidirectional_scratch *scratch, uint32_t splat,
                          ca_light_block *block);

/* integrator.h. */
void ca_pairs_begin_pixel(const void *state, ca_worker *worker);
void ca_pairs_end_pixel(const void *state, uint32_t x, uint32_t y, ca_worker *worker);
/* Another camera path of the pixel begins. */
void ca_pairs_next_path(const ca_bidirectional *b, ca_bidirectional_scratch *scratch);
/* The walk found light alone, or by connecting to the paired light path, or merged with a photon of a chunk: what the
 * image gets for it before the filter's weight. */
void ca_pairs_add_alone(const ca_camera_walk *walk, ca_rgb unweighted, float weight);
void ca_pairs_add_connection(const ca_camera_walk *walk, ca_rgb unweighted, float weight);
void ca_pairs_add_merge(const ca_camera_walk *walk, uint32_t chunk, const ca_light_record *photon, ca_rgb unweighted,
                        float weight);

/* ---- The engine ------------------------------------------------------------------------------------------------ */

/* What the weights need to know, made once: in the first pass that there is. */
ca_status ca_bidirectional_make_pilots(ca_bidirectional *b, const ca_parallel *parallel, ca_worker *workers,
                                       ca_error *error);

/* The factors of variance-aware weights, measured by an engine of its own: factor_pilot.c. */
ca_status ca_factor_pilot(const ca_bidirectional *b, const ca_parallel *parallel, ca_worker *workers,
                          ca_factor_map **map, ca_error *error);
/* Light paths of one of its iterations, for so many of a pass. */
uint32_t ca_factor_pilot_paths(uint32_t light_paths);

/* The median footprint of a pixel where camera paths first meet a smoothly scattering surface, m: the side of the
 * square that a pixel covers there. The scene's radius over 1000 where no camera path meets one. */
float ca_median_pixel_footprint(const ca_integrator_input *input);

/* What an integrator's parameters say of the rules, but for counts and areas; its light paths of a pass, N_F; and the
 * merge radius of the first pass, m. */
void ca_rules_read(ca_mis_rules *rules, const ca_integrator_type *type, const ca_integrator_input *input);
/* How often weights expect splats and photons: for so many light paths in a pass and camera paths a pixel. */
void ca_rules_set_counts(ca_mis_rules *rules, const ca_camera *camera, double light_paths, double camera_paths);
uint32_t ca_light_paths_of_pass(const ca_integrator_type *type, const ca_integrator_input *input);
ca_status ca_first_radius(const ca_integrator_type *type, const ca_integrator_input *input, float *radius,
                          ca_error *error);

/* `rules` say what the algorithm does; counts, radius and the parameters that `type` has are filled in. */
ca_status ca_bidirectional_create(const ca_integrator_type *type, const ca_mis_rules *rules,
                                  const ca_integrator_input *input, void **state, ca_error *error);
void ca_bidirectional_destroy(void *state);
uint32_t ca_bidirectional_rounds(const void *state);
ca_status ca_bidirectional_prepare(void *state, const ca_parallel *parallel, ca_worker *workers, ca_error *error);
void ca_bidirectional_set_radius(ca_bidirectional *b, float radius);
ca_status ca_bidirectional_begin_round(void *state, uint32_t pass, uint32_t round, const ca_parallel *parallel,
                                       ca_worker *workers, ca_error *error);
ca_rgb ca_bidirectional_splat(const void *state, uint32_t x, uint32_t y);

#endif
