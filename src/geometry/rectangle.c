#include "geometry/rectangle.h"

#include "geometry/triangle.h"
#include "math/numeric.h"

/* ---- Which meshes are rectangles ------------------------------------------------------------------------------- */

static bool same_point(ca_vec3 a, ca_vec3 b, float tolerance) { return ca_length(ca_sub(a, b)) <= tolerance; }

/* With the right angle of the first triangle at its corner k0 and that of the second at k1? Both run the same way
 * around: behind its right angle the second triangle comes to the end of y, then to the end of x. */
static bool fits(const ca_triangle t[2], int k0, int k1, ca_rectangle *rectangle)
{
    const ca_vec3 corner = t[0].p[k0], end_x = t[0].p[(k0 + 1) % 3], end_y = t[0].p[(k0 + 2) % 3];
    const ca_vec3 x = ca_sub(end_x, corner), y = ca_sub(end_y, corner);
    const float width = ca_length(x), height = ca_length(y), least = ca_min(width, height);
    const float rounding = CA_GAMMA(4) * ca_max3(ca_max_vec3(ca_abs3(corner), ca_abs3(t[1].p[k1])));
    const float tolerance = ca_clamp(rounding, 1e-5f * least, 1e-4f * least);
    if (!(width > 0.0f && height > 0.0f) || !(ca_abs_dot(x, y) <= tolerance * ca_max(width, height))) return false;
    if (!same_point(t[1].p[k1], ca_add(end_x, y), tolerance) ||
        !same_point(t[1].p[(k1 + 1) % 3], end_y, tolerance) || !same_point(t[1].p[(k1 + 2) % 3], end_x, tolerance))
        return false;
    *rectangle = (ca_rectangle){.exists = true,
                                .right_angle = {(uint8_t)k0, (uint8_t)k1},
                                .corner = corner,
                                .end_x = end_x,
                                .end_y = end_y,
                                .x = ca_mul(x, 1.0f / width),
                                .y = ca_mul(y, 1.0f / height),
                                .width = width,
                                .height = height};
    rectangle->n = ca_normalize_any(ca_cross(x, y)); /* to the bit what lanes make of the corners */
    rectangle->is_plain = same_point(t[1].p[k1], ca_add(end_x, y), rounding);
    rectangle->center = ca_mul(ca_add(end_x, end_y), 0.5f);
    rectangle->half_diagonal = 0.5f * ca_length(ca_sub(end_x, end_y));
    /* The solid angle is under width height / distance^2 for the distance of the nearest point; a little more is
     * safe. */
    const float distance = sqrtf(width * height / CA_SMALLEST_SOLID_ANGLE) + rectangle->half_diagonal;
    rectangle->large_distance2 = 1.02f * ca_sqr(distance);
    return true;
}

ca_rectangle ca_rectangle_from_mesh(const ca_mesh *mesh)
{
    ca_rectangle rectangle = {0};
    if (mesh->triangle_count != 2) return rectangle;
    const ca_triangle t[2] = {ca_triangle_load(mesh, 0), ca_triangle_load(mesh, 1)};
    for (int k = 0; k < 9; k++)
        if (fits(t, k / 3, k % 3, &rectangle)) break;
    rectangle.is_plain = rectangle.is_plain && !mesh->normals;
    return rectangle;
}

uint32_t ca_rectangle_triangle(const ca_rectangle *rectangle, ca_vec2 st, ca_vec2 *barycentric)
{
    const uint32_t triangle = st.x + st.y > 1.0f;
    const float along_x = triangle ? 1.0f - st.y : st.x, along_y = triangle ? 1.0f - st.x : st.y;
    const uint32_t k = rectangle->right_angle[triangle];
    /* Weights of the right angle's corner and the two behind it. The second triangle comes to the end of y first,
     * whose weight is what s leaves. */
    const float at = ca_max(1.0f - along_x - along_y, 0.0f);
    const float next = triangle ? along_y : along_x, last = triangle ? along_x : along_y;
    *barycentric = k == 0 ? (ca_vec2){next, last} : k == 1 ? (ca_vec2){at, next} : (ca_vec2){last, at};
    return triangle;
}

/* ---- Seen from a point ----------------------------------------------------------------------------------------- */


static double dot_double(ca_vec3 a, const double b[3])
{
    return (double)a.x * b[0] + (double)a.y * b[1] + (double)a.z * b[2];
}

/* The z component of the normal of the plane through the reference and a side at `offset` from the foot point. */
static double side_normal(double offset, double distance)
{
    return offset / sqrt(offset * offset + distance * distance);
}

bool ca_spherical_rectangle_from(const ca_rectangle *rectangle, ca_vec3 reference, ca_spherical_rectangle *seen)
{
    if (!ca_rectangle_may_look_large(rectangle, reference)) return false;
    const ca_vec3 c = rectangle->corner;
    const double to_corner[3] = {(double)c.x - (double)reference.x, (double)c.y - (double)reference.y,
                                 (double)c.z - (double)reference.z};
    const double width = (double)rectangle->width, height = (double)rectangle->height;
    const double distance = fabs(dot_double(rectangle->n, to_corner));
    const double x0 = dot_double(rectangle->x, to_corner), y0 = dot_double(rectangle->y, to_corner);
    const double x1 = x0 + width, y1 = y0 + height;
    /* The nearest point gives an upper bound of the solid angle. */
    const double dx = fmax(fmax(x0, -x1), 0.0), dy = fmax(fmax(y0, -y1), 0.0);
    const double nearest2 = dx * dx + dy * dy + distance * distance;
    if (!(width * height * distance > (double)CA_SMALLEST_SOLID_ANGLE * nearest2 * sqrt(nearest2))) return false;
    if (!(distance > 1e-5 * fmax(width, height))) return false;
    const double b0 = -side_normal(y0, distance), b1 = side_normal(y1, distance);
    const double left = -side_normal(x0, distance), right = side_normal(x1, distance);
    const double k = 2.0 * CA_PI_D - acos(-b1 * left) - acos(-left * b0);
    const double solid_angle = acos(-b0 * right) + acos(-right * b1) - k;
    if (!(solid_angle > (double)CA_SMALLEST_SOLID_ANGLE)) return false;
    *seen = (ca_spherical_rectangle){x0, x1, y0, y1, distance, solid_angle, b0, b1, k};
    return true;
}

static double clamp_double(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

ca_vec2 ca_spherical_rectangle_sample(const ca_spherical_rectangle *seen, ca_vec2 u)
{
    /* The part with smaller x has the share u.x of the solid angle. */
    const double angle = (double)u.x * seen->solid_angle + seen->k;
    const double f = (cos(angle) * seen->b0 - seen->b1) / sin(angle);
    const double c = clamp_double(copysign(1.0, f) / sqrt(f * f + seen->b0 * seen->b0), -1.0, 1.0);
    const double x = clamp_double(c * seen->distance / sqrt(1.0 - c * c), seen->x0, seen->x1);
    /* Along the strip at x solid angle is proportional to the sine of the elevation. */
    const double strip2 = x * x + seen->distance * seen->distance, strip = sqrt(strip2);
    const double h0 = side_normal(seen->y0, strip), h1 = side_normal(seen->y1, strip);
    const double h = h0 + (double)u.y * (h1 - h0);
    const double y = clamp_double(h * strip / sqrt(1.0 - h * h), seen->y0, seen->y1);
    return (ca_vec2){(float)((x - seen->x0) / (seen->x1 - seen->x0)),
                     (float)((y - seen->y0) / (seen->y1 - seen->y0))};
}
