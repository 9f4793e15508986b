#define _POSIX_C_SOURCE 200809L
#include "report/technique_page.h"

#include "base/file.h"
#include "base/memory.h"
#include "image/format.h"
#include "report/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = CA_TECHNIQUE_MAX_VERTICES + 1, COLUMNS = CA_TECHNIQUE_COUNT * SIDE };

typedef enum picture_kind { WEIGHTED, UNWEIGHTED, WEIGHT, KIND_COUNT } picture_kind;

typedef struct reduced_pixel {
    ca_rgb unweighted, weighted; /* mean over its pixels and all passes */
} reduced_pixel;

typedef struct technique_page {
    const ca_technique_images *images;
    uint32_t passes, full_width, full_height, factor, width, height; /* reduced */
    float exposure;
    double light; /* sum of the weighted luminance of all techniques, over reduced pixels */
    reduced_pixel *pixels;
    float *planes; /* three */
    unsigned char *png;
    char *text;
    size_t png_size; /* room */
} technique_page;

/* ---- Where a picture is in the table --------------------------------------------------------------------------- */

/* Connections and merges have a column for each number of light vertices; the others have one. */
static bool has_columns(ca_technique technique)
{
    return technique == CA_TECHNIQUE_CONNECT || technique == CA_TECHNIQUE_MERGE;
}

static uint32_t column_of(ca_technique technique, uint32_t t)
{
    return (uint32_t)technique * SIDE + (has_columns(technique) ? t : 0);
}

static uint32_t segments_of(ca_technique technique, uint32_t s, uint32_t t)
{
    return s + t - (technique == CA_TECHNIQUE_MERGE ? 2 : 1);
}

static bool is_there(const technique_page *page, ca_technique technique, uint32_t s, uint32_t t)
{
    ca_rgb unweighted, weighted;
    return ca_technique_images_get(page->images, technique, s, t, 0, &unweighted, &weighted);
}

/* The picture in this cell; false where there is none. */
static bool find_cell(const technique_page *page, uint32_t column, uint32_t segments, uint32_t *s, uint32_t *t)
{
    const ca_technique technique = (ca_technique)(column / SIDE);
    for (*s = 0; *s < SIDE; (*s)++)
        for (*t = 0; *t < SIDE; (*t)++)
            if (*s + *t > 1 && column_of(technique, *t) == column && segments_of(technique, *s, *t) == segments &&
                is_there(page, technique, *s, *t))
                return true;
    return false;
}

static bool column_is_used(const technique_page *page, uint32_t column)
{
    uint32_t s, t;
    for (uint32_t segments = 0; segments < 2 * SIDE; segments++)
        if (find_cell(page, column, segments, &s, &t)) return true;
    return false;
}

