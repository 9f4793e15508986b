#define _POSIX_C_SOURCE 200809L
#include "support/mitsuba_scenes.h"

#include "image/layers.h"
#include "material/rough_transmittance.h"
#include "support/batches.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define FOLDER CA_SOURCE_DIR "/tests/mitsuba"

/* With fewer samples the batches' means have tails, and more of them lie far off than the bounds allow for. */
enum { BATCHES = 32, SAMPLES = 14 };
enum { BLOCK_SIDE = 4, MAX_BLOCKS = 64, NAME_SIZE = 128 };

typedef struct reference {
    char name[NAME_SIZE]; /* "bsdfs/normalmap" */
    uint32_t columns, rows;
    double mean[MAX_BLOCKS][3], error[MAX_BLOCKS][3];
} reference;

typedef struct tally {
    uint32_t values, far; /* far: beyond 3.3 standard errors */
    double farthest;
} tally;

/* The next line that is no comment; false at the end. */
static bool next_line(FILE *file, char *line, int size)
{
    while (fgets(line, size, file))
        if (line[0] != '#') return true;
    return false;
}

static bool read_reference(FILE *file, reference *r)
{
    char line[256];
    if (!next_line(file, line, sizeof line)) return false;
    assert_int_equal(sscanf(line, "%127s %u %u", r->name, &r->columns, &r->rows), 3);
    assert_true(r->columns * r->rows <= MAX_BLOCKS);
    for (uint32_t i = 0; i < r->columns * r->rows; i++) {
        double *m = r->mean[i], *e = r->error[i];
        assert_true(next_line(file, line, sizeof line));
        assert_int_equal(sscanf(line, "%lf %lf %lf %lf %lf %lf", &m[0], &m[1], &m[2], &e[0], &e[1], &e[2]), 6);
    }
    return true;
}

/* Distance of our block means from the recorded ones, in standard errors of the difference; 3e-4 of the value are
 * allowed for spectra, which the two integrate in different steps. */
static tally compare_blocks(const reference *r, const ca_image_layers *image)
{
    static const char *const names[3] = {"R", "G", "B"};
    static const char *const variances[3] = {"Variance.R", "Variance.G", "Variance.B"};
    tally t = {0};
    assert_int_equal(image->width, r->columns);
    assert_int_equal(image->height, r->rows);
    for (int c = 0; c < 3; c++) {
        const float *value = ca_layers_find(image, names[c]), *variance = ca_layers_find(image, variances[c]);
        for (uint32_t i = 0; i < r->columns * r->rows; i++) {
            const double ours = sqrt((double)variance[i] / BATCHES), theirs = r->error[i][c];
            const double spread = sqrt(ours * ours + theirs * theirs) + 1e-4 * fabs(r->mean[i][c]) + 1e-9;
            const double z = fabs((double)value[i] - r->mean[i][c]) / spread;
            t.values++;
            if (!(z <= 3.3)) t.far++;
            t.farthest = fmax(t.farthest, z);
        }
    }
    return t;
}

/* Of the whole picture, luminance. */
static double relative_deviation(const reference *r, const ca_image_layers *image)
{
    const uint32_t count = r->columns * r->rows;
    const float *green = ca_layers_find(image, "G");
    double ours = 0.0, theirs = 0.0;
    for (uint32_t i = 0; i < count; i++) {
        ours += (double)green[i];
        theirs += r->mean[i][1];
    }
    return theirs == 0.0 ? ours : ours / theirs - 1.0;
}

static void compare(const ca_scene *scene, const reference *r, const char *integrator, tally *sum)
{
    const batch_settings settings = {.integrator = integrator,
                                     .samples = SAMPLES,
                                     .batches = BATCHES,
                                     .seed = seed_of(r->name),
                                     .block_side = BLOCK_SIDE,
                                     .threads = 1};
    ca_image_layers *image = render_batches(scene, &settings);
    const tally t = compare_blocks(r, image);
    print_message("    %-36s %-18s mean %+6.2f %%, %2u of %u beyond 3.3, farthest %.2f%s\n", r->name,
                  integrator ? integrator : "", 100.0 * relative_deviation(r, image), t.far, t.values, t.farthest,
                  t.farthest > 6.0 || t.far > 6 ? "  DIFFERS" : "");
    ca_image_release(image);
    sum->values += t.values;
    sum->far += t.far;
    sum->farthest = fmax(sum->farthest, t.farthest);
}

