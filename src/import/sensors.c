/* Sensors with their film and sampler, and the field of view that projectors have too. Result of a sensor plugin:
 * ca_camera_desc, whose kind it sets. */
#include "import/importer.h"

#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "import/lens_table.h"
#include "import/number.h"

/* ---- Field of view --------------------------------------------------------------------------------------------- */

/* "50mm" or "50": a focal length for 35 mm film, whose picture is 36 mm x 24 mm; the field of view is its
 * diagonal's. */
static double focal_length_degrees(ca_props *props)
{
    const char *text = ca_props_string(props, "focal_length", "50mm");
    size_t length = strlen(text);
    if (length > 2 && strcmp(text + length - 2, "mm") == 0) length -= 2;
    double focal_length;
    if (!ca_parse_number(text, length, &focal_length) || !(focal_length >= 0.1) || !(focal_length <= 1e6)) {
        ca_props_fail(props, "focal_length", "must be a length like \"50mm\"");
        focal_length = 50.0;
    }
    return 2.0 * atan(sqrt(36.0 * 36.0 + 24.0 * 24.0) / (2.0 * focal_length)) * (180.0 / 3.14159265358979323846);
}

ca_field_of_view ca_import_field_of_view(ca_props *props)
{
    static const char *const axes[] = {"x", "y", "diagonal", "smaller", "larger"};
    static const ca_fov_axis values[] = {CA_FOV_X, CA_FOV_Y, CA_FOV_DIAGONAL, CA_FOV_SMALLER, CA_FOV_LARGER};
    if (!ca_props_find(props, "fov"))
        return (ca_field_of_view){.degrees = focal_length_degrees(props), .axis = CA_FOV_DIAGONAL};
    if (ca_props_find(props, "focal_length")) ca_props_fail(props, "focal_length", "excludes fov");
    return (ca_field_of_view){.degrees = ca_props_number_in(props, "fov", 45.0, 1e-4, 179.9),
                              .axis = values[ca_props_choice(props, "fov_axis", axes, CA_COUNT(axes), 0)]};
}

/* ---- Sensors --------------------------------------------------------------------------------------------------- */

static void set_map(ca_props *props, ca_camera_desc *sensor, bool rigid)
{
    ca_matrix to_world = ca_props_transform(props, "to_world");
    if (rigid && !ca_import_make_rigid(&to_world)) ca_props_fail(props, "to_world", "can only move and rotate");
    if (!ca_affine_from_matrix(&to_world, &sensor->camera.map))
        ca_props_fail(props, "to_world", "cannot be inverted");
}

/* Clip planes; the distance in focus, which only a lens of some size can have, is read from every sensor. */
static float import_distances(ca_props *props, ca_camera *camera)
{
    camera->near_clip = (float)ca_props_positive(props, "near_clip", 1e-2);
    camera->far_clip = (float)ca_props_positive(props, "far_clip", 1e4);
    if (!(camera->near_clip < camera->far_clip)) ca_props_fail(props, "near_clip", "must be less than far_clip");
    return (float)ca_props_positive(props, "focus_distance", (double)camera->far_clip);
}

/* What a pinhole and a lens have in common; the distance in focus. */
static float import_view(ca_props *props, ca_camera_desc *sensor)
{
    const ca_field_of_view view = ca_import_field_of_view(props);
    sensor->fov_degrees = view.degrees;
    sensor->fov_axis = view.axis;
    sensor->camera.principal_x = (float)ca_props_number_in(props, "principal_point_offset_x", 0.0, -100.0, 100.0);
    sensor->camera.principal_y = (float)ca_props_number_in(props, "principal_point_offset_y", 0.0, -100.0, 100.0);
    set_map(props, sensor, true);
    return import_distances(props, &sensor->camera);
}

static void import_perspective(ca_props *props, void *result)
{
    ca_camera_desc *sensor = result;
    sensor->camera.kind = CA_CAMERA_PERSPECTIVE;
    import_view(props, sensor);
}

