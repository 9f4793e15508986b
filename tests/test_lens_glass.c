/* Glasses by name: Schott's against their codes, other materials against their dispersion formulas; names as people
 * write them. */
#include "import/lens_glass.h"

#include "support/import_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static double index_of(const char *name)
{
    const ca_lens_glass *glass = ca_lens_glass_find(name, strlen(name));
    if (!glass) fail_msg("there is no %s", name);
    return glass->index;
}

/* The first three digits are the decimals of nd, the others the Abbe number times ten, both rounded. */
static void schott_glasses(void **state)
{
    (void)state;
    static const char *const codes[][2] = {
        {"N-BK7", "517642"},     {"N-BK10", "498670"},    {"N-K5", "522595"},      {"N-KF9", "523515"},
        {"N-ZK7", "508612"},     {"N-FK5", "487704"},     {"N-FK51A", "487845"},   {"N-FK58", "456909"},
        {"N-PK51", "529770"},    {"N-PK52A", "497816"},   {"N-PSK3", "552635"},    {"N-PSK53A", "618634"},
        {"N-BAK1", "573576"},    {"N-BAK2", "540597"},    {"N-BAK4", "569560"},    {"N-BALF4", "580539"},
        {"N-BALF5", "547536"},   {"N-BAF4", "606437"},    {"N-BAF10", "670471"},   {"N-BAF51", "652450"},
        {"N-BAF52", "609466"},   {"N-BASF2", "664360"},   {"N-BASF64", "704394"},  {"N-SK2", "607567"},
        {"N-SK4", "613586"},     {"N-SK5", "589613"},     {"N-SK11", "564608"},    {"N-SK14", "603606"},
        {"N-SK16", "620603"},    {"N-SSK2", "622533"},    {"N-SSK5", "658509"},    {"N-SSK8", "618498"},
        {"N-F2", "620364"},      {"N-LAF2", "744449"},    {"N-LAF7", "749348"},    {"N-LAF21", "788475"},
        {"N-LAF33", "786441"},   {"N-LAF34", "773496"},   {"N-LAK7", "652585"},    {"N-LAK8", "713538"},
        {"N-LAK9", "691547"},    {"N-LAK10", "720506"},   {"N-LAK12", "678552"},   {"N-LAK14", "697554"},
        {"N-LAK21", "640601"},   {"N-LAK22", "651559"},   {"N-LAK33B", "755523"},  {"N-LAK34", "729545"},
        {"N-LASF9", "850322"},   {"N-LASF31A", "883408"}, {"N-LASF40", "834373"},  {"N-LASF41", "835431"},
        {"N-LASF43", "806406"},  {"N-LASF44", "804465"},  {"N-LASF45", "801350"},  {"N-LASF46B", "904313"},
        {"N-KZFS2", "558540"},   {"N-KZFS4", "613445"},   {"N-KZFS5", "654397"},   {"N-KZFS8", "720347"},
        {"N-KZFS11", "638424"},  {"N-SF1", "717296"},     {"N-SF2", "648338"},     {"N-SF4", "755274"},
        {"N-SF5", "673323"},     {"N-SF6", "805254"},     {"N-SF8", "689313"},     {"N-SF10", "728285"},
        {"N-SF11", "785257"},    {"N-SF14", "762265"},    {"N-SF15", "699302"},    {"N-SF57", "847238"},
        {"N-SF66", "923209"},    {"F2", "620364"},        {"F5", "603380"},        {"K7", "511604"},
        {"K10", "501564"},       {"LF5", "581409"},       {"LLF1", "548458"},      {"LAFN7", "750350"},
        {"LASF35", "022291"},    {"SF1", "717295"},       {"SF2", "648339"},       {"SF4", "755276"},
        {"SF5", "673322"},       {"SF6", "805254"},       {"SF10", "728284"},      {"SF11", "785258"},
        {"SF56A", "785261"},     {"SF57", "847238"},
        {"glass-BK7", "517642"}, {"glass-BAF10", "670471"}, {"glass-FK51A", "487845"}, {"glass-LASF9", "850322"},
        {"glass-F5", "673322"},  {"glass-F10", "728284"},   {"glass-F11", "785258"},
    };
    const size_t count = sizeof codes / sizeof *codes;
    for (size_t i = 0; i < count; i++) {
        const ca_lens_glass *glass = ca_lens_glass_at(i);
        int code;
        assert_string_equal(glass->name, codes[i][0]); /* each one, in this order */
        assert_int_equal(sscanf(codes[i][1], "%6d", &code), 1);
        if (!(fabs(fmod(1000.0 * (glass->index - 1.0), 1000.0) - code / 1000) <= 0.5 + 1e-9) ||
            !(fabs(10.0 * glass->abbe - code % 1000) <= 0.5 + 1e-9))
            fail_msg("%s: %.5f and %.2f are not %s", glass->name, glass->index, glass->abbe, codes[i][1]);
    }
    print_message("           %u glasses with a code\n", (unsigned)count);
    assert_true(count >= 60);
}

