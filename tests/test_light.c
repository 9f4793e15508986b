/* Lights: next event, emission and chance hits tell the same story: equal densities, equal radiance, equal irradiance
 * on a detector, and the closed forms of textbooks. */
#include "light/light.h"
#include "light/environment_lanes.h"

#include "base/memory.h"
#include "math/numeric.h"
#include "scene/matte.h"
#include "sampling/warp.h"
#include "support/shared_light_fixture.h"
#include "support/test_random.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static ca_vec2 random2(ca_test_random *random)
{
    const float x = ca_test_random_float(random);
    return (ca_vec2){x, ca_test_random_float(random)};
}

static bool close_to(float a, float b, float tolerance) { return fabsf(a - b) <= tolerance * (fabsf(a) + fabsf(b)); }

static bool close_rgb(ca_rgb a, ca_rgb b, float tolerance)
{
    const float scale = tolerance * (ca_rgb_max(a) + ca_rgb_max(b)) + 1e-6f;
    return fabsf(a.r - b.r) <= scale && fabsf(a.g - b.g) <= scale && fabsf(a.b - b.b) <= scale;
}

/* Around the fixture's reference. */
static ca_vec3 random_reference(int light, ca_test_random *random)
{
    const ca_vec3 center = ca_light_fixture_reference(light);
    const ca_vec2 a = random2(random);
    return ca_add(center, (ca_vec3){a.x - 0.5f, a.y - 0.5f, ca_test_random_float(random) - 0.5f});
}

/* ---- Agreement of densities ------------------------------------------------------------------------------------ */

/* The same whoever asks, and what the two densities say, brought to one measure. */
static void check_next_event_ratio(int light, ca_vec3 reference, const ca_light_direct *direct,
                                   const ca_light_hit *hit, float tolerance)
{
    const ca_light *l = &fixture.lights[light];
    const float walked = ca_light_next_event_ratio(l, reference, direct->position, direct->ng);
    assert_true(close_to(direct->next_event_ratio, walked, tolerance));
    assert_true(close_to(direct->next_event_ratio, hit->next_event_ratio, tolerance));
    if (light >= LIGHT_SHAPES) {
        assert_true(walked == 1.0f);
        return;
    }
    const ca_pdf_area chosen =
        ca_pdf_to_area(direct->pdf_direct, direct->cos_light, ca_sqr(direct->distance));
    assert_true(close_to(chosen.v / direct->pdf_position.v, walked, tolerance));
}

static void check_hit(int light, ca_vec3 reference, const ca_light_direct *direct)
{
    ca_surface surface, *met = NULL;
    float t;
    if (light < LIGHT_SHAPES) {
        if (!ca_light_fixture_trace(&fixture, light, reference, direct->to_light, 0.0f, &t, &surface))
            return; /* rim */
        assert_true(close_to(t, direct->distance, 1e-4f));
        met = &surface;
    }
    const ca_vec3 direction = ca_neg(direct->to_light);
    const ca_light_hit hit = ca_light_eval_hit(&fixture.lights[light], reference, met, direction);
    /* Seen edge-on, the rounding of the point shows in the cosine. */
    if (direct->cos_light < 0.01f) return;
    const float tolerance = 2e-5f / direct->cos_light;
    if (!close_to(hit.pdf_direct.v, direct->pdf_direct.v, tolerance))
        fail_msg("%s: %.8g, not %.8g, cos %g", ca_test_light_names[light], (double)hit.pdf_direct.v,
                 (double)direct->pdf_direct.v, (double)direct->cos_light);
    assert_true(close_to(hit.pdf_position.v, direct->pdf_position.v, 1e-6f));
    assert_true(close_to(hit.pdf_direction.v, direct->pdf_direction.v, tolerance));
    assert_true(close_rgb(hit.radiance, direct->radiance, 1e-3f));
    check_next_event_ratio(light, reference, direct, &hit, tolerance);
    assert_true(close_rgb(ca_light_radiance(&fixture.lights[light], met, direction), hit.radiance, 0.0f));
}

