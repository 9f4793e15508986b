/* caustica converge: what is looked at. Pictures and close-ups at equal time, standard deviations likewise, and the
 * page of the comparison. */
#include "base/memory.h"
#include "cli/compare_page.h"
#include "cli/converge.h"
#include "math/rgb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Values ---------------------------------------------------------------------------------------------------- */

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The value that a share of the finite values stay under; sorts them. 0: there are none. */
static double percentile(float *values, size_t count, double share)
{
    size_t finite = 0;
    for (size_t i = 0; i < count; i++)
        if (isfinite(values[i])) values[finite++] = values[i];
    if (finite == 0) return 0.0;
    qsort(values, finite, sizeof *values, compare_floats);
    return (double)values[(size_t)(share * (double)(finite - 1))];
}

static size_t pixels_of(const ca_converge *c) { return (size_t)c->reference->width * c->reference->height; }

static void colours_of(const ca_image_layers *image, const float *planes[3])
{
    static const char *const names[3] = {"R", "G", "B"};
    for (int k = 0; k < 3; k++) planes[k] = ca_layers_find(image, names[k]); /* compared already: they are there */
}

/* Nineteen of twenty pixels of the reference are then below 0.8, or what was asked for. */
static ca_status find_exposure(const ca_converge *c, double *scale, ca_error *error)
{
    const float *rgb[3];
    *scale = exp2(c->options->exposure);
    if (c->options->has_exposure) return CA_OK;
    float *luminance = ca_alloc(pixels_of(c), sizeof *luminance);
    if (!luminance) return ca_fail_memory(error, "the pictures");
    colours_of(c->reference, rgb);
    for (size_t p = 0; p < pixels_of(c); p++) luminance[p] = ca_luminance((ca_rgb){rgb[0][p], rgb[1][p], rgb[2][p]});
    const double bright = percentile(luminance, pixels_of(c), 0.95);
    *scale = bright > 0.0 ? 0.8 / bright : 1.0;
    ca_free(luminance);
    return CA_OK;
}

/* ---- Close-ups ------------------------------------------------------------------------------------------------- */

/* Adds an image's relative squares; no pixel counts for more than one that is wrong altogether, or fireflies would
 * choose. */
static void add_errors(const ca_converge *c, const ca_image_layers *image, float *errors)
{
    const float *a[3], *b[3];
    colours_of(image, a);
    colours_of(c->reference, b);
    for (size_t p = 0; p < pixels_of(c); p++) {
        double sum = 0.0;
        for (int k = 0; k < 3; k++) sum += ca_relative_square((double)a[k][p], (double)b[k][p]) / 3.0;
        if (isfinite(sum)) errors[p] += (float)fmin(sum, 1.0);
    }
}

static double sum_in(const float *values, uint32_t width, const ca_pixel_rect *rect)
{
    double sum = 0.0;
    for (uint32_t y = rect->y0; y < rect->y1; y++)
        for (uint32_t x = rect->x0; x < rect->x1; x++) sum += (double)values[(size_t)y * width + x];
    return sum;
}

/* A quarter of the shorter side, moved by halves of it. */
static ca_pixel_rect worst_square(const ca_converge *c, const float *errors)
{
    const uint32_t width = c->reference->width, height = c->reference->height;
    const uint32_t shorter = width < height ? width : height, quarter = shorter / 4;
    const uint32_t side = quarter >= 8 ? quarter : (shorter < 8 ? shorter : 8), move = side > 1 ? side / 2 : 1;
    ca_pixel_rect worst = {0, 0, side, side};
    double most = -1.0;
    for (uint32_t y = 0; y + side <= height; y += move)
        for (uint32_t x = 0; x + side <= width; x += move) {
            const ca_pixel_rect rect = {x, y, x + side, y + side};
            const double sum = sum_in(errors, width, &rect);
            if (sum > most) most = sum, worst = rect;
        }
    return worst;
}

