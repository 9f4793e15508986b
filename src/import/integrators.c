/* The integrator: its name and parameters are kept as they are; the integrator that is chosen in the end judges
 * them. Those of Mitsuba that are named otherwise here, or wrap another, are translated, and a note says so. */
#include "import/importer.h"

#include "base/text.h"
#include "import/number.h"

#include <string.h>

enum { MAX_PARAMETERS = 256 };

/* ---- Parameters ------------------------------------------------------------------------------------------------ */

static void import_value(ca_importer *importer, const ca_xml_node *node, ca_parameter *parameter)
{
    const char *value = ca_xml_attribute_value(node, "value");
    if (strcmp(node->tag, "float") == 0 || strcmp(node->tag, "integer") == 0) {
        parameter->kind = CA_PARAMETER_NUMBER;
        ca_import_numbers(importer, node, "value", &parameter->number, 1);
        if (node->tag[0] == 'i' && parameter->number != rint(parameter->number))
            ca_import_fail(importer, &node->where, "\"%s\" is no integer", value);
    } else if (strcmp(node->tag, "boolean") == 0) {
        parameter->kind = CA_PARAMETER_BOOLEAN;
        parameter->number = strcmp(value, "true") == 0;
        if (strcmp(value, "true") != 0 && strcmp(value, "false") != 0)
            ca_import_fail(importer, &node->where, "\"%s\" is neither \"true\" nor \"false\"", value);
    } else if (strcmp(node->tag, "string") == 0) {
        parameter->kind = CA_PARAMETER_TEXT;
        parameter->text = ca_arena_strdup(&importer->desc->strings, value);
        if (!parameter->text) ca_import_fail_memory(importer, "the integrator");
    } else {
        ca_import_fail(importer, &node->where,
                       "an integrator's parameter is a <float>, <integer>, <boolean> or <string>, not a <%s>",
                       node->tag);
    }
}

static void add_parameter(ca_importer *importer, const char *name, ca_parameter parameter)
{
    ca_integrator_desc *integrator = &importer->desc->integrator;
    for (size_t i = 0; i < integrator->parameters.count; i++)
        if (strcmp(integrator->parameters.items[i].name, name) == 0)
            ca_import_fail(importer, &parameter.where, "parameter \"%s\" is given a second time", name);
    if (integrator->parameters.count == MAX_PARAMETERS)
        ca_import_fail(importer, &parameter.where, "more than %d parameters", MAX_PARAMETERS);
    parameter.name = ca_arena_strdup(&importer->desc->strings, name);
    if (!parameter.name || !CA_TABLE_ADD(&integrator->parameters)) {
        ca_import_fail_memory(importer, "the integrator");
        return;
    }
    integrator->parameters.items[integrator->parameters.count - 1] = parameter;
}

/* ---- Mitsuba's names ------------------------------------------------------------------------------------------- */

/* What is done with a parameter of Mitsuba's. */
typedef enum parameter_use { DROP, RENAME, REVERSE } parameter_use;

typedef struct translated_parameter {
    const char *name;
    parameter_use use;
    const char *ours; /* of RENAME and REVERSE, which makes 1 - x of x */
} translated_parameter;

enum { MAX_TRANSLATED = 16 };

typedef struct translation {
    const char *name, *ours, *note;
    int max_depth; /* 0: the scene's */
    translated_parameter parameters[MAX_TRANSLATED];
} translation;

#define PHOTONS(name) {name, DROP, NULL}

/* The note: behind `integrator "name" is read as "ours": `. */
static const translation translations[] = {
    {"direct", "path", "paths of at most two segments, with one sample of an emitter and one of the BSDF at a vertex",
     2, {{"shading_samples", DROP, NULL}, {"emitter_samples", DROP, NULL}, {"bsdf_samples", DROP, NULL},
         {"luminaire_samples", DROP, NULL}}},
    {"volpath", "path", "there are no media", 0, {{NULL, DROP, NULL}}},
    {"volpathmis", "path", "there are no media", 0, {{"use_spectral_mis", DROP, NULL}}},
    {"volpath_simple", "path", "there are no media", 0, {{NULL, DROP, NULL}}},
    {"ptracer", "light", "the same method", 0, {{NULL, DROP, NULL}}},
    {"sppm", "ppm", "its radius shrinks from pass to pass", 0,
     {{"initial_radius", RENAME, "radius"}, {"alpha", REVERSE, "alpha"}, {"photon_count", RENAME, "light_paths"},
      {"gather_locally", DROP, NULL}, {"max_passes", DROP, NULL}, {"granularity", DROP, NULL},
      {"auto_cancel_gathering", DROP, NULL}}},
    {"photonmapper", "ppm", "photons of all kinds, merged at the first vertex that is no mirror or clear glass", 0,
     {PHOTONS("direct_samples"), PHOTONS("glossy_samples"), PHOTONS("global_photons"), PHOTONS("caustic_photons"),
      PHOTONS("volume_photons"), PHOTONS("global_lookup_radius"), PHOTONS("caustic_lookup_radius"),
      PHOTONS("lookup_size"), PHOTONS("granularity"), PHOTONS("auto_cancel_gathering")}},
    {"vpl", "bdpt", "all connections, without a clamp", 0,
     {{"shadow_map_resolution", DROP, NULL}, {"clamping", DROP, NULL}}},
};

