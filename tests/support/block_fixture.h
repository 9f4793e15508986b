/* An integrator that renders by blocks, made for tests: its every answer is known. And renders with it, whole and in
 * parts, whose files lie in a folder of their own. Functions fail the cmocka test on errors of their own. */
#ifndef CA_TEST_BLOCK_FIXTURE_H
#define CA_TEST_BLOCK_FIXTURE_H

#include "render/blocks.h"

#include <stdatomic.h>

enum {
    CA_BLOCK_WIDTH = 37,
    CA_BLOCK_HEIGHT = 21,
    CA_BLOCK_CROP_X = 3,
    CA_BLOCK_CROP_Y = 2,
    CA_BLOCK_PIXELS = CA_BLOCK_WIDTH * CA_BLOCK_HEIGHT,
    CA_BLOCK_PATH_SIZE = 160
};

/* What the integrator is to do, and what was asked of it. */
typedef struct ca_block_script {
    uint64_t first;      /* the block that must come first */
    uint64_t all;        /* there are no more blocks; 0: no end */
    uint64_t known_from; /* blocks_needed does not know before so many are done */
    uint64_t fail_at;    /* begin_block fails there; 0: never */
    bool learns;         /* blocks_needed knows only what the rows of the blocks so far tell */
    bool bad_samples;    /* pixel (5, 4) is not a number in every odd block */
    /* seen: */
    uint64_t begun, now;
    atomic_uint wrong_calls, pixels;
} ca_block_script;
extern ca_block_script ca_block_play;

/* What block `block` adds to the red of pixel (x, y), of so different sizes that sums of floats, and of doubles,
 * would depend on their order; to its green twice that of (y, x), to its blue 0.5. */
float ca_block_radiance(uint32_t x, uint32_t y, uint64_t block);
uint64_t ca_block_pairs(uint32_t x, uint64_t block);

typedef struct ca_block_job {
    uint32_t samples, threads;
    uint64_t blocks[2]; /* 0, 0: none given */
    double seconds;
    const char *part;
    bool gradients;
    uint64_t seed;
    long fail_allocation; /* from 1; 0: none */
    bool (*progress)(const ca_render_progress *progress, void *user);
    void *progress_user;
    const char *scene; /* another one */
} ca_block_job;

/* Plans for `path`, then swaps the integrator, as the plan of one that renders by blocks would be. */
ca_status ca_block_run(const ca_block_job *j, ca_image_layers **image, ca_render_statistics *statistics,
                       ca_error *error);
ca_image_layers *ca_block_rendered(const ca_block_job *j, ca_render_statistics *statistics);

/* Renders blocks into a part file of the folder. */
const char *ca_block_render_part(const char *name, uint64_t begin, uint64_t end, ca_block_job j);

const ca_attribute *ca_block_attribute(const ca_image_layers *image, const char *name);

/* The name of a file in the tests' folder; four answers are valid at once. */
const char *ca_block_file(const char *name);

/* Group setup and teardown: the folder. */
int ca_block_make_folder(void **state);
int ca_block_remove_folder(void **state);

/* A progress callback that ends the render after a number of blocks (0: never), and remembers what it was told. */
typedef struct ca_block_watcher {
    uint32_t stop_after, calls, last_done, last_total;
} ca_block_watcher;

bool ca_block_watch(const ca_render_progress *progress, void *user);

#endif
