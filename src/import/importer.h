/* What the files of the Mitsuba importer share: the state of one import, and one function per kind of object.
 *
 * Failures are sticky: the first one is kept in the importer (status and message), everything after it does nothing
 * of consequence and returns defaults, and ca_import_scene reports it in the end. So functions here return values,
 * not statuses, and code that reads parameters reads like a list of them. Loops ask ca_import_good.
 *
 * Every plugin is a row (name, function) of a static table; the function reads its parameters through ca_props and
 * fills the record named beside the table. */
#ifndef CA_IMPORT_IMPORTER_H
#define CA_IMPORT_IMPORTER_H

#include "base/key_table.h"
#include "image/spectrum.h"
#include "import/document.h"
#include "import/properties.h"

/* References and nesting together: deeper scenes are refused, which limits every recursion over a material. */
enum { CA_IMPORT_MAX_NESTING = 16 };

/* A bitmap that was read already. */
typedef struct ca_import_image {
    const char *path; /* in the document's arena; of an array its name */
    bool array;
    ca_image_encoding encoding;
    bool cut;       /* its negative numbers are 0: not for heights and normals */
    uint32_t index; /* in the description's images */
    uint32_t uses;
} ca_import_image;

/* A texture of the values at a mesh's vertices or faces. */
typedef struct ca_import_attribute {
    const char *name; /* in the description's strings */
    ca_location where;
} ca_import_attribute;

/* A texture that keeps a colour within its range, which is made of such values (attributes.c). */
typedef struct ca_import_guard {
    ca_texture_id id, child;
    bool share; /* the range is [0, 1], else all that is not negative */
    ca_location where;
} ca_import_guard;

/* What the reader of another format made for `data` to name (tree_build.h). */
typedef struct ca_import_mesh {
    const char *name;
    ca_mesh mesh; /* empty once a shape has taken it over, with which others then share it (shared_meshes.h) */
} ca_import_mesh;

typedef struct ca_import_curve {
    const char *name;
    ca_curve *curve; /* NULL once a shape has taken it over */
} ca_import_curve;

typedef struct ca_import_arrays {
    ca_arena arena; /* of the bitmaps' pixels */
    CA_TABLE(ca_import_mesh) meshes;
    CA_TABLE(ca_import_curve) curves;
    CA_TABLE(ca_bitmap_data) bitmaps;
} ca_import_arrays;

void ca_import_arrays_destroy(ca_import_arrays *arrays);

/* Of the description's meshes, by what tells them from others (shared_meshes.h). */
typedef struct ca_shared_meshes {
    ca_key_table by_place;   /* where they lie */
    ca_key_table by_content; /* before they are placed: twice the number, and 1 where placing keeps the indices */
} ca_shared_meshes;

/* Of a texture or BSDF with all that it is made of, each as often as it is met (tree_limit.c). */
typedef struct ca_tree_size {
    uint32_t height, nodes;
} ca_tree_size;

/* Of the first textures, or materials, of the description. */
typedef CA_TABLE(ca_tree_size) ca_tree_sizes;

typedef struct ca_importer {
    const ca_scene_source *source;
    ca_import_arrays arrays; /* then those of `source` are not used */
    ca_scene_desc *desc;
    ca_document document;
    ca_error *error;
    ca_status status; /* the first failure */
    uint32_t nesting;
    bool is_text; /* of XML; trees that readers of other formats make may divide a reflectance by a weight */
    const ca_xml_node *entered; /* the last object whose parameters are read; NULL: none so far */
    uint32_t sensor, sensor_count; /* the wanted one, and how many there were so far */
    bool has_camera;               /* the sensor of the wanted id was there */
    /* The array behind the last that was asked for, mostly the next one: a mesh that a reader made, one that was
     * given, a picture. */
    size_t next_mesh, next_given_mesh, next_bitmap;
    CA_TABLE(ca_import_image) images;
    CA_TABLE(ca_import_attribute) attributes;
    CA_TABLE(ca_import_guard) guards;
    ca_tree_sizes texture_sizes, material_sizes;
    ca_shared_meshes shared;
    ca_mesh_lender **lenders; /* of the source's meshes; NULL where one is only to be copied */
} ca_importer;

typedef struct ca_plugin {
    const char *name;
    void (*import)(ca_props *props, void *result);
} ca_plugin;

#define CA_COUNT(array) (sizeof(array) / sizeof *(array))

static inline bool ca_import_good(const ca_importer *importer) { return importer->status == CA_OK; }

