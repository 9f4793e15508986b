/* caustica converge: making the renders that are missing, taking those that are there, and measuring both. */
#include "base/file.h"
#include "cli/converge.h"
#include "cli/look_ahead.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "film/confidence.h"
#include "render/part_settings.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

static const char key_attribute[] = "caustica.converge", iterations_attribute[] = "caustica.iterations";

const ca_converge_metric_text ca_converge_metric_texts[CA_CONVERGE_METRICS] = {
    [CA_CONVERGE_RMSE] = {.key = "rmse", .error = "RMSE", .plotted = true},
    [CA_CONVERGE_MAE] = {.key = "mae", .error = "MAE"},
    [CA_CONVERGE_RELMSE] = {.key = "relmse", .error = "relMSE", .plotted = true},
    [CA_CONVERGE_SMAPE] = {.key = "smape", .error = "SMAPE"},
    [CA_CONVERGE_SSIM] = {.key = "ssim", .error = "1 - SSIM", .plotted = true},
    [CA_CONVERGE_FLIP_LDR] = {.key = "flip_ldr", .error = "FLIP LDR"},
    [CA_CONVERGE_FLIP_HDR] = {.key = "flip_hdr", .error = "FLIP HDR", .plotted = true},
};

/* ---- Attributes ------------------------------------------------------------------------------------------------ */

static double number_of(const ca_image_layers *image, const char *name)
{
    const ca_attribute *attribute = ca_layers_attribute(image, name);
    return attribute && !attribute->text ? attribute->number : (double)NAN;
}

static ca_status read_method(ca_converge *c, const ca_image_layers *image, const char **method, ca_error *error)
{
    const ca_attribute *attribute = ca_layers_attribute(image, "caustica.integrator");
    *method = ca_arena_strdup(&c->memory, attribute && attribute->text ? attribute->text : "");
    return *method ? CA_OK : ca_fail_memory(error, "the renders");
}

bool ca_converge_chosen(const ca_converge *c, const ca_converge_render *r)
{
    const char *asked = c->integrators[r->integrator].text;
    const size_t length = strcspn(r->method, ":");
    return length > 0 && (length != strcspn(asked, ":") || strncmp(r->method, asked, length) != 0);
}

/* ---- What is there --------------------------------------------------------------------------------------------- */

/* What cannot be looked at just now may be there. */
static bool is_there(const char *path) { return access(path, F_OK) == 0 || (errno != ENOENT && errno != ENOTDIR); }

static size_t line_length(const char *text) { return strcspn(text, "\n"); }

/* Says why a file is not taken. */
static void say_changed(const ca_converge *c, const ca_converge_render *r, const char *found)
{
    const char *wanted = r->key;
    if (c->options->quiet) return;
    if (!found) {
        ca_say(stdout, "%s: not of this command, rendered anew\n", r->path);
    } else {
        ca_part_settings_equal(&found, &wanted);
        ca_say(stdout, "%s: made with \"%.*s\", now \"%.*s\": rendered anew\n", r->path, (int)line_length(found),
               found, (int)line_length(wanted), wanted);
    }
}

/* *image stays NULL where there is no file, a damaged one, or one made with other settings. One that cannot be read
 * is not rendered again: it may be what is wanted. */
static ca_status take_file(const ca_converge *c, const ca_converge_render *r, ca_image_layers **image,
                           ca_error *error)
{
    ca_error reason = {""};
    *image = NULL;
    if (!is_there(r->path)) return CA_OK;
    const ca_status status = ca_layers_read(r->path, image, &reason);
    const bool damaged = status == CA_ERROR_FORMAT || status == CA_ERROR_UNSUPPORTED;
    if (status != CA_OK && !damaged) return ca_fail(error, status, NULL, "%s", reason.message);
    if (damaged) {
        *image = NULL;
        if (!c->options->quiet) ca_say(stdout, "%s: rendered anew\n", reason.message);
        return CA_OK;
    }
    const ca_attribute *key = ca_layers_attribute(*image, key_attribute);
    if (key && key->text && strcmp(key->text, r->key) == 0) return CA_OK;
    say_changed(c, r, key ? key->text : NULL);
    ca_layers_destroy(*image);
    *image = NULL;
    return CA_OK;
}

