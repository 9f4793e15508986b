/* Textures, pictures, colours and spectra: every parameter ends in the field it belongs to. */
#include "support/imported_desc.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void textures(void **state)
{
    (void)state;
    import_write_picture();
#define BITMAP(body) "<texture type=\"bitmap\"><string name=\"filename\" value=\"picture.pfm\"/>" body "</texture>"
    import(SCENE(
        BITMAP("")
        BITMAP("<string name=\"filter_type\" value=\"nearest\"/><string name=\"wrap_mode\" value=\"clamp\"/>"
               "<transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/><translate x=\"0.5\" y=\"0.25\"/></transform>")
        BITMAP("<boolean name=\"raw\" value=\"true\"/><string name=\"wrap_mode\" value=\"mirror\"/>")
        "<texture type=\"checkerboard\"><rgb name=\"color0\" value=\"1 0 0\"/></texture>"
        "<texture type=\"mesh_attribute\"><string name=\"name\" value=\"vertex_color\"/></texture>"));
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
        cmocka_unit_test(attributes_of_meshes),
        cmocka_unit_test(bright_pictures),
        cmocka_unit_test(odd_pictures),
        cmocka_unit_test(textures),
        cmocka_unit_test(old_textures),
        cmocka_unit_test(colors),
        cmocka_unit_test(spectra),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
