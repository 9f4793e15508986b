#define _POSIX_C_SOURCE 200809L
#include "cli/outputs.h"

#include "base/file.h"
#include "base/leftovers.h"
#include "base/memory.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "cli/stats_json.h"
#include "film/part_file.h"
#include "image/image.h"
#include "image/layers.h"
#include "path/technique.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

static void say_leftover(const char *path, void *user)
{
    (void)user;
    ca_say(stderr, "caustica: warning: %s was left by a program that was killed while it wrote; nobody needs it\n",
           path);
}

void ca_output_tell_leftovers(const char *path) { ca_leftovers_find(path, say_leftover, NULL); }

static ca_status fail_empty(ca_error *error)
{
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the name of an output is empty");
}

ca_status ca_output_check_place(const char *path, ca_error *error)
{
    struct stat info;
    if (!*path) return fail_empty(error);
    if (strcmp(path, "-") == 0)
        return ca_fail(error, CA_ERROR_FILE, NULL,
                       "-: files are not written to standard output; a file of this name is ./-");
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write: this is not a regular file", path);
    ca_file_writer writer;
    CA_TRY(ca_file_create(&writer, path, error));
    ca_file_abandon(&writer);
    ca_output_tell_leftovers(path);
    return CA_OK;
}

ca_status ca_outputs_check_places(const ca_text_list *outputs, const char *stats, ca_places *places,
                                  ca_error *error)
{
    for (size_t i = 0; i < outputs->count; i++) {
        assert(outputs->items[i]);
        CA_TRY(ca_places_write(places, outputs->items[i], "--output", error));
    }
    if (stats) CA_TRY(ca_places_write(places, stats, "--stats", error));
    for (size_t i = 0; i < outputs->count; i++) CA_TRY(ca_output_check_place(outputs->items[i], error));
    return stats ? ca_output_check_place(stats, error) : CA_OK;
}

ca_status ca_outputs_check(const ca_text_list *outputs, const char *stats, const char **part_path, ca_places *places,
                           ca_error *error)
{
    *part_path = NULL;
    for (size_t i = 0; i < outputs->count; i++) {
        const char *path = outputs->items[i];
        if (!ca_part_is_path(path)) {
            CA_TRY(ca_layers_check_path(path, error));
            continue;
        }
        if (*part_path)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "only one part file can be written: %s or %s", *part_path,
                           path);
        *part_path = path;
    }
    return ca_outputs_check_places(outputs, stats, places, error);
}

static bool has_extension(const char *const *paths, size_t count, const char *extension)
{
    for (size_t i = 0; i < count; i++)
        if (strcasecmp(ca_path_extension(paths[i]), extension) == 0) return true;
    return false;
}

ca_status ca_outputs_check_layers(const char *const *paths, size_t count, const ca_layer_choice *choice,
                                  ca_error *error)
{
    if (has_extension(paths, count, ".exr") || (!choice->names && !choice->half)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s: only .exr has layers, and none is written",
                   choice->names ? "--layers" : "--half");
}

ca_status ca_outputs_check_look(const char *const *paths, size_t count, const ca_output_look *look, const char *tone,
                                ca_error *error)
{
    if (has_extension(paths, count, ".png") || (!tone && look->exposure == 0.0)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s: only .png has a look, and none is written",
                   tone ? "--tone" : "--exposure");
}

ca_status ca_outputs_find_tone(const char *name, ca_output_look *look, ca_error *error)
{
    ca_error reason = {""};
    look->tone = CA_TONE_SRGB;
    if (!name || ca_tone_find(name, &look->tone, &reason) == CA_OK) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--tone: %.900s", reason.message);
}

/* The light by which a .png, which encodes it as sRGB, shows the signal of the curve. */
static ca_rgb toned(const ca_output_look *look, double scale, ca_rgb linear)
{
    const ca_rgb shown = ca_tone_map(look->tone, scale, linear);
    if (look->tone != CA_TONE_LINEAR) return shown;
    return (ca_rgb){ca_srgb_to_linear(shown.r), ca_srgb_to_linear(shown.g), ca_srgb_to_linear(shown.b)};
}

static ca_status fill_toned(const ca_output_look *look, const float *const rgb[3], ca_image_layers *picture,
                            ca_error *error)
{
    static const char *const names[3] = {"R", "G", "B"};
    const size_t pixels = (size_t)picture->width * picture->height;
    const double scale = exp2(look->exposure);
    float *planes[3];
    for (int c = 0; c < 3; c++) CA_TRY(ca_layers_add(picture, names[c], &planes[c], error));
    for (size_t i = 0; i < pixels; i++) {
        const ca_rgb shown = toned(look, scale, (ca_rgb){rgb[0][i], rgb[1][i], rgb[2][i]});
        planes[0][i] = shown.r;
        planes[1][i] = shown.g;
        planes[2][i] = shown.b;
    }
    return CA_OK;
}

static ca_status write_toned(const ca_image_layers *image, const char *path, const ca_output_look *look,
                             ca_error *error)
{
    const float *rgb[3] = {ca_layers_find(image, "R"), ca_layers_find(image, "G"), ca_layers_find(image, "B")};
    ca_image_layers *picture;
    assert(rgb[0] && rgb[1] && rgb[2]);
    CA_TRY(ca_layers_create(&picture, image->width, image->height, error));
    ca_status status = fill_toned(look, rgb, picture, error);
    if (status == CA_OK) status = ca_layers_write(picture, path, 0.0f, error);
    ca_layers_destroy(picture);
    return status;
}

