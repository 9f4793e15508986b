/* Meshes and pictures that a program hands over as arrays, found by the names that the scene's text has for them. */
#include "import/importer.h"

#include "base/hash.h"
#include "base/text.h"

#include <string.h>

/* ---- Names ----------------------------------------------------------------------------------------------------- */

/* NULL `nearest`: there are none. */
static void fail_unknown(const char *what, const char *name, const char *nearest, ca_error *error)
{
    if (nearest)
        ca_fail(error, CA_ERROR_SCENE, NULL, "there is no %s \"%s\" among the arrays; the nearest name is \"%s\"",
                what, name, nearest);
    else
        ca_fail(error, CA_ERROR_SCENE, NULL, "there is no %s \"%s\": none is given as arrays", what, name);
}

static const ca_mesh_data *find_mesh(const ca_scene_source *source, const char *name, ca_error *error)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < source->mesh_count; i++) {
        if (strcmp(source->meshes[i].name, name) == 0) return &source->meshes[i];
        nearest = ca_nearer_name(name, nearest, source->meshes[i].name);
    }
    fail_unknown("mesh", name, nearest, error);
    return NULL;
}

/* NULL where a reader made none of that name. Mostly they are asked for one after another. */
static ca_import_mesh *find_made_mesh(ca_importer *importer, const char *name)
{
    const size_t count = importer->arrays.meshes.count;
    for (size_t i = 0; i < count; i++) {
        const size_t k = (importer->next_mesh + i) % count;
        if (strcmp(importer->arrays.meshes.items[k].name, name) != 0) continue;
        importer->next_mesh = k + 1;
        return &importer->arrays.meshes.items[k];
    }
    return NULL;
}

static const ca_bitmap_data *find_bitmap(const ca_importer *importer, const char *name, ca_error *error)
{
    const bool made = importer->arrays.bitmaps.count > 0;
    const ca_bitmap_data *bitmaps = made ? importer->arrays.bitmaps.items : importer->source->bitmaps;
    const size_t count = made ? importer->arrays.bitmaps.count : importer->source->bitmap_count;
    const char *nearest = NULL;
    for (size_t i = 0; i < count; i++) {
        if (strcmp(bitmaps[i].name, name) == 0) return &bitmaps[i];
        nearest = ca_nearer_name(name, nearest, bitmaps[i].name);
    }
    fail_unknown("bitmap", name, nearest, error);
    return NULL;
}

/* ---- Meshes ---------------------------------------------------------------------------------------------------- */

/* Copies so many numbers, and lets the hash know how many. */
static void copy(void *to, const void *from, size_t count, size_t size, uint64_t *hash)
{
    memcpy(to, from, count * size);
    *hash = ca_hash_bytes(ca_hash_add(*hash, count), from, count * size);
}

static void copy_mesh(const ca_mesh_data *data, ca_mesh *mesh)
{
    const size_t vertices = data->vertex_count;
    mesh->content_hash = CA_HASH_START;
    copy(mesh->positions, data->positions, 3 * vertices, sizeof(float), &mesh->content_hash);
    copy(mesh->indices, data->indices, 3 * data->triangle_count, sizeof(uint32_t), &mesh->content_hash);
    if (data->normals) copy(mesh->normals, data->normals, 3 * vertices, sizeof(float), &mesh->content_hash);
    if (data->uvs) copy(mesh->uvs, data->uvs, 2 * vertices, sizeof(float), &mesh->content_hash);
}

static ca_status copy_source_mesh(const ca_scene_source *source, const char *name, ca_mesh *mesh, ca_error *error)
{
    const ca_mesh_data *data = find_mesh(source, name, error);
    if (!data) return CA_ERROR_SCENE;
    if (!data->positions || !data->indices)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the mesh \"%s\" has no %s", name,
                       data->positions ? "indices" : "positions");
    CA_TRY(ca_mesh_create(mesh, data->vertex_count, data->triangle_count, data->normals, data->uvs, error));
    copy_mesh(data, mesh);
    return CA_OK;
}

