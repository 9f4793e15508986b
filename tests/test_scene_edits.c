#define _DEFAULT_SOURCE
/* The next version of a scene: what was not edited is shared and not built again, the picture is to the bit that of a
 * scene made anew, and versions end in any order. Meshes that a program lends. */
#include "base/memory.h"
#include "scene/scene.h"
#include "support/scene_text.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmocka.h>

static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
static const float lower[] = {-1, -1, 0, 1, -1, 0, 1, 0.5f, 0, -1, 1, 0};
static const float uvs[] = {0, 0, 1, 0, 1, 1, 0, 1};
static const uint32_t indices[] = {0, 2, 1, 0, 3, 2};
static const float pixels[] = {0.1f, 0.9f, 0.5f, 0.2f}, other_pixels[] = {0.1f, 0.9f, 0.5f, 0.3f};

/* What an edit may be of. */
typedef struct edit {
    double camera, light, grey; /* of the sensor, the light, a material */
    double world, moved;        /* places of the world's mesh and of an instance */
    const float *in_world, *in_group, *texture; /* arrays */
} edit;

static const edit unchanged = {.camera = 0.5,
                               .light = 1.0,
                               .grey = 0.4,
                               .world = 0.0,
                               .moved = 0.5,
                               .in_world = positions,
                               .in_group = positions,
                               .texture = pixels};

static const char format[] =
    "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='50'/><transform name='to_world'>"
    "<lookat origin='%g, 1, -4' target='0, 0, 0' up='0, 1, 0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/></film></sensor>"
    "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
    "<emitter type='point'><point name='position' value='1, 2, -3'/>"
    "<rgb name='intensity' value='%g, 1, 1'/></emitter>"
    "<shape type='mesh'><string name='data' value='world'/><bsdf type='diffuse'>"
    "<texture name='reflectance' type='bitmap'><string name='data' value='texture'/></texture></bsdf>"
    "<transform name='to_world'><translate z='%g'/></transform></shape>"
    "<shape type='sphere'><point name='center' value='-1, 0, -0.5'/><float name='radius' value='0.3'/></shape>"
    "<shape type='shapegroup' id='group'><shape type='mesh'><string name='data' value='group'/>"
    "<bsdf type='diffuse'><rgb name='reflectance' value='%g, 0.5, 0.5'/></bsdf></shape></shape>"
    "<shape type='shapegroup' id='balls'><shape type='sphere'/></shape>"
    "<shape type='instance'><ref id='group'/><transform name='to_world'><scale value='0.4'/>"
    "<translate x='%g' z='-1'/></transform></shape>"
    "<shape type='instance'><ref id='balls'/><transform name='to_world'><scale value='0.2'/>"
    "<translate y='-0.6' z='-1'/></transform></shape></scene>";

static ca_mesh_data mesh_of(const char *name, const float *vertices)
{
    return (ca_mesh_data){.name = name,
                          .vertex_count = 4,
                          .triangle_count = 2,
                          .positions = vertices,
                          .uvs = uvs,
                          .indices = indices};
}

static ca_scene *version(const ca_scene *previous, const edit *e)
{
    char text[4096];
    snprintf(text, sizeof text, format, e->camera, e->light, e->world, e->grey, e->moved);
    const ca_mesh_data meshes[] = {mesh_of("world", e->in_world), mesh_of("group", e->in_group)};
    const ca_bitmap_data bitmap = {.name = "texture", .width = 2, .height = 2, .channels = 1, .pixels = e->texture};
    const ca_scene_source source = {.text = text,
                                    .size = strlen(text),
                                    .path = "scene",
                                    .meshes = meshes,
                                    .mesh_count = 2,
                                    .bitmaps = &bitmap,
                                    .bitmap_count = 1,
                                    .previous = previous};
    ca_scene *scene;
    ca_error error = {""};
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    return scene;
}

static uint64_t picture_of(const ca_scene *scene)
{
    const ca_render_settings settings = {.samples_per_pixel = 4, .threads = 1};
    return rendered_hash(scene, &settings);
}

