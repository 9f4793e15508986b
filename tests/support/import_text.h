/* Helpers of the import tests: scenes from strings, files in a temporary folder, exact checks of error messages. */
#ifndef CA_TESTS_IMPORT_TEXT_H
#define CA_TESTS_IMPORT_TEXT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "import/import.h"

/* A scene with a sensor; the body begins at line 2, column 1. */
#define SCENE(body) "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n" body "\n</scene>\n"

/* The folder of the running test program, removed by import_remove_folder: its group's teardown. */
const char *import_folder(void);
int import_remove_folder(void **state);
/* Writes a file into it and returns its path, which lives until the next 16 calls. */
const char *import_write(const char *name, const void *data, size_t size);
const char *import_write_text(const char *name, const char *text);
/* A triangle with texture coordinates as "triangle.obj", and a picture of 2 x 2 pixels as "picture.pfm": rows from
 * above (1, 0, 0) (0, 1, 0) / (0, 0, 1) (2, 2, 2). */
void import_write_triangle(void);
void import_write_picture(void);

/* The scene is called <folder>/test.xml. Fails the test with the message where it does not import. */
void import_text(ca_scene_desc *desc, const char *text, const ca_define *defines, size_t define_count);
/* Renders a scene that is called <folder>/`name`, with the settings of its own and one thread. Fails the test on
 * error. */
struct ca_image_layers *import_render_text(const char *text, const char *name);
/* Fails the test unless the import fails with exactly "<folder>/test.xml:" before `expected`. */
void import_expect_error(const char *text, const char *expected);

#endif
