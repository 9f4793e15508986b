/* Parts of a render added up in any order against one render of all their blocks, to the bit; parts that do not fit
 * together; how scenes are told apart. */
#define _POSIX_C_SOURCE 200809L
#include "base/memory.h"
#include "support/block_fixture.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

/* Everything equal but the time it took. */
static void expect_same_image(const ca_image_layers *a, const ca_image_layers *b)
{
    assert_int_equal(a->channel_count, b->channel_count);
    assert_true(image_hash(a) == image_hash(b));
    assert_true(a->x0 == b->x0 && a->y0 == b->y0 && a->full_width == b->full_width &&
                a->full_height == b->full_height);
    assert_int_equal(a->attribute_count, b->attribute_count);
    for (size_t i = 0; i < a->attribute_count; i++) {
        const ca_attribute *x = &a->attributes[i], *y = &b->attributes[i];
        assert_string_equal(x->name, y->name);
        /* The scene's path is that of a file for each render. */
        if (strcmp(x->name, "caustica.seconds") == 0 || strcmp(x->name, "caustica.scene") == 0) continue;
        assert_true(!x->text == !y->text && x->number == y->number);
        if (x->text) assert_string_equal(x->text, y->text);
    }
}

/* What was done when the caller ended it is in the part file, and the rest can be added later. */
static void test_an_interrupted_part(void **state)
{
    (void)state;
    ca_image_layers *merged, *image;
    ca_render_statistics s = {.size = sizeof s};
    ca_block_watcher w = {.stop_after = 2};
    ca_block_play = (ca_block_script){.first = 0};
    const char *path = ca_block_file("begun.part");
    ca_image_release(ca_block_rendered(
        &(ca_block_job){
            .blocks = {3, 9}, .threads = 1, .part = path, .progress = ca_block_watch, .progress_user = &w},
        &s));
    assert_true(s.blocks[0] == 3 && s.blocks[1] == 5);
    const char *paths[3] = {path, ca_block_render_part("first.part", 0, 3, (ca_block_job){.threads = 1}),
                            ca_block_render_part("rest.part", 5, 9, (ca_block_job){.threads = 1})};
    assert_int_equal(ca_merge_parts(paths, 3, NULL, &merged, NULL, NULL), CA_OK);
    ca_block_play = (ca_block_script){.first = 0};
    image = ca_block_rendered(&(ca_block_job){.samples = 3, .threads = 1}, NULL);
    expect_same_image(merged, image);
    ca_image_release(merged);
    ca_image_release(image);
}

/* ---- Parts ----------------------------------------------------------------------------------------------------- */

static void expect_merged(const char *const *paths, size_t count, const ca_image_layers *expected,
                          const ca_render_statistics *one)
{
    ca_image_layers *image;
    ca_render_statistics s = {.size = sizeof s};
    ca_error error = {""};
    if (ca_merge_parts(paths, count, NULL, &image, &s, &error) != CA_OK) fail_msg("%s", error.message);
    expect_same_image(image, expected);
    assert_true(s.iterations == one->iterations && s.samples_per_pixel == one->samples_per_pixel);
    assert_true(s.light_paths == one->light_paths && s.camera_paths == one->camera_paths && s.rays == one->rays);
    assert_true(s.photons == one->photons && s.photons_tested == one->photons_tested && s.merges == one->merges);
    assert_true(s.non_finite == one->non_finite && s.mean_luminance == one->mean_luminance);
    assert_memory_equal(s.non_finite_from, one->non_finite_from, sizeof s.non_finite_from);
    assert_true(s.blocks[0] == one->blocks[0] && s.blocks[1] == one->blocks[1]);
    ca_image_release(image);
}

