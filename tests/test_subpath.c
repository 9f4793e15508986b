/* Densities and footprints of a subpath's vertices, by hand: all techniques take them from the same functions, so one
 * that is wrong makes weights poor, not pictures wrong, and nothing but their numbers would show it. */
#include "path/subpath.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void assert_near(float got, double expected)
{
    if (!(fabs((double)got - expected) <= 1e-6 * fabs(expected)))
        fail_msg("%.9g instead of %.9g", (double)got, expected);
}

/* With epsilon 0.01 the density 0.2401 gives 1 / (0.01 + 0.49) = 2. */
static const ca_reuse_rules rules = {.kind = CA_REUSE_FOOTPRINT, .epsilon = 0.01f, .c = 0.5f};
static const ca_pdf_solid_angle pdf_two = {0.2401f};

static ca_flight leave_light(ca_light_kind kind, float pdf_position, float pdf_direction, ca_path_vertex *vertex)
{
    const ca_light light = {.kind = kind};
    return ca_light_end(&light, 0.25f, (ca_pdf_area){pdf_position}, (ca_pdf_solid_angle){pdf_direction}, 0.5f, &rules,
                        vertex);
}

/* 1 / 0.0625 = 16 m^2. */
static void test_area_light(void **state)
{
    (void)state;
    ca_path_vertex v;
    const ca_flight flight = leave_light(CA_LIGHT_AREA, 0.0625f, pdf_two.v, &v);
    assert_near(v.pdf_forward.v, 0.25 * 0.0625);
    assert_near(v.sqrt_area, 4.0);
    assert_near(v.light_choice, 0.25);
    assert_near(v.next_event_ratio, 1.0);
    assert_near(v.cos_ratio, 1.0);
    assert_false(v.at_infinity);
    assert_near(flight.pdf, (double)pdf_two.v);
    assert_near(flight.sqrt_area, 4.0);
    assert_near(flight.sqrt_omega, 2.0);
    assert_near(flight.cos_out, 0.5);
    assert_true(flight.reversible && !flight.parallel && !flight.from_infinity);
}

/* A point has no area and cannot be met by chance; a sun and a beam have one direction; a sky has a density of
 * directions. */
static void test_other_lights(void **state)
{
    (void)state;
    ca_path_vertex v;
    ca_flight flight = leave_light(CA_LIGHT_POINT, 1.0f, pdf_two.v, &v);
    assert_near(v.pdf_forward.v, 0.25);
    assert_true(v.sqrt_area == 0.0f && flight.sqrt_area == 0.0f && !flight.reversible && !flight.parallel);
    assert_near(flight.sqrt_omega, 2.0);

    flight = leave_light(CA_LIGHT_DIRECTIONAL, 0.0625f, 1.0f, &v);
    assert_near(v.pdf_forward.v, 0.25);
    assert_near(v.sqrt_area, 4.0);
    assert_near(flight.pdf, 0.0625);
    assert_true(flight.sqrt_omega == 0.0f && flight.parallel && flight.from_infinity && !flight.reversible);
    assert_true(v.at_infinity);

    flight = leave_light(CA_LIGHT_BEAM, 0.0625f, 1.0f, &v);
    assert_near(v.pdf_forward.v, 0.25);
    assert_near(flight.pdf, 0.0625);
    assert_true(flight.sqrt_omega == 0.0f && flight.parallel && !flight.from_infinity && !flight.reversible);
    assert_true(v.at_infinity);

    flight = leave_light(CA_LIGHT_CONSTANT, 0.0625f, pdf_two.v, &v);
    assert_near(v.pdf_forward.v, 0.25 * (double)pdf_two.v);
    assert_near(v.sqrt_area, 4.0);
    assert_near(flight.pdf, 0.0625);
    assert_near(flight.sqrt_omega, 2.0);
    assert_true(flight.parallel && flight.from_infinity && flight.reversible && v.at_infinity);
}

static ca_flight leave_camera(ca_camera_kind kind, float lens_radius, ca_path_vertex *vertex)
{
    const ca_camera camera = {.kind = kind, .as.thin_lens = {.lens_radius = lens_radius}};
    return ca_camera_end(&camera, (ca_pdf_area){0.0625f}, pdf_two, &rules, vertex);
}

