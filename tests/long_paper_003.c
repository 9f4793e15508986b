/* What paper 003 (Sirak, "Bidirectional Path Tracer", 2019) says about its pictures, measured on scenes/paper-003 and
 * scenes/perceptual-study, at its own setting: 400 x 400 pixels, 75 samples. Prints the figures of
 * docs/papers/003.md. Takes some minutes. Arguments, for a quick look: another side of the pictures in pixels, a
 * pattern for the names of the tests.
 *
 * Noise is what renders with seeds of their own scatter by: a picture of 75 samples is the mean of five of 15. Pixels
 * that show a lamp, and those beside them, are left out everywhere: they say nothing about how a lamp lights a
 * room. */
#include "support/batches.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { BATCHES = 5, SAMPLES = 15, MAX_SIDE = 400, REACH = 2 };

static uint32_t side = MAX_SIDE;

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

/* What the first hits of a scene's pixels are, and where to look. */
typedef struct view {
    float *normal[3], *albedo[3], *position[3];
    bool *lamp; /* a lamp is in the pixel or in one beside it */
    uint32_t width, height;
} view;

/* Luminance of a picture, and of each pixel the standard error. */
typedef struct picture {
    uint32_t pixels;
    float *value, *error;
} picture;

/* The figures of a picture; luminance, without lamps. */
typedef struct figures {
    double level, level_error; /* mean, and its standard error */
    double median;             /* of the pixels */
    double noise;              /* root of the mean squared standard error of a pixel, over the level */
    double typical;            /* median of a pixel's standard error over its value; of black pixels it is 1 */
    int fireflies;             /* -1: not counted */
} figures;

static void *need(size_t count, size_t size)
{
    void *memory = calloc(count, size);
    assert_non_null(memory);
    return memory;
}

/* max_depth 0: the scene's. */
static ca_image_layers *render(const ca_scene *scene, const char *integrator, int max_depth, uint32_t width,
                               uint32_t height, uint32_t samples, uint64_t seed)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = samples;
    settings.has_seed = true;
    settings.seed = seed;
    settings.width = width;
    settings.height = height;
    settings.has_max_depth = max_depth > 0;
    settings.max_depth = max_depth;
    return render_scene(scene, &settings);
}

static float luminance_of(const ca_image_layers *image, size_t pixel)
{
    return 0.2126f * ca_image_channel(image, "R")[pixel] + 0.7152f * ca_image_channel(image, "G")[pixel] +
           0.0722f * ca_image_channel(image, "B")[pixel];
}

static float *copy_of(const ca_image_layers *image, const char *channel, size_t pixels)
{
    const float *values = ca_image_channel(image, channel);
    assert_non_null(values);
    float *copy = need(pixels, sizeof *copy);
    memcpy(copy, values, pixels * sizeof *copy);
    return copy;
}

/* Is there light in the pixel or in one beside it? */
static bool light_nearby(const ca_image_layers *image, const view *v, uint32_t x, uint32_t y)
{
    for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < v->height; j++)
        for (uint32_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < v->width; i++)
            if (luminance_of(image, (size_t)j * v->width + i) > 0.0f) return true;
    return false;
}

/* Paths of one segment find lamps only. */
static view view_of(const ca_scene *scene, uint32_t width, uint32_t height)
{
    static const char *const names[3][3] = {
        {"N.X", "N.Y", "N.Z"}, {"Albedo.R", "Albedo.G", "Albedo.B"}, {"P.X", "P.Y", "P.Z"}};
    ca_image_layers *image = render(scene, "path", 1, width, height, 32, 1);
    view v = {.width = width, .height = height};
    const size_t pixels = (size_t)width * height;
    for (int c = 0; c < 3; c++) {
        v.normal[c] = copy_of(image, names[0][c], pixels);
        v.albedo[c] = copy_of(image, names[1][c], pixels);
        v.position[c] = copy_of(image, names[2][c], pixels);
    }
    v.lamp = need(pixels, sizeof *v.lamp);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) v.lamp[(size_t)y * width + x] = light_nearby(image, &v, x, y);
    ca_image_release(image);
    return v;
}

static void release_view(view *v)
{
    for (int c = 0; c < 3; c++) {
        free(v->normal[c]);
        free(v->albedo[c]);
        free(v->position[c]);
    }
    free(v->lamp);
}

