/* Numbers of rays that are chosen once, before the first pass: rays "auto" where several ranks render.
 *
 * Rank 0 renders a small part of what is asked for as one process does (auto_rays.h), with random numbers of its own.
 * The numbers that this ends with are those of all passes, so passes are alike, and their sums add up in any order:
 * the picture is, to the bit, the one that its own file makes as `rays`, with a radius that stays. Samples that the
 * numbers were chosen by are not in it. To choose anew while the picture is rendered, as one process does, all ranks
 * would have to wait for each choice.
 *
 * The part is a twentieth of what a rank renders of the samples, or to the noise target, or of the time; two minutes
 * at most, in which nothing can be kept yet. */
#ifndef CA_RENDER_RAYS_ONCE_H
#define CA_RENDER_RAYS_ONCE_H

#include "film/pass_part.h"
#include "render/ray_file.h"

typedef struct ca_rays_once {
    uint32_t light_paths;    /* of a pass; 0: nothing was chosen */
    uint32_t *camera_paths;  /* owned: of each pixel */
    ca_rays_statistics told; /* of the small render */
    double seconds;          /* that it took */
} ca_rays_once;

/* Can numbers be chosen at all: has the method such numbers, and the render samples enough to choose them by? */
bool ca_rays_once_has_room(const ca_render_plan *plan);

/* Renders a small part of the plan. Where the caller's progress callback ends it, plan->ended is set, and the numbers
 * are those that were reached. Errors: those of ca_render_plan_run. */
ca_status ca_rays_once_make(ca_render_plan *plan, ca_rays_once *choice, ca_error *error);
void ca_rays_once_destroy(ca_rays_once *choice);

/* The numbers that a file of passes tells, or none. Errors: CA_ERROR_MEMORY. */
ca_status ca_rays_once_of(const ca_pass_part *part, size_t pixels, ca_rays_once *choice, ca_error *error);

/* Called by all ranks: rank 0's numbers, of so many pixels, go to the others. The errors of any. */
ca_status ca_rays_once_share(const ca_ranks *ranks, size_t pixels, ca_rays_once *choice, ca_error *error);

/* Is there a checkpoint to go on from whose numbers were chosen once? Then plan->rays is CA_RAYS_AUTO_ONCE. Errors:
 * those of opening it. */
ca_status ca_rays_once_recall(ca_render_plan *plan, ca_error *error);

#endif
