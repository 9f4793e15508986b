#include "render/part_settings.h"

#include "base/memory.h"
#include "base/text.h"
#include "render/replicates.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { TEXT_SIZE = 4096 };

/* Of all parameters, with every digit: those in the integrator's description are rounded for people. */
static void print_values(const ca_render_plan *plan, char *text, size_t size)
{
    text[0] = '\0';
    for (int i = 0; plan->type->parameters[i].name; i++) {
        const size_t used = strlen(text);
        snprintf(text + used, size - used, " %.17g", plan->input.values[i]);
    }
}

ca_status ca_part_settings_make(const ca_render_plan *plan, char **text, ca_error *error)
{
    char integrator[1024], values[1024], memory[64] = "";
    const uint32_t *crop = plan->crop;
    ca_integrator_describe(plan->type, &plan->input, integrator, sizeof integrator);
    print_values(plan, values, sizeof values);
    /* How much there is of it matters only where it says how large blocks are. */
    if (ca_integrator_value(plan->type, &plan->input, "blocks", 0.0) != 0.0)
        snprintf(memory, sizeof memory, "memory %.17g\n", plan->input.memory_bytes);
    *text = ca_alloc(TEXT_SIZE, 1);
    if (!*text) return ca_fail_memory(error, "the part file");
    snprintf(*text, TEXT_SIZE,
             "version %s\n"
             "scene %016" PRIx64 "\n"
             "sensor %u\n"
             "integrator %s\n"
             "values%s\n"
             "sampler %s\n"
             "seed %" PRIu64 "\n"
             "film %ux%u\n"
             "crop %u,%u,%u,%u\n"
             "filter %s\n"
             "%s",
             ca_version(), plan->scene->desc.content_hash, plan->scene->desc.camera.sensor, integrator, values,
             ca_sampler_name(plan->sampler.kind), plan->sampler.seed, plan->camera.width, plan->camera.height,
             crop[0], crop[1], crop[2], crop[3], ca_filter_name(plan->filter.kind), memory);
    return CA_OK;
}

static size_t add_line(char *text, size_t used, const char *name, const char *value)
{
    const int added = snprintf(text + used, TEXT_SIZE - used, "%s %s\n", name, value);
    const size_t end = used + (size_t)(added > 0 ? added : 0);
    return end < TEXT_SIZE ? end : TEXT_SIZE - 1;
}

static size_t add_number(char *text, size_t used, const char *name, double value)
{
    char number[64];
    snprintf(number, sizeof number, "%.17g", value);
    return add_line(text, used, name, number);
}

/* What the image depends on beside the integrator. */
static size_t add_film(char *text, size_t used, const ca_render_plan *plan, uint64_t rays)
{
    char value[128];
    const uint32_t *crop = plan->crop;
    used = add_line(text, used, "sampler", ca_sampler_name(plan->sampler.kind));
    snprintf(value, sizeof value, "%" PRIu64, plan->seed);
    used = add_line(text, used, "seed", value);
    snprintf(value, sizeof value, "%ux%u", plan->camera.width, plan->camera.height);
    used = add_line(text, used, "resolution", value);
    snprintf(value, sizeof value, "%u,%u,%u,%u", crop[0], crop[1], crop[2], crop[3]);
    used = add_line(text, used, "crop", value);
    used = add_line(text, used, "filter", ca_filter_name(plan->filter.kind));
    used = add_number(text, used, "passes_per_replicate", ca_replicates_passes(plan));
    snprintf(value, sizeof value, "%016" PRIx64, rays);
    const bool chosen = ca_render_plan_joins(plan) || plan->rays == CA_RAYS_AUTO_ONCE;
    return add_line(text, used, "rays", rays ? value : chosen ? "chosen" : "none");
}

ca_status ca_pass_settings_make(const ca_render_plan *plan, uint64_t rays, char **text, ca_error *error)
{
    char hash[32];
    *text = ca_alloc(TEXT_SIZE, 1);
    if (!*text) return ca_fail_memory(error, "the part file");
    snprintf(hash, sizeof hash, "%016" PRIx64, plan->scene->desc.content_hash);
    size_t used = add_line(*text, 0, "version", ca_version());
    used = add_line(*text, used, "scene", hash);
    used = add_number(*text, used, "sensor", plan->scene->desc.camera.sensor);
    used = add_line(*text, used, "integrator", plan->type->name);
    used = add_film(*text, used, plan, rays);
    /* Last, since some of them follow from the others where they are not given. */
    for (int i = 0; plan->type->parameters[i].name; i++)
        used = add_number(*text, used, plan->type->parameters[i].name, plan->input.values[i]);
    add_number(*text, used, "samples_per_pass", plan->samples_per_pass);
    return CA_OK;
}

static double count_of(const char *text, char wanted)
{
    double count = 0.0;
    for (; *text; text++) count += *text == wanted;
    return count;
}

/* Can the parameter have this value? */
static bool is_value(const ca_parameter_spec *spec, double value)
{
    double most = spec->kind == CA_SPEC_INTEGER ? 1e9 : spec->maximum > 0.0 ? spec->maximum : (double)INFINITY;
    if (spec->kind == CA_SPEC_BOOLEAN) most = 1.0;
    if (spec->kind == CA_SPEC_CHOICE) most = count_of(spec->choices, '|');
    const bool counts = spec->kind == CA_SPEC_BOOLEAN || spec->kind == CA_SPEC_CHOICE;
    return isfinite(value) && value >= (counts ? 0.0 : spec->minimum) && value <= most &&
           (spec->kind == CA_SPEC_REAL || value == floor(value));
}

