/* A scene as its author wrote it: editable tables, indices between them, and the place in the file where each thing
 * was said. Importers fill it, ca_scene_compile (scene.h) turns it into an immutable scene.
 *
 * Ownership: the description owns all tables, images, meshes and strings (strings live in its arena). Compiling moves
 * images and meshes into the scene. */
#ifndef CA_SCENE_DESCRIPTION_H
#define CA_SCENE_DESCRIPTION_H

#include "base/memory.h"
#include "camera/camera.h"
#include "sampling/filter.h"
#include "light/light.h"
#include "material/material.h"
#include "sampling/sampler.h"

/* A table that grows. Elements move when it does: keep indices, not pointers. */
#define CA_TABLE(type)                                                                                             \
    struct {                                                                                                       \
        type *items;                                                                                               \
        size_t count, capacity;                                                                                    \
    }

/* Appends a zeroed element; false when out of memory. The new element is table.items[table.count - 1]. */
#define CA_TABLE_ADD(table)                                                                                          \
    ((table)->items = ca_table_room((table)->items, (table)->count, &(table)->capacity, sizeof *(table)->items),     \
     ca_table_append((table)->items, &(table)->count, (table)->capacity, sizeof *(table)->items))
/* Its two steps: `items` with room for one more, or as they were when out of memory; the new element, if there is
 * room. */
void *ca_table_room(void *items, size_t count, size_t *capacity, size_t size);
bool ca_table_append(void *items, size_t *count, size_t capacity, size_t size);

typedef CA_TABLE(const char *) ca_path_table;

typedef struct ca_material_desc {
    ca_material material;
    ca_location where;
    const char *id; /* NULL where it has none */
} ca_material_desc;

typedef struct ca_shape_desc {
    ca_shape_kind kind;
    union { /* the member of the kind's name, in the shape's own space; a disk is the unit disk */
        struct {
            uint32_t index; /* in meshes; shapes that share one have it in the same place */
        } mesh;
        struct {
            double center[3];
            float radius;
        } sphere;
        struct {
            double p0[3], p1[3]; /* ends of its axis */
            float radius;
        } cylinder;
        struct {
            uint32_t index; /* in curves, each used by one shape */
        } curve;
        struct {
            uint32_t index; /* in grids, each used by one shape */
        } sdf;
    } as;
    ca_matrix to_world; /* affine; of a group's member: to the group's space */
    bool flip_normals;
    uint32_t material; /* index in materials; CA_NONE: diffuse, grey of 0.5 or, of a shape with a light, black */
    uint32_t light;    /* index in lights (an area light), or CA_NONE */
    uint32_t group;    /* index in groups, or CA_NONE: a shape of the world */
    ca_location where;
    const char *id;
} ca_shape_desc;

typedef struct ca_group_desc {
    ca_location where;
    const char *id;
} ca_group_desc;

typedef struct ca_instance_desc {
    uint32_t group;
    ca_matrix to_world;
    ca_location where;
    const char *id; /* NULL where it has none */
} ca_instance_desc;

/* As ca_light, but shapes and images by index. */
typedef struct ca_light_desc {
    ca_light_kind kind;
    union { /* the member of the kind's name */
        struct {
            ca_texture_id radiance; /* its shape says that it is its light */
        } area;
        struct {
            ca_texture_id exitance; /* CA_NONE: 1 */
        } beam;
        struct {
            double position[3];
            ca_rgb intensity;
        } point;
        struct {
            ca_matrix to_world; /* z is the axis */
            ca_rgb intensity;
            ca_texture_id texture;               /* or CA_NONE */
            double cutoff_degrees, beam_degrees; /* half angles */
            ca_spot_falloff falloff;
        } spot;
        struct {
            double direction[3]; /* the way the light travels */
            ca_rgb irradiance;
        } directional;
        struct {
            ca_matrix to_world;
            ca_texture_id picture;
            ca_rgb scale;
            double tan_half_x, tan_half_y;
        } projector;
        struct {
            ca_rgb radiance;
        } constant;
        struct {
            ca_matrix to_world;
            uint32_t image; /* index in images */
            ca_rgb scale;
        } envmap;
    } as;
    ca_location where;
} ca_light_desc;

typedef struct ca_film_desc {
    uint32_t width, height;                 /* full size */
    uint32_t crop_x, crop_y, crop_width, crop_height; /* the part to render; the whole film by default */
    ca_filter filter;
    bool is_fixed; /* a meter's, whose size says what is measured */
} ca_film_desc;

