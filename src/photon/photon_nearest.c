/* The k-th nearest photon: the k smallest squared distances so far stand in a heap, the largest on top. */
#include "math/numeric.h"
#include "photon/photon_cells.h"

#include <assert.h>

typedef struct nearest_heap {
    float distance2[CA_PHOTON_NEAREST_MAX]; /* [i] is not below [2 i + 1] and [2 i + 2] */
    uint32_t count, capacity;
} nearest_heap;

static void push(nearest_heap *heap, float distance2)
{
    uint32_t i = heap->count++;
    for (; i > 0 && heap->distance2[(i - 1) / 2] < distance2; i = (i - 1) / 2)
        heap->distance2[i] = heap->distance2[(i - 1) / 2];
    heap->distance2[i] = distance2;
}

static void replace_top(nearest_heap *heap, float distance2)
{
    uint32_t i = 0;
    for (uint32_t child; (child = 2 * i + 1) < heap->count; i = child) {
        if (child + 1 < heap->count && heap->distance2[child + 1] > heap->distance2[child]) child++;
        if (heap->distance2[child] <= distance2) break;
        heap->distance2[i] = heap->distance2[child];
    }
    heap->distance2[i] = distance2;
}

static void add_block(nearest_heap *heap, const ca_photon_block *block, const ca_photon_query *query, uint32_t first,
                      uint32_t end)
{
    const uint32_t lanes = query->exact ? ca_photon_lanes_in_cell(query, block) : 0xffu;
    float distance2[CA_PHOTON_LANES];
    for (uint32_t i = 0; i < CA_PHOTON_LANES; i++)
        distance2[i] = ca_length2(ca_sub((ca_vec3){block->x[i], block->y[i], block->z[i]}, query->position));
    for (uint32_t i = first; i < end; i++) {
        if (!(lanes >> i & 1)) continue;
        if (heap->count == heap->capacity) {
            if (distance2[i] < heap->distance2[0]) replace_top(heap, distance2[i]);
        } else if (distance2[i] <= query->radius2)
            push(heap, distance2[i]);
    }
}

float ca_photon_grid_nearest(const ca_photon_grid *grid, ca_vec3 position, uint32_t k)
{
    assert(k >= 1 && k <= CA_PHOTON_NEAREST_MAX);
    ca_photon_query query;
    ca_photon_query_start(&query, grid, position);
    nearest_heap heap;
    heap.count = 0;
    heap.capacity = k;
    for (; query.range < query.range_count; query.range++)
        for (uint32_t next = query.begin[query.range]; next < query.end[query.range];
             next = (next / CA_PHOTON_LANES + 1) * CA_PHOTON_LANES) {
            const uint32_t lane = next % CA_PHOTON_LANES;
            const uint32_t end = ca_min_u32(CA_PHOTON_LANES, query.end[query.range] - (next - lane));
            add_block(&heap, &grid->blocks[next / CA_PHOTON_LANES], &query, lane, end);
        }
    return heap.count == k ? sqrtf(heap.distance2[0]) : INFINITY;
}
