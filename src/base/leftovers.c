#define _DEFAULT_SOURCE /* flock */
#include "base/leftovers.h"

#include "base/file.h"
#include "base/memory.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* "NAME.~abc123", as file.c makes them. */
static bool is_temporary_of(const char *name, const char *target)
{
    const size_t length = strlen(target), mark = sizeof CA_FILE_TEMPORARY_MARK - 1;
    if (strncmp(name, target, length) != 0 || strncmp(name + length, CA_FILE_TEMPORARY_MARK, mark) != 0) return false;
    const char *suffix = name + length + mark;
    return strlen(suffix) == CA_FILE_TEMPORARY_LETTERS &&
           strspn(suffix, "abcdefghijklmnopqrstuvwxyz0123456789") == CA_FILE_TEMPORARY_LETTERS;
}

/* A regular file that nobody holds. */
static bool is_left(int folder, const char *name)
{
    struct stat info;
    const int descriptor = openat(folder, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
    if (descriptor < 0) return false;
    const bool left =
        fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode) && flock(descriptor, LOCK_SH | LOCK_NB) == 0;
    close(descriptor);
    return left;
}

static void search(const char *target, void (*found)(const char *path, void *user), void *user)
{
    const char *slash = strrchr(target, '/');
    const int before = slash ? (int)(slash - target) + 1 : 0; /* the folder's name and the slash */
    char path[4096];
    const int length = snprintf(path, sizeof path, "%.*s", before, target);
    DIR *folder = length >= 0 && (size_t)length < sizeof path ? opendir(before > 0 ? path : ".") : NULL;
    if (!folder) return;
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        if (!is_temporary_of(entry->d_name, target + before) || !is_left(dirfd(folder), entry->d_name)) continue;
        const int whole = snprintf(path, sizeof path, "%.*s%s", before, target, entry->d_name);
        if (whole > 0 && (size_t)whole < sizeof path) found(path, user);
    }
    closedir(folder);
}

void ca_leftovers_find(const char *path, void (*found)(const char *path, void *user), void *user)
{
    char *target = ca_path_follow(path);
    if (target) search(target, found, user);
    ca_free(target);
}
