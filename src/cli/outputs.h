/* Where images go: checked before the work starts, so that hours of rendering are not lost to a typing error. */
#ifndef CA_CLI_OUTPUTS_H
#define CA_CLI_OUTPUTS_H

#include "base/reserve.h"
#include "cli/layer_choice.h"
#include "cli/options.h"
#include "cli/places.h"
#include "film/pass_part.h"
#include "metrics/tone.h"

/* How .png shows a picture: values times 2^exposure under a tone curve (metrics/tone.h). Zeros are the plain picture,
 * whose values are clipped. */
typedef struct ca_output_look {
    double exposure;
    ca_tone_curve tone;
} ca_output_look;

/* Rows of a command's options for how its images are written. `record` is the type that is filled; it has members
 * ca_output_look look, const char *tone (ca_outputs_find_tone), ca_layer_choice layers. */
#define CA_OUTPUT_OPTIONS(record)                                                                                    \
    {.name = "exposure",                                                                                             \
     .argument = "STOPS",                                                                                            \
     .kind = CA_OPTION_REAL,                                                                                         \
     .offset = offsetof(record, look.exposure),                                                                      \
     .help = "brightness of .png by powers of two (default: 0)"},                                                    \
    {.name = "tone",                                                                                                 \
     .argument = "CURVE",                                                                                            \
     .kind = CA_OPTION_TEXT,                                                                                         \
     .offset = offsetof(record, tone),                                                                               \
     .help = "of .png: srgb (default) and linear clip; aces, hable, reinhard do not"},                               \
    {.name = "layers",                                                                                               \
     .argument = "LIST",                                                                                             \
     .kind = CA_OPTION_TEXT,                                                                                         \
     .offset = offsetof(record, layers.names),                                                                       \
     .help = "layers of .exr beside R G B: names with commas (Albedo,N,Variance.R), all or none (default: those "    \
             "that say something)"},                                                                                 \
    {.name = "half",                                                                                                 \
     .kind = CA_OPTION_FLAG,                                                                                         \
     .offset = offsetof(record, layers.half),                                                                        \
     .help = "R G B, Albedo and N of .exr with 16 bits, where values fit"}

/* Can a file of this name be written here? Creates and removes a file beside it. Errors: CA_ERROR_FILE. */
ca_status ca_output_check_place(const char *path, ca_error *error);

/* Names temporary files of killed programs beside it (base/leftovers.h). */
void ca_output_tell_leftovers(const char *path);

/* Checks where several outputs, and `stats` (NULL: none), go. At most one of them may be a part file: *part_path is
 * that one, or NULL. `places` has what is read. All names are checked before any place, so that wrong usage is
 * reported before a full disk. */
ca_status ca_outputs_check(const ca_text_list *outputs, const char *stats, const char **part_path, ca_places *places,
                           ca_error *error);

/* Of outputs whose names are right: that none is read or written twice, and that they can be written. */
ca_status ca_outputs_check_places(const ca_text_list *outputs, const char *stats, ca_places *places,
                                  ca_error *error);

/* CA_ERROR_ARGUMENT where layers are chosen and none of the outputs is an .exr, or a name is wrong. */
ca_status ca_outputs_check_layers(const char *const *paths, size_t count, const ca_layer_choice *choice,
                                  ca_error *error);

/* CA_ERROR_ARGUMENT where the look is chosen, the curve by its name `tone` (NULL: it is not), and none of the outputs
 * is a .png. */
ca_status ca_outputs_check_look(const char *const *paths, size_t count, const ca_output_look *look, const char *tone,
                                ca_error *error);

/* Fills in the curve of that name; NULL is the plain picture's. Errors: CA_ERROR_ARGUMENT, naming all curves. */
ca_status ca_outputs_find_tone(const char *name, ca_output_look *look, ca_error *error);

/* Where a render goes: images, and its numbers. */
typedef struct ca_output_files {
    const char *const *paths;
    size_t count;
    ca_output_look look;
    ca_layer_choice layers;
    const char *stats; /* NULL: none */
    const ca_pass_range *ranges; /* borrowed; of parts with gaps between them: the passes that are there; else none */
    size_t range_count;
} ca_output_files;

/* Writes the image, with the layers that are chosen, to all of them but a part file, and the numbers. One that cannot
 * be written does not keep the others from it: see ca_output_note. Without an image (NULL) only the numbers. */
ca_status ca_outputs_write(const ca_output_files *files, const ca_image_layers *image,
                           const ca_render_statistics *statistics, ca_error *error);

/* Memory for ca_outputs_write of an image of this size, to be opened then (base/reserve.h), and for `more` bytes. */
ca_status ca_outputs_reserve(const ca_output_files *files, uint32_t width, uint32_t height, size_t more,
                             ca_reserve **reserve, ca_error *error);

/* Takes the result of one of several writes down in *all and *error. Of several failures the last one is the caller's
 * to tell; each one before it is told on standard error when the next one comes. `reason`: of this write. */
void ca_output_note(ca_status *all, ca_error *error, ca_status status, const ca_error *reason);

/* Says on standard error how many samples were not finite or negative, and where they came from; and whether the
 * image lacks layers. Nothing where all is well. */
void ca_outputs_warn(const ca_render_statistics *statistics);

/* The same for a folder that exists or will be made; names temporary files of killed programs in it. */
ca_status ca_output_check_folder(const char *path, ca_error *error);

/* "NAME.extension" in the current folder, NAME being the scene file's without folder and extension. The caller frees
 * it with ca_free; NULL when out of memory. */
char *ca_output_default(const char *scene_path, const char *extension);

#endif
