/* Memory that is kept back: its blocks, and images of renders after whose second pass there is no other memory. */
#include "base/memory.h"
#include "base/reserve.h"
#include "image/layers.h"
#include "support/scene_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static ca_reserve *reserve_of(size_t bytes)
{
    ca_reserve *reserve;
    assert_int_equal(ca_reserve_create(&reserve, bytes, "a test", NULL, NULL), CA_OK);
    return reserve;
}

static void test_blocks(void **state)
{
    (void)state;
    ca_reserve *reserve = reserve_of(100000);
    char *before = ca_alloc(100, 1); /* not open yet: of the heap */
    assert_int_equal(ca_reserve_block_bytes(before), 0);
    ca_reserve_open(reserve);
    ca_memory_fail_from(0);
    char *a = ca_alloc(1000, 1), *b = ca_alloc_zeroed(300, 8), *c = ca_alloc_large(5000, 1);
    assert_true(a && b && c && (uintptr_t)c % 64 == 0);
    assert_true(ca_reserve_block_bytes(a) >= 1000 && ca_reserve_block_bytes(b) >= 2400);
    memset(a, 1, 1000);
    memset(c, 3, 5000);
    for (int i = 0; i < 2400; i++) assert_int_equal(b[i], 0);
    ca_free(b);
    assert_int_equal(a[999], 1);
    assert_int_equal(c[0], 3);
    assert_int_equal(ca_reserve_missed(reserve), 0);
    assert_null(ca_alloc(200000, 1)); /* no room, and there is no heap */
    assert_true(ca_reserve_missed(reserve) >= 200000);
    ca_memory_fail_after(-1);
    char *beside = ca_alloc(200000, 1);
    assert_true(beside && ca_reserve_block_bytes(beside) == 0);
    ca_free(beside);
    ca_free(a);
    ca_free(c);
    ca_reserve_release(reserve);
    ca_free(before);
}

/* The system's pages take a while to come: it ends when it is asked to. */
static void test_stop(void **state)
{
    (void)state;
    const int stop = 1, go_on = 0;
    ca_reserve *reserve;
    assert_int_equal(ca_reserve_create(&reserve, 100000, "a test", &stop, NULL), CA_ERROR_INTERRUPTED);
    assert_null(reserve);
    assert_int_equal(ca_reserve_create(&reserve, 100000, "a test", &go_on, NULL), CA_OK);
    ca_reserve_release(reserve);
}

/* Room that is given back is used again. */
static void test_room_again(void **state)
{
    (void)state;
    ca_reserve *reserve = reserve_of(100000);
    ca_reserve_open(reserve);
    void *kept = ca_alloc(40000, 1);
    for (int i = 0; i < 100; i++) {
        void *first = ca_alloc(20000, 1), *second = ca_alloc(20000, 1);
        assert_true(ca_reserve_block_bytes(first) > 0 && ca_reserve_block_bytes(second) > 0);
        ca_free(i % 2 ? first : second);
        ca_free(i % 2 ? second : first);
    }
    assert_int_equal(ca_reserve_missed(reserve), 0);
    assert_true(ca_reserve_most_used(reserve) >= 80000 && ca_reserve_most_used(reserve) < 100000);
    ca_free(kept);
    ca_reserve_release(reserve);
}

static void test_arrays_move(void **state)
{
    (void)state;
    size_t capacity = 0;
    uint32_t *array = NULL;
    ca_reserve *reserve = reserve_of(100000);
    for (uint32_t i = 0; i < 30000; i++) {
        if (i == 100) ca_reserve_open(reserve);
        if (i == 200) assert_true(ca_reserve_block_bytes(array) > 0);
        uint32_t *grown = ca_array_grow(array, &capacity, i + 1, sizeof *grown);
        assert_non_null(grown);
        array = grown;
        array[i] = i * i;
    }
    assert_int_equal(ca_reserve_block_bytes(array), 0); /* too large for it */
    for (uint32_t i = 0; i < 30000; i++) assert_int_equal(array[i], i * i);
    ca_free(array);
    ca_reserve_release(reserve);
}

