/* Files of renders with rays "auto": checkpoints, whose records can be repeated (auto_record.h).
 *
 * Layout: pieces as in film/part_stream.h. The magic; the format's number, CA_JOINED_PART_FORMAT; the file's size;
 * three texts (the settings that the image depends on, those that decide, and how the method was chosen); the record;
 * then all that a render has between two iterations, in the order of this file; a hash of all before it. Size: that
 * of a render in memory (auto_rays.h), and up to 70 KiB a thread. Reading trusts nothing: a file that is too short or
 * too long, damaged or of another version is refused (CA_ERROR_FORMAT). */
#include "base/file.h"
#include "base/memory.h"
#include "film/film.h"
#include "render/auto_file.h"
#include "render/auto_rays_state.h"
#include "render/kept_method.h"
#include "render/part_counts.h"

#include <errno.h>
#include <string.h>

enum { HEADER_BYTES = CA_PART_MAGIC_BYTES + 8 + 8 };

static const ca_part_layout film_layout = {.doubles = 11, .floats = 9, .integers = 1},
                            joined_layout = {.doubles = 15, .floats = 9, .integers = 1},
                            difference_layout = {.floats = 3}, known_layout = {.floats = 6},
                            weights_layout = {.doubles = 1},
                            /* of one camera path some quantities are not known */
                            means_layout = {.doubles = 5, .may_be_nan = true},
                            connected_layout = {.doubles = 7, .may_be_nan = true};
_Static_assert(sizeof(ca_film_pixel) == 128 && sizeof(ca_joined_pixel) == 160 && sizeof(ca_auto_known) == 24 &&
                   sizeof(ca_pair_means) == 40 && sizeof(ca_pair_connected_means) == 56,
               "what is written has no gaps");

/* What a render must have in common with a file to go on from it. */
typedef struct file_texts {
    char *settings, *choices;
    char *method; /* kept_method.h */
} file_texts;

static void exchange_texts(file_texts *texts, ca_part_exchange *x)
{
    ca_part_exchange_text(x, &texts->settings);
    ca_part_exchange_text(x, &texts->choices);
    ca_part_exchange_text(x, &texts->method);
}

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

static void exchange_doubles(ca_part_exchange *x, double *const values[], size_t count)
{
    for (size_t i = 0; i < count; i++) ca_part_exchange_double(x, values[i]);
}
#define DOUBLES(x, ...)                                                                                              \
    do {                                                                                                             \
        double *const list[] = {__VA_ARGS__};                                                                        \
        exchange_doubles((x), list, sizeof list / sizeof list[0]);                                                   \
    } while (0)

static void exchange_progress(ca_auto_progress *p, ca_part_exchange *x)
{
    ca_noise_looks *l = &p->looks;
    DOUBLES(x, &p->seconds, &p->camera_paths, &l->target, &l->next, &l->noise, &l->seconds_predicted,
            &l->first_predicted_seconds, &l->first_predicted_at);
    if (!(isfinite(p->seconds) && p->seconds >= 0.0 && isfinite(p->camera_paths) && p->camera_paths >= 0.0))
        x->good = false;
}

static void exchange_candidate(ca_auto_candidate *c, ca_part_exchange *x)
{
    DOUBLES(x, &c->light_paths, &c->camera_paths, &c->cost, &c->relative_variance, &c->seconds);
}

/* One of a range of numbers. */
static uint32_t exchange_choice(uint32_t value, uint32_t most, ca_part_exchange *x)
{
    ca_part_exchange_u32(x, &value);
    if (value > most) x->good = false;
    return value;
}

static void exchange_schedule(ca_auto_schedule *s, ca_part_exchange *x)
{
    s->count = exchange_choice(s->count, CA_AUTO_MOST_PHASES, x);
    s->done = exchange_choice(s->done, CA_AUTO_MOST_PHASES, x);
    DOUBLES(x, &s->begin, &s->ends[0], &s->ends[1], &s->ends[2]);
    if (s->done > s->count) x->good = false;
}

