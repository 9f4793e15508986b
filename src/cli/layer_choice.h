/* Which layers of a render's image go into its EXR files, and with how many bits.
 *
 * A name stands for the channel of this name and for all that begin with it and a dot: "Albedo", "Albedo.R",
 * "Noise". R, G and B are always written. Without names all layers are, but those that say nothing:
 *     Albedo.*, N.*, P.*                      0 everywhere: nothing was hit, or the method does not fill them
 *     Variance.*, RelativeVariance.*, StandardDeviation.Y     no pixel has two samples
 *     ConfidenceLow.*, ConfidenceHigh.*, ConfidenceWidened.*  no pixel's interval is known
 * A variance of 0 of two samples and more says that there is no noise, and stays.
 *
 * Halves are of 11 bits, which is enough for what people look at: R G B, Albedo.*, N.*. The rest stays at 32 bits: it
 * is computed with (variances, intervals, noise), counts (Samples.Y, Rays.*), or is as large as the scene (P.*). So
 * does a group with a value that no half can hold, or whose mean is so small that halves lose bits: no value becomes
 * infinite, and the error is at most 2^-11 of the value or of the group's mean, whichever is more. */
#ifndef CA_CLI_LAYER_CHOICE_H
#define CA_CLI_LAYER_CHOICE_H

#include "image/layers.h"
#include "scene/description.h"

typedef struct ca_layer_choice {
    const char *names; /* separated by commas; "all": also what says nothing; "none": R G B alone; NULL: see above */
    bool half;
} ca_layer_choice;

/* Names that a render may write, "all" and "none"; NULL behind the last one. */
const char *ca_layer_choice_name(size_t i);

/* CA_ERROR_ARGUMENT where a name is none that a render can write, with the nearest one. `integrator`: its aovs have
 * names, too; NULL: there are none. */
ca_status ca_layer_choice_check(const ca_layer_choice *choice, const ca_integrator_desc *integrator, ca_error *error);

/* *view: the chosen channels of the image, which it borrows all from. To be freed: view->channels. */
ca_status ca_layer_choice_apply(const ca_layer_choice *choice, const ca_image_layers *image, ca_image_layers *view,
                                ca_error *error);

/* Says on standard error which chosen layers the image does not have, and what could not be written with 16 bits. */
void ca_layer_choice_warn(const ca_layer_choice *choice, const ca_image_layers *image);

#endif
