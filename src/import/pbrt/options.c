/* What stands before WorldBegin: camera, film, filter, sampler and integrator. */
#include "import/pbrt/reader.h"

#include "base/text.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- Camera ---------------------------------------------------------------------------------------------------- */

static void read_screen(ca_pbrt *p)
{
    size_t count;
    const double *screen = ca_pbrt_array(&p->params, "screenwindow", CA_PBRT_FLOAT, 4, &count);
    p->frame_aspect = ca_pbrt_number_in(&p->params, "frameaspectratio", 0.0, 0.0, 1e6);
    p->has_screen = screen != NULL;
    if (!screen) return;
    memcpy(p->screen, screen, sizeof p->screen);
    if (count != 1 || !(screen[1] > screen[0]) || !(screen[3] > screen[2]))
        ca_pbrt_fail(&p->params, "screenwindow", "must be four numbers, x0 < x1 and y0 < y1");
}

static void read_perspective(ca_pbrt *p)
{
    p->camera = CA_PBRT_PERSPECTIVE;
    p->camera_fov = ca_pbrt_number_in(&p->params, "fov", 90.0, 1e-3, 179.9);
    if (ca_pbrt_find(&p->params, "halffov"))
        p->camera_fov = 2.0 * ca_pbrt_number_in(&p->params, "halffov", 45.0, 1e-3, 89.9);
    p->lens_radius = ca_pbrt_number_in(&p->params, "lensradius", 0.0, 0.0, 1e30);
    p->focal_distance = ca_pbrt_number_in(&p->params, "focaldistance", 1e6, 1e-30, 1e30);
    read_screen(p);
}

static void read_orthographic(ca_pbrt *p)
{
    p->camera = CA_PBRT_ORTHOGRAPHIC;
    if (ca_pbrt_number_in(&p->params, "lensradius", 0.0, 0.0, 1e30) != 0.0)
        ca_pbrt_fail(&p->params, "lensradius", "of an orthographic camera must be 0");
    ca_pbrt_number(&p->params, "focaldistance", 1e6);
    read_screen(p);
}

void ca_pbrt_read_camera(ca_pbrt *p, const char *type)
{
    static const char *const kinds[] = {"perspective", "orthographic", "realistic"};
    static void (*const reads[])(ca_pbrt * p) = {read_perspective, read_orthographic, ca_pbrt_read_lens_camera};
    static const char *const without_effect[] = {"shutteropen", "shutterclose"};
    p->camera_where = p->params.where;
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    if (!ca_matrix_invert(&p->state.ctm, &p->camera_to_world))
        ca_import_fail(p->importer, &p->params.where, "the camera's transform cannot be inverted");
    for (size_t i = 0; i < CA_COUNT(kinds); i++)
        if (strcmp(kinds[i], type) == 0) {
            reads[i](p);
            return;
        }
    if (strcmp(type, "spherical") == 0 || strcmp(type, "environment") == 0)
        ca_import_fail(p->importer, &p->params.where, "camera \"%s\" is not supported", type);
    ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known camera; the nearest is \"%s\"", type,
                   ca_nearest_name_however_far(type, kinds, CA_COUNT(kinds)));
}

/* ---- Film ------------------------------------------------------------------------------------------------------ */

static void put_crop(ca_pbrt *p, ca_xml_node *film, const int64_t bounds[4])
{
    if (bounds[1] <= bounds[0] || bounds[3] <= bounds[2]) {
        ca_import_fail(p->importer, &p->params.where, "%s: nothing is left of the cropped film", p->params.what);
        return;
    }
    ca_tree_integer(&p->tree, film, "crop_offset_x", bounds[0]);
    ca_tree_integer(&p->tree, film, "crop_offset_y", bounds[2]);
    ca_tree_integer(&p->tree, film, "crop_width", bounds[1] - bounds[0]);
    ca_tree_integer(&p->tree, film, "crop_height", bounds[3] - bounds[2]);
}

