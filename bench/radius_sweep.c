/* The default merge radius against the best of a sweep, and the default alpha against others: the relative mean
 * square error after a number of iterations, on scenes of every kind.
 *
 *     radius_sweep radii  [--only SCENE] [--integrator NAME] [--side N] [--iterations N] [--references FOLDER]
 *                         [--reference-iterations N]
 *     radius_sweep alphas [the same]
 *
 * `radii`: each integrator with its default radius and with eight around it, in factors of two from 1/32 to 8, all
 * with the same random numbers. Prints the radius, the errors relative to the least of the nine, and which that is.
 * `alphas`: the default radius of each alpha, and the errors relative to that of the least.
 *
 * The error is the mean of (x - a)(x - b) / (m^2 + 0.01) over pixels and channels, for the picture x, two long
 * renders a and b that are independent of each other, and their mean m: noise of a and b is not counted as error.
 * They are those of `ovcm` from a radius of two pixels on; with --references they are kept in that folder. `qmcppm`
 * renders by blocks of pairs: its iterations are blocks, the square of its camera paths. Prints Markdown. */
#include "bench_support.h"
#include "image/layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 64, ITERATIONS = 64, RADII = 9, DEFAULT = 5 };
enum { REFERENCE_ITERATIONS = 1024, SEED = 71, REFERENCE_SEED = 9100 };

static const char *const reference_integrator = "ovcm:radius=0,radius_pixels=2,alpha=0.5";

typedef struct sweep_scene {
    const char *name, *file;
} sweep_scene;

static const sweep_scene scenes[] = {
    {"caustics", "caustics/caustics.xml"},
    {"glass slab", "glass-slab/glass-slab.xml"},
    {"water caustic", "paper-000/water-caustic.xml"},
    {"mirror room", "paper-004/mirror-room.xml"},
    {"lens", "weights/lens.xml"},
    {"Cornell box", "cornell-box/cornell-box.xml"},
    {"mirror and glass", "speed/cornell-spheres.xml"},
    {"rough glass", "rough-glass/rough-glass.xml"},
    {"rough metal", "weights/rough-metal.xml"},
    {"light through a gap", "weights/door.xml"},
    {"pool", "gallery/pool.xml"},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

static const char *const radius_integrators[] = {"ppm", "bdpm", "ovcm"};
static const char *const alpha_integrators[] = {"ppm", "bdpm", "qmcppm", "ovcm", "vcm"};
static const char *const alpha_scenes[] = {"caustics", "glass slab", "water caustic", "mirror and glass",
                                           "Cornell box"};
static const double alphas[] = {0.0, 0.25, 1.0 / 3.0, 0.5, 2.0 / 3.0, 0.75};
enum {
    RADIUS_INTEGRATORS = sizeof radius_integrators / sizeof radius_integrators[0],
    ALPHA_INTEGRATORS = sizeof alpha_integrators / sizeof alpha_integrators[0],
    ALPHA_SCENES = sizeof alpha_scenes / sizeof alpha_scenes[0],
    ALPHAS = sizeof alphas / sizeof alphas[0],
};

typedef struct options {
    bool alphas;
    const char *only, *integrator, *references;
    uint32_t side, iterations, reference_iterations;
} options;

/* Two halves of a reference, [pixel][channel]. */
typedef struct reference {
    size_t values;
    float *half[2];
} reference;

static void *need(size_t count, size_t size)
{
    void *memory = calloc(count, size);
    if (!memory) fputs("radius_sweep: out of memory\n", stderr), exit(1);
    return memory;
}

/* ---- Rendering ------------------------------------------------------------------------------------------------- */

static ca_image_layers *render(const ca_scene *scene, const char *integrator, uint32_t side, uint32_t iterations,
                               uint64_t seed)
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
    return image;
}

static void copy_channels(const ca_image_layers *image, size_t pixels, float *values)
{
    static const char *const names[3] = {"R", "G", "B"};
    for (size_t c = 0; c < 3; c++) {
        const float *channel = ca_image_channel(image, names[c]);
        for (size_t p = 0; p < pixels; p++) values[3 * p + c] = channel[p];
    }
}

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

