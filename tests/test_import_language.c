#define _POSIX_C_SOURCE 200809L
/* The language around the objects: defaults and -D, include, alias, ref, path, transforms, 0.6 spellings, limits. */
#include "support/import_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "import/number.h"

static void numbers_are_strict_and_exact(void **state)
{
    (void)state;
    static const char *const good[] = {"0",
                                       "-0",
                                       "+1",
                                       "1.5",
                                       ".5",
                                       "5.",
                                       "1e3",
                                       "1E-3",
                                       "-1.25e+2",
                                       "0.1",
                                       "123456789012345678901234567890",
                                       "1e-400",
                                       "0.000000000000000000000000012345",
                                       "4.37114e-008",
                                       "3.4028234663852886e38",
                                       "9007199254740993"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        double value;
        if (!ca_parse_number(good[i], strlen(good[i]), &value)) fail_msg("%s is refused", good[i]);
        if (value != strtod(good[i], NULL)) fail_msg("%s becomes %.17g", good[i], value);
    }
    static const char *const bad[] = {"",    ".",   "-",    "e5",  "1e",    "1e+",   "0x10", "nan",
                                      "inf", "1 2", "1.5f", "--1", "1.2.3", "1e999", " 1",   "1,5"};
    double value;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (ca_parse_number(bad[i], strlen(bad[i]), &value)) fail_msg("%s is accepted", bad[i]);
    int64_t integer;
    assert_true(ca_parse_integer("-9223372036854775808", 20, &integer));
    assert_true(integer == INT64_MIN);
    assert_false(ca_parse_integer("9223372036854775808", 19, &integer));
    assert_false(ca_parse_integer("1.0", 3, &integer));
}

static float only_radius(const char *text, const ca_define *defines, size_t count)
{
    ca_scene_desc desc;
    import_text(&desc, text, defines, count);
    assert_int_equal(desc.shapes.count, 1);
    const float radius = desc.shapes.items[0].as.sphere.radius;
    ca_scene_desc_destroy(&desc);
    return radius;
}

static void defaults_and_definitions(void **state)
{
    (void)state;
    const char *text = SCENE("<default name=\"r\" value=\"2\"/><default name=\"r\" value=\"3\"/>"
                             "<default name=\"rr\" value=\"1$r.5\"/>"
                             "<shape type=\"sphere\"><float name=\"radius\" value=\"$rr\"/></shape>");
    assert_true(only_radius(text, NULL, 0) == 12.5f);
    const ca_define define = {"r", "7"};
    assert_true(only_radius(text, &define, 1) == 17.5f);
    const ca_define both[2] = {{"r", "7"}, {"rr", "4"}};
    assert_true(only_radius(text, both, 2) == 4.0f);
    /* A name that is used but has no default will do. */
    const char *bare = SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"$r\"/></shape>");
    assert_true(only_radius(bare, &define, 1) == 7.0f);

    ca_scene_desc desc;
    import_text(&desc, SCENE("<bsdf type=\"null\" id=\"a\\$b\"/>"), NULL, 0);
    assert_string_equal(desc.materials.items[0].id, "a$b");
    ca_scene_desc_destroy(&desc);
}

static void unknown_definition_is_an_error(void **state)
{
    (void)state;
    const char *text = SCENE("<default name=\"spp\" value=\"2\"/>");
    const ca_define define = {"ssp", "7"};
    ca_scene_desc desc;
    ca_error error;
    assert_int_equal(ca_import_scene_text(text, strlen(text), "test.xml", &define, 1, &desc, &error),
                     CA_ERROR_ARGUMENT);
    assert_string_equal(error.message, "-D ssp=7: the scene has no default of that name; the nearest is spp");
}

