/* Pictures of paper 000's scenes like its figure 3: the image, and the three terms of its noise as red, green and
 * blue, for two numbers of camera paths. */
#include "bench_support.h"
#include "image/layers.h"
#include "paper_000.h"
#include "render/noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Pixels of a panel; each is drawn with as many squared. */
enum { SIDE = 96, QUICK_SIDE = 24, ENLARGED = 2, PANELS = 3, GAP = 8, ITERATIONS = 96 };

typedef struct panels {
    ca_image_layers *picture; /* owned */
    float *channels[3];       /* borrowed from it */
    uint32_t side, width;
} panels;

static panels make_panels(uint32_t side)
{
    static const char *const names[3] = {"R", "G", "B"};
    panels p = {.side = side, .width = PANELS * side * ENLARGED + (PANELS - 1) * GAP};
    ca_error error;
    if (ca_layers_create(&p.picture, p.width, side * ENLARGED, &error) != CA_OK) bench_die("picture", &error);
    for (int c = 0; c < 3; c++) {
        if (ca_layers_add(p.picture, names[c], &p.channels[c], &error) != CA_OK) bench_die("picture", &error);
        for (size_t i = 0; i < (size_t)p.width * side * ENLARGED; i++) p.channels[c][i] = 1.0f;
    }
    return p;
}

static void draw_pixel(panels *p, int panel, size_t pixel, const double rgb[3])
{
    const size_t x0 = (size_t)panel * (p->side * ENLARGED + GAP) + pixel % p->side * ENLARGED,
                 y0 = pixel / p->side * ENLARGED;
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < ENLARGED * ENLARGED; i++)
            p->channels[c][(y0 + i / ENLARGED) * p->width + x0 + i % ENLARGED] = (float)rgb[c];
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Roots of the terms in the order of the paper's colours. */
static void roots_of_terms(const ca_pair_pixel *pixel, double light_paths, double camera_paths, double roots[3])
{
    const ca_noise_terms t = ca_noise_terms_of(pixel, light_paths, camera_paths);
    const double variances[3] = {t.pair.value, t.camera.value, t.light.value};
    for (int c = 0; c < 3; c++) roots[c] = sqrt(fmax(0.0, variances[c]));
}

/* What is full red, green or blue: a term that one pixel in a hundred exceeds. */
static double full_scale(const ca_pair_film *film)
{
    const size_t pixels = (size_t)film->width * film->height;
    double *largest = paper_need(calloc(pixels, sizeof *largest)), roots[3];
    for (size_t p = 0; p < pixels; p++) {
        roots_of_terms(&film->pixels[p], PAPER_000_LIGHT, PAPER_000_CAMERA, roots);
        largest[p] = fmax(roots[0], fmax(roots[1], roots[2]));
    }
    qsort(largest, pixels, sizeof *largest, by_size);
    const double scale = largest[pixels * 99 / 100];
    free(largest);
    return scale > 0.0 ? scale : 1.0;
}

static double draw(panels *p, const ca_pair_film *film, const ca_image_layers *image)
{
    const float *const rgb[3] = {ca_layers_find(image, "R"), ca_layers_find(image, "G"), ca_layers_find(image, "B")};
    const double scale = full_scale(film);
    double values[3];
    for (size_t i = 0; i < (size_t)film->width * film->height; i++) {
        for (int c = 0; c < 3; c++) values[c] = (double)rgb[c][i];
        draw_pixel(p, 0, i, values);
        for (int panel = 1; panel < PANELS; panel++) {
            roots_of_terms(&film->pixels[i], PAPER_000_LIGHT, panel == 1 ? PAPER_000_CAMERA : 3 * PAPER_000_CAMERA,
                           values);
            for (int c = 0; c < 3; c++) values[c] /= scale;
            draw_pixel(p, panel, i, values);
        }
    }
    return scale;
}

static void show_scene(const paper_report *report, const paper_000_scene *scene)
{
    char path[512];
    ca_noise *noise;
    ca_image_layers *image;
    ca_error error;
    ca_scene *loaded = paper_000_load(scene);
    ca_render_settings settings = paper_000_settings(scene, PAPER_000_PILOT_LIGHT, PAPER_000_PILOT_CAMERA, 7);
    panels p = make_panels(report->quick ? QUICK_SIDE : SIDE);
    settings.has_crop = false;
    settings.width = settings.height = p.side;
    if (ca_noise_measure(loaded, &settings, ITERATIONS, &noise, &image, NULL, &error) != CA_OK)
        bench_die(scene->name, &error);
    const double scale = draw(&p, &noise->film, image);
    snprintf(path, sizeof path, "%s/%s.png", report->pictures, scene->name);
    if (ca_image_save(p.picture, path, 0.0f, &error) != CA_OK) bench_die(path, &error);
    fprintf(report->out, "`%s`, full scale %.2g:\n\n![%s](%s/%s.png)\n\n", scene->name, scale, scene->name,
            report->link, scene->name);
    ca_image_release(p.picture);
    ca_image_release(image);
    ca_noise_release(noise);
    ca_scene_release(loaded);
}

void paper_000_pictures(paper_report *report)
{
    if (!report->pictures) return;
    fprintf(report->out,
            "### The scenes, and their noise in colours\n\n"
            "Each at %d × %d pixels: the image; the roots of the pair, camera and light terms as red, green and blue "
            "for N_F = %d, N_B "
            "= %d, like the paper's figure 3; and for N_B = %d at the same scale. Predicted from %d iterations of %d "
            "light and %d "
            "camera paths; terms that come out negative are black. Terms depend on the pixels' size, which is "
            "another one in figures "
            "0 to 3.\n\n",
            SIDE, SIDE, PAPER_000_LIGHT, PAPER_000_CAMERA, 3 * PAPER_000_CAMERA, ITERATIONS, PAPER_000_PILOT_LIGHT,
            PAPER_000_PILOT_CAMERA);
    for (int s = 0; s < PAPER_000_SCENES; s++) show_scene(report, &paper_000_scenes[s]);
}