/* ---- What is not ----------------------------------------------------------------------------------------------- */

typedef struct watcher {
    ca_progress_line line;
    bool quiet, told;
} watcher;

/* A render during which a signal arrives is finished, since half of one would be of no use, or, where that takes
 * longer than a second, given up. */
static bool watch(const ca_render_progress *progress, void *user)
{
    watcher *w = user;
    if (ca_signals_arrived() && !w->told) {
        w->told = true;
        ca_progress_clear(&w->line);
        if (!w->quiet)
            fprintf(stderr,
                    "\ncaustica: finishing this render if it takes less than a second, then the results so far are "
                    "written (again: stop at once)\n");
    }
    ca_progress_warn(&w->line, progress);
    ca_progress_draw(&w->line, progress);
    return true;
}

static ca_status keep(const ca_converge_render *r, ca_image_layers *image, const ca_render_statistics *statistics,
                      ca_error *error)
{
    CA_TRY(ca_layers_set_text(image, key_attribute, r->key, error));
    CA_TRY(ca_layers_set_number(image, iterations_attribute, (double)statistics->iterations, error));
    return ca_layers_write(image, r->path, 0.0f, error);
}

/* One that cannot be written is measured all the same: hours may have gone into it. */
static void keep_or_note(ca_converge *c, const ca_converge_render *r, ca_image_layers *image,
                         const ca_render_statistics *statistics)
{
    ca_error reason = {""};
    ca_output_note(&c->written, &c->failure, keep(r, image, statistics, &reason), &reason);
}

/* Says once what pictures of the integrator will lack; those of the last step lack the least. */
static ca_status look_ahead(ca_converge *c, const ca_converge_render *r, ca_error *error)
{
    ca_converge_integrator *integrator = &c->integrators[r->integrator];
    if (integrator->is_looked_at) return CA_OK;
    integrator->is_looked_at = true;
    const ca_converge_render *last = ca_converge_at(c, c->step_count - 1, r->integrator, 0);
    const ca_render_settings settings = ca_converge_settings(c, last);
    return ca_look_ahead(c->scene, &settings, integrator->text, NULL, error);
}

static ca_status render(ca_converge *c, const ca_converge_render *r, ca_image_layers **image, ca_error *error)
{
    watcher w = {.line = ca_progress_start(!c->options->quiet), .quiet = c->options->quiet};
    ca_render_settings settings = ca_converge_settings(c, r);
    ca_render_statistics statistics = {0};
    ca_error reason = {""};
    bool *warned = &c->integrators[r->integrator].is_warned_of;
    w.line.warned = *warned;
    settings.progress = watch;
    settings.progress_user = &w;
    settings.stop = ca_signals_stop();
    ca_status status = look_ahead(c, r, &reason);
    if (status == CA_OK) status = ca_render(c->scene, &settings, image, &statistics, &reason);
    ca_progress_clear(&w.line);
    *warned = w.line.warned;
    if (statistics.interrupted || status == CA_ERROR_INTERRUPTED) return CA_ERROR_INTERRUPTED;
    if (status != CA_OK)
        return ca_fail(error, status, NULL, "%.200s: %.800s", c->integrators[r->integrator].text, reason.message);
    keep_or_note(c, r, *image, &statistics);
    ca_outputs_warn(&statistics);
    return CA_OK;
}

/* ---- Measuring ------------------------------------------------------------------------------------------------- */

/* The mean over pixels of one iteration's standard deviation. */
static double mean_deviation(const ca_image_layers *image, double iterations)
{
    const float *deviation = ca_layers_find(image, "StandardDeviation.Y");
    const size_t pixels = (size_t)image->width * image->height;
    double sum = 0.0;
    if (!deviation || !(iterations >= 2.0)) return (double)NAN;
    for (size_t i = 0; i < pixels; i++) sum += (double)deviation[i];
    return sum / (double)pixels;
}

