/* Textures, and parameters that may be textures.
 *
 * pbrt's (s, t) have their origin at the lower left of a picture and v runs upwards; in the tree v runs downwards, as
 * Mitsuba's does, with v' = 1 - v on every shape. So (s, t) = (su u + du, sv v + dv) is the picture's
 * (su u + du, sv v' + 1 - sv - dv). */
#include "import/pbrt/reader.h"

#include "base/file.h"
#include "base/text.h"

#include <math.h>
#include <string.h>
#include <strings.h>

/* ---- Values ---------------------------------------------------------------------------------------------------- */

static ca_pbrt_value grey(double value) { return (ca_pbrt_value){.rgb = {value, value, value}}; }

/* The texture that a parameter names, among those of its kind. */
static ca_pbrt_value named_value(ca_pbrt *p, const ca_pbrt_parameter *parameter, ca_pbrt_names *names)
{
    if (parameter->count != 1) {
        ca_import_fail(p->importer, &parameter->where, "parameter \"%s\" names one texture", parameter->name);
        return grey(0.0);
    }
    const ca_pbrt_named *texture = ca_pbrt_name(names, parameter->texts[0]);
    if (!texture) {
        ca_pbrt_fail_name(p, &parameter->where, names == &p->color_textures ? "spectrum texture" : "float texture",
                          parameter->texts[0], names);
        return grey(0.0);
    }
    ca_pbrt_value value = {.id = texture->flag ? NULL : texture->id, .is_bright = texture->is_bright};
    memcpy(value.rgb, texture->value, sizeof value.rgb);
    return value;
}

ca_pbrt_value ca_pbrt_color_value(ca_pbrt *p, const char *name, double fallback)
{
    ca_pbrt_value value = grey(fallback);
    const ca_pbrt_parameter *parameter = ca_pbrt_find(&p->params, name);
    if (parameter && parameter->type == CA_PBRT_TEXTURE) return named_value(p, parameter, &p->color_textures);
    ca_pbrt_color(p, name, CA_COLOR_REFLECTANCE, value.rgb);
    return value;
}

ca_pbrt_value ca_pbrt_number_value(ca_pbrt *p, const char *name, double fallback)
{
    const ca_pbrt_parameter *parameter = ca_pbrt_find(&p->params, name);
    if (parameter && parameter->type == CA_PBRT_TEXTURE) return named_value(p, parameter, &p->number_textures);
    return grey(ca_pbrt_number(&p->params, name, fallback));
}

/* A new texture of the scene. */
static ca_xml_node *add_texture(ca_pbrt *p, const char *type, const char *id)
{
    return ca_tree_named_object(&p->tree, ca_tree_root(&p->tree), "texture", type, NULL, id ? id : "");
}

/* May it be over 1? */
static bool is_bright(const ca_pbrt_value *value)
{
    return value->id ? value->is_bright : fmax(value->rgb[0], fmax(value->rgb[1], value->rgb[2])) > 1.0;
}

/* Textures of the tree are not negative. */
ca_pbrt_value ca_pbrt_cut(ca_pbrt *p, const ca_pbrt_value *value)
{
    ca_pbrt_value cut = {.id = value->id};
    for (int i = 0; i < 3; i++) cut.rgb[i] = fmin(fmax(value->rgb[i], 0.0), 1.0);
    if (!value->id || !value->is_bright) return cut;
    cut.id = ca_pbrt_new_id(p, "clamped", NULL);
    ca_tree_ref(&p->tree, add_texture(p, "clamp", cut.id), NULL, value->id);
    return cut;
}

ca_pbrt_value ca_pbrt_reflectance_value(ca_pbrt *p, const char *name, double fallback)
{
    const ca_pbrt_value value = ca_pbrt_color_value(p, name, fallback);
    return ca_pbrt_cut(p, &value);
}

void ca_pbrt_put_color(ca_pbrt *p, ca_xml_node *object, const char *name, const ca_pbrt_value *value)
{
    if (value->id)
        ca_tree_ref(&p->tree, object, name, value->id);
    else
        ca_tree_rgb(&p->tree, object, name, value->rgb);
}

void ca_pbrt_put_number(ca_pbrt *p, ca_xml_node *object, const char *name, const ca_pbrt_value *value)
{
    if (value->id)
        ca_tree_ref(&p->tree, object, name, value->id);
    else
        ca_tree_float(&p->tree, object, name, value->rgb[0]);
}

