/* Integrators: from a scene and a pixel to a radiance.
 *
 * An integrator is a row of a table (ca_integrator_at): its name, its parameters with their defaults, its abilities,
 * and functions. Other folders ask what a row can do (ca_integrator_has), never what it is called.
 * It knows nothing of time, stopping or files (render/ does): it is given a pixel and an index of a camera path and
 * answers with one film sample, a pure function of (scene, settings, pixel, index). One that has light paths traces
 * those of a pass before the camera paths of that pass.
 *
 * A pass may take several rounds where the light paths of a pass do not fit the memory: each round has some of them,
 * and the same camera paths are made again for each. The sum does not depend on the number of rounds, to the bit. */
#ifndef CA_INTEGRATOR_INTEGRATOR_H
#define CA_INTEGRATOR_INTEGRATOR_H

#include "base/parallel.h"
#include "film/block_film.h"
#include "film/film.h"
#include "film/pair_film.h"
#include "film/technique_images.h"
#include "light/emission_guide.h"
#include "path/path_observer.h"
#include "path/technique.h"
#include "photon/radius_choice.h"
#include "scene/scene.h"

/* What one worker has done; sums over workers are the statistics. */
typedef struct ca_counters {
    uint64_t light_paths, camera_paths, rays, shadow_rays;
    uint64_t photons, photons_tested, merges;
    uint64_t non_finite[CA_TECHNIQUE_COUNT];
} ca_counters;

/* A thread as an integrator sees it: a number that selects scratch memory, and counters of its own. */
typedef struct ca_worker {
    _Alignas(128) ca_counters counters; /* of different workers: never in one cache line */
    uint32_t index;
} ca_worker;

/* One camera path that is asked for, and what it took. */
typedef struct ca_camera_path {
    uint32_t x, y;     /* pixel of the full film */
    uint32_t index;    /* number of the path in its pixel */
    uint32_t segments; /* rays of both kinds; the integrator adds to it, as to the next: */
    uint32_t merges;
    /* Luminance of lights that the path saw at once or by Dirac events alone, as far as it is in the sample's
     * radiance: added where the input's tells_shown is set. */
    float shown;
    ca_film_sample *sample;
} ca_camera_path;

/* A parameter that an integrator has, with its default. */
typedef struct ca_parameter_spec {
    const char *name;
    enum { CA_SPEC_INTEGER, CA_SPEC_REAL, CA_SPEC_BOOLEAN, CA_SPEC_CHOICE } kind;
    double minimum;      /* integers and reals */
    double maximum;      /* reals; 0: none */
    double smallest;     /* reals: of those above 0 */
    double number;       /* default of numbers and booleans; of a choice the index in `choices` */
    const char *choices; /* "balance|power" */
} ca_parameter_spec;

/* A merge radius, m; 0: the default. Its square, the area of merges and what is divided by it are normal floats. */
#define CA_RADIUS_SPEC                                                                                               \
    {                                                                                                                \
        "radius", CA_SPEC_REAL, .minimum = 0, .smallest = 1e-15, .maximum = 1e15, .number = 0                        \
    }

/* The default of alpha. Where noise falls as n^-(1-alpha)/2 and bias as n^-alpha they meet (docs/decisions/019).
 * Sequences have another one: qmcppm.c. */
#define CA_RANDOM_ALPHA (1.0 / 3.0)

enum { CA_MAX_PARAMETERS = 24 };

/* What the light paths of a pass take at most where no memory is given, of which a chunk is always held; more come in
 * rounds. */
#define CA_LIGHT_BYTES_BY_DEFAULT 0x1p31