static void test_cameras(void **state)
{
    (void)state;
    ca_path_vertex v;
    ca_flight flight = leave_camera(CA_CAMERA_PERSPECTIVE, 0.0f, &v);
    assert_near(flight.pdf, (double)pdf_two.v);
    assert_near(flight.sqrt_omega, 2.0);
    assert_true(v.sqrt_area == 0.0f && flight.sqrt_area == 0.0f && !flight.reversible && !flight.parallel);

    flight = leave_camera(CA_CAMERA_THIN_LENS, 0.1f, &v);
    assert_near(v.pdf_forward.v, 0.0625);
    assert_near(v.sqrt_area, 4.0);
    assert_near(flight.pdf, (double)pdf_two.v);
    assert_near(flight.sqrt_area, 4.0);

    flight = leave_camera(CA_CAMERA_ORTHOGRAPHIC, 0.0f, &v);
    assert_near(v.pdf_forward.v, 1.0);
    assert_near(flight.pdf, 0.0625);
    assert_near(flight.sqrt_area, 4.0);
    assert_true(flight.sqrt_omega == 0.0f && flight.parallel && !flight.reversible);
}

/* 2 m away, where the cosine is 1/4: 0.2401 * 0.25 / 4, and 0.5 / 4 back; the footprint grows by 2 * 2. */
static void test_arrival(void **state)
{
    (void)state;
    ca_path_vertex light, v;
    ca_flight flight = leave_light(CA_LIGHT_AREA, 0.0625f, pdf_two.v, &light);
    light.connectable_count = 3;
    ca_path_vertex_arrive(&v, &light, &flight, 2.0f, 0.25f, 7.0f);
    assert_near(v.pdf_forward.v, 0.2401 * 0.25 / 4.0);
    assert_near(v.to_previous, 0.5 / 4.0);
    assert_near(v.distance, 2.0);
    assert_near(v.sqrt_area, 4.0 + 2.0 * 2.0);
    assert_near(v.sqrt_omega, 2.0);
    assert_near(v.photon_density, 7.0);
    assert_int_equal(v.connectable_count, 3);
    assert_int_equal(v.connectable, 0);

    flight = leave_light(CA_LIGHT_CONSTANT, 0.0625f, pdf_two.v, &light);
    ca_path_vertex_arrive(&v, &light, &flight, 2.0f, 0.25f, 0.0f);
    assert_near(v.pdf_forward.v, 0.0625 * 0.25);
    assert_near(v.to_previous, 1.0);
    flight = leave_light(CA_LIGHT_POINT, 1.0f, pdf_two.v, &light);
    ca_path_vertex_arrive(&v, &light, &flight, 2.0f, 0.25f, 0.0f);
    assert_true(v.to_previous == 0.0f);
}

/* A vertex 2 m from an area light, and the event there: from 60 degrees to the normal's direction. */
static ca_flight scatter(const ca_reuse_rules *reuse, uint32_t kind, float eta, ca_path_vertex *light,
                         ca_path_vertex *v)
{
    const ca_vec3 ng = {0.0f, 0.0f, 1.0f}, wi = {sqrtf(0.75f), 0.0f, 0.5f};
    const ca_bsdf_sample event = {.wo_world = ng,
                                  .pdf = {15.9201f},
                                  .pdf_reverse = pdf_two,
                                  .scatter = CA_SCATTER_REFLECTION | kind,
                                  .eta = eta};
    const ca_flight flight = leave_light(CA_LIGHT_AREA, 0.0625f, pdf_two.v, light);
    light->connectable_count = 3;
    ca_path_vertex_arrive(v, light, &flight, 2.0f, 0.5f, 0.0f);
    return ca_path_vertex_scatter(v, light, wi, ng, &event, reuse);
}

