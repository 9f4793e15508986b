#include "render/method_of_file.h"

#include "image/layers.h"
#include "noise/ray_map.h"
#include "render/preflight.h"

#include <stdio.h>
#include <string.h>

/* Numbers of paths that are chosen are those of a pilot where they are set, and a guide may have been tried without.
 * What is 0 by default is open then. */
static bool may_differ(const ca_parameter_spec *spec, double wanted, bool has_numbers)
{
    const bool is_number = strcmp(spec->name, "light_paths") == 0 || strcmp(spec->name, "camera_paths") == 0;
    const bool is_switch = spec->kind == CA_SPEC_BOOLEAN || spec->kind == CA_SPEC_CHOICE;
    const bool is_open = wanted == 0.0 && spec->number == 0.0;
    return is_switch ? spec->number != 0.0 && wanted != 0.0 : is_open || (has_numbers && is_number);
}

/* What settings ask for must be what the picture's method has, as the picture tells it: nothing of it can be changed.
 * What the scene says is not asked for. */
static ca_status check_asked(const ca_render_plan *asked, const ca_render_plan *plan, bool has_numbers,
                             ca_error *error)
{
    for (const ca_parameter_spec *spec = asked->type->parameters; spec->name; spec++) {
        char made[64], wanted[64];
        const double value = ca_integrator_value(asked->type, &asked->input, spec->name, 0.0);
        const double own = ca_integrator_value(plan->type, &plan->input, spec->name, 0.0);
        const bool is_set = ca_render_plan_is_asked(asked, spec->name);
        if (!is_set || may_differ(spec, value, has_numbers) || !ca_integrator_has_parameter(plan->type, spec->name))
            continue;
        ca_parameter_describe(spec, value, wanted, sizeof wanted);
        ca_parameter_describe(spec, own, made, sizeof made);
        if (strcmp(made, wanted) != 0)
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "%.300s: its method has %s=%s, and %s is asked for: with a file of rays nothing of the "
                           "method can be set",
                           plan->settings->rays, spec->name, made, wanted);
    }
    return CA_OK;
}

/* The same bits need the same seed, which is for the user to give: other renders of the choice are other samples. */
static void write_source(ca_render_plan *plan, const ca_image_layers *image)
{
    const ca_attribute *seed = ca_layers_attribute(image, "caustica.seed");
    char more[64] = "";
    if (seed && !seed->text && seed->number != (double)plan->seed && seed->number < 0x1p53)
        snprintf(more, sizeof more, " (--seed %.0f makes its picture again)", seed->number);
    snprintf(plan->method.reason, sizeof plan->method.reason, "auto: %s, as %.200s says%s", plan->type->name,
             plan->settings->rays, more);
}

static ca_status use_described(ca_render_plan *plan, const ca_image_layers *image, bool has_numbers, ca_error *error)
{
    const ca_attribute *attribute = ca_layers_attribute(image, "caustica.integrator");
    const char *text = attribute ? attribute->text : NULL, *path = plan->settings->rays;
    const ca_integrator_type *type = ca_integrator_of(text);
    const ca_integrator_desc nothing_set = {.name = NULL};
    if (!text || !type || ca_integrator_has(type, CA_ABILITY_CHOOSES) || type->begin_block)
        return ca_fail(error, CA_ERROR_FORMAT, NULL,
                       "%s: the picture does not say which method it was made with (caustica.integrator)", path);
    const ca_render_plan asked = *plan;
    CA_TRY(ca_integrator_configure(type, &nothing_set, false, ca_render_overrides(text), &plan->input, error));
    plan->type = type;
    CA_TRY(check_asked(&asked, plan, has_numbers, error));
    write_source(plan, image);
    return ca_render_plan_recount(plan, error);
}

/* Where its numbers of rays were chosen, too, they are in the picture. */
ca_status ca_method_of_file_use(ca_render_plan *plan, ca_error *error)
{
    ca_image_layers *image;
    CA_TRY(ca_layers_read(plan->settings->rays, &image, error));
    const bool has_numbers = ca_layers_attribute(image, CA_RAY_MAP_LIGHT_PATHS) != NULL;
    ca_status status = use_described(plan, image, has_numbers, error);
    const bool uses = has_numbers && ca_integrator_has(plan->type, CA_RAYS_ABILITIES);
    plan->rays = uses ? CA_RAYS_OF_FILE : CA_RAYS_OF_SETTINGS;
    ca_layers_destroy(image);
    if (status == CA_OK) status = ca_render_plan_check_strategies(plan, error);
    if (status != CA_OK || plan->scene->light_count == 0) return status;
    return ca_preflight_chosen(plan, ca_render_plan_expected_passes(plan), 0.0, plan->method_warning, error);
}
