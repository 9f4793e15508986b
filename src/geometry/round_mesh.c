/* Spheres and cylinders as meshes, for maps that the exact shapes cannot have. */
#include "geometry/mesh.h"

#include "math/numeric.h"

enum { AROUND = 128, DOWN = 64 };

/* Two triangles for each cell of a grid of (columns + 1) x (rows + 1) vertices, row by row; the outside is where
 * columns run to the right and rows run down. */
static void connect_grid(ca_mesh *mesh, uint32_t columns, uint32_t rows)
{
    uint32_t *index = mesh->indices;
    for (uint32_t row = 0; row < rows; row++)
        for (uint32_t column = 0; column < columns; column++) {
            const uint32_t a = row * (columns + 1) + column, b = a + columns + 1;
            const uint32_t corners[6] = {a, b, b + 1, a, b + 1, a + 1};
            for (int i = 0; i < 6; i++) *index++ = corners[i];
        }
}

static void set_vertex(ca_mesh *mesh, uint32_t vertex, const double position[3], const double normal[3], double u,
                       double v)
{
    for (int i = 0; i < 3; i++) {
        mesh->positions[3 * (size_t)vertex + (size_t)i] = (float)position[i];
        mesh->normals[3 * (size_t)vertex + (size_t)i] = (float)normal[i];
    }
    mesh->uvs[2 * (size_t)vertex] = (float)u;
    mesh->uvs[2 * (size_t)vertex + 1] = (float)v;
}

/* uv: azimuth over 2 pi, angle from +z over pi. */
ca_status ca_mesh_create_sphere(ca_mesh *mesh, const double center[3], float radius, ca_error *error)
{
    const size_t cells = (size_t)AROUND * DOWN;
    CA_TRY(ca_mesh_create(mesh, (size_t)(AROUND + 1) * (DOWN + 1), 2 * cells, true, true, error));
    for (uint32_t row = 0; row <= DOWN; row++)
        for (uint32_t column = 0; column <= AROUND; column++) {
            const double v = (double)row / DOWN, u = (double)column / AROUND;
            const double ring = row % DOWN == 0 ? 0.0 : sin(CA_PI_D * v);
            const double azimuth = 2.0 * CA_PI_D * (column % AROUND) / AROUND;
            const double normal[3] = {ring * cos(azimuth), ring * sin(azimuth), cos(CA_PI_D * v)};
            double position[3];
            for (int i = 0; i < 3; i++) position[i] = center[i] + (double)radius * normal[i];
            set_vertex(mesh, row * (AROUND + 1) + column, position, normal, u, v);
        }
    connect_grid(mesh, AROUND, DOWN);
    return CA_OK;
}

/* uv: azimuth over 2 pi, height. The upper end is the first row: rows run down. */
ca_status ca_mesh_create_cylinder(ca_mesh *mesh, const ca_matrix *frame, ca_error *error)
{
    CA_TRY(ca_mesh_create(mesh, 2 * (size_t)(AROUND + 1), 2 * (size_t)AROUND, true, true, error));
    const double (*m)[4] = frame->m;
    for (uint32_t row = 0; row <= 1; row++)
        for (uint32_t column = 0; column <= AROUND; column++) {
            const double azimuth = 2.0 * CA_PI_D * (column % AROUND) / AROUND, x = cos(azimuth), y = sin(azimuth);
            double position[3], normal[3], length2 = 0.0;
            for (int i = 0; i < 3; i++) {
                normal[i] = m[i][0] * x + m[i][1] * y;
                length2 += normal[i] * normal[i];
                position[i] = normal[i] + m[i][2] * (1 - (int)row) + m[i][3];
            }
            for (int i = 0; i < 3; i++) normal[i] /= sqrt(length2);
            set_vertex(mesh, row * (AROUND + 1) + column, position, normal, (double)column / AROUND, 1.0 - row);
        }
    connect_grid(mesh, AROUND, 1);
    return CA_OK;
}
