#include "import/properties.h"

#include "import/importer.h"
#include "base/text.h"
#include "import/number.h"

#include <float.h>
#include <math.h>
#include <string.h>

void ca_props_begin(ca_props *props, ca_importer *importer, ca_xml_node *node)
{
    importer->entered = node;
    *props = (ca_props){.importer = importer, .node = node};
    props->type = ca_xml_attribute_value(node, "type");
    if (!props->type) props->type = node->tag;
}

static void note_asked(ca_props *props, const char *name)
{
    for (size_t i = 0; i < props->asked_count; i++)
        if (strcmp(props->asked[i], name) == 0) return;
    if (props->asked_count < CA_PROPS_MAX_ASKED) props->asked[props->asked_count++] = name;
}

void ca_props_end(ca_props *props)
{
    for (const ca_xml_node *child = props->node->first_child; child; child = child->next) {
        if (child->used) continue;
        const char *name = ca_xml_attribute_value(child, "name");
        const char *nearest = name ? ca_nearest_name_however_far(name, props->asked, props->asked_count) : NULL;
        if (!name)
            ca_import_fail(props->importer, &child->where, "%s has no use for this <%s>", props->type, child->tag);
        else
            ca_import_fail(props->importer, &child->where, "unused parameter \"%s\" of %s%s%s%s", name, props->type,
                           nearest ? "; the nearest known one is \"" : "", nearest ? nearest : "",
                           nearest ? "\"" : "");
        return;
    }
}

ca_xml_node *ca_props_find(ca_props *props, const char *name)
{
    note_asked(props, name);
    ca_xml_node *found = NULL;
    for (ca_xml_node *child = props->node->first_child; child; child = child->next) {
        const char *child_name = ca_xml_attribute_value(child, "name");
        if (!child_name || strcmp(child_name, name) != 0) continue;
        if (found) ca_import_fail(props->importer, &child->where, "parameter \"%s\" is given a second time", name);
        found = child;
        found->used = true;
    }
    return found;
}

static const char *value_of(const ca_xml_node *node) { return ca_xml_attribute_value(node, "value"); }

static bool is_tag(const ca_xml_node *node, const char *tag) { return strcmp(node->tag, tag) == 0; }

static void fail_type(ca_props *props, const ca_xml_node *node, const char *expected)
{
    ca_import_fail(props->importer, &node->where, "parameter \"%s\" of %s must be %s, not <%s>",
                   ca_xml_attribute_value(node, "name"), props->type, expected, node->tag);
}

double ca_props_number_in(ca_props *props, const char *name, double fallback, double low, double high)
{
    const ca_xml_node *node = ca_props_find(props, name);
    if (!node) return fallback;
    if (!is_tag(node, "float") && !is_tag(node, "integer")) {
        fail_type(props, node, "a <float>");
        return fallback;
    }
    double value;
    if (!ca_import_numbers(props->importer, node, "value", &value, 1)) return fallback;
    if (is_tag(node, "integer") && value != floor(value)) {
        ca_import_fail(props->importer, &node->where, "\"%s\" is no integer", value_of(node));
        return fallback;
    }
    if (value >= low && value <= high) return value;
    ca_import_fail(props->importer, &node->where, "parameter \"%s\" of %s is %g, and must lie in [%g, %g]", name,
                   props->type, value, low, high);
    return fallback;
}

double ca_props_number(ca_props *props, const char *name, double fallback)
{
    return ca_props_number_in(props, name, fallback, -(double)FLT_MAX, (double)FLT_MAX);
}

double ca_props_positive(ca_props *props, const char *name, double fallback)
{
    const double value = ca_props_number(props, name, fallback);
    if (value >= (double)FLT_MIN) return value;
    ca_props_fail(props, name, "must be greater than 0");
    return fallback;
}

int64_t ca_props_integer_in(ca_props *props, const char *name, int64_t fallback, int64_t low, int64_t high)
{
    const ca_xml_node *node = ca_props_find(props, name);
    if (!node) return fallback;
    if (!is_tag(node, "integer")) {
        fail_type(props, node, "an <integer>");
        return fallback;
    }
    const char *cursor = value_of(node), *token, *rest;
    const size_t length = ca_next_token(&cursor, &token);
    int64_t value;
    if (!ca_parse_integer(token, length, &value) || ca_next_token(&cursor, &rest) > 0 ||
        strchr(value_of(node), ',')) {
        ca_import_fail(props->importer, &node->where, "\"%s\" is no integer", value_of(node));
        return fallback;
    }
    if (value >= low && value <= high) return value;
    ca_import_fail(props->importer, &node->where, "parameter \"%s\" of %s is %lld, and must lie in [%lld, %lld]",
                   name, props->type, (long long)value, (long long)low, (long long)high);
    return fallback;
}

