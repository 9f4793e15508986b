/* How far long work of a thread is, for those who show it: reading the files of a scene, preparing and building it.
 *
 * Who does the work tells now and then; who wants to see it has a function called, in the same thread. Where nobody
 * looks telling costs a comparison. What other threads help with is told by the first alone. */
#ifndef CA_BASE_LOADING_H
#define CA_BASE_LOADING_H

#include <stddef.h>

/* `what` is one of the words of ca_loading_step, perhaps with the name of a file: "reading dragon.ply". `fraction` of
 * that kind of work is done; negative: nobody knows. */
typedef void (*ca_loading_look)(const char *what, double fraction, void *user);

/* Looks at this thread's work from now on, until the end; there is one at a time. */
void ca_loading_begin(ca_loading_look look, void *user);
void ca_loading_end(void);

/* The work called `what` has so many steps (0: nobody knows), of which so many are done. */
void ca_loading_step(const char *what, size_t done, size_t count);
/* The step's file, whose reading begins. */
void ca_loading_file(const char *path);
/* What is told next of the step is of its part between these fractions; a new step is whole again. */
void ca_loading_part(double from, double to);
/* So much of the step, or of its part, is done. */
void ca_loading_tell(double fraction);

#endif
