/* What a rough dielectric boundary lets through, tabulated for a fixed roughness and index: rough plastics need it
 * for the light that reaches their diffuse base.
 *
 * transmittance(c): share of light from the outside, at the angle whose cosine is c, that gets to the inside in one
 * scattering event (light that bounces between facets is lost, as in the rough dielectric itself).
 * Made by quadrature, some milliseconds each; looking up takes one root. Immutable, may be shared by threads.
 * Owned by whoever creates it. */
#ifndef CA_MATERIAL_ROUGH_TRANSMITTANCE_H
#define CA_MATERIAL_ROUGH_TRANSMITTANCE_H

#include "material/bxdf.h"

typedef struct ca_rough_transmittance ca_rough_transmittance;

/* eta: interior over exterior index. NULL when out of memory. */
ca_rough_transmittance *ca_rough_transmittance_create(ca_microfacet_kind kind, float alpha, float eta);
void ca_rough_transmittance_destroy(ca_rough_transmittance *table); /* NULL is allowed */

/* cos_out in [0, 1], on the outside. */
float ca_rough_transmittance_eval(const ca_rough_transmittance *table, float cos_out);

/* Share of diffuse light from the inside that the boundary lets pass: the rough plastic's `internal_transmittance`.
 * With that of the smooth boundary a rough plastic could give back more than it gets. Of indices over 2, where what
 * passes is less than what an integral of the reflected light resolves, it is that from the outside over the square
 * of the index. */
float ca_rough_transmittance_from_inside(const ca_rough_transmittance *table);

#endif
