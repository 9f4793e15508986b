#include "cli/stats_json.h"

#include "base/file.h"
#include "base/memory.h"
#include "path/technique.h"

#include <jansson.h>
#include <math.h>

static void *allocate(size_t size) { return ca_alloc(size, 1); }

/* JSON knows neither infinity nor "not a number". */
static json_t *number(double value) { return isfinite(value) ? json_real(value) : json_null(); }
static json_t *count(uint64_t value) { return json_integer((json_int_t)value); }

/* Steals the reference, as jansson's own *_new calls do; a NULL value or object counts as a failure. */
static bool set(json_t *object, const char *key, json_t *value) { return json_object_set_new(object, key, value) == 0; }

/* Takes `root` over; NULL or `complete` false: it could not be put together. */
static ca_status write_file(const char *path, json_t *root, bool complete, ca_error *error)
{
    ca_file_writer writer;
    ca_status status = root && complete ? CA_OK : ca_fail_memory(error, path);
    if (status == CA_OK) status = ca_file_create(&writer, path, error);
    if (status == CA_OK) {
        if (json_dumpf(root, writer.stream, JSON_INDENT(2)) == 0 && fputc('\n', writer.stream) != EOF) {
            status = ca_file_commit(&writer, error);
        } else {
            ca_file_abandon(&writer);
            status = ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write the statistics", path);
        }
    }
    json_decref(root);
    return status;
}

/* By technique; "film": noticed by nobody else. */
static json_t *non_finite_json(const ca_render_statistics *s)
{
    json_t *object = json_object();
    bool complete = object != NULL;
    for (int t = 0; t < CA_NON_FINITE_SOURCES && complete; t++)
        complete = set(object, t < CA_TECHNIQUE_COUNT ? ca_technique_name((ca_technique)t) : "film",
                       count(s->non_finite_from[t]));
    if (complete) return object;
    json_decref(object);
    return NULL;
}

/* Those rendered, half open; null of renders by passes. */
static json_t *blocks_json(const ca_render_statistics *s)
{
    if (s->blocks[1] == 0) return json_null();
    json_t *range = json_array();
    bool complete = range != NULL;
    for (int i = 0; i < 2 && complete; i++) complete = json_array_append_new(range, count(s->blocks[i])) == 0;
    if (complete) return range;
    json_decref(range);
    return NULL;
}

static bool set_render(json_t *root, const ca_render_statistics *s)
{
    return set(root, "seconds", number(s->seconds)) && set(root, "iterations", count(s->iterations)) &&
           set(root, "blocks", blocks_json(s)) && set(root, "samples_per_pixel", number(s->samples_per_pixel)) &&
           set(root, "light_paths", count(s->light_paths)) && set(root, "camera_paths", count(s->camera_paths)) &&
           set(root, "rays", count(s->rays)) && set(root, "shadow_rays", count(s->shadow_rays)) &&
           set(root, "photons", count(s->photons)) && set(root, "photons_tested", count(s->photons_tested)) &&
           set(root, "merges", count(s->merges)) && set(root, "peak_memory_bytes", count(s->peak_memory_bytes)) &&
           set(root, "mean_luminance", number(s->mean_luminance)) &&
           set(root, "mean_standard_deviation", number(s->mean_standard_deviation)) &&
           set(root, "noise_percent", s->noise_percent < 0.0 ? json_null() : number(s->noise_percent)) &&
           set(root, "non_finite", non_finite_json(s)) && set(root, "interrupted", json_boolean(s->interrupted));
}

ca_status ca_stats_write_render(const char *path, const ca_render_statistics *s, ca_error *error)
{
    json_set_alloc_funcs(allocate, ca_free);
    json_t *root = json_object();
    const bool complete = set_render(root, s);
    return write_file(path, root, complete, error);
}

/* ---- Noise -------------------------------------------------------------------------------------------------------- */

/* `value` where `complete`; else it is given up. */
static json_t *whole(json_t *value, bool complete)
{
    if (complete) return value;
    json_decref(value);
    return NULL;
}

static json_t *negative_json(const ca_noise_summary *s, bool measured)
{
    json_t *object = json_object();
    return whole(object, set(object, "predicted", count(s->negative_predicted)) &&
                             (!measured || set(object, "measured", count(s->negative_measured))) &&
                             set(object, "camera", count(s->negative_camera)) &&
                             set(object, "light", count(s->negative_light)) && set(object, "pair", count(s->negative_pair)));
}

