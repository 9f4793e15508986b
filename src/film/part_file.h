/* Part files: the exact sums of a range of blocks, with all that tells whether two of them belong together.
 *
 * Layout, little endian, every piece a multiple of 8 bytes: 8 bytes of magic; the fields of part_file.c, 8 bytes
 * each; two texts (settings, scene path) filled up with zeros; the film row by row (block_film.h); a hash of all
 * before it (base/hash.h). Size: that of the film in memory, and some hundred bytes. Reading trusts nothing: a file
 * that is too short or too long, damaged or of another version is refused (CA_ERROR_FORMAT) before memory is taken
 * for what it claims to hold. */
#ifndef CA_FILM_PART_FILE_H
#define CA_FILM_PART_FILE_H

#include "base/file.h"
#include "film/block_film.h"

enum { CA_PART_COUNTS = 16 };

typedef struct ca_part {
    char *settings;     /* owned; lines "name value\n": what the image depends on, to be equal among parts */
    char *scene_path;   /* owned; as it was given; may differ */
    uint64_t blocks[2]; /* half open */
    uint64_t counts[CA_PART_COUNTS]; /* totals over the range, of whatever the writer counts */
    double seconds;                  /* of rendering */
    /* Camera paths that every pixel has had, each with all light paths so far, after blocks [0, blocks[1]); as far as
     * this range can tell. And the next larger number of blocks, with how many it is enough for; 0: not known. */
    double samples_per_pixel, next_samples;
    uint64_t next_blocks;
    uint32_t threads;
    ca_block_film *film; /* owned */
} ca_part;

/* Complete or not at all. */
ca_status ca_part_write(const ca_part *part, const char *path, ca_error *error);
/* On failure *part is empty. */
ca_status ca_part_read(const char *path, ca_part *part, ca_error *error);
/* The same of a file's bytes; `path` is what messages call it. */
ca_status ca_part_decode(const char *path, const ca_bytes *bytes, ca_part *part, ca_error *error);
void ca_part_destroy(ca_part *part);

/* A file that is read but for its film, which can be added to another one without being made. */
typedef struct ca_part_file {
    ca_part part; /* without a film */
    ca_block_film_desc film;
    ca_bytes bytes; /* of the whole file ... */
    size_t rows;    /* ... and where its film begins */
} ca_part_file;

/* Checks as ca_part_read does. On failure nothing is open. */
ca_status ca_part_file_open(ca_part_file *file, const char *path, ca_error *error);
/* To a film of the same description. */
void ca_part_file_add(const ca_part_file *file, ca_block_film *film);
void ca_part_file_close(ca_part_file *file); /* one that is not open is allowed */

/* Does the name end in ".part"? */
bool ca_part_is_path(const char *path);

#endif
