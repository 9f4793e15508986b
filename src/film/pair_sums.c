#include "film/pair_sums.h"

#include "base/memory.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    FIRST_BITS = 7,       /* of the table */
    WAITING = 64,         /* additions */
    LAST_STAMP = 1 << 22, /* the table is cleared for the next pixel where stamps have come so far */
};

/* A light path that merged with the pixel's camera paths. C here is what the two have merged: what camera paths find
 * alone is the same for all light paths, and added where the sums are used. A slot is free where the stamp is older
 * than the pixel, so that a new pixel has nothing to clear. */
typedef struct pair_entry {
    uint32_t light_path;
    uint32_t stamp;   /* of the last camera path it merged with, or of the light paths' turn */
    double pair;      /* C with that; in the light paths' turn what this one has alone */
    double halves[2]; /* sums of C over the camera paths of each half */
} pair_entry;

_Static_assert(sizeof(pair_entry) == 32, "pair_sums.h promises at most 4 of 32 bytes for each, and the spare ones");

/* A camera path that brought light by connections. */
typedef struct connection {
    uint32_t light_path;
    double luminance;    /* D */
    double pair, merged; /* what it merged with this light path, and with all */
    double alone;
} connection;

typedef struct addition {
    uint32_t light_path;
    double luminance;
} addition;

struct ca_pair_sums {
    pair_entry
        *slots; /* owned; 2^most_bits of them and 1/4 as many spare ones for growing; open addressing in 2^bits */
    uint32_t bits, most_bits;
    uint32_t count; /* of light paths in the table */
    uint32_t stamp, first_stamp; /* the current one, and the pixel's first */
    bool failed;
    connection *connections; /* owned */
    size_t connection_capacity;

    uint32_t light_paths, camera_paths; /* N_F; how many camera paths have begun */
    bool path_open;                     /* one is current */
    uint32_t connection_count;
    /* Of the current camera path. */
    uint32_t waiting_count;
    addition waiting[WAITING]; /* not yet in the table */
    double alone;
    double merged[2]; /* sums over the light paths of each half */
    connection connected;
    /* Of the pixel. Over all pairs: */
    double squares;         /* of what merged */
    double cross;           /* of what merged times what is alone */
    double merged_light[2]; /* what merged, over the light paths of each half */
    double merged_camera[2]; /* the same over the camera paths of each half */
    /* Over camera paths: */
    double sum_alone, squares_alone;
    double alone_halves[2]; /* over those of each half */
    double camera;          /* of the products of the light paths' halves' means */
    /* Over light paths: */
    double light;           /* of the products of the camera paths' halves' sums */
    double light_alone[2];  /* over those of each half */
    double light_squares;   /* of what they have alone */
    double light_cross[2];  /* of that times what merged with the camera paths of each half */
};

/* ---- The table ------------------------------------------------------------------------------------------------- */

static inline size_t slot_count(uint32_t bits) { return (size_t)1 << bits; }
static inline size_t spare_count(uint32_t most_bits) { return slot_count(most_bits) / 4; }

/* Numbers of light paths come in no order, but all from 0 on: the golden ratio spreads them. */
static inline size_t first_slot(uint32_t light_path, uint32_t bits)
{
    return (size_t)((light_path * UINT64_C(0x9e3779b97f4a7c15)) >> (64 - bits));
}

static inline bool is_used(const ca_pair_sums *sums, const pair_entry *slot)
{
    return slot->stamp >= sums->first_stamp;
}

/* The slot that holds the light path, or the free one where it belongs. Half of all are free. */
static inline pair_entry *find_slot(const ca_pair_sums *sums, uint32_t light_path)
{
    const size_t mask = slot_count(sums->bits) - 1;
    size_t at = first_slot(light_path, sums->bits);
    while (is_used(sums, &sums->slots[at]) && sums->slots[at].light_path != light_path) at = (at + 1) & mask;
    return &sums->slots[at];
}

static pair_entry *make_slots(uint32_t bits)
{
    pair_entry *slots = ca_alloc_large(slot_count(bits) + spare_count(bits), sizeof *slots);
    if (slots) memset(slots, 0, slot_count(bits) * sizeof *slots);
    return slots;
}

