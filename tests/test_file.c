/* base/file.h: what is read, what is no file to read, and writes that are seen whole or not at all. */
#define _DEFAULT_SOURCE
#include "base/file.h"
#include "base/leftovers.h"

#include "base/memory.h"
#include "support/sample_files.h"
#include "support/sample_folder.h"

#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

static void assert_refused(const char *path, size_t limit, const char *expected)
{
    ca_bytes bytes;
    ca_error error = {{0}};
    assert_int_equal(ca_file_read(path, "scene", limit, &bytes, &error), CA_ERROR_FILE);
    assert_null(bytes.data);
    if (strncmp(error.message, path, strlen(path)) != 0 || strcmp(error.message + strlen(path), expected) != 0)
        fail_msg("\"%s\" is not PATH\"%s\"", error.message, expected);
}

static void whole_files_up_to_the_limit(void **unused)
{
    (void)unused;
    ca_bytes bytes;
    const char *path = path_to("a");
    sample_write(path, "two\0words", 9);
    assert_int_equal(ca_file_read(path, "scene", 9, &bytes, NULL), CA_OK);
    assert_int_equal(bytes.size, 9);
    assert_memory_equal(bytes.data, "two\0words", 10); /* and the zero behind */
    ca_bytes_destroy(&bytes);
    assert_refused(path, 8, ": a scene of 9 bytes is over the limit of 8");
    sample_write(path, "", 0);
    assert_int_equal(ca_file_read(path, "scene", 0, &bytes, NULL), CA_OK);
    assert_true(bytes.size == 0 && bytes.data[0] == 0);
    ca_bytes_destroy(&bytes);
    assert_refused(path_to("none"), 8, ": cannot open this scene: No such file or directory");
}

/* A pipe that nobody writes to would block an ordinary open for ever: the alarm ends the test then. */
static void what_is_no_regular_file(void **unused)
{
    (void)unused;
    assert_refused(folder, 8, ": not a regular file");
    assert_refused("/dev/zero", 8, ": not a regular file");
    assert_int_equal(mkfifo(path_to("pipe"), 0600), 0);
    alarm(10);
    assert_refused(path_to("pipe"), 8, ": not a regular file");
    alarm(0);
}

static void a_write_is_seen_at_its_commit(void **unused)
{
    (void)unused;
    char path[256];
    snprintf(path, sizeof path, "%s", path_to("w"));
    sample_write(path, "old", 3);
    ca_file_writer writer;
    ca_bytes bytes;
    for (int commits = 0; commits < 2; ++commits) {
        assert_int_equal(ca_file_create(&writer, path, NULL), CA_OK);
        char temporary[256];
        snprintf(temporary, sizeof temporary, "%s", writer.temporary_path);
        fputs("newer", writer.stream);
        fflush(writer.stream);
        assert_int_equal(access(temporary, F_OK), 0);
        if (commits)
            assert_int_equal(ca_file_commit(&writer, NULL), CA_OK);
        else
            ca_file_abandon(&writer);
        assert_int_not_equal(access(temporary, F_OK), 0);
        assert_int_equal(ca_file_read(path, "scene", 8, &bytes, NULL), CA_OK);
        assert_string_equal((char *)bytes.data, commits ? "newer" : "old");
        ca_bytes_destroy(&bytes);
    }
    struct stat info;
    const mode_t mask = umask(0);
    umask(mask);
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0666 & ~mask);
}

static void a_commit_that_fails(void **unused)
{
    (void)unused;
    char path[256];
    snprintf(path, sizeof path, "%s", path_to("taken"));
    assert_int_equal(mkdir(path, 0700), 0); /* a file cannot replace a folder */
    ca_file_writer writer;
    ca_error error = {{0}};
    assert_int_equal(ca_file_create(&writer, path, NULL), CA_OK);
    char temporary[256];
    snprintf(temporary, sizeof temporary, "%s", writer.temporary_path);
    assert_int_equal(ca_file_commit(&writer, &error), CA_ERROR_FILE);
    assert_non_null(strstr(error.message, "/taken: cannot write: "));
    assert_int_not_equal(access(temporary, F_OK), 0);
    assert_int_equal(rmdir(path), 0);
    for (long n = 0; n < 2; ++n) {
        ca_memory_fail_after(n);
        assert_int_equal(ca_file_create(&writer, path, &error), CA_ERROR_MEMORY);
        ca_memory_fail_after(-1);
        assert_int_not_equal(access(path, F_OK), 0);
    }
}

