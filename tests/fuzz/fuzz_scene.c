/* libFuzzer on the scene importer, from memory. Seeds: tests/fuzz/scene, and scenes/. Files that the text names are
 * looked for in the current folder. */
#include "import/import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    ca_scene_desc desc;
    ca_error error;
    if (ca_import_scene_text((const char *)data, size, "fuzz.xml", NULL, 0, &desc, &error) == CA_OK)
        ca_scene_desc_destroy(&desc);
    return 0;
}