static void include_path_and_alias(void **state)
{
    (void)state;
    import_write_text("part.xml", "<scene version=\"3.0.0\"><bsdf type=\"diffuse\" id=\"inner\"/>"
                                  "<default name=\"r\" value=\"9\"/></scene>");
    import_write_text("ball.xml", "<shape type=\"sphere\">\n <float name=\"radius\" value=\"$r\"/>"
                                  "<ref id=\"other\"/></shape>");
    ca_scene_desc desc;
    import_text(&desc,
                SCENE("<include filename=\"part.xml\"/><alias id=\"inner\" as=\"second\"/>"
                      "<alias id=\"second\" as=\"other\"/><include filename=\"ball.xml\"/>"),
                NULL, 0);
    assert_int_equal(desc.shapes.count, 1);
    assert_true(desc.shapes.items[0].as.sphere.radius == 9.0f);
    assert_int_equal(desc.shapes.items[0].material, 0);
    /* Places are those of the included files. */
    assert_string_equal(desc.shapes.items[0].where.file + strlen(import_folder()), "/ball.xml");
    assert_int_equal(desc.shapes.items[0].where.line, 1);
    ca_scene_desc_destroy(&desc);

    import_write_text("wrong.xml", "<shape type=\"sphere\">\n <float name=\"radius\" value=\"x\"/></shape>");
    const char *text = SCENE("<include filename=\"wrong.xml\"/>");
    ca_error error;
    char path[128], expected[256];
    snprintf(path, sizeof path, "%s/test.xml", import_folder());
    snprintf(expected, sizeof expected, "%s/wrong.xml:2:2: \"x\" is no finite number", import_folder());
    assert_int_equal(ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error), CA_ERROR_SCENE);
    assert_string_equal(error.message, expected);

    /* A file that is not beside the scene, found through <path>. */
    char with_path[512];
    snprintf(with_path, sizeof with_path, SCENE("<path value=\"%s\"/><include filename=\"part.xml\"/>"),
             import_folder());
    assert_int_equal(ca_import_scene_text(with_path, strlen(with_path), "/nowhere/test.xml", NULL, 0, &desc, &error),
                     CA_OK);
    assert_int_equal(desc.materials.count, 1);
    ca_scene_desc_destroy(&desc);
}

static void references_before_and_after(void **state)
{
    (void)state;
    ca_scene_desc desc;
    import_text(&desc,
                SCENE("<shape type=\"cube\"><ref id=\"late\"/></shape>"
                      "<bsdf type=\"twosided\" id=\"late\"><bsdf type=\"diffuse\">"
                      "<ref name=\"reflectance\" id=\"tex\"/></bsdf></bsdf>"
                      "<texture type=\"checkerboard\" id=\"tex\"/>"
                      "<shape type=\"cube\"><ref id=\"late\" name=\"bsdf\"/></shape>"
                      "<shape type=\"cube\"/>"),
                NULL, 0);
    assert_int_equal(desc.materials.count, 2); /* made once, though used twice */
    assert_int_equal(desc.shapes.items[0].material, desc.shapes.items[1].material);
    assert_int_equal(desc.shapes.items[2].material, CA_NONE);
    const ca_material_desc *outer = &desc.materials.items[desc.shapes.items[0].material];
    assert_int_equal(outer->material.kind, CA_MATERIAL_TWOSIDED);
    assert_string_equal(outer->id, "late");
    assert_int_equal(outer->material.as.twosided.front, outer->material.as.twosided.back);
    const ca_material *inner = &desc.materials.items[outer->material.as.twosided.front].material;
    assert_int_equal(desc.textures.items[inner->as.diffuse.reflectance].kind, CA_TEXTURE_CHECKERBOARD);
    ca_scene_desc_destroy(&desc);
}

static ca_matrix cube_map(const char *steps)
{
    char text[1024];
    snprintf(text, sizeof text, SCENE("<shape type=\"cube\"><transform name=\"to_world\">%s</transform></shape>"),
             steps);
    ca_scene_desc desc;
    import_text(&desc, text, NULL, 0);
    const ca_matrix result = desc.shapes.items[0].to_world;
    ca_scene_desc_destroy(&desc);
    return result;
}

