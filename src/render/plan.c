/* From a scene and settings to a plan: what the settings leave open, the scene says. */
#include "render/render.h"

#include "base/processors.h"
#include "base/text.h"
#include "film/part_file.h"
#include "math/numeric.h"
#include "render/pass.h"
#include "render/ranks.h"
#include "render/replicates.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t scale_edge(uint32_t edge, uint32_t from, uint32_t to)
{
    return (uint32_t)(((uint64_t)edge * to + from / 2) / from);
}

/* The edges of the scene's crop in a film of another size: at least one pixel is left. */
static void scale_crop(uint32_t first, uint32_t count, uint32_t from, uint32_t to, uint32_t *low, uint32_t *high)
{
    *low = ca_min_u32(scale_edge(first, from, to), to - 1);
    *high = ca_max_u32(scale_edge(first + count, from, to), *low + 1);
}

static ca_status check_size(const ca_scene_desc *desc, uint32_t width, uint32_t height, ca_error *error)
{
    const ca_film_desc *film = &desc->film;
    const ca_camera *camera = &desc->camera.camera;
    if (film->is_fixed && (width != film->width || height != film->height))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the scene's sensor measures %u x %u pixels, and a film of %u x %u is asked for", film->width,
                       film->height, width, height);
    if (camera->kind == CA_CAMERA_PANELS && width % camera->as.panels.count != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "a film of %u pixels a row cannot be divided among the batch's %u sensors", width,
                       camera->as.panels.count);
    return CA_OK;
}

static ca_status plan_film(ca_render_plan *plan, uint32_t *width, uint32_t *height, ca_error *error)
{
    const ca_film_desc *film = &plan->scene->desc.film;
    const ca_render_settings *settings = plan->settings;
    *width = settings->width ? settings->width : film->width;
    *height = settings->height ? settings->height : film->height;
    if (*width > CA_IMAGE_MAX_SIDE || *height > CA_IMAGE_MAX_SIDE)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "a film of %u x %u pixels is over the limit of %d a side",
                       *width, *height, CA_IMAGE_MAX_SIDE);
    CA_TRY(check_size(&plan->scene->desc, *width, *height, error));
    if (settings->has_crop) {
        memcpy(plan->crop, settings->crop, sizeof plan->crop);
    } else {
        scale_crop(film->crop_x, film->crop_width, film->width, *width, &plan->crop[0], &plan->crop[2]);
        scale_crop(film->crop_y, film->crop_height, film->height, *height, &plan->crop[1], &plan->crop[3]);
    }
    const uint32_t *c = plan->crop;
    if (c[0] >= c[2] || c[1] >= c[3] || c[2] > *width || c[3] > *height)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the crop %u,%u,%u,%u is empty or leaves the film of %u x %u pixels", c[0], c[1], c[2], c[3],
                       *width, *height);
    return CA_OK;
}

/* A scene's sampler is meant for the scene's integrator: another one brings its own, where it has one. */
static ca_status plan_sampler(ca_render_plan *plan, ca_error *error)
{
    const ca_scene_desc *desc = &plan->scene->desc;
    const bool chosen_for_it = desc->names_sampler && !plan->settings->integrator;
    plan->sampler = desc->sampler;
    if (plan->type->sampler != CA_SAMPLER_INDEPENDENT && !chosen_for_it) plan->sampler.kind = plan->type->sampler;
    if (plan->settings->has_seed) plan->sampler.seed = plan->settings->seed;
    const char *wanted = plan->settings->sampler;
    if (!wanted) return CA_OK;
    if (ca_sampler_find(wanted, &plan->sampler.kind)) return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "unknown sampler \"%.100s\" (there are: %s)", wanted,
                   ca_sampler_names());
}

/* ---- The integrator and its parameters ------------------------------------------------------------------------- */

const char *ca_render_overrides(const char *integrator)
{
    const char *colon = integrator ? strchr(integrator, ':') : NULL;
    return colon ? colon + 1 : NULL;
}