static ca_status copy_made_mesh(const ca_mesh *made, ca_mesh *mesh, ca_error *error)
{
    const size_t vertices = made->vertex_count, triangles = made->triangle_count;
    CA_TRY(ca_mesh_create(mesh, vertices, triangles, made->normals, made->uvs, error));
    memcpy(mesh->positions, made->positions, 3 * vertices * sizeof(float));
    memcpy(mesh->indices, made->indices, 3 * triangles * sizeof(uint32_t));
    if (made->normals) memcpy(mesh->normals, made->normals, 3 * vertices * sizeof(float));
    if (made->uvs) memcpy(mesh->uvs, made->uvs, 2 * vertices * sizeof(float));
    for (uint32_t i = 0; i < made->attribute_count; i++) {
        const ca_mesh_attribute *attribute = &made->attributes[i];
        const size_t count = attribute->components * (attribute->per_face ? triangles : vertices);
        float *values;
        const ca_status status = ca_mesh_add_attribute(mesh, attribute->name, attribute->components,
                                                       attribute->per_face, &values, error);
        if (status != CA_OK) {
            ca_mesh_destroy(mesh);
            return status;
        }
        memcpy(values, attribute->values, count * sizeof(float));
    }
    mesh->content_hash = made->content_hash;
    return CA_OK;
}

static ca_status get_made_mesh(ca_import_mesh *made, ca_mesh *mesh, ca_error *error)
{
    if (!made->once) return copy_made_mesh(&made->mesh, mesh, error);
    *mesh = made->mesh;
    made->mesh = (ca_mesh){0};
    return CA_OK;
}

ca_status ca_import_mesh_data(ca_importer *importer, const char *name, ca_mesh *mesh, ca_error *error)
{
    ca_import_mesh *made = find_made_mesh(importer, name);
    *mesh = (ca_mesh){0};
    CA_TRY(made ? get_made_mesh(made, mesh, error) : copy_source_mesh(importer->source, name, mesh, error));
    const ca_status status = ca_mesh_validate(mesh, name, error);
    if (status == CA_OK)
        ca_mesh_normalize_normals(mesh);
    else
        ca_mesh_destroy(mesh);
    return status;
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

static ca_status check_bitmap(const ca_bitmap_data *data, ca_error *error)
{
    if (!data->pixels) return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the bitmap \"%s\" has no pixels", data->name);
    if (data->width < 1 || data->height < 1 || data->width > CA_IMAGE_MAX_SIDE || data->height > CA_IMAGE_MAX_SIDE)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the bitmap \"%s\" is of %u x %u pixels; sides are 1 to %d",
                       data->name, data->width, data->height, CA_IMAGE_MAX_SIDE);
    if (data->channels < 1 || data->channels > 4)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the bitmap \"%s\" has %u channels instead of 1 to 4",
                       data->name, data->channels);
    return CA_OK;
}

ca_status ca_import_bitmap_data(ca_importer *importer, const char *name, ca_image *image, ca_error *error)
{
    const ca_bitmap_data *data = find_bitmap(importer, name, error);
    if (!data) return CA_ERROR_SCENE;
    CA_TRY(check_bitmap(data, error));
    CA_TRY(ca_image_create(image, data->width, data->height, data->channels, error));
    image->content_hash = ca_hash_add(ca_hash_add(CA_HASH_START, data->width), data->channels);
    const size_t count = (size_t)data->width * data->height * data->channels;
    copy(image->data, data->pixels, count, sizeof(float), &image->content_hash);
    for (size_t i = 0; i < count; i++) {
        if (isfinite(image->data[i])) continue;
        ca_image_destroy(image);
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the bitmap \"%s\" has a value that is not finite, number %zu",
                       name, i);
    }
    return CA_OK;
}

/* ---- What readers made ----------------------------------------------------------------------------------------- */

void ca_import_arrays_destroy(ca_import_arrays *arrays)
{
    for (size_t i = 0; i < arrays->meshes.count; i++) ca_mesh_destroy(&arrays->meshes.items[i].mesh);
    ca_free(arrays->meshes.items);
    ca_free(arrays->bitmaps.items);
    ca_arena_clear(&arrays->arena);
    *arrays = (ca_import_arrays){0};
}
