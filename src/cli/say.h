/* What the program prints of names and texts that others have chosen (files, words, scenes): on a terminal none of
 * them can give it commands. Elsewhere, in a pipe or a file, they are printed as they are, for programs to read. */
#ifndef CA_CLI_SAY_H
#define CA_CLI_SAY_H

#include "base/status.h"

#include <stdio.h>

/* As fprintf. Where the stream is a terminal, control characters (C0 but the tab, DEL, C1) and bytes that are no
 * UTF-8 are written as \x1b; a newline, too, but for the one that the format ends with. */
void ca_say(FILE *stream, const char *format, ...) CA_PRINTF(2, 3);

/* The text as a terminal gets it, cut to `size` bytes with its end. */
void ca_show_text(const char *text, char *shown, size_t size);

#endif
