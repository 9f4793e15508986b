/* Texture coordinates that belong to the corners of triangles: vertices that corners see with several are split. */
#include "geometry/mesh.h"

#include "base/memory.h"

#include <string.h>

#define NO_VERSION UINT32_MAX

/* A vertex with one pair of coordinates; the first version of vertex v is number v. */
typedef struct version {
    uint32_t vertex, next; /* next version of the same vertex, or NO_VERSION */
    float uv[2];
    bool used;
} version;

typedef struct version_list {
    version *items; /* owned */
    size_t count, capacity;
} version_list;

static bool same_uv(const version *v, const float uv[2]) { return v->uv[0] == uv[0] && v->uv[1] == uv[1]; }

/* The number of the vertex' version with these coordinates, which may be new; NO_VERSION when out of memory. */
static uint32_t find_version(version_list *list, uint32_t vertex, const float uv[2])
{
    uint32_t i = vertex;
    while (list->items[i].used && !same_uv(&list->items[i], uv) && list->items[i].next != NO_VERSION)
        i = list->items[i].next;
    if (list->items[i].used && !same_uv(&list->items[i], uv)) {
        version *items = ca_array_grow(list->items, &list->capacity, list->count + 1, sizeof *items);
        if (!items) return NO_VERSION;
        list->items = items;
        items[list->count] = (version){.vertex = vertex, .next = NO_VERSION};
        items[i].next = (uint32_t)list->count;
        i = (uint32_t)list->count++;
    }
    version *found = &list->items[i];
    found->used = true;
    memcpy(found->uv, uv, sizeof found->uv);
    return i;
}

/* Corners get the numbers of their versions. */
static ca_status number_corners(ca_mesh *mesh, const float *uvs, version_list *list, ca_error *error)
{
    list->items = ca_array_grow(NULL, &list->capacity, (size_t)mesh->vertex_count + 1, sizeof *list->items);
    if (!list->items) return ca_fail_memory(error, "mesh");
    list->count = mesh->vertex_count;
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) list->items[v] = (version){.vertex = v, .next = NO_VERSION};
    for (size_t c = 0; c < 3 * (size_t)mesh->triangle_count; ++c) {
        mesh->indices[c] = find_version(list, mesh->indices[c], uvs + 2 * c);
        if (mesh->indices[c] == NO_VERSION) return ca_fail_memory(error, "mesh");
    }
    return CA_OK;
}

/* An array of one row of `size` floats a vertex becomes one of a row a version; *array is replaced. */
static ca_status spread(float **array, uint32_t size, size_t padding, const version_list *list, ca_error *error)
{
    if (!*array) return CA_OK;
    float *rows = ca_alloc_zeroed(list->count * size + padding, sizeof *rows);
    if (!rows) return ca_fail_memory(error, "mesh");
    for (size_t i = 0; i < list->count; ++i)
        memcpy(rows + i * size, *array + (size_t)list->items[i].vertex * size, size * sizeof *rows);
    ca_free(*array);
    *array = rows;
    return CA_OK;
}

static ca_status spread_all(ca_mesh *mesh, const version_list *list, ca_error *error)
{
    CA_TRY(spread(&mesh->positions, 3, 1, list, error));
    CA_TRY(spread(&mesh->normals, 3, 0, list, error));
    for (uint32_t a = 0; a < mesh->attribute_count; ++a)
        if (!mesh->attributes[a].per_face)
            CA_TRY(spread(&mesh->attributes[a].values, mesh->attributes[a].components, 0, list, error));
    ca_free(mesh->uvs);
    mesh->uvs = ca_alloc_zeroed(2 * list->count, sizeof *mesh->uvs);
    if (!mesh->uvs) return ca_fail_memory(error, "mesh");
    for (size_t i = 0; i < list->count; ++i) memcpy(mesh->uvs + 2 * i, list->items[i].uv, sizeof list->items[i].uv);
    mesh->vertex_count = (uint32_t)list->count;
    return CA_OK;
}

ca_status ca_mesh_set_corner_uvs(ca_mesh *mesh, const float *uvs, ca_error *error)
{
    version_list list = {0};
    ca_status status = number_corners(mesh, uvs, &list, error);
    if (status == CA_OK && list.count > ((size_t)1 << 31) - 1)
        status = ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "a mesh of %zu vertices is over the limit", list.count);
    if (status == CA_OK) status = spread_all(mesh, &list, error);
    ca_free(list.items);
    return status;
}