static reference reference_of(const ca_scene *scene, const char *name, const options *chosen)
{
    const size_t pixels = (size_t)chosen->side * chosen->side;
    reference r = {.values = 3 * pixels};
    for (uint32_t i = 0; i < 2; i++) {
        char path[1024];
        r.half[i] = need(r.values, sizeof *r.half[i]);
        snprintf(path, sizeof path, "%s/%s-%u-%u-%u.raw", chosen->references ? chosen->references : "", name,
                 chosen->side, chosen->reference_iterations, i);
        if (chosen->references && read_half(path, r.half[i], r.values)) continue;
        ca_image_layers *image =
            render(scene, reference_integrator, chosen->side, chosen->reference_iterations, REFERENCE_SEED + i);
        copy_channels(image, pixels, r.half[i]);
        ca_image_release(image);
        if (chosen->references) write_half(path, r.half[i], r.values);
    }
    return r;
}

/* ---- Errors ---------------------------------------------------------------------------------------------------- */

/* The value behind "radius=" in the picture's own record of its integrator. */
static double radius_of(const ca_image_layers *image)
{
    const ca_attribute *attribute = ca_layers_attribute(image, "caustica.integrator");
    const char *found = attribute && attribute->text ? strstr(attribute->text, "radius=") : NULL;
    return found ? strtod(found + strlen("radius="), NULL) : (double)NAN;
}

/* *radius: of the first pass; NULL: not wanted. */
static double error_of(const ca_scene *scene, const reference *r, const char *integrator, const options *chosen,
                       double *radius)
{
    ca_image_layers *image = render(scene, integrator, chosen->side, chosen->iterations, SEED);
    float *values = need(r->values, sizeof *values);
    copy_channels(image, r->values / 3, values);
    if (radius) *radius = radius_of(image);
    ca_image_release(image);
    double sum = 0.0;
    for (size_t i = 0; i < r->values; i++) {
        const double x = (double)values[i], a = (double)r->half[0][i], b = (double)r->half[1][i];
        sum += (x - a) * (x - b) / (0.25 * (a + b) * (a + b) + 0.01);
    }
    free(values);
    return sum / (double)r->values;
}

/* ---- Tables ---------------------------------------------------------------------------------------------------- */

static double least_of(const double *values, int count)
{
    double least = values[0];
    for (int i = 1; i < count; i++) least = fmin(least, values[i]);
    return least;
}

static void sweep_radii(const ca_scene *scene, const reference *r, const char *name, const char *integrator,
                        const options *chosen)
{
    double errors[RADII], radius = 0.0;
    char text[128];
    snprintf(text, sizeof text, "%s:radius=0", integrator);
    errors[DEFAULT] = error_of(scene, r, text, chosen, &radius);
    for (int i = 0; i < RADII; i++) {
        if (i == DEFAULT) continue;
        snprintf(text, sizeof text, "%s:radius=%.9g", integrator, radius * exp2(i - DEFAULT));
        errors[i] = error_of(scene, r, text, chosen, NULL);
    }
    const double least = least_of(errors, RADII);
    printf("| %s | %s | %.4g |", name, integrator, radius);
    for (int i = 0; i < RADII; i++) printf(i == DEFAULT ? " **%.2f** |" : " %.2f |", errors[i] / least);
    printf(" %.4g |\n", least);
    fflush(stdout);
}

static void sweep_alphas(const ca_scene *scene, const reference *r, const char *name, const char *integrator,
                         const options *chosen)
{
    double errors[ALPHAS];
    char text[128];
    for (int i = 0; i < ALPHAS; i++) {
        snprintf(text, sizeof text, "%s:radius=0,alpha=%.9g", integrator, alphas[i]);
        errors[i] = error_of(scene, r, text, chosen, NULL);
    }
    const double least = least_of(errors, ALPHAS);
    printf("| %s | %s | %u |", name, integrator, chosen->iterations);
    for (int i = 0; i < ALPHAS; i++) printf(" %.2f |", errors[i] / least);
    printf(" %.4g |\n", least);
    fflush(stdout);
}

