/* Rays of the caller's own against a scene's shapes: the public calls. */
#include "scene/scene.h"

#include <math.h>

static ca_vec3 vec3_at(const float v[3]) { return (ca_vec3){v[0], v[1], v[2]}; }

static void store(float to[3], ca_vec3 v) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }

/* Those that are not meet nothing. */
static bool is_ray(const ca_ray *ray)
{
    const ca_vec3 o = vec3_at(ray->origin), d = vec3_at(ray->direction);
    return isfinite(o.x + o.y + o.z) && isfinite(d.x + d.y + d.z) && ca_dot(d, d) > 0.0f && isfinite(ca_dot(d, d)) &&
           ray->t_min < ray->t_max;
}

static ca_ray_hit hit_of(const ca_scene *scene, const ca_ray *ray)
{
    const ca_vec3 origin = vec3_at(ray->origin), direction = vec3_at(ray->direction);
    ca_ray_hit found = {.t = INFINITY, .shape = CA_NONE, .primitive = CA_NONE, .instance = CA_NONE};
    ca_hit hit;
    if (!is_ray(ray) || !ca_accel_intersect(scene->accel, origin, direction, ray->t_min, ray->t_max, &hit))
        return found;
    ca_surface surface;
    ca_accel_surface(scene->accel, origin, direction, &hit, &surface);
    found.t = hit.t;
    store(found.position, surface.position);
    store(found.normal, surface.ng);
    store(found.shading_normal, surface.ns);
    found.uv[0] = surface.uv.x, found.uv[1] = surface.uv.y;
    found.shape = surface.shape, found.primitive = surface.primitive, found.instance = surface.instance;
    return found;
}

void ca_scene_intersect(const ca_scene *scene, const ca_ray *rays, size_t count, ca_ray_hit *hits)
{
    for (size_t i = 0; i < count; i++) hits[i] = hit_of(scene, &rays[i]);
}

void ca_scene_occluded(const ca_scene *scene, const ca_ray *rays, size_t count, bool *occluded)
{
    for (size_t i = 0; i < count; i++)
        occluded[i] = is_ray(&rays[i]) && ca_accel_occluded(scene->accel, vec3_at(rays[i].origin),
                                                            vec3_at(rays[i].direction), rays[i].t_min, rays[i].t_max);
}

/* Shapes of the world come first, then those of each group: as the scene is compiled. */
const char *ca_scene_shape_id(const ca_scene *scene, uint32_t shape)
{
    const ca_scene_desc *desc = &scene->desc;
    uint32_t next = 0;
    for (uint32_t pass = 0; pass <= desc->groups.count; pass++)
        for (size_t i = 0; i < desc->shapes.count; i++)
            if (desc->shapes.items[i].group == (pass == 0 ? CA_NONE : pass - 1) && next++ == shape)
                return desc->shapes.items[i].id;
    return NULL;
}

const char *ca_scene_instance_id(const ca_scene *scene, uint32_t instance)
{
    return instance < scene->instance_count ? scene->instance_ids[instance] : NULL;
}
