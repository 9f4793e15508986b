/* Parts of a render joined into one image: a weighted sum of films, and the variance of that sum.
 *
 * The parts are films of independent samples (or of samples that are independent given the parts before); the weights of all that
 * are added are to sum up to 1, and what may go into them is the caller's matter (docs/papers/000.md, "Joining the pilot with
 * the render"). A part of weight w with n samples of the sample variance s^2 adds w^2 s^2 / n to the variance of the pixel's value.
 *
 * State: 96 bytes a pixel. One thread at a time. */
#ifndef CA_FILM_JOINED_FILM_H
#define CA_FILM_JOINED_FILM_H

#include "film/film.h"

typedef struct ca_joined_pixel {
    double mean[3], variance[3], luminance_variance; /* variances of the pixel's value */
    float albedo[3], normal[3], position[3];
} ca_joined_pixel;

typedef struct ca_joined_film {
    size_t count;
    ca_joined_pixel *pixels; /* owned */
} ca_joined_film;

/* Black, of the size of a film. */
ca_status ca_joined_film_create(ca_joined_film *joined, const ca_film *like, ca_error *error);
void ca_joined_film_destroy(ca_joined_film *joined);
void ca_joined_film_clear(ca_joined_film *joined);
void ca_joined_film_copy(ca_joined_film *joined, const ca_joined_film *from);

/* Adds a part that has at least two samples a pixel. */
void ca_joined_film_add(ca_joined_film *joined, const ca_film *part, double weight);
/* Adds two parts whose samples are distributed alike, each with a weight of its own: together they have the two samples that a
 * variance needs, also where each has but one. */
void ca_joined_film_add_two(ca_joined_film *joined, const ca_film *a, double weight_a, const ca_film *b, double weight_b);
/* All weights so far times a factor. */
void ca_joined_film_scale(ca_joined_film *joined, double factor);

/* Fills a film of the same size as if it had got `samples` (>= 2) samples a pixel with these means and variances: what is developed
 * from it keeps the promise that Variance / Samples is the variance of the pixel's value. */
void ca_joined_film_to_film(const ca_joined_film *joined, uint32_t samples, ca_film *film);

#endif
