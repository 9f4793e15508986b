#include "cli/look_ahead.h"

#include "cli/say.h"

#include <stdio.h>

ca_status ca_look_ahead(const ca_scene *scene, const ca_render_settings *settings, const char *name, double *radius,
                        ca_error *error)
{
    ca_preflight preflight;
    const ca_status status = ca_preflight_make(scene, settings, &preflight, error);
    if (status != CA_OK) return status;
    for (uint32_t i = 0; i < preflight.warning_count; i++)
        ca_say(stderr, "caustica: warning: %s%s%s\n", name ? name : "", name ? ": " : "", preflight.warnings[i]);
    if (radius) *radius = preflight.radius;
    return CA_OK;
}
