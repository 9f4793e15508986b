/* The page's file: its head and sources, a record of each picture and a mark that these were all, then the channels:
 * small previews, colours, the others. Each part waits in a nameless file of its own until the last picture is there:
 * a kill before leaves nothing behind. */
#include "report/page.h"

#include "base/file.h"
#include "report/page_files.h"
#include "report/page_text.h"
#include "report/plane.h"

#include <errno.h>
#include <math.h>
#include <string.h>

enum { LAYER_BITS = 16, MAP_BITS = 12, ERROR_BITS = 8, PREVIEW_BITS = 8, PREVIEW_SIDE = 160 };

/* In the order in which a browser gets them. */
typedef enum page_part { PART_RECORDS, PART_PREVIEWS, PART_COLORS, PART_OTHERS, PARTS } page_part;

struct ca_page {
    const ca_page_settings *settings;
    const char *path;          /* borrowed */
    FILE *parts[PARTS];        /* owned; nameless */
    uint32_t width, height;    /* of the first picture */
    uint32_t image_count;
    bool *wanted_found;        /* one for each name in settings->layers */
    float *values;             /* of a derived channel at work */
};

/* ---- The names of layers to keep ------------------------------------------------------------------------------- */

/* The next name of a list with commas, NULL at its end. */
static const char *next_name(const char **list, size_t *length)
{
    if (!*list) return NULL;
    const char *name = *list;
    *length = strcspn(name, ",");
    *list = name[*length] ? name + *length + 1 : NULL;
    return name;
}

static size_t count_names(const char *list)
{
    size_t count = 0, length;
    while (next_name(&list, &length)) count++;
    return count;
}

static bool is_kept_map(const ca_page *page, const char *map)
{
    const char *list = page->settings->maps, *name;
    if (!list) return true;
    for (size_t length; (name = next_name(&list, &length)) != NULL;)
        if (strncmp(map, name, length) == 0 && map[length] == 0) return true;
    return false;
}

/* Does the channel's name, or the group it begins with ("Albedo" of "Albedo.R"), stand in the settings' list? */
static bool is_wanted(ca_page *page, const char *channel)
{
    const char *list = page->settings->layers, *name;
    size_t length, number = 0;
    bool wanted = false;
    for (; (name = next_name(&list, &length)) != NULL; number++) {
        const bool all = length == 3 && strncmp(name, "all", 3) == 0;
        const bool same = strncmp(channel, name, length) == 0 && (channel[length] == 0 || channel[length] == '.');
        if (!all && !same) continue;
        page->wanted_found[number] = wanted = true;
    }
    return wanted;
}

/* ---- Planes ---------------------------------------------------------------------------------------------------- */

/* Where a picture's planes go while its record is written. */
typedef struct plane_list {
    ca_page *page;
    uint32_t count;
    ca_status status;
    ca_error *error;
} plane_list;

/* Writes the plane and its line of the picture's record. */
static void put_values(plane_list *list, page_part part, const char *kind, const char *name, const float *values,
                       size_t count, int bits)
{
    if (list->status != CA_OK) return;
    ca_page *page = list->page;
    const ca_plane plane = {values,           count, bits, ca_plane_fits_half(values, count, bits), page->image_count,
                            list->count};
    FILE *stream = page->parts[PART_RECORDS];
    fprintf(stream, "%s{\"kind\":\"%s\",\"name\":", list->count++ ? ",\n" : "", kind);
    ca_page_put_json(stream, name);
    fprintf(stream, ",\"bits\":%d,\"half\":%s}", bits, plane.half ? "true" : "false");
    list->status = ca_plane_write(&plane, page->parts[part], list->error);
}

static void put_plane(plane_list *list, page_part part, const char *kind, const char *name, const float *values,
                      int bits)
{
    put_values(list, part, kind, name, values, (size_t)list->page->width * list->page->height, bits);
}

static bool is_color(const char *name) { return strlen(name) == 1 && strchr("RGB", name[0]); }

/* Standard error of the pixels' values; without two samples it is not known. */
static void standard_errors(const float *variance, const float *samples, size_t count, float *result)
{
    for (size_t i = 0; i < count; i++) {
        const double n = (double)samples[i], v = (double)variance[i];
        result[i] = n >= 2.0 && v >= 0.0 ? (float)sqrt(v / n) : NAN;
    }
}

