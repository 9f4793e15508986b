#include "cli/candidates.h"

#include "integrator/integrator.h"

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
