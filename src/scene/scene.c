/* Compiling a description: shapes in world space, materials and lights prepared, the acceleration structure built. */
#include "scene/scene.h"

#include "base/hash.h"
#include "base/memory.h"
#include "base/processors.h"
#include "scene/compile.h"

#include <string.h>

/* ---- Materials, textures --------------------------------------------------------------------------------------- */

static void link_textures(ca_scene *scene)
{
    for (size_t i = 0; i < scene->desc.textures.count; i++) {
        ca_texture *texture = &scene->desc.textures.items[i];
        if (texture->kind == CA_TEXTURE_BITMAP)
            texture->as.bitmap.image = &scene->desc.images.items[texture->as.bitmap.image_index];
    }
}

/* Gives a diffuse material of that grey to the shapes without any, those that shine or those that do not. */
static ca_status add_default_material(ca_scene_desc *desc, bool shining, float grey, ca_error *error)
{
    bool needed = false;
    for (size_t i = 0; i < desc->shapes.count; i++)
        needed |= desc->shapes.items[i].material == CA_NONE && (desc->shapes.items[i].light != CA_NONE) == shining;
    if (!needed) return CA_OK;
    const ca_texture_id constant = ca_scene_desc_add_constant(desc, ca_rgb_grey(grey));
    if (constant == CA_NONE || !CA_TABLE_ADD(&desc->materials)) return ca_fail_memory(error, "materials");
    const uint32_t id = (uint32_t)desc->materials.count - 1;
    desc->materials.items[id].material = (ca_material){.kind = CA_MATERIAL_DIFFUSE, .as.diffuse = {constant}};
    for (size_t i = 0; i < desc->shapes.count; i++) {
        ca_shape_desc *shape = &desc->shapes.items[i];
        if (shape->material == CA_NONE && (shape->light != CA_NONE) == shining) shape->material = id;
    }
    return CA_OK;
}

/* Mitsuba's defaults. */
static ca_status add_default_materials(ca_scene_desc *desc, ca_error *error)
{
    CA_TRY(add_default_material(desc, false, 0.5f, error));
    return add_default_material(desc, true, 0.0f, error);
}

static ca_status compile_materials(ca_scene *scene, ca_error *error)
{
    CA_TRY(add_default_materials(&scene->desc, error));
    const uint32_t count = (uint32_t)scene->desc.materials.count;
    scene->materials = ca_alloc_zeroed(count, sizeof *scene->materials);
    if (!scene->materials) return ca_fail_memory(error, "materials");
    for (uint32_t i = 0; i < count; i++) scene->materials[i] = scene->desc.materials.items[i].material;
    for (uint32_t i = 0; i < count; i++) {
        scene->material_count = i + 1;
        CA_TRY(ca_material_prepare(&scene->materials[i], scene->desc.textures.items, error));
        if (ca_material_leaf_count(scene->materials, i) > CA_BSDF_MAX_LOBES)
            return ca_fail(error, CA_ERROR_SCENE, &scene->desc.materials.items[i].where,
                           "this material is a tree of more than %d leaves, too deep, or holds itself",
                           CA_BSDF_MAX_LOBES);
    }
    return CA_OK;
}

/* ---- All of it ------------------------------------------------------------------------------------------------- */

static ca_status compile_instances(ca_scene *scene, const uint32_t *group_first, ca_error *error)
{
    const uint32_t count = (uint32_t)scene->desc.instances.count;
    scene->instances = ca_alloc_zeroed(count, sizeof *scene->instances);
    scene->instance_ids = ca_alloc_zeroed(count, sizeof *scene->instance_ids);
    if (!scene->instances || !scene->instance_ids) return ca_fail_memory(error, "instances");
    for (uint32_t i = 0; i < count; i++) {
        const ca_instance_desc *desc = &scene->desc.instances.items[i];
        const uint32_t first = group_first[desc->group], end = group_first[desc->group + 1];
        if (first == end) continue; /* an empty group */
        ca_accel_instance *instance = &scene->instances[scene->instance_count];
        *instance = (ca_accel_instance){.first_shape = first, .shape_count = end - first};
        if (!ca_affine_from_matrix(&desc->to_world, &instance->map))
            return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this instance's to_world is singular or not affine");
        scene->instance_ids[scene->instance_count++] = desc->id;
    }
    return CA_OK;
}

static ca_status find_regular(ca_scene *scene, uint32_t world_count, ca_error *error)
{
    const ca_texture *textures = scene->desc.textures.items;
    scene->mattes =
        ca_matte_shapes_create(scene->shapes, scene->shape_count, world_count, scene->materials, textures);
    scene->even_lights = ca_even_lights_create(scene->lights, scene->light_count, textures);
    return scene->mattes && scene->even_lights ? CA_OK : ca_fail_memory(error, "the scene");
}

static ca_status compile(ca_scene *scene, const ca_scene *previous, uint32_t *group_first, const int *stop,
                         ca_error *error)
{
    uint32_t world_count = 0;
    scene->environment = CA_NONE;
    link_textures(scene);
    CA_TRY(compile_materials(scene, error));
    CA_TRY(ca_scene_compile_shapes(scene, group_first, &world_count, error));
    ca_scene_skip_uv(scene);
    CA_TRY(compile_instances(scene, group_first, error));
    ca_scene_compute_bounds(scene, world_count);
    CA_TRY(ca_scene_check_reach(scene, error));
    CA_TRY(ca_scene_compile_lights(scene, error));
    CA_TRY(find_regular(scene, world_count, error));
    return ca_accel_create_after(previous ? previous->accel : NULL, scene->shapes, scene->shape_count, world_count,
                                 scene->instances, scene->instance_count, ca_processors(), stop, &scene->accel,
                                 error);
}

