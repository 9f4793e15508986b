/* Two halves A and B of a render's first samples, joined before the weights of the two are known.
 *
 * Each half is the mean of its groups of iterations, sum_g s_g M_g, with shares s_g that both halves have. A group
 * has as many samples in A as in B, and they are distributed alike. (The last group of a render that was stopped may
 * have one more in A; the weights are equal then.) So with a weight a for A and b for B
 *
 *     a A + b B = (a + b) (A + B) / 2 + (a - b) (A - B) / 2,
 *
 * and the variance, the third cumulant and the scatter (joined_film.h) are those of (A + B) / 2 times 2 (a^2 + b^2),
 * 4 (a^3 + b^3) and (2 (a^2 + b^2))^2: (A + B) / 2 as a joined film and (A - B) / 2 are all that is kept. The
 * difference is a float: it is a part of the noise, times (a - b).
 *
 * State: 172 bytes a pixel, where films of two groups would be 512. One thread at a time. */
#ifndef CA_FILM_HALVED_FILM_H
#define CA_FILM_HALVED_FILM_H

#include "film/joined_film.h"

enum { CA_HALVED_FILM_PIXEL_BYTES = sizeof(ca_joined_pixel) + 3 * sizeof(float) };

typedef struct ca_halved_film {
    ca_joined_film mean;    /* (A + B) / 2 */
    float (*difference)[3]; /* owned; (A - B) / 2 */
} ca_halved_film;

/* Black, of the size of a film, whose pixels are not read. */
ca_status ca_halved_film_create(ca_halved_film *halved, const ca_film *like, ca_error *error);
void ca_halved_film_destroy(ca_halved_film *halved);

/* Adds a group; pixels of a and b have samples (>= 1), each a replicate of its own. */
void ca_halved_film_add(ca_halved_film *halved, const ca_film *a, const ca_film *b, double share);
/* All shares so far times a factor. */
void ca_halved_film_scale(ca_halved_film *halved, double factor);

/* The mean of half 0 (A) or 1 (B) at a pixel, channel c. */
double ca_halved_film_mean(const ca_halved_film *halved, size_t pixel, int half, int c);

/* weight_a A + weight_b B: sums over its pixels, and added to a joined film. */
ca_joined_sums ca_halved_film_sums(const ca_halved_film *halved, double weight_a, double weight_b);
void ca_halved_film_join(const ca_halved_film *halved, double weight_a, double weight_b, ca_joined_film *joined);

#endif
