#include "cli/study_page.h"
#include "cli/say.h"

#include "base/memory.h"
#include "metrics/image_metrics.h"
#include "image/layers.h"
#include "report/page.h"
#include "report/page_text.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* What the page is written from. */
typedef struct study_page {
    const ca_study_work *work;
    uint64_t id;
    double *flip; /* owned; of each scenario */
} study_page;

/* ---- Images ---------------------------------------------------------------------------------------------------- */

/* R G B of a file, all that a subject sees. */
static ca_status read_colors(const ca_study_work *work, uint32_t scenario, bool is_reference,
                             ca_image_layers **colors, ca_error *error)
{
    static const char *const names[3] = {"R", "G", "B"};
    char *path = ca_study_image_path(work, scenario, is_reference);
    if (!path) return ca_fail_memory(error, "the study");
    ca_image_layers *layers = NULL;
    *colors = NULL;
    ca_status status = ca_layers_read(path, &layers, error);
    if (status == CA_OK) status = ca_layers_create(colors, layers->width, layers->height, error);
    for (int c = 0; c < 3 && status == CA_OK; c++) {
        const float *from = ca_layers_find(layers, names[c]);
        float *to;
        status = from ? ca_layers_add(*colors, names[c], &to, error)
                      : ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: the image has no channel %s", path, names[c]);
        if (status == CA_OK) memcpy(to, from, (size_t)layers->width * layers->height * sizeof *to);
    }
    if (status != CA_OK) {
        ca_layers_destroy(*colors);
        *colors = NULL;
    }
    ca_layers_destroy(layers);
    ca_free(path);
    return status;
}

/* Of what the screen shows, seen from the study's distance. */
static ca_status measure(const ca_study_work *work, const ca_image_layers *image, const ca_image_layers *reference,
                         double *flip, ca_error *error)
{
    const ca_compare_settings region = {0};
    ca_metric_settings settings = ca_metric_defaults();
    ca_image_metrics metrics;
    settings.exposure = work->config->exposure;
    settings.pixels_per_degree = ca_study_pixels_per_degree(work->config);
    settings.flip_hdr = false;
    CA_TRY(ca_measure_image(image, reference, &region, &settings, &metrics, NULL, error));
    *flip = metrics.flip_ldr;
    return CA_OK;
}

/* For each scenario its reference and its image: measured where there is no page yet, else added to it. */
static ca_status use_images(study_page *p, uint32_t scenario, ca_page *page, ca_error *error)
{
    ca_image_layers *image = NULL, *reference = NULL;
    ca_error reason = {""};
    ca_status status = read_colors(p->work, scenario, true, &reference, &reason);
    if (status == CA_OK) status = read_colors(p->work, scenario, false, &image, &reason);
    if (status == CA_OK && !page) status = measure(p->work, image, reference, &p->flip[scenario], &reason);
    if (status == CA_OK && page)
        status = ca_page_add(page, &(ca_page_image){.name = "reference", .is_reference = true, .layers = reference},
                             &reason);
    if (status == CA_OK && page)
        status = ca_page_add(page, &(ca_page_image){.name = "image", .layers = image}, &reason);
    ca_layers_destroy(image);
    ca_layers_destroy(reference);
    if (status == CA_OK) return CA_OK;
    return ca_fail(error, status == CA_ERROR_ARGUMENT ? CA_ERROR_UNSUPPORTED : status, NULL, "scenario %s: %.800s",
                   p->work->config->scenarios[scenario].name, reason.message);
}

/* ---- What the page knows of the study -------------------------------------------------------------------------- */

static void put_text(FILE *stream, const char *key, const char *text)
{
    fprintf(stream, "\"%s\":", key);
    ca_page_put_json(stream, text);
    fputs(",\n", stream);
}

static void put_number(FILE *stream, const char *key, double value)
{
    fprintf(stream, "\"%s\":", key);
    ca_page_put_number(stream, value);
    fputs(",\n", stream);
}

static void put_render(FILE *stream, const char *key, const ca_study_render *render)
{
    fprintf(stream, "\"%s\":{\"integrator\":", key);
    ca_page_put_json(stream, render->integrator ? render->integrator : "of the scene");
    fprintf(stream, ",\"spp\":%u,\"seed\":%u},\n", render->spp, render->seed);
}

static void put_scenarios(FILE *stream, const study_page *p)
{
    const ca_study_config *c = p->work->config;
    fputs("\"scenarios\":[", stream);
    for (uint32_t i = 0; i < c->scenario_count; i++) {
        const ca_study_scenario *s = &c->scenarios[i];
        fputs(i ? ",\n{" : "{", stream);
        put_text(stream, "name", s->name);
        put_text(stream, "light", ca_study_light_name(s->light));
        put_text(stream, "pair", s->pair ? s->pair : "");
        fputs("\"flip\":", stream);
        ca_page_put_number(stream, p->flip[i]);
        fputc('}', stream);
    }
    fputc(']', stream);
}

static void put_study(FILE *stream, const void *user)
{
    const study_page *p = user;
    const ca_study_config *c = p->work->config;
    fprintf(stream, "{\"id\":\"%016" PRIx64 "\",\n", p->id);
    put_text(stream, "title", c->title);
    put_text(stream, "question", c->question);
    put_text(stream, "yes", c->yes);
    put_text(stream, "no", c->no);
    put_number(stream, "seconds", c->seconds);
    put_number(stream, "screens", c->screens);
    put_number(stream, "viewing_distance_m", c->viewing_distance);
    put_number(stream, "monitor_spacing_m", c->monitor_spacing);
    put_number(stream, "pixel_pitch_mm", 1000.0 * c->pixel_pitch);
    put_number(stream, "pixels_per_degree", ca_study_pixels_per_degree(c));
    put_number(stream, "magnify", c->magnify);
    put_number(stream, "exposure", c->exposure);
    put_text(stream, "sides", c->random_sides ? "random" : "reference-left");
    put_render(stream, "image", &c->image);
    put_render(stream, "reference", &c->reference);
    put_scenarios(stream, p);
    fputc('}', stream);
}

/* ---- The page -------------------------------------------------------------------------------------------------- */

static ca_status write_page(study_page *p, const char *path, ca_error *error)
{
    const ca_page_settings settings = {
        .title = p->work->config->title, .program = "study", .put_data = put_study, .data = p};
    ca_page *page;
    CA_TRY(ca_page_create(&page, path, &settings, error));
    ca_status status = CA_OK;
    for (uint32_t i = 0; i < p->work->config->scenario_count && status == CA_OK; i++)
        status = use_images(p, i, page, error);
    if (status == CA_OK) status = ca_page_finish(page, error);
    ca_page_destroy(page);
    return status;
}

ca_status ca_study_write_page(const ca_study_work *work, uint64_t id, ca_error *error)
{
    const size_t size = strlen(work->folder) + sizeof "/index.html";
    char *path = ca_alloc(size, 1);
    study_page p = {.work = work, .id = id, .flip = ca_alloc(work->config->scenario_count, sizeof *p.flip)};
    ca_status status = path && p.flip ? CA_OK : ca_fail_memory(error, "the study");
    for (uint32_t i = 0; i < work->config->scenario_count && status == CA_OK; i++)
        status = use_images(&p, i, NULL, error);
    if (status == CA_OK) {
        snprintf(path, size, "%s/index.html", work->folder);
        status = write_page(&p, path, error);
    }
    if (status == CA_OK && !work->quiet) ca_say(stdout, "wrote %s\n", path);
    ca_free(p.flip);
    ca_free(path);
    return status;
}