/* What Mitsuba's integrators know about their own work: without effect on the picture. */
static const char *const without_effect[] = {"samples_per_pass", "block_size", "timeout", "monochrome"};

static const translation *find_translation(const char *name)
{
    for (size_t i = 0; i < CA_COUNT(translations); i++)
        if (strcmp(translations[i].name, name) == 0) return &translations[i];
    return NULL;
}

static const translated_parameter *find_translated(const translation *t, const char *name)
{
    for (int i = 0; t && i < MAX_TRANSLATED && t->parameters[i].name; i++)
        if (strcmp(t->parameters[i].name, name) == 0) return &t->parameters[i];
    return NULL;
}

static bool is_without_effect(const char *name)
{
    for (size_t i = 0; i < CA_COUNT(without_effect); i++)
        if (strcmp(without_effect[i], name) == 0) return true;
    return false;
}

/* Where the shading normal and the surface's disagree no light passes anyway (decision 003). */
static void check_strict_normals(ca_importer *importer, const ca_parameter *parameter)
{
    if (parameter->kind != CA_PARAMETER_BOOLEAN)
        ca_import_fail(importer, &parameter->where, "\"strict_normals\" must be true or false");
    else if (parameter->number == 0.0)
        ca_import_note(importer, &parameter->where,
                       "strict_normals is always true: no light where the shading normal and the surface disagree");
}

static void import_parameter(ca_importer *importer, const ca_xml_node *node, const translation *t)
{
    ca_parameter parameter = {.where = node->where};
    import_value(importer, node, &parameter);
    if (!ca_import_good(importer)) return;
    const char *name = ca_xml_attribute_value(node, "name");
    const translated_parameter *translated = find_translated(t, name);
    if (strcmp(name, "strict_normals") == 0) {
        check_strict_normals(importer, &parameter);
    } else if (t && translated && translated->use == DROP) {
        ca_import_note(importer, &node->where, "parameter \"%s\" of integrator \"%s\" has no effect",
                       translated->name, t->name);
    } else if (is_without_effect(name)) {
        return;
    } else if (translated) {
        if (translated->use == REVERSE) parameter.number = 1.0 - parameter.number;
        add_parameter(importer, translated->ours, parameter);
    } else {
        add_parameter(importer, name, parameter);
    }
}

/* A depth of the scene's own may only shorten the paths further. */
static void limit_depth(ca_importer *importer, const ca_xml_node *node, int max_depth)
{
    ca_integrator_desc *integrator = &importer->desc->integrator;
    for (size_t i = 0; i < integrator->parameters.count; i++) {
        ca_parameter *p = &integrator->parameters.items[i];
        if (strcmp(p->name, "max_depth") != 0 || p->kind != CA_PARAMETER_NUMBER) continue;
        if (p->number < 0.0 || p->number > max_depth) p->number = max_depth;
        return;
    }
    add_parameter(importer, "max_depth",
                  (ca_parameter){.kind = CA_PARAMETER_NUMBER, .number = max_depth, .where = node->where});
}

static void import_plain(ca_importer *importer, ca_xml_node *node)
{
    ca_integrator_desc *integrator = &importer->desc->integrator;
    const char *type = ca_xml_attribute_value(node, "type");
    const translation *t = find_translation(type);
    integrator->where = node->where;
    integrator->name = ca_arena_strdup(&importer->desc->strings, t ? t->ours : type);
    if (!integrator->name) ca_import_fail_memory(importer, "the integrator");
    if (t)
        ca_import_note(importer, &node->where, "integrator \"%s\" is read as \"%s\": %s", t->name, t->ours, t->note);
    for (const ca_xml_node *child = node->first_child; child && ca_import_good(importer); child = child->next)
        import_parameter(importer, child, t);
    if (t && t->max_depth > 0 && ca_import_good(importer)) limit_depth(importer, node, t->max_depth);
}

