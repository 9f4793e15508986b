/* The directives of a .pbrt file: transforms, attributes, objects, includes, and which reader each other one has. */
#define _POSIX_C_SOURCE 200809L
#include "import/pbrt/pbrt.h"

#include "base/text.h"
#include "import/inflate.h"
#include "import/pbrt/reader.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* ---- Names ----------------------------------------------------------------------------------------------------- */

ca_pbrt_named *ca_pbrt_name(ca_pbrt_names *names, const char *name)
{
    for (size_t i = names->count; i-- > 0;)
        if (strcmp(names->items[i].name, name) == 0) return &names->items[i];
    return NULL;
}

ca_pbrt_named *ca_pbrt_define(ca_pbrt *p, ca_pbrt_names *names, const char *name)
{
    ca_pbrt_named *there = ca_pbrt_name(names, name);
    if (!there) {
        if (!CA_TABLE_ADD(names)) {
            ca_import_fail_memory(p->importer, "names");
            return NULL;
        }
        there = &names->items[names->count - 1];
    }
    *there = (ca_pbrt_named){.name = name};
    return there;
}

void ca_pbrt_fail_name(ca_pbrt *p, const ca_location *where, const char *what, const char *name,
                       const ca_pbrt_names *names)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < names->count; i++) nearest = ca_nearer_name(name, nearest, names->items[i].name);
    ca_import_fail(p->importer, where, "there is no %s \"%s\"%s%s%s", what, name,
                   nearest ? "; the nearest is \"" : "", nearest ? nearest : "", nearest ? "\"" : "");
}

const char *ca_pbrt_new_id(ca_pbrt *p, const char *what, const char *name)
{
    char number[32];
    snprintf(number, sizeof number, "%u", ++p->next_id);
    const size_t size = strlen(what) + (name ? strlen(name) : 0) + strlen(number) + 5;
    char *id = ca_arena_alloc(&p->importer->document.arena, size, 1);
    if (!id) {
        ca_import_fail_memory(p->importer, "names");
        return NULL;
    }
    snprintf(id, size, "%s %s%s%s", what, number, name ? ": " : "", name ? name : "");
    return id;
}

const char *ca_pbrt_file(ca_pbrt *p, const char *name)
{
    ca_document *document = &p->importer->document;
    const char *path = ca_document_resolve(document, document->path, name);
    if (!path) ca_import_fail_memory(p->importer, "a file name");
    return path;
}

/* ---- Transforms ------------------------------------------------------------------------------------------------ */

static void set_transform(ca_pbrt *p, const ca_matrix *matrix)
{
    if (!p->state.start_is_active) return;
    for (int i = 0; i < 16; i++)
        if (!isfinite(matrix->m[i / 4][i % 4])) {
            ca_import_fail(p->importer, &p->params.where, "the transform is not finite");
            return;
        }
    p->state.ctm = *matrix;
}

static void apply(ca_pbrt *p, ca_matrix step)
{
    const ca_matrix product = ca_matrix_multiply(&p->state.ctm, &step);
    set_transform(p, &product);
}

static void run_identity(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    const ca_matrix identity = ca_matrix_identity();
    set_transform(p, &identity);
}

static void run_translate(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    apply(p, ca_matrix_translate(n[0], n[1], n[2]));
}

static void run_scale(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    apply(p, ca_matrix_scale(n[0], n[1], n[2]));
}

static void run_rotate(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    if (n[1] == 0.0 && n[2] == 0.0 && n[3] == 0.0)
        ca_import_fail(p->importer, &p->params.where, "Rotate needs an axis, and it is 0");
    else
        apply(p, ca_matrix_rotate(n[1], n[2], n[3], n[0]));
}

/* From the world to the camera. */
static void run_look_at(ca_pbrt *p, const double *n, const char *const *s)
{
    ca_matrix to_world, from_world;
    (void)s;
    if (ca_matrix_look_at(n, n + 3, n + 6, &to_world) && ca_matrix_invert(&to_world, &from_world))
        apply(p, from_world);
    else
        ca_import_fail(p->importer, &p->params.where,
                       "LookAt needs an eye, a target and up that are not on one line");
}

/* Columns one after another. */
static ca_matrix matrix_of(const double *n)
{
    ca_matrix m;
    for (int i = 0; i < 16; i++) m.m[i % 4][i / 4] = n[i];
    return m;
}

