/* Renders in which the bidirectional engine also measures pairs of paths (film/pair_film.h), and what must hold of
 * every one of them. Scenes have films of PAIR_FILM_WIDTH x PAIR_FILM_HEIGHT; a crop of CROP_PIXELS is rendered.
 * Functions fail the cmocka test on errors, but for try_pair_render. */
#ifndef CA_TEST_PAIR_RENDER_H
#define CA_TEST_PAIR_RENDER_H

#include "film/pair_film.h"
#include "render/render.h"

/* The numbers stand in scenes' XML, as texts. */
#define PAIR_FILM_WIDTH "10"
#define PAIR_FILM_HEIGHT "9"
enum { CROP_WIDTH = 8, CROP_HEIGHT = 7, CROP_PIXELS = CROP_WIDTH * CROP_HEIGHT };

typedef struct pair_render {
    const char *integrator; /* without numbers of paths */
    uint32_t light_paths, camera_paths, passes, threads;
    uint64_t seed;
    const char *sampler; /* NULL: the default */
    double memory_mib;   /* 0: the default */
    const ca_pair_numbers *others; /* whose weights are measured with, too */
    uint32_t other_count;
} pair_render;

/* `film` NULL: pairs are not wanted; else it is made, and stays the caller's after success only, as does *image. A
 * sample that is not finite fails the test. */
ca_status try_pair_render(const ca_scene *scene, const pair_render *r, ca_pair_film *film, ca_image_layers **image,
                          ca_error *error);

/* The image, with a film that is complete. */
ca_image_layers *render_pairs(const ca_scene *scene, const pair_render *r, ca_pair_film *film);

/* The image has the same bits with and without pairs, and both, and what is said of pairs, from 1, 2 and 3
 * threads. */
void check_pair_bits(const ca_scene *scene, const char *integrator, uint32_t light_paths, uint32_t camera_paths);

/* The pixels' values are the image's luminance: nothing is forgotten or counted twice. */
void check_pair_values(const ca_scene *scene, const pair_render *r);

/* Every allocation fails once: the render does, or the film says that it is incomplete, which it must at least so
 * often. */
void check_pair_allocations(const ca_scene *scene, const pair_render *r, uint32_t least_incomplete);

#endif
