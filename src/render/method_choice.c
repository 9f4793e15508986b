#include "render/method_choice.h"

#include "photon/radius_choice.h"

#include <math.h>

enum { LEAST_LOG4 = -2 };

/* The first few iterations tell a cost within a factor, the more the better. */
#define SLACK 3.0

/* Of the noise of rare values so much is not seen: half of what is, by the noise of renders. */
#define UNMET_RARE 0.5

/* The mean square of blur over the variance. At a radius of least error it is half of it, by renders a tenth of it to
 * all of it. Where connections find light, too, merges weigh little where they blur, and the radius is the least that
 * will do (CA_RADIUS_SHARED_TOLERANCE): by renders a hundredth to a tenth, and the more the more light merges alone
 * find. */
#define BLUR_OF_VARIANCE 0.5
#define SHARED_BLUR_OF_VARIANCE 0.06

/* Below any noise that matters: of two methods without noise the faster one is better. */
#define NO_VARIANCE 1e-12

uint32_t ca_methods_first(ca_method methods[CA_MOST_METHODS])
{
    const ca_method first[] = {
        {.type = &ca_integrator_path},  {.type = &ca_integrator_bdpt, .no_splats = true},
        {.type = &ca_integrator_bdpt},  {.type = &ca_integrator_ovcm},
        {.type = &ca_integrator_vavcm}, {.type = &ca_integrator_bdpm},
        {.type = &ca_integrator_ppm},
    };
    const uint32_t count = sizeof first / sizeof first[0];
    for (uint32_t i = 0; i < count; i++) methods[i] = first[i];
    return count;
}

bool ca_method_has_light_paths(const ca_method *method)
{
    const ca_mis_rules *rules = method->type->rules;
    return rules->connect || rules->splat || rules->merge != CA_MERGE_NONE;
}

bool ca_method_merges(const ca_method *method) { return method->type->rules->merge != CA_MERGE_NONE; }

double ca_method_noise(const ca_method_score *score)
{
    const double noise = score->variance + score->dots;
    return noise + UNMET_RARE * fmax(0.0, noise - score->common);
}

double ca_method_blur(const ca_method *method, const ca_blur_signs *signs)
{
    const double alone = method->type->rules->connect ? signs->merged_alone : 1.0;
    const double share = SHARED_BLUR_OF_VARIANCE * pow(BLUR_OF_VARIANCE / SHARED_BLUR_OF_VARIANCE, alone);
    const double shrunk = pow(signs->passes / CA_RADIUS_PASSES, -signs->alpha); /* it grows as r^2 */
    if (!ca_method_merges(method)) return 0.0;
    return sqrt(share * signs->variance / CA_RADIUS_PASSES * shrunk * signs->by_pilot);
}

static bool is_alike(const ca_method *a, const ca_method *b)
{
    return a->type == b->type && a->no_splats == b->no_splats && a->unguided == b->unguided;
}

void ca_methods_compare_noise(const ca_method *methods, ca_method_score *scores, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        scores[i].least = 0.0;
        for (uint32_t j = 0; j < count; j++)
            if (is_alike(&methods[i], &methods[j]) && methods[j].light_paths_log4 >= methods[i].light_paths_log4)
                scores[i].least = fmax(scores[i].least, ca_method_noise(&scores[j]));
    }
}

double ca_method_cost(const ca_method_score *score)
{
    if (score->loses_light) return (double)INFINITY;
    const double noise = fmax(ca_method_noise(score), score->least) + score->shown + NO_VARIANCE;
    return (noise + score->blur * score->passes) * score->seconds;
}

uint32_t ca_method_best(const ca_method_score *scores, uint32_t count)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < count; i++)
        if (ca_method_cost(&scores[i]) < ca_method_cost(&scores[best])) best = i;
    return best;
}

bool ca_method_goes_on(const ca_method_score *score, const ca_method_score *best, uint32_t iterations)
{
    const double slack = 1.0 + SLACK / sqrt((double)iterations);
    return ca_method_cost(score) <= slack * ca_method_cost(best);
}

static bool is_same(const ca_method *a, const ca_method *b)
{
    return is_alike(a, b) && a->light_paths_log4 == b->light_paths_log4;
}

static bool is_among(const ca_method *method, const ca_method *tried, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (is_same(&tried[i], method)) return true;
    return false;
}

bool ca_method_other_emission(const ca_method *method, const ca_method *tried, uint32_t count, ca_method *other)
{
    *other = *method;
    other->unguided = !method->unguided;
    return ca_method_has_light_paths(method) && !is_among(other, tried, count);
}

bool ca_method_neighbour(const ca_method *method, int step, int most_log4, const ca_method *tried, uint32_t count,
                         ca_method *neighbour)
{
    *neighbour = *method;
    neighbour->light_paths_log4 += step;
    const int power = neighbour->light_paths_log4;
    if (!ca_method_has_light_paths(method) || power < LEAST_LOG4 || power > most_log4) return false;
    return !is_among(neighbour, tried, count);
}
