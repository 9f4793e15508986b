/* The directives that change the current transform, and named coordinate systems. */
#include "import/pbrt/directives.h"

static void set_transform(ca_pbrt *p, const ca_matrix *matrix)
{
    if (!p->state.start_is_active) return;
    for (int i = 0; i < 16; i++)
        if (!isfinite(matrix->m[i / 4][i % 4])) {
            ca_import_fail(p->importer, &p->params.where, "the transform is not finite");
            return;
        }
    p->state.ctm = *matrix;
}

static void apply(ca_pbrt *p, ca_matrix step)
{
    const ca_matrix product = ca_matrix_multiply(&p->state.ctm, &step);
    set_transform(p, &product);
}

void ca_pbrt_run_identity(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    const ca_matrix identity = ca_matrix_identity();
    set_transform(p, &identity);
}

void ca_pbrt_run_translate(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    apply(p, ca_matrix_translate(n[0], n[1], n[2]));
}

void ca_pbrt_run_scale(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    apply(p, ca_matrix_scale(n[0], n[1], n[2]));
}

void ca_pbrt_run_rotate(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    if (n[1] == 0.0 && n[2] == 0.0 && n[3] == 0.0)
        ca_import_fail(p->importer, &p->params.where, "Rotate needs an axis, and it is 0");
    else
        apply(p, ca_matrix_rotate(n[1], n[2], n[3], n[0]));
}

/* From the world to the camera. */
void ca_pbrt_run_look_at(ca_pbrt *p, const double *n, const char *const *s)
{
    ca_matrix to_world, from_world;
    (void)s;
    if (ca_matrix_look_at(n, n + 3, n + 6, &to_world) && ca_matrix_invert(&to_world, &from_world))
        apply(p, from_world);
    else
        ca_import_fail(p->importer, &p->params.where,
                       "LookAt needs an eye, a target and up that are not on one line");
}

/* Columns one after another. */
static ca_matrix matrix_of(const double *n)
{
    ca_matrix m;
    for (int i = 0; i < 16; i++) m.m[i % 4][i / 4] = n[i];
    return m;
}

void ca_pbrt_run_transform(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    const ca_matrix m = matrix_of(n);
    set_transform(p, &m);
}

void ca_pbrt_run_concat(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)s;
    apply(p, matrix_of(n));
}

void ca_pbrt_define_system(ca_pbrt *p, const char *name, const ca_matrix *matrix)
{
    ca_pbrt_named *system = ca_pbrt_define(p, &p->systems, name);
    if (system) system->matrix = *matrix;
}

void ca_pbrt_run_coordinate_system(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_define_system(p, s[0], &p->state.ctm);
}

void ca_pbrt_run_coordinate_transform(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    const ca_pbrt_named *system = ca_pbrt_name(&p->systems, s[0]);
    if (system)
        set_transform(p, &system->matrix);
    else
        ca_pbrt_fail_name(p, &p->params.where, "coordinate system", s[0], &p->systems);
}

void ca_pbrt_run_transform_times(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)p, (void)n, (void)s; /* only moving objects ask for the time */
}
