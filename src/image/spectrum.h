/* Spectra into colours: a list of (wavelength, value), linear in between and 0 outside, becomes linear Rec. 709 by
 * the CIE 1931 2 degree observer, tabulated every 5 nm from 360 to 830 nm. Integrals are exact for the piecewise
 * linear functions, so a narrow line is never missed.
 *
 * Colours outside of Rec. 709 have negative components; the caller decides what to do with them. Pure functions. */
#ifndef CA_IMAGE_SPECTRUM_H
#define CA_IMAGE_SPECTRUM_H

#include "math/rgb.h"

#include <stddef.h>

typedef struct ca_spectrum_sample {
    double wavelength_nm; /* strictly increasing along a list */
    double value;
} ca_spectrum_sample;

/* Seen under the CIE illuminant D65, normalised so that the constant 1 is (1, 1, 1). For reflectances,
 * transmittances and indices of refraction. */
ca_rgb ca_spectrum_reflectance(const ca_spectrum_sample *samples, size_t count);

/* The light itself, normalised so that the constant 1 has the luminance 1 (its colour is that of the equal-energy
 * spectrum, slightly reddish in Rec. 709). */
ca_rgb ca_spectrum_emission(const ca_spectrum_sample *samples, size_t count);

/* The value of a list that is not empty at a wavelength; outside of it that of the nearer end. */
double ca_spectrum_value(const ca_spectrum_sample *samples, size_t count, double wavelength_nm);

/* What a black body of that temperature radiates, in W m^-2 sr^-1 nm^-1, at the wavelengths of the observer's table;
 * and the most that it does at any wavelength. Planck's law with the constants of the SI (2019). */
enum { CA_BLACKBODY_SAMPLES = 95 };
void ca_spectrum_blackbody(double kelvin, ca_spectrum_sample samples[CA_BLACKBODY_SAMPLES]);
double ca_spectrum_blackbody_peak(double kelvin);

#endif
