/* All that the image of a render by blocks depends on, but the blocks, as text: lines "name value". Part files with
 * equal texts belong together. The files a scene is made of count with their contents, not with their places. */
#ifndef CA_RENDER_PART_SETTINGS_H
#define CA_RENDER_PART_SETTINGS_H

#include "render/render.h"

/* The caller frees the text with ca_free. */
ca_status ca_part_settings_make(const ca_render_plan *plan, char **text, ca_error *error);

/* Copies the value of a line. false, and an empty text: there is no such line, or it is longer than `size` allows. */
bool ca_part_settings_find(const char *text, const char *name, char *value, size_t size);

/* Are the texts equal? If not, *a and *b are moved to their first lines that differ. */
bool ca_part_settings_equal(const char **a, const char **b);

#endif
