/* Emitters. Result of each: ca_light_desc. */
#include "import/importer.h"

#include <string.h>

static ca_matrix rigid_transform(ca_props *props)
{
    ca_matrix m = ca_props_transform(props, "to_world");
    if (!ca_import_make_rigid(&m)) ca_props_fail(props, "to_world", "can only move and rotate");
    return m;
}

/* Do a texture's own coordinates say where all of it is looked up? Parts of the others are where the surface says. */
static bool moves_whole(const ca_scene_desc *desc, const ca_texture *t)
{
    const ca_texture *all = desc->textures.items;
    if (t->kind == CA_TEXTURE_CHECKERBOARD)
        return all[t->as.checkerboard.color0].kind == CA_TEXTURE_CONSTANT &&
               all[t->as.checkerboard.color1].kind == CA_TEXTURE_CONSTANT;
    return t->kind == CA_TEXTURE_BITMAP || (t->kind == CA_TEXTURE_SCALE && !t->as.scale.varies);
}

/* The texture with v the other way round, as a texture of its own. */
static ca_texture upside_down(const ca_scene_desc *desc, ca_texture_id id)
{
    ca_texture turned = desc->textures.items[id];
    if (!moves_whole(desc, &turned))
        turned = (ca_texture){.kind = CA_TEXTURE_SCALE,
                              .to_uv = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                              .as.scale = {.child = id, .factor = {1.0f, 1.0f, 1.0f}}};
    for (int row = 0; row < 2; row++) {
        turned.to_uv[row][2] += turned.to_uv[row][1];
        turned.to_uv[row][1] = -turned.to_uv[row][1];
    }
    return turned;
}

/* A texture that a light throws: lights give it coordinates whose v runs upwards, Mitsuba's lights downwards. */
static ca_texture_id thrown_texture(ca_props *props, const char *name)
{
    const ca_texture_id id = ca_props_texture(props, name, 1.0f, CA_COLOR_EMISSION);
    if (id == CA_NONE) return CA_NONE;
    const ca_scene_desc *desc = props->importer->desc;
    if (desc->textures.items[id].kind == CA_TEXTURE_CONSTANT) return id;
    const ca_texture turned = upside_down(desc, id);
    return ca_import_add_texture(props->importer, &turned);
}

static void import_area(ca_props *props, void *result)
{
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_AREA;
    light->as.area.radiance = ca_props_texture(props, "radiance", 1.0f, CA_COLOR_EMISSION);
}

static void import_beam(ca_props *props, void *result)
{
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_BEAM;
    light->as.beam.exitance = ca_props_texture(props, "radiance", 1.0f, CA_COLOR_EMISSION);
}

static void import_point(ca_props *props, void *result)
{
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_POINT;
    light->as.point.intensity = ca_props_color(props, "intensity", ca_rgb_grey(1.0f), CA_COLOR_EMISSION);
    const ca_matrix to_world = ca_props_transform(props, "to_world");
    for (int i = 0; i < 3; i++) light->as.point.position[i] = to_world.m[i][3];
    const bool moved = ca_props_find(props, "to_world") != NULL;
    if (ca_props_point(props, "position", light->as.point.position) && moved)
        ca_props_fail(props, "position", "excludes to_world");
}

static void import_spot(ca_props *props, void *result)
{
    static const char *const falloffs[CA_FALLOFF_COUNT] = {"linear", "smooth", "quartic"};
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_SPOT;
    light->as.spot.intensity = ca_props_color(props, "intensity", ca_rgb_grey(1.0f), CA_COLOR_EMISSION);
    light->as.spot.to_world = rigid_transform(props);
    const bool textured = ca_props_find(props, "texture") != NULL;
    const double cutoff = ca_props_number_in(props, "cutoff_angle", 20.0, 1e-3, textured ? 89.9 : 180.0);
    light->as.spot.cutoff_degrees = cutoff;
    light->as.spot.beam_degrees = ca_props_number_in(props, "beam_width", 0.75 * cutoff, 0.0, cutoff);
    light->as.spot.falloff = (ca_spot_falloff)ca_props_choice(props, "falloff", falloffs, CA_COUNT(falloffs), 0);
    light->as.spot.texture = textured ? thrown_texture(props, "texture") : CA_NONE;
}

/* The light travels along +z of to_world, or along `direction`. */
static void import_directional(ca_props *props, void *result)
{
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_DIRECTIONAL;
    light->as.directional.irradiance = ca_props_color(props, "irradiance", ca_rgb_grey(1.0f), CA_COLOR_EMISSION);
    const ca_matrix to_world = ca_props_transform(props, "to_world");
    double *d = light->as.directional.direction;
    for (int i = 0; i < 3; i++) d[i] = to_world.m[i][2];
    const bool turned = ca_props_find(props, "to_world") != NULL;
    if (ca_props_point(props, "direction", d) && turned) ca_props_fail(props, "direction", "excludes to_world");
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (!(length > 1e-30) || !isfinite(length)) ca_props_fail(props, "direction", "must have a length over 0");
    for (int i = 0; i < 3; i++) d[i] /= length;
}

static void import_constant(ca_props *props, void *result)
{
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_CONSTANT;
    light->as.constant.radiance = ca_props_color(props, "radiance", ca_rgb_grey(1.0f), CA_COLOR_EMISSION);
}

