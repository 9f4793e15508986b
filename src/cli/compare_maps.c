#include "cli/compare_maps.h"

#include "base/file.h"
#include "base/memory.h"
#include "cli/outputs.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* ---- Names ----------------------------------------------------------------------------------------------------- */

/* Without folder and extension: where it starts and how long it is. */
typedef struct bare_name {
    const char *start;
    size_t length;
} bare_name;

static bare_name bare_name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    bare_name name = {.start = slash ? slash + 1 : path};
    name.length = strlen(name.start) - strlen(ca_path_extension(path));
    return name;
}

static bool all_differ(const ca_text_list *images)
{
    for (size_t i = 0; i < images->count; i++)
        for (size_t j = 0; j < i; j++) {
            const bare_name a = bare_name_of(images->items[i]), b = bare_name_of(images->items[j]);
            if (a.length == b.length && strncmp(a.start, b.start, a.length) == 0) return false;
        }
    return true;
}

static char *make_name(const char *pattern, const char *image, size_t number, bool several, bool numbered)
{
    const size_t size = strlen(pattern) + strlen(image) + 32;
    char *name = ca_alloc(size, 1);
    if (!name) return NULL;
    const char *extension = ca_path_extension(pattern);
    const int stem = (int)(strlen(pattern) - strlen(extension));
    const bare_name bare = bare_name_of(image);
    if (!several)
        snprintf(name, size, "%s", pattern);
    else if (numbered)
        snprintf(name, size, "%.*s-%zu-%.*s%s", stem, pattern, number, (int)bare.length, bare.start, extension);
    else
        snprintf(name, size, "%.*s-%.*s%s", stem, pattern, (int)bare.length, bare.start, extension);
    return name;
}

ca_status ca_compare_check_output(const char *option, const char *path, ca_places *places, ca_error *error)
{
    CA_TRY(ca_places_write(places, path, option, error));
    return ca_output_check_place(path, error);
}

ca_status ca_compare_map_names(const char *pattern, const ca_text_list *images, ca_places *places, char ***names,
                               ca_error *error)
{
    *names = ca_alloc_zeroed(images->count, sizeof **names);
    if (!*names) return ca_fail_memory(error, "the command line");
    if (strcasecmp(ca_path_extension(pattern), ".exr") != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--maps %s: only an .exr file can hold the maps", pattern);
    const bool numbered = !all_differ(images);
    for (size_t i = 0; i < images->count; i++) {
        (*names)[i] = make_name(pattern, images->items[i], i + 1, images->count > 1, numbered);
        if (!(*names)[i]) return ca_fail_memory(error, "the command line");
        CA_TRY(ca_compare_check_output("--maps", (*names)[i], places, error));
    }
    return CA_OK;
}

void ca_compare_map_names_destroy(char **names, size_t count)
{
    for (size_t i = 0; names && i < count; i++) ca_free(names[i]);
    ca_free(names);
}

/* ---- Writing --------------------------------------------------------------------------------------------------- */

static ca_status add_settings(const ca_metric_settings *s, ca_image_layers *maps, ca_error *error)
{
    CA_TRY(ca_layers_set_text(maps, "caustica.toneCurve", ca_tone_name(s->tone), error));
    CA_TRY(ca_layers_set_number(maps, "caustica.exposure", s->exposure, error));
    CA_TRY(ca_layers_set_number(maps, "caustica.ssimWindow", s->ssim.window, error));
    CA_TRY(ca_layers_set_number(maps, "caustica.ssimSigma", s->ssim.sigma, error));
    CA_TRY(ca_layers_set_number(maps, "caustica.ssimRange", s->ssim.range, error));
    CA_TRY(ca_layers_set_number(maps, "caustica.pixelsPerDegree", s->pixels_per_degree, error));
    return ca_layers_set_text(maps, "caustica.flipToneCurve", ca_tone_name(s->flip_tone), error);
}

static ca_status add_numbers(const ca_compared_image *image, ca_image_layers *maps, ca_error *error)
{
    const struct {
        const char *name;
        double value;
    } numbers[] = {
        {"caustica.rmse", image->comparison.rmse},     {"caustica.mae", image->comparison.mae},
        {"caustica.relmse", image->comparison.relmse}, {"caustica.smape", image->comparison.smape},
        {"caustica.ssim", image->metrics.ssim},        {"caustica.flipLDR", image->metrics.flip_ldr},
        {"caustica.flipHDR", image->metrics.flip_hdr},
    };
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        if (!isnan(numbers[i].value)) CA_TRY(ca_layers_set_number(maps, numbers[i].name, numbers[i].value, error));
    return CA_OK;
}

ca_status ca_compare_write_maps(const char *path, const char *reference, const ca_compared_image *image,
                                const ca_metric_settings *settings, ca_image_layers *maps, ca_error *error)
{
    CA_TRY(ca_layers_set_text(maps, "caustica.image", image->path, error));
    CA_TRY(ca_layers_set_text(maps, "caustica.reference", reference, error));
    CA_TRY(add_numbers(image, maps, error));
    CA_TRY(add_settings(settings, maps, error));
    return ca_layers_write(maps, path, 0.0f, error);
}
