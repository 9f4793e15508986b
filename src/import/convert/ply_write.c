#include "import/convert/ply_write.h"

#include "base/file.h"
#include "base/little_endian.h"

#include <string.h>

/* ---- Names of attributes --------------------------------------------------------------------------------------- */

/* The property of one component (ply.c says how they make attributes again): r g b (a) for the attribute "color" of
 * three or four; else NAME_r, NAME_g, ... for NAME_color, NAME_x, NAME_y, ... or just NAME. */
static void property_name(const ca_mesh_attribute *attribute, uint32_t component, char name[256])
{
    static const char axes[] = "xyzw", colors[] = "rgba";
    const char *base = attribute->name + (attribute->per_face ? 5 : 7);
    const size_t length = strlen(base);
    if (attribute->components >= 3 && strcmp(base, "color") == 0)
        snprintf(name, 256, "%c", colors[component]);
    else if (attribute->components == 1)
        snprintf(name, 256, "%s", base);
    else if (attribute->components >= 3 && length > 6 && strcmp(base + length - 6, "_color") == 0)
        snprintf(name, 256, "%.*s_%c", (int)(length - 6), base, colors[component]);
    else
        snprintf(name, 256, "%s_%c", base, axes[component]);
}

/* Names that mean something else, or are no word. */
static bool is_sayable(const ca_mesh_attribute *attribute)
{
    static const char *const taken[] = {"x", "y", "z", "nx", "ny", "nz", "u", "v", "s", "t", "texture_u", "texture_v",
                                        "r", "g", "b", "a", "red", "green", "blue", "alpha", "vertex_indices",
                                        "vertex_index"};
    const char *base = attribute->name + (attribute->per_face ? 5 : 7);
    const size_t length = strlen(base);
    if (length == 0 || length > 190) return false;
    for (size_t i = 0; i < length; i++)
        if (base[i] <= ' ' || base[i] > '~') return false;
    if (attribute->components > 1) return true;
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
        if (strcmp(base, taken[i]) == 0) return false;
    return length < 2 || base[length - 2] != '_' || !strchr("xr01", base[length - 1]);
}

static ca_status check_attributes(const ca_mesh *mesh, const char *path, ca_error *error)
{
    for (uint32_t i = 0; i < mesh->attribute_count; i++)
        if (!is_sayable(&mesh->attributes[i]))
            return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "%s: PLY has no name for the mesh attribute \"%s\"",
                           path, mesh->attributes[i].name);
    return CA_OK;
}

/* ---- The file -------------------------------------------------------------------------------------------------- */

static void put_properties(const ca_mesh *mesh, bool per_face, FILE *stream)
{
    char name[256];
    for (uint32_t i = 0; i < mesh->attribute_count; i++) {
        const ca_mesh_attribute *attribute = &mesh->attributes[i];
        for (uint32_t c = 0; attribute->per_face == per_face && c < attribute->components; c++) {
            property_name(attribute, c, name);
            fprintf(stream, "property float %s\n", name);
        }
    }
}

static void put_header(const ca_mesh *mesh, FILE *stream)
{
    fprintf(stream, "ply\nformat binary_little_endian 1.0\nelement vertex %u\n", mesh->vertex_count);
    fputs("property float x\nproperty float y\nproperty float z\n", stream);
    if (mesh->normals) fputs("property float nx\nproperty float ny\nproperty float nz\n", stream);
    if (mesh->uvs) fputs("property float u\nproperty float v\n", stream);
    put_properties(mesh, false, stream);
    fprintf(stream, "element face %u\nproperty list uchar int vertex_indices\n", mesh->triangle_count);
    put_properties(mesh, true, stream);
    fputs("end_header\n", stream);
}

static void write_u32(uint32_t value, FILE *stream)
{
    unsigned char bytes[4];
    ca_put_u32(bytes, value);
    fwrite(bytes, 1, sizeof bytes, stream);
}

static void put_floats(const float *values, size_t count, FILE *stream)
{
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        write_u32(bits, stream);
    }
}

static void put_attributes(const ca_mesh *mesh, bool per_face, size_t row, FILE *stream)
{
    for (uint32_t i = 0; i < mesh->attribute_count; i++) {
        const ca_mesh_attribute *attribute = &mesh->attributes[i];
        if (attribute->per_face == per_face)
            put_floats(attribute->values + row * attribute->components, attribute->components, stream);
    }
}

static void put_data(const ca_mesh *mesh, FILE *stream)
{
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        put_floats(mesh->positions + 3 * v, 3, stream);
        if (mesh->normals) put_floats(mesh->normals + 3 * v, 3, stream);
        if (mesh->uvs) put_floats(mesh->uvs + 2 * v, 2, stream);
        put_attributes(mesh, false, v, stream);
    }
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        fputc(3, stream);
        for (size_t k = 0; k < 3; k++) write_u32(mesh->indices[3 * t + k], stream);
        put_attributes(mesh, true, t, stream);
    }
}

ca_status ca_ply_write(const ca_mesh *mesh, const char *path, ca_error *error)
{
    ca_file_writer writer;
    CA_TRY(check_attributes(mesh, path, error));
    CA_TRY(ca_file_create(&writer, path, error));
    put_header(mesh, writer.stream);
    put_data(mesh, writer.stream);
    return ca_file_commit(&writer, error);
}
