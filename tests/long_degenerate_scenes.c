/* Degenerate scenes, each rendered by every integrator (8 x 8 pixels, two samples): shapes without area, of all sizes
 * and one in the other, smooth and rough to the limit, meshes of slivers, instances, textures that repeat without end
 * or never, lights of no and of enormous power, cameras within surfaces. Each is refused in words, of which those of
 * reading begin with the file's name, or rendered, in time. Every value of every layer is finite (but for bounds of
 * intervals, and variances of enormous light), and not below 0 where it is light, a variance or a number of
 * something; no sample is dropped. Each integrator renders more than nine in ten.
 *
 * Scene i depends on i alone: CA_DEGENERATE_FIRST is the first, CA_DEGENERATE the number of those that are not
 * refused when they are read (2000). */
#define _DEFAULT_SOURCE /* mkstemps */
#include "base/clock.h"
#include "base/status.h"
#include "caustica.h"
#include "image/layers.h"
#include "support/test_random.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const char *const integrators[] = {"path",     "light",    "bdpt", "ppm",   "bdpm",  "vcm",
                                          "vcm-plus", "vcm-star", "ovcm", "cavcm", "vavcm", "qmcppm",
                                          "vcm:guide=true"};
enum { INTEGRATORS = sizeof integrators / sizeof integrators[0], TEXT_SIZE = 1 << 14, SECONDS_ALLOWED = 20 };

static const char *const numbers[] = {"0",     "1", "1",    "1",   "0.5",  "0.001", "1e-6", "1e-12", "1e-20",
                                      "1e-38", "3", "1000", "1e6", "1e12", "1e20",  "-1",   "-0.3"};
static const char *const fractions[] = {"0", "0", "1", "1", "0.5", "0.5", "1e-6", "0.999999", "1e-30"};
static const char *const places[] = {"0", "0", "0", "0.5", "-0.7", "1", "1e-6", "1000", "1e6", "-1e10"};
static const char *const indices[] = {"1", "1.5", "1.5", "1.0000001", "1.001", "3", "1000", "0.5"};

#ifndef DEGENERATE_SCENES
#define DEGENERATE_SCENES 2000 /* test_degenerate_scenes has fewer */
#endif

typedef struct writer {
    ca_test_random *random;
    char *text;
    size_t used;
} writer;

static size_t below(writer *w, size_t limit) { return (size_t)(ca_test_random_open(w->random) * (double)limit); }

#define ONE_OF(w, list) ((list)[below(w, sizeof(list) / sizeof *(list))])

static void put(writer *w, const char *format, ...) CA_PRINTF(2, 3);

static void put(writer *w, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const int length = vsnprintf(w->text + w->used, TEXT_SIZE - w->used, format, list);
    va_end(list);
    w->used += (size_t)length;
    assert_true(w->used < TEXT_SIZE);
}

/* ---- The mesh -------------------------------------------------------------------------------------------------- */

static char mesh_path[] = "/tmp/caustica-degenerate-XXXXXX.ply";

/* Triangles that are points, lines, slivers and twice there, one of usual shape, and coordinates that jump. */
static int write_mesh(void **state)
{
    (void)state;
    static const char text[] =
        "ply\nformat ascii 1.0\nelement vertex 7\nproperty float x\nproperty float y\nproperty float z\n"
        "property float u\nproperty float v\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n"
        "-1 -1 0 0 0\n1 -1 0 1 0\n1 1 0 1 1\n1 1 0 1e9 -1e9\n0 1e-20 0 0.5 0.5\n-1 1 1e-7 0 1\n0 0 0 0.5 0.5\n"
        "3 0 1 2\n3 0 1 2\n3 0 2 5\n3 2 3 3\n3 0 6 2\n3 1 4 6\n";
    const int descriptor = mkstemps(mesh_path, (int)strlen(".ply"));
    assert_true(descriptor >= 0);
    assert_int_equal(write(descriptor, text, strlen(text)), (ssize_t)strlen(text));
    return close(descriptor);
}

