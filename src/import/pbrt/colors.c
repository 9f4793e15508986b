/* Colours of pbrt's parameters: rgb of a colour space, xyz, spectra in numbers, files and by name, blackbodies. */
#include "import/pbrt/materials.h"

#include "base/text.h"
#include "image/spectrum.h"
#include "import/inflate.h"
#include "material/conductor_data.h"

#include <string.h>

enum { MAX_SPECTRUM_BYTES = 1 << 24 };

/* ---- Spaces ---------------------------------------------------------------------------------------------------- */

const char *const ca_pbrt_space_names[CA_PBRT_SPACE_COUNT] = {"srgb", "rec2020", "dci-p3", "aces2065-1"};

/* x, y of red, green, blue and white: ITU-R BT.709 and BT.2020, SMPTE EG 432-1 (with D65), SMPTE ST 2065-1. */
static const double primaries[CA_PBRT_SPACE_COUNT][4][2] = {
    {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}},
    {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}},
    {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}},
    {{0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.077}, {0.32168, 0.33767}},
};

static void xyz_of(const double xy[2], double xyz[3])
{
    xyz[0] = xy[0] / xy[1];
    xyz[1] = 1.0;
    xyz[2] = (1.0 - xy[0] - xy[1]) / xy[1];
}

static void multiply(const ca_matrix *m, const double in[3], double out[3])
{
    for (int row = 0; row < 3; row++) out[row] = m->m[row][0] * in[0] + m->m[row][1] * in[1] + m->m[row][2] * in[2];
}

/* Each column is a primary's XYZ, scaled so that (1, 1, 1) is the white point. */
static ca_matrix xyz_from_space(uint32_t space)
{
    ca_matrix columns = ca_matrix_identity(), inverse;
    double white[3], scale[3];
    for (int i = 0; i < 3; i++) {
        double xyz[3];
        xyz_of(primaries[space][i], xyz);
        for (int row = 0; row < 3; row++) columns.m[row][i] = xyz[row];
    }
    xyz_of(primaries[space][3], white);
    if (!ca_matrix_invert(&columns, &inverse)) return columns;
    multiply(&inverse, white, scale);
    for (int i = 0; i < 3; i++)
        for (int row = 0; row < 3; row++) columns.m[row][i] *= scale[i];
    return columns;
}

static void rgb_of_xyz(const double xyz[3], double rgb[3])
{
    const ca_matrix to_xyz = xyz_from_space(0);
    ca_matrix from_xyz;
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    if (ca_matrix_invert(&to_xyz, &from_xyz)) multiply(&from_xyz, xyz, rgb);
}

/* White stays white, whatever the space's own is. */
static void rgb_of_space(uint32_t space, double rgb[3])
{
    double xyz[3];
    if (space == 0) return;
    const ca_matrix to_xyz = xyz_from_space(space);
    const double ones[3] = {1.0, 1.0, 1.0};
    double white[3];
    multiply(&to_xyz, rgb, xyz);
    rgb_of_xyz(xyz, rgb);
    multiply(&to_xyz, ones, xyz);
    rgb_of_xyz(xyz, white);
    for (int i = 0; i < 3; i++) rgb[i] /= white[i];
}

/* ---- Spectra by name ------------------------------------------------------------------------------------------- */

/* Chromaticities of the CIE's standard illuminants (CIE 15:2004, tables T.3 and T.8.1), and of ACES' white. */
typedef struct illuminant {
    const char *name;
    double xy[2];
} illuminant;

static const illuminant illuminants[] = {
    {"stdillum-A", {0.44757, 0.40745}},    {"stdillum-D50", {0.34567, 0.35850}}, {"stdillum-D65", {0.3127, 0.3290}},
    {"stdillum-F1", {0.3131, 0.3371}},     {"stdillum-F2", {0.3721, 0.3751}},    {"stdillum-F3", {0.4091, 0.3941}},
    {"stdillum-F4", {0.4402, 0.4031}},     {"stdillum-F5", {0.3138, 0.3452}},    {"stdillum-F6", {0.3779, 0.3882}},
    {"stdillum-F7", {0.3129, 0.3292}},     {"stdillum-F8", {0.3458, 0.3586}},    {"stdillum-F9", {0.3741, 0.3727}},
    {"stdillum-F10", {0.3458, 0.3588}},    {"stdillum-F11", {0.3805, 0.3769}},   {"stdillum-F12", {0.4370, 0.4042}},
    {"illum-acesD60", {0.32168, 0.33767}},
};