/* A failure of the scene at a place in it. */
void ca_import_fail(ca_importer *importer, const ca_location *where, const char *format, ...) CA_PRINTF(3, 4);
void ca_import_fail_memory(ca_importer *importer, const char *what);
/* What is read otherwise than it is written, as one sentence that may hold names of tables but no text of the scene:
 * there are then few. Said once. */
void ca_import_note(ca_importer *importer, const ca_location *where, const char *format, ...) CA_PRINTF(3, 4);
/* A failure below (a file that cannot be read), told as one of the element that asked for it. */
void ca_import_fail_file(ca_importer *importer, const ca_location *where, ca_status status, const ca_error *reason);

/* Is the value of this parameter 1 less what it is in scenes of later versions? */
bool ca_import_is_old_complement(const ca_importer *importer, const ca_xml_node *integrator, const char *parameter);

/* Refuses one that is made of too many others, or nested too deep. */
void ca_import_limit_texture(ca_importer *importer, ca_texture_id id, const ca_location *where);
void ca_import_limit_material(ca_importer *importer, ca_material_id id, const ca_location *where);

/* The plugin that the element's `type` names; NULL after failing with the nearest name there is. */
const ca_plugin *ca_import_find_plugin(ca_importer *importer, const ca_xml_node *node, const ca_plugin *table,
                                       size_t count);

/* Brackets the import of an object, so that references in a circle and too deep ones fail. */
bool ca_import_enter(ca_importer *importer, ca_xml_node *node);
void ca_import_leave(ca_importer *importer, ca_xml_node *node, uint32_t result);

/* The table of a lens in a file, its bytes taken into the content's hash; false after failing. */
struct ca_lens_table;
bool ca_import_lens_file(ca_importer *importer, const char *path, const ca_location *where,
                         struct ca_lens_table *table);

/* Path of the file that a parameter names, in the description's strings; NULL after failing. */
const char *ca_import_filename(ca_props *props, const char *name);
/* Index of the image that `filename` or `data` names, read at the first call; CA_NONE after failing. */
uint32_t ca_import_picture(ca_props *props, ca_image_encoding encoding);
/* For a picture of colours, an index from there: that of one whose negative numbers are 0, and a note says so; the
 * same one where there are none. Others who have the picture keep their numbers; `alone`: this use of it is the only
 * one that was counted by ca_import_picture, and no other will come. CA_NONE after failing. */
uint32_t ca_import_without_negative(ca_importer *importer, uint32_t image, bool alone, const ca_location *where);
/* What becomes of a mesh on its way into the scene. */
typedef struct ca_mesh_use {
    ca_matrix to_world;
    bool flip_normals, face_normals, flip_tex_coords;
} ca_mesh_use;

/* Makes programs that lend arrays known, and lets go of what the scene does not use. */
ca_status ca_import_begin_lending(ca_importer *importer);
void ca_import_end_lending(ca_importer *importer);
/* The source's arrays of that name; NULL after failing with the nearest one. */
const ca_mesh_data *ca_import_find_mesh(ca_importer *importer, const char *name, ca_error *error);
/* Are there positions and indices, and not too many? */
ca_status ca_import_check_mesh(const ca_mesh_data *data, ca_error *error);
/* Of arrays that are checked; those that stay as they are and are lent are not copied. Errors: CA_ERROR_FORMAT,
 * CA_ERROR_MEMORY. */
ca_status ca_import_mesh_data(const ca_importer *importer, const ca_mesh_data *data, const ca_mesh_use *use,
                              ca_mesh *mesh, ca_error *error);
/* Likewise of pixels; CA_ERROR_SCENE where there are none of that name. */
ca_status ca_import_bitmap_data(ca_importer *importer, const char *name, ca_image *image, ca_error *error);
/* What a reader made by that name, NULL: nothing; and its mesh, checked. Errors: as above. */
ca_import_mesh *ca_import_find_made(ca_importer *importer, const char *name);
/* Likewise; the caller owns the curves. NULL after failing. */
ca_curve *ca_import_take_made_curve(ca_importer *importer, const char *name, ca_error *error);
ca_status ca_import_made_mesh(ca_import_mesh *made, ca_mesh *mesh, ca_error *error);

/* One object of each kind from its element; objects that can be referenced are made once. CA_NONE after failing. */
ca_texture_id ca_import_texture(ca_importer *importer, ca_xml_node *node);
/* A copy of it in the description; CA_NONE after failing. */
ca_texture_id ca_import_add_texture(ca_importer *importer, const ca_texture *texture);
/* Once all meshes are there: notes where a texture is of an attribute that none of them has. */
void ca_import_note_missing_attributes(ca_importer *importer);
/* A texture that keeps this colour within its range, `share`: of reflectances; CA_NONE: no part of it is an
 * attribute. */
