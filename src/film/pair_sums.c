#include "film/pair_sums.h"

#include "base/memory.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { FIRST_BITS = 7 }; /* of the table */

/* A light path that merged with the pixel's camera paths. C here is what the two have merged: what camera paths find alone is the
 * same for all light paths, and added where the sums are used. */
typedef struct pair_entry {
    uint32_t light_path;
    uint32_t camera_path; /* the last one it merged with, from 1 */
    double pair;          /* C with that */
    double halves[2];     /* sums of C over the camera paths of each half */
} pair_entry;

_Static_assert(sizeof(pair_entry) == 32, "pair_sums.h promises 32 bytes");

struct ca_pair_sums {
    pair_entry *entries; /* owned; in the order of their first merges; half as many as slots */
    uint32_t *slots;     /* owned; 2^bits of them, open addressing: an entry's number plus 1; 0: free */
    uint32_t bits;
    uint32_t count; /* of entries */
    bool failed;

    uint32_t light_paths, camera_paths; /* N_F; how many camera paths have begun */
    /* Of the current camera path. */
    double alone;
    double merged[2]; /* sums over the light paths of each half */
    /* Of the pixel. Over all pairs: */
    double sum, squares; /* of what merged */
    double cross;        /* of what merged times what is alone */
    /* Over camera paths: */
    double sum_alone, squares_alone;
    double alone_halves[2]; /* over those of each half */
    double camera;          /* of the products of the light paths' halves' means */
};

/* ---- The table ------------------------------------------------------------------------------------------------------ */

static inline size_t slot_count(uint32_t bits) { return (size_t)1 << bits; }

/* Numbers of light paths come in no order, but all from 0 on: the golden ratio spreads them. */
static inline size_t first_slot(uint32_t light_path, uint32_t bits)
{
    return (size_t)((light_path * UINT64_C(0x9e3779b97f4a7c15)) >> (64 - bits));
}

/* The slot that holds the light path, or the free one where it belongs. Half of all are free. */
static uint32_t *find_slot(const ca_pair_sums *sums, uint32_t light_path)
{
    const size_t mask = slot_count(sums->bits) - 1;
    size_t at = first_slot(light_path, sums->bits);
    while (sums->slots[at] > 0 && sums->entries[sums->slots[at] - 1].light_path != light_path) at = (at + 1) & mask;
    return &sums->slots[at];
}

/* Frees all slots. From where an entry's search begins to where it is, none is free unless made so here, with all that follow. */
static void clear_table(ca_pair_sums *sums)
{
    const size_t mask = slot_count(sums->bits) - 1;
    for (uint32_t i = 0; i < sums->count; i++)
        for (size_t at = first_slot(sums->entries[i].light_path, sums->bits); sums->slots[at] > 0; at = (at + 1) & mask)
            sums->slots[at] = 0;
    sums->count = 0;
}

/* A table of 2^bits slots with all that is in the old one. On failure the old one stays. */
static bool make_table(ca_pair_sums *sums, uint32_t bits)
{
    pair_entry *entries = ca_alloc(slot_count(bits) / 2, sizeof *entries);
    uint32_t *slots = ca_alloc_zeroed(slot_count(bits), sizeof *slots);
    if (!entries || !slots) {
        ca_free(entries);
        ca_free(slots);
        return false;
    }
    if (sums->count > 0) memcpy(entries, sums->entries, sums->count * sizeof *entries);
    ca_free(sums->entries);
    ca_free(sums->slots);
    sums->entries = entries;
    sums->slots = slots;
    sums->bits = bits;
    for (uint32_t i = 0; i < sums->count; i++) *find_slot(sums, entries[i].light_path) = i + 1;
    return true;
}

/* The light path's entry; NULL when out of memory. */
static pair_entry *find_entry(ca_pair_sums *sums, uint32_t light_path)
{
    uint32_t *slot = find_slot(sums, light_path);
    if (*slot > 0) return &sums->entries[*slot - 1];
    if (sums->count == slot_count(sums->bits) / 2) {
        if (!make_table(sums, sums->bits + 1)) return NULL;
        slot = find_slot(sums, light_path);
    }
    pair_entry *entry = &sums->entries[sums->count];
    *slot = ++sums->count;
    *entry = (pair_entry){.light_path = light_path};
    return entry;
}

