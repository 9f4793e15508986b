/* JSON files that the program writes with jansson. A value that is NULL was not to be had for lack of memory;
 * jansson's calls that take values over pass that on, and ca_json_write reports it. */
#ifndef CA_CLI_JSON_VALUES_H
#define CA_CLI_JSON_VALUES_H

#include "base/status.h"

#include <jansson.h>

/* Makes jansson take its memory from base/memory.h: before its first call. */
void ca_json_begin(void);

/* null for what is not finite, which JSON does not know. */
json_t *ca_json_number(double value);
/* Any bytes: each that is no UTF-8 becomes the replacement character U+FFFD. */
json_t *ca_json_text(const char *text);

/* Writes the file, complete or not at all; takes `root` over. Where it is NULL or `complete` is false there was too
 * little memory for it. Errors: CA_ERROR_MEMORY, CA_ERROR_FILE. */
ca_status ca_json_write(const char *path, json_t *root, bool complete, ca_error *error);

#endif
