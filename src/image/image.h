/* Pictures in memory.
 *
 * ca_image: a rectangle of floats, what textures and references are read into. Pixel (x, y) channel c is
 * data[(y * width + x) * channels + c]; row 0 is the top. Values are linear unless `read` was asked for raw data.
 * ca_image_layers (public as an opaque type): named channels of one size with attributes, what a film is developed
 * into and what image files are written from and compared by. */
#ifndef CA_IMAGE_IMAGE_H
#define CA_IMAGE_IMAGE_H

#include "base/status.h"
#include "math/rgb.h"

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

typedef struct ca_image {
    uint32_t width, height, channels; /* channels: 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha */
    float *data;                      /* owned, by so many: */
    atomic_uint *owners;
    uint64_t content_hash; /* of the file it was read from; 0: none */
    uint64_t made_of;      /* of an image of a scene: which file, read how, or which array; 0: not told */
} ca_image;

/* Largest image accepted from a file: sides and total of pixels, so that a hostile header cannot exhaust memory. */
enum { CA_IMAGE_MAX_SIDE = 65536 };
#define CA_IMAGE_MAX_PIXELS ((size_t)1 << 28)

/* How the numbers of 8 and 16 bit files become light. */
typedef enum ca_image_encoding {
    CA_ENCODING_SRGB, /* decode IEC 61966-2-1; float files (EXR, HDR, PFM) are linear already and stay as they are */
    CA_ENCODING_RAW,  /* value / maximum */
} ca_image_encoding;

ca_status ca_image_create(ca_image *image, uint32_t width, uint32_t height, uint32_t channels, ca_error *error);
void ca_image_destroy(ca_image *image);
/* Another owner of the same pixels, which never change from then on. */
ca_image ca_image_share(const ca_image *image);

/* Reads PNG, JPEG, EXR, HDR, TGA, BMP, PNM, PFM or WebP, told apart by content (TGA, which has no mark, by
 * extension). Of an EXR file the channels R G B (A) or Y are read. Alpha is kept unassociated, never colour-decoded.
 * Errors: CA_ERROR_FILE, CA_ERROR_FORMAT, CA_ERROR_MEMORY. */
ca_status ca_image_read(const char *path, ca_image_encoding encoding, ca_image *image, ca_error *error);

/* IEC 61966-2-1 transfer function, both ways, for values in [0, 1] (clamped by the caller where that matters). */
float ca_srgb_to_linear(float encoded);
float ca_linear_to_srgb(float linear);

static inline ca_rgb ca_image_rgb(const ca_image *image, uint32_t x, uint32_t y)
{
    const float *p = image->data + ((size_t)y * image->width + x) * image->channels;
    return image->channels >= 3 ? (ca_rgb){p[0], p[1], p[2]} : (ca_rgb){p[0], p[0], p[0]};
}

#endif
