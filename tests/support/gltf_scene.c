#include "support/gltf_scene.h"

#include "image/image.h"
#include "support/sample_files.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- The square ------------------------------------------------------------------------------------------------ */

enum { CORNERS = 4, PIXELS = SAMPLE_WIDTH * SAMPLE_HEIGHT };

static const float positions[CORNERS * 3] = {-1, -1, 0, 1, -1, 0.25f, 1, 1, 0, -1, 1, -0.125f};
static const float normals[CORNERS * 3] = {0, 0, 1, 0.28f, 0, 0.96f, 0, 0.6f, 0.8f, 0, 0, 1};
static const float uvs[CORNERS * 2] = {0, 1, 1, 1, 1, 0, 0, 0};
static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
static const float colors[CORNERS * 3] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5f, 0.25f, 0.75f};
static const unsigned char byte_colors[CORNERS * 4] = {255, 0, 51,  255, 0,   255, 0, 255,
                                                       102, 0, 255, 255, 255, 255, 0, 255};

static void put_floats(sample_bytes *bytes, const float *values, size_t count)
{
    for (size_t i = 0; i < count; i++) sample_f32(bytes, values[i]);
}

/* Views 0 to 14, in the order of the offsets below. */
static void put_square(sample_bytes *bytes)
{
    static const unsigned strip[4] = {0, 1, 3, 2}, fan[4] = {0, 1, 2, 3};
    put_floats(bytes, positions, 12); /* 0 */
    put_floats(bytes, normals, 12);   /* 48 */
    put_floats(bytes, uvs, 8);        /* 96 */
    for (int i = 0; i < 6; i++) sample_u16(bytes, triangles[i]); /* 128 */
    sample_u32(bytes, 0);             /* 140: padding */
    put_floats(bytes, colors, 12);    /* 144 */
    sample_append(bytes, byte_colors, sizeof byte_colors); /* 192 */
    put_floats(bytes, (const float[12]){-1, -1, 0, 9, 9, 9, 1, 1, 0, 9, 9, 9}, 12); /* 208: two corners are wrong */
    sample_u16(bytes, 1), sample_u16(bytes, 3);             /* 256: which */
    put_floats(bytes, positions + 3, 3), put_floats(bytes, positions + 9, 3); /* 260 */
    for (int i = 0; i < CORNERS; i++) { /* 284: u16 pairs, 8 bytes apart */
        sample_u16(bytes, uvs[2 * i] > 0 ? 65535 : 0), sample_u16(bytes, uvs[2 * i + 1] > 0 ? 65535 : 0);
        sample_u32(bytes, 0xffffffff);
    }
    for (int i = 0; i < 4; i++) sample_u8(bytes, strip[i]); /* 316 */
    for (int i = 0; i < 4; i++) sample_u8(bytes, fan[i]);   /* 320 */
    for (int i = 0; i < 12; i++) sample_f32(bytes, 1.0f);   /* 324 */
    for (int i = 0; i < 12; i++) sample_f32(bytes, i % 3 == 2 ? 0.5f : 1.0f); /* 372 */
    for (int i = 0; i < 8; i++) sample_f32(bytes, i % 2 == 0 ? 1.0f - uvs[i] : uvs[i]); /* 420 */
}

