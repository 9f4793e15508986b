#include "import/convert/scene_text.h"

#include "base/hash.h"
#include "base/text.h"
#include "import/number.h"

#include <stdio.h>
#include <string.h>

/* ---- Text ------------------------------------------------------------------------------------------------------ */

static void put_bytes(ca_scene_writer *w, const char *bytes, size_t length)
{
    if (!ca_import_good(w->importer)) return;
    if (length > CA_XML_MAX_FILE_BYTES - w->length) {
        ca_import_fail(w->importer, NULL,
                       "the scene is longer than the %d bytes that a file of this language may have",
                       CA_XML_MAX_FILE_BYTES);
        return;
    }
    char *text = ca_array_grow(w->text, &w->capacity, w->length + length, 1);
    if (!text) {
        ca_import_fail_memory(w->importer, "the scene's text");
        return;
    }
    w->text = text;
    memcpy(text + w->length, bytes, length);
    w->length += length;
}

static void put(ca_scene_writer *w, const char *text) { put_bytes(w, text, strlen(text)); }

static void indent(ca_scene_writer *w, int depth)
{
    for (int i = 0; i < depth; i++) put(w, "    ");
}

/* How many bytes the character has that the text begins with; 0: it is none that XML can hold. */
static size_t character_length(const char *text)
{
    const unsigned char *c = (const unsigned char *)text;
    if (c[0] < 0x80) return c[0] >= 0x20 || strchr("\t\n\r", c[0]) ? 1 : 0;
    const size_t length = c[0] >= 0xf0 ? 4 : c[0] >= 0xe0 ? 3 : 2;
    if (c[0] < 0xc2 || c[0] > 0xf4) return 0;
    uint32_t code = c[0] & (0x7fu >> length);
    for (size_t i = 1; i < length; i++) {
        if ((c[i] & 0xc0) != 0x80) return 0;
        code = code << 6 | (c[i] & 0x3f);
    }
    static const uint32_t least[5] = {0, 0, 0x80, 0x800, 0x10000};
    const bool surrogate = code >= 0xd800 && code < 0xe000, unused = code == 0xfffe || code == 0xffff;
    return code < least[length] || code > 0x10ffff || surrogate || unused ? 0 : length;
}

/* The value of an attribute. A $ would begin a name. */
static void put_value(ca_scene_writer *w, const ca_location *where, const char *value)
{
    while (*value && ca_import_good(w->importer)) {
        const size_t length = character_length(value);
        if (length == 0) {
            ca_import_fail(w->importer, where, "this has a text with a character that XML cannot hold");
            return;
        }
        switch (*value) {
        case '&': put(w, "&amp;"); break;
        case '<': put(w, "&lt;"); break;
        case '>': put(w, "&gt;"); break;
        case '"': put(w, "&quot;"); break;
        case '\t': put(w, "&#9;"); break;
        case '\n': put(w, "&#10;"); break;
        case '\r': put(w, "&#13;"); break;
        case '$': put(w, "\\$"); break;
        default: put_bytes(w, value, length); break;
        }
        value += length;
    }
}

static void put_attribute(ca_scene_writer *w, const ca_location *where, const char *name, const char *value)
{
    put(w, " ");
    put(w, name);
    put(w, "=\"");
    put_value(w, where, value);
    put(w, "\"");
}

/* ---- What is said otherwise ------------------------------------------------------------------------------------ */

static bool is(const char *text, const char *word) { return text && strcmp(text, word) == 0; }

static const char *type_of(const ca_xml_node *node) { return ca_xml_attribute_value(node, "type"); }
static const char *name_of(const ca_xml_node *node) { return ca_xml_attribute_value(node, "name"); }

static const ca_xml_node *child_named(const ca_xml_node *node, const char *name)
{
    for (const ca_xml_node *child = node->first_child; child; child = child->next)
        if (is(name_of(child), name)) return child;
    return NULL;
}

