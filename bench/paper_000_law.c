/* Figure 1 of paper 000's list: predicted against measured noise at the paper's numbers of paths. Figure 3: the same
 * noise predicted from a tenth of both. */
#include "paper_000.h"

#include <math.h>
#include <string.h>

static double percent(double ratio) { return 100.0 * (ratio - 1.0); }

/* ---- Figure 1 -------------------------------------------------------------------------------------------------- */

static void print_law_row(FILE *out, const paper_000_run *run, const paper_000_numbers *n)
{
    fprintf(out, "| `%s` | %llu | %.6f | %.6f | %+.2f ± %.2f | %+.2f | %+.2f ± %.2f | 1 : %.3f : %.3f |\n",
            run->scene.name, (unsigned long long)run->all.pixels[0].iterations, n->of[RMS_MEASURED].value,
            n->of[RMS_PREDICTED].value, percent(n->of[RMS_RATIO].value), 100.0 * n->of[RMS_RATIO].error,
            percent(n->corrected[RMS_RATIO]), percent(n->of[ROOT_RATIO].value), 100.0 * n->of[ROOT_RATIO].error,
            n->of[RMS_LIGHT].value / n->of[RMS_CAMERA].value, n->of[RMS_PAIR].value / n->of[RMS_CAMERA].value);
}

static void check_law(paper_report *report, const paper_000_run *run, const paper_000_numbers *n, double limit)
{
    char goal[32];
    snprintf(goal, sizeof goal, "within %g %%", limit);
    const double raw = percent(n->of[RMS_RATIO].value), corrected = percent(n->corrected[RMS_RATIO]);
    const double z = (n->of[ROOT_RATIO].value - 1.0) / n->of[ROOT_RATIO].error;
    paper_expect(report, fabs(raw) <= limit, raw, goal,
                 "figure 1, %s: measured over predicted noise minus 1, in %%, averages of roots", run->scene.name);
    paper_expect(report, fabs(corrected) <= limit, corrected, goal, "figure 1, %s: the same, less the roots' bias",
                 run->scene.name);
    paper_expect(report, fabs(z) < 3.0, z, "within 3",
                 "figure 1, %s: the same of roots of average variances, in standard errors", run->scene.name);
}

/* The term that should be the largest is. */
static void check_dominant(paper_report *report, const paper_000_run *run, const paper_000_numbers *n)
{
    static const char *const names[3] = {"camera", "light", "pair"};
    const char *expected = run->scene.dominant;
    double largest = 0.0, shares[3];
    int which = 0;
    for (int i = 0; i < 3; i++) {
        shares[i] = pow(n->of[ROOT_CAMERA + i].value / n->of[ROOT_PREDICTED].value, 2.0);
        if (shares[i] > largest) largest = shares[i], which = i;
    }
    const bool mixed = largest < 0.8;
    paper_expect(report, expected ? !mixed && strcmp(expected, names[which]) == 0 : mixed, largest,
                 expected ? ">= 0.8" : "< 0.8",
                 "figure 1, %s: share of the largest term (%s) in the variance, expected: %s", run->scene.name,
                 names[which], expected ? expected : "mixed");
}

