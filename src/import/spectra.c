/* <spectrum type="...">: colours with parameters of their own. */
#include "import/importer.h"

#include "base/text.h"
#include "import/number.h"

#include <string.h>

typedef CA_TABLE(double) number_table;

/* The numbers of a list in a <string>; false after failing. */
static bool read_list(ca_props *props, const char *name, number_table *list)
{
    const ca_xml_node *node = ca_props_find(props, name);
    const char *cursor = ca_props_string(props, name, NULL), *token;
    if (!cursor) {
        ca_props_fail(props, name, "is missing");
        return false;
    }
    for (size_t length; (length = ca_next_token(&cursor, &token)) > 0;) {
        double number;
        if (!ca_parse_number(token, length, &number)) {
            ca_import_fail(props->importer, &node->where, "\"%.*s\" is no number", (int)(length < 60 ? length : 60),
                           token);
            return false;
        }
        if (!CA_TABLE_ADD(list)) {
            ca_import_fail_memory(props->importer, "a spectrum");
            return false;
        }
        list->items[list->count - 1] = number;
    }
    return true;
}

/* ---- Samples --------------------------------------------------------------------------------------------------- */

static ca_rgb color_of_lists(ca_props *props, const number_table *wavelengths, const number_table *values,
                             ca_color_role role)
{
    ca_rgb color = {0.0f, 0.0f, 0.0f};
    const size_t count = values->count;
    if (wavelengths->count != count) {
        ca_import_fail(props->importer, &props->node->where, "there are %zu wavelengths, but %zu %s",
                       wavelengths->count, count, ca_noun((double)count, "value", "values"));
        return color;
    }
    ca_spectrum_sample *samples = ca_alloc(count, sizeof *samples);
    if (!samples) ca_import_fail_memory(props->importer, "a spectrum");
    for (size_t i = 0; i < count && samples; i++) {
        samples[i] = (ca_spectrum_sample){.wavelength_nm = wavelengths->items[i], .value = values->items[i]};
        if (i > 0 && !(samples[i].wavelength_nm > samples[i - 1].wavelength_nm))
            ca_import_fail(props->importer, &props->node->where,
                           "the wavelengths of a spectrum must increase, and %g does not", samples[i].wavelength_nm);
    }
    if (ca_import_good(props->importer))
        color = ca_import_samples(props->importer, props->node, samples, count, role);
    ca_free(samples);
    return color;
}

static ca_rgb import_irregular(ca_props *props, ca_color_role role)
{
    number_table wavelengths = {0}, values = {0};
    ca_rgb color = {0.0f, 0.0f, 0.0f};
    if (read_list(props, "wavelengths", &wavelengths) && read_list(props, "values", &values))
        color = color_of_lists(props, &wavelengths, &values, role);
    ca_free(wavelengths.items);
    ca_free(values.items);
    return color;
}

/* Values at equal distances. */
static ca_rgb import_regular(ca_props *props, ca_color_role role)
{
    number_table wavelengths = {0}, values = {0};
    ca_rgb color = {0.0f, 0.0f, 0.0f};
    const double first = ca_props_number_in(props, "wavelength_min", 360.0, 1.0, 1e6);
    const double last = ca_props_number_in(props, "wavelength_max", 830.0, 1.0, 1e6);
    bool good = read_list(props, "values", &values);
    const double step = (last - first) / (double)(values.count > 1 ? values.count - 1 : 1);
    for (size_t i = 0; i < values.count && good; i++) {
        good = CA_TABLE_ADD(&wavelengths);
        if (good)
            wavelengths.items[i] = first + step * (double)i;
        else
            ca_import_fail_memory(props->importer, "a spectrum");
    }
    if (good) color = color_of_lists(props, &wavelengths, &values, role);
    ca_free(wavelengths.items);
    ca_free(values.items);
    return color;
}

/* ---- Lights ---------------------------------------------------------------------------------------------------- */

static ca_rgb import_blackbody(ca_props *props, ca_color_role role)
{
    ca_spectrum_sample samples[CA_BLACKBODY_SAMPLES];
    if (!ca_props_find(props, "temperature")) ca_props_fail(props, "temperature", "is missing");
    const double kelvin = ca_props_number_in(props, "temperature", 5000.0, 100.0, 1e5);
    const float scale = (float)ca_props_number_in(props, "scale", 1.0, 0.0, 1e30);
    ca_spectrum_blackbody(kelvin, samples);
    const ca_rgb color = ca_import_samples(props->importer, props->node, samples, CA_BLACKBODY_SAMPLES, role);
    return ca_rgb_scale(color, scale);
}

/* The white of Rec. 709, or a colour of such a light. */
static ca_rgb import_d65(ca_props *props, ca_color_role role)
{
    const float scale = (float)ca_props_number_in(props, "scale", 1.0, 0.0, 1e30);
    const ca_rgb color = ca_rgb_scale(ca_props_color(props, "color", ca_rgb_grey(1.0f), role), scale);
    ca_import_check_component(props->importer, props->node, (double)ca_rgb_max(color), role);
    return color;
}

/* ---- Plain numbers --------------------------------------------------------------------------------------------- */

/* As Mitsuba's RGB modes have it: grey for emitters too. */
static ca_rgb import_uniform(ca_props *props, ca_color_role role)
{
    const double high = role == CA_COLOR_REFLECTANCE ? 1.0 : 1e30;
    return ca_rgb_grey((float)ca_props_number_in(props, "value", 1.0, 0.0, high));
}

static ca_rgb import_srgb(ca_props *props, ca_color_role role)
{
    return ca_props_color(props, "color", ca_rgb_grey(1.0f), role);
}

/* A number or a vector of three. */
static ca_rgb import_raw(ca_props *props, ca_color_role role)
{
    double xyz[3];
    const ca_xml_node *node = ca_props_find(props, "value");
    if (!node) ca_props_fail(props, "value", "is missing");
    if (!node || strcmp(node->tag, "vector") != 0)
        return ca_props_color(props, "value", ca_rgb_grey(0.0f), role);
    ca_props_point(props, "value", xyz);
    for (int i = 0; i < 3; i++) ca_import_check_component(props->importer, node, xyz[i], role);
    return (ca_rgb){(float)xyz[0], (float)xyz[1], (float)xyz[2]};
}

/* ---- The table ------------------------------------------------------------------------------------------------- */

static ca_rgb (*const imports[CA_IMPORT_SPECTRUM_COUNT])(ca_props *props, ca_color_role role) = {
    import_d65, import_uniform, import_regular, import_irregular, import_blackbody, import_raw, import_srgb};
const char *const ca_import_spectrum_names[CA_IMPORT_SPECTRUM_COUNT] = {
    "d65", "uniform", "regular", "irregular", "blackbody", "rawconstant", "srgb"};

static int index_of(const ca_xml_node *node)
{
    const char *type = ca_xml_attribute_value(node, "type");
    for (int i = 0; i < CA_IMPORT_SPECTRUM_COUNT; i++)
        if (strcmp(type, ca_import_spectrum_names[i]) == 0) return i;
    return -1;
}

bool ca_import_is_spectrum(const ca_xml_node *node)
{
    return strcmp(node->tag, "texture") == 0 && index_of(node) >= 0;
}

ca_rgb ca_import_spectrum(ca_importer *importer, ca_xml_node *node, ca_color_role role)
{
    ca_props props;
    ca_props_begin(&props, importer, node);
    const ca_rgb color = imports[index_of(node)](&props, role);
    ca_props_end(&props);
    return color;
}
