#include "render/part_settings.h"

#include <inttypes.h>
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
             "integrator %s\n"
             "values%s\n"
             "sampler %s\n"
             "seed %" PRIu64 "\n"
             "film %ux%u\n"
             "crop %u,%u,%u,%u\n"
             "filter %s\n"
             "%s",
             ca_version(), plan->scene->desc.content_hash, integrator, values, ca_sampler_name(plan->sampler.kind),
             plan->sampler.seed, plan->camera.width, plan->camera.height, crop[0], crop[1], crop[2], crop[3],
             ca_filter_name(plan->filter.kind), memory);
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
