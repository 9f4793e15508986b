/* Runs the program `caustica` as a user would: its words, its exit status, what it printed. Functions fail the cmocka
 * test on errors of their own. */
#ifndef CA_TEST_RUN_PROGRAM_H
#define CA_TEST_RUN_PROGRAM_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

typedef struct ca_program_result {
    int exit_status; /* -1: ended by a signal */
    int signal;      /* which one, else 0 */
    char output[16384], errors[16384];
} ca_program_result;

/* The program and a fresh folder to run it in. */
typedef struct ca_program {
    const char *path;
    char folder[64];
} ca_program;

/* Takes $CAUSTICA_PROGRAM, else `built` (CA_PROGRAM, what this build made). false where there is none. */
bool ca_program_open(ca_program *program, const char *built);
/* Removes the folder with all that is in it. */
void ca_program_close(ca_program *program);

/* `words` ends with NULL and does not name the program. */
void ca_program_run(const ca_program *program, const char *const words[], ca_program_result *result);

/* The same in two steps, so that something can happen in between. Standard error goes to `error_descriptor`, or to a
 * file in the folder where that is negative. */
pid_t ca_program_start(const ca_program *program, const char *const words[], int error_descriptor);
void ca_program_finish(const ca_program *program, pid_t process, ca_program_result *result);
/* In between: until a file of that name is in the folder, up to 20 seconds. */
void ca_program_wait_for(const ca_program *program, const char *name);

#endif
