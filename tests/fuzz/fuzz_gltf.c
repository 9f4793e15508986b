/* Fuzzer of the reader of glTF scenes, from memory: JSON, or the container that its first bytes tell. Files that it
 * names are looked for in tests/fuzz/gltf. */
#include "import/import.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    ca_scene_desc desc;
    ca_error error = {{0}};
    const bool is_container = size >= 4 && memcmp(data, "glTF", 4) == 0;
    const char *path = CA_SOURCE_DIR "/tests/fuzz/gltf/fuzz.gltf";
    if (is_container) path = CA_SOURCE_DIR "/tests/fuzz/gltf/fuzz.glb";
    if (ca_import_scene_text((const char *)data, size, path, NULL, 0, &desc, &error) == CA_OK)
        ca_scene_desc_destroy(&desc);
    else if (!error.message[0])
        abort();
    return 0;
}
