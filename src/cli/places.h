/* The files of a command, read and written: none that is written may be one that is read, or another one that is
 * written. To be asked before the work starts.
 *
 * Files are the same that have the same device and inode, whatever they are called (links, "./"); of a file that is
 * not there yet, its folder's and its name, at the end of the symbolic links that the name may be. Errors:
 * CA_ERROR_ARGUMENT naming both files, CA_ERROR_MEMORY. Options and uses are borrowed, paths are copied. */
#ifndef CA_CLI_PLACES_H
#define CA_CLI_PLACES_H

#include "base/file.h"

typedef struct ca_place {
    char *path;         /* owned */
    const char *option; /* that writes it: "--stats"; NULL: it is read ... */
    const char *use;    /* ... and this is said of it: "which is the scene" */
    bool is_known;      /* false: not even its folder is there; then no place but the same text is the same */
    ca_file_identity identity; /* of the file, or of the folder in which it would be made */
    char *name; /* owned; in that folder; NULL: the file is there */
} ca_place;

typedef struct ca_places {
    ca_place *items; /* owned */
    size_t count, capacity;
} ca_places;

void ca_places_destroy(ca_places *places);

/* Notes a file that is read; an error where it is one that will be written. */
ca_status ca_places_read(ca_places *places, const char *path, const char *use, ca_error *error);
/* The same of all files that the scene was made from. */
ca_status ca_places_read_scene(ca_places *places, const ca_scene *scene, ca_error *error);
/* Notes a file that will be written; an error where it is one that is read or that will be written. */
ca_status ca_places_write(ca_places *places, const char *path, const char *option, ca_error *error);
/* The same without noting it: of many files that are known to differ from each other. */
ca_status ca_places_check(const ca_places *places, const char *path, const char *option, ca_error *error);
/* As ca_places_write, of a file FOLDER/NAME. */
ca_status ca_places_write_in(ca_places *places, const char *folder, const char *name, const char *option,
                             ca_error *error);

#endif
