/* Files: whole reads with a limit, and writes that never leave half a file.
 *
 * A write goes to a temporary file beside the target and is renamed over it when complete: a full disk or a kill
 * leaves the old file as it was (what a kill leaves: leftovers.h). A file that is replaced keeps its mode (others
 * have what the umask leaves); a symbolic link stays, and what it points to is replaced or made. Threads: none is
 * shared. */
#ifndef CA_BASE_FILE_H
#define CA_BASE_FILE_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct ca_bytes {
    unsigned char *data; /* owned; followed by one zero byte, so text can be read as a string */
    size_t size;
} ca_bytes;

/* Opens a regular file for reading and tells its size; the caller closes it. `what` names the kind of file in errors
 * ("mesh"). A pipe is refused, without waiting for its writer. */
ca_status ca_file_open(const char *path, const char *what, FILE **stream, uint64_t *size, ca_error *error);

/* Reads a whole regular file of at most `limit` bytes. */
ca_status ca_file_read(const char *path, const char *what, size_t limit, ca_bytes *bytes, ca_error *error);
void ca_bytes_destroy(ca_bytes *bytes);

/* A temporary file is called as its target, with this mark and so many letters and digits behind it. */
#define CA_FILE_TEMPORARY_MARK ".~"
enum { CA_FILE_TEMPORARY_LETTERS = 6 };

/* An output that becomes visible only at ca_file_commit. */
typedef struct ca_file_writer {
    FILE *stream;         /* open for writing, binary */
    char *path;           /* owned; the target, at the end of symbolic links */
    char *temporary_path; /* owned; where the bytes go until the commit */
} ca_file_writer;

ca_status ca_file_create(ca_file_writer *writer, const char *path, ca_error *error);
/* Flushes, syncs, renames; on any failure the temporary file is removed. The writer is finished either way. */
ca_status ca_file_commit(ca_file_writer *writer, ca_error *error);
/* The same, and when it returns the file's name is on the disk, too: its folder is synced where the file system can
 * (EINVAL and ENOTSUP say that it cannot) and this process may read it. Where that fails the file is in its place. */
ca_status ca_file_commit_durably(ca_file_writer *writer, ca_error *error);
/* Why an earlier write to a stream failed, whose error is not known any more: the error of writing what is left of
 * it, or, where the stream has dropped that, of writing zeros behind it, which fail for the same reason; EIO where
 * neither fails. The file is of no use from then on. */
int ca_file_write_failure(FILE *stream);
/* Removes the temporary file; the writer is finished. */
void ca_file_abandon(ca_file_writer *writer);

/* A lock that one process holds, in a file of its own that goes with it. If the process is killed the lock is free;
 * the file then stays until the next one releases it. So does one that cannot be locked: another process may hold
 * it. */
typedef struct ca_file_lock {
    char *path; /* owned; NULL: nothing is held */
    int descriptor;
} ca_file_lock;

/* Takes the lock PATH.lock. *taken: it is held now; else another process holds it. Where the file system has no locks
 * it counts as held: nothing keeps others away there. */
ca_status ca_file_lock_take(ca_file_lock *lock, const char *path, bool *taken, ca_error *error);
void ca_file_lock_release(ca_file_lock *lock);

/* A file without a name on the disk of `beside`, for writing and reading; gone when it is closed, also by a kill. The
 * caller's to close; NULL on failure. */
ca_status ca_file_open_scratch(FILE **stream, const char *beside, ca_error *error);

/* Which file that is, by whatever name and links. */
typedef struct ca_file_identity {
    uint64_t device, inode;
} ca_file_identity;

/* False where there is no such file. */
bool ca_file_identify(const char *path, ca_file_identity *identity);
/* An order of them: negative, 0 (the same file) or positive; for qsort and bsearch. */
int ca_file_identity_compare(const void *a, const void *b);

/* `path` itself if absolute, else seen from the folder that holds `base_file`. Caller frees with ca_free; NULL
 * when out of memory. */
char *ca_path_resolve(const char *base_file, const char *path);

/* Where a file of this name is, or would be made: the end of the chain of symbolic links that the name may be. Caller
 * frees with ca_free; NULL with errno set where the links have no end (ELOOP), memory is out (ENOMEM), or it is not
 * known whether this is a link (EIO and others). */
char *ca_path_follow(const char *path);

/* The extension with its dot, lower case is the caller's business; "" if there is none. Borrowed from `path`. */
const char *ca_path_extension(const char *path);

#endif
