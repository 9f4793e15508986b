/* Named channels of one size, with attributes: what a film is developed into, what EXR files hold.
 *
 * Channel names follow EXR: "R", "Albedo.R", "Variance.B", "Samples.Y". Every channel is width * height floats,
 * row 0 on top, and is written as 32 bit float, or as half where `half` is set. The data window keeps the crop's
 * place in the full picture. Attributes are text or numbers, written into the EXR header in this order. */
#ifndef CA_IMAGE_LAYERS_H
#define CA_IMAGE_LAYERS_H

#include "base/memory.h"
#include "base/status.h"

typedef struct ca_channel {
    const char *name; /* in the arena */
    float *data;      /* owned */
    bool half;
} ca_channel;

typedef struct ca_attribute {
    const char *name;
    const char *text; /* NULL: it is the number */
    double number;
} ca_attribute;

struct ca_image_layers {
    uint32_t width, height;           /* of the data */
    uint32_t full_width, full_height; /* of the whole picture: EXR's display window */
    int32_t x0, y0;                   /* where the data lies in it: EXR's data window */
    ca_channel *channels;
    size_t channel_count, channel_capacity;
    ca_attribute *attributes;
    size_t attribute_count, attribute_capacity;
    ca_arena names;
};

ca_status ca_layers_create(ca_image_layers **layers, uint32_t width, uint32_t height, ca_error *error);
void ca_layers_destroy(ca_image_layers *layers);
/* Adds a zeroed channel; *data is borrowed from the layers. */
ca_status ca_layers_add(ca_image_layers *layers, const char *name, float **data, ca_error *error);
/* Takes away the channels from number `count` on. */
void ca_layers_cut(ca_image_layers *layers, size_t count);
/* NULL where there is none of that name. */
const float *ca_layers_find(const ca_image_layers *layers, const char *name);
/* The attribute of that name; NULL where there is none. */
const ca_attribute *ca_layers_attribute(const ca_image_layers *layers, const char *name);
ca_status ca_layers_set_text(ca_image_layers *layers, const char *name, const char *text, ca_error *error);
ca_status ca_layers_set_number(ca_image_layers *layers, const char *name, double number, ca_error *error);

/* All channels and attributes of an EXR file (its first part, in full size), or R G B of a PFM, PNG (decoded to
 * linear), HDR. */
ca_status ca_layers_read(const char *path, ca_image_layers **layers, ca_error *error);

/* Writes all channels: .exr; the R G B channels: .png (sRGB, values times 2^exposure clipped to [0, 1], 8 bit), .pfm.
 * The extension decides. Complete or not at all. */
ca_status ca_layers_write(const ca_image_layers *layers, const char *path, float exposure, ca_error *error);
/* CA_ERROR_ARGUMENT, naming the formats there are, where `path` has none of the extensions above: asked before a
 * render starts, so that hours of work are not lost to a typing error. */
ca_status ca_layers_check_path(const char *path, ca_error *error);

#endif
