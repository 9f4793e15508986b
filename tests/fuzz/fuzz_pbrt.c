/* Fuzzer of the reader of pbrt's scenes, from memory. Files that the text names are looked for in tests/fuzz/pbrt. */
#include "import/import.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    ca_scene_desc desc;
    ca_error error = {{0}};
    const char *path = CA_SOURCE_DIR "/tests/fuzz/pbrt/fuzz.pbrt";
    if (ca_import_scene_text((const char *)data, size, path, NULL, 0, &desc, &error) == CA_OK)
        ca_scene_desc_destroy(&desc);
    else if (!error.message[0])
        abort();
    return 0;
}
