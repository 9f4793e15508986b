/* caustica converge, before the work: steps, integrators, names and keys of all renders, and whether they can be
 * made. */
#define _POSIX_C_SOURCE 200809L
#include "base/hash.h"
#include "base/processors.h"
#include "base/text.h"
#include "cli/converge.h"
#include "cli/outputs.h"
#include "metrics/picture_pair.h"
#include "render/part_settings.h"
#include "scene/scene.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

enum { STEP_LIMIT = 64, RENDER_LIMIT = 100000 };

/* Steps are identified by their texts, of twelve digits. */
#define SMALLEST_FACTOR (1.0 + 1e-10)

/* ---- Steps ----------------------------------------------------------------------------------------------------- */

static ca_status fail_steps(const char *text, bool whole, ca_error *error)
{
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "\"%.100s\" are no steps: rising %s like 1,4,16, or 1:64 (each twice the one before), or "
                   "1:1000:10 (ten times)",
                   text, whole ? "whole numbers" : "positive numbers");
}

static bool read_step(const char *text, size_t length, bool whole, double *value)
{
    if (!ca_parse_number(text, length, value) || !(*value > 0.0)) return false;
    return !whole || (*value <= (double)UINT32_MAX && *value == floor(*value));
}

/* "A:B" or "A:B:FACTOR"; false: malformed. *count above the limit: too many. */
static bool read_range(const char *text, bool whole, double *steps, size_t *count)
{
    double ends[3] = {0.0, 0.0, 2.0};
    int parts = 0;
    for (const char *c = text; c; parts++) {
        const size_t length = strcspn(c, ":");
        if (parts == 3 || !read_step(c, length, whole, &ends[parts])) return false;
        c = c[length] ? c + length + 1 : NULL;
    }
    if (parts < 2 || ends[1] < ends[0] || !(ends[2] > SMALLEST_FACTOR)) return false;
    /* The last one may miss B by rounding. */
    for (double step = ends[0]; step <= ends[1] * (1.0 + 1e-9); step *= ends[2]) {
        if (*count == STEP_LIMIT) return ++*count, true;
        steps[(*count)++] = step;
    }
    return true;
}

static bool read_list(const char *text, bool whole, double *steps, size_t *count)
{
    for (const char *c = text; c;) {
        const size_t length = strcspn(c, ",");
        double step;
        if (!read_step(c, length, whole, &step) || (*count > 0 && step <= SMALLEST_FACTOR * steps[*count - 1]))
            return false;
        if (*count == STEP_LIMIT) return ++*count, true;
        steps[(*count)++] = step;
        c = c[length] ? c + length + 1 : NULL;
    }
    return true;
}

static ca_status read_steps(const char *text, bool whole, ca_arena *memory, double **steps, size_t *count,
                            ca_error *error)
{
    *count = 0;
    *steps = ca_arena_alloc(memory, STEP_LIMIT, sizeof **steps);
    if (!*steps) return ca_fail_memory(error, "the steps");
    const bool good =
        strchr(text, ':') ? read_range(text, whole, *steps, count) : read_list(text, whole, *steps, count);
    if (!good) return fail_steps(text, whole, error);
    if (*count > STEP_LIMIT)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "\"%.100s\" are more than %d steps", text, STEP_LIMIT);
    return CA_OK;
}

static ca_status plan_steps(ca_converge *c, ca_error *error)
{
    const ca_converge_options *o = c->options;
    c->by_time = o->time != NULL;
    if ((o->spp != NULL) == c->by_time)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, o->spp ? "only one of --spp and --time can be given"
                                                               : "steps are missing: --spp or --time");
    ca_error reason = {""};
    const ca_status status =
        read_steps(c->by_time ? o->time : o->spp, !c->by_time, &c->memory, &c->steps, &c->step_count, &reason);
    if (status == CA_OK) return CA_OK;
    return ca_fail(error, status, NULL, "--%s: %.900s", c->by_time ? "time" : "spp", reason.message);
}

void ca_converge_step_text(const ca_converge *c, size_t step, char *text, size_t size)
{
    snprintf(text, size, "%.12g %s", c->steps[step], c->by_time ? "s" : "spp");
}

