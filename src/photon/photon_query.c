/* Queries: which buckets, then the distance test over their photons, eight at a time. */
#include "math/numeric.h"
#include "photon/photon_cells.h"

#include <assert.h>

#if defined(__AVX2__) && !defined(CA_PHOTON_PLAIN)
#include <immintrin.h>
#endif

/* ---- Which buckets --------------------------------------------------------------------------------------------- */

static inline void add_range(ca_photon_query *query, uint32_t bucket, uint32_t bucket_count)
{
    const uint32_t *starts = query->grid->starts;
    const uint32_t begin = starts[bucket], end = starts[bucket + bucket_count];
    query->begin[query->range_count] = begin;
    query->end[query->range_count] = end;
    query->range_count += begin != end;
    query->tested += end - begin;
    __builtin_prefetch(&query->grid->blocks[begin / CA_PHOTON_LANES]);
}

/* The cells from position - reach to position + reach: rows of one or two along x. `reach` is the grid's at most. */
typedef struct query_rows {
    uint32_t first[3], last[3];
    uint32_t row[4], row_count, row_length;
} query_rows;

/* Where rows of cells fell upon each other, or run on from the last bucket to the first: cell by cell, so that the
 * order is the same as where they do not. */
static void add_cells_singly(ca_photon_query *query, const query_rows *rows)
{
    const ca_photon_lattice *lattice = &query->grid->lattice;
    query->exact = true;
    for (uint32_t z = rows->first[2]; z <= rows->last[2]; z++)
        for (uint32_t y = rows->first[1]; y <= rows->last[1]; y++)
            for (uint32_t x = rows->first[0]; x <= rows->last[0]; x++) {
                uint32_t *cell = query->cell[query->range_count];
                cell[0] = x, cell[1] = y, cell[2] = z;
                add_range(query, (ca_photon_row(y, z) + x) & lattice->bucket_mask, 1);
            }
}

/* Are two rows of cells nowhere in the same bucket, and none wrapped around? */
static inline bool rows_are_apart(const query_rows *rows, uint32_t mask)
{
    bool apart = true;
    for (uint32_t r = 0; r < rows->row_count; r++) {
        apart &= rows->row[r] + rows->row_length - 1 <= mask;
        for (uint32_t s = 0; s < r; s++) apart &= ((rows->row[r] - rows->row[s] + 1) & mask) > 2;
    }
    return apart;
}

/* false: there are no photons. */
static inline bool find_rows(const ca_photon_grid *grid, ca_vec3 position, double reach, query_rows *rows)
{
    const ca_photon_lattice *lattice = &grid->lattice;
    if (grid->count == 0) return false;
    const double center[3] = {(double)position.x, (double)position.y, (double)position.z};
    for (int axis = 0; axis < 3; axis++) {
        rows->first[axis] = ca_photon_cell(lattice, axis, center[axis] - reach);
        rows->last[axis] = ca_photon_cell(lattice, axis, center[axis] + reach);
        assert(rows->last[axis] - rows->first[axis] <= 1);
    }
    rows->row_length = rows->last[0] - rows->first[0] + 1;
    rows->row_count = 0;
    for (uint32_t z = rows->first[2]; z <= rows->last[2]; z++)
        for (uint32_t y = rows->first[1]; y <= rows->last[1]; y++)
            rows->row[rows->row_count++] = (ca_photon_row(y, z) + rows->first[0]) & lattice->bucket_mask;
    return true;
}

void ca_photon_grid_prefetch(const ca_photon_grid *grid, ca_vec3 position)
{
    query_rows rows;
    if (!find_rows(grid, position, grid->lattice.reach, &rows)) return;
    for (uint32_t r = 0; r < rows.row_count; r++) __builtin_prefetch(&grid->starts[rows.row[r]]);
}

static inline void start(ca_photon_query *query, const ca_photon_grid *grid, ca_vec3 position, float radius2,
                         double reach)
{
    query->grid = grid;
    query->position = position;
    query->radius2 = radius2;
    query->range_count = query->range = 0;
    query->exact = false;
    query->tested = 0;
    query_rows rows;
    if (!find_rows(grid, position, reach, &rows)) return;
    if (!rows_are_apart(&rows, grid->lattice.bucket_mask))
        add_cells_singly(query, &rows);
    else
        for (uint32_t r = 0; r < rows.row_count; r++) add_range(query, rows.row[r], rows.row_length);
}