static void put_standard_errors(plane_list *list, const ca_image_layers *layers)
{
    static const char *const names[3] = {"Variance.R", "Variance.G", "Variance.B"}, *const channels[3] = {"R", "G",
                                                                                                          "B"};
    const float *samples = ca_layers_find(layers, "Samples.Y");
    for (int c = 0; c < 3 && samples; c++) {
        const float *variance = ca_layers_find(layers, names[c]);
        if (!variance) continue;
        standard_errors(variance, samples, (size_t)layers->width * layers->height, list->page->values);
        put_plane(list, PART_OTHERS, "error", channels[c], list->page->values, ERROR_BITS);
    }
}

/* How far the ends of luminance's confidence interval are from it: a few bits say that better than many of the
 * ends. */
static void put_interval(plane_list *list, const ca_image_layers *layers)
{
    static const char *const ends[2] = {"ConfidenceLow.Y", "ConfidenceHigh.Y"}, *const kinds[2] = {"below", "above"};
    const float *rgb[3] = {ca_layers_find(layers, "R"), ca_layers_find(layers, "G"), ca_layers_find(layers, "B")};
    const size_t count = (size_t)layers->width * layers->height;
    float *values = list->page->values;
    for (int end = 0; end < 2; end++) {
        const float *bound = ca_layers_find(layers, ends[end]);
        if (!bound) continue;
        for (size_t i = 0; i < count; i++) {
            const double luminance =
                0.2126 * (double)rgb[0][i] + 0.7152 * (double)rgb[1][i] + 0.0722 * (double)rgb[2][i];
            values[i] = (float)(end == 0 ? luminance - (double)bound[i] : (double)bound[i] - luminance);
        }
        put_plane(list, PART_OTHERS, kinds[end], "Y", values, ERROR_BITS);
    }
}

static void put_other_channels(plane_list *list, const ca_page_image *image)
{
    put_standard_errors(list, image->layers);
    put_interval(list, image->layers);
    for (size_t i = 0; image->maps && i < image->maps->channel_count; i++) {
        const ca_channel *map = &image->maps->channels[i];
        if (is_kept_map(list->page, map->name)) put_plane(list, PART_OTHERS, "map", map->name, map->data, MAP_BITS);
    }
    for (size_t i = 0; i < image->layers->channel_count; i++) {
        const ca_channel *channel = &image->layers->channels[i];
        if (is_wanted(list->page, channel->name) && !is_color(channel->name))
            put_plane(list, PART_OTHERS, "layer", channel->name, channel->data, LAYER_BITS);
    }
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

static ca_status check_image(ca_page *page, const ca_page_image *image, ca_error *error)
{
    const ca_image_layers *layers = image->layers;
    if (!ca_layers_find(layers, "R") || !ca_layers_find(layers, "G") || !ca_layers_find(layers, "B"))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the picture has no channels R, G and B");
    if (page->width == 0) {
        page->width = layers->width;
        page->height = layers->height;
        page->values = ca_alloc((size_t)layers->width * layers->height, sizeof *page->values);
        if (!page->values) return ca_fail_memory(error, "the page's pictures");
    }
    const ca_image_layers *maps = image->maps ? image->maps : layers;
    if (layers->width == page->width && layers->height == page->height && maps->width == page->width &&
        maps->height == page->height)
        return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "the picture has %u x %u pixels, those before it %u x %u; a page shows pictures of one size",
                   layers->width, layers->height, page->width, page->height);
}

static void put_metrics(FILE *stream, const ca_page_image *image)
{
    static const char *const better[] = {"neither", "lower", "higher"};
    fputs("\"metrics\":[", stream);
    for (size_t i = 0; i < image->metric_count; i++) {
        const ca_page_metric *m = &image->metrics[i];
        fprintf(stream, "%s{\"name\":", i ? ",\n" : "");
        ca_page_put_json(stream, m->name);
        fputs(",\"meaning\":", stream);
        ca_page_put_json(stream, m->meaning ? m->meaning : "");
        fprintf(stream, ",\"better\":\"%s\",\"value\":", better[m->better]);
        ca_page_put_number(stream, m->value);
        fputc('}', stream);
    }
    fputs("],\n", stream);
}

/* How many pixels to each side become one of the preview. */
static uint32_t preview_factor(const ca_page *page)
{
    const uint32_t side = page->width > page->height ? page->width : page->height;
    return (side + PREVIEW_SIDE - 1) / PREVIEW_SIDE;
}