/* cropwindow, in fractions of the film, or pixelbounds: x0 x1 y0 y1. */
static void read_crop(ca_pbrt *p, ca_xml_node *film)
{
    size_t count;
    const double sides[4] = {p->film_width, p->film_width, p->film_height, p->film_height};
    int64_t bounds[4];
    const double *pixels = ca_pbrt_array(&p->params, "pixelbounds", CA_PBRT_INTEGER, 4, &count);
    if (pixels && count != 1) ca_pbrt_fail(&p->params, "pixelbounds", "must be four numbers");
    const double *window = ca_pbrt_array(&p->params, "cropwindow", CA_PBRT_FLOAT, 4, &count);
    if (window && count != 1) ca_pbrt_fail(&p->params, "cropwindow", "must be four numbers");
    if (!ca_import_good(p->importer) || (!window && !pixels)) return;
    for (int i = 0; i < 4; i++) {
        const int64_t limit = (int64_t)sides[i];
        bounds[i] = window ? (int64_t)ceil(fmin(fmax(window[i], 0.0), 1.0) * sides[i]) : (int64_t)pixels[i];
        bounds[i] = bounds[i] < 0 ? 0 : bounds[i] > limit ? limit : bounds[i];
    }
    put_crop(p, film, bounds);
}

/* exposuretime and iso scale the picture: all light is multiplied in their place. */
static void read_exposure(ca_pbrt *p)
{
    static const char *const without_effect[] = {"filename", "savefp16", "maxcomponentvalue", "maxsampleluminance",
                                                 "whitebalance"};
    const double seconds = ca_pbrt_number_in(&p->params, "exposuretime", 1.0, 0.0, 1e12);
    const double iso = ca_pbrt_number_in(&p->params, "iso", 100.0, 0.0, 1e12);
    const char *sensor = ca_pbrt_string(&p->params, "sensor", "cie1931");
    p->exposure = seconds * iso / 100.0 * ca_pbrt_number_in(&p->params, "scale", 1.0, 0.0, 1e12);
    if (strcmp(sensor, "cie1931") != 0)
        ca_import_note(p->importer, &p->params.where, "the film's sensor is always that of the CIE's observer");
    if (ca_pbrt_number(&p->params, "whitebalance", 0.0) != 0.0)
        ca_import_note(p->importer, &p->params.where, "the film's whitebalance has no effect");
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
}

void ca_pbrt_read_film(ca_pbrt *p, const char *type)
{
    static const char *const types[] = {"rgb", "gbuffer", "spectral", "image"};
    bool known = false;
    for (size_t i = 0; i < CA_COUNT(types); i++) known = known || strcmp(types[i], type) == 0;
    if (!known)
        ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known film; the nearest is \"%s\"", type,
                       ca_nearest_name_however_far(type, types, CA_COUNT(types)));
    p->film_width = (uint32_t)ca_pbrt_integer_in(&p->params, "xresolution", p->film_width, 1, CA_IMAGE_MAX_SIDE);
    p->film_height = (uint32_t)ca_pbrt_integer_in(&p->params, "yresolution", p->film_height, 1, CA_IMAGE_MAX_SIDE);
    p->film_diagonal = ca_pbrt_number_in(&p->params, "diagonal", 35.0, 1e-3, 1e5);
    p->film = ca_tree_object(&p->tree, NULL, "film", "hdrfilm");
    ca_tree_integer(&p->tree, p->film, "width", p->film_width);
    ca_tree_integer(&p->tree, p->film, "height", p->film_height);
    read_crop(p, p->film);
    read_exposure(p);
    if (strcmp(type, "spectral") == 0)
        ca_import_note(p->importer, &p->params.where, "film \"spectral\" is read as \"rgb\"");
    if (strcmp(type, "spectral") == 0 || strcmp(type, "gbuffer") == 0)
        for (size_t i = 0; i < p->params.list.count; i++) p->params.list.items[i].used = true;
}

/* ---- Filter ---------------------------------------------------------------------------------------------------- */

