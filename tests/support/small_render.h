/* A scene of 8 x 6 pixels that every integrator renders in no time (a ball of glass above a floor, a small light),
 * and a folder for what is written. Functions fail the cmocka test on errors of their own. */
#ifndef CA_TEST_SMALL_RENDER_H
#define CA_TEST_SMALL_RENDER_H

#include "caustica.h"

/* The scene's text; its definition `grey` is the floor's reflectance. */
extern const char *const scene_xml;
extern ca_scene *scene;

/* For cmocka_run_group_tests: make the folder, with the scene in scene.xml, and load it; remove all again. */
int begin_small_renders(void **state);
int end_small_renders(void **state);

/* The path of a file in the folder: valid until the end. */
const char *file(const char *name);

ca_render_settings settings_of(const char *integrator, uint32_t samples, uint32_t threads);

/* The hash of the scene's image; `statistics` may be NULL. */
uint64_t render(const ca_render_settings *settings, ca_render_statistics *statistics);

/* The name of the i-th integrator; NULL: there are not so many. */
const char *integrator_at(size_t i);
/* Is it one that chooses another one? */
bool chooses(size_t i);

#endif
