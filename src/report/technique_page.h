/* One HTML page with a picture of each technique (film/technique_images.h), in the order that is known from
 * bidirectional path tracing: a row for each number of segments, a column for each technique. Plain HTML and CSS
 * with PNG pictures inside, no scripts, no network. Same input, same bytes. */
#ifndef CA_REPORT_TECHNIQUE_PAGE_H
#define CA_REPORT_TECHNIQUE_PAGE_H

#include "film/technique_images.h"

/* Pictures are reduced by a whole factor to at most so many pixels on either side. */
enum { CA_TECHNIQUE_PAGE_SIDE = 240 };

/* Writes DIRECTORY/index.html, complete or not at all. Weighted and unweighted pictures share one exposure, at which
 * the brightest hundredth of the image's pixels is white; weights are shown as they are. */
ca_status ca_technique_page_write(const ca_technique_images *images, uint32_t passes, const char *directory,
                                  ca_error *error);

#endif
