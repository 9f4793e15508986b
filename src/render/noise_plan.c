#include "render/noise_plan.h"

#include "noise/ray_numbers.h"
#include "render/ray_times.h"

#include <math.h>
#include <string.h>

/* Of a pixel, for each of other numbers. */
enum { OTHER_BYTES = sizeof(ca_pair_means) + sizeof(ca_pair_connected_means) + sizeof(ca_pair_moments) };

enum { DEFAULT_LIGHT_PATHS = 30000, DEFAULT_CAMERA_PATHS = 4 };

/* An unknown name is accepted here: the plan refuses it with a list of all names. */
static ca_status check_integrator(const char *text, ca_error *error)
{
    enum { MEASURABLE = CA_ABILITY_PAIR_LAW | CA_ABILITY_CONNECTION_NOISE };
    const ca_integrator_type *type = ca_integrator_of(text);
    char names[CA_INTEGRATOR_NAMES_SIZE];
    if (!type || ca_integrator_has(type, MEASURABLE)) return CA_OK;
    ca_integrator_names(MEASURABLE, " or ", names);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "noise components are those of light and camera paths that meet: the integrator must be %s, not "
                   "%s",
                   names, type->name);
}

static ca_status check_settings(const ca_render_settings *s, uint32_t iterations, ca_error *error)
{
    if (iterations < 2)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "noise is measured in at least 2 iterations, not in %u",
                       iterations);
    if (s->samples_per_pixel > 0 || s->seconds != 0.0 || s->noise_percent != 0.0)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "noise is measured in a number of iterations: samples per pixel, time or a noise target cannot end it");
    if (s->rays || s->rays_objective)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "noise is measured with the same numbers of paths for all pixels: rays and their objective "
                       "are for renders");
    if (s->replicates > 0)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "noise is measured in single iterations, which are independent already: replicates are for renders");
    if (s->strategies_directory || s->has_blocks || s->has_passes || s->part_path || s->checkpoint_path)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "noise is measured without blocks, part files, checkpoints and images of the strategies");
    if (s->sampler && strcmp(s->sampler, "independent") != 0)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "the law of noise holds for independent paths: the sampler must be \"independent\", not \"%.100s\"",
            s->sampler);
    return CA_OK;
}

/* One radius, unless alpha is given, whatever the scene says: before the plan is made, whose radius depends on it. */
static void keep_radius(ca_noise_plan *p, const ca_scene *scene)
{
    ca_render_settings *s = &p->settings;
    const ca_integrator_type *type = ca_integrator_of(s->integrator ? s->integrator : scene->desc.integrator.name);
    if (s->has_alpha || ca_render_overrides_mention(s->integrator, "alpha")) return;
    s->has_alpha = type && ca_integrator_has_parameter(type, "alpha");
    s->alpha = 0.0;
}

/* Numbers that neither the scene nor the settings give. */
static void complete_counts(ca_noise_plan *p, const ca_scene *scene)
{
    ca_render_settings *s = &p->settings;
    const ca_integrator_type *type = ca_integrator_of(s->integrator ? s->integrator : scene->desc.integrator.name);
    if (s->light_paths == 0 && !ca_render_is_set(scene, s->integrator, "light_paths"))
        s->light_paths = DEFAULT_LIGHT_PATHS;
    if (s->camera_paths == 0 && !ca_render_is_set(scene, s->integrator, "camera_paths"))
        s->camera_paths = ca_integrator_has(type, CA_ABILITY_ONE_CAMERA_PATH) ? 1 : DEFAULT_CAMERA_PATHS;
}

static bool report_progress(const ca_render_progress *progress, void *user)
{
    ca_noise_plan *p = user;
    const ca_render_settings *given = p->given;
    if (given->progress && !given->progress(progress, given->progress_user)) p->ended = true;
    return !p->ended || progress->passes_done < 2;
}

static ca_status plan_counts(ca_noise_plan *p, uint32_t iterations, ca_error *error)
{
    ca_render_plan *plan = &p->plan;
    const double light_paths = ca_integrator_value(plan->type, &plan->input, "light_paths", 0.0);
    const double pixels = (double)plan->camera.width * (double)plan->camera.height; /* 0 light paths: one per pixel */
    p->light_paths = (uint32_t)(light_paths > 0.0 ? light_paths : pixels);
    if (p->light_paths < 2)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "the noise components are estimated from two halves of the light paths: at least 2 are needed, not %u",
            p->light_paths);
    /* Camera paths are numbered in 32 bits. */
    const uint32_t most = ca_min_u32(UINT32_MAX / plan->camera_paths, CA_BINNED_SUM_MOST_VALUES);
    if (iterations > most)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%u iterations of %u camera paths are over the limit of %u",
                       iterations, plan->camera_paths, most);
    plan->pass_limit = iterations;
    return CA_OK;
}

