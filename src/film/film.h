/* The film: sums per pixel, and their development into an image.
 *
 * A pixel's value is the plain mean of its samples, one for each iteration: what a camera path drawn from the filter
 * found (or the mean of several), times its weight (filter.h), plus what light paths splatted. Layers: R G B;
 * Albedo.*, N.*, P.* of the primary hit, averaged; Variance.* the unbiased sample variance of *one* sample (not of
 * the mean: divide by Samples.Y for that); RelativeVariance.* = Variance / mean^2, 0 where the mean is;
 * StandardDeviation.Y the sample standard deviation of one sample's luminance; Samples.Y the number of samples;
 * ConfidenceLow.*, ConfidenceHigh.* of R, G, B and luminance Y: 95 % intervals for the expectations, from replicates
 * that must be independent of each other (confidence.h): single samples, groups of them, or there are no such layers;
 * ConfidenceWidened.*: which of them are widened (interval_layers.h).
 *
 * A film keeps its sums in one of two ways. As it is created: in double precision, 128 bytes per pixel, 56 more
 * where replicates are groups of samples; for sums that stay in this process. After ca_film_add_up_in_parts: such
 * that films of parts add up to the whole to the bit (pass_sums.h), 260 bytes per pixel and 104 more. A pixel is
 * written by one thread at a time, in the order of its samples, so the sums do not depend on the number of threads.
 * The film sees no scene. */
#ifndef CA_FILM_FILM_H
#define CA_FILM_FILM_H

#include "base/status.h"
#include "film/pass_sums.h"
#include "image/layers.h"
#include "math/rgb.h"
#include "math/vec.h"

/* One iteration's worth for a pixel: a camera path (or the mean of several), and the light paths' splats. */
typedef struct ca_film_sample {
    ca_rgb radiance;    /* before the filter's weight */
    float filter_weight;
    ca_rgb splat;       /* spread by the filter already */
    ca_rgb albedo;      /* of the primary hit, zero where there is none; likewise: */
    ca_vec3 normal;     /* shading normal */
    ca_vec3 position;
} ca_film_sample;

/* Sums of a pixel. */
typedef struct ca_film_pixel {
    double sum[3], sum_squares[3]; /* of R, G, B */
    double sum_squares_luminance;
    double sum_cubes[4]; /* of R, G, B, Y of one replicate */
    float albedo[3], normal[3], position[3];
    uint32_t samples;
} ca_film_pixel;

/* Where replicates are groups of samples. */
typedef struct ca_film_groups {
    double sum[3];         /* of R, G, B, over the samples of all groups that are complete */
    double sum_squares[4]; /* of R, G, B, Y of one group's mean */
} ca_film_groups;

typedef struct ca_film {
    uint32_t x0, y0, width, height;   /* the part that is rendered ... */
    uint32_t full_width, full_height; /* ... of this */
    ca_film_pixel *pixels;            /* owned, width * height, row by row; NULL: there are `parts` */
    uint32_t replicate_samples;       /* that are an independent replicate together; 0: they are not independent */
    ca_film_groups *groups;           /* owned, likewise; NULL: replicate_samples <= 1 */
    /* Of a film that adds up in parts, owned, likewise. */
    ca_pass_sums *parts;
    ca_group_sums *group_parts;
    float extent; /* no coordinate of the scene is larger; a power of two */
} ca_film;

ca_status ca_film_create(ca_film *film, uint32_t full_width, uint32_t full_height, const uint32_t crop[4],
                         ca_error *error);
void ca_film_destroy(ca_film *film);
/* As if it had got no samples yet; a film with groups must add up in parts. */
void ca_film_clear(ca_film *film);
/* Says, before the first sample, what the independent replicates are: each sample (1, as at first), the mean of so
 * many that follow each other (the last ones may be left over), or 0: there are none. */
ca_status ca_film_set_replicates(ca_film *film, uint32_t samples, ca_error *error);
/* Of a film that adds up in parts. */
double ca_film_pixel_bytes(uint32_t replicate_samples);

/* Before the first sample, and before replicates are set: from now on the sums do not depend on the order or the
 * grouping of passes. Their number is limited by CA_BINNED_SUM_MOST_VALUES. No coordinate of the scene is larger than
 * `extent` > 0. */
ca_status ca_film_add_up_in_parts(ca_film *film, float extent, ca_error *error);

/* The sums of the i-th pixel, however they are kept. */
ca_film_pixel ca_film_pixel_at(const ca_film *film, size_t i);

/* Of a film that adds up in parts, as bytes, row by row, the same on every machine: a multiple of 8. */
size_t ca_film_row_bytes_of(uint32_t width, uint32_t replicate_samples);
size_t ca_film_row_bytes(const ca_film *film);
void ca_film_write_row(const ca_film *film, uint32_t row, unsigned char *bytes);
/* Adds a row of other passes; where there are groups, none of them is open. `first`: replaces it instead, and a group
 * may be open. false: no row looks like that, or its pixels have not got `samples` samples each. */
bool ca_film_add_row(ca_film *film, uint32_t row, const unsigned char *bytes, uint32_t samples, bool first);

/* Adds a sample to pixel (x, y) of the rendered part. The gate: a radiance that is not finite or is negative is a
 * defect, and so is a splat that is not finite (filters with negative lobes make negative ones); the sample is
 * replaced by zero, and false is returned so that the caller counts it. */
bool ca_film_add(ca_film *film, uint32_t x, uint32_t y, const ca_film_sample *sample);

/* The same in two steps, of a film that adds up in parts: what passes the gate, as it can be kept until it is added;
 * and adding it to the count pixels from (x, y) on. */
bool ca_film_make_addend(const ca_film *film, const ca_film_sample *sample, ca_pass_addend *addend);
void ca_film_add_addends(ca_film *film, uint32_t x, uint32_t y, uint32_t count, const ca_pass_addend *addends);

static inline double ca_film_luminance(const double rgb[3]) { return ca_pass_luminance(rgb[0], rgb[1], rgb[2]); }

/* What is known of the image so far. */
typedef struct ca_film_summary {
    double mean_luminance;
    double mean_standard_deviation; /* of one sample's luminance, averaged over pixels; NAN: of fewer than two */
    double noise; /* root of the mean variance of a pixel's mean, over the mean luminance; NAN under two samples or
                     for a black image */
} ca_film_summary;
ca_film_summary ca_film_summarise(const ca_film *film);

/* By so many threads, fewer where there are none; no bit depends on them. CA_ERROR_INTERRUPTED: nobody wants the
 * calling thread's work any more (base/loading.h). */
ca_status ca_film_develop(const ca_film *film, uint32_t threads, ca_image_layers **layers, ca_error *error);

/* Memory that developing takes for each pixel, the layers included, of films of every kind; with error bars or
 * without. */
size_t ca_film_develop_bytes(bool error_bars);

/* The same two of pixels that are in no film: `pixel` makes the i-th of film->width x film->height pixels of a film
 * that has none of its own (film->pixels is not read). There are no Confidence layers. */
typedef struct ca_film_source {
    ca_film_pixel (*pixel)(const void *user, size_t i);
    const void *user;
} ca_film_source;

ca_film_summary ca_film_summarise_source(const ca_film *film, const ca_film_source *source);
ca_status ca_film_develop_source(const ca_film *film, const ca_film_source *source, uint32_t threads,
                                 ca_image_layers **layers, ca_error *error);

#endif
