/* What pairs of light and camera paths contribute, for the noise components (film/pair_sums.h). */
#include "integrator/bidirectional.h"

#include "base/memory.h"

#include <assert.h>
#include <string.h>

static ca_status refuse(const ca_integrator_type *type, const char *reason, ca_error *error)
{
    return ca_fail(error, CA_ERROR_UNSUPPORTED, NULL, "the noise components of integrator \"%s\" cannot be told: %s",
                   type->name, reason);
}

ca_status ca_pairs_check(const ca_bidirectional *b, const ca_integrator_type *type, ca_error *error)
{
    if (!b->input.pairs) return CA_OK;
    if (type->begin_block)
        return refuse(type, "it renders by blocks that share their paths, not by independent passes", error);
    if (b->input.sampler->kind != CA_SAMPLER_INDEPENDENT)
        return refuse(type, "its paths must be independent, by the sampler \"independent\"", error);
    if (b->rules.connect && b->camera_paths > b->light_paths)
        return refuse(
            type,
            "each camera path of a pixel must connect to a light path of its own, so there must be as many of them",
            error);
    if (b->light_paths < 2) return refuse(type, "a pass needs at least 2 light paths", error);
    if (b->resident < b->chunk_count)
        return refuse(type, "all light paths of a pass must fit the memory at once; allow more of it, or trace fewer",
                      error);
    assert(b->input.pairs->light_paths == b->light_paths);
    return CA_OK;
}

/* ---- Weights of other numbers of paths ------------------------------------------------------------------------- */

/* The photons of this pass tell the density rule how many there are: so many times more or fewer make its area larger
 * or smaller. Tails are of the pass' own weights. */
static ca_mis_rules rules_of(const ca_bidirectional *b, const ca_pair_numbers *numbers)
{
    ca_mis_rules rules = b->rules;
    rules.has_tails = rules.photon_sums = false;
    ca_rules_set_counts(&rules, b->input.camera, numbers->light_paths, numbers->camera_paths);
    return rules;
}

static ca_status create_others(ca_bidirectional *b, ca_error *error)
{
    const ca_pair_film *film = b->input.pairs;
    b->others = ca_alloc_zeroed(film->other_count, sizeof *b->others);
    if (!b->others) return ca_fail_memory(error, "the pairs of light and camera paths");
    b->other_count = b->others_created = film->other_count;
    for (uint32_t i = 0; i < b->other_count; i++) {
        const ca_pair_numbers numbers = {film->others[i].light_paths, film->others[i].camera_paths};
        ca_other_weights *other = &b->others[i];
        other->light_paths = numbers.light_paths;
        other->camera_paths = numbers.camera_paths;
        other->rules = rules_of(b, &numbers);
        if (b->rules.splat) CA_TRY(ca_pair_splats_create(&other->splats, b->input.crop, b->input.filter, error));
    }
    return CA_OK;
}

static ca_status create_other_sums(const ca_bidirectional *b, ca_bidirectional_scratch *scratch, ca_error *error)
{
    scratch->other_pairs = ca_alloc_zeroed(b->other_count, sizeof *scratch->other_pairs);
    scratch->other_weights = ca_alloc_zeroed(b->other_count, sizeof *scratch->other_weights);
    if (!scratch->other_pairs || !scratch->other_weights)
        return ca_fail_memory(error, "the pairs of light and camera paths");
    for (uint32_t i = 0; i < b->other_count; i++) CA_TRY(ca_pair_sums_create(&scratch->other_pairs[i], error));
    return CA_OK;
}

void ca_pairs_begin_pass(ca_bidirectional *b)
{
    b->other_count = ca_pairs_are_wanted(b) ? b->others_created : 0;
    ca_pair_splats_clear(&b->pair_splats);
    for (uint32_t i = 0; i < b->other_count; i++) ca_pair_splats_clear(&b->others[i].splats);
}

static void destroy_others(ca_bidirectional *b)
{
    b->other_count = b->others_created;
    for (uint32_t w = 0; b->scratch && w < b->input.workers; w++) {
        ca_pair_sums **sums = b->scratch[w].other_pairs;
        for (uint32_t i = 0; sums && i < b->other_count; i++) ca_pair_sums_destroy(sums[i]);
        ca_free(sums);
        b->scratch[w].other_pairs = NULL;
    }
    for (uint32_t i = 0; i < b->other_count; i++) {
        ca_factor_map_destroy(b->others[i].factors);
        ca_pair_splats_destroy(&b->others[i].splats);
    }
    ca_free(b->others);
    b->others = NULL;
    b->other_count = b->others_created = 0;
}

void ca_pairs_set_area(ca_bidirectional *b, float area)
{
    for (uint32_t i = 0; i < b->other_count; i++) {
        ca_mis_rules *rules = &b->others[i].rules;
        rules->merge_area = area;
        rules->reuse.merge_area = area * (rules->reuse.light_paths / (float)b->light_paths);
    }
}

