/* JSON files that cannot be written: the message has the cause. The source is the program's, not the library's, so it
 * is compiled into this test. */
#define _POSIX_C_SOURCE 200809L
#include "base/memory.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmocka.h>

#include "cli/json_values.c"

enum { LONG = 4000, SHORT = 4 };

/* So many numbers: with LONG more than a stream keeps in memory. */
static json_t *numbers(int count)
{
    ca_json_begin();
    json_t *list = json_array();
    for (int i = 0; i < count; i++) assert_int_equal(json_array_append_new(list, ca_json_number(i + 0.5)), 0);
    return list;
}

static void make_path(char path[64])
{
    strcpy(path, "/tmp/json-values-XXXXXX");
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
}

static void expect_old_file(const char *path)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    assert_int_equal(fgetc(file), EOF); /* it was empty */
    fclose(file);
    unlink(path);
}

/* A limit of the size of files stands for a full disk. */
static void test_full_disk(void **state)
{
    (void)state;
    static const int counts[] = {SHORT, LONG};
    for (int i = 0; i < 2; i++) {
        struct rlimit before, limit;
        char path[64];
        ca_error error = {""};
        make_path(path);
        assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
        limit = before;
        limit.rlim_cur = 16;
        signal(SIGXFSZ, SIG_IGN);
        json_t *root = numbers(counts[i]);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
        const ca_status status = ca_json_write(path, root, true, &error);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
        assert_int_equal(status, CA_ERROR_FILE);
        assert_non_null(strstr(error.message, path));
        assert_non_null(strstr(error.message, ": cannot write: File too large"));
        expect_old_file(path);
    }
}

static void test_folder_that_is_missing(void **state)
{
    (void)state;
    ca_error error = {""};
    assert_int_equal(ca_json_write("/nowhere/at/all.json", numbers(SHORT), true, &error), CA_ERROR_FILE);
    assert_string_equal(error.message, "/nowhere/at/all.json: cannot write: No such file or directory");
}

/* At every allocation of writing, whoever asks: jansson's own too. */
static void test_out_of_memory(void **state)
{
    (void)state;
    int failures = 0;
    for (long allowed = 0; allowed < 1000; allowed++) {
        char path[64];
        ca_error error = {""};
        make_path(path);
        json_t *root = numbers(SHORT);
        json_array_append_new(root, json_pack("{s: {s: i}}", "outer", "inner", 1));
        ca_memory_fail_after(allowed);
        const ca_status status = ca_json_write(path, root, true, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) {
            unlink(path);
            break;
        }
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_non_null(strstr(error.message, "out of memory"));
        expect_old_file(path);
        failures++;
    }
    assert_true(failures > 2 && failures < 1000); /* the writer's two names, and jansson's part */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_folder_that_is_missing),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests_name("JSON files", tests, NULL, NULL);
}
