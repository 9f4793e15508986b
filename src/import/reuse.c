#define _DEFAULT_SOURCE
#include "import/reuse.h"

#include "base/hash.h"
#include "base/parallel.h"
#include "scene/scene.h"

#include <string.h>
#include <sys/stat.h>

uint64_t ca_reuse_file(const char *path)
{
    struct stat found;
    if (stat(path, &found) != 0) return 0;
    uint64_t hash = ca_hash_add(CA_HASH_START, (uint64_t)found.st_dev);
    hash = ca_hash_add(hash, (uint64_t)found.st_ino);
    hash = ca_hash_add(hash, (uint64_t)found.st_size);
    hash = ca_hash_add(hash, (uint64_t)found.st_mtim.tv_sec);
    hash = ca_hash_add(hash, (uint64_t)found.st_mtim.tv_nsec);
    hash = ca_hash_add(hash, (uint64_t)found.st_ctim.tv_sec);
    hash = ca_hash_add(hash, (uint64_t)found.st_ctim.tv_nsec);
    return ca_hash_bytes(hash, path, strlen(path)) | 1;
}

typedef struct range_hashes {
    const unsigned char *bytes;
    uint64_t hashes[CA_RANGES];
} range_hashes;

static void hash_range(void *user, ca_range range)
{
    range_hashes *h = user;
    h->hashes[range.number] =
        ca_hash_array(CA_HASH_START, h->bytes + 4 * range.begin, 4 * (range.end - range.begin));
}

/* Lets the hash know how many there are. */
static uint64_t add_array(uint64_t hash, const void *values, size_t count)
{
    range_hashes h = {.bytes = values};
    hash = ca_hash_add(hash, values ? count : 0);
    const uint32_t ranges = values ? ca_parallel_ranges(count, hash_range, &h) : 0;
    for (uint32_t i = 0; i < ranges; i++) hash = ca_hash_add(hash, h.hashes[i]);
    return hash;
}

uint64_t ca_reuse_arrays(const ca_mesh_data *data)
{
    const size_t vertices = data->vertex_count;
    uint64_t hash = add_array(CA_HASH_START, data->positions, 3 * vertices);
    hash = add_array(hash, data->indices, 3 * data->triangle_count);
    hash = add_array(hash, data->normals, 3 * vertices);
    return add_array(hash, data->uvs, 2 * vertices) | 1;
}

bool ca_reuse_mesh(const ca_importer *importer, uint64_t made_of, ca_mesh *mesh)
{
    const ca_scene *previous = importer->source->previous;
    const size_t count = previous ? previous->desc.meshes.count : 0;
    for (size_t i = 0; i < count; i++) {
        const ca_mesh *there = &previous->desc.meshes.items[(importer->desc->meshes.count + i) % count];
        if (there->made_of != made_of) continue;
        *mesh = ca_mesh_share(there);
        return true;
    }
    return false;
}

bool ca_reuse_image(const ca_importer *importer, uint64_t made_of, ca_image *image)
{
    const ca_scene *previous = importer->source->previous;
    const size_t count = previous ? previous->desc.images.count : 0;
    for (size_t i = 0; i < count; i++) {
        const ca_image *there = &previous->desc.images.items[(importer->desc->images.count + i) % count];
        if (there->made_of != made_of) continue;
        *image = ca_image_share(there);
        return true;
    }
    return false;
}