static ca_status write_image(const ca_image_layers *image, const char *path, const ca_output_look *look,
                             ca_error *error)
{
    const bool is_png = strcasecmp(ca_path_extension(path), ".png") == 0;
    if (is_png && look->tone != CA_TONE_SRGB) return write_toned(image, path, look, error);
    return ca_layers_write(image, path, (float)look->exposure, error);
}

void ca_output_note(ca_status *all, ca_error *error, ca_status status, const ca_error *reason)
{
    if (status == CA_OK) return;
    if (*all != CA_OK) ca_report_failure(error);
    *all = status;
    *error = *reason;
}

static ca_status write_images(const ca_output_files *files, const ca_image_layers *image, ca_error *error)
{
    ca_image_layers view;
    ca_error reason = {""};
    if (!image) return CA_OK; /* parts without an image: a part file is all that is written */
    ca_status all = ca_layer_choice_apply(&files->layers, image, &view, error);
    if (all != CA_OK) return all;
    for (size_t i = 0; i < files->count; i++)
        if (!ca_part_is_path(files->paths[i]))
            ca_output_note(&all, error, write_image(&view, files->paths[i], &files->look, &reason), &reason);
    ca_free(view.channels);
    return all;
}

ca_status ca_outputs_write(const ca_output_files *files, const ca_image_layers *image,
                           const ca_render_statistics *statistics, ca_error *error)
{
    ca_error reason = {""};
    ca_status all = write_images(files, image, error);
    if (files->stats)
        ca_output_note(&all, error,
                       ca_stats_write_render(files->stats, image, statistics, files->ranges, files->range_count,
                                             &reason),
                       &reason);
    return all;
}

/* .exr compresses 16 lines at a time, with four buffers for them; .png needs less than the small things, and three
 * planes for a curve; the layers of parts and of a page are not among them. */
ca_status ca_outputs_reserve(const ca_output_files *files, uint32_t width, uint32_t height, size_t more,
                             ca_reserve **reserve, ca_error *error)
{
    enum { LINES = 16, BUFFERS = 4, MOST_LAYERS = 96, PLANES = 3, SMALL_THINGS = 2 << 20 };
    const bool has_exr = has_extension(files->paths, files->count, ".exr");
    const bool has_png = has_extension(files->paths, files->count, ".png");
    size_t bytes = SMALL_THINGS + more;
    if (has_exr) bytes += (size_t)LINES * BUFFERS * MOST_LAYERS * sizeof(float) * width;
    if (has_png && files->look.tone != CA_TONE_SRGB) bytes += (size_t)PLANES * sizeof(float) * width * height;
    return ca_reserve_create(reserve, bytes, "the files of the image", NULL, error);
}

void ca_outputs_warn(const ca_render_statistics *s)
{
    if (s->lacks_layers)
        fprintf(stderr, "caustica: warning: the image is without the layers that the scene asks for (aov)%s\n",
                s->interrupted || ca_signals_arrived() ? ": the render ended before they were traced" : "");
    if (s->non_finite == 0) return;
    fprintf(stderr, "caustica: warning: %llu %s negative or not finite and dropped: a defect, please report it (",
            (unsigned long long)s->non_finite, ca_noun((double)s->non_finite, "sample was", "samples were"));
    const char *separator = "";
    for (int t = 0; t < CA_NON_FINITE_SOURCES; t++) {
        if (s->non_finite_from[t] == 0) continue;
        fprintf(stderr, "%s%s %llu", separator, t < CA_TECHNIQUE_COUNT ? ca_technique_name((ca_technique)t) : "film",
                (unsigned long long)s->non_finite_from[t]);
        separator = ", ";
    }
    fprintf(stderr, ")\n");
}

/* A folder to be made is tried as a file of its name, which a final slash does not belong to. */
static ca_status check_new_folder(const char *path, ca_error *error)
{
    size_t length = strlen(path);
    while (length > 0 && path[length - 1] == '/') length--;
    char *name = ca_alloc(length + 1, 1);
    if (!name) return ca_fail_memory(error, "the command line");
    memcpy(name, path, length);
    name[length] = '\0';
    const ca_status status = ca_output_check_place(name, error);
    ca_free(name);
    return status;
}

ca_status ca_output_check_folder(const char *path, ca_error *error)
{
    struct stat info;
    if (!*path) return fail_empty(error);
    if (stat(path, &info) != 0) return check_new_folder(path, error);
    if (!S_ISDIR(info.st_mode)) return ca_fail(error, CA_ERROR_FILE, NULL, "%s: this is not a folder", path);
    if (access(path, W_OK | X_OK) != 0)
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: no permission to write in this folder", path);
    ca_leftovers_find_in(path, say_leftover, NULL);
    return CA_OK;
}

char *ca_output_default(const char *scene_path, const char *extension)
{
    const char *slash = strrchr(scene_path, '/'), *name = slash ? slash + 1 : scene_path;
    const size_t length = strlen(name) - strlen(ca_path_extension(name)), size = length + strlen(extension) + 1;
    char *path = ca_alloc(size, 1);
    if (path) snprintf(path, size, "%.*s%s", (int)length, name, extension);
    return path;
}
