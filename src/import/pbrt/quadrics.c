/* Quadrics. Whole ones are exact shapes; what the scene language has no exact shape for becomes a mesh: parts of
 * quadrics, and disks with a picture on them, whose coordinates are pbrt's. */
#include "import/pbrt/shapes.h"

static const double pi = 3.14159265358979323846;

/* ---- As surfaces over the unit square -------------------------------------------------------------------------- */

/* Parts of pbrt's quadrics as (u, v) -> position and outward normal. */
typedef struct quadric {
    double radius, inner, low, high, phi; /* angles in radians; low and high: of theta or z */
} quadric;

static void sphere_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, theta = q->low + v * (q->high - q->low);
    const double n[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    for (int i = 0; i < 3; i++) normal[i] = n[i], position[i] = q->radius * n[i];
}

static void cylinder_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, n[3] = {cos(phi), sin(phi), 0.0};
    for (int i = 0; i < 3; i++) normal[i] = n[i], position[i] = q->radius * n[i];
    position[2] = q->low + v * (q->high - q->low);
}

static void disk_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, r = (1.0 - v) * q->radius + v * q->inner;
    position[0] = r * cos(phi), position[1] = r * sin(phi), position[2] = q->low;
    normal[0] = normal[1] = 0.0, normal[2] = 1.0;
}

/* Its tip is at v = 1. */
static void cone_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, slant = hypot(q->radius, q->high);
    const double out[2] = {cos(phi), sin(phi)};
    for (int i = 0; i < 2; i++) position[i] = q->radius * (1.0 - v) * out[i], normal[i] = q->high / slant * out[i];
    position[2] = q->high * v, normal[2] = q->radius / slant;
}

/* x^2 + y^2 = radius^2 z / high, with z from `low` to `high`. */
static void paraboloid_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const quadric *q = of;
    const double phi = u * q->phi, z = q->low + v * (q->high - q->low), r = q->radius * sqrt(z / q->high);
    const double down = 0.5 * q->radius * q->radius / q->high, length = hypot(r, down);
    const double out[2] = {cos(phi), sin(phi)};
    for (int i = 0; i < 2; i++) position[i] = r * out[i], normal[i] = r / length * out[i];
    position[2] = z, normal[2] = -down / length;
}

/* A segment from a to b that turns around the axis. */
typedef struct turned_segment {
    double a[3], b[3], phi;
} turned_segment;

static void hyperboloid_at(const void *of, double u, double v, double position[3], double normal[3])
{
    const turned_segment *t = of;
    const double c = cos(u * t->phi), s = sin(u * t->phi);
    double at[3], along[3];
    for (int i = 0; i < 3; i++) at[i] = (1.0 - v) * t->a[i] + v * t->b[i], along[i] = t->b[i] - t->a[i];
    position[0] = c * at[0] - s * at[1], position[1] = s * at[0] + c * at[1], position[2] = at[2];
    const double dv[2] = {c * along[0] - s * along[1], s * along[0] + c * along[1]};
    const double n[3] = {position[0] * along[2], position[1] * along[2], -position[1] * dv[1] - position[0] * dv[0]};
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; i++) normal[i] = length > 0.0 ? n[i] / length : i == 2;
}

/* ---- As shapes ------------------------------------------------------------------------------------------------- */

static void put_surface(ca_pbrt *p, const ca_pbrt_surface *surface)
{
    ca_mesh mesh;
    if (!ca_import_good(p->importer)) return;
    ca_import_note(p->importer, &p->params.where,
                   "what the scene language has no exact shape for is a mesh of %u "
                   "triangles",
                   2 * surface->columns * surface->rows);
    if (ca_pbrt_make_surface(p, surface, &mesh)) ca_pbrt_put_mesh_flipped(p, &mesh, p->state.reverses);
}

static double read_phi(ca_pbrt *p)
{
    return ca_pbrt_number_in(&p->params, "phimax", 360.0, 0.0, 360.0) * (pi / 180.0);
}

/* The area's factor under the current transform, which must scale uniformly for a light's power to be known. */
static double area_scale(const ca_pbrt *p)
{
    const double determinant = fabs(ca_matrix_determinant3(&p->state.ctm));
    return pow(determinant, 2.0 / 3.0);
}

static void check_area(ca_pbrt *p)
{
    if (ca_pbrt_shines(p) && p->state.light.power > 0.0 && !ca_import_is_similarity(&p->state.ctm))
        ca_import_fail(p->importer, &p->params.where, "a light's power needs a shape that is not stretched");
}

void ca_pbrt_read_sphere(ca_pbrt *p)
{
    const double radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30);
    const double zmin = ca_pbrt_number(&p->params, "zmin", -radius),
                 zmax = ca_pbrt_number(&p->params, "zmax", radius);
    const double phi = read_phi(p);
    if (phi < 2.0 * pi || fmin(zmin, zmax) > -radius || fmax(zmin, zmax) < radius) {
        const quadric part = {.radius = radius,
                              .low = acos(fmin(fmax(fmin(zmin, zmax) / radius, -1.0), 1.0)),
                              .high = acos(fmin(fmax(fmax(zmin, zmax) / radius, -1.0), 1.0)),
                              .phi = phi};
        const ca_pbrt_surface surface = {sphere_at, &part, 128, 64};
        put_surface(p, &surface);
        return;
    }
    check_area(p);
    const double area = 4.0 * pi * radius * radius * area_scale(p), inside = p->state.reverses ? 1.0 : -1.0;
    const int sides = ca_pbrt_is_two_sided(p) ? 2 : 1;
    for (int side = 0; side < sides; side++) {
        ca_xml_node *shape = ca_pbrt_add_shape(p, "sphere", &p->state.ctm, p->state.reverses != (side == 1), area);
        ca_tree_float(&p->tree, shape, "radius", radius * (1.0 + side * inside * CA_PBRT_THICKNESS));
    }
}

