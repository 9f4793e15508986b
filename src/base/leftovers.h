/* Temporary files (file.h) of writers that were killed: nobody removes them, and nobody needs them. A writer holds a
 * lock on its own as long as it lives, so that one at work is not taken for them. */
#ifndef CA_BASE_LEFTOVERS_H
#define CA_BASE_LEFTOVERS_H

/* Calls found(path, user) for each that lies beside the output `path`; none where the folder cannot be read. */
void ca_leftovers_find(const char *path, void (*found)(const char *path, void *user), void *user);
/* Likewise for each that lies in the folder, whatever it was to become. */
void ca_leftovers_find_in(const char *folder, void (*found)(const char *path, void *user), void *user);

#endif
