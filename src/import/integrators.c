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
typedef enum parameter_use {
    DROP,
    RENAME,
    REVERSE,
    OLD_REVERSE /* in scenes of versions 0.x; in others it is ours */
} parameter_use;

typedef struct translated_parameter {
    const char *name;
    parameter_use use;
    const char *ours; /* of all others; REVERSE makes 1 - x of x */
} translated_parameter;

enum { MAX_TRANSLATED = 16 };

typedef struct translation {
    const char *name, *ours, *note; /* note NULL: both mean the same */
    int max_depth;                  /* 0: the scene's */
    translated_parameter parameters[MAX_TRANSLATED];
} translation;

#define PHOTONS(name) {name, DROP, NULL}
#define CHAINS "the same light, without Markov chains"
#define PRIMAL "the same picture; there are no derivatives"
#define PROJECTIVE                                                                                                   \
    {"sppc", DROP, NULL}, {"sppp", DROP, NULL}, {"sppi", DROP, NULL}, {"guiding", DROP, NULL},                       \
        {"guiding_proj", DROP, NULL}, {"guiding_rounds", DROP, NULL}

/* The note: behind `integrator "name" is read as "ours": `. */
static const translation translations[] = {
    {"direct", "path", "paths of at most two segments, with one sample of an emitter and one of the BSDF at a vertex",
     2, {{"shading_samples", DROP, NULL}, {"emitter_samples", DROP, NULL}, {"bsdf_samples", DROP, NULL},
         {"luminaire_samples", DROP, NULL}}},
    {"depth", "path", "the distance is the layer depth.T, and the picture has the lights that are seen directly", 1,
     {{NULL, DROP, NULL}}},
    {"volpath", "path", "there are no media", 0, {{NULL, DROP, NULL}}},
    {"volpathmis", "path", "there are no media", 0, {{"use_spectral_mis", DROP, NULL}}},
    {"volpath_simple", "path", "there are no media", 0, {{NULL, DROP, NULL}}},
    {"prb", "path", PRIMAL, 0, {{NULL, DROP, NULL}}},
    {"prb_basic", "path", PRIMAL, 0, {{NULL, DROP, NULL}}},
    {"prbvolpath", "path", PRIMAL, 0, {{NULL, DROP, NULL}}},
    {"prb_projective", "path", PRIMAL, 0, {PROJECTIVE}},
    {"direct_projective", "path", PRIMAL, 2, {PROJECTIVE}},
    {"ptracer", "light", "the same method", 0, {{"granularity", DROP, NULL}, {"brute_force", DROP, NULL}}},
    {"bdpt", "bdpt", NULL, 0, {{"light_image", DROP, NULL}, {"sample_direct", DROP, NULL}}},
    {"pssmlt", "auto", CHAINS, 0,
     {{"bidirectional", DROP, NULL}, {"two_stage", DROP, NULL}, {"luminance_samples", DROP, NULL},
      {"direct_samples", DROP, NULL}, {"p_large", DROP, NULL}}},
    {"mlt", "auto", CHAINS, 0,
     {{"direct_samples", DROP, NULL}, {"luminance_samples", DROP, NULL}, {"two_stage", DROP, NULL},
      {"bidirectional_mutation", DROP, NULL}, {"lens_perturbation", DROP, NULL},
      {"caustic_perturbation", DROP, NULL}, {"multi_chain_perturbation", DROP, NULL},
      {"manifold_perturbation", DROP, NULL}, {"lambda", DROP, NULL}}},
    {"erpt", "auto", CHAINS, 0,
     {{"num_chains", DROP, NULL}, {"max_chains", DROP, NULL}, {"chain_length", DROP, NULL},
      {"direct_samples", DROP, NULL}, {"luminance_samples", DROP, NULL}, {"bidirectional_mutation", DROP, NULL},
      {"lens_perturbation", DROP, NULL}, {"caustic_perturbation", DROP, NULL},
      {"multi_chain_perturbation", DROP, NULL}, {"manifold_perturbation", DROP, NULL}, {"lambda", DROP, NULL}}},
    {"sppm", "ppm", "its radius shrinks from pass to pass", 0,
     {{"initial_radius", RENAME, "radius"}, {"alpha", REVERSE, "alpha"}, {"photon_count", RENAME, "light_paths"},
      {"gather_locally", DROP, NULL}, {"max_passes", DROP, NULL}, {"granularity", DROP, NULL},
      {"auto_cancel_gathering", DROP, NULL}}},
    {"ppm", "ppm", NULL, 0,
     {{"initial_radius", RENAME, "radius"}, {"alpha", OLD_REVERSE, "alpha"}, {"photon_count", RENAME, "light_paths"},
      {"max_passes", DROP, NULL}, {"granularity", DROP, NULL}}},
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

static bool reverses(const ca_importer *importer, parameter_use use)
{
    const char *version = ca_xml_attribute_value(importer->document.root, "version");
    return use == REVERSE || (use == OLD_REVERSE && version && version[0] == '0');
}

bool ca_import_is_old_complement(const ca_importer *importer, const ca_xml_node *integrator, const char *parameter)
{
    const char *type = ca_xml_attribute_value(integrator, "type");
    const translated_parameter *p = type ? find_translated(find_translation(type), parameter) : NULL;
    return p && p->use == OLD_REVERSE && reverses(importer, p->use);
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
        if (reverses(importer, translated->use)) parameter.number = 1.0 - parameter.number;
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
    if (t && t->note)
        ca_import_note(importer, &node->where, "integrator \"%s\" is read as \"%s\": %s", t->name, t->ours, t->note);
    for (const ca_xml_node *child = node->first_child; child && ca_import_good(importer); child = child->next)
        import_parameter(importer, child, t);
    if (t && t->max_depth > 0 && ca_import_good(importer)) limit_depth(importer, node, t->max_depth);
}

/* ---- Wrappers -------------------------------------------------------------------------------------------------- */

/* Integrators around others. OLD: 0.6's, which only save work. */
typedef enum wrapper { WRAPPER_NONE, WRAPPER_AOV, WRAPPER_MOMENT, WRAPPER_OLD } wrapper;

static wrapper wrapper_of(const char *type)
{
    if (strcmp(type, "aov") == 0) return WRAPPER_AOV;
    if (strcmp(type, "moment") == 0) return WRAPPER_MOMENT;
    return strcmp(type, "adaptive") == 0 || strcmp(type, "irrcache") == 0 ? WRAPPER_OLD : WRAPPER_NONE;
}

/* Kinds of layers; those behind the known ones are not made. */
static const char *const aov_kinds[] = {
    [CA_AOV_DEPTH] = "depth",           [CA_AOV_POSITION] = "position",       [CA_AOV_UV] = "uv",
    [CA_AOV_GEO_NORMAL] = "geo_normal", [CA_AOV_SH_NORMAL] = "sh_normal",     [CA_AOV_DP_DU] = "dp_du",
    [CA_AOV_DP_DV] = "dp_dv",           [CA_AOV_PRIM_INDEX] = "prim_index",   [CA_AOV_SHAPE_INDEX] = "shape_index",
    [CA_AOV_ALBEDO] = "albedo",         [CA_AOV_KIND_COUNT] = "boundary_test", "duv_dx", "duv_dy",
};

/* Layers that every picture has, or may have: a name of one's own for something else would be lost. */
static bool is_taken(const char *name, ca_aov_kind kind)
{
    static const struct {
        const char *name;
        ca_aov_kind kind;
    } groups[] = {{"Albedo", CA_AOV_ALBEDO}, {"N", CA_AOV_SH_NORMAL}, {"P", CA_AOV_POSITION}};
    static const char *const others[] = {"Variance", "RelativeVariance", "IrradianceGradient", "ConfidenceLow",
                                         "ConfidenceHigh", "ConfidenceWidened"};
    for (size_t i = 0; i < CA_COUNT(groups); i++)
        if (strcmp(name, groups[i].name) == 0) return kind != groups[i].kind;
    for (size_t i = 0; i < CA_COUNT(others); i++)
        if (strcmp(name, others[i]) == 0) return true;
    return false;
}

static void add_aov(ca_importer *importer, const ca_location *where, const char *name, ca_aov_kind kind)
{
    ca_integrator_desc *integrator = &importer->desc->integrator;
    if (is_taken(name, kind)) ca_import_fail(importer, where, "the picture has layers \"%s\" of its own", name);
    for (size_t i = 0; i < integrator->aovs.count; i++)
        if (strcmp(integrator->aovs.items[i].name, name) == 0)
            ca_import_fail(importer, where, "there is an aov \"%s\" already", name);
    if (integrator->aovs.count == CA_MAX_AOVS) ca_import_fail(importer, where, "more than %d aovs", CA_MAX_AOVS);
    if (!ca_import_good(importer)) return;
    const char *kept = ca_arena_strdup(&importer->desc->strings, name);
    if (!kept || !CA_TABLE_ADD(&integrator->aovs)) {
        ca_import_fail_memory(importer, "the integrator");
        return;
    }
    integrator->aovs.items[integrator->aovs.count - 1] = (ca_aov_desc){kept, kind};
}

/* One "name:kind" of the list. */
static void import_aov(ca_importer *importer, const ca_xml_node *node, const char *token, size_t length)
{
    char name[CA_AOV_NAME_SIZE], kind[64];
    const char *colon = memchr(token, ':', length);
    const size_t before = colon ? (size_t)(colon - token) : 0, after = length - before - 1;
    if (before == 0 || before >= sizeof name || after >= sizeof kind) {
        ca_import_fail(importer, &node->where, "\"%.*s\" is not of the form name:kind",
                       (int)(length < 60 ? length : 60), token);
        return;
    }
    memcpy(name, token, before);
    name[before] = '\0';
    memcpy(kind, colon + 1, after);
    kind[after] = '\0';
    for (size_t i = 0; i < CA_COUNT(aov_kinds); i++) {
        if (strcmp(kind, aov_kinds[i]) != 0) continue;
        if (i < CA_AOV_KIND_COUNT)
            add_aov(importer, &node->where, name, (ca_aov_kind)i);
        else
            ca_import_note(importer, &node->where, "the aov %s is not made", aov_kinds[i]);
        return;
    }
    ca_import_fail(importer, &node->where, "\"%s\" is not a known aov; the nearest is \"%s\"", kind,
                   ca_nearest_name_however_far(kind, aov_kinds, CA_COUNT(aov_kinds)));
}

static void import_aovs(ca_props *props)
{
    const ca_xml_node *node = ca_props_find(props, "aovs");
    const char *cursor = ca_props_string(props, "aovs", NULL), *token;
    if (!cursor) ca_props_fail(props, "aovs", "is missing");
    if (!ca_import_good(props->importer)) return;
    for (size_t length; (length = ca_next_token(&cursor, &token)) > 0 && ca_import_good(props->importer);)
        import_aov(props->importer, node, token, length);
}

/* What 0.6's wrappers know about their own work, which is not done here. */
static void import_old_wrapper(ca_props *props)
{
    static const char *const names[] = {"max_error", "p_value",         "max_sample_factor",    "resolution",
                                        "quality",   "quality_adjustment", "clamp_screen",      "clamp_neighbor",
                                        "gradients", "overture",        "indirect_only",        "debug"};
    for (size_t i = 0; i < CA_COUNT(names); i++) ca_props_find(props, names[i]);
    ca_import_note(props->importer, &props->node->where, "integrator \"%s\" is read as the one in it", props->type);
}

/* The picture is the nested integrator's. */
static void import_wrapper(ca_importer *importer, ca_xml_node *node, wrapper kind)
{
    ca_props props;
    ca_props_begin(&props, importer, node);
    if (kind == WRAPPER_AOV) import_aovs(&props);
    if (kind == WRAPPER_OLD) import_old_wrapper(&props);
    for (size_t i = 0; i < CA_COUNT(without_effect); i++) ca_props_find(&props, without_effect[i]);
    ca_props_boolean(&props, "hide_emitters", false);
    ca_xml_node *cursor = NULL;
    ca_xml_node *nested = ca_props_next_object(&props, "integrator", true, &cursor);
    if (nested)
        ca_import_integrator(importer, nested);
    else
        ca_import_note(importer, &node->where, "integrator \"%s\" holds no other: the picture is the default's",
                       props.type);
    if (kind == WRAPPER_MOMENT)
        ca_import_note(importer, &node->where,
                       "integrator \"moment\": instead of second moments there are the layers Variance.*");
    while (ca_import_good(importer) && ca_props_next_object(&props, "integrator", true, &cursor))
        ca_import_note(importer, &cursor->where, "only the first integrator in \"%s\" is rendered", props.type);
    ca_props_end(&props);
}

/* The distance along camera rays is a layer; the picture has the lights that are seen directly. */
static void import_depth(ca_importer *importer, ca_xml_node *node)
{
    import_plain(importer, node);
    add_aov(importer, &node->where, "depth", CA_AOV_DEPTH);
}

void ca_import_integrator(ca_importer *importer, ca_xml_node *node)
{
    const char *type = ca_xml_attribute_value(node, "type");
    if (strcmp(type, "depth") == 0) {
        import_depth(importer, node);
        return;
    }
    const wrapper kind = wrapper_of(type);
    if (kind == WRAPPER_NONE) {
        import_plain(importer, node);
        return;
    }
    if (!ca_import_enter(importer, node)) return;
    import_wrapper(importer, node, kind);
    ca_import_leave(importer, node, 0);
}
