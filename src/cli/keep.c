#define _POSIX_C_SOURCE 200809L /* st_mtim */
#include "cli/keep.h"

#include "base/file.h"
#include "base/memory.h"
#include "cli/say.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOST_NUMBERS = 1000, ROOM_FOR_ENDING = 32 };

/* "X.part" becomes "X-2.part" and so on. */
static void number(char *path, const char *stem, int n)
{
    if (n < 2)
        snprintf(path, strlen(stem) + ROOM_FOR_ENDING, "%s.part", stem);
    else
        snprintf(path, strlen(stem) + ROOM_FOR_ENDING, "%s-%d.part", stem, n);
}

/* The numbers that are there. */
typedef struct numbers {
    int free, newest, last; /* the lowest that is free; 0: none is there; likewise */
    bool are_there[MOST_NUMBERS + 1];
} numbers;

static bool is_newer(const struct stat *a, const struct stat *b)
{
    if (a->st_mtim.tv_sec != b->st_mtim.tv_sec) return a->st_mtim.tv_sec > b->st_mtim.tv_sec;
    return a->st_mtim.tv_nsec >= b->st_mtim.tv_nsec;
}

/* The numbers of all names in the folder that may be such, all numbers where it cannot be listed: to ask for a
 * thousand names takes long on other machines' disks. */
static void list_numbers(char *path, const char *stem, bool may_be_there[MOST_NUMBERS + 1])
{
    const char *slash = strrchr(stem, '/'), *base = slash ? slash + 1 : stem;
    snprintf(path, strlen(stem) + ROOM_FOR_ENDING, "%.*s", (int)(base - stem), stem);
    DIR *folder = opendir(slash ? path : ".");
    for (int n = 1; n <= MOST_NUMBERS; n++) may_be_there[n] = !folder;
    if (!folder) return;
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        if (strncmp(entry->d_name, base, strlen(base)) != 0) continue;
        const char *ending = entry->d_name + strlen(base);
        const long n = ending[0] == '-' ? strtol(ending + 1, NULL, 10) : 1;
        if (n >= 1 && n <= MOST_NUMBERS) may_be_there[n] = true;
    }
    closedir(folder);
}

static numbers look(char *path, const char *stem)
{
    numbers found = {0};
    struct stat newest = {0}, info;
    list_numbers(path, stem, found.are_there);
    for (int n = 1; n <= MOST_NUMBERS; n++) {
        number(path, stem, n);
        found.are_there[n] = found.are_there[n] && stat(path, &info) == 0;
        if (!found.are_there[n] && found.free == 0) found.free = n;
        if (!found.are_there[n]) continue;
        found.last = n;
        if (found.newest != 0 && !is_newer(&info, &newest)) continue;
        found.newest = n;
        newest = info;
    }
    return found;
}

/* The numbers beside the newest. */
static ca_status list_others(ca_keep *keep, const char *stem, const numbers *found, ca_error *error)
{
    const size_t size = strlen(stem) + ROOM_FOR_ENDING;
    size_t count = 0, used = 0;
    for (int n = 1; n <= found->last; n++) count += found->are_there[n] && n != found->newest;
    if (count == 0) return CA_OK;
    keep->others = ca_alloc(count, size + strlen(", "));
    if (!keep->others) return ca_fail_memory(error, "the command line");
    for (int n = 1; n <= found->last; n++) {
        if (!found->are_there[n] || n == found->newest) continue;
        if (used > 0) used += (size_t)sprintf(keep->others + used, ", ");
        number(keep->others + used, stem, n);
        used += strlen(keep->others + used);
    }
    return CA_OK;
}

/* Temporary files of killed renders, also of the number that one of them would have made next. */
static void tell_leftovers(char *path, const char *stem, const numbers *found)
{
    for (int n = 1; n <= found->last + 1; n++) {
        number(path, stem, n);
        ca_output_tell_leftovers(path);
    }
}

/* Without a name that was asked for: the newest number where the render goes on, else the lowest that is free; where
 * there is none the first of all. */
static ca_status choose_number(ca_keep *keep, const char *stem, ca_error *error)
{
    const numbers found = look(keep->path, stem);
    tell_leftovers(keep->path, stem, &found);
    const int chosen = keep->resume ? found.newest : found.free;
    keep->number = chosen > 0 ? chosen : 1;
    number(keep->path, stem, keep->number);
    if (found.newest == 0) return CA_OK;
    keep->existing = ca_alloc(strlen(stem) + ROOM_FOR_ENDING, 1);
    if (!keep->existing) return ca_fail_memory(error, "the command line");
    number(keep->existing, stem, found.newest);
    return list_others(keep, stem, &found, error);
}

