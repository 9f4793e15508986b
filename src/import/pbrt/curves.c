/* Curves: tubes whose diameter is the width, whatever kind the file says they are. pbrt gives a curve for each hair;
 * those that follow each other under one material become one shape, with segments that share no control points. */
#include "import/pbrt/reader.h"

#include "geometry/curve.h"

#include <string.h>

/* A cubic segment by its Bezier control points, and the radii at both ends, between which it runs linearly. */
typedef struct segment {
    double points[4][3];
    double radii[2];
} segment;

/* ---- Reading --------------------------------------------------------------------------------------------------- */

/* Bezier control points of the segment that a curve of that degree has from `p` on. */
static void read_segment(const double *p, size_t degree, bool is_bspline, double out[4][3])
{
    for (size_t i = 0; i < 3; i++) {
        const double a = p[i], b = p[3 + i], c = p[6 + i], d = degree == 3 ? p[9 + i] : 0.0;
        double bezier[4] = {a, b, c, d};
        if (is_bspline && degree == 3) {
            bezier[0] = (a + 4.0 * b + c) / 6.0, bezier[1] = (2.0 * b + c) / 3.0;
            bezier[2] = (b + 2.0 * c) / 3.0, bezier[3] = (b + 4.0 * c + d) / 6.0;
        } else if (degree == 2) {
            const double begin = is_bspline ? 0.5 * (a + b) : a, end = is_bspline ? 0.5 * (b + c) : c;
            bezier[0] = begin, bezier[1] = (begin + 2.0 * b) / 3.0;
            bezier[2] = (2.0 * b + end) / 3.0, bezier[3] = end;
        }
        for (size_t k = 0; k < 4; k++) out[k][i] = bezier[k];
    }
}

/* The uniform B-spline's control points of the same segment. Radii that run linearly go on beyond both ends, where
 * one may be negative. */
static void put_segment(ca_pbrt *p, const segment *s)
{
    static const double bases[4][4] = {{6, -7, 2, 0}, {0, 2, -1, 0}, {0, -1, 2, 0}, {0, 2, -7, 6}};
    ca_pbrt_curves *curves = &p->curves;
    float *points = ca_array_grow(curves->points, &curves->capacity, curves->count + 16, sizeof *points);
    if (!points) {
        ca_import_fail_memory(p->importer, "the scene's curves");
        return;
    }
    curves->points = points;
    for (int k = 0; k < 4; k++) {
        double at[3] = {0.0, 0.0, 0.0}, world[3];
        for (int b = 0; b < 4; b++)
            for (int i = 0; i < 3; i++) at[i] += bases[k][b] * s->points[b][i];
        ca_matrix_point(&p->state.ctm, at, world);
        for (int i = 0; i < 3; i++) points[curves->count++] = (float)world[i];
        points[curves->count++] = (float)(s->radii[0] + (s->radii[1] - s->radii[0]) * (k - 1));
    }
}

/* What the transform makes of a width. */
static double width_scale(ca_pbrt *p)
{
    if (!ca_import_is_similarity(&p->state.ctm))
        ca_import_note(p->importer, &p->params.where,
                       "curves that are stretched stay round: their width is scaled by the mean of the transform");
    return cbrt(fabs(ca_matrix_determinant3(&p->state.ctm)));
}

static void read_widths(ca_pbrt *p, double width[2])
{
    ca_pbrt_params *params = &p->params;
    const double both = ca_pbrt_number_in(params, "width", 1.0, 0.0, 1e30);
    width[0] = ca_pbrt_number_in(params, "width0", both, 0.0, 1e30);
    width[1] = ca_pbrt_number_in(params, "width1", both, 0.0, 1e30);
}

/* Flat curves turn towards every ray, as tubes do; only the normals differ. */
static void read_type(ca_pbrt *p)
{
    static const char *const types[] = {"flat", "ribbon", "cylinder"};
    const size_t type = ca_pbrt_choice(&p->params, "type", types, CA_COUNT(types), 0);
    if (type == 0)
        ca_import_note(p->importer, &p->params.where, "flat curves are read as round ones");
    if (type == 1)
        ca_import_fail(p->importer, &p->params.where, "curves of type \"ribbon\" are not supported");
}

void ca_pbrt_read_curve(ca_pbrt *p)
{
    static const char *const kinds[] = {"bezier", "bspline"}, *const without_effect[] = {"splitdepth", "shadowalpha"};
    ca_pbrt_params *params = &p->params;
    size_t count;
    double width[2];
    const size_t degree = (size_t)ca_pbrt_integer_in(params, "degree", 3, 2, 3);
    const bool is_bspline = ca_pbrt_choice(params, "basis", kinds, CA_COUNT(kinds), 0) == 1;
    const double *points = ca_pbrt_array(params, "P", CA_PBRT_POINT, 3, &count);
    const size_t step = is_bspline ? 1 : degree;
    read_type(p);
    read_widths(p, width);
    ca_pbrt_ignore(params, without_effect, CA_COUNT(without_effect));
    if (!points || count <= degree)
        ca_pbrt_fail(params, "P", "must have a point more than the degree, or more");
    else if ((count - 1 - degree) % step != 0)
        ca_pbrt_fail(params, "P", "must have `degree` points more for each further segment");
    if (!points || !ca_import_good(p->importer)) return;
    const size_t segments = 1 + (count - 1 - degree) / step;
    const double scale = 0.5 * width_scale(p);
    for (size_t i = 0; i < segments && ca_import_good(p->importer); i++) {
        segment s;
        read_segment(points + 3 * i * step, degree, is_bspline, s.points);
        for (size_t end = 0; end < 2; end++)
            s.radii[end] = scale * (width[0] + (width[1] - width[0]) * (double)(i + end) / (double)segments);
        put_segment(p, &s);
    }
}

/* ---- Shapes ---------------------------------------------------------------------------------------------------- */

void ca_pbrt_begin_curves(ca_pbrt *p, ca_xml_node *shape, const char *material)
{
    p->curves.shape = shape;
    p->curves.material = material;
    p->curves.group = p->group;
    p->curves.count = 0;
}

bool ca_pbrt_goes_on_with_curves(const ca_pbrt *p, const char *material)
{
    const ca_pbrt_curves *curves = &p->curves;
    return curves->shape && curves->material && strcmp(curves->material, material) == 0 && curves->group == p->group;
}

void ca_pbrt_end_curves(ca_pbrt *p)
{
    ca_pbrt_curves *curves = &p->curves;
    ca_xml_node *shape = curves->shape;
    ca_curve *curve = NULL;
    ca_error reason;
    const char *name;
    curves->shape = NULL;
    if (!shape || !ca_import_good(p->importer)) return;
    const ca_status status =
        ca_curve_create(CA_CURVE_CUBIC, curves->count / 4, curves->count / 16, &curve, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(p->importer, &shape->where, status, &reason);
        return;
    }
    memcpy(curve->points, curves->points, curves->count * sizeof *curves->points);
    for (uint32_t i = 0; i < curve->segment_count; i++) curve->segments[i] = 4 * i;
    if (ca_tree_take_curve(&p->tree, curve, &name)) ca_tree_string(&p->tree, shape, "data", name);
}
