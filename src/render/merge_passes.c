#include "render/merge_passes.h"

#include "base/memory.h"
#include "base/processors.h"
#include "base/text.h"
#include "film/interval_layers.h"
#include "film/pass_part.h"
#include "render/part_counts.h"
#include "render/part_settings.h"
#include "render/ray_file.h"
#include "render/record.h"
#include "render/replicates.h"

#include <assert.h>
#include <string.h>

/* A range, and where it came from: the file's place among all. */
typedef struct merged_range {
    const char *path;
    size_t file;
    ca_pass_range range;
} merged_range;

typedef struct merge {
    ca_film film;
    ca_pass_film_desc film_desc;
    ca_pass_part sum; /* its ranges come last; scene path, record and threads are those of the first passes */
    const char *first_path;
    merged_range *ranges; /* owned; in the order of passes */
    size_t range_count, range_capacity, file_count;
} merge;

#define RANGE(r) (unsigned long long)(r).begin, (unsigned long long)(r).end

/* ---- Do they belong together? ---------------------------------------------------------------------------------- */

static ca_status check_same(const merge *m, const ca_pass_reader *reader, ca_error *error)
{
    const char *a = m->sum.settings, *b = reader->part.settings;
    if (!ca_part_settings_equal(&a, &b)) return ca_part_settings_fail(m->first_path, a, reader->path, b, error);
    if (ca_pass_film_desc_equal(&m->film_desc, &reader->film)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%.400s and %.400s have different films", m->first_path,
                   reader->path);
}

/* Of two that follow each other. */
static ca_status check_apart(const merged_range *a, const merged_range *b, ca_error *error)
{
    if (a->range.end <= b->range.begin) return CA_OK;
    const bool swapped = b->file < a->file;
    const merged_range *first = swapped ? b : a, *second = swapped ? a : b;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "%.300s with the passes %llu:%llu and %.300s with %llu:%llu overlap", first->path,
                   RANGE(first->range), second->path, RANGE(second->range));
}

static ca_status check_replicates(const merge *m, const char *path, ca_pass_range range, ca_error *error)
{
    const uint32_t each = m->film_desc.replicate_samples;
    if (each <= 1 || (range.begin % each == 0 && range.end % each == 0)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "%.400s with the passes %llu:%llu ends in the middle of a replicate of %u passes: it adds up with "
                   "no other part",
                   path, RANGE(range), each);
}

/* Those of a file, which are in order, in among the others, from behind. */
static ca_status add_ranges(merge *m, const ca_pass_reader *reader, ca_error *error)
{
    const ca_pass_part *part = &reader->part;
    const size_t count = m->range_count + part->range_count, file = m->file_count++;
    size_t before = m->range_count, left = part->range_count;
    merged_range *ranges = ca_array_grow(m->ranges, &m->range_capacity, count, sizeof *ranges);
    if (!ranges) return ca_fail_memory(error, "the part files");
    m->ranges = ranges;
    while (left > 0) {
        const ca_pass_range last = part->ranges[left - 1];
        merged_range *to = &m->ranges[before + left - 1];
        if (before > 0 && m->ranges[before - 1].range.begin > last.begin)
            *to = m->ranges[--before];
        else
            *to = (merged_range){reader->path, file, last}, left--;
    }
    m->range_count = count;
    for (size_t i = 1; i < count; i++) CA_TRY(check_apart(&m->ranges[i - 1], &m->ranges[i], error));
    return CA_OK;
}

/* Ranges that follow each other become one. */
static ca_status join_ranges(merge *m, ca_error *error)
{
    ca_pass_part *sum = &m->sum;
    assert(m->ranges && m->range_count > 0); /* a file has one at least */
    ca_free(sum->ranges);
    sum->range_count = 0;
    sum->ranges = ca_alloc(m->range_count, sizeof *sum->ranges);
    if (!sum->ranges) return ca_fail_memory(error, "the part files");
    for (size_t i = 0; i < m->range_count; i++) {
        const ca_pass_range range = m->ranges[i].range;
        ca_pass_range *last = sum->range_count > 0 ? &sum->ranges[sum->range_count - 1] : NULL;
        if (last && last->end == range.begin)
            last->end = range.end;
        else
            sum->ranges[sum->range_count++] = range;
    }
    return CA_OK;
}

