/* Shapes. Result of each: ca_shape_desc. Groups and instances have their own tables in the description. */
#include "import/importer.h"

#include "base/loading.h"
#include "base/memory.h"
#include "import/reuse.h"
#include "import/shared_meshes.h"

#include <string.h>

/* ---- Meshes ---------------------------------------------------------------------------------------------------- */

/* One that no other shape can have. Takes it over. */
static void add_mesh(ca_props *props, ca_shape_desc *shape, ca_mesh *mesh)
{
    const ca_mesh_key unknown = {0};
    shape->as.mesh.index = ca_shared_mesh_add(props->importer, &unknown, mesh);
}

/* False where the mesh has to be read; else the shape has it, or that failed. */
static bool has_mesh(ca_props *props, ca_shape_desc *shape, const ca_mesh_key *key)
{
    shape->as.mesh.index = ca_shared_mesh(props->importer, key);
    return shape->as.mesh.index != CA_NONE || !ca_import_good(props->importer);
}

static void add_built_in(ca_props *props, ca_shape_desc *shape, ca_status (*create)(ca_mesh *, ca_error *))
{
    ca_mesh mesh;
    ca_error reason;
    shape->kind = CA_SHAPE_MESH;
    const ca_status status = create(&mesh, &reason);
    if (status == CA_OK)
        add_mesh(props, shape, &mesh);
    else
        ca_import_fail_file(props->importer, &props->node->where, status, &reason);
}

static void import_rectangle(ca_props *props, void *result) { add_built_in(props, result, ca_mesh_create_rectangle); }

static void import_cube(ca_props *props, void *result) { add_built_in(props, result, ca_mesh_create_cube); }

static void flip_v(ca_mesh *mesh)
{
    if (!mesh->uvs) return;
    for (size_t i = 0; i < mesh->vertex_count; i++) mesh->uvs[2 * i + 1] = 1.0f - mesh->uvs[2 * i + 1];
}

static ca_mesh_use import_use(ca_props *props, const ca_shape_desc *shape, bool flips)
{
    if (ca_props_find(props, "max_smooth_angle")) /* 0.6 */
        ca_import_note(props->importer, &props->node->where,
                       "max_smooth_angle has no effect: normals are smooth across edges, or flat with face_normals");
    return (ca_mesh_use){.to_world = shape->to_world,
                         .flip_normals = shape->flip_normals,
                         .face_normals = ca_props_boolean(props, "face_normals", false),
                         .flip_tex_coords = ca_props_boolean(props, "flip_tex_coords", flips)};
}

/* As Mitsuba does: face_normals drops the file's vertex normals, and without it a file that has none gets smooth
 * ones. */
static ca_status finish_mesh(ca_mesh *mesh, const ca_mesh_use *use, ca_error *error)
{
    if (use->flip_tex_coords) flip_v(mesh);
    if (use->face_normals) {
        ca_mesh_drop_normals(mesh);
        return CA_OK;
    }
    ca_loading_part(0.5, 1.0);
    return mesh->normals ? CA_OK : ca_mesh_compute_normals(mesh, 0, error);
}

typedef enum mesh_format { FORMAT_OBJ, FORMAT_PLY, FORMAT_SERIALIZED, FORMAT_ARRAYS } mesh_format;

static ca_status read_mesh(mesh_format format, const char *path, uint32_t index, ca_mesh *mesh, ca_error *error)
{
    switch (format) {
    case FORMAT_OBJ: return ca_import_obj(path, mesh, error);
    case FORMAT_PLY: return ca_import_ply(path, mesh, error);
    case FORMAT_SERIALIZED: return ca_import_serialized(path, index, mesh, error);
    case FORMAT_ARRAYS: break;
    }
    return CA_ERROR_ARGUMENT;
}

