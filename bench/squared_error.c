#include "squared_error.h"

#include "bench_support.h"
#include "image/layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REFERENCE_SEED = 9100 };

void *bench_need(size_t count, size_t size)
{
    void *memory = calloc(count, size);
    if (!memory) fputs("out of memory\n", stderr), exit(1);
    return memory;
}

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

static void copy_channels(const ca_image_layers *image, size_t pixels, float *values)
{
    static const char *const names[3] = {"R", "G", "B"};
    for (size_t c = 0; c < 3; c++) {
        const float *channel = ca_image_channel(image, names[c]);
        for (size_t p = 0; p < pixels; p++) values[3 * p + c] = channel[p];
    }
}

/* The value behind "radius=" in the picture's own record of its integrator. */
static double radius_of(const ca_image_layers *image)
{
    const ca_attribute *attribute = ca_layers_attribute(image, "caustica.integrator");
    const char *found = attribute && attribute->text ? strstr(attribute->text, "radius=") : NULL;
    return found ? strtod(found + strlen("radius="), NULL) : (double)NAN;
}

void bench_render(const ca_scene *scene, const char *integrator, uint32_t side, uint32_t iterations, uint64_t seed,
                  float *values, double *radius)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    const bool by_blocks = strncmp(integrator, "qmcppm", 6) == 0;
    settings.samples_per_pixel = by_blocks ? (uint32_t)lround(sqrt(iterations)) : iterations;
    settings.sampler = by_blocks ? "halton" : "independent";
    settings.seed = seed;
    settings.has_seed = true;
    settings.threads = 1;
    settings.width = settings.height = side;
    ca_image_layers *image;
    ca_error error;
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) bench_die(integrator, &error);
    copy_channels(image, (size_t)side * side, values);
    if (radius) *radius = radius_of(image);
    ca_image_release(image);
}

/* ---- References ------------------------------------------------------------------------------------------------ */

static bool read_half(const char *path, float *values, size_t count)
{
    FILE *file = fopen(path, "rb");
    if (!file) return false;
    const bool read = fread(values, sizeof *values, count, file) == count;
    fclose(file);
    return read;
}

static void write_half(const char *path, const float *values, size_t count)
{
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(values, sizeof *values, count, file) != count || fclose(file) != 0) perror(path), exit(1);
}

bench_halves bench_halves_make(const ca_scene *scene, const char *program, const char *name, const char *integrator,
                               uint32_t side, uint32_t iterations, const char *folder)
{
    const size_t count = 3 * (size_t)side * side;
    bench_halves halves = {.side = side};
    for (uint32_t i = 0; i < 2; i++) {
        char path[1024];
        halves.half[i] = bench_need(count, sizeof *halves.half[i]);
        snprintf(path, sizeof path, "%s/%s-%s-%u-%u-%u.raw", folder ? folder : "", program, name, side, iterations,
                 i);
        if (folder && read_half(path, halves.half[i], count)) continue;
        bench_render(scene, integrator, side, iterations, REFERENCE_SEED + i, halves.half[i], NULL);
        if (folder) write_half(path, halves.half[i], count);
    }
    return halves;
}

void bench_halves_free(bench_halves *halves)
{
    for (int i = 0; i < 2; i++) free(halves->half[i]);
    *halves = (bench_halves){0};
}

/* ---- Errors ---------------------------------------------------------------------------------------------------- */

/* Of a pixel's three channels: without the noise of the halves, and as it looks, for the order. */
typedef struct pixel_error {
    double error, apparent;
} pixel_error;

static pixel_error pixel_error_at(const bench_halves *halves, const float *values, size_t pixel)
{
    pixel_error sum = {0};
    for (size_t i = 3 * pixel; i < 3 * pixel + 3; i++) {
        const double x = (double)values[i], a = (double)halves->half[0][i], b = (double)halves->half[1][i];
        const double m = 0.5 * (a + b), scale = 1.0 / (3.0 * (m * m + 0.01));
        sum.error += (x - a) * (x - b) * scale;
        sum.apparent += (x - m) * (x - m) * scale;
    }
    return sum;
}

static int compare(const void *a, const void *b)
{
    const double x = ((const pixel_error *)a)->apparent, y = ((const pixel_error *)b)->apparent;
    return (x > y) - (x < y);
}

double bench_squared_error(const bench_halves *halves, const float *values, const bool *counts, double worst)
{
    const size_t pixels = (size_t)halves->side * halves->side;
    pixel_error *errors = bench_need(pixels, sizeof *errors);
    size_t count = 0;
    for (size_t p = 0; p < pixels; p++)
        if (!counts || counts[p]) errors[count++] = pixel_error_at(halves, values, p);
    if (worst > 0.0 && count > 1) {
        qsort(errors, count, sizeof *errors, compare);
        count -= (size_t)fmax(1.0, floor(worst * (double)count));
    }
    double sum = 0.0;
    for (size_t i = 0; i < count; i++) sum += errors[i].error;
    free(errors);
    return count > 0 ? sum / (double)count : 0.0;
}
