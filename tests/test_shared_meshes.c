/* Meshes that several shapes of a scene show are read once and share arrays; the picture is to the bit that of a
 * scene whose shapes have files of their own. */
#include "base/key_table.h"
#include "base/memory.h"
#include "import/import.h"
#include "support/sample_files.h"
#include "support/sample_folder.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* ---- Scenes ---------------------------------------------------------------------------------------------------- */

static const char ply_text[] =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property float u\nproperty float v\nproperty float r\nproperty float g\nproperty float b\nelement face 2\n"
    "property list uchar int vertex_indices\nend_header\n"
    "-0.4 -0.4 0 0 0 1 1 1\n0.4 -0.4 0.1 1 0 1 0.5 0.2\n0.4 0.4 -0.1 1 1 0.3 1 0.4\n-0.4 0.4 0.2 0 1 0.1 0.9 1\n"
    "3 0 2 1\n3 0 3 2\n";

/* What the shapes are, each of a mesh of the same file. */
static const char *const shapes[] = {
    "<transform name='to_world'><translate x='-1.2' y='0.6'/></transform>",
    "<transform name='to_world'><rotate z='1' angle='20'/><translate y='0.6'/></transform>",
    "<transform name='to_world'><scale x='-1.2'/><translate x='1.2' y='0.6'/></transform>",
    "<transform name='to_world'><translate x='-1.2' y='-0.6'/></transform>"
    "<boolean name='flip_normals' value='true'/>",
    "<transform name='to_world'><translate x='-1.2' y='0.6'/></transform><bsdf type='plastic'/>",
    "<transform name='to_world'><translate y='-0.6'/></transform><boolean name='face_normals' value='true'/>",
    "<transform name='to_world'><translate x='1.2' y='-0.6'/></transform>"
    "<boolean name='flip_tex_coords' value='true'/>",
};
enum { SHAPES = sizeof shapes / sizeof shapes[0] };

static const char start[] =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='50'/><transform name='to_world'>"
    "<lookat origin='0.3, 0.2, -4' target='0, 0, 0' up='0, 1, 0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='40'/><integer name='height' value='24'/></film></sensor>"
    "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
    "<bsdf type='twosided' id='m'><bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf>"
    "</bsdf>"
    "<emitter type='point'><point name='position' value='1, 2, -3'/></emitter><emitter type='constant'/>";

static void write_text(const char *name, const char *text) { sample_write(path_to(name), text, strlen(text)); }

/* Shapes `order[0]`, `order[1]`, ... of one file, or each of its own. */
static void write_scene(const char *name, const int *order, int count, bool own_files)
{
    char text[8192], file[32];
    size_t used = (size_t)snprintf(text, sizeof text, "%s", start);
    for (int i = 0; i < count; i++) {
        const char *shape = shapes[order[i]];
        snprintf(file, sizeof file, "own-%d.ply", own_files ? i : 0);
        write_text(file, ply_text);
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "<shape type='ply'><string name='filename' value='%s'/>%s%s</shape>", file, shape,
                                 strstr(shape, "<bsdf") ? "" : "<ref id='m'/>");
    }
    snprintf(text + used, sizeof text - used, "</scene>");
    write_text(name, text);
}

static void read_scene(const char *name, ca_scene_desc *desc)
{
    ca_error error = {""};
    if (ca_import_scene(path_to(name), NULL, 0, desc, &error) != CA_OK) fail_msg("%s", error.message);
}

static uint64_t picture_of(const ca_scene *scene)
{
    const ca_render_settings settings = {.samples_per_pixel = 4, .threads = 1};
    return rendered_hash(scene, &settings);
}

static ca_scene *load_after(const char *name, const ca_scene *previous)
{
    ca_scene *scene;
    ca_error error = {""};
    const ca_scene_source source = {.path = path_to(name), .previous = previous};
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    return scene;
}

static uint64_t picture_of_file(const char *name)
{
    ca_scene *scene = load_after(name, NULL);
    const uint64_t hash = picture_of(scene);
    ca_scene_release(scene);
    return hash;
}

/* ---- XML ------------------------------------------------------------------------------------------------------- */

