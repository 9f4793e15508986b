/* What the files of a render by passes share: its state while it goes on. */
#ifndef CA_RENDER_RENDER_PASSES_STATE_H
#define CA_RENDER_RENDER_PASSES_STATE_H

#include "render/kept_passes.h"
#include "render/pass.h"
#include "render/rank_sums.h"
#include "render/rays_once.h"

typedef struct ca_pass_render {
    ca_render_plan *plan;
    void *integrator;
    ca_film film;
    ca_pass_runner runner;
    ca_rays_once once; /* of plans with CA_RAYS_AUTO_ONCE; its map goes into: */
    ca_ray_file rays;  /* likewise, and with CA_RAYS_OF_FILE */
    ca_kept_passes kept;
    uint32_t passes; /* done, from plan->first_pass on */
    double start, seconds;
    double before; /* of the seconds, in which no pass was made: what had to be chosen */
    ca_noise_looks looks;
    uint32_t look_passes; /* done at the last look */
    double look_seconds;  /* then */
    bool interrupted;
    const ca_ranks *ranks; /* borrowed; NULL: the render is this process's alone. Else likewise: */
    bool gathered; /* for the caller, who is being told of the progress */
    ca_rank_work work;
    ca_rank_film rank_film;
} ca_pass_render;

/* ---- The loop (pass_loop.c) ------------------------------------------------------------------------------------ */

/* Makes passes until there are enough, and keeps them. The passes before one that was not made whole stay: they are
 * the image. */
ca_status ca_pass_loop_run(ca_pass_render *r, ca_error *error);

/* ca_rank_work.make; `user` is a ca_pass_render, as below. */
ca_status ca_pass_loop_make_range(void *user, ca_work_range range, uint64_t *made, ca_error *error);
/* ca_checkpoint_writer. At the end all is gathered. */
ca_status ca_pass_loop_write(void *user, const char *path, ca_error *error);

/* What a part and a rank have whole: the passes of a replicate. */
uint32_t ca_pass_loop_together(const ca_pass_render *r);

/* ---- The image (render_passes.c) ------------------------------------------------------------------------------- */

/* ca_render_progress.snapshot */
ca_status ca_render_passes_snapshot(const ca_render_progress *progress, ca_image_layers **image,
                                    ca_render_statistics *statistics, ca_error *error);

#endif