static uint64_t picture_made_anew(const edit *e)
{
    ca_scene *scene = version(NULL, e);
    const uint64_t hash = picture_of(scene);
    ca_scene_release(scene);
    return hash;
}

/* ---- Edits ----------------------------------------------------------------------------------------------------- */

static void assert_builds(const edit *e, uint32_t builds, bool looks_the_same)
{
    ca_scene *first = version(NULL, &unchanged);
    ca_scene *second = version(first, e);
    const uint64_t before = picture_of(first), after = picture_of(second);
    assert_int_equal(ca_scene_builds(second), builds);
    assert_true(after == picture_made_anew(e));
    assert_true((before == after) == looks_the_same);
    ca_scene_release(first);
    assert_true(picture_of(second) == after);
    ca_scene *third = version(second, &unchanged);
    ca_scene_release(second);
    assert_true(picture_of(third) == before);
    ca_scene_release(third);
}

/* `world`: 1 where Embree has the world's mesh, 0 where its two triangles lie apart. */
static void check_edits(uint32_t world)
{
    ca_scene *first = version(NULL, &unchanged);
    assert_int_equal(ca_scene_builds(first), world + 3); /* the world, two groups, the instances */
    ca_scene_release(first);
    edit e = unchanged;
    assert_builds(&e, 0, true);
    e = unchanged, e.camera = -1.0;
    assert_builds(&e, 0, false);
    e = unchanged, e.light = 3.0;
    assert_builds(&e, 0, false);
    e = unchanged, e.grey = 0.9;
    assert_builds(&e, 0, false);
    e = unchanged, e.texture = other_pixels;
    assert_builds(&e, 0, false);
    e = unchanged, e.moved = -0.2;
    assert_builds(&e, 1, false); /* the instances */
    e = unchanged, e.in_group = lower;
    assert_builds(&e, 2, false); /* the group and the instances */
    e = unchanged, e.in_world = lower;
    assert_builds(&e, world, false);
    e = unchanged, e.world = 0.3;
    assert_builds(&e, world, false);
}

static void test_edits(void **state)
{
    (void)state;
    check_edits(0);
    ca_accel_keep_apart(false);
    check_edits(1);
    ca_accel_keep_apart(true);
}

/* Meshes and pictures are shared, not only the structures over them. */
static void test_shares(void **state)
{
    (void)state;
    edit e = unchanged;
    ca_scene *first = version(NULL, &e);
    e.in_group = lower, e.texture = other_pixels;
    ca_scene *second = version(first, &e);
    e.texture = pixels;
    ca_scene *third = version(second, &e);
    const ca_scene_desc *a = &first->desc, *b = &second->desc, *c = &third->desc;
    assert_ptr_equal(a->meshes.items[0].positions, b->meshes.items[0].positions);
    assert_ptr_not_equal(a->meshes.items[1].positions, b->meshes.items[1].positions);
    assert_ptr_equal(b->meshes.items[1].positions, c->meshes.items[1].positions);
    assert_ptr_not_equal(a->images.items[0].data, b->images.items[0].data);
    assert_true(a->content_hash != b->content_hash && b->content_hash != c->content_hash);
    ca_scene *again = version(third, &e);
    assert_ptr_equal(again->desc.images.items[0].data, c->images.items[0].data);
    assert_true(again->desc.content_hash == c->content_hash);
    ca_scene *anew = version(NULL, &e);
    assert_true(anew->desc.content_hash == c->content_hash);
    ca_scene *all[] = {first, second, third, again, anew};
    for (int i = 0; i < 5; i++) ca_scene_release(all[i]);
}

#define SQUARE "<shape type='mesh'><string name='data' value='world'/>"