static ca_status fail_settings(const char *text, const char *path, const char *name, ca_error *error)
{
    char version[64];
    ca_part_settings_find(text, "version", version, sizeof version);
    return ca_fail(error, CA_ERROR_FORMAT, NULL,
                   "%s: what it tells of the setting \"%s\" makes no sense to this version of Caustica, %s (the file "
                   "is of version %s)",
                   path, name, ca_version(), version[0] ? version : "unknown");
}

ca_status ca_pass_settings_use(const char *text, const char *path, ca_render_plan *plan, ca_error *error)
{
    char name[64], word[64];
    double samples = 0.0;
    const ca_integrator_type *type = NULL;
    bool good = ca_part_settings_find(text, "integrator", name, sizeof name);
    if (good) type = ca_integrator_of(name);
    good = type && !ca_integrator_has(type, CA_ABILITY_CHOOSES) && !type->begin_block;
    if (!good) return fail_settings(text, path, "integrator", error);
    for (int i = 0; type->parameters[i].name; i++) {
        good = ca_part_settings_find(text, type->parameters[i].name, word, sizeof word) &&
               ca_parse_double(word, &plan->input.values[i]) && is_value(&type->parameters[i], plan->input.values[i]);
        if (!good) return fail_settings(text, path, type->parameters[i].name, error);
    }
    good = ca_part_settings_find(text, "samples_per_pass", word, sizeof word) && ca_parse_double(word, &samples) &&
           samples > 0.0 && isfinite(samples);
    if (!good) return fail_settings(text, path, "samples_per_pass", error);
    const bool has_rays = !ca_part_settings_find(text, "rays", word, sizeof word) || strcmp(word, "none") != 0;
    const bool may_have_rays = plan->rays == CA_RAYS_OF_FILE || plan->rays == CA_RAYS_AUTO_ONCE;
    if (may_have_rays && !has_rays) plan->rays = CA_RAYS_OF_SETTINGS;
    plan->type = type;
    return CA_OK;
}

static const char *next_line(const char *line)
{
    line += strcspn(line, "\n");
    return *line ? line + 1 : line;
}

bool ca_part_settings_find(const char *text, const char *name, char *value, size_t size)
{
    const size_t name_length = strlen(name);
    value[0] = '\0';
    for (; *text; text = next_line(text)) {
        if (strncmp(text, name, name_length) != 0 || text[name_length] != ' ') continue;
        const size_t length = strcspn(text + name_length + 1, "\n");
        if (length >= size) return false;
        memcpy(value, text + name_length + 1, length);
        value[length] = '\0';
        return true;
    }
    return false;
}

bool ca_part_settings_equal(const char **a, const char **b)
{
    for (; **a || **b; *a = next_line(*a), *b = next_line(*b)) {
        const size_t length = strcspn(*a, "\n");
        if (length != strcspn(*b, "\n") || strncmp(*a, *b, length) != 0) return false;
    }
    return true;
}

ca_status ca_part_settings_fail(const char *first_path, const char *a, const char *path, const char *b,
                                ca_error *error)
{
    const int name = (int)strcspn(a, " \n"), a_length = (int)strcspn(a, "\n"), b_length = (int)strcspn(b, "\n");
    if (strncmp(a, "scene ", 6) == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%.300s and %.300s show different scenes: their files or definitions differ", first_path,
                       path);
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "%.200s and %.200s differ in their %.*s: \"%.*s\" and \"%.*s\"",
                   first_path, path, name, a, a_length < 250 ? a_length : 250, a, b_length < 250 ? b_length : 250, b);
}

/* ---- Ranks ----------------------------------------------------------------------------------------------------- */

/* Rank 0's text on all ranks. */
static void share_text(const ca_ranks *ranks, const char *own, char text[TEXT_SIZE])
{
    memset(text, 0, TEXT_SIZE);
    if (own) snprintf(text, TEXT_SIZE, "%s", own);
    ca_ranks_share(ranks, text, TEXT_SIZE);
}

ca_status ca_pass_settings_share(const ca_ranks *ranks, ca_render_plan *plan, ca_error *error)
{
    char text[TEXT_SIZE], *own = NULL;
    const uint64_t some_rays = plan->rays == CA_RAYS_OF_FILE; /* which they are, each rank reads itself */
    const ca_status made = ranks->rank == 0 ? ca_pass_settings_make(plan, some_rays, &own, error) : CA_OK;
    share_text(ranks, own, text);
    ca_free(own);
    if (ranks->rank == 0) return made;
    if (!text[0]) return CA_OK; /* rank 0 failed */
    CA_TRY(ca_pass_settings_use(text, "rank 0", plan, error));
    return ca_render_plan_recount(plan, error);
}

static ca_status compare_with_first(const char *first, const char *own, ca_error *error)
{
    if (ca_part_settings_equal(&first, &own)) return CA_OK;
    if (strncmp(first, "scene ", 6) == 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "this is another scene than that of rank 0: its files differ");
    const int a = (int)strcspn(own, "\n"), b = (int)strcspn(first, "\n");
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "this rank has \"%.*s\", but rank 0 has \"%.*s\"",
                   a < 200 ? a : 200, own, b < 200 ? b : 200, first);
}

ca_status ca_part_settings_agree(const ca_ranks *ranks, const char *settings, ca_error *error)
{
    char text[TEXT_SIZE];
    share_text(ranks, settings, text);
    return ca_ranks_agree(ranks, compare_with_first(text, settings, error), error);
}
