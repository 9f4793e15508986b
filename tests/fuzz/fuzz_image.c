/* libFuzzer on the image readers. PNG, JPEG, EXR, HDR, PFM, PNM, BMP and WebP are told apart by their first bytes,
 * all else is tried as TGA. */
#include "image/format.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    /* As ca_file_read leaves it: on the heap, with a zero behind. */
    ca_bytes bytes = {.data = malloc(size + 1), .size = size};
    if (!bytes.data) return 0;
    memcpy(bytes.data, data, size);
    bytes.data[size] = 0;

    ca_image image;
    ca_error error = {{0}};
    const ca_status status = ca_image_decode("fuzz.tga", &bytes, CA_ENCODING_SRGB, &image, &error);
    if (status != CA_OK && (!error.message[0] || image.data)) abort(); /* a failure has a message and no pixels */
    ca_image_destroy(&image);
    if (ca_exr_is(&bytes)) {
        ca_image_layers *layers;
        if (ca_exr_read_layers("fuzz.exr", &bytes, &layers, &error) != CA_OK && layers) abort();
        ca_layers_destroy(layers);
    }
    free(bytes.data);
    return 0;
}
