/* Files of glTF 2.0: containers, what is refused and where it says so, cameras, and what is missing. */
#include "base/file.h"
#include "base/memory.h"
#include "import/import.h"
#include "support/gltf_twins.h"
#include "support/program_test.h"

#include <math.h>

/* ---- Containers ------------------------------------------------------------------------------------------------ */

static void put_u32(FILE *file, size_t value)
{
    for (int i = 0; i < 4; i++) fputc((int)(value >> (8 * i) & 255), file);
}

/* The first case with its buffer in the chunk of a .glb. */
static void write_glb(void **state, const char *json, const char *name)
{
    char path[256];
    ca_bytes square;
    ca_error error = {""};
    gltf_path_in(folder_of(state), "square.bin", path);
    assert_int_equal(ca_file_read(path, "buffer", 1 << 20, &square, &error), CA_OK);
    gltf_path_in(folder_of(state), name, path);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    const size_t length = (strlen(json) + 3) / 4 * 4, data = (square.size + 3) / 4 * 4;
    fputs("glTF", file);
    put_u32(file, 2), put_u32(file, 12 + 8 + length + 8 + data), put_u32(file, length);
    fputs("JSON", file);
    fprintf(file, "%-*s", (int)length, json);
    put_u32(file, data);
    fwrite("BIN", 1, 4, file);
    fwrite(square.data, 1, square.size, file);
    for (size_t i = square.size; i < data; i++) fputc(0, file);
    assert_int_equal(fclose(file), 0);
    ca_bytes_destroy(&square);
}

static char *base64_of(const unsigned char *data, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    static char text[GLTF_TEXT_SIZE];
    size_t length = 0;
    for (size_t i = 0; i < size; i += 3) {
        const unsigned bits = (unsigned)data[i] << 16 | (i + 1 < size ? (unsigned)data[i + 1] << 8 : 0) |
                              (i + 2 < size ? data[i + 2] : 0u);
        for (size_t k = 0; k < 4; k++)
            text[length++] = i + k > size ? '=' : digits[bits >> (18 - 6 * k) & 63];
    }
    text[length] = '\0';
    return text;
}

static void replace(char *text, size_t size, const char *from, const char *to)
{
    char *at = strstr(text, from);
    assert_non_null(at);
    const size_t rest = strlen(at + strlen(from)) + 1;
    assert_true((size_t)(at - text) + strlen(to) + rest < size);
    memmove(at + strlen(to), at + strlen(from), rest);
    memcpy(at, to, strlen(to));
}

static void test_containers(void **state)
{
    static char text[GLTF_TEXT_SIZE], uri[GLTF_TEXT_SIZE + 64];
    char path[256];
    gltf_write_files(folder_of(state));
    const gltf_case *c = gltf_find_case("texture of a file, its sampler and its map");
    ca_image_layers *expected = gltf_render_case(folder_of(state), c);
    gltf_case_text(c, text, sizeof text);
    replace(text, sizeof text, "\"uri\":\"square.bin\",", "");
    write_glb(state, text, "scene.GLB");
    gltf_path_in(folder_of(state), "scene.GLB", path);
    ca_scene_source source = {.path = path};
    ca_image_layers *image = gltf_render("a .glb", &source);
    gltf_compare("a .glb", image, expected);
    ca_image_release(image);

    ca_bytes bytes;
    ca_error error = {""};
    gltf_path_in(folder_of(state), "map.png", path);
    assert_int_equal(ca_file_read(path, "image", 1 << 20, &bytes, &error), CA_OK);
    snprintf(uri, sizeof uri, "data:image/png;base64,%s", base64_of(bytes.data, bytes.size));
    ca_bytes_destroy(&bytes);
    gltf_case_text(c, text, sizeof text);
    replace(text, sizeof text, "map%2epng", uri);
    gltf_path_in(folder_of(state), "scene.gltf", path);
    source = (ca_scene_source){.text = text, .size = strlen(text), .path = path};
    image = gltf_render("data in a uri", &source);
    gltf_compare("data in a uri", image, expected);
    ca_image_release(image);
    ca_image_release(expected);
}

