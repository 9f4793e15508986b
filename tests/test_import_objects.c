/* Every plugin and parameter ends in the field it belongs to; every default is the documented one. */
#include "support/import_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static ca_scene_desc desc;

static void import(const char *text) { import_text(&desc, text, NULL, 0); }

static void import_with_sensor(const char *sensor)
{
    char text[4096];
    snprintf(text, sizeof text, "<scene version=\"3.0.0\">%s</scene>", sensor);
    import(text);
}

/* A constant spectrum of 1 as emission. */
static const double equal_energy[3] = {1.2050668, 0.948216736, 0.908972979};

static void done(void) { ca_scene_desc_destroy(&desc); }

static void near(double actual, double expected)
{
    if (!(fabs(actual - expected) <= 1e-6 * fmax(1.0, fabs(expected))))
        fail_msg("%.9g, expected %.9g", actual, expected);
}

static ca_rgb constant(ca_texture_id id)
{
    assert_true(id < desc.textures.count);
    assert_int_equal(desc.textures.items[id].kind, CA_TEXTURE_CONSTANT);
    return desc.textures.items[id].as.constant;
}

static void is_rgb(ca_rgb c, double r, double g, double b)
{
    near((double)c.r, r);
    near((double)c.g, g);
    near((double)c.b, b);
}

static void is_grey(ca_texture_id id, double value) { is_rgb(constant(id), value, value, value); }

/* ---- Sensors, films, samplers, integrators --------------------------------------------------------------------- */

static void sensor_defaults(void **state)
{
    (void)state;
    import_with_sensor("<sensor type=\"perspective\"/>");
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_PERSPECTIVE);
    assert_int_equal(desc.camera.fov_axis, CA_FOV_DIAGONAL);
    near(desc.camera.fov_degrees, 46.793001);
    /* 50 mm in 4:3: the width is 0.8 of the diagonal. */
    near((double)desc.camera.camera.as.perspective.tan_half_x, 0.8 * 0.43266615);
    near((double)desc.camera.camera.near_clip, 1e-2);
    near((double)desc.camera.camera.far_clip, 1e4);
    assert_int_equal(desc.film.width, 768);
    assert_int_equal(desc.film.height, 576);
    assert_int_equal(desc.film.crop_width, 768);
    assert_int_equal(desc.film.crop_height, 576);
    assert_int_equal(desc.film.filter.kind, CA_RFILTER_GAUSSIAN);
    assert_int_equal(desc.sampler.kind, CA_SAMPLER_INDEPENDENT);
    assert_int_equal(desc.samples_per_pixel, 4);
    assert_null(desc.integrator.name);
    done();
}

static void perspective_parameters(void **state)
{
    (void)state;
    import_with_sensor(
        "\n <sensor type=\"perspective\"><float name=\"fov\" value=\"90\"/><string name=\"fov_axis\" value=\"y\"/>"
        "<float name=\"near_clip\" value=\"0.1\"/><float name=\"far_clip\" value=\"50\"/>"
        "<float name=\"principal_point_offset_x\" value=\"0.125\"/>"
        "<float name=\"principal_point_offset_y\" value=\"-0.25\"/>"
        "<float name=\"shutter_open\" value=\"0\"/><float name=\"shutter_close\" value=\"1\"/>"
        "<transform name=\"to_world\"><translate z=\"3\"/></transform>"
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"200\"/><integer name=\"height\" value=\"100\"/>"
        "<integer name=\"crop_offset_x\" value=\"10\"/><integer name=\"crop_offset_y\" value=\"20\"/>"
        "<integer name=\"crop_width\" value=\"30\"/><integer name=\"crop_height\" value=\"40\"/>"
        "<string name=\"pixel_format\" value=\"rgba\"/><boolean name=\"sample_border\" value=\"true\"/></film>"
        "<sampler type=\"sobol\"><integer name=\"sample_count\" value=\"77\"/><integer name=\"seed\" value=\"5\"/>"
        "</sampler></sensor>");
    near((double)desc.camera.camera.as.perspective.tan_half_x, 2.0);
    assert_int_equal(desc.camera.fov_axis, CA_FOV_Y);
    near((double)desc.camera.camera.near_clip, 0.1);
    near((double)desc.camera.camera.far_clip, 50.0);
    near((double)desc.camera.camera.principal_x, 0.125);
    near((double)desc.camera.camera.principal_y, -0.25);
    near((double)desc.camera.camera.map.to[2][3], 3.0);
    near((double)desc.camera.camera.map.from[2][3], -3.0);
    assert_int_equal(desc.camera.camera.width, 200);
    assert_int_equal(desc.camera.camera.height, 100);
    assert_int_equal(desc.camera.where.line, 2);
    assert_int_equal(desc.camera.where.column, 2);
    assert_int_equal(desc.film.crop_x, 10);
    assert_int_equal(desc.film.crop_y, 20);
    assert_int_equal(desc.film.crop_width, 30);
    assert_int_equal(desc.film.crop_height, 40);
    assert_int_equal(desc.sampler.kind, CA_SAMPLER_SOBOL);
    assert_int_equal(desc.sampler.seed, 5);
    assert_int_equal(desc.samples_per_pixel, 77);
    done();
}

static void other_sensors(void **state)
{
    (void)state;
    import_with_sensor("<sensor type=\"thinlens\"><float name=\"aperture_radius\" value=\"0.5\"/>"
                       "<float name=\"focus_distance\" value=\"7\"/><string name=\"focal_length\" value=\"25mm\"/>"
                       "</sensor>");
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_THIN_LENS);
    near((double)desc.camera.camera.as.thin_lens.lens_radius, 0.5);
    near((double)desc.camera.camera.as.thin_lens.focus_distance, 7.0);
    near((double)desc.camera.camera.as.thin_lens.tan_half_x, 0.8 * 0.86533230);
    done();
    import_with_sensor("<sensor type=\"orthographic\"><transform name=\"to_world\"><scale value=\"4\"/></transform>"
                       "</sensor>");
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_ORTHOGRAPHIC);
    near((double)desc.camera.camera.map.to[0][0], 4.0);
    near(desc.camera.fov_degrees, 0.0);
    done();
}

/* Along the ray, from its origin; a meter's number is what a film of one pixel has. */
static void radiance_meters(void **state)
{
    (void)state;
#define METER(inside) "<sensor type=\"radiancemeter\">" inside ONE_PIXEL "</sensor>"
#define ONE_PIXEL \
    "<film type=\"hdrfilm\"><integer name=\"width\" value=\"1\"/><integer name=\"height\" value=\"1\"/></film>"
    static const double directions[][3] = {{3, 0, -4}, {0, -2, 0}, {0, 0, 1}, {1, 1, 1}, {-5, 0, 0}};
    for (size_t i = 0; i < sizeof directions / sizeof *directions; i++) {
        const double *d = directions[i], length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        char text[600];
        snprintf(text, sizeof text,
                 METER("<point name=\"origin\" value=\"1, 2, 3\"/><vector name=\"direction\" value=\"%g, %g, %g\"/>"),
                 d[0], d[1], d[2]);
        import_with_sensor(text);
        const ca_camera *camera = &desc.camera.camera;
        assert_int_equal(camera->kind, CA_CAMERA_PERSPECTIVE);
        for (int k = 0; k < 3; k++) {
            near((double)camera->map.to[k][3], k + 1.0);
            near((double)camera->map.to[k][2], d[k] / length);
        }
        done();
    }
    import_with_sensor(METER("<transform name=\"to_world\"><translate x=\"5\"/></transform>"));
    near((double)desc.camera.camera.map.to[0][3], 5.0);
    near((double)desc.camera.camera.as.perspective.tan_half_x, 0.5e-4 * 3.14159265358979 / 180.0);
    done();
}

