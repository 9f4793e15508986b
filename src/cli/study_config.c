#include "cli/study_config.h"

#include "base/file.h"
#include "base/memory.h"
#include "metrics/flip.h"
#include "integrator/integrator.h"
#include "render/render.h"
#include "sampling/sampler.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_SCENARIOS = 100, DEFAULT_REFERENCE_SEED = 1 };

/* ---- Words ----------------------------------------------------------------------------------------------------- */

static const char *const light_names[] = {
    [CA_STUDY_LIGHT_NONE] = "", [CA_STUDY_LIGHT_VISIBLE] = "visible", [CA_STUDY_LIGHT_OCCLUDED] = "occluded"};

const char *ca_study_light_name(ca_study_light light) { return light_names[light]; }

bool ca_study_light_find(const char *name, ca_study_light *light)
{
    for (int i = 0; i <= CA_STUDY_LIGHT_OCCLUDED; i++)
        if (strcmp(name, light_names[i]) == 0) {
            *light = (ca_study_light)i;
            return true;
        }
    return false;
}

double ca_study_pixels_per_degree(const ca_study_config *config)
{
    const double pi = 3.14159265358979323846;
    return config->viewing_distance / (config->pixel_pitch * config->magnify) * pi / 180.0;
}

/* ---- How images are made --------------------------------------------------------------------------------------- */

static ca_status read_render(const ca_study_config *config, const ca_json_value *object, const char *what,
                             ca_study_render *render, ca_error *error)
{
    static const ca_json_field fields[] = {
        {.key = "integrator", .kind = CA_JSON_TEXT, .offset = offsetof(ca_study_render, integrator)},
        {.key = "sampler", .kind = CA_JSON_TEXT, .offset = offsetof(ca_study_render, sampler)},
        {.key = "spp",
         .kind = CA_JSON_COUNT,
         .needed = true,
         .low = 1,
         .high = 4294967295.0,
         .offset = offsetof(ca_study_render, spp)},
        {.key = "seed",
         .kind = CA_JSON_COUNT,
         .low = 0,
         .high = 4294967295.0,
         .offset = offsetof(ca_study_render, seed)},
    };
    CA_TRY(ca_json_fill(config->document, object, what, fields, sizeof fields / sizeof fields[0], render, error));
    char name[64];
    const ca_integrator_type *type;
    ca_error reason = {""};
    if (render->integrator) {
        snprintf(name, sizeof name, "%.*s", (int)strcspn(render->integrator, ":"), render->integrator);
        if (ca_integrator_find(name, NULL, &type, &reason) != CA_OK)
            return ca_json_fail(config->document, object, "integrator", error, "\"integrator\": %.400s",
                                reason.message);
        ca_integrator_input input = {0};
        if (ca_integrator_configure(type, &(ca_integrator_desc){0}, true, ca_render_overrides(render->integrator),
                                    &input, &reason) != CA_OK)
            return ca_json_fail(config->document, object, "integrator", error, "\"integrator\": %.400s",
                                reason.message);
    }
    ca_sampler_kind kind;
    if (render->sampler && !ca_sampler_find(render->sampler, &kind))
        return ca_json_fail(config->document, object, "sampler", error, "\"sampler\": expected one of %s",
                            ca_sampler_names());
    return CA_OK;
}

/* ---- Scenarios ------------------------------------------------------------------------------------------------- */

static ca_status read_defines(const ca_study_config *config, ca_study_scenario *s, ca_error *error)
{
    const size_t count = ca_json_size(s->define);
    s->defines = ca_alloc(count, sizeof *s->defines);
    if (!s->defines) return ca_fail_memory(error, "the study");
    for (; s->define_count < count; s->define_count++) {
        ca_define *define = &s->defines[s->define_count];
        CA_TRY(
            ca_json_text_member(config->document, s->define, s->define_count, &define->name, &define->value, error));
    }
    return CA_OK;
}

