/* Files of checkpoints that are damaged, foreign or cannot be written. */
#define _POSIX_C_SOURCE 200809L
#include "base/file.h"
#include "film/part_stream.h"
#include "render/checkpoint.h"
#include "support/kept_render.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static ca_bytes read_all(const char *name)
{
    ca_bytes bytes;
    assert_int_equal(ca_file_read(file(name), "file", 1 << 24, &bytes, NULL), CA_OK);
    return bytes;
}

static void write_all(const char *name, const unsigned char *data, size_t size)
{
    FILE *stream = fopen(file(name), "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(data, 1, size, stream), size);
    assert_int_equal(fclose(stream), 0);
}

static void expect_format_error(const char *words)
{
    const ca_render_settings s = kept("path", 4, 1);
    ca_image_layers *image;
    ca_error error = {""};
    const char *path = file("c.part");
    refuse_on(scene, &s, CA_ERROR_FORMAT, words);
    assert_int_equal(ca_merge_parts(&path, 1, NULL, &image, NULL, &error), CA_ERROR_FORMAT);
    assert_null(image);
}

static void test_damaged_files(void **state)
{
    (void)state;
    unlink(file("c.part"));
    const ca_render_settings s = kept("path", 2, 1);
    const uint64_t hash = render(&s, NULL);
    ca_bytes bytes = read_all("c.part");
    for (size_t size = 0; size < bytes.size; size += size < 16 ? 1 : size < 600 ? 13 : 9001) {
        write_all("c.part", bytes.data, size);
        expect_format_error(size == 0 ? "not a part file" : size < 8 ? "" : "cut off");
    }
    for (size_t at = 0; at < bytes.size; at += at < 700 ? 7 : 2977) {
        bytes.data[at] ^= 0x10;
        write_all("c.part", bytes.data, bytes.size);
        expect_format_error("");
        bytes.data[at] ^= 0x10;
    }
    bytes.data[8] = 9; /* the number of the format */
    write_all("c.part", bytes.data, bytes.size);
    expect_format_error("of format 9");
    bytes.data[8] = CA_PASS_PART_FORMAT;
    write_all("c.part", bytes.data, bytes.size);
    assert_true(render(&s, NULL) == hash);
    ca_bytes_destroy(&bytes);
    const ca_render_settings blocks = kept("qmcppm", 2, 1);
    refuse_on(scene, &blocks, CA_ERROR_FORMAT, "a part file of passes, not of blocks");
    write_all("c.part", (const unsigned char *)"<scene/>", 8);
    expect_format_error("not a part file");
}

/* One that cannot be written is told, and does not keep the image from being made. */
static bool note_failure(const ca_render_progress *progress, void *user)
{
    assert_non_null(progress->checkpoint_failure);
    return ++*(int *)user < 3;
}

static void test_a_checkpoint_that_cannot_be_written(void **state)
{
    (void)state;
    int failures = 0;
    assert_int_equal(mkdir(file("gone"), 0700), 0);
    ca_render_settings s = kept("path", 0, 1);
    s.checkpoint_path = file("gone/c.part");
    s.checkpoint_seconds = 1e-9;
    s.checkpoint_if_long = true; /* nothing is made before it is due */
    s.seconds = 1e9;
    s.progress = note_failure;
    s.progress_user = &failures;
    assert_int_equal(rmdir(file("gone")), 0);
    ca_image_layers *image;
    ca_error error = {""};
    assert_int_equal(ca_render(scene, &s, &image, NULL, &error), CA_ERROR_FILE);
    assert_non_null(image);
    if (!strstr(error.message, "gone/c.part")) fail_msg("%s", error.message);
    assert_int_equal(failures, 3);
    ca_image_release(image);
}

/* After the second pass, checkpoints have no place any more. */
static bool take_folder_away(const ca_render_progress *progress, void *user)
{
    ca_error *failure = user;
    if (progress->checkpoint_failure)
        snprintf(failure->message, sizeof failure->message, "%s", progress->checkpoint_failure);
    if (progress->passes_done == 2) assert_int_equal(rename(file("gone"), file("away")), 0);
    return true;
}

/* One that nobody asked for is of no use to a whole picture: the caller is told of it while it renders, and that is
 * all. One that was asked for is a failure. */
static void test_a_checkpoint_that_nobody_asked_for(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "qmcppm:radius=0.1"};
    for (int i = 0; i < 4; i++) {
        ca_render_statistics statistics = {.size = sizeof statistics};
        ca_error failure = {""}, error = {""};
        ca_image_layers *image;
        assert_int_equal(mkdir(file("gone"), 0700), 0);
        ca_render_settings s = kept(integrators[i % 2], 1, 1);
        s.checkpoint_path = file("gone/c.part");
        render(&s, NULL);
        s.samples_per_pixel = 4;
        s.checkpoint_seconds = 1e-9;
        s.checkpoint_if_long = i < 2;
        s.progress = take_folder_away;
        s.progress_user = &failure;
        const ca_status expected = s.checkpoint_if_long ? CA_OK : CA_ERROR_FILE;
        if (ca_render(scene, &s, &image, &statistics, &error) != expected) fail_msg("%s", error.message);
        assert_non_null(strstr(s.checkpoint_if_long ? failure.message : error.message, "gone/c.part"));
        assert_true(statistics.keeps_checkpoint && !statistics.interrupted && statistics.samples_per_pixel == 4.0);
        ca_image_release(image);
        unlink(file("away/c.part"));
        unlink(file("away/c.part.lock"));
        assert_int_equal(rmdir(file("away")), 0);
    }
}

