/* Materials of lenses by name: glasses of Schott's catalogue and what else lenses are made of.
 *
 * index is that of the yellow line d of helium, 587.56 nm, in air; abbe is (nd - 1) / (nF - nC), 0 where there is
 * none. They are Schott's published values (optical glass catalogue, state of 2022); of other materials those of the
 * dispersion formulas that lens_glass.c cites, at room temperature. */
#ifndef CA_IMPORT_LENS_GLASS_H
#define CA_IMPORT_LENS_GLASS_H

#include <stddef.h>

typedef struct ca_lens_glass {
    const char *name;
    double index, abbe;
} ca_lens_glass;

/* Case does not count, nor do hyphens and underscores. A glass of old that the table has only as its successor
 * without lead, with "N-", is that one: nd is the same to some 1e-4. NULL: there is none. */
const ca_lens_glass *ca_lens_glass_find(const char *name, size_t length);

/* The name most like this one. */
const char *ca_lens_glass_nearest(const char *name, size_t length);

/* One after another; NULL behind the last one. */
const ca_lens_glass *ca_lens_glass_at(size_t i);

#endif