static ca_status choose_name(ca_keep *keep, const char *stem, ca_error *error)
{
    keep->path = ca_alloc(strlen(stem) + ROOM_FOR_ENDING, 1);
    if (!keep->path) return ca_fail_memory(error, "the command line");
    number(keep->path, stem, 1);
    return keep->wanted ? CA_OK : choose_number(keep, stem, error);
}

static char *stem_of(const ca_keep *keep, const char *first_output)
{
    const char *base = keep->wanted ? keep->wanted : first_output;
    const size_t ending = keep->wanted ? strlen(".part") : 0, length = strlen(base) - ending;
    char *stem = ca_alloc(length + ROOM_FOR_ENDING, 1);
    const char *end = keep->wanted ? "" : ".checkpoint";
    if (stem) snprintf(stem, length + ROOM_FOR_ENDING, "%.*s%s", (int)length, base, end);
    return stem;
}

static bool ends_in_part(const char *path)
{
    const size_t length = strlen(path);
    return length > strlen(".part") && strcmp(path + length - strlen(".part"), ".part") == 0;
}

ca_status ca_keep_choose(ca_keep *keep, const char *first_output, ca_places *places, ca_error *error)
{
    if (keep->wanted && !ends_in_part(keep->wanted))
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL, "--checkpoint: the name must end in .part, not \"%.300s\"",
                       keep->wanted);
    keep->places = places;
    keep->stem = stem_of(keep, first_output);
    if (!keep->stem) return ca_fail_memory(error, "the command line");
    ca_status status = choose_name(keep, keep->stem, error);
    if (status == CA_OK) status = ca_places_write(places, keep->path, "--checkpoint", error);
    if (status == CA_OK && keep->wanted) status = ca_output_check_place(keep->path, error);
    return status;
}

void ca_keep_destroy(ca_keep *keep)
{
    ca_free(keep->path);
    ca_free(keep->stem);
    ca_free(keep->existing);
    ca_free(keep->others);
}

/* No file is there, and none that this render reads or writes will be. */
static bool is_free(const ca_keep *keep)
{
    struct stat info;
    return stat(keep->path, &info) != 0 && ca_places_check(keep->places, keep->path, "--checkpoint", NULL) == CA_OK;
}

const char *ca_keep_take_next(ca_keep *keep)
{
    for (int n = keep->number + 1; n <= MOST_NUMBERS; n++) {
        number(keep->path, keep->stem, n);
        if (!is_free(keep)) continue;
        keep->number = n;
        ca_say(stderr, "caustica: another render has taken the name of this one's checkpoint: this one keeps %s\n",
               keep->path);
        return keep->path;
    }
    number(keep->path, keep->stem, keep->number);
    return NULL;
}

void ca_keep_fill(const ca_keep *keep, ca_render_settings *settings)
{
    settings->checkpoint_path = keep->path;
    settings->checkpoint_seconds = keep->seconds;
    settings->checkpoint_if_long = !keep->wanted && keep->seconds == 0.0;
    settings->resume = keep->resume;
}

void ca_keep_tell(const ca_keep *keep, bool quiet)
{
    if (!keep->existing && keep->resume && !keep->wanted && !quiet)
        ca_say(stderr,
               "caustica: there is no %s: the render begins anew (--checkpoint tells the name of another one)\n",
               keep->path);
    if (!keep->existing) return;
    if (!keep->resume)
        ca_say(stderr,
               "caustica: %s is there already, of a render that did not end or is at work: --resume goes on from it; "
               "this render keeps %s\n",
               keep->existing, keep->path);
    else if (keep->others)
        ca_say(stderr, "caustica: goes on from %s, the newest; older ones stay: %s\n", keep->existing, keep->others);
    else if (!quiet)
        ca_say(stderr, "caustica: goes on from %s\n", keep->existing);
}

void ca_keep_end(const ca_keep *keep, const ca_render_statistics *statistics)
{
    if (keep->wanted || statistics->interrupted || !statistics->keeps_checkpoint) return;
    /* Another render may be going on from it already. */
    ca_file_lock lock;
    bool taken;
    ca_error error;
    if (ca_file_lock_take(&lock, keep->path, &taken, &error) != CA_OK || !taken) return;
    unlink(keep->path);
    ca_file_lock_release(&lock);
}
