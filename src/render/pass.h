/* One pass: the light paths of each round, then the camera paths by tiles, then one sample for every pixel of the film.
 *
 * The film gets the mean of a pixel's camera paths plus its splats, as one sample. In a pass of one round a pixel is
 * finished as soon as its camera paths are made; with several rounds each camera path keeps its sample from round to
 * round in a buffer.
 *
 * State: 64 bytes a camera path, of a pass with several rounds, or of one pixel a thread. Threads: a pass runs on
 * plan->threads workers; the calls here belong to one thread. */
#ifndef CA_RENDER_PASS_H
#define CA_RENDER_PASS_H

#include "render/render.h"
#include "render/workers.h"

typedef struct ca_pass_runner {
    const ca_render_plan *plan;
    void *integrator; /* borrowed */
    ca_film *film;    /* borrowed */
    uint32_t rounds;
    ca_film_sample *samples; /* owned; camera paths of a pixel next to each other */
    ca_workers workers;      /* owned */
} ca_pass_runner;

ca_status ca_pass_runner_create(ca_pass_runner *runner, const ca_render_plan *plan, void *integrator, ca_film *film,
                                ca_error *error);
void ca_pass_runner_destroy(ca_pass_runner *runner);

/* Runs the pass-th pass. After an error the film is worth nothing. */
ca_status ca_pass_run(ca_pass_runner *runner, uint32_t pass, ca_error *error);

/* Bytes of the buffer that passes of several rounds need. */
double ca_pass_buffer_bytes(const ca_render_plan *plan);

#endif