/* ---- Integrators ----------------------------------------------------------------------------------------------- */

/* A name for files: parameters may be long, and have signs that are none for a file. */
static const char *file_name(ca_converge *c, const char *text)
{
    char name[96];
    const size_t length = strcspn(text, ":");
    const uint64_t hash = ca_hash_bytes(CA_HASH_START, text, strlen(text));
    if (!text[length]) return text;
    snprintf(name, sizeof name, "%.*s-%08" PRIx32, (int)(length < 64 ? length : 64), text, (uint32_t)(hash >> 32));
    return ca_arena_strdup(&c->memory, name);
}

static ca_status add_integrator(ca_converge *c, const char *text, ca_error *error)
{
    char name[64];
    const ca_integrator_type *type;
    ca_error reason = {""};
    snprintf(name, sizeof name, "%.*s", (int)strcspn(text, ":"), text);
    if (ca_integrator_find(name, NULL, &type, &reason) != CA_OK)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--integrator: %.900s", reason.message);
    for (size_t i = 0; i < c->integrator_count; i++)
        if (strcmp(c->integrators[i].text, text) == 0)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--integrator: \"%.200s\" is there twice", text);
    ca_converge_integrator *added = &c->integrators[c->integrator_count++];
    *added = (ca_converge_integrator){.text = text, .name = file_name(c, text)};
    return added->name ? CA_OK : ca_fail_memory(error, "the integrators");
}

/* Each -i is one or several with ';' between them. */
static ca_status plan_integrators(ca_converge *c, ca_error *error)
{
    const ca_text_list *words = &c->options->integrators;
    size_t most = words->count;
    if (most == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "integrators are missing: -i path -i \"ovcm;vcm:radius=0.01\"");
    for (size_t i = 0; i < words->count; i++)
        for (const char *s = words->items[i]; *s; s++) most += *s == ';';
    c->integrators = ca_arena_alloc(&c->memory, most, sizeof *c->integrators);
    if (!c->integrators) return ca_fail_memory(error, "the integrators");
    for (size_t i = 0; i < words->count; i++) {
        char *word = ca_arena_strdup(&c->memory, words->items[i]);
        if (!word) return ca_fail_memory(error, "the integrators");
        for (bool more = true; more;) {
            const size_t length = strcspn(word, ";");
            more = word[length] != '\0';
            word[length] = '\0';
            CA_TRY(add_integrator(c, word, error));
            word += length + more;
        }
    }
    return CA_OK;
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

const char *ca_converge_path(ca_converge *c, const char *format, ...)
{
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const size_t folder = strlen(c->options->folder);
    const int length = vsnprintf(NULL, 0, format, arguments);
    char *path = ca_arena_alloc(&c->memory, folder + 1 + (size_t)length + 1, 1);
    if (path) {
        memcpy(path, c->options->folder, folder);
        path[folder] = '/';
        vsnprintf(path + folder + 1, (size_t)length + 1, format, again);
    }
    va_end(arguments);
    va_end(again);
    return path;
}

const char *ca_converge_picture_path(ca_converge *c, const char *name, const char *suffix, size_t closeup)
{
    if (closeup == 0) return ca_converge_path(c, "pictures/%s%s.png", name, suffix);
    return ca_converge_path(c, "pictures/%s%s-%zu.png", name, suffix, closeup);
}

const ca_converge_render *ca_converge_at(const ca_converge *c, size_t step, size_t integrator, size_t repeat)
{
    return &c->renders[(step * c->integrator_count + integrator) * c->repeats + repeat];
}

/* The same for all integrators, else its own; below 2^53, so that an EXR's number holds it. Depends on the step
 * itself and not on its place, so that steps can be added later. */
static uint64_t seed_of(const ca_converge *c, const ca_converge_render *r)
{
    const ca_render_settings *settings = &c->options->settings;
    const uint64_t seed = settings->has_seed ? settings->seed : c->scene->desc.sampler.seed;
    char step[64];
    ca_converge_step_text(c, r->step, step, sizeof step);
    return ca_hash_bytes(ca_hash_add(ca_hash_add(CA_HASH_START, seed), r->repeat), step, strlen(step)) >> 11;
}

ca_render_settings ca_converge_settings(const ca_converge *c, const ca_converge_render *r)
{
    ca_render_settings settings = c->options->settings;
    settings.integrator = c->integrators[r->integrator].text;
    settings.seed = r->seed;
    settings.has_seed = true;
    settings.width = c->options->resolution[0];
    settings.height = c->options->resolution[1];
    if (c->by_time)
        settings.seconds = c->steps[r->step];
    else
        settings.samples_per_pixel = (uint32_t)c->steps[r->step];
    return settings;
}

/* How long a render took is a result as well, so threads count. */
static const char *key_of(ca_converge *c, const ca_converge_render *r, const ca_render_plan *plan, ca_error *error)
{
    char *text, step[64];
    ca_converge_step_text(c, r->step, step, sizeof step);
    if (ca_part_settings_make(plan, &text, error) != CA_OK) return NULL;
    const size_t size = strlen(text) + sizeof step + 64;
    char *key = ca_arena_alloc(&c->memory, size, 1);
    if (key)
        snprintf(key, size, "%sstep %s\nthreads %u\n", text, step, plan->threads);
    else
        ca_fail_memory(error, "the renders");
    ca_free(text);
    return key;
}

static ca_status check_size(const ca_converge *c, const ca_render_plan *plan, ca_error *error)
{
    const uint32_t *crop = plan->crop;
    const ca_image_layers *reference = c->reference;
    const char *path = c->options->reference;
    if (reference->width != crop[2] - crop[0] || reference->height != crop[3] - crop[1])
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "--reference: %s has %u x %u pixels, but %u x %u are rendered (--resolution, --crop)", path,
                       reference->width, reference->height, crop[2] - crop[0], crop[3] - crop[1]);
    const bool same_film =
        reference->full_width == plan->camera.width && reference->full_height == plan->camera.height;
    if (same_film && (reference->x0 != (int32_t)crop[0] || reference->y0 != (int32_t)crop[1]))
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "--reference: %s is another part of the picture: it begins at (%d, %d), what is rendered at (%u, %u)",
            path, reference->x0, reference->y0, crop[0], crop[1]);
    return CA_OK;
}

