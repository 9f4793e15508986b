#include "live/snapshot.h"

#include <string.h>

ca_status ca_live_snapshot_create(ca_live_snapshot **snapshot, ca_image_layers *image,
                                  const ca_render_statistics *statistics, ca_error *error)
{
    *snapshot = ca_alloc_zeroed(1, sizeof **snapshot);
    if (!*snapshot) {
        ca_layers_destroy(image);
        return ca_fail_memory(error, "the live view");
    }
    **snapshot = (ca_live_snapshot){.image = image, .statistics = *statistics, .holders = 1};
    return CA_OK;
}

ca_live_snapshot *ca_live_snapshot_hold(ca_live_snapshot *snapshot)
{
    if (snapshot) __atomic_add_fetch(&snapshot->holders, 1, __ATOMIC_RELAXED);
    return snapshot;
}

void ca_live_snapshot_release(ca_live_snapshot *snapshot)
{
    if (!snapshot || __atomic_sub_fetch(&snapshot->holders, 1, __ATOMIC_ACQ_REL) > 0) return;
    ca_layers_destroy(snapshot->image);
    ca_free(snapshot);
}

static const float *find(const ca_image_layers *image, const char *name, size_t length)
{
    for (size_t i = 0; i < image->channel_count; i++)
        if (strlen(image->channels[i].name) == length && memcmp(image->channels[i].name, name, length) == 0)
            return image->channels[i].data;
    return NULL;
}

bool ca_live_planes_open(ca_live_planes *planes, ca_live_snapshot *snapshot, const char *names)
{
    const ca_image_layers *image = snapshot->image;
    *planes = (ca_live_planes){.plane_bytes = (size_t)image->width * image->height * sizeof(float)};
    for (const char *name = names;;) {
        const size_t length = strcspn(name, ",");
        const float *plane = planes->count < CA_LIVE_MOST_PLANES ? find(image, name, length) : NULL;
        if (!plane) return false;
        planes->planes[planes->count++] = plane;
        if (name[length] == '\0') break;
        name += length + 1;
    }
    planes->snapshot = ca_live_snapshot_hold(snapshot);
    return true;
}

void ca_live_planes_close(ca_live_planes *planes)
{
    ca_live_snapshot_release(planes->snapshot);
    *planes = (ca_live_planes){0};
}

size_t ca_live_planes_read(const ca_live_planes *planes, size_t position, char *buffer, size_t size)
{
    size_t copied = 0;
    while (copied < size && position < ca_live_planes_bytes(planes)) {
        const size_t plane = position / planes->plane_bytes, offset = position % planes->plane_bytes;
        const size_t rest = planes->plane_bytes - offset, part = rest < size - copied ? rest : size - copied;
        memcpy(buffer + copied, (const char *)planes->planes[plane] + offset, part);
        copied += part;
        position += part;
    }
    return copied;
}