/* The folder cannot be opened as there is no descriptor for it: told, and the file is in its place. */
static void a_folder_that_cannot_be_synced(void **unused)
{
    (void)unused;
    char path[256];
    ca_file_writer writer;
    ca_error error = {{0}};
    struct rlimit before, limited;
    snprintf(path, sizeof path, "%s", path_to("synced"));
    assert_int_equal(ca_file_create(&writer, path, NULL), CA_OK);
    assert_int_equal(getrlimit(RLIMIT_NOFILE, &before), 0);
    limited = before;
    limited.rlim_cur = (rlim_t)fileno(writer.stream); /* the lowest that was free, and will be again */
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &limited), 0);
    const ca_status status = ca_file_commit_durably(&writer, &error);
    assert_int_equal(setrlimit(RLIMIT_NOFILE, &before), 0);
    assert_int_equal(status, CA_ERROR_FILE);
    assert_non_null(strstr(error.message, "/synced: cannot sync its folder: Too many open files"));
    assert_int_equal(unlink(path), 0);
}

/* What fsync says of folders; 0: as it is. */
static int folder_problem;

/* In the C library's place. */
int fsync(int descriptor)
{
    struct stat info;
    if (folder_problem && fstat(descriptor, &info) == 0 && S_ISDIR(info.st_mode)) {
        errno = folder_problem;
        return -1;
    }
    return fdatasync(descriptor);
}

/* Not all file systems sync folders, and say so; one that fails is told of. */
static void a_folder_that_is_not_synced(void **unused)
{
    (void)unused;
    static const struct {
        int problem;
        ca_status expected;
    } cases[] = {{EINVAL, CA_OK}, {ENOTSUP, CA_OK}, {EIO, CA_ERROR_FILE}, {0, CA_OK}};
    char path[256];
    snprintf(path, sizeof path, "%s", path_to("synced"));
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_file_writer writer;
        ca_error error = {{0}};
        assert_int_equal(ca_file_create(&writer, path, NULL), CA_OK);
        folder_problem = cases[i].problem;
        const ca_status status = ca_file_commit_durably(&writer, &error);
        folder_problem = 0;
        assert_int_equal(status, cases[i].expected);
        if (status != CA_OK) assert_non_null(strstr(error.message, "/synced: cannot sync its folder: Input/output"));
        assert_int_equal(unlink(path), 0);
    }
}

/* What stat and readlink say; 0: as it is. */
static int stat_problem, readlink_problem;

/* In the C library's place, as fsync above. */
int stat(const char *path, struct stat *info)
{
    errno = stat_problem;
    return stat_problem ? -1 : fstatat(AT_FDCWD, path, info, 0);
}

ssize_t readlink(const char *path, char *target, size_t size)
{
    errno = readlink_problem;
    return readlink_problem ? -1 : readlinkat(AT_FDCWD, path, target, size);
}

/* Writes to a link that leads to a file of mode 0600, while looking at files has a problem. */
static ca_status write_to_link(int stat_says, int readlink_says, ca_error *error)
{
    ca_file_writer writer;
    stat_problem = stat_says;
    readlink_problem = readlink_says;
    ca_status status = ca_file_create(&writer, path_to("link"), error);
    if (status == CA_OK) status = ca_file_commit(&writer, error);
    stat_problem = readlink_problem = 0;
    return status;
}

/* A disk that fails, or a server that forgot the file, does not make a secret file a new one that all may read, nor
 * a link a file: nothing is written, and the reason is told. */
