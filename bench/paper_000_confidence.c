/* Figure 5 of paper 000's list: how many 95 % intervals hold the expectation, of ordinary and of widened ones.
 *
 * Each scene is rendered several times with random numbers of its own, and each render's intervals are asked for the
 * mean of all the others, an independent run that is as many times less one as long. What error that mean has itself
 * is accounted for: the difference of the two has 1 + 1 / (renders - 1) times the variance of one, so the intervals
 * are made wider by the root of that.
 *
 * Methods that merge have one expectation for each radius, and the default radius is that of a pilot, which each seed
 * has for itself: so all renders have the one of the first. */
#include "paper_000.h"

#include "bench_support.h"

#include <math.h>
#include <stdlib.h>

enum { SIDE = 32, PIXELS = SIDE * SIDE, RENDERS = 9, FEW = 3 * PIXELS / 10 };

static const struct {
    const char *name, *file; /* below scenes/ */
} bundled[] = {
    {"caustics", "caustics/caustics.xml"},
    {"cornell-box", "cornell-box/cornell-box.xml"},
    {"depth-of-field", "depth-of-field/depth-of-field.xml"},
    {"furnace", "furnace/furnace.xml"},
    {"glass-slab", "glass-slab/glass-slab.xml"},
    {"long-diffuse", "long-diffuse/long-diffuse.xml"},
    {"mis", "mis/mis.xml"},
    {"rough-glass", "rough-glass/rough-glass.xml"},
    {"small-light-far", "small-light-far/small-light-far.xml"},
    {"textured", "textured/textured.xml"},
};
enum { BUNDLED = sizeof bundled / sizeof bundled[0] };

typedef struct method {
    const char *name, *integrator, *sampler;
    uint32_t samples, replicates; /* 0: each pass is one */
} method;

static const method methods[] = {
    {"path", "path", "independent", 1024, 0},
    {"path, sobol", "path", "sobol", 1024, 64},
    {"bdpt", "bdpt", "independent", 512, 0},
    {"bdpm", "bdpm:alpha=0", "independent", 512, 0},
    {"ovcm", "ovcm:alpha=0", "independent", 512, 0},
};
enum { METHODS = sizeof methods / sizeof methods[0] };

/* Of all pixels of all renders. */
typedef struct calibration {
    uint64_t pixels, marked, widened, widened_held, constant;
    uint64_t held, low, high; /* of ordinary ones; low, high: the expectation is below, above the interval */
    double error;             /* standard error of the fraction that is held */
} calibration;

static uint64_t judged(const calibration *c) { return c->held + c->low + c->high; }
static double fraction(const calibration *c) { return (double)c->held / (double)judged(c); }
static double widened_fraction(const calibration *c) { return (double)c->widened_held / (double)c->widened; }

static ca_render_settings settings_of(const method *m)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = m->integrator;
    settings.sampler = m->sampler;
    settings.samples_per_pixel = m->samples;
    settings.replicates = m->replicates;
    settings.has_seed = true;
    settings.width = settings.height = SIDE;
    return settings;
}

static ca_image_layers *render(const ca_scene *scene, const ca_render_settings *settings)
{
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, settings, &image, NULL, &error) != CA_OK) bench_die(settings->integrator, &error);
    return image;
}

static const float *channel(const ca_image_layers *image, const char *name)
{
    const float *data = ca_image_channel(image, name);
    if (!data) fprintf(stderr, "paper_000: no channel %s\n", name), exit(1);
    return data;
}

static double luminance(const ca_image_layers *image, int pixel)
{
    return 0.2126 * (double)channel(image, "R")[pixel] + 0.7152 * (double)channel(image, "G")[pixel] +
           0.0722 * (double)channel(image, "B")[pixel];
}

static void judge_ordinary(calibration *c, double mean, double others, double low, double high, double wider)
{
    if (high - low <= 4e-6 * fabs(mean)) { /* no noise: right, but nothing to calibrate */
        c->constant++;
        if (fabs(others - mean) > 4e-6 * fabs(mean)) c->low++;
    } else if (others < mean - wider * (mean - low)) {
        c->low++;
    } else if (others > mean + wider * (high - mean)) {
        c->high++;
    } else {
        c->held++;
    }
}

/* A picture's pixel; `others`: the mean of all others'. */
static void judge_pixel(calibration *c, const ca_image_layers *image, int pixel, double others, int renders)
{
    const double mean = luminance(image, pixel), wider = sqrt(1.0 + 1.0 / (renders - 1.0)),
                 low = (double)channel(image, "ConfidenceLow.Y")[pixel],
                 high = (double)channel(image, "ConfidenceHigh.Y")[pixel];
    c->pixels++;
    if (isinf(low)) {
        c->marked++;
    } else if (channel(image, "ConfidenceWidened.Y")[pixel] == 1.0f) {
        c->widened++;
        c->widened_held += others >= mean - wider * (mean - low) && others <= mean + wider * (high - mean);
    } else {
        judge_ordinary(c, mean, others, low, high, wider);
    }
}