/* The used ones of the first 2^bits slots. */
static void gather_used(const ca_pair_sums *sums, pair_entry *used)
{
    for (size_t at = 0; at < slot_count(sums->bits); at++)
        if (is_used(sums, &sums->slots[at])) *used++ = sums->slots[at];
}

/* Twice as many slots. On failure the table stays as it was. */
static bool grow(ca_pair_sums *sums)
{
    const uint32_t bits = sums->bits + 1, most_bits = bits > sums->most_bits ? bits : sums->most_bits;
    pair_entry *slots = bits > sums->most_bits ? make_slots(bits) : sums->slots, *spare = NULL;
    if (!slots) return false;
    spare = slots + slot_count(most_bits); /* as many as half of the old slots, at least */
    gather_used(sums, spare);
    if (slots == sums->slots)
        memset(slots, 0, slot_count(bits) * sizeof *slots);
    else
        ca_free(sums->slots);
    sums->slots = slots;
    sums->bits = bits;
    sums->most_bits = most_bits;
    for (uint32_t i = 0; i < sums->count; i++) *find_slot(sums, spare[i].light_path) = spare[i];
    return true;
}

/* The light path's entry, with the current stamp; NULL when out of memory. */
static inline pair_entry *find_entry(ca_pair_sums *sums, uint32_t light_path)
{
    pair_entry *entry = find_slot(sums, light_path);
    if (entry->stamp == sums->stamp) return entry;
    if (is_used(sums, entry)) {
        entry->stamp = sums->stamp;
        entry->pair = 0.0;
        return entry;
    }
    if (sums->count == slot_count(sums->bits) / 2) {
        if (!grow(sums)) return NULL;
        entry = find_slot(sums, light_path);
    }
    sums->count++;
    *entry = (pair_entry){.light_path = light_path, .stamp = sums->stamp};
    return entry;
}

ca_status ca_pair_sums_create(ca_pair_sums **sums, ca_error *error)
{
    *sums = ca_alloc_zeroed(1, sizeof **sums);
    if (*sums) (*sums)->slots = make_slots(FIRST_BITS);
    if (*sums && (*sums)->slots) {
        (*sums)->bits = (*sums)->most_bits = FIRST_BITS;
        return CA_OK;
    }
    ca_free(*sums);
    *sums = NULL;
    return ca_fail_memory(error, "the pairs of light and camera paths");
}

void ca_pair_sums_destroy(ca_pair_sums *sums)
{
    if (!sums) return;
    ca_free(sums->slots);
    ca_free(sums->connections);
    ca_free(sums);
}

bool ca_pair_sums_complete(const ca_pair_sums *sums) { return !sums->failed; }

/* ---- Camera paths ---------------------------------------------------------------------------------------------- */

/* Neighbours are alike: room for a few light paths more than the last pixel had, close together. */
static uint32_t bits_for(uint32_t count, uint32_t most_bits)
{
    uint32_t bits = FIRST_BITS;
    while (bits < most_bits && slot_count(bits) / 2 < count + count / 4) bits++;
    return bits;
}

void ca_pair_sums_begin(ca_pair_sums *sums, uint32_t light_paths)
{
    assert(light_paths >= 2);
    const bool clear = sums->stamp >= LAST_STAMP;
    const uint32_t stamp = clear ? 1 : sums->stamp + 1; /* 0: never used */
    if (clear) memset(sums->slots, 0, slot_count(sums->most_bits) * sizeof *sums->slots);
    *sums = (ca_pair_sums){.slots = sums->slots,
                           .bits = bits_for(sums->count, sums->most_bits),
                           .most_bits = sums->most_bits,
                           .stamp = stamp,
                           .first_stamp = stamp,
                           .failed = sums->failed,
                           .connections = sums->connections,
                           .connection_capacity = sums->connection_capacity,
                           .light_paths = light_paths};
}

/* The half of the current camera path; counting begins with 0, their numbers with 1. */
static inline uint32_t camera_half(const ca_pair_sums *sums) { return (sums->camera_paths - 1) & 1; }

/* Puts into the table what waits. A pair's square grows by l (2 C + l) where C grows by l, and a light path's product
 * of halves by l times the other half. */
