/* Cameras: where film positions look, rays and splats as exact inverses with equal densities, and images that are the
 * same whether they are made of rays or of splats. */
#include "camera/camera_lanes.h"

#include "math/numeric.h"
#include "support/chi_square.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

enum { PINHOLE, SHIFTED, LENS, ORTHOGRAPHIC, SHEARED, CAMERAS };
static const char *const names[CAMERAS] = {"perspective", "shifted", "thin lens", "orthographic", "sheared"};

static ca_affine look_at(double x, double y, double z, double scale_x, double scale_y)
{
    const double origin[3] = {x, y, z}, target[3] = {x + 0.3, y + 0.2, z + 2.0}, up[3] = {0.2, 1.0, 0.1};
    ca_matrix view;
    ca_affine map;
    assert_true(ca_matrix_look_at(origin, target, up, &view));
    const ca_matrix scale = ca_matrix_scale(scale_x, scale_y, 1.0);
    const ca_matrix matrix = ca_matrix_multiply(&view, &scale);
    assert_true(ca_affine_from_matrix(&matrix, &map));
    return map;
}

static ca_camera make(int which)
{
    ca_camera camera = {.kind = CA_CAMERA_PERSPECTIVE,
                        .map = look_at(1.0, -2.0, 0.5, 1.0, 1.0),
                        .width = 12,
                        .height = 8,
                        .near_clip = 0.01f,
                        .far_clip = 1000.0f,
                        .as.perspective = {.tan_half_x = 0.8f}};
    switch (which) {
    case SHIFTED:
        camera.principal_x = 0.2f;
        camera.principal_y = -0.1f;
        break;
    case LENS:
        camera.kind = CA_CAMERA_THIN_LENS;
        camera.as.thin_lens.tan_half_x = 0.8f;
        camera.as.thin_lens.lens_radius = 0.25f;
        camera.as.thin_lens.focus_distance = 3.0f;
        break;
    case ORTHOGRAPHIC:
        camera.kind = CA_CAMERA_ORTHOGRAPHIC;
        camera.map = look_at(1.0, -2.0, 0.5, 2.0, 3.0);
        break;
    case SHEARED: { /* a z axis that is not across the film */
        camera.kind = CA_CAMERA_ORTHOGRAPHIC;
        const ca_matrix matrix = {{{1.5, 0, 0.6, 1}, {0.1, 1.2, -0.2, -2}, {0, 0.3, 1.4, 0.5}, {0, 0, 0, 1}}};
        assert_true(ca_affine_from_matrix(&matrix, &camera.map));
        break;
    }
    default: break;
    }
    ca_camera_prepare(&camera);
    return camera;
}

static ca_vec2 random2(ca_test_random *random)
{
    const float x = ca_test_random_float(random);
    return (ca_vec2){x, ca_test_random_float(random)};
}

/* ---- Geometry -------------------------------------------------------------------------------------------------- */

static void test_orientation(void **state)
{
    (void)state;
    ca_camera camera = make(PINHOLE);
    const ca_matrix identity = ca_matrix_identity();
    assert_true(ca_affine_from_matrix(&identity, &camera.map));
    const ca_vec2 u = {0.5f, 0.5f};
    const ca_vec3 corner = ca_camera_sample_ray(&camera, (ca_vec2){0.0f, 0.0f}, u).direction;
    const ca_vec3 middle = ca_camera_sample_ray(&camera, (ca_vec2){6.0f, 4.0f}, u).direction;
    const ca_vec3 right = ca_camera_sample_ray(&camera, (ca_vec2){12.0f, 4.0f}, u).direction;
    assert_true(corner.x > 0.0f && corner.y > 0.0f && corner.z > 0.0f);
    assert_true(fabsf(middle.x) < 1e-6f && fabsf(middle.y) < 1e-6f && fabsf(middle.z - 1.0f) < 1e-6f);
    assert_true(fabsf(right.x / right.z + 0.8f) < 1e-6f);
    assert_true(fabsf(corner.y / corner.z - 0.8f * 8.0f / 12.0f) < 1e-6f);

    /* A positive offset shows more of what is to the right and below, as if film positions were larger by it. */
    camera.principal_x = 0.25f;
    camera.principal_y = 0.5f;
    ca_camera_prepare(&camera);
    const ca_vec3 shifted = ca_camera_sample_ray(&camera, (ca_vec2){3.0f, 0.0f}, u).direction;
    assert_true(ca_length(ca_sub(shifted, middle)) < 1e-6f);

    /* The orthographic film is the square [-1, 1] across in camera space. */
    camera.kind = CA_CAMERA_ORTHOGRAPHIC;
    camera.principal_x = camera.principal_y = 0.0f;
    ca_camera_prepare(&camera);
    const ca_camera_ray ray = ca_camera_sample_ray(&camera, (ca_vec2){0.0f, 8.0f}, u);
    assert_true(ca_length(ca_sub(ray.origin, (ca_vec3){1.0f, -8.0f / 12.0f, 0.0f})) < 1e-6f);
    assert_true(ray.direction.z == 1.0f && ray.t_min == 0.01f);
}

