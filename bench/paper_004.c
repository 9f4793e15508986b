/* The figures of paper 004 (Keller, Grünschloß, Droske, "Quasi-Monte Carlo Progressive Photon Mapping").
 *
 *     paper_004 [--quick | --full | --minutes N] [--only SECTION] [--table FILE] [--pictures FOLDER]
 *     paper_004 --difference IMAGE IMAGE
 *
 * Sections: transport, counter-examples, convergence, alpha, balance, ratio, recomputation, samples. The report is
 * Markdown; exit status 1 when something that the figures should show is not so. The second form prints how many
 * pixels of two pictures differ, and by how much. */
#include "paper_004.h"

#include "bench_support.h"
#include "image/layers.h"

#include <math.h>
#include <string.h>

static const paper_section sections[] = {
    {"transport", paper_transport, 2.0},
    {"counter-examples", paper_counter_examples, 8.0},
    {"convergence", paper_convergence, 40.0},
    {"alpha", paper_alpha, 12.0},
    {"balance", paper_balance, 20.0},
    {"ratio", paper_ratio, 14.0},
    {"recomputation", paper_recomputation, 2.0},
    {"samples", paper_samples_saved, 12.0},
};
enum { SECTIONS = sizeof sections / sizeof sections[0] };

/* ---- Two builds ------------------------------------------------------------------------------------------------ */

static ca_image_layers *read_image(const char *path)
{
    ca_image_layers *image;
    ca_error error;
    if (ca_layers_read(path, &image, &error) != CA_OK) bench_die(path, &error);
    return image;
}

static int print_difference(const char *const paths[2])
{
    static const char *const names[3] = {"R", "G", "B"};
    ca_image_layers *images[2] = {read_image(paths[0]), read_image(paths[1])};
    const size_t pixels = (size_t)images[0]->width * images[0]->height;
    size_t differ = 0;
    double largest = 0.0;
    if (images[1]->width != images[0]->width || images[1]->height != images[0]->height)
        return fprintf(stderr, "%s and %s differ in size\n", paths[0], paths[1]), 1;
    for (size_t p = 0; p < pixels; p++) {
        bool same = true;
        for (int c = 0; c < 3; c++) {
            const float *a = ca_layers_find(images[0], names[c]), *b = ca_layers_find(images[1], names[c]);
            if (!a || !b) return fprintf(stderr, "%s and %s must have R, G and B\n", paths[0], paths[1]), 1;
            if (a[p] == b[p]) continue;
            same = false;
            largest = fmax(largest, fabs((double)a[p] - (double)b[p]) / fmax(fabs((double)a[p]), fabs((double)b[p])));
        }
        differ += !same;
    }
    printf("%zu of %zu pixels differ (%.2f %%), the largest relative difference is %.2g", differ, pixels,
           100.0 * (double)differ / (double)pixels, largest);
    for (int i = 0; i < 2; i++) ca_image_release(images[i]);
    return 0;
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

int main(int argc, char **argv)
{
    static paper_report report = {.link = "../pictures/paper-004"};
    if (argc == 4 && strcmp(argv[1], "--difference") == 0)
        return print_difference((const char *const[2]){argv[2], argv[3]});
    return paper_report_main(argc, argv, &report, sections, SECTIONS, "--difference IMAGE IMAGE");
}