/* What an integrator works with. `values[i]` belongs to the i-th parameter of its table row. */
typedef struct ca_integrator_input {
    const ca_scene *scene;
    const ca_camera *camera;
    const ca_sampler *sampler;
    const ca_filter *filter;
    uint32_t crop[4];     /* the rendered part of the film */
    uint32_t workers;
    const int *stop;      /* base/stop.h: what is made after it was asked for is no use; NULL: nobody can ask */
    double memory_bytes;  /* for light paths, and camera paths where they are kept; INFINITY: no limit; 0: what the
                             integrator takes by itself, which is at most CA_LIGHT_BYTES_BY_DEFAULT for light paths
                             that may come in rounds */
    ca_technique_images *technique_images; /* NULL: none are made */
    /* What pairs of light and camera paths contribute, of pixels between begin_pixel and end_pixel; NULL: not
     * recorded. Its crop and N_F are those of this input; its field `incomplete` is set where memory ran out. Filled
     * by integrators with begin_pixel. */
    ca_pair_film *pairs;
    bool tells_shown; /* do camera paths tell what they see of lights? `qmcppm` never does */
    bool keeps_pairs; /* light paths are laid out as for pairs, whether or not there are any */
    const ca_path_observer *observer; /* of weights; NULL: none. `qmcppm` has none */
    const ca_emission_guide *guide; /* of light paths; NULL: as the integrator's parameters say */
    uint64_t first_light_path; /* light paths of the render are numbered from here: others were traced before */
    /* N_B(p) of the crop's pixels, row by row, none above the parameter camera_paths; NULL: that for all. For weights
     * that contain N_B; borrowed. Beyond the crop's border, where filters reach, that of the nearest pixel. */
    const uint32_t *camera_paths;
    double values[CA_MAX_PARAMETERS];
} ca_integrator_input;

/* What others must know of an integrator, as bits. Its functions say whether it renders by blocks (begin_block), its
 * parameters whether it has a merge radius and numbers of paths. */
typedef enum ca_ability {
    /* The variance of a pixel in an iteration of N_F light paths and N_B camera paths is
     * pair / (N_F N_B) + camera / N_B + light / N_F, whatever the two numbers are (Ershov et al. 2020): noise is
     * measured and predicted, and numbers are chosen (rays). Needs begin_pixel. */
    CA_ABILITY_PAIR_LAW = 1 << 0,
    /* Camera paths connect to light paths by weights that depend on N_F and N_B. Noise is measured, with a fourth
     * term of the connections (film/pair_sums.h), also with the weights of other numbers, and N_F and one N_B for all
     * pixels are chosen. Needs begin_pixel. */
    CA_ABILITY_CONNECTION_NOISE = 1 << 1,
    /* The method has one camera path per pixel and iteration; where numbers are chosen, only N_F is. */
    CA_ABILITY_ONE_CAMERA_PATH = 1 << 2,
    /* Samples per pixel are light paths, of which there are N_F in a pass; camera paths only see emitters. */
    CA_ABILITY_LIGHT_SAMPLES = 1 << 3,
    /* It is no method of its own: a render chooses one of the others for it (render/auto_method.h). Cannot be
     * created. */
    CA_ABILITY_CHOOSES = 1 << 4,
} ca_ability;

/* Methods whose numbers of light and camera paths can be chosen by a law of noise (rays). */
enum { CA_RAYS_ABILITIES = CA_ABILITY_PAIR_LAW | CA_ABILITY_CONNECTION_NOISE };