static void test_field_of_view(void **state)
{
    (void)state;
    const double t = tan(0.5 * 50.0 * CA_PI_D / 180.0);
    static const struct {
        ca_fov_axis axis;
        uint32_t width, height;
        double factor;
    } cases[] = {{CA_FOV_X, 400, 300, 1.0},        {CA_FOV_Y, 400, 300, 4.0 / 3.0},
                 {CA_FOV_DIAGONAL, 400, 300, 0.8}, {CA_FOV_SMALLER, 400, 300, 4.0 / 3.0},
                 {CA_FOV_LARGER, 400, 300, 1.0},   {CA_FOV_SMALLER, 300, 400, 1.0},
                 {CA_FOV_LARGER, 300, 400, 0.75}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const double tan_half = ca_camera_tan_half_x(50.0, cases[i].axis, cases[i].width, cases[i].height);
        assert_true(fabs(tan_half - t * cases[i].factor) < 1e-12);
    }
}

/* A ray's point is splat to where the ray came from, with the densities that the ray has. */
static void test_round_trip(void **state)
{
    (void)state;
    for (int which = 0; which < CAMERAS; which++) {
        const ca_camera camera = make(which);
        ca_test_random random = ca_test_random_seed((uint64_t)which);
        for (int i = 0; i < 20000; i++) {
            const ca_vec2 unit = random2(&random), u_lens = random2(&random);
            const ca_vec2 film = {unit.x * 12.0f, unit.y * 8.0f};
            const ca_camera_ray ray = ca_camera_sample_ray(&camera, film, u_lens);
            const float t = 0.5f + 20.0f * ca_test_random_float(&random);
            ca_camera_direct direct;
            assert_true(
                ca_camera_sample_direct(&camera, ca_madd(ray.origin, t, ray.direction), u_lens, 0.01f, &direct));
            assert_true(fabsf(direct.film_position.x - film.x) < 1e-3f &&
                        fabsf(direct.film_position.y - film.y) < 1e-3f);
            assert_true(fabsf(direct.pdf_position.v / ray.pdf_position.v - 1.0f) < 1e-5f);
            assert_true(fabsf(direct.pdf_direction.v / ray.pdf_direction.v - 1.0f) < 2e-5f);
            assert_true(fabsf(direct.cos_camera - ray.cos_camera) < 1e-5f);
            assert_true(fabsf(direct.distance / t - 1.0f) < 1e-5f);
            assert_true(ca_length(ca_sub(direct.position, ray.origin)) < 2e-5f);
            assert_true(ca_length(ca_add(direct.to_camera, ray.direction)) < 1e-5f);
            assert_true(fabsf(ca_length(ray.direction) - 1.0f) < 3e-7f);
            assert_true(ray.weight.r == 1.0f && ray.weight.g == 1.0f && ray.weight.b == 1.0f);
            /* Where the connection passes the near plane, the ray does. */
            assert_true(fabsf((t - direct.t_near) - ray.t_min) < 1e-4f);
        }
    }
}

/* ---- Side by side ---------------------------------------------------------------------------------------------- */

enum { PANELS = 3 };
static const int of_panel[PANELS] = {LENS, ORTHOGRAPHIC, SHIFTED};

static ca_camera make_panels(ca_camera cameras[PANELS], uint32_t width, uint32_t height)
{
    for (int i = 0; i < PANELS; i++) cameras[i] = make(of_panel[i]);
    ca_camera camera = {.kind = CA_CAMERA_PANELS,
                        .width = width,
                        .height = height,
                        .as.panels = {.cameras = cameras, .count = PANELS}};
    ca_camera_prepare(&camera);
    return camera;
}