/* The half width along x, which is that along y. */
static double read_radius(ca_pbrt *p, double fallback)
{
    const bool old = ca_pbrt_find(&p->params, "xwidth") || ca_pbrt_find(&p->params, "ywidth");
    const char *x = old ? "xwidth" : "xradius", *y = old ? "ywidth" : "yradius";
    const double radius = ca_pbrt_number_in(&p->params, "radius", fallback, 1e-3, 64.0);
    const double across = ca_pbrt_number_in(&p->params, x, radius, 1e-3, 64.0);
    if (ca_pbrt_number_in(&p->params, y, radius, 1e-3, 64.0) != across)
        ca_import_note(p->importer, &p->params.where, "a filter is as high as it is wide");
    return across;
}

static void note_width(ca_pbrt *p, const char *name)
{
    ca_import_note(p->importer, &p->params.where, "a %s filter has the width that belongs to it", name);
}

/* Version 3's alpha is 1 / (2 sigma^2). */
static double read_sigma(ca_pbrt *p)
{
    const double sigma = ca_pbrt_number_in(&p->params, "sigma", 0.5, 1e-3, 16.0);
    const double alpha = ca_pbrt_number_in(&p->params, "alpha", 0.0, 0.0, 1e6);
    return alpha > 0.0 ? sqrt(0.5 / alpha) : sigma;
}

void ca_pbrt_read_filter(ca_pbrt *p, const char *type)
{
    static const char *const types[] = {"box", "triangle", "gaussian", "mitchell", "sinc"};
    static const char *const ours[] = {"box", "tent", "gaussian", "mitchell", "lanczos"};
    size_t kind = 0;
    while (kind < CA_COUNT(types) && strcmp(types[kind], type) != 0) kind++;
    if (kind == CA_COUNT(types)) {
        ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known filter; the nearest is \"%s\"", type,
                       ca_nearest_name_however_far(type, types, CA_COUNT(types)));
        return;
    }
    const double fallbacks[] = {0.5, 2.0, p->version == 3 ? 2.0 : 1.5, 2.0, 4.0};
    const double radius = read_radius(p, fallbacks[kind]);
    p->filter = ca_tree_object(&p->tree, NULL, "rfilter", ours[kind]);
    if (kind < 2) ca_tree_float(&p->tree, p->filter, "radius", radius);
    if (kind == 2) {
        ca_tree_float(&p->tree, p->filter, "stddev", read_sigma(p));
        note_width(p, "gaussian");
    }
    if (kind == 3) {
        ca_tree_float(&p->tree, p->filter, "B", ca_pbrt_number(&p->params, "B", 1.0 / 3.0));
        ca_tree_float(&p->tree, p->filter, "C", ca_pbrt_number(&p->params, "C", 1.0 / 3.0));
        if (radius != 2.0) note_width(p, "mitchell");
    }
    if (kind == 4) ca_tree_integer(&p->tree, p->filter, "lobes", (int64_t)fmin(32.0, fmax(1.0, rint(radius))));
    if (kind == 4) ca_pbrt_number(&p->params, "tau", 3.0);
}

/* ---- Sampler --------------------------------------------------------------------------------------------------- */

typedef struct named_sampler {
    const char *name, *ours;
    bool differs;
} named_sampler;

static const named_sampler samplers[] = {
    {"independent", "independent", false},
    {"random", "independent", false},
    {"halton", "halton", false},
    {"sobol", "sobol", false},
    {"paddedsobol", "sobol", true},
    {"zsobol", "zsobol", false},
    {"pmj02bn", "sobol", true},
    {"stratified", "sobol", true},
    {"02sequence", "sobol", true},
    {"lowdiscrepancy", "sobol", true},
    {"maxmindist", "sobol", true},
};