/* `status` tells whether there is a mesh, `reason` why not. Takes the mesh over. */
static void add_read_mesh(ca_props *props, ca_shape_desc *shape, const ca_mesh_use *use, const ca_mesh_key *key,
                          ca_mesh *mesh, ca_status status, ca_error *reason)
{
    if (status == CA_OK) {
        status = finish_mesh(mesh, use, reason);
        if (status != CA_OK) ca_mesh_destroy(mesh);
    }
    if (status == CA_OK)
        shape->as.mesh.index = ca_shared_mesh_add(props->importer, key, mesh);
    else
        ca_import_fail_file(props->importer, &props->node->where, status, reason);
}

static void import_mesh_file(ca_props *props, ca_shape_desc *shape, mesh_format format)
{
    shape->kind = CA_SHAPE_MESH;
    const char *path = ca_import_filename(props, "filename");
    const ca_mesh_use use = import_use(props, shape, format == FORMAT_OBJ);
    uint32_t index = 0;
    if (format == FORMAT_SERIALIZED) index = (uint32_t)ca_props_integer_in(props, "shape_index", 0, 0, INT32_MAX);
    if (!path || !ca_import_good(props->importer)) return;
    ca_mesh mesh = {0};
    ca_error reason;
    ca_mesh_key key = ca_mesh_key_of(ca_reuse_file(path), (uint64_t)format << 32 | index, &use);
    key.lasts = true;
    if (has_mesh(props, shape, &key)) return;
    ca_loading_part(0.0, 0.5); /* the rest: its normals */
    const ca_status status = read_mesh(format, path, index, &mesh, &reason);
    add_read_mesh(props, shape, &use, &key, &mesh, status, &reason);
}

/* Arrays of the program that hands us the scene. */
static void add_mesh_data(ca_props *props, ca_shape_desc *shape, const ca_mesh_data *data, const ca_mesh_use *use)
{
    ca_mesh mesh = {0};
    ca_error reason;
    const uint64_t content = ca_reuse_arrays(data);
    ca_status status = ca_loading_check(&reason);
    ca_mesh_key key = ca_mesh_key_of(content, FORMAT_ARRAYS, use);
    key.lasts = true;
    ca_memory_budget_read(0, 12 * (data->vertex_count + data->triangle_count));
    if (status == CA_OK && has_mesh(props, shape, &key)) return;
    if (status == CA_OK) status = ca_import_mesh_data(props->importer, data, use, &mesh, &reason);
    mesh.content_hash = content;
    add_read_mesh(props, shape, use, &key, &mesh, status, &reason);
}

/* Of the reader of another format; a later version of the scene makes it anew. */
static void add_made_mesh(ca_props *props, ca_shape_desc *shape, ca_import_mesh *made, const ca_mesh_use *use)
{
    ca_mesh mesh;
    ca_error reason;
    const uint64_t number = (uint64_t)(made - props->importer->arrays.meshes.items) + 1;
    const ca_mesh_key key = ca_mesh_key_of(number, FORMAT_ARRAYS, use);
    if (has_mesh(props, shape, &key)) return;
    const ca_status status = ca_import_made_mesh(made, &mesh, &reason);
    add_read_mesh(props, shape, use, &key, &mesh, status, &reason);
}

static void import_mesh_data(ca_props *props, void *result)
{
    ca_shape_desc *shape = result;
    ca_importer *importer = props->importer;
    ca_error reason;
    shape->kind = CA_SHAPE_MESH;
    const char *name = ca_props_string(props, "data", NULL);
    const ca_mesh_use use = import_use(props, shape, false);
    if (!name) ca_props_fail(props, "data", "must name a mesh that is given as arrays");
    if (!name || !ca_import_good(importer)) return;
    ca_import_mesh *made = ca_import_find_made(importer, name);
    if (made) {
        add_made_mesh(props, shape, made, &use);
        return;
    }
    const ca_mesh_data *data = ca_import_find_mesh(importer, name, &reason);
    const ca_status status = data ? ca_import_check_mesh(data, &reason) : CA_ERROR_SCENE;
    if (status == CA_OK)
        add_mesh_data(props, shape, data, &use);
    else
        ca_import_fail_file(importer, &props->node->where, status, &reason);
}

static void import_obj(ca_props *props, void *result) { import_mesh_file(props, result, FORMAT_OBJ); }
static void import_ply(ca_props *props, void *result) { import_mesh_file(props, result, FORMAT_PLY); }
static void import_serialized(ca_props *props, void *result) { import_mesh_file(props, result, FORMAT_SERIALIZED); }

