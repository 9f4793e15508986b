/* Weights of merges from the sums that photons keep (`vcm`, merge_sums), in renders. */
#include "render/render.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 24, HEIGHT = 16 };

/* Light through glass and off rough metal, from a lamp with an area, a spot and the sky. */
static const char *const scene_text =
    "<scene version='3.0.0'>"
    "<sensor type='perspective'><float name='fov' value='60'/>"
    "<transform name='to_world'><lookat origin='0,1,-3' target='0,0.5,0' up='0,1,0'/></transform>"
    "<sampler type='independent'><integer name='sample_count' value='4'/></sampler>"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/>"
    "<rfilter type='box'/></film></sensor>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='4'/></transform>"
    "<bsdf type='diffuse'/></shape>"
    "<shape type='sphere'><point name='center' value='0,0.5,0'/><float name='radius' value='0.5'/>"
    "<bsdf type='dielectric'/></shape>"
    "<shape type='cube'><transform name='to_world'><scale value='0.3'/><translate x='1' y='0.3'/></transform>"
    "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></shape>"
    "<emitter type='constant'><rgb name='radiance' value='0.4'/></emitter>"
    "<emitter type='spot'><transform name='to_world'><lookat origin='-2,2,0' target='0,0,0' up='0,0,1'/></transform>"
    "<rgb name='intensity' value='9'/></emitter>"
    "<shape type='disk'><transform name='to_world'><scale value='0.3'/><rotate x='1' angle='90'/><translate y='3'/>"
    "</transform><bsdf type='diffuse'/>"
    "<emitter type='area'><rgb name='radiance' value='20'/></emitter></shape></scene>";

static ca_render_settings settings_of(const char *integrator)
{
    ca_render_settings settings;
    ca_render_settings_init(&settings);
    settings.integrator = integrator;
    settings.has_max_depth = true;
    settings.max_depth = 6;
    settings.light_paths = 3000;
    settings.threads = 1;
    return settings;
}

/* They are those from the photons' paths, but for rounding; with any number of threads they are the same. */
static void test_weights_by_sums(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    ca_render_settings settings = settings_of("vcm:radius=0.2,guide=true");
    ca_image_layers *by_paths = render_scene(scene, &settings);
    settings.integrator = "vcm:radius=0.2,guide=true,merge_sums=true";
    ca_image_layers *by_sums = render_scene(scene, &settings);
    double mean = 0.0;
    for (size_t p = 0; p < WIDTH * HEIGHT; p++) {
        const double a = (double)ca_image_channel(by_paths, "G")[p], b = (double)ca_image_channel(by_sums, "G")[p];
        if (!(fabs(a - b) <= 1e-5 * fabs(a))) fail_msg("pixel %zu: %.9g by paths, %.9g by sums", p, a, b);
        mean += a / (WIDTH * HEIGHT);
    }
    assert_true(mean > 0.1);
    settings.threads = 3;
    assert_true(rendered_hash(scene, &settings) == image_hash(by_sums));
    ca_image_release(by_paths);
    ca_image_release(by_sums);
    ca_scene_release(scene);
}

/* There are no such sums of powers. */
static void test_power_heuristic_is_refused(void **state)
{
    (void)state;
    ca_scene *scene = scene_from_text(scene_text);
    const ca_render_settings settings = settings_of("vcm:merge_sums=true,heuristic=power");
    ca_image_layers *image;
    ca_error error;
    assert_int_equal(ca_render(scene, &settings, &image, NULL, &error), CA_ERROR_UNSUPPORTED);
    assert_non_null(strstr(error.message, "balance"));
    ca_scene_release(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_weights_by_sums),
        cmocka_unit_test(test_power_heuristic_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
