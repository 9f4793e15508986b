/* A pass that is small enough to be looked at path by path: by one thread, with few paths of either kind. */
#ifndef CA_TEST_SMALL_PASS_H
#define CA_TEST_SMALL_PASS_H

#include "render/render.h"

typedef struct small_pass {
    const char *integrator, *sampler; /* as ca_render_settings' */
    uint32_t width, height;
    uint32_t light_paths, camera_paths; /* camera paths per pixel; light paths of integrators that have both kinds */
    int max_depth;
    uint64_t seed;
} small_pass;

ca_render_settings small_pass_settings(const small_pass *pass);

/* Plans it, with this radius where the integrator has one: no pilot looks for it. `settings` must live as long as the
 * plan. Fails the test on errors. */
void small_pass_plan(const ca_scene *scene, ca_render_settings *settings, double radius, ca_render_plan *plan);

#endif
