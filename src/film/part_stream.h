/* The bytes of part files: pieces that are written one after the other and read again, with a hash of all before it
 * at the end (base/hash.h). Every piece is a multiple of 8 bytes; numbers are little endian on every machine.
 *
 * Reading goes over the file twice, first for its hash, and holds no more than the caller's row of it. */
#ifndef CA_FILM_PART_STREAM_H
#define CA_FILM_PART_STREAM_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { CA_PART_MAGIC_BYTES = 8, CA_PART_HASH_BYTES = 8, CA_PART_TEXT_BYTES = 1 << 16 /* at most, of a text */ };

/* Numbers of formats: of blocks (part_file.h), of passes (pass_part.h), and of renders that are joined of several
 * films (render/auto_file.h). */
enum { CA_BLOCK_PART_FORMAT = 1, CA_PASS_PART_FORMAT = 5, CA_JOINED_PART_FORMAT = 6 };

/* The first bytes of every part file; a number follows that says which format it is. The first one and the line ends
 * notice a transfer as text. */
extern const unsigned char ca_part_magic[CA_PART_MAGIC_BYTES];

/* A size rounded up to whole pieces. */
static inline uint64_t ca_part_padded(uint64_t size) { return (size + 7) / 8 * 8; }

typedef struct ca_part_writer {
    FILE *stream; /* borrowed */
    uint64_t hash;
    bool good;
} ca_part_writer;

ca_part_writer ca_part_writer_start(FILE *stream);
void ca_part_put(ca_part_writer *writer, const unsigned char *bytes, size_t size);
void ca_part_put_u64(ca_part_writer *writer, uint64_t value);
/* Filled up with zeros. */
void ca_part_put_text(ca_part_writer *writer, const char *text);
void ca_part_put_hash(ca_part_writer *writer);

/* Opens a file, and says which format it is. Errors: CA_ERROR_FILE; CA_ERROR_FORMAT where it is no part file. The
 * stream, which is then behind the number of the format, is the caller's to close. */
ca_status ca_part_open(const char *path, FILE **stream, uint64_t *size, uint64_t *format, ca_error *error);
/* Refuses a file that is of another format than the expected one: says what it is. CA_ERROR_FORMAT. */
ca_status ca_part_fail_format(const char *path, uint64_t format, uint64_t expected, ca_error *error);
/* Why reading from the stream failed, where errno was 0 before: 0, it is not as it should be; ENOMEM; or the system's
 * error. */
int ca_part_failure(FILE *stream);
/* Is the hash at the end that of all before it? The stream is then where it was. */
bool ca_part_check_hash(FILE *stream, uint64_t size);
bool ca_part_get(FILE *stream, unsigned char *bytes, size_t size);
bool ca_part_get_u64(FILE *stream, uint64_t *value);
/* A text of `size` bytes, which the caller frees with ca_free; NULL: it has zeros in it, the file has an end, or,
 * with errno set to ENOMEM, the memory has. */
char *ca_part_get_text(FILE *stream, uint64_t size);

#endif
