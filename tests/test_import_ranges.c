/* Colours within their ranges: what meshes bring is cut as pictures are, and no more. */
#include "scene/scene.h"
#include "support/import_text.h"
#include "support/scene_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static ca_scene_desc desc;

static void import(const char *text) { import_text(&desc, text, NULL, 0); }

static bool is_noted(const char *part)
{
    for (size_t i = 0; i < desc.notes.count; i++)
        if (strstr(desc.notes.items[i], part)) return true;
    return false;
}

/* A triangle whose corners have these colours, in each of the three channels. */
static void write_triangle(const char *name, const float values[3])
{
    char text[1024];
    snprintf(text, sizeof text,
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
             "property float r\nproperty float g\nproperty float b\nelement face 1\n"
             "property list uchar int vertex_indices\nend_header\n"
             "0 0 0 %g %g %g\n1 0 0 %g %g %g\n0 1 0 %g %g %g\n3 0 1 2\n",
             (double)values[0], (double)values[0], (double)values[0], (double)values[1], (double)values[1],
             (double)values[1], (double)values[2], (double)values[2], (double)values[2]);
    import_write_text(name, text);
}

#define COLORS(name)                                                                                                 \
    "<texture name='" name "' type='mesh_attribute'><string name='name' value='vertex_color'/></texture>"
#define HALF_OF(name)                                                                                                \
    "<texture name='" name "' type='scale'><float name='scale' value='0.5'/>" COLORS("t") "</texture>"
#define TRIANGLE(inside) "<shape type='ply'><string name='filename' value='corners.ply'/>" inside "</shape>"
#define PAINT(texture) "<bsdf type='diffuse'>" texture "</bsdf>"
#define LIGHT "<emitter type='area'>" COLORS("radiance") "</emitter>"

static ca_rgb at_corner(ca_texture_id id, uint32_t corner)
{
    const ca_surface surface = {
        .mesh = &desc.meshes.items[0],
        .barycentric = {corner == 1 ? 1.0f : 0.0f, corner == 2 ? 1.0f : 0.0f},
    };
    return ca_texture_eval(desc.textures.items, id, &surface);
}

static void check_corners(ca_texture_id id, float a, float b, float c)
{
    const float expected[3] = {a, b, c};
    for (uint32_t i = 0; i < 3; i++) {
        const ca_rgb found = at_corner(id, i);
        if (found.r != expected[i] || found.b != expected[i])
            fail_msg("corner %u: %g, not %g", i, (double)found.r, (double)expected[i]);
    }
}

/* Whether the mesh comes before the texture or after it. */
static void test_reflectances(void **state)
{
    (void)state;
    static const char *const scenes[] = {
        SCENE(TRIANGLE(PAINT(COLORS("reflectance")))),
        SCENE("<bsdf type='diffuse' id='m'>" COLORS("reflectance") "</bsdf>" TRIANGLE("<ref id='m'/>")),
    };
    write_triangle("corners.ply", (const float[]){1.5f, -0.5f, 0.25f});
    for (int i = 0; i < 2; i++) {
        import(scenes[i]);
        assert_true(is_noted("values up to 1.5 count as 1") && is_noted("taken as 0"));
        check_corners(desc.materials.items[0].material.as.diffuse.reflectance, 1.0f, 0.0f, 0.25f);
        ca_scene_desc_destroy(&desc);
    }
    import(SCENE(TRIANGLE(PAINT(HALF_OF("reflectance")))));
    assert_false(is_noted("count as 1"));
    check_corners(desc.materials.items[0].material.as.diffuse.reflectance, 0.75f, 0.0f, 0.125f);
    ca_scene_desc_destroy(&desc);
}

/* Lights may be as bright as they like, but not negative. */
static void test_emission(void **state)
{
    (void)state;
    write_triangle("corners.ply", (const float[]){15.0f, -0.5f, 0.25f});
    import(SCENE(TRIANGLE(LIGHT)));
    assert_true(is_noted("taken as 0") && !is_noted("count as 1"));
    check_corners(desc.lights.items[0].as.area.radiance, 15.0f, 0.0f, 0.25f);
    ca_scene_desc_destroy(&desc);
}

