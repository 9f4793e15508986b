/* Lights, from the description's to those that are sampled. */
#include "scene/compile.h"

#include "base/memory.h"

static ca_status light_map(ca_affine *map, const ca_matrix *to_world, const ca_light_desc *desc, ca_error *error)
{
    if (ca_affine_from_matrix(to_world, map)) return CA_OK;
    return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this emitter's to_world is singular or not affine");
}

static ca_vec3 origin_of(const ca_affine *map) { return (ca_vec3){map->to[0][3], map->to[1][3], map->to[2][3]}; }

static ca_vec3 vec3_from_doubles(const double v[3]) { return (ca_vec3){(float)v[0], (float)v[1], (float)v[2]}; }

static ca_status compile_spot(ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    CA_TRY(light_map(&light->as.spot.map, &desc->as.spot.to_world, desc, error));
    light->as.spot.position = origin_of(&light->as.spot.map);
    light->as.spot.intensity = desc->as.spot.intensity;
    light->as.spot.texture = desc->as.spot.texture;
    light->as.spot.falloff = desc->as.spot.falloff;
    light->as.spot.cutoff = (float)(desc->as.spot.cutoff_degrees * (CA_PI_D / 180.0));
    light->as.spot.beam = (float)(desc->as.spot.beam_degrees * (CA_PI_D / 180.0));
    return CA_OK;
}

static ca_status compile_directional(ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    const ca_vec3 direction = vec3_from_doubles(desc->as.directional.direction);
    const float length = ca_length(direction);
    if (!(length > 0.0f) || !isfinite(length))
        return ca_fail(error, CA_ERROR_SCENE, &desc->where, "this directional light has no direction");
    light->as.directional.direction = ca_mul(direction, 1.0f / length);
    light->as.directional.irradiance = desc->as.directional.irradiance;
    return CA_OK;
}

static ca_status compile_projector(ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    CA_TRY(light_map(&light->as.projector.map, &desc->as.projector.to_world, desc, error));
    light->as.projector.position = origin_of(&light->as.projector.map);
    light->as.projector.picture = desc->as.projector.picture;
    light->as.projector.scale = desc->as.projector.scale;
    light->as.projector.tan_half_x = (float)desc->as.projector.tan_half_x;
    light->as.projector.tan_half_y = (float)desc->as.projector.tan_half_y;
    return CA_OK;
}

static ca_status light_from_desc(ca_scene *scene, ca_light *light, const ca_light_desc *desc, ca_error *error)
{
    *light = (ca_light){.kind = desc->kind, .textures = scene->desc.textures.items};
    switch (desc->kind) {
    case CA_LIGHT_AREA: light->as.area.radiance = desc->as.area.radiance; break;
    case CA_LIGHT_BEAM: light->as.beam.exitance = desc->as.beam.exitance; break;
    case CA_LIGHT_POINT:
        light->as.point.position = vec3_from_doubles(desc->as.point.position);
        light->as.point.intensity = desc->as.point.intensity;
        break;
    case CA_LIGHT_SPOT: return compile_spot(light, desc, error);
    case CA_LIGHT_DIRECTIONAL: return compile_directional(light, desc, error);
    case CA_LIGHT_PROJECTOR: return compile_projector(light, desc, error);
    case CA_LIGHT_CONSTANT: light->as.constant.radiance = desc->as.constant.radiance; break;
    case CA_LIGHT_ENVMAP:
        light->as.envmap.image = &scene->desc.images.items[desc->as.envmap.image];
        light->as.envmap.scale = desc->as.envmap.scale;
        return light_map(&light->as.envmap.map, &desc->as.envmap.to_world, desc, error);
    case CA_LIGHT_KIND_COUNT: break;
    }
    return CA_OK;
}

static void link_area_lights(ca_scene *scene)
{
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        const uint32_t light = scene->shapes[i].light;
        if (light == CA_NONE) continue;
        ca_light *l = &scene->lights[light];
        *(l->kind == CA_LIGHT_BEAM ? &l->as.beam.shape : &l->as.area.shape) = &scene->shapes[i];
    }
}

static ca_status note_environment(ca_scene *scene, uint32_t light, ca_error *error)
{
    const ca_light_kind kind = scene->lights[light].kind;
    if (kind != CA_LIGHT_CONSTANT && kind != CA_LIGHT_ENVMAP) return CA_OK;
    if (scene->environment != CA_NONE)
        return ca_fail(error, CA_ERROR_SCENE, &scene->desc.lights.items[light].where,
                       "a scene can have one environment (constant or envmap), and this is a second");
    scene->environment = light;
    return CA_OK;
}

ca_status ca_scene_compile_lights(ca_scene *scene, ca_error *error)
{
    const uint32_t count = (uint32_t)scene->desc.lights.count;
    scene->lights = ca_alloc_zeroed(count, sizeof *scene->lights);
    if (!scene->lights) return ca_fail_memory(error, "lights");
    for (uint32_t i = 0; i < count; i++)
        CA_TRY(light_from_desc(scene, &scene->lights[i], &scene->desc.lights.items[i], error));
    link_area_lights(scene);
    for (uint32_t i = 0; i < count; i++) {
        CA_TRY(note_environment(scene, i, error));
        scene->light_count = i + 1;
        CA_TRY(ca_light_prepare(&scene->lights[i], scene->center, scene->radius, error));
        if (!isfinite(scene->lights[i].power))
            return ca_fail(error, CA_ERROR_SCENE, &scene->desc.lights.items[i].where,
                           "the power of this light is not a finite number");
    }
    return ca_light_choice_create(&scene->light_choice, scene->lights, count, error);
}
