/* Measuring noise components (ca_noise_measure): the iterations of a render with every pixel's pairs summed beside
 * its film.
 *
 * The law needs independent iterations of one distribution: independent random numbers, and one radius unless the
 * settings say otherwise. */
#ifndef CA_RENDER_NOISE_H
#define CA_RENDER_NOISE_H

#include "noise/components.h"
#include "noise/ray_numbers.h"
#include "render/ray_times.h"
#include "render/render.h"

struct ca_noise {
    ca_pair_film film;
    bool light_paths_only; /* one camera path per pixel is all that can be recommended */
};

/* What is measured. */
typedef struct ca_noise_setup {
    const char *integrator;
    uint32_t picture[4];                /* the part of the film */
    uint32_t light_paths, camera_paths; /* N_F, N_B */
    double radius;                      /* of merges; 0: there are none */
    bool connects;                      /* camera paths connect to light paths: no numbers are recommended */
    bool instead_of_scene;              /* the scene names an integrator, but one without the pair law */
} ca_noise_setup;

/* All that can be wrong with the settings, before any work. Errors as of ca_render_plan_make. */
ca_status ca_noise_check(const ca_scene *scene, const ca_render_settings *settings, uint32_t iterations,
                         ca_noise_setup *setup, ca_error *error);

/* CA_ERROR_ARGUMENT where a region is empty or not within the picture. */
ca_status ca_noise_check_region(const uint32_t region[4], const uint32_t picture[4], ca_error *error);

/* The film of other numbers that has these; their count where there is none. */
uint32_t ca_noise_find_other(const ca_pair_film *film, uint32_t light_paths, uint32_t camera_paths);

/* The least time of a path: what is too short to be measured still takes some time. */
#define CA_NOISE_SHORTEST_SECONDS 1e-9

/* Where paths connect: numbers of paths to measure for, so that others can be chosen. */
enum { CA_NOISE_GRID = 4 };
uint32_t ca_noise_grid(uint32_t light_paths, uint32_t camera_paths, ca_noise_counts counts[CA_NOISE_GRID]);
/* May numbers be chosen from this film for this objective? It may be one of paths that do not connect. */
ca_status ca_noise_check_connected(const ca_pair_film *film, ca_ray_objective objective, ca_error *error);
/* The same for all pixels; all 0 where no noise was found. `most`: light paths. */
ca_status ca_noise_choose_connected(const ca_pair_film *film, const ca_ray_times *times, const ca_ray_costs *costs,
                                    ca_ray_objective objective, uint32_t most, ca_ray_numbers *numbers,
                                    ca_error *error);

/* The numbers that ca_noise_recommend chooses, for times that are known: `times` says what its pixels' paths do,
 * `costs` how long that takes. A pure function. numbers->given is what was measured. */
ca_status ca_noise_choose(const ca_noise *noise, const ca_ray_times *times, const ca_ray_costs *costs,
                          ca_ray_objective objective, ca_ray_numbers *numbers, ca_error *error);

#endif