static void import_thin_lens(ca_props *props, void *result)
{
    ca_camera_desc *sensor = result;
    sensor->camera.kind = CA_CAMERA_THIN_LENS;
    sensor->camera.as.thin_lens.focus_distance = import_view(props, sensor);
    if (!ca_props_find(props, "aperture_radius")) ca_props_fail(props, "aperture_radius", "is missing");
    sensor->camera.as.thin_lens.lens_radius = (float)ca_props_positive(props, "aperture_radius", 1.0);
}

static void import_orthographic(ca_props *props, void *result)
{
    ca_camera_desc *sensor = result;
    sensor->camera.kind = CA_CAMERA_ORTHOGRAPHIC;
    sensor->fov_degrees = 0.0;
    sensor->fov_axis = CA_FOV_X;
    set_map(props, sensor, false);
    import_distances(props, &sensor->camera);
}

/* ---- Radiance meter -------------------------------------------------------------------------------------------- */

/* From `origin` along `direction`, either of which stands for to_world. */
static void set_ray(ca_props *props, ca_camera_desc *sensor)
{
    double origin[3] = {0.0, 0.0, 0.0}, target[3] = {0.0, 0.0, 1.0};
    const bool has_origin = ca_props_point(props, "origin", origin);
    const bool has_direction = ca_props_point(props, "direction", target);
    ca_matrix to_world = ca_matrix_identity();
    if (!has_origin && !has_direction) {
        set_map(props, sensor, true);
        return;
    }
    if (ca_props_find(props, "to_world")) ca_props_fail(props, "to_world", "excludes origin and direction");
    const double x = fabs(target[0]), y = fabs(target[1]), z = fabs(target[2]);
    const double up[3] = {x <= y && x <= z, y < x && y <= z, z < x && z < y}; /* across */
    for (int i = 0; i < 3; i++) target[i] += origin[i];
    if (!ca_matrix_look_at(origin, target, up, &to_world) || !ca_affine_from_matrix(&to_world, &sensor->camera.map))
        ca_props_fail(props, "direction", "must have a length over 0");
}

/* One ray, but for the 2e-6 radians that a pixel needs to be a sensor of all methods. */
static void import_radiance_meter(ca_props *props, void *result)
{
    ca_camera_desc *sensor = result;
    sensor->camera.kind = CA_CAMERA_PERSPECTIVE;
    sensor->fov_degrees = 1e-4;
    sensor->fov_axis = CA_FOV_X;
    sensor->camera.near_clip = 1e-6f;
    sensor->camera.far_clip = 1e10f;
    set_ray(props, sensor);
}

/* ---- Distant --------------------------------------------------------------------------------------------------- */

/* The direction in which it looks: `direction`, or to_world's z axis. */
static ca_vec3 looks_along(ca_props *props)
{
    double d[3] = {0.0, 0.0, 1.0};
    const bool has_direction = ca_props_point(props, "direction", d);
    if (has_direction && ca_props_find(props, "to_world")) ca_props_fail(props, "to_world", "excludes direction");
    const ca_matrix to_world = ca_props_transform(props, "to_world");
    for (int i = 0; i < 3 && !has_direction; i++) d[i] = to_world.m[i][2];
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (length > 0.0) return (ca_vec3){(float)(d[0] / length), (float)(d[1] / length), (float)(d[2] / length)};
    ca_props_fail(props, has_direction ? "direction" : "to_world", "must have a length over 0");
    return (ca_vec3){0.0f, 0.0f, 1.0f};
}

/* What sides x and y of a flat target look like along the direction, from its middle. */
static void look_at_target(ca_props *props, ca_camera *camera, ca_vec3 along, const ca_matrix *target)
{
    ca_matrix m = ca_matrix_identity();
    const double d[3] = {(double)along.x, (double)along.y, (double)along.z};
    double facing = 0.0, lengths = 1.0; /* (x cross y) . d, and their lengths together */
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        facing += d[i] * (target->m[j][0] * target->m[k][1] - target->m[k][0] * target->m[j][1]);
    }
    for (int c = 0; c < 2; c++) {
        lengths *= sqrt(target->m[0][c] * target->m[0][c] + target->m[1][c] * target->m[1][c] +
                        target->m[2][c] * target->m[2][c]);
        const double into = target->m[0][c] * d[0] + target->m[1][c] * d[1] + target->m[2][c] * d[2];
        for (int i = 0; i < 3; i++) m.m[i][c] = target->m[i][c] - into * d[i];
    }
    for (int i = 0; i < 3; i++) m.m[i][2] = d[i], m.m[i][3] = target->m[i][3];
    if (!(fabs(facing) > 1e-5 * lengths) || !ca_affine_from_matrix(&m, &camera->map))
        ca_props_fail(props, "target", "must not be seen edge-on");
}

