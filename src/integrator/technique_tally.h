/* How noisy is each technique by itself, and where? A tally keeps what every technique brings to the pixels of a
 * pilot, unweighted, over several iterations; from it follow the factors of variance-aware weights
 * (path/technique_factors.h).
 *
 * The film is cut into square cells, of which each has one pixel of the pilot. A technique's number of samples is
 * multiplied by
 *
 *     v = M / V
 *
 * V: the variance, from iteration to iteration, of what it brings to a pixel; M: the mean of the sum of squares of
 * its samples. A technique of one sample x has v = E[x^2] / Var[x], which is large where it is nearly without noise.
 *
 * A merge sums up many photons, which come and go together with the camera path: where more than one is expected, all
 * of them count as one sample (the density rule of path/reuse.h). That tells crowded places from others, which no
 * class of techniques could. M has c^2 times this number for a contribution c. What is left is that photons come and
 * go together with a light path: v is below 1 then. Above 1 it is not let: a crowded place that was not seen in the
 * pilot would count for more than it is worth. Splats come from very many light paths, of which few reach the pixel:
 * v = 1.
 *
 * Next event asks one light: where it finds one it finds no other. What a class of lights brings is then noisier by
 * itself than together with the others, whose noise it cancels, and hits of that class, which would take its light,
 * take that away. Where classes come together the V of next event is what it adds to the variance of all, as far as
 * the hits of that class leave it the light; it is V where one class is all there is.
 *
 * What one camera path brings comes together, too: a path that lands beside a lamp finds much light by next event, by
 * connections and by merges at once. Together they are noisier than each is by itself, and splats, which come from
 * other paths, are worth more. With S the sum of all weighted samples of a pixel and W that of a class, the variance
 * of S grows with the class' weight by 2 Cov(W, S), per share of the weight; it would by 2 Var(W) if the class came
 * alone. So the factor is divided by Cov(W, S) / Var(W), that of a group of classes: hits, next events, connections
 * or merges after so many camera vertices. It is at least 1 and at most 8.
 *
 * What counts is the noise relative to the light: all of a cell's moments are over the square of its mean of S. So no
 * bright cell decides for the dark ones of its region.
 *
 * M and V are summed over the cells of a region and, with smaller weights, of its neighbours. With n independent
 * differences between iterations V + M / n stands for V: v stays below n, and is 1 where nothing was seen of a
 * group.
 *
 * A cell takes 36 bytes for each of 168 classes, 55 MB in all at most; the map 672 bytes a region.
 *
 * Threads: a cell is written by one thread at a time; a map is immutable. */
#ifndef CA_INTEGRATOR_TECHNIQUE_TALLY_H
#define CA_INTEGRATOR_TECHNIQUE_TALLY_H

#include "base/status.h"
#include "math/rgb.h"
#include "math/vec.h"
#include "path/technique.h"
#include "path/technique_factors.h"

typedef struct ca_technique_tally ca_technique_tally;

/* For a film of so many pixels. */
ca_status ca_technique_tally_create(ca_technique_tally **tally, uint32_t width, uint32_t height, ca_error *error);
void ca_technique_tally_destroy(ca_technique_tally *tally); /* NULL is allowed */

uint32_t ca_technique_tally_cells(const ca_technique_tally *tally);
/* The pixel of a cell. */
void ca_technique_tally_pixel(const ca_technique_tally *tally, uint32_t cell, uint32_t *x, uint32_t *y);

/* What a path through that pixel brings by a technique, of s camera and t light vertices (technique.h); `light`: the
 * class of the light that a hit or next event found; crowd: how many photons count as one sample where a merge is,
 * else 1; weight: that of the technique without factors. */
void ca_technique_tally_add(ca_technique_tally *tally, uint32_t x, uint32_t y, ca_technique technique, uint32_t s,
                            uint32_t t, uint32_t light, float crowd, ca_rgb unweighted, float weight);
/* After all that the iteration brings to the cell. */
void ca_technique_tally_end(ca_technique_tally *tally, uint32_t cell);

/* Factors by place. */
typedef struct ca_factor_map ca_factor_map;

/* From so many iterations, at least 2. */
ca_status ca_factor_map_create(ca_factor_map **map, const ca_technique_tally *tally, uint32_t iterations,
                               ca_error *error);
void ca_factor_map_destroy(ca_factor_map *map); /* NULL is allowed */
/* Of the region where the place lies, in pixels; outside of the film the nearest region's. */
const ca_technique_factors *ca_factor_map_at(const ca_factor_map *map, ca_vec2 film);
/* Of the same region as `factors`, which are `other`'s, a map of the same film. */
const ca_technique_factors *ca_factor_map_same(const ca_factor_map *map, const ca_factor_map *other,
                                               const ca_technique_factors *factors);

#endif
