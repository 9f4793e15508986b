#include "import/pbrt/parameters.h"

#include "base/text.h"

#include <float.h>
#include <string.h>

enum { MAX_NAME = 200 };

/* ---- Types ----------------------------------------------------------------------------------------------------- */

typedef struct named_type {
    const char *name;
    ca_pbrt_type type;
} named_type;

static const named_type types[] = {
    {"integer", CA_PBRT_INTEGER}, {"float", CA_PBRT_FLOAT},       {"point2", CA_PBRT_POINT2},
    {"vector2", CA_PBRT_POINT2},  {"point3", CA_PBRT_POINT},      {"point", CA_PBRT_POINT},
    {"vector3", CA_PBRT_POINT},   {"vector", CA_PBRT_POINT},      {"normal3", CA_PBRT_POINT},
    {"normal", CA_PBRT_POINT},    {"bool", CA_PBRT_BOOL},         {"string", CA_PBRT_TEXT},
    {"texture", CA_PBRT_TEXTURE}, {"rgb", CA_PBRT_RGB},           {"color", CA_PBRT_RGB},
    {"xyz", CA_PBRT_XYZ},         {"spectrum", CA_PBRT_SPECTRUM}, {"blackbody", CA_PBRT_BLACKBODY},
};

static const char *type_name(ca_pbrt_type type)
{
    for (size_t i = 0; i < CA_COUNT(types); i++)
        if (types[i].type == type) return types[i].name;
    return "";
}

static bool has_texts(ca_pbrt_type type)
{
    return type == CA_PBRT_BOOL || type == CA_PBRT_TEXT || type == CA_PBRT_TEXTURE;
}

/* "float radius": the two words; false after failing. */
static bool read_declaration(ca_pbrt_params *params, const ca_pbrt_token *token, ca_pbrt_parameter *parameter)
{
    const char *names[CA_COUNT(types)];
    const char *type = token->text + strspn(token->text, " \t");
    const size_t type_length = strcspn(type, " \t");
    const char *name = type + type_length + strspn(type + type_length, " \t");
    const size_t name_length = strcspn(name, " \t");
    char word[16] = "";
    if (type_length < sizeof word) memcpy(word, type, type_length);
    parameter->where = token->where;
    if (name_length == 0 || name_length > MAX_NAME || name[name_length + strspn(name + name_length, " \t")]) {
        ca_import_fail(params->importer, &token->where, "\"%.80s\" is not the type and name of a parameter",
                       token->text);
        return false;
    }
    char *kept = ca_arena_alloc(&params->importer->document.arena, name_length + 1, 1);
    if (!kept) {
        ca_import_fail_memory(params->importer, "a parameter");
        return false;
    }
    parameter->name = memcpy(kept, name, name_length);
    for (size_t i = 0; i < CA_COUNT(types); i++) {
        names[i] = types[i].name;
        if (strcmp(word, types[i].name) != 0) continue;
        parameter->type = types[i].type;
        return true;
    }
    ca_import_fail(params->importer, &token->where, "\"%.*s\" is not a known type; the nearest is \"%s\"",
                   (int)(type_length < 60 ? type_length : 60), type,
                   ca_nearest_name_however_far(word, names, CA_COUNT(types)));
    return false;
}

/* ---- Reading --------------------------------------------------------------------------------------------------- */

static void add_number(ca_pbrt_params *params, const ca_pbrt_parameter *parameter, const ca_pbrt_token *token)
{
    double value;
    if (!ca_parse_number(token->text, token->length, &value) || fabs(value) > (double)FLT_MAX)
        ca_import_fail(params->importer, &token->where, "\"%.*s\" is no finite number",
                       (int)(token->length < 60 ? token->length : 60), token->text);
    else if (parameter->type == CA_PBRT_INTEGER && (value != rint(value) || fabs(value) > (double)INT32_MAX))
        ca_import_fail(params->importer, &token->where, "\"%.*s\" is no integer of 32 bits",
                       (int)(token->length < 60 ? token->length : 60), token->text);
    else if (!CA_TABLE_ADD(&params->numbers))
        ca_import_fail_memory(params->importer, "a parameter");
    else
        params->numbers.items[params->numbers.count - 1] = value;
}

