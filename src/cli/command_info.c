/* caustica info: what was understood of a scene. */
#include "base/memory.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/say.h"
#include "cli/shared_options.h"
#include "geometry/curve.h"
#include "geometry/sdf_grid.h"
#include "render/render.h"

#include <stdio.h>

typedef struct info_options {
    ca_text_list define_words;
    uint32_t sensor;
    const char *camera;
    bool help;
} info_options;

#define AT(field) .offset = offsetof(info_options, field)

static const ca_option options[] = {
    CA_DEFINE_OPTION(AT(define_words)),
    CA_SENSOR_OPTION(AT(sensor)),
    CA_CAMERA_OPTION(AT(camera)),
    CA_HELP_OPTION(AT(help)),
};
static const ca_option_table table = {"info", options, sizeof options / sizeof options[0]};

static int print_help(void)
{
    printf("caustica info SCENE [options]: say what was understood of a scene\n\n");
    ca_options_print(&table, stdout);
    printf("\nExample: caustica info scenes/textured/textured.xml\n");
    return CA_EXIT_DONE;
}

/* ---- Counting things by kind ----------------------------------------------------------------------------------- */

static const char *const shape_names[] = {[CA_SHAPE_MESH] = "mesh",
                                          [CA_SHAPE_SPHERE] = "sphere",
                                          [CA_SHAPE_DISK] = "disk",
                                          [CA_SHAPE_CYLINDER] = "cylinder",
                                          [CA_SHAPE_CURVE] = "curve",
                                          [CA_SHAPE_SDF_GRID] = "sdfgrid"};
static const char *const light_names[] = {
    [CA_LIGHT_AREA] = "area",           [CA_LIGHT_POINT] = "point",         [CA_LIGHT_SPOT] = "spot",
    [CA_LIGHT_DIRECTIONAL] = "directional", [CA_LIGHT_PROJECTOR] = "projector", [CA_LIGHT_CONSTANT] = "constant",
    [CA_LIGHT_ENVMAP] = "envmap",       [CA_LIGHT_BEAM] = "directionalarea"};
static const char *const texture_names[] = {[CA_TEXTURE_CONSTANT] = "constant",
                                            [CA_TEXTURE_BITMAP] = "bitmap",
                                            [CA_TEXTURE_CHECKERBOARD] = "checkerboard",
                                            [CA_TEXTURE_MESH_ATTRIBUTE] = "mesh_attribute",
                                            [CA_TEXTURE_SCALE] = "scale",
                                            [CA_TEXTURE_MIX] = "mix",
                                            [CA_TEXTURE_POWER] = "power",
                                            [CA_TEXTURE_CLAMP] = "clamp",
                                            [CA_TEXTURE_MAPPED] = "mapped",
                                            [CA_TEXTURE_FACING] = "facing"};
static const char *const camera_names[] = {[CA_CAMERA_PERSPECTIVE] = "perspective",
                                           [CA_CAMERA_THIN_LENS] = "thinlens",
                                           [CA_CAMERA_ORTHOGRAPHIC] = "orthographic",
                                           [CA_CAMERA_REALISTIC] = "realistic",
                                           [CA_CAMERA_PANELS] = "batch"};

enum { MOST_KINDS = 32 };
#define COUNT_OF(names) (sizeof(names) / sizeof(names)[0])
_Static_assert(COUNT_OF(shape_names) == CA_SHAPE_KIND_COUNT, "every kind of shape has a name");
_Static_assert(COUNT_OF(light_names) == CA_LIGHT_KIND_COUNT, "every kind of light has a name");
_Static_assert(COUNT_OF(texture_names) == CA_TEXTURE_KIND_COUNT, "every kind of texture has a name");
_Static_assert(COUNT_OF(camera_names) == CA_CAMERA_KIND_COUNT, "every kind of camera has a name");
_Static_assert(COUNT_OF(ca_material_kind_names) <= MOST_KINDS, "counts fit");

/* "label     7: 4 mesh, 3 sphere" */
static void print_kinds(const char *label, const char *const *names, size_t kinds, const uint64_t counts[MOST_KINDS])
{
    uint64_t total = 0;
    for (size_t i = 0; i < kinds; i++) total += counts[i];
    printf("%-12s%llu", label, (unsigned long long)total);
    const char *separator = ": ";
    for (size_t i = 0; i < kinds; i++) {
        if (!counts[i]) continue;
        printf("%s%llu %s", separator, (unsigned long long)counts[i], names[i]);
        separator = ", ";
    }
    printf("\n");
}

/* ---- Sections -------------------------------------------------------------------------------------------------- */

static uint32_t triangle_count(const ca_shape *shape)
{
    return shape->kind == CA_SHAPE_MESH ? shape->as.mesh.mesh->triangle_count : 0;
}

