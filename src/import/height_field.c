/* Height fields: pictures that are surfaces. */
#include "import/import.h"

#include "base/memory.h"

#include <math.h>
#include <string.h>

void ca_import_grid_triangles(size_t columns, size_t rows, uint32_t *indices)
{
    for (size_t y = 0; y + 1 < rows; y++)
        for (size_t x = 0; x + 1 < columns; x++) {
            const uint32_t a = (uint32_t)(y * columns + x), b = a + 1, c = b + (uint32_t)columns, d = c - 1;
            const uint32_t corners[6] = {a, b, c, a, c, d};
            memcpy(indices, corners, sizeof corners);
            indices += 6;
        }
}

static void place_vertices(const ca_image *image, float scale, ca_mesh *mesh)
{
    const float width = (float)(image->width - 1), height = (float)(image->height - 1);
    float *position = mesh->positions, *uv = mesh->uvs;
    for (uint32_t y = 0; y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++) {
            *uv++ = (float)x / width;
            *uv++ = (float)y / height;
            *position++ = 2.0f * (float)x / width - 1.0f;
            *position++ = 2.0f * (float)y / height - 1.0f;
            *position++ = scale * ca_luminance(ca_image_rgb(image, x, y));
        }
}

/* The slope along one axis, in heights a step: that of the cells on both sides, of one at the border. */
static float slope(const float *height, size_t step, size_t index, size_t count)
{
    const float before = index > 0 ? height[0] - height[-3 * (ptrdiff_t)step] : 0.0f;
    const float behind = index + 1 < count ? height[3 * step] - height[0] : 0.0f;
    return index > 0 && index + 1 < count ? 0.5f * (before + behind) : before + behind;
}

static void set_normals(const ca_image *image, ca_mesh *mesh)
{
    const float per_x = 0.5f * (float)(image->width - 1), per_y = 0.5f * (float)(image->height - 1);
    for (uint32_t y = 0; y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++) {
            const size_t vertex = (size_t)y * image->width + x;
            const float *height = mesh->positions + 3 * vertex + 2;
            float *normal = mesh->normals + 3 * vertex;
            normal[0] = -per_x * slope(height, 1, x, image->width);
            normal[1] = -per_y * slope(height, image->width, y, image->height);
            normal[2] = 1.0f;
        }
    ca_mesh_normalize_normals(mesh);
}

ca_status ca_import_height_field(const ca_image *image, float scale, bool smooth, ca_mesh *mesh, ca_error *error)
{
    *mesh = (ca_mesh){0};
    if (image->width < 2 || image->height < 2)
        return ca_fail(error, CA_ERROR_SCENE, NULL,
                       "a height field needs 2 x 2 heights, and this picture has %u x %u", image->width,
                       image->height);
    const size_t vertices = (size_t)image->width * image->height;
    const size_t triangles = 2 * (size_t)(image->width - 1) * (image->height - 1);
    CA_TRY(ca_mesh_create(mesh, vertices, triangles, smooth, true, error));
    place_vertices(image, scale, mesh);
    ca_import_grid_triangles(image->width, image->height, mesh->indices);
    if (smooth) set_normals(image, mesh);
    const ca_status status = ca_mesh_validate(mesh, "a height field", error);
    if (status != CA_OK) ca_mesh_destroy(mesh);
    return status;
}
