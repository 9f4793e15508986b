/* glTF 2.0: each feature against a twin in XML, to the bit. */
#include "import/import.h"
#include "support/gltf_twins.h"
#include "support/program_test.h"

#include <math.h>

/* ---- Twins ----------------------------------------------------------------------------------------------------- */

static void compare_case(void **state, const gltf_case *c)
{
    static char text[GLTF_TEXT_SIZE];
    char path[256];
    gltf_path_in(folder_of(state), "twin.xml", path);
    gltf_case_twin(c, text, sizeof text);
    const ca_scene_source twin = gltf_twin_source(text, path);
    ca_image_layers *a = gltf_render_case(folder_of(state), c), *b = gltf_render(c->name, &twin);
    /* a mirrored frame rounds otherwise */
    gltf_compare_within(c->name, a, b, strstr(c->name, "mirrored") ? 1e-6f : 0.0f);
    ca_image_release(a);
    ca_image_release(b);
}

static void test_twins(void **state)
{
    gltf_write_files(folder_of(state));
    for (int i = 0; i < gltf_case_count; i++)
        compare_case(state, &gltf_cases[i]);
}

/* ---- What a converted scene is --------------------------------------------------------------------------------- */

static void test_converted(void **state)
{
    static char text[GLTF_TEXT_SIZE];
    char path[256], to[256];
    gltf_write_files(folder_of(state));
    gltf_path_in(folder_of(state), "scene.gltf", path);
    gltf_path_in(folder_of(state), "copy.xml", to);
    for (int i = 0; i < gltf_case_count; i++) {
        ca_scene_desc desc;
        ca_error error = {""};
        gltf_case_text(&gltf_cases[i], text, sizeof text);
        const ca_scene_source source = {.text = text, .size = strlen(text), .path = path}, copy = {.path = to};
        if (ca_import_convert(&source, to, &desc, &error) != CA_OK)
            fail_msg("%s: %s", gltf_cases[i].name, error.message);
        ca_scene_desc_destroy(&desc);
        ca_image_layers *a = gltf_render(gltf_cases[i].name, &source), *b = gltf_render(gltf_cases[i].name, &copy);
        gltf_compare(gltf_cases[i].name, a, b);
        ca_image_release(a);
        ca_image_release(b);
    }
}

/* ---- Colours at corners ---------------------------------------------------------------------------------------- */

static void check_colors(void **state, const char *attributes, const float expected[12])
{
    static char text[GLTF_TEXT_SIZE];
    char path[256];
    ca_scene_desc desc;
    ca_error error = {""};
    const gltf_case c = {.name = "colours", .node = "", .primitive = ",'material':0", .attributes = attributes,
                         .light = LAMP_NODE,
                         .top = "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP};
    gltf_path_in(folder_of(state), "scene.gltf", path);
    gltf_case_text(&c, text, sizeof text);
    if (ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error) != CA_OK)
        fail_msg("%s", error.message);
    const ca_mesh_attribute *colors = ca_mesh_find_attribute(&desc.meshes.items[0], "vertex_color");
    assert_non_null(colors);
    assert_int_equal(colors->components, 3);
    for (int i = 0; i < 12; i++) {
        static const float base[3] = {0.5f, 0.25f, 0.75f};
        if (fabsf(colors->values[i] - expected[i] * base[i % 3]) > 1e-7f)
            fail_msg("colour %d is %g", i, (double)colors->values[i]);
    }
    ca_scene_desc_destroy(&desc);
}

static void test_colors(void **state)
{
    gltf_write_files(folder_of(state));
    check_colors(state, "'POSITION':0,'NORMAL':1,'COLOR_0':4",
                 (const float[12]){1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5f, 0.25f, 0.75f});
    check_colors(state, "'POSITION':0,'NORMAL':1,'COLOR_0':5",
                 (const float[12]){1, 0, 0.2f, 0, 1, 0, 0.4f, 0, 1, 1, 1, 0});
}

/* With a texture: both, times the factor; twins within rounding. */
#define YELLOW "'POSITION':0,'NORMAL':1,'TEXCOORD_0':2,'COLOR_0':12"
#define YELLOW_TOP(members)                                                                                          \
    "'materials':[{'pbrMetallicRoughness':{'metallicFactor':0,'baseColorFactor':[0.5,0.25,0.75,1],"                  \
    "'baseColorTexture':{'index':0}}" members "}]," MAP_TOP "," LAMP_TOP
#define YELLOW_TEXTURE(attribute)                                                                                    \
    "<texture type='scale' " attribute "><rgb name='scale' value='0.5 0.25 0.375'/><texture type='bitmap'>"          \
    "<string name='filename' value='map.png'/></texture></texture>"

