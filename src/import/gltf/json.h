/* JSON in memory as a tree of values, each of which knows its place and its way from the root.
 *
 * Refused: what is no JSON (RFC 8259), text that is no UTF-8, strings with a zero, values nested more than
 * CA_GLTF_MAX_DEPTH deep, more values than CA_GLTF_MAX_VALUES. All memory is the arena's. */
#ifndef CA_IMPORT_GLTF_JSON_H
#define CA_IMPORT_GLTF_JSON_H

#include "base/memory.h"
#include "base/status.h"

enum { CA_GLTF_MAX_DEPTH = 64, CA_GLTF_MAX_VALUES = 4 << 20 };

typedef enum ca_gltf_kind {
    CA_GLTF_NULL,
    CA_GLTF_BOOLEAN,
    CA_GLTF_NUMBER,
    CA_GLTF_TEXT,
    CA_GLTF_ARRAY,
    CA_GLTF_OBJECT
} ca_gltf_kind;

typedef struct ca_gltf_value {
    ca_gltf_kind kind;
    uint32_t line, column;
    const struct ca_gltf_value *parent; /* NULL: the root */
    const char *key;                    /* of an object's member */
    uint32_t index;                     /* of an array's element */
    uint32_t count;                     /* of elements or members */
    double number;                      /* also 0 or 1 for a boolean */
    const char *text;
    struct ca_gltf_value *first, *next; /* elements or members */
    const struct ca_gltf_value **items; /* of an array, `count` of them */
} ca_gltf_value;

/* `file` is what messages say, and must live as long as they do. `has_places`: the text is a file of its own, so that
 * lines and columns help. */
ca_status ca_gltf_parse(const char *text, size_t size, const char *file, bool has_places, ca_arena *arena,
                        const ca_gltf_value **root, ca_error *error);

/* "materials[3].normalTexture"; "" for the root. What does not fit is left out. */
void ca_gltf_path(const ca_gltf_value *value, char *text, size_t size);

#endif
