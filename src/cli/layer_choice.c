#include "cli/layer_choice.h"
#include "cli/say.h"

#include "base/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double half_largest = 65504.0, half_smallest_normal = 0x1p-14;

/* What renders by passes and by blocks write: groups, then channels. */
static const char *const known_names[] = {
    "Albedo", "N", "P", "Variance", "RelativeVariance", "StandardDeviation", "Samples", "ConfidenceLow",
    "ConfidenceHigh", "ConfidenceWidened", "Noise", "Rays", "Pairs", "IrradianceGradient", "ValueVariance", "R",
    "G", "B", "Albedo.R", "Albedo.G", "Albedo.B", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "Variance.R",
    "Variance.G", "Variance.B", "RelativeVariance.R", "RelativeVariance.G", "RelativeVariance.B",
    "StandardDeviation.Y", "Samples.Y", "ConfidenceLow.R", "ConfidenceLow.G", "ConfidenceLow.B",
    "ConfidenceLow.Y", "ConfidenceHigh.R", "ConfidenceHigh.G", "ConfidenceHigh.B", "ConfidenceHigh.Y",
    "ConfidenceWidened.R", "ConfidenceWidened.G", "ConfidenceWidened.B", "ConfidenceWidened.Y", "Noise.Camera",
    "Noise.Light", "Noise.Pair", "Rays.Camera", "Rays.Numbers", "Pairs.Y", "IrradianceGradient.X",
    "IrradianceGradient.Y", "IrradianceGradient.Z", "ValueVariance.Y", "all", "none"
};
enum { KNOWN_NAMES = sizeof known_names / sizeof known_names[0], LAYER_NAME_SIZE = 64 };

const char *ca_layer_choice_name(size_t i) { return i < KNOWN_NAMES ? known_names[i] : NULL; }

/* ---- Names ----------------------------------------------------------------------------------------------------- */

/* The next name of the list, cut to the buffer; false at its end. */
static bool next_name(const char **list, char name[LAYER_NAME_SIZE])
{
    if (!*list) return false;
    const size_t length = strcspn(*list, ",");
    snprintf(name, LAYER_NAME_SIZE, "%.*s", (int)length, *list);
    *list = (*list)[length] ? *list + length + 1 : NULL;
    return true;
}

/* Is it the channel itself, or what its name begins with? */
static bool stands_for(const char *name, const char *channel)
{
    const size_t length = strlen(name);
    return strncmp(channel, name, length) == 0 && (channel[length] == '\0' || channel[length] == '.');
}

static bool is_listed(const ca_layer_choice *choice, const char *channel)
{
    char name[LAYER_NAME_SIZE];
    const char *list = choice->names;
    while (next_name(&list, name))
        if (strcmp(name, "all") == 0 || stands_for(name, channel)) return true;
    return false;
}

/* The aov itself, what its name begins with, or a channel of it. */
static bool is_aov(const ca_integrator_desc *integrator, const char *name)
{
    for (size_t i = 0; integrator && i < integrator->aovs.count; i++) {
        const char *aov = integrator->aovs.items[i].name;
        if (stands_for(name, aov) || stands_for(aov, name)) return true;
    }
    return false;
}

ca_status ca_layer_choice_check(const ca_layer_choice *choice, const ca_integrator_desc *integrator, ca_error *error)
{
    char name[LAYER_NAME_SIZE];
    const char *list = choice->names;
    while (next_name(&list, name)) {
        size_t i = 0;
        while (i < KNOWN_NAMES && strcmp(name, known_names[i]) != 0) i++;
        if (i < KNOWN_NAMES || is_aov(integrator, name)) continue;
        const char *nearest = ca_nearest_name_however_far(name, known_names, KNOWN_NAMES);
        return ca_fail(error, CA_ERROR_ARGUMENT, NULL,
                       "--layers: there is no layer \"%s\"; did you mean \"%s\"? (docs/images.md lists them)", name,
                       nearest);
    }
    return CA_OK;
}

/* ---- Layers that say nothing ----------------------------------------------------------------------------------- */

static bool is_of_group(const char *channel, const char *const *groups, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (stands_for(groups[i], channel)) return true;
    return false;
}

static size_t layer_pixels(const ca_image_layers *image) { return (size_t)image->width * image->height; }

/* Has the whole group of the channel only zeros? */
static bool group_is_zero(const ca_image_layers *image, const char *channel)
{
    char group[LAYER_NAME_SIZE];
    snprintf(group, sizeof group, "%.*s", (int)strcspn(channel, "."), channel);
    for (size_t c = 0; c < image->channel_count; c++) {
        if (!stands_for(group, image->channels[c].name)) continue;
        for (size_t i = 0; i < layer_pixels(image); i++)
            if (image->channels[c].data[i] != 0.0f) return false;
    }
    return true;
}

static bool has_two_samples(const ca_image_layers *image)
{
    const float *samples = ca_layers_find(image, "Samples.Y");
    for (size_t i = 0; samples && i < layer_pixels(image); i++)
        if (samples[i] >= 2.0f) return true;
    return !samples;
}

