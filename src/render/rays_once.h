/* Numbers of rays that are chosen once, before the first pass: rays "auto" where several ranks render.
 *
 * Rank 0 makes the pilot and the trials that one process makes (auto_rays.h), with random numbers of its own. What it
 * then chooses are the numbers of all passes, so passes are alike, and their sums add up in any order: the picture
 * is, to the bit, the one that its own file makes as `rays`, with a radius that stays. Samples that the numbers were
 * chosen by are not in it. To choose anew while the picture is rendered, as one process does, all ranks would have to
 * wait for each choice.
 *
 * The pilot takes, as in one process, an eighth of the samples, of a rank's part here; or 6 % of the time; or two
 * seconds, where a noise target alone ends the render. It has at least eight iterations, and beyond them two minutes
 * at most. A trial that would take more than one minute is not made. Nothing can be kept meanwhile, and the other
 * ranks wait. */
#ifndef CA_RENDER_RAYS_ONCE_H
#define CA_RENDER_RAYS_ONCE_H

#include "film/pass_part.h"
#include "render/auto_rays.h"

typedef struct ca_rays_once {
    ca_auto_chosen chosen; /* .light_paths 0: none, the numbers are those of the settings */
    double seconds;        /* that this took */
} ca_rays_once;

/* Rays "auto", once or not, with a method that was just chosen: one without numbers to choose renders as it is; so
 * does one whose choice the caller has ended, and a render that is too short for another pilot. Else the radius
 * stays. */
ca_status ca_rays_after_method(ca_render_plan *plan, ca_error *error);

/* Chooses, on rank 0. Where the render is ended meanwhile plan->ended is set, and nothing is chosen. Errors: those of
 * ca_render_plan_run. */
ca_status ca_rays_once_choose(ca_render_plan *plan, ca_rays_once *once, ca_error *error);
void ca_rays_once_destroy(ca_rays_once *once);

/* The numbers that a file of passes tells, or none. Errors: CA_ERROR_MEMORY. */
ca_status ca_rays_once_of(const ca_pass_part *part, size_t pixels, ca_rays_once *once, ca_error *error);

/* Called by all ranks: rank 0's numbers, of so many pixels, go to the others. The errors of any. */
ca_status ca_rays_once_share(const ca_ranks *ranks, size_t pixels, ca_rays_once *once, ca_error *error);

#endif
