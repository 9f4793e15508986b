/* Fuzzer of the reader of .vol grids, through a file in memory. */
#define _GNU_SOURCE
#include "geometry/sdf_grid.h"
#include "import/import.h"
#include "memory_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    ca_sdf_grid *grid;
    ca_error error = {{0}};
    const ca_status status = ca_import_sdf_grid(memory_file(data, size), &grid, &error);
    if (status != CA_OK && (!error.message[0] || grid)) abort(); /* a failure has a message and no grid */
    ca_sdf_grid_destroy(grid);
    return 0;
}
