/* Every integrator on scenes whose radiance is known in closed form, with every sensor and sampler, to 1 %. */
#include "support/closed_forms.h"

int main(int argc, char **argv)
{
    const closed_form_effort effort = {.all_cases = true, .tolerance = 0.01, .max_samples = 16000};
    return run_closed_forms(argc, argv, &effort);
}
