#include "camera/realistic.h"

#include "camera/camera.h"
#include "sampling/warp.h"

/* A ray on both sides of the lens. */
typedef struct lens_way {
    double film_x, film_y;   /* where it meets the film */
    double pupil_x, pupil_y; /* and the plane of the last vertex, produced straight from the film */
    double cos_film;         /* with the axis, behind the lens */
    ca_lens_ray scene;       /* in front of the lens, away from it, from the point on the entrance disk */
} lens_way;

/* ---- Places ---------------------------------------------------------------------------------------------------- */

/* The point where the ray, or the line that it lies on, has the given w. */
static void move_to(double w, ca_lens_ray *ray)
{
    const double t = (w - ray->w) / ray->dw;
    ray->x += t * ray->dx;
    ray->y += t * ray->dy;
    ray->w = w;
}

static void set_direction(double dx, double dy, double dw, ca_lens_ray *ray)
{
    const double scale = 1.0 / sqrt(dx * dx + dy * dy + dw * dw);
    ray->dx = scale * dx;
    ray->dy = scale * dy;
    ray->dw = scale * dw;
}

/* A film position is where the film's upright image has it; the film itself is upside down. */
static void film_to_lens(const ca_camera *camera, ca_vec2 film, double *x, double *y)
{
    *x = (double)film.x * (double)camera->pixel_width - (double)camera->left;
    *y = (double)film.y * (double)camera->pixel_height - (double)camera->top;
}

static ca_vec2 lens_to_film(const ca_camera *camera, double x, double y)
{
    return (ca_vec2){(float)((x + (double)camera->left) / (double)camera->pixel_width),
                     (float)((y + (double)camera->top) / (double)camera->pixel_height)};
}

static const ca_pupil_box *box_at(const ca_realistic *r, double film_radius)
{
    const double ring = film_radius / r->ring_width;
    return &r->rings[ring < CA_PUPIL_RINGS - 1 ? (uint32_t)ring : CA_PUPIL_RINGS - 1];
}

static double box_area(const ca_pupil_box *box)
{
    return box->high > box->low ? (box->high - box->low) * 2.0 * box->side : 0.0;
}

static bool is_in_disk(const ca_realistic *r, double x, double y)
{
    return x * x + y * y <= r->disk_radius * r->disk_radius;
}

/* ---- Densities ------------------------------------------------------------------------------------------------- */

static double disk_area(const ca_realistic *r) { return CA_PI_D * r->disk_radius * r->disk_radius; }

static double pixel_area(const ca_camera *camera)
{
    return (double)camera->pixel_width * (double)camera->pixel_height;
}

static ca_pdf_area position_pdf(const ca_realistic *r)
{
    return (ca_pdf_area){(float)(1.0 / (disk_area(r) * r->scale * r->scale))};
}

/* The projected solid angle of all that a film point chooses from, would it all be where the ray is: dA cos^4 / d^2
 * for two planes across the axis that are d apart. */
static double chosen_solid_angle(const ca_realistic *r, const lens_way *way)
{
    const ca_pupil_box *box = box_at(r, hypot(way->film_x, way->film_y));
    const double cos2 = way->cos_film * way->cos_film;
    return box_area(box) * cos2 * cos2 / (r->film_distance * r->film_distance);
}

/* The ray's density per etendue, 1 / (pixel area * chosen solid angle), is cos times as much per area of the disk
 * and solid angle. */
static ca_pdf_solid_angle direction_pdf(const ca_camera *camera, const lens_way *way)
{
    const ca_realistic *r = &camera->as.realistic;
    const double etendue = pixel_area(camera) * chosen_solid_angle(r, way);
    return (ca_pdf_solid_angle){(float)(-way->scene.dw * disk_area(r) / etendue)};
}

/* ---- Preparation ----------------------------------------------------------------------------------------------- */

/* Points of the last vertex' plane are tried on grids of so many by half as many. */
enum { GRID = 33, FINEST_GRID = 513, PLANES = 33 };

/* Rays that leave the lens, so far: of disks on planes from the first vertex to the last the radii that hold all. */
typedef struct ray_bundle {
    double radius2[PLANES];
} ray_bundle;

static double plane_w(const ca_realistic *r, int plane) { return r->last_w * plane / (PLANES - 1); }

static void add_to_bundle(const ca_realistic *r, ca_lens_ray ray, ray_bundle *bundle)
{
    for (int i = 0; i < PLANES; i++) {
        move_to(plane_w(r, i), &ray);
        bundle->radius2[i] = fmax(bundle->radius2[i], ray.x * ray.x + ray.y * ray.y);
    }
}

