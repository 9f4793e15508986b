/* What the files of the pbrt reader share: the state of one reading. Failures are the importer's and sticky.
 *
 * Transforms and names follow pbrt: the current transform takes an object's coordinates to the world's. pbrt's world
 * is left-handed and Mitsuba's right-handed, which means nothing for coordinates as such: what a picture shows on the
 * left depends on the camera alone, whose x axis is turned round (camera.c). */
#ifndef CA_IMPORT_PBRT_READER_H
#define CA_IMPORT_PBRT_READER_H

#include "import/pbrt/parameters.h"
#include "import/tree_build.h"

enum {
    CA_PBRT_MAX_INCLUDE_DEPTH = 16,
    CA_PBRT_MAX_INCLUDES = 1024,
    CA_PBRT_MAX_OPEN_STATES = 4096,
    CA_PBRT_MAX_MADE_TRIANGLES = 1 << 24, /* of round shapes and subdivided meshes, in the whole scene */
    CA_PBRT_MAX_TEXT = 1 << 28,           /* bytes of all files */
};

/* What an AreaLightSource says. */
typedef struct ca_pbrt_area_light {
    bool shines;
    double radiance[3];
    double power; /* 0: as `radiance`; else what each of the shapes emits in all */
    bool two_sided;
    const char *picture; /* id of a texture, or NULL */
    ca_location where;
} ca_pbrt_area_light;

typedef enum ca_pbrt_target {
    CA_PBRT_FOR_SHAPES,
    CA_PBRT_FOR_LIGHTS,
    CA_PBRT_FOR_MATERIALS,
    CA_PBRT_FOR_MEDIA,
    CA_PBRT_FOR_TEXTURES,
    CA_PBRT_TARGET_COUNT
} ca_pbrt_target;

/* What AttributeBegin keeps. */
typedef struct ca_pbrt_state {
    ca_matrix ctm;
    bool reverses;        /* orientation */
    const char *material; /* id in the tree */
    bool is_interface;    /* that material is nothing */
    ca_pbrt_area_light light;
    const ca_pbrt_preset *presets[CA_PBRT_TARGET_COUNT];
    uint32_t space;       /* of colours */
    bool start_is_active; /* ActiveTransform: transforms for the end of the shutter's time change nothing */
} ca_pbrt_state;

typedef enum ca_pbrt_open { CA_PBRT_OPEN_ATTRIBUTES, CA_PBRT_OPEN_TRANSFORM, CA_PBRT_OPEN_OBJECT } ca_pbrt_open;

typedef struct ca_pbrt_saved {
    ca_pbrt_state state;
    ca_pbrt_open kind;
    ca_location where;
} ca_pbrt_saved;

/* Something with a name: a material, texture, object or coordinate system. */
typedef struct ca_pbrt_named {
    const char *name;
    const char *id;   /* in the tree; of a coordinate system NULL */
    bool flag;        /* of a material: it is nothing; of an object: it has shapes; of a texture: it is constant */
    bool is_bright;   /* of a texture: it may be over 1 */
    double value[3];  /* of a constant texture */
    ca_matrix matrix; /* of a coordinate system */
} ca_pbrt_named;

typedef CA_TABLE(ca_pbrt_named) ca_pbrt_names;

/* A mesh as the tree has it. */
typedef struct ca_pbrt_mesh {
    const char *name;
    bool has_normals;
} ca_pbrt_mesh;

/* Curves of one material, one after another in the world or in one object, are one shape. */
typedef struct ca_pbrt_curves {
    ca_xml_node *shape;   /* NULL: none is being made */
    const char *material; /* NULL: no other curve joins */
    const ca_xml_node *group;
    float *points;          /* four to a segment, of the current transform: x y z and the radius */
    size_t count, capacity; /* of floats */
} ca_pbrt_curves;

