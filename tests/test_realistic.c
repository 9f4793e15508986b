/* The realistic camera: its lens against a second ray tracer, the lens equation and what is known of plates of glass;
 * its rays and splats as inverses of each other with the densities that they have; its picture against brute
 * force. */
#include "camera/camera.h"

#include "geometry/shape.h"
#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/lens_oracle.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static const char *const names[ORACLE_LENSES] = {"biconvex lens", "doublet", "triplet"};

static double uniform(ca_test_random *random, double low, double high)
{
    return low + (high - low) * (double)ca_test_random_float(random);
}

/* ---- The lens -------------------------------------------------------------------------------------------------- */

/* Both tracers, from either side: the same point and direction, and the same answer whether there are any. */
static void test_trace(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(1);
    for (int which = 0; which < ORACLE_LENSES; which++) {
        const ca_lens lens = lens_oracle_make(which);
        const double length = ca_lens_length(&lens);
        uint32_t passed = 0, rays = 20000;
        for (uint32_t i = 0; i < rays; i++) {
            const bool from_film = i % 2 == 0;
            const double away = from_film ? -1.0 : 1.0;
            ca_lens_ray ray = {.x = uniform(&random, -13.0, 13.0),
                               .y = uniform(&random, -13.0, 13.0),
                               .w = from_film ? length + 20.0 : -20.0};
            const double_vec direction =
                dv_unit((double_vec){uniform(&random, -0.8, 0.8), uniform(&random, -0.8, 0.8), -away});
            ray.dx = direction.x, ray.dy = direction.y, ray.dw = -direction.z;
            oracle_ray oracle = {{ray.x, ray.y, -ray.w}, direction};
            const ca_lens_ray start = ray;
            const bool passes = lens_oracle_trace(&lens, &oracle);
            assert_int_equal(ca_lens_trace(&lens, &ray), passes);
            if (!passes) continue;
            passed++;
            assert_true(hypot(ray.x - oracle.position.x, ray.y - oracle.position.y) < 1e-9);
            assert_true(fabs(ray.w + oracle.position.z) < 1e-9);
            assert_true(hypot(ray.dx - oracle.direction.x, ray.dy - oracle.direction.y) < 1e-12);
            /* Sent back, it comes out where it began. */
            ray.dx = -ray.dx, ray.dy = -ray.dy, ray.dw = -ray.dw;
            ray.w -= ray.dw, ray.x -= ray.dx, ray.y -= ray.dy; /* from before the surface */
            assert_true(ca_lens_trace(&lens, &ray));
            assert_true(fabs(ray.dx + start.dx) < 1e-12 && fabs(ray.dy + start.dy) < 1e-12);
        }
        print_message("           %s: %u of %u rays pass\n", names[which], passed, rays);
        assert_true(passed > rays / 100);
    }
}

/* Outside of where its surfaces cut each other a lens has no glass, and light ends there. */
static void test_sharp_edge(void **state)
{
    (void)state;
    const ca_lens lens = {.surfaces = {{30.0, 2.0, 1.5, 14.0}, {-30.0, 0.0, 1.0, 14.0}}, .count = 2};
    for (double height = 0.5; height < 14.0; height += 1.0)
        for (int side = -1; side <= 1; side += 2) {
            ca_lens_ray ray = {.x = height, .w = 1.0 - side * 20.0, .dw = side};
            const bool thick = 30.0 - sqrt(900.0 - height * height) < 1.0;
            assert_int_equal(ca_lens_trace(&lens, &ray), thick);
        }
}

/* Of a thick lens the lensmaker's equation with its principal planes, 1 / s' = 1 / f + 1 / s from these; of a doublet
 * the same with the two thin lenses' powers, as far as it is thin. */
