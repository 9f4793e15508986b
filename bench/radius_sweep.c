/* The default merge radius against the best of a sweep, and the default alpha against others: the relative mean
 * square error after a number of iterations, on scenes of every kind.
 *
 *     radius_sweep radii  [--only SCENE] [--integrator NAME] [--side N] [--iterations N] [--seeds N]
 *                         [--references FOLDER] [--reference-iterations N]
 *     radius_sweep alphas [the same]
 *
 * `radii`: each integrator with its default radius and with eight around it, in factors of two from 1/32 to 8, all
 * with the same random numbers: errors are means over some seeds, each with its own default radius, and the others
 * lie around the mean of these. Those beyond one with TOO_FAR times the least error are left out. Prints the mean
 * radius and the errors relative to the least of the nine.
 * `alphas`: the default radius of each alpha, and the errors relative to that of the least.
 *
 * The error is that of squared_error.h. Its references are of `ovcm` from a radius of two pixels on; with
 * --references they are kept in that folder. The last scenes took no part in the choice of the pilot's constants.
 * Prints Markdown. */
#include "bench_support.h"
#include "squared_error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 64, ITERATIONS = 64, RADII = 9, DEFAULT = 5 };
enum { REFERENCE_ITERATIONS = 1024, SEED = 71 };

#define TOO_FAR 3.0

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
    {"textured", "textured/textured.xml"},
    {"jewels", "gallery/jewels.xml"},
    {"glass of water", "gallery/glass-of-water.xml"},
    {"wide lens", "depth-of-field/depth-of-field.xml"},
    {"long diffuse", "long-diffuse/long-diffuse.xml"},
    {"small light, far", "small-light-far/small-light-far.xml"},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

static const char *const radius_integrators[] = {"ppm", "bdpm", "ovcm", "vavcm"};
static const char *const alpha_integrators[] = {"ppm", "bdpm", "qmcppm", "ovcm", "vcm", "vavcm"};
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
    uint32_t side, iterations, reference_iterations, seeds;
} options;

/* ---- Errors ---------------------------------------------------------------------------------------------------- */

/* The mean over the seeds. *radius: of the first pass, likewise; NULL: not wanted. */
static double error_of(const ca_scene *scene, const bench_halves *r, const char *integrator, const options *chosen,
                       double *radius)
{
    float *values = bench_need(3 * (size_t)chosen->side * chosen->side, sizeof *values);
    double sum = 0.0, radii = 0.0;
    for (uint32_t i = 0; i < chosen->seeds; i++) {
        double first;
        bench_render(scene, integrator, chosen->side, chosen->iterations, SEED + i, values, &first);
        sum += bench_squared_error(r, values, NULL, 0.0) / chosen->seeds;
        radii += first / chosen->seeds;
    }
    free(values);
    if (radius) *radius = radii;
    return sum;
}

/* ---- Tables ---------------------------------------------------------------------------------------------------- */

static double least_of(const double *values, int count)
{
    double least = values[0];
    for (int i = 1; i < count; i++) least = fmin(least, values[i]);
    return least;
}

/* From the default on, `step` by step, as long as the error is no more than TOO_FAR times the least so far. */
static void sweep_side(const ca_scene *scene, const bench_halves *r, const char *integrator, const options *chosen,
                       double radius, int step, double errors[RADII])
{
    double least = errors[DEFAULT];
    char text[128];
    for (int i = DEFAULT + step; i >= 0 && i < RADII; i += step) {
        if (errors[i - step] > TOO_FAR * least) return;
        snprintf(text, sizeof text, "%s:radius=%.9g", integrator, radius * exp2(i - DEFAULT));
        errors[i] = error_of(scene, r, text, chosen, NULL);
        least = fmin(least, errors[i]);
    }
}

static void sweep_radii(const ca_scene *scene, const bench_halves *r, const char *name, const char *integrator,
                        const options *chosen)
{
    double errors[RADII], radius = 0.0;
    char text[128];
    for (int i = 0; i < RADII; i++) errors[i] = (double)INFINITY;
    snprintf(text, sizeof text, "%s:radius=0", integrator);
    errors[DEFAULT] = error_of(scene, r, text, chosen, &radius);
    sweep_side(scene, r, integrator, chosen, radius, -1, errors);
    sweep_side(scene, r, integrator, chosen, radius, 1, errors);
    const double least = least_of(errors, RADII);
    printf("| %s | %s | %.4g |", name, integrator, radius);
    for (int i = 0; i < RADII; i++)
        if (isinf(errors[i]))
            printf(" |");
        else
            printf(i == DEFAULT ? " **%.2f** |" : " %.2f |", errors[i] / least);
    printf(" %.4g |\n", least);
    fflush(stdout);
}

static void sweep_alphas(const ca_scene *scene, const bench_halves *r, const char *name, const char *integrator,
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
    bench_halves r = bench_halves_make(scene, "radius_sweep", s->name, reference_integrator, chosen->side,
                                       chosen->reference_iterations, chosen->references);
    const char *const *integrators = chosen->alphas ? alpha_integrators : radius_integrators;
    for (int i = 0; i < (chosen->alphas ? ALPHA_INTEGRATORS : RADIUS_INTEGRATORS); i++) {
        if (chosen->integrator && strcmp(chosen->integrator, integrators[i]) != 0) continue;
        (chosen->alphas ? sweep_alphas : sweep_radii)(scene, &r, s->name, integrators[i], chosen);
    }
    bench_halves_free(&r);
    ca_scene_release(scene);
}

static bool parse_options(int argc, char **argv, options *chosen)
{
    *chosen = (options){.side = SIDE, .iterations = ITERATIONS, .seeds = 1};
    chosen->reference_iterations = REFERENCE_ITERATIONS;
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
        else if (strcmp(argv[i], "--seeds") == 0)
            chosen->seeds = (uint32_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--reference-iterations") == 0)
            chosen->reference_iterations = (uint32_t)strtoul(value, NULL, 10);
        else
            return false;
    }
    return chosen->reference_iterations > 0 && chosen->side > 0 && chosen->iterations > 0 && chosen->seeds > 0;
}

int main(int argc, char **argv)
{
    options chosen;
    if (!parse_options(argc, argv, &chosen)) {
        fprintf(stderr,
                "usage: %s radii|alphas [--only SCENE] [--integrator NAME] [--side N] [--iterations N] "
                "[--seeds N] [--references FOLDER] [--reference-iterations N]\n",
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