static void test_parts_are_the_whole(void **state)
{
    (void)state;
    ca_block_play = (ca_block_script){.bad_samples = true};
    const ca_block_job j = {.threads = 2, .gradients = true, .seed = UINT64_MAX};
    ca_block_job all = j;
    all.blocks[1] = 25;
    ca_render_statistics one = {.size = sizeof one};
    ca_image_layers *image = ca_block_rendered(&all, &one);
    assert_int_equal(one.non_finite_from[CA_TECHNIQUE_COUNT], 12);

    static const uint64_t two[] = {0, 11, 25}, five[] = {0, 1, 9, 16, 24, 25};
    char names[7][CA_BLOCK_PATH_SIZE];
    const char *paths[7];
    for (int i = 0; i < 7; i++) {
        char name[24];
        const uint64_t *cut = i < 2 ? &two[i] : &five[i - 2];
        snprintf(name, sizeof name, "%d.part", i);
        snprintf(names[i], sizeof names[i], "%s", ca_block_render_part(name, cut[0], cut[1], j));
        paths[i] = names[i];
    }
    expect_merged((const char *const[]){paths[0], paths[1]}, 2, image, &one);
    expect_merged((const char *const[]){paths[1], paths[0]}, 2, image, &one);
    static const int orders[][5] = {{0, 1, 2, 3, 4}, {4, 3, 2, 1, 0}, {2, 0, 4, 1, 3}, {3, 4, 0, 2, 1}};
    for (int o = 0; o < 4; o++) {
        const char *shuffled[5];
        for (int i = 0; i < 5; i++) shuffled[i] = paths[2 + orders[o][i]];
        expect_merged(shuffled, 5, image, &one);
    }
    /* In two steps, through a part file that does not begin at 0. */
    char half[CA_BLOCK_PATH_SIZE];
    snprintf(half, sizeof half, "%s", ca_block_file("half.part"));
    assert_int_equal(ca_merge_parts((const char *const[]){paths[5], paths[6], paths[4]}, 3, half, NULL, NULL, NULL),
                     CA_OK);
    expect_merged((const char *const[]){paths[3], half, paths[2]}, 3, image, &one);
    /* And one alone. */
    expect_merged((const char *const[]){ca_block_render_part("all.part", 0, 25, j)}, 1, image, &one);
    ca_block_play.bad_samples = false;
    ca_image_release(image);
}

/* Where blocks are as large as the memory, a part knows only of those it has seen how many camera paths they bring:
 * together they know as much as one render. */
static void test_samples_that_no_part_knows_alone(void **state)
{
    (void)state;
    const ca_block_job j = {.threads = 1};
    for (uint64_t end = 3; end <= 17; end++)
        for (uint64_t cut = 1; cut + 1 < end; cut++) {
            ca_block_play = (ca_block_script){.learns = true};
            ca_block_job all = j;
            all.blocks[1] = end;
            ca_render_statistics one = {.size = sizeof one}, merged = {.size = sizeof merged};
            ca_image_release(ca_block_rendered(&all, &one));
            assert_true(one.samples_per_pixel == floor(sqrt((double)end)));
            const char *const paths[3] = {ca_block_render_part("c.part", cut + 1, end, j),
                                          ca_block_render_part("a.part", 0, cut, j),
                                          ca_block_render_part("b.part", cut, cut + 1, j)};
            assert_int_equal(ca_merge_parts(paths, 3, NULL, NULL, &merged, NULL), CA_OK);
            assert_true(merged.samples_per_pixel == one.samples_per_pixel);
            /* In two steps. */
            const char *const half = ca_block_file("half.part");
            assert_int_equal(ca_merge_parts(paths + 1, 2, half, NULL, NULL, NULL), CA_OK);
            const char *const halves[2] = {half, paths[0]};
            assert_int_equal(ca_merge_parts(halves, 2, NULL, NULL, &merged, NULL), CA_OK);
            assert_true(merged.samples_per_pixel == one.samples_per_pixel);
        }
    ca_block_play = (ca_block_script){.learns = false};
}

static void expect_refused(const char *const *paths, size_t count, bool wants_image, const char *words)
{
    ca_image_layers *image = NULL;
    ca_error error = {""};
    const char *out = ca_block_file("out.part");
    assert_int_equal(ca_merge_parts(paths, count, out, wants_image ? &image : NULL, NULL, &error), CA_ERROR_ARGUMENT);
    assert_null(image);
    assert_int_equal(access(out, F_OK), -1);
    if (!strstr(error.message, words)) fail_msg("\"%s\" says nothing of \"%s\"", error.message, words);
    for (size_t i = 0; i < count; i++)
        if (!strstr(error.message, strrchr(paths[i], '/')))
            fail_msg("\"%s\" does not name %s", error.message, paths[i]);
}

