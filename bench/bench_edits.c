/* What the next version of a scene costs: from handing over the edited text and arrays to the first pixel, beside what
 * that pixel takes alone, with a mesh of a million triangles in the world, and in a group of its own. Then what a mesh
 * in a group costs its rays. Prints a table; docs/library.md quotes it. */
#include "base/clock.h"
#include "base/memory.h"
#include "bench_support.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SIDE = 708, VERTICES = (SIDE + 1) * (SIDE + 1), TRIANGLES = 2 * SIDE * SIDE, RUNS = 9 };

static float positions[3 * VERTICES], others[3 * VERTICES];
static uint32_t indices[3 * TRIANGLES];
static const float dark[] = {0.2f}, bright[] = {0.8f};

typedef struct edit {
    const char *name;
    double camera, light, material, instance;
    const float *positions, *texture;
} edit;

static const edit unedited = {"nothing", 0.0, 1.0, 0.5, 0.0, positions, dark};

#define MESH                                                                                                        \
    "<shape type='mesh'><string name='data' value='waves'/><bsdf type='principled'>"                                \
    "<rgb name='base_color' value='%g, 0.5, 0.5'/></bsdf></shape>"

static const char start[] =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"
    "<lookat origin='%g, 1.2, -2.5' target='0, 0, 0' up='0, 1, 0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='256'/><integer name='height' value='256'/></film></sensor>"
    "<integrator type='path'/><emitter type='constant'/>"
    "<emitter type='point'><point name='position' value='1, 2, -3'/><rgb name='intensity' value='%g, 1, 1'/></emitter>"
    "<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/>"
    "<translate y='-0.5'/></transform><bsdf type='diffuse'><texture name='reflectance' type='bitmap'>"
    "<string name='data' value='picture'/></texture></bsdf></shape>";
static const char in_world[] = MESH "<shape type='shapegroup' id='g'><shape type='sphere'/></shape>"
    "<shape type='instance'><ref id='g'/><transform name='to_world'><scale value='0.2'/>"
    "<translate x='%g' y='0.5'/></transform></shape></scene>";
static const char in_group[] = "<shape type='shapegroup' id='g'>" MESH "</shape>"
    "<shape type='instance'><ref id='g'/><transform name='to_world'><translate x='%g'/></transform></shape></scene>";

static void make_waves(float *vertices, float height)
{
    for (int i = 0; i < VERTICES; i++) {
        const float x = 2.0f * (float)(i % (SIDE + 1)) / SIDE - 1.0f, z = 2.0f * (float)(i / (SIDE + 1)) / SIDE - 1.0f;
        vertices[3 * i] = x, vertices[3 * i + 2] = z;
        vertices[3 * i + 1] = height * sinf(9.0f * x) * cosf(11.0f * z);
    }
}

static void make_indices(void)
{
    for (uint32_t cell = 0; cell < SIDE * SIDE; cell++) {
        const uint32_t a = cell / SIDE * (SIDE + 1) + cell % SIDE, b = a + SIDE + 1;
        const uint32_t corners[] = {a, b, b + 1, a, b + 1, a + 1};
        memcpy(&indices[6 * (size_t)cell], corners, sizeof corners);
    }
}

static ca_scene *parse(const ca_scene *previous, const edit *e, const char *objects)
{
    char text[4096];
    const int used = snprintf(text, sizeof text, start, e->camera, e->light);
    snprintf(text + used, sizeof text - (size_t)used, objects, e->material, e->instance);
    const ca_mesh_data mesh = {.name = "waves",
                               .vertex_count = VERTICES,
                               .triangle_count = TRIANGLES,
                               .positions = e->positions,
                               .indices = indices};
    const ca_bitmap_data picture = {.name = "picture", .width = 1, .height = 1, .channels = 1, .pixels = e->texture};
    const ca_scene_source source = {.text = text,
                                    .size = strlen(text),
                                    .path = "edits",
                                    .meshes = &mesh,
                                    .mesh_count = 1,
                                    .bitmaps = &picture,
                                    .bitmap_count = 1,
                                    .previous = previous};
    ca_scene *scene;
    ca_error error;
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) bench_die("parsing", &error);
    return scene;
}