static void import_envmap(ca_props *props, void *result)
{
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_ENVMAP;
    light->as.envmap.scale = ca_props_color(props, "scale", ca_rgb_grey(1.0f), CA_COLOR_EMISSION);
    ca_props_boolean(props, "mis_compensation", false);
    light->as.envmap.to_world = ca_props_transform(props, "to_world");
    if (!ca_import_make_similarity(&light->as.envmap.to_world))
        ca_props_fail(props, "to_world", "cannot shear or stretch");
    light->as.envmap.image = ca_import_picture(props, CA_ENCODING_SRGB);
    if (ca_import_good(props->importer))
        light->as.envmap.image =
            ca_import_without_negative(props->importer, light->as.envmap.image, true, &props->node->where);
}

/* Width over height of what is projected. */
static double picture_aspect(const ca_importer *importer, ca_texture_id id)
{
    const ca_texture *textures = importer->desc->textures.items, *texture = &textures[id];
    while (texture->kind == CA_TEXTURE_SCALE) texture = &textures[texture->as.scale.child];
    if (texture->kind != CA_TEXTURE_BITMAP) return 1.0;
    const ca_image *image = &importer->desc->images.items[texture->as.bitmap.image_index];
    return (double)image->width / (double)image->height;
}

static void import_projector(ca_props *props, void *result)
{
    ca_light_desc *light = result;
    light->kind = CA_LIGHT_PROJECTOR;
    light->as.projector.scale = ca_rgb_grey((float)ca_props_number_in(props, "scale", 1.0, 0.0, 1e30));
    light->as.projector.to_world = rigid_transform(props);
    light->as.projector.picture = thrown_texture(props, "irradiance");
    if (!ca_import_good(props->importer)) return;
    const double aspect = picture_aspect(props->importer, light->as.projector.picture);
    const ca_field_of_view view = ca_import_field_of_view(props);
    /* The aspect ratio is all that counts of the two sides. */
    const double side = 4096.0;
    const double width = aspect >= 1.0 ? side : side * aspect, height = aspect >= 1.0 ? side / aspect : side;
    light->as.projector.tan_half_x =
        ca_camera_tan_half_x(view.degrees, view.axis, (uint32_t)fmax(1.0, round(width)),
                             (uint32_t)fmax(1.0, round(height)));
    light->as.projector.tan_half_y = light->as.projector.tan_half_x / aspect;
}

static const ca_plugin plugins[] = {
    {"area", import_area},           {"point", import_point},
    {"spot", import_spot},           {"directional", import_directional},
    {"constant", import_constant},   {"envmap", import_envmap},
    {"projector", import_projector}, {"directionalarea", import_beam},
};

static uint32_t build(ca_importer *importer, ca_xml_node *node)
{
    const ca_plugin *plugin = ca_import_find_plugin(importer, node, plugins, CA_COUNT(plugins));
    if (!plugin) return CA_NONE;
    ca_light_desc light = {.where = node->where};
    ca_props props;
    ca_props_begin(&props, importer, node);
    if (ca_props_number_in(&props, "sampling_weight", 1.0, 0.0, 1e30) != 1.0)
        ca_import_note(importer, &node->where,
                       "sampling_weight has no effect: emitters are chosen by what they bring");
    plugin->import(&props, &light);
    ca_props_end(&props);
    if (!ca_import_good(importer)) return CA_NONE;
    if (!CA_TABLE_ADD(&importer->desc->lights)) {
        ca_import_fail_memory(importer, "emitters");
        return CA_NONE;
    }
    importer->desc->lights.items[importer->desc->lights.count - 1] = light;
    return (uint32_t)(importer->desc->lights.count - 1);
}

static bool is_area(const ca_xml_node *node)
{
    const char *type = ca_xml_attribute_value(node, "type");
    return strcmp(type, "area") == 0 || strcmp(type, "directionalarea") == 0;
}

uint32_t ca_import_light(ca_importer *importer, ca_xml_node *node)
{
    if (is_area(node) && ca_xml_attribute_value(node, "id")) {
        const size_t count = importer->desc->lights.count;
        build(importer, node); /* waits for shapes to refer to it; a mistake in it is a mistake */
        importer->desc->lights.count = count;
        return CA_NONE;
    }
    if (is_area(node)) {
        ca_import_fail(importer, &node->where, "%s stands inside the shape that emits",
                       ca_xml_attribute_value(node, "type"));
        return CA_NONE;
    }
    return build(importer, node);
}

void ca_import_note_idle_emitter(ca_importer *importer, const ca_xml_node *node)
{
    if (strcmp(node->tag, "emitter") == 0 && is_area(node) && node->progress != CA_NODE_DONE)
        ca_import_note(importer, &node->where, "emitter \"%s\" shines nowhere: no shape holds it or refers to it",
                       ca_xml_attribute_value(node, "id"));
}

/* Not made once like other objects: several shapes may refer to one emitter, and each then is a light of its own. */
uint32_t ca_import_area_light(ca_importer *importer, ca_xml_node *node)
{
    node->progress = CA_NODE_DONE; /* it shines */
    if (!is_area(node)) {
        ca_import_find_plugin(importer, node, plugins, CA_COUNT(plugins));
        ca_import_fail(importer, &node->where, "a shape can only hold an area or directionalarea emitter, not %s",
                       ca_xml_attribute_value(node, "type"));
        return CA_NONE;
    }
    return build(importer, node);
}
