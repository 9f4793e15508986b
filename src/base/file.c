#define _DEFAULT_SOURCE /* flock */
#include "base/file.h"

#include "base/hash.h"
#include "base/loading.h"
#include "base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static ca_status fail_errno(ca_error *error, const char *path, const char *what)
{
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: %s: %s", path, what, strerror(errno));
}

/* So much at a time that reading can be ended between pieces. Ends early where the file has become shorter. */
static ca_status read_pieces(FILE *stream, const char *path, size_t size, ca_bytes *bytes, ca_error *error)
{
    const size_t most = (size_t)1 << 24;
    size_t got = 1;
    while (got > 0 && bytes->size < size) {
        const size_t left = size - bytes->size;
        CA_TRY(ca_loading_check(error));
        got = fread(bytes->data + bytes->size, 1, left < most ? left : most, stream);
        bytes->size += got;
    }
    return ferror(stream) ? fail_errno(error, path, "cannot read") : CA_OK;
}

static ca_status ask_size(FILE *stream, const char *path, struct stat *info, ca_error *error)
{
    if (fstat(fileno(stream), info) != 0) return fail_errno(error, path, "cannot read");
    if (S_ISREG(info->st_mode) && info->st_size >= 0) return CA_OK;
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: not a regular file", path);
}

static ca_status open_regular(const char *path, const char *what, FILE **stream, struct stat *info, ca_error *error)
{
    /* Without O_NONBLOCK, opening a pipe would wait for its writer before the kind of file can be asked. */
    const int descriptor = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
    *stream = descriptor < 0 ? NULL : fdopen(descriptor, "rb");
    if (!*stream) {
        const int reason = errno;
        if (descriptor >= 0) close(descriptor);
        return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot open this %s: %s", path, what, strerror(reason));
    }
    const ca_status status = ask_size(*stream, path, info, error);
    if (status == CA_OK) return CA_OK;
    fclose(*stream);
    *stream = NULL;
    return status;
}

ca_status ca_file_open(const char *path, const char *what, FILE **stream, uint64_t *size, ca_error *error)
{
    struct stat info;
    CA_TRY(open_regular(path, what, stream, &info, error));
    *size = (uint64_t)info.st_size;
    return CA_OK;
}

static ca_status read_stream(FILE *stream, const char *path, size_t size, ca_bytes *bytes, ca_error *error)
{
    bytes->data = ca_alloc(size + 1, 1);
    if (!bytes->data) return ca_fail_memory(error, path);
    const ca_status status = read_pieces(stream, path, size, bytes, error);
    if (status == CA_OK)
        bytes->data[bytes->size] = 0;
    else
        ca_bytes_destroy(bytes);
    return status;
}

ca_status ca_file_read(const char *path, const char *what, size_t limit, ca_bytes *bytes, ca_error *error)
{
    struct stat info;
    FILE *stream;
    *bytes = (ca_bytes){0};
    ca_loading_file(path);
    CA_TRY(open_regular(path, what, &stream, &info, error));
    ca_status status = CA_OK;
    if ((uint64_t)info.st_size > limit) {
        status = ca_fail(error, CA_ERROR_FILE, NULL, "%s: a %s of %lld bytes is over the limit of %zu", path, what,
                         (long long)info.st_size, limit);
    } else {
        const uint64_t identity = ca_hash_add(ca_hash_add(CA_HASH_START, info.st_dev), info.st_ino);
        ca_memory_budget_read(identity, (size_t)info.st_size);
        status = read_stream(stream, path, (size_t)info.st_size, bytes, error);
    }
    fclose(stream);
    return status;
}

void ca_bytes_destroy(ca_bytes *bytes)
{
    ca_free(bytes->data);
    *bytes = (ca_bytes){0};
}

static void writer_free(ca_file_writer *writer)
{
    ca_free(writer->path);
    ca_free(writer->temporary_path);
    *writer = (ca_file_writer){0};
}

