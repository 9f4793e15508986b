#include "cli/candidates.h"

#include "cli/commands.h"
#include "cli/layer_choice.h"
#include "integrator/integrator.h"
#include "metrics/tone.h"
#include "noise/ray_numbers.h"

#include <string.h>

static void print_parameter(const char *integrator, const ca_parameter_spec *spec, FILE *stream)
{
    const bool is_choice = spec->kind == CA_SPEC_CHOICE;
    const char *values = is_choice ? spec->choices : spec->kind == CA_SPEC_BOOLEAN ? "true|false" : "";
    for (bool more = true; more;) {
        const size_t length = strcspn(values, "|");
        fprintf(stream, "%s:%s=%.*s\n", integrator, spec->name, (int)length, values);
        more = values[length] != '\0';
        values += length + more;
    }
}

void ca_candidates_print(FILE *stream)
{
    const ca_integrator_type *type;
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++) {
        fprintf(stream, "%s\n", type->name);
        for (const ca_parameter_spec *spec = type->parameters; spec->name; spec++)
            print_parameter(type->name, spec, stream);
    }
}

static const char *tone(size_t i) { return i < CA_TONE_CURVE_COUNT ? ca_tone_name((ca_tone_curve)i) : NULL; }

/* For linear no exposure can be chosen; it is the last one. */
static const char *flip_tone(size_t i) { return i < CA_TONE_LINEAR ? tone(i) : NULL; }

void ca_candidates_print_values(FILE *stream)
{
    static const struct {
        const char *option;
        const char *(*name)(size_t i);
    } options[] = {{"tone", tone},
                   {"flip-tone", flip_tone},
                   {"flip", ca_compare_flip_kind},
                   {"objective", ca_ray_objective_name},
                   {"layers", ca_layer_choice_name}};
    const char *name;
    for (size_t o = 0; o < sizeof options / sizeof options[0]; o++)
        for (size_t i = 0; (name = options[o].name(i)) != NULL; i++)
            fprintf(stream, "%s %s\n", options[o].option, name);
}