/* A rectangle or disk, which is no part of the scene. */
static void import_target(ca_props *props, ca_camera *camera, ca_vec3 along, ca_xml_node *node)
{
    const char *type = ca_xml_attribute_value(node, "type");
    camera->is_disk = strcmp(type, "disk") == 0;
    if (!camera->is_disk && strcmp(type, "rectangle") != 0) {
        ca_import_fail(props->importer, &node->where, "a target is a point, a rectangle or a disk, not %s", type);
        return;
    }
    ca_props of_target;
    ca_props_begin(&of_target, props->importer, node);
    const ca_matrix to_world = ca_props_transform(&of_target, "to_world");
    ca_props_boolean(&of_target, "flip_normals", false);
    ca_props_end(&of_target);
    look_at_target(props, camera, along, &to_world);
}

/* The mean radiance that leaves the scene against the direction, over a target: a sensor far away. */
static void import_distant(ca_props *props, void *result)
{
    ca_camera_desc *sensor = result;
    const ca_vec3 along = looks_along(props);
    double point[3] = {0.0, 0.0, 0.0};
    ca_xml_node *cursor = NULL;
    ca_xml_node *target = ca_props_next_object(props, "shape", true, &cursor);
    const bool at_point = !target && ca_props_point(props, "target", point);
    sensor->place = target || at_point ? CA_PLACE_OUTSIDE : CA_PLACE_ALL;
    sensor->fov_axis = CA_FOV_X;
    sensor->camera.near_clip = at_point ? 1e-6f : 0.0f;
    sensor->camera.far_clip = 1e30f;
    const ca_frame frame = ca_frame_from_normal(along);
    ca_matrix m = ca_matrix_identity();
    for (int i = 0; i < 3; i++) m.m[i][3] = point[i];
    m.m[0][0] = (double)frame.s.x, m.m[1][0] = (double)frame.s.y, m.m[2][0] = (double)frame.s.z;
    m.m[0][1] = (double)frame.t.x, m.m[1][1] = (double)frame.t.y, m.m[2][1] = (double)frame.t.z;
    m.m[0][2] = (double)along.x, m.m[1][2] = (double)along.y, m.m[2][2] = (double)along.z;
    (void)ca_affine_from_matrix(&m, &sensor->camera.map);
    sensor->camera.kind = at_point ? CA_CAMERA_PERSPECTIVE : CA_CAMERA_ORTHOGRAPHIC;
    sensor->fov_degrees = at_point ? 1e-4 : 0.0;
    if (at_point) return;
    sensor->camera.is_disk = true;
    if (target) import_target(props, &sensor->camera, along, target);
}

/* ---- Realistic ------------------------------------------------------------------------------------------------- */

bool ca_import_lens_file(ca_importer *importer, const char *path, const ca_location *where, ca_lens_table *table)
{
    ca_bytes bytes;
    ca_error reason;
    const ca_status status = ca_file_read(path, "lens", 1 << 20, &bytes, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(importer, where, status, &reason);
        return false;
    }
    uint64_t *const hash = &importer->document.content_hash;
    *hash = ca_hash_bytes(ca_hash_add(*hash, bytes.size), bytes.data, bytes.size);
    if (memchr(bytes.data, 0, bytes.size))
        ca_import_fail(importer, where, "%s is no text file", path);
    else
        importer->status =
            ca_import_lens(path, (const char *)bytes.data, bytes.size, NULL, table, importer->error);
    ca_bytes_destroy(&bytes);
    return ca_import_good(importer);
}

