#include "integrator/bidirectional.h"

#include "base/memory.h"
#include "base/text.h"
#include "photon/radius.h"

#include <math.h>

/* Unlimited paths rely on the roulette to end before CA_PATH_MAX_VERTICES. */
enum { LATEST_ROULETTE = 512 };

/* What a chunk takes is estimated from so many light paths, and from so many of a long pass. */
enum { FEW_PATHS = 1024, MANY_PATHS = 16384, OF_PATHS = 256 };

/* ---- Settings -------------------------------------------------------------------------------------------------- */

static ca_status check_depths(const ca_bidirectional *b, const char *name, ca_error *error)
{
    if (b->max_depth < CA_PATH_MAX_VERTICES - 1 || b->rr_depth <= LATEST_ROULETTE) return CA_OK;
    return ca_fail(
        error, CA_ERROR_UNSUPPORTED, NULL,
        "integrator \"%s\" keeps at most %d vertices of a path: set max_depth below %d or rr_depth to at most %d",
        name, CA_PATH_MAX_VERTICES, CA_PATH_MAX_VERTICES - 1, LATEST_ROULETTE);
}

static void read_rules(ca_bidirectional *b, const ca_integrator_type *type, const ca_integrator_input *input)
{
    ca_mis_rules *rules = &b->rules;
    ca_rules_read(rules, type, input);
    const bool others = input->pairs && input->pairs->other_count > 0;
    b->weighs_merges = input->observer || others || !ca_mis_has_one_technique(rules);
    rules->has_tails = ca_mis_has_tails(rules);
    rules->photon_sums = ca_integrator_value(type, input, "merge_sums", 0.0) != 0.0 && !input->observer && !others;
    ca_rules_set_counts(rules, input->camera, b->light_paths, b->camera_paths);
}

static ca_status read_settings(ca_bidirectional *b, const ca_integrator_type *type, const ca_integrator_input *input,
                               ca_error *error)
{
    const double max_depth = ca_integrator_value(type, input, "max_depth", -1.0);
    b->max_depth = max_depth < 0.0 ? UINT32_MAX : (uint32_t)max_depth;
    b->rr_depth = (uint32_t)ca_integrator_value(type, input, "rr_depth", CA_ROULETTE_DEPTH);
    b->paper = ca_integrator_value(type, input, "paper", 0.0) != 0.0;
    if (b->paper) {
        b->rr_depth = LATEST_ROULETTE;
        CA_TRY(ca_paper_check(input, error));
    }
    b->hide_emitters = ca_integrator_value(type, input, "hide_emitters", 0.0) != 0.0;
    b->light_paths = ca_light_paths_of_pass(type, input);
    b->camera_paths = (uint32_t)ca_integrator_value(type, input, "camera_paths", 1.0);
    b->alpha = (float)ca_integrator_value(type, input, "alpha", 0.5);
    read_rules(b, type, input);
    if (b->rules.photon_sums && !b->rules.has_tails)
        return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL,
                       "integrator \"%s\": merge_sums needs the balance heuristic", type->name);
    if (ca_bidirectional_merges(b)) CA_TRY(ca_first_radius(type, input, &b->radius0, error));
    return check_depths(b, type->name, error);
}

static ca_status make_guide(ca_bidirectional *b, const ca_integrator_type *type, ca_error *error)
{
    if (!b->input.guide) CA_TRY(ca_integrator_make_guide(type, &b->input, &b->own_guide, error));
    b->guide = b->input.guide ? b->input.guide : b->own_guide;
    return CA_OK;
}

void ca_bidirectional_set_radius(ca_bidirectional *b, float radius)
{
    b->radius = radius;
    b->rules.merge_area = b->rules.reuse.merge_area = CA_PI * ca_sqr(radius);
    ca_pairs_set_area(b, b->rules.merge_area);
}