#define REFUSED(words, wants_image, ...)                                                                             \
    expect_refused((const char *const[]){__VA_ARGS__}, sizeof((const char *const[]){__VA_ARGS__}) / sizeof(char *),  \
                   wants_image, words)

static void test_parts_that_do_not_fit(void **state)
{
    (void)state;
    ca_block_play = (ca_block_script){.first = 0};
    const ca_block_job j = {.threads = 1, .seed = 1}, other_seed = {.threads = 1, .seed = 2},
                       gradients = {.threads = 1, .seed = 1, .gradients = true};
    static const char *const moved =
        "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' value='48'/>"
        "<integer name='height' value='32'/><rfilter type='box'/></film></sensor></scene>";
    ca_block_job other_scene = j;
    other_scene.scene = moved;
    char a[CA_BLOCK_PATH_SIZE], b[CA_BLOCK_PATH_SIZE];
    snprintf(a, sizeof a, "%s", ca_block_render_part("a.part", 2, 6, j));
    snprintf(b, sizeof b, "%s", ca_block_render_part("b.part", 6, 9, j));
    REFUSED("overlap", false, a, a);
    REFUSED("5:8 overlap", false, a, ca_block_render_part("c.part", 5, 8, j));
    REFUSED("3:4 overlap", false, ca_block_render_part("c.part", 3, 4, j), a);
    REFUSED("blocks 6:7 between", false, ca_block_render_part("c.part", 7, 8, j), a);
    REFUSED("begins at block 2", true, a);
    REFUSED("differ in their seed: \"seed 1\" and \"seed 2\"", false, a,
            ca_block_render_part("c.part", 6, 8, other_seed));
    REFUSED("show different scenes", false, ca_block_render_part("c.part", 6, 8, other_scene), b);
    REFUSED("different films", false, b, ca_block_render_part("c.part", 9, 10, gradients));
    ca_error error = {""};
    assert_int_equal(ca_merge_parts(NULL, 0, NULL, NULL, NULL, &error), CA_ERROR_ARGUMENT);
    assert_int_equal(
        ca_merge_parts((const char *const[]){a, ca_block_file("none.part")}, 2, NULL, NULL, NULL, &error),
        CA_ERROR_FILE);
    assert_int_equal(ca_merge_parts((const char *const[]){a, b}, 2, "/nowhere/x.part", NULL, NULL, &error),
                     CA_ERROR_FILE);
    assert_int_equal(ca_merge_parts((const char *const[]){a, b}, 2, NULL, NULL, NULL, NULL), CA_OK);
}

/* ---- Scenes are told apart by what their files hold ------------------------------------------------------------ */

