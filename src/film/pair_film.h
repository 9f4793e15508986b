/* Per pixel, over independent iterations: sums of the noise estimators and of their products, from which
 * noise/components.h makes components, predictions and standard errors.
 *
 * State: 208 bytes a pixel, and 320 more where camera paths connect to light paths; 168 more for each film of other
 * numbers. Where only means are kept 40 bytes, 56 more with connections, and 96 for each film of other
 * numbers. Threads: different pixels at once; a pixel's iterations come in order. */
#ifndef CA_FILM_PAIR_FILM_H
#define CA_FILM_PAIR_FILM_H

#include "base/status.h"
#include "film/pair_sums.h"

/* Indices of what is summed. */
enum { CA_PAIR_VALUE, CA_PAIR_PAIR, CA_PAIR_CAMERA, CA_PAIR_LIGHT, CA_PAIR_QUANTITIES };

typedef struct ca_pair_pixel {
    double sums[CA_PAIR_QUANTITIES];
    double products[10]; /* of quantities a <= b, in the order 00 01 02 03 11 12 13 22 23 33 */
    double cubes, fourths; /* of the value */
    uint64_t iterations;
} ca_pair_pixel;

/* Of connections beside them; these quantities are numbered behind the others. */
enum {
    CA_PAIR_CONNECTED = CA_PAIR_QUANTITIES,
    CA_PAIR_CONNECTED_SQUARE,
    CA_PAIR_CONNECTED_PAIR,
    CA_PAIR_CONNECTED_CAMERA,
    CA_PAIR_CONNECTED_LIGHT,
    CA_PAIR_ALL_QUANTITIES
};

typedef struct ca_pair_connections {
    double sums[CA_PAIR_ALL_QUANTITIES - CA_PAIR_QUANTITIES];
    double products[35]; /* of quantities a <= b, b one of these: 04 14 24 34 44 05 15 ... 88 */
} ca_pair_connections;

/* What the means of the quantities and an estimate of L^2 without bias are made of: no standard errors, no
 * prediction's error, no sample variance's. */
typedef struct ca_pair_means {
    double sums[CA_PAIR_QUANTITIES];
    double squares; /* of the value */
} ca_pair_means;

/* The same of connections. */
typedef struct ca_pair_connected_means {
    double sums[CA_PAIR_ALL_QUANTITIES - CA_PAIR_QUANTITIES];
    double cross, squares; /* of what connections bring: times the value, and squared */
} ca_pair_connected_means;

/* Of a pixel: both. */
enum { CA_PAIR_OTHER_MEANS_BYTES = 96 };

/* N_F, N_B. */
typedef struct ca_pair_numbers {
    uint32_t light_paths, camera_paths;
} ca_pair_numbers;

typedef struct ca_pair_film {
    uint32_t x0, y0, width, height; /* the rendered part of the film */
    uint32_t light_paths, camera_paths; /* N_F, N_B of every iteration */
    ca_pair_pixel *pixels;          /* owned; NULL: only means are kept */
    ca_pair_means *means;           /* owned; one a pixel, instead of `pixels` */
    ca_pair_connected_means *connected_means; /* owned; likewise of connections; NULL: not wanted */
    ca_pair_connections *connections; /* owned; one a pixel; NULL: not wanted */
    ca_pair_moments *made;          /* owned; of the iteration at work, one a pixel; NULL: that is added at once */
    bool incomplete;                /* atomic: a worker ran out of memory */
    bool idle; /* the pass to come has no pairs: what an integrator does only for other numbers is left out */
    struct ca_pair_film *others;    /* owned; [other_count]: ca_pair_film_add_others */
    uint32_t other_count;
} ca_pair_film;

ca_status ca_pair_film_create(ca_pair_film *film, const uint32_t crop[4], uint32_t light_paths, uint32_t camera_paths,
                              ca_error *error);
/* For means alone. N_F is set before each iteration. */
ca_status ca_pair_film_create_means(ca_pair_film *film, const uint32_t crop[4], ca_error *error);
/* Before the first iteration: sums of connections too. */
ca_status ca_pair_film_connect(ca_pair_film *film, ca_error *error);
/* Before the first iteration, and before connections; once: beside the film one of means for each of these numbers.
 * Its paths are the same, but have the weights that they have where an iteration has so many. Its N_F and N_B are
 * these numbers, with which the law of noise holds for it. */
ca_status ca_pair_film_add_others(ca_pair_film *film, const ca_pair_numbers *numbers, uint32_t count,
                                  ca_error *error);
void ca_pair_film_destroy(ca_pair_film *film);

/* An iteration's moments of pixel (x, y) of the full film. */
void ca_pair_film_add(ca_pair_film *film, uint32_t x, uint32_t y, const ca_pair_moments *moments);

/* The same in two steps: what is held counts from the commit on, which comes once the whole iteration is there. A
 * film of means alone adds at once: an iteration that is not complete is followed by no other there, and nothing is
 * learned. */
void ca_pair_film_hold(ca_pair_film *film, uint32_t x, uint32_t y, const ca_pair_moments *moments);
void ca_pair_film_commit(ca_pair_film *film, uint32_t x, uint32_t y);

/* Adds what another film of the same pixels has summed up, as if it had been the iterations of one; sign -1 takes it
 * out again. Both have `pixels`, without connections and others; or both have `means`, and alike all else. */
void ca_pair_film_pool(ca_pair_film *film, const ca_pair_film *other, int sign);

/* Index of the product of two quantities in `products`. */
static inline int ca_pair_product(int a, int b)
{
    const int low = a < b ? a : b, high = a < b ? b : a;
    return low * (2 * CA_PAIR_QUANTITIES - low - 1) / 2 + high;
}

/* Of two quantities, at least one of connections, in theirs. */
static inline int ca_pair_connected_product(int a, int b)
{
    const int low = a < b ? a : b, high = a < b ? b : a;
    return high * (high + 1) / 2 - CA_PAIR_QUANTITIES * (CA_PAIR_QUANTITIES + 1) / 2 + low;
}

#endif
