#define _POSIX_C_SOURCE 200809L
#include "import/document.h"

#include "import/elements.h"
#include "base/hash.h"
#include "base/text.h"
#include "import/substitution.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* So that a few defaults that repeat each other cannot fill the memory. */
#define MAX_ARENA_BYTES ((size_t)1 << 30)

typedef struct expander {
    ca_document *document;
    ca_definitions definitions;
    ca_xml_budget budget;
    uint32_t include_depth, include_count;
    ca_error *error;
} expander;

void ca_document_add_content(ca_document *document, const void *bytes, size_t size)
{
    document->content_hash = ca_hash_bytes(ca_hash_add(document->content_hash, size), bytes, size);
}

const char *ca_document_add_file(ca_document *document, const char *path)
{
    const char *name = ca_arena_strdup(document->strings, path);
    if (!name || !CA_TABLE_ADD(&document->files)) return NULL;
    document->files.items[document->files.count - 1] = name;
    return name;
}

static ca_status read_tree(expander *x, const char *path, const char *text, size_t size, ca_xml_node **root)
{
    const char *file_name = ca_document_add_file(x->document, path);
    if (!file_name) return ca_fail_memory(x->error, path);
    if (text) ca_document_add_content(x->document, text, size);
    if (text) return ca_xml_parse(text, size, file_name, &x->document->arena, &x->budget, root, x->error);
    ca_bytes bytes;
    CA_TRY(ca_file_read(path, "scene", CA_XML_MAX_FILE_BYTES, &bytes, x->error));
    ca_document_add_content(x->document, bytes.data, bytes.size);
    const ca_status status = ca_xml_parse((const char *)bytes.data, bytes.size, file_name, &x->document->arena,
                                          &x->budget, root, x->error);
    ca_bytes_destroy(&bytes);
    return status;
}

/* ---- Directives ------------------------------------------------------------------------------------------------ */

static ca_status add_id(expander *x, const char *id, ca_xml_node *node)
{
    ca_document *d = x->document;
    ca_document_id *ids = ca_array_grow(d->ids, &d->id_capacity, d->id_count + 1, sizeof *ids);
    if (!ids) return ca_fail_memory(x->error, "the scene's ids");
    d->ids = ids;
    d->ids[d->id_count++] = (ca_document_id){.id = id, .node = node};
    return CA_OK;
}

static ca_status add_folder(expander *x, const ca_xml_node *node)
{
    ca_document *d = x->document;
    const char *value = ca_xml_attribute_value(node, "value");
    const char *folder = ca_document_resolve(d, node->where.file, value);
    const size_t size = folder ? strlen(folder) + 2 : 0;
    char *with_slash = folder ? ca_arena_alloc(&d->arena, size, 1) : NULL;
    const char **folders = ca_array_grow(d->folders, &d->folder_capacity, d->folder_count + 1, sizeof *folders);
    if (folders) d->folders = folders;
    if (!with_slash || !folders) return ca_fail_memory(x->error, "a path");
    struct stat info;
    if (stat(folder, &info) != 0 || !S_ISDIR(info.st_mode))
        return ca_fail(x->error, CA_ERROR_SCENE, &node->where, "<path>: there is no folder \"%s\"", folder);
    if (d->folder_count == 64) return ca_fail(x->error, CA_ERROR_SCENE, &node->where, "more than 64 paths");
    snprintf(with_slash, size, "%s/", folder);
    d->folders[d->folder_count++] = with_slash;
    return CA_OK;
}

static ca_status expand_children(expander *x, ca_xml_node *out, ca_xml_node *first, int depth);
static ca_status expand_element(expander *x, ca_xml_node *out, ca_xml_node *node, int depth);

