/* One phase of the render: iterations with the numbers in use, what they measure for the numbers of the next one, and
 * when it ends. */
#include "render/auto_rays_state.h"

#include <math.h>
#include <string.h>

enum { PAIRS_EVERY = 2, MOST_PAIRS = 8, LEAST_ITERATIONS = 2 };
enum { TIMES_KEPT = 8 }; /* of numbers before, beside those of these */

static void look(ca_auto_rays *a, const ca_auto_phase *phase)
{
    const double passes = a->worth_before + phase->iterations;
    if (ca_noise_looks_due(&a->looks, passes))
        ca_noise_looks_take(&a->looks, passes, ca_auto_noise(a), a->seconds, phase->seconds / phase->iterations);
}

/* A proof foretells nothing before its end, but may be quiet enough. */
static void glance(ca_auto_rays *a, ca_auto_phase *phase)
{
    if (a->looks.target <= 0.0 || phase->iterations < phase->next_glance) return;
    phase->next_glance = 2 * phase->iterations;
    (void)ca_auto_noise(a);
}

/* The first iteration warms up memory and caches: pairs may be gathered meanwhile, times are not measured. */
static ca_status run_iteration(ca_auto_rays *a, ca_auto_batch *batch, ca_auto_phase *phase, ca_error *error)
{
    double seconds;
    const uint32_t turn = phase->iterations % PAIRS_EVERY;
    const bool pairs = phase->revise && turn == 0 && phase->paired < MOST_PAIRS, times = phase->revise && turn == 1;
    CA_TRY(ca_auto_batch_run(a, batch, &a->phase, pairs ? &a->halves[0].pairs : NULL,
                             times ? a->halves[0].times : NULL, &seconds, error));
    phase->paired += pairs;
    if (!pairs && phase->iterations > 0) {
        phase->plain++;
        phase->plain_seconds += seconds;
    }
    phase->iterations++;
    a->render_iterations++;
    phase->seconds += seconds;
    /* One that is ended early has the share of what it did. The clock may not have moved. */
    a->phase_share = a->share_of_work * phase->worth * fmax(fmin(phase->end, ca_auto_work(a)) - phase->begin, 1e-9);
    return CA_OK;
}

/* Before its second iteration a phase does not know its noise. */
static bool phase_is_over(ca_auto_rays *a, ca_auto_phase *phase)
{
    if (phase->iterations < LEAST_ITERATIONS) return false;
    if (phase->looks)
        look(a, phase);
    else
        glance(a, phase);
    if (phase->iterations < phase->least) return ca_auto_is_over(a);
    return phase->iterations == phase->most || ca_auto_work(a) >= phase->end || ca_auto_is_over(a);
}

double ca_auto_phase_variance(const ca_auto_rays *a)
{
    const double noise = ca_film_summarise(&a->phase).noise;
    return noise * noise * a->phase.pixels[0].samples;
}

ca_status ca_auto_phase_run(ca_auto_rays *a, ca_auto_phase *phase, ca_error *error)
{
    ca_auto_batch batch;
    bool over = false;
    const size_t pixels = (size_t)a->phase.width * a->phase.height;
    memset(a->phase.pixels, 0, pixels * sizeof *a->phase.pixels);
    memset(a->halves[0].pairs.pixels, 0, pixels * sizeof *a->halves[0].pairs.pixels);
    if (phase->revise) ca_ray_times_thin(a->halves[0].times, TIMES_KEPT);
    ca_status status = ca_auto_batch_begin(a, &batch, error);
    while (status == CA_OK && !over) {
        status = run_iteration(a, &batch, phase, error);
        if (status == CA_OK) {
            ca_auto_report(a);
            over = phase_is_over(a, phase);
        }
    }
    ca_auto_batch_end(a, &batch);
    if (phase->revise) {
        a->plain_seconds = phase->plain_seconds / phase->plain;
        a->timed_light_paths = a->light_paths;
    }
    const double measured = ca_auto_phase_variance(a);
    if (measured > 0.0 && phase->expected > 0.0) a->surprise = measured / phase->expected;
    if (measured > 0.0) a->measured = measured * phase->seconds / phase->iterations;
    a->phases++;
    return status;
}

/* A phase that is done becomes a part of R, with its share; what its pairs tell joins what is known. */
void ca_auto_phase_keep(ca_auto_rays *a)
{
    ca_joined_film_add(&a->render, &a->phase, a->phase_share);
    a->shares += a->phase_share;
    a->phase_share = 0.0;
    ca_auto_know_more(a, &a->halves[0].pairs);
}
