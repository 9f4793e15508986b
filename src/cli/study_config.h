/* The design of a perceptual study as its JSON file says it (docs/study.md): what is rendered, what a subject sees,
 * for how long, and what is asked. */
#ifndef CA_CLI_STUDY_CONFIG_H
#define CA_CLI_STUDY_CONFIG_H

#include "cli/json_document.h"

/* Of a scenario: what the hypothesis compares. */
typedef enum ca_study_light { CA_STUDY_LIGHT_NONE, CA_STUDY_LIGHT_VISIBLE, CA_STUDY_LIGHT_OCCLUDED } ca_study_light;

/* Said of the light in study.json, on the page and in its answers; "" for none. */
const char *ca_study_light_name(ca_study_light light);
/* false where there is no light of that name. */
bool ca_study_light_find(const char *name, ca_study_light *light);

/* How an image is made. */
typedef struct ca_study_render {
    const char *integrator, *sampler; /* NULL: as the scene says */
    uint32_t spp, seed;
} ca_study_render;

typedef struct ca_study_scenario {
    const char *name;  /* letters, digits, - and _: part of file names */
    const char *scene; /* as written */
    char *path;        /* owned; the scene seen from the folder of study.json */
    const char *light_name;
    ca_study_light light;
    const char *pair; /* scenarios of one pair differ in their light alone; NULL: none */
    const ca_json_value *define;
    ca_define *defines; /* owned */
    size_t define_count;
} ca_study_scenario;

typedef struct ca_study_config {
    ca_json *document; /* owned; texts are borrowed from it */
    const char *title, *question, *yes, *no;
    double seconds;  /* both images are shown */
    uint32_t screens; /* 1: side by side, 2: a window for each image */
    double viewing_distance, monitor_spacing; /* metres */
    double pixel_pitch;  /* metres from one pixel of the screen to the next */
    uint32_t magnify;    /* pixels of the screen on a side of an image's pixel */
    double exposure;     /* stops */
    bool random_sides;   /* else the reference is left */
    uint32_t width, height; /* of all images; 0: as the scenes say */
    ca_study_render image, reference;
    ca_study_scenario *scenarios; /* owned */
    uint32_t scenario_count;
} ca_study_config;

/* Errors: CA_ERROR_FILE, CA_ERROR_MEMORY, CA_ERROR_FORMAT with line and column and what was expected. The path is
 * borrowed. */
ca_status ca_study_config_read(const char *path, ca_study_config *config, ca_error *error);
/* Also of a config that is all zeros. */
void ca_study_config_destroy(ca_study_config *config);

/* Pixels of an image in a degree of a subject's sight. */
double ca_study_pixels_per_degree(const ca_study_config *config);

#endif