/* What the scene's bounds change in a sensor. */
typedef enum ca_camera_place {
    CA_PLACE_OWN,     /* nothing */
    CA_PLACE_OUTSIDE, /* it is moved back along its axis, out of the scene */
    CA_PLACE_ALL      /* so, and it covers the scene's bounding sphere */
} ca_camera_place;

typedef struct ca_camera_desc {
    ca_camera camera; /* map, size and everything but what ca_camera_prepare makes */
    ca_camera_place place;
    ca_fov_axis fov_axis;
    double fov_degrees; /* 0 for the orthographic camera */
    uint32_t sensor;    /* which <sensor> of its scene it is, counted from 0 */
    ca_location where;
} ca_camera_desc;

/* Of a scene that names none. */
#define CA_DEFAULT_INTEGRATOR "auto"

/* What the scene's <integrator> says. The names of parameters are the integrator's; `values` keep them all as numbers
 * or text until the integrator that is finally chosen reads them (integrator.h). */
typedef struct ca_parameter {
    const char *name;
    enum { CA_PARAMETER_NUMBER, CA_PARAMETER_BOOLEAN, CA_PARAMETER_TEXT } kind;
    double number; /* also 0 or 1 for a boolean */
    const char *text;
    ca_location where;
} ca_parameter;

/* What a layer shows of the surface that is seen first (render/aov_layers.h). */
typedef enum ca_aov_kind {
    CA_AOV_DEPTH,
    CA_AOV_POSITION,
    CA_AOV_UV,
    CA_AOV_GEO_NORMAL,
    CA_AOV_SH_NORMAL,
    CA_AOV_DP_DU,
    CA_AOV_DP_DV,
    CA_AOV_PRIM_INDEX,
    CA_AOV_SHAPE_INDEX,
    CA_AOV_ALBEDO,
    CA_AOV_KIND_COUNT
} ca_aov_kind;

enum { CA_MAX_AOVS = 16, CA_AOV_NAME_SIZE = 48 }; /* the names' sizes with their end */

typedef struct ca_aov_desc {
    const char *name; /* of its channels but for the last part */
    ca_aov_kind kind;
} ca_aov_desc;

typedef struct ca_integrator_desc {
    const char *name; /* NULL: none given, CA_DEFAULT_INTEGRATOR */
    CA_TABLE(ca_parameter) parameters;
    CA_TABLE(ca_aov_desc) aovs; /* at most CA_MAX_AOVS */
    ca_location where;
} ca_integrator_desc;

typedef struct ca_scene_desc {
    ca_arena strings;
    const char *path; /* of the scene file */
    ca_path_table files; /* all that it was read from: scene, includes, meshes, textures, spectra; may repeat */
    CA_TABLE(const char *) notes; /* what is read otherwise than written; no sentence twice, wherever it was said */
    uint64_t content_hash; /* of all files it was read from and all definitions, wherever they lie */
    CA_TABLE(ca_texture) textures;
    CA_TABLE(ca_image) images;
    CA_TABLE(ca_material_desc) materials;
    CA_TABLE(ca_mesh) meshes;
    CA_TABLE(ca_curve *) curves;
    CA_TABLE(ca_sdf_grid *) grids;
    CA_TABLE(ca_shape_desc) shapes;
    CA_TABLE(ca_group_desc) groups;
    CA_TABLE(ca_instance_desc) instances;
    CA_TABLE(ca_light_desc) lights;
    ca_camera_desc camera;
    ca_film_desc film;
    ca_sampler sampler;
    bool names_sampler; /* false: `sampler` is the default */
    uint32_t samples_per_pixel;
    ca_integrator_desc integrator;
} ca_scene_desc;

/* Mitsuba's defaults: no shapes, 768 x 576 film with a gaussian filter, a 50 mm lens (of 35 mm film), 4
 * samples (see scenes.md). */
void ca_scene_desc_init(ca_scene_desc *desc);
void ca_scene_desc_destroy(ca_scene_desc *desc);

/* The map whose z axis is p0 -> p1 and that takes the unit cylinder to one of that radius. */
ca_matrix ca_cylinder_frame(const double p0[3], const double p1[3], double radius);
/* Is the mapped unit cylinder one? Its ends must be circles across its axis. */
bool ca_is_round_cylinder(const ca_matrix *map);

/* Texture constants: the id of a new one, or CA_NONE when out of memory. */
ca_texture_id ca_scene_desc_add_constant(ca_scene_desc *desc, ca_rgb value);

#endif