/* Mean of batches; level and its error go to `f`, for the batches' levels are independent where pixels are not. */
static picture render_picture(const ca_scene *scene, const char *integrator, int max_depth, const view *v,
                              uint64_t seed, figures *f)
{
    const uint32_t pixels = v->width * v->height;
    picture p = {.pixels = pixels, .value = need(pixels, sizeof(float)), .error = need(pixels, sizeof(float))};
    double *sum = need(pixels, sizeof *sum), *squares = need(pixels, sizeof *squares), levels = 0.0,
           level_squares = 0.0;
    uint32_t counted = 0;
    for (uint32_t i = 0; i < pixels; i++) counted += !v->lamp[i];
    for (uint32_t batch = 0; batch < BATCHES; batch++) {
        ca_image_layers *image = render(scene, integrator, max_depth, v->width, v->height, SAMPLES, seed + batch);
        double level = 0.0;
        for (uint32_t i = 0; i < pixels; i++) {
            const double value = (double)luminance_of(image, i);
            sum[i] += value;
            squares[i] += value * value;
            if (!v->lamp[i]) level += value / counted;
        }
        levels += level;
        level_squares += level * level;
        ca_image_release(image);
    }
    for (uint32_t i = 0; i < pixels; i++) {
        p.value[i] = (float)(sum[i] / BATCHES);
        p.error[i] = (float)sqrt(fmax(squares[i] - sum[i] * sum[i] / BATCHES, 0.0) / (BATCHES - 1) / BATCHES);
    }
    f->level = levels / BATCHES;
    f->level_error = sqrt(fmax(level_squares - levels * levels / BATCHES, 0.0) / (BATCHES - 1) / BATCHES);
    free(sum);
    free(squares);
    return p;
}

static void release_picture(picture *p)
{
    free(p->value);
    free(p->error);
}

/* ---- Figures --------------------------------------------------------------------------------------------------- */

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static float median_of(float *values, size_t count)
{
    qsort(values, count, sizeof *values, compare_floats);
    return count ? values[count / 2] : 0.0f;
}

static bool same_surface(const view *v, size_t a, size_t b)
{
    for (int c = 0; c < 3; c++)
        if (fabsf(v->normal[c][a] - v->normal[c][b]) > 0.02f || fabsf(v->albedo[c][a] - v->albedo[c][b]) > 0.02f)
            return false;
    return true;
}

/* A firefly is brighter than 1.5 times the median of those pixels around it, 5 x 5, that show the same surface (its
 * normal and its albedo), and that by more than 5 % of the picture's level; and both holds for the pixel's value by
 * another method too, in place of the median: so no shadow's corner counts. Where fewer than ten pixels show the
 * surface, nothing is said.
 */
static bool is_firefly(const picture *p, const picture *other_method, const view *v, uint32_t x, uint32_t y,
                       double level)
{
    const size_t pixel = (size_t)y * v->width + x;
    float around[(2 * REACH + 1) * (2 * REACH + 1)];
    size_t count = 0;
    if (v->lamp[pixel]) return false;
    for (uint32_t j = y - REACH; j <= y + REACH; j++)
        for (uint32_t i = x - REACH; i <= x + REACH; i++) {
            const size_t other = (size_t)j * v->width + i;
            if (other != pixel && !v->lamp[other] && same_surface(v, pixel, other)) around[count++] = p->value[other];
        }
    if (count < 10) return false;
    const float usual = fmaxf(median_of(around, count), other_method->value[pixel]);
    return p->value[pixel] > 1.5f * usual && (double)(p->value[pixel] - usual) > 0.05 * level;
}

static int fireflies_of(const picture *p, const picture *other_method, const view *v, double level)
{
    int count = 0;
    for (uint32_t y = REACH; y + REACH < v->height; y++)
        for (uint32_t x = REACH; x + REACH < v->width; x++) count += is_firefly(p, other_method, v, x, y, level);
    return count;
}