static int remove_mesh(void **state)
{
    (void)state;
    return unlink(mesh_path);
}

/* ---- Parts of a scene ------------------------------------------------------------------------------------------ */

static void put_map(writer *w)
{
    static const char *const scales[] = {"1",   "1",    "1",  "1e-6",     "1e-15", "1e-30",
                                         "1e5", "1e10", "-1", "1,1,1e-8", "1,0,1"};
    put(w, "<transform name='to_world'><scale value='%s'/>", ONE_OF(w, scales));
    if (below(w, 2)) put(w, "<rotate x='1' y='%s' angle='%s'/>", ONE_OF(w, fractions), ONE_OF(w, numbers));
    put(w, "<translate x='%s' y='%s' z='%s'/></transform>", ONE_OF(w, places), ONE_OF(w, places), ONE_OF(w, places));
}

static void put_bsdf(writer *w)
{
    const char *a = ONE_OF(w, fractions), *b = ONE_OF(w, fractions), *index = ONE_OF(w, indices);
    switch (below(w, 11)) {
    case 0: put(w, "<bsdf type='diffuse'><rgb name='reflectance' value='%s'/></bsdf>", a); break;
    case 1: put(w, "<bsdf type='dielectric'><float name='int_ior' value='%s'/></bsdf>", index); break;
    case 2:
        put(w,
            "<bsdf type='roughdielectric'><float name='alpha' value='%s'/><float name='int_ior' value='%s'/></bsdf>",
            a, index);
        break;
    case 3: put(w, "<bsdf type='conductor'/>"); break;
    case 4: put(w, "<bsdf type='roughconductor'><float name='alpha' value='%s'/></bsdf>", a); break;
    case 5: put(w, "<bsdf type='plastic'><float name='int_ior' value='%s'/></bsdf>", index); break;
    case 6: put(w, "<bsdf type='roughplastic'><float name='alpha' value='%s'/></bsdf>", a); break;
    case 7: put(w, "<bsdf type='mask'><float name='opacity' value='%s'/><bsdf type='diffuse'/></bsdf>", a); break;
    case 8: put(w, "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>"); break;
    case 9:
        put(w,
            "<bsdf type='principled'><float name='roughness' value='%s'/><float name='metallic' value='%s'/></bsdf>",
            a, b);
        break;
    default:
        put(w,
            "<bsdf type='blendbsdf'><float name='weight' value='%s'/><bsdf type='diffuse'/>"
            "<bsdf type='dielectric'/></bsdf>",
            a);
    }
}

static void put_radiance(writer *w, const char *name)
{
    static const char *const powers[] = {"1", "1", "10", "0", "1e-45", "1e-20", "1e10", "1e30", "1,0,0"};
    put(w, "<rgb name='%s' value='%s'/>", name, ONE_OF(w, powers));
}

/* May it be a lamp? */
static void put_shape(writer *w, bool may_emit)
{
    static const char *const kinds[] = {"sphere", "rectangle", "cube", "disk", "cylinder"};
    put(w, "<shape type='%s'>", ONE_OF(w, kinds));
    put_map(w);
    put_bsdf(w);
    if (may_emit && below(w, 4) == 0) {
        put(w, "<emitter type='area'>");
        put_radiance(w, "radiance");
        put(w, "</emitter>");
    }
    put(w, "</shape>");
}

static void put_instances(writer *w)
{
    put(w, "<shape type='shapegroup' id='group'>");
    for (size_t shapes = 1 + below(w, 2); shapes > 0; shapes--) put_shape(w, false);
    put(w, "</shape>");
    for (size_t instances = 1 + below(w, 3); instances > 0; instances--) {
        put(w, "<shape type='instance'><ref id='group'/>");
        put_map(w);
        put(w, "</shape>");
    }
}

