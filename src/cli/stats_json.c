#include "cli/stats_json.h"

#include "cli/json_values.h"
#include "cli/settings_json.h"
#include "integrator/integrator.h"
#include "path/technique.h"

#include <stdio.h>

static json_t *count(uint64_t value) { return json_integer((json_int_t)value); }

/* Steals the reference, as jansson's own *_new calls do; a NULL value or object counts as a failure. */
static bool set(json_t *object, const char *key, json_t *value)
{
    return json_object_set_new(object, key, value) == 0;
}

/* By technique; "film": those that only the film's check found. */
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

/* Those rendered, passes or blocks, half open; null: there are none of the kind. */
static json_t *range_json(const uint64_t numbers[2])
{
    if (numbers[1] == 0) return json_null();
    json_t *range = json_array();
    bool complete = range != NULL;
    for (int i = 0; i < 2 && complete; i++) complete = json_array_append_new(range, count(numbers[i])) == 0;
    if (complete) return range;
    json_decref(range);
    return NULL;
}

/* Numbers of rays chosen or read from a file; null of other renders. */
static json_t *rays_json(const ca_rays_statistics *r)
{
    if (r->light_paths == 0) return json_null();
    json_t *object = json_object();
    const bool had_pilot = r->pilot_seconds > 0.0;
    const bool complete = set(object, "light_paths", count(r->light_paths)) &&
                          set(object, "camera_paths", ca_json_number(r->camera_paths)) &&
                          set(object, "phases", count(r->phases)) &&
                          set(object, "pilot_seconds", had_pilot ? ca_json_number(r->pilot_seconds) : json_null()) &&
                          set(object, "predicted_gain", ca_json_number(r->predicted_gain)) &&
                          set(object, "iteration_seconds", ca_json_number(r->iteration_seconds)) &&
                          set(object, "light_path_seconds", ca_json_number(r->light_path_seconds)) &&
                          set(object, "camera_path_seconds", ca_json_number(r->camera_path_seconds)) &&
                          set(object, "candidate_seconds", ca_json_number(r->candidate_seconds));
    if (complete) return object;
    json_decref(object);
    return NULL;
}

/* Null: the method has none. */
static json_t *splats_json(const ca_tried_method *t)
{
    const ca_integrator_type *type = ca_integrator_of(t->name);
    return type && type->rules && type->rules->splat ? json_boolean(!t->no_splats) : json_null();
}

static json_t *trial_json(const ca_tried_method *t)
{
    json_t *object = json_object();
    const bool complete = set(object, "integrator", json_string(t->name)) &&
                          set(object, "splats", splats_json(t)) &&
                          set(object, "guided", json_boolean(t->guided)) &&
                          set(object, "light_paths", ca_json_number(t->light_paths)) &&
                          set(object, "iterations", count(t->iterations)) &&
                          set(object, "variance", ca_json_number(t->variance)) &&
                          set(object, "dot_variance", ca_json_number(t->dot_variance)) &&
                          set(object, "seconds", ca_json_number(t->seconds));
    if (complete) return object;
    json_decref(object);
    return NULL;
}

/* Which method integrator `auto` has chosen, and why; null of other renders. */
static json_t *method_json(const ca_method_statistics *m)
{
    if (m->reason[0] == '\0') return json_null();
    json_t *object = json_object(), *trials = json_array();
    bool complete = trials != NULL;
    for (uint32_t i = 0; i < m->trial_count && complete; i++)
        complete = json_array_append_new(trials, trial_json(&m->trials[i])) == 0;
    complete = complete && set(object, "reason", json_string(m->reason)) &&
               set(object, "seconds", ca_json_number(m->seconds)) && json_object_set(object, "trials", trials) == 0;
    json_decref(trials);
    if (complete) return object;
    json_decref(object);
    return NULL;
}

/* The first prediction of the time to the noise target, and when it was made; null: there was none. */
static json_t *prediction_json(const ca_render_statistics *s)
{
    if (s->first_predicted_seconds <= 0.0) return json_null();
    json_t *object = json_object();
    if (set(object, "seconds", ca_json_number(s->first_predicted_seconds)) &&
        set(object, "at", ca_json_number(s->first_predicted_at)))
        return object;
    json_decref(object);
    return NULL;
}

