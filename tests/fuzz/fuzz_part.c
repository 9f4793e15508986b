/* libFuzzer on part files. The hash at their end, which keeps all but one of 2^64 mutations out, is put right
 * first. */
#include "base/hash.h"
#include "film/part_file.h"

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
    if (size >= 8) ca_put_u64(bytes.data + size - 8, ca_hash_bytes(CA_HASH_START, bytes.data, size - 8));

    ca_part part;
    ca_error error = {{0}};
    const ca_status status = ca_part_decode("fuzz.part", &bytes, &part, &error);
    if (status != CA_OK && (!error.message[0] || part.film)) abort(); /* a failure has a message and no film */
    if (status == CA_OK) {
        ca_image_layers *layers;
        if (ca_block_film_develop(part.film, 1, &layers, &error) == CA_OK) ca_layers_destroy(layers);
        (void)ca_block_film_mean_luminance(part.film);
    }
    ca_part_destroy(&part);
    free(bytes.data);
    return 0;
}