static void print_shapes(const ca_scene *scene)
{
    uint64_t kinds[MOST_KINDS] = {0}, triangles = 0, seen = 0;
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        kinds[scene->shapes[i].kind]++;
        triangles += triangle_count(&scene->shapes[i]);
    }
    for (uint32_t i = 0; i < scene->instance_count; i++)
        for (uint32_t s = 0; s < scene->instances[i].shape_count; s++)
            seen += triangle_count(&scene->shapes[scene->instances[i].first_shape + s]);
    print_kinds("shapes", shape_names, COUNT_OF(shape_names), kinds);
    printf("%-12s%llu\n", "triangles", (unsigned long long)triangles);
    printf("%-12s%u", "instances", scene->instance_count);
    if (scene->instance_count)
        printf(" of %zu %s, showing %llu %s", scene->desc.groups.count,
               ca_noun((double)scene->desc.groups.count, "group", "groups"), (unsigned long long)seen,
               ca_noun((double)seen, "triangle", "triangles"));
    printf("\n");
}

static void print_lights(const ca_scene *scene)
{
    uint64_t kinds[MOST_KINDS] = {0};
    double power[MOST_KINDS] = {0.0};
    for (uint32_t i = 0; i < scene->light_count; i++) {
        kinds[scene->lights[i].kind]++;
        power[scene->lights[i].kind] += (double)scene->lights[i].power;
    }
    print_kinds("lights", light_names, COUNT_OF(light_names), kinds);
    for (size_t i = 0; i < COUNT_OF(light_names); i++)
        if (kinds[i]) printf("  %-17s%.6g W (luminance)\n", light_names[i], power[i]);
}

static void print_materials(const ca_scene *scene)
{
    uint64_t kinds[MOST_KINDS] = {0};
    for (uint32_t i = 0; i < scene->material_count; i++) kinds[scene->materials[i].kind]++;
    print_kinds("materials", ca_material_kind_names, CA_MATERIAL_KIND_COUNT, kinds);
}

/* Constants were written as parameters, not as textures: they are not counted. */
static void print_textures(const ca_scene *scene)
{
    uint64_t kinds[MOST_KINDS] = {0};
    for (size_t i = 0; i < scene->desc.textures.count; i++) kinds[scene->desc.textures.items[i].kind]++;
    kinds[CA_TEXTURE_CONSTANT] = 0;
    print_kinds("textures", texture_names, COUNT_OF(texture_names), kinds);
    for (size_t i = 0; i < scene->desc.images.count; i++) {
        const ca_image *image = &scene->desc.images.items[i];
        printf("  image       %u x %u, %u %s\n", image->width, image->height, image->channels,
               ca_noun(image->channels, "channel", "channels"));
    }
}

static void print_lens(const ca_realistic *camera)
{
    printf(", %u lens surfaces, focal length %.6g mm, film %.6g mm across, %.6g mm behind", camera->lens.count,
           ca_lens_focal_length(&camera->lens), camera->film_diagonal, camera->film_distance);
}

static void print_place(const ca_camera *camera)
{
    const float (*m)[4] = camera->map.to;
    printf("%-12sat (%.6g, %.6g, %.6g), looks along (%.6g, %.6g, %.6g)\n", "", (double)m[0][3], (double)m[1][3],
           (double)m[2][3], (double)m[0][2], (double)m[1][2], (double)m[2][2]);
}

static void print_camera(const ca_scene *scene)
{
    const ca_camera_desc *desc = &scene->desc.camera;
    const ca_camera *camera = &desc->camera;
    const ca_film_desc *film = &scene->desc.film;
    printf("%-12s%s", "camera", camera_names[camera->kind]);
    if (ca_camera_has_field_of_view(camera)) printf(", field of view %.6g degrees", desc->fov_degrees);
    if (camera->kind == CA_CAMERA_THIN_LENS)
        printf(", lens radius %.6g, focus at %.6g", (double)camera->as.thin_lens.lens_radius,
               (double)camera->as.thin_lens.focus_distance);
    if (camera->kind == CA_CAMERA_REALISTIC) print_lens(&camera->as.realistic);
    if (camera->kind == CA_CAMERA_PANELS) printf(" of %u sensors side by side", camera->as.panels.count);
    printf(", clips at %.6g and %.6g\n", (double)camera->near_clip, (double)camera->far_clip);
    if (camera->kind == CA_CAMERA_PANELS)
        for (uint32_t i = 0; i < camera->as.panels.count; i++) print_place(&camera->as.panels.cameras[i]);
    else
        print_place(camera);
    printf("%-12s%u x %u pixels", "film", film->width, film->height);
    if (film->crop_width != film->width || film->crop_height != film->height)
        printf(", crop %u,%u,%u,%u", film->crop_x, film->crop_y, film->crop_x + film->crop_width,
               film->crop_y + film->crop_height);
    printf(", %s filter\n", ca_filter_name(film->filter.kind));
}