/* A texture as colour or as height of bumps, of a shape or of the mesh. */
static void put_textured(writer *w)
{
    static const char *const kinds[] = {"sphere", "rectangle", "disk", "cylinder"};
    if (below(w, 2))
        put(w, "<shape type='ply'><string name='filename' value='%s'/>", mesh_path);
    else
        put(w, "<shape type='%s'>", ONE_OF(w, kinds));
    put_map(w);
    const bool bumps = below(w, 3) == 0;
    if (bumps)
        put(w, "<bsdf type='bumpmap'><float name='scale' value='%s'/><texture type='checkerboard'>",
            ONE_OF(w, numbers));
    else
        put(w, "<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'>");
    put(w, "<rgb name='color0' value='%s'/><transform name='to_uv'><scale x='%s' y='%s'/></transform></texture>",
        ONE_OF(w, fractions), ONE_OF(w, numbers), ONE_OF(w, numbers));
    if (bumps) put_bsdf(w);
    put(w, "</bsdf></shape>");
}

static void put_light(writer *w)
{
    switch (below(w, 5)) {
    case 0:
        put(w, "<emitter type='point'><point name='position' x='%s' y='1' z='%s'/>", ONE_OF(w, places),
            ONE_OF(w, places));
        put_radiance(w, "intensity");
        break;
    case 1:
        put(w, "<emitter type='constant'>");
        put_radiance(w, "radiance");
        break;
    case 2:
        put(w, "<emitter type='directional'><vector name='direction' x='%s' y='-1' z='0'/>", ONE_OF(w, numbers));
        put_radiance(w, "irradiance");
        break;
    case 3:
        put(w, "<emitter type='spot'><float name='cutoff_angle' value='%s'/>", below(w, 2) ? "20" : "89.9999");
        put_radiance(w, "intensity");
        put_map(w);
        break;
    default: return;
    }
    put(w, "</emitter>");
}

static void put_camera(writer *w)
{
    static const char *const fields[] = {"45", "45", "0.01", "179"};
    static const char *const origins[] = {"0,0,4", "0,0,4",     "0,0,1",   "0,0,1.000001",
                                          "0,0,0", "1e6,0,1e6", "0,0,1e-8"};
    put(w, "<sensor type='%s'>", below(w, 4) ? "perspective" : "thinlens");
    put(w, "<transform name='to_world'><lookat origin='%s' target='0,0,-1e-3' up='0,1,0'/></transform>",
        ONE_OF(w, origins));
    put(w,
        "<float name='fov' value='%s'/><film type='hdrfilm'><integer name='width' value='8'/>"
        "<integer name='height' value='8'/></film></sensor>",
        ONE_OF(w, fields));
}

