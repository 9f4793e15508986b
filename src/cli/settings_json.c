#include "cli/settings_json.h"

#include "base/text.h"
#include "cli/json_values.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { NAME_SIZE = 64, VALUE_SIZE = 128 };

/* Readers of JSON keep whole numbers up to here. */
#define LARGEST_WHOLE_NUMBER ((uint64_t)1 << 53)

static const ca_attribute *find(const ca_image_layers *image, const char *name)
{
    return image ? ca_layers_attribute(image, name) : NULL;
}

static json_t *text_json(const ca_image_layers *image, const char *name)
{
    const ca_attribute *attribute = find(image, name);
    return attribute && attribute->text ? ca_json_text(attribute->text) : json_null();
}

static json_t *number_json(const ca_image_layers *image, const char *name)
{
    const ca_attribute *attribute = find(image, name);
    return attribute && !attribute->text ? json_integer((json_int_t)attribute->number) : json_null();
}

/* A larger one as text, with all its digits. */
static json_t *seed_json(uint64_t seed)
{
    char text[32];
    if (seed <= LARGEST_WHOLE_NUMBER) return json_integer((json_int_t)seed);
    snprintf(text, sizeof text, "%" PRIu64, seed);
    return json_string(text);
}

/* ---- The integrator -------------------------------------------------------------------------------------------- */

/* A number, true, false, or one of several words. */
static json_t *value_json(const char *text)
{
    double number;
    if (strcmp(text, "true") == 0) return json_true();
    if (strcmp(text, "false") == 0) return json_false();
    if (!ca_parse_double(text, &number)) return json_string(text);
    return strpbrk(text, ".eE") ? ca_json_number(number) : json_integer((json_int_t)number);
}

/* The parameters of "name:a=1,b=2". */
static bool set_parameters(json_t *object, const char *text)
{
    for (const char *c = strchr(text, ':'); c; c = strchr(c, ',')) {
        char name[NAME_SIZE], value[VALUE_SIZE];
        const size_t length = strcspn(++c, "=");
        if (c[length] != '=') return false;
        snprintf(name, sizeof name, "%.*s", (int)length, c);
        snprintf(value, sizeof value, "%.*s", (int)strcspn(c + length + 1, ","), c + length + 1);
        if (json_object_set_new(object, name, value_json(value)) != 0) return false;
    }
    return true;
}

static json_t *integrator_json(const ca_image_layers *image)
{
    const ca_attribute *attribute = find(image, "caustica.integrator");
    if (!attribute || !attribute->text) return json_null();
    json_t *integrator = json_object(), *parameters = json_object();
    const char *text = attribute->text;
    const bool complete =
        parameters && set_parameters(parameters, text) &&
        json_object_set_new(integrator, "name", json_stringn(text, strcspn(text, ":"))) == 0 &&
        json_object_set(integrator, "parameters", parameters) == 0;
    json_decref(parameters);
    if (complete) return integrator;
    json_decref(integrator);
    return NULL;
}

bool ca_settings_json_set(json_t *root, const ca_image_layers *image, uint64_t seed)
{
    const struct {
        const char *key;
        json_t *value;
    } members[] = {
        {"version", text_json(image, "caustica.version")},
        {"scene", text_json(image, "caustica.scene")},
        {"integrator", integrator_json(image)},
        {"sampler", text_json(image, "caustica.sampler")},
        {"seed", seed_json(seed)},
        {"threads", number_json(image, "caustica.threads")},
        {"width", image ? json_integer(image->width) : json_null()},
        {"height", image ? json_integer(image->height) : json_null()},
    };
    bool complete = root != NULL;
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++)
        complete = json_object_set_new(root, members[i].key, members[i].value) == 0 && complete;
    return complete;
}
