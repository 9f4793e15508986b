#include "support/small_pass.h"

#include "integrator/integrator.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

ca_render_settings small_pass_settings(const small_pass *pass)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = pass->integrator;
    settings.samples_per_pixel = pass->camera_paths;
    settings.width = pass->width;
    settings.height = pass->height;
    settings.max_depth = pass->max_depth;
    settings.has_max_depth = true;
    settings.sampler = pass->sampler;
    settings.threads = 1;
    settings.has_seed = true;
    settings.seed = pass->seed;
    if (strncmp(pass->integrator, "path", 4) == 0) return settings;
    settings.light_paths = pass->light_paths;
    settings.camera_paths = pass->camera_paths;
    return settings;
}

void small_pass_plan(const ca_scene *scene, const ca_render_settings *settings, double radius, ca_render_plan *plan)
{
    ca_error error;
    if (ca_render_plan_make(plan, scene, settings, &error) != CA_OK)
        fail_msg("%s: %s", settings->integrator, error.message);
    if (ca_integrator_value(plan->type, &plan->input, "radius", -1.0) < 0.0) return;
    const ca_parameter parameter = {.name = "radius", .kind = CA_PARAMETER_NUMBER, .number = radius};
    assert_int_equal(ca_integrator_set(plan->type, &parameter, &plan->input, &error), CA_OK);
}
