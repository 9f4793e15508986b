#define _POSIX_C_SOURCE 200809L
#include "support/mutated_text.h"

#include "base/file.h"

#include <glob.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static const double longest_import_seconds = 5.0;

/* ---- Texts ----------------------------------------------------------------------------------------------------- */

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t next(uint64_t *random)
{
    uint64_t z = *random += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

size_t mutation_below(uint64_t *random, size_t limit) { return limit ? (size_t)(next(random) % limit) : 0; }

void mutated_replace(mutated_text *t, size_t at, size_t removed, const char *inserted, size_t count)
{
    if (t->size - removed + count > MUTATED_TEXT_MAX) return;
    memmove(t->bytes + at + count, t->bytes + at + removed, t->size - at - removed);
    memcpy(t->bytes + at, inserted, count);
    t->size += count - removed;
}

void mutation_flip_byte(mutated_text *t, uint64_t *random)
{
    t->bytes[mutation_below(random, t->size)] ^= (char)(1u << mutation_below(random, 8));
}

void mutation_cut(mutated_text *t, uint64_t *random)
{
    const size_t at = mutation_below(random, t->size), rest = t->size - at;
    mutated_replace(t, at, 1 + mutation_below(random, rest < 64 ? rest : 64), "", 0);
}

void mutation_repeat_piece(mutated_text *t, uint64_t *random)
{
    char piece[256];
    const size_t at = mutation_below(random, t->size), rest = t->size - at;
    const size_t count = 1 + mutation_below(random, rest < sizeof piece ? rest : sizeof piece);
    memcpy(piece, t->bytes + at, count);
    mutated_replace(t, mutation_below(random, t->size), 0, piece, count);
}

void mutate(mutated_text *t, uint64_t *random, const mutation *kinds, size_t kind_count)
{
    for (size_t count = 1 + mutation_below(random, 3); count > 0 && t->size > 0; count--)
        kinds[mutation_below(random, kind_count)](t, random);
}

/* ---- Imports --------------------------------------------------------------------------------------------------- */

long mutation_setting(const char *name, long fallback)
{
    const char *value = getenv(name);
    return value ? atol(value) : fallback;
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool mutation_imports(const ca_scene_source *source, long number)
{
    ca_scene_desc desc;
    ca_error error = {""};
    const double start = seconds();
    (void)alarm(60); /* ends the program where an import never does */
    const ca_status status = ca_import_scene_source(source, &desc, &error);
    (void)alarm(0);
    if (status == CA_OK) ca_scene_desc_destroy(&desc);
    if (seconds() - start > longest_import_seconds) fail_msg("mutation %ld took %g s", number, seconds() - start);
    if (status != CA_OK && !error.message[0]) fail_msg("mutation %ld failed without a message", number);
    return status == CA_OK;
}

/* ---- The run --------------------------------------------------------------------------------------------------- */

typedef struct original {
    char *path;
    ca_bytes bytes;
} original;

static size_t read_originals(const char *const patterns[2], original *originals, size_t capacity)
{
    glob_t found;
    char pattern[512];
    for (int i = 0; i < 2; i++) {
        snprintf(pattern, sizeof pattern, "%s/%s", CA_SOURCE_DIR, patterns[i]);
        assert_int_equal(glob(pattern, i ? GLOB_APPEND : 0, NULL, &found), 0);
    }
    size_t count = 0;
    for (size_t i = 0; i < found.gl_pathc && count < capacity; i++, count++) {
        ca_error error;
        originals[count].path = strdup(found.gl_pathv[i]);
        if (ca_file_read(found.gl_pathv[i], "scene", MUTATED_TEXT_MAX, &originals[count].bytes, &error) != CA_OK)
            fail_msg("%s", error.message);
    }
    globfree(&found);
    return count;
}

void mutated_scenes_run(const char *const patterns[2], const mutation *kinds, size_t kind_count)
{
    static original originals[64];
    static mutated_text t;
    const size_t count = read_originals(patterns, originals, sizeof originals / sizeof *originals);
    assert_true(count >= 2);
    const long first = mutation_setting("CAUSTICA_MUTATIONS_FIRST", 0);
    const long number = mutation_setting("CAUSTICA_MUTATIONS", 100000);
    long imported = 0;
    for (long i = first; i < first + number; i++) {
        uint64_t random = (uint64_t)i;
        const original *source = &originals[mutation_below(&random, count)];
        memcpy(t.bytes, source->bytes.data, source->bytes.size);
        t.size = source->bytes.size;
        mutate(&t, &random, kinds, kind_count);
        imported += mutation_imports(&(ca_scene_source){.text = t.bytes, .size = t.size, .path = source->path}, i);
        if ((i + 1) % 10000 == 0) print_message("mutation %ld\n", i + 1);
    }
    print_message("%ld mutations of %zu scenes: %ld imported, the others failed with a message\n", number, count,
                  imported);
    for (size_t i = 0; i < count; i++) {
        ca_bytes_destroy(&originals[i].bytes);
        free(originals[i].path);
    }
}