typedef struct ca_pbrt {
    ca_importer *importer;
    ca_tree tree;
    ca_pbrt_params params; /* of the directive that is read */
    uint32_t version;      /* 3 or 4 */
    bool in_world, ended;
    bool has_default_material;
    bool has_pictures; /* there are textures that vary, or surfaces with a direction: coordinates matter */
    ca_pbrt_state state;
    CA_TABLE(ca_pbrt_saved) saved;
    ca_pbrt_names materials, number_textures, color_textures, objects, systems;
    ca_xml_node *group; /* the object that is being defined, or NULL */
    bool group_has_shapes;
    uint32_t next_id;
    /* Before WorldBegin. */
    ca_matrix camera_to_world;
    double exposure; /* factor of all light, by the film's sensitivity */
    ca_xml_node *sensor, *film, *sampler, *integrator, *filter;
    int64_t samples;    /* of the sampler, for each pixel */
    int64_t iterations; /* of sppm, which become the samples; 0: it has none of its own */
    double screen[4]; /* the camera's window, x0 x1 y0 y1; with has_screen */
    bool has_screen;
    double camera_fov, lens_radius, focal_distance, frame_aspect; /* frame_aspect 0: the film's */
    enum { CA_PBRT_PERSPECTIVE, CA_PBRT_ORTHOGRAPHIC, CA_PBRT_REALISTIC } camera;
    ca_location camera_where;
    uint32_t film_width, film_height;
    double film_diagonal;
    /* Of the realistic camera; diameters in mm. */
    const char *lens_file;
    double aperture_diameter, shutter_time;
    bool has_aperture, simple_weighting;
    /* Meshes from files: the arrays that they became, by what tells the files (reuse.h); and the latest of any. */
    CA_TABLE(ca_pbrt_mesh) arrays;
    ca_key_table files;
    ca_pbrt_mesh last_array;
    ca_pbrt_curves curves;
    /* Spent. */
    uint32_t include_depth, include_count, made_triangles;
    size_t text_bytes;
} ca_pbrt;

/* ---- Names (names.c), files (pbrt.c) --------------------------------------------------------------------------- */

/* The latest of that name; NULL where there is none. */
ca_pbrt_named *ca_pbrt_name(ca_pbrt_names *names, const char *name);
/* A new one, or the same again, emptied; NULL after failing. */
ca_pbrt_named *ca_pbrt_define(ca_pbrt *p, ca_pbrt_names *names, const char *name);
/* Fails because a name is unknown, with the nearest of the table. */
void ca_pbrt_fail_name(ca_pbrt *p, const ca_location *where, const char *what, const char *name,
                       const ca_pbrt_names *names);
/* "WHAT NAME", made different from all others; name may be NULL. NULL after failing. */
const char *ca_pbrt_new_id(ca_pbrt *p, const char *what, const char *name);

/* A file that a parameter names, as a path that can be opened; NULL after failing. */
const char *ca_pbrt_file(ca_pbrt *p, const char *name);

/* ---- Colours (colors.c) ---------------------------------------------------------------------------------------- */

enum { CA_PBRT_SPACE_COUNT = 4 };
extern const char *const ca_pbrt_space_names[CA_PBRT_SPACE_COUNT];

/* A parameter as linear Rec. 709. Reflectances are cut to [0, 1]. False where it is missing. */
bool ca_pbrt_color(ca_pbrt *p, const char *name, ca_color_role role, double rgb[3]);
/* A light's: of version 4 a spectrum is brought to a luminance of 1. */
bool ca_pbrt_light_color(ca_pbrt *p, const char *name, double rgb[3]);
/* An index of refraction: a number or the name of a glass. */
double ca_pbrt_index(ca_pbrt *p, const char *name, double fallback);

/* ---- Textures (textures.c) ------------------------------------------------------------------------------------- */

void ca_pbrt_read_texture(ca_pbrt *p, const char *name, const char *type, const char *kind);

/* The value of a parameter that may be a texture. */
typedef struct ca_pbrt_value {
    const char *id; /* of a texture; NULL: constant */
    bool is_bright; /* a texture that may be over 1 */
    double rgb[3];
} ca_pbrt_value;

