#include "render/record.h"

#include <stdio.h>

ca_status ca_render_record_attach(const ca_render_record *record, ca_image_layers *layers, ca_error *error)
{
    CA_TRY(ca_layers_set_text(layers, "caustica.version", record->version, error));
    CA_TRY(ca_layers_set_text(layers, "caustica.scene", record->scene, error));
    CA_TRY(ca_layers_set_text(layers, "caustica.integrator", record->integrator, error));
    CA_TRY(ca_layers_set_text(layers, "caustica.sampler", record->sampler, error));
    CA_TRY(ca_layers_set_number(layers, "caustica.seed", record->seed, error));
    CA_TRY(ca_layers_set_number(layers, "caustica.samplesPerPixel", record->samples_per_pixel, error));
    CA_TRY(ca_layers_set_text(layers, "caustica.filter", record->filter, error));
    CA_TRY(ca_layers_set_number(layers, "caustica.seconds", record->seconds, error));
    CA_TRY(ca_layers_set_number(layers, "caustica.threads", record->threads, error));
    if (record->confidence) CA_TRY(ca_layers_set_text(layers, "caustica.confidence", record->confidence, error));
    if (!record->by_blocks) return CA_OK;
    char range[48];
    snprintf(range, sizeof range, "%llu:%llu", (unsigned long long)record->blocks[0],
             (unsigned long long)record->blocks[1]);
    return ca_layers_set_text(layers, "caustica.blocks", range, error);
}
