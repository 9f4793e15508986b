#include "support/light_fixture.h"

#include "math/numeric.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

const char *const ca_test_light_names[LIGHT_COUNT] = {
    "sphere", "sphere from inside", "disk",        "cylinder",  "quadrangle", "rectangle", "point",
    "spot",   "spot with slide",    "directional", "projector", "constant",  "envmap",    "beam"};

static ca_affine affine(const double m[3][4])
{
    ca_matrix matrix = {{{0}, {0}, {0}, {0, 0, 0, 1}}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) matrix.m[i][j] = m[i][j];
    ca_affine map;
    assert_true(ca_affine_from_matrix(&matrix, &map));
    return map;
}

static ca_shape sphere(ca_vec3 center, float radius, bool inward)
{
    const double r = (double)radius;
    return (ca_shape){.kind = CA_SHAPE_SPHERE,
                      .flip_normals = inward,
                      .area = 4.0f * CA_PI * radius * radius,
                      .as.sphere = {.map = affine((const double[3][4]){{r, 0, 0, (double)center.x},
                                                                       {0, 0, -r, (double)center.y},
                                                                       {0, r, 0, (double)center.z}}),
                                    .center = center,
                                    .radius = radius}};
}

static ca_shape disk(void)
{
    /* s = (0.9, 0.2, 0), t = (0, -0.1, 1.3); n = s x t points down. */
    ca_shape shape = {.kind = CA_SHAPE_DISK,
                      .as.disk.map = affine(
                          (const double[3][4]){{0.9, 0, 0.2, -2}, {0.2, -0.1, -1, 3}, {0, 1.3, 0, 1}})};
    shape.area = CA_PI * ca_length(ca_cross((ca_vec3){0.9f, 0.2f, 0.0f}, (ca_vec3){0.0f, -0.1f, 1.3f}));
    return shape;
}

static ca_shape cylinder(void)
{
    /* Axis (0, 0.6, 0.8) of length 1.5, radius 0.4. */
    return (ca_shape){.kind = CA_SHAPE_CYLINDER,
                      .area = CA_TWO_PI * 0.4f * 1.5f,
                      .as.cylinder = {.map = affine((const double[3][4]){{0.4, 0, 0, 2},
                                                                         {0, 0.4 * 0.8, 1.5 * 0.6, 3},
                                                                         {0, -0.4 * 0.6, 1.5 * 0.8, 1}}),
                                      .radius = 0.4f,
                                      .length = 1.5f}};
}

static void create_mesh_light(ca_light_fixture *fixture, int light, const float corners[4][5])
{
    ca_mesh *mesh = &fixture->meshes[light - LIGHT_QUADRANGLE];
    assert_int_equal(ca_mesh_create(mesh, 4, 2, false, true, NULL), CA_OK);
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 3; k++) mesh->positions[3 * i + k] = corners[i][k];
        mesh->uvs[2 * i] = corners[i][3];
        mesh->uvs[2 * i + 1] = corners[i][4];
    }
    for (int i = 0; i < 6; i++) mesh->indices[i] = indices[i];
    ca_shape *shape = &fixture->shapes[light];
    *shape = (ca_shape){.kind = CA_SHAPE_MESH, .as.mesh = {.mesh = mesh, .extent = 4.0f}};
    shape->as.mesh.rectangle = ca_rectangle_from_mesh(mesh);
    float areas[2];
    for (uint32_t i = 0; i < 2; i++) shape->area += areas[i] = (float)ca_mesh_triangle_area(mesh, i);
    assert_int_equal(ca_distribution_1d_create(&shape->as.mesh.triangles, areas, 2, NULL), CA_OK);
}

