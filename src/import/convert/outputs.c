#include "import/convert/outputs.h"

#include "base/file.h"
#include "base/hash.h"

#include <stdio.h>
#include <string.h>

enum { MAX_STEM = 100 };

/* A key or a lower case name: what it leads to. */
struct ca_output_slot {
    const char *text; /* NULL: free */
    uint64_t hash;
    size_t value; /* of a key the index of its file; of a name the last number that was put behind it */
};

void ca_outputs_destroy(ca_outputs *outputs)
{
    ca_arena_clear(&outputs->arena);
    ca_free(outputs->files.items);
    ca_free(outputs->slots);
    *outputs = (ca_outputs){0};
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

/* Where the text is, or would be; there is always a free slot. */
static struct ca_output_slot *find_slot(const ca_outputs *outputs, const char *text, uint64_t hash)
{
    size_t i = (size_t)hash & (outputs->slot_capacity - 1);
    while (outputs->slots[i].text && strcmp(outputs->slots[i].text, text) != 0)
        i = (i + 1) & (outputs->slot_capacity - 1);
    return &outputs->slots[i];
}

static bool grow(ca_outputs *outputs)
{
    const size_t capacity = outputs->slot_capacity ? 2 * outputs->slot_capacity : 64;
    struct ca_output_slot *old = outputs->slots;
    const size_t old_capacity = outputs->slot_capacity;
    struct ca_output_slot *slots = ca_alloc_zeroed(capacity, sizeof *slots);
    if (!slots) return false;
    outputs->slots = slots;
    outputs->slot_capacity = capacity;
    for (size_t i = 0; i < old_capacity; i++)
        if (old[i].text) *find_slot(outputs, old[i].text, old[i].hash) = old[i];
    ca_free(old);
    return true;
}

/* The slot of the text, whose `text` is NULL where it is new; NULL when out of memory. */
static struct ca_output_slot *slot_of(ca_outputs *outputs, const char *text)
{
    if (2 * (outputs->slot_count + 1) > outputs->slot_capacity && !grow(outputs)) return NULL;
    const uint64_t hash = ca_hash_bytes(CA_HASH_START, text, strlen(text));
    struct ca_output_slot *slot = find_slot(outputs, text, hash);
    slot->hash = hash;
    return slot;
}

static bool take_slot(ca_outputs *outputs, struct ca_output_slot *slot, const char *text, size_t value)
{
    const char *kept = ca_arena_strdup(&outputs->arena, text);
    if (!kept) return false;
    slot->text = kept;
    slot->value = value;
    outputs->slot_count++;
    return true;
}

/* ---- Names ----------------------------------------------------------------------------------------------------- */

static bool is_plain(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.';
}

const char *ca_outputs_stem(ca_outputs *outputs, const char *path)
{
    const char *slash = strrchr(path, '/'), *begin = slash ? slash + 1 : path;
    size_t length = strlen(begin) - strlen(ca_path_extension(begin));
    if (length > MAX_STEM) length = MAX_STEM;
    char *stem = ca_arena_alloc(&outputs->arena, length + 2, 1);
    if (!stem) return NULL;
    for (size_t i = 0; i < length; i++) stem[i] = is_plain(begin[i]) && (i > 0 || begin[i] != '.') ? begin[i] : '_';
    if (length == 0) stem[0] = '_';
    return stem;
}

/* A mark that no key has, then the name in lower case. */
static void name_text(char *text, size_t size, const char *name)
{
    snprintf(text, size, "\n%s", name);
    for (char *c = text; *c; c++)
        if (*c >= 'A' && *c <= 'Z') *c = (char)(*c + 32);
}

/* A name that is free, and now taken; NULL when out of memory. */
static const char *take_name(ca_outputs *outputs, const char *stem, const char *extension)
{
    char name[MAX_STEM + 64], text[MAX_STEM + 80];
    snprintf(name, sizeof name, "%.*s%.20s", MAX_STEM + 1, stem, extension);
    name_text(text, sizeof text, name);
    struct ca_output_slot *slot = slot_of(outputs, text);
    if (!slot) return NULL;
    if (slot->text) {
        size_t number = slot->value;
        const size_t plain = (size_t)(slot - outputs->slots);
        do {
            snprintf(name, sizeof name, "%.*s-%zu%.20s", MAX_STEM + 1, stem, ++number, extension);
            outputs->slots[plain].value = number;
            name_text(text, sizeof text, name);
            slot = find_slot(outputs, text, ca_hash_bytes(CA_HASH_START, text, strlen(text)));
        } while (slot->text);
        slot->hash = ca_hash_bytes(CA_HASH_START, text, strlen(text));
    }
    return take_slot(outputs, slot, text, 1) ? ca_arena_strdup(&outputs->arena, name) : NULL;
}

const char *ca_outputs_add(ca_outputs *outputs, const char *key, const char *stem, const char *extension,
                           ca_output output)
{
    struct ca_output_slot *slot = slot_of(outputs, key);
    if (!slot) return NULL;
    if (slot->text) return outputs->files.items[slot->value].name;
    if (!take_slot(outputs, slot, key, outputs->files.count)) return NULL;
    output.name = take_name(outputs, stem, extension);
    if (!output.name || !CA_TABLE_ADD(&outputs->files)) return NULL;
    outputs->files.items[outputs->files.count - 1] = output;
    return output.name;
}
