/* Lights. Of version 4 a spectrum counts by its luminance of 1 times `scale`, and power and illuminance, which are
 * photometric there, are the light's in the same units: no factor of 683 lm/W comes in, as in pbrt itself. */
#include "import/pbrt/reader.h"

#include "base/text.h"

#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- Colours --------------------------------------------------------------------------------------------------- */

/* scale, a number or version 3's colour, and the film's exposure. */
static void read_factor(ca_pbrt *p, double factor[3])
{
    factor[0] = factor[1] = factor[2] = 1.0;
    ca_pbrt_color(p, "scale", CA_COLOR_EMISSION, factor);
    for (int i = 0; i < 3; i++) factor[i] *= p->exposure;
}

/* The colour of that name (white) times the factor. */
static void read_color(ca_pbrt *p, const char *name, double rgb[3])
{
    double factor[3];
    rgb[0] = rgb[1] = rgb[2] = 1.0;
    ca_pbrt_light_color(p, name, rgb);
    read_factor(p, factor);
    for (int i = 0; i < 3; i++) rgb[i] *= factor[i];
}

/* `has` is what a light of unit colour and intensity has of what the parameter says; a value of 0 or less counts as
 * none. */
static void normalize(ca_pbrt *p, const char *name, double has, double rgb[3])
{
    const double wanted = ca_pbrt_number(&p->params, name, -1.0);
    for (int i = 0; i < 3 && wanted > 0.0; i++) rgb[i] *= wanted / has;
}

static const char *const without_effect[] = {"nsamples", "samples", "shadowmap"};

static ca_xml_node *add_emitter(ca_pbrt *p, const char *type)
{
    return ca_tree_object(&p->tree, ca_tree_root(&p->tree), "emitter", type);
}

/* ---- Points and directions ------------------------------------------------------------------------------------- */

static void read_point(ca_pbrt *p)
{
    double rgb[3], from[3] = {0.0, 0.0, 0.0}, position[3];
    read_color(p, "I", rgb);
    normalize(p, "power", 4.0 * pi, rgb);
    ca_pbrt_point(&p->params, "from", from);
    ca_matrix_point(&p->state.ctm, from, position);
    ca_xml_node *emitter = add_emitter(p, "point");
    ca_tree_point(&p->tree, emitter, "position", position);
    ca_tree_rgb(&p->tree, emitter, "intensity", rgb);
}

/* from and to in the world; the way of the light, of length 1. */
static void read_way(ca_pbrt *p, double from[3], double way[3])
{
    double at[3] = {0.0, 0.0, 0.0}, to[3] = {0.0, 0.0, 1.0}, target[3], length2 = 0.0;
    ca_pbrt_point(&p->params, "from", at);
    ca_pbrt_point(&p->params, "to", to);
    ca_matrix_point(&p->state.ctm, at, from);
    ca_matrix_point(&p->state.ctm, to, target);
    for (int i = 0; i < 3; i++) {
        way[i] = target[i] - from[i];
        length2 += way[i] * way[i];
    }
    if (!(length2 > 1e-60) || !isfinite(length2)) ca_pbrt_fail(&p->params, "to", "must differ from \"from\"");
    for (int i = 0; i < 3; i++) way[i] /= sqrt(length2);
}

static void read_distant(ca_pbrt *p)
{
    double rgb[3], from[3], way[3];
    read_color(p, "L", rgb);
    normalize(p, "illuminance", 1.0, rgb);
    read_way(p, from, way);
    ca_xml_node *emitter = add_emitter(p, "directional");
    ca_tree_point(&p->tree, emitter, "direction", way);
    ca_tree_rgb(&p->tree, emitter, "irradiance", rgb);
}

/* A rigid map whose z axis is the way. */
static ca_matrix map_along(const double from[3], const double way[3])
{
    ca_matrix map;
    double target[3], up[3] = {0.0, 0.0, 0.0};
    int least = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(way[i]) < fabs(way[least])) least = i;
    up[least] = 1.0;
    for (int i = 0; i < 3; i++) target[i] = from[i] + way[i];
    if (!ca_matrix_look_at(from, target, up, &map)) map = ca_matrix_identity();
    for (int i = 0; i < 3; i++) map.m[i][2] = way[i], map.m[i][3] = from[i];
    return map;
}

/* Between the two angles the intensity falls by a cubic in the cosine, in version 3 by its fourth power. The cone is
 * that of the space that the current transform leads to, as far as it keeps angles. */
