#define _DEFAULT_SOURCE
#include "cli/progress.h"

#include "cli/say.h"
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

/* The parts of a line, as they stand in it. */
typedef enum line_part { PERCENT, PASSES, LEFT, GONE, WHOLE, NOISE, BAR, PART_COUNT } line_part;

typedef struct line_parts {
    char texts[PART_COUNT][96]; /* "": there is none. Of the bar: the shortest */
    bool shown[PART_COUNT];
    size_t used; /* columns */
    double fraction, seconds; /* done, negative: nobody knows; and gone */
    bool to_noise;            /* the noise is what ends the work */
} line_parts;

static void write_bar(line_parts *parts)
{
    const size_t size = sizeof parts->texts[0];
    if (parts->fraction < 0.0) return;
    snprintf(parts->texts[PERCENT], size, "%3.0f %%", floor(100.0 * parts->fraction));
    snprintf(parts->texts[BAR], size, "[%*s]", NARROWEST_BAR, "");
}

static void write_times(const ca_render_progress *p, double fraction, line_parts *parts)
{
    const size_t size = sizeof parts->texts[0];
    char time[32];
    if (fraction > 0.0) {
        ca_format_seconds(ca_progress_seconds_left(p), time, sizeof time);
        snprintf(parts->texts[LEFT], size, "%s left", time);
    }
    ca_format_seconds(p->seconds, time, sizeof time);
    snprintf(parts->texts[GONE], size, "%s gone", time);
    if (p->seconds_predicted <= 0.0) return;
    ca_format_seconds(fmax(p->seconds_predicted, p->seconds), time, sizeof time);
    snprintf(parts->texts[WHOLE], size, "of %s", time);
}

static line_parts render_parts(const ca_render_progress *p)
{
    line_parts parts = {
        .fraction = ca_progress_fraction(p), .seconds = p->seconds, .to_noise = p->noise_target > 0.0};
    const size_t size = sizeof parts.texts[0];
    const char *what = p->blocks ? "block" : "pass";
    if (p->passes_total > 0)
        snprintf(parts.texts[PASSES], size, "%s %u/%u", what, p->passes_done, p->passes_total);
    else
        snprintf(parts.texts[PASSES], size, "%s %u", what, p->passes_done);
    write_bar(&parts);
    write_times(p, parts.fraction, &parts);
    if (p->noise_percent >= 0.0) snprintf(parts.texts[NOISE], size, "noise %.3g %%", p->noise_percent);
    return parts;
}

static line_parts loading_parts(const char *what, double fraction, double seconds)
{
    line_parts parts = {.fraction = fraction, .seconds = seconds};
    char time[32];
    ca_format_seconds(seconds, time, sizeof time);
    ca_show_text(what, parts.texts[PASSES], sizeof parts.texts[0]); /* it names files */
    snprintf(parts.texts[GONE], sizeof parts.texts[0], "%s gone", time);
    write_bar(&parts);
    return parts;
}

/* The most important part first; what does not fit beside those before it is left out whole. */
static void choose_parts(size_t width, line_parts *parts)
{
    static const line_part to_noise[PART_COUNT] = {PERCENT, NOISE, BAR, LEFT, PASSES, GONE, WHOLE};
    static const line_part others[PART_COUNT] = {PERCENT, PASSES, LEFT, BAR, NOISE, GONE, WHOLE};
    for (int i = 0; i < PART_COUNT; i++) {
        const line_part part = parts->to_noise ? to_noise[i] : others[i];
        const size_t length = strlen(parts->texts[part]), gap = parts->used > 0 ? 2 : 0;
        const bool follows = part != WHOLE || parts->shown[GONE]; /* "1.0 s gone  of 3.0 s" */
        if (length == 0 || !follows || parts->used + gap + length > width) continue;
        parts->shown[part] = true;
        parts->used += gap + length;
    }
}

/* Makes the shortest bar as long as the room left over allows. */
static void draw_bar(double fraction, size_t room, char *bar)
{
    const size_t most = NARROWEST_BAR + room, length = most < WIDEST_BAR ? most : WIDEST_BAR;
    const size_t filled = (size_t)(fraction * (double)length);
    bar[0] = '[';
    memset(bar + 1, '=', filled);
    memset(bar + 1 + filled, '.', length - filled);
    bar[length + 1] = ']';
    bar[length + 2] = '\0';
}

static void compose(line_parts *parts, size_t width, char line[LINE_LIMIT])
{
    if (width > LINE_LIMIT - 1) width = LINE_LIMIT - 1;
    choose_parts(width, parts);
    if (parts->shown[BAR]) draw_bar(parts->fraction, width - parts->used, parts->texts[BAR]);
    line[0] = '\0';
    for (int part = 0; part < PART_COUNT; part++) {
        const size_t used = strlen(line);
        if (parts->shown[part])
            snprintf(line + used, LINE_LIMIT - used, "%s%s", used > 0 ? "  " : "", parts->texts[part]);
    }
}

static size_t terminal_width(void)
{
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return USUAL_WIDTH;
    return size.ws_col;
}

/* Soon after the last line in the beginning, later rarely: a log shows that the work goes on. */
static void write_plain(ca_progress_line *line, line_parts *parts)
{
    const double first = 5.0, most = 60.0, last = line->last_drawn;
    char text[LINE_LIMIT];
    if (parts->seconds < (last < 0.0 ? first : last + fmin(last, most))) return;
    parts->texts[BAR][0] = '\0';
    compose(parts, LINE_LIMIT, text);
    fprintf(line->stream, "caustica: %s\n", text + strspn(text, " "));
    fflush(line->stream);
    line->last_drawn = parts->seconds;
}

static void draw_over(ca_progress_line *line, line_parts *parts)
{
    const double redraw_seconds = 0.1;
    char text[LINE_LIMIT];
    if (line->last_drawn >= 0.0 && parts->seconds - line->last_drawn < redraw_seconds) return;
    /* Some terminals wrap when the last column is written. */
    compose(parts, terminal_width() - 1, text);
    fprintf(line->stream, "\r%s\033[K", text);
    fflush(line->stream);
    line->shown = true;
    line->last_drawn = parts->seconds;
}

static void draw(ca_progress_line *line, line_parts parts)
{
    if (line->plain)
        write_plain(line, &parts);
    else
        draw_over(line, &parts);
}

void ca_progress_draw(ca_progress_line *line, const ca_render_progress *progress)
{
    if (line->stream) draw(line, render_parts(progress));
}

void ca_progress_draw_loading(ca_progress_line *line, const char *what, double fraction, double seconds)
{
    if (line->stream) draw(line, loading_parts(what, fraction, seconds));
}

void ca_progress_clear(ca_progress_line *line)
{
    if (!line->shown) return;
    fprintf(line->stream, "\r\033[K");
    fflush(line->stream);
    line->shown = false;
}

void ca_progress_warn(ca_progress_line *line, const ca_render_progress *progress)
{
    if (line->warned || !progress->method_warning) return;
    ca_progress_clear(line);
    ca_say(stderr, "caustica: warning: %s\n", progress->method_warning);
    line->warned = true;
}

bool ca_progress_report(const ca_render_progress *progress, void *line)
{
    ca_progress_warn(line, progress);
    ca_progress_draw(line, progress);
    return !ca_signals_arrived();
}
