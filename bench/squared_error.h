/* The relative mean square error of a picture, without a reference that is free of noise: the mean of
 * (x - a)(x - b) / (m^2 + 0.01) over pixels and channels, for the picture x, two long renders a and b that are
 * independent of each other, and their mean m. The noise of a and b is not counted as error. */
#ifndef CA_BENCH_SQUARED_ERROR_H
#define CA_BENCH_SQUARED_ERROR_H

#include "caustica.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Memory that is zero; ends the program where there is none. */
void *bench_need(size_t count, size_t size);

/* A square picture, values[pixel][channel], by one thread; `qmcppm` by blocks of pairs: its iterations are blocks,
 * the square of its camera paths. *radius: of the first pass, NAN where there is none; NULL: not wanted. */
void bench_render(const ca_scene *scene, const char *integrator, uint32_t side, uint32_t iterations, uint64_t seed,
                  float *values, double *radius);

typedef struct bench_halves {
    uint32_t side;
    float *half[2]; /* owned */
} bench_halves;

/* Renders the two halves; `folder`: they are kept there as `name` of `program`, whose scenes and references are its
 * own, and taken from there; NULL: nowhere. */
bench_halves bench_halves_make(const ca_scene *scene, const char *program, const char *name, const char *integrator,
                               uint32_t side, uint32_t iterations, const char *folder);
void bench_halves_free(bench_halves *halves);

/* The error over the pixels that count; NULL: all do. `worst`: so much of them, those with the largest errors, is
 * left out, one pixel at least where it is not 0. */
double bench_squared_error(const bench_halves *halves, const float *values, const bool *counts, double worst);

#endif