bool ca_render_overrides_mention(const char *integrator, const char *name)
{
    const size_t length = strlen(name);
    for (const char *c = ca_render_overrides(integrator); c; c = strchr(c, ',') ? strchr(c, ',') + 1 : NULL)
        if (strncmp(c, name, length) == 0 && c[length] == '=') return true;
    return false;
}

/* A setting for an integrator's parameter: it overrides the scene, and must not contradict the text behind the
 * integrator's name. */
typedef struct own_setting {
    const char *name, *what; /* "integrator "path" has no <what>" */
    bool given;
    double value;
    bool may_be_open; /* 0 among the integrator's own parameters leaves it open */
} own_setting;

static ca_status apply_setting(ca_render_plan *plan, const own_setting *setting, ca_error *error)
{
    if (!setting->given) return CA_OK;
    const double before = ca_integrator_value(plan->type, &plan->input, setting->name, (double)NAN);
    if (isnan(before))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "integrator \"%s\" has no %s", plan->type->name,
                       setting->what);
    const bool is_open = setting->may_be_open && before == 0.0;
    const bool is_own = !is_open && ca_render_overrides_mention(plan->settings->integrator, setting->name);
    if (is_own && before != setting->value)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "\"%s\" is %.9g among the integrator's own parameters but %.9g as a setting", setting->name,
                       before, setting->value);
    return ca_integrator_set_number(plan->type, setting->name, setting->value, &plan->input, error);
}

enum { OWN_SETTINGS = 5 };

static void list_own_settings(const ca_render_settings *s, own_setting own[OWN_SETTINGS])
{
    own[0] = (own_setting){"max_depth", "limit on the length of paths", s->has_max_depth, s->max_depth, false};
    own[1] = (own_setting){"radius", "merge radius", s->radius != 0.0, s->radius, true};
    own[2] = (own_setting){"alpha", "merge radius to shrink", s->has_alpha, s->alpha, false};
    own[3] = (own_setting){"light_paths", "light paths", s->light_paths != 0, s->light_paths, false};
    own[4] = (own_setting){"camera_paths", "number of camera paths to choose: each pass makes one per pixel",
                           s->camera_paths != 0, s->camera_paths, false};
}

static ca_status apply_own_settings(ca_render_plan *plan, ca_error *error)
{
    own_setting own[OWN_SETTINGS];
    list_own_settings(plan->settings, own);
    for (int i = 0; i < OWN_SETTINGS; i++) CA_TRY(apply_setting(plan, &own[i], error));
    return CA_OK;
}

bool ca_render_is_set(const ca_scene *scene, const char *integrator, const char *parameter)
{
    const ca_integrator_desc *desc = &scene->desc.integrator;
    for (uint32_t i = 0; i < desc->parameters.count; i++)
        if (strcmp(desc->parameters.items[i].name, parameter) == 0) return true;
    return ca_render_overrides_mention(integrator, parameter);
}

bool ca_render_plan_is_asked(const ca_render_plan *plan, const char *parameter)
{
    own_setting own[OWN_SETTINGS];
    list_own_settings(plan->settings, own);
    for (int i = 0; i < OWN_SETTINGS; i++)
        if (own[i].given && strcmp(own[i].name, parameter) == 0) return true;
    return ca_render_overrides_mention(plan->settings->integrator, parameter);
}

bool ca_render_plan_is_set(const ca_render_plan *plan, const char *parameter)
{
    return ca_render_plan_is_asked(plan, parameter) ||
           ca_render_is_set(plan->scene, plan->settings->integrator, parameter);
}

/* settings->integrator is "name" or "name:parameter=value,...". */
static ca_status plan_integrator(ca_render_plan *plan, ca_error *error)
{
    const ca_integrator_desc *desc = &plan->scene->desc.integrator;
    const char *chosen = plan->settings->integrator;
    const char *overrides = ca_render_overrides(chosen);
    char name[64];
    if (chosen) {
        const size_t length = overrides ? (size_t)(overrides - 1 - chosen) : strlen(chosen);
        if (length >= sizeof name)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "no integrator is called \"%s\"", chosen);
        memcpy(name, chosen, length);
        name[length] = '\0';
        CA_TRY(ca_integrator_find(name, NULL, &plan->type, error));
    } else {
        CA_TRY(ca_integrator_find(desc->name ? desc->name : CA_DEFAULT_INTEGRATOR, &desc->where, &plan->type, error));
    }
    CA_TRY(ca_integrator_configure(plan->type, desc, chosen != NULL, overrides, &plan->input, error));
    CA_TRY(apply_own_settings(plan, error));
    plan->camera_paths = (uint32_t)ca_integrator_value(plan->type, &plan->input, "camera_paths", 1.0);
    return CA_OK;
}

