/* A folder of its own for a test program: made before its tests, removed with all that is in it after them. */
#ifndef CA_TESTS_SAMPLE_FOLDER_H
#define CA_TESTS_SAMPLE_FOLDER_H

extern char folder[64];

/* For cmocka_run_group_tests. */
int make_folder(void **unused);
int remove_folder(void **unused);

/* The path of a file in the folder; valid until the next call. */
const char *path_to(const char *name);

#endif
