#include "film/part_exchange.h"

#include "base/little_endian.h"

#include <math.h>
#include <string.h>

ca_part_exchange ca_part_exchange_count(void) { return (ca_part_exchange){.good = true}; }

ca_part_exchange ca_part_exchange_write(ca_part_writer *writer)
{
    return (ca_part_exchange){.writer = writer, .good = true};
}

ca_part_exchange ca_part_exchange_read(FILE *stream) { return (ca_part_exchange){.stream = stream, .good = true}; }

static void exchange_bytes(ca_part_exchange *x, unsigned char *bytes, size_t size)
{
    x->bytes += size;
    if (!x->good) return;
    if (x->writer) {
        ca_part_put(x->writer, bytes, size);
        x->good = x->writer->good;
    } else if (x->stream) {
        x->good = ca_part_get(x->stream, bytes, size);
    }
}

static bool has_read(const ca_part_exchange *x) { return x->stream && x->good; }

/* ---- Numbers and texts ----------------------------------------------------------------------------------------- */

void ca_part_exchange_u64(ca_part_exchange *x, uint64_t *value)
{
    unsigned char bytes[8];
    ca_put_u64(bytes, *value);
    exchange_bytes(x, bytes, sizeof bytes);
    if (has_read(x)) *value = ca_get_u64(bytes);
}

void ca_part_exchange_u32(ca_part_exchange *x, uint32_t *value)
{
    uint64_t wide = *value;
    ca_part_exchange_u64(x, &wide);
    if (wide > UINT32_MAX) x->good = false;
    if (has_read(x)) *value = (uint32_t)wide;
}

void ca_part_exchange_bool(ca_part_exchange *x, bool *value)
{
    uint64_t wide = *value;
    ca_part_exchange_u64(x, &wide);
    if (wide > 1) x->good = false;
    if (has_read(x)) *value = wide == 1;
}

void ca_part_exchange_double(ca_part_exchange *x, double *value)
{
    uint64_t bits = ca_double_bits(*value);
    ca_part_exchange_u64(x, &bits);
    if (has_read(x)) *value = ca_bits_double(bits);
}

void ca_part_exchange_text(ca_part_exchange *x, char **text)
{
    uint64_t size = x->stream ? 0 : strlen(*text);
    ca_part_exchange_u64(x, &size);
    x->bytes += ca_part_padded(size);
    if (!x->good) return;
    if (x->writer) {
        ca_part_put_text(x->writer, *text);
        x->good = x->writer->good;
    } else if (x->stream) {
        *text = ca_part_get_text(x->stream, size);
        x->good = *text != NULL;
    }
}

/* ---- Arrays ---------------------------------------------------------------------------------------------------- */

/* Numbers of `size` bytes, the lowest byte first. */
static void put_numbers(unsigned char **bytes, const char **memory, size_t count, size_t size)
{
    for (size_t i = 0; i < count; i++, *bytes += size, *memory += size) {
        uint64_t wide;
        uint32_t narrow;
        if (size == sizeof wide) {
            memcpy(&wide, *memory, sizeof wide);
        } else {
            memcpy(&narrow, *memory, sizeof narrow);
            wide = narrow;
        }
        for (size_t b = 0; b < size; b++) (*bytes)[b] = (unsigned char)(wide >> (8 * b));
    }
}

static uint64_t get_number(const unsigned char *bytes, size_t size)
{
    uint64_t number = 0;
    for (size_t b = 0; b < size; b++) number |= (uint64_t)bytes[b] << (8 * b);
    return number;
}

static bool get_doubles(const unsigned char **bytes, char **memory, size_t count)
{
    bool good = true;
    for (size_t i = 0; i < count; i++, *bytes += sizeof(double), *memory += sizeof(double)) {
        const double value = ca_bits_double(get_number(*bytes, sizeof value));
        memcpy(*memory, &value, sizeof value);
        good = good && isfinite(value);
    }
    return good;
}

static bool get_narrow(const unsigned char **bytes, char **memory, size_t count, bool floats)
{
    bool good = true;
    for (size_t i = 0; i < count; i++, *bytes += sizeof(uint32_t), *memory += sizeof(uint32_t)) {
        const uint32_t bits = (uint32_t)get_number(*bytes, sizeof bits);
        float value;
        memcpy(*memory, &bits, sizeof bits);
        memcpy(&value, &bits, sizeof value);
        good = good && (!floats || isfinite(value));
    }
    return good;
}

static void encode(unsigned char *bytes, const char *memory, size_t count, ca_part_layout layout)
{
    for (size_t i = 0; i < count; i++) {
        put_numbers(&bytes, &memory, layout.doubles, sizeof(double));
        put_numbers(&bytes, &memory, layout.floats + layout.integers, sizeof(uint32_t));
    }
}

static bool decode(const unsigned char *bytes, char *memory, size_t count, ca_part_layout layout)
{
    bool good = true;
    for (size_t i = 0; i < count; i++) {
        good = get_doubles(&bytes, &memory, layout.doubles) && good;
        good = get_narrow(&bytes, &memory, layout.floats, true) && good;
        good = get_narrow(&bytes, &memory, layout.integers, false) && good;
    }
    return good || layout.may_be_nan;
}

uint64_t ca_part_array_bytes(size_t count, ca_part_layout layout)
{
    return ca_part_padded((uint64_t)count * ca_part_layout_bytes(layout));
}

/* Chunks of an even number of structures are whole pieces; the last one is filled up. */
void ca_part_exchange_array(ca_part_exchange *x, void *array, size_t count, ca_part_layout layout)
{
    unsigned char bytes[1 << 13] = {0};
    const size_t each = ca_part_layout_bytes(layout), most = sizeof bytes / each / 2 * 2;
    char *memory = array;
    for (size_t i = 0; i < count && x->good; i += most) {
        const size_t now = count - i < most ? count - i : most, size = (size_t)ca_part_padded(now * each);
        if (x->writer) {
            memset(bytes + now * each, 0, size - now * each);
            encode(bytes, memory + i * each, now, layout);
        }
        exchange_bytes(x, bytes, size);
        if (has_read(x)) x->good = decode(bytes, memory + i * each, now, layout);
    }
}
