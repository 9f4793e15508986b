/* An image that was rendered is written with the memory that was kept back for its files, where there is no other
 * left. The sources are the program's, not the library's, so they are compiled into this test. */
#define _GNU_SOURCE
#include "base/memory.h"
#include "base/reserve.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#undef _DEFAULT_SOURCE
#include "cli/json_values.c"
#include "cli/layer_choice.c"
#include "cli/options.c"
#include "cli/outputs.c"
#include "cli/places.c"
#include "cli/progress.c"
#include "cli/report.c"
#include "cli/say.c"
#include "cli/signals.c"
#include "cli/values.c"
#define find find_attribute
#include "cli/settings_json.c"
#undef find
#include "cli/stats_json.c"
#include "support/sample_folder.h"
#include "support/scene_text.h"

/* All layers that an image can have: those of first hits, of variances, of intervals, and those that the scene asks
 * for. */
static const char box[] =
    "<scene version='3.0.0'><integrator type='aov'><string name='aovs' value='d:depth,u:uv,p:dp_du,n:geo_normal'/>"
    "<integrator type='path'><integer name='max_depth' value='3'/></integrator></integrator>"
    "<sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,0,0.97' target='0,0,0' up='0,1,0'/></transform><float name='fov' value='80'/>"
    "<film type='hdrfilm'><integer name='width' value='40'/><integer name='height' value='30'/></film></sensor>"
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='90'/>"
    "<translate y='0.95'/></transform><emitter type='area'/></shape></scene>";

enum { EXR_FILES = 2 };

/* Of the files those from `first` on. */
static void write_without_memory(const ca_scene *scene, uint32_t width, uint32_t height, size_t first)
{
    static const char *const paths[] = {"a.exr", "b.exr", "c.png", "d.pfm"};
    const size_t count = sizeof paths / sizeof paths[0] - first;
    ca_output_files files = {.paths = paths + first, .count = count, .stats = "s.json"};
    ca_render_settings settings;
    ca_render_statistics statistics = {.size = sizeof statistics};
    ca_image_layers *image;
    ca_reserve *reserve;
    ca_error error = {""};
    ca_render_settings_init(&settings);
    settings.samples_per_pixel = 8;
    settings.width = width;
    settings.height = height;
    files.look.tone = CA_TONE_ACES;
    files.layers.names = "all";
    files.layers.half = true;
    if (ca_render(scene, &settings, &image, &statistics, &error) != CA_OK) fail_msg("%s", error.message);
    assert_int_equal(ca_outputs_reserve(&files, width, height, 0, &reserve, &error), CA_OK);
    ca_reserve_open(reserve);
    ca_memory_fail_from(0);
    const ca_status status = ca_outputs_write(&files, image, &statistics, &error);
    ca_memory_fail_after(-1);
    print_message("%u x %u pixels, %zu layers: %zu KiB were used\n", width, height, image->channel_count,
                  ca_reserve_most_used(reserve) / 1024);
    ca_reserve_release(reserve);
    if (status != CA_OK) fail_msg("%u x %u: %s", width, height, error.message);
    ca_image_release(image);
}

static void test_files_without_memory(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    assert_int_equal(chdir(folder), 0);
    write_without_memory(scene, 40, 30, 0);
    write_without_memory(scene, 900, 40, 0);
    write_without_memory(scene, 64, 700, 0);
    write_without_memory(scene, 600, 600, EXR_FILES);
    assert_int_equal(chdir("/"), 0);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_files_without_memory)};
    return cmocka_run_group_tests_name("memory for outputs", tests, make_folder, remove_folder);
}