/* So many spheres that Embree gets them: they count as geometry of the world. */
static ca_scene *spheres(const ca_scene *previous, int count, double radius)
{
    char text[8192];
    size_t used = (size_t)snprintf(text, sizeof text,
                                   "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>");
    for (int i = 0; i < count; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "<shape type='sphere'><point name='center' value='%d, %g, 40'/>"
                                 "<float name='radius' value='%g'/></shape>",
                                 4 * i - 20, 0.5 * i, radius + 0.1 * i);
    snprintf(text + used, sizeof text - used, SQUARE "</shape></scene>");
    const ca_mesh_data mesh = mesh_of("world", positions);
    const ca_scene_source source = {
        .text = text, .size = strlen(text), .path = "scene", .meshes = &mesh, .mesh_count = 1, .previous = previous};
    ca_scene *scene;
    ca_error error = {""};
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    return scene;
}

static uint64_t seen(const ca_scene *scene)
{
    const ca_render_settings settings = {
        .samples_per_pixel = 1, .threads = 1, .width = 32, .height = 24, .integrator = "path"};
    return rendered_hash(scene, &settings);
}

static void assert_spheres(int count, double radius, uint32_t builds)
{
    ca_scene *first = spheres(NULL, 4, 1.0), *many = spheres(NULL, 12, 1.0), *anew = spheres(NULL, count, radius);
    ca_scene *second = spheres(count > 8 ? many : first, count, radius);
    ca_scene_release(first);
    ca_scene_release(many);
    assert_int_equal(ca_scene_builds(second), builds);
    assert_true(seen(second) == seen(anew));
    ca_scene_release(second);
    ca_scene_release(anew);
}

static void test_spheres(void **state)
{
    (void)state;
    assert_spheres(4, 1.5, 0); /* Embree does not know of them, nor of the mesh */
    assert_spheres(5, 1.0, 0);
    assert_spheres(12, 1.0, 0);
    assert_spheres(12, 1.5, 1);
}

/* ---- Files ----------------------------------------------------------------------------------------------------- */

static void write_ply(const char *path, double x)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                  "%.1f -1 0\n1 -1 0\n1 1 0\n3 0 2 1\n", x);
    assert_int_equal(fclose(file), 0);
}

static ca_scene *from_file(const ca_scene *previous, const char *path, const char *more)
{
    char text[2048];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>"
             "<shape type='ply'><string name='filename' value='%s'/>%s</shape></scene>",
             path, more);
    const ca_scene_source source = {.text = text, .size = strlen(text), .path = "scene", .previous = previous};
    ca_scene *scene;
    ca_error error = {""};
    if (ca_scene_parse(&source, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    return scene;
}

static bool share_mesh(const ca_scene *a, const ca_scene *b)
{
    return a->desc.meshes.items[0].positions == b->desc.meshes.items[0].positions;
}

static void test_files(void **state)
{
    (void)state;
    char path[] = "/tmp/caustica-edits-XXXXXX";
    const int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    ca_accel_keep_apart(false);
    write_ply(path, -1.0);
    ca_scene *first = from_file(NULL, path, ""), *same = from_file(first, path, "");
    ca_scene *flat = from_file(first, path, "<boolean name='face_normals' value='true'/>");
    ca_scene *flipped = from_file(first, path, "<boolean name='flip_normals' value='true'/>");
    assert_true(share_mesh(first, same) && !share_mesh(first, flat) && !share_mesh(first, flipped));
    assert_int_equal(ca_scene_builds(flat), 0); /* the same to rays */
    assert_int_equal(ca_scene_builds(flipped), 1);
    write_ply(path, -2.0); /* of the same size */
    ca_scene *changed = from_file(same, path, "");
    assert_int_equal(ca_scene_builds(changed), 1);
    assert_true(changed->desc.meshes.items[0].positions[0] == -2.0f);
    assert_true(changed->desc.content_hash != same->desc.content_hash);
    unlink(path);
    ca_accel_keep_apart(true);
    ca_scene *all[] = {first, same, flat, flipped, changed};
    for (int i = 0; i < 5; i++) ca_scene_release(all[i]);
}

/* ---- Threads and memory ---------------------------------------------------------------------------------------- */

static const ca_scene *common;
static uint64_t expected[2];

static void *edit_in_thread(void *which)
{
    edit e = unchanged;
    if (which) e.moved = -0.2;
    uintptr_t good = 1;
    for (int i = 0; i < 4; i++) {
        ca_scene *scene = version(common, &e);
        good = good && picture_of(scene) == expected[which != NULL];
        ca_scene_release(scene);
    }
    return (void *)good;
}

static void test_threads(void **state)
{
    (void)state;
    edit e = unchanged;
    pthread_t threads[4];
    void *good;
    expected[0] = picture_made_anew(&e);
    e.moved = -0.2;
    expected[1] = picture_made_anew(&e);
    ca_scene *first = version(NULL, &unchanged);
    common = first;
    for (int i = 0; i < 4; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, edit_in_thread, i & 1 ? first : NULL), 0);
    for (int i = 0; i < 4; i++) {
        assert_int_equal(pthread_join(threads[i], &good), 0);
        assert_non_null(good);
    }
    ca_scene_release(first);
}

