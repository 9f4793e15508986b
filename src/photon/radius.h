/* The merge radius of each pass, and the default for the first.
 *
 * r^2 = r0^2 / (n / N_ref)^alpha, n counts light paths to the end of the pass, N_ref those of one pass (Keller,
 * Grünschloß, Droske, "Quasi-Monte Carlo Progressive Photon Mapping"). alpha = 0 keeps the radius, larger ones shrink
 * it faster; others write 1 - alpha for it. */
#ifndef CA_PHOTON_RADIUS_H
#define CA_PHOTON_RADIUS_H

#include <stdint.h>

/* Radius of pass `pass`, counted from 0. */
float ca_progressive_radius(float r0, float alpha, uint32_t pass);

/* The mean of pass^-alpha over the first so many passes, by which the mean merge area is smaller than that of the
 * first; within a tenth. */
double ca_progressive_mean_area(double alpha, double passes);

#endif