static ca_status choose_closeup(ca_converge *c, ca_error *error)
{
    if (c->closeup_count > 0) return CA_OK;
    float *errors = ca_alloc_zeroed(pixels_of(c), sizeof *errors);
    ca_status status = errors ? CA_OK : ca_fail_memory(error, "the pictures");
    for (size_t i = 0; i < c->integrator_count && status == CA_OK; i++) {
        ca_image_layers *image;
        status = ca_layers_read(ca_converge_equal_time(c, i)->path, &image, error);
        if (status != CA_OK) break;
        add_errors(c, image, errors);
        ca_layers_destroy(image);
    }
    if (status == CA_OK) c->closeups[c->closeup_count++] = worst_square(c, errors);
    ca_free(errors);
    return status;
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

/* `rect` of three planes, as many pixels, times `scale`. */
static ca_status write_part(ca_converge *c, const char *path, const ca_pixel_rect *rect, const float *const planes[3],
                            double scale, ca_error *error)
{
    static const char *const names[3] = {"R", "G", "B"};
    const uint32_t width = rect->x1 - rect->x0, height = rect->y1 - rect->y0;
    ca_image_layers *part;
    if (!path) return ca_fail_memory(error, "the pictures");
    CA_TRY(ca_layers_create(&part, width, height, error));
    ca_status status = CA_OK;
    for (int k = 0; k < 3 && status == CA_OK; k++) {
        float *data;
        status = ca_layers_add(part, names[k], &data, error);
        for (size_t p = 0; status == CA_OK && p < (size_t)width * height; p++) {
            const size_t from = (size_t)(rect->y0 + p / width) * c->reference->width + rect->x0 + p % width;
            data[p] = (float)(scale * (double)planes[k][from]);
        }
    }
    if (status == CA_OK) status = ca_layers_write(part, path, 0.0f, error);
    ca_layers_destroy(part);
    return status;
}

/* The picture and its close-ups. */
static ca_status write_picture(ca_converge *c, const char *name, const char *suffix, const float *const planes[3],
                               double scale, ca_error *error)
{
    const ca_pixel_rect all = {0, 0, c->reference->width, c->reference->height};
    CA_TRY(write_part(c, ca_converge_picture_path(c, name, suffix, 0), &all, planes, scale, error));
    for (size_t k = 0; k < c->closeup_count; k++)
        CA_TRY(write_part(c, ca_converge_picture_path(c, name, suffix, k + 1), &c->closeups[k], planes, scale,
                          error));
    return CA_OK;
}

static ca_status write_colours(ca_converge *c, ca_error *error)
{
    double scale;
    const float *rgb[3];
    CA_TRY(find_exposure(c, &scale, error));
    colours_of(c->reference, rgb);
    CA_TRY(write_picture(c, "reference", "", rgb, scale, error));
    for (size_t i = 0; i < c->integrator_count; i++) {
        ca_image_layers *image;
        CA_TRY(ca_layers_read(ca_converge_equal_time(c, i)->path, &image, error));
        colours_of(image, rgb);
        const ca_status status = write_picture(c, c->integrators[i].name, "", rgb, scale, error);
        ca_layers_destroy(image);
        if (status != CA_OK) return status;
    }
    return CA_OK;
}

/* ---- Standard deviations --------------------------------------------------------------------------------------- */

/* One iteration's, root of the mean square over repeats at the last step. */
static ca_status read_deviation(const ca_converge *c, size_t integrator, float *deviation, ca_error *error)
{
    memset(deviation, 0, pixels_of(c) * sizeof *deviation);
    for (size_t i = 0; i < c->repeats; i++) {
        ca_image_layers *image;
        CA_TRY(ca_layers_read(ca_converge_at(c, c->steps_done - 1, integrator, i)->path, &image, error));
        const float *layer = ca_layers_find(image, "StandardDeviation.Y");
        for (size_t p = 0; layer && p < pixels_of(c); p++) deviation[p] += layer[p] * layer[p] / (float)c->repeats;
        ca_layers_destroy(image);
    }
    for (size_t p = 0; p < pixels_of(c); p++) deviation[p] = sqrtf(deviation[p]);
    return CA_OK;
}

/* One scale for all: nearly all pixels of all integrators stay below white. `all` is sorted. */
static double deviation_scale(float *all, size_t count)
{
    const double bright = percentile(all, count, 0.99);
    return bright > 0.0 ? 1.0 / bright : 1.0;
}

static ca_status write_deviations(ca_converge *c, float *maps, float *scratch, ca_error *error)
{
    const size_t pixels = pixels_of(c);
    for (size_t i = 0; i < c->integrator_count; i++) CA_TRY(read_deviation(c, i, maps + i * pixels, error));
    memcpy(scratch, maps, c->integrator_count * pixels * sizeof *maps);
    const double scale = deviation_scale(scratch, c->integrator_count * pixels);
    for (size_t i = 0; i < c->integrator_count; i++) {
        const float *const grey[3] = {maps + i * pixels, maps + i * pixels, maps + i * pixels};
        double seconds;
        if (isnan(ca_converge_deviation(c, i, &seconds))) continue; /* nothing is known */
        CA_TRY(write_picture(c, c->integrators[i].name, "-deviation", grey, scale, error));
    }
    return CA_OK;
}

ca_status ca_converge_write_pictures(ca_converge *c, ca_error *error)
{
    const size_t values = c->integrator_count * pixels_of(c);
    CA_TRY(choose_closeup(c, error));
    CA_TRY(write_colours(c, error));
    float *maps = ca_alloc(values, sizeof *maps), *scratch = ca_alloc(values, sizeof *scratch);
    ca_status status = maps && scratch ? CA_OK : ca_fail_memory(error, "the pictures");
    if (status == CA_OK) status = write_deviations(c, maps, scratch, error);
    ca_free(maps);
    ca_free(scratch);
    return status;
}

/* ---- The page of the comparison -------------------------------------------------------------------------------- */

static ca_status compare_image(ca_converge *c, ca_compare_page *page, const ca_converge_render *r,
                               const ca_image_layers *image, ca_error *error)
{
    char name[160], step[64];
    ca_image_layers *maps = NULL;
    ca_converge_step_text(c, r->step, step, sizeof step);
    snprintf(name, sizeof name, c->by_time ? "%.80s, %s" : "%.80s, %s, %.3g s", c->integrators[r->integrator].text,
             step, r->seconds);
    ca_compared_image compared = {.path = name, .flip_is_hdr = true};
    CA_TRY(ca_compare(image, c->reference, &c->region, &compared.comparison, error));
    CA_TRY(ca_measure_image(image, c->reference, &c->region, &c->metrics, &compared.metrics, &maps, error));
    const ca_status status = ca_compare_page_add(page, &compared, image, c->reference, maps, error);
    ca_layers_destroy(maps);
    return status;
}

static ca_status add_render(ca_converge *c, ca_compare_page *page, const ca_converge_render *r, ca_error *error)
{
    ca_image_layers *image;
    CA_TRY(ca_layers_read(r->path, &image, error));
    const ca_status status = compare_image(c, page, r, image, error);
    ca_layers_destroy(image);
    return status;
}

/* Those at equal time, then those of the last step that are not among them. */
static ca_status add_renders(ca_converge *c, ca_compare_page *page, ca_error *error)
{
    for (size_t i = 0; i < c->integrator_count; i++) CA_TRY(add_render(c, page, ca_converge_equal_time(c, i), error));
    for (size_t i = 0; i < c->integrator_count; i++) {
        const ca_converge_render *last = ca_converge_at(c, c->steps_done - 1, i, 0);
        if (last != ca_converge_equal_time(c, i)) CA_TRY(add_render(c, page, last, error));
    }
    return CA_OK;
}

ca_status ca_converge_write_images_page(ca_converge *c, ca_error *error)
{
    ca_compare_page page = {0};
    const char *path = ca_converge_path(c, "images.html");
    if (!path) return ca_fail_memory(error, "the page");
    CA_TRY(ca_compare_page_create(&page, path, c->options->reference, &c->region, NULL, error));
    ca_status status = add_renders(c, &page, error);
    if (status == CA_OK) status = ca_compare_page_finish(&page, error);
    ca_compare_page_destroy(&page);
    return status;
}