/* ---- Refusals -------------------------------------------------------------------------------------------------- */

typedef struct refusal {
    const char *from, *to; /* replaced in the JSON of "factors" */
    const char *message;   /* behind the file's name */
} refusal;

static const refusal refusals[] = {
    {"'version':'2.0'", "'version':'1.0'", ":1:10: asset: version \"1.0\" of glTF is not read; 2.0 is"},
    {"'scene':0", "'scene':1", "scene: is 1, and scenes has 1 elements"},
    {"[0,1,2]", "[0,1,7]", ":1:62: scenes[0].nodes[2]: is no node of the 3 that there are"},
    {"[0,1,2]", "[0,1,1]", "nodes[1]: this node is in the tree of nodes twice, or in itself"},
    {"'mesh':0", "'mesh':0,'children':[1]", "nodes[1]: this node is in the tree of nodes twice"},
    {"'mesh':0", "'mesh':0,'skin':0", "nodes[1]: skins are not supported"},
    {"'mesh':0", "'mesh':0,'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':0,'SCALE':3}}}",
     "accessors[3]: has 6 elements, and another part of the instances 4"},
    {"'mesh':0", "'mesh':1", "nodes[1].mesh: is 1, and meshes has 1 elements"},
    {"'mesh':0", "'mesh':0,'matrix':[1,2]", "nodes[1].matrix: must be 16 numbers"},
    {"'mesh':0", "'mesh':0,'rotation':[0,0,0,0]", "nodes[1]: its rotation is no quaternion"},
    {"'indices':3", "'indices':3,'targets':[]", "meshes[0].primitives[0]: morph targets are not supported"},
    {"'indices':3", "'indices':8,'mode':9", "mode must be from 0 to 6"},
    {"'indices':3", "'indices':0", "accessors[0]: has elements of 3 components, and 1 are expected"},
    {"'NORMAL':1", "'NORMAL':3", "accessors[3]: has 6 elements, and the positions have 4"},
    {"'count':6", "'count':7", "accessors[3]: 7 elements do not fit in the buffer view"},
    {"'count':6", "'count':0", "accessors[3]: count must be from 1 to 2^31 - 1"},
    {"'componentType':5123,'count':6", "'componentType':5124,'count':6", "componentType must be 5120 to 5123"},
    {"'bufferView':3,'componentType':5123", "'bufferView':5,'componentType':5121",
     "accessors[3]: index 0 is 255, and there are 4 vertices"},
    {"'byteLength':452", "'byteLength':453", "buffers[0]: has 452 bytes instead of 453"},
    {"'byteLength':452", "'byteLength':100", "does not lie in its buffer, which has 100 bytes"},
    {"'uri':'square.bin'", "'uri':'none.bin'", "buffers[0]: "},
    {"'uri':'square.bin'", "'uri':'https://x/y.bin'", "only files and data are read"},
    {"'uri':'square.bin'", "'uri':'data:text/plain,x'", "data in a uri must be base64"},
    {"'baseColorFactor':[0.5", "'baseColorFactor':[1.5",
     "materials[0].pbrMetallicRoughness.baseColorFactor: must lie in [0, 1]"},
    {"'roughnessFactor':0.5", "'roughnessFactor':'x'",
     "materials[0].pbrMetallicRoughness.roughnessFactor: must be a number, not a text"},
    {"'roughnessFactor':0.5", "'roughnessFactor':-1", "roughnessFactor: is -1, and must lie in [0, 1]"},
    {"'roughnessFactor':0.5", "'roughnessFactor':0.5,'roughnessFactor':0.5", "this key is given twice"},
    {"'metallicFactor':0.25", "'metallicRoughnessTexture':{'index':0}",
     "metallicRoughnessTexture.index: is 0, and textures has 0 elements"},
    {"'materials':[{", "'materials':[{'alphaMode':'X',", "materials[0]: alphaMode \"X\" is not known"},
    {"'materials':[{", "'extensionsRequired':['KHR_draco_mesh_compression'],'materials':[{",
     "extensionsRequired[0]: the file needs the extension KHR_draco_mesh_compression, which is not supported"},
    {"'materials':[{",
     "'materials':[{'extensions':{'KHR_materials_transmission':{'transmissionFactor':1},'KHR_materials_volume':"
     "{'thicknessFactor':1,'attenuationDistance':1,'attenuationColor':[0.5,1,1]}},",
     "materials[0].extensions.KHR_materials_volume: volumes that absorb light are not supported"},
    {"'materials':[{",
     "'textures':[{'extensions':{'KHR_texture_basisu':{'source':0}}}],'materials':[{'normalTexture':{'index':0},",
     "textures[0]: textures in KTX2 (KHR_texture_basisu) are not read"},
    {"'materials':[{",
     "'textures':[{'source':0}],'images':[{'uri':'square.bin'}],'materials':[{'normalTexture':{'index':0},",
     "images[0]: images are PNG, JPEG or WebP files, and this is none of them"},
    {"'materials':[{",
     "'textures':[{'source':0}],'images':[{'uri':'map.png'}],'materials':[{'normalTexture':{'index':0,'texCoord':1},",
     "meshes[0].primitives[0]: has no TEXCOORD_1, which its material needs"},
    {"'buffer':0,'byteLength':48", "'buffer':0,'byteLength':48,'extensions':{'EXT_meshopt_compression':{}}",
     "bufferViews[0]: data packed by meshopt is not read"},
    {"'indices':3", "'indices':3,'extensions':{'KHR_draco_mesh_compression':{}}", NULL},
    {"'POSITION':0,'NORMAL':1", "'POSITION':10", NULL},
    {"'intensity':40", "'intensity':-40", "extensions.KHR_lights_punctual.lights[0].intensity: is -40"},
    {"'type':'point'", "'type':'bulb'", "type \"bulb\" is not point, spot or directional"},
    {"'light':0", "'light':1", "nodes[2].extensions.KHR_lights_punctual: counts no light of the 1 that there are"},
    {"'camera':0", "'camera':1", "nodes[0].camera: is 1, and cameras has 1 elements"},
    {"'yfov':0.75,", "", "cameras[0].perspective: has no yfov"},
    {"'type':'perspective'", "'type':'ortographic'",
     "cameras[0]: type \"ortographic\" is not perspective or orthographic"},
    {"'type':'perspective'", "'type':'orthographic','orthographic':{'ymag':1}",
     "cameras[0].orthographic: has no xmag"},
    {"'type':'perspective'", "'type':'orthographic','orthographic':{'xmag':1}",
     "cameras[0].orthographic: has no ymag"},
    {"'yfov':0.75", "'yfov':4", "cameras[0].perspective.yfov: is 4, and must lie in"},
    {"'scene':0", "'scene':0 0", ":1:38: this is not JSON: expected , or }"},
    {"'scene':0", "'scene':01", "this is not JSON: expected a value"},
    {"'scene':0", "'scene':0,'a\\u0000':1", "this is not JSON: a wrong \\u in a string"},
    {"'scene':0", "'scene':0,'a\xff':1", "this is not JSON: a character that a string cannot have"},
};