/* The radius of a pass. */
static void set_radius(ca_bidirectional *b, uint32_t pass)
{
    ca_bidirectional_set_radius(b, ca_progressive_radius(b->radius0, b->alpha, pass));
}

static bool wants_pilot(const ca_bidirectional *b)
{
    return b->rules.reuse.kind == CA_REUSE_DENSITY || b->rules.reuse.kind == CA_REUSE_NORMALISED;
}

/* With factors, which tell of a region of the film, the density of photons need not be finer: it is that of few light
 * paths, in cells that are wide enough to hold as many photons, and stays in the cache. */
static uint32_t pilot_paths(const ca_bidirectional *b)
{
    if (!b->rules.factors) return ca_min_u32(CA_CHUNK_PATHS, b->light_paths);
    return ca_factor_pilot_paths(b->light_paths);
}

static ca_status make_pilot(ca_bidirectional *b, const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    const uint32_t paths = pilot_paths(b);
    const float scale = (float)b->light_paths / (float)paths;
    ca_photon_grid *grid;
    CA_TRY(ca_light_pilot(b, paths, b->rules.factors ? b->radius0 * sqrtf(scale) : b->radius0, &grid, parallel,
                          workers, error));
    const ca_status status = ca_photon_density_create(&b->pilot, grid, error);
    ca_photon_grid_destroy(grid);
    b->pilot_scale = scale;
    return status;
}

/* Pilots are made once, in the first pass that there is. They are the same whichever that is: a part of a render may
 * begin anywhere. */
ca_status ca_bidirectional_make_pilots(ca_bidirectional *b, const ca_parallel *parallel, ca_worker *workers,
                                       ca_error *error)
{
    const ca_sampler *sampler = b->input.sampler;
    ca_status status = CA_OK;
    b->input.sampler = &b->pilot_sampler;
    if (wants_pilot(b) && !b->pilot) status = make_pilot(b, parallel, workers, error);
    if (status == CA_OK && b->rules.factors && !b->factors)
        status = ca_factor_pilot(b, parallel, workers, &b->factors, error);
    if (status == CA_OK) status = ca_pairs_make_pilots(b, parallel, workers, error);
    b->input.sampler = sampler;
    return status;
}

ca_status ca_bidirectional_prepare(void *state, const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    ca_bidirectional *b = state;
    ca_pairs_begin_pass(b);
    set_radius(b, 0);
    return ca_bidirectional_make_pilots(b, parallel, workers, error);
}

/* ---- Rounds ---------------------------------------------------------------------------------------------------- */

uint32_t ca_bidirectional_rounds(const void *state)
{
    const ca_bidirectional *b = state;
    return (b->chunk_count + b->resident - 1) / b->resident;
}

ca_status ca_bidirectional_begin_round(void *state, uint32_t pass, uint32_t round, const ca_parallel *parallel,
                                       ca_worker *workers, ca_error *error)
{
    ca_bidirectional *b = state;
    if (round == 0) {
        ca_splat_buffer_clear(&b->splats);
        CA_TRY(ca_bidirectional_prepare(b, parallel, workers, error));
        set_radius(b, pass);
        b->pairing_shift = ca_pcg_permute(b->input.sampler->seed + pass) % b->light_paths;
    }
    b->first_chunk = round * b->resident;
    const uint32_t first = b->first_chunk * (uint32_t)CA_CHUNK_PATHS, left = b->light_paths - first;
    const uint64_t most = (uint64_t)b->resident * CA_CHUNK_PATHS;
    b->first_number = b->input.first_light_path + (uint64_t)pass * b->light_paths;
    CA_TRY(ca_light_paths_prepare(b, b->first_number + first, left < most ? left : (uint32_t)most, parallel, workers,
                                  error));
    return ca_pairs_are_wanted(b) && b->rules.splat ? ca_pairs_sort_splats(b, error) : CA_OK;
}

ca_rgb ca_bidirectional_splat(const void *state, uint32_t x, uint32_t y)
{
    const ca_bidirectional *b = state;
    return ca_splat_buffer_at(&b->splats, x, y);
}

