/* Runs of the program in which one call fails, or all from one on (torture/faults.c), and what must hold after each:
 * it ends by itself with exit status 0 or 1; with 0 every output is there, and pictures and parts have the values of
 * a run without faults; with 1 a message names the cause; each output is complete or what it was before; no temporary
 * file is left.
 * Where a library that cannot go on without memory ends the process, outputs are likewise complete or as they
 * were. */
#ifndef CA_TEST_TORTURE_H
#define CA_TEST_TORTURE_H

#include "support/run_program.h"

enum { TORTURE_WORDS = 24, TORTURE_OUTPUTS = 6 };

typedef struct torture_command {
    const char *name;
    const char *words[TORTURE_WORDS];     /* up to NULL */
    const char *outputs[TORTURE_OUTPUTS]; /* files in the program's folder, up to NULL */
    const char *kept;                     /* NULL, or an output that is an input, too: made again before each run
                                             from the file of this name with ".kept" behind */
    const char *folder; /* NULL, or what the outputs are in: not there before a run */
    bool varies;        /* pictures depend on times */
    bool is_exact;      /* pages and statistics do not: they are compared, too */
} torture_command;

typedef enum torture_kind {
    TORTURE_MEMORY,
    TORTURE_FILES,
    TORTURE_THREADS,
    TORTURE_MONITOR,
    TORTURE_FOREIGN_MEMORY,
    TORTURE_FOREIGN_THREADS,
    TORTURE_KINDS
} torture_kind;

const char *torture_kind_name(torture_kind kind);

/* The calls of one command that can fail, in the order in which they are to fail. */
typedef struct torture_calls {
    const torture_command *command;
    torture_kind kind;
    long *numbers; /* owned */
    size_t count;
} torture_calls;

/* Runs the command without a fault. The first call of each call stack, and the first `every` of all. */
void torture_calls_find(torture_calls *calls, const ca_program *program, const torture_command *command,
                        torture_kind kind, long every);
void torture_calls_free(torture_calls *calls);

/* Keeps what the command writes without a fault, to compare with. */
void torture_keep_reference(const ca_program *program, const torture_command *command);

/* Call number `at` fails, and all after it if it `stays`; prints what does not hold, and fails the test where that
 * becomes too much. Returns
 * whether a library ended the process; `site`: then the libraries on the stack of the call, the innermost first. */
bool torture_run(const ca_program *program, const torture_command *command, torture_kind kind, long at, bool stays,
                 char site[256]);

/* Things that did not hold so far. */
int torture_failures(void);

#endif
