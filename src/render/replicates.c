#include "render/replicates.h"

#include "base/hash.h"
#include "base/text.h"

#include <math.h>
#include <stdio.h>

static bool has_independent_passes(const ca_render_plan *plan)
{
    return plan->sampler.kind == CA_SAMPLER_INDEPENDENT;
}

ca_status ca_replicates_plan(ca_render_plan *plan, ca_error *error)
{
    const uint32_t replicates = plan->settings->replicates;
    plan->seed = plan->sampler.seed;
    if (replicates == 0) return CA_OK;
    if (replicates == 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the error cannot be estimated from one replicate: at least 2 are needed");
    if (ca_render_plan_by_blocks(plan))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "integrator \"%s\" renders by blocks of pairs and makes no replicates", plan->type->name);
    if (plan->rays != CA_RAYS_OF_SETTINGS)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "replicates have the numbers of rays of the settings: not with rays");
    if (ca_sampler_is_plain(plan->sampler.kind))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the sampler \"%s\" is not scrambled by the seed: its replicates would all be the same",
                       ca_sampler_name(plan->sampler.kind));
    if (plan->open_ended)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "replicates share a number of samples per pixel, which must be given instead of a time or a "
                       "noise target");
    if (plan->pass_limit % replicates != 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the number of samples per pixel comes to %u %s, which is not a multiple of %u replicates",
                       plan->pass_limit, ca_noun(plan->pass_limit, "pass", "passes"), replicates);
    plan->passes_per_replicate = plan->pass_limit / replicates;
    return CA_OK;
}

uint32_t ca_replicates_passes(const ca_render_plan *plan)
{
    if (plan->passes_per_replicate > 0) return plan->passes_per_replicate;
    return has_independent_passes(plan) ? 1 : 0;
}

uint32_t ca_replicates_begin_pass(ca_render_plan *plan, uint32_t pass)
{
    const uint32_t each = plan->passes_per_replicate;
    if (each == 0 || has_independent_passes(plan)) return pass;
    /* Integrators keep pointers to the plan's sampler; the seed is all that they see of a replicate. */
    plan->sampler.seed = ca_hash_add(ca_hash_add(CA_HASH_START, plan->seed), pass / each);
    return pass % each;
}

void ca_replicates_describe(const ca_render_plan *plan, uint32_t passes, char *text, size_t size)
{
    const uint32_t each = ca_replicates_passes(plan);
    const bool merges = !isnan(ca_integrator_value(plan->type, &plan->input, "radius", (double)NAN));
    const char *where = merges ? " at the merge radii of its passes" : "";
    if (ca_render_plan_joins(plan))
        snprintf(
            text, size,
            "95 %% for the expectation%s, from %u independent %s in parts with different numbers of rays", where,
            passes, ca_noun(passes, "iteration", "iterations"));
    else if (each == 0)
        snprintf(text, size,
                 "none: the samples of one sequence (%s) are not independent of each other; replicates are",
                 ca_sampler_name(plan->sampler.kind));
    else if (!has_independent_passes(plan))
        snprintf(text, size,
                 "95 %% for the expectation%s, from %u %s: independent scramblings of %u %s each", where,
                 passes / each, ca_noun(passes / each, "replicate", "replicates"), each,
                 ca_noun(each, "pass", "passes"));
    else if (each > 1)
        snprintf(text, size, "95 %% for the expectation%s, from %u %s: groups of %u independent passes", where,
                 passes / each, ca_noun(passes / each, "replicate", "replicates"), each);
    else
        snprintf(text, size, "95 %% for the expectation%s, from %u %s: independent passes", where, passes,
                 ca_noun(passes, "replicate", "replicates"));
}
