#include "bench_scenes.h"

#include <math.h>

/* One more diffuse material, by its id. */
static uint32_t add_diffuse(ca_scene_desc *desc, ca_rgb reflectance)
{
    const ca_texture_id id = ca_scene_desc_add_constant(desc, reflectance);
    if (id == CA_NONE || !CA_TABLE_ADD(&desc->materials)) return CA_NONE;
    desc->materials.items[desc->materials.count - 1].material =
        (ca_material){.kind = CA_MATERIAL_DIFFUSE, .reflectance = id};
    return (uint32_t)desc->materials.count - 1;
}

static ca_shape_desc *add_mesh(ca_scene_desc *desc, uint32_t material)
{
    if (material == CA_NONE || !CA_TABLE_ADD(&desc->meshes) || !CA_TABLE_ADD(&desc->shapes)) return NULL;
    ca_shape_desc *shape = &desc->shapes.items[desc->shapes.count - 1];
    *shape = (ca_shape_desc){.kind = CA_SHAPE_MESH,
                             .mesh = (uint32_t)desc->meshes.count - 1,
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

static ca_status fill(ca_scene_desc *desc, ca_error *error)
{
    const uint32_t white = add_diffuse(desc, ca_rgb_grey(0.7f)), green = add_diffuse(desc, ca_rgb_make(0.3f, 0.6f, 0.2f));
    ca_shape_desc *room = add_mesh(desc, white);
    if (!room) return ca_fail_memory(error, "the bench scene");
    room->flip_normals = true; /* seen from inside */
    CA_TRY(ca_mesh_create_cube(&desc->meshes.items[0], error));
    if (!add_mesh(desc, green)) return ca_fail_memory(error, "the bench scene");
    CA_TRY(terrain(&desc->meshes.items[1], 1000, 500, error));
    ca_shape_desc *lamp = add_mesh(desc, white);
    if (!lamp || !CA_TABLE_ADD(&desc->lights)) return ca_fail_memory(error, "the bench scene");
    CA_TRY(ca_mesh_create_rectangle(&desc->meshes.items[2], error));
    ca_matrix place = ca_matrix_rotate(1, 0, 0, 90.0);
    const ca_matrix shrink = ca_matrix_scale(0.2, 0.2, 1.0), up = ca_matrix_translate(0, 0.99, 0);
    place = ca_matrix_multiply(&place, &shrink);
    lamp->to_world = ca_matrix_multiply(&up, &place);
    lamp->light = 0;
    const ca_texture_id radiance = ca_scene_desc_add_constant(desc, ca_rgb_grey(20.0f));
    desc->lights.items[0] = (ca_light_desc){.kind = CA_LIGHT_AREA, .to_world = ca_matrix_identity(), .texture = radiance};
    const double origin[3] = {0.0, 0.3, -0.95}, target[3] = {0.0, -0.4, 0.2}, up_axis[3] = {0, 1, 0};
    ca_matrix look;
    ca_matrix_look_at(origin, target, up_axis, &look);
    if (!ca_affine_from_matrix(&look, &desc->camera.camera.map)) return CA_ERROR_SCENE;
    desc->camera.fov_degrees = 60.0;
    desc->film.width = desc->film.height = desc->film.crop_width = desc->film.crop_height = 256;
    desc->path = "bench: a million triangles";
    return CA_OK;
}

ca_status bench_scene_million(ca_scene **scene, ca_error *error)
{
    ca_scene_desc desc;
    ca_scene_desc_init(&desc);
    const ca_status status = fill(&desc, error);
    if (status != CA_OK) {
        ca_scene_desc_destroy(&desc);
        return status;
    }
    return ca_scene_compile(&desc, scene, error);
}