static ca_status measure(ca_converge *c, ca_converge_render *r, const ca_image_layers *image, ca_error *error)
{
    ca_comparison comparison;
    ca_image_metrics metrics;
    CA_TRY(ca_compare(image, c->reference, &c->region, &comparison, error));
    CA_TRY(ca_measure_image(image, c->reference, &c->region, &c->metrics, &metrics, NULL, error));
    r->metrics[CA_CONVERGE_RMSE] = comparison.rmse;
    r->metrics[CA_CONVERGE_MAE] = comparison.mae;
    r->metrics[CA_CONVERGE_RELMSE] = comparison.relmse;
    r->metrics[CA_CONVERGE_SMAPE] = comparison.smape;
    r->metrics[CA_CONVERGE_SSIM] = metrics.ssim;
    r->metrics[CA_CONVERGE_FLIP_LDR] = metrics.flip_ldr;
    r->metrics[CA_CONVERGE_FLIP_HDR] = metrics.flip_hdr;
    r->mean_luminance = comparison.mean_luminance;
    r->seconds = number_of(image, "caustica.seconds");
    r->samples_per_pixel = number_of(image, "caustica.samplesPerPixel");
    r->iterations = number_of(image, iterations_attribute);
    r->deviation = mean_deviation(image, r->iterations);
    return read_method(c, image, &r->method, error);
}

/* ---- All of them ----------------------------------------------------------------------------------------------- */

static void say_done(const ca_converge *c, const ca_converge_render *r)
{
    char step[64], repeat[32] = "";
    if (c->options->quiet) return;
    ca_converge_step_text(c, r->step, step, sizeof step);
    if (c->repeats > 1) snprintf(repeat, sizeof repeat, ", repeat %zu", r->repeat + 1);
    ca_say(stdout, "%zu of %zu: %s, %s%s: %.3g s, relMSE %.4g", c->renders_done, c->render_count,
           c->integrators[r->integrator].text, step, repeat, r->seconds, r->metrics[CA_CONVERGE_RELMSE]);
    if (ca_converge_chosen(c, r)) ca_say(stdout, ", by %.*s", (int)strcspn(r->method, ":"), r->method);
    printf("%s\n", r->kept ? " (kept)" : "");
    fflush(stdout); /* so that each line is seen at once */
}

static ca_status make_one(ca_converge *c, ca_converge_render *r, ca_error *error)
{
    ca_image_layers *image = NULL;
    CA_TRY(take_file(c, r, &image, error));
    r->kept = image != NULL;
    ca_status status = r->kept ? CA_OK : render(c, r, &image, error);
    if (status == CA_OK) status = measure(c, r, image, error);
    ca_layers_destroy(image);
    return status;
}

ca_status ca_converge_render_all(ca_converge *c, ca_error *error)
{
    ca_status status = CA_OK;
    ca_signals_catch(true); /* watch prints what a signal does */
    while (c->renders_done < c->render_count && status == CA_OK && !ca_signals_arrived()) {
        ca_converge_render *r = &c->renders[c->renders_done];
        status = make_one(c, r, error);
        if (status != CA_OK) break;
        c->renders_done++;
        say_done(c, r);
    }
    ca_signals_release();
    if (status == CA_ERROR_INTERRUPTED) status = CA_OK; /* the renders before it stay */
    ca_error reason = c->failure;
    ca_output_note(&status, error, c->written, &reason);
    c->steps_done = c->renders_done / (c->integrator_count * c->repeats);
    return status;
}

/* ---- Figures of several renders -------------------------------------------------------------------------------- */

double ca_converge_error(const ca_converge_render *r, ca_converge_metric metric)
{
    return metric == CA_CONVERGE_SSIM ? 1.0 - r->metrics[metric] : r->metrics[metric];
}

