/* Figure 6 of paper 000's list: the time to a noise target, predicted after the pilot and the validation run,
 * against the time it took. */
#include "paper_000.h"

#include "bench_support.h"

#include <math.h>

enum { FILM_SIDE = 96 };

void paper_000_target(paper_report *report)
{
    const double target = report->quick ? 8.0 : 2.0;
    int near = 0;
    fprintf(report->out,
            "### Figure 6: time to a noise target\n\n`render --rays auto --noise %g`, %d x %d pixels; seconds of the "
            "clock.\n\n",
            target, FILM_SIDE, FILM_SIDE);
    fprintf(report->out,
            "| scene | predicted | at | took | predicted / took | noise reached |\n|---|---|---|---|---|---|\n");
    for (int i = 0; i < PAPER_000_SCENES; i++) {
        const paper_000_scene *desc = &paper_000_scenes[i];
        if (paper_time_is_up(report, desc->name)) return;
        ca_scene *scene = paper_000_load(desc);
        ca_render_settings s = paper_000_settings(desc, 0, 0, 77);
        ca_render_statistics statistics = {.size = sizeof statistics};
        ca_image_layers *image;
        ca_error error;
        s.has_crop = false;
        s.width = s.height = FILM_SIDE;
        s.threads = 0;
        s.noise_percent = target;
        s.rays = "auto";
        if (ca_render(scene, &s, &image, &statistics, &error) != CA_OK) bench_die(desc->name, &error);
        const double ratio = statistics.first_predicted_seconds / statistics.seconds;
        near += fabs(ratio - 1.0) <= 0.2;
        fprintf(report->out, "| %s | %.1f | %.1f | %.1f | %.3f | %.3f %% |\n", desc->name,
                statistics.first_predicted_seconds, statistics.first_predicted_at, statistics.seconds, ratio,
                statistics.noise_percent);
        fflush(report->out);
        ca_image_release(image);
        ca_scene_release(scene);
    }
    fprintf(report->out, "\n");
    paper_expect(report, near >= 3, near, ">= 3",
                 "figure 6: scenes whose time to the target was predicted within 20 %%");
}