static void test_direct_agrees_with_hits(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_COUNT; i++) {
        const ca_light *light = &fixture.lights[i];
        ca_test_random random = ca_test_random_seed((uint64_t)i);
        uint32_t seen = 0;
        for (int k = 0; k < 5000; k++) {
            const ca_vec3 reference = random_reference(i, &random);
            ca_light_direct direct;
            if (!ca_light_sample_direct(light, reference, random2(&random), &direct)) continue;
            seen++;
            assert_true(fabsf(ca_length(direct.to_light) - 1.0f) < 1e-6f && direct.cos_light > 0.0f);
            assert_int_equal(isinf(direct.distance), ca_light_is_infinite(light));
            if (!isinf(direct.distance)) {
                const ca_vec3 end = ca_madd(reference, direct.distance, direct.to_light);
                assert_true(ca_length(ca_sub(end, direct.position)) < 1e-5f);
            } else {
                assert_true(ca_length(ca_sub(direct.position, light->scene_center)) > light->scene_radius);
            }
            if (ca_light_has_dirac_position(light) || ca_light_has_dirac_direction(light)) {
                assert_true(direct.pdf_direct.v == 1.0f);
                const ca_light_hit hit = ca_light_eval_hit(light, reference, NULL, ca_neg(direct.to_light));
                assert_true(ca_rgb_is_black(hit.radiance) && hit.pdf_direct.v == 0.0f);
            } else {
                check_hit(i, reference, &direct);
            }
        }
        assert_true(seen > 1000);
    }
}

/* Emission of area and environment lights against what a path that comes the other way would find. */
static ca_light_hit hit_of_emission(int i, const ca_light_emission *e, ca_vec3 reference, bool *found)
{
    ca_surface surface;
    float t;
    *found = true;
    if (i >= LIGHT_SHAPES) return ca_light_eval_hit(&fixture.lights[i], reference, NULL, e->direction);
    *found = ca_light_fixture_trace(&fixture, i, reference, ca_neg(e->direction), 0.0f, &t, &surface) &&
             ca_length(ca_sub(surface.position, e->origin)) < 1e-4f;
    return *found ? ca_light_eval_hit(&fixture.lights[i], reference, &surface, e->direction) : (ca_light_hit){0};
}

static void check_dirac_emission(const ca_light *light, const ca_light_emission *e, ca_vec3 reference, float t)
{
    ca_light_direct direct;
    assert_true(ca_light_sample_direct(light, reference, (ca_vec2){0.5f, 0.5f}, &direct));
    assert_true(ca_length(ca_add(direct.to_light, e->direction)) < 4e-6f);
    assert_true(close_to(direct.pdf_position.v, e->pdf_position.v, 1e-6f));
    const float scale = ca_light_has_dirac_position(light) ? t * t : 1.0f;
    /* Where the intensity ends, it is small beside its error. */
    const ca_rgb difference = ca_rgb_sub(ca_rgb_scale(direct.radiance, scale), e->radiance);
    assert_true(fmaxf(fabsf(difference.r), fabsf(difference.g)) < 5e-4f);
    if (!close_to(direct.pdf_direction.v, e->pdf_direction.v, 1e-4f)) /* the neighbouring pixel of the slide */
        assert_int_equal(light->kind, CA_LIGHT_PROJECTOR);
}

static void test_emission_agrees(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_COUNT; i++) {
        const ca_light *light = &fixture.lights[i];
        const bool dirac = ca_light_has_dirac_position(light) || ca_light_has_dirac_direction(light);
        ca_test_random random = ca_test_random_seed((uint64_t)i);
        uint32_t agreed = 0, emitted = 0;
        for (int k = 0; k < 5000; k++) {
            ca_light_emission e;
            const ca_vec2 u_position = random2(&random);
            if (!ca_light_sample_emission(light, u_position, random2(&random), &e)) continue;
            emitted++;
            assert_true(fabsf(ca_length(e.direction) - 1.0f) < 1e-6f);
            const float t = 0.5f + 0.5f * ca_test_random_float(&random);
            const ca_vec3 reference = ca_madd(e.origin, t, e.direction);
            if (dirac) {
                check_dirac_emission(light, &e, reference, t);
                agreed++;
                continue;
            }
            bool found;
            const ca_light_hit hit = hit_of_emission(i, &e, reference, &found);
            if (!found) continue;
            agreed++;
            const float tolerance = 1e-4f / fmaxf(e.cos_light, 0.01f);
            assert_true(close_to(hit.pdf_position.v, e.pdf_position.v, 1e-6f));
            assert_true(close_to(hit.pdf_direction.v, e.pdf_direction.v, tolerance));
            assert_true(close_rgb(hit.radiance, e.radiance, 2e-3f));
        }
        if (agreed < 0.95 * emitted) fail_msg("%s: %u of %u", ca_test_light_names[i], agreed, emitted);
        assert_true(emitted > 1000);
    }
}

/* ---- Irradiance and power -------------------------------------------------------------------------------------- */

typedef struct estimate {
    double sum, squares;
    uint32_t count;
} estimate;