static void test_lens_equation(void **state)
{
    (void)state;
    const double n = 1.52, r = 103.0, d = 6.0;
    const ca_lens lens = lens_oracle_make(ORACLE_SINGLET);
    const double power = (n - 1.0) * (2.0 / r - (n - 1.0) * d / (n * r * r)), f = 1.0 / power;
    assert_true(fabs(ca_lens_focal_length(&lens) - f) < 1e-9);
    const double plane = f * (n - 1.0) * d / (n * r); /* of the principal planes, from the vertices inwards */
    for (double distance = 150.0; distance < 1e6; distance *= 3.0) {
        const double object = distance + plane, image = 1.0 / (power - 1.0 / object);
        const ca_lens_image found = ca_lens_image_of(&lens, distance);
        assert_true(fabs(found.distance - (image - plane)) < 1e-8 * image);
        assert_true(fabs(found.magnification + image / object) < 1e-10);
    }
    const ca_lens_image far = ca_lens_image_of(&lens, (double)INFINITY);
    assert_true(fabs(far.distance - (f - plane)) < 1e-9 && far.magnification == 0.0);

    /* Squeezed, the doublet is three thin surfaces in contact. */
    ca_lens doublet = lens_oracle_make(ORACLE_DOUBLET);
    for (uint32_t i = 0; i < doublet.count; i++) doublet.surfaces[i].thickness = 1e-9;
    const double powers = 0.517 / 61.0 + (1.62 - 1.517) / -45.0 + (1.0 - 1.62) / -131.0;
    assert_true(fabs(ca_lens_focal_length(&doublet) * powers - 1.0) < 1e-7);
    assert_true(fabs(ca_lens_image_of(&doublet, 300.0).distance * (powers - 1.0 / 300.0) - 1.0) < 1e-7);
}

/* A plate shifts a ray to the side by d sin a (1 - cos a / (n cos b)) and leaves its direction. */
static void test_plate(void **state)
{
    (void)state;
    const double n = 1.6, d = 10.0;
    const ca_lens plate = {.surfaces = {{0.0, d, n, 50.0}, {0.0, 0.0, 1.0, 50.0}}, .count = 2};
    assert_true(isinf(ca_lens_focal_length(&plate)));
    for (double degrees = 5.0; degrees < 70.0; degrees += 10.0) {
        const double a = degrees * CA_PI_D / 180.0, b = asin(sin(a) / n);
        ca_lens_ray ray = {.x = -3.0, .w = -5.0, .dx = sin(a), .dw = cos(a)};
        assert_true(ca_lens_trace(&plate, &ray));
        assert_true(fabs(ray.dx - sin(a)) < 1e-15 && fabs(ray.dw - cos(a)) < 1e-15);
        const double shift = (ray.x + 3.0) * cos(a) - (ray.w + 5.0) * sin(a);
        assert_true(fabs(shift + d * sin(a) * (1.0 - cos(a) / (n * cos(b)))) < 1e-12);
    }
}

/* ---- Cameras --------------------------------------------------------------------------------------------------- */

enum { WIDTH = 12, HEIGHT = 8, PIXELS = WIDTH * HEIGHT };
static const double scale = 0.01; /* of the scene for a mm */

static ca_camera make(const ca_lens *lens, double film_distance, double film_diagonal)
{
    const double origin[3] = {1.0, -2.0, 0.5}, target[3] = {1.3, -1.8, 2.5}, up[3] = {0.2, 1.0, 0.1};
    ca_matrix view;
    ca_camera camera = {
        .kind = CA_CAMERA_REALISTIC,
        .width = WIDTH,
        .height = HEIGHT,
        .near_clip = 0.01f,
        .far_clip = 1000.0f,
        .as.realistic = {
            .lens = *lens, .film_distance = film_distance, .film_diagonal = film_diagonal, .scale = scale}};
    assert_true(ca_matrix_look_at(origin, target, up, &view));
    assert_true(ca_affine_from_matrix(&view, &camera.map));
    ca_camera_prepare(&camera);
    return camera;
}

/* Focused on what is 3 in front of it. */
static ca_camera make_camera(int which)
{
    const ca_lens lens = lens_oracle_make(which);
    return make(&lens, ca_lens_image_of(&lens, 3.0 / scale).distance, which == ORACLE_TRIPLET ? 38.0 : 50.0);
}

static ca_vec2 random2(ca_test_random *random)
{
    const float x = ca_test_random_float(random);
    return (ca_vec2){x, ca_test_random_float(random)};
}

static ca_vec2 random_film(ca_test_random *random)
{
    const ca_vec2 u = random2(random);
    return (ca_vec2){u.x * WIDTH, u.y * HEIGHT};
}

static bool is_blocked(const ca_camera_ray *ray) { return ca_rgb_is_black(ray->weight); }

