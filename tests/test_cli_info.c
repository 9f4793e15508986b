/* `caustica info` refuses the scenes that `caustica render` refuses, by the same sentence. */
#include "integrator/integrator.h"
#include "support/program_test.h"

enum { SCENE_SIZE = 2048 };

/* Parts of a scene; NULL: a good one. */
typedef struct broken_scene {
    const char *integrator, *sampler, *film, *shape, *light;
    const char *says; /* what both say of it, from the place on */
} broken_scene;

static const broken_scene broken_scenes[] = {
    /* Integrators. */
    {.integrator = "<integrator type=\"pathh\"/>",
     .says = ":2:1: unknown integrator \"pathh\"; did you mean \"path\"?"},
    {.integrator = "<integrator type=\"path\"><integer name=\"max_dept\" value=\"4\"/></integrator>",
     .says = ":2:25: integrator \"path\" has no parameter \"max_dept\"; did you mean \"max_depth\"?"},
    {.integrator = "<integrator type=\"path\"><integer name=\"max_depth\" value=\"-2\"/></integrator>",
     .says = ":2:25: \"max_depth\" must be a whole number of at least -1"},
    {.integrator = "<integrator type=\"path\"><float name=\"max_depth\" value=\"4.5\"/></integrator>",
     .says = ":2:25: \"max_depth\" must be a whole number"},
    {.integrator = "<integrator type=\"path\"><boolean name=\"max_depth\" value=\"true\"/></integrator>",
     .says = ":2:25: \"max_depth\" must be a whole number"},
    {.integrator = "<integrator type=\"path\"><integer name=\"hide_emitters\" value=\"1\"/></integrator>",
     .says = ":2:25: \"hide_emitters\" must be true or false"},
    {.integrator = "<integrator type=\"vcm\"><string name=\"heuristic\" value=\"powr\"/></integrator>",
     .says = ":2:24: \"heuristic\" must be one of balance|power"},
    {.integrator = "<integrator type=\"vcm\"><float name=\"alpha\" value=\"1.5\"/></integrator>",
     .says = ":2:24: \"alpha\" must be a number of at least 0 and at most 1"},
    {.integrator = "<integrator/>", .says = ":2:1: <integrator> needs the attribute \"type\""},
    {.integrator = "<integrator type=\"path\"><rgb name=\"max_depth\" value=\"4\"/></integrator>",
     .says = ":2:25: an integrator's parameter is a"},
    {.integrator = "<integrator type=\"path\"><integer name=\"max_depth\" value=\"$depth\"/></integrator>",
     .says = ":2:25: $depth is not defined"},
    /* What an integrator cannot do with the scene, or with its own parameters together. */
    {.integrator = "<integrator type=\"path\"><boolean name=\"next_event\" value=\"false\"/></integrator>",
     .light = "<emitter type=\"point\"/>",
     .says = ":10:1: without next_event the integrator \"path\" cannot find this light"},
    {.integrator = "<integrator type=\"vcm\"><integer name=\"rr_depth\" value=\"1000\"/></integrator>",
     .says = "integrator \"vcm\" keeps at most 1024 vertices of a path"},
    {.integrator = "<integrator type=\"qmcppm\"><string name=\"blocks\" value=\"filled\"/></integrator>",
     .says = "blocks=filled needs a limit of memory to fill (--memory)"},
    {.integrator = "<integrator type=\"light\"><integer name=\"light_paths\" value=\"1\"/></integrator>",
     .sampler = "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"100000000\"/></sampler>",
     .says = "100000000 samples per pixel would take 38400000000 passes"},
    /* Sampler, film, the rest. */
    {.sampler = "<sampler type=\"indepndent\"/>", .says = ":5:1: unknown sampler \"indepndent\""},
    {.sampler = "<sampler type=\"halton\"><integer name=\"sample_coun\" value=\"4\"/></sampler>",
     .says = ":5:24: unused parameter \"sample_coun\""},
    {.sampler = "<sampler type=\"halton\"><integer name=\"sample_count\" value=\"0\"/></sampler>",
     .says = ":5:24: parameter \"sample_count\" of halton is 0"},
    {.sampler = "<sampler type=\"halton\"><integer name=\"seed\" value=\"-3\"/></sampler>",
     .says = ":5:24: parameter \"seed\" of halton is -3"},
    {.film = "<film type=\"hdrfilmm\"/>", .says = ":6:1: unknown film \"hdrfilmm\""},
    {.film = "<film type=\"hdrfilm\"><integer name=\"widht\" value=\"24\"/></film>",
     .says = ":6:22: unused parameter \"widht\" of hdrfilm"},
    {.film = "<film type=\"hdrfilm\"><integer name=\"width\" value=\"70000\"/></film>",
     .says = ":6:22: parameter \"width\" of hdrfilm is 70000"},
    {.film = "<film type=\"hdrfilm\"><rfilter type=\"gausian\"/></film>",
     .says = ":6:22: unknown rfilter \"gausian\""},
    {.shape = "<shape type=\"sphere\"><float name=\"radiu\" value=\"1\"/></shape>",
     .says = ":9:22: unused parameter \"radiu\" of sphere"},
    {.shape = "<shape type=\"obj\"><string name=\"filename\" value=\"nowhere.obj\"/></shape>",
     .says = ":9:1: nowhere.obj: cannot open this mesh"},
    {.light = "<emitter type=\"constnt\"/>", .says = ":10:1: unknown emitter \"constnt\""},
};