static void add(estimate *e, double value)
{
    e->sum += value;
    e->squares += value * value;
    e->count++;
}
static double mean(const estimate *e) { return e->sum / e->count; }
static double variance(const estimate *e) { return fmax(e->squares / e->count - mean(e) * mean(e), 0.0) / e->count; }

static const ca_vec3 detector_normal = {0.36f, 0.8f, 0.48f};
static const float detector_radius = 0.6f;

/* Mean irradiance of a disk around the fixture's reference, by next event. */
static estimate irradiance_by_direct(int i, uint32_t count)
{
    const ca_light *light = &fixture.lights[i];
    const ca_frame frame = ca_frame_from_normal(detector_normal);
    estimate result = {0};
    ca_test_random random = ca_test_random_seed(7);
    for (uint32_t k = 0; k < count; k++) {
        const ca_vec2 d = ca_warp_disk(random2(&random));
        const ca_vec3 offset = ca_to_world(&frame, (ca_vec3){detector_radius * d.x, detector_radius * d.y, 0.0f});
        ca_light_direct direct;
        float value = 0.0f;
        if (ca_light_sample_direct(light, ca_add(ca_light_fixture_reference(i), offset), random2(&random), &direct))
            value = ca_luminance(direct.radiance) * fmaxf(ca_dot(detector_normal, direct.to_light), 0.0f) /
                    direct.pdf_direct.v;
        add(&result, (double)value);
    }
    return result;
}

/* The same by counting the flux of emitted rays that cross the disk from its front. */
static estimate irradiance_by_emission(int i, uint32_t count)
{
    const float area = CA_PI * detector_radius * detector_radius;
    estimate result = {0};
    ca_test_random random = ca_test_random_seed(8);
    for (uint32_t k = 0; k < count; k++) {
        ca_light_emission e;
        const ca_vec2 u_position = random2(&random);
        float value = 0.0f;
        if (ca_light_sample_emission(&fixture.lights[i], u_position, random2(&random), &e)) {
            const float facing = -ca_dot(detector_normal, e.direction);
            const ca_vec3 segment = ca_sub(ca_light_fixture_reference(i), e.origin);
            const float t = -ca_dot(detector_normal, segment) / facing;
            const float miss = ca_length(ca_sub(ca_mul(e.direction, t), segment));
            if (facing > 0.0f && t > 0.0f && miss < detector_radius)
                value = ca_luminance(e.radiance) * e.cos_light / (e.pdf_position.v * e.pdf_direction.v * area);
        }
        add(&result, (double)value);
    }
    return result;
}

static void test_irradiance(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_COUNT; i++) {
        const estimate a = irradiance_by_direct(i, 100000), b = irradiance_by_emission(i, 1500000);
        const double sigma = sqrt(variance(&a) + variance(&b)), z = (mean(&a) - mean(&b)) / (sigma + 1e-12);
        print_message("           %-18s %.4f by next event, %.4f by emission (%.1f sigma, %.2f %%)\n",
                      ca_test_light_names[i], mean(&a), mean(&b), z, 100.0 * sigma / mean(&a));
        assert_true(mean(&a) > 0.0);
        assert_true(sigma < 0.04 * mean(&a));
        assert_true(fabs(z) < 3.7);
    }
}

static void test_power(void **state)
{
    (void)state;
    for (int i = 0; i < LIGHT_COUNT; i++) {
        estimate flux = {0};
        ca_test_random random = ca_test_random_seed(9);
        for (int k = 0; k < 200000; k++) {
            ca_light_emission e;
            const ca_vec2 u_position = random2(&random);
            const bool some = ca_light_sample_emission(&fixture.lights[i], u_position, random2(&random), &e);
            add(&flux, some
                           ? (double)(ca_luminance(e.radiance) * e.cos_light / (e.pdf_position.v * e.pdf_direction.v))
                           : 0.0);
        }
        const double power = (double)fixture.lights[i].power;
        if (fabs(mean(&flux) - power) > 4.0 * sqrt(variance(&flux)) + 0.003 * power)
            fail_msg("%s: power %g, emitted %g +- %g", ca_test_light_names[i], power, mean(&flux),
                     sqrt(variance(&flux)));
    }
}

/* ---- Closed forms ---------------------------------------------------------------------------------------------- */

/* Irradiance on a surface at `reference` with normal n, by a grid of samples. */
static double irradiance(const ca_light *light, ca_vec3 reference, ca_vec3 n)
{
    enum { SIDE = 400 };
    double sum = 0.0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            ca_light_direct d;
            const ca_vec2 u = {((float)x + 0.5f) / SIDE, ((float)y + 0.5f) / SIDE};
            if (ca_light_sample_direct(light, reference, u, &d))
                sum += (double)(d.radiance.r * fmaxf(ca_dot(n, d.to_light), 0.0f) / d.pdf_direct.v);
        }
    return sum / (SIDE * SIDE);
}

