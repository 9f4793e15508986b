#define _POSIX_C_SOURCE 200809L
#include "cli/study_render.h"

#include "base/hash.h"
#include "base/memory.h"
#include "base/text.h"
#include "cli/look_ahead.h"
#include "cli/outputs.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "image/layers.h"
#include "scene/scene.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SETTINGS_SIZE = 1024 };
static const char settings_attribute[] = "caustica.study";

char *ca_study_image_path(const ca_study_work *work, uint32_t scenario, bool is_reference)
{
    const char *name = work->config->scenarios[scenario].name, *kind = is_reference ? "reference" : "image";
    const size_t size = strlen(work->folder) + strlen(name) + strlen(kind) + sizeof "/images/-.exr";
    char *path = ca_alloc(size, 1);
    if (path) snprintf(path, size, "%s/images/%s-%s.exr", work->folder, name, kind);
    return path;
}

static ca_status make_folder(const char *path, ca_error *error)
{
    if (mkdir(path, 0777) == 0 || errno == EEXIST) return CA_OK;
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot make this folder: %s", path, strerror(errno));
}

static ca_status make_folders(const ca_study_work *work, ca_error *error)
{
    const size_t size = strlen(work->folder) + sizeof "/images";
    char *path = ca_alloc(size, 1);
    if (!path) return ca_fail_memory(error, "the study");
    snprintf(path, size, "%s/images", work->folder);
    ca_status status = make_folder(work->folder, error);
    if (status == CA_OK) status = make_folder(path, error);
    ca_free(path);
    return status;
}

/* ---- One image ------------------------------------------------------------------------------------------------- */

/* All that the image depends on. */
static void describe(const ca_study_work *work, const ca_scene *scene, const ca_study_render *render,
                     char text[SETTINGS_SIZE])
{
    snprintf(text, SETTINGS_SIZE,
             "version %s, scene %016" PRIx64 ", film %ux%u, integrator %.600s, sampler %.64s, spp %u, seed %u",
             ca_version(), scene->desc.content_hash, work->config->width, work->config->height,
             render->integrator ? render->integrator : "of the scene",
             render->sampler ? render->sampler : "of the scene", render->spp, render->seed);
}

/* *done: there is an image with these settings. A damaged one is rendered again; one that cannot be read is not, as
 * it may be what is wanted. */
static ca_status look_for(const char *path, const char *settings, bool *done, ca_error *error)
{
    ca_image_layers *layers;
    *done = false;
    if (access(path, F_OK) != 0 && (errno == ENOENT || errno == ENOTDIR)) return CA_OK;
    const ca_status status = ca_layers_read(path, &layers, error);
    if (status == CA_ERROR_FORMAT || status == CA_ERROR_UNSUPPORTED) return CA_OK;
    if (status != CA_OK) return status;
    const ca_attribute *its = ca_layers_attribute(layers, settings_attribute);
    *done = its && its->text && strcmp(its->text, settings) == 0;
    ca_layers_destroy(layers);
    return CA_OK;
}

static ca_status render_scene(const ca_study_work *work, const ca_scene *scene, const ca_study_render *render,
                              const char *name, ca_image_layers **image, ca_render_statistics *statistics,
                              ca_error *error)
{
    ca_progress_line line = ca_progress_start(!work->quiet);
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = render->integrator;
    settings.sampler = render->sampler;
    settings.samples_per_pixel = render->spp;
    settings.seed = render->seed;
    settings.has_seed = true;
    settings.width = work->config->width;
    settings.height = work->config->height;
    settings.threads = work->threads;
    settings.progress = ca_progress_report;
    settings.progress_user = &line;
    settings.stop = ca_signals_stop();
    ca_status status = ca_look_ahead(scene, &settings, name, &settings.radius, error);
    if (status == CA_OK) status = ca_render(scene, &settings, image, statistics, error);
    ca_progress_clear(&line);
    return status;
}

static ca_status render_file(const ca_study_work *work, const ca_scene *scene, const ca_study_render *render,
                             const char *path, const char *text, ca_error *error)
{
    ca_image_layers *image = NULL;
    ca_render_statistics statistics = {0};
    char time[32];
    ca_status status = render_scene(work, scene, render, path, &image, &statistics, error);
    if (status == CA_OK && statistics.interrupted)
        status = ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                         "stopped by a signal; the same command goes on where this one ended");
    if (status == CA_OK) status = ca_layers_set_text(image, settings_attribute, text, error);
    if (status == CA_OK) status = ca_layers_write(image, path, 0.0f, error);
    ca_image_release(image);
    if (status != CA_OK) return status;
    ca_outputs_warn(&statistics);
    ca_format_seconds(statistics.seconds, time, sizeof time);
    if (!work->quiet)
        ca_say(stdout, "rendered %s, %.4g %s per pixel, %s\n", path, statistics.samples_per_pixel,
               ca_noun(statistics.samples_per_pixel, "sample", "samples"), time);
    fflush(stdout);
    return CA_OK;
}

