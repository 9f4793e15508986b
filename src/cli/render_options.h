/* The words of caustica render: what they set, the text of --help, and what must be right before the work begins. */
#ifndef CA_CLI_RENDER_OPTIONS_H
#define CA_CLI_RENDER_OPTIONS_H

#include "cli/commands.h"
#include "cli/keep.h"
#include "cli/outputs.h"

typedef struct ca_render_options {
    ca_text_list outputs, define_words;
    const char *scene, *camera, *stats;
    ca_render_settings settings; /* options are read right into it */
    uint32_t resolution[2], sensor;
    ca_output_look look;
    const char *tone;
    ca_layer_choice layers;
    const char *serve_address, *tev;
    uint32_t port;
    bool serves;
    bool has_spp, has_seconds, has_noise;
    bool quiet, help;
    ca_places places;
    ca_keep keep;
    char *made[2]; /* owned: names of outputs that were not given */
} ca_render_options;

int ca_render_options_help(void);

/* To be destroyed whatever comes of it. Errors: CA_ERROR_ARGUMENT and what opening files may give. */
ca_status ca_render_options_read(ca_render_options *o, int word_count, char *const words[], ca_error *error);
void ca_render_options_destroy(ca_render_options *o);

#endif