/* The table, from a file or the scene; false after failing. */
static bool import_lens(ca_props *props, ca_lens_table *table)
{
    const ca_xml_node *text = ca_props_find(props, "lens");
    *table = (ca_lens_table){0};
    if ((text != NULL) == (ca_props_find(props, "filename") != NULL)) {
        ca_props_fail(props, "lens", "or filename must be given, and not both");
    } else if (text) {
        const char *value = ca_props_string(props, "lens", "");
        ca_importer *importer = props->importer;
        if (ca_import_good(importer))
            importer->status =
                ca_import_lens(text->where.file, value, strlen(value), &text->where, table, importer->error);
    } else {
        const char *path = ca_import_filename(props, "filename");
        if (path) ca_import_lens_file(props->importer, path, &props->node->where, table);
    }
    return ca_import_good(props->importer);
}

/* Closes the stop of the lens to a diameter in mm. */
static void import_aperture(ca_props *props, ca_lens_table *table)
{
    if (!ca_props_find(props, "aperture_diameter")) return;
    const double radius = 0.5 * ca_props_positive(props, "aperture_diameter", 1.0);
    ca_lens_surface *stop = &table->lens.surfaces[table->stop];
    if (table->stop_count != 1)
        ca_props_fail(props, "aperture_diameter", "needs a lens with one stop");
    else if (radius > stop->aperture)
        ca_props_fail(props, "aperture_diameter", "is more than the diameter of the lens's stop");
    else
        stop->aperture = radius;
}

static const ca_lens_surface *last_surface(const ca_realistic *camera)
{
    return &camera->lens.surfaces[camera->lens.count - 1];
}

/* Says why there is no place for the film where what is in focus is sharp. */
static void fail_focus(ca_props *props, double distance, const ca_realistic *camera, double image)
{
    const ca_xml_node *asked = ca_props_find(props, "focus_distance");
    const ca_location *where = asked ? &asked->where : &props->node->where;
    const double focal_length = ca_lens_focal_length(&camera->lens);
    const double nearest = ca_lens_nearest(&camera->lens) * camera->scale;
    if (isinf(focal_length))
        ca_import_fail(props->importer, where,
                       "the lens cannot focus: it has no power, and makes no image; film_distance may say where the "
                       "film is");
    else if (focal_length < 0.0)
        ca_import_fail(props->importer, where,
                       "the lens cannot focus: its focal length is %.6g mm, so that it makes no image; film_distance "
                       "may say where the film is",
                       focal_length);
    else if (distance <= nearest || image >= 1e5)
        ca_import_fail(props->importer, where,
                       "the lens cannot focus at a distance of %.6g: it makes no image of that within 100 m behind "
                       "itself, only of what is farther away than %.6g",
                       distance, nearest);
    else
        ca_import_fail(props->importer, where,
                       "the lens cannot focus at a distance of %.6g: the image lies in the lens, %.6g mm before its "
                       "last surface's rim",
                       distance, fmax(0.0, ca_lens_sag(last_surface(camera))) - image);
}

/* Where the film is, in mm behind the last vertex: said, or where the image of what is in focus lies. */
static void import_focus(ca_props *props, double focus_distance, ca_realistic *camera)
{
    const bool said = ca_props_find(props, "film_distance") != NULL;
    camera->film_distance = said ? ca_props_positive(props, "film_distance", 1.0)
                                 : ca_lens_image_of(&camera->lens, focus_distance / camera->scale).distance;
    if (said && ca_props_find(props, "focus_distance"))
        ca_props_fail(props, "film_distance", "excludes focus_distance");
    if (camera->film_distance > fmax(0.0, ca_lens_sag(last_surface(camera))) && camera->film_distance < 1e5) return;
    if (said)
        ca_props_fail(props, "film_distance", "must be behind the last surface, within 100 m");
    else
        fail_focus(props, focus_distance, camera, camera->film_distance);
}

