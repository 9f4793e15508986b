/* Mitsuba's .vol files, little endian: "VOL" and the version 3 in a byte each; in 4 bytes each the kind of numbers
 * (1: floats of 32 bits), the samples along x, y and z, the values of a sample; the box as six floats; then the
 * floats, x first. Source: Mitsuba 3, the documentation of its gridvolume plugin, and files that it writes. */
#include "base/file.h"
#include "base/hash.h"
#include "base/memory.h"
#include "import/import.h"

#include <math.h>
#include <string.h>

static const size_t max_file_bytes = (size_t)1 << 34;

enum { HEADER_BYTES = 48, VERSION = 3, FLOATS = 1 };

static uint32_t number_at(const ca_bytes *bytes, size_t offset)
{
    uint32_t number;
    memcpy(&number, bytes->data + offset, sizeof number);
    return number;
}

static ca_status check_header(const ca_bytes *bytes, uint32_t count[3], const ca_location *where, ca_error *error)
{
    if (bytes->size < HEADER_BYTES || memcmp(bytes->data, "VOL", 3) != 0)
        return ca_fail(error, CA_ERROR_FORMAT, where,
                       "this is no volume, which begins with VOL and has a header of %d bytes", HEADER_BYTES);
    if (bytes->data[3] != VERSION)
        return ca_fail(error, CA_ERROR_FORMAT, where, "this volume is of version %d; expected %d", bytes->data[3],
                       VERSION);
    if (number_at(bytes, 4) != FLOATS)
        return ca_fail(error, CA_ERROR_FORMAT, where, "this volume has numbers of kind %u; expected %d, floats",
                       number_at(bytes, 4), FLOATS);
    for (size_t i = 0; i < 3; i++) count[i] = number_at(bytes, 8 + 4 * i);
    if (number_at(bytes, 20) != 1)
        return ca_fail(error, CA_ERROR_FORMAT, where, "this volume has %u values a sample; expected one, a distance",
                       number_at(bytes, 20));
    if (count[0] < 2 || count[1] < 2 || count[2] < 2)
        return ca_fail(error, CA_ERROR_FORMAT, where,
                       "a grid of distances needs 2 samples along each axis, and this volume has %u x %u x %u",
                       count[0], count[1], count[2]);
    const double samples = (double)count[0] * (double)count[1] * (double)count[2];
    if ((double)(bytes->size - HEADER_BYTES) < 4.0 * samples)
        return ca_fail(error, CA_ERROR_FORMAT, where, "this volume ends too early: %u x %u x %u floats do not fit",
                       count[0], count[1], count[2]);
    return CA_OK;
}

static ca_status read_grid(const ca_bytes *bytes, const ca_location *where, ca_sdf_grid **grid, ca_error *error)
{
    uint32_t count[3];
    CA_TRY(check_header(bytes, count, where, error));
    CA_TRY(ca_sdf_grid_create(count, grid, error));
    const size_t samples = (size_t)count[0] * count[1] * count[2];
    memcpy((*grid)->values, bytes->data + HEADER_BYTES, samples * sizeof(float));
    for (size_t i = 0; i < samples; i++)
        if (!isfinite((*grid)->values[i]))
            return ca_fail(error, CA_ERROR_FORMAT, where, "distance %zu of this volume is not a finite number", i);
    return ca_sdf_grid_finish(*grid, error);
}

ca_status ca_import_sdf_grid(const char *path, ca_sdf_grid **grid, ca_error *error)
{
    const ca_location where = {.file = path};
    ca_bytes bytes;
    *grid = NULL;
    CA_TRY(ca_file_read(path, "volume", max_file_bytes, &bytes, error));
    const ca_status status = read_grid(&bytes, &where, grid, error);
    if (status == CA_OK) {
        (*grid)->content_hash = ca_hash_bytes(CA_HASH_START, bytes.data, bytes.size);
    } else {
        ca_sdf_grid_destroy(*grid);
        *grid = NULL;
    }
    ca_bytes_destroy(&bytes);
    return status;
}
