#include "report/plot.h"

#include "report/page_text.h"

#include <math.h>
#include <string.h>

enum {
    PANEL_WIDTH = 460,
    PANEL_HEIGHT = 380,
    LEFT = 62,
    RIGHT = 14,
    TOP = 34,
    BOTTOM = 46,
    LEGEND_LINE = 16,
    ROW_GAP = 18
};

const char *ca_plot_colour(unsigned colour)
{
    static const char *const colours[] = {"#444444", "#1f6fb4", "#d1571c", "#2a8a3c", "#8a4fb0",
                                          "#b0902a", "#c23a6b", "#17899a", "#7a5a3a", "#6f7f12"};
    return colours[colour % (sizeof colours / sizeof colours[0])];
}

/* ---- Numbers and texts ----------------------------------------------------------------------------------------- */

/* A length in pixels; some locales write a comma. */
static void put(FILE *out, const char *before, double value)
{
    char text[40];
    snprintf(text, sizeof text, "%.1f", value);
    for (char *c = text; *c; c++)
        if (*c == ',') *c = '.';
    fputs(before, out);
    fputs(text, out);
}

static void open_text(FILE *out, double x, double y, const char *anchor)
{
    put(out, "<text x=\"", x);
    put(out, "\" y=\"", y);
    fprintf(out, "\" text-anchor=\"%s\"", anchor);
}

static void close_text(FILE *out, const char *what)
{
    fputc('>', out);
    ca_page_put_html(out, what);
    fputs("</text>\n", out);
}

static void text(FILE *out, double x, double y, const char *anchor, const char *what)
{
    open_text(out, x, y, anchor);
    close_text(out, what);
}

static void line(FILE *out, double x0, double y0, double x1, double y1)
{
    put(out, "<path d=\"M", x0);
    put(out, " ", y0);
    put(out, "L", x1);
    put(out, " ", y1);
    fputc('"', out);
}

/* ---- Axes ------------------------------------------------------------------------------------------------------ */

/* The logarithms at an axis' ends. */
typedef struct axis {
    double low, high;
} axis;

/* Where a panel's axes lie, in pixels, and what they span. */
typedef struct frame {
    double x0, y0, x1, y1;
    axis x, y;
} frame;

static bool has_place(const ca_plot_point *p) { return p->x > 0.0 && p->y > 0.0 && isfinite(p->x) && isfinite(p->y); }

static double position(axis a, double value, double from, double to)
{
    return from + (log10(value) - a.low) / (a.high - a.low) * (to - from);
}

static double x_of(const frame *f, double value) { return position(f->x, value, f->x0, f->x1); }
static double y_of(const frame *f, double value) { return position(f->y, value, f->y1, f->y0); }

static axis axis_of(const ca_plot_panel *panel, bool is_x)
{
    axis a = {.low = HUGE_VAL, .high = -HUGE_VAL};
    for (size_t s = 0; s < panel->count; s++)
        for (size_t i = 0; i < panel->series[s].count; i++) {
            const ca_plot_point *p = &panel->series[s].points[i];
            if (!has_place(p)) continue;
            const double value = log10(is_x ? p->x : p->y);
            a.low = fmin(a.low, value);
            a.high = fmax(a.high, value);
        }
    if (a.low > a.high) return (axis){.low = 0.0, .high = 1.0};
    /* Equal values shall not make an axis of rounding errors. */
    const double margin = fmax(0.05 * (a.high - a.low), a.high - a.low < 1e-3 ? 0.2 : 0.02);
    return (axis){.low = a.low - margin, .high = a.high + margin};
}

/* Lines at powers of ten, and at 2 and 5 times them where the axis is short. */
static void draw_ticks(FILE *out, const frame *f, bool is_x)
{
    static const double steps[3] = {1.0, 2.0, 5.0};
    const axis a = is_x ? f->x : f->y;
    const bool fine = a.high - a.low < 2.0;
    for (int decade = (int)floor(a.low); decade <= (int)ceil(a.high); decade++)
        for (int k = 0; k < (fine ? 3 : 1); k++) {
            const double value = steps[k] * pow(10.0, decade);
            if (log10(value) < a.low || log10(value) > a.high) continue;
            char label[32];
            snprintf(label, sizeof label, "%g", value);
            for (char *c = label; *c; c++)
                if (*c == ',') *c = '.';
            const double at = is_x ? x_of(f, value) : y_of(f, value);
            line(out, is_x ? at : f->x0, is_x ? f->y0 : at, is_x ? at : f->x1, is_x ? f->y1 : at);
            fputs(" stroke=\"#ddd\"/>\n", out);
            if (is_x)
                text(out, at, f->y1 + 15.0, "middle", label);
            else
                text(out, f->x0 - 5.0, at + 4.0, "end", label);
        }
}

/* ---- Series ---------------------------------------------------------------------------------------------------- */

static void put_stroke(FILE *out, const ca_plot_series *series)
{
    fprintf(out, " stroke=\"%s\" stroke-width=\"%s\"%s", ca_plot_colour(series->colour), series->bare ? "1" : "1.6",
            series->dashed ? " stroke-dasharray=\"5 4\"" : "");
}

