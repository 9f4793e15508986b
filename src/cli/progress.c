#define _DEFAULT_SOURCE
#include "cli/progress.h"

#include "cli/signals.h"
#include "render/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { LINE_LIMIT = 160, WIDEST_BAR = 40, NARROWEST_BAR = 8, USUAL_WIDTH = 80 };

ca_progress_line ca_progress_start(bool wanted)
{
    const char *kind = getenv("TERM");
    const bool visible = wanted && isatty(STDERR_FILENO);
    return (ca_progress_line){
        .stream = visible ? stderr : NULL, .plain = kind && strcmp(kind, "dumb") == 0, .last_drawn = -1.0};
}

void ca_format_seconds(double seconds, char *text, size_t size)
{
    if (seconds < 59.95) {
        snprintf(text, size, "%.1f s", seconds);
        return;
    }
    const unsigned long long whole = seconds < 1e9 ? (unsigned long long)(seconds + 0.5) : 1000000000ull;
    if (whole < 3600)
        snprintf(text, size, "%llu:%02llu", whole / 60, whole % 60);
    else
        snprintf(text, size, "%llu:%02llu:%02llu", whole / 3600, whole / 60 % 60, whole % 60);
}

/* Appends a part if the line stays within `width` columns. */
static void append(char *line, size_t width, const char *part)
{
    const size_t used = strlen(line), length = strlen(part), gap = used > 0 ? 2 : 0;
    if (used + gap + length > width || used + gap + length >= LINE_LIMIT) return;
    memcpy(line + used, "  ", gap);
    memcpy(line + used + gap, part, length + 1);
}

static void append_bar(char *line, size_t width, double fraction)
{
    char bar[WIDEST_BAR + 3];
    const size_t used = strlen(line), frame = 4; /* gap and brackets */
    if (width < used + frame + NARROWEST_BAR) return;
    const size_t room = width - used - frame, length = room < WIDEST_BAR ? room : WIDEST_BAR;
    const size_t filled = (size_t)(fraction * (double)length);
    bar[0] = '[';
    memset(bar + 1, '=', filled);
    memset(bar + 1 + filled, '.', length - filled);
    bar[length + 1] = ']';
    bar[length + 2] = '\0';
    append(line, width, bar);
}

/* The most important part first: on a narrow terminal the last ones do not fit. */
static void compose(const ca_render_progress *p, size_t width, bool with_bar, char line[LINE_LIMIT])
{
    char part[64], time[32];
    const double fraction = ca_progress_fraction(p);
    line[0] = '\0';
    if (fraction >= 0.0) {
        snprintf(part, sizeof part, "%3.0f %%", floor(100.0 * fraction));
        append(line, width, part);
    }
    const char *what = p->blocks ? "block" : "pass";
    if (p->passes_total > 0)
        snprintf(part, sizeof part, "%s %u/%u", what, p->passes_done, p->passes_total);
    else
        snprintf(part, sizeof part, "%s %u", what, p->passes_done);
    append(line, width, part);
    if (fraction > 0.0) {
        ca_format_seconds(ca_progress_seconds_left(p), time, sizeof time);
        snprintf(part, sizeof part, "%s left", time);
        append(line, width, part);
    }
    ca_format_seconds(p->seconds, time, sizeof time);
    snprintf(part, sizeof part, "%s gone", time);
    append(line, width, part);
    if (p->seconds_predicted > 0.0) {
        ca_format_seconds(fmax(p->seconds_predicted, p->seconds), time, sizeof time);
        snprintf(part, sizeof part, "of %s", time);
        append(line, width, part);
    }
    if (p->noise_percent >= 0.0) {
        snprintf(part, sizeof part, "noise %.3g %%", p->noise_percent);
        append(line, width, part);
    }
    if (fraction >= 0.0 && with_bar) append_bar(line, width, fraction);
}

static size_t terminal_width(void)
{
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return USUAL_WIDTH;
    return size.ws_col;
}

/* Soon after the last line in the beginning, later rarely: a log shows that the work goes on. */
static void write_plain(ca_progress_line *line, const ca_render_progress *progress)
{
    const double first = 5.0, most = 60.0, last = line->last_drawn;
    char text[LINE_LIMIT];
    if (progress->seconds < (last < 0.0 ? first : last + fmin(last, most))) return;
    compose(progress, LINE_LIMIT, false, text);
    fprintf(line->stream, "caustica: %s\n", text + strspn(text, " "));
    fflush(line->stream);
    line->last_drawn = progress->seconds;
}

static void draw_over(ca_progress_line *line, const ca_render_progress *progress)
{
    const double redraw_seconds = 0.1;
    char text[LINE_LIMIT];
    if (line->last_drawn >= 0.0 && progress->seconds - line->last_drawn < redraw_seconds) return;
    /* Some terminals wrap when the last column is written. */
    compose(progress, terminal_width() - 1, true, text);
    fprintf(line->stream, "\r%s\033[K", text);
    fflush(line->stream);
    line->shown = true;
    line->last_drawn = progress->seconds;
}

void ca_progress_draw(ca_progress_line *line, const ca_render_progress *progress)
{
    if (!line->stream) return;
    if (line->plain)
        write_plain(line, progress);
    else
        draw_over(line, progress);
}

void ca_progress_clear(ca_progress_line *line)
{
    if (!line->shown) return;
    fprintf(line->stream, "\r\033[K");
    fflush(line->stream);
    line->shown = false;
}

bool ca_progress_report(const ca_render_progress *progress, void *line)
{
    ca_progress_draw(line, progress);
    return !ca_signals_arrived();
}