void ca_photon_query_start(ca_photon_query *query, const ca_photon_grid *grid, ca_vec3 position)
{
    start(query, grid, position, grid->radius2, grid->lattice.reach);
}

void ca_photon_query_start_within(ca_photon_query *query, const ca_photon_grid *grid, ca_vec3 position, float radius)
{
    assert(radius >= 0.0f && (grid->count == 0 || radius <= grid->radius));
    start(query, grid, position, radius * radius, ca_photon_reach(radius));
}

/* ---- The distance test ----------------------------------------------------------------------------------------- */

/* Of the block's eight photons the lanes set in `lanes` are tested; the vertices of those within the radius go to
 * `found`, which has room for eight. Returns how many. Both versions compute the same bits in the same order. */
#if defined(__AVX2__) && !defined(CA_PHOTON_PLAIN)

/* Moves the lanes set in a mask of four to the front. */
static const int32_t lane_order[16][4] = {{0}, {0}, {1}, {0, 1}, {2}, {0, 2}, {1, 2}, {0, 1, 2},
                                          {3}, {0, 3}, {1, 3}, {0, 1, 3}, {2, 3}, {0, 2, 3}, {1, 2, 3}, {0, 1, 2, 3}};

static inline uint32_t keep_lanes(__m128i vertices, uint32_t lanes, uint32_t *found)
{
    const __m128i order = _mm_loadu_si128((const __m128i *)(const void *)lane_order[lanes]);
    const __m128 moved = _mm_permutevar_ps(_mm_castsi128_ps(vertices), order);
    _mm_storeu_si128((__m128i *)(void *)found, _mm_castps_si128(moved));
    return (uint32_t)__builtin_popcount(lanes);
}

static inline uint32_t test_block(const ca_photon_block *block, ca_vec3 position, float radius2, uint32_t lanes,
                                  uint32_t *found)
{
    const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(block->x), _mm256_set1_ps(position.x));
    const __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(block->y), _mm256_set1_ps(position.y));
    const __m256 dz = _mm256_sub_ps(_mm256_loadu_ps(block->z), _mm256_set1_ps(position.z));
    const __m256 across2 = _mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy));
    const __m256 distance2 = _mm256_add_ps(across2, _mm256_mul_ps(dz, dz));
    const __m256 within = _mm256_cmp_ps(distance2, _mm256_set1_ps(radius2), _CMP_LE_OQ);
    const uint32_t kept = (uint32_t)_mm256_movemask_ps(within) & lanes;
    const __m256i vertices = _mm256_loadu_si256((const __m256i *)(const void *)block->vertex);
    const uint32_t count = keep_lanes(_mm256_castsi256_si128(vertices), kept & 15, found);
    return count + keep_lanes(_mm256_extracti128_si256(vertices, 1), kept >> 4, found + count);
}

#else

static inline uint32_t test_block(const ca_photon_block *block, ca_vec3 position, float radius2, uint32_t lanes,
                                  uint32_t *found)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < CA_PHOTON_LANES; i++) {
        const ca_vec3 d = ca_sub((ca_vec3){block->x[i], block->y[i], block->z[i]}, position);
        found[count] = block->vertex[i];
        count += (ca_length2(d) <= radius2) & (lanes >> i & 1);
    }
    return count;
}

#endif

uint32_t ca_photon_query_next(ca_photon_query *query, uint32_t vertices[CA_PHOTON_BATCH])
{
    const ca_photon_block *blocks = query->grid->blocks;
    const ca_vec3 position = query->position;
    const float radius2 = query->radius2;
    uint32_t count = 0;
    for (; query->range < query->range_count; query->range++) {
        const uint32_t end = query->end[query->range];
        uint32_t next = query->begin[query->range];
        while (next < end) {
            if (count > CA_PHOTON_BATCH - CA_PHOTON_LANES) {
                query->begin[query->range] = next;
                return count;
            }
            const uint32_t lane = next % CA_PHOTON_LANES;
            const uint32_t beyond = ca_min_u32(CA_PHOTON_LANES, end - (next - lane));
            uint32_t lanes = 0xffu >> (CA_PHOTON_LANES - beyond) & 0xffu << lane;
            if (query->exact) lanes &= ca_photon_lanes_in_cell(query, &blocks[next / CA_PHOTON_LANES]);
            count += test_block(&blocks[next / CA_PHOTON_LANES], position, radius2, lanes, vertices + count);
            next += CA_PHOTON_LANES - lane;
        }
    }
    return count;
}