/* ---- Memory ---------------------------------------------------------------------------------------------------- */

static ca_light_layout layout_of(const ca_bidirectional *b, const ca_integrator_type *type)
{
    const bool bars = ca_integrator_value(type, &b->input, "error_bars", 0.0) != 0.0;
    const bool pairs = b->input.pairs || b->input.keeps_pairs || bars;
    return ca_light_layout_of(&b->rules, b->input.scene->shape_count, pairs, b->input.observer != NULL);
}

/* What a chunk of light paths will take: bytes that are kept, photons, and what is needed for one chunk at a time. */
typedef struct chunk_estimate {
    double paths, kept, photons, once;
} chunk_estimate;

/* From a few of them. */
static ca_status estimate_chunk(ca_bidirectional *b, const ca_light_layout *layout, chunk_estimate *estimate,
                                ca_error *error)
{
    ca_worker worker = {.index = 0};
    const uint32_t paths = ca_min_u32(CA_CHUNK_PATHS, b->light_paths);
    const uint32_t some = ca_min_u32(ca_max_u32(FEW_PATHS, b->light_paths / OF_PATHS), MANY_PATHS);
    const uint32_t few = ca_min_u32(some, paths);
    set_radius(b, 0);
    ca_light_block *block = &b->blocks[0];
    ca_light_store store;
    CA_TRY(ca_light_store_create(&store, layout, few, 1, error));
    ca_light_walks(b, &store, 0, few, CA_PILOT_NUMBER, block, &worker);
    const ca_status status = ca_light_store_check(&store, error);
    *estimate = (chunk_estimate){.paths = paths,
                                 .kept = (double)block->bytes / few * paths,
                                 .photons = (double)block->photons / few * paths,
                                 .once = (double)block->splats.count * sizeof(ca_splat) / few * paths};
    block->photons = 0;
    block->bytes = 0;
    block->splats.count = 0;
    ca_light_store_destroy(&store);
    return status;
}

/* What so many chunks take that are held at once. */
static double bytes_of_chunks(const chunk_estimate *chunk, uint32_t count)
{
    const double photons = count * chunk->photons;
    return count * (chunk->kept + chunk->paths * sizeof(ca_light_path)) + chunk->once +
           (photons > 0.0 ? ca_photon_bytes((uint64_t)photons) : 0.0);
}

/* What light paths may take; *asked: was it asked for? Pairs need them all at once. */
static double bytes_allowed(const ca_bidirectional *b, bool *asked)
{
    const double bytes = b->input.memory_bytes;
    *asked = bytes > 0.0 && bytes < (double)INFINITY;
    if (*asked) return bytes;
    return bytes > 0.0 || b->input.pairs ? (double)INFINITY : CA_LIGHT_BYTES_BY_DEFAULT;
}

/* How many chunks may be in memory at a time: at least one, unless the memory that was asked for does not hold it. */
static ca_status plan_rounds(ca_bidirectional *b, const ca_light_layout *layout, ca_error *error)
{
    bool asked;
    const double allowed = bytes_allowed(b, &asked);
    b->resident = b->chunk_count;
    if (!asked && (b->chunk_count == 1 || isinf(allowed))) return CA_OK;
    chunk_estimate chunk;
    CA_TRY(estimate_chunk(b, layout, &chunk, error));
    const double least = bytes_of_chunks(&chunk, 1), most = fmin(allowed, CA_LIGHT_STORE_MOST_BYTES);
    if (asked && least > allowed)
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "%u light path%s about %.0f MiB, more than the %.0f MiB left beside the film",
                       ca_min_u32(CA_CHUNK_PATHS, b->light_paths), ca_noun(b->light_paths, " needs", "s need"),
                       least / 1048576.0, allowed / 1048576.0);
    while (b->resident > 1 && bytes_of_chunks(&chunk, b->resident) > most) b->resident--;
    return CA_OK;
}

