#include "film/interval_layers.h"

#include <math.h>
#include <stdio.h>

static ca_status add_layer(ca_image_layers *layers, const char *kind, char channel, float **data, ca_error *error)
{
    char name[32];
    snprintf(name, sizeof name, "Confidence%s.%c", kind, channel);
    return ca_layers_add(layers, name, data, error);
}

ca_status ca_interval_layers_add(ca_interval_layers *intervals, ca_image_layers *layers, char channel,
                                 ca_error *error)
{
    CA_TRY(add_layer(layers, "Low", channel, &intervals->low, error));
    CA_TRY(add_layer(layers, "High", channel, &intervals->high, error));
    return add_layer(layers, "Widened", channel, &intervals->widened, error);
}

void ca_interval_layers_set(const ca_interval_layers *intervals, size_t i, const ca_moments *moments,
                            const ca_verdict *verdict, double quantile)
{
    const ca_interval interval = ca_confidence_judged_interval(moments, verdict, quantile);
    ca_interval_round(interval, &intervals->low[i], &intervals->high[i]);
    intervals->widened[i] = verdict->kind == CA_INTERVAL_WIDENED ? 1.0f : 0.0f;
}

bool ca_interval_layers_shares(const ca_image_layers *layers, double *marked, double *widened)
{
    const float *low = ca_layers_find(layers, "ConfidenceLow.Y"),
                *are_widened = ca_layers_find(layers, "ConfidenceWidened.Y");
    const size_t count = (size_t)layers->width * layers->height;
    if (!low || !are_widened) return false;
    size_t counts[2] = {0};
    for (size_t i = 0; i < count; i++) {
        counts[0] += isinf(low[i]) != 0;
        counts[1] += are_widened[i] > 0.0f;
    }
    *marked = (double)counts[0] / (double)count;
    *widened = (double)counts[1] / (double)count;
    return true;
}
