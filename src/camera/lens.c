#include "camera/lens.h"

#include <float.h>
#include <math.h>

double ca_lens_length(const ca_lens *lens)
{
    double length = 0.0;
    for (uint32_t i = 0; i + 1 < lens->count; i++) length += lens->surfaces[i].thickness;
    return length;
}

static double curvature(const ca_lens_surface *surface)
{
    return surface->radius != 0.0 ? 1.0 / surface->radius : 0.0;
}

double ca_lens_sag(const ca_lens_surface *surface)
{
    const double c = curvature(surface), a2 = surface->aperture * surface->aperture;
    return c * a2 / (1.0 + sqrt(fmax(1.0 - c * c * a2, 0.0)));
}

/* ---- Real rays ------------------------------------------------------------------------------------------------- */

/* Moves the ray to the surface with its vertex at w = 0; *way: how far it went; *cos_in: with the normal there, >= 0.
 * Of a sphere's two points the one where the ray crosses in the sense in which it crosses the vertex' plane. */
static bool meet(const ca_lens_surface *surface, ca_lens_ray *ray, double *way, double *cos_in)
{
    const double c = curvature(surface);
    const double to_plane = -ray->w / ray->dw;
    const double x = ray->x + to_plane * ray->dx, y = ray->y + to_plane * ray->dy;
    const double f = c * (x * x + y * y), g = ray->dw - c * (x * ray->dx + y * ray->dy);
    const double discriminant = g * g - c * f;
    if (!(discriminant > 0.0)) return false;
    *cos_in = sqrt(discriminant);
    const double beyond = f / (g + copysign(*cos_in, ray->dw));
    ray->x = x + beyond * ray->dx;
    ray->y = y + beyond * ray->dy;
    ray->w = beyond * ray->dw;
    *way = to_plane + beyond;
    const double radius2 = ray->x * ray->x + ray->y * ray->y;
    return radius2 <= surface->aperture * surface->aperture && 1.0 - c * ray->w > 0.0;
}

/* Snell's law at a point of the surface with its vertex at w = 0; ratio: index before over index behind. */
static bool refract(const ca_lens_surface *surface, double ratio, ca_lens_ray *ray)
{
    const double c = curvature(surface);
    const double nx = -c * ray->x, ny = -c * ray->y, nw = 1.0 - c * ray->w; /* unit, on a sphere */
    const double cos_in = nx * ray->dx + ny * ray->dy + nw * ray->dw;
    const double cos2_out = 1.0 - ratio * ratio * (1.0 - cos_in * cos_in);
    if (!(cos2_out > 0.0)) return false;
    const double along = copysign(sqrt(cos2_out), cos_in) - ratio * cos_in;
    ray->dx = ratio * ray->dx + along * nx;
    ray->dy = ratio * ray->dy + along * ny;
    ray->dw = ratio * ray->dw + along * nw;
    const double scale = 1.0 / sqrt(ray->dx * ray->dx + ray->dy * ray->dy + ray->dw * ray->dw);
    ray->dx *= scale, ray->dy *= scale, ray->dw *= scale;
    return true;
}

/* Where two surfaces touch, the way between them is 0, and rounding may turn it around: by some units in the last
 * place of the lengths that it is computed from, and by more where the ray grazes the vertex' plane or the surface.
 * (One unit was enough for the 200,000 rays of test_lens_contact, a quarter of one was not.) */
static double rounding_of_way(const ca_lens_ray *start, double w, double cos_in)
{
    const double lengths = fabs(start->x) + fabs(start->y) + fabs(start->w) + fabs(w);
    return 32.0 * DBL_EPSILON * lengths / (fabs(start->dw) * cos_in);
}

/* Meets surface i, whose vertex is at `w`, and passes it, or ends there. */
static ca_lens_end pass(const ca_lens *lens, uint32_t i, double w, ca_lens_ray *ray)
{
    const bool from_film = ray->dw < 0.0;
    const ca_lens_surface *surface = &lens->surfaces[i];
    const double before = i > 0 ? lens->surfaces[i - 1].index : 1.0;
    const ca_lens_ray start = *ray;
    double way, cos_in;
    ray->w -= w;
    if (!meet(surface, ray, &way, &cos_in)) return CA_LENS_BESIDE;
    if (!(way >= -rounding_of_way(&start, w, cos_in))) return CA_LENS_CROSSED;
    if (before != surface->index) {
        const double ratio = from_film ? surface->index / before : before / surface->index;
        if (!refract(surface, ratio, ray)) return CA_LENS_REFLECTED;
    }
    ray->w += w;
    return (from_film ? ray->dw < 0.0 : ray->dw > 0.0) ? CA_LENS_PASSED : CA_LENS_REFLECTED;
}

ca_lens_end ca_lens_trace_to_end(const ca_lens *lens, ca_lens_ray *ray, uint32_t *surface)
{
    ca_lens_end end = CA_LENS_PASSED;
    if (ray->dw < 0.0) {
        double w = ca_lens_length(lens);
        for (uint32_t i = lens->count; i-- > 0 && end == CA_LENS_PASSED;
             w -= i > 0 ? lens->surfaces[i - 1].thickness : 0.0)
            end = pass(lens, *surface = i, w, ray);
        return end;
    }
    double w = 0.0;
    for (uint32_t i = 0; i < lens->count && end == CA_LENS_PASSED; w += lens->surfaces[i++].thickness)
        end = pass(lens, *surface = i, w, ray);
    return end;
}

bool ca_lens_trace(const ca_lens *lens, ca_lens_ray *ray)
{
    uint32_t last;
    return ca_lens_trace_to_end(lens, ray, &last) == CA_LENS_PASSED;
}

/* ---- Paraxial rays --------------------------------------------------------------------------------------------- */

/* A ray's height and slope (towards the film) at the first surface become those behind the last one. */
static void trace_paraxial(const ca_lens *lens, double *height, double *slope)
{
    double index = 1.0;
    for (uint32_t i = 0; i < lens->count; i++) {
        const ca_lens_surface *surface = &lens->surfaces[i];
        const double power = (surface->index - index) * curvature(surface);
        *slope = (index * *slope - power * *height) / surface->index;
        index = surface->index;
        if (i + 1 < lens->count) *height += surface->thickness * *slope;
    }
}

ca_lens_image ca_lens_image_of(const ca_lens *lens, double distance)
{
    const double before = isfinite(distance) ? 1.0 / distance : 0.0;
    double height = 1.0, slope = before;
    trace_paraxial(lens, &height, &slope);
    return (ca_lens_image){.distance = slope != 0.0 ? -height / slope : (double)INFINITY,
                           .magnification = before / slope};
}

double ca_lens_nearest(const ca_lens *lens)
{
    double height = 1.0, parallel = 0.0, other_height = 1.0, steep = 1.0;
    trace_paraxial(lens, &height, &parallel);
    trace_paraxial(lens, &other_height, &steep);
    /* The slope behind the lens is linear in the one before it, 1 / distance, and 0 where rays leave parallel. */
    return -(steep - parallel) / parallel;
}

double ca_lens_focal_length(const ca_lens *lens)
{
    double height = 1.0, slope = 0.0;
    trace_paraxial(lens, &height, &slope);
    return slope != 0.0 ? -1.0 / slope : (double)INFINITY;
}
