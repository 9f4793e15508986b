/* caustica converge: its numbers as CSV, JSON and plots. */
#include "base/memory.h"
#include "cli/converge.h"
#include "report/page_text.h"
#include "report/plot.h"
#include "scene/scene.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

/* The renders of complete steps. */
static size_t shown(const ca_converge *c) { return c->steps_done * c->integrator_count * c->repeats; }

/* ---- CSV ------------------------------------------------------------------------------------------------------- */

/* Between double quotes, since parameters have commas. */
static void put_csv_text(FILE *stream, const char *text)
{
    fputc('"', stream);
    for (; *text; text++) {
        if (*text == '"') fputc('"', stream);
        fputc(*text, stream);
    }
    fputc('"', stream);
}

/* Not known: an empty field. */
static void put_csv_number(FILE *stream, double value)
{
    fputc(',', stream);
    if (isfinite(value)) ca_page_put_number(stream, value);
}

ca_status ca_converge_put_csv(const ca_converge *c, FILE *stream, ca_error *error)
{
    (void)error;
    fprintf(stream, "integrator,%s,repeat,seed,seconds,samples_per_pixel,iterations", c->by_time ? "time" : "spp");
    for (int m = 0; m < CA_CONVERGE_METRICS; m++) fprintf(stream, ",%s", ca_converge_metric_texts[m].key);
    fputs(",mean_luminance,mean_standard_deviation,file,method\n", stream);
    for (size_t i = 0; i < shown(c); i++) {
        const ca_converge_render *r = &c->renders[i];
        put_csv_text(stream, c->integrators[r->integrator].text);
        fprintf(stream, ",%.12g,%zu,%" PRIu64, c->steps[r->step], r->repeat + 1, r->seed);
        put_csv_number(stream, r->seconds);
        put_csv_number(stream, r->samples_per_pixel);
        put_csv_number(stream, r->iterations);
        for (int m = 0; m < CA_CONVERGE_METRICS; m++) put_csv_number(stream, r->metrics[m]);
        put_csv_number(stream, r->mean_luminance);
        put_csv_number(stream, r->deviation);
        fprintf(stream, ",%s,", r->file);
        put_csv_text(stream, r->method);
        fputc('\n', stream);
    }
    return CA_OK;
}

/* ---- JSON ------------------------------------------------------------------------------------------------------ */

static void put_text(FILE *stream, const char *before, const char *text)
{
    fputs(before, stream);
    ca_page_put_json(stream, text);
}

static void put_number(FILE *stream, const char *before, double value)
{
    fputs(before, stream);
    ca_page_put_number(stream, value);
}

static void put_fit(FILE *stream, const char *name, const ca_power_fit *fit)
{
    fprintf(stream, "\"%s\": {", name);
    put_number(stream, "\"exponent\": ", fit->exponent);
    put_number(stream, ", \"low\": ", fit->exponent - fit->half_width);
    put_number(stream, ", \"high\": ", fit->exponent + fit->half_width);
    put_number(stream, ", \"at_1\": ", exp(fit->offset));
    fprintf(stream, ", \"points\": %zu}", fit->points);
}

static void put_slopes(const ca_converge *c, FILE *stream, size_t integrator)
{
    for (int m = 0; m < CA_CONVERGE_METRICS; m++) {
        const ca_power_fit samples = ca_converge_fit(c, integrator, (ca_converge_metric)m, false);
        const ca_power_fit seconds = ca_converge_fit(c, integrator, (ca_converge_metric)m, true);
        fprintf(stream, "%s\n      \"%s\": {", m ? "," : "", ca_converge_metric_texts[m].key);
        put_fit(stream, "samples", &samples);
        fputs(", ", stream);
        put_fit(stream, "seconds", &seconds);
        fputc('}', stream);
    }
}

static void put_integrators(const ca_converge *c, FILE *stream)
{
    for (size_t i = 0; i < c->integrator_count; i++) {
        double seconds;
        const double deviation = ca_converge_deviation(c, i, &seconds);
        put_text(stream, i ? ",\n    {\"name\": " : "\n    {\"name\": ", c->integrators[i].text);
        put_number(stream, ", \"mean_standard_deviation\": ", deviation);
        put_number(stream, ", \"seconds_per_iteration\": ", seconds);
        put_text(stream, ",\n     \"equal_time\": ", ca_converge_equal_time(c, i)->file);
        fputs(", \"slopes\": {", stream);
        put_slopes(c, stream, i);
        fputs("}}", stream);
    }
}

