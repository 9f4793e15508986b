/* Which checkpoint a render of the command line keeps (ca_render_settings.checkpoint_path): the one that was asked
 * for, or by itself OUTPUT.checkpoint.part beside the first output. One that is there already is kept, unless the
 * render goes on from it: the new one gets a number, OUTPUT.checkpoint-2.part; so it does where another render takes
 * the name between the choice and the first write. Of several numbers a render goes on
 * from the newest. */
#ifndef CA_CLI_KEEP_H
#define CA_CLI_KEEP_H

#include "cli/outputs.h"

typedef struct ca_keep {
    const char *wanted; /* --checkpoint; NULL: by itself */
    double seconds;     /* --checkpoint-every; 0: by itself */
    bool resume;
    char *path;     /* owned; that is used; NULL: none */
    char *stem;     /* owned; the path without number and ending */
    int number;     /* of the path; 1: none is in it */
    const ca_places *places; /* borrowed; what else is read and written */
    char *existing; /* owned; the newest that is there by itself; NULL: none, or not looked for */
    char *others;   /* owned; ", " between those that are there beside it; NULL: none */
} ca_keep;

/* Chooses the path, and notes it as written; names what killed renders left beside it. `first_output`: what it is
 * named after. */
ca_status ca_keep_choose(ca_keep *keep, const char *first_output, ca_places *places, ca_error *error);
void ca_keep_destroy(ca_keep *keep);
/* Another render has the file, or left one, since the path was chosen: says that the next number is kept, which
 * `path` becomes in its place. NULL: there is none, and the path stays. */
const char *ca_keep_take_next(ca_keep *keep);

void ca_keep_fill(const ca_keep *keep, ca_render_settings *settings);
/* Offers to go on from one that is there, or says from which of them the render does; with `quiet` only where there
 * are several. */
void ca_keep_tell(const ca_keep *keep, bool quiet);
/* What was rendered is written: one that was kept by itself is not needed any longer, unless the render ended early.
 * One of another render, which began since and has the same name, stays. */
void ca_keep_end(const ca_keep *keep, const ca_render_statistics *statistics);

#endif
