/* Figure 2 of paper 000's list: three times the camera paths, three times the light paths. */
#include "paper_000.h"

#include <math.h>

/* ---- Components ------------------------------------------------------------------------------------------------ */

enum { PAIR, CAMERA, LIGHT, PAIR_LESS, CAMERA_LESS, LIGHT_LESS, COMPONENTS };
static const char *const names[COMPONENTS] = {"C̄", "B̄", "F̄", "C̄ − L²", "B̄ − L²", "F̄ − L²"};

/* Averages over the region. */
static void average_components(const ca_pair_film *film, const void *what, double numbers[PAPER_000_NUMBERS])
{
    const size_t pixels = (size_t)film->width * film->height;
    (void)what;
    for (int i = 0; i < COMPONENTS; i++) numbers[i] = 0.0;
    for (size_t p = 0; p < pixels; p++) {
        const ca_noise_components c = ca_noise_components_of(&film->pixels[p]);
        const double values[3] = {c.pair.value, c.camera.value, c.light.value};
        for (int i = 0; i < 3; i++) {
            numbers[i] += values[i] / (double)pixels;
            numbers[i + 3] += (values[i] - c.luminance2.value) / (double)pixels;
        }
    }
}

static double z_of(ca_noise_value a, ca_noise_value b) { return (a.value - b.value) / hypot(a.error, b.error); }

/* Share of pixels in which two runs' values differ by less than 1.96 standard errors, those of the pixel's
 * iterations. */
static double agreeing(const paper_000_run *a, const paper_000_run *b, int component)
{
    const size_t pixels = (size_t)a->all.width * a->all.height;
    size_t agree = 0;
    for (size_t p = 0; p < pixels; p++) {
        const ca_noise_components ca = ca_noise_components_of(&a->all.pixels[p]),
                                  cb = ca_noise_components_of(&b->all.pixels[p]);
        const ca_noise_value va[3] = {ca.pair, ca.camera, ca.light}, vb[3] = {cb.pair, cb.camera, cb.light};
        agree += fabs(z_of(va[component], vb[component])) < 1.96;
    }
    return (double)agree / (double)pixels;
}

static void compare_components(paper_report *report, const paper_000_run *a, const paper_000_run *b)
{
    const paper_000_numbers na = paper_000_estimate(a, average_components, NULL, COMPONENTS);
    const paper_000_numbers nb = paper_000_estimate(b, average_components, NULL, COMPONENTS);
    fprintf(report->out,
            "| component | at %u, %u | at %u, %u | z | pixels within 1.96 errors |\n|---|---|---|---|---|\n",
            a->light_paths, a->camera_paths, b->light_paths, b->camera_paths);
    for (int i = 0; i < COMPONENTS; i++) {
        const double z = z_of(nb.of[i], na.of[i]);
        fprintf(report->out, "| %s | %.5g ± %.2g | %.5g ± %.2g | %+.2f | ", names[i], na.of[i].value, na.of[i].error,
                nb.of[i].value, nb.of[i].error, z);
        if (i < 3)
            fprintf(report->out, "%.1f %% |\n", 100.0 * agreeing(a, b, i));
        else
            fputs("|\n", report->out);
        paper_expect(report, fabs(z) < 3.0, z, "within 3",
                     "figure 2, %s: %s at %u, %u less that at %u, %u, in standard errors", a->scene.name, names[i],
                     b->light_paths, b->camera_paths, a->light_paths, a->camera_paths);
    }
    fputc('\n', report->out);
}

/* ---- Totals ---------------------------------------------------------------------------------------------------- */

static void compare_totals(paper_report *report, const paper_000_run *a, const paper_000_run *b)
{
    const paper_000_numbers p = paper_000_summary(a, b->light_paths, b->camera_paths);
    const paper_000_numbers m = paper_000_summary(b, b->light_paths, b->camera_paths);
    const ca_noise_value root = paper_000_ratio(m.of[ROOT_MEASURED], p.of[ROOT_PREDICTED]);
    const ca_noise_value roots =
        paper_000_ratio((ca_noise_value){m.corrected[RMS_MEASURED], m.of[RMS_MEASURED].error},
                        (ca_noise_value){p.corrected[RMS_PREDICTED], p.of[RMS_PREDICTED].error});
    const double off[2] = {100.0 * (root.value - 1.0), 100.0 * (roots.value - 1.0)};
    fprintf(report->out, "| `%s` | %u, %u | %llu | %.6f | %.6f | %+.2f ± %.2f | %+.2f ± %.2f | %.4f, %.4f, %.4f |\n",
            a->scene.name, b->light_paths, b->camera_paths, (unsigned long long)b->all.pixels[0].iterations,
            p.of[ROOT_PREDICTED].value, m.of[ROOT_MEASURED].value, off[0], 100.0 * root.error, off[1],
            100.0 * roots.error, p.of[RMS_CAMERA].value, p.of[RMS_LIGHT].value, p.of[RMS_PAIR].value);
    for (int i = 0; i < 2; i++)
        paper_expect(report, fabs(off[i]) <= 1.0, off[i], "within 1 %",
                     "figure 2, %s: measured noise at %u, %u over that predicted at %u, %u, minus 1, in %%%s",
                     a->scene.name, b->light_paths, b->camera_paths, a->light_paths, a->camera_paths,
                     i == 0 ? "" : " (averages of roots)");
}

/* ---- Figure 2 -------------------------------------------------------------------------------------------------- */

static void print_scene(paper_report *report, int scene, uint32_t iterations)
{
    static const uint32_t counts[2][2] = {{PAPER_000_LIGHT, 3 * PAPER_000_CAMERA},
                                          {3 * PAPER_000_LIGHT, PAPER_000_CAMERA}};
    const paper_000_run *at_paper = paper_000_paper_run(report, scene);
    paper_000_run *runs[2];
    fputs("| scene | N_F, N_B | iterations | predicted, of averages | measured, of averages | measured / predicted − "
          "1, % | averages "
          "of roots, less bias, % | predicted camera, light, pair |\n|---|---|---|---|---|---|---|---|\n",
          report->out);
    for (int i = 0; i < 2; i++) {
        runs[i] = paper_000_measure(report, &paper_000_scenes[scene], counts[i][0], counts[i][1], iterations,
                                    3 + (uint64_t)i);
        compare_totals(report, at_paper, runs[i]);
    }
    fputc('\n', report->out);
    for (int i = 0; i < 2; i++) {
        compare_components(report, at_paper, runs[i]);
        paper_000_release(runs[i]);
    }
}

void paper_000_numbers_of_rays(paper_report *report)
{
    fprintf(report->out,
            "### Figure 2: other numbers of paths\n\n"
            "Noise predicted for N_B = %d and for N_F = %d from the runs of figure 1 (N_F = %d, N_B = %d), and "
            "measured there with "
            "other random numbers. Then the components, averaged over the region, estimated anew; z in standard "
            "errors of the "
            "difference, from groups of iterations (pixels share light paths, so that errors of pixels do not add in "
            "squares).\n\n",
            3 * PAPER_000_CAMERA, 3 * PAPER_000_LIGHT, PAPER_000_LIGHT, PAPER_000_CAMERA);
    paper_plan(report, 4 + paper_000_runs_to_come(report, 2));
    print_scene(report, 0, 40);
    print_scene(report, 1, 100);
    fputs("The paper: total 0.639 at 100, 0.414 at 300; camera term 0.595, then 0.344; light 0.229, then 0.230; pair "
          "0.0293, then "
          "0.0169.\n\n",
          report->out);
}
