#include "image/layers.h"

#include <assert.h>
#include <string.h>

ca_status ca_layers_create(ca_image_layers **layers, uint32_t width, uint32_t height, ca_error *error)
{
    *layers = ca_alloc_zeroed(1, sizeof **layers);
    if (!*layers) return ca_fail_memory(error, "image layers");
    (*layers)->width = (*layers)->full_width = width;
    (*layers)->height = (*layers)->full_height = height;
    return CA_OK;
}

void ca_layers_destroy(ca_image_layers *layers)
{
    if (!layers) return;
    for (size_t i = 0; i < layers->channel_count; ++i) ca_free(layers->channels[i].data);
    ca_free(layers->channels);
    ca_free(layers->attributes);
    ca_arena_clear(&layers->names);
    ca_free(layers);
}

ca_status ca_layers_add(ca_image_layers *layers, const char *name, float **data, ca_error *error)
{
    assert(!ca_layers_find(layers, name));
    ca_channel *channels =
        ca_array_grow(layers->channels, &layers->channel_capacity, layers->channel_count + 1, sizeof *channels);
    if (channels) layers->channels = channels;
    const ca_channel channel = {
        .name = channels ? ca_arena_strdup(&layers->names, name) : NULL,
        .data = channels ? ca_alloc_zeroed((size_t)layers->width * layers->height, sizeof(float)) : NULL,
    };
    if (!channel.name || !channel.data) {
        ca_free(channel.data);
        return ca_fail_memory(error, "image layers");
    }
    layers->channels[layers->channel_count++] = channel;
    *data = channel.data;
    return CA_OK;
}

void ca_layers_cut(ca_image_layers *layers, size_t count)
{
    while (layers->channel_count > count) ca_free(layers->channels[--layers->channel_count].data);
}

const float *ca_layers_find(const ca_image_layers *layers, const char *name)
{
    for (size_t i = 0; i < layers->channel_count; ++i)
        if (strcmp(layers->channels[i].name, name) == 0) return layers->channels[i].data;
    return NULL;
}

static ca_attribute *find_attribute(const ca_image_layers *layers, const char *name)
{
    for (size_t i = 0; i < layers->attribute_count; ++i)
        if (strcmp(layers->attributes[i].name, name) == 0) return &layers->attributes[i];
    return NULL;
}

const ca_attribute *ca_layers_attribute(const ca_image_layers *layers, const char *name)
{
    return find_attribute(layers, name);
}

/* The attribute of that name, a new one where there is none; NULL when out of memory. */
static ca_attribute *attribute_at(ca_image_layers *layers, const char *name)
{
    ca_attribute *there = find_attribute(layers, name);
    if (there) return there;
    ca_attribute *attributes = ca_array_grow(layers->attributes, &layers->attribute_capacity,
                                             layers->attribute_count + 1, sizeof *attributes);
    if (!attributes) return NULL;
    layers->attributes = attributes;
    const char *copy = ca_arena_strdup(&layers->names, name);
    if (!copy) return NULL;
    ca_attribute *attribute = &layers->attributes[layers->attribute_count++];
    *attribute = (ca_attribute){.name = copy};
    return attribute;
}

ca_status ca_layers_set_text(ca_image_layers *layers, const char *name, const char *text, ca_error *error)
{
    const char *copy = ca_arena_strdup(&layers->names, text);
    ca_attribute *attribute = copy ? attribute_at(layers, name) : NULL;
    if (!attribute) return ca_fail_memory(error, "image attribute");
    attribute->text = copy;
    attribute->number = 0.0;
    return CA_OK;
}

ca_status ca_layers_set_number(ca_image_layers *layers, const char *name, double number, ca_error *error)
{
    ca_attribute *attribute = attribute_at(layers, name);
    if (!attribute) return ca_fail_memory(error, "image attribute");
    attribute->text = NULL;
    attribute->number = number;
    return CA_OK;
}
