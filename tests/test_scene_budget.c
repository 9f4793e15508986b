/* What reading a scene may take: small files that take much are refused, with the place and the way to raise it, and
 * files that are worth it are read. */
#define _POSIX_C_SOURCE 200809L
#include "base/memory.h"
#include "caustica.h"
#include "import/import.h"
#include "support/sample_files.h"
#include "support/sample_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

#define START "<scene version='3.0.0'>"
#define SENSOR                                                                                                       \
    "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='4'/>"                              \
    "<integer name='height' value='4'/></film></sensor>"

static void write_text(const char *name, const char *text) { sample_write(path_to(name), text, strlen(text)); }

static ca_status load(const char *name, double mib, ca_error *error)
{
    ca_scene *scene;
    const ca_scene_source source = {.path = path_to(name), .memory_mib = mib};
    const ca_status status = ca_scene_parse(&source, &scene, error);
    if (status == CA_OK) ca_scene_release(scene);
    return status;
}

static void assert_says(const ca_error *error, const char *words)
{
    if (!strstr(error->message, words)) fail_msg("\"%s\" is not said in: %s", words, error->message);
}

/* A picture of one colour packs a thousandfold. */
static void write_bomb(const char *name, uint32_t side)
{
    sample_bytes png = {0}, header = {0};
    const size_t row = 1 + (size_t)side * 3, size = row * side;
    unsigned char *samples = calloc(size, 1);
    uLongf packed_size = compressBound(size);
    unsigned char *packed = malloc(packed_size);
    assert_true(samples && packed && compress(packed, &packed_size, samples, size) == Z_OK);
    static const unsigned char mark[8] = {137, 80, 78, 71, 13, 10, 26, 10}, kind[5] = {8, 2, 0, 0, 0};
    sample_append(&png, mark, 8);
    sample_big_endian(&header, side, 4);
    sample_big_endian(&header, side, 4);
    sample_append(&header, kind, 5);
    sample_png_chunk(&png, "IHDR", header.data, header.size);
    sample_png_chunk(&png, "IDAT", packed, packed_size);
    sample_png_chunk(&png, "IEND", "", 0);
    sample_write(path_to(name), png.data, png.size);
    sample_free(&png);
    sample_free(&header);
    free(samples);
    free(packed);
}

/* 2048 x 2048 floats of 3 channels are 48 MiB, from 12 kB. */
static void test_picture(void **state)
{
    (void)state;
    ca_error error = {""};
    write_bomb("bomb.png", 2048);
    write_text("bomb.xml", START SENSOR "\n <shape type='rectangle'><bsdf type='diffuse'><texture type='bitmap' "
                                        "name='reflectance'><string name='filename' value='bomb.png'/></texture>"
                                        "</bsdf></shape></scene>");
    assert_int_equal(load("bomb.xml", 0.0, &error), CA_OK);
    assert_int_equal(load("bomb.xml", 30.0, &error), CA_ERROR_MEMORY);
    assert_says(&error, "bomb.xml:2:");
    assert_says(&error, "image: reading this takes more than the 3");
    assert_says(&error, "CAUSTICA_SCENE_MEMORY");
    assert_int_equal(load("bomb.xml", 80.0, &error), CA_OK);
}

/* A conversion reads within the same limit; what it writes is not counted. */
static void test_conversion(void **state)
{
    (void)state;
    ca_error error = {""};
    ca_scene_desc desc;
    char from[128], to[128];
    snprintf(from, sizeof from, "%s", path_to("bomb.xml"));
    snprintf(to, sizeof to, "%s", path_to("converted.xml"));
    const ca_scene_source strict = {.path = from, .memory_mib = 30.0}, wide = {.path = from, .memory_mib = 80.0};
    assert_int_equal(ca_import_convert(&strict, to, &desc, &error), CA_ERROR_MEMORY);
    assert_says(&error, "bomb.xml:2:");
    assert_says(&error, "CAUSTICA_SCENE_MEMORY");
    assert_int_equal(ca_import_convert(&wide, to, &desc, &error), CA_OK);
    assert_null(ca_memory_budget_exceeded());
    ca_scene_desc_destroy(&desc);
    assert_int_equal(load("converted.xml", 80.0, &error), CA_OK);
}

