#include "import/xml_tree.h"

#include "base/loading.h"

#include <expat.h>
#include <string.h>

/* Expat asks for memory in the manner of malloc, ca_alloc has no realloc: each block remembers its size in front. */
typedef struct block_header {
    _Alignas(16) size_t size;
} block_header;

static void *expat_alloc(size_t size)
{
    if (size > SIZE_MAX - sizeof(block_header)) return NULL;
    block_header *block = ca_alloc(1, sizeof *block + size);
    if (!block) return NULL;
    block->size = size;
    return block + 1;
}

static void expat_free(void *memory)
{
    if (memory) ca_free((block_header *)memory - 1);
}

static void *expat_realloc(void *memory, size_t size)
{
    void *moved = expat_alloc(size);
    if (!moved || !memory) return moved;
    const size_t old_size = ((block_header *)memory - 1)->size;
    memcpy(moved, memory, old_size < size ? old_size : size);
    expat_free(memory);
    return moved;
}

typedef struct reader {
    XML_Parser parser;
    const char *file_name;
    ca_arena *arena;
    ca_xml_budget *budget;
    ca_xml_node *root;
    ca_xml_node *open[CA_XML_MAX_DEPTH];
    int depth;
    ca_error *error;
    ca_status status;
} reader;

static ca_location location(const reader *r)
{
    return (ca_location){.file = r->file_name,
                         .line = (uint32_t)XML_GetCurrentLineNumber(r->parser),
                         .column = (uint32_t)XML_GetCurrentColumnNumber(r->parser) + 1};
}

/* Expat may still call handlers after it was stopped: the first failure is the one that counts. */
static void stop(reader *r, ca_status status, const char *message)
{
    if (r->status != CA_OK) return;
    const ca_location where = location(r);
    r->status = ca_fail(r->error, status, &where, "%s", message);
    XML_StopParser(r->parser, XML_FALSE);
}

static bool copy_attributes(reader *r, ca_xml_node *node, const XML_Char **pairs)
{
    while (pairs[2 * (size_t)node->attribute_count]) node->attribute_count++;
    node->attributes = ca_arena_alloc(r->arena, node->attribute_count, sizeof *node->attributes);
    if (!node->attributes) return false;
    for (size_t i = 0; i < node->attribute_count; i++) {
        node->attributes[i].name = ca_arena_strdup(r->arena, pairs[2 * i]);
        node->attributes[i].value = ca_arena_strdup(r->arena, pairs[2 * i + 1]);
        if (!node->attributes[i].name || !node->attributes[i].value) return false;
    }
    return true;
}

static void append_child(ca_xml_node *parent, ca_xml_node *child)
{
    if (parent->last_child)
        parent->last_child->next = child;
    else
        parent->first_child = child;
    parent->last_child = child;
}

static void on_start(void *data, const XML_Char *tag, const XML_Char **pairs)
{
    reader *r = data;
    if (r->status != CA_OK) return;
    if (r->depth == CA_XML_MAX_DEPTH) {
        stop(r, CA_ERROR_FORMAT, "elements are nested more than 64 deep");
        return;
    }
    if (r->budget->elements == 0) {
        stop(r, CA_ERROR_FORMAT, "the scene has too many elements");
        return;
    }
    r->budget->elements--;
    if (r->budget->elements % 4096 == 0) r->status = ca_loading_check(r->error);
    if (r->status != CA_OK) {
        XML_StopParser(r->parser, XML_FALSE);
        return;
    }
    ca_xml_node *node = ca_arena_alloc(r->arena, 1, sizeof *node);
    if (node) {
        node->tag = ca_arena_strdup(r->arena, tag);
        node->where = location(r);
    }
    if (!node || !node->tag || !copy_attributes(r, node, pairs)) {
        stop(r, CA_ERROR_MEMORY, "out of memory: the scene's elements");
        return;
    }
    if (r->depth > 0)
        append_child(r->open[r->depth - 1], node);
    else
        r->root = node;
    r->open[r->depth++] = node;
}

static void on_end(void *data, const XML_Char *tag)
{
    reader *r = data;
    (void)tag;
    if (r->status == CA_OK) r->depth--;
}

static void on_text(void *data, const XML_Char *text, int length)
{
    reader *r = data;
    for (int i = 0; i < length; i++)
        if (!strchr(" \t\r\n", text[i]) || text[i] == '\0') {
            stop(r, CA_ERROR_FORMAT, "text between elements; values belong in attributes");
            return;
        }
}

static void on_doctype(void *data, const XML_Char *name, const XML_Char *system_id, const XML_Char *public_id,
                       int has_internal_subset)
{
    (void)name, (void)system_id, (void)public_id, (void)has_internal_subset;
    stop(data, CA_ERROR_FORMAT, "a document type declaration, which scene files cannot have");
}

static void on_instruction(void *data, const XML_Char *target, const XML_Char *text)
{
    (void)target, (void)text;
    stop(data, CA_ERROR_FORMAT, "a processing instruction, which scene files cannot have");
}

static ca_status run(reader *r, const char *text, size_t size)
{
    XML_SetUserData(r->parser, r);
    XML_SetElementHandler(r->parser, on_start, on_end);
    XML_SetCharacterDataHandler(r->parser, on_text);
    XML_SetStartDoctypeDeclHandler(r->parser, on_doctype);
    XML_SetProcessingInstructionHandler(r->parser, on_instruction);
    if (XML_Parse(r->parser, text, (int)size, XML_TRUE) == XML_STATUS_OK && r->status == CA_OK) return CA_OK;
    if (r->status != CA_OK) return r->status;
    const enum XML_Error code = XML_GetErrorCode(r->parser);
    if (code == XML_ERROR_NO_MEMORY) return ca_fail_memory(r->error, "reading XML");
    const ca_location where = location(r);
    return ca_fail(r->error, CA_ERROR_FORMAT, &where, "not well-formed XML: %s", XML_ErrorString(code));
}

ca_status ca_xml_parse(const char *text, size_t size, const char *file_name, ca_arena *arena, ca_xml_budget *budget,
                       ca_xml_node **root, ca_error *error)
{
    *root = NULL;
    const ca_location where = {.file = file_name};
    if (size > CA_XML_MAX_FILE_BYTES)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "a scene file of %zu bytes is over the limit of %d", size,
                       CA_XML_MAX_FILE_BYTES);
    if (size > budget->bytes)
        return ca_fail(error, CA_ERROR_FORMAT, &where,
                       "all files of the scene together are over the limit of %d bytes", CA_XML_MAX_TOTAL_BYTES);
    budget->bytes -= size;
    const XML_Memory_Handling_Suite memory = {expat_alloc, expat_realloc, expat_free};
    reader r = {.file_name = file_name, .arena = arena, .budget = budget, .error = error, .status = CA_OK};
    r.parser = XML_ParserCreate_MM(NULL, &memory, NULL);
    if (!r.parser) return ca_fail_memory(error, "reading XML");
    const ca_status status = run(&r, text, size);
    XML_ParserFree(r.parser);
    if (status == CA_OK) *root = r.root;
    return status;
}

const char *ca_xml_attribute_value(const ca_xml_node *node, const char *name)
{
    for (uint32_t i = 0; i < node->attribute_count; i++)
        if (strcmp(node->attributes[i].name, name) == 0) return node->attributes[i].value;
    return NULL;
}
