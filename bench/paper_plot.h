/* Plots of papers' figures: panels side by side, as report/plot.h draws them, put together point by point. */
#ifndef CA_BENCH_PAPER_PLOT_H
#define CA_BENCH_PAPER_PLOT_H

#include "paper_report.h"

enum { PAPER_SERIES = 10, PAPER_POINTS = 24 };

typedef struct paper_series {
    char name[48];
    double x[PAPER_POINTS], y[PAPER_POINTS]; /* y not above 0: left out */
    int count;
    int colour; /* number of it; series of one thing share one */
    bool dashed;
} paper_series;

typedef struct paper_panel {
    const char *title, *x_label, *y_label;
    paper_series series[PAPER_SERIES];
    int count;
} paper_panel;

/* Adds an empty series; stays valid as long as the panel. */
paper_series *paper_panel_add(paper_panel *panel, const char *name, int colour, bool dashed);
void paper_series_add(paper_series *series, double x, double y);
/* As PICTURES/name, if there is that folder, with a link in the report. */
void paper_plot(const paper_report *report, const char *name, const paper_panel *panels, int count);

#endif
