/* The importer of Mitsuba's XML scenes, and of trees that readers of other formats make: entry points, failures, and
 * the objects of <scene>. */
#define _POSIX_C_SOURCE 200809L
#include "import/importer.h"

#include "base/hash.h"
#include "base/loading.h"
#include "base/text.h"
#include "import/gltf/gltf.h"
#include "import/pbrt/pbrt.h"
#include "import/reuse.h"
#include "import/shared_meshes.h"

#include <stdio.h>
#include <math.h>
#include <string.h>
#include <strings.h>

/* ---- Failures -------------------------------------------------------------------------------------------------- */

void ca_import_fail(ca_importer *importer, const ca_location *where, const char *format, ...)
{
    if (importer->status != CA_OK) return;
    char message[sizeof((ca_error *)0)->message];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    importer->status = ca_fail(importer->error, CA_ERROR_SCENE, where, "%s", message);
}

/* Where only the budget is used up, the object that did it is told. */
void ca_import_fail_memory(ca_importer *importer, const char *what)
{
    ca_error reason = {""};
    if (importer->status != CA_OK) return;
    const bool tells_place = ca_memory_budget_exceeded() && importer->entered;
    importer->status = ca_fail_memory(&reason, what);
    ca_fail(importer->error, importer->status, tells_place ? &importer->entered->where : NULL, "%s", reason.message);
}

void ca_import_fail_file(ca_importer *importer, const ca_location *where, ca_status status, const ca_error *reason)
{
    const bool lacks_memory = status == CA_ERROR_MEMORY && !ca_memory_budget_exceeded();
    const bool is_innocent = lacks_memory || status == CA_ERROR_INTERRUPTED;
    if (importer->status == CA_OK)
        importer->status = ca_fail(importer->error, status, is_innocent ? NULL : where, "%s", reason->message);
}

/* More would be read by nobody. */
enum { MOST_NOTES = 1000 };

/* Was the sentence said, wherever that was? */
static bool is_noted(const ca_scene_desc *desc, const char *sentence)
{
    const size_t length = strlen(sentence);
    for (size_t i = 0; i < desc->notes.count; i++) {
        const size_t whole = strlen(desc->notes.items[i]);
        if (whole >= length && strcmp(desc->notes.items[i] + whole - length, sentence) == 0) return true;
    }
    return false;
}

void ca_import_note(ca_importer *importer, const ca_location *where, const char *format, ...)
{
    if (importer->status != CA_OK) return;
    ca_scene_desc *desc = importer->desc;
    char sentence[sizeof((ca_error *)0)->message];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    if (desc->notes.count >= MOST_NOTES || is_noted(desc, sentence)) return;
    ca_error placed;
    (void)ca_fail(&placed, CA_ERROR_SCENE, where, "%s", sentence); /* it knows how a place is written */
    const char *kept = ca_arena_strdup(&desc->strings, placed.message);
    if (kept && CA_TABLE_ADD(&desc->notes))
        desc->notes.items[desc->notes.count - 1] = kept;
    else
        ca_import_fail_memory(importer, "notes");
}

/* ---- Plugins and objects --------------------------------------------------------------------------------------- */

/* Plugins of Mitsuba that are known, and not supported: told apart from typing errors. */
typedef struct unsupported_plugin {
    const char *tag, *name, *reason;
} unsupported_plugin;