static void what_cannot_be_looked_at(void **unused)
{
    (void)unused;
    static const int problems[] = {EIO, ESTALE, EACCES};
    struct stat info;
    char secret[256];
    snprintf(secret, sizeof secret, "%s", path_to("secret"));
    sample_write(secret, "mine", 4);
    assert_true(chmod(secret, 0600) == 0 && symlink("secret", path_to("link")) == 0);
    for (size_t i = 0; i < 2 * sizeof problems / sizeof problems[0]; i++) {
        const int problem = problems[i / 2];
        char expected[256];
        ca_error error = {{0}};
        const ca_status status = i % 2 ? write_to_link(problem, 0, &error) : write_to_link(0, problem, &error);
        if (status != CA_ERROR_FILE) fail_msg("%s: %s", strerror(problem), ca_status_name(status));
        snprintf(expected, sizeof expected, "/link: cannot write: %s", strerror(problem));
        if (!strstr(error.message, expected)) fail_msg("\"%s\" is not said in \"%s\"", expected, error.message);
        assert_true(lstat(path_to("link"), &info) == 0 && S_ISLNK(info.st_mode));
        assert_true(lstat(secret, &info) == 0 && info.st_size == 4);
    }
    assert_int_equal(write_to_link(0, 0, NULL), CA_OK);
    assert_true(lstat(path_to("link"), &info) == 0 && S_ISLNK(info.st_mode));
    assert_true(lstat(secret, &info) == 0 && info.st_size == 0 && (info.st_mode & 0777) == 0600);
    assert_true(unlink(path_to("link")) == 0 && unlink(secret) == 0);
}

/* Two steps that are both taken. */
static void failures_are_told_together(void **unused)
{
    (void)unused;
    const ca_error second = {"b: cannot write"};
    ca_error error = {"out of memory: a"};
    assert_int_equal(ca_fail_also(&error, CA_ERROR_MEMORY, CA_OK, &second), CA_ERROR_MEMORY);
    assert_string_equal(error.message, "out of memory: a");
    assert_int_equal(ca_fail_also(&error, CA_ERROR_MEMORY, CA_ERROR_FILE, &second), CA_ERROR_MEMORY);
    assert_string_equal(error.message, "out of memory: a; b: cannot write");
    assert_int_equal(ca_fail_also(&error, CA_OK, CA_ERROR_FILE, &second), CA_ERROR_FILE);
    assert_string_equal(error.message, second.message);
    assert_int_equal(ca_fail_also(NULL, CA_OK, CA_ERROR_FILE, &second), CA_ERROR_FILE);
    for (int i = 0; i < 100; i++) ca_fail_also(&error, CA_ERROR_FILE, CA_ERROR_FILE, &second); /* it has its end */
    assert_true(strlen(error.message) == sizeof error.message - 1);
}

/* One may be written to and not be read: nothing is wrong. Root may always, so that a child is nobody. */
static void a_folder_that_may_not_be_read(void **unused)
{
    (void)unused;
    char path[256];
    snprintf(path, sizeof path, "%s", path_to("box"));
    assert_true(mkdir(path, 0700) == 0 && chmod(path, 0300) == 0 && chmod(folder, 0711) == 0);
    if (getuid() == 0) assert_int_equal(chown(path, 65534, 65534), 0);
    const pid_t child = fork();
    if (child == 0) {
        ca_file_writer writer;
        if (getuid() == 0 && setuid(65534) != 0) _exit(2);
        _exit(ca_file_create(&writer, path_to("box/f"), NULL) == CA_OK &&
                      ca_file_commit_durably(&writer, NULL) == CA_OK
                  ? 0
                  : 1);
    }
    int status = 1;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    assert_true(unlink(path_to("box/f")) == 0 && rmdir(path) == 0);
}

static int left;
static char last_left[512];

static void count_left(const char *path, void *user)
{
    assert_ptr_equal(user, &left);
    left++;
    snprintf(last_left, sizeof last_left, "%s", path);
}

/* A writer that is killed leaves its file, which is found; one at work is not taken for that, nor is anything else.
 * */