/* Without another method's picture fireflies are not counted. */
static void complete_figures(const picture *p, const picture *other_method, const view *v, figures *f)
{
    float *values = need(p->pixels, sizeof *values), *relative = need(p->pixels, sizeof *relative);
    double squares = 0.0;
    size_t count = 0;
    for (uint32_t i = 0; i < p->pixels; i++) {
        if (v->lamp[i]) continue;
        squares += (double)p->error[i] * (double)p->error[i];
        relative[count] = p->value[i] > 0.0f ? p->error[i] / p->value[i] : 1.0f;
        values[count++] = p->value[i];
    }
    f->noise = sqrt(squares / (double)count) / f->level;
    f->median = (double)median_of(values, count);
    f->typical = (double)median_of(relative, count);
    f->fireflies = other_method ? fireflies_of(p, other_method, v, f->level) : -1;
    free(values);
    free(relative);
}

static figures measure(const ca_scene *scene, const char *integrator, const view *v)
{
    figures f = {0};
    picture p = render_picture(scene, integrator, 0, v, seed_of(integrator), &f);
    complete_figures(&p, NULL, v, &f);
    release_picture(&p);
    return f;
}

static void print_figures(const char *scene, const char *integrator, const figures *f)
{
    char fireflies[16] = "–";
    if (f->fireflies >= 0) snprintf(fireflies, sizeof fireflies, "%d", f->fireflies);
    print_message("    | %s | `%s` | %.4f ± %.4f | %.3f | %.1f %% | %.1f %% | %s |\n", scene, integrator, f->level,
                  f->level_error, f->median, 100.0 * f->noise, 100.0 * f->typical, fireflies);
}

static const char table_head[] = "    | scene | integrator | level | median | noise | typical noise | fireflies |\n"
                                 "    |---|---|---|---|---|---|---|\n";

/* ---- The three lights ------------------------------------------------------------------------------------------ */

enum { LARGE, SMALL, TWO, LIGHTS };
enum { ALL, NO_SPLAT, PAPER, PATH, HITS_ONLY, INTEGRATORS };
static const char *const lights[LIGHTS] = {"large-light", "small-light", "two-small-lights"};
static const char *const integrators[INTEGRATORS] = {"bdpt", "bdpt:strategies=no-splat", "bdpt:paper=true", "path",
                                                     "path:next_event=false"};
static figures of_light[LIGHTS][INTEGRATORS];

static ca_scene *load_light(int light)
{
    char name[64];
    snprintf(name, sizeof name, "paper-003/%s", lights[light]);
    return bundled_scene(name);
}

static void measure_light(const ca_scene *scene, const char *name, const view *v, figures f[INTEGRATORS])
{
    picture pictures[INTEGRATORS];
    for (int i = 0; i < INTEGRATORS; i++)
        pictures[i] = render_picture(scene, integrators[i], 0, v, seed_of(integrators[i]), &f[i]);
    for (int i = 0; i < INTEGRATORS; i++) {
        complete_figures(&pictures[i], &pictures[i == PATH ? ALL : PATH], v, &f[i]);
        print_figures(name, integrators[i], &f[i]);
    }
    for (int i = 0; i < INTEGRATORS; i++) release_picture(&pictures[i]);
}

/* What shows a lamp in one of the scenes is left out in all of them, so that levels are of the same pixels. */
static void measure_lights(void)
{
    if (of_light[0][0].level > 0.0) return; /* that has been done */
    ca_scene *scenes[LIGHTS];
    view views[LIGHTS];
    for (int light = 0; light < LIGHTS; light++) {
        scenes[light] = load_light(light);
        views[light] = view_of(scenes[light], side, side);
        for (uint32_t i = 0; i < side * side; i++) views[0].lamp[i] |= views[light].lamp[i];
    }
    print_message("%s", table_head);
    for (int light = 0; light < LIGHTS; light++) {
        memcpy(views[light].lamp, views[0].lamp, side * side * sizeof *views[0].lamp);
        measure_light(scenes[light], lights[light], &views[light], of_light[light]);
    }
    for (int light = 0; light < LIGHTS; light++) {
        release_view(&views[light]);
        ca_scene_release(scenes[light]);
    }
}

/* A sphere lights a surface that sees all of it like a point in its centre: radiance rho L r^2 cos / d^2. No block
 * comes between the lamp and what is higher than 1.35. */
