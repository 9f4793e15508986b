#include "render/render.h"

#include "base/clock.h"
#include "render/blocks.h"
#include "render/pass.h"
#include "render/record.h"

#include <math.h>
#include <string.h>
#include <sys/resource.h>

/* The noise is looked at after this many passes, and then whenever their number has doubled: looking more often would
 * make stopping at a moment of good luck likely. */
enum { FIRST_NOISE_PASS = 8 };

typedef struct render {
    ca_render_plan *plan;
    void *integrator;
    ca_film film;
    ca_pass_runner runner;
    uint32_t passes;
    double start, seconds;
    double noise_percent; /* negative: not known yet */
    bool interrupted;
} render;

/* Is `passes` one of 8, 16, 32, ...? */
static bool is_noise_checkpoint(uint32_t passes)
{
    return passes >= FIRST_NOISE_PASS && (passes & (passes - 1)) == 0;
}

/* Tells the caller how far it is; false where the render should end. */
static bool report_progress(const render *r)
{
    const ca_render_settings *settings = r->plan->settings;
    if (!settings->progress) return true;
    const ca_render_progress progress = {
        .passes_done = r->passes,
        .passes_total = r->plan->open_ended ? 0 : r->plan->pass_limit,
        .seconds = r->seconds,
        .seconds_total = settings->seconds,
        .noise_percent = r->noise_percent,
        .noise_target = settings->noise_percent,
    };
    return settings->progress(&progress, settings->progress_user);
}

static bool should_stop(render *r)
{
    const ca_render_settings *settings = r->plan->settings;
    if (r->passes >= r->plan->pass_limit) return true;
    if (settings->seconds > 0.0 && r->seconds >= settings->seconds) return true;
    return settings->noise_percent > 0.0 && is_noise_checkpoint(r->passes) &&
           r->noise_percent >= 0.0 && r->noise_percent < settings->noise_percent;
}

static ca_status run_passes(render *r, ca_error *error)
{
    r->start = ca_clock_seconds();
    r->noise_percent = -1.0;
    for (;;) {
        CA_TRY(ca_pass_run(&r->runner, r->passes, error));
        r->passes++;
        if (is_noise_checkpoint(r->passes)) {
            const double noise = ca_film_summarise(&r->film).noise;
            r->noise_percent = isnan(noise) ? -1.0 : 100.0 * noise;
        }
        r->seconds = ca_clock_seconds() - r->start;
        r->interrupted = !report_progress(r);
        if (r->interrupted || should_stop(r)) return CA_OK;
    }
}

static void fill_statistics(const render *r, ca_render_statistics *statistics)
{
    const ca_film_summary summary = ca_film_summarise(&r->film);
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    *statistics = (ca_render_statistics){
        .seconds = r->seconds,
        .iterations = r->passes,
        .samples_per_pixel = r->passes * r->plan->samples_per_pass,
        .peak_memory_bytes = (uint64_t)usage.ru_maxrss * 1024,
        .mean_luminance = summary.mean_luminance,
        .mean_standard_deviation = summary.mean_standard_deviation,
        .noise_percent = isnan(summary.noise) ? -1.0 : 100.0 * summary.noise,
        .interrupted = r->interrupted,
    };
    ca_workers_count(&r->runner.workers, statistics);
}

/* Settings and timings travel with the picture. */
static ca_status attach_record(const render *r, const ca_render_statistics *statistics, ca_image_layers *layers,
                               ca_error *error)
{
    const ca_render_plan *plan = r->plan;
    char integrator[1024];
    ca_integrator_describe(plan->type, &plan->input, integrator, sizeof integrator);
    const ca_render_record record = {
        .version = ca_version(),
        .scene = plan->scene->desc.path,
        .integrator = integrator,
        .sampler = ca_sampler_name(plan->sampler.kind),
        .filter = ca_filter_name(plan->filter.kind),
        .seed = (double)plan->sampler.seed,
        .samples_per_pixel = statistics->samples_per_pixel,
        .seconds = statistics->seconds,
        .threads = plan->threads,
    };
    return ca_render_record_attach(&record, layers, error);
}

static ca_status develop(const render *r, const ca_render_statistics *statistics, ca_image_layers **image, ca_error *error)
{
    CA_TRY(ca_film_develop(&r->film, image, error));
    const ca_status status = attach_record(r, statistics, *image, error);
    if (status != CA_OK) {
        ca_layers_destroy(*image);
        *image = NULL;
    }
    return status;
}

static ca_status render_film(render *r, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    CA_TRY(ca_pass_runner_create(&r->runner, r->plan, r->integrator, &r->film, NULL, error));
    ca_status status = run_passes(r, error);
    if (status == CA_OK) fill_statistics(r, statistics);
    ca_pass_runner_destroy(&r->runner);
    CA_TRY(status);
    const ca_technique_images *strategies = r->plan->input.technique_images;
    if (strategies)
        CA_TRY(ca_technique_images_write(strategies, r->passes, r->plan->settings->strategies_directory, error));
    return develop(r, statistics, image, error);
}

/* Passes of several rounds need a buffer, which is then taken from what light paths may have. */
static ca_status create_integrator(render *r, ca_error *error)
{
    ca_render_plan *plan = r->plan;
    CA_TRY(plan->type->create(&plan->input, &r->integrator, error));
    const bool limited = plan->input.memory_bytes > 0.0;
    if (!limited || !plan->type->rounds || plan->type->rounds(r->integrator) == 1) return CA_OK;
    plan->type->destroy(r->integrator);
    r->integrator = NULL;
    const double buffer = ca_pass_buffer_bytes(plan);
    if (buffer >= plan->input.memory_bytes)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "the film and the samples of a pass need %.1f MiB, more than the %.1f MiB allowed",
                       plan->settings->memory_mib + (buffer - plan->input.memory_bytes) / 0x1p20,
                       plan->settings->memory_mib);
    plan->input.memory_bytes -= buffer;
    return plan->type->create(&plan->input, &r->integrator, error);
}

ca_status ca_render_plan_run(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                             ca_error *error)
{
    render r = {.plan = plan};
    ca_render_statistics own_statistics;
    if (!statistics) statistics = &own_statistics;
    if (ca_render_plan_by_blocks(plan)) return ca_render_blocks(plan, image, statistics, error);
    ca_status status = ca_film_create(&r.film, plan->camera.width, plan->camera.height, plan->crop, error);
    if (status == CA_OK && plan->settings->strategies_directory)
        status = ca_technique_images_create(&plan->input.technique_images, plan->crop, error);
    if (status == CA_OK) status = create_integrator(&r, error);
    if (status == CA_OK) {
        status = render_film(&r, image, statistics, error);
        plan->type->destroy(r.integrator);
    }
    ca_technique_images_destroy(plan->input.technique_images);
    plan->input.technique_images = NULL;
    ca_film_destroy(&r.film);
    return status;
}

ca_status ca_render(const ca_scene *scene, const ca_render_settings *settings, ca_image_layers **image,
                    ca_render_statistics *statistics, ca_error *error)
{
    *image = NULL;
    ca_render_settings defaults;
    ca_render_settings_init(&defaults);
    ca_render_plan plan;
    CA_TRY(ca_render_plan_make(&plan, scene, settings ? settings : &defaults, error));
    return ca_render_plan_run(&plan, image, statistics, error);
}
