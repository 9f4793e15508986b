/* Any scene that was read, written as Mitsuba 3 XML: first its text in memory, by which the files beside it are
 * known; then these; and the text itself last, so that it never names a file that is not there. */
#define _POSIX_C_SOURCE 200809L
#include "image/layers.h"
#include "import/convert/outputs.h"
#include "import/convert/ply_write.h"
#include "import/convert/scene_text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

typedef struct conversion {
    const char *path;     /* of the scene that is written */
    const char *folder;   /* of the files beside it, in the outputs' arena */
    ca_outputs outputs;
    ca_importer *importer;
} conversion;

/* ---- Places ---------------------------------------------------------------------------------------------------- */

/* The files that the scene was read from, sorted; NULL when out of memory. */
static ca_file_identity *identify_inputs(const ca_path_table *files, size_t *count)
{
    ca_file_identity *inputs = ca_alloc(files->count, sizeof *inputs);
    *count = 0;
    for (size_t i = 0; inputs && i < files->count; i++)
        if (ca_file_identify(files->items[i], &inputs[*count])) ++*count;
    if (inputs && *count > 0) qsort(inputs, *count, sizeof *inputs, ca_file_identity_compare);
    return inputs;
}

static void check_place(conversion *c, const char *path, const ca_file_identity *inputs, size_t count)
{
    ca_file_identity wanted;
    if (!ca_import_good(c->importer) || count == 0 || !ca_file_identify(path, &wanted)) return;
    if (bsearch(&wanted, inputs, count, sizeof wanted, ca_file_identity_compare))
        c->importer->status = ca_fail(c->importer->error, CA_ERROR_ARGUMENT, NULL,
                                      "%s would be written, and the scene is read from it", path);
}

/* FOLDER/NAME; NULL after failing. */
static const char *path_of(conversion *c, const ca_output *output)
{
    const size_t size = strlen(c->folder) + strlen(output->name) + 2;
    char *path = ca_arena_alloc(&c->outputs.arena, size, 1);
    if (path)
        snprintf(path, size, "%s/%s", c->folder, output->name);
    else
        ca_import_fail_memory(c->importer, "the names of files");
    return path;
}

static void check_places(conversion *c)
{
    size_t count;
    ca_file_identity *inputs = identify_inputs(&c->importer->document.files, &count);
    if (!inputs) {
        ca_import_fail_memory(c->importer, "the names of files");
        return;
    }
    check_place(c, c->path, inputs, count);
    for (size_t i = 0; i < c->outputs.files.count && ca_import_good(c->importer); i++) {
        const char *path = path_of(c, &c->outputs.files.items[i]);
        if (path) check_place(c, path, inputs, count);
    }
    ca_free(inputs);
}

/* ---- Files beside the scene ------------------------------------------------------------------------------------ */

static ca_status write_bytes(const char *path, const void *bytes, size_t size, ca_error *error)
{
    ca_file_writer writer;
    CA_TRY(ca_file_create(&writer, path, error));
    fwrite(bytes, 1, size, writer.stream);
    return ca_file_commit(&writer, error);
}

static ca_status copy_file(const char *source, const char *path, ca_error *error)
{
    ca_bytes bytes;
    CA_TRY(ca_file_read(source, "file", SIZE_MAX / 2, &bytes, error));
    const ca_status status = write_bytes(path, bytes.data, bytes.size, error);
    ca_bytes_destroy(&bytes);
    return status;
}

