#include "render/rank_sums.h"

#include "render/part_counts.h"

/* ---- Of passes ------------------------------------------------------------------------------------------------- */

static void write_film_row(void *user, uint32_t row, unsigned char *bytes)
{
    ca_film_write_row(((const ca_rank_film *)user)->film, row, bytes);
}

static bool add_film_row(void *user, uint32_t row, const unsigned char *bytes, uint64_t made)
{
    return ca_film_add_row(((const ca_rank_film *)user)->film, row, bytes, (uint32_t)made, false);
}

static void clear_film(void *user) { ca_film_clear(((const ca_rank_film *)user)->film); }

/* ---- Of blocks ------------------------------------------------------------------------------------------------- */

static void write_block_row(void *user, uint32_t row, unsigned char *bytes)
{
    ca_block_film_write_row(((const ca_rank_film *)user)->blocks, row, bytes);
}

static bool add_block_row(void *user, uint32_t row, const unsigned char *bytes, uint64_t made)
{
    (void)made;
    ca_block_film_add_row(((const ca_rank_film *)user)->blocks, row, bytes);
    return true;
}

static void clear_blocks(void *user) { ca_block_film_clear(((const ca_rank_film *)user)->blocks); }

/* ---- Both ------------------------------------------------------------------------------------------------------ */

static void count(void *user, uint64_t counts[CA_PART_COUNTS])
{
    ca_part_counts_keep(((const ca_rank_film *)user)->workers, counts);
}

ca_rank_sums ca_rank_sums_of(ca_rank_film *film)
{
    if (film->blocks) {
        const ca_block_film_desc *desc = ca_block_film_described(film->blocks);
        return (ca_rank_sums){.user = film,
                              .rows = desc->crop[3] - desc->crop[1],
                              .row_bytes = ca_block_film_row_bytes(desc),
                              .write_row = write_block_row,
                              .add_row = add_block_row,
                              .clear = clear_blocks,
                              .count = count};
    }
    return (ca_rank_sums){.user = film,
                          .rows = film->film->height,
                          .row_bytes = ca_film_row_bytes(film->film),
                          .write_row = write_film_row,
                          .add_row = add_film_row,
                          .clear = clear_film,
                          .count = count};
}