static bool trace_from_film(const ca_realistic *r, double film_x, double film_y, double pupil_x, double pupil_y,
                            ca_lens_ray *ray)
{
    *ray = (ca_lens_ray){.x = film_x, .y = film_y, .w = r->film_w};
    set_direction(pupil_x - film_x, pupil_y - film_y, -r->film_distance, ray);
    return ca_lens_trace(&r->lens, ray);
}

static const ca_pupil_box no_box = {(double)INFINITY, -(double)INFINITY, 0.0};

/* Bounds what gets through of the grid on `region`, with a cell to each side; bundle: NULL is allowed. A point that
 * gets through alone is in the middle of its box. */
static ca_pupil_box scan(const ca_realistic *r, double film_radius, ca_pupil_box region, int grid, ray_bundle *bundle)
{
    const double step = (region.high - region.low) / (grid - 1), step_side = 2.0 * region.side / (grid - 1);
    ca_pupil_box box = no_box;
    for (int i = 0; i < grid; i++)
        for (int j = 0; j <= grid / 2; j++) {
            const double x = region.low + i * step, y = j * step_side;
            ca_lens_ray ray;
            if (!trace_from_film(r, film_radius, 0.0, x, y, &ray)) continue;
            box.low = fmin(box.low, x - step);
            box.high = fmax(box.high, x + step);
            box.side = fmax(box.side, y + step_side);
            if (bundle) add_to_bundle(r, ray, bundle);
        }
    return box;
}

/* The same of what gets through of a region that holds all of it, on grids of ever smaller regions, as long as they
 * shrink a lot: the pupil of a narrow stop is a point of the first. */
static ca_pupil_box bound_closely(const ca_realistic *r, double film_radius, ca_pupil_box region, ray_bundle *bundle)
{
    for (;;) {
        const ca_pupil_box box = scan(r, film_radius, region, GRID, bundle);
        if (!(box_area(&box) < 0.25 * box_area(&region)) || box_area(&box) == 0.0) return box;
        region = box;
    }
}

/* All of the last vertex' plane that rays from the film to the last surface can pass: beyond its aperture by as much
 * as the surface bends away from the plane. */
static double reach(const ca_realistic *r, double film_radius)
{
    const ca_lens_surface *last = &r->lens.surfaces[r->lens.count - 1];
    const double sag = fabs(ca_lens_sag(last));
    return last->aperture + sag * (film_radius + last->aperture) / fmax(r->film_distance - sag, 1e-3 * sag);
}

/* A pupil that lies between the points of a grid, of a narrow stop: it is looked for along the line on which its
 * middle lies, outwards, in steps of half its width. */
static ca_pupil_box bound_narrow_pupil(const ca_realistic *r, double film_radius, ray_bundle *bundle)
{
    const double all = reach(r, film_radius), step = fmax(r->pupil_radius, 1e-5 * all);
    for (double away = 0.0; away < all; away += step)
        for (int side = -1; side <= 1; side += 2) {
            const double x = side * away;
            ca_lens_ray ray;
            if (!trace_from_film(r, film_radius, 0.0, x, 0.0, &ray)) continue;
            const ca_pupil_box region = {x - 4.0 * step, x + 4.0 * step, 4.0 * step};
            return bound_closely(r, film_radius, region, bundle);
        }
    return no_box;
}

/* The exit pupil as a film point sees it: found on a grid, along a line, or on ever finer grids, the last one of
 * `finest` points, then bounded on a grid of its own. */
static ca_pupil_box bound_pupil(const ca_realistic *r, double film_radius, int finest, ray_bundle *bundle)
{
    const double all = reach(r, film_radius);
    const ca_pupil_box region = {-all, all, all};
    for (int grid = GRID; grid <= finest; grid = 4 * grid - 3) {
        const ca_pupil_box box = scan(r, film_radius, region, grid, NULL);
        if (box.high > box.low) return bound_closely(r, film_radius, box, bundle);
        if (grid > GRID || finest == GRID) continue;
        const ca_pupil_box narrow = bound_narrow_pupil(r, film_radius, bundle);
        if (narrow.high > narrow.low) return narrow;
    }
    return no_box;
}

/* The plane on which the bundle is thinnest. Between the rays of the grids others go: of a pupil that is some thirty
 * cells wide they lie at most a cell farther out. */
static void choose_disk(ca_realistic *r, const ray_bundle *bundle)
{
    int best = 0;
    for (int i = 1; i < PLANES; i++)
        if (bundle->radius2[i] < bundle->radius2[best]) best = i;
    r->disk_w = plane_w(r, best);
    r->disk_radius = sqrt(bundle->radius2[best]) * (1.0 + 3.0 / GRID);
}

