/* The images of a study: FOLDER/images/NAME-reference.exr and NAME-image.exr of each scenario. Each carries what it
 * was rendered with, scene files included, so that one that is there and was rendered with the same is not rendered
 * again. */
#ifndef CA_CLI_STUDY_RENDER_H
#define CA_CLI_STUDY_RENDER_H

#include "cli/places.h"
#include "cli/study_config.h"

typedef struct ca_study_work {
    const ca_study_config *config;
    const char *folder;
    uint32_t threads; /* 0: one per processor */
    bool quiet;
    double memory_mib; /* that reading a scene may take; 0: as usual */
    ca_places *places; /* the study's files, read and written */
} ca_study_work;

/* Where an image lies. The caller's to free with ca_free; NULL when out of memory. */
char *ca_study_image_path(const ca_study_work *work, uint32_t scenario, bool is_reference);

/* Makes the folders and renders what is missing; all scenes are read before the first is rendered, and no file that
 * they were read from is overwritten. *id: of the config and all that its images depend on. Errors: those of loading
 * and rendering, and CA_ERROR_UNSUPPORTED after a signal; what was complete by then is kept. */
ca_status ca_study_render_images(const ca_study_work *work, uint64_t *id, ca_error *error);

#endif