static void add_waiting(ca_pair_sums *sums)
{
    const uint32_t half = camera_half(sums);
    double squares = sums->squares, products = sums->light, merged[2] = {sums->merged[0], sums->merged[1]};
    for (uint32_t i = 0; i < sums->waiting_count; i++) {
        const addition *a = &sums->waiting[i];
        pair_entry *entry = find_entry(sums, a->light_path);
        if (!entry) {
            sums->failed = true;
            break;
        }
        squares += a->luminance * (2.0 * entry->pair + a->luminance);
        entry->pair += a->luminance;
        products += a->luminance * entry->halves[1 - half];
        entry->halves[half] += a->luminance;
        merged[a->light_path & 1] += a->luminance;
    }
    sums->squares = squares;
    sums->light = products;
    sums->merged[0] = merged[0];
    sums->merged[1] = merged[1];
    sums->waiting_count = 0;
}

/* What the current camera path has merged with a light path. */
static double current_pair(const ca_pair_sums *sums, uint32_t light_path)
{
    const pair_entry *entry = find_slot(sums, light_path);
    return entry->stamp == sums->stamp ? entry->pair : 0.0;
}

static void keep_connection(ca_pair_sums *sums, double merged)
{
    const connection found = sums->connected;
    sums->connected = (connection){0};
    if (found.luminance == 0.0) return;
    connection *connections = ca_array_grow(sums->connections, &sums->connection_capacity, sums->connection_count + 1,
                                            sizeof *connections);
    if (!connections) {
        sums->failed = true;
        return;
    }
    sums->connections = connections;
    connection *c = &sums->connections[sums->connection_count++];
    *c = found;
    c->pair = current_pair(sums, c->light_path);
    c->merged = merged;
    c->alone = sums->alone;
}

/* How many light paths the halves have. */
static inline double first_half(const ca_pair_sums *sums) { return sums->light_paths - sums->light_paths / 2; }
static inline double second_half(const ca_pair_sums *sums) { return sums->light_paths / 2; }

/* The current camera path is complete. */
static void close_path(ca_pair_sums *sums)
{
    if (!sums->path_open) return;
    add_waiting(sums);
    const double merged = sums->merged[0] + sums->merged[1], alone = sums->alone;
    keep_connection(sums, merged);
    sums->merged_light[0] += sums->merged[0];
    sums->merged_light[1] += sums->merged[1];
    sums->merged_camera[camera_half(sums)] += merged;
    sums->sum_alone += alone;
    sums->squares_alone += alone * alone;
    sums->cross += alone * merged;
    sums->alone_halves[camera_half(sums)] += alone;
    sums->camera += (sums->merged[0] / first_half(sums) + alone) * (sums->merged[1] / second_half(sums) + alone);
    sums->alone = sums->merged[0] = sums->merged[1] = 0.0;
    sums->path_open = false;
    sums->stamp++;
}

void ca_pair_sums_next_path(ca_pair_sums *sums)
{
    close_path(sums);
    assert(sums->light_squares == 0.0); /* no light path had its turn */
    sums->path_open = true;
    sums->camera_paths++;
}

void ca_pair_sums_add(ca_pair_sums *sums, uint32_t light_path, double luminance)
{
    assert(sums->path_open && light_path < sums->light_paths);
    if (sums->waiting_count == WAITING) add_waiting(sums);
    __builtin_prefetch(&sums->slots[first_slot(light_path, sums->bits)], 1);
    sums->waiting[sums->waiting_count++] = (addition){light_path, luminance};
}

void ca_pair_sums_add_alone(ca_pair_sums *sums, double luminance)
{
    assert(sums->path_open);
    sums->alone += luminance;
}

void ca_pair_sums_connect(ca_pair_sums *sums, uint32_t light_path, double luminance)
{
    assert(sums->path_open && light_path < sums->light_paths);
    assert(sums->connected.luminance == 0.0 || sums->connected.light_path == light_path);
    sums->connected.light_path = light_path;
    sums->connected.luminance += luminance;
}

/* ---- Light paths ----------------------------------------------------------------------------------------------- */

