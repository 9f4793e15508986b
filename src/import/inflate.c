#define ZLIB_CONST /* what zlib reads is const */
#include "import/inflate.h"

#include "base/loading.h"
#include "base/memory.h"

#include <zlib.h>

enum { GZIP_ONLY = 16 + 15, PIECE = 1 << 24 };

typedef struct unpacking {
    z_stream zlib;
    const unsigned char *rest; /* of the packed bytes, not yet handed to zlib */
    size_t rest_bytes;
    unsigned char *data;
    size_t size, capacity, limit;
} unpacking;

static bool is_packed(const ca_bytes *bytes)
{
    return bytes->size >= 18 && bytes->data[0] == 0x1f && bytes->data[1] == 0x8b;
}

static void refill(unpacking *u)
{
    if (u->zlib.avail_in > 0) return;
    u->zlib.avail_in = (uInt)(u->rest_bytes < PIECE ? u->rest_bytes : PIECE);
    u->zlib.next_in = u->rest;
    u->rest += u->zlib.avail_in;
    u->rest_bytes -= u->zlib.avail_in;
}

/* Room for more, with one byte to spare for the zero behind the text. */
static ca_status make_room(unpacking *u, const char *path, ca_error *error)
{
    const ca_location where = {.file = path};
    if (u->size > u->limit)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "unpacked, this file is over the limit of %zu bytes",
                       u->limit);
    if (u->size + 1 < u->capacity) return CA_OK;
    unsigned char *data = ca_array_grow(u->data, &u->capacity, u->size + 65536, 1);
    if (!data) return ca_fail_memory(error, path);
    u->data = data;
    return CA_OK;
}

/* One member after another, as a file made of several has them. */
static ca_status unpack(unpacking *u, const char *path, ca_error *error)
{
    const ca_location where = {.file = path};
    for (;;) {
        CA_TRY(ca_loading_check(error));
        CA_TRY(make_room(u, path, error));
        refill(u);
        const size_t room = u->capacity - u->size - 1;
        u->zlib.next_out = u->data + u->size;
        u->zlib.avail_out = (uInt)(room < PIECE ? room : PIECE);
        const uInt offered = u->zlib.avail_out;
        const int result = inflate(&u->zlib, Z_NO_FLUSH);
        u->size += offered - u->zlib.avail_out;
        const bool is_end = u->zlib.avail_in == 0 && u->rest_bytes == 0;
        if (result == Z_MEM_ERROR) return ca_fail_memory(error, path);
        if (result == Z_STREAM_END && is_end) break;
        if (result == Z_STREAM_END && inflateReset(&u->zlib) == Z_OK) continue;
        if (result != Z_OK || (is_end && offered == u->zlib.avail_out))
            return ca_fail(error, CA_ERROR_FORMAT, &where, "the packed file is damaged or ends too early");
    }
    u->data[u->size] = 0;
    return u->size <= u->limit ? CA_OK : make_room(u, path, error);
}

ca_status ca_read_inflated(const char *path, const char *what, size_t limit, ca_bytes *bytes, ca_error *error)
{
    CA_TRY(ca_file_read(path, what, limit, bytes, error));
    if (!is_packed(bytes)) return CA_OK;
    unpacking u = {.zlib = {.zalloc = ca_alloc_for_library, .zfree = ca_free_for_library},
                   .rest = bytes->data,
                   .rest_bytes = bytes->size,
                   .limit = limit};
    ca_status status = CA_OK;
    if (inflateInit2(&u.zlib, GZIP_ONLY) != Z_OK) status = ca_fail_memory(error, path);
    if (status == CA_OK) {
        status = unpack(&u, path, error);
        inflateEnd(&u.zlib);
    }
    ca_bytes_destroy(bytes);
    if (status == CA_OK)
        *bytes = (ca_bytes){.data = u.data, .size = u.size};
    else
        ca_free(u.data);
    return status;
}
