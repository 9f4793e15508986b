/* The page's sources (*.html, *.css, *.js of this folder) as cmake/EmbedFiles.cmake put them into the library. A
 * script or style is run by a browser only if its hash stands in the page's Content-Security-Policy. */
#ifndef CA_REPORT_PAGE_FILES_H
#define CA_REPORT_PAGE_FILES_H

#include <stddef.h>

typedef struct ca_page_file {
    const char *name;          /* "viewer.js" */
    const unsigned char *data; /* UTF-8, followed by one zero byte */
    size_t size;
    unsigned char sha256[32];
} ca_page_file;

extern const ca_page_file ca_page_files[];
extern const size_t ca_page_file_count;

/* The one of this name, which is there. */
const ca_page_file *ca_page_file_named(const char *name);

#endif
