/* The sums of a rank: of passes (a film) or of blocks of pairs, with what its workers have counted, as they travel
 * (rank_work.h). */
#ifndef CA_RENDER_RANK_SUMS_H
#define CA_RENDER_RANK_SUMS_H

#include "render/rank_work.h"
#include "render/workers.h"

typedef struct ca_rank_film {
    ca_film *film;         /* borrowed, likewise: */
    ca_block_film *blocks; /* instead of it */
    const ca_workers *workers;
} ca_rank_film;

/* `film` outlives them. */
ca_rank_sums ca_rank_sums_of(ca_rank_film *film);

#endif
