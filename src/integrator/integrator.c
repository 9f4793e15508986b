#include "integrator/integrator.h"

#include "base/text.h"
#include "integrator/walk.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const ca_integrator_type *ca_integrator_at(size_t index)
{
    if (index == 0) return &ca_integrator_path;
    if (index <= ca_algorithm_count) return ca_algorithms[index - 1];
    if (index == ca_algorithm_count + 1) return &ca_integrator_qmcppm;
    return index == ca_algorithm_count + 2 ? &ca_integrator_auto : NULL;
}

/* Adds a name to a list; `separator` stands before it. */
static void append_name(char text[CA_INTEGRATOR_NAMES_SIZE], const char *separator, const char *name)
{
    const size_t used = strlen(text);
    snprintf(text + used, CA_INTEGRATOR_NAMES_SIZE - used, "%s%s", separator, name);
}

void ca_integrator_names(unsigned abilities, const char *last, char text[CA_INTEGRATOR_NAMES_SIZE])
{
    const char *names[CA_MAX_INTEGRATORS];
    const ca_integrator_type *type;
    size_t count = 0;
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++)
        if (ca_integrator_has(type, abilities)) names[count++] = type->name;
    text[0] = '\0';
    for (size_t i = 0; i < count; i++) append_name(text, ca_list_separator(i, count, last), names[i]);
}

const ca_integrator_type *ca_integrator_of(const char *text)
{
    const ca_integrator_type *type;
    const size_t length = text ? strcspn(text, ":") : 0;
    for (size_t i = 0; text && (type = ca_integrator_at(i)) != NULL; i++)
        if (strlen(type->name) == length && strncmp(text, type->name, length) == 0) return type;
    return NULL;
}

/* What the scene file says is the scene's fault; anything else came with the caller's settings. */
static ca_status blame(const ca_location *where)
{
    return where && where->file ? CA_ERROR_SCENE : CA_ERROR_ARGUMENT;
}

ca_status ca_integrator_find(const char *name, const ca_location *where, const ca_integrator_type **type,
                             ca_error *error)
{
    const char *names[CA_MAX_INTEGRATORS];
    char all[CA_INTEGRATOR_NAMES_SIZE] = "";
    const ca_integrator_type *row;
    size_t count = 0;
    for (; (row = ca_integrator_at(count)) != NULL; count++) {
        names[count] = row->name;
        if (strcmp(name, row->name) == 0) {
            *type = row;
            return CA_OK;
        }
        append_name(all, count ? ", " : "", row->name);
    }
    const char *nearest = ca_nearest_name(name, names, count);
    return ca_fail(error, blame(where), where, "unknown integrator \"%s\"%s%s%s (there are: %s)", name,
                   nearest ? "; did you mean \"" : "", nearest ? nearest : "", nearest ? "\"?" : "", all);
}

static int parameter_index(const ca_integrator_type *type, const char *name)
{
    for (int i = 0; type->parameters[i].name; i++)
        if (strcmp(type->parameters[i].name, name) == 0) return i;
    return -1;
}

static ca_status fail_unknown(const ca_integrator_type *type, const ca_parameter *parameter, ca_error *error)
{
    const char *names[CA_MAX_PARAMETERS];
    size_t count = 0;
    for (; type->parameters[count].name; count++) names[count] = type->parameters[count].name;
    const char *nearest = ca_nearest_name(parameter->name, names, count);
    return ca_fail(error, blame(&parameter->where), &parameter->where,
                   "integrator \"%s\" has no parameter \"%s\"%s%s%s", type->name, parameter->name,
                   nearest ? "; did you mean \"" : "", nearest ? nearest : "", nearest ? "\"?" : "");
}

bool ca_integrator_has_parameter(const ca_integrator_type *type, const char *name)
{
    return parameter_index(type, name) >= 0;
}

/* Index of `text` among "a|b|c", or -1. */
static int choice_index(const char *choices, const char *text)
{
    const size_t length = strlen(text);
    int index = 0;
    for (const char *c = choices;; c = strchr(c, '|') + 1, index++) {
        const size_t choice_length = strcspn(c, "|");
        if (choice_length == length && strncmp(c, text, length) == 0) return index;
        if (c[choice_length] == '\0') return -1;
    }
}

