/* The directives of a .pbrt file whose form is regular: so many numbers, so many words in quotes, parameters perhaps.
 * Each is a row of one table, with the function that does what it says once its parts are read. Those with a grammar
 * of their own are in pbrt.c. */
#ifndef CA_IMPORT_PBRT_DIRECTIVES_H
#define CA_IMPORT_PBRT_DIRECTIVES_H

#include "import/pbrt/reader.h"

typedef enum ca_pbrt_place { CA_PBRT_ANYWHERE, CA_PBRT_BEFORE_WORLD, CA_PBRT_IN_WORLD } ca_pbrt_place;

enum { CA_PBRT_MAX_NUMBERS = 16, CA_PBRT_MAX_STRINGS = 3, CA_PBRT_DIRECTIVE_COUNT = 38 };

/* `numbers` and `strings` are as many as the directive has; its parameters are p->params. */
typedef void ca_pbrt_run(ca_pbrt *p, const double *numbers, const char *const *strings);

typedef struct ca_pbrt_directive {
    const char *name;
    ca_pbrt_place place;
    uint32_t numbers, strings;
    bool has_parameters;
    ca_pbrt_run *run;
} ca_pbrt_directive;

extern const ca_pbrt_directive ca_pbrt_directives[CA_PBRT_DIRECTIVE_COUNT];

/* Fails: the directive asks for a medium. */
void ca_pbrt_fail_medium(ca_pbrt *p);

/* ---- Transforms (transforms.c) --------------------------------------------------------------------------------- */

ca_pbrt_run ca_pbrt_run_identity, ca_pbrt_run_translate, ca_pbrt_run_scale, ca_pbrt_run_rotate,
    ca_pbrt_run_look_at, ca_pbrt_run_transform, ca_pbrt_run_concat, ca_pbrt_run_coordinate_system,
    ca_pbrt_run_coordinate_transform, ca_pbrt_run_transform_times;

/* Gives a coordinate system a name, or another matrix. */
void ca_pbrt_define_system(ca_pbrt *p, const char *name, const ca_matrix *matrix);

/* ---- Attributes (attributes.c) --------------------------------------------------------------------------------- */

ca_pbrt_run ca_pbrt_run_attribute_begin, ca_pbrt_run_attribute_end, ca_pbrt_run_transform_begin,
    ca_pbrt_run_transform_end, ca_pbrt_run_reverse, ca_pbrt_run_attribute, ca_pbrt_run_color_space;

/* By their kind: the directives that open blocks. */
extern const char *const ca_pbrt_open_names[CA_PBRT_OPEN_OBJECT + 1];

/* Keeps the state, and brings the kept one back. Fail where too many blocks are open, or the open one is of another
 * kind. */
void ca_pbrt_open_state(ca_pbrt *p, ca_pbrt_open kind);
void ca_pbrt_close_state(ca_pbrt *p, ca_pbrt_open kind);

#endif