/* The channels as the reader of EXR files wants them. */
static ca_status write_image(const ca_image *image, const char *path, ca_error *error)
{
    static const char *const names[4][4] = {{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
    ca_image_layers *layers;
    CA_TRY(ca_layers_create(&layers, image->width, image->height, error));
    const size_t pixels = (size_t)image->width * image->height;
    ca_status status = CA_OK;
    for (uint32_t c = 0; c < image->channels && status == CA_OK; c++) {
        float *plane;
        status = ca_layers_add(layers, names[image->channels - 1][c], &plane, error);
        for (size_t i = 0; i < pixels && status == CA_OK; i++) plane[i] = image->data[i * image->channels + c];
    }
    if (status == CA_OK) status = ca_layers_write(layers, path, 0.0f, error);
    ca_layers_destroy(layers);
    return status;
}

/* A line for each control point, with a blank one where a curve ends: its segment is not the next one's neighbour.
 * Nine digits make each float again. */
static ca_status write_curve(const ca_curve *curve, const char *path, ca_error *error)
{
    ca_file_writer writer;
    CA_TRY(ca_file_create(&writer, path, error));
    for (uint32_t i = 0; i < curve->segment_count; i++) {
        const bool goes_on = i > 0 && curve->segments[i] == curve->segments[i - 1] + 1;
        if (i > 0 && !goes_on) fputc('\n', writer.stream);
        for (uint32_t k = goes_on ? (uint32_t)curve->degree : 0; k <= (uint32_t)curve->degree; k++) {
            const float *p = curve->points + 4 * ((size_t)curve->segments[i] + k);
            fprintf(writer.stream, "%.9g %.9g %.9g %.9g\n", (double)p[0], (double)p[1], (double)p[2], (double)p[3]);
        }
    }
    return ca_file_commit(&writer, error);
}

static ca_status write_output(const conversion *c, const ca_output *output, const char *path, ca_error *error)
{
    const ca_scene_desc *desc = c->importer->desc;
    switch (output->kind) {
    case CA_OUTPUT_COPY: return copy_file(output->source, path, error);
    case CA_OUTPUT_MESH: return ca_ply_write(&desc->meshes.items[output->index], path, error);
    case CA_OUTPUT_IMAGE: return write_image(&desc->images.items[output->index], path, error);
    case CA_OUTPUT_CURVE: return write_curve(desc->curves.items[output->index], path, error);
    }
    return CA_ERROR_ARGUMENT;
}

static void write_outputs(conversion *c)
{
    ca_importer *importer = c->importer;
    if (!ca_import_good(importer) || c->outputs.files.count == 0) return;
    if (mkdir(c->folder, 0777) != 0 && errno != EEXIST)
        importer->status =
            ca_fail(importer->error, CA_ERROR_FILE, NULL, "%s: cannot make: %s", c->folder, strerror(errno));
    for (size_t i = 0; i < c->outputs.files.count && ca_import_good(importer); i++) {
        const char *path = path_of(c, &c->outputs.files.items[i]);
        if (path) importer->status = write_output(c, &c->outputs.files.items[i], path, importer->error);
    }
}

/* ---- The whole ------------------------------------------------------------------------------------------------- */

/* "scenes/a.xml" -> "scenes/a-files", in the outputs' arena. */
static bool set_folder(conversion *c)
{
    const size_t length = strlen(c->path) - strlen(".xml"), size = length + sizeof "-files";
    char *folder = ca_arena_alloc(&c->outputs.arena, size, 1);
    if (folder) snprintf(folder, size, "%.*s-files", (int)length, c->path);
    c->folder = folder;
    return folder != NULL;
}

static void convert(ca_importer *importer, void *user)
{
    conversion *c = user;
    c->importer = importer;
    if (!set_folder(c)) {
        ca_import_fail_memory(importer, "the names of files");
        return;
    }
    const char *slash = strrchr(c->folder, '/');
    ca_scene_writer writer = {
        .importer = importer, .outputs = &c->outputs, .folder = slash ? slash + 1 : c->folder};
    ca_scene_write_text(&writer);
    if (ca_import_good(importer)) check_places(c);
    write_outputs(c);
    if (ca_import_good(importer))
        importer->status = write_bytes(c->path, writer.text, writer.length, importer->error);
    ca_free(writer.text);
}

ca_status ca_import_convert(const ca_scene_source *source, const char *path, ca_scene_desc *desc, ca_error *error)
{
    const char *extension = ca_path_extension(path);
    ca_scene_desc_init(desc);
    if (strcasecmp(extension, ".xml") != 0 || extension == path || extension[-1] == '/')
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%s: a scene is written as XML, and the file name must end in .xml", path);
    conversion c = {.path = path};
    const ca_status status = ca_import_scene_then(source, convert, &c, desc, error);
    ca_outputs_destroy(&c.outputs);
    return status;
}
