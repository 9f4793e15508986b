/* How far long work of a thread is, for those who show it, and whether it is still wanted: reading the files of a
 * scene, preparing and building it, developing a picture.
 *
 * Who does the work tells now and then; who wants to see it has a function called, in the same thread. Where nobody
 * looks telling costs a comparison. What other threads help with is told by the first alone. */
#ifndef CA_BASE_LOADING_H
#define CA_BASE_LOADING_H

#include "base/stop.h"

#include <stddef.h>

/* `what` is one of the words of ca_loading_step, perhaps with the name of a file: "reading dragon.ply". `fraction` of
 * that kind of work is done; negative: nobody knows. */
typedef void (*ca_loading_look)(const char *what, double fraction, void *user);

/* Looks at this thread's work from now on, until the end; there is one at a time. */
void ca_loading_begin(ca_loading_look look, void *user);
void ca_loading_end(void);

/* Nobody wants this thread's work any more once *stop is set (base/stop.h); NULL: it is wanted whatever happens.
 * Returns what was said before, which whose work ends says again. */
const int *ca_loading_until(const int *stop);
const int *ca_loading_wanted_until(void);
/* CA_ERROR_INTERRUPTED where nobody wants it any more. Long work asks some ten times a second. */
ca_status ca_loading_check(ca_error *error);

/* The work called `what` has so many steps (0: nobody knows), of which so many are done. */
void ca_loading_step(const char *what, size_t done, size_t count);
/* The step's file, whose reading begins. */
void ca_loading_file(const char *path);
/* What is told next of the step is of its part between these fractions; a new step is whole again. */
void ca_loading_part(double from, double to);
/* So much of the step, or of its part, is done. */
void ca_loading_tell(double fraction);

#endif
