#include "base/status.h"

#include "base/memory.h"

#include <stdio.h>
#include <string.h>

/* Here are the functions themselves. */
#undef ca_fail
#undef ca_fail_memory

ca_status ca_fail(ca_error *error, ca_status status, const ca_location *where, const char *format, ...)
{
    if (!error) return status;
    size_t used = 0;
    const size_t size = sizeof error->message;
    if (where && where->file) {
        int n = 0;
        if (where->line && where->column)
            n = snprintf(error->message, size, "%s:%u:%u: ", where->file, where->line, where->column);
        else if (where->line)
            n = snprintf(error->message, size, "%s:%u: ", where->file, where->line);
        else
            n = snprintf(error->message, size, "%s: ", where->file);
        used = n < 0 ? 0 : (size_t)n < size ? (size_t)n : size - 1;
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->message + used, size - used, format, arguments);
    va_end(arguments);
    return status;
}

/* Where memory was there, and only not allowed, that is told. */
ca_status ca_fail_memory(ca_error *error, const char *what)
{
    const ca_memory_budget *budget = ca_memory_budget_exceeded();
    if (budget)
        return ca_fail(error, CA_ERROR_MEMORY, NULL,
                       "%.500s: reading this takes more than the %.0f MiB of memory that are allowed; %s",
                       what, (double)budget->limit / 0x1p20, budget->way);
    return ca_fail(error, CA_ERROR_MEMORY, NULL, "out of memory: %s", what);
}

ca_status ca_fail_also(ca_error *error, ca_status first, ca_status second, const ca_error *reason)
{
    if (second == CA_OK) return first;
    if (first == CA_OK) {
        if (error) *error = *reason;
        return second;
    }
    if (!error) return first;
    const size_t used = strlen(error->message);
    snprintf(error->message + used, sizeof error->message - used, "; %s", reason->message);
    return first;
}

const char *ca_status_name(ca_status status)
{
    switch (status) {
#define CA_STATUS_CASE(name, text)                                                                                 \
    case name: return text;
        CA_STATUS_LIST(CA_STATUS_CASE)
#undef CA_STATUS_CASE
    }
    return "unknown status";
}
