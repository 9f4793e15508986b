/* What `caustica noise` prints of a measurement. */
#ifndef CA_CLI_NOISE_PRINT_H
#define CA_CLI_NOISE_PRINT_H

#include "cli/stats_json.h"

/* Averages, predictions, times and recommended numbers, to standard output. */
void ca_noise_print(const ca_noise_report *report);

/* Why no numbers can be recommended, before anything is measured; NULL: they can. Where paths connect, numbers are
 * chosen for some objectives only, and from two camera paths on. */
const char *ca_noise_why_no_numbers(const ca_noise_report *report);

#endif