static void assert_near(double value, double expected, double tolerance)
{
    if (!(fabs(value / expected - 1.0) < tolerance)) fail_msg("%.7g, not %.7g", value, expected);
}

static void test_area_closed_forms(void **state)
{
    (void)state;
    const double radiance = 2.0; /* red of the fixture's constant texture */
    /* A sphere seen from outside by a surface that faces it: pi L r^2 / d^2; one tilted by 60 degrees gets half. */
    const ca_light *sphere = &fixture.lights[LIGHT_SPHERE];
    const ca_vec3 below = {0.0f, 0.5f, 0.0f}, up = {0.0f, 1.0f, 0.0f};
    const double facing = CA_PI_D * radiance * 0.49 / 6.25;
    assert_near(irradiance(sphere, below, up), facing, 1e-4);
    assert_near(irradiance(sphere, below, (ca_vec3){0.8660254f, 0.5f, 0.0f}), 0.5 * facing, 1e-4);
    /* From inside, everywhere: pi L. */
    const ca_light *inside = &fixture.lights[LIGHT_SPHERE_IN];
    assert_near(irradiance(inside, (ca_vec3){1.0f, 2.0f, -1.0f}, up), CA_PI_D * radiance, 2e-3);
    assert_near(irradiance(inside, (ca_vec3){0.0f, -5.5f, 0.0f}, up), CA_PI_D * radiance, 2e-3);

    /* A disk on its axis: pi L r^2 / (r^2 + d^2), and nothing behind it. */
    ca_shape disk = fixture.shapes[LIGHT_DISK];
    disk.as.disk.map = (ca_affine){.to = {{1.5f, 0, 0, 0}, {0, 1.5f, 0, 0}, {0, 0, 1.5f, 0}}};
    disk.area = CA_PI * 2.25f;
    ca_light light = fixture.lights[LIGHT_DISK];
    light.as.area.shape = &disk;
    const ca_vec3 ahead = {0.0f, 0.0f, 2.0f}, behind = {0.0f, 0.0f, -2.0f}, towards = {0.0f, 0.0f, -1.0f};
    assert_near(irradiance(&light, ahead, towards), CA_PI_D * radiance * 2.25 / 6.25, 1e-4);
    assert_true(irradiance(&light, behind, up) == 0.0);
    disk.flip_normals = true;
    assert_true(irradiance(&light, ahead, towards) == 0.0);
    assert_near(irradiance(&light, behind, ca_neg(towards)), CA_PI_D * radiance * 2.25 / 6.25, 1e-4);
}

static void test_other_closed_forms(void **state)
{
    (void)state;
    const ca_vec3 up = {0.0f, 1.0f, 0.0f};
    const ca_light *lights = fixture.lights;
    assert_near(irradiance(&lights[LIGHT_CONSTANT], up, up), 5.0 * CA_PI_D, 1e-4);
    assert_near(irradiance(&lights[LIGHT_DIRECTIONAL], up, up), 5.0 / sqrt(1.13), 1e-6);
    assert_near(irradiance(&lights[LIGHT_POINT], (ca_vec3){0.5f, 2.0f, 0.2f}, up), 5.0 / 4.0, 1e-6);

    /* The spot falls linearly in the angle: full at 29 degrees, half at 40, nothing at 51. */
    static const double degrees[] = {0.0, 29.0, 40.0, 45.0, 51.0}, factor[] = {1.0, 1.0, 0.5, 0.25, 0.0};
    for (int i = 0; i < 5; i++) {
        const double angle = degrees[i] * CA_PI_D / 180.0;
        const ca_vec3 reference = {0.3f + (float)(2.0 * sin(angle)), 5.0f - (float)(2.0 * cos(angle)), 0.1f};
        const double e = irradiance(&lights[LIGHT_SPOT], reference, up);
        if (factor[i] > 0.0)
            assert_near(e, factor[i] * 5.0 / 4.0 * cos(angle), 1e-4);
        else
            assert_true(e == 0.0);
    }
    assert_near((double)lights[LIGHT_SPOT].power,
                2.0 * CA_PI_D * (1.0 - (sin(50 * CA_PI_D / 180) - sin(30 * CA_PI_D / 180)) / (20 * CA_PI_D / 180)) *
                    (0.2126 * 5 + 0.7152 * 4 + 0.0722 * 3),
                1e-4);
}