/* Repeats of a sequence that has no random numbers would be one image, and say nothing of its error. */
static ca_status check_repeats(const ca_converge *c, const ca_render_plan *plan, ca_error *error)
{
    if (c->repeats == 1 || !ca_sampler_is_plain(plan->sampler.kind)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "--repeats: the sampler \"%s\" is not scrambled, all repeats would be equal",
                   ca_sampler_name(plan->sampler.kind));
}

static ca_status plan_render(ca_converge *c, ca_converge_render *r, ca_error *error)
{
    char step[64];
    ca_render_plan plan;
    ca_error reason = {""};
    r->seed = seed_of(c, r);
    const ca_render_settings settings = ca_converge_settings(c, r);
    const ca_status status = ca_render_plan_make(&plan, c->scene, &settings, &reason);
    if (status != CA_OK)
        return ca_fail(error, status, NULL, "%.200s: %.800s", c->integrators[r->integrator].text, reason.message);
    CA_TRY(check_size(c, &plan, error));
    CA_TRY(check_repeats(c, &plan, error));
    ca_converge_step_text(c, r->step, step, sizeof step);
    *strchr(step, ' ') = '\0';
    r->path = ca_converge_path(c, "renders/%s-%s%s-%zu.exr", c->integrators[r->integrator].name, step,
                               c->by_time ? "s" : "spp", r->repeat + 1);
    if (!r->path) return ca_fail_memory(error, "the renders");
    r->file = r->path + strlen(c->options->folder) + 1;
    r->key = key_of(c, r, &plan, error);
    return r->key ? CA_OK : CA_ERROR_MEMORY;
}