/* Mean of the finite values in each square, which may be cut at the right and lower border. */
static size_t average(const ca_page *page, const float *values, float *result)
{
    const uint32_t factor = preview_factor(page);
    size_t count = 0;
    for (uint32_t y0 = 0; y0 < page->height; y0 += factor)
        for (uint32_t x0 = 0; x0 < page->width; x0 += factor) {
            double sum = 0.0, pixels = 0.0;
            for (uint32_t y = y0; y < y0 + factor && y < page->height; y++)
                for (uint32_t x = x0; x < x0 + factor && x < page->width; x++) {
                    const float value = values[(size_t)y * page->width + x];
                    if (!isfinite(value)) continue;
                    sum += (double)value;
                    pixels += 1.0;
                }
            result[count++] = pixels > 0.0 ? (float)(sum / pixels) : 0.0f;
        }
    return count;
}

static void put_colors(plane_list *list, const ca_image_layers *layers)
{
    static const char *const names[3] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++)
        put_plane(list, PART_COLORS, "color", names[c], ca_layers_find(layers, names[c]), CA_PLANE_EXACT);
    for (int c = 0; c < 3; c++) {
        const size_t count = average(list->page, ca_layers_find(layers, names[c]), list->page->values);
        put_values(list, PART_PREVIEWS, "preview", names[c], list->page->values, count, PREVIEW_BITS);
    }
}

ca_status ca_page_add(ca_page *page, const ca_page_image *image, ca_error *error)
{
    CA_TRY(check_image(page, image, error));
    FILE *stream = page->parts[PART_RECORDS];
    plane_list list = {.page = page, .status = CA_OK, .error = error};
    const uint32_t factor = preview_factor(page);
    fprintf(stream, "<script type=\"application/json\" data-image=\"%u\">{\"name\":", page->image_count);
    ca_page_put_json(stream, image->name);
    fprintf(stream, ",\"reference\":%s,\n\"width\":%u,\"height\":%u,\"preview\":[%u,%u],\n",
            image->is_reference ? "true" : "false", page->width, page->height, (page->width + factor - 1) / factor,
            (page->height + factor - 1) / factor);
    put_metrics(stream, image);
    fputs("\"planes\":[", stream);
    put_colors(&list, image->layers);
    put_other_channels(&list, image);
    fputs("]}</script>\n", stream);
    page->image_count++;
    return list.status;
}

static ca_status append_part(const ca_page *page, page_part part, FILE *to, ca_error *error)
{
    enum { BUFFER_BYTES = 1 << 18 };
    char *buffer = ca_alloc(BUFFER_BYTES, 1);
    if (!buffer) return ca_fail_memory(error, "the page");
    FILE *from = page->parts[part];
    int reason = ferror(from) ? ca_file_write_failure(from) : 0;
    bool good = reason == 0 && fflush(from) == 0 && fseek(from, 0, SEEK_SET) == 0;
    for (size_t size = 1; good && size > 0;) {
        size = fread(buffer, 1, BUFFER_BYTES, from);
        good = fwrite(buffer, 1, size, to) == size && !ferror(from);
    }
    if (reason == 0) reason = ferror(to) ? ca_file_write_failure(to) : errno;
    ca_free(buffer);
    return good ? CA_OK
                : ca_fail(error, CA_ERROR_FILE, NULL, "%.900s: cannot write the page: %s", page->path,
                          strerror(reason));
}

/* ---- The page around them -------------------------------------------------------------------------------------- */

/* 'sha256-BASE64', as a Content-Security-Policy names a script or style that may run. */
static void put_hash(FILE *stream, const char *name)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned char hash[33] = {0};
    memcpy(hash, ca_page_file_named(name)->sha256, 32);
    fputs(" 'sha256-", stream);
    for (int i = 0; i < 33; i += 3) {
        const uint32_t word = (uint32_t)hash[i] << 16 | (uint32_t)hash[i + 1] << 8 | hash[i + 2];
        for (int k = 0; k < (i < 30 ? 4 : 3); k++) fputc(digits[word >> (18 - 6 * k) & 63], stream);
    }
    fputs("='", stream);
}

static void put_file(FILE *stream, const char *element, const char *name)
{
    const ca_page_file *file = ca_page_file_named(name);
    fprintf(stream, "<%s>", element);
    fwrite(file->data, 1, file->size, stream);
    fprintf(stream, "</%s>\n", element);
}

static void put_rect(FILE *stream, const ca_pixel_rect *r)
{
    fprintf(stream, "[%u,%u,%u,%u]", r->x0, r->y0, r->x1, r->y1);
}