void ca_pbrt_read_sampler(ca_pbrt *p, const char *type)
{
    static const char *const without_effect[] = {"jitter", "dimensions", "randomization", "samplepixelcenter"};
    const char *names[CA_COUNT(samplers)];
    size_t kind = 0;
    for (size_t i = 0; i < CA_COUNT(samplers); i++) names[i] = samplers[i].name;
    while (kind < CA_COUNT(samplers) && strcmp(names[kind], type) != 0) kind++;
    if (kind == CA_COUNT(samplers)) {
        ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known sampler; the nearest is \"%s\"", type,
                       ca_nearest_name_however_far(type, names, CA_COUNT(names)));
        return;
    }
    int64_t samples = ca_pbrt_integer_in(&p->params, "pixelsamples", 16, 1, INT32_MAX);
    if (strcmp(type, "stratified") == 0)
        samples = ca_pbrt_integer_in(&p->params, "xsamples", 4, 1, 32768) *
                  ca_pbrt_integer_in(&p->params, "ysamples", 4, 1, 32768);
    if (samples > INT32_MAX) ca_pbrt_fail(&p->params, "xsamples", "times ysamples is too much");
    if (samplers[kind].differs)
        ca_import_note(p->importer, &p->params.where, "sampler \"%s\" is read as \"%s\"", samplers[kind].name,
                       samplers[kind].ours);
    p->sampler = ca_tree_object(&p->tree, NULL, "sampler", samplers[kind].ours);
    p->samples = samples;
    const int64_t seed = ca_pbrt_integer_in(&p->params, "seed", 0, 0, INT32_MAX);
    if (seed > 0) ca_tree_integer(&p->tree, p->sampler, "seed", seed);
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
}

/* ---- Integrator ------------------------------------------------------------------------------------------------ */

typedef struct named_integrator {
    const char *name, *ours;
    const char *note; /* NULL: the same method */
    int max_depth;    /* at most; 0: the scene's */
} named_integrator;

static const named_integrator integrators[] = {
    {"path", "path", NULL, 0},
    {"simplepath", "path", "with next event and weights", 0},
    {"volpath", "path", "there are no media", 0},
    {"simplevolpath", "path", "there are no media", 0},
    {"randomwalk", "path", "with next event and weights", 0},
    {"directlighting", "path", "paths of at most two segments, without chains of mirrors", 2},
    {"whitted", "path", "paths of at most two segments, without chains of mirrors", 2},
    {"bdpt", "bdpt", NULL, 0},
    {"mlt", "auto", "the same light, without Markov chains", 0},
    {"lightpath", "light", NULL, 0},
    {"sppm", "ppm", "its radius shrinks from pass to pass", 0},
};

static void put_sppm(ca_pbrt *p)
{
    const int64_t photons = ca_pbrt_integer_in(&p->params, "photonsperiteration", -1, -1, INT32_MAX);
    const double radius = ca_pbrt_number_in(&p->params, "radius", 1.0, 1e-12, 1e12);
    const char *passes = ca_pbrt_find(&p->params, "numiterations") ? "numiterations" : "iterations";
    /* Version 4 itself makes as many as the sampler has samples. */
    const int64_t iterations = ca_pbrt_integer_in(&p->params, passes, 64, 1, INT32_MAX);
    p->iterations = p->version == 3 || ca_pbrt_find(&p->params, passes) ? iterations : 0;
    if (photons > 0) ca_tree_integer(&p->tree, p->integrator, "light_paths", photons);
    ca_tree_float(&p->tree, p->integrator, "radius", radius);
}

/* pbrt counts bounces: a path of maxdepth of them has one segment more. */
static void put_integrator(ca_pbrt *p, const named_integrator *kind)
{
    const int64_t bounces = ca_pbrt_integer_in(&p->params, "maxdepth", 5, 0, 1 << 20);
    const int64_t segments = kind->max_depth > 0 && bounces + 1 > kind->max_depth ? kind->max_depth : bounces + 1;
    p->integrator = ca_tree_object(&p->tree, NULL, "integrator", kind->ours);
    ca_tree_integer(&p->tree, p->integrator, "max_depth", segments);
}

