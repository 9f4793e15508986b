/* What the files of the glTF reader share: the state, members of JSON objects with their checks, and a function for
 * each kind of thing. Failures are the importer's and sticky (importer.h); messages name the JSON path.
 *
 * Facts about the format are from the glTF 2.0 specification and the READMEs of the KHR extensions. */
#ifndef CA_IMPORT_GLTF_READER_H
#define CA_IMPORT_GLTF_READER_H

#include "import/gltf/json.h"
#include "import/tree_build.h"

/* Bytes of a buffer or of an image. */
typedef struct ca_gltf_bytes {
    const unsigned char *data; /* NULL: not read yet */
    size_t size;
} ca_gltf_bytes;

/* How pixels become the numbers of a parameter. */
typedef enum ca_gltf_pixels {
    CA_GLTF_COLOR,   /* sRGB, times three factors */
    CA_GLTF_CHANNEL, /* one linear channel, times a factor */
    CA_GLTF_CUT,     /* 1 where one linear channel times a factor is at least the second factor, else 0 */
    CA_GLTF_NORMAL,  /* a normal map whose x and y are scaled */
    CA_GLTF_GLOSS,   /* of the clearcoat: from a channel that is a roughness */
    CA_GLTF_LARGEST, /* sRGB, times three factors: the largest component */
    CA_GLTF_METAL,   /* the same: which share of a metal beside a dielectric reflects so much straight on */
    CA_GLTF_HUE,     /* the same: the colour whose largest component is 1; black stays black */
    CA_GLTF_REST,    /* 1 without one linear channel times a factor */
} ca_gltf_pixels;

typedef struct ca_gltf_bake {
    uint32_t image; /* in "images" */
    ca_gltf_pixels pixels;
    uint32_t channel;
    double factors[3];
} ca_gltf_bake;

typedef struct ca_gltf_baked {
    ca_gltf_bake bake;
    const char *name; /* of the bitmap */
} ca_gltf_baked;

/* A material as it was made for meshes with or without colours at their corners. */
typedef struct ca_gltf_material {
    bool done;
    const char *id;       /* of its <bsdf> */
    uint32_t uv_set;      /* which texture coordinates it wants; CA_NONE: none */
    const char *radiance; /* id of a texture, if it shines by one */
    double emission[3];   /* else what it shines by */
    bool shines;
} ca_gltf_material;

/* A primitive of a mesh as an array of the importer. */
typedef struct ca_gltf_primitive {
    const char *array; /* its name; NULL: there is nothing to show */
    const ca_gltf_material *material;
    bool flat;    /* it has no normals */
    double low[3], high[3];
} ca_gltf_primitive;

typedef struct ca_gltf_mesh {
    uint32_t users;    /* nodes that show it */
    const char *group; /* id of its <shape type="shapegroup">; NULL: it has none */
    ca_gltf_primitive *primitives; /* NULL: not made yet */
    uint32_t count;
} ca_gltf_mesh;

/* An array of the root, which is found once. */
typedef struct ca_gltf_table {
    const char *name;
    const ca_gltf_value *array; /* NULL: there is none */
} ca_gltf_table;

/* Objects that are asked for members have no more of them, so that asking often takes no time. */
enum { CA_GLTF_MAX_MEMBERS = 128, CA_GLTF_MAX_TABLES = 16, CA_GLTF_MAX_UNREAD = 32 };

typedef struct ca_gltf_image {
    ca_gltf_bytes bytes;
    const char *path; /* NULL: data */
} ca_gltf_image;

typedef struct ca_gltf {
    ca_importer *importer;
    ca_tree tree;
    const ca_gltf_value *root;
    bool is_binary;         /* .glb: places in the text help nobody */
    ca_bytes file;          /* owned */
    ca_gltf_bytes chunk;    /* of a .glb, in `file` */
    ca_gltf_bytes *buffers; /* as many as "buffers" has, in the document's arena */
    ca_gltf_image *images;  /* as many as "images" has, likewise */
    ca_gltf_table tables[CA_GLTF_MAX_TABLES];
    size_t table_count;
    uint32_t camera_count;
    const char *unread[CA_GLTF_MAX_UNREAD]; /* extensions of materials that were noted */
    size_t unread_count;
    CA_TABLE(ca_bytes) owned;
    CA_TABLE(ca_gltf_baked) baked;
    ca_gltf_material *materials[2]; /* without and with colours; one more than "materials" has: the default */
    ca_gltf_mesh *meshes;
    CA_TABLE(const ca_gltf_primitive *) arrays; /* a primitive of each array, and which by its accessors: */
    ca_key_table known_arrays;
    bool *seen; /* nodes */
    bool lit;   /* something shines */
    double low[3], high[3]; /* bounds of what is shown */
} ca_gltf;

/* ---- Values (values.c) ----------------------------------------------------------------------------------------- */

/* A failure at a value; its JSON path stands before the message. */
void ca_gltf_fail(ca_gltf *g, const ca_gltf_value *value, const char *format, ...) CA_PRINTF(3, 4);
/* What is read otherwise than it is written; said once, wherever it is. */
void ca_gltf_note(ca_gltf *g, const ca_gltf_value *value, const char *format, ...) CA_PRINTF(3, 4);
/* The place of what is made from now on. */
void ca_gltf_at(ca_gltf *g, const ca_gltf_value *value);
void *ca_gltf_alloc(ca_gltf *g, size_t count, size_t size);
const char *ca_gltf_format(ca_gltf *g, const char *format, ...) CA_PRINTF(2, 3);

