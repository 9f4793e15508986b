/* One channel as text in a page: what viewer.js decodes.
 *
 * Values are rounded to so many significant bits, stored as 32 bit floats, or as 16 bit floats where that loses
 * nothing, byte by byte (the lowest bytes of all values first), deflated as a zlib stream, and written as base64 in
 * pieces of at most 256 KiB, each a script element of a type that no browser runs:
 *
 *     <script type="text/plain" data-plane="3-0">...</script>            (the last one with data-end)
 *
 * A piece is base64 of its own. Values that are not finite stay so. Cost: about 30 ns a value; memory: 5 bytes a
 * value. */
#ifndef CA_REPORT_PLANE_H
#define CA_REPORT_PLANE_H

#include "base/status.h"

#include <stddef.h>
#include <stdio.h>

enum { CA_PLANE_EXACT = 24 }; /* significant bits of a float */

/* `value` rounded to `bits` significant bits (1 to 24), ties away from zero; never to infinity. */
float ca_plane_round(float value, int bits);

/* Can all of the values, rounded so, be 16 bit floats without loss? */
bool ca_plane_fits_half(const float *values, size_t count, int bits);

/* As base64, padded to whole groups of four characters, without a zero byte; gives back how many these are: size / 3
 * rounded up, times 4. Both are apart. */
size_t ca_base64(const unsigned char *bytes, size_t size, char *text);

typedef struct ca_plane {
    const float *values; /* borrowed */
    size_t count;
    int bits;  /* significant ones to keep */
    bool half; /* as ca_plane_fits_half found */
    uint32_t image, number; /* how the page calls it: data-plane="image-number" */
} ca_plane;

/* Errors: CA_ERROR_MEMORY. The stream's own errors are the caller's to ask for. */
ca_status ca_plane_write(const ca_plane *plane, FILE *stream, ca_error *error);

#endif
