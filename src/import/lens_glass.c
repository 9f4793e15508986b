#include "import/lens_glass.h"

#include "base/text.h"

#include <string.h>

static const ca_lens_glass glasses[] = {
    /* Schott */
    {"N-BK7", 1.51680, 64.17},     {"N-BK10", 1.49782, 66.95},    {"N-K5", 1.52249, 59.48},
    {"N-KF9", 1.52346, 51.54},     {"N-ZK7", 1.50847, 61.19},     {"N-FK5", 1.48749, 70.41},
    {"N-FK51A", 1.48656, 84.47},   {"N-FK58", 1.45600, 90.90},    {"N-PK51", 1.52855, 76.98},
    {"N-PK52A", 1.49700, 81.61},   {"N-PSK3", 1.55232, 63.46},    {"N-PSK53A", 1.61800, 63.39},
    {"N-BAK1", 1.57250, 57.55},    {"N-BAK2", 1.53996, 59.71},    {"N-BAK4", 1.56883, 55.98},
    {"N-BALF4", 1.57956, 53.87},   {"N-BALF5", 1.54739, 53.63},   {"N-BAF4", 1.60568, 43.72},
    {"N-BAF10", 1.67003, 47.11},   {"N-BAF51", 1.65224, 44.96},   {"N-BAF52", 1.60863, 46.60},
    {"N-BASF2", 1.66446, 36.00},   {"N-BASF64", 1.70400, 39.38},  {"N-SK2", 1.60738, 56.65},
    {"N-SK4", 1.61272, 58.63},     {"N-SK5", 1.58913, 61.27},     {"N-SK11", 1.56384, 60.80},
    {"N-SK14", 1.60311, 60.60},    {"N-SK16", 1.62041, 60.32},    {"N-SSK2", 1.62229, 53.27},
    {"N-SSK5", 1.65844, 50.88},    {"N-SSK8", 1.61773, 49.83},    {"N-F2", 1.62005, 36.43},
    {"N-LAF2", 1.74397, 44.85},    {"N-LAF7", 1.74950, 34.82},    {"N-LAF21", 1.78800, 47.49},
    {"N-LAF33", 1.78582, 44.05},   {"N-LAF34", 1.77250, 49.62},   {"N-LAK7", 1.65160, 58.52},
    {"N-LAK8", 1.71300, 53.83},    {"N-LAK9", 1.69100, 54.71},    {"N-LAK10", 1.72003, 50.62},
    {"N-LAK12", 1.67790, 55.20},   {"N-LAK14", 1.69680, 55.41},   {"N-LAK21", 1.64049, 60.10},
    {"N-LAK22", 1.65113, 55.89},   {"N-LAK33B", 1.75500, 52.30},  {"N-LAK34", 1.72916, 54.50},
    {"N-LASF9", 1.85025, 32.17},   {"N-LASF31A", 1.88300, 40.76}, {"N-LASF40", 1.83404, 37.30},
    {"N-LASF41", 1.83501, 43.13},  {"N-LASF43", 1.80610, 40.61},  {"N-LASF44", 1.80420, 46.50},
    {"N-LASF45", 1.80107, 34.97},  {"N-LASF46B", 1.90366, 31.32}, {"N-KZFS2", 1.55836, 54.01},
    {"N-KZFS4", 1.61336, 44.49},   {"N-KZFS5", 1.65412, 39.70},   {"N-KZFS8", 1.72047, 34.70},
    {"N-KZFS11", 1.63775, 42.41},  {"N-SF1", 1.71736, 29.62},     {"N-SF2", 1.64769, 33.82},
    {"N-SF4", 1.75513, 27.38},     {"N-SF5", 1.67271, 32.25},     {"N-SF6", 1.80518, 25.36},
    {"N-SF8", 1.68894, 31.31},     {"N-SF10", 1.72828, 28.53},    {"N-SF11", 1.78472, 25.68},
    {"N-SF14", 1.76182, 26.53},    {"N-SF15", 1.69892, 30.20},    {"N-SF57", 1.84666, 23.78},
    {"N-SF66", 1.92286, 20.88},    {"F2", 1.62004, 36.37},        {"F5", 1.60342, 38.03},
    {"K7", 1.51112, 60.41},        {"K10", 1.50137, 56.41},       {"LF5", 1.58144, 40.85},
    {"LLF1", 1.54814, 45.75},      {"LAFN7", 1.74950, 34.95},     {"LASF35", 2.02204, 29.06},
    {"SF1", 1.71736, 29.51},       {"SF2", 1.64769, 33.85},       {"SF4", 1.75520, 27.58},
    {"SF5", 1.67270, 32.21},       {"SF6", 1.80518, 25.43},       {"SF10", 1.72825, 28.41},
    {"SF11", 1.78472, 25.76},      {"SF56A", 1.78470, 26.08},     {"SF57", 1.84666, 23.83},
    /* pbrt's: of these names F5, F10 and F11 are Schott's SF5, SF10 and SF11. */
    {"glass-BK7", 1.51680, 64.17},   {"glass-BAF10", 1.67003, 47.11}, {"glass-FK51A", 1.48656, 84.47},
    {"glass-LASF9", 1.85025, 32.17}, {"glass-F5", 1.67270, 32.21},    {"glass-F10", 1.72825, 28.41},
    {"glass-F11", 1.78472, 25.76},
    /* Malitson 1965, "Interspecimen Comparison of the Refractive Index of Fused Silica" */
    {"fused-silica", 1.45846, 67.82}, {"fused-quartz", 1.45846, 67.82}, {"silica", 1.45846, 67.82},
    /* Malitson 1963, "A Redetermination of Some Optical Properties of Calcium Fluoride" */
    {"CaF2", 1.43385, 95.00},
    {"fluorite", 1.43385, 95.00},
    /* Sultanova, Kasarova and Nikolov 2009, "Dispersion Properties of Optical Polymers" */
    {"PMMA", 1.49062, 53.18},          {"acrylic", 1.49062, 53.18}, {"acrylic-glass", 1.49062, 53.18},
    {"polycarbonate", 1.58476, 27.86}, {"PC", 1.58476, 27.86},      {"polystyrene", 1.59163, 29.53},
    /* Daimon and Masumura 2007, "Measurement of the Refractive Index of Distilled Water", 20 degrees; over air's */
    {"water", 1.33304, 55.76},
    /* Malitson and Dodge 1972: the ordinary ray */
    {"sapphire", 1.76817, 72.31},
    {"air", 1.0, 0.0},
};

