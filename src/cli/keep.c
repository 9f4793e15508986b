#define _POSIX_C_SOURCE 200809L
#include "cli/keep.h"

#include "base/file.h"
#include "base/memory.h"
#include "cli/say.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { MOST_NUMBERS = 1000, ROOM_FOR_ENDING = 32 };

static bool exists(const char *path) { return access(path, F_OK) == 0; }

/* "X.part" becomes "X-2.part" and so on. */
static void number(char *path, const char *stem, int n)
{
    if (n < 2)
        snprintf(path, strlen(stem) + ROOM_FOR_ENDING, "%s.part", stem);
    else
        snprintf(path, strlen(stem) + ROOM_FOR_ENDING, "%s-%d.part", stem, n);
}

/* The first number that is free; where the render goes on, the name was asked for, or none is free, the first of
 * all. */
static ca_status find_free(ca_keep *keep, const char *stem, ca_error *error)
{
    const size_t size = strlen(stem) + ROOM_FOR_ENDING;
    keep->path = ca_alloc(size, 1);
    keep->existing = ca_alloc(size, 1);
    if (!keep->path || !keep->existing) return ca_fail_memory(error, "the command line");
    number(keep->path, stem, 1);
    number(keep->existing, stem, 1);
    const bool taken = !keep->resume && !keep->wanted && exists(keep->path);
    for (int n = 2; taken && exists(keep->path) && n < MOST_NUMBERS; n++) number(keep->path, stem, n);
    if (taken) return CA_OK;
    ca_free(keep->existing);
    keep->existing = NULL;
    return CA_OK;
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
    char *stem = stem_of(keep, first_output);
    if (!stem) return ca_fail_memory(error, "the command line");
    ca_status status = find_free(keep, stem, error);
    ca_free(stem);
    if (status == CA_OK) status = ca_places_write(places, keep->path, "--checkpoint", error);
    if (status == CA_OK && keep->wanted) status = ca_output_check_place(keep->path, error);
    return status;
}

void ca_keep_destroy(ca_keep *keep)
{
    ca_free(keep->path);
    ca_free(keep->existing);
}

void ca_keep_fill(const ca_keep *keep, ca_render_settings *settings)
{
    settings->checkpoint_path = keep->path;
    settings->checkpoint_seconds = keep->seconds;
    settings->checkpoint_if_long = !keep->wanted && keep->seconds == 0.0;
    settings->resume = keep->resume;
}

void ca_keep_tell(const ca_keep *keep)
{
    if (!keep->existing) return;
    ca_say(stderr,
           "caustica: %s is there already, of a render that did not end or is at work: --resume goes on from it; "
           "this render keeps %s\n",
           keep->existing, keep->path);
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