/* n^2 = 1 + sum of B l^2 / (l^2 - C), l in micrometres. */
typedef struct sellmeier {
    const char *name;
    double b[4], c[4];
    double around; /* the index of what is around it, in vacuum */
} sellmeier;

static double refraction(const sellmeier *s, double l)
{
    double square = 1.0;
    for (int i = 0; i < 4; i++) square += s->b[i] * l * l / (l * l - s->c[i]);
    return sqrt(square);
}

static void other_materials(void **state)
{
    (void)state;
#define SQUARE(x) ((x) * (x))
    static const sellmeier materials[] = {
        {"n-bk7", {1.03961212, 0.231792344, 1.01046945}, {0.00600069867, 0.0200179144, 103.560653}, 1.0},
        {"fused-silica", {0.6961663, 0.4079426, 0.8974794},
         {SQUARE(0.0684043), SQUARE(0.1162414), SQUARE(9.896161)}, 1.0},
        {"caf2", {0.5675888, 0.4710914, 3.8484723},
         {SQUARE(0.050263605), SQUARE(0.1003909), SQUARE(34.649040)}, 1.0},
        {"sapphire", {1.4313493, 0.65054713, 5.3414021},
         {SQUARE(0.0726631), SQUARE(0.1193242), SQUARE(18.028251)}, 1.0},
        {"pmma", {1.1819}, {0.011313}, 1.0},
        {"polycarbonate", {1.4182}, {0.021304}, 1.0},
        {"polystyrene", {1.4435}, {0.020216}, 1.0},
        {"water", {0.5684027565, 0.1726177391, 0.02086189578, 0.1130748688},
         {0.005101829712, 0.01821153936, 0.02620722293, 10.69792721}, 1.00027},
    };
    for (size_t i = 0; i < sizeof materials / sizeof *materials; i++) {
        const sellmeier *s = &materials[i];
        const ca_lens_glass *glass = ca_lens_glass_find(s->name, strlen(s->name));
        const double d = refraction(s, 0.5875618), f = refraction(s, 0.4861327), c = refraction(s, 0.6562725);
        assert_non_null(glass);
        if (!(fabs(glass->index - d / s->around) < 6e-6) || !(fabs(glass->abbe - (d - 1.0) / (f - c)) < 0.006))
            fail_msg("%s: %.5f and %.2f, by its formula %.5f and %.2f", s->name, glass->index, glass->abbe,
                     d / s->around, (d - 1.0) / (f - c));
    }
}

static void names(void **state)
{
    (void)state;
    static const char *const same[][2] = {
        {"bk7", "N-BK7"},       {"NBK7", "N-BK7"},          {"n_bk7", "N-BK7"},       {"BAF10", "N-BAF10"},
        {"lasf9", "N-LASF9"},   {"SK16", "N-SK16"},         {"f2", "F2"},             {"FusedSilica", "fused-silica"},
        {"CAF2", "CaF2"},       {"fused_quartz", "silica"}, {"GLASS-F5", "SF5"},      {"acrylic", "PMMA"},
        {"Glass-BK7", "N-BK7"}, {"glass-BAF10", "BAF10"},   {"glass-LASF9", "LASF9"}, {"glass-F11", "SF11"},
    };
    for (size_t i = 0; i < sizeof same / sizeof *same; i++)
        if (index_of(same[i][0]) != index_of(same[i][1])) fail_msg("%s is not %s", same[i][0], same[i][1]);
    assert_true(index_of("sf10") != index_of("n-sf10"));
    static const char *const unknown[][2] = {
        {"", "F2"}, {"N-BK71", "N-BK7"}, {"SF1O", "SF1"}, {"fused-silca", "fused-silica"}, {"517642", NULL},
    };
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++) {
        const size_t length = strlen(unknown[i][0]);
        assert_null(ca_lens_glass_find(unknown[i][0], length));
        if (unknown[i][1]) assert_string_equal(ca_lens_glass_nearest(unknown[i][0], length), unknown[i][1]);
    }
    static const char longer[] = "polycarbonatepolycarbonatepolycarbonate";
    assert_null(ca_lens_glass_find(longer, sizeof longer - 1));
}

/* In a table, beside codes and air. */
static void tables(void **state)
{
    (void)state;
    ca_scene_desc desc;
    import_text(&desc,
                "<scene version=\"3.0.0\"><sensor type=\"realistic\"><string name=\"lens\" value=\"radius thickness "
                "glass diameter; 61 6 bk7 25; -45 2.5 N-F2 25; -131 1.5 air 25; 200 1 620-364 25; inf 1 - 25; "
                "stop 0 - 16\"/></sensor></scene>",
                NULL, 0);
    static const double expected[] = {1.5168, 1.62005, 1.0, 1.62, 1.0, 1.0};
    for (size_t i = 0; i < 6; i++)
        assert_true(fabs(desc.camera.camera.as.realistic.lens.surfaces[i].index - expected[i]) < 1e-12);
    ca_scene_desc_destroy(&desc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(schott_glasses),
        cmocka_unit_test(other_materials),
        cmocka_unit_test(names),
        cmocka_unit_test(tables),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
