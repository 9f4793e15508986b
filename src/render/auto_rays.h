/* Renders that choose their numbers of rays (ca_render_settings.rays "auto"): a pilot, and phases with the numbers that the estimates
 * so far ask for (noise/ray_numbers.h). All samples count.
 *
 * Pilot. Its iterations are shared out in turns to two halves, A and B, which share nothing but the numbers. First one cheap
 * iteration each, with a quarter of the light paths and one camera path, which tells the clock how many light paths the rest
 * can afford; then one each without and two or more each with their pairs gathered (film/pair_film.h). Times are measured where pairs are
 * not gathered: those are the iterations that will be rendered. The pilot ends after a share of the wanted time or samples, not before
 * it has these eight iterations; for a noise target after a fixed number. Nothing but the clock and the settings decides on its
 * numbers and its end.
 *
 * Phases. Light paths and camera paths are numbered on; each phase has a share of the render that was fixed before the first one
 * began, 1 : 2 : 4 where there is room for three. All but the last gather pairs in some iterations, from which, with those before,
 * the numbers are revised.
 *
 * The image. (1 - w_A) I_B / 2 + (1 - w_B) I_A / 2 + (w_A + w_B) R / 2, where w_A is made of A's estimates and of times alone, and R
 * is the mean of the phases by their fixed shares: no part is multiplied by a weight that was made of its own samples. Why that
 * leaves no bias, and what remains: docs/papers/000.md, "Joining the pilot with the render".
 *
 * Memory: 1,316 bytes a pixel beside the film. The light paths of an iteration must fit the memory at once; where none is set,
 * no more than 2^22 are chosen. Threads: the samples do not depend on them, but the numbers depend on measured times. */
#ifndef CA_RENDER_AUTO_RAYS_H
#define CA_RENDER_AUTO_RAYS_H

#include "film/joined_film.h"
#include "render/render.h"

enum { CA_AUTO_HALVES = 2, CA_AUTO_GROUPS = 2 }; /* A and B; cheap and ordinary iterations */

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

/* Renders a plan with plan->rays CA_RAYS_AUTO; `observer` may be NULL. Errors: those of ca_render_plan_run; CA_ERROR_ARGUMENT where there
 * are too few samples, paths or bytes for a pilot. */
ca_status ca_auto_rays_render(ca_render_plan *plan, const ca_auto_observer *observer, ca_image_layers **image,
                              ca_render_statistics *statistics, ca_error *error);

#endif
