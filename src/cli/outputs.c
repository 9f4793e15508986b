#define _POSIX_C_SOURCE 200809L
#include "cli/outputs.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "film/part_file.h"
#include "image/layers.h"
#include "path/technique.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

ca_status ca_output_check_place(const char *path, ca_error *error)
{
    struct stat info;
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot write: this is not a regular file", path);
    ca_file_writer writer;
    CA_TRY(ca_file_create(&writer, path, error));
    ca_file_abandon(&writer);
    return CA_OK;
}

ca_status ca_outputs_check(const char *const *paths, size_t count, const char **part_path, ca_error *error)
{
    *part_path = NULL;
    for (size_t i = 0; i < count; i++) {
        assert(paths[i]);
        if (!ca_part_is_path(paths[i])) {
            CA_TRY(ca_layers_check_path(paths[i], error));
            continue;
        }
        if (*part_path)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "only one part file can be written: %s or %s", *part_path,
                           paths[i]);
        *part_path = paths[i];
    }
    for (size_t i = 0; i < count; i++) CA_TRY(ca_output_check_place(paths[i], error));
    return CA_OK;
}

ca_status ca_outputs_check_layers(const char *const *paths, size_t count, const ca_layer_choice *choice,
                                  ca_error *error)
{
    bool has_exr = false;
    CA_TRY(ca_layer_choice_check(choice, error));
    for (size_t i = 0; i < count; i++) has_exr = has_exr || strcasecmp(ca_path_extension(paths[i]), ".exr") == 0;
    if (has_exr || (!choice->names && !choice->half)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%s: only .exr has layers, and none is written",
                   choice->names ? "--layers" : "--half");
}

ca_status ca_outputs_write(const char *const *paths, size_t count, const ca_image_layers *image,
                           const ca_layer_choice *choice, double exposure, ca_error *error)
{
    ca_image_layers view;
    if (!image) return CA_OK; /* parts without an image: a part file is all that is written */
    ca_status status = ca_layer_choice_apply(choice, image, &view, error);
    if (status != CA_OK) return status;
    for (size_t i = 0; i < count && status == CA_OK; i++)
        if (!ca_part_is_path(paths[i])) status = ca_layers_write(&view, paths[i], (float)exposure, error);
    ca_free(view.channels);
    return status;
}

void ca_outputs_warn(const ca_render_statistics *s)
{
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
    if (stat(path, &info) != 0) return check_new_folder(path, error);
    if (!S_ISDIR(info.st_mode)) return ca_fail(error, CA_ERROR_FILE, NULL, "%s: this is not a folder", path);
    if (access(path, W_OK | X_OK) != 0)
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: no permission to write in this folder", path);
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