/* ---- Numbers of rays ------------------------------------------------------------------------------------------- */

static ca_status plan_objective(ca_render_plan *plan, ca_error *error)
{
    const char *wanted = plan->settings->rays_objective;
    if (wanted && !ca_render_plan_chooses_rays(plan))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "an objective is for numbers of rays that are chosen: with rays \"auto\" only");
    return ca_ray_objective_find(wanted, &plan->objective, error);
}

/* The law that numbers are chosen by is one of independent paths and, as iterations are to be alike, of one
 * radius. */
static ca_status plan_auto(ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    if (ca_render_plan_is_asked(plan, "alpha") && ca_integrator_value(plan->type, &plan->input, "alpha", 0.0) > 0.0)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "numbers of rays are chosen for iterations that are alike: with rays \"auto\" the radius cannot shrink, "
            "alpha must be 0");
    if (settings->sampler && strcmp(settings->sampler, "independent") != 0)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "numbers of rays are chosen by a law of independent paths: with rays \"auto\" the sampler must be "
            "\"independent\", not \"%.100s\"",
            settings->sampler);
    plan->sampler.kind = CA_SAMPLER_INDEPENDENT;
    return ca_render_plan_keep_radius(plan, error);
}

/* Numbers of light and camera paths are chosen by a law that these have. */
static ca_status check_law(const ca_render_plan *plan, ca_error *error)
{
    char names[CA_INTEGRATOR_NAMES_SIZE];
    ca_integrator_names(CA_RAYS_ABILITIES | CA_ABILITY_CHOOSES, " and ", names);
    if (!ca_integrator_has(plan->type, CA_RAYS_ABILITIES | CA_ABILITY_CHOOSES))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "numbers of rays are chosen by a law of noise: rays are for integrators %s, not for %s", names,
                       plan->type->name);
    if (plan->objective != CA_RAYS_WORST_DECILE ||
        !ca_integrator_has(plan->type, CA_ABILITY_CONNECTION_NOISE | CA_ABILITY_CHOOSES))
        return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "where paths connect, as in %s, numbers are chosen for the mean or the relative variance, not for "
                   "the worst decile",
                   plan->type->name);
}

static ca_rays_source rays_source(const ca_render_settings *settings)
{
    if (!settings->rays) return CA_RAYS_OF_SETTINGS;
    if (strcmp(settings->rays, "auto") == 0) return settings->ranks ? CA_RAYS_AUTO_ONCE : CA_RAYS_AUTO;
    return ca_part_is_path(settings->rays) ? CA_RAYS_OF_RECORD : CA_RAYS_OF_FILE;
}

/* A record says how many iterations there are, too. */
static ca_status plan_record(ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    if (settings->samples_per_pixel > 0 || settings->seconds > 0.0 || settings->noise_percent > 0.0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the samples are those of the record that is repeated: no number of them, time or noise can "
                       "be chosen");
    return plan_auto(plan, error);
}

static ca_status check_strategies_rays(const ca_render_plan *plan, ca_error *error)
{
    if (!plan->settings->strategies_directory || plan->rays == CA_RAYS_OF_SETTINGS) return CA_OK;
    return ca_fail(
        error, CA_ERROR_ARGUMENT, NULL,
        "images of the strategies are made with the same number of camera paths in all pixels, not with rays");
}

