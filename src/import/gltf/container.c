/* The files of a scene: .gltf with its buffers, or one .glb; data URIs; views of buffers. */
#include "import/gltf/reader.h"

#include "base/file.h"
#include "base/little_endian.h"
#include "base/text.h"

#include <string.h>
#include <strings.h>

enum { MAX_JSON_BYTES = 128 << 20 };
#define MAX_FILE_BYTES ((size_t)1 << 34)
/* Keeps the bytes until the scene is imported. */
static bool own(ca_gltf *g, ca_bytes bytes)
{
    if (CA_TABLE_ADD(&g->owned)) {
        g->owned.items[g->owned.count - 1] = bytes;
        return true;
    }
    ca_bytes_destroy(&bytes);
    ca_import_fail_memory(g->importer, "the scene");
    return false;
}

/* ---- Data URIs ------------------------------------------------------------------------------------------------- */

static int base64_value(char c)
{
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/* RFC 4648, with or without padding. */
static bool decode_base64(const char *text, ca_bytes *bytes)
{
    size_t length = strlen(text);
    while (length > 0 && text[length - 1] == '=') length--;
    if (length % 4 == 1) return false;
    uint32_t bits = 0;
    for (size_t i = 0; i < length; i++) {
        const int value = base64_value(text[i]);
        if (value < 0) return false;
        bits = bits << 6 | (uint32_t)value;
        if (i % 4 == 1) bytes->data[bytes->size++] = (unsigned char)(bits >> 4);
        if (i % 4 == 2) bytes->data[bytes->size++] = (unsigned char)(bits >> 2);
        if (i % 4 == 3) bytes->data[bytes->size++] = (unsigned char)bits;
    }
    return true;
}

static ca_gltf_bytes read_data_uri(ca_gltf *g, const ca_gltf_value *owner, const char *uri)
{
    const ca_gltf_bytes none = {0};
    const char *comma = strchr(uri, ',');
    if (!comma || comma - uri < 7 || strncmp(comma - 7, ";base64", 7) != 0) {
        ca_gltf_fail(g, owner, "data in a uri must be base64");
        return none;
    }
    ca_bytes bytes = {.data = ca_alloc(strlen(comma), 1)};
    if (!bytes.data) ca_import_fail_memory(g->importer, "the scene");
    if (!bytes.data || !own(g, bytes)) return none;
    if (!decode_base64(comma + 1, &bytes)) {
        ca_gltf_fail(g, owner, "this uri's data is no base64");
        return none;
    }
    return (ca_gltf_bytes){.data = bytes.data, .size = bytes.size};
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

const char *ca_gltf_file_name(ca_gltf *g, const ca_gltf_value *owner, const char *uri)
{
    char *name = ca_gltf_alloc(g, strlen(uri) + 1, 1);
    size_t length = 0;
    if (!name) return NULL;
    const char *colon = strstr(uri, "://");
    if (colon) ca_gltf_fail(g, owner, "only files and data are read, not \"%.60s\"", uri);
    for (const char *c = uri; *c; c++) {
        const int high = *c == '%' ? ca_hex_digit(c[1]) : -1, low = high >= 0 ? ca_hex_digit(c[2]) : -1;
        name[length++] = low >= 0 ? (char)(16 * high + low) : *c;
        if (low >= 0) c += 2;
        if (name[length - 1] == '\0') ca_gltf_fail(g, owner, "this uri has a zero");
    }
    if (length == 0) ca_gltf_fail(g, owner, "this uri is empty");
    return ca_import_good(g->importer) ? name : NULL;
}

ca_gltf_bytes ca_gltf_uri(ca_gltf *g, const ca_gltf_value *owner, const char *uri, const char *what,
                          const char **path)
{
    const ca_gltf_bytes none = {0};
    *path = NULL;
    if (strncasecmp(uri, "data:", 5) == 0) return read_data_uri(g, owner, uri);
    ca_document *document = &g->importer->document;
    const char *name = ca_gltf_file_name(g, owner, uri);
    if (!name) return none;
    const char *found = ca_document_resolve(document, document->path, name);
    if (found) found = ca_document_add_file(document, found);
    if (!found) ca_import_fail_memory(g->importer, "a file name");
    if (!found) return none;
    ca_bytes bytes;
    ca_error reason;
    const ca_status status = ca_file_read(found, what, MAX_FILE_BYTES, &bytes, &reason);
    if (status != CA_OK) {
        ca_gltf_fail(g, owner, "%s", reason.message);
        return none;
    }
    if (!own(g, bytes)) return none;
    *path = found;
    return (ca_gltf_bytes){.data = bytes.data, .size = bytes.size};
}

/* ---- .glb ------------------------------------------------------------------------------------------------------ */

static void fail_container(ca_gltf *g, const char *message) { ca_gltf_fail(g, NULL, "%s", message); }

/* Finds the two chunks; further ones are skipped, as the specification wants it. */
static void read_binary(ca_gltf *g, ca_gltf_bytes *json)
{
    enum { HEADER = 12, CHUNK_HEADER = 8 };
    const unsigned char *data = g->file.data;
    if (g->file.size < HEADER + CHUNK_HEADER || ca_get_u32(data + 8) > g->file.size) {
        fail_container(g, "the file ends too early for a .glb");
        return;
    }
    if (ca_get_u32(data + 4) != 2) fail_container(g, "only version 2 of .glb is read");
    const size_t size = ca_get_u32(data + 8);
    for (size_t at = HEADER, chunk = 0; at + CHUNK_HEADER <= size; chunk++) {
        const size_t length = ca_get_u32(data + at);
        if (length > size - at - CHUNK_HEADER) {
            fail_container(g, "a chunk of this .glb is longer than the file");
            return;
        }
        const ca_gltf_bytes bytes = {data + at + CHUNK_HEADER, length};
        if (chunk == 0 && memcmp(data + at + 4, "JSON", 4) == 0) *json = bytes;
        if (chunk == 1 && memcmp(data + at + 4, "BIN\0", 4) == 0) g->chunk = bytes;
        at += CHUNK_HEADER + length;
    }
    if (!json->data) fail_container(g, "the first chunk of this .glb is not JSON");
}

/* ---- Opening --------------------------------------------------------------------------------------------------- */

/* A text in memory, or the file. */
static bool load_file(ca_gltf *g)
{
    const ca_scene_source *source = g->importer->source;
    if (source->text) {
        g->file.data = ca_alloc(source->size + 1, 1);
        if (!g->file.data) ca_import_fail_memory(g->importer, "the scene");
        if (!g->file.data) return false;
        memcpy(g->file.data, source->text, source->size);
        g->file.data[source->size] = 0;
        g->file.size = source->size;
        return true;
    }
    ca_error reason;
    const ca_status status = ca_file_read(source->path, "scene", MAX_FILE_BYTES, &g->file, &reason);
    if (status != CA_OK) ca_import_fail_file(g->importer, NULL, status, &reason);
    return status == CA_OK;
}

static void check_asset(ca_gltf *g)
{
    const ca_gltf_value *asset = ca_gltf_object(g, g->root, "asset");
    const char *version = ca_gltf_text(g, asset, "minVersion", ca_gltf_text(g, asset, "version", ""));
    if (ca_import_good(g->importer) && strncmp(version, "2.", 2) != 0)
        ca_gltf_fail(g, asset ? asset : g->root, "version \"%.20s\" of glTF is not read; 2.0 is", version);
}

void ca_gltf_open(ca_gltf *g)
{
    ca_gltf_bytes json = {0};
    if (!load_file(g)) return;
    ca_document_add_content(&g->importer->document, g->file.data, g->file.size);
    g->is_binary = g->file.size >= 4 && memcmp(g->file.data, "glTF", 4) == 0;
    if (g->is_binary)
        read_binary(g, &json);
    else
        json = (ca_gltf_bytes){g->file.data, g->file.size};
    if (!ca_import_good(g->importer)) return;
    if (json.size > MAX_JSON_BYTES) {
        fail_container(g, "the scene's JSON is over the limit of 128 MiB");
        return;
    }
    const size_t mark = ca_byte_order_mark((const char *)json.data, json.size);
    json.data += mark, json.size -= mark;
    g->importer->status = ca_gltf_parse((const char *)json.data, json.size, g->importer->document.path, !g->is_binary,
                                        &g->importer->document.arena, &g->root, g->importer->error);
    if (ca_import_good(g->importer)) check_asset(g);
}

/* ---- Buffers --------------------------------------------------------------------------------------------------- */

/* In a .glb the first buffer may have no uri: it is the chunk. */
static void load_buffer(ca_gltf *g, const ca_gltf_value *buffer, ca_gltf_bytes *bytes)
{
    const char *uri = ca_gltf_text(g, buffer, "uri", NULL), *path;
    const size_t length = (size_t)ca_gltf_count(g, buffer, "byteLength", 0);
    if (uri)
        *bytes = ca_gltf_uri(g, buffer, uri, "buffer", &path);
    else if (buffer->index == 0 && g->chunk.data)
        *bytes = g->chunk;
    else
        ca_gltf_fail(g, buffer, "has no uri");
    if (!ca_import_good(g->importer)) return;
    if (uri) ca_document_add_content(&g->importer->document, bytes->data, bytes->size);
    if (bytes->size < length)
        ca_gltf_fail(g, buffer, "has %zu bytes instead of %zu", bytes->size, length);
    else
        bytes->size = length;
}

static ca_gltf_bytes buffer_of(ca_gltf *g, const ca_gltf_value *view)
{
    const ca_gltf_bytes none = {0};
    const ca_gltf_value *buffer = ca_gltf_reference(g, view, "buffer", "buffers");
    if (!buffer && ca_import_good(g->importer)) ca_gltf_fail(g, view, "needs a buffer");
    if (!g->buffers) g->buffers = ca_gltf_alloc(g, ca_gltf_table_size(g, "buffers"), sizeof *g->buffers);
    if (!buffer || !g->buffers) return none;
    ca_gltf_bytes *bytes = &g->buffers[buffer->index];
    if (!bytes->data) load_buffer(g, buffer, bytes);
    return ca_import_good(g->importer) ? *bytes : none;
}

ca_gltf_bytes ca_gltf_view(ca_gltf *g, const ca_gltf_value *view, size_t *stride)
{
    const ca_gltf_bytes none = {0};
    static const char *const packed[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};
    for (int i = 0; i < 2; i++)
        if (ca_gltf_extension(g, view, packed[i])) ca_gltf_fail(g, view, "data packed by meshopt is not read");
    const ca_gltf_bytes buffer = buffer_of(g, view);
    const uint64_t offset = ca_gltf_count(g, view, "byteOffset", 0), length = ca_gltf_count(g, view, "byteLength", 0);
    *stride = (size_t)ca_gltf_number(g, view, "byteStride", 0.0, 0.0, 65536.0);
    if (!ca_import_good(g->importer) || !buffer.data) return none;
    if (offset <= buffer.size && length <= buffer.size - offset)
        return (ca_gltf_bytes){buffer.data + offset, (size_t)length};
    ca_gltf_fail(g, view, "does not lie in its buffer, which has %zu bytes", buffer.size);
    return none;
}
