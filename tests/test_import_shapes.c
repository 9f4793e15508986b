/* Shapes: every parameter ends in the field it belongs to. */
#include "support/imported_desc.h"

#include <math.h>
#include <string.h>

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadrics),
        cmocka_unit_test(stretched_quadrics),
        cmocka_unit_test(merges),
        cmocka_unit_test(height_fields),
        cmocka_unit_test(height_field_normals),
        cmocka_unit_test(bad_height_fields),
        cmocka_unit_test(meshes),
        cmocka_unit_test(groups_and_instances),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