static ca_status write_without_sync(void *user, const char *path, ca_error *error)
{
    write_all("c.part", (const unsigned char *)"whole", 5);
    return ++*(int *)user > 1 ? CA_OK : ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot sync its folder", path);
}

/* The file is in its place although writing it failed: it is this render's, and the next write replaces it. */
static void test_a_failed_sync_is_not_the_last_write(void **state)
{
    (void)state;
    int writes = 0;
    unlink(file("c.part"));
    ca_render_settings s = kept("path", 2, 1);
    ca_checkpoint c;
    s.resume = false;
    assert_int_equal(ca_checkpoint_start(&c, &s, NULL), CA_OK);
    ca_checkpoint_write(&c, write_without_sync, &writes);
    assert_non_null(strstr(ca_checkpoint_failure(&c), "cannot sync"));
    ca_checkpoint_write(&c, write_without_sync, &writes);
    if (ca_checkpoint_failure(&c)) fail_msg("%s", ca_checkpoint_failure(&c));
    assert_int_equal(writes, 2);
    ca_checkpoint_end(&c);
    unlink(file("c.part"));
}

/* The names c-2.part, c-3.part and so on, up to a last number. */
typedef struct next_names {
    int number, last;
    char path[256];
} next_names;

static const char *next_name(void *user)
{
    next_names *names = user;
    char name[32];
    if (names->number >= names->last) return NULL;
    snprintf(name, sizeof name, "c-%d.part", ++names->number);
    snprintf(names->path, sizeof names->path, "%s", file(name));
    return names->path;
}

static ca_status write_mine(void *user, const char *path, ca_error *error)
{
    (void)error;
    FILE *stream = fopen(path, "wb");
    assert_non_null(stream);
    fputs(user, stream);
    return fclose(stream) == 0 ? CA_OK : CA_ERROR_FILE;
}

static void expect_text(const char *name, const char *text)
{
    ca_bytes bytes = read_all(name);
    assert_string_equal((const char *)bytes.data, text);
    ca_bytes_destroy(&bytes);
}

/* Of a render that nobody asked to keep: its file is locked when it is first written. */
static ca_render_settings kept_by_itself(next_names *names)
{
    ca_render_settings s = kept("path", 2, 1);
    s.resume = false;
    s.checkpoint_if_long = true;
    s.checkpoint_taken = next_name;
    s.progress_user = names;
    return s;
}

/* Two renders have chosen one name: the second one takes the next that is neither at work nor left by another one.
 * What is there already stays, whoever made it. */