static char *concatenate(const char *a, size_t a_length, const char *b)
{
    const size_t b_length = strlen(b);
    char *text = ca_alloc(a_length + b_length + 1, 1);
    if (!text) return NULL;
    memcpy(text, a, a_length);
    memcpy(text + a_length, b, b_length + 1);
    return text;
}

enum { SUFFIX_LENGTH = CA_FILE_TEMPORARY_LETTERS };

/* Letters that no other writer of this file is likely to take at the same time; O_EXCL sees to it. */
static void fill_suffix(char suffix[SUFFIX_LENGTH], unsigned attempt)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789";
    static atomic_uint count;
    struct timespec now = {0};
    clock_gettime(CLOCK_REALTIME, &now);
    uint64_t value = ca_hash_add(CA_HASH_START, (uint64_t)getpid() << 32 | atomic_fetch_add(&count, 1));
    value = ca_hash_add(ca_hash_add(value, (uint64_t)now.tv_sec), (uint64_t)now.tv_nsec ^ attempt);
    for (int i = 0; i < SUFFIX_LENGTH; i++, value /= sizeof letters - 1)
        suffix[i] = letters[value % (sizeof letters - 1)];
}

/* For leftovers.h; not all file systems can. Who looks whether a writer is alive holds the lock for a moment. */
static void lock_temporary(int descriptor)
{
    const struct timespec moment = {.tv_nsec = 1000000};
    for (int attempt = 0; attempt < 100; attempt++) {
        if (flock(descriptor, LOCK_EX | LOCK_NB) == 0 || (errno != EWOULDBLOCK && errno != EINTR)) return;
        nanosleep(&moment, NULL);
    }
}

/* Is there a file that will be replaced, and with which mode? What cannot be looked at may be there, for few to read:
 * false, and errno says why. */
static bool ask_mode(const char *path, bool *replaces, mode_t *mode)
{
    struct stat info = {0};
    if (stat(path, &info) != 0 && errno != ENOENT && errno != ENOTDIR) return false;
    *replaces = S_ISREG(info.st_mode);
    *mode = *replaces ? info.st_mode & 0777 : 0666;
    return true;
}

/* Replacing a file keeps who may read it; a new one has the rights that the umask leaves, which is not asked for here
 * (asking sets it, for all threads). */
static int open_temporary(ca_file_writer *writer)
{
    bool replaces;
    mode_t mode;
    if (!ask_mode(writer->path, &replaces, &mode)) return -1;
    char *suffix = writer->temporary_path + strlen(writer->temporary_path) - SUFFIX_LENGTH;
    int descriptor = -1;
    errno = EEXIST;
    for (unsigned attempt = 0; attempt < 1000 && descriptor < 0 && errno == EEXIST; attempt++) {
        fill_suffix(suffix, attempt);
        descriptor = open(writer->temporary_path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOCTTY, mode);
    }
    if (descriptor >= 0) lock_temporary(descriptor);
    if (descriptor >= 0 && replaces) (void)fchmod(descriptor, mode);
    return descriptor;
}

static ca_status open_writer(ca_file_writer *writer, const char *path, ca_error *error)
{
    writer->temporary_path = concatenate(writer->path, strlen(writer->path), CA_FILE_TEMPORARY_MARK "XXXXXX");
    if (!writer->temporary_path) return ca_fail_memory(error, path);
    const int descriptor = open_temporary(writer);
    if (descriptor < 0) return fail_errno(error, path, "cannot write");
    writer->stream = fdopen(descriptor, "wb");
    if (writer->stream) return CA_OK;
    const ca_status status = fail_errno(error, path, "cannot write");
    close(descriptor);
    unlink(writer->temporary_path);
    return status;
}

ca_status ca_file_create(ca_file_writer *writer, const char *path, ca_error *error)
{
    *writer = (ca_file_writer){.path = ca_path_follow(path)};
    const ca_status status = writer->path      ? open_writer(writer, path, error)
                             : errno == ENOMEM ? ca_fail_memory(error, path)
                                               : fail_errno(error, path, "cannot write");
    if (status != CA_OK) writer_free(writer);
    return status;
}

