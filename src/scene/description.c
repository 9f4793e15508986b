#include "scene/description.h"

#include "geometry/curve.h"
#include "geometry/sdf_grid.h"

#include <string.h>

void *ca_table_room(void *items, size_t count, size_t *capacity, size_t size)
{
    void *grown = ca_array_grow(items, capacity, count + 1, size);
    return grown ? grown : items;
}

bool ca_table_append(void *items, size_t *count, size_t capacity, size_t size)
{
    /* Indices are 32 bits, and UINT32_MAX is CA_NONE. */
    if (*count == capacity || *count >= UINT32_MAX - 1) return false;
    memset((unsigned char *)items + *count * size, 0, size);
    ++*count;
    return true;
}

void ca_scene_desc_init(ca_scene_desc *desc)
{
    *desc = (ca_scene_desc){0};
    desc->camera.camera.kind = CA_CAMERA_PERSPECTIVE;
    const ca_matrix identity = ca_matrix_identity();
    (void)ca_affine_from_matrix(&identity, &desc->camera.camera.map);
    desc->camera.camera.near_clip = 1e-2f;
    desc->camera.camera.far_clip = 1e4f;
    desc->camera.fov_axis = CA_FOV_DIAGONAL;
    desc->camera.fov_degrees = 46.79300; /* 2 atan(|(36, 24)| / (2 * 50)) */
    desc->film = (ca_film_desc){.width = 768, .height = 576, .crop_width = 768, .crop_height = 576};
    desc->film.filter = ca_filter_default(CA_RFILTER_GAUSSIAN);
    desc->sampler = (ca_sampler){.kind = CA_SAMPLER_INDEPENDENT};
    desc->samples_per_pixel = 4;
}

void ca_scene_desc_destroy(ca_scene_desc *desc)
{
    for (size_t i = 0; i < desc->images.count; i++) ca_image_destroy(&desc->images.items[i]);
    for (size_t i = 0; i < desc->meshes.count; i++) ca_mesh_destroy(&desc->meshes.items[i]);
    for (size_t i = 0; i < desc->curves.count; i++) ca_curve_destroy(desc->curves.items[i]);
    for (size_t i = 0; i < desc->grids.count; i++) ca_sdf_grid_destroy(desc->grids.items[i]);
    ca_free(desc->files.items);
    ca_free(desc->textures.items);
    ca_free(desc->images.items);
    ca_free(desc->materials.items);
    ca_free(desc->meshes.items);
    ca_free(desc->curves.items);
    ca_free(desc->grids.items);
    ca_free(desc->shapes.items);
    ca_free(desc->groups.items);
    ca_free(desc->instances.items);
    ca_free(desc->lights.items);
    ca_free(desc->integrator.parameters.items);
    ca_free(desc->integrator.aovs.items);
    ca_free(desc->notes.items);
    ca_arena_clear(&desc->strings);
    *desc = (ca_scene_desc){0};
}

ca_matrix ca_cylinder_frame(const double p0[3], const double p1[3], double r)
{
    const ca_vec3 axis = {(float)(p1[0] - p0[0]), (float)(p1[1] - p0[1]), (float)(p1[2] - p0[2])};
    const float length = ca_length(axis);
    const ca_vec3 up = {0.0f, 0.0f, 1.0f};
    const ca_frame f = ca_frame_from_normal(length > 0.0f ? ca_mul(axis, 1.0f / length) : up);
    return (ca_matrix){{{(double)f.s.x * r, (double)f.t.x * r, p1[0] - p0[0], p0[0]},
                        {(double)f.s.y * r, (double)f.t.y * r, p1[1] - p0[1], p0[1]},
                        {(double)f.s.z * r, (double)f.t.z * r, p1[2] - p0[2], p0[2]},
                        {0, 0, 0, 1}}};
}

bool ca_is_round_cylinder(const ca_matrix *map)
{
    double dot[3][3] = {{0.0}};
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            for (int row = 0; row < 3; row++) dot[a][b] += map->m[row][a] * map->m[row][b];
    const double across = dot[0][0], slant = 1e-4 * sqrt(across * dot[2][2]);
    return fabs(dot[1][1] - across) <= 1e-4 * across && fabs(dot[0][1]) <= 1e-4 * across &&
           fabs(dot[0][2]) <= slant && fabs(dot[1][2]) <= slant;
}

ca_texture_id ca_scene_desc_add_constant(ca_scene_desc *desc, ca_rgb value)
{
    if (!CA_TABLE_ADD(&desc->textures)) return CA_NONE;
    const ca_texture_id id = (ca_texture_id)(desc->textures.count - 1);
    desc->textures.items[id] = ca_texture_constant(value);
    return id;
}