static void test_arrays_are_shared(void **state)
{
    (void)state;
    static const int order[SHAPES] = {0, 1, 2, 3, 4, 5, 6};
    ca_scene_desc desc;
    const ca_mesh *mesh[SHAPES];
    write_scene("shared.xml", order, SHAPES, false);
    read_scene("shared.xml", &desc);
    assert_int_equal(desc.shapes.count, SHAPES);
    assert_int_equal(desc.meshes.count, SHAPES - 1);
    for (int i = 0; i < SHAPES; i++) mesh[i] = &desc.meshes.items[desc.shapes.items[i].as.mesh.index];
    assert_ptr_equal(mesh[0], mesh[4]); /* in the same place */
    assert_ptr_equal(mesh[0]->indices, mesh[1]->indices);
    for (int i = 2; i < 4; i++) assert_ptr_not_equal(mesh[0]->indices, mesh[i]->indices); /* turned round */
    for (int i = 1; i < 4; i++) {
        assert_ptr_equal(mesh[0]->uvs, mesh[i]->uvs);
        assert_ptr_not_equal(mesh[0]->positions, mesh[i]->positions);
        assert_ptr_not_equal(mesh[0]->normals, mesh[i]->normals);
        assert_int_equal(mesh[i]->attribute_count, 1);
        assert_ptr_not_equal(mesh[0]->attributes, mesh[i]->attributes);
    }
    assert_null(mesh[5]->normals);
    for (int i = 5; i < 7; i++) assert_ptr_not_equal(mesh[0]->uvs, mesh[i]->uvs);
    ca_scene_desc_destroy(&desc);
}

static void test_pictures_are_the_same(void **state)
{
    (void)state;
    static const int orders[][SHAPES] = {{0, 1, 2, 3, 4, 5, 6}, {2, 3, 0, 1, 6, 5, 4}, {3, 4, 2, 1, 0, 6, 5}};
    for (size_t i = 0; i < sizeof orders / sizeof orders[0]; i++) {
        write_scene("shared.xml", orders[i], SHAPES, false);
        write_scene("own.xml", orders[i], SHAPES, true);
        assert_true(picture_of_file("shared.xml") == picture_of_file("own.xml"));
    }
}

/* The next version has one shape less, or more: whatever it shares with the former, the picture is its own. */
static void test_versions(void **state)
{
    (void)state;
    static const int first[SHAPES] = {2, 1, 0, 4, 3, 5, 6}, second[SHAPES] = {1, 0, 4, 6, 2};
    for (int turn = 0; turn < 2; turn++) {
        write_scene(turn ? "b.xml" : "a.xml", first, SHAPES, false);
        write_scene(turn ? "a.xml" : "b.xml", second, 5, false);
        ca_scene *a = load_after("a.xml", NULL), *b = load_after("b.xml", a);
        const uint64_t before = picture_of(a);
        assert_true(picture_of(b) == picture_of_file("b.xml"));
        ca_scene_release(turn ? a : b);
        ca_scene *c = turn ? load_after("a.xml", b) : load_after("a.xml", a);
        ca_scene_release(turn ? b : a);
        assert_true(picture_of(c) == before);
        ca_scene_release(c);
    }
}

static void test_failing_allocations(void **state)
{
    (void)state;
    static const int order[] = {0, 1, 2, 4};
    write_scene("shared.xml", order, 4, false);
    for (long count = 0;; count++) {
        ca_scene_desc desc;
        ca_error error = {""};
        ca_memory_fail_after(count);
        const ca_status status = ca_import_scene(path_to("shared.xml"), NULL, 0, &desc, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) {
            ca_scene_desc_destroy(&desc);
            assert_in_range(count, 40, 1000);
            break;
        }
        if (status != CA_ERROR_MEMORY) fail_msg("allocation %ld: %s", count, error.message);
    }
}

/* ---- Other formats --------------------------------------------------------------------------------------------- */

