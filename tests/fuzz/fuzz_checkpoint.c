/* Fuzzer of files of passes: parts and checkpoints. */
#define _GNU_SOURCE
#include "base/memory.h"
#include "film/part_stream.h"
#include "film/pass_part.h"
#include "memory_file.h"
#include "sealed_part.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

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
    uint8_t *copy = sealed_part(data, size);
    if (!copy) return 0;
    const ca_status status = ca_pass_reader_open(&reader, memory_file(copy, size), &error);
    if (status != CA_OK && (!error.message[0] || reader.stream)) abort(); /* a failure has a message, and no file */
    if (status == CA_OK) read_film(&reader);
    ca_pass_reader_close(&reader);
    free(copy);
    return 0;
}