static void write_scene(writer *w, long number)
{
    ca_test_random random = ca_test_random_seed((uint64_t)number);
    w->random = &random;
    w->used = 0;
    put(w, "<scene version='3.0.0'>");
    put_camera(w);
    for (size_t shapes = 1 + below(w, 4); shapes > 0; shapes--) put_shape(w, true);
    for (size_t lights = below(w, 3); lights > 0; lights--) put_light(w);
    if (below(w, 3) == 0) put_instances(w);
    if (below(w, 3) == 0) put_textured(w);
    put(w, "</scene>");
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static long defects;

/* The whole text, of which cmocka's print_error has 1023 characters. */
static void complain(const char *text, long number, const char *integrator, const char *what)
{
    if (++defects <= 10) fprintf(stderr, "scene %ld, %s: %s\n%s\n", number, integrator, what, text);
}

static bool begins(const char *text, const char *with) { return strncmp(text, with, strlen(with)) == 0; }

/* May a value of this layer be below 0? Places, directions and estimates of variances; all else is light, a number of
 * something or how far one lies from another. */
static bool may_be_negative(const char *layer)
{
    return begins(layer, "N.") || begins(layer, "P.") || begins(layer, "ValueVariance") ||
           begins(layer, "ConfidenceLow");
}

/* The interval of a pixel may be, and the variance of light above 1.8e19 is more than a float holds. */
static bool may_be_unbounded(const char *layer, float value)
{
    return isinf(value) && (begins(layer, "Confidence") || (value > 0.0f && begins(layer, "Variance")));
}

/* The first value that is not in order; NULL: all are. */
static const char *find_disorder(const ca_image_layers *image, char words[128])
{
    for (size_t c = 0; c < image->channel_count; c++) {
        const char *layer = image->channels[c].name;
        for (size_t i = 0; i < (size_t)image->width * image->height; i++) {
            const float value = image->channels[c].data[i];
            const bool unbounded = may_be_unbounded(layer, value);
            const bool negative = value < 0.0f && !may_be_negative(layer);
            if ((isfinite(value) || unbounded) && !negative) continue;
            snprintf(words, 128, "%.60s is %g in pixel %zu", layer, (double)value, i);
            return words;
        }
    }
    return NULL;
}

/* "scene:12:3: ..." or at least a sentence; memory and threads are there. */
static bool is_refusal(ca_status status, const ca_error *error)
{
    const bool is_of_world = status == CA_ERROR_MEMORY || status == CA_ERROR_FILE || status == CA_ERROR_INTERRUPTED;
    return status != CA_OK && !is_of_world && strlen(error->message) > 20 && strchr(error->message, ' ');
}

static bool render(const ca_scene *scene, const char *text, long number, const char *integrator)
{
    ca_render_settings settings;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_image_layers *image;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = 2; /* variances, too */
    settings.threads = 1;
    settings.max_depth = 6;
    settings.has_max_depth = true;
    const double start = ca_clock_thread_seconds(); /* of a processor: others may want it, too */
    (void)alarm(30 * SECONDS_ALLOWED); /* ends the program where a render never does */
    const ca_status status = ca_render(scene, &settings, &image, &statistics, &error);
    (void)alarm(0);
    if (ca_clock_thread_seconds() - start > SECONDS_ALLOWED) complain(text, number, integrator, "takes for ever");
    char words[128];
    const char *disorder = status == CA_OK ? find_disorder(image, words) : NULL;
    if (status != CA_OK && !is_refusal(status, &error)) complain(text, number, integrator, error.message);
    if (status == CA_OK && statistics.non_finite > 0) complain(text, number, integrator, "samples were dropped");
    if (disorder) complain(text, number, integrator, disorder);
    ca_image_release(image);
    return status == CA_OK;
}

static long setting(const char *name, long fallback)
{
    const char *value = getenv(name);
    return value ? atol(value) : fallback;
}

static void degenerate_scenes_are_harmless(void **state)
{
    (void)state;
    static char text[TEXT_SIZE];
    writer w = {.text = text};
    const long first = setting("CA_DEGENERATE_FIRST", 0), count = setting("CA_DEGENERATE", DEGENERATE_SCENES);
    long loaded = 0, rendered[INTEGRATORS] = {0}, made = 0;
    for (long i = first; loaded < count; i++) {
        ca_scene *scene;
        ca_error error = {""};
        write_scene(&w, i);
        made++;
        const ca_scene_source source = {.text = text, .size = w.used, .path = "scene"};
        const ca_status status = ca_scene_parse(&source, &scene, &error);
        if (status != CA_OK && (!is_refusal(status, &error) || !begins(error.message, "scene:")))
            complain(text, i, "loading", error.message);
        if (status != CA_OK) continue;
        loaded++;
        for (int k = 0; k < INTEGRATORS; k++) rendered[k] += render(scene, text, i, integrators[k]);
        ca_scene_release(scene);
        if (loaded % 200 == 0) print_message("# %ld scenes\n", loaded);
    }
    print_message("# %ld scenes of %ld that were written were accepted\n", loaded, made);
    for (int k = 0; k < INTEGRATORS; k++) {
        print_message("# %s rendered %ld\n", integrators[k], rendered[k]);
        assert_true(10 * rendered[k] > 9 * loaded); /* refusals are exceptions */
    }
    assert_int_equal(defects, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(degenerate_scenes_are_harmless)};
    return cmocka_run_group_tests(tests, write_mesh, remove_mesh);
}