/* An included <scene> gives its children, any other root itself. */
static ca_status include_file(expander *x, ca_xml_node *out, const ca_xml_node *node, int depth)
{
    const char *path = ca_document_resolve(x->document, node->where.file, ca_xml_attribute_value(node, "filename"));
    if (!path) return ca_fail_memory(x->error, "an include");
    if (x->include_depth == CA_DOCUMENT_MAX_INCLUDE_DEPTH)
        return ca_fail(x->error, CA_ERROR_SCENE, &node->where, "includes are nested more than %d deep",
                       CA_DOCUMENT_MAX_INCLUDE_DEPTH);
    if (++x->include_count > CA_DOCUMENT_MAX_INCLUDES)
        return ca_fail(x->error, CA_ERROR_SCENE, &node->where, "more than %d includes", CA_DOCUMENT_MAX_INCLUDES);
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode))
        return ca_fail(x->error, CA_ERROR_FILE, &node->where, "there is no file \"%s\" to include", path);
    ca_xml_node *root;
    CA_TRY(read_tree(x, path, NULL, 0, &root));
    x->include_depth++;
    if (strcmp(root->tag, "scene") == 0)
        CA_TRY(expand_children(x, out, root->first_child, depth));
    else
        CA_TRY(expand_element(x, out, root, depth));
    x->include_depth--;
    return CA_OK;
}

static ca_status follow_directive(expander *x, ca_xml_node *out, ca_xml_node *node, int depth)
{
    if (node->first_child)
        return ca_fail(x->error, CA_ERROR_SCENE, &node->first_child->where, "<%s> cannot stand inside <%s>",
                       node->first_child->tag, node->tag);
    switch (node->tag[0]) {
    case 'd': return ca_definitions_add_default(&x->definitions, node, x->error);
    case 'a': return add_id(x, ca_xml_attribute_value(node, "as"), node);
    case 'p': return add_folder(x, node);
    default: return include_file(x, out, node, depth);
    }
}

/* ---- The walk -------------------------------------------------------------------------------------------------- */

/* Appends the element to `out` (NULL: it is the root) with everything below it expanded. */
static ca_status expand_element(expander *x, ca_xml_node *out, ca_xml_node *node, int depth)
{
    ca_document *d = x->document;
    if (depth > CA_XML_MAX_DEPTH)
        return ca_fail(x->error, CA_ERROR_SCENE, &node->where, "elements are nested more than %d deep",
                       CA_XML_MAX_DEPTH);
    CA_TRY(ca_definitions_substitute(&x->definitions, node, &d->arena, x->error));
    if (!ca_element_upgrade(node, &d->arena)) return ca_fail_memory(x->error, "a parameter's name");
    if (d->arena.bytes > MAX_ARENA_BYTES)
        return ca_fail(x->error, CA_ERROR_SCENE, &node->where, "the scene's text is over the limit of %zu bytes",
                       MAX_ARENA_BYTES);
    ca_element_kind kind;
    CA_TRY(ca_element_check(node, out, &kind, x->error));
    if (kind == CA_ELEMENT_DIRECTIVE) return follow_directive(x, out, node, depth);
    const char *id = kind == CA_ELEMENT_OBJECT ? ca_xml_attribute_value(node, "id") : NULL;
    if (id) CA_TRY(add_id(x, id, node));
    if (out && out->last_child)
        out->last_child->next = node;
    else if (out)
        out->first_child = node;
    if (out) out->last_child = node;
    ca_xml_node *children = node->first_child;
    node->first_child = node->last_child = NULL;
    return expand_children(x, node, children, depth + 1);
}

static ca_status expand_children(expander *x, ca_xml_node *out, ca_xml_node *first, int depth)
{
    for (ca_xml_node *node = first; node;) {
        ca_xml_node *next = node->next;
        node->next = NULL;
        CA_TRY(expand_element(x, out, node, depth));
        node = next;
    }
    return CA_OK;
}

/* ---- Ids ------------------------------------------------------------------------------------------------------- */

/* By name, and equal names in reading order, so that the second one is the one to blame. */
static int compare_ids(const void *a, const void *b)
{
    const ca_document_id *x = a, *y = b;
    const int order = strcmp(x->id, y->id);
    if (order != 0) return order;
    const ca_location *u = &x->node->where, *v = &y->node->where;
    if (u->line != v->line) return u->line < v->line ? -1 : 1;
    return u->column < v->column ? -1 : u->column > v->column;
}

