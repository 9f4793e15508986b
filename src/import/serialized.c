/* Mitsuba's .serialized meshes, versions 3 and 4, little endian: for each mesh a short header (0x041C, version) and a
 * zlib stream with flags, name (version 4), counts and arrays; at the end of the file the offset of each mesh (4
 * bytes each in version 3, 8 in version 4) and their number. Source: Mitsuba 3, src/shapes/serialized.cpp. */
#define ZLIB_CONST /* what zlib reads is const */
#include "base/file.h"
#include "base/hash.h"
#include "base/loading.h"
#include "base/memory.h"
#include "import/import.h"

#include <string.h>
#include <zlib.h>

static const size_t max_file_bytes = (size_t)1 << 34;

enum { HEADER_BYTES = 4, FORMAT_MARK = 0x041c };

enum mesh_flags {
    HAS_NORMALS = 0x0001,
    HAS_UVS = 0x0002,
    HAS_COLORS = 0x0008,
    SINGLE_PRECISION = 0x1000,
    DOUBLE_PRECISION = 0x2000,
};

typedef struct mesh_stream {
    const char *path;
    z_stream zlib;
    const unsigned char *source; /* not yet handed to zlib, whose counts are 32 bits wide */
    size_t source_bytes;
} mesh_stream;

static ca_status fail_stream(const mesh_stream *stream, const char *what, ca_error *error)
{
    const ca_location where = {.file = stream->path};
    return ca_fail(error, CA_ERROR_FORMAT, &where, "the mesh is damaged or ends too early at its %s", what);
}

/* Hands zlib more of the file once it has used up what it had. */
static void refill(mesh_stream *stream)
{
    enum { PIECE = 1 << 30 };
    if (stream->zlib.avail_in > 0) return;
    stream->zlib.avail_in = (uInt)(stream->source_bytes < PIECE ? stream->source_bytes : PIECE);
    stream->zlib.next_in = stream->source;
    stream->source += stream->zlib.avail_in;
    stream->source_bytes -= stream->zlib.avail_in;
}

/* The next `size` bytes of the inflated stream. */
static ca_status inflate_bytes(mesh_stream *stream, void *target, size_t size, const char *what, ca_error *error)
{
    enum { PIECE = 1 << 24 };
    unsigned char *next = target;
    while (size > 0) {
        CA_TRY(ca_loading_check(error));
        refill(stream);
        const uInt piece = (uInt)(size < PIECE ? size : PIECE);
        stream->zlib.next_out = next;
        stream->zlib.avail_out = piece;
        const int result = inflate(&stream->zlib, Z_NO_FLUSH);
        const size_t got = piece - stream->zlib.avail_out;
        next += got;
        size -= got;
        if (result == Z_MEM_ERROR) return ca_fail_memory(error, stream->path);
        if (size > 0 && (result == Z_STREAM_END || (result != Z_OK && result != Z_BUF_ERROR) ||
                         (got == 0 && stream->zlib.avail_in == 0 && stream->source_bytes == 0)))
            return fail_stream(stream, what, error);
    }
    return CA_OK;
}

/* Nothing may follow the last array but zlib's checksum of them all, which is compared only when it is read. */
static ca_status expect_end(mesh_stream *stream, ca_error *error)
{
    unsigned char surplus;
    int result;
    do {
        refill(stream);
        stream->zlib.next_out = &surplus;
        stream->zlib.avail_out = 1;
        result = inflate(&stream->zlib, Z_NO_FLUSH);
    } while (result == Z_OK && stream->zlib.avail_out == 1);
    if (result == Z_MEM_ERROR) return ca_fail_memory(error, stream->path);
    if (stream->zlib.avail_out == 0)
        return ca_fail(error, CA_ERROR_FORMAT, &(ca_location){.file = stream->path},
                       "expected the end of the mesh after its triangles: its counts say less");
    return result == Z_STREAM_END ? CA_OK : fail_stream(stream, "checksum", error);
}