static void put_renders(const ca_converge *c, FILE *stream)
{
    for (size_t i = 0; i < shown(c); i++) {
        const ca_converge_render *r = &c->renders[i];
        put_text(stream,
                 i ? ",\n    {\"integrator\": " : "\n    {\"integrator\": ", c->integrators[r->integrator].text);
        fprintf(stream, ", \"step\": %.12g, \"repeat\": %zu, \"seed\": %" PRIu64, c->steps[r->step], r->repeat + 1,
                r->seed);
        put_number(stream, ", \"seconds\": ", r->seconds);
        put_number(stream, ", \"samples_per_pixel\": ", r->samples_per_pixel);
        put_number(stream, ", \"iterations\": ", r->iterations);
        for (int m = 0; m < CA_CONVERGE_METRICS; m++) {
            fprintf(stream, ", \"%s\": ", ca_converge_metric_texts[m].key);
            ca_page_put_number(stream, r->metrics[m]);
        }
        put_number(stream, ", \"mean_luminance\": ", r->mean_luminance);
        put_number(stream, ", \"mean_standard_deviation\": ", r->deviation);
        put_text(stream, ", \"file\": ", r->file);
        put_text(stream, ", \"method\": ", r->method);
        fputc('}', stream);
    }
}

ca_status ca_converge_put_json(const ca_converge *c, FILE *stream, ca_error *error)
{
    (void)error;
    put_text(stream, "{\n  \"version\": ", ca_version());
    put_text(stream, ",\n  \"scene\": ", c->options->scene);
    fprintf(stream, ",\n  \"scene_hash\": \"%016" PRIx64 "\"", c->scene->desc.content_hash);
    put_text(stream, ",\n  \"reference\": ", c->options->reference);
    put_number(stream, ",\n  \"reference_rmse\": ", c->reference_noise[0]);
    put_number(stream, ",\n  \"reference_relmse\": ", c->reference_noise[1]);
    fprintf(stream, ",\n  \"steps_are\": \"%s\",\n  \"steps\": [", c->by_time ? "seconds" : "samples_per_pixel");
    for (size_t s = 0; s < c->steps_done; s++) fprintf(stream, "%s%.12g", s ? ", " : "", c->steps[s]);
    fprintf(stream, "],\n  \"repeats\": %zu,\n  \"threads\": %u", c->repeats, c->metrics.threads);
    fprintf(stream, ",\n  \"complete\": %s", c->steps_done == c->step_count ? "true" : "false");
    put_number(stream, ",\n  \"equal_time_seconds\": ", ca_converge_equal_seconds(c));
    fputs(",\n  \"integrators\": [", stream);
    put_integrators(c, stream);
    fputs("],\n  \"renders\": [", stream);
    put_renders(c, stream);
    fputs("]\n}\n", stream);
    return CA_OK;
}

/* ---- Plots ----------------------------------------------------------------------------------------------------- */

enum { PANELS = CA_CONVERGE_METRICS, COLUMNS = 2, NAME_SIZE = 144 };

/* What a panel's series point to: for each integrator the means, and the two ends of the fitted law; the reference's
 * noise. */
typedef struct panel_memory {
    ca_plot_series *series;
    ca_plot_point *points;
    char (*names)[NAME_SIZE];
} panel_memory;

static double x_of(const ca_converge_mean *mean, bool over_time) { return over_time ? mean->seconds : mean->samples; }

/* The fitted law between the first and the last step. */
static size_t law_points(const ca_converge *c, const ca_plot_point *means, const ca_power_fit *fit,
                         ca_plot_point *points)
{
    const size_t last = c->steps_done - 1;
    for (int k = 0; k < 2; k++) {
        const double x = means[k ? last : 0].x;
        points[k] = (ca_plot_point){.x = x, .y = exp(fit->offset + fit->exponent * log(x))};
    }
    return isfinite(fit->exponent) ? 2 : 0;
}

