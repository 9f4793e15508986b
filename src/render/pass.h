/* One pass: the light paths of each round, then the camera paths by tiles, then one sample for every pixel of the
 * film. A pass is added to the film as a whole, when all of it is there; one that fails, or is stopped, leaves the
 * film, the pictures of techniques and the workers' counts as they were before it.
 *
 * The film gets the mean of a pixel's camera paths plus its splats, as one sample. The camera paths of some hundred
 * pixels are traced together. In a pass of one round a pixel is finished with its group; with several rounds each
 * camera path keeps its sample from round to round in a buffer.
 *
 * State: 40 bytes a pixel, or 64 where the film's sums are in double precision; 64 bytes a camera path, of a pass with
 * several rounds, or of one group a thread. Threads:
 * a pass runs on plan->threads workers; the calls here belong to one thread. */
#ifndef CA_RENDER_PASS_H
#define CA_RENDER_PASS_H

#include "render/ray_times.h"
#include "render/render.h"
#include "render/workers.h"

#include <stdatomic.h>

/* Camera paths of each pixel where they are not the same for all, and where their counting begins; arrays of the
 * film's pixels, row by row. */
typedef struct ca_pass_counts {
    const uint32_t *camera_paths; /* N_B(p) in a pass, >= 1 */
    const uint32_t *first;        /* number of the first one in pass 0; each pass has N_B(p) more */
    uint32_t most;                /* the largest N_B(p) */
} ca_pass_counts;

/* A worker's clock when it had finished its last tile of the round, where times are measured: the next one begins
 * there, so that the clock is read once a tile. Padded to a cache line, nearly. */
typedef struct ca_tile_clock {
    double seconds;
    bool runs;
    char apart[112];
} ca_tile_clock;

/* A thread traces so many camera paths together, or those of one pixel where they are more. */
enum { CA_PASS_GROUP = 512 };

typedef struct ca_pixel_group ca_pixel_group;

typedef struct ca_pass_runner {
    const ca_render_plan *plan;
    void *integrator; /* borrowed */
    ca_film *film;    /* borrowed */
    const ca_pass_counts *counts; /* borrowed; NULL: plan->camera_paths for every pixel, counted from 0 */
    ca_ray_times *times;          /* borrowed; NULL: times are not measured. May change between passes; likewise: */
    bool gathers_pairs;           /* does the pass fill the integrator's pair film? */
    /* Asked between tiles, by the thread that runs the pass: false ends the pass (and those after it) soon, and the
     * film stays as it is. NULL: passes are finished. */
    bool (*goes_on)(void *user);
    void *goes_on_user;
    atomic_bool ended; /* by that */
    /* Asked when all of a pass is there: false drops it (CA_ERROR_INTERRUPTED). NULL: it is added. */
    bool (*may_add)(void *user);
    void *may_add_user;
    uint32_t rounds;
    ca_film_sample *samples; /* owned; camera paths of a pixel next to each other; NULL in a pass of one round */
    ca_pixel_group *groups;  /* owned; one a worker */
    ca_tile_clock *clocks;   /* owned; one a worker */
    /* Owned; of each pixel of the film, until the pass is complete. */
    ca_pass_addend *addends; /* where the film adds up in parts */
    ca_film_sample *made;    /* else */
    ca_kept_counts kept;     /* of the workers, from before the pass */
    ca_workers workers;      /* owned */
} ca_pass_runner;

/* `counts` may be NULL. Pairs are gathered where the plan's input has a pair film. */
ca_status ca_pass_runner_create(ca_pass_runner *runner, const ca_render_plan *plan, void *integrator, ca_film *film,
                                const ca_pass_counts *counts, ca_error *error);
void ca_pass_runner_destroy(ca_pass_runner *runner);

/* Runs the pass-th pass. An end by goes_on is no error. CA_ERROR_INTERRUPTED: the plan's stop (base/stop.h). After an
 * error no further pass is run. */
ca_status ca_pass_run(ca_pass_runner *runner, uint32_t pass, ca_error *error);

/* Bytes that a pass takes for each pixel, beside a film that adds up in parts, and beside one in double precision. */
enum { CA_PASS_PART_BYTES = sizeof(ca_pass_addend), CA_PASS_PIXEL_BYTES = sizeof(ca_film_sample) };

/* Bytes of the buffer that passes of several rounds need. */
double ca_pass_buffer_bytes(const ca_render_plan *plan);

#endif
