/* Reading a scene of pbrt: the grammar of directives (directives.h has what each does), files and their includes, and
 * the whole. */
#include "import/pbrt/pbrt.h"

#include "base/text.h"
#include "import/inflate.h"
#include "import/pbrt/directives.h"

#include <stdio.h>
#include <string.h>

/* ---- One directive --------------------------------------------------------------------------------------------- */

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

static void run_directive(ca_pbrt *p, ca_pbrt_scan *scan, const ca_pbrt_directive *d)
{
    double numbers[CA_PBRT_MAX_NUMBERS] = {0.0};
    const char *strings[CA_PBRT_MAX_STRINGS] = {NULL};
    const bool wrong =
        (d->place == CA_PBRT_BEFORE_WORLD && p->in_world) || (d->place == CA_PBRT_IN_WORLD && !p->in_world);
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
    if (name[0]) ca_pbrt_fail_medium(p);
    if (!peek(p, scan, &token) || token.kind != CA_PBRT_STRING) return;
    if (next(p, scan, &token) && token.text[0]) ca_pbrt_fail_medium(p);
}

static void fail_directive(ca_pbrt *p, const ca_pbrt_token *token)
{
    char word[64] = "";
    const char *names[CA_PBRT_DIRECTIVE_COUNT + CA_COUNT(irregular)];
    for (size_t i = 0; i < CA_PBRT_DIRECTIVE_COUNT; i++) names[i] = ca_pbrt_directives[i].name;
    for (size_t i = 0; i < CA_COUNT(irregular); i++) names[CA_PBRT_DIRECTIVE_COUNT + i] = irregular[i];
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
    for (size_t i = 0; i < CA_PBRT_DIRECTIVE_COUNT; i++)
        if (ca_pbrt_is_word(token, ca_pbrt_directives[i].name)) {
            run_directive(p, scan, &ca_pbrt_directives[i]);
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

const char *ca_pbrt_file(ca_pbrt *p, const char *name)
{
    ca_document *document = &p->importer->document;
    const char *path = ca_document_resolve(document, document->path, name);
    if (!path) ca_import_fail_memory(p->importer, "a file name");
    return path;
}

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
        ca_import_fail(p->importer, &open->where, "%s has no end", ca_pbrt_open_names[open->kind]);
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