static void draw_integrator(const ca_converge *c, size_t i, ca_converge_metric metric, bool over_time,
                            ca_plot_panel *panel, const panel_memory *memory)
{
    const size_t stride = c->steps_done + 2;
    ca_plot_point *means = memory->points + i * stride, *law = means + c->steps_done;
    const ca_power_fit fit = ca_converge_fit(c, i, metric, over_time);
    char slope[64];
    for (size_t s = 0; s < c->steps_done; s++) {
        const ca_converge_mean mean = ca_converge_mean_of(c, s, i, metric);
        means[s] = (ca_plot_point){.x = x_of(&mean, over_time),
                                   .y = mean.error,
                                   .low = mean.error - mean.half_width,
                                   .high = mean.error + mean.half_width};
    }
    ca_converge_fit_text(&fit, slope, sizeof slope);
    snprintf(memory->names[i], NAME_SIZE, "%.60s%s%s", c->integrators[i].text, slope[0] ? ": slope " : "", slope);
    const ca_plot_series drawn = {
        .name = memory->names[i], .points = means, .count = c->steps_done, .colour = (unsigned)i + 1};
    memory->series[panel->count++] = drawn;
    memory->series[panel->count++] = (ca_plot_series){.points = law,
                                                      .count = law_points(c, means, &fit, law),
                                                      .colour = (unsigned)i + 1,
                                                      .dashed = true,
                                                      .bare = true};
}

/* Where curves turn level: no image is nearer to the reference than that is to the truth. As wide as the integrators
 * are. Not where it is so far below (as a share of an error) that it changes nothing, and would only take the curves'
 * room. */
static void draw_reference(const ca_converge *c, double noise, double share, ca_plot_panel *panel,
                           const panel_memory *memory)
{
    ca_plot_point *points = memory->points + c->integrator_count * (c->steps_done + 2);
    double low = HUGE_VAL, high = 0.0, least = HUGE_VAL;
    for (size_t s = 0; s < panel->count; s += 2)
        for (size_t k = 0; k < panel->series[s].count; k++) least = fmin(least, panel->series[s].points[k].y);
    if (!(noise > share * least)) return;
    for (size_t s = 0; s < panel->count; s += 2)
        for (size_t k = 0; k < panel->series[s].count; k++) {
            low = fmin(low, panel->series[s].points[k].x);
            high = fmax(high, panel->series[s].points[k].x);
        }
    points[0] = (ca_plot_point){.x = low, .y = noise};
    points[1] = (ca_plot_point){.x = high, .y = noise};
    memory->series[panel->count++] = (ca_plot_series){
        .name = "noise of the reference itself", .points = points, .count = 2, .dashed = true, .bare = true};
}

static void draw_panel(const ca_converge *c, ca_converge_metric metric, bool over_time, ca_plot_panel *panel,
                       const panel_memory *memory)
{
    *panel = (ca_plot_panel){.title = ca_converge_metric_texts[metric].error,
                             .x_label = over_time ? "rendering time in seconds" : "samples per pixel",
                             .y_label = ca_converge_metric_texts[metric].error,
                             .series = memory->series,
                             .legend_columns = 1};
    for (size_t i = 0; i < c->integrator_count; i++) draw_integrator(c, i, metric, over_time, panel, memory);
    if (metric == CA_CONVERGE_RMSE) draw_reference(c, c->reference_noise[0], 0.2, panel, memory);
    if (metric == CA_CONVERGE_RELMSE) draw_reference(c, c->reference_noise[1], 0.04, panel, memory);
}

static bool reserve_panel(const ca_converge *c, ca_arena *arena, panel_memory *memory)
{
    const size_t n = c->integrator_count;
    memory->series = ca_arena_alloc(arena, 2 * n + 1, sizeof *memory->series);
    memory->points = ca_arena_alloc(arena, n * (c->steps_done + 2) + 2, sizeof *memory->points);
    memory->names = ca_arena_alloc(arena, n, sizeof *memory->names);
    return memory->series && memory->points && memory->names;
}

static ca_status put_plot(const ca_converge *c, bool over_time, FILE *stream, ca_error *error)
{
    ca_arena arena = {0};
    ca_plot_panel panels[PANELS];
    size_t count = 0;
    bool complete = true;
    for (int m = 0; m < CA_CONVERGE_METRICS && complete; m++) {
        panel_memory memory;
        if (!ca_converge_metric_texts[m].plotted) continue;
        complete = reserve_panel(c, &arena, &memory);
        if (complete) draw_panel(c, (ca_converge_metric)m, over_time, &panels[count++], &memory);
    }
    if (complete) ca_plot_write(stream, panels, count, COLUMNS);
    ca_arena_clear(&arena);
    return complete ? CA_OK : ca_fail_memory(error, "the plots");
}

ca_status ca_converge_put_time_plot(const ca_converge *c, FILE *stream, ca_error *error)
{
    return put_plot(c, true, stream, error);
}

ca_status ca_converge_put_samples_plot(const ca_converge *c, FILE *stream, ca_error *error)
{
    return put_plot(c, false, stream, error);
}
