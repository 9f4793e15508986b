#include "paper_plot.h"

#include <math.h>
#include <stdlib.h>

enum { PANEL_WIDTH = 460, PANEL_HEIGHT = 380, LEFT = 62, RIGHT = 14, TOP = 34, BOTTOM = 46, LEGEND_LINE = 16 };

static const char *const colours[] = {"#444444", "#1f6fb4", "#d1571c", "#2a8a3c", "#8a4fb0", "#b0902a"};
enum { COLOURS = sizeof colours / sizeof colours[0] };

paper_series *paper_panel_add(paper_panel *panel, const char *name, int colour, bool dashed)
{
    if (panel->count == PAPER_SERIES) fputs("too many series in a plot\n", stderr), exit(1);
    paper_series *series = &panel->series[panel->count++];
    *series = (paper_series){.colour = colour, .dashed = dashed};
    snprintf(series->name, sizeof series->name, "%s", name);
    return series;
}

void paper_series_add(paper_series *series, double x, double y)
{
    if (series->count == PAPER_POINTS) fputs("too many points in a plot\n", stderr), exit(1);
    series->x[series->count] = x;
    series->y[series->count++] = y;
}

/* The logarithms at an axis' ends. */
typedef struct axis {
    double low, high;
} axis;

static double position(axis a, double value, double from, double to)
{
    return from + (log10(value) - a.low) / (a.high - a.low) * (to - from);
}

static axis axis_of(const paper_panel *panel, bool is_x)
{
    axis a = {.low = HUGE_VAL, .high = -HUGE_VAL};
    for (int s = 0; s < panel->count; s++)
        for (int i = 0; i < panel->series[s].count; i++) {
            if (!(panel->series[s].y[i] > 0.0)) continue;
            const double value = log10(is_x ? panel->series[s].x[i] : panel->series[s].y[i]);
            a.low = fmin(a.low, value);
            a.high = fmax(a.high, value);
        }
    const double margin = fmax(0.05 * (a.high - a.low), 0.02);
    return (axis){.low = a.low - margin, .high = a.high + margin};
}

static void text(FILE *out, double x, double y, const char *anchor, const char *more, const char *what)
{
    fprintf(out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\"%s>%s</text>\n", x, y, anchor, more, what);
}

/* Lines at powers of ten, and at 2 and 5 times them where the axis is short. */
static void draw_ticks(FILE *out, axis a, bool is_x, double x0, double y0, double x1, double y1)
{
    const bool fine = a.high - a.low < 2.0;
    static const double steps[3] = {1.0, 2.0, 5.0};
    for (int decade = (int)floor(a.low); decade <= (int)ceil(a.high); decade++)
        for (int k = 0; k < (fine ? 3 : 1); k++) {
            const double value = steps[k] * pow(10.0, decade);
            if (log10(value) < a.low || log10(value) > a.high) continue;
            char label[32];
            snprintf(label, sizeof label, "%g", value);
            const double at = is_x ? position(a, value, x0, x1) : position(a, value, y1, y0);
            fprintf(out, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"#ddd\"/>\n", is_x ? at : x0, is_x ? y0 : at,
                    is_x ? at : x1, is_x ? y1 : at);
            if (is_x)
                text(out, at, y1 + 15.0, "middle", "", label);
            else
                text(out, x0 - 5.0, at + 4.0, "end", "", label);
        }
}

static void draw_series(FILE *out, const paper_series *series, axis ax, axis ay, double x0, double y0, double x1,
                        double y1)
{
    const char *colour = colours[series->colour % COLOURS];
    bool first = true;
    fprintf(out, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"1.6\"%s d=\"", colour,
            series->dashed ? " stroke-dasharray=\"5 4\"" : "");
    for (int i = 0; i < series->count; i++) {
        if (!(series->y[i] > 0.0)) continue;
        fprintf(out, "%c%.1f %.1f", first ? 'M' : 'L', position(ax, series->x[i], x0, x1),
                position(ay, series->y[i], y1, y0));
        first = false;
    }
    fputs("\"/>\n", out);
    for (int i = 0; i < series->count; i++)
        if (series->y[i] > 0.0)
            fprintf(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.4\" fill=\"%s\"/>\n",
                    position(ax, series->x[i], x0, x1), position(ay, series->y[i], y1, y0), colour);
}

/* Below the panel, in two columns. */
static void draw_legend(FILE *out, const paper_panel *panel, double x)
{
    for (int s = 0; s < panel->count; s++) {
        const paper_series *series = &panel->series[s];
        const double left = x + (s % 2) * 0.5 * (PANEL_WIDTH - LEFT - RIGHT);
        const double at = PANEL_HEIGHT + LEGEND_LINE * (s / 2) + 4.0;
        fprintf(out, "<path d=\"M%.1f %.1fh22\" stroke=\"%s\" stroke-width=\"1.6\"%s/>\n", left, at - 4.0,
                colours[series->colour % COLOURS], series->dashed ? " stroke-dasharray=\"5 4\"" : "");
        text(out, left + 28.0, at, "start", "", series->name);
    }
}

static int legend_height(const paper_panel *panels, int count)
{
    int lines = 0;
    for (int i = 0; i < count; i++)
        if ((panels[i].count + 1) / 2 > lines) lines = (panels[i].count + 1) / 2;
    return LEGEND_LINE * lines;
}

static void draw_panel(FILE *out, const paper_panel *panel, double left)
{
    const double x0 = left + LEFT, x1 = left + PANEL_WIDTH - RIGHT, y0 = TOP, y1 = PANEL_HEIGHT - BOTTOM;
    const axis ax = axis_of(panel, true), ay = axis_of(panel, false);
    draw_ticks(out, ax, true, x0, y0, x1, y1);
    draw_ticks(out, ay, false, x0, y0, x1, y1);
    fprintf(out, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"none\" stroke=\"#888\"/>\n", x0,
            y0, x1 - x0, y1 - y0);
    for (int s = 0; s < panel->count; s++) draw_series(out, &panel->series[s], ax, ay, x0, y0, x1, y1);
    draw_legend(out, panel, x0);
    text(out, 0.5 * (x0 + x1), TOP - 12.0, "middle", " font-weight=\"bold\"", panel->title);
    text(out, 0.5 * (x0 + x1), PANEL_HEIGHT - 10.0, "middle", "", panel->x_label);
    char turn[96];
    snprintf(turn, sizeof turn, " transform=\"rotate(-90 %.1f %.1f)\"", left + 14.0, 0.5 * (y0 + y1));
    text(out, left + 14.0, 0.5 * (y0 + y1), "middle", turn, panel->y_label);
}

void paper_plot(const paper_report *report, const char *name, const paper_panel *panels, int count)
{
    char path[512];
    if (!report->pictures) return;
    snprintf(path, sizeof path, "%s/%s", report->pictures, name);
    FILE *out = fopen(path, "w");
    if (!out) perror(path), exit(1);
    fprintf(out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" font-family=\"sans-serif\" "
            "font-size=\"11\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
            PANEL_WIDTH * count, PANEL_HEIGHT + legend_height(panels, count));
    for (int i = 0; i < count; i++) draw_panel(out, &panels[i], (double)i * PANEL_WIDTH);
    fputs("</svg>\n", out);
    if (fclose(out) != 0) perror(path), exit(1);
    fprintf(report->out, "![%s](%s/%s)\n\n", panels[0].title, report->link, name);
}
