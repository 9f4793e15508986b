/* What the header of a PLY file says, shared by ply.c (reading elements) and ply_header.c.
 *
 * A file is a list of elements ("vertex", "face"), each a table whose columns are properties: numbers, or lists of
 * numbers. Columns come in any order and of any type. */
#ifndef CA_IMPORT_PLY_H
#define CA_IMPORT_PLY_H

#include "base/memory.h"
#include "base/status.h"
#include "import/text_scan.h"

typedef enum ca_ply_type {
    CA_PLY_INT8,
    CA_PLY_UINT8,
    CA_PLY_INT16,
    CA_PLY_UINT16,
    CA_PLY_INT32,
    CA_PLY_UINT32,
    CA_PLY_FLOAT32,
    CA_PLY_FLOAT64,
} ca_ply_type;

typedef enum ca_ply_format { CA_PLY_ASCII, CA_PLY_LITTLE_ENDIAN, CA_PLY_BIG_ENDIAN } ca_ply_format;

typedef struct ca_ply_property {
    const char *name; /* in the arena */
    ca_ply_type type;
    bool is_list;
    ca_ply_type count_type; /* of a list */
    ca_location where;
    /* Where the value of row i goes: target[i * stride], times `scale`; NULL: nowhere yet. */
    float *target;
    uint32_t stride;
    float scale;
    bool decode_srgb;
} ca_ply_property;

typedef struct ca_ply_element {
    const char *name; /* in the arena */
    uint64_t count;
    ca_ply_property *properties;
    size_t property_count, property_capacity;
    ca_location where;
} ca_ply_element;

typedef struct ca_ply_header {
    ca_ply_format format;
    ca_ply_element *elements;
    size_t element_count, element_capacity;
    ca_arena names;
} ca_ply_header;

/* Bytes of a number in a binary file. */
size_t ca_ply_type_size(ca_ply_type type);

/* Reads up to and with the line "end_header"; the cursor then stands on the first byte of the data. The header is to
 * be destroyed on failure too. */
ca_status ca_ply_read_header(ca_text_scan *scan, ca_ply_header *header, ca_error *error);
void ca_ply_header_destroy(ca_ply_header *header);

/* NULL where the element has no such property. */
ca_ply_property *ca_ply_find_property(const ca_ply_element *element, const char *name);

#endif