static ca_status check_complete(const merge *m, ca_error *error)
{
    const merged_range *first = &m->ranges[0];
    if (first->range.begin > 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "an image needs all passes from 0, but %.400s begins at pass %llu: without them only a part "
                       "file can be made",
                       first->path, (unsigned long long)first->range.begin);
    for (size_t i = 1; i < m->range_count; i++) {
        const merged_range *a = &m->ranges[i - 1], *b = &m->ranges[i];
        const ca_pass_range gap = {a->range.end, b->range.begin};
        if (gap.begin < gap.end)
            return ca_fail(
                error, CA_ERROR_ARGUMENT, NULL,
                "the passes %llu:%llu between %.300s and %.300s are missing: without them only a part file "
                "can be made",
                RANGE(gap), a->path, b->path);
    }
    return CA_OK;
}

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

static void swap_texts(char **a, char **b)
{
    char *const text = *a;
    *a = *b;
    *b = text;
}

static void add_totals(merge *m, ca_pass_part *part)
{
    ca_pass_part *sum = &m->sum;
    for (int i = 0; i < CA_PART_COUNTS; i++) sum->counts[i] += part->counts[i];
    sum->seconds += part->seconds;
    sum->looks = (ca_pass_looks){0}; /* nobody has looked at the noise of them together */
    if (part->ranges[0].begin >= sum->ranges[0].begin) return;
    sum->ranges[0].begin = part->ranges[0].begin;
    sum->threads = part->threads;
    swap_texts(&sum->scene_path, &part->scene_path);
    swap_texts(&sum->record, &part->record);
}

static ca_status take_first(merge *m, ca_pass_reader *reader, ca_error *error)
{
    m->first_path = reader->path;
    m->film_desc = reader->film;
    CA_TRY(ca_pass_film_create(&m->film, &m->film_desc, error));
    CA_TRY(ca_pass_reader_add(reader, &m->film, true, error));
    m->sum = reader->part;
    reader->part = (ca_pass_part){0};
    return CA_OK;
}

static ca_status add_file(merge *m, ca_pass_reader *reader, bool alone, ca_error *error)
{
    const bool first = m->first_path == NULL;
    const ca_pass_part *part = &reader->part;
    if (!first) CA_TRY(check_same(m, reader, error));
    if (first) m->film_desc = reader->film;
    for (size_t i = 0; i < part->range_count && !alone; i++)
        CA_TRY(check_replicates(m, reader->path, part->ranges[i], error));
    CA_TRY(add_ranges(m, reader, error));
    if (first) return take_first(m, reader, error);
    CA_TRY(ca_pass_reader_add(reader, &m->film, false, error));
    add_totals(m, &reader->part);
    return CA_OK;
}

static ca_status add_files(merge *m, const char *const *paths, size_t count, bool wants_image, ca_error *error)
{
    for (size_t i = 0; i < count; i++) {
        ca_pass_reader reader;
        CA_TRY(ca_pass_reader_open(&reader, paths[i], error));
        const ca_status status = add_file(m, &reader, count == 1, error);
        ca_pass_reader_close(&reader);
        CA_TRY(status);
    }
    CA_TRY(join_ranges(m, error));
    return wants_image ? check_complete(m, error) : CA_OK;
}

/* ---- What is made of the sum ----------------------------------------------------------------------------------- */

static double number_of(const merge *m, const char *name)
{
    char text[64];
    double value = 0.0;
    if (!ca_part_settings_find(m->sum.settings, name, text, sizeof text) || !ca_parse_double(text, &value))
        return 0.0;
    return value;
}

static uint64_t seed_of(const merge *m)
{
    char text[32];
    uint64_t seed = 0;
    ca_part_settings_find(m->sum.settings, "seed", text, sizeof text);
    ca_parse_digits(text, strlen(text), UINT64_MAX, &seed);
    return seed;
}

/* Without numbers where they were those of the settings. Borrowed. */
static ca_ray_file rays_of(const merge *m)
{
    const uint32_t *crop = m->film_desc.crop;
    const size_t pixels = (size_t)(crop[2] - crop[0]) * (crop[3] - crop[1]);
    return ca_ray_file_of(m->sum.light_paths, m->sum.camera_paths, pixels);
}

static void fill_statistics(const merge *m, ca_render_statistics *statistics)
{
    const ca_pass_part *sum = &m->sum;
    const ca_film_summary summary = ca_film_summarise(&m->film);
    const uint64_t passes = ca_pass_part_passes(sum);
    const ca_ray_file rays = rays_of(m);
    *statistics = (ca_render_statistics){
        .seconds = sum->seconds,
        .samples_per_pixel = (double)passes * number_of(m, "samples_per_pass"),
        .iterations = passes,
        .seed = seed_of(m),
        .passes = {sum->ranges[0].begin, sum->ranges[sum->range_count - 1].end},
    };
    statistics->numbers_of_rays = ca_ray_file_statistics(&rays);
    ca_render_summarise(&summary, statistics);
    ca_part_counts_fill(sum->counts, statistics);
    ca_part_settings_find(sum->record, "method_reason", statistics->method.reason, sizeof statistics->method.reason);
}