static const unsupported_plugin unsupported[] = {
    {"bsdf", "measured", "tables of measured reflectance are not supported"},
    {"bsdf", "measured_polarized", "polarised light is not supported"},
    {"bsdf", "pplastic", "polarised light is not supported"},
    {"bsdf", "polarizer", "polarised light is not supported"},
    {"bsdf", "retarder", "polarised light is not supported"},
    {"bsdf", "circular", "polarised light is not supported"},
    {"bsdf", "hair", "hair is not supported"},
    {"bsdf", "hk", "scattering in layers is not supported"},
    {"bsdf", "irawan", "woven cloth is not supported"},
    {"shape", "hair", "hair is not supported; bsplinecurve and linearcurve are curves"},
    {"shape", "ellipsoids", "sets of ellipsoids are not supported"},
    {"shape", "ellipsoidsmesh", "sets of ellipsoids are not supported"},
    {"emitter", "sunsky", "the sky model is not supported; envmap takes a picture of a sky"},
    {"emitter", "sun", "the sky model is not supported; directional is a sun without size"},
    {"emitter", "sky", "the sky model is not supported; envmap takes a picture of a sky"},
    {"emitter", "timed_sunsky", "the sky model is not supported; envmap takes a picture of a sky"},
    {"emitter", "ies", "tables of luminous intensity are not read; a projector throws a picture of it"},
    {"emitter", "goniometric", "tables of luminous intensity are not read; a projector throws a picture of it"},
    {"emitter", "volumelight", "there are no media"},
    {"sensor", "irradiancemeter", "sensors on shapes are not supported"},
    {"sensor", "spherical", "spherical pictures are not supported"},
    {"film", "specfilm", "spectral films are not supported"},
    {"texture", "volume", "volumes are not supported"},
    {"texture", "gridtexture", "grids of lines are not supported"},
    {"texture", "wireframe", "wire frames are not supported"},
    {"texture", "curvature", "curvatures are not supported"},
};

static bool fail_unsupported(ca_importer *importer, const ca_xml_node *node, const char *type)
{
    for (size_t i = 0; i < CA_COUNT(unsupported); i++) {
        if (strcmp(unsupported[i].tag, node->tag) != 0 || strcmp(unsupported[i].name, type) != 0) continue;
        ca_import_fail(importer, &node->where, "%s \"%s\": %s", node->tag, type, unsupported[i].reason);
        return true;
    }
    return false;
}

const ca_plugin *ca_import_find_plugin(ca_importer *importer, const ca_xml_node *node, const ca_plugin *table,
                                       size_t count)
{
    const char *type = ca_xml_attribute_value(node, "type");
    for (size_t i = 0; i < count; i++)
        if (strcmp(table[i].name, type) == 0) return &table[i];
    if (fail_unsupported(importer, node, type)) return NULL;
    const char *nearest = NULL;
    for (size_t i = 0; i < count; i++)
        nearest = ca_nearer_name(type, nearest, table[i].name);
    ca_import_fail(importer, &node->where, "unknown %s \"%s\"; the nearest known one is \"%s\"", node->tag, type,
                   nearest);
    return NULL;
}

bool ca_import_enter(ca_importer *importer, ca_xml_node *node)
{
    if (node->progress == CA_NODE_BEGUN)
        ca_import_fail(importer, &node->where, "this <%s> refers to itself", node->tag);
    else if (importer->nesting == CA_IMPORT_MAX_NESTING)
        ca_import_fail(importer, &node->where, "objects are nested more than %d deep", CA_IMPORT_MAX_NESTING);
    if (!ca_import_good(importer)) return false;
    node->progress = CA_NODE_BEGUN;
    importer->nesting++;
    return true;
}

