#include "film/splats.h"

#include "base/memory.h"
#include "math/numeric.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { BAND_ROWS = 16, AHEAD = 16 };

bool ca_splat_list_add(ca_splat_list *list, const ca_splat *splat)
{
    assert(isfinite(splat->film.x) && isfinite(splat->film.y) && splat->weight > 0.0f);
    ca_splat *items = ca_array_grow(list->items, &list->capacity, list->count + 1, sizeof *items);
    if (!items) return false;
    list->items = items;
    list->items[list->count++] = *splat;
    return true;
}

void ca_splat_list_destroy(ca_splat_list *list)
{
    ca_free(list->items);
    *list = (ca_splat_list){0};
}

ca_status ca_splat_buffer_create(ca_splat_buffer *buffer, const uint32_t crop[4], ca_error *error)
{
    *buffer =
        (ca_splat_buffer){.x0 = crop[0], .y0 = crop[1], .width = crop[2] - crop[0], .height = crop[3] - crop[1]};
    buffer->sums = ca_alloc_zeroed((size_t)buffer->width * buffer->height, 3 * sizeof *buffer->sums);
    return buffer->sums ? CA_OK : ca_fail_memory(error, "the splats");
}

void ca_splat_buffer_destroy(ca_splat_buffer *buffer)
{
    ca_free(buffer->sums);
    ca_free(buffer->sorted);
    ca_free(buffer->starts);
    *buffer = (ca_splat_buffer){0};
}

void ca_splat_buffer_clear(ca_splat_buffer *buffer)
{
    memset(buffer->sums, 0, (size_t)buffer->width * buffer->height * 3 * sizeof *buffer->sums);
}

typedef struct add_task {
    ca_splat_buffer *buffer;
    const ca_splat_list *lists;
    uint32_t list_count, band_count;
    const ca_filter *filter;
    float box_height, scale;
    ca_technique_images *images;
} add_task;

/* Pixels, counted from `origin`, whose centres lie in (film - radius, film + radius]: of a box one pixel wide
 * exactly one, the one whose [x, x + 1) holds the splat. Clipped to [first, end). */
typedef struct pixel_range {
    uint32_t low, high;
} pixel_range;

static inline uint32_t clip(double x, uint32_t first, uint32_t end)
{
    return x <= (double)first ? first : x >= (double)end ? end : (uint32_t)x;
}

/* In double precision, where these sums are exact: in single precision a splat next to a border may be rounded onto
 * it at one end only, and a box would cover a pixel too many or too few. */
static inline pixel_range covered(float film, float radius, uint32_t origin, uint32_t first, uint32_t end)
{
    const double centre = (double)film - 0.5 - (double)origin;
    const double from = floor(centre - (double)radius) + 1.0, to = floor(centre + (double)radius) + 1.0;
    return (pixel_range){clip(from, first, end), clip(to, first, end)};
}

static inline pixel_range covered_rows(const add_task *task, const ca_splat *splat)
{
    return covered(splat->film.y, task->filter->radius, task->buffer->y0, 0, task->buffer->height);
}

/* ---- Sorting by band ------------------------------------------------------------------------------------------- */

/* starts[band * list_count + list] counts the list's records in the band, then says where they begin. */
static inline uint32_t *start_of(const add_task *task, uint32_t band, uint32_t list)
{
    return &task->buffer->starts[(size_t)band * task->list_count + list];
}

static void count_list(void *user, uint32_t list, uint32_t worker)
{
    (void)worker;
    const add_task *task = user;
    for (uint32_t band = 0; band < task->band_count; band++) *start_of(task, band, list) = 0;
    for (size_t i = 0; i < task->lists[list].count; i++) {
        const pixel_range rows = covered_rows(task, &task->lists[list].items[i]);
        if (rows.low == rows.high) continue;
        for (uint32_t band = rows.low / BAND_ROWS; band <= (rows.high - 1) / BAND_ROWS; band++)
            ++*start_of(task, band, list);
    }
}

static void sort_list(void *user, uint32_t list, uint32_t worker)
{
    (void)worker;
    const add_task *task = user;
    for (size_t i = 0; i < task->lists[list].count; i++) {
        const ca_splat *splat = &task->lists[list].items[i];
        const pixel_range rows = covered_rows(task, splat);
        if (rows.low == rows.high) continue;
        for (uint32_t band = rows.low / BAND_ROWS; band <= (rows.high - 1) / BAND_ROWS; band++)
            task->buffer->sorted[(*start_of(task, band, list))++] = splat;
    }
}

/* Afterwards starts[] holds the ends. */
static ca_status sort_by_band(add_task *task, const ca_parallel *parallel, ca_error *error)
{
    ca_splat_buffer *buffer = task->buffer;
    const size_t entries = (size_t)task->band_count * task->list_count;
    uint32_t *starts = ca_array_grow(buffer->starts, &buffer->starts_capacity, entries, sizeof *starts);
    if (!starts) return ca_fail_memory(error, "the splats");
    buffer->starts = starts;
    CA_TRY(ca_parallel_for(parallel, task->list_count, count_list, task, error));
    uint32_t total = 0;
    for (size_t i = 0; i < entries; i++) {
        const uint32_t count = buffer->starts[i];
        if (count > UINT32_MAX - total) return ca_fail_memory(error, "more than 2^32 splats at a time");
        buffer->starts[i] = total;
        total += count;
    }
    const ca_splat **sorted = ca_array_grow(buffer->sorted, &buffer->sorted_capacity, total, sizeof *sorted);
    if (!sorted) return ca_fail_memory(error, "the splats");
    buffer->sorted = sorted;
    return ca_parallel_for(parallel, task->list_count, sort_list, task, error);
}