static void assert_near_images(const char *name, const ca_image_layers *a, const ca_image_layers *b)
{
    static const char *const names[3] = {"R", "G", "B"};
    double sum = 0.0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < GLTF_WIDTH * GLTF_HEIGHT; i++) {
            const double x = (double)ca_layers_find(a, names[c])[i], y = (double)ca_layers_find(b, names[c])[i];
            sum += x;
            if (!(fabs(x - y) <= 1e-5 * (y + 0.01)))
                fail_msg("%s: pixel %d of %s is %.9g, and %.9g of its twin", name, i, names[c], x, y);
        }
    assert_true(sum > 0.01);
}

static void test_colors_and_a_texture(void **state)
{
    static const gltf_case both[] = {
        {"coloured corners and a texture", "", ",'material':0", YELLOW, LAMP_NODE, YELLOW_TOP(""),
         "<bsdf type='twosided' id='m'>" PRINCIPLED(YELLOW_TEXTURE("name='base_color'")
         "<float name='roughness' value='1'/><float name='metallic' value='0'/>") "</bsdf>" SHAPE("square", "")},
        {"the same, unlit", "", ",'material':0", YELLOW, LAMP_NODE,
         YELLOW_TOP(",'extensions':{'KHR_materials_unlit':{}}"),
         YELLOW_TEXTURE("id='t'") "<bsdf type='diffuse' id='m'><float name='reflectance' value='0'/></bsdf>"
         SHAPE("square", "<emitter type='area'><ref name='radiance' id='t'/></emitter>")},
    };
    static char text[GLTF_TEXT_SIZE];
    char path[256];
    gltf_write_files(folder_of(state));
    for (size_t i = 0; i < sizeof both / sizeof both[0]; i++) {
        ca_image_layers *a = gltf_render_case(folder_of(state), &both[i]);
        gltf_path_in(folder_of(state), "twin.xml", path);
        gltf_case_twin(&both[i], text, sizeof text);
        const ca_scene_source twin = gltf_twin_source(text, path);
        ca_image_layers *b = gltf_render(both[i].name, &twin);
        assert_near_images(both[i].name, a, b);
        ca_image_release(a);
        ca_image_release(b);
    }
}

/* ---- Instances of one node ------------------------------------------------------------------------------------- */

/* Scaled by accessor 12, turned by 5 as quaternions, moved by 0, and then by the node's own translation. */
static void test_many_places(void **state)
{
    static const float quaternions[4][4] = {{1, 0, 0.2f, 1}, {0, 1, 0, 1}, {0.4f, 0, 1, 1}, {1, 1, 0, 1}};
    static const float translations[4][3] = {{-1, -1, 0}, {1, -1, 0.25f}, {1, 1, 0}, {-1, 1, -0.125f}};
    static char text[GLTF_TEXT_SIZE], twin_text[GLTF_TEXT_SIZE];
    char path[256];
    size_t at = (size_t)snprintf(twin_text, sizeof twin_text,
                                 "<bsdf type='twosided' id='m'>" PRINCIPLED(DULL) "</bsdf>"
                                 "<shape type='shapegroup' id='g'><shape type='mesh'>"
                                 "<string name='data' value='plain'/><ref id='m'/></shape></shape>" LAMP_TWIN);
    for (int i = 0; i < 4; i++) {
        const float *q = quaternions[i], *t = translations[i];
        const double sine = sqrt((double)(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]));
        at += (size_t)snprintf(twin_text + at, sizeof twin_text - at,
                               "<shape type='instance'><transform name='to_world'><scale value='1 1 0.5'/>"
                               "<rotate x='%.9g' y='%.9g' z='%.9g' angle='%.17g'/><translate value='%g %g %g'/>"
                               "<translate value='0.25 0 -4'/></transform><ref id='g'/></shape>",
                               (double)q[0], (double)q[1], (double)q[2],
                               2.0 * atan2(sine, (double)q[3]) * 180.0 / 3.14159265358979323846, (double)t[0],
                               (double)t[1], (double)t[2]);
    }
    const gltf_case c = {"many places",
                         ",'translation':[0.25,0,-4],'extensions':{'EXT_mesh_gpu_instancing':{'attributes':"
                         "{'TRANSLATION':0,'ROTATION':5,'SCALE':12}}}",
                         ",'material':0", NULL, LAMP_NODE,
                         "'extensionsRequired':['EXT_mesh_gpu_instancing'],"
                         "'materials':[{'pbrMetallicRoughness':{" DULL_PBR "}}]," LAMP_TOP, twin_text};
    gltf_write_files(folder_of(state));
    ca_image_layers *a = gltf_render_case(folder_of(state), &c);
    gltf_path_in(folder_of(state), "twin.xml", path);
    gltf_case_twin(&c, text, sizeof text);
    const ca_scene_source twin = gltf_twin_source(text, path);
    ca_image_layers *b = gltf_render(c.name, &twin);
    assert_near_images(c.name, a, b);
    ca_image_release(a);
    ca_image_release(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_twins),
        PROGRAM_TEST(test_converted),
        PROGRAM_TEST(test_colors),
        PROGRAM_TEST(test_colors_and_a_texture),
        PROGRAM_TEST(test_many_places),
    };
    return run_program_tests("glTF", tests, sizeof tests / sizeof tests[0]);
}