/* What it takes where nothing else runs. */
static double least(const double *values, int count)
{
    double found = values[0];
    for (int i = 1; i < count; i++) found = fmin(found, values[i]);
    return found;
}

/* Seconds of a render. */
static double rendered(const ca_scene *scene, uint32_t side, uint32_t samples)
{
    const ca_render_settings settings = {
        .width = side, .height = side, .samples_per_pixel = samples, .threads = 1, .integrator = "path"};
    ca_image_layers *image;
    ca_error error;
    const double begun = ca_clock_seconds();
    if (ca_render(scene, &settings, &image, NULL, &error) != CA_OK) bench_die("rendering", &error);
    ca_image_release(image);
    return ca_clock_seconds() - begun;
}

static void measure_edit(const edit *e, const char *objects, const char *where)
{
    double first[RUNS], pixel[RUNS];
    uint32_t builds = 0;
    ca_scene *scene = parse(NULL, &unedited, objects);
    for (int run = 0; run < RUNS; run++) {
        const double begun = ca_clock_seconds();
        ca_scene *edited = parse(scene, e, objects);
        (void)rendered(edited, 1, 1);
        first[run] = 1e3 * (ca_clock_seconds() - begun);
        pixel[run] = 1e3 * rendered(edited, 1, 1);
        builds = ca_scene_builds(edited);
        ca_scene_release(edited);
    }
    ca_scene_release(scene);
    printf("%-8s %-10s %8u %18.2f %12.2f\n", where, e->name, builds, least(first, RUNS),
           least(pixel, RUNS));
}

static void measure_first(const char *objects, const char *where)
{
    double first[RUNS];
    for (int run = 0; run < RUNS; run++) {
        const double begun = ca_clock_seconds();
        ca_scene *scene = parse(NULL, &unedited, objects);
        (void)rendered(scene, 1, 1);
        first[run] = 1e3 * (ca_clock_seconds() - begun);
        ca_scene_release(scene);
    }
    printf("%-8s %-10s %8s %18.2f\n", where, "(no edit)", "all", least(first, RUNS));
}

/* The same picture with the mesh as a shape of the world and in a group. */
static void measure_rays(void)
{
    double seconds[2][RUNS];
    ca_scene *scenes[] = {parse(NULL, &unedited, in_world), parse(NULL, &unedited, in_group)};
    for (int run = 0; run < RUNS; run++)
        for (int k = 0; k < 2; k++) seconds[k][run] = rendered(scenes[k], 256, 4);
    printf("256 x 256 pixels, 4 paths each: %.3f s with the mesh in the world, %.3f s in a group\n",
           least(seconds[0], RUNS), least(seconds[1], RUNS));
    for (int k = 0; k < 2; k++) ca_scene_release(scenes[k]);
}

int main(void)
{
    edit edits[7];
    for (int i = 0; i < 7; i++) edits[i] = unedited;
    edits[1].name = "camera", edits[1].camera = 0.5;
    edits[2].name = "light", edits[2].light = 2.0;
    edits[3].name = "material", edits[3].material = 0.7;
    edits[4].name = "texture", edits[4].texture = bright;
    edits[5].name = "instance", edits[5].instance = 0.2;
    edits[6].name = "mesh", edits[6].positions = others;
    make_waves(positions, 0.1f);
    make_waves(others, 0.15f);
    make_indices();
    printf("%-8s %-10s %8s %18s %12s\n", "mesh in", "edit", "builds", "first pixel, ms", "pixel, ms");
    measure_first(in_world, "world");
    for (int i = 0; i < 7; i++) measure_edit(&edits[i], in_world, "world");
    for (int i = 0; i < 7; i++) measure_edit(&edits[i], in_group, "group");
    measure_rays();
    return 0;
}
