/* Plots as SVG: panels with two logarithmic axes, side by side or in rows.
 *
 * What is not positive has no place on such an axis and is left out; error bars end at the panel's border. An axis
 * spans the points of all series of its panel. Texts may be any bytes: they are escaped. Same input, same bytes, in
 * every locale. */
#ifndef CA_REPORT_PLOT_H
#define CA_REPORT_PLOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef struct ca_plot_point {
    double x, y;
    double low, high; /* ends of its error bar; equal: none */
} ca_plot_point;

typedef struct ca_plot_series {
    const char *name; /* in the legend; NULL: not in it */
    const ca_plot_point *points;
    size_t count;
    unsigned colour; /* number of it; series of one thing share one */
    bool dashed;
    bool bare; /* a line without marks at its points */
} ca_plot_series;

typedef struct ca_plot_panel {
    const char *title, *x_label, *y_label;
    const ca_plot_series *series;
    size_t count;
    unsigned legend_columns; /* 0: two */
} ca_plot_panel;

/* `columns` panels in a row. The stream's own errors are the caller's to ask for. All is borrowed. */
void ca_plot_write(FILE *stream, const ca_plot_panel *panels, size_t count, unsigned columns);

/* A colour as CSS has it, "#1f6fb4", the one that ca_plot_series.colour stands for. */
const char *ca_plot_colour(unsigned colour);

#endif
