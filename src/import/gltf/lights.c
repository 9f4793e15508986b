/* Cameras and lights of nodes, and those of files that have none. One candela is read as one W/sr, one lux as one
 * W/m^2, one nit as one W/(m^2 sr): with emission in nits the whole picture is in photometric units. */
#include "import/gltf/reader.h"

#include <math.h>
#include <string.h>

#define DEGREES (180.0 / 3.14159265358979323846)

enum { PICTURE_WIDTH = 768, PICTURE_HEIGHT = 576 };

bool ca_gltf_turned(const ca_matrix *to_world, ca_matrix *turned)
{
    double axis[3][3]; /* x, y, z of the node */
    for (int k = 1; k < 3; k++) {
        double length2 = 0.0;
        for (int i = 0; i < 3; i++) length2 += to_world->m[i][k] * to_world->m[i][k];
        if (!(length2 > 0.0) || !isfinite(length2)) return false;
        for (int i = 0; i < 3; i++) axis[k][i] = to_world->m[i][k] / sqrt(length2);
    }
    /* z is what is looked along; y is made perpendicular to it. */
    double along = 0.0, length2 = 0.0;
    for (int i = 0; i < 3; i++) along += axis[1][i] * axis[2][i];
    for (int i = 0; i < 3; i++) {
        axis[1][i] -= along * axis[2][i];
        length2 += axis[1][i] * axis[1][i];
    }
    if (!(length2 > 1e-20)) return false;
    for (int i = 0; i < 3; i++) axis[1][i] /= sqrt(length2);
    for (int i = 0; i < 3; i++)
        axis[0][i] = axis[1][(i + 1) % 3] * axis[2][(i + 2) % 3] - axis[1][(i + 2) % 3] * axis[2][(i + 1) % 3];
    *turned = ca_matrix_identity();
    for (int i = 0; i < 3; i++) {
        turned->m[i][0] = -axis[0][i];
        turned->m[i][1] = axis[1][i];
        turned->m[i][2] = -axis[2][i];
        turned->m[i][3] = to_world->m[i][3];
    }
    return true;
}

/* ---- Lights ---------------------------------------------------------------------------------------------------- */

/* color times intensity. */
static void read_intensity(ca_gltf *g, const ca_gltf_value *light, double rgb[3])
{
    const double intensity = ca_gltf_number(g, light, "intensity", 1.0, 0.0, 1e30);
    for (int i = 0; i < 3; i++) rgb[i] = 1.0;
    ca_gltf_numbers(g, light, "color", rgb, 3);
    for (int i = 0; i < 3; i++) {
        if (!(rgb[i] >= 0.0 && rgb[i] <= 1e6)) ca_gltf_fail(g, light, "color must not be below 0");
        rgb[i] *= intensity;
    }
}

static void put_point(ca_gltf *g, const double rgb[3], const ca_matrix *to_world)
{
    const double position[3] = {to_world->m[0][3], to_world->m[1][3], to_world->m[2][3]};
    ca_xml_node *emitter = ca_tree_object(&g->tree, ca_tree_root(&g->tree), "emitter", "point");
    ca_tree_rgb(&g->tree, emitter, "intensity", rgb);
    ca_tree_point(&g->tree, emitter, "position", position);
}

static void put_spot(ca_gltf *g, const ca_gltf_value *light, const double rgb[3], const ca_matrix *turned)
{
    const ca_gltf_value *spot = ca_gltf_object(g, light, "spot");
    const double outer = ca_gltf_number(g, spot, "outerConeAngle", 45.0 / DEGREES, 1e-4, 1.5707964);
    const double inner = ca_gltf_number(g, spot, "innerConeAngle", 0.0, 0.0, outer);
    ca_xml_node *emitter = ca_tree_object(&g->tree, ca_tree_root(&g->tree), "emitter", "spot");
    ca_tree_rgb(&g->tree, emitter, "intensity", rgb);
    ca_tree_float(&g->tree, emitter, "cutoff_angle", DEGREES * outer);
    ca_tree_float(&g->tree, emitter, "beam_width", fmin(DEGREES * inner, DEGREES * outer));
    ca_tree_transform(&g->tree, emitter, "to_world", turned);
}

static void put_sun(ca_gltf *g, const double rgb[3], const ca_matrix *turned)
{
    ca_xml_node *emitter = ca_tree_object(&g->tree, ca_tree_root(&g->tree), "emitter", "directional");
    ca_tree_rgb(&g->tree, emitter, "irradiance", rgb);
    ca_tree_transform(&g->tree, emitter, "to_world", turned);
}

