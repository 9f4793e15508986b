#include "import/nearest.h"

#include "base/text.h"

#include <stdint.h>
#include <string.h>

/* ca_edit_distance compares words up to this length. */
enum { COMPARED = 63 };

static size_t distance(const char *a, const char *b)
{
    char short_a[COMPARED + 1] = "", short_b[COMPARED + 1] = "";
    return ca_edit_distance(strncpy(short_a, a, COMPARED), strncpy(short_b, b, COMPARED));
}

const char *ca_import_nearest(const char *wrong, const char *const *known, size_t count)
{
    const char *best = NULL;
    size_t best_distance = SIZE_MAX;
    for (size_t i = 0; i < count; i++) {
        const size_t edits = known[i] ? distance(wrong, known[i]) : SIZE_MAX;
        if (edits >= best_distance) continue;
        best = known[i];
        best_distance = edits;
    }
    return best;
}
