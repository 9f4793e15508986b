/* The independent replicates of a render by passes, which its error bars come from (film/confidence.h).
 *
 * With the sampler `independent` each pass is one, or each group of passes where a number of replicates was asked
 * for; the numbers of paths are the same either way. The passes of a low-discrepancy sequence depend on each other:
 * there are replicates only where their number was asked for, and each begins the sequence again with a scrambling of
 * its own. Each also begins again with the first radius, so that all are distributed alike. */
#ifndef CA_RENDER_REPLICATES_H
#define CA_RENDER_REPLICATES_H

#include "render/render.h"

/* Checks what was asked for, and plans it. Errors: CA_ERROR_ARGUMENT. */
ca_status ca_replicates_plan(ca_render_plan *plan, ca_error *error);

/* Passes of a replicate, as ca_film_set_replicates wants them; 0: the passes are not independent. */
uint32_t ca_replicates_passes(const ca_render_plan *plan);

/* Makes ready for a pass (in order, from 0), and says which number it has in its replicate's sequence. */
uint32_t ca_replicates_begin_pass(ca_render_plan *plan, uint32_t pass);

/* Says for an image's record what its intervals are of, or why there are none. */
void ca_replicates_describe(const ca_render_plan *plan, uint32_t passes, char *text, size_t size);

#endif