/* ---- Quadrics -------------------------------------------------------------------------------------------------- */

/* What the exact shape cannot be: a mesh in its place. */
static void add_round_mesh(ca_props *props, ca_shape_desc *shape, ca_status status, ca_mesh *mesh,
                           const ca_error *reason)
{
    shape->kind = CA_SHAPE_MESH;
    if (status != CA_OK) {
        ca_import_fail_file(props->importer, &props->node->where, status, reason);
        return;
    }
    ca_import_note(props->importer, &props->node->where,
                   "a %s whose to_world stretches it across is a mesh of %u triangles", props->type,
                   mesh->triangle_count);
    add_mesh(props, shape, mesh);
}

static void import_sphere(ca_props *props, void *result)
{
    ca_shape_desc *shape = result;
    double center[3] = {0.0, 0.0, 0.0};
    ca_mesh mesh = {0};
    ca_error reason;
    const float radius = (float)ca_props_positive(props, "radius", 1.0);
    ca_props_point(props, "center", center);
    shape->kind = CA_SHAPE_SPHERE;
    if (!ca_import_good(props->importer)) return;
    if (!ca_import_make_similarity(&shape->to_world)) {
        add_round_mesh(props, shape, ca_mesh_create_sphere(&mesh, center, radius, &reason), &mesh, &reason);
        return;
    }
    shape->as.sphere.radius = radius;
    memcpy(shape->as.sphere.center, center, sizeof center);
}

static void import_disk(ca_props *props, void *result)
{
    ca_shape_desc *shape = result;
    (void)props;
    shape->kind = CA_SHAPE_DISK;
}

static void import_cylinder(ca_props *props, void *result)
{
    ca_shape_desc *shape = result;
    double p0[3] = {0.0, 0.0, 0.0}, p1[3] = {0.0, 0.0, 1.0}, length2 = 0.0;
    ca_mesh mesh = {0};
    ca_error reason;
    const float radius = (float)ca_props_positive(props, "radius", 1.0);
    ca_props_point(props, "p0", p0);
    ca_props_point(props, "p1", p1);
    for (int i = 0; i < 3; i++) length2 += (p1[i] - p0[i]) * (p1[i] - p0[i]);
    if (!(length2 > 0.0) || !isfinite(length2)) ca_props_fail(props, "p1", "must be another point than p0");
    shape->kind = CA_SHAPE_CYLINDER;
    if (!ca_import_good(props->importer)) return;
    const ca_matrix frame = ca_cylinder_frame(p0, p1, (double)radius);
    const ca_matrix map = ca_matrix_multiply(&shape->to_world, &frame);
    if (!ca_is_round_cylinder(&map)) {
        add_round_mesh(props, shape, ca_mesh_create_cylinder(&mesh, &frame, &reason), &mesh, &reason);
        return;
    }
    shape->as.cylinder.radius = radius;
    memcpy(shape->as.cylinder.p0, p0, sizeof p0);
    memcpy(shape->as.cylinder.p1, p1, sizeof p1);
}

/* ---- Height fields --------------------------------------------------------------------------------------------- */

/* The file's picture, or that of a nested texture; NULL after failing. */
static const ca_image *height_picture(ca_props *props)
{
    ca_importer *importer = props->importer;
    ca_xml_node *cursor = NULL, *nested = ca_props_next_object(props, "texture", true, &cursor);
    if (!nested) {
        const uint32_t image = ca_import_picture(props, CA_ENCODING_SRGB);
        return ca_import_good(importer) ? &importer->desc->images.items[image] : NULL;
    }
    if (ca_props_find(props, "filename")) ca_props_fail(props, "filename", "excludes a nested texture");
    const ca_texture_id id = ca_import_texture(importer, nested);
    if (!ca_import_good(importer)) return NULL;
    const ca_texture *texture = &importer->desc->textures.items[id];
    if (texture->kind == CA_TEXTURE_BITMAP) return &importer->desc->images.items[texture->as.bitmap.image_index];
    ca_import_fail(importer, &cursor->where, "a height field is made from a bitmap; other textures have no pixels");
    return NULL;
}

