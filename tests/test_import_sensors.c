/* Sensors, films, filters and samplers: every parameter ends in the field it belongs to, and every default is the
 * documented one. */
#include "support/imported_desc.h"

#include <math.h>
#include <stdio.h>

static void import_with_sensor(const char *sensor)
{
    char text[4096];
    snprintf(text, sizeof text, "<scene version=\"3.0.0\">%s</scene>", sensor);
    import(text);
}

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
        cmocka_unit_test(samplers_of_mitsuba),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
