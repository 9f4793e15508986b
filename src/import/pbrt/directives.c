/* The table of directives; those that hand over to the reader of an object or option, and those without effect. */
#include "import/pbrt/directives.h"

#include <string.h>

/* ---- Materials, objects ---------------------------------------------------------------------------------------- */

static void run_material(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_MATERIALS]);
    p->state.material = ca_pbrt_read_material(p, s[0], NULL, &p->state.is_interface);
}

static void run_make_material(ca_pbrt *p, const double *n, const char *const *s)
{
    bool is_interface = false;
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_MATERIALS]);
    const char *type = ca_pbrt_string(&p->params, "type", NULL);
    if (!type) {
        ca_pbrt_fail(&p->params, "type", "is missing");
        return;
    }
    const char *id = ca_pbrt_read_material(p, type, s[0], &is_interface);
    ca_pbrt_named *named = id ? ca_pbrt_define(p, &p->materials, s[0]) : NULL;
    if (!named) return;
    named->id = id;
    named->flag = is_interface;
}

static void run_named_material(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    const ca_pbrt_named *named = ca_pbrt_name(&p->materials, s[0]);
    if (!named) {
        ca_pbrt_fail_name(p, &p->params.where, "material", s[0], &p->materials);
        return;
    }
    p->state.material = named->id;
    p->state.is_interface = named->flag;
}

static void run_texture(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_TEXTURES]);
    ca_pbrt_read_texture(p, s[0], s[1], s[2]);
}

static void run_shape(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_SHAPES]);
    ca_pbrt_read_shape(p, s[0]);
}

static void run_light(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_LIGHTS]);
    ca_pbrt_read_light(p, s[0]);
}

static void run_area_light(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_params_preset(&p->params, p->state.presets[CA_PBRT_FOR_LIGHTS]);
    ca_pbrt_read_area_light(p, s[0]);
}

static void run_object_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    if (p->group) {
        ca_import_fail(p->importer, &p->params.where, "an object cannot hold another one");
        return;
    }
    ca_pbrt_open_state(p, CA_PBRT_OPEN_OBJECT);
    ca_pbrt_named *object = ca_pbrt_define(p, &p->objects, s[0]);
    if (!object) return;
    object->id = ca_pbrt_new_id(p, "object", s[0]);
    if (!object->id) return;
    p->group = ca_tree_named_object(&p->tree, NULL, "shape", "shapegroup", NULL, object->id);
    p->group_has_shapes = false;
}

static void run_object_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_close_state(p, CA_PBRT_OPEN_OBJECT);
    ca_pbrt_end_curves(p);
    if (!ca_import_good(p->importer) || !p->group) return;
    if (p->group_has_shapes) {
        const char *id = ca_xml_attribute_value(p->group, "id");
        ca_tree_append(&p->tree, ca_tree_root(&p->tree), p->group);
        for (size_t i = 0; i < p->objects.count; i++)
            if (strcmp(p->objects.items[i].id, id) == 0) p->objects.items[i].flag = true;
    }
    p->group = NULL;
}

static void run_instance(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    const ca_pbrt_named *object = ca_pbrt_name(&p->objects, s[0]);
    if (p->group)
        ca_import_fail(p->importer, &p->params.where, "an object cannot hold an instance");
    else if (!object)
        ca_pbrt_fail_name(p, &p->params.where, "object", s[0], &p->objects);
    if (!ca_import_good(p->importer) || !object || !object->flag) return;
    ca_xml_node *instance = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "shape", "instance");
    ca_tree_transform(&p->tree, instance, "to_world", &p->state.ctm);
    ca_tree_ref(&p->tree, instance, NULL, object->id);
}

/* ---- Options, and what has no effect --------------------------------------------------------------------------- */

static void run_camera(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_camera(p, s[0]);
    if (ca_import_good(p->importer)) ca_pbrt_define_system(p, "camera", &p->camera_to_world);
}

static void run_film(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_film(p, s[0]);
}

static void run_filter(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_filter(p, s[0]);
}

static void run_sampler(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_sampler(p, s[0]);
}

static void run_integrator(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n;
    ca_pbrt_read_integrator(p, s[0]);
}

/* How rays are found has no effect on the picture. */
static void ignore_all(ca_pbrt *p)
{
    for (size_t i = 0; i < p->params.list.count; i++) p->params.list.items[i].used = true;
}

static void run_accelerator(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ignore_all(p);
}

static void run_option(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ignore_all(p);
    ca_import_note(p->importer, &p->params.where, "Option has no effect");
}

static void run_world_begin(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_finish_options(p);
    p->in_world = true;
    p->state.start_is_active = true;
    p->state.ctm = ca_matrix_identity();
    ca_pbrt_define_system(p, "world", &p->state.ctm);
}

