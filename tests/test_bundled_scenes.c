/* Every bundled scene is read and rendered without a warning, and has light in it. */
#include "support/program_test.h"
#include "support/scene_text.h"

#include <glob.h>

/* What other files include: no pictures of their own. */
static bool is_part(const char *path)
{
    static const char *const parts[] = {"perceptual-study/room.xml",          "perceptual-study/lamp-visible.xml",
                                        "perceptual-study/lamp-occluded.xml", "perceptual-study/things-diffuse.xml",
                                        "perceptual-study/things-mixed.xml",  "paper-003/box.xml"};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
        if (strstr(path, parts[i])) return true;
    return false;
}

static void test_bundled_scenes(void **state)
{
    glob_t files;
    assert_int_equal(glob(CA_SOURCE_DIR "/scenes/*/*.xml", 0, NULL, &files), 0);
    assert_true(files.gl_pathc > 30);
    for (size_t i = 0; i < files.gl_pathc; i++) {
        const char *path = files.gl_pathv[i];
        if (is_part(path)) continue;
        ca_program_result r;
        RUN(&r, "info", path);
        assert_exit(&r, 0);
        /* with light paths enough for no warning */
        RUN(&r, "render", path, "-i", "ovcm", "--resolution", "24x16", "--spp", "2", "--light-paths", "8000", "-o",
            "a.pfm", "--stats", "a.json");
        if (r.exit_status != 0 || r.errors[0] != '\0') fail_msg("%s: %s", path, r.errors);
        json_t *stats = load_json(folder_of(state), "a.json");
        assert_true(json_number(stats, "mean_luminance") > 0.01);
        json_decref(stats);
    }
    globfree(&files);
}

int main(void)
{
    const struct CMUnitTest tests[] = {PROGRAM_TEST(test_bundled_scenes)};
    return run_program_tests("bundled scenes", tests, sizeof tests / sizeof tests[0]);
}
