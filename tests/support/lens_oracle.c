#include "support/lens_oracle.h"

#define STOP(thickness, index, diameter)                                                                             \
    {                                                                                                                \
        0.0, thickness, index, 0.5 * (diameter)                                                                      \
    }
#define SURFACE(radius, thickness, index, diameter)                                                                  \
    {                                                                                                                \
        radius, thickness, index, 0.5 * (diameter)                                                                   \
    }

ca_lens lens_oracle_make(int which)
{
    static const ca_lens lenses[ORACLE_LENSES] = {
        {.surfaces = {SURFACE(103.0, 6.0, 1.52, 24.0), SURFACE(-103.0, 0.0, 1.0, 24.0)}, .count = 2},
        {.surfaces = {SURFACE(61.0, 6.0, 1.517, 25.0), SURFACE(-45.0, 2.5, 1.62, 25.0),
                      SURFACE(-131.0, 1.5, 1.0, 25.0), STOP(0.0, 1.0, 16.0)},
         .count = 4},
        {.surfaces = {SURFACE(21.06, 6.0, 1.694, 20.0), SURFACE(283.8, 4.22, 1.0, 16.8),
                      SURFACE(-35.52, 1.4, 1.673, 13.0), SURFACE(19.07, 1.0, 1.0, 12.2), STOP(4.89, 1.0, 11.7),
                      SURFACE(63.24, 3.0, 1.694, 15.6), SURFACE(-26.56, 0.0, 1.0, 16.8)},
         .count = 7},
    };
    return lenses[which];
}

/* Where the ray meets the cap around its vertex (0, 0, z): the point on the vertex' side of the sphere where the ray
 * crosses the surface in the sense in which it goes along the axis. */
static bool meet(const ca_lens_surface *surface, double z, oracle_ray *ray, double_vec *normal)
{
    double_vec p = ray->position;
    const double_vec d = ray->direction;
    *normal = (double_vec){0.0, 0.0, 1.0};
    if (surface->radius == 0.0) {
        p = dv_madd(p, (z - p.z) / d.z, d);
    } else {
        const double_vec center = {0.0, 0.0, z - surface->radius};
        const double_vec from = dv_sub(p, center);
        const double b = dv_dot(from, d), c = dv_dot(from, from) - surface->radius * surface->radius;
        if (b * b - c < 0.0) return false;
        const double to_vertex = surface->radius > 0.0 ? 1.0 : -1.0, away = d.z > 0.0 ? 1.0 : -1.0;
        p = dv_madd(p, -b + to_vertex * away * sqrt(b * b - c), d);
        *normal = dv_mul(dv_sub(p, center), 1.0 / surface->radius);
        if (normal->z <= 0.0) return false;
    }
    ray->position = p;
    return hypot(p.x, p.y) <= surface->aperture;
}

/* The angle to the normal changes, the plane of incidence does not. */
static bool bend(double_vec normal, double before, double behind, oracle_ray *ray)
{
    const double_vec d = ray->direction;
    const double_vec along = dv_dot(d, normal) > 0.0 ? normal : dv_mul(normal, -1.0);
    const double_vec across = dv_madd(d, -dv_dot(d, along), along);
    const double sine = dv_length(across), bent = sine * before / behind;
    if (bent >= 1.0) return false;
    ray->direction = dv_mul(along, sqrt(1.0 - bent * bent));
    if (sine > 0.0) ray->direction = dv_madd(ray->direction, bent / sine, across);
    return true;
}

bool lens_oracle_trace(const ca_lens *lens, oracle_ray *ray)
{
    const bool outward = ray->direction.z > 0.0;
    for (uint32_t k = 0; k < lens->count; k++) {
        const uint32_t i = outward ? lens->count - 1 - k : k;
        double z = 0.0;
        for (uint32_t j = 0; j < i; j++) z -= lens->surfaces[j].thickness;
        const double front = i > 0 ? lens->surfaces[i - 1].index : 1.0, back = lens->surfaces[i].index;
        const double_vec from = ray->position;
        double_vec normal;
        if (!meet(&lens->surfaces[i], z, ray, &normal)) return false;
        if (dv_dot(dv_sub(ray->position, from), ray->direction) <= 0.0) return false;
        if (!bend(normal, outward ? back : front, outward ? front : back, ray)) return false;
        if (outward != (ray->direction.z > 0.0)) return false;
    }
    return true;
}

/* ---- The camera ------------------------------------------------------------------------------------------------ */

static double length_of(const ca_lens *lens)
{
    double length = 0.0;
    for (uint32_t i = 0; i + 1 < lens->count; i++) length += lens->surfaces[i].thickness;
    return length;
}

static double_vec to_camera(const ca_camera *camera, double_vec v, bool is_point)
{
    const float(*m)[4] = camera->map.to; /* rigid: the inverse is the transpose */
    const double_vec origin = {(double)m[0][3], (double)m[1][3], (double)m[2][3]};
    const double_vec w = is_point ? dv_sub(v, origin) : v;
    double_vec columns[3];
    for (int i = 0; i < 3; i++) columns[i] = (double_vec){(double)m[0][i], (double)m[1][i], (double)m[2][i]};
    return (double_vec){dv_dot(w, columns[0]), dv_dot(w, columns[1]), dv_dot(w, columns[2])};
}

