/* Colours: <rgb>, <srgb>, <spectrum> and plain numbers as linear Rec. 709. */
#include "import/importer.h"

#include "base/hash.h"
#include "base/text.h"
#include "image/spectrum.h"
#include "import/number.h"

#include <float.h>
#include <string.h>

/* #rrggbb as fractions of 255. */
static bool parse_hex(const char *text, double rgb[3])
{
    if (text[0] != '#' || strlen(text) != 7) return false;
    for (int i = 0; i < 3; i++) {
        const int high = ca_hex_digit(text[1 + 2 * i]), low = ca_hex_digit(text[2 + 2 * i]);
        if (high < 0 || low < 0) return false;
        rgb[i] = (16 * high + low) / 255.0;
    }
    return true;
}

static bool parse_rgb(ca_importer *importer, const ca_xml_node *node, double rgb[3])
{
    const char *text = ca_xml_attribute_value(node, "value");
    const char *cursor = text, *token;
    if (text[0] == '#') {
        if (parse_hex(text, rgb)) return true;
        ca_import_fail(importer, &node->where, "\"%.60s\" is no colour of the form #rrggbb", text);
        return false;
    }
    size_t count = 0;
    while (ca_next_token(&cursor, &token) > 0) count++;
    if (count != 1) return ca_import_numbers(importer, node, "value", rgb, 3);
    if (!ca_import_numbers(importer, node, "value", rgb, 1)) return false;
    rgb[1] = rgb[2] = rgb[0];
    return true;
}

static bool decode_srgb(ca_importer *importer, const ca_xml_node *node, double rgb[3])
{
    for (int i = 0; i < 3; i++) {
        if (!(rgb[i] >= 0.0 && rgb[i] <= 1.0)) {
            ca_import_fail(importer, &node->where, "<srgb> needs values in [0, 1], not %g", rgb[i]);
            return false;
        }
        rgb[i] = (double)ca_srgb_to_linear((float)rgb[i]);
    }
    return true;
}

/* ---- Spectra --------------------------------------------------------------------------------------------------- */

typedef CA_TABLE(ca_spectrum_sample) sample_table;

static bool add_sample(ca_importer *importer, const ca_xml_node *node, sample_table *table, double wavelength,
                       double value)
{
    if (table->count > 0 && !(wavelength > table->items[table->count - 1].wavelength_nm)) {
        ca_import_fail(importer, &node->where, "the wavelengths of a spectrum must increase, and %g does not",
                       wavelength);
        return false;
    }
    if (!CA_TABLE_ADD(table)) {
        ca_import_fail_memory(importer, "a spectrum");
        return false;
    }
    table->items[table->count - 1] = (ca_spectrum_sample){.wavelength_nm = wavelength, .value = value};
    return true;
}

/* "400:0.1, 500:0.2, ..." */
static bool parse_pairs(ca_importer *importer, const ca_xml_node *node, sample_table *table)
{
    const char *cursor = ca_xml_attribute_value(node, "value"), *token;
    for (size_t length; (length = ca_next_token(&cursor, &token)) > 0;) {
        const char *colon = memchr(token, ':', length);
        double wavelength, value;
        if (!colon || !ca_parse_number(token, (size_t)(colon - token), &wavelength) ||
            !ca_parse_number(colon + 1, length - (size_t)(colon + 1 - token), &value)) {
            ca_import_fail(importer, &node->where, "\"%.*s\" is no wavelength:value pair",
                           (int)(length < 60 ? length : 60), token);
            return false;
        }
        if (!add_sample(importer, node, table, wavelength, value)) return false;
    }
    return true;
}

/* Lines of "wavelength value"; # begins a comment. */
static bool parse_spectrum_lines(ca_importer *importer, const ca_xml_node *node, const char *path, const char *text,
                                 sample_table *table)
{
    for (unsigned line = 1; *text; line++) {
        const size_t length = strcspn(text, "\n");
        const char *end = text + length, *cursor = text, *token[3];
        double number[2];
        size_t count = 0;
        for (size_t token_length; count < 3; count++) {
            cursor += strspn(cursor, " \t\r,"); /* what separates tokens, but not lines */
            if (cursor >= end || *cursor == '#') break;
            token_length = ca_next_token(&cursor, &token[count]);
            if (count < 2 && !ca_parse_number(token[count], token_length, &number[count])) count = 3;
        }
        if (count != 0 && count != 2) {
            ca_import_fail(importer, &node->where, "%s:%u: expected a wavelength and a value", path, line);
            return false;
        }
        if (count == 2 && !add_sample(importer, node, table, number[0], number[1])) return false;
        text = end + (*end == '\n');
    }
    return true;
}

static bool read_spectrum_file(ca_importer *importer, const ca_xml_node *node, sample_table *table)
{
    const char *name = ca_xml_attribute_value(node, "filename");
    const char *path = ca_document_resolve(&importer->document, node->where.file, name);
    if (!path || !ca_document_add_file(&importer->document, path)) {
        ca_import_fail_memory(importer, "a spectrum");
        return false;
    }
    ca_bytes bytes;
    ca_error reason;
    const ca_status status = ca_file_read(path, "spectrum", 16 << 20, &bytes, &reason);
    if (status != CA_OK) {
        ca_import_fail_file(importer, &node->where, status, &reason);
        return false;
    }
    uint64_t *const hash = &importer->document.content_hash;
    *hash = ca_hash_bytes(ca_hash_add(*hash, bytes.size), bytes.data, bytes.size);
    const bool text = memchr(bytes.data, 0, bytes.size) == NULL;
    if (!text) ca_import_fail(importer, &node->where, "%s is no text file", path);
    const char *start = (const char *)bytes.data + ca_byte_order_mark((const char *)bytes.data, bytes.size);
    const bool good = text && parse_spectrum_lines(importer, node, path, start, table);
    ca_bytes_destroy(&bytes);
    return good;
}