static const char *or_else(const char *given, const char *otherwise) { return given ? given : otherwise; }

static void write_scene(const char *folder, const char *name, const broken_scene *parts)
{
    char text[SCENE_SIZE];
    const int length =
        snprintf(text, sizeof text,
                 "<scene version=\"3.0.0\">\n%s\n<sensor type=\"perspective\">\n"
                 "<float name=\"fov\" value=\"20\"/>\n%s\n%s\n"
                 "<transform name=\"to_world\"><lookat origin=\"0,0,9\" target=\"0,0,0\" up=\"0,1,0\"/></transform>\n"
                 "</sensor>\n%s\n%s\n</scene>\n",
                 or_else(parts->integrator, "<integrator type=\"path\"/>"),
                 or_else(parts->sampler, "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"1\"/>"
                                         "</sampler>"),
                 or_else(parts->film, "<film type=\"hdrfilm\"><integer name=\"width\" value=\"24\"/>"
                                      "<integer name=\"height\" value=\"16\"/></film>"),
                 or_else(parts->shape, "<shape type=\"sphere\"/>"),
                 or_else(parts->light, "<emitter type=\"constant\"/>"));
    assert_true(length > 0 && length < SCENE_SIZE);
    write_text(folder, name, text);
}

static void test_refuses_what_render_refuses(void **state)
{
    for (size_t i = 0; i < sizeof broken_scenes / sizeof broken_scenes[0]; i++) {
        ca_program_result info, render;
        static const char place[] = "caustica: broken.xml:";
        write_scene(folder_of(state), "broken.xml", &broken_scenes[i]);
        RUN(&info, "info", "broken.xml");
        RUN(&render, "render", "broken.xml", "-o", "broken.pfm", "--quiet");
        assert_exit(&render, 1);
        assert_exit(&info, 1);
        assert_string_equal(info.errors, render.errors);
        assert_says(info.errors, broken_scenes[i].says);
        if (broken_scenes[i].says[0] == ':') assert_memory_equal(info.errors, place, strlen(place));
        assert_string_equal(info.output, "");
        assert_false(exists(folder_of(state), "broken.pfm"));
    }
}

/* An integrator brings its own sampler where the scene names none, as in a render. */
static void test_sampler(void **state)
{
    static const struct {
        const char *integrator, *sampler, *says;
    } cases[] = {
        {"<integrator type=\"qmcppm\"/>", "", "sampler     halton, "},
        {"<integrator type=\"qmcppm\"/>", "<sampler type=\"independent\"/>", "sampler     independent, "},
        {"<integrator type=\"path\"/>", "", "sampler     independent, "},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ca_program_result r;
        const broken_scene parts = {.integrator = cases[i].integrator, .sampler = cases[i].sampler};
        write_scene(folder_of(state), "sampler.xml", &parts);
        RUN(&r, "info", "sampler.xml");
        assert_exit(&r, 0);
        assert_says(r.output, cases[i].says);
    }
}

/* The parts that the broken scenes keep are good, and so is each integrator without parameters. */
static void test_accepts_what_render_accepts(void **state)
{
    const ca_integrator_type *type;
    for (size_t i = 0; (type = ca_integrator_at(i)) != NULL; i++) {
        ca_program_result info, render;
        char integrator[64];
        snprintf(integrator, sizeof integrator, "<integrator type=\"%s\"/>", type->name);
        write_scene(folder_of(state), "good.xml", &(broken_scene){.integrator = integrator});
        RUN(&info, "info", "good.xml");
        RUN(&render, "render", "good.xml", "-o", "good.pfm", "--quiet");
        assert_exit(&render, 0);
        assert_exit(&info, 0);
        assert_says(info.output, type->name);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        PROGRAM_TEST(test_refuses_what_render_refuses),
        PROGRAM_TEST(test_sampler),
        PROGRAM_TEST(test_accepts_what_render_accepts),
    };
    return run_program_tests("command line: info", tests, sizeof tests / sizeof tests[0]);
}
