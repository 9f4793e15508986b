/* All that the image of a render by blocks depends on, but the blocks, as text: lines "name value". Part files with
 * equal texts belong together. The files a scene is made of count with their contents, not with their places. */
#ifndef CA_RENDER_PART_SETTINGS_H
#define CA_RENDER_PART_SETTINGS_H

#include "render/ranks.h"
#include "render/render.h"

/* The caller frees the text with ca_free. */
ca_status ca_part_settings_make(const ca_render_plan *plan, char **text, ca_error *error);

/* The same of a render by passes, each parameter on a line of its own. `rays`: a hash of the numbers of rays that
 * come from a file; 0: none do. Numbers that are chosen, or repeated, are no setting. */
ca_status ca_pass_settings_make(const ca_render_plan *plan, uint64_t rays, char **text, ca_error *error);

/* Gives the plan the integrator and the parameters of such a text, as they are; a file of rays that the text's render
 * had no use for is not used. `path`: the file that it is from, for the error. Errors: CA_ERROR_FORMAT. */
ca_status ca_pass_settings_use(const char *text, const char *path, ca_render_plan *plan, ca_error *error);

/* Called by all ranks. The others get rank 0's integrator and parameters, as above. The ranks have not agreed on the
 * result. */
ca_status ca_pass_settings_share(const ca_ranks *ranks, ca_render_plan *plan, ca_error *error);
/* Called by all ranks: refuses ranks whose settings (a text of the two above) differ from rank 0's, and names what
 * differs. All get the same answer. CA_ERROR_ARGUMENT. */
ca_status ca_part_settings_agree(const ca_ranks *ranks, const char *settings, ca_error *error);

/* Copies the value of a line. false, and an empty text: there is no such line, or it is longer than `size` allows. */
bool ca_part_settings_find(const char *text, const char *name, char *value, size_t size);

/* Are the texts equal? If not, *a and *b are moved to their first lines that differ. */
bool ca_part_settings_equal(const char **a, const char **b);

/* Refuses two files whose texts differ from these lines on: names what differs. CA_ERROR_ARGUMENT. */
ca_status ca_part_settings_fail(const char *first_path, const char *a, const char *path, const char *b,
                                ca_error *error);

#endif
