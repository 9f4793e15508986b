/* The page that runs a study: its images, what FLIP says of each pair, and how it is to be shown (docs/study.md). */
#ifndef CA_CLI_STUDY_PAGE_H
#define CA_CLI_STUDY_PAGE_H

#include "cli/study_render.h"

/* Writes FOLDER/index.html from the images that ca_study_render_images has made. */
ca_status ca_study_write_page(const ca_study_work *work, uint64_t id, ca_error *error);

#endif
