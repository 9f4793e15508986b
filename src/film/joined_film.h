/* Parts of a render joined into one image: a weighted sum of films, and the variance of that sum.
 *
 * The parts are films of independent samples (or of samples that are independent given the parts before); the weights
 * of all that are added are to sum up to 1, and what may go into them is the caller's matter (docs/papers/000.md,
 * "Joining the pilot with the render"). A part of weight w with n samples of the sample variance s^2 adds w^2 s^2 / n
 * to the variance of the pixel's value.
 *
 * Error bars. The variance V of a pixel's value is known from the parts with V^2 / sum (v_i^2 / (n_i - 1)) degrees of
 * freedom, if v_i is what part i adds to it (Satterthwaite's rule), and the third cumulant of the value is the sum of
 * w_i^3 m_i / n_i^2, with m_i the third central moment of the part's samples. It is also the covariance of the value
 * and the estimate of V, so that the correction for skewness of confidence.h holds as it is for one sample. A part of
 * two samples adds nothing to the third cumulant.
 *
 * State: 160 bytes a pixel. One thread at a time. */
#ifndef CA_FILM_JOINED_FILM_H
#define CA_FILM_JOINED_FILM_H

#include "film/film.h"

typedef struct ca_joined_pixel {
    double mean[3], variance[3], luminance_variance; /* variances of the pixel's value */
    double third[4], scatter[4]; /* of R, G, B, Y: its third cumulants; sums of v_i^2 / (n_i - 1) */
    float albedo[3], normal[3], position[3];
    uint32_t samples;
} ca_joined_pixel;

typedef struct ca_joined_film {
    size_t count;
    ca_joined_pixel *pixels; /* owned */
} ca_joined_film;

/* Black, of the size of a film. */
ca_status ca_joined_film_create(ca_joined_film *joined, const ca_film *like, ca_error *error);
void ca_joined_film_destroy(ca_joined_film *joined);
void ca_joined_film_copy(ca_joined_film *joined, const ca_joined_film *from);

/* Adds a part that has at least two samples a pixel, each a replicate of its own (film.h). */
void ca_joined_film_add(ca_joined_film *joined, const ca_film *part, double weight);
/* Adds two parts whose samples are distributed alike, each with a weight of its own: together they have the two
 * samples that a variance needs, also where each has but one. */
void ca_joined_film_add_two(ca_joined_film *joined, const ca_film *a, double weight_a, const ca_film *b,
                            double weight_b);
/* All weights so far times a factor. */
void ca_joined_film_scale(ca_joined_film *joined, double factor);

/* As a film of the size and place of `like` (whose pixels are not read) that had got `samples` (>= 2) samples a pixel
 * with these means and variances: Variance / Samples is the variance of the pixel's value. The error bars are those
 * of ca_joined_film_add_confidence. */
ca_film_summary ca_joined_film_summarise(const ca_joined_film *joined, uint32_t samples, const ca_film *like);
ca_status ca_joined_film_develop(const ca_joined_film *joined, uint32_t samples, const ca_film *like,
                                 uint32_t threads, ca_image_layers **layers, ca_error *error);

/* Sums over all pixels of a part's luminance and of that luminance's variance. Parts are independent, so those of
 * joined parts are the parts' own, times the weight and its square: an image's noise is known without joining it. */
typedef struct ca_joined_sums {
    double luminance, variance;
} ca_joined_sums;

ca_joined_sums ca_joined_sums_of(const ca_joined_film *joined);
ca_joined_sums ca_joined_sums_of_film(const ca_film *film);                  /* added with weight 1 */
ca_joined_sums ca_joined_sums_of_two(const ca_film *a, const ca_film *b);    /* added with weights 1/2 */
static inline ca_joined_sums ca_joined_sums_add(ca_joined_sums x, ca_joined_sums y, double weight)
{
    return (ca_joined_sums){x.luminance + weight * y.luminance, x.variance + weight * weight * y.variance};
}

/* Adds the layers Confidence*.* of film.h to those of a picture of the same size. Pixels are
 * marked where confidence.h says so, and where there are fewer degrees of freedom than CA_CONFIDENCE_MIN_REPLICATES
 * samples have. Memory: 160 bytes a pixel while it runs. `threads`: as ca_film_develop. */
ca_status ca_joined_film_add_confidence(const ca_joined_film *joined, uint32_t threads, ca_image_layers *layers,
                                        ca_error *error);

#endif