static void test_gltf(void **state)
{
    (void)state;
    static const char text[] =
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1,2]}],"
        "\"nodes\":[{\"mesh\":0},{\"mesh\":1,\"translation\":[3,0,0]},{\"mesh\":2,\"translation\":[6,0,0]}],"
        "\"materials\":[{},{\"emissiveFactor\":[1,1,1]}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1},\"indices\":2,\"material\":0}]},"
        "{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1},\"indices\":2,\"material\":1}]},"
        "{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":2,\"material\":0}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":2,\"componentType\":5123,\"count\":3,\"type\":\"SCALAR\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":36},"
        "{\"buffer\":0,\"byteOffset\":72,\"byteLength\":6}],"
        "\"buffers\":[{\"uri\":\"triangle.bin\",\"byteLength\":78}]}";
    static const float corners[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    sample_bytes binary = {0};
    ca_scene_desc desc;
    for (int i = 0; i < 18; i++) sample_f32(&binary, corners[i]);
    for (unsigned i = 0; i < 3; i++) sample_u16(&binary, i);
    sample_write(path_to("triangle.bin"), binary.data, binary.size);
    sample_free(&binary);
    write_text("triangles.gltf", text);
    read_scene("triangles.gltf", &desc);
    assert_int_equal(desc.meshes.count, 3);
    const ca_mesh *mesh = desc.meshes.items;
    assert_ptr_equal(mesh[0].indices, mesh[1].indices);
    assert_ptr_not_equal(mesh[0].indices, mesh[2].indices); /* it has no normals */
    assert_int_equal(desc.lights.count, 1);
    ca_scene_desc_destroy(&desc);
}

static void test_pbrt(void **state)
{
    (void)state;
    static const char text[] =
        "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 50\n"
        "Film \"rgb\" \"integer xresolution\" 40 \"integer yresolution\" 24\nIntegrator \"path\"\n"
        "WorldBegin\nLightSource \"point\" \"point3 from\" [ 1 2 -3 ]\n"
        "AttributeBegin\nTranslate -1 0 0\nShape \"plymesh\" \"string filename\" \"%s\"\nAttributeEnd\n"
        "AttributeBegin\nTranslate 1 0 0\nReverseOrientation\nShape \"plymesh\" \"string filename\" \"%s\"\n"
        "AttributeEnd\nAttributeBegin\nTranslate 0 0.5 0\nShape \"plymesh\" \"string filename\" \"%s\"\n"
        "AttributeEnd\nAreaLightSource \"diffuse\"\nTranslate 0 -0.8 0\n"
        "Shape \"plymesh\" \"string filename\" \"%s\"\n";
    char scene[4096];
    ca_scene_desc desc;
    for (int i = 0; i < 4; i++) {
        snprintf(scene, sizeof scene, "own-%d.ply", i);
        write_text(scene, ply_text);
    }
    snprintf(scene, sizeof scene, text, "own-0.ply", "own-0.ply", "own-0.ply", "own-0.ply");
    write_text("shared.pbrt", scene);
    snprintf(scene, sizeof scene, text, "own-0.ply", "own-1.ply", "own-2.ply", "own-3.ply");
    write_text("own.pbrt", scene);
    read_scene("shared.pbrt", &desc);
    assert_int_equal(desc.meshes.count, 4);
    const ca_mesh *mesh = desc.meshes.items;
    assert_ptr_equal(mesh[0].uvs, mesh[1].uvs);
    assert_ptr_not_equal(mesh[0].indices, mesh[1].indices);
    assert_ptr_equal(mesh[0].indices, mesh[2].indices);
    assert_ptr_not_equal(mesh[0].uvs, mesh[3].uvs); /* a light */
    ca_scene_desc_destroy(&desc);
    assert_true(picture_of_file("shared.pbrt") == picture_of_file("own.pbrt"));
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

static void test_key_table(void **state)
{
    (void)state;
    enum { KEYS = 5000 };
    ca_key_table table = {0};
    uint32_t number = 7;
    assert_false(ca_key_table_find(&table, 1, &number));
    for (uint32_t i = 0; i < KEYS; i++) {
        const uint64_t key = (uint64_t)(i + 1) << 20;
        assert_false(ca_key_table_find(&table, key, &number));
        assert_true(ca_key_table_add(&table, key, i));
    }
    assert_false(ca_key_table_find(&table, 0, &number));
    assert_int_equal(number, 7);
    for (uint32_t i = 0; i < KEYS; i++) {
        assert_true(ca_key_table_find(&table, (uint64_t)(i + 1) << 20, &number));
        assert_int_equal(number, i);
    }
    assert_int_equal(table.count, KEYS);
    ca_key_table_destroy(&table);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_arrays_are_shared),
        cmocka_unit_test(test_pictures_are_the_same),
        cmocka_unit_test(test_versions),
        cmocka_unit_test(test_failing_allocations),
        cmocka_unit_test(test_gltf),
        cmocka_unit_test(test_pbrt),
        cmocka_unit_test(test_key_table),
    };
    return cmocka_run_group_tests_name("shared meshes", tests, make_folder, remove_folder);
}