/* ---- Lending --------------------------------------------------------------------------------------------------- */

static void count_release(void *user) { ++*(int *)user; }

#define LENT_SCENE(shapes)                                                                                         \
    "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>" shapes "</scene>"

static ca_status parse_lent(const char *text, ca_mesh_data *data, size_t count, const ca_scene *previous,
                            ca_scene **scene)
{
    const ca_scene_source source = {.text = text,
                                    .size = strlen(text),
                                    .path = "scene",
                                    .meshes = data,
                                    .mesh_count = count,
                                    .previous = previous};
    return ca_scene_parse(&source, scene, NULL);
}

static ca_mesh_data lent_mesh(int *released)
{
    ca_mesh_data data = mesh_of("world", positions);
    data.release = count_release, data.release_user = released;
    *released = 0;
    return data;
}

/* Which arrays are the caller's own? */
static void assert_in_place(const char *text, bool positions_are, bool uvs_are, bool indices_are)
{
    int released;
    ca_mesh_data data = lent_mesh(&released), copied = mesh_of("world", positions);
    ca_scene *scene, *other;
    assert_int_equal(parse_lent(text, &data, 1, NULL, &scene), CA_OK);
    assert_int_equal(parse_lent(text, &copied, 1, NULL, &other), CA_OK);
    const ca_mesh *mesh = &scene->desc.meshes.items[0];
    assert_true((mesh->positions == positions) == positions_are);
    assert_true((mesh->uvs == uvs) == uvs_are);
    assert_true((mesh->indices == indices) == indices_are);
    assert_int_equal(released, !(positions_are || uvs_are || indices_are));
    assert_true(seen(scene) == seen(other));
    assert_true(other->desc.meshes.items[0].positions != positions);
    ca_scene_release(scene);
    ca_scene_release(other);
    assert_int_equal(released, 1);
}

static void test_lending(void **state)
{
    (void)state;
#define MOVED(map) "<transform name='to_world'>" map "</transform></shape>"
#define SET(name) "<boolean name='" name "' value='true'/></shape>"
    assert_in_place(LENT_SCENE(SQUARE "</shape>"), true, true, true);
    assert_in_place(LENT_SCENE(SQUARE MOVED("<translate z='5'/>")), false, true, true);
    assert_in_place(LENT_SCENE(SQUARE MOVED("<scale x='-1'/>")), false, true, false);
    assert_in_place(LENT_SCENE(SQUARE SET("flip_normals")), true, true, false);
    assert_in_place(LENT_SCENE(SQUARE SET("flip_tex_coords")), true, false, true);
    assert_in_place(LENT_SCENE(SQUARE "<boolean name='flip_tex_coords' value='true'/>" MOVED("<scale z='-1'/>")),
                    false, false, false);
}