/* Members of an object, which may be NULL; each fails where the member is of another kind. NULL: it has none. */
const ca_gltf_value *ca_gltf_member(ca_gltf *g, const ca_gltf_value *object, const char *key);
const ca_gltf_value *ca_gltf_object(ca_gltf *g, const ca_gltf_value *object, const char *key);
const ca_gltf_value *ca_gltf_array(ca_gltf *g, const ca_gltf_value *object, const char *key);
const ca_gltf_value *ca_gltf_extension(ca_gltf *g, const ca_gltf_value *object, const char *name);
double ca_gltf_number(ca_gltf *g, const ca_gltf_value *object, const char *key, double fallback, double low,
                      double high);
bool ca_gltf_boolean(ca_gltf *g, const ca_gltf_value *object, const char *key, bool fallback);
const char *ca_gltf_text(ca_gltf *g, const ca_gltf_value *object, const char *key, const char *fallback);
/* A whole number up to 2^53. */
uint64_t ca_gltf_count(ca_gltf *g, const ca_gltf_value *object, const char *key, uint64_t fallback);
/* `count` numbers; false where there are none, and `numbers` stays. */
bool ca_gltf_numbers(ca_gltf *g, const ca_gltf_value *object, const char *key, double *numbers, uint32_t count);
/* The element of the root's array `table` that the member counts. */
const ca_gltf_value *ca_gltf_reference(ca_gltf *g, const ca_gltf_value *object, const char *key, const char *table);
/* The root's array of that name (a literal); NULL where it has none. And how many elements it has. */
const ca_gltf_value *ca_gltf_table_of(ca_gltf *g, const char *name);
uint32_t ca_gltf_table_size(ca_gltf *g, const char *table);

/* ---- Bytes (container.c) --------------------------------------------------------------------------------------- */

/* Opens the file and reads its JSON. */
void ca_gltf_open(ca_gltf *g);
/* The bytes of a buffer view; data is NULL after failing. */
ca_gltf_bytes ca_gltf_view(ca_gltf *g, const ca_gltf_value *view, size_t *stride);
/* The file that a "uri" names, with %20 and its like as characters; NULL after failing. */
const char *ca_gltf_file_name(ca_gltf *g, const ca_gltf_value *owner, const char *uri);
/* What a "uri" names: a file beside the scene or the data in it. *path is the file's name, NULL for data. */
ca_gltf_bytes ca_gltf_uri(ca_gltf *g, const ca_gltf_value *owner, const char *uri, const char *what,
                          const char **path);

/* ---- Accessors (accessors.c) ----------------------------------------------------------------------------------- */

/* How many elements; 0 after failing. */
size_t ca_gltf_element_count(ca_gltf *g, const ca_gltf_value *accessor);
/* All elements as numbers, `components` each (of which a VEC3 where 4 are wanted gives three, and 1); with normalised
 * integers as fractions. `values` has room for all. False after failing. */
bool ca_gltf_read_floats(ca_gltf *g, const ca_gltf_value *accessor, uint32_t components, float *values);
/* Whole numbers below `limit`. */
bool ca_gltf_read_indices(ca_gltf *g, const ca_gltf_value *accessor, size_t limit, uint32_t *values);

/* ---- Materials (materials.c, textures.c) ----------------------------------------------------------------------- */

/* The material of a primitive, made once. NULL after failing. */
const ca_gltf_material *ca_gltf_material_of(ca_gltf *g, const ca_gltf_value *primitive, bool colored);
/* Linear colour and alpha that colours at corners are multiplied with. */
void ca_gltf_base_color(ca_gltf *g, const ca_gltf_value *material, double rgba[4]);

/* `clearcoat_gloss` of principled, which takes alpha, here the square of a roughness, from 0.1 to 0.001. */
double ca_gltf_gloss(double roughness);

/* What the dielectric of a material reflects straight on, if nothing else is said; and the share of a metal, which
 * reflects all, beside it, so that both reflect `reflectance` together. */
#define CA_GLTF_DIELECTRIC 0.04
double ca_gltf_metal_share(double reflectance);

/* Appends <texture name="NAME"> to the object for a textureInfo, or a texture with an id of its own to the scene
 * (name NULL). All textures of a material must want the same coordinates: *uv_set. */
void ca_gltf_texture(ca_gltf *g, const ca_gltf_value *info, const ca_gltf_bake *bake, ca_xml_node *object,
                     const char *name, const char *id, uint32_t *uv_set);

/* ---- Shapes (meshes.c) ----------------------------------------------------------------------------------------- */

/* The shapes of a mesh seen through a node's matrix. */
void ca_gltf_show_mesh(ca_gltf *g, const ca_gltf_value *mesh, const ca_matrix *to_world);

/* ---- Nodes, cameras, lights (scenes.c, lights.c) --------------------------------------------------------------- */

void ca_gltf_read_scene(ca_gltf *g);
void ca_gltf_add_light(ca_gltf *g, const ca_gltf_value *node, const ca_matrix *to_world);
void ca_gltf_add_camera(ca_gltf *g, const ca_gltf_value *node, const ca_matrix *to_world);
/* One that sees everything, and a sky where nothing shines. */
void ca_gltf_add_defaults(ca_gltf *g, bool has_camera);
/* The map without scale, with z turned round: cameras and lights look along -z in glTF, along z here. */
bool ca_gltf_turned(const ca_matrix *to_world, ca_matrix *turned);

#endif
