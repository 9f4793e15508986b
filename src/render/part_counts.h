/* What a render has counted, as part files keep it. */
#ifndef CA_RENDER_PART_COUNTS_H
#define CA_RENDER_PART_COUNTS_H

#include "film/part_file.h"
#include "render/workers.h"

/* Of what has been counted; of workers. */
void ca_part_counts_of(const ca_render_statistics *statistics, uint64_t counts[CA_PART_COUNTS]);
void ca_part_counts_keep(const ca_workers *workers, uint64_t counts[CA_PART_COUNTS]);
/* Adds them to the statistics. */
void ca_part_counts_fill(const uint64_t counts[CA_PART_COUNTS], ca_render_statistics *statistics);

#endif