static void what_a_kill_leaves(void **unused)
{
    (void)unused;
    char path[256], other[300];
    ca_file_writer writer;
    snprintf(path, sizeof path, "%s", path_to("out.exr"));
    const pid_t child = fork();
    if (child == 0) _exit(ca_file_create(&writer, path, NULL) == CA_OK ? 0 : 1);
    int status = 1;
    assert_true(waitpid(child, &status, 0) == child && status == 0);
    assert_int_equal(ca_file_create(&writer, path, NULL), CA_OK);
    static const char *const names[] = {"out.exr.~abc12", "out.exr.~abc1234", "out.exr.~abc-12", "out.exr.backup"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        FILE *file = fopen(path_to(names[i]), "w");
        assert_non_null(file);
        fclose(file);
    }
    left = 0;
    ca_leftovers_find(path, count_left, &left);
    assert_int_equal(left, 1);
    assert_true(strncmp(last_left, path, strlen(path)) == 0 && strcmp(last_left, writer.temporary_path) != 0);
    assert_int_equal(unlink(last_left), 0);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) unlink(path_to(names[i]));
    ca_leftovers_find(path, count_left, &left);
    snprintf(other, sizeof other, "%s/none/out.exr", path);
    ca_leftovers_find(other, count_left, &left); /* there is no such folder */
    assert_int_equal(left, 1);
    ca_file_abandon(&writer);
}

static void a_scratch_has_no_name(void **unused)
{
    (void)unused;
    char path[256], text[8] = "";
    snprintf(path, sizeof path, "%s", path_to("alone/scratch"));
    assert_int_equal(mkdir(path_to("alone"), 0700), 0);
    FILE *stream;
    ca_error error = {{0}};
    assert_int_equal(ca_file_open_scratch(&stream, path, &error), CA_OK);
    assert_int_equal(rmdir(path_to("alone")), 0); /* it is empty */
    fputs("words", stream);
    assert_int_equal(fseek(stream, 0, SEEK_SET), 0);
    assert_int_equal(fread(text, 1, sizeof text, stream), 5);
    assert_string_equal(text, "words");
    fclose(stream);
    assert_int_equal(ca_file_open_scratch(&stream, path, &error), CA_ERROR_FILE);
    assert_non_null(strstr(error.message, "/alone/scratch: cannot write: No such file or directory"));
    assert_null(stream);
    ca_memory_fail_after(0);
    assert_int_equal(ca_file_open_scratch(&stream, path, &error), CA_ERROR_MEMORY);
    ca_memory_fail_after(-1);
}

static void paths(void **unused)
{
    (void)unused;
    static const char *const cases[][3] = {{"scenes/box/scene.xml", "a.obj", "scenes/box/a.obj"},
                                           {"scene.xml", "a.obj", "a.obj"},
                                           {"/s/scene.xml", "/m/a.obj", "/m/a.obj"},
                                           {NULL, "a.obj", "a.obj"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char *path = ca_path_resolve(cases[i][0], cases[i][1]);
        assert_string_equal(path, cases[i][2]);
        ca_free(path);
    }
    assert_string_equal(ca_path_extension("a.b/c"), "");
    assert_string_equal(ca_path_extension("a.b/c.d.PNG"), ".PNG");
    assert_string_equal(ca_path_extension("none"), "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_files_up_to_the_limit), cmocka_unit_test(what_is_no_regular_file),
        cmocka_unit_test(a_write_is_seen_at_its_commit), cmocka_unit_test(a_commit_that_fails),
        cmocka_unit_test(a_folder_that_cannot_be_synced), cmocka_unit_test(a_folder_that_may_not_be_read),
        cmocka_unit_test(a_folder_that_is_not_synced), cmocka_unit_test(failures_are_told_together),
        cmocka_unit_test(a_scratch_has_no_name),       cmocka_unit_test(paths),
        cmocka_unit_test(what_a_kill_leaves),          cmocka_unit_test(what_cannot_be_looked_at),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