static void run_transform(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    const ca_matrix m = matrix_of(n);
    set_transform(p, &m);
}

static void run_concat(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    apply(p, matrix_of(n));
}

static void define_system(ca_pbrt *p, const char *name, const ca_matrix *matrix)
{
    ca_pbrt_named *system = ca_pbrt_define(p, &p->systems, name);
    if (system) system->matrix = *matrix;
}

static void run_coordinate_system(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    define_system(p, s[0], &p->state.ctm);
}

static void run_coordinate_transform(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    const ca_pbrt_named *system = ca_pbrt_name(&p->systems, s[0]);
    if (system)
        set_transform(p, &system->matrix);
    else
        ca_pbrt_fail_name(p, &p->params.where, "coordinate system", s[0], &p->systems);
}

/* ---- Attributes ------------------------------------------------------------------------------------------------ */

static void open_state(ca_pbrt *p, ca_pbrt_open kind)
{
    if (p->saved.count == CA_PBRT_MAX_OPEN_STATES)
        ca_import_fail(p->importer, &p->params.where, "more than %d blocks are open", CA_PBRT_MAX_OPEN_STATES);
    else if (!CA_TABLE_ADD(&p->saved))
        ca_import_fail_memory(p->importer, "attributes");
    else
        p->saved.items[p->saved.count - 1] =
            (ca_pbrt_saved){.state = p->state, .kind = kind, .where = p->params.where};
}

static const char *const open_names[] = {"AttributeBegin", "TransformBegin", "ObjectBegin"};

static void close_state(ca_pbrt *p, ca_pbrt_open kind)
{
    if (p->saved.count == 0) {
        ca_import_fail(p->importer, &p->params.where, "%s ends nothing that was begun", p->params.what);
        return;
    }
    const ca_pbrt_saved *top = &p->saved.items[p->saved.count - 1];
    if (top->kind != kind) {
        ca_import_fail(p->importer, &p->params.where, "%s, but the open block is the %s of line %u", p->params.what,
                       open_names[top->kind], top->where.line);
        return;
    }
    if (kind == CA_PBRT_OPEN_TRANSFORM) {
        p->state.ctm = top->state.ctm;
        p->state.start_is_active = top->state.start_is_active;
    } else {
        p->state = top->state;
    }
    p->saved.count--;
}

static void run_attribute_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    open_state(p, CA_PBRT_OPEN_ATTRIBUTES);
}

static void run_attribute_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    close_state(p, CA_PBRT_OPEN_ATTRIBUTES);
}

static void run_transform_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    open_state(p, CA_PBRT_OPEN_TRANSFORM);
}

static void run_transform_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    close_state(p, CA_PBRT_OPEN_TRANSFORM);
}

static void run_reverse(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    p->state.reverses = !p->state.reverses;
}

/* The parameter with its values in the document's arena. */
static bool keep_preset(ca_pbrt *p, const ca_pbrt_parameter *parameter, ca_pbrt_preset *preset)
{
    ca_arena *arena = &p->importer->document.arena;
    preset->parameter = *parameter;
    if (parameter->texts) {
        const char **texts = ca_arena_alloc(arena, parameter->count, sizeof *texts);
        if (texts) memcpy(texts, parameter->texts, parameter->count * sizeof *texts);
        preset->parameter.texts = texts;
        return texts != NULL;
    }
    double *numbers = ca_arena_alloc(arena, parameter->count + 1, sizeof *numbers);
    if (numbers && parameter->count > 0) memcpy(numbers, parameter->numbers, parameter->count * sizeof *numbers);
    preset->parameter.numbers = numbers;
    return numbers != NULL;
}

static void run_attribute(ca_pbrt *p, const double *n, const char *const *s)
{
    static const char *const targets[CA_PBRT_TARGET_COUNT] = {"shape", "light", "material", "medium", "texture"};
    size_t target = 0;
    (void)n;
    while (target < CA_PBRT_TARGET_COUNT && strcmp(targets[target], s[0]) != 0) target++;
    if (target == CA_PBRT_TARGET_COUNT) {
        ca_import_fail(p->importer, &p->params.where, "Attribute \"%s\" is not known; the nearest is \"%s\"", s[0],
                       ca_nearest_name_however_far(s[0], targets, CA_PBRT_TARGET_COUNT));
        return;
    }
    for (size_t i = 0; i < p->params.list.count; i++) {
        ca_pbrt_preset *preset = ca_arena_alloc(&p->importer->document.arena, 1, sizeof *preset);
        if (!preset || !keep_preset(p, &p->params.list.items[i], preset)) {
            ca_import_fail_memory(p->importer, "attributes");
            return;
        }
        preset->next = p->state.presets[target];
        p->state.presets[target] = preset;
        p->params.list.items[i].used = true;
    }
}

