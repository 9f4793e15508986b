#include "support/pair_render.h"

#include "base/memory.h"
#include "support/scene_text.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

enum { CROP_X = 1, CROP_Y = 2 };

ca_status try_pair_render(const ca_scene *scene, const pair_render *r, ca_pair_film *film, ca_image_layers **image,
                          ca_error *error)
{
    char integrator[128];
    snprintf(integrator, sizeof integrator, "%s,light_paths=%u,camera_paths=%u", r->integrator, r->light_paths,
             r->camera_paths);
    const ca_render_settings settings = {.integrator = integrator,
                                         .samples_per_pixel = r->passes * r->camera_paths,
                                         .threads = r->threads,
                                         .has_seed = true,
                                         .seed = r->seed,
                                         .sampler = r->sampler,
                                         .memory_mib = r->memory_mib,
                                         .has_crop = true,
                                         .crop = {CROP_X, CROP_Y, CROP_X + CROP_WIDTH, CROP_Y + CROP_HEIGHT}};
    ca_render_plan plan;
    ca_render_statistics statistics = {.size = sizeof statistics};
    *image = NULL;
    CA_TRY(ca_render_plan_make(&plan, scene, &settings, error));
    if (film) CA_TRY(ca_pair_film_create(film, plan.crop, r->light_paths, r->camera_paths, error));
    if (film && r->other_count > 0) CA_TRY(ca_pair_film_add_others(film, r->others, r->other_count, error));
    plan.input.pairs = film;
    const ca_status status = ca_render_plan_run(&plan, image, &statistics, error);
    if (status != CA_OK && film) ca_pair_film_destroy(film);
    if (status == CA_OK) assert_int_equal(statistics.non_finite, 0);
    return status;
}

ca_image_layers *render_pairs(const ca_scene *scene, const pair_render *r, ca_pair_film *film)
{
    ca_image_layers *image;
    ca_error error;
    if (try_pair_render(scene, r, film, &image, &error) != CA_OK) fail_msg("%s", error.message);
    if (film) assert_false(film->incomplete);
    return image;
}

static void check_same_film(const ca_pair_film *a, const ca_pair_film *b)
{
    assert_int_equal(a->width * a->height, CROP_PIXELS);
    assert_int_equal(b->width * b->height, CROP_PIXELS);
    assert_memory_equal(a->pixels, b->pixels, CROP_PIXELS * sizeof *a->pixels);
    assert_true(!a->connections == !b->connections);
    if (a->connections) assert_memory_equal(a->connections, b->connections, CROP_PIXELS * sizeof *a->connections);
}

void check_pair_bits(const ca_scene *scene, const char *integrator, uint32_t light_paths, uint32_t camera_paths)
{
    uint64_t hash = 0;
    ca_pair_film first = {0};
    for (uint32_t threads = 1; threads <= 3; threads++) {
        const pair_render r = {integrator, light_paths, camera_paths, 4, threads, 1, NULL, 0, NULL, 0};
        ca_pair_film film;
        ca_image_layers *without = render_pairs(scene, &r, NULL), *with = render_pairs(scene, &r, &film);
        if (threads == 1) {
            hash = image_hash(without);
            first = film;
        } else {
            check_same_film(&first, &film);
            ca_pair_film_destroy(&film);
        }
        assert_true(image_hash(without) == hash && image_hash(with) == hash);
        ca_image_release(without);
        ca_image_release(with);
    }
    ca_pair_film_destroy(&first);
}

void check_pair_values(const ca_scene *scene, const pair_render *r)
{
    ca_pair_film film;
    ca_image_layers *image = render_pairs(scene, r, &film);
    const float *red = ca_image_channel(image, "R"), *green = ca_image_channel(image, "G"),
                *blue = ca_image_channel(image, "B");
    for (int p = 0; p < CROP_PIXELS; p++) {
        const double luminance = (double)ca_luminance((ca_rgb){red[p], green[p], blue[p]});
        assert_int_equal(film.pixels[p].iterations, r->passes);
        const double value = film.pixels[p].sums[CA_PAIR_VALUE] / (double)film.pixels[p].iterations;
        if (!(fabs(value - luminance) <= 1e-5 * fabs(luminance) + 1e-6))
            fail_msg("%s, pixel %d: the pairs' value is %.9g, the image has %.9g", r->integrator, p, value,
                     luminance);
    }
    ca_pair_film_destroy(&film);
    ca_image_release(image);
}

void check_pair_allocations(const ca_scene *scene, const pair_render *r, uint32_t least_incomplete)
{
    uint32_t failed = 0, incomplete = 0;
    for (long n = 0;; n++) {
        ca_pair_film film = {0};
        ca_image_layers *image;
        ca_error error;
        ca_memory_fail_after(n);
        const ca_status status = try_pair_render(scene, r, &film, &image, &error);
        ca_memory_fail_after(-1);
        if (status == CA_ERROR_MEMORY) {
            ca_pair_film_destroy(&film);
            failed++;
            continue;
        }
        assert_int_equal(status, CA_OK);
        const bool tells = film.incomplete;
        incomplete += tells;
        ca_pair_film_destroy(&film);
        ca_image_release(image);
        if (!tells) break;
    }
    assert_true(failed > 10 && incomplete >= least_incomplete);
}