/* The factors that an engine with these numbers would make for itself. */
static ca_status make_factors(const ca_bidirectional *b, ca_other_weights *other, const ca_parallel *parallel,
                              ca_worker *workers, ca_error *error)
{
    const ca_integrator_type *type = &ca_integrator_vavcm;
    ca_integrator_input input = b->input;
    input.pairs = NULL;
    input.technique_images = NULL;
    input.camera_paths = NULL;
    input.memory_bytes = 0.0;
    CA_TRY(ca_integrator_set_guide(type, b->guide, &input, error));
    CA_TRY(ca_integrator_set_number(type, "light_paths", other->light_paths, &input, error));
    CA_TRY(ca_integrator_set_number(type, "camera_paths", other->camera_paths, &input, error));
    CA_TRY(ca_integrator_set_number(type, "radius", (double)b->radius0, &input, error));
    void *state;
    CA_TRY(ca_bidirectional_create(type, &b->rules, &input, &state, error));
    ca_bidirectional *engine = state;
    ca_bidirectional_set_radius(engine, b->radius0);
    const ca_status status = ca_bidirectional_make_pilots(engine, parallel, workers, error);
    other->factors = engine->factors;
    engine->factors = NULL;
    ca_bidirectional_destroy(engine);
    return status;
}

/* Their paths are not the render's: its counters stay as they were. */
ca_status ca_pairs_make_pilots(ca_bidirectional *b, const ca_parallel *parallel, ca_worker *workers, ca_error *error)
{
    const uint32_t count = b->input.workers;
    if (b->other_count == 0 || !b->rules.factors || b->others[b->other_count - 1].factors) return CA_OK;
    ca_counters *kept = ca_alloc(count, sizeof *kept);
    if (!kept) return ca_fail_memory(error, "the pilot of techniques");
    ca_status status = CA_OK;
    for (uint32_t i = 0; i < count; i++) kept[i] = workers[i].counters;
    for (uint32_t i = 0; i < b->other_count && status == CA_OK; i++)
        status = make_factors(b, &b->others[i], parallel, workers, error);
    for (uint32_t i = 0; i < count; i++) workers[i].counters = kept[i];
    ca_free(kept);
    return status;
}

void ca_pairs_weigh_others(const ca_bidirectional *b, ca_bidirectional_scratch *scratch, ca_technique technique,
                           const ca_mis_path *path)
{
    ca_mis_path other = *path;
    for (uint32_t i = 0; i < b->other_count; i++) {
        const ca_other_weights *as = &b->others[i];
        if (path->factors) other.factors = ca_factor_map_same(as->factors, b->factors, path->factors);
        scratch->other_weights[i] = ca_mis_weight(&as->rules, &other, technique);
    }
}

/* ---- Splats ---------------------------------------------------------------------------------------------------- */

bool ca_pairs_scale_splat(const ca_bidirectional *b, ca_bidirectional_scratch *scratch, uint32_t splat, float weight)
{
    const size_t first = (size_t)splat * b->other_count;
    float *scales = ca_array_grow(scratch->splat_scales, &scratch->splat_scale_capacity, first + b->other_count,
                                  sizeof *scales);
    if (!scales) return false;
    scratch->splat_scales = scales;
    for (uint32_t i = 0; i < b->other_count; i++) scales[first + i] = scratch->other_weights[i] / weight;
    return true;
}

bool ca_pairs_keep_scales(const ca_bidirectional *b, const ca_bidirectional_scratch *scratch, uint32_t splat,
                          ca_light_block *block)
{
    const size_t end = block->splats.count * b->other_count, first = end - b->other_count;
    float *scales = ca_array_grow(block->scales, &block->scale_capacity, end, sizeof *scales);
    if (!scales) return false;
    block->scales = scales;
    memcpy(scales + first, scratch->splat_scales + (size_t)splat * b->other_count, b->other_count * sizeof *scales);
    return true;
}

ca_status ca_pairs_add_splats(ca_bidirectional *b, const ca_splat_list *lists, uint32_t list_count,
                              uint32_t first_light_path, ca_error *error)
{
    CA_TRY(ca_pair_splats_add(&b->pair_splats, lists, list_count, first_light_path, error));
    for (uint32_t i = 0; i < b->other_count; i++)
        for (uint32_t l = 0; l < list_count; l++)
            CA_TRY(ca_pair_splats_add_scaled(&b->others[i].splats, &lists[l], b->blocks[l].scales + i,
                                             b->other_count, first_light_path, error));
    return CA_OK;
}

ca_status ca_pairs_sort_splats(ca_bidirectional *b, ca_error *error)
{
    CA_TRY(ca_pair_splats_sort(&b->pair_splats, error));
    for (uint32_t i = 0; i < b->other_count; i++) CA_TRY(ca_pair_splats_sort(&b->others[i].splats, error));
    return CA_OK;
}