static void add_text(ca_pbrt_params *params, const ca_pbrt_token *token)
{
    const char *text = token->kind == CA_PBRT_STRING               ? token->text
                       : token->length == 4 && *token->text == 't' ? "true"
                                                                   : "false";
    if (CA_TABLE_ADD(&params->texts))
        params->texts.items[params->texts.count - 1] = text;
    else
        ca_import_fail_memory(params->importer, "a parameter");
}

static void add_value(ca_pbrt_params *params, const ca_pbrt_parameter *parameter, const ca_pbrt_token *token)
{
    const bool word = ca_pbrt_is_word(token, "true") || ca_pbrt_is_word(token, "false");
    const bool number = token->kind == CA_PBRT_WORD && !word;
    const bool either = parameter->type == CA_PBRT_SPECTRUM;
    if (number ? has_texts(parameter->type) : !has_texts(parameter->type) && !either)
        ca_import_fail(params->importer, &token->where, "a value of \"%s %s\" is %s", type_name(parameter->type),
                       parameter->name, number ? "a number" : "not a number");
    else if (word && parameter->type != CA_PBRT_BOOL)
        ca_import_fail(params->importer, &token->where, "a value of \"%s %s\" is true or false",
                       type_name(parameter->type), parameter->name);
    else if (number)
        add_number(params, parameter, token);
    else
        add_text(params, token);
}

static void next(ca_pbrt_params *params, ca_pbrt_scan *scan, ca_pbrt_token *token)
{
    ca_importer *importer = params->importer;
    *token = (ca_pbrt_token){.kind = CA_PBRT_END, .text = "", .where = params->where};
    if (ca_import_good(importer)) importer->status = ca_pbrt_next(scan, token, importer->error);
}

/* One value, or values in brackets. */
static void read_values(ca_pbrt_params *params, ca_pbrt_scan *scan, ca_pbrt_parameter *parameter)
{
    const size_t numbers = params->numbers.count, texts = params->texts.count;
    ca_pbrt_token token;
    next(params, scan, &token);
    const bool list = token.kind == CA_PBRT_OPEN;
    if (list) next(params, scan, &token);
    while (ca_import_good(params->importer) && token.kind != CA_PBRT_CLOSE) {
        if (token.kind == CA_PBRT_END || token.kind == CA_PBRT_OPEN) {
            ca_import_fail(params->importer, &parameter->where, "parameter \"%s\" has no value%s", parameter->name,
                           list ? ", or no closing bracket" : "");
            return;
        }
        add_value(params, parameter, &token);
        if (!list) break;
        next(params, scan, &token);
    }
    if (params->texts.count > texts && params->numbers.count > numbers)
        ca_import_fail(params->importer, &parameter->where, "parameter \"%s\" has both numbers and names",
                       parameter->name);
    const bool named = params->texts.count > texts;
    parameter->count = named ? params->texts.count - texts : params->numbers.count - numbers;
    parameter->used = named; /* until the tables have stopped moving */
}

/* The tables moved while they grew. */
static void place_values(ca_pbrt_params *params)
{
    size_t number = 0, text = 0;
    for (size_t i = 0; i < params->list.count; i++) {
        ca_pbrt_parameter *p = &params->list.items[i];
        if (p->used)
            p->texts = params->texts.items + text, text += p->count;
        else
            p->numbers = params->numbers.items ? params->numbers.items + number : NULL, number += p->count;
        p->used = false;
    }
}

void ca_pbrt_params_read(ca_pbrt_params *params, ca_importer *importer, ca_pbrt_scan *scan, uint32_t space)
{
    params->importer = importer;
    params->list.count = params->numbers.count = params->texts.count = params->asked_count = 0;
    while (ca_import_good(importer)) {
        ca_pbrt_token token;
        importer->status = ca_pbrt_peek(scan, &token, importer->error);
        if (!ca_import_good(importer) || token.kind != CA_PBRT_STRING) break;
        ca_pbrt_parameter parameter = {.space = space};
        next(params, scan, &token);
        if (!read_declaration(params, &token, &parameter)) break;
        read_values(params, scan, &parameter);
        if (!CA_TABLE_ADD(&params->list)) ca_import_fail_memory(importer, "a parameter");
        if (ca_import_good(importer)) params->list.items[params->list.count - 1] = parameter;
    }
    if (ca_import_good(importer)) place_values(params);
    if (!ca_import_good(importer)) params->list.count = 0;
}

