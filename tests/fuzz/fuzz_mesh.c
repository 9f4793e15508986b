/* Fuzzer of the mesh readers, through a file in memory. The first byte chooses the format, the rest is the file. */
#define _GNU_SOURCE
#include "import/import.h"
#include "memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static ca_status read_mesh(unsigned kind, const char *path, ca_mesh *mesh, ca_error *error)
{
    switch (kind % 4) {
    case 0: return ca_import_obj(path, mesh, error);
    case 1: return ca_import_ply(path, mesh, error);
    case 2: return ca_import_serialized(path, 0, mesh, error);
    default: return ca_import_serialized(path, 1, mesh, error);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0) return 0;
    ca_mesh mesh;
    ca_error error = {{0}};
    const ca_status status = read_mesh(data[0], memory_file(data + 1, size - 1), &mesh, &error);
    if (status != CA_OK && (!error.message[0] || mesh.positions)) abort(); /* a failure has a message and no mesh */
    ca_mesh_destroy(&mesh);
    return 0;
}
