/* A hundred thousand damaged scenes of pbrt through their reader and the importer: each either imports or fails with
 * a message, in time, without a crash and (under the address sanitizer) without a leak.
 *
 * The texts are those of tests/pbrt and tests/fuzz/pbrt, changed by flipped bytes, cut, repeated and swapped pieces,
 * odd numbers and words of the language. Mutation i depends on i alone: CAUSTICA_MUTATIONS is their number,
 * CAUSTICA_MUTATIONS_FIRST the first i, so that a failure can be found again. */
#define _POSIX_C_SOURCE 200809L
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/file.h"
#include "import/import.h"

#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const double longest_import_seconds = 5.0;
enum { MAX_TEXT = 1 << 16 };

/* ---- Numbers --------------------------------------------------------------------------------------------------- */

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t next(uint64_t *random)
{
    uint64_t z = *random += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static size_t below(uint64_t *random, size_t limit) { return limit ? (size_t)(next(random) % limit) : 0; }

/* ---- Mutations ------------------------------------------------------------------------------------------------- */

typedef struct text {
    char bytes[MAX_TEXT];
    size_t size;
} text;

static void replace(text *t, size_t at, size_t removed, const char *inserted, size_t count)
{
    if (t->size - removed + count > MAX_TEXT) return;
    memmove(t->bytes + at + count, t->bytes + at + removed, t->size - at - removed);
    memcpy(t->bytes + at, inserted, count);
    t->size += count - removed;
}

static void flip_byte(text *t, uint64_t *random)
{
    t->bytes[below(random, t->size)] ^= (char)(1u << below(random, 8));
}

static void cut(text *t, uint64_t *random)
{
    const size_t at = below(random, t->size), rest = t->size - at;
    replace(t, at, 1 + below(random, rest < 64 ? rest : 64), "", 0);
}

static void repeat_piece(text *t, uint64_t *random)
{
    char piece[256];
    const size_t at = below(random, t->size), rest = t->size - at;
    const size_t count = 1 + below(random, rest < sizeof piece ? rest : sizeof piece);
    memcpy(piece, t->bytes + at, count);
    replace(t, below(random, t->size), 0, piece, count);
}

static bool ends_word(char c) { return strchr(" \t\r\n\"[]", c) != NULL; }

/* The word, string or bracket around or after a random place: its start and length; false at the end of the text. */
static bool pick_word(const text *t, uint64_t *random, size_t *at, size_t *length)
{
    size_t from = below(random, t->size);
    while (from < t->size && strchr(" \t\r\n", t->bytes[from])) from++;
    if (from == t->size) return false;
    size_t end = from + 1;
    while (end < t->size && !ends_word(t->bytes[end])) end++;
    *at = from;
    *length = end - from;
    return true;
}

static void swap_words(text *t, uint64_t *random)
{
    size_t at, length, other, other_length;
    char word[256];
    if (!pick_word(t, random, &at, &length) || length > sizeof word) return;
    memcpy(word, t->bytes + at, length);
    if (pick_word(t, random, &other, &other_length)) replace(t, other, other_length, word, length);
}

/* A line to another place between lines. */
static void repeat_line(text *t, uint64_t *random)
{
    char line[512];
    const size_t from = below(random, t->size);
    const char *start = memchr(t->bytes + from, '\n', t->size - from);
    const char *end = start ? memchr(start + 1, '\n', t->size - (size_t)(start + 1 - t->bytes)) : NULL;
    if (!end || (size_t)(end - start) > sizeof line) return;
    const size_t length = (size_t)(end - start);
    memcpy(line, start, length);
    const size_t to = below(random, t->size);
    const char *place = memchr(t->bytes + to, '\n', t->size - to);
    if (place) replace(t, (size_t)(place - t->bytes), 0, line, length);
}

static void put_odd_word(text *t, uint64_t *random)
{
    static const char *const odd[] = {
        "0",
        "-1",
        "1e38",
        "1e-45",
        "1e999",
        "nan",
        "-0",
        "4294967296",
        "99999999999999999999",
        "[",
        "]",
        "\"",
        "\\",
        "#",
        "true",
        "[ ]",
        "[0 0 0]",
        "[1 2 3 4 5 6 7 8 9]",
        "\"\"",
        "\"/dev/zero\"",
        "\"..\"",
        "\"float alpha\"",
        "\"texture reflectance\"",
        "\"spectrum L\" [400 1 300 2]",
        "\"blackbody I\" 5000",
        "\"float power\" 10",
        "\"bool twosided\" true",
        "\"float phimax\" 90",
        "\"rgb L\" [1e30 0 0]",
        "\"integer levels\" 9",
        "\"integer indices\" [0 1 2]",
        "\"string filename\" \"picture.pfm\"",
    };
    size_t at, length;
    const char *word = odd[below(random, sizeof odd / sizeof *odd)];
    if (pick_word(t, random, &at, &length)) replace(t, at, length, word, strlen(word));
}

static void put_directive(text *t, uint64_t *random)
{
    static const char *const directives[] = {
        "\nAttributeBegin\n",
        "\nAttributeEnd\n",
        "\nTransformBegin\n",
        "\nTransformEnd\n",
        "\nWorldBegin\n",
        "\nWorldEnd\n",
        "\nObjectBegin \"o\"\n",
        "\nObjectEnd\n",
        "\nObjectInstance \"o\"\n",
        "\nReverseOrientation\n",
        "\nIdentity\n",
        "\nScale 0 1 1\n",
        "\nScale -1 1e20 1\n",
        "\nRotate 90 0 0 0\n",
        "\nInclude \"language.pbrt\"\n",
        "\nImport \"marbles-balls.pbrt\"\n",
        "\nMaterial \"mix\" \"string materials\" [\"a\" \"b\"]\n",
        "\nMaterial \"uber\"\n",
        "\nMaterial \"\"\n",
        "\nNamedMaterial \"glass\"\n",
        "\nShape \"sphere\"\n",
        "\nShape \"disk\" \"float innerradius\" 0.5\n",
        "\nShape \"loopsubdiv\"\n",
        "\nAreaLightSource \"diffuse\"\n",
        "\nLightSource \"infinite\"\n",
        "\nAttribute \"shape\" \"float alpha\" 0.5\n",
        "\nColorSpace \"rec2020\"\n",
        "\nActiveTransform EndTime\n",
        "\nMediumInterface \"\" \"\"\n",
    };
    const char *directive = directives[below(random, sizeof directives / sizeof *directives)];
    const size_t from = below(random, t->size);
    const char *line = memchr(t->bytes + from, '\n', t->size - from);
    replace(t, line ? (size_t)(line - t->bytes) : from, 0, directive, strlen(directive));
}

/* Most changes keep the words whole, so that they come further than to the scanner. */
static void mutate(text *t, uint64_t *random)
{
    static void (*const kinds[])(text *, uint64_t *) = {
        flip_byte,    cut,          repeat_piece, swap_words,    swap_words,  swap_words,
        put_odd_word, put_odd_word, put_odd_word, put_directive, repeat_line, repeat_line,
    };
    for (size_t count = 1 + below(random, 3); count > 0 && t->size > 0; count--)
        kinds[below(random, sizeof kinds / sizeof *kinds)](t, random);
}

/* ---- The run --------------------------------------------------------------------------------------------------- */

typedef struct original {
    char *path;
    ca_bytes bytes;
} original;

static size_t read_originals(original *originals, size_t capacity)
{
    glob_t found;
    assert_int_equal(glob(CA_SOURCE_DIR "/tests/fuzz/pbrt/*.pbrt", 0, NULL, &found), 0);
    (void)glob(CA_SOURCE_DIR "/tests/pbrt/marbles.pbrt", GLOB_APPEND, NULL, &found);
    size_t count = 0;
    for (size_t i = 0; i < found.gl_pathc && count < capacity; i++, count++) {
        ca_error error;
        originals[count].path = strdup(found.gl_pathv[i]);
        if (ca_file_read(found.gl_pathv[i], "scene", MAX_TEXT, &originals[count].bytes, &error) != CA_OK)
            fail_msg("%s", error.message);
    }
    globfree(&found);
    return count;
}

static long setting(const char *name, long fallback)
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

/* True where the damaged scene still was one. */
static bool import_mutation(const original *source, const text *t, long number)
{
    ca_scene_desc desc;
    ca_error error = {""};
    const double start = seconds();
    (void)alarm(60); /* ends the program where an import never does */
    const ca_status status = ca_import_scene_text(t->bytes, t->size, source->path, NULL, 0, &desc, &error);
    (void)alarm(0);
    if (status == CA_OK) ca_scene_desc_destroy(&desc);
    if (seconds() - start > longest_import_seconds) fail_msg("mutation %ld took %g s", number, seconds() - start);
    if (status != CA_OK && !error.message[0]) fail_msg("mutation %ld failed without a message", number);
    return status == CA_OK;
}

static void mutated_pbrt_scenes_are_harmless(void **state)
{
    (void)state;
    static original originals[64];
    static text t;
    const size_t count = read_originals(originals, sizeof originals / sizeof *originals);
    assert_true(count >= 2);
    const long first = setting("CAUSTICA_MUTATIONS_FIRST", 0), number = setting("CAUSTICA_MUTATIONS", 100000);
    long imported = 0;
    for (long i = first; i < first + number; i++) {
        uint64_t random = (uint64_t)i;
        const original *source = &originals[below(&random, count)];
        memcpy(t.bytes, source->bytes.data, source->bytes.size);
        t.size = source->bytes.size;
        mutate(&t, &random);
        imported += import_mutation(source, &t, i);
        if ((i + 1) % 10000 == 0) print_message("mutation %ld\n", i + 1);
    }
    print_message("%ld mutations of %zu scenes: %ld imported, the others failed with a message\n", number, count,
                  imported);
    for (size_t i = 0; i < count; i++) {
        ca_bytes_destroy(&originals[i].bytes);
        free(originals[i].path);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(mutated_pbrt_scenes_are_harmless)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
