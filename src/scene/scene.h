/* The immutable scene that is rendered: compiled from a description, shared by all threads.
 *
 * Layout: tables with indices between them; the world's shapes come first, then those of each shape group together.
 * Ownership: the scene owns everything it points to, meshes, images and acceleration structures together with the
 * versions that share them; a view owns its camera, film, sampler and integrator, and the last one that is destroyed
 * takes the rest along. */
#ifndef CA_SCENE_SCENE_H
#define CA_SCENE_SCENE_H

#include "geometry/accel.h"
#include "light/light_choice.h"
#include "material/bsdf.h"
#include "scene/description.h"
#include "scene/matte.h"

#include <stdatomic.h>

struct ca_scene {
    ca_scene *base;         /* whose tables a view has; NULL: they are its own */
    atomic_uint references; /* its owner's and its views' */
    ca_scene_desc own;      /* of a view: what it owns of its desc */
    ca_scene_desc desc; /* film, sampler, integrator and strings; its images, meshes and textures are used in place */
    ca_material *materials;
    uint32_t material_count;
    ca_shape *shapes;
    uint32_t shape_count;
    ca_accel_instance *instances;
    const char **instance_ids; /* [instance_count]; NULL: it has none */
    uint32_t instance_count;
    ca_light *lights;
    uint32_t light_count;
    uint32_t environment; /* index of the light that shines from all around (constant, envmap), or CA_NONE */
    ca_light_choice light_choice;
    ca_matte_shape *mattes;     /* [shape_count] */
    ca_even_light *even_lights; /* [light_count] */
    ca_accel *accel;
    ca_vec3 low, high; /* world bounds of the shapes */
    ca_vec3 center;    /* bounding sphere */
    float radius;
};

/* Takes the description over (also on failure) and leaves *desc empty. */
ca_status ca_scene_compile(ca_scene_desc *desc, ca_scene **scene, ca_error *error);
/* The same for the next version of a scene (NULL: it is the first), which shares the acceleration structures that
 * would be the same again (accel.h); gives up soon when asked to (base/stop.h). */
ca_status ca_scene_compile_after(ca_scene_desc *desc, const ca_scene *previous, const int *stop, ca_scene **scene,
                                 ca_error *error);
/* The scene with the camera, film and sampler of `desc`, and its integrator if that has a name. Takes the description
 * over. Errors: CA_ERROR_SCENE where there is more in it, CA_ERROR_MEMORY. Threads: views of one scene may be made
 * and destroyed by several at once. */
ca_status ca_scene_view_create(ca_scene *scene, ca_scene_desc *desc, ca_scene **view, ca_error *error);
void ca_scene_destroy(ca_scene *scene);

/* The scene's camera for a film of another size: the field of view stays along the axis it was given for. */
ca_camera ca_scene_camera(const ca_scene *scene, uint32_t width, uint32_t height);

#endif
