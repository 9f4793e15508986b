/* What pairs of light and camera paths contribute, for the noise components (film/pair_sums.h). */
#include "integrator/bidirectional.h"

#include <assert.h>

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

ca_status ca_pairs_create(ca_bidirectional *b, ca_error *error)
{
    for (uint32_t i = 0; b->input.pairs && i < b->input.workers; i++)
        CA_TRY(ca_pair_sums_create(&b->scratch[i].pairs, error));
    if (b->input.pairs && b->rules.connect) CA_TRY(ca_pair_film_connect(b->input.pairs, error));
    if (b->input.pairs && b->rules.splat)
        CA_TRY(ca_pair_splats_create(&b->pair_splats, b->input.crop, b->input.filter, error));
    return CA_OK;
}

void ca_pairs_begin_pixel(const void *state, ca_worker *worker)
{
    const ca_bidirectional *b = state;
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    scratch->pairing = true;
    ca_pair_sums_begin(scratch->pairs, b->light_paths);
}

void ca_pairs_end_pixel(const void *state, uint32_t x, uint32_t y, ca_worker *worker)
{
    const ca_bidirectional *b = state;
    ca_bidirectional_scratch *scratch = &b->scratch[worker->index];
    scratch->pairing = false;
    if (b->rules.splat) ca_pair_splats_gather(&b->pair_splats, x, y, scratch->pairs);
    const ca_pair_moments moments = ca_pair_sums_finish(scratch->pairs);
    ca_pair_film_hold(b->input.pairs, x, y, &moments);
    if (!ca_pair_sums_complete(scratch->pairs)) __atomic_store_n(&b->input.pairs->incomplete, true, __ATOMIC_RELAXED);
}

/* Of what the image gets, behind the filter's weight. */
static double luminance_of(const ca_camera_walk *walk, ca_rgb unweighted, float weight)
{
    return (double)ca_luminance(ca_rgb_scale(unweighted, weight)) * (double)walk->path->sample->filter_weight;
}

void ca_pairs_add_alone(const ca_camera_walk *walk, ca_rgb unweighted, float weight)
{
    ca_pair_sums_add_alone(walk->scratch->pairs, luminance_of(walk, unweighted, weight));
}

void ca_pairs_add_connection(const ca_camera_walk *walk, ca_rgb unweighted, float weight)
{
    ca_pair_sums_connect(walk->scratch->pairs, walk->paired, luminance_of(walk, unweighted, weight));
}

/* The image gets the mean over all light paths: what the pair contributes is N_F times that. */
void ca_pairs_add_merge(const ca_camera_walk *walk, uint32_t chunk, const ca_light_record *photon, ca_rgb unweighted,
                        float weight)
{
    const ca_bidirectional *b = walk->b;
    const uint32_t path = ca_light_record_path(&b->store.layout, photon);
    ca_pair_sums_add(walk->scratch->pairs, chunk * (uint32_t)CA_CHUNK_PATHS + path,
                     b->light_paths * luminance_of(walk, unweighted, weight));
}