static ca_pbrt_value multiplied(ca_pbrt *p, const ca_pbrt_value *value, const double factor[3])
{
    ca_pbrt_value result = *value;
    for (int i = 0; i < 3; i++) result.rgb[i] = value->rgb[i] * factor[i];
    if (value->id && fmax(factor[0], fmax(factor[1], factor[2])) > 1.0) result.is_bright = true;
    if (!value->id || (factor[0] == 1.0 && factor[1] == 1.0 && factor[2] == 1.0)) return result;
    result.id = ca_pbrt_new_id(p, "scaled", NULL);
    ca_xml_node *node = add_texture(p, "scale", result.id);
    ca_tree_rgb(&p->tree, node, "scale", factor);
    ca_tree_ref(&p->tree, node, NULL, value->id);
    return result;
}

ca_pbrt_value ca_pbrt_scaled(ca_pbrt *p, const ca_pbrt_value *value, double factor)
{
    const double factors[3] = {factor, factor, factor};
    return multiplied(p, value, factors);
}

ca_pbrt_value ca_pbrt_power(ca_pbrt *p, const ca_pbrt_value *value, double exponent)
{
    const ca_pbrt_value result = {.id = ca_pbrt_new_id(p, "power", NULL)};
    ca_xml_node *node = add_texture(p, "power", result.id);
    ca_tree_float(&p->tree, node, "exponent", exponent);
    ca_tree_ref(&p->tree, node, NULL, value->id);
    return result;
}

/* ---- Coordinates ----------------------------------------------------------------------------------------------- */

enum { BY_UV, SPHERICAL, CYLINDRICAL, PLANAR };
static const char *const mappings[] = {"uv", "spherical", "cylindrical", "planar"};

static size_t read_mapping(ca_pbrt *p)
{
    const size_t mapping = ca_pbrt_choice(&p->params, "mapping", mappings, CA_COUNT(mappings), BY_UV);
    if (mapping == CYLINDRICAL && p->version == 3)
        ca_pbrt_fail(&p->params, "mapping", "cannot be \"cylindrical\", which version 3 has on a sphere");
    return mapping;
}

/* to_uv of a picture; of a checkerboard, whose squares are of side 1 and Mitsuba's of 1/2, in pbrt's own (s, t). */
static void put_coordinates(ca_pbrt *p, ca_xml_node *texture, bool checks)
{
    ca_pbrt_params *params = &p->params;
    const bool by_uv = read_mapping(p) == BY_UV;
    const double su = by_uv ? ca_pbrt_number(params, "uscale", 1.0) : 1.0;
    const double sv = by_uv ? ca_pbrt_number(params, "vscale", 1.0) : 1.0;
    const double du = by_uv ? ca_pbrt_number(params, "udelta", 0.0) : 0.0;
    const double dv = by_uv ? ca_pbrt_number(params, "vdelta", 0.0) : 0.0;
    ca_matrix m = ca_matrix_identity();
    m.m[0][0] = checks ? 0.5 * su : su;
    m.m[0][3] = checks ? 0.5 * du : du;
    m.m[1][1] = checks ? -0.5 * sv : sv;
    m.m[1][3] = checks ? 0.5 * (sv + dv) : 1.0 - sv - dv;
    if (su == 0.0 || sv == 0.0) ca_pbrt_fail(params, su == 0.0 ? "uscale" : "vscale", "must not be 0");
    if (checks || su != 1.0 || sv != 1.0 || du != 0.0 || dv != 0.0) ca_tree_transform(&p->tree, texture, "to_uv", &m);
}

/* From the texture's space to one whose (s, t) is the tree's (s, 1 - t). */
static ca_matrix turned_down(ca_pbrt *p, size_t mapping)
{
    ca_matrix m = ca_matrix_identity();
    double v1[3] = {1.0, 0.0, 0.0}, v2[3] = {0.0, 1.0, 0.0};
    if (mapping == SPHERICAL) m.m[1][1] = -1.0; /* 2 pi - phi */
    if (mapping == CYLINDRICAL) m.m[2][2] = -1.0, m.m[2][3] = 1.0;
    if (mapping != PLANAR) return m;
    ca_pbrt_point(&p->params, "v1", v1);
    ca_pbrt_point(&p->params, "v2", v2);
    for (int i = 0; i < 3; i++) m.m[0][i] = v1[i], m.m[1][i] = -v2[i];
    /* The third coordinate has no effect; a transform can be inverted. */
    const double across[3] = {v1[1] * v2[2] - v1[2] * v2[1], v1[2] * v2[0] - v1[0] * v2[2],
                              v1[0] * v2[1] - v1[1] * v2[0]};
    const double length = sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
    if (!(length > 0.0)) ca_pbrt_fail(&p->params, "v1", "must not be parallel to v2");
    for (int i = 0; i < 3; i++) m.m[2][i] = across[i] / length;
    m.m[0][3] = ca_pbrt_number(&p->params, "udelta", 0.0);
    m.m[1][3] = 1.0 - ca_pbrt_number(&p->params, "vdelta", 0.0);
    return m;
}

