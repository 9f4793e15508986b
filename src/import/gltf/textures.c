/* Textures: images become bitmaps of the numbers that a parameter wants. */
#include "import/gltf/reader.h"

#include "image/format.h"

#include <math.h>
#include <string.h>
#include <strings.h>

/* ---- Images ---------------------------------------------------------------------------------------------------- */

static bool is_plain_color(const ca_gltf_bake *bake)
{
    return bake->pixels == CA_GLTF_COLOR && bake->factors[0] == 1.0 && bake->factors[1] == 1.0 &&
           bake->factors[2] == 1.0;
}

static void read_image(ca_gltf *g, const ca_gltf_value *image, ca_gltf_image *read)
{
    const char *uri = ca_gltf_text(g, image, "uri", NULL);
    size_t stride;
    if (uri) {
        read->bytes = ca_gltf_uri(g, image, uri, "image", &read->path);
        if (ca_import_good(g->importer) && read->path)
            ca_document_add_content(&g->importer->document, read->bytes.data, read->bytes.size);
        return;
    }
    const ca_gltf_value *view = ca_gltf_reference(g, image, "bufferView", "bufferViews");
    if (view)
        read->bytes = ca_gltf_view(g, view, &stride);
    else if (ca_import_good(g->importer))
        ca_gltf_fail(g, image, "has neither uri nor bufferView");
}

/* The bytes of an image, read once; NULL after failing. */
static const ca_gltf_image *image_bytes(ca_gltf *g, const ca_gltf_value *image)
{
    if (!g->images) g->images = ca_gltf_alloc(g, ca_gltf_table_size(g, "images"), sizeof *g->images);
    if (!g->images) return NULL;
    ca_gltf_image *read = &g->images[image->index];
    if (!read->bytes.data) read_image(g, image, read);
    return ca_import_good(g->importer) && read->bytes.data ? read : NULL;
}

static bool decode_image(ca_gltf *g, const ca_gltf_value *image, ca_image_encoding encoding, ca_image *decoded)
{
    const ca_gltf_image *found = image_bytes(g, image);
    if (!found) return false;
    const ca_bytes bytes = {.data = (unsigned char *)(uintptr_t)found->bytes.data, .size = found->bytes.size};
    if (!ca_png_is(&bytes) && !ca_jpeg_is(&bytes) && !ca_webp_is(&bytes)) {
        ca_gltf_fail(g, image, "images are PNG, JPEG or WebP files, and this is none of them");
        return false;
    }
    ca_error reason;
    const char *path = found->path ? found->path : g->importer->document.path;
    const ca_status status = ca_image_decode(path, &bytes, encoding, decoded, &reason);
    if (status == CA_ERROR_MEMORY) ca_import_fail_memory(g->importer, "images");
    if (status != CA_OK) ca_gltf_fail(g, image, "%s", reason.message);
    return status == CA_OK;
}

/* ---- Baking ---------------------------------------------------------------------------------------------------- */

/* Channel 3 is alpha, which is 1 where there is none. */
static double channel_at(const ca_image *image, const float *pixel, uint32_t channel)
{
    const bool has_alpha = image->channels == 2 || image->channels == 4;
    if (channel == 3) return has_alpha ? (double)pixel[image->channels - 1] : 1.0;
    return (double)pixel[image->channels >= 3 ? channel : 0];
}

double ca_gltf_gloss(double roughness) { return fmin(fmax((0.1 - roughness * roughness) / 0.099, 0.0), 1.0); }

double ca_gltf_metal_share(double reflectance)
{
    return fmin(fmax((reflectance - CA_GLTF_DIELECTRIC) / (1.0 - CA_GLTF_DIELECTRIC), 0.0), 1.0);
}

static double largest_of(const ca_image *image, const float *pixel, const ca_gltf_bake *bake)
{
    double largest = 0.0;
    for (uint32_t c = 0; c < 3; c++) largest = fmax(largest, channel_at(image, pixel, c) * bake->factors[c]);
    return largest;
}

static double scalar_of(const ca_image *image, const float *pixel, const ca_gltf_bake *bake)
{
    const double value = channel_at(image, pixel, bake->channel) * bake->factors[0];
    switch (bake->pixels) {
    case CA_GLTF_CUT: return value >= bake->factors[1] ? 1.0 : 0.0;
    case CA_GLTF_GLOSS: return ca_gltf_gloss(value);
    case CA_GLTF_LARGEST: return largest_of(image, pixel, bake);
    case CA_GLTF_METAL: return ca_gltf_metal_share(largest_of(image, pixel, bake));
    case CA_GLTF_REST: return fmin(fmax(1.0 - value, 0.0), 1.0);
    case CA_GLTF_COLOR:
    case CA_GLTF_HUE:
    case CA_GLTF_NORMAL:
    case CA_GLTF_CHANNEL: break;
    }
    return value;
}

