#include "import/elements.h"

#include "base/text.h"

#include <string.h>

enum { MAX_ATTRIBUTES = 5 };

typedef struct element {
    const char *tag;
    ca_element_kind kind;
    /* A name with '!' in front is required. */
    const char *attributes[MAX_ATTRIBUTES];
} element;

static const element elements[] = {
    {"boolean", CA_ELEMENT_PARAMETER, {"!name", "!value"}},
    {"integer", CA_ELEMENT_PARAMETER, {"!name", "!value"}},
    {"float", CA_ELEMENT_PARAMETER, {"!name", "!value"}},
    {"string", CA_ELEMENT_PARAMETER, {"!name", "!value"}},
    {"rgb", CA_ELEMENT_PARAMETER, {"!name", "!value"}},
    {"srgb", CA_ELEMENT_PARAMETER, {"!name", "!value"}},
    {"spectrum", CA_ELEMENT_PARAMETER, {"!name", "value", "filename"}},
    {"blackbody", CA_ELEMENT_PARAMETER, {"!name", "!temperature", "scale"}}, /* until it is an object */
    {"point", CA_ELEMENT_PARAMETER, {"!name", "x", "y", "z", "value"}},
    {"vector", CA_ELEMENT_PARAMETER, {"!name", "x", "y", "z", "value"}},
    {"transform", CA_ELEMENT_PARAMETER, {"!name"}},
    {"translate", CA_ELEMENT_TRANSFORM_STEP, {"x", "y", "z", "value"}},
    {"scale", CA_ELEMENT_TRANSFORM_STEP, {"x", "y", "z", "value"}},
    {"rotate", CA_ELEMENT_TRANSFORM_STEP, {"x", "y", "z", "value", "!angle"}},
    {"lookat", CA_ELEMENT_TRANSFORM_STEP, {"!origin", "!target", "up"}},
    {"matrix", CA_ELEMENT_TRANSFORM_STEP, {"!value"}},
    {"scene", CA_ELEMENT_OBJECT, {"!version", "type", "id"}},
    {"integrator", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"sensor", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"sampler", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"film", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"rfilter", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"shape", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"bsdf", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"emitter", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"texture", CA_ELEMENT_OBJECT, {"!type", "id", "name"}},
    {"ref", CA_ELEMENT_REFERENCE, {"!id", "name"}},
    {"default", CA_ELEMENT_DIRECTIVE, {"!name", "!value"}},
    {"include", CA_ELEMENT_DIRECTIVE, {"!filename"}},
    {"alias", CA_ELEMENT_DIRECTIVE, {"!id", "!as"}},
    {"path", CA_ELEMENT_DIRECTIVE, {"!value"}},
};
enum { ELEMENT_COUNT = sizeof elements / sizeof *elements };

/* Elements of Mitsuba that are not supported: told apart from typing errors. */
static const char *const unsupported[] = {"medium", "phase",     "volume", "subsurface", "animation",
                                          "camera", "luminaire", "random", "utils",  "field"};

static bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
static bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }

/* toWorld -> to_world, intIOR -> int_ior: an underscore where a lower case letter meets an upper case one, and the
 * run of upper case letters becomes lower case. */
static const char *snake_case(const char *name, ca_arena *arena)
{
    char *result = ca_arena_alloc(arena, 2 * strlen(name) + 1, 1);
    if (!result) return NULL;
    size_t n = 0;
    bool in_run = false;
    for (size_t i = 0; name[i]; i++) {
        if (i > 0 && is_upper(name[i]) && is_lower(name[i - 1])) {
            result[n++] = '_';
            in_run = true;
        }
        in_run = in_run && is_upper(name[i]);
        result[n++] = in_run ? (char)(name[i] - 'A' + 'a') : name[i];
    }
    return result;
}

/* A temperature like "7000K" or "7000" without its unit. */
static const char *in_kelvin(const char *text, ca_arena *arena)
{
    const size_t length = strlen(text);
    char *number = ca_arena_strdup(arena, text);
    if (number && length > 0 && (text[length - 1] == 'K' || text[length - 1] == 'k')) number[length - 1] = 0;
    return number;
}

/* Appends <float name="NAME" value="VALUE"/>. */
static bool add_float(ca_xml_node *node, const char *name, const char *value, ca_arena *arena)
{
    ca_xml_node *child = ca_arena_alloc(arena, 1, sizeof *child);
    ca_xml_attribute *attributes = ca_arena_alloc(arena, 2, sizeof *attributes);
    if (!child || !attributes || !value) return false;
    attributes[0] = (ca_xml_attribute){"name", name};
    attributes[1] = (ca_xml_attribute){"value", value};
    *child = (ca_xml_node){.tag = "float", .attributes = attributes, .attribute_count = 2, .where = node->where};
    if (node->last_child)
        node->last_child->next = child;
    else
        node->first_child = child;
    node->last_child = child;
    return true;
}

/* <blackbody name="intensity" temperature="7000K" scale="0.1"/> of Mitsuba 0.6 becomes <spectrum type="blackbody"
 * name="intensity"> with these two as parameters, if it is as it should be. */
