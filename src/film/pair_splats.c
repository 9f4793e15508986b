#include "film/pair_splats.h"

#include "base/memory.h"
#include "math/numeric.h"

#include <math.h>
#include <string.h>

/* Pixels that the filter reaches on either side of the one that a splat lies in: a pixel's centre is half a pixel
 * from its borders. */
static int64_t reach(const ca_filter *filter) { return (int64_t)ceil((double)filter->radius - 0.5); }

ca_status ca_pair_splats_create(ca_pair_splats *splats, const uint32_t crop[4], const ca_filter *filter,
                                ca_error *error)
{
    const int64_t margin = reach(filter);
    *splats = (ca_pair_splats){.filter = filter,
                               .x0 = crop[0] - margin,
                               .y0 = crop[1] - margin,
                               .width = crop[2] - crop[0] + 2 * (uint32_t)margin,
                               .height = crop[3] - crop[1] + 2 * (uint32_t)margin};
    splats->starts = ca_alloc_zeroed((size_t)splats->width * splats->height + 1, sizeof *splats->starts);
    return splats->starts ? CA_OK : ca_fail_memory(error, "the splats of light paths");
}

void ca_pair_splats_destroy(ca_pair_splats *splats)
{
    ca_free(splats->items);
    ca_free(splats->sorted);
    ca_free(splats->starts);
    *splats = (ca_pair_splats){0};
}

void ca_pair_splats_clear(ca_pair_splats *splats) { splats->count = 0; }

/* The number of the pixel that a position lies in; false where it is none of those here. */
static bool find_pixel(const ca_pair_splats *splats, ca_vec2 film, size_t *pixel)
{
    const double x = floor((double)film.x) - (double)splats->x0, y = floor((double)film.y) - (double)splats->y0;
    if (!(x >= 0.0 && y >= 0.0 && x < splats->width && y < splats->height)) return false;
    *pixel = (size_t)y * splats->width + (size_t)x;
    return true;
}

static ca_status make_room(ca_pair_splats *splats, size_t more, ca_error *error)
{
    if (splats->count + more > UINT32_MAX) return ca_fail_memory(error, "more than 2^32 splats at a time");
    ca_pair_splat *items = ca_array_grow(splats->items, &splats->capacity, splats->count + more, sizeof *items);
    if (!items) return ca_fail_memory(error, "the splats of light paths");
    splats->items = items;
    return CA_OK;
}

/* There is room. */
static void add(ca_pair_splats *splats, const ca_splat *s, float scale, uint32_t first_light_path)
{
    size_t pixel;
    if (!find_pixel(splats, s->film, &pixel)) return;
    splats->items[splats->count++] = (ca_pair_splat){.film = s->film,
                                                     .luminance = scale * ca_luminance(s->value),
                                                     .light_path = first_light_path + s->light_path};
}

ca_status ca_pair_splats_add(ca_pair_splats *splats, const ca_splat_list *lists, uint32_t list_count,
                             uint32_t first_light_path, ca_error *error)
{
    size_t more = 0;
    for (uint32_t l = 0; l < list_count; l++) more += lists[l].count;
    CA_TRY(make_room(splats, more, error));
    for (uint32_t l = 0; l < list_count; l++)
        for (size_t i = 0; i < lists[l].count; i++) add(splats, &lists[l].items[i], 1.0f, first_light_path);
    return CA_OK;
}

ca_status ca_pair_splats_add_scaled(ca_pair_splats *splats, const ca_splat_list *list, const float *scales,
                                    uint32_t stride, uint32_t first_light_path, ca_error *error)
{
    CA_TRY(make_room(splats, list->count, error));
    for (size_t i = 0; i < list->count; i++) add(splats, &list->items[i], scales[i * stride], first_light_path);
    return CA_OK;
}

/* A counting sort: starts[p + 1] counts, then says where pixel p's next one goes, which at last is where it ends. */
ca_status ca_pair_splats_sort(ca_pair_splats *splats, ca_error *error)
{
    const size_t pixels = (size_t)splats->width * splats->height;
    size_t pixel;
    ca_pair_splat *sorted = ca_array_grow(splats->sorted, &splats->sorted_capacity, splats->count, sizeof *sorted);
    if (!sorted) return ca_fail_memory(error, "the splats of light paths");
    splats->sorted = sorted;
    memset(splats->starts, 0, (pixels + 1) * sizeof *splats->starts);
    for (size_t i = 0; i < splats->count; i++)
        if (find_pixel(splats, splats->items[i].film, &pixel)) splats->starts[pixel + 1]++;
    uint32_t total = 0;
    for (size_t p = 1; p <= pixels; p++) {
        const uint32_t count = splats->starts[p];
        splats->starts[p] = total;
        total += count;
    }
    for (size_t i = 0; i < splats->count; i++)
        if (find_pixel(splats, splats->items[i].film, &pixel))
            splats->sorted[splats->starts[pixel + 1]++] = splats->items[i];
    return CA_OK;
}

/* The filter along one axis at a pixel's centre, 0 beyond it; a box has one height over all it covers, its edge
 * included. */
static double along(const ca_filter *filter, float film, uint32_t pixel)
{
    const double distance = (double)film - 0.5 - (double)pixel; /* exact */
    if (!(distance >= -(double)filter->radius && distance < (double)filter->radius)) return 0.0;
    if (filter->kind == CA_RFILTER_BOX) return 1.0 / (double)filter->integral;
    return (double)ca_filter_eval(filter, film - ((float)pixel + 0.5f));
}

void ca_pair_splats_gather(const ca_pair_splats *splats, uint32_t x, uint32_t y, ca_pair_sums *sums)
{
    const int64_t far = reach(splats->filter);
    for (int64_t row = y - far - splats->y0; row <= y + far - splats->y0; row++) {
        const size_t first = (size_t)row * splats->width + (size_t)(x - far - splats->x0);
        const uint32_t end = splats->starts[first + 2 * (size_t)far + 1];
        for (uint32_t i = splats->starts[first]; i < end; i++) {
            const ca_pair_splat *s = &splats->sorted[i];
            const double filter = along(splats->filter, s->film.x, x) * along(splats->filter, s->film.y, y);
            if (filter != 0.0) ca_pair_sums_add_light_alone(sums, s->light_path, filter * (double)s->luminance);
        }
    }
}
