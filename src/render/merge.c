/* Adding up part files (ca_merge_parts), those of blocks of pairs. They are read one after the other: in memory are
 * the sums so far and the file of one part, from which its sums are added row by row. */
#include "base/memory.h"
#include "film/interval_layers.h"
#include "film/part_stream.h"
#include "film/pass_part.h"
#include "render/blocks.h"
#include "render/merge_passes.h"
#include "render/part_settings.h"
#include "render/public_structs.h"

#include <stdlib.h>
#include <string.h>

/* What is kept of a part once its sums are added. */
typedef struct merged_part {
    const char *path;
    uint64_t blocks[2];
    uint64_t next_blocks;
    double samples_per_pixel, next_samples;
} merged_part;

typedef struct merge {
    ca_part sum; /* begins as the first part read; its scene path and threads are those of the first blocks */
    merged_part *parts;
    size_t count;
} merge;

#define RANGE(blocks) (unsigned long long)(blocks)[0], (unsigned long long)(blocks)[1]

/* ---- Do they belong together? ---------------------------------------------------------------------------------- */

static ca_status check_same(const merge *m, const ca_part_file *file, const char *path, ca_error *error)
{
    const char *a = m->sum.settings, *b = file->part.settings, *first = m->parts[0].path;
    if (!ca_part_settings_equal(&a, &b)) return ca_part_settings_fail(first, a, path, b, error);
    if (ca_block_film_desc_equal(ca_block_film_described(m->sum.film), &file->film)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%.400s and %.400s have different films", first, path);
}

static int by_first_block(const void *a, const void *b)
{
    const merged_part *x = a, *y = b;
    if (x->blocks[0] != y->blocks[0]) return x->blocks[0] < y->blocks[0] ? -1 : 1;
    return strcmp(x->path, y->path);
}

/* The ranges in their order: without overlap, without gap. */
static ca_status check_ranges(merge *m, ca_error *error)
{
    qsort(m->parts, m->count, sizeof *m->parts, by_first_block);
    for (size_t i = 1; i < m->count; i++) {
        const merged_part *a = &m->parts[i - 1], *b = &m->parts[i];
        if (b->blocks[0] < a->blocks[1])
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "%.300s with the blocks %llu:%llu and %.300s with %llu:%llu overlap", a->path,
                           RANGE(a->blocks), b->path, RANGE(b->blocks));
        const uint64_t gap[2] = {a->blocks[1], b->blocks[0]};
        if (gap[0] < gap[1])
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "the blocks %llu:%llu between %.300s and %.300s are missing", RANGE(gap), a->path,
                           b->path);
    }
    return CA_OK;
}

static ca_status check_start(const merge *m, ca_error *error)
{
    const merged_part *first = &m->parts[0];
    if (first->blocks[0] == 0) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "an image needs all blocks from 0, but %.400s begins at block %llu: without them only a part file "
                   "can be made",
                   first->path, (unsigned long long)first->blocks[0]);
}

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

static void swap_texts(char **a, char **b)
{
    char *const text = *a;
    *a = *b;
    *b = text;
}

/* But for the film. */
static void add_totals(merge *m, ca_part *part)
{
    ca_part *sum = &m->sum;
    for (int i = 0; i < CA_PART_COUNTS; i++) sum->counts[i] += part->counts[i];
    sum->seconds += part->seconds;
    if (part->blocks[0] < sum->blocks[0]) {
        sum->blocks[0] = part->blocks[0];
        sum->threads = part->threads;
        swap_texts(&sum->scene_path, &part->scene_path);
    }
    if (part->blocks[1] > sum->blocks[1]) sum->blocks[1] = part->blocks[1];
}

/* Each part knows the samples per pixel for its own blocks only. The sum gets the largest number of all parts, and
 * the nearest next step that none of them has reached. */
static void join_samples(merge *m)
{
    ca_part *sum = &m->sum;
    sum->samples_per_pixel = sum->next_samples = 0.0;
    sum->next_blocks = 0;
    for (size_t i = 0; i < m->count; i++) {
        const merged_part *p = &m->parts[i];
        const bool reached = p->next_blocks > 0 && p->next_blocks <= sum->blocks[1];
        const double samples =
            reached && p->next_samples > p->samples_per_pixel ? p->next_samples : p->samples_per_pixel;
        if (samples > sum->samples_per_pixel) sum->samples_per_pixel = samples;
        if (reached || p->next_blocks == 0 || (sum->next_blocks > 0 && sum->next_blocks <= p->next_blocks)) continue;
        sum->next_blocks = p->next_blocks;
        sum->next_samples = p->next_samples;
    }
}