static bool equal_ignoring_case(const char *a, const char *b)
{
    for (; *a && *b; a++, b++) {
        const char x = *a >= 'A' && *a <= 'Z' ? (char)(*a + 32) : *a;
        const char y = *b >= 'A' && *b <= 'Z' ? (char)(*b + 32) : *b;
        if (x != y) return false;
    }
    return *a == *b;
}

bool ca_props_boolean(ca_props *props, const char *name, bool fallback)
{
    const ca_xml_node *node = ca_props_find(props, name);
    if (!node) return fallback;
    if (!is_tag(node, "boolean")) {
        fail_type(props, node, "a <boolean>");
        return fallback;
    }
    if (equal_ignoring_case(value_of(node), "true")) return true;
    if (equal_ignoring_case(value_of(node), "false")) return false;
    ca_import_fail(props->importer, &node->where, "\"%s\" is neither \"true\" nor \"false\"", value_of(node));
    return fallback;
}

const char *ca_props_string(ca_props *props, const char *name, const char *fallback)
{
    const ca_xml_node *node = ca_props_find(props, name);
    if (!node) return fallback;
    if (is_tag(node, "string")) return value_of(node);
    fail_type(props, node, "a <string>");
    return fallback;
}

size_t ca_props_choice(ca_props *props, const char *name, const char *const *choices, size_t count, size_t fallback)
{
    const char *value = ca_props_string(props, name, NULL);
    if (!value) return fallback;
    for (size_t i = 0; i < count; i++)
        if (equal_ignoring_case(value, choices[i])) return i;
    const ca_xml_node *node = ca_props_find(props, name);
    ca_import_fail(props->importer, &node->where, "\"%s\" is not a known %s; the nearest is \"%s\"", value, name,
                   ca_nearest_name_however_far(value, choices, count));
    return fallback;
}

bool ca_props_point(ca_props *props, const char *name, double point[3])
{
    const ca_xml_node *node = ca_props_find(props, name);
    if (!node) return false;
    if (!is_tag(node, "point") && !is_tag(node, "vector")) {
        fail_type(props, node, "a <point> or <vector>");
        return false;
    }
    const bool one_value = value_of(node) != NULL;
    const bool three =
        ca_xml_attribute_value(node, "x") && ca_xml_attribute_value(node, "y") && ca_xml_attribute_value(node, "z");
    if (!one_value && !three) {
        ca_import_fail(props->importer, &node->where, "<%s> needs x, y and z, or value", node->tag);
        return false;
    }
    ca_import_xyz(props->importer, node, 0.0, point);
    return true;
}

ca_matrix ca_props_transform(ca_props *props, const char *name)
{
    const ca_xml_node *node = ca_props_find(props, name);
    if (!node) return ca_matrix_identity();
    if (is_tag(node, "transform")) return ca_import_transform(props->importer, node);
    fail_type(props, node, "a <transform>");
    return ca_matrix_identity();
}

static bool is_color(const ca_xml_node *node)
{
    return is_tag(node, "rgb") || is_tag(node, "srgb") || is_tag(node, "spectrum") || is_tag(node, "float") ||
           is_tag(node, "integer");
}

/* What a <ref> stands for, or the object itself. */
static ca_xml_node *follow(ca_props *props, ca_xml_node *node)
{
    if (!is_tag(node, "ref")) return node;
    const ca_document *document = &props->importer->document;
    const char *id = ca_xml_attribute_value(node, "id");
    ca_xml_node *target = ca_document_find(document, id);
    if (target) return target;
    const char *nearest = ca_document_nearest_id(document, id);
    ca_import_fail(props->importer, &node->where, "there is no object with the id \"%s\"%s%s%s", id,
                   nearest ? "; the nearest id is \"" : "", nearest ? nearest : "", nearest ? "\"" : "");
    return NULL;
}

ca_rgb ca_props_color(ca_props *props, const char *name, ca_rgb fallback, ca_color_role role)
{
    ca_xml_node *node = ca_props_find(props, name);
    if (!node) return fallback;
    if (is_color(node)) return ca_import_color(props->importer, node, role);
    ca_xml_node *target = follow(props, node);
    if (target && ca_import_is_spectrum(target)) return ca_import_spectrum(props->importer, target, role);
    if (target) fail_type(props, node, "a colour (<rgb>, <spectrum> or <float>)");
    return fallback;
}

static ca_texture_id constant_texture(ca_props *props, ca_rgb value)
{
    const ca_texture_id id = ca_scene_desc_add_constant(props->importer->desc, value);
    if (id == CA_NONE) ca_import_fail_memory(props->importer, "textures");
    return id;
}

/* The largest of the numbers that a texture is made of; 0: it has none, or they say nothing. */
static double largest_number(const ca_scene_desc *desc, ca_texture_id id)
{
    const ca_texture *t = &desc->textures.items[id];
    switch (t->kind) {
    case CA_TEXTURE_CONSTANT: return (double)ca_rgb_max(t->as.constant);
    case CA_TEXTURE_CHECKERBOARD:
        return fmax(largest_number(desc, t->as.checkerboard.color0), largest_number(desc, t->as.checkerboard.color1));
    case CA_TEXTURE_SCALE:
        return t->as.scale.varies ? 0.0
                                  : (double)ca_rgb_max(t->as.scale.factor) * largest_number(desc, t->as.scale.child);
    case CA_TEXTURE_MAPPED: return largest_number(desc, t->as.mapped.child);
    default: return 0.0;
    }
}

