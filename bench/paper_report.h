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
    bool full;            /* no section stops for its share of the time */
    double deadline;      /* of the section, as ca_clock_seconds has it; INFINITY: none */
    int to_come;          /* measurements that the section will still make; they share what is left of its time */
    int made, cut;        /* measurements of the section; those that had to be shorter than wanted, or left out */
    void *shared;         /* what sections keep for each other, borrowed */
    paper_check checks[PAPER_CHECKS];
    int check_count;
} paper_report;

typedef struct paper_section {
    const char *name;
    void (*run)(paper_report *report);
    double minutes; /* its share of the whole's time, on two quiet processors */
} paper_section;

/* Says how many measurements the section is going to make. */
void paper_plan(paper_report *report, int measurements);
/* The next measurement begins: how many seconds may it take? INFINITY where nobody asks. */
double paper_next_seconds(paper_report *report);
/* It has to be shorter than wanted. */
void paper_cut(paper_report *report);
/* Is the section's time used up? Then `what` and all that follows is left out, and the report says so. */
bool paper_time_is_up(paper_report *report, const char *what);

/* Adds a check; `goal` is text such as "<= 0.6". */
void paper_expect(paper_report *report, bool holds, double measured, const char *goal, const char *what, ...)
    __attribute__((format(printf, 5, 6)));

/* The program PROGRAM [--quick | --full | --minutes N] [--only SECTION]... [--table FILE] [--pictures FOLDER]: runs
 * the sections, or those named, and then prints the table of checks. Sections stop at their precision or at their
 * share of the time; minutes: of all sections together. Returns the exit status: 1 if one does not hold, 2 for wrong
 * usage. * `more_usage` (may be NULL) is a line more for the usage text. */
int paper_report_main(int argc, char **argv, paper_report *report, const paper_section *sections, int section_count,
                      const char *more_usage);

ca_scene *paper_scene(const char *file, const ca_define *defines, size_t count); /* below scenes/ */
void *paper_need(void *memory);                                                  /* dies of NULL */
double paper_mean(const double *values, size_t count);

#endif