static void create_meshes(ca_light_fixture *fixture)
{
    create_mesh_light(fixture, LIGHT_QUADRANGLE,
                      (const float[4][5]){{-1, 4, -2, 0, 0},
                                          {1.5f, 4, -2, 1, 0},
                                          {1.5f, 4, 1, 1, 1},
                                          {-1, 4, 1.2f, 0, 1}});
    /* Sides 2 (0.6, -0.8, 0) and 1.5 (0, 0, 1); it faces down and to the left. */
    create_mesh_light(fixture, LIGHT_RECTANGLE,
                      (const float[4][5]){{-1.6f, 3.8f, -0.25f, 0, 0},
                                          {-0.4f, 2.2f, -0.25f, 1, 0},
                                          {-0.4f, 2.2f, 1.25f, 1, 1},
                                          {-1.6f, 3.8f, 1.25f, 0, 1}});
    assert_true(fixture->shapes[LIGHT_RECTANGLE].as.mesh.rectangle.exists);
    assert_false(fixture->shapes[LIGHT_QUADRANGLE].as.mesh.rectangle.exists);
}

static void create_pictures(ca_light_fixture *fixture)
{
    assert_int_equal(ca_image_create(&fixture->picture, 6, 4, 3, NULL), CA_OK);
    for (int i = 0; i < 6 * 4 * 3; i++) fixture->picture.data[i] = (i / 3) % 6 < 3 ? 0.0f : 0.2f * (float)(i % 17);
    assert_int_equal(ca_image_create(&fixture->environment, 16, 9, 3, NULL), CA_OK);
    for (int i = 0; i < 16 * 9; i++)
        for (int c = 0; c < 3; c++)
            fixture->environment.data[3 * i + c] = i % 7 == 3 ? (float)(1 + i % 5 + c) : i == 40 ? 30.0f : 0.0f;
    const ca_texture bitmap = {
        .kind = CA_TEXTURE_BITMAP,
        .to_uv = {{1, 0, 0}, {0, 1, 0}},
        .as.bitmap = {.image = &fixture->picture, .filter = CA_FILTER_BILINEAR, .wrap = CA_WRAP_CLAMP}};
    fixture->textures[0] = bitmap;
    fixture->textures[1] = ca_texture_constant((ca_rgb){2.0f, 3.0f, 1.0f});
    fixture->textures[2] = bitmap;
}

static void assert_all_kinds(const ca_light_fixture *fixture)
{
    bool there[CA_LIGHT_KIND_COUNT] = {false};
    for (int i = 0; i < LIGHT_COUNT; i++) there[fixture->lights[i].kind] = true;
    for (int kind = 0; kind < CA_LIGHT_KIND_COUNT; kind++)
        if (!there[kind]) fail_msg("no light of kind %d", kind);
}

static void create_lights(ca_light_fixture *fixture)
{
    /* Their z looks down, -y of the world. */
    static const double down[3][4] = {{1, 0, 0, 0}, {0, 0, -1, 5}, {0, 1, 0, 0}};
    static const double turned[3][4] = {{0.6, 0, 0.8, 0}, {0, 1, 0, 0}, {-0.8, 0, 0.6, 0}};
    const ca_rgb color = {5.0f, 4.0f, 3.0f};
    ca_light *lights = fixture->lights;
    for (int i = 0; i < LIGHT_SHAPES; i++)
        lights[i] = (ca_light){
            .kind = CA_LIGHT_AREA,
            .as.area = {.shape = &fixture->shapes[i], .radiance = i == LIGHT_QUADRANGLE ? 0 : 1}};
    lights[LIGHT_POINT] =
        (ca_light){.kind = CA_LIGHT_POINT, .as.point = {.position = {0.5f, 4.0f, 0.2f}, .intensity = color}};
    for (int i = LIGHT_SPOT; i <= LIGHT_SPOT_SLIDE; i++)
        lights[i] = (ca_light){.kind = CA_LIGHT_SPOT,
                               .as.spot = {.map = affine(down),
                                           .position = {0.3f, 5.0f, 0.1f},
                                           .intensity = color,
                                           .texture = i == LIGHT_SPOT ? CA_NONE : 2,
                                           .cutoff = 50.0f * CA_PI / 180.0f,
                                           .beam = 30.0f * CA_PI / 180.0f}};
    lights[LIGHT_DIRECTIONAL] =
        (ca_light){.kind = CA_LIGHT_DIRECTIONAL,
                   .as.directional = {.direction = ca_normalize((ca_vec3){0.3f, -1.0f, 0.2f}), .irradiance = color}};
    lights[LIGHT_PROJECTOR] = (ca_light){.kind = CA_LIGHT_PROJECTOR,
                                         .as.projector = {.map = affine(down),
                                                          .position = {-0.2f, 5.0f, 0.3f},
                                                          .picture = 2,
                                                          .scale = color,
                                                          .tan_half_x = 0.6f,
                                                          .tan_half_y = 0.4f}};
    lights[LIGHT_CONSTANT] = (ca_light){.kind = CA_LIGHT_CONSTANT, .as.constant.radiance = color};
    lights[LIGHT_ENVMAP] =
        (ca_light){.kind = CA_LIGHT_ENVMAP,
                   .as.envmap = {.map = affine(turned), .image = &fixture->environment, .scale = color}};
    lights[LIGHT_BEAM] = (ca_light){.kind = CA_LIGHT_BEAM,
                                    .as.beam = {.shape = &fixture->shapes[LIGHT_RECTANGLE], .exitance = 0}};
    assert_all_kinds(fixture);
    for (int i = 0; i < LIGHT_COUNT; i++) lights[i].textures = fixture->textures;
    for (int i = 0; i < LIGHT_COUNT; i++)
        assert_int_equal(ca_light_prepare(&lights[i], (ca_vec3){1.0f, 0.0f, -1.0f}, 10.0f, NULL), CA_OK);
}

