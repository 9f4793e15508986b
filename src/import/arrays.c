/* Meshes and pictures that a program hands over as arrays, found by the names that the scene's text has for them. */
#include "import/importer.h"

#include "base/hash.h"
#include "base/loading.h"
#include "base/memory.h"
#include "import/reuse.h"
#include "base/text.h"

#include <assert.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* ---- Names ----------------------------------------------------------------------------------------------------- */

/* Things that begin with a name. */
typedef struct named {
    const void *items;
    size_t size, count; /* of one, in bytes; of all */
} named;
#define NAMED(items, count) {(items), sizeof *(items), (count)}
_Static_assert(offsetof(ca_mesh_data, name) == 0 && offsetof(ca_bitmap_data, name) == 0 &&
                   offsetof(ca_import_mesh, name) == 0,
               "they begin with a name");

static const char *name_at(const named *all, size_t i)
{
    const void *item = (const char *)all->items + i * all->size;
    return *(const char *const *)item;
}

/* Its index; `count`: there is none. Mostly arrays are asked for one after another: the search begins at *next, which
 * is left behind what was found. */
static size_t find_name(const named *all, const char *name, size_t *next)
{
    for (size_t i = 0; i < all->count; i++) {
        const size_t k = (*next + i) % all->count;
        if (strcmp(name_at(all, k), name) != 0) continue;
        *next = k + 1;
        return k;
    }
    return all->count;
}

static void fail_unknown(const char *what, const char *name, const named *all, ca_error *error)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < all->count; i++) nearest = ca_nearer_name(name, nearest, name_at(all, i));
    if (nearest)
        ca_fail(error, CA_ERROR_SCENE, NULL, "there is no %s \"%s\" among the arrays; the nearest name is \"%s\"",
                what, name, nearest);
    else
        ca_fail(error, CA_ERROR_SCENE, NULL, "there is no %s \"%s\": none is given as arrays", what, name);
}

const ca_mesh_data *ca_import_find_mesh(ca_importer *importer, const char *name, ca_error *error)
{
    const ca_mesh_data *meshes = importer->source->meshes;
    const named all = NAMED(meshes, importer->source->mesh_count);
    const size_t k = find_name(&all, name, &importer->next_given_mesh);
    if (k < all.count) return &meshes[k];
    fail_unknown("mesh", name, &all, error);
    return NULL;
}

ca_import_mesh *ca_import_find_made(ca_importer *importer, const char *name)
{
    ca_import_mesh *meshes = importer->arrays.meshes.items;
    const named all = NAMED(meshes, importer->arrays.meshes.count);
    const size_t k = find_name(&all, name, &importer->next_mesh);
    return k < all.count ? &meshes[k] : NULL;
}

ca_curve *ca_import_take_made_curve(ca_importer *importer, const char *name, ca_error *error)
{
    for (size_t i = 0; i < importer->arrays.curves.count; i++) {
        ca_import_curve *made = &importer->arrays.curves.items[i];
        ca_curve *curve = made->curve;
        if (!curve || strcmp(made->name, name) != 0) continue;
        made->curve = NULL;
        return curve;
    }
    fail_unknown("curve", name, &(named){NULL, 0, 0}, error);
    return NULL;
}

static const ca_bitmap_data *find_bitmap(ca_importer *importer, const char *name, ca_error *error)
{
    const bool made = importer->arrays.bitmaps.count > 0;
    const ca_bitmap_data *bitmaps = made ? importer->arrays.bitmaps.items : importer->source->bitmaps;
    const size_t count = made ? importer->arrays.bitmaps.count : importer->source->bitmap_count;
    const named all = NAMED(bitmaps, count);
    const size_t k = find_name(&all, name, &importer->next_bitmap);
    if (k < count) return &bitmaps[k];
    fail_unknown("bitmap", name, &all, error);
    return NULL;
}

/* ---- Lending --------------------------------------------------------------------------------------------------- */

ca_status ca_import_begin_lending(ca_importer *importer)
{
    const ca_scene_source *source = importer->source;
    ca_status status = CA_OK;
    importer->lenders = ca_alloc_zeroed(source->mesh_count, sizeof *importer->lenders);
    if (!importer->lenders) status = ca_fail_memory(importer->error, "meshes");
    for (size_t i = 0; i < source->mesh_count; i++) {
        const ca_mesh_data *data = &source->meshes[i];
        if (!data->release) continue;
        ca_mesh_lender *lender =
            importer->lenders ? ca_mesh_lender_create(data->release, data->release_user) : NULL;
        if (lender) {
            importer->lenders[i] = lender;
        } else {
            data->release(data->release_user);
            status = ca_fail_memory(importer->error, "meshes");
        }
    }
    return status;
}

void ca_import_end_lending(ca_importer *importer)
{
    for (size_t i = 0; importer->lenders && i < importer->source->mesh_count; i++)
        ca_mesh_lender_drop(importer->lenders[i]);
    ca_free(importer->lenders);
    importer->lenders = NULL;
}