/* A parameter that Mitsuba 3 has under another name, or not at all. */
typedef struct parameter_rule {
    const char *tag, *type; /* of the object; type NULL: any */
    const char *name;
    const char *becomes; /* NULL: it is left out */
} parameter_rule;

static const parameter_rule rules[] = {
    {"film", NULL, "high_quality_edges", NULL}, {"film", NULL, "banner", NULL},
    {"film", NULL, "attach_log", NULL},         {"film", NULL, "gamma", NULL},
    {"film", NULL, "exposure", NULL},           {"film", NULL, "tonemap_method", NULL},
    {"film", NULL, "key", NULL},                {"film", NULL, "burn", NULL},
    {"film", NULL, "label", NULL},              {"texture", "bitmap", "max_anisotropy", NULL},
    {"texture", "bitmap", "cache", NULL},       {"texture", "bitmap", "gamma", NULL},
    {"texture", "bitmap", "wrap_mode_v", NULL}, {"texture", "bitmap", "wrap_mode_u", "wrap_mode"},
    {"texture", NULL, "uscale", NULL},          {"texture", NULL, "vscale", NULL},
    {"texture", NULL, "uoffset", NULL},         {"texture", NULL, "voffset", NULL},
    {"bsdf", "diffuse", "diffuse_reflectance", "reflectance"},
};

static const parameter_rule *rule_of(const ca_xml_node *object, const char *name)
{
    for (size_t i = 0; i < CA_COUNT(rules); i++)
        if (is(object->tag, rules[i].tag) && (!rules[i].type || is(type_of(object), rules[i].type)) &&
            is(name, rules[i].name))
            return &rules[i];
    return NULL;
}

/* Objects that Mitsuba 3 knows under another name. */
static const char *type_for_mitsuba(const ca_xml_node *node)
{
    static const char *const renamed[][3] = {
        {"film", "ldrfilm", "hdrfilm"},
        {"film", "tiledhdrfilm", "hdrfilm"},
        {"bsdf", "roughconductorGGX", "roughconductor"},
        {"bsdf", "roughdielectricGGX", "roughdielectric"},
        {"shape", "obj", "ply"},
        {"shape", "serialized", "ply"},
        {"shape", "mesh", "ply"},
    };
    for (size_t i = 0; i < CA_COUNT(renamed); i++)
        if (is(node->tag, renamed[i][0]) && is(type_of(node), renamed[i][1])) return renamed[i][2];
    return type_of(node);
}

static bool is_mesh(const ca_xml_node *node)
{
    return is(node->tag, "shape") && is(type_for_mitsuba(node), "ply");
}