/* The numbers that ca_warp_disk takes to the point of the entrance disk (Shirley and Chiu 1997). */
static ca_vec2 disk_numbers(const ca_camera *camera, ca_vec3 world)
{
    const ca_realistic *r = &camera->as.realistic;
    const ca_vec3 p = ca_map_point(camera->map.from, world);
    const double x = (double)p.x / (r->scale * r->disk_radius), y = (double)p.y / (r->scale * r->disk_radius);
    const double radius = hypot(x, y), quarter = CA_PI_D / 4.0;
    double a, b;
    if (fabs(x) > fabs(y)) {
        a = copysign(radius, x);
        b = a * atan(y / x) / quarter;
    } else {
        b = copysign(radius, y);
        a = b * atan(x / y) / quarter;
    }
    return (ca_vec2){(float)(0.5 * (a + 1.0)), (float)(0.5 * (b + 1.0))};
}

/* A ray's point is splat to where the ray came from, through the same point of the entrance disk, with the ray's
 * densities; and the film's point and the density are the oracle's. */
static void check_ray(const ca_camera *camera, ca_vec2 film, const ca_camera_ray *ray, float t)
{
    ca_camera_direct direct;
    const ca_vec2 u = disk_numbers(camera, ray->origin);
    assert_true(ca_camera_sample_direct(camera, ca_madd(ray->origin, t, ray->direction), u, 0.02f, &direct));
    assert_true(hypotf(direct.film_position.x - film.x, direct.film_position.y - film.y) < 2e-3f);
    assert_true(fabsf(direct.pdf_position.v / ray->pdf_position.v - 1.0f) < 1e-5f);
    assert_true(fabsf(direct.pdf_direction.v / ray->pdf_direction.v - 1.0f) < 1e-3f);
    assert_true(fabsf(direct.distance / t - 1.0f) < 1e-4f);
    assert_true(ca_length(ca_sub(direct.position, ray->origin)) < 1e-5f);
    assert_true(fabsf((t - direct.t_near) - ray->t_min) < 1e-4f);
    /* We cos = weight times both densities */
    const float importance = ray->weight.r * ray->pdf_position.v * ray->pdf_direction.v / ray->cos_camera;
    assert_true(fabsf(direct.importance / importance - 1.0f) < 1e-3f);

    double_vec film_point, pupil;
    const double_vec origin = dv_from(ray->origin), direction = dv_from(ray->direction);
    const double density = (double)ray->pdf_position.v * (double)ray->pdf_direction.v;
    assert_true(fabs(lens_oracle_density(camera, origin, direction) / density - 1.0) < 2e-3);
    if (!lens_oracle_film_point(camera, origin, direction, &film_point, &pupil)) return; /* at a rim */
    const double x = (double)film.x * (double)camera->pixel_width - (double)camera->left;
    const double y = (double)film.y * (double)camera->pixel_height - (double)camera->top;
    assert_true(hypot(film_point.x - x, film_point.y - y) < 1e-4 * (double)camera->pixel_width);
}

static void test_round_trip(void **state)
{
    (void)state;
    for (int which = 0; which < ORACLE_LENSES; which++) {
        const ca_camera camera = make_camera(which);
        ca_test_random random = ca_test_random_seed((uint64_t)which);
        uint32_t rays = 0, missed = 0;
        for (int i = 0; i < 6000; i++) {
            const ca_vec2 film = random_film(&random), u = random2(&random);
            const ca_camera_ray ray = ca_camera_sample_ray(&camera, film, u);
            if (is_blocked(&ray)) continue;
            const float t = ray.t_min + 0.5f + 20.0f * ca_test_random_float(&random);
            ca_camera_direct direct;
            const ca_vec2 disk = disk_numbers(&camera, ray.origin);
            const ca_vec3 point = ca_madd(ray.origin, t, ray.direction);
            /* At the rims rounding decides. */
            missed += !ca_camera_sample_direct(&camera, point, disk, 0.02f, &direct);
            rays++;
            if (ca_camera_sample_direct(&camera, point, disk, 0.02f, &direct)) check_ray(&camera, film, &ray, t);
        }
        print_message("           %s: %u of %u rays not found again\n", names[which], missed, rays);
        assert_true(rays > 2000 && missed <= rays / 500);
    }
}