/* Of one iteration's samples, which need two iterations. */
static json_t *deviation_json(const ca_render_statistics *s)
{
    return s->iterations < 2 ? json_null() : ca_json_number(s->mean_standard_deviation);
}

/* What the scene says and was read otherwise. */
static json_t *notes_json(const ca_render_statistics *s)
{
    json_t *list = json_array();
    bool complete = list != NULL;
    for (size_t i = 0; i < s->note_count && complete; i++)
        complete = json_array_append_new(list, ca_json_text(s->notes[i])) == 0;
    if (complete) return list;
    json_decref(list);
    return NULL;
}

static bool set_render(json_t *root, const ca_image_layers *image, const ca_render_statistics *s)
{
    return ca_settings_json_set(root, image, s->seed) && set(root, "seconds", ca_json_number(s->seconds)) &&
           set(root, "iterations", count(s->iterations)) && set(root, "blocks", range_json(s->blocks)) &&
           set(root, "passes", range_json(s->passes)) && set(root, "resumed", count(s->passes_resumed)) &&
           set(root, "ranks", s->ranks > 0 ? count(s->ranks) : json_null()) &&
           set(root, "samples_per_pixel", ca_json_number(s->samples_per_pixel)) &&
           set(root, "light_paths", count(s->light_paths)) && set(root, "camera_paths", count(s->camera_paths)) &&
           set(root, "rays", count(s->rays)) && set(root, "shadow_rays", count(s->shadow_rays)) &&
           set(root, "photons", count(s->photons)) && set(root, "photons_tested", count(s->photons_tested)) &&
           set(root, "merges", count(s->merges)) && set(root, "peak_memory_bytes", count(s->peak_memory_bytes)) &&
           set(root, "mean_luminance", ca_json_number(s->mean_luminance)) &&
           set(root, "mean_standard_deviation", deviation_json(s)) &&
           set(root, "noise_percent", s->noise_percent < 0.0 ? json_null() : ca_json_number(s->noise_percent)) &&
           set(root, "confidence_marked", s->has_confidence ? ca_json_number(s->confidence_marked) : json_null()) &&
           set(root, "confidence_widened", s->has_confidence ? ca_json_number(s->confidence_widened) : json_null()) &&
           set(root, "non_finite", non_finite_json(s)) && set(root, "interrupted", json_boolean(s->interrupted)) &&
           set(root, "first_prediction", prediction_json(s)) &&
           set(root, "numbers_of_rays", rays_json(&s->numbers_of_rays)) &&
           set(root, "method", method_json(&s->method)) && set(root, "notes", notes_json(s));
}

/* What lies between ranges of passes, each half open. */
static json_t *gaps_json(const ca_pass_range *ranges, size_t range_count)
{
    json_t *list = json_array();
    bool complete = list != NULL;
    for (size_t i = 1; i < range_count && complete; i++) {
        const uint64_t gap[2] = {ranges[i - 1].end, ranges[i].begin};
        complete = json_array_append_new(list, range_json(gap)) == 0;
    }
    if (complete) return list;
    json_decref(list);
    return NULL;
}

ca_status ca_stats_write_render(const char *path, const ca_image_layers *image, const ca_render_statistics *s,
                                const ca_pass_range *ranges, size_t range_count, ca_error *error)
{
    ca_json_begin();
    json_t *root = json_object();
    const bool known = s->passes[1] > 0;
    const bool complete = set_render(root, image, s) &&
                          set(root, "passes_missing", known ? gaps_json(ranges, range_count) : json_null());
    return ca_json_write(path, root, complete, error);
}

/* ---- Noise ----------------------------------------------------------------------------------------------------- */

/* `value` if it is complete; else it is released, and NULL. */
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
                             set(object, "light", count(s->negative_light)) &&
                             set(object, "pair", count(s->negative_pair)) &&
                             set(object, "connect", count(s->negative_connect)));
}