static void test_refusals(void **state)
{
    static char text[GLTF_TEXT_SIZE];
    char path[256], from[512], to[512];
    gltf_write_files(folder_of(state));
    gltf_path_in(folder_of(state), "scene.gltf", path);
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        const refusal *r = &refusals[i];
        ca_scene_desc desc;
        ca_error error = {""};
        gltf_case_text(gltf_find_case("factors"), text, sizeof text);
        snprintf(from, sizeof from, "%s", r->from), snprintf(to, sizeof to, "%s", r->to);
        for (char *c = from; *c; c++) *c = *c == '\'' ? '"' : *c;
        for (char *c = to; *c; c++) *c = *c == '\'' ? '"' : *c;
        replace(text, sizeof text, from, to);
        const ca_status status = ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error);
        if (!r->message && status != CA_OK) fail_msg("%s is refused: %s", r->to, error.message);
        if (!r->message) {
            ca_scene_desc_destroy(&desc);
            continue;
        }
        if (status == CA_OK) fail_msg("%s is not refused", r->to);
        if (!strstr(error.message, r->message) || strncmp(error.message, path, strlen(path)) != 0)
            fail_msg("%s: \"%s\" does not tell \"%s\"", r->to, error.message, r->message);
    }
}

/* ---- Cameras, and what is missing ------------------------------------------------------------------------------ */