ca_texture_id ca_import_guard_attribute(ca_importer *importer, ca_texture_id id, bool share,
                                        const ca_location *where);
/* Once all meshes are there: guards that have nothing to do become what they guard, and notes tell of the others. */
void ca_import_settle_attributes(ca_importer *importer);
ca_material_id ca_import_bsdf(ca_importer *importer, ca_xml_node *node);
/* One that shapes refer to is only checked: CA_NONE. */
uint32_t ca_import_light(ca_importer *importer, ca_xml_node *node);
void ca_import_shape(ca_importer *importer, ca_xml_node *node);
void ca_import_sensor(ca_importer *importer, ca_xml_node *node);
/* What a sensor decides. */
typedef struct ca_import_view {
    ca_camera_desc camera;
    ca_film_desc film;
    ca_sampler sampler;
    bool names_sampler;
    uint32_t samples_per_pixel;
} ca_import_view;

ca_import_view ca_import_keep_view(const ca_scene_desc *desc);
void ca_import_put_back_view(ca_scene_desc *desc, const ca_import_view *kept);
void ca_import_film(ca_importer *importer, ca_xml_node *node);
void ca_import_filter(ca_importer *importer, ca_xml_node *node);
void ca_import_sampler(ca_importer *importer, ca_xml_node *node);
void ca_import_integrator(ca_importer *importer, ca_xml_node *node);

/* An area light, which only a shape can hold: its index in lights. */
uint32_t ca_import_area_light(ca_importer *importer, ca_xml_node *node);
/* Says of an area light directly in <scene> that no shape has asked for it; when all shapes are read. */
void ca_import_note_idle_emitter(ca_importer *importer, const ca_xml_node *node);

/* Parts of plugins' parameters that several files need. */
double ca_import_index_of_refraction(ca_props *props, const char *name, double fallback);
/* fov or focal_length; `aspect` is width / height. */
typedef struct ca_field_of_view {
    double degrees;
    ca_fov_axis axis;
} ca_field_of_view;
ca_field_of_view ca_import_field_of_view(ca_props *props);

/* The values of elements. */
ca_matrix ca_import_transform(ca_importer *importer, const ca_xml_node *node);
ca_rgb ca_import_color(ca_importer *importer, const ca_xml_node *node, ca_color_role role);
/* A <spectrum type="..."> (which is a <texture> by then) of one colour: d65, uniform, regular, blackbody, ... Is it
 * one? And its colour. */
bool ca_import_is_spectrum(const ca_xml_node *node);
ca_rgb ca_import_spectrum(ca_importer *importer, ca_xml_node *node, ca_color_role role);
/* Names of these plugins. */
extern const char *const ca_import_spectrum_names[];
enum { CA_IMPORT_SPECTRUM_COUNT = 7 };
/* Linear samples at wavelengths in nm as a colour, the nearest inside of Rec. 709. */
ca_rgb ca_import_samples(ca_importer *importer, const ca_xml_node *node, const ca_spectrum_sample *samples,
                         size_t count, ca_color_role role);
/* Fails where a colour of that role cannot have such a component. */
void ca_import_check_component(ca_importer *importer, const ca_xml_node *node, double value, ca_color_role role);
/* x, y and z of the element, or the three (or the one) in `value`. */
void ca_import_xyz(ca_importer *importer, const ca_xml_node *node, double fallback, double xyz[3]);
/* `count` numbers of an attribute, no more and no less. */
bool ca_import_numbers(ca_importer *importer, const ca_xml_node *node, const char *attribute, double *numbers,
                       size_t count);

/* Imports, and where all went well calls `then` while the document is still there. */
typedef void (*ca_import_then)(ca_importer *importer, void *user);
ca_status ca_import_scene_then(const ca_scene_source *source, ca_import_then then, void *user, ca_scene_desc *desc,
                               ca_error *error);

/* A rigid map (it may mirror) times a uniform scale, but for what is lost where matrices are written with few
 * digits. */
bool ca_import_is_similarity(const ca_matrix *matrix);
/* Makes it exactly such. False: it is none, and stays as it is. */
bool ca_import_make_similarity(ca_matrix *matrix);
/* Likewise of a map without a scale: what sensors, spots and projectors need. */
bool ca_import_make_rigid(ca_matrix *matrix);

#endif
