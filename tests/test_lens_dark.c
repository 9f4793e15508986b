/* Lenses that no light gets through, and those that cannot focus, are told with place and cause; narrow stops and
 * vignetting are neither. */
#include "camera/camera.h"
#include "support/import_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SENSOR(body) "<scene version=\"3.0.0\">\n<sensor type=\"realistic\">\n" body "</sensor></scene>"
#define LENS(table) "<string name=\"lens\" value=\"" table "\"/>\n"
#define NUMBER(name, value) "<float name=\"" name "\" value=\"" value "\"/>\n"
#define CROSSING "50 0 1.5 20; -50 0 1 20"
#define DARK "no light gets through the lens to the film: "

typedef struct mistake {
    const char *text, *message;
} mistake;

static void expect_all(const mistake *mistakes, size_t count)
{
    for (size_t i = 0; i < count; i++) import_expect_error(mistakes[i].text, mistakes[i].message);
}

static void dark_lenses(void **state)
{
    (void)state;
    import_write_text("dark.dat", "# too thin\n50 1e-12 1.5 20\n-50 0 1 20\n");
    static const mistake mistakes[] = {
        {SENSOR(LENS(CROSSING) NUMBER("film_distance", "50")),
         "3:1: " DARK "its surfaces 1 and 2 cross next to the axis, 0 mm apart"},
        {SENSOR(NUMBER("focus_distance", "5") LENS(CROSSING)),
         "4:1: " DARK "its surfaces 1 and 2 cross next to the axis, 0 mm apart"},
        {SENSOR("<string name=\"filename\" value=\"dark.dat\"/>"),
         "3:1: " DARK "its surfaces 1 and 2 cross next to the axis, 1e-12 mm apart"},
        {SENSOR(LENS("-50 1 1.5 20; 50 5 1 20; 0 1 1 9; 40 0 1.5 20; 20 0 1 20; -30 0 1 20")
                    NUMBER("film_distance", "50")),
         "3:1: " DARK "its surfaces 5 and 6 cross next to the axis, 0 mm apart"},
        {SENSOR(LENS("50 4 1.5 20; 0 2 1.5 12; -50 1 1 20") NUMBER("aperture_diameter", "1e-5")),
         "4:1: " DARK "the aperture of surface 2, 1e-05 mm across, is too small"},
        {SENSOR(LENS("50 4 1.5 1e-5; -50 1 1 20; 0 0 1 12") NUMBER("aperture_diameter", "5")),
         "3:1: " DARK "the aperture of surface 1, 1e-05 mm across, is too small"},
        {"<scene version=\"3.0.0\"><sensor type=\"batch\"><sensor type=\"perspective\"/>\n<sensor type=\"realistic\">"
         "\n" LENS(CROSSING) "</sensor></sensor></scene>",
         "3:1: " DARK "its surfaces 1 and 2 cross next to the axis, 0 mm apart"},
    };
    expect_all(mistakes, sizeof mistakes / sizeof *mistakes);
}

static void lenses_that_cannot_focus(void **state)
{
    (void)state;
    static const mistake mistakes[] = {
        {SENSOR(LENS("-50 5 1.5 20; 50 0 1 20") NUMBER("focus_distance", "2")),
         "4:1: the lens cannot focus: its focal length is -49.1803 mm, so that it makes no image; film_distance may "
         "say where the film is"},
        {SENSOR(LENS("inf 5 1.5 20; inf 0 1 20")),
         "2:1: the lens cannot focus: it has no power, and makes no image; film_distance may say where the film is"},
        /* f = 50.847 mm; the principal plane is 1.695 mm behind the vertex. */
        {SENSOR(LENS("50 5 1.5 20; -50 0 1 20") NUMBER("focus_distance", "0.04")),
         "4:1: the lens cannot focus at a distance of 0.04: it makes no image of that within 100 m behind itself, "
         "only of what is farther away than 0.0491525"},
        {SENSOR(LENS("50 5 1.5 20; -50 0 1 20") NUMBER("lens_scale", "1") NUMBER("focus_distance", "49.16")),
         "5:1: the lens cannot focus at a distance of 49.16: it makes no image of that within 100 m behind itself, "
         "only of what is farther away than 49.1525"},
        /* Half a ball of n = 2 has the image of what is far away behind it; this rod in front of its plane. */
        {SENSOR(LENS("10 25 2 10; inf 0 1 10") NUMBER("focus_distance", "100")),
         "4:1: the lens cannot focus at a distance of 100: the image lies in the lens, 2.499 mm before its last "
         "surface's rim"},
    };
    expect_all(mistakes, sizeof mistakes / sizeof *mistakes);
}

/* What a camera makes of light of radiance 1 from everywhere, at a part of the way to the film's corner. */
static double brightness(const ca_camera *camera, float part)
{
    enum { SIDE = 300 };
    const ca_vec2 film = {0.5f * (float)camera->width * (1.0f - part), 0.5f * (float)camera->height * (1.0f - part)};
    double sum = 0.0;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        const ca_vec2 u = {((float)(i % SIDE) + 0.5f) / SIDE, ((float)(i / SIDE) + 0.5f) / SIDE};
        sum += (double)ca_camera_sample_ray(camera, film, u).weight.r;
    }
    return sum / (SIDE * SIDE);
}

static ca_camera import_camera(const char *rest)
{
    char text[512];
    ca_scene_desc desc;
    snprintf(text, sizeof text,
             SENSOR("<string name=\"lens\" value=\"61 6 1.517 25; -45 2.5 1.62 25; -131 1.5 1 25; %s\"/>"
                    "<float name=\"film_distance\" value=\"90\"/>"),
             rest);
    import_text(&desc, text, NULL, 0);
    ca_camera camera = desc.camera.camera;
    ca_scene_desc_destroy(&desc);
    ca_camera_prepare(&camera);
    return camera;
}

/* A stop that is so narrow that no grid finds it but in the film's centre, with glass behind it: the picture is as
 * bright as with one of half a millimetre. */
static void narrow_stops(void **state)
{
    (void)state;
    const ca_camera wide = import_camera("0 6 1 0.5; inf 4 1.5 25; inf 0 1 25");
    static const char *const narrow[] = {"0 6 1 0.1; inf 4 1.5 25; inf 0 1 25",
                                         "0 6 1 0.02; inf 4 1.5 25; inf 0 1 25",
                                         "0 6 1 0.002; inf 4 1.5 25; inf 0 1 25"};
    for (size_t i = 0; i < sizeof narrow / sizeof *narrow; i++) {
        const ca_camera camera = import_camera(narrow[i]);
        for (float part = 0.0f; part <= 1.0f; part += 0.25f) {
            const double found = brightness(&camera, part), expected = brightness(&wide, part);
            /* Of the box of a ring the narrowest pupil is a hundredth: noise. */
            if (!(fabs(found - expected) < 0.06 * expected))
                fail_msg("%s: at %g of the diagonal %.4f, and %.4f with a wide stop", narrow[i], (double)part, found,
                         expected);
        }
    }
}

/* Light in the middle of the film alone is vignetting: nothing is said of it. */
static void vignetted_films(void **state)
{
    (void)state;
    const ca_camera camera = import_camera("0 80 1 0.5; 0 0 1 0.5");
    assert_true(brightness(&camera, 0.0f) > 0.95);
    assert_true(brightness(&camera, 0.5f) == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dark_lenses),
        cmocka_unit_test(lenses_that_cannot_focus),
        cmocka_unit_test(narrow_stops),
        cmocka_unit_test(vignetted_films),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