/* Embree would read beyond the page, which may be the last one there is. */
static void test_end_of_page(void **state)
{
    (void)state;
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    unsigned char *two = mmap(NULL, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_true(two != MAP_FAILED);
    assert_int_equal(mprotect(two + page, page, PROT_NONE), 0);
    float *last = (float *)(void *)(two + page - sizeof positions);
    memcpy(last, positions, sizeof positions);
    int released;
    ca_mesh_data data = lent_mesh(&released);
    data.positions = last;
    ca_scene *scene;
    assert_int_equal(parse_lent(LENT_SCENE(SQUARE "</shape>"), &data, 1, NULL, &scene), CA_OK);
    assert_true(scene->desc.meshes.items[0].positions != last);
    (void)seen(scene);
    ca_scene_release(scene);
    munmap(two, 2 * page);
}

/* Once, whoever used it, and not before the last one is gone. */
static void test_release(void **state)
{
    (void)state;
    int released, unused;
    ca_mesh_data data[] = {lent_mesh(&released), lent_mesh(&unused)};
    data[1].name = "nobody";
    ca_scene *scene, *second, *view;
    assert_int_equal(parse_lent(LENT_SCENE(SQUARE "</shape>" SQUARE "</shape>"), data, 2, NULL, &scene), CA_OK);
    assert_true(released == 0 && unused == 1);
    int again;
    ca_mesh_data next = lent_mesh(&again); /* of the same content: the first stays in use */
    assert_int_equal(parse_lent(LENT_SCENE(SQUARE "</shape>"), &next, 1, scene, &second), CA_OK);
    assert_true(released == 0 && again == 1);
    const char *sensor = "<scene version='3.0.0'><sensor type='perspective'/></scene>";
    const ca_scene_source source = {.text = sensor, .size = strlen(sensor), .path = "view"};
    assert_int_equal(ca_scene_view(second, &source, &view, NULL), CA_OK);
    ca_scene_release(scene);
    ca_scene_release(second);
    assert_int_equal(released, 0);
    (void)seen(view);
    ca_scene_release(view);
    assert_int_equal(released, 1);
}

static void test_release_on_failure(void **state)
{
    (void)state;
    int released;
    ca_mesh_data data = lent_mesh(&released);
    ca_scene *scene;
    assert_int_equal(parse_lent("<scene", &data, 1, NULL, &scene), CA_ERROR_FORMAT);
    assert_int_equal(released, 1);
    data = lent_mesh(&released), data.triangle_count = 0;
    assert_int_equal(parse_lent(LENT_SCENE(SQUARE "</shape>"), &data, 1, NULL, &scene), CA_ERROR_FORMAT);
    assert_int_equal(released, 1);
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        data = lent_mesh(&released);
        ca_memory_fail_after(failures);
        status = parse_lent(LENT_SCENE(SQUARE "</shape>"), &data, 1, NULL, &scene);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        assert_int_equal(released, status != CA_OK);
    }
    ca_scene_release(scene);
    assert_true(failures > 20 && released == 1);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    ca_scene *first = version(NULL, &unchanged);
    const uint64_t before = picture_of(first);
    char text[4096];
    snprintf(text, sizeof text, format, 0.0, 1.0, 0.0, 0.5, 0.1);
    const ca_mesh_data meshes[] = {mesh_of("world", positions), mesh_of("group", lower)};
    const ca_bitmap_data bitmap = {.name = "texture", .width = 2, .height = 2, .channels = 1, .pixels = pixels};
    const ca_scene_source source = {.text = text,
                                    .size = strlen(text),
                                    .path = "scene",
                                    .meshes = meshes,
                                    .mesh_count = 2,
                                    .bitmaps = &bitmap,
                                    .bitmap_count = 1,
                                    .previous = first};
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_scene *scene = NULL;
        ca_memory_fail_after(failures);
        status = ca_scene_parse(&source, &scene, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || status == CA_ERROR_MEMORY);
        ca_scene_release(scene);
    }
    assert_true(failures > 20);
    assert_true(picture_of(first) == before);
    ca_scene_release(first);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_edits),       cmocka_unit_test(test_shares),
        cmocka_unit_test(test_spheres),     cmocka_unit_test(test_files),
        cmocka_unit_test(test_threads),     cmocka_unit_test(test_lending),
        cmocka_unit_test(test_end_of_page), cmocka_unit_test(test_release),
        cmocka_unit_test(test_release_on_failure), cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