/* v downwards is a cylinder that hangs from its upper end; a mirror does not turn its outside in. */
void ca_pbrt_read_cylinder(ca_pbrt *p)
{
    const double radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30);
    const double z0 = ca_pbrt_number(&p->params, "zmin", -1.0), z1 = ca_pbrt_number(&p->params, "zmax", 1.0);
    const double zmin = fmin(z0, z1), zmax = fmax(z0, z1), phi = read_phi(p);
    if (!(zmax > zmin)) ca_pbrt_fail(&p->params, "zmax", "must differ from zmin");
    if (phi < 2.0 * pi) {
        const quadric part = {.radius = radius, .low = zmin, .high = zmax, .phi = phi};
        const ca_pbrt_surface surface = {cylinder_at, &part, 128, 1};
        put_surface(p, &surface);
        return;
    }
    check_area(p);
    const double area = 2.0 * pi * radius * (zmax - zmin) * area_scale(p), inside = p->state.reverses ? 1.0 : -1.0;
    const ca_matrix move = ca_matrix_translate(0.0, 0.0, zmax);
    const int sides = ca_pbrt_is_two_sided(p) ? 2 : 1;
    for (int side = 0; side < sides; side++) {
        const double across = radius * (1.0 + side * inside * CA_PBRT_THICKNESS);
        const ca_matrix size = ca_matrix_scale(across, across, zmin - zmax);
        const ca_matrix frame = ca_matrix_multiply(&move, &size);
        const ca_matrix to_world = ca_matrix_multiply(&p->state.ctm, &frame);
        ca_pbrt_add_shape(p, "cylinder", &to_world, p->state.reverses != (side == 1), area);
    }
}

void ca_pbrt_read_cone(ca_pbrt *p)
{
    const quadric cone = {.radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30),
                          .high = ca_pbrt_number_in(&p->params, "height", 1.0, 1e-30, 1e30),
                          .phi = read_phi(p)};
    const ca_pbrt_surface surface = {cone_at, &cone, 128, 1};
    put_surface(p, &surface);
}

void ca_pbrt_read_paraboloid(ca_pbrt *p)
{
    const double z0 = ca_pbrt_number_in(&p->params, "zmin", 0.0, 0.0, 1e30),
                 z1 = ca_pbrt_number_in(&p->params, "zmax", 1.0, 0.0, 1e30);
    const quadric bowl = {.radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30),
                          .low = fmin(z0, z1),
                          .high = fmax(z0, z1),
                          .phi = read_phi(p)};
    if (!(bowl.high > bowl.low)) ca_pbrt_fail(&p->params, "zmax", "must differ from zmin");
    const ca_pbrt_surface surface = {paraboloid_at, &bowl, 128, 64};
    put_surface(p, &surface);
}

void ca_pbrt_read_hyperboloid(ca_pbrt *p)
{
    turned_segment segment = {.a = {0.0, 0.0, 0.0}, .b = {1.0, 1.0, 1.0}};
    (void)ca_pbrt_point(&p->params, "p1", segment.a);
    (void)ca_pbrt_point(&p->params, "p2", segment.b);
    segment.phi = read_phi(p);
    const ca_pbrt_surface surface = {hyperboloid_at, &segment, 128, 64};
    put_surface(p, &surface);
}

/* Whole disks under a material without pictures are exact. */
void ca_pbrt_read_disk(ca_pbrt *p)
{
    const double radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-30, 1e30);
    const double inner = ca_pbrt_number_in(&p->params, "innerradius", 0.0, 0.0, radius);
    const double height = ca_pbrt_number(&p->params, "height", 0.0), phi = read_phi(p);
    if (phi < 2.0 * pi || inner > 0.0 || p->has_pictures) {
        const quadric part = {.radius = radius, .inner = inner, .low = height, .phi = phi};
        const ca_pbrt_surface surface = {disk_at, &part, 128, p->has_pictures ? 32 : 1};
        put_surface(p, &surface);
        return;
    }
    check_area(p);
    const double area = pi * radius * radius * area_scale(p), behind = p->state.reverses ? 1.0 : -1.0;
    const ca_matrix size = ca_matrix_scale(radius, radius, 1.0);
    const int sides = ca_pbrt_is_two_sided(p) ? 2 : 1;
    for (int side = 0; side < sides; side++) {
        const ca_matrix move = ca_matrix_translate(0.0, 0.0, height + side * behind * CA_PBRT_THICKNESS * radius);
        const ca_matrix frame = ca_matrix_multiply(&move, &size);
        const ca_matrix to_world = ca_matrix_multiply(&p->state.ctm, &frame);
        ca_pbrt_add_shape(p, "disk", &to_world, p->state.reverses != (side == 1), area);
    }
}