static void run_color_space(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    for (uint32_t i = 0; i < CA_PBRT_SPACE_COUNT; i++)
        if (strcmp(ca_pbrt_space_names[i], s[0]) == 0) {
            p->state.space = i;
            return;
        }
    ca_import_fail(p->importer, &p->params.where, "ColorSpace \"%s\" is not known; the nearest is \"%s\"", s[0],
                   ca_nearest_name_however_far(s[0], ca_pbrt_space_names, CA_PBRT_SPACE_COUNT));
}

/* ---- Materials, objects ---------------------------------------------------------------------------------------- */

static void run_material(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_MATERIALS]);
    p->state.material = ca_pbrt_read_material(p, s[0], NULL, &p->state.is_interface);
}

static void run_make_material(ca_pbrt *p, const double *n, const char *const *s)
{
    bool is_interface = false;
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_MATERIALS]);
    const char *type = ca_pbrt_string(&p->params, "type", NULL);
    if (!type) {
        ca_pbrt_fail(&p->params, "type", "is missing");
        return;
    }
    const char *id = ca_pbrt_read_material(p, type, s[0], &is_interface);
    ca_pbrt_named *named = id ? ca_pbrt_define(p, &p->materials, s[0]) : NULL;
    if (!named) return;
    named->id = id;
    named->flag = is_interface;
}

static void run_named_material(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    const ca_pbrt_named *named = ca_pbrt_name(&p->materials, s[0]);
    if (!named) {
        ca_pbrt_fail_name(p, &p->params.where, "material", s[0], &p->materials);
        return;
    }
    p->state.material = named->id;
    p->state.is_interface = named->flag;
}

static void run_texture(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_TEXTURES]);
    ca_pbrt_read_texture(p, s[0], s[1], s[2]);
}

static void run_shape(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_SHAPES]);
    ca_pbrt_read_shape(p, s[0]);
}

static void run_light(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_LIGHTS]);
    ca_pbrt_read_light(p, s[0]);
}

static void run_area_light(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_LIGHTS]);
    ca_pbrt_read_area_light(p, s[0]);
}

static void run_object_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    if (p->group) {
        ca_import_fail(p->importer, &p->params.where, "an object cannot hold another one");
        return;
    }
    open_state(p, CA_PBRT_OPEN_OBJECT);
    ca_pbrt_named *object = ca_pbrt_define(p, &p->objects, s[0]);
    if (!object) return;
    object->id = ca_pbrt_new_id(p, "object", s[0]);
    if (!object->id) return;
    p->group = ca_tree_named_object(&p->tree, NULL, "shape", "shapegroup", NULL, object->id);
    p->group_has_shapes = false;
}

static void run_object_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    close_state(p, CA_PBRT_OPEN_OBJECT);
    ca_pbrt_end_curves(p);
    if (!ca_import_good(p->importer) || !p->group) return;
    if (p->group_has_shapes) {
        const char *id = ca_xml_attribute_value(p->group, "id");
        ca_tree_append(&p->tree, ca_tree_root(&p->tree), p->group);
        for (size_t i = 0; i < p->objects.count; i++)
            if (strcmp(p->objects.items[i].id, id) == 0) p->objects.items[i].flag = true;
    }
    p->group = NULL;
}

static void run_instance(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    const ca_pbrt_named *object = ca_pbrt_name(&p->objects, s[0]);
    if (p->group)
        ca_import_fail(p->importer, &p->params.where, "an object cannot hold an instance");
    else if (!object)
        ca_pbrt_fail_name(p, &p->params.where, "object", s[0], &p->objects);
    if (!ca_import_good(p->importer) || !object || !object->flag) return;
    ca_xml_node *instance = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "shape", "instance");
    ca_tree_transform(&p->tree, instance, "to_world", &p->state.ctm);
    ca_tree_ref(&p->tree, instance, NULL, object->id);
}

