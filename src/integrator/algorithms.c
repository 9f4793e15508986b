/* The named algorithms: rows of the integrator table, each a set of rules for the bidirectional engine and the
 * parameters that steer it.
 *
 * Parameters mean the same in all of them:
 *     max_depth, rr_depth, hide_emitters  as in `path`
 *     heuristic      balance | power
 *     light_paths    N_F, light paths of a pass; 0: one per pixel of the full film
 *     camera_paths   N_B, camera paths per pixel of a pass
 *     guide          light paths start where light reaches the picture (guide_pilot.c)
 *     radius         merge radius of the first pass, m; 0: as radius_pixels says
 *     radius_pixels  the same in sides of a pixel's median footprint; 0: the one of least error (radius_pilot.c)
 *     alpha          how fast the radius shrinks (photon/radius.h)
 */
#include "integrator/bidirectional.h"

#define PATH_PARAMETERS                                                                                              \
    {"max_depth", CA_SPEC_INTEGER, .minimum = -1, .number = -1},                                                     \
        {"rr_depth", CA_SPEC_INTEGER, .minimum = 1, .number = CA_ROULETTE_DEPTH},                                    \
    {                                                                                                                \
        "hide_emitters", CA_SPEC_BOOLEAN, .number = 0                                                                \
    }
#define COUNT_PARAMETERS                                                                                             \
    {"light_paths", CA_SPEC_INTEGER, .minimum = 0, .number = 0},                                                     \
    {                                                                                                                \
        "camera_paths", CA_SPEC_INTEGER, .minimum = 1, .number = 1                                                   \
    }
#define GUIDE_PARAMETER {"guide", CA_SPEC_BOOLEAN, .number = 0}
#define HEURISTIC_PARAMETER {"heuristic", CA_SPEC_CHOICE, .choices = "balance|power", .number = 0}
#define RADIUS_PARAMETERS(default_alpha)                                                                             \
    CA_RADIUS_SPEC,                                                                                                  \
        {"alpha", CA_SPEC_REAL, .minimum = 0, .maximum = 1, .number = (default_alpha)},                              \
    {                                                                                                                \
        "radius_pixels", CA_SPEC_REAL, .minimum = 0, .number = 0                                                     \
    }
#define END_OF_PARAMETERS {.name = NULL}

#define ENGINE_FUNCTIONS                                                                                             \
    .destroy = ca_bidirectional_destroy, .rounds = ca_bidirectional_rounds,                                          \
    .prepare = ca_bidirectional_prepare, .begin_round = ca_bidirectional_begin_round,                                \
    .camera_paths = ca_bidirectional_camera_paths, .begin_pixel = ca_pairs_begin_pixel,                              \
    .end_pixel = ca_pairs_end_pixel, .splat = ca_bidirectional_splat

/* ---- light ----------------------------------------------------------------------------------------------------- */

static const ca_mis_rules light_rules = {.hit = CA_HIT_DIRECT, .splat = true};

static ca_status create_light(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_light, &light_rules, input, state, error);
}

static const ca_parameter_spec light_parameters[] = {PATH_PARAMETERS, COUNT_PARAMETERS, GUIDE_PARAMETER,
                                                     END_OF_PARAMETERS};
const ca_integrator_type ca_integrator_light = {
    .name = "light",
    .parameters = light_parameters,
    .abilities = CA_ABILITY_LIGHT_SAMPLES,
    .rules = &light_rules,
    .create = create_light,
    ENGINE_FUNCTIONS,
};

/* ---- bdpt ------------------------------------------------------------------------------------------------------ */

static const ca_mis_rules bdpt_rules = {.hit = CA_HIT_ALWAYS, .next_event = true, .connect = true, .splat = true};

static ca_status create_bdpt(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_bdpt, &bdpt_rules, input, state, error);
}

/* Without splats these are the techniques of Sirak 2019, section 3.2: s >= 2 camera vertices, t >= 0 light
 * vertices. paper: as the report's program does it in all (paper.c). */
static const ca_parameter_spec bdpt_parameters[] = {
    PATH_PARAMETERS,
    HEURISTIC_PARAMETER,
    COUNT_PARAMETERS,
    {"strategies", CA_SPEC_CHOICE, .choices = "all|no-splat", .number = 0},
    {"paper", CA_SPEC_BOOLEAN, .number = 0},
    GUIDE_PARAMETER,
    END_OF_PARAMETERS};
const ca_integrator_type ca_integrator_bdpt = {
    .name = "bdpt",
    .parameters = bdpt_parameters,
    .abilities = CA_ABILITY_CONNECTION_NOISE,
    .rules = &bdpt_rules,
    .create = create_bdpt,
    ENGINE_FUNCTIONS,
};

