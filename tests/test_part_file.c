/* Part files: everything comes back; whatever is cut off, damaged, too long or not a part file is refused; headers
 * that lie are refused before they can do harm, even with the right hash; a full disk and failures of memory. */
#define _POSIX_C_SOURCE 200809L
#include "base/hash.h"
#include "base/memory.h"
#include "film/part_file.h"
#include "support/scene_text.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 7, HEIGHT = 5, HEADER_BYTES = 288 };
static const char settings_text[] = "version 1\nscene 0123\nseed 4\n";
static const char scene_path[] = "scenes/ünïcode.xml";

static char folder[] = "/tmp/caustica-part-XXXXXX";
static char path[64], other_path[64];

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder)) return -1;
    snprintf(path, sizeof path, "%s/a.part", folder);
    snprintf(other_path, sizeof other_path, "%s/b.part", folder);
    return 0;
}

/* rmdir fails where a temporary file was left behind. */
static int remove_folder(void **state)
{
    (void)state;
    unlink(path);
    unlink(other_path);
    return rmdir(folder);
}

static char *copy_of(const char *text)
{
    char *copy = ca_alloc(strlen(text) + 1, 1);
    assert_non_null(copy);
    return strcpy(copy, text);
}

/* `extras`: 1 gradients, 2 error bars, or both. */
static ca_part make_part(unsigned extras)
{
    ca_test_random random = ca_test_random_seed(5);
    ca_part part = {.settings = copy_of(settings_text),
                    .scene_path = copy_of(scene_path),
                    .blocks = {3, 1000000000000},
                    .seconds = 1.25,
                    .samples_per_pixel = 17,
                    .next_samples = 21,
                    .next_blocks = 1000000000004,
                    .threads = 3};
    for (int i = 0; i < CA_PART_COUNTS; i++) part.counts[i] = UINT64_C(1) << (4 * i);
    const ca_block_film_desc desc = {.full_width = 20,
                                     .full_height = 30,
                                     .crop = {2, 3, 2 + WIDTH, 3 + HEIGHT},
                                     .gradients = extras & 1,
                                     .error_bars = extras & 2,
                                     .extent = 5.0f};
    assert_int_equal(ca_block_film_create(&part.film, &desc, NULL), CA_OK);
    for (uint32_t i = 0; i < 10 * WIDTH * HEIGHT; i++) {
        ca_block_sample sample = {.pairs = 4, .paths = 1, .position = {ca_test_random_float(&random), -1, 2}};
        sample.radiance.r = ldexpf(ca_test_random_float(&random) - 0.2f, (int)(i % 40));
        sample.irradiance_gradient.y = sample.radiance.r;
        sample.covariance = (ca_pair_covariance){1.0, (double)sample.radiance.r, 0.5, 0.25};
        sample.visits_camera = sample.visits_light = i / (WIDTH * HEIGHT);
        assert_true(ca_block_film_add(part.film, 2 + i % WIDTH, 3 + i / WIDTH % HEIGHT, &sample));
    }
    return part;
}

static uint64_t developed_hash(const ca_block_film *film)
{
    ca_image_layers *layers;
    assert_int_equal(ca_block_film_develop(film, 2, &layers, NULL), CA_OK);
    const uint64_t hash = image_hash(layers);
    ca_layers_destroy(layers);
    return hash;
}

/* ---- Bytes of a file ------------------------------------------------------------------------------------------- */

typedef struct file_bytes {
    unsigned char data[30000];
    size_t size;
} file_bytes;

static void read_bytes(const char *from, file_bytes *bytes)
{
    FILE *file = fopen(from, "rb");
    assert_non_null(file);
    bytes->size = fread(bytes->data, 1, sizeof bytes->data, file);
    assert_true(bytes->size < sizeof bytes->data);
    fclose(file);
}

static void write_bytes(const file_bytes *bytes, size_t size)
{
    FILE *file = fopen(other_path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes->data, 1, size, file), size);
    fclose(file);
}

static void write_part_bytes(file_bytes *bytes, unsigned extras)
{
    ca_part part = make_part(extras);
    assert_int_equal(ca_part_write(&part, path, NULL), CA_OK);
    ca_part_destroy(&part);
    read_bytes(path, bytes);
}

/* What was written to the other path must be refused, in words that name the file. */
static void expect_refused(ca_status expected, const char *words)
{
    ca_part part;
    ca_error error = {""};
    assert_int_equal(ca_part_read(other_path, &part, &error), expected);
    assert_true(!part.film && !part.settings && !part.scene_path);
    if (!strstr(error.message, other_path) || !strstr(error.message, words))
        fail_msg("\"%s\" says nothing of \"%s\"", error.message, words);
}