typedef struct ca_integrator_type {
    const char *name;
    const ca_parameter_spec *parameters; /* ended by a NULL name */
    unsigned abilities;                  /* ca_ability */
    const ca_mis_rules *rules;           /* its techniques, before its parameters; NULL: not told (qmcppm) */
    ca_sampler_kind
        sampler; /* that it was made for: used unless one is chosen for it. CA_SAMPLER_INDEPENDENT: any will do */
    /* Makes the state from the input; what that points to outlives it. Refuses what the integrator cannot do
     * (CA_ERROR_UNSUPPORTED, with the reason). */
    ca_status (*create)(const ca_integrator_input *input, void **state, ca_error *error);
    void (*destroy)(void *state);
    /* Rounds of every pass; NULL: one. */
    uint32_t (*rounds)(const void *state);
    /* Makes what is made once for all passes, which the first one would make: so that no pass takes longer than
     * others. NULL: nothing is. */
    ca_status (*prepare)(void *state, const ca_parallel *parallel, ca_worker *workers, ca_error *error);
    /* Traces the light paths of a pass' round; workers[i] belongs to worker i. NULL: there are none. */
    ca_status (*begin_round)(void *state, uint32_t pass, uint32_t round, const ca_parallel *parallel,
                             ca_worker *workers, ca_error *error);
    /* Adds to the samples what the round has for these camera paths. Samples start zeroed in round 0. A path's sample
     * does not depend on which others are asked for with it. */
    void (*camera_paths)(const void *state, ca_camera_path *paths, uint32_t count, uint32_t round, ca_worker *worker);
    /* Around the camera paths of a pixel in a pass of one round, where pairs are recorded: all of them between the
     * two, one after the other on one worker. NULL: pairs are refused. */
    void (*begin_pixel)(const void *state, ca_worker *worker);
    void (*end_pixel)(const void *state, uint32_t x, uint32_t y, ca_worker *worker);
    /* What the pass' light paths have splatted to a pixel, after its last round. NULL: nothing ever. */
    ca_rgb (*splat)(const void *state, uint32_t x, uint32_t y);

    /* One that renders by blocks of pairs (film/block_film.h) has these instead of the four above. Makes ready what
     * block number `block` needs; what the block before it left behind is used again where it serves. Any number may
     * follow any. */
    ca_status (*begin_block)(void *state, uint64_t block, const ca_parallel *parallel, ca_worker *workers,
                             ca_error *error);
    /* What the block has for `count` pixels of the full film, (x, y) and those to its right; samples start zeroed. A
     * pixel's does not depend on which others are asked for with it. */
    void (*block_pixels)(const void *state, uint32_t x, uint32_t y, uint32_t count, ca_block_sample *samples,
                         ca_worker *worker);
    /* How many blocks, from the first, give every pixel so many camera paths, each with all light paths so far;
     * UINT64_MAX as long as that is not known. */
    uint64_t (*blocks_needed)(const void *state, uint32_t samples_per_pixel);
} ca_integrator_type;

/* The rows one after the other; NULL behind the last. */
const ca_integrator_type *ca_integrator_at(size_t index);

/* Has it one of the abilities? NULL has none. */
static inline bool ca_integrator_has(const ca_integrator_type *type, unsigned abilities)
{
    return type && (type->abilities & abilities) != 0;
}

enum { CA_MAX_INTEGRATORS = 32, CA_INTEGRATOR_NAMES_SIZE = 512 /* holds all names */ };

/* Names of the rows that have one of the abilities, in the order of the table: "bdpt, ppm or vcm", where " or " is
 * `last`. */
void ca_integrator_names(unsigned abilities, const char *last, char text[CA_INTEGRATOR_NAMES_SIZE]);

/* The row of that name. For an unknown one the error names all there are: CA_ERROR_SCENE at `where`, or, where that
 * is NULL because the name came with the settings, CA_ERROR_ARGUMENT. Parameters likewise. */
ca_status ca_integrator_find(const char *name, const ca_location *where, const ca_integrator_type **type,
                             ca_error *error);

/* The row named by "name" or "name:parameter=value,..."; NULL where there is none, or no text. */
const ca_integrator_type *ca_integrator_of(const char *text);

/* type->create; the integrator is NULL where that fails. */
ca_status ca_integrator_create(const ca_integrator_type *type, const ca_integrator_input *input, void **integrator,
                               ca_error *error);

/* Fills input->values: the type's defaults, over them the scene's parameters, over them `overrides`
 * ("max_depth=5,rr_depth=3", may be NULL). The scene's parameters must all be known to the type, unless the
 * integrator was chosen on the command line (`replaced`): then those with names it knows carry over. */
ca_status ca_integrator_configure(const ca_integrator_type *type, const ca_integrator_desc *desc, bool replaced,
                                  const char *overrides, ca_integrator_input *input, ca_error *error);

/* The value of a parameter, or `otherwise` where the type has none of that name. */
double ca_integrator_value(const ca_integrator_type *type, const ca_integrator_input *input, const char *name,
                           double otherwise);

