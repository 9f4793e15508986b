/* Files of passes: the sums of a render's passes, with all that tells whether two of them belong together. Parts of
 * a render, which add up to the whole to the bit, and checkpoints, from which a render goes on, are the same.
 *
 * Layout: pieces as in part_stream.h. The magic; the format's number, CA_PASS_PART_FORMAT (blocks of pairs have
 * another one, part_file.h); the fields of pass_part.c; the ranges of passes, two numbers each; three texts
 * (settings, record, scene path); numbers of rays, 4 bytes a pixel, where all passes have those of a file or of one
 * choice; the film row by row (film.h); a hash of all before it. Size: that of the film in memory or less, and some
 * hundred bytes. Reading trusts nothing: a file that is too short or too long, damaged or of another version is
 * refused (CA_ERROR_FORMAT) before memory is taken for what it claims to hold. Only a row of a file's film is in
 * memory. */
#ifndef CA_FILM_PASS_PART_H
#define CA_FILM_PASS_PART_H

#include "film/film.h"
#include "film/part_file.h"

enum { CA_PASS_PART_RANGES = 1 << 16 /* at most */ };

/* Passes, half open. */
typedef struct ca_pass_range {
    uint64_t begin, end;
} ca_pass_range;

/* When the noise is looked at: what a render that goes on needs to know (render/noise_looks.h). */
typedef struct ca_pass_looks {
    double target, next, noise;
} ca_pass_looks;

typedef struct ca_pass_part {
    char *settings;        /* owned; lines "name value\n": what the image depends on, to be equal among parts */
    char *record;          /* owned; likewise: what was decided while rendering, and from what */
    char *scene_path;      /* owned; as it was given; may differ */
    ca_pass_range *ranges; /* owned; in order, apart from each other */
    size_t range_count;
    uint64_t counts[CA_PART_COUNTS]; /* totals over all passes, of whatever the writer counts */
    double seconds;                  /* of rendering */
    ca_pass_looks looks;
    uint32_t threads;
    uint32_t light_paths;   /* of a pass, where all have the numbers of a file or of one choice; else 0. Likewise: */
    uint32_t *camera_paths; /* owned; of each pixel */
} ca_pass_part;

void ca_pass_part_destroy(ca_pass_part *part);

/* Of all ranges. */
uint64_t ca_pass_part_passes(const ca_pass_part *part);

/* Writes it with the sums of its passes (a film that adds up in parts). Complete or not at all, and on the disk when
 * it returns. */
ca_status ca_pass_part_write(const ca_pass_part *part, const ca_film *film, const char *path, ca_error *error);

/* What the film of a file is like. */
typedef struct ca_pass_film_desc {
    uint32_t full_width, full_height, crop[4], replicate_samples;
    float extent;
} ca_pass_film_desc;

ca_pass_film_desc ca_pass_film_described(const ca_film *film);
bool ca_pass_film_desc_equal(const ca_pass_film_desc *a, const ca_pass_film_desc *b);
/* A film like that, without samples. */
ca_status ca_pass_film_create(ca_film *film, const ca_pass_film_desc *desc, ca_error *error);

/* A file that is open: all but its film is read and checked. */
typedef struct ca_pass_reader {
    const char *path; /* borrowed */
    FILE *stream;
    ca_pass_part part;
    ca_pass_film_desc film;
} ca_pass_reader;

/* On failure nothing is open. */
ca_status ca_pass_reader_open(ca_pass_reader *reader, const char *path, ca_error *error);
/* Adds the file's sums to a film of the same description; `first`: which has none yet. Once. */
ca_status ca_pass_reader_add(ca_pass_reader *reader, ca_film *film, bool first, ca_error *error);
void ca_pass_reader_close(ca_pass_reader *reader); /* one that is not open is allowed */

#endif
