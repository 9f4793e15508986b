/* A hundred thousand damaged scene files through the importer: each either imports or fails with a message, in time,
 * without a crash and (under the address sanitizer) without a leak.
 *
 * The texts are the bundled scenes and the seeds of the fuzzer, changed by flipped bytes, cut and repeated pieces and
 * elements, swapped attribute values, odd numbers and words of the language. Mutation i depends on i alone:
 * CAUSTICA_MUTATIONS is their number, CAUSTICA_MUTATIONS_FIRST the first i, so that a failure can be found again. */
#include "support/mutated_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* A whole element without children, to another place between elements. */
static void repeat_element(mutated_text *t, uint64_t *random)
{
    char element[256];
    const size_t from = mutation_below(random, t->size);
    const char *open = memchr(t->bytes + from, '<', t->size - from);
    const char *close = open ? memchr(open, '>', t->size - (size_t)(open - t->bytes)) : NULL;
    if (!close || close[-1] != '/' || (size_t)(close - open) >= sizeof element) return;
    const size_t length = (size_t)(close - open) + 1;
    memcpy(element, open, length);
    const size_t to = mutation_below(random, t->size);
    const char *place = memchr(t->bytes + to, '<', t->size - to);
    if (place) mutated_replace(t, (size_t)(place - t->bytes), 0, element, length);
}

/* The attribute value around or after a random place: its start and length; false at the end of the text. */
static bool pick_value(const mutated_text *t, uint64_t *random, size_t *at, size_t *length)
{
    const size_t from = mutation_below(random, t->size);
    const char *open = memchr(t->bytes + from, '"', t->size - from);
    if (!open) return false;
    *at = (size_t)(open - t->bytes) + 1;
    const char *close = memchr(t->bytes + *at, '"', t->size - *at);
    if (!close) return false;
    *length = (size_t)(close - t->bytes) - *at;
    return true;
}

static void swap_values(mutated_text *t, uint64_t *random)
{
    size_t at, length, other, other_length;
    char value[256];
    if (!pick_value(t, random, &at, &length) || length > sizeof value) return;
    memcpy(value, t->bytes + at, length);
    if (pick_value(t, random, &other, &other_length)) mutated_replace(t, other, other_length, value, length);
}

static void put_odd_value(mutated_text *t, uint64_t *random)
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
    const char *value = odd[mutation_below(random, sizeof odd / sizeof *odd)];
    if (pick_value(t, random, &at, &length)) mutated_replace(t, at, length, value, strlen(value));
}

static void put_element(mutated_text *t, uint64_t *random)
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
    const char *element = elements[mutation_below(random, sizeof elements / sizeof *elements)];
    /* At the start of an element, mostly. */
    const size_t from = mutation_below(random, t->size);
    const char *open = memchr(t->bytes + from, '<', t->size - from);
    mutated_replace(t, open ? (size_t)(open - t->bytes) : from, 0, element, strlen(element));
}

/* Most changes keep the XML well-formed, so that they come further than to its parser. */
static const mutation kinds[] = {
    mutation_flip_byte, mutation_cut, mutation_repeat_piece, swap_values, swap_values, swap_values,
    put_odd_value, put_odd_value, put_odd_value, put_element, repeat_element, repeat_element,
};

static void mutated_scenes_are_harmless(void **state)
{
    (void)state;
    static const char *const patterns[2] = {"tests/fuzz/scene/*.xml", "scenes/*/*.xml"};
    mutated_scenes_run(patterns, kinds, sizeof kinds / sizeof *kinds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(mutated_scenes_are_harmless)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