static void exchange_situation(ca_auto_situation *s, ca_part_exchange *x)
{
    exchange_progress(&s->progress, x);
    s->done = (ca_auto_step)exchange_choice((uint32_t)s->done, CA_AUTO_END, x);
    ca_part_exchange_u32(x, &s->reach);
    exchange_candidate(&s->best, x);
    exchange_candidate(&s->tried, x);
    ca_part_exchange_u32(x, &s->trials);
    ca_part_exchange_bool(x, &s->validated);
    exchange_schedule(&s->schedule, x);
    DOUBLES(x, &s->timed_light_paths, &s->share, &s->measured_variance, &s->law_error, &s->iteration_seconds,
            &s->plain_seconds);
}

/* Of a run: those of choices and predictions are made again. */
static void exchange_decision(ca_auto_decision *d, ca_part_exchange *x)
{
    ca_auto_run *run = &d->run;
    d->step = (ca_auto_step)exchange_choice((uint32_t)d->step, CA_AUTO_END, x);
    run->numbers = (ca_auto_source)exchange_choice((uint32_t)run->numbers, CA_AUTO_UNCHANGED, x);
    DOUBLES(x, &run->begin, &run->end, &run->share, &run->expected_variance);
    ca_part_exchange_u32(x, &run->least);
    ca_part_exchange_u32(x, &run->most);
    ca_part_exchange_bool(x, &run->measures);
    ca_part_exchange_bool(x, &run->predicts);
    exchange_schedule(&d->schedule, x);
    if (d->step != CA_AUTO_TRIAL && d->step != CA_AUTO_VALIDATE && d->step != CA_AUTO_PHASE) x->good = false;
    if (d->step == CA_AUTO_PHASE && d->schedule.done == 0) x->good = false;
}

static void exchange_counts(uint64_t counts[CA_PART_COUNTS], ca_part_exchange *x)
{
    for (int i = 0; i < CA_PART_COUNTS; i++) ca_part_exchange_u64(x, &counts[i]);
}

/* Of the whole render. */
static void exchange_render(ca_auto_rays *a, ca_part_exchange *x)
{
    exchange_progress(&a->progress, x);
    DOUBLES(x, &a->goal.samples, &a->goal.seconds);
    ca_part_exchange_u32(x, &a->look_iterations);
    DOUBLES(x, &a->look_seconds, &a->pilot_seconds, &a->pilot_work, &a->plain_seconds, &a->predicted_gain, &a->shares,
            &a->costs.iteration, &a->costs.light_path, &a->costs.camera_path, &a->costs.candidate);
    for (int h = 0; h < CA_PILOT_HALVES; h++)
        DOUBLES(x, &a->verdicts[h].gain, &a->verdicts[h].seconds_per_sample, &a->verdicts[h].iteration_seconds);
}

static void exchange_pilot_numbers(ca_auto_pilot *p, ca_part_exchange *x)
{
    ca_part_exchange_double(x, &p->seconds);
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        ca_part_exchange_double(x, &p->halves[h].plain_seconds);
        ca_part_exchange_u32(x, &p->halves[h].plain);
        ca_part_exchange_u32(x, &p->halves[h].gathering);
    }
}

static void exchange_run_numbers(ca_auto_rays *a, ca_auto_work_film *work, ca_part_exchange *x)
{
    exchange_situation(&a->situation, x);
    exchange_decision(&a->decision, x);
    DOUBLES(x, &work->passes_before, &work->seconds, &work->plain_seconds);
    ca_part_exchange_u32(x, &work->iterations);
    ca_part_exchange_u32(x, &work->gathering);
    ca_part_exchange_u32(x, &work->plain);
}