/* A spot of a twentieth of a degree, given in radians. */
static void test_narrow_spot(void **state)
{
    (void)state;
    ca_light spot = fixture.lights[LIGHT_SPOT];
    spot.as.spot.cutoff = 1e-3f;
    spot.as.spot.beam = 0.5e-3f;
    assert_int_equal(ca_light_prepare(&spot, (ca_vec3){0}, 1.0f, NULL), CA_OK);
    assert_near((double)spot.power, CA_PI_D * 1e-6 * (7.0 / 12.0) * (0.2126 * 5 + 0.7152 * 4 + 0.0722 * 3), 1e-4);
    const ca_vec3 reference = {0.3f + 0.75e-3f, 4.0f, 0.1f};
    assert_near(irradiance(&spot, reference, (ca_vec3){0, 1, 0}), 2.5, 1e-3);
}

/* On the plane at distance 1, irradiance is pi times the picture: upper left is +x, +y (here world +x, -z). */
static void test_projector_picture(void **state)
{
    (void)state;
    const ca_light *light = &fixture.lights[LIGHT_PROJECTOR];
    const ca_matrix map = {{{1, 0, 0, -0.2}, {0, 0, -1, 5}, {0, 1, 0, 0.3}, {0, 0, 0, 1}}};
    for (uint32_t row = 0; row < 4; row++)
        for (uint32_t column = 0; column < 6; column++) {
            const double x = (1.0 - 2.0 * (column + 0.5) / 6.0) * 0.6, y = (1.0 - 2.0 * (row + 0.5) / 4.0) * 0.4;
            const double local[3] = {x, y, 1.0};
            double p[3];
            ca_matrix_point(&map, local, p);
            const ca_vec3 reference = {(float)p[0], (float)p[1], (float)p[2]};
            const double expected = CA_PI_D * 5.0 * (double)ca_image_rgb(&fixture.picture, column, row).r;
            const double e = irradiance(light, reference, (ca_vec3){0, 1, 0});
            assert_true(fabs(e - expected) < 1e-4 * (expected + 1.0));
        }
    assert_true(irradiance(light, (ca_vec3){-0.2f + 0.61f, 4.0f, 0.3f}, (ca_vec3){0, 1, 0}) == 0.0);
    ca_test_random random = ca_test_random_seed(4);
    for (int i = 0; i < 1000; i++) { /* a direction's density is the same, whoever asks */
        ca_light_emission emission;
        ca_light_direct direct;
        if (!ca_light_sample_emission(light, random2(&random), (ca_vec2){0}, &emission)) continue;
        const ca_vec3 reference = ca_madd(emission.origin, 2.0f, emission.direction);
        if (!ca_light_sample_direct(light, reference, (ca_vec2){0}, &direct)) continue;
        const ca_vec3 moved = ca_add(reference, (ca_vec3){1e-4f, 0.0f, 1e-4f});
        ca_light_direct beside; /* in another cell of the table: rounding decides in which one this direction is */
        if (!ca_light_sample_direct(light, moved, (ca_vec2){0}, &beside)) continue;
        if (!close_to(direct.pdf_direction.v, beside.pdf_direction.v, 1e-2f)) continue;
        assert_true(close_to(direct.pdf_direction.v, emission.pdf_direction.v, 1e-2f));
    }
    assert_true(irradiance(light, (ca_vec3){-0.2f, 6.0f, 0.3f}, (ca_vec3){0, -1, 0}) == 0.0);
}

/* ---- Environment maps ------------------------------------------------------------------------------------------ */

static void test_envmap_orientation(void **state)
{
    (void)state;
    ca_light light = fixture.lights[LIGHT_ENVMAP];
    light.as.envmap.scale = (ca_rgb){1.0f, 1.0f, 1.0f};
    const ca_image *image = &fixture.environment;                                          /* 16 x 9 */
    const ca_vec3 s = {0.6f, 0.0f, -0.8f}, t = {0.0f, 1.0f, 0.0f}, n = {0.8f, 0.0f, 0.6f}; /* the light's axes */
    /* Columns 3 and 4 meet at phi = pi/2, the light's +x; columns 7 and 8 at +z; row 0 is +y, row 4 the equator. */
    const ca_vec3 directions[4] = {s, n, ca_neg(s), ca_neg(n)};
    static const uint32_t left[4] = {3, 7, 11, 15};
    for (int i = 0; i < 4; i++) {
        const ca_rgb seen = ca_light_radiance(&light, NULL, ca_neg(directions[i]));
        const ca_rgb expected =
            ca_rgb_lerp(ca_image_rgb(image, left[i], 4), ca_image_rgb(image, (left[i] + 1) % 16, 4), 0.5f);
        assert_true(close_rgb(seen, expected, 1e-4f));
    }
    const ca_vec3 above = ca_normalize(ca_add(t, ca_mul(s, 1e-4f)));
    const ca_rgb top = ca_rgb_lerp(ca_image_rgb(image, 3, 0), ca_image_rgb(image, 4, 0), 0.5f);
    assert_true(close_rgb(ca_light_radiance(&light, NULL, ca_neg(above)), top, 1e-3f));
}

