/* Runs the program `caustica` as a user would: its words, its exit status, what it printed.
 *
 * The program is $CAUSTICA_PROGRAM, else the one this build made (CA_PROGRAM). Functions fail the cmocka test on
 * errors of their own. */
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

/* A fresh folder to run in, removed by ca_program_folder_remove with all that is in it. */
char *ca_program_folder_create(void);
void ca_program_folder_remove(char *folder);

/* NULL where there is none. */
const char *ca_program_path(void);

/* `words` ends with NULL and does not name the program; `folder` is where it runs. */
void ca_program_run(const char *folder, const char *const words[], ca_program_result *result);

/* The same in two steps, so that something can happen in between. Standard error goes to `error_descriptor`, or to a
 * file in the folder where that is negative. */
pid_t ca_program_start(const char *folder, const char *const words[], int error_descriptor);
void ca_program_finish(const char *folder, pid_t process, ca_program_result *result);

#endif