/* Indices at 587.6 nm, of the makers' data sheets. F5, F10 and F11 are pbrt's names for SF5, SF10 and SF11. */
typedef struct glass {
    const char *name;
    double index;
} glass;

static const glass glasses[] = {
    {"glass-BK7", 1.5168}, {"glass-BAF10", 1.67003}, {"glass-FK51A", 1.48656}, {"glass-LASF9", 1.85025},
    {"glass-F5", 1.6727},  {"glass-F10", 1.72825},   {"glass-F11", 1.78472},
};

/* Names of metals, each with -eta or -k behind it, and ours. */
static const char *const metals[] = {"metal-Ag", "metal-Al", "metal-Au", "metal-Cu", "metal-MgO", "metal-TiO2"};

static bool find_illuminant(const char *name, double rgb[3])
{
    for (size_t i = 0; i < CA_COUNT(illuminants); i++) {
        double xyz[3];
        if (strcmp(illuminants[i].name, name) != 0) continue;
        xyz_of(illuminants[i].xy, xyz);
        rgb_of_xyz(xyz, rgb);
        return true;
    }
    return false;
}

static bool find_glass(const char *name, double *index)
{
    for (size_t i = 0; i < CA_COUNT(glasses); i++) {
        if (strcmp(glasses[i].name, name) != 0) continue;
        *index = glasses[i].index;
        return true;
    }
    return false;
}

static bool find_metal(const char *name, double rgb[3])
{
    for (size_t i = 0; i < CA_COUNT(metals); i++) {
        const size_t length = strlen(metals[i]);
        if (strncmp(name, metals[i], length) != 0) continue;
        const bool eta = strcmp(name + length, "-eta") == 0;
        if (!eta && strcmp(name + length, "-k") != 0) continue;
        const ca_conductor *conductor = ca_conductor_find(metals[i] + 6);
        if (!conductor) return false;
        const ca_rgb value = eta ? conductor->eta : conductor->k;
        rgb[0] = (double)value.r, rgb[1] = (double)value.g, rgb[2] = (double)value.b;
        return true;
    }
    return false;
}

void ca_pbrt_copper(double eta[3], double k[3])
{
    find_metal("metal-Cu-eta", eta);
    find_metal("metal-Cu-k", k);
}

static const char *nearest_spectrum(const char *name)
{
    const char *nearest = NULL;
    for (size_t i = 0; i < CA_COUNT(illuminants); i++) nearest = ca_nearer_name(name, nearest, illuminants[i].name);
    for (size_t i = 0; i < CA_COUNT(glasses); i++) nearest = ca_nearer_name(name, nearest, glasses[i].name);
    for (size_t i = 0; i < CA_COUNT(metals); i++) nearest = ca_nearer_name(name, nearest, metals[i]);
    return nearest;
}

/* ---- Samples --------------------------------------------------------------------------------------------------- */

typedef CA_TABLE(ca_spectrum_sample) sample_table;

static bool add_sample(ca_pbrt *p, const ca_location *where, sample_table *table, double wavelength, double value)
{
    if (table->count > 0 && !(wavelength > table->items[table->count - 1].wavelength_nm))
        ca_import_fail(p->importer, where, "the wavelengths of a spectrum must increase, and %g does not",
                       wavelength);
    else if (!CA_TABLE_ADD(table))
        ca_import_fail_memory(p->importer, "a spectrum");
    else
        table->items[table->count - 1] = (ca_spectrum_sample){.wavelength_nm = wavelength, .value = value};
    return ca_import_good(p->importer);
}

/* Numbers in pairs, in any lines. */
static void read_pairs(ca_pbrt *p, const ca_location *where, const char *path, const ca_bytes *bytes,
                       sample_table *table)
{
    ca_pbrt_scan scan =
        ca_pbrt_scan_begin(path, (const char *)bytes->data, bytes->size, &p->importer->document.arena);
    double pair[2] = {0.0, 0.0};
    size_t count = 0;
    ca_pbrt_token token;
    for (; ca_import_good(p->importer); count++) {
        p->importer->status = ca_pbrt_next(&scan, &token, p->importer->error);
        if (!ca_import_good(p->importer) || token.kind == CA_PBRT_END) break;
        if (token.kind != CA_PBRT_WORD || !ca_parse_number(token.text, token.length, &pair[count % 2]))
            ca_import_fail(p->importer, where, "%s:%u: expected a wavelength and a value", path, token.where.line);
        else if (count % 2 == 1)
            add_sample(p, where, table, pair[0], pair[1]);
    }
    if (ca_import_good(p->importer) && count % 2 == 1)
        ca_import_fail(p->importer, where, "%s: a wavelength has no value", path);
}