void ca_pbrt_read_integrator(ca_pbrt *p, const char *type)
{
    static const char *const without_effect[] = {"pixelbounds",
                                                 "rrthreshold",
                                                 "lightsampler",
                                                 "lightsamplestrategy",
                                                 "regularize",
                                                 "strategy",
                                                 "visualizestrategies",
                                                 "visualizeweights",
                                                 "samplelights",
                                                 "samplebsdf",
                                                 "imagewritefrequency",
                                                 "mutationsperpixel",
                                                 "bootstrapsamples",
                                                 "chains",
                                                 "largestepprobability",
                                                 "sigma",
                                                 "seed"};
    const char *names[CA_COUNT(integrators)];
    for (size_t i = 0; i < CA_COUNT(integrators); i++) {
        names[i] = integrators[i].name;
        if (strcmp(names[i], type) != 0) continue;
        const named_integrator *kind = &integrators[i];
        put_integrator(p, kind);
        p->iterations = 0;
        if (strcmp(type, "sppm") == 0) put_sppm(p);
        if (ca_pbrt_boolean(&p->params, "regularize", false))
            ca_import_note(p->importer, &p->params.where,
                           "regularize has no effect: surfaces stay as sharp as they are");
        if (kind->note)
            ca_import_note(p->importer, &p->params.where, "integrator \"%s\" is read as \"%s\": %s", kind->name,
                           kind->ours, kind->note);
        ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
        return;
    }
    if (strcmp(type, "ambientocclusion") == 0 || strcmp(type, "ao") == 0 || strcmp(type, "function") == 0)
        ca_import_fail(p->importer, &p->params.where, "integrator \"%s\" is not supported", type);
    ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known integrator; the nearest is \"%s\"", type,
                   ca_nearest_name_however_far(type, names, CA_COUNT(names)));
}

/* ---- The sensor ------------------------------------------------------------------------------------------------ */

/* The window of the camera's plane, 1 along the shorter side; its pixels must be square. */
static void find_screen(ca_pbrt *p)
{
    const double film = (double)p->film_width / p->film_height;
    const double aspect = p->frame_aspect > 0.0 ? p->frame_aspect : film;
    if (!p->has_screen) {
        p->screen[1] = fmax(1.0, aspect);
        p->screen[3] = fmax(1.0, 1.0 / aspect);
        p->screen[0] = -p->screen[1];
        p->screen[2] = -p->screen[3];
    }
    const double window = (p->screen[1] - p->screen[0]) / (p->screen[3] - p->screen[2]);
    if (!(fabs(window - film) <= 2e-3 * film))
        ca_import_fail(p->importer, &p->camera_where,
                       "the camera's window is not of the film's shape: pixels must be square");
}