void paper_000_law(paper_report *report)
{
    fprintf(report->out,
            "### Figure 1: predicted and measured noise\n\n"
            "N_F = %d, N_B = %d. *Measured*: root of the sample variance over so many iterations; *predicted*: root "
            "of (6); both "
            "averaged over the scene's region, in units of luminance. *Less bias*: the root of a noisy variance is "
            "too small "
            "on average, by (kurtosis − 1)/8 over the number of iterations of itself; the jackknife over %d groups "
            "of iterations "
            "takes that away. *Of averages*: roots of the variances' averages over the region, which have no such "
            "bias. Standard "
            "errors from the same groups, each with random numbers of its own. The terms are averages of roots.\n\n"
            "| scene | iterations | measured | predicted | measured / predicted − 1, %% | less bias, %% | of "
            "averages, %% | "
            "camera : light : pair |\n|---|---|---|---|---|---|---|---|\n",
            PAPER_000_LIGHT, PAPER_000_CAMERA, PAPER_000_GROUPS);
    /* The first scene is the one that takes longest: it has what the others leave. */
    paper_plan(report, paper_000_runs_to_come(report, PAPER_000_SCENES));
    for (int s = PAPER_000_SCENES; s-- > 0;) (void)paper_000_paper_run(report, s);
    for (int s = 0; s < PAPER_000_SCENES; s++) {
        const paper_000_run *run = paper_000_paper_run(report, s);
        const paper_000_numbers n = paper_000_summary(run, run->light_paths, run->camera_paths);
        print_law_row(report->out, run, &n);
        check_law(report, run, &n, s == 0 ? 0.5 : 1.0);
        check_dominant(report, run, &n);
    }
    fprintf(report->out, "\nThe paper: measured 0.637951, predicted 0.638509 (−0.09 %%).\n\n");
}

/* ---- Figure 3 -------------------------------------------------------------------------------------------------- */

void paper_000_pilot(paper_report *report)
{
    static const uint32_t iterations[PAPER_000_SCENES] = {200, 1000, 600, 2000, 1000};
    fprintf(report->out,
            "### Figure 3: predicted from a pilot\n\n"
            "Components from iterations of %d light and %d camera paths, and what they predict for %d and %d, "
            "against the noise "
            "measured there with other random numbers (the runs of figure 1).\n\n"
            "| scene | pilot's iterations | predicted, of averages | measured, of averages | measured / predicted − "
            "1, %% | averages of "
            "roots, less bias, %% |\n|---|---|---|---|---|---|\n",
            PAPER_000_PILOT_LIGHT, PAPER_000_PILOT_CAMERA, PAPER_000_LIGHT, PAPER_000_CAMERA);
    paper_plan(report, PAPER_000_SCENES + paper_000_runs_to_come(report, PAPER_000_SCENES));
    for (int s = 0; s < PAPER_000_SCENES; s++) {
        paper_000_run *pilot = paper_000_measure(report, &paper_000_scenes[s], PAPER_000_PILOT_LIGHT,
                                                 PAPER_000_PILOT_CAMERA, iterations[s], 2);
        const paper_000_run *full = paper_000_paper_run(report, s);
        const paper_000_numbers p = paper_000_summary(pilot, full->light_paths, full->camera_paths);
        const paper_000_numbers m = paper_000_summary(full, full->light_paths, full->camera_paths);
        const ca_noise_value root = paper_000_ratio(m.of[ROOT_MEASURED], p.of[ROOT_PREDICTED]);
        const ca_noise_value roots =
            paper_000_ratio((ca_noise_value){m.corrected[RMS_MEASURED], m.of[RMS_MEASURED].error},
                            (ca_noise_value){p.corrected[RMS_PREDICTED], p.of[RMS_PREDICTED].error});
        fprintf(report->out, "| `%s` | %llu | %.6f | %.6f | %+.2f ± %.2f | %+.2f ± %.2f |\n", full->scene.name,
                (unsigned long long)pilot->all.pixels[0].iterations, p.of[ROOT_PREDICTED].value,
                m.of[ROOT_MEASURED].value, percent(root.value), 100.0 * root.error, percent(roots.value),
                100.0 * roots.error);
        paper_expect(report, fabs(percent(root.value)) <= 2.0, percent(root.value), "within 2 %",
                     "figure 3, %s: measured over the noise predicted by the pilot, minus 1, in %%",
                     full->scene.name);
        paper_expect(report, fabs(percent(roots.value)) <= 2.0, percent(roots.value), "within 2 %",
                     "figure 3, %s: the same, averages of roots", full->scene.name);
        paper_000_release(pilot);
    }
    fputc('\n', report->out);
}
