/* Noise components as layers of an image, and as a picture.
 *
 * Layers: Noise.Camera, Noise.Light, Noise.Pair (the terms of the law, components.h), where paths are connected
 * Noise.Connect, Noise.Predicted (their sum), Noise.Measured (the sample variance), each with its standard error as
 * X.StdErr: variances of the luminance of one iteration, negative where their estimates are. The picture is made like
 * figure 3 of Ershov et al. 2020: the roots of the pair, camera and light term as red, green and blue. */
#ifndef CA_NOISE_LAYERS_H
#define CA_NOISE_LAYERS_H

#include "image/layers.h"
#include "noise/components.h"

/* Adds the layers to an image of the same part of the film, for the numbers of paths that the iterations had. */
ca_status ca_noise_add_layers(const ca_pair_film *film, ca_image_layers *image, ca_error *error);

/* What that takes; `connects`: film->connections will be there. */
size_t ca_noise_layers_bytes(const ca_pair_film *film, bool connects);

/* A new image R G B from the layers: roots, negative terms as zero, divided by *scale (W sr^-1 m^-2), which is the
 * 99th percentile over pixels of the largest of a pixel's three; 1 where that is zero. Takes CA_NOISE_PICTURE_BYTES a
 * pixel, of which the picture keeps three quarters. */
enum { CA_NOISE_PICTURE_BYTES = 4 * (int)sizeof(float) };
ca_status ca_noise_picture(const ca_image_layers *image, ca_image_layers **picture, double *scale, ca_error *error);

#endif