/* Sets the merge radius to the one that the integrator will use, where it has one and none is given: all who look at
 * the input then see the same number, and the picture's record tells it. A function of scene, settings and seed over
 * the whole film, never of the crop, of threads or of memory. Cost: a few thousand rays for radius_pixels; for the
 * default a pilot (radius_pilot.c), which takes some tenths of a second. Errors: CA_ERROR_MEMORY. */
ca_status ca_integrator_resolve(const ca_integrator_type *type, ca_integrator_input *input, ca_error *error);
/* The merge radius of least error, m, found by a pilot, and how merges blur (NULL: nobody asks): radius_pilot.c.
 * `effort`: light paths of a pass that the pilot has photons for; 0: those of the render's. A thousand of them take
 * about a hundredth of a second. */
ca_status ca_radius_pilot(const ca_integrator_type *type, const ca_integrator_input *input, double effort,
                          float *radius, ca_radius_blur *blur, ca_error *error);

/* The guide of light paths that the integrator makes for itself where its parameter `guide` is set (guide_pilot.c);
 * *guide: owned by the caller; NULL: none is wanted, or there is nothing to guide. A function of scene, settings,
 * seed and crop, never of threads, memory or the method's numbers of paths. Cost: some 10,000 paths of one thread.
 * Errors: CA_ERROR_MEMORY. */
ca_status ca_integrator_make_guide(const ca_integrator_type *type, const ca_integrator_input *input,
                                   ca_emission_guide **guide, ca_error *error);

/* Rules with which ca_mis_total counts the samples that the integrator makes of a path in its first pass, per camera
 * path; of a merge it counts photons, whatever the integrator's own reuse rule. false: it does not tell. The input is
 * resolved (ca_integrator_resolve). */
bool ca_integrator_counts(const ca_integrator_type *type, const ca_integrator_input *input, ca_mis_rules *rules);

bool ca_integrator_has_parameter(const ca_integrator_type *type, const char *name);

/* Sets one parameter by name. */
ca_status ca_integrator_set(const ca_integrator_type *type, const ca_parameter *parameter, ca_integrator_input *input,
                            ca_error *error);
/* The same of one that is a number. */
ca_status ca_integrator_set_number(const ca_integrator_type *type, const char *name, double value,
                                   ca_integrator_input *input, ca_error *error);

/* Light paths start where this guide says; NULL: as usual, without looking for one. */
ca_status ca_integrator_set_guide(const ca_integrator_type *type, const ca_emission_guide *guide,
                                  ca_integrator_input *input, ca_error *error);

/* Gives a pilot what says of `type` which light there is: whether emitters are hidden, and the limits of paths as far
 * as they are worth its time: at most 64 segments, and the roulette from 16 on, at the latest. */
ca_status ca_integrator_limit_pilot(const ca_integrator_type *pilot, const ca_integrator_type *type,
                                    const ca_integrator_input *from, ca_integrator_input *input, ca_error *error);

/* Writes a parameter's value as it is recorded in images. */
void ca_parameter_describe(const ca_parameter_spec *spec, double value, char *text, size_t size);

/* Writes "name:parameter=value,..." with all values, as recorded in images. */
void ca_integrator_describe(const ca_integrator_type *type, const ca_integrator_input *input, char *text,
                            size_t size);

/* The rows of algorithms.c, in the order of the table, and how many they are. */
extern const ca_integrator_type *const ca_algorithms[];
extern const size_t ca_algorithm_count;

/* Rows that others ask for by themselves. */
extern const ca_integrator_type ca_integrator_path, ca_integrator_light, ca_integrator_bdpt, ca_integrator_ppm,
    ca_integrator_bdpm, ca_integrator_vcm, ca_integrator_vcm_plus, ca_integrator_vcm_star, ca_integrator_ovcm,
    ca_integrator_cavcm, ca_integrator_vavcm, ca_integrator_auto, ca_integrator_qmcppm;

/* Not in the table: finds all light there is, roughly and with few rays, for looking at its paths (an observer).
 * Camera paths hit, ask and merge; they neither connect nor splat. */
extern const ca_integrator_type ca_integrator_pilot;

#endif
