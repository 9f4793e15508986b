#include "bench_scenes.h"

#include "math/numeric.h"

#include <math.h>

/* One more diffuse material, by its id. */
static uint32_t add_diffuse(ca_scene_desc *desc, ca_rgb reflectance)
{
    const ca_texture_id id = ca_scene_desc_add_constant(desc, reflectance);
    if (id == CA_NONE || !CA_TABLE_ADD(&desc->materials)) return CA_NONE;
    desc->materials.items[desc->materials.count - 1].material =
        (ca_material){.kind = CA_MATERIAL_DIFFUSE, .as.diffuse = {id}};
    return (uint32_t)desc->materials.count - 1;
}

static ca_shape_desc *add_mesh(ca_scene_desc *desc, uint32_t material)
{
    if (material == CA_NONE || !CA_TABLE_ADD(&desc->meshes) || !CA_TABLE_ADD(&desc->shapes)) return NULL;
    ca_shape_desc *shape = &desc->shapes.items[desc->shapes.count - 1];
    *shape = (ca_shape_desc){.kind = CA_SHAPE_MESH,
                             .as.mesh.index = (uint32_t)desc->meshes.count - 1,
                             .to_world = ca_matrix_identity(),
                             .material = material,
                             .light = CA_NONE,
                             .group = CA_NONE};
    return shape;
}

/* Hills of several wavelengths over [-1, 1]^2, y up. */
static float hill(float x, float z)
{
    return 0.10f * sinf(7.0f * x) * cosf(5.0f * z) + 0.03f * sinf(31.0f * x + 3.0f * z) +
           0.008f * sinf(173.0f * x) * sinf(151.0f * z);
}

static ca_status terrain(ca_mesh *mesh, uint32_t columns, uint32_t rows, ca_error *error)
{
    CA_TRY(ca_mesh_create(mesh, (size_t)(columns + 1) * (rows + 1), 2 * (size_t)columns * rows, false, false, error));
    for (uint32_t j = 0; j <= rows; j++)
        for (uint32_t i = 0; i <= columns; i++) {
            float *p = mesh->positions + 3 * ((size_t)j * (columns + 1) + i);
            p[0] = 2.0f * (float)i / (float)columns - 1.0f;
            p[2] = 2.0f * (float)j / (float)rows - 1.0f;
            p[1] = -0.7f + hill(p[0], p[2]);
        }
    uint32_t *index = mesh->indices;
    for (uint32_t j = 0; j < rows; j++)
        for (uint32_t i = 0; i < columns; i++) {
            const uint32_t a = j * (columns + 1) + i, b = a + columns + 1;
            const uint32_t corners[6] = {a, b, a + 1, a + 1, b, b + 1};
            for (int k = 0; k < 6; k++) *index++ = corners[k];
        }
    return CA_OK;
}

/* A ball of 32 x 64 quads whose radius swells and shrinks over its surface. */
static ca_status bumpy_ball(ca_mesh *mesh, ca_vec3 center, float radius, ca_error *error)
{
    enum { RINGS = 32, SEGMENTS = 64 };
    CA_TRY(ca_mesh_create(mesh, (RINGS + 1) * SEGMENTS, 2 * RINGS * SEGMENTS, false, false, error));
    for (uint32_t r = 0; r <= RINGS; r++)
        for (uint32_t s = 0; s < SEGMENTS; s++) {
            const float theta = CA_PI * (float)r / RINGS, phi = CA_TWO_PI * (float)s / SEGMENTS;
            const float swell = radius * (1.0f + 0.1f * sinf(9.0f * theta) * sinf(7.0f * phi) * sinf(theta));
            float *p = mesh->positions + 3 * (r * SEGMENTS + s);
            p[0] = center.x + swell * sinf(theta) * cosf(phi);
            p[1] = center.y + swell * cosf(theta);
            p[2] = center.z + swell * sinf(theta) * sinf(phi);
        }
    uint32_t *index = mesh->indices;
    for (uint32_t r = 0; r < RINGS; r++)
        for (uint32_t s = 0; s < SEGMENTS; s++) {
            const uint32_t a = r * SEGMENTS + s, b = r * SEGMENTS + (s + 1) % SEGMENTS;
            const uint32_t corners[6] = {a, b, a + SEGMENTS, b, b + SEGMENTS, a + SEGMENTS};
            for (int k = 0; k < 6; k++) *index++ = corners[k];
        }
    return CA_OK;
}