static ca_status plan_rays(ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    plan->rays = rays_source(settings);
    const bool chooses = ca_integrator_has(plan->type, CA_ABILITY_CHOOSES);
    CA_TRY(plan_objective(plan, error));
    if (plan->rays == CA_RAYS_OF_SETTINGS || (chooses && plan->rays == CA_RAYS_OF_FILE)) return CA_OK;
    CA_TRY(check_law(plan, error));
    CA_TRY(check_strategies_rays(plan, error));
    if (ca_render_plan_chooses_rays(plan)) return plan_auto(plan, error);
    if (plan->rays == CA_RAYS_OF_RECORD) return plan_record(plan, error);
    if (ca_render_plan_is_asked(plan, "light_paths") || ca_render_plan_is_asked(plan, "camera_paths"))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "light paths and camera paths are those of the file of rays: they cannot be set as well");
    return CA_OK;
}

/* There is one image for each technique, so the number of techniques must be limited. */
static ca_status check_strategies(const ca_render_plan *plan, ca_error *error)
{
    if (!plan->settings->strategies_directory) return CA_OK;
    if (ca_render_plan_by_blocks(plan))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "integrator \"%s\" renders by blocks of pairs and makes no images of the strategies",
                       plan->type->name);
    const double max_depth = ca_integrator_value(plan->type, &plan->input, "max_depth", -1.0);
    if (max_depth >= 0.0 && max_depth <= CA_TECHNIQUE_MAX_VERTICES - 1) return CA_OK;
    char now[32] = "it is not limited";
    if (max_depth >= 0.0) snprintf(now, sizeof now, "it is %.0f", max_depth);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "images of the strategies need a max_depth of at most %d, since there is one for each length (%s)",
                   CA_TECHNIQUE_MAX_VERTICES - 1, now);
}

ca_status ca_render_plan_check_strategies(const ca_render_plan *plan, ca_error *error)
{
    CA_TRY(check_strategies_rays(plan, error));
    return check_strategies(plan, error);
}

/* ---- When to stop, and memory ---------------------------------------------------------------------------------- */

static ca_status check_targets(const ca_render_settings *settings, ca_error *error)
{
    if (settings->seconds < 0.0 || !isfinite(settings->seconds))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the rendering time must be a positive number of seconds");
    if (settings->noise_percent < 0.0 || !isfinite(settings->noise_percent))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the noise target must be a positive number of percent");
    return CA_OK;
}

/* Samples per pixel are camera paths, or light paths where camera paths only see emitters. */
static double samples_per_pass(const ca_render_plan *plan, uint32_t width, uint32_t height)
{
    if (!ca_integrator_has(plan->type, CA_ABILITY_LIGHT_SAMPLES)) return plan->camera_paths;
    const double light_paths = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0);
    return light_paths > 0.0 ? light_paths / ((double)width * (double)height) : 1.0; /* 0: one per pixel */
}

/* Parts of a render, and checkpoints: what has the sums of passes or blocks, of one kind. */
static ca_status check_parts(const ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    const char *what = settings->checkpoint_path ? "a checkpoint" : "a part of a render";
    if (!settings->checkpoint_path && !settings->has_passes && !settings->part_path) return CA_OK;
    if (plan->rays == CA_RAYS_OF_RECORD && settings->checkpoint_path)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "a render that repeats a record keeps no checkpoint: it begins anew");
    if (plan->rays == CA_RAYS_AUTO_ONCE && settings->has_passes)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "with rays \"auto\" each part would have numbers of rays of its own: an image of such a "
                       "render, as file of rays, repeats its choice in all parts");
    if (ca_render_plan_joins(plan) && (settings->has_passes || settings->part_path))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "with rays \"auto\", or their record, passes have other numbers of rays from phase to phase: "
                       "there is no part of such a render; an image of it, as file of rays, repeats its choice");
    if (settings->strategies_directory)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "images of the strategies are not kept in %s", what);
    if (settings->checkpoint_path && !settings->part_path && !settings->has_passes) return CA_OK;
    if (ca_integrator_has(plan->type, CA_ABILITY_CHOOSES) && plan->rays != CA_RAYS_OF_FILE)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "integrator \"%s\" may choose another method for each part: name the integrator, as --stats "
                       "or the image of one render tells it",
                       plan->type->name);
    return CA_OK;
}