/* ---- Round trips ----------------------------------------------------------------------------------------------- */

static void test_everything_comes_back(void **state)
{
    (void)state;
    for (unsigned extras = 0; extras < 4; extras++) {
        ca_part part = make_part(extras), back;
        assert_int_equal(ca_part_write(&part, path, NULL), CA_OK);
        assert_int_equal(ca_part_read(path, &back, NULL), CA_OK);
        assert_string_equal(back.settings, settings_text);
        assert_string_equal(back.scene_path, scene_path);
        assert_memory_equal(back.blocks, part.blocks, sizeof part.blocks);
        assert_memory_equal(back.counts, part.counts, sizeof part.counts);
        assert_true(back.next_samples == 21.0 && back.next_blocks == 1000000000004);
        assert_true(back.seconds == 1.25 && back.samples_per_pixel == 17.0 && back.threads == 3);
        assert_true(ca_block_film_desc_equal(ca_block_film_described(back.film), ca_block_film_described(part.film)));
        assert_true(developed_hash(back.film) == developed_hash(part.film));
        /* Read and written again it is the same file. */
        file_bytes first, second;
        read_bytes(path, &first);
        assert_int_equal(ca_part_write(&back, path, NULL), CA_OK);
        read_bytes(path, &second);
        assert_int_equal(first.size, second.size);
        assert_memory_equal(first.data, second.data, first.size);
        ca_part_destroy(&part);
        ca_part_destroy(&back);
    }
}

static void test_names(void **state)
{
    (void)state;
    assert_true(ca_part_is_path("a.part") && ca_part_is_path("a/b.PART"));
    assert_false(ca_part_is_path("a.exr") || ca_part_is_path("part") || ca_part_is_path("a.part/b"));
}

/* ---- Damage ---------------------------------------------------------------------------------------------------- */

static void test_cut_off(void **state)
{
    (void)state;
    file_bytes bytes;
    write_part_bytes(&bytes, 3);
    for (size_t size = 0; size < bytes.size; size += size < 2 * HEADER_BYTES ? 1 : 100) {
        write_bytes(&bytes, size);
        expect_refused(CA_ERROR_FORMAT, size == 0 ? "not a part file" : "cut off");
    }
    for (size_t size = bytes.size - 16; size < bytes.size; size++) {
        write_bytes(&bytes, size);
        expect_refused(CA_ERROR_FORMAT, "cut off");
    }
    bytes.data[bytes.size] = 0;
    write_bytes(&bytes, bytes.size + 1);
    expect_refused(CA_ERROR_FORMAT, "damaged");
}

static void test_damaged(void **state)
{
    (void)state;
    file_bytes bytes;
    write_part_bytes(&bytes, 0);
    for (size_t i = 0; i < bytes.size; i += i < 2 * HEADER_BYTES ? 1 : 37) {
        const unsigned char bit = (unsigned char)(1u << i % 8);
        bytes.data[i] ^= bit;
        write_bytes(&bytes, bytes.size);
        expect_refused(CA_ERROR_FORMAT, i < 8 ? "not a part file" : i < 16 ? "of format" : "part file is");
        bytes.data[i] ^= bit;
    }
    /* Bytes that are swapped, rows that are. */
    const size_t row = WIDTH * 208, last = bytes.size - 8 - row;
    for (size_t i = 0; i < row; i++) {
        const unsigned char byte = bytes.data[last + i];
        bytes.data[last + i] = bytes.data[last - row + i];
        bytes.data[last - row + i] = byte;
    }
    write_bytes(&bytes, bytes.size);
    expect_refused(CA_ERROR_FORMAT, "damaged");
}

static void set_field(file_bytes *bytes, size_t field, uint64_t value)
{
    ca_put_u64(bytes->data + 8 + 8 * field, value);
    ca_put_u64(bytes->data + bytes->size - 8, ca_hash_bytes(CA_HASH_START, bytes->data, bytes->size - 8));
}

/* Fields in their order: format, sizes of the file and of two texts, width, height, crop, extras, extent, blocks,
 * seconds, samples, next samples and blocks, threads, counts. Nothing a header says may end in anything but a refusal
 * or a part. */