/* A part of the film is that camera's; densities are per pixel of the film, which may be twice as wide and high. */
static void test_panel_rays(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(11);
    ca_camera cameras[PANELS];
    for (uint32_t size = 1; size <= 2; size++) {
        const ca_camera camera = make_panels(cameras, 36 * size, 8 * size);
        const float pixels = (float)(size * size);
        assert_true(ca_camera_has_lens(&camera) && !ca_camera_has_lanes(&camera));
        assert_int_equal(ca_camera_count(&camera), PANELS);
        for (int i = 0; i < 3000; i++) {
            const ca_vec2 unit = random2(&random), u = random2(&random);
            const int panel = i % PANELS;
            const ca_vec2 own = {12.0f * unit.x, 8.0f * unit.y};
            const ca_vec2 film = {(float)size * (own.x + 12.0f * (float)panel), (float)size * own.y};
            const ca_camera_ray ray = ca_camera_sample_ray(&camera, film, u);
            if (ray.camera != &cameras[panel]) continue; /* rounding, at the border */
            const ca_camera_ray expected = ca_camera_sample_ray(&cameras[panel], own, u);
            assert_true(ca_length(ca_sub(ray.origin, expected.origin)) < 1e-4f);
            assert_true(ca_length(ca_sub(ray.direction, expected.direction)) < 1e-5f);
            const float density = expected.pdf_position.v * expected.pdf_direction.v * pixels;
            assert_true(fabsf(ray.pdf_position.v * ray.pdf_direction.v / density - 1.0f) < 1e-4f);
        }
    }
    /* A higher film shows more above and below. */
    const ca_camera higher = make_panels(cameras, 36, 12);
    const ca_camera_ray above = ca_camera_sample_ray(&higher, (ca_vec2){29.0f, 0.5f}, (ca_vec2){0.5f, 0.5f});
    const ca_camera_ray expected = ca_camera_sample_ray(&cameras[2], (ca_vec2){5.0f, -1.5f}, (ca_vec2){0.5f, 0.5f});
    assert_true(ca_length(ca_sub(above.direction, expected.direction)) < 1e-6f);
    ca_camera_direct direct;
    const ca_vec3 point = ca_madd(above.origin, 5.0f, above.direction);
    assert_true(ca_camera_sample_direct(&higher, point, (ca_vec2){0.9f, 0.5f}, 0.0f, &direct));
    assert_true(fabsf(direct.film_position.x - 29.0f) < 1e-3f && fabsf(direct.film_position.y - 0.5f) < 1e-3f);
    const ca_camera camera = make_panels(cameras, 36, 8);
    assert_false(ca_camera_sample_direct(&camera, point, (ca_vec2){0.9f, 0.5f}, 0.0f, &direct));
    const ca_vec2 u = {0.5f, 0.5f}, left = {-1.0f, 4.0f}, right = {37.0f, 4.0f};
    assert_ptr_equal(ca_camera_sample_ray(&camera, left, u).camera, &cameras[0]);
    assert_ptr_equal(ca_camera_sample_ray(&camera, right, u).camera, &cameras[PANELS - 1]);
}

/* The number for the lens chooses among the cameras; what one sees beyond its part belongs to its neighbour. */
static void test_panel_splats(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(12);
    ca_camera cameras[PANELS];
    for (uint32_t size = 1; size <= 2; size++) {
        const ca_camera camera = make_panels(cameras, 36 * size, 8 * size);
        uint32_t seen[PANELS] = {0}, beyond = 0;
        for (int i = 0; i < 20000; i++) {
            const uint32_t panel = (uint32_t)i % PANELS;
            const ca_vec2 unit = random2(&random), u = random2(&random);
            const ca_vec2 own = {16.0f * unit.x - 2.0f, 8.0f * unit.y};
            const ca_vec2 u_all = {(u.x + (float)panel) / (float)PANELS, u.y};
            const ca_camera_ray ray = ca_camera_sample_ray(&cameras[panel], own, u);
            const ca_vec3 point = ca_madd(ray.origin, 5.0f, ray.direction);
            ca_camera_direct direct, expected;
            const bool inside = own.x > 0.01f && own.x < 11.99f, outer = own.x < 6.0f ? panel == 0 : panel == 2;
            if (!inside && own.x > -0.01f && own.x < 12.01f) continue;
            const bool got = ca_camera_sample_direct(&camera, point, u_all, 3.0f * (float)size, &direct);
            assert_int_equal(got, inside || outer);
            beyond += !inside && outer;
            if (!got) continue;
            seen[panel]++;
            assert_true(ca_camera_sample_direct(&cameras[panel], point, u, 3.0f, &expected));
            assert_ptr_equal(direct.camera, &cameras[panel]);
            assert_true(fabsf(direct.film_position.x - (float)size * (own.x + 12.0f * (float)panel)) < 2e-3f);
            assert_true(fabsf(direct.film_position.y - (float)size * own.y) < 2e-3f);
            const float f = expected.importance / expected.pdf_direct.v * (float)(PANELS * size * size);
            assert_true(fabsf(direct.importance / direct.pdf_direct.v / f - 1.0f) < 1e-3f);
            assert_true(fabsf(direct.pdf_position.v * direct.pdf_direction.v /
                                  (expected.pdf_position.v * expected.pdf_direction.v * (float)(size * size)) -
                              1.0f) < 1e-3f);
        }
        assert_true(seen[0] > 4000 && seen[1] > 4000 && seen[2] > 4000 && beyond > 1000);
    }
}

