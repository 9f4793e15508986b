/* Scenes written in the test itself, and renders of them. */
#ifndef CA_TEST_SCENE_TEXT_H
#define CA_TEST_SCENE_TEXT_H

#include "caustica.h"

/* Loads a scene from XML text (through a temporary file); fails the test on error. */
ca_scene *scene_from_text(const char *xml);

/* Loads scenes/NAME.xml, with the definition if it is not NULL; fails the test on error. */
ca_scene *bundled_scene_with(const char *name, const ca_define *define);
ca_scene *bundled_scene(const char *name);

/* Renders with the settings; fails the test on error or on a sample that is not finite. */
ca_image_layers *render_scene(const ca_scene *scene, const ca_render_settings *settings);

/* Renders again and again, with memory for some more allocations each time, until it succeeds; before that the only
 * failure may be that of memory. How many allocations sufficed. */
long render_without_memory(const ca_scene *scene, const ca_render_settings *settings);

/* Mean over pixels and the standard error of that mean, of one channel, from Variance.* and Samples.Y. */
void channel_mean(const ca_image_layers *image, const char *channel, double *mean, double *standard_error);

/* The largest difference of R, G or B between pictures of one size, over the mean of `b`, which is not black. */
double picture_difference(const ca_image_layers *a, const ca_image_layers *b);

/* A hash of all channels of an image, for bit-for-bit comparison. */
uint64_t image_hash(const ca_image_layers *image);
/* Of the image that render_scene makes. */
uint64_t rendered_hash(const ca_scene *scene, const ca_render_settings *settings);

/* The folder of the shared reference scenes: $CAUSTICA_SCENES or ../shared/scenes; NULL, with a loud message, where
 * neither exists. Borrowed. */
const char *reference_scenes(void);

/* Of the attribute of that name, which must be there and be a text. */
const char *attribute_text(const ca_image_layers *image, const char *name);

#endif
