/* Every integrator on scenes whose radiance is known in closed form, to 3 % in a release build; sensors and samplers
 * take turns. With all of them, to 1 %: long_closed_forms.c. */
#include "support/closed_forms.h"

/* Builds with asserts are slow, with sanitizers more so: less precision there. */
#ifdef NDEBUG
static const double tolerance = 0.03;
#else
static const double tolerance = 0.06;
#endif

int main(int argc, char **argv)
{
    const closed_form_effort effort = {.all_cases = false, .tolerance = tolerance, .max_samples = 1000};
    return run_closed_forms(argc, argv, &effort);
}
