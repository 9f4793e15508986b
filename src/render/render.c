#include "render/render.h"

#include "base/clock.h"
#include "base/memory.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

enum {
    TILE_SIDE = 16,
    /* The noise is looked at after this many passes, and then whenever their number has doubled: looking more often would
     * make stopping at a moment of good luck likely. */
    FIRST_NOISE_PASS = 8,
};

typedef struct render {
    const ca_render_plan *plan;
    void *integrator;
    ca_film film;
    uint32_t passes;
    double start, seconds;
    double noise_percent; /* negative: not known yet */
    bool interrupted;
} render;

/* Counters of different threads must not share a cache line. */
typedef union padded_counters {
    ca_counters counters;
    char padding[128];
} padded_counters;
_Static_assert(sizeof(padded_counters) == 128, "one thread's counters fit two cache lines");

static void render_tile(render *r, uint32_t tile_x, uint32_t tile_y, uint32_t pass, ca_counters *counters)
{
    const ca_render_plan *plan = r->plan;
    const uint32_t x_end = tile_x + TILE_SIDE < r->film.width ? tile_x + TILE_SIDE : r->film.width;
    const uint32_t y_end = tile_y + TILE_SIDE < r->film.height ? tile_y + TILE_SIDE : r->film.height;
    for (uint32_t y = tile_y; y < y_end; y++)
        for (uint32_t x = tile_x; x < x_end; x++) {
            ca_film_sample sample;
            plan->type->camera_path(r->integrator, plan->crop[0] + x, plan->crop[1] + y, pass, &sample, counters);
            if (!ca_film_add(&r->film, x, y, &sample)) counters->non_finite++;
        }
}

static void render_pass(render *r, padded_counters *counters, uint32_t pass)
{
    const uint32_t columns = (r->film.width + TILE_SIDE - 1) / TILE_SIDE;
    const uint32_t rows = (r->film.height + TILE_SIDE - 1) / TILE_SIDE;
#pragma omp parallel for schedule(dynamic, 1) num_threads((int)r->plan->threads)
    for (uint32_t tile = 0; tile < columns * rows; tile++)
        render_tile(r, tile % columns * TILE_SIDE, tile / columns * TILE_SIDE, pass,
                    &counters[omp_get_thread_num()].counters);
}

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
        .passes_total = r->plan->pass_limit == UINT32_MAX ? 0 : r->plan->pass_limit,
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

static void run_passes(render *r, padded_counters *counters)
{
    r->start = ca_clock_seconds();
    r->noise_percent = -1.0;
    for (;;) {
        render_pass(r, counters, r->passes);
        r->passes++;
        if (is_noise_checkpoint(r->passes)) {
            const double noise = ca_film_summarise(&r->film).noise;
            r->noise_percent = isnan(noise) ? -1.0 : 100.0 * noise;
        }
        r->seconds = ca_clock_seconds() - r->start;
        r->interrupted = !report_progress(r);
        if (r->interrupted || should_stop(r)) return;
    }
}

static void fill_statistics(const render *r, const padded_counters *counters, ca_render_statistics *statistics)
{
    const ca_film_summary summary = ca_film_summarise(&r->film);
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    *statistics = (ca_render_statistics){
        .seconds = r->seconds,
        .iterations = r->passes,
        .peak_memory_bytes = (uint64_t)usage.ru_maxrss * 1024,
        .mean_luminance = summary.mean_luminance,
        .mean_standard_deviation = summary.mean_standard_deviation,
        .noise_percent = isnan(summary.noise) ? -1.0 : 100.0 * summary.noise,
        .interrupted = r->interrupted,
    };
    for (uint32_t i = 0; i < r->plan->threads; i++) {
        statistics->camera_paths += counters[i].counters.camera_paths;
        statistics->rays += counters[i].counters.rays;
        statistics->shadow_rays += counters[i].counters.shadow_rays;
        statistics->non_finite += counters[i].counters.non_finite;
    }
}

/* Settings and timings travel with the picture. */
static ca_status add_attributes(const render *r, const ca_render_statistics *statistics, ca_image_layers *layers,
                                ca_error *error)
{
    const ca_render_plan *plan = r->plan;
    char integrator[256];
    ca_integrator_describe(plan->type, &plan->input, integrator, sizeof integrator);
    CA_TRY(ca_layers_set_text(layers, "caustica.version", ca_version(), error));
    CA_TRY(ca_layers_set_text(layers, "caustica.scene", plan->scene->desc.path, error));
    CA_TRY(ca_layers_set_text(layers, "caustica.integrator", integrator, error));
    CA_TRY(ca_layers_set_text(layers, "caustica.sampler", ca_sampler_name(plan->sampler.kind), error));
    CA_TRY(ca_layers_set_number(layers, "caustica.seed", (double)plan->sampler.seed, error));
    CA_TRY(ca_layers_set_number(layers, "caustica.samplesPerPixel", r->passes, error));
    CA_TRY(ca_layers_set_text(layers, "caustica.filter", ca_filter_name(plan->filter.kind), error));
    CA_TRY(ca_layers_set_number(layers, "caustica.seconds", statistics->seconds, error));
    return ca_layers_set_number(layers, "caustica.threads", plan->threads, error);
}

static ca_status render_film(render *r, ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    padded_counters *counters = ca_alloc_zeroed(r->plan->threads, sizeof *counters);
    if (!counters) return ca_fail_memory(error, "the render");
    run_passes(r, counters);
    fill_statistics(r, counters, statistics);
    ca_free(counters);
    CA_TRY(ca_film_develop(&r->film, image, error));
    const ca_status status = add_attributes(r, statistics, *image, error);
    if (status != CA_OK) {
        ca_layers_destroy(*image);
        *image = NULL;
    }
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
    render r = {.plan = &plan};
    CA_TRY(ca_film_create(&r.film, plan.camera.width, plan.camera.height, plan.crop, error));
    ca_render_statistics own_statistics;
    ca_status status = plan.type->create(&plan.input, &r.integrator, error);
    if (status == CA_OK) {
        status = render_film(&r, image, statistics ? statistics : &own_statistics, error);
        plan.type->destroy(r.integrator);
    }
    ca_film_destroy(&r.film);
    return status;
}