static void print_heading(const options *chosen)
{
    printf(chosen->alphas ? "| scene | integrator | iterations |" : "| scene | integrator | radius |");
    for (int i = 0; i < (chosen->alphas ? ALPHAS : RADII); i++) {
        if (chosen->alphas)
            printf(" %.3g |", alphas[i]);
        else
            printf(" %g |", exp2(i - DEFAULT));
    }
    printf(" least |\n|---|---|---|");
    for (int i = 0; i < (chosen->alphas ? ALPHAS : RADII); i++) printf("---|");
    printf("---|\n");
}

/* ---- The program ----------------------------------------------------------------------------------------------- */

static bool has_alphas(const char *scene)
{
    for (int i = 0; i < ALPHA_SCENES; i++)
        if (strcmp(alpha_scenes[i], scene) == 0) return true;
    return false;
}

static void run_scene(const sweep_scene *s, const options *chosen)
{
    char path[1024];
    ca_error error;
    ca_scene *scene;
    snprintf(path, sizeof path, CA_SOURCE_DIR "/scenes/%s", s->file);
    if (ca_scene_load(path, NULL, 0, &scene, &error) != CA_OK) bench_die(path, &error);
    const reference r = reference_of(scene, s->name, chosen);
    const char *const *integrators = chosen->alphas ? alpha_integrators : radius_integrators;
    for (int i = 0; i < (chosen->alphas ? ALPHA_INTEGRATORS : RADIUS_INTEGRATORS); i++) {
        if (chosen->integrator && strcmp(chosen->integrator, integrators[i]) != 0) continue;
        (chosen->alphas ? sweep_alphas : sweep_radii)(scene, &r, s->name, integrators[i], chosen);
    }
    for (int i = 0; i < 2; i++) free(r.half[i]);
    ca_scene_release(scene);
}

static bool parse_options(int argc, char **argv, options *chosen)
{
    *chosen = (options){.side = SIDE, .iterations = ITERATIONS, .reference_iterations = REFERENCE_ITERATIONS};
    if (argc < 2 || argc % 2 != 0) return false;
    chosen->alphas = strcmp(argv[1], "alphas") == 0;
    if (!chosen->alphas && strcmp(argv[1], "radii") != 0) return false;
    for (int i = 2; i + 1 < argc; i += 2) {
        const char *value = argv[i + 1];
        if (strcmp(argv[i], "--only") == 0)
            chosen->only = value;
        else if (strcmp(argv[i], "--integrator") == 0)
            chosen->integrator = value;
        else if (strcmp(argv[i], "--references") == 0)
            chosen->references = value;
        else if (strcmp(argv[i], "--side") == 0)
            chosen->side = (uint32_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--iterations") == 0)
            chosen->iterations = (uint32_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--reference-iterations") == 0)
            chosen->reference_iterations = (uint32_t)strtoul(value, NULL, 10);
        else
            return false;
    }
    return chosen->reference_iterations > 0 && chosen->side > 0 && chosen->iterations > 0;
}

int main(int argc, char **argv)
{
    options chosen;
    if (!parse_options(argc, argv, &chosen)) {
        fprintf(stderr,
                "usage: %s radii|alphas [--only SCENE] [--integrator NAME] [--side N] [--iterations N] "
                "[--references FOLDER] [--reference-iterations N]\n",
                argv[0]);
        return 2;
    }
    print_heading(&chosen);
    int count = 0;
    for (int i = 0; i < SCENES; i++) {
        if (chosen.only ? strcmp(chosen.only, scenes[i].name) != 0 : chosen.alphas && !has_alphas(scenes[i].name))
            continue;
        run_scene(&scenes[i], &chosen);
        count++;
    }
    if (count == 0) return fprintf(stderr, "radius_sweep: no scene is named %s\n", chosen.only), 2;
    return 0;
}