/* The texture with a picture that has no negative numbers, itself if it has none. Else another one: it may also be
 * referred to where they mean something. */
static ca_texture_id without_negative(ca_importer *importer, ca_texture_id id, bool alone, const ca_location *where)
{
    ca_texture t = importer->desc->textures.items[id];
    uint32_t *part = t.kind == CA_TEXTURE_BITMAP   ? &t.as.bitmap.image_index
                     : t.kind == CA_TEXTURE_SCALE  ? &t.as.scale.child
                     : t.kind == CA_TEXTURE_MAPPED ? &t.as.mapped.child
                                                   : NULL;
    if (!part) return id;
    const uint32_t before = *part;
    *part = t.kind == CA_TEXTURE_BITMAP ? ca_import_without_negative(importer, before, alone, where)
                                        : without_negative(importer, before, false, where);
    return *part == before || !ca_import_good(importer) ? id : ca_import_add_texture(importer, &t);
}

/* Numbers of pictures, and what is made of them, may lie above 1 where a share of light is asked for: they count
 * as 1. */
static ca_texture_id cut_above_one(ca_importer *importer, ca_texture_id id, const ca_location *where)
{
    ca_scene_desc *desc = importer->desc;
    const double most = (double)ca_texture_bound(desc->textures.items, desc->images.items, id);
    if (!(most > 1.0)) return id;
    const ca_texture_id cut = ca_scene_desc_add_constant(desc, ca_rgb_grey(1.0f)); /* its transform is the identity */
    if (cut == CA_NONE) {
        ca_import_fail_memory(importer, "textures");
        return id;
    }
    desc->textures.items[cut].kind = CA_TEXTURE_CLAMP;
    desc->textures.items[cut].as.clamp.child = id;
    ca_import_note(importer, where, "reflectances, weights and opacities lie in [0, 1]: values up to %g count as 1",
                   most);
    return cut;
}

/* A texture's own numbers may be of any size: what it is used for says what they are. */
static ca_texture_id nested_texture(ca_props *props, const ca_xml_node *node, ca_xml_node *target, ca_color_role role)
{
    ca_importer *importer = props->importer;
    ca_texture_id id = ca_import_texture(importer, target);
    if (!ca_import_good(importer) || role == CA_COLOR_INDEX || role == CA_COLOR_SIGNED) return id;
    id = without_negative(importer, id, target == node && !ca_xml_attribute_value(node, "id"), &node->where);
    const bool share = role == CA_COLOR_REFLECTANCE && importer->is_text;
    if (share) ca_import_check_component(importer, node, largest_number(importer->desc, id), role);
    if (!ca_import_good(importer)) return id;
    const ca_texture_id guard = ca_import_guard_attribute(importer, id, share, &node->where);
    if (guard != CA_NONE) return guard;
    return share ? cut_above_one(importer, id, &node->where) : id;
}

ca_texture_id ca_props_texture(ca_props *props, const char *name, float fallback, ca_color_role role)
{
    ca_xml_node *node = ca_props_find(props, name);
    if (!ca_import_good(props->importer)) return CA_NONE;
    if (!node) return constant_texture(props, ca_rgb_grey(fallback));
    if (is_color(node)) return constant_texture(props, ca_import_color(props->importer, node, role));
    ca_xml_node *target = follow(props, node);
    if (target && ca_import_is_spectrum(target))
        return constant_texture(props, ca_import_spectrum(props->importer, target, role));
    if (target && is_tag(target, "texture")) return nested_texture(props, node, target, role);
    if (target) fail_type(props, node, "a colour or a <texture>");
    return CA_NONE;
}

ca_xml_node *ca_props_next_object(ca_props *props, const char *tag, bool any_name, ca_xml_node **cursor)
{
    for (ca_xml_node *child = *cursor ? (*cursor)->next : props->node->first_child; child; child = child->next) {
        if (!is_tag(child, "ref") && !is_tag(child, tag)) continue;
        if (!any_name && ca_xml_attribute_value(child, "name")) continue;
        ca_xml_node *target = follow(props, child);
        if (!target) return NULL;
        if (!is_tag(target, tag)) continue;
        child->used = true;
        *cursor = child;
        return target;
    }
    return NULL;
}

void ca_props_fail(ca_props *props, const char *name, const char *message)
{
    const ca_xml_node *node = ca_props_find(props, name);
    ca_import_fail(props->importer, node ? &node->where : &props->node->where, "parameter \"%s\" of %s %s", name,
                   props->type, message);
}