ca_status ca_pair_sums_create(ca_pair_sums **sums, ca_error *error)
{
    *sums = ca_alloc_zeroed(1, sizeof **sums);
    if (*sums && make_table(*sums, FIRST_BITS)) return CA_OK;
    ca_free(*sums);
    *sums = NULL;
    return ca_fail_memory(error, "the pairs of light and camera paths");
}

void ca_pair_sums_destroy(ca_pair_sums *sums)
{
    if (!sums) return;
    ca_free(sums->entries);
    ca_free(sums->slots);
    ca_free(sums);
}

bool ca_pair_sums_complete(const ca_pair_sums *sums) { return !sums->failed; }

/* ---- Adding --------------------------------------------------------------------------------------------------------- */

void ca_pair_sums_begin(ca_pair_sums *sums, uint32_t light_paths)
{
    assert(light_paths >= 2);
    clear_table(sums);
    *sums = (ca_pair_sums){.entries = sums->entries,
                           .slots = sums->slots,
                           .bits = sums->bits,
                           .failed = sums->failed,
                           .light_paths = light_paths};
}

/* The half of the current camera path; counting begins with 0, their numbers with 1. */
static inline uint32_t camera_half(const ca_pair_sums *sums) { return (sums->camera_paths - 1) & 1; }

/* The current camera path is complete. */
static void close_path(ca_pair_sums *sums)
{
    if (sums->camera_paths == 0) return;
    const double merged = sums->merged[0] + sums->merged[1], alone = sums->alone;
    const double first = sums->light_paths - sums->light_paths / 2, second = sums->light_paths / 2;
    sums->sum += merged;
    sums->sum_alone += alone;
    sums->squares_alone += alone * alone;
    sums->cross += alone * merged;
    sums->alone_halves[camera_half(sums)] += alone;
    sums->camera += (sums->merged[0] / first + alone) * (sums->merged[1] / second + alone);
    sums->alone = sums->merged[0] = sums->merged[1] = 0.0;
}

void ca_pair_sums_next_path(ca_pair_sums *sums)
{
    close_path(sums);
    sums->camera_paths++;
}

void ca_pair_sums_add(ca_pair_sums *sums, uint32_t light_path, double luminance)
{
    assert(sums->camera_paths > 0 && light_path < sums->light_paths);
    pair_entry *entry = find_entry(sums, light_path);
    if (!entry) {
        sums->failed = true;
        return;
    }
    if (entry->camera_path != sums->camera_paths) {
        entry->camera_path = sums->camera_paths;
        entry->pair = 0.0;
    }
    sums->squares += luminance * (2.0 * entry->pair + luminance); /* by so much the pair's square grows */
    entry->pair += luminance;
    entry->halves[camera_half(sums)] += luminance;
    sums->merged[light_path & 1] += luminance;
}

void ca_pair_sums_add_alone(ca_pair_sums *sums, double luminance)
{
    assert(sums->camera_paths > 0);
    sums->alone += luminance;
}

/* ---- The estimators ------------------------------------------------------------------------------------------------- */

/* Sum over all light paths of the product of their two halves; most have only what is alone. */
static double sum_of_light_products(const ca_pair_sums *sums)
{
    const double alone0 = sums->alone_halves[0], alone1 = sums->alone_halves[1];
    double products = 0.0, halves[2] = {0.0, 0.0};
    for (uint32_t i = 0; i < sums->count; i++) {
        const pair_entry *entry = &sums->entries[i];
        products += entry->halves[0] * entry->halves[1];
        halves[0] += entry->halves[0];
        halves[1] += entry->halves[1];
    }
    return products + alone0 * halves[1] + alone1 * halves[0] + sums->light_paths * (alone0 * alone1);
}

ca_pair_moments ca_pair_sums_finish(ca_pair_sums *sums)
{
    assert(sums->camera_paths > 0);
    close_path(sums);
    const double light_paths = sums->light_paths, camera_paths = sums->camera_paths, pairs = light_paths * camera_paths;
    const uint32_t second = sums->camera_paths / 2, first = sums->camera_paths - second;
    return (ca_pair_moments){
        .value = sums->sum / pairs + sums->sum_alone / camera_paths,
        .pair = (sums->squares + 2.0 * sums->cross) / pairs + sums->squares_alone / camera_paths,
        .camera = sums->camera / camera_paths,
        .light = second > 0 ? sum_of_light_products(sums) / (light_paths * first * second) : (double)NAN,
    };
}
