/* libFuzzer on the mesh readers, through a file in memory. The first byte chooses the format, the rest is the
 * file. */
#define _GNU_SOURCE
#include "import/import.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

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
    static char path[64];
    static int file = -1;
    if (size == 0) return 0;
    if (file < 0) {
        file = memfd_create("mesh", MFD_CLOEXEC);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    }
    if (ftruncate(file, 0) != 0 || pwrite(file, data + 1, size - 1, 0) != (ssize_t)(size - 1)) abort();
    ca_mesh mesh;
    ca_error error = {{0}};
    const ca_status status = read_mesh(data[0], path, &mesh, &error);
    if (status != CA_OK && (!error.message[0] || mesh.positions)) abort(); /* a failure has a message and no mesh */
    ca_mesh_destroy(&mesh);
    return 0;
}