static void write_file(const char *name, const char *text)
{
    FILE *file = fopen(ca_block_file(name), "wb");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static uint64_t content_hash(const char *name, const ca_define *defines, size_t count)
{
    ca_scene *scene;
    ca_error error = {""};
    if (ca_scene_load(ca_block_file(name), defines, count, &scene, &error) != CA_OK) fail_msg("%s", error.message);
    const uint64_t hash = scene->desc.content_hash;
    ca_scene_release(scene);
    return hash;
}

static void test_contents_of_scenes(void **state)
{
    (void)state;
    static const char *const xml =
        "<scene version='3.0.0'><default name='g' value='0.5'/><default name='h' value='1'/><sensor "
        "type='perspective'/>"
        "<include filename='part.xml'/><shape type='obj'><string name='filename' value='mesh.obj'/></shape>"
        "<emitter type='envmap'><string name='filename' value='sky.pfm'/></emitter></scene>";
    static const char *const mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    static const char *const include =
        "<shape type='sphere'><bsdf type='diffuse'><spectrum name='reflectance' filename='grey.spd'/></bsdf></shape>";
    static const char *const sky = "PF\n2 1\n-1.0\n000000000000000000000000";
    static const struct {
        const char *name, *text;
    } files[] = {{"scene.xml", xml},
                 {"mesh.obj", mesh},
                 {"part.xml", include},
                 {"sky.pfm", sky},
                 {"grey.spd", "400 0.5\n700 0.5\n"}};
    enum { FILES = 5 };
    static const char *const folders[] = {"here", "there"};
    char name[64];
    for (int f = 0; f < 2; f++) {
        assert_int_equal(mkdir(ca_block_file(folders[f]), 0700), 0);
        for (int i = 0; i < FILES; i++) {
            snprintf(name, sizeof name, "%s/%s", folders[f], files[i].name);
            write_file(name, files[i].text);
        }
    }
    const uint64_t hash = content_hash("here/scene.xml", NULL, 0);
    assert_true(content_hash("there/scene.xml", NULL, 0) == hash);
    for (int i = 0; i < FILES; i++) {
        /* One character more or, in the picture, another. */
        char changed[1024];
        snprintf(changed, sizeof changed, "%s\n", files[i].text);
        if (files[i].text == sky) strcpy(strrchr(changed, '0'), "1");
        snprintf(name, sizeof name, "there/%s", files[i].name);
        write_file(name, changed);
        if (content_hash("there/scene.xml", NULL, 0) == hash)
            fail_msg("a change of %s was not noticed", files[i].name);
        write_file(name, files[i].text);
    }
    assert_true(content_hash("there/scene.xml", NULL, 0) == hash);
    const ca_define defines[3] = {{"g", "0.25"}, {"h", "2"}, {"g", "0.25"}}, crossed[2] = {{"g", "2"}, {"h", "0.25"}};
    const uint64_t defined = content_hash("here/scene.xml", defines, 2);
    assert_true(defined != hash && content_hash("here/scene.xml", defines, 1) != hash);
    assert_true(content_hash("here/scene.xml", defines + 1, 2) == defined);
    assert_true(content_hash("here/scene.xml", crossed, 2) != defined);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static void test_out_of_memory(void **state)
{
    (void)state;
    ca_block_play = (ca_block_script){.first = 0};
    char path[CA_BLOCK_PATH_SIZE];
    snprintf(path, sizeof path, "%s",
             ca_block_render_part("less.part", 0, 1, (ca_block_job){.threads = 1, .gradients = true}));
    const char *paths[2] = {path,
                            ca_block_render_part("more.part", 1, 2, (ca_block_job){.threads = 1, .gradients = true})};
    long failures = 0;
    for (ca_status status = CA_ERROR_MEMORY; status != CA_OK; failures++) {
        ca_image_layers *image;
        ca_memory_fail_after(failures);
        status = ca_merge_parts(paths, 2, NULL, &image, NULL, NULL);
        ca_memory_fail_after(-1);
        assert_true(status == CA_OK || (status == CA_ERROR_MEMORY && !image));
        ca_image_release(image);
    }
    assert_true(failures >= 20);
}

/* The sums and one file are all of a film's size that is in memory, however many parts there are. */
static void test_memory_of_adding(void **state)
{
    (void)state;
    const char *paths[3] = {ca_block_render_part("0.part", 0, 2, (ca_block_job){.threads = 1}),
                            ca_block_render_part("1.part", 2, 3, (ca_block_job){.threads = 1}),
                            ca_block_render_part("2.part", 3, 5, (ca_block_job){.threads = 1})};
    struct stat info;
    assert_int_equal(stat(paths[0], &info), 0);
    const size_t film = (size_t)info.st_size;
    ca_memory_budget budget = {.limit = 2 * film + film / 4};
    ca_error error = {""};
    ca_memory_budget_begin(&budget);
    const ca_status status = ca_merge_parts(paths, 3, NULL, NULL, NULL, &error);
    ca_memory_budget_end();
    if (status != CA_OK) fail_msg("with %zu bytes, of films of %zu: %s", budget.limit, film, error.message);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_an_interrupted_part),
        cmocka_unit_test(test_parts_are_the_whole),
        cmocka_unit_test(test_samples_that_no_part_knows_alone),
        cmocka_unit_test(test_parts_that_do_not_fit),
        cmocka_unit_test(test_contents_of_scenes),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_memory_of_adding),
    };
    return cmocka_run_group_tests(tests, ca_block_make_folder, ca_block_remove_folder);
}
