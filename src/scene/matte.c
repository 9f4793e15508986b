#include "scene/matte.h"

#include "base/memory.h"
#include "geometry/triangle.h"

static bool is_constant(const ca_texture *textures, ca_texture_id id)
{
    return id == CA_NONE || textures[id].kind == CA_TEXTURE_CONSTANT;
}

/* The reflectance of a diffuse material, or its texture; false for any other material. */
static bool diffuse_reflectance(const ca_material *material, const ca_texture *textures, ca_rgb *reflectance,
                                ca_texture_id *pattern)
{
    if (material->kind != CA_MATERIAL_DIFFUSE) return false;
    const ca_texture_id id = material->as.diffuse.reflectance;
    *pattern = is_constant(textures, id) ? CA_NONE : id;
    *reflectance = id == CA_NONE || *pattern != CA_NONE ? ca_rgb_grey(0.5f) : textures[id].as.constant;
    return true;
}

static bool find_reflectances(const ca_material *materials, ca_material_id id, const ca_texture *textures,
                              ca_matte_shape *matte)
{
    const ca_material *top = &materials[id];
    matte->back_is_front = top->kind == CA_MATERIAL_TWOSIDED;
    const ca_material *front = matte->back_is_front ? &materials[top->as.twosided.front] : top;
    const bool has_back = matte->back_is_front && top->as.twosided.back != CA_NONE;
    const ca_material *back = has_back ? &materials[top->as.twosided.back] : front;
    return diffuse_reflectance(front, textures, &matte->reflectance[0], &matte->pattern[0]) &&
           diffuse_reflectance(back, textures, &matte->reflectance[1], &matte->pattern[1]);
}

static bool is_flat_mesh(const ca_shape *shape)
{
    return shape->kind == CA_SHAPE_MESH && !shape->as.mesh.mesh->normals;
}

ca_matte_shape *ca_matte_shapes_create(const ca_shape *shapes, uint32_t count, uint32_t world_count,
                                       const ca_material *materials, const ca_texture *textures)
{
    ca_matte_shape *mattes = ca_alloc_zeroed(count, sizeof *mattes);
    for (uint32_t i = 0; mattes && i < count; i++) {
        mattes[i].light = shapes[i].light;
        mattes[i].passes =
            ca_material_scatter(materials, shapes[i].material) & (CA_SCATTER_TRANSMISSION | CA_SCATTER_NULL);
        if (shapes[i].kind == CA_SHAPE_MESH) mattes[i].extent = shapes[i].as.mesh.extent;
        if (i >= world_count || !is_flat_mesh(&shapes[i]) || shapes[i].needs_tangents ||
            !find_reflectances(materials, shapes[i].material, textures, &mattes[i]))
            continue;
        mattes[i].is_patterned = mattes[i].pattern[0] != CA_NONE || mattes[i].pattern[1] != CA_NONE;
        mattes[i].is_matte = !mattes[i].is_patterned;
    }
    return mattes;
}

static ca_even_light even_light(const ca_shape *shape, ca_rgb radiance)
{
    const ca_rectangle *rectangle = &shape->as.mesh.rectangle;
    return (ca_even_light){.radiance = radiance,
                           .pdf_area = 1.0f / shape->area,
                           .is_even = true,
                           .is_plain = rectangle->is_plain,
                           .corner = rectangle->corner,
                           .end_x = rectangle->end_x,
                           .end_y = rectangle->end_y,
                           .large_distance2 = rectangle->exists ? rectangle->large_distance2 : -1.0f};
}

ca_even_light *ca_even_lights_create(const ca_light *lights, uint32_t count, const ca_texture *textures)
{
    ca_even_light *evens = ca_alloc_large(count, sizeof *evens);
    for (uint32_t i = 0; evens && i < count; i++) {
        const ca_light *light = &lights[i];
        evens[i] = (ca_even_light){0};
        if (light->kind != CA_LIGHT_AREA || !is_flat_mesh(light->as.area.shape) ||
            !is_constant(textures, light->as.area.radiance))
            continue;
        const ca_texture_id radiance = light->as.area.radiance;
        evens[i] = even_light(light->as.area.shape,
                              radiance == CA_NONE ? ca_rgb_grey(1.0f) : textures[radiance].as.constant);
    }
    return evens;
}

bool ca_even_light_sample_direct(const ca_even_light *even, const ca_light *light, ca_vec3 reference, ca_vec2 u,
                                 ca_light_direct *direct)
{
    if (!even->is_plain || ca_even_light_is_near(even, reference))
        return ca_light_sample_direct(light, reference, u, direct);
    ca_surface point;
    ca_plain_rectangle_position(even->corner, even->end_x, even->end_y, u, &point);
    point.ng = ca_normalize_any(ca_cross(ca_sub(even->end_x, even->corner), ca_sub(even->end_y, even->corner)));
    direct->radiance = even->radiance;
    return ca_light_direct_to_surface(&point, (ca_pdf_area){even->pdf_area}, reference, direct);
}