void ca_light_fixture_create(ca_light_fixture *fixture)
{
    *fixture = (ca_light_fixture){0};
    create_pictures(fixture);
    fixture->shapes[LIGHT_SPHERE] = sphere((ca_vec3){0.0f, 3.0f, 0.0f}, 0.7f, false);
    fixture->shapes[LIGHT_SPHERE_IN] = sphere((ca_vec3){0.0f, 0.0f, 0.0f}, 6.0f, true);
    fixture->shapes[LIGHT_DISK] = disk();
    fixture->shapes[LIGHT_CYLINDER] = cylinder();
    create_meshes(fixture);
    for (int i = 0; i < LIGHT_SHAPES; i++)
        assert_int_equal(ca_accel_create(&fixture->shapes[i], 1, 1, NULL, 0, 1, NULL, &fixture->accels[i], NULL),
                         CA_OK);
    create_lights(fixture);
}

void ca_light_fixture_destroy(ca_light_fixture *fixture)
{
    for (int i = 0; i < LIGHT_COUNT; i++) ca_light_release(&fixture->lights[i]);
    for (int i = 0; i < LIGHT_SHAPES; i++) ca_accel_destroy(fixture->accels[i]);
    for (int i = 0; i < 2; i++) {
        ca_distribution_1d_destroy(&fixture->shapes[LIGHT_QUADRANGLE + i].as.mesh.triangles);
        ca_mesh_destroy(&fixture->meshes[i]);
    }
    ca_image_destroy(&fixture->picture);
    ca_image_destroy(&fixture->environment);
}

ca_vec3 ca_light_fixture_reference(int light)
{
    if (light == LIGHT_RECTANGLE || light == LIGHT_BEAM) return (ca_vec3){-2.1f, 1.9f, 0.3f};
    return light == LIGHT_SPHERE_IN ? (ca_vec3){2.0f, -1.0f, 3.0f} : (ca_vec3){0.4f, 0.2f, 0.3f};
}

bool ca_light_fixture_trace(const ca_light_fixture *fixture, int shape, ca_vec3 origin, ca_vec3 direction,
                            float t_min, float *t, ca_surface *surface)
{
    ca_hit hit;
    if (!ca_accel_intersect(fixture->accels[shape], origin, direction, t_min, INFINITY, &hit)) return false;
    ca_accel_surface(fixture->accels[shape], origin, direction, &hit, surface);
    *t = hit.t;
    return true;
}
