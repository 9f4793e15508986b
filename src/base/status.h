/* Failures of the outer world: files, memory, scenes, settings.
 *
 * A function that can fail returns a ca_status and takes a `ca_error *`; on failure the error holds one
 * message fit for a user, beginning with "file:line:column: " where a place in a file is to blame.
 * Nothing below cli/ prints or exits. A caller's bug is an assert, never a status. A light path or sample
 * without contribution is neither: it is a documented zero.
 *
 * The `ca_error` may be NULL where only the status matters. Threads: a ca_error belongs to one thread. */
#ifndef CA_BASE_STATUS_H
#define CA_BASE_STATUS_H

#include "caustica.h"

#include <stdarg.h>
#include <stdint.h>

/* A place in an input file. line and column count from 1; 0 means unknown (binary files). `file` is borrowed:
 * it lives as long as the scene description or the reader that made it. */
typedef struct ca_location {
    const char *file;
    uint32_t line, column;
} ca_location;

#if defined(__GNUC__)
#define CA_PRINTF(format_index, first_argument) __attribute__((format(printf, format_index, first_argument)))
#else
#define CA_PRINTF(format_index, first_argument)
#endif

/* Writes "file:line:column: message" (as much of the place as is known; `where` may be NULL) and returns
 * `status`, so that a failing function can end with `return ca_fail(...)`. */
ca_status ca_fail(ca_error *error, ca_status status, const ca_location *where, const char *format, ...)
    CA_PRINTF(4, 5);

/* The commonest of all: no memory for `what`. Returns CA_ERROR_MEMORY. */
ca_status ca_fail_memory(ca_error *error, const char *what);

/* Of two steps that are both taken, whatever becomes of the first: `reason` is the second one's message. Returns the
 * first failure's status; where both fail the error tells both. */
ca_status ca_fail_also(ca_error *error, ca_status first, ca_status second, const ca_error *reason);

/* Clang's analyzer sees one file at a time: that a failure never returns CA_OK must stand here. */
#ifdef __clang_analyzer__
#define ca_fail(error, status, ...) (ca_fail(error, status, __VA_ARGS__), (status))
#define ca_fail_memory(error, what) (ca_fail_memory(error, what), CA_ERROR_MEMORY)
#endif

/* Leaves the function with the status of a failed call. */
#define CA_TRY(call)                                                                                              \
    do {                                                                                                           \
        ca_status ca_try_status_ = (call);                                                                         \
        if (ca_try_status_ != CA_OK) return ca_try_status_;                                                        \
    } while (0)

#endif
