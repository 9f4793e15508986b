/* Damaged glTF scenes through the importer, as .gltf and as .glb: each either imports or fails with a message that
 * names the file, in time, without a crash and (under the address sanitizer) without a leak.
 *
 * The texts are scenes with what the reader knows, changed by flipped bytes, cut and repeated pieces, odd numbers and
 * keys put in other places; the buffer's bytes are damaged too. Mutation i depends on i alone: CAUSTICA_MUTATIONS is
 * their number, CAUSTICA_MUTATIONS_FIRST the first i, so that a failure can be found again. */
#include "support/gltf_scene.h"
#include "support/mutated_text.h"
#include "support/sample_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SEEDS = 5 };

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
    {"specular-glossiness", "", ",'material':0", NULL, "'camera':0",
     "'materials':[{'extensions':{'KHR_materials_pbrSpecularGlossiness':{'diffuseFactor':[0.5,0.25,0.75,1],"
     "'diffuseTexture':{'index':0},'specularFactor':[0.5,0.25,0.75],'glossinessFactor':0.75,"
     "'specularGlossinessTexture':{'index':0}}}}],'textures':[{'source':0}],'images':[{'uri':'map.png'}]", ""},
    {"image in a view", "", ",'material':0", NULL, "'camera':0,'mesh':0",
     "'materials':[{'emissiveFactor':[1,1,1],'emissiveTexture':{'index':0}}],'textures':[{'source':0}],"
     "'images':[{'bufferView':2}]", ""},
};

/* ---- Mutations ------------------------------------------------------------------------------------------------- */

/* Where the token ends that holds or follows this place; *at becomes its beginning. */
static size_t token_at(const mutated_text *t, size_t *at)
{
    static const char marks[] = "{}[],: \n";
    while (*at > 0 && !memchr(marks, t->bytes[*at - 1], sizeof marks - 1)) --*at;
    size_t end = *at;
    while (end < t->size && !memchr(marks, t->bytes[end], sizeof marks - 1)) end++;
    return end;
}

static void odd_token(mutated_text *t, uint64_t *random)
{
    static const char *const odd[] = {
        "-1", "0",      "1",          "2",  "3",  "7",    "1e308", "4294967295", "9007199254740992", "0.5",  "-0",
        "{}", "1e-320", "2147483648", "[]", "[0,1]", "null", "true",  "\"\"",       "\"uri\"",          "5120", "255",
        "\"MASK\"",      "[[[[[[[[[[[[[[[["};
    size_t at = mutation_below(random, t->size);
    const size_t end = token_at(t, &at);
    const char *word = odd[mutation_below(random, sizeof odd / sizeof *odd)];
    mutated_replace(t, at, end - at, word, strlen(word));
}

static void copy_token(mutated_text *t, uint64_t *random)
{
    char piece[64];
    size_t from = mutation_below(random, t->size), to = mutation_below(random, t->size);
    const size_t from_end = token_at(t, &from), to_end = token_at(t, &to);
    const size_t length = from_end - from < sizeof piece ? from_end - from : sizeof piece;
    memcpy(piece, t->bytes + from, length);
    mutated_replace(t, to, to_end - to, piece, length);
}

static const mutation kinds[] = {
    mutation_flip_byte, mutation_cut, mutation_repeat_piece, copy_token, copy_token, odd_token, odd_token, odd_token,
};

/* ---- Imports --------------------------------------------------------------------------------------------------- */

static mutated_text binary;

static void put_u32(mutated_text *t, size_t value)
{
    for (int i = 0; i < 4; i++) t->bytes[t->size++] = (char)(value >> (8 * i) & 255);
}

/* The text as a .glb, with its buffer and sometimes a wrong header. */
static void wrap(mutated_text *t, uint64_t *random)
{
    static mutated_text whole;
    whole.size = 0;
    if (t->size + binary.size + 64 > MUTATED_TEXT_MAX) return;
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
    if (mutation_below(random, 4) == 0)
        whole.bytes[mutation_below(random, 20)] ^= (char)(1u << mutation_below(random, 8));
    if (mutation_below(random, 2) == 0)
        whole.bytes[whole.size - 1 - mutation_below(random, binary.size)] ^= (char)(1u << mutation_below(random, 8));
    if (mutation_below(random, 8) == 0) whole.size = mutation_below(random, whole.size);
    *t = whole;
}

static bool import_mutation(long i)
{
    static mutated_text t;
    uint64_t random = (uint64_t)i;
    char path[128];
    gltf_case_text(&seeds[i % SEEDS], t.bytes, sizeof t.bytes);
    t.size = strlen(t.bytes);
    mutate(&t, &random, kinds, sizeof kinds / sizeof *kinds);
    if (mutation_below(&random, 3) == 0) wrap(&t, &random);
    snprintf(path, sizeof path, "%s/scene.gltf", folder);
    return mutation_imports(&(ca_scene_source){.text = t.bytes, .size = t.size, .path = path}, i);
}

static void mutations_import_or_fail(void **state)
{
    (void)state;
    const long first = mutation_setting("CAUSTICA_MUTATIONS_FIRST", 0);
    const long count = mutation_setting("CAUSTICA_MUTATIONS", 100000);
    long good = 0;
    gltf_write_files(folder);
    FILE *file = fopen(path_to("square.bin"), "rb");
    assert_non_null(file);
    binary.size = fread(binary.bytes, 1, MUTATED_TEXT_MAX / 4, file);
    (void)fclose(file);
    for (long i = first; i < first + count; i++) good += import_mutation(i);
    print_message("%ld of %ld mutations import\n", good, count);
    assert_true(count < 1000 || (good > count / 50 && count - good > count / 50));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(mutations_import_or_fail)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