static void assert_maps(const ca_matrix *m, double x, double y, double z, double to_x, double to_y, double to_z)
{
    double result[3];
    ca_matrix_point(m, (const double[3]){x, y, z}, result);
    if (fabs(result[0] - to_x) + fabs(result[1] - to_y) + fabs(result[2] - to_z) > 1e-12)
        fail_msg("(%g, %g, %g), expected (%g, %g, %g)", result[0], result[1], result[2], to_x, to_y, to_z);
}

static void transform_steps(void **state)
{
    (void)state;
    /* Later steps apply after earlier ones. */
    ca_matrix m = cube_map("<translate x=\"1\"/><scale value=\"2\"/><rotate z=\"1\" angle=\"90\"/>");
    assert_maps(&m, 1, 0, 0, 0, 4, 0);
    m = cube_map("<scale x=\"2\" y=\"3\"/><translate value=\"1 2 3\"/>");
    assert_maps(&m, 1, 1, 1, 3, 5, 4);
    m = cube_map("<rotate value=\"0, 2, 0\" angle=\"90\"/>");
    assert_maps(&m, 0, 0, 1, 1, 0, 0);
    m = cube_map("<matrix value=\"1 0 0 5  0 1 0 6  0 0 1 7  0 0 0 1\"/>");
    assert_maps(&m, 0, 0, 0, 5, 6, 7);
    m = cube_map("<matrix value=\"0 -1 0 1 0 0 0 0 1\"/>");
    assert_maps(&m, 1, 0, 0, 0, 1, 0);
    /* A camera at (0, 0, 5) looks back at the origin; +x is to the left of the picture. */
    m = cube_map("<lookat origin=\"0 0 5\" target=\"0 0 0\" up=\"0 1 0\"/>");
    assert_maps(&m, 0, 0, 0, 0, 0, 5);
    assert_maps(&m, 0, 0, 1, 0, 0, 4);
    assert_maps(&m, 0, 1, 0, 0, 1, 5);
    assert_maps(&m, 1, 0, 0, -1, 0, 5);
    m = cube_map("<lookat origin=\"1 2 3\" target=\"1 2 4\"/>");
    assert_maps(&m, 0, 0, 2, 1, 2, 5);
}

static void old_spellings(void **state)
{
    (void)state;
    ca_scene_desc desc;
    import_text(
        &desc,
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<scene version=\"0.6.0\">\n"
        "<integrator type=\"path\"><integer name=\"maxDepth\" value=\"5\"/><integer name=\"rrDepth\" value=\"7\"/>"
        "<boolean name=\"hideEmitters\" value=\"true\"/></integrator>"
        "<sensor type=\"perspective\"><transform name=\"toWorld\"><lookAt origin=\"0,0,-3\" target=\"0,0,0\" "
        "up=\"0,1,0\"/></transform><float name=\"fov\" value=\"60\"/><string name=\"fovAxis\" value=\"smaller\"/>"
        "<float name=\"nearClip\" value=\"0.5\"/>"
        "<sampler type=\"independent\"><integer name=\"sampleCount\" value=\"9\"/></sampler>"
        "<film type=\"ldrfilm\"><string name=\"fileFormat\" value=\"png\"/><boolean name=\"banner\" "
        "value=\"false\"/><string name=\"tonemapMethod\" value=\"gamma\"/></film></sensor>"
        "<bsdf type=\"dielectric\"><float name=\"intIOR\" value=\"1.5\"/><string name=\"extIOR\" value=\"air\"/>"
        "<spectrum name=\"specularReflectance\" value=\"0.5\"/></bsdf>"
        "<bsdf type=\"diffuse\"><srgb name=\"diffuseReflectance\" value=\"#ff8000\"/></bsdf>"
        "<shape type=\"cube\"><transform name=\"toWorld\"/><boolean name=\"flipNormals\" value=\"true\"/>"
        "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\">"
        "<float name=\"uscale\" value=\"2\"/><float name=\"voffset\" value=\"0.25\"/>"
        "</texture></bsdf></shape></scene>",
        NULL, 0);
    assert_int_equal(desc.integrator.parameters.count, 3);
    assert_string_equal(desc.integrator.parameters.items[0].name, "max_depth");
    assert_string_equal(desc.integrator.parameters.items[1].name, "rr_depth");
    assert_string_equal(desc.integrator.parameters.items[2].name, "hide_emitters");
    assert_int_equal(desc.camera.fov_axis, CA_FOV_SMALLER);
    assert_true(desc.camera.camera.near_clip == 0.5f);
    assert_int_equal(desc.samples_per_pixel, 9);
    assert_true(fabsf(desc.materials.items[0].material.as.dielectric.eta - 1.5f / 1.000277f) < 1e-6f);
    const ca_texture_id mirrored = desc.materials.items[0].material.as.dielectric.reflectance;
    assert_true(desc.textures.items[mirrored].as.constant.g == 0.5f);
    const ca_rgb orange = desc.textures.items[desc.materials.items[1].material.as.diffuse.reflectance].as.constant;
    assert_true(orange.r == 1.0f && fabsf(orange.g - 0.21586f) < 1e-4f && orange.b == 0.0f);
    assert_true(desc.shapes.items[0].flip_normals);
    const ca_texture *checks =
        &desc.textures.items[desc.materials.items[desc.shapes.items[0].material].material.as.diffuse.reflectance];
    assert_true(checks->to_uv[0][0] == 2.0f && checks->to_uv[1][1] == 1.0f && checks->to_uv[1][2] == 0.25f);
    ca_scene_desc_destroy(&desc);
}