static void exchange_numbers(ca_auto_rays *a, ca_auto_place *place, uint64_t counts[CA_PART_COUNTS],
                             ca_part_exchange *x)
{
    place->stage = (ca_auto_stage)exchange_choice((uint32_t)place->stage, CA_AUTO_AT_RUN, x);
    exchange_render(a, x);
    exchange_counts(counts, x);
    if (place->stage == CA_AUTO_AT_RUN)
        exchange_run_numbers(a, place->work, x);
    else
        exchange_pilot_numbers(place->pilot, x);
}

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

static void exchange_film(const ca_film *film, ca_part_exchange *x)
{
    ca_part_exchange_array(x, film->pixels, (size_t)film->width * film->height, film_layout);
}

static void exchange_joined(const ca_joined_film *joined, ca_part_exchange *x)
{
    ca_part_exchange_array(x, joined->pixels, joined->count, joined_layout);
}

static void exchange_pairs(const ca_pair_film *pairs, ca_part_exchange *x)
{
    const size_t pixels = (size_t)pairs->width * pairs->height;
    ca_part_exchange_array(x, pairs->means, pixels, means_layout);
    if (pairs->connected_means) ca_part_exchange_array(x, pairs->connected_means, pixels, connected_layout);
    for (uint32_t i = 0; i < pairs->other_count; i++) exchange_pairs(&pairs->others[i], x);
}

static void exchange_coefficients(ca_noise_coefficients *c, ca_part_exchange *x)
{
    DOUBLES(x, &c->pair, &c->camera, &c->light, &c->connected, &c->connected_pair, &c->connected_camera,
            &c->connected_light);
    if (!isfinite(ca_noise_variance(c, 2.0, 2.0))) x->good = false;
}

static void exchange_node(ca_auto_node *node, const ca_auto_node *before, ca_part_exchange *x)
{
    DOUBLES(x, &node->light_paths, &node->pairs);
    exchange_coefficients(&node->mean, x);
    exchange_coefficients(&node->objective, x);
    if (!(node->light_paths > (before ? before->light_paths : 0.0) && node->pairs > 0.0)) x->good = false;
}

static void exchange_nodes(ca_auto_nodes *nodes, ca_part_exchange *x)
{
    ca_part_exchange_bool(x, &nodes->weighted);
    nodes->count = exchange_choice(nodes->count, CA_AUTO_MOST_NODES, x);
    x->good = x->good && nodes->count > 0;
    DOUBLES(x, &nodes->luminance, &nodes->pairs);
    for (uint32_t i = 0; i < nodes->count && x->good; i++)
        exchange_node(&nodes->items[i], i > 0 ? &nodes->items[i - 1] : NULL, x);
    ca_part_exchange_array(x, nodes->weights, nodes->pixels, weights_layout);
}

static void exchange_known(ca_auto_rays *a, ca_part_exchange *x)
{
    if (a->known)
        ca_part_exchange_array(x, a->known, ca_auto_pixels(a), known_layout);
    else
        exchange_nodes(&a->nodes, x);
}

static void exchange_pixels(ca_auto_rays *a, const ca_auto_place *place, ca_part_exchange *x)
{
    if (place->stage != CA_AUTO_AT_RAMP) {
        exchange_joined(&a->pilot.mean, x);
        ca_part_exchange_array(x, a->pilot.difference, a->pilot.mean.count, difference_layout);
    }
    if (place->stage == CA_AUTO_AT_RUN) {
        exchange_known(a, x);
        ca_ray_times_exchange(a->times, x);
        exchange_joined(&a->render, x);
        exchange_film(&place->work->film, x);
        if (place->work->pairs.means) exchange_pairs(&place->work->pairs, x);
        return;
    }
    for (int h = 0; h < CA_PILOT_HALVES; h++) {
        exchange_film(&place->pilot->halves[h].film, x);
        exchange_pairs(&place->pilot->halves[h].pairs, x);
        ca_ray_times_exchange(place->pilot->halves[h].times, x);
    }
}

/* ---- Writing --------------------------------------------------------------------------------------------------- */