/* What is within its range is told nothing of, and looked up as it is. */
static void test_good_colours(void **state)
{
    (void)state;
    write_triangle("corners.ply", (const float[]){1.0f, 0.0f, 0.25f});
    import(SCENE(TRIANGLE(PAINT(COLORS("reflectance")) LIGHT)));
    assert_int_equal(desc.notes.count, 0);
    const ca_texture *reflectance = &desc.textures.items[desc.materials.items[0].material.as.diffuse.reflectance];
    const ca_texture *radiance = &desc.textures.items[desc.lights.items[0].as.area.radiance];
    assert_int_equal(reflectance->kind, CA_TEXTURE_MESH_ATTRIBUTE);
    assert_int_equal(radiance->kind, CA_TEXTURE_MESH_ATTRIBUTE);
    ca_scene_desc_destroy(&desc);
}

/* ---- Pictures -------------------------------------------------------------------------------------------------- */

#define ODD(attributes)                                                                                              \
    "<texture " attributes " type='bitmap'><string name='filename' value='odd.pfm'/>"                                \
    "<boolean name='raw' value='true'/></texture>"
#define BUMPS(texture, paint) "<bsdf type='bumpmap'>" texture "<bsdf type='diffuse'>" paint "</bsdf></bsdf>"

static const float *pixels_of(ca_texture_id id)
{
    const ca_texture *texture = &desc.textures.items[id];
    if (texture->kind == CA_TEXTURE_SCALE) texture = &desc.textures.items[texture->as.scale.child];
    assert_int_equal(texture->kind, CA_TEXTURE_BITMAP);
    return desc.images.items[texture->as.bitmap.image_index].data;
}

/* Colours lose the negative numbers of a picture; heights from the same one keep theirs, whichever comes first,
 * whether they refer to one texture or to two of one file. */
static void test_shared_pictures(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        size_t images;
    } scenes[] = {
        {SCENE(ODD("id='t'") BUMPS("<ref id='t'/>", "<ref name='reflectance' id='t'/>")), 2},
        {SCENE(BUMPS(ODD("name='a'"), ODD("name='reflectance'"))), 2},
        {SCENE("<bsdf type='diffuse' id='d'>" ODD("name='reflectance'") "</bsdf>"
               BUMPS(ODD("name='a'"), ODD("name='reflectance'"))), 2},
        {SCENE(ODD("id='t'") "<bsdf type='diffuse' id='d'><texture name='reflectance' type='scale'><ref id='t'/>"
               "</texture></bsdf>" BUMPS("<ref id='t'/>", ODD("name='reflectance'"))), 2},
    };
    unsigned char file[64] = "PF\n1 1\n-1\n";
    const float numbers[3] = {0.5f, -0.25f, 1.0f};
    const size_t head = strlen((const char *)file);
    memcpy(file + head, numbers, sizeof numbers);
    import_write("odd.pfm", file, head + sizeof numbers);
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        import(scenes[i].text);
        assert_true(is_noted("no colour is negative: 1 number of "));
        for (size_t k = 0; k < desc.materials.count; k++) {
            const ca_material *material = &desc.materials.items[k].material;
            if (material->kind == CA_MATERIAL_DIFFUSE)
                assert_true(pixels_of(material->as.diffuse.reflectance)[1] == 0.0f);
            else
                assert_true(pixels_of(material->as.bump.height)[1] == -0.25f);
        }
        assert_int_equal(desc.images.count, scenes[i].images);
        ca_scene_desc_destroy(&desc);
    }
    /* Nobody else has it: it is not kept twice. */
    import(SCENE("<bsdf type='diffuse'>" ODD("name='reflectance'") "</bsdf>"));
    assert_int_equal(desc.images.count, 1);
    assert_true(desc.images.items[0].data[1] == 0.0f);
    ca_scene_desc_destroy(&desc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reflectances),
        cmocka_unit_test(test_emission),
        cmocka_unit_test(test_good_colours),
        cmocka_unit_test(test_shared_pictures),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