/* The last block takes the memory along, the rest of which went before. */
static void test_blocks_live_on(void **state)
{
    (void)state;
    ca_reserve *reserve = reserve_of((size_t)64 << 20);
    ca_reserve_open(reserve);
    char *a = ca_alloc(10000, 1), *b = ca_alloc((size_t)32 << 20, 1);
    ca_reserve_release(reserve);
    memset(a, 5, 10000);
    memset(b, 6, (size_t)32 << 20);
    ca_free(b);
    assert_int_equal(a[9999], 5);
    assert_true(ca_reserve_block_bytes(a) >= 10000);
    ca_free(a);
    char *other = ca_alloc(10, 1);
    assert_int_equal(ca_reserve_block_bytes(other), 0);
    ca_free(other);
}

static void test_too_large(void **state)
{
    (void)state;
    ca_reserve *reserve;
    ca_error error = {""};
    assert_int_equal(ca_reserve_create(&reserve, SIZE_MAX - 100, "the image", NULL, &error), CA_ERROR_MEMORY);
    assert_null(reserve);
    assert_string_equal(error.message, "out of memory: the image");
}

/* ---- Renders --------------------------------------------------------------------------------------------------- */

static const char *const box =
    "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'>"
    "<lookat origin='0,0,0.97' target='0,0,0' up='0,1,0'/></transform><float name='fov' value='80'/>"
    "<film type='hdrfilm'><integer name='width' value='40'/><integer name='height' value='30'/></film></sensor>"
    "<shape type='cube'><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='90'/>"
    "<translate y='0.95'/></transform><emitter type='area'/></shape></scene>";

static bool take_all_memory(const ca_render_progress *progress, void *user)
{
    (void)user;
    if (progress->passes_done == 2) ca_memory_fail_from(0);
    return true;
}

/* The second pass may be the last one; one that needs memory fails, and leaves the image of those before it. */
static void test_image_without_memory(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "light", "bdpt", "ppm", "vcm", "vavcm", "qmcppm"};
    ca_scene *scene = scene_from_text(box);
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
        for (uint32_t samples = 2; samples <= 6; samples += 4) {
            ca_render_settings settings;
            ca_image_layers *image;
            ca_render_statistics statistics = {.size = sizeof statistics};
            ca_render_settings_init(&settings);
            settings.integrator = integrators[i];
            settings.samples_per_pixel = samples;
            settings.width = 160; /* more than what is kept back for small things */
            settings.height = 120;
            settings.threads = 2;
            settings.max_depth = 4;
            settings.has_max_depth = true;
            settings.progress = take_all_memory;
            ca_error error = {""};
            const ca_status status = ca_render(scene, &settings, &image, &statistics, &error);
            ca_memory_fail_after(-1);
            if (!image) fail_msg("%s: no image: %s", integrators[i], error.message);
            const bool more =
                samples > 2 || strcmp(integrators[i], "qmcppm") == 0; /* blocks, several for 2 samples */
            if (status != CA_OK && (status != CA_ERROR_MEMORY || !more || statistics.iterations < 2))
                fail_msg("%s, %llu passes: %s", integrators[i], (unsigned long long)statistics.iterations,
                         error.message);
            ca_image_release(image);
        }
    }
    ca_scene_release(scene);
}

/* Ends after so many iterations, or takes all memory then. */
typedef struct end_of_memory {
    uint32_t after;
    bool ends;
} end_of_memory;

static bool end_without_memory(const ca_render_progress *progress, void *user)
{
    const end_of_memory *end = user;
    if (progress->passes_done >= end->after) ca_memory_fail_from(0);
    return !(end->ends && progress->passes_done >= end->after);
}