enum { GLASSES = sizeof glasses / sizeof *glasses, LONGEST = 24 };

/* Small letters and digits alone; at most LONGEST - 1 of them. */
static void fold(const char *name, size_t length, char folded[LONGEST])
{
    size_t count = 0;
    for (size_t i = 0; i < length && count < LONGEST - 1; i++) {
        const char c = name[i];
        if (c != '-' && c != '_') folded[count++] = c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
    }
    folded[count] = 0;
}

static const ca_lens_glass *find_folded(const char *wanted)
{
    for (size_t i = 0; i < GLASSES; i++) {
        char folded[LONGEST];
        fold(glasses[i].name, strlen(glasses[i].name), folded);
        if (strcmp(folded, wanted) == 0) return &glasses[i];
    }
    return NULL;
}

const ca_lens_glass *ca_lens_glass_find(const char *name, size_t length)
{
    char lead_free[1 + LONGEST] = "n", *wanted = lead_free + 1;
    fold(name, length, wanted);
    const ca_lens_glass *glass = find_folded(wanted);
    return glass ? glass : find_folded(lead_free);
}

const char *ca_lens_glass_nearest(const char *name, size_t length)
{
    char wanted[LONGEST], folded[GLASSES][LONGEST];
    const char *names[GLASSES];
    fold(name, length, wanted);
    for (size_t i = 0; i < GLASSES; i++) {
        fold(glasses[i].name, strlen(glasses[i].name), folded[i]);
        names[i] = folded[i];
    }
    const char *nearest = ca_nearest_name_however_far(wanted, names, GLASSES);
    return find_folded(nearest)->name;
}

const ca_lens_glass *ca_lens_glass_at(size_t i) { return i < GLASSES ? &glasses[i] : NULL; }
