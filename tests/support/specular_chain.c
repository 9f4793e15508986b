#include "support/specular_chain.h"

/* rad: the error of central differences falls with its square, their rounding grows as it gets smaller. */
#define STEP 1e-5

static double_vec meet_plane(const chain_surface *s, double_vec origin, double_vec direction)
{
    const double t = dv_dot(dv_sub(s->place, origin), s->normal) / dv_dot(direction, s->normal);
    return dv_madd(origin, t, direction);
}

static double_vec meet_sphere(const chain_surface *s, double_vec origin, double_vec direction)
{
    const double_vec offset = dv_sub(origin, s->place);
    const double half = dv_dot(offset, direction), rest = dv_dot(offset, offset) - s->radius * s->radius;
    const double root = sqrt(half * half - rest);
    const double_vec near = dv_madd(origin, -half - root, direction), far = dv_madd(origin, -half + root, direction);
    return dv_length(dv_sub(near, s->met)) < dv_length(dv_sub(far, s->met)) ? near : far;
}

static double_vec reflect(double_vec direction, double_vec normal)
{
    return dv_madd(direction, -2.0 * dv_dot(direction, normal), normal);
}

/* Snell's law for vectors; the normal may point to either side. */
static double_vec refract(double_vec direction, double_vec normal, double eta)
{
    const double cos_in = dv_dot(direction, normal);
    const double_vec tangential = dv_mul(dv_madd(direction, -cos_in, normal), 1.0 / eta);
    const double cos_out = sqrt(1.0 - dv_dot(tangential, tangential));
    return dv_madd(tangential, copysign(cos_out, cos_in), normal);
}

/* Where the ray arrives on the last surface. */
static double_vec trace(const chain_surface *chain, uint32_t count, double_vec origin, double_vec direction)
{
    for (uint32_t i = 0;; i++) {
        const chain_surface *s = &chain[i];
        origin = s->sphere ? meet_sphere(s, origin, direction) : meet_plane(s, origin, direction);
        if (i + 1 == count) return origin;
        const double_vec normal = s->sphere ? dv_unit(dv_sub(origin, s->place)) : s->normal;
        direction = s->reflects ? reflect(direction, normal) : refract(direction, normal, s->eta);
    }
}

/* How the end moves as the direction turns towards `side`. */
static double_vec slope(const chain_surface *chain, uint32_t count, double_vec origin, double_vec direction,
                        double_vec side)
{
    const double_vec ahead = trace(chain, count, origin, dv_unit(dv_madd(direction, STEP, side)));
    const double_vec behind = trace(chain, count, origin, dv_unit(dv_madd(direction, -STEP, side)));
    return dv_mul(dv_sub(ahead, behind), 0.5 / STEP);
}

double chain_area_per_solid_angle(const chain_surface *chain, uint32_t count, double_vec origin,
                                 double_vec direction)
{
    const double_vec any = dv_axis(fabs(direction.x) < 0.5 ? 0 : 1);
    const double_vec s = dv_unit(dv_cross(direction, any)), t = dv_cross(direction, s);
    return dv_length(dv_cross(slope(chain, count, origin, direction, s), slope(chain, count, origin, direction, t)));
}
