/* What `caustica noise` prints of a measurement. */
#ifndef CA_CLI_NOISE_PRINT_H
#define CA_CLI_NOISE_PRINT_H

#include "cli/stats_json.h"

/* Averages, predictions, times and recommended numbers, to standard output. */
void ca_noise_print(const ca_noise_report *report);

#endif