/* Integrals over the sphere by a fine grid: of radiance it is the power over the disk's area, of the density it is 1,
 * and the density is positive where there is light. */
static void test_envmap_integrals(void **state)
{
    (void)state;
    enum { ROWS = 800, COLUMNS = 1600 };
    const ca_light *light = &fixture.lights[LIGHT_ENVMAP];
    double radiance = 0.0, density = 0.0;
    for (int y = 0; y < ROWS; y++)
        for (int x = 0; x < COLUMNS; x++) {
            const double theta = CA_PI_D * (y + 0.5) / ROWS, phi = 2.0 * CA_PI_D * (x + 0.5) / COLUMNS;
            const double solid_angle = 2.0 * CA_PI_D * CA_PI_D * sin(theta) / (ROWS * COLUMNS);
            const ca_vec3 direction = {(float)(sin(theta) * cos(phi)), (float)cos(theta),
                                       (float)(sin(theta) * sin(phi))};
            const ca_light_hit hit = ca_light_eval_hit(light, (ca_vec3){0}, NULL, direction);
            radiance += solid_angle * (double)ca_luminance(hit.radiance);
            density += solid_angle * (double)hit.pdf_direct.v;
            assert_true(ca_rgb_max(hit.radiance) < 1e-4f || hit.pdf_direct.v > 0.0f);
        }
    assert_near(density, 1.0, 1e-3);
    assert_near((double)light->power, radiance * CA_PI_D * 100.0, 1e-3);
}

/* Luminance over the density of an envmap in the direction that a place of the picture has. */
static double sampled_weight(const ca_light *light, double x, double y)
{
    const ca_image *image = light->as.envmap.image;
    const double theta = CA_PI_D * y / (image->height - 1), phi = 2.0 * CA_PI_D * (x + 0.5) / image->width;
    const ca_vec3 local = {(float)(sin(phi) * sin(theta)), (float)cos(theta), (float)(-cos(phi) * sin(theta))};
    const ca_vec3 to_light = ca_map_vector(light->as.envmap.map.to, local);
    const ca_light_hit hit = ca_light_eval_hit(light, (ca_vec3){0}, NULL, ca_neg(to_light));
    return (double)ca_luminance(hit.radiance) / (double)hit.pdf_direct.v / sin(theta);
}

/* Within a cell between four pixels the density follows luminance: their quotient has only sin theta in it. */
static void test_envmap_density_follows_luminance(void **state)
{
    (void)state;
    const ca_light *light = &fixture.lights[LIGHT_ENVMAP];
    const ca_image *image = light->as.envmap.image;
    uint32_t lit = 0;
    for (uint32_t y = 0; y + 1 < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++) {
            const double expected = sampled_weight(light, x + 0.5, y + 0.5);
            if (isnan(expected)) continue; /* all black */
            lit++;
            for (int i = 1; i < 16; i++) {
                const double got = sampled_weight(light, x + 0.05 + 0.09 * (i % 10), y + 0.06 * i);
                if (!(fabs(got / expected - 1.0) < 1e-3)) fail_msg("%g and %g in cell %u %u", got, expected, x, y);
            }
        }
    assert_true(lit > 50);
}

static void check_same_vector(ca_vec3 a, ca_vec3 b)
{
    assert_true(a.x == b.x && a.y == b.y && a.z == b.z);
}

