/* How crowded with photons is a place? The number of photons in each cell of a grid, without the photons: an estimate
 * for reuse rules, not for radiance.
 *
 * A cell of sides a = 2 radius has a density of count / a^2, as if a plane crossed it through its middle.
 *
 * Cells have 32 bits of a hash for a name: one lookup in 10^9 finds the count of another cell.
 *
 * State: 8 bytes for each of two to four times the cells that hold photons, so that a lookup reads one cache line,
 * seldom two. Threads: immutable. */
#ifndef CA_PHOTON_PHOTON_DENSITY_H
#define CA_PHOTON_PHOTON_DENSITY_H

#include "photon/photon_grid.h"

typedef struct ca_photon_density ca_photon_density;

/* Of all photons of a grid, which is not needed afterwards. */
ca_status ca_photon_density_create(ca_photon_density **density, const ca_photon_grid *grid, ca_error *error);
void ca_photon_density_destroy(ca_photon_density *density); /* NULL is allowed */

/* Photons per m^2 around positions; 0 where the cell is empty. Many at a time wait for the memory together. */
void ca_photon_density_at(const ca_photon_density *density, const ca_vec3 *positions, uint32_t count,
                          float *densities);

#endif
