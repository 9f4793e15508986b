/* The figures of paper 000 (Ershov, Birukov, Voloboy, Galaktionov, "Calculation of Noise Components for Bidirectional
 * Path Tracing with Photon Maps").
 *
 *     paper_000 [--quick | --full | --minutes N] [--only SECTION]... [--table FILE] [--pictures FOLDER]
 *
 * Sections: pictures, reading (figure 0 of docs/papers/000.md), radius, law (1), numbers (2), pilot (3), grid (4),
 * confidence (5), target (6). The report is Markdown; exit status 1 when something that the figures should show is
 * not so. */
#include "paper_000.h"

static const paper_section sections[] = {
    {"pictures", paper_000_pictures, 2.0},         {"reading", paper_000_reading, 4.0},
    {"radius", paper_000_radius, 4.0},             {"law", paper_000_law, 20.0},
    {"numbers", paper_000_numbers_of_rays, 14.0},  {"pilot", paper_000_pilot, 5.0},
    {"grid", paper_000_grid, 46.0},                {"confidence", paper_000_confidence, 14.0},
    {"target", paper_000_target, 8.0},
};

int main(int argc, char **argv)
{
    static paper_report report = {.link = "../pictures/paper-000"};
    paper_000_runs runs = {0};
    report.shared = &runs;
    const int status = paper_report_main(argc, argv, &report, sections, sizeof sections / sizeof sections[0], NULL);
    for (int i = 0; i < PAPER_000_SCENES; i++) paper_000_release(runs.at_paper_numbers[i]);
    return status;
}
