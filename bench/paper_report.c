#include "paper_report.h"

#include "base/clock.h"
#include "bench_support.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- Checks ---------------------------------------------------------------------------------------------------- */

void paper_expect(paper_report *report, bool holds, double measured, const char *goal, const char *what, ...)
{
    if (report->check_count == PAPER_CHECKS) fputs("too many checks for one report\n", stderr), exit(1);
    paper_check *check = &report->checks[report->check_count++];
    va_list arguments;
    va_start(arguments, what);
    vsnprintf(check->what, sizeof check->what, what, arguments);
    va_end(arguments);
    snprintf(check->measured, sizeof check->measured, "%.3g", measured);
    snprintf(check->goal, sizeof check->goal, "%s", goal);
    check->holds = holds;
}

/* The table of checks; returns how many do not hold. */
static int print_checks(paper_report *report)
{
    int failed = 0;
    fprintf(report->out, "### What it should show\n\n| what | measured | goal | |\n|---|---|---|---|\n");
    for (int i = 0; i < report->check_count; i++) {
        const paper_check *check = &report->checks[i];
        fprintf(report->out, "| %s | %s | %s | %s |\n", check->what, check->measured, check->goal,
                check->holds ? "holds" : "**does not hold**");
        failed += !check->holds;
    }
    if (failed) fprintf(report->out, "\n%d of these do not hold.\n", failed);
    return failed;
}

/* ---- Time ------------------------------------------------------------------------------------------------------ */

void paper_plan(paper_report *report, int measurements) { report->to_come = measurements; }

double paper_next_seconds(paper_report *report)
{
    const int sharers = report->to_come > 1 ? report->to_come : 1;
    report->to_come--;
    report->made++;
    return fmax(0.0, report->deadline - ca_clock_seconds()) / sharers;
}

void paper_cut(paper_report *report) { report->cut++; }

bool paper_time_is_up(paper_report *report, const char *what)
{
    if (ca_clock_seconds() < report->deadline) return false;
    fprintf(report->out, "\nLeft out, for the section's share of the time is used up: %s and what follows.\n\n", what);
    return true;
}

/* Without end where nobody looks at the time: a quick report is short by itself. */
static void start_section(paper_report *report, double minutes)
{
    report->deadline = report->quick || report->full ? (double)INFINITY : ca_clock_seconds() + 60.0 * minutes;
    report->to_come = report->made = report->cut = 0;
}

static void end_section(paper_report *report, const char *name, double start)
{
    if (report->cut > 0)
        fprintf(report->out,
                "%d of this section's %d measurements are shorter than wanted, for its share of the time; `FULL=1` "
                "makes them whole.\n\n",
                report->cut, report->made);
    fflush(report->out);
    fprintf(stderr, "%s: %.0f s\n", name, ca_clock_seconds() - start);
}

static double minutes_of_all(const paper_section *sections, int section_count)
{
    double minutes = 0.0;
    for (int i = 0; i < section_count; i++) minutes += sections[i].minutes;
    return minutes;
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

enum { MOST_CHOSEN = 16 };

typedef struct options {
    bool quick, full;
    double minutes; /* of all sections; 0: their own */
    const char *only[MOST_CHOSEN], *table, *pictures;
    int only_count; /* 0: all sections */
} options;

static bool parse_options(int argc, char **argv, options *chosen)
{
    *chosen = (options){0};
    for (int i = 1; i < argc; i++) {
        const bool more = i + 1 < argc;
        if (strcmp(argv[i], "--quick") == 0)
            chosen->quick = true;
        else if (strcmp(argv[i], "--full") == 0)
            chosen->full = true;
        else if (more && strcmp(argv[i], "--minutes") == 0 && (chosen->minutes = strtod(argv[i + 1], NULL)) > 0.0)
            i++;
        else if (more && strcmp(argv[i], "--only") == 0 && chosen->only_count < MOST_CHOSEN)
            chosen->only[chosen->only_count++] = argv[++i];
        else if (more && strcmp(argv[i], "--table") == 0)
            chosen->table = argv[++i];
        else if (more && strcmp(argv[i], "--pictures") == 0)
            chosen->pictures = argv[++i];
        else
            return false;
    }
    return true;
}

static bool is_chosen(const options *chosen, const char *section)
{
    for (int i = 0; i < chosen->only_count; i++)
        if (strcmp(chosen->only[i], section) == 0) return true;
    return chosen->only_count == 0;
}

static bool are_known(const options *chosen, const paper_section *sections, int section_count)
{
    for (int i = 0; i < chosen->only_count; i++) {
        bool known = false;
        for (int k = 0; k < section_count; k++) known |= strcmp(chosen->only[i], sections[k].name) == 0;
        if (!known) return false;
    }
    return true;
}

static int print_usage(const char *program, const paper_section *sections, int section_count, const char *more_usage)
{
    fprintf(stderr, "usage: %s [--quick | --full | --minutes N] [--only SECTION]... [--table FILE] [--pictures FOLDER]\n",
            program);
    if (more_usage) fprintf(stderr, "       %s %s\n", program, more_usage);
    fputs("sections:", stderr);
    for (int i = 0; i < section_count; i++) fprintf(stderr, " %s", sections[i].name);
    fputc('\n', stderr);
    return 2;
}

int paper_report_main(int argc, char **argv, paper_report *report, const paper_section *sections, int section_count,
                      const char *more_usage)
{
    options chosen;
    if (!parse_options(argc, argv, &chosen) || !are_known(&chosen, sections, section_count))
        return print_usage(argv[0], sections, section_count, more_usage);
    report->out = chosen.table ? fopen(chosen.table, "w") : stdout;
    report->pictures = chosen.pictures;
    report->quick = chosen.quick;
    report->full = chosen.full;
    const double scale = chosen.minutes > 0.0 ? chosen.minutes / minutes_of_all(sections, section_count) : 1.0;
    if (!report->out) return perror(chosen.table), 1;
    for (int i = 0; i < section_count; i++) {
        if (!is_chosen(&chosen, sections[i].name)) continue;
        const double start = ca_clock_seconds();
        start_section(report, scale * sections[i].minutes);
        sections[i].run(report);
        end_section(report, sections[i].name, start);
    }
    const int failed = print_checks(report);
    return (chosen.table && fclose(report->out) != 0) || failed > 0;
}

/* ---- Small things ---------------------------------------------------------------------------------------------- */

void *paper_need(void *memory)
{
    if (!memory) fputs("out of memory\n", stderr), exit(1);
    return memory;
}

ca_scene *paper_scene(const char *file, const ca_define *defines, size_t count)
{
    char path[512];
    ca_scene *scene;
    ca_error error;
    snprintf(path, sizeof path, "%s/scenes/%s", CA_SOURCE_DIR, file);
    if (ca_scene_load(path, defines, count, &scene, &error) != CA_OK) bench_die(path, &error);
    return scene;
}

double paper_mean(const double *values, size_t count)
{
    double sum = 0.0;
    for (size_t i = 0; i < count; i++) sum += values[i];
    return sum / (double)count;
}
