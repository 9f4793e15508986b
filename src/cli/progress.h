/* Progress on standard error: passes, time gone and left, noise so far. On a terminal one line with a bar that is
 * drawn over itself, never wider than the terminal, and gone at the end. On a narrow one the less important parts are
 * left out; with a noise target the last ones to go are the percentage, the noise and the bar. On one that says it
 * is dumb (TERM), a line of its own now and then: after 5 seconds of rendering, after twice the time again and again,
 * and at least once a minute. Nothing where standard error is no terminal. */
#ifndef CA_CLI_PROGRESS_H
#define CA_CLI_PROGRESS_H

#include "caustica.h"

#include <stdio.h>

typedef struct ca_progress_line {
    FILE *stream;
    bool plain;        /* lines, one after the other */
    bool shown;        /* is anything drawn that is to be wiped? */
    double last_drawn; /* seconds of rendering; negative: nothing yet */
    bool warned;       /* of the method that `auto` chose */
} ca_progress_line;

/* `wanted`: false keeps it silent. */
ca_progress_line ca_progress_start(bool wanted);
void ca_progress_draw(ca_progress_line *line, const ca_render_progress *progress);
void ca_progress_clear(ca_progress_line *line);
/* Says, once and even where the line is silent, what is wrong with the method that `auto` chose. */
void ca_progress_warn(ca_progress_line *line, const ca_render_progress *progress);
/* While a scene is loaded (base/loading.h), in place of passes `what` is done. */
void ca_progress_draw_loading(ca_progress_line *line, const char *what, double fraction, double seconds);

/* For ca_render_settings.progress, with the line as its user: draws it, and warns; false once a signal has
 * arrived (signals.h). */
bool ca_progress_report(const ca_render_progress *progress, void *line);

/* "1:02:03", "2:03" or "2.3 s". */
void ca_format_seconds(double seconds, char *text, size_t size);

#endif