static void bake_pixel(const ca_image *image, const float *pixel, const ca_gltf_bake *bake, float *out)
{
    if (bake->pixels == CA_GLTF_COLOR || bake->pixels == CA_GLTF_HUE) {
        const double largest = bake->pixels == CA_GLTF_HUE ? largest_of(image, pixel, bake) : 1.0;
        for (uint32_t c = 0; c < 3; c++) {
            const double value = channel_at(image, pixel, c) * bake->factors[c];
            out[c] = (float)(largest > 0.0 ? value / largest : 0.0);
        }
    } else if (bake->pixels == CA_GLTF_NORMAL) {
        const double scale = bake->factors[0];
        for (uint32_t c = 0; c < 3; c++) {
            const double n = 2.0 * channel_at(image, pixel, c) - 1.0;
            out[c] = (float)(0.5 * (c < 2 ? n * scale : n) + 0.5);
        }
    } else {
        out[0] = (float)scalar_of(image, pixel, bake);
    }
}

static const char *bake_image(ca_gltf *g, const ca_gltf_value *image, const ca_gltf_bake *bake)
{
    const bool has_hue = bake->pixels == CA_GLTF_COLOR || bake->pixels == CA_GLTF_HUE;
    const bool colored = has_hue || bake->pixels == CA_GLTF_LARGEST || bake->pixels == CA_GLTF_METAL;
    const uint32_t channels = has_hue || bake->pixels == CA_GLTF_NORMAL ? 3 : 1;
    ca_image decoded;
    ca_tree_bitmap bitmap;
    if (!decode_image(g, image, colored ? CA_ENCODING_SRGB : CA_ENCODING_RAW, &decoded)) return NULL;
    const size_t pixels = (size_t)decoded.width * decoded.height;
    const bool made = ca_tree_add_bitmap(&g->tree, decoded.width, decoded.height, channels, &bitmap);
    for (size_t i = 0; i < pixels && made; i++)
        bake_pixel(&decoded, decoded.data + i * decoded.channels, bake, bitmap.pixels + i * channels);
    ca_image_destroy(&decoded);
    return made ? bitmap.name : NULL;
}

static bool is_same_bake(const ca_gltf_bake *a, const ca_gltf_bake *b)
{
    return a->image == b->image && a->pixels == b->pixels && a->channel == b->channel &&
           a->factors[0] == b->factors[0] && a->factors[1] == b->factors[1] && a->factors[2] == b->factors[2];
}

/* The bitmap of such a bake, made once. */
static const char *baked_name(ca_gltf *g, const ca_gltf_value *image, const ca_gltf_bake *bake)
{
    for (size_t i = 0; i < g->baked.count; i++)
        if (is_same_bake(&g->baked.items[i].bake, bake)) return g->baked.items[i].name;
    const char *name = bake_image(g, image, bake);
    if (!name) return NULL;
    if (!CA_TABLE_ADD(&g->baked)) {
        ca_import_fail_memory(g->importer, "images");
        return NULL;
    }
    g->baked.items[g->baked.count - 1] = (ca_gltf_baked){.bake = *bake, .name = name};
    return name;
}

/* ---- Textures -------------------------------------------------------------------------------------------------- */

static void set_sampler(ca_gltf *g, const ca_gltf_value *texture, const ca_gltf_bake *bake, ca_xml_node *node)
{
    static const char *const modes[] = {"repeat", "mirror", "clamp"};
    static const uint64_t codes[] = {10497, 33648, 33071};
    const ca_gltf_value *sampler = ca_gltf_reference(g, texture, "sampler", "samplers");
    const uint64_t s = ca_gltf_count(g, sampler, "wrapS", codes[0]), t = ca_gltf_count(g, sampler, "wrapT", codes[0]);
    size_t mode = 0;
    while (mode < 2 && codes[mode] != s) mode++;
    if (codes[mode] != s) ca_gltf_fail(g, sampler, "wrapS is not 10497, 33648 or 33071");
    if (s != t)
        ca_gltf_note(g, sampler, "a texture whose axes are wrapped in different ways is wrapped as wrapS says");
    if (mode > 0) ca_tree_string(&g->tree, node, "wrap_mode", modes[mode]);
    if (ca_gltf_count(g, sampler, "magFilter", 9729) == 9728 || bake->pixels == CA_GLTF_CUT)
        ca_tree_string(&g->tree, node, "filter_type", "nearest");
}