/* Of the density 15.9201 the spread is 1 / (0.01 + 3.99) = 0.25. */
static void test_scattering(void **state)
{
    (void)state;
    ca_path_vertex light, v;
    ca_flight flight = scatter(&rules, CA_SCATTER_SMOOTH, 1.0f, &light, &v);
    assert_near(light.pdf_reverse.v, 0.2401 * 0.5 / 4.0);
    assert_near(v.spread_reverse, 2.0);
    assert_near(v.cos_ratio, 2.0);
    assert_int_equal(v.connectable, 1);
    assert_int_equal(v.connectable_count, 4);
    assert_near(flight.pdf, 15.9201);
    assert_near(flight.cos_out, 1.0);
    assert_near(flight.sqrt_area, 8.0);
    assert_near(flight.sqrt_omega, 2.25);
    assert_true(flight.reversible && !flight.parallel);

    ca_reuse_rules projected = rules;
    projected.projected = true;
    flight = scatter(&projected, CA_SCATTER_SMOOTH, 1.0f, &light, &v);
    assert_near(flight.sqrt_area, 8.0 * sqrt(2.0));

    flight = scatter(&rules, CA_SCATTER_DIRAC, 1.0f, &light, &v);
    assert_near(light.pdf_reverse.v, 0.2401 * 0.5 / 4.0);
    assert_near(flight.sqrt_omega, 2.0);
    assert_true(v.spread_reverse == 0.0f && v.connectable == 0 && v.connectable_count == 3);
    scatter(&rules, CA_SCATTER_DIRAC, 2.0f, &light, &v);
    /* The normal is along wi + 2 wo: its products are wi.(wi + 2 wo) = 1 + 2 / 2 and wo.(wi + 2 wo) = 1/2 + 2. */
    const double jacobian = (1.0 + 2.0 * 0.5) / (4.0 * (0.5 + 2.0));
    assert_near(light.pdf_reverse.v, jacobian * 0.2401 * 0.5 / 4.0);
}

/* d(omega out) / d(omega in) of refraction at 30 degrees into glass of 1.5: cos i / (n^2 cos o), sin o = 1/3. */
static void test_dirac_jacobian(void **state)
{
    (void)state;
    const ca_vec3 wi = {0.5f, 0.0f, sqrtf(0.75f)}, wo = {-1.0f / 3.0f, 0.0f, -sqrtf(8.0f / 9.0f)};
    assert_near(ca_dirac_jacobian(wi, wo, 1.5f), sqrt(0.75) / (2.25 * sqrt(8.0 / 9.0)));
    assert_near(ca_dirac_jacobian(wo, wi, 1.0f / 1.5f), 2.25 * sqrt(8.0 / 9.0) / sqrt(0.75));
    assert_near(ca_dirac_jacobian(wi, (ca_vec3){-0.5f, 0.0f, wi.z}, 1.0f), 1.0);
}

/* A sphere of radius 1 seen from 2 m: cone density 1 / (2 pi (1 - sqrt 0.75)) over 1 / (4 pi). Others: as they are
 * sampled by area. */
static void test_next_event_ratio(void **state)
{
    (void)state;
    const ca_shape sphere = {.kind = CA_SHAPE_SPHERE, .area = 4.0f * CA_PI, .as.sphere = {.radius = 1.0f}};
    const ca_shape disk = {.kind = CA_SHAPE_DISK, .area = CA_PI};
    const ca_vec3 reference = {0.0f, 0.0f, 2.0f}, position = {0.0f, 0.0f, 1.0f};
    ca_light light = {.kind = CA_LIGHT_AREA, .as.area = {.shape = &sphere}};
    const double cone = 1.0 / (2.0 * CA_PI_D * (1.0 - sqrt(0.75)));
    assert_near(ca_light_next_event_ratio(&light, reference, position, position), 4.0 * CA_PI_D * cone);
    const ca_vec3 slanted = {0.0f, 0.6f, 0.8f}; /* |cos| 0.8 there */
    assert_near(ca_light_next_event_ratio(&light, reference, position, slanted), 4.0 * CA_PI_D * cone * 0.8);
    light.as.area.shape = &disk;
    assert_near(ca_light_next_event_ratio(&light, reference, position, position), 1.0);
    light = (ca_light){.kind = CA_LIGHT_POINT};
    assert_near(ca_light_next_event_ratio(&light, reference, position, position), 1.0);
}

/* The emitting disk touches the scene's bounding sphere. */
static void test_disk_distance(void **state)
{
    (void)state;
    const ca_light light = {.kind = CA_LIGHT_DIRECTIONAL, .scene_center = {1.0f, 2.0f, 3.0f}, .scene_radius = 5.0f};
    const ca_vec3 down = {0.0f, 0.0f, -1.0f};
    assert_near(ca_light_disk_distance(&light, down, (ca_vec3){9.0f, 9.0f, 3.0f}), 5.0);
    assert_near(ca_light_disk_distance(&light, down, (ca_vec3){9.0f, 9.0f, 1.0f}), 7.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_area_light),       cmocka_unit_test(test_other_lights),
        cmocka_unit_test(test_cameras),          cmocka_unit_test(test_arrival),
        cmocka_unit_test(test_scattering),       cmocka_unit_test(test_dirac_jacobian),
        cmocka_unit_test(test_next_event_ratio), cmocka_unit_test(test_disk_distance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
