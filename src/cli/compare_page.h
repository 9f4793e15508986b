/* The page of `caustica compare --html FILE`: which metrics and maps of a comparison it shows, under which names. */
#ifndef CA_CLI_COMPARE_PAGE_H
#define CA_CLI_COMPARE_PAGE_H

#include "cli/options.h"
#include "cli/stats_json.h"
#include "report/page.h"

typedef struct ca_compare_page {
    ca_page *page; /* owned */
    ca_page_settings settings;
    const char *reference; /* path; borrowed */
    bool has_reference;    /* the page has the reference */
} ca_compare_page;

/* `region` (borrowed while the page lives): what the metrics look at; layers: as ca_page_settings has them, or NULL.
 * Errors: those of ca_page_create. */
ca_status ca_compare_page_create(ca_compare_page *page, const char *path, const char *reference,
                                 const ca_compare_settings *region, const char *layers, ca_error *error);
/* Are the layers that the page is to have in any of these? `reference`: the one that is read already; images are read
 * until all names are found. Errors: CA_ERROR_ARGUMENT, and those of reading. */
ca_status ca_compare_page_check_layers(ca_compare_page *page, const ca_text_list *images,
                                       const ca_image_layers *reference, ca_error *error);
/* Adds a compared image, before the first one its reference of the same size. */
ca_status ca_compare_page_add(ca_compare_page *page, const ca_compared_image *image, const ca_image_layers *layers,
                              const ca_image_layers *reference, const ca_image_layers *maps, ca_error *error);
/* Writes the file. */
ca_status ca_compare_page_finish(ca_compare_page *page, ca_error *error);
/* Also of a page that is all zeros. */
void ca_compare_page_destroy(ca_compare_page *page);

#endif
