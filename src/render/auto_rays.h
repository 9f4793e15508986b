/* Renders that choose their numbers of rays (ca_render_settings.rays "auto"): a pilot, trials, and phases with the
 * numbers that the estimates so far ask for (noise/ray_numbers.h). All samples count.
 *
 * What is decided, and when, is in auto_pilot_plan.h and auto_plan.h: pure functions of what was measured and of what
 * is left. Here it is done.
 *
 * Pilot. Its iterations go in turns to two halves, A and B, which share nothing but the numbers. Three in four gather
 * pairs (film/pair_film.h); times are measured in the others, which are like the iterations to come. The pilot ends
 * after a share of the wanted time or samples, to a noise target after two seconds or when that is reached. A then
 * fixes the weight w_A by its own estimates and times, B likewise w_B; from there on the two are merged.
 *
 * Runs: trials, where the best numbers are far from the pilot's; a validation run before the time to a noise target
 * is predicted; phases. Light paths and camera paths are numbered on. All runs but the last measure pairs and times
 * in some iterations, and the numbers are chosen again from all that is known.
 *
 * The image. (1 - w_A) I_B / 2 + (1 - w_B) I_A / 2 + (w_A + w_B) R / 2, where R is the mean of the runs, each with a
 * share that is fixed before its samples are made: no part is multiplied by a weight that was made of its own
 * samples. Why that leaves no bias, and what remains: docs/papers/000.md, "Joining the pilot with the render".
 *
 * Memory: at most 628 bytes a pixel, the film's 128 included:
 *
 *                                     pilot   its end   between runs   in a run
 *     numbers in use, next paths          8         8              8          8
 *     the pilot (halved_film.h)         172       172            172        172
 *     films of samples               2 x 128                                128
 *     an iteration (pass.h)              64                                  64
 *     means of pairs                  2 x 40    2 x 40                        40
 *     what paths do (ray_times.h)     2 x 24    2 x 24             24         24
 *     what is known (auto_known.h)                  24             24         24
 *     R (joined_film.h)                                           160        160
 *     choosing numbers                             164            164
 *     all                               628        496            552        620
 *
 * A render that is kept in a checkpoint takes 100 more: what an iteration adds to the pairs before it is complete,
 * 72, and the numbers of each run, 7 x 4. Where paths connect a pixel takes 1508: each film of means of pairs has 440
 * more, of connections and with the weights of four other numbers of light paths (auto_nodes.h), and 16 instead of 24
 * are known; a checkpoint then takes 360 more, 72 for each of the five weightings.
 *
 * A picture while the render goes on takes 320 more while it is made, beside its layers. The light paths of an
 * iteration must fit the memory at once; where none is set, no more than CA_RAY_MOST_LIGHT_PATHS_HELD are chosen.
 * Threads: the samples do not depend on them, but the numbers depend on measured times.
 *
 * Checkpoints hold all of this as it is after an iteration, and what was decided so far (auto_record.h): a render
 * goes on from one with the sums, the estimates and the times that it had. Numbers that are chosen after that follow
 * from the times of both processes; the image is always the one that its record tells, to the bit. With
 * CA_RAYS_OF_RECORD the record of such a file decides all. */
#ifndef CA_RENDER_AUTO_RAYS_H
#define CA_RENDER_AUTO_RAYS_H

#include "film/halved_film.h"
#include "render/auto_pilot_plan.h"
#include "render/render.h"

enum { CA_AUTO_PIXEL_BYTES = 628, CA_AUTO_KEPT_PIXEL_BYTES = 100 };
enum { CA_AUTO_CONNECTED_PIXEL_BYTES = 1508, CA_AUTO_CONNECTED_KEPT_PIXEL_BYTES = 360 }; /* where paths connect */
/* What a pixel of the image takes beside what all films need to be developed: a joined film, where there is none. */
enum { CA_AUTO_IMAGE_PIXEL_BYTES = sizeof(ca_joined_pixel) };

/* What an image was joined of, for those who want to check it. */
typedef struct ca_auto_parts {
    const ca_halved_film *pilot;  /* I_A, I_B */
    const ca_joined_film *render; /* R; NULL: the render ended in its pilot */
    uint32_t render_iterations;
    double weights[CA_PILOT_HALVES]; /* w_A, w_B */
} ca_auto_parts;

typedef struct ca_auto_observer {
    void (*parts)(const ca_auto_parts *parts, void *user); /* once, before the image is joined */
    void *user;
} ca_auto_observer;

/* Renders a plan with plan->rays CA_RAYS_AUTO or CA_RAYS_OF_RECORD; `observer` may be NULL. Errors: those of
 * ca_render_plan_run; CA_ERROR_ARGUMENT where there are too few samples, paths or bytes for a pilot. */
ca_status ca_auto_rays_render(ca_render_plan *plan, const ca_auto_observer *observer, ca_image_layers **image,
                              ca_render_statistics *statistics, ca_error *error);

/* Numbers for passes that are all alike: pilot and trials of such a render are made, and dropped. */
typedef struct ca_auto_chosen {
    uint32_t light_paths;    /* N_F; 0: it was ended before there was a choice */
    uint32_t *camera_paths;  /* owned: N_B(p) */
    ca_rays_statistics told; /* phases: 1, that of the passes */
} ca_auto_chosen;

/* Of a plan with CA_RAYS_AUTO; samples, time and noise of its settings say how much there is to render. Errors: as
 * above. */
ca_status ca_auto_rays_choose(ca_render_plan *plan, ca_auto_chosen *chosen, ca_error *error);

#endif