static ca_status create_scratch(ca_bidirectional *b, ca_error *error)
{
    b->scratch = ca_alloc_zeroed(b->input.workers, sizeof *b->scratch);
    if (!b->scratch) return ca_fail_memory(error, "the integrator");
    for (uint32_t i = 0; i < b->input.workers; i++)
        CA_TRY(ca_bidirectional_scratch_create(&b->scratch[i], b, error));
    return CA_OK;
}

static ca_status create_chunk_sums(ca_bidirectional *b, ca_error *error)
{
    for (uint32_t i = 0; i < b->input.workers; i++)
        CA_TRY(ca_bidirectional_scratch_add_chunks(&b->scratch[i], b, error));
    return CA_OK;
}

static ca_status create_light_paths(ca_bidirectional *b, const ca_integrator_type *type, ca_error *error)
{
    const ca_light_layout layout = layout_of(b, type);
    b->chunk_count = (uint32_t)(((uint64_t)b->light_paths + CA_CHUNK_PATHS - 1) / CA_CHUNK_PATHS);
    b->blocks = ca_alloc_zeroed(ca_light_block_count(ca_min_u32(CA_CHUNK_PATHS, b->light_paths)), sizeof *b->blocks);
    if (!b->blocks) return ca_fail_memory(error, "the light paths");
    CA_TRY(plan_rounds(b, &layout, error));
    const uint64_t most = (uint64_t)b->resident * CA_CHUNK_PATHS;
    CA_TRY(ca_light_store_create(&b->store, &layout, most < b->light_paths ? (uint32_t)most : b->light_paths,
                                 b->input.workers, error));
    return ca_bidirectional_merges(b) ? ca_photon_grid_create(&b->grid, error) : CA_OK;
}

ca_status ca_bidirectional_create(const ca_integrator_type *type, const ca_mis_rules *rules,
                                  const ca_integrator_input *input, void **state, ca_error *error)
{
    ca_bidirectional *b = ca_alloc_zeroed(1, sizeof *b);
    if (!b) return ca_fail_memory(error, "the integrator");
    b->input = *input;
    b->pilot_sampler = *input->sampler;
    b->rules = *rules;
    ca_status status = read_settings(b, type, input, error);
    if (status == CA_OK) status = make_guide(b, type, error);
    if (status == CA_OK) status = create_scratch(b, error);
    if (status == CA_OK) status = create_light_paths(b, type, error);
    if (status == CA_OK) status = ca_pairs_check(b, type, error);
    if (status == CA_OK) status = create_chunk_sums(b, error);
    if (status == CA_OK) status = ca_pairs_create(b, error);
    if (status == CA_OK) status = ca_splat_buffer_create(&b->splats, input->crop, error);
    if (status != CA_OK) {
        ca_bidirectional_destroy(b);
        return status;
    }
    *state = b;
    return CA_OK;
}

void ca_bidirectional_destroy(void *state)
{
    ca_bidirectional *b = state;
    const uint32_t blocks = b->blocks ? ca_light_block_count(ca_min_u32(CA_CHUNK_PATHS, b->light_paths)) : 0;
    for (uint32_t i = 0; i < blocks; i++) {
        ca_splat_list_destroy(&b->blocks[i].splats);
        ca_free(b->blocks[i].scales);
    }
    ca_light_store_destroy(&b->store);
    ca_photon_grid_destroy(b->grid);
    ca_pairs_destroy(b);
    for (uint32_t i = 0; b->scratch && i < b->input.workers; i++) ca_bidirectional_scratch_destroy(&b->scratch[i]);
    ca_photon_density_destroy(b->pilot);
    ca_emission_guide_destroy(b->own_guide);
    ca_factor_map_destroy(b->factors);
    ca_splat_buffer_destroy(&b->splats);
    ca_free(b->scratch);
    ca_free(b->blocks);
    ca_free(b);
}