/* Is no pixel's interval known, of the colour that a Confidence*.* channel is of? */
static bool no_interval_is_known(const ca_image_layers *image, const char *channel)
{
    char name[LAYER_NAME_SIZE];
    snprintf(name, sizeof name, "ConfidenceLow%s", channel + strcspn(channel, "."));
    const float *low = ca_layers_find(image, name);
    for (size_t i = 0; low && i < layer_pixels(image); i++)
        if (!isinf(low[i])) return false;
    return low != NULL;
}

static bool says_nothing(const ca_image_layers *image, const ca_channel *channel)
{
    static const char *const hits[] = {"Albedo", "N", "P"},
                      *const intervals[] = {"ConfidenceLow", "ConfidenceHigh", "ConfidenceWidened"},
                      *const variances[] = {"Variance", "RelativeVariance", "StandardDeviation"};
    if (is_of_group(channel->name, hits, 3)) return group_is_zero(image, channel->name);
    if (is_of_group(channel->name, variances, 3)) return !has_two_samples(image);
    return is_of_group(channel->name, intervals, 3) && no_interval_is_known(image, channel->name);
}

/* ---- Halves ---------------------------------------------------------------------------------------------------- */

/* Channels that are looked at together; each has its own ranges. */
static const char *const half_groups[][3] = {{"R", "G", "B"}, {"Albedo.R", "Albedo.G", "Albedo.B"},
                                             {"N.X", "N.Y", "N.Z"}};
enum { HALF_GROUPS = sizeof half_groups / sizeof half_groups[0] };

typedef struct half_range {
    double largest, mean; /* of the finite magnitudes; 0: there are none, or all are 0 */
} half_range;

static half_range range_of(const ca_image_layers *image, const char *const names[3])
{
    half_range range = {0.0, 0.0};
    double sum = 0.0, count = 0.0;
    for (int c = 0; c < 3; c++) {
        const float *data = ca_layers_find(image, names[c]);
        for (size_t i = 0; data && i < layer_pixels(image); i++) {
            if (!isfinite(data[i])) continue;
            const double magnitude = fabs((double)data[i]);
            range.largest = fmax(range.largest, magnitude);
            sum += magnitude;
            count++;
        }
    }
    range.mean = count > 0.0 ? sum / count : 0.0;
    return range;
}

static bool fits_halves(half_range range)
{
    return range.largest <= half_largest && (range.largest == 0.0 || range.mean >= half_smallest_normal);
}

static void halve(const ca_image_layers *image, ca_image_layers *view)
{
    for (int g = 0; g < HALF_GROUPS; g++) {
        if (!fits_halves(range_of(image, half_groups[g]))) continue;
        for (size_t c = 0; c < view->channel_count; c++)
            if (is_of_group(view->channels[c].name, half_groups[g], 3)) view->channels[c].half = true;
    }
}

/* ---- The choice ------------------------------------------------------------------------------------------------ */

ca_status ca_layer_choice_apply(const ca_layer_choice *choice, const ca_image_layers *image, ca_image_layers *view,
                                ca_error *error)
{
    static const char *const colors[] = {"R", "G", "B"};
    ca_channel *chosen = ca_alloc(image->channel_count, sizeof *chosen);
    if (!chosen) return ca_fail_memory(error, "image layers");
    *view = *image;
    view->channels = chosen;
    view->channel_count = 0;
    for (size_t c = 0; c < image->channel_count; c++) {
        const ca_channel *channel = &image->channels[c];
        const bool wanted = choice->names ? is_listed(choice, channel->name) : !says_nothing(image, channel);
        if (wanted || is_of_group(channel->name, colors, 3)) chosen[view->channel_count++] = *channel;
    }
    if (choice->half) halve(image, view);
    return CA_OK;
}

static void warn_of_missing(const ca_layer_choice *choice, const ca_image_layers *image)
{
    char name[LAYER_NAME_SIZE];
    const char *list = choice->names;
    while (next_name(&list, name)) {
        bool found = strcmp(name, "all") == 0 || strcmp(name, "none") == 0;
        for (size_t c = 0; c < image->channel_count; c++) found = found || stands_for(name, image->channels[c].name);
        if (!found) ca_say(stderr, "caustica: warning: --layers: this image has no layer %s\n", name);
    }
}

void ca_layer_choice_warn(const ca_layer_choice *choice, const ca_image_layers *image)
{
    ca_image_layers view;
    warn_of_missing(choice, image);
    if (!choice->half || ca_layer_choice_apply(choice, image, &view, NULL) != CA_OK) return;
    for (int g = 0; g < HALF_GROUPS; g++) {
        const half_range range = range_of(image, half_groups[g]);
        if (!ca_layers_find(&view, half_groups[g][0]) || fits_halves(range)) continue;
        fprintf(stderr, "caustica: warning: --half: %s %s %s stay at 32 bits: ", half_groups[g][0], half_groups[g][1],
                half_groups[g][2]);
        if (range.largest > half_largest)
            fprintf(stderr, "their largest value is %.6g, of 16 bits 65504\n", range.largest);
        else
            fprintf(stderr, "their mean, %.3g, is too small for 16 bits\n", range.mean);
    }
    ca_free(view.channels);
}