/* In camera space, mm. */
static bool to_film(const ca_realistic *r, double_vec position, double_vec direction, double_vec *film,
                    double_vec *pupil)
{
    const double last = -length_of(&r->lens);
    /* The ray is followed backwards, from far enough in front of the lens. */
    oracle_ray ray = {.position = dv_madd(position, 1000.0 / direction.z, direction),
                      .direction = dv_unit(dv_mul(direction, -1.0))};
    if (!lens_oracle_trace(&r->lens, &ray)) return false;
    *pupil = dv_madd(ray.position, (last - ray.position.z) / ray.direction.z, ray.direction);
    *film = dv_madd(*pupil, -r->film_distance / ray.direction.z, ray.direction);
    return true;
}

bool lens_oracle_film_point(const ca_camera *camera, double_vec position, double_vec direction, double_vec *film,
                            double_vec *pupil)
{
    const ca_realistic *r = &camera->as.realistic;
    return to_film(r, dv_mul(to_camera(camera, position, true), 1.0 / r->scale), to_camera(camera, direction, false),
                   film, pupil);
}

static double determinant4(double m[4][4])
{
    double det = 1.0;
    for (int i = 0; i < 4; i++) {
        int pivot = i;
        for (int j = i + 1; j < 4; j++)
            if (fabs(m[j][i]) > fabs(m[pivot][i])) pivot = j;
        for (int k = 0; k < 4; k++) {
            const double t = m[i][k];
            m[i][k] = m[pivot][k];
            m[pivot][k] = t;
        }
        det *= m[i][i];
        for (int j = i + 1; j < 4; j++) {
            const double f = m[j][i] / m[i][i];
            for (int k = i; k < 4; k++) m[j][k] -= f * m[i][k];
        }
    }
    return fabs(det);
}

/* d(film, pupil) / d(position across the axis, slopes), by central differences. */
static double stretch(const ca_realistic *r, double_vec position, double_vec direction)
{
    const double steps[4] = {1e-5, 1e-5, 1e-6, 1e-6};
    const double slope[2] = {direction.x / direction.z, direction.y / direction.z};
    double m[4][4];
    for (int i = 0; i < 4; i++) {
        double_vec film[2], pupil[2];
        for (int side = 0; side < 2; side++) {
            const double h = side ? steps[i] : -steps[i];
            const double_vec p = {position.x + (i == 0 ? h : 0.0), position.y + (i == 1 ? h : 0.0), position.z};
            const double_vec d = {slope[0] + (i == 2 ? h : 0.0), slope[1] + (i == 3 ? h : 0.0), 1.0};
            if (!to_film(r, p, dv_unit(d), &film[side], &pupil[side])) return 0.0;
        }
        m[i][0] = (film[1].x - film[0].x) / (2.0 * steps[i]);
        m[i][1] = (film[1].y - film[0].y) / (2.0 * steps[i]);
        m[i][2] = (pupil[1].x - pupil[0].x) / (2.0 * steps[i]);
        m[i][3] = (pupil[1].y - pupil[0].y) / (2.0 * steps[i]);
    }
    return determinant4(m);
}

/* The box that the camera has for a film point is its choice, and is asked of it. */
static double box_area(const ca_realistic *r, double_vec film)
{
    const double ring = fmin(floor(hypot(film.x, film.y) / r->ring_width), CA_PUPIL_RINGS - 1);
    const ca_pupil_box *box = &r->rings[(int)ring];
    return (box->high - box->low) * 2.0 * box->side;
}

/* A ray at a rim has neighbours, too. */
static ca_realistic with_wider_rims(const ca_realistic *camera)
{
    ca_realistic wider = *camera;
    for (uint32_t i = 0; i < wider.lens.count; i++) wider.lens.surfaces[i].aperture *= 1.01;
    return wider;
}

double lens_oracle_density(const ca_camera *camera, double_vec position, double_vec direction)
{
    const ca_realistic wider = with_wider_rims(&camera->as.realistic), *r = &wider;
    const double_vec p = dv_mul(to_camera(camera, position, true), 1.0 / r->scale);
    const double_vec d = to_camera(camera, direction, false);
    double_vec film, pupil;
    if (!to_film(r, p, d, &film, &pupil)) return 0.0;
    const double pixel_area = (double)camera->pixel_width * (double)camera->pixel_height;
    const double slopes_per_solid_angle = 1.0 / (d.z * d.z * d.z);
    return stretch(r, p, d) * slopes_per_solid_angle / (pixel_area * box_area(r, film) * r->scale * r->scale);
}

double lens_oracle_solid_angle(const ca_realistic *camera, double film_x, int size)
{
    const double last = -length_of(&camera->lens);
    const double reach = 2.0 * camera->lens.surfaces[camera->lens.count - 1].aperture, step = 2.0 * reach / size;
    double sum = 0.0;
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++) {
            const double_vec pupil = {-reach + (i + 0.5) * step, -reach + (j + 0.5) * step, last};
            const double_vec film = {film_x, 0.0, last - camera->film_distance};
            const double_vec way = dv_sub(pupil, film);
            oracle_ray ray = {film, dv_unit(way)};
            const double cosine = ray.direction.z;
            if (lens_oracle_trace(&camera->lens, &ray)) sum += cosine * cosine / dv_dot(way, way) * step * step;
        }
    return sum;
}
