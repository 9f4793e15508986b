/* A folder of its own for a test program: made before its tests, removed with all that is in it after them. And what
 * is tested there with all sample files. */
#ifndef CA_TESTS_SAMPLE_FOLDER_H
#define CA_TESTS_SAMPLE_FOLDER_H

#include <stdbool.h>

extern char folder[64];

/* For cmocka_run_group_tests. */
int make_folder(void **unused);
int remove_folder(void **unused);

/* The path of a file in the folder; valid until the next call. */
const char *path_to(const char *name);

/* Reads all sample files that are meshes, or all that are images, with each allocation failing once: that is what is
 * reported. There are at least so many of them for every file. */
void check_sample_allocations(bool meshes, long least);

#endif