static bool is_real_within(const ca_parameter_spec *spec, double value)
{
    return isfinite(value) && value >= spec->minimum && (spec->maximum == 0.0 || value <= spec->maximum) &&
           (value <= 0.0 || value >= spec->smallest);
}

static ca_status fail_real(const ca_parameter_spec *spec, const ca_parameter *parameter, ca_error *error)
{
    char limit[64] = "", least[64] = "";
    if (spec->maximum != 0.0) snprintf(limit, sizeof limit, " and at most %g", spec->maximum);
    if (spec->smallest != 0.0) snprintf(least, sizeof least, ", if not 0 at least %g", spec->smallest);
    return ca_fail(error, blame(&parameter->where), &parameter->where, "\"%s\" must be a number of at least %g%s%s",
                   spec->name, spec->minimum, limit, least);
}

ca_status ca_integrator_set(const ca_integrator_type *type, const ca_parameter *parameter, ca_integrator_input *input,
                            ca_error *error)
{
    const int i = parameter_index(type, parameter->name);
    if (i < 0) return fail_unknown(type, parameter, error);
    const ca_parameter_spec *spec = &type->parameters[i];
    double value = parameter->number;
    switch (spec->kind) {
    case CA_SPEC_INTEGER:
        if (parameter->kind != CA_PARAMETER_NUMBER || value != floor(value) || value < spec->minimum || value > 1e9)
            return ca_fail(error, blame(&parameter->where), &parameter->where,
                           "\"%s\" must be a whole number of at least %g and at most 1000000000", spec->name,
                           spec->minimum);
        break;
    case CA_SPEC_REAL:
        if (parameter->kind != CA_PARAMETER_NUMBER || !is_real_within(spec, value))
            return fail_real(spec, parameter, error);
        break;
    case CA_SPEC_BOOLEAN:
        if (parameter->kind != CA_PARAMETER_BOOLEAN)
            return ca_fail(error, blame(&parameter->where), &parameter->where, "\"%s\" must be true or false",
                           spec->name);
        break;
    case CA_SPEC_CHOICE:
        value = parameter->kind == CA_PARAMETER_TEXT ? choice_index(spec->choices, parameter->text) : -1;
        if (value < 0)
            return ca_fail(error, blame(&parameter->where), &parameter->where, "\"%s\" must be one of %s", spec->name,
                           spec->choices);
        break;
    }
    input->values[i] = value;
    return CA_OK;
}

ca_status ca_integrator_set_number(const ca_integrator_type *type, const char *name, double value,
                                   ca_integrator_input *input, ca_error *error)
{
    const ca_parameter parameter = {.name = name, .kind = CA_PARAMETER_NUMBER, .number = value};
    return ca_integrator_set(type, &parameter, input, error);
}

ca_status ca_integrator_limit_pilot(const ca_integrator_type *pilot, const ca_integrator_type *type,
                                    const ca_integrator_input *from, ca_integrator_input *input, ca_error *error)
{
    enum { MAX_DEPTH = 64, LATEST_ROULETTE = 16 };
    const double max_depth = ca_integrator_value(type, from, "max_depth", -1.0);
    const double depth = max_depth < 0.0 ? MAX_DEPTH : fmin(max_depth, MAX_DEPTH);
    const double roulette = ca_integrator_value(type, from, "rr_depth", CA_ROULETTE_DEPTH);
    const double hidden = ca_integrator_value(type, from, "hide_emitters", 0.0);
    const ca_parameter hide = {.name = "hide_emitters", .kind = CA_PARAMETER_BOOLEAN, .number = hidden};
    CA_TRY(ca_integrator_set(pilot, &hide, input, error));
    CA_TRY(ca_integrator_set_number(pilot, "max_depth", depth, input, error));
    return ca_integrator_set_number(pilot, "rr_depth", fmin(roulette, LATEST_ROULETTE), input, error);
}

ca_status ca_integrator_set_guide(const ca_integrator_type *type, const ca_emission_guide *guide,
                                  ca_integrator_input *input, ca_error *error)
{
    const ca_parameter guided = {.name = "guide", .kind = CA_PARAMETER_BOOLEAN, .number = guide != NULL};
    input->guide = guide;
    return ca_integrator_set(type, &guided, input, error);
}

