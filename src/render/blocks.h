/* Renders by blocks of pairs: one block after the other, each by tiles of pixels, into exact sums.
 *
 * Which blocks: the plan's range, or from the first on until every pixel has its camera paths, each with all light
 * paths so far; time and the caller may end it after any block. The sums are the same to the bit for any number of
 * threads, and parts of the range add up to the whole (part_file.h). */
#ifndef CA_RENDER_BLOCKS_H
#define CA_RENDER_BLOCKS_H

#include "film/part_file.h"
#include "render/render.h"

/* Renders a plan whose integrator has begin_block; writes the part file if the settings name one. */
ca_status ca_render_blocks(ca_render_plan *plan, ca_image_layers **image, ca_render_statistics *statistics,
                           ca_error *error);

/* The image of a part, with its attributes. */
ca_status ca_part_develop(const ca_part *part, ca_image_layers **image, ca_error *error);

/* The part's counts and what else it knows. */
void ca_part_fill_statistics(const ca_part *part, ca_render_statistics *statistics);

#endif