static void test_kind(void **state)
{
    (void)state;
    const ca_camera camera = make_camera(ORACLE_TRIPLET);
    assert_true(ca_camera_has_lens(&camera) && !ca_camera_has_field_of_view(&camera));
    assert_false(ca_camera_has_dirac_position(&camera) || ca_camera_has_dirac_direction(&camera));
    /* The picture is upright: its left half sees the camera's +x, its upper half +y. */
    const ca_vec2 u = {0.5f, 0.5f};
    const ca_vec3 left = ca_camera_sample_ray(&camera, (ca_vec2){1.0f, 4.0f}, u).direction;
    const ca_vec3 top = ca_camera_sample_ray(&camera, (ca_vec2){6.0f, 1.0f}, u).direction;
    assert_true(ca_map_vector(camera.map.from, left).x > 0.1f);
    assert_true(ca_map_vector(camera.map.from, top).y > 0.1f);
}

static void test_clip_planes(void **state)
{
    (void)state;
    ca_camera camera = make_camera(ORACLE_TRIPLET);
    camera.near_clip = 1.0f;
    camera.far_clip = 5.0f;
    const ca_camera_ray ray = ca_camera_sample_ray(&camera, (ca_vec2){5.0f, 3.0f}, (ca_vec2){0.45f, 0.55f});
    const ca_vec2 u = disk_numbers(&camera, ray.origin);
    for (int i = 0; i < 4; i++) {
        const float t =
            (const float[4]){0.999f * ray.t_min, 1.001f * ray.t_min, 0.999f * ray.t_max, 1.001f * ray.t_max}[i];
        const ca_vec3 point = ca_madd(ray.origin, t, ray.direction);
        const ca_camera *c = &camera;
        const float z = ca_map_point(c->map.from, point).z;
        assert_int_equal(z > 1.0f && z < 5.0f, i == 1 || i == 2);
        ca_camera_direct direct;
        assert_int_equal(ca_camera_sample_direct(&camera, point, u, 0.0f, &direct), i == 1 || i == 2);
    }
    ca_camera_direct direct;
    const ca_camera_ray outside = ca_camera_sample_ray(&camera, (ca_vec2){-0.5f, 3.0f}, (ca_vec2){0.45f, 0.55f});
    const ca_vec3 reference = ca_madd(outside.origin, 2.0f, outside.direction);
    const ca_vec2 there = disk_numbers(&camera, outside.origin);
    assert_false(is_blocked(&outside));
    assert_false(ca_camera_sample_direct(&camera, reference, there, 0.4f, &direct));
    assert_true(ca_camera_sample_direct(&camera, reference, there, 0.6f, &direct));
}

/* The entrance disk is little wider than the entrance pupil, f / N, which all rays of the triplet pass, and lies near
 * it; what it cuts off, and the boxes of the exit pupil, is next to nothing. */
static void test_entrance_disk(void **state)
{
    (void)state;
    const ca_camera camera = make_camera(ORACLE_TRIPLET);
    const ca_realistic *r = &camera.as.realistic;
    print_message("           radius %.3f mm at %.2f mm\n", r->disk_radius, r->disk_w);
    assert_true(r->disk_radius > 7.81 && r->disk_radius < 1.2 * 7.81);
    assert_true(fabs(r->disk_w - 13.7) < 3.0);
    ca_test_random random = ca_test_random_seed(9);
    uint32_t passed = 0, lost = 0;
    for (int i = 0; i < 200000; i++) {
        const double x = uniform(&random, -16.0, 16.0), y = uniform(&random, -10.0, 10.0);
        const double_vec pupil = {uniform(&random, -9.0, 9.0), uniform(&random, -9.0, 9.0), -r->last_w};
        const double_vec film = {x, y, -r->film_w};
        oracle_ray ray = {film, dv_unit(dv_sub(pupil, film))};
        if (!lens_oracle_trace(&r->lens, &ray)) continue;
        const double_vec on_disk =
            dv_madd(ray.position, (-r->disk_w - ray.position.z) / ray.direction.z, ray.direction);
        const double radius = hypot(x, y), along = (x * pupil.x + y * pupil.y) / radius;
        const double across = (x * pupil.y - y * pupil.x) / radius;
        const ca_pupil_box *box = &r->rings[(int)fmin(radius / r->ring_width, CA_PUPIL_RINGS - 1)];
        passed++;
        lost += hypot(on_disk.x, on_disk.y) > r->disk_radius || along < box->low || along > box->high ||
                fabs(across) > box->side;
    }
    print_message("           %u of %u rays lost\n", lost, passed);
    assert_true(passed > 50000 && lost == 0);
}

