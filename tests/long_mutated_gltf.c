/* Damaged glTF scenes through the importer, as .gltf and as .glb: each either imports or fails with a message that
 * names the file, in time, without a crash and (under the address sanitizer) without a leak.
 *
 * The texts are scenes with what the reader knows, changed by flipped bytes, cut and repeated pieces, odd numbers and
 * keys put in other places; the buffer's bytes are damaged too. Mutation i depends on i alone: CAUSTICA_MUTATIONS is
 * their number, CAUSTICA_MUTATIONS_FIRST the first i, so that a failure can be found again. */
#define _POSIX_C_SOURCE 200809L
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "import/import.h"
#include "support/gltf_scene.h"
#include "support/sample_folder.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double longest_import_seconds = 5.0;
enum { MAX_TEXT = 1 << 15, SEEDS = 4 };

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t next(uint64_t *random)
{
    uint64_t z = *random += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static size_t below(uint64_t *random, size_t limit) { return limit ? (size_t)(next(random) % limit) : 0; }

/* ---- Seeds ----------------------------------------------------------------------------------------------------- */

static const gltf_case seeds[SEEDS] = {
    {"materials", "", ",'material':0",
     "'POSITION':0,'NORMAL':1,'TEXCOORD_0':7",
     "'translation':[1,1,3],'extensions':{'KHR_lights_punctual':{'light':0}}",
     "'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,0.75,0.5],'baseColorTexture':{'index':0,"
     "'extensions':{'KHR_texture_transform':{'offset':[0.25,0.5],'scale':[2,3],'rotation':0.5}}},"
     "'metallicRoughnessTexture':{'index':0}},'normalTexture':{'index':0,'scale':0.5},'emissiveFactor':[1,1,1],"
     "'alphaMode':'MASK','extensions':{'KHR_materials_clearcoat':{'clearcoatFactor':1,'clearcoatTexture':"
     "{'index':0}},"
     "'KHR_materials_sheen':{'sheenColorFactor':[1,0,1]},'KHR_materials_ior':{'ior':1.5}}}],"
     "'textures':[{'source':0,'sampler':0}],'images':[{'uri':'map.png'}],"
     "'samplers':[{'magFilter':9729,'wrapS':33071}],"
     "'extensions':{'KHR_lights_punctual':{'lights':[{'type':'spot','spot':{'innerConeAngle':0.25}}]}},"
     "'extensionsRequired':['KHR_lights_punctual']", ""},
    {"glass", ",'matrix':[-0.5,0,0,0,0.25,0.75,0,0,0,0,1,0,0.125,0.5,0.25,1]", ",'material':1,'mode':5,'indices':8",
     "'POSITION':6,'COLOR_0':5", "'mesh':0,'children':[3]},{'rotation':[0,0,0,1],'scale':[1,2,1],'mesh':0",
     "'materials':[{},{'alphaMode':'BLEND','extensions':{'KHR_materials_transmission':{'transmissionFactor':1},"
     "'KHR_materials_volume':{'thicknessFactor':1},'KHR_materials_specular':{'specularFactor':0.5}}}]", ""},
    {"unlit", "", ",'material':0,'mode':6,'indices':9", "'POSITION':0,'COLOR_0':4", "'camera':0",
     "'materials':[{'extensions':{'KHR_materials_unlit':{}},'emissiveFactor':[0,1,0]}],'animations':[]", ""},
    {"image in a view", "", ",'material':0", NULL, "'camera':0,'mesh':0",
     "'materials':[{'emissiveFactor':[1,1,1],'emissiveTexture':{'index':0}}],'textures':[{'source':0}],"
     "'images':[{'bufferView':2}]", ""},
};

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

/* Where the token ends that holds or follows this place; *at becomes its beginning. */
static size_t token_at(const text *t, size_t *at)
{
    static const char marks[] = "{}[],: \n";
    while (*at > 0 && !memchr(marks, t->bytes[*at - 1], sizeof marks - 1)) --*at;
    size_t end = *at;
    while (end < t->size && !memchr(marks, t->bytes[end], sizeof marks - 1)) end++;
    return end;
}

static void odd_token(text *t, uint64_t *random)
{
    static const char *const odd[] = {
        "-1", "0",      "1",          "2",  "3",  "7",    "1e308", "4294967295", "9007199254740992", "0.5",  "-0",
        "{}", "1e-320", "2147483648", "[]", "[0,1]", "null", "true",  "\"\"",       "\"uri\"",          "5120", "255",
        "\"MASK\"",      "[[[[[[[[[[[[[[[["};
    size_t at = below(random, t->size);
    const size_t end = token_at(t, &at);
    const char *word = odd[below(random, sizeof odd / sizeof *odd)];
    replace(t, at, end - at, word, strlen(word));
}

static void copy_piece(text *t, uint64_t *random)
{
    char piece[256];
    const size_t from = below(random, t->size), most = t->size - from < 256 ? t->size - from : 256;
    const size_t length = below(random, most);
    memcpy(piece, t->bytes + from, length);
    replace(t, below(random, t->size), 0, piece, length);
}

static void copy_token(text *t, uint64_t *random)
{
    char piece[64];
    size_t from = below(random, t->size), to = below(random, t->size);
    const size_t from_end = token_at(t, &from), to_end = token_at(t, &to);
    const size_t length = from_end - from < sizeof piece ? from_end - from : sizeof piece;
    memcpy(piece, t->bytes + from, length);
    replace(t, to, to_end - to, piece, length);
}

static void cut_piece(text *t, uint64_t *random)
{
    const size_t at = below(random, t->size), most = t->size - at < 64 ? t->size - at : 64;
    replace(t, at, below(random, most), "", 0);
}

static void mutate(text *t, uint64_t *random)
{
    for (size_t i = 1 + below(random, 3); i > 0 && t->size > 8; i--) switch (below(random, 8)) {
        case 0: t->bytes[below(random, t->size)] ^= (char)(1u << below(random, 8)); break;
        case 1: cut_piece(t, random); break;
        case 2: copy_piece(t, random); break;
        case 3:
        case 4: copy_token(t, random); break;
        default: odd_token(t, random); break;
        }
}

/* ---- Imports --------------------------------------------------------------------------------------------------- */

static text binary;

static void put_u32(text *t, size_t value)
{
    for (int i = 0; i < 4; i++) t->bytes[t->size++] = (char)(value >> (8 * i) & 255);
}

/* The text as a .glb, with its buffer and sometimes a wrong header. */
static void wrap(text *t, uint64_t *random)
{
    static text whole;
    whole.size = 0;
    if (t->size + binary.size + 64 > MAX_TEXT) return;
    memcpy(whole.bytes, "glTF", 4);
    whole.size = 4;
    put_u32(&whole, 2), put_u32(&whole, 28 + t->size + binary.size), put_u32(&whole, t->size);
    memcpy(whole.bytes + whole.size, "JSON", 4);
    memcpy(whole.bytes + whole.size + 4, t->bytes, t->size);
    whole.size += 4 + t->size;
    put_u32(&whole, binary.size);
    memcpy(whole.bytes + whole.size, "BIN", 4);
    memcpy(whole.bytes + whole.size + 4, binary.bytes, binary.size);
    whole.size += 4 + binary.size;
    if (below(random, 4) == 0) whole.bytes[below(random, 20)] ^= (char)(1u << below(random, 8));
    if (below(random, 2) == 0)
        whole.bytes[whole.size - 1 - below(random, binary.size)] ^= (char)(1u << below(random, 8));
    if (below(random, 8) == 0) whole.size = below(random, whole.size);
    *t = whole;
}

static double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static bool import_mutation(uint64_t i, bool *failed)
{
    static text t;
    uint64_t random = i;
    char path[128];
    ca_scene_desc desc;
    ca_error error = {""};
    gltf_case_text(&seeds[i % SEEDS], t.bytes, sizeof t.bytes);
    t.size = strlen(t.bytes);
    mutate(&t, &random);
    if (below(&random, 3) == 0) wrap(&t, &random);
    snprintf(path, sizeof path, "%s/scene.gltf", folder);
    const ca_scene_source source = {.text = t.bytes, .size = t.size, .path = path};
    const double begin = seconds_now();
    const ca_status status = ca_import_scene_source(&source, &desc, &error);
    if (seconds_now() - begin > longest_import_seconds) fail_msg("mutation %llu takes long", (unsigned long long)i);
    if (status == CA_OK) {
        ca_scene_desc_destroy(&desc);
        return true;
    }
    if (!error.message[0]) fail_msg("mutation %llu fails without a message", (unsigned long long)i);
    *failed = true;
    return false;
}

static uint64_t number_of(const char *name, uint64_t fallback)
{
    const char *value = getenv(name);
    return value ? strtoull(value, NULL, 10) : fallback;
}

static void mutations_import_or_fail(void **state)
{
    const uint64_t first = number_of("CAUSTICA_MUTATIONS_FIRST", 0), count = number_of("CAUSTICA_MUTATIONS", 100000);
    uint64_t good = 0, bad = 0;
    (void)state;
    gltf_write_files(folder);
    FILE *file = fopen(path_to("square.bin"), "rb");
    assert_non_null(file);
    binary.size = fread(binary.bytes, 1, MAX_TEXT / 4, file);
    (void)fclose(file);
    for (uint64_t i = first; i < first + count; i++) {
        bool failed = false;
        good += import_mutation(i, &failed);
        bad += failed;
    }
    print_message("%llu of %llu mutations import\n", (unsigned long long)good, (unsigned long long)count);
    assert_true(count < 1000 || (good > count / 50 && bad > count / 50));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(mutations_import_or_fail)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