static void read_file(ca_pbrt *p, const ca_pbrt_parameter *parameter, sample_table *table)
{
    const char *name = parameter->texts[0];
    const char *path = ca_pbrt_file(p, name);
    ca_bytes bytes;
    ca_error reason;
    if (!path || !ca_document_add_file(&p->importer->document, path)) {
        ca_import_fail_memory(p->importer, "a spectrum");
        return;
    }
    const ca_status status = ca_read_inflated(path, "spectrum", MAX_SPECTRUM_BYTES, &bytes, &reason);
    if (status == CA_ERROR_MEMORY) ca_import_fail_file(p->importer, &parameter->where, status, &reason);
    if (status != CA_OK) {
        ca_import_fail(p->importer, &parameter->where,
                       "\"%s\" is neither the name of a spectrum nor a file that can be read; the nearest name is "
                       "\"%s\"",
                       name, nearest_spectrum(name));
        return;
    }
    ca_document_add_content(&p->importer->document, bytes.data, bytes.size);
    read_pairs(p, &parameter->where, path, &bytes, table);
    ca_bytes_destroy(&bytes);
}

/* The samples of a spectrum that is no name; false after failing. */
static bool read_samples(ca_pbrt *p, const ca_pbrt_parameter *parameter, sample_table *table)
{
    if (parameter->texts)
        read_file(p, parameter, table);
    else if (parameter->count % 2 != 0)
        ca_import_fail(p->importer, &parameter->where, "spectrum \"%s\" has a wavelength without a value",
                       parameter->name);
    else
        for (size_t i = 0; i + 1 < parameter->count; i += 2)
            if (!add_sample(p, &parameter->where, table, parameter->numbers[i], parameter->numbers[i + 1])) break;
    if (ca_import_good(p->importer) && table->count < 2)
        ca_import_fail(p->importer, &parameter->where, "a spectrum needs at least two wavelengths");
    return ca_import_good(p->importer);
}

static void color_of_samples(const ca_spectrum_sample *samples, size_t count, ca_color_role role, double rgb[3])
{
    const ca_rgb color =
        role == CA_COLOR_EMISSION ? ca_spectrum_emission(samples, count) : ca_spectrum_reflectance(samples, count);
    rgb[0] = (double)color.r, rgb[1] = (double)color.g, rgb[2] = (double)color.b;
}

static void color_of_spectrum(ca_pbrt *p, const ca_pbrt_parameter *parameter, ca_color_role role, double rgb[3])
{
    sample_table table = {0};
    if (parameter->count == 1 && parameter->texts &&
        (find_illuminant(parameter->texts[0], rgb) || find_metal(parameter->texts[0], rgb)))
        return;
    if (parameter->texts && parameter->count != 1)
        ca_import_fail(p->importer, &parameter->where, "spectrum \"%s\" has more than one name", parameter->name);
    else if (read_samples(p, parameter, &table))
        color_of_samples(table.items, table.count, role, rgb);
    ca_free(table.items);
}

/* A temperature, and in version 3 a factor: Planck's law over its largest value. */
static void color_of_blackbody(ca_pbrt *p, const ca_pbrt_parameter *parameter, double rgb[3])
{
    ca_spectrum_sample samples[CA_BLACKBODY_SAMPLES];
    const double kelvin = parameter->count > 0 ? parameter->numbers[0] : 0.0;
    const double scale = parameter->count == 2 ? parameter->numbers[1] : 1.0;
    if (parameter->count < 1 || parameter->count > 2 || !(kelvin >= 100.0 && kelvin <= 1e5) || !(scale >= 0.0)) {
        ca_import_fail(p->importer, &parameter->where, "blackbody \"%s\" needs a temperature of 100 to 100000 kelvin",
                       parameter->name);
        return;
    }
    ca_spectrum_blackbody(kelvin, samples);
    const double factor = scale / ca_spectrum_blackbody_peak(kelvin);
    for (int i = 0; i < CA_BLACKBODY_SAMPLES; i++) samples[i].value *= factor;
    color_of_samples(samples, CA_BLACKBODY_SAMPLES, CA_COLOR_EMISSION, rgb);
}