static void draw_error_bar(FILE *out, const ca_plot_series *series, const frame *f, const ca_plot_point *p)
{
    if (!(p->low < p->high)) return;
    const double at = x_of(f, p->x);
    const double low = p->low > 0.0 ? fmin(y_of(f, p->low), f->y1) : f->y1;
    line(out, at, low, at, isfinite(p->high) ? fmax(y_of(f, p->high), f->y0) : f->y0);
    fprintf(out, " stroke=\"%s\" stroke-width=\"1\"/>\n", ca_plot_colour(series->colour));
}

static void draw_series(FILE *out, const ca_plot_series *series, const frame *f)
{
    size_t drawn = 0;
    fputs("<path fill=\"none\"", out);
    put_stroke(out, series);
    fputs(" d=\"", out);
    for (size_t i = 0; i < series->count; i++) {
        if (!has_place(&series->points[i])) continue;
        put(out, drawn++ == 0 ? "M" : "L", x_of(f, series->points[i].x));
        put(out, " ", y_of(f, series->points[i].y));
    }
    fputs("\"/>\n", out);
    for (size_t i = 0; i < series->count && !series->bare; i++) {
        const ca_plot_point *p = &series->points[i];
        if (!has_place(p)) continue;
        draw_error_bar(out, series, f, p);
        put(out, "<circle cx=\"", x_of(f, p->x));
        put(out, "\" cy=\"", y_of(f, p->y));
        fprintf(out, "\" r=\"2.4\" fill=\"%s\"/>\n", ca_plot_colour(series->colour));
    }
}

/* ---- Panels ---------------------------------------------------------------------------------------------------- */

static unsigned legend_columns(const ca_plot_panel *panel)
{
    return panel->legend_columns ? panel->legend_columns : 2;
}

/* Below the panel. */
static void draw_legend(FILE *out, const ca_plot_panel *panel, double x, double top)
{
    const unsigned columns = legend_columns(panel);
    unsigned place = 0;
    for (size_t s = 0; s < panel->count; s++) {
        if (!panel->series[s].name) continue;
        const double left = x + (place % columns) * (double)(PANEL_WIDTH - LEFT - RIGHT) / columns;
        const double at = top + PANEL_HEIGHT + LEGEND_LINE * (double)(place / columns) + 4.0;
        put(out, "<path d=\"M", left);
        put(out, " ", at - 4.0);
        fputs("h22\"", out);
        put_stroke(out, &panel->series[s]);
        fputs("/>\n", out);
        text(out, left + 28.0, at, "start", panel->series[s].name);
        place++;
    }
}

static double legend_height(const ca_plot_panel *panels, size_t count)
{
    unsigned lines = 0;
    for (size_t i = 0; i < count; i++) {
        unsigned names = 0;
        for (size_t s = 0; s < panels[i].count; s++) names += panels[i].series[s].name != NULL;
        const unsigned needed = (names + legend_columns(&panels[i]) - 1) / legend_columns(&panels[i]);
        if (needed > lines) lines = needed;
    }
    return (double)LEGEND_LINE * lines;
}

static void draw_panel(FILE *out, const ca_plot_panel *panel, double left, double top)
{
    const frame f = {.x0 = left + LEFT,
                     .x1 = left + PANEL_WIDTH - RIGHT,
                     .y0 = top + TOP,
                     .y1 = top + PANEL_HEIGHT - BOTTOM,
                     .x = axis_of(panel, true),
                     .y = axis_of(panel, false)};
    const double middle = 0.5 * (f.x0 + f.x1), height = 0.5 * (f.y0 + f.y1);
    draw_ticks(out, &f, true);
    draw_ticks(out, &f, false);
    put(out, "<rect x=\"", f.x0);
    put(out, "\" y=\"", f.y0);
    put(out, "\" width=\"", f.x1 - f.x0);
    put(out, "\" height=\"", f.y1 - f.y0);
    fputs("\" fill=\"none\" stroke=\"#888\"/>\n", out);
    for (size_t s = 0; s < panel->count; s++) draw_series(out, &panel->series[s], &f);
    draw_legend(out, panel, f.x0, top);
    open_text(out, middle, f.y0 - 12.0, "middle");
    fputs(" font-weight=\"bold\"", out);
    close_text(out, panel->title);
    text(out, middle, top + PANEL_HEIGHT - 10.0, "middle", panel->x_label);
    open_text(out, left + 14.0, height, "middle");
    put(out, " transform=\"rotate(-90 ", left + 14.0);
    put(out, " ", height);
    fputs(")\"", out);
    close_text(out, panel->y_label);
}

void ca_plot_write(FILE *stream, const ca_plot_panel *panels, size_t count, unsigned columns)
{
    const size_t across = columns < count ? columns : count, rows = (count + columns - 1) / columns;
    const double row = PANEL_HEIGHT + legend_height(panels, count);
    fprintf(stream,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%zu\" height=\"%.0f\" font-family=\"sans-serif\" "
            "font-size=\"11\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
            PANEL_WIDTH * across, row * (double)rows + ROW_GAP * (double)(rows - 1));
    for (size_t i = 0; i < count; i++)
        draw_panel(stream, &panels[i], (double)(i % columns) * PANEL_WIDTH, (double)(i / columns) * (row + ROW_GAP));
    fputs("</svg>\n", stream);
}