/* A lens that nothing can be seen through; stop: its surface that aperture_diameter closes. */
static void check_light(ca_props *props, const ca_realistic *camera, uint32_t stop)
{
    static const char dark[] = "no light gets through the lens to the film";
    uint32_t i;
    ca_lens_end end;
    if (!ca_import_good(props->importer) || !ca_realistic_is_dark(camera, &i, &end)) return;
    const bool closed = end == CA_LENS_BESIDE && i == stop && ca_props_find(props, "aperture_diameter");
    const char *table = ca_props_find(props, "lens") ? "lens" : "filename";
    const ca_location *where = &ca_props_find(props, closed ? "aperture_diameter" : table)->where;
    if (end == CA_LENS_CROSSED)
        ca_import_fail(props->importer, where, "%s: its surfaces %u and %u cross next to the axis, %.6g mm apart",
                       dark, i + 1, i + 2, camera->lens.surfaces[i].thickness);
    else if (end == CA_LENS_BESIDE)
        ca_import_fail(props->importer, where, "%s: the aperture of surface %u, %.6g mm across, is too small", dark,
                       i + 1, 2.0 * camera->lens.surfaces[i].aperture);
    else
        ca_import_fail(props->importer, where, "%s: surface %u reflects all of it", dark, i + 1);
}

static void import_realistic(ca_props *props, void *result)
{
    ca_camera_desc *sensor = result;
    ca_camera *camera = &sensor->camera;
    ca_realistic *realistic = &camera->as.realistic;
    camera->kind = CA_CAMERA_REALISTIC;
    sensor->fov_degrees = 0.0;
    set_map(props, sensor, true);
    const double focus_distance = (double)import_distances(props, camera);
    realistic->scale = ca_props_number_in(props, "lens_scale", 1e-3, 1e-9, 1e9);
    realistic->film_diagonal = ca_props_number_in(props, "film_diagonal", 35.0, 1e-3, 1e5);
    ca_lens_table table;
    if (!import_lens(props, &table)) return;
    import_aperture(props, &table);
    realistic->lens = table.lens;
    import_focus(props, focus_distance, realistic);
    check_light(props, realistic, table.stop);
    const double rim = -ca_lens_sag(&realistic->lens.surfaces[0]) * realistic->scale;
    if ((double)camera->near_clip < rim) ca_props_fail(props, "near_clip", "must be in front of the lens's rim");
}

/* ---- Any of them ----------------------------------------------------------------------------------------------- */

static void import_batch(ca_props *props, void *result);

static const ca_plugin sensors[] = {
    {"perspective", import_perspective},
    {"thinlens", import_thin_lens},
    {"orthographic", import_orthographic},
    {"realistic", import_realistic},
    {"radiancemeter", import_radiance_meter},
    {"distant", import_distant},
    {"batch", import_batch},
};

ca_import_view ca_import_keep_view(const ca_scene_desc *desc)
{
    return (ca_import_view){desc->camera, desc->film, desc->sampler, desc->names_sampler, desc->samples_per_pixel};
}

void ca_import_put_back_view(ca_scene_desc *desc, const ca_import_view *kept)
{
    desc->camera = kept->camera;
    desc->film = kept->film;
    desc->sampler = kept->sampler;
    desc->names_sampler = kept->names_sampler;
    desc->samples_per_pixel = kept->samples_per_pixel;
}

/* At most one nested object of a kind, any name. */
static void import_nested(ca_props *props, const char *tag, void (*import)(ca_importer *, ca_xml_node *))
{
    ca_xml_node *cursor = NULL;
    ca_xml_node *node = ca_props_next_object(props, tag, true, &cursor);
    if (!node) return;
    import(props->importer, node);
    if (ca_props_next_object(props, tag, true, &cursor))
        ca_import_fail(props->importer, &cursor->where, "a sensor has one %s, and this is a second", tag);
}

/* All parameters but those that depend on the film's size; NULL after failing. */
static const ca_plugin *read_sensor(ca_importer *importer, ca_xml_node *node)
{
    const ca_plugin *plugin = ca_import_find_plugin(importer, node, sensors, CA_COUNT(sensors));
    if (!plugin) return NULL;
    ca_props props;
    ca_props_begin(&props, importer, node);
    ca_camera_desc *sensor = &importer->desc->camera;
    sensor->where = node->where;
    sensor->place = CA_PLACE_OWN;
    sensor->camera.is_disk = false;
    import_nested(&props, "film", ca_import_film); /* a batch divides it */
    plugin->import(&props, sensor);
    /* There is no motion: a shutter has no effect. */
    ca_props_number(&props, "shutter_open", 0.0);
    ca_props_number(&props, "shutter_close", 0.0);
    import_nested(&props, "sampler", ca_import_sampler);
    ca_props_end(&props);
    return ca_import_good(importer) ? plugin : NULL;
}

