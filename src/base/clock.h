/* Time that only runs forward. */
#ifndef CA_BASE_CLOCK_H
#define CA_BASE_CLOCK_H

/* Seconds since some fixed moment. */
double ca_clock_seconds(void);

#endif
