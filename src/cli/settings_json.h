/* How an image was made, as JSON: what its attributes "caustica.*" say (docs/images.md). */
#ifndef CA_CLI_SETTINGS_JSON_H
#define CA_CLI_SETTINGS_JSON_H

#include "image/layers.h"

#include <jansson.h>
#include <stdbool.h>

/* Sets version, scene, integrator with all parameters, sampler, seed, threads, width and height; null: not known. An
 * attribute holds a seed of up to 2^53 only, so that it is given beside. `image` may be NULL: then only the seed is
 * known. false: out of memory. */
bool ca_settings_json_set(json_t *root, const ca_image_layers *image, uint64_t seed);

#endif