void ca_pbrt_params_preset(ca_pbrt_params *params, const ca_pbrt_preset *presets)
{
    for (; presets && ca_import_good(params->importer); presets = presets->next) {
        bool given = false;
        for (size_t i = 0; i < params->list.count && !given; i++)
            given = strcmp(params->list.items[i].name, presets->parameter.name) == 0;
        if (given) continue;
        if (!CA_TABLE_ADD(&params->list)) {
            ca_import_fail_memory(params->importer, "a parameter");
            return;
        }
        params->list.items[params->list.count - 1] = presets->parameter;
        params->list.items[params->list.count - 1].optional = true;
    }
}

void ca_pbrt_params_end(ca_pbrt_params *params)
{
    for (size_t i = 0; i < params->list.count; i++) {
        const ca_pbrt_parameter *p = &params->list.items[i];
        if (p->used || p->optional) continue;
        const char *nearest = ca_nearest_name_however_far(p->name, params->asked, params->asked_count);
        ca_import_fail(params->importer, &p->where, "unused parameter \"%s\" of %s%s%s%s", p->name, params->what,
                       nearest ? "; the nearest known one is \"" : "", nearest ? nearest : "", nearest ? "\"" : "");
        return;
    }
}

void ca_pbrt_params_destroy(ca_pbrt_params *params)
{
    ca_free(params->list.items);
    ca_free(params->numbers.items);
    ca_free(params->texts.items);
}

/* ---- Asking ---------------------------------------------------------------------------------------------------- */

static void note_asked(ca_pbrt_params *params, const char *name)
{
    for (size_t i = 0; i < params->asked_count; i++)
        if (strcmp(params->asked[i], name) == 0) return;
    if (params->asked_count < CA_PBRT_MAX_ASKED) params->asked[params->asked_count++] = name;
}

const ca_pbrt_parameter *ca_pbrt_find(ca_pbrt_params *params, const char *name)
{
    const ca_pbrt_parameter *found = NULL;
    note_asked(params, name);
    for (size_t i = 0; i < params->list.count; i++) {
        ca_pbrt_parameter *p = &params->list.items[i];
        if (strcmp(p->name, name) != 0) continue;
        if (found)
            ca_import_fail(params->importer, &p->where, "parameter \"%s\" of %s is given a second time", name,
                           params->what);
        p->used = true;
        found = p;
    }
    return ca_import_good(params->importer) ? found : NULL;
}

void ca_pbrt_fail(ca_pbrt_params *params, const char *name, const char *message)
{
    const ca_pbrt_parameter *p = ca_pbrt_find(params, name);
    ca_import_fail(params->importer, p ? &p->where : &params->where, "parameter \"%s\" of %s %s", name, params->what,
                   message);
}

/* One value of the type, or NULL. */
static const ca_pbrt_parameter *find_one(ca_pbrt_params *params, const char *name, ca_pbrt_type type, size_t count)
{
    const ca_pbrt_parameter *p = ca_pbrt_find(params, name);
    if (!p) return NULL;
    const bool fits = p->type == type || (type == CA_PBRT_FLOAT && p->type == CA_PBRT_INTEGER);
    if (fits && p->count == count) return p;
    if (fits)
        ca_import_fail(params->importer, &p->where, "parameter \"%s\" of %s has %zu values, not %zu", name,
                       params->what, p->count, count);
    else
        ca_import_fail(params->importer, &p->where, "parameter \"%s\" of %s must be of type %s, not %s", name,
                       params->what, type_name(type), type_name(p->type));
    return NULL;
}