/* Far from the world's origin only the digits of the point itself are lost, not those of the mapping. */
static void test_round_trip_far_away(void **state)
{
    (void)state;
    ca_camera camera = make(PINHOLE);
    camera.map = look_at(20000.0, -30000.0, 10000.0, 1.0, 1.0);
    camera.width = 1920;
    camera.height = 1080;
    ca_camera_prepare(&camera);
    ca_test_random random = ca_test_random_seed(1);
    for (int i = 0; i < 1000; i++) {
        const ca_vec2 unit = random2(&random), film = {unit.x * 1920.0f, unit.y * 1080.0f};
        const ca_camera_ray ray = ca_camera_sample_ray(&camera, film, unit);
        ca_camera_direct direct;
        assert_true(ca_camera_sample_direct(&camera, ca_madd(ray.origin, 50.0f, ray.direction), unit, 1.0f, &direct));
        assert_true(hypotf(direct.film_position.x - film.x, direct.film_position.y - film.y) < 0.1f);
    }
}

static void test_limits(void **state)
{
    (void)state;
    for (int which = 0; which < CAMERAS; which++) {
        ca_camera camera = make(which);
        camera.near_clip = 1.0f;
        camera.far_clip = 5.0f;
        const ca_vec2 u = {0.4f, 0.6f};
        const ca_camera_ray ray = ca_camera_sample_ray(&camera, (ca_vec2){5.0f, 3.0f}, u);
        ca_camera_direct direct;
        for (int i = 0; i < 4; i++) {
            const float t =
                (const float[4]){0.999f * ray.t_min, 1.001f * ray.t_min, 0.999f * ray.t_max, 1.001f * ray.t_max}[i];
            assert_int_equal(
                ca_camera_sample_direct(&camera, ca_madd(ray.origin, t, ray.direction), u, 0.0f, &direct),
                i == 1 || i == 2);
        }
        assert_false(ca_camera_sample_direct(&camera, ca_madd(ray.origin, -2.0f, ray.direction), u, 0.0f, &direct));

        const ca_camera_ray outside = ca_camera_sample_ray(&camera, (ca_vec2){-1.5f, 3.0f}, u);
        const ca_vec3 reference = ca_madd(outside.origin, 0.5f * (outside.t_min + outside.t_max), outside.direction);
        assert_false(ca_camera_sample_direct(&camera, reference, u, 1.0f, &direct));
        assert_true(ca_camera_sample_direct(&camera, reference, u, 2.0f, &direct));
    }
}

/* Eight rays at a time have the bits of each alone. */
static void test_lanes(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(19);
    uint32_t with_lanes = 0;
    for (int trial = 0; trial < 3000 * CAMERAS; trial++) {
        const ca_camera camera = make(trial % CAMERAS);
        if (!ca_camera_has_lanes(&camera)) continue;
        with_lanes++;
        ca_f8 film[2], u_lens[2];
        for (int k = 0; k < CA_LANES; k++) {
            const ca_vec2 f = random2(&random), u = random2(&random);
            film[0][k] = 12.0f * f.x, film[1][k] = 8.0f * f.y, u_lens[0][k] = u.x, u_lens[1][k] = u.y;
        }
        ca_camera_rays8 got;
        ca_camera_sample_rays8(&camera, film, u_lens, &got);
        for (int k = 0; k < CA_LANES; k++) {
            const ca_camera_ray ray = ca_camera_sample_ray(&camera, (ca_vec2){film[0][k], film[1][k]},
                                                           (ca_vec2){u_lens[0][k], u_lens[1][k]});
            assert_true(got.origin.x[k] == ray.origin.x && got.origin.y[k] == ray.origin.y &&
                        got.origin.z[k] == ray.origin.z);
            assert_true(got.direction.x[k] == ray.direction.x && got.direction.y[k] == ray.direction.y &&
                        got.direction.z[k] == ray.direction.z);
            assert_true(got.t_min[k] == ray.t_min && got.t_max[k] == ray.t_max);
        }
    }
    assert_int_equal(with_lanes, 3000 * 3);
}

