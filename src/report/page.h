/* One HTML file that shows pictures beside their reference: plain HTML, CSS and JavaScript, no network, opens from
 * the file system (docs/report.md).
 *
 *     ca_page_create(&page, "page.html", &settings, error);
 *     ca_page_add(page, &reference, error);      first, with is_reference
 *     for each picture: ca_page_add(page, &image, error);
 *     ca_page_finish(page, error);
 *
 * Pictures are written as they are added and may be freed then; memory is that of one channel at work, 5 bytes a
 * pixel. In the file names and metrics come first, then a small preview of each picture, then the colours of all,
 * then the rest, so that a browser shows much before it has read all. Disk: twice the file while it is made.
 *
 * What is kept of a channel (plane.h): R G B to the bit; other channels to 16 significant bits; maps to 12; the
 * standard errors of the pixels' values, which come from Variance.* and Samples.Y, and the distances from luminance
 * to ConfidenceLow.Y and ConfidenceHigh.Y, to 8. Other channels are kept where the settings name them.
 *
 * Texts may be any bytes: they are escaped, and the page refuses scripts and styles that are not its own. Same input,
 * same bytes. The file appears complete or not at all, and a kill before ca_page_finish leaves nothing on the
 * disk. */
#ifndef CA_REPORT_PAGE_H
#define CA_REPORT_PAGE_H

#include "metrics/compare.h"

#include <stdio.h>

/* Which of two values of a metric is better. */
typedef enum ca_page_better { CA_PAGE_NEITHER, CA_PAGE_LOWER, CA_PAGE_HIGHER } ca_page_better;

typedef struct ca_page_metric {
    const char *name;    /* a column's head */
    const char *meaning; /* one sentence; NULL: none */
    double value;        /* not finite: not known */
    ca_page_better better;
} ca_page_metric;

/* All borrowed until ca_page_add is back. */
typedef struct ca_page_image {
    const char *name;
    bool is_reference;
    const ca_image_layers *layers;   /* with R G B; all pictures of a page have one size */
    const ca_image_layers *maps;     /* NULL: none; each channel is a map by its name, of the same size */
    const ca_page_metric *metrics; /* the same columns for each picture that has any */
    size_t metric_count;
} ca_page_image;

typedef struct ca_page_settings {
    const char *title;
    const char *program; /* which page: its body is PROGRAM.html, run by PROGRAM.js (page_files.h); NULL: compare */
    void (*put_data)(FILE *stream,
                     const void *data); /* writes the JSON in the page's element "data"; NULL: there is none */
    const void *data;
    const char *layers;         /* channels to keep beside the above, "Albedo,N.X" (whole names or groups), or "all";
                                   NULL: none. A name that no picture has is an error when finishing. */
    const char *maps;           /* which of the pictures' maps to keep, names with commas; NULL: all */
    const ca_pixel_rect *roi;   /* what the metrics look at; NULL: everything */
    const ca_pixel_rect *masks; /* what they leave out */
    size_t mask_count;
} ca_page_settings;

typedef struct ca_page ca_page;

/* Errors: CA_ERROR_FILE, CA_ERROR_MEMORY. Path and settings are borrowed until the page is destroyed. */
ca_status ca_page_create(ca_page **page, const char *path, const ca_page_settings *settings, ca_error *error);
/* Looks which of the settings' layers a picture that will be added has, so that a wrong name is found before the
 * work: true once all names are found. ca_page_check: CA_ERROR_ARGUMENT with the first one that is not. */
bool ca_page_expect(ca_page *page, const ca_image_layers *layers);
ca_status ca_page_check(const ca_page *page, ca_error *error);
/* Errors: CA_ERROR_ARGUMENT (no R G B, another size; the message does not name the picture), CA_ERROR_MEMORY. */
ca_status ca_page_add(ca_page *page, const ca_page_image *image, ca_error *error);
/* Completes the file. The page is still to be destroyed. Errors: CA_ERROR_ARGUMENT (a layer that is nowhere),
 * CA_ERROR_FILE. */
ca_status ca_page_finish(ca_page *page, ca_error *error);
/* NULL is allowed. Without ca_page_finish there is no file. */
void ca_page_destroy(ca_page *page);

#endif