/* A meter of one ray or one direction sees one pixel; its filter would reach out of the target. */
static void check_meter(ca_importer *importer, const ca_xml_node *node, uint32_t width, uint32_t height)
{
    if (width != 1 || height != 1)
        ca_import_fail(importer, &node->where, "%s needs a film of 1 x 1 pixels, and this is %u x %u",
                       ca_xml_attribute_value(node, "type"), width, height);
    importer->desc->film.filter = ca_filter_default(CA_RFILTER_BOX);
    importer->desc->film.is_fixed = true;
}

/* The sensor gets a film of so many pixels. */
static void set_size(ca_importer *importer, const ca_plugin *plugin, const ca_xml_node *node, uint32_t width,
                     uint32_t height)
{
    ca_camera_desc *sensor = &importer->desc->camera;
    if (plugin->import == import_radiance_meter || plugin->import == import_distant)
        check_meter(importer, node, width, height);
    sensor->camera.width = width;
    sensor->camera.height = height;
    if (!ca_import_good(importer) || !ca_camera_has_field_of_view(&sensor->camera)) return;
    const float tan_half_x = (float)ca_camera_tan_half_x(sensor->fov_degrees, sensor->fov_axis, width, height);
    ca_camera_set_tan_half_x(&sensor->camera, tan_half_x);
    if (!(tan_half_x > 0.0f && tan_half_x < 1e6f))
        ca_import_fail(importer, &node->where, "the horizontal field of view is not between 0 and 180 degrees");
}

void ca_import_sensor(ca_importer *importer, ca_xml_node *node)
{
    const ca_plugin *plugin = read_sensor(importer, node);
    const ca_film_desc *film = &importer->desc->film;
    if (plugin) set_size(importer, plugin, node, film->width, film->height);
}

/* ---- Batch ----------------------------------------------------------------------------------------------------- */

/* A sensor of a batch, on its part of the film. Its own film and sampler are read and not used; but a meter decides
 * about the filter. */
static void import_panel(ca_importer *importer, ca_xml_node *node, uint32_t width, uint32_t height, ca_camera *panel)
{
    if (!ca_import_enter(importer, node)) return;
    const ca_import_view kept = ca_import_keep_view(importer->desc);
    const ca_plugin *plugin = read_sensor(importer, node);
    importer->desc->film = kept.film;
    if (plugin && (plugin->import == import_batch || plugin->import == import_distant))
        ca_import_fail(importer, &node->where, "a batch cannot hold a \"%s\"", plugin->name);
    if (plugin && ca_import_good(importer)) set_size(importer, plugin, node, width, height);
    if (ca_import_good(importer)) {
        *panel = importer->desc->camera.camera;
        ca_camera_prepare(panel);
    }
    const ca_filter filter = importer->desc->film.filter;
    ca_import_put_back_view(importer->desc, &kept);
    importer->desc->film.filter = filter;
    ca_import_leave(importer, node, 0);
}

/* Their number; 0 after failing: the film cannot be divided among them. */
static uint32_t count_panels(ca_props *props, uint32_t width)
{
    uint32_t count = 0;
    ca_xml_node *cursor = NULL;
    while (ca_props_next_object(props, "sensor", true, &cursor)) count++;
    if (count == 0) ca_import_fail(props->importer, &props->node->where, "batch needs nested sensors");
    if (count == 0 || width % count == 0) return count;
    ca_import_fail(props->importer, &props->node->where,
                   "the film of %u pixels a row cannot be divided among the batch's %u sensors", width, count);
    return 0;
}