/* Bytes of a pixel beside the film: sums of pairs; where numbers are recommended, what its paths do and its number.
 * *choice: further bytes for choosing numbers, after the light paths are released. */
static double pixel_bytes(const ca_integrator_type *type, double *choice)
{
    const bool connects = ca_integrator_has(type, CA_ABILITY_CONNECTION_NOISE);
    *choice = connects ? 0.0 : (double)(sizeof(ca_ray_pixel) + CA_RAY_CHOICE_PIXEL_BYTES);
    return (double)(sizeof(ca_pair_pixel) + sizeof(ca_pair_moments) + (connects ? sizeof(ca_pair_connections) : 0) +
                    CA_RAY_TIMES_PIXEL_BYTES + sizeof(uint32_t));
}

/* These bytes are subtracted from the memory allowed. */
static ca_status plan_memory(ca_render_plan *plan, ca_error *error)
{
    const double pixels = ca_render_plan_pixels(plan);
    double choice;
    const double bytes = pixels * pixel_bytes(plan->type, &choice), most = bytes + pixels * choice;
    if (plan->input.memory_bytes <= 0.0) return CA_OK;
    if (most >= plan->input.memory_bytes)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "the film, the sums of pairs and what chooses numbers need %.4g MiB, more than the %.4g MiB allowed",
            plan->settings->memory_mib + (most - plan->input.memory_bytes) / 0x1p20, plan->settings->memory_mib);
    plan->input.memory_bytes -= bytes;
    return CA_OK;
}

/* The scene's, unless it names none or one without the pair law. */
static void choose_integrator(ca_noise_plan *p, const ca_scene *scene)
{
    const char *name = scene->desc.integrator.name;
    if (p->given->integrator || ca_integrator_has(ca_integrator_of(name), CA_ABILITY_PAIR_LAW)) return;
    p->settings.integrator = ca_integrator_bdpm.name;
    p->instead_of_scene = name != NULL;
}

ca_status ca_noise_plan_make(ca_noise_plan *p, const ca_scene *scene, const ca_render_settings *given,
                             uint32_t iterations, ca_error *error)
{
    CA_TRY(check_settings(given, iterations, error));
    *p = (ca_noise_plan){.settings = *given, .given = given};
    p->settings.sampler = "independent";
    p->settings.samples_per_pixel = 1; /* a placeholder: plan_counts sets the number of iterations */
    p->settings.progress = report_progress;
    p->settings.progress_user = p;
    choose_integrator(p, scene);
    CA_TRY(check_integrator(given->integrator, error));
    complete_counts(p, scene);
    keep_radius(p, scene);
    CA_TRY(ca_render_plan_make(&p->plan, scene, &p->settings, error));
    p->connects = ca_integrator_has(p->plan.type, CA_ABILITY_CONNECTION_NOISE);
    CA_TRY(plan_counts(p, iterations, error));
    return plan_memory(&p->plan, error);
}

static bool has_numbers(const ca_noise_plan *p, const ca_noise_counts *counts)
{
    if (counts->light_paths == p->light_paths && counts->camera_paths == p->plan.camera_paths) return true;
    for (uint32_t i = 0; i < p->other_count; i++)
        if (p->others[i].light_paths == counts->light_paths && p->others[i].camera_paths == counts->camera_paths)
            return true;
    return false;
}

static ca_status add_other(ca_noise_plan *p, const ca_noise_counts *counts, ca_error *error)
{
    if (counts->light_paths < 1 || counts->camera_paths < 1 || counts->camera_paths > counts->light_paths)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "of connected paths noise is predicted for no more camera paths per pixel than light paths, "
                       "not for %u, %u",
                       counts->light_paths, counts->camera_paths);
    if (has_numbers(p, counts)) return CA_OK;
    if (p->other_count == CA_NOISE_MOST_OTHERS)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "noise is measured with the weights of at most %d numbers",
                       CA_NOISE_MOST_OTHERS);
    p->others[p->other_count++] = (ca_pair_numbers){counts->light_paths, counts->camera_paths};
    return CA_OK;
}

ca_status ca_noise_plan_add_others(ca_noise_plan *p, const ca_noise_counts *counts, size_t count, ca_error *error)
{
    for (size_t i = 0; i < count && p->connects; i++) CA_TRY(add_other(p, &counts[i], error));
    const double bytes = ca_render_plan_pixels(&p->plan) * p->other_count * OTHER_BYTES;
    if (p->plan.input.memory_bytes <= 0.0) return CA_OK;
    if (bytes >= p->plan.input.memory_bytes)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the sums with the weights of %u other numbers of paths need %.4g MiB, more than is left of "
                       "the %.4g MiB allowed",
                       p->other_count, bytes / 0x1p20, p->plan.settings->memory_mib);
    p->plan.input.memory_bytes -= bytes;
    return CA_OK;
}