/* What the observer of image/spectrum.h sees, nm. */
#define VISIBLE_FIRST_NM 360.0
#define VISIBLE_LAST_NM 830.0

static float clip(float value, ca_color_role role)
{
    if (role == CA_COLOR_SIGNED) return value;
    if (!(value > 0.0f)) return 0.0f;
    return role == CA_COLOR_REFLECTANCE && value > 1.0f ? 1.0f : value;
}

void ca_import_check_component(ca_importer *importer, const ca_xml_node *node, double value, ca_color_role role)
{
    if (!(value >= 0.0 || role == CA_COLOR_SIGNED) || fabs(value) > (double)FLT_MAX)
        ca_import_fail(importer, &node->where, "a colour cannot have the component %g", value);
    else if (role == CA_COLOR_REFLECTANCE && value > 1.0)
        ca_import_fail(importer, &node->where, "reflectances, weights and opacities lie in [0, 1], and %g does not",
                       value);
}

/* Negative components are cut off. */
ca_rgb ca_import_samples(ca_importer *importer, const ca_xml_node *node, const ca_spectrum_sample *samples,
                         size_t count, ca_color_role role)
{
    if (count < 2) {
        ca_import_fail(importer, &node->where, "a spectrum needs at least two wavelengths");
        return ca_rgb_grey(0.0f);
    }
    const double first = samples[0].wavelength_nm, last = samples[count - 1].wavelength_nm;
    if (last <= VISIBLE_FIRST_NM || first >= VISIBLE_LAST_NM)
        ca_import_fail(importer, &node->where, "wavelengths are in nanometres: none from %g to %g is visible", first,
                       last);
    for (size_t i = 0; i < count; i++) ca_import_check_component(importer, node, samples[i].value, role);
    const ca_rgb rgb = role == CA_COLOR_EMISSION ? ca_spectrum_emission(samples, count)
                                                 : ca_spectrum_reflectance(samples, count);
    return (ca_rgb){clip(rgb.r, role), clip(rgb.g, role), clip(rgb.b, role)};
}

static ca_rgb import_samples(ca_importer *importer, const ca_xml_node *node, ca_color_role role)
{
    sample_table table = {0};
    ca_rgb result = ca_rgb_grey(0.0f);
    const bool good = ca_xml_attribute_value(node, "filename") ? read_spectrum_file(importer, node, &table)
                                                               : parse_pairs(importer, node, &table);
    if (good) result = ca_import_samples(importer, node, table.items, table.count, role);
    ca_free(table.items);
    return result;
}

/* One number, a constant spectrum: grey, but of an emitter the colour of equal energy. Three numbers, as 0.6 has
 * them, are linear Rec. 709. */
static void parse_constant(ca_importer *importer, const ca_xml_node *node, ca_color_role role, double rgb[3])
{
    static const ca_spectrum_sample one[2] = {{360.0, 1.0}, {830.0, 1.0}};
    if (!parse_rgb(importer, node, rgb) || role != CA_COLOR_EMISSION) return;
    const char *cursor = ca_xml_attribute_value(node, "value"), *token;
    if (ca_next_token(&cursor, &token) == 0 || token[0] == '#' || ca_next_token(&cursor, &token) > 0) return;
    const ca_rgb white = ca_spectrum_emission(one, CA_COUNT(one));
    rgb[0] *= (double)white.r;
    rgb[1] *= (double)white.g;
    rgb[2] *= (double)white.b;
}

/* ---- Any colour ------------------------------------------------------------------------------------------------ */

ca_rgb ca_import_color(ca_importer *importer, const ca_xml_node *node, ca_color_role role)
{
    const char *value = ca_xml_attribute_value(node, "value");
    const bool spectrum = strcmp(node->tag, "spectrum") == 0;
    if (spectrum && (value != NULL) == (ca_xml_attribute_value(node, "filename") != NULL)) {
        ca_import_fail(importer, &node->where, "<spectrum> needs either value or filename");
        return ca_rgb_grey(0.0f);
    }
    if (spectrum && (!value || strchr(value, ':'))) return import_samples(importer, node, role);
    double rgb[3] = {0.0, 0.0, 0.0};
    const bool number = strcmp(node->tag, "float") == 0 || strcmp(node->tag, "integer") == 0;
    if (number) {
        if (ca_import_numbers(importer, node, "value", rgb, 1)) rgb[1] = rgb[2] = rgb[0];
    } else if (spectrum) {
        parse_constant(importer, node, role, rgb);
    } else if (parse_rgb(importer, node, rgb) && strcmp(node->tag, "srgb") == 0) {
        decode_srgb(importer, node, rgb);
    }
    for (int i = 0; i < 3; i++) ca_import_check_component(importer, node, rgb[i], role);
    if (!ca_import_good(importer)) return ca_rgb_grey(0.0f);
    return (ca_rgb){(float)rgb[0], (float)rgb[1], (float)rgb[2]};
}