/* What is kept of an even light gives the same as the light, to the bit, far away and near. */
static void test_even_lights(void **state)
{
    (void)state;
    ca_even_light *evens = ca_even_lights_create(fixture.lights, LIGHT_COUNT, fixture.textures);
    ca_test_random random = ca_test_random_seed(31);
    uint32_t far = 0, near = 0;
    for (int k = 0; k < 2000 * LIGHT_COUNT; k++) {
        const int i = k % LIGHT_COUNT;
        const float reach = k % 3 ? 40.0f : 2.0f, x = ca_test_random_float(&random) - 0.5f;
        const ca_vec2 yz = random2(&random), u = random2(&random);
        const ca_vec3 reference =
            ca_madd(ca_light_fixture_reference(i), reach, (ca_vec3){x, yz.x - 0.5f, yz.y - 0.5f});
        ca_light_direct got = {0}, expected = {0};
        const bool lit = ca_even_light_sample_direct(&evens[i], &fixture.lights[i], reference, u, &got);
        assert_int_equal(lit, ca_light_sample_direct(&fixture.lights[i], reference, u, &expected));
        if (!lit) continue;
        far += evens[i].is_plain && !ca_even_light_is_near(&evens[i], reference);
        near += evens[i].is_plain && ca_even_light_is_near(&evens[i], reference);
        check_same_vector(got.position, expected.position);
        check_same_vector(got.position_error, expected.position_error);
        check_same_vector(got.ng, expected.ng);
        check_same_vector(got.to_light, expected.to_light);
        assert_true(got.distance == expected.distance && got.cos_light == expected.cos_light);
        assert_true(got.pdf_direct.v == expected.pdf_direct.v && got.pdf_position.v == expected.pdf_position.v);
        assert_true(got.pdf_direction.v == expected.pdf_direction.v);
        assert_true(got.next_event_ratio == expected.next_event_ratio);
        assert_true(got.radiance.r == expected.radiance.r && got.radiance.g == expected.radiance.g &&
                    got.radiance.b == expected.radiance.b);
    }
    assert_true(far > 100 && near > 100);
    ca_free(evens);
}

/* ---- Environments in lanes ------------------------------------------------------------------------------------- */

static void check_same_number(float got, float expected, const char *what)
{
    if (ca_float_bits(got) != ca_float_bits(expected))
        fail_msg("%s: %a, should be %a", what, (double)got, (double)expected);
}

static void check_lane(ca_v8 got, int k, ca_vec3 expected, const char *what)
{
    check_same_number(got.x[k], expected.x, what);
    check_same_number(got.y[k], expected.y, what);
    check_same_number(got.z[k], expected.z, what);
}

static ca_vec3 vector_of(ca_rgb c) { return (ca_vec3){c.r, c.g, c.b}; }

static void check_direct_lanes(const ca_light *light, ca_test_random *random)
{
    ca_f8 u, v;
    for (int k = 0; k < CA_LANES; k++) {
        const ca_vec2 uv = random2(random);
        u[k] = uv.x, v[k] = k == 7 ? 0.0f : k == 6 ? CA_ONE_MINUS_EPSILON : uv.y;
    }
    const ca_environment8 got = ca_light_environment_direct8(light, u, v);
    for (int k = 0; k < CA_LANES; k++) {
        ca_light_direct expected;
        const bool lit = ca_light_sample_direct(light, (ca_vec3){0}, (ca_vec2){u[k], v[k]}, &expected);
        assert_int_equal(lit, got.pdf_direct[k] > 0.0f);
        if (!lit) continue;
        check_lane(got.to_light, k, expected.to_light, "direction of next event");
        check_lane(got.radiance, k, vector_of(expected.radiance), "radiance of next event");
        check_same_number(got.pdf_direct[k], expected.pdf_direct.v, "density of next event");
    }
}

static void check_hit_lanes(const ca_light *light, ca_test_random *random)
{
    ca_v8 to_light;
    ca_vec3 w[CA_LANES];
    for (int k = 0; k < CA_LANES; k++) {
        w[k] = ca_warp_sphere(random2(random));
        if (k == 6) w[k] = (ca_vec3){0.0f, w[k].y < 0.0f ? -1.0f : 1.0f, 0.0f};
        if (k == 7) w[k] = ca_normalize((ca_vec3){-0.8f, w[k].y, -0.6f}); /* on the seam */
        to_light.x[k] = w[k].x, to_light.y[k] = w[k].y, to_light.z[k] = w[k].z;
    }
    const ca_environment8 got = ca_light_environment_hit8(light, to_light);
    for (int k = 0; k < CA_LANES; k++) {
        const ca_light_hit expected = ca_light_eval_hit(light, (ca_vec3){0}, NULL, ca_neg(w[k]));
        check_lane(got.to_light, k, w[k], "direction");
        check_lane(got.radiance, k, vector_of(expected.radiance), "radiance");
        check_same_number(got.pdf_direct[k], expected.pdf_direct.v, "density");
    }
}

/* To the bit, poles and the picture's seam too. */
static void test_environment_lanes(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(32);
    for (int trial = 0; trial < 20000; trial++) {
        check_direct_lanes(&fixture.lights[LIGHT_ENVMAP], &random);
        check_hit_lanes(&fixture.lights[LIGHT_ENVMAP], &random);
        check_direct_lanes(&fixture.lights[LIGHT_CONSTANT], &random);
        check_hit_lanes(&fixture.lights[LIGHT_CONSTANT], &random);
    }
}