/* Kinds of objects of which this renderer has some that Mitsuba 3 does not. */
static void note_foreign(ca_scene_writer *w, const ca_xml_node *node)
{
    static const char *const known[][2] = {
        {"integrator", "path"},    {"integrator", "direct"},     {"integrator", "volpath"},
        {"integrator", "ptracer"}, {"integrator", "volpathmis"}, {"integrator", "aov"},
        {"integrator", "moment"},  {"sampler", "independent"},   {"sampler", "stratified"},
        {"sampler", "ldsampler"},  {"sampler", "multijitter"},   {"sampler", "orthogonal"},
    };
    static const char *const unknown[][2] = {{"sensor", "realistic"}, {"bsdf", "roughdiffuse"}, {"bsdf", "phong"},
                                             {"bsdf", "mixturebsdf"}, {"texture", "scale"}, {"texture", "mix"},
                                             {"texture", "power"}, {"texture", "clamp"}, {"texture", "mapped"},
                                             {"texture", "facing"},
                                             {"shape", "heightfield"}};
    bool foreign = is(node->tag, "integrator") || is(node->tag, "sampler");
    for (size_t i = 0; i < CA_COUNT(known); i++)
        if (is(node->tag, known[i][0]) && is(type_of(node), known[i][1])) foreign = false;
    for (size_t i = 0; i < CA_COUNT(unknown); i++)
        if (is(node->tag, unknown[i][0]) && is(type_of(node), unknown[i][1])) foreign = true;
    if (foreign)
        ca_import_note(w->importer, &node->where, "Mitsuba 3 has no %s \"%s\"; it is written as it is", node->tag,
                       type_of(node));
    const ca_xml_node *wrap = is(node->tag, "texture") ? child_named(node, "wrap_mode") : NULL;
    if (wrap && is(ca_xml_attribute_value(wrap, "value"), "zero"))
        ca_import_note(w->importer, &node->where, "Mitsuba 3 has no wrap_mode \"zero\"; it is written as it is");
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

/* "folder/name" of the file with that key. */
static const char *add_output(ca_scene_writer *w, const char *key, const char *source, const char *extension,
                              ca_output output)
{
    ca_outputs *outputs = w->outputs;
    if (!ca_import_good(w->importer)) return "";
    const char *stem = ca_outputs_stem(outputs, source);
    const char *name = stem ? ca_outputs_add(outputs, key, stem, extension, output) : NULL;
    const size_t size = name ? strlen(w->folder) + strlen(name) + 2 : 0;
    char *path = name ? ca_arena_alloc(&outputs->arena, size, 1) : NULL;
    if (!path) {
        ca_import_fail_memory(w->importer, "the names of files");
        return "";
    }
    snprintf(path, size, "%s/%s", w->folder, name);
    return path;
}

/* Texts behind each other; NULL when out of memory. */
static const char *join(ca_scene_writer *w, const char *const *parts, size_t count)
{
    size_t size = 1, used = 0;
    for (size_t i = 0; i < count; i++) size += strlen(parts[i]);
    char *text = ca_arena_alloc(&w->outputs->arena, size, 1);
    if (!text) ca_import_fail_memory(w->importer, "the names of files");
    for (size_t i = 0; text && i < count; i++) {
        memcpy(text + used, parts[i], strlen(parts[i]));
        used += strlen(parts[i]);
    }
    return text;
}

static const char *resolve(ca_scene_writer *w, const ca_xml_node *node, const char *value)
{
    const char *path = ca_document_resolve(&w->importer->document, node->where.file, value);
    if (!path) ca_import_fail_memory(w->importer, "the names of files");
    return path;
}

/* What a file is made from that is copied as it is. */
static const char *copied_file(ca_scene_writer *w, const ca_xml_node *node, const char *value)
{
    const char *path = resolve(w, node, value);
    if (!path) return "";
    const char *parts[2] = {"copy ", path}, *key = join(w, parts, 2);
    return key ? add_output(w, key, path, ca_path_extension(path), (ca_output){CA_OUTPUT_COPY, .source = path}) : "";
}

static const char *value_of_child(const ca_xml_node *node, const char *name)
{
    const ca_xml_node *child = child_named(node, name);
    const char *value = child ? ca_xml_attribute_value(child, "value") : NULL;
    return value ? value : "";
}

/* A mesh as it was made: with uv and normals as the parameters want them. */
static const char *mesh_file(ca_scene_writer *w, const ca_xml_node *shape, const char *value)
{
    const bool array = is(type_of(shape), "mesh");
    const char *path = array ? value : resolve(w, shape, value);
    const ca_scene_desc *desc = w->importer->desc;
    if (!path || shape->result >= desc->shapes.count || desc->shapes.items[shape->result].kind != CA_SHAPE_MESH)
        return "";
    const char *parts[] = {type_of(shape), " ", value_of_child(shape, "shape_index"),
                           " ",            value_of_child(shape, "face_normals"),
                           " ",            value_of_child(shape, "flip_tex_coords"),
                           " ",            path};
    const char *key = join(w, parts, CA_COUNT(parts));
    const ca_output output = {CA_OUTPUT_MESH, .index = desc->shapes.items[shape->result].as.mesh.index};
    return key ? add_output(w, key, path, ".ply", output) : "";
}

/* Curves that were made. */
static const char *curve_file(ca_scene_writer *w, const ca_xml_node *shape, const char *value)
{
    const ca_scene_desc *desc = w->importer->desc;
    const char *parts[2] = {"curve ", value}, *key = join(w, parts, 2);
    if (!key || shape->result >= desc->shapes.count || desc->shapes.items[shape->result].kind != CA_SHAPE_CURVE)
        return "";
    const uint32_t index = desc->shapes.items[shape->result].as.curve.index;
    return add_output(w, key, value, ".txt", (ca_output){CA_OUTPUT_CURVE, .index = index});
}

/* A picture that was handed over as an array: with its negative numbers, where something else than colours has it. */
static const char *array_file(ca_scene_writer *w, const char *name)
{
    const ca_importer *importer = w->importer;
    const char *parts[2] = {"array ", name}, *key = join(w, parts, 2);
    const ca_import_image *found = NULL;
    for (size_t i = 0; key && i < importer->images.count; i++) {
        const ca_import_image *image = &importer->images.items[i];
        if (image->array && is(image->path, name) && (!found || found->cut)) found = image;
    }
    return found ? add_output(w, key, name, ".exr", (ca_output){CA_OUTPUT_IMAGE, .index = found->index}) : "";
}

/* Does this parameter name a file, or an array that becomes one? */
static bool names_file(const ca_xml_node *node, const ca_xml_node *parent)
{
    if (!parent || !is(node->tag, "string")) return false;
    if (is(name_of(node), "filename")) return true;
    const bool may_have_data = is(parent->tag, "texture") || is(parent->tag, "emitter") || is_mesh(parent) ||
                               is(type_of(parent), "bsplinecurve");
    return is(name_of(node), "data") && may_have_data;
}

static const char *file_of(ca_scene_writer *w, const ca_xml_node *node, const ca_xml_node *parent, const char *value)
{
    if (is_mesh(parent)) return mesh_file(w, parent, value);
    if (!is(name_of(node), "data")) return copied_file(w, parent, value);
    return is(parent->tag, "shape") ? curve_file(w, parent, value) : array_file(w, value);
}

/* ---- Elements -------------------------------------------------------------------------------------------------- */

static bool has_several_tokens(const char *value)
{
    const char *token;
    return ca_next_token(&value, &token) > 0 && ca_next_token(&value, &token) > 0;
}

/* <srgb>, and <spectrum> of three numbers or a hexadecimal colour, are 0.6's. */
static const char *tag_for_mitsuba(const ca_xml_node *node)
{
    const char *value = ca_xml_attribute_value(node, "value");
    if (is(node->tag, "srgb")) return "rgb";
    if (is(node->tag, "spectrum") && value && !strchr(value, ':') && (value[0] == '#' || has_several_tokens(value)))
        return "rgb";
    return type_of(node) && ca_import_is_spectrum(node) ? "spectrum" : node->tag;
}

/* With dots as underscores, are they the same? */
static bool are_alike(const char *a, const char *b)
{
    while (*a && (*a == *b || (strchr("._", *a) && *b && strchr("._", *b)))) a++, b++;
    return *a == *b;
}

/* Is another id alike? Ids are sorted, and alike ones are the same up to the first dot or underscore. */
static bool has_another_alike(const ca_document *document, const char *id)
{
    const size_t same = strcspn(id, "._");
    for (size_t i = ca_document_first_id(document, id, same); i < document->id_count; i++) {
        const char *other = document->ids[i].id;
        if (strncmp(other, id, same) != 0) break;
        if (strcmp(other, id) != 0 && are_alike(other, id)) return true;
    }
    return false;
}

/* Mitsuba's ids have no dots. One that would be another's gets a number of its own, made from its text. */
static const char *id_for_mitsuba(ca_scene_writer *w, const char *id)
{
    if (!strchr(id, '.')) return id;
    char number[16] = "";
    if (has_another_alike(&w->importer->document, id))
        snprintf(number, sizeof number, "_%08x", (unsigned)(ca_hash_bytes(0, id, strlen(id)) >> 32));
    const char *const parts[2] = {id, number};
    char *changed = (char *)(uintptr_t)join(w, parts, 2);
    for (char *c = changed; c && *c; c++)
        if (*c == '.') *c = '_';
    return changed ? changed : id;
}

/* Of the object itself, where the reference goes by an alias. */
static const char *referenced_id(ca_scene_writer *w, const char *id)
{
    const ca_xml_node *target = ca_document_find(&w->importer->document, id);
    const char *own = target ? ca_xml_attribute_value(target, "id") : NULL;
    return id_for_mitsuba(w, own ? own : id);
}

/* Numbers with a decimal point, whatever the locale has. */
static void set_points(char *text)
{
    for (char *c = text; *c; c++)
        if (!strchr("+-0123456789e ", *c)) *c = '.';
}

/* Linear values of an <srgb>, to the bit of a float. */
static const char *linear_value(ca_scene_writer *w, const ca_xml_node *node)
{
    char text[128];
    const ca_rgb rgb = ca_import_color(w->importer, node, CA_COLOR_SIGNED);
    snprintf(text, sizeof text, "%.9g %.9g %.9g", (double)rgb.r, (double)rgb.g, (double)rgb.b);
    set_points(text);
    const char *one[1] = {text}, *kept = join(w, one, 1);
    return kept ? kept : "";
}

/* 1 - x of a parameter that means the other share in the version that is written. */
static const char *complement(ca_scene_writer *w, const char *value)
{
    char text[64];
    double number;
    if (!ca_parse_double(value, &number)) return value;
    snprintf(text, sizeof text, "%.17g", 1.0 - number);
    set_points(text);
    const char *one[1] = {text}, *kept = join(w, one, 1);
    return kept ? kept : "";
}

static bool is_integrator(const ca_xml_node *node) { return node && is(node->tag, "integrator"); }

static const char *value_for_mitsuba(ca_scene_writer *w, const ca_xml_node *node, const ca_xml_node *parent,
                                     const ca_xml_attribute *attribute)
{
    const char *name = attribute->name, *value = attribute->value;
    if (is(node->tag, "scene") && is(name, "version")) return "3.0.0";
    if (is(name, "type")) return type_for_mitsuba(node);
    if (is(name, "id")) return is(node->tag, "ref") ? referenced_id(w, value) : id_for_mitsuba(w, value);
    if (is(name, "filename")) return copied_file(w, node, value); /* of a spectrum */
    if (is(name, "name") && names_file(node, parent)) return "filename";
    const parameter_rule *rule = is(name, "name") && parent ? rule_of(parent, value) : NULL;
    if (rule) return rule->becomes;
    if (!is(name, "value")) return value;
    if (names_file(node, parent)) return file_of(w, node, parent, value);
    if (is(node->tag, "srgb")) return linear_value(w, node);
    if (is_integrator(parent) && ca_import_is_old_complement(w->importer, parent, name_of(node)))
        return complement(w, value);
    const bool filter = parent && is(parent->tag, "texture") && is(name_of(node), "filter_type");
    return filter && (is(value, "trilinear") || is(value, "ewa")) ? "bilinear" : value;
}

/* 0.6's way to map texture coordinates. */
static bool has_old_map(const ca_xml_node *node)
{
    return child_named(node, "uscale") || child_named(node, "vscale") || child_named(node, "uoffset") ||
           child_named(node, "voffset");
}

static bool is_left_out(const ca_xml_node *parent, const ca_xml_node *child)
{
    const char *name = name_of(child);
    const parameter_rule *rule = rule_of(parent, name);
    if (rule) return rule->becomes == NULL;
    if (is_mesh(parent)) return is(name, "flip_tex_coords") || is(name, "shape_index");
    if (!is(parent->tag, "texture")) return false;
    if (is(name, "wrap_mode")) return child_named(parent, "wrap_mode_u") != NULL;
    if (is(name, "raw")) return child_named(parent, "gamma") != NULL;
    return is(name, "to_uv") && has_old_map(parent);
}

static void put_line(ca_scene_writer *w, int depth, const char *line)
{
    indent(w, depth);
    put(w, line);
    put(w, "\n");
}

/* ---- Parameters that take the place of 0.6's ------------------------------------------------------------------- */

static double number_of(ca_scene_writer *w, const ca_xml_node *node, const char *name, double fallback)
{
    const ca_xml_node *child = child_named(node, name);
    double value = fallback;
    if (child) ca_import_numbers(w->importer, child, "value", &value, 1);
    return value;
}

/* uscale and its like, and to_uv, as one matrix. */
static void put_texture_map(ca_scene_writer *w, const ca_xml_node *node, int depth)
{
    const ca_xml_node *to_uv = child_named(node, "to_uv");
    ca_matrix m = ca_matrix_scale(number_of(w, node, "uscale", 1.0), number_of(w, node, "vscale", 1.0), 1.0);
    const ca_matrix offset =
        ca_matrix_translate(number_of(w, node, "uoffset", 0.0), number_of(w, node, "voffset", 0.0), 0.0);
    m = ca_matrix_multiply(&offset, &m);
    if (to_uv) {
        const ca_matrix last = ca_import_transform(w->importer, to_uv);
        m = ca_matrix_multiply(&last, &m);
    }
    char numbers[16 * 32];
    size_t used = 0;
    for (int i = 0; i < 16; i++)
        used += (size_t)snprintf(numbers + used, sizeof numbers - used, i ? " %.17g" : "%.17g", m.m[i / 4][i % 4]);
    set_points(numbers);
    put_line(w, depth, "<transform name=\"to_uv\">");
    indent(w, depth + 1);
    put(w, "<matrix value=\"");
    put(w, numbers);
    put(w, "\"/>\n");
    put_line(w, depth, "</transform>");
}

static bool says_true(const ca_xml_node *boolean)
{
    const char *value = boolean ? ca_xml_attribute_value(boolean, "value") : NULL;
    return value && (value[0] == 't' || value[0] == 'T');
}

static void put_further_parameters(ca_scene_writer *w, const ca_xml_node *node, int depth)
{
    if (is(node->tag, "bsdf") && !is(type_of(node), type_for_mitsuba(node)) && !child_named(node, "distribution"))
        put_line(w, depth, "<string name=\"distribution\" value=\"ggx\"/>");
    if (!is(node->tag, "texture")) return;
    const bool raw = child_named(node, "gamma") && says_true(child_named(node, "raw"));
    if (raw || number_of(w, node, "gamma", 0.0) == 1.0)
        put_line(w, depth, "<boolean name=\"raw\" value=\"true\"/>");
    if (has_old_map(node)) put_texture_map(w, node, depth);
}

/* ---- The walk -------------------------------------------------------------------------------------------------- */

static void put_element(ca_scene_writer *w, const ca_xml_node *node, const ca_xml_node *parent, int depth)
{
    const bool object = type_of(node) != NULL;
    if (object) note_foreign(w, node);
    indent(w, depth);
    put(w, "<");
    put(w, tag_for_mitsuba(node));
    for (uint32_t i = 0; i < node->attribute_count && ca_import_good(w->importer); i++)
        put_attribute(w, &node->where, node->attributes[i].name,
                      value_for_mitsuba(w, node, parent, &node->attributes[i]));
    const size_t before = w->length;
    put(w, ">\n");
    const size_t inside = w->length;
    for (const ca_xml_node *child = node->first_child; child && ca_import_good(w->importer); child = child->next)
        if (!is_left_out(node, child)) put_element(w, child, node, depth + 1);
    if (object) put_further_parameters(w, node, depth + 1);
    if (!ca_import_good(w->importer)) return;
    if (w->length == inside) {
        w->length = before;
        put(w, "/>\n");
        return;
    }
    indent(w, depth);
    put(w, "</");
    put(w, tag_for_mitsuba(node));
    put(w, ">\n");
}

void ca_scene_write_text(ca_scene_writer *writer)
{
    put_element(writer, writer->importer->document.root, NULL, 0);
}
