#define _POSIX_C_SOURCE 200809L
#include "base/loading.h"

#include <stdio.h>
#include <string.h>

/* Bytes of a file's name that are told. */
enum { MOST_OF_NAME = 60 };

typedef struct looking {
    ca_loading_look look; /* NULL: nobody does */
    void *user;
    const char *word;
    char what[96];
    size_t done, count;
    double from, to; /* the step's part */
} looking;

static _Thread_local looking now;
static _Thread_local const int *wanted_until;

void ca_loading_begin(ca_loading_look look, void *user) { now = (looking){.look = look, .user = user, .word = ""}; }

void ca_loading_end(void) { now = (looking){.look = NULL}; }

const int *ca_loading_until(const int *stop)
{
    const int *before = wanted_until;
    wanted_until = stop;
    return before;
}

const int *ca_loading_wanted_until(void) { return wanted_until; }

ca_status ca_loading_check(ca_error *error) { return ca_stop_check(wanted_until, error); }

void ca_loading_tell(double fraction)
{
    if (!now.look) return;
    const double clamped = fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction;
    const double part = now.from + (now.to - now.from) * clamped;
    now.look(now.what, now.count > 0 ? ((double)now.done + part) / (double)now.count : -1.0, now.user);
}

void ca_loading_part(double from, double to)
{
    now.from = from;
    now.to = to;
}

void ca_loading_step(const char *what, size_t done, size_t count)
{
    if (!now.look) return;
    now.word = what;
    now.done = done;
    now.count = count;
    ca_loading_part(0.0, 1.0);
    snprintf(now.what, sizeof now.what, "%s", what);
    ca_loading_tell(0.0);
}

void ca_loading_file(const char *path)
{
    if (!now.look) return;
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    size_t length = strnlen(name, MOST_OF_NAME);
    while (length == MOST_OF_NAME && length > 0 && ((unsigned char)name[length] & 0xc0) == 0x80) length--;
    snprintf(now.what, sizeof now.what, "%s %.*s", now.word, (int)length, name);
    ca_loading_tell(0.0);
}
