/* The parameters of one directive, asked for by name. Asking marks a parameter as used; ca_pbrt_params_end fails at
 * one that was never asked for, with the nearest name that was. Getters give back their default where a parameter is
 * missing and after a failure, which is the importer's. */
#ifndef CA_IMPORT_PBRT_PARAMETERS_H
#define CA_IMPORT_PBRT_PARAMETERS_H

#include "import/importer.h"
#include "import/pbrt/tokens.h"

typedef enum ca_pbrt_type {
    CA_PBRT_INTEGER,
    CA_PBRT_FLOAT,
    CA_PBRT_POINT2,
    CA_PBRT_POINT, /* point3, vector3 and normal likewise */
    CA_PBRT_BOOL,
    CA_PBRT_TEXT,
    CA_PBRT_TEXTURE,
    CA_PBRT_RGB, /* in the parameter's colour space */
    CA_PBRT_XYZ,
    CA_PBRT_SPECTRUM, /* numbers, or names */
    CA_PBRT_BLACKBODY,
} ca_pbrt_type;

typedef struct ca_pbrt_parameter {
    const char *name;
    ca_pbrt_type type;
    const double *numbers;
    const char *const *texts; /* then `numbers` is NULL */
    size_t count;
    ca_location where;
    uint32_t space;      /* of colours: index of ca_pbrt_space_names */
    bool used, optional; /* optional: may stay unused */
} ca_pbrt_parameter;

/* Parameters that an Attribute sets in advance; the latest first. In the document's arena. */
typedef struct ca_pbrt_preset {
    ca_pbrt_parameter parameter;
    const struct ca_pbrt_preset *next;
} ca_pbrt_preset;

enum { CA_PBRT_MAX_ASKED = 64 };

typedef struct ca_pbrt_params {
    ca_importer *importer;
    const char *what; /* the directive and its type, for messages: Shape "sphere" */
    ca_location where;
    CA_TABLE(ca_pbrt_parameter) list;
    CA_TABLE(double) numbers;
    CA_TABLE(const char *) texts;
    const char *asked[CA_PBRT_MAX_ASKED];
    size_t asked_count;
} ca_pbrt_params;

/* Reads parameters up to what is none; their memory is used again at the next call and freed by the last. */
void ca_pbrt_params_read(ca_pbrt_params *params, ca_importer *importer, ca_pbrt_scan *scan, uint32_t space);
/* Appends those that are not given. */
void ca_pbrt_params_preset(ca_pbrt_params *params, const ca_pbrt_preset *presets);
void ca_pbrt_params_end(ca_pbrt_params *params);
void ca_pbrt_params_destroy(ca_pbrt_params *params);

/* NULL where there is none; with a type, only of that type (a material may have a number and a texture of one
 * name). */
const ca_pbrt_parameter *ca_pbrt_find(ca_pbrt_params *params, const char *name);

void ca_pbrt_fail(ca_pbrt_params *params, const char *name, const char *message);

double ca_pbrt_number(ca_pbrt_params *params, const char *name, double fallback);
double ca_pbrt_number_in(ca_pbrt_params *params, const char *name, double fallback, double low, double high);
int64_t ca_pbrt_integer_in(ca_pbrt_params *params, const char *name, int64_t fallback, int64_t low, int64_t high);
bool ca_pbrt_boolean(ca_pbrt_params *params, const char *name, bool fallback);
const char *ca_pbrt_string(ca_pbrt_params *params, const char *name, const char *fallback);
/* Index among the choices. */
size_t ca_pbrt_choice(ca_pbrt_params *params, const char *name, const char *const *choices, size_t count,
                      size_t fallback);
bool ca_pbrt_point(ca_pbrt_params *params, const char *name, double xyz[3]);
/* The numbers of an array of this type, a multiple of `group`; NULL and 0 where it is missing. */
const double *ca_pbrt_array(ca_pbrt_params *params, const char *name, ca_pbrt_type type, size_t group, size_t *count);
/* Parameters that have no effect here. */
void ca_pbrt_ignore(ca_pbrt_params *params, const char *const *names, size_t count);

#endif