static ca_status check_ranks(const ca_render_plan *plan, ca_error *error)
{
    if (!plan->settings->ranks) return CA_OK;
    if (ca_render_plan_joins(plan))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "with a record of rays \"auto\" passes have other numbers of rays from phase to phase: one "
                       "rank makes them; an image of such a render, as file of rays, repeats its choice on several");
    if (plan->settings->strategies_directory)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "images of the strategies are made by one rank");
    return CA_OK;
}

static ca_status check_passes(const ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    const unsigned long long begin = settings->passes[0], end = settings->passes[1];
    if (!settings->has_passes) return CA_OK;
    if (ca_render_plan_by_blocks(plan))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "integrator \"%s\" renders by blocks of pairs: it has a range of blocks, not of passes",
                       plan->type->name);
    if (settings->noise_percent > 0.0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the noise of a range of passes is not that of the image");
    if (settings->samples_per_pixel > 0 && settings->replicates == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "either samples per pixel or a range of passes can be given, not both");
    if (begin >= end) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%llu:%llu is no range of passes", begin, end);
    return CA_OK;
}

static ca_status check_block_settings(const ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    const char *name = plan->type->name;
    if (!ca_render_plan_by_blocks(plan)) {
        if (!settings->has_blocks) return CA_OK;
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "integrator \"%s\" does not render by blocks of pairs: there is no range of blocks to choose",
                       name);
    }
    if (settings->noise_percent > 0.0)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "integrator \"%s\" renders by blocks that share their paths: one render does not know its noise; "
            "compare renders with different seeds instead",
            name);
    if (!settings->has_blocks) return CA_OK;
    if (settings->samples_per_pixel > 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "either samples per pixel or a range of blocks can be given, not both");
    const unsigned long long begin = settings->blocks[0], end = settings->blocks[1];
    if (begin >= end || end - begin > UINT32_MAX)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%llu:%llu is no range of 1 to 4294967295 blocks", begin, end);
    return CA_OK;
}

/* The given range; else from the first block on until there are enough samples or the time is used up. */
static void plan_blocks(ca_render_plan *plan)
{
    const ca_render_settings *settings = plan->settings;
    plan->blocks[1] = UINT64_MAX;
    plan->open_ended = !settings->has_blocks && settings->samples_per_pixel == 0 && settings->seconds > 0.0;
    if (settings->has_blocks)
        memcpy(plan->blocks, settings->blocks, sizeof plan->blocks);
    else if (!plan->open_ended)
        plan->block_samples =
            settings->samples_per_pixel ? settings->samples_per_pixel : plan->scene->desc.samples_per_pixel;
}

float ca_render_plan_extent(const ca_render_plan *plan)
{
    const ca_scene *scene = plan->scene;
    const float coordinates[6] = {scene->low.x,  scene->low.y,  scene->low.z,
                                  scene->high.x, scene->high.y, scene->high.z};
    float largest = FLT_MIN;
    for (int i = 0; i < 6; i++)
        if (isfinite(coordinates[i])) largest = fmaxf(largest, fabsf(coordinates[i]));
    return largest;
}

static void plan_block_film(ca_render_plan *plan, uint32_t width, uint32_t height)
{
    plan->block_film = (ca_block_film_desc){
        .full_width = width,
        .full_height = height,
        .gradients = ca_integrator_value(plan->type, &plan->input, "gradients", 0.0) != 0.0,
        .error_bars = ca_integrator_value(plan->type, &plan->input, "error_bars", 0.0) != 0.0,
        .extent = ca_render_plan_extent(plan),
    };
    memcpy(plan->block_film.crop, plan->crop, sizeof plan->crop);
}

static ca_status plan_stopping(ca_render_plan *plan, uint32_t width, uint32_t height, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    CA_TRY(check_targets(settings, error));
    CA_TRY(check_parts(plan, error));
    CA_TRY(check_ranks(plan, error));
    CA_TRY(check_passes(plan, error));
    CA_TRY(check_block_settings(plan, error));
    plan_block_film(plan, width, height);
    if (ca_render_plan_by_blocks(plan)) {
        plan_blocks(plan);
        return CA_OK;
    }
    plan->samples_per_pass = samples_per_pass(plan, width, height);
    return ca_render_plan_count_passes(plan, plan->camera_paths, error);
}

