/* Fuzzer of files of passes: parts and checkpoints. The size that the file tells of itself and the hash at its end,
 * which keep all but one of 2^64 mutations out, are put right first. */
#define _GNU_SOURCE
#include "base/hash.h"
#include "base/memory.h"
#include "film/part_stream.h"
#include "film/pass_part.h"
#include "memory_file.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SIZE_AT = 16, HASH = 8 }; /* behind the magic and the format */

static void read_film(ca_pass_reader *reader)
{
    ca_film film;
    ca_image_layers *layers;
    ca_error error = {{0}};
    if (ca_pass_film_create(&film, &reader->film, &error) == CA_OK &&
        ca_pass_reader_add(reader, &film, true, &error) == CA_OK) {
        (void)ca_film_summarise(&film);
        if (ca_film_develop(&film, 1, &layers, &error) == CA_OK) ca_layers_destroy(layers);
    } else if (!error.message[0]) {
        abort();
    }
    ca_film_destroy(&film);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    ca_pass_reader reader;
    ca_error error = {{0}};
    uint8_t *copy = malloc(size + 1);
    if (!copy) return 0;
    memcpy(copy, data, size);
    if (size >= SIZE_AT + 8 + HASH) {
        ca_put_u64(copy + SIZE_AT, size);
        ca_put_u64(copy + size - HASH, ca_hash_bytes(CA_HASH_START, copy, size - HASH));
    }
    const ca_status status = ca_pass_reader_open(&reader, memory_file(copy, size), &error);
    if (status != CA_OK && (!error.message[0] || reader.stream)) abort(); /* a failure has a message, and no file */
    if (status == CA_OK) read_film(&reader);
    ca_pass_reader_close(&reader);
    free(copy);
    return 0;
}