void ca_import_leave(ca_importer *importer, ca_xml_node *node, uint32_t result)
{
    node->progress = CA_NODE_DONE;
    node->result = result;
    importer->nesting--;
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

const char *ca_import_filename(ca_props *props, const char *name)
{
    ca_importer *importer = props->importer;
    const char *value = ca_props_string(props, name, NULL);
    if (!value || !*value) {
        ca_props_fail(props, name, "must name a file");
        return NULL;
    }
    const char *path = ca_document_resolve(&importer->document, props->node->where.file, value);
    if (path) path = ca_document_add_file(&importer->document, path);
    if (!path) ca_import_fail_memory(importer, "a file name");
    return ca_import_good(importer) ? path : NULL;
}

/* ---- Images ---------------------------------------------------------------------------------------------------- */

static size_t numbers_of(const ca_image *image)
{
    return (size_t)image->width * image->height * image->channels;
}

static ca_status check_finite(const ca_image *image, const char *path, ca_error *reason)
{
    const size_t row = (size_t)image->width * image->channels;
    for (size_t i = 0; i < numbers_of(image); i++)
        if (!isfinite(image->data[i]))
            return ca_fail(reason, CA_ERROR_SCENE, NULL, "%s: the pixel (%zu, %zu) is not a finite number", path,
                           i % row / image->channels, i / row);
    return CA_OK;
}

/* What the previous version has read is not read again. */
static ca_status read_image_file(ca_importer *importer, const ca_import_image *key, ca_image *image, ca_error *reason)
{
    const uint64_t file = ca_reuse_file(key->path);
    const uint64_t made_of = file ? ca_hash_add(file, (uint64_t)key->encoding) | 1 : 0;
    if (made_of && ca_reuse_image(importer, made_of, image)) return CA_OK;
    CA_TRY(ca_image_read(key->path, key->encoding, image, reason));
    image->made_of = made_of;
    const ca_status status = check_finite(image, key->path, reason);
    if (status != CA_OK) ca_image_destroy(image);
    return status;
}

static uint32_t read_image(ca_importer *importer, const ca_import_image *key, const ca_location *where)
{
    ca_image image;
    ca_error reason;
    const ca_status status = key->array ? ca_import_bitmap_data(importer, key->path, &image, &reason)
                                        : read_image_file(importer, key, &image, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(importer, where, status, &reason);
        return CA_NONE;
    }
    if (!CA_TABLE_ADD(&importer->desc->images)) {
        ca_image_destroy(&image);
        ca_import_fail_memory(importer, "images");
        return CA_NONE;
    }
    const uint32_t index = (uint32_t)(importer->desc->images.count - 1);
    importer->desc->images.items[index] = image;
    return index;
}

static bool is_same_image(const ca_import_image *a, const ca_import_image *b)
{
    return a->encoding == b->encoding && a->array == b->array && a->cut == b->cut && strcmp(a->path, b->path) == 0;
}

static uint32_t remember_image(ca_importer *importer, const ca_import_image *key, uint32_t index)
{
    if (!CA_TABLE_ADD(&importer->images)) {
        ca_import_fail_memory(importer, "images");
        return CA_NONE;
    }
    ca_import_image *image = &importer->images.items[importer->images.count - 1];
    *image = *key;
    image->index = index;
    image->uses = 1;
    return index;
}

static uint32_t image_of(ca_importer *importer, const ca_import_image *key, const ca_location *where)
{
    for (size_t i = 0; i < importer->images.count; i++) {
        ca_import_image *there = &importer->images.items[i];
        if (!is_same_image(there, key)) continue;
        there->uses++;
        return there->index;
    }
    const uint32_t index = read_image(importer, key, where);
    return index == CA_NONE ? CA_NONE : remember_image(importer, key, index);
}

uint32_t ca_import_picture(ca_props *props, ca_image_encoding encoding)
{
    const char *name = ca_props_string(props, "data", NULL);
    if (name && ca_props_find(props, "filename")) ca_props_fail(props, "filename", "excludes data");
    const ca_import_image key = {
        .path = name ? name : ca_import_filename(props, "filename"), .array = name, .encoding = encoding};
    if (!key.path || !ca_import_good(props->importer)) return CA_NONE;
    return image_of(props->importer, &key, &props->node->where);
}

static ca_import_image *known_image(const ca_importer *importer, uint32_t index)
{
    for (size_t i = 0; i < importer->images.count; i++)
        if (importer->images.items[i].index == index) return &importer->images.items[i];
    return NULL;
}

/* A copy: other scenes may share the pixels. */
static bool make_cut(ca_importer *importer, const ca_image *image, ca_image *cut)
{
    if (ca_image_create(cut, image->width, image->height, image->channels, NULL) != CA_OK) {
        ca_import_fail_memory(importer, "images");
        return false;
    }
    for (size_t i = 0; i < numbers_of(image); i++) cut->data[i] = fmaxf(image->data[i], 0.0f);
    cut->content_hash = image->content_hash;
    return true;
}

static uint32_t add_cut(ca_importer *importer, const ca_import_image *of)
{
    ca_import_image key = *of;
    ca_image cut;
    key.cut = true;
    for (size_t i = 0; i < importer->images.count; i++)
        if (is_same_image(&importer->images.items[i], &key)) return importer->images.items[i].index;
    if (!make_cut(importer, &importer->desc->images.items[of->index], &cut)) return CA_NONE;
    if (!CA_TABLE_ADD(&importer->desc->images)) {
        ca_image_destroy(&cut);
        ca_import_fail_memory(importer, "images");
        return CA_NONE;
    }
    const uint32_t index = (uint32_t)(importer->desc->images.count - 1);
    importer->desc->images.items[index] = cut;
    return remember_image(importer, &key, index);
}

static bool replace_by_cut(ca_importer *importer, ca_import_image *known)
{
    ca_image *image = &importer->desc->images.items[known->index], cut;
    if (!make_cut(importer, image, &cut)) return false;
    ca_image_destroy(image);
    *image = cut;
    known->cut = true;
    return true;
}

uint32_t ca_import_without_negative(ca_importer *importer, uint32_t index, bool alone, const ca_location *where)
{
    const ca_image *image = &importer->desc->images.items[index];
    ca_import_image *known = known_image(importer, index);
    size_t negative = 0;
    for (size_t i = 0; i < numbers_of(image); i++) negative += image->data[i] < 0.0f;
    if (negative == 0 || !known) return index;
    ca_import_note(importer, where, "no colour is negative: %zu %s of %s taken as 0", negative,
                   ca_noun((double)negative, "number", "numbers"), known->path);
    if (!alone || known->uses > 1) return add_cut(importer, known);
    return replace_by_cut(importer, known) ? index : CA_NONE;
}

/* ---- The scene ------------------------------------------------------------------------------------------------- */

static void import_once(ca_importer *importer, ca_xml_node *node, void (*import)(ca_importer *, ca_xml_node *),
                        ca_xml_node **first)
{
    if (*first)
        ca_import_fail(importer, &node->where, "a second <%s>; the first is at line %u", node->tag,
                       (*first)->where.line);
    else
        import(importer, node);
    *first = node;
}

/* Is it the sensor that was asked for? Counts it. */
static bool is_wanted(ca_importer *importer, const ca_xml_node *node)
{
    const char *wanted = importer->source->camera, *id = ca_xml_attribute_value(node, "id");
    const uint32_t index = importer->sensor_count++;
    if (!wanted) return index == importer->sensor;
    if (importer->has_camera || !id || strcmp(id, wanted) != 0) return false;
    importer->has_camera = true;
    return true;
}

/* Every sensor is imported, for a mistake in it is a mistake; the chosen one's view stays. */
static void import_view(ca_importer *importer, ca_xml_node *node)
{
    const ca_import_view kept = ca_import_keep_view(importer->desc);
    ca_import_sensor(importer, node);
    importer->desc->camera.sensor = importer->sensor_count;
    if (!is_wanted(importer, node)) ca_import_put_back_view(importer->desc, &kept);
}

/* A part of sensors that has an id: it waits for sensors to refer to it. */
static bool import_part_of_view(ca_importer *importer, ca_xml_node *node)
{
    static const struct {
        const char *tag;
        void (*import)(ca_importer *, ca_xml_node *);
    } parts[] = {{"film", ca_import_film}, {"rfilter", ca_import_filter}, {"sampler", ca_import_sampler}};
    for (size_t i = 0; i < CA_COUNT(parts); i++) {
        if (strcmp(node->tag, parts[i].tag) != 0 || !ca_xml_attribute_value(node, "id")) continue;
        const ca_import_view kept = ca_import_keep_view(importer->desc);
        parts[i].import(importer, node);
        ca_import_put_back_view(importer->desc, &kept);
        return true;
    }
    return false;
}

/* Objects that only wait to be referenced are imported too: a mistake in them is a mistake. */
static void import_object(ca_importer *importer, ca_xml_node *node, ca_xml_node **integrator)
{
    const char *tag = node->tag;
    if (strcmp(tag, "shape") == 0) {
        ca_import_shape(importer, node);
    } else if (strcmp(tag, "bsdf") == 0) {
        ca_import_bsdf(importer, node);
    } else if (strcmp(tag, "texture") == 0) {
        ca_import_texture(importer, node);
    } else if (strcmp(tag, "emitter") == 0) {
        ca_import_light(importer, node);
    } else if (strcmp(tag, "sensor") == 0) {
        import_view(importer, node);
    } else if (strcmp(tag, "integrator") == 0) {
        import_once(importer, node, ca_import_integrator, integrator);
    } else if (!import_part_of_view(importer, node)) {
        ca_import_fail(importer, &node->where, "<%s> has no meaning directly inside <scene>", tag);
    }
}

static void import_scene(ca_importer *importer)
{
    ca_xml_node *scene = importer->document.root, *integrator = NULL;
    size_t objects = 0, done = 0;
    for (const ca_xml_node *node = scene->first_child; node; node = node->next) objects++;
    for (ca_xml_node *node = scene->first_child; node && ca_import_good(importer); node = node->next) {
        ca_loading_step("reading", done++, objects);
        importer->status = ca_loading_check(importer->error);
        if (ca_import_good(importer)) import_object(importer, node, &integrator);
    }
    for (const ca_xml_node *node = scene->first_child; node && ca_import_good(importer); node = node->next)
        ca_import_note_idle_emitter(importer, node);
    ca_import_note_missing_attributes(importer);
    ca_import_settle_attributes(importer);
    const uint32_t count = importer->sensor_count;
    if (count == 0) ca_import_fail(importer, &scene->where, "the scene has no <sensor>");
    const char *camera = importer->source->camera;
    if (count > 1 && importer->sensor == 0 && !camera)
        ca_import_note(importer, &scene->where,
                       "of several sensors the first is used, or the one of --sensor or --camera");
    if (ca_import_good(importer) && camera && !importer->has_camera) {
        const char *nearest = ca_document_nearest_id(&importer->document, camera);
        importer->status =
            ca_fail(importer->error, CA_ERROR_ARGUMENT, NULL, "there is no sensor \"%s\"%s%s%s", camera,
                    nearest ? "; the nearest id is \"" : "", nearest ? nearest : "", nearest ? "\"" : "");
    }
    if (ca_import_good(importer) && importer->sensor >= count)
        importer->status = ca_fail(importer->error, CA_ERROR_ARGUMENT, NULL,
                                   "there is no sensor %u: the scene has %u, counted from 0", importer->sensor,
                                   count);
}

/* Of all files: the texts, then images and meshes in the order in which the scene names them. */
static uint64_t content_hash(const ca_importer *importer)
{
    const ca_scene_desc *desc = importer->desc;
    uint64_t hash = importer->document.content_hash;
    for (size_t i = 0; i < desc->images.count; i++) hash = ca_hash_add(hash, desc->images.items[i].content_hash);
    for (size_t i = 0; i < desc->meshes.count; i++) hash = ca_hash_add(hash, desc->meshes.items[i].content_hash);
    for (size_t i = 0; i < desc->curves.count; i++) hash = ca_hash_add(hash, desc->curves.items[i]->content_hash);
    for (size_t i = 0; i < desc->grids.count; i++) hash = ca_hash_add(hash, desc->grids.items[i]->content_hash);
    return hash;
}

/* The last step of all: the description gets what the document knows. */
static void finish_description(ca_importer *importer)
{
    importer->desc->content_hash = content_hash(importer);
    importer->desc->files = importer->document.files;
    importer->document.files = (ca_path_table){0};
}

/* ---- Formats --------------------------------------------------------------------------------------------------- */

/* Formats other than XML, told by the extension of the file's name. */
typedef struct scene_format {
    const char *extension;
    void (*read)(ca_importer *importer); /* makes the document's tree by tree_build.h */
} scene_format;

static const scene_format formats[] = {{".pbrt", ca_read_pbrt}, {".gltf", ca_read_gltf}, {".glb", ca_read_gltf}};

/* NULL: XML, which a text in memory that begins with an element is in any case. */
static const scene_format *find_format(const ca_scene_source *source)
{
    for (size_t i = 0; source->text && i < source->size; i++) {
        if (source->text[i] == '<') return NULL;
        if (!strchr(" \t\r\n", source->text[i])) break;
    }
    const char *extension = ca_path_extension(source->path);
    for (size_t i = 0; i < CA_COUNT(formats); i++)
        if (strcasecmp(extension, formats[i].extension) == 0) return &formats[i];
    return NULL;
}

static ca_status load_document(ca_importer *importer)
{
    const ca_scene_source *source = importer->source;
    const scene_format *format = find_format(source);
    importer->is_text = !format;
    if (!format)
        return ca_document_load(&importer->document, source->path, source->text, source->size, source->defines,
                                source->define_count, &importer->desc->strings, importer->error);
    CA_TRY(ca_document_start(&importer->document, source->path, source->defines, source->define_count,
                             &importer->desc->strings, importer->error));
    format->read(importer);
    return importer->status;
}

/* ---- The whole ------------------------------------------------------------------------------------------------- */

static ca_status read_all(ca_importer *importer)
{
    ca_loading_step("reading", 0, 0);
    CA_TRY(ca_import_begin_lending(importer));
    CA_TRY(load_document(importer));
    importer->desc->path = importer->document.path;
    import_scene(importer);
    return importer->status;
}

/* Files of strangers may be small and take much: nested includes, pictures of one colour. A scene that is worth it
 * has files in proportion: 50 million triangles take 7 bytes of memory for each byte of a binary PLY file. */
static ca_status read_within_budget(ca_importer *importer)
{
    enum { BYTES_PER_BYTE = 64 };
    const ca_scene_source *source = importer->source;
    const double mib = source->memory_mib > 0.0 ? source->memory_mib : CA_SCENE_MEMORY_MIB;
    ca_memory_budget budget = {
        .limit = mib < 0x1p43 ? (size_t)(mib * 0x1p20) : SIZE_MAX,
        .per_byte = BYTES_PER_BYTE,
        .way = "CAUSTICA_SCENE_MEMORY=MIB in the environment (of the library, memory_mib of the source) allows more",
    };
    ca_memory_budget_begin(&budget);
    ca_memory_budget_read(0, source->text ? source->size : 0);
    const ca_status status = read_all(importer);
    ca_memory_budget_end();
    return status;
}

ca_status ca_import_scene_then(const ca_scene_source *source, ca_import_then then, void *user, ca_scene_desc *desc,
                               ca_error *error)
{
    ca_scene_desc_init(desc);
    ca_importer importer = {
        .source = source, .desc = desc, .error = error, .status = CA_OK, .sensor = source->sensor};
    ca_status status = read_within_budget(&importer);
    if (status == CA_OK && then) then(&importer, user);
    if (status == CA_OK) status = importer.status;
    if (status == CA_OK) finish_description(&importer);
    ca_free(importer.images.items);
    ca_free(importer.attributes.items);
    ca_free(importer.guards.items);
    ca_free(importer.texture_sizes.items);
    ca_free(importer.material_sizes.items);
    ca_shared_meshes_destroy(&importer.shared);
    ca_import_end_lending(&importer);
    ca_document_destroy(&importer.document);
    ca_import_arrays_destroy(&importer.arrays);
    if (status != CA_OK) ca_scene_desc_destroy(desc);
    return status;
}

ca_status ca_import_scene_source(const ca_scene_source *source, ca_scene_desc *desc, ca_error *error)
{
    return ca_import_scene_then(source, NULL, NULL, desc, error);
}

ca_status ca_import_scene_text(const char *text, size_t size, const char *path, const ca_define *defines,
                               size_t define_count, ca_scene_desc *desc, ca_error *error)
{
    const ca_scene_source source = {
        .text = text, .size = size, .path = path, .defines = defines, .define_count = define_count};
    return ca_import_scene_source(&source, desc, error);
}

ca_status ca_import_scene(const char *path, const ca_define *defines, size_t define_count, ca_scene_desc *desc,
                          ca_error *error)
{
    return ca_import_scene_text(NULL, 0, path, defines, define_count, desc, error);
}
