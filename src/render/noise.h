/* Measuring noise components (ca_noise_measure): the iterations of a render with every pixel's pairs summed beside its film.
 *
 * The law needs independent iterations of one distribution: independent random numbers, and one radius unless the settings say
 * otherwise. */
#ifndef CA_RENDER_NOISE_H
#define CA_RENDER_NOISE_H

#include "noise/components.h"
#include "render/render.h"

struct ca_noise {
    ca_pair_film film;
};

/* All that can be wrong with the settings, before any work; `picture` is set to the part of the film that is measured. Errors as
 * of ca_render_plan_make. */
ca_status ca_noise_check(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations, uint32_t picture[4],
                         ca_error *error);

/* CA_ERROR_ARGUMENT where a region is empty or not within the picture. */
ca_status ca_noise_check_region(const uint32_t region[4], const uint32_t picture[4], ca_error *error);

#endif