/* ---- Adding ---------------------------------------------------------------------------------------------------- */

/* A splat's filter over a part of its pixels: at most so many columns and rows. */
enum { WIDEST = 64 };

typedef struct footprint {
    uint32_t x, columns, y, rows;
    float along_x[WIDEST], along_y[BAND_ROWS];
} footprint;

/* The filter along both axes; a box has one height over all it covers, its edge included. */
static void fill_along(const add_task *task, const ca_splat *splat, footprint *f)
{
    const float x = splat->film.x - ((float)(task->buffer->x0 + f->x) + 0.5f);
    const float y = splat->film.y - ((float)(task->buffer->y0 + f->y) + 0.5f);
    if (task->filter->kind != CA_RFILTER_BOX) {
        ca_filter_eval_run(task->filter, x, f->columns, f->along_x);
        ca_filter_eval_run(task->filter, y, f->rows, f->along_y);
        return;
    }
    for (uint32_t i = 0; i < f->columns; i++) f->along_x[i] = task->box_height;
    for (uint32_t j = 0; j < f->rows; j++) f->along_y[j] = task->box_height;
}

static void add_to_images(const add_task *task, const ca_splat *splat, const footprint *f)
{
    const ca_rgb unweighted = ca_rgb_scale(splat->value, task->scale / splat->weight);
    for (uint32_t j = 0; j < f->rows; j++)
        for (uint32_t i = 0; i < f->columns; i++)
            ca_technique_images_add(task->images, CA_TECHNIQUE_SPLAT, 1, splat->light_vertices,
                                    task->buffer->x0 + f->x + i, task->buffer->y0 + f->y + j,
                                    ca_rgb_scale(unweighted, f->along_x[i] * f->along_y[j]), splat->weight);
}

/* Row by row, as numbers that follow each other. */
static void add_to_sums(const add_task *task, const ca_splat *splat, const footprint *f)
{
    float spread[3 * WIDEST];
    const uint32_t numbers = 3 * f->columns;
    for (size_t i = 0; i < f->columns; i++) {
        const float height = f->along_x[i] * task->scale;
        spread[3 * i] = height * splat->value.r;
        spread[3 * i + 1] = height * splat->value.g;
        spread[3 * i + 2] = height * splat->value.b;
    }
    for (uint32_t j = 0; j < f->rows; j++) {
        double *row = &task->buffer->sums[3 * ((size_t)(f->y + j) * task->buffer->width + f->x)];
        const float height = f->along_y[j];
        for (uint32_t k = 0; k < numbers; k++) row[k] += (double)(height * spread[k]);
    }
}

/* The part of a splat that falls into rows [first_row, end_row) of the buffer, no more than a band. */
static void add_splat(const add_task *task, const ca_splat *splat, uint32_t first_row, uint32_t end_row)
{
    const ca_splat_buffer *buffer = task->buffer;
    const float radius = task->filter->radius;
    const pixel_range rows = covered(splat->film.y, radius, buffer->y0, first_row, end_row);
    const pixel_range columns = covered(splat->film.x, radius, buffer->x0, 0, buffer->width);
    for (uint32_t begin = columns.low; begin < columns.high; begin += WIDEST) {
        footprint f;
        f.x = begin, f.columns = ca_min_u32(WIDEST, columns.high - begin);
        f.y = rows.low, f.rows = rows.high - rows.low;
        fill_along(task, splat, &f);
        add_to_sums(task, splat, &f);
        if (task->images) add_to_images(task, splat, &f);
    }
}

/* A band's records lie apart: without asking for them early, waiting for memory is nearly all of the time. A record
 * may lie across two cache lines. */
static inline void prefetch(const ca_splat *splat)
{
    __builtin_prefetch(splat);
    __builtin_prefetch((const char *)(splat + 1) - 1);
}

static void add_band(void *user, uint32_t band, uint32_t worker)
{
    (void)worker;
    const add_task *task = user;
    const uint32_t first_row = band * BAND_ROWS;
    const uint32_t end_row = ca_min_u32(first_row + BAND_ROWS, task->buffer->height);
    const uint32_t begin = band == 0 ? 0 : *start_of(task, band - 1, task->list_count - 1);
    const uint32_t end = *start_of(task, band, task->list_count - 1);
    for (uint32_t i = begin; i < end; i++) {
        if (i + AHEAD < end) prefetch(task->buffer->sorted[i + AHEAD]);
        add_splat(task, task->buffer->sorted[i], first_row, end_row);
    }
}

ca_status ca_splat_buffer_add(ca_splat_buffer *buffer, const ca_splat_list *lists, uint32_t list_count,
                              const ca_filter *filter, float scale, ca_technique_images *images,
                              const ca_parallel *parallel, ca_error *error)
{
    if (list_count == 0) return CA_OK;
    add_task task = {.buffer = buffer,
                     .lists = lists,
                     .list_count = list_count,
                     .band_count = (buffer->height + BAND_ROWS - 1) / BAND_ROWS,
                     .filter = filter,
                     .box_height = 1.0f / filter->integral,
                     .scale = scale,
                     .images = images};
    CA_TRY(sort_by_band(&task, parallel, error));
    return ca_parallel_for(parallel, task.band_count, add_band, &task, error);
}