static ca_status add_file(merge *m, ca_part_file *file, const char *path, ca_error *error)
{
    ca_part *part = &file->part;
    const bool first = m->count == 0;
    if (!first) CA_TRY(check_same(m, file, path, error));
    if (first) CA_TRY(ca_block_film_create(&m->sum.film, &file->film, error));
    m->parts[m->count++] = (merged_part){.path = path,
                                         .blocks = {part->blocks[0], part->blocks[1]},
                                         .next_blocks = part->next_blocks,
                                         .samples_per_pixel = part->samples_per_pixel,
                                         .next_samples = part->next_samples};
    ca_part_file_add(file, m->sum.film);
    if (!first) {
        add_totals(m, part);
        return CA_OK;
    }
    part->film = m->sum.film;
    m->sum = *part;
    *part = (ca_part){0};
    return CA_OK;
}

static ca_status read_part(merge *m, const char *path, ca_error *error)
{
    ca_part_file file;
    CA_TRY(ca_part_file_open(&file, path, error));
    const ca_status status = add_file(m, &file, path, error);
    ca_part_file_close(&file);
    return status;
}

static ca_status merge_files(merge *m, const char *const *paths, size_t count, bool wants_image, ca_error *error)
{
    m->parts = ca_alloc(count, sizeof *m->parts);
    if (!m->parts) return ca_fail_memory(error, "the part files");
    for (size_t i = 0; i < count; i++) CA_TRY(read_part(m, paths[i], error));
    CA_TRY(check_ranges(m, error));
    join_samples(m);
    return wants_image ? check_start(m, error) : CA_OK;
}

/* A sum that cannot be written does not keep the image from being made. */
static ca_status use_sum(const ca_part *sum, const char *part_path, ca_image_layers **image,
                         ca_render_statistics *statistics, ca_error *error)
{
    const ca_status written = part_path ? ca_part_write(sum, part_path, error) : CA_OK;
    if (statistics) ca_part_fill_statistics(sum, statistics);
    if (!image || (written != CA_OK && written != CA_ERROR_FILE)) return written;
    const ca_status developed = ca_part_develop(sum, image, written == CA_OK ? error : NULL);
    if (developed == CA_OK && statistics)
        statistics->has_confidence =
            ca_interval_layers_shares(*image, &statistics->confidence_marked, &statistics->confidence_widened);
    return written == CA_OK ? developed : written;
}

/* Parts are of passes or of blocks of pairs: the first one says which. */
static ca_status has_passes(const char *path, bool *passes, ca_error *error)
{
    FILE *stream;
    uint64_t size, format;
    CA_TRY(ca_part_open(path, &stream, &size, &format, error));
    *passes = format == CA_PASS_PART_FORMAT || format == CA_JOINED_PART_FORMAT; /* which is refused there */
    fclose(stream);
    return CA_OK;
}

static ca_status merge_blocks(const char *const *paths, size_t count, const char *part_path, ca_image_layers **image,
                              ca_render_statistics *statistics, ca_error *error)
{
    merge m = {0};
    ca_status status = merge_files(&m, paths, count, image != NULL, error);
    if (status == CA_OK) status = use_sum(&m.sum, part_path, image, statistics, error);
    ca_part_destroy(&m.sum);
    ca_free(m.parts);
    return status;
}

ca_status ca_merge_parts(const char *const *paths, size_t count, const char *part_path, ca_image_layers **image,
                         ca_render_statistics *statistics, ca_error *error)
{
    if (image) *image = NULL;
    if (count == 0) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "there are no part files to merge");
    bool passes;
    CA_TRY(has_passes(paths[0], &passes, error));
    ca_render_statistics told;
    CA_TRY(ca_statistics_take(statistics, &told, error));
    const ca_status status = passes ? ca_merge_passes(paths, count, part_path, image, &told, error)
                                    : merge_blocks(paths, count, part_path, image, &told, error);
    ca_statistics_give(&told, statistics);
    return status;
}