/* `measured`: with the sample variance. */
static json_t *summary_json(const ca_noise_summary *s, bool measured)
{
    json_t *object = json_object();
    bool complete = set(object, "pixels", count(s->pixels)) && set(object, "mean_luminance", number(s->luminance)) &&
                    set(object, "predicted_rms", number(s->predicted_rms)) &&
                    set(object, "camera", number(s->camera_rms)) && set(object, "light", number(s->light_rms)) &&
                    set(object, "pair", number(s->pair_rms)) &&
                    set(object, "predicted_variance", number(s->predicted)) &&
                    set(object, "camera_variance", number(s->camera)) &&
                    set(object, "light_variance", number(s->light)) && set(object, "pair_variance", number(s->pair)) &&
                    set(object, "negative", negative_json(s, measured));
    if (measured)
        complete = complete && set(object, "measured_rms", number(s->measured_rms)) &&
                   set(object, "measured_variance", number(s->measured));
    return whole(object, complete);
}

static bool set_averages(json_t *object, const ca_noise_prediction *p, bool has_roi, bool measured)
{
    return set(object, "image", summary_json(&p->image, measured)) &&
           set(object, "roi", has_roi ? summary_json(&p->roi, measured) : json_null());
}

static json_t *counts_json(const ca_noise_prediction *p)
{
    json_t *object = json_object();
    return whole(object, set(object, "light_paths", count(p->light_paths)) &&
                             set(object, "camera_paths", count(p->camera_paths)));
}

static json_t *predictions_json(const ca_noise_report *report)
{
    json_t *list = json_array();
    bool complete = list != NULL;
    for (size_t i = 0; i < report->prediction_count && complete; i++) {
        const ca_noise_prediction *p = &report->predictions[i];
        json_t *object = counts_json(p);
        const bool filled = set_averages(object, p, report->has_roi, false);
        complete = json_array_append_new(list, whole(object, filled)) == 0;
    }
    return whole(list, complete);
}

ca_status ca_stats_write_noise(const char *path, const ca_noise_report *report, ca_error *error)
{
    json_set_alloc_funcs(allocate, ca_free);
    json_t *root = json_object();
    const bool complete = set_render(root, &report->statistics) && set(root, "per_iteration", counts_json(&report->measured)) &&
                          set_averages(root, &report->measured, report->has_roi, true) &&
                          set(root, "predict", predictions_json(report));
    return write_file(path, root, complete, error);
}

/* ---- Comparisons -------------------------------------------------------------------------------------------------- */

static json_t *block_test_json(const ca_block_test *test)
{
    if (!test->done) return json_null();
    json_t *object = json_object();
    const bool complete = set(object, "blocks", count(test->blocks)) && set(object, "rejected", count(test->rejected)) &&
                          set(object, "blocks_untested", count(test->blocks_untested)) &&
                          set(object, "p_value", number(test->p_value)) &&
                          set(object, "detectable_bias", number(test->detectable_bias)) &&
                          set(object, "reference_exact", json_boolean(test->reference_exact));
    if (complete) return object;
    json_decref(object);
    return NULL;
}

static json_t *image_json(const ca_compared_image *image)
{
    const ca_comparison *c = &image->comparison;
    json_t *object = json_object();
    const bool complete =
        set(object, "path", json_string_nocheck(image->path)) && set(object, "rmse", number(c->rmse)) &&
        set(object, "mae", number(c->mae)) && set(object, "relmse", number(c->relmse)) &&
        set(object, "mean_luminance", number(c->mean_luminance)) &&
        set(object, "reference_mean_luminance", number(c->reference_mean_luminance)) &&
        set(object, "pixels", count(c->pixels)) && set(object, "masked", count(c->masked)) &&
        set(object, "non_finite", count(c->non_finite)) && set(object, "blocks", count(c->blocks)) &&
        set(object, "blocks_left_out", count(c->blocks_left_out)) &&
        set(object, "median_block_difference", number(c->median_block_difference)) &&
        set(object, "block_test", block_test_json(&c->test));
    if (complete) return object;
    json_decref(object);
    return NULL;
}

ca_status ca_stats_write_compare(const char *path, const char *reference, const ca_compared_image *images,
                                 size_t image_count, ca_error *error)
{
    json_set_alloc_funcs(allocate, ca_free);
    json_t *root = json_object(), *list = json_array();
    bool complete = set(root, "reference", json_string_nocheck(reference)) && list;
    for (size_t i = 0; i < image_count && complete; i++)
        complete = json_array_append_new(list, image_json(&images[i])) == 0;
    complete = set(root, "images", list) && complete;
    return write_file(path, root, complete, error);
}
