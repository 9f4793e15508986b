/* What is written to a part file and read from it again, described once for both directions: what one writes is what
 * the other expects. A third direction only counts the bytes.
 *
 * Every call is one piece or several of part_stream.h. After a failure (`good` is false) nothing is written or read
 * any more, and what was to be read keeps its value. Reading checks only what a machine cannot hold: ranges and
 * meaning are the caller's. */
#ifndef CA_FILM_PART_EXCHANGE_H
#define CA_FILM_PART_EXCHANGE_H

#include "film/part_stream.h"

typedef struct ca_part_exchange {
    ca_part_writer *writer; /* borrowed; of what is written */
    FILE *stream;           /* borrowed; of what is read. Neither of the two: bytes are counted */
    uint64_t bytes;         /* so far */
    bool good;
} ca_part_exchange;

ca_part_exchange ca_part_exchange_count(void);
ca_part_exchange ca_part_exchange_write(ca_part_writer *writer);
ca_part_exchange ca_part_exchange_read(FILE *stream);

void ca_part_exchange_u64(ca_part_exchange *x, uint64_t *value);
void ca_part_exchange_u32(ca_part_exchange *x, uint32_t *value);
void ca_part_exchange_bool(ca_part_exchange *x, bool *value);
/* Any double, NAN and infinities too. */
void ca_part_exchange_double(ca_part_exchange *x, double *value);
/* Read texts are the caller's to free (ca_free). */
void ca_part_exchange_text(ca_part_exchange *x, char **text);

/* An array of structures that have so many doubles, then floats, then 32-bit integers, and no gaps. A double or a
 * float that is read must be finite, unless it may be no number. */
typedef struct ca_part_layout {
    size_t doubles, floats, integers;
    bool may_be_nan;
} ca_part_layout;

static inline size_t ca_part_layout_bytes(ca_part_layout layout)
{
    return layout.doubles * sizeof(double) + layout.floats * sizeof(float) + layout.integers * sizeof(uint32_t);
}

/* What it takes in a file. */
uint64_t ca_part_array_bytes(size_t count, ca_part_layout layout);
void ca_part_exchange_array(ca_part_exchange *x, void *array, size_t count, ca_part_layout layout);

#endif