static bool row_is_used(const technique_page *page, uint32_t segments)
{
    uint32_t s, t;
    for (uint32_t column = 0; column < COLUMNS; column++)
        if (find_cell(page, column, segments, &s, &t)) return true;
    return false;
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

static reduced_pixel reduce_pixel(const technique_page *page, ca_technique technique, uint32_t s, uint32_t t,
                                  uint32_t x0, uint32_t y0)
{
    reduced_pixel sum = {{0, 0, 0}, {0, 0, 0}};
    uint32_t count = 0;
    for (uint32_t y = y0; y < y0 + page->factor && y < page->full_height; y++)
        for (uint32_t x = x0; x < x0 + page->factor && x < page->full_width; x++, count++) {
            ca_rgb unweighted, weighted;
            if (!ca_technique_images_get(page->images, technique, s, t, (size_t)y * page->full_width + x, &unweighted,
                                         &weighted))
                continue;
            sum.unweighted = ca_rgb_add(sum.unweighted, unweighted);
            sum.weighted = ca_rgb_add(sum.weighted, weighted);
        }
    const float scale = 1.0f / ((float)count * (float)page->passes);
    return (reduced_pixel){ca_rgb_scale(sum.unweighted, scale), ca_rgb_scale(sum.weighted, scale)};
}

static void reduce(const technique_page *page, ca_technique technique, uint32_t s, uint32_t t)
{
    for (uint32_t y = 0; y < page->height; y++)
        for (uint32_t x = 0; x < page->width; x++)
            page->pixels[(size_t)y * page->width + x] =
                reduce_pixel(page, technique, s, t, x * page->factor, y * page->factor);
}

static ca_rgb shown(const reduced_pixel *pixel, picture_kind kind)
{
    if (kind == WEIGHTED) return pixel->weighted;
    if (kind == UNWEIGHTED) return pixel->unweighted;
    const float found = ca_luminance(pixel->unweighted);
    return ca_rgb_grey(found != 0.0f ? ca_luminance(pixel->weighted) / found : 0.0f);
}

/* The reduced picture as the source of an <img>. */
static ca_status put_picture(const technique_page *page, picture_kind kind, FILE *stream, ca_error *error)
{
    const size_t count = (size_t)page->width * page->height;
    const float *const planes[3] = {page->planes, page->planes + count, page->planes + 2 * count};
    for (size_t i = 0; i < count; i++) {
        const ca_rgb value = shown(&page->pixels[i], kind);
        page->planes[i] = value.r;
        page->planes[count + i] = value.g;
        page->planes[2 * count + i] = value.b;
    }
    FILE *memory = fmemopen(page->png, page->png_size, "wb");
    if (!memory) return ca_fail_memory(error, "the page of the techniques");
    ca_status status = ca_png_write(planes, page->width, page->height, kind == WEIGHT ? 0.0f : page->exposure, memory,
                                    "index.html", error);
    const bool flushed = fflush(memory) == 0;
    const long size = ftell(memory);
    fclose(memory);
    if (status == CA_OK && (!flushed || size <= 0)) status = ca_fail_memory(error, "the page of the techniques");
    if (status == CA_OK) fwrite(page->text, 1, ca_base64(page->png, (size_t)size, page->text), stream);
    return status;
}

/* ---- Brightness ------------------------------------------------------------------------------------------------ */

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The image is the sum of the weighted pictures. */
static void look_at_all(technique_page *page)
{
    const size_t count = (size_t)page->width * page->height;
    for (uint32_t technique = 0; technique < CA_TECHNIQUE_COUNT; technique++)
        for (uint32_t s = 0; s < SIDE; s++)
            for (uint32_t t = 0; t < SIDE; t++) {
                if (!is_there(page, (ca_technique)technique, s, t)) continue;
                reduce(page, (ca_technique)technique, s, t);
                for (size_t i = 0; i < count; i++) page->planes[i] += ca_luminance(page->pixels[i].weighted);
            }
    for (size_t i = 0; i < count; i++) page->light += (double)page->planes[i];
    qsort(page->planes, count, sizeof *page->planes, compare_floats);
    const float bright = page->planes[(count - 1) - (count - 1) / 100];
    page->exposure = bright > 0.0f ? -log2f(bright) : 0.0f;
}

/* ---- HTML ------------------------------------------------------------------------------------------------------ */

static const char head[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
    "style-src 'unsafe-inline'\">\n<title>caustica: techniques</title>\n<style>\n"
    "body { background: #161616; color: #d0d0d0; font: 13px/1.4 'DejaVu Sans', Arial, sans-serif; margin: 12px; }\n"
    "table { border-spacing: 6px; } th { font-weight: normal; color: #949494; } td { text-align: center; }\n"
    "img { display: none; image-rendering: pixelated; }\n"
    "#weighted:checked ~ table .weighted, #unweighted:checked ~ table .unweighted, #weight:checked ~ table .weight "
    "{ display: block; }\n"
    "</style></head><body>\n"
    "<input type=\"radio\" name=\"kind\" id=\"weighted\" checked><label for=\"weighted\">what it adds to the "
    "image</label>\n"
    "<input type=\"radio\" name=\"kind\" id=\"unweighted\"><label for=\"unweighted\">what it finds alone</label>\n"
    "<input type=\"radio\" name=\"kind\" id=\"weight\"><label for=\"weight\">its weight, 0 to 1</label>\n";

static void put_head(const technique_page *page, FILE *stream)
{
    fputs(head, stream);
    fprintf(stream,
            "<p>A path has s vertices on the camera's side and t on the light's. Percentages: of the image's light. "
            "Pictures times 2^%.2f, %u pixels in one.</p>\n<table>\n<tr><th></th>",
            (double)page->exposure, page->factor * page->factor);
    for (uint32_t column = 0; column < COLUMNS; column++) {
        if (!column_is_used(page, column)) continue;
        const ca_technique technique = (ca_technique)(column / SIDE);
        fprintf(stream, "<th>%s", ca_technique_name(technique));
        if (has_columns(technique)) fprintf(stream, ", t = %u", column % SIDE);
        fputs("</th>", stream);
    }
    fputs("</tr>\n", stream);
}

static ca_status put_cell(const technique_page *page, ca_technique technique, uint32_t s, uint32_t t, FILE *stream,
                          ca_error *error)
{
    static const char *const kinds[KIND_COUNT] = {"weighted", "unweighted", "weight"};
    double light = 0.0;
    reduce(page, technique, s, t);
    for (size_t i = 0; i < (size_t)page->width * page->height; i++)
        light += (double)ca_luminance(page->pixels[i].weighted);
    fprintf(stream, "<td data-technique=\"%s\" data-s=\"%u\" data-t=\"%u\">", ca_technique_name(technique), s, t);
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        fprintf(stream, "<img class=\"%s\" width=\"%u\" height=\"%u\" alt=\"\" src=\"data:image/png;base64,",
                kinds[kind], page->width, page->height);
        CA_TRY(put_picture(page, (picture_kind)kind, stream, error));
        fputs("\">", stream);
    }
    fprintf(stream, "s = %u, t = %u: %.3g %%</td>", s, t, page->light != 0.0 ? 100.0 * light / page->light : 0.0);
    return CA_OK;
}

static ca_status put_row(const technique_page *page, uint32_t segments, FILE *stream, ca_error *error)
{
    fprintf(stream, "<tr><th>%u segment%s</th>", segments, segments == 1 ? "" : "s");
    for (uint32_t column = 0; column < COLUMNS; column++) {
        uint32_t s, t;
        if (!column_is_used(page, column)) continue;
        if (find_cell(page, column, segments, &s, &t))
            CA_TRY(put_cell(page, (ca_technique)(column / SIDE), s, t, stream, error));
        else
            fputs("<td></td>", stream);
    }
    fputs("</tr>\n", stream);
    return CA_OK;
}

static ca_status put_page(technique_page *page, FILE *stream, ca_error *error)
{
    look_at_all(page);
    put_head(page, stream);
    for (uint32_t segments = 0; segments < 2 * SIDE; segments++)
        if (row_is_used(page, segments)) CA_TRY(put_row(page, segments, stream, error));
    fputs("</table></body></html>\n", stream);
    return CA_OK;
}

/* ---- All of it ------------------------------------------------------------------------------------------------- */

static uint32_t divide_up(uint32_t a, uint32_t b) { return a / b + (a % b != 0); }

static ca_status open_page(technique_page *page, ca_error *error)
{
    ca_technique_images_size(page->images, &page->full_width, &page->full_height);
    const uint32_t longest = page->full_width > page->full_height ? page->full_width : page->full_height;
    page->factor = divide_up(longest, CA_TECHNIQUE_PAGE_SIDE);
    page->width = divide_up(page->full_width, page->factor);
    page->height = divide_up(page->full_height, page->factor);
    const size_t count = (size_t)page->width * page->height;
    page->png_size = 4 * count + 4096; /* three bytes a pixel, a little more where nothing can be packed */
    page->pixels = ca_alloc(count, sizeof *page->pixels);
    page->planes = ca_alloc_zeroed(3 * count, sizeof *page->planes);
    page->png = ca_alloc(page->png_size, 1);
    page->text = ca_alloc(page->png_size / 3 + 1, 4);
    const bool made = page->pixels && page->planes && page->png && page->text;
    return made ? CA_OK : ca_fail_memory(error, "the page of the techniques");
}

ca_status ca_technique_page_write(const ca_technique_images *images, uint32_t passes, const char *directory,
                                  ca_error *error)
{
    technique_page page = {.images = images, .passes = passes};
    ca_file_writer writer;
    char path[4096];
    if ((size_t)snprintf(path, sizeof path, "%s/index.html", directory) >= sizeof path)
        return ca_fail(error, CA_ERROR_FILE, NULL, "%.200s...: the folder's name is too long", directory);
    ca_status status = open_page(&page, error);
    if (status == CA_OK) status = ca_file_create(&writer, path, error);
    if (status == CA_OK) {
        status = put_page(&page, writer.stream, error);
        if (status == CA_OK)
            status = ca_file_commit(&writer, error);
        else
            ca_file_abandon(&writer);
    }
    ca_free(page.pixels);
    ca_free(page.planes);
    ca_free(page.png);
    ca_free(page.text);
    return status;
}