/* The walls and the lamp; the camera looks from the front into the room. */
static ca_status fill_room(ca_scene_desc *desc, ca_error *error)
{
    const uint32_t white = add_diffuse(desc, ca_rgb_grey(0.7f));
    ca_shape_desc *room = add_mesh(desc, white);
    if (!room) return ca_fail_memory(error, "the bench scene");
    room->flip_normals = true; /* seen from inside */
    CA_TRY(ca_mesh_create_cube(&desc->meshes.items[0], error));
    ca_shape_desc *lamp = add_mesh(desc, white);
    if (!lamp || !CA_TABLE_ADD(&desc->lights)) return ca_fail_memory(error, "the bench scene");
    CA_TRY(ca_mesh_create_rectangle(&desc->meshes.items[1], error));
    const ca_matrix turn = ca_matrix_rotate(1, 0, 0, 90.0), shrink = ca_matrix_scale(0.2, 0.2, 1.0);
    const ca_matrix up = ca_matrix_translate(0, 0.99, 0);
    lamp->to_world = ca_matrix_multiply(&turn, &shrink);
    lamp->to_world = ca_matrix_multiply(&up, &lamp->to_world);
    lamp->light = 0;
    desc->lights.items[0] = (ca_light_desc){
        .kind = CA_LIGHT_AREA, .as.area.radiance = ca_scene_desc_add_constant(desc, ca_rgb_grey(20.0f))};
    const double origin[3] = {0.0, 0.3, -0.95}, target[3] = {0.0, -0.4, 0.2}, up_axis[3] = {0, 1, 0};
    ca_matrix look;
    ca_matrix_look_at(origin, target, up_axis, &look);
    if (!ca_affine_from_matrix(&look, &desc->camera.camera.map)) return CA_ERROR_SCENE;
    desc->camera.fov_degrees = 60.0;
    desc->film.width = desc->film.height = desc->film.crop_width = desc->film.crop_height = 256;
    return CA_OK;
}

static ca_status fill_terrain(ca_scene_desc *desc, ca_error *error)
{
    desc->path = "bench: terrain";
    if (!add_mesh(desc, add_diffuse(desc, ca_rgb_make(0.3f, 0.6f, 0.2f)))) return ca_fail_memory(error, "terrain");
    return terrain(&desc->meshes.items[desc->meshes.count - 1], 1000, 500, error);
}

/* On a slightly disordered 8 x 4 x 8 lattice, clear of the camera and the lamp. */
static ca_status fill_balls(ca_scene_desc *desc, ca_error *error)
{
    desc->path = "bench: balls";
    const uint32_t blue = add_diffuse(desc, ca_rgb_make(0.3f, 0.4f, 0.8f));
    for (int i = 0; i < 256; i++) {
        const float jitter = 0.04f * sinf(12.9898f * (float)i);
        const ca_vec3 center = {-0.84f + 0.24f * (float)(i % 8) + jitter, -0.85f + 0.3f * (float)(i / 64) - jitter,
                                -0.6f + 0.21f * (float)(i / 8 % 8) + jitter};
        if (!add_mesh(desc, blue)) return ca_fail_memory(error, "balls");
        CA_TRY(bumpy_ball(&desc->meshes.items[desc->meshes.count - 1], center, 0.09f, error));
    }
    return CA_OK;
}

static ca_status make(ca_status (*fill)(ca_scene_desc *desc, ca_error *error), ca_scene **scene, ca_error *error)
{
    ca_scene_desc desc;
    ca_scene_desc_init(&desc);
    ca_status status = fill_room(&desc, error);
    if (status == CA_OK) status = fill(&desc, error);
    if (status != CA_OK) {
        ca_scene_desc_destroy(&desc);
        return status;
    }
    return ca_scene_compile(&desc, scene, error);
}

ca_status bench_scene_terrain(ca_scene **scene, ca_error *error) { return make(fill_terrain, scene, error); }
ca_status bench_scene_balls(ca_scene **scene, ca_error *error) { return make(fill_balls, scene, error); }
