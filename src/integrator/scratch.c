/* What workers need for their batches of walks. */
#include "integrator/bidirectional.h"

#include "base/memory.h"

/* Vertices of a path, and so many bytes that rows do not begin in the same sets of a cache. */
static uint32_t row_of(const ca_bidirectional *b)
{
    const uint32_t longest = b->max_depth < CA_PATH_MAX_VERTICES ? b->max_depth + 2 : CA_PATH_MAX_VERTICES;
    return longest | 1;
}

static bool create_joins(ca_bidirectional_scratch *scratch)
{
    scratch->light_ends = ca_alloc_large(1, sizeof *scratch->light_ends);
    scratch->next_events = ca_alloc_large(CA_RAY_BATCH, sizeof *scratch->next_events);
    scratch->connections = ca_alloc_large(CA_RAY_BATCH, sizeof *scratch->connections);
    scratch->merged = ca_alloc_large(CA_PATH_MAX_VERTICES, sizeof *scratch->merged);
    return scratch->light_ends && scratch->next_events && scratch->connections && scratch->merged;
}

/* For the observer. */
static bool create_points(ca_bidirectional_scratch *scratch)
{
    scratch->points = ca_alloc((size_t)CA_WALKS * scratch->row, sizeof *scratch->points);
    scratch->seen = ca_alloc(CA_PATH_MAX_VERTICES, sizeof *scratch->seen);
    return scratch->points && scratch->seen;
}

ca_status ca_bidirectional_scratch_create(ca_bidirectional_scratch *scratch, const ca_bidirectional *b,
                                          ca_error *error)
{
    const size_t vertices = (size_t)CA_WALKS * row_of(b);
    scratch->row = row_of(b);
    scratch->camera_walks = ca_alloc_large(CA_WALKS, sizeof *scratch->camera_walks);
    scratch->light_walks = ca_alloc_large(CA_WALKS, sizeof *scratch->light_walks);
    scratch->densities = ca_alloc_large(vertices, sizeof *scratch->densities);
    scratch->vertices = ca_alloc_large(vertices, sizeof *scratch->vertices);
    scratch->rays = ca_alloc_large(1, sizeof *scratch->rays);
    const bool fits = scratch->camera_walks && scratch->light_walks && scratch->densities && scratch->vertices &&
                      scratch->rays && create_joins(scratch) && (!b->input.observer || create_points(scratch));
    return fits ? CA_OK : ca_fail_memory(error, "the integrator");
}

ca_status ca_bidirectional_scratch_add_chunks(ca_bidirectional_scratch *scratch, const ca_bidirectional *b,
                                              ca_error *error)
{
    const size_t chunks = (size_t)CA_WALKS * (b->resident + 1), words = (size_t)CA_WALKS * ca_chunk_words(b);
    scratch->chunk_light = ca_alloc_zeroed(chunks, sizeof *scratch->chunk_light);
    scratch->chunk_used = ca_alloc_zeroed(words, sizeof *scratch->chunk_used);
    return scratch->chunk_light && scratch->chunk_used ? CA_OK : ca_fail_memory(error, "the integrator");
}

void ca_bidirectional_scratch_destroy(ca_bidirectional_scratch *scratch)
{
    ca_free(scratch->camera_walks);
    ca_free(scratch->light_walks);
    ca_free(scratch->densities);
    ca_free(scratch->vertices);
    ca_free(scratch->points);
    ca_free(scratch->merged);
    ca_free(scratch->seen);
    ca_splat_list_destroy(&scratch->splats);
    ca_free(scratch->splat_next);
    ca_free(scratch->light_ends);
    ca_free(scratch->rays);
    ca_free(scratch->next_events);
    ca_free(scratch->connections);
    ca_free(scratch->chunk_light);
    ca_free(scratch->chunk_used);
    ca_pair_sums_destroy(scratch->pairs);
    ca_free(scratch->other_weights);
    ca_free(scratch->splat_scales);
}
