/* Technique images: what was added comes back from the files; from several threads; splats; what happens when memory
 * or the file system fails. */
#define _POSIX_C_SOURCE 200809L
#include "base/memory.h"
#include "film/splats.h"
#include "film/technique_images.h"
#include "image/layers.h"
#include "support/test_random.h"

#include <dirent.h>
#include <math.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

enum { X0 = 5, Y0 = 3, WIDTH = 19, HEIGHT = 40, PIXELS = WIDTH * HEIGHT };
static const uint32_t crop[4] = {X0, Y0, X0 + WIDTH, Y0 + HEIGHT};
static char root[] = "/tmp/caustica-techniques-XXXXXX"; /* of all folders of this test */

typedef struct path_text {
    char text[512];
} path_text;

static path_text in_root(const char *name)
{
    path_text path;
    snprintf(path.text, sizeof path.text, "%s/%s", root, name);
    return path;
}

static ca_technique_images *create(void)
{
    ca_technique_images *images;
    assert_int_equal(ca_technique_images_create(&images, crop, NULL), CA_OK);
    return images;
}

static void write_to(const ca_technique_images *images, uint32_t passes, const char *folder)
{
    ca_error error = {0};
    if (ca_technique_images_write(images, passes, in_root(folder).text, &error) != CA_OK)
        fail_msg("%s", error.message);
}

static uint32_t files_in(const char *folder)
{
    DIR *directory = opendir(in_root(folder).text);
    assert_non_null(directory);
    uint32_t count = 0;
    for (struct dirent *entry; (entry = readdir(directory));) count += entry->d_name[0] != '.';
    closedir(directory);
    return count;
}