static ca_status check_scenario(const ca_study_config *config, const ca_json_value *object, const char *path,
                                ca_study_scenario *s, ca_error *error)
{
    const ca_json *document = config->document;
    const char *letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
    if (s->name[strspn(s->name, letters)] || strlen(s->name) > 64)
        return ca_json_fail(document, object, "name", error,
                            "\"name\": expected at most 64 letters, digits, - and _");
    for (uint32_t i = 0; &config->scenarios[i] != s; i++)
        if (strcmp(config->scenarios[i].name, s->name) == 0)
            return ca_json_fail(document, object, "name", error, "\"name\": there is already a scenario \"%s\"",
                                s->name);
    if (s->light_name && (!ca_study_light_find(s->light_name, &s->light) || s->light == CA_STUDY_LIGHT_NONE))
        return ca_json_fail(document, object, "light", error, "\"light\": expected \"visible\" or \"occluded\"");
    if (!s->light_name != !s->pair)
        return ca_json_fail(document, object, s->pair ? "pair" : "light", error,
                            "a scenario has both \"light\" and \"pair\", or none of them");
    for (uint32_t i = 0; s->pair && &config->scenarios[i] != s; i++) {
        const ca_study_scenario *other = &config->scenarios[i];
        if (other->pair && strcmp(other->pair, s->pair) == 0 && other->light == s->light)
            return ca_json_fail(document, object, "pair", error,
                                "\"pair\": scenario \"%s\" is already the %s one of pair \"%.100s\"", other->name,
                                s->light_name, s->pair);
    }
    CA_TRY(read_defines(config, s, error));
    s->path = ca_path_resolve(path, s->scene);
    return s->path ? CA_OK : ca_fail_memory(error, "the study");
}

static ca_status read_scenarios(ca_study_config *config, const ca_json_value *list, const char *path, ca_error *error)
{
    static const ca_json_field fields[] = {
        {.key = "name", .kind = CA_JSON_TEXT, .needed = true, .offset = offsetof(ca_study_scenario, name)},
        {.key = "scene", .kind = CA_JSON_TEXT, .needed = true, .offset = offsetof(ca_study_scenario, scene)},
        {.key = "light", .kind = CA_JSON_TEXT, .offset = offsetof(ca_study_scenario, light_name)},
        {.key = "pair", .kind = CA_JSON_TEXT, .offset = offsetof(ca_study_scenario, pair)},
        {.key = "define", .kind = CA_JSON_OBJECT, .offset = offsetof(ca_study_scenario, define)},
    };
    const size_t count = ca_json_size(list);
    if (count == 0 || count > MOST_SCENARIOS)
        return ca_json_fail(config->document, ca_json_root(config->document), "scenarios", error,
                            "\"scenarios\": expected a list of 1 to %d", MOST_SCENARIOS);
    config->scenarios = ca_alloc_zeroed(count, sizeof *config->scenarios);
    if (!config->scenarios) return ca_fail_memory(error, "the study");
    for (size_t i = 0; i < count; i++) {
        ca_study_scenario *s = &config->scenarios[config->scenario_count++];
        const ca_json_value *object;
        CA_TRY(ca_json_object_at(config->document, list, i, "a scenario", &object, error));
        CA_TRY(
            ca_json_fill(config->document, object, "a scenario", fields, sizeof fields / sizeof fields[0], s, error));
        CA_TRY(check_scenario(config, object, path, s, error));
    }
    return CA_OK;
}

/* ---- The file -------------------------------------------------------------------------------------------------- */

/* What is read beside the config: words and millimetres. */
typedef struct config_file {
    ca_study_config config;
    const char *sides;
    double pixel_pitch_mm;
    const ca_json_value *image, *reference, *scenarios;
} config_file;

#define AT(field) .offset = offsetof(config_file, field)

