/* Emitters: every parameter ends in the field it belongs to. */
#include "support/imported_desc.h"

#include <math.h>
#include <string.h>

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(area_lights),
        cmocka_unit_test(area_lights_by_reference),
        cmocka_unit_test(point_lights),
        cmocka_unit_test(distant_lights),
        cmocka_unit_test(projectors),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