static ca_image_layers *read_back(const char *folder, const char *name)
{
    char path[600];
    snprintf(path, sizeof path, "%s/%s.exr", in_root(folder).text, name);
    ca_image_layers *layers;
    ca_error error = {0};
    if (ca_layers_read(path, &layers, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(layers->width, WIDTH);
    assert_int_equal(layers->height, HEIGHT);
    assert_int_equal(layers->x0, X0);
    assert_int_equal(layers->y0, Y0);
    assert_int_equal(layers->channel_count, 3);
    return layers;
}

static ca_rgb value_at(const ca_image_layers *layers, uint32_t x, uint32_t y)
{
    const size_t i = (size_t)(y - Y0) * WIDTH + (x - X0);
    return (ca_rgb){ca_layers_find(layers, "R")[i], ca_layers_find(layers, "G")[i], ca_layers_find(layers, "B")[i]};
}

static ca_rgb pixel_of(const char *folder, const char *name, uint32_t x, uint32_t y)
{
    ca_image_layers *layers = read_back(folder, name);
    const ca_rgb value = value_at(layers, x, y);
    ca_layers_destroy(layers);
    return value;
}

static void expect(ca_rgb got, float r, float g, float b)
{
    if (!(fabsf(got.r - r) <= 1e-6f * fabsf(r) && fabsf(got.g - g) <= 1e-6f * fabsf(g) &&
          fabsf(got.b - b) <= 1e-6f * fabsf(b)))
        fail_msg("(%g, %g, %g) instead of (%g, %g, %g)", (double)got.r, (double)got.g, (double)got.b, (double)r,
                 (double)g, (double)b);
}

/* ---- Contents -------------------------------------------------------------------------------------------------- */

static void test_round_trip(void **state)
{
    (void)state;
    ca_technique_images *images = create();
    ca_technique_images_add(images, CA_TECHNIQUE_CONNECT, 2, 3, X0, Y0, (ca_rgb){8, 16, 32}, 0.25f);
    ca_technique_images_add(images, CA_TECHNIQUE_CONNECT, 2, 3, X0, Y0, (ca_rgb){8, 16, 32}, 0.75f);
    ca_technique_images_add(images, CA_TECHNIQUE_CONNECT, 2, 3, X0 + WIDTH - 1, Y0 + HEIGHT - 1, (ca_rgb){4, 0, 4},
                            0.5f);
    ca_technique_images_add(images, CA_TECHNIQUE_CONNECT, 3, 2, X0 + 7, Y0 + 9, (ca_rgb){1, 2, 4}, 1.0f);
    ca_technique_images_add(images, CA_TECHNIQUE_MERGE, 2, 3, X0, Y0, (ca_rgb){64, 64, 64}, 0.0f);
    write_to(images, 4, "round-trip");
    assert_int_equal(files_in("round-trip"), 9);

    expect(pixel_of("round-trip", "connect_s2_t3_unweighted", X0, Y0), 4, 8, 16);
    expect(pixel_of("round-trip", "connect_s2_t3_weighted", X0, Y0), 2, 4, 8);
    expect(pixel_of("round-trip", "connect_s2_t3_weight", X0, Y0), 0.5f, 0.5f, 0.5f);
    expect(pixel_of("round-trip", "connect_s2_t3_unweighted", X0 + WIDTH - 1, Y0 + HEIGHT - 1), 1, 0, 1);
    expect(pixel_of("round-trip", "connect_s2_t3_weighted", X0 + WIDTH - 1, Y0 + HEIGHT - 1), 0.5f, 0, 0.5f);
    expect(pixel_of("round-trip", "connect_s2_t3_weight", X0 + 1, Y0), 0, 0, 0);
    expect(pixel_of("round-trip", "connect_s3_t2_weighted", X0 + 7, Y0 + 9), 0.25f, 0.5f, 1);
    expect(pixel_of("round-trip", "connect_s3_t2_weight", X0 + 7, Y0 + 9), 1, 1, 1);
    expect(pixel_of("round-trip", "connect_s3_t2_weighted", X0, Y0), 0, 0, 0);
    expect(pixel_of("round-trip", "merge_s2_t3_unweighted", X0, Y0), 16, 16, 16);
    expect(pixel_of("round-trip", "merge_s2_t3_weight", X0, Y0), 0, 0, 0);

    write_to(images, 1, "round-trip"); /* into the same folder */
    assert_int_equal(files_in("round-trip"), 9);
    expect(pixel_of("round-trip", "connect_s2_t3_weighted", X0, Y0), 8, 16, 32);
    ca_technique_images_destroy(images);
}

/* The weight is that of luminances: what is brighter counts for more. */
static void test_weight_is_of_luminance(void **state)
{
    (void)state;
    ca_technique_images *images = create();
    ca_technique_images_add(images, CA_TECHNIQUE_HIT, 3, 0, X0 + 1, Y0 + 2, (ca_rgb){0, 1, 0}, 1.0f);
    ca_technique_images_add(images, CA_TECHNIQUE_HIT, 3, 0, X0 + 1, Y0 + 2, (ca_rgb){1, 0, 0}, 0.0f);
    write_to(images, 7, "luminance");
    const float weight = 0.7152f / (0.7152f + 0.2126f);
    expect(pixel_of("luminance", "hit_s3_t0_weight", X0 + 1, Y0 + 2), weight, weight, weight);
    ca_technique_images_destroy(images);
}

/* Every technique and length that there may be has a picture of its own. */
static void test_all_pictures(void **state)
{
    (void)state;
    static const char *const names[] = {"hit", "next_event", "connect", "splat", "merge"};
    ca_technique_images *images = create();
    for (uint32_t technique = 0; technique < CA_TECHNIQUE_COUNT; technique++)
        for (uint32_t s = 0; s <= CA_TECHNIQUE_MAX_VERTICES; s += 7)
            for (uint32_t t = 0; t <= CA_TECHNIQUE_MAX_VERTICES; t += 7)
                ca_technique_images_add(images, (ca_technique)technique, s, t, X0, Y0,
                                        (ca_rgb){(float)technique, (float)s, (float)t}, 1.0f);
    write_to(images, 1, "all");
    assert_int_equal(files_in("all"), CA_TECHNIQUE_COUNT * 9 * 3);
    for (uint32_t technique = 0; technique < CA_TECHNIQUE_COUNT; technique++)
        for (uint32_t s = 0; s <= CA_TECHNIQUE_MAX_VERTICES; s += 7)
            for (uint32_t t = 0; t <= CA_TECHNIQUE_MAX_VERTICES; t += 7) {
                char name[64];
                snprintf(name, sizeof name, "%s_s%u_t%u_weighted", names[technique], s, t);
                expect(pixel_of("all", name, X0, Y0), (float)technique, (float)s, (float)t);
            }
    ca_technique_images_destroy(images);
}

static void test_nothing_found(void **state)
{
    (void)state;
    ca_technique_images *images = create();
    write_to(images, 1, "nothing");
    assert_int_equal(files_in("nothing"), 0);
    ca_technique_images_destroy(images);
    ca_technique_images_destroy(NULL);
}

/* ---- Threads --------------------------------------------------------------------------------------------------- */

/* Two threads that come to a new picture at the same moment. */
typedef struct meeting {
    ca_technique_images *images;
    atomic_uint arrived[CA_TECHNIQUE_MAX_VERTICES + 1];
} meeting;

/* Goes on after a while without the other one, if there is but one thread after all. */
static void wait_for_other(atomic_uint *arrived)
{
    atomic_fetch_add(arrived, 1);
    for (int i = 0; i < 100000 && atomic_load(arrived) < 2; i++) sched_yield();
}

static void add_row(void *user, uint32_t row, uint32_t worker)
{
    (void)worker;
    meeting *m = user;
    for (uint32_t t = 2; t <= CA_TECHNIQUE_MAX_VERTICES; t++) {
        wait_for_other(&m->arrived[t]);
        for (uint32_t x = 0; x < WIDTH; x++)
            ca_technique_images_add(m->images, CA_TECHNIQUE_CONNECT, 2, t, X0 + x, Y0 + row,
                                    (ca_rgb){(float)(row + 1), (float)x, (float)t}, 0.5f);
    }
}

/* Neither loses what it found. */
static void test_threads(void **state)
{
    (void)state;
    for (int repeat = 0; repeat < 10; repeat++) {
        meeting m = {.images = create()};
        const ca_parallel parallel = {.workers = 2};
        assert_int_equal(ca_parallel_for(&parallel, 2, add_row, &m, NULL), CA_OK);
        write_to(m.images, 1, "threads");
        assert_int_equal(files_in("threads"), 13 * 3);
        for (uint32_t t = 2; t <= CA_TECHNIQUE_MAX_VERTICES; t++) {
            char name[64];
            snprintf(name, sizeof name, "connect_s2_t%u_unweighted", t);
            ca_image_layers *layers = read_back("threads", name);
            for (uint32_t y = 0; y < 2; y++)
                for (uint32_t x = 0; x < WIDTH; x++)
                    expect(value_at(layers, X0 + x, Y0 + y), (float)(y + 1), (float)x, (float)t);
            ca_layers_destroy(layers);
        }
        ca_technique_images_destroy(m.images);
    }
}

static void splat_into(ca_splat_buffer *buffer, const ca_splat_list *lists, uint32_t workers, const char *folder)
{
    ca_filter filter = ca_filter_default(CA_RFILTER_MITCHELL);
    ca_filter_prepare(&filter);
    ca_technique_images *images = create();
    const ca_parallel parallel = {.workers = workers};
    assert_int_equal(ca_splat_buffer_create(buffer, crop, NULL), CA_OK);
    assert_int_equal(ca_splat_buffer_add(buffer, lists, 3, &filter, 0.25f, images, &parallel, NULL), CA_OK);
    write_to(images, 1, folder);
    ca_technique_images_destroy(images);
}

/* What splats put into the buffer they put into the pictures, weighted: split by length, the same bits for any number
 * of threads; and without the weight where it is unweighted. */
static void test_splats(void **state)
{
    (void)state;
    ca_test_random random = ca_test_random_seed(5);
    ca_splat_list lists[3] = {{0}};
    for (uint32_t i = 0; i < 4000; i++) {
        const uint32_t t = 2 + i % 2;
        const float x = X0 - 2 + (WIDTH + 4) * ca_test_random_float(&random);
        const float y = Y0 - 2 + (HEIGHT + 4) * ca_test_random_float(&random);
        const ca_splat splat = {.film = {x, y},
                                .value = {1.0f + ca_test_random_float(&random), 2.0f, 3.0f},
                                .weight = t == 2 ? 0.5f : 0.125f,
                                .light_vertices = t & 0x3fff};
        assert_true(ca_splat_list_add(&lists[i % 3], &splat));
    }
    ca_splat_buffer one, many;
    splat_into(&one, lists, 1, "splats-1");
    splat_into(&many, lists, 8, "splats-8");
    assert_memory_equal(one.sums, many.sums, (size_t)PIXELS * 3 * sizeof *one.sums);
    assert_int_equal(files_in("splats-1"), 6);

    ca_rgb sum[PIXELS] = {{0}};
    for (uint32_t t = 2; t <= 3; t++) {
        char name[64];
        snprintf(name, sizeof name, "splat_s1_t%u_weighted", t);
        ca_image_layers *weighted = read_back("splats-1", name), *again = read_back("splats-8", name);
        snprintf(name, sizeof name, "splat_s1_t%u_unweighted", t);
        ca_image_layers *unweighted = read_back("splats-1", name);
        for (uint32_t i = 0; i < PIXELS; i++) {
            const ca_rgb value = value_at(weighted, X0 + i % WIDTH, Y0 + i / WIDTH);
            const ca_rgb same = value_at(again, X0 + i % WIDTH, Y0 + i / WIDTH);
            const ca_rgb raw = value_at(unweighted, X0 + i % WIDTH, Y0 + i / WIDTH);
            assert_memory_equal(&value, &same, sizeof value);
            assert_true(fabsf(raw.g * (t == 2 ? 0.5f : 0.125f) - value.g) <= 1e-6f);
            sum[i] = ca_rgb_add(sum[i], value);
        }
        ca_layers_destroy(weighted);
        ca_layers_destroy(unweighted);
        ca_layers_destroy(again);
    }
    for (uint32_t i = 0; i < PIXELS; i++) {
        const ca_rgb got = ca_splat_buffer_at(&one, X0 + i % WIDTH, Y0 + i / WIDTH);
        assert_true(fabsf(sum[i].r - got.r) <= 1e-5f);
        assert_true(fabsf(sum[i].b - got.b) <= 1e-5f);
    }
    ca_splat_buffer_destroy(&one);
    ca_splat_buffer_destroy(&many);
    for (int i = 0; i < 3; i++) ca_splat_list_destroy(&lists[i]);
}

/* ---- Failures -------------------------------------------------------------------------------------------------- */

static void test_no_memory(void **state)
{
    (void)state;
    ca_technique_images *images;
    ca_error error = {0};
    ca_memory_fail_after(0);
    assert_int_equal(ca_technique_images_create(&images, crop, &error), CA_ERROR_MEMORY);
    assert_non_null(strstr(error.message, "technique images"));

    /* A picture that could not be made: said when it is written, though later values found memory. */
    images = create();
    ca_memory_fail_after(0);
    ca_technique_images_add(images, CA_TECHNIQUE_HIT, 2, 0, X0, Y0, (ca_rgb){1, 1, 1}, 1.0f);
    ca_memory_fail_after(-1);
    ca_technique_images_add(images, CA_TECHNIQUE_HIT, 2, 0, X0, Y0, (ca_rgb){1, 1, 1}, 1.0f);
    assert_int_equal(ca_technique_images_write(images, 1, in_root("no-memory").text, &error), CA_ERROR_MEMORY);
    assert_non_null(strstr(error.message, "technique images"));
    ca_technique_images_destroy(images);
}

static void test_no_memory_to_write(void **state)
{
    (void)state;
    ca_technique_images *images = create();
    ca_technique_images_add(images, CA_TECHNIQUE_HIT, 2, 0, X0, Y0, (ca_rgb){1, 1, 1}, 1.0f);
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_error error = {0};
        ca_memory_fail_after(failures);
        status = ca_technique_images_write(images, 1, in_root("failing").text, &error);
        ca_memory_fail_after(-1);
        if (status != CA_OK) assert_true(error.message[0] != '\0');
    }
    assert_true(failures > 9); /* at least four for each picture */
    assert_int_equal(files_in("failing"), 3);
    ca_technique_images_destroy(images);
}

/* The error says which path was to blame. */
static void expect_error(const ca_technique_images *images, const char *folder)
{
    ca_error error = {0};
    assert_int_equal(ca_technique_images_write(images, 1, folder, &error), CA_ERROR_FILE);
    char start[64];
    snprintf(start, sizeof start, "%.60s", folder);
    if (!strstr(error.message, start)) fail_msg("\"%s\" does not name %s", error.message, start);
}

static void test_no_folder(void **state)
{
    (void)state;
    ca_technique_images *images = create();
    ca_technique_images_add(images, CA_TECHNIQUE_HIT, 2, 0, X0, Y0, (ca_rgb){1, 1, 1}, 1.0f);
    expect_error(images, in_root("missing/folder").text);
    expect_error(images, "");
    FILE *file = fopen(in_root("file").text, "w");
    assert_non_null(file);
    fclose(file);
    expect_error(images, in_root("file").text);
    static char long_path[5000];
    memset(long_path, '/', sizeof long_path - 1);
    memcpy(long_path, root, strlen(root)); /* slash after slash is a valid path, only too long */
    expect_error(images, long_path);
    ca_technique_images_destroy(images);
}

static int make_root(void **state)
{
    (void)state;
    return mkdtemp(root) ? 0 : -1;
}

static int remove_root(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", root);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_weight_is_of_luminance),
        cmocka_unit_test(test_all_pictures),
        cmocka_unit_test(test_nothing_found),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_splats),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_no_memory_to_write),
        cmocka_unit_test(test_no_folder),
    };
    return cmocka_run_group_tests(tests, make_root, remove_root);
}