#define PLATE "<string name=\"lens\" value=\"inf 5 1.5 20; inf 0 1 20\"/>"
#define SINGLET "<string name=\"lens\" value=\"50 4 1.5 20; -50 1 1 20; 0 0 1 12\"/>"

/* Behind its last surface, by the equation of a single surface, twice. */
static double image_of_singlet(double distance)
{
    const double inside = 1.5 / (0.5 / 50.0 - 1.0 / distance);
    return 1.0 / (0.5 / 50.0 + 1.5 / (inside - 4.0)) - 1.0;
}

static void realistic_parameters(void **state)
{
    (void)state;
    import_with_sensor("<sensor type=\"realistic\">" SINGLET "</sensor>");
    const ca_realistic *camera = &desc.camera.camera.as.realistic;
    assert_int_equal(desc.camera.camera.kind, CA_CAMERA_REALISTIC);
    assert_int_equal(camera->lens.count, 3);
    near(camera->lens.surfaces[1].radius, -50.0);
    near(camera->lens.surfaces[1].thickness, 1.0);
    near(camera->lens.surfaces[0].index, 1.5);
    near(camera->lens.surfaces[0].aperture, 10.0);
    near(camera->lens.surfaces[2].radius, 0.0);
    near(camera->lens.surfaces[2].aperture, 6.0);
    near(camera->scale, 1e-3);
    near(camera->film_diagonal, 35.0);
    near(camera->film_distance, image_of_singlet(1e7)); /* focused on far_clip */
    done();
    import_with_sensor("<sensor type=\"realistic\">" SINGLET "<float name=\"focus_distance\" value=\"3\"/>"
                       "<float name=\"lens_scale\" value=\"0.01\"/><float name=\"film_diagonal\" value=\"20\"/>"
                       "<float name=\"aperture_diameter\" value=\"4\"/></sensor>");
    near(camera->film_distance, image_of_singlet(300.0));
    near(camera->film_diagonal, 20.0);
    near(camera->lens.surfaces[0].aperture, 10.0);
    near(camera->lens.surfaces[2].aperture, 2.0);
    done();
    import_with_sensor("<sensor type=\"realistic\">" PLATE "<float name=\"film_distance\" value=\"30\"/></sensor>");
    near(camera->film_distance, 30.0);
    near(camera->lens.surfaces[0].radius, 0.0);
    done();
}

/* A stop may lie in glass, where there is glass before it. */
static void stop_in_glass(void **state)
{
    (void)state;
    import_with_sensor(
        "<sensor type=\"realistic\"><string name=\"lens\" value=\"50 2 1.5 20; 0 2 0 9; -50 0 1 20\"/></sensor>");
    near(desc.camera.camera.as.realistic.lens.surfaces[1].index, 1.5);
    done();
}

/* A published table: columns by name, air left out, glasses by their codes. */
static void published_lens(void **state)
{
    (void)state;
    import_with_sensor(
        "<sensor type=\"realistic\"><string name=\"lens\" value=\"surface radius thickness diameter glass "
        "abbe; 1 60 4 20 517-642 64.2; 2 -60 2 20; 3* stop 1.5 8; 4 inf 3 18 620364; 5 40 - 18\"/>"
        "<float name=\"film_distance\" value=\"30\"/></sensor>");
    const ca_lens *lens = &desc.camera.camera.as.realistic.lens;
    static const double rows[5][4] = {
        {60, 4, 1.517, 10}, {-60, 2, 1, 10}, {0, 1.5, 1, 4}, {0, 3, 1.62, 9}, {40, 0, 1, 9}};
    assert_int_equal(lens->count, 5);
    for (int i = 0; i < 5; i++) {
        near(lens->surfaces[i].radius, rows[i][0]);
        near(lens->surfaces[i].thickness, rows[i][1]);
        near(lens->surfaces[i].index, rows[i][2]);
        near(lens->surfaces[i].aperture, rows[i][3]);
    }
    done();
}

static void samplers(void **state)
{
    (void)state;
    for (int kind = 0; kind < CA_SAMPLER_KIND_COUNT; kind++) {
        char text[256];
        snprintf(text, sizeof text,
                 "<sensor type=\"perspective\"><sampler type=\"%s\"><integer name=\"seed\" value=\"%d\"/></sampler>"
                 "</sensor>",
                 ca_sampler_name((ca_sampler_kind)kind), kind + 3);
        import_with_sensor(text);
        assert_int_equal(desc.sampler.kind, kind);
        assert_int_equal(desc.sampler.seed, kind + 3);
        assert_int_equal(desc.samples_per_pixel, 4);
        done();
    }
}

static ca_filter import_filter(const char *filter)
{
    char text[512];
    snprintf(text, sizeof text, "<sensor type=\"perspective\"><film type=\"tiledhdrfilm\">%s</film></sensor>",
             filter);
    import_with_sensor(text);
    const ca_filter result = desc.film.filter;
    done();
    return result;
}

/* Each sensor has its film and sampler; those of the chosen one stay. */
static void several_sensors(void **state)
{
    (void)state;
    static const char text[] =
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><float name=\"fov\" value=\"30\"/>"
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"10\"/></film></sensor>"
        "<sensor type=\"orthographic\"><film type=\"hdrfilm\"><integer name=\"width\" "
        "value=\"20\"/></film><sampler type=\"sobol\"/></sensor><sensor type=\"perspective\"><float name=\"fov\" "
        "value=\"50\"/></sensor></scene>";
    static const uint32_t widths[3] = {10, 20, 768};
    static const double fov[3] = {30.0, 0.0, 50.0};
    const char *path = import_write_text("sensors.xml", text);
    ca_error error;
    for (uint32_t i = 0; i < 3; i++) {
        const ca_scene_source source = {.path = path, .sensor = i};
        assert_int_equal(ca_import_scene_source(&source, &desc, &error), CA_OK);
        assert_int_equal(desc.film.width, widths[i]);
        assert_int_equal(desc.camera.camera.width, widths[i]);
        near(desc.camera.fov_degrees, fov[i]);
        assert_int_equal(desc.sampler.kind, i == 1 ? CA_SAMPLER_SOBOL : CA_SAMPLER_INDEPENDENT);
        assert_int_equal(desc.notes.count, i == 0);
        done();
    }
    const ca_scene_source source = {.path = path, .sensor = 3};
    assert_int_equal(ca_import_scene_source(&source, &desc, &error), CA_ERROR_ARGUMENT);
    assert_string_equal(error.message, "there is no sensor 3: the scene has 3, counted from 0");
}

/* The film is the batch's, divided: the sensors' own films and samplers do not count. */
static void sensors_side_by_side(void **state)
{
    (void)state;
    import_with_sensor(
        "<sensor type=\"batch\"><sensor type=\"perspective\"><float name=\"fov\" value=\"90\"/>"
        "<string name=\"fov_axis\" value=\"y\"/><film type=\"hdrfilm\"><integer name=\"width\" value=\"7\"/>"
        "<rfilter type=\"box\"/></film><sampler type=\"sobol\"/></sensor>"
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"40\"/>"
        "<integer name=\"height\" value=\"10\"/></film><sensor type=\"orthographic\"><transform name=\"to_world\">"
        "<translate x=\"5\"/></transform></sensor></sensor>");
    const ca_camera *camera = &desc.camera.camera;
    assert_int_equal(camera->kind, CA_CAMERA_PANELS);
    assert_int_equal(camera->as.panels.count, 2);
    assert_int_equal(camera->width, 40);
    assert_int_equal(desc.film.width, 40);
    assert_int_equal(desc.film.filter.kind, CA_RFILTER_GAUSSIAN);
    assert_int_equal(desc.sampler.kind, CA_SAMPLER_INDEPENDENT);
    const ca_camera *panels = camera->as.panels.cameras;
    assert_int_equal(panels[0].kind, CA_CAMERA_PERSPECTIVE);
    assert_int_equal(panels[0].width, 20);
    assert_int_equal(panels[0].height, 10);
    near((double)panels[0].as.perspective.tan_half_x, 2.0); /* twice as wide as high */
    assert_int_equal(panels[1].kind, CA_CAMERA_ORTHOGRAPHIC);
    near((double)panels[1].map.to[0][3], 5.0);
    done();
}