static const ca_json_field study_fields[] = {
    {.key = "title", .kind = CA_JSON_TEXT, .needed = true, AT(config.title)},
    {.key = "question", .kind = CA_JSON_TEXT, .needed = true, AT(config.question)},
    {.key = "yes", .kind = CA_JSON_TEXT, AT(config.yes)},
    {.key = "no", .kind = CA_JSON_TEXT, AT(config.no)},
    {.key = "seconds", .kind = CA_JSON_NUMBER, .low = 0.1, .high = 600.0, AT(config.seconds)},
    {.key = "screens", .kind = CA_JSON_COUNT, .low = 1, .high = 2, AT(config.screens)},
    {.key = "viewing_distance_m", .kind = CA_JSON_NUMBER, .low = 0.05, .high = 100.0, AT(config.viewing_distance)},
    {.key = "monitor_spacing_m", .kind = CA_JSON_NUMBER, .low = 0.0, .high = 100.0, AT(config.monitor_spacing)},
    {.key = "pixel_pitch_mm", .kind = CA_JSON_NUMBER, .low = 0.01, .high = 10.0, AT(pixel_pitch_mm)},
    {.key = "magnify", .kind = CA_JSON_COUNT, .low = 1, .high = 16, AT(config.magnify)},
    {.key = "exposure", .kind = CA_JSON_NUMBER, .low = -30.0, .high = 30.0, AT(config.exposure)},
    {.key = "sides", .kind = CA_JSON_TEXT, AT(sides)},
    {.key = "width", .kind = CA_JSON_COUNT, .low = 1, .high = 16384, AT(config.width)},
    {.key = "height", .kind = CA_JSON_COUNT, .low = 1, .high = 16384, AT(config.height)},
    {.key = "image", .kind = CA_JSON_OBJECT, .needed = true, AT(image)},
    {.key = "reference", .kind = CA_JSON_OBJECT, .needed = true, AT(reference)},
    {.key = "scenarios", .kind = CA_JSON_LIST, .needed = true, AT(scenarios)},
};

static config_file defaults(ca_json *document)
{
    return (config_file){
        .config = {.document = document,
                   .yes = "Yes",
                   .no = "No",
                   .seconds = 5.0,
                   .screens = 1,
                   .viewing_distance = 1.0,
                   .monitor_spacing = 1.0,
                   .magnify = 1,
                   .reference.seed = DEFAULT_REFERENCE_SEED},
        .sides = "random",
        .pixel_pitch_mm = 0.25,
    };
}

static ca_status read_parts(config_file *file, const char *path, ca_error *error)
{
    ca_study_config *config = &file->config;
    const ca_json_value *root = ca_json_root(config->document);
    config->random_sides = strcmp(file->sides, "random") == 0;
    if (!config->random_sides && strcmp(file->sides, "reference-left") != 0)
        return ca_json_fail(config->document, root, "sides", error,
                            "\"sides\": expected \"random\" or \"reference-left\"");
    config->pixel_pitch = file->pixel_pitch_mm / 1000.0;
    if (!config->width != !config->height)
        return ca_json_fail(config->document, root, config->width ? "width" : "height", error,
                            "a study has both \"width\" and \"height\", or none of them");
    const double density = ca_study_pixels_per_degree(config);
    if (density < CA_FLIP_MIN_PIXELS_PER_DEGREE || density > CA_FLIP_MAX_PIXELS_PER_DEGREE)
        return ca_json_fail(config->document, root, "viewing_distance_m", error,
                            "expected a \"viewing_distance_m\" and \"pixel_pitch_mm\" that make %g to %g pixels of "
                            "an image a degree, not %.4g",
                            CA_FLIP_MIN_PIXELS_PER_DEGREE, CA_FLIP_MAX_PIXELS_PER_DEGREE, density);
    CA_TRY(read_render(config, file->image, "\"image\"", &config->image, error));
    CA_TRY(read_render(config, file->reference, "\"reference\"", &config->reference, error));
    if (config->image.seed == config->reference.seed)
        return ca_json_fail(
            config->document, file->reference, "seed", error,
            "\"seed\": expected another one than that of \"image\", so that they do not share their noise");
    return read_scenarios(config, file->scenarios, path, error);
}

ca_status ca_study_config_read(const char *path, ca_study_config *config, ca_error *error)
{
    *config = (ca_study_config){0};
    ca_json *document;
    CA_TRY(ca_json_read(path, "study", &document, error));
    config_file file = defaults(document);
    ca_status status = ca_json_fill(document, ca_json_root(document), "a study", study_fields,
                                    sizeof study_fields / sizeof study_fields[0], &file, error);
    if (status == CA_OK) status = read_parts(&file, path, error);
    *config = file.config;
    return status;
}

void ca_study_config_destroy(ca_study_config *config)
{
    for (uint32_t i = 0; i < config->scenario_count; i++) {
        ca_free(config->scenarios[i].path);
        ca_free(config->scenarios[i].defines);
    }
    ca_free(config->scenarios);
    ca_json_destroy(config->document);
    *config = (ca_study_config){0};
}
