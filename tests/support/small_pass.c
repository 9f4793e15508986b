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

void small_pass_plan(const ca_scene *scene, ca_render_settings *settings, double radius, ca_render_plan *plan)
{
    ca_error error;
    const ca_integrator_type *type = ca_integrator_of(settings->integrator);
    if (type && ca_integrator_has_parameter(type, "radius")) settings->radius = radius;
    if (ca_render_plan_make(plan, scene, settings, &error) != CA_OK)
        fail_msg("%s: %s", settings->integrator, error.message);
}