static ca_status plan_renders(ca_converge *c, ca_error *error)
{
    c->repeats = c->options->repeats;
    c->render_count = c->step_count * c->integrator_count * c->repeats;
    if (c->render_count > RENDER_LIMIT)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%zu renders are over the limit of %d", c->render_count,
                       RENDER_LIMIT);
    c->renders = ca_arena_alloc(&c->memory, c->render_count, sizeof *c->renders);
    c->fit_x = ca_arena_alloc(&c->memory, c->step_count * c->repeats, sizeof *c->fit_x);
    c->fit_y = ca_arena_alloc(&c->memory, c->step_count * c->repeats, sizeof *c->fit_y);
    if (!c->renders || !c->fit_x || !c->fit_y) return ca_fail_memory(error, "the renders");
    for (size_t i = 0; i < c->render_count; i++) {
        ca_converge_render *r = &c->renders[i];
        r->repeat = i % c->repeats;
        r->integrator = i / c->repeats % c->integrator_count;
        r->step = i / c->repeats / c->integrator_count;
        CA_TRY(plan_render(c, r, error));
    }
    return CA_OK;
}

/* ---- Where to look --------------------------------------------------------------------------------------------- */

static ca_pixel_rect *copy_rects(ca_converge *c, const ca_rect_list *list)
{
    ca_pixel_rect *rects =
        ca_arena_alloc(&c->memory, list->count + 1, sizeof *rects); /* one more: a close-up found */
    for (size_t i = 0; rects && i < list->count; i++) {
        const uint32_t *r = list->items[i];
        rects[i] = (ca_pixel_rect){r[0], r[1], r[2], r[3]};
    }
    return rects;
}

static ca_status plan_region(ca_converge *c, ca_error *error)
{
    const ca_converge_options *o = c->options;
    const ca_image_layers *reference = c->reference;
    const ca_pixel_rect *masks = copy_rects(c, &o->masks);
    c->closeups = copy_rects(c, &o->closeups);
    if (!masks || !c->closeups) return ca_fail_memory(error, "the command line");
    c->closeup_count = o->closeups.count;
    for (size_t i = 0; i < c->closeup_count; i++)
        if (c->closeups[i].x1 > reference->width || c->closeups[i].y1 > reference->height)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--closeup %u,%u,%u,%u reaches out of the %u x %u pixels",
                           c->closeups[i].x0, c->closeups[i].y0, c->closeups[i].x1, c->closeups[i].y1,
                           reference->width, reference->height);
    c->region = (ca_compare_settings){.has_roi = o->has_roi,
                                      .roi = {o->roi[0], o->roi[1], o->roi[2], o->roi[3]},
                                      .masks = masks,
                                      .mask_count = o->masks.count};
    c->metrics = ca_metric_defaults();
    c->metrics.threads = o->settings.threads ? o->settings.threads : ca_processors();
    /* The reference against itself: whatever is wrong with it, or with the region, is so with every image. */
    ca_comparison trial;
    ca_error reason = {""};
    const ca_status status = ca_compare(reference, reference, &c->region, &trial, &reason);
    if (status == CA_OK) return CA_OK;
    return ca_fail(error, status, NULL, "%s: %.900s", o->reference, reason.message);
}

/* What the reference's own noise adds to the squares of differences, from its layers Variance.* and Samples.Y. */
static void find_reference_noise(ca_converge *c)
{
    static const char *const names[3] = {"Variance.R", "Variance.G", "Variance.B"};
    const float *variance[3], *samples = ca_layers_find(c->reference, "Samples.Y");
    ca_picture_pair pair;
    double count = 0.0, square = 0.0, relative = 0.0;
    c->reference_noise[0] = c->reference_noise[1] = (double)NAN;
    if (!samples || ca_picture_pair_open(c->reference, c->reference, &c->region, &pair, NULL) != CA_OK) return;
    for (int k = 0; k < 3; k++)
        if (!(variance[k] = ca_layers_find(c->reference, names[k]))) return;
    for (uint32_t y = pair.roi.y0; y < pair.roi.y1; y++)
        for (uint32_t x = pair.roi.x0; x < pair.roi.x1; x++) {
            const size_t at = (size_t)y * pair.width + x;
            if (ca_picture_pair_is_masked(&pair, x, y) || !ca_picture_pair_is_finite(&pair, at)) continue;
            if (!(samples[at] >= 2.0f)) return; /* a variance that is not known */
            for (int k = 0; k < 3; k++, count++) {
                const double v = (double)variance[k][at] / (double)samples[at], b = (double)pair.reference[k][at];
                square += v;
                relative += v / (b * b + 0.01);
            }
        }
    c->reference_noise[0] = sqrt(square / count);
    c->reference_noise[1] = relative / count;
}