/* ---- ppm, bdpm: photons alone ---------------------------------------------------------------------------------- */

static const ca_mis_rules photon_rules = {.hit = CA_HIT_UNMERGEABLE, .merge = CA_MERGE_ALL};

static ca_status create_ppm(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_ppm, &photon_rules, input, state, error);
}

static ca_status create_bdpm(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_bdpm, &photon_rules, input, state, error);
}

static const ca_parameter_spec ppm_parameters[] = {PATH_PARAMETERS, COUNT_PARAMETERS,
                                                   RADIUS_PARAMETERS(CA_RANDOM_ALPHA), GUIDE_PARAMETER,
                                                   END_OF_PARAMETERS};
const ca_integrator_type ca_integrator_ppm = {
    .name = "ppm",
    .parameters = ppm_parameters,
    .abilities = CA_ABILITY_PAIR_LAW | CA_ABILITY_ONE_CAMERA_PATH,
    .rules = &photon_rules,
    .create = create_ppm,
    ENGINE_FUNCTIONS,
};

/* camera_diffuse_depth: the smooth events a camera path may have (BDD of Ershov et al.); merges happen after 0 to so
 * many of them, weighted, or at the last of these vertices only. */
static const ca_parameter_spec bdpm_parameters[] = {
    PATH_PARAMETERS,
    HEURISTIC_PARAMETER,
    COUNT_PARAMETERS,
    RADIUS_PARAMETERS(CA_RANDOM_ALPHA),
    {"camera_diffuse_depth", CA_SPEC_INTEGER, .minimum = 0, .number = 1},
    {"merges", CA_SPEC_CHOICE, .choices = "all|last", .number = 0},
    GUIDE_PARAMETER,
    END_OF_PARAMETERS};
const ca_integrator_type ca_integrator_bdpm = {
    .name = "bdpm",
    .parameters = bdpm_parameters,
    .abilities = CA_ABILITY_PAIR_LAW,
    .rules = &photon_rules,
    .create = create_bdpm,
    ENGINE_FUNCTIONS,
};

/* ---- vcm and its kin: everything, told apart by what a merge counts for ---------------------------------------- */

#define VCM_RULES(reuse_kind)                                                                                        \
    {                                                                                                                \
        .hit = CA_HIT_ALWAYS, .next_event = true, .connect = true, .splat = true, .merge = CA_MERGE_ALL,             \
        .merge_limit = UINT32_MAX, .reuse = {.kind = (reuse_kind)}                                                   \
    }
static const ca_mis_rules vcm_rules = VCM_RULES(CA_REUSE_FULL);
static const ca_mis_rules vcm_plus_rules = VCM_RULES(CA_REUSE_DENSITY);
static const ca_mis_rules vcm_star_rules = VCM_RULES(CA_REUSE_NORMALISED);
static const ca_mis_rules cavcm_rules = VCM_RULES(CA_REUSE_CORRELATION);
static const ca_mis_rules ovcm_rules = VCM_RULES(CA_REUSE_FOOTPRINT);
/* The density rule for merges; what else they have in common is in their factors. */
static const ca_mis_rules vavcm_rules = {.hit = CA_HIT_ALWAYS,
                                         .factors = true,
                                         .next_event = true,
                                         .connect = true,
                                         .splat = true,
                                         .merge = CA_MERGE_ALL,
                                         .merge_limit = UINT32_MAX,
                                         .reuse = {.kind = CA_REUSE_DENSITY}};

static ca_status create_vcm(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_vcm, &vcm_rules, input, state, error);
}

static ca_status create_vcm_plus(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_vcm_plus, &vcm_plus_rules, input, state, error);
}

static ca_status create_vcm_star(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_vcm_star, &vcm_star_rules, input, state, error);
}

static ca_status create_cavcm(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_cavcm, &cavcm_rules, input, state, error);
}

static ca_status create_ovcm(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_ovcm, &ovcm_rules, input, state, error);
}

static ca_status create_vavcm(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_vavcm, &vavcm_rules, input, state, error);
}

/* merge_sums: weights of merges from sums that photons keep (path/mis.h), for comparison. */
static const ca_parameter_spec vcm_parameters[] = {
    PATH_PARAMETERS,
    HEURISTIC_PARAMETER,
    COUNT_PARAMETERS,
    RADIUS_PARAMETERS(CA_RANDOM_ALPHA),
    GUIDE_PARAMETER,
    {"merge_sums", CA_SPEC_BOOLEAN, .number = 0},
    END_OF_PARAMETERS};