/* ---- Options, and what has no effect --------------------------------------------------------------------------- */

static void run_camera(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_camera(p, s[0]);
    if (ca_import_good(p->importer)) define_system(p, "camera", &p->camera_to_world);
}

static void run_film(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_film(p, s[0]);
}

static void run_filter(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_filter(p, s[0]);
}

static void run_sampler(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_sampler(p, s[0]);
}

static void run_integrator(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_integrator(p, s[0]);
}

/* How rays are found has no effect on the picture. */
static void ignore_all(ca_pbrt *p)
{
    for (size_t i = 0; i < p->params.list.count; i++) p->params.list.items[i].used = true;
}

static void run_accelerator(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ignore_all(p);
}

static void run_option(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ignore_all(p);
    ca_import_note(p->importer, &p->params.where, "Option has no effect");
}

static void run_world_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_finish_options(p);
    p->in_world = true;
    p->state.start_is_active = true;
    p->state.ctm = ca_matrix_identity();
    define_system(p, "world", &p->state.ctm);
}

static void run_world_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    if (p->version != 3)
        ca_import_fail(p->importer, &p->params.where,
                       "WorldEnd belongs to version 3, and stands in the scene file itself there");
    p->ended = true;
}

static void run_transform_times(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)p, (void)n, (void)s; /* only moving objects ask for the time */
}

static void fail_medium(ca_pbrt *p)
{
    ca_import_fail(p->importer, &p->params.where, "%s: media are not supported", p->params.what);
}

static void run_medium(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    fail_medium(p);
}

/* ---- One directive --------------------------------------------------------------------------------------------- */

typedef enum place { ANYWHERE, BEFORE_WORLD, IN_WORLD } place;

typedef struct directive {
    const char *name;
    place place;
    uint32_t numbers, strings;
    bool has_parameters;
    void (*run)(ca_pbrt *p, const double *numbers, const char *const *strings);
} directive;

enum { MAX_NUMBERS = 16, MAX_STRINGS = 3 };

static const directive directives[] = {
    {"Identity", ANYWHERE, 0, 0, false, run_identity},
    {"Translate", ANYWHERE, 3, 0, false, run_translate},
    {"Scale", ANYWHERE, 3, 0, false, run_scale},
    {"Rotate", ANYWHERE, 4, 0, false, run_rotate},
    {"LookAt", ANYWHERE, 9, 0, false, run_look_at},
    {"Transform", ANYWHERE, 16, 0, false, run_transform},
    {"ConcatTransform", ANYWHERE, 16, 0, false, run_concat},
    {"CoordinateSystem", ANYWHERE, 0, 1, false, run_coordinate_system},
    {"CoordSysTransform", ANYWHERE, 0, 1, false, run_coordinate_transform},
    {"TransformTimes", BEFORE_WORLD, 2, 0, false, run_transform_times},
    {"TransformBegin", ANYWHERE, 0, 0, false, run_transform_begin},
    {"TransformEnd", ANYWHERE, 0, 0, false, run_transform_end},
    {"AttributeBegin", ANYWHERE, 0, 0, false, run_attribute_begin},
    {"AttributeEnd", ANYWHERE, 0, 0, false, run_attribute_end},
    {"Attribute", ANYWHERE, 0, 1, true, run_attribute},
    {"ColorSpace", ANYWHERE, 0, 1, false, run_color_space},
    {"Option", BEFORE_WORLD, 0, 0, true, run_option},
    {"Camera", BEFORE_WORLD, 0, 1, true, run_camera},
    {"Film", BEFORE_WORLD, 0, 1, true, run_film},
    {"PixelFilter", BEFORE_WORLD, 0, 1, true, run_filter},
    {"Sampler", BEFORE_WORLD, 0, 1, true, run_sampler},
    {"Integrator", BEFORE_WORLD, 0, 1, true, run_integrator},
    {"SurfaceIntegrator", BEFORE_WORLD, 0, 1, true, run_integrator},
    {"Accelerator", BEFORE_WORLD, 0, 1, true, run_accelerator},
    {"WorldBegin", BEFORE_WORLD, 0, 0, false, run_world_begin},
    {"WorldEnd", IN_WORLD, 0, 0, false, run_world_end},
    {"ReverseOrientation", IN_WORLD, 0, 0, false, run_reverse},
    {"Material", IN_WORLD, 0, 1, true, run_material},
    {"MakeNamedMaterial", IN_WORLD, 0, 1, true, run_make_material},
    {"NamedMaterial", IN_WORLD, 0, 1, false, run_named_material},
    {"Texture", IN_WORLD, 0, 3, true, run_texture},
    {"Shape", IN_WORLD, 0, 1, true, run_shape},
    {"LightSource", IN_WORLD, 0, 1, true, run_light},
    {"AreaLightSource", IN_WORLD, 0, 1, true, run_area_light},
    {"ObjectBegin", IN_WORLD, 0, 1, false, run_object_begin},
    {"ObjectEnd", IN_WORLD, 0, 0, false, run_object_end},
    {"ObjectInstance", IN_WORLD, 0, 1, false, run_instance},
    {"MakeNamedMedium", ANYWHERE, 0, 1, true, run_medium},
};

