/* What the programs that show a paper's figures share: a Markdown report in sections, and the list of what should be
 * seen. All of it dies on errors with a message. */
#ifndef CA_BENCH_PAPER_REPORT_H
#define CA_BENCH_PAPER_REPORT_H

#include "caustica.h"

#include <stdbool.h>
#include <stdio.h>

enum { PAPER_CHECKS = 128 };

/* A claim, what was measured, and whether it holds. */
typedef struct paper_check {
    char what[200], measured[64], goal[64];
    bool holds;
} paper_check;

/* The report so far. */
typedef struct paper_report {
    FILE *out;            /* Markdown */
    const char *pictures; /* folder for plots and pictures; NULL: none */
    const char *link;     /* that folder as seen from the document */
    bool quick;           /* less of everything: to see that it works */
    void *shared;         /* what sections keep for each other, borrowed */
    paper_check checks[PAPER_CHECKS];
    int check_count;
} paper_report;

typedef struct paper_section {
    const char *name;
    void (*run)(paper_report *report);
} paper_section;

/* Adds a check; `goal` is text such as "<= 0.6". */
void paper_expect(paper_report *report, bool holds, double measured, const char *goal, const char *what, ...)
    __attribute__((format(printf, 5, 6)));

/* The program PROGRAM [--quick] [--only SECTION]... [--table FILE] [--pictures FOLDER]: runs the sections, or those
 * named, and then prints the table of checks. Returns the exit status: 1 if one does not hold, 2 for wrong usage.
 * `more_usage` (may be NULL) is a line more for the usage text. */
int paper_report_main(int argc, char **argv, paper_report *report, const paper_section *sections, int section_count,
                      const char *more_usage);

ca_scene *paper_scene(const char *file, const ca_define *defines, size_t count); /* below scenes/ */
void *paper_need(void *memory);                                                  /* dies of NULL */
double paper_mean(const double *values, size_t count);

#endif