static calibration judge(ca_image_layers *const images[], int renders)
{
    calibration all = {0};
    double fractions[RENDERS], squares = 0.0, sum[PIXELS] = {0};
    int counted = 0;
    for (int r = 0; r < renders; r++)
        for (int i = 0; i < PIXELS; i++) sum[i] += luminance(images[r], i);
    for (int r = 0; r < renders; r++) {
        calibration c = {0};
        for (int i = 0; i < PIXELS; i++)
            judge_pixel(&c, images[r], i, (sum[i] - luminance(images[r], i)) / (renders - 1.0), renders);
        all.pixels += c.pixels, all.marked += c.marked, all.constant += c.constant;
        all.widened += c.widened, all.widened_held += c.widened_held;
        all.held += c.held, all.low += c.low, all.high += c.high;
        if (judged(&c) > 0) fractions[counted++] = fraction(&c);
    }
    const double mean = counted ? paper_mean(fractions, (size_t)counted) : 0.0;
    for (int r = 0; r < counted; r++) squares += (fractions[r] - mean) * (fractions[r] - mean);
    all.error = counted > 1 ? sqrt(squares / (counted - 1.0) / counted) : (double)NAN;
    return all;
}

static calibration calibrate(const ca_scene *scene, const method *m, int renders)
{
    ca_image_layers *images[RENDERS];
    ca_render_settings settings = settings_of(m);
    settings.seed = 1000;
    settings.radius = bench_default_radius(scene, &settings);
    for (int r = 0; r < renders; r++, settings.seed++) images[r] = render(scene, &settings);
    const calibration c = judge(images, renders);
    for (int r = 0; r < renders; r++) ca_image_release(images[r]);
    return c;
}

static void print_row(FILE *out, const char *scene, const method *m, const calibration *c)
{
    const double pixels = (double)c->pixels;
    fprintf(out, "| %s | %s | %.1f %% | %.1f %% |", scene, m->name, 100.0 * (double)c->marked / pixels,
            100.0 * (double)c->widened / pixels);
    if (c->widened == 0)
        fprintf(out, " |");
    else
        fprintf(out, " %.2f %%%s |", 100.0 * widened_fraction(c), c->widened < FEW ? " (few)" : "");
    fprintf(out, " %.1f %% |", 100.0 * (double)c->constant / pixels);
    if (judged(c) == 0)
        fprintf(out, " | | |\n");
    else
        fprintf(out, " %.2f ± %.2f %%%s | %.2f %% | %.2f %% |\n", 100.0 * fraction(c), 100.0 * c->error,
                judged(c) < FEW ? " (few)" : "", 100.0 * (double)c->high / (double)judged(c),
                100.0 * (double)c->low / (double)judged(c));
    fflush(out);
}

static void print_head(const paper_report *report, int renders)
{
    fprintf(report->out,
            "### Figure 5: error bars\n\n"
            "Pixels whose 95 %% interval (`ConfidenceLow.Y`, `ConfidenceHigh.Y`) holds the expectation, of those "
            "that are widened (`ConfidenceWidened.Y`), and of the others that are neither marked "
            "nor without noise: %d x %d pixels, %d renders of each, each one's intervals against the mean of the "
            "others. ",
            SIDE, SIDE, renders);
    for (int k = 0; k < METHODS; k++) {
        const method *m = &methods[k];
        fprintf(report->out, "%s%s: %u replicates of %u", k ? "; " : "", m->name,
                m->replicates ? m->replicates : m->samples, m->replicates ? m->samples / m->replicates : 1);
    }
    fprintf(report->out,
            ". (few): fewer than %d pixels, not counted below.\n\n"
            "| scene | method | marked | widened | of these held | without noise | of the others held | expectation "
            "above | below |\n|---|---|---|---|---|---|---|---|---|\n",
            (int)FEW);
}

/* The least and the most of all scenes: fractions that are held. */
typedef struct extremes {
    double least, most, least_widened;
} extremes;

static void include(extremes *e, const calibration *c)
{
    if (c->widened >= FEW) e->least_widened = fmin(e->least_widened, widened_fraction(c));
    if (judged(c) < FEW) return;
    e->least = fmin(e->least, fraction(c));
    e->most = fmax(e->most, fraction(c));
}

static void expect_extremes(paper_report *report, const char *name, const extremes *e)
{
    paper_expect(report, e->least >= 0.93, e->least, ">= 0.93",
                 "intervals of %s that hold: the least of all scenes", name);
    paper_expect(report, e->most <= 0.97, e->most, "<= 0.97", "intervals of %s that hold: the most of all scenes",
                 name);
    paper_expect(report, e->least_widened >= 0.93, e->least_widened, ">= 0.93",
                 "widened intervals of %s that hold: the least of all scenes", name);
}

void paper_000_confidence(paper_report *report)
{
    const int renders = report->quick ? 3 : RENDERS;
    extremes all[METHODS];
    print_head(report, renders);
    for (int k = 0; k < METHODS; k++) all[k] = (extremes){1.0, 0.0, 1.0};
    for (int i = 0; i < BUNDLED && !paper_time_is_up(report, bundled[i].name); i++) {
        ca_scene *scene = paper_scene(bundled[i].file, NULL, 0);
        for (int k = 0; k < METHODS; k++) {
            const calibration c = calibrate(scene, &methods[k], renders);
            print_row(report->out, bundled[i].name, &methods[k], &c);
            include(&all[k], &c);
        }
        ca_scene_release(scene);
    }
    fprintf(report->out, "\n");
    for (int k = 0; k < METHODS; k++) expect_extremes(report, methods[k].name, &all[k]);
}