/* Where the coordinates follow from the position, in the space of the directive, the texture around that of `id`. */
static const char *put_mapping(ca_pbrt *p, const char *id)
{
    const size_t mapping = read_mapping(p);
    ca_matrix from_world;
    if (mapping == BY_UV) return id;
    if (!ca_matrix_invert(&p->state.ctm, &from_world)) {
        ca_import_fail(p->importer, &p->params.where, "%s: the transform cannot be inverted", p->params.what);
        return id;
    }
    const ca_matrix down = turned_down(p, mapping), to_texture = ca_matrix_multiply(&down, &from_world);
    const char *mapped = ca_pbrt_new_id(p, "mapped", NULL);
    ca_xml_node *node = add_texture(p, "mapped", mapped);
    ca_tree_string(&p->tree, node, "mapping", mappings[mapping]);
    ca_tree_transform(&p->tree, node, "to_texture", &to_texture);
    ca_tree_ref(&p->tree, node, NULL, id);
    return mapped;
}

/* ---- The kinds ------------------------------------------------------------------------------------------------- */

typedef struct texture_reading {
    ca_pbrt *p;
    const char *id;
    bool is_number;
} texture_reading;

static ca_pbrt_value value_of(const texture_reading *r, const char *name, double fallback)
{
    return r->is_number ? ca_pbrt_number_value(r->p, name, fallback) : ca_pbrt_color_value(r->p, name, fallback);
}

static void put_value(const texture_reading *r, ca_xml_node *object, const char *name, const ca_pbrt_value *value)
{
    if (r->is_number)
        ca_pbrt_put_number(r->p, object, name, value);
    else
        ca_pbrt_put_color(r->p, object, name, value);
}

static ca_pbrt_value read_constant(const texture_reading *r) { return value_of(r, "value", 1.0); }

static ca_pbrt_value put_mix(const texture_reading *r, const ca_pbrt_value *a, const ca_pbrt_value *b,
                             const ca_pbrt_value *weight)
{
    ca_xml_node *node = add_texture(r->p, "mix", r->id);
    put_value(r, node, "color0", a);
    put_value(r, node, "color1", b);
    ca_pbrt_put_number(r->p, node, "weight", weight);
    return (ca_pbrt_value){.id = r->id, .is_bright = is_bright(a) || is_bright(b) || is_bright(weight)};
}

/* Of two textures that vary; `number`: the second is one. */
static ca_pbrt_value put_product(const texture_reading *r, const ca_pbrt_value *a, const ca_pbrt_value *b,
                                 bool number)
{
    const ca_pbrt_value black = grey(0.0);
    if (number) return put_mix(r, &black, a, b);
    ca_xml_node *node = add_texture(r->p, "scale", r->id);
    ca_tree_ref(&r->p->tree, node, "scale", b->id);
    ca_tree_ref(&r->p->tree, node, NULL, a->id);
    return (ca_pbrt_value){.id = r->id, .is_bright = is_bright(a) || is_bright(b)};
}

/* Version 3's, which may be over 1. */
static ca_pbrt_value factor_of(const texture_reading *r, const char *name)
{
    const ca_pbrt_parameter *parameter = ca_pbrt_find(&r->p->params, name);
    ca_pbrt_value value = value_of(r, name, 1.0);
    if (parameter && !r->is_number && parameter->type == CA_PBRT_RGB)
        ca_pbrt_color(r->p, name, CA_COLOR_EMISSION, value.rgb);
    return value;
}

/* A constant that is no factor is a reflectance. */
static ca_pbrt_value cut_constant(const texture_reading *r, ca_pbrt_value value)
{
    for (int i = 0; i < 3 && !value.id && !r->is_number; i++) value.rgb[i] = fmin(value.rgb[i], 1.0);
    return value;
}

