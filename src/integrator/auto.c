/* `auto`: a name and parameters. Which method stands for it, the render chooses (render/auto_method.h). */
#include "integrator/bidirectional.h"

static ca_status create_auto(const ca_integrator_input *input, void **state, ca_error *error)
{
    (void)input;
    *state = NULL;
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                   "integrator \"auto\" is for renders, which choose a method for it; here one must be named");
}

/* Those of the bidirectional engine (algorithms.c). One that is not set is the chosen method's own. */
static const ca_parameter_spec parameters[] = {
    {"max_depth", CA_SPEC_INTEGER, .minimum = -1, .number = -1},
    {"rr_depth", CA_SPEC_INTEGER, .minimum = 1, .number = CA_ROULETTE_DEPTH},
    {"hide_emitters", CA_SPEC_BOOLEAN, .number = 0},
    {"heuristic", CA_SPEC_CHOICE, .choices = "balance|power", .number = 0},
    {"light_paths", CA_SPEC_INTEGER, .minimum = 0, .number = 0},
    {"camera_paths", CA_SPEC_INTEGER, .minimum = 1, .number = 1},
    CA_RADIUS_SPEC,
    {"alpha", CA_SPEC_REAL, .minimum = 0, .maximum = 1, .number = CA_RANDOM_ALPHA},
    {"guide", CA_SPEC_BOOLEAN, .number = 1},
    {.name = NULL},
};

const ca_integrator_type ca_integrator_auto = {
    .name = "auto",
    .parameters = parameters,
    .abilities = CA_ABILITY_CHOOSES,
    .create = create_auto,
};
