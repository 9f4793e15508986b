#include "report/plane.h"

#include "base/memory.h"

#include <assert.h>
#include <math.h>
#include <string.h>
#include <zlib.h>

enum {
    PIECE_BYTES = 192 * 1024, /* a multiple of 3: base64 without padding between pieces */
    COMPRESSION_LEVEL = 1,    /* noise hardly shrinks whatever the effort */
};

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

float ca_plane_round(float value, int bits)
{
    assert(bits >= 1 && bits <= CA_PLANE_EXACT);
    if (bits == CA_PLANE_EXACT || !isfinite(value)) return value;
    const uint32_t dropped = (uint32_t)(CA_PLANE_EXACT - bits), mask = ~((UINT32_C(1) << dropped) - 1);
    const uint32_t whole = bits_of(value), rounded = (whole + (UINT32_C(1) << (dropped - 1))) & mask;
    /* A carry into the exponent is right, but beyond the largest one it would be infinity. */
    const uint32_t kept = (rounded & 0x7f800000) == 0x7f800000 ? whole & mask : rounded;
    memcpy(&value, &kept, sizeof value);
    return value;
}

/* ---- 16 bit floats --------------------------------------------------------------------------------------------- */

/* IEEE 754 binary16; false where the value is none. */
static bool half_of(float value, uint16_t *half)
{
    const uint32_t bits = bits_of(value), sign = bits >> 16 & 0x8000, mantissa = bits & 0x7fffff;
    const int exponent = (int)(bits >> 23 & 0xff) - 127;
    if (exponent == 128) { /* infinity or no number */
        *half = (uint16_t)(sign | 0x7c00 | mantissa >> 13);
        return (mantissa & 0x1fff) == 0;
    }
    if ((bits & 0x7fffffff) == 0) {
        *half = (uint16_t)sign;
        return true;
    }
    if (exponent > 15 || exponent < -24) return false;
    if (exponent >= -14) {
        *half = (uint16_t)(sign | (uint32_t)(exponent + 15) << 10 | mantissa >> 13);
        return (mantissa & 0x1fff) == 0;
    }
    const int shift = -exponent - 1; /* below the normal numbers: in units of 2^-24 */
    const uint32_t significand = mantissa | 0x800000;
    *half = (uint16_t)(sign | significand >> shift);
    return (significand & ((UINT32_C(1) << shift) - 1)) == 0;
}

bool ca_plane_fits_half(const float *values, size_t count, int bits)
{
    uint16_t half;
    for (size_t i = 0; i < count; i++)
        if (!half_of(ca_plane_round(values[i], bits), &half)) return false;
    return true;
}

/* All lowest bytes, then all second ones, ...: bytes of one kind are alike, which deflate lives from. */
static void shuffle(const ca_plane *plane, unsigned char *bytes)
{
    const int size = plane->half ? 2 : 4;
    for (size_t i = 0; i < plane->count; i++) {
        const float value = ca_plane_round(plane->values[i], plane->bits);
        uint16_t half = 0;
        if (plane->half) (void)half_of(value, &half);
        const uint32_t word = plane->half ? half : bits_of(value);
        for (int k = 0; k < size; k++) bytes[(size_t)k * plane->count + i] = (unsigned char)(word >> (8 * k));
    }
}

/* ---- Text ------------------------------------------------------------------------------------------------------ */

typedef struct piece_buffers {
    unsigned char deflated[PIECE_BYTES];
    char text[PIECE_BYTES / 3 * 4];
} piece_buffers;

size_t ca_base64(const unsigned char *bytes, size_t size, char *text)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t length = 0;
    for (size_t i = 0; i < size; i += 3) {
        const size_t left = size - i;
        const uint32_t word = (uint32_t)bytes[i] << 16 | (left > 1 ? (uint32_t)bytes[i + 1] << 8 : 0) |
                              (left > 2 ? bytes[i + 2] : 0);
        text[length++] = digits[word >> 18];
        text[length++] = digits[word >> 12 & 63];
        text[length++] = left > 1 ? digits[word >> 6 & 63] : '=';
        text[length++] = left > 2 ? digits[word & 63] : '=';
    }
    return length;
}

static void write_piece(const ca_plane *plane, piece_buffers *buffers, size_t size, bool last, FILE *stream)
{
    fprintf(stream, "<script type=\"text/plain\" data-plane=\"%u-%u\"%s>", plane->image, plane->number,
            last ? " data-end" : "");
    fwrite(buffers->text, 1, ca_base64(buffers->deflated, size, buffers->text), stream);
    fputs("</script>\n", stream);
}

/* zlib counts in 32 bits; a plane of at most 2^28 pixels of 4 bytes fits. */
static ca_status write_deflated(const ca_plane *plane, unsigned char *bytes, piece_buffers *buffers, FILE *stream,
                                ca_error *error)
{
    z_stream zlib = {.zalloc = ca_alloc_for_library, .zfree = ca_free_for_library};
    if (deflateInit(&zlib, COMPRESSION_LEVEL) != Z_OK) return ca_fail_memory(error, "the page's pictures");
    zlib.next_in = bytes;
    zlib.avail_in = (uInt)(plane->count * (plane->half ? 2 : 4));
    bool last = false;
    while (!last) {
        zlib.next_out = buffers->deflated;
        zlib.avail_out = PIECE_BYTES;
        last = deflate(&zlib, Z_FINISH) == Z_STREAM_END;
        write_piece(plane, buffers, PIECE_BYTES - zlib.avail_out, last, stream);
    }
    deflateEnd(&zlib);
    return CA_OK;
}

ca_status ca_plane_write(const ca_plane *plane, FILE *stream, ca_error *error)
{
    unsigned char *bytes = ca_alloc(plane->count, plane->half ? 2 : 4);
    piece_buffers *buffers = ca_alloc(1, sizeof *buffers);
    ca_status status = CA_ERROR_MEMORY;
    if (bytes && buffers) {
        shuffle(plane, bytes);
        status = write_deflated(plane, bytes, buffers, stream, error);
    } else {
        (void)ca_fail_memory(error, "the page's pictures");
    }
    ca_free(bytes);
    ca_free(buffers);
    return status;
}