/* Mitsuba 0.6's, there of bilinear patches. */
static void import_height_field(ca_props *props, void *result)
{
    ca_shape_desc *shape = result;
    ca_mesh mesh;
    ca_error reason;
    const float scale = (float)ca_props_number(props, "scale", 1.0);
    const bool smooth = ca_props_boolean(props, "shading_normals", true);
    shape->kind = CA_SHAPE_MESH;
    const ca_image *picture = height_picture(props);
    if (!picture || !ca_import_good(props->importer)) return;
    const ca_status status = ca_import_height_field(picture, scale, smooth, &mesh, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(props->importer, &props->node->where, status, &reason);
        return;
    }
    ca_import_note(props->importer, &props->node->where, "the patches of a heightfield are two triangles each");
    add_mesh(props, shape, &mesh);
}

/* ---- Curves ---------------------------------------------------------------------------------------------------- */

/* From the file, or as another format's reader made them; NULL after failing. */
static ca_curve *read_curve(ca_props *props, ca_curve_degree degree)
{
    ca_importer *importer = props->importer;
    ca_curve *curve = NULL;
    ca_error reason;
    if (ca_props_find(props, "data")) {
        const char *name = ca_props_string(props, "data", "");
        curve = ca_import_good(importer) ? ca_import_take_made_curve(importer, name, &reason) : NULL;
        if (!curve) ca_import_fail_file(importer, &props->node->where, CA_ERROR_SCENE, &reason);
        return curve;
    }
    const char *path = ca_import_filename(props, "filename");
    if (!path || !ca_import_good(importer)) return NULL;
    const ca_status status = ca_import_curves(path, degree, &curve, &reason);
    if (status != CA_OK) ca_import_fail_file(importer, &props->node->where, status, &reason);
    return curve;
}

static void import_curve(ca_props *props, ca_shape_desc *shape, ca_curve_degree degree)
{
    ca_importer *importer = props->importer;
    shape->kind = CA_SHAPE_CURVE;
    if (shape->light != CA_NONE) ca_import_fail(importer, &props->node->where, "curves cannot emit light");
    if (shape->flip_normals) ca_props_fail(props, "flip_normals", "has no meaning for curves");
    ca_curve *curve = read_curve(props, degree);
    if (!curve) return;
    if (!CA_TABLE_ADD(&importer->desc->curves)) {
        ca_curve_destroy(curve);
        ca_import_fail_memory(importer, "curves");
    } else {
        shape->as.curve.index = (uint32_t)(importer->desc->curves.count - 1);
        importer->desc->curves.items[shape->as.curve.index] = curve;
    }
}

static void import_bspline_curve(ca_props *props, void *result) { import_curve(props, result, CA_CURVE_CUBIC); }
static void import_linear_curve(ca_props *props, void *result) { import_curve(props, result, CA_CURVE_LINEAR); }

/* ---- Grids of signed distances --------------------------------------------------------------------------------- */

static void import_sdf_grid(ca_props *props, void *result)
{
    static const char *const normals[] = {"smooth", "analytic"};
    ca_shape_desc *shape = result;
    ca_importer *importer = props->importer;
    ca_sdf_grid *grid;
    ca_error reason;
    shape->kind = CA_SHAPE_SDF_GRID;
    const bool smooth = ca_props_choice(props, "normals", normals, CA_COUNT(normals), 0) == 0;
    const char *path = ca_import_filename(props, "filename");
    if (shape->light != CA_NONE)
        ca_import_fail(importer, &props->node->where, "a grid of distances cannot emit light");
    if (!path || !ca_import_good(importer)) return;
    const ca_status status = ca_import_sdf_grid(path, &grid, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(importer, &props->node->where, status, &reason);
        return;
    }
    grid->smooth = smooth;
    if (!CA_TABLE_ADD(&importer->desc->grids)) {
        ca_sdf_grid_destroy(grid);
        ca_import_fail_memory(importer, "grids of distances");
    } else {
        shape->as.sdf.index = (uint32_t)(importer->desc->grids.count - 1);
        importer->desc->grids.items[shape->as.sdf.index] = grid;
    }
}