/* Those with a grammar of their own. */
static const char *const irregular[] = {"Include", "Import", "ActiveTransform", "MediumInterface"};

static void read_file(ca_pbrt *p, const char *name, const ca_location *where);

static bool next(ca_pbrt *p, ca_pbrt_scan *scan, ca_pbrt_token *token)
{
    if (ca_import_good(p->importer)) p->importer->status = ca_pbrt_next(scan, token, p->importer->error);
    return ca_import_good(p->importer);
}

static bool peek(ca_pbrt *p, ca_pbrt_scan *scan, ca_pbrt_token *token)
{
    if (ca_import_good(p->importer)) p->importer->status = ca_pbrt_peek(scan, token, p->importer->error);
    return ca_import_good(p->importer);
}

static bool read_strings(ca_pbrt *p, ca_pbrt_scan *scan, const char *name, uint32_t count, const char **strings)
{
    ca_pbrt_token token;
    for (uint32_t i = 0; i < count; i++) {
        if (!next(p, scan, &token)) return false;
        if (token.kind != CA_PBRT_STRING) {
            ca_import_fail(p->importer, &token.where, "%s needs %u word%s in quotes here", name, count - i,
                           ca_noun((double)(count - i), "", "s"));
            return false;
        }
        strings[i] = token.text;
    }
    return true;
}

/* With or without brackets. */
static bool read_numbers(ca_pbrt *p, ca_pbrt_scan *scan, const char *name, uint32_t count, double *numbers)
{
    ca_pbrt_token token;
    if (count == 0) return true;
    if (!peek(p, scan, &token)) return false;
    const bool bracket = token.kind == CA_PBRT_OPEN;
    if (bracket) next(p, scan, &token);
    for (uint32_t i = 0; i < count; i++) {
        if (!next(p, scan, &token)) return false;
        if (token.kind == CA_PBRT_WORD && ca_parse_number(token.text, token.length, &numbers[i])) continue;
        ca_import_fail(p->importer, &token.where, "%s needs %u finite numbers, and there are %u", name, count, i);
        return false;
    }
    if (!bracket) return true;
    if (next(p, scan, &token) && token.kind != CA_PBRT_CLOSE)
        ca_import_fail(p->importer, &token.where, "%s has more than %u numbers", name, count);
    return ca_import_good(p->importer);
}

/* What messages call it: Shape "sphere". */
static const char *call_it(ca_pbrt *p, const char *name, const char *type)
{
    if (!type) return name;
    const size_t size = strlen(name) + strlen(type) + 4;
    char *text = ca_arena_alloc(&p->importer->document.arena, size, 1);
    if (text)
        snprintf(text, size, "%s \"%s\"", name, type);
    else
        ca_import_fail_memory(p->importer, "a directive");
    return text ? text : name;
}