/* Radius of the exit pupil, on the plane of the last vertex, as the film's centre sees it. */
static double axial_radius(const ca_realistic *r)
{
    double inside = 0.0, outside = reach(r, 0.0);
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (inside + outside);
        ca_lens_ray ray;
        if (trace_from_film(r, 0.0, 0.0, middle, 0.0, &ray))
            inside = middle;
        else
            outside = middle;
    }
    return inside;
}

/* pi sin^2 of the steepest ray from the film's centre that gets through. */
static double axial_solid_angle(const ca_realistic *r)
{
    const double radius2 = r->pupil_radius * r->pupil_radius;
    return CA_PI_D * radius2 / (radius2 + r->film_distance * r->film_distance);
}

/* What does not depend on the film's size. */
static void prepare_axis(ca_realistic *r)
{
    r->last_w = ca_lens_length(&r->lens);
    r->film_w = r->last_w + r->film_distance;
    r->pupil_radius = axial_radius(r);
    r->solid_angle = axial_solid_angle(r);
}

double ca_realistic_solid_angle(const ca_realistic *camera)
{
    ca_realistic r = *camera;
    prepare_axis(&r);
    return r.solid_angle;
}

bool ca_realistic_is_dark(const ca_realistic *camera, uint32_t *surface, ca_lens_end *end)
{
    ca_realistic r = *camera;
    prepare_axis(&r);
    const double least = 1e-5 * reach(&r, 0.0);
    if (r.pupil_radius > least) return false;
    ca_lens_ray ray = {.w = r.film_w};
    set_direction(least, 0.0, -r.film_distance, &ray);
    *end = ca_lens_trace_to_end(&r.lens, &ray, surface);
    return *end != CA_LENS_PASSED;
}

void ca_realistic_prepare(ca_camera *camera)
{
    enum { MARGIN = 4 }; /* in pixels, beyond the film's corners, for filters */
    ca_realistic *r = &camera->as.realistic;
    prepare_axis(r);
    const double pixel = hypot((double)camera->pixel_width, (double)camera->pixel_height);
    r->ring_width = (0.5 * r->film_diagonal + MARGIN * pixel) / CA_PUPIL_RINGS;
    ray_bundle bundle = {{0}};
    ca_pupil_box inner = bound_pupil(r, 0.0, FINEST_GRID, &bundle);
    for (int i = 0; i < CA_PUPIL_RINGS; i++) {
        /* Beyond the picture's rim nobody looks closely. */
        const int finest = box_area(&inner) > 0.0 ? FINEST_GRID : GRID;
        const ca_pupil_box outer = bound_pupil(r, (i + 1) * r->ring_width, finest, &bundle);
        r->rings[i] =
            (ca_pupil_box){fmin(inner.low, outer.low), fmax(inner.high, outer.high), fmax(inner.side, outer.side)};
        inner = outer;
    }
    choose_disk(r, &bundle);
}

/* ---- Rays ------------------------------------------------------------------------------------------------------ */

static ca_vec3 to_world_direction(const ca_camera *camera, const ca_lens_ray *ray)
{
    return ca_normalize(ca_map_vector(camera->map.to, (ca_vec3){(float)ray->dx, (float)ray->dy, (float)-ray->dw}));
}

static ca_vec3 to_world_point(const ca_camera *camera, const ca_lens_ray *ray)
{
    const double scale = camera->as.realistic.scale;
    return ca_map_point(camera->map.to,
                        (ca_vec3){(float)(scale * ray->x), (float)(scale * ray->y), (float)(-scale * ray->w)});
}

/* false: absorbed. */
static bool choose_ray(const ca_camera *camera, ca_vec2 film_position, ca_vec2 u, lens_way *way)
{
    const ca_realistic *r = &camera->as.realistic;
    film_to_lens(camera, film_position, &way->film_x, &way->film_y);
    const double radius = hypot(way->film_x, way->film_y);
    const ca_pupil_box *box = box_at(r, radius);
    if (!(box_area(box) > 0.0)) return false;
    const double along = box->low + (double)u.x * (box->high - box->low);
    const double across = box->side * (2.0 * (double)u.y - 1.0);
    const double c = radius > 0.0 ? way->film_x / radius : 1.0, s = radius > 0.0 ? way->film_y / radius : 0.0;
    way->pupil_x = c * along - s * across;
    way->pupil_y = s * along + c * across;
    if (!trace_from_film(r, way->film_x, way->film_y, way->pupil_x, way->pupil_y, &way->scene)) return false;
    way->cos_film = r->film_distance / sqrt((way->pupil_x - way->film_x) * (way->pupil_x - way->film_x) +
                                            (way->pupil_y - way->film_y) * (way->pupil_y - way->film_y) +
                                            r->film_distance * r->film_distance);
    move_to(r->disk_w, &way->scene);
    return is_in_disk(r, way->scene.x, way->scene.y);
}