/* Sensors side by side on one film. */
static void import_batch(ca_props *props, void *result)
{
    ca_camera_desc *sensor = result;
    ca_importer *importer = props->importer;
    const ca_film_desc film = importer->desc->film;
    const uint32_t count = count_panels(props, film.width);
    if (!ca_import_good(importer)) return;
    ca_camera *panels = ca_arena_alloc(&importer->desc->strings, count, sizeof *panels);
    if (!panels) {
        ca_import_fail_memory(importer, "the sensors of a batch");
        return;
    }
    ca_xml_node *cursor = NULL;
    for (uint32_t i = 0; i < count && ca_import_good(importer); i++)
        import_panel(importer, ca_props_next_object(props, "sensor", true, &cursor), film.width / count, film.height,
                     &panels[i]);
    sensor->fov_degrees = 0.0;
    sensor->camera.kind = CA_CAMERA_PANELS;
    sensor->camera.as.panels = (ca_camera_panels){.cameras = panels, .count = count};
    sensor->camera.map = panels[0].map;
    sensor->camera.near_clip = panels[0].near_clip;
    sensor->camera.far_clip = panels[0].far_clip;
}

/* ---- Sampler --------------------------------------------------------------------------------------------------- */

/* Mitsuba's, and which of ours is used: those that spread the samples of a pixel evenly are our Sobol' sequence for
 * each pixel, which does that in all dimensions. */
typedef struct foreign_sampler {
    const char *name;
    ca_sampler_kind kind;
} foreign_sampler;

static const foreign_sampler foreign_samplers[] = {
    {"ldsampler", CA_SAMPLER_SOBOL},   {"stratified", CA_SAMPLER_SOBOL},  {"multijitter", CA_SAMPLER_SOBOL},
    {"orthogonal", CA_SAMPLER_SOBOL}, {"hammersley", CA_SAMPLER_HALTON},
};

static bool is_foreign(const ca_xml_node *node)
{
    for (size_t i = 0; i < CA_COUNT(foreign_samplers); i++)
        if (strcmp(ca_xml_attribute_value(node, "type"), foreign_samplers[i].name) == 0) return true;
    return false;
}

/* CA_SAMPLER_KIND_COUNT after failing. */
static ca_sampler_kind sampler_kind(ca_importer *importer, const ca_xml_node *node)
{
    ca_plugin samplers[CA_SAMPLER_KIND_COUNT + CA_COUNT(foreign_samplers)];
    for (int kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++)
        samplers[kind] = (ca_plugin){.name = ca_sampler_name((ca_sampler_kind)kind)};
    for (size_t i = 0; i < CA_COUNT(foreign_samplers); i++)
        samplers[CA_SAMPLER_KIND_COUNT + i] = (ca_plugin){.name = foreign_samplers[i].name};
    const ca_plugin *plugin = ca_import_find_plugin(importer, node, samplers, CA_COUNT(samplers));
    if (!plugin) return CA_SAMPLER_KIND_COUNT;
    const size_t index = (size_t)(plugin - samplers);
    if (index < CA_SAMPLER_KIND_COUNT) return (ca_sampler_kind)index;
    const foreign_sampler *foreign = &foreign_samplers[index - CA_SAMPLER_KIND_COUNT];
    ca_import_note(importer, &node->where, "sampler \"%s\" is read as \"%s\"", foreign->name,
                   ca_sampler_name(foreign->kind));
    return foreign->kind;
}

void ca_import_sampler(ca_importer *importer, ca_xml_node *node)
{
    const ca_sampler_kind kind = sampler_kind(importer, node);
    if (kind == CA_SAMPLER_KIND_COUNT) return;
    ca_props props;
    ca_props_begin(&props, importer, node);
    importer->desc->names_sampler = true;
    importer->desc->sampler.kind = kind;
    if (is_foreign(node)) { /* what tunes their grids has no meaning for ours */
        ca_props_boolean(&props, "jitter", true);
        ca_props_integer_in(&props, "strength", 2, 0, 64);
        ca_props_integer_in(&props, "dimension", 4, 1, 4096);
        ca_props_integer_in(&props, "scramble", -1, -1, INT32_MAX);
    }
    importer->desc->samples_per_pixel = (uint32_t)ca_props_integer_in(&props, "sample_count", 4, 1, INT32_MAX);
    importer->desc->sampler.seed = (uint64_t)ca_props_integer_in(&props, "seed", 0, 0, INT64_MAX);
    ca_props_end(&props);
}