static void exchange_all(ca_auto_rays *a, ca_auto_place *place, uint64_t counts[CA_PART_COUNTS], ca_part_exchange *x)
{
    file_texts texts = {a->kept.settings, a->kept.choices, a->kept.method};
    exchange_texts(&texts, x);
    ca_auto_record_exchange(&a->record, ca_auto_pixels(a), x);
    exchange_numbers(a, place, counts, x);
    exchange_pixels(a, place, x);
}

/* false: what cannot be read again was to be written. */
static bool put_file(ca_auto_rays *a, ca_auto_place *place, uint64_t counts[CA_PART_COUNTS], ca_part_writer *writer)
{
    ca_part_exchange count = ca_part_exchange_count(), x = ca_part_exchange_write(writer);
    exchange_all(a, place, counts, &count);
    ca_part_put(writer, ca_part_magic, sizeof ca_part_magic);
    ca_part_put_u64(writer, CA_JOINED_PART_FORMAT);
    ca_part_put_u64(writer, HEADER_BYTES + count.bytes + CA_PART_HASH_BYTES);
    exchange_all(a, place, counts, &x);
    ca_part_put_hash(writer);
    return x.good || !writer->good;
}

ca_status ca_auto_file_write(ca_auto_rays *a, const ca_auto_place *place, const char *path, ca_error *error)
{
    uint64_t counts[CA_PART_COUNTS];
    ca_auto_place at = *place;
    ca_render_statistics counted = a->counts;
    ca_file_writer file;
    if (place->workers && place->workers->list) ca_workers_count(place->workers, &counted);
    ca_part_counts_of(&counted, counts);
    ca_auto_weights(a, a->record.weights);
    CA_TRY(ca_file_create(&file, path, error));
    ca_part_writer writer = ca_part_writer_start(file.stream);
    if (!put_file(a, &at, counts, &writer)) {
        ca_file_abandon(&file);
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: numbers of this render are out of range", path);
    }
    return ca_file_commit_durably(&file, error); /* a write that failed fails there */
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

static ca_status fail_damaged(FILE *stream, const char *path, ca_error *error)
{
    const int reason = ca_part_failure(stream);
    if (reason == ENOMEM) return ca_fail_memory(error, path);
    if (reason) return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot read: %s", path, strerror(reason));
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is damaged", path);
}

/* Where the method has no numbers of rays, the render was too short to choose them or several ranks chose them once,
 * there are passes. */
static ca_status fail_format(const char *path, uint64_t format, ca_error *error)
{
    if (format == CA_PASS_PART_FORMAT)
        return ca_fail(error, CA_ERROR_FORMAT, NULL,
                       "%s: a part file of passes, not a record of rays \"auto\": merging it makes its image",
                       path);
    return ca_part_fail_format(path, format, CA_JOINED_PART_FORMAT, error);
}

static ca_status check_size(FILE *stream, const char *path, uint64_t size, ca_error *error)
{
    uint64_t told;
    errno = 0;
    if (!ca_part_get_u64(stream, &told)) {
        if (ca_part_failure(stream)) return fail_damaged(stream, path, error);
        told = UINT64_MAX;
    }
    if (told > size)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is cut off after %llu bytes", path,
                       (unsigned long long)size);
    if (told != size || !ca_part_check_hash(stream, size)) return fail_damaged(stream, path, error);
    return CA_OK;
}

/* Opens it, and checks all of its bytes. On failure nothing is open. */
static ca_status open_file(const char *path, FILE **stream, uint64_t *size, ca_error *error)
{
    uint64_t format;
    CA_TRY(ca_part_open(path, stream, size, &format, error));
    const ca_status status = format == CA_JOINED_PART_FORMAT ? check_size(*stream, path, *size, error)
                                                             : fail_format(path, format, error);
    if (status == CA_OK) return CA_OK;
    fclose(*stream);
    *stream = NULL;
    return status;
}

static ca_status read_texts(file_texts *texts, ca_part_exchange *x, const char *path, ca_error *error)
{
    *texts = (file_texts){NULL, NULL, NULL};
    exchange_texts(texts, x);
    return x->good ? CA_OK : fail_damaged(x->stream, path, error);
}

