#include "support/interval_tally.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const float *channel_of(const ca_image_layers *image, const char *prefix, const char *channel)
{
    char name[32];
    snprintf(name, sizeof name, "%s%s", prefix, channel);
    const float *data = ca_image_channel(image, name);
    if (!data) fail_msg("no channel %s", name);
    return data;
}

static void judge(interval_tally *tally, double mean, double others, double low, double high, double wider,
                  bool widened)
{
    const double rounding = 4e-6 * fabs(mean);
    tally->pixels++;
    if (low == -HUGE_VAL || high == HUGE_VAL) {
        assert_true(low == -HUGE_VAL && high == HUGE_VAL);
        tally->marked++;
    } else if (widened) {
        tally->widened++;
        tally->widened_held += others >= mean - wider * (mean - low) && others <= mean + wider * (high - mean);
    } else if (high - low <= rounding && fabs(others - mean) <= rounding) {
        tally->constant++;
    } else if (others < mean - wider * (mean - low)) {
        tally->below++;
    } else if (others > mean + wider * (high - mean)) {
        tally->above++;
    } else {
        tally->held++;
    }
}

interval_tally tally_intervals(const ca_scene *scene, const ca_render_settings *settings, int renders,
                               const char *channel)
{
    ca_image_layers *images[INTERVAL_TALLY_RENDERS] = {NULL};
    interval_tally tally = {0};
    uint32_t width = 0, height = 0;
    for (int r = 0; r < renders; r++) {
        ca_render_settings own = *settings;
        ca_error error = {""};
        own.has_seed = true;
        own.seed = settings->seed + (uint64_t)r;
        if (ca_render(scene, &own, &images[r], NULL, &error) != CA_OK) fail_msg("%s", error.message);
    }
    ca_image_size(images[0], &width, &height);
    for (size_t i = 0; i < (size_t)width * height; i++) {
        double sum = 0.0;
        for (int r = 0; r < renders; r++) sum += (double)channel_of(images[r], "", channel)[i];
        for (int r = 0; r < renders; r++) {
            const double mean = (double)channel_of(images[r], "", channel)[i];
            judge(&tally, mean, (sum - mean) / (renders - 1.0),
                  (double)channel_of(images[r], "ConfidenceLow.", channel)[i],
                  (double)channel_of(images[r], "ConfidenceHigh.", channel)[i], sqrt(1.0 + 1.0 / (renders - 1.0)),
                  channel_of(images[r], "ConfidenceWidened.", channel)[i] == 1.0f);
        }
    }
    for (int r = 0; r < renders; r++) ca_image_release(images[r]);
    return tally;
}

double tally_fraction(const interval_tally *tally)
{
    const uint64_t judged = tally->held + tally->below + tally->above;
    return judged > 0 ? (double)tally->held / (double)judged : (double)NAN;
}

double tally_widened_fraction(const interval_tally *tally)
{
    return tally->widened > 0 ? (double)tally->widened_held / (double)tally->widened : (double)NAN;
}