/* `measured`: with the sample variance. */
static json_t *summary_json(const ca_noise_summary *s, bool measured)
{
    json_t *object = json_object();
    bool complete =
        set(object, "pixels", count(s->pixels)) && set(object, "mean_luminance", ca_json_number(s->luminance)) &&
        set(object, "predicted_rms", ca_json_number(s->predicted_rms)) &&
        set(object, "camera", ca_json_number(s->camera_rms)) && set(object, "light", ca_json_number(s->light_rms)) &&
        set(object, "pair", ca_json_number(s->pair_rms)) && set(object, "connect", ca_json_number(s->connect_rms)) &&
        set(object, "predicted_variance", ca_json_number(s->predicted)) &&
        set(object, "camera_variance", ca_json_number(s->camera)) &&
        set(object, "light_variance", ca_json_number(s->light)) &&
        set(object, "pair_variance", ca_json_number(s->pair)) &&
        set(object, "connect_variance", ca_json_number(s->connect)) &&
        set(object, "negative", negative_json(s, measured));
    if (measured)
        complete = complete && set(object, "measured_rms", ca_json_number(s->measured_rms)) &&
                   set(object, "measured_variance", ca_json_number(s->measured));
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

/* Sets `key`, in seconds of one processor, and its standard error; null: not measurable, or there was none. */
static bool set_time(json_t *object, const char *key, double seconds, double error)
{
    char error_key[32];
    snprintf(error_key, sizeof error_key, "%s_error", key);
    return set(object, key, ca_noise_is_measured(seconds, error) ? ca_json_number(seconds) : json_null()) &&
           set(object, error_key, ca_json_number(error));
}

static json_t *times_json(const ca_noise_times *t)
{
    json_t *object = json_object();
    return whole(object, set(object, "light_paths", count(t->light_paths)) &&
                             set_time(object, "iteration", t->iteration, t->iteration_error) &&
                             set_time(object, "light_path", t->light_path, t->light_path_error) &&
                             set_time(object, "camera_path", t->camera_path, t->camera_path_error) &&
                             set_time(object, "candidate", t->candidate, t->candidate_error) &&
                             set(object, "segments_per_camera_path", ca_json_number(t->segments_per_camera_path)) &&
                             set(object, "candidates_per_pair", ca_json_number(t->candidates_per_pair)));
}

static json_t *numbers_json(const ca_noise_numbers *n)
{
    json_t *object = json_object();
    return whole(object, set(object, "light_paths", count(n->light_paths)) &&
                             set(object, "camera_paths", ca_json_number(n->camera_paths)) &&
                             set(object, "variance", ca_json_number(n->variance)) &&
                             set(object, "seconds", ca_json_number(n->seconds)));
}

static json_t *recommendation_json(const ca_noise_report *report)
{
    const ca_noise_recommendation *r = &report->recommendation;
    json_t *object = json_object();
    return whole(object,
                 set(object, "objective", json_string_nocheck(report->objective ? report->objective : "mean")) &&
                     set(object, "best", numbers_json(&r->best)) &&
                     set(object, "uniform", numbers_json(&r->uniform)) &&
                     set(object, "given", numbers_json(&r->given)) &&
                     set(object, "gain_over_given", ca_json_number(r->gain_over_given)) &&
                     set(object, "gain_over_uniform", ca_json_number(r->gain_over_uniform)) &&
                     set(object, "fewest_camera_paths", count(r->fewest_camera_paths)) &&
                     set(object, "most_camera_paths", count(r->most_camera_paths)));
}

ca_status ca_stats_write_noise(const char *path, const ca_image_layers *image, const ca_noise_report *report,
                               ca_error *error)
{
    ca_json_begin();
    json_t *root = json_object();
    const bool recommends = ca_noise_recommends(report);
    ca_render_statistics statistics = report->statistics;
    statistics.interrupted = statistics.interrupted || report->recommendation.interrupted;
    const bool complete = set_render(root, image, &statistics) &&
                          set(root, "per_iteration", counts_json(&report->measured)) &&
                          set_averages(root, &report->measured, report->has_roi, true) &&
                          set(root, "predict", predictions_json(report)) &&
                          set(root, "times", recommends ? times_json(&report->recommendation.times) : json_null()) &&
                          set(root, "recommendation", recommends ? recommendation_json(report) : json_null());
    return ca_json_write(path, root, complete, error);
}

/* ---- Comparisons ----------------------------------------------------------------------------------------------- */

static json_t *block_test_json(const ca_block_test *test)
{
    if (!test->done) return json_null();
    json_t *object = json_object();
    const bool complete = set(object, "blocks", count(test->blocks)) &&
                          set(object, "rejected", count(test->rejected)) &&
                          set(object, "blocks_untested", count(test->blocks_untested)) &&
                          set(object, "p_value", ca_json_number(test->p_value)) &&
                          set(object, "blocks_with_noise", count(test->blocks_with_noise)) &&
                          set(object, "detectable_bias", ca_json_number(test->detectable_bias)) &&
                          set(object, "reference_exact", json_boolean(test->reference_exact));
    if (complete) return object;
    json_decref(object);
    return NULL;
}

static json_t *exposures_json(const ca_flip_exposures *e)
{
    if (e->count == 0) return json_null();
    json_t *object = json_object();
    return whole(object, set(object, "start", ca_json_number(e->start)) &&
                             set(object, "stop", ca_json_number(e->stop)) && set(object, "count", count(e->count)));
}

static bool set_metrics(json_t *object, const ca_compared_image *image)
{
    const ca_comparison *c = &image->comparison;
    const ca_image_metrics *m = &image->metrics;
    return set(object, "rmse", ca_json_number(c->rmse)) && set(object, "mae", ca_json_number(c->mae)) &&
           set(object, "relmse", ca_json_number(c->relmse)) && set(object, "smape", ca_json_number(c->smape)) &&
           set(object, "ssim", ca_json_number(m->ssim)) &&
           set(object, "flip", ca_json_number(image->flip_is_hdr ? m->flip_hdr : m->flip_ldr)) &&
           set(object, "flip_ldr", ca_json_number(m->flip_ldr)) &&
           set(object, "flip_hdr", ca_json_number(m->flip_hdr)) &&
           set(object, "flip_exposures", exposures_json(&m->exposures));
}

static json_t *image_json(const ca_compared_image *image)
{
    const ca_comparison *c = &image->comparison;
    json_t *object = json_object();
    return whole(object, set(object, "path", ca_json_text(image->path)) && set_metrics(object, image) &&
                             set(object, "mean_luminance", ca_json_number(c->mean_luminance)) &&
                             set(object, "reference_mean_luminance", ca_json_number(c->reference_mean_luminance)) &&
                             set(object, "pixels", count(c->pixels)) && set(object, "masked", count(c->masked)) &&
                             set(object, "non_finite", count(c->non_finite)) &&
                             set(object, "blocks", count(c->blocks)) &&
                             set(object, "blocks_left_out", count(c->blocks_left_out)) &&
                             set(object, "median_block_difference", ca_json_number(c->median_block_difference)) &&
                             set(object, "block_test", block_test_json(&c->test)));
}

static json_t *metric_settings_json(const ca_metric_settings *s)
{
    json_t *object = json_object();
    return whole(object, set(object, "tone", json_string(ca_tone_name(s->tone))) &&
                             set(object, "exposure", ca_json_number(s->exposure)) &&
                             set(object, "ssim_window", count(s->ssim.window)) &&
                             set(object, "ssim_sigma", ca_json_number(s->ssim.sigma)) &&
                             set(object, "ssim_range", ca_json_number(s->ssim.range)) &&
                             set(object, "ssim_k1", ca_json_number(s->ssim.k1)) &&
                             set(object, "ssim_k2", ca_json_number(s->ssim.k2)) &&
                             set(object, "flip_ppd", ca_json_number(s->pixels_per_degree)) &&
                             set(object, "flip_tone", json_string(ca_tone_name(s->flip_tone))));
}

ca_status ca_stats_write_compare(const char *path, const char *reference, const ca_metric_settings *settings,
                                 const ca_compared_image *images, size_t image_count, ca_error *error)
{
    ca_json_begin();
    json_t *root = json_object(), *list = json_array();
    bool complete = set(root, "reference", ca_json_text(reference)) &&
                    set(root, "settings", metric_settings_json(settings)) && list;
    for (size_t i = 0; i < image_count && complete; i++)
        complete = json_array_append_new(list, image_json(&images[i])) == 0;
    complete = set(root, "images", list) && complete;
    return ca_json_write(path, root, complete, error);
}