static void load_text(void **state, const char *text, const char *camera, ca_scene_desc *desc)
{
    char path[256];
    ca_error error = {""};
    gltf_path_in(folder_of(state), "scene.gltf", path);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path, .camera = camera};
    if (ca_import_scene_source(&source, desc, &error) != CA_OK) fail_msg("%s", error.message);
}

/* Each extension of a material that is not read is said once, whoever defined it. */
static void test_unread_extensions(void **state)
{
    static char text[GLTF_TEXT_SIZE];
    ca_scene_desc desc;
    char many[4096] = "\"materials\":[{\"extensions\":{";
    gltf_write_files(folder_of(state));
    gltf_case_text(gltf_find_case("factors"), text, sizeof text);
    replace(text, sizeof text, "\"materials\":[{",
            "\"extensionsUsed\":[\"ADOBE_materials_clearcoat_tint\"],\"materials\":[{\"extensions\":{"
            "\"ADOBE_materials_clearcoat_tint\":{},\"KHR_materials_iridescence\":{},\"KHR_materials_ior\":{}},");
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.notes.count, 2);
    assert_says(desc.notes.items[0], "the material extension ADOBE_materials_clearcoat_tint is not read");
    assert_says(desc.notes.items[1], "the material extension KHR_materials_iridescence is not read");
    ca_scene_desc_destroy(&desc);
    for (int i = 0; i < 40; i++) {
        const size_t used = strlen(many);
        snprintf(many + used, sizeof many - used, "%s\"X_%d\":{}", i ? "," : "", i);
    }
    strcat(many, "},");
    gltf_case_text(gltf_find_case("factors"), text, sizeof text);
    replace(text, sizeof text, "\"materials\":[{", many);
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.notes.count, 33);
    assert_says(desc.notes.items[32], "more than 32 material extensions are not read");
    ca_scene_desc_destroy(&desc);
}

/* 3 wide and 2 high, seen from (1, 2, 5) along +x: the second sensor of the file. */
static void test_cameras(void **state)
{
    static char text[GLTF_TEXT_SIZE];
    ca_scene_desc desc;
    ca_error error = {""};
    gltf_case c = *gltf_find_case("factors");
    c.light = LAMP_NODE ",'children':[3]},{'name':'Side','camera':1,'translation':[0,0.5,2],"
                        "'rotation':[0,-0.70710678118654757,0,0.70710678118654757]";
    gltf_write_files(folder_of(state));
    gltf_case_text(&c, text, sizeof text);
    replace(text, sizeof text, "\"zfar\":100}}",
            "\"zfar\":100}},{\"type\":\"orthographic\",\"orthographic\":"
            "{\"xmag\":1.5,\"ymag\":1,\"znear\":0.5,\"zfar\":9}}");
    load_text(state, text, "Side", &desc);
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_ORTHOGRAPHIC);
    assert_int_equal(desc.film.width, 768);
    assert_int_equal(desc.film.height, 512);
    static const float expected[3][4] = {{0, 0, 1, 1}, {0, 1.5f, 0, 2}, {-1.5f, 0, 0, 5}};
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            if (fabsf(desc.camera.camera.map.to[row][column] - expected[row][column]) > 1e-6f)
                fail_msg("row %d, column %d of the camera's map is %g", row, column,
                         (double)desc.camera.camera.map.to[row][column]);
    assert_true(desc.camera.camera.near_clip == 0.5f && desc.camera.camera.far_clip == 9.0f);
    ca_scene_desc_destroy(&desc);
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_PERSPECTIVE);
    ca_scene_desc_destroy(&desc);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = "scene.gltf", .camera = "side"};
    assert_int_not_equal(ca_import_scene_source(&source, &desc, &error), CA_OK);
}