static void run_directive(ca_pbrt *p, ca_pbrt_scan *scan, const directive *d)
{
    double numbers[MAX_NUMBERS] = {0.0};
    const char *strings[MAX_STRINGS] = {NULL};
    const bool wrong = (d->place == BEFORE_WORLD && p->in_world) || (d->place == IN_WORLD && !p->in_world);
    if (wrong || p->ended)
        ca_import_fail(p->importer, &p->params.where, "%s cannot stand %s", d->name,
                       p->ended      ? "behind WorldEnd"
                       : p->in_world ? "behind WorldBegin"
                                     : "before WorldBegin");
    if (!read_strings(p, scan, d->name, d->strings, strings)) return;
    if (!read_numbers(p, scan, d->name, d->numbers, numbers)) return;
    p->params.list.count = 0;
    p->params.what = call_it(p, d->name, d->strings > 0 ? strings[d->strings - 1] : NULL);
    if (d->has_parameters) ca_pbrt_params_read(&p->params, p->importer, scan, p->state.space);
    p->tree.where = p->params.where;
    if (ca_import_good(p->importer)) d->run(p, numbers, strings);
    if (ca_import_good(p->importer) && d->has_parameters) ca_pbrt_params_end(&p->params);
}

/* An imported file's changes of the attributes end with it. */
static void run_include(ca_pbrt *p, ca_pbrt_scan *scan, bool import)
{
    const char *name;
    const ca_location where = p->params.where;
    if (!read_strings(p, scan, import ? "Import" : "Include", 1, &name)) return;
    const ca_pbrt_state state = p->state;
    if (import && !p->in_world) ca_import_fail(p->importer, &where, "Import cannot stand before WorldBegin");
    if (ca_import_good(p->importer)) read_file(p, name, &where);
    if (import) p->state = state;
}

static void run_active_transform(ca_pbrt *p, ca_pbrt_scan *scan)
{
    ca_pbrt_token token;
    if (!next(p, scan, &token)) return;
    const bool end = ca_pbrt_is_word(&token, "EndTime");
    if (!end && !ca_pbrt_is_word(&token, "StartTime") && !ca_pbrt_is_word(&token, "All"))
        ca_import_fail(p->importer, &token.where, "ActiveTransform is followed by StartTime, EndTime or All");
    p->state.start_is_active = !end;
    if (end) ca_import_note(p->importer, &token.where, "nothing moves: transforms of EndTime are left out");
}

/* Only the empty medium, on both sides. */
static void run_medium_interface(ca_pbrt *p, ca_pbrt_scan *scan)
{
    const char *name;
    ca_pbrt_token token;
    if (!read_strings(p, scan, "MediumInterface", 1, &name)) return;
    if (name[0]) fail_medium(p);
    if (!peek(p, scan, &token) || token.kind != CA_PBRT_STRING) return;
    if (next(p, scan, &token) && token.text[0]) fail_medium(p);
}

static void fail_directive(ca_pbrt *p, const ca_pbrt_token *token)
{
    char word[64] = "";
    const char *names[CA_COUNT(directives) + CA_COUNT(irregular)];
    for (size_t i = 0; i < CA_COUNT(directives); i++) names[i] = directives[i].name;
    for (size_t i = 0; i < CA_COUNT(irregular); i++) names[CA_COUNT(directives) + i] = irregular[i];
    const size_t length = token->length < sizeof word ? token->length : sizeof word - 1;
    if (token->kind != CA_PBRT_END) memcpy(word, token->text, length);
    if (token->kind == CA_PBRT_WORD)
        ca_import_fail(p->importer, &token->where, "\"%s\" is not a known directive; the nearest is \"%s\"", word,
                       ca_nearest_name_however_far(word, names, CA_COUNT(names)));
    else
        ca_import_fail(p->importer, &token->where, "expected a directive, not \"%s\"", word);
}

