#include "support/light_pilots.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

ca_light_pilot pilot_with_effort(const ca_scene *scene, const ca_render_settings *settings, uint32_t passes,
                                 uint32_t effort)
{
    ca_render_plan plan;
    ca_mis_rules counts;
    ca_light_pilot pilot;
    ca_error error;
    assert_int_equal(ca_render_plan_make(&plan, scene, settings, &error), CA_OK);
    assert_true(ca_integrator_counts(plan.type, &plan.input, &counts));
    const ca_light_question question = {.counts = &counts, .methods = 1, .iterations = passes, .effort = effort};
    assert_int_equal(ca_light_pilot_run(&pilot, &plan, &question, &error), CA_OK);
    return pilot;
}