static double direct_light(const view *v, size_t pixel)
{
    static const double centre[3] = {0.0, 1.5, 0.0},
                        power[3] = {7.2 * 0.24 * 0.24, 6.3 * 0.24 * 0.24, 5.1 * 0.24 * 0.24};
    static const double luminance[3] = {0.2126, 0.7152, 0.0722};
    double squared = 0.0, projected = 0.0, value = 0.0;
    for (int c = 0; c < 3; c++) {
        const double towards = centre[c] - (double)v->position[c][pixel];
        squared += towards * towards;
        projected += towards * (double)v->normal[c][pixel];
    }
    for (int c = 0; c < 3; c++) value += luminance[c] * power[c] * (double)v->albedo[c][pixel];
    return value * projected / (squared * sqrt(squared));
}

static bool sees_the_lamp(const view *v, size_t pixel)
{
    double length = 0.0; /* of the mean normal: shorter where two surfaces share the pixel */
    for (int c = 0; c < 3; c++) length += (double)v->normal[c][pixel] * (double)v->normal[c][pixel];
    return !v->lamp[pixel] && length > 0.9999 && v->position[1][pixel] > 1.35f;
}

static void test_direct_light_does_not_depend_on_the_size(void **state)
{
    (void)state;
    for (int light = LARGE; light <= SMALL; light++) {
        ca_scene *scene = load_light(light);
        view v = view_of(scene, 100, 100);
        figures f = {0};
        picture p = render_picture(scene, "bdpt", 2, &v, 100, &f);
        double sum = 0.0, variance = 0.0, expected = 0.0;
        for (uint32_t i = 0; i < p.pixels; i++) {
            if (!sees_the_lamp(&v, i)) continue;
            sum += (double)p.value[i];
            variance += (double)p.error[i] * (double)p.error[i];
            expected += direct_light(&v, i);
        }
        const double ratio = sum / expected, error = sqrt(variance) / expected;
        print_message("    %s: direct light on walls and ceiling, measured : calculated %.4f ± %.4f\n", lights[light],
                      ratio, error);
        assert_true(error < 0.003 && fabs(ratio - 1.0) < 0.002 + 3.0 * error);
        release_picture(&p);
        release_view(&v);
        ca_scene_release(scene);
    }
}

/* "The overall level of illumination is about the same." A large lamp takes away more light, by being in its way. */
static void test_the_level_does_not_depend_on_the_size(void **state)
{
    (void)state;
    measure_lights();
    const double large = of_light[LARGE][ALL].level;
    for (int light = SMALL; light < LIGHTS; light++) {
        const double ratio = of_light[light][ALL].level / large;
        const double error = hypot(of_light[light][ALL].level_error, of_light[LARGE][ALL].level_error) / large;
        print_message("    level of %s : large-light %.4f ± %.4f\n", lights[light], ratio, error);
        assert_true(fabs(ratio - 1.0) < 0.08 && error < 0.01);
    }
    for (int light = 0; light < LIGHTS; light++)
        for (int i = NO_SPLAT; i < INTEGRATORS; i++) {
            if (i == PAPER) continue; /* its rays go through the pixels' centres: other averages at edges */
            const figures *a = &of_light[light][i], *b = &of_light[light][ALL];
            /* four degrees of freedom: 5.6 standard errors are 0.5 % */
            assert_true(fabs(a->level - b->level) < 0.001 * b->level + 5.6 * hypot(a->level_error, b->level_error));
        }
}

/* "A regular path tracer would render a significantly darker image for a smaller light": one that only waits for
 * hits. The mean is the same, but it sits in few pixels, and most are too dark. */
static void test_hits_alone_are_darker_and_noisier(void **state)
{
    (void)state;
    measure_lights();
    for (int light = 0; light < LIGHTS; light++) {
        const figures *hits = &of_light[light][HITS_ONLY], *all = &of_light[light][ALL];
        print_message("    %s: median pixel of hits alone : bdpt %.3f, noise %.1f times\n", lights[light],
                      hits->median / all->median, hits->noise / all->noise);
        assert_true(hits->noise > 5.0 * all->noise);
        assert_true(hits->median < all->median);
    }
    assert_true(of_light[SMALL][HITS_ONLY].median < 0.5 * of_light[SMALL][ALL].median);
    assert_true(of_light[SMALL][HITS_ONLY].median < of_light[LARGE][HITS_ONLY].median);
}

