/* A render by passes as it is kept in files: its checkpoint, from which it goes on, and its part file. Both have the
 * sums of passes [plan->first_pass, and so on), and say what these depend on (film/pass_part.h).
 *
 * The order of calls is that of the functions here. A method that integrator `auto` has chosen is in the file, with
 * what it was asked for, so that a render that goes on does not choose again. */
#ifndef CA_RENDER_KEPT_PASSES_H
#define CA_RENDER_KEPT_PASSES_H

#include "film/pass_part.h"
#include "render/checkpoint.h"
#include "render/noise_looks.h"
#include "render/ray_file.h"
#include "render/workers.h"

typedef struct ca_kept_passes {
    ca_checkpoint checkpoint;
    ca_pass_reader reader;           /* of the checkpoint that is gone on from, until its sums are read */
    char *settings;                  /* owned */
    uint32_t resumed;                /* passes that were there */
    uint64_t counts[CA_PART_COUNTS]; /* of these, likewise: */
    double seconds;
    ca_pass_looks looks;
} ca_kept_passes;

/* Locks the checkpoint and opens the file to go on from, if there is one. */
ca_status ca_kept_start(ca_kept_passes *kept, const ca_render_plan *plan, ca_error *error);
void ca_kept_destroy(ca_kept_passes *kept);

/* Of a plan that chooses: is the choice that was made in the file? It then is put to use: *used. */
ca_status ca_kept_use_method(const ca_kept_passes *kept, ca_render_plan *plan, bool *used, ca_error *error);

/* Once the plan is what is rendered: refuses other settings than the file's. `rays` as in part_settings.h. */
ca_status ca_kept_check(ca_kept_passes *kept, const ca_render_plan *plan, uint64_t rays, ca_error *error);

/* Reads the sums into a film without samples. */
ca_status ca_kept_restore(ca_kept_passes *kept, const ca_render_plan *plan, ca_film *film, ca_error *error);

/* What there is to write: the film after so many passes. */
typedef struct ca_kept_state {
    const ca_render_plan *plan;
    const ca_film *film;
    uint32_t passes;
    const ca_workers *workers;
    const ca_ray_file *rays; /* without numbers: those of the settings */
    const uint64_t *others; /* [CA_PART_COUNTS] of other ranks; NULL: there are none */
    double seconds;
    ca_noise_looks looks;
} ca_kept_state;

ca_status ca_kept_write(const ca_kept_passes *kept, const ca_kept_state *state, const char *path, ca_error *error);

#endif
