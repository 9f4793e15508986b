/* Textures that projectors and spots throw: whatever they are made of, all of it is upright. Lights give a texture
 * coordinates whose v runs upwards, Mitsuba's downwards, so a thrown texture is its own turned around. */
#include "support/import_text.h"

#include <math.h>
#include <stdio.h>

static ca_scene_desc desc;

#define PICTURE "<texture name='%s' type='bitmap'><string name='filename' value='picture.pfm'/></texture>"
#define AND_GREY "<rgb name='color1' value='0.3'/>"

/* With a nested texture of the given name, or none. */
static const struct {
    const char *type, *nested, *more;
} textures[] = {
    {"scale", "child", "<rgb name='scale' value='0.25'/>"},
    {"scale", "scale", "<texture name='t' type='checkerboard'/>"},
    {"checkerboard", "color0", AND_GREY "<transform name='to_uv'><scale x='2' y='3'/></transform>"},
    {"mix", "color0", AND_GREY},
    {"power", "child", "<float name='exponent' value='2'/>"},
    {"clamp", "child", ""},
};
enum { TEXTURES = sizeof textures / sizeof textures[0] };

static void print_texture(char *text, size_t size, const char *name, int i)
{
    char nested[256];
    snprintf(nested, sizeof nested, PICTURE, textures[i].nested);
    snprintf(text, size, "<texture name='%s' type='%s'>%s%s</texture>", name, textures[i].type, nested,
             textures[i].more);
}

static ca_rgb value_at(ca_texture_id id, float u, float v)
{
    const ca_surface surface = {.uv = {u, v}};
    return ca_texture_eval(desc.textures.items, id, &surface);
}

static void check_turned(ca_texture_id thrown, ca_texture_id own, const char *what)
{
    for (int i = 0; i < 100; i++) {
        const float u = 0.03f + 0.1f * (float)(i % 10), v = 0.04f + 0.1f * (float)(i / 10);
        const ca_rgb a = value_at(thrown, u, v), b = value_at(own, u, 1.0f - v);
        if (!(fabsf(a.r - b.r) + fabsf(a.g - b.g) + fabsf(a.b - b.b) < 1e-5f))
            fail_msg("%s at (%g, %g): %g %g %g, not %g %g %g", what, (double)u, (double)v, (double)a.r, (double)a.g,
                     (double)a.b, (double)b.r, (double)b.g, (double)b.b);
    }
}

static void test_all_is_upright(void **state)
{
    (void)state;
    import_write_picture();
    for (int i = 0; i < TEXTURES; i++) {
        char light[512], spot[512], own[512], text[2048];
        print_texture(light, sizeof light, "irradiance", i);
        print_texture(spot, sizeof spot, "texture", i);
        print_texture(own, sizeof own, "radiance", i);
        snprintf(text, sizeof text,
                 SCENE("<emitter type='projector'>%s</emitter><emitter type='spot'>%s</emitter>"
                       "<shape type='sphere'><emitter type='area'>%s</emitter></shape>"),
                 light, spot, own);
        import_text(&desc, text, NULL, 0);
        for (size_t k = 0; k < desc.textures.count; k++)
            if (desc.textures.items[k].kind == CA_TEXTURE_BITMAP)
                desc.textures.items[k].as.bitmap.image = &desc.images.items[0];
        const ca_texture_id area = desc.lights.items[2].as.area.radiance;
        check_turned(desc.lights.items[0].as.projector.picture, area, textures[i].type);
        check_turned(desc.lights.items[1].as.spot.texture, area, textures[i].type);
        ca_scene_desc_destroy(&desc);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_all_is_upright)};
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