/* Could the rest of the file inflate to `count` elements of `size` bytes? Deflate shrinks to no less than 1/1032. */
static bool may_hold(const mesh_stream *stream, uint64_t count, size_t size)
{
    const uint64_t most = ((uint64_t)stream->source_bytes + stream->zlib.avail_in + 1) * 1032 + 65536;
    return count <= most / size;
}

/* `count` values, which the file has as floats or doubles. */
static ca_status read_floats(mesh_stream *stream, float *values, size_t count, bool doubles, const char *what,
                             ca_error *error)
{
    if (!doubles) return inflate_bytes(stream, values, count * sizeof *values, what, error);
    double buffer[1024];
    for (size_t done = 0; done < count;) {
        const size_t left = count - done, piece = left < 1024 ? left : 1024;
        CA_TRY(inflate_bytes(stream, buffer, piece * sizeof *buffer, what, error));
        /* NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign): a piece is never empty */
        for (size_t i = 0; i < piece; ++i) values[done++] = (float)buffer[i];
    }
    return CA_OK;
}

static ca_status read_counts(mesh_stream *stream, uint32_t version, uint32_t *flags, uint64_t counts[2],
                             ca_error *error)
{
    CA_TRY(inflate_bytes(stream, flags, sizeof *flags, "flags", error));
    char letter = 1;
    while (version == 4 && letter) CA_TRY(inflate_bytes(stream, &letter, 1, "name", error));
    CA_TRY(inflate_bytes(stream, counts, 2 * sizeof *counts, "counts", error));
    const bool doubles = *flags & DOUBLE_PRECISION;
    const ca_location where = {.file = stream->path};
    if (doubles && *flags & SINGLE_PRECISION)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "the mesh's flags 0x%x ask for two precisions", *flags);
    if (!may_hold(stream, counts[0], 3 * (doubles ? sizeof(double) : sizeof(float))) ||
        !may_hold(stream, counts[1], 3 * sizeof(uint32_t)))
        return ca_fail(error, CA_ERROR_FORMAT, &where, "%llu vertices and %llu triangles do not fit in the file",
                       (unsigned long long)counts[0], (unsigned long long)counts[1]);
    return CA_OK;
}

static ca_status read_mesh(mesh_stream *stream, uint32_t version, ca_mesh *mesh, ca_error *error)
{
    uint32_t flags;
    uint64_t counts[2];
    CA_TRY(read_counts(stream, version, &flags, counts, error));
    const bool doubles = flags & DOUBLE_PRECISION;
    CA_TRY(ca_mesh_create(mesh, counts[0], counts[1], flags & HAS_NORMALS, flags & HAS_UVS, error));
    const size_t vertices = mesh->vertex_count;
    CA_TRY(read_floats(stream, mesh->positions, 3 * vertices, doubles, "positions", error));
    if (mesh->normals) CA_TRY(read_floats(stream, mesh->normals, 3 * vertices, doubles, "normals", error));
    if (mesh->uvs) CA_TRY(read_floats(stream, mesh->uvs, 2 * vertices, doubles, "texture coordinates", error));
    if (flags & HAS_COLORS) {
        float *colors;
        CA_TRY(ca_mesh_add_attribute(mesh, "vertex_color", 3, false, &colors, error));
        CA_TRY(read_floats(stream, colors, 3 * vertices, doubles, "colors", error));
    }
    CA_TRY(inflate_bytes(stream, mesh->indices, (size_t)3 * mesh->triangle_count * sizeof *mesh->indices, "triangles",
                         error));
    CA_TRY(expect_end(stream, error));
    CA_TRY(ca_mesh_validate(mesh, stream->path, error));
    ca_mesh_normalize_normals(mesh);
    return CA_OK;
}

/* ---- the file -------------------------------------------------------------------------------------------------- */

static uint64_t load_little_endian(const unsigned char *p, size_t size)
{
    uint64_t value = 0;
    for (size_t i = 0; i < size; ++i) value |= (uint64_t)p[i] << (8 * i);
    return value;
}