static const char views[] =
    "'bufferViews':[{'buffer':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':48},"
    "{'buffer':0,'byteOffset':96,'byteLength':32},{'buffer':0,'byteOffset':128,'byteLength':12},"
    "{'buffer':0,'byteOffset':144,'byteLength':48},{'buffer':0,'byteOffset':192,'byteLength':16},"
    "{'buffer':0,'byteOffset':208,'byteLength':48},{'buffer':0,'byteOffset':256,'byteLength':4},"
    "{'buffer':0,'byteOffset':260,'byteLength':24},{'buffer':0,'byteOffset':284,'byteLength':32,'byteStride':8},"
    "{'buffer':0,'byteOffset':316,'byteLength':4},{'buffer':0,'byteOffset':320,'byteLength':4},"
    "{'buffer':0,'byteOffset':324,'byteLength':48},{'buffer':0,'byteOffset':372,'byteLength':48},"
    "{'buffer':0,'byteOffset':420,'byteLength':32}],\n"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'},"
    "{'bufferView':1,'componentType':5126,'count':4,'type':'VEC3'},"
    "{'bufferView':2,'componentType':5126,'count':4,'type':'VEC2'},"
    "{'bufferView':3,'componentType':5123,'count':6,'type':'SCALAR'},"
    "{'bufferView':4,'componentType':5126,'count':4,'type':'VEC3'},"
    "{'bufferView':5,'componentType':5121,'count':4,'type':'VEC4','normalized':true},"
    "{'bufferView':6,'componentType':5126,'count':4,'type':'VEC3','sparse':{'count':2,"
    "'indices':{'bufferView':7,'componentType':5123},'values':{'bufferView':8}}},"
    "{'bufferView':9,'componentType':5123,'count':4,'type':'VEC2','normalized':true},"
    "{'bufferView':10,'componentType':5121,'count':4,'type':'SCALAR'},"
    "{'bufferView':11,'componentType':5121,'count':4,'type':'SCALAR'},"
    "{'componentType':5126,'count':4,'type':'VEC3'},"
    "{'bufferView':12,'componentType':5126,'count':4,'type':'VEC3'},"
    "{'bufferView':13,'componentType':5126,'count':4,'type':'VEC3'},"
    "{'bufferView':14,'componentType':5126,'count':4,'type':'VEC2'}],\n"
    "'buffers':[{'uri':'square.bin','byteLength':452}]";

static void with_quotes(char *text)
{
    for (; *text; text++)
        if (*text == '\'') *text = '"';
}

void gltf_case_text(const gltf_case *c, char *text, size_t size)
{
    const char *attributes = c->attributes ? c->attributes : "'POSITION':0,'NORMAL':1,'TEXCOORD_0':2";
    snprintf(text, size,
             "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0,1,2]}],\n"
             "'nodes':[{'name':'Eye','camera':0,'translation':[0.25,0.125,4]},{'mesh':0%s},{%s}],\n"
             "'cameras':[{'type':'perspective','perspective':"
             "{'yfov':0.75,'aspectRatio':1.5,'znear':0.125,'zfar':100}}],\n"
             "'meshes':[{'primitives':[{'attributes':{%s}%s%s}]}],\n%s%s\n%s}\n",
             c->node, c->light, attributes, strstr(c->primitive, "'indices'") ? "" : ",'indices':3", c->primitive,
             c->top, c->top[0] ? "," : "", views);
    with_quotes(text);
}

void gltf_case_twin(const gltf_case *c, char *text, size_t size)
{
    snprintf(text, size,
             "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='%.17g'/>"
             "<string name='fov_axis' value='y'/><float name='near_clip' value='0.125'/>"
             "<float name='far_clip' value='100'/><transform name='to_world'>"
             "<matrix value='-1 0 0 0.25 0 1 0 0.125 0 0 -1 4 0 0 0 1'/></transform><film type='hdrfilm'>"
             "<integer name='width' value='768'/><integer name='height' value='512'/></film></sensor>\n%s\n"
             "</scene>\n",
             180.0 / 3.14159265358979323846 * 0.75, c->twin);
    with_quotes(text);
}

/* ---- Arrays of the twins --------------------------------------------------------------------------------------- */

static float linear(unsigned x, unsigned y, unsigned c)
{
    return ca_srgb_to_linear((float)sample_code(x, y, c) / 255.0f);
}

static float raw(unsigned x, unsigned y, unsigned c) { return (float)sample_code(x, y, c) / 255.0f; }

static float gloss(float roughness)
{
    const double alpha = (double)roughness * (double)roughness;
    return (float)fmin(fmax((0.1 - alpha) / 0.099, 0.0), 1.0);
}