static void test_lies_with_the_right_hash(void **state)
{
    (void)state;
    enum { FIRST_AMOUNT = 14, LAST_AMOUNT = 16, FIRST_COUNT = 19, FIELDS = 35 };
    static const uint64_t lies[] = {0,
                                    1,
                                    2,
                                    7,
                                    8,
                                    29,
                                    31,
                                    255,
                                    65535,
                                    65536,
                                    65537,
                                    UINT32_MAX,
                                    UINT64_C(1) << 32,
                                    UINT64_C(1) << 61,
                                    INT64_MAX,
                                    UINT64_C(1) << 63,
                                    UINT64_MAX - 7,
                                    UINT64_MAX,
                                    UINT64_C(0x7ff0000000000000), /* infinity */
                                    UINT64_C(0x7ff8000000000000)};
    file_bytes original, bytes;
    write_part_bytes(&original, 3);
    for (size_t field = 0; field < FIELDS; field++)
        for (size_t l = 0; l < sizeof lies / sizeof lies[0]; l++) {
            bytes = original;
            set_field(&bytes, field, lies[l]);
            write_bytes(&bytes, bytes.size);
            ca_part part;
            ca_error error = {""};
            const ca_status status = ca_part_read(other_path, &part, &error);
            assert_true(status == CA_OK || status == CA_ERROR_FORMAT);
            const bool about_size = field >= 1 && field <= 10 && lies[l] != ca_get_u64(original.data + 8 + 8 * field);
            if (about_size && !(field == 4 && lies[l] >= 9 && lies[l] <= 65536) &&
                !(field == 5 && lies[l] >= 8 && lies[l] <= 65536))
                assert_int_equal(status, CA_ERROR_FORMAT);
            const double amount = ca_bits_double(lies[l]);
            if (field >= FIRST_AMOUNT && field <= LAST_AMOUNT)
                assert_int_equal(status, isfinite(amount) && amount >= 0.0 ? CA_OK : CA_ERROR_FORMAT);
            if (field >= FIRST_COUNT) assert_int_equal(status, CA_OK);
            ca_part_destroy(&part);
        }
    bytes = original;
    set_field(&bytes, 12, 0); /* the range of blocks, turned around */
    write_bytes(&bytes, bytes.size);
    ca_part part;
    assert_int_equal(ca_part_read(other_path, &part, NULL), CA_OK);
    ca_part_destroy(&part);
    set_field(&bytes, 13, 0);
    write_bytes(&bytes, bytes.size);
    expect_refused(CA_ERROR_FORMAT, "damaged");
    /* A text that ends too early. */
    bytes = original;
    bytes.data[HEADER_BYTES + 8 + 3] = 0;
    set_field(&bytes, 12, 3);
    write_bytes(&bytes, bytes.size);
    expect_refused(CA_ERROR_FORMAT, "damaged");
}

/* ---- The world's failures -------------------------------------------------------------------------------------- */

static void test_failures_of_the_world(void **state)
{
    (void)state;
    ca_part part = make_part(0), back;
    ca_error error = {""};
    unlink(other_path);
    assert_int_equal(ca_part_read(other_path, &back, &error), CA_ERROR_FILE);
    assert_int_equal(ca_part_read(folder, &back, &error), CA_ERROR_FILE);
    assert_int_equal(ca_part_write(&part, "/nowhere/a.part", &error), CA_ERROR_FILE);
    assert_non_null(strstr(error.message, "/nowhere/a.part"));

    /* A disk with room for 4 KiB: an error, the old file stays, nothing else is left. */
    assert_int_equal(ca_part_write(&part, path, NULL), CA_OK);
    file_bytes before, after;
    read_bytes(path, &before);
    struct rlimit limit, small;
    getrlimit(RLIMIT_FSIZE, &limit);
    small = (struct rlimit){.rlim_cur = 4096, .rlim_max = limit.rlim_max};
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    const ca_status status = ca_part_write(&part, path, &error);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    assert_int_equal(status, CA_ERROR_FILE);
    assert_non_null(strstr(error.message, path));
    read_bytes(path, &after);
    assert_int_equal(before.size, after.size);
    assert_memory_equal(before.data, after.data, before.size);

    /* Texts no file can hold. */
    ca_free(part.settings);
    part.settings = ca_alloc(100001, 1);
    assert_non_null(part.settings);
    memset(part.settings, 'x', 100000);
    part.settings[100000] = '\0';
    assert_int_equal(ca_part_write(&part, path, &error), CA_ERROR_UNSUPPORTED);
    ca_part_destroy(&part);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    ca_part part = make_part(3), back;
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_memory_fail_after(failures);
        status = ca_part_write(&part, path, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
    }
    assert_true(failures >= 4);
    failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_memory_fail_after(failures);
        status = ca_part_read(path, &back, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || (status == CA_ERROR_MEMORY && !back.film));
    }
    assert_true(failures >= 8);
    ca_part_destroy(&back);
    ca_part_destroy(&part);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_everything_comes_back),
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_cut_off),
        cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_lies_with_the_right_hash),
        cmocka_unit_test(test_failures_of_the_world),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
