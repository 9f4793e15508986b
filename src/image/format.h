/* The image file formats, one file each; image_read.c and layers_file.c choose between them.
 *
 * Readers take the whole file in memory and `path` for messages; on failure the image is empty. They never trust a
 * header: sizes are checked by ca_image_check_size before memory is taken, reading past the end is CA_ERROR_FORMAT,
 * and a message ends with what was expected. Writers put one complete file into an open stream and leave closing,
 * renaming and removing to the caller (base/file.h).
 *
 * Nothing in a library below prints or exits; its messages go into the ca_error. */
#ifndef CA_IMAGE_FORMAT_H
#define CA_IMAGE_FORMAT_H

#include "base/file.h"
#include "image/image.h"
#include "image/layers.h"

/* Largest file read: more than CA_IMAGE_MAX_PIXELS of RGB and alpha as floats. */
#define CA_IMAGE_MAX_FILE_BYTES ((size_t)1 << 33)

/* Any format but layers: what ca_image_read does once the file is in memory. */
ca_status ca_image_decode(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                          ca_error *error);

/* CA_ERROR_FORMAT where a picture has no pixels, is over the limits of image.h, or cannot possibly come from a file
 * of this many bytes (at one bit a pixel, deflate packs at most 1032 * 8 pixels into a byte). */
ca_status ca_image_check_size(const char *path, uint64_t width, uint64_t height, size_t file_bytes, ca_error *error);

/* The message for a file that ends too early. */
ca_status ca_image_fail_truncated(const char *path, const char *format, size_t file_bytes, ca_error *error);

/* decode[i]: the linear value of i / 255. */
void ca_srgb_table(ca_image_encoding encoding, float decode[256]);

ca_status ca_png_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error);
ca_status ca_jpeg_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                       ca_error *error);
ca_status ca_tga_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error);
ca_status ca_bmp_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error);
ca_status ca_pnm_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                      ca_error *error);
ca_status ca_webp_read(const char *path, const ca_bytes *bytes, ca_image_encoding encoding, ca_image *image,
                       ca_error *error);
ca_status ca_hdr_read(const char *path, const ca_bytes *bytes, ca_image *image, ca_error *error);
ca_status ca_pfm_read(const char *path, const ca_bytes *bytes, ca_image *image, ca_error *error);
/* R G B (A), or Y (A), of the data window. */
ca_status ca_exr_read_image(const char *path, const ca_bytes *bytes, ca_image *image, ca_error *error);
/* All channels, the windows, and the attributes that are text or numbers. */
ca_status ca_exr_read_layers(const char *path, const ca_bytes *bytes, ca_image_layers **layers, ca_error *error);

bool ca_png_is(const ca_bytes *bytes);
bool ca_jpeg_is(const ca_bytes *bytes);
bool ca_hdr_is(const ca_bytes *bytes);
bool ca_pfm_is(const ca_bytes *bytes);
bool ca_pnm_is(const ca_bytes *bytes);
bool ca_bmp_is(const ca_bytes *bytes);
bool ca_webp_is(const ca_bytes *bytes);
bool ca_exr_is(const ca_bytes *bytes);

struct _priv_exr_context_t; /* the core's context */

/* What the C core is given to call: its memory, and the keeper of its first complaint since ca_exr_message_clear. The
 * core complains with its own lock held, so the keeper may not ask the context for user data; there is one message
 * per thread instead. exr_read.c has them. */
void *ca_exr_allocate(size_t bytes);
void ca_exr_keep_message(const struct _priv_exr_context_t *context, int32_t code, const char *message);
void ca_exr_message_clear(void);
const char *ca_exr_message(void); /* "" where there was none */

ca_status ca_exr_write(const ca_image_layers *layers, FILE *stream, const char *path, ca_error *error);
/* rgb: three planes of width * height. */
ca_status ca_png_write(const float *const rgb[3], uint32_t width, uint32_t height, float exposure, FILE *stream,
                       const char *path, ca_error *error);
ca_status ca_pfm_write(const float *const rgb[3], uint32_t width, uint32_t height, FILE *stream, const char *path,
                       ca_error *error);

#endif
