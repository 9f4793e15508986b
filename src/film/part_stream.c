#define _POSIX_C_SOURCE 200809L
#include "film/part_stream.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/memory.h"

#include <errno.h>
#include <string.h>

const unsigned char ca_part_magic[CA_PART_MAGIC_BYTES] = {0x89, 'C', 'A', 'P', '\r', '\n', 0x1a, '\n'};

/* ---- Writing --------------------------------------------------------------------------------------------------- */

ca_part_writer ca_part_writer_start(FILE *stream)
{
    return (ca_part_writer){.stream = stream, .hash = CA_HASH_START, .good = true};
}

void ca_part_put(ca_part_writer *writer, const unsigned char *bytes, size_t size)
{
    writer->hash = ca_hash_bytes(writer->hash, bytes, size);
    writer->good = writer->good && fwrite(bytes, 1, size, writer->stream) == size;
}

void ca_part_put_u64(ca_part_writer *writer, uint64_t value)
{
    unsigned char bytes[8];
    ca_put_u64(bytes, value);
    ca_part_put(writer, bytes, sizeof bytes);
}

void ca_part_put_text(ca_part_writer *writer, const char *text)
{
    const size_t size = strlen(text), rest = size % 8;
    unsigned char last[8] = {0};
    memcpy(last, text + size - rest, rest);
    ca_part_put(writer, (const unsigned char *)text, size - rest);
    if (rest) ca_part_put(writer, last, sizeof last);
}

void ca_part_put_hash(ca_part_writer *writer) { ca_part_put_u64(writer, writer->hash); }

/* ---- Reading --------------------------------------------------------------------------------------------------- */

/* A seek that fails leaves its error in errno alone. */
static const char *content_of(uint64_t format)
{
    switch (format) {
    case CA_BLOCK_PART_FORMAT: return "blocks";
    case CA_PASS_PART_FORMAT: return "passes";
    case CA_JOINED_PART_FORMAT: return "a render with rays \"auto\"";
    default: return NULL;
    }
}

ca_status ca_part_fail_format(const char *path, uint64_t format, uint64_t expected, ca_error *error)
{
    const char *content = content_of(format);
    if (!content)
        return ca_fail(error, CA_ERROR_FORMAT, NULL,
                       "%s: a part file of format %llu, which this version does not read", path,
                       (unsigned long long)format);
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: a part file of %s, not of %s", path, content,
                   content_of(expected));
}

int ca_part_failure(FILE *stream)
{
    if (errno == ENOMEM || errno == EIO) return errno;
    return ferror(stream) ? EIO : 0;
}

bool ca_part_get(FILE *stream, unsigned char *bytes, size_t size) { return fread(bytes, 1, size, stream) == size; }

bool ca_part_get_u64(FILE *stream, uint64_t *value)
{
    unsigned char bytes[8];
    if (!ca_part_get(stream, bytes, sizeof bytes)) return false;
    *value = ca_get_u64(bytes);
    return true;
}

char *ca_part_get_text(FILE *stream, uint64_t size)
{
    const size_t whole = (size_t)ca_part_padded(size);
    if (size > CA_PART_TEXT_BYTES) return NULL;
    char *text = ca_alloc_zeroed(whole + 1, 1);
    if (!text) errno = ENOMEM;
    if (text && ca_part_get(stream, (unsigned char *)text, whole) && strlen(text) == size) return text;
    ca_free(text);
    return NULL;
}

static ca_status read_start(const char *path, FILE *stream, uint64_t size, uint64_t *format, ca_error *error)
{
    unsigned char magic[CA_PART_MAGIC_BYTES];
    const size_t have = fread(magic, 1, sizeof magic, stream);
    const bool numbered = have == sizeof magic && ca_part_get_u64(stream, format);
    if (ferror(stream)) return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot read: %s", path, strerror(errno));
    if (have == 0 || memcmp(magic, ca_part_magic, have) != 0)
        return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: not a part file", path);
    if (numbered) return CA_OK;
    return ca_fail(error, CA_ERROR_FORMAT, NULL, "%s: this part file is cut off after %llu bytes", path,
                   (unsigned long long)size);
}

ca_status ca_part_open(const char *path, FILE **stream, uint64_t *size, uint64_t *format, ca_error *error)
{
    CA_TRY(ca_file_open(path, "part file", stream, size, error));
    const ca_status status = read_start(path, *stream, *size, format, error);
    if (status == CA_OK) return CA_OK;
    fclose(*stream);
    *stream = NULL;
    return status;
}

bool ca_part_check_hash(FILE *stream, uint64_t size)
{
    unsigned char bytes[1 << 14];
    const long long place = ftello(stream);
    uint64_t hash = CA_HASH_START, left = size - CA_PART_HASH_BYTES, told;
    bool good = place >= 0 && size >= CA_PART_HASH_BYTES && size % 8 == 0 && fseeko(stream, 0, SEEK_SET) == 0;
    while (good && left > 0) {
        const size_t now = left < sizeof bytes ? (size_t)left : sizeof bytes;
        good = ca_part_get(stream, bytes, now);
        if (good) hash = ca_hash_bytes(hash, bytes, now);
        left -= now;
    }
    good = good && ca_part_get_u64(stream, &told) && told == hash;
    return good && fseeko(stream, place, SEEK_SET) == 0;
}