/* "name=value" from the command line, as a number, a boolean or text. */
static ca_parameter parse_override(char *text)
{
    ca_parameter parameter = {.name = text, .kind = CA_PARAMETER_TEXT, .text = ""};
    char *equals = strchr(text, '=');
    if (!equals) return parameter;
    *equals = '\0';
    parameter.text = equals + 1;
    if (ca_parse_double(parameter.text, &parameter.number)) {
        parameter.kind = CA_PARAMETER_NUMBER;
    } else if (strcmp(parameter.text, "true") == 0 || strcmp(parameter.text, "false") == 0) {
        parameter.kind = CA_PARAMETER_BOOLEAN;
        parameter.number = parameter.text[0] == 't';
    }
    return parameter;
}

static ca_status apply_overrides(const ca_integrator_type *type, const char *overrides, ca_integrator_input *input,
                                 ca_error *error)
{
    char text[512];
    const size_t size = strlen(overrides) + 1;
    if (size > sizeof text)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the integrator's parameters are longer than %zu characters",
                       sizeof text - 1);
    memcpy(text, overrides, size);
    bool given[CA_MAX_PARAMETERS] = {false};
    for (char *rest = text, *end; rest && *rest; rest = end) {
        end = strchr(rest, ',');
        if (end) *end++ = '\0';
        const ca_parameter parameter = parse_override(rest);
        CA_TRY(ca_integrator_set(type, &parameter, input, error));
        const int i = parameter_index(type, parameter.name);
        if (given[i])
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "parameter \"%s\" of the integrator is given twice",
                           parameter.name);
        given[i] = true;
    }
    return CA_OK;
}

ca_status ca_integrator_create(const ca_integrator_type *type, const ca_integrator_input *input, void **integrator,
                               ca_error *error)
{
    const ca_status status = type->create(input, integrator, error);
    if (status != CA_OK) *integrator = NULL;
    return status;
}

ca_status ca_integrator_configure(const ca_integrator_type *type, const ca_integrator_desc *desc, bool replaced,
                                  const char *overrides, ca_integrator_input *input, ca_error *error)
{
    for (int i = 0; type->parameters[i].name; i++) input->values[i] = type->parameters[i].number;
    for (size_t i = 0; i < desc->parameters.count; i++) {
        const ca_parameter *parameter = &desc->parameters.items[i];
        if (replaced && parameter_index(type, parameter->name) < 0) continue;
        CA_TRY(ca_integrator_set(type, parameter, input, error));
    }
    return overrides ? apply_overrides(type, overrides, input, error) : CA_OK;
}

double ca_integrator_value(const ca_integrator_type *type, const ca_integrator_input *input, const char *name,
                           double otherwise)
{
    const int i = parameter_index(type, name);
    return i < 0 ? otherwise : input->values[i];
}

/* The choice's own text within "a|b|c". */
static void append_choice(const char *choices, int index, char *text, size_t size)
{
    while (index-- > 0) choices = strchr(choices, '|') + 1;
    snprintf(text, size, "%.*s", (int)strcspn(choices, "|"), choices);
}

void ca_parameter_describe(const ca_parameter_spec *spec, double value, char *text, size_t size)
{
    switch (spec->kind) {
    case CA_SPEC_CHOICE: append_choice(spec->choices, (int)value, text, size); break;
    case CA_SPEC_BOOLEAN: snprintf(text, size, "%s", value != 0.0 ? "true" : "false"); break;
    case CA_SPEC_REAL: snprintf(text, size, "%.9g", value); break;
    case CA_SPEC_INTEGER: snprintf(text, size, "%.0f", value); break;
    }
}

void ca_integrator_describe(const ca_integrator_type *type, const ca_integrator_input *input, char *text, size_t size)
{
    snprintf(text, size, "%s", type->name);
    for (int i = 0; type->parameters[i].name; i++) {
        const ca_parameter_spec *spec = &type->parameters[i];
        size_t used = strlen(text);
        snprintf(text + used, size - used, "%c%s=", i ? ',' : ':', spec->name);
        used = strlen(text);
        ca_parameter_describe(spec, input->values[i], text + used, size - used);
    }
}