static void put_settings(FILE *stream, const ca_page_settings *settings)
{
    fputs("<script type=\"application/json\" id=\"settings\">{\"roi\":", stream);
    if (settings->roi)
        put_rect(stream, settings->roi);
    else
        fputs("null", stream);
    fputs(",\"masks\":[", stream);
    for (size_t i = 0; i < settings->mask_count; i++) {
        if (i) fputc(',', stream);
        put_rect(stream, &settings->masks[i]);
    }
    fputs("]}</script>\n", stream);
}

static void put_data(FILE *stream, const ca_page_settings *settings)
{
    if (!settings->put_data) return;
    fputs("<script type=\"application/json\" id=\"data\">", stream);
    settings->put_data(stream, settings->data);
    fputs("</script>\n", stream);
}

static void put_head(FILE *stream, const ca_page_settings *settings)
{
    char body[64], script[64];
    const char *program = settings->program ? settings->program : "compare";
    snprintf(body, sizeof body, "%s.html", program);
    snprintf(script, sizeof script, "%s.js", program);
    fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
          "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; base-uri 'none'; form-action "
          "'none'; style-src", stream);
    put_hash(stream, "style.css");
    fputs("; script-src", stream);
    put_hash(stream, "viewer.js");
    put_hash(stream, "layers.js");
    put_hash(stream, script);
    fputs("\">\n<title>", stream);
    ca_page_put_html(stream, settings->title);
    fputs("</title>\n", stream);
    put_file(stream, "style", "style.css");
    fputs("</head>\n<body>\n", stream);
    fwrite(ca_page_file_named(body)->data, 1, ca_page_file_named(body)->size, stream);
    put_settings(stream, settings);
    put_data(stream, settings);
    put_file(stream, "script", "viewer.js");
    put_file(stream, "script", "layers.js");
    put_file(stream, "script", script);
}

ca_status ca_page_create(ca_page **page, const char *path, const ca_page_settings *settings, ca_error *error)
{
    ca_page *made = *page = ca_alloc_zeroed(1, sizeof *made);
    if (!made) return ca_fail_memory(error, "the page");
    made->settings = settings;
    made->path = path;
    made->wanted_found = ca_alloc_zeroed(count_names(settings->layers), sizeof *made->wanted_found);
    ca_status status = made->wanted_found ? CA_OK : ca_fail_memory(error, "the page");
    for (int part = 0; part < PARTS && status == CA_OK; part++)
        status = ca_file_open_scratch(&made->parts[part], path, error);
    if (status == CA_OK) {
        put_head(made->parts[PART_RECORDS], settings);
        return CA_OK;
    }
    ca_page_destroy(made);
    *page = NULL;
    return status;
}

bool ca_page_expect(ca_page *page, const ca_image_layers *layers)
{
    const size_t count = count_names(page->settings->layers);
    for (size_t i = 0; i < layers->channel_count; i++) (void)is_wanted(page, layers->channels[i].name);
    for (size_t i = 0; i < count; i++)
        if (!page->wanted_found[i]) return false;
    return true;
}

ca_status ca_page_check(const ca_page *page, ca_error *error)
{
    const char *list = page->settings->layers, *name;
    size_t length, number = 0;
    while ((name = next_name(&list, &length)) != NULL)
        if (!page->wanted_found[number++])
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "no picture has a layer \"%.*s\"", (int)length, name);
    return CA_OK;
}

ca_status ca_page_finish(ca_page *page, ca_error *error)
{
    CA_TRY(ca_page_check(page, error));
    fputs("<script type=\"text/plain\" id=\"all-images\"></script>\n", page->parts[PART_RECORDS]);
    ca_file_writer file;
    CA_TRY(ca_file_create(&file, page->path, error));
    ca_status status = CA_OK;
    for (int part = 0; part < PARTS && status == CA_OK; part++)
        status = append_part(page, (page_part)part, file.stream, error);
    fputs("</body>\n</html>\n", file.stream);
    if (status == CA_OK) return ca_file_commit(&file, error);
    ca_file_abandon(&file);
    return status;
}

void ca_page_destroy(ca_page *page)
{
    if (!page) return;
    for (int part = 0; part < PARTS; part++)
        if (page->parts[part]) fclose(page->parts[part]);
    ca_free(page->wanted_found);
    ca_free(page->values);
    ca_free(page);
}