/* A file without camera and light is seen whole, under a white sky, and both are said. */
static void test_defaults(void **state)
{
    static char text[GLTF_TEXT_SIZE];
    char path[256];
    const gltf_case c = {.name = "bare", .node = ",'translation':[100,0,0]", .primitive = "", .light = "", .top = ""};
    ca_scene_desc desc;
    gltf_write_files(folder_of(state));
    gltf_case_text(&c, text, sizeof text);
    replace(text, sizeof text, "\"camera\":0,", "");
    load_text(state, text, NULL, &desc);
    assert_int_equal(desc.lights.count, 1);
    assert_int_equal(desc.lights.items[0].kind, CA_LIGHT_CONSTANT);
    assert_int_equal(desc.notes.count, 2);
    assert_says(desc.notes.items[0], "there is no camera in the scene");
    assert_says(desc.notes.items[1], "there is no light in the scene");
    ca_scene_desc_destroy(&desc);
    /* All four corners are in the picture: albedo there, and none at its edges. */
    gltf_path_in(folder_of(state), "scene.gltf", path);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = path};
    ca_image_layers *image = gltf_render("bare", &source);
    const float *z = ca_layers_find(image, "N.Z");
    int inside = 0, edge = 0;
    for (int i = 0; i < GLTF_WIDTH * GLTF_HEIGHT; i++) {
        const int x = i % GLTF_WIDTH, y = i / GLTF_WIDTH;
        const bool hit = z[i] != 0.0f;
        inside += hit;
        edge += hit && (x == 0 || y == 0 || x == GLTF_WIDTH - 1 || y == GLTF_HEIGHT - 1);
    }
    assert_int_equal(edge, 0);
    assert_in_range(inside, GLTF_WIDTH * GLTF_HEIGHT / 10, GLTF_WIDTH * GLTF_HEIGHT / 2);
    ca_image_release(image);
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

static void test_the_program(void **state)
{
    static char text[GLTF_TEXT_SIZE];
    ca_program_result r;
    gltf_write_files(folder_of(state));
    gltf_case_text(gltf_find_case("factors"), text, sizeof text);
    write_text(folder_of(state), "scene.gltf", text);
    RUN(&r, "info", "scene.gltf", "--camera", "Eye");
    assert_exit(&r, 0);
    assert_says(r.output, "field of view");
    RUN(&r, "render", "scene.gltf", "--camera", "Eyes", "-o", "a.exr");
    assert_wrong_usage(&r, "there is no sensor \"Eyes\"; the nearest id is \"Eye\"");
    RUN(&r, "render", "scene.gltf", "--camera=Eye", "--spp=1", "--resolution=24x16", "-o", "a.exr", "--quiet");
    assert_exit(&r, 0);
    RUN(&r, "info", "scene.gltf", "-D", "a=b");
    assert_exit(&r, 2);
}

/* ---- Failing allocations --------------------------------------------------------------------------------------- */

static void test_failing_allocations(void **state)
{
    static char text[GLTF_TEXT_SIZE];
    static const char *const names[] = {"clearcoat", "instances", "sparse positions"};
    char path[256];
    gltf_write_files(folder_of(state));
    gltf_path_in(folder_of(state), "scene.gltf", path);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        gltf_case_text(gltf_find_case(names[i]), text, sizeof text);
        for (long count = 0;; count++) {
            ca_scene_desc desc;
            ca_error error = {""};
            ca_memory_fail_after(count);
            const ca_status status = ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error);
            ca_memory_fail_after(-1);
            if (status == CA_OK) {
                ca_scene_desc_destroy(&desc);
                assert_in_range(count, 20, 10000);
                break;
            }
            if (status != CA_ERROR_MEMORY && !strstr(error.message, "memory"))
                fail_msg("allocation %ld: %s", count, error.message);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_containers),
        PROGRAM_TEST(test_refusals),
        PROGRAM_TEST(test_unread_extensions),
        PROGRAM_TEST(test_cameras),
        PROGRAM_TEST(test_defaults),
        PROGRAM_TEST(test_the_program),
        PROGRAM_TEST(test_failing_allocations),
    };
    return run_program_tests("files of glTF", tests, sizeof tests / sizeof tests[0]);
}