static void run_world_end(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    if (p->version != 3)
        ca_import_fail(p->importer, &p->params.where,
                       "WorldEnd belongs to version 3, and stands in the scene file itself there");
    p->ended = true;
}

void ca_pbrt_fail_medium(ca_pbrt *p)
{
    ca_import_fail(p->importer, &p->params.where, "%s: media are not supported", p->params.what);
}

static void run_medium(ca_pbrt *p, const double *n, const char *const *s)
{
    (void)n, (void)s;
    ca_pbrt_fail_medium(p);
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

const ca_pbrt_directive ca_pbrt_directives[CA_PBRT_DIRECTIVE_COUNT] = {
    {"Identity", CA_PBRT_ANYWHERE, 0, 0, false, ca_pbrt_run_identity},
    {"Translate", CA_PBRT_ANYWHERE, 3, 0, false, ca_pbrt_run_translate},
    {"Scale", CA_PBRT_ANYWHERE, 3, 0, false, ca_pbrt_run_scale},
    {"Rotate", CA_PBRT_ANYWHERE, 4, 0, false, ca_pbrt_run_rotate},
    {"LookAt", CA_PBRT_ANYWHERE, 9, 0, false, ca_pbrt_run_look_at},
    {"Transform", CA_PBRT_ANYWHERE, 16, 0, false, ca_pbrt_run_transform},
    {"ConcatTransform", CA_PBRT_ANYWHERE, 16, 0, false, ca_pbrt_run_concat},
    {"CoordinateSystem", CA_PBRT_ANYWHERE, 0, 1, false, ca_pbrt_run_coordinate_system},
    {"CoordSysTransform", CA_PBRT_ANYWHERE, 0, 1, false, ca_pbrt_run_coordinate_transform},
    {"TransformTimes", CA_PBRT_BEFORE_WORLD, 2, 0, false, ca_pbrt_run_transform_times},
    {"TransformBegin", CA_PBRT_ANYWHERE, 0, 0, false, ca_pbrt_run_transform_begin},
    {"TransformEnd", CA_PBRT_ANYWHERE, 0, 0, false, ca_pbrt_run_transform_end},
    {"AttributeBegin", CA_PBRT_ANYWHERE, 0, 0, false, ca_pbrt_run_attribute_begin},
    {"AttributeEnd", CA_PBRT_ANYWHERE, 0, 0, false, ca_pbrt_run_attribute_end},
    {"Attribute", CA_PBRT_ANYWHERE, 0, 1, true, ca_pbrt_run_attribute},
    {"ColorSpace", CA_PBRT_ANYWHERE, 0, 1, false, ca_pbrt_run_color_space},
    {"Option", CA_PBRT_BEFORE_WORLD, 0, 0, true, run_option},
    {"Camera", CA_PBRT_BEFORE_WORLD, 0, 1, true, run_camera},
    {"Film", CA_PBRT_BEFORE_WORLD, 0, 1, true, run_film},
    {"PixelFilter", CA_PBRT_BEFORE_WORLD, 0, 1, true, run_filter},
    {"Sampler", CA_PBRT_BEFORE_WORLD, 0, 1, true, run_sampler},
    {"Integrator", CA_PBRT_BEFORE_WORLD, 0, 1, true, run_integrator},
    {"SurfaceIntegrator", CA_PBRT_BEFORE_WORLD, 0, 1, true, run_integrator},
    {"Accelerator", CA_PBRT_BEFORE_WORLD, 0, 1, true, run_accelerator},
    {"WorldBegin", CA_PBRT_BEFORE_WORLD, 0, 0, false, run_world_begin},
    {"WorldEnd", CA_PBRT_IN_WORLD, 0, 0, false, run_world_end},
    {"ReverseOrientation", CA_PBRT_IN_WORLD, 0, 0, false, ca_pbrt_run_reverse},
    {"Material", CA_PBRT_IN_WORLD, 0, 1, true, run_material},
    {"MakeNamedMaterial", CA_PBRT_IN_WORLD, 0, 1, true, run_make_material},
    {"NamedMaterial", CA_PBRT_IN_WORLD, 0, 1, false, run_named_material},
    {"Texture", CA_PBRT_IN_WORLD, 0, 3, true, run_texture},
    {"Shape", CA_PBRT_IN_WORLD, 0, 1, true, run_shape},
    {"LightSource", CA_PBRT_IN_WORLD, 0, 1, true, run_light},
    {"AreaLightSource", CA_PBRT_IN_WORLD, 0, 1, true, run_area_light},
    {"ObjectBegin", CA_PBRT_IN_WORLD, 0, 1, false, run_object_begin},
    {"ObjectEnd", CA_PBRT_IN_WORLD, 0, 0, false, run_object_end},
    {"ObjectInstance", CA_PBRT_IN_WORLD, 0, 1, false, run_instance},
    {"MakeNamedMedium", CA_PBRT_ANYWHERE, 0, 1, true, run_medium},
};