double ca_pbrt_number_in(ca_pbrt_params *params, const char *name, double fallback, double low, double high)
{
    const ca_pbrt_parameter *p = find_one(params, name, CA_PBRT_FLOAT, 1);
    if (!p) return fallback;
    if (p->numbers[0] >= low && p->numbers[0] <= high) return p->numbers[0];
    ca_import_fail(params->importer, &p->where, "parameter \"%s\" of %s is %g, and must lie in [%g, %g]", name,
                   params->what, p->numbers[0], low, high);
    return fallback;
}

double ca_pbrt_number(ca_pbrt_params *params, const char *name, double fallback)
{
    return ca_pbrt_number_in(params, name, fallback, -(double)FLT_MAX, (double)FLT_MAX);
}

int64_t ca_pbrt_integer_in(ca_pbrt_params *params, const char *name, int64_t fallback, int64_t low, int64_t high)
{
    const ca_pbrt_parameter *p = find_one(params, name, CA_PBRT_INTEGER, 1);
    if (!p) return fallback;
    const int64_t value = (int64_t)p->numbers[0];
    if (value >= low && value <= high) return value;
    ca_import_fail(params->importer, &p->where, "parameter \"%s\" of %s is %lld, and must lie in [%lld, %lld]", name,
                   params->what, (long long)value, (long long)low, (long long)high);
    return fallback;
}

bool ca_pbrt_boolean(ca_pbrt_params *params, const char *name, bool fallback)
{
    const ca_pbrt_parameter *p = find_one(params, name, CA_PBRT_BOOL, 1);
    if (!p) return fallback;
    if (strcmp(p->texts[0], "true") == 0) return true;
    if (strcmp(p->texts[0], "false") == 0) return false;
    ca_import_fail(params->importer, &p->where, "\"%s\" is neither true nor false", p->texts[0]);
    return fallback;
}

const char *ca_pbrt_string(ca_pbrt_params *params, const char *name, const char *fallback)
{
    const ca_pbrt_parameter *p = find_one(params, name, CA_PBRT_TEXT, 1);
    return p ? p->texts[0] : fallback;
}

size_t ca_pbrt_choice(ca_pbrt_params *params, const char *name, const char *const *choices, size_t count,
                      size_t fallback)
{
    const ca_pbrt_parameter *p = find_one(params, name, CA_PBRT_TEXT, 1);
    if (!p) return fallback;
    for (size_t i = 0; i < count; i++)
        if (strcmp(p->texts[0], choices[i]) == 0) return i;
    ca_import_fail(params->importer, &p->where, "\"%s\" is not a known %s; the nearest is \"%s\"", p->texts[0], name,
                   ca_nearest_name_however_far(p->texts[0], choices, count));
    return fallback;
}

bool ca_pbrt_point(ca_pbrt_params *params, const char *name, double xyz[3])
{
    const ca_pbrt_parameter *p = find_one(params, name, CA_PBRT_POINT, 3);
    if (p) memcpy(xyz, p->numbers, 3 * sizeof *xyz);
    return p != NULL;
}

const double *ca_pbrt_array(ca_pbrt_params *params, const char *name, ca_pbrt_type type, size_t group, size_t *count)
{
    *count = 0;
    const ca_pbrt_parameter *p = ca_pbrt_find(params, name);
    if (!p) return NULL;
    /* uv were pairs of floats before there were points of two numbers. */
    if (p->type != type && !(type == CA_PBRT_POINT2 && p->type == CA_PBRT_FLOAT))
        ca_import_fail(params->importer, &p->where, "parameter \"%s\" of %s must be of type %s, not %s", name,
                       params->what, type_name(type), type_name(p->type));
    else if (p->count == 0 || p->count % group != 0)
        ca_import_fail(params->importer, &p->where, "parameter \"%s\" of %s has %zu numbers: not a multiple of %zu",
                       name, params->what, p->count, group);
    if (!ca_import_good(params->importer)) return NULL;
    *count = p->count / group;
    return p->numbers;
}

void ca_pbrt_ignore(ca_pbrt_params *params, const char *const *names, size_t count)
{
    for (size_t i = 0; i < count; i++) ca_pbrt_find(params, names[i]);
}