static void print_parameter(const ca_parameter *parameter)
{
    ca_say(stdout, ", %s = ", parameter->name);
    switch (parameter->kind) {
    case CA_PARAMETER_NUMBER: printf("%.10g", parameter->number); break;
    case CA_PARAMETER_BOOLEAN: printf("%s", parameter->number != 0.0 ? "true" : "false"); break;
    case CA_PARAMETER_TEXT: ca_say(stdout, "%s", parameter->text); break;
    }
}

/* The sampler is that of a render: an integrator brings its own where the scene names none. */
static void print_method(const ca_scene *scene, const ca_render_plan *plan)
{
    const ca_integrator_desc *integrator = &scene->desc.integrator;
    ca_say(stdout, "%-12s%s", "integrator", integrator->name ? integrator->name : CA_DEFAULT_INTEGRATOR);
    for (size_t i = 0; i < integrator->parameters.count; i++) print_parameter(&integrator->parameters.items[i]);
    const uint32_t samples = scene->desc.samples_per_pixel;
    printf("\n%-12s%s, %u %s per pixel, seed %llu\n", "sampler", ca_sampler_name(plan->sampler.kind), samples,
           ca_noun(samples, "sample", "samples"), (unsigned long long)scene->desc.sampler.seed);
}

static void print_bytes(const char *label, size_t bytes)
{
    printf("  %-17s%.3f MiB\n", label, (double)bytes / 0x1p20);
}

static void print_bounds_and_memory(const ca_scene *scene)
{
    const ca_vec3 low = scene->low, high = scene->high;
    if (scene->shape_count)
        printf("%-12s(%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g)\n", "bounds", (double)low.x, (double)low.y,
               (double)low.z, (double)high.x, (double)high.y, (double)high.z);
    else
        printf("%-12snone: the scene has no shapes\n", "bounds");
    size_t mesh_bytes = 0, curve_bytes = 0, grid_bytes = 0, image_bytes = 0;
    for (size_t i = 0; i < scene->desc.meshes.count; i++) mesh_bytes += ca_mesh_bytes(&scene->desc.meshes.items[i]);
    for (size_t i = 0; i < scene->desc.curves.count; i++) curve_bytes += ca_curve_bytes(scene->desc.curves.items[i]);
    for (size_t i = 0; i < scene->desc.grids.count; i++)
        grid_bytes += ca_sdf_grid_bytes(scene->desc.grids.items[i]);
    for (size_t i = 0; i < scene->desc.images.count; i++) {
        const ca_image *image = &scene->desc.images.items[i];
        image_bytes += sizeof(float) * image->width * image->height * image->channels;
    }
    printf("memory\n");
    print_bytes("meshes", mesh_bytes);
    if (curve_bytes) print_bytes("curves", curve_bytes);
    if (grid_bytes) print_bytes("distances", grid_bytes);
    print_bytes("acceleration", ca_accel_bytes(scene->accel));
    print_bytes("textures", image_bytes);
}

static void print_scene(const char *path, const ca_scene *scene, const ca_render_plan *plan)
{
    ca_say(stdout, "%s\n", path);
    print_shapes(scene);
    print_lights(scene);
    print_materials(scene);
    print_textures(scene);
    print_camera(scene);
    print_method(scene, plan);
    print_bounds_and_memory(scene);
}

/* What `caustica render` would refuse is refused. One thread: an integrator keeps memory for each. */
static ca_status check_and_print(const char *path, const ca_scene *scene, ca_error *error)
{
    ca_render_settings settings;
    ca_render_plan plan;
    ca_render_settings_init(&settings);
    settings.threads = 1;
    CA_TRY(ca_render_check(scene, &settings, error));
    CA_TRY(ca_render_plan_make(&plan, scene, &settings, error));
    print_scene(path, scene, &plan);
    return CA_OK;
}

static ca_status load_and_print(const info_options *o, const ca_text_list *operands, ca_error *error)
{
    const char *path;
    ca_scene *scene;
    CA_TRY(ca_options_scene_operand(operands, &path, error));
    CA_TRY(ca_options_load_sensor(path, &o->define_words, o->sensor, o->camera, true, &scene, error));
    const ca_status status = check_and_print(path, scene, error);
    ca_scene_release(scene);
    return status;
}

int ca_command_info(int word_count, char *const words[])
{
    if (ca_help_wanted(word_count, words)) return print_help();
    info_options o = {0};
    ca_text_list operands = {0};
    ca_error error = {""};
    ca_status status = ca_options_parse(&table, word_count, words, &o, &operands, &error);
    if (status == CA_OK) status = load_and_print(&o, &operands, &error);
    ca_text_list_destroy(&o.define_words);
    ca_text_list_destroy(&operands);
    return status == CA_OK ? CA_EXIT_DONE : ca_report("info", status, &error);
}