/* The report's own program: as bright as `bdpt` but for what its fixed rays leave out at edges, noisier because its
 * directions are uniform, and with more fireflies from the large light than from the small one. */
static void test_the_papers_program(void **state)
{
    (void)state;
    measure_lights();
    for (int light = 0; light < LIGHTS; light++) {
        const figures *paper = &of_light[light][PAPER], *ours = &of_light[light][NO_SPLAT];
        print_message("    %s: level of paper=true : no-splat %.4f, noise %.2f times, fireflies %d\n", lights[light],
                      paper->level / ours->level, paper->noise / ours->noise, paper->fireflies);
        assert_true(fabs(paper->level / ours->level - 1.0) < 0.02);
        assert_true(paper->noise > ours->noise);
    }
    assert_true(of_light[LARGE][PAPER].noise > of_light[SMALL][PAPER].noise);
    assert_true(of_light[LARGE][PAPER].fireflies > of_light[SMALL][PAPER].fireflies);
}

static void test_fireflies(void **state)
{
    (void)state;
    measure_lights();
    for (int light = 0; light < LIGHTS; light++) {
        assert_true(of_light[light][NO_SPLAT].fireflies <= (int)(side * side / 1000));
        assert_true(of_light[light][ALL].fireflies <= (int)(side * side / 1000));
        assert_true(of_light[light][HITS_ONLY].fireflies > 20 * (of_light[light][ALL].fireflies + 1));
    }
}

/* ---- The perceptual study and the open list -------------------------------------------------------------------- */

/* "Scenes with indirect illumination (through occluded light sources) are more likely to be perceived as different":
 * they have more noise. */
static void test_occluded_lamps_are_noisier(void **state)
{
    (void)state;
    static const char *const scenarios[4] = {"visible-diffuse", "occluded-diffuse", "visible-mixed",
                                             "occluded-mixed"};
    static const char *const methods[3] = {"bdpt", "path", "ovcm"};
    figures f[4][3];
    print_message("%s", table_head);
    for (int s = 0; s < 4; s++) {
        char name[64];
        snprintf(name, sizeof name, "perceptual-study/%s", scenarios[s]);
        ca_scene *scene = bundled_scene(name);
        view v = view_of(scene, side / 4, side / 4);
        for (int i = 0; i < 3; i++) {
            f[s][i] = measure(scene, methods[i], &v);
            print_figures(scenarios[s], methods[i], &f[s][i]);
        }
        release_view(&v);
        ca_scene_release(scene);
    }
    for (int s = 0; s < 4; s += 2) assert_true(f[s + 1][0].typical > f[s][0].typical);
    for (int s = 0; s < 4; s++) assert_true(f[s][0].typical < f[s][1].typical);
}

/* The strategy that the paper left out, t = 1, finds the caustics of a small lamp. */
static void test_splats_find_caustics(void **state)
{
    (void)state;
    static const char *const methods[4] = {"bdpt:strategies=no-splat", "path", "bdpt", "vcm"};
    const ca_define lamp = {"lamp", "0.3"};
    ca_scene *scene = bundled_scene_with("caustics/caustics", &lamp);
    view v = view_of(scene, side * 12 / 25, side * 8 / 25);
    figures f[4];
    print_message("%s", table_head);
    for (int i = 0; i < 4; i++) {
        f[i] = measure(scene, methods[i], &v);
        print_figures("caustics", methods[i], &f[i]);
    }
    release_view(&v);
    ca_scene_release(scene);
    assert_true(f[2].noise < f[0].noise);
}

int main(int argc, char **argv)
{
    if (argc > 1) side = (uint32_t)atoi(argv[1]);
    if (side < 40 || side > MAX_SIDE) return 2;
    if (argc > 2) cmocka_set_test_filter(argv[2]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_direct_light_does_not_depend_on_the_size),
        cmocka_unit_test(test_the_level_does_not_depend_on_the_size),
        cmocka_unit_test(test_hits_alone_are_darker_and_noisier),
        cmocka_unit_test(test_the_papers_program),
        cmocka_unit_test(test_fireflies),
        cmocka_unit_test(test_occluded_lamps_are_noisier),
        cmocka_unit_test(test_splats_find_caustics),
    };
    return _cmocka_run_group_tests("paper 003", tests, sizeof tests / sizeof tests[0], NULL, NULL);
}