ca_scene_source gltf_twin_source(const char *text, const char *path)
{
    static const uint32_t fan[6] = {1, 2, 0, 2, 3, 0}, strip[6] = {0, 1, 3, 1, 2, 3};
#define MESH(its_name, its_normals, its_uvs, its_indices)                                                           \
    {.name = its_name, .vertex_count = CORNERS, .triangle_count = 2, .positions = positions, .normals = its_normals, \
     .uvs = its_uvs, .indices = its_indices}
    static const ca_mesh_data meshes[] = {MESH("square", normals, uvs, triangles),
                                          MESH("plain", normals, NULL, triangles),
                                          MESH("flat", NULL, NULL, triangles), MESH("fan", normals, NULL, fan),
                                          MESH("strip", normals, NULL, strip)};
    static const double factors[3] = {0.5, 0.25, 0.75};
    static float tinted[3 * PIXELS], green[PIXELS], blue[PIXELS], red[PIXELS], alpha[PIXELS], cut[PIXELS],
        bumps[3 * PIXELS], turned[3 * PIXELS], coat[PIXELS], glow[3 * PIXELS], dull[PIXELS], metal[PIXELS],
        hue[3 * PIXELS];
    for (unsigned y = 0; y < SAMPLE_HEIGHT; y++)
        for (unsigned x = 0; x < SAMPLE_WIDTH; x++) {
            const size_t i = (size_t)y * SAMPLE_WIDTH + x;
            green[i] = (float)((double)raw(x, y, 1) * 0.5);
            blue[i] = (float)((double)raw(x, y, 2) * 0.75);
            red[i] = (float)((double)raw(x, y, 0) * 0.5);
            alpha[i] = (float)((double)raw(x, y, 3) * 0.75);
            cut[i] = (double)raw(x, y, 3) * 1.0 >= 0.5 ? 1.0f : 0.0f;
            coat[i] = gloss((float)((double)raw(x, y, 1) * 0.25));
            dull[i] = (float)(1.0 - (double)raw(x, y, 3) * 0.75);
            double largest = 0.0;
            for (unsigned c = 0; c < 3; c++) {
                const double n = 2.0 * (double)raw(x, y, c) - 1.0;
                tinted[3 * i + c] = (float)((double)linear(x, y, c) * factors[c]);
                largest = fmax(largest, (double)linear(x, y, c) * factors[c]);
                glow[3 * i + c] = (float)((double)linear(x, y, c) * factors[c] * 8.0);
                bumps[3 * i + c] = (float)(0.5 * (c < 2 ? n * 0.25 : n) + 0.5);
                turned[3 * ((size_t)y * SAMPLE_WIDTH + SAMPLE_WIDTH - 1 - x) + c] =
                    (float)(0.5 * (c < 2 ? (c == 0 ? -n : n) * 0.25 : n) + 0.5);
            }
            metal[i] = (float)fmax((largest - 0.04) / (1.0 - 0.04), 0.0);
            for (unsigned c = 0; c < 3 && largest > 0.0; c++)
                hue[3 * i + c] = (float)((double)linear(x, y, c) * factors[c] / largest);
        }
#define BITMAP(name, channels) {#name, SAMPLE_WIDTH, SAMPLE_HEIGHT, channels, name}
    static const ca_bitmap_data bitmaps[] = {BITMAP(tinted, 3), BITMAP(green, 1), BITMAP(blue, 1),
                                             BITMAP(red, 1),    BITMAP(alpha, 1), BITMAP(cut, 1),
                                             BITMAP(bumps, 3),  BITMAP(coat, 1),  BITMAP(glow, 3),
                                             BITMAP(turned, 3),
                                             BITMAP(dull, 1),   BITMAP(metal, 1), BITMAP(hue, 3)};
    return (ca_scene_source){.text = text, .size = strlen(text), .path = path, .meshes = meshes, .mesh_count = 5,
                             .bitmaps = bitmaps, .bitmap_count = sizeof bitmaps / sizeof *bitmaps};
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static void write_file(const char *folder, const char *name, sample_bytes *bytes)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    if (file) fwrite(bytes->data, 1, bytes->size, file);
    if (file) fclose(file);
    sample_free(bytes);
}

void gltf_write_files(const char *folder)
{
    sample_bytes square = {0}, map = sample_png(8, 4, false), webp = sample_webp(false, true);
    put_square(&square);
    write_file(folder, "square.bin", &square);
    write_file(folder, "map.png", &map);
    write_file(folder, "map.webp", &webp);
}