ca_status ca_scene_compile(ca_scene_desc *desc, ca_scene **scene, ca_error *error)
{
    return ca_scene_compile_after(desc, NULL, NULL, scene, error);
}

ca_status ca_scene_compile_after(ca_scene_desc *desc, const ca_scene *previous, const int *stop, ca_scene **scene,
                                 ca_error *error)
{
    *scene = NULL;
    ca_scene *compiled = ca_alloc_zeroed(1, sizeof *compiled);
    uint32_t *group_first = ca_alloc_zeroed(desc->groups.count + 1, sizeof *group_first);
    if (!compiled || !group_first) {
        ca_free(compiled);
        ca_free(group_first);
        ca_scene_desc_destroy(desc);
        return ca_fail_memory(error, "the scene");
    }
    atomic_init(&compiled->references, 1);
    compiled->desc = *desc;
    memset(desc, 0, sizeof *desc);
    const ca_status status = compile(compiled, previous, group_first, stop, error);
    ca_free(group_first);
    if (status != CA_OK) {
        ca_scene_destroy(compiled);
        return status;
    }
    *scene = compiled;
    return CA_OK;
}

/* ---- Camera ---------------------------------------------------------------------------------------------------- */

ca_camera ca_scene_camera(const ca_scene *scene, uint32_t width, uint32_t height)
{
    const ca_camera_desc *desc = &scene->desc.camera;
    ca_camera camera = desc->camera;
    camera.width = width;
    camera.height = height;
    if (desc->place == CA_PLACE_OUTSIDE) ca_camera_move_out(&camera, scene->center, scene->radius);
    if (desc->place == CA_PLACE_ALL) ca_camera_cover(&camera, scene->center, scene->radius);
    if (ca_camera_has_field_of_view(&camera))
        ca_camera_set_tan_half_x(&camera,
                                 (float)ca_camera_tan_half_x(desc->fov_degrees, desc->fov_axis, width, height));
    ca_camera_prepare(&camera);
    return camera;
}

/* ---- Views ----------------------------------------------------------------------------------------------------- */

/* The first thing in a description that a view cannot have of its own; NULL: there is none. */
static const ca_location *find_more(const ca_scene_desc *desc)
{
    if (desc->shapes.count > 0) return &desc->shapes.items[0].where;
    if (desc->lights.count > 0) return &desc->lights.items[0].where;
    if (desc->materials.count > 0) return &desc->materials.items[0].where;
    if (desc->groups.count > 0) return &desc->groups.items[0].where;
    return desc->instances.count > 0 ? &desc->instances.items[0].where : NULL;
}

/* The tables of `whole`, with what a view may say. */
static ca_scene_desc seen_with(const ca_scene_desc *whole, const ca_scene_desc *own)
{
    ca_scene_desc desc = *whole;
    desc.strings = own->strings;
    desc.path = own->path;
    desc.notes = own->notes;
    desc.content_hash = ca_hash_add(whole->content_hash, own->content_hash);
    desc.camera = own->camera;
    desc.film = own->film;
    desc.sampler = own->sampler;
    desc.names_sampler = own->names_sampler;
    desc.samples_per_pixel = own->samples_per_pixel;
    if (own->integrator.name) desc.integrator = own->integrator;
    return desc;
}

ca_status ca_scene_view_create(ca_scene *scene, ca_scene_desc *desc, ca_scene **view, ca_error *error)
{
    const ca_location *more = find_more(desc);
    ca_scene *created = more ? NULL : ca_alloc_zeroed(1, sizeof *created);
    if (!created) {
        const ca_status status = more ? ca_fail(error, CA_ERROR_SCENE, more,
                                                "a view of a scene has a sensor and an integrator, and nothing else")
                                      : ca_fail_memory(error, "the view");
        ca_scene_desc_destroy(desc);
        return status;
    }
    memcpy(created, scene, sizeof *created);
    atomic_init(&created->references, 1);
    created->base = scene;
    created->desc = seen_with(&scene->desc, desc);
    created->own = *desc;
    *desc = (ca_scene_desc){0};
    atomic_fetch_add(&scene->references, 1);
    const ca_status status = ca_scene_check_reach(created, error);
    if (status == CA_OK)
        *view = created;
    else
        ca_scene_destroy(created);
    return status;
}

/* ---- The end --------------------------------------------------------------------------------------------------- */

static void destroy_whole(ca_scene *scene)
{
    ca_accel_destroy(scene->accel);
    ca_light_choice_destroy(&scene->light_choice);
    for (uint32_t i = 0; i < scene->light_count; i++) ca_light_release(&scene->lights[i]);
    for (uint32_t i = 0; i < scene->shape_count; i++)
        if (scene->shapes[i].kind == CA_SHAPE_MESH) ca_distribution_1d_destroy(&scene->shapes[i].as.mesh.triangles);
    for (uint32_t i = 0; i < scene->material_count; i++) ca_material_release(&scene->materials[i]);
    ca_free(scene->mattes);
    ca_free(scene->even_lights);
    ca_free(scene->lights);
    ca_free(scene->shapes);
    ca_free(scene->materials);
    ca_free(scene->instances);
    ca_free(scene->instance_ids);
    ca_scene_desc_destroy(&scene->desc);
    ca_free(scene);
}

void ca_scene_destroy(ca_scene *scene)
{
    while (scene && atomic_fetch_sub(&scene->references, 1) == 1) {
        ca_scene *base = scene->base;
        if (!base) {
            destroy_whole(scene);
            return;
        }
        ca_scene_desc_destroy(&scene->own);
        ca_free(scene);
        scene = base;
    }
}
