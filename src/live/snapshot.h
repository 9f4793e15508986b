/* A picture of a render so far, shared by the render and its viewers: never changed once it is made, released when
 * the last one lets it go. Threads: any. */
#ifndef CA_LIVE_SNAPSHOT_H
#define CA_LIVE_SNAPSHOT_H

#include "image/layers.h"

typedef struct ca_live_snapshot {
    ca_image_layers *image; /* owned */
    ca_render_statistics statistics;
    uint32_t version; /* counts pictures from 1 */
    uint32_t passes;  /* that it is made of */
    double seconds;   /* of rendering, that it is made of */
    uint32_t holders; /* atomic */
} ca_live_snapshot;

/* Takes the image over, also on failure. One holder: the caller. */
ca_status ca_live_snapshot_create(ca_live_snapshot **snapshot, ca_image_layers *image,
                                  const ca_render_statistics *statistics, ca_error *error);
ca_live_snapshot *ca_live_snapshot_hold(ca_live_snapshot *snapshot); /* NULL is allowed */
void ca_live_snapshot_release(ca_live_snapshot *snapshot);           /* likewise */

enum { CA_LIVE_MOST_PLANES = 16 };

/* Some channels of a picture one after the other, as 32 bit floats in the order of the machine's bytes. */
typedef struct ca_live_planes {
    ca_live_snapshot *snapshot; /* held */
    const float *planes[CA_LIVE_MOST_PLANES];
    size_t count, plane_bytes;
} ca_live_planes;

/* `names`: "R,G,B". Holds the snapshot. false where a channel is not there, or too many are asked for: nothing is
 * held. */
bool ca_live_planes_open(ca_live_planes *planes, ca_live_snapshot *snapshot, const char *names);
void ca_live_planes_close(ca_live_planes *planes);
static inline size_t ca_live_planes_bytes(const ca_live_planes *planes)
{
    return planes->count * planes->plane_bytes;
}
/* Copies what begins at `position`, at most `size` bytes; gives back how many these are, 0 at the end. */
size_t ca_live_planes_read(const ca_live_planes *planes, size_t position, char *buffer, size_t size);

#endif