/* ---- Beams ----------------------------------------------------------------------------------------------------- */

static ca_light beam_of(const ca_shape *shape)
{
    ca_light light = {.kind = CA_LIGHT_BEAM, .textures = fixture.textures};
    light.as.beam.shape = shape;
    light.as.beam.exitance = 1;
    assert_int_equal(ca_light_prepare(&light, (ca_vec3){1.0f, 0.0f, -1.0f}, 10.0f, NULL), CA_OK);
    return light;
}

/* From where the light's shape is met along the axis, and only from there, a flat beam is found. */
static void check_prism(int shape)
{
    const ca_light light = beam_of(&fixture.shapes[shape]);
    ca_test_random random = ca_test_random_seed(40);
    ca_surface middle;
    ca_shape_sample_area(&fixture.shapes[shape], (ca_vec2){0.5f, 0.5f}, &middle);
    uint32_t found = 0;
    for (int k = 0; k < 20000; k++) {
        const ca_vec2 u = random2(&random);
        const ca_vec3 offset = {u.x - 0.5f, u.y - 0.5f, ca_test_random_float(&random) - 0.5f};
        const ca_vec3 reference = ca_madd(middle.position, 4.0f, offset);
        ca_light_direct direct;
        ca_surface met;
        float t;
        const bool meets =
            ca_light_fixture_trace(&fixture, shape, reference, ca_neg(middle.ng), 0.0f, &t, &met);
        assert_int_equal(ca_light_sample_direct(&light, reference, u, &direct), meets);
        if (!meets) continue;
        found++;
        assert_true(fabsf(direct.distance - t) < 1e-5f);
        assert_true(ca_length(ca_sub(direct.position, met.position)) < 1e-5f);
        assert_true(direct.pdf_direct.v == 1.0f && direct.pdf_direction.v == 1.0f);
        assert_true(close_to(direct.pdf_position.v * fixture.shapes[shape].area, 1.0f, 1e-6f));
    }
    assert_true(found > 1000);
    assert_true(ca_light_next_event_ratio(&light, (ca_vec3){0}, middle.position, middle.ng) == 1.0f);
}

static void check_not_found(const ca_light *light)
{
    ca_test_random random = ca_test_random_seed(41);
    for (int k = 0; k < 1000; k++) {
        ca_light_emission e;
        ca_light_direct direct;
        assert_true(ca_light_sample_emission(light, random2(&random), (ca_vec2){0}, &e));
        const ca_vec3 lit = ca_add(e.origin, e.direction);
        assert_false(ca_light_sample_direct(light, lit, (ca_vec2){0.5f, 0.5f}, &direct));
        assert_true(ca_light_next_event_ratio(light, lit, e.origin, e.ng) == 0.0f);
    }
    assert_false(ca_light_has_next_event(light));
}

static void test_beams(void **state)
{
    (void)state;
    check_prism(LIGHT_DISK);
    check_prism(LIGHT_RECTANGLE);
    const ca_light ball = beam_of(&fixture.shapes[LIGHT_SPHERE]);
    check_not_found(&ball);
    /* A rectangle with normals that lean outwards. */
    ca_mesh *mesh = &fixture.meshes[LIGHT_RECTANGLE - LIGHT_QUADRANGLE];
    float normals[12];
    for (size_t i = 0; i < 12; i++) normals[i] = mesh->positions[i] - (i % 3 == 0 ? 1.0f : 3.0f);
    mesh->normals = normals;
    const ca_light bent = beam_of(&fixture.shapes[LIGHT_RECTANGLE]);
    check_not_found(&bent);
    mesh->normals = NULL;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_direct_agrees_with_hits),
        cmocka_unit_test(test_emission_agrees),
        cmocka_unit_test(test_even_lights),
        cmocka_unit_test(test_irradiance),
        cmocka_unit_test(test_power),
        cmocka_unit_test(test_area_closed_forms),
        cmocka_unit_test(test_other_closed_forms),
        cmocka_unit_test(test_narrow_spot),
        cmocka_unit_test(test_projector_picture),
        cmocka_unit_test(test_envmap_orientation),
        cmocka_unit_test(test_envmap_integrals),
        cmocka_unit_test(test_envmap_density_follows_luminance),
        cmocka_unit_test(test_environment_lanes),
        cmocka_unit_test(test_beams),
    };
    return cmocka_run_group_tests_name("light", tests, set_up, tear_down);
}