static void read_spot(ca_pbrt *p)
{
    double rgb[3], from[3], way[3];
    const double cone = ca_pbrt_number_in(&p->params, "coneangle", 30.0, 1e-3, 180.0);
    const double delta = fmin(ca_pbrt_number_in(&p->params, "conedeltaangle", 5.0, 0.0, 180.0), cone);
    const double start = cos((cone - delta) * (pi / 180.0)), end = cos(cone * (pi / 180.0));
    read_color(p, "I", rgb);
    normalize(p, "power", 2.0 * pi * ((1.0 - start) + 0.5 * (start - end)), rgb);
    read_way(p, from, way);
    if (!ca_import_is_similarity(&p->state.ctm))
        ca_import_fail(p->importer, &p->params.where, "the transform of a spot light cannot stretch it");
    ca_xml_node *emitter = add_emitter(p, "spot");
    const ca_matrix map = map_along(from, way);
    ca_tree_transform(&p->tree, emitter, "to_world", &map);
    ca_tree_rgb(&p->tree, emitter, "intensity", rgb);
    ca_tree_float(&p->tree, emitter, "cutoff_angle", cone);
    ca_tree_float(&p->tree, emitter, "beam_width", cone - delta);
    ca_tree_string(&p->tree, emitter, "falloff", p->version == 3 ? "quartic" : "smooth");
}

/* ---- The sky --------------------------------------------------------------------------------------------------- */

static void read_infinite(ca_pbrt *p)
{
    static const char *const portals[] = {"portal"};
    double rgb[3];
    const char *name = ca_pbrt_find(&p->params, "mapname") ? "mapname" : "filename";
    const char *file = ca_pbrt_string(&p->params, name, "");
    read_color(p, "L", rgb);
    if (ca_pbrt_find(&p->params, portals[0]))
        ca_import_note(p->importer, &p->params.where, "portal has no effect: the sky shines from everywhere");
    if (file[0]) {
        ca_pbrt_read_sky(p, file, rgb);
        return;
    }
    normalize(p, "illuminance", pi, rgb);
    ca_tree_rgb(&p->tree, add_emitter(p, "constant"), "radiance", rgb);
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

typedef struct light_kind {
    const char *name;
    void (*read)(ca_pbrt *p);
} light_kind;

static const light_kind kinds[] = {
    {"point", read_point},
    {"distant", read_distant},
    {"spot", read_spot},
    {"infinite", read_infinite},
    {"exinfinite", read_infinite},
    {"projection", ca_pbrt_read_projection},
    {"goniometric", ca_pbrt_read_goniometric},
};

void ca_pbrt_read_light(ca_pbrt *p, const char *type)
{
    const char *nearest = NULL;
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    for (size_t i = 0; i < CA_COUNT(kinds); i++) {
        if (strcmp(kinds[i].name, type) == 0) {
            kinds[i].read(p);
            return;
        }
        nearest = ca_nearer_name(type, nearest, kinds[i].name);
    }
    ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known light; the nearest is \"%s\"", type,
                   nearest);
}

/* ---- Shapes that shine ----------------------------------------------------------------------------------------- */

/* The picture's id; its v is that of the shapes. */
static const char *add_picture(ca_pbrt *p, const char *file)
{
    const char *id = ca_pbrt_new_id(p, "picture", file);
    if (!id) return NULL;
    ca_xml_node *texture = ca_pbrt_add_bitmap(p, ca_tree_root(&p->tree), NULL, file, false);
    ca_tree_set(&p->tree, texture, "id", id);
    p->has_pictures = true;
    return id;
}

void ca_pbrt_read_area_light(ca_pbrt *p, const char *type)
{
    if (strcmp(type, "diffuse") != 0 && strcmp(type, "area") != 0) {
        ca_import_fail(p->importer, &p->params.where, "\"%s\" is not a known area light; the nearest is \"diffuse\"",
                       type);
        return;
    }
    ca_pbrt_area_light light = {.shines = true, .where = p->params.where};
    const char *file = ca_pbrt_string(&p->params, "filename", "");
    read_color(p, "L", light.radiance);
    light.two_sided = ca_pbrt_boolean(&p->params, "twosided", false);
    light.power = fmax(0.0, ca_pbrt_number(&p->params, "power", 0.0));
    if (file[0] && light.power > 0.0) ca_pbrt_fail(&p->params, "power", "of a light with a picture is not supported");
    if (file[0]) light.picture = add_picture(p, file);
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    p->state.light = light;
}