static void read_directive(ca_pbrt *p, ca_pbrt_scan *scan, const ca_pbrt_token *token)
{
    p->params.where = token->where;
    for (size_t i = 0; i < CA_COUNT(directives); i++)
        if (ca_pbrt_is_word(token, directives[i].name)) {
            run_directive(p, scan, &directives[i]);
            return;
        }
    p->params.what = "MediumInterface";
    if (ca_pbrt_is_word(token, "Include"))
        run_include(p, scan, false);
    else if (ca_pbrt_is_word(token, "Import"))
        run_include(p, scan, true);
    else if (ca_pbrt_is_word(token, "ActiveTransform"))
        run_active_transform(p, scan);
    else if (ca_pbrt_is_word(token, "MediumInterface"))
        run_medium_interface(p, scan);
    else
        fail_directive(p, token);
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static void read_text(ca_pbrt *p, const char *file, const char *text, size_t size)
{
    ca_pbrt_scan scan = ca_pbrt_scan_begin(file, text, size, &p->importer->document.arena);
    ca_pbrt_token token;
    ca_document_add_content(&p->importer->document, text, size);
    while (next(p, &scan, &token) && token.kind != CA_PBRT_END) read_directive(p, &scan, &token);
}

/* The whole file, unpacked where it is packed; false after failing. */
static bool load_bytes(ca_pbrt *p, const char *path, const ca_location *where, ca_bytes *bytes)
{
    ca_error reason;
    const size_t limit = CA_PBRT_MAX_TEXT - p->text_bytes;
    const ca_status status = ca_read_inflated(path, "scene", limit, bytes, &reason);
    if (status == CA_OK) p->text_bytes += bytes->size;
    if (status != CA_OK) ca_import_fail_file(p->importer, where, status, &reason);
    return status == CA_OK;
}

static void read_file(ca_pbrt *p, const char *name, const ca_location *where)
{
    ca_bytes bytes;
    if (p->include_depth == CA_PBRT_MAX_INCLUDE_DEPTH)
        ca_import_fail(p->importer, where, "includes are nested more than %d deep", CA_PBRT_MAX_INCLUDE_DEPTH);
    if (++p->include_count > CA_PBRT_MAX_INCLUDES)
        ca_import_fail(p->importer, where, "more than %d includes", CA_PBRT_MAX_INCLUDES);
    const char *path = ca_import_good(p->importer) ? ca_pbrt_file(p, name) : NULL;
    if (!path) return;
    const char *file = ca_document_add_file(&p->importer->document, path);
    if (!file) ca_import_fail_memory(p->importer, "a file name");
    if (!file || !load_bytes(p, path, where, &bytes)) return;
    p->include_depth++;
    read_text(p, file, (const char *)bytes.data, bytes.size);
    p->include_depth--;
    ca_bytes_destroy(&bytes);
}

/* ---- The scene ------------------------------------------------------------------------------------------------- */

static void read_scene(ca_pbrt *p, const char *text, size_t size)
{
    const ca_location start = {.file = p->importer->document.path};
    p->version = ca_pbrt_text_has_word(text, size, "WorldEnd") ? 3 : 4;
    p->film_width = p->version == 3 ? 640 : 1280;
    p->film_height = p->version == 3 ? 480 : 720;
    p->film_diagonal = 35.0;
    p->samples = 16;
    ca_tree_begin(&p->tree, p->importer);
    read_text(p, p->importer->document.path, text, size);
    ca_pbrt_end_curves(p);
    if (ca_import_good(p->importer) && p->saved.count > 0) {
        const ca_pbrt_saved *open = &p->saved.items[p->saved.count - 1];
        ca_import_fail(p->importer, &open->where, "%s has no end", open_names[open->kind]);
    }
    if (!p->in_world) ca_import_fail(p->importer, &start, "the scene has no WorldBegin");
    ca_tree_end(&p->tree);
}

static void destroy(ca_pbrt *p)
{
    ca_pbrt_params_destroy(&p->params);
    ca_free(p->saved.items);
    ca_free(p->arrays.items);
    ca_free(p->curves.points);
    ca_key_table_destroy(&p->files);
    ca_free(p->materials.items);
    ca_free(p->number_textures.items);
    ca_free(p->color_textures.items);
    ca_free(p->objects.items);
    ca_free(p->systems.items);
    ca_free(p);
}

void ca_read_pbrt(ca_importer *importer)
{
    const ca_scene_source *source = importer->source;
    const ca_location start = {.file = importer->document.path};
    ca_pbrt *p = ca_alloc_zeroed(1, sizeof *p);
    ca_bytes bytes = {0};
    if (!p) {
        ca_import_fail_memory(importer, "a scene");
        return;
    }
    p->importer = p->params.importer = importer;
    p->state.ctm = p->camera_to_world = ca_matrix_identity();
    p->state.start_is_active = true;
    p->exposure = 1.0;
    if (source->text)
        read_scene(p, source->text, source->size);
    else if (load_bytes(p, importer->document.path, &start, &bytes))
        read_scene(p, (const char *)bytes.data, bytes.size);
    ca_bytes_destroy(&bytes);
    destroy(p);
}