static void test_a_name_that_another_render_has_taken(void **state)
{
    (void)state;
    next_names names = {.number = 1, .last = 9};
    const ca_render_settings s = kept_by_itself(&names);
    ca_checkpoint c;
    ca_file_lock other;
    bool taken;
    unlink(file("c.part"));
    assert_int_equal(ca_checkpoint_start(&c, &s, NULL), CA_OK);
    assert_true(ca_file_lock_take(&other, file("c.part"), &taken, NULL) == CA_OK && taken);
    write_all("c-2.part", (const unsigned char *)"left", 4);
    for (int i = 0; i < 2; i++) {
        ca_checkpoint_write(&c, write_mine, i ? "later" : "first");
        if (ca_checkpoint_failure(&c)) fail_msg("%s", ca_checkpoint_failure(&c));
        assert_int_equal(names.number, 3);
        expect_text("c-3.part", i ? "later" : "first");
    }
    assert_true(c.is_kept && is_there("c-3.part.lock") && !is_there("c-2.part.lock") && !is_there("c.part"));
    expect_text("c-2.part", "left");
    ca_checkpoint_end(&c);
    ca_file_lock_release(&other);
    assert_false(is_there("c-3.part.lock"));
    unlink(file("c-2.part"));
    unlink(file("c-3.part"));
}

/* Where there is no other name, or the name is not the problem, it is an error as ever. */
static void test_names_come_to_an_end(void **state)
{
    (void)state;
    next_names names = {.number = 1, .last = 2};
    ca_render_settings s = kept_by_itself(&names);
    ca_checkpoint c;
    assert_int_equal(ca_checkpoint_start(&c, &s, NULL), CA_OK);
    write_all("c.part", (const unsigned char *)"left", 4);
    write_all("c-2.part", (const unsigned char *)"left", 4);
    ca_checkpoint_write(&c, write_mine, "mine");
    assert_non_null(strstr(ca_checkpoint_failure(&c), "c-2.part: there is a checkpoint already"));
    ca_checkpoint_end(&c);
    expect_text("c.part", "left");
    expect_text("c-2.part", "left");
    assert_int_equal(unlink(file("c-2.part")), 0);
    s.checkpoint_path = file("gone/c.part"); /* there is no such folder */
    names.number = 1;
    assert_int_equal(ca_checkpoint_start(&c, &s, NULL), CA_OK);
    ca_checkpoint_write(&c, write_mine, "mine");
    assert_non_null(strstr(ca_checkpoint_failure(&c), "gone/c.part.lock: cannot lock"));
    ca_checkpoint_end(&c);
    assert_int_equal(names.number, 1);
}

/* One that is gone on from is that one, and none else. */
static void test_what_is_gone_on_from_has_one_name(void **state)
{
    (void)state;
    next_names names = {.number = 1, .last = 9};
    ca_render_settings s = kept_by_itself(&names);
    ca_checkpoint c;
    ca_error error = {""};
    ca_file_lock other;
    bool taken;
    s.resume = true;
    write_all("c.part", (const unsigned char *)"left", 4);
    assert_true(ca_file_lock_take(&other, file("c.part"), &taken, NULL) == CA_OK && taken);
    assert_int_equal(ca_checkpoint_start(&c, &s, &error), CA_ERROR_FILE);
    assert_non_null(strstr(error.message, "c.part: another render is at work with this checkpoint"));
    ca_file_lock_release(&other);
    assert_int_equal(names.number, 1);
    unlink(file("c.part"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_damaged_files),
        cmocka_unit_test(test_a_checkpoint_that_cannot_be_written),
        cmocka_unit_test(test_a_checkpoint_that_nobody_asked_for),
        cmocka_unit_test(test_a_failed_sync_is_not_the_last_write),
        cmocka_unit_test(test_a_name_that_another_render_has_taken),
        cmocka_unit_test(test_names_come_to_an_end),
        cmocka_unit_test(test_what_is_gone_on_from_has_one_name),
    };
    return cmocka_run_group_tests(tests, begin_small_renders, end_small_renders);
}