/* In the pilot, whose two films are joined to one, and behind it; ended there, or by the memory that is missing. */
static void test_chosen_rays_without_memory(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(box);
    for (uint32_t after = 2; after <= 26; after += 4)
        for (int ends = 0; ends < 2; ends++) {
            end_of_memory end = {after, ends == 1};
            ca_render_settings settings;
            ca_image_layers *image;
            ca_render_statistics statistics = {.size = sizeof statistics};
            ca_error error = {""};
            ca_render_settings_init(&settings);
            settings.integrator = "bdpm:radius=0.2,max_depth=4";
            settings.rays = "auto";
            settings.light_paths = 100;
            settings.samples_per_pixel = 300;
            settings.width = 128;
            settings.height = 96;
            settings.threads = 2;
            settings.progress = end_without_memory;
            settings.progress_user = &end;
            const ca_status status = ca_render(scene, &settings, &image, &statistics, &error);
            ca_memory_fail_after(-1);
            if (!image || (ends == 1 && status != CA_OK) || (status != CA_OK && status != CA_ERROR_MEMORY))
                fail_msg("%u iterations: status %d: %s", after, (int)status, error.message);
            assert_true(statistics.iterations >= 2);
            ca_image_release(image);
        }
    ca_scene_release(scene);
}

/* What was measured of the noise until then has its layers, too. */
static void test_noise_without_memory(void **state)
{
    (void)state;
    static const char *const integrators[] = {"bdpm:radius=0.2", "ppm:radius=0.2", "vcm:radius=0.2"};
    ca_scene *scene = scene_from_text(box);
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++) {
        ca_render_settings settings;
        ca_noise *noise;
        ca_image_layers *image;
        ca_error error = {""};
        ca_render_settings_init(&settings);
        settings.integrator = integrators[i];
        settings.light_paths = 1000;
        settings.width = 160;
        settings.height = 120;
        settings.threads = 2;
        settings.progress = take_all_memory;
        const ca_status status = ca_noise_measure(scene, &settings, 2, &noise, &image, NULL, &error);
        ca_memory_fail_after(-1);
        if (status != CA_OK) fail_msg("%s: %s", integrators[i], error.message);
        assert_non_null(noise);
        assert_non_null(ca_layers_find(image, "Noise.Measured.StdErr"));
        ca_image_release(image);
        ca_noise_release(noise);
    }
    ca_scene_release(scene);
}

/* Asked for before the first pass, where nothing is lost yet. */
static bool count_pass(const ca_render_progress *progress, void *user)
{
    *(uint32_t *)user = progress->passes_done;
    return true;
}

static void expect_failures_before(const ca_scene *scene, const char *integrator)
{
    ca_render_settings settings;
    ca_image_layers *image;
    uint32_t passes = 0;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.samples_per_pixel = 1;
    settings.threads = 1;
    settings.max_depth = 4;
    settings.has_max_depth = true;
    settings.width = 8;
    settings.height = 6;
    settings.progress = count_pass;
    settings.progress_user = &passes;
    for (long n = 0;; n++) {
        ca_memory_fail_from(n);
        const ca_status status = ca_render(scene, &settings, &image, NULL, NULL);
        ca_memory_fail_after(-1);
        if (status == CA_OK) break;
        assert_int_equal(status, CA_ERROR_MEMORY);
        assert_int_equal(passes, 0);
        assert_null(image);
        assert_true(n < 2000);
    }
    assert_true(passes > 0);
    ca_image_release(image);
}

static void test_reserved_before_the_first_pass(void **state)
{
    (void)state;
    static const char *const integrators[] = {"path", "light"};
    ca_scene *scene = scene_from_text(box);
    for (size_t i = 0; i < sizeof integrators / sizeof integrators[0]; i++)
        expect_failures_before(scene, integrators[i]);
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_room_again),
        cmocka_unit_test(test_arrays_move),
        cmocka_unit_test(test_blocks_live_on),
        cmocka_unit_test(test_too_large),
        cmocka_unit_test(test_image_without_memory),
        cmocka_unit_test(test_chosen_rays_without_memory),
        cmocka_unit_test(test_noise_without_memory),
        cmocka_unit_test(test_reserved_before_the_first_pass),
    };
    return cmocka_run_group_tests_name("reserve", tests, NULL, NULL);
}
