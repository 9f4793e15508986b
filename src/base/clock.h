/* Time that only runs forward, in seconds. */
#ifndef CA_BASE_CLOCK_H
#define CA_BASE_CLOCK_H

/* Since some fixed moment. */
double ca_clock_seconds(void);

/* Of a processor, that this thread has used. Cost: about a fifth of a microsecond. */
double ca_clock_thread_seconds(void);

#endif