static ca_status check_header(const char *path, const ca_bytes *bytes, size_t offset, uint32_t *version,
                              ca_error *error)
{
    const ca_location where = {.file = path};
    if (offset > bytes->size || bytes->size - offset < HEADER_BYTES ||
        load_little_endian(bytes->data + offset, 2) != FORMAT_MARK)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "expected the mark 0x041c of a serialized mesh at byte %zu",
                       offset);
    *version = (uint32_t)load_little_endian(bytes->data + offset + 2, 2);
    if (*version != 3 && *version != 4)
        return ca_fail(error, CA_ERROR_FORMAT, &where, "expected version 3 or 4 of a serialized mesh, not %u",
                       *version);
    return CA_OK;
}

/* The offset of mesh `index` from a dictionary of `count`, which lies before its count at the end of the file. */
static uint64_t dictionary_entry(const ca_bytes *bytes, size_t entry, uint64_t count, uint64_t index)
{
    return load_little_endian(bytes->data + bytes->size - 4 - entry * (count - index), entry);
}

/* The meshes lie one behind the other from byte 0 on. A file that was cut ends in other numbers than these. */
static bool is_dictionary(const ca_bytes *bytes, size_t entry, uint64_t count)
{
    if (count == 0 || count > (bytes->size - 4) / entry || dictionary_entry(bytes, entry, count, 0) != 0)
        return false;
    for (uint64_t i = 1; i < count; ++i)
        if (dictionary_entry(bytes, entry, count, i) <= dictionary_entry(bytes, entry, count, i - 1)) return false;
    return dictionary_entry(bytes, entry, count, count - 1) < bytes->size - 4 - entry * count;
}

/* The first mesh starts the file and needs no dictionary; the dictionary knows the others. */
static ca_status find_mesh(const char *path, const ca_bytes *bytes, uint32_t version, uint32_t shape_index,
                           size_t *offset, ca_error *error)
{
    *offset = 0;
    if (shape_index == 0) return CA_OK;
    const ca_location where = {.file = path};
    const size_t entry = version == 4 ? 8 : 4;
    const uint64_t count = load_little_endian(bytes->data + bytes->size - 4, 4);
    if (!is_dictionary(bytes, entry, count))
        return ca_fail(error, CA_ERROR_FORMAT, &where, "the dictionary of meshes at the end of the file is damaged");
    if (shape_index >= count)
        return ca_fail(error, CA_ERROR_SCENE, &where, "there is no mesh %u: the file has %llu, counted from 0",
                       shape_index, (unsigned long long)count);
    *offset = (size_t)dictionary_entry(bytes, entry, count, shape_index);
    return CA_OK;
}

static ca_status read_file(const char *path, const ca_bytes *bytes, uint32_t shape_index, ca_mesh *mesh,
                           ca_error *error)
{
    uint32_t version;
    size_t offset;
    CA_TRY(check_header(path, bytes, 0, &version, error));
    CA_TRY(find_mesh(path, bytes, version, shape_index, &offset, error));
    CA_TRY(check_header(path, bytes, offset, &version, error));
    mesh_stream stream = {.path = path, .zlib = {.zalloc = ca_alloc_for_library, .zfree = ca_free_for_library}};
    stream.source = bytes->data + offset + HEADER_BYTES;
    stream.source_bytes = bytes->size - offset - HEADER_BYTES;
    if (inflateInit(&stream.zlib) != Z_OK) return ca_fail_memory(error, path);
    const ca_status status = read_mesh(&stream, version, mesh, error);
    inflateEnd(&stream.zlib);
    return status;
}

ca_status ca_import_serialized(const char *path, uint32_t shape_index, ca_mesh *mesh, ca_error *error)
{
    *mesh = (ca_mesh){0};
    ca_bytes bytes;
    CA_TRY(ca_file_read(path, "mesh", max_file_bytes, &bytes, error));
    const ca_status status = read_file(path, &bytes, shape_index, mesh, error);
    if (status == CA_OK)
        mesh->content_hash = ca_hash_bytes(CA_HASH_START, bytes.data, bytes.size);
    else
        ca_mesh_destroy(mesh);
    ca_bytes_destroy(&bytes);
    return status;
}