/* ---- Where cameras look ---------------------------------------------------------------------------------------- */

/* All rays of a film point that pass near the axis of a lens stopped down meet where the lens equation says: at the
 * distance in focus, its height divided by the magnification. */
static void test_focus(void **state)
{
    (void)state;
    for (int which = 0; which < ORACLE_LENSES; which++) {
        ca_lens lens = lens_oracle_make(which);
        const double distance = 3.0 / scale;
        const ca_lens_image image = ca_lens_image_of(&lens, distance);
        for (uint32_t i = 0; i < lens.count; i++) lens.surfaces[i].aperture *= 0.04;
        const ca_camera camera = make(&lens, image.distance, 1.0);
        const ca_vec2 film = {2.5f, 1.5f}; /* within half a mm of the axis */
        ca_test_random random = ca_test_random_seed(3);
        const double x = ((double)camera.left - (double)film.x * (double)camera.pixel_width) / -image.magnification;
        uint32_t rays = 0;
        for (int i = 0; i < 200; i++) {
            const ca_camera_ray ray = ca_camera_sample_ray(&camera, film, random2(&random));
            if (is_blocked(&ray)) continue;
            const ca_vec3 p = ca_map_point(camera.map.from, ray.origin);
            const ca_vec3 d = ca_map_vector(camera.map.from, ray.direction);
            const double found = (double)p.x + (3.0 - (double)p.z) / (double)d.z * (double)d.x;
            rays++;
            assert_true(fabs(found / (x * scale) - 1.0) < 2e-3);
        }
        assert_true(rays > 50);
    }
}

/* A pinhole behind a plate of glass: rays start as a pinhole camera's, and end beside them by the plate's shift. */
static void test_plate_camera(void **state)
{
    (void)state;
    const double n = 1.5, d = 8.0, far = 20.0;
    const ca_lens plate = {.surfaces = {{0.0, d, n, 40.0}, {0.0, 1.0, 1.0, 40.0}, {0.0, 0.0, 1.0, 0.001}},
                           .count = 3};
    const ca_camera camera = make(&plate, far, 20.0);
    for (float x = 0.5f; x < WIDTH; x += 1.0f) {
        const ca_vec2 film = {x, 2.5f};
        const ca_camera_ray ray = ca_camera_sample_ray(&camera, film, (ca_vec2){0.5f, 0.5f});
        const ca_vec3 p = ca_map_point(camera.map.from, ray.origin);
        const ca_vec3 v = ca_map_vector(camera.map.from, ray.direction);
        const double sx = ((double)camera.left - (double)x * (double)camera.pixel_width) / far;
        const double sy = ((double)camera.top - 2.5 * (double)camera.pixel_height) / far;
        assert_true(fabs((double)(v.x / v.z) - sx) < 1e-5 && fabs((double)(v.y / v.z) - sy) < 1e-5);
        /* At the front of the plate, d + 1 in front of the pinhole: a plate is as thick as d tan b / tan a. */
        const double tan_a = hypot(sx, sy), sin_a = tan_a / sqrt(1.0 + tan_a * tan_a);
        const double tan_b = sin_a / n / sqrt(1.0 - sin_a * sin_a / n / n);
        const double front = (double)(p.x - p.z / v.z * v.x) / scale;
        assert_true(fabs(front - sx * (1.0 + d * tan_b / tan_a)) < 2e-3);
    }
}

/* ---- Brightness ------------------------------------------------------------------------------------------------ */

/* What the camera makes of light of radiance 1 from everywhere, at a film position. */
static double brightness(const ca_camera *camera, ca_vec2 film, uint32_t side)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < side * side; i++) {
        const ca_vec2 u = {((float)(i % side) + 0.5f) / (float)side, ((float)(i / side) + 0.5f) / (float)side};
        sum += (double)ca_camera_sample_ray(camera, film, u).weight.r;
    }
    return sum / (side * side);
}

/* A small hole alone: the fourth power of the cosine. */
static void test_cosine_law(void **state)
{
    (void)state;
    const ca_lens hole = {.surfaces = {{0.0, 0.0, 1.0, 0.05}}, .count = 1};
    const ca_camera camera = make(&hole, 20.0, 40.0);
    for (float x = 6.0f; x >= 0.0f; x -= 1.5f) {
        const double across = (double)camera.left - (double)x * (double)camera.pixel_width;
        const double cos2 = 400.0 / (400.0 + across * across);
        assert_true(fabs(brightness(&camera, (ca_vec2){x, 4.0f}, 200) / (cos2 * cos2) - 1.0) < 5e-3);
    }
}