static void test_dirac(void **state)
{
    (void)state;
    for (int which = 0; which < CAMERAS; which++) {
        const ca_camera camera = make(which);
        assert_int_equal(ca_camera_has_dirac_position(&camera), which == PINHOLE || which == SHIFTED);
        assert_int_equal(ca_camera_has_dirac_direction(&camera), which == ORTHOGRAPHIC || which == SHEARED);
    }
    ca_camera closed = make(LENS);
    closed.as.thin_lens.lens_radius = 0.0f;
    assert_true(ca_camera_has_dirac_position(&closed));
    assert_true(isfinite(ca_camera_sample_ray(&closed, (ca_vec2){1, 1}, (ca_vec2){0, 0}).pdf_position.v));
}

/* ---- Densities ------------------------------------------------------------------------------------------------- */

static const ca_vec2 fixed_lens = {0.2f, 0.9f};

/* Directions through the single pixel of a camera, from one point of its lens. */
static bool draw_direction(const void *context, const float u[3], ca_vec3 *direction)
{
    *direction = ca_camera_sample_ray(context, (ca_vec2){u[0], u[1]}, fixed_lens).direction;
    return true;
}

static float direction_density(const void *context, ca_vec3 direction)
{
    const ca_camera *camera = context;
    const ca_camera_ray ray = ca_camera_sample_ray(camera, (ca_vec2){0.5f, 0.5f}, fixed_lens);
    ca_camera_direct direct;
    const ca_vec3 point = ca_madd(ray.origin, 7.0f, direction);
    return ca_camera_sample_direct(camera, point, fixed_lens, 0.0f, &direct) ? direct.pdf_direction.v : 0.0f;
}

static void test_direction_density(void **state)
{
    (void)state;
    for (int which = PINHOLE; which <= LENS; which++) {
        ca_camera camera = make(which);
        camera.width = camera.height = 1;
        ca_camera_set_tan_half_x(&camera, 1.5f);
        ca_camera_prepare(&camera);
        const ca_camera *prepared = &camera;
        const ca_vec3 axis = ca_normalize(ca_map_vector(prepared->map.to, (ca_vec3){0, 0, 1}));
        const ca_chi_square_result result = ca_chi_square_run(&(ca_chi_square_test){.name = names[which],
                                                                                    .sample = draw_direction,
                                                                                    .pdf = direction_density,
                                                                                    .context = prepared,
                                                                                    .axis = axis,
                                                                                    .test_count = 3});
        print_message("           %s: p %.3g, integral %.5f\n", names[which], result.p_value, result.pdf_integral);
        assert_int_equal(result.bad_count, 0);
        assert_true(fabs(result.pdf_integral - 1.0) < 2e-3);
        assert_true(result.p_value > ca_sidak_level(0.01, 3));
    }
}

/* ---- Rays against splats --------------------------------------------------------------------------------------- */

/* A tilted square in front of the cameras that shines with a pattern, from both sides alike. */
typedef struct wall {
    ca_vec3 center, s, t, n; /* half sides s and t */
} wall;

static wall make_wall(const ca_camera *camera)
{
    const ca_vec3 center = ca_map_point(camera->map.to, (ca_vec3){0.1f, 0.05f, 4.0f});
    const ca_vec3 s = ca_map_vector(camera->map.to, (ca_vec3){5.0f, 0.5f, 1.5f});
    const ca_vec3 t = ca_map_vector(camera->map.to, (ca_vec3){-0.3f, 4.0f, -1.2f});
    return (wall){center, s, t, ca_normalize(ca_cross(s, t))};
}

static double wall_radiance(ca_vec2 st)
{
    return 1.0 + 0.8 * sin(7.0 * (double)st.x) * cos(5.0 * (double)st.y + 1.0);
}