/* ---- Hostile files --------------------------------------------------------------------------------------------- */

static char *repeat(const char *before, const char *piece, size_t count, const char *after)
{
    char *text = malloc(strlen(before) + count * strlen(piece) + strlen(after) + 1);
    assert_non_null(text);
    char *end = stpcpy(text, before);
    for (size_t i = 0; i < count; i++) end = stpcpy(end, piece);
    strcpy(end, after);
    return text;
}

static void hostile_xml_is_refused(void **state)
{
    (void)state;
    char *deep = repeat("<scene version=\"3.0.0\">\n", "<bsdf type=\"twosided\">", 100000, "");
    import_expect_error(deep, "2:1387: elements are nested more than 64 deep");
    free(deep);
    import_expect_error("<!DOCTYPE x [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]><scene version=\"&b;\"/>",
                        "1:13: a document type declaration, which scene files cannot have");
    import_expect_error("<scene version=\"3.0.0\"><?php ?></scene>",
                        "1:24: a processing instruction, which scene files cannot have");
    import_expect_error("<scene version=\"3.0.0\">\n  text</scene>",
                        "2:1: text between elements; values belong in attributes");
    import_expect_error("", "1:1: not well-formed XML: no element found");
    import_expect_error("<scene version=\"3.0.0\">\n<a></b>", "2:6: not well-formed XML: mismatched tag");
    import_expect_error("<scene version=\"3.0.0\"><shape type=\"a\" type=\"b\"/></scene>",
                        "1:40: not well-formed XML: duplicate attribute");
}

static void include_circle_is_refused(void **state)
{
    (void)state;
    import_write_text("circle.xml", "<scene version=\"3.0.0\"><include filename=\"circle.xml\"/></scene>");
    const char *text = SCENE("<include filename=\"circle.xml\"/>");
    ca_scene_desc desc;
    ca_error error;
    char path[128];
    snprintf(path, sizeof path, "%s/test.xml", import_folder());
    assert_int_equal(ca_import_scene_text(text, strlen(text), path, NULL, 0, &desc, &error), CA_ERROR_SCENE);
    assert_non_null(strstr(error.message, "circle.xml:1:24: includes are nested more than 16 deep"));
    /* Two includes each: 2^16 files without a limit on their number. */
    for (int i = 0; i < 15; i++) {
        char name[32], body[256];
        snprintf(name, sizeof name, "fan%d.xml", i);
        snprintf(
            body, sizeof body,
            "<scene version=\"3.0.0\"><include filename=\"fan%d.xml\"/><include filename=\"fan%d.xml\"/></scene>",
            i + 1, i + 1);
        import_write_text(name, body);
    }
    import_write_text("fan15.xml", "<scene version=\"3.0.0\"/>");
    const char *fan = SCENE("<include filename=\"fan0.xml\"/>");
    assert_int_equal(ca_import_scene_text(fan, strlen(fan), path, NULL, 0, &desc, &error), CA_ERROR_SCENE);
    assert_non_null(strstr(error.message, "more than 1024 includes"));
}