/* Embree reads 16 bytes at the last vertex, which has 12: harmless, unless a page ends there. */
static bool ends_within_page(const float *positions, size_t vertex_count)
{
    enum { SMALLEST_PAGE = 4096 };
    return (uintptr_t)(positions + 3 * vertex_count) % SMALLEST_PAGE != 0;
}

/* Which arrays stay as they are on their way into the scene. */
static unsigned lendable(const ca_mesh_data *data, const ca_mesh_use *use)
{
    ca_affine map;
    unsigned lent = use->flip_tex_coords ? 0 : CA_MESH_UVS;
    if (!ca_affine_from_matrix(&use->to_world, &map)) return lent;
    if (!use->flip_normals && !ca_affine_mirrors(&map)) lent |= CA_MESH_INDICES;
    if (ca_affine_is_identity(&map) && ends_within_page(data->positions, data->vertex_count))
        lent |= CA_MESH_POSITIONS;
    return lent;
}

/* ---- Meshes ---------------------------------------------------------------------------------------------------- */

static ca_status take_arrays(const ca_mesh_data *data, ca_mesh *mesh, unsigned lent, ca_error *error)
{
    const size_t vertices = data->vertex_count;
    mesh->positions = ca_mesh_take_array(data->positions, 3 * vertices, lent & CA_MESH_POSITIONS);
    mesh->indices = ca_mesh_take_array(data->indices, 3 * data->triangle_count, lent & CA_MESH_INDICES);
    mesh->normals = ca_mesh_take_array(data->normals, 3 * vertices, false);
    mesh->uvs = ca_mesh_take_array(data->uvs, 2 * vertices, lent & CA_MESH_UVS);
    const bool missing = (data->normals && !mesh->normals) || (data->uvs && !mesh->uvs);
    return mesh->positions && mesh->indices && !missing ? ca_loading_check(error) : ca_fail_memory(error, "mesh");
}

ca_status ca_import_check_mesh(const ca_mesh_data *data, ca_error *error)
{
    if (!data->positions || !data->indices)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "the mesh \"%s\" has no %s", data->name,
                       data->positions ? "indices" : "positions");
    ca_mesh mesh;
    CA_TRY(ca_mesh_begin(&mesh, data->vertex_count, data->triangle_count, error)); /* it knows the limits */
    ca_mesh_destroy(&mesh);
    return CA_OK;
}

ca_status ca_import_mesh_data(const ca_importer *importer, const ca_mesh_data *data, const ca_mesh_use *use,
                              ca_mesh *mesh, ca_error *error)
{
    ca_mesh_lender *lender = importer->lenders[data - importer->source->meshes];
    const unsigned lent = lender ? lendable(data, use) : 0;
    CA_TRY(ca_mesh_begin(mesh, data->vertex_count, data->triangle_count, error));
    ca_mesh_borrow(mesh, lender, lent);
    ca_status status = take_arrays(data, mesh, lent, error);
    if (status == CA_OK) status = ca_mesh_validate(mesh, data->name, error);
    if (status == CA_OK)
        ca_mesh_normalize_normals(mesh); /* a copy in any case */
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
    const size_t count = (size_t)data->width * data->height * data->channels;
    ca_memory_budget_read(0, 4 * count);
    const uint64_t sizes = ca_hash_add(ca_hash_add(CA_HASH_START, data->width), data->channels);
    const uint64_t content = ca_hash_array(ca_hash_add(sizes, count), data->pixels, 4 * count) | 1;
    if (ca_reuse_image(importer, content, image)) return CA_OK;
    for (size_t i = 0; i < count; i++)
        if (!isfinite(data->pixels[i]))
            return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                           "the bitmap \"%s\" has a value that is not finite, number %zu", name, i);
    CA_TRY(ca_image_create(image, data->width, data->height, data->channels, error));
    image->content_hash = image->made_of = content;
    memcpy(image->data, data->pixels, 4 * count);
    return CA_OK;
}

/* ---- What readers made ----------------------------------------------------------------------------------------- */

ca_status ca_import_made_mesh(ca_import_mesh *made, ca_mesh *mesh, ca_error *error)
{
    assert(made->mesh.owners); /* one shape took it over, and others have shared it from there */
    *mesh = made->mesh;
    made->mesh = (ca_mesh){0};
    const ca_status status = ca_mesh_validate(mesh, made->name, error);
    if (status == CA_OK)
        ca_mesh_normalize_normals(mesh);
    else
        ca_mesh_destroy(mesh);
    return status;
}

void ca_import_arrays_destroy(ca_import_arrays *arrays)
{
    for (size_t i = 0; i < arrays->meshes.count; i++) ca_mesh_destroy(&arrays->meshes.items[i].mesh);
    for (size_t i = 0; i < arrays->curves.count; i++) ca_curve_destroy(arrays->curves.items[i].curve);
    ca_free(arrays->meshes.items);
    ca_free(arrays->curves.items);
    ca_free(arrays->bitmaps.items);
    ca_arena_clear(&arrays->arena);
    *arrays = (ca_import_arrays){0};
}