/* ---- Parameters ------------------------------------------------------------------------------------------------ */

static bool has_three(ca_pbrt *p, const ca_pbrt_parameter *parameter)
{
    if (parameter->count == 3) return true;
    ca_import_fail(p->importer, &parameter->where, "parameter \"%s\" needs three numbers, not %zu", parameter->name,
                   parameter->count);
    return false;
}

static void read_color(ca_pbrt *p, const ca_pbrt_parameter *parameter, ca_color_role role, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    switch (parameter->type) {
    case CA_PBRT_RGB:
        if (!has_three(p, parameter)) return;
        memcpy(rgb, parameter->numbers, 3 * sizeof *rgb);
        rgb_of_space(parameter->space, rgb);
        break;
    case CA_PBRT_XYZ:
        if (has_three(p, parameter)) rgb_of_xyz(parameter->numbers, rgb);
        break;
    case CA_PBRT_SPECTRUM: color_of_spectrum(p, parameter, role, rgb); break;
    case CA_PBRT_BLACKBODY: color_of_blackbody(p, parameter, rgb); break;
    case CA_PBRT_INTEGER:
    case CA_PBRT_FLOAT:
        if (parameter->count == 1)
            rgb[0] = rgb[1] = rgb[2] = parameter->numbers[0];
        else
            ca_import_fail(p->importer, &parameter->where, "parameter \"%s\" needs one number", parameter->name);
        break;
    default:
        ca_import_fail(p->importer, &parameter->where, "parameter \"%s\" of %s must be a colour", parameter->name,
                       p->params.what);
    }
}

/* What lies outside of Rec. 709 is cut off. */
static void clip(ca_color_role role, double rgb[3])
{
    for (int i = 0; i < 3; i++) {
        if (role != CA_COLOR_SIGNED && !(rgb[i] > 0.0)) rgb[i] = 0.0;
        if (role == CA_COLOR_REFLECTANCE && rgb[i] > 1.0) rgb[i] = 1.0;
    }
}

bool ca_pbrt_color(ca_pbrt *p, const char *name, ca_color_role role, double rgb[3])
{
    const ca_pbrt_parameter *parameter = ca_pbrt_find(&p->params, name);
    if (!parameter) return false;
    read_color(p, parameter, role, rgb);
    clip(role, rgb);
    return true;
}

bool ca_pbrt_light_color(ca_pbrt *p, const char *name, double rgb[3])
{
    const ca_pbrt_parameter *parameter = ca_pbrt_find(&p->params, name);
    if (!parameter) return false;
    read_color(p, parameter, CA_COLOR_EMISSION, rgb);
    const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    const bool is_spectrum = parameter->type == CA_PBRT_SPECTRUM || parameter->type == CA_PBRT_BLACKBODY;
    for (int i = 0; i < 3 && p->version == 4 && is_spectrum && luminance > 0.0; i++) rgb[i] /= luminance;
    clip(CA_COLOR_EMISSION, rgb);
    return true;
}

double ca_pbrt_index(ca_pbrt *p, const char *name, double fallback)
{
    const ca_pbrt_parameter *parameter = ca_pbrt_find(&p->params, name);
    const double yellow_nm = 589.3; /* the line of sodium */
    double index = fallback;
    if (!parameter) return fallback;
    if (parameter->type != CA_PBRT_SPECTRUM) return ca_pbrt_number_in(&p->params, name, fallback, 0.1, 10.0);
    ca_import_note(p->importer, &parameter->where, "glass has one index of refraction for all colours");
    if (parameter->texts && parameter->count == 1 && find_glass(parameter->texts[0], &index)) return index;
    sample_table table = {0};
    if (read_samples(p, parameter, &table) && table.items)
        index = ca_spectrum_value(table.items, table.count, yellow_nm);
    ca_free(table.items);
    if (index >= 0.1 && index <= 10.0) return index;
    ca_pbrt_fail(&p->params, name, "is an index of refraction from 0.1 to 10");
    return fallback;
}