static const ca_plugin plugins[] = {
    {"rectangle", import_rectangle},
    {"cube", import_cube},
    {"sphere", import_sphere},
    {"disk", import_disk},
    {"cylinder", import_cylinder},
    {"obj", import_obj},
    {"ply", import_ply},
    {"serialized", import_serialized},
    {"mesh", import_mesh_data},
    {"bsplinecurve", import_bspline_curve},
    {"linearcurve", import_linear_curve},
    {"heightfield", import_height_field},
    {"sdfgrid", import_sdf_grid},
};

/* ---- What all of them have ------------------------------------------------------------------------------------- */

static void import_material(ca_props *props, ca_shape_desc *shape)
{
    ca_xml_node *cursor = NULL;
    ca_xml_node *bsdf = ca_props_next_object(props, "bsdf", true, &cursor);
    if (!bsdf) return;
    shape->material = ca_import_bsdf(props->importer, bsdf);
    if (ca_props_next_object(props, "bsdf", true, &cursor))
        ca_import_fail(props->importer, &cursor->where, "a shape has one BSDF, and this is a second");
}

static void import_emitter(ca_props *props, ca_shape_desc *shape)
{
    ca_xml_node *cursor = NULL;
    ca_xml_node *emitter = ca_props_next_object(props, "emitter", true, &cursor);
    if (!emitter) return;
    if (shape->group != CA_NONE) {
        ca_import_fail(props->importer, &cursor->where, "a shape inside a shapegroup cannot emit light");
        return;
    }
    shape->light = ca_import_area_light(props->importer, emitter);
    if (ca_props_next_object(props, "emitter", true, &cursor))
        ca_import_fail(props->importer, &cursor->where, "a shape has one emitter, and this is a second");
}

static const char *keep_id(ca_importer *importer, const ca_xml_node *node)
{
    const char *id = ca_xml_attribute_value(node, "id");
    if (!id) return NULL;
    const char *kept = ca_arena_strdup(&importer->desc->strings, id);
    if (!kept) ca_import_fail_memory(importer, "ids");
    return kept;
}

static void import_plain_shape(ca_importer *importer, ca_xml_node *node, const ca_plugin *plugin, uint32_t group)
{
    ca_shape_desc shape = {.material = CA_NONE, .light = CA_NONE, .group = group};
    ca_props props;
    ca_props_begin(&props, importer, node);
    shape.where = node->where;
    shape.id = keep_id(importer, node);
    shape.to_world = ca_props_transform(&props, "to_world");
    shape.flip_normals = ca_props_boolean(&props, "flip_normals", false);
    import_material(&props, &shape);
    import_emitter(&props, &shape);
    /* After a mistake there is no need to read a mesh. */
    if (ca_import_good(importer)) plugin->import(&props, &shape);
    ca_props_end(&props);
    if (!ca_import_good(importer)) return;
    if (!CA_TABLE_ADD(&importer->desc->shapes)) {
        ca_import_fail_memory(importer, "shapes");
        return;
    }
    node->result = (uint32_t)(importer->desc->shapes.count - 1);
    importer->desc->shapes.items[node->result] = shape;
}

/* ---- Groups and instances -------------------------------------------------------------------------------------- */

static bool is_type(const ca_xml_node *node, const char *type)
{
    return strcmp(ca_xml_attribute_value(node, "type"), type) == 0;
}

static const ca_plugin *find_plain_plugin(ca_importer *importer, const ca_xml_node *node)
{
    static const ca_plugin named[] = {{"shapegroup", NULL}, {"instance", NULL}, {"merge", NULL}};
    ca_plugin all[CA_COUNT(plugins) + CA_COUNT(named)];
    memcpy(all, plugins, sizeof plugins);
    memcpy(all + CA_COUNT(plugins), named, sizeof named);
    /* The search is over all names, so that the nearest may be one of a group; what is found is a row of
     * `plugins`. */
    const ca_plugin *found = ca_import_find_plugin(importer, node, all, CA_COUNT(all));
    return found ? &plugins[found - all] : NULL;
}

