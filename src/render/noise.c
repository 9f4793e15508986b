#include "render/noise.h"

#include "base/memory.h"
#include "base/reserve.h"
#include "noise/layers.h"
#include "render/noise_plan.h"
#include "render/public_structs.h"

#include <string.h>

ca_status ca_noise_check(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                         ca_noise_setup *setup, ca_error *error)
{
    ca_noise_plan p;
    CA_TRY(ca_noise_plan_make(&p, scene, settings, iterations, error));
    *setup = (ca_noise_setup){.integrator = p.plan.type->name,
                              .light_paths = p.light_paths,
                              .camera_paths = p.plan.camera_paths,
                              .radius = ca_integrator_value(p.plan.type, &p.plan.input, "radius", 0.0),
                              .connects = p.connects,
                              .instead_of_scene = p.instead_of_scene};
    memcpy(setup->picture, p.plan.crop, sizeof p.plan.crop);
    return CA_OK;
}

ca_status ca_noise_check_region(const uint32_t r[4], const uint32_t picture[4], ca_error *error)
{
    if (r[0] < r[2] && r[1] < r[3] && r[0] >= picture[0] && r[1] >= picture[1] && r[2] <= picture[2] &&
        r[3] <= picture[3])
        return CA_OK;
    return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                   "the region %u,%u,%u,%u is empty or leaves the picture %u,%u,%u,%u", r[0], r[1], r[2], r[3],
                   picture[0], picture[1], picture[2], picture[3]);
}

/* ---- Measuring ------------------------------------------------------------------------------------------------- */

/* *measured: there are results, whatever failed after them. A pixel has its own number of iterations: one that was
 * not finished does no harm. `reserve` is for the layers. */
static ca_status run(ca_noise_plan *p, const ca_pair_film *film, ca_reserve *reserve, ca_image_layers **image,
                     ca_render_statistics *statistics, bool *measured, ca_error *error)
{
    const ca_status status = ca_render_plan_run(&p->plan, image, statistics, error);
    if (status != CA_OK && (!*image || statistics->iterations < 2)) return status;
    if (statistics->iterations < 2)
        return ca_fail(error, CA_ERROR_INTERRUPTED, NULL,
                       "ended before two iterations were complete: no noise was measured");
    if (film->incomplete) return ca_fail_memory(error, "the pairs of light and camera paths");
    ca_error reason;
    ca_reserve_open(reserve);
    const ca_status added = ca_noise_add_layers(film, *image, &reason);
    *measured = added == CA_OK;
    return ca_fail_also(error, status, added, &reason);
}

static ca_status measure(ca_noise_plan *p, ca_pair_film *film, ca_image_layers **image,
                         ca_render_statistics *statistics, bool *measured, ca_error *error)
{
    enum { SMALL_THINGS = 1 << 14 };
    ca_reserve *reserve;
    CA_TRY(ca_pair_film_create(film, p->plan.crop, p->light_paths, p->plan.camera_paths, error));
    if (p->other_count > 0) CA_TRY(ca_pair_film_add_others(film, p->others, p->other_count, error));
    p->plan.input.pairs = film;
    CA_TRY(ca_reserve_create(&reserve, ca_noise_layers_bytes(film, p->connects) + SMALL_THINGS, "the layers of noise",
                             p->plan.input.stop, error));
    const ca_status status = run(p, film, reserve, image, statistics, measured, error);
    ca_reserve_release(reserve);
    return status;
}

ca_status ca_noise_measure(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                           ca_noise **noise, ca_image_layers **image, ca_render_statistics *statistics,
                           ca_error *error)
{
    return ca_noise_measure_for(scene, settings, iterations, NULL, 0, noise, image, statistics, error);
}

ca_status ca_noise_measure_for(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                               const ca_noise_counts *counts, size_t count, ca_noise **noise,
                               ca_image_layers **image, ca_render_statistics *statistics, ca_error *error)
{
    ca_render_settings taken;
    ca_render_statistics told;
    ca_image_layers *made = NULL;
    ca_noise_plan p;
    *noise = NULL;
    if (image) *image = NULL;
    CA_TRY(ca_settings_take(settings, &taken, error));
    CA_TRY(ca_statistics_take(statistics, &told, error));
    CA_TRY(ca_noise_plan_make(&p, scene, &taken, iterations, error));
    CA_TRY(ca_noise_plan_add_others(&p, counts, count, error));
    *noise = ca_alloc_zeroed(1, sizeof **noise);
    ca_status status = *noise ? CA_OK : ca_fail_memory(error, "the noise");
    if (status == CA_OK)
        (*noise)->light_paths_only =
            ca_integrator_has(p.plan.type, CA_ABILITY_ONE_CAMERA_PATH) || p.plan.camera_paths == 1;
    bool measured = false;
    if (status == CA_OK) status = measure(&p, &(*noise)->film, &made, &told, &measured, error);
    ca_statistics_give(&told, statistics);
    if (measured && image)
        *image = made;
    else
        ca_layers_destroy(made);
    if (measured) return status;
    ca_noise_release(*noise);
    *noise = NULL;
    return status;
}

uint32_t ca_noise_find_other(const ca_pair_film *film, uint32_t light_paths, uint32_t camera_paths)
{
    uint32_t i = 0;
    while (i < film->other_count &&
           (film->others[i].light_paths != light_paths || film->others[i].camera_paths != camera_paths))
        i++;
    return i;
}

ca_status ca_noise_average(const ca_noise *noise, const uint32_t *region, uint32_t light_paths, uint32_t camera_paths,
                           ca_noise_summary *summary, ca_error *error)
{
    const ca_pair_film *film = &noise->film;
    const uint32_t picture[4] = {film->x0, film->y0, film->x0 + film->width, film->y0 + film->height};
    if (!region) region = picture;
    CA_TRY(ca_noise_check_region(region, picture, error));
    if (light_paths < 1 || camera_paths < 1)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "noise is predicted for at least one light path and one camera path");
    if (film->camera_paths == 1 && camera_paths > 1)
        return ca_fail(
            error, CA_ERROR_ARGUMENT, NULL,
            "from one camera path per pixel and iteration the noise of more cannot be predicted: measure with at "
            "least 2");
    if (film->connections && camera_paths > light_paths)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "of connected paths noise is predicted for no more camera paths per pixel than light paths, "
                       "not for %u, %u",
                       light_paths, camera_paths);
    const uint32_t other = ca_noise_find_other(film, light_paths, camera_paths);
    *summary = other < film->other_count ? ca_noise_summarise_other(film, region, other)
                                         : ca_noise_summarise(film, region, light_paths, camera_paths);
    return CA_OK;
}

void ca_noise_release(ca_noise *noise)
{
    if (!noise) return;
    ca_pair_film_destroy(&noise->film);
    ca_free(noise);
}