ca_status ca_render_plan_take_range(ca_render_plan *plan, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    const uint32_t each = plan->passes_per_replicate > 0 ? plan->passes_per_replicate : 1;
    const unsigned long long begin = settings->passes[0], end = settings->passes[1];
    if (!settings->has_passes) return CA_OK;
    if (end > plan->pass_limit)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "there are no passes %llu:%llu: the last one would be %u",
                       begin, end, plan->pass_limit - 1);
    if (begin % each != 0 || end % each != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "a part has whole replicates, which are %u passes each: %llu:%llu does not", each, begin, end);
    plan->first_pass = (uint32_t)begin;
    plan->pass_limit = (uint32_t)end;
    return CA_OK;
}

ca_status ca_render_plan_count_passes(ca_render_plan *plan, uint32_t most, ca_error *error)
{
    const ca_render_settings *settings = plan->settings;
    plan->pass_limit = ca_min_u32(UINT32_MAX / most, CA_BINNED_SUM_MOST_VALUES);
    plan->open_ended = settings->samples_per_pixel == 0 && (settings->seconds > 0.0 || settings->noise_percent > 0.0);
    const bool ranged = settings->has_passes && settings->replicates == 0;
    if (ranged) plan->open_ended = false;
    if (plan->open_ended || ranged) return CA_OK;
    const uint32_t samples =
        settings->samples_per_pixel ? settings->samples_per_pixel : plan->scene->desc.samples_per_pixel;
    const double passes = ceil(samples / plan->samples_per_pass);
    if (passes > plan->pass_limit)
        return ca_fail(error, settings->samples_per_pixel ? CA_ERROR_ARGUMENT : CA_ERROR_SCENE, NULL,
                       "%u %s per pixel would take %.0f passes, over the limit of %u", samples,
                       ca_noun(samples, "sample", "samples"), passes, plan->pass_limit);
    plan->pass_limit = (uint32_t)passes;
    return CA_OK;
}

ca_status ca_render_plan_recount(ca_render_plan *plan, ca_error *error)
{
    const uint32_t camera_paths = (uint32_t)ca_integrator_value(plan->type, &plan->input, "camera_paths", 1.0);
    if (camera_paths == plan->camera_paths) return CA_OK;
    plan->camera_paths = camera_paths;
    plan->samples_per_pass = samples_per_pass(plan, plan->camera.width, plan->camera.height);
    CA_TRY(ca_render_plan_count_passes(plan, camera_paths, error));
    CA_TRY(ca_replicates_plan(plan, error));
    return ca_render_plan_take_range(plan, error);
}

/* Of a render that is not limited by samples: of each thread, where the scene is simple. Who asks wants to know how
 * often light is met at best; for usual scenes see method_trial.c. */
#define BEST_CAMERA_PATHS_PER_SECOND 2.5e6
#define SECONDS_TO_NOISE 3600.0

/* A number of samples and a time may both be set: the first to be reached ends the render. */
double ca_render_plan_expected_passes(const ca_render_plan *plan)
{
    const double passes = plan->pass_limit - plan->first_pass;
    const double given = plan->settings->seconds, most = plan->open_ended ? (double)INFINITY : passes;
    const double seconds = given > 0.0 ? given : plan->open_ended ? SECONDS_TO_NOISE : (double)INFINITY;
    const double paths = ca_render_plan_pixels(plan) * plan->camera_paths;
    return fmin(most, fmax(1.0, ceil(seconds * ca_render_plan_threads(plan) * BEST_CAMERA_PATHS_PER_SECOND / paths)));
}