double ca_pbrt_split_camera_map(ca_pbrt *p, ca_matrix *map)
{
    static const ca_matrix turn = {{{-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    const double scale = cbrt(fabs(ca_matrix_determinant3(&p->camera_to_world)));
    *map = ca_matrix_multiply(&p->camera_to_world, &turn);
    if (!ca_import_is_similarity(map) || !(scale > 0.0))
        ca_import_fail(p->importer, &p->camera_where, "the camera's transform cannot stretch it");
    for (int i = 0; i < 9; i++) map->m[i / 3][i % 3] /= scale;
    return scale;
}

static void put_perspective(ca_pbrt *p)
{
    ca_matrix map;
    const double scale = ca_pbrt_split_camera_map(p, &map), tangent = tan(0.5 * p->camera_fov * (pi / 180.0));
    const double width = p->screen[1] - p->screen[0], height = p->screen[3] - p->screen[2];
    const bool lens = p->lens_radius > 0.0;
    p->sensor = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "sensor", lens ? "thinlens" : "perspective");
    ca_tree_transform(&p->tree, p->sensor, "to_world", &map);
    ca_tree_float(&p->tree, p->sensor, "fov", 2.0 * atan(0.5 * width * tangent) * (180.0 / pi));
    ca_tree_string(&p->tree, p->sensor, "fov_axis", "x");
    const double x = 0.5 * (p->screen[0] + p->screen[1]) / width, y = 0.5 * (p->screen[2] + p->screen[3]) / height;
    if (x != 0.0) ca_tree_float(&p->tree, p->sensor, "principal_point_offset_x", x);
    if (y != 0.0) ca_tree_float(&p->tree, p->sensor, "principal_point_offset_y", -y);
    if (!lens) return;
    ca_tree_float(&p->tree, p->sensor, "aperture_radius", p->lens_radius * scale);
    ca_tree_float(&p->tree, p->sensor, "focus_distance", p->focal_distance * scale);
}

static void put_orthographic(ca_pbrt *p)
{
    static const ca_matrix turn = {{{-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    const double half = 0.5 * (p->screen[1] - p->screen[0]);
    const ca_matrix move =
        ca_matrix_translate(0.5 * (p->screen[0] + p->screen[1]), 0.5 * (p->screen[2] + p->screen[3]), 0.0);
    const ca_matrix size = ca_matrix_scale(half, half, 1.0);
    ca_matrix map = ca_matrix_multiply(&p->camera_to_world, &move);
    map = ca_matrix_multiply(&map, &size);
    map = ca_matrix_multiply(&map, &turn);
    p->sensor = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "sensor", "orthographic");
    ca_tree_transform(&p->tree, p->sensor, "to_world", &map);
}

/* Rays of pbrt begin at the camera itself. */
static void put_sensor(ca_pbrt *p)
{
    p->tree.where = p->camera_where.file ? p->camera_where : p->params.where;
    if (p->camera != CA_PBRT_REALISTIC) find_screen(p);
    if (!ca_import_good(p->importer)) return;
    switch (p->camera) {
    case CA_PBRT_PERSPECTIVE: put_perspective(p); break;
    case CA_PBRT_ORTHOGRAPHIC: put_orthographic(p); break;
    case CA_PBRT_REALISTIC: ca_pbrt_put_lens_camera(p); return;
    }
    ca_tree_float(&p->tree, p->sensor, "near_clip", 1e-4);
    ca_tree_float(&p->tree, p->sensor, "far_clip", 1e10);
}

/* The sampler of the file or of its version. Iterations of photons are samples, whichever directive stands first. */
static void put_sampler(ca_pbrt *p)
{
    const char *type = p->version == 3 || p->iterations > 0 ? "halton" : "zsobol";
    if (!p->sampler) p->sampler = ca_tree_object(&p->tree, NULL, "sampler", type);
    ca_tree_integer(&p->tree, p->sampler, "sample_count", p->iterations > 0 ? p->iterations : p->samples);
}

/* What the file leaves out has the default of its version. */
static void put_defaults(ca_pbrt *p)
{
    if (!p->film) {
        p->film = ca_tree_object(&p->tree, NULL, "film", "hdrfilm");
        ca_tree_integer(&p->tree, p->film, "width", p->film_width);
        ca_tree_integer(&p->tree, p->film, "height", p->film_height);
    }
    if (!p->filter && p->version == 3) p->filter = ca_tree_object(&p->tree, NULL, "rfilter", "box");
    if (!p->filter) p->filter = ca_tree_object(&p->tree, NULL, "rfilter", "gaussian");
    put_sampler(p);
    if (!p->integrator) {
        /* As a scene in XML; but to the depth of pbrt's own default, so that it is the same light. */
        p->integrator = ca_tree_object(&p->tree, NULL, "integrator", "auto");
        ca_tree_integer(&p->tree, p->integrator, "max_depth", 6);
    }
}

void ca_pbrt_finish_options(ca_pbrt *p)
{
    if (!p->camera_where.file) p->camera_fov = 90.0;
    put_sensor(p);
    put_defaults(p);
    if (!ca_import_good(p->importer)) return;
    ca_tree_append(&p->tree, p->film, p->filter);
    ca_tree_append(&p->tree, p->sensor, p->film);
    ca_tree_append(&p->tree, p->sensor, p->sampler);
    ca_tree_append(&p->tree, ca_tree_root(&p->tree), p->integrator);
}