/* Mitsuba reflects a 64th too little of the light below a rough plastic's boundary back onto its base (scenes.md): to
 * look the same, our base needs a reflectance r' with r' / (1 - rho r') = r / (1 - 63/64 rho r), or, of a linear one,
 * r' / (1 - rho) = r / (1 - 63/64 rho). */
typedef struct rough_plastic {
    const char *scene;
    ca_microfacet_kind kind;
    float alpha;
    bool nonlinear;
    double diffuse[3];
} rough_plastic;

static const rough_plastic rough_plastics[] = {
    {"bsdfs/roughplastic", CA_MICROFACET_BECKMANN, 0.2f, false, {0.1, 0.3, 0.6}},
    {"bsdfs/roughplastic-ggx", CA_MICROFACET_GGX, 0.4f, true, {0.6, 0.3, 0.1}},
    {"bsdfs/normalmap-plastic", CA_MICROFACET_BECKMANN, 0.3f, false, {0.3, 0.5, 0.7}},
};

static double dimmed(const rough_plastic *plastic, double rho, double r)
{
    const double seen = r / (1.0 - 63.0 / 64.0 * rho * (plastic->nonlinear ? r : 1.0));
    return plastic->nonlinear ? seen / (1.0 + rho * seen) : seen * (1.0 - rho);
}

/* Writes the reflectance that the scene is to have as the value of $diffuse; false where it has none. */
static bool find_diffuse(const char *scene, char *value, size_t size)
{
    for (size_t i = 0; i < sizeof rough_plastics / sizeof *rough_plastics; i++) {
        const rough_plastic *p = &rough_plastics[i];
        if (strcmp(p->scene, scene) != 0) continue;
        ca_rough_transmittance *table = ca_rough_transmittance_create(p->kind, p->alpha, 1.49f / 1.000277f);
        assert_non_null(table);
        const double rho = 1.0 - (double)ca_rough_transmittance_from_inside(table);
        ca_rough_transmittance_destroy(table);
        snprintf(value, size, "%.9g, %.9g, %.9g", dimmed(p, rho, p->diffuse[0]), dimmed(p, rho, p->diffuse[1]),
                 dimmed(p, rho, p->diffuse[2]));
        return true;
    }
    return false;
}

static void compare_scene(const reference *r, uint32_t number, bool own, tally *sum)
{
    char path[512];
    ca_scene *scene;
    ca_error error;
    char diffuse[80] = "";
    const ca_define define = {.name = "diffuse", .value = diffuse};
    snprintf(path, sizeof path, FOLDER "/%s.xml", r->name);
    const size_t defined = find_diffuse(r->name, diffuse, sizeof diffuse);
    if (ca_scene_load(path, &define, defined, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    if (own) {
        compare(scene, r, NULL, sum);
    } else {
        compare(scene, r, "path", sum);
        compare(scene, r, number % 2 ? "bdpt" : "ovcm:radius=0.03,alpha=0", sum);
    }
    ca_scene_release(scene);
}

static uint32_t count_scenes(const char *folder)
{
    char path[512];
    uint32_t count = 0;
    snprintf(path, sizeof path, FOLDER "/%s", folder);
    DIR *stream = opendir(path);
    assert_non_null(stream);
    for (const struct dirent *entry; (entry = readdir(stream)) != NULL;)
        if (strstr(entry->d_name, ".xml")) count++;
    closedir(stream);
    return count;
}

void compare_with_mitsuba(const char *folder, bool own)
{
    static reference r;
    tally sum = {0};
    uint32_t scenes = 0;
    FILE *file = fopen(FOLDER "/references.txt", "r");
    assert_non_null(file);
    while (read_reference(file, &r)) {
        const size_t length = strlen(folder);
        if (strncmp(r.name, folder, length) == 0 && r.name[length] == '/') compare_scene(&r, scenes++, own, &sum);
    }
    fclose(file);
    print_message("    %u scenes, %u of %u values beyond 3.3 standard errors, farthest %.2f\n", scenes, sum.far,
                  sum.values, sum.farthest);
    assert_int_equal(scenes, count_scenes(folder));
    assert_true(sum.far <= 0.01 * sum.values);
    assert_true(sum.farthest <= 6.0);
}
