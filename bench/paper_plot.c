#include "paper_plot.h"

#include "report/plot.h"

#include <stdlib.h>

enum { PAPER_PANELS = 4 };

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

/* A panel as the plot wants it, with what its series point to. */
typedef struct drawn_panel {
    ca_plot_series series[PAPER_SERIES];
    ca_plot_point points[PAPER_SERIES][PAPER_POINTS];
} drawn_panel;

static ca_plot_panel draw_panel(const paper_panel *panel, drawn_panel *drawn)
{
    for (int s = 0; s < panel->count; s++) {
        const paper_series *series = &panel->series[s];
        for (int i = 0; i < series->count; i++)
            drawn->points[s][i] = (ca_plot_point){.x = series->x[i], .y = series->y[i]};
        drawn->series[s] = (ca_plot_series){.name = series->name,
                                            .points = drawn->points[s],
                                            .count = (size_t)series->count,
                                            .colour = (unsigned)series->colour,
                                            .dashed = series->dashed};
    }
    return (ca_plot_panel){.title = panel->title,
                           .x_label = panel->x_label,
                           .y_label = panel->y_label,
                           .series = drawn->series,
                           .count = (size_t)panel->count};
}

void paper_plot(const paper_report *report, const char *name, const paper_panel *panels, int count)
{
    static drawn_panel drawn[PAPER_PANELS];
    ca_plot_panel plot[PAPER_PANELS];
    char path[512];
    if (!report->pictures) return;
    if (count > PAPER_PANELS) fputs("too many panels in a plot\n", stderr), exit(1);
    for (int i = 0; i < count; i++) plot[i] = draw_panel(&panels[i], &drawn[i]);
    snprintf(path, sizeof path, "%s/%s", report->pictures, name);
    FILE *out = fopen(path, "w");
    if (!out) perror(path), exit(1);
    ca_plot_write(out, plot, (size_t)count, (unsigned)count);
    if (fclose(out) != 0) perror(path), exit(1);
    fprintf(report->out, "![%s](%s/%s)\n\n", panels[0].title, report->link, name);
}