/* Version 3: tex1 times tex2; version 4: tex times scale, a number. */
static ca_pbrt_value read_scale(const texture_reading *r)
{
    ca_pbrt *p = r->p;
    const bool old = ca_pbrt_find(&p->params, "tex1") || ca_pbrt_find(&p->params, "tex2");
    const ca_pbrt_value a = old ? factor_of(r, "tex1") : value_of(r, "tex", 1.0);
    const ca_pbrt_value b = old ? factor_of(r, "tex2") : ca_pbrt_number_value(p, "scale", 1.0);
    if (a.id && b.id) return put_product(r, &a, &b, !old || r->is_number);
    return cut_constant(r, a.id ? multiplied(p, &a, b.rgb) : multiplied(p, &b, a.rgb));
}

static ca_pbrt_value read_mix(const texture_reading *r)
{
    ca_pbrt *p = r->p;
    const ca_pbrt_value a = value_of(r, "tex1", 0.0), b = value_of(r, "tex2", 1.0);
    const ca_pbrt_value said = ca_pbrt_number_value(p, "amount", 0.5), amount = ca_pbrt_cut(p, &said);
    ca_pbrt_value result = {.rgb = {0.0}};
    const double t = amount.rgb[0];
    if (!amount.id && t == 0.0) return a;
    if (!amount.id && t == 1.0) return b;
    if (a.id || b.id || amount.id) return put_mix(r, &a, &b, &amount);
    for (int i = 0; i < 3; i++) result.rgb[i] = (1.0 - t) * a.rgb[i] + t * b.rgb[i];
    return result;
}

/* The first where the surface lies across a direction, of the directive's space, and the second along it. */
static ca_pbrt_value read_direction_mix(const texture_reading *r)
{
    ca_pbrt *p = r->p;
    const ca_matrix *ctm = &p->state.ctm;
    const ca_pbrt_value a = value_of(r, "tex1", 0.0), b = value_of(r, "tex2", 1.0);
    double d[3] = {0.0, 1.0, 0.0}, across[3];
    ca_pbrt_point(&p->params, "dir", d);
    for (int i = 0; i < 3; i++) across[i] = ctm->m[i][0] * d[0] + ctm->m[i][1] * d[1] + ctm->m[i][2] * d[2];
    if (!(fabs(across[0]) + fabs(across[1]) + fabs(across[2]) > 0.0))
        ca_pbrt_fail(&p->params, "dir", "must have a length over 0");
    const ca_pbrt_value weight = {.id = ca_pbrt_new_id(p, "facing", NULL)};
    ca_tree_point(&p->tree, add_texture(p, "facing", weight.id), "direction", across);
    return put_mix(r, &b, &a, &weight);
}

/* Where a number is asked for, the tree's checkerboard has its colours exchanged. */
static ca_pbrt_value read_checkerboard(const texture_reading *r)
{
    ca_pbrt *p = r->p;
    static const char *const without_effect[] = {"aamode"};
    const ca_pbrt_value a = value_of(r, "tex1", 1.0), b = value_of(r, "tex2", 0.0);
    if (ca_pbrt_integer_in(&p->params, "dimension", 2, 2, 3) == 3)
        ca_pbrt_fail(&p->params, "dimension", "must be 2: there are no boards of cubes");
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    ca_xml_node *node = add_texture(p, "checkerboard", r->id);
    put_value(r, node, "color0", r->is_number ? &b : &a);
    put_value(r, node, "color1", r->is_number ? &a : &b);
    put_coordinates(p, node, true);
    return (ca_pbrt_value){.id = put_mapping(p, r->id), .is_bright = is_bright(&a) || is_bright(&b)};
}

static const char *wrap_mode(ca_pbrt *p)
{
    static const char *const modes[] = {"repeat", "clamp", "black"}, *const ours[] = {"repeat", "clamp", "zero"};
    return ours[ca_pbrt_choice(&p->params, "wrap", modes, CA_COUNT(modes), 0)];
}

