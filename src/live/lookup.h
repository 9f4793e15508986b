/* Where a host of that name is, for those who do not wait for ever: the system asks other machines for it, which may
 * never answer. */
#ifndef CA_LIVE_LOOKUP_H
#define CA_LIVE_LOOKUP_H

#include "base/status.h"

struct addrinfo;

/* Until the clock (base/clock.h) says `end`. *places: the caller's, for freeaddrinfo. Errors: CA_ERROR_FILE,
 * CA_ERROR_MEMORY, CA_ERROR_THREADS. */
ca_status ca_lookup(const char *host, const char *port, double end, struct addrinfo **places, ca_error *error);

#endif