/* Films whose numbers of rays are chosen are joined with weights: they need not add up in parts. */
static double film_bytes(const ca_render_plan *plan)
{
    const double pixels = ca_render_plan_pixels(plan);
    if (ca_render_plan_by_blocks(plan))
        return ca_block_film_bytes(&plan->block_film) + pixels * sizeof(ca_block_sample);
    if (ca_render_plan_joins(plan)) return pixels * (sizeof(ca_film_pixel) + CA_PASS_PIXEL_BYTES);
    return pixels * (ca_film_pixel_bytes(ca_replicates_passes(plan)) + CA_PASS_PART_BYTES);
}

ca_status ca_render_plan_memory(ca_render_plan *plan, ca_error *error)
{
    const double allowed = plan->settings->memory_mib * 0x1p20;
    const double film = film_bytes(plan);
    if (allowed <= 0.0) return CA_OK;
    if (film > allowed)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the film alone needs %.1f MiB, more than the %.1f MiB allowed", film / 0x1p20,
                       plan->settings->memory_mib);
    plan->input.memory_bytes = fmax(1.0, allowed - film); /* 0 would lift the limit */
    return CA_OK;
}

ca_status ca_render_plan_make(ca_render_plan *plan, const ca_scene *scene, const ca_render_settings *settings,
                              ca_error *error)
{
    *plan = (ca_render_plan){.scene = scene, .settings = settings};
    uint32_t width, height;
    CA_TRY(plan_film(plan, &width, &height, error));
    CA_TRY(plan_integrator(plan, error));
    CA_TRY(plan_sampler(plan, error));
    CA_TRY(plan_rays(plan, error));
    CA_TRY(check_strategies(plan, error));
    CA_TRY(plan_stopping(plan, width, height, error));
    CA_TRY(ca_replicates_plan(plan, error));
    CA_TRY(ca_render_plan_take_range(plan, error));
    CA_TRY(ca_render_plan_memory(plan, error));
    plan->threads = settings->threads ? settings->threads : ca_processors();
    if (plan->threads > 1024)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%u threads are over the limit of 1024", plan->threads);
    ca_sampler_prepare(&plan->sampler, width, height);
    plan->camera = ca_scene_camera(scene, width, height);
    plan->filter = scene->desc.film.filter;
    ca_filter_prepare(&plan->filter);
    plan->input.scene = scene;
    plan->input.camera = &plan->camera;
    plan->input.sampler = &plan->sampler;
    plan->input.filter = &plan->filter;
    plan->input.workers = plan->threads;
    plan->input.stop = settings->stop;
    memcpy(plan->input.crop, plan->crop, sizeof plan->input.crop);
    return ca_integrator_resolve(plan->type, &plan->input, error);
}

/* ---- Other numbers of paths ------------------------------------------------------------------------------------ */

ca_status ca_render_plan_set_light_paths(ca_render_plan *plan, uint32_t light_paths, ca_error *error)
{
    return ca_integrator_set_number(plan->type, "light_paths", light_paths, &plan->input, error);
}

ca_status ca_render_plan_set_camera_paths(ca_render_plan *plan, uint32_t camera_paths, ca_error *error)
{
    plan->camera_paths = camera_paths;
    return ca_integrator_set_number(plan->type, "camera_paths", camera_paths, &plan->input, error);
}

ca_status ca_render_plan_keep_radius(ca_render_plan *plan, ca_error *error)
{
    if (!ca_integrator_has_parameter(plan->type, "alpha")) return CA_OK;
    return ca_integrator_set_number(plan->type, "alpha", 0.0, &plan->input, error);
}

ca_status ca_render_plan_fits(ca_render_plan *plan, uint32_t light_paths, bool *fits, ca_error *error)
{
    void *integrator;
    CA_TRY(ca_render_plan_set_light_paths(plan, light_paths, error));
    *fits = plan->input.memory_bytes <= 0.0;
    if (*fits) return CA_OK;
    ca_integrator_input input = plan->input;
    input.pairs = NULL;
    input.keeps_pairs = true; /* as iterations that measure do */
    const ca_status status = plan->type->create(&input, &integrator, error);
    if (status != CA_OK) return status == CA_ERROR_ARGUMENT ? CA_OK : status; /* not even a part of them fits */
    *fits = plan->type->rounds(integrator) == 1;
    plan->type->destroy(integrator);
    return CA_OK;
}