int ca_file_write_failure(FILE *stream)
{
    static const char zeros[1 << 16];
    errno = 0;
    if (fflush(stream) != 0 && errno) return errno;
    for (int block = 0; block < 4; block++)
        if (write(fileno(stream), zeros, sizeof zeros) < 0) return errno;
    return EIO;
}

ca_status ca_file_commit(ca_file_writer *writer, ca_error *error)
{
    const bool failed_before = ferror(writer->stream);
    bool good = !failed_before && fflush(writer->stream) == 0 && fsync(fileno(writer->stream)) == 0;
    int reason = failed_before ? ca_file_write_failure(writer->stream) : errno;
    /* The lock stays until the file has its name (-1: it does not). */
    const int locked = fcntl(fileno(writer->stream), F_DUPFD_CLOEXEC, 0);
    if (fclose(writer->stream) != 0 && good) {
        good = false;
        reason = errno;
    }
    if (good && rename(writer->temporary_path, writer->path) != 0) {
        good = false;
        reason = errno;
    }
    if (locked >= 0) close(locked);
    ca_status status = CA_OK;
    if (!good) {
        unlink(writer->temporary_path);
        errno = reason;
        status = fail_errno(error, writer->path, "cannot write");
    }
    writer_free(writer);
    return status;
}

static char *folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? concatenate(path, (size_t)(slash - path) + 1, "") : concatenate(".", 1, "");
}

/* A file system that does not sync folders says so. A folder that may be written but not read cannot be synced by
 * this process: no failure either. */
static ca_status sync_folder(const char *folder, const char *path, ca_error *error)
{
    const int descriptor = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const int reason = descriptor >= 0 && fsync(descriptor) == 0 ? 0 : errno;
    if (descriptor >= 0) close(descriptor);
    const bool is_sealed = descriptor < 0 && reason == EACCES;
    const bool cannot = descriptor >= 0 && (reason == EINVAL || reason == ENOTSUP);
    if (reason == 0 || is_sealed || cannot) return CA_OK;
    return ca_fail(error, CA_ERROR_FILE, NULL, "%s: cannot sync its folder: %s", path, strerror(reason));
}

/* All memory is taken before the file is in its place. */
ca_status ca_file_commit_durably(ca_file_writer *writer, ca_error *error)
{
    char *path = concatenate(writer->path, strlen(writer->path), ""), *folder = folder_of(writer->path);
    ca_status status = CA_ERROR_MEMORY;
    if (path && folder)
        status = ca_file_commit(writer, error);
    else
        ca_fail_memory(error, writer->path), ca_file_abandon(writer);
    if (status == CA_OK) status = sync_folder(folder, path, error);
    ca_free(folder);
    ca_free(path);
    return status;
}

/* ---- Locks ----------------------------------------------------------------------------------------------------- */

/* The file may have been removed, and another one made, between opening and locking it. */
static bool is_still_there(int descriptor, const char *path)
{
    struct stat opened, named;
    return fstat(descriptor, &opened) == 0 && stat(path, &named) == 0 && opened.st_ino == named.st_ino &&
           opened.st_dev == named.st_dev;
}

static bool has_no_locks(int reason) { return reason == ENOLCK || reason == ENOTSUP || reason == ENOSYS; }