/* Version 4's encoding, version 3's gamma. */
static bool is_raw(ca_pbrt *p)
{
    const char *encoding = ca_pbrt_string(&p->params, "encoding", "sRGB");
    const bool raw = !ca_pbrt_boolean(&p->params, "gamma", true);
    if (strcmp(encoding, "linear") == 0) return true;
    if (strncmp(encoding, "gamma ", 6) == 0)
        ca_import_note(p->importer, &p->params.where, "texture encodings \"gamma\" are read as \"sRGB\"");
    else if (strcmp(encoding, "sRGB") != 0)
        ca_pbrt_fail(&p->params, "encoding", "must be \"sRGB\", \"linear\" or \"gamma\" and a number");
    return raw;
}

ca_xml_node *ca_pbrt_add_bitmap(ca_pbrt *p, ca_xml_node *parent, const char *name, const char *file, bool raw)
{
    ca_xml_node *node = ca_tree_named_object(&p->tree, parent, "texture", "bitmap", name, NULL);
    ca_tree_string(&p->tree, node, "filename", file);
    if (raw) ca_tree_boolean(&p->tree, node, "raw", true);
    return node;
}

bool ca_pbrt_read_picture(ca_pbrt *p, const char *name, ca_image_encoding encoding, ca_image *image)
{
    ca_error reason;
    const char *path = ca_import_good(p->importer) ? ca_pbrt_file(p, name) : NULL;
    if (path) path = ca_document_add_file(&p->importer->document, path);
    if (!path) {
        ca_import_fail_memory(p->importer, "a file name");
        return false;
    }
    const ca_status status = ca_image_read(path, encoding, image, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(p->importer, &p->params.where, status, &reason);
        return false;
    }
    ca_document_add_content(&p->importer->document, &image->content_hash, sizeof image->content_hash);
    return true;
}

/* Version 4 takes a number from alpha, unless it is 1 everywhere, else from the mean of the channels. */
static double number_at(const ca_image *image, size_t pixel, bool from_alpha)
{
    const float *values = image->data + pixel * image->channels;
    if (from_alpha) return (double)values[3];
    return ((double)values[0] + (double)values[1] + (double)values[2]) / 3.0;
}

static bool has_alpha(const ca_image *image)
{
    const size_t pixels = (size_t)image->width * image->height;
    for (size_t i = 0; image->channels == 4 && i < pixels; i++)
        if (image->data[4 * i + 3] != 1.0f) return true;
    return false;
}

/* A bitmap of one channel of a picture that has colours; NULL: it has none, or that failed. */
static ca_xml_node *add_numbers(const texture_reading *r, const char *file, bool raw)
{
    ca_pbrt *p = r->p;
    ca_image image;
    ca_tree_bitmap bitmap;
    ca_xml_node *node = NULL;
    const ca_image_encoding encoding = raw ? CA_ENCODING_RAW : CA_ENCODING_SRGB;
    if (!ca_pbrt_read_picture(p, file, encoding, &image)) return NULL;
    const size_t pixels = (size_t)image.width * image.height;
    const bool from_alpha = has_alpha(&image);
    if (image.channels >= 3 && ca_tree_add_bitmap(&p->tree, image.width, image.height, 1, &bitmap)) {
        for (size_t i = 0; i < pixels; i++) bitmap.pixels[i] = (float)number_at(&image, i, from_alpha);
        node = ca_tree_object(&p->tree, ca_tree_root(&p->tree), "texture", "bitmap");
        ca_tree_string(&p->tree, node, "data", bitmap.name);
    }
    ca_image_destroy(&image);
    return node;
}

static ca_xml_node *add_picture(const texture_reading *r, const char *file)
{
    const bool raw = is_raw(r->p);
    ca_xml_node *numbers =
        r->is_number && r->p->version == 4 && ca_import_good(r->p->importer) ? add_numbers(r, file, raw) : NULL;
    return numbers ? numbers : ca_pbrt_add_bitmap(r->p, ca_tree_root(&r->p->tree), NULL, file, raw);
}

/* By its name: a format that has values over 1. */
static bool has_large_values(const char *file)
{
    static const char *const endings[] = {".exr", ".hdr", ".pfm"};
    for (size_t i = 0; i < CA_COUNT(endings); i++)
        if (strcasecmp(ca_path_extension(file), endings[i]) == 0) return true;
    return false;
}

/* 1 - s v, and 0 where that is negative, which is what a mix does. A number is 1 mixed with 1 - s by v; a colour,
 * whose channels differ, is twice the mean of 1 and -s v. */
