/* Whole scenes: real ones where they are there, and one with everything in it under failing allocations. */
#define _POSIX_C_SOURCE 200809L
#include "support/import_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/memory.h"

/* ---- Allocation failures --------------------------------------------------------------------------------------- */

static const char everything[] =
    "<scene version=\"3.0.0\"><default name=\"spp\" value=\"4\"/><path value=\".\"/><include "
    "filename=\"part.xml\"/>\n"
    "<alias id=\"inner\" as=\"other\"/><integrator type=\"path\"><integer name=\"maxDepth\" value=\"5\"/>"
    "<string name=\"mode\" value=\"a\"/></integrator>\n"
    "<sensor type=\"thinlens\"><float name=\"aperture_radius\" value=\"1\"/><film type=\"hdrfilm\"><rfilter "
    "type=\"box\"/></film><sampler type=\"sobol\"><integer name=\"sample_count\" "
    "value=\"$spp\"/></sampler></sensor>\n"
    "<texture type=\"bitmap\" id=\"tex\"><string name=\"filename\" value=\"picture.pfm\"/></texture>\n"
    "<bsdf type=\"blendbsdf\" id=\"blend\"><ref name=\"weight\" id=\"tex\"/><ref id=\"other\"/><bsdf "
    "type=\"roughconductor\"><string name=\"material\" value=\"Ag\"/></bsdf></bsdf>\n"
    "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:0.5, 500:0.25, 700:0.75\"/></bsdf>\n"
    "<shape type=\"obj\" id=\"mesh\"><string name=\"filename\" value=\"triangle.obj\"/><ref id=\"blend\"/></shape>\n"
    "<shape type=\"cube\"><emitter type=\"area\"><rgb name=\"radiance\" value=\"1\"/></emitter></shape>\n"
    "<shape type=\"shapegroup\" id=\"group\"><shape type=\"rectangle\"/></shape>\n"
    "<shape type=\"instance\"><ref id=\"group\"/></shape>\n"
    "<emitter type=\"envmap\"><string name=\"filename\" value=\"picture.pfm\"/></emitter>\n"
    "<emitter type=\"projector\"><ref name=\"irradiance\" id=\"tex\"/></emitter></scene>";

/* Under the address sanitizer this also shows that nothing leaks. */
static void every_failing_allocation_is_reported(void **state)
{
    (void)state;
    import_write_triangle();
    import_write_picture();
    import_write_text("part.xml", "<scene version=\"3.0.0\"><bsdf type=\"diffuse\" id=\"inner\"/></scene>");
    char path[128];
    snprintf(path, sizeof path, "%s/test.xml", import_folder());
    long failures = 0;
    for (;; failures++) {
        ca_scene_desc desc;
        ca_error error = {""};
        ca_memory_fail_after(failures);
        const ca_status status =
            ca_import_scene_text(everything, sizeof everything - 1, path, NULL, 0, &desc, &error);
        ca_memory_fail_after(-1);
        if (status == CA_OK) {
            assert_int_equal(desc.shapes.count, 3);
            ca_scene_desc_destroy(&desc);
            break;
        }
        if (status != CA_ERROR_MEMORY) fail_msg("allocation %ld: %s", failures, error.message);
        assert_non_null(strstr(error.message, "memory"));
        assert_int_equal(desc.shapes.count, 0);
        assert_null(desc.strings.first);
    }
    assert_in_range(failures, 50, 5000);
}

/* ---- Real scenes ----------------------------------------------------------------------------------------------- */

static bool find_scene(const char *name, char *path, size_t size)
{
    const char *folder = getenv("CAUSTICA_SCENES");
    if (folder)
        snprintf(path, size, "%s/%s/scene.xml", folder, name);
    else
        snprintf(path, size, CA_SOURCE_DIR "/../shared/scenes/%s/scene.xml", name);
    struct stat info;
    if (stat(path, &info) == 0) return true;
    print_message("SKIPPED: there is no %s (set CAUSTICA_SCENES to the folder of the reference scenes)\n", path);
    return false;
}

static bool import_scene(const char *name, ca_scene_desc *desc)
{
    char path[1024];
    if (!find_scene(name, path, sizeof path)) return false;
    ca_error error;
    if (ca_import_scene(path, NULL, 0, desc, &error) != CA_OK) fail_msg("%s", error.message);
    return true;
}

static void cornell_box(void **state)
{
    (void)state;
    ca_scene_desc desc;
    if (!import_scene("cornell-box", &desc)) skip();
    assert_int_equal(desc.shapes.count, 8);
    assert_int_equal(desc.lights.count, 1);
    assert_int_equal(desc.film.width, 1024);
    assert_int_equal(desc.film.filter.kind, CA_RFILTER_TENT);
    assert_int_equal(desc.samples_per_pixel, 64);
    assert_string_equal(desc.integrator.name, "path");
    assert_true(desc.integrator.parameters.items[0].number == 30.0);
    assert_true(desc.camera.fov_degrees == 19.5);
    assert_true(desc.camera.camera.map.to[2][3] == 6.8f);
    ca_scene_desc_destroy(&desc);
}

static void veach_mis(void **state)
{
    (void)state;
    ca_scene_desc desc;
    if (!import_scene("veach-mis", &desc)) skip();
    assert_int_equal(desc.lights.count, 3);
    assert_int_equal(desc.shapes.count, 9);
    uint32_t spheres = 0;
    for (size_t i = 0; i < desc.shapes.count; i++) spheres += desc.shapes.items[i].kind == CA_SHAPE_SPHERE;
    assert_int_equal(spheres, 3);
    ca_scene_desc_destroy(&desc);
}

static void veach_bidir(void **state)
{
    (void)state;
    ca_scene_desc desc;
    if (!import_scene("veach-bidir", &desc)) skip();
    assert_int_equal(desc.lights.count, 2);
    uint32_t triangles = 0;
    for (size_t i = 0; i < desc.meshes.count; i++) triangles += desc.meshes.items[i].triangle_count;
    assert_in_range(triangles, 5000, 50000);
    ca_scene_desc_destroy(&desc);
}

static void water_caustic(void **state)
{
    (void)state;
    ca_scene_desc desc;
    if (!import_scene("water-caustic", &desc)) skip();
    assert_int_equal(desc.shapes.count, 10);
    /* The surface has the file's normals, its front has none at all. */
    assert_non_null(desc.meshes.items[8].normals);
    assert_null(desc.meshes.items[9].normals);
    assert_int_equal(desc.samples_per_pixel, 16);
    ca_scene_desc_destroy(&desc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_failing_allocation_is_reported),
        cmocka_unit_test(cornell_box),
        cmocka_unit_test(veach_mis),
        cmocka_unit_test(veach_bidir),
        cmocka_unit_test(water_caustic),
    };
    return cmocka_run_group_tests(tests, NULL, import_remove_folder);
}