static void growing_values_are_refused(void **state)
{
    (void)state;
    char text[8192] = "<scene version=\"3.0.0\">\n<default name=\"a0\" value=\"0123456789012345\"/>\n";
    for (int i = 0; i < 30; i++) {
        char line[128];
        snprintf(line, sizeof line, "<default name=\"a%d\" value=\"$a%d$a%d\"/>\n", i + 1, i, i);
        strcat(text, line);
    }
    strcat(text, "</scene>");
    import_expect_error(text, "25:1: a value of more than 67108864 bytes");
}

/* A chain of references is as deep as nested elements are. */
static void long_chain_of_references_is_refused(void **state)
{
    (void)state;
    char *text = malloc(4 << 20), *end = text;
    assert_non_null(text);
    end += sprintf(end, "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n");
    for (int i = 0; i < 20000; i++)
        end += sprintf(end, "<bsdf type=\"twosided\" id=\"m%d\"><ref id=\"m%d\"/></bsdf>\n", i, i + 1);
    sprintf(end, "<bsdf type=\"diffuse\" id=\"m20000\"/></scene>");
    import_expect_error(text, "18:1: objects are nested more than 16 deep");
    free(text);
}

/* So many objects, each of which refers to the one before it, as often as the format has places for numbers. */
static void refer_back(const char *first, const char *format, int count, const char *words)
{
    char *text = malloc(16 << 20), *end = text;
    assert_non_null(text);
    end += sprintf(end, "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>%s\n", first);
    for (int i = 1; i <= count; i++) end += sprintf(end, format, i, i - 1, i - 1);
    sprintf(end, "</scene>");
    import_expect_error(text, words);
    free(text);
}

/* Whoever refers to what was made before makes trees of any height, and with two references of any size. */
static void large_trees_are_refused(void **state)
{
    (void)state;
    static const char texture[] = "<texture type=\"checkerboard\" id=\"t0\"/>";
    refer_back(texture,
               "<texture type=\"checkerboard\" id=\"t%d\"><ref name=\"color0\" id=\"t%d\"/>"
               "<ref name=\"color1\" id=\"t%d\"/></texture>\n",
               40, "12:1: textures are made of at most 4095 others, nested at most 64 deep");
    refer_back(texture,
               "<texture type=\"scale\" id=\"t%d\"><float name=\"scale\" value=\"0.9\"/>"
               "<ref name=\"texture\" id=\"t%d\"/></texture>\n",
               100000, "64:1: textures are made of at most 4095 others, nested at most 64 deep");
    refer_back("<bsdf type=\"diffuse\" id=\"m0\"/>",
               "<bsdf type=\"blendbsdf\" id=\"m%d\"><float name=\"weight\" value=\"0.5\"/><ref id=\"m%d\"/>"
               "<ref id=\"m%d\"/></bsdf>\n",
               40, "13:1: BSDFs are made of at most 4095 others, nested at most 64 deep");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_strict_and_exact),
        cmocka_unit_test(defaults_and_definitions),
        cmocka_unit_test(unknown_definition_is_an_error),
        cmocka_unit_test(include_path_and_alias),
        cmocka_unit_test(references_before_and_after),
        cmocka_unit_test(transform_steps),
        cmocka_unit_test(old_spellings),
        cmocka_unit_test(hostile_xml_is_refused),
        cmocka_unit_test(include_circle_is_refused),
        cmocka_unit_test(growing_values_are_refused),
        cmocka_unit_test(long_chain_of_references_is_refused),
        cmocka_unit_test(large_trees_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