/* The element of the lights that the node's extension counts. */
static const ca_gltf_value *light_of(ca_gltf *g, const ca_gltf_value *extension)
{
    const ca_gltf_value *all = ca_gltf_array(g, ca_gltf_extension(g, g->root, "KHR_lights_punctual"), "lights");
    const uint64_t index = ca_gltf_count(g, extension, "light", UINT64_MAX);
    if (all && index < all->count) return all->items[index];
    ca_gltf_fail(g, extension, "counts no light of the %u that there are", all ? all->count : 0);
    return NULL;
}

void ca_gltf_add_light(ca_gltf *g, const ca_gltf_value *node, const ca_matrix *to_world)
{
    const ca_gltf_value *extension = ca_gltf_extension(g, node, "KHR_lights_punctual");
    const ca_gltf_value *light = extension ? light_of(g, extension) : NULL;
    double rgb[3];
    ca_matrix turned = ca_matrix_identity();
    if (!light) return;
    const char *type = ca_gltf_text(g, light, "type", "");
    read_intensity(g, light, rgb);
    ca_gltf_at(g, node);
    if (ca_gltf_member(g, light, "range"))
        ca_gltf_note(g, light, "the range of a light is not read: it reaches everywhere");
    g->lit = true;
    if (strcmp(type, "point") == 0) {
        put_point(g, rgb, to_world);
        return;
    }
    if (!ca_gltf_turned(to_world, &turned)) ca_gltf_fail(g, node, "its matrix leaves its light no direction");
    if (strcmp(type, "spot") == 0)
        put_spot(g, light, rgb, &turned);
    else if (strcmp(type, "directional") == 0)
        put_sun(g, rgb, &turned);
    else
        ca_gltf_fail(g, light, "type \"%.20s\" is not point, spot or directional", type);
}

/* ---- Cameras --------------------------------------------------------------------------------------------------- */

static void put_film(ca_gltf *g, ca_xml_node *sensor, double aspect)
{
    const double height = fmin(fmax(round(PICTURE_WIDTH / aspect), 1.0), 65536.0);
    ca_xml_node *film = ca_tree_object(&g->tree, sensor, "film", "hdrfilm");
    ca_tree_integer(&g->tree, film, "width", PICTURE_WIDTH);
    ca_tree_integer(&g->tree, film, "height", (int64_t)height);
}

/* The specification has no default for it. */
static void check_needed(ca_gltf *g, const ca_gltf_value *lens, const char *key)
{
    if (lens && !ca_gltf_member(g, lens, key)) ca_gltf_fail(g, lens, "has no %s", key);
}

static double put_perspective(ca_gltf *g, const ca_gltf_value *camera, ca_xml_node *sensor)
{
    const ca_gltf_value *lens = ca_gltf_object(g, camera, "perspective");
    if (!lens) ca_gltf_fail(g, camera, "has no perspective");
    check_needed(g, lens, "yfov");
    ca_tree_float(&g->tree, sensor, "fov", DEGREES * ca_gltf_number(g, lens, "yfov", 0.8, 1e-5, 3.1398));
    ca_tree_string(&g->tree, sensor, "fov_axis", "y");
    const double near = ca_gltf_number(g, lens, "znear", 0.01, 1e-30, 1e30);
    const double far = ca_gltf_number(g, lens, "zfar", fmax(1e10, 1e6 * near), 1e-30, 1e37);
    ca_tree_float(&g->tree, sensor, "near_clip", near);
    ca_tree_float(&g->tree, sensor, "far_clip", far);
    return ca_gltf_number(g, lens, "aspectRatio", (double)PICTURE_WIDTH / PICTURE_HEIGHT, 1e-2, 1e3);
}

/* The picture is 2 xmag wide and 2 ymag high; here it is 2 wide, times the scale of the map. */
static double put_orthographic(ca_gltf *g, const ca_gltf_value *camera, ca_xml_node *sensor, ca_matrix *map)
{
    const ca_gltf_value *lens = ca_gltf_object(g, camera, "orthographic");
    if (!lens) ca_gltf_fail(g, camera, "has no orthographic");
    check_needed(g, lens, "xmag");
    check_needed(g, lens, "ymag");
    const double x = ca_gltf_number(g, lens, "xmag", 1.0, 1e-20, 1e20);
    const double y = ca_gltf_number(g, lens, "ymag", 1.0, 1e-20, 1e20);
    const double near = ca_gltf_number(g, lens, "znear", 0.01, 0.0, 1e30);
    ca_tree_float(&g->tree, sensor, "near_clip", fmax(near, 1e-6));
    ca_tree_float(&g->tree, sensor, "far_clip", ca_gltf_number(g, lens, "zfar", fmax(1e10, 1e6 * near), 1e-30, 1e37));
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++) map->m[i][k] *= x;
    return fmin(fmax(x / y, 1e-2), 1e3);
}