static ca_status render_unless_done(const ca_study_work *work, const ca_scene *scene, const ca_study_render *render,
                                    const char *path, const char *settings, ca_error *error)
{
    bool done;
    CA_TRY(look_for(path, settings, &done, error));
    if (!done) return render_file(work, scene, render, path, settings, error);
    if (!work->quiet) ca_say(stdout, "there is %s\n", path);
    return CA_OK;
}

/* The scene with all that it reads, and what will be made of it. */
static ca_status note_places(const ca_study_work *work, const ca_scene *scene, const char *path, ca_error *error)
{
    CA_TRY(ca_places_read_scene(work->places, scene, error));
    return ca_places_write(work->places, path, "--output", error);
}

/* What the scene says against a definition, or against having any, is told where the study has it. */
static ca_status fail_define(const ca_study_work *work, const ca_study_scenario *scenario, ca_error *error)
{
    const ca_error reason = *error;
    const ca_json *document = work->config->document;
    for (size_t i = 0; i < scenario->define_count; i++) {
        const ca_define *define = &scenario->defines[i];
        char begins[sizeof reason.message];
        snprintf(begins, sizeof begins, "-D %s=%s: ", define->name, define->value);
        const size_t length = strlen(begins);
        if (strncmp(reason.message, begins, length) == 0)
            return ca_json_fail(document, scenario->define, define->name, error, "\"%.100s\" of scenario %s: %.300s",
                                define->name, scenario->name, reason.message + length);
    }
    return ca_json_fail(document, scenario->define, NULL, error, "scenario %s: %.400s", scenario->name,
                        reason.message);
}

/* Renders the image, or only asks what it depends on. */
static ca_status make_image(const ca_study_work *work, uint32_t number, bool is_reference, bool only_ask,
                            uint64_t *id, ca_error *error)
{
    const ca_study_scenario *scenario = &work->config->scenarios[number];
    const ca_study_render *render = is_reference ? &work->config->reference : &work->config->image;
    ca_scene *scene;
    char settings[SETTINGS_SIZE];
    const ca_scene_source source = {.path = scenario->path,
                                    .defines = scenario->defines,
                                    .define_count = scenario->define_count,
                                    .stop = ca_signals_stop(),
                                    .memory_mib = work->memory_mib};
    ca_status status = ca_scene_parse(&source, &scene, error);
    if (status == CA_ERROR_ARGUMENT && scenario->define_count > 0) return fail_define(work, scenario, error);
    CA_TRY(status);
    if (!only_ask) ca_options_say_notes(scene);
    describe(work, scene, render, settings);
    *id = ca_hash_bytes(*id, settings, strlen(settings));
    char *path = ca_study_image_path(work, number, is_reference);
    if (!path) {
        status = ca_fail_memory(error, "the study");
    } else if (only_ask) {
        status = note_places(work, scene, path, error);
    } else {
        ca_error reason = {""};
        status = render_unless_done(work, scene, render, path, settings, &reason);
        if (status != CA_OK)
            ca_fail(error, status, NULL, "scenario %s, %s: %.800s", scenario->name,
                    is_reference ? "reference" : "image", reason.message);
    }
    ca_free(path);
    ca_scene_release(scene);
    /* The words of the command line were right: what is wrong is in the config. */
    return status == CA_ERROR_ARGUMENT ? CA_ERROR_UNSUPPORTED : status;
}

static ca_status make_images(const ca_study_work *work, bool only_ask, uint64_t *id, ca_error *error)
{
    *id = ca_json_hash(work->config->document);
    for (uint32_t i = 0; i < work->config->scenario_count; i++)
        for (int is_reference = 0; is_reference < 2; is_reference++)
            CA_TRY(make_image(work, i, is_reference, only_ask, id, error));
    return CA_OK;
}

ca_status ca_study_render_images(const ca_study_work *work, uint64_t *id, ca_error *error)
{
    CA_TRY(make_images(work, true, id, error));
    CA_TRY(make_folders(work, error));
    ca_signals_catch(true);
    const ca_status status = make_images(work, false, id, error);
    ca_signals_release();
    return status;
}
