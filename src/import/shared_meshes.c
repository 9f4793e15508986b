#include "import/shared_meshes.h"

#include "base/hash.h"
#include "import/reuse.h"

void ca_shared_meshes_destroy(ca_shared_meshes *meshes)
{
    ca_key_table_destroy(&meshes->by_content);
    ca_key_table_destroy(&meshes->by_place);
}

ca_mesh_key ca_mesh_key_of(uint64_t content, uint64_t kind, const ca_mesh_use *use)
{
    ca_affine map;
    const bool turns = !ca_affine_from_matrix(&use->to_world, &map) || ca_affine_mirrors(&map) || use->flip_normals;
    ca_mesh_key key = {.keeps_indices = !turns};
    if (content == 0) return key;
    const uint64_t flags = kind << 2 | (uint64_t)use->face_normals << 1 | (uint64_t)use->flip_tex_coords;
    key.content = ca_hash_add(content, flags) | 1;
    const uint64_t place = ca_hash_add(key.content, use->flip_normals);
    key.place = ca_hash_bytes(place, &use->to_world, sizeof use->to_world) | 1;
    return key;
}

static uint32_t add_mesh(ca_importer *importer, ca_mesh *mesh)
{
    ca_scene_desc *desc = importer->desc;
    if (ca_import_good(importer) && CA_TABLE_ADD(&desc->meshes)) {
        desc->meshes.items[desc->meshes.count - 1] = *mesh;
        return (uint32_t)(desc->meshes.count - 1);
    }
    ca_mesh_destroy(mesh);
    ca_import_fail_memory(importer, "meshes");
    return CA_NONE;
}

/* Notes the mesh for later shapes: in its place, and as one that others can be made from. */
static void note(ca_importer *importer, const ca_mesh_key *key, uint32_t index)
{
    ca_shared_meshes *known = &importer->shared;
    uint32_t other;
    if (key->content == 0) return;
    bool good = ca_key_table_find(&known->by_place, key->place, &other) ||
                ca_key_table_add(&known->by_place, key->place, index);
    const bool is_placed = importer->desc->meshes.items[index].placed;
    if (good && !is_placed && !ca_key_table_find(&known->by_content, key->content, &other))
        good = ca_key_table_add(&known->by_content, key->content, 2 * index + key->keeps_indices);
    if (!good) ca_import_fail_memory(importer, "meshes");
}

uint32_t ca_shared_mesh_add(ca_importer *importer, const ca_mesh_key *key, ca_mesh *mesh)
{
    mesh->made_of = key->lasts ? key->place : 0;
    const uint32_t index = add_mesh(importer, mesh);
    if (index != CA_NONE) note(importer, key, index);
    return ca_import_good(importer) ? index : CA_NONE;
}

/* Another mesh of the same content, for another place; false where there is none, or after failing. */
static bool copy_known(ca_importer *importer, const ca_mesh_key *key, ca_mesh *mesh)
{
    uint32_t number;
    ca_error reason;
    if (!ca_key_table_find(&importer->shared.by_content, key->content, &number)) return false;
    ca_mesh *there = &importer->desc->meshes.items[number / 2];
    const unsigned kept = CA_MESH_UVS | (number % 2 ? CA_MESH_INDICES : 0);
    ca_status status = ca_mesh_lend(there, kept, &reason);
    if (status == CA_OK)
        status = ca_mesh_copy(there, key->keeps_indices ? kept : CA_MESH_UVS, mesh, &reason);
    if (status != CA_OK) ca_import_fail_memory(importer, "meshes");
    return status == CA_OK;
}

uint32_t ca_shared_mesh(ca_importer *importer, const ca_mesh_key *key)
{
    uint32_t index;
    ca_mesh mesh;
    if (ca_key_table_find(&importer->shared.by_place, key->place, &index)) return index;
    const bool is_there = key->content != 0 && ((key->lasts && ca_reuse_mesh(importer, key->place, &mesh)) ||
                                                copy_known(importer, key, &mesh));
    return is_there ? ca_shared_mesh_add(importer, key, &mesh) : CA_NONE;
}
