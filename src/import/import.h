/* Scene files become scene descriptions here, and nowhere else is a file format known. */
#ifndef CA_IMPORT_IMPORT_H
#define CA_IMPORT_IMPORT_H

#include "geometry/curve.h"
#include "geometry/sdf_grid.h"
#include "image/image.h"
#include "scene/description.h"

/* Reads a Mitsuba 3 XML scene (0.6 spellings too), or where the name ends in .pbrt one of pbrt's, with its meshes and
 * textures. On failure *desc is empty and the error names file, line and column. Relative paths are seen from the
 * scene file. Reading has a budget of memory, for small files may take much (ca_scene_source.memory_mib). */
ca_status ca_import_scene(const char *path, const ca_define *defines, size_t define_count, ca_scene_desc *desc,
                          ca_error *error);
/* The same for a scene that is in memory, or with another sensor; CA_ERROR_ARGUMENT where there are fewer. */
ca_status ca_import_scene_source(const ca_scene_source *source, ca_scene_desc *desc, ca_error *error);
/* The same for a text without arrays. */
ca_status ca_import_scene_text(const char *text, size_t size, const char *path, const ca_define *defines,
                               size_t define_count, ca_scene_desc *desc, ca_error *error);

/* Reads a scene, whatever its format, and writes it to `path` as Mitsuba 3 XML (docs/scenes.md): what it is made
 * from, meshes as binary PLY, goes to the folder NAME-files beside NAME.xml. The written scene renders to the same
 * bits. *desc is what was read, the caller's to destroy; its notes also tell what Mitsuba 3 does not know. Errors: as
 * above; CA_ERROR_ARGUMENT where a file would be written that is read; CA_ERROR_UNSUPPORTED where the language cannot
 * say it. On failure *desc is empty; what had been written beside `path` stays. */
ca_status ca_import_convert(const ca_scene_source *source, const char *path, ca_scene_desc *desc, ca_error *error);

/* Meshes, in the file's own space, validated; normals only if the file has them, uv as the file has them (flipping v
 * is the caller's business). Polygons become fans of triangles around their first corner, which fits convex ones;
 * faces without area are kept. Colours are the attribute "vertex_color" or "face_color". On failure the mesh is
 * empty. Errors: a place (line and column, or byte) and what was expected there. No header makes the readers take
 * more memory than a file of its size could fill. */
ca_status ca_import_obj(const char *path, ca_mesh *mesh, ca_error *error);
ca_status ca_import_ply(const char *path, ca_mesh *mesh, ca_error *error);
/* `shape_index` counts the meshes of one .serialized file. */
ca_status ca_import_serialized(const char *path, uint32_t shape_index, ca_mesh *mesh, ca_error *error);
/* The picture's luminance times `scale` as heights z over [-1, 1]^2, its first row at y = -1; uv over [0, 1]^2;
 * facing +z, two triangles for each square of four pixels, and with smooth normals on request.
 * Errors: CA_ERROR_SCENE of a picture under 2 x 2, CA_ERROR_FORMAT of heights that are not finite. */
ca_status ca_import_height_field(const ca_image *image, float scale, bool smooth, ca_mesh *mesh, ca_error *error);
/* Of a grid of vertices in rows: each square is split from its first corner; 6 (columns - 1) (rows - 1) numbers. */
void ca_import_grid_triangles(size_t columns, size_t rows, uint32_t *indices);
/* Curves, as Mitsuba 3 has them: a control point a line, x y z and the radius; blank lines between curves. */
ca_status ca_import_curves(const char *path, ca_curve_degree degree, ca_curve **curve, ca_error *error);
/* Signed distances from one of Mitsuba's .vol files. */
ca_status ca_import_sdf_grid(const char *path, ca_sdf_grid **grid, ca_error *error);

#endif