/* ---- Pixels ---------------------------------------------------------------------------------------------------- */

ca_status ca_pairs_create(ca_bidirectional *b, ca_error *error)
{
    if (!b->input.pairs) return CA_OK;
    if (b->input.pairs->other_count > 0) CA_TRY(create_others(b, error));
    for (uint32_t i = 0; i < b->input.workers; i++) {
        CA_TRY(ca_pair_sums_create(&b->scratch[i].pairs, error));
        if (b->other_count > 0) CA_TRY(create_other_sums(b, &b->scratch[i], error));
    }
    if (b->rules.connect) CA_TRY(ca_pair_film_connect(b->input.pairs, error));
    return b->rules.splat ? ca_pair_splats_create(&b->pair_splats, b->input.crop, b->input.filter, error) : CA_OK;
}

void ca_pairs_destroy(ca_bidirectional *b)
{
    destroy_others(b);
    ca_pair_splats_destroy(&b->pair_splats);
}

void ca_pairs_begin_pixel(const void *state, ca_worker *worker)
{
    const ca_bidirectional *b = state;
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    scratch->pairing = true;
    ca_pair_sums_begin(scratch->pairs, b->light_paths);
    for (uint32_t i = 0; i < b->other_count; i++) ca_pair_sums_begin(scratch->other_pairs[i], b->light_paths);
}

void ca_pairs_next_path(const ca_bidirectional *b, ca_bidirectional_scratch *scratch)
{
    ca_pair_sums_next_path(scratch->pairs);
    for (uint32_t i = 0; i < b->other_count; i++) ca_pair_sums_next_path(scratch->other_pairs[i]);
}

static void end_pixel(const ca_bidirectional *b, uint32_t x, uint32_t y, const ca_pair_splats *splats,
                      ca_pair_sums *sums, ca_pair_film *film)
{
    if (b->rules.splat) ca_pair_splats_gather(splats, x, y, sums);
    const ca_pair_moments moments = ca_pair_sums_finish(sums);
    ca_pair_film_hold(film, x, y, &moments);
    if (!ca_pair_sums_complete(sums)) __atomic_store_n(&b->input.pairs->incomplete, true, __ATOMIC_RELAXED);
}

void ca_pairs_end_pixel(const void *state, uint32_t x, uint32_t y, ca_worker *worker)
{
    const ca_bidirectional *b = state;
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    scratch->pairing = false;
    end_pixel(b, x, y, &b->pair_splats, scratch->pairs, b->input.pairs);
    for (uint32_t i = 0; i < b->other_count; i++)
        end_pixel(b, x, y, &b->others[i].splats, scratch->other_pairs[i], &b->input.pairs->others[i]);
}

/* ---- Contributions --------------------------------------------------------------------------------------------- */

/* Of what the image gets, behind the filter's weight. */
static double luminance_of(const ca_camera_walk *walk, ca_rgb unweighted, float weight)
{
    return (double)ca_luminance(ca_rgb_scale(unweighted, weight)) * (double)walk->path->sample->filter_weight;
}

void ca_pairs_add_alone(const ca_camera_walk *walk, ca_rgb unweighted, float weight)
{
    const ca_bidirectional_scratch *scratch = walk->scratch;
    ca_pair_sums_add_alone(scratch->pairs, luminance_of(walk, unweighted, weight));
    for (uint32_t i = 0; i < walk->b->other_count; i++)
        ca_pair_sums_add_alone(scratch->other_pairs[i], luminance_of(walk, unweighted, scratch->other_weights[i]));
}

void ca_pairs_add_connection(const ca_camera_walk *walk, ca_rgb unweighted, float weight)
{
    const ca_bidirectional_scratch *scratch = walk->scratch;
    ca_pair_sums_connect(scratch->pairs, walk->paired, luminance_of(walk, unweighted, weight));
    for (uint32_t i = 0; i < walk->b->other_count; i++)
        ca_pair_sums_connect(scratch->other_pairs[i], walk->paired,
                             luminance_of(walk, unweighted, scratch->other_weights[i]));
}

/* The image gets the mean over all light paths: what the pair contributes is N_F times that. */
void ca_pairs_add_merge(const ca_camera_walk *walk, uint32_t chunk, const ca_light_record *photon, ca_rgb unweighted,
                        float weight)
{
    const ca_bidirectional *b = walk->b;
    const ca_bidirectional_scratch *scratch = walk->scratch;
    const uint32_t path = chunk * (uint32_t)CA_CHUNK_PATHS + ca_light_record_path(&b->store.layout, photon);
    ca_pair_sums_add(scratch->pairs, path, b->light_paths * luminance_of(walk, unweighted, weight));
    for (uint32_t i = 0; i < b->other_count; i++)
        ca_pair_sums_add(scratch->other_pairs[i], path,
                         b->light_paths * luminance_of(walk, unweighted, scratch->other_weights[i]));
}