void ca_pair_sums_add_light_alone(ca_pair_sums *sums, uint32_t light_path, double luminance)
{
    assert(light_path < sums->light_paths);
    close_path(sums);
    pair_entry *entry = find_entry(sums, light_path);
    if (!entry) {
        sums->failed = true;
        return;
    }
    sums->light_squares += luminance * (2.0 * entry->pair + luminance);
    entry->pair += luminance;
    for (int half = 0; half < 2; half++) sums->light_cross[half] += luminance * entry->halves[half];
    sums->light_alone[light_path & 1] += luminance;
}

/* ---- The estimators -------------------------------------------------------------------------------------------- */

/* Sums over all pairs, camera paths or light paths are expanded into sums over what is not zero. E: what light paths
 * have alone. */
static double sum_of_squares(const ca_pair_sums *s)
{
    const double own = s->light_alone[0] + s->light_alone[1], cross = s->light_cross[0] + s->light_cross[1];
    return s->squares + 2.0 * (s->cross + cross + s->sum_alone * own) + s->light_paths * s->squares_alone +
           s->camera_paths * s->light_squares;
}

/* Over camera paths, of the products of their two halves' means. */
static double sum_of_camera_products(const ca_pair_sums *s)
{
    const double own0 = s->light_alone[0] / first_half(s), own1 = s->light_alone[1] / second_half(s);
    const double mean0 = s->merged_light[0] / first_half(s) + s->sum_alone;
    const double mean1 = s->merged_light[1] / second_half(s) + s->sum_alone;
    return s->camera + own0 * mean1 + own1 * mean0 + s->camera_paths * (own0 * own1);
}

/* Over light paths, of the products of their two halves' sums; these have `first` and `second` camera paths. */
static double sum_of_light_products(const ca_pair_sums *s, double first, double second)
{
    const double alone0 = s->alone_halves[0], alone1 = s->alone_halves[1],
                 own = s->light_alone[0] + s->light_alone[1];
    return s->light + alone0 * s->merged_camera[1] + alone1 * s->merged_camera[0] +
           s->light_paths * (alone0 * alone1) + second * s->light_cross[0] + first * s->light_cross[1] +
           (alone0 * second + alone1 * first) * own + first * second * s->light_squares;
}

/* What a connected pair has in common with the other pairs of its camera path and of its light path. */
static void add_connection(const ca_pair_sums *s, const connection *c, ca_pair_moments *m)
{
    const pair_entry *entry = find_slot(s, c->light_path);
    const bool met = is_used(s, entry);
    const double own = met && entry->stamp == s->stamp ? entry->pair : 0.0;
    const double pair = c->pair + c->alone + own;
    const double of_camera = c->merged + s->light_paths * c->alone + s->light_alone[0] + s->light_alone[1];
    const double of_light = (met ? entry->halves[0] + entry->halves[1] : 0.0) + s->sum_alone + s->camera_paths * own;
    const double scale = c->luminance / s->camera_paths;
    m->connected += scale;
    m->connected_square += scale * c->luminance;
    m->connected_pair += scale * pair;
    m->connected_camera += scale * (of_camera - pair) / (s->light_paths - 1.0);
    m->connected_light += s->camera_paths > 1 ? scale * (of_light - pair) / (s->camera_paths - 1.0) : (double)NAN;
}

ca_pair_moments ca_pair_sums_finish(ca_pair_sums *sums)
{
    assert(sums->camera_paths > 0);
    close_path(sums);
    const double light_paths = sums->light_paths, camera_paths = sums->camera_paths,
                 pairs = light_paths * camera_paths;
    const double merged = sums->merged_light[0] + sums->merged_light[1],
                 own = sums->light_alone[0] + sums->light_alone[1];
    const uint32_t second = sums->camera_paths / 2, first = sums->camera_paths - second;
    ca_pair_moments m = {
        .value = merged / pairs + sums->sum_alone / camera_paths + own / light_paths,
        .pair = sum_of_squares(sums) / pairs,
        .camera = sum_of_camera_products(sums) / camera_paths,
        .light =
            second > 0 ? sum_of_light_products(sums, first, second) / (light_paths * first * second) : (double)NAN,
    };
    for (uint32_t i = 0; i < sums->connection_count; i++) add_connection(sums, &sums->connections[i], &m);
    m.value += m.connected;
    return m;
}