/* ---- Wrappers -------------------------------------------------------------------------------------------------- */

typedef struct aov {
    const char *name, *layer; /* Mitsuba's kind, and our layer; NULL: there is none */
} aov;

static const aov aovs[] = {
    {"albedo", "Albedo.*"}, {"position", "P.*"},  {"sh_normal", "N.*"},    {"depth", NULL},
    {"uv", NULL},           {"geo_normal", NULL}, {"dp_du", NULL},         {"dp_dv", NULL},
    {"duv_dx", NULL},       {"duv_dy", NULL},     {"prim_index", NULL},    {"shape_index", NULL},
    {"boundary_test", NULL},
};

/* One "name:kind" of the list. */
static void note_aov(ca_importer *importer, const ca_xml_node *node, const char *token, size_t length)
{
    const char *names[CA_COUNT(aovs)];
    char kind[64];
    const char *colon = memchr(token, ':', length);
    const size_t skipped = colon ? (size_t)(colon + 1 - token) : 0;
    if (!colon || length - skipped >= sizeof kind) {
        ca_import_fail(importer, &node->where, "\"%.*s\" is not of the form name:kind",
                       (int)(length < 60 ? length : 60), token);
        return;
    }
    memcpy(kind, token + skipped, length - skipped);
    kind[length - skipped] = '\0';
    for (size_t i = 0; i < CA_COUNT(aovs); i++) {
        names[i] = aovs[i].name;
        if (strcmp(kind, aovs[i].name) != 0) continue;
        if (aovs[i].layer)
            ca_import_note(importer, &node->where, "the aov %s is the layer %s", aovs[i].name, aovs[i].layer);
        else
            ca_import_note(importer, &node->where, "the aov %s is not made", aovs[i].name);
        return;
    }
    ca_import_fail(importer, &node->where, "\"%s\" is not a known aov; the nearest is \"%s\"", kind,
                   ca_nearest_name_however_far(kind, names, CA_COUNT(aovs)));
}

static void note_aovs(ca_props *props)
{
    const ca_xml_node *node = ca_props_find(props, "aovs");
    const char *cursor = ca_props_string(props, "aovs", NULL), *token;
    if (!cursor) ca_props_fail(props, "aovs", "is missing");
    if (!ca_import_good(props->importer)) return;
    for (size_t length; (length = ca_next_token(&cursor, &token)) > 0 && ca_import_good(props->importer);)
        note_aov(props->importer, node, token, length);
}

/* moment and aov: the picture is the nested integrator's. */
static void import_wrapper(ca_importer *importer, ca_xml_node *node, bool is_aov)
{
    ca_props props;
    ca_props_begin(&props, importer, node);
    if (is_aov) note_aovs(&props);
    for (size_t i = 0; i < CA_COUNT(without_effect); i++) ca_props_find(&props, without_effect[i]);
    ca_props_boolean(&props, "hide_emitters", false);
    ca_xml_node *cursor = NULL;
    ca_xml_node *nested = ca_props_next_object(&props, "integrator", true, &cursor);
    if (nested)
        ca_import_integrator(importer, nested);
    else
        ca_import_note(importer, &node->where, "integrator \"%s\" holds no other: the picture is the default's",
                       is_aov ? "aov" : "moment");
    if (!is_aov)
        ca_import_note(importer, &node->where,
                       "integrator \"moment\": instead of second moments there are the layers Variance.*");
    while (ca_import_good(importer) && ca_props_next_object(&props, "integrator", true, &cursor))
        ca_import_note(importer, &cursor->where, "only the first integrator in \"%s\" is rendered",
                       is_aov ? "aov" : "moment");
    ca_props_end(&props);
}

void ca_import_integrator(ca_importer *importer, ca_xml_node *node)
{
    const char *type = ca_xml_attribute_value(node, "type");
    const bool is_aov = strcmp(type, "aov") == 0;
    if (!is_aov && strcmp(type, "moment") != 0) {
        import_plain(importer, node);
        return;
    }
    if (!ca_import_enter(importer, node)) return;
    import_wrapper(importer, node, is_aov);
    ca_import_leave(importer, node, 0);
}