ca_converge_mean ca_converge_mean_of(const ca_converge *c, size_t step, size_t integrator, ca_converge_metric metric)
{
    const double n = (double)c->repeats;
    ca_converge_mean mean = {.half_width = (double)NAN};
    double squares = 0.0;
    for (size_t i = 0; i < c->repeats; i++) {
        const ca_converge_render *r = ca_converge_at(c, step, integrator, i);
        mean.seconds += r->seconds / n;
        mean.samples += r->samples_per_pixel / n;
        mean.error += ca_converge_error(r, metric) / n;
    }
    if (c->repeats < 2) return mean;
    for (size_t i = 0; i < c->repeats; i++) {
        const double off = ca_converge_error(ca_converge_at(c, step, integrator, i), metric) - mean.error;
        squares += off * off;
    }
    mean.half_width = ca_student_two_sided_quantile(0.05, n - 1.0) * sqrt(squares / (n - 1.0) / n);
    return mean;
}

ca_power_fit ca_converge_fit(const ca_converge *c, size_t integrator, ca_converge_metric metric, bool over_time)
{
    size_t count = 0;
    for (size_t s = 0; s < c->steps_done; s++)
        for (size_t i = 0; i < c->repeats; i++) {
            const ca_converge_render *r = ca_converge_at(c, s, integrator, i);
            c->fit_x[count] = over_time ? r->seconds : r->samples_per_pixel;
            c->fit_y[count++] = ca_converge_error(r, metric);
        }
    return ca_power_fit_of(c->fit_x, c->fit_y, count);
}

void ca_converge_fit_text(const ca_power_fit *fit, char *text, size_t size)
{
    text[0] = '\0';
    if (isfinite(fit->half_width))
        snprintf(text, size, "%.2f ± %.2f", fit->exponent, fit->half_width);
    else if (isfinite(fit->exponent))
        snprintf(text, size, "%.2f", fit->exponent);
}

double ca_converge_equal_seconds(const ca_converge *c)
{
    double seconds = HUGE_VAL;
    if (c->by_time) return c->steps[c->steps_done - 1];
    for (size_t i = 0; i < c->integrator_count; i++)
        seconds = fmin(seconds, ca_converge_at(c, c->steps_done - 1, i, 0)->seconds);
    return seconds;
}

const ca_converge_render *ca_converge_equal_time(const ca_converge *c, size_t integrator)
{
    const ca_converge_render *nearest = ca_converge_at(c, c->steps_done - 1, integrator, 0);
    const double wanted = log(ca_converge_equal_seconds(c));
    for (size_t s = c->steps_done; s-- > 0 && !c->by_time;) {
        const ca_converge_render *r = ca_converge_at(c, s, integrator, 0);
        if (fabs(log(r->seconds) - wanted) < fabs(log(nearest->seconds) - wanted)) nearest = r;
    }
    return nearest;
}

double ca_converge_deviation(const ca_converge *c, size_t integrator, double *seconds_per_iteration)
{
    double sum = 0.0, seconds = 0.0, iterations = 0.0;
    for (size_t i = 0; i < c->repeats; i++) {
        const ca_converge_render *r = ca_converge_at(c, c->steps_done - 1, integrator, i);
        sum += r->deviation / (double)c->repeats;
        seconds += r->seconds;
        iterations += r->iterations;
    }
    *seconds_per_iteration = seconds / iterations;
    return sum;
}

ca_status ca_converge_write(ca_converge *c, const char *file, ca_converge_put put, ca_error *error)
{
    ca_file_writer writer;
    const char *path = ca_converge_path(c, "%s", file);
    if (!path) return ca_fail_memory(error, "the results");
    CA_TRY(ca_file_create(&writer, path, error));
    const ca_status status = put(c, writer.stream, error);
    if (status == CA_OK) return ca_file_commit(&writer, error);
    ca_file_abandon(&writer);
    return status;
}