/* What a ray sees: 0 beside the wall. */
static double look(const wall *w, const ca_camera_ray *ray)
{
    const float distance = ca_dot(w->n, ca_sub(w->center, ray->origin)) / ca_dot(w->n, ray->direction);
    if (!(distance > ray->t_min)) return 0.0;
    const ca_vec3 p = ca_sub(ca_madd(ray->origin, distance, ray->direction), w->center);
    const ca_vec3 dual_s = ca_cross(w->t, w->n), dual_t = ca_cross(w->n, w->s);
    const ca_vec2 st = {ca_dot(p, dual_s) / ca_dot(w->s, dual_s), ca_dot(p, dual_t) / ca_dot(w->t, dual_t)};
    return fabsf(st.x) <= 1.0f && fabsf(st.y) <= 1.0f ? wall_radiance(st) : 0.0;
}

typedef struct estimate {
    double sum, squares;
} estimate;

static void add(estimate *e, double value)
{
    e->sum += value;
    e->squares += value * value;
}

enum { WIDTH = 12, HEIGHT = 8, PIXELS = WIDTH * HEIGHT, RAYS = 4000, SPLATS = 1000000 };

static void image_by_rays(const ca_camera *camera, const wall *w, estimate *pixels)
{
    ca_test_random random = ca_test_random_seed(5);
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++)
        for (int i = 0; i < RAYS; i++) {
            const ca_vec2 offset = random2(&random), lens = random2(&random);
            const ca_vec2 film = {(float)(pixel % WIDTH) + offset.x, (float)(pixel / WIDTH) + offset.y};
            const ca_camera_ray ray = ca_camera_sample_ray(camera, film, lens);
            add(&pixels[pixel], (double)ray.weight.r * look(w, &ray));
        }
}

static void image_by_splats(const ca_camera *camera, const wall *w, estimate *pixels)
{
    ca_test_random random = ca_test_random_seed(6);
    const double area = 4.0 * (double)ca_length(ca_cross(w->s, w->t));
    for (int i = 0; i < SPLATS; i++) {
        const ca_vec2 u = random2(&random), lens = random2(&random);
        const ca_vec2 st = {2.0f * u.x - 1.0f, 2.0f * u.y - 1.0f};
        const ca_vec3 point = ca_madd(ca_madd(w->center, st.x, w->s), st.y, w->t);
        ca_camera_direct direct;
        if (!ca_camera_sample_direct(camera, point, lens, 0.0f, &direct)) continue;
        const uint32_t x = ca_min_u32((uint32_t)direct.film_position.x, WIDTH - 1);
        const uint32_t y = ca_min_u32((uint32_t)direct.film_position.y, HEIGHT - 1);
        const double cosine = (double)ca_abs_dot(w->n, direct.to_camera);
        add(&pixels[y * WIDTH + x],
            wall_radiance(st) * cosine * area * (double)direct.importance / (double)direct.pdf_direct.v);
    }
}

static void test_rays_equal_splats(void **state)
{
    (void)state;
    for (int which = 0; which < CAMERAS; which++) {
        const ca_camera camera = make(which);
        const wall w = make_wall(&camera);
        estimate rays[PIXELS] = {{0}}, splats[PIXELS] = {{0}};
        image_by_rays(&camera, &w, rays);
        image_by_splats(&camera, &w, splats);
        double worst = 0.0, total_rays = 0.0, total_splats = 0.0;
        for (uint32_t i = 0; i < PIXELS; i++) {
            const double a = rays[i].sum / RAYS, b = splats[i].sum / SPLATS;
            const double variance =
                (rays[i].squares / RAYS - a * a) / RAYS + (splats[i].squares / SPLATS - b * b) / SPLATS;
            worst = fmax(worst, fabs(a - b) / sqrt(variance + 1e-12));
            total_rays += a;
            total_splats += b;
        }
        print_message("           %s: worst pixel %.2f sigma, whole image %+.2f %%\n", names[which], worst,
                      100.0 * (total_splats / total_rays - 1.0));
        assert_true(worst < 4.5); /* of 96 pixels */
        assert_true(fabs(total_splats / total_rays - 1.0) < 0.005);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orientation),
        cmocka_unit_test(test_field_of_view),
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_panel_rays),
        cmocka_unit_test(test_panel_splats),
        cmocka_unit_test(test_round_trip_far_away),
        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_lanes),
        cmocka_unit_test(test_dirac),
        cmocka_unit_test(test_direction_density),
        cmocka_unit_test(test_rays_equal_splats),
    };
    return cmocka_run_group_tests_name("camera", tests, NULL, NULL);
}
