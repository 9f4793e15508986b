/* Integrators: from a scene and a pixel to a radiance.
 *
 * An integrator is a row of the table in integrator.c: its name, its parameters with their defaults, and functions. It
 * knows nothing of threads, time, stopping or files (render/ does): it is given a pixel and an index of a camera path and
 * answers with one film sample, a pure function of (scene, settings, pixel, index). Counters belong to the calling
 * thread. */
#ifndef CA_INTEGRATOR_INTEGRATOR_H
#define CA_INTEGRATOR_INTEGRATOR_H

#include "film/film.h"
#include "scene/scene.h"

/* What one thread has done; sums over threads are the statistics. */
typedef struct ca_counters {
    uint64_t camera_paths, rays, shadow_rays;
    uint64_t non_finite;
} ca_counters;

/* A parameter an integrator understands, and what it is if nobody says. */
typedef struct ca_parameter_spec {
    const char *name;
    enum { CA_SPEC_INTEGER, CA_SPEC_BOOLEAN, CA_SPEC_CHOICE } kind;
    double minimum;      /* integers */
    double number;       /* default of integers and booleans; of a choice the index in `choices` */
    const char *choices; /* "balance|power" */
} ca_parameter_spec;

enum { CA_MAX_PARAMETERS = 16 };

/* What an integrator works with. `values[i]` belongs to the i-th parameter of its table row. */
typedef struct ca_integrator_input {
    const ca_scene *scene;
    const ca_camera *camera;
    const ca_sampler *sampler;
    const ca_filter *filter;
    double values[CA_MAX_PARAMETERS];
} ca_integrator_input;

typedef struct ca_integrator_type {
    const char *name;
    const ca_parameter_spec *parameters; /* ended by a NULL name */
    /* Makes the state from the input; the scene, camera, sampler and filter outlive it. */
    ca_status (*create)(const ca_integrator_input *input, void **state, ca_error *error);
    void (*destroy)(void *state);
    /* One camera path through pixel (x, y) of the full film, the index-th. */
    void (*camera_path)(const void *state, uint32_t x, uint32_t y, uint32_t index, ca_film_sample *sample,
                        ca_counters *counters);
} ca_integrator_type;

/* The row of that name. For an unknown one the error names all there are: CA_ERROR_SCENE at `where`, or, where that is NULL
 * because the name came with the settings, CA_ERROR_ARGUMENT. Parameters likewise. */
ca_status ca_integrator_find(const char *name, const ca_location *where, const ca_integrator_type **type,
                             ca_error *error);

/* Fills input->values: the type's defaults, over them the scene's parameters, over them `overrides`
 * ("max_depth=5,rr_depth=3", may be NULL). The scene's parameters must all be known to the type, unless the integrator
 * was chosen on the command line (`replaced`): then those with names it knows carry over. */
ca_status ca_integrator_configure(const ca_integrator_type *type, const ca_integrator_desc *desc, bool replaced,
                                  const char *overrides, ca_integrator_input *input, ca_error *error);

/* Sets one parameter by name. */
ca_status ca_integrator_set(const ca_integrator_type *type, const ca_parameter *parameter, ca_integrator_input *input,
                            ca_error *error);

/* Writes "name:parameter=value,..." with all values, as recorded in images. */
void ca_integrator_describe(const ca_integrator_type *type, const ca_integrator_input *input, char *text, size_t size);

/* Rows of the table. */
extern const ca_integrator_type ca_integrator_path;

#endif
