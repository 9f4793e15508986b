#include "import/nearest.h"

#include <stdint.h>
#include <string.h>

/* Longer names are compared by their beginnings: enough to find a typing error. */
enum { COMPARED = 48 };

static char lower(char c) { return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c; }

static size_t compared_length(const char *name)
{
    const size_t length = strlen(name);
    return length < COMPARED ? length : COMPARED;
}

/* Levenshtein's distance, one row of the table at a time. */
static size_t edit_distance(const char *a, const char *b)
{
    const size_t a_length = compared_length(a), b_length = compared_length(b);
    size_t row[COMPARED + 1];
    for (size_t j = 0; j <= b_length; j++) row[j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            const size_t replace = diagonal + (lower(a[i - 1]) != lower(b[j - 1]));
            const size_t shift = 1 + (row[j] < row[j - 1] ? row[j] : row[j - 1]);
            diagonal = row[j];
            row[j] = replace < shift ? replace : shift;
        }
    }
    return row[b_length];
}

const char *ca_nearest_name(const char *wrong, const char *const *known, size_t count)
{
    const char *best = NULL;
    size_t best_distance = SIZE_MAX;
    for (size_t i = 0; i < count; i++) {
        if (!known[i]) continue;
        const size_t distance = edit_distance(wrong, known[i]);
        if (distance >= best_distance) continue;
        best = known[i];
        best_distance = distance;
    }
    return best;
}