ca_pbrt_value ca_pbrt_color_value(ca_pbrt *p, const char *name, double fallback);
/* The value, or a texture of its values, cut to [0, 1]. */
ca_pbrt_value ca_pbrt_cut(ca_pbrt *p, const ca_pbrt_value *value);
/* Cut, whatever the texture says. */
ca_pbrt_value ca_pbrt_reflectance_value(ca_pbrt *p, const char *name, double fallback);
ca_pbrt_value ca_pbrt_number_value(ca_pbrt *p, const char *name, double fallback);
static inline bool ca_pbrt_is(const ca_pbrt_value *value, double number)
{
    return !value->id && value->rgb[0] == number && value->rgb[1] == number && value->rgb[2] == number;
}
/* As a parameter of an object in the tree. */
void ca_pbrt_put_color(ca_pbrt *p, ca_xml_node *object, const char *name, const ca_pbrt_value *value);
void ca_pbrt_put_number(ca_pbrt *p, ca_xml_node *object, const char *name, const ca_pbrt_value *value);
/* The value times a number. */
ca_pbrt_value ca_pbrt_scaled(ca_pbrt *p, const ca_pbrt_value *value, double factor);
/* Of a texture: its values to that power, which is positive. */
ca_pbrt_value ca_pbrt_power(ca_pbrt *p, const ca_pbrt_value *value, double exponent);
/* The picture that a parameter names; false after failing. */
bool ca_pbrt_read_picture(ca_pbrt *p, const char *name, ca_image_encoding encoding, ca_image *image);
/* A bitmap in the tree, for a parameter of that name (NULL: with the id). */
ca_xml_node *ca_pbrt_add_bitmap(ca_pbrt *p, ca_xml_node *parent, const char *name, const char *file, bool raw);

/* ---- Materials (materials.c, old_materials.c) ------------------------------------------------------------------ */

/* The material of a type from the directive's parameters, as a new object of the tree; its id, NULL after failing. */
const char *ca_pbrt_read_material(ca_pbrt *p, const char *type, const char *name, bool *is_interface);

/* ---- Shapes (shapes.h; meshes.c) ------------------------------------------------------------------------------- */

void ca_pbrt_read_shape(ca_pbrt *p, const char *type);
/* Takes triangles from the budget of made ones; false after failing. */
bool ca_pbrt_spend_triangles(ca_pbrt *p, size_t count);

/* A surface over the unit square: position, normal (towards the outside) at (u, v). */
typedef struct ca_pbrt_surface {
    void (*at)(const void *of, double u, double v, double position[3], double normal[3]);
    const void *of;
    uint32_t columns, rows; /* of quads */
} ca_pbrt_surface;

/* As a mesh with normals and pbrt's uv, whose v runs against Mitsuba's; false after failing. */
bool ca_pbrt_make_surface(ca_pbrt *p, const ca_pbrt_surface *surface, ca_mesh *mesh);
/* Loop subdivision of a control mesh, pushed to the limit; no uv. */
bool ca_pbrt_subdivide(ca_pbrt *p, const double *points, size_t point_count, const double *indices,
                       size_t index_count, uint32_t levels, ca_mesh *mesh);

/* ---- Curves (curves.c) ----------------------------------------------------------------------------------------- */

void ca_pbrt_begin_curves(ca_pbrt *p, ca_xml_node *shape, const char *material);
/* Does a curve of that material join those before it? */
bool ca_pbrt_goes_on_with_curves(const ca_pbrt *p, const char *material);
void ca_pbrt_read_curve(ca_pbrt *p);
void ca_pbrt_end_curves(ca_pbrt *p);

/* ---- Lights (lights.c, light_pictures.c) ----------------------------------------------------------------------- */

void ca_pbrt_read_light(ca_pbrt *p, const char *type);
void ca_pbrt_read_area_light(ca_pbrt *p, const char *type);
/* infinite with a picture, projection and goniometric, which are made of pictures. */
void ca_pbrt_read_sky(ca_pbrt *p, const char *file, const double factor[3]);
void ca_pbrt_read_projection(ca_pbrt *p);
void ca_pbrt_read_goniometric(ca_pbrt *p);

/* ---- Before the world (options.c) ------------------------------------------------------------------------------ */

void ca_pbrt_read_camera(ca_pbrt *p, const char *type);
void ca_pbrt_read_film(ca_pbrt *p, const char *type);
void ca_pbrt_read_filter(ca_pbrt *p, const char *type);
void ca_pbrt_read_sampler(ca_pbrt *p, const char *type);
void ca_pbrt_read_integrator(ca_pbrt *p, const char *type);
/* At WorldBegin: the sensor with all that was said. */
void ca_pbrt_finish_options(ca_pbrt *p);
/* The camera's scale, which the sensor's map cannot have, and the map without it; pbrt's x is to the right. */
double ca_pbrt_split_camera_map(ca_pbrt *p, ca_matrix *map);

/* ---- Camera "realistic" (lens_camera.c) ------------------------------------------------------------------------ */

void ca_pbrt_read_lens_camera(ca_pbrt *p);
/* The sensor; and the exposure becomes what the lens makes it. */
void ca_pbrt_put_lens_camera(ca_pbrt *p);

#endif