/* Vignetting: what brute force finds from the centre to the corners, over what it finds in the centre. */
static void test_vignetting(void **state)
{
    (void)state;
    for (int which = 0; which < ORACLE_LENSES; which++) {
        const ca_camera camera = make_camera(which);
        const ca_realistic *r = &camera.as.realistic;
        const double axis = lens_oracle_solid_angle(r, 0.0, 500);
        assert_true(fabs(axis / r->solid_angle - 1.0) < 5e-3);
        for (float part = 0.0f; part <= 1.0f; part += 0.25f) {
            const ca_vec2 film = {6.0f - 6.0f * part, 4.0f - 4.0f * part}; /* on the diagonal */
            const double found = brightness(&camera, film, 300);
            const double expected = lens_oracle_solid_angle(r, 0.5 * (double)part * r->film_diagonal, 500) / axis;
            print_message("           %s: at %2.0f %% of the diagonal %.4f, traced %.4f\n", names[which],
                          100.0 * (double)part, found, expected);
            assert_true(fabs(found - expected) < 6e-3 * expected + 1e-4);
        }
    }
}

/* ---- Densities ------------------------------------------------------------------------------------------------- */

/* Rays of one pixel, counted by where they pass two squares across the axis: of the entrance disk and of a plane in
 * front, four by four parts each. Expected: the density, integrated over random rays between the squares. */
enum { SIDE = 4, BINS = SIDE * SIDE * SIDE * SIDE };

typedef struct two_squares {
    double disk_half, front_x, front_y, front_half, front_z; /* camera space */
} two_squares;

static uint32_t part_of(double value, double center, double half)
{
    const double t = (value - center + half) / (2.0 * half) * SIDE;
    return t >= 0.0 && t < SIDE ? (uint32_t)t : CA_NONE;
}

static uint32_t bin_of(const two_squares *s, const ca_camera *camera, ca_vec3 origin, ca_vec3 direction)
{
    const ca_vec3 p = ca_map_point(camera->map.from, origin), d = ca_map_vector(camera->map.from, direction);
    const double t = (s->front_z - (double)p.z) / (double)d.z;
    const uint32_t i = part_of((double)p.x, 0.0, s->disk_half), j = part_of((double)p.y, 0.0, s->disk_half);
    const uint32_t k = part_of((double)p.x + t * (double)d.x, s->front_x, s->front_half);
    const uint32_t l = part_of((double)p.y + t * (double)d.y, s->front_y, s->front_half);
    if (i == CA_NONE || j == CA_NONE || k == CA_NONE || l == CA_NONE) return CA_NONE;
    return ((i * SIDE + j) * SIDE + k) * SIDE + l;
}

static two_squares squares_of(const ca_camera *camera, ca_vec2 pixel)
{
    ca_test_random random = ca_test_random_seed(11);
    two_squares s = {.disk_half = camera->as.realistic.disk_radius * scale, .front_z = 2.0};
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (int i = 0; i < 2000; i++) {
        const ca_vec2 u = random2(&random), lens = random2(&random);
        const ca_camera_ray ray = ca_camera_sample_ray(camera, (ca_vec2){pixel.x + u.x, pixel.y + u.y}, lens);
        if (is_blocked(&ray)) continue;
        const ca_vec3 p = ca_map_point(camera->map.from, ray.origin);
        const ca_vec3 d = ca_map_vector(camera->map.from, ray.direction);
        const double t = (s.front_z - (double)p.z) / (double)d.z;
        const double at[2] = {(double)p.x + t * (double)d.x, (double)p.y + t * (double)d.y};
        for (int k = 0; k < 2; k++) low[k] = fmin(low[k], at[k]), high[k] = fmax(high[k], at[k]);
    }
    s.front_x = 0.5 * (low[0] + high[0]);
    s.front_y = 0.5 * (low[1] + high[1]);
    s.front_half = 0.6 * fmax(high[0] - low[0], high[1] - low[1]);
    return s;
}