/* 0: it is held; EWOULDBLOCK: another process holds it; EINTR: to be tried again; or why not. */
static int try_lock(ca_file_lock *lock)
{
    lock->descriptor = open(lock->path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (lock->descriptor < 0) return errno;
    int reason = flock(lock->descriptor, LOCK_EX | LOCK_NB) == 0 || has_no_locks(errno) ? 0 : errno;
    if (reason == 0 && !is_still_there(lock->descriptor, lock->path)) reason = EINTR;
    if (reason != 0) close(lock->descriptor);
    return reason;
}

ca_status ca_file_lock_take(ca_file_lock *lock, const char *path, bool *taken, ca_error *error)
{
    char *const file = ca_path_follow(path);
    *lock = (ca_file_lock){.path = file ? concatenate(file, strlen(file), ".lock") : NULL};
    *taken = false;
    const bool has_no_end = !file && errno != ENOMEM;
    ca_free(file);
    if (has_no_end) return fail_errno(error, path, "cannot lock");
    if (!lock->path) return ca_fail_memory(error, path);
    int reason = EINTR;
    for (int attempt = 0; attempt < 100 && reason == EINTR; attempt++) reason = try_lock(lock);
    *taken = reason == 0;
    if (*taken) return CA_OK;
    errno = reason;
    const ca_status status = reason == EWOULDBLOCK ? CA_OK : fail_errno(error, lock->path, "cannot lock");
    ca_free(lock->path);
    *lock = (ca_file_lock){0};
    return status;
}

void ca_file_lock_release(ca_file_lock *lock)
{
    if (!lock->path) return;
    unlink(lock->path); /* while it is held: who waits for it notices */
    close(lock->descriptor);
    ca_free(lock->path);
    *lock = (ca_file_lock){0};
}

void ca_file_abandon(ca_file_writer *writer)
{
    if (!writer->stream) return;
    fclose(writer->stream);
    unlink(writer->temporary_path);
    writer_free(writer);
}

ca_status ca_file_open_scratch(FILE **stream, const char *beside, ca_error *error)
{
    *stream = NULL;
    char *name = concatenate(beside, strlen(beside), ".XXXXXX");
    if (!name) return ca_fail_memory(error, beside);
    const int descriptor = mkstemp(name);
    if (descriptor >= 0) *stream = fdopen(descriptor, "w+b");
    const ca_status status = *stream ? CA_OK : fail_errno(error, beside, "cannot write");
    if (descriptor >= 0) unlink(name);
    if (descriptor >= 0 && !*stream) close(descriptor);
    ca_free(name);
    return status;
}

bool ca_file_identify(const char *path, ca_file_identity *identity)
{
    struct stat info;
    if (stat(path, &info) != 0) return false;
    *identity = (ca_file_identity){.device = (uint64_t)info.st_dev, .inode = (uint64_t)info.st_ino};
    return true;
}

int ca_file_identity_compare(const void *a, const void *b)
{
    const ca_file_identity *x = a, *y = b;
    if (x->inode != y->inode) return x->inode < y->inode ? -1 : 1;
    return x->device < y->device ? -1 : x->device > y->device;
}

char *ca_path_resolve(const char *base_file, const char *path)
{
    const char *slash = path[0] == '/' || !base_file ? NULL : strrchr(base_file, '/');
    return slash ? concatenate(base_file, (size_t)(slash - base_file) + 1, path)
                 : concatenate(path, strlen(path), "");
}

/* What the link says, seen from its folder; NULL with errno EINVAL where this is no link, or nothing is there. Of
 * other errors nobody knows what is there. */
static char *read_link(const char *path)
{
    char target[4096];
    const ssize_t length = readlink(path, target, sizeof target);
    if (length < 0) {
        if (errno == ENOENT) errno = EINVAL;
        return NULL;
    }
    if ((size_t)length == sizeof target) {
        errno = ENAMETOOLONG;
        return NULL;
    }
    target[length] = '\0';
    char *resolved = ca_path_resolve(path, target);
    if (!resolved) errno = ENOMEM;
    return resolved;
}

char *ca_path_follow(const char *path)
{
    enum { MOST_LINKS = 40 }; /* as Linux has it */
    char *here = concatenate(path, strlen(path), "");
    for (int i = 0; here && i < MOST_LINKS; i++) {
        char *next = read_link(here);
        const int reason = errno;
        if (!next && reason == EINVAL) return here;
        ca_free(here);
        errno = reason;
        if (!next) return NULL;
        here = next;
    }
    const int reason = here ? ELOOP : ENOMEM;
    ca_free(here);
    errno = reason;
    return NULL;
}

const char *ca_path_extension(const char *path)
{
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash ? slash : path, '.');
    return dot ? dot : "";
}