static void import_merged(ca_importer *importer, ca_xml_node *node, uint32_t group);

static void import_member(ca_importer *importer, ca_xml_node *node, uint32_t group)
{
    if (is_type(node, "merge")) {
        import_merged(importer, node, group);
        return;
    }
    const ca_plugin *plugin = find_plain_plugin(importer, node);
    if (plugin) import_plain_shape(importer, node, plugin, group);
}

/* A merge is its shapes. */
static void import_merged(ca_importer *importer, ca_xml_node *node, uint32_t group)
{
    ca_props props;
    ca_xml_node *cursor = NULL, *member;
    if (!ca_import_enter(importer, node)) return;
    ca_props_begin(&props, importer, node);
    while (ca_import_good(importer) && (member = ca_props_next_object(&props, "shape", true, &cursor)) != NULL) {
        if (is_type(member, "shapegroup") || is_type(member, "instance"))
            ca_import_fail(importer, &cursor->where, "a merge cannot hold %s",
                           ca_xml_attribute_value(member, "type"));
        else
            import_member(importer, member, group);
    }
    ca_props_end(&props);
    ca_import_leave(importer, node, 0);
}

static uint32_t add_group(ca_importer *importer, ca_xml_node *node)
{
    ca_props props;
    ca_props_begin(&props, importer, node);
    const char *id = keep_id(importer, node);
    if (!CA_TABLE_ADD(&importer->desc->groups)) ca_import_fail_memory(importer, "shape groups");
    if (!ca_import_good(importer)) return CA_NONE;
    const uint32_t group = (uint32_t)(importer->desc->groups.count - 1);
    importer->desc->groups.items[group] = (ca_group_desc){.where = node->where, .id = id};
    ca_xml_node *cursor = NULL, *member;
    while (ca_import_good(importer) && (member = ca_props_next_object(&props, "shape", true, &cursor))) {
        if (is_type(member, "shapegroup") || is_type(member, "instance")) {
            ca_import_fail(importer, &cursor->where, "a shapegroup cannot hold a %s",
                           ca_xml_attribute_value(member, "type"));
            break;
        }
        import_member(importer, member, group);
    }
    ca_props_end(&props);
    return group;
}

static uint32_t import_group(ca_importer *importer, ca_xml_node *node)
{
    if (node->progress == CA_NODE_DONE) return node->result;
    if (!ca_import_enter(importer, node)) return CA_NONE;
    const uint32_t group = add_group(importer, node);
    ca_import_leave(importer, node, group);
    return group;
}

static void import_instance(ca_importer *importer, ca_xml_node *node)
{
    ca_props props;
    ca_props_begin(&props, importer, node);
    ca_instance_desc instance = {.id = keep_id(importer, node), .where = node->where};
    instance.to_world = ca_props_transform(&props, "to_world");
    ca_xml_node *cursor = NULL;
    ca_xml_node *group = ca_props_next_object(&props, "shape", true, &cursor);
    if (!group || !is_type(group, "shapegroup")) {
        ca_import_fail(importer, &node->where, "an instance needs a <ref> to a shapegroup");
        return;
    }
    instance.group = import_group(importer, group);
    if (ca_props_next_object(&props, "shape", true, &cursor))
        ca_import_fail(importer, &cursor->where, "an instance has one shapegroup, and this is a second");
    ca_props_end(&props);
    if (!ca_import_good(importer)) return;
    if (CA_TABLE_ADD(&importer->desc->instances))
        importer->desc->instances.items[importer->desc->instances.count - 1] = instance;
    else
        ca_import_fail_memory(importer, "instances");
}

void ca_import_shape(ca_importer *importer, ca_xml_node *node)
{
    if (is_type(node, "shapegroup")) {
        import_group(importer, node);
    } else if (is_type(node, "instance")) {
        import_instance(importer, node);
    } else {
        import_member(importer, node, CA_NONE);
    }
}