/* ---- All of it ------------------------------------------------------------------------------------------------- */

static ca_status make_folder(const char *path, ca_error *error)
{
    if (!path) return ca_fail_memory(error, "the folders");
    if (mkdir(path, 0777) == 0 || errno == EEXIST) return ca_output_check_folder(path, error);
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot make this folder: %s", path, strerror(errno));
}

/* With its close-ups: where none are given one is chosen later. */
static ca_status check_picture(ca_converge *c, ca_places *places, const char *name, const char *suffix,
                               ca_error *error)
{
    const size_t closeups = c->closeup_count > 0 ? c->closeup_count : 1;
    for (size_t k = 0; k <= closeups; k++) {
        const char *path = ca_converge_picture_path(c, name, suffix, k);
        if (!path) return ca_fail_memory(error, "the pictures");
        CA_TRY(ca_places_check(places, path, "--output", error));
    }
    return CA_OK;
}

static ca_status check_pictures(ca_converge *c, ca_places *places, ca_error *error)
{
    CA_TRY(check_picture(c, places, "reference", "", error));
    for (size_t i = 0; i < c->integrator_count; i++) {
        CA_TRY(check_picture(c, places, c->integrators[i].name, "", error));
        CA_TRY(check_picture(c, places, c->integrators[i].name, "-deviation", error));
    }
    return CA_OK;
}

/* Renders that are there are written again where their settings are others. */
static ca_status note_places(ca_converge *c, ca_places *places, ca_error *error)
{
    static const char *const names[] = {"index.html",      "images.html",       "renders.csv",
                                        "error-time.svg", "error-samples.svg", "converge.json"};
    CA_TRY(ca_places_read(places, c->options->reference, "which is the reference", error));
    CA_TRY(ca_places_read_scene(places, c->scene, error));
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        CA_TRY(ca_places_write_in(places, c->options->folder, names[i], "--output", error));
    for (size_t i = 0; i < c->render_count; i++)
        CA_TRY(ca_places_check(places, c->renders[i].path, "--output", error));
    return check_pictures(c, places, error);
}

static ca_status check_places(ca_converge *c, ca_error *error)
{
    ca_places places = {0};
    const ca_status status = note_places(c, &places, error);
    ca_places_destroy(&places);
    return status;
}

static ca_status check_needed(const ca_converge_options *o, ca_error *error)
{
    if (!o->reference) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "option --reference is missing");
    if (!o->folder || !*o->folder)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the folder is missing: --output FOLDER");
    if (o->has_exposure && fabs(o->exposure) > 100.0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--exposure: %g is not from -100 to 100", o->exposure);
    return CA_OK;
}

ca_status ca_converge_open(ca_converge *c, const ca_converge_options *options, ca_error *error)
{
    *c = (ca_converge){.options = options};
    CA_TRY(check_needed(options, error));
    CA_TRY(plan_steps(c, error));
    CA_TRY(plan_integrators(c, error));
    CA_TRY(ca_layers_read(options->reference, &c->reference, error));
    CA_TRY(plan_region(c, error));
    CA_TRY(ca_options_load_scene(options->scene, &options->defines, !options->quiet, &c->scene, error));
    CA_TRY(plan_renders(c, error));
    find_reference_noise(c);
    CA_TRY(make_folder(options->folder, error));
    CA_TRY(make_folder(ca_converge_path(c, "renders"), error));
    CA_TRY(make_folder(ca_converge_path(c, "pictures"), error));
    return check_places(c, error);
}

void ca_converge_destroy(ca_converge *c)
{
    ca_scene_release(c->scene);
    ca_layers_destroy(c->reference);
    ca_arena_clear(&c->memory);
    *c = (ca_converge){0};
}
