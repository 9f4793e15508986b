/* From an integrator's parameters to the rules of its weights, its number of light paths and its merge radius: for
 * the engine, and for those who ask what an integrator would find (integrator.h). */
#include "integrator/bidirectional.h"

#include <assert.h>
#include <math.h>

void ca_rules_read(ca_mis_rules *rules, const ca_integrator_type *type, const ca_integrator_input *input)
{
    rules->power = ca_integrator_value(type, input, "heuristic", 0.0) != 0.0;
    const bool paper = ca_integrator_value(type, input, "paper", 0.0) != 0.0;
    if (paper || ca_integrator_value(type, input, "strategies", 0.0) != 0.0) rules->splat = false;
    if (ca_integrator_value(type, input, "next_event", 1.0) == 0.0) rules->next_event = false;
    if (rules->hit == CA_HIT_UNMERGEABLE) {
        rules->merge_limit = (uint32_t)ca_integrator_value(type, input, "camera_diffuse_depth", 0.0) + 1;
        if (ca_integrator_value(type, input, "merges", 0.0) != 0.0) rules->merge = CA_MERGE_LAST;
    }
    rules->reuse.epsilon = (float)ca_integrator_value(type, input, "epsilon", 0.01);
    rules->reuse.c = (float)ca_integrator_value(type, input, "c", 0.5);
    rules->reuse.author = ca_integrator_value(type, input, "densities", 0.0) != 0.0;
    rules->reuse.projected = ca_integrator_value(type, input, "footprint", 0.0) != 0.0;
}

uint32_t ca_light_paths_of_pass(const ca_integrator_type *type, const ca_integrator_input *input)
{
    const double pixels = (double)input->camera->width * input->camera->height;
    const double light_paths = ca_integrator_value(type, input, "light_paths", 0.0);
    return (uint32_t)(light_paths > 0.0 ? light_paths : pixels);
}

ca_status ca_first_radius(const ca_integrator_type *type, const ca_integrator_input *input, float *radius,
                          ca_error *error)
{
    const double pixels = ca_integrator_value(type, input, "radius_pixels", 0.0);
    *radius = (float)ca_integrator_value(type, input, "radius", 0.0);
    if (*radius > 0.0f) return CA_OK;
    if (!(pixels > 0.0)) return ca_radius_pilot(type, input, 0.0, radius, NULL, error);
    *radius = (float)pixels * ca_median_pixel_footprint(input);
    return CA_OK;
}

ca_status ca_integrator_resolve(const ca_integrator_type *type, ca_integrator_input *input, ca_error *error)
{
    const bool merges = ca_integrator_value(type, input, "join", 0.0) == 0.0; /* else `qmcppm` connects */
    if (!merges || ca_integrator_has(type, CA_ABILITY_CHOOSES)) return CA_OK;
    const bool is_open = ca_integrator_value(type, input, "radius", 1.0) == 0.0;
    if (!is_open) return CA_OK;
    float radius;
    CA_TRY(ca_first_radius(type, input, &radius, error));
    return ca_integrator_set_number(type, "radius", (double)radius, input, error);
}

void ca_rules_set_counts(ca_mis_rules *rules, const ca_camera *camera, double light_paths, double camera_paths)
{
    rules->splat_count = (float)(light_paths / camera_paths) / (float)ca_camera_count(camera);
    rules->reuse.light_paths = (float)light_paths;
}

bool ca_integrator_counts(const ca_integrator_type *type, const ca_integrator_input *input, ca_mis_rules *rules)
{
    if (!type->rules) return false;
    *rules = *type->rules;
    ca_rules_read(rules, type, input);
    const uint32_t light_paths = ca_light_paths_of_pass(type, input);
    const double camera_paths = ca_integrator_value(type, input, "camera_paths", 1.0);
    ca_rules_set_counts(rules, input->camera, light_paths, camera_paths);
    rules->reuse.kind = CA_REUSE_FULL;
    if (rules->merge == CA_MERGE_NONE) return true;
    const float radius = (float)ca_integrator_value(type, input, "radius", 0.0);
    assert(radius > 0.0f);
    rules->merge_area = rules->reuse.merge_area = CA_PI * radius * radius;
    return true;
}