ca_camera_ray ca_realistic_ray(const ca_camera *camera, ca_vec2 film_position, ca_vec2 u_lens)
{
    const ca_realistic *r = &camera->as.realistic;
    lens_way way;
    if (!choose_ray(camera, film_position, u_lens, &way)) return (ca_camera_ray){.camera = camera};
    const float cos_camera = (float)-way.scene.dw, behind = (float)(r->scale * r->disk_w);
    const float weight = (float)(chosen_solid_angle(r, &way) / r->solid_angle);
    return (ca_camera_ray){.origin = to_world_point(camera, &way.scene),
                           .direction = to_world_direction(camera, &way.scene),
                           .t_min = (camera->near_clip + behind) / cos_camera,
                           .t_max = (camera->far_clip + behind) / cos_camera,
                           .weight = {weight, weight, weight},
                           .pdf_position = position_pdf(r),
                           .pdf_direction = direction_pdf(camera, &way),
                           .cos_camera = cos_camera,
                           .camera = camera};
}

/* ---- Splats ---------------------------------------------------------------------------------------------------- */

/* Would choose_ray choose it? */
static bool is_chosen(const ca_realistic *r, const lens_way *way)
{
    const double radius = hypot(way->film_x, way->film_y);
    const ca_pupil_box *box = box_at(r, radius);
    const double c = radius > 0.0 ? way->film_x / radius : 1.0, s = radius > 0.0 ? way->film_y / radius : 0.0;
    const double along = c * way->pupil_x + s * way->pupil_y, across = c * way->pupil_y - s * way->pupil_x;
    return along >= box->low && along <= box->high && fabs(across) <= box->side;
}

/* From a point of the scene through one of the entrance disk to the film; false: absorbed. */
static bool find_way(const ca_realistic *r, ca_lens_ray from, double disk_x, double disk_y, lens_way *way)
{
    set_direction(disk_x - from.x, disk_y - from.y, r->disk_w - from.w, &from);
    ca_lens_ray ray = from;
    if (!ca_lens_trace(&r->lens, &ray)) return false;
    const double last_surface = ray.w;
    way->cos_film = ray.dw;
    move_to(r->last_w, &ray);
    way->pupil_x = ray.x, way->pupil_y = ray.y;
    move_to(r->film_w, &ray);
    way->film_x = ray.x, way->film_y = ray.y;
    way->scene = (ca_lens_ray){disk_x, disk_y, r->disk_w, -from.dx, -from.dy, -from.dw};
    return last_surface < r->film_w && is_chosen(r, way);
}

bool ca_realistic_direct(const ca_camera *camera, ca_vec3 local, ca_vec2 u_lens, ca_camera_direct *direct)
{
    const ca_realistic *r = &camera->as.realistic;
    const ca_vec2 disk = ca_warp_disk(u_lens);
    const double x = r->disk_radius * (double)disk.x, y = r->disk_radius * (double)disk.y;
    const ca_lens_ray from = {
        .x = (double)local.x / r->scale, .y = (double)local.y / r->scale, .w = -(double)local.z / r->scale};
    lens_way way;
    if (!find_way(r, from, x, y, &way)) return false;
    const ca_pdf_area pdf_position = position_pdf(r);
    const double depth = r->disk_w - from.w, cos_camera = -way.scene.dw;
    const float distance = (float)(r->scale * depth / cos_camera);
    *direct =
        (ca_camera_direct){.position = to_world_point(camera, &way.scene),
                           .to_camera = ca_neg(to_world_direction(camera, &way.scene)),
                           .distance = distance,
                           .t_near = distance * (float)((double)(local.z - camera->near_clip) / (r->scale * depth)),
                           .film_position = lens_to_film(camera, way.film_x, way.film_y),
                           .importance = (float)(1.0 / (pixel_area(camera) * r->solid_angle * r->scale * r->scale)),
                           .pdf_direct = ca_pdf_to_solid_angle(pdf_position, (float)cos_camera, ca_sqr(distance)),
                           .pdf_position = pdf_position,
                           .pdf_direction = direction_pdf(camera, &way),
                           .cos_camera = (float)cos_camera,
                           .camera = camera};
    return true;
}