size_t ca_document_first_id(const ca_document *document, const char *start, size_t length)
{
    size_t low = 0, high = document->id_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (strncmp(document->ids[middle].id, start, length) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static ca_xml_node *find_direct(const ca_document *document, const char *id)
{
    const size_t at = ca_document_first_id(document, id, strlen(id) + 1);
    return at < document->id_count && strcmp(document->ids[at].id, id) == 0 ? document->ids[at].node : NULL;
}

ca_xml_node *ca_document_find(const ca_document *document, const char *id)
{
    ca_xml_node *node = find_direct(document, id);
    /* An alias of an alias; those that go round in a circle lead nowhere. */
    for (int step = 0; node && strcmp(node->tag, "alias") == 0; step++)
        node = step < 16 ? find_direct(document, ca_xml_attribute_value(node, "id")) : NULL;
    return node;
}

const char *ca_document_nearest_id(const ca_document *document, const char *id)
{
    const char *best = NULL;
    for (size_t i = 0; i < document->id_count; i++)
        best = ca_nearer_name(id, best, document->ids[i].id);
    return best;
}

static ca_status index_ids(expander *x)
{
    ca_document *d = x->document;
    if (d->id_count > 0) qsort(d->ids, d->id_count, sizeof *d->ids, compare_ids);
    for (size_t i = 1; i < d->id_count; i++) {
        if (strcmp(d->ids[i - 1].id, d->ids[i].id) != 0) continue;
        const ca_location *before = &d->ids[i - 1].node->where;
        return ca_fail(x->error, CA_ERROR_SCENE, &d->ids[i].node->where,
                       "the id \"%s\" is taken already, at %s:%u:%u", d->ids[i].id, before->file, before->line,
                       before->column);
    }
    for (size_t i = 0; i < d->id_count; i++) {
        if (strcmp(d->ids[i].node->tag, "alias") != 0 || ca_document_find(d, d->ids[i].id)) continue;
        const char *wrong = ca_xml_attribute_value(d->ids[i].node, "id");
        if (find_direct(d, wrong))
            return ca_fail(x->error, CA_ERROR_SCENE, &d->ids[i].node->where, "<alias>: \"%s\" leads to no object",
                           wrong);
        return ca_fail(x->error, CA_ERROR_SCENE, &d->ids[i].node->where,
                       "<alias>: there is no object with the id \"%s\"; the nearest id is \"%s\"", wrong,
                       ca_document_nearest_id(d, wrong));
    }
    return CA_OK;
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static const char *resolve_in(ca_document *document, const char *base, const char *name, bool *exists)
{
    *exists = false;
    char *path = ca_path_resolve(base, name);
    if (!path) return NULL;
    struct stat info;
    *exists = stat(path, &info) == 0;
    const char *copy = ca_arena_strdup(&document->arena, path);
    ca_free(path);
    return copy;
}

const char *ca_document_resolve(ca_document *document, const char *from_file, const char *name)
{
    bool exists;
    for (size_t i = document->folder_count; i-- > 0;) {
        const char *path = resolve_in(document, document->folders[i], name, &exists);
        if (!path || exists) return path;
    }
    const char *beside = resolve_in(document, from_file, name, &exists);
    if (!beside || exists || strcmp(from_file, document->path) == 0) return beside;
    const char *beside_scene = resolve_in(document, document->path, name, &exists);
    return !beside_scene || exists ? beside_scene : beside;
}

/* ---- Begin and end --------------------------------------------------------------------------------------------- */

static ca_status check_root(const expander *x, const ca_xml_node *root)
{
    if (strcmp(root->tag, "scene") != 0)
        return ca_fail(x->error, CA_ERROR_SCENE, &root->where, "the file begins with <%s>, not with <scene>",
                       root->tag);
    const char *version = ca_xml_attribute_value(root, "version");
    if (!version || (version[0] >= '0' && version[0] <= '3' && version[1] == '.')) return CA_OK;
    return ca_fail(x->error, CA_ERROR_SCENE, &root->where,
                   "version \"%s\" of the scene language is not known; 0.x to 3.x are", version);
}

static ca_status load(expander *x, const char *path, const char *text, size_t size)
{
    ca_xml_node *root;
    CA_TRY(read_tree(x, path, text, size, &root));
    x->document->path = root->where.file;
    CA_TRY(check_root(x, root));
    CA_TRY(expand_element(x, NULL, root, 1));
    CA_TRY(ca_definitions_check_known(&x->definitions, x->error));
    CA_TRY(index_ids(x));
    x->document->root = root;
    return CA_OK;
}

/* Definitions in any order. */
static uint64_t definitions_hash(const ca_define *defines, size_t count)
{
    uint64_t sum = CA_HASH_START;
    for (size_t i = 0; i < count; i++) {
        const uint64_t name = ca_hash_bytes(CA_HASH_START, defines[i].name, strlen(defines[i].name));
        sum += ca_hash_bytes(name, defines[i].value, strlen(defines[i].value));
    }
    return sum;
}

ca_status ca_document_load(ca_document *document, const char *path, const char *text, size_t size,
                           const ca_define *defines, size_t define_count, ca_arena *strings, ca_error *error)
{
    *document = (ca_document){.content_hash = definitions_hash(defines, define_count), .strings = strings};
    expander *x = ca_alloc_zeroed(1, sizeof *x);
    if (!x) return ca_fail_memory(error, path);
    x->document = document;
    x->budget = (ca_xml_budget){.bytes = CA_XML_MAX_TOTAL_BYTES, .elements = CA_XML_MAX_ELEMENTS};
    x->error = error;
    ca_status status = ca_definitions_start(&x->definitions, defines, define_count, error);
    if (status == CA_OK) status = load(x, path, text, size);
    ca_free(x);
    if (status != CA_OK) ca_document_destroy(document);
    return status;
}

/* ---- Trees of other formats ------------------------------------------------------------------------------------ */

ca_status ca_document_start(ca_document *document, const char *path, const ca_define *defines, size_t define_count,
                            ca_arena *strings, ca_error *error)
{
    *document = (ca_document){.content_hash = definitions_hash(defines, define_count), .strings = strings};
    if (define_count > 0)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "-D %s=%s: a scene of this format has no defaults",
                       defines[0].name, defines[0].value);
    document->path = ca_document_add_file(document, path);
    return document->path ? CA_OK : ca_fail_memory(error, path);
}

/* Checks the element and those in it, and notes their ids. */
static ca_status check_tree(expander *x, ca_xml_node *node, const ca_xml_node *parent, int depth)
{
    ca_element_kind kind;
    if (depth > CA_XML_MAX_DEPTH)
        return ca_fail(x->error, CA_ERROR_SCENE, &node->where, "elements are nested more than %d deep",
                       CA_XML_MAX_DEPTH);
    CA_TRY(ca_element_check(node, parent, &kind, x->error));
    const char *id = kind == CA_ELEMENT_OBJECT ? ca_xml_attribute_value(node, "id") : NULL;
    if (id) CA_TRY(add_id(x, id, node));
    for (ca_xml_node *child = node->first_child; child; child = child->next)
        CA_TRY(check_tree(x, child, node, depth + 1));
    return CA_OK;
}

ca_status ca_document_finish(ca_document *document, ca_error *error)
{
    expander *x = ca_alloc_zeroed(1, sizeof *x);
    if (!x) return ca_fail_memory(error, document->path);
    x->document = document;
    x->error = error;
    ca_status status = check_tree(x, document->root, NULL, 1);
    if (status == CA_OK) status = index_ids(x);
    ca_free(x);
    return status;
}

void ca_document_destroy(ca_document *document)
{
    ca_arena_clear(&document->arena);
    ca_free(document->files.items);
    ca_free(document->ids);
    ca_free(document->folders);
    *document = (ca_document){0};
}
