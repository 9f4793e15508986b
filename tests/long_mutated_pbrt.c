/* A hundred thousand damaged scenes of pbrt through their reader and the importer: each either imports or fails with
 * a message, in time, without a crash and (under the address sanitizer) without a leak.
 *
 * The texts are those of tests/pbrt and tests/fuzz/pbrt, changed by flipped bytes, cut, repeated and swapped pieces,
 * odd numbers and words of the language. Mutation i depends on i alone: CAUSTICA_MUTATIONS is their number,
 * CAUSTICA_MUTATIONS_FIRST the first i, so that a failure can be found again. */
#include "support/mutated_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static bool ends_word(char c) { return strchr(" \t\r\n\"[]", c) != NULL; }

/* The word, string or bracket around or after a random place: its start and length; false at the end of the text. */
static bool pick_word(const mutated_text *t, uint64_t *random, size_t *at, size_t *length)
{
    size_t from = mutation_below(random, t->size);
    while (from < t->size && strchr(" \t\r\n", t->bytes[from])) from++;
    if (from == t->size) return false;
    size_t end = from + 1;
    while (end < t->size && !ends_word(t->bytes[end])) end++;
    *at = from;
    *length = end - from;
    return true;
}

static void swap_words(mutated_text *t, uint64_t *random)
{
    size_t at, length, other, other_length;
    char word[256];
    if (!pick_word(t, random, &at, &length) || length > sizeof word) return;
    memcpy(word, t->bytes + at, length);
    if (pick_word(t, random, &other, &other_length)) mutated_replace(t, other, other_length, word, length);
}

/* A line to another place between lines. */
static void repeat_line(mutated_text *t, uint64_t *random)
{
    char line[512];
    const size_t from = mutation_below(random, t->size);
    const char *start = memchr(t->bytes + from, '\n', t->size - from);
    const char *end = start ? memchr(start + 1, '\n', t->size - (size_t)(start + 1 - t->bytes)) : NULL;
    if (!end || (size_t)(end - start) > sizeof line) return;
    const size_t length = (size_t)(end - start);
    memcpy(line, start, length);
    const size_t to = mutation_below(random, t->size);
    const char *place = memchr(t->bytes + to, '\n', t->size - to);
    if (place) mutated_replace(t, (size_t)(place - t->bytes), 0, line, length);
}

static void put_odd_word(mutated_text *t, uint64_t *random)
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
    const char *word = odd[mutation_below(random, sizeof odd / sizeof *odd)];
    if (pick_word(t, random, &at, &length)) mutated_replace(t, at, length, word, strlen(word));
}

static void put_directive(mutated_text *t, uint64_t *random)
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
    const char *directive = directives[mutation_below(random, sizeof directives / sizeof *directives)];
    const size_t from = mutation_below(random, t->size);
    const char *line = memchr(t->bytes + from, '\n', t->size - from);
    mutated_replace(t, line ? (size_t)(line - t->bytes) : from, 0, directive, strlen(directive));
}

/* Most changes keep the words whole, so that they come further than to the scanner. */
static const mutation kinds[] = {
    mutation_flip_byte, mutation_cut, mutation_repeat_piece, swap_words, swap_words, swap_words, put_odd_word,
    put_odd_word, put_odd_word, put_directive, repeat_line, repeat_line,
};

static void mutated_pbrt_scenes_are_harmless(void **state)
{
    (void)state;
    static const char *const patterns[2] = {"tests/fuzz/pbrt/*.pbrt", "tests/pbrt/marbles.pbrt"};
    mutated_scenes_run(patterns, kinds, sizeof kinds / sizeof *kinds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(mutated_pbrt_scenes_are_harmless)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