static void free_texts(file_texts *texts)
{
    ca_free(texts->settings);
    ca_free(texts->choices);
    ca_free(texts->method);
}

ca_status ca_auto_file_use_method(ca_render_plan *plan, const char *path, ca_error *error)
{
    FILE *stream;
    uint64_t size;
    file_texts texts;
    CA_TRY(open_file(path, &stream, &size, error));
    ca_part_exchange x = ca_part_exchange_read(stream);
    ca_status status = read_texts(&texts, &x, path, error);
    if (status == CA_OK) status = ca_kept_method_use(texts.method, texts.settings, path, plan, error);
    free_texts(&texts);
    fclose(stream);
    return status;
}

/* `choices` may be NULL: anything may have decided. */
static ca_status check_texts(ca_part_exchange *x, const char *path, const char *settings, const char *choices,
                             ca_error *error)
{
    file_texts theirs;
    ca_status status = read_texts(&theirs, x, path, error);
    if (status == CA_OK) status = ca_checkpoint_compare(path, theirs.settings, settings, error);
    if (status == CA_OK && choices) status = ca_checkpoint_compare(path, theirs.choices, choices, error);
    free_texts(&theirs);
    return status;
}

/* Are all pixels' numbers the same where paths connect? */
static bool numbers_fit(const ca_auto_rays *a, const ca_auto_record *record)
{
    bool fit = true;
    for (uint32_t g = 0; g < record->count; g++) fit = fit && !(ca_auto_connects(a) && record->groups[g].map);
    return fit;
}

ca_status ca_auto_script_read(ca_auto_rays *a, const char *path, ca_error *error)
{
    ca_auto_record *record = &a->script;
    FILE *stream;
    uint64_t size;
    CA_TRY(open_file(path, &stream, &size, error));
    ca_part_exchange x = ca_part_exchange_read(stream);
    ca_status status = check_texts(&x, path, a->kept.settings, NULL, error);
    if (status == CA_OK) {
        ca_auto_record_exchange(record, ca_auto_pixels(a), &x);
        if (!x.good || !numbers_fit(a, record)) status = fail_damaged(stream, path, error);
    }
    if (status == CA_OK && (record->count == 0 || record->groups[0].iterations < CA_PILOT_HALVES))
        status = ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s: there are no iterations to repeat", path);
    fclose(stream);
    return status;
}

/* ---- Going on -------------------------------------------------------------------------------------------------- */

/* What follows from the record: all but the group at work is done. */
static void note_group(ca_auto_rays *a, const ca_auto_group *group, bool at_work)
{
    ca_auto_use_group(a, group);
    a->iterations += group->iterations;
    a->next.largest += (double)group->iterations * a->numbers.most;
    if (group->kind == CA_AUTO_GROUP_RUN) {
        a->render_iterations += group->iterations;
        a->runs += !at_work;
    } else {
        ca_pilot_group *to = group->kind == CA_AUTO_GROUP_RAMP ? &a->ramp : &a->ordinary;
        to->numbers = (ca_pilot_numbers){group->light_paths, group->camera_paths};
        for (uint32_t i = 0; i < group->iterations; i++) *to = ca_pilot_count(*to);
    }
    if (at_work) return;
    for (size_t p = 0; p < ca_auto_pixels(a); p++)
        a->next.camera_path[p] += group->iterations * a->numbers.camera_paths[p];
    a->next.light_path += (uint64_t)group->iterations * group->light_paths;
}

static void note_record(ca_auto_rays *a, ca_auto_stage stage)
{
    for (uint32_t g = 0; g < a->record.count; g++)
        note_group(a, &a->record.groups[g], g + 1 == a->record.count && stage != CA_AUTO_AT_RAMP);
}

static bool has_samples(const ca_film *film, uint32_t samples)
{
    for (size_t p = 0; p < (size_t)film->width * film->height; p++)
        if (film->pixels[p].samples != samples) return false;
    return true;
}

