/* What the sections of paper 000's figures share (Ershov, Birukov, Voloboy, Galaktionov, "Calculation of Noise
 * Components for Bidirectional Path Tracing with Photon Maps", 2020): the five scenes, and measurements in groups of
 * iterations whose statistics have errors. All of it dies on errors with a message. */
#ifndef CA_BENCH_PAPER_000_H
#define CA_BENCH_PAPER_000_H

#include "noise/components.h"
#include "paper_plot.h"
#include "paper_report.h"

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

/* A scene, and what of it is measured: the pixels of `region`, at the radius that the scene's file keeps (alpha
 * 0). */
typedef struct paper_000_scene {
    const char *name, *file; /* below scenes/ */
    const char *integrator;
    ca_define defines[2];
    size_t define_count;
    double radius;          /* of merges, m */
    uint32_t width, height; /* of the full film */
    uint32_t region[4];     /* x0, y0, x1, y1, half open, in its pixels */
    const char *dominant; /* the term expected to have 80 % of the variance at the paper's numbers; NULL: none has */
} paper_000_scene;

enum { PAPER_000_SCENES = 5 };
extern const paper_000_scene paper_000_scenes[PAPER_000_SCENES]; /* [0]: the paper's own */

/* The paper's numbers of paths, and fewer. */
enum { PAPER_000_LIGHT = 300000, PAPER_000_CAMERA = 100, PAPER_000_PILOT_LIGHT = 30000, PAPER_000_PILOT_CAMERA = 10 };

ca_scene *paper_000_load(const paper_000_scene *scene);
/* The scene's integrator, film and region, random numbers of `seed`, one thread. */
ca_render_settings paper_000_settings(const paper_000_scene *scene, uint32_t light_paths, uint32_t camera_paths,
                                      uint64_t seed);

/* ---- Measurements ---------------------------------------------------------------------------------------------- */

enum { PAPER_000_GROUPS = 20 };

/* Iterations in groups, each with random numbers of its own: what comes out of the groups tells errors, with all that
 * pixels and quantities of one iteration have in common. */
typedef struct paper_000_run {
    paper_000_scene scene;
    uint32_t light_paths, camera_paths;
    uint32_t iterations;                  /* of a group */
    ca_pair_film groups[PAPER_000_GROUPS]; /* owned */
    ca_pair_film all;                     /* owned: their sum */
    double seconds;                       /* of rendering */
} paper_000_run;

/* Runs of different `seed` have nothing in common. `iterations` in all, at least two for each group. Where the report
 * is a quick one, these two, with a tenth of the paths, of the 8 x 8 pixels in the region's middle. One of the
 * measurements of paper_plan: with fewer iterations where its share of the time is shorter. */
paper_000_run *paper_000_measure(paper_report *report, const paper_000_scene *scene, uint32_t light_paths,
                                 uint32_t camera_paths, uint32_t iterations, uint64_t seed);
void paper_000_release(paper_000_run *run); /* NULL is allowed */

/* Runs that several sections look at: paper_report.shared. */
typedef struct paper_000_runs {
    paper_000_run *at_paper_numbers[PAPER_000_SCENES]; /* NULL: not asked for yet */
} paper_000_runs;
/* How many of the first so many scenes' runs at the paper's numbers are still to be made? For paper_plan. */
int paper_000_runs_to_come(const paper_report *report, int scenes);
/* The scene's run at the paper's numbers; made when it is first asked for. */
const paper_000_run *paper_000_paper_run(paper_report *report, int scene);

/* Numbers made from a film's part of the scene, and what the groups tell of them: jackknife errors, each group left
 * out in turn, and the same number less its bias, as far as that goes with one over the iterations; averages of roots
 * have such a bias. */
enum { PAPER_000_NUMBERS = 16 };
typedef void paper_000_statistic(const ca_pair_film *film, const void *what, double numbers[PAPER_000_NUMBERS]);
typedef struct paper_000_numbers {
    ca_noise_value of[PAPER_000_NUMBERS];
    double corrected[PAPER_000_NUMBERS];
} paper_000_numbers;
paper_000_numbers paper_000_estimate(const paper_000_run *run, paper_000_statistic *statistic, const void *what,
                                     int count);

/* The summary of a film at other numbers of paths, in this order: averages of roots, roots of average variances,
 * ratios. */
enum {
    RMS_MEASURED, RMS_PREDICTED, RMS_CAMERA, RMS_LIGHT, RMS_PAIR,
    ROOT_MEASURED, ROOT_PREDICTED, ROOT_CAMERA, ROOT_LIGHT, ROOT_PAIR,
    RMS_RATIO, ROOT_RATIO, /* measured / predicted */
    SUMMARY_NUMBERS
};
typedef struct paper_000_counts {
    double light_paths, camera_paths;
} paper_000_counts;
paper_000_numbers paper_000_summary(const paper_000_run *run, double light_paths, double camera_paths);

/* a / b of independent values. */
ca_noise_value paper_000_ratio(ca_noise_value a, ca_noise_value b);

/* ---- Sections -------------------------------------------------------------------------------------------------- */

void paper_000_pictures(paper_report *report);        /* in the manner of the paper's figure 3 */
void paper_000_reading(paper_report *report);         /* figure 0 of the list that docs/papers/000.md follows */
void paper_000_radius(paper_report *report);          /* terms and bias over the radius of merges */
void paper_000_law(paper_report *report);             /* figure 1 */
void paper_000_numbers_of_rays(paper_report *report); /* figure 2 */
void paper_000_pilot(paper_report *report);           /* figure 3 */
void paper_000_grid(paper_report *report);            /* figure 4 */
void paper_000_confidence(paper_report *report);      /* figure 5 */
void paper_000_target(paper_report *report);          /* figure 6 */

#endif
