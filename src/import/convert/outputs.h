/* The files beside a scene that is written: which there are, and what they are called.
 *
 * A file is known by a key, so that what is used several times is written once. It is called as its source, with
 * "-2", "-3", ... behind the name where that is taken; other characters than letters, digits, "-", "_" and "." become
 * "_". Names are told apart without regard to case. */
#ifndef CA_IMPORT_CONVERT_OUTPUTS_H
#define CA_IMPORT_CONVERT_OUTPUTS_H

#include "scene/description.h"

typedef enum ca_output_kind {
    CA_OUTPUT_COPY,  /* of a file */
    CA_OUTPUT_MESH,  /* binary PLY */
    CA_OUTPUT_IMAGE, /* EXR of floats */
    CA_OUTPUT_CURVE, /* text */
} ca_output_kind;

typedef struct ca_output {
    ca_output_kind kind;
    const char *name;   /* without folder */
    const char *source; /* of a copy: the file, borrowed */
    uint32_t index;     /* else in the description's meshes, images or curves */
} ca_output;

struct ca_output_slot;

typedef struct ca_outputs {
    ca_arena arena;
    CA_TABLE(ca_output) files;
    struct ca_output_slot *slots; /* keys and names that are known */
    size_t slot_count, slot_capacity;
} ca_outputs;

void ca_outputs_destroy(ca_outputs *outputs);

/* The name of the file of that key, new or known; NULL when out of memory. `stem` is what a new one would be called,
 * with `extension` (".ply") behind it. */
const char *ca_outputs_add(ca_outputs *outputs, const char *key, const char *stem, const char *extension,
                           ca_output output);

/* The name of a file without folders and extension; in the arena, NULL when out of memory. */
const char *ca_outputs_stem(ca_outputs *outputs, const char *path);

#endif