static void count_rays(const ca_camera *camera, ca_vec2 pixel, const two_squares *s, int rays, double *observed)
{
    ca_test_random random = ca_test_random_seed(12);
    for (int i = 0; i < rays; i++) {
        const ca_vec2 u = random2(&random), lens = random2(&random);
        const ca_camera_ray ray = ca_camera_sample_ray(camera, (ca_vec2){pixel.x + u.x, pixel.y + u.y}, lens);
        const uint32_t bin = is_blocked(&ray) ? CA_NONE : bin_of(s, camera, ray.origin, ray.direction);
        observed[bin == CA_NONE ? BINS : bin] += 1.0;
    }
}

/* Multiples of the powers of the root of x^5 = x + 1: evenly spread in four dimensions. */
static double spread(int i, int axis) { return fmod(0.5 + (i + 1) * pow(1.16730397826141868, -(axis + 1)), 1.0); }

/* The share of the pixel's rays in each bin, by the densities that splats have. */
static void integrate_density(const ca_camera *camera, ca_vec2 pixel, const two_squares *s, int splats,
                              double *expected)
{
    const double areas = CA_PI_D * s->disk_half * s->disk_half * 4.0 * s->front_half * s->front_half;
    expected[BINS] = 1.0;
    for (int i = 0; i < splats; i++) {
        const ca_vec2 u = {(float)spread(i, 0), (float)spread(i, 1)};
        const ca_vec3 front = {(float)(s->front_x + s->front_half * (2.0 * spread(i, 2) - 1.0)),
                               (float)(s->front_y + s->front_half * (2.0 * spread(i, 3) - 1.0)), (float)s->front_z};
        ca_camera_direct direct;
        const ca_vec3 world = ca_map_point(camera->map.to, front);
        if (!ca_camera_sample_direct(camera, world, u, 0.0f, &direct)) continue;
        if (floorf(direct.film_position.x) != pixel.x || floorf(direct.film_position.y) != pixel.y) continue;
        const uint32_t bin = bin_of(s, camera, direct.position, ca_neg(direct.to_camera));
        const double geometry = (double)direct.cos_camera / (double)ca_sqr(direct.distance);
        const double share =
            (double)direct.pdf_position.v * (double)direct.pdf_direction.v * geometry * areas / splats;
        if (bin != CA_NONE) expected[bin] += share;
        expected[BINS] -= share;
    }
}

static void check_densities(const ca_camera *camera, ca_vec2 pixel, const char *name)
{
    enum { RAYS = 30000, SPLATS = 300000 };
    double observed[BINS + 1] = {0}, expected[BINS + 1] = {0};
    const two_squares s = squares_of(camera, pixel);
    count_rays(camera, pixel, &s, RAYS, observed);
    integrate_density(camera, pixel, &s, SPLATS, expected);
    for (int i = 0; i <= BINS; i++) expected[i] *= RAYS;
    double statistic;
    uint32_t degrees;
    const double p = ca_chi_square_counts(observed, expected, BINS + 1, &statistic, &degrees);
    print_message("           %s: p %.3g, %u degrees of freedom, blocked %.1f %%, by density %.1f %%\n", name, p,
                  degrees, 100.0 * observed[BINS] / RAYS, 100.0 * expected[BINS] / RAYS);
    assert_true(degrees > 20);
    assert_true(p > ca_sidak_level(0.01, 2 * ORACLE_LENSES));
}

static void test_densities(void **state)
{
    (void)state;
    for (int which = 0; which < ORACLE_LENSES; which++) {
        const ca_camera camera = make_camera(which);
        check_densities(&camera, (ca_vec2){5.0f, 4.0f}, names[which]);
        check_densities(&camera, (ca_vec2){1.0f, 1.0f}, names[which]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_trace),         cmocka_unit_test(test_sharp_edge),
        cmocka_unit_test(test_lens_equation), cmocka_unit_test(test_plate),
        cmocka_unit_test(test_round_trip),    cmocka_unit_test(test_kind),
        cmocka_unit_test(test_clip_planes),   cmocka_unit_test(test_entrance_disk),
        cmocka_unit_test(test_focus),         cmocka_unit_test(test_plate_camera),
        cmocka_unit_test(test_cosine_law),    cmocka_unit_test(test_vignetting),
        cmocka_unit_test(test_densities),
    };
    return cmocka_run_group_tests_name("realistic camera", tests, NULL, NULL);
}
