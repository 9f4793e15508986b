/* Words of the command line as numbers. The whole word must be one; errors (CA_ERROR_ARGUMENT) say what was expected,
 * the caller adds which option it was. */
#ifndef CA_CLI_VALUES_H
#define CA_CLI_VALUES_H

#include "base/status.h"

ca_status ca_value_count(const char *text, int minimum, uint32_t *value, ca_error *error);
ca_status ca_value_seed(const char *text, uint64_t *value, ca_error *error);
ca_status ca_value_integer(const char *text, int minimum, int *value, ca_error *error);
ca_status ca_value_real(const char *text, double *value, ca_error *error);     /* finite */
ca_status ca_value_positive(const char *text, double *value, ca_error *error); /* > 0 */
ca_status ca_value_size(const char *text, uint32_t value[2], ca_error *error); /* 640x480 */
ca_status ca_value_range(const char *text, uint64_t value[2], ca_error *error); /* A:B, half open */
ca_status ca_value_port(const char *text, uint32_t *value, ca_error *error); /* of TCP; 0: any */
bool ca_value_is_digits(const char *text);
ca_status ca_value_rect(const char *text, uint32_t value[4], ca_error *error); /* x0,y0,x1,y1, half open */

#endif