/* Of cavcm and vavcm. */
static const ca_parameter_spec aware_parameters[] = {PATH_PARAMETERS, HEURISTIC_PARAMETER, COUNT_PARAMETERS,
                                                     RADIUS_PARAMETERS(CA_RANDOM_ALPHA), GUIDE_PARAMETER,
                                                     END_OF_PARAMETERS};
/* densities: as `author` of path/reuse.h. */
static const ca_parameter_spec density_parameters[] = {
    PATH_PARAMETERS,
    HEURISTIC_PARAMETER,
    COUNT_PARAMETERS,
    RADIUS_PARAMETERS(CA_RANDOM_ALPHA),
    GUIDE_PARAMETER,
    {"densities", CA_SPEC_CHOICE, .choices = "vertex|author", .number = 0},
    END_OF_PARAMETERS};
/* epsilon and c of Jendersie 2019, equations 8a and 8c; footprint: whether areas follow the surface's tilt
 * (section 2.2). */
static const ca_parameter_spec ovcm_parameters[] = {
    PATH_PARAMETERS,
    HEURISTIC_PARAMETER,
    COUNT_PARAMETERS,
    RADIUS_PARAMETERS(CA_RANDOM_ALPHA),
    {"epsilon", CA_SPEC_REAL, .minimum = 1e-6, .number = 0.01},
    {"c", CA_SPEC_REAL, .minimum = 0, .number = 0.5},
    {"footprint", CA_SPEC_CHOICE, .choices = "plain|projected", .number = 0},
    GUIDE_PARAMETER,
    END_OF_PARAMETERS};

const ca_integrator_type ca_integrator_vcm = {
    .name = "vcm",
    .parameters = vcm_parameters,
    .abilities = CA_ABILITY_CONNECTION_NOISE,
    .rules = &vcm_rules,
    .create = create_vcm,
    ENGINE_FUNCTIONS,
};
const ca_integrator_type ca_integrator_vcm_plus = {
    .name = "vcm-plus",
    .parameters = density_parameters,
    .rules = &vcm_plus_rules,
    .create = create_vcm_plus,
    ENGINE_FUNCTIONS,
};
const ca_integrator_type ca_integrator_vcm_star = {
    .name = "vcm-star",
    .parameters = density_parameters,
    .rules = &vcm_star_rules,
    .create = create_vcm_star,
    ENGINE_FUNCTIONS,
};
const ca_integrator_type ca_integrator_ovcm = {
    .name = "ovcm",
    .parameters = ovcm_parameters,
    .abilities = CA_ABILITY_CONNECTION_NOISE,
    .rules = &ovcm_rules,
    .create = create_ovcm,
    ENGINE_FUNCTIONS,
};
const ca_integrator_type ca_integrator_cavcm = {
    .name = "cavcm",
    .parameters = aware_parameters,
    .rules = &cavcm_rules,
    .create = create_cavcm,
    ENGINE_FUNCTIONS,
};

const ca_integrator_type ca_integrator_vavcm = {
    .name = "vavcm",
    .parameters = aware_parameters,
    .abilities = CA_ABILITY_CONNECTION_NOISE,
    .rules = &vavcm_rules,
    .create = create_vavcm,
    ENGINE_FUNCTIONS,
};

/* ---- pilot ----------------------------------------------------------------------------------------------------- */

static const ca_mis_rules pilot_rules = {
    .hit = CA_HIT_ALWAYS, .next_event = true, .merge = CA_MERGE_ALL, .merge_limit = UINT32_MAX};

static ca_status create_pilot(const ca_integrator_input *input, void **state, ca_error *error)
{
    return ca_bidirectional_create(&ca_integrator_pilot, &pilot_rules, input, state, error);
}

static const ca_parameter_spec pilot_parameters[] = {PATH_PARAMETERS, COUNT_PARAMETERS, RADIUS_PARAMETERS(0.0),
                                                     END_OF_PARAMETERS};
const ca_integrator_type ca_integrator_pilot = {
    .name = "pilot",
    .parameters = pilot_parameters,
    .rules = &pilot_rules,
    .create = create_pilot,
    ENGINE_FUNCTIONS,
};

/* ---- The table ------------------------------------------------------------------------------------------------- */

const ca_integrator_type *const ca_algorithms[] = {
    &ca_integrator_light,    &ca_integrator_bdpt,     &ca_integrator_ppm,  &ca_integrator_bdpm,  &ca_integrator_vcm,
    &ca_integrator_vcm_plus, &ca_integrator_vcm_star, &ca_integrator_ovcm, &ca_integrator_cavcm,
    &ca_integrator_vavcm,
};
const size_t ca_algorithm_count = sizeof ca_algorithms / sizeof ca_algorithms[0];
_Static_assert(sizeof ca_algorithms / sizeof ca_algorithms[0] + 3 <= CA_MAX_INTEGRATORS, "room for all names");
