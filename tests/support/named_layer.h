/* A layer of an image, by its name; the test fails where it is not there. */
#ifndef CA_TEST_NAMED_LAYER_H
#define CA_TEST_NAMED_LAYER_H

#include "image/layers.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

/* Its pixels: they may be written to, as the image is the test's own. */
static inline float *named_layer(const ca_image_layers *image, const char *name)
{
    for (size_t i = 0; i < image->channel_count; i++)
        if (strcmp(image->channels[i].name, name) == 0) return image->channels[i].data;
    fail_msg("no layer %s", name);
    return NULL;
}

static inline float layer_at(const ca_image_layers *image, const char *name, uint32_t pixel)
{
    return named_layer(image, name)[pixel];
}

#endif