/* The plan of the render, as far as the settings tell it. */
static ca_status make_plan(const merge *m, ca_render_plan *plan, ca_error *error)
{
    char sampler[64];
    *plan = (ca_render_plan){.passes_per_replicate = m->film_desc.replicate_samples};
    CA_TRY(ca_pass_settings_use(m->sum.settings, m->first_path, plan, error));
    ca_part_settings_find(m->sum.settings, "sampler", sampler, sizeof sampler);
    if (ca_sampler_find(sampler, &plan->sampler.kind)) return CA_OK;
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: its sampler is not known", m->first_path);
}

static ca_status attach_record(const merge *m, const ca_render_plan *plan, const ca_render_statistics *statistics,
                               ca_image_layers *image, ca_error *error)
{
    char version[64], integrator[1024], confidence[256], filter[64];
    ca_part_settings_find(m->sum.settings, "version", version, sizeof version);
    ca_part_settings_find(m->sum.settings, "filter", filter, sizeof filter);
    ca_integrator_describe(plan->type, &plan->input, integrator, sizeof integrator);
    ca_replicates_describe(plan, (uint32_t)statistics->iterations, confidence, sizeof confidence);
    const ca_render_record record = {
        .version = version,
        .scene = m->sum.scene_path[0] ? m->sum.scene_path : NULL,
        .integrator = integrator,
        .sampler = ca_sampler_name(plan->sampler.kind),
        .filter = filter,
        .confidence = confidence,
        .seed = (double)statistics->seed,
        .samples_per_pixel = statistics->samples_per_pixel,
        .seconds = statistics->seconds,
        .threads = m->sum.threads,
    };
    return ca_render_record_attach(&record, image, error);
}

static ca_status develop(const merge *m, const ca_render_plan *plan, ca_render_statistics *statistics,
                         ca_image_layers **image, ca_error *error)
{
    CA_TRY(ca_film_develop(&m->film, ca_processors(), image, error));
    const ca_ray_file rays = rays_of(m);
    ca_status status = attach_record(m, plan, statistics, *image, error);
    if (status == CA_OK && rays.light_paths > 0)
        status = ca_ray_file_add_layers(&rays, (uint32_t)statistics->iterations, *image, error);
    if (status == CA_OK) {
        statistics->has_confidence =
            ca_interval_layers_shares(*image, &statistics->confidence_marked, &statistics->confidence_widened);
        return CA_OK;
    }
    ca_layers_destroy(*image);
    *image = NULL;
    return status;
}

/* A sum that cannot be written does not keep the image from being made. */
static ca_status use_sum(const merge *m, const char *part_path, ca_image_layers **image,
                         ca_render_statistics *statistics, ca_error *error)
{
    ca_render_plan plan;
    CA_TRY(make_plan(m, &plan, error));
    const ca_status written = part_path ? ca_pass_part_write(&m->sum, &m->film, part_path, error) : CA_OK;
    fill_statistics(m, statistics);
    if (!image || (written != CA_OK && written != CA_ERROR_FILE)) return written;
    const ca_status developed = develop(m, &plan, statistics, image, written == CA_OK ? error : NULL);
    return written == CA_OK ? developed : written;
}

ca_status ca_merge_passes(const char *const *paths, size_t count, const char *part_path, ca_image_layers **image,
                          ca_render_statistics *statistics, ca_error *error)
{
    merge m = {.first_path = NULL};
    ca_render_statistics own;
    ca_status status = add_files(&m, paths, count, image != NULL, error);
    if (status == CA_OK) status = use_sum(&m, part_path, image, statistics ? statistics : &own, error);
    ca_film_destroy(&m.film);
    ca_pass_part_destroy(&m.sum);
    ca_free(m.ranges);
    return status;
}

static ca_status add_ranges_of(merge *m, const char *path, ca_error *error)
{
    ca_pass_reader reader;
    CA_TRY(ca_pass_reader_open(&reader, path, error));
    const ca_status status = add_ranges(m, &reader, error);
    ca_pass_reader_close(&reader);
    return status;
}

ca_status ca_merge_ranges(const char *const *paths, size_t count, ca_pass_range **ranges, size_t *range_count,
                          ca_error *error)
{
    merge m = {.first_path = NULL};
    ca_status status = CA_OK;
    for (size_t i = 0; i < count && status == CA_OK; i++) status = add_ranges_of(&m, paths[i], error);
    if (status == CA_OK) status = join_ranges(&m, error);
    *ranges = m.sum.ranges;
    *range_count = m.sum.range_count;
    ca_free(m.ranges);
    return status;
}