/* As many pixels as meters: the filter is a box, as of one. */
static void meters_side_by_side(void **state)
{
    (void)state;
    import_with_sensor("<sensor type=\"batch\"><sensor type=\"radiancemeter\"/><sensor type=\"radiancemeter\"/>"
                       "<film type=\"hdrfilm\"><integer name=\"width\" value=\"2\"/>"
                       "<integer name=\"height\" value=\"1\"/></film></sensor>");
    assert_int_equal(desc.camera.camera.as.panels.count, 2);
    assert_int_equal(desc.film.filter.kind, CA_RFILTER_BOX);
    done();
}

/* A film, its filter and a sampler that wait for sensors: one without them keeps the defaults. */
static void shared_parts_of_sensors(void **state)
{
    (void)state;
    static const char parts[] =
        "<scene version=\"3.0.0\"><rfilter type=\"box\" id=\"flat\"/><film type=\"hdrfilm\" id=\"small\">"
        "<integer name=\"width\" value=\"9\"/><string name=\"label[1, 2]\" value=\"x\"/><ref id=\"flat\"/></film>"
        "<sampler type=\"sobol\" id=\"even\"><integer name=\"sample_count\" value=\"7\"/></sampler>";
    for (int uses = 0; uses < 2; uses++) {
        char text[1024];
        snprintf(text, sizeof text, "%s<sensor type=\"perspective\">%s</sensor></scene>", parts,
                 uses ? "<ref id=\"small\"/><ref id=\"even\"/>" : "");
        import(text);
        assert_int_equal(desc.film.width, uses ? 9 : 768);
        assert_int_equal(desc.film.filter.kind, uses ? CA_RFILTER_BOX : CA_RFILTER_GAUSSIAN);
        assert_int_equal(desc.sampler.kind, uses ? CA_SAMPLER_SOBOL : CA_SAMPLER_INDEPENDENT);
        assert_int_equal(desc.samples_per_pixel, uses ? 7 : 4);
        done();
    }
}

static void filters(void **state)
{
    (void)state;
    ca_filter f = import_filter("<rfilter type=\"box\"/>");
    assert_int_equal(f.kind, CA_RFILTER_BOX);
    near((double)f.radius, 0.5);
    f = import_filter("<rfilter type=\"tent\"><float name=\"radius\" value=\"1.5\"/></rfilter>");
    assert_int_equal(f.kind, CA_RFILTER_TENT);
    near((double)f.radius, 1.5);
    f = import_filter("<rfilter type=\"gaussian\"><float name=\"stddev\" value=\"1\"/></rfilter>");
    assert_int_equal(f.kind, CA_RFILTER_GAUSSIAN);
    const ca_filter gaussian = ca_filter_default(CA_RFILTER_GAUSSIAN);
    near((double)f.stddev, 1.0);
    near((double)(f.radius / f.stddev), (double)(gaussian.radius / gaussian.stddev));
    f = import_filter("<rfilter type=\"mitchell\"><float name=\"B\" value=\"0.25\"/><float name=\"C\" value=\"0.5\"/>"
                      "</rfilter>");
    assert_int_equal(f.kind, CA_RFILTER_MITCHELL);
    near((double)f.b, 0.25);
    near((double)f.c, 0.5);
    assert_int_equal(import_filter("<rfilter type=\"catmullrom\"/>").kind, CA_RFILTER_CATMULL_ROM);
    f = import_filter("<rfilter type=\"lanczos\"><integer name=\"lobes\" value=\"2\"/></rfilter>");
    assert_int_equal(f.kind, CA_RFILTER_LANCZOS);
    near((double)f.lobes, 2.0);
    near((double)f.radius, 2.0);
}

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

/* The note without its place; the scene has no other. */
static void is_noted(const char *sentence)
{
    assert_int_equal(desc.notes.count, 1);
    const char *found = strstr(desc.notes.items[0], sentence);
    if (!found || strcmp(found, sentence) != 0) fail_msg("the note is \"%s\"", desc.notes.items[0]);
}

static const char one_attribute[] =
    "<scene version='3.0.0'><sensor type='perspective'/><shape type='ply'><string name='filename' value='%s'/>"
    "<bsdf type='diffuse'><texture type='mesh_attribute' name='reflectance'><string name='name' value='%s'/>"
    "</texture></bsdf></shape></scene>";