/* The same file over and over counts once, whatever it grows to. */
static void test_includes(void **state)
{
    (void)state;
    enum { LEVELS = 7, TIMES = 8 };
    ca_error error = {""};
    char text[1024], name[24];
    for (int level = 0; level < LEVELS; level++) {
        size_t used = (size_t)snprintf(text, sizeof text, START);
        for (int i = 0; i < TIMES; i++)
            used +=
                (size_t)snprintf(text + used, sizeof text - used,
                                 level == 0 ? "<default name='a%d' value='x'/>" : "<include filename='level%d.xml'/>",
                                 level == 0 ? i : level - 1);
        snprintf(text + used, sizeof text - used, "</scene>");
        snprintf(name, sizeof name, "level%d.xml", level);
        write_text(name, text);
    }
    assert_int_not_equal(load("level6.xml", 0.0, &error), CA_OK); /* more includes than there may be */
    assert_true(error.message[0]);
    static char shapes[80000];
    size_t used = (size_t)snprintf(shapes, sizeof shapes, START);
    for (int i = 0; i < 1500; i++)
        used += (size_t)snprintf(shapes + used, sizeof shapes - used, "<shape type='sphere'/>");
    snprintf(shapes + used, sizeof shapes - used, "</scene>");
    write_text("shapes.xml", shapes);
    used = (size_t)snprintf(shapes, sizeof shapes, START SENSOR);
    for (int i = 0; i < 100; i++)
        used += (size_t)snprintf(shapes + used, sizeof shapes - used, "<include filename='shapes.xml'/>");
    snprintf(shapes + used, sizeof shapes - used, "</scene>");
    write_text("many.xml", shapes);
    assert_int_equal(load("many.xml", 20.0, &error), CA_ERROR_MEMORY);
    assert_says(&error, "shapes.xml:1:");
    assert_says(&error, "reading this takes more than the 2");
}

/* Memory of what is read and freed again is not counted; a large file brings its own room. */
static void test_in_proportion(void **state)
{
    (void)state;
    enum { VERTICES = 200000 };
    ca_error error = {""};
    sample_bytes ply = {0};
    char line[128];
    sample_text(&ply, "ply\nformat binary_little_endian 1.0\n");
    snprintf(line, sizeof line, "element vertex %d\n", VERTICES);
    sample_text(&ply, line);
    sample_text(&ply, "property float x\nproperty float y\nproperty float z\n");
    snprintf(line, sizeof line, "element face %d\n", VERTICES / 3);
    sample_text(&ply, line);
    sample_text(&ply, "property list uchar int vertex_indices\nend_header\n");
    for (int i = 0; i < 3 * VERTICES; i++) sample_f32(&ply, (float)(i % 97) * 0.01f);
    for (uint32_t i = 0; i < VERTICES / 3; i++) {
        sample_u8(&ply, 3);
        for (uint32_t c = 0; c < 3; c++) sample_u32(&ply, 3 * i + c);
    }
    sample_write(path_to("large.ply"), ply.data, ply.size);
    sample_free(&ply);
    write_text("large.xml",
               START SENSOR "<shape type='ply'><string name='filename' value='large.ply'/></shape></scene>");
    assert_int_equal(load("large.xml", 1.0, &error), CA_OK);
}

static void test_budget_of_memory(void **state)
{
    (void)state;
    ca_memory_budget budget = {.limit = 100000, .per_byte = 10, .way = "ask"};
    ca_error error = {""};
    ca_memory_budget_begin(&budget);
    void *a = ca_alloc(60000, 1);
    assert_non_null(a);
    assert_null(ca_alloc_zeroed(60000, 1));
    assert_non_null(ca_memory_budget_exceeded());
    ca_free(a);
    for (int i = 0; i < 10; i++) {
        a = ca_alloc_large(60000, 1);
        assert_non_null(a);
        ca_free(a);
    }
    ca_memory_budget_read(7, 10000);
    a = ca_alloc(150000, 1);
    assert_non_null(a);
    for (int i = 0; i < 1000; i++) ca_memory_budget_read(7, 10000);
    assert_null(ca_alloc(100000, 1));
    assert_int_equal(ca_fail_memory(&error, "it"), CA_ERROR_MEMORY);
    assert_string_equal(error.message, "it: reading this takes more than the 0 MiB of memory that are allowed; ask");
    for (uint64_t i = 1; i < 1000; i++) ca_memory_budget_read(i << 32, 10);
    assert_true(budget.limit == 200000 + 999 * 100);
    ca_free(a);
    size_t capacity = 0;
    uint32_t *array = NULL;
    for (uint32_t i = 0; i < 40000; i++) {
        uint32_t *grown = ca_array_grow(array, &capacity, i + 1, sizeof *grown);
        assert_non_null(grown);
        array = grown;
    }
    assert_null(ca_array_grow(array, &capacity, 100000, sizeof *array));
    ca_free(array);
    assert_int_equal(budget.used, 0);
    ca_memory_budget_end();
    assert_null(ca_memory_budget_exceeded());
    ca_fail_memory(&error, "it");
    assert_string_equal(error.message, "out of memory: it");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_picture),
        cmocka_unit_test(test_conversion),
        cmocka_unit_test(test_includes),
        cmocka_unit_test(test_in_proportion),
        cmocka_unit_test(test_budget_of_memory),
    };
    return cmocka_run_group_tests_name("scene budget", tests, make_folder, remove_folder);
}
