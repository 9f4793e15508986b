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

/* "NAME.~abc123", as file.c makes them; of any NAME where `target` is NULL. */
static bool is_temporary_of(const char *name, const char *target)
{
    const size_t mark = sizeof CA_FILE_TEMPORARY_MARK - 1, end = mark + CA_FILE_TEMPORARY_LETTERS;
    const size_t whole = strlen(name), length = whole > end ? whole - end : 0;
    if (length == 0 || strncmp(name + length, CA_FILE_TEMPORARY_MARK, mark) != 0) return false;
    if (target && (strlen(target) != length || strncmp(name, target, length) != 0)) return false;
    return strspn(name + length + mark, "abcdefghijklmnopqrstuvwxyz0123456789") == CA_FILE_TEMPORARY_LETTERS;
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

/* `before`: the folder's name and a slash, or nothing. */
static void search(const char *before, const char *target, void (*found)(const char *path, void *user), void *user)
{
    char path[4096];
    DIR *folder = opendir(*before ? before : ".");
    if (!folder) return;
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        if (!is_temporary_of(entry->d_name, target) || !is_left(dirfd(folder), entry->d_name)) continue;
        const int whole = snprintf(path, sizeof path, "%s%s", before, entry->d_name);
        if (whole > 0 && (size_t)whole < sizeof path) found(path, user);
    }
    closedir(folder);
}

static void search_beside(const char *target, void (*found)(const char *path, void *user), void *user)
{
    const char *slash = strrchr(target, '/');
    const int length = slash ? (int)(slash - target) + 1 : 0;
    char before[4096];
    const int whole = snprintf(before, sizeof before, "%.*s", length, target);
    if (whole >= 0 && (size_t)whole < sizeof before) search(before, target + length, found, user);
}

void ca_leftovers_find(const char *path, void (*found)(const char *path, void *user), void *user)
{
    char *target = ca_path_follow(path);
    if (target) search_beside(target, found, user);
    ca_free(target);
}

void ca_leftovers_find_in(const char *folder, void (*found)(const char *path, void *user), void *user)
{
    char before[4096];
    const size_t length = strlen(folder);
    const char *slash = length > 0 && folder[length - 1] == '/' ? "" : "/";
    const int whole = snprintf(before, sizeof before, "%s%s", folder, slash);
    if (whole > 0 && (size_t)whole < sizeof before) search(before, NULL, found, user);
}
