/* Renders that choose their numbers of rays (ca_render_settings.rays "auto"): a pilot, trials, and phases with the
 * numbers that the estimates so far ask for (noise/ray_numbers.h). All samples count.
 *
 * Pilot. Its iterations are shared out in turns to two halves, A and B, which share nothing but the numbers. First a
 * ramp: one cheap iteration each, with a quarter of the light paths and one camera path, and then steps to more paths
 * as long as the clock says that even the next one is far from taking a sixteenth of the pilot. Then ordinary ones,
 * as many as there is time for, each without or, three in four, with their pairs gathered (film/pair_film.h). Times
 * are measured where pairs are not gathered: those are the iterations that will be rendered. The pilot ends after a
 * share of the wanted time or samples, to a noise target after two seconds or when that is reached, not before it has
 * eight iterations. Numbers that somebody gave stay as they are. But for that target nothing but the clock and the
 * settings decides on its numbers and its end.
 *
 * Trials. Where the numbers that seem best have more than twice or less than half the pilot's light paths, three
 * iterations of numbers on the way there tell what paths cost when there are so many, and more of their noise; up to
 * three times. N_F goes no further than sixteen times what was measured in a trial, four times in a phase; and of
 * numbers that are within 3 % as good, those with the fewest light paths are taken.
 *
 * Phases. Light paths and camera paths are numbered on; each phase has a share of the render that was fixed before
 * the first one began, 1 : 2 : 4 where there is room for three. All but the last measure pairs and times in some
 * iterations, from which, with those before, the numbers are revised. To a noise target there is a proof before them,
 * four seconds of the render whose own variance and time foretell the end.
 *
 * The image. (1 - w_A) I_B / 2 + (1 - w_B) I_A / 2 + (w_A + w_B) R / 2, where w_A is made of A's estimates and of
 * times alone, and R is the mean of trials and phases, each with a share that is fixed before its samples are made:
 * no part is multiplied by a weight that was made of its own samples. Why that leaves no bias, and what remains:
 * docs/papers/000.md, "Joining the pilot with the render".
 *
 * Memory: 1,492 bytes a pixel beside the film. The light paths of an iteration must fit the memory at once; where
 * none is set, no more than 2^22 are chosen. Threads: the samples do not depend on them, but the numbers depend on
 * measured times. */
#ifndef CA_RENDER_AUTO_RAYS_H
#define CA_RENDER_AUTO_RAYS_H

#include "film/joined_film.h"
#include "render/render.h"

enum { CA_AUTO_HALVES = 2, CA_AUTO_GROUPS = 2 }; /* A and B; the ramp and ordinary iterations */

/* What an image was joined of, for those who want to check it. */
typedef struct ca_auto_parts {
    const ca_film *pilot[CA_AUTO_HALVES][CA_AUTO_GROUPS]; /* a group without iterations has 0 samples */
    double group_shares[CA_AUTO_GROUPS];                  /* of each group in its half's mean; sum 1 */
    const ca_joined_film *render;                         /* R; NULL: the render ended in its pilot */
    uint32_t render_iterations;
    double weights[CA_AUTO_HALVES]; /* w_A, w_B */
} ca_auto_parts;

typedef struct ca_auto_observer {
    void (*parts)(const ca_auto_parts *parts, void *user); /* once, before the image is joined */
    void *user;
} ca_auto_observer;

/* Renders a plan with plan->rays CA_RAYS_AUTO; `observer` may be NULL. Errors: those of ca_render_plan_run;
 * CA_ERROR_ARGUMENT where there are too few samples, paths or bytes for a pilot. */
ca_status ca_auto_rays_render(ca_render_plan *plan, const ca_auto_observer *observer, ca_image_layers **image,
                              ca_render_statistics *statistics, ca_error *error);

#endif