/* KHR_texture_transform: scale, then turn, then shift. v runs downwards in both languages. */
static void set_map(ca_gltf *g, const ca_gltf_value *transform, ca_xml_node *node)
{
    double offset[2] = {0.0, 0.0}, scale[2] = {1.0, 1.0};
    if (!transform) return;
    ca_gltf_numbers(g, transform, "offset", offset, 2);
    ca_gltf_numbers(g, transform, "scale", scale, 2);
    const double angle = ca_gltf_number(g, transform, "rotation", 0.0, -1e6, 1e6);
    const double c = cos(angle), s = sin(angle);
    const ca_matrix map = {{{c * scale[0], s * scale[1], 0.0, offset[0]},
                            {-s * scale[0], c * scale[1], 0.0, offset[1]},
                            {0.0, 0.0, 1.0, 0.0},
                            {0.0, 0.0, 0.0, 1.0}}};
    ca_affine affine;
    if (ca_import_good(g->importer) && !ca_affine_from_matrix(&map, &affine))
        ca_gltf_fail(g, transform, "maps texture coordinates to a line or a point");
    if (ca_import_good(g->importer)) ca_tree_transform(&g->tree, node, "to_uv", &map);
}

static void claim_uv_set(ca_gltf *g, const ca_gltf_value *info, const ca_gltf_value *transform, uint32_t *uv_set)
{
    const double own = ca_gltf_number(g, info, "texCoord", 0.0, 0.0, 255.0);
    const uint32_t set = (uint32_t)ca_gltf_number(g, transform, "texCoord", own, 0.0, 255.0);
    if (*uv_set == CA_NONE) *uv_set = set;
    if (*uv_set != set)
        ca_gltf_fail(g, info, "a material with TEXCOORD_%u and TEXCOORD_%u is not supported: meshes have one of them",
                     *uv_set, set);
}

/* The image of a texture; NULL after failing. */
static const ca_gltf_value *image_of(ca_gltf *g, const ca_gltf_value *texture)
{
    const ca_gltf_value *webp = ca_gltf_extension(g, texture, "EXT_texture_webp");
    const ca_gltf_value *image = ca_gltf_reference(g, webp ? webp : texture, "source", "images");
    if (image || !ca_import_good(g->importer)) return image;
    if (ca_gltf_extension(g, texture, "KHR_texture_basisu"))
        ca_gltf_fail(g, texture, "textures in KTX2 (KHR_texture_basisu) are not read, and it has no other source");
    else
        ca_gltf_fail(g, texture, "has no source");
    return NULL;
}

void ca_gltf_texture(ca_gltf *g, const ca_gltf_value *info, const ca_gltf_bake *bake, ca_xml_node *object,
                     const char *name, const char *id, uint32_t *uv_set)
{
    const ca_gltf_value *transform = ca_gltf_extension(g, info, "KHR_texture_transform");
    const ca_gltf_value *texture = ca_gltf_reference(g, info, "index", "textures");
    if (!texture && ca_import_good(g->importer)) ca_gltf_fail(g, info, "needs an index");
    const ca_gltf_value *image = texture ? image_of(g, texture) : NULL;
    if (!image) return;
    claim_uv_set(g, info, transform, uv_set);
    ca_gltf_at(g, image);
    ca_gltf_bake whole = *bake;
    whole.image = image->index;
    const char *uri = ca_gltf_text(g, image, "uri", NULL);
    const bool is_file = uri && strncasecmp(uri, "data:", 5) != 0 && is_plain_color(bake);
    const char *source = is_file ? ca_gltf_file_name(g, image, uri) : baked_name(g, image, &whole);
    if (!source || !ca_import_good(g->importer)) return;
    ca_xml_node *node = ca_tree_named_object(&g->tree, object, "texture", "bitmap", name, id);
    ca_tree_string(&g->tree, node, is_file ? "filename" : "data", source);
    if (bake->pixels == CA_GLTF_NORMAL) ca_tree_boolean(&g->tree, node, "raw", true);
    set_sampler(g, texture, bake, node);
    set_map(g, transform, node);
}
