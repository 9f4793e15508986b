/* Fuzzer of tables of lenses. */
#include "import/lens_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static ca_lens_table table;
    ca_error error = {{0}};
    char *text = malloc(size + 1);
    if (!text) return 0;
    memcpy(text, data, size);
    text[size] = '\0';
    const ca_status status = ca_import_lens("fuzz.dat", text, size, NULL, &table, &error);
    if (status != CA_OK && !error.message[0]) abort();
    for (uint32_t i = 0; status == CA_OK && i < table.lens.count; i++)
        if (!(table.lens.surfaces[i].index >= 1.0) || !isfinite(table.lens.surfaces[i].thickness)) abort();
    free(text);
    return 0;
}