static ca_pbrt_value put_inverse(const texture_reading *r, const ca_pbrt_value *image, double scale)
{
    const ca_pbrt_value one = grey(1.0), half = grey(0.5), rest = grey(1.0 - scale);
    const char *id = ca_pbrt_new_id(r->p, "inverted", NULL);
    const texture_reading inner = {.p = r->p, .id = id, .is_number = r->is_number};
    if (r->is_number) return put_mix(&inner, &one, &rest, image);
    const ca_pbrt_value negative = ca_pbrt_scaled(r->p, image, -scale);
    const ca_pbrt_value mean = put_mix(&inner, &one, &negative, &half);
    return ca_pbrt_scaled(r->p, &mean, 2.0);
}

static ca_pbrt_value read_image(const texture_reading *r)
{
    ca_pbrt *p = r->p;
    static const char *const filters[] = {"bilinear", "point", "trilinear", "ewa", "EWA"};
    static const char *const without_effect[] = {"maxanisotropy", "trilinear"};
    const char *file = ca_pbrt_string(&p->params, "filename", NULL);
    if (!file) ca_pbrt_fail(&p->params, "filename", "is missing");
    const bool inverted = ca_pbrt_boolean(&p->params, "invert", false);
    const double scale = ca_pbrt_number(&p->params, "scale", 1.0);
    const size_t filter = ca_pbrt_choice(&p->params, "filter", filters, CA_COUNT(filters), 0);
    ca_pbrt_value plain = {.is_bright = file && has_large_values(file)};
    ca_pbrt_ignore(&p->params, without_effect, CA_COUNT(without_effect));
    ca_xml_node *node = add_picture(r, file ? file : "");
    ca_tree_set(&p->tree, node, "id", r->id ? r->id : "");
    ca_tree_string(&p->tree, node, "filter_type", filter == 1 ? "nearest" : "bilinear");
    ca_tree_string(&p->tree, node, "wrap_mode", wrap_mode(p));
    put_coordinates(p, node, false);
    plain.id = put_mapping(p, r->id);
    return inverted ? put_inverse(r, &plain, scale) : ca_pbrt_scaled(p, &plain, scale);
}

typedef struct texture_kind {
    const char *name;
    ca_pbrt_value (*read)(const texture_reading *r);
} texture_kind;

static const texture_kind kinds[] = {
    {"constant", read_constant},         {"scale", read_scale},    {"mix", read_mix},
    {"checkerboard", read_checkerboard}, {"imagemap", read_image}, {"directionmix", read_direction_mix},
};

static const char *const unsupported[] = {"bilerp", "dots", "fbm", "marble", "ptex", "uv", "wrinkled", "windy"};

static const texture_kind *find_kind(ca_pbrt *p, const char *name)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < CA_COUNT(kinds); i++) {
        if (strcmp(kinds[i].name, name) == 0) return &kinds[i];
        nearest = ca_nearer_name(name, nearest, kinds[i].name);
    }
    for (size_t i = 0; i < CA_COUNT(unsupported); i++)
        if (strcmp(unsupported[i], name) == 0)
            ca_import_fail(p->importer, &p->params.where, "%s: this texture is not supported", p->params.what);
    ca_import_fail(p->importer, &p->params.where, "%s is not a known texture; the nearest is \"%s\"", p->params.what,
                   nearest);
    return NULL;
}

void ca_pbrt_read_texture(ca_pbrt *p, const char *name, const char *type, const char *kind_name)
{
    static const char *const types[] = {"float", "spectrum", "color"};
    const bool is_number = strcmp(type, types[0]) == 0;
    if (!is_number && strcmp(type, types[1]) != 0 && strcmp(type, types[2]) != 0)
        ca_import_fail(p->importer, &p->params.where, "textures are \"float\" or \"spectrum\", not \"%s\"", type);
    const texture_kind *kind = find_kind(p, kind_name);
    if (!kind) return;
    const texture_reading r = {.p = p, .id = ca_pbrt_new_id(p, "texture", name), .is_number = is_number};
    const ca_pbrt_value value = kind->read(&r);
    if (!ca_import_good(p->importer)) return;
    ca_pbrt_named *named = ca_pbrt_define(p, is_number ? &p->number_textures : &p->color_textures, name);
    if (!named) return;
    named->id = value.id;
    named->flag = value.id == NULL;
    named->is_bright = value.is_bright;
    p->has_pictures = p->has_pictures || value.id;
    memcpy(named->value, value.rgb, sizeof named->value);
}