/* A name that no mesh has is told. */
static void attributes_of_meshes(void **state)
{
    (void)state;
    import_write_text("grey.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                  "property float z\nproperty float r\nproperty float g\nproperty float b\n"
                                  "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                  "0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n3 0 1 2\n");
    char text[1024];
    snprintf(text, sizeof text, one_attribute, "grey.ply", "vertex_color");
    import(text);
    assert_int_equal(desc.notes.count, 0);
    done();
    snprintf(text, sizeof text, one_attribute, "grey.ply", "vertex_colour");
    import(text);
    is_noted("no mesh has the attribute of this texture: it is black");
    done();
}

static void samplers_of_mitsuba(void **state)
{
    (void)state;
    static const struct {
        const char *name, *parameter;
        ca_sampler_kind kind;
        const char *note;
    } known[] = {
        {"ldsampler", "<integer name=\"dimension\" value=\"4\"/>", CA_SAMPLER_SOBOL,
         "1:51: sampler \"ldsampler\" is read as \"sobol\""},
        {"stratified", "<boolean name=\"jitter\" value=\"true\"/>", CA_SAMPLER_SOBOL,
         "1:51: sampler \"stratified\" is read as \"sobol\""},
        {"multijitter", "", CA_SAMPLER_SOBOL, "1:51: sampler \"multijitter\" is read as \"sobol\""},
        {"orthogonal", "<integer name=\"strength\" value=\"3\"/>", CA_SAMPLER_SOBOL,
         "1:51: sampler \"orthogonal\" is read as \"sobol\""},
        {"hammersley", "", CA_SAMPLER_HALTON, "1:51: sampler \"hammersley\" is read as \"halton\""},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        char text[512];
        snprintf(text, sizeof text,
                 "<sensor type=\"perspective\"><sampler type=\"%s\"><integer name=\"sample_count\" value=\"9\"/>%s"
                 "</sampler></sensor>",
                 known[i].name, known[i].parameter);
        import_with_sensor(text);
        assert_int_equal(desc.sampler.kind, known[i].kind);
        assert_int_equal(desc.samples_per_pixel, 9);
        is_noted(known[i].note);
        done();
    }
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

/* ---- Shapes ---------------------------------------------------------------------------------------------------- */

static void quadrics(void **state)
{
    (void)state;
    import(SCENE("<shape type=\"sphere\" id=\"ball\"><point name=\"center\" x=\"1\" y=\"2\" z=\"3\"/>"
                 "<float name=\"radius\" value=\"0.5\"/><boolean name=\"flip_normals\" value=\"true\"/></shape>\n"
                 "<shape type=\"disk\"/><shape type=\"cylinder\"><point name=\"p0\" value=\"1 1 1\"/>"
                 "<point name=\"p1\" value=\"2 2 2\"/><float name=\"radius\" value=\"3\"/></shape>"
                 "<shape type=\"cylinder\"/><shape type=\"sphere\"/>"));
    const ca_shape_desc *s = desc.shapes.items;
    assert_int_equal(desc.shapes.count, 5);
    assert_int_equal(s[0].kind, CA_SHAPE_SPHERE);
    assert_string_equal(s[0].id, "ball");
    near((double)s[0].as.sphere.radius, 0.5);
    near(s[0].as.sphere.center[0], 1.0);
    near(s[0].as.sphere.center[2], 3.0);
    assert_true(s[0].flip_normals);
    assert_int_equal(s[0].material, CA_NONE);
    assert_int_equal(s[0].light, CA_NONE);
    assert_int_equal(s[0].group, CA_NONE);
    assert_int_equal(s[1].kind, CA_SHAPE_DISK);
    assert_int_equal(s[1].where.line, 3);
    assert_int_equal(s[1].where.column, 1);
    assert_int_equal(s[2].kind, CA_SHAPE_CYLINDER);
    near(s[2].as.cylinder.p0[1], 1.0);
    near(s[2].as.cylinder.p1[1], 2.0);
    near((double)s[2].as.cylinder.radius, 3.0);
    near(s[3].as.cylinder.p0[2], 0.0);
    near(s[3].as.cylinder.p1[2], 1.0);
    near((double)s[3].as.cylinder.radius, 1.0);
    near((double)s[4].as.sphere.radius, 1.0);
    done();
}

/* A map that leaves a cylinder's ends circles leaves it exact; others make meshes. */
static void stretched_quadrics(void **state)
{
    (void)state;
#define STRETCHED(type, x, y, z)                                                                                     \
    "<shape type=\"" type "\"><transform name=\"to_world\"><scale x=\"" x "\" y=\"" y "\" z=\"" z "\"/>"             \
    "<rotate x=\"1\" angle=\"30\"/></transform></shape>"
    import(SCENE(STRETCHED("cylinder", "2", "2", "5") STRETCHED("sphere", "3", "-3", "3")));
    assert_int_equal(desc.shapes.items[0].kind, CA_SHAPE_CYLINDER);
    assert_int_equal(desc.shapes.items[1].kind, CA_SHAPE_SPHERE);
    assert_int_equal(desc.notes.count, 0);
    done();
    import(SCENE("<shape type=\"sphere\"><float name=\"radius\" value=\"2\"/><point name=\"center\" value=\"1 2 3\"/>"
                 "<transform name=\"to_world\"><scale x=\"2\"/></transform></shape>"
                 "<shape type=\"cylinder\"><point name=\"p1\" value=\"0 0 4\"/><float name=\"radius\" value=\"0.5\"/>"
                 "<transform name=\"to_world\"><scale y=\"2\"/></transform></shape>"));
    assert_int_equal(desc.notes.count, 2);
    const double area[2] = {4.0 * 3.14159265 * 4.0, 2.0 * 3.14159265 * 0.5 * 4.0}; /* before to_world */
    for (uint32_t i = 0; i < 2; i++) {
        const ca_mesh *mesh = &desc.meshes.items[desc.shapes.items[i].as.mesh.index];
        double sum = 0.0;
        assert_int_equal(desc.shapes.items[i].kind, CA_SHAPE_MESH);
        for (uint32_t t = 0; t < mesh->triangle_count; t++) sum += ca_mesh_triangle_area(mesh, t);
        assert_true(sum < area[i] && sum > (1.0 - 2e-3) * area[i]);
        for (uint32_t t = 0; t < mesh->triangle_count; t++) { /* outside is outside */
            const uint32_t *c = &mesh->indices[3 * (size_t)t];
            const float *p[3] = {&mesh->positions[3 * (size_t)c[0]], &mesh->positions[3 * (size_t)c[1]],
                                 &mesh->positions[3 * (size_t)c[2]]};
            const ca_vec3 e1 = {p[1][0] - p[0][0], p[1][1] - p[0][1], p[1][2] - p[0][2]};
            const ca_vec3 e2 = {p[2][0] - p[0][0], p[2][1] - p[0][1], p[2][2] - p[0][2]};
            const float *n = &mesh->normals[3 * (size_t)c[1]];
            assert_true(ca_dot(ca_cross(e1, e2), (ca_vec3){n[0], n[1], n[2]}) >= 0.0f);
        }
    }
    done();
}

static void merges(void **state)
{
    (void)state;
    import(SCENE("<shape type=\"merge\"><shape type=\"cube\"/><shape type=\"merge\"><shape type=\"disk\"/></shape>"
                 "</shape>"
                 "<shape type=\"shapegroup\" id=\"g\"><shape type=\"merge\"><shape type=\"cube\"/></shape></shape>"));
    assert_int_equal(desc.shapes.count, 3);
    assert_int_equal(desc.shapes.items[1].kind, CA_SHAPE_DISK);
    assert_int_equal(desc.shapes.items[2].group, 0);
    done();
}

#define ODD "<string name=\"filename\" value=\"odd.pfm\"/>"
#define ODD_BITMAP "<texture name=\"reflectance\" type=\"bitmap\">" ODD "</texture>"
#define ENVMAP "<emitter type=\"envmap\">" ODD "</emitter>"
#define BUMPS "<bsdf type=\"bumpmap\"><texture type=\"bitmap\">" ODD "</texture><bsdf type=\"diffuse\"/></bsdf>"

static void write_odd_picture(float value)
{
    unsigned char file[64] = "PF\n1 2\n-1\n";
    const float numbers[6] = {0.5f, value, 0.25f, 0.5f, 0.5f, 0.5f};
    const size_t head = strlen((const char *)file);
    memcpy(file + head, numbers, sizeof numbers);
    import_write("odd.pfm", file, head + sizeof numbers);
}

/* Values above 1 of pictures, and of what is made of several textures, count as 1 where they are shares of light, and
 * a note says so; lights may be brighter. */
static void bright_pictures(void **state)
{
    (void)state;
    static const struct {
        const char *texture;
        const char *note; /* NULL: none */
    } textures[] = {
        {ODD_BITMAP, "values up to 4 count as 1"},
        {"<texture name=\"reflectance\" type=\"scale\"><float name=\"scale\" value=\"0.25\"/>" ODD_BITMAP
         "</texture>",
         NULL},
        {"<texture name=\"reflectance\" type=\"mix\"><float name=\"color0\" value=\"2\"/><float name=\"color1\" "
         "value=\"0.5\"/></texture>",
         "values up to 2 count as 1"},
        {"<texture name=\"reflectance\" type=\"mix\"><float name=\"color0\" value=\"0.2\"/><float name=\"color1\" "
         "value=\"0.5\"/><float name=\"weight\" value=\"3\"/></texture>",
         "values up to 1.5 count as 1"},
        {"<texture name=\"reflectance\" type=\"power\"><float name=\"exponent\" value=\"2\"/>" ODD_BITMAP
         "</texture>",
         "values up to 16 count as 1"},
    };
    write_odd_picture(4.0f);
    for (size_t i = 0; i < sizeof textures / sizeof textures[0]; i++) {
        char text[1024];
        snprintf(text, sizeof text, SCENE("<bsdf type=\"diffuse\">%s</bsdf>"), textures[i].texture);
        import(text);
        assert_int_equal(desc.notes.count, textures[i].note ? 1 : 0);
        if (textures[i].note) assert_non_null(strstr(desc.notes.items[0], textures[i].note));
        const ca_texture_id id = desc.materials.items[0].material.as.diffuse.reflectance;
        assert_int_equal(desc.textures.items[id].kind == CA_TEXTURE_CLAMP, textures[i].note != NULL);
        done();
    }
    import(SCENE(ENVMAP));
    assert_true(desc.images.items[0].data[4] == 4.0f && desc.notes.count == 0);
    done();
}

/* Negative numbers of pictures of colours are none, and a note says so; heights may be negative. */
static void odd_pictures(void **state)
{
    (void)state;
    static const char *const colors[] = {SCENE("<bsdf type=\"diffuse\">" ODD_BITMAP "</bsdf>"), SCENE(ENVMAP)};
    write_odd_picture(-0.001f);
    for (int i = 0; i < 2; i++) {
        import(colors[i]);
        const float *data = desc.images.items[0].data; /* rows from the top; those of the file are from below */
        assert_true(data[3] == 0.5f && data[4] == 0.0f && data[5] == 0.25f && data[0] == 0.5f);
        assert_int_equal(desc.notes.count, 1);
        assert_non_null(strstr(desc.notes.items[0], "no colour is negative: 1 number of "));
        done();
    }
    import(SCENE(BUMPS));
    assert_true(desc.images.items[0].data[4] == -0.001f && desc.notes.count == 0);
    done();
    char expected[1200];
    snprintf(expected, sizeof expected, "2:1: %s/odd.pfm: the pixel (0, 1) is not a finite number", import_folder());
    write_odd_picture(NAN);
    import_expect_error(SCENE(ENVMAP), expected);
}

#define HEIGHTS(body) "<shape type=\"heightfield\">" body "</shape>"
#define PICTURE "<string name=\"filename\" value=\"picture.pfm\"/>"

/* A picture whose luminance is 0.2126, 0.7152 / 0.0722, 2, from above. */
static void height_fields(void **state)
{
    (void)state;
    static const double z[4] = {0.2126, 0.7152, 0.0722, 2.0};
    import_write_picture();
    import(SCENE(HEIGHTS(PICTURE) HEIGHTS(
        "<texture type=\"bitmap\">" PICTURE "</texture><float name=\"scale\" value=\"-3\"/>"
        "<boolean name=\"shadingNormals\" value=\"false\"/>")));
    is_noted("2:1: the patches of a heightfield are two triangles each");
    const ca_mesh *smooth = &desc.meshes.items[0], *flat = &desc.meshes.items[1];
    assert_true(smooth->vertex_count == 4 && smooth->triangle_count == 2 && !flat->normals);
    for (size_t i = 0; i < 4; i++) {
        const double x = (double)(i % 2), y = (double)(i / 2); /* the first row lies at y = -1 */
        near((double)smooth->positions[3 * i], 2.0 * x - 1.0);
        near((double)smooth->positions[3 * i + 1], 2.0 * y - 1.0);
        near((double)smooth->positions[3 * i + 2], z[i]);
        near((double)flat->positions[3 * i + 2], -3.0 * z[i]);
        near((double)smooth->uvs[2 * i], x);
        near((double)smooth->uvs[2 * i + 1], y);
        const size_t row = i - i % 2, column = i % 2; /* the slopes over cells of side 2 */
        const double dx = 0.5 * (z[row + 1] - z[row]), dy = 0.5 * (z[2 + column] - z[column]);
        const double length = sqrt(dx * dx + dy * dy + 1.0);
        near((double)smooth->normals[3 * i], -dx / length);
        near((double)smooth->normals[3 * i + 1], -dy / length);
        near((double)smooth->normals[3 * i + 2], 1.0 / length);
    }
    const uint32_t corners[6] = {0, 1, 3, 0, 3, 2}; /* facing +z */
    assert_memory_equal(smooth->indices, corners, sizeof corners);
    done();
}

/* Inside of a field a normal has the slope over both cells, here those of a saddle z = x y of 3 x 3. */
static void height_field_normals(void **state)
{
    (void)state;
    float bytes[9];
    char file[64] = "Pf\n3 3\n-1\n";
    for (int i = 0; i < 9; i++) bytes[i] = (float)((i % 3 - 1) * (1 - i / 3)); /* PFM rows run from below */
    memcpy(file + 10, bytes, sizeof bytes);
    import_write("saddle.pfm", file, 10 + sizeof bytes);
    import(SCENE(HEIGHTS("<string name=\"filename\" value=\"saddle.pfm\"/>")));
    const ca_mesh *mesh = &desc.meshes.items[0];
    assert_int_equal(mesh->vertex_count, 9);
    for (size_t i = 0; i < 9; i++) {
        const float *p = mesh->positions + 3 * i, *n = mesh->normals + 3 * i;
        near((double)p[2], (double)p[0] * (double)p[1]);
        near((double)(n[0] / n[2]), -(double)p[1]); /* exact: z is linear along x and along y */
        near((double)(n[1] / n[2]), -(double)p[0]);
    }
    done();
}

static void bad_height_fields(void **state)
{
    (void)state;
    import_write_text("dot.pgm", "P2 1 1 255 7");
    import_expect_error(SCENE(HEIGHTS("<string name=\"filename\" value=\"dot.pgm\"/>")),
                        "2:1: a height field needs 2 x 2 heights, and this picture has 1 x 1");
    import_expect_error(SCENE(HEIGHTS("<texture type=\"checkerboard\"/>")),
                        "2:27: a height field is made from a bitmap; other textures have no pixels");
    import_expect_error(SCENE(HEIGHTS(PICTURE "<texture type=\"bitmap\">" PICTURE "</texture>")),
                        "2:27: parameter \"filename\" of heightfield excludes a nested texture");
    import_expect_error(SCENE(HEIGHTS("")), "2:1: parameter \"filename\" of heightfield must name a file");
}

static void meshes(void **state)
{
    (void)state;
    import_write_triangle();
#define OBJ(body) "<shape type=\"obj\"><string name=\"filename\" value=\"triangle.obj\"/>" body "</shape>"
    import(SCENE("<shape type=\"rectangle\"/><shape type=\"cube\"/>" OBJ("")
                     OBJ("<boolean name=\"face_normals\" value=\"true\"/>")
                         OBJ("<boolean name=\"flip_tex_coords\" value=\"false\"/>")));
    assert_int_equal(desc.meshes.count, 5);
    for (uint32_t i = 0; i < 5; i++) assert_int_equal(desc.shapes.items[i].as.mesh.index, i);
    assert_int_equal(desc.meshes.items[0].triangle_count, 2);
    assert_int_equal(desc.meshes.items[1].triangle_count, 12);
    const ca_mesh *obj = &desc.meshes.items[2];
    assert_int_equal(obj->triangle_count, 1);
    /* Without normals in the file they are computed, unless face_normals forbids it. */
    assert_non_null(obj->normals);
    near((double)obj->normals[2], 1.0);
    assert_null(desc.meshes.items[3].normals);
    /* As Mitsuba: v of an OBJ is turned round, and bitmaps have v = 0 at their top. */
    near((double)obj->uvs[5], 0.25);
    near((double)desc.meshes.items[4].uvs[5], 0.75);
    done();
}

static void groups_and_instances(void **state)
{
    (void)state;
    import(
        SCENE("<shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><translate x=\"5\"/></transform>"
              "</shape><shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\"/><shape type=\"sphere\"/></shape>"
              "<shape type=\"instance\"><ref id=\"g\"/></shape><shape type=\"disk\"/>"));
    assert_int_equal(desc.groups.count, 1);
    assert_string_equal(desc.groups.items[0].id, "g");
    assert_int_equal(desc.instances.count, 2);
    assert_int_equal(desc.instances.items[0].group, 0);
    near(desc.instances.items[0].to_world.m[0][3], 5.0);
    assert_int_equal(desc.instances.items[1].group, 0);
    assert_int_equal(desc.shapes.count, 3);
    assert_int_equal(desc.shapes.items[0].group, 0);
    assert_int_equal(desc.shapes.items[1].group, 0);
    assert_int_equal(desc.shapes.items[2].group, CA_NONE);
    done();
}

/* ---- Emitters -------------------------------------------------------------------------------------------------- */

static void area_lights(void **state)
{
    (void)state;
    import(SCENE("<emitter type=\"constant\"/><shape type=\"cube\">\n<emitter type=\"area\">"
                 "<rgb name=\"radiance\" value=\"1 2 3\"/></emitter></shape>"
                 "<shape type=\"cube\"><emitter type=\"area\"><texture name=\"radiance\" type=\"checkerboard\"/>"
                 "</emitter></shape><shape type=\"sphere\"><emitter type=\"area\"/></shape>"));
    const ca_light_desc *l = desc.lights.items;
    assert_int_equal(desc.lights.count, 4);
    for (uint32_t i = 0; i < 3; i++) assert_int_equal(desc.shapes.items[i].light, i + 1);
    assert_int_equal(l[1].kind, CA_LIGHT_AREA);
    assert_int_equal(l[1].where.line, 3);
    is_rgb(constant(l[1].as.area.radiance), 1.0, 2.0, 3.0);
    assert_int_equal(desc.textures.items[l[2].as.area.radiance].kind, CA_TEXTURE_CHECKERBOARD);
    is_grey(l[3].as.area.radiance, 1.0);
    done();
}

/* Directly in <scene>, before and behind the shapes that refer to them. */
static void area_lights_by_reference(void **state)
{
    (void)state;
    import(SCENE("<emitter type=\"area\" id=\"early\"><rgb name=\"radiance\" value=\"1 2 3\"/></emitter>"
                 "<shape type=\"cube\"><ref id=\"late\"/></shape><shape type=\"sphere\"><ref id=\"early\"/></shape>"
                 "<emitter type=\"point\"/>"
                 "<emitter type=\"area\" id=\"late\"><rgb name=\"radiance\" value=\"4 5 6\"/></emitter>"
                 "<emitter type=\"area\" id=\"unused\"/>"));
    assert_int_equal(desc.lights.count, 3);
    assert_int_equal(desc.shapes.items[0].light, 0);
    assert_int_equal(desc.shapes.items[1].light, 1);
    is_rgb(constant(desc.lights.items[0].as.area.radiance), 4.0, 5.0, 6.0);
    is_rgb(constant(desc.lights.items[1].as.area.radiance), 1.0, 2.0, 3.0);
    assert_int_equal(desc.lights.items[2].kind, CA_LIGHT_POINT);
    assert_int_equal(desc.notes.count, 1);
    assert_non_null(strstr(desc.notes.items[0], "emitter \"unused\" shines nowhere: no shape holds it or"));
    done();
}

static void point_lights(void **state)
{
    (void)state;
    import(SCENE("<emitter type=\"point\"><point name=\"position\" x=\"1\" y=\"2\" z=\"3\"/>"
                 "<rgb name=\"intensity\" value=\"4 5 6\"/></emitter>"
                 "<emitter type=\"point\"><transform name=\"to_world\"><translate y=\"7\"/></transform></emitter>"
                 "<emitter type=\"spot\"><spectrum name=\"intensity\" value=\"8\"/></emitter>"
                 "<emitter type=\"spot\"><float name=\"cutoff_angle\" value=\"40\"/><float name=\"beam_width\" "
                 "value=\"10\"/><texture name=\"texture\" type=\"checkerboard\"/>"
                 "<transform name=\"to_world\"><lookat origin=\"0 3 0\" target=\"0 0 0\" up=\"0 0 1\"/></transform>"
                 "</emitter>"));
    const ca_light_desc *l = desc.lights.items;
    assert_int_equal(l[0].kind, CA_LIGHT_POINT);
    near(l[0].as.point.position[2], 3.0);
    is_rgb(l[0].as.point.intensity, 4.0, 5.0, 6.0);
    near(l[1].as.point.position[1], 7.0);
    is_rgb(l[1].as.point.intensity, 1.0, 1.0, 1.0);
    assert_int_equal(l[2].kind, CA_LIGHT_SPOT);
    is_rgb(l[2].as.spot.intensity, 8.0 * equal_energy[0], 8.0 * equal_energy[1], 8.0 * equal_energy[2]);
    near(l[2].as.spot.cutoff_degrees, 20.0);
    near(l[2].as.spot.beam_degrees, 15.0);
    assert_int_equal(l[2].as.spot.texture, CA_NONE);
    near(l[3].as.spot.cutoff_degrees, 40.0);
    near(l[3].as.spot.beam_degrees, 10.0);
    near(l[3].as.spot.to_world.m[1][3], 3.0);
    near(l[3].as.spot.to_world.m[1][2], -1.0);
    /* Lights hand v upwards, Mitsuba's texture expects it downwards. */
    const ca_texture *thrown = &desc.textures.items[l[3].as.spot.texture];
    near((double)thrown->to_uv[1][1], -1.0);
    near((double)thrown->to_uv[1][2], 1.0);
    done();
}

static void distant_lights(void **state)
{
    (void)state;
    import_write_picture();
    import(
        SCENE("<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"-2\" z=\"0\"/>"
              "<rgb name=\"irradiance\" value=\"3\"/></emitter>"
              "<emitter type=\"directional\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/></transform>"
              "</emitter>"
              "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"0.1 0.2 0.3\"/></emitter>"
              "<emitter type=\"envmap\"><string name=\"filename\" value=\"picture.pfm\"/>"
              "<float name=\"scale\" value=\"2\"/><transform name=\"to_world\"><rotate y=\"1\" angle=\"90\"/>"
              "</transform></emitter>"));
    const ca_light_desc *l = desc.lights.items;
    assert_int_equal(l[0].kind, CA_LIGHT_DIRECTIONAL);
    near(l[0].as.directional.direction[1], -1.0);
    is_rgb(l[0].as.directional.irradiance, 3.0, 3.0, 3.0);
    near(l[1].as.directional.direction[1], -1.0);
    assert_int_equal(l[2].kind, CA_LIGHT_CONSTANT);
    is_rgb(l[2].as.constant.radiance, 0.1, 0.2, 0.3);
    assert_int_equal(l[3].kind, CA_LIGHT_ENVMAP);
    assert_int_equal(l[3].as.envmap.image, 0);
    is_rgb(l[3].as.envmap.scale, 2.0, 2.0, 2.0);
    near(l[3].as.envmap.to_world.m[0][2], 1.0);
    done();
}

static void projectors(void **state)
{
    (void)state;
    import_write_picture();
    import(SCENE("<emitter type=\"projector\"><texture name=\"irradiance\" type=\"bitmap\">"
                 "<string name=\"filename\" value=\"picture.pfm\"/></texture><float name=\"scale\" value=\"5\"/>"
                 "<float name=\"fov\" value=\"90\"/></emitter>"
                 "<emitter type=\"projector\"/>"));
    const ca_light_desc *l = desc.lights.items;
    assert_int_equal(l[0].kind, CA_LIGHT_PROJECTOR);
    is_rgb(l[0].as.projector.scale, 5.0, 5.0, 5.0);
    near(l[0].as.projector.tan_half_x, 1.0);
    near(l[0].as.projector.tan_half_y, 1.0);
    /* Upright: the two turns of v cancel. */
    const ca_texture *thrown = &desc.textures.items[l[0].as.projector.picture];
    assert_int_equal(thrown->kind, CA_TEXTURE_BITMAP);
    near((double)thrown->to_uv[1][1], 1.0);
    near((double)thrown->to_uv[1][2], 0.0);
    is_grey(l[1].as.projector.picture, 1.0);
    near(l[1].as.projector.tan_half_x, 0.43266615 / sqrt(2.0));
    done();
}

/* ---- Textures and colours -------------------------------------------------------------------------------------- */

static void textures(void **state)
{
    (void)state;
    import_write_picture();
#define BITMAP(body) "<texture type=\"bitmap\"><string name=\"filename\" value=\"picture.pfm\"/>" body "</texture>"
    import(SCENE(
        BITMAP("")
            BITMAP(
                "<string name=\"filter_type\" value=\"nearest\"/><string name=\"wrap_mode\" "
                "value=\"clamp\"/><transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/>"
                "<translate x=\"0.5\" y=\"0.25\"/></transform>") BITMAP("<boolean name=\"raw\" "
                                                                        "value=\"true\"/><string name=\"wrap_mode\" "
                                                                        "value=\"mirror\"/>") "<texture "
                                                                                              "type=\"checkerboard\">"
                                                                                              "<rgb name=\"color0\" "
                                                                                              "value=\"1 0 "
                                                                                              "0\"/></texture>"
                                                                                              "<texture "
                                                                                              "type=\"mesh_"
                                                                                              "attribute\"><string "
                                                                                              "name=\"name\" "
                                                                                              "value=\"vertex_"
                                                                                              "color\"/></texture>"));
    const ca_texture *t = desc.textures.items;
    assert_int_equal(t[0].kind, CA_TEXTURE_BITMAP);
    assert_int_equal(t[0].as.bitmap.filter, CA_FILTER_BILINEAR);
    assert_int_equal(t[0].as.bitmap.wrap, CA_WRAP_REPEAT);
    near((double)t[0].to_uv[0][0], 1.0);
    near((double)t[0].to_uv[1][1], -1.0); /* Mitsuba's v = 0 is the top row, ours the bottom row */
    near((double)t[0].to_uv[1][2], 1.0);
    assert_int_equal(t[1].as.bitmap.filter, CA_FILTER_NEAREST);
    assert_int_equal(t[1].as.bitmap.wrap, CA_WRAP_CLAMP);
    near((double)t[1].to_uv[0][0], 2.0);
    near((double)t[1].to_uv[0][2], 0.5);
    near((double)t[1].to_uv[1][1], -3.0);
    near((double)t[1].to_uv[1][2], 0.75);
    assert_int_equal(t[2].as.bitmap.wrap, CA_WRAP_MIRROR);
    /* The same file is read once for each encoding. */
    assert_int_equal(desc.images.count, 2);
    assert_int_equal(t[0].as.bitmap.image_index, t[1].as.bitmap.image_index);
    assert_int_not_equal(t[0].as.bitmap.image_index, t[2].as.bitmap.image_index);
    assert_int_equal(desc.images.items[0].width, 2);
    const ca_texture *checks = &t[desc.textures.count - 2];
    assert_int_equal(checks->kind, CA_TEXTURE_CHECKERBOARD);
    is_rgb(constant(checks->as.checkerboard.color0), 1.0, 0.0, 0.0);
    is_grey(checks->as.checkerboard.color1, 0.2);
    assert_int_equal(t[desc.textures.count - 1].kind, CA_TEXTURE_MESH_ATTRIBUTE);
    assert_string_equal(t[desc.textures.count - 1].as.mesh_attribute.name, "vertex_color");
    done();
}

/* 0.6: what is not known is read as the nearest, with a note. */
static void old_textures(void **state)
{
    (void)state;
    import_write_picture();
#define OLD_BITMAP(parameters)                                                                                       \
    "<texture type=\"bitmap\"><string name=\"filename\" value=\"picture.pfm\"/>" parameters "</texture>"
    import(SCENE(OLD_BITMAP("<string name=\"filterType\" value=\"ewa\"/>"
                            "<float name=\"maxAnisotropy\" value=\"10\"/>")));
    is_noted("2:1: texture filter \"ewa\" is read as \"bilinear\"");
    assert_int_equal(desc.textures.items[0].as.bitmap.filter, CA_FILTER_BILINEAR);
    done();
    import(SCENE("<texture type=\"vertexcolors\" id=\"colors\"/>"));
    assert_int_equal(desc.textures.items[0].kind, CA_TEXTURE_MESH_ATTRIBUTE);
    assert_string_equal(desc.textures.items[0].as.mesh_attribute.name, "vertex_color");
    done();
    import(SCENE(OLD_BITMAP("<string name=\"filterType\" value=\"ewa\"/>")
                     OLD_BITMAP("<string name=\"filterType\" value=\"ewa\"/>"))); /* said once */
    is_noted("2:1: texture filter \"ewa\" is read as \"bilinear\"");
    done();
    import(SCENE(OLD_BITMAP("<string name=\"wrapModeU\" value=\"mirror\"/>"
                            "<string name=\"wrapModeV\" value=\"mirror\"/>"
                            "<float name=\"gamma\" value=\"1\"/>")));
    assert_int_equal(desc.textures.items[0].as.bitmap.wrap, CA_WRAP_MIRROR);
    assert_int_equal(desc.notes.count, 0);
    done();
    import(SCENE("<texture type=\"scale\" id=\"t\">" OLD_BITMAP("")
                 "<float name=\"scale\" value=\"0.5\"/></texture>"));
    const ca_texture *scale = &desc.textures.items[desc.textures.count - 1];
    assert_int_equal(scale->kind, CA_TEXTURE_SCALE);
    assert_int_equal(desc.textures.items[scale->as.scale.child].kind, CA_TEXTURE_BITMAP);
    assert_false(scale->as.scale.varies);
    is_rgb(scale->as.scale.factor, 0.5, 0.5, 0.5);
    done();
}

static void colors(void **state)
{
    (void)state;
    import_write_text("grey.spd", "\xef\xbb\xbf# a comment\n360 0.25\n\n500\t0.25 # another\n830 0.25\n");
#define DIFFUSE(element) "<bsdf type=\"diffuse\">" element "</bsdf>"
    import(SCENE(DIFFUSE("<rgb name=\"reflectance\" value=\"0.1, 0.2, 0.3\"/>")
                     DIFFUSE("<rgb name=\"reflectance\" value=\"0.4\"/>")
                         DIFFUSE("<rgb name=\"reflectance\" value=\"#3366ff\"/>")
                             DIFFUSE("<spectrum name=\"reflectance\" value=\"0.6\"/>")
                                 DIFFUSE("<spectrum name=\"reflectance\" value=\"300:0.7, 900:0.7\"/>")
                                     DIFFUSE("<spectrum name=\"reflectance\" filename=\"grey.spd\"/>")
                                         DIFFUSE("<float name=\"reflectance\" value=\"0.8\"/>")
                                             DIFFUSE("") DIFFUSE("<spectrum name=\"reflectance\" value=\"500:1 "
                                                                 "510:1\"/>") "<emitter type=\"constant\"><spectrum "
                                                                              "name=\"radiance\" value=\"360:2 "
                                                                              "830:2\"/></emitter>"
                                                                              "<emitter type=\"point\"><spectrum "
                                                                              "name=\"intensity\" "
                                                                              "value=\"2\"/></emitter>"));
    const ca_material_desc *m = desc.materials.items;
    is_rgb(constant(m[0].material.as.diffuse.reflectance), 0.1, 0.2, 0.3);
    is_grey(m[1].material.as.diffuse.reflectance, 0.4);
    is_rgb(constant(m[2].material.as.diffuse.reflectance), 0.2, 0.4, 1.0);
    is_grey(m[3].material.as.diffuse.reflectance, 0.6);
    is_grey(m[4].material.as.diffuse.reflectance, 0.7);
    is_grey(m[5].material.as.diffuse.reflectance, 0.25);
    is_grey(m[6].material.as.diffuse.reflectance, 0.8);
    is_grey(m[7].material.as.diffuse.reflectance, 0.5);
    /* Cyan light is outside of Rec. 709: its red would be negative. */
    const ca_rgb cyan = constant(m[8].material.as.diffuse.reflectance);
    assert_true(cyan.r == 0.0f && cyan.g > 0.02f && cyan.g < 0.2f);
    assert_true(fabsf(ca_luminance(desc.lights.items[0].as.constant.radiance) - 2.0f) < 1e-3f);
    assert_true(desc.lights.items[0].as.constant.radiance.r > 2.2f); /* equal energy is reddish */
    is_rgb(desc.lights.items[1].as.point.intensity, 2.0 * equal_energy[0], 2.0 * equal_energy[1],
           2.0 * equal_energy[2]);
    done();
}

/* Of a point light. */
static ca_rgb intensity_of(const char *element)
{
    char text[1024];
    snprintf(text, sizeof text, SCENE("<emitter type=\"point\">%s</emitter>"), element);
    import(text);
    const ca_rgb intensity = desc.lights.items[0].as.point.intensity;
    done();
    return intensity;
}

static void spectra(void **state)
{
    (void)state;
#define SPECTRUM(type, parameters) "<spectrum name=\"intensity\" type=\"" type "\">" parameters "</spectrum>"
#define STRING(name, value) "<string name=\"" name "\" value=\"" value "\"/>"
    is_rgb(intensity_of(SPECTRUM("d65", "")), 1.0, 1.0, 1.0);
    is_rgb(intensity_of(SPECTRUM("d65", "<float name=\"scale\" value=\"3\"/>")), 3.0, 3.0, 3.0);
    is_rgb(intensity_of(SPECTRUM("d65", "<float name=\"scale\" value=\"2\"/>"
                                        "<rgb name=\"color\" value=\"0.1, 2, 0.3\"/>")),
           0.2, 4.0, 0.6);
    is_rgb(intensity_of(SPECTRUM("uniform", "<float name=\"value\" value=\"2\"/>")), 2.0, 2.0, 2.0);
    is_rgb(intensity_of(SPECTRUM("srgb", "<rgb name=\"color\" value=\"1 2 3\"/>")), 1.0, 2.0, 3.0);
    is_rgb(intensity_of(SPECTRUM("rawconstant", "<vector name=\"value\" value=\"4 5 6\"/>")), 4.0, 5.0, 6.0);
    is_rgb(intensity_of("<spectrum name=\"intensity\" value=\"1, 2, 3\"/>"), 1.0, 2.0, 3.0);
    /* Three ways to say the same; Mitsuba 3.9.1's RGB mode has (2.73471, 1.62206, 1.07266) for it. */
    const ca_rgb list = intensity_of("<spectrum name=\"intensity\" value=\"400:1, 600:2, 700:3\"/>");
    const ca_rgb irregular =
        intensity_of(SPECTRUM("irregular", STRING("wavelengths", "400, 600, 700") STRING("values", "1, 2, 3")));
    const ca_rgb regular =
        intensity_of(SPECTRUM("regular", "<float name=\"wavelength_min\" value=\"400\"/>"
                                         "<float name=\"wavelength_max\" value=\"700\"/>"
                                         STRING("values", "1 1.5 2 3")));
    assert_memory_equal(&list, &irregular, sizeof list);
    is_rgb(regular, (double)list.r, (double)list.g, (double)list.b);
    assert_true(fabsf(list.r - 2.73471f) < 2e-3f && fabsf(list.g - 1.62206f) < 2e-3f);
    assert_true(fabsf(list.b - 1.07266f) < 2e-3f);
    /* Mitsuba 3.9.1's spectral mode renders (15302, 12093, 9621), with 0.2 % of noise. */
    const ca_rgb hot = intensity_of(SPECTRUM("blackbody", "<float name=\"temperature\" value=\"5000\"/>"));
    assert_true(fabsf(hot.r / 15302.0f - 1.0f) < 0.005f);
    assert_true(fabsf(hot.g / 12093.0f - 1.0f) < 0.005f);
    assert_true(fabsf(hot.b / 9621.0f - 1.0f) < 0.005f);
    const ca_rgb same = intensity_of("<blackbody name=\"intensity\" temperature=\"5000K\"/>");
    assert_memory_equal(&same, &hot, sizeof hot);
    const ca_rgb half = intensity_of("<blackbody scale=\"0.5\" name=\"intensity\" temperature=\"5000\"/>");
    is_rgb(half, 0.5 * (double)hot.r, 0.5 * (double)hot.g, 0.5 * (double)hot.b);
    /* By reference, and where a texture may stand; only as an emitter's own parameter is a constant not grey. */
    import(SCENE("<spectrum type=\"d65\" id=\"white\"><float name=\"scale\" value=\"0.5\"/></spectrum>"
                 "<bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"white\"/></bsdf>"
                 "<shape type=\"cube\"><emitter type=\"area\"><texture name=\"radiance\" type=\"checkerboard\">"
                 "<spectrum name=\"color0\" value=\"2\"/></texture></emitter></shape>"));
    is_grey(desc.materials.items[0].material.as.diffuse.reflectance, 0.5);
    is_grey(desc.textures.items[desc.lights.items[0].as.area.radiance].as.checkerboard.color0, 2.0);
    done();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sensor_defaults),
        cmocka_unit_test(perspective_parameters),
        cmocka_unit_test(other_sensors),
        cmocka_unit_test(radiance_meters),
        cmocka_unit_test(realistic_parameters),
        cmocka_unit_test(stop_in_glass),
        cmocka_unit_test(published_lens),
        cmocka_unit_test(samplers),
        cmocka_unit_test(several_sensors),
        cmocka_unit_test(sensors_side_by_side),
        cmocka_unit_test(meters_side_by_side),
        cmocka_unit_test(shared_parts_of_sensors),
        cmocka_unit_test(filters),
        cmocka_unit_test(integrator_parameters),
        cmocka_unit_test(attributes_of_meshes),
        cmocka_unit_test(samplers_of_mitsuba),
        cmocka_unit_test(integrators_of_mitsuba),
        cmocka_unit_test(integrators_of_old_mitsuba),
        cmocka_unit_test(integrators_in_integrators),
        cmocka_unit_test(quadrics),
        cmocka_unit_test(stretched_quadrics),
        cmocka_unit_test(merges),
        cmocka_unit_test(bright_pictures),
        cmocka_unit_test(odd_pictures), cmocka_unit_test(height_fields),
        cmocka_unit_test(height_field_normals),
        cmocka_unit_test(bad_height_fields),
        cmocka_unit_test(meshes),
        cmocka_unit_test(groups_and_instances),
        cmocka_unit_test(area_lights),
        cmocka_unit_test(area_lights_by_reference),
        cmocka_unit_test(point_lights),
        cmocka_unit_test(distant_lights),
        cmocka_unit_test(projectors),
        cmocka_unit_test(textures),
        cmocka_unit_test(old_textures),
        cmocka_unit_test(colors),
        cmocka_unit_test(spectra),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
