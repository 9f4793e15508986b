/* A hundred thousand damaged scene files through the importer: each either imports or fails with a message, in time,
 * without a crash and (under the address sanitizer) without a leak.
 *
 * The texts are the bundled scenes and the seeds of the fuzzer, changed by flipped bytes, cut and repeated pieces and
 * elements, swapped attribute values, odd numbers and words of the language. Mutation i depends on i alone:
 * CAUSTICA_MUTATIONS is their number, CAUSTICA_MUTATIONS_FIRST the first i, so that a failure can be found again. */
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

/* A whole element without children, to another place between elements. */
static void repeat_element(text *t, uint64_t *random)
{
    char element[256];
    const size_t from = below(random, t->size);
    const char *open = memchr(t->bytes + from, '<', t->size - from);
    const char *close = open ? memchr(open, '>', t->size - (size_t)(open - t->bytes)) : NULL;
    if (!close || close[-1] != '/' || (size_t)(close - open) >= sizeof element) return;
    const size_t length = (size_t)(close - open) + 1;
    memcpy(element, open, length);
    const size_t to = below(random, t->size);
    const char *place = memchr(t->bytes + to, '<', t->size - to);
    if (place) replace(t, (size_t)(place - t->bytes), 0, element, length);
}

/* The attribute value around or after a random place: its start and length; false at the end of the text. */
static bool pick_value(const text *t, uint64_t *random, size_t *at, size_t *length)
{
    const size_t from = below(random, t->size);
    const char *open = memchr(t->bytes + from, '"', t->size - from);
    if (!open) return false;
    *at = (size_t)(open - t->bytes) + 1;
    const char *close = memchr(t->bytes + *at, '"', t->size - *at);
    if (!close) return false;
    *length = (size_t)(close - t->bytes) - *at;
    return true;
}

static void swap_values(text *t, uint64_t *random)
{
    size_t at, length, other, other_length;
    char value[256];
    if (!pick_value(t, random, &at, &length) || length > sizeof value) return;
    memcpy(value, t->bytes + at, length);
    if (pick_value(t, random, &other, &other_length)) replace(t, other, other_length, value, length);
}

static void put_odd_value(text *t, uint64_t *random)
{
    static const char *const odd[] = {
        "",
        "0",
        "-1",
        "1e38",
        "1e-45",
        "1e999",
        "nan",
        "-0",
        "4294967296",
        "99999999999999999999",
        "0.5 0.5",
        "1 2 3 4 5 6 7 8 9",
        "400:1 500:2",
        "#ffffff",
        "#",
        "$",
        "$spp",
        "\\$",
        "true",
        "obj",
        "/dev/zero",
        "..",
        "twosided",
        "mask",
        "bitmap",
        "scene.xml",
        "&amp;",
        "&#0;",
        "to_world",
        "radius",
    };
    size_t at, length;
    const char *value = odd[below(random, sizeof odd / sizeof *odd)];
    if (pick_value(t, random, &at, &length)) replace(t, at, length, value, strlen(value));
}

static void put_element(text *t, uint64_t *random)
{
    static const char *const elements[] = {
        "<ref id=\"blend\"/>",
        "<bsdf type=\"twosided\">",
        "</bsdf>",
        "<shape type=\"cube\">",
        "</shape>",
        "<emitter type=\"area\"/>",
        "<texture type=\"checkerboard\"/>",
        "<transform name=\"to_world\">",
        "</transform>",
        "<float name=\"alpha\" value=\"0.1\"/>",
        "<default name=\"a\" value=\"$a$a\"/>",
        "<!--",
        "-->",
        "<![CDATA[",
        "]]>",
        "<include filename=\"language.xml\"/>",
        "<scale value=\"0\"/>",
        "<rotate angle=\"90\"/>",
        "<alias id=\"glass\" as=\"glass\"/>",
        "<path value=\"/\"/>",
        "<!DOCTYPE a>",
        "<?b ?>",
    };
    const char *element = elements[below(random, sizeof elements / sizeof *elements)];
    /* At the start of an element, mostly. */
    const size_t from = below(random, t->size);
    const char *open = memchr(t->bytes + from, '<', t->size - from);
    replace(t, open ? (size_t)(open - t->bytes) : from, 0, element, strlen(element));
}

/* Most changes keep the XML well-formed, so that they come further than to its parser. */
static void mutate(text *t, uint64_t *random)
{
    static void (*const kinds[])(text *, uint64_t *) = {
        flip_byte,     cut,           repeat_piece,  swap_values, swap_values,    swap_values,
        put_odd_value, put_odd_value, put_odd_value, put_element, repeat_element, repeat_element,
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
    assert_int_equal(glob(CA_SOURCE_DIR "/tests/fuzz/scene/*.xml", 0, NULL, &found), 0);
    (void)glob(CA_SOURCE_DIR "/scenes/*/*.xml", GLOB_APPEND, NULL, &found);
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

static void mutated_scenes_are_harmless(void **state)
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(mutated_scenes_are_harmless)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