/* Every sample of the films is one of an iteration. */
static bool films_fit(const ca_auto_rays *a, const ca_auto_place *place)
{
    if (place->stage == CA_AUTO_AT_RUN) return has_samples(&place->work->film, place->work->iterations);
    const ca_auto_half *halves = place->pilot->halves;
    const uint32_t all = place->stage == CA_AUTO_AT_RAMP ? a->ramp.iterations : a->ordinary.iterations;
    return has_samples(&halves[0].film, all - all / 2) && has_samples(&halves[1].film, all / 2);
}

static bool record_fits(ca_auto_rays *a, const ca_auto_place *place)
{
    const ca_auto_group *last = ca_auto_record_last(&a->record);
    if (!last || (int)last->kind != (int)place->stage || !numbers_fit(a, &a->record)) return false;
    return place->stage != CA_AUTO_AT_RUN ||
           (place->work->iterations == last->iterations && a->decision.run.measures == last->measures);
}

/* Before films and estimates, which are made for these numbers; false: they cannot be. */
static bool note_place(ca_auto_rays *a, const ca_auto_place *place)
{
    if (!record_fits(a, place)) return false;
    note_record(a, place->stage);
    return place->stage == CA_AUTO_AT_RAMP || a->ordinary.numbers.light_paths > 0;
}

static ca_status create_films(ca_auto_rays *a, const ca_auto_place *place, ca_error *error)
{
    CA_TRY(ca_halved_film_create(&a->pilot, &a->frame, error));
    if (place->stage != CA_AUTO_AT_RUN) {
        CA_TRY(ca_auto_pilot_create(a, place->pilot, error));
        return place->stage == CA_AUTO_AT_ORDINARY ? ca_auto_pilot_create_pairs(a, place->pilot, error) : CA_OK;
    }
    CA_TRY(ca_auto_known_create(a, error));
    CA_TRY(ca_ray_times_create(&a->times, a->frame.width, a->frame.height, a->plan->threads, error));
    CA_TRY(ca_joined_film_create(&a->render, &a->frame, error));
    place->work->run = &a->decision.run;
    return ca_auto_work_create(a, place->work, error);
}

static ca_status read_state(ca_auto_rays *a, ca_auto_place *place, const char *path, ca_part_exchange *x,
                            ca_error *error)
{
    uint64_t counts[CA_PART_COUNTS] = {0};
    const double target = a->progress.looks.target;
    const ca_auto_goal goal = a->goal;
    ca_auto_record_exchange(&a->record, ca_auto_pixels(a), x);
    exchange_numbers(a, place, counts, x);
    if (!x->good || !note_place(a, place)) return fail_damaged(x->stream, path, error);
    CA_TRY(create_films(a, place, error));
    exchange_pixels(a, place, x);
    if (!x->good || !films_fit(a, place)) return fail_damaged(x->stream, path, error);
    ca_part_counts_fill(counts, &a->counts);
    a->progress.looks.target = a->situation.progress.looks.target = target;
    a->goal.samples = ca_auto_limit_to(goal.samples, a->goal.samples, a->progress.camera_paths);
    a->goal.seconds = ca_auto_limit_to(goal.seconds, a->goal.seconds, a->progress.seconds);
    return CA_OK;
}

ca_status ca_auto_file_read(ca_auto_rays *a, ca_auto_place *place, const char *path, ca_error *error)
{
    FILE *stream;
    uint64_t size;
    CA_TRY(open_file(path, &stream, &size, error));
    ca_part_exchange x = ca_part_exchange_read(stream);
    x.bytes = HEADER_BYTES;
    ca_status status = check_texts(&x, path, a->kept.settings, a->kept.choices, error);
    if (status == CA_OK) status = read_state(a, place, path, &x, error);
    if (status == CA_OK && x.bytes + CA_PART_HASH_BYTES != size) status = fail_damaged(stream, path, error);
    fclose(stream);
    return status;
}
