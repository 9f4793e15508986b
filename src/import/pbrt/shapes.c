/* Shapes: what all of them have, curves, and the table of kinds. */
#include "import/pbrt/shapes.h"

#include "base/text.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- What all shapes have -------------------------------------------------------------------------------------- */

/* The scene's default, made once. */
static const char *default_material(ca_pbrt *p)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    static const char id[] = "material";
    if (p->has_default_material) return id;
    p->has_default_material = true;
    ca_xml_node *sides = ca_tree_named_object(&p->tree, ca_tree_root(&p->tree), "bsdf", "twosided", NULL, id);
    ca_tree_rgb(&p->tree, ca_tree_object(&p->tree, sides, "bsdf", "diffuse"), "reflectance", half);
    return id;
}

/* alpha, a number or texture: what of the surface is there. */
static void put_material(ca_pbrt *p, ca_xml_node *shape)
{
    static const char *const without_effect[] = {"shadowalpha"};
    const char *id = p->state.material ? p->state.material : default_material(p);
    const ca_pbrt_value alpha = ca_pbrt_number_value(p, "alpha", 1.0);
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    if (ca_pbrt_is(&alpha, 1.0)) {
        ca_tree_ref(&p->tree, shape, NULL, id);
        return;
    }
    ca_xml_node *mask = ca_tree_object(&p->tree, shape, "bsdf", "mask");
    ca_pbrt_put_number(p, mask, "opacity", &alpha);
    ca_tree_ref(&p->tree, mask, NULL, id);
}

bool ca_pbrt_shines(const ca_pbrt *p)
{
    return p->state.light.shines && !(p->version == 4 && p->state.is_interface);
}

static void put_light(ca_pbrt *p, ca_xml_node *shape, double area)
{
    const ca_pbrt_area_light *light = &p->state.light;
    double radiance[3];
    if (light->shines && !ca_pbrt_shines(p))
        ca_import_note(p->importer, &light->where,
                       "area lights on surfaces of \"interface\" do not shine, as in pbrt");
    if (!ca_pbrt_shines(p)) return;
    if (p->group) {
        ca_import_note(p->importer, &light->where, "area lights in objects do not shine, as in pbrt");
        return;
    }
    const double scale = light->power > 0.0 ? light->power / (pi * area * (light->two_sided ? 2.0 : 1.0)) : 1.0;
    for (int i = 0; i < 3; i++) radiance[i] = light->radiance[i] * scale;
    ca_xml_node *emitter = ca_tree_object(&p->tree, shape, "emitter", "area");
    if (!light->picture) {
        ca_tree_rgb(&p->tree, emitter, "radiance", radiance);
        return;
    }
    ca_xml_node *texture = ca_tree_named_object(&p->tree, emitter, "texture", "scale", "radiance", NULL);
    ca_tree_rgb(&p->tree, texture, "scale", radiance);
    ca_tree_ref(&p->tree, texture, NULL, light->picture);
}

ca_xml_node *ca_pbrt_add_shape(ca_pbrt *p, const char *type, const ca_matrix *to_world, bool flips, double area)
{
    ca_xml_node *parent = p->group ? p->group : ca_tree_root(&p->tree);
    ca_xml_node *shape = ca_tree_object(&p->tree, parent, "shape", type);
    p->group_has_shapes = true;
    ca_tree_transform(&p->tree, shape, "to_world", to_world);
    if (flips) ca_tree_boolean(&p->tree, shape, "flip_normals", true);
    put_material(p, shape);
    put_light(p, shape, area);
    return shape;
}

bool ca_pbrt_is_two_sided(ca_pbrt *p)
{
    if (!ca_pbrt_shines(p) || !p->state.light.two_sided || p->group) return false;
    ca_import_note(p->importer, &p->state.light.where,
                   "a light with two sides is two surfaces, 1/50000 of its size apart");
    return true;
}

/* ---- Curves ---------------------------------------------------------------------------------------------------- */

/* Only a material without alpha may be another curve's, too. */
static void read_curve(ca_pbrt *p)
{
    const bool may_share = !ca_pbrt_find(&p->params, "alpha");
    const char *material = p->state.material ? p->state.material : default_material(p);
    if (ca_pbrt_shines(p) && !p->group)
        ca_import_fail(p->importer, &p->params.where, "curves cannot emit light");
    if (!may_share || !ca_pbrt_goes_on_with_curves(p, material)) {
        ca_pbrt_end_curves(p);
        ca_xml_node *parent = p->group ? p->group : ca_tree_root(&p->tree);
        ca_xml_node *shape = ca_tree_object(&p->tree, parent, "shape", "bsplinecurve");
        p->group_has_shapes = true;
        put_material(p, shape);
        ca_pbrt_begin_curves(p, shape, may_share ? material : NULL);
    }
    ca_pbrt_read_curve(p);
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

typedef struct shape_kind {
    const char *name;
    void (*read)(ca_pbrt *p);
} shape_kind;

static const shape_kind kinds[] = {
    {"trianglemesh", ca_pbrt_read_triangles},
    {"plymesh", ca_pbrt_read_ply},
    {"bilinearmesh", ca_pbrt_read_patches},
    {"loopsubdiv", ca_pbrt_read_subdivision},
    {"sphere", ca_pbrt_read_sphere},
    {"cylinder", ca_pbrt_read_cylinder},
    {"disk", ca_pbrt_read_disk},
    {"cone", ca_pbrt_read_cone},
    {"paraboloid", ca_pbrt_read_paraboloid},
    {"hyperboloid", ca_pbrt_read_hyperboloid},
    {"heightfield", ca_pbrt_read_heights},
    {"curve", read_curve},
};

static const char *const unsupported[] = {"nurbs"};

void ca_pbrt_read_shape(ca_pbrt *p, const char *type)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < CA_COUNT(kinds); i++) {
        if (strcmp(kinds[i].name, type) == 0) {
            kinds[i].read(p);
            return;
        }
        nearest = ca_nearer_name(type, nearest, kinds[i].name);
    }
    for (size_t i = 0; i < CA_COUNT(unsupported); i++)
        if (strcmp(unsupported[i], type) == 0)
            ca_import_fail(p->importer, &p->params.where, "shape \"%s\" is not supported", type);
    ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known shape; the nearest is \"%s\"", type,
                   nearest);
}