static bool upgrade_blackbody(ca_xml_node *node, ca_arena *arena)
{
    const char *const name = ca_xml_attribute_value(node, "name");
    const char *const temperature = ca_xml_attribute_value(node, "temperature");
    const char *const scale = ca_xml_attribute_value(node, "scale");
    if (!name || !temperature || node->first_child || node->attribute_count > (scale ? 3 : 2)) return true;
    ca_xml_attribute *attributes = ca_arena_alloc(arena, 2, sizeof *attributes);
    if (!attributes) return false;
    attributes[0] = (ca_xml_attribute){"type", "blackbody"};
    attributes[1] = (ca_xml_attribute){"name", name};
    node->tag = "spectrum";
    node->attributes = attributes;
    node->attribute_count = 2;
    return add_float(node, "temperature", in_kelvin(temperature, arena), arena) &&
           (!scale || add_float(node, "scale", scale, arena));
}

bool ca_element_upgrade(ca_xml_node *node, ca_arena *arena)
{
    if (strcmp(node->tag, "lookAt") == 0) node->tag = "lookat";
    if (strcmp(node->tag, "blackbody") == 0 && !upgrade_blackbody(node, arena)) return false;
    /* A spectrum of a type is an object like a texture, and may stand where one can. */
    if (strcmp(node->tag, "spectrum") == 0 && ca_xml_attribute_value(node, "type")) node->tag = "texture";
    if (strcmp(node->tag, "default") == 0) return true;
    for (uint32_t i = 0; i < node->attribute_count; i++) {
        ca_xml_attribute *attribute = &node->attributes[i];
        if (strcmp(attribute->name, "name") != 0) continue;
        attribute->value = snake_case(attribute->value, arena);
        if (!attribute->value) return false;
    }
    return true;
}

static const element *find_element(const char *tag)
{
    for (int i = 0; i < ELEMENT_COUNT; i++)
        if (strcmp(elements[i].tag, tag) == 0) return &elements[i];
    return NULL;
}

static ca_status fail_unknown(const ca_xml_node *node, ca_error *error)
{
    for (size_t i = 0; i < sizeof unsupported / sizeof *unsupported; i++)
        if (strcmp(node->tag, unsupported[i]) == 0)
            return ca_fail(error, CA_ERROR_SCENE, &node->where, "<%s> is not supported", node->tag);
    const char *tags[ELEMENT_COUNT];
    for (int i = 0; i < ELEMENT_COUNT; i++) tags[i] = elements[i].tag;
    return ca_fail(error, CA_ERROR_SCENE, &node->where, "unknown element <%s>; the nearest known one is <%s>",
                   node->tag, ca_nearest_name_however_far(node->tag, tags, ELEMENT_COUNT));
}

static const char *bare(const char *attribute)
{
    return attribute && attribute[0] == '!' ? attribute + 1 : attribute;
}

static ca_status check_attributes(const ca_xml_node *node, const element *known, ca_error *error)
{
    const char *names[MAX_ATTRIBUTES] = {NULL};
    for (int i = 0; i < MAX_ATTRIBUTES; i++) {
        names[i] = bare(known->attributes[i]);
        if (known->attributes[i] && known->attributes[i][0] == '!' && !ca_xml_attribute_value(node, names[i]))
            return ca_fail(error, CA_ERROR_SCENE, &node->where, "<%s> needs the attribute \"%s\"", node->tag,
                           names[i]);
    }
    for (uint32_t a = 0; a < node->attribute_count; a++) {
        bool found = false;
        for (int i = 0; i < MAX_ATTRIBUTES && !found; i++)
            found = names[i] && strcmp(names[i], node->attributes[a].name) == 0;
        if (!found)
            return ca_fail(error, CA_ERROR_SCENE, &node->where,
                           "<%s> has no attribute \"%s\"; the nearest known one is \"%s\"", node->tag,
                           node->attributes[a].name,
                           ca_nearest_name_however_far(node->attributes[a].name, names, MAX_ATTRIBUTES));
    }
    return CA_OK;
}

/* Objects hold parameters and objects, a transform its steps, everything else nothing. */
static bool may_hold(const ca_xml_node *parent, ca_element_kind kind)
{
    const element *outer = parent ? find_element(parent->tag) : NULL;
    if (!outer) return kind == CA_ELEMENT_OBJECT;
    if (strcmp(outer->tag, "transform") == 0)
        return kind == CA_ELEMENT_TRANSFORM_STEP || kind == CA_ELEMENT_DIRECTIVE;
    return outer->kind == CA_ELEMENT_OBJECT && kind != CA_ELEMENT_TRANSFORM_STEP;
}

ca_status ca_element_check(const ca_xml_node *node, const ca_xml_node *parent, ca_element_kind *kind, ca_error *error)
{
    const element *known = find_element(node->tag);
    if (!known) return fail_unknown(node, error);
    if (!may_hold(parent, known->kind) || (parent && strcmp(node->tag, "scene") == 0))
        return ca_fail(error, CA_ERROR_SCENE, &node->where, "<%s> cannot stand inside <%s>", node->tag,
                       parent ? parent->tag : "nothing");
    *kind = known->kind;
    return check_attributes(node, known, error);
}