/* The node's name, or the camera's; made unlike those before where they have it too, or are many. */
static const char *camera_id(ca_gltf *g, const ca_gltf_value *node, const ca_gltf_value *camera)
{
    const char *name = ca_gltf_text(g, node, "name", ca_gltf_text(g, camera, "name", ""));
    const ca_xml_node *child = ca_tree_root(&g->tree)->first_child;
    enum { FEW = 64 };
    bool taken = ++g->camera_count > FEW;
    if (!name[0]) return NULL;
    for (; child && !taken; child = child->next) {
        const char *id = strcmp(child->tag, "sensor") == 0 ? ca_xml_attribute_value(child, "id") : NULL;
        taken = id && strcmp(id, name) == 0;
    }
    return taken ? ca_gltf_format(g, "%.150s (node %u)", name, node->index) : name;
}

void ca_gltf_add_camera(ca_gltf *g, const ca_gltf_value *node, const ca_matrix *to_world)
{
    const ca_gltf_value *camera = ca_gltf_reference(g, node, "camera", "cameras");
    ca_matrix turned;
    if (!camera) return;
    ca_gltf_at(g, node);
    if (!ca_gltf_turned(to_world, &turned)) {
        ca_gltf_fail(g, node, "its matrix leaves its camera no direction");
        return;
    }
    const char *type = ca_gltf_text(g, camera, "type", "");
    const bool flat = strcmp(type, "orthographic") == 0;
    if (!flat && strcmp(type, "perspective") != 0) {
        ca_gltf_fail(g, camera, "type \"%.60s\" is not perspective or orthographic", type);
        return;
    }
    ca_xml_node *sensor =
        ca_tree_named_object(&g->tree, ca_tree_root(&g->tree), "sensor", flat ? "orthographic" : "perspective", NULL,
                             camera_id(g, node, camera));
    const double aspect = flat ? put_orthographic(g, camera, sensor, &turned) : put_perspective(g, camera, sensor);
    ca_tree_transform(&g->tree, sensor, "to_world", &turned);
    put_film(g, sensor, aspect);
}

/* ---- What is missing ------------------------------------------------------------------------------------------- */

/* From the front, the right and above, as far as the whole fits in. */
static void put_default_camera(ca_gltf *g)
{
    const double direction[3] = {0.36, 0.28, 0.89}, up[3] = {0.0, 1.0, 0.0};
    double center[3], origin[3], radius = 0.0;
    for (int i = 0; i < 3; i++) {
        const bool any = g->low[i] <= g->high[i];
        center[i] = any ? 0.5 * (g->low[i] + g->high[i]) : 0.0;
        radius += any ? pow(0.5 * (g->high[i] - g->low[i]), 2.0) : 1.0;
    }
    radius = fmin(fmax(sqrt(radius), 1e-6), 1e30);
    const double fov = 40.0, distance = 1.05 * radius / sin(0.5 * fov / DEGREES);
    ca_matrix map;
    for (int i = 0; i < 3; i++) origin[i] = center[i] + distance * direction[i];
    if (!ca_matrix_look_at(origin, center, up, &map)) {
        ca_gltf_fail(g, g->root, "there is no camera, and none can be made that sees everything");
        return;
    }
    ca_xml_node *sensor = ca_tree_object(&g->tree, ca_tree_root(&g->tree), "sensor", "perspective");
    ca_tree_float(&g->tree, sensor, "fov", fov);
    ca_tree_string(&g->tree, sensor, "fov_axis", "smaller");
    ca_tree_float(&g->tree, sensor, "near_clip", 1e-3 * distance);
    ca_tree_float(&g->tree, sensor, "far_clip", 1e3 * distance);
    ca_tree_transform(&g->tree, sensor, "to_world", &map);
    put_film(g, sensor, (double)PICTURE_WIDTH / PICTURE_HEIGHT);
    ca_gltf_note(g, NULL, "there is no camera in the scene: it is seen by one that sees everything");
}

void ca_gltf_add_defaults(ca_gltf *g, bool has_camera)
{
    ca_gltf_at(g, NULL);
    if (!has_camera) put_default_camera(g);
    if (g->lit) return;
    ca_xml_node *sky = ca_tree_object(&g->tree, ca_tree_root(&g->tree), "emitter", "constant");
    ca_tree_float(&g->tree, sky, "radiance", 1.0);
    ca_gltf_note(g, NULL, "there is no light in the scene: it stands under a white sky of radiance 1");
}
