/* Integrators: parameters are kept, and those of Mitsuba's become ours. */
#include "support/imported_desc.h"

#include <stdio.h>
#include <string.h>

/* Kept as they are: whether the name and the parameters make sense is for the renderer to say. */
static void integrator_parameters(void **state)
{
    (void)state;
    import(SCENE("<integrator type=\"anything\">\n<integer name=\"max_depth\" value=\"-1\"/>"
                 "<float name=\"radius\" value=\"0.5\"/><string name=\"mode\" value=\"fast\"/>"
                 "<boolean name=\"hide_emitters\" value=\"true\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "anything");
    assert_int_equal(desc.integrator.parameters.count, 4);
    const ca_parameter *p = desc.integrator.parameters.items;
    assert_string_equal(p[0].name, "max_depth");
    assert_int_equal(p[0].kind, CA_PARAMETER_NUMBER);
    near(p[0].number, -1.0);
    assert_int_equal(p[0].where.line, 3);
    near(p[1].number, 0.5);
    assert_int_equal(p[2].kind, CA_PARAMETER_TEXT);
    assert_string_equal(p[2].text, "fast");
    assert_int_equal(p[3].kind, CA_PARAMETER_BOOLEAN);
    near(p[3].number, 1.0);
    done();
}

/* The number of the parameter, which must be there. */
static double parameter(const char *name)
{
    for (size_t i = 0; i < desc.integrator.parameters.count; i++)
        if (strcmp(desc.integrator.parameters.items[i].name, name) == 0)
            return desc.integrator.parameters.items[i].number;
    fail_msg("no parameter %s", name);
    return 0.0;
}

static void integrators_of_mitsuba(void **state)
{
    (void)state;
    import(SCENE("<integrator type=\"direct\"><integer name=\"shading_samples\" value=\"4\"/>"
                 "<boolean name=\"hide_emitters\" value=\"true\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "path");
    assert_int_equal(desc.integrator.parameters.count, 2);
    near(parameter("max_depth"), 2.0);
    near(parameter("hide_emitters"), 1.0);
    assert_int_equal(desc.notes.count, 2);
    assert_non_null(strstr(desc.notes.items[0], "2:1: integrator \"direct\" is read as \"path\": paths of at most"));
    assert_non_null(strstr(desc.notes.items[1], "\"shading_samples\" of integrator \"direct\" has no effect"));
    done();
    import(SCENE("<integrator type=\"volpathmis\"><integer name=\"max_depth\" value=\"7\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "path");
    near(parameter("max_depth"), 7.0);
    is_noted("2:1: integrator \"volpathmis\" is read as \"path\": there are no media");
    done();
    import(SCENE("<integrator type=\"ptracer\"><integer name=\"samples_per_pass\" value=\"7\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "light");
    assert_int_equal(desc.integrator.parameters.count, 0);
    done();
    import(SCENE("<integrator type=\"direct_projective\"><integer name=\"sppi\" value=\"0\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "path");
    near(parameter("max_depth"), 2.0);
    assert_int_equal(desc.notes.count, 2);
    assert_non_null(strstr(desc.notes.items[0], "the same picture; there are no derivatives"));
    done();
    import(SCENE("<integrator type=\"sppm\"><float name=\"initialRadius\" value=\"0.5\"/>"
                 "<float name=\"alpha\" value=\"0.7\"/><integer name=\"photonCount\" value=\"1000\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "ppm");
    near(parameter("radius"), 0.5);
    near(parameter("alpha"), 0.3);
    near(parameter("light_paths"), 1000.0);
    done();
    import(SCENE("<integrator type=\"path\"><boolean name=\"strictNormals\" value=\"true\"/></integrator>"));
    assert_int_equal(desc.integrator.parameters.count, 0);
    assert_int_equal(desc.notes.count, 0);
    done();
}

/* Integrators that have the names of ours, and others, with 0.6's parameters. */
static void integrators_of_old_mitsuba(void **state)
{
    (void)state;
#define OLD_SCENE(content) "<scene version=\"0.6.0\"><sensor type=\"perspective\"/>\n" content "</scene>"
#define OLD_PPM                                                                                                      \
    "<integrator type=\"ppm\"><float name=\"initialRadius\" value=\"0.5\"/>"                                         \
    "<float name=\"alpha\" value=\"0.7\"/><integer name=\"photonCount\" value=\"1000\"/></integrator>"
    import(OLD_SCENE(OLD_PPM));
    assert_string_equal(desc.integrator.name, "ppm");
    near(parameter("radius"), 0.5);
    near(parameter("alpha"), 0.3);
    near(parameter("light_paths"), 1000.0);
    assert_int_equal(desc.notes.count, 0);
    done();
    import(SCENE(OLD_PPM)); /* in scenes of today alpha is ours */
    near(parameter("alpha"), 0.7);
    done();
    import(OLD_SCENE("<integrator type=\"bdpt\"><boolean name=\"lightImage\" value=\"true\"/>"
                     "<integer name=\"maxDepth\" value=\"8\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "bdpt");
    near(parameter("max_depth"), 8.0);
    is_noted("2:25: parameter \"light_image\" of integrator \"bdpt\" has no effect");
    done();
    static const char *const chains[] = {"pssmlt", "mlt", "erpt"};
    for (size_t i = 0; i < 3; i++) {
        char scene[256], sentence[128];
        snprintf(scene, sizeof scene,
                 OLD_SCENE("<integrator type=\"%s\"><integer name=\"maxDepth\" value=\"9\"/></integrator>"),
                 chains[i]);
        import(scene);
        assert_string_equal(desc.integrator.name, "auto");
        near(parameter("max_depth"), 9.0);
        snprintf(sentence, sizeof sentence,
                 "2:1: integrator \"%s\" is read as \"auto\": the same light, without Markov chains", chains[i]);
        is_noted(sentence);
        done();
    }
    import(OLD_SCENE("<integrator type=\"photonmapper\"><integer name=\"globalPhotons\" value=\"9\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "ppm");
    assert_int_equal(desc.notes.count, 2);
    done();
    import(OLD_SCENE("<integrator type=\"vpl\"><float name=\"clamping\" value=\"0.1\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "bdpt");
    assert_int_equal(desc.notes.count, 2);
    done();
    import(OLD_SCENE("<integrator type=\"adaptive\"><float name=\"maxError\" value=\"5\"/>"
                     "<integrator type=\"volpath_simple\"/></integrator>"));
    assert_string_equal(desc.integrator.name, "path");
    assert_int_equal(desc.notes.count, 2);
    assert_non_null(strstr(desc.notes.items[0], "integrator \"adaptive\" is read as the one in it"));
    done();
    import(SCENE("<integrator type=\"path\"><boolean name=\"strictNormals\" value=\"false\"/></integrator>"));
    is_noted("2:25: strict_normals is always true: no light where the shading normal and the surface disagree");
    done();
}

static void integrators_in_integrators(void **state)
{
    (void)state;
    import(SCENE("<integrator type=\"moment\"><integrator type=\"aov\" name=\"a\"><string name=\"aovs\" "
                 "value=\"nn:sh_normal, dd.y:depth\"/><integrator type=\"path\" name=\"b\"><integer "
                 "name=\"max_depth\" value=\"3\"/></integrator></integrator></integrator>"));
    assert_string_equal(desc.integrator.name, "path");
    near(parameter("max_depth"), 3.0);
    assert_int_equal(desc.integrator.aovs.count, 2);
    assert_string_equal(desc.integrator.aovs.items[0].name, "nn");
    assert_int_equal(desc.integrator.aovs.items[0].kind, CA_AOV_SH_NORMAL);
    assert_string_equal(desc.integrator.aovs.items[1].name, "dd.y");
    assert_int_equal(desc.integrator.aovs.items[1].kind, CA_AOV_DEPTH);
    assert_int_equal(desc.notes.count, 1);
    assert_non_null(strstr(desc.notes.items[0], "2:1: integrator \"moment\": instead of second moments"));
    done();
    import(SCENE("<integrator type=\"depth\"/>"));
    assert_string_equal(desc.integrator.name, "path");
    near(parameter("max_depth"), 1.0);
    assert_string_equal(desc.integrator.aovs.items[0].name, "depth");
    assert_int_equal(desc.notes.count, 1);
    done();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(integrator_parameters),
        cmocka_unit_test(integrators_of_mitsuba),
        cmocka_unit_test(integrators_of_old_mitsuba),
        cmocka_unit_test(integrators_in_integrators),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
